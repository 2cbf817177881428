// Surfaces are no thinner than a pixel: what is at the middles of pixels tells where they end.

fn is_thin(pixel: vec2<i32>, slope: f32, edge_step: f32) -> bool {
    return false;
}
