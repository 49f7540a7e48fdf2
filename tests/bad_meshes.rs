//! Every way in which a mesh file can be wrong gives one clear sentence that names the place.

use specula::geometry::import::{Normals, ObjLimits, mesh, obj};
use specula::scene::{Scene, SceneError, limits, load_mesh};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

fn directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad")
}

/// Each mesh file of `tests/bad` without its ending, and what is said about it after the file's name and a colon.
const EXPECTED: &[(&str, &str)] = &[
    (
        "mesh_continued_lines",
        "6:3: there is no vertex 7; the file has only 3",
    ),
    (
        "mesh_coordinate_cut_off",
        "4:1: `v` needs three coordinates, but has 2",
    ),
    (
        "mesh_coordinate_huge",
        "2:3: a coordinate must be at most 1e60 in magnitude, not 1e61",
    ),
    (
        "mesh_coordinate_infinite",
        "3:7: a coordinate must be a finite number, not -1e999",
    ),
    (
        "mesh_coordinate_nan",
        "2:5: a coordinate must be a finite number, not nan",
    ),
    (
        "mesh_coordinate_word",
        "2:7: a coordinate must be a number, not zero",
    ),
    (
        "mesh_empty",
        "1:1: there are no faces here; in an OBJ file they are lines such as `f 1 2 3`",
    ),
    (
        "mesh_face_of_none",
        "4:1: a face needs at least three corners, but has 0",
    ),
    (
        "mesh_face_of_two",
        "5:3: a face needs at least three corners, but has 2",
    ),
    (
        "mesh_garbage",
        "4:7: a corner of a face must be `v`, `v/vt`, `v//vn` or `v/vt/vn` with whole numbers, not \\u{1b}[31m\\0über-lange-Zeichenfolge-ohne-Leerz...",
    ),
    (
        "mesh_index_before_first",
        "4:9: there is no vertex -4; up to here the file has only 3",
    ),
    (
        "mesh_index_four_parts",
        "4:3: a corner of a face must be `v`, `v/vt`, `v//vn` or `v/vt/vn` with whole numbers, not 1/1/1/1",
    ),
    (
        "mesh_index_fraction",
        "4:7: a corner of a face must be `v`, `v/vt`, `v//vn` or `v/vt/vn` with whole numbers, not 2.5",
    ),
    (
        "mesh_index_huge",
        "4:7: a corner of a face must be `v`, `v/vt`, `v//vn` or `v/vt/vn` with whole numbers, not 99999999999999999999",
    ),
    (
        "mesh_index_missing",
        "4:7: a corner of a face must be `v`, `v/vt`, `v//vn` or `v/vt/vn` with whole numbers, not //3",
    ),
    (
        "mesh_index_overflow",
        "5:3: there is no normal 6148914691236517206; the file has only 1",
    ),
    (
        "mesh_index_too_large",
        "5:7: there is no vertex 4; the file has only 3",
    ),
    (
        "mesh_index_zero",
        "4:3: there is no vertex 0; they are counted from 1",
    ),
    (
        "mesh_no_faces",
        "1:1: there are no faces here; in an OBJ file they are lines such as `f 1 2 3`",
    ),
    (
        "mesh_normal_beyond",
        "5:13: there is no normal 2; the file has only 1",
    ),
    (
        "mesh_normal_cut_off",
        "4:1: `vn` needs three numbers, but has 2",
    ),
    (
        "mesh_normal_word",
        "4:8: a normal's component must be a number, not up",
    ),
    (
        "mesh_normal_zero",
        "5:8: there is no normal 0; they are counted from 1",
    ),
    (
        "mesh_not_obj",
        "1:1: there are no faces here; in an OBJ file they are lines such as `f 1 2 3`",
    ),
    ("mesh_not_utf8", "1:5: this is not UTF-8 text"),
    (
        "mesh_weight_tiny",
        "2:9: divided by this weight, a coordinate exceeds 1e60 in magnitude",
    ),
    (
        "mesh_weight_zero",
        "2:9: the weight of a vertex must not be zero",
    ),
];

#[test]
fn each_bad_mesh_gives_its_message() {
    for (stem, expected) in EXPECTED {
        let path = directory().join(stem).with_extension("obj");
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
fn each_bad_mesh_is_expected() {
    let mut found: Vec<_> = fs::read_dir(directory())
        .expect("the folder of bad files")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "obj"))
        .map(|path| {
            let stem = path.file_stem().unwrap_or_default();
            stem.to_string_lossy().into_owned()
        })
        .collect();
    found.sort_unstable();
    let mut expected: Vec<_> = EXPECTED.iter().map(|(stem, _)| *stem).collect();
    expected.sort_unstable();
    assert_eq!(found, expected);
}

#[test]
fn a_scene_that_names_a_bad_mesh_gets_the_mesh_s_message() {
    let text = r#"(objects: [(mesh: "mesh_face_of_two.obj")])"#;
    let scene = directory().join("scene.ron");
    let error = Scene::parse(text, &scene.to_string_lossy()).expect_err("two corners");
    let mesh = directory().join("mesh_face_of_two.obj");
    assert_eq!(
        error.to_string(),
        format!(
            "{}:5:3: a face needs at least three corners, but has 2",
            mesh.display()
        )
    );
}

#[test]
fn a_scene_that_names_no_mesh_file_is_told_where() {
    for (name, reason) in [
        ("none.obj", "there is no such file"),
        (".", "it is a directory"),
    ] {
        let text = format!("(objects: [\n(mesh: {name:?})])");
        let scene = directory().join("scene.ron");
        let error = Scene::parse(&text, &scene.to_string_lossy()).expect_err(name);
        assert_eq!(
            error.to_string(),
            format!(
                "{}:2:8: `objects[0].mesh` cannot be read from '{}': {reason}",
                scene.display(),
                directory().join(name).display()
            )
        );
        assert!(!error.is_io(), "the scene is wrong");
    }
}

#[test]
fn a_missing_mesh_and_a_directory_are_failures_to_read() {
    let missing = Scene::load(directory().join("missing.OBJ")).expect_err("there is none");
    assert!(missing.is_io());
    assert!(
        missing
            .to_string()
            .ends_with("missing.OBJ': there is no such file")
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("folder.obj");
    fs::create_dir(&path).expect("a folder");
    let error = load_mesh(&path, Normals::File).expect_err("a folder");
    assert!(error.is_io());
    assert!(
        error
            .to_string()
            .ends_with("folder.obj': it is a directory")
    );
}

#[test]
fn a_mesh_file_that_is_too_large_is_not_read() {
    let file = tempfile::Builder::new()
        .suffix(".obj")
        .tempfile()
        .expect("a temporary file");
    file.as_file()
        .set_len(limits::MAX_MESH_BYTES + 1)
        .expect("room for a file of nothing");
    let error = Scene::load(file.path()).expect_err("too large");
    assert!(matches!(error, SceneError::TooLarge { .. }) && !error.is_io());
    assert!(error.to_string().ends_with("is larger than 1024 MiB"));
}

#[test]
fn too_many_triangles_and_too_many_corners_are_refused() {
    let limits = ObjLimits {
        max_length: 1.0,
        max_triangles: 3,
    };
    let points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    assert!(obj::read(&format!("{points}f 1 2 3 4\nf 1 2 3\n"), &limits).is_ok());
    let text = format!("{points}f 1 2 3 4\nf 1 2 3 4\n");
    let error = obj::read(&text, &limits).expect_err("four triangles");
    assert_eq!(
        (error.offset, error.to_string().as_str()),
        (
            text.rfind('f').expect("a face"),
            "the mesh has more than 3 triangles, which is the most possible"
        )
    );
    let mut text = format!("{points}f");
    for _ in 0..=10_000 {
        text.push_str(" 1");
    }
    let error = obj::read(&text, &limits).expect_err("too many corners");
    assert_eq!(error.message, "a face has more than 10000 corners");
}

#[test]
fn a_byte_order_mark_does_not_shift_columns() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("marked.obj");
    fs::write(&path, "\u{feff}v 0 x 0\n").expect("written");
    let error = Scene::load(&path).expect_err("no number");
    assert!(error.to_string().contains("obj:1:5: "), "{error}");
}

/// Polygons that cross, touch and repeat themselves as badly as they can, up to the largest allowed.
#[test]
fn the_largest_and_worst_polygons_are_cut() {
    let count = 10_000_u32;
    for kind in 0..3 {
        let mut text = String::new();
        for i in 0..count {
            let [x, y] = match kind {
                0 => [i, i * 7919 % count],
                1 => [i * 7919 % 97, i * 104_729 % 89],
                _ => [i, 0],
            };
            writeln!(text, "v {x} {y} 0").expect("memory");
        }
        text.push('f');
        for i in 1..=count {
            write!(text, " {i}").expect("memory");
        }
        let limits = ObjLimits {
            max_length: 1e60,
            max_triangles: 1_000_000,
        };
        let polygons = obj::read(&text, &limits).expect("a valid file");
        let mesh = mesh(polygons, Normals::File);
        assert_eq!(mesh.triangles.len() as u32, count - 2, "kind {kind}");
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig { failure_persistence: None, ..Default::default() })]

    /// Cutting a good mesh short, or changing some bytes of it, gives a mesh or a message, never a panic.
    #[test]
    fn damaged_meshes_do_not_panic(
        at in proptest::array::uniform3(0_usize..10_000),
        bytes in proptest::array::uniform3(0_usize..16),
        cut: bool,
    ) {
        let mut text = GOOD.as_bytes().to_vec();
        for (at, byte) in at.into_iter().zip(bytes) {
            let at = at % text.len();
            text[at] = b"0123456789 /-.ef"[byte];
        }
        if cut {
            text.truncate(at[0] % text.len());
        }
        let text = String::from_utf8(text).expect("ASCII");
        let limits = ObjLimits { max_length: 1e60, max_triangles: 1000 };
        if let Ok(polygons) = obj::read(&text, &limits) {
            for normals in [Normals::File, Normals::Flat] {
                let mesh = mesh(polygons.clone(), normals);
                assert_eq!(mesh.positions.len(), mesh.normals.len(), "one normal each");
                for n in &mesh.normals {
                    assert!((n.length() - 1.0).abs() < 1e-12, "normal {n}");
                }
                let count = mesh.positions.len() as u32;
                assert!(mesh.triangles.iter().flatten().all(|&v| v < count), "indices exist");
            }
        }
    }
}

const GOOD: &str = "\
mtllib none.mtl
o roof
v 0 0 0
v 4 0 0 1
v 4 3 0 0.5 0.5 0.5
v 0 3 0
v 2 1 2
vn 0 0 1
vn 1e-3 0.5 -2
vt 0 0
f 1/1/1 2/1/1 3/1/2 4/1/1
f 1//2 2//1 5//1
usemtl none
f -1 2 3
f 3 4 5 \\
  1 2
";
