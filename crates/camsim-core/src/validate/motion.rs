//! Range checks of `[scene.gltf.motion]`.

use super::Check;
use crate::scenario::{GltfSpec, MotionSpec, PatternCentre};

pub(super) fn check_motion(check: &mut Check, table: &str, model: &GltfSpec, motion: &MotionSpec) {
    let key = |name: &str| format!("{table}.motion.{name}");
    let has_path = !motion.path.is_empty();
    let is_carried = has_path || motion.poses.is_some();
    check.require(is_carried || !motion.spin.is_empty() || motion.animate, key("path"), || {
        "is missing, and nothing else moves: give poses, path with speed_m_s, spin or animate".into()
    });
    check.require(!(has_path && motion.poses.is_some()), key("path"), || {
        "takes the place of poses: leave one of them out".into()
    });
    let has_position =
        model.at != PatternCentre::Origin || model.geodetic.is_some() || model.placements.is_some();
    check.require(!(is_carried && has_position), key(if has_path { "path" } else { "poses" }), || {
        format!("takes the place of at, geodetic and placements of {table}: leave those out")
    });
    check.require(is_carried || motion.orient.is_none(), key("orient"), || {
        "has no effect without poses or path: leave it out".into()
    });
    if has_path {
        check_path(check, &key, motion);
    } else {
        let of_path = [
            ("speed_m_s", motion.speed_m_s.is_some()),
            ("start_s", motion.start_s.is_some()),
            ("loop", motion.repeat.is_some()),
        ];
        for (name, _) in of_path.iter().filter(|(_, is_given)| *is_given) {
            check.fail(key(name), "belongs to motion.path: give that, or leave this out");
        }
    }
    for (i, spin) in motion.spin.iter().enumerate() {
        check.require(spin.axis != [0.0; 3], format!("{table}.motion.spin.{i}.axis"), || {
            "is of length 0: give a direction, [0, 1, 0] for upwards".into()
        });
    }
}

fn check_path(check: &mut Check, key: &dyn Fn(&str) -> String, motion: &MotionSpec) {
    let goes = motion.path.windows(2).any(|pair| pair[0] != pair[1]);
    check.require(goes, key("path"), || {
        "needs two different points at least: [[north_m, east_m, down_m], ...]".into()
    });
    check.require(motion.speed_m_s.is_some(), key("speed_m_s"), || {
        "is missing: give the speed along the path, m/s".into()
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{LoopKind, SpinSpec};

    /// What is said of a motion of a model at a position.
    fn said(motion: MotionSpec, at: PatternCentre) -> Vec<String> {
        let model = GltfSpec {
            file: "a.glb".into(),
            at,
            geodetic: None,
            placements: None,
            heading_deg: 0.0,
            scale: 1.0,
            on_ground: false,
            scene: None,
            time_s: None,
            animation: None,
            name: None,
            class: None,
            objects: Default::default(),
            classes: Default::default(),
            motion: None,
        };
        let mut check = Check::of_intervals(&motion, "scene.gltf.0.motion");
        check_motion(&mut check, "scene.gltf.0", &model, &motion);
        check.problems.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn motions_are_checked() {
        let path = || MotionSpec {
            path: vec![[0.0; 3], [1.0, 2.0, 3.0]],
            speed_m_s: Some(3.0),
            ..MotionSpec::default()
        };
        let spin = |axis, hz| MotionSpec {
            spin: vec![SpinSpec { axis, hz, phase_deg: 0.0, node: None }],
            ..MotionSpec::default()
        };
        let origin = PatternCentre::Origin;
        for good in [path(), spin([0.0, 1.0, 0.0], -20.0)] {
            assert_eq!(said(good, origin), Vec::<String>::new());
        }
        let cases = [
            (MotionSpec::default(), origin, "nothing else moves"),
            (MotionSpec { poses: Some("a.csv".into()), ..path() }, origin, "takes the place of poses"),
            (path(), PatternCentre::Ned([1.0; 3]), "takes the place of at"),
            (MotionSpec { orient: Some(true), ..spin([1.0; 3], 1.0) }, origin, "orient"),
            (MotionSpec { speed_m_s: None, ..path() }, origin, "speed_m_s"),
            (MotionSpec { speed_m_s: Some(0.0), ..path() }, origin, "speed_m_s"),
            (MotionSpec { start_s: Some(f64::NAN), ..path() }, origin, "start_s"),
            (MotionSpec { path: vec![[1.0; 3]; 3], ..path() }, origin, "two different points"),
            (
                MotionSpec { repeat: Some(LoopKind::Repeat), ..spin([1.0; 3], 1.0) },
                origin,
                "belongs to motion.path",
            ),
            (spin([0.0; 3], 1.0), origin, "of length 0"),
            (spin([1.0; 3], f64::INFINITY), origin, "spin.0.hz"),
        ];
        for (motion, at, wanted) in cases {
            let said = said(motion, at);
            assert!(said.len() == 1 && said[0].contains(wanted), "{wanted}: {said:?}");
        }
    }
}
