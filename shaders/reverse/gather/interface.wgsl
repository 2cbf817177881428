// What an output pixel collects.
struct Gathered {
    // R G B as the ideal frame has them; alpha is 1, or less where the samples met a silhouette.
    color: vec4<f32>,
    inside: bool,
    // Where the exposure's begin and end would look if what they see were infinitely far, ideal pixels.
    far_px: array<vec2<f32>, 2>,
}
