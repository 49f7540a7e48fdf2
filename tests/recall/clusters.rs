//! What is said of a whole cluster holds on each of its triangles; and what is claimed of pictures in the making, of each form they take.

use super::cases::{Case, Kind, Random, blend, random_case, single};
use super::{MOST_CODES, Tally, check_factors, scenes_that_come_along, search};
use glam::DVec3;
use rayon::prelude::*;
use specula::geometry::build_clusters;
use specula::geometry::clusters::RUN;
use specula::highlight::{Claim, ClusterBound, ClusterShape, TriangleLights, cluster_masks};
use specula::illumination::reference::factors;
use specula::output::Encoding;
use specula::scene::{Eye, World};
use std::ops::Range;

/// One triangle of a cluster against what is said of all of them.
fn check_triangle(
    bound: &ClusterBound,
    masks: &[TriangleLights; 2],
    case: &Case,
    random: &mut Random,
) -> Result<Tally, String> {
    let mut tally = Tally::default();
    for (index, light) in case.lights.iter().enumerate() {
        let bound = bound.light(light);
        let worst = search::worst(case, light, search::QUICK);
        check_factors(&bound, &worst).map_err(|what| format!("light {index}: {what}"))?;
        let deviates = worst.deviation[1] > 1.0 / 255.0;
        tally.cases += 1;
        tally.deviates += usize::from(deviates);
        tally.tight += usize::from(deviates && bound.specular.deviation < 4.0 * worst.deviation[1]);
    }
    for (encoding, masks) in Encoding::ALL.into_iter().zip(masks) {
        let codes = search::codes_off(case, &masks.active, encoding);
        if codes.is_nan() || codes > MOST_CODES {
            return Err(format!("{encoding}: {codes} codes off with {masks:?}"));
        }
        check_claim(case, masks, encoding, random)?;
        tally.ruled_out += case.lights.len() - masks.active.diffuse.len();
    }
    Ok(tally)
}

fn check_cluster(world: &World, eye: Eye, index: usize, seed: u64) -> Result<Tally, String> {
    let mut tally = Tally::default();
    let cluster = world.clusters[index].triangles.clone();
    for first in cluster.clone().step_by(RUN) {
        let run = first..cluster.end.min(first + RUN as u32);
        tally = tally + check_run(world, eye, run, seed)?;
    }
    Ok(tally)
}

fn check_run(world: &World, eye: Eye, run: Range<u32>, seed: u64) -> Result<Tally, String> {
    let shape = ClusterShape::new(world, run.clone());
    let first = run.start;
    let material = usize::from(world.triangle_material[first as usize]);
    let bound = ClusterBound::new(&shape, &eye, &world.materials[material]);
    let masks = Encoding::ALL.map(|encoding| cluster_masks(world, &eye, encoding, first, &shape));
    let mut random = Random::new(seed);
    let mut tally = Tally::default();
    for triangle in run.clone() {
        let case = Case::of_triangle(world, eye, triangle as usize);
        let one = check_triangle(&bound, &masks, &case, &mut random)
            .map_err(|what| format!("triangle {triangle} of {run:?}: {what}\n{case:?}"))?;
        tally = tally + one;
    }
    Ok(tally)
}

#[test]
fn nothing_is_missed_on_the_clusters_of_the_scenes_that_come_along() {
    let mut all = Tally::default();
    for (path, scene) in scenes_that_come_along() {
        let world = World::new(&scene);
        let view = world.view(scene.camera(), 1280, 720);
        let step = if cfg!(debug_assertions) { 37 } else { 3 };
        let tally = (0..world.clusters.len())
            .into_par_iter()
            .step_by(step)
            .map(|index| check_cluster(&world, view.eye, index, index as u64))
            .try_reduce(Tally::default, |a, b| Ok(a + b));
        let tally = tally.unwrap_or_else(|what| panic!("{}: {what}", path.display()));
        println!("{}: {tally}", path.display());
        all = all + tally;
    }
    assert!(all.ruled_out * 20 > all.cases, "{all}");
}

/// A curved sheet of triangles, as fine as chance has it, about where the random case's triangle is.
fn sheet(case: &Case, random: &mut Random) -> World {
    let (origin, normal) = (
        blend(&case.positions, [1.0, 0.0, 0.0]),
        blend(&case.normals, [1.0, 0.0, 0.0]).normalize_or(DVec3::Z),
    );
    let along = normal.any_orthonormal_vector();
    let across = normal.cross(along);
    let size = random.between(1e-3, 1.0);
    let radius = size * random.between(0.7, 1e3);
    let side = 2 + random.below(5);
    let mut world = World {
        materials: vec![case.material],
        lights: case.lights.clone(),
        ..World::default()
    };
    for i in 0..=side {
        for j in 0..=side {
            let [x, y] = [i, j].map(|k| size * (k as f64 / side as f64 - 0.5));
            let below = origin - normal * radius;
            let out = (along * x + across * y + normal * radius).normalize();
            world.positions.push(single(below + out * radius));
            world.normals.push(single(out));
        }
    }
    let vertex = |i: usize, j: usize| (i * (side + 1) + j) as u32;
    for i in 0..side {
        for j in 0..side {
            let [a, b, c, d] = [
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ];
            world.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    world.triangle_material = vec![0; world.triangles.len()];
    world.clusters = build_clusters(&world.positions, &mut world.triangles, 0);
    world
}

#[test]
fn nothing_is_missed_on_random_sheets() {
    let chunks = if cfg!(debug_assertions) { 20 } else { 1000 };
    let found = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let mut random = Random::new(chunk);
            let mut tally = Tally::default();
            for kind in Kind::ALL {
                let case = random_case(&mut random, kind);
                let world = sheet(&case, &mut random);
                tally = tally
                    + check_cluster(&world, case.eye, 0, chunk)
                        .map_err(|what| format!("chunk {chunk}, {kind:?}: {what}"))?;
            }
            Ok(tally)
        })
        .try_reduce(Tally::default, |a, b| Ok(a + b));
    let all = found.unwrap_or_else(|what: String| panic!("{what}"));
    println!("{all}");
    assert!(all.deviates * 50 > all.cases, "{all}");
    assert!(all.tight * 10 > all.deviates, "{all}");
    assert!(all.ruled_out * 10 > all.cases, "{all}");
}

/// Linear colours of a point: all light, and that of the rough terms alone.
fn colours(case: &Case, masks: &TriangleLights, w: [f64; 3]) -> [[f64; 3]; 2] {
    let (point, normal) = (blend(&case.positions, w), blend(&case.normals, w));
    let mut full = case.material.ambient.map(f64::from);
    let mut rough = [0.0; 3];
    for (index, light) in case.lights.iter().enumerate() {
        let found = factors(point, normal, &case.eye, &case.material, light);
        for c in 0..3 {
            let radiance = f64::from(light.radiance[c]);
            let diffuse = radiance * f64::from(case.material.diffuse[c]) * found.diffuse;
            let specular = radiance * f64::from(case.material.specular[c]) * found.specular;
            full[c] += diffuse + specular;
            if masks.rough.diffuse.contains(index) {
                rough[c] += diffuse;
            }
            if masks.rough.specular.contains(index) {
                rough[c] += specular;
            }
        }
    }
    [full, rough]
}

/// Weights of corners and middles of edges in a quadratic.
fn quadratic([u, v, w]: [f64; 3]) -> [f64; 6] {
    [
        u * (2.0 * u - 1.0),
        v * (2.0 * v - 1.0),
        w * (2.0 * w - 1.0),
        4.0 * u * v,
        4.0 * v * w,
        4.0 * w * u,
    ]
}

/// Every form that a picture in the making takes, over parts of the triangle at random, at points at random.
pub(crate) fn check_claim(
    case: &Case,
    masks: &TriangleLights,
    encoding: Encoding,
    random: &mut Random,
) -> Result<(), String> {
    let Claim {
        interpolated,
        rough_evaluated,
    } = masks.claim;
    if rough_evaluated > interpolated {
        return Err(format!("{:?} grows", masks.claim));
    }
    let mix = |corners: &[[f64; 3]; 3], w: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|i| (0..3).map(|k| corners[k][i] * w[k]).sum())
    };
    for turn in 0..6 {
        // The whole of it, or some part.
        let part = if turn == 0 {
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        } else {
            [random.weights(), random.weights(), random.weights()]
        };
        let middle = |a: usize, b: usize| -> [f64; 3] {
            std::array::from_fn(|i| 0.5 * (part[a][i] + part[b][i]))
        };
        let places = [
            part[0],
            part[1],
            part[2],
            middle(0, 1),
            middle(1, 2),
            middle(2, 0),
        ];
        let nodes = places.map(|w| colours(case, masks, w));
        let local = random.weights();
        let [full, rough] = colours(case, masks, mix(&part, local));
        let weights = quadratic(local);
        // One whose first edge follows a neighbour that is linear there.
        let mut followed = nodes.map(|[full, _]| full);
        followed[3] = std::array::from_fn(|c| 0.5 * (followed[0][c] + followed[1][c]));
        for c in 0..3 {
            let linear: f64 = (0..3).map(|k| local[k] * nodes[k][0][c]).sum();
            let whole: f64 = (0..6).map(|k| weights[k] * nodes[k][0][c]).sum();
            let follows: f64 = (0..6).map(|k| weights[k] * followed[k][c]).sum();
            let rest: f64 = (0..6)
                .map(|k| weights[k] * (nodes[k][0][c] - nodes[k][1][c]))
                .sum();
            let forms = [
                ("linear", linear, interpolated),
                ("quadratic", whole, interpolated),
                ("following", follows, interpolated),
                ("rough", rough[c] + rest, rough_evaluated),
            ];
            // The rough terms are evaluated over the whole triangle only.
            let forms = &forms[..if turn == 0 { 4 } else { 3 }];
            for &(name, shown, claimed) in forms {
                let codes = (encoding.encode(shown) - encoding.encode(full[c])).abs();
                if codes.is_nan() || codes > f64::from(claimed) + 1e-6 {
                    return Err(format!(
                        "{encoding}: {name} over {part:?} is {codes} codes off at {local:?}, {masks:?}"
                    ));
                }
            }
        }
    }
    Ok(())
}
