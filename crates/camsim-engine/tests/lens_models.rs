//! Frames through every lens model against the reference renderer, which shares only the forward function.

mod common;

use std::convert::Infallible;

use camsim_core::{
    lens::{GridOf, Lens, LensGrid, LensModel, RayChart},
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Channel, LensSpec, LoadedFile, MountSpec, Scenario},
};
use camsim_engine::Engine;
use common::{city, rolling, scenario, sequence, steady};
use glam::{DVec2, DVec3};

const SIZE_PX: [u32; 2] = [160, 120];
/// `quality.max_error_dn` = 1 is an RMS of 48.1 dB, which plans predict and do not bound: 48.4 to 50.5 are measured.
const LEAST_PSNR_DB: f64 = 47.0;

/// Model, coefficients and focal length of cameras that see some 80 degrees.
fn lenses() -> [(LensModel, &'static [f64], f64); 13] {
    use LensModel::{
        BrownConradyPrism, Division, DoubleSphere, Equirectangular, Eucm, FTheta, FThetaInverse, Fisheye624,
        Fov, KannalaBrandt, Mei, Table, Ucm,
    };
    const PRISM: &[f64] = &[-0.28, 0.07, 2e-4, 2e-5, 0.0, 0.0, 0.0, 0.0, 0.02, 0.0, -0.05, 0.0, 0.1, -0.08];
    const ARIA: &[f64] =
        &[-0.0232, 0.0924, -0.0591, 0.003, 0.0048, -9e-4, 2e-4, 5e-4, -9e-4, -1e-4, 7e-5, -1.7e-4];
    [
        (BrownConradyPrism, PRISM, 110.0),
        (KannalaBrandt, &[-0.02, 0.001], 120.0),
        (Fisheye624, ARIA, 120.0),
        (FTheta, &[1.0, -0.02, 0.01, -0.03, 0.002, 1.01, 0.01, -0.02], 120.0),
        (FThetaInverse, &[1.0, 0.02, -0.01, 0.03], 120.0),
        (DoubleSphere, &[-0.2396, 0.5589], 90.0),
        (Eucm, &[0.571, 1.18], 120.0),
        (Ucm, &[0.6], 120.0),
        (Mei, &[1.2, -0.2, 0.05, 1e-3, -5e-4], 260.0),
        (Division, &[-0.3], 120.0),
        (Fov, &[0.93], 110.0),
        (Equirectangular, &[], 120.0),
        (Table, &[], 120.0),
    ]
}

/// A wavy lens that no formula here has.
fn table() -> LoadedFile {
    let wave = |at: f64| 0.01 * (7.0 * at).sin();
    let base = Lens::new(LensModel::BrownConrady, &[-0.2, 0.03]).expect("a lens");
    let values: Vec<DVec2> = (0..65 * 65)
        .map(|k| {
            let ideal = DVec2::new(f64::from(k % 65), f64::from(k / 65)) / 32.0 - 1.0;
            base.distort(ideal) + DVec2::new(wave(ideal.y), wave(ideal.x))
        })
        .collect();
    let placement = [DVec2::splat(-1.0), DVec2::splat(1.0 / 32.0)];
    let grid = LensGrid::new(RayChart::Ideal, GridOf::Rays, placement, [65; 2], &values).expect("a lens");
    LoadedFile::new("wavy.csv", grid)
}

fn camera(model: LensModel, coefficients: &[f64], focal_px: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [focal_px; 2];
    scenario.camera.lens = LensSpec { model, coefficients: coefficients.to_vec() };
    scenario.camera.lens_table = (model == LensModel::Table).then(table);
    scenario.camera.mount = MountSpec { angles_deg: [2.0, -50.0, 5.0], ..MountSpec::default() };
    scenario.camera.shutter = rolling(30.0, 8.0);
    scenario
}

#[test]
fn every_model_shows_what_the_reference_renderer_shows() {
    let engine = Engine::cpu();
    for (model, coefficients, focal_px) in lenses() {
        let flight = steady(150.0, 10.0, DVec3::new(20.0, 5.0, 1.0), DVec3::new(0.1, -0.2, 0.3));
        let sequence = sequence(camera(model, coefficients, focal_px), flight, city(6));
        let mut session =
            engine.session::<Infallible>(sequence.clone(), &[Channel::Color]).expect("a session");
        let mut found = None;
        let mut keep = |finished: camsim_engine::Finished| {
            found = Some(finished);
            Ok(())
        };
        session.render::<Infallible>([2], &mut keep).expect("rendered");
        let frame = found.expect("one frame").frame;
        let reference = ReferenceRenderer::new(sequence.clone()).expect("a reference");
        let options = RenderOptions { min_samples: 16, max_samples: 64, ..RenderOptions::default() };
        let exact = reference.render(2, &options);
        let pixels = || frame.color_rgba().chunks_exact(4).zip(exact.color_rgba().chunks_exact(4));
        let both = pixels().filter(|(a, b)| a[3] > 0.0 && b[3] > 0.0).count();
        let differ = pixels().filter(|(a, b)| (a[3] > 0.0) != (b[3] > 0.0)).count();
        let squares: f64 = pixels()
            .filter(|(a, b)| a[3] > 0.0 && b[3] > 0.0)
            .flat_map(|(a, b)| (0..3).map(|i| f64::from(a[i] - b[i]).powi(2)))
            .sum();
        let psnr_db = -10.0 * (squares / (3 * both) as f64).log10();
        let name = model.name();
        eprintln!("{name}: {psnr_db:.1} dB over {both} pixels, {differ} valid in one alone");
        assert!(both > 18_000 && differ <= 3, "{name}: {both} pixels, {differ} valid in one alone");
        assert!(psnr_db > LEAST_PSNR_DB, "{name}: {psnr_db:.1} dB");
    }
}
