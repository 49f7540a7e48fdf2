//! Random walks through the refinement of whole images: frames of any budgets, spare time, and views given up. Whatever was done, every
//! pixel is in one leaf, and colours have no step where two interpolated leaves meet, be it inside a triangle or between two: a vertex of
//! one in the middle of the other's edge (a T-junction) would make one.

#[path = "support/random.rs"]
mod random;
#[path = "support/leaves.rs"]
mod support;

use random::Random;
use specula::backend::BackendKind;
use specula::frame::{Leaf, LeafKind};
use specula::scene::World;
use specula::{Budget, Engine, EngineOptions, Frame, Scene};
use std::collections::HashMap;
use std::ops::Range;
use support::{Place, inside, leaves, pixels};

const SIZE: (u32, u32) = (640, 480);

/// Under enough lights for subdivision to pay: smooth shapes, creases, borders of materials, and a floor that fills much of the image.
fn scene(shapes: &str) -> Scene {
    let light = |i: i32| {
        let (x, y) = (f64::from(i % 5) * 2.0 - 4.0, f64::from(i / 5) * 1.5 - 7.0);
        let z = 3.0 + f64::from(i * 7 % 4);
        let bright = 0.1 + 0.2 * f64::from(i32::from(i % 6 == 0));
        format!("Point(position: ({x}, {y}, {z}), intensity: {bright}),")
    };
    let lights: String = (0..20).map(light).collect();
    let text = format!(
        "(camera: Perspective(position: (3.0, -7.0, 4.0), target: (0.0, 0.0, 0.7), fov_degrees: 38.0),
        lights: [{lights}],
        materials: {{
            \"a\": (diffuse: (0.5, 0.2, 0.1), specular: 0.8, shininess: 60),
            \"b\": (diffuse: (0.1, 0.3, 0.5), specular: 0.6, shininess: 15, model: BlinnPhong),
        }},
        objects: [{shapes}])"
    );
    Scene::parse(&text, "walks.ron").expect("the scene is valid")
}

/// Every pixel that a triangle owns is in exactly one of its leaves; on a border it may touch several.
fn check_pixels(points: &[Option<Place>], all: &HashMap<u32, Vec<Leaf>>, knows_owners: bool) {
    for (index, place) in points.iter().enumerate() {
        let Some((triangle, point)) = *place else {
            continue;
        };
        // A backend without owners may draw nothing of a triangle that owns a pixel of the reference.
        let Some(of_triangle) = all.get(&triangle) else {
            assert!(!knows_owners, "nothing is drawn of pixel {index}");
            continue;
        };
        let least = |leaf| inside(leaf, point).into_iter().fold(f64::MAX, f64::min);
        let holders = of_triangle.iter().filter(|leaf| least(leaf) >= -1e-9);
        assert!(holders.count() >= 1, "pixel {index} is in no leaf");
        let holders = of_triangle.iter().filter(|leaf| least(leaf) > 1e-9);
        assert!(holders.count() <= 1, "pixel {index} is in several leaves");
    }
}

/// Whether the image shows the colours of its corners.
fn is_interpolated(leaf: &Leaf) -> bool {
    leaf.is_painted && leaf.kind == LeafKind::Interpolated && leaf.pixels > 0
}

fn colour_at(leaf: &Leaf, weights: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| {
        (0..3)
            .map(|k| weights[k] * f64::from(leaf.colours[k][c]))
            .sum()
    })
}

/// The vertices of an edge of the world, ascending.
fn ends(triangle: [u32; 3], k: usize) -> [u32; 2] {
    let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
    [a.min(b), a.max(b)]
}

/// Colours of two interpolated leaves agree wherever they meet. Returns how many points between two leaves were compared, inside
/// triangles and between them.
fn check_edges(
    world: &World,
    by_edge: &HashMap<[u32; 2], Vec<u32>>,
    all: &HashMap<u32, Vec<Leaf>>,
) -> [u64; 2] {
    let mut compared = [0; 2];
    for (&triangle, own) in all {
        let vertices = world.triangles[triangle as usize];
        for leaf in own.iter().filter(|leaf| is_interpolated(leaf)) {
            for (k, t) in (0..3).flat_map(|k| [0.0, 0.25, 0.5, 0.75].map(|t| (k, t))) {
                let mut weights = [0.0; 3];
                (weights[k], weights[(k + 1) % 3]) = (1.0 - t, t);
                let colour = colour_at(leaf, weights);
                let corners = leaf.corners.map(|corner| corner.weights().map(f64::from));
                let point: [f64; 3] =
                    std::array::from_fn(|i| (0..3).map(|c| weights[c] * corners[c][i]).sum());
                let mut compare = |other: &Leaf, point: [f64; 3]| {
                    let weights = inside(other, point);
                    let meets = weights.iter().all(|&w| w >= -1e-9);
                    if !(is_interpolated(other) && meets) || std::ptr::eq(other, leaf) {
                        return;
                    }
                    let there = colour_at(other, weights);
                    let step = (0..3)
                        .map(|c| (there[c] - colour[c]).abs())
                        .fold(0.0, f64::max);
                    assert!(
                        step < 1e-5,
                        "a step of {step} between {leaf:?} and {other:?}"
                    );
                    compared[usize::from(other.triangle != triangle)] += 1;
                };
                own.iter().for_each(|other| compare(other, point));
                // The same place on a triangle beyond the edge of this one that it is on, if it is on any.
                for edge in (0..3).filter(|&edge| point[(edge + 2) % 3].abs() < 1e-12) {
                    let neighbours = &by_edge[&ends(vertices, edge)];
                    for &neighbour in neighbours.iter().filter(|&&n| n != triangle) {
                        let theirs = world.triangles[neighbour as usize];
                        let there = theirs.map(|vertex| {
                            let place = vertices.iter().position(|&own| own == vertex);
                            place.map_or(0.0, |place| point[place])
                        });
                        let leaves = all.get(&neighbour).into_iter().flatten();
                        leaves.for_each(|other| compare(other, there));
                    }
                }
            }
        }
    }
    compared
}

/// Returns how many points were compared inside triangles and between them, and how many triangles were subdivided in the end.
fn walk(shapes: &str, backend: BackendKind, seeds: Range<u64>) -> [u64; 3] {
    let mut scene = scene(shapes);
    let camera = *scene.camera();
    let world = World::new(&scene);
    let mut by_edge: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
    for (&triangle, number) in world.triangles.iter().zip(0..) {
        for k in 0..3 {
            by_edge.entry(ends(triangle, k)).or_default().push(number);
        }
    }
    let (_, points) = pixels(&scene, SIZE);
    let mut seen = [0; 3];
    for seed in seeds {
        let mut random = Random(seed);
        let options = EngineOptions {
            backend,
            threads: Some(1),
            ..EngineOptions::default()
        };
        let mut engine = Engine::with_options(&scene, options).expect("the options are valid");
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        let mut subdivided = 0;
        for _ in 0..12 {
            if random.below(6) == 0 {
                // A look at something else, which may be interrupted.
                let mut other = camera;
                other.position.x += 0.5;
                scene.set_camera(other);
                engine.render(&scene, Budget::Work(random.below(50_000)), &mut frame);
                scene.set_camera(camera);
            }
            let units = 5_000 << random.below(9);
            let stats = engine.render(&scene, Budget::Work(units), &mut frame);
            let all = leaves(&engine);
            check_pixels(&points, &all, backend == BackendKind::Software);
            let [inside, between] = check_edges(&world, &by_edge, &all);
            seen = [seen[0] + inside, seen[1] + between, seen[2]];
            subdivided = stats.triangles_subdivided;
            if stats.converged {
                break;
            }
        }
        seen[2] += subdivided;
    }
    seen
}

#[test]
fn leaves_fit_together_after_any_frames() {
    let scenes = [
        "(shape: Sphere(slices: 7, stacks: 5), material: \"a\", position: (0.0, 0.0, 1.0), scale: 1.6)",
        "(shape: Teapot(tessellation: 2), material: \"a\"), (shape: Plane(width: 9.0, depth: 9.0, columns: 3, rows: 3), material: \"b\")",
        "(shape: Box(size: (2.0, 2.0, 1.5)), material: \"b\"), (shape: Plane(width: 9.0, depth: 9.0, columns: 2, rows: 2), material: \"a\")",
    ];
    // One refines mostly by quadratics and per-pixel shading, large leaves part by part; the other by subdivision alone.
    for (backend, seeds, least) in [
        (BackendKind::Software, 0..4, [10_000, 10_000, 0]),
        (BackendKind::Skia, 0..2, [10_000, 10_000, 200]),
    ] {
        let mut all = [0; 3];
        for shapes in scenes {
            let seen = walk(shapes, backend, seeds.clone());
            println!("{backend:?}: {seen:?} with {shapes}");
            all = std::array::from_fn(|i| all[i] + seen[i]);
        }
        let is_enough = all.iter().zip(least).all(|(&seen, least)| seen >= least);
        assert!(is_enough, "{backend:?}: {all:?}");
    }
}
