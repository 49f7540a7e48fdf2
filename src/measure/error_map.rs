//! The error of each pixel.

use super::ReferenceImage;
use super::metrics::{Mismatch, check_same_kind};
use crate::output::Frame;

/// The error of each pixel, rows from the top: the root mean square difference of its channels, in codes, so that the root
/// mean square of all of them is the [`rmse`](super::ErrorReport::rmse). `None` where nothing is compared.
///
/// # Errors
/// When the sizes or the encodings differ.
pub fn error_map(frame: &Frame, reference: &ReferenceImage) -> Result<Vec<Option<f64>>, Mismatch> {
    check_same_kind(frame, reference)?;
    let error = |(index, &[r, g, b, _]): (usize, &[u8; 4])| {
        let is_compared = reference.is_covered(index) && !reference.grazing[index];
        is_compared.then(|| {
            let squares = [r, g, b]
                .into_iter()
                .zip(reference.pixels[index])
                .map(|(own, other)| f64::from(own.abs_diff(other)).powi(2));
            (squares.sum::<f64>() / 3.0).sqrt()
        })
    };
    Ok(frame.pixels().iter().enumerate().map(error).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::ErrorReport;
    use crate::measure::metrics::tests::{frame_of, row};
    use crate::measure::reference::NO_TRIANGLE;

    #[test]
    fn a_map_has_the_errors_that_the_report_sums_up() {
        let mut reference = row(5);
        reference.ids[3] = NO_TRIANGLE;
        reference.grazing[4] = true;
        let mut frame = frame_of(&reference);
        frame.pixels_mut()[0] = [103, 97, 100, 255];
        frame.pixels_mut()[1] = [100, 100, 90, 255];
        frame.pixels_mut()[3] = [0; 4];
        frame.pixels_mut()[4] = [0; 4];
        let map = error_map(&frame, &reference).expect("same size");
        let squares: Vec<Option<f64>> = map.iter().map(|e| e.map(|e| e * e)).collect();
        for (found, expected) in squares.iter().zip([6.0, 100.0 / 3.0, 0.0]) {
            assert!(found.is_some_and(|found| (found - expected).abs() < 1e-12));
        }
        assert_eq!(squares[3..], [None, None]);
        let mean = squares.iter().flatten().sum::<f64>() / 3.0;
        let report = ErrorReport::compare(&frame, &reference).expect("same size");
        assert!((mean.sqrt() - report.rmse).abs() < 1e-12);
        assert!(error_map(&Frame::new(2, 1), &reference).is_err());
    }
}
