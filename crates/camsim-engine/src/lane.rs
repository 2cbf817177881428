//! The camera of a session, or one of the faces that its field is divided among.

use camsim_core::{
    camera::CameraModel,
    frame::{Plane, PlaneValues, RenderedFrame},
    pose::CameraPose,
    scenario::{Channel, Primary},
    scene::{LodSelection, LodTolerance},
    temporal::IdealGeometry,
};
use camsim_cpu::BufferHandle;
use camsim_plan::{EdgeStage, FramePlan, PrefilterTaps, Renderer};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::{
    Finished,
    moving::{Lamps, Missed, MovingScene},
};

/// What a session keeps for its camera, or for one of its faces, beside the planner.
#[derive(Debug, Default)]
pub(crate) struct Lane {
    pub moving: Option<MovingScene>,
    pub lamps: Option<Lamps>,
    pub missed: Missed,
    pub ideal: Option<CachedFrames>,
}

/// All inputs of the ideal frames of an output frame. Equal inputs give equal ideal frames.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CacheKey {
    pub poses: Vec<CameraPose>,
    pub ideal: IdealGeometry,
    pub edges: EdgeStage,
    pub terrain_error_px: f64,
    pub models: LodTolerance,
    pub surface_reads: PrefilterTaps,
    pub samples_a_pixel: u32,
    pub renderer: Renderer,
}

/// The last ideal frames, reused by frames with the same key.
#[derive(Debug)]
pub(crate) struct CachedFrames {
    pub key: CacheKey,
    pub lod: LodSelection,
    /// Buffer of the cpu renderer, if it drew them.
    pub buffer: Option<BufferHandle>,
}

/// Turns what a face's frame says in the face's axes to those of the whole camera: planar depth, normals.
pub(crate) fn turn_to_camera_axes(frame: &mut RenderedFrame, plan: &FramePlan) {
    let Some(face) = plan.camera.lens.face() else { return };
    let whole_from_face = face.camera_from_face();
    let width = frame.size_px[0] as usize;
    let camera: &CameraModel = &plan.camera;
    if let Some(depth_m) = frame.floats_mut(Channel::Depth) {
        depth_m.par_iter_mut().enumerate().filter(|(_, depth_m)| **depth_m != 0.0).for_each(
            |(i, depth_m)| {
                let pixel = DVec2::new((i % width) as f64, (i / width) as f64);
                let factor = camera.unproject(pixel).map_or(0.0, |uv| (whole_from_face * uv.extend(1.0)).z);
                *depth_m = (f64::from(*depth_m) * factor) as f32;
            },
        );
    }
    for normal in frame.floats_mut(Channel::Normal).unwrap_or_default().chunks_exact_mut(3) {
        let turned = whole_from_face * DVec3::new(normal[0].into(), normal[1].into(), normal[2].into());
        normal.copy_from_slice(&turned.as_vec3().to_array());
    }
}

/// The frame that faces and colours make, each rendered as a camera of its own; `None` of none. Its rows are those
/// of the first.
pub(crate) fn join_parts(parts: impl IntoIterator<Item = Finished>) -> Option<Finished> {
    let mut whole: Option<Finished> = None;
    for mut part in parts {
        turn_to_camera_axes(&mut part.frame, &part.plan);
        add_part(&mut whole, part);
    }
    whole.map(joined)
}

/// Adds what a face or a colour has made to the frame of those before it.
pub(crate) fn add_part(whole: &mut Option<Finished>, mut part: Finished) {
    match whole {
        Some(whole) => add(whole, part),
        None => {
            if let Some(primary) = part.plan.primary {
                part.frame.color_rgba_mut().par_chunks_exact_mut(4).for_each(|rgba| keep(rgba, primary));
            }
            *whole = Some(part);
        }
    }
}

/// The frame of all parts: pixels are black where the lens of truth has no ray.
pub(crate) fn joined(mut whole: Finished) -> Finished {
    if whole.plan.primary.is_some() {
        blacken_invalid(whole.frame.color_rgba_mut());
    }
    whole
}

/// Leaves nothing of pixels without a ray.
pub(crate) fn blacken_invalid(color_rgba: &mut [f32]) {
    let invalid = color_rgba.par_chunks_exact_mut(4).filter(|rgba| rgba[3] == 0.0);
    invalid.for_each(|rgba| rgba.fill(0.0));
}

/// Leaves a pixel one of its colours.
fn keep(rgba: &mut [f32], primary: Primary) {
    (0..3).filter(|&k| k != primary.channel()).for_each(|k| rgba[k] = 0.0);
}

fn add(whole: &mut Finished, part: Finished) {
    let Finished { frame, plan, lod: _, out_of_order, times, faces } = part;
    let held: Vec<bool> = frame.color_rgba().par_chunks_exact(4).map(|rgba| rgba[3] > 0.0).collect();
    let into = &mut whole.frame;
    copy_part(into.color_rgba_mut(), frame.color_rgba(), plan.primary);
    whole.times.add(&times);
    if matches!(plan.primary, Some(Primary::Red | Primary::Blue)) {
        return;
    }
    for Plane { channel, values } in &frame.planes {
        // Coordinates are in each part's own frame.
        if matches!(channel, Channel::Coords | Channel::Color) {
            continue;
        }
        let Some(into) = into.values_mut(*channel) else { continue };
        match (into, values) {
            (PlaneValues::Float(into), PlaneValues::Float(from)) => copy(into, from, &held),
            (PlaneValues::Index(into), PlaneValues::Index(from)) => copy(into, from, &held),
            _ => {}
        }
    }
    whole.out_of_order += out_of_order;
    whole.faces.push(plan);
    whole.faces.extend(faces);
}

/// Copies the pixels that a part has, R G B A: all of them, or one colour; green, whose lens is that of truth, says
/// which are valid.
pub(crate) fn copy_part(into: &mut [f32], from: &[f32], primary: Option<Primary>) {
    let held = into.par_chunks_exact_mut(4).zip(from.par_chunks_exact(4)).filter(|(_, from)| from[3] > 0.0);
    held.for_each(|(into, from)| match primary {
        None => into.copy_from_slice(from),
        Some(primary) => {
            let k = primary.channel();
            into[k] = from[k];
            if primary == Primary::Green {
                into[3] = from[3];
            }
        }
    });
}

/// Copies the values of the pixels that are held; a pixel has equally many in both.
fn copy<T: Copy + Send + Sync>(into: &mut [T], from: &[T], held: &[bool]) {
    let count = from.len() / held.len().max(1);
    if count == 0 {
        return;
    }
    into.par_chunks_exact_mut(count).zip(from.par_chunks_exact(count)).zip(held).for_each(
        |((into, from), &held)| {
            if held {
                into.copy_from_slice(from);
            }
        },
    );
}
