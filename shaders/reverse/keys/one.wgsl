// One ideal frame.
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
