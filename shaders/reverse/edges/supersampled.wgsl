// Pixels that see a silhouette: rays of their own over the pixel's area and exposure, each with its own pose
// and depth, and each with the colour of the one surface of the ideal frame that it meets, so that surfaces
// never mix but by area and time. Twin: camsim_core::temporal::silhouette_rays.
#import ideal/fine.wgsl
#import reverse/edges/near.wgsl
#import <slot:surface_color>

@group(1) @binding(6) var fine_depth: texture_depth_multisampled_2d;
// Borders of two surfaces within the fine pixels of marked pixels: see ideal/lines.wgsl.
@group(1) @binding(7) var fine_lines: texture_2d<u32>;

// Golden ratio: multiples are even over an interval for any number of them.
const GOLDEN: f32 = 0.6180339887;
// Distance of two looks along the parallax of a ray, ideal pixels, while they are no more than MAX_LOOKS.
const LOOK_PX: f32 = 0.5;
// Halvings of the distance in which a ray stops being free.
const HALVINGS: u32 = 5u;
// What a look of the search is for.
const MARCHING: u32 = 0u;
const HALVING: u32 = 1u;
const ASKING: u32 = 2u;
// A step of depth that moves a surface by less than this, in ideal pixels of parallax, hides nothing.
const GAP_PX: f32 = 0.1;
// A ray that ends this near to the plain gather's source has met the same, ideal pixels.
const PLAIN_PX: f32 = 0.25;
// Depths that agree to within this, in the same measure, are of one surface.
const SAME_PX: f32 = 0.25;

struct FineSample {
    texel: vec2<i32>,
    index: i32,
}

// The sample that stands for a place: the one of its quarter of the fine pixel; where a border of two
// surfaces runs through the fine pixel, one of the surface on the place's side.
fn fine_sample(at_px: vec2<f32>) -> FineSample {
    let last = vec2<f32>(frame.ideal_size_px) - 1e-3;
    let at = clamp(at_px + 0.5, vec2<f32>(0.0), last) * f32(frame.edge_scale);
    let corner = floor(at);
    let half = vec2<i32>(2.0 * (at - corner));
    let texel = vec2<i32>(corner) + vec2<i32>(0, key_row() * i32(frame.edge_scale));
    let quarter = half.x + 2 * half.y;
    var line = vec2<u32>(0u);
    if (textureLoad(ideal_color, texel / i32(frame.edge_scale), 0).a < 1.0) {
        line = textureLoad(fine_lines, texel, 0).xy;
    }
    if (line.x == 0u) {
        return FineSample(texel, quarter);
    }
    let scaled = unpack2x16snorm(line.x);
    let length = length(scaled);
    let normal = scaled / length;
    let nearer = dot(normal, at - corner - 0.5) > 4.0 * length - 2.0;
    let between = bitcast<f32>(line.y);
    let own = of_side(texel, quarter, nearer, between);
    if (own.index >= 0) {
        return own;
    }
    // None of the pixel's own: a corner of it that the border cuts off. The next pixel on that side has some.
    let beside = texel + vec2<i32>(round(select(-normal, normal, nearer)));
    let top = vec2<i32>(0, key_row() * i32(frame.edge_scale));
    let found = of_side(clamp(beside, top, top + vec2<i32>(frame.ideal_size_px) * i32(frame.edge_scale) - 1), quarter, nearer, between);
    if (found.index >= 0) {
        return found;
    }
    return FineSample(texel, quarter);
}

// A sample on one side of a border, the given one if possible; index -1 if there is none.
fn of_side(texel: vec2<i32>, first: i32, nearer: bool, between: f32) -> FineSample {
    for (var k = 0; k < 4; k++) {
        if ((textureLoad(fine_depth, texel, first ^ k) > between) == nearer) {
            return FineSample(texel, first ^ k);
        }
    }
    return FineSample(texel, -1);
}

fn is_marked(at_px: vec2<f32>) -> bool {
    let at = clamp(at_px + 0.5, vec2<f32>(0.0), vec2<f32>(frame.ideal_size_px) - 1e-3);
    return textureLoad(ideal_color, vec2<i32>(at) + vec2<i32>(0, key_row()), 0).a < 1.0;
}

// Of the surface that is seen at a place: its sample's in a marked pixel, which alone has samples; elsewhere
// one surface is around.
fn surface_inverse_depth(at_px: vec2<f32>) -> f32 {
    if (is_marked(at_px)) {
        let s = fine_sample(at_px);
        return textureLoad(fine_depth, s.texel, s.index) / frame.near_m;
    }
    return inverse_depth(at_px);
}

// Ray i of `frame.edge_samples`: place in the pixel, from -0.5 to 0.5 (Hammersley's points), and share of the
// exposure gone by.
fn ray_place(i: u32) -> vec3<f32> {
    let step = 1.0 / f32(frame.edge_samples);
    let x = (f32(i) + 0.5) * step;
    let y = f32(reverseBits(i) >> 8u) / 16777216.0 + 0.5 * step;
    return vec3<f32>(x - 0.5, y - 0.5, fract(GOLDEN * (f32(i) + 0.5)));
}

// Pose in the chosen key at a share of the exposure; nodes are equally far apart in time.
fn pose_along(pixel: vec2<u32>, share: f32) -> Pose {
    if (share == 0.5) {
        return pose_mid(pixel);
    }
    let along = share * f32(frame.nodes - 1u);
    let node = min(u32(along), max(frame.nodes, 2u) - 2u);
    let pose = pose_at_node(pixel, node);
    if (told(frame.nodes) > 1u) {
        return mix_pose(pose, pose_at_node(pixel, node + 1u), along - f32(node));
    }
    return pose;
}

// Of a pixel whose sources pass no mark: whether nothing moves into it either. Where its parallax passes a
// silhouette its corners are asked: rays that meet what the plain gather took saw one surface all over the
// pixel, and that one is better read by the spline.
fn sees_one_surface(pixel: vec2<u32>, ray: Ray) -> bool {
    // As in candidates.wgsl.
    let instants = select(1u, 3u, told(frame.nodes) > 1u);
    for (var i = 0u; i < instants; i++) {
        let pose = pose_along(pixel, select(0.5, 0.5 * f32(i), instants > 1u));
        if (near_edge(ray.uv, pose)) {
            for (var k = 0; k < 4; k++) {
                let uv = ray.uv + (f32(k & 1) - 0.5) * ray.d_dx + (f32(k >> 1u) - 0.5) * ray.d_dy;
                let met = first_surface(uv, pose);
                if (!met.seen || distance(met.at_px, temporal_inverse(uv, pose).at_px) > PLAIN_PX) {
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
    let samples = told(frame.edge_samples);
    for (var i = 0u; i < samples; i++) {
        let place = ray_place(i);
        let found = first_surface_of_keys(pixel, ray.uv + place.x * ray.d_dx + place.y * ray.d_dy, place.z);
        sum += surface_color_at(found.at_px);
    }
    use_key_of_line(pixel);
    return sum / f32(frame.edge_samples);
}

// What the centre of a pixel sees: the pixel's own ray, in the key that sees its end.
fn centre_seen(pixel: vec2<u32>, ray: Ray, share: f32) -> Seen {
    let met = first_surface_of_keys(pixel, ray.uv, share);
    let pose = pose_along(pixel, share);
    let w = smooth_depth(ray.uv, pose, met.in_line);
    let in_key = point_at(ray.uv, pose, w);
    return seen_from(ideal_px_from_point(in_key), w, w / in_key.z);
}

fn seen_px_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> vec2<f32> {
    use_key_of_line(pixel);
    if (!near_edge(ray.uv, pose_along(pixel, phase + 0.5))) {
        return smooth_px_at_phase(pixel, ray, phase);
    }
    return centre_seen(pixel, ray, phase + 0.5).reference_px;
}

fn seen_mid(pixel: vec2<u32>, ray: Ray) -> Seen {
    use_key_of_line(pixel);
    if (!near_edge(ray.uv, pose_mid(pixel))) {
        return smooth_mid(pixel, ray);
    }
    return centre_seen(pixel, ray, 0.5);
}

// Samples know where a surface ends to a few hundredths of a pixel, and keys do not show all of it: a ray in
// f64 knows.
fn emit_centre(pixel: vec2<u32>, ray: Ray) {
    use_key_of_line(pixel);
    if (!IS_EXACT) {
        emit_truth(pixel, truth_of(ray, seen_px_at_phase(pixel, ray, coords_phase()), seen_mid(pixel, ray)));
    } else if (near_edge(ray.uv, pose_mid(pixel)) || near_edge(ray.uv, pose_along(pixel, coords_phase() + 0.5))) {
        emit_truth(pixel, unknown_truth(ray));
    }
}

struct Met {
    // Where the colour of what the ray meets is, ideal pixels of the chosen key.
    at_px: vec2<f32>,
    // Inverse planar depth of the meeting point in the line's camera, 1/m.
    in_line: f32,
    // False: the key did not see what the ray meets, and what it saw beside it stands in.
    seen: bool,
}

// In the key that is nearest in time, or in the next that sees what the ray meets: that key is chosen
// afterwards.
fn first_surface_of_keys(pixel: vec2<u32>, uv: vec2<f32>, share: f32) -> Met {
    use_key_of_rank(pixel, share, 0u);
    let first = first_surface(uv, pose_along(pixel, share));
    if (first.seen) {
        return first;
    }
    for (var rank = 1u; rank < key_count(); rank++) {
        use_key_of_rank(pixel, share, rank);
        let found = first_surface(uv, pose_along(pixel, share));
        if (found.seen) {
            return found;
        }
    }
    use_key_of_rank(pixel, share, 0u);
    return first;
}

struct Look {
    at_px: vec2<f32>,
    // Inverse depth that the line's camera gives to what the key shows there.
    found: f32,
}

fn look_at(uv: vec2<f32>, pose: Pose, w: f32) -> Look {
    let at_px = ideal_px_from_point(point_at(uv, pose, w));
    return Look(at_px, line_inverse_depth(uv, pose, surface_inverse_depth(at_px)));
}

// Where a ray first meets a surface of the ideal frame. The ray's points, from the nearest surface within
// reach to infinity, lie on a line of the ideal frame: as long as they are nearer than what the key shows at
// their places the ray is free. Where it is free no longer and the depths to both sides are one, it meets a
// surface. Where they are not, it passes behind something; if it is still hidden when it gets as deep as what
// was seen last, it has met what the key camera does not see, and what was seen last stands in.
//
// Written as one loop with one look, whatever the look is for: neighbouring rays are rarely at the same point
// of the search, and the code stays small. MARCHING goes on by steps; HALVING finds where the ray stops being
// free; ASKING looks whether a ray that is free at two looks, the second deeper than what the first saw, has
// met that in between: it has if the surface goes on to where the ray is as deep.
fn first_surface(uv: vec2<f32>, pose: Pose) -> Met {
    let far_px = ideal_px_from_point(point_at(uv, pose, 0.0));
    let w_near = nearest_inverse_depth(uv, pose, reach_of(far_px));
    let near_px = ideal_px_from_point(point_at(uv, pose, w_near));
    let px_per_w = distance(near_px, far_px) / max(w_near, 1e-12);
    if (px_per_w * w_near < GAP_PX) {
        // Nothing hides: one step from the far end.
        let there = look_at(uv, pose, line_inverse_depth(uv, pose, surface_inverse_depth(far_px)));
        return Met(there.at_px, there.found, true);
    }
    let looks = clamp(u32(ceil(px_per_w * w_near / LOOK_PX)), 1u, MAX_LOOKS);
    var goal = MARCHING;
    var taken = 0u;
    var halvings = 0u;
    var hidden = false;
    var w = w_near;
    var free = Look(near_px, 0.0);
    var free_w = w;
    var behind_w = w;
    var behind_found = 0.0;
    // What to go on with if the question is denied.
    var next = free;
    var next_w = w;
    loop {
        let here = look_at(uv, pose, w);
        if (goal == ASKING) {
            if (abs(free.found - here.found) * px_per_w < GAP_PX && inside_ideal(here.at_px)) {
                return Met(here.at_px, here.found, true);
            }
            free = next;
            free_w = next_w;
            goal = select(MARCHING, HALVING, halvings > 0u);
        } else if (w > here.found || taken == 0u) {
            if (taken > 0u && w <= free.found) {
                if (hidden) {
                    break;
                }
                next = here;
                next_w = w;
                w = free.found;
                goal = ASKING;
                continue;
            }
            free = here;
            free_w = w;
            hidden = false;
        } else {
            behind_w = w;
            behind_found = here.found;
            if (goal == MARCHING && !hidden) {
                goal = HALVING;
                halvings = HALVINGS + 1u;
            } else if (goal == MARCHING && w <= free.found) {
                break;
            }
        }
        if (goal == HALVING) {
            halvings--;
            if (halvings > 0u) {
                w = 0.5 * (free_w + behind_w);
                continue;
            }
            if ((behind_found - free.found) * px_per_w < GAP_PX) {
                return Met(free.at_px, free.found, inside_ideal(free.at_px));
            }
            hidden = true;
            goal = MARCHING;
            if (w_near * (1.0 - f32(taken) / f32(looks)) <= free.found) {
                break;
            }
        }
        taken++;
        if (taken > looks) {
            break;
        }
        // 0 at the last.
        w = w_near * (1.0 - f32(taken) / f32(looks));
    }
    return Met(free.at_px, free.found, false);
}

// The surface that is met, from the depths of pixels that show no other: those are planes and not steps.
fn smooth_depth(uv: vec2<f32>, pose: Pose, met: f32) -> f32 {
    let met_px = ideal_px_from_point(point_at(uv, pose, met));
    if (ideal_color_at(met_px).a < 0.9999) {
        return met;
    }
    let px_per_w = distance(met_px, ideal_px_from_point(point_at(uv, pose, 0.0))) / max(met, 1e-12);
    var w = met;
    for (var i = 0u; i < 3u; i++) {
        w = line_inverse_depth(uv, pose, inverse_depth(ideal_px_from_point(point_at(uv, pose, w))));
    }
    return select(met, w, abs(w - met) * px_per_w < SAME_PX);
}
