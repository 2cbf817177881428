//! One table of stages: every stage of a frame that can be inspected, of the vectorised cpu, the general cpu
//! and the gpu, against the f64 twin. [`compare::run`] is the one body; [`checks::CHECKS`] says which stage
//! of which implementation is compared with what, and within which tolerance. `--nocapture` shows the table.

#[path = "../common/mod.rs"]
mod common;

mod cases;
mod checks;
mod compare;
mod ideal_cases;
mod ideal_twin;
mod implementations;
mod order;
mod planned_cases;
mod stage;
mod twin;

use std::{collections::HashSet, fmt::Debug, hash::Hash};

use camsim_core::{
    lens::LensModel,
    scene::PrefilterTaps,
    temporal::{NodeDepths, PathStage},
};
use camsim_gpu::reverse::{PipelineKey, TapKind, TemporalKind};
use camsim_plan::{BlurStage, FramePlan, RayStage};
use checks::Group;
use compare::{Done, run};

fn assert_all<T: Debug + Eq + Hash>(seen: &HashSet<T>, all: impl IntoIterator<Item = T>) {
    let missing: Vec<T> = all.into_iter().filter(|kind| !seen.contains(kind)).collect();
    assert!(missing.is_empty(), "no case has {missing:?}");
}

fn plans(done: Vec<Done>) -> Vec<FramePlan> {
    done.into_iter().map(|done| done.plan).collect()
}

#[test]
fn frames_of_planned_cases_agree_with_their_twins() {
    let plans = plans(run(Group::Planned, &planned_cases::planned()));
    assert!(plans.iter().filter(|plan| plan.copied_from().is_some()).count() >= 4, "some are copied");
    let keys: Vec<PipelineKey> = plans.iter().map(PipelineKey::of).collect();
    assert_all(&keys.iter().map(|key| key.ray).collect(), [RayStage::Pinhole, RayStage::LensMap]);
    assert_all(
        &keys.iter().map(|key| key.temporal).collect(),
        [TemporalKind::Identity, TemporalKind::Rotation, TemporalKind::Reproject],
    );
    let blurred = || keys.iter().filter(|key| key.blur && key.temporal == TemporalKind::Reproject);
    assert_all(&blurred().map(|key| key.depths).collect(), NodeDepths::ALL);
    assert_all(&blurred().map(|key| key.path).collect(), PathStage::ALL);
    assert_all(
        &keys.iter().map(|key| (key.blur, key.tap)).collect(),
        TapKind::ALL.into_iter().flat_map(|tap| [(false, tap), (true, tap)]),
    );
}

#[test]
fn lens_models_agree_with_their_twins() {
    let plans = plans(run(Group::Planned, &planned_cases::lenses()));
    let models: HashSet<LensModel> = plans.iter().map(|plan| plan.camera.lens.model()).collect();
    let others = [LensModel::Pinhole, LensModel::BrownConrady, LensModel::KannalaBrandt, LensModel::Table];
    assert_all(&models, LensModel::ALL.iter().copied().filter(|model| !others.contains(model)));
}

#[test]
fn frames_without_silhouettes_agree_with_their_twins_at_every_pixel() {
    let plans = plans(run(Group::Smooth, &cases::smooth()));
    let blurs: Vec<BlurStage> = plans.iter().filter_map(|plan| plan.blur).collect();
    // Tolerances that ask for depth at mid-exposure, at its ends, at all three for five nodes, and in each of
    // three.
    let depths: Vec<NodeDepths> = blurs[..4].iter().map(|blur| blur.depths).collect();
    assert_eq!(depths, NodeDepths::ALL);
    let stretches: Vec<u32> = blurs[4..].iter().map(|blur| blur.stretches()).collect();
    assert!(stretches[0] == 1 && stretches[1] == 2 && stretches[2] > 2, "{stretches:?}");
}

#[test]
fn a_still_camera_without_lens_gives_the_ideal_frame() {
    run(Group::Still, &cases::still());
}

#[test]
fn photometric_stages_agree_with_their_twin() {
    run(Group::Photometric, &cases::photometric());
}

#[test]
fn all_exposures_taps_and_solvers_agree_with_their_twins() {
    run(Group::HandMade, &cases::exposures());
    cases::assert_taps_differ(&run(Group::HandMade, &cases::taps()));
    run(Group::ConstantTwist, &cases::constant_twist());
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn ideal_frames_agree() {
    let mut done = run(Group::IdealPattern, &ideal_cases::patterns());
    done.extend(run(Group::Ideal, &ideal_cases::scenes()));
    done.extend(run(Group::IdealFiles, &ideal_cases::files()));
    let reads: HashSet<PrefilterTaps> = plans(done).iter().map(|plan| plan.surface_reads).collect();
    assert_all(&reads, PrefilterTaps::ALL);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn ideal_frames_of_four_samples_a_pixel_agree() {
    run(Group::IdealSamples, &ideal_cases::samples());
    run(Group::IdealSamplesOfFiles, &ideal_cases::samples_of_files());
}

#[test]
fn cast_ideal_frames_agree_with_the_reference_and_the_rasteriser() {
    run(Group::Gallery, &ideal_cases::gallery());
    run(Group::Opaque, &ideal_cases::opaque(1));
    run(Group::OpaqueSamples, &ideal_cases::opaque(4));
}
