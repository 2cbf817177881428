//! Frames of plans that the planner makes: all kinds of motion, exposure, taps and readout.

use std::path::Path;

use camsim_core::{
    scenario::{
        Auto, Axis, FieldOr, LensModel, LensSpec, MountSpec, OutputEncoding, Readout, Scenario, Silhouettes,
        VibrationSpec,
    },
    temporal::TapStage,
    trajectory::Trajectory,
};
use camsim_io::{load::load_sequence, scenario_file::read_scenario};
use camsim_plan::Planner;
use glam::DVec3;

use super::{
    cases::{Case, Input, Output},
    common::{city, pattern, rolling, scenario, sequence, steady},
    implementations::ALL_CHANNELS,
};

/// Sides that no block divides.
pub const SIZE_PX: [u32; 2] = [181, 139];
/// Instant of the exposure of the source coordinates.
const COORDS_PHASE: f32 = 0.3;

fn camera(exposure_ms: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [150.0, 140.0];
    scenario.camera.mount = MountSpec { angles_deg: [3.0, -60.0, 10.0], ..MountSpec::default() };
    scenario.camera.shutter = rolling(33.0, exposure_ms);
    scenario.quality.silhouettes = Silhouettes::Plain;
    scenario
}

fn lens(mut scenario: Scenario) -> Scenario {
    // So bent that the corners have no ray.
    scenario.camera.lens =
        LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.39, 0.11, 0.001, -0.002, -0.0084] };
    scenario
}

fn still() -> Trajectory {
    steady(120.0, 10.0, DVec3::ZERO, DVec3::ZERO)
}

fn turning() -> Trajectory {
    steady(120.0, 10.0, DVec3::ZERO, DVec3::new(0.3, -0.2, 0.5))
}

fn flying() -> Trajectory {
    steady(120.0, 10.0, DVec3::new(5.0, 30.0, 2.0), DVec3::new(0.1, 0.05, 0.3))
}

/// Ground that fills the view, and houses with silhouettes, by all cases; then scenarios in files.
pub fn planned() -> Vec<Case> {
    let case = |name: String, sequence, frame| {
        let case = Case::new(name, sequence, Input::Frame(frame), Output::FrameAndColorAlone);
        Case { coords_phase: COORDS_PHASE, ..case }
    };
    let mut all = Vec::new();
    for (name, scenario, trajectory) in cases() {
        for (scene_name, scene) in [("ground", pattern(6000.0)), ("city", city(6))] {
            let sequence = sequence(scenario.clone(), trajectory.clone(), scene);
            all.push(case(format!("{name}, {scene_name}"), sequence, 2));
        }
    }
    let benches = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../benches");
    let read = |name: &str| read_scenario(&benches.join(name), &[], None).expect("scenario");
    let all_effects = load_sequence(&read("all_effects.toml")).expect("sequence").sequence;
    all.extend([52, 98].map(|frame| case(format!("all effects, frame {frame}"), all_effects.clone(), frame)));
    // Over houses pixels are read by their areas; of a lens that bends little too.
    for (exposure_ms, radial) in [(0.0, 0.0), (8.0, 0.0), (0.0, -0.06), (8.0, -0.06)] {
        let mut scenario = read("houses.toml");
        scenario.camera.size_px = SIZE_PX;
        (scenario.camera.focal_px, scenario.camera.principal_point_px) = ([150.0, 140.0], Some([90.0, 69.0]));
        scenario.camera.lens =
            LensSpec { model: LensModel::BrownConrady, coefficients: vec![radial, 0.0, 0.0, 0.0, 0.0] };
        scenario.camera.shutter.exposure_ms = exposure_ms;
        let houses = load_sequence(&scenario).expect("sequence").sequence;
        let planner = Planner::new(houses.clone(), &ALL_CHANNELS, 16_384).expect("a usable camera");
        assert_eq!(planner.plan(40).expect("a plan").taps, TapStage::Area, "{exposure_ms} ms, {radial}");
        all.push(case(format!("houses, {exposure_ms} ms, k1 = {radial}"), houses, 40));
    }
    all
}

/// Every model of a lens whose map no shader makes, over ground.
pub fn lenses() -> Vec<Case> {
    let case = |(model, coefficients, focal_px): (LensModel, &[f64], f64)| {
        let mut scenario = camera(0.0);
        scenario.camera.focal_px = [focal_px, 0.95 * focal_px];
        scenario.camera.lens = LensSpec { model, coefficients: coefficients.to_vec() };
        let sequence = sequence(scenario, turning(), pattern(6000.0));
        let name = format!("lens of model {}", model.name());
        let case = Case::new(name, sequence, Input::Frame(2), Output::FrameAndColorAlone);
        Case { coords_phase: COORDS_PHASE, ..case }
    };
    lens_models().map(case).into()
}

fn lens_models() -> [(LensModel, &'static [f64], f64); 11] {
    use LensModel::{
        BrownConradyPrism, Division, DoubleSphere, Equirectangular, Eucm, FTheta, FThetaInverse, Fisheye624,
        Fov, Mei, Ucm,
    };
    const PRISM: &[f64] = &[-0.28, 0.07, 2e-4, 2e-5, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, -0.02, 0.0, 0.05, -0.04];
    const ARIA: &[f64] =
        &[-0.0232, 0.0924, -0.0591, 0.003, 0.0048, -9e-4, 2e-4, 5e-4, -9e-4, -1e-4, 7e-5, -1.7e-4];
    [
        (BrownConradyPrism, PRISM, 150.0),
        (Fisheye624, ARIA, 150.0),
        (FTheta, &[1.0, -0.02, 0.01, -0.03, 0.002, 1.01, 0.01, -0.02], 150.0),
        (FThetaInverse, &[1.0, 0.02, -0.01, 0.03], 150.0),
        (DoubleSphere, &[-0.2396, 0.5589], 115.0),
        (Eucm, &[0.571, 1.18], 150.0),
        (Ucm, &[0.6], 150.0),
        (Mei, &[1.2, -0.2, 0.05, 1e-3, -5e-4], 330.0),
        (Division, &[-0.3], 150.0),
        (Fov, &[0.93], 140.0),
        (Equirectangular, &[], 150.0),
    ]
}

fn cases() -> Vec<(&'static str, Scenario, Trajectory)> {
    // Long because: a line for each case.
    let set = |mut scenario: Scenario, change: &dyn Fn(&mut Scenario)| {
        change(&mut scenario);
        scenario
    };
    let within = |px: f64| move |scenario: &mut Scenario| scenario.quality.max_error_px = px;
    let scale = |scale: f64| move |scenario: &mut Scenario| scenario.quality.ideal_scale = Auto::Value(scale);
    let taps = |taps: u32, scale: f64| {
        move |scenario: &mut Scenario| {
            scenario.quality.ideal_scale = Auto::Value(scale);
            scenario.quality.footprint_taps = Auto::Value(taps);
        }
    };
    let coarsely = |scenario: &mut Scenario| scenario.quality.max_error_dn = 40.0;
    let shaking = |hz: f64| {
        move |scenario: &mut Scenario| {
            scenario.camera.mount.vibration = vec![VibrationSpec {
                axis: Axis::Pitch,
                amplitude_deg: 0.3,
                amplitude_m: 0.0,
                hz,
                phase_deg: 20.0,
            }];
        }
    };
    vec![
        ("nothing moves", camera(0.0), still()),
        ("nothing moves, lens", lens(camera(0.0)), still()),
        ("copied", set(camera(0.0), &coarsely), still()),
        (
            "copied, noise",
            set(camera(0.0), &|scenario| {
                coarsely(scenario);
                scenario.camera.photometric.noise_sigma = 0.05;
            }),
            still(),
        ),
        ("turning", camera(0.0), turning()),
        ("turning, exposure", lens(camera(12.0)), turning()),
        ("flying", lens(camera(0.0)), flying()),
        ("flying, exposure", camera(12.0), flying()),
        ("1 px", lens(set(camera(20.0), &within(1.0))), flying()),
        ("0.01 px", lens(set(camera(20.0), &within(0.01))), flying()),
        ("0.001 px", set(camera(12.0), &within(0.001)), flying()),
        (
            "two look-ups",
            lens(set(camera(12.0), &|scenario| scenario.quality.iterations = Auto::Value(2))),
            flying(),
        ),
        (
            "five look-ups",
            set(camera(12.0), &|scenario| scenario.quality.iterations = Auto::Value(5)),
            flying(),
        ),
        ("shaking", lens(set(camera(20.0), &shaking(40.0))), flying()),
        ("shaking fast", lens(set(camera(20.0), &shaking(150.0))), flying()),
        ("shaking faster", set(camera(20.0), &shaking(400.0)), flying()),
        (
            "one sample",
            set(camera(20.0), &|scenario| scenario.quality.blur_samples = Auto::Value(1)),
            flying(),
        ),
        ("coarse", lens(set(camera(12.0), &scale(0.7))), flying()),
        ("fine", lens(set(camera(12.0), &scale(2.5))), flying()),
        ("fine, sharp", lens(set(camera(0.0), &scale(2.5))), flying()),
        ("taps", lens(set(camera(12.0), &taps(3, 2.5))), flying()),
        ("taps, sharp", set(camera(0.0), &taps(4, 2.5)), flying()),
        ("spline or taps", lens(set(camera(12.0), &taps(3, 1.6))), flying()),
        ("spline or taps, sharp", lens(set(camera(0.0), &taps(3, 1.6))), flying()),
        ("one tap, sharp", lens(set(camera(0.0), &taps(1, 2.5))), turning()),
        ("one tap", lens(set(camera(12.0), &taps(1, 2.5))), flying()),
        (
            "bottom to top, interlaced",
            set(lens(camera(8.0)), &|scenario| {
                scenario.camera.shutter.readout = Readout::BottomToTop;
                scenario.camera.shutter.interlace_ms = FieldOr::Ms(16.0);
            }),
            flying(),
        ),
        (
            "grey, light, noise",
            set(lens(camera(8.0)), &|scenario| {
                scenario.camera.photometric.noise_sigma = 0.02;
                scenario.camera.photometric.light = 1.3;
                scenario.camera.photometric.output = OutputEncoding::Luma8;
                scenario.seed = 0x1234_5678_9abc;
            }),
            flying(),
        ),
        ("noise", set(camera(8.0), &|scenario| scenario.camera.photometric.noise_sigma = 0.05), turning()),
    ]
}
