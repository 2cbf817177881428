//! 8.6: rolling shutter in rotation (fig. 18) and in translation (fig. 19).

use std::sync::Arc;

use camsim_core::{scenario::ShutterSpec, sequence::Sequence};
use glam::DVec2;

use super::{
    ExperimentReport, Picture, ReproduceError, Setup, Table,
    circles::{CircleMatches, detect_blobs, match_circles},
    displacement::{DisplacementModel, PaperIdealFrame},
    short,
    test_bench::{self, FLIGHT_M_S, HEIGHT_M, Motion, TARGET_M},
};

/// Readout time, seconds; large to make the effect visible.
const READOUT_S: f64 = 1.0;

/// Measurements in one frame of one motion.
pub(super) struct ShutterResult {
    /// Name of the motion.
    pub motion: &'static str,
    /// Detected circles.
    pub circles: CircleMatches,
    /// Number of pixels that show the wrong surface.
    pub wrong_surface: usize,
}

/// Affine map `[[xx, xy], [yx, yy]]` from the circle centres of a still camera to those of a moving one, by
/// least squares about the means.
pub(super) fn fit_affine(still: &[DVec2], moved: &[DVec2]) -> [[f64; 2]; 2] {
    let mean = |points: &[DVec2]| points.iter().sum::<DVec2>() / points.len().max(1) as f64;
    let (still_mean, moved_mean) = (mean(still), mean(moved));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    let (mut bx, mut by) = (DVec2::ZERO, DVec2::ZERO);
    for (a, b) in still.iter().zip(moved) {
        let (a, b) = (*a - still_mean, *b - moved_mean);
        xx += a.x * a.x;
        xy += a.x * a.y;
        yy += a.y * a.y;
        bx += a * b.x;
        by += a * b.y;
    }
    let determinant = xx * yy - xy * xy;
    let solve = |b: DVec2| [(yy * b.x - xy * b.y) / determinant, (xx * b.y - xy * b.x) / determinant];
    [solve(bx), solve(by)]
}

// Long because: a list of motions and methods.
pub(super) fn run(setup: &Setup<'_>) -> Result<ExperimentReport, ReproduceError> {
    let mut report = ExperimentReport::default();
    report.notes.push(format!(
        "Test bench as in 8.4. The readout is {READOUT_S} s from top to bottom with its middle at the stamp. \
         True positions of circles: each point is projected at the time of its row. Wrong surfaces: compared \
         with the exact ray through each pixel's centre at the time of its row."
    ));
    let scene = test_bench::target(setup, TARGET_M)?;
    let rolling = ShutterSpec { readout_ms: 1e3 * READOUT_S, ..ShutterSpec::default() };
    let mut table = Table::new(
        "Circles of figs. 18 and 19 against their true positions",
        &["motion", "method", "px RMS", "largest", "missed", "pixels with the wrong surface"],
    );
    let mut shapes = Table::new(
        "Shape of the target in camsim's frames against closed form",
        &["motion", "what", "closed form", "found", "from the true positions"],
    );
    let mut fig19 = Vec::new();
    for (motion, name) in [
        (Motion::turning(), "rotation clockwise"),
        (Motion::flying(1.0, 0.0), "to the right"),
        (Motion::flying(0.0, -1.0), "upwards"),
        (Motion::flying(0.0, 1.0), "downwards"),
    ] {
        let bench = test_bench::with_shutter(
            &*test_bench::sequence(test_bench::pinhole(setup.width_px), motion, &scene)?,
            0.0,
            rolling.clone(),
        );
        let still = test_bench::snapshot(setup.engine, &bench, 0.0)?;
        let ideal = PaperIdealFrame::render(setup.engine, &bench, 0.0)?;
        let rk2 = DisplacementModel::Rk2(2.5_f64.to_radians());
        let paper = ideal.instant(&bench.scenario.camera, rk2)?;
        let own = test_bench::render_first(setup.engine, &bench)?;
        for (method, frame) in [("paper: RK2 from the frame of the stamp", &paper), ("camsim", &own)] {
            let result = measure(&bench, name, frame)?;
            let stats = result.circles.stats();
            table.row([
                name.into(),
                method.into(),
                short(stats.rms_px),
                short(stats.max_px),
                result.circles.missed.to_string(),
                result.wrong_surface.to_string(),
            ]);
            if method == "camsim" {
                shape_row(&bench, &result, &mut shapes)?;
            }
        }
        match name {
            "rotation clockwise" => report.pictures.push(Picture {
                name: "fig18",
                caption:
                    "Fig. 18: (a) still camera, (b) camera in clockwise rotation by the paper's method, \
                          (c) the same by camsim."
                        .into(),
                frames: vec![still, paper, own],
                columns: 3,
                shrink: 2,
            }),
            _ => fig19.extend([still, paper, own]),
        }
    }
    report.pictures.push(Picture {
        name: "fig19",
        caption: "Fig. 19, row by row: to the right (shear), upwards (elongation), downwards (shortening); \
                  still camera, the paper's method, camsim. The paper's method loses a rim of the target \
                  where it reads the depth of the sky."
            .into(),
        frames: fig19,
        columns: 3,
        shrink: 2,
    });
    report.tables.push(("circles", table));
    report.tables.push(("shapes", shapes));
    Ok(report)
}

/// Detects the circles of a frame.
pub(super) fn measure(
    bench: &Arc<Sequence>,
    motion: &'static str,
    frame: &camsim_core::frame::RenderedFrame,
) -> Result<ShutterResult, ReproduceError> {
    let circles = match_circles(&test_bench::circles_in_view(bench, 0.0, TARGET_M)?, &detect_blobs(frame));
    Ok(ShutterResult { motion, circles, wrong_surface: test_bench::count_wrong_surface(bench, frame)? })
}

/// Adds shear or stretch of the grid and its closed form: for an image motion of `rate` px/s, `rows` rows and
/// readout `t_r`, a point at row y of a still camera appears at `y' = y + rate t_r (y'/rows)`.
fn shape_row(bench: &Sequence, result: &ShutterResult, table: &mut Table) -> Result<(), ReproduceError> {
    let (camera, _) = test_bench::camera_and_shutter(bench)?;
    let rate_px_s = camera.focal_px.y * FLIGHT_M_S / HEIGHT_M;
    let fraction = rate_px_s * READOUT_S / f64::from(camera.size_px[1]);
    // Flight to the right: the image moves left, lower rows later. Upwards: it moves down. Downwards: up.
    let (what, k, closed) = match result.motion {
        "to the right" => ("shear, px of x for one of y", [0, 1], -fraction),
        "upwards" => ("height, relative", [1, 1], 1.0 / (1.0 - fraction)),
        "downwards" => ("height, relative", [1, 1], 1.0 / (1.0 + fraction)),
        _ => return Ok(()),
    };
    let mut global = bench.clone();
    global.scenario.camera.shutter = ShutterSpec::default();
    let (still_camera, still_shutter) = test_bench::camera_and_shutter(&global)?;
    // Of each circle in view: centroid in a still camera, detected centroid, true centroid.
    let triples: Vec<(DVec2, DVec2, DVec2)> = super::circle_grid::circles(TARGET_M)
        .iter()
        .filter_map(|circle| {
            let (moving_camera, shutter) = test_bench::camera_and_shutter(bench).ok()?;
            let moved = circle.image(|p| test_bench::project(bench, &moving_camera, &shutter, 0.0, p))?;
            let blob = result
                .circles
                .pairs
                .iter()
                .find(|(circle, _)| circle.centroid_px.distance(moved.centroid_px) < 1e-6)?
                .1;
            let still =
                circle.image(|p| test_bench::project(&global, &still_camera, &still_shutter, 0.0, p))?;
            Some((still.centroid_px, blob.centroid_px, moved.centroid_px))
        })
        .collect();
    let still: Vec<DVec2> = triples.iter().map(|p| p.0).collect();
    let [detected, exact] =
        [triples.iter().map(|p| p.1).collect::<Vec<_>>(), triples.iter().map(|p| p.2).collect()]
            .map(|moved| fit_affine(&still, &moved)[k[0]][k[1]]);
    table.row([
        result.motion.into(),
        what.into(),
        format!("{closed:.5}"),
        format!("{detected:.5}"),
        format!("{exact:.5}"),
    ]);
    Ok(())
}
