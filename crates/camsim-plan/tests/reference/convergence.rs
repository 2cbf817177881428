//! Error against samples: the law, and whether the error that the reference states is the one it makes.

use std::sync::LazyLock;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::Scenario,
    scene::Scene,
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::fixtures::{Steady, plane, rolling, scenario, sequence, tangential, town};

/// Positions along each side of a pixel of the reference, each at an instant of its own.
const SIDE: u32 = 96;

fn camera() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [24, 18];
    scenario.camera.focal_px = [20.0, 20.0];
    scenario.camera.lens = tangential();
    scenario.camera.shutter = rolling(20.0);
    scenario
}

/// Every pixel by a regular grid over its area; instants are the grid's numbers in an order without relation
/// to it.
fn by_grid(reference: &ReferenceRenderer) -> Vec<DVec3> {
    let [width, height] = reference.sequence().scenario.camera.size_px;
    let view = reference.view(0);
    let pixel = |i: u32| {
        let count = SIDE * SIDE;
        let sum: DVec3 = (0..count)
            .map(|k| {
                let position =
                    (DVec2::new(f64::from(k % SIDE), f64::from(k / SIDE)) + 0.5) / f64::from(SIDE) - 0.5;
                // 5701 is prime to the count.
                let phase = (f64::from((u64::from(k) * 5701 % u64::from(count)) as u32) + 0.5)
                    / f64::from(count)
                    - 0.5;
                let look = view.sample([i % width, i / width], position, phase).unwrap();
                reference.color(look.uv, look.hit.as_ref())
            })
            .sum();
        sum / f64::from(count)
    };
    (0..width * height).into_par_iter().map(pixel).collect()
}

/// RMS difference of a rendering with `samples` a pixel, and the error that it states; 1/255.
fn errors_dn(reference: &ReferenceRenderer, truth: &[DVec3], samples: u32) -> (f64, f64) {
    let options = RenderOptions {
        min_samples: samples,
        max_samples: samples,
        photometric: false,
        ..RenderOptions::default()
    };
    let (frame, convergence) = reference.render_reported(0, &options);
    assert_eq!(convergence.samples, u64::from(samples) * truth.len() as u64);
    let squares = frame
        .color_rgba()
        .chunks_exact(4)
        .zip(truth)
        .map(|(found, truth)| (f64::from(found[0]) - truth.x).powi(2));
    (255.0 * (squares.sum::<f64>() / truth.len() as f64).sqrt(), convergence.rms_error_dn)
}

fn reference(scene: Scene, height_m: f64) -> ReferenceRenderer {
    ReferenceRenderer::new(sequence(camera(), Steady::moving(height_m), scene)).unwrap()
}

/// A town and what its pixels are; two tests look at it.
static TOWN: LazyLock<(ReferenceRenderer, Vec<DVec3>)> = LazyLock::new(|| {
    let reference = reference(town(60), 150.0);
    let truth = by_grid(&reference);
    (reference, truth)
});

fn check(name: &str, reference: &ReferenceRenderer, truth: &[DVec3]) {
    eprintln!("{name}: samples a pixel, RMS error, stated error (1/255)");
    let counts = [32, 64, 128, 256, 512, 1024];
    let errors: Vec<(f64, f64)> =
        counts.iter().map(|&samples| errors_dn(reference, truth, samples)).collect();
    for (samples, (found, stated)) in counts.iter().zip(&errors) {
        eprintln!("  {samples:5} {found:8.3} {stated:8.3}");
    }
    // Least squares of log error over log samples: random samples fall as N^-1/2, even ones faster, up to
    // N^-1.
    let points: Vec<(f64, f64)> =
        counts.iter().zip(&errors).map(|(n, (found, _))| (f64::from(*n).ln(), found.ln())).collect();
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    eprintln!("  error falls as N^{slope:.2}");
    assert!((-1.2..=-0.5).contains(&slope), "{name}: {slope}");
    for (found, stated) in errors {
        // The statement may be pessimistic: batches of an even sequence complement each other.
        assert!(stated > 0.7 * found, "{name}: {found} is stated as {stated}");
    }
}

#[test]
fn error_falls_with_samples_by_the_law_and_is_stated_honestly() {
    // Squares of a third of a pixel to two pixels: the mean over the area is what counts.
    let pattern = reference(plane(400.0), 180.0);
    check("fine pattern", &pattern, &by_grid(&pattern));
    check("town", &TOWN.0, &TOWN.1);
}

/// What a tolerance promises, and that work goes where it is needed.
#[test]
fn pixels_are_refined_until_the_tolerance_is_kept() {
    let (reference, truth) = &*TOWN;
    for tolerance_dn in [4.0, 1.0] {
        let options =
            RenderOptions { tolerance_dn, max_samples: 8192, photometric: false, ..RenderOptions::default() };
        let (frame, convergence) = reference.render_reported(0, &options);
        let squares = frame
            .color_rgba()
            .chunks_exact(4)
            .zip(truth)
            .map(|(found, truth)| (f64::from(found[0]) - truth.x).powi(2));
        let rms_dn = 255.0 * (squares.sum::<f64>() / truth.len() as f64).sqrt();
        let mean = convergence.samples as f64 / convergence.pixels as f64;
        eprintln!(
            "tolerance {tolerance_dn}: {rms_dn:.3} with {mean:.0} samples a pixel, {} unfinished",
            convergence.unfinished
        );
        assert!(
            rms_dn < tolerance_dn && convergence.rms_error_dn < tolerance_dn && convergence.unfinished == 0,
            "{rms_dn} {convergence:?}"
        );
        assert_eq!(
            frame.color_rgba(),
            reference.render(0, &options).color_rgba(),
            "a frame has one value only"
        );
    }
}
