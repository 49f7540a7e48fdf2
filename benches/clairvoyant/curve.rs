//! Error by work.

/// A point of a curve.
#[derive(Clone, Copy)]
pub(super) struct Point {
    pub(super) units: f64,
    pub(super) rmse: f64,
}

/// The mean of a curve's RMSE over work from 0 to `end`, straight between its points, the last of which goes on.
pub(super) fn area(points: &[Point], end: f64) -> f64 {
    let mut sum = 0.0;
    for pair in points.windows(2).filter(|pair| pair[0].units < end) {
        let [a, b] = [pair[0], pair[1]];
        let to = b.units.min(end);
        let length = to - a.units;
        let at_end = a.rmse + (b.rmse - a.rmse) * length / (b.units - a.units).max(1e-9);
        sum += length * (a.rmse + at_end) / 2.0;
    }
    if let Some(last) = points.last() {
        sum += (end - last.units).max(0.0) * last.rmse;
    }
    sum / end
}

/// The share of `all_phong` at which a curve reaches so many decibels.
pub(super) fn share_at(points: &[Point], db: f64, all_phong: f64) -> String {
    let enough = 255.0 / 10_f64.powf(db / 20.0);
    points
        .iter()
        .find(|point| point.rmse <= enough)
        .map_or("-".to_owned(), |point| {
            format!("{:.3}", point.units / all_phong)
        })
}
