//! Problematic calibration files of users (`tests/data/field/calib`, `tests/data/field-2`): each is imported
//! correctly or refused with a remedy.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use camsim_core::scenario::{CameraSpec, LensModel, Readout};
use camsim_io::formats::reading::{
    CameraFormat, ImportOptions, ImportedCamera, import_camera_as, import_camera_with, import_rig,
    read_camera_toml,
};
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

/// What is imported of a file.
#[derive(Clone, Copy, Debug)]
enum Part {
    Only,
    Named(&'static str),
    Rig,
}

/// What an import gives.
enum Expected {
    /// Notes with these texts, and none of these.
    Told(&'static [&'static str], &'static [&'static str]),
    /// A lens and a focal length.
    Lens(LensModel, &'static [f64], [f64; 2]),
    /// Names of cameras.
    Names(&'static [&'static str]),
    /// A refusal with all of these.
    Refused(&'static [&'static str]),
}

use Expected::{Lens, Names, Refused, Told};
use Part::{Named, Only, Rig};

/// A file, texts in it and what they are replaced by, and what is imported of it.
type Case = (&'static str, &'static [(&'static str, &'static str)], Part, Expected);

/// What notes about implausible values say.
const DOUBTS: &[&str] = &["check", "is it", "were"];

fn import_part(
    path: &Path,
    part: Part,
    size_px: Option<[u32; 2]>,
) -> Result<(Vec<CameraSpec>, Vec<String>), String> {
    let options = |camera| ImportOptions { camera, size_px, ..ImportOptions::default() };
    let one = |camera| import_camera_with(path, &options(camera)).map(|one| (vec![one.spec], one.notes));
    match part {
        Only => one(None),
        Named(name) => one(Some(name)),
        Rig => import_rig(path, &options(None)).map(|rig| (rig.cameras, rig.notes)),
    }
    .map_err(|error| error.to_string())
}

/// A file of `tests/data/field-2` with texts replaced by others.
fn edited(folder: &Path, file: &str, edits: &[(&str, &str)]) -> PathBuf {
    let source = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field-2").join(file);
    let mut text = std::fs::read_to_string(&source).unwrap();
    for (from, to) in edits {
        assert!(text.contains(from), "{file} has no `{from}`");
        text = text.replace(from, to);
    }
    let path = folder.join(source.file_name().unwrap());
    std::fs::write(&path, text).unwrap();
    path
}

fn check_case(file: &str, edits: &[(&str, &str)], part: Part, expected: &Expected) {
    let folder = tempfile::tempdir().unwrap();
    let path = edited(folder.path(), file, edits);
    let found = import_part(&path, part, None);
    let case = format!("{file} {edits:?} {part:?}");
    match (expected, found) {
        (Refused(words), Err(error)) => {
            words.iter().for_each(|word| assert!(error.contains(word), "{case}: no `{word}` in {error}"));
        }
        (Told(words, others), Ok((_, notes))) => {
            let notes = notes.join("\n");
            words.iter().for_each(|word| assert!(notes.contains(word), "{case}: no `{word}` in {notes}"));
            others.iter().for_each(|word| assert!(!notes.contains(word), "{case}: `{word}` in {notes}"));
        }
        (Lens(model, coefficients, focal_px), Ok((cameras, _))) => {
            let spec = &cameras[0];
            assert_eq!((spec.lens.model, &spec.lens.coefficients[..]), (*model, *coefficients), "{case}");
            assert_near(spec.focal_px, *focal_px);
        }
        (Names(names), Ok((cameras, _))) => {
            assert_eq!(cameras.iter().map(|camera| &camera.name[..]).collect::<Vec<_>>(), *names, "{case}");
        }
        (_, found) => panic!("{case}: {found:?}"),
    }
}

/// One judge of cameras for all formats.
#[test]
fn implausible_cameras_are_told_or_refused_in_all_formats() {
    const SFM: &str = "17-opensfm-focal-in-pixels/C02e.json";
    const COLMAP: &str = "18-colmap-principal-at-corner/C19a_cameras.txt";
    const ROS: &str = "19-coefficients-in-thousands/C05d_huge.yaml";
    const ORB: &str = "20-orb-size-mismatch/E1.yaml";
    const PAIR: &[(&str, &str)] = &[
        ("1920", "752"),
        ("1080", "480"),
        (
            "ThDepth: 40.0",
            "Camera2.fx: 457.6\nCamera2.fy: 456.1\nCamera2.cx: 380.0\nCamera2.cy: 255.2\nStereo.b: 0.5\n\
             Stereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n  \
             data: [1.0, 0.0, 0.0, 0.1100738, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]",
        ),
    ];
    const PAIR_WITH_BF: &[(&str, &str)] = &[PAIR[0], PAIR[1], PAIR[2], ("Stereo.b: 0.5", "Camera.bf: 50.4")];
    const CHAIN: &str = "21-clock-offset-seconds/E10.yaml";
    const LIST: &str = "1204.5, -310.2, 95.1, 1210.0, -305.1";
    let quiet = || Told(&[], DOUBTS);
    let cases: Vec<Case> = vec![
        (SFM, &[], Only, Refused(&["the focal length", "2880 times the longer side", "fractions of a side"])),
        (SFM, &[("2880.0", "0.72")], Only, quiet()),
        (SFM, &[("2880.0", "0.0088")], Only, Refused(&["is it a fraction of a side, or in millimetres"])),
        (
            SFM,
            &[("\"focal_x\":2880.0", "\"focal_x\":0.72"), ("2880.0", "0.96")],
            Only,
            Told(&["differs by 33 %"], &[]),
        ),
        (
            SFM,
            &[("2880.0", "0.72"), ("\"c_x\":0,\"c_y\":0", "\"c_x\":0.5,\"c_y\":0.375")],
            Only,
            Told(&["would be the centre of a picture of about 8000 x 6000, not of 4000 x 3000"], &[]),
        ),
        (COLMAP, &[], Named("1"), Told(&["is in the corner", "differs by 69 %", "tangential terms"], &[])),
        (COLMAP, &[], Named("3"), quiet()),
        // COLMAP's first guess of a focal length.
        (COLMAP, &[("900 900 640", "1536 1536 640")], Named("3"), quiet()),
        (
            COLMAP,
            &[("900 900 640 360", "640 360 900 900")],
            Named("3"),
            Told(&["differs by 78 %", "of about 1800 x 1800"], &[]),
        ),
        (COLMAP, &[("900 900 640 360", "900 900 0.5 0.5")], Named("3"), Told(&["is in the corner"], &[])),
        (ROS, &[], Only, Told(&["of the pixels have a ray, so check the order and the scale"], &[])),
        (ROS, &[(LIST, "-0.12, 0.03, 0.0005, 0.0002, 0.0")], Only, quiet()),
        (
            ROS,
            &[(LIST, "-0.28, 0.07, -0.05, 0.0002, 0.0001")],
            Only,
            Told(&["tangential terms p1 and p2"], &[]),
        ),
        (ROS, &[(LIST, "-28, 7, 0.02, 0.01, 0")], Only, Told(&["check the order and the scale"], &[])),
        (
            ROS,
            &[(LIST, "0, 0, 0, 0, 0"), ("610.2", "0.61"), ("610.5", "0.61")],
            Only,
            Refused(&["the focal length", "in millimetres"]),
        ),
        (ORB, &[], Only, Told(&["centre of a picture of about 735 x 498, not of 1920 x 1080"], &[])),
        (ORB, &[("1920", "752"), ("1080", "480")], Only, quiet()),
        (ORB, &[("1920", "480"), ("1080", "752")], Only, Told(&["check whether it is rotated"], &[])),
        (ORB, &[("1920", "640"), ("1080", "480")], Only, quiet()),
        (
            ORB,
            PAIR,
            Rig,
            Told(
                &["not applied: Stereo.b = 0.5, a baseline of 0.5000 m: the cameras are 0.1101 m"],
                &["`--rig`"],
            ),
        ),
        (ORB, PAIR_WITH_BF, Rig, Told(&[], &["not applied"])),
        (ORB, &[("1920", "376"), ("1080", "240")], Only, Told(&["not of 376 x 240"], &[])),
        (
            CHAIN,
            &[],
            Rig,
            Told(&["cam0: clock_offset_ms = 43300.0 shifts the camera's clock by 43.3 s"], &["cam1:"]),
        ),
        (CHAIN, &[("-43.3", "2.1")], Rig, Told(&["were milliseconds written as seconds"], &[])),
        (CHAIN, &[("-43.3", "0.0021")], Rig, quiet()),
        (
            CHAIN,
            &[("-43.3", "0.0021"), ("0.15]", "150.0]"), ("0.05]", "50.0]"), ("-0.10]", "-100.0]")],
            Rig,
            Told(&["cam0: mount.offset_m", "cam1: mount.offset_m", "is it in millimetres"], &[]),
        ),
        (
            CHAIN,
            &[("-43.3", "0.0021\n  line_delay: 0.0000001")],
            Rig,
            Told(&["cam0: shutter.readout_ms", "shorter than the readout of any sensor"], &[]),
        ),
    ];
    for (file, edits, part, expected) in cases {
        check_case(file, edits, part, &expected);
    }
}

#[test]
fn keys_that_a_format_defines_are_read_or_refused() {
    use LensModel::{BrownConrady, Equirectangular, KannalaBrandt};
    const FRAMES: &str = "27-nerfstudio-frame-distortion/C08e_perframe_k1only.json";
    const NGP: &str = "28-nerf-is-fisheye/C08a_fisheye_flag.json";
    const NGP_2: &str = "28-nerf-is-fisheye/C08a2_fisheye_flag_k12.json";
    const OWN: &str = "29-own-nerfstudio-rig/C08c_perframe.json";
    const CHAIN: &str = "30-chain-both-directions/C26d_bothdirs.yaml";
    const K: &str = "\"k1\":0.02,\"k2\":0.01,\"w\":320,\"h\":240";
    const FISHEYE: &str = "\"is_fisheye\":true";
    const FLAT: (&str, &str) = (FISHEYE, "\"is_fisheye\":false");
    const ANGLE_X: &str = "\"camera_angle_x\":1.9,\"fl_x\":300.5,\"fl_y\":301.5";
    const PLAIN_2: &[f64] = &[0.05, -0.01];
    const SECOND: &str = "\"images/0002.png\",\"fl_x\":500";
    let cases: Vec<Case> = vec![
        (
            FRAMES,
            &[],
            Only,
            Refused(&["frames[0].w, frames[0].h: differ from the root", "delete those of the frames"]),
        ),
        (
            FRAMES,
            &[(",\"w\":320,\"h\":240", ",\"w\":640.0,\"fl_x\":500.0")],
            Only,
            Lens(BrownConrady, &[0.02, 0.01], [500.0; 2]),
        ),
        (
            FRAMES,
            &[("\"w\":640", "\"k1\":0.5,\"w\":640"), (",\"w\":320,\"h\":240", "")],
            Only,
            Refused(&["frames[0].k1, frames[0].k2: differ from the root"]),
        ),
        (
            FRAMES,
            &[(K, "\"distortion_params\":[0.02,0.01,0,0,0.001,0]")],
            Only,
            Lens(BrownConrady, &[0.02, 0.01, 0.001, 0.0], [500.0; 2]),
        ),
        (
            FRAMES,
            &[(K, "\"k1\":0.02,\"distortion_params\":[0.02,0.01,0,0,0.001,0]")],
            Only,
            Refused(&["distortion_params", "delete one"]),
        ),
        (FRAMES, &[(K, "\"k4\":0.01")], Only, Refused(&["frames[0].k4", "OPENCV_FISHEYE"])),
        (
            FRAMES,
            &[(K, "\"zoom\":0.01,\"sharpness\":3")],
            Only,
            Told(&["frames[0].zoom = 0.01"], &["sharpness"]),
        ),
        (
            FRAMES,
            &[
                ("\"OPENCV\"", "\"EQUIRECTANGULAR\""),
                (K, "\"colmap_im_id\":1"),
                ("\"fl_x\":500,\"fl_y\":500", "\"fl_x\":320,\"fl_y\":320"),
            ],
            Only,
            Lens(Equirectangular, &[], [640.0 / TAU; 2]),
        ),
        (NGP, &[], Only, Lens(KannalaBrandt, &[0.05, -0.01, 0.002, -0.0003], [300.5, 301.5])),
        (NGP_2, &[], Only, Lens(KannalaBrandt, &[0.05, -0.01], [300.5, 301.5])),
        (
            NGP_2,
            &[(FISHEYE, "\"is_fisheye\":false")],
            Only,
            Lens(BrownConrady, &[0.05, -0.01], [300.5, 301.5]),
        ),
        (NGP, &[(FISHEYE, "\"is_fisheye\":false")], Only, Refused(&["k4", "camera_model OPENCV_FISHEYE"])),
        (
            NGP,
            &[(FISHEYE, "\"is_fisheye\":true,\"camera_model\":\"OPENCV\"")],
            Only,
            Refused(&["is_fisheye", "delete the wrong one"]),
        ),
        (NGP_2, &[("\"p1\":0.0", "\"p1\":0.001")], Only, Refused(&["p1", "camera_model OPENCV"])),
        (NGP_2, &[], Only, Told(&["camera_angle_x, which says a focal length of 228"], &[])),
        (NGP_2, &[("\"fl_x\":300.5,\"fl_y\":301.5,", "")], Only, Told(&["fl_x is missing"], &[])),
        (
            NGP_2,
            &[("\"fl_x\":300.5,\"fl_y\":301.5,", "\"camera_angle_y\":0.5,\"y_fov\":40,"), FLAT],
            Only,
            Told(
                &["fl_y is missing: 939.9", "y_fov, which says a focal length of 659.4 px: camera_angle_y"],
                &[],
            ),
        ),
        (
            NGP_2,
            &[(ANGLE_X, "\"x_fov\":90,\"y_fov\":90"), FLAT],
            Only,
            Lens(BrownConrady, PLAIN_2, [320.0, 240.0]),
        ),
        (NGP_2, &[(ANGLE_X, "\"y_fov\":90"), FLAT], Only, Lens(BrownConrady, PLAIN_2, [240.0; 2])),
        (
            NGP_2,
            &[(ANGLE_X, "\"fl_x\":500,\"y_fov\":90"), FLAT],
            Only,
            Lens(BrownConrady, PLAIN_2, [500.0, 240.0]),
        ),
        (
            NGP_2,
            &[(ANGLE_X, "\"camera_angle_x\":90"), FLAT],
            Only,
            Refused(&["camera_angle_x: is 90", "3.1416"]),
        ),
        (NGP_2, &[("\"aabb", "\"latlong\":true,\"aabb")], Only, Refused(&["latlong"])),
        (OWN, &[], Only, Lens(BrownConrady, &[0.01], [500.0; 2])),
        (OWN, &[], Only, Told(&[], &["unknown", "not applied"])),
        (
            OWN,
            &[(SECOND, "\"images/0002.png\",\"fl_x\":600")],
            Only,
            Refused(&[
                "there are 2 (`images/0001.png`, `images/0002.png`)",
                "`--camera images/0001.png`",
                "`--rig`",
            ]),
        ),
        (
            OWN,
            &[(SECOND, "\"images/0002.png\",\"fl_x\":600")],
            Named("images/0002.png"),
            Lens(BrownConrady, &[0.01], [600.0, 500.0]),
        ),
        (
            OWN,
            &[(SECOND, "\"images/right/1.png\",\"fl_x\":600"), ("images/0001", "images/left/1")],
            Rig,
            Names(&["left", "right"]),
        ),
        (OWN, &[(",\"w\":640,\"h\":480", "")], Only, Refused(&["frames[0].w", "--size"])),
        (
            CHAIN,
            &[],
            Rig,
            Refused(&[
                "cam0.T_imu_cam: is another pose than cam0.T_cam_imu",
                "0.1000 m",
                "delete the wrong one",
            ]),
        ),
        (CHAIN, &[], Named("cam0"), Told(&["not applied: cam0.T_cam_imu, cam0.T_imu_cam"], &[])),
        (
            CHAIN,
            &[("T_imu_cam", "T_body_cam")],
            Rig,
            Told(&["cam0.T_body_cam (a pose under another name"], &["T_cam_imu ("]),
        ),
        // The same pose twice.
        (
            CHAIN,
            &[("0.25]", "0.15]"), ("0.05]", "0.15]")],
            Rig,
            Told(&["cam1.T_cn_cnm1 differs"], &["not applied"]),
        ),
        (
            CHAIN,
            &[("T_cam_imu", "T_cam_imu_old")],
            Only,
            Refused(&["there are 2", "`--camera cam0`, or all with `--rig`"]),
        ),
    ];
    for (file, edits, part, expected) in cases {
        check_case(file, edits, part, &expected);
    }
}

#[test]
fn messages_name_the_thing_and_a_remedy() {
    use LensModel::Equirectangular;
    const ZED: &str = "31-ini-as-yaml/C13_zed.conf";
    const PIX4D: &str = "31-ini-as-yaml/C30_pix4d.cam";
    const KEYS: &str = "35-radial-and-tangential-keys/C17c_radialtangential.json";
    const RADIAL: &str = "\"radial_distortion\":[-0.25,0.06],\"tangential_distortion\":[0.001,-0.0004]";
    const METASHAPE: &str = "36-spherical-sensors/C01_metashape.xml";
    const SFM: &str = "36-spherical-sensors/C02d_odm_dual.json";
    const PANORAMA: [f64; 2] = [5760.0 / TAU; 2];
    let cases: Vec<Case> = vec![
        (
            ZED,
            &[],
            Only,
            Refused(&[
                "not a known camera file",
                "LEFT_CAM_FHD, LEFT_CAM_HD, RIGHT_CAM_HD have",
                "supported are",
            ]),
        ),
        (
            ZED,
            &[("[LEFT_CAM_HD]", ""), ("[RIGHT_CAM_HD]", "[calib]")],
            Only,
            Refused(&["the file, LEFT_CAM_FHD, calib have", "image_width"]),
        ),
        (
            ZED,
            &[("fx=1401.64", "resolution=[1920 1080]\nfx=1401.64")],
            Only,
            Refused(&["`image_width: 1920`, `image_height: 1080`"]),
        ),
        (ZED, &[("fx=", "focal=")], Only, Refused(&["not a known camera file", "supported are"])),
        (
            PIX4D,
            &[],
            Only,
            Refused(&[
                "camera of Pix4D",
                "f = 0.666758 W",
                "cx = 0.499265 W - 0.5",
                "[0.0021, -0.0095, -0.0004, 0.0003, 0.0088]",
            ]),
        ),
        (
            PIX4D,
            &[("assuming a sensor width of 13.2x8.8mm", "")],
            Only,
            Refused(&["f = 8.8012 W / S", "S the width of the sensor"]),
        ),
        (
            KEYS,
            &[],
            Only,
            Refused(&[
                "radial_distortion, tangential_distortion have the lens",
                "[-0.25, 0.06, 0.001, -0.0004, 0.0]",
            ]),
        ),
        (
            KEYS,
            &[("[-0.25,0.06]", "[-0.25,0.06,-0.01]")],
            Only,
            Refused(&["[-0.25, 0.06, 0.001, -0.0004, -0.01]"]),
        ),
        (
            KEYS,
            &[
                ("radial_distortion\":", "RadialDistortion\":"),
                ("tangential_distortion", "TangentialDistortion"),
            ],
            Only,
            Refused(&["RadialDistortion", "MATLAB counts cx and cy from 1"]),
        ),
        (
            KEYS,
            &[(RADIAL, "\"k1\":-0.25,\"k2\":0.06,\"p1\":0.001")],
            Only,
            Refused(&["k1, k2, p1 have the lens", "[-0.25, 0.06, 0.001, 0.0, 0.0]"]),
        ),
        (
            KEYS,
            &[(RADIAL, "\"k1\":-0.25,\"k4\":0.5")],
            Only,
            Refused(&["[-0.25, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0]"]),
        ),
        (KEYS, &[(RADIAL, "\"rms\":0.2")], Only, Refused(&["[0, 0, 0, 0, 0] if there is no distortion"])),
        (
            KEYS,
            &[(RADIAL, "\"model_type\":\"equirectangular\",\"D\":[0,0,0,0,0]")],
            Only,
            Refused(&["panorama", "lens.model = \"equirectangular\""]),
        ),
        (METASHAPE, &[], Named("Sphere"), Lens(Equirectangular, &[], PANORAMA)),
        (METASHAPE, &[], Named("Equisolid"), Refused(&["equisolid_fisheye", "spherical"])),
        (
            METASHAPE,
            &[("5760\" height=\"2880", "5760\" height=\"5760")],
            Named("Sphere"),
            Told(&["50 % of the picture has no ray"], &[]),
        ),
        (
            METASHAPE,
            &[("\"fisheye\"", "\"spherical\"")],
            Named("2"),
            Refused(&["`spherical`, a panorama, which has no f"]),
        ),
        (SFM, &[], Named("a spherical"), Lens(Equirectangular, &[], PANORAMA)),
        (SFM, &[], Named("c equirectangular"), Lens(Equirectangular, &[], PANORAMA)),
        (SFM, &[], Named("b dual"), Refused(&["projection_type", "`dual`", "brown"])),
        (SFM, &[], Named("z"), Refused(&["`a spherical`, `b dual`, `c equirectangular`"])),
        (
            SFM,
            &[("\"dual\"", "\"cubemap\""), ("\"focal\":0.5,", "")],
            Named("b dual"),
            Refused(&["`cubemap`"]),
        ),
    ];
    for (file, edits, part, expected) in cases {
        check_case(file, edits, part, &expected);
    }
}

/// The keys in backquotes of a message as a YAML file.
fn advised(message: &str, size_px: [u32; 2]) -> String {
    let [width, height] = size_px;
    let mut text = format!("image_width: {width}\nimage_height: {height}\n");
    for advice in message.split('`').skip(1).step_by(2).filter(|part| part.contains(": [")) {
        text += advice;
        text.push('\n');
    }
    text
}

/// Advice is followed to the letter, and gives the camera.
#[test]
fn advice_works() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        import_part(&path, Only, None).unwrap().0.remove(0)
    };
    let message = |file: &str| import_part(&edited(folder.path(), file, &[]), Only, None).unwrap_err();

    let zed = read("zed.yaml", &advised(&message("31-ini-as-yaml/C13_zed.conf"), [1920, 1080]));
    assert_eq!((zed.focal_px, zed.principal_point_px), ([1401.64; 2], Some([971.93, 552.906])));
    assert_eq!(zed.lens.coefficients[..2], [-0.174_318, 0.026_112_1]);

    let text = message("31-ini-as-yaml/C30_pix4d.cam");
    let number = |key: &str| -> f64 {
        let (_, rest) = text.split_once(&format!("{key} = ")).unwrap();
        4864.0 * rest.split(' ').next().unwrap().parse::<f64>().unwrap()
    };
    let (f, cx, cy) = (number("f"), number("cx") - 0.5, number("cy") - 0.5);
    let yaml = format!(
        "{}camera_matrix: [{f}, 0, {cx}, 0, {f}, {cy}, 0, 0, 1]\n",
        advised(&text, [4864, 3648]).replace("camera_matrix: [f, 0, cx, 0, f, cy, 0, 0, 1]\n", "",)
    );
    let pix4d = read("pix4d.yaml", &yaml);
    // 8.8012 mm on a sensor of 13.2 mm, with pixels from the corner.
    assert!((pix4d.focal_px[0] - 8.8012 / 13.2 * 4864.0).abs() < 0.01, "{pix4d:?}");
    assert!((pix4d.principal_point_px.unwrap()[1] - (4.4311 / 13.2 * 4864.0 - 0.5)).abs() < 0.01);
    assert_eq!(pix4d.lens.coefficients, [0.0021, -0.0095, -0.0004, 0.0003, 0.0088]);

    let keys = advised(&message("35-radial-and-tangential-keys/C17c_radialtangential.json"), [640, 480]);
    let matrix = "camera_matrix: [[612.4, 0, 318.7], [0, 612.1, 243.9], [0, 0, 1]]\n";
    assert_eq!(read("keys.yaml", &(keys + matrix)).lens.coefficients, [-0.25, 0.06, 0.001, -0.0004]);

    let kitti = folder.path().join("calib.txt");
    std::fs::write(&kitti, "P0: 7e2 0 6e2 0 0 7e2 2e2 0 0 0 1 0\nP1: 7e2 0 6e2 -3 0 7e2 2e2 0 0 0 1 0\n")
        .unwrap();
    let straight = read("kitti.yaml", &advised(&import_part(&kitti, Only, None).unwrap_err(), [1242, 375]));
    assert_eq!((straight.focal_px, straight.principal_point_px), ([700.0; 2], Some([600.0, 200.0])));
    assert_eq!(straight.lens.model, LensModel::Pinhole);

    let panorama = folder.path().join("panorama.toml");
    std::fs::write(
        &panorama,
        "size_px = [5760, 2880]\nfocal_px = [916.732, 916.732]\nlens.model = \"equirectangular\"\n",
    )
    .unwrap();
    assert_eq!(read_camera_toml(&panorama).unwrap().lens.model, LensModel::Equirectangular);

    // NeRF's synthetic scenes state an angle alone.
    let nerf = folder.path().join("transforms_train.json");
    std::fs::write(
        &nerf,
        r#"{"camera_angle_x": 0.6911, "frames": [{"file_path": "r_0", "rotation": 0.01}]}"#,
    )
    .unwrap();
    assert!(import_part(&nerf, Only, None).unwrap_err().contains("--size"));
    let (cameras, notes) = import_part(&nerf, Only, Some([800, 800])).unwrap();
    assert!((cameras[0].focal_px[0] - 400.0 / 0.34555_f64.tan()).abs() < 1e-9);
    assert_eq!(cameras[0].principal_point_px, Some([399.5; 2]));
    assert!(notes.iter().all(|note| !note.contains("unknown")), "{notes:?}");
}
