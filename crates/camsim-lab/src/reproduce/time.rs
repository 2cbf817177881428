//! 8.4: the displacement models over one second, in rotation (figs. 13 and 14) and in translation (fig. 15).

use camsim_core::{
    frame::RenderedFrame, reference::ErrorStats, scenario::ShutterSpec, temporal::displacement::Twist,
};
use glam::{DMat3, DQuat, DVec2, DVec3};

use super::{
    Picture, Report, ReproduceError, Setup, Table,
    circles::{matches, spots},
    displace::{Ideal, Light, Model, Path},
    rig::{self, Motion, TARGET_M, TURN_DEG_S},
    short,
};
use crate::plot::{Plot, Series};

/// Steps of fig. 14, degrees; all divide the 36 degrees of the experiment.
const STEPS_DEG: [f64; 10] = [36.0, 18.0, 12.0, 9.0, 6.0, 4.0, 3.0, 2.0, 1.0, 0.5];
/// Every so many pixels of the frame count for its error.
const GRID_PX: usize = 8;
/// A step bound just above an even part of the turn, so that rounding cannot add a step.
const ABOVE: f64 = 1.0 + 1e-9;

/// Errors of one model with one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepError {
    /// Largest step, degrees.
    pub step_deg: f64,
    /// Of straight steps, pixels RMS.
    pub linear_px: f64,
    /// Of Heun's steps.
    pub rk2_px: f64,
}

/// RMS error in pixels at the given places after a turn of 36 deg about `axis` (camera axes) within one
/// second of time shift, against the exact rotation; places that leave the front of the camera do not count.
pub(super) fn errors(places: &[DVec2], focal_px: f64, axis: DVec3) -> Vec<StepError> {
    let angle_rad = TURN_DEG_S.to_radians();
    let twist = Twist { rate_rad_s: axis * angle_rad, ..Twist::default() };
    // Seen a second before the stamp; a point at rest has since moved by -w in the camera.
    let exact = DMat3::from_quat(DQuat::from_axis_angle(axis, -angle_rad));
    let error = |model: Model| {
        let errors = places.iter().filter_map(|&uv| {
            let turned = exact * uv.extend(1.0);
            (turned.z > 0.2).then(|| {
                focal_px * model.displace(uv, 0.0, &twist, -1.0).distance(turned.truncate() / turned.z)
            })
        });
        ErrorStats::of(errors.collect()).rms_px
    };
    let of_step = |step_deg: f64| {
        let step_rad = step_deg.to_radians() * ABOVE;
        StepError { step_deg, linear_px: error(Model::Linear(step_rad)), rk2_px: error(Model::Rk2(step_rad)) }
    };
    STEPS_DEG.map(of_step).to_vec()
}

/// Distance between true circle centres and those found in a picture, pixels RMS, and how many were missed.
fn measured(frame: &RenderedFrame, seen: &[super::pattern::Seen]) -> (f64, usize) {
    let found = matches(seen, &spots(frame));
    (found.stats().rms_px, found.missed)
}

pub(super) fn run(setup: &Setup<'_>) -> Result<Report, ReproduceError> {
    let mut report = Report::default();
    report.notes.push(format!(
        "Bench: the circle grid, {TARGET_M} m wide, seen from {} m straight down with the focal length of the paper's camera ({:.2} px at 640) and no \
         lens: the models work behind the lens. The turn is {TURN_DEG_S} deg/s about the optical axis, the flight {} m/s: both of the reference program's path files.",
        rig::HEIGHT_M,
        rig::pinhole(640).focal_px[0],
        rig::FLIGHT_M_S,
    ));
    rotation(setup, &mut report)?;
    translation(setup, &mut report)?;
    Ok(report)
}

/// Figs. 13 and 14.
fn rotation(setup: &Setup<'_>, report: &mut Report) -> Result<(), ReproduceError> {
    let scene = rig::target(setup, TARGET_M)?;
    let bench = rig::sequence(rig::pinhole(setup.width_px), Motion::turning(), &scene)?;
    let (camera, _) = rig::checked(&bench)?;
    let seen = rig::seen_circles(&bench, 0.0, TARGET_M)?;
    let centres: Vec<DVec2> = seen.iter().filter_map(|circle| camera.unproject(circle.centre_px)).collect();
    let [width, height] = camera.size_px;
    let grid: Vec<DVec2> = (0..height)
        .step_by(GRID_PX)
        .flat_map(|y| (0..width).step_by(GRID_PX).map(move |x| DVec2::new(f64::from(x), f64::from(y))))
        .filter_map(|at| camera.unproject(at))
        .collect();
    let focal_px = camera.focal_px.x;
    let [on_circles, on_frame, pitched] = [(&centres, DVec3::Z), (&grid, DVec3::Z), (&grid, DVec3::X)]
        .map(|(at, axis)| errors(at, focal_px, axis));

    // The same as somebody measures it who has only the pictures: circles found in them.
    let ideal = Ideal::at(setup.engine, &bench, 1.0)?;
    let delayed = rig::at(&bench, 1.0, ShutterSpec { delay_ms: 1000.0, ..ShutterSpec::default() });
    let spec = &delayed.scenario.camera;
    let paper = |model: Model| ideal.frame(spec, model, 1, Path::Straight, Light::Linear);
    let own = rig::picture(setup.engine, &delayed)?;
    let (own_px, own_missed) = measured(&own, &seen);

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
        "Fig. 14: error in px RMS after a turn of 36 deg, at the circles and over the frame",
        &columns,
    );
    let mut by_pictures = Vec::new();
    for (k, error) in on_circles.iter().enumerate() {
        let (px, missed) = measured(&paper(Model::Rk2(error.step_deg.to_radians() * ABOVE))?, &seen);
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
    let curve = |name: &str, errors: &[StepError], pick: fn(&StepError) -> f64| Series {
        name: name.into(),
        points: errors.iter().map(|error| (error.step_deg, pick(error))).collect(),
        joined: true,
    };
    report.plots.push((
        "fig14",
        Plot {
            title: "Fig. 14: error against step size, 36 deg of rotation".into(),
            x_label: "step, deg".into(),
            y_label: "error, px RMS".into(),
            log: [true, true],
            series: vec![
                curve("linear, circles", &on_circles, |e| e.linear_px),
                curve("RK2, circles", &on_circles, |e| e.rk2_px),
                curve("RK2, whole frame", &on_frame, |e| e.rk2_px),
                curve("RK2, pitch instead of roll", &pitched, |e| e.rk2_px),
                Series { name: "RK2, circles found in pictures".into(), points: by_pictures, joined: true },
                Series {
                    name: "camsim, circles found in its picture".into(),
                    points: vec![(0.5, own_px), (36.0, own_px)],
                    joined: true,
                },
                Series {
                    name: "the paper's words: 0.02 px at 2.5 deg".into(),
                    points: vec![(2.5, 0.02)],
                    joined: false,
                },
            ],
        },
    ));
    report.pictures.push(Picture {
        name: "fig13",
        caption: "Fig. 13: (a) at the start, (b) after 1 s of rotation (36 deg), (c) 1 s later with 1 s of delay by one linear step, \
                  (d) the same by RK2 in one step, (e) RK2 in steps of 2.5 deg, (f) by camsim. (c) to (f) ought to be (a)."
            .into(),
        frames: vec![
            rig::snapshot(setup.engine, &bench, 0.0)?,
            rig::snapshot(setup.engine, &bench, 1.0)?,
            paper(Model::Linear(f64::INFINITY))?,
            paper(Model::Rk2(f64::INFINITY))?,
            paper(Model::Rk2(2.5_f64.to_radians()))?,
            own,
        ],
        columns: 3,
        shrink: 2,
    });
    Ok(())
}

/// Fig. 15.
fn translation(setup: &Setup<'_>, report: &mut Report) -> Result<(), ReproduceError> {
    let scene = rig::target(setup, TARGET_M)?;
    let mut table = Table::new(
        "Fig. 15: 1 s of flight and 1 s of delay against no delay, in pixels",
        &["flight", "model", "circles, px RMS", "circles missed", "pixels with the wrong surface"],
    );
    let mut frames = Vec::new();
    for (name, right, down) in [("right", 1.0, 0.0), ("down in the image", 0.0, 1.0)] {
        let bench = rig::sequence(rig::pinhole(setup.width_px), Motion::flying(right, down), &scene)?;
        let seen = rig::seen_circles(&bench, 0.0, TARGET_M)?;
        let truth = rig::snapshot(setup.engine, &bench, 0.0)?;
        let ideal = Ideal::at(setup.engine, &bench, 1.0)?;
        let delayed = rig::at(&bench, 1.0, ShutterSpec { delay_ms: 1000.0, ..ShutterSpec::default() });
        let paper =
            |model: Model| ideal.frame(&delayed.scenario.camera, model, 1, Path::Straight, Light::Linear);
        let linear = paper(Model::Linear(f64::INFINITY))?;
        let own = rig::picture(setup.engine, &delayed)?;
        for (model, frame) in [
            ("linear, one step, from the frame of the stamp", &linear),
            ("RK2, from the frame of the stamp", &paper(Model::Rk2(2.5_f64.to_radians()))?),
            ("camsim", &own),
        ] {
            let (px, missed) = measured(frame, &seen);
            table.row([
                name.into(),
                model.into(),
                short(px),
                missed.to_string(),
                rig::wrong_surface(&delayed, frame)?.to_string(),
            ]);
        }
        frames.extend([truth, linear, own]);
    }
    report.tables.push(("fig15", table));
    report.pictures.push(Picture {
        name: "fig15",
        caption:
            "Fig. 15: flight to the right (above) and downwards (below): (a, d) no delay, (b, e) 1 s later with 1 s of delay by the linear \
                  model, where a rim of the target disappears because depth is read where the sky is, (c, f) the same by camsim."
                .into(),
        frames,
        columns: 3,
        shrink: 2,
    });
    Ok(())
}
