//! Triangles that are shaded per pixel while the first image gets its colours: with them refinement is done before it begins.

use super::certificate::RIGHT;
use super::ranking::LOOK_ERROR;
use super::shading::RootShading;
use super::{LIT, Progress, Refinement, Stage};
use crate::backend::Backend;
use crate::frame::base::BaseImage;
use crate::geometry::TriangleSet;
use crate::scene::World;
use crate::schedule::{Rank, cost};

/// What is lit of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::frame) struct LitTriangles {
    /// How many triangles; see [`FrameRecord::lit`](crate::schedule::FrameRecord::lit).
    pub(in crate::frame) triangles: u32,
    /// How many pixels these own.
    pub(in crate::frame) pixels: u64,
}

/// How much may be lit.
#[derive(Clone, Copy, Debug)]
pub(in crate::frame) enum MostLit {
    /// So many triangles.
    Triangles(u32),
    /// As many as own so many pixels at most.
    Pixels(u64),
}

impl MostLit {
    /// Whether it is no more than that.
    fn allows(self, lit: &LitTriangles) -> bool {
        match self {
            Self::Triangles(most) => lit.triangles <= most,
            Self::Pixels(most) => lit.pixels <= most,
        }
    }
}

impl Refinement {
    /// Begins, and ends, with an image in which every pixel is lit. Nothing is found out about its triangles.
    pub(in crate::frame) fn begin_final(&mut self, world: &World, base: &BaseImage) {
        self.clear();
        self.forest.reset(world);
        self.places.reset(world.triangles.len());
        self.memory.next_image(world.triangles.len());
        let pixels = base.covered_pixels();
        self.certificate.begin(pixels);
        self.certificate.lower_all(RIGHT);
        self.pixels = pixels;
        self.counters.phong_pixels = pixels;
    }

    /// Makes all visible triangles candidates, which takes [`collecting_ns`](Self::collecting_ns), and ranks them by their errors for
    /// [`light`](Self::light).
    pub(in crate::frame) fn collect_everything(&mut self, stage: &Stage<'_>) {
        let first = self.roots.len();
        self.take_up(stage, f32::INFINITY);
        self.collect_from(stage, first);
        self.by_error.clear();
        let ranks = self.by_error.extend(self.roots.len());
        for (root, rank) in self.roots.iter().zip(ranks) {
            if root.prior > LOOK_ERROR {
                *rank = Rank::new(root.prior);
            }
        }
        self.by_error.admit(0);
    }

    /// What that takes as a rule, in nominal nanoseconds.
    pub(in crate::frame) fn collecting_ns(&self, backend: &dyn Backend, lights: usize) -> f64 {
        let triangles = backend.visible_triangles().len() as f32;
        let samples = cost::samples(1, lights) * triangles;
        f64::from(cost::collecting(triangles, lights) + samples)
    }

    /// Lights triangles that have just been collected, and notes them in `lit`: those first whose pixels are expected to be furthest off, and none that seems
    /// right. Their pixels are right as soon as the first image is drawn.
    pub(in crate::frame) fn light(
        &mut self,
        world: &World,
        most: MostLit,
        lit: &mut TriangleSet,
    ) -> LitTriangles {
        self.lit_shading = RootShading::lit(world.lights.len());
        let mut done = LitTriangles::default();
        while let Some(index) = self.by_error.pop() {
            let root = self.roots[index as usize];
            let with_next = LitTriangles {
                triangles: done.triangles + 1,
                pixels: done.pixels + u64::from(root.pixels),
            };
            if !most.allows(&with_next) {
                break;
            }
            done = with_next;
            lit.insert(root.triangle);
            self.note_lit(index);
        }
        done
    }

    /// Notes that a root that nothing has been done about is right.
    fn note_lit(&mut self, index: u32) {
        self.mark_refined(index, false);
        let root = &mut self.roots[index as usize];
        root.progress = Progress::Done;
        root.shading = LIT;
        self.error_mass -= root.mass();
        self.counters.phong_pixels += u64::from(root.pixels);
        self.certificate.lower([u8::MAX, RIGHT], root.pixels);
    }
}
