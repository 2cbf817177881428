// Exact relative pose, depth by fixed-point iteration. A point at planar depth z on the ray d = (u, v, 1) of
// the line's camera is z (R d + w t) in the key camera, w = 1/z. The key frame's depth there, 1/w_key, gives
// w = w_key (R d)_z / (1 - t_z w_key). The error shrinks by about (parallax in px) * |grad w| / w with each
// look-up, beginning with that of a plane. Twin: camsim_core::temporal::reproject.
#import reverse/temporal_inverse/interface.wgsl
#import reverse/temporal_inverse/pose_table.wgsl
#import <slot:looks>

// Inverse depths after the last look-up, 1/m: what the key frame has there, and what that is on the line's
// ray.
struct Settled {
    in_key: f32,
    on_line: f32,
}

// Inverse depth of the surface that the last look-up finds, 1/m. Where it finds the sky, that of the nearest
// surface of those within reach: the sky is of one colour, so that it may be read anywhere, and a pixel
// beside a surface that reads where it is beside that surface in the ideal frame mixes the two as it should.
fn surface_at(at_px: vec2<f32>) -> f32 {
    let found = inverse_depth(at_px);
    if (found > 0.0) {
        return found;
    }
    let reach = frame.sky_reach_px;
    let aslant = 0.70710678 * reach;
    let along_axes = max(
        max(depth_of_texel(at_px + vec2<f32>(reach, 0.0)), depth_of_texel(at_px - vec2<f32>(reach, 0.0))),
        max(depth_of_texel(at_px + vec2<f32>(0.0, reach)), depth_of_texel(at_px - vec2<f32>(0.0, reach))),
    );
    let between_them = max(
        max(depth_of_texel(at_px + vec2<f32>(aslant, aslant)), depth_of_texel(at_px - vec2<f32>(aslant, aslant))),
        max(depth_of_texel(at_px + vec2<f32>(aslant, -aslant)), depth_of_texel(at_px - vec2<f32>(aslant, -aslant))),
    );
    return max(along_axes, between_them) * (1.0 / frame.near_m);
}

// Reversed depth of the texel that a place is in; places outside go to the frame's border.
fn depth_of_texel(at_px: vec2<f32>) -> f32 {
    let texel = vec2<i32>(clamp(floor(at_px + 0.5), vec2<f32>(0.0), vec2<f32>(frame.ideal_size_px) - 1.0));
    return textureLoad(ideal_depth, texel + vec2<i32>(0, key_row()), 0).x;
}

// One look-up further.
fn look(direction: vec3<f32>, shift: vec3<f32>, before: Settled) -> Settled {
    return settled_at(direction, shift, before, inverse_depth(ideal_px_from_point(direction + before.on_line * shift)));
}

// The last one.
fn last_look(direction: vec3<f32>, shift: vec3<f32>, before: Settled) -> Settled {
    return settled_at(direction, shift, before, surface_at(ideal_px_from_point(direction + before.on_line * shift)));
}

fn settled_at(direction: vec3<f32>, shift: vec3<f32>, before: Settled, in_key: f32) -> Settled {
    return Settled(in_key, depth_on_line(direction, shift, in_key, before.on_line));
}

// Inverse depth of the key frame's plane on the line's ray: n . z (R d + w t) = 1 gives w = n . R d / (1 - n
// . t). 0 beyond its horizon and where the line's camera is not before it.
fn plane_on_line(direction: vec3<f32>, shift: vec3<f32>) -> f32 {
    let plane = frame.planes[key_number()].xyz;
    let before = 1.0 - dot(plane, shift);
    return select(0.0, max(dot(plane, direction), 0.0) / before, before > 1e-3);
}

// Beginning with the plane.
fn settle(direction: vec3<f32>, shift: vec3<f32>) -> Settled {
    return first_looks(direction, shift, Settled(0.0, plane_on_line(direction, shift)));
}

fn temporal_inverse(uv: vec2<f32>, pose: Pose) -> Source {
    let direction = rotate(pose, vec3<f32>(uv, 1.0));
    let shift = translation(pose);
    return source_at(direction, shift, settle(direction, shift).on_line);
}

// The inverse depth on the line's ray of what the key frame has the inverse depth `found` of. At or behind
// the line's own image plane the last guess is kept.
fn depth_on_line(direction: vec3<f32>, shift: vec3<f32>, found: f32, guess: f32) -> f32 {
    let scale = 1.0 - shift.z * found;
    return select(guess, found * direction.z / scale, scale > 1e-3);
}

fn source_at(direction: vec3<f32>, shift: vec3<f32>, w: f32) -> Source {
    let in_key = direction + w * shift;
    let at_px = ideal_px_from_point(in_key);
    return Source(at_px, w, in_key.z > 0.0 && inside_ideal(at_px), ideal_px_from_point(direction));
}

// The key frame's inverse depth that the last look-up finds, 1/m.
fn settled_inverse_depth(uv: vec2<f32>, pose: Pose) -> f32 {
    return settle(rotate(pose, vec3<f32>(uv, 1.0)), translation(pose)).in_key;
}

// The same where the key frame is taken to have `guess` there at first, 1/m.
fn settled_inverse_depth_from(guess: f32, uv: vec2<f32>, pose: Pose) -> f32 {
    let direction = rotate(pose, vec3<f32>(uv, 1.0));
    let shift = translation(pose);
    return further_looks(direction, shift, Settled(guess, depth_on_line(direction, shift, guess, 0.0))).in_key;
}

// Where a surface of this inverse depth in the key frame is seen: (x, y, 1) z_key = z (R d + w t) with w =
// w_key (R d)_z / (1 - t_z w_key) is linear in w_key, (x, y) = (1 - t_z w_key) (R d)_xy / (R d)_z + w_key
// t_xy, so that one division does.
fn source_of_depth(uv: vec2<f32>, pose: Pose, found: f32) -> Source {
    let direction = rotate(pose, vec3<f32>(uv, 1.0));
    let shift = translation(pose);
    let scale = 1.0 - shift.z * found;
    let is_before = scale > 1e-3;
    let far = direction.xy * (1.0 / direction.z);
    let at_px = frame.ideal_focal_px * select(far, scale * far + found * shift.xy, is_before) + frame.ideal_principal_px;
    let far_px = frame.ideal_focal_px * far + frame.ideal_principal_px;
    return Source(at_px, depth_on_line(direction, shift, found, 0.0), direction.z > 0.0 && inside_ideal(at_px), far_px);
}

// The depth is looked up once more, where the ray at last looks: what led there was found one look-up
// earlier.
fn temporal_inverse_with_depth(uv: vec2<f32>, pose: Pose) -> Source {
    var source = temporal_inverse(uv, pose);
    source.inverse_depth = line_inverse_depth(uv, pose, inverse_depth(source.at_px));
    return source;
}

const HAS_PARALLAX: bool = true;
// It looks where the point truly is.
const IS_EXACT: bool = true;

// The point at inverse planar depth w of a ray, in the key camera, times w.
fn point_at(uv: vec2<f32>, pose: Pose, w: f32) -> vec3<f32> {
    return rotate(pose, vec3<f32>(uv, 1.0)) + w * translation(pose);
}

// The inverse depth that the line's own camera gives to what the key camera sees at `in_key` (1/m) where the
// ray looks.
fn line_inverse_depth(uv: vec2<f32>, pose: Pose, in_key: f32) -> f32 {
    return in_key * rotate(pose, vec3<f32>(uv, 1.0)).z / max(1.0 - translation(pose).z * in_key, 1e-3);
}
