//! `quality.preset = "paper"`: the paper's own methods, as the base that camsim's are measured against.
//!
//! | what | how, and why so |
//! |---|---|
//! | ideal frame | [`MARGIN`] times the output size a side, the output's focal length, the optical axis in the middle: the symmetric frustum of the paper's program. What a fisheye or a fast turn needs beyond it is invalid |
//! | principal point | the camera's own wherever a pixel becomes a ray. (The paper's program tests its margin with the wrong one, which reddens pixels that have a ray) |
//! | ideal colour | 8 bit sRGB, read and averaged as stored; one sample a pixel, also at silhouettes |
//! | lens inverse | Gauss-Newton of [`camsim_core::lens::paper`] for every pixel of every frame, except where the vignette is black (its program does so too) and coordinates are not wanted |
//! | time | camsim's own rows, delay and interlacing; key instant in the middle of the window, as in the paper's program |
//! | displacement | eq. 18 by Heun's steps of 2.5 deg from the ray's own position, at the *nearest* texel's depth |
//! | exposure | [`BLUR_SAMPLES`] samples, or `quality.blur_samples`, on the straight segment between its two ends, ends included; no footprint |
//! | fog | linear and after the blur: full at `scene.fog_visibility_m`, of the sky's colour |
//! | photometric | vignette, light and noise on stored values; decoded to linear at the very end |

use camsim_core::{
    camera::CameraModel,
    scenario::QualitySpec,
    scene::{Scene, srgb_from_linear},
    shutter::Shutter,
    temporal::IdealGeometry,
};
use glam::DVec2;

use crate::ir::{
    linear_fog::LinearFog,
    skip::Skip,
    stages::{BlurStage, NodeDepths, PathStage, RayStage},
};

/// Sides of the ideal frame, in sides of the output.
pub const MARGIN: f64 = 1.7;
/// Samples of an exposure (the paper's figs. 16 and 17).
pub const BLUR_SAMPLES: u32 = 100;

pub(crate) fn ideal_geometry(camera: &CameraModel) -> IdealGeometry {
    let size_px = camera.size_px.map(|side| (f64::from(side) * MARGIN).round() as u32);
    let middle = DVec2::new(f64::from(size_px[0]) - 1.0, f64::from(size_px[1]) - 1.0) / 2.0;
    IdealGeometry { size_px, focal_px: camera.focal_px, principal_px: middle }
}

pub(crate) fn ray_stage(camera: &CameraModel) -> RayStage {
    if camera.lens.is_identity() { RayStage::Pinhole } else { RayStage::GaussNewton }
}

pub(crate) fn blur_stage(
    shutter: &Shutter,
    quality: &QualitySpec,
    skipped: &mut Vec<Skip>,
) -> Option<BlurStage> {
    if shutter.exposure_s() <= 0.0 {
        skipped.push(Skip { what: "motion blur", reason: "camera.shutter.exposure_ms is 0".into() });
        return None;
    }
    let samples = quality.blur_samples.value().unwrap_or(BLUR_SAMPLES);
    Some(BlurStage {
        nodes: 2,
        stride: 1,
        path: PathStage::Straight,
        depths: NodeDepths::Each,
        samples_per_px: f64::from(samples),
        max_samples: samples,
    })
}

pub(crate) fn fog(scene: &Scene) -> Option<LinearFog> {
    scene
        .fog_visibility_m
        .map(|end_m| LinearFog { sky_stored: scene.sky_linear.map(srgb_from_linear), end_m })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use camsim_core::scenario::{Auto, CameraSpec, ShutterSpec};

    #[test]
    fn the_ideal_frame_is_the_papers() {
        let spec = CameraSpec { principal_point_px: Some([305.099, 226.236]), ..CameraSpec::default() };
        let ideal = ideal_geometry(&CameraModel::from_spec(&spec).unwrap());
        // As the paper's program renders it.
        assert_eq!((ideal.size_px, ideal.principal_px), ([1088, 816], DVec2::new(543.5, 407.5)));
    }

    #[test]
    fn an_exposure_takes_a_hundred_samples_or_the_given_number() {
        let shutter = |exposure_ms| {
            Shutter::from_spec(&ShutterSpec { exposure_ms, ..ShutterSpec::default() }, 30.0, [640, 480])
                .unwrap()
        };
        let samples = |blur_samples, exposure_ms| {
            let quality = QualitySpec { blur_samples, ..QualitySpec::default() };
            blur_stage(&shutter(exposure_ms), &quality, &mut Vec::new())
                .map(|blur| (blur.nodes, blur.max_samples))
        };
        assert_eq!(samples(Auto::Auto, 8.0), Some((2, 100)));
        assert_eq!(samples(Auto::Value(10), 8.0), Some((2, 10)));
        assert_eq!(samples(Auto::Value(10), 0.0), None);
    }
}
