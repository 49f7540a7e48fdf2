//! Which pixels triangles get.

use super::fixture::{BACKGROUND, Fixture, Picture, Random, assert_near};
use crate::backend::BasePaint;

const SIZES: [(u32, u32); 6] = [(1, 1), (7, 5), (64, 64), (97, 33), (300, 70), (257, 129)];

/// Triangles of ordinary shape at depths of their own, of both windings and materials.
fn layers(random: &mut Random, width: u32, height: u32, count: usize) -> Picture {
    let mut picture = Picture::flat(width, height);
    let reach = [width as f32, height as f32];
    while (picture.triangles() as usize) < count {
        let depth = (picture.triangles() + 1) as f32 / (count + 2) as f32;
        let mut corner = || {
            let [x, y] = reach.map(|size| random.range(-0.3 * size - 20.0, 1.3 * size + 20.0));
            [x, y, depth]
        };
        let corners = [corner(), corner(), corner()];
        let [u, v] = [1, 2].map(|i| [0, 1].map(|k| corners[i][k] - corners[0][k]));
        let area = (u[0] * v[1] - u[1] * v[0]).abs();
        let longest = [u, v]
            .map(|e| e[0].hypot(e[1]))
            .into_iter()
            .fold(1.0, f32::max);
        // Thinner ones have no inside to compare.
        if area > 6.0 * longest {
            if random.below(2) == 0 {
                picture.add(corners);
            } else {
                picture.add_facing(corners);
            }
        }
    }
    picture
}

pub(super) fn the_nearest_triangle_owns_a_pixel(fixture: &Fixture<'_>) {
    let mut random = Random(11);
    for (width, height) in SIZES {
        for count in [1, 3, 12, 40] {
            let picture = layers(&mut random, width, height, count);
            let colours = random.colours(count);
            let frame = fixture.image(&picture, BasePaint::Flat(&colours));
            for (at, pixel, id) in picture.owners().pixels(fixture.capabilities.ids) {
                let colour = id.map_or(BACKGROUND, |id| colours.get(id as usize));
                let what = format!("{width}x{height}, pixel {pixel:?} owned by {id:?}");
                assert_near(frame.pixels()[at], picture.codes(colour), 1.0, &what);
            }
        }
    }
}

pub(super) fn triangles_that_share_edges_leave_no_gap(fixture: &Fixture<'_>) {
    let mut random = Random(12);
    // From triangles of hundreds of pixels to ones far smaller than a pixel.
    for columns in [1, 2, 7, 30, 200] {
        let (width, height) = (283, 140);
        let mut picture = Picture::flat(width, height);
        let step = [300.0, 160.0].map(|size| size / columns as f32);
        for row in 0..=columns {
            for column in 0..=columns {
                let mut at = |i: i32, axis: usize| {
                    let is_border = i == 0 || i == columns;
                    let shift = if is_border {
                        0.0
                    } else {
                        random.range(-0.4, 0.4)
                    };
                    (i as f32 + shift) * step[axis] - 8.0
                };
                let (x, y) = (at(column, 0), at(row, 1));
                picture.add_vertex([x, y, 0.5]);
            }
        }
        let vertex = |row: i32, column: i32| (row * (columns + 1) + column) as u32;
        for row in 0..columns {
            for column in 0..columns {
                let [a, b] = [vertex(row, column), vertex(row, column + 1)];
                let [c, d] = [vertex(row + 1, column), vertex(row + 1, column + 1)];
                picture.add_indexed_facing([a, b, c]);
                picture.add_indexed_facing([b, d, c]);
            }
        }
        let colours = {
            let mut colours = random.colours(picture.world.positions.len());
            colours.x.fill(0.0);
            colours
        };
        let frame = fixture.image(&picture, BasePaint::Gouraud(&colours));
        let background = picture.codes(BACKGROUND);
        for (at, pixel) in frame.pixels().iter().enumerate() {
            let (x, y) = (at as u32 % width, at as u32 / width);
            assert!(
                f64::from(pixel[0]) < background[0] * 0.5,
                "{columns} columns: the background shows through at {x}, {y}: {pixel:?}"
            );
        }
    }
}

pub(super) fn only_visible_ranges_are_drawn(fixture: &Fixture<'_>) {
    let mut random = Random(13);
    let mut picture = layers(&mut random, 120, 90, 30);
    let colours = random.colours(30);
    for ranges in [vec![], vec![2..4, 4..5], vec![0..1, 7..8, 8..30]] {
        picture.visible = ranges;
        let mut backend = fixture.backend();
        let counts = backend.rasterize(fixture.exec, picture.geometry());
        let submitted: u32 = picture
            .visible
            .iter()
            .map(|range| range.end - range.start)
            .sum();
        assert_eq!(
            counts.submitted,
            u64::from(submitted),
            "triangles handed in"
        );
        assert_eq!(
            counts.submitted,
            counts.back_facing + counts.off_screen + counts.drawn,
            "every triangle is drawn, faces away or is off screen: {counts:?}"
        );
        let frame = super::fixture::draw(
            &mut *backend,
            fixture.exec,
            &picture,
            BasePaint::Flat(&colours),
        );
        for (at, pixel, id) in picture.owners().pixels(fixture.capabilities.ids) {
            let colour = id.map_or(BACKGROUND, |id| colours.get(id as usize));
            let what = format!("ranges {:?}, pixel {pixel:?}", picture.visible);
            assert_near(frame.pixels()[at], picture.codes(colour), 1.0, &what);
        }
    }
}

pub(super) fn visible_triangles_and_their_pixels_are_told(fixture: &Fixture<'_>) {
    let mut random = Random(14);
    let picture = layers(&mut random, 200, 150, 25);
    let mut backend = fixture.backend();
    backend.rasterize(fixture.exec, picture.geometry());
    let visible = backend.visible_triangles();
    assert!(
        visible.is_sorted_by(|a, b| a < b),
        "visible triangles ascend: {visible:?}"
    );
    let owners = picture.owners();
    for id in 0..picture.triangles() {
        let owned = owners
            .ids
            .iter()
            .filter(|&&owner| owner == Some(id))
            .count();
        let is_visible = visible.binary_search(&id).is_ok();
        let pixels = backend.visible_pixels(id);
        assert!(
            is_visible || owned == 0,
            "triangle {id} owns {owned} pixels and is not listed"
        );
        assert_eq!(
            is_visible,
            pixels > 0,
            "triangle {id} has {pixels} visible pixels"
        );
        if !fixture.capabilities.ids && owned > 300 {
            assert!(
                f64::from(pixels) > 0.8 * owned as f64,
                "triangle {id} owns {owned} pixels, and {pixels} are estimated"
            );
        }
    }
    // Alone, a triangle owns all of its pixels, and an estimate is close to them.
    for id in 0..picture.triangles() {
        let mut alone = layers(&mut Random(14), 200, 150, 25);
        alone.visible = std::iter::once(id..id + 1).collect();
        let owned = alone.owners().ids.iter().flatten().count() as f64;
        backend.rasterize(fixture.exec, alone.geometry());
        let pixels = f64::from(backend.visible_pixels(id));
        assert!(
            (pixels - owned).abs() <= 0.1 * owned + 8.0,
            "triangle {id} alone covers {owned} pixels, and {pixels} are told"
        );
    }
}

pub(super) fn visible_pixels_are_counted(fixture: &Fixture<'_>) {
    let mut random = Random(15);
    for (width, height) in SIZES {
        let picture = layers(&mut random, width, height, 20);
        let mut backend = fixture.backend();
        let counts = backend.rasterize(fixture.exec, picture.geometry());
        let owners = picture.owners();
        let covered = owners.ids.iter().flatten().count();
        assert_eq!(counts.covered_pixels, covered as u64, "covered pixels");
        for id in 0..picture.triangles() {
            let owned = owners
                .ids
                .iter()
                .filter(|&&owner| owner == Some(id))
                .count();
            assert_eq!(
                backend.visible_pixels(id) as usize,
                owned,
                "pixels that triangle {id} owns"
            );
        }
    }
}
