//! Sizes, threads, nothing, and odd numbers.

use super::fixture::{Fixture, Picture, Random, assert_near, draw};
use crate::backend::BasePaint;
use crate::geometry::Vec3s;
use crate::parallel::Exec;

/// Triangles of all sizes in front of, around and behind the eye.
pub(super) fn soup(random: &mut Random, width: u32, height: u32, count: usize) -> Picture {
    let mut picture = Picture::perspective(width, height);
    for _ in 0..count {
        let size = [0.02, 0.3, 1.0, 30.0, 3000.0][random.below(5)];
        let center = [
            random.range(-4.0, 4.0),
            random.range(-3.0, 3.0),
            random.range(-0.5, 8.0),
        ];
        let mut corner = || center.map(|c| c + random.range(-size, size));
        let mut corners = [corner(), corner(), corner()];
        match random.below(8) {
            // A sliver.
            0 => corners[2] = std::array::from_fn(|i| 0.3 * corners[0][i] + 0.7 * corners[1][i]),
            // No area at all.
            1 => corners[2] = corners[1],
            _ => {}
        }
        if random.below(2) == 0 {
            picture.add(corners);
        } else {
            picture.add_facing(corners);
        }
    }
    picture
}

pub(super) fn images_of_all_sizes_follow_each_other(fixture: &Fixture<'_>) {
    let mut random = Random(51);
    let mut backend = fixture.backend();
    let sizes = [
        (90, 60),
        (1, 1),
        (0, 0),
        (0, 5),
        (5, 0),
        (333, 7),
        (520, 300),
        (90, 60),
    ];
    for (width, height) in sizes {
        let picture = soup(&mut random, width, height, 60);
        let colours = random.colours(picture.world.positions.len());
        let paint = BasePaint::Gouraud(&colours);
        let used = draw(&mut *backend, fixture.exec, &picture, paint);
        let new = fixture.image(&picture, paint);
        assert_eq!(
            used.pixels(),
            new.pixels(),
            "{width}x{height}: an image does not depend on the ones before it"
        );
    }
}

pub(super) fn threads_make_no_difference(fixture: &Fixture<'_>) {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build()
        .expect("two threads can be started");
    let two = Exec {
        threads: 2,
        ..fixture.exec
    };
    let mut random = Random(52);
    for count in [5, 400, 3000] {
        let picture = soup(&mut random, 520, 300, count);
        let colours = random.colours(picture.world.positions.len());
        let paint = BasePaint::Gouraud(&colours);
        let (mut a, mut b) = (fixture.backend(), fixture.backend());
        let one = draw(&mut *a, fixture.exec, &picture, paint);
        let other = pool.install(|| draw(&mut *b, two, &picture, paint));
        assert_eq!(a.visible_triangles(), b.visible_triangles(), "two threads");
        for &id in a.visible_triangles() {
            assert_eq!(a.visible_pixels(id), b.visible_pixels(id), "two threads");
        }
        assert!(
            one.pixels() == other.pixels(),
            "two threads draw another image"
        );
    }
}

pub(super) fn nothing_to_draw_is_drawn(fixture: &Fixture<'_>) {
    let mut pictures = vec![Picture::flat(60, 40), Picture::perspective(60, 40)];
    // Behind the eye, beyond the far plane, before the near plane, beside the image.
    for (x, z) in [(0.0, -5.0), (0.0, 200.0), (0.0, 0.2), (900.0, 5.0)] {
        let mut picture = Picture::perspective(60, 40);
        picture.add_facing([[x - 1.0, -1.0, z], [x - 1.0, 1.0, z], [x + 1.0, 0.0, z]]);
        pictures.push(picture);
    }
    // Its back, one-sided. Counter-clockwise on the screen is front; this turns clockwise.
    let mut picture = Picture::flat(60, 40);
    picture.add([[5.0, 5.0, 0.5], [50.0, 5.0, 0.5], [5.0, 35.0, 0.5]]);
    pictures.push(picture);
    for picture in pictures {
        let colours = Random(53).colours(3);
        let mut backend = fixture.backend();
        let frame = draw(
            &mut *backend,
            fixture.exec,
            &picture,
            BasePaint::Gouraud(&colours),
        );
        assert!(
            backend.visible_triangles().is_empty(),
            "nothing is visible of {:?}",
            picture.world.positions
        );
        let background = picture.codes(picture.world.background);
        for &pixel in frame.pixels() {
            assert_near(pixel, background, 0.5, "background");
        }
    }
}

pub(super) fn odd_numbers_do_no_harm(fixture: &Fixture<'_>) {
    let odd = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        1e20,
        -1e20,
        1e-40,
        0.0,
        -0.0,
        1.0,
        20.0,
    ];
    let mut random = Random(54);
    for round in 0..40 {
        let mut picture = if round % 2 == 0 {
            Picture::flat(70, 50)
        } else {
            Picture::perspective(70, 50)
        };
        for _ in 0..20 {
            let mut number = || {
                if random.below(2) == 0 {
                    odd[random.below(odd.len())]
                } else {
                    random.range(-3.0, 70.0)
                }
            };
            let corners = [[(); 3]; 3].map(|corner| corner.map(|()| number()));
            if random.below(2) == 0 {
                picture.add(corners);
            } else {
                picture.add_facing(corners);
            }
        }
        let mut colours = Vec3s::default();
        for _ in 0..picture.world.positions.len() {
            colours.push([(); 3].map(|()| odd[random.below(odd.len())]));
        }
        let frame = fixture.image(&picture, BasePaint::Gouraud(&colours));
        assert!(
            frame.pixels().iter().all(|pixel| pixel[3] == 255),
            "pixels are opaque"
        );
        // An ordinary triangle in front of it all is drawn as ever.
        picture.add_facing([[-9.0, -9.0, 1.0], [-9.0, 300.0, 1.0], [300.0, -9.0, 1.0]]);
        if round % 2 == 0 {
            let mut flat = Vec3s::default();
            flat.resize(picture.triangles() as usize);
            flat.z.fill(0.5);
            let frame = fixture.image(&picture, BasePaint::Flat(&flat));
            let blue = picture.codes([0.0, 0.0, 0.5]);
            assert_near(frame.pixels()[0], blue, 1.0, "in front of odd triangles");
        }
    }
}
