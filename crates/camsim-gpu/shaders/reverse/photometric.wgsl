// Vignette, light, noise, saturation on linear values (paper section 7, fig. 9). Twin:
// camsim_core::photometric.

// Vignette weights of the output frame, after thresholds; one texel of 1.0 without vignette.
@group(1) @binding(4) var vignette: texture_2d<f32>;

const NOISE_STREAM: u32 = 1u;

fn vignette_weight(pixel: vec2<u32>) -> f32 {
    // A single texel serves all pixels: the sampler clamps to it.
    let uv = (vec2<f32>(pixel) + 0.5) * (1.0 / vec2<f32>(textureDimensions(vignette)));
    return textureSampleLevel(vignette, texel_sampler, uv, 0.0).x;
}

fn photometric(pixel: vec2<u32>, color: vec3<f32>, weight: f32) -> vec3<f32> {
    var value = color;
    let is_mono = unspecialised(frame.mono) == 1u;
    if (is_mono) {
        value = vec3<f32>(dot(color, vec3<f32>(0.2126, 0.7152, 0.0722)));
    }
    value *= weight * frame.light;
    if (unspecialised(u32(frame.noise_sigma > 0.0)) == 1u) {
        let noise = normal4(pixel, NOISE_STREAM);
        value += frame.noise_sigma * select(noise.xyz, noise.xxx, is_mono);
    }
    return clamp(value, vec3<f32>(0.0), vec3<f32>(frame.most));
}
