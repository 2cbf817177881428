//! Light along a ray: of the first surface, or of all that are blended before it.

use std::cell::RefCell;

use camsim_core::scene::{Texture, Wrap, terrain::intersect_triangle};
use glam::DVec3;

use super::surfaces::{SurfaceHit, Surfaces};

/// Visibility is the distance at which 2 % of a contrast is left, whose logarithm is -3.912.
pub(crate) const FOG_AT_VISIBILITY: f64 = 3.912;

/// Light along a ray.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RayLight {
    /// Linear.
    pub color: DVec3,
    /// The blended surfaces along the ray, from the eye on; numbers as in [`SurfaceHit`].
    pub panes: Vec<usize>,
}

/// Fraction of the light behind panes below which it is not visible.
const HIDDEN: f64 = 1e-7;

/// Where a ray passes through a blended surface.
struct PaneHit {
    t: f64,
    mesh: usize,
    corners: [u32; 3],
    weights: [f64; 3],
    alpha: f64,
}

/// What a ray passes through, as far as anything is seen behind it.
#[derive(Default)]
struct PaneHits {
    nearest_first: Vec<PaneHit>,
    /// Whether what is behind the last one is hidden.
    closed: bool,
}

impl PaneHits {
    fn add(&mut self, pane: PaneHit) {
        let index = self.nearest_first.partition_point(|other| other.t <= pane.t);
        self.nearest_first.insert(index, pane);
        let mut left = 1.0;
        let hides = |pane: &PaneHit| {
            left *= 1.0 - pane.alpha;
            left < HIDDEN
        };
        if let Some(last) = self.nearest_first.iter().position(hides) {
            self.nearest_first.truncate(last + 1);
            self.closed = true;
        }
    }

    /// Behind which nothing is looked for.
    fn limit(&self) -> Option<f64> {
        self.nearest_first.last().filter(|_| self.closed).map(|pane| pane.t)
    }
}

impl Surfaces {
    /// Linear light that arrives along a ray: of `hit`, what it first meets, or where surfaces are blended of
    /// all of those.
    pub fn light(
        &self,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        hit: Option<&SurfaceHit>,
        range_per_depth: f64,
    ) -> RayLight {
        if !self.blends {
            return RayLight { color: self.color(hit, range_per_depth), panes: Vec::new() };
        }
        let solid = self.first_hit_in(&self.solid, origin_ned_m, direction_ned);
        let panes = self.panes(origin_ned_m, direction_ned, solid.map_or(f64::INFINITY, |hit| hit.depth_m));
        let behind = self.smooth_color(solid.as_ref(), range_per_depth);
        let over = |behind: DVec3, (hit, alpha): &(SurfaceHit, f64)| {
            behind.lerp(self.smooth_color(Some(hit), range_per_depth), *alpha)
        };
        RayLight {
            color: panes.iter().rev().fold(behind, over),
            panes: panes.iter().map(|(hit, _)| hit.surface).collect(),
        }
    }

    /// Blended surfaces along a ray before `limit`, from the eye on, with its alpha; without what next to
    /// nothing is left of behind the others.
    fn panes(&self, origin_ned_m: DVec3, direction_ned: DVec3, limit: f64) -> Vec<(SurfaceHit, f64)> {
        let hits = RefCell::new(PaneHits::default());
        self.mixed.first(origin_ned_m, direction_ned, limit, |i, limit| -> Option<(f64, ())> {
            let i = i as usize;
            let mesh = self.scene.meshes.get(i)?;
            let shape_from_ned = self.shape_from_ned[i];
            let (origin, direction) =
                (shape_from_ned * (origin_ned_m - mesh.origin_ned_m), shape_from_ned * direction_ned);
            self.shapes[i].for_rays.first(origin, direction, limit, |triangle, limit| -> Option<(f64, ())> {
                let corners = mesh.shape.triangle(triangle);
                let points = corners.map(|corner| mesh.position_ned_m(corner));
                let (t, weights) = intersect_triangle(points, origin_ned_m, direction_ned, limit)?;
                let alpha = mesh.alpha_at(corners, weights).clamp(0.0, 1.0);
                if alpha > 0.0 && mesh.is_facing(corners, direction_ned) {
                    hits.borrow_mut().add(PaneHit { t, mesh: i, corners, weights, alpha });
                }
                hits.borrow().limit().map(|t| (t, ()))
            })
        });
        let hit = |pane: PaneHit| {
            (self.surface_hit(pane.mesh, pane.t, pane.corners, pane.weights, direction_ned), pane.alpha)
        };
        hits.into_inner().nearest_first.into_iter().map(hit).collect()
    }

    /// Linear light that arrives along a ray of `range_per_depth` metres for each metre of its depth: the
    /// nearest texel of what it met, or the sky, and fog.
    pub fn color(&self, hit: Option<&SurfaceHit>, range_per_depth: f64) -> DVec3 {
        self.color_by(hit, range_per_depth, |texture, table, hit| {
            let [x, y] = [0, 1].map(|axis: usize| {
                let side = f64::from(texture.size_px[axis]);
                (hit.uv[axis].rem_euclid(1.0) * side).min(side - 1.0) as usize
            });
            let first = 4 * (y * texture.size_px[0] as usize + x);
            let light = |channel: usize| {
                texture.rgba8.get(first + channel).map_or(0.0, |&byte| f64::from(table[usize::from(byte)]))
            };
            DVec3::new(light(0), light(1), light(2))
        })
    }

    /// Linear light along a ray, between the texels: two rays to one point see the same, however they round.
    fn smooth_color(&self, hit: Option<&SurfaceHit>, range_per_depth: f64) -> DVec3 {
        self.color_by(hit, range_per_depth, |texture, table, hit| {
            let material = self.mesh(hit).map(|mesh| &mesh.material);
            let (wrap, nearest) =
                material.map_or(([Wrap::Clamp; 2], false), |material| (material.wrap, material.nearest));
            let light = |pixel: &[u8]| {
                DVec3::from_array(
                    [0, 1, 2].map(|channel: usize| f64::from(table[usize::from(pixel[channel])])),
                )
            };
            texture.sample_at(hit.uv, wrap, nearest, light)
        })
    }

    fn color_by(
        &self,
        hit: Option<&SurfaceHit>,
        range_per_depth: f64,
        of_picture: impl Fn(&Texture, &[f32; 256], &SurfaceHit) -> DVec3,
    ) -> DVec3 {
        let sky = DVec3::from_array(self.scene.sky_linear.map(f64::from));
        let Some((hit, texture)) = hit.and_then(|hit| Some((hit, self.texture(hit)?))) else { return sky };
        let table = self
            .linear
            .iter()
            .find(|(encoding, _)| *encoding == texture.encoding)
            .map_or(&self.linear[0].1, |(_, table)| table);
        let clear = self.scene.fog_visibility_m.map_or(1.0, |visibility_m| {
            (-FOG_AT_VISIBILITY * hit.depth_m * range_per_depth / visibility_m).exp()
        });
        let own = self.mesh(hit).map_or([0.0; 3], |mesh| mesh.material.emissive);
        let light = hit.tint * of_picture(texture, table, hit) + DVec3::from_array(own.map(f64::from));
        sky + clear * (light - sky)
    }
}
