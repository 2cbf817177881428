//! The reverse pipeline run dry at one probe: the temporal inverse in f64 over the very texels that the ideal
//! frame will hold, beside the place where the probe's own ray, cast from its own line's pose, truly looks.

use glam::{DMat3, DVec2, DVec3};

use super::{
    PathStage, TemporalStage,
    around::LINES,
    exposure::miss_px,
    probes::Probe,
    surfaces::{Met, Surfaces},
};
use camsim_core::{
    mount::CameraPath,
    pose::CameraPose,
    scene::{DrawnCell, TerrainDetail, TerrainHit},
    shutter::Shutter,
    silhouette::{FOLD, NEAR_PX, bends, may_step, steps},
    temporal::{IdealGeometry, blend_inverse_depths, displacement::Twist, plane_on_line, through_three},
};

/// Look-ups that are tried.
pub(super) const MAX_LOOK_UPS: usize = 8;
/// Relative difference of depth beyond which something else stands before a point.
const HIDDEN: f64 = 1e-3;
/// Relative difference of inverse depth up to which the ends of an exposure are taken to see one surface.
const ONE_SURFACE: f64 = 0.02;

/// A frame to be tried.
#[derive(Clone, Copy)]
pub(super) struct Trial<'a> {
    pub surfaces: &'a Surfaces,
    pub path: &'a CameraPath,
    pub shutter: &'a Shutter,
    pub stamp_s: f64,
    pub key_s: f64,
    pub key_pose: &'a CameraPose,
    pub ideal: &'a IdealGeometry,
    /// Motion of the camera at the key instant, for the paper's models; `None` where nobody asks for them.
    pub twist: Option<Twist>,
    /// Whether these read the nearest texel's depth.
    pub nearest_depth: bool,
    /// The plane that look-ups begin with in the key camera ([`super::SeenPlane`]), 1/m; 0: infinitely far.
    pub plane: DVec3,
}

/// Where a probe truly looks.
#[derive(Clone, Copy)]
pub(super) struct Truth {
    /// Instant, path time.
    pub t_s: f64,
    /// Share of the exposure gone by.
    share: f64,
    /// Source.
    pub at_px: DVec2,
    /// Inverse planar depth in the line's camera, 1/m.
    pub inverse_depth: f64,
    /// The same of the key camera; 0 = sky.
    pub key_inverse_depth: f64,
    /// The ray in the key camera, its z left as it is, and what an inverse depth of 1 adds to it.
    in_key: (DMat3, DVec3),
    direction: DVec3,
    /// What the key camera sees at the source.
    seen: Option<Met>,
}

/// How far each way of solving looks from the truth, ideal pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outcome {
    /// One pose for all lines.
    pub still_px: f64,
    /// After n depth look-ups; none: each line's rotation alone.
    pub after: [f64; MAX_LOOK_UPS + 1],
    /// After n look-ups, or n - 1 and at least one where they begin with the depth that the other end of the
    /// exposure finds.
    pub handed_on: [f64; MAX_LOOK_UPS + 1],
    /// The part of `after` that more look-ups would mend.
    pub unsettled: [f64; MAX_LOOK_UPS + 1],
    /// Equation 16 and equation 18.
    pub linear_px: f64,
    pub rk2_px: f64,
    /// Displacement by parallax.
    pub parallax_px: f64,
    /// The key frame's inverse depth of what the probe meets at the end of its exposure that is farther from
    /// its instant, 1/m.
    pub elsewhere: f64,
}

/// The key frame's depth, texel by texel, found when asked for.
struct KeyDepth<'a> {
    trial: &'a Trial<'a>,
    /// The terrain as it will be drawn.
    detail: Option<&'a TerrainDetail<'a>>,
    known: Vec<([i64; 2], f64)>,
    /// What is drawn where the last ray met the terrain: neighbours mostly meet the same cell.
    drawn: Option<DrawnCell>,
}

impl Trial<'_> {
    /// Where one probe looks at an instant of its exposure (-0.5 to 0.5); `None` where its ray has no source
    /// in the ideal frame.
    pub fn look(&self, probe: &Probe, phase: f64) -> Option<Truth> {
        let t_s = self.instant_s(probe, phase + 0.5);
        let pose = self.path.pose(t_s);
        let (rotation, shift) = pose.relative_to(self.key_pose);
        let direction = rotation * probe.uv.extend(1.0);
        let met = self.surfaces.meet(pose.position_ned_m, pose.ned_from_camera * probe.uv.extend(1.0));
        let inverse_depth = met.map_or(0.0, |met| 1.0 / met.depth_m);
        let point = direction + inverse_depth * shift;
        let at_px = self.ideal.px_from_point(point);
        if point.z <= 0.0 || !self.ideal.contains(at_px) {
            return None;
        }
        Some(Truth {
            t_s,
            share: phase + 0.5,
            at_px,
            inverse_depth,
            key_inverse_depth: inverse_depth / point.z,
            in_key: (rotation, shift),
            direction,
            seen: self.surfaces.meet(self.key_pose.position_ned_m, self.key_ray(at_px)),
        })
    }

    /// What each way of solving makes of a probe.
    pub fn run(&self, probe: &Probe, truth: &Truth, detail: Option<&TerrainDetail<'_>>) -> Outcome {
        let off = |at_px: DVec2| if at_px.is_finite() { at_px.distance(truth.at_px) } else { f64::INFINITY };
        // Where the pixel itself would look: one pose for all lines. The paper's models read the depth there.
        let own_px = self.ideal.px_from_point(probe.uv.extend(1.0));
        let mut outcome = Outcome {
            still_px: off(own_px),
            parallax_px: off(self.ideal.px_from_point(truth.direction)),
            ..Outcome::default()
        };
        let mut depth = KeyDepth { trial: self, detail, known: Vec::with_capacity(16), drawn: None };
        let places = self.settle(probe.uv, truth.in_key, None, &mut depth);
        outcome.after = places.map(off);
        outcome.after[0] = outcome.parallax_px;
        outcome.elsewhere = self.key_inverse_depth(probe, truth, truth.far_end());
        let begun_there = self.settle(probe.uv, truth.in_key, Some(outcome.elsewhere), &mut depth).map(off);
        outcome.handed_on =
            std::array::from_fn(|n| begun_there[n.saturating_sub(1).max(1)].max(outcome.after[n]));
        let settled_px = places[MAX_LOOK_UPS];
        outcome.unsettled = places.map(|at_px| at_px.distance(settled_px));
        if let Some(twist) = &self.twist {
            let dt_s = truth.t_s - self.key_s;
            let w = depth.along(if self.nearest_depth { own_px.round() } else { own_px });
            let displaced = |stage: TemporalStage| {
                let uv = stage.displaced(probe.uv, w, twist, dt_s).unwrap_or(DVec2::NAN);
                off(self.ideal.px_from_point(uv.extend(1.0)))
            };
            outcome.linear_px = displaced(TemporalStage::Linear);
            outcome.rk2_px = displaced(TemporalStage::Rk2);
        }
        outcome
    }

    /// How far from the truth a probe looks with the depth that n look-ups find at mid-exposure: at its own
    /// instant, or at the end of its exposure that is farther from that, where `elsewhere` is
    /// [`Outcome::elsewhere`].
    pub fn of_mid(
        &self,
        probe: &Probe,
        truth: &Truth,
        elsewhere: f64,
        detail: Option<&TerrainDetail<'_>>,
    ) -> [f64; MAX_LOOK_UPS + 1] {
        let mut depth = KeyDepth { trial: self, detail, known: Vec::with_capacity(8), drawn: None };
        let looked_at = self.settle(
            probe.uv,
            self.path.pose(self.instant_s(probe, 0.5)).relative_to(self.key_pose),
            None,
            &mut depth,
        );
        let (rotation, end_shift) =
            self.path.pose(self.instant_s(probe, truth.far_end())).relative_to(self.key_pose);
        let (end_direction, (direction, shift)) =
            (rotation * probe.uv.extend(1.0), (truth.direction, truth.in_key.1));
        let at_end_px = |w: f64| self.ideal.px_from_point(end_direction + w * end_shift);
        // Where something else is met there a silhouette has passed.
        let is_one_surface = (elsewhere / truth.key_inverse_depth - 1.0).abs() < ONE_SURFACE;
        let true_end_px =
            depth_on_line(end_direction, end_shift, elsewhere).filter(|_| is_one_surface).map(at_end_px);
        std::array::from_fn(|n| {
            let found = n.checked_sub(1).map(|last| depth.inverse_depth(looked_at[last]));
            let on_line = |direction, shift| {
                found.and_then(|found| depth_on_line(direction, shift, found)).unwrap_or(0.0)
            };
            let at_end = true_end_px
                .map_or(0.0, |end_px| at_end_px(on_line(end_direction, end_shift)).distance(end_px));
            self.off_px(truth, direction + on_line(direction, shift) * shift).max(at_end)
        })
    }

    /// How far from the truth a place is, given in the key camera.
    fn off_px(&self, truth: &Truth, in_key: DVec3) -> f64 {
        let at_px = self.ideal.px_from_point(in_key);
        if at_px.is_finite() { at_px.distance(truth.at_px) } else { f64::INFINITY }
    }

    /// The key frame's inverse depth of what a probe's ray meets at a share of the exposure, 1/m; 0 = sky.
    fn key_inverse_depth(&self, probe: &Probe, truth: &Truth, share: f64) -> f64 {
        let t_s = self.instant_s(probe, share);
        if t_s == truth.t_s {
            return truth.key_inverse_depth;
        }
        let pose = self.path.pose(t_s);
        let met = self.surfaces.meet(pose.position_ned_m, pose.ned_from_camera * probe.uv.extend(1.0));
        let inverse_depth = met.map_or(0.0, |met| 1.0 / met.depth_m);
        let (rotation, shift) = pose.relative_to(self.key_pose);
        let z = (rotation * probe.uv.extend(1.0) + inverse_depth * shift).z;
        if z > 0.0 { inverse_depth / z } else { 0.0 }
    }

    /// How far a node looks from the truth that takes what lies between the depths of the exposure's ends,
    /// and by the parabola through these and that of its middle. `elsewhere` is [`Outcome::elsewhere`], if
    /// that is known.
    pub fn between_px(&self, probe: &Probe, truth: &Truth, elsewhere: Option<f64>) -> [f64; 2] {
        let found @ [first, _, last] = [0.0, 0.5, 1.0].map(|share| match elsewhere {
            Some(known) if share == truth.far_end() => known,
            _ => self.key_inverse_depth(probe, truth, share),
        });
        let (direction, shift) = (truth.direction, truth.in_key.1);
        [first + (last - first) * truth.share, through_three(found)(truth.share)].map(|between| {
            let w = depth_on_line(direction, shift, between).unwrap_or(0.0);
            self.off_px(truth, direction + w * shift)
        })
    }

    /// Instant at a share of the exposure, 0 to 1.
    fn instant_s(&self, probe: &Probe, share: f64) -> f64 {
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(probe.pixel[0], probe.pixel[1]);
        mid_s + self.shutter.exposure_s() * (share - 0.5)
    }

    /// Source at a share of the exposure, 0 to 1, of what the probe's ray then meets, and its inverse depth
    /// in the line's camera.
    pub fn true_source_px(&self, probe: &Probe, share: f64) -> (DVec2, f64) {
        let pose = self.path.pose(self.instant_s(probe, share));
        let met = self.surfaces.meet(pose.position_ned_m, pose.ned_from_camera * probe.uv.extend(1.0));
        let inverse_depth = met.map_or(0.0, |met| 1.0 / met.depth_m);
        let (rotation, shift) = pose.relative_to(self.key_pose);
        (self.ideal.px_from_point(rotation * probe.uv.extend(1.0) + inverse_depth * shift), inverse_depth)
    }

    /// How far polynomial `k` of the exposure's path is from where the probe looks; 0 where its ray passes a
    /// silhouette meanwhile.
    pub fn miss_along_surfaces_px(&self, probe: &Probe, path: PathStage, stretches: u32, k: u32) -> f64 {
        let mut along = Vec::new();
        let px = miss_px(path, stretches, k, |share| {
            let (at_px, inverse_depth) = self.true_source_px(probe, share);
            along.push((share, inverse_depth));
            at_px
        });
        let is_step = |pair: &[(f64, f64)]| match *pair {
            [(from, a), (to, b)] => {
                steps(a, b, |share| self.true_source_px(probe, from + (to - from) * share).1)
            }
            _ => false,
        };
        if along.windows(2).any(is_step) { 0.0 } else { px }
    }

    /// Source at a share of the exposure, 0 to 1, for a surface of the probe's depth.
    pub fn source_px(&self, probe: &Probe, truth: &Truth, share: f64) -> DVec2 {
        let (rotation, shift) = self.path.pose(self.instant_s(probe, share)).relative_to(self.key_pose);
        self.ideal.px_from_point(rotation * probe.uv.extend(1.0) + truth.inverse_depth * shift)
    }

    /// The places looked at: after no look-up, after one and so on, the first of which takes the key's
    /// inverse depth to be `guess`, or that of the plane. The same steps as
    /// [`camsim_core::temporal::reproject`].
    fn settle(
        &self,
        uv: DVec2,
        (rotation, shift): (DMat3, DVec3),
        guess: Option<f64>,
        depth: &mut KeyDepth<'_>,
    ) -> [DVec2; MAX_LOOK_UPS + 1] {
        let direction = rotation * uv.extend(1.0);
        let mut w = match guess {
            Some(guess) => depth_on_line(direction, shift, guess).unwrap_or(0.0),
            None => plane_on_line(direction, shift, self.plane),
        };
        let mut at_px = self.ideal.px_from_point(direction + w * shift);
        let mut last_px = DVec2::INFINITY;
        std::array::from_fn(|n| {
            // A place that gives itself again will do so for ever.
            if n > 0 && at_px != last_px {
                last_px = at_px;
                w = depth_on_line(direction, shift, depth.inverse_depth(at_px)).unwrap_or(w);
                at_px = self.ideal.px_from_point(direction + w * shift);
            }
            at_px
        })
    }

    /// Directions from the key camera, towards an ideal pixel, z = 1 in the camera, NED.
    fn key_ray(&self, at_px: DVec2) -> DVec3 {
        self.key_pose.ned_from_camera * ((at_px - self.ideal.principal_px) / self.ideal.focal_px).extend(1.0)
    }

    /// What the level of detail changes at the true source: depth there, and so parallax.
    pub fn level_of_detail_px(&self, truth: &Truth, detail: Option<&TerrainDetail<'_>>) -> f64 {
        let Some(Met { depth_m, terrain: Some(hit), .. }) = truth.seen else { return 0.0 };
        let drawn_m = self.drawn_depth_m(detail, &hit, self.key_ray(truth.at_px));
        // w of the line's camera, as `reproject` finds it from the key's.
        let (direction, shift) = (truth.direction, truth.in_key.1);
        let inverse = |depth_m: f64| direction.z / (depth_m - shift.z).max(1e-9);
        let moved = |w: f64| self.ideal.px_from_point(direction + w * shift);
        moved(inverse(drawn_m)).distance(moved(inverse(depth_m)))
    }

    /// How far the place of the terrain's picture that is drawn at the true source is from there, ideal
    /// pixels: to first order, and no more than is allowed.
    pub fn ground_px(&self, truth: &Truth, detail: &TerrainDetail<'_>) -> f64 {
        let Some(Met { depth_m, terrain: Some(hit), .. }) = truth.seen else { return 0.0 };
        let ray_ned = self.key_ray(truth.at_px);
        let drawn_m = self.drawn_depth_m(Some(detail), &hit, ray_ned);
        // Down to the full surface.
        let down_m = (depth_m - drawn_m) * ray_ned.dot(hit.normal_ned) / hit.normal_ned.z;
        let in_key = self.key_pose.ned_from_camera.inverse() * (drawn_m * ray_ned + down_m * DVec3::Z);
        let px = self.ideal.px_from_point(in_key).distance(truth.at_px);
        // A normal along the horizon tells nothing.
        if px < detail.max_error_px() { px } else { detail.max_error_px() }
    }

    /// Depth of the terrain as drawn, along a ray of the key camera that meets the full one at `hit`.
    fn drawn_depth_m(&self, detail: Option<&TerrainDetail<'_>>, hit: &TerrainHit, ray_ned: DVec3) -> f64 {
        detail.map_or(hit.t, |detail| detail.drawn_t(hit, self.key_pose.position_ned_m, ray_ned))
    }

    /// Whether a probe is to be counted apart: its point is hidden from the key camera, or its own camera
    /// sees a step of depth beside it; with `folds` also a fold.
    pub fn at_silhouette(&self, probe: &Probe, truth: &Truth, folds: bool) -> bool {
        truth.is_hidden() || self.near_a_step(probe, truth, folds)
    }

    /// At its own instant, along rows, columns and diagonals of three by three places: what crosses the
    /// square crosses its border.
    fn near_a_step(&self, probe: &Probe, truth: &Truth, folds: bool) -> bool {
        let pose = self.path.pose(truth.t_s);
        let look = |place: DVec2| {
            let uv = probe.uv + probe.uv_from_px * (f64::from(NEAR_PX) * place);
            self.surfaces
                .meet(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0))
                .map_or(0.0, |met| 1.0 / met.depth_m)
        };
        let places: [DVec2; 9] =
            std::array::from_fn(|i| DVec2::new((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0));
        let seen = places.map(look);
        let steps_between =
            |a: usize, b: usize| steps(seen[a], seen[b], |share| look(places[a].lerp(places[b], share)));
        LINES.iter().any(|&[a, b, c]| {
            let of_line = [seen[a], seen[b], seen[c]];
            // Between places 3 px apart a crease bends threefold.
            let fold = folds && bends(of_line, f64::from(NEAR_PX) * FOLD);
            fold || (may_step(of_line) && (steps_between(a, b) || steps_between(b, c)))
        })
    }
}

impl Truth {
    /// Share of the exposure gone by at its end that is farther away.
    fn far_end(&self) -> f64 {
        if self.share > 0.5 { 0.0 } else { 1.0 }
    }

    pub fn is_hidden(&self) -> bool {
        self.seen.is_some_and(|seen| self.key_inverse_depth * seen.depth_m < 1.0 - HIDDEN)
    }
}

/// As [`camsim_core::temporal::reproject`]: `None` at or behind the line's own image plane.
fn depth_on_line(direction: DVec3, shift: DVec3, found: f64) -> Option<f64> {
    let scale = 1.0 - shift.z * found;
    (scale > 1e-3).then(|| found * direction.z / scale)
}

impl KeyDepth<'_> {
    fn inverse_depth(&mut self, at_px: DVec2) -> f64 {
        if !at_px.is_finite() {
            return 0.0;
        }
        let [width, height] = self.trial.ideal.size_px.map(i64::from);
        let last = DVec2::new((width - 1) as f64, (height - 1) as f64);
        let at = at_px.clamp(DVec2::ZERO, last);
        let base = at.floor().min((last - 1.0).max(DVec2::ZERO));
        let [x, y] = [base.x as i64, base.y as i64];
        let texels = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]
            .map(|[x, y]| self.texel([x.min(width - 1), y.min(height - 1)]));
        blend_inverse_depths(texels, at - base)
    }

    /// What is drawn at a place of the key frame, between its texels too.
    fn along(&mut self, at_px: DVec2) -> f64 {
        let trial = self.trial;
        let (origin, ray) = (trial.key_pose.position_ned_m, trial.key_ray(at_px));
        match (trial.surfaces.meet(origin, ray), self.detail) {
            (None, _) => 0.0,
            (Some(Met { terrain: Some(hit), .. }), Some(detail)) => {
                let drawn = self
                    .drawn
                    .take()
                    .filter(|drawn| drawn.is_of(&hit))
                    .unwrap_or_else(|| detail.drawn_at(&hit));
                1.0 / self.drawn.insert(drawn).t(&hit, origin, ray)
            }
            (Some(met), _) => 1.0 / met.depth_m,
        }
    }

    fn texel(&mut self, texel: [i64; 2]) -> f64 {
        if let Some((_, w)) = self.known.iter().find(|(known, _)| *known == texel) {
            return *w;
        }
        let w = self.along(DVec2::new(texel[0] as f64, texel[1] as f64));
        self.known.push((texel, w));
        w
    }
}
