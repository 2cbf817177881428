//! Ideal frames by a CPU rasteriser with deferred shading.
//!
//! A software adapter's driver draws triangles as a GPU would: it shades 4x4 pixels for each triangle that
//! touches them, and a small triangle takes about a microsecond. Here rasterisation only determines the
//! visible triangle and the depth of each pixel (a visibility buffer). Then each pixel is shaded once, from
//! the attribute planes of its own triangle, whose derivatives are exact. Vertices are snapped to the GPUs'
//! grid of 1/256 px and borders follow the top-left rule, so that no pixel is covered twice or missed.
//!
//! Pipeline: vertices ([`vertices`]) -> triangles, binned into bands of rows ([`triangles`]) -> visible
//! triangles ([`rasterise`]) -> colours ([`shade`], [`prefilter`]).

use std::{collections::HashMap, ops::Range, sync::Arc};

use camsim_core::{
    pose::CameraPose,
    scene::{Batch, Light, LodTolerance, PlacedMesh, Scene, SceneBatches, Texture, Wrap},
};
use camsim_plan::{FramePlan, NEAR_M};
use rayon::prelude::*;

use crate::general::IdealImage;
use crate::large_pages::Large;
use crate::reverse::IdealTexels;
use crate::simd::{
    lanes::LANES,
    vectors::{Vectors, widest},
};
use camsim_plan::uniforms::{base_ned_m, ideal_camera};

mod meshes;
mod multisample;
mod prefilter;
mod rasterise;
mod sampled_tiles;
mod shade;
#[cfg(test)]
mod tests;
mod texture;
mod triangles;
mod vertices;

use meshes::{Piece, Scratch, TRIANGLES_A_CHUNK};
use multisample::{Multisample, SAMPLES_PER_SIDE};
use rasterise::{Band, PixelCentres, ROW_PADDING, SKY, SamplePattern};
use shade::{Material, PixelPlanes, Shader};
use texture::SurfaceTexture;
use triangles::{BAND_ROWS, Chunk, EXTRA_ATTRIBUTES, TriangleKind};
use vertices::{Camera, Vertex};

/// Terrain vertices per projection task.
const CORNERS_A_TASK: usize = 4096;
/// Chunks per pass: a million triangles at most, which bounds their memory and their ids. Scenes with more
/// are drawn in several passes, each over the one before.
const CHUNKS_A_ROUND: usize = 256;
/// Index of the terrain's material.
const GROUND: u32 = 0;
/// Half floats of a texel: R G B A.
const CHANNELS: usize = 4;

/// An ideal frame in memory.
#[derive(Debug, Default)]
pub struct RasterFrame {
    /// Linear R G B A, half floats.
    pub(crate) color: Large<u16>,
    /// near / z, 0 = infinitely far.
    pub(crate) depth: Large<f32>,
    /// Texels from one row to the next, of colour and depth.
    pub(crate) stride: usize,
}

impl RasterFrame {
    /// Sets the size.
    fn fit(&mut self, size_px: [u32; 2]) {
        let [width, height] = size_px.map(|side| side as usize);
        self.stride = (width + ROW_PADDING).next_multiple_of(LANES);
        self.depth.fit(self.stride * height);
        self.color.fit(CHANNELS * self.stride * height);
    }

    /// Converts linear R G B A and inverse depths in single precision.
    pub(crate) fn from_image(image: &IdealImage) -> Self {
        let mut frame = Self::default();
        frame.fit(image.geometry.size_px);
        let width = image.geometry.size_px[0] as usize;
        let (stride, near_m) = (frame.stride, NEAR_M as f32);
        let rows = frame.color.par_chunks_mut(CHANNELS * stride).zip(frame.depth.par_chunks_mut(stride));
        let values = image.color_rgba.par_chunks(CHANNELS * width).zip(image.inverse_depth.par_chunks(width));
        rows.zip(values).for_each(|((color, depth), (rgba, inverse_depth))| {
            color
                .iter_mut()
                .zip(rgba)
                .for_each(|(half, &value)| *half = half::f16::from_f32(value).to_bits());
            depth
                .iter_mut()
                .zip(inverse_depth)
                .for_each(|(depth, &inverse_depth)| *depth = inverse_depth * near_m);
        });
        frame
    }

    /// The frame as the vectorised pass reads it.
    pub(crate) fn texels(&self) -> IdealTexels<'_> {
        let stride = self.stride as u32;
        IdealTexels { color: &self.color, color_stride: stride, depth: &self.depth, depth_stride: stride }
    }

    /// Linear R G B A and inverse depth, 1/m, of a frame of this size, row-major.
    pub fn images(&self, [width, height]: [u32; 2]) -> (Vec<f32>, Vec<f32>) {
        let (width, height) = (width as usize, height as usize);
        let color = self
            .color
            .chunks_exact(CHANNELS * self.stride)
            .take(height)
            .flat_map(|row| &row[..CHANNELS * width]);
        let depth = self.depth.chunks_exact(self.stride).take(height).flat_map(|row| &row[..width]);
        (
            color.map(|&bits| half::f16::from_bits(bits).to_f32()).collect(),
            depth.map(|depth| depth / NEAR_M as f32).collect(),
        )
    }
}

/// A scene in the form of the rasteriser.
#[derive(Debug)]
pub(crate) struct RasterScene {
    /// Materials: of the terrain, then of the mesh batches.
    materials: Vec<Material>,
    /// Meshes by batch.
    models: Vec<MeshModel>,
    chunks: Vec<Chunk>,
    terrain: Vec<Vertex<2>>,
    /// Visible triangle of each pixel.
    visible: Large<u32>,
    /// State for frames with several samples per pixel.
    multisample: Multisample,
}

/// Meshes of one shape and material.
#[derive(Debug)]
struct MeshModel {
    /// Pieces by level of detail.
    levels: Vec<Vec<Piece>>,
    one_sided: bool,
    light: Option<Light>,
}

/// Consecutive triangles of a chunk.
#[derive(Debug)]
enum DrawPart {
    /// A range of terrain indices.
    Terrain(Range<usize>),
    /// A piece of one level of detail of a batch, for a range of placements in view.
    Piece { batch: usize, level: usize, piece: usize, places: Range<usize> },
}

/// Scratch buffers for meshes without and with per-vertex tint or lighting.
type ScratchBuffers = (Scratch<2>, Scratch<{ 2 + EXTRA_ATTRIBUTES }>);

/// Inputs of an ideal frame.
#[derive(Clone, Copy)]
pub(crate) struct DrawInputs<'a> {
    pub plan: &'a FramePlan,
    pub scene: &'a Scene,
    pub batches: &'a SceneBatches,
    /// Triangles of the terrain, if there is one.
    pub terrain: Option<&'a PlacedMesh>,
    pub tolerance: &'a LodTolerance,
}

/// A view with its camera and visible meshes.
#[derive(Clone, Copy)]
struct DrawContext<'a> {
    camera: Camera,
    pose: &'a CameraPose,
    view: DrawInputs<'a>,
    /// Placements of meshes that may be in view.
    in_view: &'a [u32],
}

impl RasterScene {
    /// Prepares a scene that the rasteriser [supports](camsim_plan::placement::cpu_rasterises).
    #[must_use]
    pub fn new(scene: &Scene, batches: &SceneBatches) -> Self {
        let mut pictures = TextureCache::default();
        let ground = match &scene.terrain {
            Some(terrain) => SurfaceTexture::new(&terrain.texture, [Wrap::Clamp; 2], terrain.beyond),
            None => SurfaceTexture::Uniform([0.0; 4]),
        };
        let mut materials = vec![Material {
            texture: Arc::new(ground),
            tint: [1.0; 3],
            emissive: [0.0; 3],
            has_extra: false,
            sky: None,
        }];
        materials.extend(batches.batches.iter().map(|batch| material(batch, pictures.of(batch))));
        let model = |batch: &Batch| MeshModel {
            levels: Piece::of_levels(&batch.shape, &batch.levels),
            one_sided: batch.material.one_sided,
            light: batch.light,
        };
        let models = batches.batches.iter().map(model).collect();
        Self {
            materials,
            models,
            chunks: Vec::new(),
            terrain: Vec::new(),
            visible: Large::default(),
            multisample: Multisample::default(),
        }
    }

    /// Draws the one ideal frame of a plan.
    pub fn draw(&mut self, view: DrawInputs<'_>, into: &mut RasterFrame) {
        let Some(key) = view.plan.keys.first() else { return };
        let ideal = &view.plan.ideal;
        let camera = Camera {
            uniforms: ideal_camera(view.plan, &key.pose, base_ned_m(&key.pose), view.scene),
            focal_px: ideal.focal_px.as_vec2().to_array(),
            principal_px: ideal.principal_px.as_vec2().to_array(),
            size_px: ideal.size_px,
            sample_offset: 0,
        };
        let (in_view, drawn) = view.batches.in_view(&key.pose, view.tolerance);
        let mut parts = terrain_parts(view.terrain);
        self.add_parts(&drawn, &mut parts);
        let jobs = jobs(parts);
        let context = DrawContext { camera, pose: &key.pose, view, in_view: &in_view };
        match view.plan.samples_a_pixel {
            1 => self.draw_all(PixelCentres, &context, &jobs, into),
            _ => self.draw_samples(&DrawContext { camera: camera.sample_grid(), ..context }, &jobs, into),
        }
    }

    /// Draws all chunks, in several passes if there are many.
    fn draw_all<P: SamplePattern>(
        &mut self,
        places: P,
        context: &DrawContext<'_>,
        jobs: &[Vec<DrawPart>],
        into: &mut RasterFrame,
    ) {
        let DrawContext { camera, view, .. } = context;
        into.fit(camera.size_px);
        self.visible.fit(into.depth.len());
        self.project_terrain(camera, view.terrain);
        for round in 0..jobs.len().div_ceil(CHUNKS_A_ROUND).max(1) {
            let first = round * CHUNKS_A_ROUND;
            let jobs = &jobs[first..jobs.len().min(first + CHUNKS_A_ROUND)];
            self.collect(context, jobs, |_| {});
            self.fill(places, camera, view.plan, jobs.len(), round > 0, into);
        }
    }

    /// Draws a frame with several samples per pixel, as seen by the camera of the sample grid.
    fn draw_samples(&mut self, context: &DrawContext<'_>, jobs: &[Vec<DrawPart>], into: &mut RasterFrame) {
        let DrawContext { camera, view, .. } = context;
        into.fit(view.plan.ideal.size_px);
        if jobs.len() > CHUNKS_A_ROUND {
            // The visible triangle of each sample would have to be kept between passes: instead each sample
            // is drawn and shaded as a pixel.
            let mut samples = RasterFrame::default();
            self.draw_all(rasterise::SamplePositions, context, jobs, &mut samples);
            return multisample::resolve_samples(&samples, view.plan.ideal.size_px, into);
        }
        self.visible.fit(into.depth.len());
        self.project_terrain(camera, view.terrain);
        let mut multisample = std::mem::take(&mut self.multisample);
        multisample.clear(camera.size_px);
        self.collect(context, jobs, |chunk| multisample.mark(chunk));
        let chunks = &self.chunks[..jobs.len()];
        let shader = Shader {
            camera,
            chunks,
            materials: &self.materials,
            taps: view.plan.surface_reads,
            pixel_step: SAMPLES_PER_SIDE as f32,
            is_overlay: false,
        };
        multisample.fill(&shader, &mut self.visible, into);
        self.multisample = multisample;
    }

    fn add_parts(&self, drawn: &[Vec<Range<u32>>], parts: &mut Vec<(DrawPart, usize)>) {
        for (batch, (model, drawn)) in self.models.iter().zip(drawn).enumerate() {
            for (level, (pieces, places)) in model.levels.iter().zip(drawn).enumerate() {
                for (piece, of) in pieces.iter().enumerate() {
                    let together = (TRIANGLES_A_CHUNK / of.len().max(1)).max(1);
                    let (begin, end) = (places.start as usize, places.end as usize);
                    parts.extend((begin..end).step_by(together).map(|first| {
                        let places = first..(first + together).min(end);
                        let triangles = of.len() * places.len();
                        (DrawPart::Piece { batch, level, piece, places }, triangles)
                    }));
                }
            }
        }
    }

    fn project_terrain(&mut self, camera: &Camera, terrain: Option<&PlacedMesh>) {
        let vertices = terrain.map_or(&[][..], |mesh| &mesh.vertices);
        let project = |&[x, y, z, u, v]: &[f32; 5]| camera.project(camera.in_camera_m([x, y, z]), [u, v]);
        self.terrain.resize(vertices.len(), Vertex::UNPROJECTED);
        let tasks = self.terrain.par_chunks_mut(CORNERS_A_TASK).zip(vertices.par_chunks(CORNERS_A_TASK));
        tasks.for_each(|(corners, vertices)| {
            widest!(_vectors => corners.iter_mut().zip(vertices).for_each(|(corner, vertex)| *corner = project(vertex)));
        });
    }

    /// Sets up the triangles of all jobs and bins them into bands. `show` is called for each chunk as soon as
    /// its triangles are set up.
    fn collect(&mut self, context: &DrawContext<'_>, jobs: &[Vec<DrawPart>], show: impl Fn(&Chunk) + Sync) {
        let bands = (context.camera.size_px[1] as usize).div_ceil(BAND_ROWS);
        let mut chunks = std::mem::take(&mut self.chunks);
        if chunks.len() < jobs.len() {
            chunks.resize_with(jobs.len(), Chunk::default);
        }
        jobs.par_iter().zip(&mut *chunks).for_each(|(parts, chunk)| {
            chunk.clear();
            chunk.is_of_ground = matches!(parts.first(), Some(DrawPart::Terrain(_)));
            self.triangles_of(context, parts, chunk);
            show(chunk);
            chunk.bin(bands);
        });
        self.chunks = chunks;
    }

    fn triangles_of(&self, context: &DrawContext<'_>, parts: &[DrawPart], chunk: &mut Chunk) {
        let mut scratch = (Scratch::new(), Scratch::new());
        widest!(vectors => {
            for part in parts {
                self.triangles(vectors, context, part, &mut scratch, chunk);
            }
        })
    }

    #[inline(always)]
    fn triangles(
        &self,
        vectors: impl Vectors,
        context: &DrawContext<'_>,
        part: &DrawPart,
        scratch: &mut ScratchBuffers,
        chunk: &mut Chunk,
    ) {
        let DrawContext { camera, pose, view, in_view } = context;
        match part {
            DrawPart::Terrain(of) => {
                let kind = TriangleKind { material: GROUND, one_sided: false, sky: None };
                let indices = view.terrain.map_or(&[][..], |mesh| &mesh.indices[of.clone()]);
                for triangle in indices.chunks_exact(3) {
                    let corner = |k: usize| &self.terrain[triangle[k] as usize];
                    chunk.add(vectors, camera, [corner(0), corner(1), corner(2)], kind);
                }
            }
            DrawPart::Piece { batch, level, piece, places } => {
                let model = &self.models[*batch];
                let material = *batch + 1;
                let kind = TriangleKind {
                    material: material as u32,
                    one_sided: model.one_sided,
                    sky: self.materials[material].sky,
                };
                let piece = &model.levels[*level][*piece];
                for &place in &in_view[places.clone()] {
                    let stands = &view.batches.placed[place as usize];
                    match self.materials[material].has_extra {
                        true => piece.draw_more(
                            vectors,
                            camera,
                            pose,
                            stands,
                            model.light,
                            kind,
                            &mut scratch.1,
                            chunk,
                        ),
                        false => piece.draw(vectors, camera, pose, stands, kind, &mut scratch.0, chunk),
                    }
                }
            }
        }
    }

    /// Computes depth and colour of every pixel; with `is_overlay` only of pixels where something is nearer than
    /// before.
    fn fill<P: SamplePattern>(
        &mut self,
        places: P,
        camera: &Camera,
        plan: &FramePlan,
        chunks: usize,
        is_overlay: bool,
        into: &mut RasterFrame,
    ) {
        let (stride, taps) = (into.stride, plan.surface_reads);
        let pixel_step = camera.size_px[0] as f32 / plan.ideal.size_px[0] as f32;
        let shader = Shader {
            camera,
            chunks: &self.chunks[..chunks],
            materials: &self.materials,
            taps,
            pixel_step,
            is_overlay,
        };
        let of_band = stride * BAND_ROWS;
        let bands = into
            .depth
            .par_chunks_mut(of_band)
            .zip(into.color.par_chunks_mut(CHANNELS * of_band))
            .zip(self.visible.par_chunks_mut(of_band));
        bands.enumerate().for_each(|(band, ((depth, color), visible))| {
            if !is_overlay {
                depth.fill(0.0);
            }
            visible.fill(SKY);
            let band = Band { number: band, stride, depth, visible };
            widest!(vectors => fill_band(vectors, places, &shader, band, color))
        });
    }
}

#[inline(always)]
fn fill_band(
    vectors: impl Vectors,
    places: impl SamplePattern,
    shader: &Shader<'_>,
    mut band: Band<'_>,
    color: &mut [u16],
) {
    for (number, chunk) in (0..).zip(shader.chunks) {
        band.draw(vectors, places, chunk, number, |_| true);
    }
    let width = shader.camera.size_px[0] as usize;
    let rows = band.visible.chunks_exact(band.stride).zip(color.chunks_exact_mut(CHANNELS * band.stride));
    let mut planes = PixelPlanes::new();
    for (row, (visible, color)) in rows.enumerate() {
        let blocks = visible.as_chunks().0.iter().zip(color.chunks_exact_mut(CHANNELS * LANES));
        for (number, (visible, color)) in blocks.take(width.div_ceil(LANES)).enumerate() {
            shader.block(
                vectors,
                [number * LANES, band.number * BAND_ROWS + row],
                visible,
                &mut planes,
                color,
            );
        }
    }
}

/// Parts of the terrain, with their numbers of triangles.
fn terrain_parts(terrain: Option<&PlacedMesh>) -> Vec<(DrawPart, usize)> {
    let count = terrain.map_or(0, |mesh| mesh.indices.len());
    let step = 3 * TRIANGLES_A_CHUNK;
    (0..count)
        .step_by(step)
        .map(|first| first..(first + step).min(count))
        .map(|of| (DrawPart::Terrain(of.clone()), of.len() / 3))
        .collect()
}

/// Distributes parts to chunks in order: at most [`TRIANGLES_A_CHUNK`] triangles each, few chunks even for
/// many different meshes, and terrain apart from meshes.
fn jobs(parts: Vec<(DrawPart, usize)>) -> Vec<Vec<DrawPart>> {
    let mut jobs: Vec<Vec<DrawPart>> = Vec::new();
    let mut room = 0;
    for (part, triangles) in parts {
        let is_terrain = |part: &DrawPart| matches!(part, DrawPart::Terrain(_));
        let is_alike =
            |parts: &[DrawPart]| parts.first().is_some_and(|first| is_terrain(first) == is_terrain(&part));
        match jobs.last_mut().filter(|parts| triangles <= room && is_alike(parts)) {
            Some(parts) => parts.push(part),
            None => {
                jobs.push(vec![part]);
                room = TRIANGLES_A_CHUNK;
            }
        }
        room -= triangles.min(room);
    }
    jobs
}

fn material(batch: &Batch, texture: Arc<SurfaceTexture>) -> Material {
    let tint = |corner: usize| {
        batch
            .shape
            .vertices
            .get(corner)
            .map_or([1.0; 3], |vertex| [vertex.tint[0], vertex.tint[1], vertex.tint[2]])
    };
    let first = tint(0);
    let has_extra =
        batch.light.is_some() || (0..batch.shape.vertices.len()).any(|corner| tint(corner) != first);
    let sky = batch.light.map(|light| light.sky as f32);
    Material { texture, tint: first, emissive: batch.material.emissive, has_extra, sky }
}

/// Textures of the batches; those with the same image and wrap modes are shared.
#[derive(Default)]
struct TextureCache(HashMap<(*const Texture, [u8; 2]), Arc<SurfaceTexture>>);

impl TextureCache {
    fn of(&mut self, batch: &Batch) -> Arc<SurfaceTexture> {
        let look = &batch.material;
        let name = (Arc::as_ptr(&look.texture), look.wrap.map(|wrap| wrap as u8));
        self.0
            .entry(name)
            .or_insert_with(|| Arc::new(SurfaceTexture::new(&look.texture, look.wrap, None)))
            .clone()
    }
}
