//! The paper's test bench: a camera that looks straight down at the circle grid from 3 km, in constant
//! rotation or translation.

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    camera::CameraModel,
    frame::RenderedFrame,
    metrics::{Comparison, ImageView, compare},
    mount::CameraPath,
    pose::BodyState,
    reference::ReferenceRenderer,
    scenario::{
        CameraSpec, Channel, FlightSpec, LensModel, LensSpec, MountSpec, QualitySpec, Scenario, ShutterSpec,
    },
    scene::Scene,
    sequence::Sequence,
    shutter::Shutter,
    trajectory::Trajectory,
};
use camsim_engine::{Engine, Finished};
use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;

use super::{
    ReproduceError, Setup,
    circle_grid::{self, SKY_LINEAR},
};

/// Height above the target, metres, from `path-pure-pattern-*.csv` of the paper's program.
pub const HEIGHT_M: f64 = 3000.0;
/// Width of the target, metres.
pub const TARGET_M: f64 = 6000.0;
/// Rotation rate of those files, degrees per second.
pub const TURN_DEG_S: f64 = 36.0;
/// Speed of those files, m/s.
pub const FLIGHT_M_S: f64 = 300.0;
/// Duration of the motion before and after t = 0.
const SPAN_S: f64 = 20.0;

/// Coefficients k1 k2 p1 p2 k3 of the paper's lens, a clip-on fisheye of a phone, by Agisoft Lens (table 2,
/// with the digits of the paper's program).
pub const FISHEYE: [f64; 5] = [-0.390_024, 0.111_124, -0.001_274_4, -0.008_151_7, -0.008_427_63];

/// The paper's camera with the calibration of Agisoft Lens at `width_px` (640 in the paper), looking straight
/// down, without other effects.
#[must_use]
pub fn fisheye(width_px: u32) -> CameraSpec {
    let scale = f64::from(width_px) / 640.0;
    // Integers are pixel corners in the paper.
    let principal = [305.599, 226.736].map(|c| c * scale - 0.5);
    CameraSpec {
        principal_point_px: Some(principal),
        lens: LensSpec { model: LensModel::BrownConrady, coefficients: FISHEYE.to_vec() },
        ..pinhole(width_px)
    }
}

/// A pinhole with the focal length of [`fisheye`] and a centred principal point, as the paper's temporal
/// models assume.
#[must_use]
pub fn pinhole(width_px: u32) -> CameraSpec {
    let focal_px = 307.6075 * f64::from(width_px) / 640.0;
    CameraSpec {
        size_px: [width_px, width_px * 3 / 4],
        focal_px: [focal_px; 2],
        fps: 1.0,
        mount: MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() },
        ..CameraSpec::default()
    }
}

/// Motion of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Velocity (north, east, down), m/s.
    pub velocity_ned_m_s: DVec3,
    /// Body rate about forward, right and down, deg/s. The camera looks down, so the third component is a
    /// clockwise rotation about the optical axis.
    pub rate_body_deg_s: DVec3,
}

impl Motion {
    /// The rotation of the paper's path file.
    #[must_use]
    pub fn turning() -> Self {
        Self { rate_body_deg_s: DVec3::new(0.0, 0.0, TURN_DEG_S), ..Self::default() }
    }

    /// Translation with the speed of the paper's path file, in an image direction (x right, y down).
    #[must_use]
    pub fn flying(right: f64, down: f64) -> Self {
        Self { velocity_ned_m_s: FLIGHT_M_S * DVec3::new(-down, right, 0.0), ..Self::default() }
    }

    /// The trajectory around t = 0, when the camera is above the centre of the target, image top to the
    /// north.
    fn trajectory(&self) -> Option<Trajectory> {
        let rate_body_rad_s = self.rate_body_deg_s * 1f64.to_radians();
        let first = BodyState {
            position_ned_m: DVec3::new(0.0, 0.0, -HEIGHT_M) - SPAN_S * self.velocity_ned_m_s,
            velocity_ned_m_s: self.velocity_ned_m_s,
            ned_from_body: DQuat::from_scaled_axis(-SPAN_S * rate_body_rad_s),
            rate_body_rad_s,
            ..BodyState::default()
        };
        Trajectory::uniform(-SPAN_S, 2.0 * SPAN_S, SPAN_S, vec![first])
    }
}

/// A scenario for a sequence in memory.
#[must_use]
pub fn scenario(camera: CameraSpec) -> Scenario {
    Scenario {
        seed: 12,
        camera,
        // Frames of independent instants share no ideal frame.
        quality: QualitySpec { frames_per_ideal: 1, ..QualitySpec::default() },
        ..Scenario::new(FlightSpec::new("in-memory"), Default::default())
    }
}

/// The sequence of a camera that moves above a scene; the stamp of frame i is `i / fps`.
///
/// # Errors
/// An invalid mount or motion.
pub fn sequence(
    camera: CameraSpec,
    motion: Motion,
    scene: &Arc<Scene>,
) -> Result<Arc<Sequence>, ReproduceError> {
    let trajectory =
        motion.trajectory().ok_or_else(|| ReproduceError::setup("the motion", "it is not finite"))?;
    in_memory(camera, trajectory, 10_000, scene)
}

/// The sequence of a camera on a trajectory, with the first stamp at 0.
///
/// # Errors
/// An invalid mount.
pub fn in_memory(
    camera: CameraSpec,
    trajectory: impl Into<Arc<Trajectory>>,
    frames: u64,
    scene: &Arc<Scene>,
) -> Result<Arc<Sequence>, ReproduceError> {
    let path = CameraPath::new(trajectory, &camera.mount)
        .map_err(|error| ReproduceError::setup("the mount", error))?;
    let sequence = Sequence::in_memory(scenario(camera), path, Scene::default(), frames);
    Ok(Arc::new(Sequence { scene: scene.clone(), ..sequence }))
}

/// The circle grid: the paper's own picture if there is a data folder, otherwise an equal one.
///
/// # Errors
/// The file of the data folder cannot be read.
pub fn target(setup: &Setup<'_>, width_m: f64) -> Result<Arc<Scene>, ReproduceError> {
    let texture = match setup.data_file("camsim/acircles_pattern-patternsX-towards-imageTop(North).gif") {
        Some(path) => camsim_io::raster::pictures::read_texture(&path, camsim_core::scene::Encoding::Srgb)?,
        None => circle_grid::texture(),
    };
    Ok(Arc::new(circle_grid::scene(texture, width_m)))
}

/// The sequence with another shutter, and with the stamp of frame 0 at `stamp_s`.
#[must_use]
pub fn with_shutter(sequence: &Sequence, stamp_s: f64, shutter: ShutterSpec) -> Arc<Sequence> {
    let mut sequence = sequence.clone();
    sequence.scenario.camera.shutter = shutter;
    sequence.start_s = stamp_s;
    Arc::new(sequence)
}

/// Renders frames.
///
/// # Errors
/// Any error of rendering.
pub fn render(
    engine: &Engine,
    sequence: &Arc<Sequence>,
    channels: &[Channel],
    frames: impl IntoIterator<Item = u64>,
) -> Result<Vec<Finished>, ReproduceError> {
    render_at_phase(engine, sequence, channels, frames, 0.0)
}

/// Renders frames with source coordinates at `phase` of the exposure, -0.5 to 0.5.
///
/// # Errors
/// As [`render`].
pub fn render_at_phase(
    engine: &Engine,
    sequence: &Arc<Sequence>,
    channels: &[Channel],
    frames: impl IntoIterator<Item = u64>,
    phase: f32,
) -> Result<Vec<Finished>, ReproduceError> {
    let mut session = engine.session::<Infallible>(sequence.clone(), channels)?;
    session.set_coords_phase(phase);
    let mut done = Vec::new();
    session.render::<Infallible>(frames, &mut |finished| {
        done.push(finished);
        Ok(())
    })?;
    Ok(done)
}

/// Renders frame 0.
///
/// # Errors
/// As [`render`].
pub fn render_first(engine: &Engine, sequence: &Arc<Sequence>) -> Result<RenderedFrame, ReproduceError> {
    let mut frames = render(engine, sequence, &[Channel::Color], [0])?;
    frames
        .pop()
        .map(|finished| finished.frame)
        .ok_or_else(|| ReproduceError::setup("the sequence", "it gave no frame"))
}

/// The frame of a perfect camera at `stamp_s`.
///
/// # Errors
/// As [`render`].
pub fn snapshot(engine: &Engine, sequence: &Sequence, stamp_s: f64) -> Result<RenderedFrame, ReproduceError> {
    render_first(engine, &with_shutter(sequence, stamp_s, ShutterSpec::default()))
}

/// Mean of frames of one size, in linear values. A pixel is valid if it is valid in all of them.
#[must_use]
pub fn mean<'a>(frames: impl IntoIterator<Item = &'a RenderedFrame>) -> RenderedFrame {
    let mut frames = frames.into_iter();
    let Some(first) = frames.next() else { return RenderedFrame::default() };
    let mut sum = first.clone();
    let mut count = 1.0_f32;
    for frame in frames {
        count += 1.0;
        for (sum, value) in sum.color_rgba_mut().chunks_exact_mut(4).zip(frame.color_rgba().chunks_exact(4)) {
            (0..3).for_each(|k| sum[k] += value[k]);
            sum[3] = sum[3].min(value[3]);
        }
    }
    sum.color_rgba_mut().chunks_exact_mut(4).for_each(|pixel| (0..3).for_each(|k| pixel[k] /= count));
    sum
}

/// Difference of two frames in linear values.
///
/// # Errors
/// The frames have different sizes.
pub fn difference(a: &RenderedFrame, b: &RenderedFrame) -> Result<Comparison, ReproduceError> {
    fn view(frame: &RenderedFrame) -> ImageView<'_> {
        ImageView { size_px: frame.size_px, channels: 4, alpha: Some(3), samples: frame.color_rgba() }
    }
    compare(view(a), view(b)).map_err(|error| ReproduceError::setup("the pair of pictures", error))
}

/// The reference renderer of a sequence.
///
/// # Errors
/// An invalid camera or shutter.
pub fn reference(sequence: &Arc<Sequence>) -> Result<ReferenceRenderer, ReproduceError> {
    ReferenceRenderer::new(sequence.clone()).map_err(|error| ReproduceError::setup("the camera", error))
}

/// Number of pixels of frame 0 that show the target where the exact ray through their centre hits nothing, or
/// the sky where it hits the target.
///
/// # Errors
/// An invalid camera.
pub fn count_wrong_surface(sequence: &Arc<Sequence>, frame: &RenderedFrame) -> Result<usize, ReproduceError> {
    let reference = reference(sequence)?;
    let [width, _] = frame.size_px;
    // The sky is blue, the target grey. A border pixel with similar fractions of both is right either way.
    let sky_fraction = |pixel: &[f32]| (pixel[2] - pixel[0]) / (SKY_LINEAR[2] - SKY_LINEAR[0]);
    let view = reference.view(0);
    let wrong = frame.color_rgba().par_chunks_exact(4).enumerate().filter(|(i, pixel)| {
        let position = [*i as u32 % width, *i as u32 / width];
        let sample = view.sample(position, DVec2::ZERO, 0.0);
        sample.is_some_and(|sample| {
            pixel[3] > 0.0
                && if sample.hit.is_some() { sky_fraction(pixel) > 0.75 } else { sky_fraction(pixel) < 0.25 }
        })
    });
    Ok(wrong.count())
}

/// Projects a point into a frame with a rolling shutter without fields, by fixed-point iteration: the time
/// depends on the row, and the row on the time. `None` behind the camera or beyond the fold of the lens.
#[must_use]
pub fn project(
    sequence: &Sequence,
    camera: &CameraModel,
    shutter: &Shutter,
    stamp_s: f64,
    point_ned_m: DVec3,
) -> Option<DVec2> {
    let rows = f64::from(camera.size_px[1]);
    let mut t_s = stamp_s - shutter.delay_s();
    let mut position_px = DVec2::ZERO;
    for _ in 0..60 {
        let pose = sequence.path.pose(t_s);
        let in_camera = pose.ned_from_camera.inverse() * (point_ned_m - pose.position_ned_m);
        let ideal = in_camera.truncate() / in_camera.z;
        if in_camera.z <= 0.0 || !camera.lens.contains(ideal) {
            return None;
        }
        let previous_px = std::mem::replace(&mut position_px, camera.project(ideal));
        t_s = stamp_s - shutter.delay_s() + ((position_px.y + 0.5) / rows - 0.5) * shutter.readout_s();
        if previous_px.distance(position_px) < 1e-9 {
            break;
        }
    }
    Some(position_px)
}

/// Camera model and shutter of a sequence.
///
/// # Errors
/// An invalid camera or shutter.
pub fn camera_and_shutter(sequence: &Sequence) -> Result<(CameraModel, Shutter), ReproduceError> {
    model_and_shutter(&sequence.scenario.camera)
}

/// Model and shutter of a camera.
///
/// # Errors
/// An invalid camera or shutter.
pub fn model_and_shutter(spec: &CameraSpec) -> Result<(CameraModel, Shutter), ReproduceError> {
    let camera = CameraModel::from_spec(spec).map_err(|error| ReproduceError::setup("the camera", error))?;
    let shutter = Shutter::from_spec(&spec.shutter, spec.fps, spec.size_px)
        .map_err(|error| ReproduceError::setup("the shutter", error))?;
    Ok((camera, shutter))
}

/// Images of the target's circles in the frame with the stamp `stamp_s`, in the order of the grid; `None` for those
/// that are not wholly within the frame with a margin of 3 px.
///
/// # Errors
/// An invalid camera or shutter.
pub fn grid_images(
    sequence: &Sequence,
    stamp_s: f64,
    target_m: f64,
) -> Result<Vec<Option<circle_grid::CircleImage>>, ReproduceError> {
    let (camera, shutter) = camera_and_shutter(sequence)?;
    let last = DVec2::new(f64::from(camera.size_px[0]) - 1.0, f64::from(camera.size_px[1]) - 1.0);
    let is_inside = |circle: &circle_grid::CircleImage| {
        let [low, high] = circle.bounds_px;
        low.cmpge(DVec2::splat(3.0)).all() && high.cmple(last - 3.0).all()
    };
    let image = |circle: &circle_grid::Circle| {
        circle.image(|point| project(sequence, &camera, &shutter, stamp_s, point)).filter(is_inside)
    };
    Ok(circle_grid::circles(target_m).iter().map(image).collect())
}

/// The circles of [`grid_images`] that are within the frame.
///
/// # Errors
/// An invalid camera or shutter.
pub fn circles_in_view(
    sequence: &Sequence,
    stamp_s: f64,
    target_m: f64,
) -> Result<Vec<circle_grid::CircleImage>, ReproduceError> {
    Ok(grid_images(sequence, stamp_s, target_m)?.into_iter().flatten().collect())
}
