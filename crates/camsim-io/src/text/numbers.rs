//! Numbers and matrices as the parsers of other programs want them.

use camsim_core::pose;
use glam::DQuat;

/// A number with a decimal point and without an exponent, as OpenCV's and ORB-SLAM3's readers want reals. YAML 1.1,
/// which Kalibr's follows, takes `1e-5` for a text.
pub(crate) fn real(value: f64) -> String {
    let text = format!("{value}");
    if text.contains('.') || !value.is_finite() { text } else { text + ".0" }
}

/// `[a, b, c]`.
pub(crate) fn list(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|value| real(*value)).collect::<Vec<_>>().join(", "))
}

/// Rows of a matrix, one list.
pub(crate) fn matrix_list(rows: &[[f64; 4]; 4]) -> String {
    list(rows.as_flattened())
}

/// Rows of a matrix below a key with an indent of two, as a list of lists. OpenCV's parser wants the items of a list
/// further to the right than their key.
pub(crate) fn matrix_rows<const N: usize>(rows: &[[f64; N]]) -> String {
    rows.iter().map(|row| format!("    - {}\n", list(row))).collect()
}

/// Type of the elements of a matrix in OpenCV's YAML. Programs that ask for elements of the other type read nonsense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Element {
    Float,
    Double,
}

/// A matrix in OpenCV's YAML.
pub(crate) fn opencv_matrix(
    name: &str,
    [rows, columns]: [usize; 2],
    element: Element,
    data: &[f64],
) -> String {
    let dt = if element == Element::Float { "f" } else { "d" };
    let data = list(data);
    format!("{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: {dt}\n   data: {data}\n")
}

/// The same rotation, with a scalar that is not negative.
pub(crate) fn upright(q: DQuat) -> DQuat {
    if q.w < 0.0 { -q } else { q }
}

/// Scalar first, not negative.
pub(crate) fn wxyz(q: DQuat) -> [f64; 4] {
    pose::wxyz(upright(q))
}

/// Scalar last, not negative.
pub(crate) fn xyzw(q: DQuat) -> [f64; 4] {
    let [w, x, y, z] = wxyz(q);
    [x, y, z, w]
}

/// The number with the fewest decimals within a tolerance.
pub(crate) fn shortest(value: f64, tolerance: f64) -> f64 {
    let rounded = |decimals: i32| {
        let scale = 10f64.powi(decimals);
        (value * scale).round() / scale + 0.0
    };
    (0..=15).map(rounded).find(|short| (short - value).abs() <= tolerance).unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_noise_is_dropped_and_digits_stay() {
        let third = 1.0 / 3.0;
        assert_eq!(shortest(0.1 + 0.2, 1e-16), 0.3);
        assert_eq!(shortest(-0.0, 0.0).to_bits(), 0);
        assert_eq!(shortest(third, 1e-17), third);
        assert_eq!(shortest(-5.618_603_727_452_336, 1e-17), -5.618_603_727_452_336);
    }

    #[test]
    fn numbers_are_reals_to_every_parser() {
        assert_eq!(list(&[435.0, -0.25, 1e-7, 0.0]), "[435.0, -0.25, 0.0000001, 0.0]");
        assert_eq!(wxyz(DQuat::from_xyzw(0.1, 0.2, 0.3, -0.9)), [0.9, -0.1, -0.2, -0.3]);
        assert_eq!(xyzw(DQuat::from_xyzw(0.1, 0.2, 0.3, 0.9)), [0.1, 0.2, 0.3, 0.9]);
    }
}
