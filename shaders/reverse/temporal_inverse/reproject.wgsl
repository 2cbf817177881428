// Exact relative pose, depth by fixed-point iteration.
// A point at planar depth z on the ray d = (u, v, 1) of the line's camera is z (R d + w t) in the key camera, w = 1/z.
// The key frame's depth there, 1/w_key, gives w = w_key (R d)_z / (1 - t_z w_key). The error shrinks by about
// (parallax in px) * |grad w| / w with each look-up.
// Twin: camsim_core::temporal::reproject.
#import reverse/temporal_inverse/interface.wgsl
#import reverse/temporal_inverse/pose_table.wgsl

fn temporal_inverse(uv: vec2<f32>, pose: Pose) -> Source {
    let direction = rotate(pose, vec3<f32>(uv, 1.0));
    let shift = translation(pose);
    var w = 0.0;
    for (var i = 0u; i < frame.iterations; i++) {
        let found = inverse_depth(ideal_px_from_point(direction + w * shift));
        let scale = 1.0 - shift.z * found;
        // The surface is at or behind the line's own image plane: keep the last guess.
        if (scale > 1e-3) {
            w = found * direction.z / scale;
        }
    }
    let in_key = direction + w * shift;
    let at_px = ideal_px_from_point(in_key);
    return Source(at_px, w, in_key.z > 0.0 && inside_ideal(at_px));
}

fn temporal_inverse_with_depth(uv: vec2<f32>, pose: Pose) -> Source {
    return temporal_inverse(uv, pose);
}

const HAS_PARALLAX: bool = true;

// The point at inverse planar depth w of a ray, in the key camera, times w.
fn point_at(uv: vec2<f32>, pose: Pose, w: f32) -> vec3<f32> {
    return rotate(pose, vec3<f32>(uv, 1.0)) + w * translation(pose);
}

// The inverse depth that the line's own camera gives to what the key camera sees at `in_key` (1/m) where the ray looks.
fn line_inverse_depth(uv: vec2<f32>, pose: Pose, in_key: f32) -> f32 {
    return in_key * rotate(pose, vec3<f32>(uv, 1.0)).z / max(1.0 - translation(pose).z * in_key, 1e-3);
}
