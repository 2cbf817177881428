//! Axes of other programs: world x east, y north, z up (ENU); body x forward, y left, z up (FLU).

use camsim_core::{
    mount::body_from_camera,
    pose::{CameraPose, ENU_FROM_NED, FLU_FROM_FRD},
    scenario::MountSpec,
};
use glam::{DQuat, DVec3};

/// A rigid transformation `a_from_b`: `x_a = rotation x_b + translation_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid {
    /// Rotation that takes axes of b to those of a.
    pub rotation: DQuat,
    /// Origin of b in a, metres.
    pub translation_m: DVec3,
}

impl Rigid {
    /// The transformation that changes nothing.
    pub const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, translation_m: DVec3::ZERO };

    /// `body_from_camera` of a mount, without vibration.
    #[must_use]
    pub fn of_mount(mount: &MountSpec) -> Self {
        Self {
            rotation: body_from_camera(mount.angles_deg),
            translation_m: DVec3::from_array(mount.offset_m),
        }
    }

    /// A rotation alone.
    #[must_use]
    pub fn turn(rotation: DQuat) -> Self {
        Self { rotation, translation_m: DVec3::ZERO }
    }

    /// `b_from_a`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { rotation, translation_m: -(rotation * self.translation_m) }
    }

    /// `a_from_c`, by `b_from_c`.
    #[must_use]
    pub fn of(&self, b_from_c: &Self) -> Self {
        Self {
            rotation: (self.rotation * b_from_c.rotation).normalize(),
            translation_m: self.translation_m + self.rotation * b_from_c.translation_m,
        }
    }

    /// Rows of the 4x4 matrix.
    #[must_use]
    pub fn matrix(&self) -> [[f64; 4]; 4] {
        let m = glam::DMat3::from_quat(self.rotation);
        let t = self.translation_m;
        let row = |k: usize| [m.x_axis[k], m.y_axis[k], m.z_axis[k], t[k]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }
}

/// A point or vector in NED, in ENU, or the other way round; exact.
#[must_use]
pub fn enu(ned: DVec3) -> DVec3 {
    DVec3::new(ned.y, ned.x, -ned.z)
}

/// Attitude in ENU of a body with x forward, y left, z up, by that in NED of forward, right, down, or the other way
/// round.
pub(crate) fn enu_from_flu(ned_from_frd: DQuat) -> DQuat {
    ENU_FROM_NED * ned_from_frd * FLU_FROM_FRD
}

/// Pose of optical camera axes in ENU.
#[must_use]
pub fn enu_from_camera(pose: &CameraPose) -> Rigid {
    Rigid {
        rotation: (ENU_FROM_NED * pose.ned_from_camera).normalize(),
        translation_m: enu(pose.position_ned_m),
    }
}

#[cfg(test)]
mod tests {
    use camsim_core::pose::FRD_FROM_RDF;

    use super::*;

    #[test]
    fn axes_are_those_that_their_names_say() {
        for ned in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, -2.0, 3.0)] {
            // The quaternion has rounded roots.
            assert!((ENU_FROM_NED * ned - enu(ned)).length() < 1e-14);
        }
        assert_eq!(FLU_FROM_FRD * DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, -2.0, -3.0));
        // A camera that looks north, level.
        let pose =
            CameraPose { position_ned_m: DVec3::new(10.0, 20.0, -30.0), ned_from_camera: FRD_FROM_RDF };
        let camera = enu_from_camera(&pose);
        assert_eq!(camera.translation_m, DVec3::new(20.0, 10.0, 30.0));
        assert!((camera.rotation * DVec3::Z - DVec3::Y).length() < 1e-14, "z looks north, which is y");
        assert!((camera.rotation * DVec3::Y + DVec3::Z).length() < 1e-14, "y looks down");
    }

    #[test]
    fn transformations_compose_and_invert() {
        let a = Rigid {
            rotation: DQuat::from_scaled_axis(DVec3::new(0.3, -0.2, 1.0)),
            translation_m: DVec3::new(1.0, 2.0, 3.0),
        };
        let b = Rigid { rotation: DQuat::from_rotation_x(0.7), translation_m: DVec3::new(-4.0, 0.5, 9.0) };
        let back = a.of(&b).of(&b.inverse()).of(&a.inverse());
        assert!(back.translation_m.length() < 1e-14 && back.rotation.angle_between(DQuat::IDENTITY) < 1e-7);
        let point = DVec3::new(0.1, 0.2, 0.3);
        let by_matrix = DVec3::from_array([0, 1, 2].map(|row: usize| {
            let m = a.matrix()[row];
            m[0] * point.x + m[1] * point.y + m[2] * point.z + m[3]
        }));
        assert!((by_matrix - (a.rotation * point + a.translation_m)).length() < 1e-14);
    }
}
