//! Shadows in a rasterised ideal frame: a second pass over its pixels.
//!
//! The rasteriser draws everything in full light, and terrain and models with as few triangles as will do.
//! Squares of pixels that show ground with nothing before the sun stay as they are. In the others the ray of each
//! pixel's middle finds the surface at full detail, from the triangle that the pixel before it shows, and a ray
//! from there to the sun tells whether the pixel's colour turns to that of the shadow. At borders of shadows the
//! fraction of the sun is that of rays over the pixel; pixels of several samples in which different surfaces meet
//! beside a shadow are cast anew.

use camsim_core::scene::{Aabb, TerrainTriangle, TerrainWalk, WalkHit};
use camsim_plan::{FramePlan, KeyFrame, NEAR_M};
use glam::{DVec2, Vec3};
use half::f16;
use rayon::prelude::*;

use super::{
    CastScene, FrameCaster, PixelScratch,
    shade::ShadowTone,
    shadow::{Met, SeenLight, SurfaceSuns, fraction_of_sun, lattice},
    trace::{Hits, OpaqueHit, Triangle},
};
use crate::ideal::RasterFrame;

/// Relative difference of depths up to which the terrain that a walk finds is the one that is drawn, with fewer
/// triangles, or the one beside it. Farther apart something nearer may hide it, and a ray is cast.
const SAME_DEPTH: f64 = 0.02;
/// Relative difference of depths up to which a triangle is the one that is drawn.
const DRAWN: f64 = 1e-4;
const CHANNELS: usize = 4;
/// Pixels along a side of a square.
const SQUARE: usize = 8;

/// What a pixel's middle sees.
#[derive(Clone, Copy, Debug, Default)]
struct Middle {
    /// 0 = terrain, 1 + i = mesh i; `None` is sky.
    surface: Option<u32>,
    /// `None` also in a square without shadows.
    triangle: Option<Triangle>,
    seen: SeenLight,
    /// Fraction of the sun.
    sun: f32,
    /// Inverse depth, 1/m, and the terrain's triangle there or beside it.
    inverse_depth: f64,
    ground: Option<TerrainTriangle>,
    /// Whether models may be in the way, or keep the sun from it.
    may_have_models: bool,
}

impl CastScene {
    /// Puts shadows into a rasterised ideal frame of a key frame.
    pub(crate) fn add_shadows(&self, plan: &FramePlan, key: &KeyFrame, frame: &mut RasterFrame) {
        let Some(shadows) = plan.shadows else { return };
        let mut caster = FrameCaster::without_textures(self, plan, key, 1);
        let [width, height] = plan.ideal.size_px.map(|side| side as usize);
        let RasterFrame { color, depth, stride, .. } = frame;
        let middles = caster.middles(&Drawn { depth, stride: *stride, size_px: [width, height] });
        let has_samples = plan.samples_a_pixel > 1;
        let shows_several =
            !self.scene.meshes.is_empty() || middles.iter().any(|middle| middle.surface.is_none());
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

/// A search for first surfaces, ray beside ray.
#[derive(Clone, Debug, Default)]
struct Search<'a> {
    /// A walk over the terrain near the last ray.
    walk: Option<TerrainWalk<'a>>,
    /// The triangle of a model that a ray has met last.
    model: Option<Triangle>,
    /// Whether models may be in the way of these rays, or between what they meet and the sun.
    may_have_models: bool,
}

/// What the rasteriser has drawn.
struct Drawn<'a> {
    /// near / z, 0 = infinitely far; row by row.
    depth: &'a [f32],
    stride: usize,
    size_px: [usize; 2],
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
        let (mut seen, mut is_one_surface) = (SeenLight::default(), true);
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            for near in &self.middles[y * width + x.saturating_sub(1)..y * width + (x + 2).min(width)] {
                seen = seen.or(near.seen);
                is_one_surface &= near.surface == middle.surface;
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
        let triangle = middle.triangle?;
        let suns = seen.is_border().then(|| match is_one_surface {
            true => self.suns_beside(middle, middle_px, &mut scratch.hits[0]),
            false => self.caster.suns(middle_px, self.border_rays, &mut scratch.hits[0]),
        });
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
        let origin_ned_m = self.caster.shader.camera.ray(middle_px).origin_ned_m;
        let ground = self.caster.shader.scene.terrain.as_ref().zip(middle.ground);
        let mut search = Search {
            walk: ground.map(|(terrain, ground)| TerrainWalk::new(terrain, ground, origin_ned_m)),
            model: middle.triangle.filter(|triangle| triangle.surface > 0),
            may_have_models: middle.may_have_models,
        };
        for position_px in lattice(middle_px, self.border_rays) {
            let first = self.caster.first_surface(position_px, middle.inverse_depth, &mut search, hits);
            if let Some(met) = first {
                let ray = self.caster.shader.camera.ray(position_px);
                suns.add(met.triangle.surface, self.caster.sun(&met, &ray));
            }
        }
        suns
    }
}

impl Drawn<'_> {
    /// Inverse depth, 1/m.
    fn inverse_depth(&self, x: usize, y: usize) -> f64 {
        f64::from(self.depth[y * self.stride + x]) / NEAR_M
    }
}

impl<'a> FrameCaster<'a> {
    fn middles(&self, drawn: &Drawn) -> Vec<Middle> {
        let [width, height] = drawn.size_px;
        let mut middles = vec![Middle::default(); width * height];
        middles.par_chunks_mut(SQUARE * width).enumerate().for_each_init(Hits::default, |hits, (y, rows)| {
            let mut search = Search::default();
            for x in (0..width).step_by(SQUARE) {
                self.square([x, SQUARE * y], drawn, rows, &mut search, hits);
            }
        });
        middles
    }

    /// Middles of the square with this first pixel. `rows` are those of the squares beside it too.
    fn square(
        &self,
        [first_x, first_y]: [usize; 2],
        drawn: &Drawn,
        rows: &mut [Middle],
        search: &mut Search<'a>,
        hits: &mut Hits,
    ) {
        let width = drawn.size_px[0];
        let columns = first_x..(first_x + SQUARE).min(width);
        let (known, may_have_models) = self.middle_of_square([first_x, first_y], drawn);
        search.may_have_models = may_have_models;
        for (y, row) in rows.chunks_exact_mut(width).enumerate().map(|(k, row)| (first_y + k, row)) {
            let mut in_row = search.clone();
            for x in columns.clone() {
                row[x] = known.unwrap_or_else(|| {
                    let middle_px = DVec2::new(x as f64, y as f64);
                    self.lit_middle(middle_px, drawn.inverse_depth(x, y), &mut in_row, hits)
                });
                // The next row begins below this pixel.
                if x == first_x {
                    search.clone_from(&in_row);
                }
            }
        }
    }

    /// What all middles of a square are if it shows, with the pixels around it, nothing but sky, or nothing but
    /// ground in the sun; and whether models may be in it, or keep the sun from it. The ground drawn is less than a
    /// pixel from that at full detail.
    fn middle_of_square(&self, first: [usize; 2], drawn: &Drawn) -> (Option<Middle>, bool) {
        let low = first.map(|first| first.saturating_sub(1));
        let high = [0, 1].map(|k: usize| (first[k] + SQUARE).min(drawn.size_px[k] - 1));
        let pixels =
            (low[1]..=high[1]).flat_map(|y| (low[0]..=high[0]).map(move |x| drawn.inverse_depth(x, y)));
        let (far, near) = pixels.fold((f64::INFINITY, 0.0), |(far, near), w| (w.min(far), w.max(near)));
        if near == 0.0 {
            return (Some(Middle { sun: 1.0, ..Middle::default() }), true);
        }
        if far == 0.0 {
            return (None, true);
        }
        let mut bounds = Aabb::EMPTY;
        for x in [low[0], high[0]] {
            for y in [low[1], high[1]] {
                let ray = self.shader.camera.ray(DVec2::new(x as f64, y as f64));
                for w in [near, far] {
                    bounds.include(ray.origin_ned_m + ray.direction_ned / w);
                }
            }
        }
        let open =
            Middle { surface: Some(0), seen: SeenLight::of_open_ground(), sun: 1.0, ..Middle::default() };
        let may_have_models = self.may_have_models(&bounds);
        let is_open = !may_have_models && self.is_lit_within(&bounds);
        (is_open.then_some(open), may_have_models)
    }

    /// What a pixel's middle sees, where the rasteriser found this inverse depth (1/m).
    fn lit_middle(
        &self,
        position_px: DVec2,
        inverse_depth: f64,
        search: &mut Search<'a>,
        hits: &mut Hits,
    ) -> Middle {
        let first = self.first_surface(position_px, inverse_depth, search, hits);
        let ground = search.walk.as_ref().map(TerrainWalk::triangle);
        let Some(met) = first else { return Middle { sun: 1.0, ground, ..Middle::default() } };
        let Met { triangle, t, may_have_models, .. } = met;
        let sun = self.sun(&met, &self.shader.camera.ray(position_px));
        let mut seen = SeenLight::default();
        seen.add(triangle.surface, sun);
        Middle {
            surface: Some(triangle.surface),
            triangle: Some(triangle),
            seen,
            sun: fraction_of_sun(triangle.surface, sun, None) as f32,
            inverse_depth: t.recip(),
            ground,
            may_have_models,
        }
    }

    fn first_surface(
        &self,
        position_px: DVec2,
        inverse_depth: f64,
        search: &mut Search<'a>,
        hits: &mut Hits,
    ) -> Option<Met> {
        let scene = self.shader.scene;
        let ray = self.shader.camera.ray(position_px);
        let may_have_models = search.may_have_models;
        let off = |t: f64| (t * inverse_depth - 1.0).abs();
        let on_model = search.model.filter(|_| may_have_models).and_then(|triangle| {
            let t = self.trees.meet_triangle(scene, &triangle, &ray)?;
            (off(t) < DRAWN).then_some(Met::new(triangle, t))
        });
        if on_model.is_some() {
            return on_model;
        }
        let walked = search.walk.as_mut().and_then(|walk| walk.to(ray.direction_ned));
        if let (Some(terrain), Some(WalkHit { triangle, t, normal_ned })) = (&scene.terrain, walked) {
            let is_sure = !may_have_models || off(t) < DRAWN;
            let model = if is_sure { None } else { self.trees.first_model(scene, &ray, NEAR_M, t) };
            let met = model.map_or_else(
                || {
                    let (chunk, corners) = terrain.vertices_of(triangle);
                    let triangle = Triangle { surface: 0, chunk, corners };
                    Met { triangle, t, normal_ned: Some(normal_ned), may_have_models }
                },
                |(t, triangle)| Met::new(triangle, t),
            );
            if off(met.t) < SAME_DEPTH {
                search.model = model.map(|(_, triangle)| triangle).or(search.model);
                return Some(met);
            }
        }
        self.trace(position_px, hits);
        let hit = hits.opaque?;
        let triangle = self.opaque_triangle(hits, &ray)?;
        match (&hit, &scene.terrain) {
            (OpaqueHit::Terrain(hit), Some(terrain)) => {
                search.walk = Some(TerrainWalk::new(terrain, hit.triangle_of(terrain), ray.origin_ned_m));
            }
            _ => search.model = Some(triangle),
        }
        Some(Met::new(triangle, hit.t()))
    }
}

#[cfg(test)]
mod tests;
