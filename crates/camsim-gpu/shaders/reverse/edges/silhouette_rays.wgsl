// Silhouette rays: a pixel that sees a silhouette gets rays of its own over its area and exposure. Each ray
// has its own pose, and takes depth and colour from the one surface of the ideal frame that it hits, so that
// surfaces mix only by area and time. Twin: camsim_core::temporal::silhouette_rays.
#import ideal/sample_count.wgsl
#import reverse/edges/near_silhouette.wgsl
#import <slot:surface_color>

@group(1) @binding(6) var fine_depth: texture_depth_multisampled_2d;
// Borders of two surfaces within the fine pixels of edge pixels: see ideal/edge_lines.wgsl.
@group(1) @binding(7) var fine_lines: texture_2d<u32>;

// Golden ratio: the fractional parts of its multiples are evenly spread for any number of them (Kronecker
// sequence).
const GOLDEN: f32 = 0.6180339887;
// Step of the march along the epipolar line of a ray, ideal pixels, up to MAX_LOOK_UPS steps.
const STEP_PX: f32 = 0.5;
// Bisections of the step in which a ray stops being in front of the surface.
const HALVINGS: u32 = 5u;
// States of the march.
const MARCHING: u32 = 0u;
const BISECTING: u32 = 1u;
const VERIFYING: u32 = 2u;
// Depth steps whose parallax is below this, ideal pixels, occlude nothing.
const GAP_PX: f32 = 0.1;
// Largest distance between the hit of a ray and the source of the plain gather on the same surface, ideal
// pixels.
const PLAIN_PX: f32 = 0.25;
// Largest difference of two depths of one surface, as parallax in ideal pixels.
const SAME_PX: f32 = 0.25;

struct FineSample {
    texel: vec2<i32>,
    index: i32,
}

// Sample for a position: that of its quadrant of the fine pixel; if a border of two surfaces crosses the fine
// pixel, one of the surface on the position's side.
fn fine_sample(position_px: vec2<f32>) -> FineSample {
    let last = vec2<f32>(frame.ideal_size_px) - 1e-3;
    let position = clamp(position_px + 0.5, vec2<f32>(0.0), last) * f32(frame.edge_scale);
    let corner = floor(position);
    let quadrant_xy = vec2<i32>(2.0 * (position - corner));
    let texel = vec2<i32>(corner) + vec2<i32>(0, key_row() * i32(frame.edge_scale));
    let quadrant = quadrant_xy.x + 2 * quadrant_xy.y;
    var edge_line_words = vec2<u32>(0u);
    if (textureLoad(ideal_color, texel / i32(frame.edge_scale), 0).a < 1.0) {
        edge_line_words = textureLoad(fine_lines, texel, 0).xy;
    }
    if (edge_line_words.x == 0u) {
        return FineSample(texel, quadrant);
    }
    let scaled = unpack2x16snorm(edge_line_words.x);
    let length = length(scaled);
    let normal = scaled / length;
    let nearer = dot(normal, position - corner - 0.5) > 4.0 * length - 2.0;
    let mid_depth = bitcast<f32>(edge_line_words.y);
    let own_sample = sample_on_side(texel, quadrant, nearer, mid_depth);
    if (own_sample.index >= 0) {
        return own_sample;
    }
    // No sample of this fine pixel is on that side: the border cuts off a corner of it. The next fine pixel
    // on that side has some.
    let neighbour_texel = texel + vec2<i32>(round(select(-normal, normal, nearer)));
    let first_texel = vec2<i32>(0, key_row() * i32(frame.edge_scale));
    let neighbour_sample = sample_on_side(
        clamp(
            neighbour_texel,
            first_texel,
            first_texel + vec2<i32>(frame.ideal_size_px) * i32(frame.edge_scale) - 1,
        ),
        quadrant,
        nearer,
        mid_depth,
    );
    if (neighbour_sample.index >= 0) {
        return neighbour_sample;
    }
    return FineSample(texel, quadrant);
}

// Sample on one side of a border, the given one if possible; index -1 if there is none.
fn sample_on_side(texel: vec2<i32>, first: i32, nearer: bool, mid_depth: f32) -> FineSample {
    for (var k = 0; k < 4; k++) {
        if ((textureLoad(fine_depth, texel, first ^ k) > mid_depth) == nearer) {
            return FineSample(texel, first ^ k);
        }
    }
    return FineSample(texel, -1);
}

fn is_edge_pixel(position_px: vec2<f32>) -> bool {
    let position = clamp(position_px + 0.5, vec2<f32>(0.0), vec2<f32>(frame.ideal_size_px) - 1e-3);
    return textureLoad(ideal_color, vec2<i32>(position) + vec2<i32>(0, key_row()), 0).a < 1.0;
}

// Inverse depth of the surface that is visible at a position, 1/m: from its sample in an edge pixel, since
// only edge pixels have valid samples; elsewhere there is one surface.
fn surface_inverse_depth(position_px: vec2<f32>) -> f32 {
    if (is_edge_pixel(position_px)) {
        let sample = fine_sample(position_px);
        return textureLoad(fine_depth, sample.texel, sample.index) / frame.near_m;
    }
    return inverse_depth(position_px);
}

// Subsample `i` of `frame.edge_samples`: position in the pixel, -0.5 to 0.5 (Hammersley points), and fraction of
// the exposure that has passed.
fn subsample(i: u32) -> vec3<f32> {
    let step = 1.0 / f32(frame.edge_samples);
    let x = (f32(i) + 0.5) * step;
    let y = f32(reverseBits(i) >> 8u) / 16777216.0 + 0.5 * step;
    return vec3<f32>(x - 0.5, y - 0.5, fract(GOLDEN * (f32(i) + 0.5)));
}

// Pose relative to the selected key at a fraction of the exposure; nodes are equally spaced in time.
fn pose_at_fraction(pixel: vec2<u32>, fraction: f32) -> Pose {
    if (fraction == 0.5) {
        return table_mid_pose(pixel);
    }
    let node_position = fraction * f32(frame.nodes - 1u);
    let node = min(u32(node_position), max(frame.nodes, 2u) - 2u);
    let pose = table_pose(pixel, node);
    if (unspecialised(frame.nodes) > 1u) {
        return mix_pose(pose, table_pose(pixel, node + 1u), node_position - f32(node));
    }
    return pose;
}

// Whether a pixel whose sources touch no edge pixel sees one surface. Where its parallax crosses a silhouette
// its corners are tested: if their rays hit what the plain gather sampled, one surface covers the pixel, and
// the spline samples that one better.
fn sees_one_surface(pixel: vec2<u32>, ray: Ray) -> bool {
    // Instants as in candidates.wgsl.
    let instants = select(1u, 3u, unspecialised(frame.nodes) > 1u);
    for (var i = 0u; i < instants; i++) {
        let pose = pose_at_fraction(pixel, select(0.5, 0.5 * f32(i), instants > 1u));
        if (is_near_silhouette(ray.uv, pose)) {
            for (var k = 0; k < 4; k++) {
                let uv = ray.uv + (f32(k & 1) - 0.5) * ray.d_dx + (f32(k >> 1u) - 0.5) * ray.d_dy;
                let hit = first_surface(uv, pose);
                if (
                    !hit.is_visible
                    || distance(hit.position_px, temporal_inverse(uv, pose).position_px) > PLAIN_PX
                ) {
                    return false;
                }
            }
        }
    }
    return true;
}

// Mean colour of the pixel's rays.
fn rays_color(pixel: vec2<u32>, ray: Ray) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    let samples = unspecialised(frame.edge_samples);
    for (var i = 0u; i < samples; i++) {
        let offset = subsample(i);
        let hit = first_surface_of_keys(pixel, ray.uv + offset.x * ray.d_dx + offset.y * ray.d_dy, offset.z);
        sum += surface_color_at(hit.position_px);
    }
    select_key_of_line(pixel);
    return sum / f32(frame.edge_samples);
}

// Point that the centre of a pixel sees: the hit of its central ray, in the key that shows it.
fn centre_hit(pixel: vec2<u32>, ray: Ray, fraction: f32) -> CentrePoint {
    let hit = first_surface_of_keys(pixel, ray.uv, fraction);
    let pose = pose_at_fraction(pixel, fraction);
    let w = interpolated_depth(ray.uv, pose, hit.line_inverse_depth);
    let point_in_key = point_at(ray.uv, pose, w);
    return centre_point(ideal_px_from_point(point_in_key), w, w / point_in_key.z);
}

fn silhouette_source_px(pixel: vec2<u32>, ray: Ray, phase: f32) -> vec2<f32> {
    select_key_of_line(pixel);
    if (!is_near_silhouette(ray.uv, pose_at_fraction(pixel, phase + 0.5))) {
        return smooth_source_px(pixel, ray, phase);
    }
    return centre_hit(pixel, ray, phase + 0.5).reference_px;
}

fn silhouette_centre_point(pixel: vec2<u32>, ray: Ray) -> CentrePoint {
    select_key_of_line(pixel);
    if (!is_near_silhouette(ray.uv, table_mid_pose(pixel))) {
        return smooth_centre_point(pixel, ray);
    }
    return centre_hit(pixel, ray, 0.5);
}

// Sample positions locate borders only to a few hundredths of a pixel, and disocclusions are in no key: an
// f64 ray on the CPU determines the truth there.
fn emit_centre_truth(pixel: vec2<u32>, ray: Ray) {
    select_key_of_line(pixel);
    if (!IS_EXACT) {
        emit_truth(
            pixel,
            pixel_truth(
                ray, silhouette_source_px(pixel, ray, coords_phase()), silhouette_centre_point(pixel, ray)
            ),
        );
    } else if (
        is_near_silhouette(ray.uv, table_mid_pose(pixel))
        || is_near_silhouette(ray.uv, pose_at_fraction(pixel, coords_phase() + 0.5))
    ) {
        emit_truth(pixel, unknown_truth(ray));
    }
}

struct SurfaceHit {
    // Position of its colour, ideal pixels of the selected key.
    position_px: vec2<f32>,
    // Inverse planar depth in the line's camera, 1/m.
    line_inverse_depth: f32,
    // False if the intersection is disoccluded: the key camera did not see it, and the surface seen beside it
    // replaces it.
    is_visible: bool,
}

// First intersection in the nearest key in time, or else in the next one that shows it. That key stays
// selected.
fn first_surface_of_keys(pixel: vec2<u32>, uv: vec2<f32>, fraction: f32) -> SurfaceHit {
    select_key_of_rank(pixel, fraction, 0u);
    let first = first_surface(uv, pose_at_fraction(pixel, fraction));
    if (first.is_visible) {
        return first;
    }
    for (var rank = 1u; rank < key_count(); rank++) {
        select_key_of_rank(pixel, fraction, rank);
        let hit = first_surface(uv, pose_at_fraction(pixel, fraction));
        if (hit.is_visible) {
            return hit;
        }
    }
    select_key_of_rank(pixel, fraction, 0u);
    return first;
}

struct SurfaceSample {
    position_px: vec2<f32>,
    // Inverse depth of the surface shown there, in the line's camera, 1/m.
    inverse_depth: f32,
}

fn sample_surface(uv: vec2<f32>, pose: Pose, w: f32) -> SurfaceSample {
    let position_px = ideal_px_from_point(point_at(uv, pose, w));
    return SurfaceSample(position_px, line_inverse_depth(uv, pose, surface_inverse_depth(position_px)));
}

// First intersection of a ray with the surfaces of the ideal frame. The points of the ray, from the nearest
// surface within reach to infinity, project to its epipolar line. As long as the point is nearer than the
// surface shown at its projection, the ray is free. Where it stops being free and the depths on both sides
// agree, it hits that surface. Where they differ, it passes behind an occluder. If it is still occluded at
// the depth of the last visible surface, its intersection is disoccluded, and that last visible surface
// replaces it.
//
// It is a state machine with one look-up in its loop: neighbouring rays are rarely in the same state, and the
// code stays small. MARCHING steps along the ray. BISECTING refines where it stops being free. VERIFYING
// tests whether a ray that is free at two steps, the second behind the first's surface, has crossed that
// surface in between: it has if the surface continues to where the ray reaches its depth.
fn first_surface(uv: vec2<f32>, pose: Pose) -> SurfaceHit {
    let far_px = ideal_px_from_point(point_at(uv, pose, 0.0));
    let w_near = nearest_inverse_depth(uv, pose, dilated_tile(far_px));
    let near_px = ideal_px_from_point(point_at(uv, pose, w_near));
    let px_per_w = distance(near_px, far_px) / max(w_near, 1e-12);
    if (px_per_w * w_near < GAP_PX) {
        // No occlusion is possible: one iteration from infinity is enough.
        let final_sample = sample_surface(
            uv, pose, line_inverse_depth(uv, pose, surface_inverse_depth(far_px))
        );
        return SurfaceHit(final_sample.position_px, final_sample.inverse_depth, true);
    }
    let steps = clamp(u32(ceil(px_per_w * w_near / STEP_PX)), 1u, MAX_LOOK_UPS);
    var state = MARCHING;
    var step = 0u;
    var halvings = 0u;
    var is_occluded = false;
    var w = w_near;
    var free = SurfaceSample(near_px, 0.0);
    var free_w = w;
    var behind_w = w;
    var behind_inverse_depth = 0.0;
    // Step to continue with if the verification fails.
    var next = free;
    var next_w = w;
    loop {
        let visible = sample_surface(uv, pose, w);
        if (state == VERIFYING) {
            if (
                abs(free.inverse_depth - visible.inverse_depth) * px_per_w < GAP_PX
                && inside_ideal(visible.position_px)
            ) {
                return SurfaceHit(visible.position_px, visible.inverse_depth, true);
            }
            free = next;
            free_w = next_w;
            state = select(MARCHING, BISECTING, halvings > 0u);
        } else if (w > visible.inverse_depth || step == 0u) {
            if (step > 0u && w <= free.inverse_depth) {
                if (is_occluded) {
                    break;
                }
                next = visible;
                next_w = w;
                w = free.inverse_depth;
                state = VERIFYING;
                continue;
            }
            free = visible;
            free_w = w;
            is_occluded = false;
        } else {
            behind_w = w;
            behind_inverse_depth = visible.inverse_depth;
            if (state == MARCHING && !is_occluded) {
                state = BISECTING;
                halvings = HALVINGS + 1u;
            } else if (state == MARCHING && w <= free.inverse_depth) {
                break;
            }
        }
        if (state == BISECTING) {
            halvings--;
            if (halvings > 0u) {
                w = 0.5 * (free_w + behind_w);
                continue;
            }
            if ((behind_inverse_depth - free.inverse_depth) * px_per_w < GAP_PX) {
                return SurfaceHit(free.position_px, free.inverse_depth, inside_ideal(free.position_px));
            }
            is_occluded = true;
            state = MARCHING;
            if (w_near * (1.0 - f32(step) / f32(steps)) <= free.inverse_depth) {
                break;
            }
        }
        step++;
        if (step > steps) {
            break;
        }
        // 0 at the last step.
        w = w_near * (1.0 - f32(step) / f32(steps));
    }
    return SurfaceHit(free.position_px, free.inverse_depth, false);
}

// Depth of the hit surface, from the interpolated depths of pixels that show no other surface: those are
// planes, not steps.
fn interpolated_depth(uv: vec2<f32>, pose: Pose, hit_inverse_depth: f32) -> f32 {
    let hit_px = ideal_px_from_point(point_at(uv, pose, hit_inverse_depth));
    if (ideal_color_at(hit_px).a < 0.9999) {
        return hit_inverse_depth;
    }
    let px_per_w = distance(hit_px, ideal_px_from_point(point_at(uv, pose, 0.0)))
        / max(hit_inverse_depth, 1e-12);
    var w = hit_inverse_depth;
    for (var i = 0u; i < 3u; i++) {
        w = line_inverse_depth(uv, pose, inverse_depth(ideal_px_from_point(point_at(uv, pose, w))));
    }
    return select(hit_inverse_depth, w, abs(w - hit_inverse_depth) * px_per_w < SAME_PX);
}
