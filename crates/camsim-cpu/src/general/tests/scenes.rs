//! Synthetic sequences, their ideal frames by rays, and what is compared of frames.

use std::sync::Arc;

use camsim_core::{
    frame::{Plane, RenderedFrame},
    photometric::vignette_weights,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Channel, MountSpec, Scenario},
    scene::{Encoding, Mesh, MeshVertex, Scene, Texture, Wrap, srgb_from_linear},
    sequence::Sequence,
    temporal::supersampled::SupersampledImage,
    trajectory::Trajectory,
};
use camsim_plan::{EdgeStage, FramePlan, Planner, RayStage};
use glam::{DVec2, DVec3};
use half::f16;
use rayon::prelude::*;

use camsim_plan::uniforms::Truth;

use crate::{
    fixtures,
    general::{FrameInputs, IdealImage, ReversePass, RowTable, images, render},
    silhouettes::FineSamples,
};

pub use crate::fixtures::{barrel_lens, ground_and_roof, pattern as ground, rolling};

/// Mean square error of colours, in DN, that is compared as a root.
pub const DN: f64 = 255.0;
/// Heading at t = 0.
pub const HEADING_RAD: f64 = 0.3;
/// Flight to the east.
pub const EAST: DVec3 = DVec3::new(3.0, 40.0, 1.0);
/// Turn about all axes, rad/s.
pub const TURN: DVec3 = DVec3::new(0.2, -0.3, 0.5);

/// A small camera that looks steeply down.
pub fn scenario() -> Scenario {
    let mut scenario = fixtures::scenario();
    scenario.camera.size_px = [48, 36];
    scenario.camera.focal_px = [42.0, 40.0];
    scenario.camera.mount = MountSpec { angles_deg: [8.0, -70.0, 15.0], ..MountSpec::default() };
    scenario.quality.max_error_px = 1e-3;
    scenario
}

/// Constant velocity and body rate about t = 0, when the camera is `height_m` over the origin.
pub fn steady(height_m: f64, velocity_ned_m_s: DVec3, rate_body_rad_s: DVec3) -> Trajectory {
    fixtures::steady(height_m, HEADING_RAD.to_degrees(), velocity_ned_m_s, rate_body_rad_s)
}

/// A black wall 60 m to the north before a white sky.
pub fn wall() -> Scene {
    let corners = [[0.0, -16.0, 10.0], [0.0, 14.0, 10.0], [0.0, 14.0, -32.0], [0.0, -16.0, -24.0_f32]];
    let vertices = corners.map(|corner| MeshVertex::new(corner, [0.0; 2])).to_vec();
    let black = Arc::new(Texture::uniform([0, 0, 0, 255], Encoding::Linear));
    let origin_ned_m = DVec3::new(60.0, 0.0, 0.0);
    let wall = Mesh::new(vertices, vec![0, 1, 2, 0, 2, 3], black, origin_ned_m, Wrap::Clamp);
    Scene { meshes: vec![wall], sky_linear: [1.0; 3], ..Scene::default() }
}

pub fn sequence(scenario: Scenario, trajectory: Trajectory, scene: Scene) -> Sequence {
    Arc::unwrap_or_clone(fixtures::sequence(scenario, trajectory, scene))
}

/// A frame in the making.
pub struct Case {
    pub sequence: Arc<Sequence>,
    pub plan: FramePlan,
    pub reference: ReferenceRenderer,
}

impl Case {
    /// The plan of frame 0 with depth and coordinates.
    pub fn new(sequence: Sequence) -> Self {
        Self::with_channels(sequence, &[Channel::Color, Channel::Coords, Channel::Depth])
    }

    pub fn with_channels(sequence: Sequence, channels: &[Channel]) -> Self {
        let sequence = Arc::new(sequence);
        let plan = Planner::new(sequence.clone(), channels, 16_384).unwrap().plan(0).unwrap();
        let reference = ReferenceRenderer::new(sequence.clone()).unwrap();
        Self { sequence, plan, reference }
    }

    /// With ideal frames that reach farther on all sides.
    pub fn widened(mut self, margin_px: u32) -> Self {
        self.plan.ideal.size_px = self.plan.ideal.size_px.map(|side| side + 2 * margin_px);
        self.plan.ideal.principal_px += f64::from(margin_px);
        self
    }

    /// The ideal frames by rays.
    pub fn ideal(&self) -> Vec<IdealImage> {
        (0..self.plan.keys.len()).map(|number| self.ideal_image(number)).collect()
    }

    fn ideal_image(&self, number: usize) -> IdealImage {
        let size_px = self.plan.ideal.size_px;
        let middles: Vec<(f64, DVec3)> =
            positions(size_px).map(|position_px| self.ideal_pixel(number, position_px)).collect();
        let is_stored = self.plan.preset == camsim_core::scenario::Preset::Paper;
        let color = |color: DVec3| {
            let [r, g, b] = color.as_vec3().to_array();
            let stored = |value: f32| if is_stored { srgb_from_linear(value) } else { value };
            [stored(r), stored(g), stored(b), 1.0]
        };
        let inverse_depth: Vec<f32> = middles.iter().map(|&(w, _)| w as f32).collect();
        let fine = match self.plan.edges {
            EdgeStage::None => None,
            EdgeStage::Supersampled { scale, thin, .. } => {
                let fine_pixels: Vec<[(f64, DVec3); 4]> = positions(size_px.map(|side| side * scale))
                    .map(|corner| {
                        SupersampledImage::SAMPLE_POSITIONS.map(|position| {
                            self.ideal_pixel(number, (corner + position) / f64::from(scale) - 0.5)
                        })
                    })
                    .collect();
                let depth = |samples: &[(f64, DVec3); 4]| samples.map(|(w, _)| w as f32);
                let depths: Vec<[f32; 4]> = fine_pixels.iter().map(depth).collect();
                let color = |(_, color): (f64, DVec3)| color.to_array().map(f16::from_f64);
                let colors = match scale {
                    1 => Vec::new(),
                    _ => fine_pixels.iter().map(|samples| samples.map(color)).collect(),
                };
                Some(FineSamples::of_quads(size_px, &inverse_depth, (scale, thin), &depths, colors))
            }
        };
        IdealImage {
            geometry: self.plan.ideal,
            color_rgba: middles.iter().flat_map(|&(_, linear)| color(linear)).collect(),
            inverse_depth,
            fine,
        }
    }

    /// Inverse depth and linear colour at a position of an ideal frame.
    pub fn ideal_pixel(&self, number: usize, position_px: DVec2) -> (f64, DVec3) {
        let (ideal, pose) = (&self.plan.ideal, &self.plan.keys[number].pose);
        let uv = (position_px - ideal.principal_px) / ideal.focal_px;
        let hit = self.reference.cast(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0));
        (hit.map_or(0.0, |hit| 1.0 / hit.depth_m), self.reference.radiance(pose, uv))
    }

    pub fn render(&self, coords_phase: f64) -> (Vec<f32>, Vec<Truth>) {
        self.render_from(&self.ideal(), coords_phase)
    }

    pub fn render_from(&self, ideal: &[IdealImage], coords_phase: f64) -> (Vec<f32>, Vec<Truth>) {
        let (picture, truth) =
            self.with_inputs(coords_phase, |inputs| render(&self.plan, &self.sequence, ideal, inputs));
        (picture, truth.unwrap_or_default())
    }

    pub fn with_pass<T>(&self, ideal: &[IdealImage], run: impl FnOnce(&ReversePass<'_>) -> T) -> T {
        self.with_inputs(0.0, |inputs| {
            run(&ReversePass::new(&self.plan, &self.sequence, images(ideal), inputs))
        })
    }

    fn with_inputs<T>(&self, coords_phase: f64, run: impl FnOnce(&FrameInputs<'_>) -> T) -> T {
        let map = match self.plan.ray {
            RayStage::LensMap => self.plan.camera.lens_inverse(),
            RayStage::Pinhole | RayStage::GaussNewton => Vec::new(),
        };
        let spec = &self.sequence.scenario.camera.photometric;
        let vignette = self.sequence.vignette.as_ref().map_or(Vec::new(), |vignette| {
            vignette_weights(vignette, self.plan.camera.size_px, spec.vignette_thresholds)
        });
        run(&FrameInputs {
            rows: &RowTable::new(&self.plan, &self.sequence.path),
            lens_map: &map,
            vignette: &vignette,
            coords_phase: coords_phase as f32,
        })
    }

    /// As the reference compares it.
    pub fn frame(&self, (picture, truth): &(Vec<f32>, Vec<Truth>)) -> RenderedFrame {
        let coords = truth.iter().map(|truth| {
            let ([u, v], [x, y], [n, e, d]) = (truth.uv, truth.source_px, truth.point_ned_m);
            [u, v, x, y, 0.0, n, e, d]
        });
        RenderedFrame {
            index: 0,
            size_px: self.plan.camera.size_px,
            planes: vec![
                Plane::color(picture.clone()),
                Plane::depth(truth.iter().map(|truth| truth.depth_m).collect()),
                Plane::coords(coords.collect()),
            ],
            ..RenderedFrame::default()
        }
    }

    /// The picture of the reference.
    pub fn expected(&self) -> Vec<f32> {
        let options = RenderOptions { tolerance_dn: 0.2, max_samples: 512, ..RenderOptions::default() };
        self.reference.render(0, &options).into_color()
    }

    pub fn pixels(&self) -> impl Iterator<Item = (usize, [u32; 2])> {
        let [width, height] = self.plan.camera.size_px;
        (0..width * height).map(move |i| (i as usize, [i % width, i / width]))
    }
}

fn positions([width, height]: [u32; 2]) -> impl IndexedParallelIterator<Item = DVec2> {
    (0..width * height).into_par_iter().map(move |i| DVec2::new((i % width).into(), (i / width).into()))
}

/// RMS difference of the colours of some pixels, DN; pixels that one picture alone shows count as 1.
pub fn rms_dn(a: &[f32], b: &[f32], chosen: impl Fn(usize) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0_u32);
    for (i, (a, b)) in a.chunks_exact(4).zip(b.chunks_exact(4)).enumerate().filter(|(i, _)| chosen(*i)) {
        for channel in 0..3 {
            sum += if a[3] == b[3] { f64::from(a[channel] - b[channel]).powi(2) } else { 1.0 };
            count += 1;
        }
        let _ = i;
    }
    assert!(count > 0, "nothing is compared");
    DN * (sum / f64::from(count)).sqrt()
}
