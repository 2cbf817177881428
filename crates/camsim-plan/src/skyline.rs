//! Where the sky begins, and what it costs that it begins elsewhere in an ideal frame.
//!
//! Of 430 probes one stands within 3 px of 100 px of skyline, which may be the strongest contrast of a
//! picture. Lines tell of it from farther away: of straight lines s all over an area A, a skyline of length L
//! whose normal is n crosses `L sum |s.n| / A`. The lines are those from each probe to its neighbours: no ray
//! is needed to know which of them cross it an odd number of times, and halving finds where some do, and
//! which way it runs there.
//!
//! What is beyond it is as far as can be: from another place the surface before it is elsewhere by all of its
//! own parallax. Pixels that first look for a surface within [`SKY_REACH_PX`] of where it is go with it;
//! farther away the pixels between show sky for surface or surface for sky.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{SeenPlane, around::Search, contours::UNSURE, probes::Probe, prospect::path_px};
use camsim_core::{
    pose::CameraPose,
    scene::{TerrainDetail, TerrainHit},
    silhouette::NEAR_PX,
    temporal::SKY_REACH_PX,
};

/// Times what is expected: of some places, between which a skyline is more rugged.
const SAFETY: f64 = 1.5;
/// The same of a ground that is drawn coarser than it is.
const SAFETY_OF_GROUND: f64 = 1.2;
/// Neighbours are nearer than so many sides of a probe's part of the picture.
const NEIGHBOURS: f64 = 1.6;
/// Crossings that are looked at, of all that there are.
const MOST_LOOKS: usize = 24;
/// From so many on they tell of its length more surely than the probes near it do.
const ENOUGH: f64 = 24.0;
/// Halvings from probe to probe, and from one direction to the next of those that are asked around a place.
const HALVINGS: u32 = 8;
const HALVINGS_AROUND: u32 = 4;
const DIRECTIONS: u32 = 8;
/// Part of [`SKY_REACH_PX`] at which a straight border is found whichever way it runs: that of eight
/// directions.
const REACHED: f64 = 0.92;
/// Directions across it that are told apart.
const ACROSS: usize = 12;

/// The skyline that a frame's probes find, wherever the ideal frame is taken.
#[derive(Clone, Debug, Default)]
pub(super) struct Skyline {
    /// Each with the crossings that it stands for.
    found: Vec<(f64, Place)>,
    /// Length of the lines that would cross it, across each of [`ACROSS`] directions of a half turn, pixels.
    across_px: [f64; ACROSS],
    /// Of the camera.
    focal_px: DVec2,
    /// [`SKY_REACH_PX`], or 0 where pixels of the sky go with nothing.
    reach_px: f64,
}

/// A place of it.
#[derive(Clone, Debug)]
struct Place {
    /// What is there: the pixel, its camera and ray, and how near the surface is.
    pixel: [u32; 2],
    pose: CameraPose,
    uv: DVec2,
    inverse_depth: f64,
    /// How near the surface is that pixels of the sky there go with.
    taken: f64,
    /// Across the skyline, towards the sky, where that is known.
    normal: Option<DVec2>,
    /// Where the ground is met there, and its place.
    ground: Option<(TerrainHit, DVec3)>,
    /// Squared contrast, of the linear range, and path over the exposure, pixels of the camera's focal
    /// length.
    contrast2: f64,
    path_px: f64,
    /// How far it moves over the exposure before the sky.
    swept_px: f64,
}

impl Place {
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
            Some(normal) => {
                (normal.dot(moved), normal.dot(moved_px(guess)), normal.dot(moved_px(self.taken)))
            }
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

    /// The same of pixels that the skyline only comes over before or after mid-exposure, when they look for
    /// it and find the sky alone: each lacks what it is covered for longer than at the reach, `integral of
    /// ((swept / 2 - s) / swept)^2 ds` from there on.
    fn missed_px(&self, reach_px: f64) -> f64 {
        let beyond_px = (0.5 * self.swept_px - REACHED * reach_px).max(0.0);
        if beyond_px > 0.0 { beyond_px.powi(3) / (3.0 * self.swept_px.powi(2)) } else { 0.0 }
    }

    /// Part that is left of what is so wide by the exposure, which spreads it over its path.
    fn spread(&self, px: f64) -> f64 {
        let width_px = px.abs().max(1.0);
        width_px / (width_px + self.path_px)
    }

    /// The same as `wrong_px` of a ground that is drawn higher or lower there.
    fn lowered_px(&self, detail: &TerrainDetail<'_>, focal_px: DVec2) -> f64 {
        /// From above the place, metres: as far as may be, and near enough for its digits.
        const ABOVE_M: f64 = 1000.0;
        let Some((hit, at_m)) = &self.ground else { return 0.0 };
        let down_m = detail.drawn_t(&TerrainHit { t: ABOVE_M, ..*hit }, *at_m - ABOVE_M * DVec3::Z, DVec3::Z)
            - ABOVE_M;
        let px = |at_m: DVec3| {
            let in_camera = self.pose.ned_from_camera.inverse() * (at_m - self.pose.position_ned_m);
            focal_px * in_camera.truncate() / in_camera.z
        };
        let moved = px(*at_m + down_m * DVec3::Z) - px(*at_m);
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
/// it moved by so much.
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

/// The same of pixels with their middles between two places, that show the skyline moved by so much.
fn off_px(moved_px: f64, [from_px, to_px]: [f64; 2]) -> f64 {
    const STEPS: u32 = 32;
    let covered = |beyond_px: f64| (0.5 - beyond_px).clamp(0.0, 1.0);
    let from_px = from_px.max(-0.5 + moved_px.min(0.0));
    let step_px = (to_px.min(0.5 + moved_px.max(0.0)) - from_px).max(0.0) / f64::from(STEPS);
    let places = (0..STEPS).map(|k| from_px + step_px * (f64::from(k) + 0.5));
    places.map(|s| (covered(s - moved_px) - covered(s)).powi(2) * step_px).sum()
}

impl Skyline {
    /// With what another frame's probes find.
    pub fn and(mut self, other: Self) -> Self {
        self.found.extend(other.found);
        let across_px = std::array::from_fn(|k| self.across_px[k] + other.across_px[k]);
        Self { across_px, ..self }
    }

    /// The same as cameras elsewhere would see it.
    pub fn seen_from(&self, pose: impl Fn([u32; 2]) -> CameraPose) -> Self {
        let seen =
            |(times, place): &(f64, Place)| (*times, Place { pose: pose(place.pixel), ..place.clone() });
        Self { found: self.found.iter().map(seen).collect(), ..*self }
    }

    /// Mean squared error over the picture, of the linear range, where the ideal frame is that of a camera
    /// elsewhere and look-ups of depth begin with a plane.
    pub fn strips(&self, key_pose: &CameraPose, plane: &SeenPlane) -> f64 {
        let of = |(times, place): &(f64, Place)| {
            times * place.contrast2 * place.wrong_px(key_pose, self.focal_px, plane, self.reach_px)
                / self.looked_px(place.normal).max(1.0)
        };
        SAFETY * SAFETY * self.found.iter().map(of).sum::<f64>()
    }

    /// Squared contrast of it, times its length in pixels, mean over the pixels of the picture, that there
    /// may well be; `None` where few lines cross it.
    pub fn steps(&self) -> Option<f64> {
        let of =
            |(times, place): &(f64, Place)| times * place.contrast2 / self.looked_px(place.normal).max(1.0);
        let crossings: f64 = self.found.iter().map(|(times, _)| times).sum();
        (crossings >= ENOUGH)
            .then(|| (1.0 + UNSURE / crossings.sqrt()) * self.found.iter().map(of).sum::<f64>())
    }

    /// The same where it is a ground that is drawn coarser than it is.
    pub fn lowered(&self, detail: &TerrainDetail<'_>) -> f64 {
        let of = |(times, place): &(f64, Place)| {
            times * place.contrast2 * place.lowered_px(detail, self.focal_px)
                / self.looked_px(place.normal).max(1.0)
        };
        SAFETY_OF_GROUND * SAFETY_OF_GROUND * self.found.iter().map(of).sum::<f64>()
    }

    /// Length of the lines across a direction, or any.
    fn looked_px(&self, normal: Option<DVec2>) -> f64 {
        let Some(normal) = normal else { return self.across_px.iter().sum::<f64>() / ACROSS as f64 };
        let turn = ACROSS as f64 * normal.to_angle().rem_euclid(PI) / PI;
        let (below, share) = (turn.floor(), turn.fract());
        let [below, above] = [below, below + 1.0].map(|turn| self.across_px[turn as usize % ACROSS]);
        below + (above - below) * share
    }
}

impl Search<'_> {
    /// What the probes find; `is_sky` of each.
    pub fn skyline(&self, is_sky: &[bool]) -> Skyline {
        let (mut across_px, mut crossed) = ([0.0; ACROSS], Vec::new());
        let most_px = NEIGHBOURS * self.reach.probe_px;
        let directions: [DVec2; ACROSS] =
            std::array::from_fn(|k| DVec2::from_angle(PI * k as f64 / ACROSS as f64));
        let at = |probe: &Probe| DVec2::new(f64::from(probe.pixel[0]), f64::from(probe.pixel[1]));
        for (k, (one, one_is_sky)) in self.reach.probes.iter().zip(is_sky).enumerate() {
            for (other, other_is_sky) in self.reach.probes.iter().zip(is_sky).skip(k + 1) {
                let line_px = at(one) - at(other);
                if line_px.length_squared() > most_px * most_px {
                    continue;
                }
                across_px
                    .iter_mut()
                    .zip(directions)
                    .for_each(|(px, direction)| *px += line_px.dot(direction).abs());
                if one_is_sky != other_is_sky {
                    crossed.push(if *one_is_sky { [one, other] } else { [other, one] }.map(at));
                }
            }
        }
        let each = crossed.len().div_ceil(MOST_LOOKS).max(1);
        let places: Vec<Option<Place>> = crossed
            .par_iter()
            .step_by(each)
            .map(|[sky_px, surface_px]| self.place_between(*sky_px, *surface_px))
            .collect();
        let times = crossed.len() as f64 / places.len().max(1) as f64;
        Skyline {
            found: places.into_iter().flatten().map(|place| (times, place)).collect(),
            across_px,
            focal_px: self.reach.camera.focal_px,
            reach_px: if self.surfaces.blends() { 0.0 } else { SKY_REACH_PX },
        }
    }

    /// Where the sky begins between a pixel that shows it and one that does not.
    fn place_between(&self, sky_px: DVec2, surface_px: DVec2) -> Option<Place> {
        let [sky_px, surface_px] = self.halve(sky_px, surface_px)?;
        let (pose, uv, mid_s) = self.look_at(surface_px)?;
        let way_ned = |uv: DVec2| pose.ned_from_camera * uv.extend(1.0);
        let met = self.surfaces.meet(pose.position_ned_m, way_ned(uv))?;
        let light = |uv: DVec2, met| {
            self.surfaces.light(pose.position_ned_m, way_ned(uv), met, uv.extend(1.0).length()).color
        };
        let contrast = light(uv, Some(&met)) - light(self.reach.camera.unproject(sky_px)?, None);
        let pixel = surface_px.round().max(DVec2::ZERO).to_array().map(|px| px as u32);
        let focal_px = self.reach.camera.focal_px;
        let normal = self.normal(surface_px);
        Some(Place {
            pixel,
            pose,
            uv,
            inverse_depth: met.depth_m.recip(),
            taken: self.taken(surface_px, normal).unwrap_or(met.depth_m.recip()),
            normal,
            ground: met.terrain.map(|hit| (hit, pose.position_ned_m + met.depth_m * way_ned(uv))),
            contrast2: (self.gain)(pixel).powi(2) * contrast.length_squared() / 3.0,
            swept_px: self.swept_px(mid_s, uv, met.depth_m.recip(), normal),
            path_px: path_px(self.path, mid_s, self.shutter.exposure_s(), uv, met.depth_m.recip(), focal_px)
                .0
                .length(),
        })
    }

    /// Across the skyline, if it passes once through a circle around one of its places as far away as pixels
    /// at it are.
    fn normal(&self, at_px: DVec2) -> Option<DVec2> {
        let place = |turns: f64| at_px + f64::from(NEAR_PX) * DVec2::from_angle(TAU * turns);
        let turns = |k: u32| f64::from(k) / f64::from(DIRECTIONS);
        let is_sky = (0..DIRECTIONS).map(|k| self.is_sky(place(turns(k)))).collect::<Option<Vec<bool>>>()?;
        let ends: Vec<u32> = (0..DIRECTIONS)
            .filter(|&k| is_sky[k as usize] != is_sky[((k + 1) % DIRECTIONS) as usize])
            .collect();
        let &[one, other] = ends.as_slice() else { return None };
        let end = |k: u32| {
            let (mut from, mut to) = (turns(k), turns(k + 1));
            for _ in 0..HALVINGS_AROUND {
                let middle = 0.5 * (from + to);
                *(if self.is_sky(place(middle))? == is_sky[k as usize] { &mut from } else { &mut to }) =
                    middle;
            }
            self.reach.camera.unproject(place(from))
        };
        let uv_of_sky = {
            let sky: DVec2 =
                (0..DIRECTIONS).filter(|&k| is_sky[k as usize]).map(|k| place(turns(k)) - at_px).sum();
            self.reach.camera.unproject(at_px + sky.normalize_or_zero() * f64::from(NEAR_PX))?
        };
        let across = (self.reach.camera.focal_px * (end(one)? - end(other)?)).perp().try_normalize()?;
        let towards_sky = self.reach.camera.focal_px * (uv_of_sky - self.reach.camera.unproject(at_px)?);
        Some(across * across.dot(towards_sky).signum())
    }

    /// How far something moves before the sky over the exposure, across the skyline where that is known: by
    /// where the camera goes.
    fn swept_px(&self, mid_s: f64, uv: DVec2, inverse_depth: f64, normal: Option<DVec2>) -> f64 {
        let half_s = 0.5 * self.shutter.exposure_s();
        if half_s == 0.0 {
            return 0.0;
        }
        let mid = self.path.pose(mid_s);
        let moved = |t_s: f64| {
            let shift = mid.relative_to(&self.path.pose(t_s)).1;
            self.reach.camera.focal_px * inverse_depth * (shift.truncate() - shift.z * uv)
        };
        let swept = moved(mid_s + half_s) - moved(mid_s - half_s);
        normal.map_or(swept.length(), |normal| normal.dot(swept).abs())
    }

    /// How near the surface is, as far behind the skyline as pixels of the sky look for it.
    fn taken(&self, at_px: DVec2, normal: Option<DVec2>) -> Option<f64> {
        let (pose, uv, _) = self.look_at(at_px)?;
        let behind = uv - SKY_REACH_PX * normal? / self.reach.camera.focal_px;
        Some(
            self.surfaces
                .meet(pose.position_ned_m, pose.ned_from_camera * behind.extend(1.0))?
                .depth_m
                .recip(),
        )
    }

    fn halve(&self, mut sky_px: DVec2, mut surface_px: DVec2) -> Option<[DVec2; 2]> {
        for _ in 0..HALVINGS {
            let middle = sky_px.midpoint(surface_px);
            *(if self.is_sky(middle)? { &mut sky_px } else { &mut surface_px }) = middle;
        }
        Some([sky_px, surface_px])
    }

    fn is_sky(&self, at_px: DVec2) -> Option<bool> {
        let (pose, uv, _) = self.look_at(at_px)?;
        Some(self.surfaces.meet(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0)).is_none())
    }

    /// The camera and ray of a place of the picture, and its instant.
    fn look_at(&self, at_px: DVec2) -> Option<(CameraPose, DVec2, f64)> {
        let last = self.reach.camera.size_px.map(|side| f64::from(side - 1));
        let [x, y] = [0, 1].map(|axis: usize| at_px[axis].round().clamp(0.0, last[axis]) as u32);
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
        Some((self.path.pose(mid_s), self.reach.camera.unproject(at_px)?, mid_s))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use super::*;
    use crate::{
        LensReach,
        contours::tests::{SPEED_M_S, flying_east, flying_east_from},
        surfaces::Surfaces,
    };
    use camsim_core::{
        camera::CameraModel,
        scenario::{LensModel, ShutterSpec},
        scene::{Encoding, Mesh, Scene, Terrain, Texture},
        shutter::Shutter,
    };

    const FOCAL_PX: f64 = 200.0;

    /// A black board 100 m below the camera, of so many pixels a side, the sky beyond it; flying east, with
    /// the ideal frame of so long after. Of all probes, or of two halves.
    struct Board {
        side_px: f64,
        others: Vec<Mesh>,
        exposure_ms: f64,
        gain: f64,
        by_halves: bool,
    }

    const BOARD: Board =
        Board { side_px: 200.0, others: Vec::new(), exposure_ms: 0.0, gain: 1.0, by_halves: false };

    fn found(Board { side_px, others, exposure_ms, gain, by_halves }: Board, key_s: f64) -> f64 {
        let black = Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear));
        let board = Mesh::level_picture(black, DVec3::new(0.0, 0.0, -50.0), 100.0 * side_px / FOCAL_PX);
        let scene =
            Scene { meshes: [vec![board], others].concat(), sky_linear: [1.0; 3], ..Scene::default() };
        let path = flying_east();
        let shutter =
            Shutter::from_spec(&ShutterSpec { exposure_ms, ..ShutterSpec::default() }, 5.0, [400, 300])
                .unwrap();
        let camera = CameraModel::new([400, 300], [FOCAL_PX; 2], None, LensModel::Pinhole, &[]).unwrap();
        let (reach, surfaces) = (LensReach::new(Arc::new(camera)).unwrap(), Surfaces::new(Arc::new(scene)));
        let skyline = |reach: &LensReach| {
            let gain = |_: [u32; 2]| gain;
            let search = Search {
                reach,
                surfaces: &surfaces,
                path: &path,
                shutter: &shutter,
                stamp_s: 0.0,
                gain: &gain,
            };
            search.look_around().skyline
        };
        let half = |odd: bool| skyline(&reach.with_half_the_probes(odd));
        let found = if by_halves { half(false).and(half(true)) } else { skyline(&reach) };
        let key_pose = path.pose(key_s);
        // Ten times as near as it is: looked for there, nobody finds the border that has come nearer to the
        // sky.
        let plane = SeenPlane { camera: key_pose, normal_per_m: 0.1 * DVec3::Z };
        found.strips(&key_pose, &plane)
    }

    #[test]
    fn a_skyline_that_is_elsewhere_in_the_ideal_frame_is_found_however_narrow_its_strip() {
        // Of the board's two borders across the flight, each of which moves towards the sky from one of two
        // frames, and with white beyond black. Straight and along rows and columns, as the probes nearly are,
        // they are found with the most scatter; and at the edges of the picture there are fewer lines. Over
        // an exposure these move by as much as they are displaced in as long.
        for (key_s, exposure_ms) in [(0.005, 0.0), (0.05, 0.0), (0.1, 0.0), (0.1, 20.0)] {
            let [width_px, path_px] = [key_s, 1e-3 * exposure_ms].map(|s| FOCAL_PX * SPEED_M_S * s / 100.0);
            // The border on the other side has gone, and later looks, which begin with nothing, find that up
            // to the reach.
            let wrong_px =
                (all_of(width_px) + gone(width_px)) * width_px.max(1.0) / (width_px.max(1.0) + path_px);
            for by_halves in [false, true] {
                let sides_px = [150.0, 171.0, 190.0, 203.0, 222.0, 240.0, 261.0];
                let ratios = sides_px.map(|side_px| {
                    let expected = SAFETY * SAFETY * side_px * 2.0 * wrong_px / 120_000.0;
                    let found = |key_s| found(Board { side_px, exposure_ms, by_halves, ..BOARD }, key_s);
                    (found(key_s) + found(-key_s)) / expected
                });
                let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
                assert!((1.0..1.35).contains(&mean), "{key_s} s, {width_px} px: {ratios:?}");
                assert!(
                    ratios.iter().all(|ratio| (0.8..1.7).contains(ratio)),
                    "{key_s} s, {width_px} px: {ratios:?}"
                );
            }
        }
    }

    /// Of those beyond the reach where a surface has gone by so much.
    fn gone(moved_px: f64) -> f64 {
        (moved_px - REACHED * SKY_REACH_PX - 0.5 + 1.0 / 3.0).max(0.0)
    }

    /// Of all pixels, in closed form.
    fn all_of(moved_px: f64) -> f64 {
        if moved_px < 1.0 { moved_px * moved_px - moved_px.powi(3) / 3.0 } else { moved_px - 1.0 / 3.0 }
    }

    /// Of those with their middles beyond the skyline.
    fn exactly(moved_px: f64) -> f64 {
        let w = moved_px.abs();
        match (moved_px > 0.0, w) {
            (true, ..=0.5) => w * w / 2.0 + w.powi(3) / 3.0,
            (true, 1.0..) => w - 0.375,
            (false, ..=0.5) => w * w / 2.0 - w.powi(3) * 2.0 / 3.0,
            (false, 0.5..) => 1.0 / 24.0,
            _ => panic!("between"),
        }
    }

    #[test]
    fn pixels_that_find_the_surface_show_what_they_should() {
        for moved_px in [0.02, 0.2, 0.5, 1.0, -0.02, -0.2, -0.5, -0.8, -1.3] {
            // Looked for where it is, at once or beside it.
            assert_eq!(wrong_px(moved_px, moved_px, moved_px, SKY_REACH_PX), 0.0);
            assert_eq!(
                wrong_px(moved_px, moved_px - REACHED * SKY_REACH_PX + 0.5, moved_px, SKY_REACH_PX),
                0.0
            );
            assert_eq!(wrong_px(moved_px, f64::NEG_INFINITY, 0.0, SKY_REACH_PX), 0.0);
            // What is beside it may move less: by nothing as the sky, by a little more or less than half.
            for part in [0.0, 0.5] {
                let found = wrong_px(moved_px, moved_px, part * moved_px, SKY_REACH_PX);
                assert!(
                    (found / exactly((1.0 - part) * moved_px) - 1.0).abs() < 0.05,
                    "{moved_px} {part}: {found}"
                );
            }
            // Whoever finds the sky only sees all of it.
            let of_all = wrong_px(moved_px, f64::INFINITY, moved_px, SKY_REACH_PX) / all_of(moved_px.abs());
            assert!((of_all - 1.0).abs() < 0.05, "{moved_px}: {of_all}");
            // A guess that is far too near finds the sky where the surface has come over it, and the surface
            // where that has gone.
            let too_near = wrong_px(moved_px, 300.0 * moved_px, moved_px, SKY_REACH_PX);
            assert!(if moved_px > 0.0 { too_near > 0.0 } else { too_near == 0.0 }, "{moved_px}: {too_near}");
        }
        // Beyond the reach: shown where it is not from there on, and not shown where it is up to there.
        for moved_px in [3.0, 5.0] {
            let over = wrong_px(moved_px, moved_px, moved_px, SKY_REACH_PX);
            assert!((over - gone(moved_px)).abs() < 0.05 * over, "{moved_px}: {over}");
            let found = wrong_px(-moved_px, 0.0, -moved_px, SKY_REACH_PX);
            assert!((found - gone(moved_px)).abs() < 0.05 * found, "{moved_px}: {found}");
        }
    }

    #[test]
    fn skylines_cost_by_what_the_camera_makes_of_them_and_nothing_from_the_same_place() {
        assert_eq!(found(BOARD, 0.0), 0.0);
        assert!((found(Board { gain: 0.5, ..BOARD }, 0.05) / found(BOARD, 0.05) - 0.25).abs() < 1e-12);
        // But for what an exposure of 8 px sweeps from beyond the reach, across two of four borders.
        let of_each = (4.0 - REACHED * SKY_REACH_PX).powi(3) / (3.0 * 64.0);
        let expected = SAFETY * SAFETY * 200.0 * 2.0 * of_each / 120_000.0;
        let swept = found(Board { exposure_ms: 100.0, ..BOARD }, 0.0);
        assert!((0.8..1.4).contains(&(swept / expected)), "{swept} {expected}");
    }

    #[test]
    fn skylines_have_their_contrast_in_a_scene_with_panes_too() {
        let grey = Arc::new(Texture::uniform([99, 99, 99, 255], Encoding::Linear));
        let mut pane = Mesh::level_picture(grey, DVec3::new(9000.0, 0.0, -50.0), 10.0);
        pane.material.blends = true;
        let (with, without) = (found(Board { others: vec![pane], ..BOARD }, 0.05), found(BOARD, 0.05));
        // With a pane nothing goes with a surface: both borders are wrong from end to end.
        let expected = 2.0 * all_of(4.0) / (all_of(4.0) + gone(4.0));
        assert!(
            without > 0.0 && (with / without / expected - 1.0).abs() < 0.05,
            "{with} {without} {expected}"
        );
    }

    /// A crest whose every other height is 3 m lower, 1500 m to the north and 30 m above the camera: where
    /// coarser triangles leave the lower heights out it is drawn 1.5 m higher there in the mean, 1 px at
    /// most.
    #[test]
    fn a_crest_that_is_drawn_coarser_than_it_is_passes_over_as_much_of_the_sky() {
        let height_m = |row: u32, column: u32| match row.abs_diff(64) {
            0 if column % 2 == 1 => 157.0,
            rows => 160.0 - 4.0 * f64::from(rows),
        };
        let heights: Vec<f64> =
            (0..129).flat_map(|row| (0..129).map(move |column| height_m(row, column))).collect();
        let terrain = Terrain::from_heights(129, 129, 10.0, &heights, None).unwrap();
        let (path, tangents) =
            (flying_east_from(DVec3::new(-1500.0, 0.0, -130.0), 0.0), [-0.4, 0.4, -0.3, 0.3]);
        let scene = Arc::new(Scene { terrain: Some(terrain), sky_linear: [0.0; 3], ..Scene::default() });
        let shutter = Shutter::from_spec(&ShutterSpec::default(), 5.0, [400, 300]).unwrap();
        let camera = CameraModel::new([400, 300], [500.0; 2], None, LensModel::Pinhole, &[]).unwrap();
        let (reach, surfaces) = (LensReach::new(Arc::new(camera)).unwrap(), Surfaces::new(scene.clone()));
        let search = Search {
            reach: &reach,
            surfaces: &surfaces,
            path: &path,
            shutter: &shutter,
            stamp_s: 0.0,
            gain: &|_| 1.0,
        };
        let skyline = search.look_around().skyline;
        let lowered = |max_error_px: f64| {
            let detail = TerrainDetail::new(
                scene.terrain.as_ref().unwrap(),
                &path.pose(0.0),
                tangents,
                500.0,
                max_error_px,
            );
            skyline.lowered(&detail)
        };
        assert!(lowered(1e-6) < 1e-20);
        // From 0 to 1 px and back along the crest: of squares a third, in the mean.
        let contrast2 =
            skyline.found.iter().map(|(_, place)| place.contrast2).sum::<f64>() / skyline.found.len() as f64;
        let share = 400.0 / 120_000.0;
        let expected = SAFETY_OF_GROUND * SAFETY_OF_GROUND * contrast2 * share / 3.0;
        assert!((0.6..1.6).contains(&(lowered(2.0) / expected)), "{} {expected}", lowered(2.0));
    }
}
