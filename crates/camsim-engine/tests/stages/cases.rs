//! Cases of output frames that are compared pixel by pixel.

use std::sync::Arc;

use camsim_core::{
    photometric::GrayImage,
    scenario::{
        Auto, Axis, MountSpec, OutputEncoding, Readout, Scenario, ShutterSpec, Solver, VibrationSpec,
    },
    sequence::Sequence,
    temporal::{NodeDepths, PathStage, TapStage},
};
use camsim_plan::{BlurStage, EdgeStage, FramePlan, Planner, RayStage, TemporalStage};
use glam::DVec3;

use super::{
    common::{barrel_lens, ground_and_roof, pattern, rolling, scenario, sequence, steady},
    compare::Done,
    ideal_twin::TwinSource,
    implementations::ALL_CHANNELS,
    stage::OtherSurface,
};

const EAST: DVec3 = DVec3::new(0.0, 60.0, 0.0);
const TURN: DVec3 = DVec3::new(0.2, -0.3, 0.9);
/// Motion over the roof, and heading at t = 0.
const EAST_OVER_ROOF: DVec3 = DVec3::new(3.0, 40.0, 1.0);
const TURN_OVER_ROOF: DVec3 = DVec3::new(0.2, -0.3, 0.5);
const HEADING_RAD: f64 = 0.3;
/// Depth look-ups of hand-made plans.
const ITERATIONS: u32 = 3;

/// What is rendered.
#[derive(Debug)]
pub enum Input {
    /// A frame by its number, as the planner plans it.
    Frame(u64),
    /// A plan that no planner makes. Sessions render plans of the planner only, so the gpu has no part.
    Plan(Box<FramePlan>),
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    Frame,
    /// Also the colour without other channels.
    FrameAndColorAlone,
    Ideal,
}

/// A scene with settings.
#[derive(Debug)]
pub struct Case {
    pub name: String,
    pub sequence: Arc<Sequence>,
    pub input: Input,
    pub output: Output,
    /// Instant of the exposure of the source coordinates, -0.5 to 0.5.
    pub coords_phase: f32,
    /// The sequence without photometric effects.
    pub plain: Option<Arc<Sequence>>,
    pub ideal_twin: TwinSource,
    pub other_surface: OtherSurface,
}

impl Case {
    pub fn new(name: impl Into<String>, sequence: Arc<Sequence>, input: Input, output: Output) -> Self {
        Self {
            name: name.into(),
            sequence,
            input,
            output,
            coords_phase: 0.0,
            plain: None,
            ideal_twin: TwinSource::None,
            other_surface: OtherSurface { dn: f64::INFINITY, depth: f64::INFINITY },
        }
    }
}

fn moving_scenario() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [200, 150];
    scenario.camera.focal_px = [160.0, 160.0];
    scenario.camera.mount = MountSpec { angles_deg: [8.0, -70.0, 15.0], ..MountSpec::default() };
    scenario.camera.lens = barrel_lens();
    scenario.camera.shutter = rolling(33.0, 30.0);
    scenario
}

/// Four tolerances with a mount at rest, then three frequencies of one that shakes.
pub fn smooth() -> Vec<Case> {
    let tolerances =
        [0.5, 0.001, 1e-5, 3.2e-4].map(|max_error_px| (max_error_px, None, Readout::TopToBottom));
    let frequencies =
        [(5.0, Readout::TopToBottom), (40.0, Readout::LeftToRight), (90.0, Readout::RightToLeft)]
            .map(|(hz, readout)| (0.05, Some(hz), readout));
    let case = |(max_error_px, hz, readout): (f64, Option<f64>, Readout)| {
        let mut scenario = moving_scenario();
        let shake = |hz| VibrationSpec {
            axis: Axis::Pitch,
            amplitude_deg: 0.3,
            amplitude_m: 0.0,
            hz,
            phase_deg: 20.0,
        };
        scenario.camera.mount.vibration = hz.map(shake).into_iter().collect();
        scenario.camera.shutter.readout = readout;
        scenario.quality.max_error_px = max_error_px;
        scenario.quality.solver = Auto::Value(Solver::Reproject);
        let sequence = sequence(scenario, steady(120.0, 30.0, EAST, TURN), pattern(6000.0));
        let plan = plan_of(&sequence);
        let is_blurred = plan.blur.is_some_and(|blur| blur.nodes > 1);
        assert!(plan.ray == RayStage::LensMap && is_blurred, "{plan:?}");
        assert!(matches!(plan.temporal, TemporalStage::Reproject { .. }), "{:?}", plan.temporal);
        let name = format!("{max_error_px} px, shaking at {} Hz, {readout:?}", hz.unwrap_or_default());
        Case::new(name, sequence, Input::Frame(0), Output::Frame)
    };
    tolerances.into_iter().chain(frequencies).map(case).collect()
}

/// A still camera without lens.
pub fn still() -> Vec<Case> {
    let mut scenario = moving_scenario();
    scenario.camera.lens = Default::default();
    scenario.quality.footprint_taps = Auto::Auto;
    let sequence = sequence(scenario, steady(300.0, 0.0, DVec3::ZERO, DVec3::ZERO), pattern(6000.0));
    let plan = plan_of(&sequence);
    assert_eq!(plan.temporal, TemporalStage::Identity);
    assert!(plan.blur.is_none() && plan.ray == RayStage::Pinhole);
    let shift = plan.ideal.principal_px - plan.camera.principal_point_px;
    assert_eq!(shift, shift.round(), "pixels of both frames fall together");
    vec![Case::new("still, no lens", sequence, Input::Frame(0), Output::Frame)]
}

/// Vignette, light and noise, in colour and grey.
pub fn photometric() -> Vec<Case> {
    let with_effects = |mut sequence: Sequence, output: OutputEncoding| {
        let plain = Arc::new(sequence.clone());
        let spec = &mut sequence.scenario.camera.photometric;
        (spec.noise_sigma, spec.light, spec.output) = (0.05, 1.3, output);
        sequence.vignette =
            Some(Arc::new(GrayImage { size_px: [3, 2], values: vec![0.0, 0.3, 0.9, 0.02, 0.6, 1.0] }));
        (plain, Arc::new(sequence))
    };
    let case = |name: String, (plain, sequence), frame| {
        let case = Case::new(name, sequence, Input::Frame(frame), Output::Frame);
        Case { plain: Some(plain), ..case }
    };
    let mut cases = Vec::new();
    for output in [OutputEncoding::Srgb8, OutputEncoding::Luma8] {
        let mut scenario = moving_scenario();
        scenario.camera.shutter = ShutterSpec::default();
        let sequence = sequence(scenario, steady(300.0, 0.0, EAST, TURN), pattern(6000.0));
        let both = with_effects(Arc::unwrap_or_clone(sequence), output);
        cases.push(case(format!("{output:?}, rows at one instant"), both, 5));
    }
    for readout in [Readout::TopToBottom, Readout::LeftToRight, Readout::RightToLeft] {
        let mut scenario = small_scenario();
        scenario.camera.shutter = ShutterSpec { readout, ..rolling(30.0, 80.0) };
        let sequence = sequence(scenario, over_roof_at(TURN_OVER_ROOF), pattern(900.0));
        let both = with_effects(Arc::unwrap_or_clone(sequence), OutputEncoding::Srgb8);
        cases.push(case(format!("Srgb8, rolling shutter, {readout:?}"), both, 0));
    }
    cases
}

/// A small camera that looks steeply down.
fn small_scenario() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [48, 36];
    scenario.camera.focal_px = [42.0, 40.0];
    scenario.camera.mount = MountSpec { angles_deg: [8.0, -70.0, 15.0], ..MountSpec::default() };
    scenario.quality.max_error_px = 1e-3;
    scenario
}

fn over_roof_at(rate: DVec3) -> camsim_core::trajectory::Trajectory {
    steady(120.0, HEADING_RAD.to_degrees(), EAST_OVER_ROOF, rate)
}

fn plan_of(sequence: &Arc<Sequence>) -> FramePlan {
    let planner = Planner::new(sequence.clone(), &ALL_CHANNELS, 16_384).expect("a usable camera");
    planner.plan(0).expect("a plan")
}

/// With ideal frames that reach 20 px farther on all sides.
fn widen(plan: &mut FramePlan) {
    plan.ideal.size_px = plan.ideal.size_px.map(|side| side + 40);
    plan.ideal.principal_px += 20.0;
}

/// Over a roof, by pixels of the ideal frame alone, with an ideal frame so much finer than the picture.
fn over_roof(exposure_ms: f64, finer: f64) -> (Arc<Sequence>, FramePlan) {
    let mut scenario = small_scenario();
    scenario.camera.shutter = rolling(40.0, exposure_ms);
    scenario.quality.key_frames = Auto::Value(1);
    let sequence = sequence(scenario, over_roof_at(TURN_OVER_ROOF), ground_and_roof(900.0, 60.0, 15.0));
    let mut plan = plan_of(&sequence);
    plan.edges = EdgeStage::None;
    plan.temporal = TemporalStage::Reproject { iterations: ITERATIONS };
    widen(&mut plan);
    let ideal = &mut plan.ideal;
    ideal.focal_px *= finer;
    ideal.principal_px = (ideal.principal_px + 0.5) * finer - 0.5;
    ideal.size_px = ideal.size_px.map(|side| (f64::from(side) * finer) as u32);
    (sequence, plan)
}

/// All depths of nodes with all forms of path.
pub fn exposures() -> Vec<Case> {
    let paths = [
        (PathStage::Straight, 1, 1),
        (PathStage::Straight, 2, 3),
        (PathStage::Parabola, 1, 1),
        (PathStage::Parabola, 3, 2),
        (PathStage::Quartic, 1, 2),
        (PathStage::Quartic, 2, 3),
    ];
    let (sequence, over_roof) = over_roof(200.0, 1.0);
    let case = |depths: NodeDepths, (path, stride, stretches): (PathStage, u32, u32)| {
        let nodes = stride * path.steps() * stretches + 1;
        let mut plan = over_roof.clone();
        plan.taps = TapStage::Spline;
        plan.blur = Some(BlurStage { nodes, stride, path, depths, samples_per_px: 2.0, max_samples: 64 });
        let name = format!("{depths:?} {path:?} {stretches}x, every {stride}");
        Case::new(name, sequence.clone(), Input::Plan(Box::new(plan)), Output::Frame)
    };
    NodeDepths::ALL.into_iter().flat_map(|depths| paths.map(|path| case(depths, path))).collect()
}

const TAPS: [TapStage; 6] = [
    TapStage::Bilinear,
    TapStage::Spline,
    TapStage::Area,
    TapStage::Grid { most: 2 },
    TapStage::Grid { most: 8 },
    TapStage::SplineOrGrid { most: 4 },
];

/// All taps with ideal pixels of three sizes, with and without blur; the taps are the innermost loop, and the
/// last ideal pixels are the finest.
pub fn taps() -> Vec<Case> {
    let mut cases = Vec::new();
    for finer in [1.0, 1.5, 3.2] {
        for exposure_ms in [0.0, 100.0] {
            let (sequence, over_roof) = over_roof(exposure_ms, finer);
            assert_eq!(over_roof.blur.is_some(), exposure_ms > 0.0);
            for taps in TAPS {
                let plan = FramePlan { taps, ..over_roof.clone() };
                let name = format!("{taps:?} of {finer} ideal pixels, {exposure_ms} ms");
                cases.push(Case::new(name, sequence.clone(), Input::Plan(Box::new(plan)), Output::Frame));
            }
        }
    }
    cases
}

/// Pixels that are wide in the ideal frame are read differently by each kind of taps.
pub fn assert_taps_differ(done: &[Done]) {
    let [.., sharp, blurred] = done.chunks_exact(TAPS.len()).collect::<Vec<_>>()[..] else {
        panic!("two exposures at least");
    };
    for frames in [sharp, blurred] {
        for (i, a) in frames.iter().enumerate() {
            assert!(frames[..i].iter().all(|b| a.color_rgba != b.color_rgba), "{:?}", TAPS[i]);
        }
    }
}

/// The solvers of constant twist, with coordinates at begin, middle and end of the exposure.
pub fn constant_twist() -> Vec<Case> {
    let mut cases = Vec::new();
    for solver in [Solver::Linear, Solver::Rk2] {
        let mut scenario = small_scenario();
        scenario.camera.shutter = rolling(200.0, 20.0);
        scenario.quality.solver = Auto::Value(solver);
        let trajectory = over_roof_at(2.0 * TURN_OVER_ROOF);
        let sequence = sequence(scenario, trajectory, ground_and_roof(900.0, 60.0, 15.0));
        let mut plan = plan_of(&sequence);
        plan.edges = EdgeStage::None;
        widen(&mut plan);
        for coords_phase in [-0.5, 0.0, 0.5] {
            let name = format!("{solver:?}, coordinates at {coords_phase}");
            let input = Input::Plan(Box::new(plan.clone()));
            cases.push(Case { coords_phase, ..Case::new(name, sequence.clone(), input, Output::Frame) });
        }
    }
    cases
}
