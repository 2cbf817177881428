//! 8.9: frame rates.

use std::{
    convert::Infallible,
    time::{Duration, Instant},
};

use camsim_core::scenario::{Auto, CameraSpec, Channel, Preset, ShutterSpec, Silhouettes};
use camsim_engine::Session;

use super::{
    ExperimentReport, ReproduceError, Setup, Table,
    test_bench::{self, Motion, TARGET_M},
};
use crate::{
    plot::{Plot, Series},
    timing::quantile,
};

/// Number of rounds; each renders a burst with every variant in turn.
const ROUNDS: usize = 9;
/// Frames in a burst: enough that two in flight overlap.
const BURST: u64 = 3;
/// Time after which no round begins.
const BUDGET: Duration = Duration::from_secs(120);
/// Name, lens, readout in ms, exposure in ms, exposure samples of the paper preset, and ms per frame of the
/// paper's program at 640 x 480 on a software adapter with two cores (its best time).
const CASES: [(&str, bool, f64, f64, u32, f64); 5] = [
    ("ideal camera, nothing on", false, 0.0, 0.0, 1, 23.6),
    ("fisheye", true, 0.0, 0.0, 1, 32.0),
    ("fisheye, rolling shutter 33 ms", true, 33.0, 0.0, 1, f64::NAN),
    ("the same, exposure 100 ms, 10 samples", true, 33.0, 100.0, 10, 33.7),
    ("the same, exposure 100 ms, 100 samples", true, 33.0, 100.0, 100, 115.4),
];

/// A session and its times.
struct TimedSession<'a> {
    session: Session<'a>,
    /// Milliseconds per frame, one entry per round.
    ms: Vec<f64>,
}

pub(super) fn run(setup: &Setup<'_>) -> Result<ExperimentReport, ReproduceError> {
    let mut report = ExperimentReport::default();
    let mut variants = variants(setup)?;
    measure(&mut variants)?;
    let ms: Vec<f64> = variants.iter().map(|variant| quantile(&variant.ms, 0.5)).collect();
    report.notes.push(format!(
        "Renderer: {}. {}x{} pixels, read back, nothing encoded; medians of {} bursts of {BURST} frames, all \
         variants in turn. The paper: more than 33 frames/s with 100 samples on a GeForce 940MX. \"Reference \
         program\": the paper's published code, measured at 640x480 with the same scene on Mesa's software \
         adapter with two cores, so it compares with such a machine only. camsim takes as many samples as \
         its tolerance needs, whatever the row says.",
        setup.engine,
        setup.width_px,
        setup.width_px * 3 / 4,
        variants[0].ms.len(),
    ));
    report.tables.push(("speed", table(&ms)));
    report.plots.push(("speed", plot(&ms)));
    Ok(report)
}

/// A session for each case by each of camsim's three: the paper's preset, the default, and the default without rays
/// at silhouettes.
fn variants<'a>(setup: &Setup<'a>) -> Result<Vec<TimedSession<'a>>, ReproduceError> {
    let scene = test_bench::target(setup, TARGET_M)?;
    let mut variants = Vec::new();
    for (_, lens, readout_ms, exposure_ms, samples, _) in CASES {
        for (preset, silhouettes) in
            [(Preset::Paper, false), (Preset::Default, true), (Preset::Default, false)]
        {
            let camera =
                if lens { test_bench::fisheye(setup.width_px) } else { test_bench::pinhole(setup.width_px) };
            let camera = CameraSpec {
                fps: 30.0,
                shutter: ShutterSpec { readout_ms, exposure_ms, ..ShutterSpec::default() },
                ..camera
            };
            // The rotation of the measurements of the paper's program.
            let mut sequence = (*test_bench::sequence(camera, Motion::turning(), &scene)?).clone();
            sequence.scenario.quality.preset = preset;
            if !silhouettes {
                sequence.scenario.quality.silhouettes = Silhouettes::Plain;
            }
            if preset == Preset::Paper {
                sequence.scenario.quality.blur_samples = Auto::Value(samples);
            }
            let mut session = setup.engine.session::<Infallible>(sequence.into(), &[Channel::Color])?;
            // The first dispatch of a pipeline compiles it.
            render_burst(&mut session, 0)?;
            variants.push(TimedSession { session, ms: Vec::new() });
        }
    }
    Ok(variants)
}

/// Times all variants in turn, each round beginning with another.
fn measure(variants: &mut [TimedSession<'_>]) -> Result<(), ReproduceError> {
    let begin = Instant::now();
    for round in 0..ROUNDS {
        if round > 0 && begin.elapsed() > BUDGET {
            break;
        }
        let count = variants.len();
        for k in 0..count {
            let variant = &mut variants[(k + round) % count];
            let begin = Instant::now();
            render_burst(&mut variant.session, round as u64)?;
            variant.ms.push(1e3 * begin.elapsed().as_secs_f64() / BURST as f64);
        }
    }
    Ok(())
}

fn table(ms: &[f64]) -> Table {
    let mut table = Table::new(
        "Time a frame, ms",
        &[
            "case",
            "reference program",
            "paper preset",
            "frames/s",
            "camsim",
            "frames/s",
            "camsim without silhouette rays",
            "frames/s",
        ],
    );
    for (k, (name, .., reference_ms)) in CASES.into_iter().enumerate() {
        let [paper, own, plain] = [ms[3 * k], ms[3 * k + 1], ms[3 * k + 2]];
        let reference = if reference_ms.is_nan() { "-".to_owned() } else { format!("{reference_ms:.1}") };
        table.row([
            name.into(),
            reference,
            format!("{paper:.1}"),
            format!("{:.1}", 1e3 / paper),
            format!("{own:.1}"),
            format!("{:.1}", 1e3 / own),
            format!("{plain:.1}"),
            format!("{:.1}", 1e3 / plain),
        ]);
    }
    table
}

fn plot(ms: &[f64]) -> Plot {
    let series = |name: &str, first: usize| {
        let points = ms.iter().skip(first).step_by(3).enumerate();
        Series::line(name, points.map(|(k, ms)| (k as f64 + 1.0, *ms)).collect())
    };
    let reference = CASES.iter().enumerate().map(|(k, case)| (k as f64 + 1.0, case.5)).collect();
    Plot {
        title: "Time a frame by case".into(),
        x_label: "case, as in the table".into(),
        y_label: "ms a frame".into(),
        log: [false, false],
        series: vec![
            series("paper preset", 0),
            series("camsim", 1),
            series("camsim without silhouette rays", 2),
            Series::dots("reference program (software adapter, two cores)", reference),
        ],
    }
}

fn render_burst(session: &mut Session<'_>, round: u64) -> Result<(), ReproduceError> {
    Ok(session.render::<Infallible>(round * BURST..(round + 1) * BURST, &mut |finished| {
        std::hint::black_box(finished);
        Ok(())
    })?)
}
