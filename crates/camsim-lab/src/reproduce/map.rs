//! 8.8: delay, readout, exposure and field time of one second over terrain, through the fisheye (fig. 21).

use std::sync::Arc;

use camsim_core::{
    reference::{ErrorStats, IdealView, coord_errors},
    scenario::{
        CameraSpec, Channel, FieldOr, FlightSpec, Scenario, SceneSpec, ShutterSpec, TerrainSpec, TrackerSpec,
    },
    sequence::Sequence,
};
use camsim_io::{builtin, load::load_sequence, scenario_file::read_scenario};
use glam::DVec2;

use super::{
    ExperimentReport, Picture, ReproduceError, Setup, Table,
    displacement::{DisplacementModel, PaperIdealFrame},
    short, test_bench,
};

/// Delay, readout, exposure and field time, seconds.
const EFFECT_S: f64 = 1.0;
/// The paper's colour of the sky, sRGB.
const SKY: [f64; 3] = [0.65, 0.85, 1.0];
/// Step of the compared pixels in x and y.
const STEP_PX: u32 = 4;

/// The flight over terrain: the paper's lawnmower log moved over an alpine valley, or the built-in flight.
fn load(setup: &Setup<'_>) -> Result<(Arc<Sequence>, &'static str), ReproduceError> {
    // As in the paper, the camera looks along the nose.
    let camera = CameraSpec { mount: Default::default(), ..test_bench::fisheye(setup.width_px) };
    let (scenario, name) = match setup.data {
        Some(data) => {
            let terrain = TerrainSpec {
                dem: data.join("terrain/sertig/sertig_valley.tif").into(),
                ortho: Some(data.join("terrain/sertig/sertig_valley_color.tif").into()),
                ..TerrainSpec::default()
            };
            let own = test_bench::scenario(camera);
            let scenario = Scenario {
                flight: FlightSpec::new(data.join("flights/demo_sertig_lawnmower_x5.5.csv")),
                tracker: TrackerSpec::default(),
                scene: SceneSpec { terrain: Some(terrain), sky: SKY, ..own.scene.clone() },
                ..own
            };
            (
                scenario,
                "the paper's lawnmower log, moved and scaled over an alpine valley (the paper's own terrain \
                 is not available)",
            )
        }
        None => {
            let built_in = read_scenario(&builtin::unpack(&setup.scratch.join("built-in"))?, &[], None)?;
            let flight = FlightSpec { window_s: None, ..built_in.flight.clone() };
            (Scenario { camera, flight, ..built_in }, "camsim's built-in flight and terrain")
        }
    };
    Ok((load_sequence(&scenario)?.sequence, name))
}

/// Finds an instant of a left turn with much land in view: of the instants, one per second, whose yaw rate is
/// at least half of the largest, the one with the largest fraction of land. Returns path time in seconds, and
/// the fraction. The view along the nose always contains the horizon, and the terrain has a border.
fn left_turn_over_land(sequence: &Sequence) -> Result<(f64, f64), ReproduceError> {
    let (start_s, end_s) = sequence.path.span_s();
    let trajectory = &sequence.path.trajectory;
    let left_yaw_rate = |t_s: f64| {
        -(-2..=2).map(|k| trajectory.state(t_s + 0.5 * f64::from(k)).rate_body_rad_s.z).sum::<f64>()
    };
    // One frame per second, with room for the effects at both ends.
    let each_second = test_bench::with_shutter(sequence, start_s + 3.0, ShutterSpec::default());
    let reference = test_bench::reference(&each_second)?;
    let instants: Vec<(u64, f64)> =
        (0..(end_s - start_s - 6.0).max(1.0) as u64).map(|i| (i, start_s + 3.0 + i as f64)).collect();
    let largest_rate = instants.iter().map(|(_, t_s)| left_yaw_rate(*t_s)).fold(f64::MIN, f64::max);
    let [width, height] = sequence.scenario.camera.size_px;
    let land_fraction = |frame: u64| {
        let view = reference.view(frame);
        let step = (width / 32).max(1) as usize;
        let pixels = (0..height).step_by(step).flat_map(|y| (0..width).step_by(step).map(move |x| [x, y]));
        let hits: Vec<bool> = pixels
            .filter_map(|pixel| view.sample(pixel, DVec2::ZERO, 0.0))
            .map(|sample| sample.hit.is_some())
            .collect();
        hits.iter().filter(|hit| **hit).count() as f64 / hits.len().max(1) as f64
    };
    let turns = instants
        .into_iter()
        .filter(|(_, t_s)| left_yaw_rate(*t_s) >= 0.5 * largest_rate)
        .map(|(frame, t_s)| (t_s, land_fraction(frame)));
    Ok(turns.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((start_s, 0.0)))
}

/// Source errors of the paper's RK2 at one phase of the exposure, in pixels of its ideal frame, and the
/// number of compared pixels whose source is outside of that frame.
fn paper_errors(
    setup: &Setup<'_>,
    sequence: &Arc<Sequence>,
    phase: f64,
) -> Result<(ErrorStats, usize), ReproduceError> {
    let ideal = PaperIdealFrame::render(setup.engine, sequence, sequence.start_s)?;
    let key = IdealView { pose: ideal.pose, ideal: ideal.geometry };
    let reference = test_bench::reference(sequence)?;
    let view = reference.view(0);
    let [width, height] = sequence.scenario.camera.size_px;
    let (mut errors, mut outside) = (Vec::new(), 0);
    for y in (0..height).step_by(STEP_PX as usize) {
        for x in (0..width).step_by(STEP_PX as usize) {
            let Some(sample) = view.sample([x, y], DVec2::ZERO, phase) else { continue };
            let source_px = ideal.source_px(
                sample.uv,
                sample.t_s - sequence.start_s,
                DisplacementModel::Rk2(2.5_f64.to_radians()),
            );
            let truth_px = key.source_px(&sample);
            if !ideal.geometry.contains(source_px) || !ideal.geometry.contains(truth_px) {
                outside += 1;
                continue;
            }
            errors.push(source_px.distance(truth_px));
        }
    }
    Ok((ErrorStats::of(errors), outside))
}

// Long because: a list of effects and their figures.
pub(super) fn run(setup: &Setup<'_>) -> Result<ExperimentReport, ReproduceError> {
    let mut report = ExperimentReport::default();
    let (flight, name) = load(setup)?;
    let (turn_s, land) = left_turn_over_land(&flight)?;
    let motion = flight.path.trajectory.state(turn_s);
    report.notes.push(format!(
        "Flight: {name}. Instant: {turn_s:.1} s, in the left turn with the most land in view ({:.0} % of the \
         frame; {:.1} deg/s about the body's down axis, {:.0} m/s). The paper's fisheye looks along the \
         nose. Delay, readout, exposure and field time are {EFFECT_S} s each. Errors are source errors \
         against the reference renderer, at every {STEP_PX}th pixel in x and y, in pixels of the ideal \
         frame.",
        100.0 * land,
        motion.rate_body_rad_s.z.to_degrees(),
        motion.velocity_ned_m_s.length()
    ));
    let effect_ms = 1e3 * EFFECT_S;
    let none = ShutterSpec::default();
    let effects = [
        ("nothing", turn_s, none.clone(), 0.0),
        ("delay, 1 s later", turn_s + EFFECT_S, ShutterSpec { delay_ms: effect_ms, ..none.clone() }, 0.0),
        ("rolling shutter", turn_s, ShutterSpec { readout_ms: effect_ms, ..none.clone() }, 0.0),
        ("exposure (its end)", turn_s, ShutterSpec { exposure_ms: effect_ms, ..none.clone() }, 0.5),
        ("interlacing", turn_s, ShutterSpec { interlace_ms: FieldOr::Ms(effect_ms), ..none }, 0.0),
    ];
    let mut table = Table::new(
        "Source errors, px",
        &[
            "effect",
            "paper: RMS",
            "99 %",
            "largest",
            "outside",
            "camsim: RMS",
            "99 %",
            "largest",
            "smooth: RMS",
            "silhouettes: RMS",
            "falsely valid",
            "missing",
        ],
    );
    let mut frames = Vec::new();
    for (name, stamp_s, shutter, phase) in effects {
        let sequence = test_bench::with_shutter(&flight, stamp_s, shutter);
        let (paper, outside) = paper_errors(setup, &sequence, phase)?;
        let finished =
            test_bench::render_at_phase(setup.engine, &sequence, &[Channel::Coords], [0], phase as f32)?
                .pop();
        let finished = finished.ok_or_else(|| ReproduceError::setup("the sequence", "it gave no frame"))?;
        let own = coord_errors(
            &test_bench::reference(&sequence)?,
            finished.plan.frame,
            &finished.plan.ideal_view(),
            &finished.frame,
            phase,
            STEP_PX,
        )
        .unwrap_or_default();
        frames.push(finished.frame);
        table.row([
            name.into(),
            short(paper.rms_px),
            short(paper.p99_px),
            short(paper.max_px),
            outside.to_string(),
            short(own.all.rms_px),
            short(own.all.p99_px),
            short(own.all.max_px),
            short(own.smooth.rms_px),
            short(own.silhouettes.rms_px),
            own.falsely_valid.to_string(),
            own.missing.to_string(),
        ]);
    }
    let delayed = test_bench::difference(&frames[0], &frames[1])?;
    report.notes.push(format!(
        "Fig. 21 (a) and (b), \"visually indistinguishable\" in the paper, differ in camsim by {:.1e} RMS of \
         the linear range, at most by {}.",
        delayed.rmse,
        short(delayed.max)
    ));
    report.tables.push(("fig21", table));
    report.pictures.push(Picture {
        name: "fig21",
        caption:
            "Fig. 21 by camsim: (a) no temporal distortion, (b) 1 s later with 1 s of delay, (c) 1 s of \
                  readout, (d) 1 s of exposure, (e) fields 1 s apart."
                .into(),
        frames,
        columns: 2,
        shrink: 1,
    });
    Ok(report)
}
