//! Two cameras of a rig over a plane: the parallax between their pictures against its closed form.

use std::{convert::Infallible, path::Path, sync::Arc};

use camsim_core::{frame::RenderedFrame, scenario::Channel};
use camsim_engine::Engine;
use camsim_io::{
    load::{Loaded, load_rig},
    scenario_file::parse_rig,
};
use glam::{DVec2, DVec3};

const FOCAL_PX: f64 = 150.0;
const BASELINE_M: f64 = 40.0;
const SIZE_PX: [u32; 2] = [160, 120];
/// Coordinates are in 32 bits: half a millimetre at 3 km from the origin, where a pixel is 3 m wide.
const NEAR_M: f64 = 2e-3;

/// The cameras side by side and a third at half the rate, straight down on the pattern, from a flight with
/// roll and pitch.
fn rig() -> Vec<Loaded> {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets");
    let text = std::fs::read_to_string(assets.join("pattern.toml")).expect("text");
    let (head, tail) =
        (&text[..text.find("[camera]").expect("a camera")], &text[text.find("[scene]").expect("a scene")..]);
    let camera = |name: &str, fps: f64, right_m: f64| {
        format!(
            "[[cameras]]\nname = \"{name}\"\nfps = {fps:?}\nsize_px = {SIZE_PX:?}\n\
             focal_px = [{FOCAL_PX:?}, {FOCAL_PX:?}]\n\
             mount = {{ angles_deg = [0, -90, 0], offset_m = [0.0, {right_m:?}, 0.0] }}\n"
        )
    };
    let cameras = camera("left", 30.0, 0.0) + &camera("right", 30.0, BASELINE_M) + &camera("slow", 15.0, 0.0);
    let text = format!("{head}{cameras}{tail}");
    load_rig(&parse_rig(&text, &assets.join("rig.toml"), &[]).expect("a rig")).expect("loaded")
}

/// The same frame of every camera, by one session.
fn render(cameras: &[Loaded], frames: &[u64]) -> Vec<RenderedFrame> {
    let (engine, channels) = (Engine::cpu(), [Channel::Depth, Channel::Coords]);
    let mut session =
        engine.session::<Infallible>(cameras[0].sequence.clone(), &channels).expect("a session");
    let mut all = Vec::new();
    for (camera, frame) in cameras.iter().zip(frames) {
        session.renew::<Infallible>(camera.sequence.clone(), &channels).expect("renewed");
        session
            .render::<Infallible>([*frame], &mut |done| {
                all.push(done.frame);
                Ok(())
            })
            .expect("rendered");
    }
    all
}

/// Depth and point of a pixel.
fn truth(frame: &RenderedFrame, x: u32, y: u32) -> (f64, DVec3) {
    let i = (y * frame.size_px[0] + x) as usize;
    let [.., n, e, d] = frame.coords().expect("coords")[i];
    (f64::from(frame.depth_m().expect("depth")[i]), DVec3::new(n.into(), e.into(), d.into()))
}

/// The point that a camera sees between four pixels; `None` beyond the pattern. Over a plane 1/Z and P/Z are
/// affine in the picture.
fn point_at(frame: &RenderedFrame, at: DVec2) -> Option<DVec3> {
    let (x, y) = (at.x.floor(), at.y.floor());
    let mut sum = (0.0, DVec3::ZERO);
    for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let weight = |offset: u32, fraction: f64| if offset == 1 { fraction } else { 1.0 - fraction };
        let (depth_m, point) = truth(frame, x as u32 + i, y as u32 + j);
        if depth_m == 0.0 {
            return None;
        }
        let weight = weight(i, at.x - x) * weight(j, at.y - y) / depth_m;
        sum = (sum.0 + weight, sum.1 + weight * point);
    }
    Some(sum.1 / sum.0)
}

#[test]
fn the_right_picture_is_the_left_one_shifted_by_the_parallax() {
    let cameras = rig();
    for other in &cameras[1..] {
        assert!(Arc::ptr_eq(&other.sequence.scene, &cameras[0].sequence.scene));
        assert!(Arc::ptr_eq(&other.sequence.path.trajectory, &cameras[0].sequence.path.trajectory));
    }
    let frames = render(&cameras, &[20, 20, 10]);
    let (left, right) = (&frames[0], &frames[1]);
    let (mut compared, mut depths) = (0, [f64::INFINITY, 0.0_f64]);
    for y in (0..SIZE_PX[1] - 1).step_by(7) {
        for x in 0..SIZE_PX[0] {
            let (depth_m, point) = truth(left, x, y);
            if depth_m == 0.0 {
                continue;
            }
            // The right camera is to the right: what it sees moves left by f b / Z.
            let shifted_px = f64::from(x) - FOCAL_PX * BASELINE_M / depth_m;
            depths = [depths[0].min(depth_m), depths[1].max(depth_m)];
            if shifted_px < 0.0 {
                continue;
            }
            let Some(seen) = point_at(right, DVec2::new(shifted_px, y.into())) else { continue };
            assert!(seen.distance(point) < NEAR_M, "{x} {y}: {seen} {point}");
            compared += 1;
        }
    }
    // The aircraft banks, so that the shift differs from pixel to pixel.
    assert!(compared > 1500 && depths[1] / depths[0] > 1.02, "{compared} {depths:?}");
    // Frame 10 at 15 a second is frame 20 at 30 a second.
    assert_eq!(left.stamp_ns, frames[2].stamp_ns);
    for (x, y) in [(3, 5), (80, 60), (150, 100)] {
        let [a, b] = [left, &frames[2]].map(|frame| truth(frame, x, y).1);
        assert!(a.distance(b) < NEAR_M, "{x} {y}: {a} {b}");
    }
}
