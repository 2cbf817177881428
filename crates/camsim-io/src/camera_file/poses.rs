//! Poses and clocks of cameras in calibration files.

use camsim_core::{
    mount::mount_angles_deg,
    pose::FLU_FROM_FRD,
    scenario::{CameraSpec, MountSpec},
};
use glam::{DMat3, DQuat, DVec3};
use serde_json::Value;

use super::document::{Document, KeyProblem, find, number, numbers, one_of, optional_number};
use super::format::CameraFormat;
use super::selection::CameraEntry;
use crate::calibration::{axes::Rigid, text::shortest};

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
enum Placement {
    /// `b_from_camera`, B the body or inertial sensor of the file.
    InBody(Rigid),
    /// `first_from_camera`: only poses between cameras are known.
    InFirst(Rigid),
}

/// What a file says of a camera's place and clock.
#[derive(Debug, Default)]
pub(super) struct Extrinsics {
    placement: Option<Placement>,
    /// Path of the key that gave the pose in the body.
    pose_key: String,
    /// What is added to stamps of the camera to get those of the inertial sensor, seconds.
    shift_s: Option<f64>,
    /// Paths of the keys that were read.
    pub(super) applied: Vec<String>,
    notes: Vec<String>,
}

/// Reads the pose and the clock of a camera.
pub(super) fn read(
    format: CameraFormat,
    document: &Document,
    entries: &[CameraEntry<'_>],
    index: usize,
) -> Result<Extrinsics, KeyProblem> {
    let mut found = Extrinsics::default();
    let entry = &entries[index];
    let root = &document.value;
    match format {
        CameraFormat::Kalibr => found.kalibr(document, entries, index)?,
        CameraFormat::Euroc => {
            found.in_body(root, "", "T_BS", false)?;
            found.shift(root, "", "timeshift_cam_imu")?;
        }
        CameraFormat::Okvis => found.in_body(entry.value, &format!("{}.", entry.roots[0]), "T_SC", false)?,
        CameraFormat::NCamera => {
            found.in_body(entry.value, &format!("{}.", entry.roots[0]), "T_B_C", false)?
        }
        CameraFormat::Camodocal => found.camodocal(root)?,
        CameraFormat::Basalt => found.basalt(root, index)?,
        CameraFormat::OrbSlam => found.orb_slam(root, &entry.name)?,
        _ => {}
    }
    Ok(found)
}

impl Extrinsics {
    /// Reads the matrix at `key`, `b_from_camera` or its inverse.
    fn in_body(
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
    fn place(&mut self, key: String, pose: Rigid) -> Result<(), KeyProblem> {
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

    fn matrix(&mut self, value: &Value, prefix: &str, key: &str) -> Result<Rigid, KeyProblem> {
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

    fn shift(&mut self, value: &Value, prefix: &str, key: &str) -> Result<(), KeyProblem> {
        if let Some(shift_s) = optional_number(value, key)? {
            self.shift_s = Some(shift_s);
            self.applied.push(format!("{prefix}{key}"));
        }
        Ok(())
    }

    /// `T_cam_imu` or OpenVINS' `T_imu_cam`; else the chain of `T_cn_cnm1`.
    fn kalibr(
        &mut self,
        document: &Document,
        entries: &[CameraEntry<'_>],
        index: usize,
    ) -> Result<(), KeyProblem> {
        let (value, prefix) = (entries[index].value, format!("{}.", entries[index].name));
        self.shift(value, &prefix, "timeshift_cam_imu")?;
        self.in_body(value, &prefix, "T_cam_imu", true)?;
        self.in_body(value, &prefix, "T_imu_cam", false)?;
        let before = |key: &str| index > 0 && find(value, key).is_some();
        if self.placement.is_some() {
            if before("T_cn_cnm1") {
                self.check_chain(document, entries, index)?;
            }
            return Ok(());
        }
        let (start, origin) = self.start_of_chain(entries, index)?;
        let mut origin_from_camera = Rigid::IDENTITY;
        for entry in &entries[start + 1..=index] {
            if find(entry.value, "T_cn_cnm1").is_none() {
                return Ok(());
            }
            let pose = self.matrix(entry.value, &format!("{}.", entry.name), "T_cn_cnm1")?;
            origin_from_camera = origin_from_camera.of(&pose.inverse());
        }
        self.placement = match origin {
            Some(Placement::InBody(pose)) => Some(Placement::InBody(pose.of(&origin_from_camera))),
            Some(Placement::InFirst(_)) | None if entries.len() > 1 => {
                Some(Placement::InFirst(origin_from_camera))
            }
            _ => None,
        };
        Ok(())
    }

    /// Where the chain of poses to a camera begins: at the nearest camera before it whose pose to the inertial
    /// sensor is known, or at the first camera. The number and pose of that camera.
    fn start_of_chain(
        &mut self,
        entries: &[CameraEntry<'_>],
        index: usize,
    ) -> Result<(usize, Option<Placement>), KeyProblem> {
        for (number, entry) in entries[..index].iter().enumerate().rev() {
            let prefix = format!("{}.", entry.name);
            let mut before = Self::default();
            before.in_body(entry.value, &prefix, "T_cam_imu", true)?;
            before.in_body(entry.value, &prefix, "T_imu_cam", false)?;
            if before.placement.is_some() {
                self.applied.extend(before.applied);
                if self.shift_s.is_none() && find(entry.value, "timeshift_cam_imu").is_some() {
                    self.notes.push(format!(
                        "{}.timeshift_cam_imu is missing, {prefix}timeshift_cam_imu is given: the clock of {} is taken \
                         to be the IMU's",
                        entries[index].name, entries[index].name
                    ));
                }
                return Ok((number, before.placement));
            }
        }
        Ok((0, None))
    }

    /// A note if `T_cn_cnm1` contradicts the poses of both cameras.
    fn check_chain(
        &mut self,
        document: &Document,
        entries: &[CameraEntry<'_>],
        index: usize,
    ) -> Result<(), KeyProblem> {
        let (entry, prefix) = (&entries[index], format!("{}.", entries[index].name));
        let stated = self.matrix(entry.value, &prefix, "T_cn_cnm1")?;
        let before = read(CameraFormat::Kalibr, document, entries, index - 1)?;
        let (Some(Placement::InBody(own)), Some(Placement::InBody(before))) =
            (self.placement, before.placement)
        else {
            return Ok(());
        };
        let computed = own.inverse().of(&before);
        if let Some(by) = difference(&stated, &computed) {
            self.notes.push(format!(
                "{prefix}T_cn_cnm1 differs from the poses of both cameras to the IMU by {by}: the latter are taken"
            ));
        }
        Ok(())
    }

    /// VINS-Mono's pair of matrices, or VINS-Fusion's `body_T_cam0`.
    fn camodocal(&mut self, root: &Value) -> Result<(), KeyProblem> {
        self.shift(root, "", "td")?;
        self.in_body(root, "", "body_T_cam0", false)?;
        let (turn, shift) = ("extrinsicRotation", "extrinsicTranslation");
        if find(root, turn).is_some() && find(root, shift).is_some() {
            let (r, t) = (numbers(root, turn)?, numbers(root, shift)?);
            if r.len() != 9 || t.len() != 3 {
                return Err(KeyProblem::new(
                    turn,
                    format!("has {} numbers, and {shift} {}", r.len(), t.len()),
                ));
            }
            let rows: Vec<f64> = (0..3).flat_map(|k| [r[3 * k], r[3 * k + 1], r[3 * k + 2], t[k]]).collect();
            let (pose, _) = rigid(&rows).map_err(|message| KeyProblem::new(turn, message))?;
            self.applied.extend([turn.to_owned(), shift.to_owned()]);
            self.place(turn.to_owned(), pose)?;
        }
        Ok(())
    }

    fn basalt(&mut self, root: &Value, index: usize) -> Result<(), KeyProblem> {
        if let Some(shift_ns) = optional_number(root, "value0.cam_time_offset_ns")? {
            self.shift_s = Some(1e-9 * shift_ns);
            self.applied.push("value0.cam_time_offset_ns".to_owned());
        }
        let poses = find(root, "value0.T_imu_cam").and_then(Value::as_array);
        let Some(pose) = poses.and_then(|poses| poses.get(index)) else { return Ok(()) };
        let get = |key: &str| {
            number(pose, key).map_err(|problem| {
                KeyProblem::new(format!("value0.T_imu_cam[{index}].{key}"), problem.message)
            })
        };
        let rotation = DQuat::from_xyzw(get("qx")?, get("qy")?, get("qz")?, get("qw")?);
        if (rotation.length() - 1.0).abs() > 1e-3 {
            let text = format!("is a quaternion of length {}, not 1", rotation.length());
            return Err(KeyProblem::new(format!("value0.T_imu_cam[{index}]"), text));
        }
        let translation_m = DVec3::new(get("px")?, get("py")?, get("pz")?);
        self.placement = Some(Placement::InBody(Rigid { rotation: rotation.normalize(), translation_m }));
        let keys = ["px", "py", "pz", "qx", "qy", "qz", "qw"];
        self.applied.extend(keys.map(|key| format!("value0.T_imu_cam[{index}].{key}")));
        Ok(())
    }

    /// `IMU.T_b_c1` and `Stereo.T_c1_c2`, or before version 1.0 `Tbc` and `Tlr`.
    fn orb_slam(&mut self, root: &Value, name: &str) -> Result<(), KeyProblem> {
        self.in_body(root, "", "IMU.T_b_c1", false)?;
        self.in_body(root, "", "Tbc", false)?;
        let pair = one_of(root, &["Stereo.T_c1_c2", "Tlr"])?;
        if name != "Camera2" {
            if self.placement.is_none() && pair.is_some() {
                self.placement = Some(Placement::InFirst(Rigid::IDENTITY));
            }
            // The second camera is placed and judged by them.
            if let Some(key) = pair {
                self.applied.extend([key, "Stereo.b", "Camera.bf"].map(str::to_owned));
            }
            return Ok(());
        }
        let Some(key) = pair else {
            // The pose of the first camera says nothing of the second.
            self.placement = None;
            return Ok(());
        };
        let first_from_camera = self.matrix(root, "", key)?;
        self.judge_baselines(root, key, first_from_camera.translation_m.length())?;
        self.placement = Some(match self.placement {
            Some(Placement::InBody(b_from_first)) => Placement::InBody(b_from_first.of(&first_from_camera)),
            _ => Placement::InFirst(first_from_camera),
        });
        Ok(())
    }

    /// Names baselines that differ from that of the pose.
    fn judge_baselines(&mut self, root: &Value, pose: &str, metres: f64) -> Result<(), KeyProblem> {
        let focal = one_of(root, &["Camera1.fx", "Camera.fx"])?;
        let focal_px = focal.map(|key| number(root, key)).transpose()?;
        // The focal length of Camera.bf may be that of rectified pictures.
        for (key, per_metre, most_off) in [("Stereo.b", Some(1.0), 0.02), ("Camera.bf", focal_px, 0.1)] {
            let (Some(stated), Some(per_metre)) = (optional_number(root, key)?, per_metre) else { continue };
            let baseline_m = stated / per_metre;
            if (baseline_m - metres).abs() > most_off * metres {
                self.notes.push(format!(
                    "not applied: {key} = {stated}, a baseline of {baseline_m:.4} m: the cameras are {metres:.4} m apart by \
                     {pose}, which is used; correct the wrong one"
                ));
            }
            self.applied.push(key.to_owned());
        }
        Ok(())
    }

    /// Sets mount and clock of a camera; returns notes.
    pub(super) fn apply(&self, axes: BodyAxes, spec: &mut CameraSpec) -> Vec<String> {
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
fn difference(a: &Rigid, b: &Rigid) -> Option<String> {
    let shift_m = (a.translation_m - b.translation_m).length();
    let angle_rad = a.rotation.angle_between(b.rotation);
    (shift_m > 1e-3 || angle_rad > 1e-3)
        .then(|| format!("{shift_m:.4} m and {:.3} degrees", angle_rad.to_degrees()))
}

/// A rigid motion of 12 or 16 numbers in rows, and how far its axes are from a rotation's.
fn rigid(list: &[f64]) -> Result<(Rigid, f64), String> {
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
