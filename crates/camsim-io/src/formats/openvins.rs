//! Settings of OpenVINS: `estimator_config.yaml` and the chains of the IMU and of the cameras.
//!
//! Its parser is OpenCV's `FileStorage`, and it stops where a key of its list is missing.

use super::axes::Rigid;
use super::exporting::imu::ImuSensor;
use super::exporting::{DatasetError, ExportJob, pictures};
use crate::text::numbers::{matrix_rows, real};
use crate::write::imu_yaml;

/// Begins every file of OpenCV.
const HEAD: &str = "%YAML:1.0\n\n";

/// Keys that neither the run nor the calibration decides, with the values of OpenVINS' own settings for EuRoC.
const USUAL: &str = r#"
# Filter.
use_fej: true
integration: "rk4"
max_clones: 11
max_slam: 50
max_slam_in_update: 25
max_msckf_in_update: 40
dt_slam_delay: 1
feat_rep_msckf: "GLOBAL_3D"
feat_rep_slam: "ANCHORED_MSCKF_INVERSE_DEPTH"
feat_rep_aruco: "ANCHORED_MSCKF_INVERSE_DEPTH"

# Updates at rest.
try_zupt: false
zupt_chi2_multipler: 0
zupt_max_velocity: 0.1
zupt_noise_multiplier: 10
zupt_max_disparity: 0.5
zupt_only_at_beginning: false

# Begin at rest, with a jerk of the accelerations.
init_window_time: 2.0
init_imu_thresh: 1.5
init_max_disparity: 10.0
init_max_features: 50

# Begin in motion.
init_dyn_mle_opt_calib: false
init_dyn_mle_max_iter: 50
init_dyn_mle_max_time: 0.05
init_dyn_mle_max_threads: 6
init_dyn_num_pose: 6
init_dyn_min_deg: 10.0
init_dyn_inflation_ori: 10
init_dyn_inflation_vel: 100
init_dyn_inflation_bg: 10
init_dyn_inflation_ba: 100
init_dyn_min_rec_cond: 1e-12
init_dyn_bias_g: [0.0, 0.0, 0.0]
init_dyn_bias_a: [0.0, 0.0, 0.0]

# Records.
record_timing_information: false
record_timing_filepath: "/tmp/traj_timing.txt"
save_total_state: false
filepath_est: "/tmp/ov_estimate.txt"
filepath_std: "/tmp/ov_estimate_std.txt"
filepath_gt: "/tmp/ov_groundtruth.txt"

# Features.
use_klt: true
num_pts: 200
fast_threshold: 20
grid_x: 5
grid_y: 5
min_px_dist: 10
knn_ratio: 0.70
downsample_cameras: false
num_opencv_threads: 4
histogram_method: "HISTOGRAM"
use_aruco: false
num_aruco: 1024
downsize_aruco: true

# Noise of features, px.
up_msckf_sigma_px: 1
up_msckf_chi2_multipler: 1
up_slam_sigma_px: 1
up_slam_chi2_multipler: 1
up_aruco_sigma_px: 1
up_aruco_chi2_multipler: 1
"#;

/// Writes the files; `chain` is that of the cameras.
pub(crate) fn write(job: &ExportJob<'_>, imu: &ImuSensor, chain: &str) -> Result<(), DatasetError> {
    let name = |file: &str| format!("settings/openvins/{file}");
    job.target.text(&name("kalibr_imucam_chain.yaml"), &format!("{HEAD}{chain}"))?;
    job.target.text(&name("kalibr_imu_chain.yaml"), &imu_chain(imu))?;
    let mut masks = String::new();
    for (i, camera) in job.run.cameras.iter().enumerate() {
        if let Some(mask) = pictures::mask(camera)? {
            // Its masks are 255 where it must not look.
            let file = format!("mask{i}.png");
            mask.write(job, &name(&file), 0)?;
            masks += &format!("mask{i}: \"{file}\"\n");
        }
    }
    job.target.text(&name("estimator_config.yaml"), &estimator(job, imu, &masks))
}

/// The true noise, axes and clock of the sensor.
fn imu_chain(imu: &ImuSensor) -> String {
    const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let matrices = [
        ("Tw", IDENTITY),
        ("R_IMUtoGYRO", IDENTITY),
        ("Ta", IDENTITY),
        ("R_IMUtoACC", IDENTITY),
        ("Tg", [[0.0; 3]; 3]),
    ];
    let (noise, _) = imu.noise_for_filters();
    let indented: String =
        imu_yaml(&noise, "imu0", imu.rate_hz).lines().map(|line| format!("  {line}\n")).collect();
    let mut text = format!("{HEAD}imu0:\n  T_i_b:\n{}{indented}", matrix_rows(&Rigid::IDENTITY.matrix()));
    text += "  model: \"kalibr\"\n  time_offset: 0.0\n";
    for (key, matrix) in matrices {
        text += &format!("  {key}:\n{}", matrix_rows(&matrix));
    }
    text
}

/// The estimator's settings: the calibration is true, and held.
fn estimator(job: &ExportJob<'_>, imu: &ImuSensor, masks: &str) -> String {
    let cameras = &job.run.cameras;
    let fps = cameras.iter().map(|camera| camera.spec.fps).fold(0.0, f64::max);
    format!(
        "{HEAD}verbosity: \"INFO\"\n\n# Cameras.\nuse_stereo: {}\nmax_cameras: {}\n# Frames per second that are used at \
         most.\ntrack_frequency: {}\nuse_mask: {}\n{masks}\n# The calibration is the true one.\n\
         calib_cam_extrinsics: false\ncalib_cam_intrinsics: false\ncalib_cam_timeoffset: false\n\
         calib_imu_intrinsics: false\ncalib_imu_g_sensitivity: false\nrelative_config_imu: \
         \"kalibr_imu_chain.yaml\"\nrelative_config_imucam: \"kalibr_imucam_chain.yaml\"\n\n# At the run's origin, \
         m/s^2.\ngravity_mag: {}\n\n# A flight is in motion from its begin.\ninit_dyn_use: true\n{USUAL}",
        cameras.len() == 2,
        cameras.len(),
        real(fps + 1.0),
        !masks.is_empty(),
        real(imu.gravity_m_s2)
    )
}
