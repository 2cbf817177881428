// Pixels that see a silhouette: rays of their own over the pixel's area and exposure, each with its own pose and depth, and each with
// the colour of the one sample of the ideal frame that it meets, so that surfaces never mix but by area and time.
// Twin: camsim_core::temporal::edges.
#import ideal/fine.wgsl

@group(1) @binding(5) var fine_color: texture_multisampled_2d<f32>;
@group(1) @binding(6) var fine_depth: texture_depth_multisampled_2d;
// Largest depth value of the ideal frame, as bits.
@group(1) @binding(7) var<storage, read> nearest: u32;

// Golden ratio: multiples are even over an interval for any number of them.
const GOLDEN: f32 = 0.6180339887;
// Looks along the parallax of a ray: their distance in ideal pixels, and how many at most.
const LOOK_PX: f32 = 0.5;
const MAX_LOOKS: u32 = 64u;
// Fixed-point steps from each look.
const LOOK_STEPS: u32 = 4u;
// A depth that gives itself again to within this, in ideal pixels of parallax, is where the ray meets a surface.
const MEETS_PX: f32 = 0.05;

struct FineSample {
    texel: vec2<i32>,
    index: i32,
}

fn fine_sample(at_px: vec2<f32>) -> FineSample {
    let last = vec2<f32>(frame.ideal_size_px) - 1e-3;
    let at = clamp(at_px + 0.5, vec2<f32>(0.0), last) * f32(frame.edge_scale);
    let texel = floor(at);
    let half = vec2<i32>(2.0 * (at - texel));
    return FineSample(vec2<i32>(texel), half.x + 2 * half.y);
}

fn fine_inverse_depth(at_px: vec2<f32>) -> f32 {
    let s = fine_sample(at_px);
    return textureLoad(fine_depth, s.texel, s.index) / frame.near_m;
}

fn fine_color_at(at_px: vec2<f32>) -> vec3<f32> {
    let s = fine_sample(at_px);
    return textureLoad(fine_color, s.texel, s.index).rgb;
}

fn nearest_inverse_depth() -> f32 {
    return 1.02 * bitcast<f32>(nearest) / frame.near_m;
}

// Whether a stretch of the ideal frame passes a silhouette.
fn passes_edge(a_px: vec2<f32>, b_px: vec2<f32>) -> bool {
    let looks = clamp(u32(ceil(distance(a_px, b_px))), 1u, MAX_LOOKS);
    for (var i = 0u; i <= looks; i++) {
        if (ideal_color_at(mix(a_px, b_px, f32(i) / f32(looks))).a < 1.0) {
            return true;
        }
    }
    return false;
}

// Ray i of `frame.edge_samples`: place in the pixel, from -0.5 to 0.5 (Hammersley's points), and share of the exposure gone by.
fn ray_place(i: u32) -> vec3<f32> {
    let step = 1.0 / f32(frame.edge_samples);
    let x = (f32(i) + 0.5) * step;
    let y = f32(reverseBits(i) >> 8u) / 16777216.0 + 0.5 * step;
    return vec3<f32>(x - 0.5, y - 0.5, fract(GOLDEN * (f32(i) + 0.5)));
}

fn gather_edges(pixel: vec2<u32>, ray: Ray, plain: Gathered) -> Gathered {
    var edge = plain.color.a < 0.9999;
    for (var node = 0u; HAS_PARALLAX && !edge && node < frame.nodes; node += max(frame.nodes - 1u, 1u)) {
        let pose = pose_at_node(pixel, node);
        let near = point_at(ray.uv, pose, nearest_inverse_depth());
        let far = point_at(ray.uv, pose, 0.0);
        edge = near.z > 0.0 && far.z > 0.0 && passes_edge(ideal_px_from_point(near), ideal_px_from_point(far));
    }
    if (!edge) {
        return plain;
    }
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < frame.edge_samples; i++) {
        let f = ray_place(i).xy;
        let uv = ray.uv + f.x * ray.d_dx + f.y * ray.d_dy;
        // Nodes are equally far apart in time.
        let along = ray_place(i).z * f32(frame.nodes - 1u);
        let node = min(u32(along), max(frame.nodes, 2u) - 2u);
        var pose = pose_at_node(pixel, node);
        if (frame.nodes > 1u) {
            pose = mix_pose(pose, pose_at_node(pixel, node + 1u), along - f32(node));
        }
        sum += fine_color_at(first_surface_px(uv, pose));
    }
    return Gathered(vec4<f32>(sum / f32(frame.edge_samples), 1.0), plain.inside);
}

// Where a ray first meets a surface of the ideal frame, in ideal pixels. The ray's points, from the nearest surface of all to infinity,
// lie on a line of the ideal frame; the ray meets a surface at a depth whose own place there shows that depth. Of several the nearest
// counts. If there is none, the key camera did not see what the ray meets, and the farthest surface seen beside it stands in.
fn first_surface_px(uv: vec2<f32>, pose: Pose) -> vec2<f32> {
    let w_near = nearest_inverse_depth();
    let near_px = ideal_px_from_point(point_at(uv, pose, w_near));
    let far_px = ideal_px_from_point(point_at(uv, pose, 0.0));
    let px_per_w = distance(near_px, far_px) / max(w_near, 1e-12);
    if (px_per_w * w_near < 0.1 * MEETS_PX) {
        return far_px;
    }
    let looks = clamp(u32(ceil(px_per_w * w_near / LOOK_PX)), 1u, MAX_LOOKS);
    var met = -1.0;
    var met_px = far_px;
    var farthest = 1e30;
    var farthest_px = far_px;
    for (var i = 0u; i <= looks; i++) {
        var w = w_near * (1.0 - f32(i) / f32(looks));
        if (w <= met) {
            break;
        }
        for (var k = 0u; k < LOOK_STEPS; k++) {
            let at_px = ideal_px_from_point(point_at(uv, pose, w));
            let found = line_inverse_depth(uv, pose, fine_inverse_depth(at_px));
            if (found < farthest) {
                farthest = found;
                farthest_px = at_px;
            }
            if (abs(found - w) * px_per_w < MEETS_PX) {
                if (found > met) {
                    met = found;
                    met_px = at_px;
                }
                break;
            }
            w = found;
        }
    }
    return select(farthest_px, met_px, met >= 0.0);
}
