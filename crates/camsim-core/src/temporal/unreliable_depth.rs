//! Pixels of an output frame whose depth, looked up in an ideal frame, is unreliable: it may belong to no
//! surface or to the wrong one.
//!
//! On a plane inverse depth is affine in the image, so its second difference along a line of pixels is zero;
//! on a smooth surface it is small. A look-up between texels of an ideal frame errs only across a crease or
//! an edge, by at most a quarter of the second difference there: the error of linear interpolation at a kink,
//! which is largest midway between two texels. A region that shows the wrong surface altogether ends at an
//! edge, either of the looked-up depth or of the true one. Each pixel that a ray corrects therefore makes its
//! neighbours unreliable, too, starting from the border of such a region.

use rayon::prelude::*;

/// Second difference of inverse depth, relative to the largest of the three, from which a depth is checked by
/// a ray. Unchecked depths err by at most a quarter of it.
const BEND: f32 = 4e-4;
/// Relative change of inverse depth over the distance by which drawn surfaces may be displaced, from which a
/// depth is checked by a ray.
const STEEP: f32 = 5e-4;
/// Relative change of inverse depth by a ray from which the neighbours of the pixel are checked too.
const CHANGE: f32 = 5e-4;

/// Inverse depths of the pixels of a frame (1/m, 0 = nothing), row-major, with the mask of pixels that have a
/// ray.
#[derive(Clone, Copy, Debug)]
pub struct DepthGrid<'a> {
    /// Pixels per row.
    pub width: usize,
    /// Distance to the next row of the same field: 2 for interlaced frames, else 1.
    pub row_step: usize,
    /// Inverse planar depths, 1/m.
    pub inverse_depth: &'a [f32],
    /// Whether the pixel has a ray.
    pub valid: &'a [bool],
    /// How far surfaces may be drawn from where they are, pixels: the terrain's level of detail.
    pub displacement_px: f32,
}

/// Whether inverse depth bends between three pixels in a line by more than a smooth surface does. Sky beside
/// a surface counts as a bend.
#[must_use]
pub fn bends(before: f32, here: f32, after: f32) -> bool {
    (before - 2.0 * here + after).abs() > BEND * before.max(here).max(after)
}

/// Whether a ray hit a surface other than the one looked up.
#[must_use]
pub fn changed(looked_up: f32, by_ray: f32) -> bool {
    (looked_up - by_ray).abs() > CHANGE * looked_up.max(by_ray)
}

impl DepthGrid<'_> {
    /// Pixels at which inverse depth bends, and their neighbours, and pixels at which it is so steep that a
    /// displacement of the surface changes it; row-major.
    #[must_use]
    pub fn unreliable_pixels(&self) -> Vec<bool> {
        let mut bent = vec![false; self.inverse_depth.len()];
        bent.par_chunks_mut(self.width).enumerate().for_each(|(y, row)| self.bends_of_row(y, row));
        let mut unreliable = vec![false; bent.len()];
        unreliable.par_chunks_mut(self.width).enumerate().for_each(|(y, row)| {
            for above in self.rows_around(y) {
                let bent = &bent[above * self.width..][..self.width];
                for x in 0..self.width {
                    row[x] |= bent[x] | bent[x.saturating_sub(1)] | bent[(x + 1).min(self.width - 1)];
                }
            }
            self.steep_of_row(y, row);
        });
        unreliable.iter_mut().zip(self.valid).for_each(|(suspect, valid)| *suspect &= valid);
        unreliable
    }

    /// The eight neighbours of a pixel in the same field.
    pub fn neighbours(&self, pixel: usize) -> impl Iterator<Item = usize> + '_ {
        let (x, y) = (pixel % self.width, pixel / self.width);
        let columns = x.saturating_sub(1)..=(x + 1).min(self.width - 1);
        self.rows_around(y).flat_map(move |row| columns.clone().map(move |column| row * self.width + column))
    }

    /// A row, and the rows above and below it in its field.
    fn rows_around(&self, y: usize) -> impl Iterator<Item = usize> + use<> {
        let (height, step) = (self.inverse_depth.len() / self.width, self.row_step);
        let below = Some(y + step).filter(|&row| row < height);
        [y.checked_sub(step), Some(y), below].into_iter().flatten()
    }

    fn steep_of_row(&self, y: usize, steep: &mut [bool]) {
        if self.displacement_px <= 0.0 {
            return;
        }
        let (width, height) = (self.width, self.inverse_depth.len() / self.width);
        let row = |y: usize| &self.inverse_depth[y * width..][..width];
        let below =
            if y + self.row_step < height { y + self.row_step } else { y.saturating_sub(self.row_step) };
        let (here, beside) = (row(y), row(below));
        let down = self.displacement_px / self.row_step as f32;
        for x in 0..width {
            let right = here[if x + 1 < width { x + 1 } else { x.saturating_sub(1) }];
            let change = ((right - here[x]) * self.displacement_px).hypot((beside[x] - here[x]) * down);
            steep[x] |= change > STEEP * here[x];
        }
    }

    fn bends_of_row(&self, y: usize, bent: &mut [bool]) {
        let (width, here) = (self.width, y * self.width);
        let row = &self.inverse_depth[here..here + width];
        let valid = &self.valid[here..here + width];
        for x in 1..width.saturating_sub(1) {
            bent[x] |= bends(row[x - 1], row[x], row[x + 1]) & valid[x - 1] & valid[x] & valid[x + 1];
        }
        let stride = self.row_step * width;
        if here < stride || here + stride + width > self.inverse_depth.len() {
            return;
        }
        let (above, below) =
            (&self.inverse_depth[here - stride..][..width], &self.inverse_depth[here + stride..][..width]);
        let (valid_above, valid_below) =
            (&self.valid[here - stride..][..width], &self.valid[here + stride..][..width]);
        for x in 0..width {
            bent[x] |= bends(above[x], row[x], below[x]) & valid_above[x] & valid[x] & valid_below[x];
        }
        for x in 1..width.saturating_sub(1) {
            bent[x] |= bends(above[x - 1], row[x], below[x + 1])
                & valid_above[x - 1]
                & valid[x]
                & valid_below[x + 1];
            bent[x] |= bends(above[x + 1], row[x], below[x - 1])
                & valid_above[x + 1]
                & valid[x]
                & valid_below[x - 1];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unreliable pixels of a grid of 12 x 10 pixels, for inverse depths by position.
    fn unreliable(
        row_step: usize,
        valid: impl Fn(usize, usize) -> bool,
        look: impl Fn(f32, f32) -> f32,
    ) -> Vec<[usize; 2]> {
        let pixels = || (0..10).flat_map(|y| (0..12).map(move |x| [x, y]));
        let inverse_depth: Vec<f32> = pixels().map(|[x, y]| look(x as f32, y as f32)).collect();
        let valid: Vec<bool> = pixels().map(|[x, y]| valid(x, y)).collect();
        let grid = DepthGrid {
            width: 12,
            row_step,
            inverse_depth: &inverse_depth,
            valid: &valid,
            displacement_px: 0.0,
        };
        pixels().zip(grid.unreliable_pixels()).filter(|(_, suspect)| *suspect).map(|(at, _)| at).collect()
    }

    #[test]
    fn planes_and_the_sky_are_reliable() {
        assert!(unreliable(1, |_, _| true, |x, y| 0.01 + 0.002 * x + 0.003 * y).is_empty());
        assert!(unreliable(1, |_, _| true, |_, _| 0.0).is_empty());
        // A step between the two fields of an interlaced frame does not count: they belong to different
        // instants.
        assert!(
            unreliable(2, |_, _| true, |_, y| if (y as u32).is_multiple_of(2) { 0.01 } else { 0.02 })
                .is_empty()
        );
    }

    #[test]
    fn edges_creases_and_skylines_are_unreliable_with_their_neighbours() {
        let column =
            |found: Vec<[usize; 2]>| found.iter().filter(|at| at[1] == 5).map(|at| at[0]).collect::<Vec<_>>();
        assert_eq!(column(unreliable(1, |_, _| true, |x, _| if x < 5.0 { 0.1 } else { 0.02 })), [3, 4, 5, 6]);
        assert_eq!(column(unreliable(1, |_, _| true, |x, _| if x < 5.0 { 0.1 } else { 0.0 })), [3, 4, 5, 6]);
        assert_eq!(column(unreliable(1, |_, _| true, |x, _| 0.1 + 2e-4 * (x - 5.0).max(0.0))), [4, 5, 6]);
        assert!(unreliable(1, |_, _| true, |x, _| 0.1 + 1e-5 * (x - 5.0).max(0.0)).is_empty());
        // At the border of the image as well.
        assert_eq!(column(unreliable(1, |_, _| true, |x, _| if x < 1.0 { 0.1 } else { 0.02 })), [0, 1, 2]);
    }

    #[test]
    fn pixels_without_a_ray_are_ignored() {
        assert!(unreliable(1, |x, _| x >= 5, |x, _| if x < 5.0 { 0.0 } else { 0.02 }).is_empty());
    }

    #[test]
    fn neighbours_stay_in_the_picture_and_in_the_field() {
        let (inverse_depth, valid) = ([0.0; 120], [true; 120]);
        let grid = DepthGrid {
            width: 12,
            row_step: 2,
            inverse_depth: &inverse_depth,
            valid: &valid,
            displacement_px: 0.0,
        };
        assert_eq!(grid.neighbours(0).collect::<Vec<_>>(), [0, 1, 24, 25]);
        assert_eq!(grid.neighbours(119).collect::<Vec<_>>(), [94, 95, 118, 119]);
    }

    #[test]
    fn non_finite_depths_do_not_bend() {
        assert!(
            !bends(f32::NAN, 0.1, 0.1) && !changed(f32::NAN, 0.1) && changed(0.0, 0.1) && !changed(0.0, 0.0)
        );
    }
}
