//! Colours of a mosaic's pixels, and the interpolation of those that a pixel does not measure.

use rayon::prelude::*;

use crate::{
    scenario::{Demosaic, Mosaic},
    scene::LUMINANCE,
};

/// Numbers of colours.
pub const RED: u8 = 0;
pub const GREEN: u8 = 1;
pub const BLUE: u8 = 2;
pub const WHITE: u8 = 3;

/// Columns beyond each end of a row that interpolation reads.
const MARGIN: usize = 2;
/// Side of the pattern `rgbw`, and reach of its interpolation.
const RGBW_SIDE: usize = 4;
const RGBW: [[u8; RGBW_SIDE]; RGBW_SIDE] = [
    [WHITE, BLUE, WHITE, GREEN],
    [BLUE, WHITE, GREEN, WHITE],
    [WHITE, GREEN, WHITE, RED],
    [GREEN, WHITE, RED, WHITE],
];

/// Colour that a pixel measures: 0, 1, 2 for red, green, blue, 3 for white.
#[must_use]
pub fn color_at(mosaic: Mosaic, [x, y]: [u32; 2]) -> u8 {
    let of_two_by_two = |colors: [u8; 4]| colors[(2 * (y & 1) + (x & 1)) as usize];
    match mosaic {
        Mosaic::None | Mosaic::Mono => WHITE,
        Mosaic::Rggb => of_two_by_two([RED, GREEN, GREEN, BLUE]),
        Mosaic::Bggr => of_two_by_two([BLUE, GREEN, GREEN, RED]),
        Mosaic::Grbg => of_two_by_two([GREEN, RED, BLUE, GREEN]),
        Mosaic::Gbrg => of_two_by_two([GREEN, BLUE, RED, GREEN]),
        Mosaic::Rgbw => RGBW[y as usize % RGBW_SIDE][x as usize % RGBW_SIDE],
    }
}

/// Values of a mosaic with a margin at the ends of each row.
#[derive(Debug)]
pub struct Mosaicked {
    mosaic: Mosaic,
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl Mosaicked {
    /// Values of pixels by column and row.
    pub fn new(mosaic: Mosaic, size_px: [u32; 2], value: impl Fn(usize, usize) -> f32 + Sync) -> Self {
        let [width, height] = size_px.map(|side| side as usize);
        let stride = width + 2 * MARGIN;
        let mut values = vec![0.0; stride * height];
        values.par_chunks_mut(stride).enumerate().for_each(|(y, row)| {
            for (x, to) in row[MARGIN..MARGIN + width].iter_mut().enumerate() {
                *to = value(x, y);
            }
            for i in (0..MARGIN).chain(MARGIN + width..stride) {
                row[i] = row[MARGIN + mirrored(i as i64 - MARGIN as i64, width)];
            }
        });
        Self { mosaic, width, height, values }
    }

    /// A row without its margins, mirrored beyond the first and last.
    fn row(&self, y: i64) -> &[f32] {
        let stride = self.width + 2 * MARGIN;
        &self.values[mirrored(y, self.height) * stride..][..stride]
    }

    /// Red, green and blue of the pixels of a row.
    pub fn colors(&self, y: usize, method: Demosaic, candidates: &mut Candidates, out: &mut [[f32; 3]]) {
        if self.mosaic == Mosaic::Rgbw {
            out.iter_mut().enumerate().for_each(|(x, out)| *out = self.rgbw_color(x, y));
            return;
        }
        candidates.fill(self, y, method);
        let own = &self.row(y as i64)[MARGIN..];
        let Candidates { cross, diagonal, beside, above } = candidates;
        for phase in 0..2 {
            let color = |x: usize, y: usize| color_at(self.mosaic, [x as u32, y as u32]);
            let columns = (phase..self.width).step_by(2);
            match (color(phase, y), color(phase + 1, y)) {
                (RED, _) => columns.for_each(|x| out[x] = [own[x], cross[x], diagonal[x]]),
                (BLUE, _) => columns.for_each(|x| out[x] = [diagonal[x], cross[x], own[x]]),
                (_, RED) => columns.for_each(|x| out[x] = [beside[x], own[x], above[x]]),
                _ => columns.for_each(|x| out[x] = [above[x], own[x], beside[x]]),
            }
        }
    }

    /// Colours by means of the nearest pixels that measure them, with the luminance of the white ones.
    fn rgbw_color(&self, x: usize, y: usize) -> [f32; 3] {
        const REACH: i64 = RGBW_SIDE as i64 - 1;
        let (mut sums, mut weights) = ([0.0_f32; 4], [0.0_f32; 4]);
        for dy in -REACH..=REACH {
            let (near_y, far) = (y as i64 + dy, RGBW_SIDE as i64 - dy.abs());
            if near_y < 0 || near_y >= self.height as i64 {
                continue;
            }
            let row = self.row(near_y);
            for dx in -REACH..=REACH {
                let near_x = x as i64 + dx;
                if near_x < 0 || near_x >= self.width as i64 {
                    continue;
                }
                let color = color_at(self.mosaic, [near_x as u32, near_y as u32]) as usize;
                // White pixels are every second one: their nearest suffice.
                let weight = match color as u8 {
                    WHITE => (2 - dx.abs()).max(0) * (2 - dy.abs()).max(0),
                    _ => (RGBW_SIDE as i64 - dx.abs()) * far,
                } as f32;
                sums[color] += weight * row[MARGIN + near_x as usize];
                weights[color] += weight;
            }
        }
        let mean = |color: u8| {
            let color = color as usize;
            if weights[color] > 0.0 { sums[color] / weights[color] } else { 0.0 }
        };
        let rgb = [RED, GREEN, BLUE].map(mean);
        let luminance: f32 = rgb.iter().zip(LUMINANCE).map(|(value, weight)| value * weight).sum();
        rgb.map(|value| value + mean(WHITE) - luminance)
    }
}

/// Position of a pixel or, beyond the ends, of its mirror image about the outermost pixel, which has the same colour
/// in a mosaic of two by two.
fn mirrored(index: i64, count: usize) -> usize {
    let last = count as i64 - 1;
    if last == 0 {
        return 0;
    }
    let folded = index.rem_euclid(2 * last);
    folded.min(2 * last - folded) as usize
}

/// Interpolated values of a row: those of the four neighbours in a cross, the four on diagonals, the two beside
/// and the two above and below.
#[derive(Debug)]
pub struct Candidates {
    cross: Vec<f32>,
    diagonal: Vec<f32>,
    beside: Vec<f32>,
    above: Vec<f32>,
}

impl Candidates {
    /// Memory for rows of a width.
    #[must_use]
    pub fn new(width: usize) -> Self {
        let row = || vec![0.0; width];
        Self { cross: row(), diagonal: row(), beside: row(), above: row() }
    }

    fn fill(&mut self, from: &Mosaicked, y: usize, method: Demosaic) {
        let rows = [-2, -1, 0, 1, 2].map(|dy| from.row(y as i64 + dy));
        match method {
            Demosaic::Bilinear => self.fill_by(rows, bilinear),
            Demosaic::Malvar => self.fill_by(rows, malvar),
        }
    }

    #[inline(always)]
    fn fill_by(&mut self, rows: [&[f32]; 5], estimate: impl Fn([[f32; 5]; 5]) -> [f32; 4]) {
        let width = self.cross.len();
        let [a, b, c, d, e] = rows.map(|row| &row[..width + 2 * MARGIN]);
        let Self { cross, diagonal, beside, above } = self;
        let (cross, diagonal) = (&mut cross[..width], &mut diagonal[..width]);
        let (beside, above) = (&mut beside[..width], &mut above[..width]);
        for x in 0..width {
            let near = |row: &[f32]| [row[x], row[x + 1], row[x + 2], row[x + 3], row[x + 4]];
            let found = estimate([near(a), near(b), near(c), near(d), near(e)]);
            [cross[x], diagonal[x], beside[x], above[x]] = found;
        }
    }
}

#[inline(always)]
fn bilinear(v: [[f32; 5]; 5]) -> [f32; 4] {
    [
        0.25 * (v[1][2] + v[3][2] + v[2][1] + v[2][3]),
        0.25 * (v[1][1] + v[1][3] + v[3][1] + v[3][3]),
        0.5 * (v[2][1] + v[2][3]),
        0.5 * (v[1][2] + v[3][2]),
    ]
}

/// The filters of Malvar, He and Cutler, "High-quality linear interpolation for demosaicing of Bayer-patterned
/// color images", ICASSP 2004, figure 2.
#[inline(always)]
fn malvar(v: [[f32; 5]; 5]) -> [f32; 4] {
    let own = v[2][2];
    let (vertical, horizontal) = (v[1][2] + v[3][2], v[2][1] + v[2][3]);
    let (far_vertical, far_horizontal) = (v[0][2] + v[4][2], v[2][0] + v[2][4]);
    let diagonal = v[1][1] + v[1][3] + v[3][1] + v[3][3];
    let far = far_vertical + far_horizontal;
    [
        0.125 * (4.0 * own + 2.0 * (vertical + horizontal) - far),
        0.125 * (6.0 * own + 2.0 * diagonal - 1.5 * far),
        0.125 * (5.0 * own + 4.0 * horizontal - far_horizontal - diagonal + 0.5 * far_vertical),
        0.125 * (5.0 * own + 4.0 * vertical - far_vertical - diagonal + 0.5 * far_horizontal),
    ]
}

#[cfg(test)]
mod golden;
#[cfg(test)]
mod tests;
