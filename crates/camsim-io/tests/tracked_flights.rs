//! Tracking error of real flights with default settings.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::PathBuf;

use camsim_core::scenario::{Auto, TrackerKind};
use camsim_io::{load::load_flight, scenario_file::parse_scenario};

/// Files, with the largest allowed RMS error of the attitude, degrees, by tracker.
const FLIGHTS: [(&str, [(TrackerKind, f64); 2]); 2] = [
    ("euroc_V1_03_difficult.txt", [(TrackerKind::Sqrt, 0.70), (TrackerKind::Spline, 0.15)]),
    ("tumvi_corridor1_okvis.txt", [(TrackerKind::Sqrt, 1.0), (TrackerKind::Spline, 0.25)]),
];

#[test]
fn agile_flights_are_tracked_within_one_degree() {
    let Some(data) = std::env::var_os("CAMSIM_DATA").map(PathBuf::from) else {
        eprintln!("CAMSIM_DATA is not set: skipped");
        return;
    };
    for (file, bounds) in FLIGHTS {
        let text = format!(
            "[flight]\nlog = \"{file}\"\n[scene]\npattern = {{ image = \"none.png\", width_m = 1.0 \
                }}\n[tracker]\nmax_acceleration_m_s2 = \"auto\"\n"
        );
        let mut scenario = parse_scenario(&text, &data.join("flights/s.toml"), &[]).unwrap();
        for (kind, max_deg) in bounds {
            scenario.tracker.kind = kind;
            let (log, tracked) = load_flight(&scenario).unwrap();
            let report = tracked.report(&log.rows).unwrap();
            eprintln!("{file}, {kind:?}: {:.3} deg RMS", report.rms.attitude_deg);
            assert!(report.rms.attitude_deg < max_deg, "{file}, {kind:?}: {:?}", report.rms);
            assert!(
                report.rms.north_m.max(report.rms.east_m).max(report.rms.down_m) < 0.02,
                "{file}, {kind:?}: {:?}",
                report.rms
            );
            assert_eq!(tracked.distance_warning(&log.rows), None);
        }
        // The limits of the paper are too low for these flights, which gives a warning.
        scenario.tracker.kind = TrackerKind::Sqrt;
        scenario.tracker.max_angular_acceleration_deg_s2 = Auto::Value(60.0);
        let (log, tracked) = load_flight(&scenario).unwrap();
        assert!(tracked.report(&log.rows).unwrap().rms.attitude_deg > 10.0);
        let warning = tracked.distance_warning(&log.rows).unwrap();
        assert!(warning.contains("deg RMS from the log"), "{warning}");
        assert!(
            tracked
                .saturation_intervals
                .iter()
                .all(|hold| hold.limit.key() == "max_angular_acceleration_deg_s2" || hold.duration_s() < 1.0)
        );
    }
}
