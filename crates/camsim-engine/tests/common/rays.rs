//! The reference of the silhouette tests: rays cast in f64, each at its own instant.

#![allow(dead_code, reason = "each test binary uses its part")]

use std::sync::Arc;

use camsim_core::{
    frame::RenderedFrame,
    pose::CameraPose,
    scene::{Encoding, Scene, Texture},
    sequence::Sequence,
    temporal::supersampled::PixelCentre,
};
use camsim_engine::Finished;
use camsim_plan::{EdgeStage, FramePlan, KeyFrame};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::fixtures::{
    pattern, roof,
    supersampled::{SilhouetteErrors, SupersampledFrame, with_keys_of_pixel},
};

/// Samples along each side of a pixel, and as many instants, that the reference takes.
const REFERENCE_SIDE: u32 = 16;
/// Distance from a silhouette, pixels, within which pixels are compared.
const NEAR_PX: i64 = 3;

/// Colour and number of the surface that a ray meets first.
pub fn cast(scene: &Scene, origin: DVec3, direction: DVec3) -> (DVec3, usize) {
    let mut best = (f64::INFINITY, DVec3::from_array(scene.sky_linear.map(f64::from)), 0);
    if let Some((terrain, hit)) = scene
        .terrain
        .as_ref()
        .and_then(|terrain| Some((terrain, terrain.intersect(origin, direction, f64::INFINITY)?)))
    {
        // Slopes to either side of a ridge are different surfaces where one hides the other.
        best = (hit.t, texel(&terrain.texture, hit.uv), 1 + usize::from(hit.normal_ned.x > 0.0));
    }
    for (i, mesh) in scene.meshes.iter().enumerate() {
        if let Some((t, uv)) = mesh.intersect(origin, direction, best.0) {
            best = (t, texel(&mesh.material.texture, uv), 10 + i);
        }
    }
    (best.1, best.2)
}

pub fn texel(texture: &Texture, uv: [f64; 2]) -> DVec3 {
    let [width, height] = texture.size_px;
    let at = DVec2::new(uv[0] * f64::from(width) - 0.5, uv[1] * f64::from(height) - 0.5);
    let base = at.floor();
    let load = |dx: f64, dy: f64| {
        let x = (base.x + dx).clamp(0.0, f64::from(width - 1)) as usize;
        let y = (base.y + dy).clamp(0.0, f64::from(height - 1)) as usize;
        let i = 4 * (y * width as usize + x);
        DVec3::from_array([0, 1, 2].map(|c: usize| f64::from(texture.rgba8[i + c]) / 255.0))
    };
    let t = at - base;
    load(0.0, 0.0).lerp(load(1.0, 0.0), t.x).lerp(load(0.0, 1.0).lerp(load(1.0, 1.0), t.x), t.y)
}

/// The ray of a position on the sensor at an exposure phase in [-0.5, 0.5]; lines keep their own time all over
/// their pixels.
pub fn cast_at(
    sequence: &Sequence,
    plan: &FramePlan,
    [x, y]: [u32; 2],
    offset: DVec2,
    phase: f64,
) -> Option<(DVec3, usize)> {
    let uv = plan.camera.unproject(DVec2::new(f64::from(x), f64::from(y)) + offset)?;
    let t_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y) + phase * plan.shutter.exposure_s();
    let pose = sequence.path.pose(t_s);
    Some(cast(&sequence.scene, pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0)))
}

/// Mean over the area and the exposure: every position of a fine grid, each at one of as many instants.
pub fn reference(sequence: &Sequence, plan: &FramePlan, pixel: [u32; 2]) -> Option<DVec3> {
    let n = REFERENCE_SIDE;
    let mut sum = DVec3::ZERO;
    for i in 0..n * n {
        let offset = (DVec2::new(f64::from(i % n), f64::from(i / n)) + 0.5) / f64::from(n) - 0.5;
        // 101 is prime to 256: neighbours in space are far apart in time.
        let phase = (f64::from(i * 101 % (n * n)) + 0.5) / f64::from(n * n) - 0.5;
        sum += cast_at(sequence, plan, pixel, offset, phase)?.0;
    }
    Some(sum / f64::from(n * n))
}

/// Pixels near silhouettes and their colour by the reference.
pub fn expected(sequence: &Sequence, plan: &FramePlan) -> Vec<(usize, DVec3)> {
    let [width, height] = plan.camera.size_px.map(i64::from);
    let pixel = |x: i64, y: i64| [x as u32, y as u32];
    let surfaces: Vec<Vec<usize>> = (0..width * height)
        .into_par_iter()
        .map(|i| {
            [-0.5, 0.0, 0.5]
                .iter()
                .filter_map(|&phase| {
                    Some(cast_at(sequence, plan, pixel(i % width, i / width), DVec2::ZERO, phase)?.1)
                })
                .collect()
        })
        .collect();
    let near = |x: i64, y: i64| {
        let mut around =
            (-NEAR_PX..=NEAR_PX).flat_map(|dy| (-NEAR_PX..=NEAR_PX).map(move |dx| (x + dx, y + dy)));
        let first = surfaces[(y * width + x) as usize].first();
        around.any(|(x, y)| surfaces[(y * width + x) as usize].iter().any(|s| Some(s) != first))
    };
    let inner = (NEAR_PX..height - NEAR_PX).flat_map(|y| (NEAR_PX..width - NEAR_PX).map(move |x| (x, y)));
    let chosen: Vec<(i64, i64)> = inner.filter(|&(x, y)| near(x, y)).collect();
    chosen
        .into_par_iter()
        .filter_map(|(x, y)| Some(((y * width + x) as usize, reference(sequence, plan, pixel(x, y))?)))
        .collect()
}

/// A white roof over black ground.
pub fn black_ground_and_roof() -> Scene {
    let mut scene = pattern(6000.0);
    scene.meshes[0].material.texture = Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear));
    scene.meshes.push(roof(60.0, 15.0));
    scene
}

/// The ideal frames of a plan with supersampled depth, by rays; meshes only.
pub fn supersampled_frames(sequence: &Sequence, plan: &FramePlan, scale: u32) -> Vec<SupersampledFrame> {
    let of_key = |key: &KeyFrame| {
        let sample = |position_px| sample_ideal(sequence, plan, &key.pose, position_px);
        SupersampledFrame::new(plan.ideal.size_px, scale, true, sample)
    };
    plan.keys.iter().map(of_key).collect()
}

/// Asserts that pixels near silhouettes are those of the twin of the silhouette rays, of a pinhole camera
/// with blur.
pub fn assert_silhouettes_of_twin(sequence: &Sequence, done: &Finished) {
    let plan = &done.plan;
    let EdgeStage::Supersampled { scale, samples, .. } = plan.edges else { panic!("{:?}", plan.edges) };
    let frames = supersampled_frames(sequence, plan, scale);
    let nearest_w = frames.iter().map(SupersampledFrame::nearest_w).fold(0.0, f64::max);
    let mut errors = SilhouetteErrors::default();
    let width = plan.camera.size_px[0];
    for (i, _) in expected(sequence, plan) {
        let pixel = [i as u32 % width, i as u32 / width];
        with_keys_of_pixel(sequence, plan, &frames, nearest_w, pixel, |uv, d_uv, keys| {
            errors.add((uv, d_uv), keys, samples, plan, done.frame.color_rgba()[4 * i]);
        });
    }
    let (mean, SilhouetteErrors { compared, differing, .. }) = (errors.mean(), errors);
    eprintln!(
        "twin: mean difference {mean:.1e}, {differing} of {compared} pixels differ by more than one ray"
    );
    // In f32 a ray may round to the next sample; a pixel on the mark's border may be gathered plainly.
    assert!(
        compared > 300 && mean < 2e-3 && differing * 50 < compared,
        "{mean:.1e}, {differing} of {compared}"
    );
}

/// Inverse depth and colour at a position of an ideal frame.
fn sample_ideal(sequence: &Sequence, plan: &FramePlan, key: &CameraPose, position_px: DVec2) -> PixelCentre {
    let ray =
        key.ned_from_camera * ((position_px - plan.ideal.principal_px) / plan.ideal.focal_px).extend(1.0);
    let origin = key.position_ned_m;
    let hits = sequence
        .scene
        .meshes
        .iter()
        .filter_map(|mesh| mesh.intersect(origin, ray, f64::INFINITY))
        .map(|hit| hit.0);
    let first = hits.min_by(f64::total_cmp);
    let depth_m = first.map(|t| (key.ned_from_camera.inverse() * (t * ray)).z);
    PixelCentre {
        inverse_depth: depth_m.map_or(0.0, |z| 1.0 / z),
        color: cast(&sequence.scene, origin, ray).0,
    }
}

/// PSNR of a frame at these pixels, linear values, full scale 1.
pub fn linear_psnr(frame: &RenderedFrame, expected: &[(usize, DVec3)]) -> f64 {
    let error2 = |&(i, expected): &(usize, DVec3)| {
        let found = DVec3::from_array([0, 1, 2].map(|c: usize| f64::from(frame.color_rgba()[4 * i + c])));
        (found - expected).length_squared() / 3.0
    };
    -10.0 * (expected.iter().map(error2).sum::<f64>() / expected.len() as f64).log10()
}
