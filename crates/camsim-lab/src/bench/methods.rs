//! The methods that a case is rendered with: the default, the paper's preset, and each method forced in turn.

use std::sync::Arc;

use camsim_core::{
    scenario::{Auto, Channel, LensModel, Preset, Scenario, Silhouettes, Solver},
    sequence::Sequence,
};
use camsim_plan::Planner;

use crate::cases::{Case, Group};

/// Name of the method that every other method of a case is compared with.
pub const DEFAULT_METHOD: &str = "auto 0.05 px";
/// Name of the case with every effect. Its frames take long, so it has fewer methods of each family.
pub const ALL_EFFECTS_CASE: &str = "all-effects";
/// Name of that case's method with a smaller picture error.
pub const FINE_METHOD: &str = "auto 0.05 px, 0.7/255";
/// Name of the case whose frame size is varied.
const SIZE_CASE: &str = "blender-plane";
/// Largest texture side that the plans behind forced sample counts assume.
pub(super) const MAX_SIDE_PX: u32 = 16_384;

/// Kinds of methods.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MethodFamily {
    /// A tolerance; the plan chooses the methods.
    #[default]
    Tolerance,
    /// The paper's preset.
    Paper,
    /// A forced temporal inverse.
    Solver,
    /// A forced number of key frames.
    KeyFrames,
    /// A forced number of exposure samples.
    Blur,
    /// A forced number of taps.
    Taps,
    /// Forced silhouette rays, or none.
    Silhouettes,
    /// Another frame size.
    Size,
}

/// One method to render a case.
#[derive(Clone, Debug)]
pub struct Method {
    /// Name, unique within a case.
    pub name: String,
    /// Kind of method.
    pub family: MethodFamily,
    /// The case's sequence with the method set in its quality.
    pub sequence: Arc<Sequence>,
}

/// The methods of a case; with `quick` only tolerances, the paper's preset and temporal inverses.
#[must_use]
pub fn methods(case: &Case, quick: bool) -> Vec<Method> {
    let mut methods = Vec::new();
    let mut add = |name: &str, family, edit: &dyn Fn(&mut Scenario)| {
        let mut sequence = (*case.sequence).clone();
        edit(&mut sequence.scenario);
        methods.push(Method { name: name.to_owned(), family, sequence: Arc::new(sequence) });
    };
    add(DEFAULT_METHOD, MethodFamily::Tolerance, &|_| {});
    add("paper", MethodFamily::Paper, &|scenario| scenario.quality.preset = Preset::Paper);
    add("auto 1 px", MethodFamily::Tolerance, &|scenario| scenario.quality.max_error_px = 1.0);
    add("auto 0.001 px", MethodFamily::Tolerance, &|scenario| scenario.quality.max_error_px = 1e-3);
    if !matches!(case.group, Group::Lens | Group::Exposure) {
        add("linear", MethodFamily::Solver, &|scenario| {
            scenario.quality.solver = Auto::Value(Solver::Linear)
        });
        add("rk2", MethodFamily::Solver, &|scenario| scenario.quality.solver = Auto::Value(Solver::Rk2));
        // On smooth ground each depth look-up reduces the error; with houses most of it is at silhouettes.
        // Frames with every effect take seconds.
        let look_ups: &[u32] = match (quick, case.name, case.has_houses()) {
            (true, ..) => &[2],
            (_, ALL_EFFECTS_CASE, _) => &[],
            (.., true) => &[1, 2],
            (.., false) => &[1, 2, 3],
        };
        for look_ups in look_ups {
            add(&format!("reproject x{look_ups}"), MethodFamily::Solver, &|scenario| {
                scenario.quality.iterations = Auto::Value(*look_ups)
            });
        }
    }
    if quick {
        return methods;
    }
    if case.name == ALL_EFFECTS_CASE {
        add(FINE_METHOD, MethodFamily::Tolerance, &|scenario| scenario.quality.max_error_dn = 0.7);
    }
    if case.has_houses() {
        if matches!(case.group, Group::Buildings | Group::LongWindow | Group::AllEffects) {
            for keys in [1, 2, 3] {
                add(&format!("{keys} key frames"), MethodFamily::KeyFrames, &|scenario| {
                    scenario.quality.key_frames = Auto::Value(keys)
                });
            }
        }
        if matches!(case.group, Group::Buildings | Group::AllEffects) {
            let with =
                |silhouettes| move |scenario: &mut Scenario| scenario.quality.silhouettes = silhouettes;
            add("silhouettes: plain", MethodFamily::Silhouettes, &with(Silhouettes::Plain));
            add("silhouettes: rays", MethodFamily::Silhouettes, &with(Silhouettes::Rays));
            add("silhouettes: rays, 0.5/255", MethodFamily::Silhouettes, &|scenario| {
                scenario.quality.max_error_dn = 0.5;
                scenario.quality.silhouettes = Silhouettes::Rays;
            });
        }
    }
    if matches!(case.group, Group::Exposure | Group::AllEffects)
        && let Some(planned) = planned_blur_samples(&case.sequence)
    {
        for times in if case.name == ALL_EFFECTS_CASE { &[0.5, 2.0][..] } else { &[0.25, 0.5, 1.0, 2.0] } {
            let samples = (f64::from(planned) * times).ceil().max(1.0) as u32;
            let name = format!("blur: {samples} samples ({times} x)");
            add(&name, MethodFamily::Blur, &|scenario| scenario.quality.blur_samples = Auto::Value(samples));
        }
    }
    // A pinhole minifies nothing.
    if case.sequence.scenario.camera.lens.model != LensModel::Pinhole {
        for taps in if case.name == ALL_EFFECTS_CASE { &[1, 2][..] } else { &[1, 2, 4] } {
            add(&format!("taps: {taps} x {taps}"), MethodFamily::Taps, &|scenario| {
                scenario.quality.footprint_taps = Auto::Value(*taps)
            });
        }
    }
    if case.name == SIZE_CASE {
        for size_px in [[320, 240], [1280, 960], [1920, 1080]] {
            let [width, height] = size_px;
            add(&format!("{width}x{height}"), MethodFamily::Size, &|scenario| resize(scenario, size_px));
            add(&format!("{width}x{height}, paper"), MethodFamily::Size, &|scenario| {
                resize(scenario, size_px);
                scenario.quality.preset = Preset::Paper;
            });
        }
    }
    methods
}

/// Exposure samples that the plan takes for the longest exposure path.
fn planned_blur_samples(sequence: &Arc<Sequence>) -> Option<u32> {
    let planner = Planner::new(sequence.clone(), &[Channel::Color], MAX_SIDE_PX).ok()?;
    let blur = planner.plan(0).ok()?.blur?;
    Some(blur.max_samples * blur.stretches())
}

/// Scales the camera to another frame size; the focal length follows the height.
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
