//! The report as Markdown, CSV and plot.

use std::fmt::Write as _;

use super::{
    BenchError, Report, Row,
    knobs::{DEFAULT, FINE, WHOLE},
};
use crate::{
    cases::Group,
    plot::{Plot, Series},
    timing::quantile,
};

/// Blender Cycles on two cores, the plane of 640x480 with 33 ms readout and 8 ms exposure: seconds a frame,
/// dB. Measured once, outside of camsim.
const CYCLES: [(f64, f64); 3] = [(0.6, 42.0), (2.3, 48.0), (8.9, 54.0)];
/// The case that they stand beside.
const CYCLES_CASE: &str = "blender-plane";

impl Report {
    /// The tables, as docs/results/bench-*.md has them.
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
            self.case(text, rows)?;
        }
        if !self.ablation.is_empty() {
            self.ablation(text)?;
        }
        self.checks(text)?;
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

    fn case(&self, text: &mut String, rows: &[Row]) -> std::fmt::Result {
        let Some(first) = rows.first() else { return Ok(()) };
        let about = self.about.get(&first.case).copied().unwrap_or_default();
        writeln!(text, "\n### {}: {about}\n", first.case)?;
        let [coords, picture] = first.compared;
        let rendered = rows.iter().filter(|row| row.same_as.is_none());
        let rounds =
            rendered.clone().map(|row| row.rounds).min().zip(rendered.clone().map(|row| row.rounds).max());
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
        match first.edge_share.filter(|share| *share > 0.0) {
            Some(share) => {
                writeln!(text, ", {:.1} % of the frame within 3 px of a silhouette.\n", 100.0 * share)?
            }
            None => writeln!(text, ".\n")?,
        }
        writeln!(
            text,
            "| method | ms per frame | p99 | CPU ms | to default | RMS px | p99 px | max px | away from silhouettes p99 px | predicted px | PSNR dB | at silhouettes dB | front |"
        )?;
        writeln!(text, "|---|---|---|---|---|---|---|---|---|---|---|---|---|")?;
        for row in rendered {
            let alike = rows
                .iter()
                .filter(|other| other.same_as.as_ref() == Some(&row.knob))
                .map(|other| other.knob.as_str());
            let names = [row.knob.as_str()].into_iter().chain(alike).collect::<Vec<_>>().join("; ");
            let front = match (row.coord_front, row.image_front) {
                (true, true) => "both",
                (true, false) => "coordinates",
                (false, true) => "picture",
                _ => "",
            };
            writeln!(
                text,
                "| {names} | {:.1} | {:.1} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {front} |",
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
            )?;
        }
        for (seconds, db) in CYCLES.iter().filter(|_| first.case == CYCLES_CASE && !self.quick) {
            writeln!(
                text,
                "| Blender Cycles, two cores | {:.0} | | | | | | | | | {db:.0} | | |",
                1e3 * seconds
            )?;
        }
        let worst = |of: fn(&Row) -> u64| rows.iter().filter(|row| of(row) > 0).max_by_key(|row| of(row));
        if let Some(row) = worst(|row| row.falsely_valid) {
            writeln!(
                text,
                "\nLargest number of falsely valid pixels: {} ({}).",
                row.falsely_valid, row.knob
            )?;
        }
        if let Some(row) = worst(|row| row.missing) {
            writeln!(text, "\nLargest number of missing pixels: {} ({}).", row.missing, row.knob)?;
        }
        Ok(())
    }

    fn ablation(&self, text: &mut String) -> std::fmt::Result {
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

    fn checks(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "\n### Choices of the planner that another method dominates\n")?;
        if self.violations.is_empty() {
            writeln!(
                text,
                "None: no other method of the same case has both a lower time (by at least 2 % in nine tenths of the rounds) and a clearly lower error."
            )?;
        }
        for violation in &self.violations {
            // What one of the two was not measured for is not compared.
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
        writeln!(text, "\n### Targets\n\n| target | measured | met |\n|---|---|---|")?;
        for promise in self.promises() {
            writeln!(
                text,
                "| {} | {} | {} |",
                promise.what,
                promise.measured,
                if promise.kept { "yes" } else { "no" }
            )?;
        }
        Ok(())
    }

    fn row(&self, case: &str, knob: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.case == case && row.knob == knob)
    }

    /// Rows of a kind of case.
    fn rows_of(&self, groups: &[Group], knob: &str) -> impl Iterator<Item = &Row> {
        let names: Vec<_> = groups.iter().map(|group| group.name()).collect();
        self.rows.iter().filter(move |row| row.knob == knob && names.contains(&row.group))
    }

    fn promises(&self) -> Vec<Promise> {
        let mut promises = Vec::new();
        let mut worst = |what: &str, limit: f64, below: bool, unit: &str, values: Vec<(&Row, f64)>| {
            let order = |a: &&(&Row, f64), b: &&(&Row, f64)| {
                if below { a.1.total_cmp(&b.1) } else { b.1.total_cmp(&a.1) }
            };
            if let Some((row, value)) = values.iter().max_by(order) {
                let kept = if below { *value <= limit } else { *value >= limit };
                promises.push(Promise {
                    what: what.into(),
                    measured: format!("{}{unit} ({})", short(*value), row.case),
                    kept,
                });
            }
        };
        let tight = "auto 0.001 px";
        let of = |groups: &[Group], knob: &str, value: &dyn Fn(&Row) -> Option<f64>| {
            self.rows_of(groups, knob).filter_map(|row| Some((row, value(row)?))).collect::<Vec<_>>()
        };
        use Group::{AllEffects, Buildings, Exposure, Lens, LongWindow, Smooth, Vibration};
        worst(
            "tolerance 0.001 px on smooth scenes: at most 0.001 px RMS",
            1e-3,
            true,
            " px",
            of(&[Smooth], tight, &|row| row.coord_rms_px),
        );
        let to_rk2 = |row: &Row| {
            let rk2 = self.row(&row.case, "rk2")?;
            Some(row.times.ratio_to(&rk2.times)[1])
        };
        worst(
            "the same at no more than 1.5 times the time of rk2",
            1.5,
            true,
            " times",
            of(&[Smooth], tight, &to_rk2),
        );
        worst(
            "tolerance 0.001 px with buildings: at most 0.05 px RMS",
            0.05,
            true,
            " px",
            of(&[Buildings], tight, &|row| row.coord_rms_px),
        );
        let every = [Smooth, Vibration, Buildings, LongWindow, Exposure, Lens, AllEffects];
        worst(
            "default: p99 away from silhouettes at most 0.05 px",
            0.05,
            true,
            " px",
            of(&every, DEFAULT, &|row| row.smooth_p99_px),
        );
        let over = |row: &Row| Some(row.smooth_p99_px? / row.predicted_px?);
        let all: Vec<_> = self.rows.iter().filter_map(|row| Some((row, over(row)?))).collect();
        worst("measured p99 over the predicted bound: at most 1", 1.0, true, "", all);
        let of_whole = |knob: &str, value: &dyn Fn(&Row) -> Option<f64>| {
            let rows = self.rows_of(&[AllEffects], knob).filter(|row| row.case == WHOLE);
            rows.filter_map(|row| Some((row, value(row)?))).collect::<Vec<_>>()
        };
        worst("all effects: at least 45 dB", 45.0, false, " dB", of_whole(DEFAULT, &|row| row.psnr_db));
        worst(
            "all effects, a tolerance of 0.7/255: at least 50 dB",
            50.0,
            false,
            " dB",
            of_whole(FINE, &|row| row.psnr_db),
        );
        for (what, knob) in
            [("", DEFAULT), (", rays and a tolerance of 0.5/255", "silhouettes: rays, 0.5/255")]
        {
            worst(
                &format!("all effects: at least 40 dB within 3 px of silhouettes{what}"),
                40.0,
                false,
                " dB",
                of_whole(knob, &|row| row.edge_psnr_db),
            );
        }
        self.ablation_promises(&mut promises);
        promises
    }

    fn ablation_promises(&self, promises: &mut Vec<Promise>) {
        let Some((full, rest)) = self.ablation.split_first() else { return };
        let single = &rest[..rest.len().min(super::ablation::EFFECTS.len())];
        // The lower quartile, so that noise about zero does not count as time lost.
        let full_ms = full.alike_ms_per_frame_p50.unwrap_or_default();
        let dearer: Vec<_> = single
            .iter()
            .filter(|row| row.alike_to_full_ms.is_some_and(|[low, ..]| low > 0.02 * full_ms))
            .collect();
        let names = dearer.iter().map(|row| row.without.as_str()).collect::<Vec<_>>().join(", ");
        let measured =
            if dearer.is_empty() { "each does".to_owned() } else { format!("more without {names}") };
        promises.push(Promise {
            what: "sampled alike, a frame takes no more time without an effect".into(),
            measured,
            kept: dearer.is_empty(),
        });
    }

    /// The rows as comma-separated values, one line each after a header.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from(
            "case,preset,width,height,ms_per_frame_p50,ms_per_frame_p99,cpu_ms_per_frame,coord_rms_px,coord_p99_px,coord_max_px,psnr_db,predicted_px,knob,same_as,group,edge_psnr_db,smooth_rms_px,smooth_p99_px,edge_share,falsely_valid,missing,coord_front,image_front,rounds\n",
        );
        let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.6e}"));
        for row in &self.rows {
            let cells = [
                row.case.clone(),
                row.preset.to_owned(),
                row.width.to_string(),
                row.height.to_string(),
                number(Some(row.ms_per_frame_p50)),
                number(Some(row.ms_per_frame_p99)),
                number(row.cpu_ms_per_frame),
                number(row.coord_rms_px),
                number(row.coord_p99_px),
                number(row.coord_max_px),
                number(row.psnr_db),
                number(row.predicted_px),
                format!("\"{}\"", row.knob),
                row.same_as.as_ref().map_or(String::new(), |knob| format!("\"{knob}\"")),
                row.group.to_owned(),
                number(row.edge_psnr_db),
                number(row.smooth_rms_px),
                number(row.smooth_p99_px),
                number(row.edge_share),
                row.falsely_valid.to_string(),
                row.missing.to_string(),
                row.coord_front.to_string(),
                row.image_front.to_string(),
                row.rounds.to_string(),
            ];
            text.push_str(&cells.join(","));
            text.push('\n');
        }
        text
    }

    /// RMS of the source coordinates against time, both logarithmic. A point is a method's geometric mean
    /// over the cases of one kind; for each kind of case a curve joins the methods of which each is more
    /// exact than all that take less time; the others and the paper's preset stand alone. (Whether a row is
    /// beaten, by more than rounds differ, the table tells.)
    ///
    /// # Errors
    /// Nothing was measured.
    pub fn plot(&self) -> Result<String, BenchError> {
        let mut series = Vec::new();
        let (mut beaten, mut paper) = (Vec::new(), Vec::new());
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
                let of_knob: Vec<(f64, f64)> = rows
                    .iter()
                    .filter(|row| row.knob == knob)
                    .filter_map(|row| Some((row.ms_per_frame_p50, row.coord_rms_px?)))
                    .collect();
                // Means over different sets of cases would not be comparable.
                if of_knob.len() == cases {
                    let mean = |value: fn(&(f64, f64)) -> f64| {
                        (of_knob.iter().map(|p| value(p).max(1e-9).ln()).sum::<f64>() / cases as f64).exp()
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
            beaten.extend(rest);
            series.push(Series { name: group.to_owned(), points: front, joined: true });
        }
        series.push(Series { name: "not on a curve".to_owned(), points: beaten, joined: false });
        series.push(Series { name: "paper preset".to_owned(), points: paper, joined: false });
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

    /// A few lines about the whole.
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

/// Something that camsim promises, and what this run says about it.
struct Promise {
    what: String,
    measured: String,
    kept: bool,
}

fn decimal(value: Option<f64>) -> String {
    value.map_or("-".into(), |value| format!("{value:.1}"))
}

/// Two digits, whatever the size.
fn short(value: f64) -> String {
    match value.abs() {
        size if size >= 10.0 => format!("{value:.1}"),
        size if size >= 0.01 || size == 0.0 => format!("{value:.3}"),
        _ => format!("{value:.1e}"),
    }
}

fn pixels(value: Option<f64>) -> String {
    value.map_or("-".into(), short)
}
