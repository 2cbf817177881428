//! Pixels side by side: plain loops of fixed length, which compilers turn into vector instructions.

/// Pixels of a line that are worked out together: enough for wide vectors and few enough for the first cache.
pub(crate) const LANES: usize = 32;

/// A number of each.
pub(crate) type Lanes = [f32; LANES];

/// Zero of each.
pub(crate) const ZERO: Lanes = [0.0; LANES];

/// A number of each, by its place.
#[inline(always)]
pub(crate) fn each(number: impl Fn(usize) -> f32) -> Lanes {
    let mut lanes = ZERO;
    for i in 0..LANES {
        lanes[i] = number(i);
    }
    lanes
}

/// Whether it holds for each, as 0 or 1.
#[inline(always)]
pub(crate) fn whether(holds: impl Fn(usize) -> bool) -> Lanes {
    each(|i| if holds(i) { 1.0 } else { 0.0 })
}

/// A place on a plane of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes2 {
    pub x: Lanes,
    pub y: Lanes,
}

impl Lanes2 {
    pub const ZERO: Self = Self { x: ZERO, y: ZERO };

    #[inline(always)]
    pub fn minus(&self, other: &Self) -> Self {
        Self { x: each(|i| self.x[i] - other.x[i]), y: each(|i| self.y[i] - other.y[i]) }
    }

    #[inline(always)]
    pub fn length(&self) -> Lanes {
        each(|i| self.x[i].mul_add(self.x[i], self.y[i] * self.y[i]).sqrt())
    }
}

/// A direction of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes3 {
    pub x: Lanes,
    pub y: Lanes,
    pub z: Lanes,
}

/// Into `0..=last`; NaN becomes 0. One instruction a bound, which `f32::clamp` is not.
#[inline(always)]
pub(crate) fn within(value: f32, last: f32) -> f32 {
    lower(higher(value, 0.0), last)
}

/// A whole number in `0..2^23`, from its bits: conversions that saturate take several instructions.
#[inline(always)]
pub(crate) fn whole(value: f32) -> u32 {
    const FIRST_WITHOUT_FRACTION: f32 = (1_u32 << 23) as f32;
    (value + FIRST_WITHOUT_FRACTION).to_bits() & 0x007f_ffff
}

/// One instruction, which `f32::min` is not.
#[inline(always)]
pub(crate) fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// One instruction, which `f32::max` is not.
#[inline(always)]
pub(crate) fn higher(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
