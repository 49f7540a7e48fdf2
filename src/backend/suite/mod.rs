//! Checks that a [`Backend`] keeps its [contract](Backend#contract), for every implementation, also those outside of
//! this crate.
//!
//! One line in a test runs them all; what depends on [`Capabilities`] is checked as far as it is declared:
//!
//! ```
//! use specula::backend::{skia::SkiaBackend, suite};
//!
//! suite::check(|| Box::new(SkiaBackend::new()));
//! ```
//!
//! Expectations come from slow and obvious references: the scalar raster rules of
//! [`geometry::screen`](crate::geometry::screen), scalar interpolation, and the illumination equation in `f64`. A
//! backend without ids is compared away from edges only, where no other triangle's pixel is near.
//!
//! A check that fails panics and says what it expected. All of them take about a second.

mod colour;
mod coverage;
mod fixture;
mod presenting;
mod repainting;
mod robustness;
mod turns;

use super::{Backend, Capabilities};
use crate::output::Encoding;
use fixture::Fixture;

/// Runs all checks on backends that `make` makes, each of them new and without an image.
///
/// # Panics
/// When the backend breaks its contract; the message says how.
pub fn check(make: impl Fn() -> Box<dyn Backend>) {
    let fixture = Fixture::new(&make, Encoding::default());
    let Capabilities {
        ids,
        per_pixel,
        interpolation: _,
    } = make().capabilities();

    coverage::the_nearest_triangle_owns_a_pixel(&fixture);
    coverage::triangles_that_share_edges_leave_no_gap(&fixture);
    coverage::only_visible_ranges_are_drawn(&fixture);
    coverage::visible_triangles_and_their_pixels_are_told(&fixture);

    for encoding in Encoding::ALL {
        let fixture = Fixture::new(&make, encoding);
        colour::the_background_is_where_nothing_is(&fixture);
        colour::flat_triangles_have_their_colour(&fixture);
        colour::gouraud_is_interpolated_as_declared(&fixture);
        colour::colours_out_of_range_are_clamped(&fixture);
        if per_pixel {
            colour::phong_is_the_illumination_equation(&fixture);
        }
        if make().capabilities().refines_in_place() {
            repainting::patches_paint_what_their_triangle_owns(&fixture);
        } else {
            repainting::parts_take_the_place_of_their_triangle(&fixture);
        }
    }

    presenting::only_what_is_missing_is_written(&fixture);
    presenting::the_image_before_stays_until_the_next_is_coloured(&fixture);
    presenting::targets_of_any_layout_are_filled(&fixture);
    presenting::a_target_of_another_size_is_left_alone(&fixture);

    if ids {
        coverage::visible_pixels_are_counted(&fixture);
    }

    robustness::images_of_all_sizes_follow_each_other(&fixture);
    robustness::threads_make_no_difference(&fixture);
    robustness::nothing_to_draw_is_drawn(&fixture);
    robustness::odd_numbers_do_no_harm(&fixture);

    turns::turns_make_no_difference(&fixture);
    turns::what_is_given_up_leaves_no_trace(&fixture);
    turns::siblings_draw_the_same(&fixture);
}
