//! Highlight subdivision (section 3.1): a vertex on the centre of each highlight, and more on the edges that meet there.
//!
//! A [centre](super::centre) inside divides the triangle in three. Where it is outside, the triangle is divided in two at the point of an edge that
//! is nearest to it. As Gouraud shading would spread the highlight over all parts at that vertex, the middle of each edge
//! that ends there becomes a vertex, too, where the intensity differs too much from the interpolated one; and so on for the part that
//! still has the highlight, until it does not.

use super::PaperPart;
use super::centre::Centre;
use crate::geometry::Bary;

/// Centres are rounded to multiples of so many steps of the grid, a 512th of the triangle, so that the edges that end there can be halved so
/// often exactly.
const STEP: u16 = 1 << MOST_ROUNDS;

/// Most rounds of division of edges.
const MOST_ROUNDS: u32 = 6;

/// Most parts of a triangle, lest hundreds of lights make too many.
const MOST_PARTS: usize = 1 << 12;

/// Illuminates points of the triangle, given by barycentric coordinates: appends a linear colour for each.
pub type Shade<'a> = &'a mut dyn FnMut(&[Bary], &mut Vec<[f32; 3]>);

/// A part in the making.
#[derive(Clone, Copy, Debug)]
struct Piece {
    corners: [Bary; 3],
    colours: [[f32; 3]; 3],
    /// The corner that has a highlight, as long as its edges are to be looked at.
    hot: Option<usize>,
}

impl Piece {
    /// Without the corner `k`, with a point in its place.
    fn with_corner(&self, k: usize, point: Bary, colour: [f32; 3], hot: Option<usize>) -> Self {
        let (mut corners, mut colours) = (self.corners, self.colours);
        corners[k] = point;
        colours[k] = colour;
        Self {
            corners,
            colours,
            hot,
        }
    }
}

/// Workspace for one triangle after the other.
#[derive(Clone, Debug, Default)]
pub struct HighlightSubdivision {
    pieces: Vec<Piece>,
    next: Vec<Piece>,
    points: Vec<Bary>,
    colours: Vec<[f32; 3]>,
}

impl HighlightSubdivision {
    /// Makes room for what a triangle needs as a rule.
    pub fn reserve(&mut self) {
        self.pieces.reserve(MOST_PARTS);
        self.next.reserve(MOST_PARTS);
        self.points.reserve(2 * MOST_PARTS);
        self.colours.reserve(2 * MOST_PARTS);
    }

    /// Divides a triangle of the world, whose corners have these colours, at the centres of its highlights; `difference` is
    /// [`PaperRule::difference`](super::PaperRule::difference). Calls `take` with each part. Without centres that is the triangle as it is.
    pub fn divide(
        &mut self,
        triangle: u32,
        colours: [[f32; 3]; 3],
        centres: impl Iterator<Item = Centre>,
        difference: f32,
        shade: Shade<'_>,
        mut take: impl FnMut(PaperPart),
    ) {
        self.pieces.clear();
        self.pieces.push(Piece {
            corners: Bary::ROOT,
            colours,
            hot: None,
        });
        for centre in centres {
            let (Centre::Inside(weights) | Centre::OnEdge(weights)) = centre;
            self.insert(on_grid(weights), shade);
        }
        for _ in 0..MOST_ROUNDS {
            if !self.divide_edges(difference, shade) {
                break;
            }
        }
        for piece in &self.pieces {
            take(PaperPart {
                triangle,
                corners: piece.corners,
                colours: piece.colours,
            });
        }
    }

    /// Makes a point the corner of all pieces that it lies in or on.
    fn insert(&mut self, point: Bary, shade: Shade<'_>) {
        self.colours.clear();
        shade(&[point], &mut self.colours);
        let colour = self.colours[0];
        self.next.clear();
        for piece in &self.pieces {
            let replaced = |k: usize| piece.with_corner(k, point, colour, Some(k));
            let parts = [0, 1, 2].map(|k| Bary::doubled_area(replaced(k).corners));
            if parts.iter().any(|&area| area < 0) {
                self.next.push(*piece);
            } else if let Some(k) = (0..3).find(|&k| piece.corners[k] == point) {
                self.next.push(Piece {
                    hot: Some(k),
                    ..*piece
                });
            } else {
                let pieces = (0..3).filter(|&k| parts[k] > 0).map(replaced);
                self.next.extend(pieces);
            }
        }
        std::mem::swap(&mut self.pieces, &mut self.next);
    }

    /// Looks at the edges that end in highlights, and divides at most one of each piece. False if there was none to be divided.
    fn divide_edges(&mut self, difference: f32, shade: Shade<'_>) -> bool {
        self.points.clear();
        self.colours.clear();
        for piece in &self.pieces {
            if let Some(hot) = piece.hot {
                let others = [1, 2].map(|k| piece.corners[(hot + k) % 3]);
                self.points
                    .extend(others.map(|c| middle(piece.corners[hot], c)));
            }
        }
        shade(&self.points, &mut self.colours);
        self.next.clear();
        let mut found = self.points.iter().zip(&self.colours);
        let mut has_divided = false;
        let mut room = MOST_PARTS.saturating_sub(self.pieces.len());
        for piece in &mut self.pieces {
            let Some(hot) = piece.hot else {
                self.next.push(*piece);
                continue;
            };
            let candidates = [found.next(), found.next()];
            let divided = [1, 2]
                .into_iter()
                .zip(candidates)
                .find_map(|(k, candidate)| {
                    let (&point, &colour) = candidate?;
                    let other = (hot + k) % 3;
                    let ends = [piece.colours[hot], piece.colours[other]];
                    let is_needed = room > 0 && relative_difference(ends, colour) > difference;
                    is_needed
                        .then(|| divide(piece, hot, other, point, colour))
                        .flatten()
                });
            match divided {
                Some(two) => {
                    self.next.extend(two);
                    has_divided = true;
                    room -= 1;
                }
                None => self.next.push(Piece {
                    hot: None,
                    ..*piece
                }),
            }
        }
        std::mem::swap(&mut self.pieces, &mut self.next);
        has_divided
    }
}

/// The two halves of a piece that is divided at a point of the edge between two of its corners, the first of which stays hot;
/// `None` where the grid ends.
fn divide(
    piece: &Piece,
    hot: usize,
    other: usize,
    point: Bary,
    colour: [f32; 3],
) -> Option<[Piece; 2]> {
    let halves = [
        piece.with_corner(other, point, colour, Some(hot)),
        piece.with_corner(hot, point, colour, None),
    ];
    let areas = halves.map(|half| Bary::doubled_area(half.corners));
    let whole = Bary::doubled_area(piece.corners);
    (areas.iter().all(|&area| area > 0) && areas[0] + areas[1] == whole).then_some(halves)
}

/// How much the intensity in the middle of an edge differs from the interpolated one, as a share of the larger.
fn relative_difference([a, b]: [[f32; 3]; 2], real: [f32; 3]) -> f32 {
    let intensity = |[r, g, b]: [f32; 3]| (r + g + b) / 3.0;
    let (real, interpolated) = (intensity(real), (intensity(a) + intensity(b)) * 0.5);
    let larger = real.abs().max(interpolated.abs());
    if larger > 0.0 {
        (real - interpolated).abs() / larger
    } else {
        0.0
    }
}

/// The grid's point next to the middle of two, or either of them where it ends.
fn middle(a: Bary, b: Bary) -> Bary {
    Bary::midpoint(a, b).unwrap_or(a)
}

/// The point of a [coarser grid](STEP) next to one with such weights, on the edges of the triangle that it is on.
fn on_grid([w0, w1, w2]: [f64; 3]) -> Bary {
    let steps = f64::from(Bary::UNIT / STEP);
    let round = |w: f64| (w * steps).round().clamp(0.0, steps) as u16 * STEP;
    let b1 = round(w1);
    let rest = Bary::UNIT - b1;
    let b2 = if w0 < 1e-12 {
        rest
    } else {
        round(w2).min(rest)
    };
    Bary { b1, b2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bright near a point, dark elsewhere.
    fn peak(at: [f32; 3]) -> impl FnMut(&[Bary], &mut Vec<[f32; 3]>) {
        move |points, colours| {
            for point in points {
                let w = point.weights();
                let d: f32 = (0..3).map(|i| (w[i] - at[i]).powi(2)).sum();
                colours.push([0.1 + (-40.0 * d).exp(); 3]);
            }
        }
    }

    fn divide(centres: &[Centre], difference: f32) -> Vec<PaperPart> {
        let mut shade = peak([0.3, 0.3, 0.4]);
        let mut corners = Vec::new();
        shade(&Bary::ROOT, &mut corners);
        let corners = [corners[0], corners[1], corners[2]];
        let mut parts = Vec::new();
        HighlightSubdivision::default().divide(
            3,
            corners,
            centres.iter().copied(),
            difference,
            &mut shade,
            |part| parts.push(part),
        );
        let area: i32 = parts.iter().map(|p| Bary::doubled_area(p.corners)).sum();
        assert_eq!(area, 1 << 30, "{parts:?}");
        assert!(parts.iter().all(|p| Bary::doubled_area(p.corners) > 0));
        parts
    }

    #[test]
    fn a_centre_inside_makes_three_and_one_on_an_edge_two() {
        let inside = Centre::Inside([0.3, 0.3, 0.4]);
        let parts = divide(&[inside], f32::INFINITY);
        assert_eq!(parts.len(), 3);
        let bright = |p: &PaperPart| p.colours.iter().filter(|c| c[0] > 1.0).count();
        assert!(parts.iter().all(|p| bright(p) == 1));
        assert_eq!(
            divide(&[Centre::OnEdge([0.0, 0.4, 0.6])], f32::INFINITY).len(),
            2
        );
        assert_eq!(
            divide(&[Centre::OnEdge([0.5, 0.0, 0.5])], f32::INFINITY).len(),
            2
        );
        assert_eq!(
            divide(&[Centre::OnEdge([1.0, 0.0, 0.0])], f32::INFINITY).len(),
            1
        );
        assert_eq!(divide(&[], 0.0).len(), 1);
        // The second centre is on an edge between two parts of the first.
        let second = Centre::Inside([0.65, 0.15, 0.2]);
        assert!((4..=5).contains(&divide(&[inside, second], f32::INFINITY).len()));
    }

    #[test]
    fn edges_are_divided_until_the_difference_is_small() {
        let centre = [Centre::Inside([0.3, 0.3, 0.4])];
        let counts = [2.0, 0.5, 0.3, 0.1, 0.0].map(|d| divide(&centre, d).len());
        assert_eq!(counts[0], 3);
        assert!(counts.is_sorted() && counts[2] > 6, "{counts:?}");
        // It ends, even if no difference is small enough.
        assert!(counts[4] <= MOST_PARTS, "{counts:?}");
        assert!(divide(&centre, f32::NAN).len() == 3);
    }

    #[test]
    fn differences_are_shares_of_the_larger_intensity() {
        let difference =
            |a: f32, b: f32, real: f32| relative_difference([[a; 3], [b; 3]], [real; 3]);
        assert!((difference(0.0, 1.0, 1.0) - 0.5).abs() < 1e-6);
        assert!((difference(0.0, 1.0, 0.25) - 0.5).abs() < 1e-6);
        assert_eq!(difference(0.0, 0.0, 0.0), 0.0);
    }
}
