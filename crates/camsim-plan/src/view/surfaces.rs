//! What the planner's rays meet: the terrain at full detail and every mesh.
//!
//! What moves is met where it is at the instant of the ray ([`Surfaces::first_hit_at`]). Rays without an instant,
//! and all bounds, have it where it is at path time 0.

mod moving;
#[cfg(test)]
mod tests;

use std::{cell::RefCell, collections::HashMap, sync::Arc};

use camsim_core::{
    pose::CameraPose,
    scene::{
        Aabb, Encoding, Mesh, Scene, Shape, Terrain, TerrainHit, Texture,
        proximity_bvh::ProximityBvh,
        ray_bvh::RayBvh,
        ray_packet::{PacketRay, RayPacket},
        terrain::Frustum,
        terrain::intersect_triangle,
    },
};
use glam::{DMat3, DVec2, DVec3};

use crate::ir::limits::NEAR_M;
use moving::{MovingMeshes, moving_meshes};

/// Surfaces that rays look for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Among {
    /// All.
    All,
    /// The terrain.
    Ground,
    /// All but the terrain.
    Models,
}

/// The surfaces of a scene, prepared for rays.
#[derive(Debug)]
pub(crate) struct Surfaces {
    pub scene: Arc<Scene>,
    /// Boxes around the meshes: of all, of those that may have depth, of those that hide what is behind them,
    /// and of those that are blended with it. A ray passes through thousands of panes to what is behind them.
    tree: ProximityBvh,
    pub deep: RayBvh,
    pub solid: RayBvh,
    pub mixed: RayBvh,
    /// Meshes that move; these trees hold them at path time 0.
    moving: Vec<MovingMeshes>,
    /// `deep` without them; `None` if nothing moves.
    deep_still: Option<RayBvh>,
    /// Trees of each mesh's shape: meshes that share a shape share its tree.
    pub shapes: Vec<Arc<ShapeTrees>>,
    /// From NED to the axes of each mesh's shape.
    pub shape_from_ned: Vec<DMat3>,
    /// Whether any surface is blended.
    pub blends: bool,
    /// Linear light of each byte of a picture, by [`Encoding`].
    pub linear: [(Encoding, [f32; 256]); 2],
}

/// Where a ray first meets something.
#[derive(Clone, Copy)]
pub(crate) struct SurfaceHit {
    /// Ray parameter; planar depth for a direction with z = 1 in its camera, metres.
    pub depth_m: f64,
    /// 0 = terrain, 1 + i = mesh i.
    pub surface: usize,
    /// Texture coordinates there.
    pub uv: [f64; 2],
    /// Factor of the texture's colour there, light included.
    pub tint: DVec3,
    /// Unit normal of the triangle, NED, of either sign.
    pub normal_ned: DVec3,
    /// The position on the terrain, if it is that.
    pub terrain: Option<TerrainHit>,
}

impl SurfaceHit {
    pub fn of_terrain(hit: TerrainHit) -> Self {
        Self {
            depth_m: hit.t,
            surface: 0,
            uv: hit.uv,
            tint: DVec3::ONE,
            normal_ned: hit.normal_ned,
            terrain: Some(hit),
        }
    }
}

/// Trees of a shape's triangles, in its own axes.
#[derive(Debug)]
pub(crate) struct ShapeTrees {
    pub for_rays: RayBvh,
    boxes: ProximityBvh,
}

/// Whether alpha reaches the cut-off anywhere on a mesh. `of_pictures` remembers the largest alpha of each
/// picture.
fn may_have_depth(mesh: &Mesh, of_pictures: &mut HashMap<*const Texture, u8>) -> bool {
    /// Between corners alpha is rounded.
    const HAIR: f64 = 1e-6;
    let texture = &mesh.material.texture;
    let most = || texture.rgba8.chunks_exact(4).map(|pixel| pixel[3]).max().unwrap_or(0);
    let of_picture = f64::from(*of_pictures.entry(Arc::as_ptr(texture)).or_insert_with(most)) / 255.0;
    let of_corners = mesh.shape.vertices.iter().map(|vertex| f64::from(vertex.tint[3])).fold(0.0, f64::max);
    mesh.material.cutoff.is_none_or(|cutoff| of_picture * of_corners + HAIR >= f64::from(cutoff))
}

/// A point of a triangle: its corners and their barycentric weights.
type TrianglePoint = ([u32; 3], [f64; 3]);

impl Surfaces {
    pub fn new(scene: Arc<Scene>) -> Self {
        let mut known: HashMap<*const Shape, Arc<ShapeTrees>> = HashMap::new();
        let tree_of = |shape: &Shape| {
            let boxes = shape.triangle_boxes();
            Arc::new(ShapeTrees { for_rays: RayBvh::new(&boxes), boxes: ProximityBvh::new(&boxes) })
        };
        let shapes = scene.meshes.iter().map(|mesh| {
            known.entry(Arc::as_ptr(&mesh.shape)).or_insert_with(|| tree_of(&mesh.shape)).clone()
        });
        let shapes = shapes.collect();
        let bounds = scene.mesh_bounds();
        let tree_if = |counts: &dyn Fn(&Mesh) -> bool| {
            let counted = bounds
                .iter()
                .zip(&scene.meshes)
                .map(|(of, mesh)| if counts(mesh) { *of } else { Aabb::EMPTY });
            RayBvh::new(&counted.collect::<Vec<_>>())
        };
        let of_pictures = RefCell::new(HashMap::new());
        let is_deep =
            |mesh: &Mesh| !mesh.material.blends || may_have_depth(mesh, &mut of_pictures.borrow_mut());
        let deep = tree_if(&is_deep);
        let deep_still =
            scene.moves().then(|| tree_if(&|mesh: &Mesh| mesh.motion.is_none() && is_deep(mesh)));
        let moving = moving_meshes(&scene, &is_deep);
        let (solid, mixed) = (tree_if(&|mesh| !mesh.material.blends), tree_if(&|mesh| mesh.material.blends));
        let tree = ProximityBvh::new(&bounds);
        let shape_from_ned = scene.meshes.iter().map(|mesh| mesh.ned_from_shape.inverse()).collect();
        let linear = [Encoding::Linear, Encoding::Srgb].map(|encoding| (encoding, encoding.decode_table()));
        let blends = scene.has_blended();
        Self { scene, tree, deep, solid, mixed, moving, deep_still, shapes, shape_from_ned, blends, linear }
    }

    pub fn terrain(&self) -> Option<&Terrain> {
        self.scene.terrain.as_ref()
    }

    /// Whether there is anything but ground and pictures on it.
    pub fn has_models(&self) -> bool {
        self.blends || self.scene.meshes.iter().any(|mesh| mesh.shape.indices.len() > 6)
    }

    /// First surface along `origin + t direction`, t >= 0.
    pub fn first_hit(&self, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<SurfaceHit> {
        self.first_hit_in(&self.deep, origin_ned_m, direction_ned)
    }

    /// Whether anything moves.
    pub fn moves(&self) -> bool {
        self.deep_still.is_some()
    }

    /// First surface along `origin + t direction`, t >= 0, with everything where it is at path time `t_s`.
    pub fn first_hit_at(&self, t_s: f64, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<SurfaceHit> {
        let Some(still) = &self.deep_still else { return self.first_hit(origin_ned_m, direction_ned) };
        let hit = self.first_hit_in(still, origin_ned_m, direction_ned);
        self.nearer_moving(t_s, origin_ned_m, direction_ned, f64::INFINITY, hit)
    }

    /// Meets a packet of rays with what stands still, as [`Self::first_hit_at`].
    pub fn meet_still(&self, packet: &mut RayPacket, among: Among) {
        if let Some(terrain) = self.terrain().filter(|_| among != Among::Models) {
            terrain.meet_packet(packet);
        }
        if among == Among::Ground {
            return;
        }
        let still = self.deep_still.as_ref().unwrap_or(&self.deep);
        still.meet_packet(packet, (DMat3::IDENTITY, DVec3::ZERO), &mut |mesh, packet| {
            let tree = &self.shapes[mesh as usize].for_rays;
            self.scene.meshes[mesh as usize].meet_packet(packet, tree, 1 + mesh);
        });
    }

    /// First surface along `origin + t direction`, 0 <= t <= `limit`, at path time `t_s`.
    pub fn first_hit_among(
        &self,
        among: Among,
        PacketRay { t_s, origin_ned_m, direction_ned, limit }: PacketRay,
    ) -> Option<SurfaceHit> {
        let hit = match among {
            Among::All => self.first_hit_at(t_s, origin_ned_m, direction_ned),
            Among::Ground => self.ground_hit(origin_ned_m, direction_ned).map(SurfaceHit::of_terrain),
            Among::Models => self.model_hit_at(t_s, origin_ned_m, direction_ned, limit),
        };
        hit.filter(|hit| hit.depth_m <= limit)
    }

    /// First point of the terrain along `origin + t direction`, t >= 0.
    fn ground_hit(&self, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<TerrainHit> {
        self.terrain()?.intersect(origin_ned_m, direction_ned, f64::INFINITY)
    }

    /// What moves in front of `limit` along a ray at path time `t_s`.
    pub fn moving_hit_at(
        &self,
        t_s: f64,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        limit: f64,
    ) -> Option<SurfaceHit> {
        self.nearer_moving(t_s, origin_ned_m, direction_ned, limit, None)
    }

    /// First model along `origin + t direction`, 0 <= t <= `limit`, at path time `t_s`.
    pub fn model_hit_at(
        &self,
        t_s: f64,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        limit: f64,
    ) -> Option<SurfaceHit> {
        let still = self.deep_still.as_ref().unwrap_or(&self.deep);
        let hit = self.model_hit_in(still, origin_ned_m, direction_ned, limit);
        self.nearer_moving(t_s, origin_ned_m, direction_ned, limit, hit)
    }

    /// `hit`, or what moves in front of it and before `limit`.
    fn nearer_moving(
        &self,
        t_s: f64,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        limit: f64,
        hit: Option<SurfaceHit>,
    ) -> Option<SurfaceHit> {
        self.moving.iter().fold(hit, |hit, group| {
            let state = group.motion.state(t_s);
            let origin = state.point_at_start(origin_ned_m);
            let direction = state.rotation.conjugate() * direction_ned;
            let meet = |k: u32, limit: f64| {
                let i = group.meshes[k as usize];
                self.triangle_hit(i, origin, direction, limit).map(|(t, on)| (t, (i, on)))
            };
            let limit = hit.map_or(limit, |hit| hit.depth_m);
            let Some((depth_m, (i, (corners, weights)))) = group.tree.first(origin, direction, limit, meet)
            else {
                return hit;
            };
            let now = self.scene.meshes[i].at(t_s);
            Some(self.hit_on(&now, i, depth_m, corners, weights, direction_ned))
        })
    }

    fn model_hit_in(
        &self,
        tree: &RayBvh,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        limit: f64,
    ) -> Option<SurfaceHit> {
        let meet = |mesh: u32, limit: f64| {
            self.mesh_hit(mesh as usize, origin_ned_m, direction_ned, limit).map(|hit| (hit.depth_m, hit))
        };
        tree.first(origin_ned_m, direction_ned, limit, meet).map(|(_, hit)| hit)
    }

    pub fn first_hit_in(
        &self,
        tree: &RayBvh,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
    ) -> Option<SurfaceHit> {
        let ground = self.ground_hit(origin_ned_m, direction_ned);
        let limit = ground.map_or(f64::INFINITY, |hit| hit.t);
        let on_mesh = self.model_hit_in(tree, origin_ned_m, direction_ned, limit);
        on_mesh.or_else(|| ground.map(SurfaceHit::of_terrain))
    }

    /// The boxes are met in the shape's own axes, the triangles where they stand: what is found there is the
    /// same for every way of storing it.
    fn mesh_hit(
        &self,
        i: usize,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        limit: f64,
    ) -> Option<SurfaceHit> {
        let (depth_m, (corners, weights)) = self.triangle_hit(i, origin_ned_m, direction_ned, limit)?;
        Some(self.surface_hit(i, depth_m, corners, weights, direction_ned))
    }

    /// Ray parameter, corners and weights on a mesh, which stands where it is at path time 0.
    fn triangle_hit(
        &self,
        i: usize,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        limit: f64,
    ) -> Option<(f64, TrianglePoint)> {
        let mesh = &self.scene.meshes[i];
        let shape_from_ned = self.shape_from_ned[i];
        let (origin, direction) =
            (shape_from_ned * (origin_ned_m - mesh.origin_ned_m), shape_from_ned * direction_ned);
        let meet = |triangle: u32, limit: f64| {
            let corners = mesh.shape.triangle(triangle);
            let points = corners.map(|corner| mesh.position_ned_m(corner));
            let (t, weights) = intersect_triangle(points, origin_ned_m, direction_ned, limit)?;
            mesh.is_visible(corners, weights, direction_ned).then_some((t, (corners, weights)))
        };
        self.shapes[i].for_rays.first(origin, direction, limit, meet)
    }

    pub fn surface_hit(
        &self,
        i: usize,
        depth_m: f64,
        corners: [u32; 3],
        weights: [f64; 3],
        direction_ned: DVec3,
    ) -> SurfaceHit {
        self.hit_on(&self.scene.meshes[i], i, depth_m, corners, weights, direction_ned)
    }

    /// What is known of a hit on mesh `i`, which stands as `mesh` has it.
    fn hit_on(
        &self,
        mesh: &Mesh,
        i: usize,
        depth_m: f64,
        corners: [u32; 3],
        weights: [f64; 3],
        direction_ned: DVec3,
    ) -> SurfaceHit {
        let [r, g, b, _] = mesh.tint_at(corners, weights);
        let light =
            self.scene.light.map_or(1.0, |light| mesh.light_at(&light, corners, weights, direction_ned));
        let points_m = corners.map(|corner| mesh.position_ned_m(corner));
        SurfaceHit {
            depth_m,
            surface: 1 + i,
            normal_ned: (points_m[1] - points_m[0]).cross(points_m[2] - points_m[0]).normalize_or_zero(),
            uv: mesh.uv_at(corners, weights),
            tint: light * DVec3::new(r, g, b),
            terrain: None,
        }
    }

    /// Position in the picture on what a ray met, texels.
    pub fn texel(&self, hit: &SurfaceHit) -> DVec2 {
        let texture = self.texture(hit);
        texture.map_or(DVec2::ZERO, |texture| {
            DVec2::from_array(hit.uv) * DVec2::from_array(texture.size_px.map(f64::from))
        })
    }

    pub fn mesh(&self, hit: &SurfaceHit) -> Option<&Mesh> {
        hit.surface.checked_sub(1).and_then(|i| self.scene.meshes.get(i))
    }

    pub fn texture(&self, hit: &SurfaceHit) -> Option<&Texture> {
        let of_mesh = self.mesh(hit).map(|mesh| &*mesh.material.texture);
        of_mesh.or(self.terrain().map(|terrain| &*terrain.texture))
    }

    /// Lower bound of the planar depth of anything in view from within `travel_m` of `pose`, metres; infinite
    /// with nothing in view. `tangents` = [u_min, u_max, v_min, v_max].
    pub fn nearest_m(&self, pose: &CameraPose, tangents: [f64; 4], travel_m: f64) -> f64 {
        let r2 = tangents[0].abs().max(tangents[1].abs()).powi(2)
            + tangents[2].abs().max(tangents[3].abs()).powi(2);
        let terrain =
            self.terrain().map_or(f64::INFINITY, |terrain| terrain.min_distance_in_view_m(pose, tangents));
        let frustum = Frustum::new(pose, tangents);
        let measure = |bounds: &Aabb| frustum.may_see(bounds).then(|| bounds.distance_m(pose.position_ned_m));
        // The boxes of a shape's triangles, as they stand.
        let of_mesh = |i: u32| {
            let mesh = &self.scene.meshes[i as usize];
            self.shapes[i as usize]
                .boxes
                .nearest_box_m(|own| measure(&own.turned(mesh.ned_from_shape, mesh.origin_ned_m)))
        };
        let meshes = self.tree.nearest_item_m(measure, of_mesh);
        // Slant range to planar depth by the widest ray; the camera may come closer within the window.
        ((terrain.min(meshes) - travel_m) / (1.0 + r2).sqrt()).max(2.0 * NEAR_M)
    }
}
