//! A session that is renewed for other sequences gives bit for bit the frames of new sessions.

mod common;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    frame::RenderedFrame,
    photometric::GrayImage,
    scenario::{Channel, LensModel, LensSpec, PointSpreadSpec, Preset, ShutterSpec},
    sequence::Sequence,
};
use camsim_engine::Session;
use common::{city, engine, pattern, render_exact, scenario, sequence, steady};
use glam::DVec3;

const COLOR: [Channel; 1] = [Channel::Color];
const TRUTH: [Channel; 3] = [Channel::Color, Channel::Depth, Channel::Coords];

fn base() -> Sequence {
    let mut scenario = scenario();
    scenario.camera.size_px = [96, 72];
    scenario.camera.focal_px = [80.0, 80.0];
    scenario.camera.mount.angles_deg = [0.0, -60.0, 0.0];
    scenario.camera.lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05] };
    scenario.camera.shutter = ShutterSpec { readout_ms: 20.0, exposure_ms: 6.0, ..ShutterSpec::default() };
    let trajectory = steady(80.0, 0.0, DVec3::new(9.0, 2.0, -1.0), DVec3::new(0.1, -0.05, 0.2));
    Sequence::clone(&sequence(scenario, trajectory, pattern(800.0)))
}

/// What somebody does to a camera, one after the other; each step changes other things on the device.
fn steps() -> Vec<(&'static str, Sequence, &'static [Channel])> {
    let base = base();
    let with = |change: &dyn Fn(&mut Sequence)| {
        let mut changed = base.clone();
        change(&mut changed);
        changed
    };
    let mut other_scene = base.clone();
    other_scene.scene = Arc::new(city(3));
    let vignette = GrayImage { size_px: [2, 1], values: vec![0.5, 1.0] };
    vec![
        ("the first", base.clone(), &COLOR),
        ("another lens", with(&|s| s.scenario.camera.lens.coefficients = vec![0.1, 0.0]), &COLOR),
        ("no lens", with(&|s| s.scenario.camera.lens = LensSpec::default()), &COLOR),
        (
            "noise, so that the ideal frame stays",
            with(&|s| s.scenario.camera.photometric.noise_sigma = 0.1),
            &COLOR,
        ),
        (
            "a point spread",
            with(&|s| {
                let blur = PointSpreadSpec { sigma_px: Some(0.8), glare: 0.05, ..PointSpreadSpec::default() };
                s.scenario.camera.point_spread = Some(blur);
                s.scenario.camera.photometric.noise_sigma = 0.1;
            }),
            &COLOR,
        ),
        ("a vignette", with(&|s| s.vignette = Some(Arc::new(vignette.clone()))), &COLOR),
        (
            "smaller",
            with(&|s| (s.scenario.camera.size_px, s.scenario.camera.focal_px) = ([48, 36], [40.0, 40.0])),
            &COLOR,
        ),
        ("with truth", base.clone(), &TRUTH),
        ("another scene", other_scene, &TRUTH),
        ("the paper's methods", with(&|s| s.scenario.quality.preset = Preset::Paper), &COLOR),
        ("as in the beginning", base.clone(), &COLOR),
    ]
}

fn next(session: &mut Session<'_>, frame: u64) -> RenderedFrame {
    let mut done = RenderedFrame::default();
    let mut keep = |finished: camsim_engine::Finished| {
        done = finished.frame;
        Ok(())
    };
    session.render::<Infallible>([frame], &mut keep).expect("render");
    done
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn renewed_session_gives_the_frames_of_a_new_session() {
    let engine = engine();
    let mut session = engine.session::<Infallible>(Arc::new(base()), &COLOR).expect("session");
    let mut last: Vec<f32> = Vec::new();
    for (what, changed, channels) in steps() {
        let changed = Arc::new(changed);
        session.renew::<Infallible>(changed.clone(), channels).expect(what);
        for frame in [3, 9] {
            let renewed = next(&mut session, frame);
            let fresh = render_exact(&engine, &changed, channels, frame).frame;
            assert_eq!(renewed.color_rgba(), fresh.color_rgba(), "{what}: colour of frame {frame}");
            assert_eq!(renewed.depth_m(), fresh.depth_m(), "{what}: depth of frame {frame}");
            assert_eq!(renewed.coords(), fresh.coords(), "{what}: coordinates of frame {frame}");
            if frame == 9 {
                assert_ne!(renewed.color_rgba(), last, "{what}: the change shows");
                last = renewed.into_color();
            }
        }
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn refused_sequence_leaves_the_session_unchanged() {
    let engine = engine();
    let good = Arc::new(base());
    let mut session = engine.session::<Infallible>(good.clone(), &COLOR).expect("session");
    let mut bad = base();
    bad.scenario.camera.focal_px = [0.0, 0.0];
    session.renew::<Infallible>(Arc::new(bad), &COLOR).expect_err("no focal length");
    // Few pixels, but more along a side than a texture has: lens map and vignette are textures.
    let mut wide = base();
    wide.scenario.camera.size_px = [engine.gpu().expect("an adapter").max_side_px() + 1, 4];
    let refused = session.renew::<Infallible>(Arc::new(wide), &COLOR).expect_err("too wide").to_string();
    // Some adapters hold as much as a scenario may ask for.
    let expected = if engine.gpu().expect("an adapter").max_side_px() < 32_768 {
        ["a side of the output frame needs", "reduce camera.size_px"]
    } else {
        ["camera.size_px is", "32768"]
    };
    assert!(expected.iter().all(|text| refused.contains(text)), "{refused}");
    assert_eq!(
        next(&mut session, 3).color_rgba(),
        render_exact(&engine, &good, &COLOR, 3).frame.color_rgba()
    );
}
