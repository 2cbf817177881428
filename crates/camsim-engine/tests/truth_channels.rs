//! The truth channels against rays of the reference renderer and against projections at the instants of rows.

mod common;

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    reference::{RaySample, ReferenceRenderer},
    scenario::{
        Axis, Channel, FieldOr, FlowState, LensModel, LensSpec, MountSpec, Readout, Scenario, ShutterSpec,
        VibrationSpec,
    },
    scene::{Encoding, Scene, Terrain, Texture},
    sequence::Sequence,
};
use camsim_engine::{Engine, Finished};
use common::{render, roof, scenario, sequence, steady};
use glam::{DVec2, DVec3};

/// A name, and what is different in the scenario.
type Change = (&'static str, fn(&mut Scenario));

const SIZE_PX: [u32; 2] = [120, 90];
/// The frame that is looked at, and the step of its flow.
const FRAME: u64 = 20;
const FLOW_STEP: u32 = 15;

/// Steep hills with a roof over them and the sky above.
fn hills() -> Scene {
    let heights: Vec<f64> = (0..129 * 129)
        .map(|i| 30.0 * (f64::from(i % 129) * 0.4).sin() * (f64::from(i / 129) * 0.3).cos())
        .collect();
    let texture = Arc::new(Texture::uniform([120, 130, 90, 255], Encoding::Srgb));
    let terrain = Terrain::from_heights(129, 129, 8.0, &heights, Some(texture)).expect("heights");
    Scene { terrain: Some(terrain), meshes: vec![roof(60.0, 25.0)], ..Scene::default() }
}

fn camera(change: fn(&mut Scenario)) -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [95.0, 100.0];
    scenario.camera.lens =
        LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.1, 0.02, 0.001, -0.002] };
    let vibration =
        VibrationSpec { axis: Axis::Pitch, amplitude_deg: 0.3, amplitude_m: 0.0, hz: 21.0, phase_deg: 40.0 };
    scenario.camera.mount =
        MountSpec { angles_deg: [1.0, -35.0, 0.0], vibration: vec![vibration], ..MountSpec::default() };
    scenario.camera.shutter = ShutterSpec { readout_ms: 30.0, exposure_ms: 8.0, ..ShutterSpec::default() };
    scenario.output.flow_step = FLOW_STEP;
    change(&mut scenario);
    sequence(scenario, steady(120.0, 0.0, DVec3::new(25.0, 30.0, -3.0), DVec3::new(0.2, -0.3, 0.4)), hills())
}

/// A camera whose rows are read in some way, with its sequence.
struct Case {
    name: &'static str,
    sequence: Arc<Sequence>,
    reference: ReferenceRenderer,
    camera: CameraModel,
}

fn cases() -> Vec<Case> {
    let changes: [Change; 5] = [
        ("rows", |_| {}),
        ("rows from below", |s| s.camera.shutter.readout = Readout::BottomToTop),
        ("columns", |s| s.camera.shutter.readout = Readout::LeftToRight),
        ("interlaced", |s| s.camera.shutter.interlace_ms = FieldOr::Field),
        ("global shutter", |s| s.camera.shutter.readout_ms = 0.0),
    ];
    let case = |(name, change): (&'static str, fn(&mut Scenario))| {
        let sequence = camera(change);
        let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
        let camera = CameraModel::from_spec(&sequence.scenario.camera).expect("a usable camera");
        Case { name, sequence, reference, camera }
    };
    changes.into_iter().map(case).collect()
}

fn pixels() -> impl Iterator<Item = (usize, [u32; 2])> {
    (0..SIZE_PX[1]).flat_map(|y| (0..SIZE_PX[0]).map(move |x| ((y * SIZE_PX[0] + x) as usize, [x, y])))
}

impl Case {
    fn render(&self, channels: &[Channel]) -> Finished {
        render(&Engine::cpu(), &self.sequence, channels, FRAME)
    }

    fn sample(&self, pixel: [u32; 2]) -> Option<RaySample> {
        self.reference.sample(FRAME, pixel, DVec2::ZERO, 0.0)
    }

    /// Where the camera of an instant shows what a ray has met.
    fn project(&self, t_s: f64, seen: &RaySample) -> Option<DVec2> {
        let pose = self.sequence.path.pose(t_s);
        let ray = match seen.hit {
            Some(hit) => hit.point_ned_m - pose.position_ned_m,
            None => seen.pose.ned_from_camera * seen.uv.extend(1.0),
        };
        let ray = pose.ned_from_camera.inverse() * ray;
        (ray.z > 0.0).then(|| self.camera.project(ray.truncate() / ray.z))
    }

    /// Instant at which a frame reads a position, linear between the rows of a field on either side of it, and
    /// where the camera of that instant shows what a ray has met. A position between the rows of two fields
    /// may belong to either.
    fn expected(&self, frame: u64, px: DVec2, seen: &RaySample) -> Option<(f64, DVec2)> {
        let fields = [DVec2::ZERO, DVec2::new(0.0, 1.0)].map(|shift| self.read_s(frame, px, shift));
        let shown = fields.into_iter().filter_map(|t_s| Some((t_s, self.project(t_s, seen)?)));
        shown.min_by(|a, b| a.1.distance(px).total_cmp(&b.1.distance(px)))
    }

    /// `shift`: from the position to the row whose field is meant.
    fn read_s(&self, frame: u64, px: DVec2, shift: DVec2) -> f64 {
        let shutter = &self.sequence.scenario.camera.shutter;
        let [x, y] = (px + shift).to_array().map(|value| value.max(0.0));
        let view = self.reference.view(frame);
        let is_sideways = matches!(shutter.readout, Readout::LeftToRight | Readout::RightToLeft);
        let (across, last) = if is_sideways { (px.x, SIZE_PX[0] - 1) } else { (px.y, SIZE_PX[1] - 1) };
        let is_interlaced = shutter.interlace_ms == FieldOr::Field;
        let step = if is_interlaced { 2 } else { 1 };
        // A row beside the position, and another of its field.
        let row = if is_sideways { x } else { y };
        // Below the last row: the last one of the same field.
        let row = row.round() as u32;
        let row = if row > last { row - step } else { row };
        let other = if row >= step { row - step } else { row + step };
        let at = |row: u32| {
            view.mid_s(if is_sideways { [row, y.round() as u32] } else { [x.round() as u32, row] })
        };
        let fraction = (across - f64::from(row)) / (f64::from(other) - f64::from(row));
        at(row) + fraction * (at(other) - at(row))
    }
}

#[test]
fn range_and_normal_are_those_of_rays() {
    for case in cases() {
        let done = case.render(&[Channel::Range, Channel::Normal, Channel::NormalWorld]);
        let floats = |channel| done.frame.floats(channel).expect("a plane");
        let (range, normal, world) =
            (floats(Channel::Range), floats(Channel::Normal), floats(Channel::NormalWorld));
        let (mut compared, mut off) = (0, 0);
        for (i, pixel) in pixels() {
            let Some(seen) = case.sample(pixel) else { continue };
            let Some(hit) = seen.hit else {
                off += usize::from(range[i] != 0.0);
                continue;
            };
            compared += 1;
            let expected_m = hit.point_ned_m.distance(seen.pose.position_ned_m);
            // Two further points of the surface, a thousandth of a pixel away, make a plane.
            let beside = |offset| {
                let beside = case.reference.sample(FRAME, pixel, offset, 0.0)?.hit?;
                (beside.surface == hit.surface).then_some(beside.point_ned_m - hit.point_ned_m)
            };
            let sides = beside(DVec2::new(1e-3, 0.0)).zip(beside(DVec2::new(0.0, 1e-3)));
            let Some((a, b)) = sides else { continue };
            let expected = a.cross(b).normalize();
            let found = DVec3::new(world[3 * i].into(), world[3 * i + 1].into(), world[3 * i + 2].into());
            let in_camera =
                DVec3::new(normal[3 * i].into(), normal[3 * i + 1].into(), normal[3 * i + 2].into());
            assert!((seen.pose.ned_from_camera * in_camera).distance(found) < 1e-6, "{pixel:?}");
            assert!(in_camera.dot(seen.uv.extend(1.0)) <= 0.0, "{pixel:?}: towards the camera");
            let is_right = (f64::from(range[i]) / expected_m - 1.0).abs() < 1e-4
                && expected.dot(found).abs() > 1.0 - 1e-4;
            off += usize::from(!is_right);
        }
        // A crease of the terrain or a silhouette may pass between the three points.
        assert!(compared > 6000 && off * 500 < compared, "{}: {off} of {compared}", case.name);
    }
}

#[test]
fn flow_leads_to_where_the_other_frame_shows_the_point() {
    let mut all_hidden = 0;
    for case in cases() {
        for (channel, frame) in [(Channel::Flow, FRAME + 15), (Channel::FlowBack, FRAME - 15)] {
            let done = case.render(&[channel]);
            let flow = done.frame.floats(channel).expect("a plane");
            let (mut shown, mut hidden, mut wrong_state, mut outside, mut largest_px) = (0, 0, 0, 0, 0.0_f64);
            for (i, pixel) in pixels() {
                let Some(seen) = case.sample(pixel) else { continue };
                let [dx, dy, state] = [flow[3 * i], flow[3 * i + 1], flow[3 * i + 2]].map(f64::from);
                let from_px = DVec2::from_array(pixel.map(f64::from));
                let to_px = from_px + DVec2::new(dx, dy);
                if state == f64::from(FlowState::Outside as u8) {
                    outside += 1;
                    continue;
                }
                let Some((read_s, expected_px)) = case.expected(frame, to_px, &seen) else { continue };
                largest_px = largest_px.max(expected_px.distance(to_px));
                let pose = case.sequence.path.pose(read_s);
                let is_hidden = match seen.hit {
                    Some(hit) => case.reference.is_occluded(pose.position_ned_m, hit.point_ned_m),
                    None => case
                        .reference
                        .cast(pose.position_ned_m, seen.pose.ned_from_camera * seen.uv.extend(1.0))
                        .is_some(),
                };
                let says_hidden = state == f64::from(FlowState::Occluded as u8);
                wrong_state += usize::from(is_hidden != says_hidden);
                if is_hidden { hidden += 1 } else { shown += 1 }
            }
            let name = case.name;
            eprintln!(
                "{name} {channel:?}: {shown} shown, {hidden} hidden, {outside} outside, {largest_px:.1e} px"
            );
            assert!(shown > 5000 && outside > 100, "{name}: {shown} {outside}");
            assert!(largest_px < 2e-3, "{name}: {largest_px} px");
            assert!(wrong_state * 1000 < shown, "{name}: {wrong_state} of {shown}");
            all_hidden += hidden;
        }
    }
    assert!(all_hidden > 50, "{all_hidden}");
}

#[test]
fn motion_and_blur_path_are_those_of_projections_at_other_instants() {
    const STEP_S: f64 = 1e-5;
    for case in cases() {
        let done = case.render(&[Channel::Motion, Channel::BlurPath]);
        let motion = done.frame.floats(Channel::Motion).expect("a plane");
        let path = done.frame.floats(Channel::BlurPath).expect("a plane");
        let exposure_s = 1e-3 * case.sequence.scenario.camera.shutter.exposure_ms;
        let mut compared = 0;
        for (i, pixel) in pixels() {
            let Some(seen) = case.sample(pixel) else { continue };
            let at = |dt_s: f64| case.project(seen.t_s + dt_s, &seen);
            let (Some(before), Some(after)) = (at(-STEP_S), at(STEP_S)) else { continue };
            let rate = (after - before) / (2.0 * STEP_S);
            let found = DVec2::new(motion[2 * i].into(), motion[2 * i + 1].into());
            // Pixels at silhouettes may see the other surface.
            let is_near = found.distance(rate) < 1e-3 * rate.length() + 1e-2;
            let (Some(first), Some(last)) = (at(-0.5 * exposure_s), at(0.5 * exposure_s)) else { continue };
            let centre = DVec2::from_array(pixel.map(f64::from));
            let [x0, y0, x1, y1] = std::array::from_fn(|k| f64::from(path[4 * i + k]));
            let ends_px =
                (first - centre).distance(DVec2::new(x0, y0)) + (last - centre).distance(DVec2::new(x1, y1));
            compared += 1;
            let is_right = is_near && ends_px < 2e-3;
            assert!(
                is_right || is_at_silhouette(&case, pixel),
                "{} {pixel:?}: {found} {rate} {ends_px}",
                case.name
            );
        }
        assert!(compared > 9000, "{compared}");
    }
}

/// Whether surfaces of other depths are within a twentieth of a pixel.
fn is_at_silhouette(case: &Case, pixel: [u32; 2]) -> bool {
    let depth = |offset| {
        case.reference.sample(FRAME, pixel, offset, 0.0).and_then(|seen| seen.hit).map(|hit| hit.depth_m)
    };
    let offsets = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
    let here = depth(DVec2::ZERO);
    offsets.into_iter().any(|offset| match (here, depth(0.05 * offset)) {
        (Some(here), Some(beside)) => (beside / here - 1.0).abs() > 0.01,
        (None, None) => false,
        _ => true,
    })
}
