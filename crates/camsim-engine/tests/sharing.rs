//! Several output frames from one ideal frame: it is drawn once, sources are exact, and the order of frames
//! does not matter.

mod common;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    mount::CameraPath,
    pose::BodyState,
    reference::{ReferenceRenderer, coord_errors},
    scenario::{Axis, Channel, LensModel, LensSpec, MountSpec, ShutterSpec, VibrationSpec},
    sequence::Sequence,
    trajectory::Trajectory,
};
use camsim_engine::{Engine, Finished};
use camsim_plan::{FramePlan, PlanError, Planner, TemporalStage};
use common::{engine, pattern, render_at_phase, scenario, sequence, steady};
use glam::DVec3;

const ALL: [Channel; 3] = [Channel::Color, Channel::Coords, Channel::Depth];
/// Two groups of eight.
const FRAMES: u64 = 16;

/// So much that no frame is cheap by the twist of its own instant: over so little detail one of its own would
/// cost less than its part of a common one.
const SHAKING: VibrationSpec =
    VibrationSpec { axis: Axis::Roll, amplitude_deg: 0.05, amplitude_m: 0.0, hz: 40.0, phase_deg: 0.0 };

/// Over a pattern, with every effect that moves a pixel's source.
fn flight(velocity_ned_m_s: DVec3, rate_rad_s: DVec3, frames_per_ideal: u32) -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [130.0, 130.0];
    scenario.camera.fps = 30.0;
    scenario.camera.mount =
        MountSpec { angles_deg: [0.0, -60.0, 0.0], vibration: vec![SHAKING], ..MountSpec::default() };
    scenario.camera.shutter = ShutterSpec { readout_ms: 20.0, exposure_ms: 6.0, ..ShutterSpec::default() };
    scenario.camera.lens =
        LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05, 0.001, -0.002] };
    scenario.quality.frames_per_ideal = frames_per_ideal;
    let mut sequence =
        Sequence::clone(&sequence(scenario, steady(80.0, 0.0, velocity_ned_m_s, rate_rad_s), pattern(800.0)));
    sequence.frames = FRAMES;
    Arc::new(sequence)
}

fn flights() -> [(&'static str, Arc<Sequence>); 2] {
    let turn = DVec3::new(0.1, -0.05, 0.2);
    [("flown past", flight(DVec3::new(9.0, 2.0, -1.0), turn, 8)), ("turned", flight(DVec3::ZERO, turn, 8))]
}

fn rendered(
    engine: &Engine,
    sequence: &Arc<Sequence>,
    channels: &[Channel],
    frames: impl IntoIterator<Item = u64>,
) -> Vec<Finished> {
    let mut session = engine.session::<Infallible>(sequence.clone(), channels).expect("session");
    assert!(session.time_passes(), "software adapters have time stamps");
    let mut done = Vec::new();
    let mut keep = |finished| {
        done.push(finished);
        Ok(())
    };
    session.render::<Infallible>(frames, &mut keep).expect("render");
    done
}

fn is_drawn(done: &Finished) -> bool {
    done.times.ideal_ms.is_some() || done.times.passes.iter().any(|pass| pass.name == "ideal")
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn shared_ideal_frame_is_drawn_once_with_exact_sources() {
    let engine = engine();
    for (name, sequence) in flights() {
        let plain = rendered(&engine, &sequence, &[Channel::Color], 0..FRAMES);
        let own = flight_of_its_own(&sequence);
        let apart = rendered(&engine, &own, &[Channel::Color], 0..FRAMES);
        assert_eq!(plain.iter().filter(|done| is_drawn(done)).count(), 2, "{name}");
        assert_eq!(apart.iter().filter(|done| is_drawn(done)).count(), FRAMES as usize, "{name}");
        for frame in [0, 3, 7, 8, 15] {
            let group = frame / 8 * 8;
            let first = &plain[frame as usize];
            assert_eq!(
                (first.plan.shared_frames, first.plan.has_displaced_key()),
                (Some([group, group + 7]), true),
                "{name}"
            );
            for phase in [0.0, -0.5] {
                let done = render_at_phase(&engine, &sequence, &ALL, frame, phase);
                assert!(
                    done.frame.color_rgba() == first.frame.color_rgba(),
                    "{name}, {frame}: asking for the truth changes no colour"
                );
                let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
                let errors = coord_errors(
                    &reference,
                    done.plan.frame,
                    &done.plan.ideal_view(),
                    &done.frame,
                    f64::from(phase),
                    1,
                )
                .expect("coords were asked for");
                let p99_px = errors.all.p99_px;
                assert!(
                    errors.falsely_valid == 0 && errors.missing == 0 && errors.all.count > 19_000,
                    "{name}, {frame}: {errors:?}"
                );
                assert!(
                    p99_px <= done.plan.predicted.total_px && done.plan.predicted.source_error_kept,
                    "{name}, {frame}: {errors:?}"
                );
            }
            let off_dn = rms_dn(first, &apart[frame as usize]);
            eprintln!(
                "{name}, {frame}: {:?}, predicted {:.1e} px, {off_dn:.2}/255 from its own",
                first.plan.temporal, first.plan.predicted.total_px
            );
            // Each of them is within 1/255.
            assert!(off_dn < 2_f64.sqrt(), "{name}, {frame}: {off_dn}");
        }
        let stages: Vec<TemporalStage> = plain.iter().map(|done| done.plan.temporal).collect();
        assert_eq!(stages.contains(&TemporalStage::Rotation), name == "turned", "{stages:?}");
    }
}

fn flight_of_its_own(sequence: &Sequence) -> Arc<Sequence> {
    let mut own = sequence.clone();
    own.scenario.quality.frames_per_ideal = 1;
    Arc::new(own)
}

/// RMS difference, 1/255 of the linear range.
fn rms_dn(a: &Finished, b: &Finished) -> f64 {
    let squares: f64 =
        a.frame.color_rgba().iter().zip(b.frame.color_rgba()).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    255.0 * (squares / (0.75 * a.frame.color_rgba().len() as f64)).sqrt()
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn sharing_depends_on_the_scenario_only() {
    let engine = engine();
    let (_, sequence) = &flights()[0];
    let in_order = rendered(&engine, sequence, &[Channel::Color], 0..FRAMES);
    let shuffled = [9, 2, 15, 2, 7, 8, 0];
    for (frame, done) in shuffled.into_iter().zip(rendered(&engine, sequence, &[Channel::Color], shuffled)) {
        assert!(done.frame.color_rgba() == in_order[frame as usize].frame.color_rgba(), "{frame}");
    }
    let text = |plan: &FramePlan| format!("{plan:?}");
    let planner =
        Planner::new(sequence.clone(), &[Channel::Color], engine.gpu().expect("an adapter").max_side_px())
            .expect("a planner")
            .with_capabilities(engine.capabilities());
    for frame in [15, 4, 11, 4] {
        assert_eq!(text(&planner.plan(frame).expect("a plan")), text(&in_order[frame as usize].plan));
    }
}

#[test]
fn frames_far_apart_share_no_ideal_frame() {
    let group = |sequence: &Arc<Sequence>| {
        let planner = Planner::new(sequence.clone(), &[Channel::Color], 16_384).expect("a planner");
        let plan = planner.plan(5).expect("a plan");
        // One of both, and the description has it.
        assert_eq!(plan.shared_frames.is_none(), plan.unshared_reason.is_some());
        let told = plan
            .unshared_reason
            .map_or_else(|| "one for frames".to_owned(), |why| format!("for this frame alone ({why})"));
        assert!(
            plan.passes().iter().any(|pass| pass.starts_with("ideal: ") && pass.contains(&told)),
            "{:?}",
            plan.passes()
        );
        plan.shared_frames
    };
    let turning = |deg_s: f64| flight(DVec3::ZERO, DVec3::new(0.0, 0.0, deg_s.to_radians()), 8);
    assert_eq!(group(&turning(20.0)), Some([0, 7]));
    // 130 deg within eight frames.
    let fast = group(&turning(500.0));
    assert!(fast.is_none_or(|[first, last]| last - first < 4), "{fast:?}");
    assert_eq!(group(&flight(DVec3::ZERO, DVec3::ZERO, 1)), None);
    // The last group is as long as the flight.
    let mut short = Sequence::clone(&turning(20.0));
    short.frames = 6;
    assert_eq!(group(&Arc::new(short)), Some([0, 5]));
    // A single frame of a flight has nothing to share.
    let mut single = Sequence::clone(&turning(20.0));
    single.frames = 6;
    single.scenario.quality.frames_per_ideal = 5;
    assert_eq!(group(&Arc::new(single)), None);
}

/// The frame that a group is planned from by itself cannot be made; the others can.
#[test]
fn error_of_one_frame_does_not_affect_others() {
    let mut spun = Sequence::clone(&flight(DVec3::ZERO, DVec3::ZERO, 8));
    let knot = |k: i32| BodyState {
        position_ned_m: DVec3::new(0.0, 0.0, -80.0),
        // About frame 4, from half a period before its stamp on.
        rate_body_rad_s: DVec3::Z * if k == 8 { 20.0 } else { 0.0 },
        ..BodyState::default()
    };
    let trajectory =
        Trajectory::uniform(-0.5 / 30.0, 1.0 / 30.0, 1.0, (4..36).map(knot).collect()).expect("knots");
    spun.path = Arc::new(CameraPath::new(trajectory, &spun.scenario.camera.mount).expect("a legal mount"));
    let mut own = spun.clone();
    own.scenario.quality.frames_per_ideal = 1;
    let (spun, own) = (Arc::new(spun), Arc::new(own));
    let side =
        |frame| *planned(&own, 16_384, frame).expect("a plan").ideal.size_px.iter().max().expect("two sides");
    let [still, turned] = [0, 4].map(side);
    assert!(turned > still + 20, "{still} {turned}");
    let limit_px = (still + turned) / 2;
    assert!(matches!(planned(&spun, limit_px, 4), Err(PlanError::IdealTooLarge { frame: 4, .. })));
    assert!(planned(&spun, limit_px, 0).is_ok());
}

#[test]
fn too_large_ideal_frame_is_refused() {
    let with_size = |size_px: [u32; 2]| {
        let mut large = Sequence::clone(&flight(DVec3::ZERO, DVec3::ZERO, 1));
        large.scenario.camera.lens = LensSpec::default();
        large.scenario.camera.size_px = size_px;
        large.scenario.camera.focal_px = [6000.0, 6000.0];
        Arc::new(large)
    };
    assert!(planned(&with_size([6000, 4000]), 16_384, 0).is_ok());
    let large = with_size([8000, 9000]);
    let error = planned(&large, 16_384, 0).expect_err("more than 2^26 pixels").to_string();
    assert!(
        error.contains("frame 0")
            && error.contains("million pixels, more than 67 million")
            && error.contains("reduce camera.size_px"),
        "{error}"
    );
    // Who makes no ideal frame does not mind.
    let planner =
        Planner::new(large, &[Channel::Color], 16_384).expect("a planner").with_ideals_of_any_area();
    assert!(planner.plan(0).is_ok());
}

fn planned(sequence: &Arc<Sequence>, max_side_px: u32, frame: u64) -> Result<FramePlan, PlanError> {
    Planner::new(sequence.clone(), &[Channel::Color], max_side_px).expect("a planner").plan(frame)
}
