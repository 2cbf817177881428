#![allow(clippy::unwrap_used, reason = "tests")]

use camsim_core::imaging::KernelFile;
use camsim_core::lens::LensTable;
use camsim_core::scenario::{
    Auto, AutoExposureSpec, BarometerSpec, Beyond, Binning, BoardKind, BoardSpec, BurstOver, CameraSpec,
    Channel, ChromaticSpec, Dictionary, FieldOr, FilesOfSpec, FlowInstant, GnssSpec, HeightUnit,
    ImageCircleSpec, ImageSensorSpec, ImuSpec, LensModel, LoopKind, MagnetometerSpec, MotionSpec, ObjectsOf,
    OutputSpec, PerChannel, PointSpreadSpec, PrimaryLensSpec, QualitySpec, Readout, Reset, ResizedSpec,
    SensorModel, SpinSpec, StampedBy, TimingSpec, TrackerSpec, TrajectorySpan, TwinShutter, TwinSpec,
    VignettingSpec,
};

use super::{schema::KEYS, *};

mod sensors;

const GOOD: &str = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n";

fn parse(text: &str) -> Result<Scenario, ScenarioError> {
    parse_scenario(text, Path::new("dir/s.toml"), &[])
}

fn with(sets: &[(&str, &str)]) -> Result<Scenario, ScenarioError> {
    let sets: Vec<_> = sets.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    parse_scenario(GOOD, Path::new("dir/s.toml"), &sets)
}

#[test]
fn printed_default_has_the_default_values() {
    let scenario = parse(&print_default()).unwrap();
    assert_eq!(scenario.seed, 0);
    assert_eq!(scenario.flight.speed, 1.0);
    assert_eq!(scenario.tracker, TrackerSpec::default());
    assert_eq!(scenario.camera, CameraSpec::default());
    assert_eq!(scenario.quality, QualitySpec::default());
    assert_eq!(scenario.output, OutputSpec::default());
}

#[test]
fn every_word_of_the_schema_deserialises() {
    for (key, kind) in KEYS {
        let of_lists =
            ["camera.mount.vibration.", "camera.zoom.", "scene.board.", "scene.gltf.", "output.twin."];
        let of_sensors = ["imu.", "gnss.", "barometer.", "magnetometer."];
        if of_lists.iter().chain(&of_sensors).any(|table| key.starts_with(table)) {
            continue;
        }
        let values: Vec<String> = match kind {
            schema::ValueKind::Word(words)
            | schema::ValueKind::NumberOr(words)
            | schema::ValueKind::CountOr(_, words) => words.iter().map(|w| (*w).into()).collect(),
            schema::ValueKind::Words(words) => words.iter().map(|w| format!("[\"{w}\"]")).collect(),
            schema::ValueKind::NumbersOr(_, word) => vec![(*word).into(), "[1.0, 2.0, 3.0]".into()],
            _ => continue,
        };
        for value in values {
            let text = print_default().replace("# pattern", "pattern");
            let mut sets = vec![((*key).to_owned(), value.clone())];
            let needs = needs_of_sensor(key, &value);
            sets.extend(needs.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())));
            match parse_scenario(&text, Path::new("s.toml"), &sets) {
                Ok(_) => {}
                // These need more keys.
                Err(error) => {
                    assert!(["paper", "table"].contains(&value.as_str()), "{key} = {value}: {error}")
                }
            }
        }
    }
}

/// Other keys that a word of the image sensor or of its exposure needs.
fn needs_of_sensor(key: &str, value: &str) -> Vec<(&'static str, &'static str)> {
    let points = "[[0, 0], [0.2, 0.5], [1, 1]]";
    let mut needs = Vec::new();
    if key.starts_with("camera.sensor.") || value == "[\"raw\"]" {
        needs.push(("camera.sensor.white_e", "5000"));
    }
    if key.starts_with("camera.auto_exposure.") {
        needs.push(("camera.shutter.exposure_ms", "4"));
    }
    match (key, value) {
        ("camera.sensor.companding", "piecewise") => needs.push(("camera.sensor.companding_points", points)),
        ("camera.shutter.reset", "global") => needs.push(("camera.shutter.exposure_ms", "4")),
        ("camera.timing.late_stamp", "actual") => needs.push(("camera.timing.late_ms", "1")),
        ("camera.timing.stamped_by", "trigger") => needs.push(("camera.timing.trigger", "wire")),
        ("camera.sensor.response", "table") => needs.push(("camera.sensor.response_points", points)),
        _ => {}
    }
    if key == "camera.sensor.response" {
        needs.push(("camera.photometric.output", "linear8"));
    }
    needs
}

#[test]
fn every_key_of_the_structs_is_in_the_schema() {
    let mut text = print_default();
    for commented in [
        "window_s",
        "principal_point_px",
        "zoom_track",
        "vignette",
        "pattern",
        "board",
        "gltf",
        "fog_visibility_m",
        "light",
        "tracks",
    ] {
        // The first: a table that is commented out further below may have a key of that name.
        text = text.replacen(&format!("# {commented} = "), &format!("{commented} = "), 1);
    }
    text += "[[camera.zoom]]\nat = 1\nfocal_px = [1, 1]\nprincipal_point_px = [0, 0]\n";
    text += "[[camera.mount.vibration]]\naxis = \"roll\"\nhz = 3\n";
    let mut scenario = parse(&text).unwrap();
    let terrain = scenario.scene.terrain.as_mut().unwrap();
    (terrain.epsg, terrain.height_unit, terrain.ortho_white) =
        (Some(32632), Some(HeightUnit::UsFt), Some(2047.0));
    terrain.beyond = Beyond::Edge;
    assert_eq!(
        scenario.scene.board,
        Some(BoardSpec { kind: Some(BoardKind::Chessboard), ..board(9, 6, 0.05) })
    );
    let saved = toml::to_string(&scenario).unwrap();
    assert_eq!(
        parse_scenario(&saved, Path::new("s.toml"), &[]).unwrap(),
        scenario,
        "a saved scenario reads back"
    );
    (scenario.camera.name, scenario.camera.clock_offset_ms) = ("left".into(), 0.5);
    scenario.camera.lens_table = Some(LensTable { path: "lens.csv".into(), grid: None });
    scenario.camera.auto_exposure =
        Some(AutoExposureSpec { nominal_ms: Some(4.0), ..AutoExposureSpec::default() });
    scenario.scene.sky_brightness = Some(2.0);
    scenario.flight.topic = Some("/odom".into());
    scenario.output.twin = vec![TwinSpec {
        name: "sharp".into(),
        exposure: Some(false),
        shutter: Some(TwinShutter::Global),
        instant: Some(FlowInstant::LastRow),
        lens: Some(false),
        noise: Some(false),
        vignette: Some(false),
        ideal: true,
        instants: Some(3),
        over: Some(BurstOver::Readout),
        channels: Some(vec![Channel::Color]),
        point_spread: Some(false),
    }];
    scenario.scene.board = Some(BoardSpec {
        target: Some("target.yaml".into()),
        kind: Some(BoardKind::Charuco),
        row_size_m: Some(1.0),
        diameter_m: Some(1.0),
        spacing: Some(1.0),
        marker_m: Some(1.0),
        dictionary: Some(Dictionary::SixBySix),
        first_id: Some(1),
        margin_m: Some(1.0),
        geodetic: Some([47.0, 8.0, 400.0]),
        name: Some("target".into()),
        class: Some(9),
        ..board(1, 1, 1.0)
    });
    scenario.output.palette = true;
    scenario.output.trajectory = TrajectorySpan::Flight;
    scenario.output.video.bits = 10;
    if let Some(light) = &mut scenario.scene.light {
        light.shadows = true;
    }
    scenario.output.raw_format = camsim_core::scenario::RawFormat::Tiff;
    scenario.camera.sensor = Some(full_sensor());
    scenario.camera.point_spread = Some(full_point_spread());
    let shutter = &mut scenario.camera.shutter;
    (shutter.line_time_us, shutter.reset, shutter.allow_overlap) = (Some(20.0), Reset::Global, true);
    scenario.camera.timing = Some(TimingSpec {
        drop: vec![1],
        double: vec![2],
        trigger: Some("wire".into()),
        miss: vec![3],
        miss_probability: 0.1,
        stamped_by: StampedBy::Trigger,
        ..TimingSpec::default()
    });
    full_optics(&mut scenario.camera);
    scenario.output.datasets = vec![camsim_core::scenario::DatasetFormat::CarlaRs];
    scenario.output.channels.push(camsim_core::scenario::Channel::Object);
    let terrain = scenario.scene.terrain.as_mut().unwrap();
    (terrain.name, terrain.class) = (Some("ground".into()), Some(2));
    let pattern = scenario.scene.pattern.as_mut().unwrap();
    (pattern.name, pattern.class, pattern.repeat) = (Some("marks".into()), Some(3), true);
    let model = &mut scenario.scene.gltf[0];
    (model.name, model.class, model.objects) = (Some("house".into()), Some(7), ObjectsOf::Node);
    model.classes = [("roof".to_owned(), 8)].into();
    (model.placements, model.geodetic) = (Some("a.csv".into()), Some([47.0, 8.0, 400.0]));
    (model.scene, model.time_s, model.animation) = (Some(1), Some(2.0), Some(3));
    model.motion = Some(MotionSpec {
        poses: Some("poses.csv".into()),
        path: vec![[0.0, 1.0, 2.0]; 2],
        speed_m_s: Some(1.0),
        start_s: Some(1.0),
        repeat: Some(LoopKind::BackAndForth),
        orient: Some(true),
        spin: vec![SpinSpec { axis: [1.0; 3], hz: 1.0, phase_deg: 1.0, node: Some("a".into()) }],
        animate: true,
    });
    scenario.imu = vec![ImuSpec { name: "imu0".into(), ..ImuSpec::default() }];
    scenario.gnss = vec![GnssSpec { dropouts_s: vec![[1.0, 2.0]], ..GnssSpec::default() }];
    scenario.barometer = vec![BarometerSpec::default()];
    scenario.magnetometer = vec![MagnetometerSpec {
        field_ned_ut: Some([20.0, 1.0, 43.0]),
        date: Some("2026-11-27".into()),
        ..MagnetometerSpec::default()
    }];
    let saved = toml::to_string(&scenario).unwrap();
    let mut visited = Vec::new();
    collect(&toml::from_str(&saved).unwrap(), "", &mut visited);
    for (key, _) in KEYS {
        assert!(visited.iter().any(|s| s == key), "{key} stands in the schema but not in the struct");
    }
}

/// Every key of chromatic lenses, image circle and vignetting has a value.
fn full_optics(camera: &mut CameraSpec) {
    let lens = Some(PrimaryLensSpec {
        focal_px: Some([1.0; 2]),
        principal_point_px: Some([1.0; 2]),
        model: Some(LensModel::Fov),
        coefficients: Some(vec![0.9]),
    });
    let scale = || vec![1.0, 0.0, 0.1];
    camera.chromatic =
        Some(ChromaticSpec { red_scale: scale(), blue_scale: scale(), red: lens.clone(), blue: lens });
    camera.image_circle =
        Some(ImageCircleSpec { radius_px: Some(1.0), centre_px: Some([1.0; 2]), half_angle_deg: Some(1.0) });
    camera.resized = Some(ResizedSpec {
        crop_px: Some([0, 0, 4, 4]),
        binning: Some(Binning::Both(2.0)),
        scale: Some(0.5),
        size_px: Some([2, 2]),
    });
    camera.files_of = Some(FilesOfSpec {
        size_px: [4; 2],
        focal_px: [1.0; 2],
        principal_point_px: [1.0; 2],
        part_px: [0.0, 0.0, 2.0, 2.0],
    });
    camera.photometric.vignetting = Some(VignettingSpec {
        cos_power: 4.0,
        polynomial: scale(),
        polynomial_red: Some(scale()),
        polynomial_blue: Some(scale()),
    });
}

/// Every key has a value.
fn full_sensor() -> ImageSensorSpec {
    ImageSensorSpec {
        model: Some(SensorModel::Imx250),
        white_e: Some(1.0),
        white_lux: Some(1.0),
        white_w_m2: Some(1.0),
        exposure_ms: Some(1.0),
        f_number: Some(1.0),
        pixel_um: Some(1.0),
        quantum_efficiency: Some(PerChannel::Each(vec![0.4, 0.6, 0.5])),
        dark_current_e_s: Some(1.0),
        read_noise_e: Some(1.0),
        dsnu_e: Some(1.0),
        prnu: Some(1.0),
        full_well_e: Some(1.0),
        gain_e_per_dn: Some(1.0),
        adc_bits: Some(12),
        bits: Some(12),
        companding_points: vec![[0.0, 0.0], [1.0, 1.0]],
        white_balance: Some([1.0; 3]),
        color_matrix: Some([1.0; 9]),
        response_points: vec![[0.0, 0.0], [1.0, 1.0]],
        flicker: Some(camsim_core::scenario::FlickerSpec::default()),
        ..ImageSensorSpec::default()
    }
}

/// Every key has a value.
fn full_point_spread() -> PointSpreadSpec {
    PointSpreadSpec {
        sigma_px: Some(1.0),
        f_number: Some(8.0),
        pixel_um: Some(3.0),
        defocus_px: Some(1.0),
        kernel: Some(KernelFile { path: "kernel.png".into(), kernel: None }),
        ..PointSpreadSpec::default()
    }
}

#[test]
fn twins_are_read_and_their_problems_named_by_line() {
    let with =
        |twin: &str| parse(&format!("{GOOD}[camera.shutter]\nexposure_ms = 8\n[[output.twin]]\n{twin}\n"));
    let scenario = with("name = \"burst\"\ninstants = 9\nchannels = [\"color\", \"flow_global\"]").unwrap();
    let [twin] = scenario.output.twin.as_slice() else { panic!("one twin") };
    assert_eq!((twin.name.as_str(), twin.instants), ("burst", Some(9)));
    assert_eq!(twin.channels, Some(vec![Channel::Color, Channel::FlowGlobal]));
    for (twin, wanted) in [
        ("exposure = false", "output.twin.0.name: is missing"),
        ("name = \"a\"\nexposre = false", "s.toml:10: output.twin.0.exposre: unknown key; did you mean"),
        ("name = \"a\"\nshutter = \"globl\"", "s.toml:10: output.twin.0.shutter: expected one of \"global\""),
        ("name = \"a/b\"\nlens = false", "s.toml:9: output.twin.0.name: is the name of a folder"),
        (
            "name = \"a\"\ninstant = \"last-row\"\nlens = false",
            "s.toml:10: output.twin.0.instant: is that of",
        ),
    ] {
        let error = with(twin).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

fn board(columns: u32, rows: u32, size_m: f64) -> BoardSpec {
    let count = (Some(columns), Some(rows));
    BoardSpec {
        columns: count.0,
        rows: count.1,
        size_m: Some(size_m),
        angles_deg: [0.0, 90.0, 0.0],
        ..BoardSpec::default()
    }
}

#[test]
fn keys_of_boards_are_checked_by_kind() {
    let text = |keys: &str| format!("[flight]\nlog = \"a.csv\"\n[scene.board]\n{keys}\n");
    for kind in ["chessboard", "circles", "asymmetric-circles", "aprilgrid", "charuco"] {
        parse(&text(&format!("kind = \"{kind}\"\ncolumns = 5\nrows = 4\nsize_m = 0.1"))).unwrap();
    }
    for word in ["4x4", "5x5", "6x6"] {
        parse(&text(&format!(
            "kind = \"charuco\"\ncolumns = 5\nrows = 4\nsize_m = 0.1\ndictionary = \"{word}\""
        )))
        .unwrap();
    }
    for (keys, wanted) in [
        ("kind = \"chesboard\"", "did you mean \"chessboard\"?"),
        ("kind = \"charuco\"\ncolumns = 5\nrows = 4", "scene.board.size_m: is missing"),
        (
            "kind = \"circles\"\ncolumns = 5\nrows = 4\nsize_m = 0.1\nmarker_m = 0.1",
            "s.toml:8: scene.board.marker_m: does not belong",
        ),
        ("kind = \"circles\"\ncolumns = 500\nrows = 4\nsize_m = 0.1", "1 to 80"),
    ] {
        let error = parse(&text(keys)).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

fn collect(value: &toml::Table, prefix: &str, visited: &mut Vec<String>) {
    for (name, value) in value {
        let key = tree::join(prefix, name);
        match value {
            toml::Value::Table(table) => collect(table, &key, visited),
            toml::Value::Array(array) => {
                array.iter().filter_map(toml::Value::as_table).for_each(|table| collect(table, &key, visited))
            }
            _ => {}
        }
        visited.push(key);
    }
}

#[test]
fn errors_name_file_line_and_key() {
    let cases: &[(&str, &str)] = &[
        ("[camera]\nfsp = 30", "dir/s.toml:7: camera.fsp: unknown key; did you mean `camera.fps`?"),
        (
            "[camera.shuter]\nreadout_ms = 3",
            "dir/s.toml:6: camera.shuter: unknown key; did you mean `camera.shutter`?",
        ),
        ("[camera]\nreadout_ms = 3", "did you mean `camera.shutter.readout_ms`?"),
        ("[camera]\nexposure_ms = 8", "did you mean `camera.shutter.exposure_ms`?"),
        ("[camera]\ncoefficients = [0.1]", "did you mean `camera.lens.coefficients`?"),
        ("[camera.lens]\nfocal_px = [1, 1]", "did you mean `camera.focal_px`?"),
        ("[camera]\nf_number = 4", "did you mean `camera.sensor.f_number`?"),
        ("[[imu]]\nname = \"a\"\nangles_deg = [1, 2, 3]", "did you mean `imu.mount.angles_deg`?"),
        ("focal_px = [1, 1]", "did you mean `camera.focal_px`?"),
        (
            "[camera.lens]\nmodel = \"eucm\"\ncoefficients = [0.6, -1.0]",
            "dir/s.toml:8: camera.lens.coefficients: has beta = -1; beta must be above 0",
        ),
        ("[quality]\nxyz = 3", "quality.xyz: unknown key; `camsim render --print-default`"),
        (
            "[camera]\nresolution = [640, 480]",
            "camera.resolution: unknown key; did you mean `camera.size_px`?",
        ),
        ("qqqq = 1", "unknown key; `camsim render --print-default`"),
        ("[camera]\nfps = \"thirty\"", "dir/s.toml:7: camera.fps: expected a number, found \"thirty\""),
        (
            "[camera]\nsize_px = [640, -1]",
            "camera.size_px: expected a list of 2 whole numbers up to 32768, found [640, -1]",
        ),
        (
            "[camera]\nsize_px = [640, 99999999999]",
            "dir/s.toml:7: camera.size_px: expected a list of 2 whole numbers up to 32768, found",
        ),
        (
            "[quality]\nblur_samples = 4294967296",
            "dir/s.toml:7: quality.blur_samples: expected a whole number up to 4096 or \"auto\", found \
                4294967296",
        ),
        (
            "[quality]\niterations = 4294967296",
            "dir/s.toml:7: quality.iterations: expected a whole number up to 64 or \"auto\"",
        ),
        (
            "[quality]\nkey_frames = 4294967296",
            "dir/s.toml:7: quality.key_frames: expected a whole number up to 4 or \"auto\"",
        ),
        ("[quality]\nfootprint_taps = 4294967295", "dir/s.toml:7: quality.footprint_taps: must be 1 to 64"),
        (
            "[quality]\nframes_per_ideal = 65",
            "quality.frames_per_ideal: expected a whole number, 1 to 64, found 65",
        ),
        (
            "[quality]\nframes_per_ideal = 0",
            "quality.frames_per_ideal: expected a whole number, 1 to 64, found 0",
        ),
        (
            "[scene.terrain]\ndem = \"d.tif\"\nepsg = 65536",
            "dir/s.toml:8: scene.terrain.epsg: expected a whole number, 0 to 65535",
        ),
        ("[camera.shutter]\nreadout = \"top-to-botom\"", "did you mean \"top-to-bottom\"?"),
        (
            "[camera.shutter]\ninterlace_ms = \"feild\"",
            "expected a number or \"field\", found \"feild\"; did you mean \"field\"?",
        ),
        ("[camera]\nlens = 3", "camera.lens: expected a table, found 3"),
        (
            "[camera.sensor]\ngain = 1",
            "dir/s.toml:7: camera.sensor.gain: unknown key; did you mean `camera.sensor.gain_e_per_dn`?",
        ),
        ("[quality]\nsolver = \"rk3\"", "did you mean \"rk2\"?"),
        ("[quality]\nsolver = \"rk2\"\niterations = 3", "quality.iterations: counts the depth look-ups"),
        (
            "[quality]\npreset = \"paper\"\nsolver = \"linear\"",
            "dir/s.toml:8: quality.solver: is rk2 with quality.preset",
        ),
        ("[output]\nchannels = [\"color\", \"flaw\"]", "did you mean \"flow\"?"),
        ("[camera]\nfps = nan", "dir/s.toml:7: camera.fps: must be a finite number above 0"),
        (
            "[camera]\nmount = { vibration = [{ axis = \"roll\" }] }",
            "camera.mount.vibration.0.hz: is missing",
        ),
        ("[[camera.zoom]]\nat = 1\nfocal_px = [1, 0]", "dir/s.toml:8: camera.zoom.0.focal_px: must be"),
        ("[camera", "dir/s.toml:6: not valid TOML"),
        ("[camera.shutter]\nexposure_ms = 8,0", "; decimals have a point"),
        ("[camera]\ncamera = \"c.toml\"", "`camera` stands outside of all tables: move the line above"),
        ("[camera.lens]\nmodel = \"equidistant\"", "did you mean \"kannala-brandt\"?"),
        ("[camera.lens]\nmodel = \"radtan\"", "did you mean \"brown-conrady\"?"),
        ("[camera.sensor]\nmosaic = \"RGGB\"", "did you mean \"rggb\"?"),
        ("camera = \"no.toml\"", "unknown key"),
    ];
    for (extra, expected) in cases {
        let error = parse(&format!("{GOOD}{extra}\n")).unwrap_err().to_string();
        assert!(error.contains(expected), "{extra}\n  gives {error}\n  not   {expected}");
    }
    let empty = parse("").unwrap_err().to_string();
    assert!(empty.contains("flight.log: is missing") && empty.contains("scene: is missing"), "{empty}");
    assert!(parse("[flight]\nlog = \"a\"\n[scene]\n").unwrap_err().to_string().contains("scene: is empty"));
    assert!(matches!(read_scenario(Path::new("/no/such.toml"), &[], None), Err(ScenarioError::Read { .. })));
}

#[test]
fn set_changes_keys_before_they_are_checked() {
    let scenario = with(&[
        ("camera.shutter.readout_ms", "10"),
        ("camera.shutter.readout", "left-to-right"),
        ("camera.shutter.interlace_ms", "field"),
        ("quality.blur_samples", "8"),
        ("flight.log", "my log.csv"),
        ("output.channels", "[\"depth\"]"),
        ("camera.mount.vibration", "[{ axis = \"roll\", hz = 5 }]"),
        ("camera.mount.vibration.0.hz", "7.5"),
    ])
    .unwrap();
    assert_eq!(scenario.camera.shutter.readout_ms, 10.0);
    assert_eq!(scenario.camera.shutter.readout, Readout::LeftToRight);
    assert_eq!(scenario.camera.shutter.interlace_ms, FieldOr::Field);
    assert_eq!(scenario.quality.blur_samples, Auto::Value(8));
    assert_eq!(scenario.flight.log, Path::new("my log.csv"));
    assert_eq!(scenario.camera.mount.vibration[0].hz, 7.5);
    assert_eq!(scenario.scene.pattern.unwrap().image, Path::new("dir/g.png"));
    let unset =
        with(&[("camera.shutter.readout_ms", "10"), ("camera.shutter", UNSET), ("camera.fps", UNSET)]);
    assert_eq!(unset.unwrap(), with(&[]).unwrap());
    let of_list =
        with(&[("camera.focal_px", "[400, 400]"), ("camera.focal_px.0", UNSET)]).unwrap_err().to_string();
    assert_eq!(of_list, "--set camera.focal_px.0=(left out): is an element of a list; give the whole list");
    for (key, value, expected) in [
        ("camera.fsp", "3", "--set camera.fsp=3: camera.fsp: unknown key; did you mean `camera.fps`?"),
        ("camera.fps", "-3", "--set camera.fps=-3: camera.fps: must be a finite number above 0"),
        ("camera..fps", "3", "the key is empty"),
        ("seed.x", "3", "--set seed.x=3: seed: expected a whole number, 0 or more, found a table"),
        ("flight.log.x", "3", "is not a table"),
        ("camera.fps", "1\nseed = 2", "expected a number"),
    ] {
        let error = with(&[(key, value)]).unwrap_err().to_string();
        assert!(error.contains(expected), "{key}={value} gives {error}");
    }
}

#[test]
fn camera_files_have_their_own_paths_and_lines() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("cams")).unwrap();
    let camera = dir.path().join("cams/c.toml");
    std::fs::write(&camera, "fps = 25\n[photometric]\nvignette = \"v.png\"\n").unwrap();
    let file = dir.path().join("s.toml");
    std::fs::write(&file, format!("\u{feff}camera = \"cams/c.toml\"\r\n{GOOD}")).unwrap();
    let set = [("camera.shutter.exposure_ms".to_owned(), "4".to_owned())];
    let scenario = read_scenario(&file, &set, None).unwrap();
    assert_eq!((scenario.camera.fps, scenario.camera.shutter.exposure_ms), (25.0, 4.0));
    assert_eq!(scenario.camera.photometric.vignette.unwrap(), dir.path().join("cams/v.png"));
    assert_eq!(read_camera(&camera).unwrap().fps, 25.0);
    assert_eq!(read_scenario(&file, &[], Some(Preset::Paper)).unwrap().quality.preset, Preset::Paper);

    std::fs::write(&camera, "fps = 25\nfocal = 3\n").unwrap();
    let error = read_scenario(&file, &[], None).unwrap_err().to_string();
    assert!(
        error.contains("c.toml:2: camera.focal: unknown key; did you mean `camera.focal_px`?"),
        "{error}"
    );
    // Errors of a camera file alone name keys without `camera.`.
    let error = read_camera(&camera).unwrap_err().to_string();
    assert!(error.ends_with("c.toml:2: focal: unknown key; did you mean `focal_px`?"), "{error}");
    for (text, expected) in [
        (
            "[camera]\nfps = 25\n",
            "c.toml:1: camera: a CAMERA.toml has the keys of [camera] at its root: write fps = 30",
        ),
        (
            "fps = 1\nseed = 1\n[flight]\nlog = \"a.csv\"\n",
            "c.toml:2: seed: a CAMERA.toml has the keys of [camera] at its root: the rest",
        ),
    ] {
        std::fs::write(&camera, text).unwrap();
        for error in [read_camera(&camera).unwrap_err(), read_scenario(&file, &[], None).unwrap_err()] {
            assert!(error.to_string().contains(expected), "{error}");
        }
    }
}
