//! 8.7: interlacing in rotation (fig. 20).

use camsim_core::{
    frame::RenderedFrame,
    scenario::{FieldOr, ShutterSpec},
};

use super::{
    ExperimentReport, Picture, ReproduceError, Setup, Table,
    displacement::{DisplacementModel, PaperIdealFrame},
    test_bench::{self, Motion, TARGET_M},
};

/// Time between the fields, seconds; the camera turns by 36 deg in it.
const LAG_S: f64 = 1.0;

/// Interlaces two frames: even rows, counted from 0, of the first and odd rows of the second.
pub(super) fn interlace_frames(even: &RenderedFrame, odd: &RenderedFrame) -> RenderedFrame {
    let mut frame = odd.clone();
    let row = 4 * frame.size_px[0] as usize;
    for (target, source) in
        frame.color_rgba_mut().chunks_exact_mut(row).zip(even.color_rgba().chunks_exact(row)).step_by(2)
    {
        target.copy_from_slice(source);
    }
    frame
}

// Long because: a list of methods and their figures.
pub(super) fn run(setup: &Setup<'_>) -> Result<ExperimentReport, ReproduceError> {
    let mut report = ExperimentReport::default();
    report.notes.push(format!(
        "Test bench as in 8.4. The rows of the first field (even ones, counted from 0) are {LAG_S} s older. \
         The truth is interlaced from two frames of a perfect camera."
    ));
    let scene = test_bench::target(setup, TARGET_M)?;
    let bench = test_bench::sequence(test_bench::pinhole(setup.width_px), Motion::turning(), &scene)?;
    let interlaced = test_bench::with_shutter(
        &bench,
        LAG_S,
        ShutterSpec { interlace_ms: FieldOr::Ms(1e3 * LAG_S), ..ShutterSpec::default() },
    );
    let [first, second] = [0.0, LAG_S].map(|stamp_s| test_bench::snapshot(setup.engine, &bench, stamp_s));
    let (first, second) = (first?, second?);
    let truth = interlace_frames(&first, &second);
    let own = test_bench::render_first(setup.engine, &interlaced)?;
    let ideal = PaperIdealFrame::render(setup.engine, &bench, LAG_S)?;
    let mut table = Table::new(
        "Fig. 20 against rows of two perfect pictures, linear light",
        &["method", "PSNR, dB", "largest difference"],
    );
    let paper = |model: DisplacementModel| ideal.instant(&interlaced.scenario.camera, model);
    let mut frames = vec![first, second];
    for (method, frame) in [
        ("paper: linear, one step", paper(DisplacementModel::Linear(f64::INFINITY))?),
        ("paper: RK2", paper(DisplacementModel::Rk2(2.5_f64.to_radians()))?),
        ("camsim", own),
    ] {
        let difference = test_bench::difference(&frame, &truth)?;
        table.row([method.into(), format!("{:.1}", difference.psnr_db()), format!("{:.3}", difference.max)]);
        frames.push(frame);
    }
    frames.push(truth);
    report.tables.push(("fig20", table));
    report.pictures.push(Picture {
        name: "fig20",
        caption: "Fig. 20: (a, b) a perfect camera at both instants, interlaced (c) by the linear model in \
                  one step, (d) by RK2, (e) by camsim, (f) from (a) and (b)."
            .into(),
        frames,
        columns: 3,
        shrink: 1,
    });
    Ok(report)
}
