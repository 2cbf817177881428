// Exact relative pose, depth by fixed-point iteration. A point at planar depth z on the ray d = (u, v, 1) of
// the line's camera is z (R d + w t) in the key camera, w = 1/z. The key frame's inverse depth w_key there
// gives w = w_key (R d)_z / (1 - t_z w_key). Each look-up multiplies the error by about (parallax in px) *
// |grad w| / w; the first guess comes from a plane. Twin: camsim_core::temporal::reproject.
#import reverse/temporal_inverse/interface.wgsl
#import reverse/temporal_inverse/pose_table.wgsl
#import <slot:look_ups>

// Inverse depths after the last look-up, 1/m: in the key frame, and of the same point on the line's ray.
struct IteratedDepth {
    in_key: f32,
    on_line: f32,
}

// Inverse depth of the surface at the last look-up, 1/m. If that look-up finds the sky, the nearest surface
// within `frame.sky_reach_px` replaces it. The sky has one colour, so it may be read anywhere; a pixel beside
// a surface then stays beside that surface in the ideal frame, and the taps mix the two in the right
// proportion.
fn surface_at(position_px: vec2<f32>) -> f32 {
    let key_inverse_depth = inverse_depth(position_px);
    if (key_inverse_depth > 0.0) {
        return key_inverse_depth;
    }
    let reach = frame.sky_reach_px;
    let diagonal = 0.70710678 * reach;
    let along_axes = max(
        max(
            texel_depth(position_px + vec2<f32>(reach, 0.0)), texel_depth(position_px - vec2<f32>(reach, 0.0))
        ),
        max(
            texel_depth(position_px + vec2<f32>(0.0, reach)), texel_depth(position_px - vec2<f32>(0.0, reach))
        ),
    );
    let along_diagonals = max(
        max(
            texel_depth(position_px + vec2<f32>(diagonal, diagonal)),
            texel_depth(position_px - vec2<f32>(diagonal, diagonal)),
        ),
        max(
            texel_depth(position_px + vec2<f32>(diagonal, -diagonal)),
            texel_depth(position_px - vec2<f32>(diagonal, -diagonal)),
        ),
    );
    return max(along_axes, along_diagonals) * (1.0 / frame.near_m);
}

// Depth value of the texel that contains a position; positions outside are clamped to the frame's border.
fn texel_depth(position_px: vec2<f32>) -> f32 {
    let texel = vec2<i32>(
        clamp(floor(position_px + 0.5), vec2<f32>(0.0), vec2<f32>(frame.ideal_size_px) - 1.0)
    );
    return textureLoad(ideal_depth, texel + vec2<i32>(0, key_row()), 0).x;
}

// One more look-up.
fn look_up(direction: vec3<f32>, shift: vec3<f32>, previous: IteratedDepth) -> IteratedDepth {
    return iterated_depth_from_sample(
        direction, shift, previous, inverse_depth(ideal_px_from_point(direction + previous.on_line * shift))
    );
}

// The last look-up.
fn last_look_up(direction: vec3<f32>, shift: vec3<f32>, previous: IteratedDepth) -> IteratedDepth {
    return iterated_depth_from_sample(
        direction, shift, previous, surface_at(ideal_px_from_point(direction + previous.on_line * shift))
    );
}

fn iterated_depth_from_sample(
    direction: vec3<f32>,
    shift: vec3<f32>,
    previous: IteratedDepth,
    in_key: f32,
) -> IteratedDepth {
    return IteratedDepth(in_key, depth_on_line(direction, shift, in_key, previous.on_line));
}

// Inverse depth of the key frame's plane on the line's ray: n . z (R d + w t) = 1 gives w = n . R d / (1 - n
// . t). 0 beyond the plane's horizon, and where the line's camera is not in front of the plane.
fn plane_on_line(direction: vec3<f32>, shift: vec3<f32>) -> f32 {
    let plane = frame.planes[key_index()].xyz;
    let previous = 1.0 - dot(plane, shift);
    return select(0.0, max(dot(plane, direction), 0.0) / previous, previous > 1e-3);
}

// Iteration from the plane.
fn iterate_depth(direction: vec3<f32>, shift: vec3<f32>) -> IteratedDepth {
    return first_look_ups(direction, shift, IteratedDepth(0.0, plane_on_line(direction, shift)));
}

fn temporal_inverse(uv: vec2<f32>, pose: Pose) -> Source {
    let direction = rotate(pose, vec3<f32>(uv, 1.0));
    let shift = translation(pose);
    return source_at(direction, shift, iterate_depth(direction, shift).on_line);
}

// Inverse depth on the line's ray of a surface with this inverse depth in the key frame. At or behind the
// image plane of the line's camera `guess` is returned.
fn depth_on_line(direction: vec3<f32>, shift: vec3<f32>, key_inverse_depth: f32, guess: f32) -> f32 {
    let scale = 1.0 - shift.z * key_inverse_depth;
    return select(guess, key_inverse_depth * direction.z / scale, scale > 1e-3);
}

fn source_at(direction: vec3<f32>, shift: vec3<f32>, w: f32) -> Source {
    let point_in_key = direction + w * shift;
    let position_px = ideal_px_from_point(point_in_key);
    return Source(
        position_px, w, point_in_key.z > 0.0 && inside_ideal(position_px), ideal_px_from_point(direction)
    );
}

// Inverse depth in the key frame at the last look-up, 1/m.
fn iterated_inverse_depth(uv: vec2<f32>, pose: Pose) -> f32 {
    return iterate_depth(rotate(pose, vec3<f32>(uv, 1.0)), translation(pose)).in_key;
}

// As `iterated_inverse_depth`, with the first guess `guess` of the key frame's inverse depth, 1/m.
fn iterated_inverse_depth_from(guess: f32, uv: vec2<f32>, pose: Pose) -> f32 {
    let direction = rotate(pose, vec3<f32>(uv, 1.0));
    let shift = translation(pose);
    return further_look_ups(
        direction, shift, IteratedDepth(guess, depth_on_line(direction, shift, guess, 0.0))
    ).in_key;
}

// Source of a surface with this inverse depth in the key frame. (x, y, 1) z_key = z (R d + w t) with w =
// w_key (R d)_z / (1 - t_z w_key) is linear in w_key: (x, y) = (1 - t_z w_key) (R d)_xy / (R d)_z + w_key
// t_xy, which needs one division.
fn source_of_depth(uv: vec2<f32>, pose: Pose, key_inverse_depth: f32) -> Source {
    let direction = rotate(pose, vec3<f32>(uv, 1.0));
    let shift = translation(pose);
    let scale = 1.0 - shift.z * key_inverse_depth;
    let is_in_front = scale > 1e-3;
    let far = direction.xy * (1.0 / direction.z);
    let position_px = frame.ideal_focal_px * select(
        far, scale * far + key_inverse_depth * shift.xy, is_in_front
    ) + frame.ideal_principal_px;
    let far_px = frame.ideal_focal_px * far + frame.ideal_principal_px;
    return Source(
        position_px,
        depth_on_line(direction, shift, key_inverse_depth, 0.0),
        direction.z > 0.0 && inside_ideal(position_px),
        far_px,
    );
}

// The depth is looked up once more, at the final source: the last look-up of the iteration was at the source
// before.
fn temporal_inverse_with_depth(uv: vec2<f32>, pose: Pose) -> Source {
    var source = temporal_inverse(uv, pose);
    source.inverse_depth = line_inverse_depth(uv, pose, inverse_depth(source.position_px));
    return source;
}

const HAS_PARALLAX: bool = true;
// The source is exact.
const IS_EXACT: bool = true;

// Point at inverse planar depth w of a ray, in the key camera, times w.
fn point_at(uv: vec2<f32>, pose: Pose, w: f32) -> vec3<f32> {
    return rotate(pose, vec3<f32>(uv, 1.0)) + w * translation(pose);
}

// Inverse depth in the line's own camera of what the key camera sees at `key_inverse_depth` (1/m) at the
// ray's source.
fn line_inverse_depth(uv: vec2<f32>, pose: Pose, key_inverse_depth: f32) -> f32 {
    return key_inverse_depth * rotate(pose, vec3<f32>(uv, 1.0)).z
        / max(1.0 - translation(pose).z * key_inverse_depth, 1e-3);
}
