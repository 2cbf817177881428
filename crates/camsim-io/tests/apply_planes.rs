//! `camsim apply` through its files, against rays cast into a scene of planes: an oracle that shares nothing
//! with it.
//!
//! The ideal picture's colours are its own pixel coordinates, so that the output's colours tell where each
//! pixel looked, and, with an exposure, the mean of where it looked. The oracle integrates the camera's pose
//! in small steps, inverts the lens by Newton's method on differences, and meets the planes one by one, all
//! in f64.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use camsim_core::{
    apply::{NoSourceCounts, Pipeline, Settings},
    frame::RenderedFrame,
    scenario::OutputEncoding,
};
use camsim_io::{frame_file::read_frame, scenario_file::read_checked_camera, write::write_picture};
use glam::{DMat3, DVec2, DVec3};

const IDEAL_PX: [u32; 2] = [480, 360];
const IDEAL_FOCAL: f64 = 320.0;
const IDEAL_CENTRE: DVec2 = DVec2::new(239.5, 179.5);
const OUT_PX: [u32; 2] = [320, 240];
const OUT_FOCAL: f64 = 300.0;
const LENS: [f64; 4] = [-0.25, 0.06, 1e-3, -5e-4];
const READOUT_S: f64 = 0.05;
const VELOCITY: DVec3 = DVec3::new(8.0, -3.0, 15.0);
const RATE: DVec3 = DVec3::new(0.3, -0.5, 0.9);

/// A part of the plane `normal . x = offset_m`, by the ranges of its x and y.
struct Panel {
    normal: DVec3,
    offset_m: f64,
    x_m: [f64; 2],
    y_m: [f64; 2],
}

/// In depth order: a post six pixels wide, a panel, a tilted one, and a wall behind everything.
const SCENE: [Panel; 4] = [
    Panel { normal: DVec3::new(0.0, 0.0, 1.0), offset_m: 7.0, x_m: [-1.5, -1.37], y_m: [-9.0, 9.0] },
    Panel { normal: DVec3::new(0.1, 0.0, 1.0), offset_m: 9.0, x_m: [0.6, 2.6], y_m: [-1.2, 1.6] },
    Panel { normal: DVec3::new(-0.3, 0.2, 1.0), offset_m: 18.0, x_m: [-6.0, 3.0], y_m: [-3.5, 2.5] },
    Panel { normal: DVec3::new(0.1, -0.2, 1.0), offset_m: 45.0, x_m: [-1e9, 1e9], y_m: [-1e9, 1e9] },
];

/// The panel that a ray meets first, and where.
fn cast(from: DVec3, along: DVec3) -> Option<(usize, DVec3)> {
    let hits = SCENE.iter().enumerate().filter_map(|(i, panel)| {
        let share = (panel.offset_m - panel.normal.dot(from)) / panel.normal.dot(along);
        let at = from + share * along;
        let within =
            (panel.x_m[0]..=panel.x_m[1]).contains(&at.x) && (panel.y_m[0]..=panel.y_m[1]).contains(&at.y);
        (share > 0.0 && within).then_some((share, i, at))
    });
    hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i, at)| (i, at))
}

/// Camera axes in the world, and its place, at an instant: classical Runge-Kutta on `R' = R [w]x`, `p' = R
/// v`. The world is the camera at 0.
fn pose(t_s: f64) -> (DMat3, DVec3) {
    let cross = DMat3::from_cols(
        DVec3::new(0.0, RATE.z, -RATE.y),
        DVec3::new(-RATE.z, 0.0, RATE.x),
        DVec3::new(RATE.y, -RATE.x, 0.0),
    );
    let steps = 200;
    let h = t_s / f64::from(steps);
    (0..steps).fold((DMat3::IDENTITY, DVec3::ZERO), |(r, p), _| {
        let k1 = r * cross;
        let k2 = (r + k1 * (0.5 * h)) * cross;
        let k3 = (r + k2 * (0.5 * h)) * cross;
        let k4 = (r + k3 * h) * cross;
        let middle = r + k1 * (0.5 * h);
        let end = r + (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        (end, p + (r * VELOCITY + middle * VELOCITY * 4.0 + end * VELOCITY) * (h / 6.0))
    })
}

/// Brown and Conrady's, as printed.
fn distorted(uv: DVec2) -> DVec2 {
    let [k1, k2, p1, p2] = LENS;
    let r2 = uv.length_squared();
    let radial = 1.0 + k1 * r2 + k2 * r2 * r2;
    let tangential = DVec2::new(
        2.0 * p1 * uv.x * uv.y + p2 * (r2 + 2.0 * uv.x * uv.x),
        p1 * (r2 + 2.0 * uv.y * uv.y) + 2.0 * p2 * uv.x * uv.y,
    );
    uv * radial + tangential
}

fn undistorted(wanted: DVec2) -> DVec2 {
    (0..30).fold(wanted, |uv, _| {
        let h = 1e-6;
        let dx = (distorted(uv + DVec2::X * h) - distorted(uv - DVec2::X * h)) / (2.0 * h);
        let dy = (distorted(uv + DVec2::Y * h) - distorted(uv - DVec2::Y * h)) / (2.0 * h);
        let miss = distorted(uv) - wanted;
        let det = dx.x * dy.y - dy.x * dx.y;
        uv - DVec2::new(dy.y * miss.x - dy.x * miss.y, dx.x * miss.y - dx.y * miss.x) / det
    })
}

/// What an output pixel looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Look {
    Seen {
        panel: usize,
        at_px: DVec2,
    },
    /// Behind another panel of the ideal camera's.
    Hidden,
    Outside,
}

fn look(pixel: DVec2, (axes, place): (DMat3, DVec3)) -> Look {
    let centre = DVec2::new(f64::from(OUT_PX[0]) - 1.0, f64::from(OUT_PX[1]) - 1.0) * 0.5;
    let uv = undistorted((pixel - centre) / OUT_FOCAL);
    let Some((panel, at)) = cast(place, axes * uv.extend(1.0)) else { return Look::Outside };
    let at_px = at.truncate() / at.z * IDEAL_FOCAL + IDEAL_CENTRE;
    let last = DVec2::new(f64::from(IDEAL_PX[0]) - 1.0, f64::from(IDEAL_PX[1]) - 1.0);
    if at.z <= 0.0 || at_px.cmplt(DVec2::ZERO).any() || at_px.cmpgt(last).any() {
        return Look::Outside;
    }
    let seen =
        cast(DVec3::ZERO, at).is_some_and(|(first, first_at)| first == panel && first_at.distance(at) < 1e-6);
    if seen { Look::Seen { panel, at_px } } else { Look::Hidden }
}

/// Seconds from the stamp at which a row is taken.
fn row_s(y: u32) -> f64 {
    ((f64::from(y) + 0.5) / f64::from(OUT_PX[1]) - 0.5) * READOUT_S
}

/// Writes ideal picture, frame and camera; renders them as the program does.
fn apply(exposure_s: f64, folder: &Path) -> (RenderedFrame, NoSourceCounts) {
    let [width, height] = IDEAL_PX;
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (f64::from(x), f64::from(y))));
    let mut ideal =
        RenderedFrame { size_px: IDEAL_PX, depth_m: Some(Vec::new()), ..RenderedFrame::default() };
    for (x, y) in pixels {
        let ray = ((DVec2::new(x, y) - IDEAL_CENTRE) / IDEAL_FOCAL).extend(1.0);
        ideal.color_rgba.extend([x as f32 / 512.0, y as f32 / 512.0, 0.0, 1.0]);
        ideal.depth_m.as_mut().unwrap().push(cast(DVec3::ZERO, ray).unwrap().1.z as f32);
    }
    write_picture(&folder.join("ideal.exr"), &ideal, OutputEncoding::Srgb8).unwrap();
    let frame = format!(
        "color = \"ideal.exr\"\ndepth = \"ideal.exr\"\nfocal_px = [{IDEAL_FOCAL:?}, \
            {IDEAL_FOCAL:?}]\n[motion]\nvelocity_m_s = {:?}\n\
         angular_rate_rad_s = {:?}\n",
        VELOCITY.to_array(),
        RATE.to_array()
    );
    std::fs::write(folder.join("FRAME.toml"), frame).unwrap();
    let camera = format!(
        "size_px = {OUT_PX:?}\nfocal_px = [{OUT_FOCAL:?}, {OUT_FOCAL:?}]\nprincipal_point_px = [159.5, \
            119.5]\n[lens]\n\
         model = \"brown-conrady\"\ncoefficients = {LENS:?}\n[shutter]\nreadout_ms = {:?}\nexposure_ms = \
         {:?}\n",
        1e3 * READOUT_S,
        1e3 * exposure_s
    );
    std::fs::write(folder.join("CAMERA.toml"), camera).unwrap();
    let file = read_frame(&folder.join("FRAME.toml")).unwrap();
    let spec = read_checked_camera(&folder.join("CAMERA.toml")).unwrap();
    Pipeline::new(&spec, &file.frame, &file.motion, &Settings::default()).unwrap().render_and_count(None)
}

/// Where a pixel of the output looked, by its colour.
fn found_px(frame: &RenderedFrame, x: u32, y: u32) -> Option<DVec2> {
    let at = 4 * (y * OUT_PX[0] + x) as usize;
    let [r, g, _, alpha] = frame.color_rgba[at..at + 4] else { panic!("four values") };
    (alpha > 0.0).then(|| DVec2::new(f64::from(r), f64::from(g)) * 512.0)
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn sources_are_those_of_rays_into_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let (frame, counts) = apply(0.0, folder.path());
    let (mut clear, mut near, mut hidden, mut outside, mut wrongly_empty) = (Vec::new(), Vec::new(), 0, 0, 0);
    for y in 0..OUT_PX[1] {
        let pose = pose(row_s(y));
        for x in 0..OUT_PX[0] {
            let at = DVec2::new(f64::from(x), f64::from(y));
            let found = found_px(&frame, x, y);
            match look(at, pose) {
                Look::Hidden => hidden += 1,
                Look::Outside => outside += 1,
                Look::Seen { panel, at_px } => {
                    let Some(found) = found else {
                        wrongly_empty += 1;
                        continue;
                    };
                    // The ideal picture knows a silhouette to a texel: 0.94 output pixels.
                    let around = [
                        DVec2::X,
                        DVec2::Y,
                        DVec2::NEG_X,
                        DVec2::NEG_Y,
                        DVec2::ONE,
                        DVec2::NEG_ONE,
                        DVec2::new(1.0, -1.0),
                        DVec2::new(-1.0, 1.0),
                    ];
                    let alone =
                        around.iter().all(|step| matches!(look(at + *step, pose), Look::Seen { panel: other, .. } if other == panel));
                    if alone { clear.push(found.distance(at_px)) } else { near.push(found.distance(at_px)) }
                }
            }
        }
    }
    let worst = clear.iter().copied().fold(0.0, f64::max);
    let right = near.iter().filter(|error| **error < 0.05).count() as f64 / near.len() as f64;
    eprintln!(
        "away from silhouettes {} px: RMS {:.6}, worst {worst:.6}; beside them {}: RMS {:.3}, {:.1} % within \
            0.05; hidden {hidden}, outside {outside}",
        clear.len(),
        rms(&clear),
        near.len(),
        rms(&near),
        100.0 * right
    );
    // The test sees what it is about.
    assert!(
        clear.len() > 60_000 && near.len() > 1_000 && hidden > 500,
        "{} {} {hidden}",
        clear.len(),
        near.len()
    );
    // The contract is 0.05 RMS; 0.003 is measured. Over planes the sources are exact to 1e-6 (core's tests),
    // but here colours tell them, which the gather reads between pixels.
    assert!(rms(&clear) < 0.01 && worst < 0.02, "{} {worst}", rms(&clear));
    // A wrong side of a silhouette is possible within half a texel of it, and nothing else is: of the pixels
    // within one of it an eighth.
    assert!(right > 0.86, "{right}");
    // What is not shown is empty; the border of the picture may fall either way in the last bit.
    assert!(
        wrongly_empty <= 2 && counts.outside.abs_diff(outside) <= 5 && counts.no_ray == 0,
        "{wrongly_empty} {counts:?} {outside}"
    );
}

#[test]
fn blur_is_the_mean_of_rays_over_the_exposure() {
    const INSTANTS: u32 = 96;
    let exposure_s = 0.03;
    let folder = tempfile::tempdir().unwrap();
    let (frame, _) = apply(exposure_s, folder.path());
    let (mut one, mut mixed) = (Vec::new(), Vec::new());
    // Every other row and column: the oracle casts 96 rays a pixel.
    for y in (0..OUT_PX[1]).step_by(2) {
        let phase = |k: u32| (f64::from(k) + 0.5) / f64::from(INSTANTS) - 0.5;
        let poses: Vec<_> = (0..INSTANTS).map(|k| pose(row_s(y) + phase(k) * exposure_s)).collect();
        for x in (0..OUT_PX[0]).step_by(2) {
            let looks: Vec<Look> =
                poses.iter().map(|&pose| look(DVec2::new(f64::from(x), f64::from(y)), pose)).collect();
            let seen: Vec<(usize, DVec2)> = looks
                .iter()
                .filter_map(|look| {
                    if let Look::Seen { panel, at_px } = look { Some((*panel, *at_px)) } else { None }
                })
                .collect();
            if seen.len() < looks.len() {
                continue;
            }
            let Some(found) = found_px(&frame, x, y) else { continue };
            let error =
                found.distance(seen.iter().map(|(_, at_px)| *at_px).sum::<DVec2>() / f64::from(INSTANTS));
            if seen.iter().all(|(panel, _)| *panel == seen[0].0) {
                one.push(error)
            } else {
                mixed.push(error)
            }
        }
    }
    eprintln!(
        "one surface {}: RMS {:.5}; several {}: RMS {:.3}",
        one.len(),
        rms(&one),
        mixed.len(),
        rms(&mixed)
    );
    assert!(one.len() > 10_000 && mixed.len() > 300, "{} {}", one.len(), mixed.len());
    // 0.008 is measured.
    assert!(rms(&one) < 0.012, "{}", rms(&one));
    // Each surface's share of the exposure is known to about one sample, and to half a texel of its
    // silhouette.
    assert!(rms(&mixed) < 0.35, "{}", rms(&mixed));
}
