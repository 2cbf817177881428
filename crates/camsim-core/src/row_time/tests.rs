//! Positions in frames with rows of their own instants, against a search of all instants.

#![allow(clippy::unwrap_used)]

use glam::DAffine3;

use super::*;
use crate::{
    pose::BodyState,
    scenario::{Axis, FieldOr, LensModel, MountSpec, Readout, ShutterSpec, VibrationSpec},
    scene::motion::{Joint, JointFrame, Track},
    trajectory::Trajectory,
};

const SIZE_PX: [u32; 2] = [64, 48];

fn path(vibration_deg: f64) -> Arc<CameraPath> {
    path_with(&[VibrationSpec {
        axis: Axis::Pitch,
        amplitude_deg: vibration_deg,
        amplitude_m: 0.0,
        hz: 30.0,
        phase_deg: 0.0,
    }])
}

fn path_with(vibration: &[VibrationSpec]) -> Arc<CameraPath> {
    let first = BodyState {
        position_ned_m: DVec3::new(0.0, 0.0, -50.0),
        velocity_ned_m_s: DVec3::new(20.0, 5.0, 1.0),
        rate_body_rad_s: DVec3::new(0.2, -0.1, 0.3),
        ..BodyState::default()
    };
    let trajectory = Trajectory::uniform(-1.0, 4.0, 3.0, vec![first]).unwrap();
    let spec =
        MountSpec { angles_deg: [0.0, -40.0, 0.0], vibration: vibration.to_vec(), ..MountSpec::default() };
    Arc::new(CameraPath::new(trajectory, &spec).unwrap())
}

fn camera() -> Arc<CameraModel> {
    let coefficients = [-0.2, 0.05, 0.001, -0.002];
    let camera =
        CameraModel::new(SIZE_PX, [50.0, 52.0], None, LensModel::BrownConrady, &coefficients).unwrap();
    Arc::new(camera)
}

fn shutter(spec: ShutterSpec) -> Shutter {
    Shutter::from_spec(&spec, 30.0, SIZE_PX).unwrap()
}

/// The nearest of all positions, as the flow takes it.
fn find(frame: &FrameCamera, point: WorldPoint<'_>, near_px: DVec2) -> Option<ImagePoint> {
    let distance = |seen: &ImagePoint| seen.px.distance(near_px);
    frame.find_all(point).into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

fn points() -> impl Iterator<Item = WorldPoint<'static>> {
    (0..400).map(|i| {
        let (north, east) = (f64::from(i % 20) * 6.0 - 10.0, f64::from(i / 20) * 6.0 - 60.0);
        if i % 7 == 0 {
            WorldPoint::Towards(DVec3::new(60.0, east, f64::from(i % 5) * 20.0))
        } else {
            WorldPoint::At(DVec3::new(north + 30.0, east, 0.0))
        }
    })
}

/// Rows of the grid of instants on which solutions are looked for by force: every fortieth of a row.
const STEPS_A_ROW: usize = 40;
/// Miss of a turn beside which the grid may not tell two solutions from none, rows.
const UNSURE: f64 = 2e-3;

/// All solutions on a grid of instants: rows at which the miss changes its sign, and whether the grid is too
/// coarse to tell whether there are more.
fn search(frame: &FrameCamera, field: &Field, point: WorldPoint<'_>) -> (Vec<DVec2>, bool) {
    let last = field.poses.len() as f64 - 1.0;
    let steps = STEPS_A_ROW * field.poses.len();
    let miss = |i: usize| {
        let row = -0.5 + (last + 1.0) * i as f64 / steps as f64;
        let t_s = field.time_s(row);
        let seen = frame.project(&frame.path.pose(t_s), t_s, point)?;
        Some((field.row_of(frame.along(seen.px)) - row, seen.px))
    };
    let misses: Vec<Option<(f64, DVec2)>> = (0..=steps).map(miss).collect();
    let mut found = Vec::new();
    for pair in misses.windows(2) {
        if let &[Some(a), Some(b)] = pair
            && (a.0 >= 0.0) != (b.0 >= 0.0)
        {
            found.push(a.1.lerp(b.1, a.0 / (a.0 - b.0)));
        }
    }
    found.retain(|px| frame.camera.holds(*px));
    let is_unsure = misses.windows(3).any(|three| {
        matches!(three, [Some(a), Some(b), Some(c)]
            if b.0.abs() < UNSURE && (b.0 - a.0) * (c.0 - b.0) <= 0.0)
    });
    (found, is_unsure)
}

/// Points that a frame shows where a search of all instants finds them, by the number of their positions: none,
/// one, several.
fn count_found<'a>(
    frame: &FrameCamera,
    points: impl Iterator<Item = WorldPoint<'a>>,
    most_px: f64,
) -> [usize; 3] {
    let mut counts = [0; 3];
    for point in points {
        let (expected, is_unsure) = search(frame, &frame.fields[0], point);
        if is_unsure {
            continue;
        }
        let found = frame.find_all(point);
        assert_eq!(found.len(), expected.len(), "{point:?}: {found:?} {expected:?}");
        for seen in &found {
            let off_px = expected.iter().map(|px| px.distance(seen.px)).fold(f64::INFINITY, f64::min);
            assert!(off_px < most_px && seen.solutions as usize == found.len(), "{point:?}: {off_px:.1e} px");
        }
        counts[found.len().min(2)] += 1;
    }
    counts
}

const READOUTS: [Readout; 6] = [
    Readout::TopToBottom,
    Readout::BottomToTop,
    Readout::LeftToRight,
    Readout::RightToLeft,
    Readout::MiddleOutward,
    Readout::EdgesInward,
];

#[test]
fn points_are_found_where_a_search_of_all_instants_finds_them() {
    let mut inside = 0;
    for (readout, vibration_deg) in READOUTS.into_iter().flat_map(|d| [(d, 0.0), (d, 0.4)]) {
        let spec = ShutterSpec { readout_ms: 30.0, readout, ..ShutterSpec::default() };
        let frame = FrameCamera::new(path(vibration_deg), camera(), &shutter(spec), 0.5);
        inside += count_found(&frame, points(), 1e-4)[1];
    }
    assert!(inside > 750, "{inside}");
}

#[test]
fn a_row_has_its_instant_and_what_is_between_rows_is_linear() {
    for readout in READOUTS {
        let spec = ShutterSpec { readout_ms: 30.0, delay_ms: 4.0, readout, ..ShutterSpec::default() };
        let frame = FrameCamera::new(path(0.0), camera(), &shutter(spec), 0.5);
        let count = frame.fields[0].poses.len();
        let of_row = |row: usize| {
            let n = count as f64;
            let from_centre = row as f64 - 0.5 * (n - 1.0);
            0.496
                + 0.03 / n
                    * match readout {
                        Readout::TopToBottom | Readout::LeftToRight => from_centre,
                        Readout::BottomToTop | Readout::RightToLeft => -from_centre,
                        Readout::MiddleOutward => 2.0 * from_centre.abs() - 1.0,
                        Readout::EdgesInward => 1.0 - 2.0 * from_centre.abs(),
                    }
        };
        for k in 0..10 * (count - 1) {
            let (row, fraction) = (k / 10, 0.1 * (k % 10) as f64);
            let expected_s = of_row(row) + fraction * (of_row(row + 1) - of_row(row));
            let off_s = (frame.fields[0].time_s(row as f64 + fraction) - expected_s).abs();
            assert!(off_s < 1e-12, "{readout:?} {row} {fraction}: {off_s}");
        }
    }
}

#[test]
fn both_solutions_of_a_close_pair_are_found() {
    // A long lens that shakes by two degrees sixty times a second: rows are overtaken again and again.
    let camera = CameraModel::new(SIZE_PX, [800.0, 788.0], None, LensModel::Pinhole, &[]).unwrap();
    let camera = Arc::new(camera);
    let vibration = [(Axis::Pitch, 60.0), (Axis::Yaw, 60.0), (Axis::Roll, 55.0)]
        .map(|(axis, hz)| VibrationSpec { axis, amplitude_deg: 2.0, amplitude_m: 0.0, hz, phase_deg: 20.0 });
    let path = path_with(&vibration);
    for readout in READOUTS {
        let spec = ShutterSpec { readout_ms: 30.0, readout, ..ShutterSpec::default() };
        let frame = FrameCamera::new(path.clone(), camera.clone(), &shutter(spec), 0.5);
        let pose = path.pose(0.5);
        // Over the whole picture, near and far.
        let points = (0..750).map(|i| {
            let px = DVec2::new(f64::from(i % 30) * 10.0 - 120.0, f64::from(i / 30) * 8.0 - 76.0);
            let ray = pose.ned_from_camera * camera.unproject(px).unwrap().extend(1.0);
            if i % 3 == 0 {
                WorldPoint::Towards(ray)
            } else {
                WorldPoint::At(pose.position_ned_m + 40.0 * ray)
            }
        });
        let [none, one, several] = count_found(&frame, points, 0.02);
        assert!(none > 50 && one > 12 && several > 12, "{readout:?}: {none} {one} {several}");
    }
}

#[test]
fn what_no_row_shows_is_where_the_first_or_last_row_has_it() {
    for readout in READOUTS {
        let spec = ShutterSpec { readout_ms: 30.0, readout, ..ShutterSpec::default() };
        let shutter = shutter(spec);
        let frame = FrameCamera::new(path(0.4), camera(), &shutter, 0.5);
        let mut count = 0;
        for point in points().filter(|&point| frame.find_all(point).is_empty()) {
            let ends = [0, shutter.lines() - 1].map(|line| {
                let t_s = 0.5 + shutter.dt_row_s(line);
                let (px, _) = frame.camera.show(&frame.path.pose(t_s), t_s, point)?;
                Some(((frame.along(px) - f64::from(line)).abs(), px))
            });
            let nearest = ends.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(frame.outside(point, DVec2::ZERO), nearest.map(|(_, px)| px), "{readout:?} {point:?}");
            count += usize::from(nearest.is_some());
        }
        assert!(count > 30, "{readout:?}: {count}");
    }
}

/// Points all around a camera, in front and behind.
fn points_around() -> impl Iterator<Item = WorldPoint<'static>> {
    (0..400).map(|i| {
        let height = (f64::from(i) + 0.5) / 200.0 - 1.0;
        let around = DVec2::from_angle(2.4 * f64::from(i)) * (1.0 - height * height).sqrt();
        let direction = around.extend(height);
        match i % 3 {
            0 => WorldPoint::Towards(direction),
            _ => WorldPoint::At(DVec3::new(0.0, 0.0, -50.0) + 200.0 * direction),
        }
    })
}

#[test]
fn a_wide_lens_shows_what_is_beside_and_behind() {
    let k = [-0.02, 0.001, -2e-4, 1e-5];
    let camera = Arc::new(CameraModel::new(SIZE_PX, [14.0; 2], None, LensModel::KannalaBrandt, &k).unwrap());
    let mut behind = 0;
    let pose = path(0.0).pose(0.5);
    for point in points_around() {
        let to_point = match point {
            WorldPoint::At(position) => position - pose.position_ned_m,
            WorldPoint::Towards(direction) => direction,
            WorldPoint::On { .. } => continue,
        };
        let ray = pose.ned_from_camera.conjugate() * to_point;
        let theta = ray.angle_between(DVec3::Z);
        let radius = theta + (0..4).map(|i| k[i] * theta.powi(2 * i as i32 + 3)).sum::<f64>();
        let wanted_px = ray.truncate().normalize() * radius * 14.0 + DVec2::new(31.5, 23.5);
        let (px, depth_m) = camera.show(&pose, 0.5, point).unwrap();
        assert!(px.distance(wanted_px) < 1e-9, "{point:?}: {px} instead of {wanted_px}");
        let depth = if ray.z > 0.0 { ray.z } else { ray.length() };
        assert!(matches!(point, WorldPoint::Towards(_)) == depth_m.is_infinite());
        assert!(depth_m.is_infinite() || (depth_m - depth).abs() < 1e-9);
        behind += usize::from(ray.z < 0.0);
    }
    assert!(behind > 150, "{behind}");
    // With rows of their own instants.
    let spec = ShutterSpec { readout_ms: 30.0, ..ShutterSpec::default() };
    let frame = FrameCamera::new(path(0.0), camera, &shutter(spec), 0.5);
    count_found(&frame, points_around(), 1e-4);
    let mut inside = 0;
    for point in points_around() {
        let (expected, _) = search(&frame, &frame.fields[0], point);
        inside += expected.len();
        if let Some(shown) = frame.projector().by_steps(point, DVec2::new(30.0, 20.0)) {
            assert!(
                expected.iter().any(|px| px.distance(shown.px) < 1e-3),
                "{point:?}: {shown:?} {expected:?}"
            );
        }
    }
    assert!(inside > 200, "{inside}");
}

#[test]
fn a_fast_picture_shows_a_point_several_times_or_never() {
    // Fifteen degrees thirty times a second: the picture moves faster than the readout.
    let spec = ShutterSpec { readout_ms: 30.0, ..ShutterSpec::default() };
    let frame = FrameCamera::new(path(15.0), camera(), &shutter(spec), 0.5);
    let [_, one, several] = count_found(&frame, points(), 0.01);
    assert!(one > 50 && several > 20, "{one} {several}");
}

#[test]
fn interlaced_rows_belong_to_their_own_field() {
    let spec = ShutterSpec { readout_ms: 10.0, interlace_ms: FieldOr::Ms(15.0), ..ShutterSpec::default() };
    let frame = FrameCamera::new(path(0.0), camera(), &shutter(spec), 0.5);
    let mut of_field = [0, 0];
    for point in points() {
        let Some(found) = find(&frame, point, DVec2::ZERO) else { continue };
        let field = frame.fields.iter().position(|field| {
            let row = field.row_of(found.px.y);
            (field.time_s(row) - found.t_s).abs() < 1e-9
        });
        let field = field.unwrap();
        of_field[field] += usize::from(frame.fields[field].distance_to_rows_px(found.px.y) <= 0.5);
    }
    assert!(of_field.iter().all(|&count| count > 30), "{of_field:?}");
}

#[test]
fn a_point_that_moves_is_found_where_a_search_finds_it() {
    let spec = ShutterSpec { readout_ms: 30.0, ..ShutterSpec::default() };
    let frame = FrameCamera::new(path(0.0), camera(), &shutter(spec), 0.5);
    // It turns about the position below the picture's middle, 12 times a second: half as fast as rows are
    // read.
    let hub = DAffine3::from_translation(DVec3::new(65.0, 3.0, 0.0));
    let track = Track::Spin { axis: DVec3::Z, hz: 12.0, phase_rad: 0.3 };
    let joint = Joint::new(JointFrame::from_affine(&hub).unwrap(), track);
    let motion = RigidMotion::new(vec![joint]);
    let mut inside = 0;
    for k in 0..60 {
        let at = DVec3::new(50.0 + 2.0 * f64::from(k % 8), -15.0 + 4.0 * f64::from(k / 8), 0.0);
        let point = WorldPoint::On { motion: &motion, at_start_ned_m: at };
        inside += count_found(&frame, [point].into_iter(), 1e-3)[1..].iter().sum::<usize>();
        let again = WorldPoint::on(Some(&motion), point.position_ned_m(0.7).unwrap(), 0.7);
        assert!(again.position_ned_m(0.0).unwrap().distance(at) < 1e-12);
    }
    assert!(inside > 20, "{inside}");
}

#[test]
fn a_global_shutter_shows_a_point_where_its_camera_projects_it() {
    let frame = FrameCamera::global(path(0.4), camera(), 0.5);
    let pose = frame.path.pose(0.5);
    for point in points() {
        let expected = frame.project(&pose, 0.5, point).map(|seen| seen.px);
        let is_inside = expected.is_some_and(|px| frame.camera.holds(px));
        let found = find(&frame, point, DVec2::ZERO).map(|found| found.px);
        assert_eq!(found, expected.filter(|_| is_inside));
        assert!(is_inside || frame.outside(point, DVec2::ZERO) == expected);
    }
}

/// Points found by steps, of those that are seen; each must be where it is seen.
fn found_by_steps(frame: &FrameCamera, tolerance_px: f64) -> [usize; 2] {
    let projector = frame.projector();
    let (mut by_steps, mut inside) = (0, 0);
    for (i, point) in points().enumerate() {
        let near_px = DVec2::new(30.0, 20.0);
        let expected = find(frame, point, near_px);
        // From a guess that is near, and from one that is not.
        let guess_px = expected.filter(|_| i % 2 == 0).map_or(near_px, |seen| seen.px + 0.7);
        let found = projector.by_steps(point, guess_px);
        inside += usize::from(expected.is_some());
        let Some(found) = found else { continue };
        let expected = expected.unwrap();
        assert_eq!(expected.solutions, 1);
        let off_px = found.px.distance(expected.px);
        assert!(off_px < tolerance_px, "{point:?}: {off_px:.1e} px");
        assert!(found.position_ned_m.distance(expected.pose.position_ned_m) < 1e-5, "{point:?}");
        assert!(found.depth_m == expected.depth_m || (found.depth_m / expected.depth_m - 1.0).abs() < 1e-6);
        by_steps += 1;
    }
    [by_steps, inside]
}

#[test]
fn steps_find_points_where_the_search_of_the_readout_finds_them() {
    let readouts = [Readout::TopToBottom, Readout::BottomToTop, Readout::LeftToRight, Readout::RightToLeft];
    for (direction, vibration_deg) in readouts.into_iter().flat_map(|d| [(d, 0.0), (d, 0.02)]) {
        let spec = ShutterSpec { readout_ms: 30.0, readout: direction, ..ShutterSpec::default() };
        let frame = FrameCamera::new(path(vibration_deg), camera(), &shutter(spec), 0.5);
        let [by_steps, inside] = found_by_steps(&frame, 2.0 * 1e-4);
        assert!(by_steps == inside && inside > 40, "{direction:?}: {by_steps} of {inside}");
    }
    let global = FrameCamera::global(path(0.4), camera(), 0.5);
    let [by_steps, inside] = found_by_steps(&global, 1e-9);
    assert!(by_steps == inside && inside > 40, "{by_steps} of {inside}");
}

#[test]
fn a_camera_that_shakes_or_has_fields_is_left_to_the_search() {
    let spec = ShutterSpec { readout_ms: 30.0, ..ShutterSpec::default() };
    let shaken = FrameCamera::new(path(15.0), camera(), &shutter(spec.clone()), 0.5);
    let fields = FrameCamera::new(
        path(0.0),
        camera(),
        &shutter(ShutterSpec { interlace_ms: FieldOr::Ms(15.0), ..spec }),
        0.5,
    );
    for frame in [shaken, fields] {
        let [by_steps, inside] = found_by_steps(&frame, 1e-12);
        assert!(by_steps == 0 && inside > 40, "{by_steps} of {inside}");
    }
}
