//! MCAP, with sensors beside the camera.

use std::{collections::BTreeMap, fs};

use camsim_core::scenario::DatasetFormat;
use serde::Deserialize;

use super::{Sample, exported, sample, text};

/// The head of every message that has one.
#[derive(Deserialize)]
struct Stamp {
    sec: i32,
    nanosec: u32,
    frame: String,
}

#[derive(Deserialize)]
struct Info {
    head: Stamp,
    height: u32,
    width: u32,
    model: String,
    d: Vec<f64>,
    k: [f64; 9],
    _r: [f64; 9],
    p: [f64; 12],
}

/// P of a `CameraInfo`.
pub(super) fn projection(data: &[u8]) -> [f64; 12] {
    decoded::<Info>(data).p
}

#[derive(Deserialize)]
struct Transforms(Vec<(Stamp, String, [f64; 3], [f64; 4])>);

#[derive(Deserialize)]
struct Inertial {
    head: Stamp,
    _orientation: [f64; 4],
    orientation_covariance: [f64; 9],
    gyro: [f64; 3],
    gyro_covariance: [f64; 9],
    acc: [f64; 3],
}

#[derive(Deserialize)]
struct Fix {
    head: Stamp,
    status: i8,
    _service: u16,
    latitude: f64,
    longitude: f64,
    altitude: f64,
}

fn decoded<T: for<'de> Deserialize<'de>>(data: &[u8]) -> T {
    assert_eq!(data[..4], [0, 1, 0, 0], "little-endian CDR");
    cdr_encoding::from_bytes::<T, byteorder::LittleEndian>(&data[4..]).unwrap().0
}

type Messages = BTreeMap<String, Vec<(u64, Vec<u8>)>>;

fn messages(sample: &Sample) -> (Messages, Vec<u64>) {
    let bytes = fs::read(sample.out().join("camsim.mcap")).unwrap();
    let (mut by_topic, mut times) = (Messages::new(), Vec::new());
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("ros2msg", "cdr"));
        assert!(message.channel.metadata.contains_key("offered_qos_profiles"));
        times.push(message.log_time);
        by_topic
            .entry(message.channel.topic.clone())
            .or_default()
            .push((message.log_time, message.data.to_vec()));
    }
    (by_topic, times)
}

#[test]
fn messages_are_those_of_ros_by_ascending_time() {
    let lens = "[camera]\nsize_px = [6, 4]\nfocal_px = [5.0, 5.5]\n[camera.lens]\nmodel = \"brown-conrady\"\n\
                coefficients = [-0.25, 0.06, 0.001, -0.002, 0.01]\n";
    let sample = Sample::with(lens, "");
    sample.write(&["color_png", "depth"]);
    sample.write_sensors();
    exported(&sample, DatasetFormat::Mcap).unwrap();
    let (messages, times) = messages(&sample);
    assert!(times.is_sorted(), "{times:?}");
    let counts: Vec<(&str, usize)> = messages.iter().map(|(topic, of)| (topic.as_str(), of.len())).collect();
    assert_eq!(
        counts,
        [
            ("/cam0/camera_info", 4),
            ("/cam0/depth/image_raw", 4),
            ("/cam0/image_raw/compressed", 4),
            ("/gnss0/fix", 2),
            ("/ground_truth/pose", 2),
            ("/imu0", 2),
            ("/tf", 2),
            ("/tf_static", 1)
        ]
    );
    let info: Info = decoded(&messages["/cam0/camera_info"][1].1);
    assert_eq!((info.head.sec, info.head.nanosec, info.head.frame.as_str()), (1, 100_000_000, "cam0"));
    assert_eq!((info.width, info.height, info.model.as_str()), (6, 4, "plumb_bob"));
    assert_eq!((info.k[2], info.k[4], info.p[6]), (2.5, 5.5, 1.5));
    assert_eq!(info.d, [-0.25, 0.06, 0.001, -0.002, 0.01]);
    // Header of 4 + 4 + (4 + 5), format (4 + 4), length: each aligned to 4.
    let picture = &messages["/cam0/image_raw/compressed"][0].1;
    let begin = picture.windows(4).position(|bytes| bytes == b"\x89PNG").unwrap();
    let sent = image::load_from_memory(&picture[begin..]).unwrap();
    let png = image::open(sample.run().join("color/frame_000004.png")).unwrap();
    assert_eq!(sent.color(), image::ColorType::Rgb8, "image_transport knows no alpha");
    assert_eq!(sent.into_rgb8(), png.into_rgb8());
    let z = &messages["/cam0/depth/image_raw"][0].1;
    let last = f32::from_le_bytes(z[z.len() - 4..].try_into().unwrap());
    assert_eq!(last, sample::depth_m(4, 23));
    let imu: Inertial = decoded(&messages["/imu0"][0].1);
    assert_eq!((imu.head.nanosec, imu.gyro, imu.acc), (990_000_000, [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]));
    assert_eq!(imu.orientation_covariance[0], -1.0);
    // White noise of a density at 200 Hz.
    assert!((imu.gyro_covariance[8] - 1e-4 * 200.0).abs() < 1e-15);
    let fixes: Vec<Fix> = messages["/gnss0/fix"].iter().map(|(_, data)| decoded(data)).collect();
    assert_eq!((fixes[0].latitude, fixes[0].longitude, fixes[0].altitude), (46.5, 7.25, 900.5));
    assert_eq!((fixes[0].status, fixes[1].status, fixes[1].head.frame.as_str()), (0, -1, "gnss0"));
    assert!(fixes[1].latitude.is_nan());
    // Of the body at north 1, east 2, down -3 with its nose to the north.
    let Transforms(moved) = decoded(&messages["/tf"][0].1);
    let (head, child, position, q) = &moved[0];
    assert_eq!((head.frame.as_str(), child.as_str(), *position), ("map", "base_link", [2.0, 1.0, 3.0]));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!(q.iter().zip([0.0, 0.0, half, half]).all(|(a, b)| (a - b).abs() < 1e-12), "{q:?}");
    let Transforms(fixed) = decoded(&messages["/tf_static"][0].1);
    let of: BTreeMap<&str, &[f64; 3]> =
        fixed.iter().map(|(_, child, offset, _)| (child.as_str(), offset)).collect();
    assert_eq!(of["imu0"], &[0.5, 0.0, -0.25]);
    assert_eq!(of["cam0"], &[0.0, 0.0, 0.0]);
}

#[test]
fn euroc_has_the_imu_as_its_body() {
    let sample = Sample::with("[camera.shutter]\ndelay_ms = 5.0\n", "");
    sample.write(&["color_png"]);
    sample.write_sensors();
    let report = exported(&sample, DatasetFormat::Euroc).unwrap();
    assert_eq!(report.notes, [""; 0]);
    let file = |name: &str| text(&sample.out().join(name));
    assert_eq!(file("mav0/imu0/data.csv").lines().nth(1), Some("990000000,1,2,3,4,5,6"));
    let truth = file("mav0/state_groundtruth_estimate0/data.csv");
    let cells: Vec<f64> =
        truth.lines().nth(1).unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    // Half a metre before the body and a quarter below; it turns by 1 rad/s to the right about it.
    let wanted = [2.0, 1.5, 2.75];
    assert!(cells[1..4].iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{cells:?}");
    let wanted = [5.5, 4.0, -6.0];
    assert!(cells[8..11].iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{cells:?}");
    // Its clock is 2 ms ahead, and the ground truth is by it; biases are those of the true time, 11.000001 of 510 ms
    // after the first row.
    assert_eq!(cells[0], 1_001_000_001.0);
    let fraction = 11.000_001 / 510.0;
    assert!(
        (cells[11] - (0.1 + 0.1 * fraction)).abs() < 1e-12
            && (cells[16] - (0.6 + 0.1 * fraction)).abs() < 1e-12
    );
    // The IMU's clock is 2 ms ahead, the picture 5 ms old.
    let chain = file("settings/openvins/kalibr_imucam_chain.yaml");
    assert!(chain.contains("timeshift_cam_imu: -0.003\n") && chain.contains("  T_imu_cam:\n"), "{chain}");
    assert!(file("settings/vins/vins.yaml").contains("\ntd: -0.003\n"));
    assert!(file("settings/orb_slam3.yaml").contains("IMU.NoiseGyro: 0.01\n"));
}

#[test]
fn an_imu_that_shakes_with_the_camera_is_a_body_of_its_own() {
    let vibration = "[[camera.mount.vibration]]\naxis = \"pitch\"\namplitude_deg = 0.5\namplitude_m = 0.0\nhz = 50.0\nphase_deg = 0.0\n";
    let sample = Sample::with(vibration, "");
    sample.write(&["color_png"]);
    sample.write_sensors();
    let sensors = sample.run().join("sensors");
    let toml = text(&sensors.join("imu0.toml")) + "attached_to = \"camera\"\n";
    fs::write(sensors.join("imu0.toml"), toml).unwrap();
    let truth = ",true_n_m,true_e_m,true_d_m,true_vn_m_s,true_ve_m_s,true_vd_m_s,true_qw,true_qx,true_qy,true_qz,\
                 true_gyro_x_rad_s,true_gyro_y_rad_s,true_gyro_z_rad_s\n";
    let pose = ",7.5,8.5,-9.5,0.5,0.25,-0.125,0,1,0,0,0,0,0\n";
    let csv = text(&sensors.join("imu0.csv"));
    let line = |(i, line): (usize, &str)| line.to_owned() + if i == 0 { truth } else { pose };
    fs::write(sensors.join("imu0.csv"), csv.lines().enumerate().map(line).collect::<String>()).unwrap();
    exported(&sample, DatasetFormat::Euroc).unwrap();
    let truth = text(&sample.out().join("mav0/state_groundtruth_estimate0/data.csv"));
    // Forward, left, up and upright: x is north, y west, z up.
    let cells: Vec<f64> =
        truth.lines().nth(1).unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    assert_eq!(cells[..4], [990_000_000.0, 8.5, 7.5, 9.5]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!(cells[4..8].iter().zip([half, 0.0, 0.0, half]).all(|(a, b)| (a - b).abs() < 1e-12), "{cells:?}");
    assert_eq!(cells[8..11], [0.25, 0.5, 0.125]);

    let bag = Sample::with(vibration, "");
    bag.write(&["color_png"]);
    for name in ["imu0.toml", "imu0.csv"] {
        fs::create_dir_all(bag.run().join("sensors")).unwrap();
        fs::copy(sensors.join(name), bag.run().join("sensors").join(name)).unwrap();
    }
    exported(&bag, DatasetFormat::Mcap).unwrap();
    let (by_topic, _) = messages(&bag);
    let Transforms(fixed) = decoded(&by_topic["/tf_static"][0].1);
    assert!(fixed.is_empty() && by_topic.contains_key("/imu0"), "{:?}", by_topic.keys());
}
