//! What is said of a frame, on the screen and to other programs.

use serde_json::{Map, Value, json};
use specula::frame::{FrameStats, Outcome};
use specula::measure::{ErrorReport, Noise};
use specula::schedule::Budget;

/// What a counter of skipped things is called on the screen.
pub(super) fn label(name: &str) -> String {
    match name {
        "triangles_off_screen" => "triangles off screen or between pixels".to_owned(),
        _ => name.replace('_', " "),
    }
}

/// What is printed of a frame.
#[derive(Debug)]
pub(super) struct FrameReport {
    /// Counted from 1.
    pub(super) number: u32,
    pub(super) stats: FrameStats,
    /// The difference from the reference, if it was asked for.
    pub(super) error: Option<ErrorReport>,
}

/// The statistics of a frame as one object; what it does not have is null.
pub(super) fn frame_json(number: u32, stats: &FrameStats) -> Value {
    let (budget_ms, budget_work) = match stats.budget {
        Budget::Millis(ms) => (Some(ms), None),
        Budget::Work(units) => (None, Some(units)),
        Budget::Error(_) | Budget::Unlimited | Budget::Replay(_) => (None, None),
    };
    let age = match stats.outcome {
        Outcome::Stale { age } => age,
        _ => Some(0),
    };
    let stages: Map<String, Value> = (stats.stage_ms.entries())
        .into_iter()
        .map(|(name, ms)| (name.to_owned(), json!(ms)))
        .collect();
    let skipped: Map<String, Value> = stats
        .skipped
        .entries()
        .into_iter()
        .map(|(name, count)| (name.to_owned(), json!(count)))
        .collect();
    json!({
        "frame": number,
        "frame_ms": stats.frame_ms,
        "budget_ms": budget_ms,
        "budget_work": budget_work,
        "overshoot_ms": stats.overshoot_ms(),
        "outcome": stats.outcome.name(),
        "age": age,
        "divisor": stats.divisor,
        "converged": stats.converged,
        "estimated_error": stats.estimated_error,
        "error_bound": stats.error_bound,
        "unproved_share": stats.unproved_share,
        "triangles": stats.triangles,
        "triangles_drawn": stats.triangles_drawn,
        "triangles_visible": stats.triangles_visible,
        "pht": stats.pht,
        "pht_visible": stats.pht_visible,
        "refined": stats.refined,
        "triangles_subdivided": stats.triangles_subdivided,
        "leaves": stats.leaves,
        "phong_pixels": stats.phong_pixels,
        "work_units": stats.work_units,
        "pixels_written": stats.pixels_written,
        "stage_ms": stages,
        "skipped": skipped,
    })
}

/// What became of highlights, in words.
fn highlights(stats: &FrameStats) -> String {
    let pixels = stats.phong_pixels;
    if pixels > 0 && pixels == stats.covered_pixels && stats.pht == 0 {
        return format!("  highlights or none, all {pixels} pixels are shaded by Phong");
    }
    format!(
        "  highlights {} PHTs found, {} visible, {} refined; {pixels} pixels shaded by Phong",
        stats.pht, stats.pht_visible, stats.refined
    )
}

/// What is proved of the image, in words.
pub(super) fn certificate(stats: &FrameStats) -> Option<String> {
    let (bound, share) = stats.error_bound.zip(stats.unproved_share)?;
    let right = format!("{:.1} % of the pixels within a code", (1.0 - share) * 100.0);
    let rest = match bound {
        _ if share == 0.0 => String::new(),
        1.0.. => ", nothing of the others".to_owned(),
        _ => format!(", the others within {:.0}", bound * 255.0),
    };
    Some(format!("  proved     {right}{rest}"))
}

impl FrameReport {
    /// One object.
    pub(super) fn json(&self) -> Value {
        let mut object = frame_json(self.number, &self.stats);
        if let (Some(error), Some(object)) = (self.error, object.as_object_mut()) {
            object.insert("error".to_owned(), json!(error));
        }
        object
    }

    /// A block of lines.
    pub(super) fn text(&self) -> String {
        let stats = &self.stats;
        let mut lines = vec![
            self.headline(),
            format!(
                "  stages     {}",
                list(
                    stats
                        .stage_ms
                        .entries()
                        .map(|(name, ms)| format!("{name} {ms:.2}"))
                ) + " ms"
            ),
            format!(
                "  triangles  {} in the scene, {} drawn, {} visible, {} subdivided; {} leaves open",
                stats.triangles,
                stats.triangles_drawn,
                stats.triangles_visible,
                stats.triangles_subdivided,
                stats.leaves
            ),
            highlights(stats),
            format!("  skipped    {}", self.skipped()),
        ];
        if stats.estimated_error.is_finite() {
            lines.push(format!(
                "  error      about {:.2} codes (estimate)",
                stats.estimated_error
            ));
        }
        lines.extend(certificate(stats));
        if let Some(error) = &self.error {
            lines.push(measured(error));
        }
        lines.join("\n")
    }

    fn headline(&self) -> String {
        let stats = &self.stats;
        let budget = match stats.budget {
            Budget::Millis(ms) => {
                let late = stats.frame_ms - ms;
                let verdict = if late > 0.0 {
                    format!("{late:.2} ms late")
                } else {
                    "in time".to_owned()
                };
                format!(", budget {ms:.2} ms: {verdict}")
            }
            Budget::Work(units) => format!(", {} of {units} work units", stats.work_units),
            Budget::Error(rmse) => format!(", until about {rmse} codes of error"),
            Budget::Unlimited | Budget::Replay(_) => String::new(),
        };
        let converged = if stats.converged { ", converged" } else { "" };
        format!(
            "frame {}: {} in {:.2} ms{budget}{converged}",
            self.number,
            outcome(stats),
            stats.frame_ms
        )
    }

    /// The counters that are not zero.
    fn skipped(&self) -> String {
        let counted = self
            .stats
            .skipped
            .entries()
            .into_iter()
            .filter(|&(_, count)| count > 0)
            .map(|(name, count)| format!("{} {count}", label(name)));
        let text = list(counted);
        if text.is_empty() {
            "nothing".to_owned()
        } else {
            text
        }
    }
}

/// How far a frame came, in words.
fn outcome(stats: &FrameStats) -> String {
    match (stats.outcome, stats.divisor) {
        (Outcome::Stale { age: None }, _) => "no image yet".to_owned(),
        (Outcome::Stale { age: Some(age) }, _) => {
            let frames = if age == 1 { "frame" } else { "frames" };
            format!("stale by {age} {frames}")
        }
        (Outcome::Reduced, divisor) => format!("reduced to 1/{divisor}"),
        (outcome, _) => outcome.name().replace('_', " "),
    }
}

/// The line about a comparison with the reference.
fn measured(error: &ErrorReport) -> String {
    let psnr = if error.psnr_db.is_finite() {
        format!("psnr {:.2} dB", error.psnr_db)
    } else {
        "equal to the reference".to_owned()
    };
    format!(
        "  measured   rmse {:.3} codes, {psnr}, max {}, p99 {}, {:.2} % of {} pixels off by more than 1 code, \
         {:.2} % by more than 4, {} pixels left out",
        error.rmse,
        error.max,
        error.p99,
        error.share_above_1 * 100.0,
        error.covered_pixels,
        error.share_above_4 * 100.0,
        error.excluded_pixels
    )
}

/// Why times are not to be trusted, if so.
pub(super) fn noise_warning(noise: &Noise) -> Option<String> {
    let percent = |share: f64| share * 100.0;
    let mut reasons = Vec::new();
    if noise.spread > Noise::MOST_SPREAD {
        reasons.push(format!(
            "quartiles {:.0} % apart (limit {:.0} %)",
            percent(noise.spread),
            percent(Noise::MOST_SPREAD)
        ));
    }
    if noise.drift > Noise::MOST_DRIFT {
        reasons.push(format!(
            "medians changed by {:.1} % (limit {:.0} %)",
            percent(noise.drift),
            percent(Noise::MOST_DRIFT)
        ));
    }
    (!reasons.is_empty()).then(|| {
        let reasons = list(reasons);
        format!("machine too noisy to trust these times: {reasons}")
    })
}

pub(super) fn list(items: impl IntoIterator<Item = String>) -> String {
    items.into_iter().collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use specula::schedule::FrameRecord;
    use specula::{Engine, Frame, Scene};

    #[test]
    fn older_and_smaller_images_are_said_to_be_so() {
        let scene = Scene::parse("(objects: [(shape: Box())])", "box.ron").expect("it is valid");
        let mut engine = Engine::new(&scene).expect("threads start");
        let mut frame = Frame::new(32, 18);
        // What a frame does is told, so that time has no say in it.
        let mut say = |scene: &Scene, images, divisor| {
            let budget = Budget::Replay(FrameRecord {
                images,
                divisor,
                ..FrameRecord::default()
            });
            let stats = engine.render(scene, budget, &mut frame);
            let json = frame_json(1, &stats);
            let [outcome, age, divisor] =
                ["outcome", "age", "divisor"].map(|key| json[key].clone());
            (super::outcome(&stats), json!([outcome, age, divisor]))
        };
        let mut moved = scene.clone();
        let mut camera = *moved.camera();
        camera.position.z += 1.0;
        moved.set_camera(camera);
        for (scene, images, divisor, words, values) in [
            (&scene, 0, 1, "no image yet", json!(["stale", null, 1])),
            (&scene, 1, 3, "reduced to 1/3", json!(["reduced", 0, 3])),
            (&moved, 0, 1, "stale by 1 frame", json!(["stale", 1, 3])),
            (&moved, 0, 1, "stale by 2 frames", json!(["stale", 2, 3])),
            (&moved, 1, 1, "base only", json!(["base_only", 0, 1])),
        ] {
            assert_eq!(say(scene, images, divisor), (words.to_owned(), values));
        }
    }
}
