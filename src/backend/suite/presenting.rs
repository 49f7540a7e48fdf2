//! How images are handed over.

use super::fixture::{Fixture, Picture, Random, draw};
use crate::backend::{Backend, BasePaint};
use crate::geometry::Vec3s;
use crate::output::{ChannelOrder, Frame, Rect, Target};
use crate::parallel::Turn;

const SIZE: (u32, u32) = (301, 83);
const PIXELS: u64 = 301 * 83;

fn picture() -> (Picture, Vec3s) {
    let mut picture = Picture::flat(SIZE.0, SIZE.1);
    picture.add_facing([[20.0, 3.0, 0.5], [31.0, 80.0, 0.5], [290.0, 40.0, 0.5]]);
    (picture, Random(31).colours(3))
}

/// Presents, after asking how much that will be.
fn present(backend: &mut dyn Backend, fixture: &Fixture<'_>, target: &mut Target<'_>) -> u64 {
    let pending = backend.pending_pixels(target);
    let mut changes = Vec::new();
    backend.changes(target, &mut changes);
    check_changes(&changes, pending, target);
    let written = backend.present(fixture.exec, target);
    assert_eq!(written, pending, "pixels written against pending ones");
    assert_eq!(
        backend.pending_pixels(target),
        0,
        "nothing is pending after presenting"
    );
    written
}

/// Rectangles are as many pixels as will be written, inside of the target, and apart from each other.
fn check_changes(changes: &[Rect], pending: u64, target: &Target<'_>) {
    let pixels: u64 = changes
        .iter()
        .map(|rect| u64::from(rect.width) * u64::from(rect.height))
        .sum();
    assert_eq!(pixels, pending, "pixels of the changes {changes:?}");
    for (index, a) in changes.iter().enumerate() {
        assert!(a.width > 0 && a.height > 0, "{a:?} is empty");
        assert!(
            a.x + a.width <= target.width() && a.y + a.height <= target.height(),
            "{a:?} is not inside of the target"
        );
        for b in &changes[..index] {
            let is_apart = a.x + a.width <= b.x
                || b.x + b.width <= a.x
                || a.y + a.height <= b.y
                || b.y + b.height <= a.y;
            assert!(is_apart, "{a:?} overlaps {b:?}");
        }
    }
}

/// While another image of the same size is being rasterized, and when it has been, the image before it is handed over.
pub(super) fn the_image_before_stays_until_the_next_is_coloured(fixture: &Fixture<'_>) {
    let (picture, colours) = picture();
    let mut backend = fixture.backend();
    let paint = BasePaint::Gouraud(&colours);
    let want = draw(&mut *backend, fixture.exec, &picture, paint);
    let mut other = Picture::flat(SIZE.0, SIZE.1);
    other.add_facing([[5.0, 70.0, 0.4], [280.0, 1.0, 0.4], [300.0, 80.0, 0.4]]);
    let geometry = other.geometry();
    let mut turn = Turn::first(&|| false);
    loop {
        let is_done = backend
            .rasterize_while(fixture.exec, geometry, turn)
            .is_some();
        let mut frame = Frame::new(SIZE.0, SIZE.1);
        let written = frame.write(|target| present(&mut *backend, fixture, target));
        assert_eq!(written, PIXELS, "a new frame is written in full");
        assert!(frame.pixels() == want.pixels(), "the image before");
        if is_done {
            break;
        }
        turn = Turn::next(&|| false);
    }
    backend.resolve(fixture.exec, geometry, paint);
    let want = fixture.image(&other, paint);
    let mut frame = Frame::new(SIZE.0, SIZE.1);
    frame.write(|target| present(&mut *backend, fixture, target));
    assert!(frame.pixels() == want.pixels(), "the next image");
}

pub(super) fn only_what_is_missing_is_written(fixture: &Fixture<'_>) {
    let (picture, colours) = picture();
    let mut backend = fixture.backend();
    let want = draw(
        &mut *backend,
        fixture.exec,
        &picture,
        BasePaint::Gouraud(&colours),
    );

    let mut frame = Frame::new(SIZE.0, SIZE.1);
    let written = frame.write(|target| present(&mut *backend, fixture, target));
    assert_eq!(written, PIXELS, "a new frame is written in full");
    assert_eq!(frame.pixels(), want.pixels(), "the same image twice");
    let written = frame.write(|target| present(&mut *backend, fixture, target));
    assert_eq!(written, 0, "a frame that holds the image is not written");

    // Touched by somebody.
    frame.pixels_mut().fill([1, 2, 3, 4]);
    let written = frame.write(|target| present(&mut *backend, fixture, target));
    assert_eq!(
        written, PIXELS,
        "a frame that was touched is written in full"
    );
    assert_eq!(frame.pixels(), want.pixels(), "a frame that was touched");

    // Written by another backend of the same kind, as often as by this one.
    let mut foreign = {
        let mut other = fixture.backend();
        let nothing = Picture::flat(SIZE.0, SIZE.1);
        draw(
            &mut *other,
            fixture.exec,
            &nothing,
            BasePaint::Gouraud(&Vec3s::default()),
        )
    };
    let written = foreign.write(|target| present(&mut *backend, fixture, target));
    assert_eq!(
        written, PIXELS,
        "another backend's frame is written in full"
    );
    assert_eq!(foreign.pixels(), want.pixels(), "another backend's frame");

    // A new image of the same backend.
    let geometry = picture.geometry();
    let others = Random(32).colours(3);
    backend.resolve(fixture.exec, geometry, BasePaint::Gouraud(&others));
    let want = fixture.image(&picture, BasePaint::Gouraud(&others));
    frame.write(|target| present(&mut *backend, fixture, target));
    assert_eq!(
        frame.pixels(),
        want.pixels(),
        "a frame that held the last image"
    );
}

pub(super) fn targets_of_any_layout_are_filled(fixture: &Fixture<'_>) {
    let (picture, colours) = picture();
    let mut backend = fixture.backend();
    let want = draw(
        &mut *backend,
        fixture.exec,
        &picture,
        BasePaint::Gouraud(&colours),
    );
    let (row, rows) = (SIZE.0 as usize * 4, SIZE.1 as usize);
    for gap in [0, 4, 13, 4000] {
        for order in [ChannelOrder::Rgba, ChannelOrder::Bgra] {
            let stride = row + gap;
            let mut bytes = vec![77; stride * rows + 1000];
            let mut target = Target::with_stride(&mut bytes, SIZE.0, SIZE.1, stride)
                .expect("there is room")
                .with_order(order);
            let written = present(&mut *backend, fixture, &mut target);
            assert_eq!(written, PIXELS, "a target of unknown contents");
            for (y, (got, want)) in bytes
                .chunks(stride)
                .zip(want.pixels().chunks(SIZE.0 as usize))
                .enumerate()
            {
                let mut want = want.to_vec();
                if order == ChannelOrder::Bgra {
                    want.iter_mut().for_each(|pixel| pixel.swap(0, 2));
                }
                assert_eq!(&got[..row], want.as_flattened(), "row {y}, {order:?}");
                assert!(
                    got[row..].iter().all(|&byte| byte == 77),
                    "bytes between rows are not touched"
                );
            }
            assert!(
                bytes[stride * rows..].iter().all(|&byte| byte == 77),
                "bytes behind the image are not touched"
            );
        }
    }
}

pub(super) fn a_target_of_another_size_is_left_alone(fixture: &Fixture<'_>) {
    let (picture, colours) = picture();
    let mut backend = fixture.backend();
    draw(
        &mut *backend,
        fixture.exec,
        &picture,
        BasePaint::Gouraud(&colours),
    );
    for (width, height) in [(300, 83), (301, 84), (0, 0), (83, 301)] {
        let mut frame = Frame::new(width, height);
        frame.pixels_mut().fill([9; 4]);
        let written = frame.write(|target| present(&mut *backend, fixture, target));
        assert_eq!(written, 0, "a target of {width}x{height}");
        assert!(frame.pixels().iter().all(|&pixel| pixel == [9; 4]));
    }
}
