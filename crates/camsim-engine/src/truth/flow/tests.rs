//! Flow, motion and blur of what moves, against the reference renderer and finite differences.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    mount::CameraPath,
    pose::{BodyState, CameraPose},
    reference::ReferenceRenderer,
    row_time::WorldPoint,
    scenario::{
        Axis, Channel, FlightSpec, FlowState, LensModel, LensSpec, MountSpec, Scenario, ShutterSpec,
        VibrationSpec,
    },
    scene::{
        Encoding, Mesh, RigidMotion, Scene, Texture,
        motion::{Between, Curve, Joint, JointFrame, Keys, Track},
    },
    sequence::Sequence,
    trajectory::Trajectory,
};
use camsim_plan::{PixelHit, Planner, uniforms::Truth};
use glam::{DQuat, DVec2, DVec3};

use super::*;

const SIZE_PX: [u32; 2] = [64, 48];
const READOUT_S: f64 = 0.03;
const EXPOSURE_S: f64 = 0.008;
const FPS: f64 = 30.0;

/// A raft that turns while it drifts below a camera in flight, over a picture that stands still.
fn sequence() -> Arc<Sequence> {
    sequence_with([-10.0, 0.0], [50.0, 52.0], &[])
}

/// The camera begins so far north and east, and vibrates.
fn sequence_with(
    [north_m, east_m]: [f64; 2],
    focal_px: [f64; 2],
    vibration: &[VibrationSpec],
) -> Arc<Sequence> {
    // Long because: every part of a sequence is written out.
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let times_s = vec![-1.0, 1.0];
    let drift = DVec3::new(4.0, 9.0, -1.0);
    let turns = [-1.1, 1.1].map(DQuat::from_rotation_z).to_vec();
    let keys = Keys {
        position: Curve::new(times_s.clone(), vec![-drift, drift], Between::Linear).unwrap(),
        rotation: Curve::new(times_s, turns, Between::Linear).unwrap(),
        start_s: 0.0,
        repeat: None,
    };
    let motion = RigidMotion::new(vec![Joint::new(JointFrame::IDENTITY, Track::Keys(keys))]);
    let raft = Mesh {
        motion: Some(Arc::new(motion)),
        ..Mesh::level_picture(texture.clone(), DVec3::new(1.0, 0.0, -10.0), 30.0)
    };
    let ground = Mesh::level_picture(texture, DVec3::ZERO, 500.0);
    let scene = Scene { meshes: vec![ground, raft], ..Scene::default() };
    let mut scenario = Scenario {
        seed: 1,
        flight: FlightSpec {
            log: "in-memory".into(),
            format: Default::default(),
            time_unit: Default::default(),
            angle_unit: Default::default(),
            angles: Default::default(),
            attitude: Default::default(),
            origin: Default::default(),
            height: Default::default(),
            height_from: Default::default(),
            ..FlightSpec::default()
        },
        tracker: Default::default(),
        camera: Default::default(),
        scene: Default::default(),
        quality: Default::default(),
        output: Default::default(),
        imu: Vec::new(),
        gnss: Vec::new(),
        barometer: Vec::new(),
        magnetometer: Vec::new(),
    };
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = focal_px;
    scenario.camera.fps = FPS;
    scenario.camera.lens =
        LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05, 0.001, -0.002] };
    scenario.camera.mount =
        MountSpec { angles_deg: [0.0, -90.0, 0.0], vibration: vibration.to_vec(), ..MountSpec::default() };
    scenario.camera.shutter =
        ShutterSpec { readout_ms: 1e3 * READOUT_S, exposure_ms: 1e3 * EXPOSURE_S, ..ShutterSpec::default() };
    let first = BodyState {
        position_ned_m: DVec3::new(north_m, east_m, -50.0),
        velocity_ned_m_s: DVec3::new(10.0, -2.0, 1.0),
        rate_body_rad_s: DVec3::new(0.1, -0.1, 0.3),
        ..BodyState::default()
    };
    let trajectory = Trajectory::uniform(-1.0, 4.0, 3.0, vec![first]).unwrap();
    let path = CameraPath::new(trajectory, &scenario.camera.mount).unwrap();
    Arc::new(Sequence::in_memory(scenario, path, scene, 9))
}

/// Mid-exposure of a fractional row of a frame.
fn row_s(frame: i32, y: f64) -> f64 {
    f64::from(frame) / FPS + READOUT_S * ((y + 0.5) / f64::from(SIZE_PX[1]) - 0.5)
}

/// Pixels of frame 1, all valid.
fn with_pixels(sequence: Arc<Sequence>, check: impl FnOnce(&FramePixels<'_>, &ReferenceRenderer)) {
    let planner = Planner::new(sequence.clone(), &[Channel::Flow], 16_384).unwrap();
    let plan = planner.plan(1).unwrap();
    let rays = planner.frame_rays(&plan, 0.0);
    let all = || (0..SIZE_PX[1]).flat_map(|y| (0..SIZE_PX[0]).map(move |x| [x, y]));
    let uv = |pixel: [u32; 2]| plan.camera.unproject(DVec2::from_array(pixel.map(f64::from))).unwrap();
    let truth: Vec<Truth> =
        all().map(|pixel| Truth { uv: uv(pixel).as_vec2().to_array(), ..Truth::default() }).collect();
    let hits: Vec<Option<PixelHit>> = all().map(|pixel| rays.cast(pixel, uv(pixel)).hit).collect();
    let color_rgba = vec![1.0; 4 * truth.len()];
    let pixels = FramePixels {
        planner: &planner,
        plan: &plan,
        rays: &rays,
        truth: &truth,
        color_rgba: &color_rgba,
        hits: &hits,
    };
    check(&pixels, &ReferenceRenderer::new(sequence).unwrap());
}

#[test]
fn flow_leads_to_where_the_reference_sees_the_same_position() {
    with_pixels(sequence(), |pixels, reference| {
        for target in [2, 0] {
            let to = pixels.planner.frame_camera(i64::from(target)).unwrap();
            let (mut visible, mut worst_px) = ([0; 3], 0.0_f64);
            for (i, [dx, dy, state]) in flow(pixels, &to).into_iter().enumerate() {
                if state != f32::from(FlowState::Visible as u8) {
                    continue;
                }
                let pixel = [i as u32 % SIZE_PX[0], i as u32 / SIZE_PX[0]];
                let from = reference.sample(1, pixel, DVec2::ZERO, 0.0).unwrap().hit.unwrap();
                let px = DVec2::from_array(pixel.map(f64::from)) + DVec2::new(dx.into(), dy.into());
                let t_s = row_s(target, px.y);
                let pose = reference.sequence().path.pose(t_s);
                let ray = pose.ned_from_camera * pixels.plan.camera.unproject(px).unwrap().extend(1.0);
                let seen = reference.cast_at(t_s, pose.position_ned_m, ray).unwrap();
                // At a border rounding decides.
                if seen.surface == from.surface {
                    let size_m = if seen.surface == 2 { 30.0 } else { 500.0 };
                    let off = DVec2::from_array(seen.texture_uv) - DVec2::from_array(from.texture_uv);
                    worst_px = worst_px.max(off.length() * size_m / seen.depth_m * 50.0);
                    visible[seen.surface as usize] += 1;
                }
            }
            // Flow is stored in single precision, and so are the rays here.
            assert!(worst_px < 1e-4, "{target}: {worst_px:.1e} px");
            assert!(visible[1] > 200 && visible[2] > 400, "{visible:?}");
        }
    });
}

/// A position at which a frame shows a point, and whether something is in front of it there.
struct Sight {
    px: DVec2,
    is_hidden: bool,
}

/// All instants of a frame's readout, a fortieth of a row apart, with the row and the camera.
fn instants(frame: i32, reference: &ReferenceRenderer) -> Vec<(f64, f64, CameraPose)> {
    let rows = (0..=40 * SIZE_PX[1]).map(|k| f64::from(k) / 40.0 - 0.5);
    rows.map(|y| (y, row_s(frame, y), reference.sequence().path.pose(row_s(frame, y)))).collect()
}

/// Where a frame shows a point, by force; `None` where that hangs on less than the grid of instants tells.
fn shown(
    point: WorldPoint<'_>,
    camera: &CameraModel,
    instants: &[(f64, f64, CameraPose)],
    reference: &ReferenceRenderer,
) -> Option<Vec<Sight>> {
    let seen: Vec<Option<(f64, DVec2)>> = instants
        .iter()
        .map(|(y, t_s, pose)| camera.show(pose, *t_s, point).map(|(px, _)| (px.y - y, px)))
        .collect();
    let is_turn = |three: &[Option<(f64, DVec2)>]| {
        matches!(three, [Some((a, _)), Some((b, _)), Some((c, _))]
            if b.abs() < 5e-3 && (b - a) * (c - b) <= 0.0)
    };
    if seen.windows(3).any(is_turn) {
        return None;
    }
    let [width, height] = SIZE_PX.map(f64::from);
    let mut sights = Vec::new();
    for (k, pair) in seen.windows(2).enumerate() {
        let &[Some((before, a)), Some((after, b))] = pair else { continue };
        if (before >= 0.0) == (after >= 0.0) {
            continue;
        }
        let px = a.lerp(b, before / (before - after));
        if px.min_element() < -0.5 || px.x >= width - 0.5 || px.y >= height - 0.5 {
            continue;
        }
        let (_, t_s, pose) = &instants[k];
        let direction = point.position_ned_m(*t_s)? - pose.position_ned_m;
        let hides = |beside: DVec3| {
            let hit = reference.cast_at(*t_s, pose.position_ned_m, direction + beside);
            hit.is_some_and(|hit| hit.depth_m < 0.999)
        };
        let is_hidden = hides(DVec3::ZERO);
        // Near a border the instants between two positions of the grid differ.
        let beside = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y];
        if beside.into_iter().any(|beside| hides(0.02 * beside) != is_hidden) {
            return None;
        }
        sights.push(Sight { px, is_hidden });
    }
    Some(sights)
}

#[test]
fn of_several_positions_the_nearest_that_is_seen_counts() {
    // A long lens over the raft's edge, which shakes so that rows are overtaken again and again.
    let vibration = [(Axis::Pitch, 60.0), (Axis::Yaw, 55.0)].map(|(axis, hz)| VibrationSpec {
        axis,
        amplitude_deg: 2.0,
        amplitude_m: 0.0,
        hz,
        phase_deg: 20.0,
    });
    let sequence = sequence_with([-20.0, 0.0], [400.0; 2], &vibration);
    with_pixels(sequence, |pixels, reference| {
        // Before, the raft was over what is beside it now.
        let target = pixels.planner.frame_camera(-2).unwrap();
        let instants = instants(-2, reference);
        let mut states = [0; 5];
        for (i, [dx, dy, state]) in flow(pixels, &target).into_iter().enumerate() {
            let pixel = pixels.pixel(i).unwrap();
            let from_px = DVec2::from_array(pixel.position.map(f64::from));
            let point = world_point(pixels, pixel);
            let Some(mut sights) = shown(point, &pixels.plan.camera, &instants, reference) else { continue };
            sights.sort_by(|a, b| a.px.distance(from_px).total_cmp(&b.px.distance(from_px)));
            let seen: Vec<&Sight> = sights.iter().filter(|sight| !sight.is_hidden).collect();
            let (expected, sight) = match (seen.as_slice(), sights.first()) {
                ([], None) => (FlowState::Outside, None),
                ([], nearest) => (FlowState::Occluded, nearest),
                ([only], _) => (FlowState::Visible, Some(*only)),
                ([nearest, ..], _) => (FlowState::Several, Some(*nearest)),
            };
            assert_eq!(state, f32::from(expected as u8), "{from_px}");
            if let Some(sight) = sight {
                let off_px = (from_px + DVec2::new(dx.into(), dy.into())).distance(sight.px);
                assert!(off_px < 0.02, "{from_px}: {off_px:.1e} px");
            }
            states[expected as usize] += 1;
        }
        let [_, visible, occluded, outside, several] = states;
        assert!(visible > 200 && occluded > 100 && outside > 50 && several > 200, "{states:?}");
    });
}

#[test]
fn motion_and_blur_are_those_of_the_moved_position() {
    with_pixels(sequence(), |pixels, reference| {
        let (path, camera) = (&reference.sequence().path, &pixels.plan.camera);
        let mut count = 0;
        for (i, hit) in pixels.hits.iter().enumerate() {
            let position = [i as u32 % SIZE_PX[0], i as u32 / SIZE_PX[0]];
            let [u, v] = pixels.truth[i].uv.map(f64::from);
            let pixel = Pixel { position, uv: DVec2::new(u, v), hit: hit.as_ref() };
            let sample = reference.sample(1, position, DVec2::ZERO, 0.0).unwrap();
            let [u, v] = sample.hit.unwrap().texture_uv;
            if sample.hit.unwrap().surface != 2 {
                continue;
            }
            let raft = &reference.sequence().scene.meshes[1];
            let shown = |t_s: f64| {
                let now = raft.at(t_s);
                let local = DVec3::new(15.0 * (1.0 - 2.0 * v), 15.0 * (2.0 * u - 1.0), 0.0);
                let point_ned_m = now.origin_ned_m + now.ned_from_shape * local;
                camera.show(&path.pose(t_s), t_s, WorldPoint::At(point_ned_m)).unwrap().0
            };
            let (t_s, h) = (sample.t_s, 1e-4);
            let expected = (shown(t_s + h) - shown(t_s - h)) / (2.0 * h);
            let [vx, vy] = motion(pixels, pixel);
            let off = expected.distance(DVec2::new(vx.into(), vy.into()));
            assert!(off < 1e-3, "{position:?}: {off:.1e} px/s of {expected}");
            let [x0, y0, x1, y1] = blur_path(pixels, pixel).map(f64::from);
            let from_px = DVec2::from_array(position.map(f64::from));
            for (phase, found) in [(-0.5, DVec2::new(x0, y0)), (0.5, DVec2::new(x1, y1))] {
                let off = (shown(t_s + phase * EXPOSURE_S) - from_px).distance(found);
                assert!(off < 1e-5, "{position:?}: {off:.1e} px");
            }
            count += 1;
        }
        assert!(count > 400, "{count}");
    });
}
