//! How many of the triangles that a test marks hold a highlight that exceeds a code, and how many of those it marks: our bounds, and the
//! paper's test by signs at the vertices.

use super::cases::Case;
use super::search;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use specula::highlight::{SignBits, compute_signs};
use specula::measure::ReferenceImage;
use specula::scene::{Camera, Scene, World};
use specula::simd::SimdLevel;
use std::collections::BTreeSet;

const TEAPOT: &str = include_str!("../../scenes/teapot.ron");

/// Views from all around, at least.
const VIEWS: u32 = 6;

/// What a test said of triangles, and what is so.
#[derive(Clone, Copy, Default)]
struct Count {
    marked: u32,
    exceeding: u32,
    both: u32,
}

impl Count {
    fn add(&mut self, is_marked: bool, exceeds: bool) {
        self.marked += u32::from(is_marked);
        self.exceeding += u32::from(exceeds);
        self.both += u32::from(is_marked && exceeds);
    }

    fn plus(self, other: Self) -> Self {
        Self {
            marked: self.marked + other.marked,
            exceeding: self.exceeding + other.exceeding,
            both: self.both + other.both,
        }
    }

    fn precision(self) -> f64 {
        f64::from(self.both) / f64::from(self.marked)
    }

    fn recall(self) -> f64 {
        f64::from(self.both) / f64::from(self.exceeding)
    }
}

/// By triangles: ours, the paper's; by triangles and lights: ours, the paper's.
type Counts = [Count; 4];

/// The camera turned round the target about the vertical.
fn turned(camera: Camera, view: u32) -> Camera {
    let turn = DMat3::from_rotation_z(f64::from(view) * std::f64::consts::TAU / f64::from(VIEWS));
    let arm: DVec3 = camera.position - camera.target;
    Camera {
        position: camera.target + turn * arm,
        ..camera
    }
}

fn count(world: &World, camera: &Camera) -> Counts {
    let view = world.view(camera, 640, 480);
    let ids = ReferenceImage::render(world, &view, 1).ids;
    let visible: BTreeSet<u32> = ids
        .into_iter()
        .filter(|&id| (id as usize) < world.triangles.len())
        .collect();
    let level = SimdLevel::detect().token().expect("detected");
    let mut bits = SignBits::default();
    let mut counts = Counts::default();
    for triangle in visible {
        let vertices = world.triangles[triangle as usize];
        let case = Case::of_triangle(world, view.eye, triangle as usize);
        compute_signs(level, world, view.eye, &vertices, &mut bits);
        let pht = bits.pht_lights([0, 1, 2]);
        let bounds = case.bounds();
        let mut any = [false; 3];
        for (index, light) in case.lights.iter().enumerate() {
            let brightest = (0..3)
                .map(|c| f64::from(light.radiance[c] * case.material.specular[c]))
                .fold(0.0, f64::max);
            let exceeds_code = |factor: f64| factor * brightest > 1.0 / 255.0;
            let exceeds = exceeds_code(search::worst(&case, light, search::THOROUGH).specular[1]);
            let ours = exceeds_code(bounds.light(light).specular.hi);
            let papers = pht.contains(index);
            counts[2].add(ours, exceeds);
            counts[3].add(papers, exceeds);
            for (any, is) in any.iter_mut().zip([exceeds, ours, papers]) {
                *any |= is;
            }
        }
        counts[0].add(any[1], any[0]);
        counts[1].add(any[2], any[0]);
    }
    counts
}

/// On visible triangles of the paper's teapot, from all around, with the paper's four lights.
#[test]
fn most_triangles_that_are_said_to_hold_a_highlight_do() {
    let scene = Scene::parse(TEAPOT, "teapot.ron").expect("the scene is valid");
    for exponent in [10.0, 20.0, 50.0, 100.0, 200.0] {
        let mut world = World::new(&scene);
        for material in &mut world.materials {
            material.shininess = exponent;
        }
        let counts = (0..VIEWS)
            .into_par_iter()
            .map(|view| count(&world, &turned(*scene.camera(), view)))
            .reduce(Counts::default, |a, b| {
                std::array::from_fn(|i| a[i].plus(b[i]))
            });
        for (name, pair) in [("triangles", [0, 1]), ("with light", [2, 3])] {
            let [ours, papers] = pair.map(|i| counts[i]);
            println!(
                "exponent {exponent}, {name}: {} exceed a code; ours marks {}, precision {:.3}, recall {:.3}; the paper's {}, {:.3}, {:.3}",
                ours.exceeding,
                ours.marked,
                ours.precision(),
                ours.recall(),
                papers.marked,
                papers.precision(),
                papers.recall()
            );
            assert!(ours.exceeding > 100, "{exponent}");
            assert!(
                ours.both == ours.exceeding,
                "{exponent}: highlights are missed"
            );
            let least = if name == "triangles" { 0.6 } else { 0.55 };
            assert!(
                ours.precision() >= least,
                "{exponent}: {}",
                ours.precision()
            );
            // It looks for centres, and finds no others.
            assert!(papers.recall() < 0.9, "{exponent}: {}", papers.recall());
        }
    }
}
