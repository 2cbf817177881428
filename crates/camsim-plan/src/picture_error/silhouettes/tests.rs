#![allow(clippy::unwrap_used)]

use std::{
    f32::consts::{FRAC_PI_2, FRAC_PI_4},
    sync::Arc,
};

use glam::DVec3;

use super::{rays::RAYS_LEAVE, *};
use crate::{
    ir::stages::PrefilterTaps,
    picture_error::aliasing,
    view::{
        exposure::ExposurePath,
        lens_reach::LensReach,
        neighbourhood::search::NeighbourhoodSearch,
        plane,
        surfaces::Surfaces,
        test_flights::{SPEED_M_S, flying_east},
    },
};
use camsim_core::{
    scenario::{LensModel, ShutterSpec},
    scene::{Encoding, Mesh, MeshVertex, Scene, Texture, Wrap},
    shutter::Shutter,
    temporal::TapStage,
};

const FOCAL_PX: f64 = 200.0;
/// Of 436 probes with borders.
const UNSURE_OF_ALL: f64 = 1.0 + margins::STANDARD_ERRORS / 20.9;

/// A white roof of 50 m, 50 m above black ground, from 100 m above it, flying east with a readout of 100
/// ms.
fn model(exposure_ms: f64, gain: f64, disocclusion: Disocclusion) -> SilhouetteModel {
    model_of(
        vec![Mesh::level_picture(plain(255), DVec3::new(0.0, 0.0, -50.0), 50.0)],
        exposure_ms,
        gain,
        disocclusion,
    )
}

fn plain(byte: u8) -> Arc<Texture> {
    Arc::new(Texture::uniform([byte, byte, byte, 255], Encoding::Linear))
}

/// An ideal frame of a scale, read bilinearly at the mid-exposure.
fn sample_at(scale: f64) -> SamplingPlan {
    SamplingPlan::new(scale, PrefilterTaps::Two, TapStage::Bilinear)
}

/// The same with something else above black ground.
fn model_of(others: Vec<Mesh>, exposure_ms: f64, gain: f64, disocclusion: Disocclusion) -> SilhouetteModel {
    let meshes = [vec![Mesh::level_picture(plain(0), DVec3::ZERO, 5000.0)], others].concat();
    let scene = Scene { meshes, ..Scene::default() };
    let path = flying_east();
    let shutter = Shutter::from_spec(
        &ShutterSpec { readout_ms: 100.0, exposure_ms, ..ShutterSpec::default() },
        5.0,
        [400, 300],
    )
    .unwrap();
    let camera = CameraModel::new([400, 300], [FOCAL_PX; 2], None, LensModel::Pinhole, &[]).unwrap();
    let reach = LensReach::new(Arc::new(camera)).unwrap();
    let (key_pose, gain) = (path.pose(0.0), |_: [u32; 2]| gain);
    let surfaces = Surfaces::new(Arc::new(scene));
    let search = NeighbourhoodSearch {
        reach: &reach,
        surfaces: &surfaces,
        path: &path,
        shutter: &shutter,
        stamp_s: 0.0,
        gain: &gain,
    };
    SilhouetteModel::new(
        &search.neighbourhoods(),
        &reach.camera,
        &key_pose,
        &plane::fit(key_pose, std::iter::empty()),
        disocclusion,
        0.0,
    )
}

#[test]
fn a_roof_has_the_fraction_and_contrast_of_its_silhouette() {
    let found = model(0.0, 1.0, Disocclusion::default()).plain(&sample_at(1.0), None);
    // 100 px a side: a band of 6 px along 400 px, of 120 000.
    assert!((found.fraction / 0.02 - 1.0).abs() < 0.5, "{found:?}");
    assert!((found.contrast_dn - 255.0).abs() < 1e-3, "{found:?}");
    let half = model(0.0, 0.5, Disocclusion::default()).plain(&sample_at(1.0), None);
    assert_eq!((half.contrast_dn, half.error_dn), (0.5 * found.contrast_dn, 0.5 * found.error_dn));
}

#[test]
fn all_borders_of_thin_bars_are_counted_in_any_direction() {
    // White bars 1 m wide, which is 2 px, and 4 m apart, all over the picture: along its rows, its
    // columns, its diagonals, or nearly, so that they are not all as far from the middle of a pixel, and
    // between.
    for angle in [0.05, FRAC_PI_2 + 0.05, FRAC_PI_4 + 0.05, 0.4, 0.5_f32] {
        let (sin, cos) = angle.sin_cos();
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        for k in -40..40 {
            let first = vertices.len() as u32;
            for [along, across] in [[-200.0, 0.0], [200.0, 0.0], [200.0, 1.0], [-200.0, 1.0_f32]] {
                let across = across + 4.0 * k as f32;
                vertices.push(MeshVertex::new(
                    [along * cos - across * sin, along * sin + across * cos, 0.0],
                    [0.0; 2],
                ));
            }
            indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
        let comb = Mesh::new(vertices, indices, plain(255), DVec3::new(0.0, 0.0, -50.0), Wrap::Clamp);
        let found = model_of(vec![comb], 0.0, 1.0, Disocclusion::default());
        // Two borders in 8 px.
        let expected = UNSURE_OF_ALL * margins::SILHOUETTES * margins::SILHOUETTES * 2.0 / 8.0;
        assert!((found.steps / expected - 1.0).abs() < 0.1, "{angle}: {} {expected}", found.steps);
        // Positions 3 px apart along rows and columns see bars 2 px wide or miss them.
        assert!(found.fraction > 0.75, "{angle}: {}", found.fraction);
        assert_eq!(found.touching, 0.0);
    }
}

#[test]
fn rays_leave_borders_between_touching_meshes() {
    // White and black stripes of 2 m in one plane, which are 4 px, along the rows and across them.
    let stripes = |tints: &dyn Fn(i32) -> Option<[f32; 2]>| {
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        for (k, tints) in (-80..80).filter_map(|k| Some((k, tints(k)?))) {
            let from = vertices.len() as u32;
            let corner = |along: f32, across: i32, tint: f32| {
                let position = [0.6 * along - 0.8 * across as f32, 0.8 * along + 0.6 * across as f32, 0.0];
                MeshVertex { tint: [tint, tint, tint, 1.0], ..MeshVertex::new(position, [0.0; 2]) }
            };
            let [low, high] = [(2 * k, tints[0]), (2 * k + 2, tints[1])];
            vertices.extend(
                [(-200.0, low), (200.0, low), (200.0, high), (-200.0, high)]
                    .map(|(along, (at, tint))| corner(along, at, tint)),
            );
            indices.extend([0, 1, 2, 0, 2, 3].map(|corner| from + corner));
        }
        Mesh::new(vertices, indices, plain(255), DVec3::new(0.0, 0.0, -50.0), Wrap::Clamp)
    };
    let of_number = |k: i32| [(k % 2 == 0) as u8 as f32; 2];
    let only = |odd: i32| move |k: i32| (k.rem_euclid(2) == odd).then(|| of_number(k));
    let found = model_of(vec![stripes(&only(0)), stripes(&only(1))], 0.0, 1.0, Disocclusion::default());
    // The same in one mesh, by the colours of its corners; where those change gradually there is no
    // border.
    let in_one = model_of(vec![stripes(&|k| Some(of_number(k)))], 0.0, 1.0, Disocclusion::default());
    assert_eq!((in_one.touching, in_one.steps), (found.touching, 0.0));
    let gradual = model_of(
        vec![stripes(&|k| Some([k, k + 1].map(|k| 0.5 + k as f32 / 320.0)))],
        0.0,
        1.0,
        Disocclusion::default(),
    );
    assert_eq!((gradual.touching, gradual.steps), (0.0, 0.0));
    let expected = UNSURE_OF_ALL * margins::SILHOUETTES * margins::SILHOUETTES / 4.0;
    assert!((found.touching / expected - 1.0).abs() < 0.1, "{} {expected}", found.touching);
    assert_eq!(found.steps, 0.0);
    let [plain, rays] =
        [found.plain(&sample_at(2.0), None), found.with_rays(&sample_at(2.0), None, 2, u32::MAX)]
            .map(|of| of.error_dn);
    let left = aliasing::aliasing2(&aliasing::BorderReading {
        width_px: 2.0,
        taps: TapStage::Bilinear,
        samples_a_pixel: 1,
        exposure: None,
    });
    let rays_alike =
        rays * margins::SILHOUETTES / margins::SILHOUETTES_WITH_RAYS / found.at_pixel_spacing.sqrt();
    assert!(
        (plain - rays_alike).abs() < 1e-9 && (plain - 255.0 * (left * found.touching).sqrt()).abs() < 1e-9,
        "{plain} {rays}"
    );
}

#[test]
fn finer_samples_find_creases() {
    let border_pixels = BorderPixels::new([(1.0, [1.0, 0.0])].into_iter());
    let creases = SilhouetteModel {
        fraction: 0.5,
        contrast_dn: 100.0,
        disoccluded_fraction: 0.0,
        strips: 0.0,
        steps: 0.0,
        steps_at_pixel_spacing: 0.0,
        touching: 0.0,
        creases: 1e-3,
        at_pixel_spacing: 1.0,
        terrain_steps: 0.0,
        skyline: Skyline::default(),
        border_pixels,
    };
    let with_rays = |fine: u32| creases.with_rays(&sample_at(2.0), None, fine, u32::MAX).error_dn;
    let less = margins::SILHOUETTES_WITH_RAYS / margins::SILHOUETTES;
    assert!((with_rays(1) / creases.plain(&sample_at(2.0), None).error_dn - less).abs() < 1e-12);
    // Of 1/12 in a pixel's width, in pixels half as wide.
    let along_whole_pixels = 255.0 * (1e-3_f64 / 12.0).sqrt() / 2.0;
    assert!(
        (with_rays(3) / along_whole_pixels - less * RAYS_LEAVE.sqrt() / 3.0).abs() < 1e-12,
        "{}",
        with_rays(3)
    );
}

#[test]
fn strips_are_within_parallax_or_disoccluded() {
    let model_with = |disocclusion| {
        let found = model(0.0, 1.0, disocclusion);
        found.error(found.strips)
    };
    let found = model_with(Disocclusion::default());
    // At the roof's two borders across the flight 50 px from the middle: a sixth of the readout from its
    // middle the camera has flown 2/3 m, and (1/100 - 1/150) of that is between roof and ground.
    let width_px = FOCAL_PX * SPEED_M_S * 0.1 / 6.0 * (1.0 / 100.0 - 1.0 / 150.0);
    // All along the other two borders the readout goes by, with parallax along and not across them.
    let at_most_dn = 255.0 * width_px / 7_f64.sqrt();
    assert!(
        found.at_silhouettes_dn < at_most_dn && found.at_silhouettes_dn > 0.03 * at_most_dn,
        "{found:?} {at_most_dn}"
    );
    let hidden =
        model_with(Disocclusion { fraction: 1e-3, weighted_fraction: 1e-3, ..Disocclusion::default() });
    let added = (hidden.error_dn.powi(2) - found.error_dn.powi(2)) / 255_f64.powi(2);
    assert!(
        (added / (STRIPS * 1e-3) - 1.0).abs() < 1e-9 && hidden.disoccluded_fraction == 1e-3,
        "{hidden:?}"
    );
}

#[test]
fn finer_ideal_frames_and_blur_reduce_the_error() {
    let still = model(0.0, 1.0, Disocclusion::default());
    let spline = |scale: f64| SamplingPlan { taps: TapStage::Spline, ..sample_at(scale) };
    let [coarse, fine] = [1.0, 2.0].map(|scale| still.plain(&spline(scale), None).at_silhouettes_dn);
    let strips = still.error(still.strips).at_silhouettes_dn;
    assert!(
        fine < 0.6 * coarse && fine > strips && strips > 0.0,
        "the strips stay: {fine} {coarse} {strips}"
    );
    let samples = ExposurePath::STRAIGHT.with_samples(2.0, 64);
    let blurred = model(20.0, 1.0, Disocclusion::default()).plain(&spline(1.0), Some(samples));
    assert!(blurred.at_silhouettes_dn < 0.9 * coarse, "{} {coarse}", blurred.at_silhouettes_dn);
    // White on black costs more than a 255th; nothing is left of it.
    assert!(blurred.at_silhouettes_dn > 6.0, "{blurred:?}");
    let with_rays = |scale: f64, fine: u32| still.with_rays(&spline(scale), None, fine, u32::MAX);
    assert!(with_rays(1.0, 1).error_dn < still.plain(&spline(1.0), None).error_dn);
    assert_eq!(with_rays(2.0, 1), with_rays(1.0, 2));
    // The least error is below that of every plan.
    for (scale, samples_a_pixel) in
        [1.0, 1.41, 2.0, 2.83, 4.0, 5.0].into_iter().flat_map(|scale| [(scale, 1), (scale, 4)])
    {
        for taps in [TapStage::Bilinear, TapStage::Spline, TapStage::Area, TapStage::Grid { most: 5 }] {
            let plain = still.plain(&SamplingPlan { taps, samples_a_pixel, ..sample_at(scale) }, None);
            let at_best = still.plain_at_best(scale, samples_a_pixel > 1);
            assert!(at_best.error_dn < plain.error_dn, "{scale} {samples_a_pixel} {taps:?}");
        }
    }
}
