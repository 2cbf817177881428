//! 8.8: time constants of one second over terrain, through the fisheye (fig. 21).

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
    Picture, Report, ReproduceError, Setup, Table,
    displace::{Ideal, Model},
    rig, short,
};

/// Every time constant, seconds.
const LONG_S: f64 = 1.0;
/// Colour of the sky, sRGB: the paper's.
const SKY: [f64; 3] = [0.65, 0.85, 1.0];
/// Every so many pixels are compared with the oracle.
const STEP_PX: u32 = 4;

/// The flight over terrain: the paper's lawnmower log moved over an alpine valley, or the built-in flight.
fn load(setup: &Setup<'_>) -> Result<(Arc<Sequence>, &'static str), ReproduceError> {
    // As in the paper, the view is along the nose.
    let camera = CameraSpec { mount: Default::default(), ..rig::fisheye(setup.width_px) };
    let (scenario, name) = match setup.data {
        Some(data) => {
            let terrain = TerrainSpec {
                dem: data.join("terrain/sertig/sertig_valley.tif"),
                ortho: Some(data.join("terrain/sertig/sertig_valley_color.tif")),
                ..TerrainSpec::default()
            };
            let own = rig::scenario(camera);
            let scenario = Scenario {
                flight: FlightSpec {
                    log: data.join("flights/demo_sertig_lawnmower_x5.5.csv"),
                    ..own.flight.clone()
                },
                tracker: TrackerSpec::default(),
                scene: SceneSpec { terrain: Some(terrain), sky: SKY, ..own.scene.clone() },
                ..own
            };
            (
                scenario,
                "the paper's lawnmower log, moved and scaled over an alpine valley (the paper's own ground is not at hand)",
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

/// An instant in a left turn at least half as sharp as the sharpest one, path time, seconds: of those, one a
/// second, the one with most land in the picture; and how much that is. The paper's view along the nose
/// always has the horizon in it, and the land has an edge.
fn left_turn_over_land(sequence: &Sequence) -> Result<(f64, f64), ReproduceError> {
    let (start_s, end_s) = sequence.path.span_s();
    let trajectory = &sequence.path.trajectory;
    let left_rate = |t_s: f64| {
        -(-2..=2).map(|k| trajectory.state(t_s + 0.5 * f64::from(k)).rate_body_rad_s.z).sum::<f64>()
    };
    // One frame a second, far enough from both ends for every effect.
    let each_second = rig::at(sequence, start_s + 3.0, ShutterSpec::default());
    let oracle = rig::oracle(&each_second)?;
    let instants: Vec<(u64, f64)> =
        (0..(end_s - start_s - 6.0).max(1.0) as u64).map(|i| (i, start_s + 3.0 + i as f64)).collect();
    let sharpest = instants.iter().map(|(_, t_s)| left_rate(*t_s)).fold(f64::MIN, f64::max);
    let [width, height] = sequence.scenario.camera.size_px;
    let land = |frame: u64| {
        let view = oracle.view(frame);
        let step = (width / 32).max(1) as usize;
        let looks = (0..height).step_by(step).flat_map(|y| (0..width).step_by(step).map(move |x| [x, y]));
        let looks: Vec<bool> =
            looks.filter_map(|at| view.sample(at, DVec2::ZERO, 0.0)).map(|look| look.hit.is_some()).collect();
        looks.iter().filter(|hit| **hit).count() as f64 / looks.len().max(1) as f64
    };
    let turns = instants
        .into_iter()
        .filter(|(_, t_s)| left_rate(*t_s) >= 0.5 * sharpest)
        .map(|(frame, t_s)| (t_s, land(frame)));
    Ok(turns.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((start_s, 0.0)))
}

/// The paper's RK2 from the frame of the stamp against the oracle at one phase of the exposure, in pixels of
/// the ideal frame, and how many of the pixels looked at have their source outside of it.
fn paper_errors(
    setup: &Setup<'_>,
    sequence: &Arc<Sequence>,
    phase: f64,
) -> Result<(ErrorStats, usize), ReproduceError> {
    let ideal = Ideal::at(setup.engine, sequence, sequence.start_s)?;
    let key = IdealView { pose: ideal.pose, ideal: ideal.geometry };
    let oracle = rig::oracle(sequence)?;
    let view = oracle.view(0);
    let [width, height] = sequence.scenario.camera.size_px;
    let (mut errors, mut outside) = (Vec::new(), 0);
    for y in (0..height).step_by(STEP_PX as usize) {
        for x in (0..width).step_by(STEP_PX as usize) {
            let Some(look) = view.sample([x, y], DVec2::ZERO, phase) else { continue };
            let found =
                ideal.source_px(look.uv, look.t_s - sequence.start_s, Model::Rk2(2.5_f64.to_radians()));
            let truth = key.source_px(&look);
            if !ideal.geometry.contains(found) || !ideal.geometry.contains(truth) {
                outside += 1;
                continue;
            }
            errors.push(found.distance(truth));
        }
    }
    Ok((ErrorStats::of(errors), outside))
}

pub(super) fn run(setup: &Setup<'_>) -> Result<Report, ReproduceError> {
    let mut report = Report::default();
    let (flight, name) = load(setup)?;
    let (turn_s, land) = left_turn_over_land(&flight)?;
    let motion = flight.path.trajectory.state(turn_s);
    report.notes.push(format!(
        "Flight: {name}. Instant: {turn_s:.1} s, the left turn with most land in the picture, {:.0} % of it, of those at least half as sharp as the sharpest ({:.1} deg/s about the \
         body's down axis, {:.0} m/s). The paper's fisheye looks along the nose; every \
         time constant is {LONG_S} s. Errors are distances of source coordinates from the oracle's, of every {STEP_PX}th pixel each way, in pixels of the ideal frame.",
        100.0 * land,
        motion.rate_body_rad_s.z.to_degrees(),
        motion.velocity_ned_m_s.length()
    ));
    let long_ms = 1e3 * LONG_S;
    let none = ShutterSpec::default();
    let effects = [
        ("nothing", turn_s, none.clone(), 0.0),
        ("delay, 1 s later", turn_s + LONG_S, ShutterSpec { delay_ms: long_ms, ..none.clone() }, 0.0),
        ("rolling shutter", turn_s, ShutterSpec { readout_ms: long_ms, ..none.clone() }, 0.0),
        ("exposure (its end)", turn_s, ShutterSpec { exposure_ms: long_ms, ..none.clone() }, 0.5),
        ("interlacing", turn_s, ShutterSpec { interlace_ms: FieldOr::Ms(long_ms), ..none }, 0.0),
    ];
    let mut table = Table::new(
        "Source coordinates against the oracle, px",
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
        let sequence = rig::at(&flight, stamp_s, shutter);
        let (paper, outside) = paper_errors(setup, &sequence, phase)?;
        let finished =
            rig::render_at_phase(setup.engine, &sequence, &[Channel::Coords], [0], phase as f32)?.pop();
        let finished = finished.ok_or_else(|| ReproduceError::made("the sequence", "it gave no frame"))?;
        let own = coord_errors(
            &rig::oracle(&sequence)?,
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
    let delayed = rig::difference(&frames[0], &frames[1])?;
    report.notes.push(format!(
        "Fig. 21 (a) and (b), \"visually indistinguishable\" in the paper: camsim's differ by {:.1e} RMS of the linear range, {} at most.",
        delayed.rmse,
        short(delayed.max)
    ));
    report.tables.push(("fig21", table));
    report.pictures.push(Picture {
        name: "fig21",
        caption: "Fig. 21 by camsim: (a) no temporal distortion, (b) 1 s later with 1 s of delay, (c) 1 s of readout, (d) 1 s of exposure, (e) fields 1 s apart.".into(),
        frames,
        columns: 2,
        shrink: 1,
    });
    Ok(report)
}
