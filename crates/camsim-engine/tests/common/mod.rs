//! Engines, frames and fixtures of this crate's tests.

#![allow(dead_code, reason = "each test binary uses its part")]

#[path = "../../../camsim-cpu/tests/fixtures/mod.rs"]
pub mod fixtures;
pub mod rays;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{scenario::Channel, sequence::Sequence};
use camsim_engine::{AdapterChoice, Backend, Engine, Finished, IdealPlanes, Session};

pub use fixtures::*;

/// The software adapter, so that figures compare between machines, or the one that `CAMSIM_ADAPTER` names.
pub fn engine() -> Engine {
    Engine::new(AdapterChoice::Software)
        .expect("tests need a software Vulkan adapter; CAMSIM_SKIP_GPU=1 skips them")
}

/// The same adapter for all passes, also those that the cpu renderer makes in less time.
pub fn gpu_engine() -> Engine {
    let mut engine = engine();
    engine.set_backend(Backend::Gpu);
    engine
}

/// The gpu and the cpu renderer, each for all passes.
pub fn both_engines() -> [(&'static str, Engine); 2] {
    [("gpu", gpu_engine()), ("cpu", Engine::cpu())]
}

/// Whether textures are read and triangles drawn by code. Circuits weigh texels with 8 bits of fraction, and
/// move corners to multiples of 1/256 px.
pub fn is_software(engine: &Engine) -> bool {
    engine.gpu().expect("an adapter").adapter.kind == "software"
}

/// Renders one frame with the given coordinates phase. Coordinates are those that the picture is made by.
pub fn render_at_phase(
    engine: &Engine,
    sequence: &Arc<Sequence>,
    channels: &[Channel],
    frame: u64,
    phase: f32,
) -> Finished {
    let mut session = engine.session::<Infallible>(sequence.clone(), channels).expect("session");
    session.set_coords_phase(phase);
    session.set_looked_up_coords(true);
    render_one(session, frame)
}

/// Renders one frame. Coordinates are those of exact rays.
pub fn render_exact(engine: &Engine, sequence: &Arc<Sequence>, channels: &[Channel], frame: u64) -> Finished {
    render_one(engine.session::<Infallible>(sequence.clone(), channels).expect("session"), frame)
}

fn render_one(mut session: Session<'_>, frame: u64) -> Finished {
    let mut found = None;
    session
        .render::<Infallible>([frame], &mut |finished| {
            found = Some(finished);
            Ok(())
        })
        .expect("render");
    found.expect("one frame")
}

/// Renders one frame.
pub fn render(engine: &Engine, sequence: &Arc<Sequence>, channels: &[Channel], frame: u64) -> Finished {
    render_at_phase(engine, sequence, channels, frame, 0.0)
}

/// Frame 0 with coordinates of the given phase, and the ideal frame that it was gathered from.
pub fn render_with_ideal(sequence: &Arc<Sequence>, phase: f32) -> (Finished, IdealPlanes) {
    let engine = engine();
    let mut session =
        engine.session::<Infallible>(sequence.clone(), &[Channel::Color, Channel::Coords]).expect("session");
    session.set_coords_phase(phase);
    let mut found = None;
    let mut keep = |finished| {
        found = Some(finished);
        Ok(())
    };
    session.render::<Infallible>([0], &mut keep).expect("render");
    let ideal = session.read_ideal().expect("readable").expect("drawn");
    (found.expect("one frame"), ideal)
}
