//! What colours pixels get.

use super::fixture::{BACKGROUND, Fixture, Random, assert_near};
use crate::backend::{BasePaint, Interpolation};
use crate::geometry::Vec3s;
use crate::illumination::reference::shade;
use glam::DVec3;

/// The contract's tolerance for interpolated colours, in codes, before rounding.
const TOLERANCE: f64 = 1.5;

pub(super) fn the_background_is_where_nothing_is(fixture: &Fixture<'_>) {
    for colour in [BACKGROUND, [0.0; 3], [1.0; 3], [0.2, 0.001, 0.5]] {
        let mut picture = fixture.flat(70, 41);
        picture.world.background = colour;
        let frame = fixture.image(&picture, BasePaint::Gouraud(&Vec3s::default()));
        for &pixel in frame.pixels() {
            assert_near(pixel, picture.codes(colour), 0.1, "an empty world");
        }
    }
}

pub(super) fn flat_triangles_have_their_colour(fixture: &Fixture<'_>) {
    let mut picture = fixture.flat(40, 30);
    picture.add_facing([
        [-90.0, -90.0, 0.5],
        [-90.0, 200.0, 0.5],
        [200.0, -90.0, 0.5],
    ]);
    for colour in [[0.0; 3], [1.0; 3], [0.5, 0.02, 0.9]] {
        let mut colours = Vec3s::default();
        colours.push(colour);
        let frame = fixture.image(&picture, BasePaint::Flat(&colours));
        for &pixel in frame.pixels() {
            assert_near(pixel, picture.codes(colour), 0.5, "a flat triangle");
        }
    }
}

/// What interpolation as declared shows, in codes.
fn interpolated(
    fixture: &Fixture<'_>,
    [perspective, on_screen]: [[f64; 3]; 2],
    colours: [[f32; 3]; 3],
) -> [f64; 3] {
    std::array::from_fn(|channel| {
        let linear = colours.map(|c| f64::from(c[channel]));
        let encode = |light| fixture.encoding.encode(light);
        match fixture.capabilities.interpolation {
            Interpolation::LinearPerspective => {
                encode((0..3).map(|i| perspective[i] * linear[i]).sum())
            }
            Interpolation::EncodedAffine => (0..3).map(|i| on_screen[i] * encode(linear[i])).sum(),
        }
    })
}

pub(super) fn gouraud_is_interpolated_as_declared(fixture: &Fixture<'_>) {
    let mut random = Random(21);
    let mut compared = 0;
    for round in 0..60 {
        let mut picture = if round % 2 == 0 {
            fixture.flat(150, 100)
        } else {
            fixture.perspective(150, 100)
        };
        let mut corner = || {
            if round % 2 == 0 {
                [random.range(-20.0, 170.0), random.range(-20.0, 120.0), 0.5]
            } else {
                let z = random.range(1.0, 9.0);
                [z * random.range(-0.8, 0.8), z * random.range(-0.6, 0.6), z]
            }
        };
        picture.add_facing([corner(), corner(), corner()]);
        let mut colours = random.colours(3);
        if round % 3 == 0 {
            // Some channels do not vary, some vary a little.
            colours.x.fill(0.3);
            colours.y = vec![0.2, 0.202, 0.201];
        }
        let frame = fixture.image(&picture, BasePaint::Gouraud(&colours));
        let corners = [0, 1, 2].map(|i| colours.get(i));
        for (at, [x, y], id) in picture.owners().pixels(false) {
            if id.is_some() {
                let weights = picture.weights(0, x, y);
                let want = interpolated(fixture, weights, corners);
                let what = format!("round {round}, pixel {x}, {y}");
                assert_near(frame.pixels()[at], want, TOLERANCE, &what);
                compared += 1;
            }
        }
    }
    assert!(
        compared > 10_000,
        "the triangles have an inside: {compared}"
    );
}

pub(super) fn colours_out_of_range_are_clamped(fixture: &Fixture<'_>) {
    let mut picture = fixture.flat(20, 20);
    picture.add_facing([
        [-90.0, -90.0, 0.5],
        [-90.0, 200.0, 0.5],
        [200.0, -90.0, 0.5],
    ]);
    let cases = [
        (f32::NAN, 0.0),
        (f32::NEG_INFINITY, 0.0),
        (-1.0, 0.0),
        (f32::INFINITY, 255.0),
        (f32::MAX, 255.0),
        (7.0, 255.0),
    ];
    for (odd, code) in cases {
        let mut colours = Vec3s::default();
        colours.resize(3);
        colours.y.fill(odd);
        let flat = fixture.image(&picture, BasePaint::Flat(&colours));
        assert_near(flat.pixels()[210], [0.0, code, 0.0], 0.5, "flat, clamped");
        let gouraud = fixture.image(&picture, BasePaint::Gouraud(&colours));
        // Interpolated infinities may be no numbers, which are black.
        if odd.abs() < 1e30 {
            assert_near(
                gouraud.pixels()[210],
                [0.0, code, 0.0],
                0.5,
                "Gouraud, clamped",
            );
        }
    }
}

pub(super) fn phong_is_the_illumination_equation(fixture: &Fixture<'_>) {
    let mut random = Random(22);
    let mut compared = 0;
    for _ in 0..8 {
        let mut picture = fixture.perspective(120, 90);
        let mut corner = || {
            let z = random.range(1.0, 6.0);
            [z * random.range(-0.8, 0.8), z * random.range(-0.6, 0.6), z]
        };
        picture.add_facing([corner(), corner(), corner()]);
        for k in 0..3 {
            let [x, y] = [random.range(-0.5, 0.5), random.range(-0.5, 0.5)];
            picture.world.normals.set(k, [x, y, -1.0]);
        }
        let frame = fixture.image(&picture, BasePaint::Phong);
        for (at, [x, y], id) in picture.owners().pixels(false) {
            if id.is_none() {
                continue;
            }
            let [weights, _] = picture.weights(0, x, y);
            let at_pixel = |vectors: &Vec3s| {
                (0..3).fold(DVec3::ZERO, |sum, i| {
                    sum + weights[i] * DVec3::from_array(vectors.get(i).map(f64::from))
                })
            };
            let world = &picture.world;
            let shaded = shade(
                at_pixel(&world.positions),
                at_pixel(&world.normals),
                &picture.view.eye,
                &world.materials[0],
                &world.lights,
            );
            // Where light grazes, a rounding decides whether there is a highlight.
            if shaded.smallest_cosine > 1e-4 {
                let want = shaded.rgb.map(|c| fixture.encoding.encode(c));
                assert_near(frame.pixels()[at], want, 0.5, &format!("pixel {x}, {y}"));
                compared += 1;
            }
        }
    }
    assert!(compared > 1000, "the triangles have an inside: {compared}");
}
