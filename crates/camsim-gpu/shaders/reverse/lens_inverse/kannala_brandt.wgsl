// Kannala-Brandt: theta_d = theta (1 + k1 theta^2 + ... + k4 theta^8). Twin: lens/kannala_brandt.rs.

const QUARTER_PI: f32 = 0.78539816;
// pi/2 in two parts, so that the difference to a right angle keeps its digits.
const HALF_PI_HIGH: f32 = 1.5707964;
const HALF_PI_LOW: f32 = -4.371139e-8;

fn theta_d(theta: f32) -> f32 {
    let t2 = theta * theta;
    let k = lens.radial;
    return theta * (1.0 + t2 * (k.x + t2 * (k.y + t2 * (k.z + t2 * k.w))));
}

fn theta_d_slope(theta: f32) -> f32 {
    let t2 = theta * theta;
    let k = lens.radial;
    return 1.0 + t2 * (3.0 * k.x + t2 * (5.0 * k.y + t2 * (7.0 * k.z + t2 * 9.0 * k.w)));
}

// tan on [0, pi/4]: x + x^3 P(x^2), with P a minimax fit of the relative error (2e-8; 9e-8 in f32). Vulkan
// guarantees only 2^-11 for sin and cos.
fn tangent_to_quarter_pi(x: f32) -> f32 {
    let z = x * x;
    let p = 0.333331439 + z * (
        0.133391412
        + z * (0.0533825038 + z * (0.0245344041 + z * (0.00295033063 + z * 0.00948708111)))
    );
    return x + x * z * p;
}

// tan on [0, pi/2).
fn tangent(x: f32) -> f32 {
    if x <= QUARTER_PI {
        return tangent_to_quarter_pi(x);
    }
    return 1.0 / tangent_to_quarter_pi((HALF_PI_HIGH - x) + HALF_PI_LOW);
}

fn table_initial_value(distorted: vec2f) -> vec2f {
    let radius = length(distorted);
    let theta = clamp(radius * radial_ratio(radius), 0.0, lens.theta_max);
    return distorted * (tangent(theta) / max(radius, 1e-30));
}

// Bracketed Newton iteration in theta. Returns ideal u, v, and 1 if a solution exists within theta_max, else
// 0.
fn undistort(distorted: vec2f, start: vec2f) -> vec3f {
    let radius = length(distorted);
    // Written so that NaN is rejected.
    if !(radius <= lens.distorted_max) {
        return vec3f(INVALID_UV, INVALID_UV, 0.0);
    }
    if radius < 1e-9 {
        return vec3f(distorted, 1.0);
    }
    let last_step = LAST_STEP_PX / max(lens.focal_px.x, lens.focal_px.y);
    var low = 0.0;
    var high = lens.theta_max;
    var theta = clamp(atan(length(start)), low, high);
    for (var i = 0; i < MAX_STEPS; i++) {
        let residual = theta_d(theta) - radius;
        if residual > 0.0 {
            high = theta;
        } else {
            low = theta;
        }
        let newton = theta - residual / max(theta_d_slope(theta), 1e-6);
        // Not strict: once a bracket end is the root itself, a strict test would bisect away from it.
        let next = select(0.5 * (low + high), newton, newton >= low && newton <= high);
        let moved = abs(next - theta);
        theta = next;
        if moved < last_step {
            break;
        }
    }
    return vec3f(distorted * (tangent(theta) / radius), 1.0);
}
