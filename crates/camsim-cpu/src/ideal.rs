//! The ideal frame on the host's own processors, for software adapters.
//!
//! Such an adapter's driver draws triangles as a GPU would: it shades blocks of 4x4 pixels for each triangle
//! that touches them, small triangles over and over, and one is a matter of a microsecond. Here triangles
//! only tell which of them a pixel shows, and how far it is; then each pixel's colour is worked out once,
//! from the planes of its own triangle, whose derivatives are exact. Corners stand on the devices' grid of
//! 1/256 px and borders belong to triangles by the same rule, so that nothing is covered twice or not at all.
//!
//! Where triangles go: corners ([`corners`]) -> triangles and the bands of rows that they may be in
//! ([`triangles`]) -> what pixels show ([`cover`]) -> colours ([`shade`], [`reads`]).

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

mod corners;
mod cover;
mod marks;
mod models;
mod picture;
mod reads;
mod samples;
mod shade;
#[cfg(test)]
mod tests;
mod triangles;

use corners::{Camera, Corner};
use cover::{BEYOND, Band, Pixels, Places, SKY};
use models::{Bench, Piece, TRIANGLES_A_CHUNK};
use picture::Picture;
use samples::{ALONG, Sampled};
use shade::{Paint, Planes, Shader};
use triangles::{BAND_ROWS, Chunk, Kind, MORE};

/// Corners of the terrain that a task projects.
const CORNERS_A_TASK: usize = 4096;
/// Chunks that are drawn at once: a million triangles at most, which bounds the memory that they take, and
/// their numbers. What has more is drawn in turns, each over the one before.
const CHUNKS_A_ROUND: usize = 256;
/// What is on the ground.
const GROUND: u32 = 0;
/// Half floats of a texel.
const CHANNELS: usize = 4;

/// An ideal frame in memory.
#[derive(Debug, Default)]
pub struct DrawnFrame {
    /// Linear R G B A, half floats.
    pub(crate) color: Large<u16>,
    /// near / z; 0 is infinitely far.
    pub(crate) depth: Large<f32>,
    /// Texels from one row to the next, of both.
    pub(crate) stride: usize,
}

impl DrawnFrame {
    /// Has so many pixels from now on.
    fn fit(&mut self, size_px: [u32; 2]) {
        let [width, height] = size_px.map(|side| side as usize);
        self.stride = (width + BEYOND).next_multiple_of(LANES);
        self.depth.fit(self.stride * height);
        self.color.fit(CHANNELS * self.stride * height);
    }

    /// From linear R G B A and inverse depths in single precision.
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
            depth.iter_mut().zip(inverse_depth).for_each(|(depth, &inverse)| *depth = inverse * near_m);
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

/// A scene as the rasteriser holds it.
#[derive(Debug)]
pub(crate) struct RasterScene {
    /// Of the ground, then those of batches.
    paints: Vec<Paint>,
    /// By batch.
    models: Vec<Model>,
    chunks: Vec<Chunk>,
    terrain: Vec<Corner<2>>,
    /// Which triangle each pixel shows.
    shown: Large<u32>,
    /// What frames of several samples a pixel need.
    sampled: Sampled,
}

/// Meshes of one shape and material.
#[derive(Debug)]
struct Model {
    /// By level of detail.
    levels: Vec<Vec<Piece>>,
    one_sided: bool,
    light: Option<Light>,
}

/// Triangles that follow each other in a chunk.
#[derive(Debug)]
enum Part {
    /// These indices of the terrain.
    Terrain(Range<usize>),
    /// A piece of a batch's level, at these of the places in view.
    Piece { batch: usize, level: usize, piece: usize, places: Range<usize> },
}

/// What models are drawn with, without tints of their corners and with them.
type Benches = (Bench<2>, Bench<{ 2 + MORE }>);

/// What an ideal frame is drawn from.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub plan: &'a FramePlan,
    pub scene: &'a Scene,
    pub batches: &'a SceneBatches,
    /// Triangles of the terrain, if there is any.
    pub terrain: Option<&'a PlacedMesh>,
    pub tolerance: &'a LodTolerance,
}

/// A view, as what is drawn of it is seen.
#[derive(Clone, Copy)]
struct Drawing<'a> {
    camera: Camera,
    pose: &'a CameraPose,
    view: View<'a>,
    /// Places of meshes that may be in view.
    seen: &'a [u32],
}

impl RasterScene {
    /// For a scene that it [draws](camsim_plan::placement::cpu_rasterises).
    #[must_use]
    pub fn new(scene: &Scene, batches: &SceneBatches) -> Self {
        let mut pictures = Pictures::default();
        let ground = match &scene.terrain {
            Some(terrain) => Picture::new(&terrain.texture, [Wrap::Clamp; 2], terrain.beyond),
            None => Picture::Uniform([0.0; 4]),
        };
        let mut paints = vec![Paint {
            picture: Arc::new(ground),
            tint: [1.0; 3],
            emissive: [0.0; 3],
            has_more: false,
            sky: None,
        }];
        paints.extend(batches.batches.iter().map(|batch| paint(batch, pictures.of(batch))));
        let model = |batch: &Batch| Model {
            levels: Piece::of_levels(&batch.shape, &batch.levels),
            one_sided: batch.material.one_sided,
            light: batch.light,
        };
        let models = batches.batches.iter().map(model).collect();
        Self {
            paints,
            models,
            chunks: Vec::new(),
            terrain: Vec::new(),
            shown: Large::default(),
            sampled: Sampled::default(),
        }
    }

    /// Draws the one ideal frame of a plan.
    pub fn draw(&mut self, view: View<'_>, into: &mut DrawnFrame) {
        let Some(key) = view.plan.keys.first() else { return };
        let ideal = &view.plan.ideal;
        let camera = Camera {
            uniforms: ideal_camera(view.plan, &key.pose, base_ned_m(&key.pose), view.scene),
            focal_px: ideal.focal_px.as_vec2().to_array(),
            principal_px: ideal.principal_px.as_vec2().to_array(),
            size_px: ideal.size_px,
            beside: 0,
        };
        let (seen, drawn) = view.batches.in_view(&key.pose, view.tolerance);
        let mut parts = terrain_parts(view.terrain);
        self.add_parts(&drawn, &mut parts);
        let jobs = jobs(parts);
        let drawing = Drawing { camera, pose: &key.pose, view, seen: &seen };
        match view.plan.samples_a_pixel {
            1 => self.draw_all(Pixels, &drawing, &jobs, into),
            _ => self.draw_samples(&Drawing { camera: camera.of_samples(), ..drawing }, &jobs, into),
        }
    }

    /// Draws so many chunks at once, each number of them over what is there.
    fn draw_all<P: Places>(
        &mut self,
        places: P,
        drawing: &Drawing<'_>,
        jobs: &[Vec<Part>],
        into: &mut DrawnFrame,
    ) {
        let Drawing { camera, view, .. } = drawing;
        into.fit(camera.size_px);
        self.shown.fit(into.depth.len());
        self.project_terrain(camera, view.terrain);
        for round in 0..jobs.len().div_ceil(CHUNKS_A_ROUND).max(1) {
            let first = round * CHUNKS_A_ROUND;
            let jobs = &jobs[first..jobs.len().min(first + CHUNKS_A_ROUND)];
            self.collect(drawing, jobs, |_| {});
            self.fill(places, camera, view.plan, jobs.len(), round > 0, into);
        }
    }

    /// The same of several samples a pixel, as their camera sees them.
    fn draw_samples(&mut self, drawing: &Drawing<'_>, jobs: &[Vec<Part>], into: &mut DrawnFrame) {
        let Drawing { camera, view, .. } = drawing;
        into.fit(view.plan.ideal.size_px);
        if jobs.len() > CHUNKS_A_ROUND {
            // What samples show would have to be kept from one round to the next: each is drawn as a pixel.
            let mut samples = DrawnFrame::default();
            self.draw_all(cover::Samples, drawing, jobs, &mut samples);
            return samples::mix(&samples, view.plan.ideal.size_px, into);
        }
        self.shown.fit(into.depth.len());
        self.project_terrain(camera, view.terrain);
        let mut sampled = std::mem::take(&mut self.sampled);
        sampled.clear(camera.size_px);
        self.collect(drawing, jobs, |chunk| sampled.mark(chunk));
        let chunks = &self.chunks[..jobs.len()];
        let shader = Shader {
            camera,
            chunks,
            paints: &self.paints,
            reads: view.plan.surface_reads,
            a_pixel: ALONG as f32,
            is_over: false,
        };
        sampled.fill(&shader, &mut self.shown, into);
        self.sampled = sampled;
    }

    fn add_parts(&self, drawn: &[Vec<Range<u32>>], parts: &mut Vec<(Part, usize)>) {
        for (batch, (model, drawn)) in self.models.iter().zip(drawn).enumerate() {
            for (level, (pieces, places)) in model.levels.iter().zip(drawn).enumerate() {
                for (piece, of) in pieces.iter().enumerate() {
                    let together = (TRIANGLES_A_CHUNK / of.len().max(1)).max(1);
                    let (begin, end) = (places.start as usize, places.end as usize);
                    parts.extend((begin..end).step_by(together).map(|first| {
                        let places = first..(first + together).min(end);
                        let triangles = of.len() * places.len();
                        (Part::Piece { batch, level, piece, places }, triangles)
                    }));
                }
            }
        }
    }

    fn project_terrain(&mut self, camera: &Camera, terrain: Option<&PlacedMesh>) {
        let vertices = terrain.map_or(&[][..], |mesh| &mesh.vertices);
        let project = |&[x, y, z, u, v]: &[f32; 5]| camera.corner(camera.in_camera_m([x, y, z]), [u, v]);
        self.terrain.resize(vertices.len(), Corner::NOWHERE);
        let tasks = self.terrain.par_chunks_mut(CORNERS_A_TASK).zip(vertices.par_chunks(CORNERS_A_TASK));
        tasks.for_each(|(corners, vertices)| {
            widest!(_vectors => corners.iter_mut().zip(vertices).for_each(|(corner, vertex)| *corner = project(vertex)));
        });
    }

    /// Triangles of all jobs, and which bands they are in; each chunk of them is shown as soon as they are
    /// there.
    fn collect(&mut self, drawing: &Drawing<'_>, jobs: &[Vec<Part>], show: impl Fn(&Chunk) + Sync) {
        let bands = (drawing.camera.size_px[1] as usize).div_ceil(BAND_ROWS);
        let mut chunks = std::mem::take(&mut self.chunks);
        if chunks.len() < jobs.len() {
            chunks.resize_with(jobs.len(), Chunk::default);
        }
        jobs.par_iter().zip(&mut *chunks).for_each(|(job, chunk)| {
            chunk.clear();
            chunk.is_of_ground = matches!(job.first(), Some(Part::Terrain(_)));
            self.triangles_of(drawing, job, chunk);
            show(chunk);
            chunk.sort(bands);
        });
        self.chunks = chunks;
    }

    fn triangles_of(&self, drawing: &Drawing<'_>, job: &[Part], chunk: &mut Chunk) {
        let mut benches = (Bench::new(), Bench::new());
        widest!(vectors => {
            for part in job {
                self.triangles(vectors, drawing, part, &mut benches, chunk);
            }
        })
    }

    #[inline(always)]
    fn triangles(
        &self,
        vectors: impl Vectors,
        drawing: &Drawing<'_>,
        part: &Part,
        benches: &mut Benches,
        chunk: &mut Chunk,
    ) {
        let Drawing { camera, pose, view, seen } = drawing;
        match part {
            Part::Terrain(of) => {
                let kind = Kind { paint: GROUND, one_sided: false, sky: None };
                let indices = view.terrain.map_or(&[][..], |mesh| &mesh.indices[of.clone()]);
                for triangle in indices.chunks_exact(3) {
                    let corner = |k: usize| &self.terrain[triangle[k] as usize];
                    chunk.add(vectors, camera, [corner(0), corner(1), corner(2)], kind);
                }
            }
            Part::Piece { batch, level, piece, places } => {
                let model = &self.models[*batch];
                let paint = *batch + 1;
                let kind =
                    Kind { paint: paint as u32, one_sided: model.one_sided, sky: self.paints[paint].sky };
                let piece = &model.levels[*level][*piece];
                for &place in &seen[places.clone()] {
                    let stands = &view.batches.placed[place as usize];
                    match self.paints[paint].has_more {
                        true => piece.draw_more(
                            vectors,
                            camera,
                            pose,
                            stands,
                            model.light,
                            kind,
                            &mut benches.1,
                            chunk,
                        ),
                        false => piece.draw(vectors, camera, pose, stands, kind, &mut benches.0, chunk),
                    }
                }
            }
        }
    }

    /// Depth and colour of every pixel; with `is_over` of those that show something nearer than what is
    /// there.
    fn fill<P: Places>(
        &mut self,
        places: P,
        camera: &Camera,
        plan: &FramePlan,
        chunks: usize,
        is_over: bool,
        into: &mut DrawnFrame,
    ) {
        let (stride, reads) = (into.stride, plan.surface_reads);
        let a_pixel = camera.size_px[0] as f32 / plan.ideal.size_px[0] as f32;
        let shader =
            Shader { camera, chunks: &self.chunks[..chunks], paints: &self.paints, reads, a_pixel, is_over };
        let of_band = stride * BAND_ROWS;
        let bands = into
            .depth
            .par_chunks_mut(of_band)
            .zip(into.color.par_chunks_mut(CHANNELS * of_band))
            .zip(self.shown.par_chunks_mut(of_band));
        bands.enumerate().for_each(|(band, ((depth, color), shown))| {
            if !is_over {
                depth.fill(0.0);
            }
            shown.fill(SKY);
            let band = Band { number: band, stride, depth, shown };
            widest!(vectors => fill_band(vectors, places, &shader, band, color))
        });
    }
}

#[inline(always)]
fn fill_band(
    vectors: impl Vectors,
    places: impl Places,
    shader: &Shader<'_>,
    mut band: Band<'_>,
    color: &mut [u16],
) {
    for (number, chunk) in (0..).zip(shader.chunks) {
        band.draw(vectors, places, chunk, number, |_| true);
    }
    let width = shader.camera.size_px[0] as usize;
    let rows = band.shown.chunks_exact(band.stride).zip(color.chunks_exact_mut(CHANNELS * band.stride));
    let mut planes = Planes::new();
    for (row, (shown, color)) in rows.enumerate() {
        let blocks = shown.as_chunks().0.iter().zip(color.chunks_exact_mut(CHANNELS * LANES));
        for (number, (shown, color)) in blocks.take(width.div_ceil(LANES)).enumerate() {
            shader.block(vectors, [number * LANES, band.number * BAND_ROWS + row], shown, &mut planes, color);
        }
    }
}

/// With their numbers of triangles.
fn terrain_parts(terrain: Option<&PlacedMesh>) -> Vec<(Part, usize)> {
    let count = terrain.map_or(0, |mesh| mesh.indices.len());
    let step = 3 * TRIANGLES_A_CHUNK;
    (0..count)
        .step_by(step)
        .map(|first| first..(first + step).min(count))
        .map(|of| (Part::Terrain(of.clone()), of.len() / 3))
        .collect()
}

/// Parts of chunks, in their order: [`TRIANGLES_A_CHUNK`] together at most, and few chunks however many
/// different models there are; of the terrain or of models.
fn jobs(parts: Vec<(Part, usize)>) -> Vec<Vec<Part>> {
    let mut jobs: Vec<Vec<Part>> = Vec::new();
    let mut room = 0;
    for (part, triangles) in parts {
        let is_terrain = |part: &Part| matches!(part, Part::Terrain(_));
        let is_alike = |job: &[Part]| job.first().is_some_and(|first| is_terrain(first) == is_terrain(&part));
        match jobs.last_mut().filter(|job| triangles <= room && is_alike(job)) {
            Some(job) => job.push(part),
            None => {
                jobs.push(vec![part]);
                room = TRIANGLES_A_CHUNK;
            }
        }
        room -= triangles.min(room);
    }
    jobs
}

fn paint(batch: &Batch, picture: Arc<Picture>) -> Paint {
    let tint = |corner: usize| {
        batch
            .shape
            .vertices
            .get(corner)
            .map_or([1.0; 3], |vertex| [vertex.tint[0], vertex.tint[1], vertex.tint[2]])
    };
    let first = tint(0);
    let has_more =
        batch.light.is_some() || (0..batch.shape.vertices.len()).any(|corner| tint(corner) != first);
    let sky = batch.light.map(|light| light.sky as f32);
    Paint { picture, tint: first, emissive: batch.material.emissive, has_more, sky }
}

/// Pictures that several batches share, each once.
#[derive(Default)]
struct Pictures(HashMap<(*const Texture, [u8; 2]), Arc<Picture>>);

impl Pictures {
    fn of(&mut self, batch: &Batch) -> Arc<Picture> {
        let look = &batch.material;
        let name = (Arc::as_ptr(&look.texture), look.wrap.map(|wrap| wrap as u8));
        self.0.entry(name).or_insert_with(|| Arc::new(Picture::new(&look.texture, look.wrap, None))).clone()
    }
}
