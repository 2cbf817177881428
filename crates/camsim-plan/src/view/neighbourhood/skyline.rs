//! Where the sky begins.
//!
//! Of 430 probes one stands within 3 px of 100 px of skyline, which may be the strongest contrast of a
//! picture. Lines find it from farther away: of straight lines s all over an area A, a skyline of length L
//! whose normal is n crosses `L sum |s.n| / A`. The lines are those from each probe to its neighbours: no ray
//! is needed to know which of them cross it an odd number of times, and halving finds where some do, and
//! which direction it runs in there.

use std::f64::consts::{PI, TAU};

use camsim_core::{pose::CameraPose, scene::TerrainHit, silhouette::NEAR_PX, temporal::SKY_REACH_PX};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::search::NeighbourhoodSearch;
use crate::view::{probes::Probe, source_path::path_px};

/// Neighbours are nearer than so many sides of a probe's part of the picture.
const NEIGHBOURS: f64 = 1.6;
/// Most crossings that are examined, of all that there are.
const MOST_LOOKS: usize = 24;
/// Halvings from probe to probe, and from one direction to the next of those around a position.
const HALVINGS: u32 = 8;
const HALVINGS_AROUND: u32 = 4;
const DIRECTIONS: u32 = 8;
/// Directions across it that are distinguished.
const ACROSS: usize = 12;

/// The skyline that a frame's probes find, wherever the ideal frame is taken.
#[derive(Clone, Debug, Default)]
pub(crate) struct Skyline {
    /// Points of it, each with the crossings that it stands for.
    pub points: Vec<(f64, SkylinePoint)>,
    /// Length of the lines that would cross it, across each of [`ACROSS`] directions of a half turn, pixels.
    pub across_px: [f64; ACROSS],
    /// Focal length of the camera.
    pub focal_px: DVec2,
    /// [`SKY_REACH_PX`], or 0 where pixels of the sky go with nothing.
    pub reach_px: f64,
}

/// A point of the skyline.
#[derive(Clone, Debug)]
pub(crate) struct SkylinePoint {
    /// Output pixel.
    pub pixel: [u32; 2],
    /// Camera of the pixel.
    pub pose: CameraPose,
    /// Ray of the pixel.
    pub uv: DVec2,
    /// Inverse depth of the surface there, 1/m.
    pub inverse_depth: f64,
    /// Inverse depth of the surface that pixels of the sky there go with.
    pub followed_inverse_depth: f64,
    /// Across the skyline, towards the sky, where that is known.
    pub normal: Option<DVec2>,
    /// Hit of the terrain there, and its position, NED, metres.
    pub ground: Option<(TerrainHit, DVec3)>,
    /// Squared contrast, of the linear range.
    pub contrast2: f64,
    /// Path over the exposure, pixels of the camera's focal length.
    pub path_px: f64,
    /// How far the skyline moves before the sky over the exposure, pixels.
    pub swept_px: f64,
}

impl Skyline {
    /// With what another frame's probes find.
    pub fn and(mut self, other: Self) -> Self {
        self.points.extend(other.points);
        let across_px = std::array::from_fn(|k| self.across_px[k] + other.across_px[k]);
        Self { across_px, ..self }
    }

    /// The skyline as cameras elsewhere would see it.
    pub fn seen_from(&self, pose: impl Fn([u32; 2]) -> CameraPose) -> Self {
        let seen = |(times, point): &(f64, SkylinePoint)| {
            (*times, SkylinePoint { pose: pose(point.pixel), ..point.clone() })
        };
        Self { points: self.points.iter().map(seen).collect(), ..*self }
    }

    /// Length of the lines across a direction, or any.
    pub fn line_length_px(&self, normal: Option<DVec2>) -> f64 {
        let Some(normal) = normal else { return self.across_px.iter().sum::<f64>() / ACROSS as f64 };
        let turn = ACROSS as f64 * normal.to_angle().rem_euclid(PI) / PI;
        let (below, fraction) = (turn.floor(), turn.fract());
        let [below, above] = [below, below + 1.0].map(|turn| self.across_px[turn as usize % ACROSS]);
        below + (above - below) * fraction
    }
}

impl NeighbourhoodSearch<'_> {
    /// The skyline that the probes find; `is_sky` of each.
    pub fn skyline(&self, is_sky: &[bool]) -> Skyline {
        let (mut across_px, mut crossings) = ([0.0; ACROSS], Vec::new());
        let most_px = NEIGHBOURS * self.reach.probe_px;
        let directions: [DVec2; ACROSS] =
            std::array::from_fn(|k| DVec2::from_angle(PI * k as f64 / ACROSS as f64));
        let pixel_px = |probe: &Probe| DVec2::new(f64::from(probe.pixel[0]), f64::from(probe.pixel[1]));
        for (k, (one, one_is_sky)) in self.reach.probes.iter().zip(is_sky).enumerate() {
            for (other, other_is_sky) in self.reach.probes.iter().zip(is_sky).skip(k + 1) {
                let line_px = pixel_px(one) - pixel_px(other);
                if line_px.length_squared() > most_px * most_px {
                    continue;
                }
                across_px
                    .iter_mut()
                    .zip(directions)
                    .for_each(|(px, direction)| *px += line_px.dot(direction).abs());
                if one_is_sky != other_is_sky {
                    crossings.push(if *one_is_sky { [one, other] } else { [other, one] }.map(pixel_px));
                }
            }
        }
        let each = crossings.len().div_ceil(MOST_LOOKS).max(1);
        let points: Vec<Option<SkylinePoint>> = crossings
            .par_iter()
            .step_by(each)
            .map(|[sky_px, surface_px]| self.point_between(*sky_px, *surface_px))
            .collect();
        let times = crossings.len() as f64 / points.len().max(1) as f64;
        Skyline {
            points: points.into_iter().flatten().map(|point| (times, point)).collect(),
            across_px,
            focal_px: self.reach.camera.central_focal_px(),
            reach_px: if self.surfaces.blends { 0.0 } else { SKY_REACH_PX },
        }
    }

    /// Where the sky begins between a pixel that shows it and one that does not.
    fn point_between(&self, sky_px: DVec2, surface_px: DVec2) -> Option<SkylinePoint> {
        let [sky_px, surface_px] = self.halve(sky_px, surface_px)?;
        let (pose, uv, mid_s) = self.ray_at(surface_px)?;
        let ray_ned = |uv: DVec2| pose.ned_from_camera * uv.extend(1.0);
        let hit = self.surfaces.first_hit(pose.position_ned_m, ray_ned(uv))?;
        let light = |uv: DVec2, hit| {
            self.surfaces.light(pose.position_ned_m, ray_ned(uv), hit, uv.extend(1.0).length()).color
        };
        let contrast = light(uv, Some(&hit)) - light(self.reach.camera.unproject(sky_px)?, None);
        let pixel = surface_px.round().max(DVec2::ZERO).to_array().map(|px| px as u32);
        let focal_px = self.reach.camera.central_focal_px();
        let normal = self.normal(surface_px);
        let exposure_s = self.shutter.exposure_pixel_s(pixel[0], pixel[1]);
        Some(SkylinePoint {
            pixel,
            pose,
            uv,
            inverse_depth: hit.depth_m.recip(),
            followed_inverse_depth: self
                .followed_inverse_depth(surface_px, normal)
                .unwrap_or(hit.depth_m.recip()),
            normal,
            ground: hit.terrain.map(|ground| (ground, pose.position_ned_m + hit.depth_m * ray_ned(uv))),
            contrast2: (self.gain)(pixel).powi(2) * contrast.length_squared() / 3.0,
            swept_px: self.swept_px([mid_s, exposure_s], uv, hit.depth_m.recip(), normal),
            path_px: path_px(self.path, mid_s, exposure_s, uv, hit.depth_m.recip(), focal_px).0.length(),
        })
    }

    /// Across the skyline, if it passes once through a circle around one of its positions as far away as pixels
    /// at it are.
    fn normal(&self, point_px: DVec2) -> Option<DVec2> {
        let position = |turns: f64| point_px + f64::from(NEAR_PX) * DVec2::from_angle(TAU * turns);
        let turns = |k: u32| f64::from(k) / f64::from(DIRECTIONS);
        let is_sky =
            (0..DIRECTIONS).map(|k| self.is_sky(position(turns(k)))).collect::<Option<Vec<bool>>>()?;
        let ends: Vec<u32> = (0..DIRECTIONS)
            .filter(|&k| is_sky[k as usize] != is_sky[((k + 1) % DIRECTIONS) as usize])
            .collect();
        let &[one, other] = ends.as_slice() else { return None };
        let end = |k: u32| {
            let (mut from, mut to) = (turns(k), turns(k + 1));
            for _ in 0..HALVINGS_AROUND {
                let middle = 0.5 * (from + to);
                *(if self.is_sky(position(middle))? == is_sky[k as usize] { &mut from } else { &mut to }) =
                    middle;
            }
            self.reach.camera.unproject(position(from))
        };
        let uv_of_sky = {
            let sky: DVec2 =
                (0..DIRECTIONS).filter(|&k| is_sky[k as usize]).map(|k| position(turns(k)) - point_px).sum();
            self.reach.camera.unproject(point_px + sky.normalize_or_zero() * f64::from(NEAR_PX))?
        };
        let across =
            (self.reach.camera.central_focal_px() * (end(one)? - end(other)?)).perp().try_normalize()?;
        let towards_sky =
            self.reach.camera.central_focal_px() * (uv_of_sky - self.reach.camera.unproject(point_px)?);
        Some(across * across.dot(towards_sky).signum())
    }

    /// How far something moves before the sky over the exposure, across the skyline where that is known: by
    /// where the camera goes.
    fn swept_px(
        &self,
        [mid_s, exposure_s]: [f64; 2],
        uv: DVec2,
        inverse_depth: f64,
        normal: Option<DVec2>,
    ) -> f64 {
        let half_s = 0.5 * exposure_s;
        if half_s == 0.0 {
            return 0.0;
        }
        let mid = self.path.pose(mid_s);
        let moved = |t_s: f64| {
            let shift = mid.relative_to(&self.path.pose(t_s)).1;
            self.reach.camera.central_focal_px() * inverse_depth * (shift.truncate() - shift.z * uv)
        };
        let swept = moved(mid_s + half_s) - moved(mid_s - half_s);
        normal.map_or(swept.length(), |normal| normal.dot(swept).abs())
    }

    /// How near the surface is, as far behind the skyline as pixels of the sky look for it.
    fn followed_inverse_depth(&self, point_px: DVec2, normal: Option<DVec2>) -> Option<f64> {
        let (pose, uv, _) = self.ray_at(point_px)?;
        let behind = uv - SKY_REACH_PX * normal? / self.reach.camera.central_focal_px();
        Some(
            self.surfaces
                .first_hit(pose.position_ned_m, pose.ned_from_camera * behind.extend(1.0))?
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

    fn is_sky(&self, point_px: DVec2) -> Option<bool> {
        let (pose, uv, _) = self.ray_at(point_px)?;
        Some(self.surfaces.first_hit(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0)).is_none())
    }

    /// The camera and ray of a position of the picture, and its instant.
    fn ray_at(&self, point_px: DVec2) -> Option<(CameraPose, DVec2, f64)> {
        let last = self.reach.camera.size_px.map(|side| f64::from(side - 1));
        let [x, y] = [0, 1].map(|axis: usize| point_px[axis].round().clamp(0.0, last[axis]) as u32);
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
        Some((self.path.pose(mid_s), self.reach.camera.unproject(point_px)?, mid_s))
    }
}
