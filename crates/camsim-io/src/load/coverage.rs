//! What a flight over terrain sees, and warnings of too much: ground beyond the ortho-image, and sky.

use camsim_core::{camera::CameraModel, scenario::Beyond, scene::Aabb, sequence::Sequence};
use glam::{DVec2, DVec3};

use crate::raster::TerrainSummary;

/// Number of frames that are sampled.
const FRAMES: u64 = 25;
/// Number of sampled pixels along each side of a frame.
const SAMPLES_PER_SIDE: u32 = 12;
/// Fraction of sky from which it is reported; a level camera sees half of it.
const MOST_SKY: f64 = 0.75;

/// What a sampled pixel sees.
struct Sample {
    frame: u64,
    from_ned_m: DVec3,
    /// `None` where the lens has no ray.
    direction_ned: Option<DVec3>,
}

/// Samples of frames and pixels of a fixed lens.
fn samples(sequence: &Sequence) -> Vec<Sample> {
    let Ok(camera) = CameraModel::from_spec(&sequence.scenario.camera) else { return Vec::new() };
    let size_px = DVec2::from_array(camera.size_px.map(f64::from));
    let frames = (0..sequence.frames).step_by(sequence.frames.div_ceil(FRAMES).max(1) as usize);
    let of_frame = |frame: u64| {
        let pose = sequence.path.pose(sequence.start_s + frame as f64 / sequence.scenario.camera.fps);
        let pixels = (0..SAMPLES_PER_SIDE).flat_map(|y| (0..SAMPLES_PER_SIDE).map(move |x| [x, y]));
        let of_pixel = |pixel: [u32; 2]| {
            let uv = (DVec2::from_array(pixel.map(f64::from)) + 0.5) / f64::from(SAMPLES_PER_SIDE);
            let ray = camera.ray(uv * size_px - 0.5);
            Sample {
                frame,
                from_ned_m: pose.position_ned_m,
                direction_ned: ray.map(|ray| pose.ned_from_camera * ray),
            }
        };
        pixels.map(of_pixel).collect::<Vec<_>>()
    };
    frames.flat_map(of_frame).collect()
}

/// Warns how much of the frames is ground beyond the ortho-image.
pub(super) fn ortho_warning(sequence: &Sequence, summary: &TerrainSummary) -> Option<String> {
    let spec = sequence.scenario.scene.terrain.as_ref()?;
    if summary.outside_ortho == 0 || spec.beyond == Beyond::Void {
        return None;
    }
    let terrain = sequence.scene.terrain.as_ref()?;
    let [min_uv, max_uv] = summary.ortho_uv;
    let is_beyond = |sample: &Sample| {
        let hit = terrain.intersect(sample.from_ned_m, sample.direction_ned?, f64::INFINITY)?;
        Some((0..2).any(|k| !(min_uv[k]..=max_uv[k]).contains(&hit.uv[k])))
    };
    let samples = samples(sequence);
    let beyond: Vec<u64> =
        samples.iter().filter(|sample| is_beyond(sample) == Some(true)).map(|sample| sample.frame).collect();
    let in_frames = beyond.chunk_by(|a, b| a == b);
    let (most, frame) = in_frames.map(|of_frame| (of_frame.len(), of_frame[0])).max()?;
    let percent = |part: usize, all: usize| 100.0 * part as f64 / all as f64;
    Some(format!(
        "about {:.0} % of the frames is ground beyond the ortho-image, {:.0} % of frame {frame}: see scene.terrain.beyond",
        percent(beyond.len(), samples.len()),
        percent(most, (SAMPLES_PER_SIDE * SAMPLES_PER_SIDE) as usize)
    ))
}

/// What the frames of a flight over terrain see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlook {
    /// Smallest and largest height of the camera above the ground under it, metres; below 0 under ground.
    pub above_ground_m: [f64; 2],
    /// Fraction of sky, 0 to 1.
    pub sky: f64,
}

/// What up to 25 frames see; `None` without terrain, or where no frame is above or below it.
#[must_use]
pub fn outlook(sequence: &Sequence) -> Option<Outlook> {
    let terrain = sequence.scene.terrain.as_ref()?;
    let height_m = |sample: &Sample| {
        let to = |direction| terrain.intersect(sample.from_ned_m, direction, f64::INFINITY).map(|hit| hit.t);
        to(DVec3::Z).or_else(|| to(DVec3::NEG_Z).map(|t| -t))
    };
    let samples = samples(sequence);
    let firsts = samples.chunk_by(|a, b| a.frame == b.frame).map(|of_frame| &of_frame[0]);
    let heights_m: Vec<f64> = firsts.filter_map(height_m).collect();
    let above_ground_m =
        [heights_m.iter().copied().reduce(f64::min)?, heights_m.iter().copied().reduce(f64::max)?];
    Some(Outlook { above_ground_m, sky: sky_fraction(sequence, &samples)? })
}

/// Fraction of samples that see sky. Models and patterns count as the boxes around them.
fn sky_fraction(sequence: &Sequence, samples: &[Sample]) -> Option<f64> {
    let scene = &sequence.scene;
    let terrain = scene.terrain.as_ref()?;
    let boxes: Vec<Aabb> = scene.meshes.iter().map(|mesh| mesh.bounds()).collect();
    let sees_sky = |sample: &Sample| {
        let (from, direction) = (sample.from_ned_m, sample.direction_ned?);
        Some(!terrain.blocks(from, direction) && !boxes.iter().any(|bounds| is_hit(bounds, from, direction)))
    };
    let seen: Vec<bool> = samples.iter().filter_map(sees_sky).collect();
    Some(seen.iter().filter(|is_sky| **is_sky).count() as f64 / seen.len().max(1) as f64)
}

/// Warns how much of the frames is sky.
pub(super) fn sky_warning(sequence: &Sequence) -> Option<String> {
    let fraction = sky_fraction(sequence, &samples(sequence))?;
    (fraction > MOST_SKY).then(|| {
        format!(
            "about {:.0} % of the frames is sky, or positions where the terrain has no heights: check camera.mount, \
             flight.height and the position of the terrain",
            100.0 * fraction
        )
    })
}

/// Whether a ray meets a box.
fn is_hit(bounds: &Aabb, from: DVec3, direction: DVec3) -> bool {
    let [a, b] = [bounds.min, bounds.max].map(|corner| (corner - from) / direction);
    // NaN, of a ray within a side, counts as a hit of it.
    let (enters, leaves) = (a.min(b), a.max(b));
    enters.max_element().max(0.0) <= leaves.min_element() || enters.is_nan() || leaves.is_nan()
}
