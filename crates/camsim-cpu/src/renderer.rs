//! Renderer of one sequence: scene, lens map, and the ideal frames drawn last.

use std::{collections::HashMap, sync::Arc};

use camsim_core::{
    camera::CameraModel,
    scenario::{Face, Primary},
    scene::{LodTolerance, PlacedMesh, SceneBatches},
    sequence::Sequence,
    temporal::IdealGeometry,
};
use camsim_plan::{
    FramePlan, RayStage,
    placement::{cpu_draws, cpu_rasterises, cpu_takes_copies, cpu_vectorises},
    uniforms::{FrameUniforms, Truth},
};

use crate::{
    cast::CastScene,
    general::{self, FrameInputs, Repaint, RowTable},
    ideal::{DrawInputs, RasterFrame, RasterScene},
    reverse::{EdgeTiles, IdealTexels, Kernel, KernelFrame, KernelInputs, LensMap},
    silhouettes::IdealImage,
};

/// Number of buffers for ideal frames of a camera without faces: one for the current frame, one for the next. A
/// face has one: while it is drawn, the frame in flight is another face's.
const BUFFERS: usize = 2;

/// Handle of ideal frames that the renderer holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferHandle(usize);

/// Renders frames of one sequence.
#[derive(Debug)]
pub struct CpuRenderer {
    kernel: Kernel,
    sequence: Arc<Sequence>,
    meshes: Arc<SceneBatches>,
    /// Whether the rasteriser supports the scene.
    rasterises: bool,
    /// Whether rays draw every ideal frame and the general pass makes every output frame.
    general_only: bool,
    /// Whether the vectorised pass leaves exact truth to rays.
    leaves_truth: bool,
    /// Created when an ideal frame is first rasterised.
    raster: Option<RasterScene>,
    /// Created when an ideal frame is first cast.
    cast: Option<CastScene>,
    vignette: Vec<f32>,
    /// Lens map of each face and colour, and the bits of its zoom value.
    lens_maps: HashMap<(Option<Face>, Option<Primary>), (u64, LensMap)>,
    buffers: [KeyFrames; BUFFERS + Face::ALL.len()],
    last: usize,
}

/// The ideal frames of one output frame.
#[derive(Debug, Default)]
struct KeyFrames {
    size_px: [u32; 2],
    /// The key frames, if they were rasterised.
    drawn: Vec<RasterFrame>,
    /// All key frames, if they were cast; else empty.
    cast: Vec<IdealImage>,
}

/// Inputs of the output pass.
#[derive(Clone, Copy, Debug)]
pub struct ReverseInputs<'a> {
    /// The plan.
    pub plan: &'a FramePlan,
    /// Uniforms of the frame.
    pub uniforms: &'a FrameUniforms,
    /// Poses or times of the rows.
    pub rows: &'a RowTable,
}

impl CpuRenderer {
    /// Prepares for frames of a sequence.
    #[must_use]
    pub fn new(sequence: Arc<Sequence>, meshes: Arc<SceneBatches>) -> Self {
        Self {
            kernel: Kernel::new(),
            meshes,
            rasterises: cpu_rasterises(&sequence.scene, u32::MAX),
            general_only: false,
            leaves_truth: false,
            raster: None,
            cast: None,
            vignette: sequence.vignette_weights().1,
            lens_maps: HashMap::new(),
            buffers: Default::default(),
            last: 0,
            sequence,
        }
    }

    /// Leaves out rasteriser and vectorised pass, so that tests can compare what replaces them.
    #[doc(hidden)]
    pub fn set_general_only(&mut self, general_only: bool) {
        self.general_only = general_only;
    }

    /// Has the vectorised pass leave exact truth to rays: depths below 0.
    pub fn set_leaves_truth(&mut self, leaves_truth: bool) {
        self.leaves_truth = leaves_truth;
    }

    /// Switches to another sequence over the same scene.
    pub fn renew(&mut self, sequence: Arc<Sequence>) {
        self.lens_maps.clear();
        self.vignette = sequence.vignette_weights().1;
        self.sequence = sequence;
    }

    /// Draws the ideal frames of a plan: by the rasteriser if it supports them, else by ray casting. `terrain`
    /// has the triangles that each shows, if there is one. It overwrites those drawn before the last ones.
    pub fn draw_ideal(
        &mut self,
        plan: &FramePlan,
        terrain: &[PlacedMesh],
        tolerance: &LodTolerance,
    ) -> BufferHandle {
        // The frame in flight may still read the other buffer.
        let buffer = match plan.camera.lens.face() {
            Some(face) => BUFFERS + face as usize,
            None => {
                self.last = (self.last + 1) % BUFFERS;
                self.last
            }
        };
        let scene = &self.sequence.scene;
        let ideal = &mut self.buffers[buffer];
        ideal.size_px = plan.ideal.size_px;
        ideal.cast.clear();
        if self.general_only || !(self.rasterises && cpu_draws(plan)) {
            let cast = self.cast.get_or_insert_with(|| CastScene::new(scene));
            ideal.cast.extend(plan.keys.iter().map(|key| cast.draw(plan, key)));
            return BufferHandle(buffer);
        }
        let raster = self.raster.get_or_insert_with(|| RasterScene::new(scene, &self.meshes));
        ideal.drawn.resize_with(plan.keys.len(), RasterFrame::default);
        for (number, (key, drawn)) in plan.keys.iter().zip(&mut ideal.drawn).enumerate() {
            let terrain = terrain.get(number);
            raster.draw(DrawInputs { plan, scene, batches: &self.meshes, terrain, tolerance }, key, drawn);
            if plan.shadows.is_some() {
                let cast = self.cast.get_or_insert_with(|| CastScene::new(scene));
                cast.add_shadows(plan, key, drawn);
            }
        }
        BufferHandle(buffer)
    }

    /// The first ideal frame of a buffer: linear R G B A (with the paper preset sRGB-encoded values) and
    /// inverse depth, 1/m, row-major.
    #[must_use]
    pub fn ideal_images(&self, BufferHandle(buffer): BufferHandle) -> (Vec<f32>, Vec<f32>) {
        let ideal = &self.buffers[buffer];
        match (ideal.cast.first(), ideal.drawn.first()) {
            (Some(image), _) => (image.color_rgba.clone(), image.inverse_depth.clone()),
            (None, drawn) => drawn.map(|drawn| drawn.images(ideal.size_px)).unwrap_or_default(),
        }
    }

    /// Output frame from ideal frames that were drawn here: linear R G B A, row-major, and the truth if the
    /// plan has it.
    pub fn reverse(
        &mut self,
        inputs: &ReverseInputs<'_>,
        BufferHandle(buffer): BufferHandle,
    ) -> (Vec<f32>, Option<Vec<Truth>>) {
        let plan = inputs.plan;
        self.fit_lens_map(plan);
        let ideal = &self.buffers[buffer];
        match inputs.rows {
            RowTable::Poses(_) if cpu_vectorises(plan) && !self.general_only => match &*ideal.cast {
                [] => self.reverse_rasterised(inputs, &ideal.drawn),
                cast => self.reverse_rasterised(
                    inputs,
                    &cast.iter().map(RasterFrame::from_image).collect::<Vec<_>>(),
                ),
            },
            _ if ideal.cast.is_empty() => {
                let images: Vec<_> = ideal.drawn.iter().map(|drawn| image_of(drawn, &plan.ideal)).collect();
                self.general(inputs, &images)
            }
            _ => self.general(inputs, &ideal.cast),
        }
    }

    /// Output frame of a plan that the cpu [makes from copies](camsim_plan::placement::cpu_takes_copies), from
    /// the ideal frame that another renderer has drawn: linear R G B A, row-major, and the truth if the plan has
    /// it. `None` for other plans.
    pub fn reverse_from(
        &mut self,
        inputs: &ReverseInputs<'_>,
        ideal: IdealTexels<'_>,
    ) -> Option<(Vec<f32>, Option<Vec<Truth>>)> {
        self.fit_lens_map(inputs.plan);
        match inputs.rows {
            RowTable::Poses(_) if self.general_only => {
                Some(self.general(inputs, &[image_of_texels(&ideal, &inputs.plan.ideal)]))
            }
            RowTable::Poses(_) if cpu_takes_copies(inputs.plan) => {
                let frame = self.vectorised(inputs, &[ideal], &[]);
                Some((frame.color_rgba, frame.truth))
            }
            _ => None,
        }
    }

    /// Output frame of a vectorised plan from rasterised ideal frames.
    fn reverse_rasterised(
        &self,
        inputs: &ReverseInputs<'_>,
        drawn: &[RasterFrame],
    ) -> (Vec<f32>, Option<Vec<Truth>>) {
        let frame_inputs = self.frame_inputs(inputs);
        let repaint = Repaint::new(inputs.plan, &self.sequence, drawn, &frame_inputs);
        let edges = repaint.as_ref().map(Repaint::edges).unwrap_or_default();
        let texels: Vec<IdealTexels<'_>> = drawn.iter().map(RasterFrame::texels).collect();
        let mut frame = self.vectorised(inputs, &texels, &edges);
        if let Some(repaint) = repaint {
            repaint.paint(&mut frame);
        }
        (frame.color_rgba, frame.truth)
    }

    fn vectorised(
        &self,
        inputs: &ReverseInputs<'_>,
        ideals: &[IdealTexels<'_>],
        edges: &[EdgeTiles],
    ) -> KernelFrame {
        let &ReverseInputs { plan, uniforms: frame, rows } = inputs;
        let poses = if let RowTable::Poses(poses) = rows { &poses.entries[..] } else { &[] };
        let (map, vignette, leaves_truth) = (self.lens_map(plan), &self.vignette[..], self.leaves_truth);
        let inputs = KernelInputs { frame, poses, map, vignette, ideals, edges, leaves_truth };
        self.kernel.render(plan, &inputs)
    }

    fn general(&self, inputs: &ReverseInputs<'_>, ideal: &[IdealImage]) -> (Vec<f32>, Option<Vec<Truth>>) {
        general::render(inputs.plan, &self.sequence, ideal, &self.frame_inputs(inputs))
    }

    fn frame_inputs<'a>(&'a self, inputs: &ReverseInputs<'a>) -> FrameInputs<'a> {
        FrameInputs {
            rows: inputs.rows,
            lens_map: self.lens_map(inputs.plan).map_or(&[][..], LensMap::rays),
            vignette: if self.vignette.len() > 1 { &self.vignette } else { &[] },
            coords_phase: inputs.uniforms.coords_phase,
        }
    }

    /// Makes the lens map of a plan, unless it is cached.
    fn fit_lens_map(&mut self, plan: &FramePlan) {
        let bits = plan.zoom.unwrap_or_default().to_bits();
        let key = plan.lens_key();
        let is_there = self.lens_maps.get(&key).is_some_and(|(zoom, _)| *zoom == bits);
        if plan.ray == RayStage::LensMap && !is_there {
            let camera: &CameraModel = &plan.camera;
            self.lens_maps.insert(key, (bits, LensMap::new(camera)));
        }
    }

    fn lens_map(&self, plan: &FramePlan) -> Option<&LensMap> {
        self.lens_maps.get(&plan.lens_key()).map(|(_, map)| map)
    }
}

/// Converts a rasterised ideal frame for the general pass.
fn image_of(drawn: &RasterFrame, geometry: &IdealGeometry) -> IdealImage {
    let (color_rgba, inverse_depth) = drawn.images(geometry.size_px);
    let fine = drawn.silhouettes.as_ref().map(|silhouettes| silhouettes.fine.clone());
    IdealImage { geometry: *geometry, color_rgba, inverse_depth, fine }
}

/// A copied ideal frame in the form that the general pass reads.
fn image_of_texels(texels: &IdealTexels<'_>, geometry: &IdealGeometry) -> IdealImage {
    let [width, height] = geometry.size_px.map(|side| side as usize);
    let color = texels.color.chunks(4 * texels.color_stride as usize).take(height);
    let depth = texels.depth.chunks(texels.depth_stride as usize).take(height);
    IdealImage {
        geometry: *geometry,
        color_rgba: color
            .flat_map(|row| row[..4 * width].iter().map(|&bits| half::f16::from_bits(bits).to_f32()))
            .collect(),
        inverse_depth: depth
            .flat_map(|row| row[..width].iter().map(|&depth| depth / camsim_plan::NEAR_M as f32))
            .collect(),
        fine: None,
    }
}
