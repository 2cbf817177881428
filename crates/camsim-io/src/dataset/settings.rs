//! Settings files for programs that read EuRoC folders: ORB-SLAM3, OpenVINS, VINS-Fusion.

use std::fmt::Write as _;

use super::{
    DatasetError, ExportJob,
    axes::Rigid,
    imu::ImuSensor,
    kalibr::imu_yaml,
    run_folder::RunCamera,
    text::{opencv_matrix, real},
};
use crate::calibration::{
    Calibration, CalibrationError, camodocal,
    kalibr::{PoseKey, chain_yaml},
    orb_slam,
};

/// Writes `settings/`; returns notes on those that a lens or a missing sensor leaves out.
pub(super) fn write(
    job: &ExportJob<'_>,
    imus: &[ImuSensor],
    body_from_b: &Rigid,
) -> Result<Vec<String>, DatasetError> {
    let mut notes = Vec::new();
    let imu = imus.first();
    notes.extend(imu.and_then(|imu| imu.begins_late(job.run)));
    let cameras = job.run.cameras.iter().map(RunCamera::calibration).collect::<Result<Vec<_>, _>>()?;
    match orb_slam(&cameras, imu) {
        Ok(text) => job.target.text("settings/orb_slam3.yaml", &text)?,
        Err(error) => notes.push(format!("settings for ORB-SLAM3 are left out: {error}")),
    }
    let Some(imu) = imu else { return Ok(notes) };
    match chain_yaml(&cameras, Some(&imu.reference()), PoseKey::ImuCam) {
        Ok(chain) => write_openvins(job, imu, &chain)?,
        Err(error) => notes.push(format!("settings for OpenVINS are left out: {error}")),
    }
    match write_vins(job, &cameras, imu, body_from_b) {
        Ok(()) => {}
        Err(DatasetError::Calibration(error)) => {
            notes.push(format!("settings for VINS-Fusion are left out: {error}"));
        }
        Err(error) => return Err(error),
    }
    Ok(notes)
}

/// Settings of ORB-SLAM3 of version 1.0.
fn orb_slam(cameras: &[Calibration], imu: Option<&ImuSensor>) -> Result<String, CalibrationError> {
    let reference = imu.map(ImuSensor::reference);
    let mut text = orb_slam::cameras(&cameras[..cameras.len().min(2)], reference.as_ref())?;
    if let Some(imu) = imu {
        let _ = write!(
            text,
            "IMU.NoiseGyro: {}\nIMU.NoiseAcc: {}\nIMU.GyroWalk: {}\nIMU.AccWalk: {}\nIMU.Frequency: {}\n",
            real(imu.gyro_noise),
            real(imu.acc_noise),
            real(imu.gyro_walk),
            real(imu.acc_walk),
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

fn write_openvins(job: &ExportJob<'_>, imu: &ImuSensor, chain: &str) -> Result<(), DatasetError> {
    let name = |file: &str| format!("settings/openvins/{file}");
    job.target.text(&name("kalibr_imucam_chain.yaml"), &format!("%YAML:1.0\n\n{chain}"))?;
    let indented: String = imu_yaml(0, imu).lines().map(|line| format!("  {line}\n")).collect();
    let unit = |key: &str| {
        format!("  {key}:\n    - [1.0, 0.0, 0.0]\n    - [0.0, 1.0, 0.0]\n    - [0.0, 0.0, 1.0]\n")
    };
    let zero = "  Tg:\n    - [0.0, 0.0, 0.0]\n    - [0.0, 0.0, 0.0]\n    - [0.0, 0.0, 0.0]\n";
    let text = format!(
        "%YAML:1.0\n\nimu0:\n  T_i_b:\n    - [1.0, 0.0, 0.0, 0.0]\n    - [0.0, 1.0, 0.0, 0.0]\n    - [0.0, 0.0, 1.0, \
         0.0]\n    - [0.0, 0.0, 0.0, 1.0]\n{indented}  model: \"kalibr\"\n  time_offset: 0.0\n{}{}{}{}{zero}",
        unit("Tw"),
        unit("R_IMUtoGYRO"),
        unit("Ta"),
        unit("R_IMUtoACC"),
    );
    job.target.text(&name("kalibr_imu_chain.yaml"), &text)?;
    let cameras = job.run.cameras.len();
    let estimator = format!(
        "%YAML:1.0\n\nverbosity: \"INFO\"\nuse_stereo: {}\nmax_cameras: {cameras}\ncalib_cam_extrinsics: false\n\
         calib_cam_intrinsics: false\ncalib_cam_timeoffset: false\ngravity_mag: 9.81\nrelative_config_imu: \
         \"kalibr_imu_chain.yaml\"\nrelative_config_imucam: \"kalibr_imucam_chain.yaml\"\n",
        cameras > 1
    );
    job.target.text(&name("estimator_config.yaml"), &estimator)
}

fn write_vins(
    job: &ExportJob<'_>,
    cameras: &[Calibration],
    imu: &ImuSensor,
    body_from_b: &Rigid,
) -> Result<(), DatasetError> {
    let name = |file: &str| format!("settings/vins/{file}");
    let first = &job.run.cameras[0];
    let cameras = &cameras[..cameras.len().min(2)];
    let [width, height] = first.spec.size_px;
    let mut text = format!(
        "%YAML:1.0\n\nimu: 1\nnum_of_cam: {}\nimu_topic: \"/imu0\"\noutput_path: \"~/output/\"\nimage_width: {width}\n\
         image_height: {height}\nestimate_extrinsic: 0\n",
        cameras.len()
    );
    for (i, camera) in cameras.iter().enumerate() {
        let b_from_camera = body_from_b.inverse().of(&camera.body_from_camera());
        let _ = writeln!(text, "image{i}_topic: \"/cam{i}/image_raw\"\ncam{i}_calib: \"cam{i}.yaml\"");
        text += &opencv_matrix(&format!("body_T_cam{i}"), &b_from_camera.matrix());
        job.target.text(&name(&format!("cam{i}.yaml")), &camodocal::file(&format!("cam{i}"), camera)?)?;
    }
    let shutter = &first.shutter;
    let _ = write!(
        text,
        "multiple_thread: 1\nmax_cnt: 150\nmin_dist: 30\nfreq: 10\nF_threshold: 1.0\nshow_track: 0\nflow_back: 1\n\
         max_solver_time: 0.04\nmax_num_iterations: 8\nkeyframe_parallax: 10.0\n# discrete noise is theirs to \
         make of these continuous-time densities\nacc_n: {}\ngyr_n: {}\nacc_w: {}\ngyr_w: {}\ng_norm: 9.81\n\
         # stamp + td is the time of the image's centre on the IMU's clock\nestimate_td: 0\ntd: {}\n\
         # VINS-Mono only; seconds from the first row to the last\nrolling_shutter: {}\nrolling_shutter_tr: {}\n",
        real(imu.acc_noise),
        real(imu.gyro_noise),
        real(imu.acc_walk),
        real(imu.gyro_walk),
        real(imu.shift_s(first)),
        u8::from(!first.is_global()),
        real(shutter.readout_s())
    );
    job.target.text(&name("vins.yaml"), &text)
}
