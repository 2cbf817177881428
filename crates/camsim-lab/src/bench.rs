//! Run time against error: every case with every method, in one table (`camsim bench`).
//!
//! Time is that of frames rendered and read back, measured in interleaved rounds ([`rounds`]). Errors are
//! against the reference renderer ([`truth`]): source error in pixels of the ideal frame, and picture error
//! as PSNR of linear values with peak 1.

use std::{collections::BTreeMap, convert::Infallible, sync::Arc, time::Instant};

use camsim_core::{mount::MountError, reference::ReferenceError, validate::validate};
use camsim_engine::{Engine, GpuError, RenderError};
use serde::Serialize;

use crate::{
    cases::{Case, CaseError, FRAMES, cases},
    plot::PlotError,
};

pub mod ablation;
mod case_rows;
mod confirmation;
mod frame_copy;
pub mod methods;
mod pareto;
pub mod rounds;
mod row;
mod table;
mod targets;
pub mod truth;

pub use ablation::AblationRow;
pub use pareto::Violation;
pub use row::{Refused, Row};

use methods::{ALL_EFFECTS_CASE, Method, methods};
use rounds::RoundLimits;

/// Cases of the short form.
const QUICK: [&str; 4] = ["plane-30", "terrain-100", "buildings-15", "blender-plane"];
/// Frame size of the short form.
const QUICK_PX: [u32; 2] = [320, 240];

/// Why a benchmark failed.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A case that cannot be made.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A mount that cannot be used.
    #[error(transparent)]
    Mount(#[from] MountError),
    /// Rendering failed.
    #[error(transparent)]
    Render(#[from] RenderError<Infallible>),
    /// The adapter failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The reference renderer cannot use the camera or shutter.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The plot failed.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// No case or group has this name.
    #[error("there is no case or group \"{name}\"; cases are {cases}; groups are {groups}")]
    NoSuchCase {
        /// The name.
        name: String,
        /// Names of all cases.
        cases: String,
        /// Names of all groups.
        groups: String,
    },
}

/// Another renderer that is timed in the same rounds.
#[derive(Clone, Copy, Debug)]
pub struct Compared<'a> {
    /// Name of its column.
    pub name: &'static str,
    /// The renderer; `None` if this machine has none, which the column then says.
    pub engine: Option<&'a Engine>,
}

/// What to measure.
#[derive(Clone, Debug, Default)]
pub struct Options<'a> {
    /// Names of cases or groups; all if empty.
    pub cases: Vec<String>,
    /// Few cases, small frames, few rounds.
    pub quick: bool,
    /// Renderers to time beside the main one.
    pub compared: &'a [Compared<'a>],
}

/// Results of a benchmark.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BenchReport {
    /// camsim's version.
    pub version: &'static str,
    /// The renderer.
    pub adapter: String,
    /// Names of the renderers that were timed beside it.
    #[serde(skip)]
    pub compared: Vec<&'static str>,
    /// Processor threads of this machine.
    pub cpu_threads: usize,
    /// Whether this is the short form.
    pub quick: bool,
    /// Numbers of cases measured so far and of cases to measure.
    pub cases: [usize; 2],
    /// The table.
    pub rows: Vec<Row>,
    /// The case with every effect, without some of its effects.
    pub ablation: Vec<AblationRow>,
    /// Choices of the planner that another method of the same case dominates.
    pub violations: Vec<Violation>,
    /// Methods that this version cannot render.
    pub refused: Vec<Refused>,
    /// Description of each case.
    pub about: BTreeMap<String, &'static str>,
    /// Time since the begin, seconds.
    pub elapsed_s: f64,
}

/// Progress of a run.
#[derive(Debug)]
pub enum Step<'a> {
    /// A case or table begins.
    Begins(&'a str),
    /// The report has one case more.
    Done(&'a BenchReport),
}

/// Measures all cases. `progress` is called before and after each case; its error ends the run.
///
/// # Errors
/// An unknown case, any error of rendering, or that of `progress`.
pub fn run<E: From<BenchError>>(
    engine: &Engine,
    options: &Options<'_>,
    progress: &mut dyn FnMut(Step<'_>) -> Result<(), E>,
) -> Result<BenchReport, E> {
    let begin = Instant::now();
    let chosen = choose(cases().map_err(BenchError::from)?, options)?;
    let mut report = BenchReport {
        version: env!("CARGO_PKG_VERSION"),
        adapter: engine.to_string(),
        compared: options.compared.iter().map(|compared| compared.name).collect(),
        cpu_threads: std::thread::available_parallelism().map_or(1, usize::from),
        quick: options.quick,
        cases: [0, chosen.len()],
        about: chosen.iter().map(|case| (case.name.to_owned(), case.about)).collect(),
        ..BenchReport::default()
    };
    let limits = round_limits(options.quick);
    let total_cost =
        |case: &Case, methods: &[Method]| methods.iter().map(|method| cost(case, method)).sum::<f64>();
    let prepared: Vec<_> = chosen.iter().map(|case| (case, usable_methods(case, options.quick))).collect();
    let mut left: f64 = prepared.iter().map(|(case, (methods, _))| total_cost(case, methods)).sum();
    let mut done = 0.0;
    for (case, (methods, refused)) in prepared {
        let time_left = match report.cases[0] {
            0 => String::new(),
            _ => format!(", about {} left", minutes(begin.elapsed().as_secs_f64() * left / done)),
        };
        let number = report.cases[0] + 1;
        progress(Step::Begins(&format!(
            "{number} of {}: {}, {} rows{time_left}",
            report.cases[1],
            case.name,
            methods.len()
        )))?;
        report.refused.extend(refused);
        let mut rows = case_rows::rows(engine, options.compared, case, &methods, limits)?;
        pareto::mark_fronts(&mut rows);
        let suspected = pareto::violations(&rows);
        report.violations.extend(confirmation::confirmed(engine, &methods, suspected, limits)?);
        report.rows.extend(rows);
        if case.name == ALL_EFFECTS_CASE && !options.quick {
            progress(Step::Begins("without each effect"))?;
            report.ablation = ablation::measure(engine, &case.sequence, limits)?;
        }
        report.cases[0] = number;
        report.elapsed_s = begin.elapsed().as_secs_f64();
        progress(Step::Done(&report))?;
        done += total_cost(case, &methods);
        left -= total_cost(case, &methods);
    }
    Ok(report)
}

fn round_limits(quick: bool) -> RoundLimits {
    use std::time::Duration;
    match quick {
        true => RoundLimits { burst: FRAMES, min_rounds: 3, max_rounds: 5, budget: Duration::from_secs(4) },
        false => RoundLimits { burst: FRAMES, min_rounds: 3, max_rounds: 15, budget: Duration::from_secs(6) },
    }
}

/// Relative run time of a row, roughly: for the estimate of the time left.
fn cost(case: &Case, method: &Method) -> f64 {
    let camera = &method.sequence.scenario.camera;
    let megapixels = camera.size_px.iter().map(|&side| f64::from(side)).product::<f64>() / 1e6;
    let house_factor = if case.has_houses() { 3.0 } else { 1.0 };
    let blur_factor = if camera.shutter.exposure_ms > 0.0 { 2.0 } else { 1.0 };
    megapixels * house_factor * blur_factor
}

fn minutes(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    format!("{}:{:02} min", seconds / 60, seconds % 60)
}

/// The cases to measure, in their order. The short form has smaller frames, and only [`QUICK`] if no case is
/// named.
fn choose(all: Vec<Case>, options: &Options<'_>) -> Result<Vec<Case>, BenchError> {
    for name in &options.cases {
        if !all.iter().any(|case| case.name == name || case.group.name() == name) {
            let cases = all.iter().map(|case| case.name).collect::<Vec<_>>().join(", ");
            let mut groups: Vec<&str> = all.iter().map(|case| case.group.name()).collect();
            // Cases of a group are neighbours.
            groups.dedup();
            return Err(BenchError::NoSuchCase { name: name.clone(), cases, groups: groups.join(", ") });
        }
    }
    let is_named =
        |case: &Case| options.cases.iter().any(|name| case.name == name || case.group.name() == name);
    let is_wanted = |case: &Case| match options.cases.is_empty() {
        true => !options.quick || QUICK.contains(&case.name),
        false => is_named(case),
    };
    let mut chosen: Vec<Case> = all.into_iter().filter(is_wanted).collect();
    if options.quick {
        for case in &mut chosen {
            let mut sequence = (*case.sequence).clone();
            methods::resize(&mut sequence.scenario, QUICK_PX);
            case.sequence = Arc::new(sequence);
        }
    }
    Ok(chosen)
}

/// The methods that this version renders, and the refused ones with the reason.
fn usable_methods(case: &Case, quick: bool) -> (Vec<Method>, Vec<Refused>) {
    let (mut usable, mut refused) = (Vec::new(), Vec::new());
    for method in methods(case, quick) {
        // Log, scene and vignette are in memory, so keys other than `quality` are not valid.
        let problem = validate(&method.sequence.scenario)
            .into_iter()
            .find(|problem| problem.key.starts_with("quality"));
        match problem {
            None => usable.push(method),
            Some(problem) => refused.push(Refused {
                case: case.name.into(),
                knob: method.name,
                reason: problem.to_string(),
            }),
        }
    }
    (usable, refused)
}

#[cfg(test)]
mod tests {
    use super::*;
    use methods::DEFAULT_METHOD;
    use rounds::Times;

    fn row(case: &str, group: &'static str, knob: &str, ms: f64, rms_px: f64) -> Row {
        let times = Times { wall_ms: vec![ms; 3], ..Times::default() };
        let mut row =
            Row { knob: knob.into(), group, coord_rms_px: Some(rms_px), ..Row::empty(case, [640, 480]) };
        row.set_times(&times, Some(&times));
        row
    }

    fn ablation_row(without: &str, ms: f64, to_full_ms: [f64; 3]) -> AblationRow {
        AblationRow {
            without: without.into(),
            ms_per_frame_p50: 1.5 * ms,
            cpu_ms_per_frame: None,
            to_full_ms: Some([0.0; 3]),
            alike_ms_per_frame_p50: Some(ms),
            alike_cpu_ms_per_frame: None,
            alike_to_full_ms: Some(to_full_ms),
        }
    }

    fn report() -> BenchReport {
        BenchReport {
            version: "0",
            adapter: "an adapter".into(),
            compared: vec!["gpu"],
            cpu_threads: 2,
            quick: false,
            cases: [2, 2],
            rows: vec![
                row("plane-30", "smooth", DEFAULT_METHOD, 10.0, 0.01),
                row("plane-30", "smooth", "rk2", 8.0, 0.1),
                row("blender-plane", "all effects", DEFAULT_METHOD, 12.0, 0.02),
            ],
            ablation: vec![
                ablation_row("nothing", 20.0, [0.0; 3]),
                ablation_row("lens", 25.0, [4.0, 5.0, 6.0]),
            ],
            violations: Vec::new(),
            refused: Vec::new(),
            about: BTreeMap::from([
                ("plane-30".to_owned(), "a plane"),
                ("blender-plane".to_owned(), "another"),
            ]),
            elapsed_s: 1.0,
        }
    }

    #[test]
    fn json_has_the_stable_keys_of_a_row() {
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
            assert!(row["psnr_db"].is_null(), "null if not measured");
        }
    }

    #[test]
    fn tables_have_every_row_and_name_missed_targets() {
        let report = report();
        let text = report.markdown();
        for line in text.lines().filter(|line| line.starts_with('|')) {
            assert!(line.ends_with('|'), "{line}");
        }
        let table: Vec<&str> =
            text.lines().skip_while(|line| !line.starts_with("### plane-30")).skip(4).take(4).collect();
        assert!(
            table.iter().all(|line| line.matches('|').count() == table[0].matches('|').count()),
            "{table:#?}"
        );
        assert!(text.contains("| Blender Cycles, two cores | 8900 |"), "{text}");
        // A frame without its lens takes longer, so the target is missed.
        assert!(
            text.contains(
                "| sampled alike, a frame takes no more time without an effect | more without lens | no |"
            ),
            "{text}"
        );
        assert_eq!(report.csv().lines().count(), 1 + report.rows.len());
        let svg = report.plot().expect("a plot");
        assert!(svg.contains("smooth") && svg.contains("all effects"));
    }

    #[test]
    fn cases_are_chosen_by_name_and_by_group() {
        let all = cases().expect("cases");
        let names = |list: &[&str], quick: bool| {
            let cases = list.iter().map(|name| (*name).to_owned()).collect();
            let options = Options { cases, quick, compared: &[] };
            choose(all.clone(), &options).map(|cases| cases.iter().map(|case| case.name).collect::<Vec<_>>())
        };
        assert_eq!(
            names(&["lens-s3", "vibration"], false).expect("cases"),
            ["vibration-100", "vibration-200", "lens-s3"]
        );
        assert_eq!(names(&[], true).expect("cases"), QUICK);
        let unknown = names(&["lens-s4"], false).expect_err("no such case").to_string();
        assert!(unknown.contains("lens-s4") && unknown.contains("lens-s3"), "{unknown}");
        let (_, groups) = unknown.split_once("groups are ").expect("groups");
        assert!(
            groups.split(", ").all(|group| names(&[group], false).is_ok_and(|cases| !cases.is_empty())),
            "{groups}"
        );
        assert!(
            ["smooth", "lenses", "vibration", "all effects"].iter().all(|name| groups
                .split(", ")
                .filter(|group| group == name)
                .count()
                == 1),
            "{groups}"
        );
    }
}
