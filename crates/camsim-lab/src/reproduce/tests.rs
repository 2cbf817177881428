//! Every experiment with small frames, without the paper's files.

use camsim_engine::AdapterChoice;

use super::{displacement::DisplacementModel, *};

/// Width of the frames; circles have a diameter of 5 px.
const WIDTH_PX: u32 = 240;

/// Largest RMS error of detected circles, px: twice the error of circles of 5 px through the fisheye (0.02
/// px; straight down 0.003 to 0.01).
const MAX_CIRCLE_ERROR_PX: f64 = 0.04;

/// Runs `check` with the software adapter.
fn with_setup(check: impl FnOnce(&Setup<'_>)) {
    let engine = Engine::new(AdapterChoice::Software)
        .expect("tests need a software Vulkan adapter; CAMSIM_SKIP_GPU=1 skips them");
    let scratch = tempfile::tempdir().expect("a folder");
    check(&Setup { engine: &engine, data: None, scratch: scratch.path(), width_px: WIDTH_PX });
}

/// The number in a row (by its first cells) and a column of a table.
fn cell(report: &ExperimentReport, table: &str, row: &[&str], column: &str) -> f64 {
    let (_, table) = report.tables.iter().find(|(name, _)| *name == table).expect("the table");
    let column = table.columns.iter().position(|name| name == column).expect("the column");
    let row = table
        .rows
        .iter()
        .find(|cells| cells.iter().zip(row).all(|(cell, name)| cell == name))
        .expect("the row");
    row[column]
        .trim_end_matches([' ', '%'])
        .parse()
        .unwrap_or_else(|_| panic!("no number: {:?}", row[column]))
}

/// Checks that all files of a report are written and not empty.
fn assert_files_written(report: &ExperimentReport, title: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let files = report.write(folder.path(), title).expect("written");
    assert_eq!(files.len(), report.tables.len() + report.plots.len() + report.pictures.len() + 1);
    for file in files {
        assert!(std::fs::metadata(&file).is_ok_and(|data| data.len() > 100), "{}", file.display());
    }
}

#[test]
fn straight_steps_are_first_order_and_heuns_steps_second_order() {
    let points: Vec<glam::DVec2> =
        (0..50).map(|i| glam::DVec2::from_angle(f64::from(i)) * 0.01 * f64::from(i)).collect();
    let errors = time::step_errors(&points, 300.0, glam::DVec3::Z);
    for pair in errors.windows(2).skip(2) {
        let ratio = pair[0].step_deg / pair[1].step_deg;
        assert!((pair[0].linear_px / pair[1].linear_px / ratio - 1.0).abs() < 0.1, "{pair:?}");
        assert!((pair[0].rk2_px / pair[1].rk2_px / ratio.powi(2) - 1.0).abs() < 0.1, "{pair:?}");
    }
    // e = r theta step^2 / 6, with r the RMS distance of the points from the axis.
    let r_px = 300.0 * (points.iter().map(|uv| uv.length_squared()).sum::<f64>() / 50.0).sqrt();
    let expected_px = r_px * 36f64.to_radians() * 1f64.to_radians().powi(2) / 6.0;
    let one_degree = errors.iter().find(|error| (error.step_deg - 1.0).abs() < 1e-9).expect("1 deg");
    assert!((one_degree.rk2_px / expected_px - 1.0).abs() < 0.05, "{one_degree:?} {expected_px}");
}

#[test]
fn linear_model_divides_rotations_into_equal_steps() {
    let twist = camsim_core::temporal::displacement::Twist {
        rate_rad_s: glam::DVec3::Z * 36f64.to_radians(),
        ..Default::default()
    };
    let uv = glam::DVec2::new(0.3, 0.1);
    let one_step = uv - camsim_core::temporal::displacement::image_rate(uv, 0.0, &twist) * -1.0;
    assert_eq!(DisplacementModel::Linear(f64::INFINITY).displace(uv, 0.0, &twist, -1.0), one_step);
    let two = DisplacementModel::Linear(18f64.to_radians() * (1.0 + 1e-9)).displace(uv, 0.0, &twist, -1.0);
    let half = uv - camsim_core::temporal::displacement::image_rate(uv, 0.0, &twist) * -0.5;
    assert_eq!(two, half - camsim_core::temporal::displacement::image_rate(half, 0.0, &twist) * -0.5);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn tracking_follows_the_built_in_flight() {
    with_setup(|setup| {
        let report = Experiment::Tracking.run(setup).expect("done");
        assert!(report.notes[0].contains("built-in flight"));
        for channel in ["north, m", "east, m", "down, m", "roll, deg", "pitch, deg", "yaw, deg"] {
            let [sqrt, spline] = ["sqrt", "spline"].map(|tracker| cell(&report, "rms", &[channel], tracker));
            assert!(sqrt > 0.0 && sqrt < 0.5 && spline > 0.0 && spline < 0.5, "{channel}: {sqrt} {spline}");
        }
        assert!(cell(&report, "motion", &["sqrt"], "acceleration, m/s^2") <= 19.6001);
        assert_files_written(&report, "tracking");
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn circles_are_at_the_positions_of_the_lens_model() {
    with_setup(|setup| {
        for calibration in [0, 1] {
            let found = lens::detect(setup, calibration, 3).expect("done");
            let errors = found
                .pairs
                .iter()
                .map(|(circle, blob)| circle.centroid_px.distance(blob.centroid_px))
                .collect();
            let stats = camsim_core::reference::ErrorStats::of(errors);
            eprintln!("calibration {calibration}: {stats:?}, missed {}", found.missed);
            assert!(
                stats.count > 100 && found.missed == 0 && stats.rms_px < MAX_CIRCLE_ERROR_PX,
                "{stats:?}, missed {}",
                found.missed
            );
        }
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn delayed_frame_equals_the_frame_at_its_instant() {
    with_setup(|setup| {
        let report = Experiment::Time.run(setup).expect("done");
        eprintln!("{}{}", report.tables[0].1.text(), report.tables[1].1.text());
        assert!(cell(&report, "fig14", &["camsim, its own frame"], "RK2 by pictures") < MAX_CIRCLE_ERROR_PX);
        assert!(cell(&report, "fig14", &["36"], "RK2") > 1.0 && cell(&report, "fig14", &["2"], "RK2") < 0.02);
        let [paper, own] = ["RK2, from the frame of the stamp", "camsim"]
            .map(|model| cell(&report, "fig15", &["right", model], "pixels with the wrong surface"));
        assert!(
            paper > 20.0 * own.max(1.0),
            "rim lost by the paper's method: {paper} px, by camsim: {own} px"
        );
        assert_files_written(&report, "time");
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn rolling_shutter_matches_closed_form() {
    with_setup(|setup| {
        let report = Experiment::Shutter.run(setup).expect("done");
        eprintln!("{}{}", report.tables[0].1.text(), report.tables[1].1.text());
        for motion in ["rotation clockwise", "to the right", "upwards", "downwards"] {
            assert!(
                cell(&report, "circles", &[motion, "camsim"], "px RMS") < MAX_CIRCLE_ERROR_PX,
                "{motion}"
            );
            assert!(cell(&report, "circles", &[motion, "camsim"], "missed") == 0.0, "{motion}");
        }
        for motion in ["to the right", "upwards", "downwards"] {
            let [closed, found] =
                ["closed form", "found"].map(|column| cell(&report, "shapes", &[motion], column));
            assert!((closed - found).abs() < 2e-3, "{motion}: {closed} {found}");
        }
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn interlacing_and_blur_match_perfect_frames() {
    with_setup(|setup| {
        let fields = Experiment::Interlace.run(setup).expect("done");
        // The ideal frame contains the corners of both fields, despite the rotation between them.
        let own = &fields.pictures[0].frames[4];
        assert!(
            own.color_rgba().chunks_exact(4).all(|pixel| pixel[3] > 0.0),
            "a pixel of a pinhole camera has no source"
        );
        eprintln!("{}", fields.tables[0].1.text());
        let [paper, own] =
            ["paper: linear, one step", "camsim"].map(|method| cell(&fields, "fig20", &[method], "PSNR, dB"));
        assert!(own > 30.0 && own > paper + 10.0, "{own} {paper}");
        let blur = Experiment::Blur.run(setup).expect("done");
        eprintln!("{}{}", blur.tables[0].1.text(), blur.tables[1].1.text());
        let exact = "against the exact exposure, dB";
        let [straight, own] = [["paper: RK2, straight line", "100"], ["camsim", "as planned"]]
            .map(|row| cell(&blur, "fig16", &row, exact));
        assert!(own > 35.0 && own > straight + 10.0, "{own} {straight}");
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn effects_of_one_second_over_terrain_are_accurate() {
    with_setup(|setup| {
        let report = Experiment::Map.run(setup).expect("done");
        eprintln!("{}", report.tables[0].1.text());
        assert!(cell(&report, "fig21", &["delay, 1 s later"], "camsim: RMS") < 0.01);
        assert!(
            cell(&report, "fig21", &["rolling shutter"], "smooth: RMS")
                < 0.1 * cell(&report, "fig21", &["rolling shutter"], "paper: RMS")
        );
        assert_files_written(&report, "map");
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn every_case_is_timed() {
    with_setup(|setup| {
        let report = Experiment::Speed.run(setup).expect("done");
        for row in &report.tables[0].1.rows {
            assert!(
                row[2].parse::<f64>().is_ok_and(|ms| ms > 0.0)
                    && row[4].parse::<f64>().is_ok_and(|ms| ms > 0.0),
                "{row:?}"
            );
        }
    });
}
