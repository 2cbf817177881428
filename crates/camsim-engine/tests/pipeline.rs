//! The frame pipeline: frames create no gpu objects, come in the requested order, and stop at the first
//! error.

mod common;

use std::{
    convert::Infallible,
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
};

use camsim_core::{
    scenario::{Channel, LensModel, LensSpec, MountSpec, Scenario, ShutterSpec, ZoomSpec},
    scene::{Scene, Terrain},
    sequence::Sequence,
};
use camsim_engine::{Engine, Finished, RenderError};
use camsim_plan::Backend;
use camsim_plan::Planner;
use common::{city, engine, pattern, scenario, sequence, steady};
use glam::DVec3;

const ALL: [Channel; 3] = [Channel::Color, Channel::Coords, Channel::Depth];
/// Rendered twice: whatever kind of frame there is among them, nothing is new the second time.
const FRAMES: u64 = 6;

fn small() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [64, 48];
    scenario.camera.focal_px = [52.0, 52.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -60.0, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = ShutterSpec { readout_ms: 20.0, exposure_ms: 6.0, ..ShutterSpec::default() };
    scenario.camera.lens =
        LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05, 0.001, -0.002] };
    scenario
}

/// Over a pattern: no silhouettes. `zoom`: the lens changes with every frame.
fn plain(zoom: bool) -> Arc<Sequence> {
    let mut scenario = small();
    let entry = |at, focal_px: f64, k1| ZoomSpec {
        at,
        focal_px: [focal_px; 2],
        principal_point_px: None,
        coefficients: vec![k1, 0.02, 0.0, 0.0],
    };
    if zoom {
        scenario.camera.zoom = vec![entry(1.0, 52.0, -0.2), entry(2.0, 60.0, -0.1)];
    }
    let mut sequence = Sequence::clone(&sequence(
        scenario,
        steady(80.0, 0.0, DVec3::new(9.0, 2.0, 0.0), DVec3::ZERO),
        pattern(400.0),
    ));
    if zoom {
        sequence.zoom_track = vec![(0.0, 1.0), (3.3, 2.0)];
    }
    Arc::new(sequence)
}

/// Over houses: silhouettes, several ideal frames.
fn houses() -> Arc<Sequence> {
    sequence(small(), steady(80.0, 0.0, DVec3::new(9.0, 2.0, 0.0), DVec3::ZERO), city(2))
}

/// Over ridges before the sky: silhouettes of ground alone.
fn ridges() -> Arc<Sequence> {
    let heights: Vec<f64> = (0..65 * 65)
        .map(|i| 40.0 * (f64::from(i / 65) * 0.4).sin().abs() + f64::from(i % 65) * 0.2)
        .collect();
    let terrain =
        Terrain::from_heights(65, 65, 10.0, &heights, Some(pattern(1.0).meshes[0].material.texture.clone()))
            .expect("a terrain");
    let mut scenario = small();
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -15.0, 0.0], ..MountSpec::default() };
    sequence(
        scenario,
        steady(90.0, 0.0, DVec3::new(9.0, 2.0, 0.0), DVec3::ZERO),
        Scene { terrain: Some(terrain), ..Scene::default() },
    )
}

/// What the device holds, by wgpu's own books: transient objects of a frame in flight are among it.
fn held(engine: &Engine) -> Vec<(&'static str, isize)> {
    let counters = engine.gpu().expect("an adapter").device.get_internal_counters().hal;
    vec![
        ("buffers", counters.buffers.read()),
        ("bytes of buffers", counters.buffer_memory.read()),
        ("bytes of textures", counters.texture_memory.read()),
        ("views", counters.texture_views.read()),
        ("bind groups", counters.bind_groups.read()),
        ("bind group layouts", counters.bind_group_layouts.read()),
        ("pipelines", counters.render_pipelines.read() + counters.compute_pipelines.read()),
        ("samplers", counters.samplers.read()),
        ("shader modules", counters.shader_modules.read()),
        ("command encoders", counters.command_encoders.read()),
        ("query sets", counters.query_sets.read()),
        ("fences", counters.fences.read()),
    ]
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn frames_create_no_gpu_objects() {
    let mut engine = engine();
    engine.set_backend(Backend::Gpu);
    for (name, sequence) in
        [("plain", plain(false)), ("zoom lens", plain(true)), ("houses", houses()), ("ridges", ridges())]
    {
        let mut session = engine.session::<Infallible>(sequence, &ALL).expect("session");
        session.render::<Infallible>(0..FRAMES, &mut |_| Ok(())).expect("render");
        let before = held(&engine);
        let counted = before.iter().filter(|(_, count)| *count > 0).count();
        assert!(
            counted >= before.len() - 1,
            "wgpu counts all of these, query sets only where frames are timed: {before:?}"
        );
        let mut most = before.clone();
        let mut keep_most = |_| {
            most.iter_mut().zip(held(&engine)).for_each(|(most, now)| most.1 = most.1.max(now.1));
            Ok(())
        };
        session.render::<Infallible>(0..FRAMES, &mut keep_most).expect("render");
        assert_eq!(most, before, "{name}: with a frame in flight, and before");
        assert_eq!(held(&engine), before, "{name}: after and before");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn frames_come_in_the_requested_order() {
    let engine = engine();
    let mut session = engine.session::<Infallible>(plain(false), &[Channel::Color]).expect("session");
    let order = [7, 3, 3, 11, 0, 5];
    let mut render = || {
        let (mut came, mut pictures) = (Vec::new(), Vec::new());
        let mut keep = |finished: Finished| {
            came.push(finished.frame.index);
            pictures.push(finished.frame.into_color());
            Ok(())
        };
        session.render::<Infallible>(order, &mut keep).expect("render");
        assert_eq!(came, order);
        pictures
    };
    let from_outside = render();
    assert!(from_outside[1] == from_outside[2] && from_outside[0] != from_outside[1]);
    // A thread of the pool that plans, which has no other: nobody else is there to plan while it waits.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    assert!(pool.install(render) == from_outside);
}

#[derive(Debug, PartialEq, thiserror::Error)]
#[error("no room for frame {0}")]
struct Full(u64);

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn frames_do_not_depend_on_the_number_of_threads() {
    let frames_of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let engine = engine();
            let mut session =
                engine.session::<Infallible>(houses(), &[Channel::Color, Channel::Depth]).expect("session");
            let mut frames = Vec::new();
            let mut keep = |Finished { frame, plan, .. }: Finished| {
                let plan = format!("{plan:?}");
                frames.push((frame.index, frame.planes, plan));
                Ok(())
            };
            session.render::<Infallible>(0..12, &mut keep).expect("render");
            frames
        })
    };
    let by_one = frames_of(1);
    for threads in [2, 16] {
        let by_many = frames_of(threads);
        assert_eq!(by_many.len(), by_one.len());
        for (one, many) in by_one.iter().zip(&by_many) {
            assert!(one == many, "frame {}, which is otherwise by {threads} threads", one.0);
        }
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn first_error_stops_the_run_and_the_session_stays_usable() {
    let engine = engine();
    let sequence = plain(false);
    let planned = Arc::new(AtomicU64::new(0));
    let mut session = engine.session::<Full>(sequence, &[Channel::Color]).expect("session");
    let mut came = Vec::new();
    for full_at in [0, 1, 4] {
        came.clear();
        planned.store(0, Ordering::Relaxed);
        let endless = (0..).inspect(|_| _ = planned.fetch_add(1, Ordering::Relaxed));
        let outcome = session.render(endless, &mut |finished| {
            let frame = finished.frame.index;
            came.push(frame);
            if frame < full_at { Ok(()) } else { Err(Full(frame)) }
        });
        assert!(matches!(outcome, Err(RenderError::Sink(Full(frame))) if frame == full_at), "{outcome:?}");
        assert!(came.iter().copied().eq(0..=full_at), "{came:?}");
        let begun = planned.load(Ordering::Relaxed);
        // A frame for each thread, or as many groups of eight that share an ideal frame as there are threads
        // for; another group, and the next frame.
        let ahead = rayon::current_num_threads().min(16).max(8 * Planner::groups_at_once()) as u64 + 8 + 1;
        assert!(begun <= full_at + ahead, "{begun} frames were begun for {full_at}");
    }
    // A plan that fails: the frames before it are handed over first.
    let mut sequence = Sequence::clone(&plain(true));
    sequence.zoom_track = vec![(0.0, 1.0), (0.11, 1.5), (0.12, f64::NAN)];
    let mut session = engine.session::<Full>(Arc::new(sequence), &[Channel::Color]).expect("session");
    let mut indices = |frames: Range<u64>| {
        let mut came = Vec::new();
        let outcome = session.render::<Full>(frames, &mut |finished| {
            came.push(finished.frame.index);
            Ok(())
        });
        (came, outcome)
    };
    let (came, outcome) = indices(0..10);
    assert!(matches!(outcome, Err(RenderError::Plan(_))), "{outcome:?}");
    assert_eq!(came, [0, 1, 2, 3]);
    let (came, outcome) = indices(0..3);
    assert!(outcome.is_ok() && came == [0, 1, 2], "{outcome:?}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn lost_device_is_an_error() {
    let mut engine = engine();
    engine.set_backend(Backend::Gpu);
    let sequence = houses();
    let mut whole = engine.session::<Infallible>(sequence.clone(), &[Channel::Color]).expect("session");
    engine.gpu().expect("an adapter").device.destroy();
    whole.render::<Infallible>([0], &mut |_: Finished| Ok(())).expect_err("a frame of a lost device");
    drop(whole);
    let made = engine.session::<Infallible>(sequence, &[Channel::Color]);
    let rendered = made.and_then(|mut session| session.render::<Infallible>([0], &mut |_: Finished| Ok(())));
    rendered.expect_err("a session of a lost device");
}

#[test]
fn a_cancelled_frame_leaves_the_session_usable() {
    let engine = Engine::cpu();
    let picture = |session: &mut camsim_engine::Session<'_>| {
        let mut came = Vec::new();
        let outcome = session.render::<Infallible>([3], &mut |finished| {
            came = finished.frame.into_color();
            Ok(())
        });
        (came, outcome)
    };
    let mut session = engine.session::<Infallible>(plain(false), &[Channel::Color]).expect("session");
    let cancel = Arc::new(AtomicBool::new(true));
    session.set_cancel(cancel.clone());
    let (came, outcome) = picture(&mut session);
    assert!(matches!(outcome, Err(RenderError::Cancelled)) && came.is_empty(), "{outcome:?}");
    cancel.store(false, Ordering::Relaxed);
    let again = picture(&mut session).0;
    let mut fresh = engine.session::<Infallible>(plain(false), &[Channel::Color]).expect("session");
    assert!(!again.is_empty() && again == picture(&mut fresh).0);
}
