// Source of an output ray in the ideal frame.
struct Source {
    // Position, ideal pixels.
    position_px: vec2<f32>,
    // Inverse planar depth in the line's own camera, 1/m; 0 = sky.
    inverse_depth: f32,
    // Whether it is in front of the key camera and inside the ideal frame.
    inside: bool,
    // Position if the surface were infinitely far, ideal pixels.
    far_px: vec2<f32>,
}
