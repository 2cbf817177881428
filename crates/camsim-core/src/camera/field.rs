//! The field of view.

use glam::DVec2;

use super::CameraModel;

/// Steps from the border to the middle in which the first pixel with a ray is looked for.
const STEPS: u32 = 512;

impl CameraModel {
    /// Field of view between the outer borders, degrees: across the middle row, down the middle column, and from
    /// the top-left corner to the bottom-right one. Where a lens has no ray at the border, the field ends with
    /// its rays; 0 if it has none.
    #[must_use]
    pub fn field_deg(&self) -> [f64; 3] {
        let [width, height] = self.size_px.map(f64::from);
        let middle = 0.5 * DVec2::new(width - 1.0, height - 1.0);
        [DVec2::new(0.5 * width, 0.0), DVec2::new(0.0, 0.5 * height), 0.5 * DVec2::new(width, height)]
            .map(|reach| (self.signed_angle(middle, reach) + self.signed_angle(middle, -reach)).to_degrees())
    }

    /// Angle off axis of the outermost ray towards `middle + reach`, negative where it lies on the other side of
    /// the axis.
    fn signed_angle(&self, middle: DVec2, reach: DVec2) -> f64 {
        let ray = (0..=STEPS).find_map(|step| {
            let fraction = 1.0 - f64::from(step) / f64::from(STEPS);
            self.ray(middle + fraction * reach)
        });
        ray.map_or(0.0, |ray| {
            let off_axis = ray.truncate().length().atan2(ray.z);
            if ray.truncate().dot(reach) < 0.0 { -off_axis } else { off_axis }
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::scenario::{CameraSpec, ImageCircleSpec, LensModel, LensSpec};

    fn field(spec: &CameraSpec) -> [f64; 3] {
        CameraModel::from_spec(spec).expect("a camera").field_deg()
    }

    fn of(model: LensModel, size_px: [u32; 2], focal: f64) -> CameraSpec {
        let lens = LensSpec { model, coefficients: Vec::new() };
        CameraSpec { size_px, focal_px: [focal; 2], lens, ..CameraSpec::default() }
    }

    #[test]
    fn fields_are_those_of_closed_forms() {
        let near = |spec: &CameraSpec, expected: [f64; 3]| {
            let field = field(spec);
            let off = field.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-6, "{field:?} for {expected:?}");
        };
        let flat = |half: f64| 2.0 * (half / 500.0).atan().to_degrees();
        let pinhole = of(LensModel::Pinhole, [640, 480], 500.0);
        near(&pinhole, [flat(320.0), flat(240.0), flat(400.0)]);
        // An axis at the left border.
        let shifted = CameraSpec { principal_point_px: Some([-0.5, 239.5]), ..pinhole };
        assert!((field(&shifted)[0] - (640.0_f64 / 500.0).atan().to_degrees()).abs() < 1e-6);
        // An equidistant lens of 200 degrees across, and its image circle of 90 degrees off axis.
        let wide = of(LensModel::KannalaBrandt, [800, 600], 400.0 / 100_f64.to_radians());
        near(&wide, [200.0, 150.0, 250.0]);
        let circle = ImageCircleSpec { half_angle_deg: Some(90.0), ..ImageCircleSpec::default() };
        let ends = field(&CameraSpec { image_circle: Some(circle), ..wide });
        assert!((ends[0] - 180.0).abs() < 1.0 && (ends[1] - 150.0).abs() < 1e-6, "{ends:?}");
        let panorama = of(LensModel::Equirectangular, [720, 360], 720.0 / TAU);
        assert!((field(&panorama)[0] - 360.0).abs() < 0.6, "{:?}", field(&panorama));
    }
}
