// Where an output ray at its own instant looks in the ideal frame.
struct Source {
    // Ideal pixels.
    at_px: vec2<f32>,
    // Inverse planar depth in the line's own camera, 1/m; 0 = sky.
    inverse_depth: f32,
    // In front of the key camera and inside the ideal frame.
    inside: bool,
    // Where it would look if what it sees were infinitely far, ideal pixels.
    far_px: vec2<f32>,
}
