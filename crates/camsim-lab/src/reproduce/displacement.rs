//! The paper's pipeline in f64 (its fig. 2): one ideal frame at the stamp, and for each output pixel a
//! displacement at constant twist and depth.
//!
//! It shows the errors of the paper's approximations: camsim itself puts the ideal frame in the middle of the
//! window and uses the true pose of every row. Where the paper leaves a choice open, this follows the paper's
//! program: the depth is that of the nearest ideal pixel at the ray.

use std::sync::Arc;

use camsim_core::{
    frame::RenderedFrame,
    pose::CameraPose,
    scenario::{CameraSpec, Channel, LensSpec, ShutterSpec},
    scene::{linear_from_srgb, srgb_from_linear},
    sequence::Sequence,
    temporal::{
        ColorImage, IdealGeometry,
        displacement::{Twist, image_rate, rk2, rk2_steps},
    },
};
use camsim_engine::Engine;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{ReproduceError, test_bench};

/// Size of the ideal frame over that of the output, as in the paper's program.
const MARGIN: f64 = 1.7;

/// A displacement model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DisplacementModel {
    /// Straight steps (eq. 16). The value is the largest rotation of a step, radians; infinity means one
    /// step.
    Linear(f64),
    /// Heun's steps (eq. 18). The value is the largest rotation of a step, radians.
    Rk2(f64),
}

impl DisplacementModel {
    /// Image position, `dt_s` ago, of the point that is at `uv` now.
    #[must_use]
    pub fn displace(self, uv: DVec2, inverse_depth: f64, twist: &Twist, dt_s: f64) -> DVec2 {
        match self {
            Self::Linear(step_rad) => {
                let steps = rk2_steps(twist, dt_s, step_rad);
                let step_s = dt_s / f64::from(steps);
                (0..steps).fold(uv, |uv, _| uv - image_rate(uv, inverse_depth, twist) * step_s)
            }
            Self::Rk2(step_rad) => rk2(uv, inverse_depth, twist, dt_s, step_rad),
        }
    }
}

/// Positions of the exposure samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplePath {
    /// On the straight line between the sources of the two ends (section 6.2).
    Straight,
    /// At the source of each sample's own instant.
    Curved,
}

/// Values in which exposure samples are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Averaging {
    /// Linear values.
    Linear,
    /// Stored sRGB values, as the paper does.
    Stored,
}

/// An ideal frame at one instant: colour and depth.
#[derive(Clone, Debug)]
pub struct PaperIdealFrame {
    /// Size, focal length and principal point.
    pub geometry: IdealGeometry,
    /// Camera pose.
    pub pose: CameraPose,
    /// Twist of the camera at the instant.
    pub twist: Twist,
    rgba: Vec<f32>,
    inverse_depth: Vec<f32>,
}

impl PaperIdealFrame {
    /// Renders the ideal frame of a sequence at `stamp_s`, larger than the output by [`MARGIN`].
    ///
    /// # Errors
    /// Any error of rendering.
    pub fn render(engine: &Engine, sequence: &Sequence, stamp_s: f64) -> Result<Self, ReproduceError> {
        let mut wide = Sequence::clone(&test_bench::with_shutter(sequence, stamp_s, ShutterSpec::default()));
        let (camera, _) = test_bench::camera_and_shutter(sequence)?;
        let spec = &mut wide.scenario.camera;
        spec.size_px = camera.size_px.map(|side| (MARGIN * f64::from(side)).round() as u32);
        let border = [0, 1].map(|k| (spec.size_px[k] - camera.size_px[k]) as f64 / 2.0);
        let principal_px = camera.principal_point_px + DVec2::from_array(border);
        spec.principal_point_px = Some(principal_px.to_array());
        spec.lens = LensSpec::default();
        spec.photometric = Default::default();
        let geometry = IdealGeometry { size_px: spec.size_px, focal_px: camera.focal_px, principal_px };
        let path = sequence.path.clone();
        let frame = test_bench::render(engine, &Arc::new(wide), &[Channel::Color, Channel::Depth], [0])?
            .pop()
            .map(|finished| finished.frame);
        let Some(inverse_depth) = frame.as_ref().and_then(inverse_depth) else {
            return Err(ReproduceError::setup("the ideal frame", "it has no depth"));
        };
        let pose = path.pose(stamp_s);
        let camera_from_ned = pose.ned_from_camera.inverse();
        let twist = Twist {
            velocity_m_s: camera_from_ned * path.velocity_ned(stamp_s),
            rate_rad_s: path.rate_camera(stamp_s),
        };
        let rgba = frame.map(RenderedFrame::into_color).unwrap_or_default();
        Ok(Self { geometry, pose, twist, rgba, inverse_depth })
    }

    /// Source of an output pixel's ray, `dt_s` after the stamp, in this frame.
    #[must_use]
    pub fn source_px(&self, uv: DVec2, dt_s: f64, model: DisplacementModel) -> DVec2 {
        self.geometry
            .px_from_point(model.displace(uv, self.nearest_inverse_depth(uv), &self.twist, dt_s).extend(1.0))
    }

    /// The camera's output frame by the paper's method, with `samples` exposure samples (1 without exposure).
    /// A pixel is invalid if all its samples are outside of this frame.
    ///
    /// # Errors
    /// A camera that cannot be used.
    pub fn frame(
        &self,
        camera: &CameraSpec,
        model: DisplacementModel,
        samples: u32,
        path: SamplePath,
        averaging: Averaging,
    ) -> Result<RenderedFrame, ReproduceError> {
        let (lens, shutter) = test_bench::model_and_shutter(camera)?;
        let [width, height] = camera.size_px;
        let pixel = |i: u32| {
            let [x, y] = [i % width, i / width];
            let color = lens.unproject(DVec2::new(f64::from(x), f64::from(y))).and_then(|uv| {
                let dt_s = shutter.dt_pixel_s(x, y);
                let source_px = |phase: f64| self.source_px(uv, dt_s + phase * shutter.exposure_s(), model);
                let ends = [-0.5, 0.5].map(source_px);
                let phases = (0..samples.max(1))
                    .map(|i| if samples < 2 { 0.0 } else { f64::from(i) / f64::from(samples - 1) - 0.5 });
                match path {
                    SamplePath::Straight => {
                        self.mean(phases.map(|phase| ends[0].lerp(ends[1], phase + 0.5)), averaging)
                    }
                    SamplePath::Curved => self.mean(phases.map(source_px), averaging),
                }
            });
            color.map_or([0.0; 4], |c| [c.x as f32, c.y as f32, c.z as f32, 1.0])
        };
        let color_rgba = (0..width * height).into_par_iter().flat_map_iter(pixel).collect();
        Ok(RenderedFrame::picture(camera.size_px, color_rgba))
    }

    /// As [`Self::frame`], without exposure.
    ///
    /// # Errors
    /// A camera that cannot be used.
    pub fn instant(
        &self,
        camera: &CameraSpec,
        model: DisplacementModel,
    ) -> Result<RenderedFrame, ReproduceError> {
        self.frame(camera, model, 1, SamplePath::Straight, Averaging::Linear)
    }

    fn nearest_inverse_depth(&self, uv: DVec2) -> f64 {
        let [width, height] = self.geometry.size_px;
        let last = DVec2::new(f64::from(width) - 1.0, f64::from(height) - 1.0);
        let pixel = self.geometry.px_from_point(uv.extend(1.0)).round().clamp(DVec2::ZERO, last);
        f64::from(self.inverse_depth[pixel.y as usize * width as usize + pixel.x as usize])
    }

    /// Mean colour of the sources that are within this frame.
    fn mean(&self, sources_px: impl Iterator<Item = DVec2>, averaging: Averaging) -> Option<DVec3> {
        let image = ColorImage { size_px: self.geometry.size_px, rgba: &self.rgba };
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for source_px in sources_px.filter(|&source_px| self.geometry.contains(source_px)) {
            let color = image.sample(source_px);
            sum += match averaging {
                Averaging::Linear => color,
                Averaging::Stored => map_channels(color, srgb_from_linear),
            };
            count += 1.0;
        }
        let mean = sum / count;
        (count > 0.0).then(|| match averaging {
            Averaging::Linear => mean,
            Averaging::Stored => map_channels(mean, linear_from_srgb),
        })
    }
}

/// Applies a function to each channel.
fn map_channels(color: DVec3, change: fn(f32) -> f32) -> DVec3 {
    DVec3::from_array(color.to_array().map(|value| f64::from(change(value as f32))))
}
/// Inverse depths of a frame; 0 for the sky.
fn inverse_depth(frame: &RenderedFrame) -> Option<Vec<f32>> {
    let inverse = |&depth_m: &f32| if depth_m > 0.0 { 1.0 / depth_m } else { 0.0 };
    Some(frame.depth_m()?.iter().map(inverse).collect())
}
