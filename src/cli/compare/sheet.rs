//! The contact sheet: a cell for the reference and for each method, in a grid.
//!
//! A cell is, from the top, a name with the frame time, the image, the errors of its pixels, and a line of numbers. The
//! reference has no errors; the scale of the others takes their place.

use super::canvas::{Canvas, Rgb, TextStyle};
use super::heat::{NOTHING, Scale};
use super::thumbnail::Reduction;
use crate::cli::machine::Facts;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight};
use specula::measure::{Calibration, ReferenceImage, SweepBudget, SweepRow};
use specula::output::Frame;

const PAPER: Rgb = [24, 24, 28];
const INK: Rgb = [236, 236, 236];
const FAINT_INK: Rgb = [166, 166, 172];
const LATE_INK: Rgb = [255, 176, 64];

const TITLE: TextStyle = TextStyle {
    weight: FontWeight::Bold,
    height: RasterHeight::Size24,
    color: INK,
};
const NAME: TextStyle = TextStyle {
    weight: FontWeight::Bold,
    height: RasterHeight::Size16,
    color: INK,
};
const SMALL: TextStyle = TextStyle {
    weight: FontWeight::Regular,
    height: RasterHeight::Size16,
    color: FAINT_INK,
};

/// Space at the edges and between cells, in pixels.
const GAP: u32 = 24;
/// Height of the sheet's title with the lines below.
const HEADER: u32 = 84;
/// Height of a cell's lines above and below its images.
const LINE: u32 = 24;
/// Space between the image and the errors.
const SEAM: u32 = 4;
/// Room for the longest line in a cell.
const NARROWEST: u32 = 470;
/// Room for the scale and its texts.
const LOWEST: u32 = 150;
/// How many cells there may be in a row, the best number first where it makes no difference.
const COLUMNS: [usize; 2] = [3, 4];

/// A method's image.
#[derive(Debug)]
pub(super) struct Cell<'a> {
    pub(super) row: &'a SweepRow,
    pub(super) frame: &'a Frame,
    /// Of each pixel, in codes.
    pub(super) errors: Vec<Option<f64>>,
}

/// What is on the sheet.
#[derive(Debug)]
pub(super) struct Sheet<'a> {
    pub(super) title: &'a str,
    pub(super) reference: &'a ReferenceImage,
    pub(super) cells: Vec<Cell<'a>>,
    pub(super) budget: SweepBudget,
    pub(super) calibration: Option<&'a Calibration>,
    pub(super) facts: &'a Facts,
    /// Why times are not to be trusted, if so.
    pub(super) warning: Option<String>,
}

/// Where things are on the sheet, in pixels.
#[derive(Clone, Copy, Debug)]
struct Layout {
    reduction: Reduction,
    columns: usize,
    /// Width of a cell, and height of each of its two images with the space that they have.
    cell: [u32; 2],
}

impl Layout {
    fn new(size: [u32; 2], cells: usize) -> Self {
        let reduction = Reduction::of(size);
        let [width, height] = reduction.shown();
        Self {
            reduction,
            columns: COLUMNS
                .into_iter()
                .min_by_key(|columns| cells.next_multiple_of(*columns))
                .map_or(1, |columns| columns.min(cells.max(1))),
            cell: [width.max(NARROWEST), height.max(LOWEST)],
        }
    }

    /// Height of a whole cell.
    fn pitch(&self) -> u32 {
        2 * LINE + 2 * self.cell[1] + SEAM + GAP
    }

    /// The sheet's size with that many cells.
    fn size(&self, cells: usize) -> [u32; 2] {
        let rows = cells.div_ceil(self.columns) as u32;
        [
            GAP + self.columns as u32 * (self.cell[0] + GAP),
            GAP + HEADER + rows * self.pitch(),
        ]
    }

    /// The upper left corner of a cell.
    fn corner(&self, index: usize) -> [u32; 2] {
        let (row, column) = (index / self.columns, index % self.columns);
        [
            GAP + column as u32 * (self.cell[0] + GAP),
            GAP + HEADER + row as u32 * self.pitch(),
        ]
    }
}

impl Sheet<'_> {
    pub(super) fn draw(&self) -> Frame {
        let count = 1 + self.cells.len();
        let layout = Layout::new([self.reference.width, self.reference.height], count);
        let [width, height] = layout.size(count);
        let mut canvas = Canvas::new(width, height, PAPER);
        self.draw_header(&mut canvas);

        let maps: Vec<Vec<Option<f64>>> = self
            .cells
            .iter()
            .map(|cell| layout.reduction.errors(&cell.errors))
            .collect();
        let scale = Scale::of(maps.iter().flatten());
        self.draw_reference(&mut canvas, &layout, &scale);
        for (index, (cell, map)) in (1..).zip(self.cells.iter().zip(&maps)) {
            draw_cell(&mut canvas, &layout, layout.corner(index), cell);
            let [left, top] = layout.corner(index);
            let below = [left, top + LINE + layout.cell[1] + SEAM];
            let shown = layout.reduction.shown();
            canvas.draw(below, shown, |x, y| {
                scale.color(map[(y * shown[0] + x) as usize])
            });
        }
        canvas.into_frame()
    }

    fn draw_header(&self, canvas: &mut Canvas) {
        let millis = self.budget.millis;
        let time = match (self.calibration, self.budget.fraction) {
            (Some(times), Some(fraction)) => format!(
                "{millis:.2} ms a frame: G + {fraction} (P - G), with Gouraud G = {:.2} ms, Phong P = {:.2} ms",
                times.gouraud_ms, times.phong_ms
            ),
            _ => format!("{millis:.2} ms a frame"),
        };
        canvas.text([GAP, GAP - 4], self.title, TITLE);
        canvas.text(
            [GAP, GAP + 28],
            &time,
            TextStyle {
                color: INK,
                ..SMALL
            },
        );
        let facts = self.facts.line();
        canvas.text([GAP, GAP + 50], &facts, SMALL);
        if let Some(warning) = &self.warning {
            let color = LATE_INK;
            let beside = [2 * GAP + SMALL.width(&facts), GAP + 50];
            canvas.text(beside, warning, TextStyle { color, ..SMALL });
        }
    }

    /// The reference, and the scale of errors.
    fn draw_reference(&self, canvas: &mut Canvas, layout: &Layout, scale: &Scale) {
        let [left, top] = layout.corner(0);
        let [width, height] = layout.cell;
        let right = left + width;
        canvas.text([left, top], "reference", NAME);
        canvas.text_to([right, top], "Phong in 64-bit floats", SMALL);
        draw_image(canvas, layout, [left, top + LINE], &self.reference_frame());

        let top = top + LINE + height + SEAM;
        canvas.text(
            [left, top + 4],
            "Error of a pixel: RMS of its channels, in codes of 255",
            SMALL,
        );
        let bar = [left, top + 32];
        canvas.draw(bar, [width, 28], |x, _| {
            scale.color_at(f64::from(x) / f64::from(width.max(2) - 1))
        });
        let ticks = scale.ticks();
        let last = ticks.len() - 1;
        for (index, (share, label)) in ticks.into_iter().enumerate() {
            let x = left + (share * f64::from(width)).round() as u32;
            let at = [x, top + 64];
            match index {
                0 => canvas.text(at, &label, SMALL),
                _ if index == last => canvas.text_to(at, &label, SMALL),
                _ => canvas.text_around(at, &label, SMALL),
            }
        }
        canvas.draw([left, top + 96], [28, 16], |_, _| NOTHING);
        canvas.text([left + 38, top + 95], "not covered, or not compared", SMALL);
        let side = layout.reduction.side;
        if side > 1 {
            let text = format!("Shown at 1/{side}: light averaged, errors by root mean square");
            canvas.text([left, top + 122], &text, SMALL);
        }
    }

    fn reference_frame(&self) -> Frame {
        let mut frame = Frame::new(self.reference.width, self.reference.height);
        frame.set_encoding(self.reference.encoding);
        for (pixel, &[r, g, b]) in frame.pixels_mut().iter_mut().zip(&self.reference.pixels) {
            *pixel = [r, g, b, 255];
        }
        frame
    }
}

/// A method's image and numbers.
fn draw_cell(canvas: &mut Canvas, layout: &Layout, [left, top]: [u32; 2], cell: &Cell<'_>) {
    let [width, height] = layout.cell;
    let right = left + width;
    let row = cell.row;
    canvas.text([left, top], row.method, NAME);
    let (time, color) = if row.overshoot_ms > 0.0 {
        let late = format!("{:.2} ms, {:.2} late", row.frame_ms, row.overshoot_ms);
        (late, LATE_INK)
    } else {
        (format!("{:.2} ms", row.frame_ms), FAINT_INK)
    };
    canvas.text_to([right, top], &time, TextStyle { color, ..SMALL });
    draw_image(canvas, layout, [left, top + LINE], cell.frame);

    let error = &row.error;
    let psnr = if error.psnr_db.is_finite() {
        format!("PSNR {:.1} dB", error.psnr_db)
    } else {
        "equal".to_owned()
    };
    let numbers = format!(
        "RMSE {:.3}  {psnr}  max {}  p99 {}",
        error.rmse, error.max, error.p99
    );
    let below = top + LINE + 2 * height + SEAM + 6;
    canvas.text(
        [left, below],
        &numbers,
        TextStyle {
            color: INK,
            ..SMALL
        },
    );
}

fn draw_image(canvas: &mut Canvas, layout: &Layout, corner: [u32; 2], frame: &Frame) {
    let shown = layout.reduction.shown();
    let image = layout.reduction.image(frame);
    canvas.draw(corner, shown, |x, y| image[(y * shown[0] + x) as usize]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_as_full_as_they_can_be() {
        let columns =
            [0, 1, 2, 3, 4, 5, 6, 7, 8, 9].map(|cells| Layout::new([9, 9], cells).columns);
        assert_eq!(columns, [1, 1, 2, 3, 4, 3, 3, 4, 4, 3]);
    }

    #[test]
    fn cells_lie_inside_the_sheet_and_apart() {
        for (size, cells) in [
            ([1280, 720], 6),
            ([40, 30], 2),
            ([1920, 1080], 9),
            ([1, 900], 1),
        ] {
            let layout = Layout::new(size, cells);
            let [width, height] = layout.size(cells);
            let corners: Vec<[u32; 2]> = (0..cells).map(|index| layout.corner(index)).collect();
            for (index, [left, top]) in corners.iter().enumerate() {
                assert!(left + layout.cell[0] + GAP <= width, "{size:?}");
                assert!(top + layout.pitch() <= height, "{size:?}");
                for [other_left, other_top] in &corners[..index] {
                    let apart = left.abs_diff(*other_left) >= layout.cell[0]
                        || top.abs_diff(*other_top) >= layout.pitch();
                    assert!(apart, "{size:?}");
                }
            }
        }
    }
}
