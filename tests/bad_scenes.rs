//! Every way in which a scene file can be wrong gives one clear sentence that names the place.

use specula::scene::{Scene, SceneError, limits};
use std::fs;
use std::path::{Path, PathBuf};

fn directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad")
}

/// Each file of `tests/bad` without its ending, and what is said about it after the file's name and a colon.
const EXPECTED: &[(&str, &str)] = &[
    (
        "ambient_nan",
        "2:20: `ambient` must be a finite number, not NaN",
    ),
    (
        "animation_duration_long",
        "2:27: `animation.duration` must be at most 86400 seconds, but is 1e6",
    ),
    (
        "animation_duration_zero",
        "2:27: `animation.duration` must be above 0, but is 0",
    ),
    (
        "animation_fps_text",
        r#"2:22: `animation.fps` must be a number, not "film""#,
    ),
    (
        "animation_fps_zero",
        "2:35: `animation.fps` must be from 0.001 to 1000, but is 0",
    ),
    (
        "animation_number",
        "2:16: fields in parentheses `(name: value, ..)` are needed here",
    ),
    (
        "animation_too_many_frames",
        "4:19: `animation` is too long: 86400 seconds at 60 frames a second are 5184000 frames; at most 1000000 are possible",
    ),
    (
        "animation_unknown_field",
        "2:17: unknown field `seconds` of `Animation`; the fields are `duration`, `fps` and `orbit`",
    ),
    (
        "background_negative",
        "2:21: `background` must not be negative, but is -0.5",
    ),
    (
        "background_text",
        r##"2:17: `background` must be a colour such as "#ff8800", not "blue""##,
    ),
    (
        "background_two_numbers",
        "2:17: `background` must be three numbers (r, g, b), not (0, 1)",
    ),
    (
        "background_word",
        r##"2:17: `background` must be a colour, (r, g, b), "#rrggbb" or a grey number, not blue"##,
    ),
    (
        "camera_at_target",
        "2:35: `camera.position` and `camera.target` are the same point",
    ),
    (
        "camera_far_infinite",
        "2:52: `camera.far` must be a finite number, not inf",
    ),
    (
        "camera_fov_180",
        "2:60: `camera.fov_degrees` must be between 0 and 180, but is 180.0",
    ),
    (
        "camera_fov_zero",
        "2:60: `camera.fov_degrees` must be between 0 and 180, but is 0",
    ),
    (
        "camera_height_zero",
        "2:56: `camera.height` must be above 0, but is 0",
    ),
    (
        "camera_no_kind",
        "3:13: the kind is missing here: one of `Perspective(..)`, `Orthographic(..)`",
    ),
    (
        "camera_kind",
        "2:13: unknown kind `Fisheye`; the kinds are `Perspective` and `Orthographic`",
    ),
    (
        "camera_near_beyond_far",
        "4:15: `camera.near` is 10 and must be less than `camera.far`, which is 10",
    ),
    (
        "camera_near_zero",
        "2:53: `camera.near` must be above 0, but is 0",
    ),
    (
        "camera_position_huge",
        "2:39: `camera.position` must be at most 1e60 in magnitude, not 1e70",
    ),
    (
        "camera_position_overflow",
        "2:39: `camera.position` must be a finite number, not 1e999",
    ),
    (
        "camera_position_short",
        "2:35: `camera.position` must be three numbers (x, y, z), not (0, -9)",
    ),
    (
        "camera_position_text",
        r#"2:39: `camera.position` must be a number, not "far""#,
    ),
    (
        "camera_unknown_field",
        "4:9: unknown field `fov` of `Perspective`; the fields are `position`, `target`, `up`, `near`, `far` and `fov_degrees`",
    ),
    (
        "camera_up_parallel",
        "5:13: `camera.up` must not be parallel to the viewing direction",
    ),
    (
        "camera_up_zero",
        "2:51: `camera.up` must not be the zero vector",
    ),
    (
        "comment_before_value",
        "3:20: `ambient` must not be negative, but is -1",
    ),
    ("deep_nesting", "2:77: brackets are nested too deeply"),
    (
        "duplicate_field",
        "3:5: the field `ambient` of `Scene` appears twice",
    ),
    (
        "empty",
        "1:1: there is no scene here; the smallest is `(objects: [(shape: Teapot())])`",
    ),
    (
        "empty_objects",
        "3:14: the scene has no objects; `objects` must name at least one",
    ),
    (
        "light_color_negative",
        "6:27: `lights[1].color` must not be negative, but is -0.25",
    ),
    (
        "light_direction_zero",
        "4:32: `lights[1].direction` must not be the zero vector",
    ),
    (
        "light_intensity_huge",
        "4:47: `lights[1].intensity` must be at most 1000000, but is 1e7",
    ),
    (
        "light_intensity_negative",
        "4:47: `lights[1].intensity` must not be negative, but is -1",
    ),
    (
        "light_no_kind",
        "3:14: the kind is missing here: one of `Point(..)`, `Directional(..)`",
    ),
    (
        "light_kind",
        "4:9: unknown kind `Spot`; the kinds are `Point` and `Directional`",
    ),
    (
        "light_missing_position",
        "4:27: the field `position` of `Point` is missing",
    ),
    (
        "light_orbit_axis_text",
        r#"2:55: `lights[0].orbit.axis` must be three numbers (x, y, z), not "z""#,
    ),
    (
        "light_orbit_no_center",
        "3:77: `lights[0].orbit.center` has no meaning for a directional light, which has no place",
    ),
    (
        "light_position_nan",
        "4:29: `lights[1].position` must be a finite number, not NaN",
    ),
    (
        "material_color_hex",
        r##"4:26: `materials["odd"].diffuse` must be a colour such as "#ff8800", not "#12345""##,
    ),
    (
        "material_model",
        "4:24: unknown kind `Blinn`; the kinds are `Phong` and `BlinnPhong`",
    ),
    (
        "material_not_a_string",
        "4:37: `objects[1].material` must be a string in quotes, not gold",
    ),
    (
        "material_shininess_huge",
        r#"4:28: `materials["odd"].shininess` must be at most 1000000, but is 2e6"#,
    ),
    (
        "material_shininess_negative",
        r#"4:28: `materials["odd"].shininess` must not be negative, but is -3"#,
    ),
    (
        "material_specular_negative",
        r#"4:38: `materials["odd"].specular` must not be negative, but is -0.5"#,
    ),
    ("material_twice", r#"4:9: `materials` defines "gold" twice"#),
    (
        "material_two_sided",
        r#"4:28: `materials["odd"].two_sided` must be true or false, not yes"#,
    ),
    (
        "material_unknown",
        r#"4:37: `objects[0].material` is "glod", which `materials` does not define; it defines "gold", "tin""#,
    ),
    (
        "materials_list",
        r#"2:16: a map `{"name": (..)}` is needed here"#,
    ),
    (
        "mesh_and_shape",
        "4:32: `objects[1].mesh` is one too many: the object already has a `shape`",
    ),
    (
        "mesh_crease_beyond_180",
        "4:60: `objects[1].normals.crease_degrees` must be at most 180, but is 200",
    ),
    (
        "mesh_crease_nan",
        "4:60: `objects[1].normals.crease_degrees` must be a finite number, not NaN",
    ),
    (
        "mesh_normals_flat_with_fields",
        "4:41: nothing may follow this value",
    ),
    (
        "mesh_normals_no_parentheses",
        "4:37: `Smooth` needs parentheses, also where all fields are left out: `Smooth()`",
    ),
    (
        "mesh_normals_kind",
        "4:37: unknown kind `Round`; the kinds are `File`, `Smooth` and `Flat`",
    ),
    (
        "mesh_normals_of_a_shape",
        "4:36: `objects[1].normals` is for objects with a `mesh`; this one has a `shape`",
    ),
    (
        "mesh_not_a_string",
        "4:20: a comma or a closing bracket is missing here",
    ),
    (
        "mesh_up_kind",
        "4:32: unknown kind `X`; the kinds are `Y` and `Z`",
    ),
    (
        "mesh_up_of_a_shape",
        "4:31: `objects[1].up` is for objects with a `mesh`; this one has a `shape`",
    ),
    (
        "mesh_weight_kind",
        "4:52: unknown kind `Mass`; the kinds are `Equal`, `Area` and `Angle`",
    ),
    ("missing_colon", "2:13: a colon is missing after the name"),
    (
        "missing_comma",
        "3:5: a comma or a closing bracket is missing here",
    ),
    (
        "no_objects",
        "1:1: the scene has no objects; `objects` must name at least one",
    ),
    (
        "no_white_space",
        "1:10: `ambient` must not be negative, but is -1",
    ),
    (
        "not_ron",
        "1:1: fields in parentheses `(name: value, ..)` are needed here",
    ),
    ("not_utf8", "2:10: this is not UTF-8 text"),
    (
        "object_no_shape",
        "4:9: `objects[1]` needs a `shape` or a `mesh`",
    ),
    (
        "object_position_number",
        "4:37: `objects[1].position` must be three numbers (x, y, z), not 3",
    ),
    (
        "object_rotation_infinite",
        "4:47: `objects[1].rotate_degrees` must be a finite number, not -inf",
    ),
    (
        "object_scale_nan",
        "4:34: `objects[1].scale` must be a finite number, not NaN",
    ),
    (
        "object_scale_zero",
        "4:38: `objects[1].scale` must not be zero, which would flatten the object",
    ),
    (
        "object_scale_zero_uniform",
        "4:34: `objects[1].scale` must not be zero, which would flatten the object",
    ),
    (
        "object_unknown_field",
        "4:27: unknown field `translate` of `Object`; the fields are `shape`, `mesh`, `normals`, `up`, `material`, `position`, `rotate_degrees`, `scale` and `spin`",
    ),
    ("objects_not_a_list", "2:14: a list `[..]` is needed here"),
    (
        "only_comment",
        "2:1: there is no scene here; the smallest is `(objects: [(shape: Teapot())])`",
    ),
    (
        "orbit_axis_zero",
        "3:23: `animation.orbit.axis` must not be the zero vector",
    ),
    (
        "orbit_center_short",
        "2:33: `animation.orbit.center` must be three numbers (x, y, z), not (0, 1)",
    ),
    (
        "orbit_speed_nan",
        "2:45: `animation.orbit.degrees_per_second` must be a finite number, not NaN",
    ),
    (
        "shape_bottom",
        "4:32: `objects[1].shape.bottom` must be true or false, not 1",
    ),
    (
        "shape_box_flat",
        "4:34: `objects[1].shape.size` must be above 0, but is 0",
    ),
    (
        "shape_kind",
        "4:17: unknown kind `Cube`; the kinds are `Teapot`, `Sphere`, `Torus`, `Plane` and `Box`",
    ),
    (
        "shape_in_quotes",
        "2:23: the kind is missing here: one of `Teapot(..)`, `Sphere(..)`, `Torus(..)`, `Plane(..)`, `Box(..)`",
    ),
    (
        "shape_no_parentheses",
        "4:17: `Teapot` needs parentheses, also where all fields are left out: `Teapot()`",
    ),
    (
        "shape_sphere_radius",
        "4:32: `objects[1].shape.radius` must be above 0, but is -1",
    ),
    (
        "shape_tessellation_fraction",
        "4:38: `objects[1].shape.tessellation` must be a whole number from 1 to 8192, not 4.5",
    ),
    (
        "shape_tessellation_huge",
        "4:38: `objects[1].shape.tessellation` must be a whole number from 1 to 8192, not 4000000000",
    ),
    (
        "shape_tessellation_negative",
        "4:38: `objects[1].shape.tessellation` must be a whole number from 1 to 8192, not -4",
    ),
    (
        "shape_tessellation_zero",
        "4:38: `objects[1].shape.tessellation` must be a whole number from 1 to 8192, not 0",
    ),
    (
        "shape_too_many_triangles",
        "4:17: `objects[1].shape` brings the scene to 127987584 triangles; at most 16000000 are possible",
    ),
    (
        "shape_torus_too_thick",
        "4:54: `objects[1].shape.minor_radius` is 1.5 and must be less than `major_radius`, which is 1",
    ),
    (
        "shape_triangles_in_sum",
        "5:17: `objects[2].shape` brings the scene to 25003584 triangles; at most 16000000 are possible",
    ),
    (
        "spin_number",
        "2:38: fields in parentheses `(name: value, ..)` are needed here",
    ),
    (
        "spin_speed_huge",
        "4:53: `objects[1].spin.degrees_per_second` must be at most 36000 in magnitude, but is -1e5",
    ),
    (
        "spin_unknown_field",
        "2:39: unknown field `speed` of `Turn`; the fields are `degrees_per_second`, `axis` and `center`",
    ),
    (
        "too_many_lights",
        "131:9: `lights` has 129 entries; at most 128 are possible",
    ),
    (
        "trailing_text",
        "2:1: nothing may follow the scene's closing `)`",
    ),
    (
        "unclosed",
        "4:1: the file ends too early; a bracket or quote is not closed",
    ),
    ("unclosed_string", "3:9: a string is not closed"),
    (
        "unknown_field",
        "2:5: unknown field `abmient` of `Scene`; the fields are `camera`, `background`, `ambient`, `lights`, `materials`, `objects` and `animation`",
    ),
    (
        "windows_lines_and_umlauts",
        r#"3:38: `materials["größe"].shininess` must not be negative, but is -1"#,
    ),
];

#[test]
fn each_bad_file_gives_its_message() {
    for (stem, expected) in EXPECTED {
        let path = directory().join(stem).with_extension("ron");
        let error = Scene::load(&path).expect_err(stem);
        assert_eq!(
            error.to_string(),
            format!("{}:{expected}", path.display()),
            "{stem}"
        );
        assert!(!error.is_io(), "{stem} is bad input, not a failure to read");
    }
}

#[test]
fn each_bad_file_is_expected() {
    let mut found: Vec<_> = fs::read_dir(directory())
        .expect("the folder of bad scenes")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "ron"))
        .map(|path| {
            path.file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    found.sort_unstable();
    let mut expected: Vec<_> = EXPECTED.iter().map(|(stem, _)| *stem).collect();
    expected.sort_unstable();
    assert_eq!(found, expected);
}

#[test]
fn a_missing_file_and_a_directory_are_failures_to_read() {
    let missing = Scene::load(directory().join("missing.ron")).expect_err("there is none");
    assert!(missing.is_io());
    assert!(
        missing
            .to_string()
            .ends_with("missing.ron': there is no such file")
    );
    let folder = Scene::load(directory()).expect_err("a folder is no scene");
    assert!(folder.is_io());
    assert!(folder.to_string().ends_with("bad': it is a directory"));
}

#[test]
fn a_file_that_is_too_large_is_not_parsed() {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.as_file()
        .set_len(limits::MAX_FILE_BYTES + 1)
        .expect("room for an empty file");
    let error = Scene::load(file.path()).expect_err("too large");
    assert!(matches!(error, SceneError::TooLarge { .. }) && !error.is_io());
    assert!(error.to_string().ends_with("is larger than 64 MiB"));
}

#[test]
fn too_many_materials_are_refused() {
    let mut text = String::from("(materials: {\n");
    for index in 0..=limits::MAX_MATERIALS {
        text.push_str(&format!("\"m{index}\": (),\n"));
    }
    text.push_str("}, objects: [(shape: Plane())])");
    let error = Scene::parse(&text, "many").expect_err("too many materials");
    assert_eq!(
        error.to_string(),
        "many:65536:1: `materials` has more than 65534 entries"
    );
}

#[test]
fn a_byte_order_mark_does_not_shift_columns() {
    let error = Scene::parse("\u{feff}(ambient: -1)", "marked").expect_err("no objects");
    assert!(error.to_string().starts_with("marked:1:"), "{error}");
    let text = "(objects: [(shape: Plane(), scale: 0)])";
    let plain = Scene::parse(text, "f").expect_err("flat");
    let marked = Scene::parse(&format!("\u{feff}{text}"), "f").expect_err("flat");
    assert_eq!(plain.to_string(), marked.to_string());
}

proptest::proptest! {
    /// Cutting a good scene short, or changing one byte of it, gives a scene or a message, never a panic.
    #[test]
    fn damaged_scenes_do_not_panic(at in 0_usize..2000, byte in 0_u8..128, cut: bool) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/teapot.ron");
        let mut text = fs::read(path).expect("the teapot scene");
        let at = at % text.len();
        if cut {
            text.truncate(at);
        } else {
            text[at] = byte;
        }
        if let Ok(text) = String::from_utf8(text) {
            let _ = Scene::parse(&text, "damaged");
        }
    }
}
