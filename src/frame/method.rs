//! Shading methods.

use std::fmt;
use std::str::FromStr;

/// How an image is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Method {
    /// One colour per triangle, at its centroid with its face normal.
    Flat,
    /// The illumination equation at the vertices, colours interpolated.
    Gouraud,
    /// The illumination equation at every pixel.
    Phong,
    /// Gouraud first, then refinement by error and cost until the budget is spent.
    #[default]
    Adaptive,
    /// Gouraud first, then per-pixel Phong, triangles with most visible pixels first: the simple rival of
    /// [`Adaptive`](Self::Adaptive).
    PhongArea,
    /// Gouraud first, then per-pixel Phong, squares of the image in a fixed shuffled order: a rival of
    /// [`Adaptive`](Self::Adaptive) that knows nothing of the scene.
    PhongTiles,
    /// The paper's regular subdivision (section 3.2): potentially highlighted triangles, and neighbours of theirs, are split in four until the
    /// parts are small. A frame does all of it, whatever its budget.
    Regular,
    /// The paper's highlight subdivision (section 3.1): potentially highlighted triangles are divided at the centres of their highlights. A
    /// frame does all of it, whatever its budget.
    Highlight,
    /// Potentially highlighted triangles shaded per pixel (the paper's section 3.3). A frame does all of it, whatever its budget.
    Hybrid,
    /// The illumination equation at every pixel of an image of half the width and height, which is enlarged: the simple rival
    /// that is there in a quarter of the time.
    PhongHalf,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 10] = [
        Self::Flat,
        Self::Gouraud,
        Self::Phong,
        Self::Adaptive,
        Self::PhongArea,
        Self::PhongTiles,
        Self::PhongHalf,
        Self::Regular,
        Self::Highlight,
        Self::Hybrid,
    ];

    /// The name used on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Gouraud => "gouraud",
            Self::Phong => "phong",
            Self::Adaptive => "adaptive",
            Self::PhongArea => "phong-area",
            Self::PhongTiles => "phong-tiles",
            Self::PhongHalf => "phong-half",
            Self::Regular => "regular",
            Self::Highlight => "highlight",
            Self::Hybrid => "hybrid",
        }
    }

    /// The divisor of the image's sides, where the method has one of its own.
    #[must_use]
    pub fn divisor(self) -> Option<u32> {
        (self == Self::PhongHalf).then_some(2)
    }

    /// Whether the first image already evaluates the illumination equation at every pixel.
    #[must_use]
    pub fn shades_first_image_per_pixel(self) -> bool {
        matches!(self, Self::Phong | Self::PhongHalf)
    }

    /// Whether it is one of the paper's: Gouraud shading, then everything that is to be done about highlights at once.
    #[must_use]
    pub fn is_of_the_paper(self) -> bool {
        matches!(self, Self::Regular | Self::Highlight | Self::Hybrid)
    }

    /// Whether there are several images of it between Gouraud shading and its best: by budgets, or by thresholds.
    #[must_use]
    pub fn has_a_curve(self) -> bool {
        self.is_progressive() || matches!(self, Self::Regular | Self::Highlight)
    }

    /// Whether refinement takes triangles one by one, best first.
    pub(super) fn refines_triangles(self) -> bool {
        matches!(self, Self::Adaptive | Self::PhongArea)
    }

    /// Whether frames go on refining the image, so that a budget makes a difference.
    #[must_use]
    pub fn is_progressive(self) -> bool {
        self.refines_triangles() || self == Self::PhongTiles
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|method| method.name() == text)
            .ok_or_else(|| {
                let names = Self::ALL.map(Self::name).join(", ");
                format!("no method is called '{text}'; there are {names}")
            })
    }
}
