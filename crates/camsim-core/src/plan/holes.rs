//! Holes: what a pixel's ray meets and no ideal frame sees, since something stands between. How much of the picture they are decides
//! whether a second ideal frame is worth its time.
//!
//! Holes are strips beside silhouettes, as wide as the parallax between the two surfaces there: mostly less than a pixel, and of 430 probes
//! hardly any stands in one. But the strip beside a silhouette is as many times wider as the key camera is farther away from the line's. So
//! each probe is asked whether its point would be hidden from far away, and what hides it is looked at again from where its strip is as
//! wide as the part of the picture that the probe stands for. As many times more probes find it there, and each counts for as much less.
//!
//! Measured against the oracle over eight frames each of the towns of `camsim bench` the share is 0.8 to 1.6 times the true one. It is
//! too large, up to twice, where what hides is narrower than a probe's part of the picture.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::{
    KeyFrame,
    dry_run::{Trial, Truth},
    keys::nearest_first,
    probes::Probe,
    prospect::path_px,
    surfaces::Met,
};

/// Relative difference of distance beyond which something else stands before a point.
const HIDDEN: f64 = 1e-3;
/// The first look is from so far away, of the distance of the probe's point.
const FARTHEST: f64 = 0.25;
/// Looks at a point, from nearer and nearer. Where it is not hidden something narrow may still hide it from so many times nearer.
const LOOKS: u32 = 4;
const NEARER: f64 = 4.0;
/// RMS difference between what a hole shows and the surface beside it, that stands in, 1/255 of the linear range: an eighth of the range.
/// The surface behind goes on under the strip, so that most differ by less: measured 5 (strips of 3 px) to 20 (of 10 px) over the towns
/// of `camsim bench`.
const CONTRAST_DN: f64 = 32.0;

/// What the ideal frames of a plan do not see, as the probes find it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Holes {
    /// Share of the picture, over its area and exposure.
    pub share: f64,
    /// Width of the strips, the mean over that share, pixels of the ideal frame.
    pub width_px: f64,
    /// Share of the picture in strips wider than `quality.max_error_px`.
    pub wide_share: f64,
    /// The same as `share`, but of a strip narrower than a pixel as much less.
    pub narrow_share: f64,
    /// Expected error by them, RMS over the picture, 1/255 of the linear range. A strip narrower than a pixel is as much less of each that
    /// it crosses.
    pub error_dn: f64,
}

/// A probe with a strip.
#[derive(Clone, Copy)]
struct Strip {
    /// True width, pixels of the ideal frame.
    width_px: f64,
    /// How many times wider it was found.
    times: f64,
}

impl Holes {
    /// What is hidden from all `keys`. `probe_px` is the side of the part of the picture that each probe stands for, ideal pixels.
    pub(super) fn new<'a, L>(trial: &Trial<'_>, looked: L, keys: &[KeyFrame], probe_px: f64, max_error_px: f64) -> Self
    where
        L: IndexedParallelIterator<Item = (&'a Probe, &'a Truth)>,
    {
        let strips: Vec<Option<Strip>> = looked.with_min_len(16).map(|(probe, truth)| trial.strip(probe, truth, keys, probe_px)).collect();
        let part = |of: &dyn Fn(&Strip) -> f64| {
            strips.iter().flatten().fold(0.0, |sum, strip| sum + of(strip) / strip.times) / strips.len().max(1) as f64
        };
        let share = part(&|_| 1.0);
        let narrow_share = part(&|strip| strip.width_px.min(1.0));
        Self {
            share,
            width_px: if share > 0.0 { part(&|strip| strip.width_px) / share } else { 0.0 },
            wide_share: part(&|strip| f64::from(u8::from(strip.width_px > max_error_px))),
            narrow_share,
            error_dn: CONTRAST_DN * narrow_share.sqrt(),
        }
    }
}

/// Mean squared error over the picture by skylines that are elsewhere in the ideal frame of `key`, of the linear range; `gain` is that of a pixel.
///
/// On one side of the key the ideal frame shows a surface where the sky is; on the other the sky, where pixels begin to look for the surface: both
/// are counted. Found 2.1/255 where `camsim verify` measured 2.1 with all else; for skylines that are blurred over 10 px up to twice what is.
pub(super) fn sky_strips(
    trial: &Trial<'_>,
    looked: &[(&Probe, &Truth)],
    key: &KeyFrame,
    probe_px: f64,
    gain: &(dyn Fn([u32; 2]) -> f64 + Sync),
) -> f64 {
    let near: Vec<f64> = looked.iter().map(|(_, truth)| truth.inverse_depth).filter(|inverse_depth| *inverse_depth > 0.0).collect();
    if near.is_empty() || near.len() == looked.len() {
        return 0.0;
    }
    let typical_m = near.len() as f64 / near.iter().sum::<f64>();
    let of = |&(probe, truth): &(&Probe, &Truth)| gain(probe.pixel).powi(2) * trial.sky_strip(probe, truth, key, typical_m, probe_px);
    // Summed in their order: a plan does not depend on how threads share work.
    let strips: Vec<f64> = looked.par_iter().with_min_len(16).map(of).collect();
    strips.iter().sum::<f64>() / looked.len() as f64
}

/// What hides a point, or the sky, from so many times as far away: the width of the strip in which it does so from where the camera is, pixels of the ideal
/// frame, at a distance from which that fills the part of the picture that a probe stands for.
fn magnified(farthest: f64, probe_px: f64, hidden_px: impl Fn(f64) -> Option<f64>) -> Option<Strip> {
    let mut times = Some(farthest).filter(|times| times.is_finite())?.max(1.0);
    for _ in 0..LOOKS {
        let nearer = match hidden_px(times) {
            None => times / NEARER,
            Some(width_px) => {
                let fitting = Some(probe_px / width_px).filter(|times| times.is_finite())?.max(1.0);
                if times <= fitting {
                    return Some(Strip { width_px, times });
                }
                fitting
            }
        };
        if times == 1.0 {
            return None;
        }
        times = nearer.max(1.0);
    }
    None
}

/// A camera beside another one, for what it hides.
struct Aside<'a> {
    trial: &'a Trial<'a>,
    own_m: DVec3,
    axis: DVec3,
    /// The probe's ray, and that in the camera beside it with what an inverse depth of 1 adds to it.
    ray_ned: DVec3,
    direction: DVec3,
    shift: DVec3,
}

impl<'a> Aside<'a> {
    fn new(trial: &'a Trial<'a>, probe: &Probe, truth: &Truth, key: &KeyFrame) -> Self {
        let pose = trial.path.pose(truth.t_s);
        let (rotation, shift) = pose.relative_to(&key.pose);
        let (uv, turn) = (probe.uv.extend(1.0), pose.ned_from_camera);
        Self { trial, own_m: pose.position_ned_m, axis: turn * DVec3::Z, ray_ned: turn * uv, direction: rotation * uv, shift }
    }

    fn place(&self, inverse_depth: f64) -> DVec2 {
        self.trial.ideal.px_from_point(self.direction + inverse_depth * self.shift)
    }

    /// So many times as far from the probe's camera as a key's is.
    fn eye_m(&self, key: &KeyFrame, times: f64) -> DVec3 {
        self.own_m + times * (key.pose.position_ned_m - self.own_m)
    }

    /// Parallax between what is seen, with an inverse depth, and something before it.
    fn width_px(&self, inverse_depth: f64, hiding_m: DVec3) -> f64 {
        let depth_m = (hiding_m - self.own_m).dot(self.axis);
        if depth_m > 0.0 { self.place(depth_m.recip()).distance(self.place(inverse_depth)) } else { f64::INFINITY }
    }
}

impl Trial<'_> {
    /// The strip around a probe in which its own camera sees what no key does. The sky is never in one: it is one colour.
    fn strip(&self, probe: &Probe, truth: &Truth, keys: &[KeyFrame], probe_px: f64) -> Option<Strip> {
        let mut keys = nearest_first(keys, truth.t_s).into_iter();
        let first = keys.next().filter(|_| truth.inverse_depth > 0.0)?;
        let aside = Aside::new(self, probe, truth, first);
        let point_m = aside.own_m + aside.ray_ned / truth.inverse_depth;
        let hiding = |key: &KeyFrame, times: f64| self.hiding(aside.eye_m(key, times), point_m);
        let hidden_px = |times: f64| hiding(first, times).map(|hiding_m| aside.width_px(truth.inverse_depth, hiding_m));
        let strip = magnified(FARTHEST * point_m.distance(aside.own_m) / aside.shift.length(), probe_px, hidden_px)?;
        keys.all(|key| hiding(key, strip.times).is_some()).then_some(strip)
    }

    /// What stands between two points.
    fn hiding(&self, from_m: DVec3, point_m: DVec3) -> Option<DVec3> {
        let way_m = point_m - from_m;
        self.surfaces.meet(from_m, way_m).filter(|met| met.depth_m < 1.0 - HIDDEN).map(|met| from_m + met.depth_m * way_m)
    }

    /// Squared contrast, of the linear range, to the sky of what hides it on one side of the key or the other, times the share of the picture that
    /// the probe finds for as much of it as it stands for.
    ///
    /// Of 430 probes one stands within 3 px of 100 px of skyline: the same looks from farther away as for [`Holes`]. `typical_m` is how far away surfaces are.
    fn sky_strip(&self, probe: &Probe, truth: &Truth, key: &KeyFrame, typical_m: f64, probe_px: f64) -> f64 {
        if truth.inverse_depth > 0.0 {
            return 0.0;
        }
        let path_px = path_px(self.path, truth.t_s, self.shutter.exposure_s(), probe.uv, 0.0, self.ideal.focal_px).0.length();
        let aside = Aside::new(self, probe, truth, key);
        let farthest = FARTHEST * typical_m / aside.shift.length();
        let of_side = |side: f64| {
            let meet = |times: f64| self.surfaces.meet(aside.eye_m(key, side * times), aside.ray_ned);
            let hiding_m = |times: f64| meet(times).map(|met| aside.eye_m(key, side * times) + met.depth_m * aside.ray_ned);
            let strip = magnified(farthest, probe_px, |times| hiding_m(times).map(|hiding_m| aside.width_px(0.0, hiding_m)))?;
            let light = |from_m: DVec3, met: Option<&Met>| self.surfaces.light(from_m, aside.ray_ned, met, aside.ray_ned.length()).color;
            // From where it hides the sky: where surfaces are mixed light is looked for anew.
            let hiding = light(aside.eye_m(key, side * strip.times), meet(strip.times).as_ref());
            let contrast2 = (hiding - light(aside.own_m, None)).length_squared() / 3.0;
            // As much less of a pixel as it is narrower, and the exposure spreads it over its path.
            Some(contrast2 * strip.width_px / (strip.width_px.max(1.0) + path_px) / strip.times)
        };
        [1.0, -1.0].into_iter().filter_map(of_side).sum()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use super::*;
    use crate::{
        camera::CameraModel,
        plan::{
            LensReach,
            contours::tests::{SPEED_M_S, flying_east},
            error::Truths,
            surfaces::Surfaces,
        },
        scenario::{LensModel, ShutterSpec},
        scene::{Encoding, Mesh, Scene, Texture},
        shutter::Shutter,
        temporal::IdealGeometry,
    };

    const FOCAL_PX: f64 = 200.0;

    /// A black board 100 m below the camera and 200 px a side, the sky beyond it; flying east, with the ideal frame of so long after.
    fn found(key_s: f64, exposure_ms: f64, gain: f64) -> f64 {
        found_beside(Vec::new(), key_s, exposure_ms, gain)
    }

    fn found_beside(others: Vec<Mesh>, key_s: f64, exposure_ms: f64, gain: f64) -> f64 {
        let black = Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear));
        let board = Mesh::level_picture(black, DVec3::new(0.0, 0.0, -50.0), 100.0);
        let scene = Scene { meshes: [vec![board], others].concat(), sky_linear: [1.0; 3], ..Scene::default() };
        let path = flying_east();
        let shutter = Shutter::from_spec(&ShutterSpec { exposure_ms, ..ShutterSpec::default() }, 5.0, [400, 300]).unwrap();
        let camera = CameraModel::new([400, 300], [FOCAL_PX; 2], None, LensModel::Pinhole, &[]).unwrap();
        let ideal = IdealGeometry { size_px: [440, 340], focal_px: camera.focal_px, principal_px: DVec2::new(219.5, 169.5) };
        let (reach, surfaces) = (LensReach::new(Arc::new(camera)).unwrap(), Surfaces::new(Arc::new(scene)));
        let key = KeyFrame { t_s: key_s, pose: path.pose(key_s) };
        let trial = Trial {
            surfaces: &surfaces,
            path: &path,
            shutter: &shutter,
            stamp_s: 0.0,
            key_s,
            key_pose: &key.pose,
            ideal: &ideal,
            twist: None,
            nearest_depth: false,
            plane: DVec3::ZERO,
        };
        Truths::of_silhouettes(&reach, trial).sky_strips(&key, &|_| gain)
    }

    #[test]
    fn a_skyline_that_is_elsewhere_in_the_ideal_frame_is_found_however_narrow_its_strip() {
        // Of the board's two borders across the flight, 200 px each, and with white beyond black.
        for (key_s, exposure_ms) in [(0.005_f64, 0.0), (-0.005, 0.0), (0.05, 0.0), (0.1, 0.0)] {
            let width_px = FOCAL_PX * SPEED_M_S * key_s.abs() / 100.0;
            let expected = 2.0 * 200.0 * width_px * width_px.min(1.0) / 120_000.0;
            let found = found(key_s, exposure_ms, 1.0);
            assert!((0.7..1.4).contains(&(found / expected)), "{key_s} s, {width_px} px: {found:.2e}, expected {expected:.2e}");
        }
    }

    #[test]
    fn skylines_cost_by_what_the_camera_makes_of_them_and_nothing_from_the_same_place() {
        assert_eq!(found(0.0, 0.0, 1.0), 0.0);
        let whole = found(0.05, 0.0, 1.0);
        assert!((found(0.05, 0.0, 0.5) / whole - 0.25).abs() < 1e-12);
        // The sky itself does not move: where the camera does not turn, an exposure does not spread it.
        assert_eq!(found(0.05, 10.0, 1.0), whole);
    }

    #[test]
    fn skylines_have_their_contrast_in_a_scene_with_panes_too() {
        let grey = Arc::new(Texture::uniform([99, 99, 99, 255], Encoding::Linear));
        let mut pane = Mesh::level_picture(grey, DVec3::new(9000.0, 0.0, -50.0), 10.0);
        pane.material.blends = true;
        let (with, without) = (found_beside(vec![pane], 0.05, 0.0, 1.0), found(0.05, 0.0, 1.0));
        assert!(without > 0.0 && (with / without - 1.0).abs() < 1e-9, "{with} {without}");
    }
}
