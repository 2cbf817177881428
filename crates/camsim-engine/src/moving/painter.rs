//! Colours by rays instead of a renderer's.

use std::sync::{Arc, OnceLock};

use camsim_core::{
    noise::tail_table,
    photometric::{Photometry, photometric},
    sequence::Sequence,
};
use camsim_cpu::{Instant, MovingCaster, RayScratch};
use camsim_plan::FramePlan;
use glam::{DMat2, DVec2, Vec3};
use rayon::prelude::*;

use crate::{
    cancel::Cancel,
    truth::{RAYS, ray},
};

/// What is painted with: rays through everything in a scene, and what follows the light of a pixel.
#[derive(Debug)]
pub(super) struct Painter {
    /// With everything.
    pub sequence: Arc<Sequence>,
    /// Built for the first frame that needs it.
    caster: Arc<OnceLock<MovingCaster>>,
    vignette: Vec<f32>,
    noise_table: Vec<f32>,
}

/// A pixel by its index, and its colour.
pub(super) type Painted = (usize, [f32; 3]);

impl Painter {
    /// `before` has the scene of an earlier sequence, which is kept if it is the same.
    pub fn new(sequence: &Arc<Sequence>, before: Option<&Self>) -> Self {
        let known = before.filter(|before| Arc::ptr_eq(&before.sequence.scene, &sequence.scene));
        Self {
            sequence: sequence.clone(),
            caster: known.map_or_else(Arc::default, |before| before.caster.clone()),
            vignette: sequence.vignette_weights().1,
            noise_table: tail_table(),
        }
    }

    pub fn caster(&self) -> &MovingCaster {
        self.caster.get_or_init(|| MovingCaster::new(&self.sequence.scene))
    }

    /// Colours of pixels of one row of the readout: means of rays over area and exposure.
    pub fn means(&self, caster: &MovingCaster, plan: &FramePlan, pixels: &[[u32; 2]]) -> Vec<Painted> {
        let Some(&[x, y]) = pixels.first() else { return Vec::new() };
        let mid_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y);
        let Sequence { path, scenario, .. } = &*self.sequence;
        let instants: Vec<(DVec2, Instant)> = (0..RAYS)
            .map(ray)
            .map(|(position, phase)| {
                let t_s = mid_s + phase * plan.shutter.exposure_pixel_s(x, y);
                (position, caster.at(t_s, path.pose(t_s)))
            })
            .collect();
        let stage = Photometry::new(&scenario.camera, plan.exposure.as_ref());
        let mut scratch = RayScratch::default();
        let color = |&pixel: &[u32; 2]| {
            let light = mean_color(caster, plan, &instants, pixel, &mut scratch)?;
            Some(self.finished(&stage, plan, pixel, light))
        };
        pixels.iter().filter_map(color).collect()
    }

    /// The colour of a pixel with this light.
    pub fn finished(&self, stage: &Photometry, plan: &FramePlan, pixel: [u32; 2], light: Vec3) -> Painted {
        let i = index(plan, pixel);
        let weight = self.vignette.get(i).or(self.vignette.first()).copied().unwrap_or(1.0);
        let picture = self.sequence.picture(plan.frame) as u32;
        let seed = self.sequence.noise_seed();
        (i, photometric(stage, light.to_array(), weight, pixel, picture, seed, &self.noise_table))
    }

    /// Replaces the colours that `line` gives for a row of the readout: linear R G B A, row-major. Once cancelled,
    /// some are left out.
    pub fn paint<T: Send>(
        color_rgba: &mut [f32],
        lines: Vec<T>,
        cancel: &Cancel,
        line: impl Fn(T, &[f32]) -> Vec<Painted> + Sync,
    ) {
        let before: &[f32] = color_rgba;
        let line = |each| if cancel.is_set() { Vec::new() } else { line(each, before) };
        let painted: Vec<Vec<Painted>> = lines.into_par_iter().map(line).collect();
        for (i, color) in painted.into_iter().flatten() {
            color_rgba[4 * i..4 * i + 3].copy_from_slice(&color);
        }
    }
}

/// Mean over a pixel's area and exposure, linear R G B.
fn mean_color(
    caster: &MovingCaster,
    plan: &FramePlan,
    instants: &[(DVec2, Instant)],
    pixel: [u32; 2],
    scratch: &mut RayScratch,
) -> Option<Vec3> {
    let camera = &plan.camera;
    let uv = camera.unproject(DVec2::from_array(pixel.map(f64::from)))?;
    let px_from_uv = DMat2::from_diagonal(camera.focal_px) * camera.lens.jacobian(uv);
    let uv_from_px = px_from_uv.inverse();
    // Each ray stands for its part of the pixel's area.
    let fraction = f64::from(instants.len() as u32).sqrt().recip();
    let step_uv = fraction * DVec2::new(uv_from_px.row(0).length(), uv_from_px.row(1).length());
    let ray = |(position, instant): &(DVec2, Instant)| {
        caster.color(instant, uv + uv_from_px * *position, step_uv, plan.surface_reads, scratch)
    };
    Some(instants.iter().map(ray).sum::<Vec3>() / instants.len() as f32)
}

/// Index of a pixel in its picture.
pub(super) fn index(plan: &FramePlan, [x, y]: [u32; 2]) -> usize {
    y as usize * plan.camera.size_px[0] as usize + x as usize
}
