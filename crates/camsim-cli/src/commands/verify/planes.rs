//! Errors of the channels that a scenario asks for, of one frame.

use std::convert::Infallible;

use camsim_core::{
    reference::{
        CoverageErrors, FLOW_TOLERANCE_PX, FlowErrors, FlowStats, Oracle, coverage_errors, flow_errors,
        is_compared, is_flow, plane_errors,
    },
    scenario::Channel,
};
use camsim_engine::Session;
use serde::Serialize;

use super::{MEASURED, render_at_phase, report::PlaneTruth};
use crate::failure::Failure;

/// Pixels of a frame in which flows, and in which coverage, are compared, at most: the reference renderer needs
/// about 0.1 and 0.5 ms for each.
const FLOW_PIXELS: usize = 20_000;
const COVERAGE_PIXELS: usize = 4_000;

/// Errors of all channels of a frame.
#[derive(Serialize)]
pub struct Planes {
    pub planes: Vec<PlaneTruth>,
    pub flows: Vec<FlowTruth>,
    pub coverage: Option<CoverageTruth>,
}

/// Errors of a flow, of motion or of a blur path.
#[derive(Serialize)]
pub struct FlowTruth {
    pub channel: &'static str,
    /// Whether every value is that of a surface near the pixel's ray.
    pub kept: bool,
    /// Valid pixels of the frame.
    pub of_pixels: u64,
    /// Pixels farther than 1 px from other objects, the sky and steps of depth.
    pub away: FlowFigures,
    /// The others.
    pub near: FlowFigures,
    /// Pixels by the state of the reference renderer (row) and of the frame (column); all 0 for motion and blur
    /// path.
    pub states: [[u64; 5]; 5],
    /// Number of wrong values.
    pub beyond: u64,
    /// Number of those that belong to no surface near the pixel's ray.
    pub faults: u64,
}

/// Errors in pixels, of motion in pixels a second; `null` for values that are no numbers.
#[derive(Serialize)]
pub struct FlowFigures {
    pub pixels: u64,
    pub p50: Option<f64>,
    pub p99: Option<f64>,
    pub max: Option<f64>,
    pub looked_at: u64,
    pub wrong_states: u64,
}

/// Errors of coverages.
#[derive(Serialize)]
pub struct CoverageTruth {
    /// Whether objects that no pixel beside shows explain all large differences.
    pub kept: bool,
    pub pixels: u64,
    pub rms: f64,
    pub max: Option<f64>,
    pub faults: u64,
}

impl Planes {
    pub fn kept(&self) -> bool {
        self.planes.iter().all(|plane| plane.kept)
            && self.flows.iter().all(|flow| flow.kept)
            && self.coverage.as_ref().is_none_or(|coverage| coverage.kept)
    }
}

impl From<FlowStats> for FlowFigures {
    fn from(stats: FlowStats) -> Self {
        let finite = |error: f64| error.is_finite().then_some(error);
        Self {
            pixels: stats.pixels,
            p50: finite(stats.p50),
            p99: finite(stats.p99),
            max: finite(stats.max),
            looked_at: stats.looked_at,
            wrong_states: stats.wrong_states,
        }
    }
}

impl From<FlowErrors> for FlowTruth {
    fn from(errors: FlowErrors) -> Self {
        let FlowErrors { channel, of_pixels, away, near, states, beyond, faults } = errors;
        let channel = channel.name();
        let kept = faults == 0;
        Self { channel, kept, of_pixels, away: away.into(), near: near.into(), states, beyond, faults }
    }
}

impl From<CoverageErrors> for CoverageTruth {
    fn from(errors: CoverageErrors) -> Self {
        let CoverageErrors { pixels, rms, max, faults } = errors;
        Self { kept: faults == 0, pixels, rms, max: max.is_finite().then_some(max), faults }
    }
}

/// Errors of the channels that the scenario asks for. They are rendered by themselves: depths and coordinates
/// beside them are those of rays, and would hide the errors of the sources.
pub fn planes(
    frame: u64,
    session: &mut Session<'_>,
    oracle: &Oracle,
    tolerance_px: f64,
) -> Result<Planes, Failure> {
    let sequence = session.scene_planner().sequence().clone();
    let is_measured =
        |channel: &Channel| is_compared(*channel) || is_flow(*channel) || *channel == Channel::Coverage;
    let asked: Vec<Channel> = sequence.scenario.output.channels.iter().copied().filter(is_measured).collect();
    if asked.is_empty() {
        return Ok(Planes { planes: Vec::new(), flows: Vec::new(), coverage: None });
    }
    session.renew::<Infallible>(sequence.clone(), &[&MEASURED[..], &asked].concat())?;
    let done = render_at_phase(session, frame, 0.0)?;
    session.renew::<Infallible>(sequence, &MEASURED)?;
    let number = done.plan.frame;
    let planes = plane_errors(oracle, number, &done.frame, tolerance_px);
    let flows = flow_errors(oracle, number, &done.frame, tolerance_px, FLOW_PIXELS);
    Ok(Planes {
        planes: planes.into_iter().map(PlaneTruth::from).collect(),
        flows: flows.into_iter().map(FlowTruth::from).collect(),
        coverage: coverage_errors(oracle, number, &done.frame, COVERAGE_PIXELS).map(CoverageTruth::from),
    })
}

/// The lines about flows and coverage.
pub fn describe(planes: &Planes) -> Vec<String> {
    let mut lines: Vec<String> = planes.flows.iter().flat_map(describe_flow).collect();
    lines.extend(planes.coverage.as_ref().map(|CoverageTruth { kept, pixels, rms, max, faults }| {
        format!(
            "coverage against 256 rays in {pixels} pixels: {rms:.4} RMS, {} at most, {faults} faults: {}",
            figure(*max),
            verdict(*kept)
        )
    }));
    lines
}

fn describe_flow(flow: &FlowTruth) -> Vec<String> {
    let FlowTruth { channel, kept, of_pixels, away, near, states, beyond, faults } = flow;
    let unit = if *channel == "motion" { "px/s" } else { "px" };
    let figures = |of: &FlowFigures| {
        format!("p50 {}, p99 {}, max {} {unit}", figure(of.p50), figure(of.p99), figure(of.max))
    };
    let allowed = match *channel {
        "motion" => "0.1 % and 0.05 px/s".to_owned(),
        _ => format!("{FLOW_TOLERANCE_PX} px"),
    };
    let mut lines = vec![format!(
        "{channel}: away from borders {}, within 1 px of them {}; in {} of {of_pixels} pixels; {beyond} off by \
         more than {allowed} or in state, {faults} of them faults, which no surface near the pixel's ray has: {}",
        figures(away),
        figures(near),
        away.looked_at + near.looked_at,
        verdict(*kept)
    )];
    if states.iter().flatten().any(|&count| count > 0) {
        let wrong = |of: &FlowFigures| format!("{} of {}", of.wrong_states, of.looked_at);
        let rows: Vec<String> = states
            .iter()
            .enumerate()
            .filter(|(_, row)| row.iter().any(|&count| count > 0))
            .map(|(state, row)| format!("{state} -> {}", row.map(|count| count.to_string()).join(" ")))
            .collect();
        lines.push(format!(
            "{channel}, wrong states: {} away from borders, {} within 1 px of them; true state -> pixels found in \
             states 0 1 2 3 4: {}",
            wrong(away),
            wrong(near),
            rows.join(", ")
        ));
    }
    lines
}

fn figure(value: Option<f64>) -> String {
    value.map_or_else(|| "not a number".to_owned(), |value| format!("{value:.1e}"))
}

fn verdict(kept: bool) -> &'static str {
    if kept { "kept" } else { "FAULTS" }
}
