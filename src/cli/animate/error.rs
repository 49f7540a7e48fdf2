//! How far the frames of a film are from the Phong reference, and how much that changes from one to the next.

use crate::cli::Failure;
use specula::frame::Engine;
use specula::measure::{ErrorReport, ReferenceImage, flicker};
use specula::output::Frame;
use specula::scene::Scene;

/// What was measured of a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    pub(super) error: ErrorReport,
    /// In codes; `None` if the frame before was not measured.
    pub(super) flicker: Option<f64>,
}

/// Compares frames, and remembers the last one.
#[derive(Debug, Default)]
pub(super) struct Comparison {
    /// With its number and its reference.
    last: Option<(u32, Frame, ReferenceImage)>,
}

impl Comparison {
    /// Compares the frame of that number, which `engine` has just rendered, with its reference.
    pub(super) fn measure(
        &mut self,
        number: u32,
        engine: &Engine,
        scene: &Scene,
        frame: &Frame,
    ) -> Result<Measured, Failure> {
        let mismatch = |error: specula::measure::Mismatch| Failure::runtime(error.to_string());
        let world = engine.world();
        let view = world
            .view(scene.camera(), frame.width(), frame.height())
            .with_encoding(engine.encoding());
        let reference = ReferenceImage::render(world, &view, engine.threads());
        let error = ErrorReport::compare(frame, &reference).map_err(mismatch)?;
        let last = self.last.as_ref();
        let flicker = last
            .filter(|(last, _, _)| last + 1 == number)
            .map(|(_, before, old)| flicker((before, old), (frame, &reference)))
            .transpose()
            .map_err(mismatch)?;
        self.last = Some((number, frame.clone(), reference));
        Ok(Measured { error, flicker })
    }
}
