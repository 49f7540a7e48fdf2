//! The illumination equation in lanes against its reference, at every SIMD level of this machine.

use glam::DVec3;
use specula::geometry::Vec3s;
use specula::illumination::reference::{self, shade, towards_light, towards_viewer};
use specula::illumination::{ActiveLights, LightMask, ShadingKit, shade_points, shade_vertices};
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
}

fn single(v: DVec3) -> [f32; 3] {
    v.to_array().map(|c| c as f32)
}

struct Case {
    eye: Eye,
    material: ShadingMaterial,
    lights: Vec<ShadingLight>,
    points: Vec3s,
    normals: Vec3s,
}

/// Points in the unit ball; half of the normals point where the first light's highlight is.
fn random_case(random: &mut Random, shininess: f32, len: usize) -> Case {
    let eye = if random.below(4) == 0 {
        Eye::Direction(single(random.direction()))
    } else {
        let distance = 0.3 + 5.0 * random.unit();
        Eye::Point(single(random.direction() * distance))
    };
    let material = ShadingMaterial {
        ambient: random.rgb().map(|c| c * 0.1),
        diffuse: random.rgb(),
        specular: random.rgb(),
        shininess,
        model: [ReflectionModel::Phong, ReflectionModel::BlinnPhong][random.below(2)],
    };
    let lights: Vec<_> = (0..random.below(4))
        .map(|_| {
            let is_point = random.below(3) > 0;
            let distance = if is_point {
                10_f64.powf(4.0 * random.unit() - 1.0)
            } else {
                1.0
            };
            ShadingLight {
                vector: single(random.direction() * distance),
                is_point,
                radiance: random.rgb(),
            }
        })
        .collect();
    let (mut points, mut normals) = (Vec3s::default(), Vec3s::default());
    for _ in 0..len {
        let radius = random.unit();
        let point = single(random.direction() * radius);
        points.push(point);
        let p = reference::vector(point);
        let mut normal = random.direction();
        if let (0, Some(light)) = (random.below(2), lights.first()) {
            let half = towards_light(p, light) + towards_viewer(p, &eye);
            let spread = 3.0 / (1.0 + f64::from(shininess).sqrt());
            normal = half.normalize_or_zero() + normal * spread * random.unit();
        }
        let length = 10_f64.powf(2.0 * random.unit() - 1.0);
        normals.push(single(normal * length));
    }
    Case {
        eye,
        material,
        lights,
        points,
        normals,
    }
}

fn run(case: &Case, level: SimdLevel, active: &ActiveLights) -> Vec3s {
    let kit = ShadingKit::new(case.eye, &case.material, &case.lights);
    let mut out = Vec3s::default();
    out.resize(case.points.len());
    let token = level.token().expect("only available levels are asked for");
    shade_points(
        token,
        &kit,
        active,
        0..case.points.len(),
        &case.points,
        &case.normals,
        &mut out,
    );
    out
}

/// Where the equation itself is too steep for `f32`: at its jumps, and where the halfway vector vanishes.
fn is_steep(case: &Case, p: DVec3, n: DVec3, smallest_cosine: f64) -> bool {
    let v = towards_viewer(p, &case.eye);
    smallest_cosine < 1e-6
        || case.lights.iter().any(|light| {
            let l = towards_light(p, light);
            let h = l + v;
            let base = match case.material.model {
                ReflectionModel::Phong => (2.0 * n.dot(l) * n - l).dot(v),
                ReflectionModel::BlinnPhong => n.dot(h.normalize_or_zero()),
            };
            let halfway = case.material.model == ReflectionModel::BlinnPhong && h.length() < 0.05;
            halfway || (case.material.shininess == 0.0 && base.abs() < 1e-5)
        })
}

#[test]
fn lanes_agree_with_the_reference_within_a_twentieth_code() {
    let mut random = Random(1);
    let (mut compared, mut steep, mut lit) = (0, 0, 0);
    for round in 0..400 {
        let shininess = [0.0, 1.0, 2.5, 10.0, 50.0, 300.0, 1e3, 1e4][round % 8];
        let case = random_case(&mut random, shininess, 67);
        let active = ActiveLights::all(case.lights.len());
        for level in SimdLevel::available() {
            let out = run(&case, level, &active);
            for i in 0..case.points.len() {
                let p = reference::vector(case.points.get(i));
                let n = reference::vector(case.normals.get(i));
                let exact = shade(p, n, &case.eye, &case.material, &case.lights);
                if is_steep(&case, p, n.normalize_or_zero(), exact.smallest_cosine) {
                    steep += 1;
                    continue;
                }
                compared += 1;
                lit += usize::from(exact.rgb[0] > 0.3);
                for (&got, &want) in out.get(i).iter().zip(&exact.rgb) {
                    let got = f64::from(got);
                    for encoding in Encoding::ALL {
                        let off = (encoding.encode(got) - encoding.encode(want)).abs();
                        assert!(
                            off <= 0.05,
                            "{level}: {got} instead of {want} ({off} {encoding} codes), shininess {shininess}"
                        );
                    }
                    // Beyond white nothing is seen, but it is interpolated later.
                    let relative = (got - want).abs() / want.max(1.0);
                    assert!(relative < 1e-3, "{level}: {got} instead of {want}");
                }
            }
        }
    }
    assert!(steep * 50 < compared, "{steep} of {compared} left out");
    assert!(lit * 5 > compared, "only {lit} of {compared} are lit");
}

#[test]
fn results_depend_neither_on_the_width_nor_on_the_neighbours() {
    let mut random = Random(2);
    for _ in 0..100 {
        let case = random_case(&mut random, 40.0, 67);
        let active = ActiveLights::all(case.lights.len());
        let fused: Vec<_> = [SimdLevel::Avx2, SimdLevel::Avx512, SimdLevel::Neon]
            .into_iter()
            .filter(|level| level.token().is_some())
            .map(|level| run(&case, level, &active))
            .collect();
        assert!(fused.windows(2).all(|pair| pair[0] == pair[1]));
        // Each point alone: nothing that its former neighbours needed is computed now.
        for level in SimdLevel::available() {
            let together = run(&case, level, &active);
            for i in (0..case.points.len()).step_by(5) {
                let mut alone = Case {
                    points: Vec3s::default(),
                    normals: Vec3s::default(),
                    lights: case.lights.clone(),
                    ..case
                };
                alone.points.push(case.points.get(i));
                alone.normals.push(case.normals.get(i));
                assert_eq!(run(&alone, level, &active).get(0), together.get(i));
            }
        }
    }
}

#[test]
fn only_active_terms_are_added() {
    let mut random = Random(3);
    for _ in 0..200 {
        let mut case = random_case(&mut random, 8.0, 16);
        let count = case.lights.len();
        let diffuse = LightMask(u128::from(random.bits()) & LightMask::first(count).0);
        let specular = LightMask(diffuse.0 & u128::from(random.bits()));
        let got = run(
            &case,
            SimdLevel::detect(),
            &ActiveLights { diffuse, specular },
        );
        // The same with lights that have only the active terms, one call each.
        let (all, mut want) = (case.lights.clone(), vec![[0.0_f32; 3]; 16]);
        let material = case.material;
        for index in diffuse.iter() {
            case.lights = vec![all[index]];
            case.material = material;
            case.material.ambient = [0.0; 3];
            if !specular.contains(index) {
                case.material.specular = [0.0; 3];
            }
            let part = run(&case, SimdLevel::detect(), &ActiveLights::all(1));
            for (i, sum) in want.iter_mut().enumerate() {
                *sum = std::array::from_fn(|c| sum[c] + part.get(i)[c]);
            }
        }
        for (i, sum) in want.iter().enumerate() {
            for ((got, sum), ambient) in got.get(i).iter().zip(sum).zip(material.ambient) {
                let want = sum + ambient;
                assert!((got - want).abs() < 1e-5 * want.max(1.0));
            }
        }
    }
    // Bits of lights that do not exist are no trouble.
    let case = random_case(&mut random, 8.0, 5);
    let count = case.lights.len();
    assert_eq!(
        run(&case, SimdLevel::detect(), &ActiveLights::all(128)),
        run(&case, SimdLevel::detect(), &ActiveLights::all(count))
    );
}

/// One coloured light more, which is not active, must not change a bit under grey ones.
#[test]
fn grey_lights_give_what_coloured_ones_give() {
    let mut random = Random(5);
    for _ in 0..100 {
        let mut case = random_case(&mut random, 20.0, 35);
        for light in &mut case.lights {
            light.radiance = [light.radiance[0]; 3];
        }
        let active = ActiveLights::all(case.lights.len());
        let grey = run(&case, SimdLevel::detect(), &active);
        case.lights.push(ShadingLight {
            vector: [0.0, 0.0, 1.0],
            is_point: false,
            radiance: [0.5, 0.25, 0.0],
        });
        assert_eq!(grey, run(&case, SimdLevel::detect(), &active));
    }
}

/// Zero normals, points on lights and at the eye, lights opposite to the viewer, grazing light, extreme exponents: all must equal
/// the reference, which has no light for a vector without direction, and never be NaN.
#[test]
fn degenerate_geometry_is_dark_and_finite() {
    let axes = [
        [0.0; 3],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [1.0, 0.0, 0.0],
        [1e-30, 0.0, 0.0],
        [0.0, 1e10, 0.0],
    ];
    for model in [ReflectionModel::Phong, ReflectionModel::BlinnPhong] {
        for shininess in [0.0, 1.0, 30.0, 1e4, 1e30] {
            for eye in [
                Eye::Point([0.0; 3]),
                Eye::Point([0.0, 0.0, 1.0]),
                Eye::Direction([0.0, 0.0, 1.0]),
            ] {
                let mut case = Case {
                    eye,
                    material: ShadingMaterial {
                        ambient: [0.01; 3],
                        diffuse: [0.5; 3],
                        specular: [0.5; 3],
                        shininess,
                        model,
                    },
                    lights: vec![],
                    points: Vec3s::default(),
                    normals: Vec3s::default(),
                };
                for (vector, is_point) in [
                    ([0.0; 3], true),
                    ([0.0, 0.0, 1.0], true),
                    ([0.0, 0.0, -1.0], false),
                    ([0.0, 1.0, 0.0], false),
                ] {
                    case.lights.push(ShadingLight {
                        vector,
                        is_point,
                        radiance: [0.5; 3],
                    });
                }
                for point in [[0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 0.5]] {
                    for normal in axes {
                        case.points.push(point);
                        case.normals.push(normal);
                    }
                }
                check_degenerate(&case);
            }
        }
    }
}

fn check_degenerate(case: &Case) {
    let active = ActiveLights::all(case.lights.len());
    for level in SimdLevel::available() {
        let out = run(case, level, &active);
        for i in 0..out.len() {
            let p = reference::vector(case.points.get(i));
            let mut n = reference::vector(case.normals.get(i));
            if n.length() < 1e-19 {
                n = DVec3::ZERO;
            }
            let want = shade(p, n, &case.eye, &case.material, &case.lights).rgb;
            for (got, want) in out.get(i).into_iter().zip(want) {
                assert!(
                    (f64::from(got) - want).abs() < 1e-5,
                    "{level}: {got} instead of {want} at {p} with normal {n}, {:?} {:?}",
                    case.eye,
                    case.material
                );
            }
        }
    }
}

#[test]
fn vertices_are_shaded_with_their_own_materials() {
    let mut random = Random(4);
    let case = random_case(&mut random, 20.0, 100);
    let mut world = World {
        positions: case.points.clone(),
        normals: case.normals.clone(),
        lights: case.lights.clone(),
        materials: vec![case.material; 3],
        vertex_material: (0..100).map(|i| (i / 37) as u16).collect(),
        ..World::default()
    };
    world.materials[1].ambient = [0.5; 3];
    world.materials[2].specular = [0.0; 3];
    let chosen: Vec<u32> = (0..100).filter(|i| i % 7 != 3).collect();
    let (untouched, mut out) = ([-1.0; 3], Vec3s::default());
    for _ in 0..100 {
        out.push(untouched);
    }
    let token = SimdLevel::detect().token().expect("detected");
    shade_vertices(token, &world, case.eye, &chosen, &mut out);
    for i in 0..100 {
        let material = world.materials[usize::from(world.vertex_material[i])];
        let want = if chosen.contains(&(i as u32)) {
            let one = Case {
                material,
                lights: case.lights.clone(),
                points: case.points.clone(),
                normals: case.normals.clone(),
                eye: case.eye,
            };
            run(
                &one,
                SimdLevel::detect(),
                &ActiveLights::all(case.lights.len()),
            )
            .get(i)
        } else {
            untouched
        };
        assert_eq!(out.get(i), want, "vertex {i}");
    }
    shade_vertices(token, &world, case.eye, &[], &mut out);
}
