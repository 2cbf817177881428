//! Ideal frames of any scene by ray casting: for machines without Vulkan, where the rasteriser does not draw
//! a scene or a plan.
//!
//! A ray a sample finds the blended surfaces and the opaque one that the sample shows ([`trace`]). Colours
//! are those of the triangles' planes, with textures prefiltered over the pixel ([`shade`], [`mips`]).
//! Terrain and models have full detail.

use std::sync::{Arc, OnceLock};

use camsim_core::{
    scenario::Preset,
    scene::{Scene, SunMap, srgb_from_linear},
    temporal::{SAMPLE_POSITIONS, edge_mask, resolve_depth},
};
use camsim_plan::{EdgeStage, FramePlan, KeyFrame, NEAR_M};
use glam::{DVec2, Vec3};
use half::f16;
use rayon::prelude::*;

use crate::silhouettes::{FineSamples, IdealImage};

mod mips;
mod moving;
mod shade;
mod shadow;
mod shadow_pass;
#[cfg(test)]
mod tests;
mod trace;

use mips::MipChain;
pub use moving::{Instant, MovingCaster, RayScratch};
use shade::{KeyCamera, SurfaceShader};
use shadow::{Met, SeenLight, SurfaceSuns, fraction_of_sun};
use trace::{Hits, OpaqueHit, SceneRay, SceneTrees, Triangle, terrain_triangle};

/// Visibility is the distance at which 2 % of a contrast is left, whose logarithm is -3.912.
const FOG_AT_VISIBILITY: f64 = 3.912;
/// Fraction of the light from behind blended surfaces below which nothing is seen of it.
const HIDDEN: f32 = 1e-7;
/// Distance from an edge pixel at which samples are read for an edge line, pixels.
const READ_PX: usize = 5;
/// Samples of a pixel.
const SAMPLES: usize = SAMPLE_POSITIONS.len();

/// A scene, prepared for rays.
#[derive(Debug)]
pub struct CastScene {
    scene: Arc<Scene>,
    trees: SceneTrees,
    /// Of the terrain, then by mesh; surfaces of one texture have it in common. Made when first needed.
    textures: OnceLock<Vec<Arc<MipChain>>>,
    /// `None` without terrain or shadows.
    sun_map: Option<SunMap>,
}

impl CastScene {
    /// Builds trees over all triangles.
    #[must_use]
    pub fn new(scene: &Arc<Scene>) -> Self {
        let light = scene.light.filter(|light| light.shadows);
        let sun_map = scene.terrain.as_ref().zip(light);
        let sun_map = sun_map.map(|(terrain, light)| SunMap::new(terrain, light.to_sun_ned));
        Self { scene: scene.clone(), trees: SceneTrees::new(scene), textures: OnceLock::new(), sun_map }
    }

    /// The mip levels of all textures. The first call makes them, on all threads: not from one of their tasks.
    fn textures(&self) -> &[Arc<MipChain>] {
        self.textures.get_or_init(|| mips::of_scene(&self.scene))
    }

    /// The ideal frame of a plan's key frame.
    #[must_use]
    pub fn draw(&self, plan: &FramePlan, key: &KeyFrame) -> IdealImage {
        let frame = FrameCaster::new(self, plan, key, 1);
        let size_px = plan.ideal.size_px;
        let border_rays = plan.shadows.map_or(0, |shadows| shadows.border_rays);
        let (mut color_rgba, inverse_depth) = match plan.samples_a_pixel {
            0 | 1 => frame.centres(size_px, border_rays),
            _ => frame.sample_means(size_px, border_rays),
        };
        if plan.preset == Preset::Paper {
            color_rgba.par_iter_mut().for_each(|value| *value = stored(*value));
        }
        let fine = match plan.edges {
            EdgeStage::None => None,
            EdgeStage::Supersampled { scale, thin, .. } => {
                Some(self.fine_samples(plan, key, &inverse_depth, (scale, thin)))
            }
        };
        IdealImage { geometry: plan.ideal, color_rgba, inverse_depth, fine }
    }

    fn fine_samples(
        &self,
        plan: &FramePlan,
        key: &KeyFrame,
        inverse_depth: &[f32],
        (scale, thin): (u32, bool),
    ) -> FineSamples {
        let size_px = plan.ideal.size_px;
        let frame = FrameCaster::new(self, plan, key, scale);
        let (depths, colors) = match (scale, thin) {
            (1, true) => (frame.sample_depths(size_px, |_| None), Vec::new()),
            (1, false) => {
                let read = near_edges(size_px, inverse_depth);
                let depth = |pixel: usize| (!read[pixel]).then_some([inverse_depth[pixel]; SAMPLES]);
                (frame.sample_depths(size_px, depth), Vec::new())
            }
            _ => {
                let border_rays = plan.shadows.map_or(0, |shadows| shadows.border_rays);
                frame.samples(size_px.map(|side| side * scale), border_rays)
            }
        };
        FineSamples::of_quads(size_px, inverse_depth, (scale, thin), &depths, colors)
    }
}

/// Half floats of linear R G B of a pixel's samples.
type SampleColors = [[f16; 3]; SAMPLES];

/// A frame in the making.
#[derive(Debug)]
struct FrameCaster<'a> {
    trees: &'a SceneTrees,
    sun_map: Option<&'a SunMap>,
    shader: SurfaceShader<'a>,
}

/// What a thread needs for a pixel.
#[derive(Debug, Default)]
struct PixelScratch {
    hits: [Hits; SAMPLES],
    fractions: Vec<TriangleFraction>,
}

/// The samples of a pixel that show one triangle.
#[derive(Clone, Copy, Debug)]
struct TriangleFraction {
    triangle: Triangle,
    /// A bit for each sample.
    samples: u8,
    /// Sum of their fractions of the sun.
    sun: f64,
    /// Linear R G B times alpha, and alpha; once it is needed.
    color: Option<glam::Vec4>,
}

impl<'a> FrameCaster<'a> {
    /// With `scale` pixels along a side of an ideal pixel.
    fn new(cast: &'a CastScene, plan: &FramePlan, key: &KeyFrame, scale: u32) -> Self {
        let mut caster = Self::without_textures(cast, plan, key, scale);
        caster.shader.textures = cast.textures();
        caster
    }

    /// One that casts rays and makes no colours.
    fn without_textures(cast: &'a CastScene, plan: &FramePlan, key: &KeyFrame, scale: u32) -> Self {
        let scene = &*cast.scene;
        // The paper's fog comes after the gather.
        let visibility_m = scene.fog_visibility_m.filter(|_| plan.linear_fog.is_none());
        let shader = SurfaceShader {
            scene,
            textures: &[],
            camera: KeyCamera::new(&plan.ideal, &key.pose, scale),
            reads: plan.surface_reads,
            fog_per_m: visibility_m.map_or(0.0, |visibility_m| FOG_AT_VISIBILITY / visibility_m),
            posed: &[],
            shadows: scene.light.filter(|_| plan.shadows.is_some()),
        };
        Self { trees: &cast.trees, sun_map: cast.sun_map.as_ref(), shader }
    }

    /// Linear R G B A and inverse depth at the centres of all pixels.
    fn centres(&self, size_px: [u32; 2], border_rays: u32) -> (Vec<f32>, Vec<f32>) {
        let pixels = self.pixels(size_px, border_rays, |middle_px, scratch, suns| {
            let (color, depth, seen) = self.middle(middle_px, &mut scratch.hits[0], suns);
            ((color.extend(1.0).to_array(), depth), seen)
        });
        let (color, depth): (Vec<[f32; 4]>, Vec<f32>) = pixels.into_par_iter().unzip();
        (color.into_flattened(), depth)
    }

    /// Linear R G B A of all pixels as means over their samples, and inverse depth at their centres.
    fn sample_means(&self, size_px: [u32; 2], border_rays: u32) -> (Vec<f32>, Vec<f32>) {
        let pixels = self.pixels(size_px, border_rays, |middle_px, scratch, suns| {
            let ([a, b, c, d], depths, seen) = self.pixel_samples(middle_px, scratch, suns);
            (((0.25 * ((a + d) + (b + c))).extend(1.0).to_array(), depths), seen)
        });
        let (color, samples): (Vec<[f32; 4]>, Vec<[f32; SAMPLES]>) = pixels.into_par_iter().unzip();
        (color.into_flattened(), centre_depths(size_px, &samples))
    }

    /// Inverse depths and colours of the samples of all pixels.
    fn samples(&self, size_px: [u32; 2], border_rays: u32) -> (Vec<[f32; SAMPLES]>, Vec<SampleColors>) {
        let pixels = self.pixels(size_px, border_rays, |middle_px, scratch, suns| {
            let (colors, depths, seen) = self.pixel_samples(middle_px, scratch, suns);
            ((depths, colors.map(|color| color.to_array().map(f16::from_f32))), seen)
        });
        pixels.into_par_iter().unzip()
    }

    /// Inverse depths of the samples of all pixels whose depths are not known.
    fn sample_depths(
        &self,
        [width, height]: [u32; 2],
        known: impl Fn(usize) -> Option<[f32; SAMPLES]> + Sync,
    ) -> Vec<[f32; SAMPLES]> {
        let (width, height) = (width as usize, height as usize);
        let mut depths = vec![[0.0; SAMPLES]; width * height];
        depths.par_chunks_mut(width).enumerate().for_each_init(Hits::default, |hits, (y, depths)| {
            for (x, depths) in depths.iter_mut().enumerate() {
                let middle_px = DVec2::new(x as f64, y as f64);
                *depths = known(y * width + x).unwrap_or_else(|| {
                    SAMPLE_POSITIONS.map(|position| {
                        self.trace(middle_px + position, hits);
                        self.inverse_depth(hits)
                    })
                });
            }
        });
        depths
    }

    fn trace(&self, position_px: DVec2, hits: &mut Hits) {
        let ray = self.shader.camera.ray(position_px);
        self.trees.trace(self.shader.scene, self.shader.posed, &ray, NEAR_M, hits);
    }

    /// 0 of the sky, 1/m.
    fn inverse_depth(&self, hits: &Hits) -> f32 {
        hits.depth(self.shader.scene).map_or(0.0, |depth_m| depth_m.recip() as f32)
    }

    fn opaque_triangle(&self, hits: &Hits, ray: &SceneRay) -> Option<Triangle> {
        match hits.opaque? {
            OpaqueHit::Mesh(hit) => Some(hit.triangle()),
            OpaqueHit::Terrain(hit) => Some(terrain_triangle(self.shader.scene.terrain.as_ref()?, &hit, ray)),
        }
    }

    /// Linear R G B and inverse depth (1/m) of the ray of a position, and what light it sees. The fraction of the
    /// sun is that of the ray, or from `suns`.
    fn middle(
        &self,
        position_px: DVec2,
        hits: &mut Hits,
        suns: Option<&SurfaceSuns>,
    ) -> (Vec3, f32, SeenLight) {
        self.trace(position_px, hits);
        let ray = self.shader.camera.ray(position_px);
        let (mut sum, mut left, mut seen) = (Vec3::ZERO, 1.0, SeenLight::default());
        let mut color = |triangle: &Triangle, t: f64| {
            let sun = self.sun(&Met::new(*triangle, t), &ray);
            seen.add(triangle.surface, sun);
            self.shader.color(triangle, position_px, fraction_of_sun(triangle.surface, sun, suns))
        };
        for hit in &hits.blended {
            let Some(color) = color(&hit.triangle(), hit.t) else { continue };
            sum += left * color.truncate();
            left *= 1.0 - color.w;
            if left < HIDDEN {
                return (sum, self.inverse_depth(hits), seen);
            }
        }
        let opaque = self.opaque_triangle(hits, &ray).zip(hits.opaque);
        let color = opaque.and_then(|(triangle, hit)| color(&triangle, hit.t()));
        let behind = color.map_or(self.shader.sky(), |color| color.truncate());
        (sum + left * behind, self.inverse_depth(hits), seen)
    }

    /// Linear R G B and inverse depths (1/m) of a pixel's samples, and what light they see. Each triangle is
    /// shaded once: at the mean position of the samples that show it where its texture ends with it, else at the
    /// pixel's middle; with the mean of their fractions of the sun, or that from `suns`.
    fn pixel_samples(
        &self,
        middle_px: DVec2,
        scratch: &mut PixelScratch,
        suns: Option<&SurfaceSuns>,
    ) -> ([Vec3; SAMPLES], [f32; SAMPLES], SeenLight) {
        let PixelScratch { hits, fractions } = scratch;
        fractions.clear();
        let (mut opaque, mut seen) = ([None; SAMPLES], SeenLight::default());
        for (k, (hits, position)) in hits.iter_mut().zip(SAMPLE_POSITIONS).enumerate() {
            self.trace(middle_px + position, hits);
            let ray = self.shader.camera.ray(middle_px + position);
            opaque[k] = self.opaque_triangle(hits, &ray);
            let first = opaque[k].zip(hits.opaque).map(|(triangle, hit)| (triangle, hit.t()));
            for (triangle, t) in hits.blended.iter().map(|hit| (hit.triangle(), hit.t)).chain(first) {
                let sun = self.sun(&Met::new(triangle, t), &ray);
                seen.add(triangle.surface, sun);
                let sun = fraction_of_sun(triangle.surface, sun, suns);
                match fractions.iter_mut().find(|fraction| fraction.triangle == triangle) {
                    Some(fraction) => {
                        fraction.samples |= 1 << k;
                        fraction.sun += sun;
                    }
                    None => fractions.push(TriangleFraction { triangle, samples: 1 << k, sun, color: None }),
                }
            }
        }
        let mut color = |triangle: Triangle| {
            let fraction = fractions.iter_mut().find(|fraction| fraction.triangle == triangle)?;
            if fraction.color.is_none() {
                fraction.color = self.fraction_color(fraction, middle_px);
            }
            fraction.color
        };
        let colors = [0, 1, 2, 3].map(|k: usize| {
            let (mut sum, mut left) = (Vec3::ZERO, 1.0);
            for hit in &hits[k].blended {
                let Some(color) = color(hit.triangle()) else { continue };
                sum += left * color.truncate();
                left *= 1.0 - color.w;
                if left < HIDDEN {
                    return sum;
                }
            }
            let color = opaque[k].and_then(&mut color);
            sum + left * color.map_or(self.shader.sky(), |color| color.truncate())
        });
        (colors, [0, 1, 2, 3].map(|k: usize| self.inverse_depth(&hits[k])), seen)
    }

    fn fraction_color(&self, fraction: &TriangleFraction, middle_px: DVec2) -> Option<glam::Vec4> {
        let positions =
            (0..SAMPLES).filter(|k| fraction.samples & (1 << k) != 0).map(|k| SAMPLE_POSITIONS[k]);
        let mean = positions.clone().sum::<DVec2>() / f64::from(fraction.samples.count_ones());
        let mesh = fraction.triangle.surface.checked_sub(1).map(|i| &self.shader.scene.meshes[i as usize]);
        // The ground, and a picture with holes, go on beyond a triangle.
        let ends = mesh.is_some_and(|mesh| mesh.material.blends || mesh.material.cutoff.is_none());
        let shading_px = middle_px + if ends { mean } else { DVec2::ZERO };
        // Seen at grazing incidence the plane may end before the pixel's middle.
        let sun = fraction.sun / f64::from(fraction.samples.count_ones());
        let color = self.shader.color(&fraction.triangle, shading_px, sun);
        color.or_else(|| {
            positions
                .clone()
                .find_map(|position| self.shader.color(&fraction.triangle, middle_px + position, sun))
        })
    }
}

/// Resolves the inverse depths of samples to those of pixel centres. Twin of
/// `camsim-gpu/shaders/ideal/resolve_depth.wgsl`.
fn centre_depths(size_px: [u32; 2], samples: &[[f32; SAMPLES]]) -> Vec<f32> {
    let [width, height] = size_px.map(|side| side as usize);
    let first = |x: usize, y: usize| samples[y * width + x][0];
    // The smaller of the differences to both neighbours, since the other may cross a border.
    let slope = |before: f32, here: f32, after: f32| {
        let (left, right) = (here - before, after - here);
        if left.abs() < right.abs() { left } else { right }
    };
    let depth = |i: usize| {
        let (x, y) = (i % width, i / width);
        let here = samples[i][0];
        let across = slope(first(x.saturating_sub(1), y), here, first((x + 1).min(width - 1), y));
        let down = slope(first(x, y.saturating_sub(1)), here, first(x, (y + 1).min(height - 1)));
        resolve_depth(samples[i], [across, down])
    };
    (0..width * height).into_par_iter().map(depth).collect()
}

/// Pixels near the edge pixels that the depths at pixel centres give.
fn near_edges(size_px: [u32; 2], inverse_depth: &[f32]) -> Vec<bool> {
    let [width, height] = size_px.map(|side| side as usize);
    let middle = |[x, y]: [i64; 2]| f64::from(inverse_depth[y as usize * width + x as usize]);
    let is_marked =
        |i: usize| edge_mask::is_edge([(i % width) as i64, (i / width) as i64], size_px, 1, middle, None);
    let marked: Vec<bool> = (0..width * height).into_par_iter().map(is_marked).collect();
    let window =
        |index: usize, length: usize| index.saturating_sub(READ_PX)..(index + READ_PX + 1).min(length);
    let in_row = |i: usize| window(i % width, width).any(|x| marked[i / width * width + x]);
    let rows: Vec<bool> = (0..width * height).into_par_iter().map(in_row).collect();
    let in_column = |i: usize| window(i / width, height).any(|y| rows[y * width + i % width]);
    (0..width * height).into_par_iter().map(in_column).collect()
}

/// What 8 bits of sRGB store of linear light, 0..=1.
fn stored(linear: f32) -> f32 {
    (255.0 * srgb_from_linear(linear.clamp(0.0, 1.0))).round() / 255.0
}
