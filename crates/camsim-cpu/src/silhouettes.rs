//! What silhouette rays read of an ideal frame, in single precision: its edge pixels with their samples and
//! borders, and the surface and colour at a position. Twin of `camsim-gpu/shaders/ideal/edge_mask.wgsl`,
//! `camsim-gpu/shaders/ideal/edge_lines.wgsl` and `camsim-gpu/shaders/reverse/edges/silhouette_rays.wgsl`.

mod edge_line;
mod edge_mask;
mod image;
mod march;

use half::f16;
use rayon::prelude::*;

use edge_line::{EdgeLine, Members, edge_line};
use edge_mask::EdgeMask;
pub(crate) use image::{Colors, IdealImage, KeyImage, SilhouetteImage};
pub(crate) use march::{RayPath, StraightRay, SurfaceHit};

/// Depths in memory: of pixels, or a pixel a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthPlane<'a> {
    pub values: &'a [f32],
    /// Values from one row to the next.
    pub stride: usize,
    /// Inverse depth, 1/m, of a value of 1.
    pub per_m: f32,
}

impl DepthPlane<'_> {
    /// A sample of a fine pixel, in the order of
    /// [`camsim_core::temporal::supersampled::SupersampledImage::samples`].
    #[inline]
    fn sample(&self, [x, y]: [i64; 2], sample: usize) -> f32 {
        self.values[(2 * y as usize + sample / 2) * self.stride + 2 * x as usize + sample % 2]
    }
}

/// The samples of an ideal frame's edge pixels, `4 scale^2` each.
#[derive(Clone, Debug)]
pub(crate) struct FineSamples {
    scale: u32,
    mask: EdgeMask,
    /// Fine pixels of each edge pixel, row by row.
    fine: Vec<FinePixel>,
    /// Linear colours of all samples of each fine pixel of the frame, row-major. Empty if the frame has colours at
    /// pixel centres only.
    colors: Vec<[[f16; 3]; 4]>,
    /// Indices of the samples of each of `fine`, if they have colours.
    samples: Vec<[[u32; 4]; 2]>,
}

/// The surfaces of a fine pixel.
#[derive(Clone, Copy, Debug, Default)]
struct FinePixel {
    /// Towards the nearer of two surfaces, and distance of their border from the centre, fine pixels; 0 where no
    /// border is known.
    normal: [f32; 2],
    offset_px: f32,
    /// Inverse depths, 1/m, behind and before the border, for positions in each quadrant.
    depths: [[f32; 4]; 2],
}

impl FinePixel {
    /// Side of the border and quadrant of a position, from the fine pixel's corner.
    fn place(&self, [x, y]: [f32; 2]) -> (usize, usize) {
        let distance = self.normal[0] * (x - 0.5) + self.normal[1] * (y - 0.5);
        (usize::from(distance > self.offset_px), usize::from(x >= 0.5) + 2 * usize::from(y >= 0.5))
    }
}

impl FineSamples {
    /// Finds edge pixels and the borders within them. `centres` has the depths of the pixel centres, `samples` those
    /// of their samples. `scale` and `thin` are those of [`camsim_plan::EdgeStage::Supersampled`]; `colors` are empty
    /// for a scale of 1.
    pub fn new(
        size_px: [u32; 2],
        centres: &DepthPlane<'_>,
        (scale, thin): (u32, bool),
        samples: &DepthPlane<'_>,
        colors: Vec<[[f16; 3]; 4]>,
    ) -> Self {
        let mask = EdgeMask::new(size_px, scale, centres, thin.then_some(samples));
        let (side, fine_px) = (i64::from(scale), size_px.map(|side| i64::from(side * scale)));
        let edges: Vec<[usize; 2]> = mask.pixels().collect();
        let in_pixel = (side * side) as usize;
        let fine = |members: &mut Members, number: usize| {
            let ([x, y], k) =
                (edges[number / in_pixel].map(|at| at as i64 * side), (number % in_pixel) as i64);
            fine_pixel(samples, [x + k % side, y + k / side], fine_px, members)
        };
        let all = (0..edges.len() * in_pixel).into_par_iter().map_init(Members::new, fine);
        let (fine, samples) = match colors.is_empty() {
            true => (all.map(|(fine, _)| fine).collect(), Vec::new()),
            false => all.unzip(),
        };
        Self { scale, mask, fine, colors, samples }
    }

    /// As `new`, from inverse depths (1/m) of pixels and of the four samples of each fine pixel, row-major.
    pub fn of_quads(
        size_px: [u32; 2],
        inverse_depth: &[f32],
        (scale, thin): (u32, bool),
        quads: &[[f32; 4]],
        colors: Vec<[[f16; 3]; 4]>,
    ) -> Self {
        let [width, stride] = [size_px[0] as usize, (2 * scale * size_px[0]) as usize];
        let mut values = vec![0.0; 4 * quads.len()];
        for (row, quads) in values.chunks_mut(2 * stride).zip(quads.chunks(stride / 2)) {
            for (x, [a, b, c, d]) in quads.iter().enumerate() {
                (row[2 * x], row[2 * x + 1], row[stride + 2 * x], row[stride + 2 * x + 1]) = (*a, *b, *c, *d);
            }
        }
        let centres = DepthPlane { values: inverse_depth, stride: width, per_m: 1.0 };
        Self::new(
            size_px,
            &centres,
            (scale, thin),
            &DepthPlane { values: &values, stride, per_m: 1.0 },
            colors,
        )
    }

    /// The edge pixels, row by row.
    pub fn edge_pixels(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.mask.pixels()
    }
}

/// The surfaces of a fine pixel, and the indices of the samples that show them.
fn fine_pixel(
    samples: &DepthPlane<'_>,
    texel: [i64; 2],
    size_px: [i64; 2],
    members: &mut Members,
) -> (FinePixel, [[u32; 4]; 2]) {
    let line = edge_line(samples, texel, size_px, members);
    let shown = [false, true].map(|nearer| {
        [0, 1, 2, 3].map(|quadrant| match &line {
            Some(line) => sample_of_side(samples, texel, quadrant, nearer, line, size_px),
            None => (texel, quadrant),
        })
    });
    let depths = shown.map(|side| side.map(|(at, sample)| samples.per_m * samples.sample(at, sample)));
    let index = |(at, sample): ([i64; 2], usize)| 4 * (at[1] * size_px[0] + at[0]) as u32 + sample as u32;
    let (normal, offset_px) = line.map_or(([0.0; 2], 0.0), |line| (line.normal.to_array(), line.offset_px));
    (FinePixel { normal, offset_px, depths }, shown.map(|side| side.map(index)))
}

/// Fine pixel and number of a sample on one side of the border through a fine pixel: the one in the quadrant, if
/// possible. As in [`camsim_core::temporal::supersampled`].
fn sample_of_side(
    samples: &DepthPlane<'_>,
    texel: [i64; 2],
    quadrant: usize,
    nearer: bool,
    line: &EdgeLine,
    size_px: [i64; 2],
) -> ([i64; 2], usize) {
    let of_side = |at: [i64; 2]| {
        let numbers = (0..4).map(|k| quadrant ^ k);
        numbers.map(|k| (at, k)).find(|&(at, k)| (samples.sample(at, k) > line.threshold) == nearer)
    };
    // The pixel has no sample on that side, because the border cuts off a corner only. The next pixel on that side
    // has one.
    let towards = if nearer { line.normal } else { -line.normal };
    let beside = |k: usize| (texel[k] + towards[k].round_ties_even() as i64).clamp(0, size_px[k] - 1);
    of_side(texel).or_else(|| of_side([beside(0), beside(1)])).unwrap_or((texel, quadrant))
}
