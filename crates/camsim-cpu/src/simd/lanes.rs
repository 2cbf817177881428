//! Arrays over a block of pixels: plain loops of fixed length, which the compiler vectorises.

/// Pixels of a row per block: enough for wide vectors, and few enough for the L1 cache.
pub(crate) const LANES: usize = 32;

/// One number per pixel of a block.
pub(crate) type Lanes = [f32; LANES];

/// Zero for all pixels.
pub(crate) const ZERO: Lanes = [0.0; LANES];

/// One number per pixel, from the pixel's index.
#[inline(always)]
pub(crate) fn per_lane(value: impl Fn(usize) -> f32) -> Lanes {
    let mut lanes = ZERO;
    for i in 0..LANES {
        lanes[i] = value(i);
    }
    lanes
}

/// 1 where the condition holds, else 0.
#[inline(always)]
pub(crate) fn indicator(holds: impl Fn(usize) -> bool) -> Lanes {
    per_lane(|i| if holds(i) { 1.0 } else { 0.0 })
}

/// One 2D vector per pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes2 {
    pub x: Lanes,
    pub y: Lanes,
}

impl Lanes2 {
    pub const ZERO: Self = Self { x: ZERO, y: ZERO };

    #[inline(always)]
    pub fn minus(&self, other: &Self) -> Self {
        Self { x: per_lane(|i| self.x[i] - other.x[i]), y: per_lane(|i| self.y[i] - other.y[i]) }
    }

    #[inline(always)]
    pub fn length(&self) -> Lanes {
        per_lane(|i| self.x[i].mul_add(self.x[i], self.y[i] * self.y[i]).sqrt())
    }
}

/// One 3D vector per pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes3 {
    pub x: Lanes,
    pub y: Lanes,
    pub z: Lanes,
}

/// Clamps to `0..=last`; NaN becomes 0. One instruction per bound, unlike `f32::clamp`.
#[inline(always)]
pub(crate) fn clamp_to(value: f32, last: f32) -> f32 {
    fast_min(fast_max(value, 0.0), last)
}

/// Converts a whole number in `0..2^23` by its bits: saturating conversions take several instructions.
#[inline(always)]
pub(crate) fn to_index(value: f32) -> u32 {
    const FIRST_WITHOUT_FRACTION: f32 = (1_u32 << 23) as f32;
    (value + FIRST_WITHOUT_FRACTION).to_bits() & 0x007f_ffff
}

/// Minimum in one instruction, unlike `f32::min`; `b` if either is NaN.
#[inline(always)]
pub(crate) fn fast_min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Maximum in one instruction, unlike `f32::max`; `b` if either is NaN.
#[inline(always)]
pub(crate) fn fast_max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
