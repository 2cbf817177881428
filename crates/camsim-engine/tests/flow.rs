//! Flows against those of the reference renderer, against each other, and as the means to warp a picture.

mod common;

use std::sync::Arc;

use camsim_core::{
    frame::{PlaneValues, RenderedFrame},
    reference::{FlowErrors, ReferenceRenderer, RenderOptions, coverage_errors, flow_errors},
    scenario::{Channel, FieldOr, FlowInstant, FlowState, MountSpec, Readout, Scenario},
    scene::{Encoding, Mesh, Scene, SceneObject, Terrain, Texture},
    sequence::Sequence,
};
use camsim_engine::Engine;
use common::{barrel_lens, render, rolling, roof, scenario, sequence, steady};
use glam::{DVec2, DVec3};

/// A name, and what is different in the scenario.
type Change = (&'static str, fn(&mut Scenario));

const SIZE_PX: [u32; 2] = [96, 72];
const FRAME: u64 = 20;
const STEP: u64 = 10;
const NEAR_PX: f64 = 0.05;
const FLOWS: [Channel; 5] =
    [Channel::Flow, Channel::FlowBack, Channel::FlowGlobal, Channel::Motion, Channel::BlurPath];

/// A picture of smooth waves, a few pixels long in the frames.
fn waves() -> Arc<Texture> {
    let wave = |i: u32| {
        let (x, y) = (f64::from(i % 512), f64::from(i / 512));
        let value =
            |k: f64| 127.0 + 50.0 * (0.33 * k * x + 0.15 * y).sin() + 50.0 * (0.39 * y - 0.12 * k * x).cos();
        [value(1.0) as u8, value(1.3) as u8, value(0.7) as u8, 255]
    };
    let rgba8 = (0..512 * 512).flat_map(wave).collect();
    Arc::new(Texture { size_px: [512, 512], rgba8, encoding: Encoding::Linear })
}

fn camera(change: impl Fn(&mut Scenario), scene: Scene) -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [70.0, 72.0];
    scenario.camera.lens = barrel_lens();
    scenario.camera.mount = MountSpec { angles_deg: [1.0, -50.0, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = rolling(25.0, 8.0);
    scenario.output.flow_step = STEP as u32;
    change(&mut scenario);
    let flight = steady(100.0, 0.0, DVec3::new(20.0, 15.0, -2.0), DVec3::new(0.05, -0.1, 0.15));
    sequence(scenario, flight, scene)
}

/// Hills with roofs over them.
fn hills() -> Scene {
    let heights: Vec<f64> = (0..129 * 129)
        .map(|i| 14.0 * (f64::from(i % 129) * 0.4).sin() * (f64::from(i / 129) * 0.3).cos())
        .collect();
    let terrain = Terrain::from_heights(129, 129, 8.0, &heights, Some(waves())).expect("heights");
    let high = Mesh { object: 2, ..roof(50.0, 8.0) };
    let low = Mesh { object: 3, origin_ned_m: DVec3::new(90.0, 10.0, -30.0), ..roof(30.0, 14.0) };
    let objects = ["terrain", "high", "low"].map(|name| SceneObject { name: name.into(), class: 0 }).to_vec();
    let meshes = vec![high, low];
    Scene { terrain: Some(terrain), meshes, objects, terrain_object: 1, ..Scene::default() }
}

/// A picture on level ground.
fn ground() -> Scene {
    Scene { meshes: vec![Mesh::level_picture(waves(), DVec3::ZERO, 1500.0)], ..Scene::default() }
}

fn readouts() -> [Change; 5] {
    [
        ("rows", |_| {}),
        ("rows from below", |s| s.camera.shutter.readout = Readout::BottomToTop),
        ("columns", |s| s.camera.shutter.readout = Readout::LeftToRight),
        ("interlaced", |s| s.camera.shutter.interlace_ms = FieldOr::Field),
        ("last row", |s| s.output.flow_instant = FlowInstant::LastRow),
    ]
}

fn errors(reference: &ReferenceRenderer, frame: &RenderedFrame) -> Vec<FlowErrors> {
    flow_errors(reference, FRAME, frame, NEAR_PX, usize::MAX)
}

#[test]
fn flows_are_those_of_the_reference_renderer() {
    for (name, change) in readouts() {
        let sequence = camera(change, hills());
        let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
        let frame = render(&Engine::cpu(), &sequence, &FLOWS, FRAME).frame;
        let errors = errors(&reference, &frame);
        assert_eq!(errors.iter().map(|of| of.channel).collect::<Vec<_>>(), FLOWS);
        for FlowErrors { channel, away, near, states, beyond, faults, .. } in errors {
            eprintln!("{name} {channel:?}: {away:?} {near:?} {beyond} {states:?}");
            let most = if channel == Channel::Motion { 0.05 } else { 2e-3 };
            assert!(away.pixels > 2500 && away.max < most, "{name} {channel:?}: {away:?}");
            assert!(away.wrong_states * 1000 <= away.looked_at, "{name} {channel:?}: {away:?}");
            assert_eq!(faults, 0, "{name} {channel:?}");
            let has_hidden = states[FlowState::Occluded as usize].iter().sum::<u64>() > 20;
            let shows_all = matches!(channel, Channel::FlowGlobal | Channel::Motion | Channel::BlurPath);
            assert!(has_hidden || shows_all, "{name} {channel:?}: {states:?}");
        }
    }
}

#[test]
fn the_reference_renderer_finds_no_fault_in_its_own_flows_and_each_that_is_planted() {
    let sequence = camera(|_| {}, hills());
    let reference = ReferenceRenderer::new(sequence).expect("a usable camera");
    let channels = [&FLOWS[..], &[Channel::Coverage]].concat();
    let options = RenderOptions { channels, min_samples: 1, max_samples: 32, ..RenderOptions::default() };
    let right = reference.render(FRAME, &options);
    // Planes are stored in single precision.
    assert!(errors(&reference, &right).iter().all(|of| of.beyond == 0 && of.away.max < 1e-3));
    let coverage = coverage_errors(&reference, FRAME, &right, 1000).expect("coverage");
    assert!(coverage.faults == 0 && coverage.max < 1e-6 && coverage.pixels > 500, "{coverage:?}");

    let parts = |channel| match channel {
        Channel::Motion => 2,
        Channel::BlurPath => 4,
        Channel::Coverage => 1,
        _ => 3,
    };
    let i = 40 * SIZE_PX[0] as usize + 30;
    // (component, what is added to it)
    for (channel, component, fault) in [
        (Channel::Flow, 0, 0.3),
        (Channel::Flow, 2, 1.0),
        (Channel::FlowBack, 1, f32::NAN),
        (Channel::FlowGlobal, 1, -0.3),
        (Channel::Motion, 0, 30.0),
        (Channel::BlurPath, 3, 0.3),
    ] {
        let mut wrong = right.clone();
        for plane in wrong.planes.iter_mut().filter(|plane| plane.channel == channel) {
            let PlaneValues::Float(values) = &mut plane.values else { continue };
            values[parts(channel) * i + component] += fault;
        }
        let found = errors(&reference, &wrong);
        let faults: Vec<u64> = found.iter().map(|of| of.faults).collect();
        let expected: Vec<u64> = found.iter().map(|of| u64::from(of.channel == channel)).collect();
        assert_eq!(faults, expected, "{channel:?} {component}");
    }
    let mut wrong = right.clone();
    for plane in wrong.planes.iter_mut().filter(|plane| plane.channel == Channel::Coverage) {
        let PlaneValues::Float(values) = &mut plane.values else { continue };
        values.iter_mut().skip(i).step_by(97).for_each(|value| *value = 0.5);
    }
    assert!(coverage_errors(&reference, FRAME, &wrong, 7000).expect("coverage").faults > 10);
}

/// Bilinear value of a plane at a position, if its four pixels are valid by `accepts`.
fn read<const N: usize>(values: &[f32], px: DVec2, accepts: impl Fn(usize) -> bool) -> Option<[f64; N]> {
    let [width, height] = SIZE_PX.map(|side| side as usize);
    let corner = px.floor();
    if corner.min_element() < 0.0 || corner.x + 1.0 >= width as f64 || corner.y + 1.0 >= height as f64 {
        return None;
    }
    let fraction = px - corner;
    let first = corner.y as usize * width + corner.x as usize;
    let four = [
        (first, (1.0 - fraction.x) * (1.0 - fraction.y)),
        (first + 1, fraction.x * (1.0 - fraction.y)),
        (first + width, (1.0 - fraction.x) * fraction.y),
        (first + width + 1, fraction.x * fraction.y),
    ];
    four.iter().all(|&(i, _)| accepts(i)).then(|| {
        std::array::from_fn(|k| four.iter().map(|&(i, weight)| weight * f64::from(values[N * i + k])).sum())
    })
}

fn shift(flow: &[f32], i: usize) -> (DVec2, bool) {
    let is_visible = flow[3 * i + 2] == f32::from(FlowState::Visible as u8);
    (DVec2::new(flow[3 * i].into(), flow[3 * i + 1].into()), is_visible)
}

fn position(i: usize) -> DVec2 {
    DVec2::new((i as u32 % SIZE_PX[0]).into(), (i as u32 / SIZE_PX[0]).into())
}

#[test]
fn forward_and_back_again_is_where_it_began() {
    let sequence = camera(|s| s.output.flow_step = 2, ground());
    let render = |channel, frame| {
        let done = render(&Engine::cpu(), &sequence, &[channel], frame);
        done.frame.floats(channel).expect("a plane").to_vec()
    };
    let (there, back) = (render(Channel::Flow, FRAME), render(Channel::FlowBack, FRAME + 2));
    let (mut count, mut most_px) = (0, 0.0_f64);
    for i in 0..there.len() / 3 {
        let (shift_px, is_visible) = shift(&there, i);
        if !is_visible {
            continue;
        }
        let Some([dx, dy, _]) = read::<3>(&back, position(i) + shift_px, |i| shift(&back, i).1) else {
            continue;
        };
        most_px = most_px.max((shift_px + DVec2::new(dx, dy)).length());
        count += 1;
    }
    eprintln!("{count} pixels there and back: {most_px:.1e} px");
    assert!(count > 4000 && most_px < 1e-3, "{count}: {most_px:.1e} px");
}

#[test]
fn a_frame_is_the_other_one_warped_by_flow() {
    let change = |s: &mut Scenario| {
        s.camera.shutter = rolling(25.0, 0.0);
        s.output.flow_step = 2;
    };
    let sequence = camera(change, hills());
    let render = |frame| {
        let channels = [Channel::Color, Channel::Flow, Channel::Object, Channel::Coverage];
        render(&Engine::cpu(), &sequence, &channels, frame).frame
    };
    let (first, other) = (render(FRAME), render(FRAME + 2));
    // What a pixel shows besides its object has a flow of its own.
    let object = |frame: &RenderedFrame, i: usize| {
        let is_whole = frame.floats(Channel::Coverage).is_some_and(|coverage| coverage[i] == 1.0);
        frame.indices(Channel::Object).map(|objects| objects[i]).filter(|_| is_whole)
    };
    let flow = first.floats(Channel::Flow).expect("a plane");
    let width = SIZE_PX[0] as usize;
    // A straight line through two pixels is off by an eighth of the second difference in their middle.
    let bend = |i: usize, k: usize| {
        let at = |i: usize| f64::from(other.color_rgba()[4 * i + k]);
        [1, width].map(|step| (at(i - step) - 2.0 * at(i) + at(i + step)) / 8.0).iter().sum::<f64>()
    };
    let mut squares = [0.0_f64; 3];
    let mut count = 0.0;
    for i in 0..flow.len() / 3 {
        let (shift_px, is_visible) = shift(flow, i);
        let here = object(&first, i).filter(|_| is_visible);
        if here.is_none() {
            continue;
        }
        let warped = read::<4>(other.color_rgba(), position(i) + shift_px, |i| object(&other, i) == here);
        let Some(warped) = warped else { continue };
        let seen = (position(i) + shift_px).round().as_u64vec2();
        let nearest = seen.y as usize * width + seen.x as usize;
        if nearest < width || nearest + width >= flow.len() / 3 {
            continue;
        }
        for (k, value) in warped.iter().enumerate().take(3) {
            squares[2] += bend(nearest, k).powi(2);
            let here = f64::from(first.color_rgba()[4 * i + k]);
            squares[0] += (value - here).powi(2);
            squares[1] += (f64::from(other.color_rgba()[4 * i + k]) - here).powi(2);
        }
        count += 3.0;
    }
    let [warped_db, unwarped_db, resampled_db] = squares.map(|sum| -10.0 * (sum / count).log10());
    eprintln!(
        "{} pixels: {warped_db:.1} dB warped, {unwarped_db:.1} dB as they are, {resampled_db:.1} dB halfway between pixels",
        count / 3.0
    );
    assert!(count > 3.0 * 4000.0);
    // Both frames have their own resampling, too.
    assert!(warped_db > resampled_db - 3.0 && warped_db > unwarped_db + 10.0);
}
