//! Disocclusion: what a pixel's ray meets and no ideal frame shows, since something stands between. Its fraction
//! of the picture decides whether a second ideal frame is worth its time.
//!
//! Disocclusion is strips beside silhouettes, as wide as the parallax between the two surfaces there: mostly
//! less than a pixel, and of 430 probes hardly any stands in one. But the strip beside a silhouette is as
//! many times wider as the key camera is farther away from the row's. So each probe is tested for whether its
//! point would be hidden from far away, and what hides it is tested again from where its strip is as wide as
//! the part of the picture that the probe stands for. As many times more probes find it there, and each
//! counts for as much less.
//!
//! Measured against the reference over eight frames each of the towns of `camsim bench` the fraction is 0.8 to 1.6
//! times the true one. It is too large, up to twice, where what hides is narrower than a probe's part of the
//! picture.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::dry_run::{DryRun, ExactSource};
use crate::{
    ir::{
        key_frame::{KeyFrame, nearest_first},
        predicted::Disocclusion,
    },
    view::probes::Probe,
};

/// Relative difference of distance beyond which something else stands before a point.
const HIDDEN: f64 = 1e-3;
/// The first view is from so far away, of the distance of the probe's point.
const FARTHEST: f64 = 0.25;
/// Views of a point, from nearer and nearer. Where it is not hidden something narrow may still hide it from
/// so many times nearer.
const VIEWS: u32 = 4;
const NEARER: f64 = 4.0;
/// RMS difference between what is disoccluded and the surface beside it, that stands in, 1/255 of the linear
/// range: an eighth of the range. The surface behind goes on under the strip, so that most differ by less:
/// measured 5 (strips of 3 px) to 20 (of 10 px) over the towns of `camsim bench`.
const CONTRAST_DN: f64 = 32.0;

/// A probe with a strip.
#[derive(Clone, Copy)]
struct DisocclusionStrip {
    /// True width, pixels of the ideal frame.
    width_px: f64,
    /// How many times wider it was found.
    times: f64,
}

impl Disocclusion {
    /// What is hidden from all `keys`. `probe_px` is the side of the part of the picture that each probe
    /// stands for, ideal pixels.
    pub(crate) fn new<'a, L>(
        dry_run: &DryRun<'_>,
        sources: L,
        keys: &[KeyFrame],
        probe_px: f64,
        max_error_px: f64,
    ) -> Self
    where
        L: IndexedParallelIterator<Item = (&'a Probe, &'a ExactSource)>,
    {
        let strips: Vec<Option<DisocclusionStrip>> = sources
            .with_min_len(16)
            .map(|(probe, source)| dry_run.strip(probe, source, keys, probe_px))
            .collect();
        let fraction_of = |weigh: &dyn Fn(&DisocclusionStrip) -> f64| {
            strips.iter().flatten().fold(0.0, |sum, strip| sum + weigh(strip) / strip.times)
                / strips.len().max(1) as f64
        };
        let fraction = fraction_of(&|_| 1.0);
        let weighted_fraction = fraction_of(&|strip| strip.width_px.min(1.0));
        Self {
            fraction,
            width_px: if fraction > 0.0 { fraction_of(&|strip| strip.width_px) / fraction } else { 0.0 },
            wide_fraction: fraction_of(&|strip| f64::from(u8::from(strip.width_px > max_error_px))),
            weighted_fraction,
            error_dn: CONTRAST_DN * weighted_fraction.sqrt(),
        }
    }
}

/// What hides a point from so many times as far away: the width of the strip in which it does so from where
/// the camera is, pixels of the ideal frame, at a distance from which that fills the part of the picture that
/// a probe stands for.
fn magnified(
    farthest: f64,
    probe_px: f64,
    hidden_px: impl Fn(f64) -> Option<f64>,
) -> Option<DisocclusionStrip> {
    let mut times = Some(farthest).filter(|times| times.is_finite())?.max(1.0);
    for _ in 0..VIEWS {
        let nearer = match hidden_px(times) {
            None => times / NEARER,
            Some(width_px) => {
                let fitting = Some(probe_px / width_px).filter(|times| times.is_finite())?.max(1.0);
                if times <= fitting {
                    return Some(DisocclusionStrip { width_px, times });
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
struct OffsetCamera<'a> {
    dry_run: &'a DryRun<'a>,
    origin_m: DVec3,
    axis: DVec3,
    /// The probe's ray, and that in the camera beside it with what an inverse depth of 1 adds to it.
    ray_ned: DVec3,
    direction: DVec3,
    shift: DVec3,
}

impl<'a> OffsetCamera<'a> {
    fn new(dry_run: &'a DryRun<'a>, probe: &Probe, source: &ExactSource, key: &KeyFrame) -> Self {
        let pose = dry_run.path.pose(source.t_s);
        let (rotation, shift) = pose.relative_to(&key.pose);
        let (uv, turn) = (probe.uv.extend(1.0), pose.ned_from_camera);
        Self {
            dry_run,
            origin_m: pose.position_ned_m,
            axis: turn * DVec3::Z,
            ray_ned: turn * uv,
            direction: rotation * uv,
            shift,
        }
    }

    fn position(&self, inverse_depth: f64) -> DVec2 {
        self.dry_run.ideal.px_from_point(self.direction + inverse_depth * self.shift)
    }

    /// So many times as far from the probe's camera as a key's is.
    fn eye_m(&self, key: &KeyFrame, times: f64) -> DVec3 {
        self.origin_m + times * (key.pose.position_ned_m - self.origin_m)
    }

    /// Parallax between what is seen, with an inverse depth, and something before it.
    fn width_px(&self, inverse_depth: f64, occluder_m: DVec3) -> f64 {
        let depth_m = (occluder_m - self.origin_m).dot(self.axis);
        if depth_m > 0.0 {
            self.position(depth_m.recip()).distance(self.position(inverse_depth))
        } else {
            f64::INFINITY
        }
    }
}

impl DryRun<'_> {
    /// The strip around a probe in which its own camera sees what no key does. The sky is never in one: it is
    /// one colour.
    fn strip(
        &self,
        probe: &Probe,
        source: &ExactSource,
        keys: &[KeyFrame],
        probe_px: f64,
    ) -> Option<DisocclusionStrip> {
        let mut keys = nearest_first(keys, source.t_s).into_iter();
        let first = keys.next().filter(|_| source.inverse_depth > 0.0)?;
        let offset = OffsetCamera::new(self, probe, source, first);
        let point_m = offset.origin_m + offset.ray_ned / source.inverse_depth;
        let occluder = |key: &KeyFrame, times: f64| self.occluder(offset.eye_m(key, times), point_m);
        let hidden_px = |times: f64| {
            occluder(first, times).map(|occluder_m| offset.width_px(source.inverse_depth, occluder_m))
        };
        let strip = magnified(
            FARTHEST * point_m.distance(offset.origin_m) / offset.shift.length(),
            probe_px,
            hidden_px,
        )?;
        keys.all(|key| occluder(key, strip.times).is_some()).then_some(strip)
    }

    /// What stands between two points.
    fn occluder(&self, from_m: DVec3, point_m: DVec3) -> Option<DVec3> {
        let ray_m = point_m - from_m;
        self.surfaces
            .first_hit(from_m, ray_m)
            .filter(|hit| hit.depth_m < 1.0 - HIDDEN)
            .map(|hit| from_m + hit.depth_m * ray_m)
    }
}
