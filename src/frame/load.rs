//! How much work a first image is, in nominal nanoseconds: what its time is predicted from.

use super::Method;
use crate::backend::Backend;
use crate::output::Target;
use crate::scene::{View, World};
use crate::schedule::{CostModel, Forecast, Kind, Load, cost};

/// What a first image consists of, as far as is known before it is drawn: as the one before it, or a guess.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ImageLoad {
    /// Clusters of the scene.
    pub(super) clusters: f64,
    /// Triangles handed to the rasterizer.
    pub(super) triangles: f64,
    /// Those that own a pixel.
    pub(super) visible: f64,
    /// Share of the image's pixels that something covers.
    pub(super) coverage: f64,
}

/// Work ends so much before it has to: what comes after it does not always take the same time.
pub(super) const MARGIN_MS: f64 = 0.03;

/// Vertices per visible triangle, most of them being shared.
const VERTICES_PER_TRIANGLE: f64 = 0.6;

impl ImageLoad {
    /// Of a world that has not been drawn: half of its triangles face the viewer, every other of these owns a pixel, and three
    /// quarters of the pixels are covered.
    pub(super) fn guess(world: &World) -> Self {
        let triangles = world.triangles.len() as f64 * 0.5;
        Self {
            clusters: world.clusters.len() as f64,
            triangles,
            visible: triangles * 0.5,
            coverage: 0.75,
        }
    }

    fn covered(&self, view: &View) -> f64 {
        self.coverage * pixels(view)
    }

    pub(super) fn cull(&self) -> Load {
        Load::of_items(self.clusters * f64::from(cost::CULL_CLUSTER_NS))
    }

    pub(super) fn raster(&self, view: &View) -> Load {
        Load {
            items_ns: self.triangles * f64::from(cost::RASTER_TRIANGLE_NS),
            pixels_ns: pixels(view) * f64::from(cost::RASTER_PIXEL_NS)
                + self.covered(view) * f64::from(cost::RASTER_COVERED_NS),
        }
    }

    /// What has to be illuminated before pixels get their colours.
    pub(super) fn shade(&self, method: Method, lights: usize) -> Load {
        let points = match method {
            m if m.shades_first_image_per_pixel() => 0.0,
            Method::Flat => self.visible,
            _ => self.visible * VERTICES_PER_TRIANGLE,
        };
        let vertex = f64::from(cost::vertices(1.0, lights)) + f64::from(cost::FIND_VERTEX_NS);
        Load::of_items(points * vertex)
    }

    pub(super) fn resolve(&self, method: Method, lights: usize, view: &View) -> Load {
        let pixel = if method.shades_first_image_per_pixel() {
            cost::phong_pixel(lights)
        } else {
            cost::RESOLVE_PIXEL_NS
        };
        Load {
            items_ns: self.visible * f64::from(cost::RESOLVE_TRIANGLE_NS),
            pixels_ns: self.covered(view) * f64::from(pixel),
        }
    }

    /// What the first image of `view`, and handing it over to a target of the full size, will take, somewhat cautiously, given that it
    /// is drawn at `divisor`.
    pub(super) fn forecast(
        &self,
        costs: &CostModel,
        method: Method,
        lights: usize,
        view: &View,
        divisor: u32,
    ) -> Forecast {
        let small = view.reduced(divisor);
        // With less caution than where something is late if it takes longer: here a first image goes on in the next frame then.
        let ms = |kind, load| {
            0.5 * (costs.predict_ms(kind, load) + costs.predict_at_most_ms(kind, load))
        };
        let ending_ms = ms(Kind::Resolve, self.resolve(method, lights, &small))
            + handing_over_ms(costs, [view.width, view.height], divisor);
        let whole_ms = ending_ms
            + ms(Kind::Cull, self.cull())
            + ms(Kind::Raster, self.raster(&small))
            + ms(Kind::Shade, self.shade(method, lights));
        Forecast {
            whole_ms,
            ending_ms,
        }
    }
}

fn pixels(view: &View) -> f64 {
    f64::from(view.width) * f64::from(view.height)
}

/// Milliseconds that handing over all pixels of an image will probably not exceed.
pub(super) fn handing_over_ms(costs: &CostModel, [width, height]: [u32; 2], divisor: u32) -> f64 {
    pixels_ms(costs, u64::from(width) * u64::from(height), divisor)
}

/// Milliseconds that handing over so many pixels of an image of that divisor will probably not exceed.
pub(super) fn pixels_ms(costs: &CostModel, pixels: u64, divisor: u32) -> f64 {
    if divisor == 1 {
        costs.predict_at_most_ms(Kind::Present, present(pixels))
    } else {
        costs.predict_at_most_ms(Kind::Enlarge, enlarge(pixels as f64))
    }
}

/// Milliseconds that handing the backend's image over to `target` will probably not exceed, and a margin; `as_a_whole` if all of it will
/// have changed by then. In spare time there is no target.
pub(super) fn pending_ms(
    costs: &CostModel,
    backend: &dyn Backend,
    divisor: u32,
    target: Option<&Target<'_>>,
    as_a_whole: bool,
) -> f64 {
    let Some(target) = target else {
        return MARGIN_MS;
    };
    let ms = if divisor == 1 && !as_a_whole {
        pixels_ms(costs, backend.pending_pixels(target), 1)
    } else {
        // Enlarged images are written as a whole.
        handing_over_ms(costs, [target.width(), target.height()], divisor)
    };
    ms + MARGIN_MS
}

/// Handing over `pixels` pixels.
pub(super) fn present(pixels: u64) -> Load {
    Load::of_pixels(pixels as f64 * f64::from(cost::PRESENT_PIXEL_NS))
}

/// Enlarging an image to `pixels` pixels.
pub(super) fn enlarge(pixels: f64) -> Load {
    Load::of_pixels(pixels * f64::from(cost::ENLARGE_PIXEL_NS))
}
