//! Consistency of written truth: source coordinates with the camera of `frames.csv`, directions of the sky
//! with poses of rows, stamps with their clock.

#![allow(clippy::unwrap_used, reason = "tests")]

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::Channel,
};
use camsim_io::{
    builtin,
    load::{Loaded, load_sequence},
    scenario_file::read_scenario,
    write::SourceFrame,
};
use camsim_plan::Planner;
use glam::{DQuat, DVec2, DVec3};

const SIZE_PX: [u32; 2] = [64, 48];
const CHANNELS: [Channel; 3] = [Channel::Color, Channel::Coords, Channel::Depth];

/// The built-in flight with a small camera that looks at the horizon.
fn demo(sets: &[(&str, &str)]) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = builtin::unpack(folder.path()).unwrap();
    let small = [
        ("camera.size_px", "[64, 48]"),
        ("camera.focal_px", "[42.0, 43.0]"),
        ("camera.principal_point_px", "[31.0, 24.5]"),
        ("camera.mount.angles_deg", "[0.4, -10.0, -0.6]"),
    ];
    let sets: Vec<_> =
        small.iter().chain(sets).map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    load_sequence(&read_scenario(&path, &sets, None).unwrap()).unwrap()
}

#[test]
fn source_coordinates_are_pixels_of_the_camera_in_frames_csv() {
    let sequence = demo(&[]).sequence;
    let planner = Planner::new(sequence.clone(), &CHANNELS, 16_384).unwrap();
    let reference = ReferenceRenderer::new(sequence.clone()).unwrap();
    let plan = planner.plan(7).unwrap();
    let key = Some(plan.ideal_view());
    let options =
        RenderOptions { channels: CHANNELS.to_vec(), key, max_samples: 1, ..RenderOptions::default() };
    let frame = reference.render(7, &options);
    let source = SourceFrame::new(plan.ideal_view(), plan.key_s, sequence.epoch_ns);
    let (depths, coords) = (frame.depth_m().unwrap(), frame.coords().unwrap());
    let (mut ground, mut sky, mut none) = (0, 0, 0);
    for (i, [_, _, x, y, dt_s, n, e, d]) in coords.iter().map(|pixel| pixel.map(f64::from)).enumerate() {
        let vector = DVec3::new(n, e, d);
        if frame.color_rgba()[4 * i + 3] == 0.0 {
            assert_eq!(coords[i], [0.0; 8]);
            none += 1;
            continue;
        }
        let from_source = if depths[i] > 0.0 { vector - source.pose.position_ned_m } else { vector };
        let in_camera = source.pose.ned_from_camera.conjugate() * from_source;
        let position_px = DVec2::from(source.focal_px) * in_camera.truncate() / in_camera.z
            + DVec2::from(source.principal_px);
        // Points are f32: steps of 6e-5 m at 1 km, at a distance of 100 m or more.
        assert!(position_px.distance(DVec2::new(x, y)) < 1e-3, "{position_px} ({x}, {y})");
        // The same by the pose of the row.
        let row = &frame.rows[i / SIZE_PX[0] as usize];
        let uv = DVec2::new(f64::from(coords[i][0]), f64::from(coords[i][1]));
        let ray_ned = row.ned_from_camera * uv.extend(1.0);
        assert!((row.t_mid_ns - frame.stamp_ns - (dt_s * 1e9).round() as i64).abs() < 10, "{dt_s}");
        if depths[i] > 0.0 {
            assert!(vector.distance(row.position_ned_m + f64::from(depths[i]) * ray_ned) < 2e-3);
            ground += 1;
        } else {
            assert!(
                vector.distance(ray_ned.normalize()) < 1e-6 && (vector.length() - 1.0).abs() < 1e-6,
                "{vector}"
            );
            sky += 1;
        }
    }
    assert!(ground > 500 && sky > 200, "{ground} on the ground, {sky} in the sky, {none} without a ray");
    // The instant is that of the pose.
    let pose = sequence.path.pose((source.t_ns - sequence.epoch_ns) as f64 * 1e-9);
    assert!(
        pose.position_ned_m.distance(source.pose.position_ned_m) < 1e-6
            && DQuat::angle_between(pose.ned_from_camera, source.pose.ned_from_camera) < 1e-6
    );
}

#[test]
fn stamps_start_at_the_configured_epoch() {
    let stamps = |sets: &[(&str, &str)]| {
        let loaded = demo(sets);
        let frame = ReferenceRenderer::new(loaded.sequence.clone()).unwrap();
        let rows = frame.row_records(3);
        (
            loaded.log.epoch_ns,
            loaded.sequence.epoch_ns,
            loaded.sequence.start_s,
            rows.iter().map(|row| row.t_mid_ns).collect::<Vec<_>>(),
        )
    };
    let (log_ns, epoch_ns, start_s, by_log) = stamps(&[]);
    assert_eq!((log_ns, start_s), (epoch_ns, 25.0));
    let (_, epoch_ns, _, from_zero) = stamps(&[("output.stamps", "zero")]);
    assert_eq!(epoch_ns, -25_000_000_000);
    // Frame 3 is 0.1 s after the window's beginning, and the middle of its readout is the stamp.
    let middle_ns = (from_zero[23] + from_zero[24]) / 2;
    assert!((middle_ns - 100_000_000).abs() <= 1, "{middle_ns}");
    let (_, _, _, from_epoch) =
        stamps(&[("output.stamps", "zero"), ("output.epoch_ns", "1700000000000000000")]);
    for ((log, zero), epoch) in by_log.iter().zip(&from_zero).zip(&from_epoch) {
        assert_eq!(log - zero, log_ns + 25_000_000_000);
        assert_eq!(epoch - zero, 1_700_000_000_000_000_000);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = builtin::unpack(folder.path()).unwrap();
    let error =
        read_scenario(&path, &[("output.epoch_ns".into(), "5".into())], None).unwrap_err().to_string();
    assert!(
        error.contains("output.epoch_ns: is what stamps begin with")
            && error.contains("output.stamps = \"zero\""),
        "{error}"
    );
}

#[test]
fn impossible_shutter_times_are_warned_of() {
    let warnings = |sets: &[(&str, &str)]| demo(sets).warnings.join("\n");
    for (key, ms) in [("exposure_ms", "33.5"), ("interlace_ms", "70")] {
        let key = format!("camera.shutter.{key}");
        let text = warnings(&[(&key, ms)]);
        assert!(
            text.contains(&format!(
                "{key} = {ms} is longer than a frame's period of 33.333 ms (camera.fps = 30)"
            )),
            "{text}"
        );
    }
}
