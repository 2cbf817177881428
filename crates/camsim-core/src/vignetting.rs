//! The light that reaches each pixel: the vignette map, and the model of `[camera.photometric.vignetting]`.

use glam::DVec2;
use rayon::prelude::*;

use crate::{
    camera::CameraModel,
    photometric::{GrayImage, vignette_weights},
    scenario::{CameraSpec, Primary, VignettingSpec},
};

/// Weight of a pixel by the model: `cos(angle off axis)^cos_power` times the polynomial of a primary; 0 without a
/// ray, where the cosine counts, and where either is negative.
#[must_use]
pub fn model_weight(spec: &VignettingSpec, camera: &CameraModel, pixel: [u32; 2], primary: Primary) -> f64 {
    let at = DVec2::from_array(pixel.map(f64::from));
    let cosine = || {
        let ray = camera.lens.of_whole_camera().ray(camera.distorted_from_pixel(at));
        ray.map_or(0.0, |ray| ray.z.max(0.0))
    };
    let natural = if spec.cos_power == 0.0 { 1.0 } else { cosine().powf(spec.cos_power) };
    let [width, height] = camera.size_px.map(f64::from);
    let half_diagonal2 = 0.25 * (width * width + height * height);
    let r2 = at.distance_squared(camera.principal_point_px) / half_diagonal2;
    natural * polynomial(spec.polynomial(primary), r2).max(0.0)
}

/// `1 + k1 r^2 + k2 r^4 + k3 r^6`.
pub(crate) fn polynomial(terms: &[f64], r2: f64) -> f64 {
    1.0 + r2 * terms.iter().rev().fold(0.0, |sum, k| sum * r2 + k)
}

/// Weights of all pixels, row-major, for a primary: the map's times the model's. `None` without either.
#[must_use]
pub fn pixel_weights(camera: &CameraSpec, map: Option<&GrayImage>, primary: Primary) -> Option<Vec<f32>> {
    let of_map = map.map(|map| vignette_weights(map, camera.size_px, camera.photometric.vignette_thresholds));
    let Some(spec) = &camera.photometric.vignetting else { return of_map };
    // A camera that is no camera has no picture either.
    let whole = CameraSpec { face: None, primary: None, image_circle: None, ..camera.clone() };
    let Ok(model) = CameraModel::from_spec(&whole) else { return of_map };
    let [width, height] = camera.size_px;
    let row = |y: u32| (0..width).map(move |x| [x, y]);
    let pixels: Vec<[u32; 2]> = (0..height).flat_map(row).collect();
    let weight = |&pixel: &[u32; 2]| model_weight(spec, &model, pixel, primary) as f32;
    let mut weights: Vec<f32> = pixels.par_iter().map(weight).collect();
    if let Some(of_map) = of_map {
        weights.iter_mut().zip(of_map).for_each(|(weight, of_map)| *weight *= of_map);
    }
    Some(weights)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::scenario::{Face, LensModel, LensSpec, PhotometricSpec};

    fn camera(lens: LensSpec, vignetting: VignettingSpec) -> CameraSpec {
        CameraSpec {
            size_px: [60, 40],
            focal_px: [30.0, 32.0],
            principal_point_px: Some([28.0, 21.0]),
            lens,
            photometric: PhotometricSpec { vignetting: Some(vignetting), ..PhotometricSpec::default() },
            ..CameraSpec::default()
        }
    }

    fn natural() -> VignettingSpec {
        VignettingSpec { cos_power: 4.0, ..VignettingSpec::default() }
    }

    #[test]
    fn natural_vignetting_is_that_of_the_closed_form() {
        let pinhole = camera(LensSpec::default(), natural());
        let equidistant = LensSpec { model: LensModel::KannalaBrandt, coefficients: Vec::new() };
        let fisheye = camera(equidistant, natural());
        let [flat, wide] =
            [&pinhole, &fisheye].map(|camera| pixel_weights(camera, None, Primary::Green).unwrap());
        for i in 0..60 * 40 {
            let (x, y) = ((i % 60) as f64 - 28.0, (i / 60) as f64 - 21.0);
            let (u, v) = (x / 30.0, y / 32.0);
            let of_pinhole = 1.0 / (1.0 + u * u + v * v).powi(2);
            let of_fisheye = u.hypot(v).cos().max(0.0).powi(4);
            assert!((f64::from(flat[i]) - of_pinhole).abs() < 1e-7, "{i}");
            assert!((f64::from(wide[i]) - of_fisheye).abs() < 1e-7, "{i}");
        }
        // A face has the weights of the whole camera.
        let of_face = CameraSpec { face: Some(Face::Right), ..fisheye.clone() };
        assert_eq!(pixel_weights(&of_face, None, Primary::Green).unwrap(), wide);
    }

    #[test]
    fn polynomials_are_of_the_radius_over_half_the_diagonal() {
        let mut spec = VignettingSpec { polynomial: vec![-0.4, 0.1, -0.02], ..VignettingSpec::default() };
        spec.polynomial_blue = Some(vec![-0.5]);
        let camera = camera(LensSpec::default(), spec);
        let map = GrayImage { size_px: [1, 1], values: vec![0.25] };
        let green = pixel_weights(&camera, None, Primary::Green).unwrap();
        let blue = pixel_weights(&camera, Some(&map), Primary::Blue).unwrap();
        for i in 0..60 * 40 {
            let (x, y) = ((i % 60) as f64 - 28.0, (i / 60) as f64 - 21.0);
            let r = x.hypot(y) / (0.5 * 60_f64.hypot(40.0));
            let expected = 1.0 - 0.4 * r.powi(2) + 0.1 * r.powi(4) - 0.02 * r.powi(6);
            assert!((f64::from(green[i]) - expected).abs() < 1e-7, "{i}");
            // The map's value is half of what its thresholds take for full.
            assert!((f64::from(blue[i]) - 0.5 * (1.0 - 0.5 * r * r)).abs() < 1e-7, "{i}");
        }
        assert_eq!(pixel_weights(&CameraSpec::default(), None, Primary::Red), None);
    }
}
