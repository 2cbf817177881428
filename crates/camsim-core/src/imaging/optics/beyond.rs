//! Light where a picture has none: that of the nearest pixel.

use rayon::prelude::*;

use super::RGBA;

/// The nearest pixel with a ray, of each that has none.
#[derive(Debug)]
pub(super) struct Nearest {
    valid: Vec<bool>,
    /// Row-major pairs of a pixel without a ray and its nearest with one.
    pairs: Vec<[u32; 2]>,
}

impl Nearest {
    /// `valid` is row-major.
    pub fn new(valid: Vec<bool>, width: usize) -> Self {
        let in_columns = nearest_rows(&valid, width);
        let pairs = (0..valid.len() / width.max(1))
            .into_par_iter()
            .flat_map_iter(|y| {
                let row = y * width..(y + 1) * width;
                let (valid, rows) = (&valid[row.clone()], &in_columns[row]);
                let invalid = (0..width).filter(|&x| !valid[x]);
                let pair = |x: usize| {
                    nearest_in(rows, x, y)
                        .map(|[from_x, from_y]| [(y * width + x) as u32, (from_y * width + from_x) as u32])
                };
                invalid.filter_map(pair).collect::<Vec<_>>()
            })
            .collect();
        Self { valid, pairs }
    }

    pub fn valid(&self) -> &Vec<bool> {
        &self.valid
    }

    /// Gives pixels without a ray the colours of their nearest.
    pub fn fill(&self, color_rgba: &mut [f32]) {
        for &[to, from] in &self.pairs {
            let from = RGBA * from as usize;
            color_rgba.copy_within(from..from + 3, RGBA * to as usize);
        }
    }
}

/// The row of the nearest valid pixel in the column of each, if it has one.
fn nearest_rows(valid: &[bool], width: usize) -> Vec<Option<u32>> {
    let height = valid.len() / width.max(1);
    let mut rows = vec![None; valid.len()];
    for x in 0..width {
        for upwards in [false, true] {
            let mut last: Option<u32> = None;
            for step in 0..height {
                let y = if upwards { height - 1 - step } else { step };
                let i = y * width + x;
                if valid[i] {
                    last = Some(y as u32);
                }
                let distance = |row: Option<u32>| row.map_or(usize::MAX, |row| y.abs_diff(row as usize));
                if distance(last) < distance(rows[i]) {
                    rows[i] = last;
                }
            }
        }
    }
    rows
}

/// The nearest pixel, by the nearest row of each column.
fn nearest_in(rows: &[Option<u32>], x: usize, y: usize) -> Option<[usize; 2]> {
    let (mut best, mut least) = (None, usize::MAX);
    for away in 0..rows.len() {
        if away.saturating_mul(away) >= least {
            break;
        }
        let sides = [x.checked_sub(away), Some(x + away).filter(|&x| x < rows.len())];
        for at in sides.into_iter().flatten() {
            if let Some(row) = rows[at] {
                let square = away * away + y.abs_diff(row as usize).pow(2);
                if square < least {
                    (best, least) = (Some([at, row as usize]), square);
                }
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_without_a_ray_get_the_nearest_light() {
        let (width, height) = (23, 17);
        let is_valid = |i: usize| (i * 7919 + 13) % 31 < 3;
        let valid: Vec<bool> = (0..width * height).map(is_valid).collect();
        let light = |i: usize| i as f32;
        let mut rgba: Vec<f32> = (0..width * height)
            .flat_map(|i| if valid[i] { [light(i), 1.0, 2.0, 1.0] } else { [0.0; 4] })
            .collect();
        Nearest::new(valid.clone(), width).fill(&mut rgba);
        for (i, pixel) in rgba.chunks_exact(4).enumerate() {
            let square =
                |j: usize| (i % width).abs_diff(j % width).pow(2) + (i / width).abs_diff(j / width).pow(2);
            let least = (0..width * height).filter(|&j| valid[j]).map(square).min();
            assert_eq!(Some(square(pixel[0] as usize)), least, "{i}");
            assert_eq!((pixel[1], pixel[2], pixel[3] > 0.0), (1.0, 2.0, valid[i]), "{i}");
        }
        // Without any light, nothing happens.
        let mut dark = vec![0.0; 4 * 6];
        Nearest::new(vec![false; 6], 3).fill(&mut dark);
        assert_eq!(dark, [0.0; 24]);
    }
}
