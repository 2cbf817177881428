// Ray of a pinhole camera, in closed form.
#import reverse/ray/interface.wgsl

fn lens_ray(pixel: vec2<u32>) -> Ray {
    let uv = (vec2<f32>(pixel) - frame.principal_px) / frame.focal_px;
    return Ray(uv, vec2<f32>(1.0 / frame.focal_px.x, 0.0), vec2<f32>(0.0, 1.0 / frame.focal_px.y), true);
}
