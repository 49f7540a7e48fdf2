//! The bounds miss nothing: a million random triangles, and every triangle and cluster of the scenes that come along, under a search
//! for the worst point of each.

mod cases;
mod clusters;
mod precision;
mod search;

use cases::{Case, Kind, Random, random_case};
use rayon::prelude::*;
use search::Worst;
use specula::highlight::{LightBound, TriangleLights};
use specula::output::Encoding;
use specula::scene::{Scene, ShadingLight, World};
use std::fmt;
use std::ops::Add;
use std::path::{Path, PathBuf};

/// Of the search itself, in `f64`.
const ROUNDING: f64 = 1e-12;

/// What is left out may be off by this many codes.
const MOST_CODES: f64 = 0.5 + 1e-6;

/// What was seen, lest a bound that says nothing or a search that finds nothing pass.
#[derive(Clone, Copy, Default)]
struct Tally {
    cases: usize,
    /// A light whose specular term is off by more than a code's worth (1/255) somewhere.
    deviates: usize,
    /// Those of them whose bound is at most four times that.
    tight: usize,
    /// Nothing of the light need be evaluated at a pixel, and it is on somewhere.
    ruled_out: usize,
    /// Its highlight need not, and there is one that deviates by a thousandth of a code.
    specular_left_out: usize,
    /// Largest error of what was left out, in codes.
    worst_codes: f64,
}

impl Add for Tally {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            cases: self.cases + other.cases,
            deviates: self.deviates + other.deviates,
            tight: self.tight + other.tight,
            ruled_out: self.ruled_out + other.ruled_out,
            specular_left_out: self.specular_left_out + other.specular_left_out,
            worst_codes: self.worst_codes.max(other.worst_codes),
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} cases, {} deviate, {} of them tightly bounded; {} ruled out, {} highlights left out, at most {:.3} codes off",
            self.cases,
            self.deviates,
            self.tight,
            self.ruled_out,
            self.specular_left_out,
            self.worst_codes
        )
    }
}

/// Whether what the search found is within the bounds of a light.
fn check_factors(bound: &LightBound, worst: &Worst) -> Result<(), String> {
    for (name, bound, range, deviation) in [
        ("diffuse", bound.diffuse, worst.diffuse, worst.deviation[0]),
        (
            "specular",
            bound.specular,
            worst.specular,
            worst.deviation[1],
        ),
    ] {
        let holds = bound.lo - ROUNDING <= range[0]
            && range[1] <= bound.hi + ROUNDING
            && deviation <= bound.deviation + ROUNDING;
        if !holds {
            return Err(format!(
                "{name} factor in {range:?}, off by {deviation}, outside of {bound:?}"
            ));
        }
    }
    Ok(())
}

/// How many codes a point is off when the terms of one light that are not active are interpolated.
fn codes_off(
    case: &Case,
    light: &ShadingLight,
    worst: &Worst,
    lights: &TriangleLights,
    encoding: Encoding,
) -> f64 {
    let left_out = [
        lights.active.diffuse.is_empty(),
        lights.active.specular.is_empty(),
    ];
    let mut most = 0.0_f64;
    for (values, off) in worst.points() {
        for c in 0..3 {
            let radiance = f64::from(light.radiance[c]);
            let amplitudes =
                [case.material.diffuse, case.material.specular].map(|k| radiance * f64::from(k[c]));
            let full = f64::from(case.material.ambient[c])
                + amplitudes[0] * values[0]
                + amplitudes[1] * values[1];
            let error: f64 = (0..2)
                .filter(|&term| left_out[term])
                .map(|term| amplitudes[term] * off[term])
                .sum();
            most = most.max((encoding.encode(full) - encoding.encode(full - error)).abs());
        }
    }
    most
}

/// Bounds and masks of a case with one light against the worst points found.
fn check_case(case: &Case, random: &mut Random) -> Result<Tally, String> {
    let light = &case.lights[0];
    let bound = case.bounds().light(light);
    let worst = search::worst(case, light, search::THOROUGH);
    check_factors(&bound, &worst)?;
    let mut tally = Tally {
        cases: 1,
        deviates: usize::from(worst.deviation[1] > 1.0 / 255.0),
        ..Tally::default()
    };
    if bound.specular.deviation <= 4.0 * worst.deviation[1] {
        tally.tight = tally.deviates;
    }
    for encoding in Encoding::ALL {
        let lights = case.masks(encoding);
        let codes = codes_off(case, light, &worst, &lights, encoding);
        if codes.is_nan() || codes > MOST_CODES {
            return Err(format!("{encoding}: {codes} codes off with {lights:?}"));
        }
        if random.below(8) == 0 {
            clusters::check_claim(case, &lights, encoding, random)?;
        }
        tally.worst_codes = tally.worst_codes.max(codes);
        if encoding == Encoding::Srgb && lights.active.specular.is_empty() {
            tally.specular_left_out = usize::from(worst.deviation[1] > 1e-3 / 255.0);
            let is_out = lights.active.diffuse.is_empty() && worst.diffuse[1] > 0.0;
            tally.ruled_out = usize::from(is_out);
        }
    }
    Ok(tally)
}

/// A million triangles of every kind, half of them in a hundred ways nasty, with exponents from 1 to 100,000.
#[test]
fn nothing_is_missed_on_random_triangles() {
    const CHUNKS: u64 = 1000;
    let per_chunk = if cfg!(debug_assertions) { 20 } else { 1000 };
    let found: Result<[Tally; Kind::COUNT], String> = (0..CHUNKS)
        .into_par_iter()
        .map(|chunk| {
            let mut random = Random::new(chunk);
            let mut tallies = [Tally::default(); Kind::COUNT];
            for index in 0..per_chunk {
                let kind = index % Kind::COUNT;
                let case = random_case(&mut random, Kind::ALL[kind]);
                let tally = check_case(&case, &mut random)
                    .map_err(|what| format!("chunk {chunk}, case {index}: {what}\n{case:?}"))?;
                tallies[kind] = tallies[kind] + tally;
            }
            Ok(tallies)
        })
        .try_reduce(
            || [Tally::default(); Kind::COUNT],
            |a, b| Ok(std::array::from_fn(|i| a[i] + b[i])),
        );
    let tallies = found.unwrap_or_else(|what| panic!("{what}"));
    for (kind, tally) in Kind::ALL.into_iter().zip(tallies) {
        println!("{kind:?}: {tally}");
    }
    let all = tallies.into_iter().fold(Tally::default(), Add::add);
    println!("all: {all}");
    // A bound that is trivial passes the above, and so does a search that is blind.
    assert!(all.deviates * 5 > all.cases, "{all}");
    assert!(all.tight * 4 > all.deviates, "{all}");
    assert!(all.ruled_out * 30 > all.cases, "{all}");
    assert!(all.specular_left_out * 100 > all.cases, "{all}");
    assert!(all.worst_codes > 0.4, "{all}");
}

/// The scenes that come along, and where they are.
fn scenes_that_come_along() -> impl Iterator<Item = (PathBuf, Scene)> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let entries = directory.read_dir().expect("the folder of scenes");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let paths = paths.filter(|path| path.extension().is_some_and(|ending| ending == "ron"));
    paths.map(|path| {
        let scene = Scene::load(&path).expect("a scene that comes along is valid");
        (path, scene)
    })
}

/// Every triangle of every scene that comes along under each of its lights, and under all of them together.
#[test]
fn nothing_is_missed_in_the_scenes_that_come_along() {
    let mut scenes = 0;
    for (path, scene) in scenes_that_come_along() {
        let tally = check_scene(&scene).unwrap_or_else(|what| panic!("{}: {what}", path.display()));
        println!("{}: {tally}", path.display());
        assert!(tally.deviates > 0 && tally.ruled_out > 0, "{tally}");
        scenes += 1;
    }
    assert!(scenes >= 8, "{scenes} scenes");
}

fn check_scene(scene: &Scene) -> Result<Tally, String> {
    let world = World::new(scene);
    let view = world.view(scene.camera(), 1280, 720);
    let step = if cfg!(debug_assertions) { 37 } else { 1 };
    (0..world.triangles.len())
        .into_par_iter()
        .step_by(step)
        .map(|triangle| {
            let case = Case::of_triangle(&world, view.eye, triangle);
            check_lights(&case).map_err(|what| format!("triangle {triangle}: {what}"))
        })
        .try_reduce(Tally::default, |a, b| Ok(a + b))
}

/// Each light by its bounds, and what the masks leave out of all lights together, at points all over the triangle.
fn check_lights(case: &Case) -> Result<Tally, String> {
    let bounds = case.bounds();
    let mut tally = Tally::default();
    for (index, light) in case.lights.iter().enumerate() {
        let bound = bounds.light(light);
        let worst = search::worst(case, light, search::QUICK);
        check_factors(&bound, &worst).map_err(|what| format!("light {index}: {what}"))?;
        let deviates = worst.deviation[1] > 1.0 / 255.0;
        tally.cases += 1;
        tally.deviates += usize::from(deviates);
        tally.tight += usize::from(deviates && bound.specular.deviation < 4.0 * worst.deviation[1]);
    }
    for encoding in Encoding::ALL {
        let lights = case.masks(encoding);
        let codes = search::codes_off(case, &lights.active, encoding);
        if codes.is_nan() || codes > MOST_CODES {
            return Err(format!("{encoding}: {codes} codes off with {lights:?}"));
        }
        tally.worst_codes = tally.worst_codes.max(codes);
        if encoding == Encoding::Srgb {
            tally.ruled_out += case.lights.len() - lights.active.diffuse.len();
            tally.specular_left_out += case.lights.len() - lights.active.specular.len();
        }
    }
    Ok(tally)
}
