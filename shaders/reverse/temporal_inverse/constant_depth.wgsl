// The paper's displacement (eqs. 10 to 18): the camera keeps the twist that it has at the key instant, and a
// pixel keeps the depth that the ideal frame has at its own place (the `depth` slot says how it is read).
// What fills the slot says how `displaced` integrates that.
#import reverse/temporal_inverse/interface.wgsl
#import reverse/temporal_inverse/line_entry.wgsl

// A line's instant.
struct Pose {
    // After the key instant.
    dt_s: f32,
}

@group(1) @binding(3) var<storage, read> line_dt_s: array<f32>;

fn pose_at_node(pixel: vec2<u32>, node: u32) -> Pose {
    return Pose(line_dt_s[line_entry(pixel) + node]);
}

fn pose_mid(pixel: vec2<u32>) -> Pose {
    return Pose(line_dt_s[line_entry(pixel) + select(frame.nodes, 0u, frame.nodes == 1u)]);
}

fn mix_pose(a: Pose, b: Pose, t: f32) -> Pose {
    return Pose(mix(a.dt_s, b.dt_s, t));
}

// d(u, v)/dt of a world point seen at uv with inverse depth w: it stands still and moves by -V - W x r in the
// camera. Twin: camsim_core::temporal::displacement::image_rate.
fn image_rate(uv: vec2<f32>, w: f32) -> vec2<f32> {
    let point_rate = -w * frame.key_velocity_m_s.xyz - cross(frame.key_rate_rad_s.xyz, vec3<f32>(uv, 1.0));
    return point_rate.xy - uv * point_rate.z;
}

fn temporal_inverse(uv: vec2<f32>, pose: Pose) -> Source {
    let found = constant_depth(frame.ideal_focal_px * uv + frame.ideal_principal_px);
    let at_px = frame.ideal_focal_px * displaced(uv, found, pose.dt_s) + frame.ideal_principal_px;
    let far_px = ideal_px_from_point(point_at(uv, pose, 0.0));
    return Source(at_px, found, inside_ideal(at_px), far_px);
}

// A pixel keeps the depth of its own place only to find where it looks. The depth that it reports is what the
// ideal frame has there, less what the camera's twist takes from it until the line's instant.
fn temporal_inverse_with_depth(uv: vec2<f32>, pose: Pose) -> Source {
    var source = temporal_inverse(uv, pose);
    let in_key = inverse_depth(source.at_px);
    let seen = (source.at_px - frame.ideal_principal_px) / frame.ideal_focal_px;
    let z_rate = -in_key * frame.key_velocity_m_s.z - cross(frame.key_rate_rad_s.xyz, vec3<f32>(seen, 1.0)).z;
    source.inverse_depth = in_key / max(1.0 + pose.dt_s * z_rate, 1e-3);
    return source;
}

const HAS_PARALLAX: bool = true;
// Where it looks is not where the point truly is.
const IS_EXACT: bool = false;

fn point_at(uv: vec2<f32>, pose: Pose, w: f32) -> vec3<f32> {
    return vec3<f32>(displaced(uv, w, pose.dt_s), 1.0);
}

// Depth is constant.
fn line_inverse_depth(uv: vec2<f32>, pose: Pose, in_key: f32) -> f32 {
    return in_key;
}
