//! Shutter times and frame rates: names, units, contradictions.

use camsim_core::scenario::Readout;

use super::Expected::{Fps, Note, Readout as Ms, Without};
use super::{check, read, refused};

/// A camchain of one camera with 480 rows and further keys.
fn chain(more: &str) -> String {
    let more: String = more.lines().map(|line| format!("  {line}\n")).collect();
    format!(
        "cam0:\n  camera_model: pinhole\n  distortion_model: none\n  intrinsics: [400, 400, 320, 240]\n  \
         resolution: [640, 480]\n{more}"
    )
}

#[test]
fn readout_is_read_under_every_name() {
    for more in [
        "line_delay: 5.0e-5",
        "line_delay_nanoseconds: 50000",
        "line_delay_us: 50",
        "row_time_ms: 0.05",
        "line-delay-nanoseconds: 50000",
        "readout_time_s: 0.024",
        "readout_time_ns: 24000000",
        "readout_ms: 24",
        "rolling_shutter_tr: 0.024",
        "readoutTime_ms: 24.0",
        "image_readout_time_usec: 24000",
        "rolling_shutter: {readout_time_ms: 24}",
        "rolling_shutter: true\nreadout_ms: 24",
        "shutter_type: rolling\nreadout_ms: 24",
        "shutter: {type: rolling, line_delay_ns: 50000}",
        "line_delay: 5.0e-5\nreadout_ms: 24",
    ] {
        check(
            more,
            &read("chain.yaml", &chain(more)),
            &[Ms(24.0), Without("no shutter times"), Without("not applied")],
        );
    }
}

#[test]
fn missing_unit_is_the_only_plausible_one() {
    for (more, unit) in [
        ("readout_time: 0.024", "is read in s,"),
        ("readout_time: 24", "is read in ms,"),
        ("readout_time: 24000", "is read in us,"),
        ("readout_time: 24000000", "is read in ns,"),
        ("rolling_shutter_skew: 24000000", "is read in ns,"),
        ("row_time: 50", "is read in us,"),
        ("rolling_shutter_time: 0.024", "is read in s,"),
    ] {
        check(more, &read("chain.yaml", &chain(more)), &[Ms(24.0), Note(unit)]);
    }
}

#[test]
fn invalid_or_contradicting_timing_is_refused() {
    for (more, words) in [
        ("readout_time: 0.35", ["readout_time", "without a unit"]),
        ("readout_time: 1e12", ["readout_time", "without a unit"]),
        ("readout_time: -24", ["readout_time", "without a unit"]),
        ("line_delay: 50", ["line_delay", "implausible"]),
        ("readout_ms: 24000", ["readout_ms", "implausible"]),
        ("line_delay: 5.0e-5\nreadout_ms: 30", ["readout_ms", "delete the wrong one"]),
        ("readout_ms: fast", ["readout_ms", "not a finite number"]),
        ("readout_ms: .nan", ["chain.yaml:6", "non-finite"]),
        ("rolling_shutter: 0.5", ["rolling_shutter", "neither yes"]),
        ("shutter_type: mechanical", ["shutter_type", "neither rolling nor global"]),
        ("shutter_type: global\nrolling_shutter: true", ["rolling_shutter", "contradicts"]),
        ("readout_direction: inwards\nreadout_ms: 24", ["readout_direction", "not a direction"]),
        ("fps: 20\nframe_rate: 30", ["fps", "frames per second"]),
    ] {
        refused(more, "chain.yaml", &chain(more), &words);
    }
}

#[test]
fn notes_on_the_shutter_match_the_result() {
    for (more, expectations) in [
        (
            "shutter_type: rolling",
            &[Ms(0.0), Note("set shutter.readout_ms"), Without("no shutter times")][..],
        ),
        ("shutter_type: global", &[Ms(0.0), Without("no shutter times"), Without("not applied")]),
        (
            "shutter_type: global\nline_delay: 5.0e-5",
            &[Ms(0.0), Note("not applied: cam0.line_delay (24 ms)")],
        ),
        ("line_delay: 0", &[Ms(0.0), Without("no shutter times"), Without("rows is")]),
        ("exposure_time: 0.01", &[Note("cam0.exposure_time = 0.01"), Without("no shutter times")]),
        ("shutter_speed: 500", &[Note("cam0.shutter_speed = 500"), Without("no shutter times")]),
        ("shutter: 0.002", &[Note("cam0.shutter = 0.002"), Without("no shutter times")]),
        ("readout_noise: 7", &[Note("cam0.readout_noise = 7"), Without("no shutter times")]),
        ("fps: 60", &[Fps(60.0), Note("no shutter times"), Without("no frame rate")]),
        (
            "rate_hz: 20\nreadout_ms: 60",
            &[Fps(20.0), Ms(60.0), Note("longer than the frame period of 50.000 ms")],
        ),
        (
            "fps: 0",
            &[
                Fps(30.0),
                Note("not a frame rate; fps is 30"),
                Without("the file has no frame rate"),
                Without("no frame rate and"),
            ],
        ),
        ("timeshift_cam_imu: 0.002", &[Ms(0.0), Note("timeshift_cam_imu = 0.002")]),
        ("timeshift_cam_imu: 0.0", &[Without("timeshift")]),
        ("imu_rate_hz: 200", &[Fps(30.0), Note("imu_rate_hz = 200")]),
    ] {
        check(more, &read("chain.yaml", &chain(more)), expectations);
    }
}

#[test]
fn readout_direction_is_read() {
    for (more, direction) in [
        ("readout_ms: 24\nreadout_direction: bottom_to_top", Readout::BottomToTop),
        ("readout_ms: -24\nreadout_direction: BottomToTop", Readout::TopToBottom),
        ("line_delay: -5.0e-5", Readout::BottomToTop),
        ("readout_ms: 24\nreadout_direction: left-to-right", Readout::LeftToRight),
        ("readout_ms: 24", Readout::TopToBottom),
    ] {
        let imported = read("chain.yaml", &chain(more));
        check(more, &imported, &[Ms(24.0)]);
        assert_eq!(imported.spec.shutter.readout, direction, "{more}");
    }
}

#[test]
fn vins_rolling_shutter_is_read() {
    let text = |more: &str| {
        format!(
            "%YAML:1.0\nmodel_type: PINHOLE\nimage_width: 640\nimage_height: 480\ndistortion_parameters:\n   \
             k1: 0.1\n   k2: 0\n   p1: 0\n   p2: 0\nprojection_parameters:\n   fx: 400\n   fy: 400\n   cx: \
             320\n   cy: 240\n{more}"
        )
    };
    check(
        "global",
        &read("v.yaml", &text("rolling_shutter: 0\nrolling_shutter_tr: 0.033\n")),
        &[Ms(0.0), Note("not applied: rolling_shutter_tr (33 ms)")],
    );
    check(
        "no time",
        &read("v.yaml", &text("rolling_shutter: 1\nrolling_shutter_tr: 0\n")),
        &[Ms(0.0), Note("set shutter.readout_ms")],
    );
    check("no flag", &read("v.yaml", &text("rolling_shutter_tr: 0.033\n")), &[Ms(33.0)]);
    refused(
        "in ms",
        "v.yaml",
        &text("rolling_shutter: 1\nrolling_shutter_tr: 33\n"),
        &["rolling_shutter_tr", "check its unit"],
    );
}
