#![allow(clippy::unwrap_used)]

use glam::DQuat;

use super::*;
use crate::scenario::Auto;

/// The log of the paper's test flight without its six corrupted rows; `None` without CAMSIM_DATA.
fn lawnmower() -> Option<Vec<LogRow>> {
    const CORRUPTED: [usize; 6] = [7190, 22762, 23060, 37732, 44551, 44849];
    let Some(data) = std::env::var_os("CAMSIM_DATA") else {
        eprintln!("CAMSIM_DATA is not set: real flight left out");
        return None;
    };
    let text = std::fs::read_to_string(std::path::Path::new(&data).join("camsim/path_lawnmower.csv")).unwrap();
    let mut rows = Vec::new();
    let mut origin = None;
    for (i, line) in text.lines().enumerate() {
        let v: Vec<f64> = line.split(',').map(|field| field.trim().parse().unwrap()).collect();
        let (lat, lon) = (v[1].to_radians(), v[2].to_radians());
        let ecef = ecef(lat, lon, v[3]);
        let (lat0, lon0, ecef0, t0_s) = *origin.get_or_insert((lat, lon, ecef, v[0]));
        let d = ecef - ecef0;
        let (sp, cp, sl, cl) = (lat0.sin(), lat0.cos(), lon0.sin(), lon0.cos());
        let ned = DVec3::new(
            -sp * cl * d.x - sp * sl * d.y + cp * d.z,
            -sl * d.x + cl * d.y,
            -cp * cl * d.x - cp * sl * d.y - sp * d.z,
        );
        if !CORRUPTED.contains(&(i + 1)) {
            rows.push(LogRow {
                t_s: v[0] - t0_s,
                position_ned_m: ned,
                ned_from_body: attitude(v[4].to_radians(), v[5].to_radians(), v[6].to_radians()),
            });
        }
    }
    Some(rows)
}

fn ecef(lat: f64, lon: f64, height_m: f64) -> DVec3 {
    let (a, e2) = (6_378_137.0, 6.694_379_990_141_316_5e-3);
    let n = a / (1.0 - e2 * lat.sin().powi(2)).sqrt();
    DVec3::new((n + height_m) * lat.cos() * lon.cos(), (n + height_m) * lat.cos() * lon.sin(), (n * (1.0 - e2) + height_m) * lat.sin())
}

fn attitude(roll: f64, pitch: f64, yaw: f64) -> DQuat {
    DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(pitch) * DQuat::from_rotation_x(roll)
}

fn spec(kind: TrackerKind, rate_hz: f64) -> TrackerSpec {
    TrackerSpec { kind, rate_hz, ..TrackerSpec::default() }
}

#[test]
fn explore() {
    let Some(rows) = lawnmower() else { return };
    for kind in [TrackerKind::Sqrt, TrackerKind::Spline, TrackerKind::Linear] {
        for rate_hz in [200.0, 400.0, 800.0] {
            let begin = std::time::Instant::now();
            let tracked = track(&rows, &spec(kind, rate_hz)).unwrap();
            let took = begin.elapsed();
            let report = tracked.report(&rows).unwrap();
            eprintln!("{kind:?} {rate_hz} {took:?} report {:?}\n rms {:.4?}\n max {:.3?}\n used {:.4?}\n signs {:.4?} {:.4?} sat {:.3?} {:?}",
                begin.elapsed(), report.rms, report.max_error, report.max_used, report.sign_changes_ned, report.sign_changes_body, tracked.saturation, tracked.limits);
        }
    }
}
