//! The shadow of something that moves, beside that thing, against the reference renderer.

use std::sync::Arc;

use camsim_core::{
    scenario::{Channel, ShutterSpec},
    scene::{
        Mesh, RigidMotion, Scene,
        motion::{Between, Curve, Joint, JointFrame, Keys, Track},
    },
    sequence::Sequence,
};
use camsim_engine::Engine;
use glam::{DQuat, DVec3};

use crate::{
    block, by_reference,
    common::{engine, render, sequence, steady},
    level_ground, light, looking_down, psnr_db,
};

/// A box that flies 9 m above level ground at 30 m/s, past a lower one that stands, or without it.
fn passing(flies: bool) -> Arc<Sequence> {
    let drift_m = DVec3::new(10.0, 30.0, 0.0);
    let times_s = vec![-1.0, 1.0];
    let keys = Keys {
        position: Curve::new(times_s.clone(), vec![-drift_m, drift_m], Between::Linear).expect("keys"),
        rotation: Curve::new(times_s, vec![DQuat::IDENTITY; 2], Between::Linear).expect("keys"),
        start_s: 0.0,
        repeat: None,
    };
    let motion = RigidMotion::new(vec![Joint::new(JointFrame::IDENTITY, Track::Keys(keys))]);
    let house = block(DVec3::new(9.0, 16.0, 0.0), [3.0, 3.0], 5.0, 90);
    let flier = block(DVec3::new(-4.0, -4.0, -9.0), [2.0, 3.0], 2.0, 60);
    let flier = Mesh { motion: Some(Arc::new(motion)), ..flier };
    let light = light();
    let scene = Scene {
        terrain: Some(level_ground(&light)),
        meshes: if flies { vec![house, flier] } else { vec![house] },
        light: Some(light),
        ..Scene::default()
    };
    let mut scenario = looking_down([120, 90], 150.0);
    scenario.camera.shutter = ShutterSpec { readout_ms: 30.0, exposure_ms: 10.0, ..ShutterSpec::default() };
    sequence(scenario, steady(60.0, 0.0, DVec3::new(15.0, 0.0, 0.0), DVec3::ZERO), scene)
}

fn expect_passing(who: &str, engine: &Engine) {
    let [with, without] = [true, false].map(passing);
    let (truth, bare) = (by_reference(&with), by_reference(&without));
    let changed: Vec<bool> =
        truth.chunks_exact(4).zip(bare.chunks_exact(4)).map(|(a, b)| (a[0] - b[0]).abs() > 0.02).collect();
    let count = changed.iter().filter(|&&changed| changed).count();
    let found = render(engine, &with, &[Channel::Color], 0).frame.into_color();
    let [changed_db, others_db] = psnr_db(&truth, &found, &changed);
    eprintln!(
        "{who}: {changed_db:.1} dB in {count} px that it or its shadow changes, {others_db:.1} dB elsewhere"
    );
    // Without the shadow it is 16 dB.
    assert!(count > 300 && changed_db > 36.0 && others_db > 40.0, "{who}: {changed_db} {others_db} {count}");
}

#[test]
fn cpu_has_the_shadow_of_what_moves() {
    expect_passing("cpu", &Engine::cpu());
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn gpu_has_the_shadow_of_what_moves() {
    expect_passing("gpu", &engine());
}
