//! An ideal frame with samples: the surface and the colour at a position, and what is within reach of a ray.

use camsim_core::temporal::{ColorImage, IdealGeometry};
use glam::Vec3;
use half::f16;
use rayon::prelude::*;

use super::{FinePixel, FineSamples};
use crate::reverse::{EdgeTiles, TILE_PX};

/// Samples whose depths differ by less than this, relative to the nearest, belong to one surface.
const ONE_SURFACE: f32 = 0.02;
/// Least bilinear weight with which the pixels of one surface give its colour.
const MIN_WEIGHT: f32 = 1e-3;
/// Distance of positions along a line such that all of it is in the tiles around them.
const TILES_PX: f32 = 14.0;

/// Colours of an ideal frame, R G B A.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Colors<'a> {
    Floats(&'a [f32]),
    /// Half floats with so many pixels from one row to the next, which silhouette rays alone read.
    Halves(&'a [u16], usize),
}

/// An ideal frame.
#[derive(Clone, Debug)]
pub(crate) struct IdealImage {
    /// Size, focal length and principal point.
    pub geometry: IdealGeometry,
    /// Row-major R G B A: linear light, or encoded sRGB values for the paper preset. A is ignored.
    pub color_rgba: Vec<f32>,
    /// Inverse planar depth, 1/m, 0 = sky.
    pub inverse_depth: Vec<f32>,
    /// Samples for silhouette rays; `None` if the plan has no [`camsim_plan::EdgeStage::Supersampled`].
    pub fine: Option<FineSamples>,
}

/// An ideal frame in memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeyImage<'a> {
    pub geometry: &'a IdealGeometry,
    pub colors: Colors<'a>,
    /// Inverse depths of the pixels, 1/m, row-major.
    pub inverse_depth: &'a [f32],
    pub fine: Option<&'a FineSamples>,
}

/// What is in some tiles of an ideal frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reach {
    /// Largest inverse depth, 1/m.
    pub nearest: f32,
    pub has_edge: bool,
}

impl Reach {
    fn joined(self, other: Self) -> Self {
        Self { nearest: self.nearest.max(other.nearest), has_edge: self.has_edge || other.has_edge }
    }
}

/// An ideal frame that silhouette rays read.
#[derive(Debug)]
pub(crate) struct SilhouetteImage<'a> {
    image: KeyImage<'a>,
    samples: &'a FineSamples,
    pub focal_px: [f32; 2],
    pub principal_px: [f32; 2],
    /// Edge mask as an image, if the plain gather is to read it: R G B A are 1 at edge pixels.
    edge_rgba: Vec<f32>,
    tiles_across: usize,
    /// Of each tile what is there and in the tiles beside it.
    beside: Vec<Reach>,
    /// Of each tile what is within the parallax of the rays whose points at infinity are there.
    reaches: Vec<Reach>,
}

impl<'a> SilhouetteImage<'a> {
    /// `reach_px` is the largest parallax.
    pub fn new(image: KeyImage<'a>, samples: &'a FineSamples, reach_px: u32) -> Self {
        let size_px = image.geometry.size_px;
        let edge_rgba = match image.colors {
            Colors::Floats(_) => {
                let mut rgba = vec![0.0; 4 * image.inverse_depth.len()];
                for [x, y] in samples.edge_pixels() {
                    rgba[4 * (y * size_px[0] as usize + x)..][..4].fill(1.0);
                }
                rgba
            }
            Colors::Halves(..) => Vec::new(),
        };
        let tiles = tiles(size_px, image.inverse_depth, samples);
        let across = size_px[0].div_ceil(TILE_PX) as usize;
        let reaches = widened(&tiles, across, reach_px.div_ceil(TILE_PX) as usize);
        Self {
            image,
            samples,
            focal_px: image.geometry.focal_px.as_vec2().to_array(),
            principal_px: image.geometry.principal_px.as_vec2().to_array(),
            edge_rgba,
            tiles_across: across,
            beside: widened(&tiles, across, 1),
            reaches,
        }
    }

    pub fn geometry(&self) -> &'a IdealGeometry {
        self.image.geometry
    }

    /// Edge mask as an image: 1 at edge pixels, 0 elsewhere.
    pub fn edge_image(&self) -> ColorImage<'_> {
        ColorImage { size_px: self.image.geometry.size_px, rgba: &self.edge_rgba }
    }

    pub fn edge_tiles(&self) -> EdgeTiles {
        let has_edge = self.reaches.iter().map(|reach| reach.has_edge).collect();
        EdgeTiles { across: self.tiles_across as u32, has_edge }
    }

    /// Whether a position is within the frame.
    pub fn contains(&self, [x, y]: [f32; 2]) -> bool {
        let [width, height] = self.image.geometry.size_px.map(|side| side as f32);
        x >= -0.5 && y >= -0.5 && x <= width - 0.5 && y <= height - 0.5
    }

    /// What is within reach of a ray whose point at infinity projects here.
    pub fn reach(&self, far_px: [f32; 2]) -> Reach {
        self.reaches[self.tile(far_px)]
    }

    /// What is along a line, and up to two tiles beside it.
    pub fn reach_along(&self, a_px: [f32; 2], b_px: [f32; 2]) -> Reach {
        let [dx, dy] = [b_px[0] - a_px[0], b_px[1] - a_px[1]];
        let count = ((dx * dx + dy * dy).sqrt() / TILES_PX).ceil().clamp(1.0, 64.0);
        let at = |i: u32| {
            let t = i as f32 / count;
            self.beside[self.tile([a_px[0] + t * dx, a_px[1] + t * dy])]
        };
        (0..=count as u32).map(at).fold(Reach::default(), Reach::joined)
    }

    fn tile(&self, position_px: [f32; 2]) -> usize {
        let [x, y] = self.pixel(position_px).map(|px| px / TILE_PX as usize);
        y * self.tiles_across + x
    }

    /// The pixel of a position, or the nearest one.
    fn pixel(&self, position_px: [f32; 2]) -> [usize; 2] {
        let size_px = self.image.geometry.size_px;
        [0, 1].map(|k: usize| ((position_px[k] + 0.5).max(0.0) as usize).min(size_px[k] as usize - 1))
    }

    /// Whether a bilinear read touches an edge pixel.
    pub fn touches_edge(&self, position_px: [f32; 2]) -> bool {
        let ([x, y], [right, down], _) = self.cell(position_px);
        [[x, y], [right, y], [x, down], [right, down]]
            .into_iter()
            .any(|pixel| self.samples.mask.is_edge(pixel))
    }

    /// The four pixels around a position: columns and rows, and how far it is from the first.
    fn cell(&self, position_px: [f32; 2]) -> ([usize; 2], [usize; 2], [f32; 2]) {
        let axis = |k: usize| {
            let last = self.image.geometry.size_px[k] as usize - 1;
            let clamped = position_px[k].max(0.0).min(last as f32);
            let first = (clamped as usize).min(last.saturating_sub(1));
            (first, (first + 1).min(last), clamped - first as f32)
        };
        let ((x, right, tx), (y, down, ty)) = (axis(0), axis(1));
        ([x, y], [right, down], [tx, ty])
    }

    /// The fine pixel of a position in an edge pixel, by its number among them all, and the position from its corner.
    fn fine(&self, number: u32, pixel: [usize; 2], position_px: [f32; 2]) -> (usize, [f32; 2]) {
        let scale = self.samples.scale as f32;
        let within = |k: usize| (position_px[k] + 0.5 - pixel[k] as f32).clamp(0.0, 1.0) * scale;
        let last = self.samples.scale as usize - 1;
        let [x, y] = [within(0), within(1)];
        let [column, row] = [x, y].map(|at| (at as usize).min(last));
        let side = last + 1;
        (number as usize * side * side + row * side + column, [x - column as f32, y - row as f32])
    }

    /// Inverse depth (1/m) of the surface at a position: that of the sample in an edge pixel, bilinear between pixel
    /// centres elsewhere.
    pub fn inverse_depth(&self, position_px: [f32; 2]) -> f32 {
        let pixel = self.pixel(position_px);
        match self.samples.mask.number(pixel) {
            None => {
                let (first, last, t) = self.cell(position_px);
                interpolated(self.depths(first, last), t)
            }
            Some(number) => {
                let (fine, within) = self.fine(number, pixel, position_px);
                let fine: &FinePixel = &self.samples.fine[fine];
                let (side, quadrant) = fine.place(within);
                fine.depths[side][quadrant]
            }
        }
    }

    fn depths(&self, [x, y]: [usize; 2], [right, down]: [usize; 2]) -> [f32; 4] {
        let width = self.image.geometry.size_px[0] as usize;
        [[x, y], [right, y], [x, down], [right, down]].map(|[x, y]| self.image.inverse_depth[y * width + x])
    }

    fn centre_color(&self, [x, y]: [usize; 2]) -> Vec3 {
        match self.image.colors {
            Colors::Floats(rgba) => {
                Vec3::from_slice(&rgba[4 * (y * self.image.geometry.size_px[0] as usize + x)..])
            }
            Colors::Halves(rgba, stride) => {
                let first = 4 * (y * stride + x);
                Vec3::from_array([0, 1, 2].map(|k: usize| f16::from_bits(rgba[first + k]).to_f32()))
            }
        }
    }

    /// Linear R G B of the surface at a position: that of its sample, if samples have colours. Otherwise bilinear
    /// between the four pixels around; if those show two surfaces, between those on the position's side of their
    /// mean depth; if there are none, that of the pixel with the nearest depth among the sixteen around.
    pub fn color(&self, position_px: [f32; 2]) -> Vec3 {
        if !self.samples.colors.is_empty() {
            return self.sample_color(position_px);
        }
        let depth = self.inverse_depth(position_px);
        let (first, last, [tx, ty]) = self.cell(position_px);
        let depths = self.depths(first, last);
        let (low, high) =
            depths.iter().fold((f32::INFINITY, 0.0_f32), |(low, high), &w| (low.min(w), high.max(w)));
        let (between, is_one) = (0.5 * (low + high), low > (1.0 - ONE_SURFACE) * high);
        let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
        for (k, &w) in depths.iter().enumerate() {
            if is_one || (w > between) == (depth > between) {
                let (x, fx) = if k % 2 == 1 { (last[0], tx) } else { (first[0], 1.0 - tx) };
                let (y, fy) = if k / 2 == 1 { (last[1], ty) } else { (first[1], 1.0 - ty) };
                sum += fx * fy * self.centre_color([x, y]);
                weight += fx * fy;
            }
        }
        if weight > MIN_WEIGHT { sum / weight } else { self.nearest_color(first, depth) }
    }

    /// Colour of the pixel with the nearest depth among the sixteen around a cell.
    fn nearest_color(&self, [x, y]: [usize; 2], depth: f32) -> Vec3 {
        let [width, height] = self.image.geometry.size_px.map(|side| side as usize);
        let pixel = |k: usize| {
            let [x, y] = [(x + k % 4).saturating_sub(1), (y + k / 4).saturating_sub(1)];
            [x.min(width - 1), y.min(height - 1)]
        };
        let off = |&[x, y]: &[usize; 2]| (self.image.inverse_depth[y * width + x] - depth).abs();
        let nearest = (0..16).map(pixel).min_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.map_or(Vec3::ZERO, |pixel| self.centre_color(pixel))
    }

    fn sample_color(&self, position_px: [f32; 2]) -> Vec3 {
        let (samples, pixel) = (self.samples, self.pixel(position_px));
        let width = self.image.geometry.size_px[0] as usize;
        let side = samples.scale as usize;
        let sample = match samples.mask.number(pixel) {
            None => {
                let (fine, within) = self.fine(0, pixel, position_px);
                let [x, y] = [pixel[0] * side + fine % side, pixel[1] * side + fine / side];
                4 * (y * width * side + x) + FinePixel::default().place(within).1
            }
            Some(number) => {
                let (fine, within) = self.fine(number, pixel, position_px);
                let (of_side, quadrant) = samples.fine[fine].place(within);
                samples.samples[fine][of_side][quadrant] as usize
            }
        };
        Vec3::from_array(samples.colors[sample / 4][sample % 4].map(f16::to_f32))
    }
}

/// What is in each tile.
fn tiles([width, height]: [u32; 2], inverse_depth: &[f32], samples: &FineSamples) -> Vec<Reach> {
    let [across, down] = [width, height].map(|side| side.div_ceil(TILE_PX) as usize);
    let (width, side) = (width as usize, TILE_PX as usize);
    let tile = |i: usize| {
        let [left, top] = [i % across * side, i / across * side];
        let rows = top..(top + side).min(height as usize);
        rows.fold(Reach::default(), |tile, y| {
            let columns = side.min(width - left);
            let pixels = &inverse_depth[y * width + left..][..columns];
            let nearest = pixels.iter().copied().fold(0.0, f32::max);
            let has_edge = samples.mask.has_edge(left, columns, y);
            tile.joined(Reach { nearest, has_edge })
        })
    };
    (0..across * down).into_par_iter().map(tile).collect()
}

/// Of each tile what is there and so many tiles around. The maximum filter is separable: rows, then columns.
fn widened(tiles: &[Reach], across: usize, by: usize) -> Vec<Reach> {
    let mut tiles = tiles.to_vec();
    for (length, step) in [(across, 1), (tiles.len() / across, across)] {
        let joined = |tile: usize| {
            let position = tile / step % length;
            let last = position.saturating_add(by).min(length - 1);
            let tile_at = |at: usize| tiles[tile + at * step - position * step];
            (position.saturating_sub(by)..=last).map(tile_at).fold(Reach::default(), Reach::joined)
        };
        tiles = (0..tiles.len()).into_par_iter().map(joined).collect();
    }
    tiles
}

/// Inverse depth between four pixels, as [`camsim_core::temporal::interpolate_inverse_depth`].
fn interpolated([d00, d10, d01, d11]: [f32; 4], [tx, ty]: [f32; 2]) -> f32 {
    let (low, high) = (d00.min(d10).min(d01.min(d11)), d00.max(d10).max(d01.max(d11)));
    if low > 0.9 * high {
        let (top, bottom) = (d00 + tx * (d10 - d00), d01 + tx * (d11 - d01));
        return top + ty * (bottom - top);
    }
    let [left, right] = if ty > 0.5 { [d01, d11] } else { [d00, d10] };
    if tx > 0.5 { right } else { left }
}
