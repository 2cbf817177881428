//! Fog of the paper, applied after the gather.

/// The paper's fog, on stored values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearFog {
    /// sRGB values of the sky.
    pub sky_stored: [f32; 3],
    /// Slant range from which on there is fog only, metres.
    pub end_m: f64,
}
