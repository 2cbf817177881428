// No distortion.

fn table_start(distorted: vec2f) -> vec2f {
    return distorted;
}

// Ideal u, v, and 1 if there is such a point, else 0.
fn undistort(distorted: vec2f, start: vec2f) -> vec3f {
    return vec3f(distorted, 1.0);
}
