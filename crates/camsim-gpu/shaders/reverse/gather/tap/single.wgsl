// Each sample is one read.
fn read_count(pixel_footprint: Footprint, samples: u32) -> u32 {
    return samples;
}

fn sample_index(pixel_footprint: Footprint, read: u32) -> u32 {
    return read;
}
