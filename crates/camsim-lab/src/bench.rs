//! Run time against error: every case with every method, in one table (`camsim bench`).
//!
//! Time is that of frames rendered and read back, measured in interleaved rounds ([`rounds`]). Error is measured against the oracle
//! ([`truth`]): of the source coordinates in pixels of the ideal frame, and of the picture in decibels on linear values with peak 1.

use std::{collections::BTreeMap, convert::Infallible, sync::Arc, time::Instant};

use camsim_core::{
    mount::MountError,
    reference::OracleError,
    scenario::{Preset, validate},
    sequence::Sequence,
};
use camsim_gpu::{Engine, GpuError, RenderError};
use serde::Serialize;

use crate::{
    cases::{Case, CaseError, cases},
    plot::PlotError,
};

pub mod ablation;
mod blit;
pub mod knobs;
mod pareto;
pub mod rounds;
mod table;
pub mod truth;

pub use ablation::AblationRow;
pub use pareto::Violation;

use knobs::{DEFAULT, Family, Variant, variants};
use rounds::{Effort, Times};
use truth::{Errors, Truth};

/// The case of which the ablation is measured.
const ABLATED: &str = "all-effects";
/// Cases of the short form: one of each kind.
const QUICK: [&str; 4] = ["plane-30", "terrain-100", "buildings-15", "blender-plane"];
/// Size of the short form.
const QUICK_PX: [u32; 2] = [320, 240];

/// Errors of the bench.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A case that cannot be made.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A mount that cannot be used.
    #[error(transparent)]
    Mount(#[from] MountError),
    /// The renderer.
    #[error(transparent)]
    Render(#[from] RenderError<Infallible>),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The oracle's camera or shutter.
    #[error(transparent)]
    Oracle(#[from] OracleError),
    /// The plot.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// A name that no case has.
    #[error("there is no case or group \"{name}\"; there are: {known}")]
    NoSuchCase {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
}

/// What to measure.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Names of cases or groups; all if empty.
    pub cases: Vec<String>,
    /// Few cases, small pictures, few rounds.
    pub quick: bool,
}

/// One point of the table. The first twelve are the stable ones.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the case.
    pub case: String,
    /// `default` or `paper`.
    pub preset: &'static str,
    /// Output width.
    pub width: u32,
    /// Output height.
    pub height: u32,
    /// Milliseconds a frame, median of the rounds.
    pub ms_per_frame_p50: f64,
    /// The same, 99th percentile.
    pub ms_per_frame_p99: f64,
    /// Processor milliseconds a frame over all threads, median; null where it is not known.
    pub cpu_ms_per_frame: Option<f64>,
    /// RMS error of the source coordinates, px; null where it was not measured.
    pub coord_rms_px: Option<f64>,
    /// 99th percentile.
    pub coord_p99_px: Option<f64>,
    /// Largest.
    pub coord_max_px: Option<f64>,
    /// Of linear values with peak 1 against the oracle's picture.
    pub psnr_db: Option<f64>,
    /// The plan's own bound on `coord_p99_px`, px.
    pub predicted_px: Option<f64>,
    /// What is forced, or `auto` and the tolerance.
    pub knob: String,
    /// What the row varies.
    #[serde(skip)]
    pub family: Family,
    /// Kind of the case.
    pub group: &'static str,
    /// Time over that of the case's default row in the same round: quartiles.
    pub time_to_default: Option<[f64; 3]>,
    /// PSNR of pixels within 3 px of a silhouette; null without silhouettes.
    pub edge_psnr_db: Option<f64>,
    /// RMS of pixels farther than that from any silhouette, px.
    pub smooth_rms_px: Option<f64>,
    /// 99th percentile of the same: what `predicted_px` bounds.
    pub smooth_p99_px: Option<f64>,
    /// Share of the compared pixels within 3 px of a silhouette.
    pub edge_share: Option<f64>,
    /// Pixels compared: coordinates, picture.
    pub compared: [u64; 2],
    /// Pixels with a source that the oracle has none for, and the other way round.
    pub falsely_valid: u64,
    /// See above.
    pub missing: u64,
    /// No row of this case and size has both less time and less coordinate error.
    pub coord_front: bool,
    /// The same with PSNR.
    pub image_front: bool,
    /// Opening the session and its first two frames, seconds.
    pub start_s: f64,
    /// Rounds that the times are of.
    pub rounds: usize,
    /// What the plan does.
    pub passes: Vec<String>,
    /// Each round's times.
    #[serde(skip)]
    pub times: Times,
}

impl Row {
    fn empty(case: &str, [width, height]: [u32; 2]) -> Self {
        Self {
            case: case.to_owned(),
            preset: "default",
            width,
            height,
            ms_per_frame_p50: f64::NAN,
            ms_per_frame_p99: f64::NAN,
            cpu_ms_per_frame: None,
            coord_rms_px: None,
            coord_p99_px: None,
            coord_max_px: None,
            psnr_db: None,
            predicted_px: None,
            knob: String::new(),
            family: Family::Tolerance,
            group: "",
            time_to_default: None,
            edge_psnr_db: None,
            smooth_rms_px: None,
            smooth_p99_px: None,
            edge_share: None,
            compared: [0, 0],
            falsely_valid: 0,
            missing: 0,
            coord_front: false,
            image_front: false,
            start_s: 0.0,
            rounds: 0,
            passes: Vec::new(),
            times: Times::default(),
        }
    }

    fn set_times(&mut self, times: &Times, default: Option<&Times>) {
        [self.ms_per_frame_p50, self.ms_per_frame_p99] = times.p50_p99_ms();
        self.cpu_ms_per_frame = times.processor_p50_ms();
        self.time_to_default = default.map(|default| times.ratio_to(default));
        self.start_s = times.start_s;
        self.rounds = times.wall_ms.len();
        self.times = times.clone();
    }

    fn set_errors(&mut self, errors: Errors) {
        if let Some(coords) = errors.coords {
            self.coord_rms_px = Some(coords.all.rms_px);
            self.coord_p99_px = Some(coords.all.p99_px);
            self.coord_max_px = Some(coords.all.max_px);
            self.smooth_rms_px = Some(coords.smooth.rms_px);
            self.smooth_p99_px = Some(coords.smooth.p99_px);
            self.edge_share = Some(coords.silhouettes.count as f64 / coords.all.count.max(1) as f64);
            (self.falsely_valid, self.missing) = (coords.falsely_valid, coords.missing);
            self.compared[0] = coords.all.count;
        }
        self.psnr_db = errors.psnr_db;
        self.edge_psnr_db = errors.edge_psnr_db;
        self.compared[1] = errors.pictured;
        self.predicted_px = errors.predicted_px;
        self.passes = errors.passes;
    }
}

/// A row that this version cannot render.
#[derive(Clone, Debug, Serialize)]
pub struct Refused {
    /// The case.
    pub case: String,
    /// The row.
    pub knob: String,
    /// Why.
    pub reason: String,
}

/// Everything that was measured.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// camsim's version.
    pub version: &'static str,
    /// The adapter.
    pub adapter: String,
    /// Processor threads of this machine.
    pub cpu_threads: usize,
    /// Whether this is the short form.
    pub quick: bool,
    /// The table.
    pub rows: Vec<Row>,
    /// The whole camera without its effects.
    pub ablation: Vec<AblationRow>,
    /// Rows chosen by the plan that a faster row of the same case beats.
    pub violations: Vec<Violation>,
    /// Rows that this version cannot render.
    pub refused: Vec<Refused>,
    /// What each case shows.
    pub about: BTreeMap<String, &'static str>,
    /// How long it took, seconds.
    pub elapsed_s: f64,
}

/// Measures; `progress` hears about each case.
///
/// # Errors
/// An unknown case, or whatever the renderer meets.
pub fn run(engine: &Engine, options: &Options, progress: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let begin = Instant::now();
    let chosen = choose(cases()?, options)?;
    let mut report = Report {
        version: env!("CARGO_PKG_VERSION"),
        adapter: engine.gpu().adapter.to_string(),
        cpu_threads: std::thread::available_parallelism().map_or(1, usize::from),
        quick: options.quick,
        rows: Vec::new(),
        ablation: Vec::new(),
        violations: Vec::new(),
        refused: Vec::new(),
        about: chosen.iter().map(|case| (case.name.to_owned(), case.about)).collect(),
        elapsed_s: 0.0,
    };
    let effort = effort(options.quick);
    for (i, case) in chosen.iter().enumerate() {
        let (variants, refused) = usable(case, options.quick);
        progress(&format!("{} of {}: {}, {} rows", i + 1, chosen.len(), case.name, variants.len()));
        report.refused.extend(refused);
        report.rows.extend(measure_case(engine, case, variants, effort)?);
        if case.name == ABLATED && !options.quick {
            progress("each effect left out");
            report.ablation = ablation::measure(engine, &case.sequence, effort)?;
        }
    }
    pareto::mark_fronts(&mut report.rows);
    report.violations = pareto::violations(&report.rows);
    report.elapsed_s = begin.elapsed().as_secs_f64();
    Ok(report)
}

fn effort(quick: bool) -> Effort {
    use std::time::Duration;
    match quick {
        true => Effort { burst: 2, min_rounds: 3, max_rounds: 5, budget: Duration::from_secs(4) },
        false => Effort { burst: 2, min_rounds: 3, max_rounds: 15, budget: Duration::from_secs(12) },
    }
}

/// The cases asked for, in their order; in the short form small, and if none is named a few.
fn choose(all: Vec<Case>, options: &Options) -> Result<Vec<Case>, BenchError> {
    for name in &options.cases {
        if !all.iter().any(|case| case.name == name || case.group.name() == name) {
            let known = all.iter().map(|case| case.name).collect::<Vec<_>>().join(", ");
            return Err(BenchError::NoSuchCase { name: name.clone(), known });
        }
    }
    let named = |case: &Case| options.cases.iter().any(|name| case.name == name || case.group.name() == name);
    let wanted = |case: &Case| match options.cases.is_empty() {
        true => !options.quick || QUICK.contains(&case.name),
        false => named(case),
    };
    let mut chosen: Vec<Case> = all.into_iter().filter(wanted).collect();
    if options.quick {
        for case in &mut chosen {
            let mut sequence = (*case.sequence).clone();
            knobs::resize(&mut sequence.scenario, QUICK_PX);
            case.sequence = Arc::new(sequence);
        }
    }
    Ok(chosen)
}

/// The rows that this version renders, and the others with the reason.
fn usable(case: &Case, quick: bool) -> (Vec<Variant>, Vec<Refused>) {
    let (mut usable, mut refused) = (Vec::new(), Vec::new());
    for variant in variants(case, quick) {
        // The log, the scene and the vignette are in memory and not in the scenario.
        let problem = validate(&variant.sequence.scenario).into_iter().find(|problem| problem.key.starts_with("quality"));
        match problem {
            None => usable.push(variant),
            Some(problem) => refused.push(Refused { case: case.name.into(), knob: variant.knob, reason: problem.to_string() }),
        }
    }
    (usable, refused)
}

fn measure_case(engine: &Engine, case: &Case, variants: Vec<Variant>, effort: Effort) -> Result<Vec<Row>, BenchError> {
    let timed: Vec<_> = variants.iter().map(|variant| (variant.sequence.clone(), false)).collect();
    let times = rounds::measure(engine, &timed, effort)?;
    let default = variants.iter().position(|variant| variant.knob == DEFAULT).map(|i| times[i].clone());
    let mut truths: Vec<([u32; 2], Truth)> = Vec::new();
    let mut rows = Vec::new();
    for (variant, times) in variants.iter().zip(&times) {
        let scenario = &variant.sequence.scenario;
        let size_px = scenario.camera.size_px;
        let truth = match truths.iter().position(|(size, _)| *size == size_px) {
            Some(i) => &truths[i].1,
            None => {
                truths.push((size_px, Truth::new(&of_truth(&variant.sequence))?));
                &truths[truths.len() - 1].1
            }
        };
        let mut row = Row::empty(case.name, size_px);
        row.knob = variant.knob.clone();
        row.family = variant.family;
        row.group = case.group.name();
        row.preset = if scenario.quality.preset == Preset::Paper { "paper" } else { "default" };
        row.set_times(times, default.as_ref());
        row.set_errors(truth.errors(engine, &variant.sequence)?);
        rows.push(row);
    }
    Ok(rows)
}

/// The sequence without anything that concerns how it is rendered.
fn of_truth(sequence: &Arc<Sequence>) -> Arc<Sequence> {
    let mut sequence = (**sequence).clone();
    sequence.scenario.quality = Default::default();
    Arc::new(sequence)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(case: &str, group: &'static str, knob: &str, ms: f64, rms_px: f64) -> Row {
        let times = Times { wall_ms: vec![ms; 3], ..Times::default() };
        let mut row = Row { knob: knob.into(), group, coord_rms_px: Some(rms_px), ..Row::empty(case, [640, 480]) };
        row.set_times(&times, Some(&times));
        row
    }

    fn report() -> Report {
        Report {
            version: "0",
            adapter: "an adapter".into(),
            cpu_threads: 2,
            quick: false,
            rows: vec![
                row("plane-30", "smooth", DEFAULT, 10.0, 0.01),
                row("plane-30", "smooth", "rk2", 8.0, 0.1),
                row("blender-plane", "all effects", DEFAULT, 12.0, 0.02),
            ],
            ablation: vec![
                AblationRow { without: "nothing".into(), ms_per_frame_p50: 20.0, cpu_ms_per_frame: None, to_full_ms: Some([0.0; 3]) },
                AblationRow { without: "lens".into(), ms_per_frame_p50: 25.0, cpu_ms_per_frame: None, to_full_ms: Some([4.0, 5.0, 6.0]) },
            ],
            violations: Vec::new(),
            refused: Vec::new(),
            about: BTreeMap::from([("plane-30".to_owned(), "a plane"), ("blender-plane".to_owned(), "another")]),
            elapsed_s: 1.0,
        }
    }

    #[test]
    fn the_stable_keys_of_a_row_are_there() {
        let json = serde_json::to_value(report()).expect("JSON");
        assert!(json["adapter"].is_string() && json["version"].is_string());
        let keys = [
            "case",
            "preset",
            "width",
            "height",
            "ms_per_frame_p50",
            "ms_per_frame_p99",
            "cpu_ms_per_frame",
            "coord_rms_px",
            "coord_p99_px",
            "coord_max_px",
            "psnr_db",
            "predicted_px",
        ];
        for row in json["rows"].as_array().expect("rows") {
            for key in keys {
                assert!(row.get(key).is_some(), "{key} in {row}");
            }
            assert!(row["psnr_db"].is_null(), "what was not measured is null");
        }
    }

    #[test]
    fn tables_have_every_row_and_say_what_was_not_kept() {
        let report = report();
        let text = report.markdown();
        for line in text.lines().filter(|line| line.starts_with('|')) {
            assert!(line.ends_with('|'), "{line}");
        }
        let table: Vec<&str> = text.lines().skip_while(|line| !line.starts_with("### plane-30")).skip(4).take(4).collect();
        assert!(table.iter().all(|line| line.matches('|').count() == table[0].matches('|').count()), "{table:#?}");
        assert!(text.contains("| Blender Cycles, two cores | 8900 |"), "{text}");
        // A frame without its lens takes longer: the promise is not kept, and the table says so.
        assert!(text.contains("| a frame takes less time without an effect | more without lens | no |"), "{text}");
        assert_eq!(report.csv().lines().count(), 1 + report.rows.len());
        let svg = report.plot().expect("a plot");
        assert!(svg.contains("smooth") && svg.contains("all effects"));
    }

    #[test]
    fn cases_are_chosen_by_name_and_by_group() {
        let names = |list: &[&str], quick: bool| {
            let options = Options { cases: list.iter().map(|name| (*name).to_owned()).collect(), quick };
            choose(cases().expect("cases"), &options).map(|cases| cases.iter().map(|case| case.name).collect::<Vec<_>>())
        };
        assert_eq!(names(&["lens-s3", "vibration"], false).expect("cases"), ["vibration-100", "vibration-200", "lens-s3"]);
        assert_eq!(names(&[], true).expect("cases"), QUICK);
        let unknown = names(&["lens-s4"], false).expect_err("no such case").to_string();
        assert!(unknown.contains("lens-s4") && unknown.contains("lens-s3"), "{unknown}");
    }
}
