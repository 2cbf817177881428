//! The sides of a cube about a camera.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DQuat, DVec3};

/// A side of the cube about a camera's optical centre, by where it is seen in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Face {
    /// Along the optical axis.
    Front,
    /// Towards the right border.
    Right,
    /// Towards the left border.
    Left,
    /// Towards the lower border.
    Bottom,
    /// Towards the upper border.
    Top,
    /// Against the optical axis.
    Back,
}

impl Face {
    /// All sides.
    pub const ALL: [Self; 6] = [Self::Front, Self::Right, Self::Left, Self::Bottom, Self::Top, Self::Back];

    /// The side that a direction in the camera's axes leads to. Of several the first counts.
    #[must_use]
    pub fn of(direction: DVec3) -> Self {
        let along = |face: Self| direction.dot(face.axis());
        Self::ALL
            .into_iter()
            .fold(Self::Front, |best, face| if along(face) > along(best) { face } else { best })
    }

    /// Its optical axis in those of the whole camera.
    #[must_use]
    pub fn axis(self) -> DVec3 {
        match self {
            Self::Front => DVec3::Z,
            Self::Right => DVec3::X,
            Self::Left => DVec3::NEG_X,
            Self::Bottom => DVec3::Y,
            Self::Top => DVec3::NEG_Y,
            Self::Back => DVec3::NEG_Z,
        }
    }

    /// Rotation from its axes to those of the whole camera.
    #[must_use]
    pub fn camera_from_face(self) -> DQuat {
        match self {
            Self::Front => DQuat::IDENTITY,
            Self::Right => DQuat::from_rotation_y(FRAC_PI_2),
            Self::Left => DQuat::from_rotation_y(-FRAC_PI_2),
            Self::Bottom => DQuat::from_rotation_x(-FRAC_PI_2),
            Self::Top => DQuat::from_rotation_x(FRAC_PI_2),
            Self::Back => DQuat::from_rotation_y(PI),
        }
    }

    /// The word for it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Right => "right",
            Self::Left => "left",
            Self::Bottom => "bottom",
            Self::Top => "top",
            Self::Back => "back",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_turned_to_the_sides_that_their_names_say() {
        for face in Face::ALL {
            let turned = face.camera_from_face() * DVec3::Z;
            assert!(turned.distance(face.axis()) < 1e-15, "{face:?}: {turned}");
            assert_eq!(Face::of(turned + 0.4 * face.axis().any_orthogonal_vector()), face);
        }
    }
}
