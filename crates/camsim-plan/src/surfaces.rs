//! What the plan's rays meet: the terrain at full detail and every mesh.

use std::{cell::RefCell, collections::HashMap, sync::Arc};

use glam::{DMat3, DVec2, DVec3};

use super::NEAR_M;
use camsim_core::{
    pose::CameraPose,
    scene::{
        Aabb, Encoding, Mesh, Scene, Shape, Terrain, TerrainHit, Texture, Wrap, box_tree::BoxTree,
        ray_tree::RayTree, terrain::Frustum, terrain::intersect_triangle,
    },
};

/// Visibility is the distance at which 2 % of a contrast is left, whose logarithm is -3.912.
pub(super) const FOG_AT_VISIBILITY: f64 = 3.912;

/// The surfaces of a scene, prepared for rays.
#[derive(Debug)]
pub(super) struct Surfaces {
    scene: Arc<Scene>,
    /// Boxes around the meshes: of all, of those that may have depth, of those that hide what is behind them,
    /// and of those that are mixed with it. A ray passes through thousands of panes to what is behind them.
    tree: BoxTree,
    /// Around each mesh.
    bounds: Vec<Aabb>,
    deep: RayTree,
    solid: RayTree,
    mixed: RayTree,
    /// Around the triangles of each mesh's shape: meshes that share a shape share its tree.
    shapes: Vec<Arc<ShapeTrees>>,
    /// From NED to the axes of each mesh's shape.
    shape_from_ned: Vec<DMat3>,
    /// Whether anything is mixed with what is behind it.
    blends: bool,
    /// Linear light of each byte of a picture, by [`Encoding`].
    linear: [(Encoding, [f32; 256]); 2],
}

/// Where a ray first meets something.
#[derive(Clone, Copy)]
pub(super) struct Met {
    /// Ray parameter; planar depth for a direction with z = 1 in its camera, metres.
    pub depth_m: f64,
    /// 0 = terrain, 1 + i = mesh i.
    pub surface: usize,
    /// Texture coordinates there.
    pub uv: [f64; 2],
    /// Factor of the texture's colour there, light included.
    pub tint: DVec3,
    /// The place on the terrain, if it is that.
    pub terrain: Option<TerrainHit>,
}

/// Light along a ray.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Light {
    /// Linear.
    pub color: DVec3,
    /// The surfaces that it is mixed by, from the eye on; as in [`Met`].
    pub panes: Vec<usize>,
}

/// Share of the light behind panes below which nobody sees it.
const HIDDEN: f64 = 1e-7;

/// Where a ray passes through something that is mixed with what is behind it.
struct Pane {
    t: f64,
    mesh: usize,
    corners: [u32; 3],
    weights: [f64; 3],
    alpha: f64,
}

/// What a ray passes through, as far as anything is seen behind it.
#[derive(Default)]
struct Panes {
    nearest_first: Vec<Pane>,
    /// Whether what is behind the last one is hidden.
    closed: bool,
}

impl Panes {
    fn add(&mut self, pane: Pane) {
        let place = self.nearest_first.partition_point(|other| other.t <= pane.t);
        self.nearest_first.insert(place, pane);
        let mut left = 1.0;
        let hides = |pane: &Pane| {
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

/// Of a shape's triangles, in its own axes.
#[derive(Debug)]
struct ShapeTrees {
    for_rays: RayTree,
    boxes: BoxTree,
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

impl Surfaces {
    pub fn new(scene: Arc<Scene>) -> Self {
        let mut known: HashMap<*const Shape, Arc<ShapeTrees>> = HashMap::new();
        let tree_of = |shape: &Shape| {
            let triangle = |of: &[u32]| {
                let mut bounds = Aabb::EMPTY;
                let at = |&v: &u32| {
                    shape
                        .vertices
                        .get(v as usize)
                        .map(|vertex| DVec3::from_array(vertex.position_m.map(f64::from)))
                };
                of.iter().filter_map(at).for_each(|corner| bounds.include(corner));
                // A ray in the shape's axes is rounded.
                let hair = 1e-9 * bounds.min.abs().max(bounds.max.abs()).max_element();
                Aabb { min: bounds.min - hair, max: bounds.max + hair }
            };
            let boxes: Vec<Aabb> = shape.indices.chunks_exact(3).map(triangle).collect();
            Arc::new(ShapeTrees { for_rays: RayTree::new(&boxes), boxes: BoxTree::new(&boxes) })
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
            RayTree::new(&counted.collect::<Vec<_>>())
        };
        let of_pictures = RefCell::new(HashMap::new());
        let deep =
            tree_if(&|mesh| !mesh.material.blends || may_have_depth(mesh, &mut of_pictures.borrow_mut()));
        let (solid, mixed) = (tree_if(&|mesh| !mesh.material.blends), tree_if(&|mesh| mesh.material.blends));
        let tree = BoxTree::new(&bounds);
        let shape_from_ned = scene.meshes.iter().map(|mesh| mesh.ned_from_shape.inverse()).collect();
        let linear = [Encoding::Linear, Encoding::Srgb].map(|encoding| (encoding, encoding.decode_table()));
        let blends = scene.has_blended();
        Self { scene, tree, bounds, deep, solid, mixed, shapes, shape_from_ned, blends, linear }
    }

    pub fn terrain(&self) -> Option<&Terrain> {
        self.scene.terrain.as_ref()
    }

    /// Whether a camera may see anything but ground within `tangents` = [u_min, u_max, v_min, v_max] and so
    /// far away.
    pub fn may_show_models(&self, pose: &CameraPose, tangents: [f64; 4], range_m: f64) -> bool {
        let frustum = Frustum::new(pose, tangents);
        let measure = |bounds: &Aabb| {
            (bounds.distance_m(pose.position_ned_m) <= range_m && frustum.may_see(bounds)).then_some(0.0)
        };
        let of_mesh = |i: u32| measure(&self.bounds[i as usize]).unwrap_or(f64::INFINITY);
        self.tree.nearest_thing_m(measure, of_mesh) == 0.0
    }

    /// Whether there is anything but ground and pictures on it.
    pub fn has_models(&self) -> bool {
        self.blends || self.scene.meshes.iter().any(|mesh| mesh.shape.indices.len() > 6)
    }

    /// Whether anything is mixed with what is behind it.
    pub fn blends(&self) -> bool {
        self.blends
    }

    /// First surface along `origin + t direction`, t >= 0.
    pub fn meet(&self, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<Met> {
        self.meet_in(&self.deep, origin_ned_m, direction_ned)
    }

    fn meet_in(&self, tree: &RayTree, origin_ned_m: DVec3, direction_ned: DVec3) -> Option<Met> {
        let ground =
            self.terrain().and_then(|terrain| terrain.intersect(origin_ned_m, direction_ned, f64::INFINITY));
        let limit = ground.map_or(f64::INFINITY, |hit| hit.t);
        let on_mesh = tree.first(origin_ned_m, direction_ned, limit, |mesh, limit| {
            self.meet_mesh(mesh as usize, origin_ned_m, direction_ned, limit).map(|met| (met.depth_m, met))
        });
        let on_ground = || {
            ground.map(|hit| Met {
                depth_m: hit.t,
                surface: 0,
                uv: hit.uv,
                tint: DVec3::ONE,
                terrain: Some(hit),
            })
        };
        on_mesh.map(|(_, met)| met).or_else(on_ground)
    }

    /// The boxes are met in the shape's own axes, the triangles where they stand: what is found there is the
    /// same for every way of storing it.
    fn meet_mesh(&self, i: usize, origin_ned_m: DVec3, direction_ned: DVec3, limit: f64) -> Option<Met> {
        let mesh = &self.scene.meshes[i];
        let shape_from_ned = self.shape_from_ned[i];
        let (origin, direction) =
            (shape_from_ned * (origin_ned_m - mesh.origin_ned_m), shape_from_ned * direction_ned);
        let meet = |triangle: u32, limit: f64| {
            let corners = [0, 1, 2].map(|k| mesh.shape.indices[3 * triangle as usize + k]);
            let points = corners.map(|corner| mesh.position_ned_m(corner));
            let (t, weights) = intersect_triangle(points, origin_ned_m, direction_ned, limit)?;
            mesh.shows(corners, weights, direction_ned).then_some((t, (corners, weights)))
        };
        let (depth_m, (corners, weights)) = self.shapes[i].for_rays.first(origin, direction, limit, meet)?;
        Some(self.met(i, depth_m, corners, weights, direction_ned))
    }

    fn met(&self, i: usize, depth_m: f64, corners: [u32; 3], weights: [f64; 3], direction_ned: DVec3) -> Met {
        let mesh = &self.scene.meshes[i];
        let [r, g, b, _] = mesh.tint_at(corners, weights);
        let light =
            self.scene.light.map_or(1.0, |light| mesh.light_at(&light, corners, weights, direction_ned));
        Met {
            depth_m,
            surface: 1 + i,
            uv: mesh.uv_at(corners, weights),
            tint: light * DVec3::new(r, g, b),
            terrain: None,
        }
    }

    /// Linear light that arrives along a ray: of `met`, what it first meets, or where surfaces are mixed of
    /// all of those.
    pub fn light(
        &self,
        origin_ned_m: DVec3,
        direction_ned: DVec3,
        met: Option<&Met>,
        range_per_depth: f64,
    ) -> Light {
        if !self.blends {
            return Light { color: self.color(met, range_per_depth), panes: Vec::new() };
        }
        let solid = self.meet_in(&self.solid, origin_ned_m, direction_ned);
        let panes = self.panes(origin_ned_m, direction_ned, solid.map_or(f64::INFINITY, |met| met.depth_m));
        let behind = self.smooth_color(solid.as_ref(), range_per_depth);
        let over = |behind: DVec3, (met, alpha): &(Met, f64)| {
            behind.lerp(self.smooth_color(Some(met), range_per_depth), *alpha)
        };
        Light {
            color: panes.iter().rev().fold(behind, over),
            panes: panes.iter().map(|(met, _)| met.surface).collect(),
        }
    }

    /// What is mixed along a ray before `limit`, from the eye on, with its alpha; without what next to
    /// nothing is left of behind the others.
    fn panes(&self, origin_ned_m: DVec3, direction_ned: DVec3, limit: f64) -> Vec<(Met, f64)> {
        let found = RefCell::new(Panes::default());
        self.mixed.first(origin_ned_m, direction_ned, limit, |i, limit| -> Option<(f64, ())> {
            let i = i as usize;
            let mesh = self.scene.meshes.get(i)?;
            let shape_from_ned = self.shape_from_ned[i];
            let (origin, direction) =
                (shape_from_ned * (origin_ned_m - mesh.origin_ned_m), shape_from_ned * direction_ned);
            self.shapes[i].for_rays.first(origin, direction, limit, |triangle, limit| -> Option<(f64, ())> {
                let corners = [0, 1, 2].map(|k| mesh.shape.indices[3 * triangle as usize + k]);
                let points = corners.map(|corner| mesh.position_ned_m(corner));
                let (t, weights) = intersect_triangle(points, origin_ned_m, direction_ned, limit)?;
                let alpha = mesh.alpha_at(corners, weights).clamp(0.0, 1.0);
                if alpha > 0.0 && mesh.faces(corners, direction_ned) {
                    found.borrow_mut().add(Pane { t, mesh: i, corners, weights, alpha });
                }
                found.borrow().limit().map(|t| (t, ()))
            })
        });
        let met =
            |pane: Pane| (self.met(pane.mesh, pane.t, pane.corners, pane.weights, direction_ned), pane.alpha);
        found.into_inner().nearest_first.into_iter().map(met).collect()
    }

    /// Place in the picture on what a ray met, texels.
    pub fn texel(&self, met: &Met) -> DVec2 {
        let texture = self.texture(met);
        texture.map_or(DVec2::ZERO, |texture| {
            DVec2::from_array(met.uv) * DVec2::from_array(texture.size_px.map(f64::from))
        })
    }

    /// Linear light that arrives along a ray of `range_per_depth` metres for each metre of its depth: the
    /// nearest texel of what it met, or the sky, and fog.
    pub fn color(&self, met: Option<&Met>, range_per_depth: f64) -> DVec3 {
        self.color_by(met, range_per_depth, |texture, table, met| {
            let [x, y] = [0, 1].map(|axis: usize| {
                let side = f64::from(texture.size_px[axis]);
                (met.uv[axis].rem_euclid(1.0) * side).min(side - 1.0) as usize
            });
            let first = 4 * (y * texture.size_px[0] as usize + x);
            let light = |channel: usize| {
                texture.rgba8.get(first + channel).map_or(0.0, |&byte| f64::from(table[usize::from(byte)]))
            };
            DVec3::new(light(0), light(1), light(2))
        })
    }

    /// The same, between the texels: two rays to one point see the same, however they round.
    fn smooth_color(&self, met: Option<&Met>, range_per_depth: f64) -> DVec3 {
        self.color_by(met, range_per_depth, |texture, table, met| {
            let material = self.mesh(met).map(|mesh| &mesh.material);
            let (wrap, nearest) =
                material.map_or(([Wrap::Clamp; 2], false), |material| (material.wrap, material.nearest));
            let light = |pixel: &[u8]| {
                DVec3::from_array(
                    [0, 1, 2].map(|channel: usize| f64::from(table[usize::from(pixel[channel])])),
                )
            };
            texture.read_at(met.uv, wrap, nearest, light)
        })
    }

    fn color_by(
        &self,
        met: Option<&Met>,
        range_per_depth: f64,
        of_picture: impl Fn(&Texture, &[f32; 256], &Met) -> DVec3,
    ) -> DVec3 {
        let sky = DVec3::from_array(self.scene.sky_linear.map(f64::from));
        let Some((met, texture)) = met.and_then(|met| Some((met, self.texture(met)?))) else { return sky };
        let table = self
            .linear
            .iter()
            .find(|(encoding, _)| *encoding == texture.encoding)
            .map_or(&self.linear[0].1, |(_, table)| table);
        let clear = self.scene.fog_visibility_m.map_or(1.0, |visibility_m| {
            (-FOG_AT_VISIBILITY * met.depth_m * range_per_depth / visibility_m).exp()
        });
        let own = self.mesh(met).map_or([0.0; 3], |mesh| mesh.material.emissive);
        let light = met.tint * of_picture(texture, table, met) + DVec3::from_array(own.map(f64::from));
        sky + clear * (light - sky)
    }

    fn mesh(&self, met: &Met) -> Option<&Mesh> {
        met.surface.checked_sub(1).and_then(|i| self.scene.meshes.get(i))
    }

    fn texture(&self, met: &Met) -> Option<&Texture> {
        let of_mesh = self.mesh(met).map(|mesh| &*mesh.material.texture);
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
        let meshes = self.tree.nearest_thing_m(measure, of_mesh);
        // Slant range to planar depth by the widest ray; the camera may come closer within the window.
        ((terrain.min(meshes) - travel_m) / (1.0 + r2).sqrt()).max(2.0 * NEAR_M)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use glam::{DQuat, EulerRot};

    use super::*;
    use camsim_core::scene::MeshVertex;

    /// Waves of 30 m under three pictures at different heights, one of them tilted.
    fn scene() -> Scene {
        let heights: Vec<f64> = (0..97 * 97)
            .map(|i| 30.0 * (f64::from(i % 97) * 0.3).sin() * (f64::from(i / 97) * 0.2).cos())
            .collect();
        let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
        let picture = |north_m: f64, height_m: f64| {
            Mesh::level_picture(texture.clone(), DVec3::new(north_m, 10.0, -height_m), 60.0)
        };
        let mut meshes = vec![picture(-100.0, 40.0), picture(0.0, 60.0), picture(100.0, 5.0)];
        Arc::make_mut(&mut meshes[1].shape).vertices[0].position_m[2] = 25.0;
        Scene {
            terrain: Some(Terrain::from_heights(97, 97, 10.0, &heights, None).unwrap()),
            meshes,
            ..Scene::default()
        }
    }

    #[test]
    fn models_are_shown_only_within_sight_and_reach() {
        let surfaces = Surfaces::new(Arc::new(scene()));
        let above =
            CameraPose { position_ned_m: DVec3::new(0.0, 10.0, -300.0), ned_from_camera: DQuat::IDENTITY };
        let tangents = |north: f64| [north - 0.01, north + 0.01, -0.01, 0.01];
        // Straight down there is one 240 m below; between two of them, and to the side, is ground alone.
        assert!(
            surfaces.may_show_models(&above, tangents(0.0), 241.0)
                && !surfaces.may_show_models(&above, tangents(0.0), 200.0)
        );
        assert!(
            !surfaces.may_show_models(&above, tangents(0.19), f64::INFINITY)
                && !surfaces.may_show_models(&above, tangents(3.0), f64::INFINITY)
        );
    }

    #[test]
    fn rays_meet_what_a_look_at_every_triangle_finds() {
        let mut scene = scene();
        // A picture again, turned, as a mesh of the same shape.
        let ned_from_shape = DMat3::from_rotation_z(0.5) * DMat3::from_rotation_x(0.4) * 1.3;
        scene.meshes.push(Mesh {
            ned_from_shape,
            origin_ned_m: DVec3::new(-40.0, -50.0, -70.0),
            ..scene.meshes[1].clone()
        });
        // Mirrored, and pressed flat: of that there is no way back to the shape's axes.
        let sides = [DVec3::new(-1.0, 1.2, 1.0), DVec3::new(0.6, 0.6, 0.0), DVec3::new(1.0, 0.0, 1.0)];
        scene.meshes.extend(
            sides
                .into_iter()
                .enumerate()
                .map(|(k, sides)| Mesh {
                    ned_from_shape: DMat3::from_rotation_x(0.1) * DMat3::from_diagonal(sides),
                    origin_ned_m: DVec3::new(30.0 * k as f64 - 20.0, 25.0, -65.0 - k as f64),
                    ..scene.meshes[1].clone()
                })
                .collect::<Vec<_>>(),
        );
        let terrain = scene.terrain.as_ref().unwrap();
        let of_terrain: Vec<[DVec3; 3]> = (0..terrain.chunks.len() as u32)
            .flat_map(|chunk| {
                let [columns, rows] = terrain.chunks[chunk as usize].cells;
                (0..rows).flat_map(move |j| (0..columns).map(move |i| (chunk, i, j)))
            })
            .flat_map(|(chunk, i, j)| {
                let at = |a: u32, b: u32| terrain.position_ned_m(chunk, i + a, j + b);
                [[at(0, 0), at(1, 1), at(1, 0)], [at(0, 0), at(0, 1), at(1, 1)]]
            })
            .collect();
        let surfaces = Surfaces::new(Arc::new(scene.clone()));
        let (mut seen, mut missed, mut flat) = ([0; 2], 0, 0);
        for k in 0..150 {
            let angle = 0.37 * f64::from(k);
            let origin = DVec3::new(3.0 * f64::from(k % 71) - 100.0, 40.0 * angle.sin(), -80.0);
            // From straight down to above the horizon.
            let direction =
                DVec3::new(angle.cos(), angle.sin(), 1.6 * (0.11 * f64::from(k)).cos().abs() - 0.05);
            let ground = of_terrain
                .iter()
                .filter_map(|&points| intersect_triangle(points, origin, direction, f64::INFINITY))
                .map(|hit| hit.0);
            let ground = ground.fold(f64::INFINITY, f64::min);
            let meshes = scene
                .meshes
                .iter()
                .filter_map(|mesh| mesh.intersect(origin, direction, f64::INFINITY))
                .map(|hit| hit.0);
            let meshes = meshes.fold(f64::INFINITY, f64::min);
            let found = surfaces.meet(origin, direction);
            assert_eq!(found.map_or(f64::INFINITY, |met| met.depth_m), ground.min(meshes), "ray {k}");
            match found {
                Some(met) => {
                    assert_eq!(met.surface > 0, meshes < ground);
                    seen[usize::from(met.surface > 0)] += 1;
                    flat += u32::from(met.surface == 6);
                }
                None => missed += 1,
            }
        }
        assert!(seen[0] > 50 && seen[1] > 10 && missed > 2 && flat > 2, "{seen:?} {missed} {flat}");
    }

    #[test]
    fn of_a_thousand_panes_those_are_seen_that_let_light_through() {
        let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
        let level = |height_m: f64, tint: [f32; 4]| {
            let mut mesh = Mesh::level_picture(texture.clone(), DVec3::new(0.0, 0.0, -height_m), 8.0);
            Arc::make_mut(&mut mesh.shape).vertices.iter_mut().for_each(|vertex| vertex.tint = tint);
            mesh
        };
        let pane = |height_m: f64, tint: [f32; 4]| {
            let mut mesh = level(height_m, tint);
            (mesh.material.blends, mesh.material.cutoff) = (true, Some(0.5));
            mesh
        };
        let alpha = |k: u32| 0.02 + 0.3 * (f64::from(k) * 0.618_034).fract();
        // Each by itself in no order of height, then all of them as one shape.
        let many: Vec<Mesh> = (0..1000)
            .map(|k| k * 389 % 1000)
            .map(|k| pane(0.1 * f64::from(k), [0.4, 0.001 * k as f32, 0.2, alpha(k) as f32]))
            .collect();
        let mut one = pane(0.0, [0.0; 4]);
        let shape = Arc::make_mut(&mut one.shape);
        (shape.vertices, shape.indices) = (Vec::new(), Vec::new());
        for mesh in &many {
            let first = shape.vertices.len() as u32;
            let z_m = mesh.origin_ned_m.z as f32;
            shape.vertices.extend(mesh.shape.vertices.iter().map(|vertex| {
                let [x, y, _] = vertex.position_m;
                MeshVertex { position_m: [x, y, z_m], ..*vertex }
            }));
            shape.indices.extend(mesh.shape.indices.iter().map(|index| first + index));
        }
        let (eye, down) = (DVec3::new(0.3, -0.7, -120.0), DVec3::new(0.001, 0.002, 1.0));
        let over = |behind: DVec3, k: u32| behind.lerp(DVec3::new(0.4, 0.001 * f64::from(k), 0.2), alpha(k));
        let expected = (0..1000).fold(DVec3::ONE, over);
        for panes in [many, vec![one]] {
            let surfaces = Surfaces::new(Arc::new(Scene {
                meshes: [panes, vec![level(-1.0, [1.0; 4])]].concat(),
                ..Scene::default()
            }));
            let met = surfaces.meet(eye, down);
            assert!(
                met.is_some_and(|met| (met.depth_m - 121.0).abs() < 1e-9),
                "what has no depth anywhere is not met"
            );
            let light = surfaces.light(eye, down, met.as_ref(), 1.0);
            assert!((light.color - expected).abs().max_element() < 1e-6, "{} {expected}", light.color);
            assert!((40..200).contains(&light.panes.len()), "{}", light.panes.len());
        }
    }

    #[test]
    fn meshes_behind_the_camera_are_not_near() {
        let mut scene = scene();
        scene.terrain = None;
        let surfaces = Surfaces::new(Arc::new(scene));
        let pose = |pitch_deg: f64| CameraPose {
            position_ned_m: DVec3::new(0.0, 10.0, -160.0),
            ned_from_camera: DQuat::from_euler(EulerRot::ZYX, 0.0, f64::to_radians(pitch_deg), 0.0)
                * DQuat::from_mat3(&glam::DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X)),
        };
        let view = [-0.5, 0.5, -0.5, 0.5];
        // The middle picture is 100 m below, the corner of another 25 m nearer than its centre would be, at a
        // slant of at most sqrt(1.5). Boxes are larger by 1e-9 of their reach of 30 m.
        let down = surfaces.nearest_m(&pose(-90.0), view, 1.0);
        assert!(down <= 99.0 && down >= 99.0 / 1.5_f64.sqrt() - 3.1e-8, "{down}");
        assert_eq!(surfaces.nearest_m(&pose(60.0), view, 1.0), f64::INFINITY);
    }
}
