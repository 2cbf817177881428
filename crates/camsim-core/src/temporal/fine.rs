//! An ideal frame with several samples a pixel, and what it shows at a place. f64 twin of
//! `shaders/reverse/edges/supersampled.wgsl` (samples) and of `shaders/reverse/edges/color/` (colours).

use glam::{DVec2, DVec3};

use super::lines::{EdgeLine, edge_line};

/// Depths this near to each other, relative to the nearest, are of one surface.
const ONE_SURFACE: f64 = 0.02;
/// Bilinear weight from which pixels of the same surface give its colour: less is lost in single precision,
/// far out in the frame.
const LEAST_WEIGHT: f64 = 1e-3;

/// What is at the middle of an ideal pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Centre {
    /// Inverse planar depth in the key camera, 1/m, 0 = sky.
    pub inverse_depth: f64,
    /// Linear R G B.
    pub color: DVec3,
}

/// The first of the four pixels around a position, and how far the position is from it.
#[derive(Clone, Copy, Debug)]
struct Around {
    base: DVec2,
    t: DVec2,
}

/// An ideal frame whose depth is supersampled: `scale` fine pixels along a side of an ideal pixel, four
/// samples each.
#[derive(Clone, Copy, Debug)]
pub struct FineImage<'a> {
    /// Ideal width, height.
    pub size_px: [u32; 2],
    /// Fine pixels along a side of an ideal pixel.
    pub scale: u32,
    /// Inverse planar depth in the key camera, 1/m, 0 = sky: row-major fine pixels, four samples each, in the
    /// order of [`FineImage::SAMPLE_PLACES`].
    pub samples: &'a [f64],
    /// Linear R G B of the samples; empty for frames whose colours are those of the pixels' middles alone.
    pub sample_colors: &'a [DVec3],
    /// Row-major ideal pixels.
    pub centres: &'a [Centre],
    /// Pixels that, with their neighbours, show more than one surface: [`super::marks`].
    pub marks: &'a [bool],
    /// Borders within fine pixels, as [`FineImage::lines_of`] finds them; empty for none.
    pub lines: &'a [Option<EdgeLine>],
}

impl FineImage<'_> {
    /// Standard places of the samples, fine pixels from the fine pixel's top-left corner: one in each
    /// quarter, in the order of quarters.
    pub const SAMPLE_PLACES: [DVec2; 4] = [
        DVec2::new(0.375, 0.125),
        DVec2::new(0.875, 0.375),
        DVec2::new(0.125, 0.625),
        DVec2::new(0.625, 0.875),
    ];

    /// The border within each fine pixel, for [`FineImage::lines`].
    #[must_use]
    pub fn lines_of(size_px: [u32; 2], scale: u32, samples: &[f64]) -> Vec<Option<EdgeLine>> {
        let [width, height] = size_px.map(|side| i64::from(side * scale));
        let depth = |[x, y]: [i64; 2], i: usize| samples[4 * (y * width + x) as usize + i];
        (0..width * height).map(|i| edge_line([i % width, i / width], [width, height], &depth)).collect()
    }

    /// Inverse depth (1/m) of the surface that is seen at a position: its sample's in a marked pixel,
    /// elsewhere, where one surface is around, bilinear between the pixels' middles.
    #[must_use]
    pub fn inverse_depth(&self, at_px: DVec2) -> f64 {
        let last = DVec2::new(f64::from(self.size_px[0]), f64::from(self.size_px[1])) - 1e-3;
        let pixel = (at_px + 0.5).clamp(DVec2::ZERO, last).floor();
        if self.marks[pixel.y as usize * self.size_px[0] as usize + pixel.x as usize] {
            return self.samples[self.sample(at_px)];
        }
        let around = self.around(at_px);
        let [w00, w10, w01, w11] =
            [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| self.centre(&around, x, y).inverse_depth);
        super::blend_inverse_depths([w00, w10, w01, w11], around.t)
    }

    /// The four pixels around a position; positions outside go to the border.
    fn around(&self, at_px: DVec2) -> Around {
        let last = DVec2::new(f64::from(self.size_px[0]), f64::from(self.size_px[1])) - 1.0;
        let at = at_px.clamp(DVec2::ZERO, last);
        let base = at.floor().min((last - 1.0).max(DVec2::ZERO));
        Around { base, t: at - base }
    }

    fn centre(&self, around: &Around, x: i32, y: i32) -> Centre {
        let at = |k: usize, step: i32| {
            (around.base[k] + f64::from(step)).clamp(0.0, f64::from(self.size_px[k]) - 1.0)
        };
        self.centres[(at(1, y) * f64::from(self.size_px[0]) + at(0, x)) as usize]
    }

    /// The sample that stands for a position: the one of its quarter of the fine pixel; where a border of two
    /// surfaces runs through the fine pixel, one of the surface on the position's side. Positions outside go
    /// to the border of the frame.
    fn sample(&self, at_px: DVec2) -> usize {
        let size_px = self.size_px.map(|side| i64::from(side * self.scale));
        let last = DVec2::new(f64::from(self.size_px[0]), f64::from(self.size_px[1])) - 1e-3;
        let at = (at_px + 0.5).clamp(DVec2::ZERO, last) * f64::from(self.scale);
        let corner = at.floor();
        let half = (2.0 * (at - corner)).floor();
        let quarter = half.x as usize + 2 * half.y as usize;
        let texel = [corner.x as i64, corner.y as i64];
        let index = |[x, y]: [i64; 2]| (y * size_px[0] + x) as usize;
        let own = 4 * index(texel) + quarter;
        let Some(line) = self.lines.get(index(texel)).copied().flatten() else { return own };
        let nearer = line.normal.dot(at - corner - 0.5) > line.offset_px;
        let of_side = |texel: [i64; 2]| {
            (0..4)
                .map(|k| 4 * index(texel) + (quarter ^ k))
                .find(|&sample| (self.samples[sample] > line.between) == nearer)
        };
        // None of the pixel's own: a corner of it that the border cuts off. The next pixel on that side has
        // some.
        let towards = if nearer { line.normal } else { -line.normal };
        let beside = |k: usize| (texel[k] + towards[k].round_ties_even() as i64).clamp(0, size_px[k] - 1);
        of_side(texel).or_else(|| of_side([beside(0), beside(1)])).unwrap_or(own)
    }

    /// Linear R G B at a position of the surface that is seen there: that of the sample; or, where samples
    /// have none, bilinear between those of the four pixels around it, or, where those show two surfaces, of
    /// those on the side of the mean of their depths that [`FineImage::inverse_depth`] is on; where that is
    /// none, the nearest in depth of the sixteen around it.
    #[must_use]
    pub fn color(&self, at_px: DVec2) -> DVec3 {
        if let Some(&color) = self.sample_colors.get(self.sample(at_px)) {
            return color;
        }
        let depth = self.inverse_depth(at_px);
        let around = self.around(at_px);
        let t = around.t;
        let centre = |x, y| self.centre(&around, x, y);
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| (x, y, centre(x, y)));
        let (low, high) = four.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), (_, _, c)| {
            (low.min(c.inverse_depth), high.max(c.inverse_depth))
        });
        let between = 0.5 * (low + high);
        let one_surface = low > (1.0 - ONE_SURFACE) * high;
        let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
        for (x, y, c) in four {
            if one_surface || (c.inverse_depth > between) == (depth > between) {
                let share = if x == 1 { t.x } else { 1.0 - t.x } * if y == 1 { t.y } else { 1.0 - t.y };
                sum += share * c.color;
                weight += share;
            }
        }
        if weight > LEAST_WEIGHT {
            return sum / weight;
        }
        let wider = (-1..3).flat_map(|y| (-1..3).map(move |x| (x, y))).map(|(x, y)| centre(x, y));
        let off = |c: &Centre| (c.inverse_depth - depth).abs();
        wider.min_by(|a, b| off(a).total_cmp(&off(b))).map_or(DVec3::ZERO, |c| c.color)
    }
}
