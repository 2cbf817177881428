//! Scenes and motions of experiments, made in memory from fixed seeds.

use std::sync::Arc;

use camsim_core::{
    mount::{CameraPath, MountError},
    pose::BodyState,
    scenario::{CameraSpec, FlightSpec, Scenario, SceneSpec},
    scene::{Scene, TerrainError},
    sequence::Sequence,
    trajectory::Trajectory,
};
use glam::{DQuat, DVec3, EulerRot};

mod list;
mod world;

pub(crate) use world::hash;
use world::{World, vignette};

/// Seed of scenes and noise.
const SEED: u64 = 12;
/// Frames of a sequence, and of a burst; few, so that the camera stays above its scene.
pub const FRAMES: u64 = 4;
/// Duration of the motion before and after frame 0, seconds.
const SPAN_S: f64 = 60.0;

/// Why a case cannot be made: its numbers are invalid.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The terrain is invalid.
    #[error("case {case}: {source}")]
    Terrain {
        /// Name of the case.
        case: &'static str,
        /// Reason.
        source: TerrainError,
    },
    /// The mount is invalid.
    #[error("case {case}: {source}")]
    Mount {
        /// Name of the case.
        case: &'static str,
        /// Reason.
        source: MountError,
    },
    /// The motion is not finite.
    #[error("case {0}: its motion is not finite")]
    Motion(&'static str),
}

/// Groups of similar cases. Each is a curve of the plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// Smooth surfaces, smooth motion.
    Smooth,
    /// Vibration of the mount.
    Vibration,
    /// Buildings, with their silhouettes.
    Buildings,
    /// A delay or readout of one second.
    LongWindow,
    /// Long exposures.
    Exposure,
    /// Distortion.
    Lens,
    /// A camera with all effects.
    AllEffects,
}

impl Group {
    /// Name in tables and legends.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Smooth => "smooth",
            Self::Vibration => "vibration",
            Self::Buildings => "buildings",
            Self::LongWindow => "1 s windows",
            Self::Exposure => "exposure",
            Self::Lens => "lenses",
            Self::AllEffects => "all effects",
        }
    }
}

/// A scene, a motion and a camera.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name in tables and on the command line.
    pub name: &'static str,
    /// Group of the case.
    pub group: Group,
    /// Short description.
    pub about: &'static str,
    /// The sequence, with the default quality.
    pub sequence: Arc<Sequence>,
}

impl Case {
    /// Whether there are houses on the ground.
    #[must_use]
    pub fn has_houses(&self) -> bool {
        self.sequence.scene.meshes.len() + usize::from(self.sequence.scene.terrain.is_some()) > 1
    }
}

/// Specification of a case.
struct CaseSpec {
    name: &'static str,
    group: Group,
    about: &'static str,
    ground: Ground,
    motion: ConstantTwist,
    camera: CameraSpec,
}

/// Scene of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Ground {
    Plane,
    Hills { width_m: f64, relief_m: f64 },
    Town,
    TownOnHills,
}

/// A motion with constant velocity and body rate, above the origin with heading 0.3 rad at the stamp of frame
/// 0.
#[derive(Clone, Copy, Debug)]
struct ConstantTwist {
    height_m: f64,
    velocity_ned_m_s: [f64; 3],
    /// Body rate about forward, right and down.
    rate_body_deg_s: [f64; 3],
}

/// All cases, in the order of the tables of `camsim bench`.
///
/// # Errors
/// [`CaseError`]; the built-in cases have none.
pub fn cases() -> Result<Vec<Case>, CaseError> {
    let world = World::new(SEED);
    list::case_specs().into_iter().map(|spec| make(&world, spec)).collect()
}

fn make(world: &World, spec: CaseSpec) -> Result<Case, CaseError> {
    let CaseSpec { name, group, about, ground, motion, camera } = spec;
    let terrain_error = |source| CaseError::Terrain { case: name, source };
    let scene = match ground {
        Ground::Plane => world.plane(),
        Ground::Hills { width_m, relief_m } => world.hills(width_m, relief_m).map_err(terrain_error)?,
        Ground::Town => world.town(160.0),
        Ground::TownOnHills => world.town_on_hills(160.0, 8.0).map_err(terrain_error)?,
    };
    let trajectory = motion.trajectory().ok_or(CaseError::Motion(name))?;
    let has_vignette = camera.photometric.vignette.is_some();
    let mut sequence =
        sequence(camera, trajectory, scene).map_err(|source| CaseError::Mount { case: name, source })?;
    sequence.vignette = has_vignette.then(|| Arc::new(vignette()));
    Ok(Case { name, group, about, sequence: Arc::new(sequence) })
}

impl ConstantTwist {
    /// The trajectory; `None` if it is not finite.
    fn trajectory(&self) -> Option<Trajectory> {
        let rate_body_rad_s = DVec3::from_array(self.rate_body_deg_s.map(f64::to_radians));
        let velocity_ned_m_s = DVec3::from_array(self.velocity_ned_m_s);
        let attitude_at_zero = DQuat::from_euler(EulerRot::ZYX, 0.3, 0.0, 0.0);
        let first = BodyState {
            position_ned_m: DVec3::new(0.0, 0.0, -self.height_m) - SPAN_S * velocity_ned_m_s,
            velocity_ned_m_s,
            ned_from_body: (attitude_at_zero * DQuat::from_scaled_axis(-SPAN_S * rate_body_rad_s))
                .normalize(),
            rate_body_rad_s,
            ..BodyState::default()
        };
        Trajectory::uniform(-SPAN_S, 2.0 * SPAN_S, SPAN_S, vec![first])
    }
}

/// A sequence in memory whose scenario names no file. The stamp of frame 0 is path time 0.
///
/// # Errors
/// The mount is invalid.
pub fn sequence(camera: CameraSpec, trajectory: Trajectory, scene: Scene) -> Result<Sequence, MountError> {
    let path = CameraPath::new(trajectory, &camera.mount)?;
    let scenario =
        Scenario { seed: SEED, camera, ..Scenario::new(FlightSpec::new("in-memory"), SceneSpec::default()) };
    Ok(Sequence::in_memory(scenario, path, scene, FRAMES))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use camsim_core::scenario::Channel;
    use camsim_plan::{EdgeStage, Planner};

    use super::*;

    /// The sequence with an ideal frame for each output frame.
    fn without_sharing(sequence: &Sequence) -> Arc<Sequence> {
        let mut sequence = sequence.clone();
        sequence.scenario.quality.frames_per_ideal = 1;
        Arc::new(sequence)
    }

    #[test]
    fn every_case_is_planned_with_its_motion() {
        let cases = cases().expect("cases");
        assert_eq!(
            cases.iter().map(|case| case.name).collect::<HashSet<_>>().len(),
            cases.len(),
            "names are unique"
        );
        for case in &cases {
            let planner = Planner::new(case.sequence.clone(), &[Channel::Color], 16_384).expect(case.name);
            let plan = planner.plan(1).expect(case.name);
            let megapixels = plan.ideal.size_px.iter().map(|&side| f64::from(side)).product::<f64>() / 1e6;
            assert!(megapixels < 4.0, "{}: an ideal frame of {:?} px", case.name, plan.ideal.size_px);
            let has_silhouettes = plan.edges != EdgeStage::None || plan.predicted.silhouettes.is_some();
            let has_buildings = case.sequence.scene.meshes.len() > 1
                || case.group == Group::AllEffects && case.sequence.scene.terrain.is_some();
            assert!(has_silhouettes || !has_buildings, "{}: {:?}", case.name, plan.edges);
            match case.name {
                "roll-36" | "pitch-36" => {
                    // Half of the rotation is on either side of the key frame.
                    let planned = Planner::new(without_sharing(&case.sequence), &[Channel::Color], 16_384)
                        .expect(case.name)
                        .plan(1)
                        .expect(case.name);
                    assert!(
                        (planned.motion.rotation_rad.to_degrees() - 18.0).abs() < 0.1,
                        "{}",
                        planned.motion.rotation_rad.to_degrees()
                    );
                }
                "exposure-100" => assert!(plan.motion.blur_px > 15.0, "{}", plan.motion.blur_px),
                _ => assert!(plan.motion.travel_m > 0.0, "{}", case.name),
            }
        }
    }
}
