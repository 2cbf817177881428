// The paper's lens inverse, for each pixel of each frame: Gauss-Newton from the distorted point, without
// safeguards. It misses rays and accepts false ones, and serves for comparison. Twin:
// camsim_core::lens::paper.
#import reverse/ray/interface.wgsl

const GAUSS_NEWTON_STEPS: u32 = 50u;
// Residual norms: image size times normalised coordinates.
const GAUSS_NEWTON_RESIDUAL: f32 = 0.1;
const GAUSS_NEWTON_DIVERGED: f32 = 500.0;

fn radial_factor(r2: f32) -> f32 {
    let k = frame.lens_radial;
    return 1.0 + r2 * (k.x + r2 * (k.y + r2 * k.z));
}

// Forward model, eqs. 8 and 9.
fn distort(ideal: vec2<f32>) -> vec2<f32> {
    let r2 = dot(ideal, ideal);
    let p = frame.lens_tangential;
    return ideal * radial_factor(r2) + p.xy * (2.0 * ideal.x * ideal.y) + p.yx * (r2 + 2.0 * ideal * ideal);
}

// J^-1 residual; J = [[a, b], [b, c]].
fn gauss_newton_step(ideal: vec2<f32>, residual: vec2<f32>) -> vec2<f32> {
    let r2 = dot(ideal, ideal);
    let k = frame.lens_radial;
    let p = frame.lens_tangential;
    let d = radial_factor(r2);
    let s = 2.0 * (k.x + r2 * (2.0 * k.y + r2 * 3.0 * k.z));
    let a = d + s * ideal.x * ideal.x + 2.0 * p.x * ideal.y + 6.0 * p.y * ideal.x;
    let b = s * ideal.x * ideal.y + 2.0 * p.x * ideal.x + 2.0 * p.y * ideal.y;
    let c = d + s * ideal.y * ideal.y + 6.0 * p.x * ideal.y + 2.0 * p.y * ideal.x;
    return vec2<f32>(c * residual.x - b * residual.y, a * residual.y - b * residual.x) / (a * c - b * b);
}

fn lens_ray(pixel: vec2<u32>) -> Ray {
    let none = vec2<f32>(0.0);
    // Pixels that the vignette hides need no ray, unless coordinates are output.
    if (!EMITS_RAYS && vignette_weight(pixel) <= 0.0) {
        return Ray(none, none, none, true);
    }
    let distorted = (vec2<f32>(pixel) - frame.principal_px) / frame.focal_px;
    let size = vec2<f32>(frame.size_px);
    var ideal_uv = distorted;
    var residual = distorted - distort(ideal_uv);
    var error = 1e30;
    for (var i = 0u; i < GAUSS_NEWTON_STEPS; i++) {
        let next = ideal_uv + gauss_newton_step(ideal_uv, residual);
        residual = distorted - distort(next);
        let next_error = length(size * residual);
        // Written so that NaN ends the iteration too.
        if (!(next_error <= error && next_error <= GAUSS_NEWTON_DIVERGED)) {
            return Ray(none, none, none, false);
        }
        ideal_uv = next;
        error = next_error;
        if (error < GAUSS_NEWTON_RESIDUAL) {
            return Ray(ideal_uv, none, none, true);
        }
    }
    return Ray(none, none, none, false);
}
