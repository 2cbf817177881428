//! 8.1: how far the tracker is from the interpolated log.

use camsim_core::{
    flight_log::{FlightLog, HeightConversion},
    scenario::{Auto, FlightSpec, LogFormat, TrackerKind, TrackerSpec},
    tracker::{Channels, TrackReport, TrackResult, track},
};
use camsim_io::{builtin, flight_log::read_flight_log};

use super::{Report, ReproduceError, Setup, Table, rig, short};
use crate::plot::{Plot, Series};

/// The paper's limits: 2 g and 60 deg/s^2.
const MAX_ACCELERATION_M_S2: f64 = 19.6;
const MAX_ANGULAR_ACCELERATION_DEG_S2: f64 = 60.0;
/// RMS of the reference program on the same log (glitch rows left out), measured: north, east, down in m,
/// roll, pitch, yaw in deg.
const REFERENCE_PROGRAM: [f64; 6] = [0.379, 0.314, 0.075, 0.201, 0.038, 0.052];
/// Part of the flight that is plotted, seconds from its first row, and the step.
const PLOTTED_S: [f64; 2] = [100.0, 130.0];
const PLOT_STEP_S: f64 = 0.1;

/// One tracker's result.
pub(super) struct Followed {
    /// `sqrt` or `spline`.
    pub name: &'static str,
    /// Motion.
    pub tracked: TrackResult,
    /// Errors.
    pub report: TrackReport,
}

/// The log and both trackers on it.
pub(super) fn follow(setup: &Setup<'_>) -> Result<(FlightLog, Vec<Followed>), ReproduceError> {
    let log = match setup.data_file("camsim/path_lawnmower.csv") {
        Some(path) => {
            let spec = FlightSpec {
                log: path.clone(),
                format: LogFormat::CsvLla,
                ..rig::scenario(rig::pinhole(96)).flight
            };
            read_flight_log(&path, &spec, HeightConversion::None)?
        }
        None => {
            let scene = builtin::unpack(&setup.scratch.join("built-in"))?;
            let scenario = camsim_io::scenario_file::read_scenario(&scene, &[], None)?;
            let flight = FlightSpec { window_s: None, ..scenario.flight };
            read_flight_log(&flight.log, &flight, HeightConversion::None)?
        }
    };
    let mut followed = Vec::new();
    for (name, kind) in [("sqrt", TrackerKind::Sqrt), ("spline", TrackerKind::Spline)] {
        let spec = TrackerSpec {
            kind,
            max_acceleration_m_s2: Auto::Value(MAX_ACCELERATION_M_S2),
            max_angular_acceleration_deg_s2: Auto::Value(MAX_ANGULAR_ACCELERATION_DEG_S2),
            ..TrackerSpec::default()
        };
        let tracked = track(&log.rows, &spec).map_err(|error| ReproduceError::made("the tracker", error))?;
        let report = tracked
            .report(&log.rows)
            .ok_or_else(|| ReproduceError::made("the flight log", "it has no row"))?;
        followed.push(Followed { name, tracked, report });
    }
    Ok((log, followed))
}

pub(super) fn run(setup: &Setup<'_>) -> Result<Report, ReproduceError> {
    let (log, followed) = follow(setup)?;
    let real = setup.data.is_some();
    let mut report = Report::default();
    let (flight, program) = if real {
        ("FSR 2015-ASL, lawnmower sequence", REFERENCE_PROGRAM.map(short))
    } else {
        (
            "camsim's built-in flight: the paper's log needs --data, and its figures do not compare with these",
            [(); 6].map(|()| "-".to_owned()),
        )
    };
    report.notes.push(format!(
        "Log: {flight}; {} rows, {:.0} s. Limits as in the paper: 2 g and 60 deg/s^2, here on the lengths of the vectors. The paper's own table 1 \
         is a picture and its numbers are not in the text at hand; \"reference program\" is its published code, measured on the same log.",
        log.rows.len(),
        log.duration_s()
    ));
    let mut table = Table::new(
        "RMS distance from the interpolated log",
        &["channel", "sqrt", "spline", "reference program", "sqrt, max", "spline, max"],
    );
    let [sqrt, spline] =
        [0, 1].map(|k: usize| (listed(&followed[k].report.rms), listed(&followed[k].report.max_error)));
    for (i, name) in
        ["north, m", "east, m", "down, m", "roll, deg", "pitch, deg", "yaw, deg", "attitude, deg"]
            .into_iter()
            .enumerate()
    {
        let program = program.get(i).cloned().unwrap_or_else(|| "-".to_owned());
        table.row([
            name.to_owned(),
            short(sqrt.0[i]),
            short(spline.0[i]),
            program,
            short(sqrt.1[i]),
            short(spline.1[i]),
        ]);
    }
    report.tables.push(("rms", table));
    report.tables.push(("motion", motion(&followed)));
    report.plots.push(("error", error_plot(&log, &followed)));
    Ok(report)
}

fn listed(channels: &Channels) -> [f64; 7] {
    let Channels { north_m, east_m, down_m, roll_deg, pitch_deg, yaw_deg, attitude_deg } = *channels;
    [north_m, east_m, down_m, roll_deg, pitch_deg, yaw_deg, attitude_deg]
}

/// What the motions take of the limits.
fn motion(followed: &[Followed]) -> Table {
    let mut table = Table::new(
        "Largest motion used",
        &["tracker", "speed, m/s", "acceleration, m/s^2", "rate, deg/s", "angular acceleration, deg/s^2"],
    );
    for Followed { name, report, .. } in followed {
        let used = &report.max_used;
        table.row([
            (*name).to_owned(),
            short(used.speed_m_s),
            short(used.acceleration_m_s2),
            short(used.angular_rate_deg_s),
            short(used.angular_acceleration_deg_s2),
        ]);
    }
    table
}

/// Distance from the log over a part of the flight.
fn error_plot(log: &FlightLog, followed: &[Followed]) -> Plot {
    let end_s = log.duration_s();
    let [begin_s, last_s] = if end_s > PLOTTED_S[1] { PLOTTED_S } else { [0.0, end_s] };
    let points = |tracked: &TrackResult| {
        let count = ((last_s - begin_s) / PLOT_STEP_S) as u32;
        (0..=count)
            .map(|k| {
                let t_s = begin_s + PLOT_STEP_S * f64::from(k);
                (t_s, tracked.trajectory.state(t_s).position_ned_m.distance(log.interpolate(t_s).0))
            })
            .collect()
    };
    Plot {
        title: "Distance from the interpolated log".into(),
        x_label: "time from the first row, s".into(),
        y_label: "distance, m".into(),
        log: [false, false],
        series: followed
            .iter()
            .map(|f| Series { name: f.name.into(), points: points(&f.tracked), joined: true })
            .collect(),
    }
}
