//! What it costs that the sky begins elsewhere in an ideal frame.
//!
//! What is beyond it is as far as can be: from another position the surface before it is elsewhere by all of its
//! own parallax. Pixels that first look for a surface within [`camsim_core::temporal::SKY_REACH_PX`] of where
//! it is go with it; farther away the pixels between show sky for surface or surface for sky.

#[cfg(test)]
mod tests;

use camsim_core::{
    pose::CameraPose,
    scene::{TerrainDetail, TerrainHit},
};
use glam::{DVec2, DVec3};

use crate::{
    ir::{margins, seen_plane::SeenPlane},
    view::neighbourhood::skyline::{Skyline, SkylinePoint},
};

/// From so many crossings on they give its length more surely than the probes near it do.
const ENOUGH: f64 = 24.0;
/// Part of [`camsim_core::temporal::SKY_REACH_PX`] at which a straight border is found whichever direction it runs in:
/// that of eight directions.
const REACHED: f64 = 0.92;

impl SkylinePoint {
    /// Squared error that a pixel across the skyline has of its squared contrast, all such pixels together,
    /// in the frame of another camera.
    fn wrong_px(&self, key_pose: &CameraPose, focal_px: DVec2, plane: &SeenPlane, reach_px: f64) -> f64 {
        let (rotation, shift) = self.pose.relative_to(key_pose);
        let of_ray = rotation * self.uv.extend(1.0);
        let moved_px = |inverse_depth: f64| {
            let in_key = of_ray + inverse_depth * shift;
            focal_px * (in_key.truncate() / in_key.z - of_ray.truncate() / of_ray.z)
        };
        let guess = plane.seen_from(&self.pose).dot(self.uv.extend(1.0)).max(0.0);
        let moved = moved_px(self.inverse_depth);
        let (moved_px, guess_px, taken_px) = match self.normal {
            Some(normal) => (
                normal.dot(moved),
                normal.dot(moved_px(guess)),
                normal.dot(moved_px(self.followed_inverse_depth)),
            ),
            // Straight out, and never found.
            None => (moved.length(), f64::INFINITY, 0.0),
        };
        // Looks after the first begin with what that found: with nothing, if it was the sky.
        let wrong_px = [guess_px, 0.0]
            .map(|guess_px| wrong_px(moved_px, guess_px, taken_px, reach_px))
            .into_iter()
            .fold(0.0, f64::max);
        // From a camera that has it behind it: of all that it could be.
        if !wrong_px.is_finite() {
            return 1.0;
        }
        wrong_px * self.spread(moved_px) + self.missed_px(reach_px)
    }

    /// Squared error of pixels that the skyline only comes over before or after mid-exposure, when they look
    /// for it and find the sky alone: each lacks what it is covered for longer than at the reach, `integral
    /// of ((swept / 2 - s) / swept)^2 ds` from there on.
    fn missed_px(&self, reach_px: f64) -> f64 {
        let beyond_px = (0.5 * self.swept_px - REACHED * reach_px).max(0.0);
        if beyond_px > 0.0 { beyond_px.powi(3) / (3.0 * self.swept_px.powi(2)) } else { 0.0 }
    }

    /// Part that is left of what is so wide by the exposure, which spreads it over its path.
    fn spread(&self, px: f64) -> f64 {
        let width_px = px.abs().max(1.0);
        width_px / (width_px + self.path_px)
    }

    /// Squared error of pixels across the skyline, of their squared contrast, where the terrain is drawn
    /// higher or lower there.
    fn lowered_px(&self, detail: &TerrainDetail<'_>, focal_px: DVec2) -> f64 {
        /// From above the point, metres: as far as may be, and near enough for its digits.
        const ABOVE_M: f64 = 1000.0;
        let Some((hit, point_m)) = &self.ground else { return 0.0 };
        let down_m =
            detail.drawn_t(&TerrainHit { t: ABOVE_M, ..*hit }, *point_m - ABOVE_M * DVec3::Z, DVec3::Z)
                - ABOVE_M;
        let px = |point_m: DVec3| {
            let in_camera = self.pose.ned_from_camera.inverse() * (point_m - self.pose.position_ned_m);
            focal_px * in_camera.truncate() / in_camera.z
        };
        let moved = px(*point_m + down_m * DVec3::Z) - px(*point_m);
        let moved_px = self.normal.map_or(moved.length(), |normal| normal.dot(moved).abs());
        if moved_px.is_finite() {
            moved_px * moved_px / moved_px.max(1.0) * self.spread(moved_px)
        } else {
            1.0
        }
    }
}

/// Pixels across a skyline, each by the square of what it shows too much or too little of the surface, where
/// that is moved towards the sky by so much, looked for where a guess of its depth has it, and what is beside
/// it moves by so much.
///
/// A pixel with its middle `s` beyond the skyline looks at `s + guess`. If the surface is there, up to where
/// it has moved, the pixel follows it and shows what it should. If it is within reach the pixel moves as the
/// surface there does, and finds the skyline moved by what that lacks. If not it follows the sky, which does
/// not move, and shows what has come over it.
fn wrong_px(moved_px: f64, guess_px: f64, taken_px: f64, reach_px: f64) -> f64 {
    let found_px = moved_px - guess_px;
    let beyond_reach_px = found_px + REACHED * reach_px;
    off_px(moved_px - taken_px, [found_px, beyond_reach_px])
        + off_px(moved_px, [beyond_reach_px, f64::INFINITY])
}

/// Squared error of pixels with their middles between two positions, that show the skyline moved by so much.
fn off_px(moved_px: f64, [from_px, to_px]: [f64; 2]) -> f64 {
    const STEPS: u32 = 32;
    let covered = |beyond_px: f64| (0.5 - beyond_px).clamp(0.0, 1.0);
    let from_px = from_px.max(-0.5 + moved_px.min(0.0));
    let step_px = (to_px.min(0.5 + moved_px.max(0.0)) - from_px).max(0.0) / f64::from(STEPS);
    let positions = (0..STEPS).map(|k| from_px + step_px * (f64::from(k) + 0.5));
    positions.map(|s| (covered(s - moved_px) - covered(s)).powi(2) * step_px).sum()
}

impl Skyline {
    /// Mean squared error over the picture, of the linear range, where the ideal frame is that of a camera
    /// elsewhere and look-ups of depth begin with a plane.
    pub fn strips(&self, key_pose: &CameraPose, plane: &SeenPlane) -> f64 {
        let of_point = |(times, point): &(f64, SkylinePoint)| {
            times * point.contrast2 * point.wrong_px(key_pose, self.focal_px, plane, self.reach_px)
                / self.line_length_px(point.normal).max(1.0)
        };
        margins::SKYLINE * margins::SKYLINE * self.points.iter().map(of_point).sum::<f64>()
    }

    /// Squared contrast of it, times its length in pixels, mean over the pixels of the picture, that there
    /// may well be; `None` where few lines cross it.
    pub fn steps(&self) -> Option<f64> {
        let of_point = |(times, point): &(f64, SkylinePoint)| {
            times * point.contrast2 / self.line_length_px(point.normal).max(1.0)
        };
        let crossings: f64 = self.points.iter().map(|(times, _)| times).sum();
        (crossings >= ENOUGH).then(|| {
            (1.0 + margins::STANDARD_ERRORS / crossings.sqrt())
                * self.points.iter().map(of_point).sum::<f64>()
        })
    }

    /// Mean squared error over the picture where the skyline is a terrain that is drawn coarser than it is.
    pub fn lowered(&self, detail: &TerrainDetail<'_>) -> f64 {
        let of_point = |(times, point): &(f64, SkylinePoint)| {
            times * point.contrast2 * point.lowered_px(detail, self.focal_px)
                / self.line_length_px(point.normal).max(1.0)
        };
        margins::SKYLINE_OF_TERRAIN
            * margins::SKYLINE_OF_TERRAIN
            * self.points.iter().map(of_point).sum::<f64>()
    }
}
