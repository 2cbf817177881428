// No distortion.

fn table_initial_value(distorted: vec2f) -> vec2f {
    return distorted;
}

// Returns ideal u, v, and 1 if a solution exists, else 0.
fn undistort(distorted: vec2f, start: vec2f) -> vec3f {
    return vec3f(distorted, 1.0);
}
