//! Regular subdivision (section 3.2): into four, and four again, by the area of the whole triangle on the screen.

use super::PaperPart;
use crate::geometry::Bary;

/// Most levels: 16,384 parts.
pub const MOST_LEVELS: u32 = 7;

/// Least area in pixels of what is split: parts between pixels would take memory and show nothing.
pub const LEAST_PX: f32 = 1.0;

/// How often a triangle of that area on the screen, in pixels, is split in four: until the parts have less than `threshold_px`, which counts
/// as [`LEAST_PX`] if it is less or not a number. An area that is not a number is none.
#[must_use]
pub fn levels(area_px: f32, threshold_px: f32) -> u32 {
    let threshold_px = threshold_px.max(LEAST_PX);
    let is_small = |&level: &u32| {
        let part = area_px / 4_f32.powi(level as i32);
        part < threshold_px || part.is_nan()
    };
    (0..MOST_LEVELS).find(is_small).unwrap_or(MOST_LEVELS)
}

/// The vertices of a triangle that is split `levels` times, row by row.
pub fn vertices(levels: u32) -> impl Iterator<Item = Bary> {
    let n = 1_u16 << levels;
    let step = Bary::UNIT / n;
    (0..=n).flat_map(move |i| {
        (0..=n - i).map(move |j| Bary {
            b1: i * step,
            b2: j * step,
        })
    })
}

/// The parts of a triangle that is split `levels` times, given the colours of its [`vertices`].
///
/// # Panics
/// When there are fewer colours than vertices.
pub fn parts(
    triangle: u32,
    levels: u32,
    colour: impl Fn(usize) -> [f32; 3],
) -> impl Iterator<Item = PaperPart> {
    let n = 1_u16 << levels;
    let step = Bary::UNIT / n;
    let place = move |i: u16, j: u16| {
        let (i, j, side) = (usize::from(i), usize::from(j), usize::from(n) + 1);
        i * side - i * i.saturating_sub(1) / 2 + j
    };
    let part = move |corners: [(u16, u16); 3]| PaperPart {
        triangle,
        corners: corners.map(|(i, j)| Bary {
            b1: i * step,
            b2: j * step,
        }),
        colours: corners.map(|(i, j)| colour(place(i, j))),
    };
    let cells = (0..n).flat_map(move |i| (0..n - i).map(move |j| (i, j)));
    let corners = cells.flat_map(move |(i, j)| {
        let upright = [(i, j), (i + 1, j), (i, j + 1)];
        let upside_down = [(i + 1, j + 1), (i, j + 1), (i + 1, j)];
        let both = [Some(upright), (i + j + 1 < n).then_some(upside_down)];
        both.into_iter().flatten()
    });
    corners.map(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_as_small_as_asked_for_and_no_smaller() {
        for (area, threshold, want) in [
            (31.9, 32.0, 0),
            (32.0, 32.0, 1),
            (128.0, 32.0, 2),
            (1e9, 32.0, MOST_LEVELS),
            (0.0, 32.0, 0),
            (f32::NAN, 32.0, 0),
            (f32::INFINITY, 32.0, MOST_LEVELS),
            (100.0, f32::INFINITY, 0),
            (100.0, 1e-6, 4),
            (100.0, f32::NAN, 4),
        ] {
            assert_eq!(levels(area, threshold), want, "{area} {threshold}");
        }
    }

    #[test]
    fn parts_divide_the_triangle_and_take_their_vertices_colours() {
        for level in 0..=5 {
            let vertices: Vec<Bary> = vertices(level).collect();
            let colour = |index: usize| {
                let [a, b, c] = vertices[index].weights();
                [a, b, c]
            };
            let parts: Vec<PaperPart> = parts(7, level, colour).collect();
            assert_eq!(parts.len(), 1 << (2 * level));
            for part in &parts {
                assert_eq!(Bary::doubled_area(part.corners), 1 << (30 - 2 * level));
                assert_eq!(part.colours, part.corners.map(Bary::weights));
            }
        }
    }
}
