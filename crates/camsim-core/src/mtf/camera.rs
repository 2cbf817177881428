//! The transfer function of a camera: a slanted edge, rendered through it by the reference renderer.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::{EdgeError, edge_mtf, half_of};
use crate::{
    camera::CameraModel,
    imaging::{LensTransfer, Optics},
    mount::CameraPath,
    pose::BodyState,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{CameraSpec, FlightSpec, MountSpec, PhotometricSpec, Scenario, SceneSpec, ShutterSpec},
    scene::{Encoding, Mesh, MeshVertex, Scene, Texture, Wrap},
    sequence::Sequence,
    trajectory::Trajectory,
    transfer::sinc,
};

/// Sides of the square that the edge is rendered in: the largest that has a ray everywhere.
const SIDES_PX: [u32; 5] = [256, 192, 128, 96, 64];
/// Lean of the edge.
const LEAN_DEG: f64 = 5.0;
/// Linear values of the two sides.
const DARK: u8 = 51;
const BRIGHT: f32 = 0.8;
/// Standard error of the rendered pixels, in 1/255.
const ERROR_DN: f64 = 0.02;
/// Frequencies are multiples of this, up to [`NYQUIST`] of them.
const STEP_CYCLES_PX: f64 = 0.025;
const NYQUIST: u32 = 20;
/// Names of the channels.
const NAMES: [&str; 3] = ["red", "green", "blue"];

/// Transfer functions of a camera across a slanted edge.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CameraMtf {
    /// Width and height of the region in the middle of the picture that was measured.
    pub region_px: [usize; 2],
    /// Angle of the edge.
    pub angle_deg: f64,
    /// Red, green and blue, or one for all.
    pub channels: Vec<ChannelMtf>,
}

/// Transfer functions of a channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelMtf {
    /// "red", "green", "blue", or "all".
    pub channel: &'static str,
    /// Frequency at which half is left, measured; `None` if it is above 1 cycle per pixel.
    pub mtf50_cycles_px: Option<f64>,
    /// That of the model.
    pub model_mtf50_cycles_px: Option<f64>,
    /// Largest difference up to the Nyquist frequency, 0.5 cycles per pixel.
    pub largest_difference: f64,
    /// Values by frequency.
    pub curve: Vec<MtfPoint>,
}

/// Transfer functions at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MtfPoint {
    /// The frequency.
    pub cycles_px: f64,
    /// By the slanted edge.
    pub measured: f64,
    /// Of lens and pixel, by their formulas.
    pub model: f64,
    /// Of the lens alone.
    pub lens: f64,
}

/// A part of a picture with an edge: linear light of red, green and blue, row by row.
#[derive(Clone, Debug)]
pub struct EdgePicture {
    /// Width, height.
    pub size: [usize; 2],
    /// Values.
    pub channels: [Vec<f64>; 3],
}

impl EdgePicture {
    /// Whether the channels are alike, but for rounding.
    fn is_gray(&self) -> bool {
        let [red, green, blue] = &self.channels;
        let mut pixels = red.iter().zip(green).zip(blue);
        pixels.all(|((r, g), b)| (r - g).abs().max((g - b).abs()) < 1e-4)
    }
}

/// Measures the transfer function of a camera by [`slanted_edge`], beside that of its model: that of the
/// pixel's area times that of its point spread. Glare, which takes the same fraction from all frequencies above
/// 0, is in neither.
///
/// # Errors
/// A camera that cannot be used, or that has too few rays in the middle of its picture.
pub fn camera_mtf(camera: &CameraSpec) -> Result<CameraMtf, EdgeError> {
    picture_mtf(camera, &slanted_edge(camera)?)
}

/// As [`camera_mtf`], of any picture of an edge.
///
/// # Errors
/// The picture has no slanted edge.
pub fn picture_mtf(camera: &CameraSpec, picture: &EdgePicture) -> Result<CameraMtf, EdgeError> {
    let transfer = LensTransfer::new(camera);
    let is_gray = transfer.is_gray() && picture.is_gray();
    let channels = if is_gray { 0..1 } else { 0..3 };
    let mut mtf = CameraMtf { region_px: picture.size, angle_deg: 0.0, channels: Vec::new() };
    for channel in channels {
        let edge = edge_mtf(&picture.channels[channel], picture.size)?;
        mtf.angle_deg = edge.angle_deg;
        let lens = |cycles_px: f64| transfer.at(channel, cycles_px * edge.normal).norm();
        let pixel = |cycles_px: f64| sinc(cycles_px * edge.normal.x) * sinc(cycles_px * edge.normal.y);
        let model = |cycles_px: f64| lens(cycles_px) * pixel(cycles_px).abs();
        let point = |i: u32| {
            let cycles_px = STEP_CYCLES_PX * f64::from(i);
            let (measured, model) = (edge.at(cycles_px), model(cycles_px));
            MtfPoint { cycles_px, measured, model, lens: lens(cycles_px) }
        };
        let curve: Vec<MtfPoint> = (0..=NYQUIST).map(point).collect();
        let difference = |point: &MtfPoint| (point.measured - point.model).abs();
        mtf.channels.push(ChannelMtf {
            channel: if is_gray { "all" } else { NAMES[channel] },
            mtf50_cycles_px: edge.mtf50(),
            model_mtf50_cycles_px: half_of(model),
            largest_difference: curve.iter().map(difference).fold(0.0, f64::max),
            curve,
        });
    }
    Ok(mtf)
}

/// Renders a straight edge in the middle of a camera's picture: through its lens, by rays over the area of
/// each pixel, and through its point spread. Exposure, vignette, noise and sensor are not applied, and of a zoom
/// lens its zoom table.
///
/// # Errors
/// As [`camera_mtf`].
pub fn slanted_edge(camera: &CameraSpec) -> Result<EdgePicture, EdgeError> {
    let (window, model) = window(camera)?;
    let side = window.size_px[0] as usize;
    let sequence = Arc::new(edge_sequence(&window, &model)?);
    let options = RenderOptions {
        photometric: false,
        tolerance_dn: ERROR_DN,
        max_samples: 8192,
        ..RenderOptions::default()
    };
    let mut frame = ReferenceRenderer::new(sequence)?.render(0, &options);
    if let Some(optics) = Optics::new(&window, 0) {
        optics.spread(frame.color_rgba_mut());
    }
    // The border repeats its pixels, and not the edge.
    let reach_px = LensTransfer::new(camera).reach_px()[1].ceil() as usize;
    let rows = reach_px.min(side / 4)..side - reach_px.min(side / 4);
    let of = |channel: usize| {
        let pixels = frame.color_rgba().chunks_exact(4).skip(rows.start * side).take(rows.len() * side);
        pixels.map(|rgba| f64::from(rgba[channel])).collect()
    };
    Ok(EdgePicture { size: [side, rows.len()], channels: [0, 1, 2].map(of) })
}

/// The camera of a square in the middle of the picture.
fn window(camera: &CameraSpec) -> Result<(CameraSpec, CameraModel), EdgeError> {
    let centre = |size_px: [u32; 2]| size_px.map(|side| 0.5 * (f64::from(side) - 1.0));
    let [cx, cy] = camera.principal_point_px.unwrap_or(centre(camera.size_px));
    let least = SIDES_PX[SIDES_PX.len() - 1];
    for side in SIDES_PX.into_iter().filter(|side| camera.size_px.iter().all(|of| side <= of)) {
        let [left, top] = camera.size_px.map(|of| f64::from((of - side) / 2));
        let window = CameraSpec {
            size_px: [side; 2],
            principal_point_px: Some([cx - left, cy - top]),
            zoom: Vec::new(),
            zoom_track: None,
            mount: MountSpec::default(),
            shutter: ShutterSpec::default(),
            photometric: PhotometricSpec::default(),
            ..camera.clone()
        };
        let model = CameraModel::from_spec(&window)?;
        let outer = f64::from(side);
        let corners = [[-1.0, -1.0], [outer, -1.0], [-1.0, outer], [outer, outer]];
        if corners.into_iter().all(|corner| model.unproject(corner.into()).is_some()) {
            return Ok((window, model));
        }
    }
    Err(EdgeError::NoRays(least))
}

/// A still camera before a dark surface, whose border is a straight line in the picture, and a bright sky.
fn edge_sequence(camera: &CameraSpec, model: &CameraModel) -> Result<Sequence, EdgeError> {
    let side = camera.size_px[0];
    let still = BodyState { ..BodyState::default() };
    let trajectory = Trajectory::listed(vec![0.0], 1.0, vec![still]).ok_or(EdgeError::NoRays(side))?;
    let path = CameraPath::new(trajectory, &camera.mount)?;
    let pose = path.pose(0.0);
    let middle = 0.5 * (f64::from(side) - 1.0);
    let point = |x: f64, y: f64| -> Result<MeshVertex, EdgeError> {
        let uv = model.unproject(DVec2::new(x, y)).ok_or(EdgeError::NoRays(side))?;
        Ok(MeshVertex::new((pose.ned_from_camera * uv.extend(1.0)).as_vec3().to_array(), [0.5; 2]))
    };
    let mut vertices = Vec::new();
    for y in -1..=side as i32 {
        let y = f64::from(y);
        let edge = middle + LEAN_DEG.to_radians().tan() * (y - middle);
        vertices.extend([point(-1.0, y)?, point(edge, y)?]);
    }
    let quads = vertices.len() as u32 / 2 - 1;
    let indices = (0..quads).flat_map(|i| [0, 1, 2, 1, 3, 2].map(|k| 2 * i + k)).collect();
    let texture = Arc::new(Texture::uniform([DARK, DARK, DARK, 255], Encoding::Linear));
    let surface = Mesh::new(vertices, indices, texture, DVec3::ZERO, Wrap::Clamp);
    let scene = Scene { meshes: vec![surface], sky_linear: [BRIGHT; 3], ..Scene::default() };
    let mut scenario = Scenario::new(FlightSpec::new(""), SceneSpec::default());
    scenario.camera = camera.clone();
    Ok(Sequence::in_memory(scenario, path, scene, 1))
}
