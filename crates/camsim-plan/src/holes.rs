//! Holes: what a pixel's ray meets and no ideal frame sees, since something stands between. How much of the
//! picture they are decides whether a second ideal frame is worth its time.
//!
//! Holes are strips beside silhouettes, as wide as the parallax between the two surfaces there: mostly less
//! than a pixel, and of 430 probes hardly any stands in one. But the strip beside a silhouette is as many
//! times wider as the key camera is farther away from the line's. So each probe is asked whether its point
//! would be hidden from far away, and what hides it is looked at again from where its strip is as wide as the
//! part of the picture that the probe stands for. As many times more probes find it there, and each counts
//! for as much less.
//!
//! Measured against the oracle over eight frames each of the towns of `camsim bench` the share is 0.8 to 1.6
//! times the true one. It is too large, up to twice, where what hides is narrower than a probe's part of the
//! picture.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::{
    KeyFrame,
    dry_run::{Trial, Truth},
    keys::nearest_first,
    probes::Probe,
};

/// Relative difference of distance beyond which something else stands before a point.
const HIDDEN: f64 = 1e-3;
/// The first look is from so far away, of the distance of the probe's point.
const FARTHEST: f64 = 0.25;
/// Looks at a point, from nearer and nearer. Where it is not hidden something narrow may still hide it from
/// so many times nearer.
const LOOKS: u32 = 4;
const NEARER: f64 = 4.0;
/// RMS difference between what a hole shows and the surface beside it, that stands in, 1/255 of the linear
/// range: an eighth of the range. The surface behind goes on under the strip, so that most differ by less:
/// measured 5 (strips of 3 px) to 20 (of 10 px) over the towns of `camsim bench`.
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
    /// Expected error by them, RMS over the picture, 1/255 of the linear range. A strip narrower than a pixel
    /// is as much less of each that it crosses.
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
    /// What is hidden from all `keys`. `probe_px` is the side of the part of the picture that each probe
    /// stands for, ideal pixels.
    pub(super) fn new<'a, L>(
        trial: &Trial<'_>,
        looked: L,
        keys: &[KeyFrame],
        probe_px: f64,
        max_error_px: f64,
    ) -> Self
    where
        L: IndexedParallelIterator<Item = (&'a Probe, &'a Truth)>,
    {
        let strips: Vec<Option<Strip>> =
            looked.with_min_len(16).map(|(probe, truth)| trial.strip(probe, truth, keys, probe_px)).collect();
        let part = |of: &dyn Fn(&Strip) -> f64| {
            strips.iter().flatten().fold(0.0, |sum, strip| sum + of(strip) / strip.times)
                / strips.len().max(1) as f64
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

/// What hides a point from so many times as far away: the width of the strip in which it does so from where
/// the camera is, pixels of the ideal frame, at a distance from which that fills the part of the picture that
/// a probe stands for.
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
        Self {
            trial,
            own_m: pose.position_ned_m,
            axis: turn * DVec3::Z,
            ray_ned: turn * uv,
            direction: rotation * uv,
            shift,
        }
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
        if depth_m > 0.0 {
            self.place(depth_m.recip()).distance(self.place(inverse_depth))
        } else {
            f64::INFINITY
        }
    }
}

impl Trial<'_> {
    /// The strip around a probe in which its own camera sees what no key does. The sky is never in one: it is
    /// one colour.
    fn strip(&self, probe: &Probe, truth: &Truth, keys: &[KeyFrame], probe_px: f64) -> Option<Strip> {
        let mut keys = nearest_first(keys, truth.t_s).into_iter();
        let first = keys.next().filter(|_| truth.inverse_depth > 0.0)?;
        let aside = Aside::new(self, probe, truth, first);
        let point_m = aside.own_m + aside.ray_ned / truth.inverse_depth;
        let hiding = |key: &KeyFrame, times: f64| self.hiding(aside.eye_m(key, times), point_m);
        let hidden_px =
            |times: f64| hiding(first, times).map(|hiding_m| aside.width_px(truth.inverse_depth, hiding_m));
        let strip =
            magnified(FARTHEST * point_m.distance(aside.own_m) / aside.shift.length(), probe_px, hidden_px)?;
        keys.all(|key| hiding(key, strip.times).is_some()).then_some(strip)
    }

    /// What stands between two points.
    fn hiding(&self, from_m: DVec3, point_m: DVec3) -> Option<DVec3> {
        let way_m = point_m - from_m;
        self.surfaces
            .meet(from_m, way_m)
            .filter(|met| met.depth_m < 1.0 - HIDDEN)
            .map(|met| from_m + met.depth_m * way_m)
    }
}
