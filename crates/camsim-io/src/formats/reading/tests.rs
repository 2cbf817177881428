#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::PathBuf;

use camsim_core::scenario::{FieldOr, LensModel, Readout};

use super::*;

fn write_file(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

fn import(name: &str, text: &str) -> Result<ImportedCamera, CameraFileError> {
    let (_folder, path) = write_file(name, text);
    import_camera_as(&path, None)
}

fn import_named(name: &str, text: &str, camera: &str) -> Result<ImportedCamera, CameraFileError> {
    let (_folder, path) = write_file(name, text);
    import_camera_named(&path, None, Some(camera))
}

fn toml(text: &str) -> Result<CameraSpec, CameraFileError> {
    let (_folder, path) = write_file("camera.toml", text);
    read_camera_toml(&path)
}

const EUROC_CHAIN: &str = "cam0:
  T_cam_imu:
    - [1.0, 0.0, 0.0, 0.0]
  camera_model: pinhole
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
  resolution: [752, 480]
cam1:
  intrinsics: [1, 1, 1, 1]
";

#[test]
fn camera_toml_has_the_keys_of_camera_at_its_root() {
    let spec = toml(
        "size_px = [100, 80]\nfocal_px = [90.0, 91.0]\n[lens]\nmodel = \"brown-conrady\"\ncoefficients = \
         [-0.1]\n",
    )
    .unwrap();
    assert_eq!((spec.size_px, spec.lens.coefficients), ([100, 80], vec![-0.1]));
    let error = toml("size_px = [100, 80]\nfocal_pix = [90.0, 91.0]\n").unwrap_err().to_string();
    assert!(error.contains("camera.toml:2") && error.contains("did you mean `focal_px`"), "{error}");
    let error = toml("[shutter]\nread_out = \"top-to-bottom\"\n").unwrap_err().to_string();
    assert!(error.contains("did you mean `readout`"), "{error}");
    let error = toml("[shutter]\nline_delay_us = 30\n").unwrap_err().to_string();
    assert!(error.contains("did you mean `readout_ms`"), "{error}");
    assert!(toml("focal_px = [0.0, 1.0]").unwrap_err().to_string().contains("focal_px"));
    assert!(toml("[lens]\nmodel = \"fisheye\"").unwrap_err().to_string().contains("kannala-brandt"));
    let missing = read_camera_toml(Path::new("/no/such/camera.toml")).unwrap_err();
    assert!(matches!(missing, CameraFileError::Read { .. }));
}

/// Two cameras of a chain, of which only the first has a pose to the IMU: the second's is that times the step.
#[test]
fn a_kalibr_chain_goes_on_from_the_camera_with_a_pose() {
    let camera = "  camera_model: pinhole\n  distortion_model: equidistant\n  resolution: [512, 512]\n  \
                  intrinsics: [190.9, 190.9, 254.9, 256.8]\n  distortion_coeffs: [0, 0, 0, 0]\n";
    let pose = |key: &str, [x, y, z]: [f64; 3]| {
        format!("  {key}: [[1, 0, 0, {x}], [0, 1, 0, {y}], [0, 0, 1, {z}], [0, 0, 0, 1]]\n")
    };
    let first = format!("cam0:\n{camera}{}", pose("T_cam_imu", [0.03, 0.01, 0.02]));
    let step = pose("T_cn_cnm1", [-0.11, 0.0, 0.0]);
    let own = pose("T_cam_imu", [-0.08, 0.01, 0.02]);
    let imported = |second: &str| {
        let text = format!("{first}cam1:\n{camera}{second}");
        let (_folder, path) = write_file("camchain.yaml", &text);
        let body = Some(BodyAxes::Flu);
        let options = ImportOptions { camera: Some("cam1"), body, ..ImportOptions::default() };
        import_camera_with(&path, &options).unwrap().spec.mount
    };
    let (by_step, by_own) = (imported(&step), imported(&own));
    for i in 0..3 {
        assert!((by_step.offset_m[i] - by_own.offset_m[i]).abs() < 1e-12, "{by_step:?} {by_own:?}");
    }
    assert_eq!(by_step.angles_deg, by_own.angles_deg);
    assert!((by_own.offset_m[0] - 0.08).abs() < 1e-12, "{by_own:?}");
}

#[test]
fn kalibr_and_euroc_are_imported() {
    // Of several cameras none is guessed.
    let which = import("chain.yaml", EUROC_CHAIN).unwrap_err().to_string();
    assert!(which.contains("there are 2 (`cam0`, `cam1`)") && which.contains("`--camera cam0`"), "{which}");
    let imported = import_named("chain.yaml", EUROC_CHAIN, "cam0").unwrap();
    assert_eq!(imported.format, CameraFormat::Kalibr);
    let other = import_named("chain.yaml", EUROC_CHAIN, "cam2").unwrap_err().to_string();
    assert!(other.contains("there is no `cam2`; the names are `cam0`, `cam1`"), "{other}");
    assert_eq!(imported.spec.size_px, [752, 480]);
    assert_eq!(imported.spec.principal_point_px, Some([367.215, 248.375]));
    assert_eq!(imported.spec.lens.coefficients, [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]);
    let sensor = "sensor_type: camera\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\n\
        intrinsics: [458.654, 457.296, 367.215, 248.375]\ndistortion_model: radial-tangential\n\
        distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n";
    let euroc = import("sensor.yaml", sensor).unwrap();
    assert_eq!((euroc.format, euroc.spec.fps), (CameraFormat::Euroc, 20.0));
    assert_eq!(euroc.spec.lens, imported.spec.lens);
    let fisheye = import_named("chain.yaml", &EUROC_CHAIN.replace("radtan", "equidistant"), "cam0").unwrap();
    assert_eq!(fisheye.spec.lens.model, LensModel::KannalaBrandt);
    let error =
        import_named("chain.yaml", &EUROC_CHAIN.replace("pinhole", "omni"), "cam0").unwrap_err().to_string();
    assert!(error.contains("cam0.intrinsics: has 4 parameters where `omni`"), "{error}");
    let error =
        import_named("chain.yaml", &EUROC_CHAIN.replace("458.654, ", ""), "cam0").unwrap_err().to_string();
    assert!(error.contains("cam0.intrinsics: has 3 numbers"), "{error}");
}

#[test]
fn ros_and_opencv_are_distinguished() {
    let body = "image_width: 410\nimage_height: 308\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
        data: [322.07, 0, 199.27, 0, 320.87, 155.25, 0, 0, 1]\n\
        distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.16, -0.27, 0.001, -0.0017, 0]\n";
    let ros = import("info.yaml", &format!("{body}distortion_model: plumb_bob\n")).unwrap();
    assert_eq!(ros.format, CameraFormat::RosCameraInfo);
    let tagged = body.replace("camera_matrix:", "camera_matrix: !!opencv-matrix");
    let opencv = import("out.yml", &format!("%YAML:1.0\n---\n{tagged}")).unwrap();
    assert_eq!(opencv.format, CameraFormat::OpenCv);
    assert_eq!(opencv.spec, ros.spec);
    assert_eq!(opencv.spec.lens.coefficients, [0.16, -0.27, 0.001, -0.0017]);
    let four = body.replace("cols: 5", "cols: 4").replace(", 0]", "]");
    let fisheye = import("out.yml", &format!("{four}fisheye_model: 1\n")).unwrap();
    assert_eq!(fisheye.spec.lens.model, LensModel::KannalaBrandt);
    let short = import("out.yml", &body.replace("cols: 5", "cols: 4")).unwrap_err().to_string();
    assert!(short.contains("distortion_coefficients: has 5 numbers where rows x cols = 1 x 4"), "{short}");
    let sizeless = import("out.yml", &body.replace("image_width: 410\n", "")).unwrap_err().to_string();
    assert!(sizeless.contains("image_width"), "{sizeless}");
    let skewed = import("out.yml", &body.replace("[322.07, 0,", "[322.07, 0.5,")).unwrap_err().to_string();
    assert!(skewed.contains("skew of 0.5"), "{skewed}");
}

#[test]
fn opencv_xml_is_imported() {
    let xml = r#"<?xml version="1.0"?>
<opencv_storage>
<image_Width>640</image_Width><image_Height>480</image_Height>
<Camera_Matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
<data>6.5e+02 0. 3.2e+02 0. 6.6e+02 2.4e+02 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix"><rows>14</rows><cols>1</cols><dt>d</dt>
<data>0.1 -0.2 1e-3 2e-3 0.3 0.4 0.5 0.6 0. 0. 0. 0. 0. 0.</data></Distortion_Coefficients>
</opencv_storage>"#;
    let imported = import("camera.xml", xml).unwrap();
    assert_eq!(imported.spec.focal_px, [650.0, 660.0]);
    assert_eq!(imported.spec.lens.coefficients, [0.1, -0.2, 1e-3, 2e-3, 0.3, 0.4, 0.5, 0.6]);
    let prism = import("camera.xml", &xml.replace("0.6 0. 0.", "0.6 0. 0.01")).unwrap().spec.lens;
    assert_eq!((prism.model, prism.coefficients.len()), (LensModel::BrownConradyPrism, 14));
    assert_eq!(prism.coefficients[8..10], [0.0, 0.01]);
}

#[test]
fn reference_program_pixels_are_shifted_by_half_a_pixel() {
    let xml = r#"<simParams>
        <idealParams0 width="1" height="1" f="1"/>
        <idealParams resolutionScale="1." width="640" height="480" oxOffset="-14.401" oyOffset="-13.264"
            f="307.6075" />
        <staticParams k1="-0.390024" k2="0.111124" t1="-0.0012744" t2="-0.0081517" k3="-0.00842763"
            k4="0.000000" />
        <vignetParams vignetFile="vignet-S3LowOffset.bmp" vignetThresh1="0.05" vignetThresh2="0.5" />
        <camInAcEu roll="84.0" pitch="-20.0" yaw="0."/>
        <sensorParams cameraFps="30." phasePercent="0.8"/>
        <dynamicParams td="0.01" tr="0.033" te="6.875e-05" motionBlurExtraSamples="5" ti="0.02"/>
    </simParams>"#;
    let spec = import("s3.xml", xml).unwrap().spec;
    let [cx, cy] = spec.principal_point_px.unwrap();
    assert!((cx - 305.099).abs() < 1e-9 && (cy - 226.236).abs() < 1e-9);
    assert_eq!(spec.lens.coefficients, [-0.390024, 0.111124, -0.0012744, -0.0081517, -0.00842763]);
    assert_eq!((spec.mount.angles_deg, spec.phase, spec.fps), ([84.0, -20.0, 0.0], 0.8, 30.0));
    assert!((spec.shutter.delay_ms - 10.0).abs() < 1e-9 && (spec.shutter.readout_ms - 33.0).abs() < 1e-9);
    assert!(matches!(spec.shutter.interlace_ms, FieldOr::Ms(ms) if (ms - 20.0).abs() < 1e-9));
    assert_eq!(spec.photometric.vignette, Some(PathBuf::from("vignet-S3LowOffset.bmp")));
    // A field of view of 70 degrees over 640 px, scaled by one half.
    let fov = import(
        "ideal.xml",
        r#"<simParams><idealParams resolutionScale="0.5" width="640" height="480" fovX="70."/></simParams>"#,
    )
    .unwrap();
    assert_eq!((fov.spec.size_px, fov.spec.principal_point_px), ([320, 240], Some([159.5, 119.5])));
    assert!((fov.spec.focal_px[1] - 160.0 / 35.0_f64.to_radians().tan()).abs() < 1e-9);
    assert_eq!(fov.spec.lens.model, LensModel::Pinhole);
    let run = import("run.xml", r#"<simParams><includeParams includeFile="a.xml"/></simParams>"#)
        .unwrap_err()
        .to_string();
    assert!(run.contains("idealParams"), "{run}");
}

#[test]
fn both_agisoft_dialects_are_imported() {
    let metashape = "<calibration><projection>frame</projection><width>2256</width><height>1504</height>\
        <f>1940.5</f><cx>13.25</cx><cy>9.75</cy><k1>-0.1</k1><k2>0.18</k2><k3>-0.06</k3><p1>0.002</p1>\
        <p2>0.0005</p2></calibration>";
    let spec = import("m.xml", metashape).unwrap().spec;
    assert_eq!(spec.principal_point_px, Some([1128.0 + 13.25 - 0.5, 752.0 + 9.75 - 0.5]));
    assert_eq!(spec.lens.coefficients, [-0.1, 0.18, 0.0005, 0.002, -0.06]);
    let lens = "<calibration><projection>frame</projection><width>640</width><height>480</height>\
        <fx>307</fx><fy>308</fy><cx>305.599</cx><cy>226.736</cy><k1>-0.39</k1><p1>-0.001</p1><p2>-0.008</p2>\
        </calibration>";
    let spec = import("l.xml", lens).unwrap().spec;
    assert_eq!((spec.focal_px, spec.lens.coefficients), ([307.0, 308.0], vec![-0.39, 0.0, -0.001, -0.008]));
    let k4 = import("m.xml", &metashape.replace("<p1>", "<k4>0.1</k4><p1>")).unwrap_err().to_string();
    assert!(k4.contains("k4"), "{k4}");
}

#[test]
fn gyroflow_readout_is_imported() {
    let json = r#"{"calib_dimension": {"w": 2704, "h": 2028}, "frame_readout_time": -11.5, "fps": 29.97,
        "digital_lens": null,
        "fisheye_params": {"camera_matrix": [[1340.9, 0.0, 1353.5], [0.0, 1345.0, 1022.9], [0.0, 0.0, 1.0]],
        "distortion_coeffs": [0.041, 0.027, -0.015, 0.002]}}"#;
    let spec = import("p.json", json).unwrap().spec;
    assert_eq!((spec.lens.model, spec.fps), (LensModel::KannalaBrandt, 29.97));
    assert_eq!((spec.shutter.readout_ms, spec.shutter.readout), (11.5, Readout::BottomToTop));
    let bent = import("p.json", &json.replace("null", "\"gopro_superview\"")).unwrap_err().to_string();
    assert!(bent.contains("gopro_superview"), "{bent}");
}

#[test]
fn files_without_camera_are_refused() {
    for (name, text) in [
        ("empty.yaml", ""),
        ("list.yaml", "- 1\n- 2\n"),
        ("other.xml", "<gpx><trk/></gpx>"),
        ("broken.xml", "<simParams><idealParams"),
        ("broken.json", "{\"a\": "),
        ("broken.yaml", "a: [1, 2\nb: }"),
        ("mei.yaml", "%YAML:1.0\n---\nmodel_type: MEI\nimage_width: 752\nmirror_parameters:\n   xi: 1.8\n"),
        (
            "nan.yaml",
            "cam0:\n  camera_model: pinhole\n  distortion_model: none\n  intrinsics: [.nan, 1, 1, 1]\n  \
             resolution: [4, 4]\n",
        ),
        (
            "zero.yaml",
            "cam0:\n  camera_model: pinhole\n  distortion_model: none\n  intrinsics: [0, 1, 1, 1]\n  \
             resolution: [4, 4]\n",
        ),
        (
            "size.yaml",
            "cam0:\n  camera_model: pinhole\n  distortion_model: none\n  intrinsics: [1, 1, 1, 1]\n  \
             resolution: [-4, 4.5]\n",
        ),
    ] {
        let error = import(name, text).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
    let deep = format!("{}{}", "<a>".repeat(20_000), "</a>".repeat(20_000));
    assert!(import("deep.xml", &deep).is_err());
}

#[test]
fn camodocal_is_imported() {
    let pinhole = "%YAML:1.0\n---\nmodel_type: PINHOLE\ncamera_name: camera\nimage_width: 752\nimage_height: \
                   480\ndistortion_parameters:\n   k1: -0.295\n   k2: 0.0866\n   p1: 2.0e-06\n   p2: \
                   1.4e-05\nprojection_parameters:\n   fx: 461.1\n   fy: 459.7\n   cx: 362.6\n   cy: 248.5\n";
    let imported = import("cam0_pinhole.yaml", pinhole).unwrap();
    assert_eq!(imported.format, CameraFormat::Camodocal);
    let spec = &imported.spec;
    assert_eq!(
        (spec.size_px, spec.focal_px, spec.principal_point_px),
        ([752, 480], [461.1, 459.7], Some([362.6, 248.5]))
    );
    assert_eq!(
        (spec.lens.model, spec.lens.coefficients.as_slice()),
        (LensModel::BrownConrady, &[-0.295, 0.0866, 2e-6, 1.4e-5][..])
    );
    // TUM VI's first camera in VINS's file has the numbers of the data set's Kalibr file (equidistant).
    let fisheye = "%YAML:1.0\nimu_topic: \"/imu0\"\nmodel_type: KANNALA_BRANDT\nimage_width: \
                   512\nimage_height: 512\nprojection_parameters:\n   k2: 0.0034823894022493434\n   k3: \
                   0.0007150348452162257\n   k4: -0.0020532361418706202\n   k5: 0.00020293673591811182\n   \
                   mu: 190.97847715128717\n   mv: 190.9733070521226\n   u0: 254.93170605935475\n   v0: \
                   256.8974428996504\nextrinsicRotation: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: \
                   d\n   data: [ 0, 0, -1 ]\n";
    let kalibr = "cam0:\n  camera_model: pinhole\n  distortion_model: equidistant\n  resolution: [512, \
                  512]\n  distortion_coeffs: [0.0034823894022493434, 0.0007150348452162257, \
                  -0.0020532361418706202, 0.00020293673591811182]\n  intrinsics: [190.97847715128717, \
                  190.9733070521226, 254.93170605935475, 256.8974428996504]\n";
    assert_eq!(
        import("tum_config.yaml", fisheye).unwrap().spec,
        import("camchain.yaml", kalibr).unwrap().spec
    );
    for (name, from, to, expected) in [
        ("mirror", "PINHOLE", "MEI", "mirror_parameters.xi: is missing"),
        ("polynomial", "PINHOLE", "SCARAMUZZA", "model_type: is `SCARAMUZZA` (OCamCalib's polynomial)"),
        ("missing", "   fx: 461.1\n", "", "projection_parameters.fx: is missing"),
        ("no size", "image_width: 752\n", "", "image_width: is missing"),
        ("not a number", "k1: -0.295", "k1: nan", "distortion_parameters.k1"),
    ] {
        let error = import("cam.yaml", &pinhole.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(expected), "{name}: {error}");
    }
}

mod documentation;
