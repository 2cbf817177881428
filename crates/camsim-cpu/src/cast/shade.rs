//! Colour of a triangle at a position of an ideal frame. Twin of `camsim-gpu/shaders/ideal`: `surface.wgsl`,
//! `mesh_color`, `light.wgsl` and `fog`.

use std::sync::Arc;

use camsim_core::{
    pose::CameraPose,
    scene::{Light, Mesh, Prefilter, PrefilterTaps, Scene, Wrap},
    temporal::IdealGeometry,
};
use glam::{DMat2, DVec2, DVec3, Vec3, Vec4};

use super::{
    mips::{MipChain, Sampling},
    moving::PosedMesh,
    trace::{SceneRay, Triangle, terrain_position},
};

/// Alpha below which the colour of a blended surface is undefined.
const LEAST_ALPHA: f32 = 1e-6;

/// A key camera, by pixels of its ideal frame or by finer ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct KeyCamera {
    position_ned_m: DVec3,
    focal_px: DVec2,
    principal_px: DVec2,
    /// Change of a ray's direction (planar depth 1) from pixel to pixel, right and down.
    steps_ned: [DVec3; 2],
    axis_ned: DVec3,
}

impl KeyCamera {
    /// With `scale` pixels along a side of an ideal pixel.
    pub fn new(ideal: &IdealGeometry, pose: &CameraPose, scale: u32) -> Self {
        let focal_px = ideal.focal_px * f64::from(scale);
        Self {
            position_ned_m: pose.position_ned_m,
            focal_px,
            principal_px: (ideal.principal_px + 0.5) * f64::from(scale) - 0.5,
            steps_ned: [
                pose.ned_from_camera * DVec3::X / focal_px.x,
                pose.ned_from_camera * DVec3::Y / focal_px.y,
            ],
            axis_ned: pose.ned_from_camera * DVec3::Z,
        }
    }

    /// With positions in units of `step_uv` from the optical axis, tangents.
    pub fn with_steps(pose: &CameraPose, step_uv: DVec2) -> Self {
        Self {
            position_ned_m: pose.position_ned_m,
            focal_px: step_uv.recip(),
            principal_px: DVec2::ZERO,
            steps_ned: [
                pose.ned_from_camera * DVec3::X * step_uv.x,
                pose.ned_from_camera * DVec3::Y * step_uv.y,
            ],
            axis_ned: pose.ned_from_camera * DVec3::Z,
        }
    }

    /// The ray of a position; its parameter is planar depth, metres.
    pub fn ray(&self, position_px: DVec2) -> SceneRay {
        let DVec2 { x, y } = position_px - self.principal_px;
        SceneRay {
            origin_ned_m: self.position_ned_m,
            direction_ned: self.axis_ned + x * self.steps_ned[0] + y * self.steps_ned[1],
        }
    }

    /// Slant range of a metre of planar depth.
    fn range_per_depth(&self, position_px: DVec2) -> f64 {
        ((position_px - self.principal_px) / self.focal_px).extend(1.0).length()
    }
}

/// What colours of a frame depend on.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceShader<'a> {
    pub scene: &'a Scene,
    /// Of the terrain, then by mesh.
    pub textures: &'a [Arc<MipChain>],
    pub camera: KeyCamera,
    pub reads: PrefilterTaps,
    /// Extinction, 1/m.
    pub fog_per_m: f64,
    /// Meshes that are elsewhere than in the scene.
    pub posed: &'a [PosedMesh],
    /// The light whose shadows are seen.
    pub shadows: Option<Light>,
}

/// The plane of a triangle at a position.
struct PlanePoint {
    depth_m: f64,
    weights: [f64; 3],
    /// Change of the weights from pixel to pixel, right and down.
    weight_steps: [[f64; 3]; 2],
}

impl PlanePoint {
    /// `None` where the ray of the position does not meet the plane in front of the camera.
    fn new(points: [DVec3; 3], camera: &KeyCamera, ray: &SceneRay) -> Option<Self> {
        let [a, b, c] = points.map(|point| point - camera.position_ned_m);
        // Volumes over the edges: linear in the direction, and in proportion to the weights.
        let volumes = [c.cross(b), a.cross(c), b.cross(a)];
        let volumes_of = |direction: DVec3| volumes.map(|volume| direction.dot(volume));
        let of_ray = volumes_of(ray.direction_ned);
        let sum: f64 = of_ray.iter().sum();
        let weights = of_ray.map(|volume| volume / sum);
        let normal = (b - a).cross(c - a);
        let depth_m = a.dot(normal) / ray.direction_ned.dot(normal);
        let weight_steps = camera.steps_ned.map(|step| {
            let of_step = volumes_of(step);
            let change: f64 = of_step.iter().sum();
            [0, 1, 2].map(|k: usize| (of_step[k] - weights[k] * change) / sum)
        });
        let is_there =
            depth_m > 0.0 && depth_m.is_finite() && weights.iter().all(|weight| weight.is_finite());
        is_there.then_some(Self { depth_m, weights, weight_steps })
    }

    fn uv(&self, uvs: [DVec2; 3]) -> DVec2 {
        (0..3).map(|k| self.weights[k] * uvs[k]).sum()
    }

    /// Columns: change of the texture coordinates from pixel to pixel.
    fn uv_steps(&self, uvs: [DVec2; 3]) -> DMat2 {
        let [right, down] = self.weight_steps.map(|steps| (0..3).map(|k| steps[k] * uvs[k]).sum());
        DMat2::from_cols(right, down)
    }
}

/// How a colour turns dark in the shadow.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShadowTone {
    /// Fraction of the light that is the sky's.
    pub sky_fraction: f32,
    /// The part of the colour that is no reflected light: emission and fog.
    pub unlit: Vec3,
}

impl ShadowTone {
    /// A colour in full light with a fraction of the sun.
    pub fn shaded(&self, lit: Vec3, sun: f32) -> Vec3 {
        self.unlit + (self.sky_fraction + sun * (1.0 - self.sky_fraction)) * (lit - self.unlit)
    }
}

impl SurfaceShader<'_> {
    /// A mesh where it is.
    pub fn mesh(&self, number: usize) -> &Mesh {
        let posed = self.posed.iter().find(|posed| posed.number as usize == number);
        posed.map_or(&self.scene.meshes[number], |posed| &posed.mesh)
    }

    pub fn sky(&self) -> Vec3 {
        Vec3::from_array(self.scene.sky_linear)
    }

    /// Linear R G B, times alpha, and alpha of a triangle's plane at a position, with a fraction of the sun. `None`
    /// where the ray of the position does not meet the plane in front of the camera.
    pub fn color(&self, triangle: &Triangle, position_px: DVec2, sun: f64) -> Option<Vec4> {
        let ray = self.camera.ray(position_px);
        match triangle.surface.checked_sub(1) {
            None => self.terrain_color(triangle, &ray, position_px, sun),
            Some(mesh) => self.mesh_color(mesh as usize, triangle, &ray, position_px, sun),
        }
    }

    fn terrain_color(
        &self,
        triangle: &Triangle,
        ray: &SceneRay,
        position_px: DVec2,
        sun: f64,
    ) -> Option<Vec4> {
        let terrain = self.scene.terrain.as_ref()?;
        let corners = triangle.corners;
        let points = corners.map(|corner| terrain_position(terrain, triangle.chunk, corner));
        let uvs = corners.map(|corner| uv_of(terrain.vertices[corner as usize].uv));
        let point = PlanePoint::new(points, &self.camera, ray)?;
        let sampling = Sampling { wrap: [Wrap::Clamp; 2], nearest: false, premultiplied: false };
        let mut color = self.texture_color(0, &point, uvs, sampling).truncate();
        if sun < 1.0 {
            let of_sky = terrain.sky_fraction(corners, point.weights);
            color *= (of_sky + sun * (1.0 - of_sky)) as f32;
        }
        Some(self.in_fog(color, &point, position_px).extend(1.0))
    }

    fn mesh_color(
        &self,
        number: usize,
        triangle: &Triangle,
        ray: &SceneRay,
        position_px: DVec2,
        sun: f64,
    ) -> Option<Vec4> {
        let mesh = self.mesh(number);
        let (material, corners) = (&mesh.material, triangle.corners);
        let points = corners.map(|corner| mesh.position_ned_m(corner));
        let uvs = corners.map(|corner| uv_of(mesh.shape.vertices[corner as usize].uv));
        let point = PlanePoint::new(points, &self.camera, ray)?;
        let sampling =
            Sampling { wrap: material.wrap, nearest: material.nearest, premultiplied: material.blends };
        let texture = self.texture_color(1 + number, &point, uvs, sampling);
        let [r, g, b, tint_alpha] = mesh.tint_at(corners, point.weights);
        let light = self.scene.light.as_ref();
        let light = light.map_or(1.0, |light| {
            let [of_sun, of_sky] = mesh.light_parts_at(light, corners, point.weights, ray.direction_ned);
            (sun * of_sun + of_sky).clamp(0.0, 1.0)
        });
        let tint = (light * DVec3::new(r, g, b)).as_vec3();
        let emissive = Vec3::from_array(material.emissive);
        if !material.blends {
            let color = texture.truncate() * tint + emissive;
            return Some(self.in_fog(color, &point, position_px).extend(1.0));
        }
        let color = (texture.truncate() * tint + emissive * texture.w) / texture.w.max(LEAST_ALPHA);
        let alpha = texture.w * tint_alpha.clamp(0.0, 1.0) as f32;
        Some((alpha * self.in_fog(color, &point, position_px)).extend(alpha))
    }

    /// What a triangle's light at a position is made of.
    pub fn shadow_tone(&self, triangle: &Triangle, position_px: DVec2) -> Option<ShadowTone> {
        let ray = self.camera.ray(position_px);
        let (points, mesh): ([DVec3; 3], _) = match triangle.surface.checked_sub(1) {
            None => {
                let terrain = self.scene.terrain.as_ref()?;
                (triangle.corners.map(|corner| terrain_position(terrain, triangle.chunk, corner)), None)
            }
            Some(mesh) => {
                let mesh = self.mesh(mesh as usize);
                (triangle.corners.map(|corner| mesh.position_ned_m(corner)), Some(mesh))
            }
        };
        let point = PlanePoint::new(points, &self.camera, &ray)?;
        let sky_fraction = match (mesh, &self.scene.terrain, &self.scene.light) {
            (Some(mesh), _, Some(light)) => {
                let direction = ray.direction_ned;
                let [of_sun, of_sky] = mesh.light_parts_at(light, triangle.corners, point.weights, direction);
                if of_sun > 0.0 { of_sky / (of_sun + of_sky) } else { 1.0 }
            }
            (None, Some(terrain), _) => terrain.sky_fraction(triangle.corners, point.weights),
            _ => 1.0,
        };
        let emissive = mesh.map_or(Vec3::ZERO, |mesh| Vec3::from_array(mesh.material.emissive));
        Some(ShadowTone {
            sky_fraction: sky_fraction as f32,
            unlit: self.in_fog(emissive, &point, position_px),
        })
    }

    /// Prefiltered texture of a surface.
    fn texture_color(&self, surface: usize, point: &PlanePoint, uvs: [DVec2; 3], sampling: Sampling) -> Vec4 {
        let texture = &*self.textures[surface];
        let uv = point.uv(uvs);
        if texture.is_uniform() {
            return texture.read(uv, 0.0, sampling);
        }
        let texel_from_uv = DMat2::from_diagonal(texture.size());
        let filter = Prefilter::new(texel_from_uv * point.uv_steps(uvs), self.reads);
        texture.filtered(uv, &filter, sampling)
    }

    fn in_fog(&self, color: Vec3, point: &PlanePoint, position_px: DVec2) -> Vec3 {
        if self.fog_per_m <= 0.0 {
            return color;
        }
        let range_m = point.depth_m * self.camera.range_per_depth(position_px);
        let clear = (-self.fog_per_m * range_m).exp() as f32;
        self.sky().lerp(color, clear)
    }
}

fn uv_of(uv: [f32; 2]) -> DVec2 {
    DVec2::from_array(uv.map(f64::from))
}
