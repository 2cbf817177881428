// One ideal frame, at the middle of the window.
fn key_count() -> u32 {
    return 1u;
}

// Choose the key that is nearest to a line's own time.
fn use_key_of_line(pixel: vec2<u32>) {}

// Choose the key of a rank (0 = nearest in time) for a share of the exposure.
fn use_key_of_rank(pixel: vec2<u32>, along: f32, rank: u32) {}

fn key_number() -> u32 {
    return 0u;
}

// First row of the chosen key in the textures of the ideal frames, ideal pixels.
fn key_row() -> i32 {
    return 0;
}

// What a key camera sees at an ideal pixel and inverse depth (1/m), in the mid-window camera: its ray, with the inverse depth times the
// same factor.
fn reference_point(at_px: vec2<f32>, in_key: f32) -> vec4<f32> {
    return vec4<f32>((at_px - frame.ideal_principal_px) / frame.ideal_focal_px, 1.0, in_key);
}

fn reference_px(at_px: vec2<f32>, in_key: f32) -> vec2<f32> {
    return at_px;
}
