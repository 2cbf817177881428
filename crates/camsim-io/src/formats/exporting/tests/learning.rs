//! Layouts for training: pairs, flow, tar shards.

use std::{collections::BTreeMap, fs, io::Read};

use camsim_core::scenario::DatasetFormat;
use glam::{DQuat, DVec3};
use parquet::{
    file::reader::{FileReader, SerializedFileReader},
    record::RowAccessor,
};

use super::{Sample, exported, names, sample, text};

const TWINS: &str = "[camera.shutter]\nreadout_ms = 4.0\nexposure_ms = 2.0\n\
                     [[output.twin]]\nname = \"clear\"\nexposure = false\n\
                     [[output.twin]]\nname = \"first\"\nshutter = \"global\"\ninstant = \"first-row\"\n\
                     [[output.twin]]\nname = \"middle\"\nshutter = \"global\"\n";

#[test]
fn pairs_of_rolling_and_global_pictures_begin_at_the_first_row() {
    let sample = Sample::with(TWINS, "");
    sample.write(&["color_png", "rows", "depth", "flow_global"]);
    exported(&sample, DatasetFormat::CarlaRs).unwrap();
    let all = names(&sample.out());
    // Frames 4 to 6 follow each other; 9 is alone.
    for name in [
        "carla/seq_000/0002_rs.png",
        "carla/seq_000/0000_gs_f.png",
        "carla/seq_000/0001_gs_m.png",
        "carla/seq_000/0000_flow_gs_m.flo",
        "carla/seq_001/0000_rs.png",
        "fastec/seq_000/002_global_middle.png",
        "fastec/seq_001/meta.log",
    ] {
        assert!(all.iter().any(|known| known == name), "{name} in {all:?}");
    }
    assert!(!all.iter().any(|name| name == "carla/seq_000/0003_rs.png"));
    let picture = |name: &str| fs::read(name).unwrap();
    let path = |name: &str| sample.out().join(name).to_str().unwrap().to_owned();
    let source = sample.run().join("first/color/frame_000005.png").to_str().unwrap().to_owned();
    assert_eq!(picture(&path("carla/seq_000/0001_gs_f.png")), picture(&source));
    // 10 m/s to the north and 1 rad/s to the right, about the camera's y, in the axes of the first row.
    let log = text(&sample.out().join("carla/seq_000/gt_vel.log"));
    let numbers: Vec<f64> = log.lines().last().unwrap().split(' ').map(|v| v.parse().unwrap()).collect();
    let turn_rad = 0.1 * (-0.05 - 0.015);
    let wanted = [0.0, 1.0, 0.0, -10.0 * f64::sin(turn_rad), 0.0, 10.0 * f64::cos(turn_rad)];
    assert!(numbers.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{numbers:?}, not {wanted:?}");
    let depth = text(&sample.out().join("carla/seq_000/0000_rs.pdepth"));
    assert_eq!(depth.lines().nth(1), Some("5.5000 5.7500 6.0000 6.2500 6.5000 6.7500"));
    let calibration = text(&sample.out().join("carla/seq_000/rs_calib.txt"));
    assert!(calibration.contains("ROW_READOUT_TIME(ms): 1.00000000\n"), "{calibration}");
}

#[test]
fn blurred_and_sharp_pictures_have_the_same_names() {
    let sample = Sample::with(TWINS, "");
    sample.write(&["color_png", "rows"]);
    exported(&sample, DatasetFormat::Gopro).unwrap();
    let read = |path: std::path::PathBuf| fs::read(path).unwrap();
    for (name, source) in [
        ("train/cam0/blur_gamma/000009.png", "color/frame_000009.png"),
        ("train/cam0/sharp/000009.png", "clear/color/frame_000009.png"),
        ("train_blur/000/00000004.png", "color/frame_000004.png"),
        ("train_sharp/000/00000004.png", "clear/color/frame_000004.png"),
    ] {
        assert_eq!(read(sample.out().join(name)), read(sample.run().join(source)), "{name}");
    }
}

#[test]
fn flow_files_are_those_of_middlebury() {
    let sample = Sample::new("");
    sample.write(&["color_png", "flow"]);
    exported(&sample, DatasetFormat::Flo).unwrap();
    let all = names(&sample.out().join("training"));
    let flows: Vec<&String> = all.iter().filter(|name| name.ends_with(".flo")).collect();
    assert_eq!(flows, ["flow/cam0_000/frame_000004.flo", "flow/cam0_000/frame_000005.flo"]);
    assert!(all.contains(&"final/cam0_000/frame_000006.png".to_owned()));
    assert!(all.contains(&"final/cam0_001/frame_000009.png".to_owned()));
    let bytes = fs::read(sample.out().join("training/flow/cam0_000/frame_000004.flo")).unwrap();
    assert_eq!(&bytes[..4], b"PIEH");
    let words: Vec<[u8; 4]> = bytes[4..].chunks_exact(4).map(|word| word.try_into().unwrap()).collect();
    assert_eq!([i32::from_le_bytes(words[0]), i32::from_le_bytes(words[1])], [6, 4]);
    for (pixel, pair) in words[2..].chunks_exact(2).enumerate() {
        let [dx, dy, state] = sample::flow(pixel);
        let wanted = if state == 0.0 { [1e10; 2] } else { [dx, dy] };
        assert_eq!([f32::from_le_bytes(pair[0]), f32::from_le_bytes(pair[1])], wanted, "{pixel}");
    }
    let mask =
        image::open(sample.out().join("training/occlusions/cam0_000/frame_000005.png")).unwrap().into_luma8();
    let wanted = (0..24).map(|pixel| if [2.0, 3.0].contains(&sample::flow(pixel)[2]) { 255 } else { 0 });
    assert!(mask.into_raw().into_iter().eq(wanted));
    let stepped = Sample::with("[output]\nflow_step = 2\n", "");
    stepped.write(&["color_png", "flow"]);
    let message = exported(&stepped, DatasetFormat::Flo).unwrap_err().to_string();
    assert!(message.contains("output.flow_step is 2"), "{message}");
}

#[test]
fn shards_hold_each_sample_side_by_side() {
    let sample = Sample::with(TWINS, "");
    sample.write(&["color_png", "depth"]);
    exported(&sample, DatasetFormat::Webdataset).unwrap();
    let path = sample.out().join("shard-000000.tar");
    let mut archive = tar::Archive::new(fs::File::open(&path).unwrap());
    let mut files = Vec::new();
    for entry in archive.entries().unwrap() {
        let mut entry = entry.unwrap();
        let name = entry.path().unwrap().to_str().unwrap().to_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        files.push((name, bytes));
    }
    // A sample's files follow each other, by the name before the first dot.
    let keys: Vec<&str> = files.iter().map(|(name, _)| name.split('.').next().unwrap()).collect();
    let mut groups = keys.clone();
    groups.dedup();
    assert_eq!(groups, ["frame_000004", "frame_000005", "frame_000006", "frame_000009"]);
    let files: BTreeMap<String, Vec<u8>> = files.into_iter().collect();
    let source = |name: &str| fs::read(sample.run().join(name)).unwrap();
    assert_eq!(files["frame_000005.color.png"], source("color/frame_000005.png"));
    assert_eq!(files["frame_000005.clear.depth.exr"], source("clear/depth/frame_000005.exr"));
    let json: serde_json::Value = serde_json::from_slice(&files["frame_000004.json"]).unwrap();
    assert_eq!((json["stamp_ns"].as_i64(), json["frame"].as_u64()), (Some(1_000_000_000), Some(4)));
    assert_eq!(json["position_enu_m"], serde_json::json!([20.0, 10.0, 30.0]));
    let index: serde_json::Value = serde_json::from_str(&text(&sample.out().join("index.json"))).unwrap();
    let shard = &index["shardlist"][0];
    assert_eq!(
        (shard["nsamples"].as_u64(), shard["filesize"].as_u64()),
        (Some(4), Some(path.metadata().unwrap().len()))
    );
}

#[test]
fn the_index_of_columns_is_that_of_lines_with_poses() {
    let sample = Sample::new("");
    sample.write(&["color_png"]);
    exported(&sample, DatasetFormat::Webdataset).unwrap();
    let file = fs::File::open(sample.out().join("samples.parquet")).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
    let csv = text(&sample.out().join("samples.csv"));
    let lines: Vec<&str> = csv.lines().skip(1).collect();
    assert_eq!((rows.len(), lines.len()), (4, 4));
    for (row, line) in rows.iter().zip(lines) {
        let strings = [0, 1, 3].map(|k| row.get_string(k).unwrap());
        let numbers = [2, 4, 5].map(|k| row.get_long(k).unwrap());
        let ([key, shard, camera], [frame, stamp, centre]) = (strings, numbers);
        assert_eq!(format!("{key},{shard},{frame},{camera},{stamp},{centre}"), line);
    }
    // Frame 5 is a metre further north and has turned by 0.1 about down.
    let pose: [f64; 7] = std::array::from_fn(|k| rows[1].get_double(6 + k).unwrap());
    let back = DQuat::from_xyzw(pose[4], pose[5], pose[6], pose[3]);
    let ahead = DVec3::new(0.1_f64.sin(), 0.1_f64.cos(), 0.0);
    assert_eq!(pose[..3], [20.0, 11.0, 30.0]);
    assert!((back * DVec3::Z - ahead).length() < 1e-14 && (back * DVec3::Y + DVec3::Z).length() < 1e-14);
}
