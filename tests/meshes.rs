//! Meshes from OBJ files: what is read is what was written, normals are those of the surface, polygons are cut right, and a mesh
//! opened by itself is in the middle of the picture.

use glam::{DMat3, DVec3};
use proptest::prelude::*;
use specula::geometry::import::{Normals, ObjLimits, mesh, obj};
use specula::geometry::normals::Weight;
use specula::geometry::polygon::Triangulator;
use specula::geometry::{Mesh, shapes};
use specula::scene::{LightKind, Scene, World};
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;

const LIMITS: ObjLimits = ObjLimits {
    max_length: 1e60,
    max_triangles: 1_000_000,
};

fn read(text: &str, normals: Normals) -> Mesh {
    mesh(obj::read(text, &LIMITS).expect("a valid file"), normals)
}

fn smooth(crease_degrees: f64, weight: Weight) -> Normals {
    Normals::Smooth {
        crease_degrees,
        weight,
    }
}

/// A mesh as the text of an OBJ file; numbers are written so that they are read back exactly.
fn write_obj(mesh: &Mesh, with_normals: bool) -> String {
    let mut text = String::from("# a mesh\no thing\n");
    for p in &mesh.positions {
        writeln!(text, "v {:e} {:e} {:e}", p.x, p.y, p.z).expect("memory");
    }
    if with_normals {
        for n in &mesh.normals {
            writeln!(text, "vn {} {} {}", n.x, n.y, n.z).expect("memory");
        }
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| v + 1);
        if with_normals {
            writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}").expect("memory");
        } else {
            writeln!(text, "f {a} {b} {c}").expect("memory");
        }
    }
    text
}

fn position_key(p: DVec3) -> [u64; 3] {
    p.to_array().map(|c| (c + 0.0).to_bits())
}

fn face_normal(mesh: &Mesh, t: [u32; 3]) -> DVec3 {
    let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
    (b - a).cross(c - a).normalize()
}

/// The largest angle in degrees between normals and what they should be.
fn worst_degrees(mesh: &Mesh, truth: impl Fn(DVec3) -> DVec3) -> f64 {
    mesh.positions
        .iter()
        .zip(&mesh.normals)
        .map(|(&p, &n)| n.angle_between(truth(p)).to_degrees())
        .fold(0.0, f64::max)
}

/// The unit cube about the origin, eight vertices and six quadrilaterals.
const CUBE: &str = "\
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn shapes_written_and_read_again_have_the_same_triangles() {
    for (name, shape) in [
        ("teapot", shapes::teapot(4, true)),
        ("sphere", shapes::sphere(9, 7)),
        ("torus", shapes::torus(1.0, 0.3, 12, 8)),
        ("plane", shapes::plane(2.0, 3.0, 4, 5)),
        ("box", shapes::cuboid(DVec3::new(1.0, 2.0, 3.0))),
    ] {
        let again = read(&write_obj(&shape, true), Normals::File);
        assert_eq!(again.triangles.len(), shape.triangles.len(), "{name}");
        for (a, b) in shape.triangles.iter().zip(&again.triangles) {
            for (&a, &b) in a.iter().zip(b) {
                assert_eq!(
                    shape.positions[a as usize], again.positions[b as usize],
                    "{name}"
                );
                let turned = shape.normals[a as usize] - again.normals[b as usize];
                assert!(turned.length() < 1e-15, "{name}: normal off by {turned}");
            }
        }
        assert!(
            again.positions.len() <= shape.positions.len(),
            "{name}: no vertex is split"
        );
    }
}

#[test]
fn a_cube_of_shared_vertices_has_flat_sides() {
    for normals in [Normals::File, Normals::Flat, smooth(89.0, Weight::Equal)] {
        let cube = read(CUBE, normals);
        assert_eq!(cube.positions.len(), 24, "three vertices at each corner");
        assert_eq!(cube.triangles.len(), 12);
        for &t in &cube.triangles {
            let face = face_normal(&cube, t);
            let outwards: DVec3 = t.iter().map(|&v| cube.positions[v as usize]).sum();
            assert!(face.dot(outwards) > 0.0);
            for v in t {
                assert!((cube.normals[v as usize] - face).length() < 1e-12);
            }
        }
    }
}

#[test]
fn a_cube_beyond_its_crease_angle_is_smooth_and_equal_weights_count_faces_not_triangles() {
    for weight in [Weight::Equal, Weight::Area, Weight::Angle] {
        let cube = read(CUBE, smooth(90.0, weight));
        assert_eq!(cube.positions.len(), 8);
        assert!(worst_degrees(&cube, |p| p) < 1e-6, "{weight:?}");
    }
}

#[test]
fn angle_weights_do_not_depend_on_how_a_surface_is_cut() {
    let triangles = write_obj(&read(CUBE, Normals::Flat), false);
    let worst = |weight| worst_degrees(&read(&triangles, smooth(90.0, weight)), |p| p);
    assert!(worst(Weight::Angle) < 1e-6);
    assert!(worst(Weight::Equal) > 5.0, "one or two triangles of a side");
}

#[test]
fn a_sphere_without_normals_gets_the_right_ones() {
    // The shape repeats its positions along a seam and at the poles: without welding normals there would be off.
    let text = write_obj(&shapes::sphere(32, 16), false);
    for (weight, most) in [
        (Weight::Equal, 2.0),
        (Weight::Area, 3.0),
        (Weight::Angle, 0.5),
    ] {
        for crease in [30.0, 60.0, 180.0] {
            let sphere = read(&text, smooth(crease, weight));
            let worst = worst_degrees(&sphere, |p| p);
            assert!(worst < most, "{weight:?}: {worst} degrees");
            assert_eq!(sphere.positions.len(), 32 * 15 + 2, "welded");
        }
    }
    assert_eq!(
        read(&text, Normals::File),
        read(&text, smooth(60.0, Weight::Angle))
    );
}

#[test]
fn a_torus_without_normals_gets_the_right_ones() {
    let text = write_obj(&shapes::torus(1.0, 0.4, 48, 24), false);
    let truth = |p: DVec3| p - p.with_z(0.0).normalize();
    for weight in [Weight::Equal, Weight::Area, Weight::Angle] {
        let torus = read(&text, smooth(60.0, weight));
        let worst = worst_degrees(&torus, truth);
        assert!(worst < 2.0, "{weight:?}: {worst} degrees");
        assert_eq!(torus.positions.len(), 48 * 24, "welded");
    }
}

#[test]
fn patches_that_repeat_positions_join_without_a_seam() {
    // Each triangle has vertices of its own.
    let shape = shapes::torus(1.0, 0.4, 20, 10);
    let mut soup = Mesh::default();
    for t in &shape.triangles {
        let first = soup.positions.len() as u32;
        soup.positions
            .extend(t.map(|v| shape.positions[v as usize]));
        soup.triangles.push([first, first + 1, first + 2]);
    }
    let joined = read(&write_obj(&soup, false), Normals::File);
    let mut normal_at = HashMap::new();
    for (&p, &n) in joined.positions.iter().zip(&joined.normals) {
        assert!(
            normal_at.insert(position_key(p), n).is_none(),
            "two vertices at {p}"
        );
    }
    assert_eq!(normal_at.len(), 200);
}

#[test]
fn normals_of_the_file_are_used_and_bad_ones_repaired() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let tilted = "vn 0 3 4\nvn 0 0 0\nvn nan 0 1\nvn 0 -inf 0\nvn 1e300 0 1e300\n";
    let given = read(
        &format!("{square}{tilted}f 1//1 2//2 3//3 4//4\n"),
        Normals::File,
    );
    let given_one = DVec3::new(0.0, 0.6, 0.8);
    assert!((given.normals[0] - given_one).length() < 1e-15);
    assert_eq!(given.normals[1..], [DVec3::Z; 3], "repaired");
    // Some corners with a normal, some without, in either order.
    let mixed = format!("{square}{tilted}f 1 2//1 3\nf 1//5 3 4\n");
    let mesh = read(&mixed, Normals::File);
    let normal = |t: usize, k: usize| mesh.normals[mesh.triangles[t][k] as usize];
    assert_eq!(normal(0, 0), DVec3::Z);
    assert!((normal(0, 1) - given_one).length() < 1e-15);
    assert_eq!(normal(0, 2), DVec3::Z);
    assert!((normal(1, 0) - DVec3::new(0.5, 0.0, 0.5).normalize()).length() < 1e-15);
    assert_eq!(normal(1, 1), DVec3::Z);
    // Asked for others, those are not used.
    let flat = read(&mixed, Normals::Flat);
    assert!(flat.normals.iter().all(|&n| n == DVec3::Z));
}

#[test]
fn what_does_not_matter_is_skipped_and_what_is_continued_is_joined() {
    let plain = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    let dressed = "# v 9 9 9 \\\r\nmtllib none such.mtl\r\no first\r\nv 0 0 0 1 0 0\r\n\tv  1 0 0\r\nv 2 2 0 2 # scaled\r\n\
        vt 0 0\r\nvt 1 x\r\ng a b\r\nv 0 \\\r\n1 0 0.5 0.5 0.5\r\nusemtl\r\ns off\r\nl 1 99\r\np 7\r\nvp 1\r\n\
        f -4/7 2/-9/ \\\r\n  3// -1\r\ncurv 0 1 2";
    assert_eq!(read(plain, Normals::File), read(dressed, Normals::File));
}

#[test]
fn all_groups_make_one_mesh_and_share_normals() {
    let (side, roof) = CUBE.split_at(CUBE.find("f 1 2 6 5").expect("a side"));
    let groups = format!("o one\n{side}g two\nusemtl gold\n{roof}");
    assert_eq!(
        read(&groups, smooth(90.0, Weight::Area)),
        read(CUBE, smooth(90.0, Weight::Area))
    );
}

#[test]
fn faces_without_area_change_nothing_but_get_unit_normals() {
    let sphere = shapes::sphere(12, 8);
    let text = write_obj(&sphere, false);
    let count = sphere.positions.len();
    // A point, a needle along an edge, and one alone.
    let [a, b, _] = sphere.triangles[40].map(|v| v + 1);
    let more = format!(
        "{text}v 5 5 5\nv 6 6 6\nv 7 7 7\nf {a} {a} {a}\nf {a} {b} {b}\nf {a} {b} {a} {b}\nf {} {} {}\n",
        count + 1,
        count + 2,
        count + 3
    );
    let normals = smooth(60.0, Weight::Angle);
    let (plain, with_flat) = (read(&text, normals), read(&more, normals));
    for (t, u) in plain.triangles.iter().zip(&with_flat.triangles) {
        for (&v, &w) in t.iter().zip(u) {
            let turned = plain.normals[v as usize] - with_flat.normals[w as usize];
            assert!(turned.length() < 1e-9, "off by {turned}");
        }
    }
    assert_eq!(with_flat.triangles.len(), plain.triangles.len() + 5);
    for n in &with_flat.normals {
        assert!((n.length() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_corner_that_a_face_repeats_has_the_normal_of_the_face() {
    // Another face, first in the file, meets this one at right angles.
    let vertices = "v 0 0 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\nv 1 0 0\nv 1 1 0\n";
    for face in [
        "1 2 3",
        "1 2 2 3",
        "1 1 2 3",
        "1 2 3 3",
        "1 2 3 1",
        "1 2 4 4 3",
        "2 2 3 1 2 2",
    ] {
        for normals in [
            Normals::Flat,
            smooth(60.0, Weight::Angle),
            smooth(60.0, Weight::Area),
        ] {
            let mesh = read(&format!("{vertices}f 1 5 6 2\nf {face}\n"), normals);
            let mut faces = 0;
            for &t in &mesh.triangles {
                let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                if (b - a).cross(c - a) == DVec3::ZERO {
                    continue;
                }
                faces += 1;
                let normal = face_normal(&mesh, t);
                for v in t {
                    let off = mesh.normals[v as usize] - normal;
                    assert!(off.length() < 1e-12, "f {face}, {normals:?}: {off}");
                }
            }
            assert!(faces >= 3, "f {face}: {faces}");
        }
    }
}

/// Twice the signed area of a flat polygon, by the shoelace formula.
fn shoelace(points: &[[f64; 2]]) -> f64 {
    (0..points.len())
        .map(|i| {
            let ([x, y], [u, v]) = (points[i], points[(i + 1) % points.len()]);
            x * v - u * y
        })
        .sum()
}

/// Cuts a flat simple polygon, turned somehow in space, and checks the triangles.
fn check_cut(points: &[[f64; 2]], place: DMat3, offset: DVec3) {
    let in_space: Vec<DVec3> = points
        .iter()
        .map(|&[x, y]| place * DVec3::new(x, y, 0.0) + offset)
        .collect();
    let mut triangles = Vec::new();
    Triangulator::new().triangulate(&in_space, &mut triangles);
    assert_eq!(triangles.len(), points.len() - 2);
    let whole = shoelace(points);
    let mut sum = 0.0;
    let mut used = vec![false; points.len()];
    for t in &triangles {
        t.iter().for_each(|&v| used[v as usize] = true);
        let area = shoelace(&t.map(|v| points[v as usize]));
        assert!(
            area * whole.signum() >= -1e-9 * whole.abs(),
            "{t:?} turns the wrong way"
        );
        sum += area;
    }
    // Triangles that turn the right way and have the right area together neither overlap nor leave the polygon.
    assert!(
        (sum - whole).abs() <= 1e-9 * whole.abs(),
        "{sum} of {whole}"
    );
    assert!(used.iter().all(|&u| u), "every corner is kept");
    // Each side of the polygon is a side of one triangle: no T-junctions with its neighbours.
    let count = points.len() as u32;
    for i in 0..count {
        let side = [i, (i + 1) % count];
        let on_it = triangles
            .iter()
            .filter(|t| (0..3).any(|k| [t[k], t[(k + 1) % 3]] == side))
            .count();
        assert_eq!(on_it, 1, "side {side:?}");
    }
}

#[test]
fn letters_and_spirals_are_cut_right() {
    let l = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 4], [0, 4]];
    let l_with_points_on_its_sides = [
        [0, 0],
        [1, 0],
        [2, 0],
        [3, 0],
        [3, 1],
        [2, 1],
        [1, 1],
        [1, 2],
        [1, 4],
        [0, 4],
        [0, 3],
        [0, 1],
    ];
    let comb = [
        [0, 0],
        [9, 0],
        [9, 5],
        [8, 1],
        [7, 5],
        [6, 1],
        [5, 5],
        [4, 1],
        [3, 5],
        [2, 1],
        [1, 5],
    ];
    let arrow = [[0, 0], [4, -3], [1, 0], [4, 3]];
    let spiral = [
        [0, 0],
        [9, 0],
        [9, 9],
        [1, 9],
        [1, 3],
        [6, 3],
        [6, 6],
        [3, 6],
        [3, 5],
        [5, 5],
        [5, 4],
        [2, 4],
        [2, 8],
        [8, 8],
        [8, 1],
        [0, 1],
    ];
    let shapes: [&[[i32; 2]]; 5] = [&l, &l_with_points_on_its_sides, &comb, &arrow, &spiral];
    for shape in shapes {
        let points: Vec<_> = shape.iter().map(|p| p.map(f64::from)).collect();
        let backwards: Vec<_> = points.iter().rev().copied().collect();
        for points in [points, backwards] {
            for start in 0..points.len() {
                let mut turned = points.clone();
                turned.rotate_left(start);
                for axes in [
                    DMat3::IDENTITY,
                    DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::NEG_Z),
                    DMat3::from_cols(DVec3::Z, DVec3::X, DVec3::Y),
                    DMat3::from_cols(DVec3::NEG_X, DVec3::Z, DVec3::Y),
                ] {
                    check_cut(&turned, axes, DVec3::ZERO);
                }
            }
        }
    }
}

fn direction() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-1.0..1.0)
        .prop_map(DVec3::from_array)
        .prop_filter("has a direction", |v| v.length() > 0.1)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Stars about a point, with points on some of their sides, anywhere in space and of any size.
    #[test]
    fn stars_are_cut_right(
        radii in prop::collection::vec(0.1_f64..1.0, 3..60),
        split in prop::collection::vec(any::<bool>(), 60),
        backwards: bool,
        normal in direction(),
        offset in prop::array::uniform3(-10.0_f64..10.0),
        exponent in -30_i32..30,
    ) {
        let corners: Vec<[f64; 2]> = radii
            .iter()
            .enumerate()
            .map(|(i, &r)| {
                let (sine, cosine) = (TAU * i as f64 / radii.len() as f64).sin_cos();
                [r * cosine, r * sine]
            })
            .collect();
        let mut points = Vec::new();
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            points.push(a);
            if split[i] {
                points.push([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]);
            }
        }
        if backwards {
            points.reverse();
        }
        let z = normal.normalize();
        let x = z.any_orthonormal_vector();
        let size = 10_f64.powi(exponent);
        check_cut(
            &points,
            DMat3::from_cols(x, z.cross(x), z) * size,
            DVec3::from_array(offset) * size,
        );
    }

    /// Whatever a polygon is like, it becomes two triangles less than it has corners.
    #[test]
    fn any_polygon_is_cut_into_as_many_triangles_as_promised(
        points in prop::collection::vec(prop::array::uniform3(-2_i32..3), 0..24),
        exponent in -300_i32..60,
    ) {
        let size = 10_f64.powi(exponent);
        let points: Vec<DVec3> = points
            .iter()
            .map(|p| DVec3::from_array(p.map(f64::from)) * size)
            .collect();
        let mut triangles = Vec::new();
        Triangulator::new().triangulate(&points, &mut triangles);
        prop_assert_eq!(triangles.len(), points.len().saturating_sub(2));
        prop_assert!(triangles.iter().flatten().all(|&v| (v as usize) < points.len()));
    }

    /// Two faces that meet at an angle share normals up to the crease angle and no further, for any size of the file's numbers.
    #[test]
    fn a_hinge_is_smooth_up_to_its_crease_angle(
        bend in 1.0_f64..179.0,
        crease in 0.0_f64..180.0,
        exponent in -50_i32..50,
    ) {
        prop_assume!((bend - crease).abs() > 1e-3);
        let size = 10_f64.powi(exponent);
        let (sine, cosine) = bend.to_radians().sin_cos();
        let text = format!(
            "v 0 0 0\nv 0 {s:e} 0\nv {s:e} 0 0\nv {:e} 0 {:e}\nf 1 3 2\nf 1 2 4\n",
            -cosine * size,
            -sine * size,
            s = size
        );
        for weight in [Weight::Equal, Weight::Area, Weight::Angle] {
            let hinge = read(&text, smooth(crease, weight));
            let is_smooth = bend < crease;
            prop_assert_eq!(hinge.positions.len(), if is_smooth { 4 } else { 6 });
            let on_edge = hinge.normals[hinge.triangles[0][0] as usize];
            let truth = if is_smooth {
                let (sine, cosine) = (bend * 0.5).to_radians().sin_cos();
                DVec3::new(-sine, 0.0, cosine)
            } else {
                DVec3::Z
            };
            prop_assert!((on_edge - truth).length() < 1e-6, "{on_edge} for {truth}");
        }
    }
}

#[test]
fn a_scene_places_a_mesh_relative_to_its_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("models")).expect("a folder");
    fs::write(folder.path().join("models/cube.obj"), CUBE).expect("written");
    let path = folder.path().join("scene.ron");
    let text = r#"(objects: [
        (mesh: "models/cube.obj"),
        (mesh: "models/cube.obj", position: (3, 0, 0), scale: (1, 1, 2)),
        (mesh: "models/cube.obj", normals: Smooth(crease_degrees: 95)),
        (mesh: "models/cube.obj", normals: Flat, up: Z),
    ])"#;
    fs::write(&path, text).expect("written");
    let scene = Scene::load(&path).expect("a valid scene");
    let parsed = Scene::parse(text, &path.to_string_lossy()).expect("a valid scene");
    assert_eq!(scene.triangle_count(), 48);
    assert_eq!(parsed.triangle_count(), 48);
    let vertices: Vec<_> = scene
        .objects()
        .iter()
        .map(|o| o.mesh.positions.len())
        .collect();
    assert_eq!(vertices, [24, 24, 8, 24]);
    assert!(
        std::sync::Arc::ptr_eq(&scene.objects()[0].mesh, &scene.objects()[1].mesh),
        "read once"
    );
    // The file's y axis points up in the scene, its z axis to the front; scaling is along the scene's axes.
    let place = scene.objects()[1].author_from_mesh;
    assert_eq!(place.transform_vector3(DVec3::Y), DVec3::Z * 2.0);
    assert_eq!(place.transform_vector3(DVec3::Z), DVec3::NEG_Y);
    assert_eq!(place.transform_point3(DVec3::X), DVec3::new(4.0, 0.0, 0.0));
    let as_it_is = scene.objects()[3].author_from_mesh;
    assert_eq!(as_it_is.transform_vector3(DVec3::Z), DVec3::Z);
}

/// Where the vertices of a scene appear: the box around them, in parts of the image from -1 to 1.
fn seen(scene: &Scene, [width, height]: [u32; 2]) -> [f64; 4] {
    let world = World::new(scene);
    let view = world.view(scene.camera(), width, height);
    let mut seen = [f64::MAX, f64::MIN, f64::MAX, f64::MIN];
    for i in 0..world.positions.len() {
        let p = view.project(world.positions.get(i));
        assert!(p[3] > 0.0, "behind the eye");
        let x = p[0] / p[3] / f64::from(width) * 2.0 - 1.0;
        let y = p[1] / p[3] / f64::from(height) * 2.0 - 1.0;
        seen = [
            seen[0].min(x),
            seen[1].max(x),
            seen[2].min(y),
            seen[3].max(y),
        ];
    }
    seen
}

#[test]
fn a_mesh_opened_by_itself_fills_the_middle_of_the_image() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("shape.OBJ");
    for shape in [
        shapes::teapot(4, false),
        shapes::plane(1.0, 9.0, 1, 1),
        shapes::sphere(20, 10),
        shapes::cuboid(DVec3::new(0.1, 9.0, 0.1)),
        shapes::cuboid(DVec3::new(9.0, 0.1, 0.1)),
    ] {
        for (size, offset) in [
            (1.0, DVec3::ZERO),
            (1e-20, DVec3::ZERO),
            (1e20, DVec3::ZERO),
            (1.0, DVec3::new(1e6, -1e6, 3e6)),
        ] {
            let mut placed = shape.clone();
            for p in &mut placed.positions {
                *p = *p * size + offset;
            }
            fs::write(&path, write_obj(&placed, false)).expect("written");
            let scene = Scene::load(&path).expect("a valid mesh");
            let [left, right, top, bottom] = seen(&scene, [1280, 960]);
            let fill = (right - left).max(bottom - top);
            assert!((1.7..1.74).contains(&fill), "fills {fill} of 2");
            assert!((left + right).abs() < 0.01, "{left} to {right}");
            assert!((top + bottom).abs() < 0.01, "{top} to {bottom}");
            let [left, right, top, bottom] = seen(&scene, [1280, 720]);
            assert!(left > -0.9 && right < 0.9 && top > -0.9 && bottom < 0.9);
            // Nobody sees the inside of a closed mesh.
            assert_eq!(scene.materials()[0].two_sided, !shape.is_closed());
            assert_eq!(scene.lights().len(), 3);
            for light in scene.lights() {
                let LightKind::Point { position } = light.kind else {
                    panic!("a point light");
                };
                let distance = (position - scene.camera().target).length();
                assert!(distance > 0.0 && distance.is_finite());
            }
        }
    }
}

#[test]
fn a_mesh_that_is_a_single_point_opens_all_the_same() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("point.obj");
    fs::write(&path, "v 7 7 7\nf 1 1 1\n").expect("written");
    let scene = Scene::load(&path).expect("a valid mesh");
    let [left, right, top, bottom] = seen(&scene, [640, 480]);
    assert!(left > -0.1 && right < 0.1 && top > -0.1 && bottom < 0.1);
}
