//! 8.5: motion blur in rotation (fig. 16) and in translation (fig. 17).

use camsim_core::{frame::RenderedFrame, reference::RenderOptions, scenario::ShutterSpec};

use super::{
    ExperimentReport, Picture, ReproduceError, Setup, Table,
    displacement::{Averaging, DisplacementModel, PaperIdealFrame, SamplePath},
    test_bench::{self, Motion, TARGET_M},
};
use crate::plot::{Plot, Series};

/// Exposure time, seconds. Its middle is at the stamp, so three samples are a second (36 deg) apart.
const EXPOSURE_S: f64 = 2.0;
/// Exposure samples in the paper's figures.
const SAMPLES: [u32; 3] = [3, 10, 100];
/// Most rays per pixel of the reference renderer, over pixel area and exposure.
const REFERENCE_SAMPLES: u32 = 512;
/// Standard error at which the reference renderer stops, DN.
const REFERENCE_DN: f64 = 0.5;

/// Frames of a perfect camera at `count` instants of the exposure, at phases `phase(i)` from -0.5 to 0.5.
fn snapshots(
    setup: &Setup<'_>,
    bench: &camsim_core::sequence::Sequence,
    count: u32,
    phase: impl Fn(u32) -> f64,
) -> Result<Vec<RenderedFrame>, ReproduceError> {
    (0..count).map(|i| test_bench::snapshot(setup.engine, bench, EXPOSURE_S * phase(i))).collect()
}

/// Phases of the paper's samples: evenly spread, with both ends of the exposure.
fn even_phases(count: u32) -> impl Fn(u32) -> f64 {
    move |i| f64::from(i) / f64::from(count - 1) - 0.5
}

pub(super) fn run(setup: &Setup<'_>) -> Result<ExperimentReport, ReproduceError> {
    let mut report = ExperimentReport::default();
    report.notes.push(format!(
        "Test bench as in 8.4. The exposure is {EXPOSURE_S} s with its middle at the stamp, so that three \
         samples are one second apart. \"Exact\" is the reference renderer's integral over pixel area and \
         exposure, to {REFERENCE_DN}/255; \"overlay\" is the mean of perfect frames at the instants of the \
         samples. PSNR is of linear values with peak 1. The paper averages stored values, as the row \
         \"stored values averaged\" does."
    ));
    let rotation = motion_case(setup, &mut report, ("fig16", "Fig. 16: rotation"), Motion::turning())?;
    let translation = motion_case(
        setup,
        &mut report,
        ("fig17", "Fig. 17: translation to the right"),
        Motion::flying(1.0, 0.0),
    )?;
    let series = [("rotation", rotation), ("translation", translation)].into_iter().flat_map(
        |(name, [straight, curved])| {
            [("straight line (paper)", straight), ("each sample at its own source", curved)]
                .map(|(path, points)| Series::line(format!("{name}, {path}"), points))
        },
    );
    report.plots.push((
        "samples",
        Plot {
            title: "Blur by samples, against the exact exposure".into(),
            x_label: "samples".into(),
            y_label: "PSNR, dB".into(),
            log: [true, false],
            series: series.collect(),
        },
    ));
    Ok(report)
}

/// Points (samples, PSNR against the exact exposure): on a straight path, and on the curved path.
type Curves = [Vec<(f64, f64)>; 2];

/// One motion: table, picture, and curves for the plot.
// Long because: the table and the picture share all frames.
fn motion_case(
    setup: &Setup<'_>,
    report: &mut ExperimentReport,
    (name, title): (&'static str, &str),
    motion: Motion,
) -> Result<Curves, ReproduceError> {
    let scene = test_bench::target(setup, TARGET_M)?;
    let bench = test_bench::sequence(test_bench::pinhole(setup.width_px), motion, &scene)?;
    let exposed = test_bench::with_shutter(
        &bench,
        0.0,
        ShutterSpec { exposure_ms: 1e3 * EXPOSURE_S, ..ShutterSpec::default() },
    );
    let options = RenderOptions {
        max_samples: REFERENCE_SAMPLES,
        tolerance_dn: REFERENCE_DN,
        ..RenderOptions::default()
    };
    let exact = test_bench::reference(&exposed)?.render(0, &options);
    let ideal = PaperIdealFrame::render(setup.engine, &bench, 0.0)?;
    let spec = &exposed.scenario.camera;
    let rk2 = DisplacementModel::Rk2(2.5_f64.to_radians());

    let mut table = Table::new(
        title,
        &["method", "samples", "against the overlay, dB", "against the exact exposure, dB"],
    );
    let psnr = |a: &RenderedFrame, b: &RenderedFrame| {
        Ok::<_, ReproduceError>(test_bench::difference(a, b)?.psnr_db())
    };
    let mut curves: Curves = Default::default();
    let mut straight_frames = Vec::new();
    for count in SAMPLES {
        // An overlay of a hundred frames would hardly differ from the exact exposure.
        let overlay = if count <= 10 {
            Some(test_bench::mean(&snapshots(setup, &bench, count, even_phases(count))?))
        } else {
            None
        };
        for (k, (method, path)) in [
            ("paper: RK2, straight line", SamplePath::Straight),
            ("RK2, each sample at its own source", SamplePath::Curved),
        ]
        .into_iter()
        .enumerate()
        {
            let frame = ideal.frame(spec, rk2, count, path, Averaging::Linear)?;
            let to_exact = psnr(&frame, &exact)?;
            let to_overlay = overlay.as_ref().map(|overlay| psnr(&frame, overlay)).transpose()?;
            table.row([
                method.into(),
                count.to_string(),
                to_overlay.map_or("-".into(), |db| format!("{db:.1}")),
                format!("{to_exact:.1}"),
            ]);
            curves[k].push((f64::from(count), to_exact));
            if path == SamplePath::Straight {
                straight_frames.push(frame);
            }
        }
    }
    let stored = ideal.frame(spec, rk2, 100, SamplePath::Straight, Averaging::Stored)?;
    table.row([
        "paper: stored values averaged".into(),
        "100".into(),
        "-".into(),
        format!("{:.1}", psnr(&stored, &exact)?),
    ]);
    let own = test_bench::render_first(setup.engine, &exposed)?;
    table.row(["camsim".into(), "as planned".into(), "-".into(), format!("{:.1}", psnr(&own, &exact)?)]);
    report.tables.push((name, table));

    let mut frames = snapshots(setup, &bench, 3, even_phases(3))?;
    let overlay = test_bench::mean(&frames);
    frames.push(overlay);
    frames.extend(straight_frames);
    frames.extend([stored, own, exact]);
    report.pictures.push(Picture {
        name,
        caption: format!(
            "{title}: (a) to (c) three instants, (d) their overlay, the paper's straight path with (e) 3, \
             (f) 10, (g) 100 samples, (h) 100 samples of stored values, (i) camsim, (j) the exact exposure."
        ),
        frames,
        columns: 5,
        shrink: 2,
    });
    Ok(curves)
}
