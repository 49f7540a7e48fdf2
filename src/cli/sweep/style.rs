//! The look of each method in charts.

use plotters::style::RGBColor;
use specula::Method;
use std::f64::consts::TAU;

/// Colour and mark of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    pub(super) color: RGBColor,
    pub(super) shape: Shape,
}

/// The shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Disc,
    Square,
    Diamond,
    Triangle,
    TurnedTriangle,
}

/// Okabe and Ito's colours without black and yellow, which is too faint for lines on white.
const COLORS: [RGBColor; 6] = [
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x56, 0xB4, 0xE9),
];

const SHAPES: [Shape; 5] = [
    Shape::Disc,
    Shape::Square,
    Shape::Triangle,
    Shape::Diamond,
    Shape::TurnedTriangle,
];

impl Look {
    /// The look of the method of that name: the same in every chart.
    pub(super) fn of(method: &str) -> Self {
        let gray = |level, shape| Self {
            color: RGBColor(level, level, level),
            shape,
        };
        match method {
            "flat" => gray(0xA0, Shape::Triangle),
            "gouraud" => gray(0x70, Shape::Square),
            "phong" => gray(0x20, Shape::Disc),
            "phong-half" => gray(0x50, Shape::Diamond),
            "hybrid" => gray(0x90, Shape::TurnedTriangle),
            _ => {
                let mut colored = Method::ALL
                    .into_iter()
                    .filter(|method| method.has_a_curve());
                let index = colored
                    .position(|other| other.name() == method)
                    .unwrap_or(0);
                Self {
                    color: COLORS[index % COLORS.len()],
                    shape: SHAPES[index % SHAPES.len()],
                }
            }
        }
    }
}

impl Shape {
    /// The outline of a mark of about the area of a disc of `radius` pixels.
    pub(super) fn corners(self, radius: f64, (x, y): (i32, i32)) -> Vec<(i32, i32)> {
        // How many corners, how far out, and at which angle from straight up the first.
        let (count, scale, turn) = match self {
            Self::Disc => (24, 1.0, 0.0),
            Self::Square => (4, 1.25, 1.0 / 8.0),
            Self::Diamond => (4, 1.3, 0.0),
            Self::Triangle => (3, 1.45, 0.0),
            Self::TurnedTriangle => (3, 1.45, 0.5),
        };
        (0..count)
            .map(|corner| {
                let angle = TAU * (f64::from(corner) / f64::from(count) + turn);
                let out = radius * scale;
                let at = |center: i32, offset: f64| center + offset.round() as i32;
                (at(x, out * angle.sin()), at(y, -out * angle.cos()))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_methods_look_the_same() {
        for (index, method) in Method::ALL.iter().enumerate() {
            for other in &Method::ALL[..index] {
                assert_ne!(Look::of(method.name()), Look::of(other.name()));
            }
        }
    }
}
