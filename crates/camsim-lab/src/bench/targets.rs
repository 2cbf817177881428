//! Targets for run time and error, and whether a report meets them.

use super::{
    BenchReport, Row, ablation,
    methods::{ALL_EFFECTS_CASE, DEFAULT_METHOD, FINE_METHOD},
    table::short,
};
use crate::cases::Group;

/// A target and the measured value.
pub(super) struct Target {
    /// The target in words.
    pub text: String,
    /// The worst measured value and its case.
    pub measured: String,
    /// Whether the value meets the target.
    pub is_met: bool,
}

/// A limit of a target.
#[derive(Clone, Copy)]
enum Limit {
    AtMost(f64),
    AtLeast(f64),
}

impl Target {
    /// The target for the worst of `values`; `None` without values.
    fn worst(text: impl Into<String>, limit: Limit, unit: &str, values: Vec<(&Row, f64)>) -> Option<Self> {
        let worst = values.iter().max_by(|a, b| match limit {
            Limit::AtMost(_) => a.1.total_cmp(&b.1),
            Limit::AtLeast(_) => b.1.total_cmp(&a.1),
        });
        worst.map(|(row, value)| Self {
            text: text.into(),
            measured: format!("{}{unit} ({})", short(*value), row.case),
            is_met: match limit {
                Limit::AtMost(limit) => *value <= limit,
                Limit::AtLeast(limit) => *value >= limit,
            },
        })
    }
}

impl BenchReport {
    /// All targets that the report has values for.
    pub(super) fn targets(&self) -> Vec<Target> {
        self.source_error_targets()
            .into_iter()
            .chain(self.picture_error_targets())
            .flatten()
            .chain(self.ablation_target())
            .collect()
    }

    fn source_error_targets(&self) -> [Option<Target>; 5] {
        use Group::{AllEffects, Buildings, Exposure, Lens, LongWindow, Smooth, Vibration};
        let tight = "auto 0.001 px";
        let values = |groups: &[Group], method: &str, value: &dyn Fn(&Row) -> Option<f64>| {
            self.rows_of(groups, method).filter_map(|row| Some((row, value(row)?))).collect::<Vec<_>>()
        };
        let ratio_to_rk2 = |row: &Row| {
            let rk2 = self.row(&row.case, "rk2")?;
            Some(row.times.ratio_quartiles(&rk2.times)[1])
        };
        let every = [Smooth, Vibration, Buildings, LongWindow, Exposure, Lens, AllEffects];
        let measured_over_predicted = |row: &Row| Some(row.smooth_p99_px? / row.predicted_px?);
        let all: Vec<_> =
            self.rows.iter().filter_map(|row| Some((row, measured_over_predicted(row)?))).collect();
        [
            Target::worst(
                "tolerance 0.001 px on smooth scenes: at most 0.001 px RMS",
                Limit::AtMost(1e-3),
                " px",
                values(&[Smooth], tight, &|row| row.coord_rms_px),
            ),
            Target::worst(
                "the same at no more than 1.5 times the time of rk2",
                Limit::AtMost(1.5),
                " times",
                values(&[Smooth], tight, &ratio_to_rk2),
            ),
            Target::worst(
                "tolerance 0.001 px with buildings: at most 0.05 px RMS",
                Limit::AtMost(0.05),
                " px",
                values(&[Buildings], tight, &|row| row.coord_rms_px),
            ),
            Target::worst(
                "default: p99 away from silhouettes at most 0.05 px",
                Limit::AtMost(0.05),
                " px",
                values(&every, DEFAULT_METHOD, &|row| row.smooth_p99_px),
            ),
            Target::worst("measured p99 over the predicted bound: at most 1", Limit::AtMost(1.0), "", all),
        ]
    }

    fn picture_error_targets(&self) -> [Option<Target>; 4] {
        let values = |method: &str, value: &dyn Fn(&Row) -> Option<f64>| {
            let rows = self.rows_of(&[Group::AllEffects], method).filter(|row| row.case == ALL_EFFECTS_CASE);
            rows.filter_map(|row| Some((row, value(row)?))).collect::<Vec<_>>()
        };
        let at_silhouettes = |quality: &str, method: &str| {
            Target::worst(
                format!("all effects: at least 40 dB within 3 px of silhouettes{quality}"),
                Limit::AtLeast(40.0),
                " dB",
                values(method, &|row| row.edge_psnr_db),
            )
        };
        [
            Target::worst(
                "all effects: at least 45 dB",
                Limit::AtLeast(45.0),
                " dB",
                values(DEFAULT_METHOD, &|row| row.psnr_db),
            ),
            Target::worst(
                "all effects, a tolerance of 0.7/255: at least 50 dB",
                Limit::AtLeast(50.0),
                " dB",
                values(FINE_METHOD, &|row| row.psnr_db),
            ),
            at_silhouettes("", DEFAULT_METHOD),
            at_silhouettes(", rays and a tolerance of 0.5/255", "silhouettes: rays, 0.5/255"),
        ]
    }

    fn ablation_target(&self) -> Option<Target> {
        let (full, rest) = self.ablation.split_first()?;
        let single_effects = &rest[..rest.len().min(ablation::EFFECTS.len())];
        // The lower quartile, so that noise about zero does not count as lost time.
        let full_ms = full.alike_ms_per_frame_p50.unwrap_or_default();
        let slower: Vec<&str> = single_effects
            .iter()
            .filter(|row| row.alike_to_full_ms.is_some_and(|[low, ..]| low > 0.02 * full_ms))
            .map(|row| row.without.as_str())
            .collect();
        Some(Target {
            text: "sampled alike, a frame takes no more time without an effect".into(),
            measured: match slower.is_empty() {
                true => "true for every effect".to_owned(),
                false => format!("more without {}", slower.join(", ")),
            },
            is_met: slower.is_empty(),
        })
    }

    fn row(&self, case: &str, method: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.case == case && row.knob == method)
    }

    /// Rows of a method in the cases of some groups.
    fn rows_of(&self, groups: &[Group], method: &str) -> impl Iterator<Item = &Row> {
        let names: Vec<_> = groups.iter().map(|group| group.name()).collect();
        self.rows.iter().filter(move |row| row.knob == method && names.contains(&row.group))
    }
}
