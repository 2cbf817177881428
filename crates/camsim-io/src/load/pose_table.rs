//! Tables of poses: where a model is, by time.

use std::path::Path;

use camsim_core::{flight_log::FlightLog, scenario::Scenario};
use glam::{DQuat, DVec3, EulerRot};

use super::{
    LoadError,
    position_columns::{PositionColumns, check_names},
    scene::position_ned_m,
};
use crate::{
    frame_file::columns::{TableColumn, parse_column},
    table::{finite, open_table},
};

/// Rows of a table of poses.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct PoseTable {
    /// Path times, seconds, ascending.
    pub times_s: Vec<f64>,
    /// NED, metres.
    pub positions_ned_m: Vec<DVec3>,
    /// From body (forward, right, down) to NED; `None` without attitudes.
    pub rotations: Option<Vec<DQuat>>,
}

/// Columns of attitudes, of which a table has all of one line, or none.
const ATTITUDES: [&[&str]; 3] =
    [&["heading_deg"], &["roll_deg", "pitch_deg", "yaw_deg"], &["qw", "qx", "qy", "qz"]];
/// Advice in messages about the header.
const COLUMNS: &str = "give a header with t_s (or t_ms, t_us, t_ns), n_m,e_m,d_m or lat_deg,lon_deg,height_m \
                       and, if wanted, heading_deg, or roll_deg,pitch_deg,yaw_deg, or qw,qx,qy,qz";

/// Numbers of columns.
struct Columns {
    time: usize,
    unit_s: f64,
    position: PositionColumns,
    /// Index in [`ATTITUDES`] and the columns.
    attitude: Option<(usize, Vec<usize>)>,
}

/// Reads a table with a header. Times are on the log's clock. With `on_ground` the column of heights may be
/// missing.
///
/// # Errors
/// The table cannot be read, lacks columns, or a value is out of range.
pub(super) fn read_pose_table(
    scenario: &Scenario,
    log: &FlightLog,
    path: &Path,
    on_ground: bool,
) -> Result<PoseTable, LoadError> {
    let fail = |problem: String| LoadError::Poses { path: path.into(), problem };
    let mut reader = open_table(path)
        .map_err(|error| fail(format!("cannot be read: {error}; check scene.gltf.motion.poses")))?;
    let header = reader.headers().map_err(|error| fail(error.to_string()))?.clone();
    let columns = columns(&header, on_ground).map_err(|problem| fail(format!("line 1: {problem}")))?;
    let mut table =
        PoseTable { rotations: columns.attitude.as_ref().map(|_| Vec::new()), ..PoseTable::default() };
    for record in reader.records() {
        let record = record.map_err(|error| fail(error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let fail = |problem: String| fail(format!("line {line}: {problem}"));
        let number = |column: usize| finite(&record, column).map_err(fail);
        let since_epoch_s = match record.get(columns.time).and_then(|text| text.parse::<i64>().ok()) {
            // Nanoseconds of a calendar clock have more digits than a float.
            Some(ns) if columns.unit_s == 1e-9 => ns.saturating_sub(log.epoch_ns) as f64 * 1e-9,
            _ => number(columns.time)? * columns.unit_s - log.epoch_ns as f64 * 1e-9,
        };
        let t_s = since_epoch_s / scenario.flight.speed;
        if table.times_s.last().is_some_and(|last| *last >= t_s) {
            return Err(fail(
                "its time is not later than that of the row before: sort the rows by time".into(),
            ));
        }
        let (local, geodetic) = columns.position.read(&record).map_err(fail)?;
        table.times_s.push(t_s);
        table.positions_ned_m.push(position_ned_m(
            scenario,
            log,
            local,
            geodetic,
            "a position of scene.gltf.motion.poses",
        )?);
        if let (Some((kind, parts)), Some(rotations)) = (&columns.attitude, &mut table.rotations) {
            let parts = parts.iter().map(|&column| number(column)).collect::<Result<Vec<_>, _>>()?;
            let rotation = rotation(*kind, &parts)
                .ok_or_else(|| fail("qw,qx,qy,qz are all 0, which is no attitude: 1,0,0,0 is none".into()))?;
            rotations.push(rotation);
        }
    }
    if table.times_s.is_empty() { Err(fail("has no row: give a pose a line".into())) } else { Ok(table) }
}

fn columns(header: &csv::StringRecord, on_ground: bool) -> Result<Columns, String> {
    let is_known = |name: &str| {
        matches!(parse_column(name), TableColumn::Time(Some(_)))
            || ATTITUDES.iter().any(|names| names.contains(&name))
    };
    check_names(header, is_known, COLUMNS)?;
    let column = |name: &str| header.iter().position(|known| known == name);
    let mut times = header.iter().enumerate().filter_map(|(k, name)| match parse_column(name) {
        TableColumn::Time(Some(unit)) => Some((k, unit.factor)),
        _ => None,
    });
    let (time, unit_s) = match (times.next(), times.next()) {
        (Some(time), None) => time,
        _ => return Err(format!("one column of times is wanted; {COLUMNS}")),
    };
    let position = PositionColumns::of(header, on_ground).ok_or_else(|| {
        format!("positions are missing or not whole, or there are two kinds of them; {COLUMNS}")
    })?;
    let begun: Vec<usize> = (0..ATTITUDES.len())
        .filter(|&kind| ATTITUDES[kind].iter().any(|name| column(name).is_some()))
        .collect();
    let attitude = match begun[..] {
        [] => None,
        [kind] => {
            let parts: Option<Vec<usize>> = ATTITUDES[kind].iter().map(|name| column(name)).collect();
            let parts = parts.ok_or_else(|| format!("{} belong together", ATTITUDES[kind].join(",")))?;
            Some((kind, parts))
        }
        _ => return Err(format!("there are two kinds of attitudes; {COLUMNS}")),
    };
    Ok(Columns { time, unit_s, position, attitude })
}

/// Rotation from body to NED of one of [`ATTITUDES`]; `None` if the numbers have none.
fn rotation(kind: usize, parts: &[f64]) -> Option<DQuat> {
    match (kind, parts) {
        (0, [heading]) => Some(DQuat::from_rotation_z(heading.to_radians())),
        (1, [roll, pitch, yaw]) => {
            let [roll, pitch, yaw] = [roll, pitch, yaw].map(|angle| angle.to_radians());
            Some(DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll))
        }
        (2, &[w, x, y, z]) => {
            let rotation = DQuat::from_xyzw(x, y, z, w);
            (rotation.length() > 0.0).then(|| rotation.normalize())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn header(text: &str, on_ground: bool) -> Result<Columns, String> {
        columns(&csv::StringRecord::from(text.split(',').collect::<Vec<_>>()), on_ground)
    }

    #[test]
    fn columns_are_found_by_their_names() {
        let found = header("\u{feff}t_ns,yaw_deg,pitch_deg,roll_deg,e_m,n_m,d_m", false).unwrap();
        assert_eq!((found.time, found.unit_s, found.position.is_local), (0, 1e-9, true));
        assert_eq!(
            (found.position.columns, found.attitude),
            ([Some(5), Some(4), Some(6)], Some((1, vec![3, 2, 1])))
        );
        let found = header("lat_deg,lon_deg,t_s", true).unwrap();
        assert_eq!((found.position.is_local, found.position.columns[2], found.attitude), (false, None, None));
        for (text, wanted) in [
            ("t_s,n_m,e_m", "positions are missing"),
            ("n_m,e_m,d_m", "one column of times"),
            ("t,n_m,e_m,d_m", "the column `t`"),
            ("t_s,t_ms,n_m,e_m,d_m", "one column of times"),
            ("t_s,n_m,e_m,d_m,lat_deg", "two kinds of them"),
            ("t_s,n_m,e_m,d_m,qw,qx", "qw,qx,qy,qz belong together"),
            ("t_s,n_m,e_m,d_m,heading_deg,qw,qx,qy,qz", "two kinds of attitudes"),
            ("t_s,n_m,e_m,d_m,e_m", "two columns `e_m`"),
            ("t_s,n_m,e_m,d_m,size", "the column `size`"),
        ] {
            let Err(said) = header(text, false) else { panic!("{text}") };
            assert!(said.contains(wanted), "{text}: {said}");
        }
    }

    #[test]
    fn attitudes_of_all_kinds_agree() {
        let yawed = rotation(0, &[90.0]).unwrap();
        assert!((yawed * DVec3::X).distance(DVec3::Y) < 1e-12);
        assert!(rotation(1, &[0.0, 0.0, 90.0]).unwrap().angle_between(yawed) < 1e-7);
        let half = 0.5_f64.sqrt();
        assert!(rotation(2, &[2.0 * half, 0.0, 0.0, 2.0 * half]).unwrap().angle_between(yawed) < 1e-7);
        // Nose up, then rolled to the right.
        let tilted = rotation(1, &[30.0, 20.0, 0.0]).unwrap();
        assert!((tilted * DVec3::X).z < 0.0 && (tilted * DVec3::Y).z > 0.0);
        assert_eq!(rotation(2, &[0.0; 4]), None);
    }
}
