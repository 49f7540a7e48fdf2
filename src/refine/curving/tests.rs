use super::*;
use crate::scene::Scene;
use crate::simd::SimdLevel;

const SIZE: [u32; 2] = [320, 240];

/// A scene, a view of it, and all of its triangles curved as if each had so many pixels.
fn curved(pixels: u32, threads: usize) -> (World, Curving) {
    let scene = Scene::parse(
        "(objects: [(shape: Sphere(slices: 12, stacks: 6)), (shape: Torus())])",
        "round",
    );
    let scene = scene.expect("the scene is valid");
    let world = World::new(&scene);
    let view = world.view(scene.camera(), SIZE[0], SIZE[1]);
    let exec = Exec {
        level: SimdLevel::detect().token().expect("detected"),
        threads,
    };
    let visible: Vec<u32> = (0..world.triangles.len() as u32).collect();
    // Neighbours differ.
    let pixels = move |triangle: u32| pixels >> (triangle % 5);
    let mut curving = Curving::default();
    let rule = CurvingRule([10, 40, 160, 640]);
    curving.begin(&visible, &pixels, rule);
    for n in [1, 2, 4, 8] {
        curving.round(exec, &world, &view, n);
    }
    curving.finish(exec, &world, &pixels);
    (world, curving)
}

/// The colour on an edge of a triangle, of which `t` is the weight of its end.
fn on_edge(curving: &Curving, half_edge: u32, t: f32) -> Option<[f32; 3]> {
    let mut weights = [0.0; 3];
    weights[half_edge as usize % 3] = 1.0 - t;
    weights[(half_edge as usize + 1) % 3] = t;
    curving
        .curved()
        .colour(half_edge / 3, weights[1], weights[2])
}

#[test]
fn there_is_no_step_where_curved_triangles_meet() {
    let (world, curving) = curved(2000, 1);
    let (mut compared, mut kinds) = (0, std::collections::BTreeSet::new());
    for half_edge in 0..3 * world.triangles.len() as u32 {
        for other in world.topology.ring(half_edge).skip(1) {
            let ends = |h: u32| {
                let corners = world.triangles[h as usize / 3];
                [corners[h as usize % 3], corners[(h as usize + 1) % 3]]
            };
            let ([a, b], [c, d]) = (ends(half_edge), ends(other));
            if [a, b] != [d, c] {
                continue;
            }
            let index = curving.curved().index();
            kinds.insert([half_edge, other].map(|h| index.divisions(h / 3)));
            for i in 0..=32 {
                let t = i as f32 / 32.0;
                let here = on_edge(&curving, half_edge, t);
                let there = on_edge(&curving, other, 1.0 - t);
                if let (Some(here), Some(there)) = (here, there) {
                    for (here, there) in here.iter().zip(there) {
                        assert!((here - there).abs() < 1e-4, "{here} beside {there}");
                    }
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 1000 && kinds.len() > 8, "{compared}, {kinds:?}");
}

#[test]
fn threads_make_no_difference() {
    let (world, one) = curved(2000, 1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
    let (_, two) = pool.expect("threads").install(|| curved(2000, 2));
    for triangle in 0..world.triangles.len() as u32 {
        assert_eq!(one.curved().get(triangle), two.curved().get(triangle));
        assert_eq!(one.error(triangle), two.error(triangle));
    }
    assert_eq!(one.counts(), two.counts());
}

#[test]
fn what_is_taken_back_was_never_divided() {
    let (_, mut curving) = curved(2000, 1);
    let before = curving.counts();
    curving.retreat(1);
    let after = curving.counts();
    assert!(before.parted_pixels > 0 && after.parted_pixels == 0);
    assert_eq!(after.nodes, before.nodes);
}
