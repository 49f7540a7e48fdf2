//! Random walks through refinement: whatever is split, the leaves stay a conforming partition.

use super::forest::NONE;
use super::{Forest, LeafId, LeafState, PlanOutcome, SplitOutcome};
use crate::geometry::bary::blend;
use crate::geometry::topology::Topology;
use crate::geometry::{Bary, Mesh, Vec3s, shapes};
use crate::output::Encoding;
use crate::parallel::Exec;
use crate::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial, View, World};
use crate::simd::SimdLevel;
use std::collections::{HashMap, HashSet};

/// Numerical Recipes' linear congruential generator: good enough to pick leaves.
struct Random(u32);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as usize % n
    }
}

fn exec() -> Exec {
    Exec {
        level: SimdLevel::detect().token().expect("detected"),
        threads: 1,
    }
}

fn world_of(mesh: &Mesh) -> World {
    let mut world = World {
        materials: vec![ShadingMaterial {
            ambient: [0.02; 3],
            diffuse: [0.6, 0.3, 0.2],
            specular: [0.6; 3],
            shininess: 40.0,
            model: ReflectionModel::Phong,
        }],
        lights: vec![ShadingLight {
            vector: [2.0, 1.0, 3.0],
            is_point: true,
            radiance: [1.0; 3],
        }],
        triangles: mesh.triangles.clone(),
        triangle_material: vec![0; mesh.triangles.len()],
        vertex_material: vec![0; mesh.positions.len()],
        ..World::default()
    };
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        world.positions.push(p.as_vec3().to_array());
        world.normals.push(n.as_vec3().to_array());
    }
    world.topology = Topology::new(&world.positions, &world.triangles);
    world
}

const EYE: Eye = Eye::Point([4.0, 0.5, 1.0]);

/// Only where the eye is matters.
const VIEW: View = View {
    width: 0,
    height: 0,
    pixel_from_world: glam::DMat4::IDENTITY,
    eye: EYE,
    encoding: Encoding::Srgb,
};

fn base_colours(world: &World) -> Vec3s {
    let mut colours = Vec3s::default();
    colours.resize(world.positions.len());
    let all: Vec<u32> = (0..world.positions.len() as u32).collect();
    crate::illumination::shade_vertices(exec().level, world, EYE, &all, &mut colours);
    colours
}

/// Plants some roots and splits random edges of random leaves; calls `check` after every round.
fn walk(world: &World, seed: u32, rounds: usize, mut check: impl FnMut(&Forest, &Vec3s)) {
    let colours = base_colours(world);
    let mut forest = Forest::default();
    forest.reset(world);
    let mut random = Random(seed);
    let (mut planted, mut outcomes) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        let triangle = random.below(world.triangles.len()) as u32;
        forest.plant(world, &colours, triangle, 1000);
        for _ in 0..4 {
            let open = open_leaves(&forest);
            if open.is_empty() {
                continue;
            }
            let leaf = open[random.below(open.len())];
            let marks = 1 + random.below(7) as u8;
            forest.plan_split(world, &colours, leaf, marks, |_| 1000);
        }
        forest.illuminate(exec(), world, &VIEW, &colours, &mut planted);
        outcomes.clear();
        forest.conclude_splits(world, &mut outcomes);
        if let Some(SplitOutcome::Committed { children, .. }) = outcomes.first() {
            // Some leaves are finished early.
            if random.below(8) == 0 {
                forest.close(world, children.start);
            }
        }
        check(&forest, &colours);
    }
    let splits = forest.leaves.iter().filter(|l| l.state == LeafState::Split);
    assert!(splits.count() > rounds / 4, "the walk has split something");
}

fn open_leaves(forest: &Forest) -> Vec<LeafId> {
    (0..forest.leaves.len() as LeafId)
        .filter(|&id| forest.leaf(id).state == LeafState::Open)
        .collect()
}

fn meshes() -> Vec<World> {
    let cuboid = shapes::cuboid(glam::DVec3::new(1.0, 2.0, 0.5));
    let mut fan = shapes::plane(1.0, 1.0, 1, 1);
    // A third triangle on the diagonal makes it a non-manifold edge.
    let [a, _, c] = fan.triangles[0];
    fan.positions.push(glam::DVec3::new(0.1, 0.2, 1.0));
    fan.normals.push(glam::DVec3::Z);
    fan.triangles.push([a, c, fan.positions.len() as u32 - 1]);
    [shapes::sphere(8, 5), cuboid, fan, shapes::teapot(2, false)]
        .iter()
        .map(world_of)
        .collect()
}

#[test]
fn leaves_partition_their_roots() {
    for (seed, world) in meshes().iter().enumerate() {
        walk(world, seed as u32, 120, |forest, _| {
            let mut area: HashMap<u32, i64> = HashMap::new();
            for leaf in forest.leaves.iter().filter(|l| l.state != LeafState::Split) {
                let doubled = Bary::doubled_area(leaf.corners);
                assert!(doubled > 0, "no leaf is turned over or empty");
                *area.entry(leaf.triangle).or_default() += i64::from(doubled);
            }
            for (triangle, doubled) in area {
                assert_eq!(doubled, 1 << 30, "triangle {triangle} is covered once");
            }
        });
    }
}

#[test]
fn no_leaf_has_a_vertex_of_another_in_the_middle_of_an_edge() {
    for (seed, world) in meshes().iter().enumerate() {
        walk(world, 100 + seed as u32, 120, |forest, _| {
            let open = open_leaves(forest);
            let position = |v: u32| forest.vertices.position(world, v).map(f32::to_bits);
            let used: HashSet<_> = open
                .iter()
                .flat_map(|&id| forest.leaf(id).vertices.map(position))
                .collect();
            for &id in &open {
                let leaf = forest.leaf(id);
                for (k, &midpoint) in leaf.midpoints.iter().enumerate() {
                    let ends = [leaf.vertices[k], leaf.vertices[(k + 1) % 3]].map(position);
                    // The edges without length at the lid's pole have no middle.
                    if midpoint == NONE || ends[0] == ends[1] {
                        continue;
                    }
                    assert!(
                        !used.contains(&position(midpoint)),
                        "leaf {id} of triangle {} has a T-junction",
                        leaf.triangle
                    );
                }
            }
        });
    }
}

#[test]
fn leaves_that_meet_at_an_edge_of_a_smooth_mesh_share_its_vertices() {
    let world = world_of(&shapes::sphere(8, 5));
    walk(&world, 7, 150, |forest, _| {
        let mut by_position: HashMap<[u32; 3], u32> = HashMap::new();
        for id in open_leaves(forest) {
            for vertex in forest.leaf(id).vertices {
                let position = forest.vertices.position(&world, vertex).map(f32::to_bits);
                let first = *by_position.entry(position).or_insert(vertex);
                assert_eq!(first, vertex, "one colour for each place: no seams");
            }
        }
    });
}

#[test]
fn refined_vertices_lie_where_their_barycentrics_say() {
    let world = world_of(&shapes::teapot(2, false));
    walk(&world, 3, 100, |forest, _| {
        for id in open_leaves(forest) {
            let leaf = forest.leaf(id);
            let root = world.triangles[leaf.triangle as usize];
            for (corner, vertex) in leaf.corners.into_iter().zip(leaf.vertices) {
                let weights = corner.weights();
                let interpolate =
                    |array: &Vec3s| blend(weights, root.map(|v| array.get(v as usize)));
                let pairs = [
                    (
                        interpolate(&world.positions),
                        forest.vertices.position(&world, vertex),
                    ),
                    (
                        interpolate(&world.normals),
                        forest.vertices.normal(&world, vertex),
                    ),
                ];
                for (expected, got) in pairs {
                    for k in 0..3 {
                        assert!((expected[k] - got[k]).abs() < 1e-5, "{expected:?} {got:?}");
                    }
                }
            }
        }
    });
}

#[test]
fn committed_splits_lower_the_error_that_dense_sampling_finds() {
    let world = world_of(&shapes::sphere(8, 5));
    let colours = base_colours(&world);
    let mut forest = Forest::default();
    forest.reset(&world);
    let (mut planted, mut outcomes) = (Vec::new(), Vec::new());
    for triangle in 0..world.triangles.len() as u32 {
        forest.plant(&world, &colours, triangle, 200);
    }
    let mut last = f64::INFINITY;
    for round in 0..4 {
        let measured = dense_error(&world, &forest, &colours);
        assert!(measured < last, "round {round}: {measured} after {last}");
        last = measured;
        forest.illuminate(exec(), &world, &VIEW, &colours, &mut planted);
        for id in open_leaves(&forest) {
            forest.plan_split(&world, &colours, id, 7, |_| 200);
        }
        forest.illuminate(exec(), &world, &VIEW, &colours, &mut planted);
        forest.conclude_splits(&world, &mut outcomes);
    }
}

/// Sum over leaves of mean squared error times area, by the reference at many points.
fn dense_error(world: &World, forest: &Forest, colours: &Vec3s) -> f64 {
    use crate::illumination::reference;
    use crate::output::encode::encode;
    let mut total = 0.0;
    for id in open_leaves(forest) {
        let leaf = forest.leaf(id);
        let corners = forest.colours(colours, id);
        let points = leaf.vertices.map(|v| forest.vertices.position(world, v));
        let normals = leaf.vertices.map(|v| forest.vertices.normal(world, v));
        let area = f64::from(Bary::doubled_area(leaf.corners)) / f64::from(1 << 30);
        for index in 0..64 {
            let weights = super::estimate::sample_weights(index);
            let at = |v: [[f32; 3]; 3]| reference::vector(blend(weights, v));
            let shaded = reference::shade(
                at(points),
                at(normals),
                &EYE,
                &world.materials[0],
                &world.lights,
            );
            let interpolated = at(corners).to_array();
            for (shaded, interpolated) in shaded.rgb.into_iter().zip(interpolated) {
                let d = encode(shaded) - encode(interpolated);
                total += d * d * area;
            }
        }
    }
    total
}

#[test]
fn a_leaf_is_not_split_before_its_midpoints_are_illuminated() {
    let world = world_of(&shapes::plane(1.0, 1.0, 1, 1));
    let colours = base_colours(&world);
    let mut forest = Forest::default();
    forest.reset(&world);
    let mut planted = Vec::new();
    let root = forest
        .plant(&world, &colours, 0, 10)
        .expect("there is room");
    forest.illuminate(exec(), &world, &VIEW, &colours, &mut planted);
    assert_eq!(planted, [root]);
    // The first call plants the other half of the square; until that is illuminated nothing can be planned with it.
    for _ in 0..2 {
        let outcome = forest.plan_split(&world, &colours, root, 7, |_| 10);
        assert_eq!(outcome, PlanOutcome::Later);
    }
    forest.illuminate(exec(), &world, &VIEW, &colours, &mut planted);
    assert_eq!(planted.len(), 2);
    let outcome = forest.plan_split(&world, &colours, root, 7, |_| 10);
    assert_eq!(outcome, PlanOutcome::Planned);
}

#[test]
fn asked_again_a_split_that_does_not_help_is_carried_out() {
    // A matte plane under distant light has one colour: no split helps.
    let mut world = world_of(&shapes::plane(1.0, 1.0, 1, 1));
    world.materials[0].specular = [0.0; 3];
    world.lights[0].is_point = false;
    let colours = base_colours(&world);
    let mut forest = Forest::default();
    forest.reset(&world);
    let (mut planted, mut outcomes) = (Vec::new(), Vec::new());
    let root = forest
        .plant(&world, &colours, 0, 10)
        .expect("there is room");
    let mut split = |forest: &mut Forest| {
        outcomes.clear();
        loop {
            let plan = forest.plan_split(&world, &colours, root, 7, |_| 10);
            forest.illuminate(exec(), &world, &VIEW, &colours, &mut planted);
            if plan == PlanOutcome::Planned {
                break;
            }
        }
        forest.conclude_splits(&world, &mut outcomes);
        outcomes.pop().expect("one split was planned")
    };
    let first = split(&mut forest);
    let SplitOutcome::Rejected { leaf, error } = first else {
        panic!("{first:?}");
    };
    assert_eq!(leaf, root);
    forest.forbid_splitting(leaf, error);
    let second = split(&mut forest);
    assert!(
        matches!(second, SplitOutcome::Committed { .. }),
        "{second:?}"
    );
}

#[test]
fn an_edge_is_not_split_when_its_other_side_has_no_room_to_follow() {
    // Each triangle is alone but for the two of the last square.
    let mesh = shapes::plane(1.0, 1.0, 1, 1);
    let mut world = world_of(&mesh);
    let [a, b] = [mesh.triangles[0], mesh.triangles[1]];
    let copies = super::forest::MAX_LEAVES - 1;
    for copy in 0..copies as u32 - 1 {
        // Without length on any edge, so that it has no neighbours.
        world.triangles.push([copy % 4; 3]);
        world.triangle_material.push(0);
    }
    assert_eq!(world.triangles[..2], [a, b]);
    world.topology = Topology::new(&world.positions, &world.triangles);
    let colours = base_colours(&world);
    let mut forest = Forest::default();
    forest.reset(&world);
    let root = forest.plant(&world, &colours, 0, 10).expect("room");
    for triangle in 2..world.triangles.len() as u32 {
        assert!(forest.plant(&world, &colours, triangle, 0).is_some());
    }
    // One place is left, and nobody to take it but a triangle that is not the neighbour.
    world.triangles.push([0; 3]);
    world.triangle_material.push(0);
    forest.plant(&world, &colours, copies as u32 + 1, 0);
    forest.illuminate(exec(), &world, &VIEW, &colours, &mut Vec::new());
    let outcome = forest.plan_split(&world, &colours, root, 7, |_| 10);
    assert_eq!(outcome, PlanOutcome::Never);
    assert!(!forest.is_planted(1), "the forest is full");
}

#[test]
fn errors_are_estimated_against_what_the_device_shows() {
    use crate::illumination::reference;
    use crate::output::Interpolation;
    use glam::{DMat4, DVec4};
    let mut world = world_of(&shapes::sphere(8, 5));
    // Smooth, so that edges tell what is inside.
    world.materials[0].specular = [0.0; 3];
    world.materials[0].ambient = [0.3; 3];
    let colours = base_colours(&world);
    // Strong perspective: w is 1.1 less the distance towards the viewer.
    let view = View {
        width: 100,
        height: 80,
        pixel_from_world: DMat4::from_cols(
            DVec4::new(0.0, 0.0, 0.0, -1.0),
            DVec4::new(30.0, 0.0, 0.0, 0.0),
            DVec4::new(0.0, -30.0, 0.0, 0.0),
            DVec4::new(55.0, 44.0, 0.1, 1.1),
        ),
        eye: EYE,
        encoding: Encoding::Srgb,
    };
    let estimate = |view: &View, declared: Interpolation| {
        let mut forest = Forest::default();
        forest.reset(&world);
        forest.draw_once(exec().level, view, declared, &colours);
        for triangle in 0..world.triangles.len() as u32 {
            forest.plant(&world, &colours, triangle, 10);
        }
        forest.illuminate(exec(), &world, view, &colours, &mut Vec::new());
        let leaves = open_leaves(&forest);
        leaves
            .iter()
            .map(|&id| f64::from(forest.leaf(id).error))
            .sum::<f64>()
    };
    let measured = |view: &View, shown: Interpolation| {
        let encode = |light| view.encoding.encode(light);
        let mut total = 0.0;
        for triangle in &world.triangles {
            let at = |array: &Vec3s, weights: [f32; 3]| {
                reference::vector(blend(weights, triangle.map(|v| array.get(v as usize))))
            };
            let w = triangle.map(|v| view.project(world.positions.get(v as usize))[3]);
            for index in 0..64 {
                let weights = super::estimate::sample_weights(index);
                let shaded = reference::shade(
                    at(&world.positions, weights),
                    at(&world.normals, weights),
                    &EYE,
                    &world.materials[0],
                    &world.lights,
                );
                let scaled: [f64; 3] = std::array::from_fn(|i| f64::from(weights[i]) * w[i]);
                let sum: f64 = scaled.iter().sum();
                for channel in 0..3 {
                    let corner = |i: usize| {
                        let colour = colours.get(triangle[i] as usize);
                        f64::from(colour[channel])
                    };
                    let code = match shown {
                        Interpolation::LinearPerspective => {
                            encode((0..3).map(|i| f64::from(weights[i]) * corner(i)).sum())
                        }
                        Interpolation::EncodedAffine => {
                            (0..3).map(|i| scaled[i] / sum * encode(corner(i))).sum()
                        }
                    };
                    total += (encode(shaded.rgb[channel]) - code).powi(2) / (3.0 * 64.0);
                }
            }
        }
        total
    };
    let modes = [
        Interpolation::LinearPerspective,
        Interpolation::EncodedAffine,
    ];
    for encoding in Encoding::ALL {
        let view = view.with_encoding(encoding);
        for declared in modes {
            let (got, want) = (estimate(&view, declared), measured(&view, declared));
            assert!(
                (0.88..1.12).contains(&(got / want)),
                "{encoding}, {declared:?}: {got} estimated, {want} measured"
            );
        }
        let [linear, affine] = modes.map(|shown| measured(&view, shown));
        assert!(
            linear < 0.75 * affine,
            "{encoding}: the two differ, or this shows nothing: {linear} {affine}"
        );
    }
}
