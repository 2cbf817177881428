#![allow(clippy::unwrap_used, reason = "tests")]

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::*;
use crate::{
    flight_log::LogRow,
    geodesy::Geodetic,
    pose::BodyState,
    scenario::{ImuSpec, PerAxis, TrackerKind, TrackerSpec, TriadSpec},
    tracker::track,
    trajectory::so3,
};

mod allan;
mod figures;
mod inertial;
mod positions;
mod shaking;
mod strapdown;

fn local_frame() -> LocalFrame {
    LocalFrame::new(Geodetic::from_deg(46.7, 9.85, 2100.0))
}

fn input(trajectory: Trajectory, frame: Option<LocalFrame>, span_s: [f64; 2]) -> SensorInput {
    SensorInput {
        trajectory: Arc::new(trajectory),
        earth: Earth::new(frame, HeightReference::Ellipsoid),
        epoch_ns: 1_000_000_000_000,
        span_s,
        camera_mount: crate::scenario::MountSpec::default(),
    }
}

/// A platform that stands still in the given attitude.
fn still(ned_from_body: DQuat) -> Trajectory {
    let state =
        BodyState { position_ned_m: DVec3::new(10.0, -20.0, -30.0), ned_from_body, ..BodyState::default() };
    Trajectory::listed(vec![0.0], 1.0, vec![state]).unwrap()
}

fn imu(spec: ImuSpec, input: &SensorInput) -> Imu {
    Imu::new(&ImuSpec { name: "imu0".into(), ..spec }, 12, input).unwrap()
}

/// A flight with turns, banks and climbs, tracked at 400 Hz.
fn flown(seconds: f64) -> Trajectory {
    flown_by(TrackerKind::Sqrt, 10.0, seconds)
}

fn flown_by(kind: TrackerKind, rows_hz: f64, seconds: f64) -> Trajectory {
    let row = |i: usize| {
        let t_s = i as f64 / rows_hz;
        let turn = 0.25 * t_s;
        LogRow {
            t_s,
            position_ned_m: DVec3::new(
                80.0 * turn.sin(),
                120.0 * (0.6 * turn).sin(),
                -50.0 - 8.0 * turn.cos(),
            ),
            ned_from_body: DQuat::from_rotation_z(1.3 * turn)
                * DQuat::from_rotation_y(0.2 * (1.7 * turn).sin())
                * DQuat::from_rotation_x(0.5 * (2.3 * turn).sin()),
        }
    };
    let rows: Vec<LogRow> = (0..=(rows_hz * seconds) as usize).map(row).collect();
    Arc::unwrap_or_clone(track(&rows, &TrackerSpec { kind, ..TrackerSpec::default() }).unwrap().trajectory)
}
