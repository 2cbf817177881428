//! 8.4: the displacement models over one second, in rotation (figs. 13 and 14) and in translation (fig. 15).

use camsim_core::{
    frame::RenderedFrame, reference::ErrorStats, scenario::ShutterSpec, temporal::displacement::Twist,
};
use glam::{DMat3, DQuat, DVec2, DVec3};

use super::{
    ExperimentReport, Picture, ReproduceError, Setup, Table,
    circles::{detect_blobs, match_circles},
    displacement::{DisplacementModel, PaperIdealFrame},
    short,
    test_bench::{self, Motion, TARGET_M, TURN_DEG_S},
};
use crate::plot::{Plot, Series};

/// Steps of fig. 14, degrees; all divide the 36 degrees of the experiment.
const STEPS_DEG: [f64; 10] = [36.0, 18.0, 12.0, 9.0, 6.0, 4.0, 3.0, 2.0, 1.0, 0.5];
/// Step of the pixels over which the error of a frame is taken.
const GRID_PX: usize = 8;
/// Factor that raises the largest step slightly, so that rounding cannot add a step.
const STEP_MARGIN: f64 = 1.0 + 1e-9;

/// Errors of the displacement models with one step size.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepError {
    /// Largest step, degrees.
    pub step_deg: f64,
    /// RMS error of straight steps, pixels.
    pub linear_px: f64,
    /// RMS error of Heun's steps, pixels.
    pub rk2_px: f64,
}

/// RMS errors at the given image points for a time shift of one second, in which the camera rotates by 36 deg
/// about `axis` (camera axes). Points that leave the front of the camera are skipped.
pub(super) fn step_errors(points: &[DVec2], focal_px: f64, axis: DVec3) -> Vec<StepError> {
    let angle_rad = TURN_DEG_S.to_radians();
    let twist = Twist { rate_rad_s: axis * angle_rad, ..Twist::default() };
    // A point at rest rotates by -angle in the camera.
    let exact = DMat3::from_quat(DQuat::from_axis_angle(axis, -angle_rad));
    let error = |model: DisplacementModel| {
        let errors = points.iter().filter_map(|&uv| {
            let rotated = exact * uv.extend(1.0);
            (rotated.z > 0.2).then(|| {
                focal_px * model.displace(uv, 0.0, &twist, -1.0).distance(rotated.truncate() / rotated.z)
            })
        });
        ErrorStats::of(errors.collect()).rms_px
    };
    let at_step = |step_deg: f64| {
        let step_rad = step_deg.to_radians() * STEP_MARGIN;
        StepError {
            step_deg,
            linear_px: error(DisplacementModel::Linear(step_rad)),
            rk2_px: error(DisplacementModel::Rk2(step_rad)),
        }
    };
    STEPS_DEG.map(at_step).to_vec()
}

/// RMS distance of detected circles from the true ones, pixels, and the number of missed circles.
fn detection_error(frame: &RenderedFrame, circles: &[super::circle_grid::CircleImage]) -> (f64, usize) {
    let matches = match_circles(circles, &detect_blobs(frame));
    (matches.stats().rms_px, matches.missed)
}

pub(super) fn run(setup: &Setup<'_>) -> Result<ExperimentReport, ReproduceError> {
    let mut report = ExperimentReport::default();
    report.notes.push(format!(
        "Test bench: the circle grid, {TARGET_M} m wide, seen from {} m straight down with the focal length \
         of the paper's camera ({:.2} px at 640) and without distortion, since the models work on ideal \
         rays. The rotation is {TURN_DEG_S} deg/s about the optical axis, the translation {} m/s, as in the \
         files of the paper's program.",
        test_bench::HEIGHT_M,
        test_bench::pinhole(640).focal_px[0],
        test_bench::FLIGHT_M_S,
    ));
    rotation(setup, &mut report)?;
    translation(setup, &mut report)?;
    Ok(report)
}

/// Rotation: figs. 13 and 14.
fn rotation(setup: &Setup<'_>, report: &mut ExperimentReport) -> Result<(), ReproduceError> {
    let scene = test_bench::target(setup, TARGET_M)?;
    let bench = test_bench::sequence(test_bench::pinhole(setup.width_px), Motion::turning(), &scene)?;
    let (camera, _) = test_bench::camera_and_shutter(&bench)?;
    let circles = test_bench::circles_in_view(&bench, 0.0, TARGET_M)?;
    let centres: Vec<DVec2> =
        circles.iter().filter_map(|circle| camera.unproject(circle.centre_px)).collect();
    let [width, height] = camera.size_px;
    let grid: Vec<DVec2> = (0..height)
        .step_by(GRID_PX)
        .flat_map(|y| (0..width).step_by(GRID_PX).map(move |x| DVec2::new(f64::from(x), f64::from(y))))
        .filter_map(|pixel| camera.unproject(pixel))
        .collect();
    let focal_px = camera.focal_px.x;
    let [on_circles, on_frame, pitched] = [(&centres, DVec3::Z), (&grid, DVec3::Z), (&grid, DVec3::X)]
        .map(|(points, axis)| step_errors(points, focal_px, axis));

    // The same errors from circles detected in frames.
    let ideal = PaperIdealFrame::render(setup.engine, &bench, 1.0)?;
    let delayed =
        test_bench::with_shutter(&bench, 1.0, ShutterSpec { delay_ms: 1000.0, ..ShutterSpec::default() });
    let spec = &delayed.scenario.camera;
    let paper = |model: DisplacementModel| ideal.instant(spec, model);
    let own = test_bench::render_first(setup.engine, &delayed)?;
    let (own_px, own_missed) = detection_error(&own, &circles);

    let columns = [
        "step, deg",
        "linear",
        "RK2",
        "RK2 by pictures",
        "missed",
        "frame: linear",
        "frame: RK2",
        "pitch: linear",
        "pitch: RK2",
    ];
    let mut table = Table::new(
        "Fig. 14: error in px RMS after 36 deg of rotation, at the circles and over the frame",
        &columns,
    );
    let mut by_pictures = Vec::new();
    for (k, error) in on_circles.iter().enumerate() {
        let (px, missed) = detection_error(
            &paper(DisplacementModel::Rk2(error.step_deg.to_radians() * STEP_MARGIN))?,
            &circles,
        );
        by_pictures.push((error.step_deg, px));
        table.row([
            error.step_deg.to_string(),
            short(error.linear_px),
            short(error.rk2_px),
            short(px),
            missed.to_string(),
            short(on_frame[k].linear_px),
            short(on_frame[k].rk2_px),
            short(pitched[k].linear_px),
            short(pitched[k].rk2_px),
        ]);
    }
    let cell = |text: &str| text.to_owned();
    table.row([cell("camsim, its own frame"), cell("-"), cell("-"), short(own_px), own_missed.to_string()]);
    report.tables.push(("fig14", table));
    report.plots.push(("fig14", fig14_plot([&on_circles, &on_frame, &pitched], by_pictures, own_px)));
    report.pictures.push(Picture {
        name: "fig13",
        caption: "Fig. 13: (a) at the start, (b) after 1 s of rotation (36 deg), (c) 1 s later with 1 s of \
                  delay by one linear step, (d) by RK2 in one step, (e) by RK2 in steps of 2.5 deg, (f) by \
                  camsim. (c) to (f) should equal (a)."
            .into(),
        frames: vec![
            test_bench::snapshot(setup.engine, &bench, 0.0)?,
            test_bench::snapshot(setup.engine, &bench, 1.0)?,
            paper(DisplacementModel::Linear(f64::INFINITY))?,
            paper(DisplacementModel::Rk2(f64::INFINITY))?,
            paper(DisplacementModel::Rk2(2.5_f64.to_radians()))?,
            own,
        ],
        columns: 3,
        shrink: 2,
    });
    Ok(())
}

/// The errors of fig. 14 at the circles, over the frame, and over it in pitch; by the paper's pictures and by
/// camsim's own.
fn fig14_plot(
    [on_circles, on_frame, pitched]: [&[StepError]; 3],
    by_pictures: Vec<(f64, f64)>,
    own_px: f64,
) -> Plot {
    let curve = |name: &str, errors: &[StepError], pick: fn(&StepError) -> f64| {
        Series::line(name, errors.iter().map(|error| (error.step_deg, pick(error))).collect())
    };
    Plot {
        title: "Fig. 14: error against step size, 36 deg of rotation".into(),
        x_label: "step, deg".into(),
        y_label: "error, px RMS".into(),
        log: [true, true],
        series: vec![
            curve("linear, circles", on_circles, |e| e.linear_px),
            curve("RK2, circles", on_circles, |e| e.rk2_px),
            curve("RK2, whole frame", on_frame, |e| e.rk2_px),
            curve("RK2, pitch instead of roll", pitched, |e| e.rk2_px),
            Series::line("RK2, circles detected in frames", by_pictures),
            Series::line("camsim, circles detected in its frame", vec![(0.5, own_px), (36.0, own_px)]),
            Series::dots("text of the paper: 0.02 px at 2.5 deg", vec![(2.5, 0.02)]),
        ],
    }
}

/// Translation: fig. 15.
fn translation(setup: &Setup<'_>, report: &mut ExperimentReport) -> Result<(), ReproduceError> {
    let scene = test_bench::target(setup, TARGET_M)?;
    let mut table = Table::new(
        "Fig. 15: 1 s of flight and 1 s of delay against no delay, in pixels",
        &["flight", "model", "circles, px RMS", "circles missed", "pixels with the wrong surface"],
    );
    let mut frames = Vec::new();
    for (name, right, down) in [("right", 1.0, 0.0), ("down in the image", 0.0, 1.0)] {
        let bench =
            test_bench::sequence(test_bench::pinhole(setup.width_px), Motion::flying(right, down), &scene)?;
        let circles = test_bench::circles_in_view(&bench, 0.0, TARGET_M)?;
        let truth = test_bench::snapshot(setup.engine, &bench, 0.0)?;
        let ideal = PaperIdealFrame::render(setup.engine, &bench, 1.0)?;
        let delayed =
            test_bench::with_shutter(&bench, 1.0, ShutterSpec { delay_ms: 1000.0, ..ShutterSpec::default() });
        let paper = |model: DisplacementModel| ideal.instant(&delayed.scenario.camera, model);
        let linear = paper(DisplacementModel::Linear(f64::INFINITY))?;
        let own = test_bench::render_first(setup.engine, &delayed)?;
        for (model, frame) in [
            ("linear, one step, from the frame of the stamp", &linear),
            ("RK2, from the frame of the stamp", &paper(DisplacementModel::Rk2(2.5_f64.to_radians()))?),
            ("camsim", &own),
        ] {
            let (px, missed) = detection_error(frame, &circles);
            table.row([
                name.into(),
                model.into(),
                short(px),
                missed.to_string(),
                test_bench::count_wrong_surface(&delayed, frame)?.to_string(),
            ]);
        }
        frames.extend([truth, linear, own]);
    }
    report.tables.push(("fig15", table));
    report.pictures.push(Picture {
        name: "fig15",
        caption:
            "Fig. 15: flight to the right (above) and downwards (below): (a, d) no delay, (b, e) 1 s later \
             with 1 s of delay by the linear model, which loses a rim of the target where it reads the depth \
             of the sky, (c, f) the same by camsim."
                .into(),
        frames,
        columns: 3,
        shrink: 2,
    });
    Ok(())
}
