//! Principal points that belong to another picture.

use camsim_core::scenario::CameraSpec;

use super::Doubt;

/// Fraction of a side around the centre, to either side, within which a principal point is usual.
const USUAL: f64 = 0.2;
/// Fractions of a side around the border that count as the corner.
const CORNER: f64 = 0.02;
/// Ratio of a principal point to the centre from which on another size is likely, if both axes agree.
const OTHER_SIZE: f64 = 1.15;
/// The same if they do not agree, because the other picture has another aspect.
const OTHER_ASPECT: f64 = 1.3;

/// A principal point that belongs to a picture of another size or with another origin.
pub(super) fn doubt_of_other_picture(camera: &CameraSpec) -> Option<Doubt> {
    let point = camera.principal_point_px?;
    let size = camera.size_px.map(f64::from);
    let fractions = fractions(point, size);
    let is_corner =
        fractions.iter().all(|fraction| fraction.abs() < CORNER || (fraction - 1.0).abs() < CORNER);
    // The last corner would be the centre of a picture of twice the size.
    let problem = if is_corner && fractions.iter().any(|fraction| fraction.abs() < CORNER) {
        format!(
            "is in the corner of the picture of {}: is it missing, or counted from the centre?",
            times(size)
        )
    } else if let Some(problem) = other_picture(point, size) {
        problem
    } else if fractions.iter().any(|fraction| !(0.0..=1.0).contains(fraction)) {
        format!(
            "is outside of the picture of {}: check that the size is that of the calibration",
            times(size)
        )
    } else {
        return None;
    };
    Some(Doubt::of("principal_point_px", point, problem))
}

/// A principal point far from the centre.
pub(super) fn far_doubt(camera: &CameraSpec) -> Option<Doubt> {
    let point = camera.principal_point_px?;
    let size = camera.size_px.map(f64::from);
    fractions(point, size).iter().any(|fraction| (fraction - 0.5).abs() > USUAL).then(|| {
        let problem = format!(
            "is far from the centre of the picture of {}: check it, and that the size is that of the calibration",
            times(size)
        );
        Doubt::of("principal_point_px", point, problem)
    })
}

/// Where a point lies along the sides; zero and one are the borders.
fn fractions(point: [f64; 2], size: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|axis| (point[axis] + 0.5) / size[axis])
}

/// What to say of a principal point that would be the centre of a picture of another size.
fn other_picture([cx, cy]: [f64; 2], [width, height]: [f64; 2]) -> Option<String> {
    let centred = [2.0 * cx + 1.0, 2.0 * cy + 1.0];
    let is_turned =
        [centred[0] / height, centred[1] / width].iter().all(|ratio| (0.92..=1.08).contains(ratio));
    if is_turned && !(0.9..=1.1).contains(&(width / height)) {
        return Some(format!(
            "would be the centre of a picture of about {}, but the size is {}: check whether it is rotated",
            times(centred),
            times([width, height])
        ));
    }
    let [across, down] = [centred[0] / width, centred[1] / height];
    let both_by = |factor: f64| across.max(down) < 1.0 / factor || across.min(down) > factor;
    let is_same_aspect = (0.95..=1.05).contains(&(across / down));
    (both_by(OTHER_ASPECT) || is_same_aspect && both_by(OTHER_SIZE)).then(|| {
        format!(
            "would be the centre of a picture of about {}, not of {}: check whether the calibration has another size",
            times(centred),
            times([width, height])
        )
    })
}

fn times([width, height]: [f64; 2]) -> String {
    format!("{width:.0} x {height:.0}")
}
