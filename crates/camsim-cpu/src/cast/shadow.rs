//! Shadows of the sun: rays from what the camera's rays meet.
//!
//! A first pass takes a ray to the sun from every ray of the camera. Where light and shadow meet within three
//! by three pixels, a second one finds the fraction of each surface in a pixel that the sun shines on, by rays
//! spread evenly over the pixel.

use camsim_core::scene::{Aabb, Mesh, Terrain};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{
    FrameCaster, PixelScratch,
    trace::{Hits, SceneRay, Triangle, terrain_position},
};

/// How far above its surface a ray to the sun begins, metres: more than rounding, less than anything shows.
const LIFT_M: f64 = 1e-6;
/// Turn of a Fibonacci lattice: the golden ratio's fraction.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// What a point has of the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sun {
    /// It makes no difference there.
    NoMatter,
    /// The triangle faces away from it.
    Behind,
    Hidden,
    Shining,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    pub triangle: Triangle,
    pub t: f64,
    /// Unit normal on the side from which the ray comes, if it is known.
    pub normal_ned: Option<DVec3>,
    /// False where no model may keep the sun from it.
    pub may_have_models: bool,
}

impl Met {
    pub fn new(triangle: Triangle, t: f64) -> Self {
        Self { triangle, t, normal_ned: None, may_have_models: true }
    }
}

/// Whether light and shadow were seen.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SeenLight {
    light: bool,
    pub shadow: bool,
}

impl SeenLight {
    pub fn add(&mut self, surface: u32, sun: Sun) {
        self.light |= sun == Sun::Shining;
        self.shadow |= is_in_shadow(surface, sun);
    }

    /// Whether both were.
    pub fn is_border(self) -> bool {
        self.light && self.shadow
    }

    /// That of a point in the sun.
    pub fn of_open_ground() -> Self {
        Self { light: true, shadow: false }
    }

    pub fn or(self, other: Self) -> Self {
        Self { light: self.light | other.light, shadow: self.shadow | other.shadow }
    }
}

/// Whether a point counts as shaded. A model's triangle that faces away has no sunlight to lose; on the ground
/// it has, as the light there is that of smooth slopes.
fn is_in_shadow(surface: u32, sun: Sun) -> bool {
    sun == Sun::Hidden || (sun == Sun::Behind && surface == 0)
}

/// For each surface in a pixel the number of its rays, and of those that have the sun.
#[derive(Debug, Default)]
pub(super) struct SurfaceSuns(Vec<(u32, u32, u32)>);

impl SurfaceSuns {
    pub fn add(&mut self, surface: u32, sun: Sun) {
        let shines = u32::from(sun == Sun::Shining);
        if shines == 0 && !is_in_shadow(surface, sun) {
            return;
        }
        match self.0.iter_mut().find(|of| of.0 == surface) {
            Some(of) => (of.1, of.2) = (of.1 + 1, of.2 + shines),
            None => self.0.push((surface, 1, shines)),
        }
    }

    pub fn fraction(&self, surface: u32) -> Option<f64> {
        let of = self.0.iter().find(|of| of.0 == surface)?;
        Some(f64::from(of.2) / f64::from(of.1))
    }
}

/// Fraction of the sun that a surface has where a ray meets it, or over the pixel if that is known.
pub(super) fn fraction_of_sun(surface: u32, sun: Sun, suns: Option<&SurfaceSuns>) -> f64 {
    let own = if matches!(sun, Sun::Shining | Sun::NoMatter) { 1.0 } else { 0.0 };
    if own == 0.0 && !is_in_shadow(surface, sun) {
        return own;
    }
    suns.and_then(|suns| suns.fraction(surface)).unwrap_or(own)
}

/// Whether the sun has a part in the light on a triangle of the terrain.
fn has_sun(terrain: &Terrain, triangle: &Triangle) -> bool {
    let has_sun =
        |&corner: &u32| terrain.light_parts.get(corner as usize).is_some_and(|[of_sun, _]| *of_sun > 0.0);
    triangle.corners.iter().any(has_sun)
}

impl FrameCaster<'_> {
    /// What a triangle has of the sun where a ray meets it.
    pub(super) fn sun(&self, met: &Met, ray: &SceneRay) -> Sun {
        let Met { triangle, t, normal_ned, may_have_models } = met;
        let Some(light) = self.shader.shadows else { return Sun::NoMatter };
        let scene = self.shader.scene;
        let mesh = triangle.surface.checked_sub(1).map(|mesh| self.shader.mesh(mesh as usize));
        let is_lit = match (mesh, &scene.terrain) {
            (Some(mesh), _) => mesh.shape.has_normals(),
            (None, terrain) => terrain.as_ref().is_some_and(|terrain| has_sun(terrain, triangle)),
        };
        if !is_lit {
            return Sun::NoMatter;
        }
        let normal = normal_ned.unwrap_or_else(|| self.normal_towards(triangle, mesh, ray));
        if normal.dot(light.to_sun_ned) <= 0.0 {
            return Sun::Behind;
        }
        let origin_ned_m = ray.origin_ned_m + t * ray.direction_ned + LIFT_M * normal;
        let to_sun = SceneRay { origin_ned_m, direction_ned: light.to_sun_ned };
        let is_ground = mesh.is_none() && normal.z < 0.0;
        let is_blocked = scene.terrain.as_ref().is_some_and(|terrain| match self.sun_map {
            Some(sun_map) if is_ground => sun_map.hides(terrain, origin_ned_m),
            _ => terrain.blocks(origin_ned_m, light.to_sun_ned),
        });
        match is_blocked || (*may_have_models && self.trees.is_blocked(scene, self.shader.posed, &to_sun)) {
            true => Sun::Hidden,
            false => Sun::Shining,
        }
    }

    /// Unit normal of a triangle, on the side from which a ray comes.
    fn normal_towards(&self, triangle: &Triangle, mesh: Option<&Mesh>, ray: &SceneRay) -> DVec3 {
        let corner = |corner: u32| match (mesh, &self.shader.scene.terrain) {
            (Some(mesh), _) => mesh.position_ned_m(corner),
            (None, Some(terrain)) => terrain_position(terrain, triangle.chunk, corner),
            (None, None) => DVec3::NAN,
        };
        let [a, b, c] = triangle.corners.map(corner);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        if normal.dot(ray.direction_ned) > 0.0 { -normal } else { normal }
    }

    /// False only if no model is in a box or between it and the sun.
    pub(super) fn may_have_models(&self, bounds: &Aabb) -> bool {
        self.sun_map.is_none_or(|sun_map| self.trees.any_model(|model| sun_map.may_shade(model, bounds)))
    }

    /// True only if the terrain hides the sun from none of its triangles in a box that face it.
    pub(super) fn is_lit_within(&self, bounds: &Aabb) -> bool {
        let ground = self.sun_map.zip(self.shader.scene.terrain.as_ref());
        ground.is_some_and(|(sun_map, terrain)| sun_map.is_lit_within(terrain, bounds))
    }

    /// Values of all pixels by their middles. Those at borders of shadows are made again, with the fractions of
    /// the sun over the pixel.
    pub(super) fn pixels<T: Send + Clone>(
        &self,
        size_px: [u32; 2],
        border_rays: u32,
        pixel: impl Fn(DVec2, &mut PixelScratch, Option<&SurfaceSuns>) -> (T, SeenLight) + Sync,
    ) -> Vec<T> {
        let [width, height] = size_px.map(|side| side as usize);
        let middle_px = |i: usize| DVec2::new((i % width) as f64, (i / width) as f64);
        let all = (0..width * height).into_par_iter().with_min_len(width);
        let first = all.map_init(PixelScratch::default, |scratch, i| pixel(middle_px(i), scratch, None));
        let (mut values, seen): (Vec<T>, Vec<SeenLight>) = first.unzip();
        if self.shader.shadows.is_none() {
            return values;
        }
        let borders: Vec<usize> =
            (0..width * height).into_par_iter().filter(|&i| is_at_border(&seen, size_px, i)).collect();
        let refined = borders.par_iter().with_min_len(16).map_init(PixelScratch::default, |scratch, &i| {
            let suns = self.suns(middle_px(i), border_rays, &mut scratch.hits[0]);
            pixel(middle_px(i), scratch, Some(&suns)).0
        });
        let refined: Vec<T> = refined.collect();
        borders.into_iter().zip(refined).for_each(|(i, value)| values[i] = value);
        values
    }

    /// Fractions of the sun over a pixel.
    pub(super) fn suns(&self, middle_px: DVec2, rays: u32, hits: &mut Hits) -> SurfaceSuns {
        let mut suns = SurfaceSuns::default();
        for position_px in lattice(middle_px, rays) {
            self.trace(position_px, hits);
            let ray = self.shader.camera.ray(position_px);
            let opaque = self.opaque_triangle(hits, &ray).zip(hits.opaque);
            let opaque = opaque.map(|(triangle, hit)| (triangle, hit.t()));
            for (triangle, t) in hits.blended.iter().map(|hit| (hit.triangle(), hit.t)).chain(opaque) {
                suns.add(triangle.surface, self.sun(&Met::new(triangle, t), &ray));
            }
        }
        suns
    }
}

/// Positions spread evenly over a pixel: a Fibonacci lattice.
pub(super) fn lattice(middle_px: DVec2, count: u32) -> impl Iterator<Item = DVec2> {
    let position = move |k: u32| {
        DVec2::new((f64::from(k) + 0.5) / f64::from(count), (f64::from(k) * GOLDEN).fract()) - 0.5
    };
    (0..count).map(move |k| middle_px + position(k))
}

/// Whether both light and shadow are seen in a pixel or its neighbours.
fn is_at_border(seen: &[SeenLight], [width, height]: [u32; 2], i: usize) -> bool {
    let (width, height) = (width as usize, height as usize);
    let (x, y) = (i % width, i / width);
    let mut all = SeenLight::default();
    for y in y.saturating_sub(1)..(y + 2).min(height) {
        for x in x.saturating_sub(1)..(x + 2).min(width) {
            all = all.or(seen[y * width + x]);
        }
    }
    all.is_border()
}
