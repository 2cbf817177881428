//! A fisheye of 220 degrees, whose field is divided among the faces of a cube.

#![allow(clippy::print_stdout, reason = "the figures are documented")]

mod common;

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    frame::RenderedFrame,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Channel, Face, LensModel, LensSpec},
    scene::{Encoding, Scene},
    sequence::Sequence,
    shutter::Shutter,
};
use camsim_engine::{Engine, RenderError};
use camsim_plan::PlanError;
use common::{
    gallery::{hills, noise},
    render, rolling, scenario, sequence, steady,
};
use glam::{DVec2, DVec3};

const SIDE_PX: u32 = 240;
const FRAME: u64 = 1;

/// It moves and turns under a rolling shutter, over hills.
fn fisheye() -> Arc<Sequence> {
    let mut scenario = scenario();
    let camera = &mut scenario.camera;
    camera.size_px = [SIDE_PX; 2];
    camera.focal_px = [119.5 / 110_f64.to_radians(); 2];
    camera.lens = LensSpec { model: LensModel::KannalaBrandt, coefficients: vec![0.0; 4] };
    camera.mount.angles_deg = [0.0, -60.0, 0.0];
    camera.shutter = rolling(20.0, 6.0);
    let path = steady(30.0, 30.0, DVec3::new(8.0, 2.0, 0.0), DVec3::new(0.1, -0.2, 0.3));
    let texture = noise([64, 64], |_| 255, Encoding::Srgb);
    sequence(scenario, path, Scene { terrain: Some(hills(0.6, texture)), ..Scene::default() })
}

/// Direction of a pixel's centre in the whole camera.
fn direction(camera: &CameraModel, pixel: DVec2) -> Option<DVec3> {
    camera.ray(pixel)
}

fn pixels() -> impl Iterator<Item = (usize, DVec2)> {
    let pixel = |i: u32| DVec2::new(f64::from(i % SIDE_PX), f64::from(i / SIDE_PX));
    (0..SIDE_PX * SIDE_PX).map(move |i| (i as usize, pixel(i)))
}

/// What the reference renderer casts for each face, in one frame.
fn reference(sequence: &Arc<Sequence>) -> RenderedFrame {
    let options =
        RenderOptions { channels: vec![Channel::Color], tolerance_dn: 0.15, ..RenderOptions::default() };
    let frames = Face::ALL.map(|face| {
        ReferenceRenderer::new(Arc::new(sequence.face(face))).expect("a reference").render(FRAME, &options)
    });
    let [mut whole, others @ ..] = frames;
    for (i, _) in pixels() {
        if let Some(other) = others.iter().find(|other| other.color_rgba()[4 * i + 3] > 0.0) {
            whole.color_rgba_mut()[4 * i..4 * i + 4].copy_from_slice(&other.color_rgba()[4 * i..4 * i + 4]);
        }
    }
    whole
}

#[test]
fn a_wide_frame_has_every_pixel_and_no_seam() {
    let sequence = fisheye();
    let camera = CameraModel::from_spec(&sequence.scenario.camera).expect("a camera");
    let done = render(&Engine::cpu(), &sequence, &[Channel::Color], FRAME);
    assert_eq!(done.plans().count(), 6, "the corners see the back");
    let expected = reference(&sequence);
    let face = |pixel: DVec2| direction(&camera, pixel).map(Face::of);
    // Squares of errors, 1/255: at the faces' borders, and elsewhere.
    let (mut sums, mut counts) = ([0.0; 2], [0_u32; 2]);
    for (i, pixel) in pixels() {
        let [got, wanted] = [&done.frame, &expected].map(|frame| &frame.color_rgba()[4 * i..4 * i + 4]);
        assert_eq!(got[3] > 0.0, face(pixel).is_some(), "{pixel}");
        assert_eq!(got[3], wanted[3], "{pixel}");
        if got[3] == 0.0 {
            continue;
        }
        let around = [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y].map(|axis| face(pixel + 2.0 * axis));
        let is_elsewhere = around.iter().flatten().all(|&other| Some(other) == face(pixel));
        let square =
            got[..3].iter().zip(wanted).map(|(a, b)| f64::from(255.0 * (a - b)).powi(2)).sum::<f64>();
        sums[usize::from(is_elsewhere)] += square / 3.0;
        counts[usize::from(is_elsewhere)] += 1;
    }
    let [border, elsewhere] = [0, 1].map(|k| (sums[k] / f64::from(counts[k])).sqrt());
    println!("RMS {border:.3}/255 at borders of faces ({} px), {elsewhere:.3}/255 elsewhere", counts[0]);
    assert!(counts[0] > 1000 && elsewhere < 255.0 * 10_f64.powf(-45.0 / 20.0), "{elsewhere}");
    assert!(border < 1.15 * elsewhere, "{border} at borders, {elsewhere} elsewhere");
}

#[test]
fn truth_of_a_wide_frame_is_in_the_axes_of_the_whole_camera() {
    let sequence = fisheye();
    let spec = &sequence.scenario.camera;
    let camera = CameraModel::from_spec(spec).expect("a camera");
    let shutter = Shutter::from_spec(&spec.shutter, spec.fps, spec.size_px).expect("a shutter");
    let channels = [Channel::Depth, Channel::Range, Channel::Normal, Channel::Flow];
    let frame = render(&Engine::cpu(), &sequence, &channels, FRAME).frame;
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a reference");
    let depth_m = frame.depth_m().expect("depth");
    let values = |channel| frame.floats(channel).expect("a plane");
    let at = |number: u64, pixel: DVec2| {
        let t_s =
            sequence.stamp_s(number as f64) + shutter.dt_pixel_s(pixel.x as u32, pixel.y.round() as u32);
        (t_s, sequence.path.pose(t_s))
    };
    let (mut points, mut flows) = (0, 0);
    for (i, pixel) in pixels().step_by(7) {
        let Some(direction) = direction(&camera, pixel) else { continue };
        let (_, pose) = at(FRAME, pixel);
        let Some(hit) = reference.cast(pose.position_ned_m, pose.ned_from_camera * direction) else {
            continue;
        };
        points += 1;
        let (range_m, cosine) = (hit.depth_m, direction.z);
        assert!((f64::from(values(Channel::Range)[i]) / range_m - 1.0).abs() < 1e-5, "{pixel}");
        assert!((f64::from(depth_m[i]) - range_m * cosine).abs() < 1e-5 * range_m, "{pixel}");
        let normal = pose.ned_from_camera.conjugate() * hit.normal_ned;
        let got = DVec3::from_array([0, 1, 2].map(|k| f64::from(values(Channel::Normal)[3 * i + k])));
        assert!(normal.distance(got) < 1e-4, "{pixel}: {got} is not {normal}");
        // The ray of the pixel that flow leads to, at its own row's instant, meets the point.
        let [dx, dy, state] = [0, 1, 2].map(|k| values(Channel::Flow)[3 * i + k]);
        if state != 1.0 {
            continue;
        }
        let to = pixel + DVec2::new(dx.into(), dy.into());
        let row = to.y.clamp(0.0, f64::from(SIDE_PX - 1));
        let [below, above] = [row.floor(), row.ceil()].map(|row| at(FRAME + 1, DVec2::new(0.0, row)).0);
        let pose = sequence.path.pose(below + (above - below) * row.fract());
        let seen = pose.ned_from_camera.conjugate() * (hit.point_ned_m - pose.position_ned_m);
        assert!(camera.lens.contains_ray(seen), "{pixel}: out of the field");
        let expected = camera.project_ray(seen);
        assert!(to.distance(expected) < 2e-3, "{pixel}: {to} is not {expected}");
        flows += 1;
    }
    assert!(points > 2000 && flows > 1500, "{points} points, {flows} flows");
}

#[test]
fn coords_need_a_flat_ideal_frame() {
    let engine = Engine::cpu();
    let error =
        engine.session::<std::convert::Infallible>(fisheye(), &[Channel::Coords]).expect_err("refused");
    assert!(matches!(error, RenderError::Plan(PlanError::CoordsOfFaces)), "{error}");
}
