//! 8.6: rolling shutter in rotation (fig. 18) and in translation (fig. 19).

use std::sync::Arc;

use camsim_core::{scenario::ShutterSpec, sequence::Sequence};
use glam::DVec2;

use super::{
    Picture, Report, ReproduceError, Setup, Table,
    circles::{Matches, matches, spots},
    displace::{Ideal, Light, Model, Path},
    rig::{self, FLIGHT_M_S, HEIGHT_M, Motion, TARGET_M},
    short,
};

/// Readout time, seconds: large, so that the effect shows.
const READOUT_S: f64 = 1.0;

/// What was found in one picture of one motion.
pub(super) struct Seen {
    /// Motion.
    pub motion: &'static str,
    /// Circles.
    pub circles: Matches,
    /// Pixels that show the wrong surface.
    pub wrong: usize,
}

/// Affine change of the circle grid against the picture of a still camera: `[[xx, xy], [yx, yy]]`, least
/// squares about the image centre.
pub(super) fn affine(still: &[DVec2], moved: &[DVec2]) -> [[f64; 2]; 2] {
    let middle = |points: &[DVec2]| points.iter().sum::<DVec2>() / points.len().max(1) as f64;
    let (still_middle, moved_middle) = (middle(still), middle(moved));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    let (mut bx, mut by) = (DVec2::ZERO, DVec2::ZERO);
    for (a, b) in still.iter().zip(moved) {
        let (a, b) = (*a - still_middle, *b - moved_middle);
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

pub(super) fn run(setup: &Setup<'_>) -> Result<Report, ReproduceError> {
    let mut report = Report::default();
    report.notes.push(format!(
        "Bench as in 8.4; readout {READOUT_S} s from top to bottom, its middle at the stamp. True places of the circles: each point projected at the time of \
         the row in which it lands. Right and wrong surfaces: the oracle's ray through each pixel's centre at the time of its row."
    ));
    let scene = rig::target(setup, TARGET_M)?;
    let rolling = ShutterSpec { readout_ms: 1e3 * READOUT_S, ..ShutterSpec::default() };
    let mut table = Table::new(
        "Circles of figs. 18 and 19 against their true places",
        &["motion", "method", "px RMS", "largest", "missed", "pixels with the wrong surface"],
    );
    let mut shapes = Table::new(
        "Shape of the target in camsim's pictures against closed form",
        &["motion", "what", "closed form", "found", "by the true places"],
    );
    let mut fig19 = Vec::new();
    for (motion, name) in [
        (Motion::turning(), "rotation clockwise"),
        (Motion::flying(1.0, 0.0), "to the right"),
        (Motion::flying(0.0, -1.0), "upwards"),
        (Motion::flying(0.0, 1.0), "downwards"),
    ] {
        let bench =
            rig::at(&*rig::sequence(rig::pinhole(setup.width_px), motion, &scene)?, 0.0, rolling.clone());
        let still = rig::snapshot(setup.engine, &bench, 0.0)?;
        let ideal = Ideal::at(setup.engine, &bench, 0.0)?;
        let paper = ideal.frame(
            &bench.scenario.camera,
            Model::Rk2(2.5_f64.to_radians()),
            1,
            Path::Straight,
            Light::Linear,
        )?;
        let own = rig::picture(setup.engine, &bench)?;
        for (method, frame) in [("paper: RK2 from the frame of the stamp", &paper), ("camsim", &own)] {
            let found = look(&bench, name, frame)?;
            let stats = found.circles.stats();
            table.row([
                name.into(),
                method.into(),
                short(stats.rms_px),
                short(stats.max_px),
                found.circles.missed.to_string(),
                found.wrong.to_string(),
            ]);
            if method == "camsim" {
                shape(&bench, &found, &mut shapes)?;
            }
        }
        match name {
            "rotation clockwise" => report.pictures.push(Picture {
                name: "fig18",
                caption: "Fig. 18: (a) still camera, (b) camera turning clockwise, the paper's method, (c) the same by camsim.".into(),
                frames: vec![still, paper, own],
                columns: 3,
                shrink: 2,
            }),
            _ => fig19.extend([still, paper, own]),
        }
    }
    report.pictures.push(Picture {
        name: "fig19",
        caption: "Fig. 19, row by row: to the right (shear), upwards (elongation), downwards (shortening); still camera, the paper's method, camsim. \
                  The paper's method loses a rim of the target wherever depth is read in the sky."
            .into(),
        frames: fig19,
        columns: 3,
        shrink: 2,
    });
    report.tables.push(("circles", table));
    report.tables.push(("shapes", shapes));
    Ok(report)
}

/// Finds the circles of a frame of the bench.
pub(super) fn look(
    bench: &Arc<Sequence>,
    motion: &'static str,
    frame: &camsim_core::frame::RenderedFrame,
) -> Result<Seen, ReproduceError> {
    let circles = matches(&rig::seen_circles(bench, 0.0, TARGET_M)?, &spots(frame));
    Ok(Seen { motion, circles, wrong: rig::wrong_surface(bench, frame)? })
}

/// Shear or stretch of the grid against its closed form: with the image moving at `rate` px/s, `rows` rows
/// and readout `t_r`, a point of still row y appears where `y' = y + rate t_r (y'/rows)`.
fn shape(bench: &Sequence, found: &Seen, table: &mut Table) -> Result<(), ReproduceError> {
    let (camera, _) = rig::checked(bench)?;
    let rate_px_s = camera.focal_px.y * FLIGHT_M_S / HEIGHT_M;
    let share = rate_px_s * READOUT_S / f64::from(camera.size_px[1]);
    // Right: the image moves left, lower rows later. Up: the image moves down. Down: it moves up.
    let (what, k, closed) = match found.motion {
        "to the right" => ("shear, px of x for one of y", [0, 1], -share),
        "upwards" => ("height, relative", [1, 1], 1.0 / (1.0 - share)),
        "downwards" => ("height, relative", [1, 1], 1.0 / (1.0 + share)),
        _ => return Ok(()),
    };
    let mut global = bench.clone();
    global.scenario.camera.shutter = ShutterSpec::default();
    let (still_camera, still_shutter) = rig::checked(&global)?;
    // The same circles in a still camera's picture: by their ground places, in the order of the grid.
    let pairs: Vec<(DVec2, DVec2, DVec2)> = super::pattern::circles(TARGET_M)
        .iter()
        .filter_map(|circle| {
            let (moving, shutter) = rig::checked(bench).ok()?;
            let here = circle.seen(|p| rig::project(bench, &moving, &shutter, 0.0, p))?;
            let spot = found
                .circles
                .pairs
                .iter()
                .find(|(seen, _)| seen.centroid_px.distance(here.centroid_px) < 1e-6)?
                .1;
            let still = circle.seen(|p| rig::project(&global, &still_camera, &still_shutter, 0.0, p))?;
            Some((still.centroid_px, spot.centroid_px, here.centroid_px))
        })
        .collect();
    let still: Vec<DVec2> = pairs.iter().map(|p| p.0).collect();
    let [found_shape, true_shape] =
        [pairs.iter().map(|p| p.1).collect::<Vec<_>>(), pairs.iter().map(|p| p.2).collect()]
            .map(|moved| affine(&still, &moved)[k[0]][k[1]]);
    table.row([
        found.motion.into(),
        what.into(),
        format!("{closed:.5}"),
        format!("{found_shape:.5}"),
        format!("{true_shape:.5}"),
    ]);
    Ok(())
}
