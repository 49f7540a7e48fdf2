//! Time goes to what may be seen, counted in blocks.

use super::*;

/// How many blocks culling visits, and what it finds.
fn visits(clusters: &[Cluster], view: &View) -> (usize, CullCounts) {
    let mut culler = Culler::new(clusters);
    let counts = culler.cull(view, &mut Vec::new());
    assert_eq!(counts, one_by_one(clusters, view));
    (culler.visited, counts)
}

/// The clusters, and as many copies of them, each moved by `step` from the one before.
fn with_copies(clusters: &[Cluster], copies: u32, step: DVec3) -> Vec<Cluster> {
    let count = clusters.last().map_or(0, |last| last.triangles.end);
    let copy = |i: u32| {
        clusters.iter().map(move |cluster| {
            let center = DVec3::from(cluster.center.map(f64::from)) + step * f64::from(i);
            let triangles = &cluster.triangles;
            Cluster {
                triangles: triangles.start + i * count..triangles.end + i * count,
                center: center.as_vec3().to_array(),
                ..cluster.clone()
            }
        })
    };
    (0..=copies).flat_map(copy).collect()
}

/// A fine sphere that the image holds, and how it is seen.
fn sphere() -> (Vec<Cluster>, View) {
    let model = Model::new(&shapes::sphere(512, 256), DMat4::IDENTITY);
    let camera = Camera {
        width: 1280,
        height: 720,
        scale: 900.0,
        far: 100.0,
        ..FROM_OUTSIDE
    };
    (model.clusters, camera.view())
}

#[test]
fn most_clusters_seen_whole_are_decided_in_sets() {
    let (clusters, view) = sphere();
    let (visited, counts) = visits(&clusters, &view);
    assert!(clusters.len() > 2000 && counts.facing_away > 800);
    // 256 blocks of clusters there are; along the silhouette there may be 8 x sqrt(2048 pi) clusters or so.
    assert!(visited < 130, "{visited} blocks");
}

#[test]
fn ten_times_the_clusters_off_screen_cost_little() {
    let (clusters, view) = sphere();
    let (alone, _) = visits(&clusters, &view);
    for step in [DVec3::X * 12.0, DVec3::Z * -9.0, DVec3::NEG_Y * 7.0] {
        let (visited, counts) = visits(&with_copies(&clusters, 10, step), &view);
        assert_eq!(counts.outside_frustum as usize, 10 * clusters.len());
        assert!(visited < 2 * alone, "{visited} blocks instead of {alone}");
    }
}

#[test]
fn ten_times_the_clusters_facing_away_cost_little() {
    let (clusters, view) = sphere();
    let (alone, before) = visits(&clusters, &view);
    let far: Vec<Cluster> = (clusters.iter())
        .filter(|cluster| cluster.cone_axis[1] > 0.7 && cluster.min_altitude > 1e-3)
        .cloned()
        .collect();
    let count = (10 * clusters.len()).div_ceil(far.len());
    let mut all = clusters.clone();
    let shift = clusters.last().map_or(0, |last| last.triangles.end);
    let copies = with_copies(&far, count as u32, DVec3::Y * 0.1);
    all.extend(copies.iter().map(|cluster| Cluster {
        triangles: cluster.triangles.start + shift..cluster.triangles.end + shift,
        ..cluster.clone()
    }));
    let (visited, counts) = visits(&all, &view);
    let added = all.len() - clusters.len();
    assert!(added >= 10 * clusters.len());
    assert_eq!((counts.facing_away - before.facing_away) as usize, added);
    assert!(visited < 2 * alone, "{visited} blocks instead of {alone}");
}

#[test]
fn what_is_seen_from_the_front_is_one_block() {
    let toward_viewer = DMat4::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let model = Model::new(&shapes::plane(1.0, 1.0, 200, 200), toward_viewer);
    let (visited, counts) = visits(&model.clusters, &FROM_OUTSIDE.view());
    assert_eq!((counts.triangles, visited), (80_000, 1));
    // The back of it is one block, too.
    let backs: Vec<Cluster> = model.clusters.iter().map(|c| c.turned(0)).collect();
    let (visited, counts) = visits(&backs, &FROM_OUTSIDE.view());
    assert_eq!((counts.triangles, visited), (0, 1));
}

/// No less is dropped than one by one, whatever the shape's tessellation, at views all round, as a whole and close up.
#[test]
fn sets_drop_all_that_clusters_do() {
    for mesh in [
        shapes::teapot(8, true),
        shapes::teapot(32, false),
        shapes::sphere(64, 32),
        shapes::sphere(300, 200),
        shapes::torus(0.7, 0.3, 80, 40),
        shapes::torus(0.7, 0.1, 400, 100),
    ] {
        let clusters = Model::new(&mesh, DMat4::IDENTITY).with_back().clusters;
        let mut culler = Culler::new(&clusters);
        for step in 0..60 {
            let turn = f64::from(step) * 0.7;
            let (sin, cos) = libm::sincos(turn);
            let distance = [1.2, 2.5, 6.0, 40.0][step as usize % 4];
            let camera = Camera {
                eye: DVec3::new(sin, cos, 0.8 * libm::sin(turn * 0.37)) * distance,
                near: 0.05,
                far: 100.0,
                parallel: step % 5 == 4,
                ..FROM_OUTSIDE
            };
            let view = camera.view();
            let counts = culler.cull(&view, &mut Vec::new());
            assert_eq!(counts, one_by_one(&clusters, &view), "{camera:?}");
        }
    }
}

/// After clusters have moved, all is as if it had been built where they are now, as far as results go.
#[test]
fn refitted_is_as_built() {
    let clusters = Model::new(&shapes::torus(0.7, 0.3, 120, 60), DMat4::IDENTITY).clusters;
    let view = FROM_OUTSIDE.view();
    let mut culler = Culler::new(&clusters);
    for moved in [1, 7, 50] {
        let mut now = clusters.clone();
        for (i, cluster) in now.iter_mut().enumerate().filter(|(i, _)| i % moved == 0) {
            cluster.center[i % 3] += 0.7;
            cluster.cone_axis = cluster.cone_axis.map(|c| -c);
            cluster.min_altitude *= 0.5;
        }
        // Unbounded for a while.
        now[moved].radius = f32::INFINITY;
        culler.refit(&now);
        let (mut ranges, mut expected) = (Vec::new(), Vec::new());
        let counts = culler.cull(&view, &mut ranges);
        assert_eq!(counts, Culler::new(&now).cull(&view, &mut expected));
        assert_eq!(ranges, expected);
        assert_eq!(counts, one_by_one(&now, &view));
    }
    culler.refit(&clusters);
    let counts = culler.cull(&view, &mut Vec::new());
    assert_eq!(counts, one_by_one(&clusters, &view));
}
