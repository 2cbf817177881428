// Each sample is one read.
fn reads_of(area: Footprint, samples: u32) -> u32 {
    return samples;
}

fn sample_of(area: Footprint, read: u32) -> u32 {
    return read;
}
