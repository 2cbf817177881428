//! What SLAM, odometry and calibration programs need of names, clocks, pictures and settings.

use std::{collections::BTreeSet, fs, path::Path};

use camsim_core::scenario::DatasetFormat;
use image::ColorType;

use super::{ExportOptions, RunFolder, Sample, export_of, exported, names, text};

const FISHEYE: &str = "[camera]\nsize_px = [6, 4]\nfocal_px = [5.0, 5.5]\nfps = 10.0\n[camera.lens]\nmodel = \"kannala-brandt\"\n\
                       coefficients = [0.1, -0.02, 0.003, -0.0004]\n";

/// Keys of OpenVINS' `estimator_config.yaml`.
const OPENVINS_KEYS: &str = "verbosity use_fej integration use_stereo max_cameras calib_cam_extrinsics \
    calib_cam_intrinsics calib_cam_timeoffset calib_imu_intrinsics calib_imu_g_sensitivity max_clones max_slam \
    max_slam_in_update max_msckf_in_update dt_slam_delay gravity_mag feat_rep_msckf feat_rep_slam feat_rep_aruco \
    try_zupt zupt_chi2_multipler zupt_max_velocity zupt_noise_multiplier zupt_max_disparity zupt_only_at_beginning \
    init_window_time init_imu_thresh init_max_disparity init_max_features init_dyn_use init_dyn_mle_opt_calib \
    init_dyn_mle_max_iter init_dyn_mle_max_time init_dyn_mle_max_threads init_dyn_num_pose init_dyn_min_deg \
    init_dyn_inflation_ori init_dyn_inflation_vel init_dyn_inflation_bg init_dyn_inflation_ba init_dyn_min_rec_cond \
    init_dyn_bias_g init_dyn_bias_a record_timing_information record_timing_filepath save_total_state filepath_est \
    filepath_std filepath_gt use_klt num_pts fast_threshold grid_x grid_y min_px_dist knn_ratio track_frequency \
    downsample_cameras num_opencv_threads histogram_method use_aruco num_aruco downsize_aruco up_msckf_sigma_px \
    up_msckf_chi2_multipler up_slam_sigma_px up_slam_chi2_multipler up_aruco_sigma_px up_aruco_chi2_multipler use_mask \
    relative_config_imu relative_config_imucam";

fn has_note(notes: &[String], parts: &[&str]) -> bool {
    notes.iter().any(|note| parts.iter().all(|part| note.contains(part)))
}

/// The last of the numbers of a line, and those before it.
fn numbers(line: &str) -> Vec<f64> {
    line.split([' ', ',', '[', ']']).filter_map(|cell| cell.parse().ok()).collect()
}

/// What OpenCV's parser wants of lists: items further to the right than their key.
fn check_lists(path: &Path) {
    let mut key_indent = 0;
    for (i, line) in text(path).lines().enumerate() {
        let (indent, rest) = (line.len() - line.trim_start().len(), line.trim_start());
        if rest.starts_with("- ") {
            assert!(indent > key_indent, "{}, line {}: {line}", path.display(), i + 1);
        } else if !rest.is_empty() && !rest.starts_with('#') {
            key_indent = indent;
        }
    }
}

#[test]
fn names_sort_as_their_times() {
    for (format, folder, ending) in [
        (DatasetFormat::Euroc, "mav0/cam0/data", ".png"),
        (DatasetFormat::Kalibr, "cam0", ".png"),
        (DatasetFormat::Tum, "rgb", ".png"),
    ] {
        let sample = Sample::new("");
        sample.write(&["color_png", "depth"]);
        // Frames at 0.2, 9.95 and 10.001 s.
        sample.edit("frames.csv", |text| {
            text.replace("\n4,1000000000,", "\n4,200000000,")
                .replace("\n5,1100000000,", "\n5,9950000000,")
                .replace("\n6,1200000000,", "\n6,10001000000,")
                .replace("\n9,1500000000,", "\n9,10001000001,")
        });
        exported(&sample, format).unwrap();
        let stamps: Vec<f64> = names(&sample.out().join(folder))
            .iter()
            .map(|name| name.strip_suffix(ending).unwrap().parse().unwrap())
            .collect();
        assert!(stamps.len() == 4 && stamps.is_sorted(), "{format:?}: {stamps:?}");
    }
}

#[test]
fn a_run_that_begins_before_zero_is_written_later() {
    for format in [DatasetFormat::Euroc, DatasetFormat::Kalibr, DatasetFormat::Mcap, DatasetFormat::Tum] {
        let sample = Sample::new("");
        sample.write(&["color_png", "depth"]);
        sample.write_sensors();
        // All is 4 s earlier, and begins at -3.01 s.
        sample.edit("frames.csv", |text| {
            text.replace(",1000000000,", ",-3000000000,")
                .replace(",1100000000,", ",-2900000000,")
                .replace(",1200000000,", ",-2800000000,")
                .replace(",1500000000,", ",-2500000000,")
        });
        sample.edit("trajectory.csv", |text| {
            text.replace("\n0.999000001,", "\n-3.000999999,").replace("\n1.250000000,", "\n-2.750000000,")
        });
        sample.edit("sensors/imu0.csv", |text| {
            text.replace("\n990000000,", "\n-3010000000,")
                .replace("\n1500000000,", "\n-2500000000,")
                .replace(",988000000,", ",-3012000000,")
                .replace(",1498000000,", ",-2502000000,")
        });
        sample.edit("sensors/gnss0.csv", |text| {
            text.replace("1000000001,", "-2999999999,")
                .replace("1050000000,", "-2950000000,")
                .replace("1000000005,", "-2999999995,")
        });
        let report = exported(&sample, format).unwrap();
        let key = "output.epoch_ns = 4000000000";
        assert!(
            has_note(&report.notes, &["4 s later", "begin at -3.01", key]),
            "{format:?}: {:?}",
            report.notes
        );
        assert!(text(&sample.out().join("README.md")).contains(key));
        let read = |name: &str| text(&sample.out().join(name));
        match format {
            DatasetFormat::Euroc => {
                assert!(read("mav0/cam0/data.csv").contains("\n0000000001000000000,"));
                assert!(read("mav0/imu0/data.csv").contains("\n990000000,1,2,3,4,5,6\n"));
                assert!(read("mav0/state_groundtruth_estimate0/data.csv").contains("\n1001000001,"));
                assert!(read("mav0/gnss0/data.csv").contains("\n1000000001,1,46.5,7.25,900.5,1000000005\n"));
            }
            DatasetFormat::Kalibr => {
                assert!(read("imu0.csv").contains("\n0000000000990000000,"));
                assert!(sample.out().join("cam0/0000000001000000000.png").is_file());
            }
            DatasetFormat::Tum => assert!(read("groundtruth.txt").contains("\n0000000001.000000000 ")),
            _ => {
                let bytes = fs::read(sample.out().join("camsim.mcap")).unwrap();
                let times: Vec<u64> = mcap::MessageStream::new(&bytes)
                    .unwrap()
                    .map(|message| message.unwrap().log_time)
                    .collect();
                // 2 of the IMU, 2 fixes, 2 x 2 poses, 4 x 3 of the camera, the fixed transformations: nothing is lost.
                assert_eq!((times.len(), times[0]), (21, 990_000_000));
            }
        }
    }
    let sample = Sample::new("");
    sample.write(&["color_png"]);
    assert_eq!(exported(&sample, DatasetFormat::Euroc).unwrap().notes, [""; 0]);
}

#[test]
fn estimators_get_grey_pictures_and_masks_apart() {
    for (format, first, mask) in [
        (DatasetFormat::Euroc, "mav0/cam0/data/0000000001000000000.png", "mav0/cam0/mask.png"),
        (DatasetFormat::Kalibr, "cam0/0000000001000000000.png", "mask_cam0.png"),
        (DatasetFormat::Kitti, "sequences/00/image_0/000004.png", ""),
    ] {
        let sample = Sample::new("");
        sample.write(&["color_png"]);
        exported(&sample, format).unwrap();
        let source = image::open(sample.run().join("color/frame_000004.png")).unwrap().into_rgba8();
        let grey = image::open(sample.out().join(first)).unwrap();
        assert_eq!(grey.color(), ColorType::L8, "{format:?}");
        for (grey, source) in grey.into_luma8().pixels().zip(source.pixels()) {
            let [r, g, b, _] = source.0.map(f64::from);
            assert!((f64::from(grey.0[0]) - (0.299 * r + 0.587 * g + 0.114 * b)).abs() <= 0.5 + 1e-9);
        }
        if !mask.is_empty() {
            let mask = image::open(sample.out().join(mask)).unwrap().into_luma8();
            let seen = source.pixels().map(|pixel| if pixel.0[3] > 0 { 255 } else { 0 });
            assert!(mask.into_raw().into_iter().eq(seen), "{format:?}");
            let color = Sample::new("");
            color.write(&["color_png"]);
            let options = ExportOptions { color: true, ..ExportOptions::default() };
            export_of(&RunFolder::open(&color.run()).unwrap(), &color, format, &options).unwrap();
            let picture = image::open(color.out().join(first)).unwrap();
            assert_eq!(picture.color(), ColorType::Rgb8);
            let rgb = source.pixels().flat_map(|pixel| pixel.0[..3].to_vec());
            assert!(picture.into_rgb8().into_raw().into_iter().eq(rgb));
            // Grey and colour are two exports.
            let refused = exported(&color, format).unwrap_err().to_string();
            assert!(refused.contains("colour"), "{refused}");
        }
    }
}

#[test]
fn a_stereo_rig_has_its_baseline() {
    let sample = Sample::new("");
    sample.write_rig(&["color_png", "depth", "flow"]);
    let report = exported(&sample, DatasetFormat::Kitti).unwrap();
    assert_eq!(report.notes, [""; 0]);
    let calibration = text(&sample.out().join("sequences/00/calib.txt"));
    let lines: Vec<&str> = calibration.lines().collect();
    assert_eq!(lines[0], "P0: 5 0 2.5 0 0 5.5 1.5 0 0 0 1 0");
    // Half a metre at a focal length of 5.
    assert_eq!(lines[1], "P1: 5 0 2.5 -2.5 0 5.5 1.5 0 0 0 1 0");
    assert_eq!((&lines[2][4..], &lines[3][4..]), (&lines[0][4..], &lines[1][4..]));
    let all: BTreeSet<String> = names(&sample.out()).into_iter().collect();
    for name in ["sequences/00/image_0", "sequences/00/image_1", "sequences/00/image_3", "depth/00/image_3"] {
        assert!(all.contains(&format!("{name}/000009.png")), "{name}: {all:?}");
    }
    assert!(
        all.contains("cam1/training/image_2/000004_11.png") && !all.iter().any(|name| name.contains("/01"))
    );

    // The right camera first: it is the right one all the same. One above the other; turned: no pair.
    let swapped = "[[cameras]]\nname = \"right\"\n[[cameras]]\nname = \"left\"\n";
    for (rig, mount, offsets, notes) in [
        (swapped, "[0.0,0.25,0.0]", ["P[3] -2.5", "P[3] 0"], 0),
        ("", "[0.0,0.25,0.0]", ["P[3] 0", "P[3] -2.5"], 0),
        ("", "[0.0,-0.25,0.5]", ["P[3] 0", "P[7] -2.75"], 0),
        ("", "[0.5,0.25,0.0]", ["P[3] 0", "P[3] 0"], 1),
    ] {
        let sample = Sample::new("");
        sample.write_rig(&["color_png"]);
        if !rig.is_empty() {
            sample.edit("rig.toml", |_| rig.to_owned());
        }
        sample.edit("right/run.json", |text| {
            let mut run: serde_json::Value = serde_json::from_str(&text).unwrap();
            run["scenario"]["camera"]["mount"]["offset_m"] = serde_json::from_str(mount).unwrap();
            run.to_string()
        });
        let report = exported(&sample, DatasetFormat::Mcap).unwrap();
        assert_eq!(report.notes.len(), notes, "{:?}", report.notes);
        let kitti = Sample::new("");
        kitti.write_rig(&["color_png"]);
        fs::copy(sample.run().join("rig.toml"), kitti.run().join("rig.toml")).unwrap();
        fs::copy(sample.run().join("right/run.json"), kitti.run().join("right/run.json")).unwrap();
        let is_pair = mount == "[0.0,0.25,0.0]";
        let report = exported(&kitti, DatasetFormat::Kitti).unwrap();
        assert_eq!(report.notes.is_empty(), is_pair, "{:?}", report.notes);
        assert_eq!(kitti.out().join("sequences/01/calib.txt").is_file(), !is_pair);
        if rig == swapped {
            let page = text(&kitti.out().join("README.md"));
            assert!(
                page.contains("cam1 (left) in `image_0` and `image_2`, cam0 (right) in `image_1`"),
                "{page}"
            );
        }
        let bytes = fs::read(sample.out().join("camsim.mcap")).unwrap();
        for (i, wanted) in offsets.into_iter().enumerate() {
            let topic = format!("/cam{i}/camera_info");
            let data = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
            let info = data.into_iter().find(|message| message.channel.topic == topic).unwrap().data.to_vec();
            let p = super::bags::projection(&info);
            let index = if wanted.starts_with("P[7]") { 7 } else { 3 };
            let value: f64 = wanted[5..].parse().unwrap();
            assert!((p[index] - value).abs() < 1e-9 && p[11] == 0.0, "{rig} {mount}: {p:?}");
        }
    }
}

#[test]
fn cameras_are_chosen_and_empty_ones_left_out() {
    let sample = Sample::new("");
    sample.write_rig(&["color_png"]);
    let run = RunFolder::open(&sample.run()).unwrap();
    let error = run.clone().of_cameras(&["middle".to_owned()]).unwrap_err().to_string();
    assert!(error.contains("left, right"), "{error}");
    let right = run.of_cameras(&["right".to_owned()]).unwrap();
    export_of(&right, &sample, DatasetFormat::Euroc, &ExportOptions::default()).unwrap();
    assert!(!sample.out().join("mav0/cam1").exists());
    assert!(text(&sample.out().join("README.md")).contains("cam0: camera `right`"));

    let lacking = Sample::new("");
    lacking.write_rig(&["color_png"]);
    lacking.edit("right/frames.csv", |text| text.lines().take(1).collect::<String>() + "\n");
    assert_eq!(RunFolder::open(&lacking.run()).unwrap().empty, ["right"]);
    exported(&lacking, DatasetFormat::Euroc).unwrap();
    assert!(text(&lacking.out().join("README.md")).contains("`right` has no frames"));
    lacking.edit("left/frames.csv", |text| text.lines().take(1).collect::<String>() + "\n");
    let error = RunFolder::open(&lacking.run()).unwrap_err().to_string();
    assert!(error.contains("left") && error.contains("output.format"), "{error}");
}

#[test]
fn no_noise_is_zero_for_those_who_cannot_read_it() {
    let zero = |sample: &Sample| {
        sample.edit("sensors/imu0.toml", |text| {
            text.replace("gyroscope_random_walk = 0.001", "gyroscope_random_walk = 0.0")
        });
    };
    let kalibr = Sample::new("");
    kalibr.write(&["color_png"]);
    kalibr.write_sensors();
    zero(&kalibr);
    exported(&kalibr, DatasetFormat::Kalibr).unwrap();
    let yaml = text(&kalibr.out().join("imu0.yaml"));
    assert!(
        yaml.contains("\ngyroscope_random_walk: 0.000000000001   # rad/s^2/sqrt(Hz); 0 in truth"),
        "{yaml}"
    );
    assert!(yaml.contains("\nrostopic: /imu0\nupdate_rate: 200.0\n"), "{yaml}");

    let euroc = Sample::new("");
    euroc.write(&["color_png"]);
    euroc.write_sensors();
    zero(&euroc);
    let report = exported(&euroc, DatasetFormat::Euroc).unwrap();
    assert!(has_note(&report.notes, &["imu0 has no gyroscope walk", "ADIS16448"]), "{:?}", report.notes);
    for (file, line) in [
        ("orb_slam3.yaml", "\nIMU.GyroWalk: 0.000019393\n"),
        ("vins/vins.yaml", "\ngyr_w: 0.000019393\n"),
        ("openvins/kalibr_imu_chain.yaml", "\n  gyroscope_random_walk: 0.000019393 "),
        ("vins/vins.yaml", "\ng_norm: 9.80737\n"),
        ("openvins/estimator_config.yaml", "\ngravity_mag: 9.80737\n"),
    ] {
        let yaml = text(&euroc.out().join("settings").join(file));
        assert!(yaml.contains(line), "{file}: {yaml}");
    }
}

#[test]
fn settings_have_the_keys_and_lists_of_their_parsers() {
    let sample = Sample::with(FISHEYE, "");
    sample.write_rig(&["color_png"]);
    sample.write_sensors();
    let report = exported(&sample, DatasetFormat::Euroc).unwrap();
    assert_eq!(report.notes, [""; 0]);
    let settings = sample.out().join("settings");
    for name in names(&settings).iter().filter(|name| name.ends_with(".yaml")) {
        assert!(text(&settings.join(name)).starts_with("%YAML:1.0\n"), "{name}");
        check_lists(&settings.join(name));
    }
    let estimator = text(&settings.join("openvins/estimator_config.yaml"));
    let keys: Vec<&str> = estimator
        .lines()
        .filter(|line| !line.starts_with(['#', '%']))
        .filter_map(|line| line.split_once(':'))
        .map(|(key, _)| key)
        .filter(|key| !key.starts_with("mask"))
        .collect();
    let (found, wanted): (BTreeSet<&str>, BTreeSet<&str>) =
        (keys.iter().copied().collect(), OPENVINS_KEYS.split(' ').collect());
    assert_eq!(found, wanted);
    assert_eq!(keys.len(), wanted.len(), "no key twice");
    assert!(
        estimator.contains("use_mask: true\nmask0: \"mask0.png\"\nmask1: \"mask1.png\"\n"),
        "{estimator}"
    );
    // Its masks are white where nothing is to be looked for.
    let [own, theirs] = ["mav0/cam1/mask.png", "settings/openvins/mask1.png"]
        .map(|name| image::open(sample.out().join(name)).unwrap().into_luma8().into_raw());
    assert!(own.contains(&0) && own.iter().zip(&theirs).all(|(a, b)| *a == 255 - *b));

    let orb = text(&settings.join("orb_slam3.yaml"));
    for number in [1, 2] {
        let columns = format!("\nCamera{number}.overlappingBegin: 0\nCamera{number}.overlappingEnd: 5\n");
        assert!(orb.contains(&columns), "{orb}");
    }
    for pose in ["Stereo.T_c1_c2", "IMU.T_b_c1"] {
        let head = format!("{pose}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n");
        assert!(orb.contains(&head), "its reader takes elements for floats: {orb}");
    }
}

#[test]
fn a_lens_that_few_readers_know_is_noted() {
    let lens = |coefficients: &str| {
        format!(
            "[camera]\nsize_px = [6, 4]\nfocal_px = [5.0, 5.5]\nfps = 10.0\n[camera.lens]\nmodel = \"brown-conrady\"\n\
             coefficients = {coefficients}\n"
        )
    };
    for (coefficients, model, is_noted) in [
        ("[-0.1, 0.02, 0.001, -0.002]", "radial-tangential", false),
        ("[-0.1, 0.02, 0.001, -0.002, 0.003]", "radialtangential8", true),
    ] {
        let sample = Sample::with(&lens(coefficients), "");
        sample.write(&["color_png"]);
        let report = exported(&sample, DatasetFormat::Euroc).unwrap();
        assert!(
            text(&sample.out().join("mav0/cam0/sensor.yaml"))
                .contains(&format!("distortion_model: {model}\n"))
        );
        assert_eq!(
            has_note(&report.notes, &["sensor.yaml of cam0", model, "k3"]),
            is_noted,
            "{:?}",
            report.notes
        );
    }
    // A model that Kalibr has and OpenVINS has not.
    let sample = Sample::with(&lens("[0.1, 0.5]").replace("brown-conrady", "eucm"), "");
    sample.write(&["color_png"]);
    sample.write_sensors();
    exported(&sample, DatasetFormat::Kalibr).unwrap();
    let run = RunFolder::open(&sample.run()).unwrap();
    let refused = crate::formats::writing::export(
        &[run.cameras[0].spec.clone()],
        crate::formats::writing::CalibrationFormat::OpenVins,
    );
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("OpenVINS has no lens of the model eucm"), "{message}");
}

#[test]
fn sensors_are_numbered_in_the_order_of_the_scenario() {
    let imus = "[[imu]]\nname = \"zeta\"\nrate_hz = 200\n[[imu]]\nname = \"alpha\"\nrate_hz = 100\n";
    let sample = Sample::with(imus, "");
    sample.write(&["color_png"]);
    sample.write_sensors();
    let sensors = sample.run().join("sensors");
    for (name, rate) in [("zeta", "200.0"), ("alpha", "100.0")] {
        let toml =
            text(&sensors.join("imu0.toml")).replace("\"imu0", &format!("\"{name}")).replace("200.0", rate);
        fs::write(sensors.join(format!("{name}.toml")), toml).unwrap();
        fs::copy(sensors.join("imu0.csv"), sensors.join(format!("{name}.csv"))).unwrap();
    }
    for name in ["imu0.toml", "imu0.csv"] {
        fs::remove_file(sensors.join(name)).unwrap();
    }
    exported(&sample, DatasetFormat::Euroc).unwrap();
    let rate = |i: u32| text(&sample.out().join(format!("mav0/imu{i}/sensor.yaml")));
    assert!(rate(0).contains("rate_hz: 200.0\n") && rate(1).contains("rate_hz: 100.0\n"));
}

#[test]
fn receivers_are_tables_without_the_truth() {
    let sample = Sample::new("");
    sample.write(&["color_png"]);
    sample.write_sensors();
    exported(&sample, DatasetFormat::Euroc).unwrap();
    assert_eq!(
        text(&sample.out().join("mav0/gnss0/data.csv")),
        "#timestamp [ns],fix,lat_deg,lon_deg,height_m,t_available_ns\n1000000001,1,46.5,7.25,900.5,1000000005\n\
         1050000000,0,,,,1050000009\n"
    );
    let yaml = text(&sample.out().join("mav0/gnss0/sensor.yaml"));
    assert!(yaml.contains("sensor_type: gnss\n"), "{yaml}");
    // Without an IMU the truth is by the first camera's clock.
    let camera = "[camera]\nsize_px = [6, 4]\nfocal_px = [5.0, 5.5]\nfps = 10.0\nclock_offset_ms = 7.0\n";
    let alone = Sample::with(camera, "");
    alone.write(&["color_png"]);
    exported(&alone, DatasetFormat::Euroc).unwrap();
    let truth = text(&alone.out().join("mav0/state_groundtruth_estimate0/data.csv"));
    assert!(truth.contains("\n1006000001,"), "{truth}");
    assert!(
        text(&alone.out().join("README.md")).contains("clock of cam0, which estimates are on: 7 ms ahead")
    );
}

#[test]
fn tables_have_no_more_than_17_digits() {
    let sample = Sample::new("");
    sample.write(&["color_png", "depth"]);
    sample.write_sensors();
    sample.edit("sensors/imu0.csv", |text| {
        text.replace("\n990000000,1,2,3,", "\n990000000,-0.00000000000000000000000012985,0.1,3,")
    });
    exported(&sample, DatasetFormat::Euroc).unwrap();
    assert!(text(&sample.out().join("mav0/imu0/data.csv")).contains("\n990000000,-1.2985e-25,0.1,3,"));
    for format in [DatasetFormat::Tum, DatasetFormat::Kitti, DatasetFormat::Colmap, DatasetFormat::Nerfstudio]
    {
        let sample = Sample::new("");
        sample.write(&["color_png", "depth"]);
        exported(&sample, format).unwrap();
        let tables = names(&sample.out());
        let tables = tables.iter().filter(|name| name.ends_with(".txt") || name.ends_with(".json"));
        for name in tables.filter(|name| *name != "export.json") {
            for cell in text(&sample.out().join(name)).split([' ', ',', '\n', '[', ']', '}']) {
                let is_long = cell.parse::<f64>().is_ok() && cell.len() > 24;
                assert!(!is_long, "{format:?}, {name}: {cell}");
            }
        }
    }
}

#[test]
fn the_matrix_of_a_pose_has_its_numbers() {
    let sample = Sample::new("");
    sample.write(&["color_png"]);
    sample.write_sensors();
    exported(&sample, DatasetFormat::Euroc).unwrap();
    let chain = text(&sample.out().join("settings/openvins/kalibr_imucam_chain.yaml"));
    let rows: Vec<&str> =
        chain.lines().skip_while(|line| !line.contains("T_imu_cam")).skip(1).take(4).collect();
    assert!(rows.iter().all(|row| row.starts_with("    - [") && numbers(row).len() == 4), "{chain}");
}
