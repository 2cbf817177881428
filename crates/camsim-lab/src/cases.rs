//! Scenes and motions that experiments run on: made in memory, from fixed seeds.

use std::sync::Arc;

use camsim_core::{
    mount::{CameraPath, MountError},
    pose::BodyState,
    scenario::{
        Axis, CameraSpec, FieldOr, FlightSpec, LensModel, LensSpec, MountSpec, OutputSpec, PhotometricSpec,
        QualitySpec, Scenario, SceneSpec, ShutterSpec, TrackerSpec, VibrationSpec,
    },
    scene::{Scene, TerrainError},
    sequence::Sequence,
    trajectory::Trajectory,
};
use glam::{DQuat, DVec3, EulerRot};

pub mod world;

use world::{World, vignette};

/// Seed of scenes and noise.
const SEED: u64 = 12;
/// Focal length at 640x480, pixels: the wide camera of the paper's experiments.
const FOCAL_PX: f64 = 307.6075;
/// Frames of a sequence, and of a burst: few, so that no motion leaves its scene.
pub const FRAMES: u64 = 4;
/// The camera coasts from this long before frame 0 to this long after, seconds.
const SPAN_S: f64 = 60.0;

/// Why a case cannot be made; all of them are faults of its numbers.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The terrain.
    #[error("case {case}: {source}")]
    Terrain {
        /// Its name.
        case: &'static str,
        /// Why.
        source: TerrainError,
    },
    /// The mount.
    #[error("case {case}: {source}")]
    Mount {
        /// Its name.
        case: &'static str,
        /// Why.
        source: MountError,
    },
    /// The motion.
    #[error("case {0}: its motion is not finite")]
    Motion(&'static str),
}

/// Cases that are alike: one curve of the plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// Smooth surfaces, smooth motion.
    Smooth,
    /// A shaking mount.
    Vibration,
    /// Silhouettes.
    Buildings,
    /// A second between first and last line, or before them.
    LongWindow,
    /// Long exposures.
    Exposure,
    /// Distortion.
    Lens,
    /// A whole camera.
    AllEffects,
}

impl Group {
    /// For tables and legends.
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
    /// Its name in tables and on the command line.
    pub name: &'static str,
    /// What it is like.
    pub group: Group,
    /// What it shows, in a few words.
    pub about: &'static str,
    /// Everything that its frames need, at the default quality.
    pub sequence: Arc<Sequence>,
}

impl Case {
    /// Whether anything stands on the ground.
    #[must_use]
    pub fn has_houses(&self) -> bool {
        self.sequence.scene.meshes.len() + usize::from(self.sequence.scene.terrain.is_some()) > 1
    }
}

/// What a case is made of.
struct Recipe {
    name: &'static str,
    group: Group,
    about: &'static str,
    ground: Ground,
    flight: Flight,
    camera: CameraSpec,
}

/// What is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Ground {
    Plane,
    Hills { width_m: f64, relief_m: f64 },
    Town,
    TownOnHills,
}

/// Motion about the instant of frame 0, over the origin, heading north.
#[derive(Clone, Copy, Debug)]
struct Flight {
    height_m: f64,
    velocity_ned_m_s: [f64; 3],
    /// Roll, pitch, yaw rate of the body.
    rate_body_deg_s: [f64; 3],
}

/// All cases, in the order of the tables of `camsim bench`.
///
/// # Errors
/// [`CaseError`], which no shipped case gives.
pub fn cases() -> Result<Vec<Case>, CaseError> {
    let world = World::new(SEED);
    recipes().into_iter().map(|recipe| make(&world, recipe)).collect()
}

/// Level flight to the north-east.
fn flight(height_m: f64, speed_m_s: f64, rate_body_deg_s: [f64; 3]) -> Flight {
    let (sin, cos) = 20_f64.to_radians().sin_cos();
    Flight { height_m, velocity_ned_m_s: [speed_m_s * cos, speed_m_s * sin, 0.0], rate_body_deg_s }
}

/// A camera at `pitch_deg` (-90 looks straight down) with the given times.
fn camera(pitch_deg: f64, readout_ms: f64, exposure_ms: f64) -> CameraSpec {
    CameraSpec {
        size_px: [640, 480],
        focal_px: [FOCAL_PX; 2],
        mount: MountSpec { angles_deg: [0.0, pitch_deg, 0.0], ..MountSpec::default() },
        shutter: ShutterSpec { readout_ms, exposure_ms, ..ShutterSpec::default() },
        ..CameraSpec::default()
    }
}

fn lens(model: LensModel, focal_px: f64, principal_point_px: [f64; 2], coefficients: &[f64]) -> CameraSpec {
    CameraSpec {
        focal_px: [focal_px; 2],
        principal_point_px: Some(principal_point_px),
        lens: LensSpec { model, coefficients: coefficients.to_vec() },
        ..camera(-90.0, 33.0, 0.0)
    }
}

fn shaking(mut camera: CameraSpec, axis: Axis, amplitude_deg: f64, hz: f64) -> CameraSpec {
    camera.mount.vibration.push(VibrationSpec { axis, amplitude_deg, amplitude_m: 0.0, hz, phase_deg: 40.0 });
    camera
}

fn recipes() -> Vec<Recipe> {
    use Ground::{Hills, Plane, Town, TownOnHills};
    use Group::{AllEffects, Buildings, Exposure, LongWindow, Smooth, Vibration};
    let hills = Hills { width_m: 768.0, relief_m: 12.0 };
    let high_hills = Hills { width_m: 5000.0, relief_m: 80.0 };
    let nadir = |readout_ms, exposure_ms| camera(-90.0, readout_ms, exposure_ms);
    let still = [0.0; 3];
    let centre = [319.5, 239.5];
    let mut one_second_late = nadir(33.0, 0.0);
    one_second_late.shutter.delay_ms = 1000.0;
    let mut interlaced = nadir(33.0, 0.0);
    interlaced.shutter.interlace_ms = FieldOr::Field;
    let mut everything = lens(LensModel::BrownConrady, FOCAL_PX, [305.599, 226.736], &S3);
    everything.mount.angles_deg = [0.0, -75.0, 0.0];
    everything.shutter.exposure_ms = 8.0;
    everything.photometric = PhotometricSpec {
        noise_sigma: 0.01,
        vignette: Some("in-memory".into()),
        ..PhotometricSpec::default()
    };
    let everything = shaking(shaking(everything, Axis::Pitch, 0.05, 60.0), Axis::Yaw, 0.05, 45.0);
    let brown = |focal_px, principal, coefficients: &[f64]| {
        lens(LensModel::BrownConrady, focal_px, principal, coefficients)
    };
    let of_lens = |name, about, camera| Recipe {
        name,
        group: Group::Lens,
        about,
        ground: Plane,
        flight: flight(150.0, 30.0, still),
        camera,
    };
    let case =
        |name, group, about, ground, flight, camera| Recipe { name, group, about, ground, flight, camera };
    vec![
        case(
            "roll-36",
            Smooth,
            "36 deg of roll about the optical axis within a frame",
            Plane,
            flight(150.0, 0.0, [0.0, 0.0, 36.0]),
            nadir(1000.0, 0.0),
        ),
        case(
            "pitch-36",
            Smooth,
            "36 deg of pitch within a frame",
            Plane,
            flight(150.0, 0.0, [0.0, 36.0, 0.0]),
            nadir(1000.0, 0.0),
        ),
        case(
            "plane-30",
            Smooth,
            "30 m/s over a plane, 33 ms readout",
            Plane,
            flight(150.0, 30.0, still),
            nadir(33.0, 0.0),
        ),
        case(
            "terrain-100",
            Smooth,
            "100 m/s over hills, 33 ms",
            hills,
            flight(150.0, 100.0, still),
            nadir(33.0, 0.0),
        ),
        case(
            "combined-58",
            Smooth,
            "40 m/s and 58 deg/s over hills, 100 ms",
            hills,
            flight(150.0, 40.0, [30.0, 25.0, 43.0]),
            nadir(100.0, 0.0),
        ),
        case(
            "interlace",
            Smooth,
            "40 m/s, 20 deg/s, fields 16.7 ms apart",
            hills,
            flight(150.0, 40.0, [0.0, 0.0, 20.0]),
            interlaced,
        ),
        case(
            "vibration-100",
            Vibration,
            "100 Hz, 0.2 deg over hills, 33 ms",
            hills,
            flight(150.0, 30.0, still),
            shaking(nadir(33.0, 0.0), Axis::Pitch, 0.2, 100.0),
        ),
        case(
            "vibration-200",
            Vibration,
            "200 Hz, 0.1 deg over houses, 33 ms, exposure 5 ms",
            Town,
            flight(60.0, 15.0, still),
            shaking(nadir(33.0, 5.0), Axis::Roll, 0.1, 200.0),
        ),
        case(
            "buildings-15",
            Buildings,
            "15 m/s, 60 m above houses, straight down, 33 ms",
            Town,
            flight(60.0, 15.0, still),
            nadir(33.0, 0.0),
        ),
        case(
            "buildings-40",
            Buildings,
            "40 m/s, 35 m above ground, 50 deg down, 33 ms",
            Town,
            flight(35.0, 40.0, still),
            camera(-50.0, 33.0, 0.0),
        ),
        case(
            "buildings-60",
            Buildings,
            "60 m/s, 35 m above ground, 35 deg down with the skyline, 33 ms",
            Town,
            flight(35.0, 60.0, still),
            camera(-35.0, 33.0, 0.0),
        ),
        case(
            "delay-1s",
            LongWindow,
            "1 s of delay, 50 m/s over hills",
            hills,
            flight(150.0, 50.0, still),
            one_second_late,
        ),
        case(
            "rolling-1s",
            LongWindow,
            "1 s of readout, 100 m/s, 1000 m above hills",
            high_hills,
            flight(1000.0, 100.0, [3.0, 0.0, 5.0]),
            nadir(1000.0, 0.0),
        ),
        case(
            "rolling-1s-buildings",
            LongWindow,
            "1 s of readout, 15 m/s, 100 m above houses",
            Town,
            flight(100.0, 15.0, still),
            nadir(1000.0, 0.0),
        ),
        case(
            "exposure-1",
            Exposure,
            "1 ms at 40 m/s and 30 deg/s",
            hills,
            flight(150.0, 40.0, [0.0, 30.0, 0.0]),
            nadir(33.0, 1.0),
        ),
        case(
            "exposure-10",
            Exposure,
            "10 ms at 40 m/s and 30 deg/s",
            hills,
            flight(150.0, 40.0, [0.0, 30.0, 0.0]),
            nadir(33.0, 10.0),
        ),
        case(
            "exposure-100",
            Exposure,
            "100 ms at 40 m/s and 30 deg/s",
            hills,
            flight(150.0, 40.0, [0.0, 30.0, 0.0]),
            nadir(33.0, 100.0),
        ),
        of_lens("lens-none", "no distortion", nadir(33.0, 0.0)),
        of_lens(
            "lens-euroc",
            "EuRoC's cam0",
            brown(458.654, [310.0, 248.375], &[-0.283_408_11, 0.073_959_07, 0.000_193_59, 1.761_871_14e-5]),
        ),
        of_lens(
            "lens-s3",
            "the paper's fisheye (Agisoft's calibration)",
            brown(FOCAL_PX, [305.599, 226.736], &S3),
        ),
        of_lens(
            "lens-gopro-fold",
            "a barrel that folds inside the image",
            brown(300.0, [320.1, 235.1], &[-0.26, 0.03, 0.0006, -0.0004]),
        ),
        of_lens(
            "lens-kannala-brandt",
            "TUM-VI's fisheye coefficients at f = 450 px",
            lens(
                LensModel::KannalaBrandt,
                450.0,
                centre,
                &[0.003_482_389, 0.000_715_035, -0.002_053_236, 0.000_202_937],
            ),
        ),
        of_lens("lens-tangential", "p1 = 0.1, p2 = -0.1", brown(450.0, centre, &[-0.1, 0.01, 0.1, -0.1])),
        case(
            "blender-plane",
            AllEffects,
            "a plane, 33 ms readout, 8 ms exposure",
            Plane,
            flight(150.0, 30.0, [0.0, 0.0, 20.0]),
            nadir(33.0, 8.0),
        ),
        case(
            "all-effects",
            AllEffects,
            "fisheye, shake, 33 ms, 8 ms, vignette, noise, houses on hills",
            TownOnHills,
            flight(120.0, 40.0, [0.0, 10.0, 15.0]),
            everything,
        ),
    ]
}

/// The paper's camera, by Agisoft.
const S3: [f64; 5] = [-0.390_024, 0.111_124, -0.001_274_4, -0.008_151_7, -0.008_427_63];

fn make(world: &World, recipe: Recipe) -> Result<Case, CaseError> {
    let Recipe { name, group, about, ground, flight, camera } = recipe;
    let of_terrain = |source| CaseError::Terrain { case: name, source };
    let scene = match ground {
        Ground::Plane => world.plane(),
        Ground::Hills { width_m, relief_m } => world.hills(width_m, relief_m).map_err(of_terrain)?,
        Ground::Town => world.town(160.0),
        Ground::TownOnHills => world.town_on_hills(160.0, 8.0).map_err(of_terrain)?,
    };
    let trajectory = steady(&flight).ok_or(CaseError::Motion(name))?;
    let vignetted = camera.photometric.vignette.is_some();
    let mut sequence =
        sequence(camera, trajectory, scene).map_err(|source| CaseError::Mount { case: name, source })?;
    sequence.vignette = vignetted.then(|| Arc::new(vignette()));
    Ok(Case { name, group, about, sequence: Arc::new(sequence) })
}

/// Constant velocity and body rate.
fn steady(flight: &Flight) -> Option<Trajectory> {
    let rate_body_rad_s = DVec3::from_array(flight.rate_body_deg_s.map(f64::to_radians));
    let velocity_ned_m_s = DVec3::from_array(flight.velocity_ned_m_s);
    let at_zero = DQuat::from_euler(EulerRot::ZYX, 0.3, 0.0, 0.0);
    let first = BodyState {
        position_ned_m: DVec3::new(0.0, 0.0, -flight.height_m) - SPAN_S * velocity_ned_m_s,
        velocity_ned_m_s,
        acceleration_ned_m_s2: DVec3::ZERO,
        ned_from_body: (at_zero * DQuat::from_scaled_axis(-SPAN_S * rate_body_rad_s)).normalize(),
        rate_body_rad_s,
        angular_acceleration_body_rad_s2: DVec3::ZERO,
    };
    Trajectory::uniform(-SPAN_S, 2.0 * SPAN_S, SPAN_S, vec![first])
}

/// A sequence in memory: frame 0 has its stamp at path time 0, and a scenario that names no file.
///
/// # Errors
/// A mount that cannot be used.
pub fn sequence(camera: CameraSpec, trajectory: Trajectory, scene: Scene) -> Result<Sequence, MountError> {
    let path = CameraPath::new(trajectory, &camera.mount)?;
    let scenario = Scenario {
        seed: SEED,
        flight: FlightSpec {
            log: "in-memory".into(),
            format: Default::default(),
            time_unit: Default::default(),
            angle_unit: Default::default(),
            angles: Default::default(),
            attitude: Default::default(),
            origin: Default::default(),
            height: Default::default(),
            window_s: None,
            speed: 1.0,
        },
        tracker: TrackerSpec::default(),
        camera,
        scene: SceneSpec::default(),
        quality: QualitySpec::default(),
        output: OutputSpec::default(),
    };
    Ok(Sequence {
        scenario,
        path: Arc::new(path),
        epoch_ns: 0,
        start_s: 0.0,
        frames: FRAMES,
        scene: Arc::new(scene),
        vignette: None,
        zoom_track: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use camsim_core::scenario::Channel;
    use camsim_plan::{EdgeStage, Planner};

    use super::*;

    /// Each frame from its own ideal frame.
    fn by_itself(sequence: &Sequence) -> Arc<Sequence> {
        let mut sequence = sequence.clone();
        sequence.scenario.quality.frames_per_ideal = 1;
        Arc::new(sequence)
    }

    #[test]
    fn every_case_can_be_planned_and_moves_as_it_says() {
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
            let silhouettes = plan.edges != EdgeStage::None || plan.predicted.silhouettes.is_some();
            let of_houses = case.sequence.scene.meshes.len() > 1
                || case.group == Group::AllEffects && case.sequence.scene.terrain.is_some();
            assert!(silhouettes || !of_houses, "{}: {:?}", case.name, plan.edges);
            match case.name {
                "roll-36" | "pitch-36" => {
                    // Half of it to either side of the middle.
                    let own = Planner::new(by_itself(&case.sequence), &[Channel::Color], 16_384)
                        .expect(case.name)
                        .plan(1)
                        .expect(case.name);
                    assert!(
                        (own.motion.rotation_rad.to_degrees() - 18.0).abs() < 0.1,
                        "{}",
                        own.motion.rotation_rad.to_degrees()
                    );
                }
                "exposure-100" => assert!(plan.motion.blur_px > 15.0, "{}", plan.motion.blur_px),
                _ => assert!(plan.motion.travel_m > 0.0, "{}", case.name),
            }
        }
    }
}
