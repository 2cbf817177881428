//! What the probes of a frame see around them: steps of depth, borders between what touches, and where the
//! sky begins.

use glam::DVec2;
use rayon::prelude::*;

use super::{
    LensReach,
    borders::Crossed,
    probes::Probe,
    prospect::path_px,
    skyline::Skyline,
    surfaces::{Met, Surfaces},
};
use camsim_core::{
    mount::CameraPath,
    pose::CameraPose,
    shutter::Shutter,
    silhouette::{FOLD, NEAR_PX, bends, may_step, steps},
};

/// Lines of three through three by three places, the border's first.
pub(super) const LINES: [[usize; 3]; 8] =
    [[0, 1, 2], [6, 7, 8], [0, 3, 6], [2, 5, 8], [3, 4, 5], [1, 4, 7], [0, 4, 8], [2, 4, 6]];

/// Times the farthest that nine places see without a step between them: nothing farther is seen among them.
const BEHIND: f64 = 1.05;

/// A frame in which they are looked for.
pub(super) struct Search<'a> {
    pub reach: &'a LensReach,
    pub surfaces: &'a Surfaces,
    pub path: &'a CameraPath,
    pub shutter: &'a Shutter,
    pub stamp_s: f64,
    /// Of the linear range for a pixel, for each unit of light that arrives.
    pub gain: &'a (dyn Fn([u32; 2]) -> f64 + Sync),
}

/// What is seen around a probe, wherever the ideal frame is taken.
#[derive(Clone, Debug)]
pub(super) struct Around {
    pub contour: Option<Contour>,
    /// Side of the pixel and how far the path over the exposure goes, pixels of the camera's focal length;
    /// where there is a border.
    pub sides_px: Option<[f64; 2]>,
    /// What is found pixel by pixel, where models may be thinner than the places of that look.
    pub crossed: Crossed,
    /// Squared contrast of the ground's borders, times their length in each pixel of the camera's focal
    /// length.
    pub of_ground: f64,
    /// Whether it sees the sky.
    is_sky: bool,
    /// Whether there is a step or a fold of depth.
    pub is_beside: bool,
}

/// Of all probes.
#[derive(Clone, Debug)]
pub(super) struct Surroundings {
    pub around: Vec<Around>,
    pub skyline: Skyline,
}

/// One probe near a silhouette.
#[derive(Clone, Debug)]
pub(super) struct Contour {
    pub contrast2: f64,
    /// Of the borders between two surfaces, where there are any: holes are beside these alone.
    pub surfaces2: Option<f64>,
    /// [`Contour::steps`] of those.
    pub steps_between_surfaces: f64,
    path_px: f64,
    /// The probe's camera and ray, inverse depths on both sides of each border, and the direction across it.
    pose: CameraPose,
    uv: DVec2,
    across: Vec<[f64; 2]>,
    normal: DVec2,
}

impl Around {
    /// The same as a camera elsewhere would see it.
    pub fn seen_from(&self, pose: impl FnOnce() -> CameraPose) -> Self {
        let mut there = self.clone();
        if let Some(contour) = &mut there.contour {
            contour.pose = pose();
        }
        there
    }

    /// How much there is of borders, and the side of the pixel and its path.
    pub fn place(&self) -> Option<(f64, [f64; 2])> {
        let Crossed { steps, flush, feet, .. } = self.crossed;
        Some((self.contour.as_ref().map_or(0.0, Contour::steps).max(steps) + flush + feet, self.sides_px?))
    }
}

impl Contour {
    /// Squared contrast times the length of the border in each of the pixels within reach.
    pub fn steps(&self) -> f64 {
        self.contrast2 / f64::from(2 * NEAR_PX + 1)
    }

    /// Parallax between the two surfaces seen from an ideal frame's camera, across the border; what is before
    /// the sky is the [`Skyline`]'s.
    fn strip_px(&self, key_pose: &CameraPose, focal_px: DVec2) -> f64 {
        let (rotation, shift) = self.pose.relative_to(key_pose);
        let of_probe = rotation * self.uv.extend(1.0);
        let key_px = |inverse_depth: f64| {
            let in_key = of_probe + inverse_depth * shift;
            focal_px * in_key.truncate() / in_key.z
        };
        let to_surface = |ends: &&[f64; 2]| ends.iter().all(|inverse_depth| *inverse_depth > 0.0);
        self.across
            .iter()
            .filter(to_surface)
            .map(|&[a, b]| (key_px(a) - key_px(b)).dot(self.normal).abs())
            .fold(0.0, f64::max)
    }

    /// Squared contrast times the width of that strip: narrower than a pixel it is as much less of one, and
    /// the exposure spreads it over its path.
    pub fn strip(&self, key_pose: &CameraPose, focal_px: DVec2) -> f64 {
        let strip_px = self.strip_px(key_pose, focal_px);
        let width_px = strip_px * strip_px / (strip_px.max(1.0) + self.path_px);
        self.surfaces2.unwrap_or(0.0) * (width_px / f64::from(2 * NEAR_PX + 1)).min(1.0)
    }
}

impl Surroundings {
    /// With what others see.
    pub fn with(&self, others: impl Iterator<Item = Self>) -> Self {
        let mut all = self.clone();
        for others in others {
            all.around.extend(others.around);
            all.skyline = all.skyline.and(others.skyline);
        }
        all
    }

    /// The same as cameras elsewhere would see it: those of the pixels of a picture.
    pub fn seen_from(&self, probes: &[Probe], pose: impl Fn([u32; 2]) -> CameraPose) -> Self {
        let around = self
            .around
            .iter()
            .zip(probes)
            .map(|(around, probe)| around.seen_from(|| pose(probe.pixel)))
            .collect();
        Self { around, skyline: self.skyline.seen_from(pose) }
    }
}

impl Search<'_> {
    /// Around each of the camera's probes.
    pub fn look_around(&self) -> Surroundings {
        let around: Vec<Around> = self
            .reach
            .probes
            .par_iter()
            .enumerate()
            .with_min_len(16)
            .map(|(number, probe)| self.look(number, probe))
            .collect();
        let is_sky: Vec<bool> = around.iter().map(|around| around.is_sky).collect();
        Surroundings { skyline: self.skyline(&is_sky), around }
    }

    /// At the probe's own instant, along rows, columns and diagonals of three by three places.
    fn look(&self, number: usize, probe: &Probe) -> Around {
        let [x, y] = probe.pixel;
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
        let pose = self.path.pose(mid_s);
        let uv = |place: DVec2| probe.uv + probe.uv_from_px * (f64::from(NEAR_PX) * place);
        let meet = |place: DVec2| {
            self.surfaces.meet(pose.position_ned_m, pose.ned_from_camera * uv(place).extend(1.0))
        };
        let places: [DVec2; 9] =
            std::array::from_fn(|i| DVec2::new((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0));
        let met = places.map(meet);
        let inverse_depth = met.map(|met| met.map_or(0.0, |met| met.depth_m.recip()));
        let step = |a: usize, b: usize| {
            let between =
                |share: f64| meet(places[a].lerp(places[b], share)).map_or(0.0, |met| met.depth_m.recip());
            steps(inverse_depth[a], inverse_depth[b], between).then_some([a, b])
        };
        let across: Vec<[usize; 2]> = LINES
            .iter()
            .filter(|line| may_step(line.map(|i| inverse_depth[i])))
            .flat_map(|&[a, b, c]| [step(a, b), step(b, c)])
            .flatten()
            .collect();
        // Across the border, towards what is nearer: along it parallax shows the same again.
        let towards = places
            .iter()
            .zip(inverse_depth)
            .fold(DVec2::ZERO, |sum, (place, nearness)| sum + nearness * *place);
        let normal = (self.reach.camera.focal_px * (probe.uv_from_px * towards)).normalize_or_zero();
        let color = |i: usize| {
            let way = uv(places[i]).extend(1.0);
            self.surfaces
                .light(pose.position_ned_m, pose.ned_from_camera * way, met[i].as_ref(), way.length())
                .color
        };
        let contrast2 = |&[a, b]: &[usize; 2]| (color(a) - color(b)).length_squared() / 3.0;
        // Between places 3 px apart a crease bends threefold.
        let is_fold = |line: &[usize; 3]| bends(line.map(|i| inverse_depth[i]), f64::from(NEAR_PX) * FOLD);
        // Lines are for models, which may be narrower than these places; of ground that steps among them they
        // tell how often.
        let may_show_models = || {
            let ways = places.map(uv);
            let (low, high) =
                ways.iter().fold((ways[0], ways[0]), |(low, high), way| (low.min(*way), high.max(*way)));
            let range_m = |(way, met): (&DVec2, &Option<Met>)| {
                met.map_or(f64::INFINITY, |met| met.depth_m * way.extend(1.0).length())
            };
            let farthest_m = ways.iter().zip(&met).map(range_m).fold(0.0, f64::max);
            self.surfaces.may_show_models(&pose, [low.x, high.x, low.y, high.y], BEHIND * farthest_m)
        };
        let has_lines = self.surfaces.has_models() && (!across.is_empty() || may_show_models());
        let crossed = if has_lines { self.crossed(number, probe) } else { Crossed::default() };
        let is_ground = |pair: &&[usize; 2]| {
            let [a, b] = **pair;
            let nearer = if inverse_depth[a] > inverse_depth[b] { a } else { b };
            // What is before the sky is the skyline's.
            met[nearer].is_some_and(|met| met.terrain.is_some())
                && inverse_depth[a].min(inverse_depth[b]) > 0.0
        };
        let gain2 = (self.gain)(probe.pixel).powi(2);
        let ground2 =
            gain2 * across.iter().filter(is_ground).map(contrast2).sum::<f64>() / across.len().max(1) as f64;
        let of_ground = ground2 / f64::from(2 * NEAR_PX + 1) + crossed.on_ground;
        let has_border = !across.is_empty() || crossed.steps + crossed.flush + crossed.feet > 0.0;
        let focal_px = self.reach.camera.focal_px;
        let sides_px = (has_border || of_ground > 0.0).then(|| {
            let path =
                path_px(self.path, mid_s, self.shutter.exposure_s(), probe.uv, inverse_depth[4], focal_px);
            // To and fro spreads a border no farther than it goes.
            [(focal_px.element_product() * probe.uv_from_px.determinant().abs()).sqrt(), path.0.length()]
        });
        // The exposure spreads it over its path.
        let of_ground =
            sides_px.map_or(0.0, |[side_px, path_px]| of_ground / (side_px * (side_px + path_px)));
        let sides_px = sides_px.filter(|_| has_border);
        let contour = sides_px.filter(|_| !across.is_empty()).map(|[_, path_px]| {
            let of =
                |pair: &[usize; 2]| (pair.iter().all(|&i| inverse_depth[i] > 0.0), gain2 * contrast2(pair));
            let (between_surfaces, before_sky): (Vec<_>, Vec<_>) =
                across.iter().map(of).partition(|(is_between_surfaces, _)| *is_between_surfaces);
            let [surfaces2, sky2] = [&between_surfaces, &before_sky]
                .map(|of| of.iter().map(|(_, contrast2)| contrast2).sum::<f64>());
            Contour {
                contrast2: (surfaces2 + sky2) / across.len() as f64,
                surfaces2: (!between_surfaces.is_empty()).then(|| surfaces2 / between_surfaces.len() as f64),
                steps_between_surfaces: surfaces2 / across.len() as f64 / f64::from(2 * NEAR_PX + 1),
                path_px,
                pose,
                uv: probe.uv,
                across: across.iter().map(|ends| ends.map(|i| inverse_depth[i])).collect(),
                normal,
            }
        });
        Around {
            is_beside: contour.is_some() || crossed.borders > 0 || LINES.iter().any(is_fold),
            contour,
            sides_px,
            crossed,
            of_ground,
            is_sky: met[4].is_none(),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::contours::tests::flying_east_from;
    use camsim_core::{
        camera::CameraModel,
        scenario::{LensModel, ShutterSpec},
        scene::{Encoding, Mesh, MeshVertex, Scene, Terrain, Texture, Wrap},
    };

    /// Thin masts, some on each of the hills below.
    fn masts() -> Vec<Mesh> {
        let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
        let mast = |i: u32| {
            let part = |step: f64| (f64::from(i) * step).fract() - 0.5;
            let foot = DVec3::new(1200.0 * part(0.618), 1200.0 * part(0.755), 0.0);
            let corners = [
                [-0.4, 0.0, 30.0],
                [0.4, 0.0, 30.0],
                [0.4, 0.0, -40.0],
                [-0.4, 0.0, -40.0],
                [0.0, 0.6, -40.0],
                [0.0, 0.6, 30.0_f32],
            ];
            let vertices = corners.map(|corner| MeshVertex::new(corner, [0.0; 2])).to_vec();
            Mesh::new(vertices, vec![0, 1, 2, 0, 2, 3, 3, 2, 4, 0, 1, 5], texture.clone(), foot, Wrap::Clamp)
        };
        (0..200).map(mast).collect()
    }

    #[test]
    fn lines_are_left_out_only_where_they_cross_nothing() {
        let heights: Vec<f64> = (0..161 * 161)
            .map(|i| 15.0 * (f64::from(i % 161) * 0.11).sin() * (f64::from(i / 161) * 0.07).cos())
            .collect();
        let terrain = Terrain::from_heights(161, 161, 10.0, &heights, None).unwrap();
        let surfaces =
            Surfaces::new(Arc::new(Scene { terrain: Some(terrain), meshes: masts(), ..Scene::default() }));
        let shutter =
            Shutter::from_spec(&ShutterSpec { readout_ms: 60.0, ..ShutterSpec::default() }, 5.0, [400, 300])
                .unwrap();
        let camera = CameraModel::new([400, 300], [300.0; 2], None, LensModel::Pinhole, &[]).unwrap();
        let (reach, gain) = (LensReach::new(Arc::new(camera)).unwrap(), |_: [u32; 2]| 1.0);
        let (mut left_out, mut found) = (0, 0);
        for up_deg in [-90.0, -50.0, -20.0] {
            let path = flying_east_from(DVec3::new(-200.0, 0.0, -250.0), up_deg);
            for frame in 0..6 {
                let stamp_s = 0.1 * f64::from(frame) - 0.3;
                let search = Search {
                    reach: &reach,
                    surfaces: &surfaces,
                    path: &path,
                    shutter: &shutter,
                    stamp_s,
                    gain: &gain,
                };
                let around = search.look_around().around;
                for (number, (probe, around)) in reach.probes.iter().zip(&around).enumerate() {
                    let crossed = search.crossed(number, probe);
                    assert_eq!(around.crossed, crossed, "{up_deg} {frame}: {:?}", probe.pixel);
                    left_out += usize::from(crossed == Crossed::default());
                    found += usize::from(crossed != Crossed::default());
                }
            }
        }
        assert!(left_out > 5000 && found > 100, "{left_out} {found}");
    }
}
