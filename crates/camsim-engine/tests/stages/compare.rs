//! The one body: cases by stages by implementations.

use std::cell::OnceCell;

use camsim_core::reference::ReferenceRenderer;
use camsim_plan::FramePlan;

use super::{
    cases::{Case, Output},
    checks::{CHECKS, Check, Group, Reference, Statistic, Tolerance, UNEXPOSED},
    ideal_twin::ideal_twin,
    implementations::{CaseOutput, Engines, Implementation, ideal_output},
    stage::{Difference, FrameOutput, IdealOutput, Stage, frame_differences, ideal_differences},
    twin::Twin,
};

/// A case that was compared.
#[derive(Debug)]
pub struct Done {
    pub plan: FramePlan,
    /// The output frame of the implementation that renders most cases, the general cpu.
    pub color_rgba: Vec<f32>,
}

/// A line of the table that is printed.
struct Row {
    case: String,
    check: &'static Check,
    worst: f64,
    most: f64,
    compared: usize,
}

/// Lines of the table, and what is not in it.
#[derive(Default)]
struct Table {
    rows: Vec<Row>,
    unexposed: Vec<(String, Implementation, &'static str)>,
}

/// What is compared with.
enum Compared {
    Frame(FrameOutput),
    Ideal(IdealOutput),
}

/// Compares all cases of a group as [`CHECKS`] says, prints the table and panics if a tolerance is exceeded.
pub fn run(group: Group, cases: &[Case]) -> Vec<Done> {
    let engines = Engines::new(cases[0].output);
    let software = if engines.is_software() { 0 } else { 1 };
    let mut table = Table::default();
    let done = cases.iter().map(|case| compare(group, case, &engines, software, &mut table)).collect();
    table.print(group);
    table.assert_all_within(group);
    done
}

fn compare(group: Group, case: &Case, engines: &Engines, software: usize, table: &mut Table) -> Done {
    let outputs = Implementation::ALL.map(|implementation| {
        let output = match group.asks_for(implementation) {
            true => engines.output(implementation, case),
            false => Err("no check asks for it"),
        };
        let reason = output.as_ref().err();
        table.unexposed.extend(reason.map(|reason| (case.name.clone(), implementation, *reason)));
        (implementation, output)
    });
    let output = |implementation: Implementation| outputs[implementation as usize].1.as_ref().ok();
    assert_alike(case, output(Implementation::CpuVectorised), output(Implementation::Gpu));
    let reference = OnceCell::new();
    let twin_of = |output: &CaseOutput| match case.output {
        Output::Ideal => Compared::Ideal(ideal_twin(case, &output.plan, &output.images)),
        Output::Frame | Output::FrameAndColorAlone => {
            let reference = reference
                .get_or_init(|| ReferenceRenderer::new(case.sequence.clone()).expect("a usable camera"));
            Compared::Frame(Twin::new(case, &output.plan, &output.images, reference).frame(&output.frame))
        }
    };
    let twins: [OnceCell<Compared>; 3] = Default::default();
    for check in CHECKS.iter().filter(|check| check.group == group) {
        let Some(found) = output(check.implementation) else { continue };
        let twin = || {
            // Implementations that begin with the same inputs have one twin.
            let has_same_inputs = |(_, other): &(_, Result<CaseOutput, _>)| {
                other
                    .as_ref()
                    .is_ok_and(|other| case.output == Output::Ideal || has_same_inputs(found, other))
            };
            let number = outputs.iter().position(has_same_inputs).unwrap_or(check.implementation as usize);
            twins[number].get_or_init(|| twin_of(found))
        };
        let differences = match check.reference {
            Reference::Twin => differences(case, check, found, twin()),
            Reference::Other(other) => {
                let Some(other) = output(other) else { continue };
                differences(case, check, found, &compared(case, other))
            }
            Reference::TwinBesideGpu => {
                let Some(gpu) = output(Implementation::Gpu) else { continue };
                let of_gpu = statistic(check.tolerance, &differences(case, check, gpu, twin()), software);
                let mut all = differences(case, check, found, twin());
                all.iter_mut().for_each(|difference| {
                    difference.most /= of_gpu;
                    difference.mean_square /= of_gpu * of_gpu;
                });
                all
            }
        };
        assert!(!differences.is_empty(), "{}: nothing is compared: {check:?}", case.name);
        if check.stage == Stage::Source {
            let least = group.least_sources(found.frame.pixels.len());
            assert!(differences.len() > least, "{}: {} sources", case.name, differences.len());
        }
        table.rows.push(Row {
            case: case.name.clone(),
            check,
            worst: statistic(check.tolerance, &differences, software),
            most: check.tolerance.most[software],
            compared: differences.len(),
        });
    }
    done(&outputs)
}

fn done(outputs: &[(Implementation, Result<CaseOutput, &'static str>); 3]) -> Done {
    let of_general = &outputs[Implementation::CpuGeneral as usize].1;
    let of_cpu = of_general.as_ref().or(outputs[Implementation::CpuVectorised as usize].1.as_ref());
    let CaseOutput { plan, frame, .. } = of_cpu.expect("the cpu renders everything");
    Done { plan: plan.clone(), color_rgba: frame.color_rgba.clone() }
}

/// Whether two output frames are made from the same ideal frame by the same rays.
fn has_same_inputs(a: &CaseOutput, b: &CaseOutput) -> bool {
    let rays = |output: &CaseOutput| -> Vec<_> {
        output.frame.pixels.iter().map(|pixel| pixel.and_then(|pixel| pixel.uv)).collect()
    };
    a.images == b.images && rays(a) == rays(b)
}

/// What is not a matter of tolerances: levels of detail, and that there is something to be seen.
fn assert_alike(case: &Case, cpu: Option<&CaseOutput>, gpu: Option<&CaseOutput>) {
    let (Some(cpu), Some(gpu), Output::Ideal) = (cpu, gpu, case.output) else { return };
    assert_eq!(cpu.lod, gpu.lod, "{}", case.name);
    assert_eq!(cpu.plan.samples_a_pixel, gpu.plan.samples_a_pixel, "{}", case.name);
    let depths = &gpu.images.2;
    let seen = depths.iter().filter(|&&inverse| inverse > 0.0).count() as f64 / depths.len() as f64;
    assert!(seen > 0.3, "{}: something to be seen: {seen}", case.name);
}

fn compared(case: &Case, output: &CaseOutput) -> Compared {
    match case.output {
        Output::Ideal => Compared::Ideal(ideal_output(&output.images)),
        Output::Frame | Output::FrameAndColorAlone => Compared::Frame(output.frame.clone()),
    }
}

fn differences(case: &Case, check: &Check, found: &CaseOutput, reference: &Compared) -> Vec<Difference> {
    match reference {
        Compared::Frame(reference) => {
            frame_differences(check.stage, &found.frame, reference, check.group.is_clear_of_sky())
        }
        Compared::Ideal(reference) => {
            ideal_differences(check.stage, &ideal_output(&found.images), reference, case.other_surface)
        }
    }
}

fn statistic(tolerance: &Tolerance, differences: &[Difference], software: usize) -> f64 {
    let count = differences.len() as f64;
    let rms = |squares: f64| (squares / count).sqrt();
    match tolerance.statistic {
        Statistic::Maximum => differences.iter().fold(0.0, |worst, difference| difference.most.max(worst)),
        Statistic::Percentile99 => {
            let mut all: Vec<f64> = differences.iter().map(|difference| difference.most).collect();
            all.sort_by(f64::total_cmp);
            all[all.len() * 99 / 100]
        }
        Statistic::ShareBeyond(limit) => {
            let beyond = differences.iter().filter(|difference| difference.most > limit[software]);
            beyond.count() as f64 / count
        }
        Statistic::RmsWithin(limit) => {
            let within = differences.iter().filter(|difference| difference.most <= limit[software]);
            rms(within.map(|difference| difference.mean_square).sum())
        }
        Statistic::Rms => rms(differences.iter().map(|difference| difference.mean_square).sum()),
        Statistic::RmsOfMost => rms(differences.iter().map(|difference| difference.most.powi(2)).sum()),
    }
}

impl Row {
    fn is_within(&self) -> bool {
        self.worst <= self.most
    }

    fn line(&self) -> String {
        let Check { stage, implementation, reference, tolerance, .. } = self.check;
        let reference = match reference {
            Reference::Other(other) => format!("{other:?}"),
            _ => format!("{reference:?}"),
        };
        format!(
            "{:<44} {:<13} {:<13} {reference:<13} {:>8.1e} of {:<7.1e} {} ({}, {} values)",
            self.case,
            format!("{stage:?}"),
            format!("{implementation:?}"),
            self.worst,
            self.most,
            tolerance.unit,
            tolerance.name,
            self.compared
        )
    }
}

impl Table {
    fn print(&self, group: Group) {
        eprintln!("{group:?}: case, stage, implementation, reference, worst difference of tolerance");
        self.rows.iter().for_each(|row| eprintln!("{}", row.line()));
        for (case, implementation, reason) in &self.unexposed {
            eprintln!("not compared: {case}: {implementation:?}: {reason}");
        }
        for (stage, implementation, reason) in UNEXPOSED {
            eprintln!("not compared: {stage}: {implementation}: {reason}");
        }
    }

    /// Every check has a line, unless the gpu is skipped, and no line exceeds its tolerance.
    fn assert_all_within(&self, group: Group) {
        for check in CHECKS.iter().filter(|check| check.group == group) {
            let is_there = self.rows.iter().any(|row| std::ptr::eq(row.check, check));
            assert!(is_there || cfg!(skip_gpu), "no case has {check:?}");
        }
        let excess: Vec<String> = self
            .rows
            .iter()
            .filter(|row| !row.is_within())
            .map(|row| format!("{}: {}", row.line(), row.check.tolerance.reason))
            .collect();
        assert!(excess.is_empty(), "{} of {} lines:\n{}", excess.len(), self.rows.len(), excess.join("\n"));
    }
}
