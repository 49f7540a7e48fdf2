//! What a moving light does to highlights: figure 9.14 of Firebaugh, *Computer Graphics: Tools for Visualization*,
//! chapter 9.
//!
//! A sphere of few polygons, the light above it moving from left to right. With flat shading whole polygons flash up one
//! after the other, with Gouraud shading the highlight is bright where it meets a vertex and fades in between, and
//! with Phong shading it moves smoothly. The adaptive method shows what Phong shading shows, within a budget.
//!
//! The picture has a row for each method and a column for each place of the light. All panels are rendered straight into
//! it, each a target with the stride of the whole picture. Only the light moves, so each engine finds out once who
//! owns which pixel.
//!
//! `cargo run --release --example moving_light -- [OUT.png]`

use specula::glam::DVec3;
use specula::output::Target;
use specula::output::target::PIXEL_BYTES;
use specula::scene::{Light, LightKind};
use specula::{Budget, Engine, EngineOptions, Frame, Method, Scene};
use std::error::Error;

const SCENE: &str = r#"(
    camera: Perspective(position: (0, -6, 1.2), target: (0, 0, 0), fov_degrees: 23),
    ambient: 0.05,
    materials: {"plastic": (diffuse: (0.10, 0.22, 0.42), specular: 0.8, shininess: 40)},
    objects: [(shape: Sphere(slices: 16, stacks: 10), material: "plastic", rotate_degrees: (0, 0, 11))],
)"#;
const METHODS: [Method; 4] = [
    Method::Flat,
    Method::Gouraud,
    Method::Adaptive,
    Method::Phong,
];
const PLACES: u32 = 7;
const SIDE: u32 = 240;
const BUDGET_MS: f64 = 2.0;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1);
    let path = path.unwrap_or_else(|| "moving_light.png".to_owned());
    let mut sheet = Frame::new(PLACES * SIDE, METHODS.len() as u32 * SIDE);
    let stride = sheet.width() as usize * PIXEL_BYTES;

    println!("brightest green in each panel, of 255:");
    for (row, method) in METHODS.into_iter().enumerate() {
        let mut scene = Scene::parse(SCENE, "moving_light")?;
        let options = EngineOptions {
            method,
            ..EngineOptions::default()
        };
        let mut engine = Engine::with_options(&scene, options)?;
        print!("{:>9}", method.name());
        for column in 0..PLACES {
            scene.set_lights(vec![light(column)]);
            let first =
                row * SIDE as usize * stride + column as usize * SIDE as usize * PIXEL_BYTES;
            let bytes = &mut sheet.pixels_mut().as_flattened_mut()[first..];
            let panel = Target::with_stride(bytes, SIDE, SIDE, stride)?;
            engine.render_into(&scene, Budget::from_millis(BUDGET_MS), panel);
            print!(" {:4}", brightest(&sheet, row as u32, column));
        }
        println!();
    }
    sheet.save_png(&path)?;
    println!(
        "{path}: {} from the top, the light from left to right",
        METHODS.map(Method::name).join(", ")
    );
    Ok(())
}

/// A light in front of the sphere and above it, further to the right in each column.
fn light(column: u32) -> Light {
    let degrees = -36.0 + 72.0 * f64::from(column) / f64::from(PLACES - 1);
    let (sin, cos) = degrees.to_radians().sin_cos();
    Light {
        kind: LightKind::Directional {
            direction: -DVec3::new(sin, -cos, 0.8),
        },
        radiance: [0.9; 3],
    }
}

/// The largest green value of a panel.
fn brightest(sheet: &Frame, row: u32, column: u32) -> u8 {
    let rows = sheet.pixels().chunks(sheet.width() as usize);
    let first = (column * SIDE) as usize;
    rows.skip((row * SIDE) as usize)
        .take(SIDE as usize)
        .flat_map(|pixels| &pixels[first..first + SIDE as usize])
        .map(|&[_, green, _, _]| green)
        .max()
        .unwrap_or(0)
}
