// One ideal frame.
fn key_count() -> u32 {
    return 1u;
}

// Selects the key nearest to a line's own time.
fn select_key_of_line(pixel: vec2<u32>) {}

// Selects the key of a rank (0 = nearest in time) for a fraction of the exposure.
fn select_key_of_rank(pixel: vec2<u32>, exposure_fraction: f32, rank: u32) {}

fn key_index() -> u32 {
    return 0u;
}

// First row of the selected key in the textures of the ideal frames.
fn key_row() -> i32 {
    return 0;
}
