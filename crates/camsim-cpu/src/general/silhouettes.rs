//! Silhouette rays: detection of the pixels that may see several surfaces, and the mean colour of rays over
//! their area and exposure. Twin of `camsim-gpu/shaders/reverse/edges`.

use camsim_core::temporal::silhouette_rays::{nearest_first, subsample};
use camsim_plan::EdgeStage;
use glam::{DVec2, DVec3, Vec3};

use super::{Pixel, ReversePass, keys::Key, rows::Pose, solver::Solver};
use crate::silhouettes::{RayPath, SilhouetteImage, StraightRay, SurfaceHit};

/// Least weight of edge pixels with which a mean counts as having touched an edge.
const MIN_EDGE_WEIGHT: f64 = 1e-4;
/// Largest distance between the hit of a ray and the source of the plain gather on the same surface, ideal
/// pixels.
const PLAIN_PX: f64 = 0.25;
/// Largest difference of two depths of one surface, as parallax in ideal pixels.
const SAME_PX: f64 = 0.25;

/// A ray of a solver of constant twist, which keeps depths.
struct TwistedRay<'a> {
    solver: &'a Solver,
    uv: DVec2,
    pose: &'a Pose,
}

impl RayPath for TwistedRay<'_> {
    fn point(&self, w: f32) -> [f32; 3] {
        self.solver.point(self.uv, self.pose, w.into()).as_vec3().to_array()
    }

    fn row_inverse_depth(&self, in_key: f32) -> f32 {
        in_key
    }
}

fn straight_ray(uv: DVec2, pose: &Pose) -> StraightRay {
    let direction = (pose.rotation * uv.extend(1.0)).as_vec3().to_array();
    StraightRay { direction, shift_m: pose.shift_m.as_vec3().to_array() }
}

impl Solver {
    /// Whether the parallax of a ray passes a silhouette.
    fn is_near_silhouette(&self, uv: DVec2, pose: &Pose, image: &SilhouetteImage<'_>) -> bool {
        match self.is_exact() {
            true => image.is_near_silhouette(&straight_ray(uv, pose)),
            false => image.is_near_silhouette(&TwistedRay { solver: self, uv, pose }),
        }
    }

    /// First intersection of a ray with the surfaces of an ideal frame.
    fn first_surface(&self, uv: DVec2, pose: &Pose, image: &SilhouetteImage<'_>) -> SurfaceHit {
        match self.is_exact() {
            true => image.first_surface(&straight_ray(uv, pose)),
            false => image.first_surface(&TwistedRay { solver: self, uv, pose }),
        }
    }
}

impl ReversePass<'_> {
    /// Whether a pixel may see several surfaces. `far_px` are those of its path; `marked` says whether the
    /// plain gather touched an edge pixel.
    pub(super) fn silhouette(
        &self,
        pixel: &Pixel<'_>,
        far_px: [DVec2; 2],
        marked: bool,
    ) -> Option<Silhouette> {
        let image = self.keys[pixel.key].silhouettes.as_ref()?;
        let uv = pixel.ray.uv;
        let is_near = |pose: &Pose| self.gather.solver.is_near_silhouette(uv, pose, image);
        let near_mid = || is_near(&pixel.exposure.mid);
        // The bounds of the tile come first: they are cheap, and most pixels are far from all silhouettes.
        let within_reach = || {
            self.gather.solver.has_parallax()
                && far_px.iter().any(|far_px| image.reach(far_px.as_vec2().to_array()).has_edge)
                || self.plan.truth && near_mid()
        };
        // Ends and middle of the exposure: the corner of a surface may pass in between.
        let nodes = pixel.exposure.nodes;
        let may_hit_others = || {
            [nodes.first(), nodes.last()].into_iter().flatten().any(is_near)
                || (self.plan.truth || nodes.len() > 1) && near_mid()
        };
        (marked || within_reach() && may_hit_others()).then_some(Silhouette { marked })
    }

    /// Mean linear colour of the silhouette rays of a pixel. `None` if its rays see one surface.
    pub(super) fn color_of_rays(&self, pixel: &Pixel<'_>, silhouette: Silhouette) -> Option<DVec3> {
        let EdgeStage::Supersampled { samples: count @ 1.., .. } = self.plan.edges else { return None };
        let sees_several =
            silhouette.marked || self.gather.solver.has_parallax() && !self.sees_one_surface(pixel);
        sees_several.then(|| {
            let [d_dx, d_dy] = pixel.ray.d_uv;
            let color = |i: u32| {
                let (position, fraction) = subsample(i, count);
                let uv = pixel.ray.uv + position.x * d_dx + position.y * d_dy;
                self.first_surface_of_keys(pixel, uv, fraction)
                    .map_or(Vec3::ZERO, |(image, hit)| image.color(hit.position_px))
            };
            ((0..count).map(color).sum::<Vec3>() / count as f32).as_dvec3()
        })
    }

    /// Whether a pixel whose sources pass no edge sees one surface all over its area. If its parallax passes
    /// a silhouette, rays at its four corners must hit what the plain gather reads there. One surface is
    /// better read by the plain gather, which interpolates more smoothly.
    fn sees_one_surface(&self, pixel: &Pixel<'_>) -> bool {
        let key = &self.keys[pixel.key];
        let Some(image) = &key.silhouettes else { return true };
        let solver = &self.gather.solver;
        let [d_dx, d_dy] = pixel.ray.d_uv;
        let corners = || {
            [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]
                .map(|[x, y]| pixel.ray.uv + x * d_dx + y * d_dy)
        };
        let fractions: &[f64] = if pixel.exposure.nodes.len() > 1 { &[0.0, 0.5, 1.0] } else { &[0.5] };
        fractions.iter().map(|&fraction| pixel.exposure.pose(fraction)).all(|pose| {
            !solver.is_near_silhouette(pixel.ray.uv, &pose, image)
                || corners().into_iter().all(|uv| {
                    let hit = solver.first_surface(uv, &pose, image);
                    let plain_px = solver.source(uv, &pose, &key.depth).position_px;
                    hit.is_visible && position(&hit).distance(plain_px) <= PLAIN_PX
                })
        })
    }

    /// First intersection of a ray at a fraction of the exposure: in the key frame that is nearest in time, or
    /// in the next nearest where the point is visible.
    pub(super) fn first_surface_of_keys(
        &self,
        pixel: &Pixel<'_>,
        uv: DVec2,
        fraction: f64,
    ) -> Option<(&SilhouetteImage<'_>, SurfaceHit)> {
        let [row_fraction, exposure_fraction] = self.rows.fractions(pixel.position);
        let window_fraction = row_fraction + (fraction - 0.5) * exposure_fraction;
        let mut first = None;
        for number in nearest_first(window_fraction, self.keys.len()) {
            let pose = self.rows.exposure(number, pixel.position).pose(fraction);
            let image = self.keys[number].silhouettes.as_ref()?;
            let hit = self.gather.solver.first_surface(uv, &pose, image);
            if hit.is_visible {
                return Some((image, hit));
            }
            first = first.or(Some((image, hit)));
        }
        first
    }

    /// Whether the parallax of a pixel's centre ray passes a silhouette at a fraction of the exposure.
    pub(super) fn is_near_silhouette(&self, pixel: &Pixel<'_>, fraction: f64) -> bool {
        let pose = pixel.exposure.pose(fraction);
        self.keys[pixel.key]
            .silhouettes
            .as_ref()
            .is_some_and(|image| self.gather.solver.is_near_silhouette(pixel.ray.uv, &pose, image))
    }

    /// First intersection of a pixel's centre ray at a fraction of the exposure: position in the key frame, and
    /// inverse depth in the row's camera, 1/m.
    pub(super) fn centre_hit(&self, pixel: &Pixel<'_>, fraction: f64) -> Option<(DVec2, f64)> {
        let (image, hit) = self.first_surface_of_keys(pixel, pixel.ray.uv, fraction)?;
        let pose = pixel.exposure.pose(fraction);
        let w = self.smooth_depth(
            &self.keys[pixel.key],
            image,
            pixel.ray.uv,
            &pose,
            hit.row_inverse_depth.into(),
        );
        Some((image.geometry().px_from_point(self.gather.solver.point(pixel.ray.uv, &pose, w)), w))
    }

    /// Refines the inverse depth of a hit (1/m) by interpolation between pixel centres, which is smoother
    /// than samples. Edge pixels keep the sample's depth.
    fn smooth_depth(
        &self,
        key: &Key<'_>,
        image: &SilhouetteImage<'_>,
        uv: DVec2,
        pose: &Pose,
        hit: f64,
    ) -> f64 {
        let solver = &self.gather.solver;
        let position = |w: f64| image.geometry().px_from_point(solver.point(uv, pose, w));
        let hit_px = position(hit);
        if image.touches_edge(hit_px.as_vec2().to_array()) {
            return hit;
        }
        let px_per_w = hit_px.distance(position(0.0)) / hit.max(1e-12);
        let step = |w: f64| solver.inverse_depth_in_row(uv, pose, key.depth.image.inverse_depth(position(w)));
        let w = step(step(step(hit)));
        if (w - hit).abs() * px_per_w < SAME_PX { w } else { hit }
    }
}

/// A pixel that may see several surfaces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Silhouette {
    /// Whether the plain gather touched an edge pixel.
    marked: bool,
}

/// Whether a mean of the edge image touched an edge pixel. The mean is negative if the pixel has a negative
/// weight of the spline.
pub(super) fn touches_edge(mean: f64) -> bool {
    mean.abs() > MIN_EDGE_WEIGHT
}

fn position(hit: &SurfaceHit) -> DVec2 {
    DVec2::from_array(hit.position_px.map(f64::from))
}
