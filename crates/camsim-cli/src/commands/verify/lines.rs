//! The lines about a frame's truth and channels.

use camsim_core::{
    reference::{
        CoverageErrors, DEPTH_TOLERANCE, FLOW_TOLERANCE_PX, FlowErrors, FlowStats, MOTION_TOLERANCE,
        NORMAL_TOLERANCE_RAD, TruthErrors,
    },
    scenario::{ChannelFacts, Check},
};
use camsim_engine::verify::{FlowReport, FrameReport, Kept, PlaneReport};

pub fn describe_truth(Kept { kept, errors }: &Kept<TruthErrors>) -> String {
    let TruthErrors { pixels, depth_beyond, depth_faults, depth_max, points_beyond, point_faults, point_max } =
        errors;
    let largest = |error: f64| match error.is_finite() {
        true => format!("{:.3} %", 100.0 * error),
        false => "sky instead of surface".to_owned(),
    };
    let percent = 100.0 * DEPTH_TOLERANCE;
    format!(
        "off by more than {percent} % of the depth, of {pixels} pixels: {depth_beyond} depths (largest error \
         {}), {points_beyond} points (largest {}); faults, which lie on no surface near the pixel's ray: \
         {depth_faults} depths, {point_faults} points: {}",
        largest(*depth_max),
        largest(*point_max),
        passed(*kept)
    )
}

/// The lines about the channels that the scenario asks for.
pub fn channel_lines(frame: &FrameReport) -> impl Iterator<Item = String> {
    let planes = frame.planes.iter().map(describe_plane);
    planes
        .chain(frame.flows.iter().flat_map(describe_flow))
        .chain(frame.coverage.iter().map(describe_coverage))
}

/// Percent.
fn fraction(part: u64, of: u64) -> f64 {
    100.0 * part as f64 / of.max(1) as f64
}

fn describe_plane(plane: &PlaneReport) -> String {
    let PlaneReport { channel, kept, pixels, pixels_away, beyond, beyond_away, faults, max, .. } = plane;
    let check = channel.facts().check;
    let largest = match (check, max) {
        (Check::Exact, _) => String::new(),
        (_, None) => " (largest error: sky instead of surface)".to_owned(),
        (Check::Direction, Some(max)) => format!(" (largest error {max:.3} deg)"),
        (_, Some(max)) => format!(" (largest error {:.3} %)", 100.0 * max),
    };
    let allowed = match check {
        Check::Exact => "wrong".to_owned(),
        Check::Direction => format!("off by more than {:.1} deg", NORMAL_TOLERANCE_RAD.to_degrees()),
        _ => format!("off by more than {} %", 100.0 * DEPTH_TOLERANCE),
    };
    format!(
        "{} {allowed}: {beyond} of {pixels} pixels{largest}; {beyond_away} of {pixels_away} away from \
         borders of objects ({:.4} %), {} of {} within 1 px of them ({:.2} %); {faults} faults, \
         which no surface near the pixel's ray has: {}",
        channel.name(),
        fraction(*beyond_away, *pixels_away),
        beyond - beyond_away,
        pixels - pixels_away,
        fraction(beyond - beyond_away, pixels - pixels_away),
        passed(*kept)
    )
}

fn describe_flow(FlowReport { channel, kept, errors }: &FlowReport) -> Vec<String> {
    let FlowErrors { of_pixels, away, near, states, beyond, faults, .. } = errors;
    let name = channel.name();
    let ChannelFacts { unit, check, .. } = channel.facts();
    let allowed = match check {
        Check::Velocity => {
            let (fraction, px_s) = MOTION_TOLERANCE;
            format!("{} % and {px_s} px/s", 100.0 * fraction)
        }
        _ => format!("{FLOW_TOLERANCE_PX} px"),
    };
    let figures = |of: &FlowStats| {
        format!("p50 {}, p99 {}, max {} {unit}", figure(of.p50), figure(of.p99), figure(of.max))
    };
    let mut lines = vec![format!(
        "{name}: away from borders {}, within 1 px of them {}; in {} of {of_pixels} pixels; {beyond} off by \
         more than {allowed} or in state, {faults} of them faults, which no surface near the pixel's ray has: {}",
        figures(away),
        figures(near),
        away.looked_at + near.looked_at,
        verdict(*kept)
    )];
    if states.iter().flatten().any(|&count| count > 0) {
        let wrong = |of: &FlowStats| format!("{} of {}", of.wrong_states, of.looked_at);
        let rows: Vec<String> = states
            .iter()
            .enumerate()
            .filter(|(_, row)| row.iter().any(|&count| count > 0))
            .map(|(state, row)| format!("{state} -> {}", row.map(|count| count.to_string()).join(" ")))
            .collect();
        lines.push(format!(
            "{name}, wrong states: {} away from borders, {} within 1 px of them; true state -> pixels found in \
             states 0 1 2 3 4: {}",
            wrong(away),
            wrong(near),
            rows.join(", ")
        ));
    }
    lines
}

fn describe_coverage(Kept { kept, errors }: &Kept<CoverageErrors>) -> String {
    let CoverageErrors { pixels, rms, max, faults } = errors;
    format!(
        "coverage against 256 rays in {pixels} pixels: {rms:.4} RMS, {} at most, {faults} faults: {}",
        figure(*max),
        verdict(*kept)
    )
}

fn figure(value: f64) -> String {
    if value.is_finite() { format!("{value:.1e}") } else { "not a number".to_owned() }
}

fn verdict(kept: bool) -> &'static str {
    if kept { "kept" } else { "FAULTS" }
}

fn passed(kept: bool) -> &'static str {
    if kept { "passed" } else { "FAILED" }
}
