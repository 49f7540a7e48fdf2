//! What happened in a frame.

use crate::schedule::{Budget, FrameRecord};
use serde::Serialize;
use std::fmt;

/// How far a frame came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Outcome {
    /// The image is final: it equals the method's own best.
    Complete,
    /// The first image was drawn, and refined as far as the budget went.
    Refined,
    /// There was time for the first image only.
    BaseOnly,
    /// The first image at full resolution would not have fitted into the budget: this one has a lower
    /// [resolution](FrameStats::divisor), and was enlarged.
    Reduced,
    /// There was no time for a first image: it goes on in the next frame.
    Stale {
        /// The image shown is of the scene and camera of so many frames ago; `None` if it is the background, because
        /// there is no image yet.
        age: Option<u64>,
    },
    /// Nothing was drawn: the image was final already, or there was no time; on a backend that draws everything once, also
    /// if a better image would take longer to draw than the budget.
    Unchanged,
}

impl Outcome {
    /// The name used in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Refined => "refined",
            Self::BaseOnly => "base_only",
            Self::Reduced => "reduced",
            Self::Stale { .. } => "stale",
            Self::Unchanged => "unchanged",
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// See [`StageTimes::slowness`].
const MOST_SLOWNESS: f64 = 3.0;

/// Stages that were predicted to take less say nothing about the machine.
const LEAST_MS_TO_JUDGE_BY: f64 = 0.1;

/// Milliseconds spent in each stage of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StageTimes {
    /// Taking over what has changed of the scene, and culling clusters.
    pub cull: f64,
    /// Illuminating vertices.
    pub shade: f64,
    /// Collecting candidates for refinement: highlight sign tests, first guesses of errors, and ranks.
    pub classify: f64,
    /// Transforming, binning and rasterizing: who owns which pixel.
    pub raster: f64,
    /// Subdividing, illuminating new vertices, repainting and per-pixel shading.
    pub refine: f64,
    /// Colouring the first image.
    pub resolve: f64,
    /// Bringing the caller's frame up to date.
    pub present: f64,
}

impl StageTimes {
    /// Names and milliseconds, in the order of the fields, for reports.
    #[must_use]
    pub fn entries(&self) -> [(&'static str, f64); 7] {
        [
            ("cull", self.cull),
            ("shade", self.shade),
            ("classify", self.classify),
            ("raster", self.raster),
            ("refine", self.refine),
            ("resolve", self.resolve),
            ("present", self.present),
        ]
    }

    /// How many times as long as `predicted` the stages took, at least 1 and at most [`MOST_SLOWNESS`]: a machine that is slow now, as a
    /// shared one is when a thread has to wait for a processor, will be slow for the rest of the frame.
    pub(super) fn slowness(&self, predicted: &Self) -> f64 {
        let [mut measured, mut expected] = [0.0; 2];
        for ((_, ms), (_, predicted_ms)) in self.entries().into_iter().zip(predicted.entries()) {
            if predicted_ms > 0.0 {
                measured += ms;
                expected += predicted_ms;
            }
        }
        if expected < LEAST_MS_TO_JUDGE_BY {
            return 1.0;
        }
        (measured / expected).clamp(1.0, MOST_SLOWNESS)
    }

    /// Adds another frame's times, weighted.
    pub(crate) fn add_scaled(&mut self, other: &Self, weight: f64) {
        self.cull += other.cull * weight;
        self.shade += other.shade * weight;
        self.classify += other.classify * weight;
        self.raster += other.raster * weight;
        self.refine += other.refine * weight;
        self.resolve += other.resolve * weight;
        self.present += other.present * weight;
    }
}

/// What a frame did not need to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Skipped {
    /// Clusters outside of the view.
    pub clusters_off_screen: u64,
    /// Clusters that face away.
    pub clusters_facing_away: u64,
    /// Triangles that face away (in clusters that do not as a whole).
    pub triangles_facing_away: u64,
    /// Triangles outside of the view or between pixels.
    pub triangles_off_screen: u64,
    /// Triangles drawn of which no pixel is visible.
    pub triangles_hidden: u64,
    /// Visible triangles whose material has no specular term: no highlight test.
    pub triangles_matte: u64,
    /// Triangles whose first image is proved right: never refined.
    pub triangles_proved: u64,
    /// Light terms (diffuse or specular, of one light on one triangle) proved not to need evaluation.
    pub light_terms: u64,
    /// Tiles that nothing covers.
    pub background_tiles: u64,
    /// Covered tiles that were kept from the image before, because nothing moved there.
    pub tiles_unmoved: u64,
    /// Covered pixels whose owners stayed known from the frame before: neither camera nor objects had moved.
    pub visibility_pixels: u64,
    /// Pixels of the caller's frame that were right already.
    pub pixels_unchanged: u64,
}

impl Skipped {
    /// Names and values, in the order of the fields, for reports.
    #[must_use]
    pub fn entries(&self) -> [(&'static str, u64); 12] {
        [
            ("clusters_off_screen", self.clusters_off_screen),
            ("clusters_facing_away", self.clusters_facing_away),
            ("triangles_facing_away", self.triangles_facing_away),
            ("triangles_off_screen", self.triangles_off_screen),
            ("triangles_hidden", self.triangles_hidden),
            ("triangles_matte", self.triangles_matte),
            ("triangles_proved", self.triangles_proved),
            ("light_terms", self.light_terms),
            ("background_tiles", self.background_tiles),
            ("tiles_unmoved", self.tiles_unmoved),
            ("visibility_pixels", self.visibility_pixels),
            ("pixels_unchanged", self.pixels_unchanged),
        ]
    }
}

/// What happened in a frame.
///
/// Times and work are this frame's; counts of triangles and candidates describe the image it left behind.
#[derive(Clone, Copy, Debug)]
pub struct FrameStats {
    /// Number of the frame, the engine's first being 1.
    pub frame: u64,
    /// Milliseconds from call to return.
    pub frame_ms: f64,
    /// What the frame was allowed to cost.
    pub budget: Budget,
    /// How far it came.
    pub outcome: Outcome,
    /// Whether the image is final.
    pub converged: bool,
    /// The image has a `divisor`-th of the target's width and height: 1 is the full resolution.
    pub divisor: u32,
    /// What time had to say about the frame: enough to [replay](Budget::Replay) it.
    pub record: FrameRecord,
    /// Estimated root mean square difference from per-pixel Phong shading, in 8-bit codes over covered pixels; 0
    /// for [`Method::Phong`](super::Method::Phong). NaN for flat and Gouraud shading, where nothing is estimated, and while nothing is known yet. Where the budget ended before
    /// all visible triangles were looked at, over those that were.
    pub estimated_error: f64,
    /// No pixel of the image is further from per-pixel Phong shading than this, per channel and as a share of full scale (a code is
    /// 1/255), rounding to codes included: a proof where `estimated_error` is an estimate. It never grows while a still view is refined, and is
    /// at most 1/255 when that has converged; 1, of which nothing follows, for methods that prove nothing. `None` where the image is not the
    /// one asked for at full resolution (reduced, or stale), and on a backend with a coverage of its own. Pixels are excepted where the
    /// illumination equation itself is in doubt within rounding: where a light just sets.
    pub error_bound: Option<f64>,
    /// Share of the covered pixels whose own bound is above a code; `None` like `error_bound`.
    pub unproved_share: Option<f64>,
    /// Triangles of the scene; those of two-sided materials count twice, as fronts and as backs.
    pub triangles: u64,
    /// Triangles sent to the rasterizer's tiles for this image.
    pub triangles_drawn: u64,
    /// Triangles that own at least one pixel.
    pub triangles_visible: u64,
    /// Pixels that some triangle owns.
    pub covered_pixels: u64,
    /// Potentially highlighted triangles: those that pass the paper's H1 and H2 tests for some light. Only triangles that
    /// own a pixel are tested, so far as the budget went; none by methods that draw one image and are done, nor where a deadline left time to shade all pixels at
    /// once.
    pub pht: u64,
    /// The same.
    pub pht_visible: u64,
    /// Those of them that have been refined so far (subdivided or shaded per pixel).
    pub refined: u64,
    /// Triangles subdivided so far.
    pub triangles_subdivided: u64,
    /// Leaves of subdivisions that are not right yet: still to be refined, unlike those shaded per pixel.
    pub leaves: u64,
    /// Pixels shaded by the illumination equation so far.
    pub phong_pixels: u64,
    /// Nominal nanoseconds of refinement in this frame.
    pub work_units: u64,
    /// Pixels written to the caller's frame.
    pub pixels_written: u64,
    /// Milliseconds by stage.
    pub stage_ms: StageTimes,
    /// What the stages that were completed in this frame had been predicted to take. Of refinement, what was done of it.
    pub predicted_ms: StageTimes,
    /// What was not needed.
    pub skipped: Skipped,
}

impl FrameStats {
    /// A frame in which nothing happened.
    pub(super) fn empty(budget: Budget) -> Self {
        Self {
            frame: 0,
            frame_ms: 0.0,
            budget,
            outcome: Outcome::BaseOnly,
            converged: false,
            divisor: 1,
            record: FrameRecord::default(),
            estimated_error: f64::NAN,
            error_bound: None,
            unproved_share: None,
            triangles: 0,
            triangles_drawn: 0,
            triangles_visible: 0,
            covered_pixels: 0,
            pht: 0,
            pht_visible: 0,
            refined: 0,
            triangles_subdivided: 0,
            leaves: 0,
            phong_pixels: 0,
            work_units: 0,
            pixels_written: 0,
            stage_ms: StageTimes::default(),
            predicted_ms: StageTimes::default(),
            skipped: Skipped::default(),
        }
    }

    /// Milliseconds past the deadline; negative when the frame was early, `None` without a wall-clock budget.
    #[must_use]
    pub fn overshoot_ms(&self) -> Option<f64> {
        match self.budget {
            Budget::Millis(ms) => Some(self.frame_ms - ms),
            _ => None,
        }
    }
}

impl fmt::Display for FrameStats {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "frame {}: {} in {:.2} ms, error about {:.2} codes, {} of {} visible PHTs refined",
            self.frame,
            self.outcome.name().replace('_', " "),
            self.frame_ms,
            self.estimated_error,
            self.refined,
            self.pht_visible,
        )?;
        if self.converged {
            write!(f, ", converged")?;
        }
        Ok(())
    }
}
