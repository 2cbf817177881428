//! A small output folder, as `camsim render` writes it.

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

use camsim_core::{
    frame::{Plane, RenderedFrame, RowRecord},
    pose::{BodyState, CameraPose},
    scenario::{Channel, ImageFormat, Scenario},
    twin::scenario_of,
};
use glam::{DQuat, DVec3};
use tempfile::TempDir;

use crate::columns::Columns;
use crate::manifest::RunManifest;
use crate::scenario_file::{RELATIVE_PATHS, parse_scenario};
use crate::write::{
    FrameFiles, FrameRecord, FrameTable, FrameWriter, SourceFrame, Stamped, TrackRecord, frames_path,
    trajectory_csv, write_atomic,
};

/// Width and height of its pictures.
pub(super) const SIZE: [u32; 2] = [6, 4];
/// Numbers of its frames, with a gap.
pub(super) const FRAMES: [u64; 4] = [4, 5, 6, 9];

/// The folder of a run, and one for an export.
pub(super) struct Sample {
    base: TempDir,
    scenario: Scenario,
}

/// The IMU of a sample.
pub(super) const IMU_TOML: &str = "kind = \"imu\"\nname = \"imu0\"\ntable = \"imu0.csv\"\nrate_hz = 200.0\nrows = 2\n\
    rows_outside_log = 0\ngravity_at_origin_m_s2 = 9.80737\n\
    T_body_sensor = [[1.0, 0.0, 0.0, 0.5], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.25], [0.0, 0.0, 0.0, 1.0]]\n\
    [noise]\ngyroscope_noise_density = 0.01\ngyroscope_random_walk = 0.001\naccelerometer_noise_density = 0.02\n\
    accelerometer_random_walk = 0.002\n[scenario]\nclock_offset_ms = 2.0\n";

/// Columns of its table.
const IMU_COLUMNS: &str = "t_ns,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2,\
    t_true_ns,gyro_bias_x_rad_s,gyro_bias_y_rad_s,gyro_bias_z_rad_s,accel_bias_x_m_s2,accel_bias_y_m_s2,accel_bias_z_m_s2";

/// Motion of the camera, by frames since the fourth.
pub(super) fn pose(frames: f64) -> CameraPose {
    // Looks north, level, and turns to the right.
    let north = DQuat::from_mat3(&glam::DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X));
    CameraPose {
        position_ned_m: DVec3::new(10.0 + frames, 20.0, -30.0),
        ned_from_camera: DQuat::from_rotation_z(0.1 * frames) * north,
    }
}

/// Nanoseconds of a frame, a tenth of a second each; the fourth is at 1 s.
pub(super) fn stamp_ns(frame: u64) -> i64 {
    1_000_000_000 + 100_000_000 * (frame as i64 - 4)
}

impl Sample {
    /// A sample whose scenario has more keys at its begin.
    pub(super) fn new(keys: &str) -> Self {
        Self::with("", keys)
    }

    /// A sample whose scenario has more tables at its end, and keys at its begin.
    pub(super) fn with(tables: &str, keys: &str) -> Self {
        let camera = if tables.contains("[camera]") {
            ""
        } else {
            "[camera]\nsize_px = [6, 4]\nfocal_px = [5.0, 5.5]\nfps = 10.0\n"
        };
        let text = format!(
            "{keys}[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n{camera}{tables}"
        );
        let scenario = parse_scenario(&text, Path::new("s.toml"), &[]).unwrap();
        Self { base: tempfile::tempdir().unwrap(), scenario }
    }

    pub(super) fn run(&self) -> PathBuf {
        self.base.path().join("run")
    }

    pub(super) fn out(&self) -> PathBuf {
        self.base.path().join("out")
    }

    /// Writes the run with files in these columns, and its twins likewise.
    pub(super) fn write(&self, columns: &[&str]) {
        write_run(&self.run(), &self.scenario, columns);
        let body = |t_ns: i64| Stamped {
            t_ns,
            state: BodyState {
                position_ned_m: DVec3::new(1.0, 2.0, -3.0),
                velocity_ned_m_s: DVec3::new(4.0, 5.0, 6.0),
                acceleration_ned_m_s2: DVec3::ZERO,
                ned_from_body: DQuat::IDENTITY,
                rate_body_rad_s: DVec3::Z,
                angular_acceleration_body_rad_s2: DVec3::ZERO,
            },
        };
        let rows = trajectory_csv([999_000_001, 1_250_000_000].map(body));
        write_atomic(&self.run().join("trajectory.csv"), rows.as_bytes()).unwrap();
        for twin in &self.scenario.output.twin {
            write_run(
                &self.run().join(&twin.name),
                &scenario_of(&self.scenario, twin, None).unwrap(),
                columns,
            );
        }
    }

    /// Writes a run of two cameras, `left` and `right`, half a metre apart.
    pub(super) fn write_rig(&self, columns: &[&str]) {
        self.write(columns);
        std::fs::remove_file(frames_path(&self.run())).unwrap();
        let mut scenario = self.scenario.clone();
        for (name, offset_m) in [("left", -0.25), ("right", 0.25)] {
            scenario.camera.name = name.to_owned();
            scenario.camera.mount.offset_m = [0.0, offset_m, 0.0];
            write_run(&self.run().join(name), &scenario, columns);
        }
        let rig = "[[cameras]]\nname = \"left\"\n[[cameras]]\nname = \"right\"\n";
        std::fs::write(self.run().join("rig.toml"), rig).unwrap();
        let run = serde_json::json!({
            "cameras": { "left": "left/run.json", "right": "right/run.json" },
            "finished": true,
        });
        std::fs::write(self.run().join("run.json"), run.to_string()).unwrap();
    }

    /// Writes sensors as `camsim render` does: an inertial one whose clock is 2 ms ahead, a satellite receiver.
    pub(super) fn write_sensors(&self) {
        let write = |name: &str, text: String| {
            write_atomic(&self.run().join("sensors").join(name), text.as_bytes()).unwrap();
        };
        write("imu0.toml", IMU_TOML.to_owned());
        let rows = "990000000,1,2,3,4,5,6,988000000,0.1,0.2,0.3,0.4,0.5,0.6\n\
                    1500000000,7,8,9,10,11,12,1498000000,0.2,0.3,0.4,0.5,0.6,0.7\n";
        write("imu0.csv", format!("{IMU_COLUMNS}\n{rows}"));
        let gnss = "kind = \"gnss\"\nname = \"gnss0\"\ntable = \"gnss0.csv\"\nrate_hz = 1.0\nrows = 2\n\
                    rows_outside_log = 0\nT_body_sensor = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, \
                    0.0], [0.0, 0.0, 0.0, 1.0]]\n[scenario]\n";
        write("gnss0.toml", gnss.to_owned());
        let fixes = "t_ns,fix,lat_deg,lon_deg,height_m,t_available_ns,t_true_ns,true_lat_deg\n\
                     1000000001,1,46.5,7.25,900.5,1000000005,1000000001,46.5\n\
                     1050000000,0,,,,1050000009,1050000000,46.5\n";
        write("gnss0.csv", fixes.to_owned());
    }

    /// Changes a table or a description of the run.
    pub(super) fn edit(&self, name: &str, change: impl FnOnce(String) -> String) {
        let path = self.run().join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(path, change(text)).unwrap();
    }

    /// Writes tracks: rows of frame, point, x, y, visible, solutions.
    pub(super) fn write_tracks(&self, points: &[[f64; 3]], rows: &[(u64, u64, [f64; 2], u8, u8)]) {
        let mut text = "point,name,source,n_m,e_m,d_m\n".to_owned();
        for (i, [n, e, d]) in points.iter().enumerate() {
            let _ = writeln!(text, "{i},p{i},table.csv,{n},{e},{d}");
        }
        write_atomic(&self.run().join("points.csv"), text.as_bytes()).unwrap();
        let mut text = format!("{}\n", Columns::<TrackRecord>::all().header());
        for (frame, point, [x, y], visible, solutions) in rows {
            let _ = writeln!(text, "{frame},{point},{x},{y},{},7.5,{visible},{solutions}", stamp_ns(*frame));
        }
        write_atomic(&self.run().join("tracks.csv"), text.as_bytes()).unwrap();
    }
}

fn write_run(folder: &Path, scenario: &Scenario, columns: &[&str]) {
    let mut scenario = scenario.clone();
    scenario.output.format = vec![ImageFormat::Png];
    scenario.output.channels = Channel::ALL
        .iter()
        .copied()
        .filter(|channel| columns.iter().any(|c| c.starts_with(channel.name())))
        .collect();
    let manifest = RunManifest {
        version: "0.1.0".into(),
        adapter: "none".into(),
        seed: scenario.seed,
        paths: RELATIVE_PATHS.to_owned(),
        variation: None,
        twin: None,
        scenario: scenario.clone(),
        inputs: [("a.csv".to_owned(), "3 bytes".to_owned())].into(),
        frames: [0, 10],
        shard: None,
        written: 4,
        skipped: 0,
        finished: true,
        tracked_points: None,
        warnings: vec![],
    };
    manifest.write(folder).unwrap();
    let files = FrameFiles::new(folder, &scenario.output, scenario.camera.photometric.output);
    let mut table = FrameTable::default();
    for number in FRAMES {
        let pose = pose((number - 4) as f64);
        let source =
            SourceFrame { size_px: SIZE, focal_px: [5.0; 2], principal_px: [2.5, 1.5], t_ns: 0, pose };
        let (stamp_ns, files) = (stamp_ns(number), files.names(number));
        table.insert(&FrameRecord {
            frame: number,
            instant: None,
            stamp_ns,
            pose,
            geodetic: None,
            source,
            exposure: None,
            files,
        });
    }
    let mut writer = FrameWriter::new(files, 1);
    FRAMES.iter().for_each(|number| writer.write(frame(*number)).unwrap());
    writer.finish().unwrap();
    table.write(&frames_path(folder)).unwrap();
}

/// Depth of a pixel, metres.
pub(super) fn depth_m(number: u64, pixel: usize) -> f32 {
    if pixel == 0 { 0.0 } else { number as f32 + pixel as f32 * 0.25 }
}

/// Flow and its state.
pub(super) fn flow(pixel: usize) -> [f32; 3] {
    let state = pixel % 5;
    [if pixel == 6 { 600.0 } else { pixel as f32 * 0.5 }, -(pixel as f32), state as f32]
}

fn frame(number: u64) -> RenderedFrame {
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let flows: Vec<f32> = (0..pixels).flat_map(flow).collect();
    // The lens shows nothing in the first pixel.
    let light = |i| if i == 3 { 0.0 } else { ((i as u64 * 7 + number) % 97) as f32 / 96.0 };
    let row = |row: u32| {
        // A row is a thousandth of a second, about the stamp less 5 ms.
        let t_ns = stamp_ns(number) - 5_000_000 + (2 * i64::from(row) - 3) * 500_000;
        let pose = pose((t_ns - stamp_ns(4)) as f64 / 1e8);
        RowRecord {
            exposure_ns: 0,
            row,
            t_mid_ns: t_ns,
            position_ned_m: pose.position_ned_m,
            ned_from_camera: pose.ned_from_camera,
            velocity_ned_m_s: DVec3::X,
        }
    };
    RenderedFrame {
        index: number,
        stamp_ns: stamp_ns(number),
        size_px: SIZE,
        planes: vec![
            Plane::color((0..pixels * 4).map(light).collect()),
            Plane::depth((0..pixels).map(|pixel| depth_m(number, pixel)).collect()),
            Plane::float(Channel::Flow, flows.clone()),
            Plane::float(Channel::FlowGlobal, flows),
        ],
        rows: (0..SIZE[1]).map(row).collect(),
    }
}
