//! Checks of `[[cameras]]`.

use super::{Check, Problem, timing::check_triggers, twins::check_folder_name, validate, validate_camera};
use crate::scenario::{CameraSpec, Rig, Scenario, SensorCarrier};

/// As [`validate`], for every camera of a rig. Keys of `[[cameras]]` begin with `cameras.` and the camera's
/// number.
#[must_use]
pub fn validate_rig(rig: &Rig) -> Vec<Problem> {
    if !rig.is_list() {
        return validate(rig.first());
    }
    let mut check = Check::default();
    check_carriers(&mut check, rig);
    let names: Vec<&str> = rig.names().collect();
    check_names(&mut check, &names);
    check_twins(&mut check, rig.first(), &names);
    let cameras: Vec<&CameraSpec> = rig.scenarios().iter().map(|scenario| &scenario.camera).collect();
    check_triggers(&mut check, &cameras);
    let of_each: Vec<Vec<Problem>> = rig.scenarios().iter().map(validate).collect();
    for (i, problems) in of_each.iter().enumerate() {
        for problem in problems {
            match of_camera(problem, i, names[i]) {
                Some(problem) => check.problems.push(problem),
                None if of_each.iter().all(|others| others.contains(problem)) => {
                    if i == 0 {
                        check.problems.push(problem.clone());
                    }
                }
                None => check.fail(&problem.key, format!("of camera {}: {}", names[i], problem.message)),
            }
        }
    }
    check.problems
}

/// The problem of a key of `camera` as that of a camera of the rig; `None` for other keys.
fn of_camera(problem: &Problem, index: usize, name: &str) -> Option<Problem> {
    let key = problem.key.strip_prefix("camera.")?;
    // As files write it, and as `--set` does.
    let message =
        problem.message.replace("[[camera.", "[[cameras.").replace("camera.", &format!("cameras.{name}."));
    Some(Problem { key: format!("cameras.{index}.{key}"), message })
}

/// Checks the ranges of `[[cameras]]` without the rest of a scenario.
#[must_use]
pub fn validate_cameras(cameras: &[CameraSpec]) -> Vec<Problem> {
    let mut check = Check::default();
    let names: Vec<&str> = cameras.iter().map(|camera| camera.name.as_str()).collect();
    check_names(&mut check, &names);
    check_triggers(&mut check, &cameras.iter().collect::<Vec<_>>());
    for (i, camera) in cameras.iter().enumerate() {
        check
            .problems
            .extend(validate_camera(camera).iter().filter_map(|problem| of_camera(problem, i, &camera.name)));
    }
    check.problems
}

fn check_names(check: &mut Check, names: &[&str]) {
    for (i, name) in names.iter().enumerate() {
        let key = format!("cameras.{i}.name");
        check_folder_name(check, &key, name);
        let is_repeated = names[..i].iter().any(|other| other.eq_ignore_ascii_case(name));
        check.require(!is_repeated, key, || {
            format!("\"{name}\" names two cameras; give each a name of its own, as it is a folder")
        });
    }
}

fn check_twins(check: &mut Check, scenario: &Scenario, names: &[&str]) {
    for (i, twin) in scenario.output.twin.iter().enumerate() {
        let is_camera = names.iter().any(|name| name.eq_ignore_ascii_case(&twin.name));
        check.require(!is_camera, format!("output.twin.{i}.name"), || {
            format!("\"{}\" is the name of a camera too; choose another name for the twin", twin.name)
        });
    }
}

/// An imu is fixed to one of the cameras, and no key says to which.
fn check_carriers(check: &mut Check, rig: &Rig) {
    let shakes = rig.scenarios().iter().any(|scenario| !scenario.camera.mount.vibration.is_empty());
    let is_ambiguous = shakes && rig.scenarios().len() > 1;
    for (i, imu) in rig.first().imu.iter().enumerate() {
        let is_clear = !is_ambiguous || imu.attached_to == SensorCarrier::Body;
        check.require(is_clear, format!("imu.{i}.attached_to"), || {
            "= \"camera\" names none of several cameras that vibrate: use \"body\", or render one camera with it"
                .to_owned()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        scenario::{Axis, ImuSpec, TwinSpec, VibrationSpec},
        validate::tests::good,
    };

    fn camera(name: &str) -> CameraSpec {
        CameraSpec { name: name.into(), ..CameraSpec::default() }
    }

    fn problems(cameras: Vec<CameraSpec>, twin: &str) -> Vec<String> {
        let mut shared = good();
        shared.output.twin =
            vec![TwinSpec { name: twin.into(), exposure: Some(false), ..TwinSpec::default() }];
        let rig = Rig::of_cameras(&shared, cameras).expect("cameras");
        validate_rig(&rig).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn names_are_unique_folders() {
        assert_eq!(problems(vec![camera("left"), camera("right-2_b")], "sharp"), [""; 0]);
        for (names, twin, wanted) in [
            (["left", "LEFT"], "sharp", "cameras.1.name: \"LEFT\" names two cameras"),
            (["left", ""], "sharp", "cameras.1.name: is the name of a folder"),
            (["../up", "right"], "sharp", "cameras.0.name: is the name of a folder"),
            (["left", "depth"], "sharp", "cameras.1.name: \"depth\" is the name of another folder"),
            (["left", "right"], "Right", "output.twin.0.name: \"Right\" is the name of a camera too"),
        ] {
            let found = problems(names.map(camera).to_vec(), twin);
            assert!(found.len() == 1 && found[0].starts_with(wanted), "{names:?}: {found:?}");
        }
    }

    #[test]
    fn an_imu_on_one_of_several_shaking_cameras_is_refused() {
        let mut shared = good();
        shared.imu =
            vec![ImuSpec { name: "imu0".into(), attached_to: SensorCarrier::Camera, ..ImuSpec::default() }];
        let mut right = camera("right");
        let said = |right: &CameraSpec, shared: &Scenario| {
            let rig = Rig::of_cameras(shared, vec![camera("left"), right.clone()]).expect("cameras");
            validate_rig(&rig).iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        assert_eq!(said(&right, &shared), [""; 0]);
        let pitch = VibrationSpec {
            axis: Axis::Pitch,
            amplitude_deg: 0.1,
            amplitude_m: 0.0,
            hz: 50.0,
            phase_deg: 0.0,
        };
        right.mount.vibration.push(pitch);
        let found = said(&right, &shared);
        assert!(found.len() == 1 && found[0].starts_with("imu.0.attached_to: = \"camera\""), "{found:?}");
        shared.imu[0].attached_to = SensorCarrier::Body;
        assert_eq!(said(&right, &shared), [""; 0]);
    }

    #[test]
    fn problems_name_the_camera_and_shared_ones_are_told_once() {
        let mut right = camera("right");
        right.shutter.readout_ms = -1.0;
        right.clock_offset_ms = f64::NAN;
        let found = problems(vec![camera("left"), right], "sharp");
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].starts_with("cameras.1.clock_offset_ms: must be -"), "{found:?}");
        assert_eq!(
            found[1],
            "cameras.1.shutter.readout_ms: must be a finite number, 0 or more, not -1; reverse the direction with \
             cameras.right.shutter.readout"
        );
        let mut shared = good();
        shared.flight.speed = 0.0;
        let rig = Rig::of_cameras(&shared, vec![camera("left"), camera("right")]).expect("cameras");
        let found = validate_rig(&rig);
        assert!(found.len() == 1 && found[0].key == "flight.speed", "{found:?}");
        assert_eq!(Rig::of_cameras(&shared, Vec::new()), None);
    }
}
