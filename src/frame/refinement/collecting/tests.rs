//! Collecting against a reference that looks at one triangle after the other, and remembers nothing in between.

use super::*;
use crate::backend::Backend;
use crate::backend::software::SoftwareBackend;
use crate::clock::ManualClock;
use crate::frame::Method;
use crate::frame::base::BaseImage;
use crate::parallel::Turn;
use crate::scene::Scene;
use crate::schedule::{Budget, CancelToken};
use crate::simd::SimdLevel;
use crate::visibility::Culler;

/// Two fine teapots, one of them matte, and large triangles, under more lights than share a word.
fn scene() -> Scene {
    let light = |i: i32| {
        format!(
            "Point(position: ({}, {}, 6), intensity: 0.1),",
            4 - i,
            i - 9
        )
    };
    let lights: String = (0..12).map(light).collect();
    Scene::parse(
        &format!(
            r#"(
                camera: Perspective(position: (0, -9, 4), target: (0, 0, 1), fov_degrees: 40),
                lights: [{lights}],
                materials: {{
                    "glossy": (diffuse: (0.7, 0.3, 0.2), specular: 0.6, shininess: 60),
                    "matte": (diffuse: (0.2, 0.4, 0.7), specular: 0),
                }},
                objects: [
                    (shape: Teapot(tessellation: 12), material: "glossy", position: (-2, 0, 0)),
                    (shape: Teapot(tessellation: 12), material: "matte", position: (2, 0, 0)),
                    (shape: Plane(width: 30, depth: 30, columns: 5, rows: 5), material: "glossy"),
                ],
            )"#
        ),
        "collecting",
    )
    .expect("a valid scene")
}

/// An image whose refinement may begin.
struct Image {
    world: World,
    view: View,
    base: BaseImage,
    backend: SoftwareBackend,
}

impl Image {
    fn new(exec: Exec) -> Self {
        let scene = scene();
        let world = World::new(&scene);
        let view = world.view(scene.camera(), 320, 180);
        let mut image = Self {
            base: BaseImage::default(),
            backend: SoftwareBackend::new(),
            world,
            view,
        };
        let (world, view) = (&image.world, &image.view);
        image.base.cull(&mut Culler::new(&world.clusters), view);
        image
            .base
            .rasterize(exec, world, view, &mut image.backend, None, Turn::WHOLE);
        image.base.shade(
            exec,
            Method::Adaptive,
            world,
            view,
            &image.backend,
            Turn::WHOLE,
        );
        image
    }

    /// Collects everything, with a budget of its own for each piece.
    fn collect(&mut self, exec: Exec, method: Method, budget: Budget) -> Refinement {
        let mut refinement = Refinement::default();
        self.collect_into(&mut refinement, exec, method, budget);
        refinement
    }

    fn collect_into(
        &mut self,
        refinement: &mut Refinement,
        exec: Exec,
        method: Method,
        budget: Budget,
    ) {
        let (world, view) = (&self.world, &self.view);
        refinement.begin(exec, method, world, view, &self.base, &self.backend);
        let mut stage = Stage {
            exec,
            world,
            view,
            base: &self.base,
            backend: &mut self.backend,
        };
        let (clock, cancel) = (ManualClock::default(), CancelToken::new());
        let mut pieces = 0;
        while refinement.is_collecting() {
            assert!(!refinement.is_finished());
            let mut allowance = Allowance::new(budget, &clock, 0.0, &cancel);
            assert!(refinement.step(&mut stage, &mut allowance));
            assert_eq!((allowance.record().steps, allowance.spent_units()), (0, 0));
            pieces += 1;
        }
        assert!(pieces > 1 || exec.threads > 1, "all at once");
    }
}

/// A visible triangle as it should be collected: id, pixels, prior error, whether it is a PHT, and its rank.
type Expected = (u32, u32, f32, bool, Rank);

fn expected(exec: Exec, image: &Image, method: Method) -> Vec<Expected> {
    let (world, view, colours) = (&image.world, &image.view, image.base.colours());
    let forest = crate::refine::Forest::default();
    let lights = world.lights.len();
    let of_triangle = |&triangle: &u32| {
        let pixels = image.backend.visible_pixels(triangle);
        let corners = world.triangles[triangle as usize];
        let material = usize::from(world.triangle_material[triangle as usize]);
        let mut signs = SignBits::default();
        highlight::compute_signs(exec.level, world, view.eye, &corners, &mut signs);
        let is_pht = world.materials[material].is_specular() && signs.is_pht([0, 1, 2]);
        let codes = corners.map(|v| {
            let [r, g, b] = colours.get(v as usize);
            255.0 * ((r + g + b) / 3.0).clamp(0.0, 1.0).sqrt()
        });
        let contrast =
            codes.into_iter().fold(0.0, f32::max) - codes.into_iter().fold(255.0, f32::min);
        let square = contrast * contrast;
        let by_corners = if is_pht {
            4.0 + square / 16.0
        } else {
            square / 256.0
        };
        let mut prior = ranking::ERROR_FLOOR + by_corners;
        if method == Method::PhongArea {
            // It knows areas only.
        } else if pixels < 64 && pixels as f32 * prior < 0.125 {
            prior = ranking::ERROR_FLOOR + 8.0 * (prior - ranking::ERROR_FLOOR);
        } else {
            let mean = |of: &Vec3s| {
                let [a, b, c] = corners.map(|v| of.get(v as usize));
                std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0)
            };
            let mut sample = Samples::default();
            sample.push(
                mean(&world.positions),
                mean(&world.normals),
                material as u16,
                mean(colours),
            );
            sample.illuminate(exec, world, view);
            let [r, g, b] = sample.deviation(0);
            prior += (r * r + g * g + b * b) / 3.0 * if is_pht { 0.4 } else { 0.65 };
        }
        let area = pixels as f32;
        let rank = match method {
            Method::PhongArea => area,
            _ => {
                let samples = cost::samples(forest.sample_count(pixels), lights);
                let planting = cost::leaves(1.0, 1.5, lights) + samples;
                let split = planting + cost::leaves(4.0, 1.5, lights) + cost::repaint(4.0, area);
                let benefit = area * prior;
                // The first step of shading evaluates about one light in eight.
                let shade = benefit / cost::phong(area, lights.min(1 + lights / 8));
                let split = 0.5 * benefit * (15.0 / 16.0) / split;
                // Its bounds, or those of its run.
                let own = cost::light_saved(area) * lights as f32 * 0.5 >= cost::bounds(lights);
                let is_lookable =
                    own || cost::phong(area, lights) * 8.0 >= cost::run_bounds(lights);
                match () {
                    () if split > shade => 4.0 * split,
                    () if prior <= 0.25 && is_lookable => 8.0 * shade,
                    () => shade,
                }
            }
        };
        (triangle, pixels, prior, is_pht, Rank::new(rank))
    };
    image
        .backend
        .visible_triangles()
        .iter()
        .map(of_triangle)
        .collect()
}

fn check(refinement: &mut Refinement, expected: &[Expected]) {
    assert_eq!(refinement.roots.len(), expected.len());
    for (root, &(triangle, pixels, prior, is_pht, _)) in refinement.roots.iter().zip(expected) {
        let got = (root.triangle, root.pixels, root.prior, root.is_pht);
        assert_eq!(got, (triangle, pixels, prior, is_pht));
        assert_eq!(root.progress, super::super::Progress::Waiting);
    }
    let mut order: Vec<u32> = (0..expected.len() as u32).collect();
    order.sort_by_key(|&index| std::cmp::Reverse(expected[index as usize].4));
    let got: Vec<u32> = std::iter::from_fn(|| refinement.ranked_roots.pop()).collect();
    assert!(got == order, "the order differs");
    let phts = expected.iter().filter(|e| e.3).count() as u64;
    assert_eq!(refinement.counters.phts, phts);
    assert!(phts > 50 && phts < expected.len() as u64 / 2, "{phts} PHTs");
    assert!(refinement.counters.matte > 100);
    let mass: f64 = expected
        .iter()
        .map(|e| {
            let error = (f64::from(e.2) - 1e-3).max(0.0);
            f64::from(e.1) * (error + (0.8 * error.sqrt()).min(1.0 / 6.0))
        })
        .sum();
    assert!((refinement.error_mass / mass - 1.0).abs() < 1e-4);
}

#[test]
fn candidates_are_those_of_single_triangles_whatever_the_pieces_and_threads() {
    let level = SimdLevel::detect().token().expect("detected");
    for method in [Method::Adaptive, Method::PhongArea] {
        let alone = Exec { level, threads: 1 };
        let mut image = Image::new(alone);
        let expected = expected(alone, &image, method);
        assert!(expected.len() > 5 * BLOCK, "{} triangles", expected.len());
        let mut masses = Vec::new();
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.expect("a pool");
            let exec = Exec { level, threads };
            // The less there is left, the shorter the pieces.
            for budget in [Budget::Unlimited, Budget::Work(0), Budget::from_millis(0.5)] {
                let mut refinement = pool.install(|| image.collect(exec, method, budget));
                check(&mut refinement, &expected);
                masses.push(refinement.error_mass);
            }
        }
        assert!(masses.iter().all(|&mass| mass == masses[0]), "{masses:?}");
    }
}

#[test]
fn what_was_found_takes_the_place_of_guesses_where_it_may() {
    let level = SimdLevel::detect().token().expect("detected");
    let exec = Exec { level, threads: 1 };
    let mut image = Image::new(exec);
    let cold = expected(exec, &image, Method::Adaptive);
    let mut refinement = image.collect(exec, Method::Adaptive, Budget::Unlimited);
    for remembers in [true, false] {
        for (index, &(triangle, ..)) in cold.iter().enumerate().step_by(3) {
            refinement.memory.note(triangle, index as f32);
        }
        refinement.set_remembering(remembers);
        image.collect_into(&mut refinement, exec, Method::Adaptive, Budget::Unlimited);
        for (index, (root, &(_, _, guess, is_pht, _))) in
            refinement.roots.iter().zip(&cold).enumerate()
        {
            let want = match (remembers, index % 3) {
                (true, 0) => (index as f32).max(ranking::ERROR_FLOOR),
                _ => guess,
            };
            assert_eq!((root.prior, root.is_pht), (want, is_pht), "root {index}");
        }
    }
    // Everything can be forgotten.
    refinement.forget();
    refinement.set_remembering(true);
    image.collect_into(&mut refinement, exec, Method::Adaptive, Budget::Unlimited);
    check(&mut refinement, &cold);
}

#[test]
fn no_piece_begins_that_the_clock_does_not_allow() {
    let level = SimdLevel::detect().token().expect("detected");
    let exec = Exec { level, threads: 1 };
    let mut image = Image::new(exec);
    let (world, view) = (&image.world, &image.view);
    let mut refinement = Refinement::default();
    refinement.begin(
        exec,
        Method::Adaptive,
        world,
        view,
        &image.base,
        &image.backend,
    );
    let mut stage = Stage {
        exec,
        world,
        view,
        base: &image.base,
        backend: &mut image.backend,
    };
    let (clock, cancel) = (ManualClock::default(), CancelToken::new());
    let mut allowance = Allowance::new(Budget::from_millis(1.0), &clock, 0.0, &cancel);
    assert!(refinement.step(&mut stage, &mut allowance));
    let collected = refinement.roots.len();
    assert!(collected > 0 && refinement.is_collecting());
    clock.advance_ms(0.96);
    for _ in 0..2 {
        assert!(!refinement.step(&mut stage, &mut allowance));
        assert_eq!(refinement.roots.len(), collected);
    }
}
