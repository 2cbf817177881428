//! Illegal values and combinations, each named by its key.

use std::path::PathBuf;

use super::*;
use crate::scenario::{
    BoardSpec, FieldOr, FilesOfSpec, FlightHeight, FlightSpec, GltfSpec, LensSpec, LightSpec,
    MAX_BLUR_SAMPLES, MAX_FOOTPRINT_TAPS, MAX_ITERATIONS, ObjectsOf, PatternSpec, SceneSpec, VibrationSpec,
    ZoomSpec,
};

pub(crate) fn good() -> Scenario {
    let pattern = PatternSpec {
        image: "grid.png".into(),
        width_m: 100.0,
        at: Default::default(),
        name: None,
        class: None,
        repeat: false,
    };
    Scenario::new(FlightSpec::new("flight.csv"), SceneSpec { pattern: Some(pattern), ..SceneSpec::default() })
}

fn model() -> GltfSpec {
    GltfSpec {
        file: "a.glb".into(),
        at: Default::default(),
        geodetic: None,
        placements: None,
        heading_deg: 0.0,
        scale: 1.0,
        on_ground: false,
        scene: None,
        time_s: None,
        animation: None,
        name: None,
        class: None,
        objects: Default::default(),
        classes: Default::default(),
        motion: None,
    }
}

fn part_of_files(part_px: [f64; 4]) -> FilesOfSpec {
    FilesOfSpec { size_px: [640, 480], focal_px: [500.0, 500.0], principal_point_px: [319.5, 239.5], part_px }
}

#[test]
fn the_defaults_are_in_range() {
    assert_eq!(validate(&good()), []);
}

#[test]
fn each_value_out_of_range_is_named_once() {
    type Edit = fn(&mut Scenario);
    let cases: &[(&str, Edit)] = &[
        ("flight.log", |s| s.flight.log = PathBuf::new()),
        ("flight.height", |s| s.flight.height = FlightHeight::Takeoff),
        ("flight.window_s", |s| s.flight.window_s = Some([5.0, 2.0])),
        ("flight.window_s", |s| s.flight.window_s = Some([0.0, f64::NAN])),
        ("flight.speed", |s| s.flight.speed = 0.0),
        ("flight.origin", |s| s.flight.origin = Origin::Geodetic([91.0, 0.0, 0.0])),
        ("tracker.rate_hz", |s| s.tracker.rate_hz = f64::NAN),
        ("tracker.max_speed_m_s", |s| s.tracker.max_speed_m_s = Auto::Value(-1.0)),
        ("tracker.max_acceleration_m_s2", |s| s.tracker.max_acceleration_m_s2 = Auto::Value(f64::INFINITY)),
        ("camera.size_px", |s| s.camera.size_px = [640, 0]),
        ("camera.size_px", |s| s.camera.size_px = [u32::MAX, 480]),
        ("camera.focal_px", |s| s.camera.focal_px = [0.0, 500.0]),
        ("camera.focal_px", |s| s.camera.focal_px = [500.0, f64::NAN]),
        ("camera.principal_point_px", |s| s.camera.principal_point_px = Some([f64::INFINITY, 0.0])),
        ("camera.fps", |s| s.camera.fps = -30.0),
        ("camera.phase", |s| s.camera.phase = f64::NAN),
        ("camera.mount.angles_deg", |s| s.camera.mount.angles_deg[1] = f64::NAN),
        ("camera.mount.vibration.0.amplitude_m", |s| {
            let wrong = VibrationSpec {
                axis: Axis::Roll,
                amplitude_deg: 0.1,
                amplitude_m: 0.1,
                hz: 50.0,
                phase_deg: 0.0,
            };
            s.camera.mount.vibration.push(wrong);
        }),
        ("camera.lens.coefficients", |s| s.camera.lens.coefficients = vec![0.1]),
        ("camera.lens.coefficients", |s| {
            s.camera.lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.3, 0.1, 0.01] };
        }),
        ("camera.lens.coefficients", |s| {
            s.camera.lens.model = LensModel::KannalaBrandt;
            s.camera.lens.coefficients = vec![0.0; 5];
        }),
        ("camera.zoom.1.at", |s| {
            let row = |at| ZoomSpec {
                at,
                focal_px: [500.0, 500.0],
                principal_point_px: None,
                coefficients: vec![],
            };
            s.camera.zoom = vec![row(2.0), row(1.0)];
        }),
        ("camera.zoom_track", |s| s.camera.zoom_track = Some("zoom.csv".into())),
        ("camera.shutter.delay_ms", |s| s.camera.shutter.delay_ms = -1.0),
        ("camera.shutter.readout_ms", |s| s.camera.shutter.readout_ms = f64::NAN),
        ("camera.shutter.exposure_ms", |s| s.camera.shutter.exposure_ms = -8.0),
        ("camera.shutter.interlace_ms", |s| s.camera.shutter.interlace_ms = FieldOr::Ms(-1.0)),
        ("camera.photometric.vignette_thresholds", |s| s.camera.photometric.vignette_thresholds = [0.0, 0.0]),
        ("camera.photometric.light", |s| s.camera.photometric.light = -1.0),
        ("camera.photometric.noise_sigma", |s| s.camera.photometric.noise_sigma = f64::NAN),
        ("scene", |s| s.scene.pattern = None),
        ("scene.gltf.0.scale", |s| s.scene.gltf = vec![GltfSpec { scale: 0.0, ..model() }]),
        ("scene.gltf.0.on_ground", |s| s.scene.gltf = vec![GltfSpec { on_ground: true, ..model() }]),
        ("scene.gltf.1.placements", |s| {
            s.scene.gltf = vec![
                model(),
                GltfSpec { geodetic: Some([1.0; 3]), placements: Some("a.csv".into()), ..model() },
            ];
        }),
        ("scene.board.kind", |s| s.scene.board = Some(BoardSpec::default())),
        ("scene.board.target", |s| {
            s.scene.board =
                Some(BoardSpec { target: Some("a.yaml".into()), rows: Some(3), ..BoardSpec::default() });
        }),
        ("scene.board.angles_deg", |s| {
            let angles_deg = [0.0, f64::NAN, 0.0];
            s.scene.board =
                Some(BoardSpec { target: Some("a.yaml".into()), angles_deg, ..BoardSpec::default() });
        }),
        ("scene.board.geodetic", |s| {
            let geodetic = Some([91.0, 8.0, 400.0]);
            s.scene.board =
                Some(BoardSpec { target: Some("a.yaml".into()), geodetic, ..BoardSpec::default() });
        }),
        ("scene.pattern.class", |s| s.scene.pattern.iter_mut().for_each(|p| p.class = Some(0))),
        ("scene.gltf.0.name", |s| {
            s.scene.gltf = vec![GltfSpec { name: Some(String::new()), ..model() }];
        }),
        ("scene.gltf.0.classes", |s| {
            s.scene.gltf = vec![GltfSpec { classes: [("roof".into(), 1)].into(), ..model() }];
        }),
        ("scene.gltf.0.classes.roof", |s| {
            let classes = [("roof".into(), 0)].into();
            s.scene.gltf = vec![GltfSpec { classes, objects: ObjectsOf::Node, ..model() }];
        }),
        ("scene.sky", |s| s.scene.sky = [166.0, 217.0, 255.0]),
        ("scene.fog_visibility_m", |s| s.scene.fog_visibility_m = Some(0.0)),
        ("scene.light.sun_azimuth_deg", |s| {
            s.scene.light = Some(LightSpec { sun_azimuth_deg: f64::INFINITY, ..Default::default() })
        }),
        ("scene.light.sun_azimuth_deg", |s| {
            s.scene.light = Some(LightSpec { sun_azimuth_deg: 1e300, ..Default::default() })
        }),
        ("scene.light.sun", |s| s.scene.light = Some(LightSpec { sun: 1.1, ..Default::default() })),
        ("scene.light.sun_elevation_deg", |s| {
            s.scene.light = Some(LightSpec { sun_elevation_deg: -1.0, ..Default::default() })
        }),
        ("scene.light.sun", |s| s.scene.light = Some(LightSpec { sun: f64::NAN, ..Default::default() })),
        ("scene.light.sky", |s| s.scene.light = Some(LightSpec { sun: 0.8, sky: 0.3, ..Default::default() })),
        ("quality.preset", |s| {
            s.quality.preset = Preset::Paper;
            s.camera.lens.model = LensModel::KannalaBrandt;
        }),
        ("quality.preset", |s| {
            s.quality.preset = Preset::Paper;
            s.camera.lens =
                LensSpec { model: LensModel::BrownConrady, coefficients: vec![0.1, 0.0, 0.0, 0.0, 0.0, 0.2] };
        }),
        ("quality.solver", |s| {
            s.quality.preset = Preset::Paper;
            s.quality.solver = Auto::Value(Solver::Linear);
        }),
        ("quality.solver", |s| {
            s.quality.preset = Preset::Paper;
            s.quality.solver = Auto::Value(Solver::Reference);
        }),
        ("quality.iterations", |s| {
            s.quality.preset = Preset::Paper;
            s.quality.iterations = Auto::Value(2);
        }),
        ("quality.silhouettes", |s| {
            s.quality.preset = Preset::Paper;
            s.quality.silhouettes = Silhouettes::Rays;
        }),
        ("quality.footprint_taps", |s| {
            s.quality.preset = Preset::Paper;
            s.quality.footprint_taps = Auto::Value(2);
        }),
        ("quality.frames_per_ideal", |s| {
            s.quality.preset = Preset::Paper;
            s.quality.frames_per_ideal = 16;
        }),
        ("quality.max_error_px", |s| s.quality.max_error_px = 0.0),
        ("quality.blur_samples", |s| s.quality.blur_samples = Auto::Value(0)),
        ("quality.blur_samples", |s| s.quality.blur_samples = Auto::Value(MAX_BLUR_SAMPLES + 1)),
        ("quality.footprint_taps", |s| s.quality.footprint_taps = Auto::Value(MAX_FOOTPRINT_TAPS + 1)),
        ("quality.iterations", |s| s.quality.iterations = Auto::Value(MAX_ITERATIONS + 1)),
        ("quality.ideal_samples", |s| s.quality.ideal_samples = Auto::Value(2)),
        ("quality.ideal_samples", |s| {
            s.quality.ideal_samples = Auto::Value(IDEAL_SAMPLES);
            s.quality.silhouettes = Silhouettes::Rays;
        }),
        ("quality.ideal_scale", |s| s.quality.ideal_scale = Auto::Value(0.5)),
        ("quality.ideal_scale", |s| s.quality.ideal_scale = Auto::Value(5.1)),
        ("quality.iterations", |s| s.quality.iterations = Auto::Value(0)),
        ("quality.iterations", |s| {
            s.quality.iterations = Auto::Value(2);
            s.quality.solver = Auto::Value(Solver::Rk2);
        }),
        ("output.channels", |s| s.output.channels.clear()),
        ("output.flow_step", |s| s.output.flow_step = 0),
        ("output.video.bits", |s| s.output.video.bits = 9),
        ("camera.files_of.part_px", |s| s.camera.files_of = Some(part_of_files([-1.0, 0.0, 640.0, 480.0]))),
        ("camera.files_of.part_px", |s| s.camera.files_of = Some(part_of_files([0.0, 0.0, 640.0, 0.0]))),
    ];
    for (key, edit) in cases {
        let mut scenario = good();
        edit(&mut scenario);
        let problems = validate(&scenario);
        assert_eq!(problems.len(), 1, "{key}: {problems:?}");
        assert_eq!(problems[0].key, *key);
    }
}
