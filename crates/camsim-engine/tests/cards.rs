//! Plans for graphics cards: sampling fine enough without a search.

mod common;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Auto, Channel, MountSpec, Scenario},
    sequence::Sequence,
};
use camsim_engine::{Engine, Finished};
use camsim_plan::{AdapterClass, Renderer};
use common::{city, engine, rolling, scenario, sequence, steady};
use glam::DVec3;

const FRAME: u64 = 2;

fn camera() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [130.0; 2];
    scenario.camera.mount = MountSpec { angles_deg: [2.0, -50.0, 5.0], ..MountSpec::default() };
    scenario.camera.shutter = rolling(30.0, 8.0);
    scenario
}

fn flight(scenario: Scenario) -> Arc<Sequence> {
    let flight = steady(150.0, 10.0, DVec3::new(20.0, 5.0, 1.0), DVec3::new(0.1, -0.2, 0.3));
    sequence(scenario, flight, city(6))
}

fn card() -> Engine {
    let mut engine = engine();
    engine.plan_for(AdapterClass::Card);
    engine
}

fn rendered(engine: &Engine, sequence: &Arc<Sequence>) -> Finished {
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color]).expect("a session");
    let mut found = None;
    let mut keep = |finished| {
        found = Some(finished);
        Ok(())
    };
    session.render::<Infallible>([FRAME], &mut keep).expect("rendered");
    found.expect("one frame")
}

/// RMS error of a picture, 1/255 of the linear range.
fn error_dn(finished: &Finished, sequence: &Arc<Sequence>) -> f64 {
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a reference");
    let options = RenderOptions { min_samples: 16, max_samples: 64, ..RenderOptions::default() };
    let exact = reference.render(FRAME, &options);
    let pairs = finished.frame.color_rgba().iter().zip(exact.color_rgba());
    let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    255.0 * (squares / exact.color_rgba().len() as f64).sqrt()
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_card_draws_finer_and_keeps_the_tolerance() {
    let sequence = flight(camera());
    let [sparing, fine] = [engine(), card()].map(|engine| rendered(&engine, &sequence));
    let scale = |finished: &Finished| finished.plan.ideal.scale(&finished.plan.camera);
    eprintln!("scale {:.2} by a search, {:.2} for a card", scale(&sparing), scale(&fine));
    assert_eq!(fine.plan.placement.reverse, Renderer::Gpu);
    assert!(scale(&fine) >= scale(&sparing));
    let tolerance_dn = sequence.scenario.quality.max_error_dn;
    let [sparing_dn, fine_dn] = [&sparing, &fine].map(|finished| error_dn(finished, &sequence));
    eprintln!("{sparing_dn:.2} DN by a search, {fine_dn:.2} DN for a card");
    assert!(fine_dn <= tolerance_dn && fine_dn <= sparing_dn, "{fine_dn} DN, {sparing_dn} DN");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn what_the_scenario_gives_holds_on_a_card() {
    let mut scenario = camera();
    scenario.quality.ideal_scale = Auto::Value(1.7);
    scenario.quality.ideal_samples = Auto::Value(1);
    let plan = rendered(&card(), &flight(scenario)).plan;
    assert!((plan.ideal.scale(&plan.camera) - 1.7).abs() < 0.01, "{}", plan.ideal.scale(&plan.camera));
    assert_eq!(plan.samples_a_pixel, 1);
}

/// Where no fine plan keeps the tolerance, the search finds what the processor's plan has.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_tolerance_that_fine_plans_break_is_searched_for() {
    let mut scenario = camera();
    scenario.quality.max_error_dn = 0.02;
    let sequence = flight(scenario);
    let [sparing, fine] = [engine(), card()].map(|engine| rendered(&engine, &sequence).plan);
    assert_eq!(fine.ideal.size_px, sparing.ideal.size_px);
    assert_eq!(fine.blur, sparing.blur);
}
