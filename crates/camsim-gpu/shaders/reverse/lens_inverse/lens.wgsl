// Shared by all lens models: intrinsics, coefficients, and the value for pixels without an ideal ray. Rust
// mirror: `LensUniform` in reverse/lens_inverse.rs.

struct LensUniform {
    size_px: vec2u,
    focal_px: vec2f,
    // The principal point in two parts: its fraction keeps all digits next to an exact integer difference.
    principal_point_whole_px: vec2i,
    principal_point_fraction_px: vec2f,
    // Brown-Conrady k1 k2 k3 (0); Kannala-Brandt k1 k2 k3 k4.
    radial: vec4f,
    // Brown-Conrady k4 k5 k6 (0).
    rational: vec4f,
    // p1 p2.
    tangential: vec2f,
    // Largest distorted radius on the principal branch.
    distorted_max: f32,
    // Distorted radius at s = 0 of the table of initial values.
    table_distorted_max: f32,
    // Largest angle off axis (Kannala-Brandt).
    theta_max: f32,
    // Smallest fold radius in any direction.
    fold_min: f32,
}

@group(0) @binding(0) var<uniform> lens: LensUniform;

// u = v = INVALID_UV for a pixel without an ideal ray. Finite, because shaders may assume that infinities do
// not occur.
const INVALID_UV: f32 = 1e30;

// Largest reprojection residual of a solution; the f32 floor is about 3e-4 px.
const MAX_RESIDUAL_PX: f32 = 0.01;

// Newton converges quadratically: after a step of this size the next would be below the f32 floor.
const LAST_STEP_PX: f32 = 1e-3;

// Maximum number of steps, with halvings; 4 are usual, points at a fold take some 15.
const MAX_STEPS: i32 = 24;

// Distorted normalised coordinates of a pixel's centre.
fn distorted_from_pixel(pixel: vec2u) -> vec2f {
    let whole = vec2f(vec2i(pixel) - lens.principal_point_whole_px);
    return (whole - lens.principal_point_fraction_px) / lens.focal_px;
}
