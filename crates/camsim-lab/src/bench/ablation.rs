//! What each effect of a whole camera costs: left out in turn, and one after the other until nothing is left;
//! as plans make it, and with the sampling of the whole camera held. An effect can hide what is wrong with a
//! picture: without blur, vignette or lens it takes a finer one to keep `quality.max_error_dn`, so that plans
//! may spend more time where less is to be done. What the effect itself takes is the difference that is left
//! when pictures are sampled alike.

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
    BenchError, blit,
    knobs::MAX_SIDE_PX,
    rounds::{self, Effort, FRAME, Times},
};
use crate::timing::quartiles;

/// Something that a perfect camera does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Gaussian noise.
    Noise,
    /// The vignette map.
    Vignette,
    /// The exposure, and with it motion blur.
    Blur,
    /// The shaking mount.
    Vibration,
    /// Distortion.
    Lens,
    /// The readout: every row at the same instant.
    RollingShutter,
    /// Samples at silhouettes: one a pixel.
    Silhouettes,
}

/// All of them, in the order in which they are left out one after the other.
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
    /// For tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Noise => "noise",
            Self::Vignette => "vignette",
            Self::Blur => "motion blur",
            Self::Vibration => "vibration",
            Self::Lens => "lens",
            Self::RollingShutter => "rolling shutter",
            Self::Silhouettes => "samples at silhouettes",
        }
    }

    /// Takes it out of a sequence.
    fn leave_out(self, sequence: &mut Sequence) -> Result<(), MountError> {
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
        effect.leave_out(&mut sequence)?;
    }
    Ok(Arc::new(sequence))
}

/// The sampling of a plan, or with grids where it reads areas, whatever it leaves of a picture; each frame
/// from an ideal frame of its own.
fn sampled_as(plan: &FramePlan, quality: &QualitySpec) -> QualitySpec {
    let taps = match plan.taps {
        TapStage::Bilinear | TapStage::Spline => 1,
        // No number asks for areas: a grid of as many reads as they have ideal pixels comes nearest to them.
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
        max_error_dn: ANY_DN,
        ..quality.clone()
    }
}

/// A tolerance that chooses nothing.
const ANY_DN: f64 = 255.0;

/// One row of the ablation.
#[derive(Clone, Debug, Serialize)]
pub struct AblationRow {
    /// What is left out.
    pub without: String,
    /// Milliseconds a frame, median of the rounds.
    pub ms_per_frame_p50: f64,
    /// Processor milliseconds a frame, median; null where it is not known.
    pub cpu_ms_per_frame: Option<f64>,
    /// Difference to the whole camera in the same round, quartiles, ms; null for the copy, which is measured
    /// apart.
    pub to_full_ms: Option<[f64; 3]>,
    /// The same three of frames that are sampled as the plan samples the whole camera's.
    pub alike_ms_per_frame_p50: Option<f64>,
    /// See above.
    pub alike_cpu_ms_per_frame: Option<f64>,
    /// See above.
    pub alike_to_full_ms: Option<[f64; 3]>,
}

/// Times of a camera without each effect, without more and more of them, without any over a picture that is
/// kept, and of a bare copy.
///
/// # Errors
/// Whatever the renderer meets.
pub fn measure(
    engine: &Engine,
    full: &Arc<Sequence>,
    effort: Effort,
) -> Result<Vec<AblationRow>, BenchError> {
    let mut names = vec!["nothing: the whole camera".to_owned()];
    let mut variants = vec![(full.clone(), false)];
    for effect in EFFECTS {
        names.push(effect.name().to_owned());
        variants.push((without(full, &[effect])?, false));
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
        variants.push((without(full, &EFFECTS[..count])?, false));
    }
    names.push("a perfect camera that stands still: its ideal frame is kept".to_owned());
    variants.push((without(full, &EFFECTS)?, true));
    let planned = times(engine, &variants, effort)?;
    let plan =
        Planner::new(full.clone(), &[Channel::Color], MAX_SIDE_PX).and_then(|planner| planner.plan(FRAME));
    let alike = match &plan {
        Ok(plan) => times(engine, &alike(&variants, plan), effort)?.into_iter().map(Some).collect(),
        // The renderer has made it: this cannot be.
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
        let copy = blit::measure(gpu, full.scenario.camera.size_px, rounds, effort.burst)?;
        let name = "all: a finished picture copied on the gpu and to memory";
        rows.push(row(name.to_owned(), &copy, None, None));
    }
    Ok(rows)
}

fn times(
    engine: &Engine,
    variants: &[(Arc<Sequence>, bool)],
    effort: Effort,
) -> Result<Vec<Times>, BenchError> {
    Ok(rounds::measure(engine, variants, effort)?.into_iter().map(|measured| measured.times).collect())
}

/// The same, sampled as `plan` is.
fn alike(variants: &[(Arc<Sequence>, bool)], plan: &FramePlan) -> Vec<(Arc<Sequence>, bool)> {
    let held = |(sequence, still): &(Arc<Sequence>, bool)| {
        let mut sequence = (**sequence).clone();
        sequence.scenario.quality = sampled_as(plan, &sequence.scenario.quality);
        (Arc::new(sequence), *still)
    };
    variants.iter().map(held).collect()
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
    fn a_camera_without_anything_is_perfect() {
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
        // The path is the platform's own again.
        assert_eq!(bare.path.highest_vibration_hz(), 0.0);
        // Each effect is there to be left out.
        for effect in EFFECTS {
            let one = without(full, &[effect]).expect("a mount");
            assert!(one.scenario != full.scenario, "{effect:?}");
        }
    }
}
