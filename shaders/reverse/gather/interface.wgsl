// What an output pixel collects.
struct Gathered {
    // R G B as the ideal frame has them; alpha is 1, or less where the samples met a silhouette.
    color: vec4<f32>,
    inside: bool,
}
