//! 8.7: interlacing in rotation (fig. 20).

use camsim_core::{
    frame::RenderedFrame,
    scenario::{FieldOr, ShutterSpec},
};

use super::{
    Picture, Report, ReproduceError, Setup, Table,
    displace::{Ideal, Light, Model, Path},
    rig::{self, Motion, TARGET_M},
};

/// Lag between the fields, seconds: 36 deg of the turn.
const LAG_S: f64 = 1.0;

/// Even rows (counted from 0) of one frame, odd rows of another.
pub(super) fn woven(even: &RenderedFrame, odd: &RenderedFrame) -> RenderedFrame {
    let mut frame = odd.clone();
    let row = 4 * frame.size_px[0] as usize;
    for (mine, other) in
        frame.color_rgba.chunks_exact_mut(row).zip(even.color_rgba.chunks_exact(row)).step_by(2)
    {
        mine.copy_from_slice(other);
    }
    frame
}

pub(super) fn run(setup: &Setup<'_>) -> Result<Report, ReproduceError> {
    let mut report = Report::default();
    report.notes.push(format!(
        "Bench as in 8.4; the rows of the first field (0-based even ones) are {LAG_S} s older. The truth is woven from two pictures of a perfect camera."
    ));
    let scene = rig::target(setup, TARGET_M)?;
    let bench = rig::sequence(rig::pinhole(setup.width_px), Motion::turning(), &scene)?;
    let interlaced = rig::at(
        &bench,
        LAG_S,
        ShutterSpec { interlace_ms: FieldOr::Ms(1e3 * LAG_S), ..ShutterSpec::default() },
    );
    let [first, second] = [0.0, LAG_S].map(|stamp_s| rig::snapshot(setup.engine, &bench, stamp_s));
    let (first, second) = (first?, second?);
    let truth = woven(&first, &second);
    let own = rig::picture(setup.engine, &interlaced)?;
    let ideal = Ideal::at(setup.engine, &bench, LAG_S)?;
    let mut table = Table::new(
        "Fig. 20 against rows of two perfect pictures, linear light",
        &["method", "PSNR, dB", "largest difference"],
    );
    let step_rad = 2.5_f64.to_radians();
    let mut frames = vec![first, second];
    for (method, frame) in [
        (
            "paper: linear, one step",
            ideal.frame(
                &interlaced.scenario.camera,
                Model::Linear(f64::INFINITY),
                1,
                Path::Straight,
                Light::Linear,
            )?,
        ),
        (
            "paper: RK2",
            ideal.frame(
                &interlaced.scenario.camera,
                Model::Rk2(step_rad),
                1,
                Path::Straight,
                Light::Linear,
            )?,
        ),
        ("camsim", own),
    ] {
        let difference = rig::difference(&frame, &truth)?;
        table.row([method.into(), format!("{:.1}", difference.psnr_db()), format!("{:.3}", difference.max)]);
        frames.push(frame);
    }
    frames.push(truth);
    report.tables.push(("fig20", table));
    report.pictures.push(Picture {
        name: "fig20",
        caption: "Fig. 20: (a, b) a perfect camera at both instants, (c) interlaced by the linear model in one step, (d) by RK2, (e) by camsim, (f) woven from \
                  (a) and (b)."
            .into(),
        frames,
        columns: 3,
        shrink: 1,
    });
    Ok(report)
}
