//! Models that stand far from the flight, mostly because their vertices have the coordinates of a map grid.

use camsim_core::{
    flight_log::FlightLog,
    scenario::{GltfSpec, Scenario},
    scene::{Aabb, Mesh},
};
use glam::DVec3;

use crate::text::wording::rounded;

/// Distance from the flight that is never far, metres.
const NEAR_M: f64 = 1000.0;
/// Sizes of a model from which it is far.
const FAR_SIZES: f64 = 20.0;
/// Distances of positions on the ground from the Earth's centre, metres.
const EARTH_RADII_M: std::ops::RangeInclusive<f64> = 6.35e6..=6.39e6;
/// Height that no position on the ground has, metres.
const HIGHEST_M: f64 = 9e3;
/// Spacing of 32-bit numbers from which it is reported, metres.
const COARSE_M: f64 = 0.01;

/// A copy of a model: where its origin stands, and a box around it, NED.
pub(super) struct Copy {
    pub origin_ned_m: DVec3,
    pub bounds: Aabb,
}

impl Copy {
    pub fn new(origin_ned_m: DVec3, meshes: &[Mesh]) -> Self {
        let bounds = meshes.iter().fold(Aabb::EMPTY, |all, mesh| all.union(&mesh.bounds()));
        Self { origin_ned_m, bounds }
    }

    fn size_m(&self) -> f64 {
        (self.bounds.max - self.bounds.min).length()
    }

    /// Horizontal distance from the flight.
    fn distance_m(&self, flight: &Aabb) -> f64 {
        let gap = (self.bounds.min - flight.max).max(flight.min - self.bounds.max).max(DVec3::ZERO);
        gap.x.hypot(gap.y)
    }
}

/// Notes about a model none of whose copies is near the flight, and about coordinates that are too large for their
/// numbers.
pub(super) fn notes(
    scenario: &Scenario,
    log: &FlightLog,
    spec: &GltfSpec,
    copies: &[Copy],
    spacing_m: f64,
) -> Vec<String> {
    let mut flight = Aabb::EMPTY;
    log.rows.iter().for_each(|row| flight.include(row.position_ned_m));
    let nearest = copies
        .iter()
        .filter(|copy| !copy.bounds.is_empty())
        .min_by(|a, b| a.distance_m(&flight).total_cmp(&b.distance_m(&flight)));
    let far = nearest.and_then(|copy| far_note(scenario, spec, copy, copy.distance_m(&flight)));
    let spacing_m = spacing_m * spec.scale;
    let coarse = (spacing_m > COARSE_M).then(|| {
        format!(
            "its vertices have coordinates so large that 32-bit floats hold them only to {} m: subtract the coordinates \
             of a position nearby in the program that made the model, and give that position as at",
            rounded(spacing_m)
        )
    });
    far.into_iter().chain(coarse).collect()
}

/// Whether vertices lie as far from their origin as positions on the ground from the Earth's centre, NED.
/// Coordinates of a map grid may have that length too, but are low.
fn is_earth_centred(from_origin: DVec3) -> bool {
    EARTH_RADII_M.contains(&from_origin.length()) && from_origin.z.abs() > HIGHEST_M
}

fn far_note(scenario: &Scenario, spec: &GltfSpec, copy: &Copy, distance_m: f64) -> Option<String> {
    let centre = copy.bounds.centre();
    let from_origin = centre - copy.origin_ned_m;
    let km = rounded(distance_m / 1e3);
    if is_earth_centred(from_origin) && centre.length() > 0.5 * from_origin.length() {
        return Some(format!(
            "the model is {km} km from the flight: its vertices lie {} km from its own origin, as far as the ground from \
             the Earth's centre, and look like earth-centred coordinates (ECEF): subtract those of a position of the model, \
             turn it so that up is +Y and north is -Z, and place it with geodetic, the latitude, longitude and height of \
             that position",
            rounded(from_origin.length() / 1e3)
        ));
    }
    if distance_m > NEAR_M.max(FAR_SIZES * copy.size_m())
        && from_origin.truncate().length() > 0.5 * distance_m
    {
        // Puts the middle of its lowest points at the origin.
        let at = copy.origin_ned_m - DVec3::new(centre.x, centre.y, copy.bounds.max.z);
        return Some(format!(
            "the model is {km} km from the flight: its vertices lie {} m north and {} m east of its own origin and look \
             like coordinates of a map grid; at = [{:.1}, {:.1}, {:.1}] puts its foot at the local origin",
            rounded(from_origin.x),
            rounded(from_origin.y),
            at.x,
            at.y,
            at.z
        ));
    }
    let focal_px =
        scenario.camera.zoom.iter().map(|zoom| zoom.focal_px[0]).fold(scenario.camera.focal_px[0], f64::max);
    let largest_px = focal_px * copy.size_m() / distance_m.max(1e-9);
    (distance_m > NEAR_M && largest_px < 1.0).then(|| {
        let key = match (&spec.placements, spec.geodetic) {
            (Some(_), _) => "placements",
            (None, Some(_)) => "geodetic",
            (None, None) => "at",
        };
        format!(
            "the model is {km} km from the flight and looks smaller than a pixel from there ({} m in size): check \
             scene.gltf.{key} and scale",
            rounded(copy.size_m())
        )
    })
}
