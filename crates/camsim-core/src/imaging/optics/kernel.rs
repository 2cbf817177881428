//! Measured kernels: the picture of a point of light.

use std::f64::consts::TAU;

use rayon::prelude::*;
use rustfft::num_complex::Complex64;

/// Values that are no kernel.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KernelError {
    /// Not as many values as pixels, or none.
    #[error("has {values} values for {width} x {height} pixels; a kernel is a full rectangle of values")]
    Size {
        /// Values.
        values: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// NaN, infinite or negative.
    #[error(
        "the value in column {column}, row {row} (counted from 1) is {value}; values are fractions of light: subtract \
         the dark level, and write 0 for what is below it"
    )]
    Value {
        /// Column from 1.
        column: usize,
        /// Row from 1.
        row: usize,
        /// The value.
        value: f64,
    },
    /// No light.
    #[error("is black in a channel; a kernel has light")]
    Black,
}

/// The picture of a point in its middle, row by row, for red, green and blue; each sums to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct SpreadKernel {
    size: [usize; 2],
    channels: [Vec<f64>; 3],
}

impl SpreadKernel {
    /// A kernel of values in any scale, row by row.
    ///
    /// # Errors
    /// Values that are no fractions of light.
    pub fn new(size: [usize; 2], channels: [Vec<f64>; 3]) -> Result<Self, KernelError> {
        let [width, height] = size;
        let mut kernel = Self { size, channels };
        for values in &mut kernel.channels {
            if values.is_empty() || values.len() != width * height {
                return Err(KernelError::Size { values: values.len(), width, height });
            }
            if let Some(i) = values.iter().position(|value| !value.is_finite() || *value < 0.0) {
                return Err(KernelError::Value {
                    column: i % width + 1,
                    row: i / width + 1,
                    value: values[i],
                });
            }
            let sum: f64 = values.iter().sum();
            if sum <= 0.0 {
                return Err(KernelError::Black);
            }
            values.iter_mut().for_each(|value| *value /= sum);
        }
        Ok(kernel)
    }

    /// Columns, rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Whether the channels are alike.
    pub(super) fn is_gray(&self) -> bool {
        self.channels[0] == self.channels[1] && self.channels[1] == self.channels[2]
    }

    /// Its transfer function at all pairs of frequencies, in cycles per pixel; those of `along_y` fastest.
    /// Its values are `step_px` apart. At exactly 0.5 it is the mean of both signs, so that real pictures
    /// stay real.
    pub(super) fn transfer(&self, channel: usize, step_px: f64, along: [&[f64]; 2]) -> Vec<Complex64> {
        let [width, height] = self.size;
        let in_rows = phases(along[1], step_px, height);
        let values = &self.channels[channel];
        let columns = phases(along[0], step_px, width).into_par_iter().flat_map_iter(|phases| {
            let of_row = |row: &[f64]| row.iter().zip(&phases).map(|(value, phase)| phase * value).sum();
            let rows: Vec<Complex64> = values.chunks_exact(width).map(of_row).collect();
            let at = |phases: &Vec<Complex64>| phases.iter().zip(&rows).map(|(phase, row)| phase * row).sum();
            in_rows.iter().map(at).collect::<Vec<Complex64>>()
        });
        columns.collect()
    }
}

/// `exp(-2 pi i f x)` of each frequency at the positions of `count` values about their middle.
fn phases(frequencies: &[f64], step_px: f64, count: usize) -> Vec<Vec<Complex64>> {
    let position = |i: usize| step_px * (i as f64 - 0.5 * (count as f64 - 1.0));
    let of = |frequency: f64| {
        let phase = move |i: usize| match Complex64::cis(-TAU * frequency * position(i)) {
            phase if frequency.abs() == 0.5 => Complex64::new(phase.re, 0.0),
            phase => phase,
        };
        (0..count).map(phase).collect()
    };
    frequencies.iter().map(|&frequency| of(frequency)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_kernel_is_refused() {
        let gray = |size, values: Vec<f64>| SpreadKernel::new(size, [values.clone(), values.clone(), values]);
        assert!(matches!(gray([2, 2], vec![1.0; 3]), Err(KernelError::Size { values: 3, .. })));
        assert!(matches!(gray([0, 0], vec![]), Err(KernelError::Size { .. })));
        let negative = gray([2, 2], vec![1.0, 1.0, -0.5, 1.0]);
        assert!(matches!(negative, Err(KernelError::Value { column: 1, row: 2, .. })), "{negative:?}");
        assert!(matches!(gray([1, 1], vec![f64::NAN]), Err(KernelError::Value { .. })));
        assert_eq!(gray([2, 1], vec![0.0; 2]), Err(KernelError::Black));
    }

    #[test]
    fn a_shift_turns_the_phase() {
        let mut values = vec![0.0; 15];
        // One value right of the middle and one row above it.
        values[3] = 2.0;
        let kernel = SpreadKernel::new([5, 3], [values.clone(), values.clone(), values]).expect("a kernel");
        let found = kernel.transfer(1, 0.5, [&[0.1], &[0.2, 0.3]]);
        for (found, fy) in found.iter().zip([0.2, 0.3]) {
            let expected = Complex64::cis(-TAU * 0.5 * (0.1 - fy));
            assert!((found - expected).norm() < 1e-12, "{found}");
        }
    }
}
