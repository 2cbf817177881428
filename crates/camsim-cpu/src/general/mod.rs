//! The reverse pass for every plan, in double precision. It renders the plans that the vectorised pass does
//! not support.
//!
//! The stages are those of the kernel in `camsim-gpu/shaders/reverse`, computed by the twins in
//! `camsim_core`: ray of the output pixel, pose of its row, temporal inverse, gather over the exposure,
//! silhouette rays, photometric stage, truth.

use camsim_core::{
    noise::tail_table,
    photometric::{Photometry, photometric},
    scenario::Preset,
    scene::linear_from_srgb,
    sequence::Sequence,
    temporal::{Footprint, paper::linear_fog, silhouette_rays::nearest_first},
};
use camsim_plan::{FramePlan, RayStage, uniforms::Truth};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

mod gather;
mod keys;
mod rays;
mod rows;
mod silhouettes;
mod solver;
#[cfg(test)]
mod tests;
mod truth;

use gather::Gather;
use keys::Key;
use rays::{Ray, Rays};
use rows::{Exposure, Rows};
use solver::Solver;

use crate::{
    ideal::{RasterFrame, Silhouettes},
    reverse::{EdgeTiles, KernelFrame, Listed},
    silhouettes::{Colors, IdealImage, KeyImage},
    simd::lanes::LANES,
};

pub use rows::RowTable;

/// Inputs of a frame besides its plan and its ideal frames.
#[derive(Clone, Copy, Debug)]
pub struct FrameInputs<'a> {
    /// Poses or times of the rows.
    pub rows: &'a RowTable,
    /// `CameraModel::lens_inverse` of the plan's camera. Empty if the ray stage does not read one.
    pub lens_map: &'a [[f32; 2]],
    /// Vignette weight of every pixel, row-major. Empty for a camera without vignette.
    pub vignette: &'a [f32],
    /// Exposure phase of the source coordinates, in [-0.5, 0.5]; 0 is mid-exposure.
    pub coords_phase: f32,
}

/// Renders a plan: row-major linear R G B A with A = 1 at valid pixels, and the truth if the plan has it.
/// `ideal` are the plan's key frames in their order.
///
/// # Panics
/// If the sizes of ideal frames, row table, lens map or vignette do not match the plan.
#[must_use]
pub fn render(
    plan: &FramePlan,
    sequence: &Sequence,
    ideal: &[IdealImage],
    inputs: &FrameInputs<'_>,
) -> (Vec<f32>, Option<Vec<Truth>>) {
    let pass = ReversePass::new(plan, sequence, images(ideal), inputs);
    let [width, height] = plan.camera.size_px.map(|side| side as usize);
    let mut picture = vec![[0.0; 4]; width * height];
    let mut truth = vec![Truth::default(); if plan.truth { width * height } else { 0 }];
    let image_rows = picture.par_chunks_mut(width).zip(0_u32..u32::MAX);
    match plan.truth {
        false => image_rows.for_each_init(Vec::new, |nodes_px, (colors, y)| {
            for (color, x) in colors.iter_mut().zip(0..) {
                *color = pass.pixel([x, y], nodes_px).0;
            }
        }),
        true => image_rows.zip(truth.par_chunks_mut(width)).for_each_init(
            Vec::new,
            |nodes_px, ((colors, y), truth)| {
                for ((color, truth), x) in colors.iter_mut().zip(truth).zip(0..) {
                    (*color, *truth) = pass.pixel([x, y], nodes_px);
                }
            },
        ),
    }
    (picture.into_flattened(), plan.truth.then_some(truth))
}

fn images<'a>(ideal: &'a [IdealImage]) -> Vec<KeyImage<'a>> {
    let image = |image: &'a IdealImage| {
        let IdealImage { geometry, color_rgba, inverse_depth, fine } = image;
        KeyImage { geometry, colors: Colors::Floats(color_rgba), inverse_depth, fine: fine.as_ref() }
    };
    ideal.iter().map(image).collect()
}

/// Gives the pixels that may see several surfaces rays of their own, where the vectorised pass has made a frame
/// from rasterised key frames.
#[derive(Debug)]
pub(crate) struct Repaint<'a>(ReversePass<'a>);

impl<'a> Repaint<'a> {
    /// `None` without key frames that silhouette rays can read.
    pub fn new(
        plan: &'a FramePlan,
        sequence: &'a Sequence,
        ideal: &'a [RasterFrame],
        inputs: &FrameInputs<'a>,
    ) -> Option<Self> {
        let image = |frame: &'a RasterFrame| {
            let Silhouettes { inverse_depth, fine } = frame.silhouettes.as_ref()?;
            let colors = Colors::Halves(&frame.color, frame.stride);
            Some(KeyImage { geometry: &plan.ideal, colors, inverse_depth, fine: Some(fine) })
        };
        Some(Self(ReversePass::new(plan, sequence, ideal.iter().map(image).collect::<Option<_>>()?, inputs)))
    }

    /// Where each key frame has edge pixels.
    pub fn edges(&self) -> Vec<EdgeTiles> {
        self.0.keys.iter().filter_map(|key| Some(key.silhouettes.as_ref()?.edge_tiles())).collect()
    }

    /// Replaces colour and truth of the listed pixels that see several surfaces.
    pub fn paint(&self, frame: &mut KernelFrame) {
        let width = self.0.plan.camera.size_px[0] as usize;
        let mut truth = frame.truth.as_deref_mut().unwrap_or_default().chunks_mut(width);
        let listed = frame.listed.chunks(width.div_ceil(LANES));
        let rows = frame.color_rgba.chunks_mut(4 * width).zip(listed).zip(0..);
        let rows: Vec<_> = rows.map(|row| (row, truth.next().unwrap_or_default())).collect();
        rows.into_par_iter().for_each(|(((colors, listed), y), truth)| {
            for (block, Listed { touched, near }) in listed.iter().enumerate() {
                let mut left = touched | near;
                while left != 0 {
                    let lane = left.trailing_zeros();
                    left &= left - 1;
                    let x = block * LANES + lane as usize;
                    let is_touched = touched >> lane & 1 == 1;
                    let rgb = &mut colors[4 * x..4 * x + 3];
                    self.0.repaint([x as u32, y], is_touched, rgb, truth.get_mut(x));
                }
            }
        });
    }
}

/// The state shared by all pixels of a frame.
#[derive(Debug)]
struct ReversePass<'a> {
    plan: &'a FramePlan,
    rays: Rays<'a>,
    rows: Rows,
    keys: Vec<Key<'a>>,
    gather: Gather,
    photometry: Photometry,
    vignette: &'a [f32],
    noise_seed: u64,
    /// Number of the frame whose noise it has.
    picture: u32,
    noise_table: Vec<f32>,
    coords_phase: f64,
}

/// An output pixel with a ray.
#[derive(Clone, Copy, Debug)]
struct Pixel<'a> {
    position: [u32; 2],
    ray: Ray,
    /// The key frame that is nearest in time to the pixel's row.
    key: usize,
    exposure: Exposure<'a>,
}

impl<'a> ReversePass<'a> {
    fn new(
        plan: &'a FramePlan,
        sequence: &'a Sequence,
        ideal: Vec<KeyImage<'a>>,
        inputs: &FrameInputs<'a>,
    ) -> Self {
        assert_eq!(ideal.len(), plan.keys.len(), "an ideal frame for each key frame");
        let [width, height] = plan.camera.size_px.map(|side| side as usize);
        assert!(
            inputs.vignette.is_empty() || inputs.vignette.len() == width * height,
            "a vignette of the camera's size"
        );
        let rows = Rows::new(plan, inputs.rows);
        let keys = ideal.into_iter().enumerate().map(|(number, image)| Key::new(plan, number, image, &rows));
        Self {
            plan,
            rays: Rays::new(&plan.camera, plan.ray, inputs.lens_map),
            keys: keys.collect(),
            rows,
            gather: Gather {
                solver: Solver::new(plan),
                blur: plan.blur,
                paper: plan.preset == Preset::Paper,
            },
            photometry: Photometry::new(&sequence.scenario.camera, plan.exposure.as_ref()),
            vignette: inputs.vignette,
            noise_seed: sequence.noise_seed(),
            picture: sequence.picture(plan.frame) as u32,
            noise_table: tail_table(),
            coords_phase: inputs.coords_phase.into(),
        }
    }

    /// Linear R G B A and truth of a pixel; all 0 if it sees nothing.
    fn pixel(&self, position: [u32; 2], nodes_px: &mut Vec<DVec2>) -> ([f32; 4], Truth) {
        self.visible_pixel(position, nodes_px).unwrap_or_default()
    }

    /// As [`ReversePass::pixel`]; `None` if the pixel sees nothing.
    fn visible_pixel(&self, position: [u32; 2], nodes_px: &mut Vec<DVec2>) -> Option<([f32; 4], Truth)> {
        let weight = self.vignette_weight(position);
        let is_dark = weight <= 0.0;
        // The paper preset computes no ray where the vignette is black, unless the frame has coordinates.
        let ray = match self.plan.ray {
            RayStage::GaussNewton if is_dark && !self.plan.truth => Ray::default(),
            _ => self.rays.ray(position)?,
        };
        let key = nearest_first(self.rows.fractions(position)[0], self.keys.len()).next().unwrap_or_default();
        let pixel = Pixel { position, ray, key, exposure: self.rows.exposure(key, position) };
        let (mut color, mut silhouette) = (DVec3::ZERO, None);
        if !is_dark {
            let of_key = &self.keys[key];
            let path = self.gather.path(ray.uv, &pixel.exposure, &of_key.depth, nodes_px);
            if !path.inside {
                return None;
            }
            let [d_dx, d_dy] = ray.d_uv.map(|d_uv| d_uv * of_key.ideal().focal_px);
            let area = Footprint::new(d_dx, d_dy, self.plan.taps);
            let marked = of_key.silhouettes.as_ref().is_some_and(|image| {
                silhouettes::touches_edge(self.gather.mean(&path, &area, &image.edge_image()).x)
            });
            silhouette = self.silhouette(&pixel, path.far_px, marked);
            color = silhouette
                .and_then(|silhouette| self.color_of_rays(&pixel, silhouette))
                .unwrap_or_else(|| self.gather.mean(&path, &area, &of_key.color));
        }
        let [r, g, b] = self.output_color(&pixel, color, weight);
        let truth = match self.plan.truth {
            true => self.truth(&pixel, silhouette.is_some(), nodes_px),
            false => Truth::default(),
        };
        Some(([r, g, b, 1.0], truth))
    }

    /// Replaces linear R G B and truth of a pixel that sees several surfaces; `marked` says whether its plain
    /// gather touched an edge pixel.
    fn repaint(&self, position: [u32; 2], marked: bool, rgb: &mut [f32], truth: Option<&mut Truth>) {
        let Some(ray) = self.rays.ray(position) else { return };
        let key = nearest_first(self.rows.fractions(position)[0], self.keys.len()).next().unwrap_or_default();
        let pixel = Pixel { position, ray, key, exposure: self.rows.exposure(key, position) };
        let Exposure { nodes: [first, .., last] | [first @ last], .. } = pixel.exposure else { return };
        let ideal = self.keys[key].ideal();
        let far_px =
            [first, last].map(|pose| ideal.px_from_point(self.gather.solver.point(ray.uv, pose, 0.0)));
        let Some(silhouette) = self.silhouette(&pixel, far_px, marked) else { return };
        if let Some(color) = self.color_of_rays(&pixel, silhouette) {
            rgb.copy_from_slice(&self.output_color(&pixel, color, self.vignette_weight(position)));
        }
        if let Some(truth) = truth.filter(|_| self.is_truth_unknown(&pixel)) {
            *truth = truth::unknown(&pixel);
        }
    }

    fn vignette_weight(&self, [x, y]: [u32; 2]) -> f32 {
        match self.vignette {
            [] => 1.0,
            weights => weights[y as usize * self.plan.camera.size_px[0] as usize + x as usize],
        }
    }

    /// Photometric stage of a gathered colour, preceded by the fog of the paper preset and followed by the
    /// decoding of its encoded values.
    fn output_color(&self, pixel: &Pixel<'_>, mut color: DVec3, weight: f32) -> [f32; 3] {
        if let Some(fog) = self.plan.linear_fog {
            let depth = &self.keys[pixel.key].depth;
            let own_px = depth.ideal.px_from_point(pixel.ray.uv.extend(1.0));
            let sky = DVec3::from_array(fog.sky_stored.map(f64::from));
            color = linear_fog(color, sky, pixel.ray.uv, depth.image.nearest(own_px), fog.end_m);
        }
        let value = photometric(
            &self.photometry,
            color.as_vec3().to_array(),
            weight,
            pixel.position,
            self.picture,
            self.noise_seed,
            &self.noise_table,
        );
        if self.gather.paper { value.map(linear_from_srgb) } else { value }
    }
}
