//! The eye of the 3D view, which goes around a point of the scene and looks at it: plain geometry, in
//! north-east-down metres and points of the screen.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// Half of the field of view along the shorter side of the pane, degrees.
const HALF_VIEW_DEG: f64 = 22.5;
/// Enlargement, at least and at most.
pub const ZOOM: [f64; 2] = [0.2, 500.0];
/// How far the look goes down, degrees: a little from below, too.
pub const DEPRESSION_DEG: [f64; 2] = [-30.0, 90.0];
/// Turn of a point of drag, degrees.
const TURN_DEG: f64 = 0.4;
/// What is nearer than this share of the distance to the middle is not drawn.
const NEAR: f64 = 0.01;
/// The middle stays within so many radii of the scene's.
const FARTHEST: f64 = 3.0;

/// Where the scene is seen from, by its size: it is of use for any scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Orbit {
    /// Direction of the look, degrees east of north.
    pub azimuth_deg: f64,
    /// How far it goes down, degrees: 90 is straight down.
    pub depression_deg: f64,
    /// Enlargement: at 1 all of the scene is in the pane.
    pub zoom: f64,
    /// What is in the middle: north, east, down from the scene's middle, in radii of the scene.
    pub middle: [f64; 3],
}

impl Default for Orbit {
    fn default() -> Self {
        Self { azimuth_deg: 25.0, depression_deg: 32.0, zoom: 1.2, middle: [0.0; 3] }
    }
}

/// A ball around all that is to be seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its middle.
    pub middle_ned_m: DVec3,
    /// Its radius.
    pub radius_m: f64,
}

impl Orbit {
    /// All of the scene, north up.
    pub fn from_above() -> Self {
        Self { azimuth_deg: 0.0, depression_deg: 90.0, zoom: 1.0, ..Self::default() }
    }

    /// After a drag: what is near follows the hand.
    pub fn turned(self, drag: DVec2) -> Self {
        let depression_deg =
            (self.depression_deg + TURN_DEG * drag.y).clamp(DEPRESSION_DEG[0], DEPRESSION_DEG[1]);
        Self { azimuth_deg: (self.azimuth_deg + TURN_DEG * drag.x).rem_euclid(360.0), depression_deg, ..self }
    }

    /// After a drag that takes what is in the middle along.
    pub fn panned(self, drag: DVec2, ball: Ball, pane: DVec2) -> Self {
        let eye = Eye::new(&self, ball, pane);
        let [right, down, _] = eye.axes_ned;
        let step = (right * drag.x + down * drag.y) * (eye.distance_m / eye.focal / ball.radius_m);
        let middle = (DVec3::from_array(self.middle) - step).clamp_length_max(FARTHEST);
        Self { middle: middle.to_array(), ..self }
    }

    /// With a place in the middle.
    pub fn centred(self, ned_m: DVec3, ball: Ball) -> Self {
        let middle = ((ned_m - ball.middle_ned_m) / ball.radius_m).clamp_length_max(FARTHEST);
        Self { middle: middle.to_array(), ..self }
    }

    /// Nearer by a factor.
    pub fn zoomed(self, factor: f64) -> Self {
        Self { zoom: (self.zoom * factor).clamp(ZOOM[0], ZOOM[1]), ..self }
    }
}

/// An eye with a pane in front of it.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    position_ned_m: DVec3,
    /// To the right, down, and forward.
    axes_ned: [DVec3; 3],
    /// Points on the pane of a tangent of 1.
    focal: f64,
    distance_m: f64,
}

impl Eye {
    /// For a pane of so many points.
    pub fn new(orbit: &Orbit, ball: Ball, pane: DVec2) -> Self {
        let (east, north) = orbit.azimuth_deg.to_radians().sin_cos();
        let (sink, level) = orbit.depression_deg.to_radians().sin_cos();
        let forward = DVec3::new(level * north, level * east, sink);
        let right = DVec3::new(-east, north, 0.0);
        let half = HALF_VIEW_DEG.to_radians();
        let distance_m = ball.radius_m / half.sin() / orbit.zoom.clamp(ZOOM[0], ZOOM[1]);
        let middle = ball.middle_ned_m + ball.radius_m * DVec3::from_array(orbit.middle);
        Self {
            position_ned_m: middle - distance_m * forward,
            axes_ned: [right, forward.cross(right), forward],
            focal: 0.5 * pane.min_element() / half.tan(),
            distance_m,
        }
    }

    /// Metres to the right, down and forward from the eye.
    pub fn seen(&self, ned_m: DVec3) -> DVec3 {
        self.turned(ned_m - self.position_ned_m)
    }

    /// A direction in the eye's axes.
    pub fn turned(&self, ned: DVec3) -> DVec3 {
        DVec3::from_array(self.axes_ned.map(|axis| axis.dot(ned)))
    }

    /// Whether a face across an axis of NED, through a place, is seen from the side that it looks to (1:
    /// along the axis, -1: against it).
    pub fn faces(&self, axis: usize, outward: f64, ned_m: DVec3) -> bool {
        (self.position_ned_m[axis] - ned_m[axis]) * outward > 0.0
    }

    /// Forward metres that something must be away to be drawn.
    pub fn near_m(&self) -> f64 {
        NEAR * self.distance_m
    }

    /// Points to the right and down from the middle of the pane of what is at least as far away as
    /// [`Eye::near_m`].
    pub fn place(&self, seen: DVec3) -> DVec2 {
        self.focal * seen.truncate() / seen.z
    }

    /// The part of a convex face (or of a line of two ends) that is far enough away to be drawn, in the eye's
    /// axes.
    pub fn clipped(&self, corners: &[DVec3]) -> Vec<DVec3> {
        let near_m = self.near_m();
        let mut kept = Vec::with_capacity(corners.len() + 1);
        let edges = if corners.len() == 2 { 1 } else { corners.len() };
        for (at, &from) in corners.iter().enumerate() {
            let is_in = from.z >= near_m;
            if is_in {
                kept.push(from);
            }
            let to = corners[(at + 1) % corners.len()];
            if at < edges && is_in != (to.z >= near_m) {
                kept.push(from + (to - from) * ((near_m - from.z) / (to.z - from.z)));
            }
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL: Ball = Ball { middle_ned_m: DVec3::new(100.0, 200.0, -300.0), radius_m: 50.0 };
    const PANE: DVec2 = DVec2::new(400.0, 300.0);

    fn place(orbit: &Orbit, from_middle: DVec3) -> DVec2 {
        let eye = Eye::new(orbit, BALL, PANE);
        eye.place(eye.seen(BALL.middle_ned_m + from_middle))
    }

    #[test]
    fn from_above_north_is_up_and_east_is_right() {
        let above = Orbit::from_above();
        assert!(place(&above, DVec3::ZERO).length() < 1e-9);
        let (north, east) = (place(&above, DVec3::X), place(&above, DVec3::Y));
        assert!(
            north.x.abs() < 1e-9 && north.y < 0.0 && east.x > 0.0 && east.y.abs() < 1e-9,
            "{north} {east}"
        );
        // 50 / sin 22.5 deg = 130.66 m away, 150 / tan 22.5 deg = 362.13 points: 2.7716 points a metre.
        assert!((east.x - 2.7716).abs() < 1e-3, "{east}");
    }

    #[test]
    fn looking_along_the_ground_up_is_up() {
        for (azimuth_deg, right) in [(0.0, DVec3::Y), (90.0, DVec3::NEG_X), (180.0, DVec3::NEG_Y)] {
            let level = Orbit { azimuth_deg, depression_deg: 0.0, ..Orbit::default() };
            let (aside, up) = (place(&level, right), place(&level, DVec3::NEG_Z));
            assert!(
                aside.x > 0.0 && aside.y.abs() < 1e-9 && up.x.abs() < 1e-9 && up.y < 0.0,
                "{azimuth_deg}: {aside} {up}"
            );
        }
    }

    #[test]
    fn at_zoom_1_the_ball_touches_the_pane_and_twice_as_near_it_is_twice_as_large() {
        let one = Orbit { zoom: 1.0, ..Orbit::default() };
        let half = HALF_VIEW_DEG.to_radians();
        let eye = Eye::new(&one, BALL, PANE);
        let [right, _, forward] = eye.axes_ned;
        // The outline of a ball is nearer to the eye than its middle.
        let outline = BALL.middle_ned_m + BALL.radius_m * (right * half.cos() - forward * half.sin());
        assert!((eye.place(eye.seen(outline)).x - 150.0).abs() < 1e-6);
        let nearer = place(&one.zoomed(2.0), right).x / place(&one, right).x;
        assert!((nearer - 2.0).abs() < 1e-9, "{nearer}");
        assert_eq!(one.zoomed(1e9).zoom, ZOOM[1]);
    }

    #[test]
    fn what_is_in_the_middle_follows_a_pan_and_what_is_near_a_turn() {
        let orbit = Orbit { azimuth_deg: 40.0, depression_deg: 30.0, zoom: 3.0, middle: [0.1, -0.2, 0.05] };
        let drag = DVec2::new(30.0, -20.0);
        let before = Eye::new(&orbit, BALL, PANE);
        let held = BALL.middle_ned_m + BALL.radius_m * DVec3::from_array(orbit.middle);
        assert!(before.place(before.seen(held)).length() < 1e-9);
        let panned = Eye::new(&orbit.panned(drag, BALL, PANE), BALL, PANE);
        assert!((panned.place(panned.seen(held)) - drag).length() < 1e-6);
        let near = before.position_ned_m + 0.9 * before.distance_m * before.axes_ned[2];
        let turned = Eye::new(&orbit.turned(DVec2::new(10.0, 0.0)), BALL, PANE);
        assert!(turned.place(turned.seen(near)).x > 1.0, "to the right");
        let tilted = Eye::new(&orbit.turned(DVec2::new(0.0, 10.0)), BALL, PANE);
        assert!(tilted.place(tilted.seen(near)).y > 1.0, "down");
        let aside = BALL.middle_ned_m + DVec3::new(20.0, -10.0, 5.0);
        let centred = Eye::new(&orbit.centred(aside, BALL), BALL, PANE);
        assert!(centred.place(centred.seen(aside)).length() < 1e-9);
        assert_eq!(orbit.turned(DVec2::new(-200.0, 1e4)).depression_deg, 90.0);
        assert_eq!(orbit.turned(DVec2::new(-200.0, 0.0)).azimuth_deg, 320.0);
    }

    #[test]
    fn what_is_behind_the_eye_is_cut_off() {
        let eye = Eye::new(&Orbit::default(), BALL, PANE);
        let near_m = eye.near_m();
        let [front, behind] = [DVec3::new(1.0, 0.0, 3.0 * near_m), DVec3::new(1.0, 2.0, -near_m)];
        let border = DVec3::new(1.0, 1.0, near_m);
        for (line, kept) in [([front, behind], [front, border]), ([behind, front], [border, front])] {
            let found = eye.clipped(&line);
            assert!(
                found.len() == 2 && found.iter().zip(kept).all(|(a, b)| a.distance(b) < 1e-9),
                "{found:?}"
            );
        }
        assert!(eye.clipped(&[behind, behind]).is_empty());
        let face = eye.clipped(&[front, behind, front + DVec3::X]);
        assert!(face.len() == 4 && face.iter().all(|corner| corner.z >= near_m - 1e-12), "{face:?}");
        assert_eq!(eye.clipped(&[front, front + DVec3::X, front + DVec3::Y]).len(), 3);
    }
}
