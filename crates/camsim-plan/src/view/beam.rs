//! Rays from one point within a narrow pyramid, as around a probe: the triangles that any of them may meet are
//! found once.

use camsim_core::{
    pose::CameraPose,
    scene::{
        Terrain, TerrainTriangle,
        terrain::{Frustum, SeenTriangle},
    },
};
use glam::DVec3;

use super::surfaces::{SurfaceHit, Surfaces};

/// Part of its width by which the pyramid is wider than its rays: far more than rounding.
const WIDER: f64 = 0.01;
/// Part of the extent of a triangle, along the axis, by which a ray may meet it outside of it.
const OUTSIDE: f64 = 1e-3;
/// Most blocks of the terrain, and most triangles: rays that may meet more are cast by themselves.
const MOST_BLOCKS: usize = 48;
const MOST_TRIANGLES: usize = 512;

/// Rays from one point within a narrow pyramid.
pub(crate) struct Beam<'a> {
    surfaces: &'a Surfaces,
    origin_ned_m: DVec3,
    /// Planar depth as far as all triangles are known.
    depth_m: f64,
    /// Those that rays may meet, the nearest first; `None` if there are too many, or a terrain alone, which is as
    /// fast by itself.
    triangles: Option<Vec<BeamTriangle<'a>>>,
}

/// A triangle that rays of a beam may meet.
struct BeamTriangle<'a> {
    /// Least planar depth.
    depth_m: f64,
    seen: SeenTriangle,
    part: Part<'a>,
}

#[derive(Clone, Copy)]
enum Part<'a> {
    Terrain(&'a Terrain, TerrainTriangle),
    /// Of a mesh by its number.
    Mesh(usize, [u32; 3]),
}

impl Surfaces {
    /// Rays of a camera within `tangents` = [u_min, u_max, v_min, v_max] that mostly meet something nearer than
    /// the planar depth `depth_m`.
    pub fn beam(&self, pose: &CameraPose, tangents: [f64; 4], depth_m: f64) -> Beam<'_> {
        let [u_min, u_max, v_min, v_max] = tangents;
        let wider = WIDER * (u_max - u_min).max(v_max - v_min);
        let tangents = [u_min - wider, u_max + wider, v_min - wider, v_max + wider];
        let frustum = Frustum::up_to(pose, tangents, depth_m);
        Beam {
            surfaces: self,
            origin_ned_m: pose.position_ned_m,
            depth_m,
            triangles: if self.has_models() { self.triangles_in(pose, &frustum) } else { None },
        }
    }

    /// Triangles in a frustum, the nearest first; `None` if there are too many.
    fn triangles_in<'a>(&'a self, pose: &CameraPose, frustum: &Frustum) -> Option<Vec<BeamTriangle<'a>>> {
        let axis = pose.ned_from_camera * DVec3::Z;
        let seen = |corners_ned_m: [DVec3; 3], part: Part<'a>| {
            let depths = corners_ned_m.map(|corner| axis.dot(corner - pose.position_ned_m));
            let [least, most] =
                [f64::min, f64::max].map(|of| depths[1..].iter().copied().fold(depths[0], of));
            let depth_m = least - OUTSIDE * (most - least);
            BeamTriangle { depth_m, seen: SeenTriangle::new(corners_ned_m, pose.position_ned_m), part }
        };
        let mut triangles = Vec::new();
        if let Some(terrain) = self.terrain() {
            let of_terrain = terrain.triangles_in(frustum, MOST_BLOCKS)?;
            triangles.extend(
                of_terrain.into_iter().map(|(of, corners)| seen(corners, Part::Terrain(terrain, of))),
            );
        }
        for i in self.deep.items_in(|bounds| frustum.may_see(bounds)) {
            let (i, mesh) = (i as usize, &self.scene.meshes[i as usize]);
            let in_shape = frustum.in_shape(mesh.ned_from_shape, mesh.origin_ned_m);
            for triangle in self.shapes[i].for_rays.items_in(|bounds| in_shape.may_see(bounds)) {
                let corners = mesh.shape.triangle(triangle);
                let corners_ned_m = corners.map(|corner| mesh.position_ned_m(corner));
                if frustum.may_see_triangle(corners_ned_m) {
                    triangles.push(seen(corners_ned_m, Part::Mesh(i, corners)));
                }
            }
            if triangles.len() > MOST_TRIANGLES {
                return None;
            }
        }
        triangles.sort_unstable_by(|a, b| a.depth_m.total_cmp(&b.depth_m));
        Some(triangles)
    }
}

impl Beam<'_> {
    /// Whether any of the rays may meet a model.
    pub fn may_show_models(&self) -> bool {
        let is_model = |triangle: &BeamTriangle<'_>| matches!(triangle.part, Part::Mesh(..));
        self.triangles.as_ref().is_none_or(|triangles| triangles.iter().any(is_model))
    }

    /// What [`Surfaces::first_hit`] finds along a ray of the camera whose depth along its axis is 1.
    pub fn first_hit(&self, direction_ned: DVec3) -> Option<SurfaceHit> {
        let alone = || self.surfaces.first_hit(self.origin_ned_m, direction_ned);
        let Some(triangles) = &self.triangles else { return alone() };
        let (mut limit, mut met) = (f64::INFINITY, None);
        for triangle in triangles {
            if triangle.depth_m > limit {
                break;
            }
            let Some((t, weights)) = triangle.seen.intersect(direction_ned, limit) else { continue };
            if let Part::Mesh(i, corners) = triangle.part
                && !self.surfaces.scene.meshes[i].is_visible(corners, weights, direction_ned)
            {
                continue;
            }
            (limit, met) = (t, Some((triangle.part, weights)));
        }
        match met {
            Some((part, weights)) if limit <= self.depth_m => {
                Some(self.hit(part, limit, weights, direction_ned))
            }
            None if self.depth_m == f64::INFINITY => None,
            _ => alone(),
        }
    }

    fn hit(&self, part: Part<'_>, t: f64, weights: [f64; 3], direction_ned: DVec3) -> SurfaceHit {
        match part {
            Part::Terrain(terrain, triangle) => SurfaceHit::of_terrain(terrain.hit_on(triangle, t, weights)),
            Part::Mesh(i, corners) => self.surfaces.surface_hit(i, t, corners, weights, direction_ned),
        }
    }
}
