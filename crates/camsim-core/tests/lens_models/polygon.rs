//! Where points lie to the image of a border.

use std::f64::consts::TAU;

use glam::DVec2;

/// Winding number of a closed polygon about a point, and its distance.
pub fn winding(polygon: &[DVec2], point: DVec2) -> (i32, f64) {
    let (mut turned, mut distance) = (0.0, f64::INFINITY);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (to_a, along) = (*a - point, b - *a);
        turned += to_a.angle_to(b - point);
        let fraction = (-to_a.dot(along) / along.length_squared().max(1e-300)).clamp(0.0, 1.0);
        distance = distance.min((to_a + along * fraction).length());
    }
    ((turned / TAU).round() as i32, distance)
}
