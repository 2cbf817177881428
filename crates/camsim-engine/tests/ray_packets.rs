//! Rays of neighbouring pixels that are traced together against rays that are traced alone, in the scenes of the
//! benchmarks.

use std::path::PathBuf;

use camsim_core::{
    scenario::Channel,
    scene::ray_packet::{PACKET_RAYS, RayPacket},
};
use camsim_io::{load::load_rig, scenario_file::read_rig};
use camsim_plan::{FramePlan, FrameRays, PixelTruth, Planner};

/// Pixels along a side of a packet.
const SIDE: usize = 8;
/// Relative difference of depths that are equal but for rounding, at grazing incidence too.
const ROUNDING: f64 = 1e-9;
const ROUNDING_PX: f64 = 1e-6;

/// Pixels that were compared, those that saw a surface, and those that are not the same.
type Counts = [usize; 3];

fn is_same(packet: &PixelTruth, alone: &PixelTruth) -> bool {
    let is_same_hit = match (&packet.hit, &alone.hit) {
        (Some(a), Some(b)) => {
            // A ray on an edge hits both of its triangles.
            let is_same_triangle = (a.surface, a.triangle) == (b.surface, b.triangle);
            a.surface == b.surface
                && (a.depth_m - b.depth_m).abs() <= ROUNDING * b.depth_m
                && (!is_same_triangle || a.normal_ned.distance(b.normal_ned) < ROUNDING)
        }
        (None, None) => true,
        _ => false,
    };
    is_same_hit && packet.source_px.distance(alone.source_px) <= ROUNDING_PX
}

/// Compares every `step`-th square of pixels.
fn compare(rays: &FrameRays<'_>, plan: &FramePlan, step: usize) -> Counts {
    let [width, height] = plan.camera.size_px;
    let mut packet = RayPacket::default();
    let mut counts = [0; 3];
    let corners = (0..height).step_by(SIDE).flat_map(|y| (0..width).step_by(SIDE).map(move |x| [x, y]));
    for [x, y] in corners.step_by(step) {
        let pixels: [_; PACKET_RAYS] = std::array::from_fn(|i| {
            let pixel = [x + (i % SIDE) as u32, y + (i / SIDE) as u32];
            let is_there = pixel[0] < width && pixel[1] < height;
            is_there.then(|| Some((pixel, plan.camera.unproject_pixel(pixel)?))).flatten()
        });
        rays.cast_packet(&mut packet, &pixels, |i, seen| {
            let Some((pixel, uv)) = pixels[i] else { return };
            let alone = rays.cast(pixel, uv);
            let is_other = !is_same(&seen, &alone);
            if is_other {
                eprintln!("{pixel:?}: {seen:?}, not {alone:?}");
            }
            let more = [1, usize::from(alone.hit.is_some()), usize::from(is_other)];
            counts = [0, 1, 2].map(|k| counts[k] + more[k]);
        });
    }
    counts
}

#[test]
fn packets_see_what_single_rays_see() {
    let is_long = std::env::var_os("CAMSIM_LONG").is_some();
    let step = if is_long { 1 } else { 37 };
    for scene in ["all_effects", "houses", "scenes/vio_town", "scenes/mapping", "scenes/fisheye"] {
        let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("../../benches/{scene}.toml"));
        let cameras = load_rig(&read_rig(&file, &[], None).expect("a scenario")).expect("a scene");
        let sequence = cameras[0].sequence.clone();
        let planner = Planner::new(sequence.clone(), &[Channel::Depth], 16_384).expect("a planner");
        for lane in 0..planner.lanes() {
            for (frame, phase) in [(3, 0.0), (40, 0.4)] {
                let lane = planner.lane(lane);
                let plan = lane.plan(frame.min(sequence.frames - 1)).expect("a plan");
                let [all, met, other] = compare(&lane.frame_rays(&plan, phase), &plan, step);
                eprintln!("{scene} {frame}: {all} pixels, {met} with a surface, {other} other");
                assert!(all > 0 && other == 0, "{scene} {frame}: {other} of {all}");
            }
        }
    }
}
