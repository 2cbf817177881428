//! Skylines are exact, wherever the ideal frame has them.

mod common;

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Auto, Channel, MountSpec, Scenario, ShutterSpec, Silhouettes, Solver},
    scene::{Encoding, Mesh, MeshVertex, Scene, Texture, Wrap},
    sequence::Sequence,
    temporal::{ColorImage, InverseDepthImage, KeyDepth, SKY_REACH_PX, reproject},
};
use camsim_plan::Backend;
use camsim_plan::TemporalStage;
use common::{engine, scenario, sequence, steady};
use glam::{DMat3, DVec2, DVec3};

const SIZE_PX: [u32; 2] = [200, 150];

/// A black wall 60 m to the north, before a white sky.
fn wall() -> Scene {
    let corners = [[0.0, -16.0, 10.0], [0.0, 14.0, 10.0], [0.0, 14.0, -32.0], [0.0, -16.0, -24.0_f32]];
    let vertices = corners.map(|corner| MeshVertex::new(corner, [0.0; 2])).to_vec();
    let black = Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear));
    let wall = Mesh::new(vertices, vec![0, 1, 2, 0, 2, 3], black, DVec3::new(60.0, 0.0, 0.0), Wrap::Clamp);
    Scene { meshes: vec![wall], sky_linear: [1.0; 3], ..Scene::default() }
}

/// Level, 12 m above the wall's foot, flying past it.
fn flying_past(exposure_ms: f64, speed_m_s: f64) -> Arc<Sequence> {
    let mut scenario: Scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [160.0, 160.0];
    scenario.camera.mount = MountSpec { angles_deg: [2.0, 0.0, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = ShutterSpec { readout_ms: 33.0, exposure_ms, ..ShutterSpec::default() };
    scenario.quality.solver = Auto::Value(Solver::Reproject);
    scenario.quality.silhouettes = Silhouettes::Plain;
    scenario.quality.ideal_scale = Auto::Value(2.0);
    sequence(scenario, steady(12.0, 0.0, DVec3::new(0.0, speed_m_s, 0.0), DVec3::new(0.0, 0.0, 0.1)), wall())
}

/// RMS over the picture, 1/255 of the linear range.
fn rms_dn(found: &[f32], truth: &[f32]) -> f64 {
    let squares: f64 = found.iter().zip(truth).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    255.0 * (squares / found.len() as f64).sqrt()
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn skyline_is_exact_from_a_distant_ideal_frame() {
    // At the first and the last line the wall is up to 1.3 px elsewhere in the ideal frame, and as much more
    // with twice the speed.
    for exposure_ms in [0.0, 6.0] {
        let made = |speed_m_s: f64, backend: Backend| {
            let sequence = flying_past(exposure_ms, speed_m_s);
            let mut engine = engine();
            engine.set_backend(backend);
            let done = common::render(&engine, &sequence, &[Channel::Color], 0);
            let truth =
                ReferenceRenderer::new(sequence).expect("reference").render(0, &RenderOptions::default());
            rms_dn(done.frame.color_rgba(), truth.color_rgba())
        };
        for backend in [Backend::GpuThenCpu, Backend::Gpu] {
            let [still, slow, fast] = [0.0, 30.0, 60.0].map(|speed_m_s| made(speed_m_s, backend));
            eprintln!("{exposure_ms} ms, {backend:?}: {still:.3}, {slow:.3}, {fast:.3}/255");
            // What stays are stairs of the ideal frame's pixels, which a border aslant by the readout has
            // more of; without the reach the twin leaves 4.6 times what it leaves with it (below).
            assert!(still > 0.5 && slow < 1.4 * still && fast < 1.4 * still, "{still} {slow} {fast}");
        }
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn skyline_search_agrees_with_its_twin() {
    let sequence = flying_past(0.0, 60.0);
    let truth =
        ReferenceRenderer::new(sequence.clone()).expect("reference").render(0, &RenderOptions::default());
    for backend in [Backend::GpuThenCpu, Backend::Gpu] {
        let mut engine = engine();
        engine.set_backend(backend);
        let mut session =
            engine.session::<std::convert::Infallible>(sequence.clone(), &[Channel::Color]).expect("session");
        let mut found = None;
        let mut keep = |finished| {
            found = Some(finished);
            Ok(())
        };
        session.render::<std::convert::Infallible>([0], &mut keep).expect("render");
        let (ideal, color, depth) = session.read_ideal().expect("readable").expect("drawn");
        let done = found.expect("one frame");
        let plan = &done.plan;
        let TemporalStage::Reproject { iterations } = plan.temporal else { panic!("{:?}", plan.temporal) };
        let depth = InverseDepthImage { size_px: ideal.size_px, values: &depth };
        let color = ColorImage { size_px: ideal.size_px, rgba: &color };
        let plane = plan.plane.seen_from(&plan.keys[0].pose);
        assert_eq!(plan.sky_reach_px, 2.0 * SKY_REACH_PX);
        // Where the twin looks, and what a plain read finds there: which kernel reads does not matter here.
        let source_px = |[x, y]: [u32; 2], sky_reach_px: f64| {
            let key = KeyDepth { ideal: &ideal, depth: &depth, plane, sky_reach_px };
            let pose = sequence.path.pose(plan.stamp_s + plan.shutter.dt_pixel_s(x, y));
            let (rotation, shift): (DMat3, DVec3) = pose.relative_to(&plan.keys[0].pose);
            let uv = (DVec2::new(f64::from(x), f64::from(y)) - plan.camera.principal_point_px)
                / plan.camera.focal_px;
            reproject(uv, (rotation, shift), iterations, &key).map(|source| source.position_px)
        };
        let (mut differ, mut squares) = (0, [0.0; 2]);
        for i in 0..SIZE_PX[0] * SIZE_PX[1] {
            let pixel = [i % SIZE_PX[0], i / SIZE_PX[0]];
            let [with, without] =
                [plan.sky_reach_px, 0.0].map(|reach_px| source_px(pixel, reach_px).expect("in view"));
            let of = |at_px: DVec2| color.sample(at_px).x;
            let [rendered, exact] =
                [&done.frame, &truth].map(|frame| f64::from(frame.color_rgba()[4 * i as usize]));
            // Of a kernel that reads more sharply or more softly than the twin here: what is sky or wall all
            // around is so for both.
            differ += u32::from((rendered - of(with)).abs() > 0.3);
            squares[0] += (of(with) - exact).powi(2);
            squares[1] += (of(without) - exact).powi(2);
        }
        let [with, without] =
            squares.map(|squares: f64| 255.0 * (squares / f64::from(SIZE_PX[0] * SIZE_PX[1])).sqrt());
        eprintln!("{backend:?}: {differ} pixels differ; {with:.2}/255 with a reach, {without:.2} without");
        assert!(differ < 10, "{backend:?}: {differ}");
        assert!(with < 0.5 * without, "{with} {without}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn sky_coordinates_are_exact_beside_surfaces() {
    for (backend, exposure_ms) in
        [(Backend::GpuThenCpu, 0.0), (Backend::Gpu, 0.0), (Backend::GpuThenCpu, 6.0), (Backend::Gpu, 6.0)]
    {
        let sequence = flying_past(exposure_ms, 60.0);
        let mut engine = engine();
        engine.set_backend(backend);
        let done =
            common::render_exact(&engine, &sequence, &[Channel::Color, Channel::Coords, Channel::Depth], 0);
        let options = RenderOptions {
            channels: vec![Channel::Coords, Channel::Depth],
            max_samples: 1,
            ..RenderOptions::default()
        };
        let exact = ReferenceRenderer::new(sequence.clone()).expect("reference").render(0, &options);
        let (exact_coords, exact_depth_m) =
            (exact.coords().expect("asked for"), exact.depth_m().expect("asked for"));
        let (plan, coords, depth_m) =
            (&done.plan, done.frame.coords().expect("asked for"), done.frame.depth_m().expect("asked for"));
        let mut sky = 0;
        for i in (0..SIZE_PX[0] * SIZE_PX[1]).filter(|&i| depth_m[i as usize] == 0.0) {
            let [x, y] = [i % SIZE_PX[0], i / SIZE_PX[0]];
            let of_pixel = coords[i as usize];
            let uv = DVec2::new(f64::from(of_pixel[0]), f64::from(of_pixel[1]));
            let (rotation, _) =
                sequence.path.pose(plan.stamp_s + plan.shutter.dt_pixel_s(x, y)).relative_to(&plan.key_pose);
            let exact = plan.ideal.px_from_point(rotation * uv.extend(1.0));
            let off_px = exact.distance(DVec2::new(f64::from(of_pixel[2]), f64::from(of_pixel[3])));
            // Single precision, of coordinates up to 500 px, and a path through few nodes.
            assert!(off_px < 0.01, "{backend:?}, {exposure_ms} ms, ({x}, {y}): {off_px} px");
            // Instead of a point the ray's direction at its row's own mid-exposure, of length 1.
            let pose = sequence.path.pose(plan.stamp_s + plan.shutter.dt_pixel_s(x, y));
            let direction =
                DVec3::new(f64::from(of_pixel[5]), f64::from(of_pixel[6]), f64::from(of_pixel[7]));
            assert!(
                (direction - pose.ned_from_camera * uv.extend(1.0).normalize()).length() < 1e-6,
                "{direction}"
            );
            let theirs = exact_coords[i as usize];
            assert!(
                exact_depth_m[i as usize] > 0.0
                    || (0..8).filter(|k| ![2, 3].contains(k)).all(|k| (of_pixel[k] - theirs[k]).abs() < 2e-6),
                "{of_pixel:?} {theirs:?}"
            );
            sky += 1;
        }
        assert!(sky > 5000, "{backend:?}: {sky}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn sky_behind_panes_does_not_follow_surfaces() {
    let plain = flying_past(0.0, 30.0);
    let mut blended = Sequence::clone(&plain);
    let mut pane = wall();
    pane.meshes[0].material.blends = true;
    Arc::make_mut(&mut blended.scene).meshes.extend(pane.meshes);
    let reach_px = |sequence: Arc<Sequence>| {
        common::render(&engine(), &sequence, &[Channel::Color], 0).plan.sky_reach_px
    };
    assert_eq!([plain, Arc::new(blended)].map(reach_px), [2.0 * SKY_REACH_PX, 0.0]);
}
