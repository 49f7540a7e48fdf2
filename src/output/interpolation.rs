//! How colours are interpolated on the way to the screen.

/// How a device interpolates colours between the corners of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Linear light, perspective-correct; clamped and encoded at the pixel.
    #[default]
    LinearPerspective,
    /// Clamped and encoded colours (codes), as an affine function of the place on the screen.
    EncodedAffine,
}
