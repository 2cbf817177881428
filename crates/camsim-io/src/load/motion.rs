//! Paths and tables of poses: how a model moves as a whole.

use std::f64::consts::TAU;

use camsim_core::{
    flight_log::FlightLog,
    scenario::{GltfSpec, LoopKind, MotionSpec, Scenario},
    scene::{
        Terrain,
        motion::{Between, Curve, Joint, JointFrame, Keys, Repeat, Track},
    },
};
use glam::{DQuat, DVec3};

use super::{LoadError, pose_table::read_pose_table};
use crate::gltf_file::{ModelMotion, NodeSpin};

/// A path on the ground is bent every this many metres, ...
const GROUND_STEP_M: f64 = 1.0;
/// ... and no more often than this.
const MOST_GROUND_STEPS: f64 = 100_000.0;

/// What of the model moves by itself.
pub(super) fn model_motion(spec: &GltfSpec) -> ModelMotion {
    let Some(motion) = &spec.motion else { return ModelMotion::default() };
    let spins = motion.spin.iter().map(|spin| NodeSpin {
        node: spin.node.clone(),
        axis: DVec3::from_array(spin.axis),
        hz: spin.hz,
        phase_rad: (spin.phase_deg / 360.0).fract() * TAU,
    });
    ModelMotion { spins: spins.collect(), animate: motion.animate }
}

/// The motion of the whole model; `None` if it stands.
pub(super) fn carrier(
    scenario: &Scenario,
    log: &FlightLog,
    spec: &GltfSpec,
    terrain: Option<&Terrain>,
) -> Result<Option<Joint>, LoadError> {
    let Some(motion) = &spec.motion else { return Ok(None) };
    let ground = |at: DVec3| -> Result<DVec3, LoadError> {
        if !spec.on_ground {
            return Ok(at);
        }
        let down_m = terrain
            .and_then(|terrain| terrain.down_at(at.x, at.y))
            .ok_or_else(|| LoadError::NoGround { file: spec.file.clone(), north_m: at.x, east_m: at.y })?;
        Ok(DVec3::new(at.x, at.y, down_m))
    };
    let keys = if let Some(path) = &motion.poses {
        let poses = read_pose_table(scenario, log, path, spec.on_ground)?;
        if motion.orient.is_some() && poses.rotations.is_some() {
            return Err(LoadError::Poses {
                path: path.clone(),
                problem:
                    "has attitudes, and scene.gltf.motion.orient says where the front looks: leave one of \
                          them out"
                        .into(),
            });
        }
        let positions = poses.positions_ned_m.into_iter().map(ground).collect::<Result<Vec<_>, _>>()?;
        table_keys(poses.times_s, positions, poses.rotations, motion.orient.unwrap_or(true))
    } else if !motion.path.is_empty() {
        let points = motion.path.iter().copied().map(DVec3::from_array).collect();
        let points = if spec.on_ground { with_steps(points) } else { points };
        path_keys(motion, points.into_iter().map(ground).collect::<Result<_, _>>()?)
    } else {
        return Ok(None);
    };
    let keys = keys.ok_or_else(|| LoadError::Path { file: spec.file.clone() })?;
    Ok(Some(Joint::new(JointFrame::IDENTITY, Track::Keys(keys))))
}

/// Smooth positions and turns at constant rates between the rows of a table.
fn table_keys(
    times_s: Vec<f64>,
    positions: Vec<DVec3>,
    rotations: Option<Vec<DQuat>>,
    orient: bool,
) -> Option<Keys> {
    let position = Curve::smooth(times_s.clone(), positions)?;
    let looking = || {
        let directions: Vec<DVec3> = (0..times_s.len()).map(|k| position.rate_at_key(k)).collect();
        looking_along(&directions)
    };
    let rotations = match rotations {
        Some(rotations) => rotations,
        None if orient => looking(),
        None => vec![DQuat::IDENTITY; times_s.len()],
    };
    let rotation = Curve::new(times_s, rotations, Between::Linear)?;
    Some(Keys { position, rotation, start_s: 0.0, repeat: None })
}

/// Straight lines at a constant speed.
fn path_keys(motion: &MotionSpec, mut points: Vec<DVec3>) -> Option<Keys> {
    points.dedup();
    let kind = motion.repeat.unwrap_or_default();
    if kind == LoopKind::BackAndForth {
        points.extend(points.clone().into_iter().rev().skip(1));
    }
    let speed_m_s = motion.speed_m_s?;
    let mut times_s = vec![0.0];
    let mut at_s = 0.0;
    for pair in points.windows(2) {
        at_s += pair[0].distance(pair[1]) / speed_m_s;
        times_s.push(at_s);
    }
    let directions: Vec<DVec3> = points.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let rotation = match motion.orient.unwrap_or(true) {
        true => Curve::new(times_s[..directions.len()].to_vec(), looking_along(&directions), Between::Step)?,
        false => Curve::constant(DQuat::IDENTITY),
    };
    let repeat = Repeat { from_s: 0.0, period_s: at_s, always: false };
    Some(Keys {
        position: Curve::new(times_s, points, Between::Linear)?,
        rotation,
        start_s: -motion.start_s.unwrap_or(0.0),
        repeat: (kind != LoopKind::Once && at_s > 0.0).then_some(repeat),
    })
}

/// Rotations of a body whose nose looks along each direction, without roll. A body that stands looks as before, at
/// first as it will.
fn looking_along(directions: &[DVec3]) -> Vec<DQuat> {
    let look = |direction: &DVec3| {
        let (yaw, pitch) =
            (direction.y.atan2(direction.x), (-direction.z).atan2(direction.x.hypot(direction.y)));
        DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(pitch)
    };
    let moves = |direction: &&DVec3| direction.length() > 1e-9;
    let mut last = directions.iter().find(moves).map_or(DQuat::IDENTITY, look);
    directions
        .iter()
        .map(|direction| {
            last = if moves(&direction) { look(direction) } else { last };
            last
        })
        .collect()
}

/// The points of a path with more between them.
fn with_steps(points: Vec<DVec3>) -> Vec<DVec3> {
    let length_m: f64 = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let step_m = GROUND_STEP_M.max(length_m / MOST_GROUND_STEPS);
    let mut all: Vec<DVec3> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let count = (pair[0].distance(pair[1]) / step_m).ceil().max(1.0) as u32;
        all.extend((1..=count).map(|k| pair[0].lerp(pair[1], f64::from(k) / f64::from(count))));
    }
    all
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn track(motion: MotionSpec) -> Track {
        let points = motion.path.iter().copied().map(DVec3::from_array).collect();
        Track::Keys(path_keys(&motion, points).unwrap())
    }

    #[test]
    fn a_path_is_driven_at_its_speed() {
        let bent = MotionSpec {
            path: vec![[0.0; 3], [0.0; 3], [30.0, 0.0, 0.0], [30.0, 40.0, 0.0]],
            speed_m_s: Some(10.0),
            start_s: Some(2.0),
            ..MotionSpec::default()
        };
        let state = |repeat, t_s: f64| {
            let state = track(MotionSpec { repeat, ..bent.clone() }).state(t_s);
            let nose = state.rotation * DVec3::X;
            [state.position_m, state.velocity_m_s, nose]
                .map(|v| v.to_array().map(|x| (x * 1e6).round() / 1e6))
        };
        let [north, east, still] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]];
        let times = |direction: [f64; 3], speed: f64| direction.map(|x| x * speed);
        let begin = [[0.0; 3], still, north];
        for (repeat, t_s, expected) in [
            (None, -5.0, begin),
            (None, 3.0, [[10.0, 0.0, 0.0], times(north, 10.0), north]),
            (None, 6.0, [[30.0, 10.0, 0.0], times(east, 10.0), east]),
            (None, 99.0, [[30.0, 40.0, 0.0], still, east]),
            (Some(LoopKind::Repeat), -5.0, begin),
            (Some(LoopKind::Repeat), 10.0, [[10.0, 0.0, 0.0], times(north, 10.0), north]),
            (Some(LoopKind::BackAndForth), 10.0, [[30.0, 30.0, 0.0], times(east, -10.0), times(east, -1.0)]),
            (Some(LoopKind::BackAndForth), 17.0, [[10.0, 0.0, 0.0], times(north, 10.0), north]),
        ] {
            assert_eq!(state(repeat, t_s), expected, "{repeat:?} {t_s}");
        }
    }

    #[test]
    fn noses_look_along_their_directions_without_roll() {
        let direction = DVec3::new(1.0, 2.0, -0.5);
        let looks = looking_along(&[DVec3::ZERO, direction, DVec3::ZERO, -DVec3::Y]);
        let nose = |k: usize| looks[k] * DVec3::X;
        assert!((0..3).all(|k| nose(k).distance(direction.normalize()) < 1e-12));
        assert!(nose(3).distance(-DVec3::Y) < 1e-12 && (looks[1] * DVec3::Y).z.abs() < 1e-12);
    }

    #[test]
    fn a_path_on_the_ground_is_bent_every_metre() {
        let all = with_steps(vec![DVec3::ZERO, DVec3::X * 2.5, DVec3::X * 2.5 + DVec3::Y]);
        assert_eq!(all.len(), 5);
        assert!((all[1].x - 2.5 / 3.0).abs() < 1e-12 && all[4] == DVec3::new(2.5, 1.0, 0.0));
    }
}
