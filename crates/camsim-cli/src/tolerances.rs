//! Warnings for frames that are predicted to exceed the tolerances, or have errors that are not predicted.

use camsim_core::scenario::{Auto, Preset, QualitySpec, Solver};
use camsim_plan::FramePlan;

/// Frames that are predicted to exceed `quality.max_error_px` or `quality.max_error_dn`.
#[derive(Debug)]
pub struct Tolerances {
    px: Exceeded,
    dn: Exceeded,
    frames: u64,
}

#[derive(Debug)]
struct Exceeded {
    key: &'static str,
    unit: &'static str,
    tolerance: f64,
    frames: u64,
    /// Largest predicted error, and its frame.
    worst: Option<(f64, u64)>,
}

impl Tolerances {
    /// `None` for methods that the user chose regardless of their error, those of the paper, and for the
    /// reference renderer, which has no plan.
    pub fn new(quality: &QualitySpec) -> Option<Self> {
        let is_explicit = quality.preset == Preset::Paper
            || matches!(quality.solver, Auto::Value(Solver::Linear | Solver::Rk2 | Solver::Reference));
        let exceeded = |key, unit, tolerance| Exceeded { key, unit, tolerance, frames: 0, worst: None };
        (!is_explicit).then(|| Self {
            px: exceeded("quality.max_error_px", " px", quality.max_error_px),
            dn: exceeded("quality.max_error_dn", "/255", quality.max_error_dn),
            frames: 0,
        })
    }

    /// Adds a frame.
    pub fn add<'a>(&mut self, plans: impl Iterator<Item = &'a FramePlan>) {
        self.frames += 1;
        let (mut px, mut dn) = ((true, 0.0_f64), (true, 0.0_f64));
        let mut number = None;
        for plan in plans {
            let predicted = &plan.predicted;
            number = Some(plan.frame);
            px = (px.0 && predicted.source_error_kept, px.1.max(predicted.total_px));
            dn = (dn.0 && predicted.picture_error_kept, dn.1.max(predicted.picture_dn()));
        }
        let Some(frame) = number else { return };
        self.px.add(frame, px.0, px.1);
        self.dn.add(frame, dn.0, dn.1);
    }

    /// A warning for each tolerance that is exceeded.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        [&self.px, &self.dn].into_iter().filter_map(|exceeded| exceeded.warning(self.frames))
    }
}

impl Exceeded {
    fn add(&mut self, frame: u64, kept: bool, error: f64) {
        if kept {
            return;
        }
        self.frames += 1;
        if self.worst.is_none_or(|(worst, _)| error > worst) {
            self.worst = Some((error, frame));
        }
    }

    fn warning(&self, total: u64) -> Option<String> {
        let &Self { key, unit, tolerance, frames, worst } = self;
        let (error, frame) = worst?;
        // Pixels without a source exceed the tolerance too, however accurate the others are.
        let expected = if error > tolerance {
            format!("{}{unit} are predicted", two_digits(error))
        } else {
            "too many pixels have no source".to_owned()
        };
        Some(format!(
            "{frames} of {total} frames exceed {key} = {tolerance}: in the worst, frame {frame}, {expected}; \
             see `camsim explain SCENARIO.toml --frame {frame}`"
        ))
    }
}

/// Frames whose blended surfaces overlap in cycles, an error that is not predicted.
#[derive(Debug, Default)]
pub struct OverlapCycles {
    frames: usize,
    /// Largest number in a frame, and that frame.
    worst: Option<(u32, u64)>,
}

impl OverlapCycles {
    /// Adds a frame.
    pub fn add(&mut self, frame: u64, out_of_order: u32) {
        if out_of_order > 0 {
            self.frames += 1;
            if self.worst.is_none_or(|(most, _)| out_of_order > most) {
                self.worst = Some((out_of_order, frame));
            }
        }
    }

    /// The warning, if any.
    pub fn warning(&self, total: usize) -> Option<String> {
        let (most, frame) = self.worst?;
        let frames = self.frames;
        Some(format!(
            "in {frames} of {total} frames blended triangles overlap in cycles, so that up to {most} (frame \
             {frame}) are blended in the wrong order, which is not predicted; `camsim verify SCENARIO.toml \
             --pictures --frames {frame}` measures it, and quality.solver = \"reference\" avoids it"
        ))
    }
}

/// Two significant digits, with an exponent only for small numbers.
fn two_digits(error: f64) -> String {
    if error < 0.01 {
        format!("{error:.1e}")
    } else if error < 10.0 {
        format!("{error:.2}")
    } else {
        format!("{error:.0}")
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn the_worst_frame_is_named_once() {
        let mut tolerances = Tolerances::new(&QualitySpec::default()).unwrap();
        assert_eq!(tolerances.warnings().count(), 0);
        tolerances.frames = 4;
        for (frame, kept, px) in [(3, true, 0.01), (4, false, 0.2), (5, false, 0.31), (6, false, 0.07)] {
            tolerances.px.add(frame, kept, px);
        }
        let text: Vec<String> = tolerances.warnings().collect();
        let wanted = "3 of 4 frames exceed quality.max_error_px = 0.05: in the worst, frame 5, 0.31 px are \
                      predicted; see `camsim explain SCENARIO.toml --frame 5`";
        assert_eq!(text, [wanted]);
    }

    #[test]
    fn cycle_warning_names_the_worst_frame() {
        let mut cycles = OverlapCycles::default();
        assert_eq!(cycles.warning(0), None);
        [(3, 0), (4, 2), (5, 7), (6, 7), (7, 1)]
            .into_iter()
            .for_each(|(frame, count)| cycles.add(frame, count));
        let text = cycles.warning(5).unwrap();
        assert!(
            text.starts_with(
                "in 4 of 5 frames blended triangles overlap in cycles, so that up to 7 (frame \
                              5) are blended in the wrong order"
            ),
            "{text}"
        );
    }

    #[test]
    fn frame_with_too_few_sources_exceeds_the_tolerance() {
        let mut tolerances = Tolerances::new(&QualitySpec::default()).unwrap();
        tolerances.frames = 1;
        tolerances.px.add(7, false, 1e-4);
        assert!(tolerances.warnings().all(|text| text.contains("frame 7, too many pixels have no source")));
        assert_eq!(tolerances.warnings().count(), 1);
    }

    #[test]
    fn explicit_methods_have_no_tolerance_warnings() {
        let has_warnings =
            |solver| Tolerances::new(&QualitySpec { solver, ..QualitySpec::default() }).is_some();
        assert!(has_warnings(Auto::Auto) && has_warnings(Auto::Value(Solver::Reproject)));
        assert!(
            ![Solver::Linear, Solver::Rk2, Solver::Reference]
                .into_iter()
                .any(|solver| has_warnings(Auto::Value(solver)))
        );
        assert!(Tolerances::new(&QualitySpec { preset: Preset::Paper, ..QualitySpec::default() }).is_none());
    }
}
