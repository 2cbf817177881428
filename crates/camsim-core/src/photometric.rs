//! Photometric stage: vignette, light, noise and saturation on linear values (section 7 and fig. 9 of the
//! paper). f64 twin of `camsim-gpu/shaders/reverse/photometric.wgsl`.

use glam::DVec2;

use crate::{
    exposure::FrameExposure,
    noise::{NOISE_STREAM, normal4},
    scenario::{CameraSpec, FilesOfSpec, OutputEncoding},
};

/// A single-channel image.
#[derive(Clone, Debug, PartialEq)]
pub struct GrayImage {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Row-major values.
    pub values: Vec<f32>,
}

/// Numbers of the photometric stage of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photometry {
    /// Gain on linear values.
    pub light: f32,
    /// Standard deviation of the noise.
    pub noise_sigma: f32,
    /// Whether all channels have the luminance.
    pub is_mono: bool,
    /// Largest value: white, or any where an image sensor comes after this stage, which has a full well.
    pub most: f32,
}

impl Photometry {
    /// The light as it is.
    const NEUTRAL: Self = Self { light: 1.0, noise_sigma: 0.0, is_mono: false, most: f32::MAX };

    /// What the passes apply: nothing where that comes later ([`CameraSpec::defers_photometric`]).
    #[must_use]
    pub fn new(camera: &CameraSpec, exposure: Option<&FrameExposure>) -> Self {
        if camera.defers_photometric() { Self::NEUTRAL } else { Self::before_point_spread(camera, exposure) }
    }

    /// What comes before the point spread: with one, the vignette alone.
    #[must_use]
    pub fn before_point_spread(camera: &CameraSpec, exposure: Option<&FrameExposure>) -> Self {
        if camera.point_spread.is_some() { Self::NEUTRAL } else { Self::whole(camera, exposure) }
    }

    /// The stage of a camera's frame; `exposure` is the frame's own. An image sensor applies it by itself.
    #[must_use]
    pub fn whole(camera: &CameraSpec, exposure: Option<&FrameExposure>) -> Self {
        let spec = &camera.photometric;
        let own = exposure.filter(|_| camera.sensor.is_none()).map_or(1.0, |exposure| exposure.light);
        Self {
            light: (spec.light * own) as f32,
            noise_sigma: spec.noise_sigma as f32,
            is_mono: is_mono(spec.output),
            most: if camera.sensor.is_some() { f32::MAX } else { 1.0 },
        }
    }
}

/// Weight of a vignette value: 0 if `v < t1`, else `min(v / t2, 1)`.
#[must_use]
pub fn vignette_weight(value: f32, thresholds: [f64; 2]) -> f32 {
    let [black, full] = thresholds.map(|t| t as f32);
    if value < black {
        0.0
    } else if full > 0.0 {
        (value / full).min(1.0)
    } else {
        1.0
    }
}

/// Vignette weights at output size: the map resampled bilinearly (pixel centres, borders constant), then the
/// thresholds.
#[must_use]
pub fn vignette_weights(map: &GrayImage, size_px: [u32; 2], thresholds: [f64; 2]) -> Vec<f32> {
    let position = |x, y| DVec2::new(x, y);
    let values = resampled(map, size_px, size_px, position);
    values.into_iter().map(|value| vignette_weight(value, thresholds)).collect()
}

/// The values of a vignette map in the picture of a camera, which is a part of the picture that the map covers
/// ([`crate::scenario::CameraSpec::files_of`]).
#[must_use]
pub fn vignette_part(map: &GrayImage, files_of: &FilesOfSpec, size_px: [u32; 2]) -> GrayImage {
    let position = |x, y| files_of.point(DVec2::new(x, y), size_px);
    GrayImage { size_px, values: resampled(map, size_px, files_of.size_px, position) }
}

/// Values of a map, which covers a picture of the size `covered_px`, at the positions in it that the pixels of a
/// picture have: bilinear between pixel centres, constant beyond the borders.
fn resampled(
    map: &GrayImage,
    [width, height]: [u32; 2],
    covered_px: [u32; 2],
    position: impl Fn(f64, f64) -> DVec2,
) -> Vec<f32> {
    let axis = |at: f64, covered: u32, in_size: u32| {
        let map_px =
            ((at + 0.5) * f64::from(in_size) / f64::from(covered) - 0.5).clamp(0.0, f64::from(in_size - 1));
        let low = map_px.floor() as u32;
        (low, (low + 1).min(in_size - 1), (map_px - map_px.floor()) as f32)
    };
    let value = |x: u32, y: u32| map.values[(y * map.size_px[0] + x) as usize];
    let mut values = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        for x in 0..width {
            let at = position(f64::from(x), f64::from(y));
            let (x0, x1, tx) = axis(at.x, covered_px[0], map.size_px[0]);
            let (y0, y1, ty) = axis(at.y, covered_px[1], map.size_px[1]);
            let top = value(x0, y0) + tx * (value(x1, y0) - value(x0, y0));
            let bottom = value(x0, y1) + tx * (value(x1, y1) - value(x0, y1));
            values.push(top + ty * (bottom - top));
        }
    }
    values
}

/// Whether the output is a single luminance channel.
#[must_use]
pub fn is_mono(output: OutputEncoding) -> bool {
    matches!(output, OutputEncoding::Luma8 | OutputEncoding::Luma16)
}

/// Final linear value of a pixel: `clamp(color * weight * light + sigma * n, 0, most)`.
#[must_use]
pub fn photometric(
    stage: &Photometry,
    color: [f32; 3],
    weight: f32,
    pixel: [u32; 2],
    frame: u32,
    seed: u64,
    table: &[f32],
) -> [f32; 3] {
    let Photometry { light, noise_sigma, is_mono, most } = *stage;
    let luma = 0.212_6 * color[0] + 0.715_2 * color[1] + 0.072_2 * color[2];
    let gain = weight * light;
    let noise = if noise_sigma > 0.0 { normal4(pixel, frame, seed, NOISE_STREAM, table) } else { [0.0; 4] };
    std::array::from_fn(|channel| {
        let value = if is_mono { luma } else { color[channel] };
        let n = if is_mono { noise[0] } else { noise[channel] };
        (value * gain + noise_sigma * n).clamp(0.0, most)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{ImageSensorSpec, PhotometricSpec};

    #[test]
    fn thresholds_cut_and_saturate() {
        let t = [0.1, 0.5];
        assert_eq!(vignette_weight(0.09, t), 0.0);
        assert_eq!(vignette_weight(0.1, t), 0.2);
        assert_eq!(vignette_weight(0.25, t), 0.5);
        assert_eq!(vignette_weight(0.9, t), 1.0);
    }

    #[test]
    fn resampling_keeps_a_ramp_and_its_edges() {
        let map = GrayImage { size_px: [4, 1], values: vec![0.0, 1.0, 2.0, 3.0] };
        let weights = vignette_weights(&map, [8, 2], [-1.0, 10.0]);
        let expected = [0.0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.0].map(|v: f32| v / 10.0);
        for (i, weight) in weights.iter().enumerate() {
            assert!((weight - expected[i % 8]).abs() < 1e-6);
        }
    }

    #[test]
    fn the_map_of_a_part_has_the_values_of_its_points() {
        // Half as many columns as the picture that it covers, with a ramp in each direction.
        let ramp = |k: usize| (k % 20) as f32 + 100.0 * (k / 20) as f32;
        let map = GrayImage { size_px: [20, 30], values: (0..600).map(ramp).collect() };
        let files_of = FilesOfSpec {
            size_px: [40, 30],
            focal_px: [50.0; 2],
            principal_point_px: [19.5, 14.5],
            part_px: [8.0, 6.0, 24.0, 18.0],
        };
        let part = vignette_part(&map, &files_of, [12, 9]);
        for (i, value) in part.values.iter().enumerate() {
            // A pixel is one of 2 x 2 from (8, 6) on, and a column of the map is two of the picture.
            let (column, row) = (4 + i % 12, 6.5 + 2.0 * (i / 12) as f32);
            assert!((value - (column as f32 + 100.0 * row)).abs() < 1e-3, "{i}: {value}");
        }
        assert_eq!(part.size_px, [12, 9]);
    }

    #[test]
    fn mono_output_has_one_noise_for_all_channels() {
        let grey = PhotometricSpec {
            output: OutputEncoding::Luma8,
            noise_sigma: 0.05,
            ..PhotometricSpec::default()
        };
        let camera = CameraSpec { photometric: grey, ..CameraSpec::default() };
        let stage = Photometry::new(&camera, None);
        let value = photometric(&stage, [0.5, 0.4, 0.3], 1.0, [3, 4], 0, 1, &crate::noise::tail_table());
        assert!(value[0] == value[1] && value[1] == value[2]);
    }

    #[test]
    fn light_above_white_ends_here_without_a_sensor_and_passes_with_one() {
        let exposure = FrameExposure { time_s: 4e-3, gain: 2.0, light: 3.0 };
        let value = |camera: &CameraSpec| {
            let stage = Photometry::new(camera, Some(&exposure));
            photometric(&stage, [0.2, 0.9, 20.0], 0.5, [0, 0], 0, 1, &[])
        };
        let mut camera = CameraSpec::default();
        for (found, expected) in value(&camera).iter().zip([0.3, 1.0, 1.0]) {
            assert!((found - expected).abs() < 1e-6);
        }
        camera.sensor = Some(ImageSensorSpec::default());
        for (found, expected) in value(&camera).iter().zip([0.1, 0.45, 10.0]) {
            assert!((found - expected).abs() < 1e-6, "the sensor has the exposure, not this stage");
        }
    }
}
