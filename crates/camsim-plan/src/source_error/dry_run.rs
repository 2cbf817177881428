//! The reverse pipeline run dry at one probe: the temporal inverse in f64 over the very texels that the ideal
//! frame will hold, beside the exact source of the probe's own ray, cast from its own row's pose.

mod drawn_terrain;
mod ideal_depth;
mod silhouette;

use camsim_core::{
    mount::CameraPath,
    pose::CameraPose,
    scene::TerrainDetail,
    shutter::Shutter,
    silhouette::steps,
    temporal::{
        IdealGeometry, displacement::Twist, parabola_through, plane_inverse_depth, row_inverse_depth,
    },
};
use glam::{DMat3, DVec2, DVec3};

use crate::{
    ir::stages::{PathStage, TemporalStage},
    view::{
        constant_twist,
        exposure::miss_px,
        probes::Probe,
        surfaces::{SurfaceHit, Surfaces},
    },
};
use ideal_depth::{DepthLookUps, key_ray};

/// Most depth look-ups that are tried.
pub(crate) const MAX_LOOK_UPS: usize = 8;
/// Relative difference of depth beyond which something else stands before a point.
const HIDDEN: f64 = 1e-3;
/// Relative difference of inverse depth up to which the ends of an exposure are taken to see one surface.
const ONE_SURFACE: f64 = 0.02;

/// A frame whose temporal inverse is run dry.
#[derive(Clone, Copy)]
pub(crate) struct DryRun<'a> {
    pub surfaces: &'a Surfaces,
    pub path: &'a CameraPath,
    pub shutter: &'a Shutter,
    pub stamp_s: f64,
    pub key_s: f64,
    pub key_pose: &'a CameraPose,
    pub ideal: &'a IdealGeometry,
    /// Motion of the camera at the key instant, for the paper's models; `None` where they are not tried.
    pub twist: Option<Twist>,
    /// Whether these read the nearest texel's depth.
    pub nearest_depth: bool,
    /// The plane that look-ups begin with in the key camera
    /// ([`SeenPlane`](crate::ir::seen_plane::SeenPlane)), 1/m; 0: infinitely far.
    pub plane: DVec3,
}

/// The exact source of a probe.
#[derive(Clone, Copy)]
pub(crate) struct ExactSource {
    /// Instant, path time.
    pub t_s: f64,
    /// Fraction of the exposure gone by.
    fraction: f64,
    /// Source, ideal pixels.
    pub source_px: DVec2,
    /// Inverse planar depth in the row's camera, 1/m.
    pub inverse_depth: f64,
    /// Inverse planar depth in the key camera, 1/m; 0 = sky.
    pub key_inverse_depth: f64,
    /// From the row's camera to the key camera: rotation, and shift for an inverse depth of 1.
    relative: (DMat3, DVec3),
    /// The ray in the key camera, z as rotated.
    direction: DVec3,
    /// What the key camera sees at the source.
    key_hit: Option<SurfaceHit>,
}

/// Source error of each temporal inverse, ideal pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SolverErrors {
    /// One pose for all rows.
    pub still_px: f64,
    /// After n depth look-ups; none: each row's rotation alone.
    pub after_look_ups: [f64; MAX_LOOK_UPS + 1],
    /// After n depth look-ups, or n - 1 and at least one where they begin with the depth at the other end of
    /// the exposure.
    pub after_hand_over: [f64; MAX_LOOK_UPS + 1],
    /// The part of `after_look_ups` that more depth look-ups would remove.
    pub unsettled: [f64; MAX_LOOK_UPS + 1],
    /// Equation 16.
    pub linear_px: f64,
    /// Equation 18.
    pub rk2_px: f64,
    /// Displacement by parallax.
    pub parallax_px: f64,
    /// The key frame's inverse depth of what the probe meets at the end of its exposure that is farther from
    /// its instant, 1/m.
    pub far_end_inverse_depth: f64,
}

impl DryRun<'_> {
    /// Source of one probe at an instant of its exposure (-0.5 to 0.5); `None` where its ray has no source
    /// in the ideal frame.
    pub fn exact_source(&self, probe: &Probe, phase: f64) -> Option<ExactSource> {
        let t_s = self.instant_s(probe, phase + 0.5);
        let ((rotation, shift), direction, inverse_depth) = self.seen(probe, t_s);
        let point = direction + inverse_depth * shift;
        let source_px = self.ideal.px_from_point(point);
        if point.z <= 0.0 || !self.ideal.contains(source_px) {
            return None;
        }
        Some(ExactSource {
            t_s,
            fraction: phase + 0.5,
            source_px,
            inverse_depth,
            key_inverse_depth: inverse_depth / point.z,
            relative: (rotation, shift),
            direction,
            key_hit: self.surfaces.first_hit(self.key_pose.position_ned_m, self.key_ray(source_px)),
        })
    }

    /// Of a probe's ray at an instant: the pose of its camera relative to the key camera, its direction there, and the
    /// inverse planar depth of what it meets in its own camera, 1/m; 0 = sky.
    fn seen(&self, probe: &Probe, t_s: f64) -> ((DMat3, DVec3), DVec3, f64) {
        let pose = self.path.pose(t_s);
        let relative = pose.relative_to(self.key_pose);
        let hit = self.surfaces.first_hit(pose.position_ned_m, pose.ned_from_camera * probe.uv.extend(1.0));
        (relative, relative.0 * probe.uv.extend(1.0), hit.map_or(0.0, |hit| 1.0 / hit.depth_m))
    }

    /// Source error of each temporal inverse at a probe.
    pub fn solver_errors(
        &self,
        probe: &Probe,
        source: &ExactSource,
        detail: Option<&TerrainDetail<'_>>,
    ) -> SolverErrors {
        let off = |source_px: DVec2| {
            if source_px.is_finite() { source_px.distance(source.source_px) } else { f64::INFINITY }
        };
        // Where the pixel itself would look: one pose for all lines. The paper's models read the depth there.
        let own_px = self.ideal.px_from_point(probe.uv.extend(1.0));
        let mut outcome = SolverErrors {
            still_px: off(own_px),
            parallax_px: off(self.ideal.px_from_point(source.direction)),
            ..SolverErrors::default()
        };
        let mut depth = self.ideal_depth(detail);
        let positions = self.settle(probe.uv, source.relative, None, &mut depth);
        outcome.after_look_ups = positions.map(off);
        outcome.after_look_ups[0] = outcome.parallax_px;
        outcome.far_end_inverse_depth = self.key_inverse_depth(probe, source, source.far_end());
        let begun_there =
            self.settle(probe.uv, source.relative, Some(outcome.far_end_inverse_depth), &mut depth).map(off);
        outcome.after_hand_over =
            std::array::from_fn(|n| begun_there[n.saturating_sub(1).max(1)].max(outcome.after_look_ups[n]));
        let settled_px = positions[MAX_LOOK_UPS];
        outcome.unsettled = positions.map(|source_px| source_px.distance(settled_px));
        if let Some(twist) = &self.twist {
            let dt_s = source.t_s - self.key_s;
            let w = depth.along(if self.nearest_depth { own_px.round() } else { own_px });
            let displaced = |stage: TemporalStage| {
                let uv = constant_twist::displaced(stage, probe.uv, w, twist, dt_s).unwrap_or(DVec2::NAN);
                off(self.ideal.px_from_point(uv.extend(1.0)))
            };
            outcome.linear_px = displaced(TemporalStage::Linear);
            outcome.rk2_px = displaced(TemporalStage::Rk2);
        }
        outcome
    }

    /// Source error of a probe with the depth that n look-ups find at mid-exposure: at its own
    /// instant, or at the end of its exposure that is farther from that, where `far_end_inverse_depth` is
    /// [`SolverErrors::far_end_inverse_depth`].
    pub fn mid_depth_errors(
        &self,
        probe: &Probe,
        source: &ExactSource,
        far_end_inverse_depth: f64,
        detail: Option<&TerrainDetail<'_>>,
    ) -> [f64; MAX_LOOK_UPS + 1] {
        let mut depth = self.ideal_depth(detail);
        let positions_px = self.settle(
            probe.uv,
            self.path.pose(self.instant_s(probe, 0.5)).relative_to(self.key_pose),
            None,
            &mut depth,
        );
        let (rotation, end_shift) =
            self.path.pose(self.instant_s(probe, source.far_end())).relative_to(self.key_pose);
        let (end_direction, (direction, shift)) =
            (rotation * probe.uv.extend(1.0), (source.direction, source.relative.1));
        let at_end_px = |w: f64| self.ideal.px_from_point(end_direction + w * end_shift);
        // Where something else is met there a silhouette has passed.
        let is_one_surface = (far_end_inverse_depth / source.key_inverse_depth - 1.0).abs() < ONE_SURFACE;
        let true_end_px = row_inverse_depth(end_direction, end_shift, far_end_inverse_depth)
            .filter(|_| is_one_surface)
            .map(at_end_px);
        std::array::from_fn(|n| {
            let key_depth = n.checked_sub(1).map(|last| depth.inverse_depth(positions_px[last]));
            let on_line = |direction, shift| {
                key_depth.and_then(|known| row_inverse_depth(direction, shift, known)).unwrap_or(0.0)
            };
            let at_end = true_end_px
                .map_or(0.0, |end_px| at_end_px(on_line(end_direction, end_shift)).distance(end_px));
            self.off_px(source, direction + on_line(direction, shift) * shift).max(at_end)
        })
    }

    /// Source error of a point, given in the key camera.
    fn off_px(&self, source: &ExactSource, point: DVec3) -> f64 {
        let source_px = self.ideal.px_from_point(point);
        if source_px.is_finite() { source_px.distance(source.source_px) } else { f64::INFINITY }
    }

    /// The key frame's inverse depth of what a probe's ray meets at a fraction of the exposure, 1/m; 0 = sky.
    fn key_inverse_depth(&self, probe: &Probe, source: &ExactSource, fraction: f64) -> f64 {
        let t_s = self.instant_s(probe, fraction);
        if t_s == source.t_s {
            return source.key_inverse_depth;
        }
        let ((_, shift), direction, inverse_depth) = self.seen(probe, t_s);
        let z = (direction + inverse_depth * shift).z;
        if z > 0.0 { inverse_depth / z } else { 0.0 }
    }

    /// Source error of a node that takes what lies between the depths of the exposure's ends, and by the
    /// parabola through these and that of its middle. `far_end_inverse_depth` is
    /// [`SolverErrors::far_end_inverse_depth`], if that is known.
    pub fn between_px(
        &self,
        probe: &Probe,
        source: &ExactSource,
        far_end_inverse_depth: Option<f64>,
    ) -> [f64; 2] {
        let depths @ [first, _, last] = [0.0, 0.5, 1.0].map(|fraction| match far_end_inverse_depth {
            Some(known) if fraction == source.far_end() => known,
            _ => self.key_inverse_depth(probe, source, fraction),
        });
        let (direction, shift) = (source.direction, source.relative.1);
        [first + (last - first) * source.fraction, parabola_through(depths)(source.fraction)].map(|between| {
            let w = row_inverse_depth(direction, shift, between).unwrap_or(0.0);
            self.off_px(source, direction + w * shift)
        })
    }

    /// Instant at a fraction of the exposure, 0 to 1.
    fn instant_s(&self, probe: &Probe, fraction: f64) -> f64 {
        let [x, y] = probe.pixel;
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
        mid_s + self.shutter.exposure_pixel_s(x, y) * (fraction - 0.5)
    }

    /// Source at a fraction of the exposure, 0 to 1, of what the probe's ray then meets, and its inverse depth
    /// in the row's camera.
    pub fn true_source_px(&self, probe: &Probe, fraction: f64) -> (DVec2, f64) {
        let ((_, shift), direction, inverse_depth) = self.seen(probe, self.instant_s(probe, fraction));
        (self.ideal.px_from_point(direction + inverse_depth * shift), inverse_depth)
    }

    /// How far polynomial `k` of the exposure's path is from where the probe looks; 0 where its ray passes a
    /// silhouette meanwhile.
    pub fn miss_along_surfaces_px(&self, probe: &Probe, path: PathStage, stretches: u32, k: u32) -> f64 {
        let mut along = Vec::new();
        let px = miss_px(path, stretches, k, |fraction| {
            let (source_px, inverse_depth) = self.true_source_px(probe, fraction);
            along.push((fraction, inverse_depth));
            source_px
        });
        let is_step = |pair: &[(f64, f64)]| match *pair {
            [(from, a), (to, b)] => {
                steps(a, b, |fraction| self.true_source_px(probe, from + (to - from) * fraction).1)
            }
            _ => false,
        };
        if along.windows(2).any(is_step) { 0.0 } else { px }
    }

    /// Source at a fraction of the exposure, 0 to 1, for a surface of the probe's depth.
    pub fn source_px(&self, probe: &Probe, source: &ExactSource, fraction: f64) -> DVec2 {
        let (rotation, shift) = self.path.pose(self.instant_s(probe, fraction)).relative_to(self.key_pose);
        self.ideal.px_from_point(rotation * probe.uv.extend(1.0) + source.inverse_depth * shift)
    }

    /// The positions found: after no look-up, after one and so on, the first of which takes the key's
    /// inverse depth to be `guess`, or that of the plane. The same steps as
    /// [`camsim_core::temporal::reproject`].
    fn settle(
        &self,
        uv: DVec2,
        (rotation, shift): (DMat3, DVec3),
        guess: Option<f64>,
        depth: &mut DepthLookUps<'_>,
    ) -> [DVec2; MAX_LOOK_UPS + 1] {
        let direction = rotation * uv.extend(1.0);
        let mut w = match guess {
            Some(guess) => row_inverse_depth(direction, shift, guess).unwrap_or(0.0),
            None => plane_inverse_depth(direction, shift, self.plane),
        };
        let mut source_px = self.ideal.px_from_point(direction + w * shift);
        let mut last_px = DVec2::INFINITY;
        std::array::from_fn(|n| {
            // A position that gives itself again will do so for ever.
            if n > 0 && source_px != last_px {
                last_px = source_px;
                w = row_inverse_depth(direction, shift, depth.inverse_depth(source_px)).unwrap_or(w);
                source_px = self.ideal.px_from_point(direction + w * shift);
            }
            source_px
        })
    }

    fn key_ray(&self, source_px: DVec2) -> DVec3 {
        key_ray(self.key_pose, self.ideal, source_px)
    }

    fn ideal_depth<'b>(&'b self, detail: Option<&'b TerrainDetail<'b>>) -> DepthLookUps<'b> {
        DepthLookUps::new(self.surfaces, self.key_pose, self.ideal, detail)
    }
}

impl ExactSource {
    /// Fraction of the exposure gone by at its end that is farther away.
    fn far_end(&self) -> f64 {
        if self.fraction > 0.5 { 0.0 } else { 1.0 }
    }

    pub fn is_hidden(&self) -> bool {
        self.key_hit.is_some_and(|hit| self.key_inverse_depth * hit.depth_m < 1.0 - HIDDEN)
    }
}
