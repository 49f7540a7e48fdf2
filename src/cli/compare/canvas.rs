//! An image with rectangles and text on it.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use specula::output::Frame;

/// A colour, in sRGB codes.
pub(super) type Rgb = [u8; 3];

/// How text looks.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextStyle {
    pub(super) weight: FontWeight,
    pub(super) height: RasterHeight,
    pub(super) color: Rgb,
}

impl TextStyle {
    /// The width of a text in pixels.
    pub(super) fn width(&self, text: &str) -> u32 {
        (text.chars().count() * get_raster_width(self.weight, self.height)) as u32
    }
}

/// An image being drawn. What lies outside is cut off.
#[derive(Debug)]
pub(super) struct Canvas {
    frame: Frame,
}

impl Canvas {
    pub(super) fn new(width: u32, height: u32, color: Rgb) -> Self {
        let mut frame = Frame::new(width, height);
        frame.pixels_mut().fill(opaque(color));
        Self { frame }
    }

    pub(super) fn into_frame(self) -> Frame {
        self.frame
    }

    /// Colours a rectangle pixel by pixel; `color` is asked for places relative to its upper left corner.
    pub(super) fn draw(
        &mut self,
        [left, top]: [u32; 2],
        [width, height]: [u32; 2],
        mut color: impl FnMut(u32, u32) -> Rgb,
    ) {
        let (own_width, own_height) = (self.frame.width(), self.frame.height());
        let pixels = self.frame.pixels_mut();
        for y in 0..height.min(own_height.saturating_sub(top)) {
            for x in 0..width.min(own_width.saturating_sub(left)) {
                let index = (top + y) as usize * own_width as usize + (left + x) as usize;
                pixels[index] = opaque(color(x, y));
            }
        }
    }

    /// Writes text to the right of and below a place. Characters that the font lacks are left blank.
    pub(super) fn text(&mut self, [left, top]: [u32; 2], text: &str, style: TextStyle) {
        let (own_width, own_height) = (self.frame.width(), self.frame.height());
        let advance = get_raster_width(style.weight, style.height) as u32;
        let pixels = self.frame.pixels_mut();
        for (column, character) in (0..).zip(text.chars()) {
            let Some(raster) = get_raster(character, style.weight, style.height) else {
                continue;
            };
            for (y, row) in (top..own_height).zip(raster.rows()) {
                for (x, &coverage) in (left + column * advance..own_width).zip(row) {
                    let pixel = &mut pixels[y as usize * own_width as usize + x as usize];
                    for (own, ink) in pixel.iter_mut().zip(style.color) {
                        *own = blend(*own, ink, coverage);
                    }
                }
            }
        }
    }

    /// Writes text that ends at `right`.
    pub(super) fn text_to(&mut self, [right, top]: [u32; 2], text: &str, style: TextStyle) {
        let left = right.saturating_sub(style.width(text));
        self.text([left, top], text, style);
    }

    /// Writes text whose middle is at `middle`.
    pub(super) fn text_around(&mut self, [middle, top]: [u32; 2], text: &str, style: TextStyle) {
        let left = middle.saturating_sub(style.width(text) / 2);
        self.text([left, top], text, style);
    }
}

fn opaque([r, g, b]: Rgb) -> [u8; 4] {
    [r, g, b, 255]
}

/// `below`, to a share of `coverage / 255` covered by `ink`.
fn blend(below: u8, ink: u8, coverage: u8) -> u8 {
    let [below, ink, coverage] = [below, ink, coverage].map(u32::from);
    ((below * (255 - coverage) + ink * coverage + 127) / 255) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_cut_off() {
        let style = TextStyle {
            weight: FontWeight::Regular,
            height: RasterHeight::Size16,
            color: [255; 3],
        };
        let mut canvas = Canvas::new(20, 10, [0; 3]);
        canvas.text([15, 2], "text", style);
        canvas.text_to([3, 50], "text", style);
        canvas.draw([18, 8], [9, 9], |_, _| [9; 3]);
        let frame = canvas.into_frame();
        let pixels = frame.pixels();
        assert_eq!(pixels[9 * 20 + 19], [9, 9, 9, 255]);
        assert!(pixels.iter().any(|pixel| pixel[0] > 100), "some text");
        assert!(pixels.iter().all(|pixel| pixel[3] == 255));
    }

    #[test]
    fn ink_covers_in_proportion() {
        assert_eq!(blend(10, 200, 0), 10);
        assert_eq!(blend(10, 200, 255), 200);
        assert_eq!(blend(0, 255, 128), 128);
    }
}
