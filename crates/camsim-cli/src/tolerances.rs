//! Which frames of a run do not keep the tolerances, by their plans, or may not for what no plan knows.

use camsim_core::scenario::{Auto, Preset, QualitySpec, Solver};
use camsim_plan::FramePlan;

/// Frames so far of which `quality.max_error_px` and `quality.max_error_dn` are predicted to be broken.
#[derive(Debug)]
pub struct Tolerances {
    px: Broken,
    dn: Broken,
    frames: u64,
}

#[derive(Debug)]
struct Broken {
    key: &'static str,
    unit: &'static str,
    tolerance: f64,
    frames: u64,
    /// The largest prediction, and of which frame.
    worst: Option<(f64, u64)>,
}

impl Tolerances {
    /// `None` where the user asks for methods whatever their error: those of the paper; and for the oracle,
    /// which has no plan.
    pub fn new(quality: &QualitySpec) -> Option<Self> {
        let is_asked_for = quality.preset == Preset::Paper
            || matches!(quality.solver, Auto::Value(Solver::Linear | Solver::Rk2 | Solver::Oracle));
        let broken = |key, unit, tolerance| Broken { key, unit, tolerance, frames: 0, worst: None };
        (!is_asked_for).then(|| Self {
            px: broken("quality.max_error_px", " px", quality.max_error_px),
            dn: broken("quality.max_error_dn", "/255", quality.max_error_dn),
            frames: 0,
        })
    }

    /// Takes in a frame.
    pub fn add(&mut self, plan: &FramePlan) {
        let predicted = &plan.predicted;
        self.frames += 1;
        self.px.add(plan.frame, predicted.kept, predicted.total_px);
        self.dn.add(plan.frame, predicted.levels_kept, predicted.picture_dn());
    }

    /// What the user should know: a line for each tolerance that is broken.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        [&self.px, &self.dn].into_iter().filter_map(|broken| broken.warning(self.frames))
    }
}

impl Broken {
    fn add(&mut self, frame: u64, kept: bool, error: f64) {
        if kept {
            return;
        }
        self.frames += 1;
        if self.worst.is_none_or(|(worst, _)| error > worst) {
            self.worst = Some((error, frame));
        }
    }

    fn warning(&self, of: u64) -> Option<String> {
        let &Self { key, unit, tolerance, frames, worst } = self;
        let (error, frame) = worst?;
        // Pixels without a source break the tolerance too, however near the others are.
        let expected = if error > tolerance {
            format!("{}{unit} are predicted", two_digits(error))
        } else {
            "too many pixels have no source".to_owned()
        };
        Some(format!(
            "{frames} of {of} frames do not keep {key} = {tolerance}: in the worst, frame {frame}, {expected}; `camsim explain SCENARIO.toml --frame {frame}` says why"
        ))
    }
}

/// Frames whose blended surfaces cover each other in rings: of what that costs no plan knows.
#[derive(Debug, Default)]
pub struct Rings {
    frames: usize,
    /// Most in a frame, and in which.
    worst: Option<(u32, u64)>,
}

impl Rings {
    /// Takes in a frame.
    pub fn add(&mut self, frame: u64, out_of_order: u32) {
        if out_of_order > 0 {
            self.frames += 1;
            if self.worst.is_none_or(|(most, _)| out_of_order > most) {
                self.worst = Some((out_of_order, frame));
            }
        }
    }

    /// What the user should know.
    pub fn warning(&self, of: usize) -> Option<String> {
        let (most, frame) = self.worst?;
        let frames = self.frames;
        Some(format!(
            "in {frames} of {of} frames blended triangles cover each other in rings, so that up to {most}, in frame {frame}, are mixed before what is \
             behind them, which no prediction counts; `camsim verify SCENARIO.toml --pictures --frames {frame}` measures it, quality.solver = \"oracle\" does without"
        ))
    }
}

/// Without an exponent where there is no need for one.
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
        let said: Vec<String> = tolerances.warnings().collect();
        let wanted = "3 of 4 frames do not keep quality.max_error_px = 0.05: in the worst, frame 5, 0.31 px are predicted; \
                      `camsim explain SCENARIO.toml --frame 5` says why";
        assert_eq!(said, [wanted]);
    }

    #[test]
    fn rings_are_told_of_the_frame_with_most() {
        let mut rings = Rings::default();
        assert_eq!(rings.warning(0), None);
        [(3, 0), (4, 2), (5, 7), (6, 7), (7, 1)]
            .into_iter()
            .for_each(|(frame, count)| rings.add(frame, count));
        let said = rings.warning(5).unwrap();
        assert!(
            said.starts_with("in 4 of 5 frames blended triangles cover each other in rings, so that up to 7, in frame 5, are mixed before"),
            "{said}"
        );
    }

    #[test]
    fn a_frame_without_sources_is_broken_however_small_the_error_of_the_others() {
        let mut tolerances = Tolerances::new(&QualitySpec::default()).unwrap();
        tolerances.frames = 1;
        tolerances.px.add(7, false, 1e-4);
        assert!(tolerances.warnings().all(|text| text.contains("frame 7, too many pixels have no source")));
        assert_eq!(tolerances.warnings().count(), 1);
    }

    #[test]
    fn methods_asked_for_by_name_are_not_judged() {
        let of = |solver| Tolerances::new(&QualitySpec { solver, ..QualitySpec::default() }).is_some();
        assert!(of(Auto::Auto) && of(Auto::Value(Solver::Reproject)));
        assert!(
            ![Solver::Linear, Solver::Rk2, Solver::Oracle].into_iter().any(|solver| of(Auto::Value(solver)))
        );
        assert!(Tolerances::new(&QualitySpec { preset: Preset::Paper, ..QualitySpec::default() }).is_none());
    }
}
