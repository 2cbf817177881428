//! The paper's pipeline on one ideal frame (its fig. 2): every output pixel is taken back to the frame's
//! stamp at constant twist and depth.
//!
//! camsim itself draws the ideal frame in the middle of what the output frame sees and takes the true pose of
//! every row; this is what the paper does instead, in f64, so that what its approximations cost can be seen.
//! Choices that the paper leaves open are the reference program's: depth is that of the ideal frame's nearest
//! pixel at the ray's own place.

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    frame::RenderedFrame,
    pose::CameraPose,
    scenario::{CameraSpec, Channel, LensSpec, ShutterSpec},
    scene::{linear_from_srgb, srgb_from_linear},
    sequence::Sequence,
    shutter::Shutter,
    temporal::{
        ColorImage, IdealGeometry,
        displacement::{Twist, image_rate, rk2, rk2_steps},
    },
};
use camsim_engine::Engine;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{ReproduceError, rig};

/// By how much the ideal frame is larger than the output, as in the reference program.
const MARGIN: f64 = 1.7;

/// A displacement model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// Straight steps (eq. 16) of at most this rotation, radians; infinity is one step.
    Linear(f64),
    /// Heun's steps (eq. 18) of at most this rotation, radians.
    Rk2(f64),
}

impl Model {
    /// Where the point now seen at `uv` was `dt_s` ago.
    #[must_use]
    pub fn displace(self, uv: DVec2, inverse_depth: f64, twist: &Twist, dt_s: f64) -> DVec2 {
        match self {
            Self::Linear(step_rad) => {
                let steps = rk2_steps(twist, dt_s, step_rad);
                let step_s = dt_s / f64::from(steps);
                (0..steps).fold(uv, |at, _| at - image_rate(at, inverse_depth, twist) * step_s)
            }
            Self::Rk2(step_rad) => rk2(uv, inverse_depth, twist, dt_s, step_rad),
        }
    }
}

/// Where the samples of an exposure are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// On the straight line between the places of its two ends (section 6.2).
    Straight,
    /// Each at the place of its own instant.
    Curved,
}

/// In what the exposure's samples are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// Light.
    Linear,
    /// Stored sRGB values, as the paper does.
    Stored,
}

/// An ideal colour and depth frame at one instant.
#[derive(Clone, Debug)]
pub struct Ideal {
    /// Its pixels.
    pub geometry: IdealGeometry,
    /// Its pose.
    pub pose: CameraPose,
    /// Motion at its instant.
    pub twist: Twist,
    rgba: Vec<f32>,
    inverse_depth: Vec<f32>,
}

impl Ideal {
    /// The ideal frame of a sequence at `stamp_s`, larger than the output by the margin on all sides.
    ///
    /// # Errors
    /// The device.
    pub fn at(engine: &Engine, sequence: &Sequence, stamp_s: f64) -> Result<Self, ReproduceError> {
        let mut wide = Sequence::clone(&rig::at(sequence, stamp_s, ShutterSpec::default()));
        let (camera, _) = rig::checked(sequence)?;
        let spec = &mut wide.scenario.camera;
        spec.size_px = camera.size_px.map(|side| (MARGIN * f64::from(side)).round() as u32);
        let border = [0, 1].map(|k| (spec.size_px[k] - camera.size_px[k]) as f64 / 2.0);
        let principal_px = camera.principal_point_px + DVec2::from_array(border);
        spec.principal_point_px = Some(principal_px.to_array());
        spec.lens = LensSpec::default();
        spec.photometric = Default::default();
        let geometry = IdealGeometry { size_px: spec.size_px, focal_px: camera.focal_px, principal_px };
        let path = sequence.path.clone();
        let frame = rig::render(engine, &Arc::new(wide), &[Channel::Color, Channel::Depth], [0])?
            .pop()
            .map(|finished| finished.frame);
        let (Some(pose), Some(RenderedFrame { color_rgba, depth_m: Some(depth_m), .. })) =
            (Some(path.pose(stamp_s)), frame)
        else {
            return Err(ReproduceError::made("the ideal frame", "it has no depth"));
        };
        let camera_from_ned = pose.ned_from_camera.inverse();
        let twist = Twist {
            velocity_m_s: camera_from_ned * path.velocity_ned(stamp_s),
            rate_rad_s: path.rate_camera(stamp_s),
        };
        let inverse_depth =
            depth_m.iter().map(|&depth_m| if depth_m > 0.0 { 1.0 / depth_m } else { 0.0 }).collect();
        Ok(Self { geometry, pose, twist, rgba: color_rgba, inverse_depth })
    }

    /// Where an ideal ray of the output, `dt_s` after the stamp, looks in this frame.
    #[must_use]
    pub fn source_px(&self, uv: DVec2, dt_s: f64, model: Model) -> DVec2 {
        self.geometry
            .px_from_point(model.displace(uv, self.nearest_inverse_depth(uv), &self.twist, dt_s).extend(1.0))
    }

    /// The camera's frame by the paper's method, `samples` of the exposure from one end to the other (1
    /// without exposure). A pixel whose samples all lie outside of this frame is not valid.
    ///
    /// # Errors
    /// A camera that cannot be used.
    pub fn frame(
        &self,
        camera: &CameraSpec,
        model: Model,
        samples: u32,
        path: Path,
        light: Light,
    ) -> Result<RenderedFrame, ReproduceError> {
        let lens =
            CameraModel::from_spec(camera).map_err(|error| ReproduceError::made("the camera", error))?;
        let shutter = Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)
            .map_err(|error| ReproduceError::made("the shutter", error))?;
        let [width, height] = camera.size_px;
        let pixel = |i: u32| {
            let [x, y] = [i % width, i / width];
            let color = lens.unproject(DVec2::new(f64::from(x), f64::from(y))).and_then(|uv| {
                let dt_s = shutter.dt_pixel_s(x, y);
                let place = |phase: f64| self.source_px(uv, dt_s + phase * shutter.exposure_s(), model);
                let ends = [-0.5, 0.5].map(place);
                let phases = (0..samples.max(1))
                    .map(|i| if samples < 2 { 0.0 } else { f64::from(i) / f64::from(samples - 1) - 0.5 });
                match path {
                    Path::Straight => {
                        self.mean(phases.map(|phase| ends[0].lerp(ends[1], phase + 0.5)), light)
                    }
                    Path::Curved => self.mean(phases.map(place), light),
                }
            });
            color.map_or([0.0; 4], |c| [c.x as f32, c.y as f32, c.z as f32, 1.0])
        };
        let color_rgba = (0..width * height).into_par_iter().flat_map_iter(pixel).collect();
        Ok(RenderedFrame { size_px: camera.size_px, color_rgba, ..RenderedFrame::default() })
    }

    fn nearest_inverse_depth(&self, uv: DVec2) -> f64 {
        let [width, height] = self.geometry.size_px;
        let last = DVec2::new(f64::from(width) - 1.0, f64::from(height) - 1.0);
        let at = self.geometry.px_from_point(uv.extend(1.0)).round().clamp(DVec2::ZERO, last);
        f64::from(self.inverse_depth[at.y as usize * width as usize + at.x as usize])
    }

    /// Mean colour of the places that lie on this frame.
    fn mean(&self, places_px: impl Iterator<Item = DVec2>, light: Light) -> Option<DVec3> {
        let image = ColorImage { size_px: self.geometry.size_px, rgba: &self.rgba };
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for at_px in places_px.filter(|&at_px| self.geometry.contains(at_px)) {
            let color = image.sample(at_px);
            sum += match light {
                Light::Linear => color,
                Light::Stored => each(color, srgb_from_linear),
            };
            count += 1.0;
        }
        let mean = sum / count;
        (count > 0.0).then(|| match light {
            Light::Linear => mean,
            Light::Stored => each(mean, linear_from_srgb),
        })
    }
}

fn each(color: DVec3, change: fn(f32) -> f32) -> DVec3 {
    DVec3::from_array(color.to_array().map(|value| f64::from(change(value as f32))))
}
