//! A chart of error against time, as an SVG image.
//!
//! Both axes are logarithmic. Methods are told apart by colour (those of Okabe and Ito, which colour-blind readers can tell
//! apart) and by the shape of their marks; the best curve's is drawn last, over the others. Methods that no budget changes are
//! single marks. Labels at G and P point away from each other, so that they never meet. An error of zero has no place on a logarithmic axis: it is drawn at the lower end.

use super::axis::{LogAxis, label};
use super::result::SceneResult;
use super::style::Look;
use crate::cli::machine::Facts;
use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::combinators::{IntoLogRange, LogCoord};
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::element::{PathElement, Polygon, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontStyle, FontTransform, IntoFont, RGBColor, ShapeStyle, TextStyle, WHITE,
};
use specula::measure::Curve;
use std::io;

/// The size of the image.
const SIZE: (u32, u32) = (1200, 720);
/// The rectangle between the axes: left, right, top, bottom.
const PLOT: [i32; 4] = [84, 880, 116, 640];
/// Where the legend starts, and the distance of its lines.
const LEGEND: (i32, i32) = (916, 34);

const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
const FAINT_INK: RGBColor = RGBColor(0x66, 0x66, 0x66);
const GRID: RGBColor = RGBColor(0xE4, 0xE4, 0xE4);
const WARNING: RGBColor = RGBColor(0xB0, 0x20, 0x10);

type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Plot<'a> = DrawingArea<SVGBackend<'a>, Cartesian2d<LogCoord<f64>, LogCoord<f64>>>;
type Drawn = Result<(), DrawingAreaErrorKind<io::Error>>;

/// Draws what was measured of a scene.
pub(super) fn draw(
    result: &SceneResult,
    facts: &Facts,
    repeats: u32,
) -> Result<String, DrawingAreaErrorKind<io::Error>> {
    let mut svg = String::new();
    let canvas = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
    canvas.fill(&WHITE)?;
    let chart = Chart::new(result);
    chart.draw_titles(&canvas, facts, repeats)?;
    chart.draw_axes(&canvas)?;
    chart.draw_bounds(&canvas)?;
    chart.draw_curves(&canvas)?;
    chart.draw_legend(&canvas)?;
    canvas.present()?;
    drop(canvas);
    Ok(svg)
}

/// What is drawn.
struct Chart<'a> {
    result: &'a SceneResult,
    /// The best first.
    curves: Vec<Curve>,
    x: LogAxis,
    y: LogAxis,
}

impl<'a> Chart<'a> {
    fn new(result: &'a SceneResult) -> Self {
        let mut curves = Curve::of_rows(&result.rows);
        let area = |curve: &Curve| {
            let area = result.area(curve.method);
            area.map_or(f64::INFINITY, |area| area.area_codes)
        };
        curves.sort_by(|a, b| area(a).total_cmp(&area(b)));
        let points = || curves.iter().flat_map(|curve| &curve.points);
        let bounds =
            (result.calibration.iter()).flat_map(|times| [times.gouraud_ms, times.phong_ms]);
        Self {
            x: LogAxis::of(points().map(|point| point.frame_ms).chain(bounds)),
            y: LogAxis::of(points().map(|point| point.rmse)),
            result,
            curves,
        }
    }

    /// The canvas with the axes' coordinates.
    fn plot<'b>(&self, canvas: &Canvas<'b>) -> Plot<'b> {
        let [left, right, top, bottom] = PLOT;
        canvas.apply_coord_spec(Cartesian2d::new(
            self.x.range.clone().log_scale(),
            self.y.range.clone().log_scale(),
            (left..right, bottom..top),
        ))
    }

    fn draw_titles(&self, canvas: &Canvas<'_>, facts: &Facts, repeats: u32) -> Drawn {
        let left = PLOT[0];
        let title = format!("{}: error against time", self.result.scene);
        let bold = text(28.0, INK, HPos::Left).bold();
        canvas.draw(&Text::new(title, (left, 32), bold.0))?;
        let each = match repeats {
            1 => "cold frames".to_owned(),
            _ => format!("cold frames, each the median of {repeats}"),
        };
        let subtitle = format!("{each}; {}", facts.line());
        let small = text(17.0, FAINT_INK, HPos::Left);
        canvas.draw(&Text::new(subtitle, (left, 60), small.0))?;
        if let Some(warning) = self.result.warning() {
            let small = text(17.0, WARNING, HPos::Left);
            canvas.draw(&Text::new(
                format!("Warning: {warning}"),
                (left, 84),
                small.0,
            ))?;
        }
        Ok(())
    }

    fn draw_axes(&self, canvas: &Canvas<'_>) -> Drawn {
        let [left, right, top, bottom] = PLOT;
        let plot = self.plot(canvas);
        for &tick in &self.x.ticks {
            let (x, _) = plot.map_coordinate(&(tick, self.y.range.start));
            canvas.draw(&line([x, top], [x, bottom], 1, GRID))?;
            let style = text(17.0, FAINT_INK, HPos::Center);
            canvas.draw(&Text::new(label(tick), (x, bottom + 18), style.0))?;
        }
        for &tick in &self.y.ticks {
            let (_, y) = plot.map_coordinate(&(self.x.range.start, tick));
            canvas.draw(&line([left, y], [right, y], 1, GRID))?;
            let style = text(17.0, FAINT_INK, HPos::Right);
            canvas.draw(&Text::new(label(tick), (left - 10, y), style.0))?;
        }
        canvas.draw(&line([left, bottom], [right, bottom], 2, FAINT_INK))?;
        let name = text(18.0, INK, HPos::Center);
        let below = ((left + right) / 2, bottom + 48);
        canvas.draw(&Text::new(
            "time of the frame (ms); G: Gouraud, P: Phong",
            below,
            name.0,
        ))?;
        let mut name = text(18.0, INK, HPos::Center).0;
        name.font = name.font.transform(FontTransform::Rotate270);
        let beside = (left - 60, (top + bottom) / 2);
        canvas.draw(&Text::new("RMSE (8-bit codes)", beside, name))
    }

    /// Marks the times of Gouraud and Phong shading.
    fn draw_bounds(&self, canvas: &Canvas<'_>) -> Drawn {
        let Some(times) = &self.result.calibration else {
            return Ok(());
        };
        let [_, _, top, bottom] = PLOT;
        let plot = self.plot(canvas);
        for (name, ms, side) in [
            ("G", times.gouraud_ms, HPos::Right),
            ("P", times.phong_ms, HPos::Left),
        ] {
            let (x, _) = plot.map_coordinate(&(ms, self.y.range.start));
            let mut y = top;
            while y < bottom {
                let end = (y + 5).min(bottom);
                canvas.draw(&line([x, y], [x, end], 1, FAINT_INK))?;
                y += 10;
            }
            let style = text(16.0, FAINT_INK, side);
            canvas.draw(&Text::new(
                format!("{name} {ms:.2} ms"),
                (x, top - 10),
                style.0,
            ))?;
        }
        Ok(())
    }

    fn draw_curves(&self, canvas: &Canvas<'_>) -> Drawn {
        let plot = self.plot(canvas);
        for curve in self.curves.iter().rev() {
            let look = Look::of(curve.method);
            let points: Vec<(i32, i32)> = curve
                .points
                .iter()
                .map(|point| {
                    plot.map_coordinate(&(self.x.clamp(point.frame_ms), self.y.clamp(point.rmse)))
                })
                .collect();
            if curve.has_a_curve {
                let style = ShapeStyle::from(look.color).stroke_width(3);
                canvas.draw(&PathElement::new(points.clone(), style))?;
            }
            for point in points {
                draw_mark(canvas, look, point)?;
            }
        }
        Ok(())
    }

    /// Names the methods beside the plot, where nothing is covered.
    fn draw_legend(&self, canvas: &Canvas<'_>) -> Drawn {
        let (left, step) = LEGEND;
        let right = SIZE.0 as i32 - 24;
        let mut y = PLOT[2] + 8;
        let has_areas = !self.result.areas.is_empty();
        if has_areas {
            let style = text(16.0, FAINT_INK, HPos::Right);
            canvas.draw(&Text::new("area (mean RMSE)", (right, y), style.0))?;
            y += step;
        }
        for curve in &self.curves {
            let look = Look::of(curve.method);
            if curve.has_a_curve {
                canvas.draw(&line([left, y], [left + 36, y], 3, look.color))?;
            }
            draw_mark(canvas, look, (left + 18, y))?;
            let style = text(19.0, INK, HPos::Left);
            canvas.draw(&Text::new(curve.method, (left + 48, y), style.0))?;
            if let Some(area) = self.result.area(curve.method) {
                let style = text(19.0, INK, HPos::Right);
                canvas.draw(&Text::new(
                    format!("{:.2}", area.area_codes),
                    (right, y),
                    style.0,
                ))?;
            }
            y += step;
        }
        let zero = self
            .curves
            .iter()
            .flat_map(|curve| &curve.points)
            .any(|point| point.rmse <= 0.0);
        if zero {
            let style = text(16.0, FAINT_INK, HPos::Left);
            let note = "marks on the lower axis: no error";
            canvas.draw(&Text::new(note, (left, y + 8), style.0))?;
        }
        Ok(())
    }
}

/// Text in a style that is being put together.
struct Styled(TextStyle<'static>);

impl Styled {
    fn bold(mut self) -> Self {
        self.0.font = self.0.font.style(FontStyle::Bold);
        self
    }
}

/// Text of about `size` pixels, at the middle of its height.
fn text(size: f64, color: RGBColor, side: HPos) -> Styled {
    let font = ("sans-serif", size * 1.24).into_font();
    Styled(TextStyle {
        font,
        color: color.to_backend_color(),
        pos: Pos::new(side, VPos::Center),
    })
}

/// A level or upright line, as a rectangle: paths are for curves alone.
fn line(from: [i32; 2], to: [i32; 2], width: i32, color: RGBColor) -> Rectangle<(i32, i32)> {
    let is_level = from[1] == to[1];
    let before = width / 2;
    let after = width - before;
    let [a, b] = if is_level {
        [(from[0], from[1] - before), (to[0], to[1] + after)]
    } else {
        [(from[0] - before, from[1]), (to[0] + after, to[1])]
    };
    Rectangle::new([a, b], color.filled())
}

/// A mark with a white rim, which keeps it apart from what it lies upon.
fn draw_mark(canvas: &Canvas<'_>, look: Look, center: (i32, i32)) -> Drawn {
    for (radius, color) in [(9.0, WHITE), (7.0, look.color)] {
        let corners: Vec<(i32, i32)> = look.shape.corners(radius, center);
        canvas.draw(&Polygon::new(corners, color.filled()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use specula::Method;
    use specula::measure::{Calibration, ErrorHistogram, SweepRow};

    fn row(method: Method, frame_ms: f64, rmse: f64) -> SweepRow {
        let mut error = ErrorHistogram::default().report();
        error.rmse = rmse;
        SweepRow {
            scene: "a <&> b".to_owned(),
            method: method.name(),
            budget_ms: frame_ms,
            fraction: None,
            threshold: None,
            frame: 1,
            frame_ms,
            overshoot_ms: 0.0,
            error,
            triangles_subdivided: 0,
            converged: false,
        }
    }

    fn facts() -> Facts {
        Facts {
            specula: "0",
            date: String::new(),
            cpu: "a cpu".to_owned(),
            threads: 1,
            simd: "scalar".to_owned(),
            backend: "software".to_owned(),
            width: 8,
            height: 6,
        }
    }

    #[test]
    fn each_progressive_method_has_one_curve_and_all_have_marks() {
        let rows: Vec<SweepRow> = [3.0, 5.0, 9.0]
            .into_iter()
            .flat_map(|ms| Method::ALL.map(|method| row(method, ms, 9.0 - ms)))
            .collect();
        let calibration = Calibration {
            gouraud_ms: 2.0,
            phong_ms: 10.0,
            gouraud_spread: 0.3,
            phong_spread: 0.0,
            gouraud_rmse: 6.0,
            frames: 30,
        };
        let result = SceneResult::new("a <&> b", Some(calibration), Some(calibration), rows);
        let svg = draw(&result, &facts(), 1).expect("text is drawn to");
        let count = |pattern: &str| svg.matches(pattern).count();
        let progressive = Method::ALL
            .iter()
            .filter(|method| method.has_a_curve())
            .count();
        assert_eq!(count("<polyline"), progressive);
        // Each mark has a rim, and there is another one in the legend.
        let marks = 4 * progressive + 2 * (Method::ALL.len() - progressive);
        assert_eq!(count("<polygon"), 2 * marks);
        assert!(svg.contains("a &lt;&amp;&gt; b"), "names are escaped");
        assert!(svg.contains("Warning: ") && svg.contains("G 2.00 ms"));
        assert!(svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn a_chart_can_be_drawn_of_anything() {
        for rows in [
            vec![],
            vec![row(Method::Adaptive, 0.0, 0.0)],
            vec![row(Method::Phong, f64::NAN, f64::INFINITY)],
        ] {
            let result = SceneResult::new("a", None, None, rows);
            let svg = draw(&result, &facts(), 3).expect("text is drawn to");
            assert!(svg.trim_end().ends_with("</svg>"));
        }
    }
}
