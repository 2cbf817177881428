//! Problematic calibration files of users (`tests/data/field/calib`): each is imported correctly or refused
//! with a remedy.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::PathBuf;

use camsim_core::scenario::{LensModel, Readout};
use camsim_io::camera_file::{CameraFormat, ImportedCamera, import_camera_as, read_camera_toml};
use camsim_io::scenario_file::read_checked_camera;

fn field(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field/calib").join(name)
}

fn read(name: &str) -> ImportedCamera {
    import_camera_as(&field(name), None).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(name: &str) -> String {
    import_camera_as(&field(name), None).unwrap_err().to_string()
}

fn assert_near(a: [f64; 2], b: [f64; 2]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} instead of {b:?}");
}

fn has_note(imported: &ImportedCamera, text: &str) -> bool {
    imported.notes.iter().any(|note| note.contains(text))
}

#[test]
fn vins_rolling_shutter_is_33_ms() {
    let imported = read("vins_rs.yaml");
    let spec = &imported.spec;
    assert!((spec.shutter.readout_ms - 33.0).abs() < 1e-12);
    assert_eq!(spec.shutter.readout, Readout::TopToBottom);
    assert_eq!(
        (spec.size_px, spec.focal_px, spec.principal_point_px),
        ([640, 480], [610.0, 609.0], Some([319.0, 235.5]))
    );
    assert_eq!(spec.lens.coefficients, [9.2e-2, -1.8e-1, -6.5e-4, -3.5e-4]);
    assert!(has_note(&imported, "not applied: td = 0.007"), "{:?}", imported.notes);
    assert!(!has_note(&imported, "no shutter times"), "{:?}", imported.notes);
}

#[test]
fn mirror_parameter_makes_a_mei_lens() {
    let imported = import_camera_as(&field("omni_sample.yml"), None).unwrap();
    let lens = &imported.spec.lens;
    assert_eq!((lens.model, &lens.coefficients[..]), (LensModel::Mei, &[1.4, -0.1, 0.2, 0.001, 0.002][..]));
    // Its lens has a focal length of 780 / 2.4 px.
    assert_eq!(imported.spec.focal_px, [780.0, 780.3]);
}

#[test]
fn four_coefficients_without_model_need_a_format() {
    let error = refused("fisheye_K_D.yml");
    assert!(error.contains("`--format opencv`") && error.contains("`--format opencv-fisheye`"), "{error}");
    let coefficients = [-0.0077, 0.0419, -0.0391, 0.0067];
    let as_ = |format| import_camera_as(&field("fisheye_K_D.yml"), Some(format)).unwrap().spec;
    let (plain, fisheye) = (as_(CameraFormat::OpenCv), as_(CameraFormat::OpenCvFisheye));
    assert_eq!(
        (plain.lens.model, plain.lens.coefficients.as_slice()),
        (LensModel::BrownConrady, &coefficients[..])
    );
    assert_eq!(
        (fisheye.lens.model, fisheye.lens.coefficients.as_slice()),
        (LensModel::KannalaBrandt, &coefficients[..])
    );
    assert_eq!((fisheye.focal_px, fisheye.principal_point_px), ([286.1, 286.3], Some([319.7, 240.2])));
}

#[test]
fn camera_info_message_with_region_is_imported() {
    let imported = read("baxter2.yaml");
    let spec = &imported.spec;
    assert_eq!((imported.format, spec.size_px), (CameraFormat::RosCameraInfo, [640, 400]));
    assert_near(spec.focal_px, [403.911583563, 403.911583563]);
    assert_near(spec.principal_point_px.unwrap(), [631.065444573 - 320.0, 375.688877091 - 200.0]);
    assert_eq!(
        spec.lens.coefficients,
        [0.0153369206277, -0.0432553402055, -0.00118657118488, -0.00147661359656, 0.00896220693898]
    );
    assert!(
        has_note(&imported, "the picture is the region [640.0, 400.0] px from [320.0, 200.0]"),
        "{:?}",
        imported.notes
    );
}

#[test]
fn ros_2_camera_info_message_is_imported() {
    let imported = read("ros2b.yaml");
    let spec = &imported.spec;
    assert_eq!((imported.format, spec.size_px), (CameraFormat::RosCameraInfo, [640, 480]));
    assert_eq!((spec.focal_px, spec.principal_point_px), ([458.0, 457.0], Some([367.0, 248.0])));
    assert_eq!(spec.lens.coefficients, [-0.28, 0.07, 0.0002, 1.7e-05]);
}

#[test]
fn binning_divides_matrix_and_size() {
    let text = std::fs::read_to_string(field("baxter2.yaml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("binned.yaml");
    std::fs::write(
        &path,
        text.replace("binning_x: 1", "binning_x: 4").replace("binning_y: 1", "binning_y: 4"),
    )
    .unwrap();
    let imported = import_camera_as(&path, None).unwrap();
    assert_eq!(imported.spec.size_px, [160, 100]);
    assert_near(imported.spec.focal_px, [403.911583563 / 4.0, 403.911583563 / 4.0]);
    assert_near(
        imported.spec.principal_point_px.unwrap(),
        [(631.065444573 - 320.0) / 4.0, (375.688877091 - 200.0) / 4.0],
    );
    assert!(has_note(&imported, "binned by [4.0, 4.0]"), "{:?}", imported.notes);
}

#[test]
fn ros_ini_is_imported() {
    let imported = read("ic33.ini");
    let spec = &imported.spec;
    assert_eq!((imported.format, spec.size_px), (CameraFormat::RosIni, [640, 480]));
    assert_eq!(
        (spec.focal_px, spec.principal_point_px),
        ([369.344588, 367.154330], Some([320.739078, 203.592450]))
    );
    assert_eq!(spec.lens.model, LensModel::BrownConrady);
    assert_eq!(
        spec.lens.coefficients,
        [0.189544, -0.018229, -0.000630, 0.000054, -0.000212, 0.543582, -0.027892]
    );
    assert!(has_note(&imported, "projection_matrix, which differs"), "{:?}", imported.notes);
}

#[test]
fn camera_info_file_with_region_is_imported() {
    let spec = read("roi_yaml.yaml").spec;
    assert_eq!((spec.size_px, spec.focal_px), ([640, 400], [403.9, 403.9]));
    assert_near(spec.principal_point_px.unwrap(), [631.06 - 320.0, 375.7 - 200.0]);
}

#[test]
fn symmetrical_gyroflow_profile_has_a_central_principal_point() {
    let imported = read("gyro_min.json");
    let spec = &imported.spec;
    assert_eq!(
        (spec.size_px, spec.principal_point_px, spec.fps),
        ([1920, 1080], Some([960.0, 540.0]), 59.94)
    );
    assert_eq!((spec.shutter.readout_ms, spec.shutter.readout), (15.2, Readout::TopToBottom));
    assert_eq!((spec.lens.model, spec.lens.coefficients.as_slice()), (LensModel::KannalaBrandt, &[0.1][..]));
    assert!(has_note(&imported, "[565.6, 1206.0]"), "{:?}", imported.notes);
}

#[test]
fn three_coefficients_are_refused_as_ambiguous() {
    let path = field("three_coefficients.toml");
    for error in [
        read_camera_toml(&path).unwrap_err().to_string(),
        read_checked_camera(&path).unwrap_err().to_string(),
        refused("three_coefficients.toml"),
    ] {
        assert!(error.contains("lens.coefficients") && error.contains("k1, k2, 0, 0, k3"), "{error}");
    }
}

#[test]
fn metashape_project_is_imported() {
    let imported = read("metashape_cams.xml");
    let spec = &imported.spec;
    assert_eq!(
        (imported.format, spec.size_px, spec.focal_px),
        (CameraFormat::Agisoft, [5472, 3648], [3666.2, 3666.2])
    );
    assert_near(spec.principal_point_px.unwrap(), [2736.0 - 11.7 - 0.5, 1824.0 + 18.2 - 0.5]);
    assert_eq!(spec.lens.coefficients, [0.0093, -0.03, 0.0012, 0.0004, 0.029]);
}

#[test]
fn matrix_as_list_of_rows_is_imported() {
    let spec = read("py_nested.yaml").spec;
    assert_eq!(
        (spec.size_px, spec.focal_px, spec.principal_point_px),
        ([640, 480], [657.1, 657.3], Some([319.5, 239.5]))
    );
    assert_eq!(spec.lens.coefficients, [-0.2, 0.05, 0.001, -0.001, 0.01]);
}

#[test]
fn absent_extrinsics_are_not_reported() {
    let imported = read("kal_none.yaml");
    let spec = &imported.spec;
    assert_eq!(
        (spec.size_px, spec.focal_px, spec.principal_point_px),
        ([512, 512], [257.3, 257.4], Some([254.9, 256.8]))
    );
    assert_eq!(spec.lens.model, LensModel::Pinhole);
    assert_eq!(
        imported.notes,
        ["the file has no frame rate and no shutter times: fps is 30, the shutter global"]
    );
}

#[test]
fn every_file_of_the_folder_has_a_test() {
    let here = include_str!("field_cameras.rs");
    for entry in std::fs::read_dir(field("")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(here.contains(&format!("\"{name}\"")), "{name} has no test");
    }
}
