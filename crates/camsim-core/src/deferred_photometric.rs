//! The photometric stage of a finished frame, for what passes that make one colour each, or have one weight for
//! all colours, cannot do ([`crate::scenario::CameraSpec::defers_photometric`]).

use rayon::prelude::*;

use crate::{
    exposure::FrameExposure,
    frame::RenderedFrame,
    noise::tail_table,
    photometric::{Photometry, photometric},
    scenario::{CameraSpec, Primary},
    sequence::Sequence,
    timing_faults::picture_of,
};

/// What is made of the light of whole frames.
#[derive(Debug)]
pub struct DeferredPhotometric {
    camera: CameraSpec,
    /// The scenario's seed, and that of the camera's noise.
    seeds: [u64; 2],
    table: Vec<f32>,
    /// Weights of red, green and blue, row-major; empty where they are 1.
    weights: [Vec<f32>; 3],
}

impl DeferredPhotometric {
    /// `None` where the passes do it, and for parts of a camera: it takes whole frames.
    #[must_use]
    pub fn new(sequence: &Sequence) -> Option<Self> {
        let camera = &sequence.scenario.camera;
        if !camera.defers_photometric() || camera.face.is_some() || camera.primary.is_some() {
            return None;
        }
        let weights = |primary| sequence.light_weights(primary).unwrap_or_default();
        Some(Self {
            camera: camera.clone(),
            seeds: [sequence.scenario.seed, sequence.noise_seed()],
            table: tail_table(),
            weights: [Primary::Red, Primary::Green, Primary::Blue].map(weights),
        })
    }

    /// Applies the stage to the light of a frame. `exposure` is its own, where automatic exposure sets it.
    pub fn finish(&self, frame: &mut RenderedFrame, exposure: Option<&FrameExposure>) {
        let width = frame.size_px[0] as usize;
        let [seed, noise_seed] = self.seeds;
        let picture = picture_of(&self.camera, seed, frame.index) as u32;
        let stage = Photometry::before_point_spread(&self.camera, exposure);
        frame.color_rgba_mut().par_chunks_mut(4 * width).enumerate().for_each(|(y, row)| {
            for (x, rgba) in row.chunks_exact_mut(4).enumerate().filter(|(_, rgba)| rgba[3] > 0.0) {
                let weight = |weights: &Vec<f32>| weights.get(y * width + x).copied().unwrap_or(1.0);
                let weights = self.weights.each_ref().map(weight);
                let light = std::array::from_fn(|k| rgba[k] * weights[k]);
                let pixel = [x as u32, y as u32];
                let value = photometric(&stage, light, 1.0, pixel, picture, noise_seed, &self.table);
                rgba[..3].copy_from_slice(&value);
            }
        });
    }
}
