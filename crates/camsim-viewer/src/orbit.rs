//! Orbit camera of the 3D view: geometry in NED metres and points of the screen.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// Half the field of view along the shorter side of the pane, degrees.
const HALF_FOV_DEG: f64 = 22.5;
/// Range of zoom.
pub const ZOOM: [f64; 2] = [0.2, 500.0];
/// Range of the depression angle, degrees; negative looks up from below.
pub const DEPRESSION_DEG: [f64; 2] = [-30.0, 90.0];
/// Rotation per point of drag, degrees.
const DEG_PER_POINT: f64 = 0.4;
/// Distance of the near plane as a fraction of the distance to the target.
const NEAR_SHARE: f64 = 0.01;
/// Largest distance of the target from the scene's centre, in radii of the scene.
const MAX_TARGET_RADII: f64 = 3.0;

/// Viewpoint relative to the scene's bounding sphere, so that it fits any scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Orbit {
    /// Azimuth of the view direction, degrees east of north.
    pub azimuth_deg: f64,
    /// Depression of the view direction, degrees: 90 is straight down.
    pub depression_deg: f64,
    /// Zoom: at 1 the bounding sphere fits into the pane.
    pub zoom: f64,
    /// Point in the middle of the pane: NED from the sphere's centre, in radii. `middle` is its name in
    /// stored settings.
    #[serde(rename = "middle")]
    pub target: [f64; 3],
}

impl Default for Orbit {
    fn default() -> Self {
        Self { azimuth_deg: 25.0, depression_deg: 32.0, zoom: 1.2, target: [0.0; 3] }
    }
}

/// Bounding sphere of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Centre, NED.
    pub centre_ned_m: DVec3,
    /// Radius.
    pub radius_m: f64,
}

impl Orbit {
    /// The whole scene from above, north up.
    pub fn from_above() -> Self {
        Self { azimuth_deg: 0.0, depression_deg: 90.0, zoom: 1.0, ..Self::default() }
    }

    /// Rotated by a drag, in points: near parts of the scene follow the pointer.
    pub fn rotated(self, drag: DVec2) -> Self {
        let depression_deg =
            (self.depression_deg + DEG_PER_POINT * drag.y).clamp(DEPRESSION_DEG[0], DEPRESSION_DEG[1]);
        Self {
            azimuth_deg: (self.azimuth_deg + DEG_PER_POINT * drag.x).rem_euclid(360.0),
            depression_deg,
            ..self
        }
    }

    /// Moved by a drag, in points: the target follows the pointer.
    pub fn panned(self, drag: DVec2, sphere: BoundingSphere, pane: DVec2) -> Self {
        let eye = Eye::new(&self, sphere, pane);
        let [right, down, _] = eye.axes_ned;
        let step = (right * drag.x + down * drag.y) * (eye.distance_m / eye.focal / sphere.radius_m);
        let target = (DVec3::from_array(self.target) - step).clamp_length_max(MAX_TARGET_RADII);
        Self { target: target.to_array(), ..self }
    }

    /// With a point in the middle of the pane.
    pub fn centred(self, ned_m: DVec3, sphere: BoundingSphere) -> Self {
        let target = ((ned_m - sphere.centre_ned_m) / sphere.radius_m).clamp_length_max(MAX_TARGET_RADII);
        Self { target: target.to_array(), ..self }
    }

    /// Zoomed in by a factor.
    pub fn zoomed(self, factor: f64) -> Self {
        Self { zoom: (self.zoom * factor).clamp(ZOOM[0], ZOOM[1]), ..self }
    }
}

/// The camera of an orbit. Eye axes are right, down, forward.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    position_ned_m: DVec3,
    /// Right, down and forward, unit vectors.
    axes_ned: [DVec3; 3],
    /// Focal length, points.
    focal: f64,
    /// Distance to the target.
    distance_m: f64,
}

impl Eye {
    /// For a pane of the given size in points.
    pub fn new(orbit: &Orbit, sphere: BoundingSphere, pane: DVec2) -> Self {
        let (east, north) = orbit.azimuth_deg.to_radians().sin_cos();
        let (sink, level) = orbit.depression_deg.to_radians().sin_cos();
        let forward = DVec3::new(level * north, level * east, sink);
        let right = DVec3::new(-east, north, 0.0);
        let half = HALF_FOV_DEG.to_radians();
        let distance_m = sphere.radius_m / half.sin() / orbit.zoom.clamp(ZOOM[0], ZOOM[1]);
        let target = sphere.centre_ned_m + sphere.radius_m * DVec3::from_array(orbit.target);
        Self {
            position_ned_m: target - distance_m * forward,
            axes_ned: [right, forward.cross(right), forward],
            focal: 0.5 * pane.min_element() / half.tan(),
            distance_m,
        }
    }

    /// A point in eye axes, metres from the eye.
    pub fn eye_from_ned(&self, ned_m: DVec3) -> DVec3 {
        self.rotate(ned_m - self.position_ned_m)
    }

    /// A direction in eye axes.
    pub fn rotate(&self, ned: DVec3) -> DVec3 {
        DVec3::from_array(self.axes_ned.map(|axis| axis.dot(ned)))
    }

    /// Whether a face across a NED axis through a point is seen from its outer side (`outward` is 1 along the
    /// axis, -1 against it).
    pub fn sees_face(&self, axis: usize, outward: f64, ned_m: DVec3) -> bool {
        (self.position_ned_m[axis] - ned_m[axis]) * outward > 0.0
    }

    /// Depth of the near plane, metres.
    pub fn near_m(&self) -> f64 {
        NEAR_SHARE * self.distance_m
    }

    /// Projects a point in eye axes, beyond [`Eye::near_m`], to points right and down from the middle of the
    /// pane.
    pub fn project(&self, eye_m: DVec3) -> DVec2 {
        self.focal * eye_m.truncate() / eye_m.z
    }

    /// Clips a convex face (or a line, given by two ends) in eye axes at the near plane.
    pub fn clip_near(&self, corners: &[DVec3]) -> Vec<DVec3> {
        let near_m = self.near_m();
        let mut clipped = Vec::with_capacity(corners.len() + 1);
        let edges = if corners.len() == 2 { 1 } else { corners.len() };
        for (index, &from) in corners.iter().enumerate() {
            let is_beyond = from.z >= near_m;
            if is_beyond {
                clipped.push(from);
            }
            let to = corners[(index + 1) % corners.len()];
            if index < edges && is_beyond != (to.z >= near_m) {
                clipped.push(from + (to - from) * ((near_m - from.z) / (to.z - from.z)));
            }
        }
        clipped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPHERE: BoundingSphere =
        BoundingSphere { centre_ned_m: DVec3::new(100.0, 200.0, -300.0), radius_m: 50.0 };
    const PANE: DVec2 = DVec2::new(400.0, 300.0);

    fn project(orbit: &Orbit, from_centre: DVec3) -> DVec2 {
        let eye = Eye::new(orbit, SPHERE, PANE);
        eye.project(eye.eye_from_ned(SPHERE.centre_ned_m + from_centre))
    }

    #[test]
    fn from_above_north_is_up_and_east_is_right() {
        let above = Orbit::from_above();
        assert!(project(&above, DVec3::ZERO).length() < 1e-9);
        let (north, east) = (project(&above, DVec3::X), project(&above, DVec3::Y));
        assert!(
            north.x.abs() < 1e-9 && north.y < 0.0 && east.x > 0.0 && east.y.abs() < 1e-9,
            "{north} {east}"
        );
        // 50 / sin 22.5 deg = 130.66 m away, 150 / tan 22.5 deg = 362.13 points: 2.7716 points a metre.
        assert!((east.x - 2.7716).abs() < 1e-3, "{east}");
    }

    #[test]
    fn at_zero_depression_up_is_up_on_the_pane() {
        for (azimuth_deg, right) in [(0.0, DVec3::Y), (90.0, DVec3::NEG_X), (180.0, DVec3::NEG_Y)] {
            let level = Orbit { azimuth_deg, depression_deg: 0.0, ..Orbit::default() };
            let (aside, up) = (project(&level, right), project(&level, DVec3::NEG_Z));
            assert!(
                aside.x > 0.0 && aside.y.abs() < 1e-9 && up.x.abs() < 1e-9 && up.y < 0.0,
                "{azimuth_deg}: {aside} {up}"
            );
        }
    }

    #[test]
    fn at_zoom_1_the_sphere_fits_the_pane_and_at_zoom_2_it_is_twice_as_large() {
        let one = Orbit { zoom: 1.0, ..Orbit::default() };
        let half = HALF_FOV_DEG.to_radians();
        let eye = Eye::new(&one, SPHERE, PANE);
        let [right, _, forward] = eye.axes_ned;
        // The outline of a sphere is nearer to the eye than its centre.
        let outline = SPHERE.centre_ned_m + SPHERE.radius_m * (right * half.cos() - forward * half.sin());
        assert!((eye.project(eye.eye_from_ned(outline)).x - 150.0).abs() < 1e-6);
        let nearer = project(&one.zoomed(2.0), right).x / project(&one, right).x;
        assert!((nearer - 2.0).abs() < 1e-9, "{nearer}");
        assert_eq!(one.zoomed(1e9).zoom, ZOOM[1]);
    }

    #[test]
    fn the_target_follows_a_pan_and_near_points_follow_a_rotation() {
        let orbit = Orbit { azimuth_deg: 40.0, depression_deg: 30.0, zoom: 3.0, target: [0.1, -0.2, 0.05] };
        let drag = DVec2::new(30.0, -20.0);
        let before = Eye::new(&orbit, SPHERE, PANE);
        let held = SPHERE.centre_ned_m + SPHERE.radius_m * DVec3::from_array(orbit.target);
        assert!(before.project(before.eye_from_ned(held)).length() < 1e-9);
        let panned = Eye::new(&orbit.panned(drag, SPHERE, PANE), SPHERE, PANE);
        assert!((panned.project(panned.eye_from_ned(held)) - drag).length() < 1e-6);
        let near = before.position_ned_m + 0.9 * before.distance_m * before.axes_ned[2];
        let turned = Eye::new(&orbit.rotated(DVec2::new(10.0, 0.0)), SPHERE, PANE);
        assert!(turned.project(turned.eye_from_ned(near)).x > 1.0, "to the right");
        let tilted = Eye::new(&orbit.rotated(DVec2::new(0.0, 10.0)), SPHERE, PANE);
        assert!(tilted.project(tilted.eye_from_ned(near)).y > 1.0, "down");
        let aside = SPHERE.centre_ned_m + DVec3::new(20.0, -10.0, 5.0);
        let centred = Eye::new(&orbit.centred(aside, SPHERE), SPHERE, PANE);
        assert!(centred.project(centred.eye_from_ned(aside)).length() < 1e-9);
        assert_eq!(orbit.rotated(DVec2::new(-200.0, 1e4)).depression_deg, 90.0);
        assert_eq!(orbit.rotated(DVec2::new(-200.0, 0.0)).azimuth_deg, 320.0);
    }

    #[test]
    fn lines_and_faces_are_clipped_at_the_near_plane() {
        let eye = Eye::new(&Orbit::default(), SPHERE, PANE);
        let near_m = eye.near_m();
        let [front, behind] = [DVec3::new(1.0, 0.0, 3.0 * near_m), DVec3::new(1.0, 2.0, -near_m)];
        let border = DVec3::new(1.0, 1.0, near_m);
        for (line, expected) in [([front, behind], [front, border]), ([behind, front], [border, front])] {
            let clipped = eye.clip_near(&line);
            assert!(
                clipped.len() == 2 && clipped.iter().zip(expected).all(|(a, b)| a.distance(b) < 1e-9),
                "{clipped:?}"
            );
        }
        assert!(eye.clip_near(&[behind, behind]).is_empty());
        let face = eye.clip_near(&[front, behind, front + DVec3::X]);
        assert!(face.len() == 4 && face.iter().all(|corner| corner.z >= near_m - 1e-12), "{face:?}");
        assert_eq!(eye.clip_near(&[front, front + DVec3::X, front + DVec3::Y]).len(), 3);
    }
}
