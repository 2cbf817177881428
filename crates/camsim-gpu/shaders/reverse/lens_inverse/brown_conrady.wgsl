// Brown-Conrady model, polynomial or rational, with tangential terms (paper eqs. 8 and 9). Twin:
// lens/brown_conrady.rs.

// Initial values are limited to this fraction of the fold radius, where the Jacobian is safely regular.
const START_SHARE_OF_FOLD: f32 = 0.95;
const MIN_DETERMINANT: f32 = 1e-4;

fn numerator(r2: f32) -> f32 {
    let k = lens.radial;
    return 1.0 + r2 * (k.x + r2 * (k.y + r2 * k.z));
}

fn denominator(r2: f32) -> f32 {
    let k = lens.rational;
    return 1.0 + r2 * (k.x + r2 * (k.y + r2 * k.z));
}

// Forward model minus the given distorted point. Only the excess of the radial factor over 1 is multiplied,
// so that rounding is small.
fn residual_of(ideal: vec2f, distorted: vec2f) -> vec2f {
    let r2 = dot(ideal, ideal);
    let above = lens.radial - lens.rational;
    let grown = r2 * (above.x + r2 * (above.y + r2 * above.z)) / denominator(r2);
    let p = lens.tangential;
    let uv2 = 2.0 * ideal.x * ideal.y;
    return (ideal - distorted) + (ideal * grown + p.xy * uv2 + p.yx * (r2 + 2.0 * ideal * ideal));
}

// a, b, c of the symmetric Jacobian [[a, b], [b, c]].
fn jacobian(ideal: vec2f) -> vec3f {
    let r2 = dot(ideal, ideal);
    let below = denominator(r2);
    let d = numerator(r2) / below;
    let n = lens.radial;
    let q = lens.rational;
    let numerator_slope = n.x + r2 * (2.0 * n.y + r2 * 3.0 * n.z);
    let denominator_slope = q.x + r2 * (2.0 * q.y + r2 * 3.0 * q.z);
    let s = 2.0 * (numerator_slope - denominator_slope * d) / below;
    let p = lens.tangential;
    let a = d + s * ideal.x * ideal.x + 2.0 * p.x * ideal.y + 6.0 * p.y * ideal.x;
    let b = s * ideal.x * ideal.y + 2.0 * p.x * ideal.x + 2.0 * p.y * ideal.y;
    let c = d + s * ideal.y * ideal.y + 6.0 * p.x * ideal.y + 2.0 * p.y * ideal.x;
    return vec3f(a, b, c);
}

fn scaled_to(ideal: vec2f, radius: f32) -> vec2f {
    return ideal * (radius / max(length(ideal), 1e-30));
}

// `to` if it is inside the fold; else the point in its direction mid-way between the radius of `origin` and
// the fold.
fn inside(origin: vec2f, to: vec2f) -> vec2f {
    let radius = length(to);
    if radius < lens.fold_min {
        return to;
    }
    let fold = fold_radius(to);
    if radius < fold {
        return to;
    }
    return scaled_to(to, 0.5 * (min(length(origin), fold) + fold));
}

fn table_initial_value(distorted: vec2f) -> vec2f {
    return distorted * radial_ratio(length(distorted));
}

// -J^-1 residual.
fn newton_step(ideal: vec2f, residual: vec2f) -> vec2f {
    let j = jacobian(ideal);
    let det = max(j.x * j.z - j.y * j.y, MIN_DETERMINANT);
    return vec2f(j.y * residual.y - j.z * residual.x, j.y * residual.x - j.x * residual.y) / det;
}

// Damped Newton iteration. Returns ideal u, v, and 1 if a solution exists on the principal branch, else 0.
fn undistort(distorted: vec2f, start: vec2f) -> vec3f {
    let nothing = vec3f(INVALID_UV, INVALID_UV, 0.0);
    // Written so that NaN is rejected.
    if !(length(distorted) <= lens.distorted_max) {
        return nothing;
    }
    var ideal = start;
    if length(start) > START_SHARE_OF_FOLD * lens.fold_min {
        ideal = scaled_to(start, min(length(start), START_SHARE_OF_FOLD * fold_radius(start)));
    }
    var residual = residual_of(ideal, distorted);
    var step = newton_step(ideal, residual);
    for (var i = 0; i < MAX_STEPS; i++) {
        let last = length(step * lens.focal_px) < LAST_STEP_PX;
        let next = inside(ideal, ideal + step);
        let next_residual = residual_of(next, distorted);
        // The last step is within rounding of the solution: growth of its residual means nothing.
        if last || dot(next_residual, next_residual) <= dot(residual, residual) {
            ideal = next;
            residual = next_residual;
            step = newton_step(ideal, residual);
        } else {
            step *= 0.5;
        }
        if last {
            break;
        }
    }
    let j = jacobian(ideal);
    let good = length(residual * lens.focal_px) < MAX_RESIDUAL_PX
        && (length(ideal) < lens.fold_min || length(ideal) < fold_radius(ideal))
        && j.x * j.z - j.y * j.y > 0.0;
    if !good {
        return nothing;
    }
    return vec3f(ideal, 1.0);
}
