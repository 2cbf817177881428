//! Supersampled ideal frames: depth and colour at a position. f64 twin of
//! `camsim-gpu/shaders/reverse/edges/silhouette_rays.wgsl` (samples) and of
//! `camsim-gpu/shaders/reverse/edges/color/` (colours).

use glam::{DVec2, DVec3};

use super::edge_lines::{EdgeLine, edge_line};

/// Samples whose depths differ by less than this, relative to the nearest, belong to one surface.
const ONE_SURFACE: f64 = 0.02;
/// Least bilinear weight with which the pixels of one surface give its colour; a smaller weight is lost in
/// single precision far out in the frame.
const MIN_WEIGHT: f64 = 1e-3;

/// Depth and colour at the centre of an ideal pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelCentre {
    /// Inverse planar depth in the key camera, 1/m, 0 = sky.
    pub inverse_depth: f64,
    /// Linear R G B.
    pub color: DVec3,
}

/// A position relative to the four pixels around it: the first one, and the offset from it.
#[derive(Clone, Copy, Debug)]
struct BilinearCell {
    size_px: [u32; 2],
    base: DVec2,
    t: DVec2,
}

impl BilinearCell {
    /// The cell of a position; positions outside take the border.
    fn new(size_px: [u32; 2], position_px: DVec2) -> Self {
        let last = DVec2::new(f64::from(size_px[0]), f64::from(size_px[1])) - 1.0;
        let clamped = position_px.clamp(DVec2::ZERO, last);
        let base = clamped.floor().min((last - 1.0).max(DVec2::ZERO));
        Self { size_px, base, t: clamped - base }
    }

    /// Row-major index of the pixel that is so many steps right and down of the first one, clamped to the
    /// frame.
    fn pixel(&self, x: i32, y: i32) -> usize {
        let coordinate = |k: usize, step: i32| {
            (self.base[k] + f64::from(step)).clamp(0.0, f64::from(self.size_px[k]) - 1.0)
        };
        (coordinate(1, y) * f64::from(self.size_px[0]) + coordinate(0, x)) as usize
    }
}

/// An ideal frame with supersampled depth: `scale` x `scale` fine pixels in each ideal pixel, with four
/// samples each.
#[derive(Clone, Copy, Debug)]
pub struct SupersampledImage<'a> {
    /// Width and height in ideal pixels.
    pub size_px: [u32; 2],
    /// Fine pixels along a side of an ideal pixel.
    pub scale: u32,
    /// Inverse planar depth of the samples in the key camera, 1/m, 0 = sky. Fine pixels are row-major, with
    /// four samples each in the order of [`SupersampledImage::SAMPLE_POSITIONS`].
    pub samples: &'a [f64],
    /// Linear R G B of the samples. Empty if the frame has colours at pixel centres only.
    pub sample_colors: &'a [DVec3],
    /// Values at the centres of the ideal pixels, row-major.
    pub centres: &'a [PixelCentre],
    /// Edge mask of the ideal pixels, row-major: true where a pixel and its neighbours show more than one
    /// surface ([`super::edge_mask`]).
    pub edge_mask: &'a [bool],
    /// Borders within fine pixels, from [`SupersampledImage::edge_lines_of`]. Empty if they were not
    /// computed.
    pub edge_lines: &'a [Option<EdgeLine>],
}

impl SupersampledImage<'_> {
    /// Positions of the four samples, in fine pixels from the top-left corner of the fine pixel, one per
    /// quadrant: the standard pattern of 4x multisampling.
    pub const SAMPLE_POSITIONS: [DVec2; 4] = [
        DVec2::new(0.375, 0.125),
        DVec2::new(0.875, 0.375),
        DVec2::new(0.125, 0.625),
        DVec2::new(0.625, 0.875),
    ];

    /// Computes [`SupersampledImage::edge_lines`]: the border within each fine pixel.
    #[must_use]
    pub fn edge_lines_of(size_px: [u32; 2], scale: u32, samples: &[f64]) -> Vec<Option<EdgeLine>> {
        let [width, height] = size_px.map(|side| i64::from(side * scale));
        let depth = |[x, y]: [i64; 2], i: usize| samples[4 * (y * width + x) as usize + i];
        (0..width * height).map(|i| edge_line([i % width, i / width], [width, height], &depth)).collect()
    }

    /// [`Supersampled::inverse_depth`].
    #[must_use]
    pub fn inverse_depth(&self, position_px: DVec2) -> f64 {
        Supersampled::inverse_depth(self, position_px)
    }

    /// [`Supersampled::color`].
    #[must_use]
    pub fn color(&self, position_px: DVec2) -> DVec3 {
        Supersampled::color(self, position_px)
    }
}

impl Supersampled for SupersampledImage<'_> {
    fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    fn scale(&self) -> u32 {
        self.scale
    }

    fn centre(&self, pixel: usize) -> PixelCentre {
        self.centres[pixel]
    }

    fn is_edge(&self, pixel: usize) -> bool {
        self.edge_mask[pixel]
    }

    fn edge_line(&self, fine_pixel: usize) -> Option<EdgeLine> {
        self.edge_lines.get(fine_pixel).copied().flatten()
    }

    fn sample_depth(&self, sample: usize) -> f64 {
        self.samples[sample]
    }

    fn sample_color(&self, sample: usize) -> Option<DVec3> {
        self.sample_colors.get(sample).copied()
    }
}

/// An ideal frame with supersampled depth, whatever its storage.
pub trait Supersampled {
    /// Width and height in ideal pixels.
    fn size_px(&self) -> [u32; 2];

    /// Fine pixels along a side of an ideal pixel, with four samples each.
    fn scale(&self) -> u32;

    /// Values at the centre of an ideal pixel (row-major index).
    fn centre(&self, pixel: usize) -> PixelCentre;

    /// Edge mask of an ideal pixel: [`super::edge_mask`].
    fn is_edge(&self, pixel: usize) -> bool;

    /// Border within a fine pixel (row-major index).
    fn edge_line(&self, fine_pixel: usize) -> Option<EdgeLine>;

    /// Inverse planar depth of a sample in the key camera, 1/m, 0 = sky. Samples are numbered as in
    /// [`SupersampledImage::samples`].
    fn sample_depth(&self, sample: usize) -> f64;

    /// Linear R G B of a sample. `None` if the frame has colours at pixel centres only.
    fn sample_color(&self, sample: usize) -> Option<DVec3>;

    /// Inverse depth (1/m) of the surface at a position: that of the sample where the edge mask is set,
    /// bilinear between pixel centres elsewhere.
    #[must_use]
    fn inverse_depth(&self, position_px: DVec2) -> f64 {
        let size_px = self.size_px();
        let last = DVec2::new(f64::from(size_px[0]), f64::from(size_px[1])) - 1e-3;
        let pixel = (position_px + 0.5).clamp(DVec2::ZERO, last).floor();
        if self.is_edge(pixel.y as usize * size_px[0] as usize + pixel.x as usize) {
            return self.sample_depth(sample_index(self, position_px));
        }
        let cell = BilinearCell::new(self.size_px(), position_px);
        let [w00, w10, w01, w11] =
            [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| self.centre(cell.pixel(x, y)).inverse_depth);
        super::interpolate_inverse_depth([w00, w10, w01, w11], cell.t)
    }

    /// Linear R G B of the surface at a position. If samples have colours, the colour of the sample.
    /// Otherwise bilinear between the centres of the four surrounding pixels; if those show two surfaces,
    /// between those on the position's side of their mean depth; if there are none, the pixel with the
    /// nearest depth among the sixteen around.
    #[must_use]
    fn color(&self, position_px: DVec2) -> DVec3 {
        if let Some(color) = self.sample_color(sample_index(self, position_px)) {
            return color;
        }
        let depth = self.inverse_depth(position_px);
        let cell = BilinearCell::new(self.size_px(), position_px);
        let t = cell.t;
        let centre = |x, y| self.centre(cell.pixel(x, y));
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| (x, y, centre(x, y)));
        let (low, high) = four.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), (_, _, c)| {
            (low.min(c.inverse_depth), high.max(c.inverse_depth))
        });
        let between = 0.5 * (low + high);
        let one_surface = low > (1.0 - ONE_SURFACE) * high;
        let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
        for (x, y, c) in four {
            if one_surface || (c.inverse_depth > between) == (depth > between) {
                let fraction = if x == 1 { t.x } else { 1.0 - t.x } * if y == 1 { t.y } else { 1.0 - t.y };
                sum += fraction * c.color;
                weight += fraction;
            }
        }
        if weight > MIN_WEIGHT {
            return sum / weight;
        }
        let wider = (-1..3).flat_map(|y| (-1..3).map(move |x| (x, y))).map(|(x, y)| centre(x, y));
        let off = |c: &PixelCentre| (c.inverse_depth - depth).abs();
        wider.min_by(|a, b| off(a).total_cmp(&off(b))).map_or(DVec3::ZERO, |c| c.color)
    }
}

/// Index of the sample for a position: the one in its quadrant of the fine pixel. If a border of two
/// surfaces crosses the fine pixel, a sample on the position's side of that border. Positions outside
/// take the border of the frame.
fn sample_index<I: Supersampled + ?Sized>(image: &I, position_px: DVec2) -> usize {
    let ideal_px = image.size_px();
    let size_px = ideal_px.map(|side| i64::from(side * image.scale()));
    let last = DVec2::new(f64::from(ideal_px[0]), f64::from(ideal_px[1])) - 1e-3;
    let fine_px = (position_px + 0.5).clamp(DVec2::ZERO, last) * f64::from(image.scale());
    let corner = fine_px.floor();
    let half = (2.0 * (fine_px - corner)).floor();
    let quarter = half.x as usize + 2 * half.y as usize;
    let texel = [corner.x as i64, corner.y as i64];
    let index = |[x, y]: [i64; 2]| (y * size_px[0] + x) as usize;
    let own = 4 * index(texel) + quarter;
    let Some(line) = image.edge_line(index(texel)) else { return own };
    let nearer = line.normal.dot(fine_px - corner - 0.5) > line.offset_px;
    let of_side = |texel: [i64; 2]| {
        (0..4)
            .map(|k| 4 * index(texel) + (quarter ^ k))
            .find(|&sample| (image.sample_depth(sample) > line.threshold) == nearer)
    };
    // The pixel has no sample on that side, because the border cuts off a corner only. The next pixel on
    // that side has one.
    let towards = if nearer { line.normal } else { -line.normal };
    let beside = |k: usize| (texel[k] + towards[k].round_ties_even() as i64).clamp(0, size_px[k] - 1);
    of_side(texel).or_else(|| of_side([beside(0), beside(1)])).unwrap_or(own)
}
