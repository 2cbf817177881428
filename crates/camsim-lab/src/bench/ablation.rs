//! Cost of each effect of a camera: each is removed alone, and one after the other until none is left. This
//! is done with the variants' own plans, and with the sampling plan of the full camera. The two differ
//! because an effect can hide errors: without blur, vignette or lens a frame needs finer sampling to keep
//! `quality.max_error_dn`, so it may take longer. With the same sampling the difference is the cost of the
//! effect itself.

use std::sync::Arc;

use camsim_core::{
    mount::{CameraPath, MountError},
    scenario::{Auto, Channel, LensSpec, QualitySpec, ShutterSpec, Silhouettes},
    sequence::Sequence,
    temporal::TapStage,
};
use camsim_engine::Engine;
use camsim_plan::{FramePlan, Planner};
use serde::Serialize;

use super::{
    BenchError, frame_copy,
    methods::MAX_SIDE_PX,
    rounds::{self, FRAME, RoundLimits, TimedSequence, Times},
};
use crate::timing::quartiles;

/// An effect that a perfect camera does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Gaussian noise.
    Noise,
    /// The vignette map.
    Vignette,
    /// The exposure, and with it motion blur.
    Blur,
    /// Vibration of the mount.
    Vibration,
    /// Distortion.
    Lens,
    /// The readout; without it every row has the same instant.
    RollingShutter,
    /// Silhouette rays; without them each pixel has one source.
    Silhouettes,
}

/// All effects, in the order in which they are removed.
pub const EFFECTS: [Effect; 7] = [
    Effect::Noise,
    Effect::Vignette,
    Effect::Blur,
    Effect::Vibration,
    Effect::Lens,
    Effect::RollingShutter,
    Effect::Silhouettes,
];

impl Effect {
    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Noise => "noise",
            Self::Vignette => "vignette",
            Self::Blur => "motion blur",
            Self::Vibration => "vibration",
            Self::Lens => "lens",
            Self::RollingShutter => "rolling shutter",
            Self::Silhouettes => "silhouette rays",
        }
    }

    /// Removes the effect from a sequence.
    fn remove_from(self, sequence: &mut Sequence) -> Result<(), MountError> {
        let camera = &mut sequence.scenario.camera;
        match self {
            Self::Noise => camera.photometric.noise_sigma = 0.0,
            Self::Vignette => {
                camera.photometric.vignette = None;
                sequence.vignette = None;
            }
            Self::Blur => camera.shutter.exposure_ms = 0.0,
            Self::Vibration => {
                camera.mount.vibration.clear();
                sequence.path = Arc::new(CameraPath::new(sequence.path.trajectory.clone(), &camera.mount)?);
            }
            Self::Lens => camera.lens = LensSpec::default(),
            Self::RollingShutter => {
                camera.shutter =
                    ShutterSpec { exposure_ms: camera.shutter.exposure_ms, ..ShutterSpec::default() };
            }
            Self::Silhouettes => sequence.scenario.quality.silhouettes = Silhouettes::Plain,
        }
        Ok(())
    }
}

/// A sequence without some effects.
///
/// # Errors
/// A mount that cannot be used.
pub fn without(sequence: &Sequence, effects: &[Effect]) -> Result<Arc<Sequence>, MountError> {
    let mut sequence = sequence.clone();
    for effect in effects {
        effect.remove_from(&mut sequence)?;
    }
    Ok(Arc::new(sequence))
}

/// Forces the sampling of a plan, without a tolerance, and with an ideal frame for each output frame. Area
/// reads, which cannot be forced, become grids of taps.
fn with_sampling_of(plan: &FramePlan, quality: &QualitySpec) -> QualitySpec {
    let taps = match plan.taps {
        TapStage::Bilinear | TapStage::Spline => 1,
        // The nearest grid has as many taps as the area has ideal pixels.
        TapStage::Area => (plan.ideal.scale(&plan.camera).ceil() as u32).max(2),
        TapStage::Grid { most } | TapStage::SplineOrGrid { most } => most,
    };
    QualitySpec {
        ideal_scale: Auto::Value(plan.ideal.scale(&plan.camera)),
        ideal_samples: Auto::Value(plan.samples_a_pixel),
        footprint_taps: Auto::Value(taps),
        blur_samples: plan.blur.map_or(Auto::Auto, |blur| Auto::Value(blur.max_samples * blur.stretches())),
        silhouettes: if plan.edges.has_rays() && quality.silhouettes != Silhouettes::Plain {
            Silhouettes::Rays
        } else {
            Silhouettes::Plain
        },
        frames_per_ideal: 1,
        max_error_dn: NO_TOLERANCE_DN,
        ..quality.clone()
    }
}

/// A tolerance that every frame keeps.
const NO_TOLERANCE_DN: f64 = 255.0;

/// One row of the ablation.
#[derive(Clone, Debug, Serialize)]
pub struct AblationRow {
    /// Effects that are removed.
    pub without: String,
    /// Milliseconds a frame, median of the rounds.
    pub ms_per_frame_p50: f64,
    /// Processor milliseconds a frame, median of the rounds; null where it is not known.
    pub cpu_ms_per_frame: Option<f64>,
    /// Quartiles of the differences to the full camera in the same rounds, ms; null for the picture copy,
    /// which is measured separately.
    pub to_full_ms: Option<[f64; 3]>,
    /// Milliseconds a frame with the full camera's sampling, median of the rounds.
    pub alike_ms_per_frame_p50: Option<f64>,
    /// Processor milliseconds a frame with the full camera's sampling, median; null where it is not known.
    pub alike_cpu_ms_per_frame: Option<f64>,
    /// Quartiles of the differences to the full camera, all with its sampling, ms.
    pub alike_to_full_ms: Option<[f64; 3]>,
}

/// Measures a camera without each effect, without more and more of them, without any over a fixed ideal
/// frame, and the copy of a picture.
///
/// # Errors
/// Any error of rendering.
pub fn measure(
    engine: &Engine,
    full: &Arc<Sequence>,
    limits: RoundLimits,
) -> Result<Vec<AblationRow>, BenchError> {
    let mut names = vec!["nothing: the full camera".to_owned()];
    let timed = |sequence, is_still| TimedSequence { engine, sequence, is_still };
    let mut variants = vec![timed(full.clone(), false)];
    for effect in EFFECTS {
        names.push(effect.name().to_owned());
        variants.push(timed(without(full, &[effect])?, false));
    }
    for count in 2..=EFFECTS.len() {
        let all = count == EFFECTS.len();
        let last = EFFECTS[count - 1].name();
        names.push(if all {
            format!("... and {last}: a perfect camera")
        } else if count == 2 {
            format!("{} and {last}", EFFECTS[0].name())
        } else {
            format!("... and {last}")
        });
        variants.push(timed(without(full, &EFFECTS[..count])?, false));
    }
    names.push("a perfect camera that stands still: its ideal frame is drawn once".to_owned());
    variants.push(timed(without(full, &EFFECTS)?, true));
    let planned = times(&variants, limits)?;
    let plan =
        Planner::new(full.clone(), &[Channel::Color], MAX_SIDE_PX).and_then(|planner| planner.plan(FRAME));
    let alike = match &plan {
        Ok(plan) => times(&sampled_alike(&variants, plan), limits)?.into_iter().map(Some).collect(),
        // Does not happen: the renderer has rendered this frame.
        Err(_) => vec![None; planned.len()],
    };
    let full_alike = alike.first().cloned().flatten();
    let rows = names.into_iter().zip(planned.iter().zip(&alike));
    let mut rows: Vec<_> = rows
        .map(|(name, (own, alike))| {
            row(name, own, Some(&planned[0]), alike.as_ref().zip(full_alike.as_ref()))
        })
        .collect();
    if let Some(gpu) = engine.gpu() {
        let rounds = planned[0].wall_ms.len().max(3);
        let copy = frame_copy::measure(gpu, full.scenario.camera.size_px, rounds, limits.burst)?;
        let name = "all: a finished picture copied on the gpu and to memory";
        rows.push(row(name.to_owned(), &copy, None, None));
    }
    Ok(rows)
}

fn times(variants: &[TimedSequence<'_>], limits: RoundLimits) -> Result<Vec<Times>, BenchError> {
    Ok(rounds::measure(variants, limits)?.into_iter().map(|measured| measured.times).collect())
}

/// The variants with the sampling of one plan.
fn sampled_alike<'a>(variants: &[TimedSequence<'a>], plan: &FramePlan) -> Vec<TimedSequence<'a>> {
    let with_sampling = |variant: &TimedSequence<'a>| {
        let mut sequence = (*variant.sequence).clone();
        sequence.scenario.quality = with_sampling_of(plan, &sequence.scenario.quality);
        TimedSequence { sequence: Arc::new(sequence), ..*variant }
    };
    variants.iter().map(with_sampling).collect()
}

fn row(without: String, own: &Times, full: Option<&Times>, alike: Option<(&Times, &Times)>) -> AblationRow {
    let difference = |own: &Times, full: &Times| {
        quartiles(&own.wall_ms.iter().zip(&full.wall_ms).map(|(own, full)| own - full).collect::<Vec<_>>())
    };
    AblationRow {
        without,
        ms_per_frame_p50: own.p50_p99_ms()[0],
        cpu_ms_per_frame: own.processor_p50_ms(),
        to_full_ms: full.map(|full| difference(own, full)),
        alike_ms_per_frame_p50: alike.map(|(own, _)| own.p50_p99_ms()[0]),
        alike_cpu_ms_per_frame: alike.and_then(|(own, _)| own.processor_p50_ms()),
        alike_to_full_ms: alike.map(|(own, full)| difference(own, full)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::cases;

    #[test]
    fn camera_without_all_effects_is_perfect() {
        let cases = cases().expect("cases");
        let full = &cases.iter().find(|case| case.name == "all-effects").expect("the case").sequence;
        let bare = without(full, &EFFECTS).expect("a mount");
        let camera = &bare.scenario.camera;
        assert!(
            camera.lens == LensSpec::default()
                && camera.shutter == ShutterSpec::default()
                && camera.mount.vibration.is_empty()
        );
        assert!(
            camera.photometric.noise_sigma == 0.0
                && camera.photometric.vignette.is_none()
                && bare.vignette.is_none()
        );
        // Without vibration the path is that of the platform.
        assert_eq!(bare.path.highest_vibration_hz(), 0.0);
        // The case has each effect.
        for effect in EFFECTS {
            let one = without(full, &[effect]).expect("a mount");
            assert!(one.scenario != full.scenario, "{effect:?}");
        }
    }
}
