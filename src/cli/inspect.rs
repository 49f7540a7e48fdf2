//! `specula inspect`: what a view consists of, in numbers and drawn over the image.

use super::args::{Machine, budget, count, milliseconds, name_of, require_png, time};
use super::console::{Output, note};
use super::report::{certificate, label, list};
use super::{Failure, animate};
use clap::Args;
use serde_json::{Map, Value, json};
use specula::frame::{FrameStats, Method};
use specula::measure::inspection::{Inspection, MaterialCounts};
use specula::measure::{Layer, draw_overlay};
use specula::output::{Encoding, Frame, png};
use specula::scene::Scene;
use std::path::PathBuf;

/// Most materials that the report on the screen lists.
const MATERIALS_LISTED: usize = 8;

/// `specula inspect`.
#[derive(Debug, Args)]
#[command(after_help = "\
Colours of the overlay, and the layers they belong to:
  wireframe  white lines: visible triangles
  pht        amber: potentially highlighted triangles (PHTs) that are not refined;
             green: those that are subdivided or shaded per pixel
  leaves     light blue lines: what triangles have been divided into
  per-pixel  violet: pixels shaded by the illumination equation
  proved     blue: triangles looked at and proved right as they were
  lights     discs: point lights in their colour, rings where something hides them;
             squares: where directional light comes from
Lines fade out where triangles are smaller than a few pixels.

Without --budget and --work the image is refined until it equals per-pixel Phong shading; with
--work 0 it is the first, Gouraud-shaded one.

Examples:
  What is there to see, and what was left out:
    specula inspect scenes/teapot.ron
  What a budget was spent on:
    specula inspect scenes/teapot.ron --budget 2 --overlay teapot-overlay.png
  Only the highlight test, before anything is refined:
    specula inspect scenes/teapot.ron --work 0 --overlay pht.png --show pht,wireframe
  Numbers for a script:
    specula inspect scenes/teapot.ron --json | jq .pht")]
pub(super) struct Inspect {
    /// Scene file (.ron), or a mesh (.obj), which gets a camera, lights and a material
    pub(super) scene: PathBuf,

    /// Look at the scene's animation after this many seconds, as `specula animate` films it
    #[arg(long, value_name = "S", value_parser = time, allow_negative_numbers = true)]
    time: Option<f64>,

    /// Draw the triangles, highlights and refinement over the image, and write it; the name ends in .png
    #[arg(long, value_name = "OUT.png")]
    overlay: Option<PathBuf>,

    /// What the overlay shows, separated by commas: wireframe, pht, leaves, per-pixel, proved, lights
    #[arg(
        long,
        value_name = "LAYERS",
        value_delimiter = ',',
        default_value = "wireframe,pht,leaves,per-pixel,lights",
        requires = "overlay"
    )]
    show: Vec<Layer>,

    /// Wall-clock milliseconds for each frame; 0 buys the first, Gouraud-shaded image only
    #[arg(long, value_name = "MS", value_parser = milliseconds, allow_negative_numbers = true)]
    budget: Option<f64>,

    /// Work units (nominal nanoseconds of refinement) for each frame: the result does not depend on the machine
    #[arg(long, value_name = "UNITS", conflicts_with = "budget")]
    work: Option<u64>,

    /// How many frames of the view to render; the last one is inspected
    #[arg(long, value_name = "N", default_value = "1", value_parser = count)]
    frames: u32,

    /// How to shade: flat, gouraud, phong, adaptive, phong-area, phong-tiles, phong-half, regular, highlight or hybrid
    #[arg(long, default_value_t)]
    method: Method,

    /// How the image inspected stores light: srgb or linear; an overlay is srgb
    #[arg(long, value_name = "NAME", default_value_t)]
    encoding: Encoding,

    /// Print one JSON object
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    machine: Machine,
}

pub(super) fn run(args: &Inspect) -> Result<(), Failure> {
    if let Some(path) = &args.overlay {
        require_png(path)?;
        png::check_writable(path)?;
    }
    let mut scene = Scene::load(&args.scene)?;
    if let Some(seconds) = args.time {
        animate::go_to_time(&mut scene, seconds);
    }
    let mut engine = args.machine.engine(&scene, args.method, args.encoding)?;
    let size = args.machine.size;
    let mut frame = Frame::new(size.width, size.height);
    let budget = budget(args.budget, args.work);
    if args.budget.is_some() {
        engine.warm_up(&scene, size.width, size.height);
    }
    let mut stats = engine.render(&scene, budget, &mut frame);
    for _ in 1..args.frames {
        stats = engine.render(&scene, budget, &mut frame);
    }

    let report = Report {
        scene: name_of(&args.scene),
        args,
        stats,
        inspection: Inspection::new(&engine, &scene, &stats, [size.width, size.height]),
    };
    Output::new().line(&if args.json {
        report.json()?
    } else {
        report.text()
    })?;
    if let Some(path) = &args.overlay {
        draw_overlay(&mut frame, &engine, &scene, &args.show);
        frame.save_png(path)?;
        note(&format!(
            "wrote {} ({}x{})",
            path.display(),
            size.width,
            size.height
        ));
    }
    Ok(())
}

/// What is printed of a view.
struct Report<'a> {
    scene: String,
    args: &'a Inspect,
    stats: FrameStats,
    inspection: Inspection,
}

impl Report<'_> {
    /// One object; what there is not is null.
    fn json(&self) -> Result<String, Failure> {
        let (stats, size) = (&self.stats, self.args.machine.size);
        let mut object = json!({
            "scene": self.scene,
            "method": self.args.method.name(),
            "width": size.width,
            "height": size.height,
            "threads": self.args.machine.thread_count(),
            "frames": self.args.frames,
            "budget_ms": self.args.budget,
            "budget_work": self.args.work,
            "frame_ms": stats.frame_ms,
            "outcome": stats.outcome.name(),
            "converged": stats.converged,
            "estimated_error": stats.estimated_error,
            "error_bound": stats.error_bound,
            "unproved_share": stats.unproved_share,
            "skipped": stats
                .skipped
                .entries()
                .into_iter()
                .map(|(name, count)| (name.to_owned(), json!(count)))
                .collect::<Map<String, Value>>(),
        });
        let inspection = serde_json::to_value(&self.inspection)
            .map_err(|error| Failure::runtime(format!("cannot print the report: {error}")))?;
        if let (Some(object), Value::Object(inspection)) = (object.as_object_mut(), inspection) {
            object.extend(inspection);
        }
        Ok(object.to_string())
    }

    /// A block of lines.
    fn text(&self) -> String {
        let (stats, size) = (&self.stats, self.args.machine.size);
        let converged = if stats.converged { ", converged" } else { "" };
        let mut lines = vec![format!(
            "{}: {}x{}, {}, {} in {:.2} ms{converged}",
            self.scene,
            size.width,
            size.height,
            self.args.method,
            stats.outcome.name().replace('_', " "),
            stats.frame_ms
        )];
        lines.extend(self.scene_lines());
        lines.extend(self.visibility_lines());
        lines.extend(self.highlight_lines());
        lines.extend(self.refinement_lines());
        if stats.estimated_error.is_finite() {
            let error = stats.estimated_error;
            lines.push(format!("  error       about {error:.2} codes (estimate)"));
        }
        lines.extend(certificate(stats).map(|line| line.replacen("proved", "proved ", 1)));
        lines.join("\n")
    }

    fn scene_lines(&self) -> Vec<String> {
        let i = &self.inspection;
        let mut lines = vec![
            format!(
                "  scene       {}, {}, {}",
                counted(i.objects as u64, "object"),
                counted(i.triangles.total, "triangle"),
                counted(i.vertices as u64, "vertex"),
            ),
            format!(
                "  lights      {}: {} at a point, {} directional",
                i.lights.total, i.lights.point, i.lights.directional
            ),
        ];
        let listed = i.materials.iter().take(MATERIALS_LISTED).enumerate();
        lines.extend(listed.map(|(index, material)| {
            let title = if index == 0 { "materials" } else { "" };
            format!("  {title:<11} {}", describe(material))
        }));
        if i.materials.len() > MATERIALS_LISTED {
            let more = i.materials.len() - MATERIALS_LISTED;
            lines.push(format!("              and {more} more"));
        }
        lines
    }

    fn visibility_lines(&self) -> [String; 3] {
        let i = &self.inspection;
        let (clusters, triangles) = (&i.clusters, &i.triangles);
        [
            format!(
                "  clusters    {}: {} outside of the view, {} facing away, {} visible",
                clusters.total, clusters.off_screen, clusters.facing_away, clusters.visible
            ),
            format!(
                "  triangles   {} in culled clusters, {} facing away, {} off screen or between pixels, {} drawn",
                triangles.in_culled_clusters,
                triangles.facing_away,
                triangles.off_screen,
                triangles.drawn
            ),
            format!(
                "  drawn       {} hidden, {} visible on {}",
                triangles.hidden,
                triangles.visible,
                counted(i.covered_pixels, "pixel")
            ),
        ]
    }

    fn highlight_lines(&self) -> Vec<String> {
        let (pht, verdicts) = (&self.inspection.pht, &self.inspection.verdicts);
        let bounds = format!(
            "  bounds      {} visible triangles proved right when interpolated, {} not, {} of them PHTs",
            verdicts.absent,
            verdicts.lobe + verdicts.centre,
            verdicts.centre
        );
        if !self.args.method.is_progressive() {
            return vec![bounds];
        }
        let tested = format!(
            "  highlights  {} visible on {}, {} refined",
            counted(pht.visible, "PHT"),
            counted(pht.pixels, "pixel"),
            pht.refined
        );
        vec![tested, bounds]
    }

    fn refinement_lines(&self) -> Vec<String> {
        let refinement = &self.inspection.refinement;
        let pixels = counted(refinement.per_pixel_pixels, "pixel");
        if !self.args.method.is_progressive() {
            return vec![format!("  per pixel   {pixels}")];
        }
        let levels = refinement.leaves_by_level.iter().enumerate();
        let levels = levels.map(|(level, count)| format!("{level}: {count}"));
        let skipped = self.stats.skipped.entries().into_iter();
        let skipped = skipped
            .filter(|&(_, count)| count > 0)
            .map(|(name, count)| format!("{} {count}", label(name)));
        let skipped = Some(list(skipped)).filter(|text| !text.is_empty());
        vec![
            format!(
                "  refinement  {} subdivided, {} proved right as they were, {} waiting to be painted",
                counted(refinement.triangles_subdivided, "triangle"),
                refinement.triangles_proved,
                counted(refinement.leaves_not_painted, "leaf"),
            ),
            format!("  levels      {}", list(levels)),
            format!(
                "  per pixel   {pixels} in {}",
                counted(refinement.per_pixel_leaves, "leaf")
            ),
            format!(
                "  skipped     {}",
                skipped.unwrap_or_else(|| "nothing".to_owned())
            ),
        ]
    }
}

fn describe(material: &MaterialCounts) -> String {
    let specular = if material.is_specular {
        format!("shininess {}", material.shininess)
    } else {
        "matte".to_owned()
    };
    let sides = if material.two_sided {
        ", two-sided"
    } else {
        ""
    };
    format!(
        "{specular}{sides}: {}, {} visible",
        counted(material.triangles, "triangle"),
        material.visible_triangles
    )
}

/// A number of things by their name.
fn counted(count: u64, name: &str) -> String {
    let plural = match name {
        "vertex" => "vertices".to_owned(),
        "leaf" => "leaves".to_owned(),
        _ => format!("{name}s"),
    };
    format!("{count} {}", if count == 1 { name } else { &plural })
}
