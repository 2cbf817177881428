//! Conversion of linear values to code values.

use std::sync::LazyLock;

use camsim_core::scene::{linear_from_srgb_f64, srgb_from_linear_f64};

/// Nearest 8-bit code; NaN gives 0.
pub(super) fn code8(value: f32) -> u8 {
    (value * 255.0).round() as u8
}

/// Nearest 16-bit code; NaN gives 0.
pub(super) fn code16(value: f32) -> u16 {
    (value * 65535.0).round() as u16
}

/// Number of cells of the table's index.
const CELLS: usize = 4096;

/// Table of the sRGB transfer function. `steps[c]` is the smallest linear value whose code is above c,
/// `first[i]` the code at the start of cell i.
struct SrgbTable {
    steps: [f32; 256],
    first: [u8; CELLS + 1],
}

static SRGB: LazyLock<SrgbTable> = LazyLock::new(|| {
    let steps = std::array::from_fn(|code| {
        if code < 255 { linear_from_srgb_f64((code as f64 + 0.5) / 255.0) as f32 } else { f32::INFINITY }
    });
    let first = std::array::from_fn(|cell| {
        (srgb_from_linear_f64(cell as f64 / CELLS as f64) * 255.0 - 0.5).floor().max(0.0) as u8
    });
    SrgbTable { steps, first }
});

/// Nearest 8-bit sRGB code of a linear value, by table; NaN gives 0.
pub fn srgb8(linear: f32) -> u8 {
    if linear.is_nan() {
        return 0;
    }
    let linear = linear.clamp(0.0, 1.0);
    let table = &*SRGB;
    let mut code = table.first[(linear * CELLS as f32) as usize];
    while linear >= table.steps[code as usize] {
        code += 1;
    }
    code
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_gives_the_nearest_srgb_code() {
        for i in 0..=200_000 {
            let linear = i as f32 / 200_000.0;
            let exact = srgb_from_linear_f64(f64::from(linear)) * 255.0;
            // Half a code, and a little for values that lie on the border between two.
            assert!((f64::from(srgb8(linear)) - exact).abs() < 0.5 + 1e-3, "{linear}");
        }
        assert_eq!([srgb8(f32::NAN), srgb8(-1.0), srgb8(7.0), srgb8(f32::INFINITY)], [0, 0, 255, 255]);
        assert_eq!([code8(f32::NAN), code8(-3.0), code8(2.0), code8(0.5)], [0, 0, 255, 128]);
        assert_eq!([code16(f32::NAN), code16(9.0), code16(0.5)], [0, 65535, 32768]);
    }
}
