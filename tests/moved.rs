//! Images in which some objects have moved since the image before, and which keep what these do not touch, are those drawn as a
//! whole, bit for bit: wherever objects go, whatever was painted over, and whatever was given up before.

mod support;

use glam::{DMat4, DVec3};
use specula::backend::software::SoftwareBackend;
use specula::backend::{Backend, BasePaint, Fill, Patch, RasterCounts};
use specula::geometry::{Bary, Vec3s};
use specula::illumination::VertexSet;
use specula::output::Frame;
use specula::parallel::{Exec, Turn};
use specula::scene::{Camera, GeometryChange, Light, Placement, Scene, View, World};
use specula::visibility::Culler;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use support::*;

const SIZE: (u32, u32) = (330, 250);

/// Ten objects in front of a camera with planes of its own, so that the view stays whatever moves: some of them several shares,
/// some part of one, two of them with backs.
fn scene() -> Scene {
    let mut scene = Scene::parse(
        r#"(
            camera: Perspective(position: (0, -12, 3), target: (0, 0, 0), fov_degrees: 45),
            lights: [Point(position: (-5, -8, 8)), Directional(direction: (0.5, 1, -2), intensity: 0.3)],
            materials: {
                "one": (diffuse: (0.7, 0.3, 0.2), specular: 0.5, shininess: 20),
                "two": (diffuse: (0.2, 0.4, 0.7), specular: 0.5, shininess: 60, two_sided: true),
            },
            objects: [
                (shape: Teapot(tessellation: 8), material: "one", position: (-3, 0, 0)),
                (shape: Teapot(tessellation: 8, bottom: false), material: "two", position: (3, 0, 0)),
                (shape: Sphere(radius: 1, slices: 60, stacks: 30), material: "one", position: (0, -2, 1)),
                (shape: Sphere(radius: 0.5, slices: 60, stacks: 30), material: "one", position: (1, 2, 2)),
                (shape: Box(), material: "one", position: (-1, 3, 2)),
                (shape: Box(), material: "two", position: (-4, 2, 2.5)),
                (shape: Torus(major_radius: 1, minor_radius: 0.3, major_segments: 40, minor_segments: 20), material: "one", position: (3, 3, 3)),
                (shape: Sphere(radius: 0.7, slices: 20, stacks: 10), material: "one", position: (-2, -3, -1)),
                (shape: Plane(width: 3, depth: 3, columns: 12, rows: 12), material: "two", position: (2, -2, -2)),
                (shape: Teapot(tessellation: 4), material: "one", position: (0, 6, 3)),
            ],
        )"#,
        "moved.ron",
    )
    .expect("a valid scene");
    let camera = *scene.camera();
    scene.set_camera(Camera {
        near: Some(1.0),
        far: Some(60.0),
        ..camera
    });
    scene
}

/// A scene's world, from its camera.
struct Subject {
    scene: Scene,
    placement: Placement,
    world: World,
    culler: Culler,
    view: View,
    visible: Vec<Range<u32>>,
}

impl Subject {
    fn new() -> Self {
        let scene = scene();
        let (placement, world) = Placement::new(&scene);
        let mut subject = Self {
            culler: Culler::new(&world.clusters),
            view: world.view(scene.camera(), SIZE.0, SIZE.1),
            visible: Vec::new(),
            scene,
            placement,
            world,
        };
        subject.culler.cull(&subject.view, &mut subject.visible);
        subject
    }

    /// Moves one to three objects: a little or far, off the screen or through the near plane, or back to where they came from. At
    /// times lights change as well, or the background. Returns whether they do.
    fn change(&mut self, random: &mut Random) -> bool {
        for _ in 0..1 + random.below(3) {
            let object = random.below(10);
            let place = self.scene.objects()[object].author_from_mesh;
            let mut within =
                |reach: f32| DVec3::from([0; 3].map(|_| f64::from(random.range(-reach, reach))));
            let (little, far) = (within(0.1), within(5.0));
            let place = match random.below(7) {
                0 | 1 => DMat4::from_translation(little) * place,
                2 => place * DMat4::from_rotation_x(0.3),
                3 => DMat4::from_translation(far),
                // Around the near plane, and behind the eye.
                4 => DMat4::from_translation(DVec3::new(0.0, -11.0, 2.7) + little),
                // Off the screen.
                5 => DMat4::from_translation(DVec3::new(20.0, 0.0, 0.0) + far),
                _ => scene().objects()[object].author_from_mesh,
            };
            self.scene.set_transform(object, place);
        }
        match random.below(12) {
            0 => {
                let light = self.scene.lights()[0];
                let radiance = random.rgb().map(f64::from);
                self.scene.set_light(0, Light { radiance, ..light });
            }
            1 => self.scene.set_background(random.rgb().map(f64::from)),
            _ => {}
        }
        let exec = Exec::sequential();
        let changes = self.placement.update(exec, &mut self.world, &self.scene);
        assert_ne!(changes.geometry, GeometryChange::Replaced);
        self.culler.refit(&self.world.clusters);
        let view = self.world.view(self.scene.camera(), SIZE.0, SIZE.1);
        assert_eq!(view, self.view, "the camera has moved");
        self.culler.cull(&self.view, &mut self.visible);
        // Culling may come to other results about what is still.
        if random.below(3) == 0 {
            self.visible.remove(random.below(self.visible.len()));
        }
        changes.shading || changes.background
    }

    fn geometry(&self) -> specula::backend::Geometry<'_> {
        geometry(&self.world, &self.view, &self.visible)
    }
}

/// A backend and what it draws to. One draws all images as a whole, the other keeps what it can.
struct Artist {
    backend: SoftwareBackend,
    frame: Frame,
    keeps: bool,
    /// How many answers of yes there are until a turn is told to stop.
    patience: usize,
}

impl Artist {
    fn new(keeps: bool) -> Self {
        Self {
            backend: SoftwareBackend::new(),
            frame: Frame::new(SIZE.0, SIZE.1),
            keeps,
            patience: usize::MAX,
        }
    }

    /// Takes at most so many turns, and returns what came of them.
    fn take_turns<T>(
        &mut self,
        most: usize,
        mut turn: impl FnMut(&mut SoftwareBackend, Turn<'_>) -> Option<T>,
    ) -> Option<T> {
        for round in 0..most {
            let (asked, patience) = (AtomicUsize::new(0), self.patience);
            let go_on = || asked.fetch_add(1, Ordering::Relaxed) < patience;
            let is_first = round == 0;
            let go_on = &go_on;
            if let Some(result) = turn(&mut self.backend, Turn { is_first, go_on }) {
                return Some(result);
            }
        }
        None
    }

    fn rasterize(
        &mut self,
        exec: Exec,
        subject: &Subject,
        moved: &[Range<u32>],
        most: usize,
    ) -> Option<RasterCounts> {
        let (geometry, keeps) = (subject.geometry(), self.keeps);
        self.take_turns(most, |backend, turn| match keeps {
            true => backend.rasterize_moved(exec, geometry, moved, turn),
            false => backend.rasterize_while(exec, geometry, turn),
        })
    }

    fn resolve(
        &mut self,
        exec: Exec,
        subject: &Subject,
        paint: BasePaint<'_>,
        keeps: bool,
        most: usize,
    ) -> Option<()> {
        let geometry = subject.geometry();
        self.take_turns(most, |backend, turn| {
            let is_done = match keeps {
                true => backend.resolve_moved(exec, geometry, paint, turn),
                false => backend.resolve_while(exec, geometry, paint, turn),
            };
            is_done.then_some(())
        })
    }

    /// Hands the image over, and returns the number of pixels written.
    fn present(&mut self, exec: Exec) -> u64 {
        let backend = &mut self.backend;
        self.frame.write(|target| backend.present(exec, target))
    }
}

/// Everything but how much was kept.
fn known(counts: RasterCounts) -> RasterCounts {
    RasterCounts {
        kept_tiles: 0,
        ..counts
    }
}

/// Fails unless both know the same of their images.
fn assert_same_owners(tested: &Artist, whole: &Artist, subject: &Subject, what: &str) {
    let [got, want] = [tested, whole].map(|artist| Visibility::of(&artist.backend));
    got.assert_same(&want, SIZE.0, what);
    let [got, want] = [tested, whole].map(|artist| artist.backend.visible_triangles());
    assert!(got == want, "{what}: visible triangles");
    for id in 0..subject.world.triangles.len() as u32 {
        let [got, want] = [tested, whole].map(|artist| artist.backend.visible_pixels(id));
        assert_eq!(got, want, "{what}: pixels of triangle {id}");
    }
    let tiles = SIZE.0.div_ceil(64) * SIZE.1.div_ceil(64);
    for tile in 0..tiles {
        let [got, want] = [tested, whole].map(|artist| artist.backend.square_pixels(tile));
        assert_eq!(got, want, "{what}: pixels of tile {tile}");
    }
}

/// Colours of all vertices that are seen.
fn colours(exec: Exec, subject: &Subject, visible: &[u32]) -> Vec3s {
    let mut colours = Vec3s::default();
    let (world, eye) = (&subject.world, subject.view.eye);
    VertexSet::default().illuminate(exec, world, eye, visible, &mut colours);
    colours
}

/// Patches on some visible triangles, which hold nothing but red.
fn patches(random: &mut Random, visible: &[u32]) -> Vec<Patch> {
    let mut triangles: Vec<u32> = (0..random.below(20).min(visible.len()))
        .map(|_| visible[random.below(visible.len())])
        .collect();
    triangles.sort_unstable();
    triangles.dedup();
    (triangles.into_iter())
        .map(|triangle| Patch {
            triangle,
            corners: Bary::ROOT,
            fill: Fill::Gouraud([[1.0, 0.0, 0.0]; 3]),
            pixels: 0,
        })
        .collect()
}

/// Moves objects many times over. Returns how many covered tiles were kept of how many.
fn try_out(exec: Exec, seed: u64, steps: usize) -> (u64, u64) {
    let mut random = Random(seed);
    let mut subject = Subject::new();
    let (mut tested, mut whole) = (Artist::new(true), Artist::new(false));
    // What the tested backend has missed, and whether light is as it was when it got its colours.
    let mut moved: Vec<Range<u32>> = Vec::new();
    let mut is_lit_alike = false;
    // What an image that was given up has changed is handed over though it may be as before.
    let mut has_given_up = false;
    let (mut kept, mut covered) = (0, 0);
    for step in 0..steps {
        let what = format!("seed {seed}, step {step}, {exec:?}");
        is_lit_alike &= !subject.change(&mut random);
        moved.extend_from_slice(subject.placement.moved());
        moved.sort_unstable_by_key(|range| range.start);
        moved.dedup();
        tested.patience = [0, 3, 40, usize::MAX][random.below(4)];
        if random.below(6) == 0 {
            // Given up, as a rule before it is complete.
            if tested.rasterize(exec, &subject, &moved, 10).is_some() {
                moved.clear();
            }
            continue;
        }
        let got = tested
            .rasterize(exec, &subject, &moved, usize::MAX)
            .expect("complete");
        let want = whole.rasterize(exec, &subject, &[], 1).expect("complete");
        moved.clear();
        assert_eq!(known(got), want, "{what}");
        assert_same_owners(&tested, &whole, &subject, &what);
        (kept, covered) = (kept + got.kept_tiles, covered + want_covered(want));

        let visible = whole.backend.visible_triangles().to_vec();
        let colours = colours(exec, &subject, &visible);
        let paint = match random.below(8) {
            0 => BasePaint::Phong,
            1 => continue,
            _ => BasePaint::Gouraud(&colours),
        };
        if random.below(6) == 0 {
            let is_complete = tested
                .resolve(exec, &subject, paint, is_lit_alike, 3)
                .is_some();
            is_lit_alike |= is_complete;
            has_given_up = true;
            if !is_complete {
                continue;
            }
        }
        tested.resolve(exec, &subject, paint, is_lit_alike, usize::MAX);
        whole.resolve(exec, &subject, paint, false, 1);
        is_lit_alike = true;
        let [got, want] = [&mut tested, &mut whole].map(|artist| artist.present(exec));
        assert!(
            tested.frame.pixels() == whole.frame.pixels(),
            "{what}: colours"
        );
        assert!(
            has_given_up || got == want,
            "{what}: wrote {got} pixels instead of {want}"
        );

        let mut some = patches(&mut random, &visible);
        let mut others = some.clone();
        tested.backend.repaint(exec, subject.geometry(), &mut some);
        whole.backend.repaint(exec, subject.geometry(), &mut others);
        for (got, want) in some.iter().zip(&others) {
            assert_eq!(got.pixels, want.pixels, "{what}: pixels of a patch");
        }
        if random.below(3) == 0 {
            let square = [random.below(20) as u32];
            tested
                .backend
                .shade_squares(exec, subject.geometry(), &square);
            whole
                .backend
                .shade_squares(exec, subject.geometry(), &square);
        }
        let [got, want] = [&mut tested, &mut whole].map(|artist| artist.present(exec));
        assert!(
            tested.frame.pixels() == whole.frame.pixels(),
            "{what}: painted over"
        );
        assert!(
            has_given_up || got == want,
            "{what}: wrote {got} pixels instead of {want}"
        );
    }
    (kept, covered)
}

/// Covered tiles of an image of as many as there are.
fn want_covered(counts: RasterCounts) -> u64 {
    u64::from(SIZE.0.div_ceil(64) * SIZE.1.div_ceil(64)) - counts.background_tiles
}

#[test]
fn what_moved_objects_leave_alone_is_as_if_drawn_again() {
    for seed in 0..6 {
        let (kept, covered) = try_out(best(), 1000 + seed, 60);
        assert!(kept * 10 > covered, "{kept} of {covered} tiles were kept");
    }
}

#[test]
fn so_it_is_on_two_threads_and_at_each_level() {
    on_each_exec(|exec| {
        for seed in 0..2 {
            try_out(exec, 2000 + seed, 30);
        }
    });
}
