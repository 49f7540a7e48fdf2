//! The conservative bounds and light masks against dense sampling of the illumination equation.

use glam::DVec3;
use specula::geometry::Vec3s;
use specula::highlight::{SignBits, TriangleBound, Verdict, compute_signs, light_masks, masks_of};
use specula::illumination::reference::{Factors, factors, shade, vector};
use specula::illumination::{ActiveLights, ShadingKit, shade_points};
use specula::output::Encoding;
use specula::scene::{Eye, ReflectionModel, ShadingLight, ShadingMaterial, World};
use specula::simd::SimdLevel;

/// Sebastiano Vigna's `splitmix64`.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    /// Logarithmically even.
    fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo * (hi / lo).powf(self.unit())
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::from_array(std::array::from_fn(|_| 2.0 * self.unit() - 1.0));
            if (0.01..=1.0).contains(&v.length()) {
                return v.normalize();
            }
        }
    }

    fn rgb(&mut self) -> [f32; 3] {
        std::array::from_fn(|_| self.unit() as f32)
    }

    /// Corners and edges, where extremes are, and points inside.
    fn weights(&mut self, index: usize) -> [f64; 3] {
        if index < 3 {
            return std::array::from_fn(|i| f64::from(u8::from(i == index)));
        }
        let mut w: [f64; 3] = std::array::from_fn(|_| -self.unit().max(1e-9).ln());
        if index < 12 {
            w[index % 3] = 0.0;
        }
        let sum: f64 = w.iter().sum();
        w.map(|w| w / sum)
    }
}

fn single(v: DVec3) -> [f32; 3] {
    v.to_array().map(|c| c as f32)
}

struct Case {
    positions: [[f32; 3]; 3],
    normals: [[f32; 3]; 3],
    eye: Eye,
    material: ShadingMaterial,
    lights: Vec<ShadingLight>,
}

/// A triangle of any size, flat to wildly curved, near or far from lights and eye, mostly such that there is something to see.
fn random_case(random: &mut Random, lights: usize) -> Case {
    let size = random.between(1e-3, 2.0);
    let curve = if random.below(4) == 0 {
        0.0
    } else {
        random.between(1e-3, 1.5)
    };
    let center = random.direction() * random.unit();
    let main = random.direction();
    let positions = std::array::from_fn(|_| single(center + random.direction() * size));
    let normals =
        std::array::from_fn(|_| single((main + random.direction() * curve).normalize_or_zero()));
    // Above the surface, usually.
    let above = |random: &mut Random| {
        let direction = random.direction();
        if random.below(4) > 0 && direction.dot(main) < 0.0 {
            -direction
        } else {
            direction
        }
    };
    let to_eye = above(random);
    let eye = if random.below(4) == 0 {
        Eye::Direction(single(to_eye))
    } else {
        Eye::Point(single(center + to_eye * random.between(0.05, 20.0)))
    };
    let model = [ReflectionModel::Phong, ReflectionModel::BlinnPhong][random.below(2)];
    let material = ShadingMaterial {
        ambient: random.rgb().map(|c| c * 0.05),
        diffuse: random.rgb(),
        specular: random.rgb(),
        shininess: match random.below(8) {
            0 => 0.0,
            1 => 1.0,
            2 => 0.5,
            _ => random.between(1.0, 1e3) as f32,
        },
        model,
    };
    let lights = (0..lights)
        .map(|_| {
            let mut direction = above(random);
            if random.below(3) > 0 {
                // Where it reflects towards the eye, about.
                let mirrored = 2.0 * main.dot(to_eye) * main - to_eye;
                direction =
                    (mirrored + random.direction() * random.between(0.01, 1.0)).normalize_or_zero();
            }
            let is_point = random.below(3) > 0;
            let at = center + direction * random.between(0.05, 1e4);
            ShadingLight {
                vector: single(if is_point { at } else { direction }),
                is_point,
                radiance: random.rgb(),
            }
        })
        .collect();
    Case {
        positions,
        normals,
        eye,
        material,
        lights,
    }
}

fn blend(corners: &[[f32; 3]; 3], w: [f64; 3]) -> DVec3 {
    corners.iter().zip(w).map(|(&c, w)| vector(c) * w).sum()
}

impl Case {
    fn at(&self, w: [f64; 3], light: usize) -> Factors {
        let (point, normal) = (blend(&self.positions, w), blend(&self.normals, w));
        factors(
            point,
            normal,
            &self.eye,
            &self.material,
            &self.lights[light],
        )
    }
}

/// Of the sampling itself, in `f64`.
const ROUNDING: f64 = 1e-12;

const CORNERS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

#[test]
fn factors_stay_in_their_intervals() {
    let mut random = Random(11);
    let (mut useful, mut tight) = (0, 0);
    const CASES: usize = 120_000;
    for _ in 0..CASES {
        let case = random_case(&mut random, 1);
        let bound = TriangleBound::new(case.positions, case.normals, &case.eye, &case.material)
            .light(&case.lights[0]);
        let corners = CORNERS.map(|w| case.at(w, 0));
        useful += usize::from(bound.specular.hi - bound.specular.lo < 0.1);
        tight +=
            usize::from(bound.specular.deviation < 0.1 * (bound.specular.hi - bound.specular.lo));
        for index in 0..40 {
            let w = random.weights(index);
            let here = case.at(w, 0);
            for (bound, value, corners) in [
                (bound.diffuse, here.diffuse, corners.map(|c| c.diffuse)),
                (bound.specular, here.specular, corners.map(|c| c.specular)),
            ] {
                let interpolated: f64 = corners.iter().zip(w).map(|(c, w)| c * w).sum();
                assert!(
                    (bound.lo - ROUNDING..=bound.hi + ROUNDING).contains(&value)
                        && (value - interpolated).abs() <= bound.deviation + ROUNDING,
                    "{value} (interpolated {interpolated}) at {w:?} is outside of {bound:?} for {:?} {:?} {:?} {:?} {:?}",
                    case.positions,
                    case.normals,
                    case.eye,
                    case.material,
                    case.lights[0],
                );
            }
        }
    }
    // A trivial bound would pass the above.
    println!("specular interval below 0.1: {useful}, deviation a tenth of it: {tight}, of {CASES}");
    assert!(
        useful * 4 > CASES && tight * 40 > CASES,
        "{useful}, {tight}"
    );
}

/// Per pixel with the masks, and the remainder interpolated, is within half a code of everything per pixel.
#[test]
fn what_masks_leave_out_is_not_seen() {
    Encoding::ALL.into_iter().for_each(check_masks);
}

fn check_masks(encoding: Encoding) {
    let mut random = Random(12);
    let encode = |light| encoding.encode(light);
    let (mut left_out, mut terms, mut worst) = (0, 0, 0.0_f64);
    for round in 0..12_000 {
        let count = [1, 4, 16, 40][round % 4] / if round % 8 < 4 { 1 } else { 4 };
        let case = random_case(&mut random, count);
        let lights = masks_of(
            case.positions,
            case.normals,
            &case.eye,
            encoding,
            &case.material,
            &case.lights,
        );
        let active = lights.active;
        assert_eq!(active.specular.0 & !active.diffuse.0, 0);
        assert_eq!(lights.verdict == Verdict::Absent, active.diffuse.is_empty());
        terms += 2 * count;
        left_out += 2 * count - active.diffuse.len() - active.specular.len();
        // All terms, and those that are evaluated.
        let colours = |w: [f64; 3]| {
            let mut full = case.material.ambient.map(f64::from);
            let mut part = full;
            for (index, light) in case.lights.iter().enumerate() {
                let f = case.at(w, index);
                for c in 0..3 {
                    let radiance = f64::from(light.radiance[c]);
                    let diffuse = radiance * f64::from(case.material.diffuse[c]) * f.diffuse;
                    let specular = radiance * f64::from(case.material.specular[c]) * f.specular;
                    full[c] += diffuse + specular;
                    if active.diffuse.contains(index) {
                        part[c] += diffuse;
                    }
                    if active.specular.contains(index) {
                        part[c] += specular;
                    }
                }
            }
            (full, part)
        };
        let corners = CORNERS.map(colours);
        for index in 3..30 {
            let w = random.weights(index);
            let (full, part) = colours(w);
            for c in 0..3 {
                let remainder: f64 = (0..3)
                    .map(|i| w[i] * (corners[i].0[c] - corners[i].1[c]))
                    .sum();
                worst = worst.max((encode(part[c] + remainder) - encode(full[c])).abs());
            }
        }
    }
    println!("{encoding}: left out {left_out} of {terms} terms, worst error {worst} codes");
    assert!(worst <= 0.5 + 1e-6, "{worst} codes");
    assert!(left_out * 10 > terms, "{left_out} of {terms}");
    assert!(
        worst > 0.05,
        "the bound is so loose that this test shows nothing: {worst}"
    );
}

/// The same as a backend does it: positions, normals and the remainder interpolated in `f32`, terms evaluated in lanes.
#[test]
fn what_masks_leave_out_is_not_seen_in_single_precision_either() {
    let check = check_masks_in_single_precision;
    Encoding::ALL.into_iter().for_each(check);
}

fn check_masks_in_single_precision(encoding: Encoding) {
    const PIXELS: usize = 29;
    let mut random = Random(15);
    let level = SimdLevel::detect().token().expect("detected");
    let encode = |light| encoding.encode(light);
    let (mut compared, mut worst) = (0, 0.0_f64);
    for round in 0..6_000 {
        let case = random_case(&mut random, [1, 3, 9][round % 3]);
        if case.material.shininess < 1.0 {
            continue; // Its slope is infinite somewhere, or it jumps.
        }
        let count = case.lights.len();
        let active = masks_of(
            case.positions,
            case.normals,
            &case.eye,
            encoding,
            &case.material,
            &case.lights,
        )
        .active;
        let weights: Vec<_> = (0..PIXELS)
            .map(|index| random.weights(index).map(|w| w as f32))
            .collect();
        let mix = |corners: &[[f32; 3]; 3], w: &[f32; 3]| -> [f32; 3] {
            std::array::from_fn(|c| {
                w[0] * corners[0][c] + w[1] * corners[1][c] + w[2] * corners[2][c]
            })
        };
        let (mut points, mut normals) = (Vec3s::default(), Vec3s::default());
        for w in &weights {
            points.push(mix(&case.positions, w));
            normals.push(mix(&case.normals, w));
        }
        let kit = ShadingKit::new(case.eye, &case.material, &case.lights);
        let run = |active: &ActiveLights| {
            let mut out = Vec3s::default();
            out.resize(PIXELS);
            shade_points(level, &kit, active, 0..PIXELS, &points, &normals, &mut out);
            out
        };
        let (full, part) = (run(&ActiveLights::all(count)), run(&active));
        // The first three pixels are the corners.
        let remainder = [0, 1, 2].map(|i| {
            let (full, part) = (full.get(i), part.get(i));
            std::array::from_fn(|c| full[c] - part[c])
        });
        for (i, w) in weights.iter().enumerate() {
            let w64 = w.map(f64::from);
            let sum: f64 = w64.iter().sum();
            let w64 = w64.map(|w| w / sum);
            let (point, normal) = (blend(&case.positions, w64), blend(&case.normals, w64));
            let exact = shade(point, normal, &case.eye, &case.material, &case.lights);
            if exact.smallest_cosine < 1e-5 || normal.length() < 0.1 {
                continue;
            }
            compared += 1;
            let added = mix(&remainder, w);
            for ((part, added), exact) in part.get(i).iter().zip(added).zip(exact.rgb) {
                let got = encode(f64::from(part + added));
                worst = worst.max((got - encode(exact)).abs());
            }
        }
    }
    println!("{encoding}: worst error {worst} codes at {compared} pixels");
    assert!(worst <= 0.55 && compared > 100_000, "{worst}, {compared}");
}

/// On a smooth surface the deviation shrinks with the square of the triangle's size, so that fine meshes need no refinement.
#[test]
fn deviations_are_of_second_order() {
    let material = ShadingMaterial {
        ambient: [0.0; 3],
        diffuse: [0.7; 3],
        specular: [0.3; 3],
        shininess: 20.0,
        model: ReflectionModel::Phong,
    };
    let light = ShadingLight {
        vector: [1.0, 1.0, 3.0],
        is_point: true,
        radiance: [1.0; 3],
    };
    for model in [ReflectionModel::Phong, ReflectionModel::BlinnPhong] {
        let material = ShadingMaterial { model, ..material };
        let deviations = [0.1, 0.01].map(|size: f32| {
            // A piece of the unit sphere near its pole, where the highlight is.
            let normals = [[0.1, 0.1], [0.1 + size, 0.1], [0.1, 0.1 + size]]
                .map(|[x, y]: [f32; 2]| [x, y, (1.0 - x * x - y * y).sqrt()]);
            let bound =
                TriangleBound::new(normals, normals, &Eye::Point([-1.0, -1.0, 4.0]), &material)
                    .light(&light);
            [bound.diffuse.deviation, bound.specular.deviation]
        });
        for (coarse, fine) in deviations[0].iter().zip(deviations[1]) {
            assert!(fine < coarse / 30.0, "{model:?}: {coarse} became {fine}");
        }
        assert!(
            deviations[1][0] < 1e-4 && deviations[1][1] < 5e-3,
            "{deviations:?}"
        );
    }
}

/// A sphere of `rings` x `2 rings` quads.
fn sphere(rings: usize, shininess: f32, light: DVec3) -> World {
    let mut world = World {
        materials: vec![ShadingMaterial {
            ambient: [0.0; 3],
            diffuse: [0.5; 3],
            specular: [1.0; 3],
            shininess,
            model: ReflectionModel::Phong,
        }],
        lights: vec![ShadingLight {
            vector: single(light),
            is_point: true,
            radiance: [1.0; 3],
        }],
        ..World::default()
    };
    let (mut positions, columns) = (Vec3s::default(), 2 * rings);
    for ring in 0..=rings {
        for column in 0..columns {
            let (theta, phi) = (
                std::f64::consts::PI * ring as f64 / rings as f64,
                std::f64::consts::PI * column as f64 / rings as f64,
            );
            positions.push(single(DVec3::new(
                theta.sin() * phi.cos(),
                theta.sin() * phi.sin(),
                theta.cos(),
            )));
        }
    }
    for ring in 0..rings {
        for column in 0..columns {
            let next = (column + 1) % columns;
            let [a, b, c, d] = [
                (ring, column),
                (ring + 1, column),
                (ring + 1, next),
                (ring, next),
            ]
            .map(|(r, c)| (r * columns + c) as u32);
            if ring + 1 < rings {
                world.triangles.push([a, b, c]);
            }
            if ring > 0 {
                world.triangles.push([a, c, d]);
            }
        }
    }
    world.vertex_material = vec![0; positions.len()];
    world.triangle_material = vec![0; world.triangles.len()];
    world.normals = positions.clone();
    world.positions = positions;
    world
}

/// Which triangles' specular term differs from its interpolation by more than 4/255 somewhere? The bound must find all of them; what the
/// paper's sign test finds is printed beside it.
#[test]
fn masks_find_every_triangle_with_a_visible_specular_deviation() {
    let mut random = Random(13);
    let level = SimdLevel::detect().token().expect("detected");
    for (rings, shininess) in [(8, 10.0), (8, 100.0), (24, 10.0), (24, 100.0), (48, 300.0)] {
        // Truth; found by signs, and both; found by the bound, and both.
        let mut counts = [0_u32; 5];
        for _ in 0..4 {
            let world = sphere(
                rings,
                shininess,
                random.direction() * random.between(1.5, 10.0),
            );
            let position = random.direction() * random.between(2.0, 6.0);
            let eye = Eye::Point(single(position));
            let mut bits = SignBits::default();
            let all: Vec<u32> = (0..world.positions.len() as u32).collect();
            compute_signs(level, &world, eye, &all, &mut bits);
            for (triangle, &corners) in world.triangles.iter().enumerate() {
                let corner = |i: usize| world.positions.get(corners[i] as usize);
                let case = Case {
                    positions: [corner(0), corner(1), corner(2)],
                    normals: [corner(0), corner(1), corner(2)],
                    eye,
                    material: world.materials[0],
                    lights: world.lights.clone(),
                };
                let p = case.positions.map(vector);
                if (p[1] - p[0]).cross(p[2] - p[0]).dot(position - p[0]) <= 0.0 {
                    continue;
                }
                let at_corners = CORNERS.map(|w| case.at(w, 0).specular);
                let truth = (0..60).any(|index| {
                    let w = random.weights(index);
                    let interpolated: f64 = w.iter().zip(at_corners).map(|(w, s)| w * s).sum();
                    (case.at(w, 0).specular - interpolated).abs() > 4.0 / 255.0
                });
                let by_signs = !bits.pht_lights(corners.map(|v| v as usize)).is_empty();
                let by_bound = !light_masks(&world, &eye, Encoding::Srgb, triangle as u32)
                    .active
                    .specular
                    .is_empty();
                let found = [
                    truth,
                    by_signs,
                    by_signs && truth,
                    by_bound,
                    by_bound && truth,
                ];
                for (count, found) in counts.iter_mut().zip(found) {
                    *count += u32::from(found);
                }
            }
        }
        let [truth, signs, signs_right, bound, bound_right] = counts.map(f64::from);
        println!(
            "{rings} rings, exponent {shininess}: {truth} deviate; signs: recall {:.2} precision {:.2}; bound: recall {:.2} precision {:.2}",
            signs_right / truth.max(1.0),
            signs_right / signs.max(1.0),
            bound_right / truth.max(1.0),
            bound_right / bound.max(1.0)
        );
        assert!(
            truth > 0.0 && bound_right == truth,
            "the bound missed {}",
            truth - bound_right
        );
    }
}

#[test]
fn odd_input_gives_the_trivial_answer() {
    let mut random = Random(14);
    for _ in 0..2_000 {
        let mut case = random_case(&mut random, 2);
        let odd = [0.0, f32::NAN, f32::INFINITY, f32::MAX, 1e-40][random.below(5)];
        match random.below(4) {
            0 => case.positions[random.below(3)] = [odd; 3],
            1 => case.normals[random.below(3)] = [odd; 3],
            2 => case.lights[0].vector = [odd; 3],
            _ => case.eye = Eye::Point([odd; 3]),
        }
        let bound = TriangleBound::new(case.positions, case.normals, &case.eye, &case.material)
            .light(&case.lights[0]);
        for factor in [bound.diffuse, bound.specular] {
            assert!(
                0.0 <= factor.lo
                    && factor.lo <= factor.hi
                    && factor.hi <= 1.0
                    && factor.deviation >= 0.0,
                "{factor:?}"
            );
        }
        let _ = masks_of(
            case.positions,
            case.normals,
            &case.eye,
            Encoding::ALL[random.below(2)],
            &case.material,
            &case.lights,
        );
    }
}
