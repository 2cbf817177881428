//! Settings files for programs that read EuRoC folders: ORB-SLAM3, OpenVINS, VINS-Fusion.

use std::fmt::Write as _;

use crate::formats::axes::Rigid;
use crate::formats::camodocal::write as camodocal;
use crate::formats::exporting::imu::ImuSensor;
use crate::formats::exporting::run_folder::RunCamera;
use crate::formats::exporting::{DatasetError, ExportJob};
use crate::formats::kalibr::write::{PoseKey, chain_yaml};
use crate::formats::openvins;
use crate::formats::orb_slam::write as orb_slam;
use crate::formats::writing::{Calibration, CalibrationError};
use crate::text::numbers::{Element, opencv_matrix, real};

/// Writes `settings/`; returns notes on those that a lens or a missing sensor leaves out.
pub(crate) fn write(
    job: &ExportJob<'_>,
    imus: &[ImuSensor],
    body_from_b: &Rigid,
) -> Result<Vec<String>, DatasetError> {
    let mut notes = Vec::new();
    let imu = imus.first();
    notes.extend(imu.and_then(|imu| imu.begins_late(job.run)));
    let cameras = job.run.cameras.iter().map(RunCamera::calibration).collect::<Result<Vec<_>, _>>()?;
    notes.extend(one_lens(&cameras));
    match orb_slam(&cameras, imu) {
        Ok(text) => job.target.text("settings/orb_slam3.yaml", &text)?,
        Err(error) => notes.push(format!("settings for ORB-SLAM3 are skipped: {error}")),
    }
    let Some(imu) = imu else { return Ok(notes) };
    let (_, lifted) = imu.noise_for_filters();
    if !lifted.is_empty() {
        notes.push(format!(
            "imu0 has no {}, with which estimators do not work: settings have the values of the EuRoC data's ADIS16448 in \
             their place",
            lifted.join(", no ")
        ));
    }
    match chain_yaml(&cameras, Some(&imu.reference()), PoseKey::ImuCam) {
        Ok(chain) => openvins::write(job, imu, &chain)?,
        Err(error) => notes.push(format!("settings for OpenVINS are skipped: {error}")),
    }
    let same = cameras.iter().take(2).filter(|camera| camera.spec.size_px == cameras[0].spec.size_px).count();
    if same < cameras.len() {
        notes.push(format!(
            "VINS-Fusion has at most two cameras, of one size: its settings have the first {same}"
        ));
    }
    match write_vins(job, &cameras[..same], imu, body_from_b) {
        Ok(()) => {}
        Err(DatasetError::Calibration(error)) => {
            notes.push(format!("settings for VINS-Fusion are skipped: {error}"));
        }
        Err(error) => return Err(error),
    }
    Ok(notes)
}

/// A note if ORB-SLAM3 misreads the second lens.
fn one_lens(cameras: &[Calibration]) -> Option<String> {
    let [first, second, ..] = cameras else { return None };
    let [first, second] = [first, second].map(|camera| camera.intrinsics.equidistant());
    (first.is_some() && second.is_some() && first != second).then(|| {
        "ORB-SLAM3 1.0 takes the coefficients of both fisheye lenses from Camera1, and those of cam1 are others".to_owned()
    })
}

/// Settings of ORB-SLAM3 of version 1.0.
fn orb_slam(cameras: &[Calibration], imu: Option<&ImuSensor>) -> Result<String, CalibrationError> {
    let reference = imu.map(ImuSensor::reference);
    let mut text = orb_slam::cameras(&cameras[..cameras.len().min(2)], reference.as_ref())?;
    if let Some(imu) = imu {
        let (noise, _) = imu.noise_for_filters();
        let _ = write!(
            text,
            "IMU.NoiseGyro: {}\nIMU.NoiseAcc: {}\nIMU.GyroWalk: {}\nIMU.AccWalk: {}\nIMU.Frequency: {}\n",
            real(noise.gyroscope_noise_density),
            real(noise.accelerometer_noise_density),
            real(noise.gyroscope_random_walk),
            real(noise.accelerometer_random_walk),
            real(imu.rate_hz)
        );
    }
    text += "\nORBextractor.nFeatures: 1200\nORBextractor.scaleFactor: 1.2\nORBextractor.nLevels: 8\n\
             ORBextractor.iniThFAST: 20\nORBextractor.minThFAST: 7\n\nViewer.KeyFrameSize: 0.05\n\
             Viewer.KeyFrameLineWidth: 1.0\nViewer.GraphLineWidth: 0.9\nViewer.PointSize: 2.0\n\
             Viewer.CameraSize: 0.08\nViewer.CameraLineWidth: 3.0\nViewer.ViewpointX: 0.0\nViewer.ViewpointY: -0.7\n\
             Viewer.ViewpointZ: -3.5\nViewer.ViewpointF: 500.0\nViewer.imageViewScale: 1.0\n";
    Ok(text)
}

fn write_vins(
    job: &ExportJob<'_>,
    cameras: &[Calibration],
    imu: &ImuSensor,
    body_from_b: &Rigid,
) -> Result<(), DatasetError> {
    let name = |file: &str| format!("settings/vins/{file}");
    let first = &job.run.cameras[0];
    let [width, height] = first.spec.size_px;
    let mut text = format!(
        "%YAML:1.0\n\nimu: 1\nnum_of_cam: {}\nimu_topic: \"/imu0\"\noutput_path: \"~/output/\"\nimage_width: {width}\n\
         image_height: {height}\nestimate_extrinsic: 0\n",
        cameras.len()
    );
    for (i, camera) in cameras.iter().enumerate() {
        let b_from_camera = body_from_b.inverse().of(&camera.body_from_camera());
        let _ = writeln!(text, "image{i}_topic: \"/cam{i}/image_raw\"\ncam{i}_calib: \"cam{i}.yaml\"");
        let pose = b_from_camera.matrix();
        text += &opencv_matrix(&format!("body_T_cam{i}"), [4, 4], Element::Double, pose.as_flattened());
        job.target.text(&name(&format!("cam{i}.yaml")), &camodocal::file(&format!("cam{i}"), camera)?)?;
    }
    let (shutter, (noise, _)) = (&first.shutter, imu.noise_for_filters());
    let _ = write!(
        text,
        "multiple_thread: 1\nmax_cnt: 150\nmin_dist: 30\nfreq: 10\nF_threshold: 1.0\nshow_track: 0\nflow_back: 1\n\
         max_solver_time: 0.04\nmax_num_iterations: 8\nkeyframe_parallax: 10.0\nsave_image: 0\n\
         load_previous_pose_graph: 0\npose_graph_save_path: \"~/output/pose_graph/\"\n# discrete noise is theirs to \
         make of these continuous-time densities\nacc_n: {}\ngyr_n: {}\nacc_w: {}\ngyr_w: {}\ng_norm: {}\n\
         # stamp + td is the time of the image's centre on the IMU's clock\nestimate_td: 0\ntd: {}\n\
         # VINS-Mono only; seconds from the first row to the last\nrolling_shutter: {}\nrolling_shutter_tr: {}\n",
        real(noise.accelerometer_noise_density),
        real(noise.gyroscope_noise_density),
        real(noise.accelerometer_random_walk),
        real(noise.gyroscope_random_walk),
        real(imu.gravity_m_s2),
        real(imu.shift_s(first)),
        u8::from(!first.is_global()),
        real(shutter.readout_s())
    );
    job.target.text(&name("vins.yaml"), &text)
}
