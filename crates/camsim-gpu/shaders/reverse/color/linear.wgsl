// The ideal frame holds linear light and already includes fog.
fn after_gather(ray: Ray, color: vec3<f32>) -> vec3<f32> {
    return color;
}

fn output_color(value: vec3<f32>) -> vec3<f32> {
    return value;
}
