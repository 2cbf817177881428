//! A benchmark report as Markdown, CSV and plot.

use std::fmt::Write as _;

use super::{BenchError, BenchReport, Row};
use crate::{
    plot::{Plot, Series},
    timing::quantile,
};

/// Blender Cycles on two cores in the case [`CYCLES_CASE`], measured outside of camsim: seconds per frame,
/// PSNR in dB.
const CYCLES: [(f64, f64); 3] = [(0.6, 42.0), (2.3, 48.0), (8.9, 54.0)];
/// The case with rows of Blender Cycles.
const CYCLES_CASE: &str = "blender-plane";

/// A column of the comma-separated values: its name, and its cell of a row.
type Column = (&'static str, fn(&Row) -> String);

const COLUMNS: [Column; 24] = [
    ("case", |row| row.case.clone()),
    ("preset", |row| row.preset.to_owned()),
    ("width", |row| row.width.to_string()),
    ("height", |row| row.height.to_string()),
    ("ms_per_frame_p50", |row| number(Some(row.ms_per_frame_p50))),
    ("ms_per_frame_p99", |row| number(Some(row.ms_per_frame_p99))),
    ("cpu_ms_per_frame", |row| number(row.cpu_ms_per_frame)),
    ("coord_rms_px", |row| number(row.coord_rms_px)),
    ("coord_p99_px", |row| number(row.coord_p99_px)),
    ("coord_max_px", |row| number(row.coord_max_px)),
    ("psnr_db", |row| number(row.psnr_db)),
    ("predicted_px", |row| number(row.predicted_px)),
    ("knob", |row| format!("\"{}\"", row.knob)),
    ("same_as", |row| row.same_as.as_ref().map_or(String::new(), |knob| format!("\"{knob}\""))),
    ("group", |row| row.group.to_owned()),
    ("edge_psnr_db", |row| number(row.edge_psnr_db)),
    ("smooth_rms_px", |row| number(row.smooth_rms_px)),
    ("smooth_p99_px", |row| number(row.smooth_p99_px)),
    ("edge_fraction", |row| number(row.edge_fraction)),
    ("falsely_valid", |row| row.falsely_valid.to_string()),
    ("missing", |row| row.missing.to_string()),
    ("coord_front", |row| row.coord_front.to_string()),
    ("image_front", |row| row.image_front.to_string()),
    ("rounds", |row| row.rounds.to_string()),
];

impl BenchReport {
    /// The tables as Markdown.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = String::new();
        self.write_markdown(&mut text).unwrap_or_default();
        text
    }

    fn write_markdown(&self, text: &mut String) -> std::fmt::Result {
        writeln!(
            text,
            "camsim {}, {}, {} CPU threads. `camsim bench{}`, {:.0} s.",
            self.version,
            self.adapter,
            self.cpu_threads,
            if self.quick { " --quick" } else { "" },
            self.elapsed_s
        )?;
        if self.cases[0] < self.cases[1] {
            writeln!(text, "\nIncomplete: {} of {} cases.", self.cases[0], self.cases[1])?;
        }
        for rows in self.rows.chunk_by(|a, b| a.case == b.case) {
            self.write_case(text, rows)?;
        }
        if !self.ablation.is_empty() {
            self.write_ablation(text)?;
        }
        self.write_violations(text)?;
        self.write_targets(text)?;
        if !self.refused.is_empty() {
            writeln!(text, "\nNot rendered by this version:\n")?;
            let mut reasons: Vec<(&str, &str)> =
                self.refused.iter().map(|refused| (refused.knob.as_str(), refused.reason.as_str())).collect();
            reasons.sort_unstable();
            reasons.dedup();
            for (knob, reason) in reasons {
                writeln!(text, "- {knob}: {reason}")?;
            }
        }
        Ok(())
    }

    fn write_case(&self, text: &mut String, rows: &[Row]) -> std::fmt::Result {
        let Some(first) = rows.first() else { return Ok(()) };
        let about = self.about.get(&first.case).copied().unwrap_or_default();
        writeln!(text, "\n### {}: {about}\n", first.case)?;
        let [coords, picture] = first.compared;
        let rendered = rows.iter().filter(|row| row.same_as.is_none());
        let rounds = rendered.clone().map(|row| row.rounds);
        let rounds = rounds.clone().min().zip(rounds.max());
        write!(
            text,
            "{}x{}, {} rounds; errors over {coords} coordinates and {picture} pixels of the picture",
            first.width,
            first.height,
            rounds.map_or(String::new(), |(least, most)| if least == most {
                most.to_string()
            } else {
                format!("{least} to {most}")
            }),
        )?;
        match first.edge_fraction.filter(|fraction| *fraction > 0.0) {
            Some(fraction) => {
                writeln!(text, ", {:.1} % of the frame within 3 px of a silhouette.\n", 100.0 * fraction)?
            }
            None => writeln!(text, ".\n")?,
        }
        let compared: String = self.compared.iter().map(|name| format!(" {name}, ms per frame |")).collect();
        writeln!(
            text,
            "| method | ms per frame |{compared} p99 | CPU ms | to default | RMS px | p99 px | max px | away \
             from silhouettes p99 px | predicted px | PSNR dB | at silhouettes dB | front |"
        )?;
        writeln!(text, "|{}", "---|".repeat(13 + self.compared.len()))?;
        for row in rendered {
            self.write_row(text, rows, row)?;
        }
        let no_renderers = " |".repeat(self.compared.len());
        for (seconds, db) in CYCLES.iter().filter(|_| first.case == CYCLES_CASE && !self.quick) {
            writeln!(
                text,
                "| Blender Cycles, two cores | {:.0} |{no_renderers} | | | | | | | | {db:.0} | | |",
                1e3 * seconds
            )?;
        }
        let largest =
            |count: fn(&Row) -> u64| rows.iter().filter(|row| count(row) > 0).max_by_key(|row| count(row));
        if let Some(row) = largest(|row| row.falsely_valid) {
            writeln!(
                text,
                "\nLargest number of falsely valid pixels: {} ({}).",
                row.falsely_valid, row.knob
            )?;
        }
        if let Some(row) = largest(|row| row.missing) {
            writeln!(text, "\nLargest number of missing pixels: {} ({}).", row.missing, row.knob)?;
        }
        Ok(())
    }

    /// One row of a case; the methods with the same plans are named in it.
    fn write_row(&self, text: &mut String, rows: &[Row], row: &Row) -> std::fmt::Result {
        let same_plans = rows
            .iter()
            .filter(|other| other.same_as.as_ref() == Some(&row.knob))
            .map(|other| other.knob.as_str());
        let names = [row.knob.as_str()].into_iter().chain(same_plans).collect::<Vec<_>>().join("; ");
        let front = match (row.coord_front, row.image_front) {
            (true, true) => "both",
            (true, false) => "coordinates",
            (false, true) => "picture",
            _ => "",
        };
        let compared: String = (0..self.compared.len())
            .map(|k| match row.compared_ms.get(k).copied().flatten() {
                Some(ms) => format!(" {ms:.1} |"),
                None => " no adapter |".to_owned(),
            })
            .collect();
        writeln!(
            text,
            "| {names} | {:.1} |{compared} {:.1} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {front} |",
            row.ms_per_frame_p50,
            row.ms_per_frame_p99,
            decimal(row.cpu_ms_per_frame),
            row.time_to_default.map_or("-".into(), |[_, median, _]| format!("{median:.2}")),
            pixels(row.coord_rms_px),
            pixels(row.coord_p99_px),
            pixels(row.coord_max_px),
            pixels(row.smooth_p99_px),
            pixels(row.predicted_px),
            decimal(row.psnr_db),
            decimal(row.edge_psnr_db),
        )
    }

    fn write_ablation(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "\n### Cost of each effect (case all-effects)\n")?;
        let columns = "ms per frame | difference to the full camera, ms (quartiles) | CPU ms";
        writeln!(text, "| without | {columns} | sampled alike, {columns} |")?;
        writeln!(text, "|---|---|---|---|---|---|---|")?;
        let difference = |quartiles: Option<[f64; 3]>| {
            quartiles
                .map_or("-".into(), |[low, median, high]| format!("{median:+.1} ({low:+.1} .. {high:+.1})"))
        };
        for row in &self.ablation {
            writeln!(
                text,
                "| {} | {:.1} | {} | {} | {} | {} | {} |",
                row.without,
                row.ms_per_frame_p50,
                difference(row.to_full_ms),
                decimal(row.cpu_ms_per_frame),
                decimal(row.alike_ms_per_frame_p50),
                difference(row.alike_to_full_ms),
                decimal(row.alike_cpu_ms_per_frame),
            )?;
        }
        Ok(())
    }

    fn write_violations(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "\n### Choices of the planner that another method dominates\n")?;
        if self.violations.is_empty() {
            writeln!(
                text,
                "None: no other method of the same case has both a lower time (by at least 2 % in nine \
                 tenths of the rounds) and a clearly lower error."
            )?;
        }
        for violation in &self.violations {
            // Only figures that both rows have.
            let against = |what: &str, [own, better]: [Option<f64>; 2], text: fn(Option<f64>) -> String| {
                (own.is_some() && better.is_some())
                    .then(|| format!("{} against {} {what}", text(own), text(better)))
            };
            let compared = [
                against("px RMS", violation.coord_rms_px, pixels),
                against("px away from silhouettes (99 %)", violation.smooth_p99_px, pixels),
                against("dB", violation.psnr_db, decimal),
            ];
            writeln!(
                text,
                "- {}: {} takes {:.2} times the time of {}, with {}",
                violation.case,
                violation.row,
                violation.time_ratio,
                violation.better,
                compared.into_iter().flatten().collect::<Vec<_>>().join(", "),
            )?;
        }
        Ok(())
    }

    fn write_targets(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "\n### Targets\n\n| target | measured | met |\n|---|---|---|")?;
        for target in self.targets() {
            let met = if target.is_met { "yes" } else { "no" };
            writeln!(text, "| {} | {} | {met} |", target.text, target.measured)?;
        }
        Ok(())
    }

    /// The rows as comma-separated values, one line each after a header.
    #[must_use]
    pub fn csv(&self) -> String {
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        let header = line(COLUMNS.iter().map(|(name, _)| (*name).to_owned()).collect());
        let of_row = |row: &Row| line(COLUMNS.iter().map(|(_, cell)| cell(row)).collect());
        header + &self.rows.iter().map(of_row).collect::<String>()
    }

    /// Plots RMS source error over time, both logarithmic. A point is the geometric mean of a method over the
    /// cases of a group. For each group a curve joins the Pareto front; other methods and the paper's preset
    /// are single points.
    ///
    /// # Errors
    /// There is nothing to plot.
    pub fn plot(&self) -> Result<String, BenchError> {
        let mut series = Vec::new();
        let (mut dominated, mut paper) = (Vec::new(), Vec::new());
        let mut groups: Vec<&str> = self.rows.iter().map(|row| row.group).collect();
        groups.dedup();
        for group in groups {
            let rows: Vec<&Row> = self.rows.iter().filter(|row| row.group == group).collect();
            let cases = rows.chunk_by(|a, b| a.case == b.case).count();
            let mut knobs: Vec<&str> = Vec::new();
            for row in &rows {
                if !knobs.contains(&row.knob.as_str()) {
                    knobs.push(&row.knob);
                }
            }
            let mut points = Vec::new();
            for knob in knobs {
                let by_case: Vec<(f64, f64)> = rows
                    .iter()
                    .filter(|row| row.knob == knob)
                    .filter_map(|row| Some((row.ms_per_frame_p50, row.coord_rms_px?)))
                    .collect();
                // Means over different sets of cases are not comparable.
                if by_case.len() == cases {
                    let mean = |value: fn(&(f64, f64)) -> f64| {
                        (by_case.iter().map(|p| value(p).max(1e-9).ln()).sum::<f64>() / cases as f64).exp()
                    };
                    let point = (mean(|p| p.0), mean(|p| p.1));
                    if knob == "paper" { paper.push(point) } else { points.push(point) }
                }
            }
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            // Methods with the same plans are one point.
            points.dedup();
            let mut least = f64::INFINITY;
            let (front, rest): (Vec<_>, Vec<_>) = points.into_iter().partition(|&(_, rms_px)| {
                let better = rms_px < least;
                least = least.min(rms_px);
                better
            });
            dominated.extend(rest);
            series.push(Series::line(group, front));
        }
        series.push(Series::dots("not on a curve", dominated));
        series.push(Series::dots("paper preset", paper));
        let plot = Plot {
            title: format!(
                "Error against time, camsim {}, {}",
                self.version,
                self.adapter.split(" (").next().unwrap_or_default()
            ),
            x_label: "ms per frame (median)".into(),
            y_label: "RMS source error, px (geometric mean over the cases of a group)".into(),
            log: [true, true],
            series,
        };
        Ok(plot.svg()?)
    }

    /// One line about the whole run.
    #[must_use]
    pub fn summary(&self) -> String {
        let starts: Vec<f64> = self.rows.iter().map(|row| row.start_s).collect();
        format!(
            "{} rows of {} cases in {:.0} s; opening a session takes {:.1} s (median); {} rows are dominated",
            self.rows.len(),
            self.cases[0],
            self.elapsed_s,
            quantile(&starts, 0.5),
            self.violations.len()
        )
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| format!("{value:.6e}"))
}

fn decimal(value: Option<f64>) -> String {
    value.map_or("-".into(), |value| format!("{value:.1}"))
}

/// A number with few digits.
pub(super) fn short(value: f64) -> String {
    match value.abs() {
        size if size >= 10.0 => format!("{value:.1}"),
        size if size >= 0.01 || size == 0.0 => format!("{value:.3}"),
        _ => format!("{value:.1e}"),
    }
}

fn pixels(value: Option<f64>) -> String {
    value.map_or("-".into(), short)
}
