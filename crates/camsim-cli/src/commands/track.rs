//! `camsim track`: the platform's motion, without frames.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use camsim_core::{
    flight_log::FlightLog,
    mount::CameraPath,
    scenario::Scenario,
    tracker::{
        Channels, MotionUse, ResolvedLimits, Saturation, SaturationInterval, TrackReport, TrackResult,
    },
    trajectory::Trajectory,
};
use camsim_io::{
    load::{load_sensors, sensor_warnings},
    write::{SENSORS_FOLDER, trajectory_csv, write_sensors},
};
use serde::Serialize;

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    inputs::{self, ScenarioArgs},
    output::write_output,
    render_run::{body_at, camera_at},
};

/// Most rows of a trajectory file: the table is built in memory, about 300 bytes per row.
const MOST_ROWS: f64 = 10e6;

/// Track the flight log and print the motion, without rendering
///
/// Columns: t_s,n_m,e_m,d_m (local NED, metres), vn,ve,vd, an,ae,ad, qw,qx,qy,qz (ned_from_body), wx,wy,wz
/// (body rates, rad/s), alphax,alphay,alphaz (rad/s^2); with --of camera t_s,n_m,e_m,d_m, vn,ve,vd,
/// qw,qx,qy,qz (ned_from_camera), wx,wy,wz (in optical axes): the optical centre with lever arm, mount and
/// vibration. Rows cover flight.window_s at the given rate, or the whole log without a window. t_s is on the
/// clock of output.stamps. The report covers the whole log.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  camsim track flight.toml -o traj.csv
  camsim track flight.toml --of camera --rate 1000 -o poses.csv
  camsim track flight.toml --sensors out
  camsim track flight.toml --report --set tracker.kind=spline")]
pub struct TrackArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Whose motion is printed
    #[arg(long, value_enum, default_value = "body")]
    of: Subject,
    /// Rows per second [default: tracker.rate_hz]
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Output file [default: standard output; with --report or --sensors the motion is not written]
    #[arg(short, long, value_name = "CSV")]
    output: Option<PathBuf>,
    /// Also write the tables of the scenario's sensors (imu, gnss, barometer, magnetometer) below DIR/sensors
    #[arg(long, value_name = "DIR")]
    sensors: Option<PathBuf>,
    /// Print RMS and largest error against the interpolated log, the largest speeds and accelerations used,
    /// and the intervals in which limits were reached
    #[arg(long)]
    report: bool,
    /// Print the report as JSON
    #[arg(long, requires = "report")]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Subject {
    /// The platform, whose motion the log contains
    Body,
    /// The camera on it, with lever arm, mount and vibration
    Camera,
}

#[derive(Serialize)]
struct TrackSummary<'a> {
    rate_hz: f64,
    #[serde(flatten)]
    measured: &'a TrackReport,
    limits: ResolvedLimits,
    saturation: Saturation,
    /// Longest intervals at a limit, seconds on the log's clock.
    saturation_intervals: Vec<SaturationInterval>,
}

/// Number of intervals at a limit that are printed.
const SHOWN_INTERVALS: usize = 10;

/// Tracks the log, writes the motion, prints the report.
pub fn run(args: &TrackArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let scenario = args.scenario.read(console)?;
    let (log, tracked) = inputs::load_flight_only(&scenario, console)?;
    let rate_hz = args.rate.unwrap_or(scenario.tracker.rate_hz);
    let span_s = span_s(&scenario, &tracked.trajectory);
    let rows = row_count(span_s, rate_hz)?;
    if let Some(folder) = &args.sensors {
        write_sensor_tables(folder, &scenario, &log, &tracked, console)?;
    }
    if args.output.is_some() || !(args.report || args.sensors.is_some()) {
        let epoch_ns = scenario.output.stamp_epoch_ns(log.epoch_ns, window_start_s(&scenario));
        let instants = (0..rows).map(|k| span_s[0] + k as f64 / rate_hz);
        let table = match args.of {
            Subject::Body => trajectory_csv(instants.map(|t_s| body_at(&tracked.trajectory, epoch_ns, t_s))),
            Subject::Camera => {
                let path =
                    CameraPath::new(tracked.trajectory.clone(), &scenario.camera.mount).or_bad_input()?;
                warn_of_low_rate(&path, rate_hz, console);
                trajectory_csv(instants.map(|t_s| camera_at(&path, epoch_ns, t_s)))
            }
        };
        write_output(args.output.as_deref(), console, |out| out.write_all(table.as_bytes()))?;
    }
    if let Some(path) = &args.output {
        console.note(format_args!("{rows} rows in {}", path.display()));
    }
    if args.report {
        let measured = tracked
            .report(&log.rows)
            .ok_or_else(|| anyhow!("the flight log has no row to compare with"))
            .or_bad_input()?;
        report(args.json, &tracked, &measured, log.epoch_ns, console)?;
    }
    Ok(())
}

fn write_sensor_tables(
    folder: &Path,
    scenario: &Scenario,
    log: &FlightLog,
    tracked: &TrackResult,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let sensors = load_sensors(scenario, log, tracked.trajectory.clone()).or_bad_input()?;
    if sensors.is_empty() {
        return Err(Failure::bad_input(anyhow!(
            "--sensors: the scenario has none; add [[imu]], [[gnss]], [[barometer]] or [[magnetometer]] \
             (docs/guide/SENSORS.md)"
        )));
    }
    for warning in sensor_warnings(scenario, log, &tracked.trajectory) {
        console.warn(warning);
    }
    let summary = write_sensors(folder, &sensors).or_failed()?;
    console.note(format_args!(
        "{} rows of {} sensors in {}",
        summary.rows,
        summary.sensors,
        folder.join(SENSORS_FOLDER).display()
    ));
    Ok(())
}

/// Path time of the window's begin.
fn window_start_s(scenario: &Scenario) -> f64 {
    scenario.flight.window_s.map_or(0.0, |[start_s, _]| start_s / scenario.flight.speed)
}

/// The window, or the whole log.
fn span_s(scenario: &Scenario, trajectory: &Trajectory) -> [f64; 2] {
    let all = trajectory.span_s();
    scenario.flight.window_s.map_or([all.0, all.1], |window| window.map(|t_s| t_s / scenario.flight.speed))
}

fn warn_of_low_rate(path: &CameraPath, rate_hz: f64, console: &mut Console<'_>) {
    let vibration_hz = path.highest_vibration_hz();
    if vibration_hz > 0.5 * rate_hz {
        console.warn(format_args!(
            "{rate_hz} rows per second are too few for the mount's vibration of {vibration_hz} Hz: use \
             --rate {:.0} or more",
            8.0 * vibration_hz
        ));
    }
}

fn row_count([start_s, end_s]: [f64; 2], rate_hz: f64) -> Result<u64, Failure> {
    let rows = ((end_s - start_s) * rate_hz + 1e-6).floor() + 1.0;
    if !(rate_hz > 0.0 && rate_hz.is_finite()) {
        return Err(Failure::bad_input(anyhow!(
            "--rate {rate_hz}: must be a finite number of hertz above 0"
        )));
    }
    if rows > MOST_ROWS {
        return Err(Failure::bad_input(anyhow!(
            "--rate {rate_hz}: {rows:.0} rows are more than {MOST_ROWS:.0}; lower the rate"
        )));
    }
    Ok(rows as u64)
}

fn report(
    json: bool,
    tracked: &TrackResult,
    measured: &TrackReport,
    epoch_ns: i64,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let TrackResult { limits, saturation, rate_hz, .. } = *tracked;
    let on_clock = |t_s: f64| epoch_ns as f64 * 1e-9 + t_s;
    let saturation_intervals: Vec<SaturationInterval> = tracked
        .saturation_intervals
        .iter()
        .map(|interval| SaturationInterval {
            from_s: on_clock(interval.from_s),
            to_s: on_clock(interval.to_s),
            ..*interval
        })
        .collect();
    if json {
        return Ok(console.json(&TrackSummary {
            rate_hz,
            measured,
            limits,
            saturation,
            saturation_intervals,
        })?);
    }
    let TrackReport { rms, max_error, max_used, samples, .. } = measured;
    console.line(format_args!("{samples} instants at {rate_hz} Hz, against the interpolated log"))?;
    console.line(format_args!("{:<12} {:>12} {:>12}", "error", "RMS", "max"))?;
    for ((name, rms), (_, max)) in channels(rms).into_iter().zip(channels(max_error)) {
        console.line(format_args!("{name:<12} {rms:>12.5} {max:>12.5}"))?;
    }
    console.line(format_args!("{:<28} {:>12} {:>12} {:>12}", "motion", "largest", "limit", "at limit, s"))?;
    for (name, used, limit, held_s) in motion(max_used, &limits, &saturation) {
        console.line(format_args!("{name:<28} {used:>12.4} {limit:>12.4} {held_s:>12.3}"))?;
    }
    if saturation_intervals.is_empty() {
        return Ok(console.line("no limit was reached")?);
    }
    console.line("longest intervals at a limit, seconds on the log's clock")?;
    for interval in saturation_intervals.iter().take(SHOWN_INTERVALS) {
        let (key, duration_s) = (interval.limit.key(), interval.duration_s());
        console.line(format_args!(
            "  {:.3} to {:.3} ({duration_s:.3} s) by tracker.{key}",
            interval.from_s, interval.to_s
        ))?;
    }
    Ok(())
}

fn channels(errors: &Channels) -> [(&'static str, f64); 7] {
    let Channels { north_m, east_m, down_m, roll_deg, pitch_deg, yaw_deg, attitude_deg } = *errors;
    [
        ("north m", north_m),
        ("east m", east_m),
        ("down m", down_m),
        ("roll deg", roll_deg),
        ("pitch deg", pitch_deg),
        ("yaw deg", yaw_deg),
        ("attitude deg", attitude_deg),
    ]
}

fn motion(
    used: &MotionUse,
    limits: &ResolvedLimits,
    held: &Saturation,
) -> [(&'static str, f64, f64, f64); 4] {
    [
        ("speed m/s", used.speed_m_s, limits.max_speed_m_s, held.speed_s),
        ("acceleration m/s^2", used.acceleration_m_s2, limits.max_acceleration_m_s2, held.acceleration_s),
        (
            "angular rate deg/s",
            used.angular_rate_deg_s,
            limits.max_angular_rate_rad_s.to_degrees(),
            held.angular_rate_s,
        ),
        (
            "angular acceleration deg/s^2",
            used.angular_acceleration_deg_s2,
            limits.max_angular_acceleration_rad_s2.to_degrees(),
            held.angular_acceleration_s,
        ),
    ]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camsim_core::pose::BodyState;
    use glam::{DQuat, DVec3};

    use super::*;

    fn still() -> BodyState {
        BodyState {
            position_ned_m: DVec3::new(1.0, 2.0, -3.0),
            velocity_ned_m_s: DVec3::ZERO,
            acceleration_ned_m_s2: DVec3::ZERO,
            ned_from_body: DQuat::IDENTITY,
            rate_body_rad_s: DVec3::ZERO,
            angular_acceleration_body_rad_s2: DVec3::ZERO,
        }
    }

    #[test]
    fn invalid_rates_are_refused() {
        let trajectory = Trajectory::listed(vec![0.0], 10.0, vec![still()]).unwrap();
        let span_s = <[f64; 2]>::from(trajectory.span_s());
        assert_eq!(row_count(span_s, 10.0).unwrap(), 101);
        for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(
                row_count(span_s, rate_hz).unwrap_err().code(),
                crate::failure::BAD_INPUT,
                "{rate_hz}"
            );
        }
    }
}
