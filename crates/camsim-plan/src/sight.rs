//! What the centre of a pixel sees, by a ray of its own in f64.
//!
//! Depth and coordinates of a pixel at a silhouette are those of one of two surfaces. The samples of an ideal
//! frame know the border between the two to a few hundredths of a pixel, and it does not show every surface;
//! a pixel that takes the wrong one is off by all of the parallax between them, and one in ten thousand such
//! pixels is more than all other errors together. A ray knows.

use glam::{DVec2, DVec3};

use super::{FramePlan, Planner, TemporalStage};
use camsim_core::pose::CameraPose;

/// What the centre of a pixel sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Source in the mid-window ideal frame, pixels, at the exposure phase asked for. It may lie beyond the
    /// frame's border, and behind that camera it is mirrored.
    pub source_px: DVec2,
    /// Point (NED, metres) and planar depth in the line's own camera (metres) at mid-exposure; `None` is sky.
    pub met: Option<(DVec3, f64)>,
}

impl FramePlan {
    /// Whether depth and coordinates are wanted, and tell what pixels truly see: where their look-up in the
    /// ideal frame may be wrong, rays decide ([`camsim_core::temporal::suspects`]). The paper's solvers tell
    /// where they look instead.
    #[must_use]
    pub fn tells_exact_truth(&self) -> bool {
        self.truth && !matches!(self.temporal, TemporalStage::Linear | TemporalStage::Rk2)
    }
}

impl Planner {
    /// What the ray `uv` of a pixel meets, each at its own instant: source at exposure phase `phase` (-0.5 to
    /// 0.5), point and depth at mid-exposure. The terrain is met at full detail, which what was drawn is
    /// within [`FramePlan::terrain_error_px`] of.
    #[must_use]
    pub fn sight(&self, plan: &FramePlan, [x, y]: [u32; 2], uv: DVec2, phase: f64) -> Sight {
        let mid_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y);
        let look = |t_s: f64| {
            let pose = self.sequence.path.pose(t_s);
            let way_ned = pose.ned_from_camera * uv.extend(1.0);
            let depth_m = self.surfaces.meet(pose.position_ned_m, way_ned).map(|met| met.depth_m);
            (pose, way_ned, depth_m)
        };
        let source_px = |(pose, way_ned, depth_m): (CameraPose, DVec3, Option<f64>)| {
            // Times the inverse depth, which is 0 for the sky.
            let shift_ned_m = pose.position_ned_m - plan.key_pose.position_ned_m;
            let point = way_ned + depth_m.map_or(DVec3::ZERO, |depth_m| shift_ned_m / depth_m);
            plan.ideal.px_from_point(plan.key_pose.ned_from_camera.conjugate() * point)
        };
        let mid = look(mid_s);
        let (pose, way_ned, depth_m) = mid;
        let exposure_s = plan.shutter.exposure_s();
        Sight {
            source_px: source_px(if phase * exposure_s == 0.0 {
                mid
            } else {
                look(mid_s + phase * exposure_s)
            }),
            met: depth_m.map(|depth_m| (pose.position_ned_m + depth_m * way_ned, depth_m)),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use glam::DQuat;

    use super::*;
    use camsim_core::{
        mount::CameraPath,
        pose::BodyState,
        reference::Oracle,
        scenario::{Channel, FlightSpec, LensModel, LensSpec, MountSpec, Scenario, ShutterSpec, Solver},
        scene::{Encoding, Mesh, Scene, Terrain, Texture},
        sequence::Sequence,
        trajectory::Trajectory,
    };

    /// Roofs over hills, seen by a fast camera that turns, with a lens, an exposure and the skyline in view.
    fn sequence(solver: Option<Solver>) -> Arc<Sequence> {
        let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
        let roof = |north_m: f64, height_m: f64| {
            Mesh::level_picture(texture.clone(), DVec3::new(north_m, 10.0, -height_m), 30.0)
        };
        let heights: Vec<f64> = (0..65 * 65)
            .map(|i| 8.0 * (f64::from(i % 65) * 0.6).sin() * (f64::from(i / 65) * 0.4).cos())
            .collect();
        let terrain = Terrain::from_heights(65, 65, 10.0, &heights, Some(texture.clone())).unwrap();
        let scene = Scene {
            terrain: Some(terrain),
            meshes: vec![roof(20.0, 25.0), roof(70.0, 35.0)],
            ..Scene::default()
        };
        let mut scenario = Scenario {
            seed: 1,
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
            tracker: Default::default(),
            camera: Default::default(),
            scene: Default::default(),
            quality: Default::default(),
            output: Default::default(),
        };
        scenario.camera.size_px = [80, 60];
        scenario.camera.focal_px = [60.0, 62.0];
        scenario.camera.lens =
            LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05, 0.001, -0.002] };
        scenario.camera.mount = MountSpec { angles_deg: [2.0, -25.0, 0.0], ..MountSpec::default() };
        scenario.camera.shutter =
            ShutterSpec { readout_ms: 33.0, exposure_ms: 12.0, ..ShutterSpec::default() };
        scenario.quality.solver = solver.map_or(Default::default(), camsim_core::scenario::Auto::Value);
        let first = BodyState {
            position_ned_m: DVec3::new(-100.0, -20.0, -60.0),
            velocity_ned_m_s: DVec3::new(50.0, 10.0, 0.0),
            acceleration_ned_m_s2: DVec3::ZERO,
            ned_from_body: DQuat::IDENTITY,
            rate_body_rad_s: DVec3::new(0.1, -0.2, 0.3),
            angular_acceleration_body_rad_s2: DVec3::ZERO,
        };
        let trajectory = Trajectory::uniform(-1.0, 4.0, 3.0, vec![first]).unwrap();
        let path = Arc::new(CameraPath::new(trajectory, &scenario.camera.mount).unwrap());
        let scene = Arc::new(scene);
        Arc::new(Sequence {
            scenario,
            path,
            epoch_ns: 0,
            start_s: 0.0,
            frames: 9,
            scene,
            vignette: None,
            zoom_track: Vec::new(),
        })
    }

    #[test]
    fn a_pixel_sees_what_the_oracle_sees() {
        let sequence = sequence(None);
        let plan = Planner::new(sequence.clone(), &[Channel::Coords], 16_384).unwrap();
        let (planner, plan) = (&plan, plan.plan(1).unwrap());
        assert!(plan.tells_exact_truth(), "{:?}", plan.temporal);
        let oracle = Oracle::new(sequence.clone()).unwrap();
        let view = oracle.view(1);
        let key = plan.ideal_view();
        let mut of_surface = [0; 4];
        for pixel in (0..60).flat_map(|y| (0..80).map(move |x| [x, y])) {
            for phase in [0.0, -0.5, 0.3] {
                let [mid, look] = [0.0, phase].map(|phase| view.look(pixel, DVec2::ZERO, phase).unwrap());
                let sight = planner.sight(&plan, pixel, look.uv, phase);
                let off_px = sight.source_px.distance(key.source_px(&look));
                assert!(off_px < 1e-8, "{pixel:?} {phase}: {off_px:.1e} px");
                let off_m = match (sight.met, mid.hit) {
                    (Some((point_m, depth_m)), Some(hit)) => {
                        point_m.distance(hit.point_ned_m) + (depth_m - hit.depth_m).abs()
                    }
                    (None, None) => 0.0,
                    (found, _) => panic!("{pixel:?}: {found:?}, not {:?}", mid.hit),
                };
                assert!(off_m < 1e-8, "{pixel:?}: {off_m:.1e} m");
                of_surface[mid.hit.map_or(3, |hit| hit.surface as usize)] += 1;
            }
        }
        assert!(of_surface.iter().all(|&count| count > 100), "terrain, roofs and sky: {of_surface:?}");
    }

    #[test]
    fn where_a_solver_looks_elsewhere_its_coordinates_say_so() {
        let looks = |solver: Option<Solver>, channel: Channel| {
            Planner::new(sequence(solver), &[channel], 16_384).unwrap().plan(1).unwrap().tells_exact_truth()
        };
        assert!(looks(Some(Solver::Reproject), Channel::Depth));
        assert!(!looks(Some(Solver::Rk2), Channel::Depth) && !looks(Some(Solver::Linear), Channel::Coords));
        assert!(!looks(None, Channel::Color), "nothing is wanted");
    }
}
