//! How refined triangles are drawn: patch by patch into an image, or all at once.

use super::fixture::{Fixture, Picture, Random, assert_near, draw};
use crate::backend::{BasePaint, Fill, Patch, RefinedPart};
use crate::geometry::Vec3s;
use crate::geometry::bary::{Bary, middles, quarters};
use crate::output::Frame;

/// A large triangle partly behind a smaller one.
fn overlapping(fixture: &Fixture<'_>) -> Picture {
    let mut picture = fixture.flat(150, 110);
    picture.add_facing([[5.0, 4.0, 0.4], [20.0, 105.0, 0.4], [140.0, 60.0, 0.4]]);
    picture.add_facing([[30.0, 30.0, 0.8], [40.0, 70.0, 0.8], [80.0, 50.0, 0.8]]);
    picture
}

pub(super) fn patches_paint_what_their_triangle_owns(fixture: &Fixture<'_>) {
    let picture = overlapping(fixture);
    let colours = Random(41).colours(6);
    let mut backend = fixture.backend();
    let before = draw(
        &mut *backend,
        fixture.exec,
        &picture,
        BasePaint::Gouraud(&colours),
    );
    let corner_colours = Bary::quarters(Bary::ROOT).expect("far above the grid");
    let marks = [[0.1; 3], [0.3; 3], [0.6; 3], [0.9; 3]];
    let mut patches: Vec<Patch> = corner_colours
        .into_iter()
        .zip(marks)
        .map(|(corners, colour)| Patch {
            triangle: 0,
            corners,
            fill: Fill::Gouraud([colour; 3]),
            pixels: u32::MAX,
        })
        .collect();
    backend.repaint(fixture.exec, picture.geometry(), &mut patches);
    let mut frame = Frame::new(150, 110);
    frame.write(|target| backend.present(fixture.exec, target));

    let painted: u32 = patches.iter().map(|patch| patch.pixels).sum();
    assert_eq!(
        painted,
        backend.visible_pixels(0),
        "patches that partition a triangle paint what it owns"
    );
    let mut counts = [0; 4];
    for (at, pixel, id) in picture.owners().pixels(true) {
        let got = frame.pixels()[at];
        if id != Some(0) {
            assert_eq!(
                got,
                before.pixels()[at],
                "pixel {pixel:?} is not the triangle's"
            );
            continue;
        }
        let quarter = marks
            .iter()
            .position(|&mark| (f64::from(got[0]) - picture.codes(mark)[0]).abs() < 1.0);
        let quarter = quarter.unwrap_or_else(|| panic!("pixel {pixel:?} is in no patch: {got:?}"));
        counts[quarter] += 1;
        let [weights, _] = picture.weights(0, pixel[0], pixel[1]);
        let largest = weights.iter().position(|&w| w > 0.51);
        let is_middle = weights.iter().all(|&w| w < 0.49);
        assert!(
            largest.is_none_or(|corner| corner == quarter) && (!is_middle || quarter == 3),
            "pixel {pixel:?} with weights {weights:?} is in patch {quarter}"
        );
    }
    let told: Vec<u32> = patches.iter().map(|patch| patch.pixels).collect();
    assert_eq!(told, counts, "pixels counted by patch");
}

pub(super) fn parts_take_the_place_of_their_triangle(fixture: &Fixture<'_>) {
    let picture = overlapping(fixture);
    let mut random = Random(42);
    let colours = random.colours(6);
    let exec = fixture.exec;

    // No parts: as Gouraud.
    let gouraud = fixture.image(&picture, BasePaint::Gouraud(&colours));
    let none = fixture.image(
        &picture,
        BasePaint::Refined {
            colours: &colours,
            parts: &[],
        },
    );
    assert_eq!(none.pixels(), gouraud.pixels(), "nothing has been refined");

    // Quarters of the triangle behind.
    let corners = [0, 1, 2].map(|v| picture.world.positions.get(v));
    let parts: Vec<RefinedPart> = quarters(corners, middles(corners))
        .into_iter()
        .map(|corners| RefinedPart {
            triangle: 0,
            corners,
            colours: [random.rgb(); 3],
        })
        .collect();
    let mut backend = fixture.backend();
    let refined = draw(
        &mut *backend,
        exec,
        &picture,
        BasePaint::Refined {
            colours: &colours,
            parts: &parts,
        },
    );
    // The same as a world of its own.
    let mut split = fixture.flat(150, 110);
    let mut split_colours = Vec3s::default();
    for part in &parts {
        split.add_facing(part.corners);
        split_colours.push(part.colours[0]);
    }
    split.add_facing([3, 4, 5].map(|v| picture.world.positions.get(v)));
    split_colours.push([0.0; 3]);
    let mut compared = 0;
    for (at, pixel, id) in split.owners().pixels(false) {
        let got = refined.pixels()[at];
        match id {
            Some(part @ 0..4) => {
                let colour = split_colours.get(part as usize);
                assert_near(
                    got,
                    picture.codes(colour),
                    1.0,
                    &format!("part {part}, pixel {pixel:?}"),
                );
                compared += 1;
            }
            _ => assert_eq!(got, gouraud.pixels()[at], "pixel {pixel:?} is no part's"),
        }
    }
    assert!(compared > 1000, "the parts have an inside: {compared}");

    // Back to what it was.
    let again = draw(&mut *backend, exec, &picture, BasePaint::Gouraud(&colours));
    assert_eq!(again.pixels(), gouraud.pixels(), "refinement is forgotten");
}
