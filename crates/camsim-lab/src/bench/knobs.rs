//! The rows of a case: its default, the paper's preset, and each method forced in turn.

use std::sync::Arc;

use camsim_core::{
    scenario::{Auto, Channel, LensModel, Preset, Scenario, Silhouettes, Solver},
    sequence::Sequence,
};
use camsim_plan::Planner;

use crate::cases::{Case, Group};

/// Name of the row that every other row of its case is compared with.
pub const DEFAULT: &str = "auto 0.05 px";
/// The case with every effect; its frames take long, and it has fewer rows of each kind.
pub const WHOLE: &str = "all-effects";
/// Its row for a finer picture.
pub const FINE: &str = "auto 0.05 px, 0.7/255";
/// The case whose size is varied.
const SIZED: &str = "blender-plane";
/// Largest texture side that the plan behind a rule of samples assumes.
pub(super) const MAX_SIDE_PX: u32 = 16_384;

/// What a row varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// The tolerance; everything is chosen by the plan.
    Tolerance,
    /// The paper's methods throughout.
    Paper,
    /// The temporal solver.
    Solver,
    /// Ideal frames for each output frame.
    KeyFrames,
    /// Samples over the exposure.
    Blur,
    /// Footprint taps.
    Taps,
    /// Samples at silhouettes.
    Silhouettes,
    /// Size of the picture.
    Size,
}

/// One row to measure.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Its name, unique within its case.
    pub knob: String,
    /// What it varies.
    pub family: Family,
    /// What it renders.
    pub sequence: Arc<Sequence>,
}

/// The rows of a case; `quick` keeps the default, the paper's and the solvers.
#[must_use]
pub fn variants(case: &Case, quick: bool) -> Vec<Variant> {
    let mut rows = Vec::new();
    let mut row = |knob: &str, family, edit: &dyn Fn(&mut Scenario)| {
        let mut sequence = (*case.sequence).clone();
        edit(&mut sequence.scenario);
        rows.push(Variant { knob: knob.to_owned(), family, sequence: Arc::new(sequence) });
    };
    row(DEFAULT, Family::Tolerance, &|_| {});
    row("paper", Family::Paper, &|scenario| scenario.quality.preset = Preset::Paper);
    row("auto 1 px", Family::Tolerance, &|scenario| scenario.quality.max_error_px = 1.0);
    row("auto 0.001 px", Family::Tolerance, &|scenario| scenario.quality.max_error_px = 1e-3);
    if !matches!(case.group, Group::Lens | Group::Exposure) {
        row("linear", Family::Solver, &|scenario| scenario.quality.solver = Auto::Value(Solver::Linear));
        row("rk2", Family::Solver, &|scenario| scenario.quality.solver = Auto::Value(Solver::Rk2));
        // Over smooth ground each look-up shows; with houses the error is at silhouettes. The whole camera's
        // frames take seconds.
        let look_ups: &[u32] = match (quick, case.name, case.has_houses()) {
            (true, ..) => &[2],
            (_, WHOLE, _) => &[],
            (.., true) => &[1, 2],
            (.., false) => &[1, 2, 3],
        };
        for look_ups in look_ups {
            row(&format!("reproject x{look_ups}"), Family::Solver, &|scenario| {
                scenario.quality.iterations = Auto::Value(*look_ups)
            });
        }
    }
    if quick {
        return rows;
    }
    if case.name == WHOLE {
        row(FINE, Family::Tolerance, &|scenario| scenario.quality.max_error_dn = 0.7);
    }
    if case.has_houses() {
        if matches!(case.group, Group::Buildings | Group::LongWindow | Group::AllEffects) {
            for keys in [1, 2, 3] {
                row(&format!("{keys} key frames"), Family::KeyFrames, &|scenario| {
                    scenario.quality.key_frames = Auto::Value(keys)
                });
            }
        }
        if matches!(case.group, Group::Buildings | Group::AllEffects) {
            let with =
                |silhouettes| move |scenario: &mut Scenario| scenario.quality.silhouettes = silhouettes;
            row("silhouettes: plain", Family::Silhouettes, &with(Silhouettes::Plain));
            row("silhouettes: rays", Family::Silhouettes, &with(Silhouettes::Rays));
            row("silhouettes: rays, 0.5/255", Family::Silhouettes, &|scenario| {
                scenario.quality.max_error_dn = 0.5;
                scenario.quality.silhouettes = Silhouettes::Rays;
            });
        }
    }
    if matches!(case.group, Group::Exposure | Group::AllEffects)
        && let Some(rule) = blur_rule(&case.sequence)
    {
        for times in if case.name == WHOLE { &[0.5, 2.0][..] } else { &[0.25, 0.5, 1.0, 2.0] } {
            let samples = (f64::from(rule) * times).ceil().max(1.0) as u32;
            let name = format!("blur: {samples} samples ({times} x)");
            row(&name, Family::Blur, &|scenario| scenario.quality.blur_samples = Auto::Value(samples));
        }
    }
    // Without a lens nothing is minified.
    if case.sequence.scenario.camera.lens.model != LensModel::Pinhole {
        for taps in if case.name == WHOLE { &[1, 2][..] } else { &[1, 2, 4] } {
            row(&format!("taps: {taps} x {taps}"), Family::Taps, &|scenario| {
                scenario.quality.footprint_taps = Auto::Value(*taps)
            });
        }
    }
    if case.name == SIZED {
        for size_px in [[320, 240], [1280, 960], [1920, 1080]] {
            let [width, height] = size_px;
            row(&format!("{width}x{height}"), Family::Size, &|scenario| resize(scenario, size_px));
            row(&format!("{width}x{height}, paper"), Family::Size, &|scenario| {
                resize(scenario, size_px);
                scenario.quality.preset = Preset::Paper;
            });
        }
    }
    rows
}

/// Samples that the plan's own rule takes where the path over the exposure is longest.
fn blur_rule(sequence: &Arc<Sequence>) -> Option<u32> {
    let planner = Planner::new(sequence.clone(), &[Channel::Color], MAX_SIDE_PX).ok()?;
    let blur = planner.plan(0).ok()?.blur?;
    Some(blur.max_samples * blur.stretches())
}

/// The same view in another size: the focal length follows the height.
pub fn resize(scenario: &mut Scenario, size_px: [u32; 2]) {
    let camera = &mut scenario.camera;
    let scale = f64::from(size_px[1]) / f64::from(camera.size_px[1]);
    let middle = camera.size_px.map(|side| 0.5 * (f64::from(side) - 1.0));
    if let Some(principal) = &mut camera.principal_point_px {
        *principal =
            [0, 1].map(|k: usize| 0.5 * (f64::from(size_px[k]) - 1.0) + scale * (principal[k] - middle[k]));
    }
    camera.focal_px = camera.focal_px.map(|focal| scale * focal);
    camera.size_px = size_px;
}
