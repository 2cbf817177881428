//! Faces: the flat ideal frames that a wide field is divided among.

use camsim_core::{
    camera::{CameraError, CameraModel},
    scenario::{Channel, Face, Preset},
    sequence::Sequence,
};
use glam::{DVec2, DVec3};

/// Largest tangent of a ray in one flat ideal frame: an angle of 85 degrees. What lies beyond is taken by the
/// frame's motion too easily.
const MOST_TANGENT: f64 = 11.4;
/// Several faces are worth their passes if they take less than this part of the area of a single frame.
const WORTHWHILE_AREA: f64 = 0.4;
/// Pixels between those whose rays are looked at.
const STEP_PX: u32 = 4;

/// Bounds of tangents.
#[derive(Clone, Copy)]
struct Extent {
    low: DVec2,
    high: DVec2,
}

impl Extent {
    const NOTHING: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    fn with(self, tangent: DVec2) -> Self {
        Self { low: self.low.min(tangent), high: self.high.max(tangent) }
    }

    fn area(self) -> f64 {
        let size = self.high - self.low;
        if size.min_element() >= 0.0 { size.x * size.y } else { 0.0 }
    }
}

/// The faces that the frames of a sequence are made from, or none where one flat ideal frame will do: it holds
/// every ray of the lens, and takes not much more area than faces would.
///
/// Zoom lenses and the paper's preset have one frame, and so has the channel `coords`, which refers to it,
/// as long as that holds the rays.
///
/// # Errors
/// An invalid camera.
pub fn faces(sequence: &Sequence, channels: &[Channel]) -> Result<Vec<Face>, CameraError> {
    let scenario = &sequence.scenario;
    let is_single = scenario.camera.face.is_some()
        || !scenario.camera.zoom.is_empty()
        || scenario.quality.preset == Preset::Paper;
    if is_single {
        return Ok(Vec::new());
    }
    let camera = CameraModel::from_spec(&scenario.camera)?;
    let (mut flat, mut of_face) = (Some(Extent::NOTHING), [Extent::NOTHING; Face::ALL.len()]);
    for direction in directions(&camera) {
        let tangent = |axes: DVec3| axes.truncate() / axes.z;
        let is_flat = direction.truncate().length() < MOST_TANGENT * direction.z;
        flat = flat.filter(|_| is_flat).map(|flat| flat.with(tangent(direction)));
        let face = Face::of(direction);
        let extent = &mut of_face[face as usize];
        *extent = extent.with(tangent(face.camera_from_face().conjugate() * direction));
    }
    let faces_area: f64 = of_face.iter().map(|extent| extent.area()).sum();
    let is_worthwhile = match flat {
        None => true,
        Some(_) if channels.contains(&Channel::Coords) => false,
        Some(flat) => faces_area < WORTHWHILE_AREA * flat.area(),
    };
    let is_seen = |face: &Face| of_face[*face as usize].low.is_finite();
    Ok(if is_worthwhile { Face::ALL.into_iter().filter(is_seen).collect() } else { Vec::new() })
}

/// Directions of pixels all over the picture, its borders included.
fn directions(camera: &CameraModel) -> impl Iterator<Item = DVec3> + '_ {
    let ticks = |size: u32| (0..size).step_by(STEP_PX as usize).chain([size - 1]);
    let [width, height] = camera.size_px;
    ticks(height)
        .flat_map(move |y| ticks(width).map(move |x| DVec2::new(f64::from(x), f64::from(y))))
        .filter_map(|pixel| camera.ray(pixel))
}
