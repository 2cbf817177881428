//! EuRoC, TUM, Kalibr, KITTI.

use camsim_core::scenario::{DatasetFormat, LensModel};

use super::{Sample, exported, names, sample, text};
use crate::formats::reading::{ImportOptions, import_camera_as, import_camera_with};

const LENS: &str = "[camera]\nsize_px = [6, 4]\nfocal_px = [5.0, 5.5]\nprincipal_point_px = [2.25, 1.75]\nfps = 10.0\n\
                    [camera.mount]\nangles_deg = [0.0, -90.0, 0.0]\noffset_m = [0.5, 0.0, 0.25]\n\
                    [camera.lens]\nmodel = \"brown-conrady\"\ncoefficients = [-0.25, 0.06, 0.001, -0.002]\n";

fn lines(path: &std::path::Path) -> Vec<String> {
    text(path).lines().map(str::to_owned).collect()
}

#[test]
fn euroc_has_the_stamps_axes_and_order_of_its_readers() {
    let sample = Sample::with(LENS, "");
    sample.write(&["color_png"]);
    exported(&sample, DatasetFormat::Euroc).unwrap();
    let file = |name: &str| sample.out().join(name);
    assert_eq!(
        lines(&file("mav0/cam0/data.csv")),
        [
            "#timestamp [ns],filename",
            "0000000001000000000,0000000001000000000.png",
            "0000000001100000000,0000000001100000000.png",
            "0000000001200000000,0000000001200000000.png",
            "0000000001500000000,0000000001500000000.png"
        ]
    );
    assert_eq!(lines(&file("settings/times_cam0.txt"))[3], "0000000001500000000");
    assert_eq!(lines(&file("mav0/cam0/exposure.csv"))[1], "0000000001000000000,0");
    let truth = lines(&file("mav0/state_groundtruth_estimate0/data.csv"));
    // East, north, up; forward north, left west, up: a quarter turn about up; velocity east, north, up.
    let cells: Vec<f64> = truth[1].split(',').map(|cell| cell.parse().unwrap()).collect();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let wanted =
        [999_000_001.0, 2.0, 1.0, 3.0, half, 0.0, 0.0, half, 5.0, 4.0, -6.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(cells.len(), wanted.len());
    assert!(cells.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{truth:?}");
    // Straight down: optical z is down, which is -z of a body with z up; its x is to the right, -y.
    let yaml = text(&file("mav0/cam0/sensor.yaml"));
    let data = yaml.lines().find(|line| line.trim_start().starts_with("data:")).unwrap();
    let matrix: Vec<f64> =
        data.split(['[', ']']).nth(1).unwrap().split(',').map(|v| v.trim().parse().unwrap()).collect();
    let wanted = [0.0, -1.0, 0.0, 0.5, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, -0.25, 0.0, 0.0, 0.0, 1.0];
    assert!(matrix.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{matrix:?}");
}

#[test]
fn calibrations_read_back_as_the_camera() {
    let sample = Sample::with(LENS, "");
    sample.write(&["color_png"]);
    exported(&sample, DatasetFormat::Euroc).unwrap();
    let kalibr = Sample::with(&format!("{LENS}[camera.shutter]\nreadout_ms = 8.0\n"), "");
    kalibr.write(&["color_png"]);
    exported(&kalibr, DatasetFormat::Kalibr).unwrap();
    for path in [
        sample.out().join("mav0/cam0/sensor.yaml"),
        sample.out().join("settings/orb_slam3.yaml"),
        kalibr.out().join("camchain.yaml"),
    ] {
        let camera = import_camera_as(&path, None).unwrap().spec;
        assert_eq!((camera.size_px, camera.focal_px), ([6, 4], [5.0, 5.5]), "{}", path.display());
        assert_eq!(camera.principal_point_px, Some([2.25, 1.75]), "{}", path.display());
        assert_eq!(camera.lens.model, LensModel::BrownConrady);
        assert_eq!(camera.lens.coefficients[..4], [-0.25, 0.06, 0.001, -0.002], "{}", path.display());
    }
    let tum = Sample::with(LENS, "");
    tum.write(&["color_png", "depth", "rows"]);
    exported(&tum, DatasetFormat::Tum).unwrap();
    let options = ImportOptions { size_px: Some([6, 4]), ..ImportOptions::default() };
    let camera = import_camera_with(&tum.out().join("calibration.txt"), &options).unwrap().spec;
    assert_eq!((camera.focal_px, camera.principal_point_px), ([5.0, 5.5], Some([2.25, 1.75])));
    assert_eq!(camera.lens.coefficients, [-0.25, 0.06, 0.001, -0.002]);
    let chain = text(&kalibr.out().join("camchain.yaml"));
    assert!(chain.contains("  line_delay: 0.002\n") && chain.contains("distortion_model: radtan"), "{chain}");
    assert!(names(&kalibr.out()).contains(&"cam0/0000000001100000000.png".to_owned()));
}

#[test]
fn tum_has_the_middle_row_and_a_scale_that_fits() {
    // A delay of 5 ms and a readout about it; rows have the poses.
    let sample = Sample::with("[camera.shutter]\ndelay_ms = 5.0\nreadout_ms = 4.0\n", "");
    sample.write(&["color_png", "depth", "rows"]);
    let report = exported(&sample, DatasetFormat::Tum).unwrap();
    let file = |name: &str| sample.out().join(name);
    assert_eq!(lines(&file("rgb.txt"))[3], "0000000000.995000000 rgb/0000000000.995000000.png");
    assert_eq!(
        lines(&file("associations.txt"))[1],
        "0000000001.095000000 rgb/0000000001.095000000.png 0000000001.095000000 depth/0000000001.095000000.png"
    );
    let truth = lines(&file("groundtruth.txt"));
    let numbers: Vec<f64> = truth[3].split(' ').map(|cell| cell.parse().unwrap()).collect();
    let pose = sample::pose(-0.05);
    let wanted = super::enu_from_camera(&pose);
    assert_eq!(numbers.len(), 8, "single spaces: {}", truth[3]);
    assert!((numbers[0] - 0.995).abs() < 1e-12);
    let position = glam::DVec3::new(numbers[1], numbers[2], numbers[3]);
    assert!((position - wanted.translation_m).length() < 1e-9, "{numbers:?}");
    // Scalar last.
    let q = glam::DQuat::from_xyzw(numbers[4], numbers[5], numbers[6], numbers[7]);
    assert!(q.w >= 0.0 && q.dot(wanted.rotation).abs() > 1.0 - 1e-12, "{numbers:?}");
    // 14.75 m are the most: 5000 steps do not hold them.
    assert!(report.notes.iter().any(|note| note.contains("1000 steps per metre")), "{:?}", report.notes);
    let picture = image::open(file("depth/0000000000.995000000.png")).unwrap().into_luma16();
    let wanted = (0..24).map(|pixel| (f64::from(sample::depth_m(4, pixel)) * 1000.0).round() as u16);
    assert!(picture.into_raw().into_iter().eq(wanted));

    let lacking = Sample::with("[camera.shutter]\ndelay_ms = 5.0\n", "");
    lacking.write(&["color_png", "depth"]);
    let text = exported(&lacking, DatasetFormat::Tum).unwrap_err().to_string();
    assert!(text.contains("\"rows\" to output.channels"), "{text}");
}

#[test]
fn kitti_counts_from_the_first_pose_and_says_what_is_known() {
    let sample = Sample::new("");
    sample.write(&["color_png", "depth", "flow"]);
    exported(&sample, DatasetFormat::Kitti).unwrap();
    let file = |name: &str| sample.out().join(name);
    let poses = lines(&file("poses/00.txt"));
    let numbers = |line: &str| -> Vec<f64> { line.split(' ').map(|cell| cell.parse().unwrap()).collect() };
    let first = numbers(&poses[0]);
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    assert!(first.iter().zip(identity).all(|(a, b)| (a - b).abs() < 1e-15), "{first:?}");
    // A metre to the north, along the first optical axis, and 0.1 to the right about down.
    let second = numbers(&poses[1]);
    assert!((second[11] - 1.0).abs() < 1e-12 && second[3].abs() < 1e-12 && second[7].abs() < 1e-12);
    assert!(
        (second[2] - 0.1_f64.sin()).abs() < 1e-12 && (second[0] - 0.1_f64.cos()).abs() < 1e-12,
        "{second:?}"
    );
    assert_eq!(
        lines(&file("sequences/00/times.txt")),
        ["0.000000000", "0.100000000", "0.200000000", "0.500000000"]
    );
    assert_eq!(lines(&file("sequences/00/calib.txt"))[2], "P2: 5 0 2.5 0 0 5.5 1.5 0 0 0 1 0");
    let depth = image::open(file("depth/00/image_2/000005.png")).unwrap().into_luma16();
    assert_eq!(depth.get_pixel(3, 1)[0], ((5.0 + 9.0 * 0.25) * 256.0) as u16);
    // Frame 6 has no next one, frame 9 neither.
    let all = names(&sample.out());
    let flows: Vec<&String> = all.iter().filter(|name| name.starts_with("training/flow_occ/")).collect();
    assert_eq!(flows, ["training/flow_occ/000004_10.png", "training/flow_occ/000005_10.png"]);
    for (kind, states) in [("flow_occ", &[1, 2, 3, 4][..]), ("flow_noc", &[1, 4])] {
        let picture = image::open(file(&format!("training/{kind}/000004_10.png"))).unwrap().into_rgb16();
        for (pixel, read) in picture.pixels().enumerate() {
            let [dx, dy, state] = sample::flow(pixel);
            // 600 px do not fit.
            let known = states.contains(&(state as i32)) && pixel != 6;
            let code = |d: f32| (64.0 * d + 32768.0) as u16;
            let wanted = if known { [code(dx), code(dy), 1] } else { [0; 3] };
            assert_eq!(read.0, wanted, "{kind} {pixel}");
        }
    }
    let picture = |name: &str| std::fs::read(file(name)).unwrap();
    assert_eq!(picture("training/image_2/000004_11.png"), picture("sequences/00/image_2/000005.png"));
}

#[test]
fn cameras_of_a_rig_lie_side_by_side() {
    let sample = Sample::new("");
    sample.write_rig(&["color_png"]);
    exported(&sample, DatasetFormat::Euroc).unwrap();
    let all = names(&sample.out());
    assert!(all.contains(&"mav0/cam1/data/0000000001500000000.png".to_owned()), "{all:?}");
    let stereo = text(&sample.out().join("settings/orb_slam3.yaml"));
    // The right camera is half a metre along the left one's x.
    let data = stereo.lines().skip_while(|line| !line.starts_with("Stereo.T_c1_c2")).nth(4).unwrap();
    let numbers: Vec<f64> =
        data.split(['[', ']']).nth(1).unwrap().split(',').map(|v| v.trim().parse().unwrap()).collect();
    assert!((numbers[3] - 0.5).abs() < 1e-12 && (numbers[0] - 1.0).abs() < 1e-12, "{data}");

    let kalibr = Sample::new("");
    kalibr.write_rig(&["color_png"]);
    exported(&kalibr, DatasetFormat::Kalibr).unwrap();
    let chain = text(&kalibr.out().join("camchain.yaml"));
    let rows: Vec<&str> =
        chain.lines().skip_while(|line| !line.contains("T_cn_cnm1")).skip(1).take(1).collect();
    assert!(rows[0].trim_end().ends_with(", -0.5]"), "{chain}");

    let colmap = Sample::new("");
    colmap.write_rig(&["color_png"]);
    exported(&colmap, DatasetFormat::Colmap).unwrap();
    let images = text(&colmap.out().join("sparse_text/0/images.txt"));
    assert!(images.contains(" 2 cam1/frame_000009.png\n") && images.contains("\n8 "), "{images}");
    assert!(colmap.out().join("images/cam0/frame_000004.png").is_file());
}
