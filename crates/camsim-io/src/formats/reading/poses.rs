//! Poses and clocks of cameras in calibration files.

use camsim_core::{
    mount::mount_angles_deg,
    pose::FLU_FROM_FRD,
    scenario::{CameraSpec, MountSpec},
};
use glam::{DMat3, DQuat, DVec3};
use serde_json::Value;

use crate::formats::axes::Rigid;
use crate::text::document::{KeyProblem, find, numbers, optional_number};
use crate::text::numbers::shortest;

/// Axes of the body or inertial sensor to which the poses of a file refer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BodyAxes {
    /// x forward, y left, z up, as flight logs in TUM's and EuRoC's formats are read.
    #[default]
    Flu,
    /// x forward, y right, z down: those of camsim.
    Frd,
}

impl BodyAxes {
    fn body_from_file(self) -> Rigid {
        match self {
            Self::Flu => Rigid::turn(FLU_FROM_FRD),
            Self::Frd => Rigid::IDENTITY,
        }
    }
}

/// Where a camera is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Placement {
    /// `b_from_camera`, B the body or inertial sensor of the file.
    InBody(Rigid),
    /// `first_from_camera`: only poses between cameras are known.
    InFirst(Rigid),
}

/// What a file says of a camera's pose and clock.
#[derive(Debug, Default)]
pub(crate) struct Extrinsics {
    pub(crate) placement: Option<Placement>,
    /// Path of the key that gave the pose in the body.
    pub(crate) pose_key: String,
    /// What is added to stamps of the camera to get those of the inertial sensor, seconds.
    pub(crate) shift_s: Option<f64>,
    /// Paths of the keys that were read.
    pub(crate) applied: Vec<String>,
    pub(crate) notes: Vec<String>,
}

impl Extrinsics {
    /// Reads the matrix at `key`, `b_from_camera` or its inverse.
    pub(crate) fn in_body(
        &mut self,
        value: &Value,
        prefix: &str,
        key: &str,
        is_inverse: bool,
    ) -> Result<(), KeyProblem> {
        if find(value, key).is_none() {
            return Ok(());
        }
        let pose = self.matrix(value, prefix, key)?;
        self.place(format!("{prefix}{key}"), if is_inverse { pose.inverse() } else { pose })
    }

    /// Takes a pose in the body. A file that states another one already is refused.
    pub(crate) fn place(&mut self, key: String, pose: Rigid) -> Result<(), KeyProblem> {
        if let Some(Placement::InBody(before)) = self.placement {
            return match difference(&before, &pose) {
                None => Ok(()),
                Some(by) => Err(KeyProblem::new(
                    key,
                    format!("is another pose than {}, by {by}: delete the wrong one", self.pose_key),
                )),
            };
        }
        (self.placement, self.pose_key) = (Some(Placement::InBody(pose)), key);
        Ok(())
    }

    pub(crate) fn matrix(&mut self, value: &Value, prefix: &str, key: &str) -> Result<Rigid, KeyProblem> {
        let list = numbers(value, key)?;
        self.applied.push(format!("{prefix}{key}"));
        let (rigid, error) = rigid(&list).map_err(|message| KeyProblem::new(key, message))?;
        if error > 1e-5 {
            self.notes.push(format!(
                "{prefix}{key}: its axes are off by {error:.1e}; the nearest rotation is taken"
            ));
        }
        Ok(rigid)
    }

    pub(crate) fn shift(&mut self, value: &Value, prefix: &str, key: &str) -> Result<(), KeyProblem> {
        if let Some(shift_s) = optional_number(value, key)? {
            self.shift_s = Some(shift_s);
            self.applied.push(format!("{prefix}{key}"));
        }
        Ok(())
    }

    /// Sets mount and clock of a camera; returns notes.
    pub(crate) fn apply(&self, axes: BodyAxes, spec: &mut CameraSpec) -> Vec<String> {
        let mut notes = self.notes.clone();
        match self.placement {
            Some(Placement::InBody(pose)) => set_mount(spec, &axes.body_from_file().of(&pose)),
            Some(Placement::InFirst(pose)) => {
                set_mount(spec, &Rigid::of_mount(&MountSpec::default()).of(&pose));
                notes.push(
                    "the file has poses between cameras only: the first camera looks along the nose"
                        .to_owned(),
                );
            }
            None => notes.push("the file has no pose of the camera: the mount is the default".to_owned()),
        }
        if let Some(shift_s) = self.shift_s {
            spec.clock_offset_ms = shortest(-1e3 * shift_s, 1.5 * f64::EPSILON * (1e3 * shift_s).abs());
        }
        notes
    }
}

/// Mount of a pose in the body.
fn set_mount(spec: &mut CameraSpec, body_from_camera: &Rigid) {
    let shift_m = body_from_camera.translation_m;
    // The rounding of turning it to the file's axes and back.
    let tolerance = 16.0 * f64::EPSILON * shift_m.length();
    spec.mount.angles_deg = mount_angles_deg(body_from_camera.rotation);
    spec.mount.offset_m = shift_m.to_array().map(|metres| shortest(metres, tolerance));
}

/// By how much two poses differ, beyond the rounding of files.
pub(crate) fn difference(a: &Rigid, b: &Rigid) -> Option<String> {
    let shift_m = (a.translation_m - b.translation_m).length();
    let angle_rad = a.rotation.angle_between(b.rotation);
    (shift_m > 1e-3 || angle_rad > 1e-3)
        .then(|| format!("{shift_m:.4} m and {:.3} degrees", angle_rad.to_degrees()))
}

/// A rigid motion of 12 or 16 numbers in rows, and how far its axes are from a rotation's.
pub(crate) fn rigid(list: &[f64]) -> Result<(Rigid, f64), String> {
    if !(list.len() == 12 || list.len() == 16 && list[12..] == [0.0, 0.0, 0.0, 1.0]) {
        return Err(format!("has {} numbers; a pose has 4 x 4, the last row 0 0 0 1", list.len()));
    }
    let column = |k: usize| DVec3::new(list[k], list[4 + k], list[8 + k]);
    let given = DMat3::from_cols(column(0), column(1), column(2));
    let product = given.transpose() * given - DMat3::IDENTITY;
    let error = product.to_cols_array().iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if !(error < 1e-2 && given.determinant() > 0.0) {
        return Err(format!(
            "is no pose: its axes have lengths {:.3?} and the determinant {:.3}, which should be 1",
            [column(0).length(), column(1).length(), column(2).length()],
            given.determinant()
        ));
    }
    // Newton's iteration for the nearest rotation; the error squares at each step.
    let mut nearest = given;
    for _ in 0..5 {
        nearest = (nearest + nearest.inverse().transpose()) * 0.5;
    }
    Ok((Rigid { rotation: DQuat::from_mat3(&nearest).normalize(), translation_m: column(3) }, error))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn poses_are_the_nearest_rotations() {
        let turn = DQuat::from_euler(glam::EulerRot::ZYX, 0.4, -0.2, 1.7);
        let rows = Rigid { rotation: turn, translation_m: DVec3::new(1.0, -2.0, 3.5) }.matrix();
        let (exact, error) = rigid(rows.as_flattened()).unwrap();
        assert!(exact.rotation.abs_diff_eq(turn, 4e-16) && error < 1e-15, "{exact:?}");
        assert_eq!(exact.translation_m, DVec3::new(1.0, -2.0, 3.5));
        // Six digits of each number.
        let rough: Vec<f64> = rows.as_flattened()[..12].iter().map(|x| (x * 1e6).round() * 1e-6).collect();
        let (near, error) = rigid(&rough).unwrap();
        assert!(near.rotation.abs_diff_eq(turn, 2e-6) && error > 1e-8 && error < 2e-6, "{error}");
    }

    #[test]
    fn matrices_that_are_no_poses_are_refused() {
        let mut mirrored = Rigid::IDENTITY.matrix();
        mirrored[0][0] = -1.0;
        assert!(rigid(mirrored.as_flattened()).unwrap_err().contains("determinant -1"));
        let mut scaled = Rigid::IDENTITY.matrix();
        scaled[1][1] = 1.1;
        assert!(rigid(scaled.as_flattened()).unwrap_err().contains("1.100"));
        assert!(rigid(&[1.0; 9]).unwrap_err().contains("has 9 numbers"));
        let mut projective = Rigid::IDENTITY.matrix();
        projective[3][0] = 0.1;
        assert!(rigid(projective.as_flattened()).is_err());
    }
}
