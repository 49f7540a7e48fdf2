//! Images drawn in several turns, and siblings.

use super::fixture::{Fixture, Picture, Random, draw};
use super::robustness::soup;
use crate::backend::{Backend, BasePaint, RasterCounts};
use crate::output::Frame;
use crate::parallel::{GoOn, Turn};
use std::sync::atomic::{AtomicU64, Ordering};

/// More than any backend needs for a small image.
const MOST_TURNS: usize = 100_000;

/// Takes turns until one says that the work is complete.
fn complete<T>(go_on: GoOn<'_>, mut turn: impl FnMut(Turn<'_>) -> Option<T>) -> T {
    (0..MOST_TURNS)
        .find_map(|taken| {
            turn(Turn {
                is_first: taken == 0,
                go_on,
            })
        })
        .expect("each turn does some of the work, so that it is completed")
}

/// All steps of an image, in turns.
fn draw_in_turns(
    backend: &mut dyn Backend,
    fixture: &Fixture<'_>,
    picture: &Picture,
    paint: BasePaint<'_>,
    go_on: GoOn<'_>,
) -> (RasterCounts, Frame) {
    let (exec, geometry) = (fixture.exec, picture.geometry());
    let counts = complete(go_on, |turn| backend.rasterize_while(exec, geometry, turn));
    complete(go_on, |turn| {
        let is_complete = backend.resolve_while(exec, geometry, paint, turn);
        is_complete.then_some(())
    });
    let mut frame = Frame::new(picture.view.width, picture.view.height);
    frame.write(|target| backend.present(exec, target));
    (counts, frame)
}

pub(super) fn turns_make_no_difference(fixture: &Fixture<'_>) {
    let mut random = Random(61);
    let mut used = fixture.backend();
    let asked = AtomicU64::new(0);
    let sometimes = || !asked.fetch_add(1, Ordering::Relaxed).is_multiple_of(3);
    for (width, height, count) in [(90, 60, 40), (0, 7, 5), (333, 170, 900), (70, 130, 0)] {
        let picture = soup(&mut random, width, height, count);
        let colours = random.colours(picture.world.positions.len());
        let paint = BasePaint::Gouraud(&colours);
        let mut at_once = fixture.backend();
        let want = draw(&mut *at_once, fixture.exec, &picture, paint);
        let want_counts = fixture
            .backend()
            .rasterize(fixture.exec, picture.geometry());
        let answers: [(&str, GoOn<'_>); 3] = [
            ("stopped always", &|| false),
            ("stopped sometimes", &sometimes),
            ("never stopped", &|| true),
        ];
        for (what, go_on) in answers {
            let what = format!("{width}x{height}, {what}");
            let (counts, got) = draw_in_turns(&mut *used, fixture, &picture, paint, go_on);
            assert_eq!(counts, want_counts, "{what}: counts");
            assert!(got.pixels() == want.pixels(), "{what}: pixels");
            assert_eq!(
                used.visible_triangles(),
                at_once.visible_triangles(),
                "{what}"
            );
            for &id in used.visible_triangles() {
                let pixels = [&used, &at_once].map(|backend| backend.visible_pixels(id));
                assert_eq!(pixels[0], pixels[1], "{what}: pixels of {id}");
            }
        }
    }
}

pub(super) fn what_is_given_up_leaves_no_trace(fixture: &Fixture<'_>) {
    let mut random = Random(62);
    let mut used = fixture.backend();
    for round in 0..12 {
        let size = [(90, 60), (90, 60), (150, 70)][round % 3];
        let picture = soup(&mut random, size.0, size.1, 300);
        let colours = random.colours(picture.world.positions.len());
        let paint = BasePaint::Gouraud(&colours);
        // Some turns of one image, perhaps of its colours too, then another image.
        let mut turn = Turn::first(&|| false);
        for _ in 0..random.below(12) {
            let counts = used.rasterize_while(fixture.exec, picture.geometry(), turn);
            turn.is_first = false;
            if counts.is_some() {
                let turn = Turn::first(&|| false);
                used.resolve_while(fixture.exec, picture.geometry(), paint, turn);
                break;
            }
        }
        let picture = soup(&mut random, size.0, size.1, 200);
        let colours = random.colours(picture.world.positions.len());
        let paint = BasePaint::Gouraud(&colours);
        let got = draw(&mut *used, fixture.exec, &picture, paint);
        let want = fixture.image(&picture, paint);
        assert!(
            got.pixels() == want.pixels(),
            "after an image that was given up"
        );
    }
}

pub(super) fn siblings_draw_the_same(fixture: &Fixture<'_>) {
    let mut random = Random(63);
    let [picture, other] = [80, 50].map(|count| soup(&mut random, 120, 90, count));
    let colours = random.colours(
        picture
            .world
            .positions
            .len()
            .max(other.world.positions.len()),
    );
    let paint = BasePaint::Gouraud(&colours);
    let mut backend = fixture.backend();
    let want = draw(&mut *backend, fixture.exec, &picture, paint);
    let Some(mut sibling) = backend.sibling() else {
        return;
    };
    assert_eq!(sibling.capabilities(), backend.capabilities(), "siblings");
    draw(&mut *sibling, fixture.exec, &other, paint);
    let mut frame = Frame::new(120, 90);
    frame.write(|target| backend.present(fixture.exec, target));
    assert!(
        frame.pixels() == want.pixels(),
        "what a sibling draws is its own"
    );
    let got = draw(&mut *sibling, fixture.exec, &picture, paint);
    assert!(got.pixels() == want.pixels(), "siblings draw the same");
}
