//! Colours of whole images that hold whatever the triangles are.
//!
//! * **No wild colours**: a Gouraud pixel lies within the range of its triangle's three corner colours, channel by channel and
//!   within a code, also where the triangle passes through the near plane, reaches behind the eye, or is a sliver. An
//!   interpolation that divides by a corner's `w`, or takes a pixel beyond a snapped edge for a point outside of the triangle,
//!   shows here as a speck.
//! * **Levels and threads**: levels with fused multiply-add agree on every bit, the others with them within one code, and the
//!   number of threads changes nothing.

mod support;

use specula::backend::software::{NO_TRIANGLE, SoftwareBackend};
use specula::backend::{Backend, BasePaint};
use specula::geometry::Vec3s;
use specula::output::Frame;
use specula::output::encode::encode;
use specula::parallel::Exec;
use specula::scene::{View, World};
use specula::simd::SimdLevel;
use support::*;

const WIDTH: u32 = 150;
const HEIGHT: u32 = 100;

/// Draws and resolves the world; returns owners and colours.
fn image(exec: Exec, world: &World, view: &View, paint: BasePaint<'_>) -> (Vec<u32>, Frame) {
    let all = 0..world.triangles.len() as u32;
    let geometry = geometry(world, view, std::slice::from_ref(&all));
    let mut backend = SoftwareBackend::new();
    backend.rasterize(exec, geometry);
    backend.resolve(exec, geometry, paint);
    let mut frame = Frame::new(view.width, view.height);
    frame.write(|target| backend.present(exec, target));
    (Visibility::of(&backend).ids, frame)
}

/// Triangles of all shapes and sizes about the eye, in views with near planes from very near to in the middle of things.
fn soups(random: &mut Random) -> Vec<(World, View)> {
    let sizes: [&[f32]; 4] = [&[0.02, 0.1], &[0.3, 1.0], &[3.0, 30.0], &[1.0, 3000.0, 1e6]];
    let mut all = Vec::new();
    for near in [1e-5, 1e-3, 0.1, 2.0] {
        for sizes in sizes {
            let view = perspective(WIDTH, HEIGHT, 90.0, near, 50.0);
            all.push((soup_of_sizes(random, 120, sizes), view));
        }
    }
    all
}

/// Triangles many pixels long and as wide as a sub-pixel: where snapping is most of what decides which pixels they get, and
/// a pixel centre may lie outside of the triangle by more than its width.
fn needles(random: &mut Random) -> (World, View) {
    let mut world = empty_world();
    for _ in 0..3000 {
        let [a, b] = [(); 2].map(|()| {
            let (x, y) = (random.range(0.0, 150.0), random.range(0.0, 100.0));
            [x, y, random.range(0.0, 1.0)]
        });
        let share = random.range(0.1, 0.9);
        let c = std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share + random.range(-0.004, 0.004));
        add_both_sides(&mut world, [a, b, c], [[0.0, 0.0, 1.0]; 3]);
    }
    (world, flat(WIDTH, HEIGHT))
}

/// Large triangles in front of the eye with ordinary normals, the kind that interpolation is accurate for.
fn ordinary(random: &mut Random) -> (World, View) {
    let mut world = empty_world();
    for _ in 0..40 {
        let corners = [(); 3].map(|()| {
            let mut within = |reach: f32| random.range(-reach, reach);
            [within(3.0), within(2.0), 4.0 + within(2.0)]
        });
        let normals = [(); 3].map(|()| [random.range(-0.5, 0.5), random.range(-0.5, 0.5), -1.0]);
        add_triangle(&mut world, corners, normals);
        let ([a, b, c], [l, m, n]) = (corners, normals);
        add_triangle(&mut world, [a, c, b], [l, n, m]);
    }
    (world, perspective(WIDTH, HEIGHT, 90.0, 0.1, 50.0))
}

/// Colours of all vertices: those of a triangle differ from each other by no more than a little, so that what is wrong by more
/// is noticed, and reach below 0 and above 1.
fn colours_of_triangles(random: &mut Random, world: &World) -> Vec3s {
    let mut colours = Vec3s::default();
    colours.resize(world.positions.len());
    for triangle in &world.triangles {
        let shared = [(); 3].map(|()| random.range(-0.1, 1.1));
        for &vertex in triangle {
            let colour = shared.map(|v| v + random.range(-0.05, 0.05));
            colours.set(vertex as usize, colour);
        }
    }
    colours
}

#[test]
fn gouraud_pixels_lie_between_the_colours_of_their_triangles_corners() {
    let mut random = Random(301);
    let mut scenes = soups(&mut random);
    scenes.push(needles(&mut random));
    for (number, (world, view)) in scenes.into_iter().enumerate() {
        let colours = colours_of_triangles(&mut random, &world);
        let codes: Vec<_> = (0..colours.len())
            .map(|vertex| colours.get(vertex).map(|v| encode(f64::from(v))))
            .collect();
        on_each_exec(|exec| {
            let (ids, frame) = image(exec, &world, &view, BasePaint::Gouraud(&colours));
            let owned = ids.iter().zip(frame.pixels()).enumerate();
            for (at, (&id, pixel)) in owned.filter(|&(_, (&id, _))| id != NO_TRIANGLE) {
                let corners = world.triangles[id as usize].map(|v| codes[v as usize]);
                for channel in 0..3 {
                    let values = corners.map(|corner| corner[channel]);
                    let low = values.into_iter().fold(f64::INFINITY, f64::min) - 1.0;
                    let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max) + 1.0;
                    assert!(
                        (low..=high).contains(&f64::from(pixel[channel])),
                        "scene {number}, {exec:?}, pixel {at}, triangle {id}: {pixel:?} is not between {corners:?}"
                    );
                }
            }
        });
    }
}

/// Whether a level has fused multiply-add.
fn is_fused(level: SimdLevel) -> bool {
    matches!(level, SimdLevel::Avx2 | SimdLevel::Avx512 | SimdLevel::Neon)
}

/// All ways of painting, with some colours.
fn with_each_paint(random: &mut Random, world: &World, mut f: impl FnMut(BasePaint<'_>, &str)) {
    let (mut smooth, mut flat) = (Vec3s::default(), Vec3s::default());
    (0..world.positions.len()).for_each(|_| smooth.push(random.rgb()));
    world.triangles.iter().for_each(|_| flat.push(random.rgb()));
    f(BasePaint::Gouraud(&smooth), "gouraud");
    f(BasePaint::Flat(&flat), "flat");
    f(BasePaint::Phong, "phong");
}

#[test]
fn fused_levels_agree_on_every_bit_and_threads_change_none() {
    let mut random = Random(302);
    let mut scenes = soups(&mut random);
    scenes.extend((0..4).map(|_| ordinary(&mut random)));
    for (number, (world, view)) in scenes.iter().enumerate() {
        with_each_paint(&mut random, world, |paint, name| {
            for fused in [false, true] {
                let mut first: Option<Frame> = None;
                for level in SimdLevel::available().filter(|&level| is_fused(level) == fused) {
                    let exec = Exec {
                        level: level.token().expect("available"),
                        threads: 1,
                    };
                    let (_, one) = image(exec, world, view, paint);
                    let (_, two) = on_two_threads(exec, |exec| image(exec, world, view, paint));
                    let what = format!("scene {number}, {name}, {level}");
                    assert!(one.pixels() == two.pixels(), "{what}: threads");
                    let first = first.get_or_insert_with(|| one.clone());
                    assert!(!fused || one.pixels() == first.pixels(), "{what}");
                }
            }
        });
    }
}

#[test]
fn levels_agree_within_a_code() {
    let mut random = Random(303);
    let mut scenes = soups(&mut random);
    scenes.extend((0..4).map(|_| ordinary(&mut random)));
    for (number, (world, view)) in scenes.iter().enumerate() {
        with_each_paint(&mut random, world, |paint, name| {
            let (ids, want) = image(best(), world, view, paint);
            for exec in levels() {
                let (other, frame) = image(exec, world, view, paint);
                assert_eq!(other, ids, "scene {number}, {exec:?}");
                for (at, (got, want)) in frame.pixels().iter().zip(want.pixels()).enumerate() {
                    let far = (0..4).any(|channel| got[channel].abs_diff(want[channel]) > 1);
                    let what = format!("scene {number}, {name}, {exec:?}, pixel {at}");
                    assert!(!far, "{what}: {got:?} instead of {want:?}");
                }
            }
        });
    }
}
