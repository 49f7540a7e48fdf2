//! Images that are drawn, illuminated and coloured in several turns are those drawn at once, bit for bit: whatever makes a turn
//! stop, at every SIMD level, on one thread and on two, and whatever was given up before.

mod support;

use specula::backend::software::SoftwareBackend;
use specula::backend::{Backend, BasePaint, Geometry, RasterCounts};
use specula::geometry::Vec3s;
use specula::illumination::VertexSet;
use specula::output::Frame;
use specula::parallel::{Exec, GoOn, Turn};
use specula::scene::{View, World};
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use support::*;

/// What a turn is told.
#[derive(Clone, Copy, Debug)]
enum Answers {
    /// To stop at once.
    No,
    /// To stop after so many questions, over and over.
    Every(u64),
    /// At random, one time in so many to stop.
    Random(u64),
    /// Never to stop.
    Yes,
}

const PATTERNS: [Answers; 5] = [
    Answers::No,
    Answers::Every(2),
    Answers::Every(7),
    Answers::Random(4),
    Answers::Yes,
];

/// Gives the answers, and counts them.
struct Told {
    answers: Answers,
    asked: AtomicU64,
}

impl Told {
    fn new(answers: Answers) -> Self {
        Self {
            answers,
            asked: AtomicU64::new(0),
        }
    }

    fn answer(&self) -> bool {
        let asked = self.asked.fetch_add(1, Ordering::Relaxed) + 1;
        match self.answers {
            Answers::No => false,
            Answers::Every(count) => !asked.is_multiple_of(count),
            Answers::Random(count) => Random(asked).below(count as usize) != 0,
            Answers::Yes => true,
        }
    }

    /// Takes turns until one says that it has completed the work; returns what it said, and how many it took.
    fn complete<T>(&self, mut turn: impl FnMut(Turn<'_>) -> Option<T>) -> (T, u64) {
        let go_on: GoOn<'_> = &|| self.answer();
        let mut turns = 0;
        loop {
            let asked = self.asked.load(Ordering::Relaxed);
            let next = Turn {
                is_first: turns == 0,
                go_on,
            };
            let done = turn(next);
            turns += 1;
            if let Some(result) = done {
                return (result, turns);
            }
            // A turn that neither completes the work nor was told to stop would be called for ever.
            assert!(
                self.asked.load(Ordering::Relaxed) > asked,
                "a turn did nothing"
            );
        }
    }
}

/// A scene with its colours of vertices and of triangles.
struct Picture {
    name: &'static str,
    world: World,
    view: View,
    visible: Vec<Range<u32>>,
    flat: Vec3s,
}

impl Picture {
    fn new(name: &'static str, world: World, view: View) -> Self {
        let mut random = Random(77);
        let mut flat = Vec3s::default();
        for _ in 0..world.triangles.len() {
            flat.push(random.rgb());
        }
        // In ranges of all lengths, some of them empty, with gaps.
        let (mut visible, mut start) = (Vec::new(), 0);
        let count = world.triangles.len() as u32;
        while start < count {
            let end = count.min(start + [0, 1, 5, 40, 3000][random.below(5)]);
            visible.push(start..end);
            start = end + random.below(2) as u32;
        }
        Self {
            name,
            world,
            view,
            visible,
            flat,
        }
    }

    fn geometry(&self) -> Geometry<'_> {
        geometry(&self.world, &self.view, &self.visible)
    }
}

/// Small triangles in many layers, several shares of them.
fn fine(random: &mut Random, count: usize) -> World {
    let mut world = empty_world();
    while world.triangles.len() < count {
        let (x, y) = (random.range(-5.0, 150.0), random.range(-5.0, 105.0));
        let mut corner = || {
            let offset = [0; 2].map(|_| random.range(-6.0, 6.0));
            [x + offset[0], y + offset[1], random.range(0.0, 1.0)]
        };
        let corners = [corner(), corner(), corner()];
        add_both_sides(&mut world, corners, [[0.0, 0.1, -1.0]; 3]);
    }
    world
}

fn pictures() -> Vec<Picture> {
    let mut random = Random(301);
    let inside = |width: u32, height| perspective(width, height, f64::from(width) * 0.6, 0.1, 50.0);
    let large = soup_of_sizes(&mut random, 600, &[3.0, 30.0, 3000.0]);
    vec![
        // Large triangles, most of them through the near plane or the guard band.
        Picture::new("large", large, inside(520, 300)),
        Picture::new("soup", soup(&mut random, 4000), inside(333, 130)),
        Picture::new("fine", fine(&mut random, 16_000), flat(150, 100)),
        Picture::new("nothing", empty_world(), inside(200, 100)),
        Picture::new("no pixels", soup(&mut random, 50), inside(0, 60)),
    ]
}

/// All that can be seen of an image.
#[derive(Debug, PartialEq)]
struct Seen {
    counts: RasterCounts,
    visible: Vec<u32>,
    pixels: Vec<u32>,
    image: Visibility,
    colours: Vec<[u32; 3]>,
    frames: [Vec<[u8; 4]>; 3],
    written: [u64; 3],
}

/// The memory of one image after the other.
#[derive(Default)]
struct Artist {
    backend: SoftwareBackend,
    set: VertexSet,
}

impl Artist {
    /// Draws a picture, each step in turns, and says how many it took.
    fn draw(&mut self, exec: Exec, picture: &Picture, answers: Answers) -> (Seen, u64) {
        let told = Told::new(answers);
        let Self { backend, set } = self;
        let (world, view) = (&picture.world, &picture.view);
        let geometry = picture.geometry();
        let (counts, mut turns) =
            told.complete(|turn| backend.rasterize_while(exec, geometry, turn));
        let visible = backend.visible_triangles().to_vec();
        let mut colours = Vec3s::default();
        let ((), taken) = told.complete(|turn| {
            set.illuminate_while(exec, world, view.eye, &visible, &mut colours, turn)
                .then_some(())
        });
        turns += taken;
        let paints = [
            BasePaint::Gouraud(&colours),
            BasePaint::Flat(&picture.flat),
            BasePaint::Phong,
        ];
        let mut written = [0; 3];
        let mut frame = Frame::new(view.width, view.height);
        let frames = [0, 1, 2].map(|i| {
            let ((), taken) = told.complete(|turn| {
                backend
                    .resolve_while(exec, geometry, paints[i], turn)
                    .then_some(())
            });
            turns += taken;
            written[i] = frame.write(|target| backend.present(exec, target));
            frame.pixels().to_vec()
        });
        let bits = |v| colours.get(v).map(f32::to_bits);
        let seen = Seen {
            counts,
            pixels: visible
                .iter()
                .map(|&id| backend.visible_pixels(id))
                .collect(),
            visible,
            image: Visibility::of(backend),
            colours: (0..colours.len()).map(bits).collect(),
            frames,
            written,
        };
        (seen, turns)
    }

    /// Takes so many turns of a picture and gives it up.
    fn give_up(&mut self, exec: Exec, picture: &Picture, turns: usize) {
        let Self { backend, set } = self;
        let geometry = picture.geometry();
        let all: Vec<u32> = picture.visible.iter().cloned().flatten().collect();
        let colours = &mut Vec3s::default();
        let (world, eye) = (&picture.world, picture.view.eye);
        let mut turn = Turn::first(&|| false);
        for _ in 0..turns {
            set.illuminate_while(exec, world, eye, &all, colours, turn);
            turn.is_first = false;
        }
        turn.is_first = true;
        for round in 0..turns {
            if backend.rasterize_while(exec, geometry, turn).is_some() {
                // The rest of the turns go into its colours.
                let mut turn = Turn::first(&|| false);
                for _ in round..turns {
                    backend.resolve_while(exec, geometry, BasePaint::Phong, turn);
                    turn.is_first = false;
                }
                return;
            }
            turn.is_first = false;
        }
    }
}

/// What is seen when it is drawn at once by somebody who has drawn nothing before.
fn at_once(exec: Exec, picture: &Picture) -> Seen {
    let (mut backend, mut set) = (SoftwareBackend::new(), VertexSet::default());
    let (world, view, geometry) = (&picture.world, &picture.view, picture.geometry());
    let counts = backend.rasterize(exec, geometry);
    let visible = backend.visible_triangles().to_vec();
    let mut colours = Vec3s::default();
    set.illuminate(exec, world, view.eye, &visible, &mut colours);
    let paints = [
        BasePaint::Gouraud(&colours),
        BasePaint::Flat(&picture.flat),
        BasePaint::Phong,
    ];
    let mut written = [0; 3];
    let mut frame = Frame::new(view.width, view.height);
    let frames = [0, 1, 2].map(|i| {
        backend.resolve(exec, geometry, paints[i]);
        written[i] = frame.write(|target| backend.present(exec, target));
        frame.pixels().to_vec()
    });
    let bits = |v| colours.get(v).map(f32::to_bits);
    Seen {
        counts,
        pixels: visible
            .iter()
            .map(|&id| backend.visible_pixels(id))
            .collect(),
        visible,
        image: Visibility::of(&backend),
        colours: (0..colours.len()).map(bits).collect(),
        frames,
        written,
    }
}

/// Fails with the first thing that differs.
fn assert_same(got: &Seen, want: &Seen, width: u32, what: &str) {
    assert_eq!(got.counts, want.counts, "{what}");
    got.image.assert_same(&want.image, width, what);
    assert!(got.visible == want.visible, "{what}: visible triangles");
    assert!(got.pixels == want.pixels, "{what}: their pixels");
    assert!(got.colours == want.colours, "{what}: colours of vertices");
    assert_eq!(got.written, want.written, "{what}: pixels handed over");
    for (i, (got, want)) in got.frames.iter().zip(&want.frames).enumerate() {
        assert!(got == want, "{what}: frame {i}");
    }
}

#[test]
fn images_drawn_in_turns_are_those_drawn_at_once() {
    for picture in &pictures() {
        on_each_exec(|exec| {
            let want = at_once(exec, picture);
            let mut least_turns = u64::MAX;
            for answers in PATTERNS {
                let (got, turns) = Artist::default().draw(exec, picture, answers);
                let what = format!("{}, {answers:?}, {exec:?}", picture.name);
                assert_same(&got, &want, picture.view.width, &what);
                assert!(
                    turns <= least_turns || !matches!(answers, Answers::Yes),
                    "{what}"
                );
                least_turns = least_turns.min(turns);
            }
            // Rasterizing, illuminating, and colouring three times.
            assert_eq!(least_turns, 5, "{}: nothing stopped it", picture.name);
        });
    }
}

#[test]
fn what_has_been_given_up_leaves_no_trace() {
    let pictures = pictures();
    on_each_exec(|exec| {
        let mut artist = Artist::default();
        let mut random = Random(302);
        for _ in 0..40 {
            let turns = [1, 3, 20, 60, 300][random.below(5)];
            artist.give_up(exec, &pictures[random.below(pictures.len())], turns);
            if random.below(2) == 0 {
                continue;
            }
            let picture = &pictures[random.below(pictures.len())];
            let answers = PATTERNS[random.below(5)];
            let (got, _) = artist.draw(exec, picture, answers);
            let what = format!("{} after others, {answers:?}, {exec:?}", picture.name);
            assert_same(&got, &at_once(exec, picture), picture.view.width, &what);
        }
    });
}

#[test]
fn turns_may_change_their_number_of_threads_and_their_level() {
    let levels = levels();
    for picture in &pictures() {
        let want = at_once(best(), picture);
        let mut backend = SoftwareBackend::new();
        let told = Told::new(Answers::Random(3));
        let mut random = Random(303);
        let (counts, _) = told.complete(|turn| {
            let exec = levels[random.below(levels.len())];
            let mut go = |exec| backend.rasterize_while(exec, picture.geometry(), turn);
            if random.below(2) == 0 {
                go(exec)
            } else {
                on_two_threads(exec, go)
            }
        });
        assert_eq!(counts, want.counts, "{}", picture.name);
        let got = Visibility::of(&backend);
        got.assert_same(&want.image, picture.view.width, picture.name);
        assert!(
            backend.visible_triangles() == want.visible,
            "{}",
            picture.name
        );
    }
}

/// A turn that is told to stop at once has come to few pieces, and yet to one: so there are many turns, but not for ever.
#[test]
fn each_turn_does_some_of_the_work_and_little_more() {
    let pictures = pictures();
    for (name, turns) in [("large", 30..3000), ("soup", 30..2000), ("fine", 30..2000)] {
        let picture = (pictures.iter())
            .find(|picture| picture.name == name)
            .expect(name);
        let mut backend = SoftwareBackend::new();
        let told = Told::new(Answers::No);
        let (_, taken) =
            told.complete(|turn| backend.rasterize_while(best(), picture.geometry(), turn));
        assert!(turns.contains(&taken), "{name}: {taken} turns");
        assert!(
            told.asked.load(Ordering::Relaxed) <= 4 * taken,
            "{name}: asked after it was told"
        );
    }
}

#[test]
fn a_sibling_draws_the_same_and_keeps_out_of_the_way() {
    let pictures = pictures();
    let exec = best();
    let mut first: Box<dyn Backend> = Box::new(SoftwareBackend::new());
    let colours = |picture: &Picture| {
        let mut colours = Vec3s::default();
        colours.resize(picture.world.positions.len());
        colours.y.fill(0.3);
        colours
    };
    let show = |backend: &mut dyn Backend, picture: &Picture| {
        let colours = colours(picture);
        backend.rasterize(exec, picture.geometry());
        backend.resolve(exec, picture.geometry(), BasePaint::Gouraud(&colours));
        present(backend, exec, picture)
    };
    let want = [
        show(&mut *first, &pictures[1]),
        show(&mut *first, &pictures[0]),
    ];
    let mut second = first.sibling().expect("it can have one");
    let stop = second.rasterize_while(exec, pictures[1].geometry(), Turn::first(&|| false));
    assert!(stop.is_none() && second.sibling().is_some());
    assert!(
        present(&mut *first, exec, &pictures[0]) == want[1],
        "the first's image is still there"
    );
    assert!(
        show(&mut *second, &pictures[1]) == want[0],
        "the second's is as the first's was"
    );
}

fn present(backend: &mut dyn Backend, exec: Exec, picture: &Picture) -> Vec<[u8; 4]> {
    let mut frame = Frame::new(picture.view.width, picture.view.height);
    frame.write(|target| backend.present(exec, target));
    frame.pixels().to_vec()
}
