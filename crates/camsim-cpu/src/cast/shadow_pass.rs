//! Shadows in a rasterised ideal frame: a second pass over its pixels.
//!
//! The rasteriser draws everything in full light, and terrain and models with as few triangles as will do.
//! Here the ray of each pixel's middle finds the surface at full detail, from the triangle beside that of the
//! pixel before, and a ray from there to the sun tells whether the pixel's colour turns to that of the shadow.
//! At borders of shadows the fraction of the sun is that of rays over the pixel; pixels of several samples in
//! which different surfaces meet beside a shadow are cast anew.

use camsim_core::scene::{TerrainTriangle, WalkHit};
use camsim_plan::{FramePlan, KeyFrame, NEAR_M};
use glam::{DVec2, Vec3};
use half::f16;
use rayon::prelude::*;

use super::{
    CastScene, FrameCaster, PixelScratch,
    shade::ShadowTone,
    shadow::{SeenLight, SurfaceSuns, fraction_of_sun, lattice},
    trace::{Hits, Triangle},
};
use crate::ideal::RasterFrame;

/// Relative difference of depths up to which the terrain that a walk finds is the one that is drawn, with fewer
/// triangles, or the one beside it. Farther apart something nearer may hide it, and a ray is cast.
const SAME_DEPTH: f64 = 0.02;
const CHANNELS: usize = 4;

/// What a pixel's middle sees.
#[derive(Clone, Copy, Debug, Default)]
struct Middle {
    triangle: Option<Triangle>,
    seen: SeenLight,
    /// Fraction of the sun.
    sun: f32,
    /// Inverse depth, 1/m, and the terrain's triangle there or beside it.
    inverse_depth: f64,
    ground: Option<TerrainTriangle>,
}

impl CastScene {
    /// Puts shadows into a rasterised ideal frame of a key frame.
    pub(crate) fn add_shadows(&self, plan: &FramePlan, key: &KeyFrame, frame: &mut RasterFrame) {
        let Some(shadows) = plan.shadows else { return };
        let mut caster = FrameCaster::without_textures(self, plan, key, 1);
        let [width, height] = plan.ideal.size_px.map(|side| side as usize);
        let RasterFrame { color, depth, stride, .. } = frame;
        let mut middles = vec![Middle::default(); width * height];
        let depths = depth.par_chunks(*stride);
        middles.par_chunks_mut(width).zip(depths).enumerate().for_each_init(
            Hits::default,
            |hits, (y, (row, depths))| {
                let mut before = None;
                for (x, (middle, &depth)) in row.iter_mut().zip(depths).enumerate() {
                    let inverse_depth = f64::from(depth) / NEAR_M;
                    *middle =
                        caster.lit_middle(DVec2::new(x as f64, y as f64), inverse_depth, &mut before, hits);
                }
            },
        );
        let has_samples = plan.samples_a_pixel > 1;
        let shows_several =
            !self.scene.meshes.is_empty() || middles.iter().any(|middle| middle.triangle.is_none());
        if has_samples && shows_several {
            caster.shader.textures = self.textures();
        }
        let pass = Pass { caster, middles, size_px: [width, height], border_rays: shadows.border_rays };
        color.par_chunks_mut(CHANNELS * *stride).take(height).enumerate().for_each_init(
            PixelScratch::default,
            |scratch, (y, row)| {
                for (x, texel) in row.chunks_exact_mut(CHANNELS).take(width).enumerate() {
                    let lit = Vec3::from_array([0, 1, 2].map(|k: usize| f16::from_bits(texel[k]).to_f32()));
                    if let Some(color) = pass.color([x, y], lit, has_samples, scratch) {
                        let bits = color.to_array().map(|value| f16::from_f32(value).to_bits());
                        texel[..3].copy_from_slice(&bits);
                    }
                }
            },
        );
    }
}

/// The second half of the pass: colours.
struct Pass<'a> {
    caster: FrameCaster<'a>,
    middles: Vec<Middle>,
    size_px: [usize; 2],
    border_rays: u32,
}

impl Pass<'_> {
    /// Colour of a pixel with its shadows; `None` where it stays as it is.
    fn color(
        &self,
        [x, y]: [usize; 2],
        lit: Vec3,
        has_samples: bool,
        scratch: &mut PixelScratch,
    ) -> Option<Vec3> {
        let [width, height] = self.size_px;
        let middle = &self.middles[y * width + x];
        let surface = |middle: &Middle| middle.triangle.map(|triangle| triangle.surface);
        let (mut seen, mut is_one_surface) = (SeenLight::default(), true);
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            for near in &self.middles[y * width + x.saturating_sub(1)..y * width + (x + 2).min(width)] {
                seen = seen.or(near.seen);
                is_one_surface &= surface(near) == surface(middle);
            }
        }
        if !seen.shadow {
            return None;
        }
        let middle_px = DVec2::new(x as f64, y as f64);
        if has_samples && !is_one_surface {
            let ([a, b, c, d], ..) = self.caster.pixel_samples(middle_px, scratch, None);
            return Some(0.25 * ((a + d) + (b + c)));
        }
        let suns = seen.is_border().then(|| match is_one_surface {
            true => self.suns_beside(middle, middle_px, &mut scratch.hits[0]),
            false => self.caster.suns(middle_px, self.border_rays, &mut scratch.hits[0]),
        });
        let triangle = middle.triangle?;
        let of_pixel = suns.as_ref().and_then(|suns| suns.fraction(triangle.surface));
        let sun = of_pixel.map_or(middle.sun, |fraction| fraction as f32);
        if sun >= 1.0 {
            return None;
        }
        let tone: ShadowTone = self.caster.shader.shadow_tone(&triangle, middle_px)?;
        Some(tone.shaded(lit, sun))
    }
}

impl Pass<'_> {
    /// Fractions of the sun over a pixel that shows one surface.
    fn suns_beside(&self, middle: &Middle, middle_px: DVec2, hits: &mut Hits) -> SurfaceSuns {
        let mut suns = SurfaceSuns::default();
        for position_px in lattice(middle_px, self.border_rays) {
            let mut ground = middle.ground;
            let first = self.caster.first_surface(position_px, middle.inverse_depth, &mut ground, hits);
            if let Some((triangle, t)) = first {
                let ray = self.caster.shader.camera.ray(position_px);
                suns.add(triangle.surface, self.caster.sun(&triangle, t, &ray));
            }
        }
        suns
    }
}

impl FrameCaster<'_> {
    /// What a pixel's middle sees, where the rasteriser found this inverse depth (1/m). `before` is the
    /// terrain's triangle beside it.
    fn lit_middle(
        &self,
        position_px: DVec2,
        inverse_depth: f64,
        before: &mut Option<TerrainTriangle>,
        hits: &mut Hits,
    ) -> Middle {
        let Some((triangle, t)) = self.first_surface(position_px, inverse_depth, before, hits) else {
            return Middle { sun: 1.0, ground: *before, ..Middle::default() };
        };
        let sun = self.sun(&triangle, t, &self.shader.camera.ray(position_px));
        let mut seen = SeenLight::default();
        seen.add(triangle.surface, sun);
        let fraction = fraction_of_sun(triangle.surface, sun, None) as f32;
        Middle { triangle: Some(triangle), seen, sun: fraction, inverse_depth: t.recip(), ground: *before }
    }

    fn first_surface(
        &self,
        position_px: DVec2,
        inverse_depth: f64,
        before: &mut Option<TerrainTriangle>,
        hits: &mut Hits,
    ) -> Option<(Triangle, f64)> {
        let scene = self.shader.scene;
        let ray = self.shader.camera.ray(position_px);
        if let (Some(terrain), Some(from)) = (&scene.terrain, *before)
            && let Some(WalkHit { triangle, t, .. }) = terrain.walk(from, ray.origin_ned_m, ray.direction_ned)
        {
            *before = Some(triangle);
            let (chunk, corners) = terrain.vertices_of(triangle);
            let ground = Triangle { surface: 0, chunk, corners };
            let (t, triangle) = self.trees.first_model(scene, &ray, NEAR_M, t).unwrap_or((t, ground));
            if (t * inverse_depth - 1.0).abs() < SAME_DEPTH {
                return Some((triangle, t));
            }
        }
        self.trace(position_px, hits);
        let hit = hits.opaque?;
        if let (super::trace::OpaqueHit::Terrain(hit), Some(terrain)) = (&hit, &scene.terrain) {
            *before = Some(hit.triangle_of(terrain));
        }
        Some((self.opaque_triangle(hits, &ray)?, hit.t()))
    }
}
