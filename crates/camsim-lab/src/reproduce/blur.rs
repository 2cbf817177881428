//! 8.5: motion blur in rotation (fig. 16) and in translation (fig. 17).

use camsim_core::{frame::RenderedFrame, reference::RenderOptions, scenario::ShutterSpec};

use super::{
    Picture, Report, ReproduceError, Setup, Table,
    displace::{Ideal, Light, Model, Path},
    rig::{self, Motion, TARGET_M},
};
use crate::plot::{Plot, Series};

/// Exposure: from one second before the stamp to one after, so that three samples are a second (36 deg)
/// apart.
const EXPOSURE_S: f64 = 2.0;
/// Samples of the paper's figures.
const SAMPLES: [u32; 3] = [3, 10, 100];
/// Samples of a pixel by which the oracle integrates area and exposure, at most, and where it stops, 1/255 of
/// the linear range.
const ORACLE_SAMPLES: u32 = 512;
const ORACLE_DN: f64 = 0.5;

/// What a perfect camera sees at `count` instants of the exposure; `phase(i)` from -0.5 to 0.5.
fn snapshots(
    setup: &Setup<'_>,
    bench: &camsim_core::sequence::Sequence,
    count: u32,
    phase: impl Fn(u32) -> f64,
) -> Result<Vec<RenderedFrame>, ReproduceError> {
    (0..count).map(|i| rig::snapshot(setup.engine, bench, EXPOSURE_S * phase(i))).collect()
}

/// From one end of the exposure to the other, ends included, as the paper samples.
fn end_to_end(count: u32) -> impl Fn(u32) -> f64 {
    move |i| f64::from(i) / f64::from(count - 1) - 0.5
}

pub(super) fn run(setup: &Setup<'_>) -> Result<Report, ReproduceError> {
    let mut report = Report::default();
    report.notes.push(format!(
        "Bench as in 8.4; exposure {EXPOSURE_S} s about the stamp, so that three samples are one second apart. \"Exact\" is the oracle's integral over pixel \
         area and exposure, to {ORACLE_DN}/255; \"overlay\" the mean of as many perfect pictures as the method takes samples, at its own instants. PSNR on linear light, peak 1; the paper averages stored values, which the last rows of each table do."
    ));
    let turning = case(setup, &mut report, ("fig16", "Fig. 16: rotation"), Motion::turning())?;
    let flying =
        case(setup, &mut report, ("fig17", "Fig. 17: translation to the right"), Motion::flying(1.0, 0.0))?;
    let series = [("rotation", turning), ("translation", flying)].into_iter().flat_map(
        |(name, [straight, curved])| {
            [("straight line (paper)", straight), ("each sample at its own place", curved)]
                .map(|(how, points)| Series { name: format!("{name}, {how}"), points, joined: true })
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

/// PSNR against the exact exposure by samples: on the straight line, and each at its own place.
type Curves = [Vec<(f64, f64)>; 2];

fn case(
    setup: &Setup<'_>,
    report: &mut Report,
    (name, title): (&'static str, &str),
    motion: Motion,
) -> Result<Curves, ReproduceError> {
    let scene = rig::target(setup, TARGET_M)?;
    let bench = rig::sequence(rig::pinhole(setup.width_px), motion, &scene)?;
    let exposed =
        rig::at(&bench, 0.0, ShutterSpec { exposure_ms: 1e3 * EXPOSURE_S, ..ShutterSpec::default() });
    let options =
        RenderOptions { max_samples: ORACLE_SAMPLES, tolerance_dn: ORACLE_DN, ..RenderOptions::default() };
    let exact = rig::oracle(&exposed)?.render(0, &options);
    let ideal = Ideal::at(setup.engine, &bench, 0.0)?;
    let spec = &exposed.scenario.camera;
    let rk2 = Model::Rk2(2.5_f64.to_radians());

    let mut table = Table::new(
        title,
        &["method", "samples", "against the overlay, dB", "against the exact exposure, dB"],
    );
    let psnr =
        |a: &RenderedFrame, b: &RenderedFrame| Ok::<_, ReproduceError>(rig::difference(a, b)?.psnr_db());
    let mut curves: Curves = Default::default();
    let mut shown = Vec::new();
    for count in SAMPLES {
        // A hundred pictures more would tell nothing that the exact exposure does not.
        let overlay = if count <= 10 {
            Some(rig::mean(&snapshots(setup, &bench, count, end_to_end(count))?))
        } else {
            None
        };
        for (k, (how, path)) in [
            ("paper: RK2, straight line", Path::Straight),
            ("RK2, each sample at its own place", Path::Curved),
        ]
        .into_iter()
        .enumerate()
        {
            let frame = ideal.frame(spec, rk2, count, path, Light::Linear)?;
            let to_exact = psnr(&frame, &exact)?;
            let to_overlay = overlay.as_ref().map(|overlay| psnr(&frame, overlay)).transpose()?;
            table.row([
                how.into(),
                count.to_string(),
                to_overlay.map_or("-".into(), |db| format!("{db:.1}")),
                format!("{to_exact:.1}"),
            ]);
            curves[k].push((f64::from(count), to_exact));
            if path == Path::Straight {
                shown.push(frame);
            }
        }
    }
    let stored = ideal.frame(spec, rk2, 100, Path::Straight, Light::Stored)?;
    table.row([
        "paper: stored values averaged".into(),
        "100".into(),
        "-".into(),
        format!("{:.1}", psnr(&stored, &exact)?),
    ]);
    let own = rig::picture(setup.engine, &exposed)?;
    table.row(["camsim".into(), "by its own rule".into(), "-".into(), format!("{:.1}", psnr(&own, &exact)?)]);
    report.tables.push((name, table));

    let mut frames = snapshots(setup, &bench, 3, end_to_end(3))?;
    let overlay = rig::mean(&frames);
    frames.push(overlay);
    frames.extend(shown);
    frames.extend([stored, own, exact]);
    report.pictures.push(Picture {
        name,
        caption: format!(
            "{title}: (a) to (c) three positions, (d) their overlay, the paper's straight line with (e) 3, (f) 10, (g) 100 samples, (h) 100 samples of stored \
             values, (i) camsim, (j) the exact exposure."
        ),
        frames,
        columns: 5,
        shrink: 2,
    });
    Ok(curves)
}
