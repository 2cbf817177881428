//! What silhouettes cost in grey levels where nothing is done for them: a pixel of the ideal frame then shows one of the two surfaces, and
//! an output pixel reads from there as it does elsewhere.
//!
//! Two things go wrong. The border runs along whole pixels, so that pixels on it have too much of one surface; and within the parallax
//! between the two surfaces a pixel looks where the other one is. Both are a share of the contrast across the border, in a strip whose
//! width the probes' own rays tell.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::{LensReach, levels::path_px, probes::Probe, surfaces::Surfaces};
use crate::{
    mount::CameraPath,
    pose::CameraPose,
    shutter::Shutter,
    silhouette::{NEAR_PX, may_step, steps},
};

/// Times what is expected: of a few hundred probes a few are at silhouettes.
const SAFETY: f64 = 1.2;
/// Part of `quality.max_error_dn` that silhouettes may take, and how many times that tolerance the pixels at them may be off, RMS.
const SHARE: f64 = 0.9;
const TIMES_AT: f64 = 6.0;
/// Price of marks, samples and rays for a picture that is all silhouettes, bilinear reads of an output pixel: rough, from frame times on llvmpipe.
const RAYS_PRICE: f64 = 4000.0;
/// Lines of three through three by three places, the border's first.
pub(super) const LINES: [[usize; 3]; 8] = [[0, 1, 2], [6, 7, 8], [0, 3, 6], [2, 5, 8], [3, 4, 5], [1, 4, 7], [0, 4, 8], [2, 4, 6]];

/// What silhouettes cost if they are left as the ideal frame's pixels show them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Contours {
    /// Share of the pixels within 3 px of one.
    pub share: f64,
    /// RMS contrast across them, 1/255 of the linear range.
    pub contrast_dn: f64,
    /// RMS parallax across them between the pixel's instant and the ideal frame's, pixels of the camera.
    pub parallax_px: f64,
    /// RMS error of those pixels, 1/255 of the linear range.
    pub at_dn: f64,
    /// RMS error over the picture by them, 1/255 of the linear range.
    pub error_dn: f64,
}

/// A frame in which they are looked for.
pub(super) struct Search<'a> {
    pub reach: &'a LensReach,
    pub surfaces: &'a Surfaces,
    pub path: &'a CameraPath,
    pub shutter: &'a Shutter,
    pub stamp_s: f64,
    pub key_pose: &'a CameraPose,
    /// Of the linear range for a pixel, for each unit of light that arrives.
    pub gain: &'a (dyn Fn([u32; 2]) -> f64 + Sync),
}

/// The same for ideal frames of any scale.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outlook {
    share: f64,
    contrast_dn: f64,
    parallax_px: f64,
    /// Mean squared error of pixels at silhouettes: by stairs at the camera's own scale, and by strips.
    squares: [f64; 2],
}

/// One probe near a silhouette.
struct Contour {
    contrast2: f64,
    parallax_px: f64,
    path_px: f64,
}

impl Contour {
    /// Squared errors, means over the pixels within reach, of a border along whole pixels of the camera's size and of the strip beside it.
    ///
    /// Where the border truly is within such a pixel is any place alike, so that one pixel of each line across has 1/12 of the squared
    /// contrast. A strip narrower than a pixel is as much less of one pixel. The path over the exposure spreads both over its length: as many
    /// times less of the contrast in as many times more pixels. Of stairs half of that, since many paths run along the border.
    fn squares(&self) -> [f64; 2] {
        let Self { contrast2, parallax_px, path_px } = *self;
        let stairs = (12.0 * (1.0 + path_px).sqrt()).recip();
        let strip = parallax_px * parallax_px / (parallax_px.max(1.0) + path_px);
        [stairs, strip].map(|width_px| SAFETY * SAFETY * contrast2 * (width_px / f64::from(2 * NEAR_PX + 1)).min(1.0))
    }
}

impl Outlook {
    /// Of giving pixels at silhouettes rays of their own, bilinear reads of an output pixel.
    pub fn price_of_rays(&self) -> f64 {
        RAYS_PRICE * self.share
    }

    /// With so many ideal pixels for each of the camera's.
    pub fn at_scale(&self, scale: f64) -> Contours {
        let Self { share, contrast_dn, parallax_px, squares: [stairs, strips] } = *self;
        let at_dn = 255.0 * (stairs / (scale * scale) + strips).sqrt();
        Contours { share, contrast_dn, parallax_px, at_dn, error_dn: at_dn * share.sqrt() }
    }
}

impl Contours {
    /// What is left of a tolerance for all else where silhouettes are left as they are; `None` where they cost too much of it.
    pub(super) fn leaves_dn(&self, max_error_dn: f64) -> Option<f64> {
        let affordable = self.error_dn <= SHARE * max_error_dn && self.at_dn <= TIMES_AT * max_error_dn;
        affordable.then(|| (max_error_dn * max_error_dn - self.error_dn * self.error_dn).sqrt())
    }
}

impl Search<'_> {
    pub fn outlook(&self) -> Outlook {
        let probes = &self.reach.probes;
        let found: Vec<Option<Contour>> = probes.par_iter().with_min_len(16).map(|probe| self.look(probe)).collect();
        let near = found.iter().flatten().count();
        let mean = |of: &dyn Fn(&Contour) -> f64| found.iter().flatten().fold(0.0, |sum, contour| sum + of(contour)) / near.max(1) as f64;
        Outlook {
            share: near as f64 / probes.len().max(1) as f64,
            contrast_dn: 255.0 * mean(&|contour| contour.contrast2).sqrt(),
            parallax_px: mean(&|contour| contour.parallax_px.powi(2)).sqrt(),
            squares: [0, 1].map(|part: usize| mean(&|contour| contour.squares()[part])),
        }
    }

    /// At the probe's own instant, along rows, columns and diagonals of three by three places.
    fn look(&self, probe: &Probe) -> Option<Contour> {
        let [x, y] = probe.pixel;
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
        let pose = self.path.pose(mid_s);
        let (rotation, shift) = pose.relative_to(self.key_pose);
        let uv = |place: DVec2| probe.uv + probe.uv_from_px * (f64::from(NEAR_PX) * place);
        let meet = |place: DVec2| self.surfaces.meet(pose.position_ned_m, pose.ned_from_camera * uv(place).extend(1.0));
        let places: [DVec2; 9] = std::array::from_fn(|i| DVec2::new((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0));
        let met = places.map(meet);
        let inverse_depth = met.map(|met| met.map_or(0.0, |met| met.depth_m.recip()));
        let step = |a: usize, b: usize| {
            let between = |share: f64| meet(places[a].lerp(places[b], share)).map_or(0.0, |met| met.depth_m.recip());
            steps(inverse_depth[a], inverse_depth[b], between).then_some([a, b])
        };
        let across: Vec<[usize; 2]> = LINES
            .iter()
            .filter(|line| may_step(line.map(|i| inverse_depth[i])))
            .flat_map(|&[a, b, c]| [step(a, b), step(b, c)])
            .flatten()
            .collect();
        let of_probe = rotation * probe.uv.extend(1.0);
        let key_px = |inverse_depth: f64| {
            let in_key: DVec3 = of_probe + inverse_depth * shift;
            self.reach.camera.focal_px * in_key.truncate() / in_key.z
        };
        let color = |i: usize| self.surfaces.color(met[i].as_ref(), uv(places[i]).extend(1.0).length());
        let contrast2 = |&[a, b]: &[usize; 2]| (color(a) - color(b)).length_squared() / 3.0;
        let parallax_px = |&[a, b]: &[usize; 2]| key_px(inverse_depth[a]).distance(key_px(inverse_depth[b]));
        (!across.is_empty()).then(|| Contour {
            contrast2: (self.gain)(probe.pixel).powi(2) * across.iter().map(contrast2).sum::<f64>() / across.len() as f64,
            parallax_px: across.iter().map(parallax_px).fold(0.0, f64::max),
            path_px: path_px(self.path, mid_s, self.shutter.exposure_s(), probe.uv, inverse_depth[4], self.reach.camera.focal_px).1,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use glam::DQuat;

    use super::*;
    use crate::{
        camera::CameraModel,
        pose::BodyState,
        scenario::{LensModel, MountSpec, ShutterSpec},
        scene::{Encoding, Mesh, Scene, Texture},
        trajectory::Trajectory,
    };

    const FOCAL_PX: f64 = 200.0;
    const SPEED_M_S: f64 = 40.0;

    /// A white roof of 50 m, 50 m above black ground, from 100 m above it, flying east with a readout of 100 ms.
    fn outlook(exposure_ms: f64, gain: f64) -> Outlook {
        let of = |byte: u8| Arc::new(Texture::uniform([byte, byte, byte, 255], Encoding::Linear));
        let roof = Mesh::level_picture(of(255), DVec3::new(0.0, 0.0, -50.0), 50.0);
        let scene = Scene { meshes: vec![Mesh::level_picture(of(0), DVec3::ZERO, 5000.0), roof], ..Scene::default() };
        let state = |t_s: f64| BodyState {
            position_ned_m: DVec3::new(0.0, SPEED_M_S * t_s, -150.0),
            velocity_ned_m_s: DVec3::new(0.0, SPEED_M_S, 0.0),
            acceleration_ned_m_s2: DVec3::ZERO,
            ned_from_body: DQuat::IDENTITY,
            rate_body_rad_s: DVec3::ZERO,
            angular_acceleration_body_rad_s2: DVec3::ZERO,
        };
        let mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
        let knots = (0..=20).map(|k| state(0.1 * f64::from(k) - 1.0)).collect();
        let path = CameraPath::new(Trajectory::uniform(-1.0, 0.1, 1.0, knots).unwrap(), &mount).unwrap();
        let shutter =
            Shutter::from_spec(&ShutterSpec { readout_ms: 100.0, exposure_ms, ..ShutterSpec::default() }, 5.0, [400, 300]).unwrap();
        let camera = CameraModel::new([400, 300], [FOCAL_PX; 2], None, LensModel::Pinhole, &[]).unwrap();
        let reach = LensReach::new(Arc::new(camera)).unwrap();
        let (key_pose, gain) = (path.pose(0.0), |_: [u32; 2]| gain);
        let surfaces = Surfaces::new(Arc::new(scene));
        Search { reach: &reach, surfaces: &surfaces, path: &path, shutter: &shutter, stamp_s: 0.0, key_pose: &key_pose, gain: &gain }
            .outlook()
    }

    #[test]
    fn a_roof_has_its_border_contrast_and_parallax() {
        let found = outlook(0.0, 1.0).at_scale(1.0);
        // 100 px a side: a band of 6 px along 400 px, of 120 000.
        assert!((found.share / 0.02 - 1.0).abs() < 0.5, "{found:?}");
        assert!((found.contrast_dn - 255.0).abs() < 1e-3, "{found:?}");
        // Half a metre a line's 1/30 of the way at the roof's upper and lower border, 50 px from the middle: (1/100 - 1/150) of it.
        let most_px = FOCAL_PX * SPEED_M_S * 0.05 / 3.0 * (1.0 / 100.0 - 1.0 / 150.0);
        assert!(found.parallax_px > 0.3 * most_px && found.parallax_px < 1.1 * most_px, "{found:?} {most_px}");
        assert_eq!(outlook(0.0, 0.5).at_scale(1.0).contrast_dn, 0.5 * found.contrast_dn);
    }

    #[test]
    fn finer_ideal_frames_and_blur_leave_less() {
        let still = outlook(0.0, 1.0);
        let [coarse, fine] = [1.0, 2.0].map(|scale| still.at_scale(scale).at_dn);
        assert!(fine < coarse && fine > 0.5 * coarse, "the strips stay: {fine} {coarse}");
        let blurred = outlook(20.0, 1.0).at_scale(1.0);
        assert!(blurred.at_dn < 0.9 * coarse, "{} {coarse}", blurred.at_dn);
        // White on black costs more than a 255th; nothing is left of it.
        assert!(blurred.leaves_dn(1.0).is_none());
        assert!(blurred.leaves_dn(16.0).is_some_and(|left_dn| left_dn < 16.0));
    }
}
