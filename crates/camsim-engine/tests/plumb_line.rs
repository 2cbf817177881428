//! In a turn a plumb line leans by rate times readout, measured in rendered pixels with a real log.

mod common;

use std::{path::Path, sync::Arc};

use camsim_core::{
    flight_log::HeightConversion,
    mount::CameraPath,
    scenario::{Channel, MountSpec, ShutterSpec},
    scene::{Encoding, Mesh, MeshVertex, Scene, Texture, Wrap},
    sequence::Sequence,
    tracker::track,
};
use camsim_io::flight_log::read_flight_log;
use common::{engine, render, scenario};
use glam::{DVec2, DVec3};

const READOUT_S: f64 = 0.033;
/// Far enough that only rotation matters.
const DISTANCE_M: f64 = 20_000.0;

/// A plumb wall ahead of the camera whose brightness rises linearly from left to right: lines of equal
/// brightness are plumb lines.
fn plumb_wall(path: &CameraPath, t_s: f64) -> Scene {
    let pose = path.pose(t_s);
    let ahead = pose.ned_from_camera * DVec3::Z;
    let level = DVec3::new(ahead.x, ahead.y, 0.0).normalize();
    let right = DVec3::new(-level.y, level.x, 0.0);
    let ramp: Vec<u8> = (0..=255).flat_map(|v: u8| [v, v, v, 255]).collect();
    let texture = Arc::new(Texture { size_px: [256, 1], rgba8: ramp, encoding: Encoding::Linear });
    // 40 px from black to white: steep enough that half-precision colour places the line to a hundredth of a
    // pixel.
    let half_m = 0.05 * DISTANCE_M;
    let corner = |u: f64, down: f64| {
        let at = right * (2.0 * u - 1.0) * half_m + DVec3::Z * down * DISTANCE_M;
        MeshVertex::new(at.as_vec3().to_array(), [u as f32, 0.5])
    };
    let vertices = vec![corner(0.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0), corner(1.0, 1.0)];
    let origin_ned_m = pose.position_ned_m + level * DISTANCE_M;
    Scene {
        meshes: vec![Mesh::new(vertices, vec![0, 1, 2, 2, 1, 3], texture, origin_ned_m, Wrap::Clamp)],
        ..Scene::default()
    }
}

/// Columns where each row has brightness 1/2, to a fraction of a pixel.
fn line_columns(rgba: &[f32], [width, height]: [u32; 2]) -> Vec<(f64, f64)> {
    (0..height)
        .filter_map(|y| {
            let value = |x: u32| f64::from(rgba[4 * (y * width + x) as usize]);
            (0..width - 1)
                .find(|&x| (value(x) - 0.5) * (value(x + 1) - 0.5) <= 0.0 && value(x) != value(x + 1))
                .map(|x| (f64::from(y), f64::from(x) + (0.5 - value(x)) / (value(x + 1) - value(x))))
        })
        .collect()
}

/// Least-squares slope d(column)/d(row).
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (my, mx) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    points.iter().map(|p| (p.0 - my) * (p.1 - mx)).sum::<f64>()
        / points.iter().map(|p| (p.0 - my).powi(2)).sum::<f64>()
}

/// Slope by the rolling shutter in the image and by rate times readout, columns a row.
fn measured_and_expected(log: &Path, t_s: f64) -> (f64, f64) {
    let mut scenario = scenario();
    scenario.camera.size_px = [320, 240];
    scenario.camera.focal_px = [400.0, 400.0];
    scenario.camera.mount = MountSpec::default();
    let rows = read_flight_log(log, &scenario.flight, HeightConversion::None).expect("a readable log").rows;
    let path = CameraPath::new(
        track(&rows, &scenario.tracker).expect("trackable").trajectory,
        &scenario.camera.mount,
    )
    .expect("mount");
    let scene = plumb_wall(&path, t_s);
    let engine = engine();
    let with_readout = |readout_ms: f64| {
        let mut scenario = scenario.clone();
        scenario.camera.shutter = ShutterSpec { readout_ms, ..ShutterSpec::default() };
        let sequence =
            Sequence { start_s: t_s, ..Sequence::in_memory(scenario, path.clone(), scene.clone(), 1) };
        let done = render(&engine, &Arc::new(sequence), &[Channel::Color], 0);
        let points = line_columns(done.frame.color_rgba(), done.frame.size_px);
        assert!(points.len() > 200, "the line crosses the image: {} rows", points.len());
        // The middle half: there the line is straight to first order.
        let middle: Vec<_> = points.into_iter().filter(|p| (60.0..180.0).contains(&p.0)).collect();
        (slope(&middle), middle[middle.len() / 2])
    };
    let ((still, at), (rolling, _)) = (with_readout(0.0), with_readout(1e3 * READOUT_S));
    // Flow of a far point under rotation w (camera axes): u' = -(w_y - w_z v) + u (w_x v - w_y u), v'
    // likewise; a line x = x0 + s y moves along its row by u' - s v'.
    let w = mean_rate(&path, t_s, 0.25 * READOUT_S);
    let uv = (DVec2::new(at.1, at.0) - DVec2::new(159.5, 119.5)) / 400.0;
    let along = w.x * uv.y - w.y * uv.x;
    let flow = DVec2::new(-(w.y - w.z * uv.y) + uv.x * along, -(w.z * uv.x - w.x) + uv.y * along) * 400.0;
    (rolling - still, (flow.x - still * flow.y) * READOUT_S / 240.0)
}

/// Mean angular rate within `half_s` of an instant, in camera axes, rad/s. A real platform's rate changes
/// within a readout; a least-squares slope of its integral weighs it by 1 - (t/half)^2.
fn mean_rate(path: &CameraPath, t_s: f64, half_s: f64) -> DVec3 {
    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
    for k in -10..=10 {
        let x = f64::from(k) / 10.5;
        sum += (1.0 - x * x) * path.rate_camera(t_s + x * half_s);
        weights += 1.0 - x * x;
    }
    sum / weights
}

fn check(log: &Path, t_s: f64) {
    let (measured, expected) = measured_and_expected(log, t_s);
    eprintln!(
        "{} at {t_s} s: leans by {measured:.6} columns a row, rate x readout says {expected:.6}",
        log.display()
    );
    assert!(expected.abs() > 0.005, "a turn that shows: {expected}");
    assert!((measured / expected - 1.0).abs() < 0.02, "measured {measured}, expected {expected}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn plumb_line_leans_by_rate_times_readout() {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo_flight.csv");
    check(&demo, 13.0);
    check(&demo, 26.0);
    match std::env::var_os("CAMSIM_DATA") {
        Some(data) => check(&Path::new(&data).join("camsim/path_lawnmower.csv"), 171.5),
        None => eprintln!("CAMSIM_DATA is not set: the real flight is skipped"),
    }
}
