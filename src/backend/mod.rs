//! A device that can draw Gouraud-shaded triangles.
//!
//! The engine asks a [`Backend`] for an image in two steps, [`rasterize`](Backend::rasterize) (which triangles can be
//! seen, and where?) and [`resolve`](Backend::resolve) (what colour are they?), so that vertices of triangles that
//! cannot be seen are never illuminated. What follows depends on what the backend declares to be [capable
//! of](Capabilities):
//!
//! * With ids and per-pixel shading the first image is drawn at once, and [`repaint`](Backend::repaint) replaces parts
//!   of single triangles as they are refined.
//! * Without either, the engine **refines first** and has everything drawn once, refined triangles and all.
//!
//! The [contract](Backend#contract) is the trait's documentation; [`suite`] checks it for any implementation.
//!
//! | backend | ids | per pixel | interpolates | use |
//! |---|---|---|---|---|
//! | [`software`] | yes | yes | linear light, in perspective | the default: exact coverage, any method |
//! | [`skia`] | no | no | encoded colour, affine on the screen | proves the trait; an independent oracle |
//! | [`recording`] | as what it wraps | | | tests of an engine: writes down all calls |

mod kind;
pub mod recording;
pub mod skia;
pub mod software;
pub mod suite;

pub use kind::BackendKind;

use crate::geometry::{Bary, CurvedTriangles, Quadratic, TriangleSet, Vec3s};
use crate::illumination::ActiveLights;
pub use crate::output::Interpolation;
use crate::output::{Rect, Target};
use crate::parallel::{Exec, Turn};
use crate::scene::{View, World};
use std::fmt::Debug;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// A number that tells a backend from all others of the process, for the [`Stamp`](crate::output::Stamp)s it leaves in
/// frames.
#[must_use]
pub fn new_writer() -> u64 {
    static WRITERS: AtomicU64 = AtomicU64::new(0);
    WRITERS.fetch_add(1, Ordering::Relaxed)
}

/// Width and height, in pixels, of the squares that [`Backend::shade_squares`] shades.
pub const SQUARE_SIDE: u32 = 64;

/// What a backend can do beyond drawing Gouraud triangles, and how it draws those.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capabilities {
    /// It knows which triangle owns each pixel, hence counts visible pixels, and repaints by id.
    pub ids: bool,
    /// It can evaluate the illumination equation at every pixel.
    pub per_pixel: bool,
    /// How it interpolates between the corners of a triangle. Refinement estimates errors against what will be shown,
    /// so a backend that declares the wrong one is refined in the wrong places, or too little.
    pub interpolation: Interpolation,
}

impl Capabilities {
    /// Whether an image can be refined after it has been drawn: by repainting single triangles, some of them per pixel.
    /// Where not, refinement comes first and everything is drawn once.
    #[must_use]
    pub fn refines_in_place(self) -> bool {
        self.ids && self.per_pixel
    }
}

/// What there is to draw.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a> {
    /// The scene.
    pub world: &'a World,
    /// From where.
    pub view: &'a View,
    /// Ranges of triangles that may be visible, ascending and disjoint.
    pub visible: &'a [Range<u32>],
}

/// Counts of one [`Backend::rasterize`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RasterCounts {
    /// Triangles handed in: the sum of `back_facing`, `off_screen` and `drawn`.
    pub submitted: u64,
    /// Those that faced away.
    pub back_facing: u64,
    /// Those outside of the view, or between pixel centres.
    pub off_screen: u64,
    /// Those that had to be clipped.
    pub clipped: u64,
    /// Those left to be drawn.
    pub drawn: u64,
    /// Pixels covered by anything; without ids an estimate, at most the image's.
    pub covered_pixels: u64,
    /// Tiles without any covered pixel, where a backend has such a thing.
    pub background_tiles: u64,
    /// Tiles with covered pixels that were kept from the image before, because nothing moved there.
    pub kept_tiles: u64,
}

/// How the whole image gets its colours.
#[derive(Clone, Copy, Debug)]
pub enum BasePaint<'a> {
    /// Linear colours of the world's vertices, interpolated (those of visible triangles are valid).
    Gouraud(&'a Vec3s),
    /// Like `Gouraud`, but some triangles have curved colours, and at the pixels of others the illumination equation is evaluated, all
    /// lights. Only for backends that refine in place.
    Mixed {
        /// Linear colours of the world's vertices (those of visible triangles are valid).
        colours: &'a Vec3s,
        /// Those that have curved colours.
        curved: &'a CurvedTriangles,
        /// Those that are illuminated at every pixel, whether they are curved or not.
        lit: &'a TriangleSet,
    },
    /// One linear colour for each of the world's triangles (those of visible triangles are valid).
    Flat(&'a Vec3s),
    /// The illumination equation at every pixel, all lights. Only for backends that can shade per pixel.
    Phong,
    /// Like `Gouraud`, but some triangles have been replaced by parts. Only for backends that do not refine in place.
    Refined {
        /// Linear colours of the world's vertices (those of visible triangles are valid).
        colours: &'a Vec3s,
        /// The parts, those of one triangle next to each other, triangles ascending. They are drawn in place of their
        /// triangles, each of which they cover exactly. All triangles are visible ones.
        parts: &'a [RefinedPart],
    },
}

/// A triangle that takes the place of a part of one of the world's.
///
/// Parts that share an edge, of the same triangle or of neighbours, have the same bits for its ends, and no part has a
/// corner of another one inside an edge: a device that draws triangles with shared edges without gaps shows no cracks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RefinedPart {
    /// The world's triangle. Facing and material are its.
    pub triangle: u32,
    /// Corners in world space, counter-clockwise like the triangle itself.
    pub corners: [[f32; 3]; 3],
    /// Linear colours at the corners.
    pub colours: [[f32; 3]; 3],
}

/// A part of one of the world's triangles, to be painted anew.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// The world's triangle.
    pub triangle: u32,
    /// The part's corners in it, counter-clockwise like the triangle itself.
    pub corners: [Bary; 3],
    /// Its colours.
    pub fill: Fill,
    /// Set by the backend: how many pixels were painted.
    pub pixels: u32,
}

/// The colours of a [`Patch`].
#[derive(Clone, Copy, Debug)]
pub enum Fill {
    /// Linear colours at the patch's corners, interpolated.
    Gouraud([[f32; 3]; 3]),
    /// The illumination equation at every pixel.
    Phong {
        /// Terms that are evaluated, besides ambient light.
        lights: ActiveLights,
        /// What to add, over the *whole* triangle: the share of all other terms.
        remainder: Quadratic,
    },
}

/// A device that draws Gouraud-shaded triangles.
///
/// # Contract
///
/// **Order of calls.** An image begins with [`rasterize`](Self::rasterize). Then the queries may be asked, then comes
/// [`resolve`](Self::resolve), any number of times; after the first, [`repaint`](Self::repaint) (only on backends that
/// [refine in place](Capabilities::refines_in_place)) and [`present`](Self::present) in any order. Until the next
/// `rasterize` every call gets the same geometry. `rasterize` may come again at any time, also before `resolve`.
/// [`pending_pixels`](Self::pending_pixels) may be asked at any time.
///
/// **Several calls for one image.** [`rasterize_while`](Self::rasterize_while) and [`resolve_while`](Self::resolve_while) are
/// [turns](Turn) of what `rasterize` and `resolve` do at once, with the same results, bit for bit. Later turns of the same
/// work come with the same geometry and paint; so it is with [`rasterize_moved`](Self::rasterize_moved) and
/// [`resolve_moved`](Self::resolve_moved), which stand in for them where little has changed. Until it is complete, nothing else may be asked but what begins
/// anew: `rasterize`, or the first turn of `rasterize_while`, at any time; `resolve`, or the first turn of `resolve_while`, when
/// the image has been rasterized. Only [`present`](Self::present), and what tells what it would do, may be called at any time: until an
/// image of the same size gets its first colours, the image before it is handed over.
///
/// **What may be assumed.** Indices are in range, `visible` is ascending and disjoint, and the view's sides are at most
/// [`MAX_IMAGE_SIDE`](crate::geometry::screen::MAX_IMAGE_SIDE). The world's triangles and positions do not change
/// during an image; lights, materials, normals and background may, from one `resolve` to the next. Nothing
/// else is promised: coordinates may be anywhere, behind the eye, huge, or no numbers at all; colours may be
/// negative, above 1 or NaN (which counts as black); triangles may have no area; an image may have no pixels.
///
/// **Which triangles, which pixels.** A triangle that turns its back to the viewer is not drawn; a surface with two
/// sides has triangles for both. What lies outside of the near and far planes is not drawn. A pixel is covered when its centre lies inside
/// the projected triangle; within a fraction of a pixel of an edge a backend without ids may decide otherwise, but
/// triangles that share an edge leave no pixel out between them. A backend *with ids* decides exactly as
/// [`geometry::screen`](crate::geometry::screen) does, and there the nearest triangle owns the pixel; without ids,
/// triangles that intersect or overlap cyclically may hide each other wrongly. A pixel that nothing covers shows the
/// world's background, encoded.
///
/// **Colours.** Pixels are 8-bit, in the [encoding](View::encoding) of the view, and opaque. Between the corners of a triangle colours are interpolated as declared
/// by [`Interpolation`], within two codes, rounding included. With ids a patch's colours are interpolated over the
/// patch.
///
/// **Presenting.** `present` leaves the target equal to the current image, in its order of bytes, and marks it with a
/// stamp of its own ([`new_writer`] gives the number to sign with). It writes all pixels that may differ, and no
/// others as far as it can tell: what a target holds is known by the [stamp](Target::stamp) that it comes with, and
/// one without, or with that of another writer, is written in full. Bytes between rows and behind the last are not
/// touched. A target that does not have the view's size is left alone, and nothing is pending for it.
///
/// **Determinism.** Results do not depend on `exec.threads`, nor on what was drawn before; for the same input they are
/// the same bits. With `exec.threads > 1` calls are made inside a rayon pool, and a backend spawns its work there only.
///
/// **Failure.** No call panics, or fails otherwise, whatever the coordinates and colours are. A device that can fail
/// keeps that to itself and shows the background.
pub trait Backend: Debug + Send + Sync {
    /// What it can do; always the same.
    fn capabilities(&self) -> Capabilities;

    /// Starts a new image of the view's size and finds out which triangles can be seen. The image's colours are
    /// undefined until [`resolve`](Self::resolve).
    fn rasterize(&mut self, exec: Exec, geometry: Geometry<'_>) -> RasterCounts;

    /// One turn of [`rasterize`](Self::rasterize). `None` if it was told to stop and has not got through; then others must
    /// follow.
    ///
    /// A backend that cannot stop does everything at once.
    fn rasterize_while(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        turn: Turn<'_>,
    ) -> Option<RasterCounts> {
        let _ = turn;
        Some(self.rasterize(exec, geometry))
    }

    /// As [`rasterize_while`](Self::rasterize_while), for an image of the same world and view as the last one, in which nothing has moved
    /// since but corners of the triangles in `moved`, which ascend. The result is the same, bit for bit. Later turns come with
    /// the same `moved`.
    ///
    /// The last image may also have been given up, and its view may have been another one; then as for any image, everything
    /// is found out anew. So does a backend that keeps nothing.
    fn rasterize_moved(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        moved: &[Range<u32>],
        turn: Turn<'_>,
    ) -> Option<RasterCounts> {
        let _ = moved;
        self.rasterize_while(exec, geometry, turn)
    }

    /// The triangles whose vertices have to be illuminated, ascending. With ids: those that own a pixel. Without:
    /// those that face the viewer and may touch the centre of a pixel, whether something hides
    /// them or not.
    fn visible_triangles(&self) -> &[u32];

    /// How many pixels a triangle takes up. With ids: owns, zero for those that are not visible. Without: an estimate
    /// of its projected area inside the image in pixels, at least 1, for a visible one, and zero for others.
    fn visible_pixels(&self, triangle: u32) -> u32;

    /// Gives every pixel of the image its colour.
    fn resolve(&mut self, exec: Exec, geometry: Geometry<'_>, paint: BasePaint<'_>);

    /// One turn of [`resolve`](Self::resolve). `false` if it was told to stop and has not got through; then others must
    /// follow.
    ///
    /// A backend that cannot stop does everything at once.
    fn resolve_while(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        paint: BasePaint<'_>,
        turn: Turn<'_>,
    ) -> bool {
        let _ = turn;
        self.resolve(exec, geometry, paint);
        true
    }

    /// As [`resolve_while`](Self::resolve_while), where illumination is what it was when colours of the same kind were begun last:
    /// the same lights, materials and background. So colours have changed only where triangles have [moved](Self::rasterize_moved),
    /// have other owners' pixels, or have been repainted. The result is the same, bit for bit.
    ///
    /// A backend that keeps nothing colours everything.
    fn resolve_moved(
        &mut self,
        exec: Exec,
        geometry: Geometry<'_>,
        paint: BasePaint<'_>,
        turn: Turn<'_>,
    ) -> bool {
        self.resolve_while(exec, geometry, paint, turn)
    }

    /// With ids: paints exactly the pixels that each patch's triangle owns inside the patch, and counts them in
    /// [`Patch::pixels`]. Patches of one call must not overlap. A pixel on the border of two adjacent patches belongs
    /// to exactly one. Patches that partition a triangle together count [`visible_pixels`](Self::visible_pixels).
    ///
    /// Never called on a backend that does not [refine in place](Capabilities::refines_in_place), which need not
    /// implement it.
    fn repaint(&mut self, exec: Exec, geometry: Geometry<'_>, patches: &mut [Patch]) {
        let _ = (exec, geometry, patches);
    }

    /// How many covered pixels there are in a square of [`SQUARE_SIDE`] x [`SQUARE_SIDE`] pixels; squares are numbered row after
    /// row from the top left, those at the right and lower edges being cut. Asked only where the next is called.
    fn square_pixels(&self, square: u32) -> u32 {
        let _ = square;
        0
    }

    /// Gives the pixels of some squares the colours that resolving with [`BasePaint::Phong`] gives them. The image has been
    /// resolved before, and no square is named twice.
    ///
    /// Never called on a backend that does not [refine in place](Capabilities::refines_in_place), which need not
    /// implement it.
    fn shade_squares(&mut self, exec: Exec, geometry: Geometry<'_>, squares: &[u32]) {
        let _ = (exec, geometry, squares);
    }

    /// How many pixels [`present`](Self::present) would have to write to `target` now.
    fn pending_pixels(&self, target: &Target<'_>) -> u64;

    /// At most how many pixels [`present`](Self::present) will have to write to `target` once the image has been resolved. Asked between
    /// [`rasterize`](Self::rasterize) and [`resolve`](Self::resolve).
    fn pending_after_resolve(
        &self,
        exec: Exec,
        geometry: Geometry<'_>,
        target: &Target<'_>,
    ) -> u64 {
        let (_, view) = (exec, geometry.view);
        if (target.width(), target.height()) == (view.width, view.height) {
            u64::from(view.width) * u64::from(view.height)
        } else {
            0
        }
    }

    /// Brings `target` up to the current image and marks it with its stamp; pixels known to be right already are not
    /// touched. Returns the number of pixels written, as told by [`pending_pixels`](Self::pending_pixels) just before.
    fn present(&mut self, exec: Exec, target: &mut Target<'_>) -> u64;

    /// Appends the pixels that [`present`](Self::present) would write now to `out`, as rectangles that do not overlap.
    fn changes(&self, target: &Target<'_>, out: &mut Vec<Rect>) {
        if self.pending_pixels(target) > 0 {
            out.extend(target.rect());
        }
    }

    /// A new backend of the same kind, without an image: what it draws is the same, bit for bit. `None` if there can be only one.
    fn sibling(&self) -> Option<Box<dyn Backend>> {
        None
    }
}
