//! The camera model on ready-made pictures with depth.

use camsim::{
    core::{
        apply::{FlowField, IdealFrame, Motion, Pipeline, PoseRow, PoseTrack, Settings},
        scenario::{Channel, Preset},
        temporal::{IdealGeometry, displacement::Twist},
    },
    io::raster::pictures::read_vignette,
};
use glam::{DQuat, DVec2, DVec3};
use numpy::{PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::rows,
    camera::Camera,
    engine::in_own_pool,
    error::{OrRaise, input_error},
    frame::{frame_of, plane_array},
};

/// Depth from which on nothing is taken for a surface, as `depth_max_m` of `camsim apply`.
const DEPTH_MAX_M: f32 = 1e9;

/// How the camera moves about the stamp; one of them is given.
#[derive(Debug, FromPyObject)]
pub enum MotionArgument<'py> {
    #[pyo3(transparent)]
    Poses(PosesArgument<'py>),
    #[pyo3(transparent)]
    Flow(FlowArgument<'py>),
    #[pyo3(transparent)]
    Twist(TwistArgument),
}

/// Constant velocity and angular rate in camera axes.
#[derive(Debug, FromPyObject)]
pub struct TwistArgument {
    velocity_m_s: [f64; 3],
    angular_rate_rad_s: [f64; 3],
}

/// A table of poses: time, position, attitude (scalar first).
#[derive(Debug, FromPyObject)]
pub struct PosesArgument<'py> {
    table: PyReadonlyArray2<'py, f64>,
    stamp_s: f64,
}

/// Displacement of each pixel within an interval.
#[derive(Debug, FromPyObject)]
pub struct FlowArgument<'py> {
    px: PyReadonlyArray3<'py, f32>,
    interval_ms: f64,
}

impl MotionArgument<'_> {
    fn motion(&self) -> PyResult<Motion> {
        Ok(match self {
            Self::Twist(twist) => Motion::Twist(Twist {
                velocity_m_s: DVec3::from_array(twist.velocity_m_s),
                rate_rad_s: DVec3::from_array(twist.angular_rate_rad_s),
            }),
            Self::Poses(poses) => {
                let row = |&[t_s, x, y, z, qw, qx, qy, qz]: &[f64; 8]| PoseRow {
                    t_s,
                    position_m: DVec3::new(x, y, z),
                    world_from_camera: DQuat::from_xyzw(qx, qy, qz, qw),
                };
                let rows = rows(&poses.table, "poses")?.iter().map(row).collect();
                Motion::Poses(PoseTrack::new(rows, poses.stamp_s).or_input_error()?)
            }
            Self::Flow(flow) => {
                let shape = flow.px.shape();
                let (px, _) = flow.px.as_slice()?.as_chunks::<2>();
                let size_px = [shape[1] as u32, shape[0] as u32];
                Motion::Flow(FlowField { size_px, px: px.to_vec(), interval_s: 1e-3 * flow.interval_ms })
            }
        })
    }
}

/// What is known of the ideal picture beside its pixels.
#[derive(Debug, FromPyObject)]
pub struct FrameArgument {
    focal_px: [f64; 2],
    principal_point_px: Option<[f64; 2]>,
    instant_ms: f64,
    mark_holes: bool,
}

/// How to apply the camera.
#[derive(Debug, FromPyObject)]
pub struct SettingsArgument {
    paper: bool,
    blur_samples: Option<u32>,
    seed: u64,
    frame: u64,
}

/// Depth as the pipeline wants it: 1/m, 0 where there is none.
fn inverse(depth_m: f32) -> f32 {
    if depth_m > 0.0 && depth_m < DEPTH_MAX_M { 1.0 / depth_m } else { 0.0 }
}

fn ideal_frame(
    color: &PyReadonlyArray3<'_, f32>,
    depth: Option<&PyReadonlyArray2<'_, f32>>,
    about: &FrameArgument,
) -> PyResult<IdealFrame> {
    let frame = frame_of(color)?;
    let (size_px, color_rgba) = (frame.size_px, frame.into_color());
    let [width, height] = size_px.map(f64::from);
    let inverse_depth: Vec<f32> = match depth {
        None => vec![0.0; color_rgba.len() / 4],
        Some(depth) if depth.shape() == &color.shape()[..2] => {
            depth.as_slice()?.iter().map(|depth_m| inverse(*depth_m)).collect()
        }
        Some(depth) => {
            let [rows, columns] = [depth.shape()[0], depth.shape()[1]];
            let message = format!(
                "depth of {columns}x{rows} pixels, and color of {width}x{height}: they must be alike"
            );
            return Err(input_error(message));
        }
    };
    let centre_px = [0.5 * (width - 1.0), 0.5 * (height - 1.0)];
    let mark = |w: &f32| *w == 0.0;
    let holes = match about.mark_holes && depth.is_some() {
        true => inverse_depth.iter().map(mark).collect(),
        false => Vec::new(),
    };
    Ok(IdealFrame {
        geometry: IdealGeometry {
            size_px,
            focal_px: DVec2::from_array(about.focal_px),
            principal_px: DVec2::from_array(about.principal_point_px.unwrap_or(centre_px)),
        },
        color_rgba,
        inverse_depth,
        holes,
        instant_s: 1e-3 * about.instant_ms,
    })
}

/// Applies a camera to a picture with depth: `color`, `depth`, and how many pixels have no source for which
/// reason.
#[pyfunction]
pub fn apply<'py>(
    py: Python<'py>,
    camera: &Camera,
    color: PyReadonlyArray3<'py, f32>,
    depth: Option<PyReadonlyArray2<'py, f32>>,
    motion: MotionArgument<'py>,
    about: FrameArgument,
    settings: SettingsArgument,
) -> PyResult<Bound<'py, PyDict>> {
    let frame = ideal_frame(&color, depth.as_ref(), &about)?;
    let motion = motion.motion()?;
    if depth.is_none() && motion.translates() {
        return Err(input_error(
            "depth is missing, and the camera moves: without depth nothing says by how much surfaces shift; add \
             it, or leave only the rotation",
        ));
    }
    let spec = &camera.spec;
    let settings = Settings {
        preset: if settings.paper { Preset::Paper } else { Preset::Default },
        blur_samples: settings.blur_samples,
        seed: settings.seed,
        frame: settings.frame,
        ..Settings::default()
    };
    let (made, empty) = py.detach(|| {
        let vignette = read_vignette(spec).or_input_error()?;
        in_own_pool(|| {
            let pipeline = Pipeline::new(spec, &frame, &motion, &settings).or_input_error()?;
            Ok::<_, PyErr>(pipeline.render_and_count(vignette.as_ref()))
        })
    })?;
    let size = [made.size_px[1] as usize, made.size_px[0] as usize];
    let parts = PyDict::new(py);
    for plane in made.planes.into_iter().filter(|plane| plane.channel != Channel::Raw) {
        parts.set_item(plane.channel.name(), plane_array(py, plane.values, size)?)?;
    }
    parts.set_item("no_ray", empty.no_ray)?;
    parts.set_item("outside", empty.outside)?;
    parts.set_item("holes", empty.holes)?;
    parts.set_item("unknown_flow", empty.unknown_flow)?;
    parts.set_item("torn_flow", empty.torn_flow)?;
    Ok(parts)
}
