//! 8.1: distance of the tracker from the interpolated log.

use camsim_core::{
    flight_log::{FlightLog, HeightConversion},
    scenario::{Auto, FlightSpec, LogFormat, TrackerKind, TrackerSpec},
    tracker::{Channels, TrackReport, TrackResult, track},
};
use camsim_io::{builtin, flight_log::read_flight_log};

use super::{ExperimentReport, ReproduceError, Setup, Table, short};
use crate::plot::{Plot, Series};

/// The paper's limits: 2 g and 60 deg/s^2.
const MAX_ACCELERATION_M_S2: f64 = 19.6;
const MAX_ANGULAR_ACCELERATION_DEG_S2: f64 = 60.0;
/// Measured RMS errors of the paper's program on the same log, without its outliers: north, east, down in m;
/// roll, pitch, yaw in deg.
const REFERENCE_PROGRAM: [f64; 6] = [0.379, 0.314, 0.075, 0.201, 0.038, 0.052];
/// Plotted part of the flight, seconds from its first row.
const PLOTTED_S: [f64; 2] = [100.0, 130.0];
/// Step of the plot.
const PLOT_STEP_S: f64 = 0.1;

/// Result of one tracker.
pub(super) struct TrackedFlight {
    /// Name of the tracker.
    pub name: &'static str,
    /// Tracked motion.
    pub tracked: TrackResult,
    /// Errors against the log.
    pub report: TrackReport,
}

/// Reads the log and tracks it with both trackers.
pub(super) fn track_log(setup: &Setup<'_>) -> Result<(FlightLog, Vec<TrackedFlight>), ReproduceError> {
    let log = match setup.data_file("camsim/path_lawnmower.csv") {
        Some(path) => {
            let spec = FlightSpec { format: LogFormat::CsvLla, ..FlightSpec::new(&path) };
            read_flight_log(&path, &spec, HeightConversion::None)?
        }
        None => {
            let scene = builtin::unpack(&setup.scratch.join("built-in"))?;
            let scenario = camsim_io::scenario_file::read_scenario(&scene, &[], None)?;
            let flight = FlightSpec { window_s: None, ..scenario.flight };
            read_flight_log(&flight.log, &flight, HeightConversion::None)?
        }
    };
    let mut flights = Vec::new();
    for (name, kind) in [("sqrt", TrackerKind::Sqrt), ("spline", TrackerKind::Spline)] {
        let spec = TrackerSpec {
            kind,
            max_acceleration_m_s2: Auto::Value(MAX_ACCELERATION_M_S2),
            max_angular_acceleration_deg_s2: Auto::Value(MAX_ANGULAR_ACCELERATION_DEG_S2),
            ..TrackerSpec::default()
        };
        let tracked = track(&log.rows, &spec).map_err(|error| ReproduceError::setup("the tracker", error))?;
        let report = tracked
            .report(&log.rows)
            .ok_or_else(|| ReproduceError::setup("the flight log", "it has no row"))?;
        flights.push(TrackedFlight { name, tracked, report });
    }
    Ok((log, flights))
}

// Long because: a list of tables.
pub(super) fn run(setup: &Setup<'_>) -> Result<ExperimentReport, ReproduceError> {
    let (log, flights) = track_log(setup)?;
    let real = setup.data.is_some();
    let mut report = ExperimentReport::default();
    let (flight, program) = if real {
        ("FSR 2015-ASL, lawnmower sequence", REFERENCE_PROGRAM.map(short))
    } else {
        (
            "camsim's built-in flight, whose figures do not compare with the paper's; the paper's log needs \
             --data",
            [(); 6].map(|()| "-".to_owned()),
        )
    };
    report.notes.push(format!(
        "Log: {flight}; {} rows, {:.0} s. Limits as in the paper: 2 g and 60 deg/s^2, here of the lengths of \
         the vectors. The numbers of the paper's table 1 are not available; \"reference program\" is the \
         paper's published code, measured on the same log.",
        log.rows.len(),
        log.duration_s()
    ));
    let mut table = Table::new(
        "RMS distance from the interpolated log",
        &["channel", "sqrt", "spline", "reference program", "sqrt, max", "spline, max"],
    );
    let [sqrt, spline] =
        [0, 1].map(|k: usize| (components(&flights[k].report.rms), components(&flights[k].report.max_error)));
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
    report.tables.push(("motion", motion_table(&flights)));
    report.plots.push(("error", error_plot(&log, &flights)));
    Ok(report)
}

fn components(channels: &Channels) -> [f64; 7] {
    let Channels { north_m, east_m, down_m, roll_deg, pitch_deg, yaw_deg, attitude_deg } = *channels;
    [north_m, east_m, down_m, roll_deg, pitch_deg, yaw_deg, attitude_deg]
}

/// The largest speeds and accelerations of the motions.
fn motion_table(flights: &[TrackedFlight]) -> Table {
    let mut table = Table::new(
        "Largest motion used",
        &["tracker", "speed, m/s", "acceleration, m/s^2", "rate, deg/s", "angular acceleration, deg/s^2"],
    );
    for TrackedFlight { name, report, .. } in flights {
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

/// Plot of the distance from the log over a part of the flight.
fn error_plot(log: &FlightLog, flights: &[TrackedFlight]) -> Plot {
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
        series: flights.iter().map(|flight| Series::line(flight.name, points(&flight.tracked))).collect(),
    }
}
