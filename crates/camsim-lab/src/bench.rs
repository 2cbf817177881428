//! Run time against error: every case with every method, in one table (`camsim bench`).
//!
//! Time is that of frames rendered and read back, measured in interleaved rounds ([`rounds`]). Error is
//! measured against the oracle ([`truth`]): of the source coordinates in pixels of the ideal frame, and of
//! the picture in decibels on linear values with peak 1.

use std::{collections::BTreeMap, convert::Infallible, sync::Arc, time::Instant};

use camsim_core::{mount::MountError, reference::OracleError, scenario::validate};
use camsim_engine::{Engine, GpuError, RenderError};
use serde::Serialize;

use crate::{
    cases::{Case, CaseError, FRAMES, cases},
    plot::PlotError,
};

pub mod ablation;
mod blit;
mod confirm;
pub mod knobs;
mod measure;
mod pareto;
pub mod rounds;
mod row;
mod table;
pub mod truth;

pub use ablation::AblationRow;
pub use pareto::Violation;
pub use row::{Refused, Row};

use knobs::{Variant, WHOLE, variants};
use rounds::Effort;

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
    #[error("there is no case or group \"{name}\"; cases are {cases}; groups are {groups}")]
    NoSuchCase {
        /// What was asked for.
        name: String,
        /// The cases there are.
        cases: String,
        /// The groups there are.
        groups: String,
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
    /// Cases measured, and all that were asked for: fewer while the run goes on, and if it was interrupted.
    pub cases: [usize; 2],
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

/// How far a run is.
#[derive(Debug)]
pub enum Step<'a> {
    /// Something begins.
    Begins(&'a str),
    /// A case is in the report.
    Done(&'a Report),
}

/// Measures; `watch` hears about each case before and after, and ends the run by an error of its own.
///
/// # Errors
/// An unknown case, or whatever the renderer or `watch` meets.
pub fn run<E: From<BenchError>>(
    engine: &Engine,
    options: &Options,
    watch: &mut dyn FnMut(Step<'_>) -> Result<(), E>,
) -> Result<Report, E> {
    let begin = Instant::now();
    let chosen = choose(cases().map_err(BenchError::from)?, options)?;
    let mut report = Report {
        version: env!("CARGO_PKG_VERSION"),
        adapter: engine.to_string(),
        cpu_threads: std::thread::available_parallelism().map_or(1, usize::from),
        quick: options.quick,
        cases: [0, chosen.len()],
        rows: Vec::new(),
        ablation: Vec::new(),
        violations: Vec::new(),
        refused: Vec::new(),
        about: chosen.iter().map(|case| (case.name.to_owned(), case.about)).collect(),
        elapsed_s: 0.0,
    };
    let effort = effort(options.quick);
    let work =
        |case: &Case, variants: &[Variant]| variants.iter().map(|variant| cost(case, variant)).sum::<f64>();
    let prepared: Vec<_> = chosen.iter().map(|case| (case, usable(case, options.quick))).collect();
    let (mut left, mut done) =
        (prepared.iter().map(|(case, (variants, _))| work(case, variants)).sum::<f64>(), 0.0);
    for (case, (variants, refused)) in prepared {
        let rest = match report.cases[0] {
            0 => String::new(),
            _ => format!(", about {} left", minutes(begin.elapsed().as_secs_f64() * left / done)),
        };
        let place = report.cases[0] + 1;
        watch(Step::Begins(&format!(
            "{place} of {}: {}, {} rows{rest}",
            report.cases[1],
            case.name,
            variants.len()
        )))?;
        report.refused.extend(refused);
        let mut rows = measure::case(engine, case, &variants, effort)?;
        pareto::mark_fronts(&mut rows);
        report.violations.extend(confirm::confirmed(engine, &variants, pareto::violations(&rows), effort)?);
        report.rows.extend(rows);
        if case.name == WHOLE && !options.quick {
            watch(Step::Begins("each effect left out"))?;
            report.ablation = ablation::measure(engine, &case.sequence, effort)?;
        }
        report.cases[0] = place;
        report.elapsed_s = begin.elapsed().as_secs_f64();
        watch(Step::Done(&report))?;
        done += work(case, &variants);
        left -= work(case, &variants);
    }
    Ok(report)
}

fn effort(quick: bool) -> Effort {
    use std::time::Duration;
    match quick {
        true => Effort { burst: FRAMES, min_rounds: 3, max_rounds: 5, budget: Duration::from_secs(4) },
        false => Effort { burst: FRAMES, min_rounds: 3, max_rounds: 15, budget: Duration::from_secs(6) },
    }
}

/// How long a row takes compared with others, roughly: for the time that is left.
fn cost(case: &Case, variant: &Variant) -> f64 {
    let camera = &variant.sequence.scenario.camera;
    let megapixels = camera.size_px.iter().map(|&side| f64::from(side)).product::<f64>() / 1e6;
    let of_houses = if case.has_houses() { 3.0 } else { 1.0 };
    let of_blur = if camera.shutter.exposure_ms > 0.0 { 2.0 } else { 1.0 };
    megapixels * of_houses * of_blur
}

fn minutes(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    format!("{}:{:02} min", seconds / 60, seconds % 60)
}

/// The cases asked for, in their order; in the short form small, and if none is named a few.
fn choose(all: Vec<Case>, options: &Options) -> Result<Vec<Case>, BenchError> {
    for name in &options.cases {
        if !all.iter().any(|case| case.name == name || case.group.name() == name) {
            let cases = all.iter().map(|case| case.name).collect::<Vec<_>>().join(", ");
            let mut groups: Vec<&str> = all.iter().map(|case| case.group.name()).collect();
            // Cases of a group stand together.
            groups.dedup();
            return Err(BenchError::NoSuchCase { name: name.clone(), cases, groups: groups.join(", ") });
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
        let problem = validate(&variant.sequence.scenario)
            .into_iter()
            .find(|problem| problem.key.starts_with("quality"));
        match problem {
            None => usable.push(variant),
            Some(problem) => refused.push(Refused {
                case: case.name.into(),
                knob: variant.knob,
                reason: problem.to_string(),
            }),
        }
    }
    (usable, refused)
}

#[cfg(test)]
mod tests {
    use super::*;
    use knobs::DEFAULT;
    use rounds::Times;

    fn row(case: &str, group: &'static str, knob: &str, ms: f64, rms_px: f64) -> Row {
        let times = Times { wall_ms: vec![ms; 3], ..Times::default() };
        let mut row =
            Row { knob: knob.into(), group, coord_rms_px: Some(rms_px), ..Row::empty(case, [640, 480]) };
        row.set_times(&times, Some(&times));
        row
    }

    fn left_out(without: &str, ms: f64, to_full_ms: [f64; 3]) -> AblationRow {
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

    fn report() -> Report {
        Report {
            version: "0",
            adapter: "an adapter".into(),
            cpu_threads: 2,
            quick: false,
            cases: [2, 2],
            rows: vec![
                row("plane-30", "smooth", DEFAULT, 10.0, 0.01),
                row("plane-30", "smooth", "rk2", 8.0, 0.1),
                row("blender-plane", "all effects", DEFAULT, 12.0, 0.02),
            ],
            ablation: vec![left_out("nothing", 20.0, [0.0; 3]), left_out("lens", 25.0, [4.0, 5.0, 6.0])],
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
        let table: Vec<&str> =
            text.lines().skip_while(|line| !line.starts_with("### plane-30")).skip(4).take(4).collect();
        assert!(
            table.iter().all(|line| line.matches('|').count() == table[0].matches('|').count()),
            "{table:#?}"
        );
        assert!(text.contains("| Blender Cycles, two cores | 8900 |"), "{text}");
        // A frame without its lens takes longer: the promise is not kept, and the table says so.
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
            let options = Options { cases: list.iter().map(|name| (*name).to_owned()).collect(), quick };
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
