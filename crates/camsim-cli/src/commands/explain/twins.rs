//! Plans of the twins of a frame.

use std::sync::Arc;

use camsim_core::sequence::Sequence;
use camsim_plan::{FramePlan, Placement, PlanSummary, Planner};
use serde::Serialize;

use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// A twin with the plan of its picture; of a burst, the plan of a picture at the centre.
pub(super) struct TwinPlan {
    name: String,
    what: String,
    pictures: u32,
    plan: FramePlan,
}

/// A twin in the JSON report.
#[derive(Serialize)]
pub(super) struct TwinReport<'a> {
    name: &'a str,
    /// How it differs from the frame.
    differs: &'a str,
    /// Pictures of each frame.
    pictures: u32,
    plan: PlanSummary<'a>,
    placement: Placement,
}

impl TwinPlan {
    pub(super) fn report(&self) -> TwinReport<'_> {
        TwinReport {
            name: &self.name,
            differs: &self.what,
            pictures: self.pictures,
            plan: self.plan.summary(),
            placement: self.plan.placement,
        }
    }
}

/// Plans of all twins of a frame.
pub(super) fn plans(sequence: &Sequence, planner: &Planner, frame: u64) -> Result<Vec<TwinPlan>, Failure> {
    let plan = |twin| {
        let sequence = Arc::new(sequence.twin(twin, None).or_bad_input()?);
        let channels = sequence.scenario.output.channels.clone();
        let plan =
            planner.renewed(sequence, &channels).and_then(|planner| planner.plan(frame)).or_bad_input()?;
        let pictures = twin.instants.unwrap_or(1);
        Ok(TwinPlan { name: twin.name.clone(), what: twin.describe(), pictures, plan })
    };
    sequence.scenario.output.twin.iter().map(plan).collect()
}

/// Prints the twins in short.
pub(super) fn print(twins: &[TwinPlan], console: &mut Console<'_>) -> Result<(), Failure> {
    if !twins.is_empty() {
        console.line("twins, each in a folder with its name")?;
    }
    for TwinPlan { name, what, plan, .. } in twins {
        console.line(format_args!("  {name}: {what}"))?;
        let is_main = |pass: &String| pass.starts_with("ideal: ") || pass.starts_with("reverse: ");
        for pass in plan.passes().into_iter().filter(is_main) {
            console.line(format_args!("    {pass}"))?;
        }
    }
    Ok(())
}
