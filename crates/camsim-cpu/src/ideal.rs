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
    scene::{Batch, Light, LodTolerance, PlacedMesh, Scene, SceneBatches, Texture},
};
use camsim_plan::{EdgeStage, FramePlan, KeyFrame};
use rayon::prelude::*;

use crate::large_pages::LargeArray;
use crate::simd::{
    lanes::LANES,
    vectors::{Vectors, widest},
};
use camsim_plan::uniforms::{base_ned_m, ideal_camera};

mod layers;
mod meshes;
mod multisample;
mod prefilter;
mod raster_frame;
mod rasterise;
mod sampled_tiles;
mod shade;
#[cfg(test)]
mod tests;
mod texture;
mod triangles;
mod vertices;

use meshes::{Piece, Scratch, TRIANGLES_PER_CHUNK};
use multisample::{Multisample, SAMPLES_PER_SIDE};
pub(crate) use raster_frame::{RasterFrame, Silhouettes};
use rasterise::{Band, PixelCentres, SKY, SamplePattern};
use shade::{Material, PixelPlanes, Shader};
use texture::{Reading, SurfaceTexture};
use triangles::{BAND_ROWS, Chunk, ChunkKind, EXTRA_ATTRIBUTES, TriangleKind};
use vertices::{Camera, Vertex};

/// Terrain vertices per projection task.
const VERTICES_PER_TASK: usize = 4096;
/// Chunks per pass: a million triangles at most, which bounds their memory and their ids. Scenes with more
/// are drawn in several passes, each over the one before.
const CHUNKS_PER_PASS: usize = 256;
/// Index of the terrain's material.
const TERRAIN_MATERIAL: u32 = 0;
/// Half floats of a texel: R G B A.
const CHANNELS: usize = 4;

/// A scene in the form of the rasteriser.
#[derive(Debug)]
pub(crate) struct RasterScene {
    /// Materials: of the terrain, then of the mesh batches.
    materials: Vec<Material>,
    /// Meshes by batch.
    meshes: Vec<MeshModel>,
    chunks: Vec<Chunk>,
    terrain: Vec<Vertex<2>>,
    /// Visible triangle of each pixel.
    visible: LargeArray<u32>,
    /// State for frames with several samples per pixel.
    multisample: Multisample,
    /// Samples for silhouette rays, one a pixel.
    samples: RasterFrame,
}

/// Meshes of one shape and material.
#[derive(Debug)]
struct MeshModel {
    /// Pieces by level of detail, up to the coarsest that was drawn.
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
    Piece { batch: usize, level: usize, piece: usize, placements: Range<usize> },
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
        let mut textures = TextureCache::default();
        let ground = match &scene.terrain {
            Some(terrain) => SurfaceTexture::new(&terrain.texture, Reading::default(), terrain.beyond),
            None => SurfaceTexture::Uniform([0.0; 4]),
        };
        let mut materials = vec![Material {
            texture: Arc::new(ground),
            tint: [1.0; 4],
            emissive: [0.0; 3],
            blends: false,
            cutoff: None,
            has_extra_attributes: false,
            sky: None,
        }];
        materials.extend(batches.batches.iter().map(|batch| material(batch, textures.of_batch(batch))));
        let mesh_model = |batch: &Batch| MeshModel {
            levels: Vec::new(),
            one_sided: batch.material.one_sided,
            light: batch.light,
        };
        let meshes = batches.batches.iter().map(mesh_model).collect();
        Self {
            materials,
            meshes,
            chunks: Vec::new(),
            terrain: Vec::new(),
            visible: LargeArray::default(),
            multisample: Multisample::default(),
            samples: RasterFrame::default(),
        }
    }

    /// Draws the ideal frame of a plan's key frame.
    pub fn draw(&mut self, view: DrawInputs<'_>, key: &KeyFrame, into: &mut RasterFrame) {
        let ideal = &view.plan.ideal;
        let camera = Camera {
            uniforms: ideal_camera(view.plan, &key.pose, base_ned_m(&key.pose), view.scene),
            focal_px: ideal.focal_px.as_vec2().to_array(),
            principal_px: ideal.principal_px.as_vec2().to_array(),
            size_px: ideal.size_px,
            sample_offset: 0,
        };
        let (in_view, level_instances) = view.batches.in_view(&key.pose, view.tolerance);
        self.make_pieces(view.batches, &level_instances);
        let mut parts = terrain_parts(view.terrain);
        self.add_parts(&level_instances, &mut parts);
        parts.sort_by_key(|(part, _)| self.kind_of(part));
        let chunk_parts = self.chunk_parts(parts);
        let context = DrawContext { camera, pose: &key.pose, view, in_view: &in_view };
        match view.plan.samples_a_pixel {
            1 => self.draw_all(PixelCentres, &context, &chunk_parts, Some(1), into),
            _ => self.draw_samples(
                &DrawContext { camera: camera.sample_grid(1), ..context },
                &chunk_parts,
                into,
            ),
        }
        into.silhouettes = None;
        if let EdgeStage::Supersampled { scale, thin, .. } = view.plan.edges {
            let mut samples = std::mem::take(&mut self.samples);
            let grid = DrawContext { camera: camera.sample_grid(scale), ..context };
            let per_pixel = (scale > 1).then_some(SAMPLES_PER_SIDE as u32);
            self.draw_all(rasterise::SamplePositions, &grid, &chunk_parts, per_pixel, &mut samples);
            into.add_silhouettes(ideal.size_px, (scale, thin), &samples);
            self.samples = samples;
        }
    }

    /// Draws all chunks, in several passes if there are many. Textures are filtered over so many positions along
    /// a side; without, there are depths alone.
    fn draw_all<P: SamplePattern>(
        &mut self,
        placements: P,
        context: &DrawContext<'_>,
        chunk_parts: &[Vec<DrawPart>],
        shaded_px: Option<u32>,
        into: &mut RasterFrame,
    ) {
        let DrawContext { camera, view, .. } = context;
        into.fit_depth(camera.size_px);
        if shaded_px.is_some() {
            into.fit_color();
        }
        self.visible.fit(into.depth.len());
        self.project_terrain(camera, view.terrain);
        // Blended triangles are mixed in one pass, the last.
        let is_blended = |parts: &Vec<DrawPart>| self.kind_of_all(parts) == ChunkKind::Blended;
        let others = chunk_parts.partition_point(|parts| !is_blended(parts));
        let passes = others.div_ceil(CHUNKS_PER_PASS).max(1);
        for pass in 0..passes {
            let first = pass * CHUNKS_PER_PASS;
            let end = if pass + 1 == passes { chunk_parts.len() } else { first + CHUNKS_PER_PASS };
            let chunk_parts = &chunk_parts[first..end];
            self.collect(context, chunk_parts, |_| {});
            self.fill(placements, context, chunk_parts.len(), shaded_px, pass > 0, into);
        }
    }

    /// Draws a frame with several samples per pixel, as seen by the camera of the sample grid.
    fn draw_samples(
        &mut self,
        context: &DrawContext<'_>,
        chunk_parts: &[Vec<DrawPart>],
        into: &mut RasterFrame,
    ) {
        let DrawContext { camera, view, .. } = context;
        into.fit_depth(view.plan.ideal.size_px);
        into.fit_color();
        let has_layers = chunk_parts.last().is_some_and(|parts| self.kind_of_all(parts) >= ChunkKind::Masked);
        if has_layers || chunk_parts.len() > CHUNKS_PER_PASS {
            // Samples show several triangles, or the visible one of each would have to be kept between passes:
            // instead each sample is drawn and shaded as a pixel.
            let mut samples = RasterFrame::default();
            let per_pixel = Some(SAMPLES_PER_SIDE as u32);
            self.draw_all(rasterise::SamplePositions, context, chunk_parts, per_pixel, &mut samples);
            return multisample::resolve_samples(&samples, view.plan.ideal.size_px, into);
        }
        self.visible.fit(into.depth.len());
        self.project_terrain(camera, view.terrain);
        let mut multisample = std::mem::take(&mut self.multisample);
        multisample.clear(camera.size_px);
        self.collect(context, chunk_parts, |chunk| multisample.add_meshes(chunk));
        let chunks = &self.chunks[..chunk_parts.len()];
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

    /// Makes the pieces of levels of detail that are drawn for the first time.
    fn make_pieces(&mut self, batches: &SceneBatches, level_instances: &[Vec<Range<u32>>]) {
        let meshes = self.meshes.par_iter_mut().zip(&batches.batches).zip(level_instances);
        meshes.for_each(|((mesh_model, Batch { shape, levels, .. }), level_instances)| {
            let made = mesh_model.levels.len()..level_instances.len();
            mesh_model.levels.extend(made.map(|level| Piece::of_level(shape, levels.indices(level))));
        });
    }

    fn add_parts(&self, level_instances: &[Vec<Range<u32>>], parts: &mut Vec<(DrawPart, usize)>) {
        for (batch, (mesh_model, level_instances)) in self.meshes.iter().zip(level_instances).enumerate() {
            for (level, (pieces, placements)) in mesh_model.levels.iter().zip(level_instances).enumerate() {
                for (piece, triangles_of_piece) in pieces.iter().enumerate() {
                    let placements_per_part = (TRIANGLES_PER_CHUNK / triangles_of_piece.len().max(1)).max(1);
                    let (begin, end) = (placements.start as usize, placements.end as usize);
                    parts.extend((begin..end).step_by(placements_per_part).map(|first| {
                        let placements = first..(first + placements_per_part).min(end);
                        let triangles = triangles_of_piece.len() * placements.len();
                        (DrawPart::Piece { batch, level, piece, placements }, triangles)
                    }));
                }
            }
        }
    }

    fn kind_of(&self, part: &DrawPart) -> ChunkKind {
        let DrawPart::Piece { batch, .. } = part else { return ChunkKind::Terrain };
        match &self.materials[batch + 1] {
            Material { blends: true, .. } => ChunkKind::Blended,
            Material { cutoff: Some(_), .. } => ChunkKind::Masked,
            _ => ChunkKind::Opaque,
        }
    }

    /// The kind of all parts of a chunk, which is one.
    fn kind_of_all(&self, parts: &[DrawPart]) -> ChunkKind {
        parts.first().map_or(ChunkKind::default(), |part| self.kind_of(part))
    }

    /// Distributes parts to chunks in order: at most [`TRIANGLES_PER_CHUNK`] triangles of one kind each, and few
    /// chunks even for many different meshes.
    fn chunk_parts(&self, parts: Vec<(DrawPart, usize)>) -> Vec<Vec<DrawPart>> {
        let mut chunk_parts: Vec<Vec<DrawPart>> = Vec::new();
        let mut free_triangles = 0;
        for (part, triangles) in parts {
            let is_same_kind = |parts: &[DrawPart]| self.kind_of_all(parts) == self.kind_of(&part);
            match chunk_parts.last_mut().filter(|parts| triangles <= free_triangles && is_same_kind(parts)) {
                Some(parts) => parts.push(part),
                None => {
                    chunk_parts.push(vec![part]);
                    free_triangles = TRIANGLES_PER_CHUNK;
                }
            }
            free_triangles -= triangles.min(free_triangles);
        }
        chunk_parts
    }

    fn project_terrain(&mut self, camera: &Camera, terrain: Option<&PlacedMesh>) {
        let vertices = terrain.map_or(&[][..], |mesh| &mesh.vertices);
        let project = |&[x, y, z, u, v]: &[f32; 5]| camera.project(camera.in_camera_m([x, y, z]), [u, v]);
        self.terrain.resize(vertices.len(), Vertex::UNPROJECTED);
        let tasks =
            self.terrain.par_chunks_mut(VERTICES_PER_TASK).zip(vertices.par_chunks(VERTICES_PER_TASK));
        tasks.for_each(|(corners, vertices)| {
            widest!(_vectors => {
                corners.iter_mut().zip(vertices).for_each(|(projected, vertex)| *projected = project(vertex));
            });
        });
    }

    /// Sets up the triangles of all jobs and bins them into bands. `on_set_up` is called for each chunk as
    /// soon as its triangles are set up.
    fn collect(
        &mut self,
        context: &DrawContext<'_>,
        chunk_parts: &[Vec<DrawPart>],
        on_set_up: impl Fn(&Chunk) + Sync,
    ) {
        let bands = (context.camera.size_px[1] as usize).div_ceil(BAND_ROWS);
        let mut chunks = std::mem::take(&mut self.chunks);
        if chunks.len() < chunk_parts.len() {
            chunks.resize_with(chunk_parts.len(), Chunk::default);
        }
        chunk_parts.par_iter().zip(&mut *chunks).for_each(|(parts, chunk)| {
            chunk.clear();
            chunk.kind = self.kind_of_all(parts);
            self.triangles_of(context, parts, chunk);
            on_set_up(chunk);
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
            DrawPart::Terrain(triangles_of_piece) => {
                let kind = TriangleKind { material: TERRAIN_MATERIAL, one_sided: false, sky: None };
                let indices = view.terrain.map_or(&[][..], |mesh| &mesh.indices[triangles_of_piece.clone()]);
                for triangle in indices.chunks_exact(3) {
                    let vertex = |k: usize| &self.terrain[triangle[k] as usize];
                    chunk.add(vectors, camera, [vertex(0), vertex(1), vertex(2)], kind);
                }
            }
            DrawPart::Piece { batch, level, piece, placements } => {
                let mesh_model = &self.meshes[*batch];
                let material = *batch + 1;
                let kind = TriangleKind {
                    material: material as u32,
                    one_sided: mesh_model.one_sided,
                    sky: self.materials[material].sky,
                };
                let piece = &mesh_model.levels[*level][*piece];
                for &placement in &in_view[placements.clone()] {
                    let placed = &view.batches.placed[placement as usize];
                    match self.materials[material].has_extra_attributes {
                        true => piece.draw_with_extra(
                            vectors,
                            camera,
                            pose,
                            placed,
                            mesh_model.light,
                            kind,
                            &mut scratch.1,
                            chunk,
                        ),
                        false => piece.draw(vectors, camera, pose, placed, kind, &mut scratch.0, chunk),
                    }
                }
            }
        }
    }

    /// Computes depth and, if `shaded_px` says over how many positions, colour of every pixel; with `is_overlay`
    /// only of pixels where something is nearer than before.
    fn fill<P: SamplePattern>(
        &mut self,
        placements: P,
        DrawContext { camera, view, .. }: &DrawContext<'_>,
        chunks: usize,
        shaded_px: Option<u32>,
        is_overlay: bool,
        into: &mut RasterFrame,
    ) {
        let stride = into.stride;
        let shader = Shader {
            camera,
            chunks: &self.chunks[..chunks],
            materials: &self.materials,
            taps: view.plan.surface_reads,
            pixel_step: shaded_px.unwrap_or(1) as f32,
            is_overlay,
        };
        let band_len = stride * BAND_ROWS;
        let bands = into.depth.par_chunks_mut(band_len).zip(self.visible.par_chunks_mut(band_len));
        let fill = |number: usize, depth: &mut [f32], visible: &mut [u32], color: &mut [u16]| {
            if !is_overlay {
                depth.fill(0.0);
            }
            visible.fill(SKY);
            let mut band = Band { number, stride, depth, visible };
            fill_band(placements, &shader, &mut band, color);
            layers::draw(placements, &shader, &mut band, color);
        };
        match shaded_px {
            Some(_) => bands
                .zip(into.color.par_chunks_mut(CHANNELS * band_len))
                .enumerate()
                .for_each(|(number, ((depth, visible), color))| fill(number, depth, visible, color)),
            None => {
                bands.enumerate().for_each(|(number, (depth, visible))| fill(number, depth, visible, &mut []))
            }
        }
    }
}

/// Depths of a band, and colours as far as there is room for them, without layers.
fn fill_band(placements: impl SamplePattern, shader: &Shader<'_>, band: &mut Band<'_>, color: &mut [u16]) {
    widest!(vectors => fill_band_by(vectors, placements, shader, band, color))
}

#[inline(always)]
fn fill_band_by(
    vectors: impl Vectors,
    placements: impl SamplePattern,
    shader: &Shader<'_>,
    band: &mut Band<'_>,
    color: &mut [u16],
) {
    for (number, chunk) in (0..).zip(shader.chunks).filter(|(_, chunk)| chunk.kind < ChunkKind::Masked) {
        band.draw(vectors, placements, chunk, number, |_| true);
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
    let step = 3 * TRIANGLES_PER_CHUNK;
    (0..count)
        .step_by(step)
        .map(|first| first..(first + step).min(count))
        .map(|triangles_of_piece| {
            (DrawPart::Terrain(triangles_of_piece.clone()), triangles_of_piece.len() / 3)
        })
        .collect()
}

fn material(batch: &Batch, texture: Arc<SurfaceTexture>) -> Material {
    let tint = |vertex: usize| batch.shape.vertices.get(vertex).map_or([1.0; 4], |vertex| vertex.tint);
    let first = tint(0);
    let has_extra_attributes =
        batch.light.is_some() || (0..batch.shape.vertices.len()).any(|vertex| tint(vertex) != first);
    let sky = batch.light.map(|light| light.sky as f32);
    let camsim_core::scene::Material { emissive, blends, cutoff, .. } = batch.material;
    Material { texture, tint: first, emissive, blends, cutoff, has_extra_attributes, sky }
}

/// Textures of the batches; those with the same image that are read alike are shared.
#[derive(Default)]
struct TextureCache(HashMap<(*const Texture, Reading), Arc<SurfaceTexture>>);

impl TextureCache {
    fn of_batch(&mut self, batch: &Batch) -> Arc<SurfaceTexture> {
        let camsim_core::scene::Material { texture, wrap, nearest, blends, .. } = &batch.material;
        let reading = Reading { wrap: *wrap, nearest: *nearest, premultiplied: *blends };
        self.0
            .entry((Arc::as_ptr(texture), reading))
            .or_insert_with(|| Arc::new(SurfaceTexture::new(texture, reading, None)))
            .clone()
    }
}
