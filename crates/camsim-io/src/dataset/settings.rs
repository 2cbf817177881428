//! Settings files for programs that read EuRoC folders: ORB-SLAM3, OpenVINS, VINS-Fusion.

use std::fmt::Write as _;

use super::{
    DatasetError, ExportJob,
    axes::Rigid,
    imu::ImuSensor,
    kalibr::{chain_yaml, imu_yaml},
    run_folder::{Intrinsics, RunCamera},
    text::{opencv_matrix, real},
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
    match orb_slam(job, imu, body_from_b)? {
        Some(text) => job.target.text("settings/orb_slam3.yaml", &text)?,
        None => notes.push("settings for ORB-SLAM3 are left out: it has no lens with k4 to k6".to_owned()),
    }
    let Some(imu) = imu else { return Ok(notes) };
    match chain_yaml(job, Some(imu), "T_imu_cam") {
        Ok(chain) => write_openvins(job, imu, &chain)?,
        Err(DatasetError::Refused(_)) => {
            notes.push(
                "settings for OpenVINS and VINS-Fusion are left out: they have no lens with k3 to k6"
                    .to_owned(),
            );
            return Ok(notes);
        }
        Err(error) => return Err(error),
    }
    write_vins(job, imu, body_from_b)?;
    Ok(notes)
}

/// Settings of ORB-SLAM3 of version 1.0; `None` if it does not have the lens.
fn orb_slam(
    job: &ExportJob<'_>,
    imu: Option<&ImuSensor>,
    body_from_b: &Rigid,
) -> Result<Option<String>, DatasetError> {
    let cameras = &job.run.cameras[..job.run.cameras.len().min(2)];
    let mut text =
        "%YAML:1.0\n\n# (0, 0) is the centre of the first pixel.\nFile.version: \"1.0\"\n".to_owned();
    for (i, camera) in cameras.iter().enumerate() {
        let lens = camera.intrinsics()?;
        if lens.coefficients[5..] != [0.0; 3] {
            return Ok(None);
        }
        if i == 0 {
            let kind = if lens.equidistant().is_some() { "KannalaBrandt8" } else { "PinHole" };
            let _ = writeln!(text, "Camera.type: \"{kind}\"");
        }
        text += &orb_camera(i + 1, &lens);
    }
    let first = &cameras[0];
    let [width, height] = first.spec.size_px;
    let _ = write!(
        text,
        "\nCamera.width: {width}\nCamera.height: {height}\nCamera.fps: {}\nCamera.RGB: 1\n",
        first.spec.fps.round()
    );
    if let [left, right] = cameras {
        let left_from_right = left.body_from_camera().inverse().of(&right.body_from_camera());
        text += "\nStereo.ThDepth: 60.0\n";
        text += &opencv_matrix("Stereo.T_c1_c2", &left_from_right.matrix());
    }
    if let Some(imu) = imu {
        let b_from_camera = body_from_b.inverse().of(&first.body_from_camera());
        let _ = write!(text, "\n{}", opencv_matrix("IMU.T_b_c1", &b_from_camera.matrix()));
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
    Ok(Some(text))
}

fn orb_camera(number: usize, lens: &Intrinsics) -> String {
    let ([fx, fy], [cx, cy]) = (lens.focal_px, lens.principal_px);
    let [k1, k2, p1, p2, k3, ..] = lens.coefficients;
    let radial = [("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2), ("k3", k3)];
    let coefficients: Vec<(&str, f64)> = match lens.equidistant() {
        Some([k1, k2, k3, k4]) => vec![("k1", k1), ("k2", k2), ("k3", k3), ("k4", k4)],
        // A fifth coefficient is read if it is there.
        None => radial.into_iter().filter(|(name, value)| *name != "k3" || *value != 0.0).collect(),
    };
    let mut text = "\n".to_owned();
    let matrix = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)];
    for (name, value) in matrix.into_iter().chain(coefficients) {
        let _ = writeln!(text, "Camera{number}.{name}: {}", real(value));
    }
    text
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

fn write_vins(job: &ExportJob<'_>, imu: &ImuSensor, body_from_b: &Rigid) -> Result<(), DatasetError> {
    let name = |file: &str| format!("settings/vins/{file}");
    let cameras = &job.run.cameras[..job.run.cameras.len().min(2)];
    let first = &cameras[0];
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
        job.target.text(&name(&format!("cam{i}.yaml")), &camodocal(i, camera)?)?;
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

/// A camera file of camodocal, which VINS reads.
fn camodocal(i: usize, camera: &RunCamera) -> Result<String, DatasetError> {
    let lens = camera.intrinsics()?;
    let ([fx, fy], [cx, cy], [w, h]) = (lens.focal_px, lens.principal_px, lens.size_px);
    let size = format!("camera_name: cam{i}\nimage_width: {w}\nimage_height: {h}\n");
    Ok(match lens.equidistant() {
        Some([k1, k2, k3, k4]) => format!(
            "%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\n{size}projection_parameters:\n   k2: {}\n   k3: {}\n   k4: \
             {}\n   k5: {}\n   mu: {}\n   mv: {}\n   u0: {}\n   v0: {}\n",
            real(k1),
            real(k2),
            real(k3),
            real(k4),
            real(fx),
            real(fy),
            real(cx),
            real(cy)
        ),
        None => {
            let [k1, k2, p1, p2, ..] = lens.coefficients;
            format!(
                "%YAML:1.0\n---\nmodel_type: PINHOLE\n{size}distortion_parameters:\n   k1: {}\n   k2: {}\n   p1: {}\n   \
                 p2: {}\nprojection_parameters:\n   fx: {}\n   fy: {}\n   cx: {}\n   cy: {}\n",
                real(k1),
                real(k2),
                real(p1),
                real(p2),
                real(fx),
                real(fy),
                real(cx),
                real(cy)
            )
        }
    })
}
