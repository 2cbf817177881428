// Result of the gather.
struct Gathered {
    // R G B of the ideal frame; alpha is 1, or less where the samples touched edge pixels.
    color: vec4<f32>,
    inside: bool,
    // Sources of the exposure's begin and end if the surface were infinitely far, ideal pixels.
    far_px: array<vec2<f32>, 2>,
}
