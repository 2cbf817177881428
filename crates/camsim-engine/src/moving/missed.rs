//! Pixels with a ray whose source no ideal frame holds, by rays of their own.
//!
//! What is half a metre away moves farther within a readout than any probe of the plan has shown, and then beyond the
//! border of the ideal frame. The paper's methods leave such pixels out.

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    scenario::{Preset, Primary},
    sequence::Sequence,
};
use camsim_plan::{FramePlan, uniforms::Truth};
use glam::DVec2;

use super::painter::{Painter, index};
use crate::cancel::Cancel;

/// The missed pixels of a lane.
#[derive(Debug, Default)]
pub(crate) struct Missed {
    /// Made for the first frame that needs it.
    painter: Option<Painter>,
    /// The camera of each colour, and which pixels have no ray, as far as these were looked for.
    without_ray: [Option<(Arc<CameraModel>, Vec<bool>)>; 3],
}

impl Missed {
    /// Gives the missed pixels of a frame their colours (linear R G B A, row-major), and leaves their truth to a
    /// ray. `sequence` has everything in the scene.
    pub fn paint(
        &mut self,
        (color_rgba, truth): (&mut [f32], Option<&mut Vec<Truth>>),
        plan: &FramePlan,
        sequence: &Arc<Sequence>,
        cancel: &Cancel,
    ) {
        if plan.preset == Preset::Paper {
            return;
        }
        let missed = self.missed(color_rgba, plan);
        if missed.is_empty() {
            return;
        }
        let painter = self.painter.get_or_insert_with(|| Painter::new(sequence, None));
        let caster = painter.caster();
        let pixels = missed.iter().map(|(pixel, _)| *pixel).collect();
        Painter::paint(color_rgba, pixels, cancel, |pixel, _| painter.means(caster, plan, &[pixel]));
        missed.iter().for_each(|(pixel, _)| color_rgba[4 * index(plan, *pixel) + 3] = 1.0);
        if let Some(truth) = truth {
            for (pixel, uv) in missed {
                // A depth below 0 is left to a ray.
                truth[index(plan, pixel)] =
                    Truth { uv: uv.as_vec2().to_array(), depth_m: -1.0, ..Truth::default() };
            }
        }
    }

    /// Pixels with a ray and without a colour, and their rays.
    fn missed(&mut self, color_rgba: &[f32], plan: &FramePlan) -> Vec<([u32; 2], DVec2)> {
        let count = color_rgba.len() / 4;
        let empty: Vec<usize> = (0..count).filter(|i| color_rgba[4 * i + 3] == 0.0).collect();
        if empty.is_empty() {
            return Vec::new();
        }
        let of_color = &mut self.without_ray[plan.primary.map_or(0, Primary::channel)];
        let known = of_color.take().filter(|(camera, _)| *camera == plan.camera);
        let (camera, mut without_ray) = known.unwrap_or_else(|| (plan.camera.clone(), vec![false; count]));
        let width = camera.size_px[0] as usize;
        let mut missed = Vec::new();
        for i in empty {
            if without_ray[i] {
                continue;
            }
            let pixel = [(i % width) as u32, (i / width) as u32];
            match camera.unproject_pixel(pixel) {
                Some(uv) => missed.push((pixel, uv)),
                None => without_ray[i] = true,
            }
        }
        *of_color = Some((camera, without_ray));
        missed
    }
}
