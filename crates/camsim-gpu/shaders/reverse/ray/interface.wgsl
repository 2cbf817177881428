// Ideal ray of an output pixel and its derivatives.
struct Ray {
    uv: vec2<f32>,
    // d(uv)/dx and d(uv)/dy, per output pixel.
    d_dx: vec2<f32>,
    d_dy: vec2<f32>,
    valid: bool,
}
