// The paper's displacement (eqs. 10 to 18): the camera keeps the twist of the key instant, and a pixel keeps
// the depth that the ideal frame has at its own position (the `depth` slot). The file that fills the
// `temporal_inverse` slot defines `displaced_uv`, which integrates the motion.
#import reverse/temporal_inverse/interface.wgsl
#import reverse/temporal_inverse/line_entry.wgsl

// Instant of a line.
struct Pose {
    // Time since the key instant.
    dt_s: f32,
}

@group(1) @binding(3) var<storage, read> line_dt_s: array<f32>;

fn table_pose(pixel: vec2<u32>, node: u32) -> Pose {
    return Pose(line_dt_s[line_entry(pixel) + node]);
}

fn table_mid_pose(pixel: vec2<u32>) -> Pose {
    return Pose(line_dt_s[line_entry(pixel) + select(frame.nodes, 0u, frame.nodes == 1u)]);
}

fn mix_pose(a: Pose, b: Pose, t: f32) -> Pose {
    return Pose(mix(a.dt_s, b.dt_s, t));
}

// d(u, v)/dt of a static world point at uv with inverse depth w: in the camera it moves by -V - W x r. Twin:
// camsim_core::temporal::displacement::image_rate.
fn image_rate(uv: vec2<f32>, w: f32) -> vec2<f32> {
    let point_rate = -w * frame.key_velocity_m_s.xyz - cross(frame.key_rate_rad_s.xyz, vec3<f32>(uv, 1.0));
    return point_rate.xy - uv * point_rate.z;
}

fn temporal_inverse(uv: vec2<f32>, pose: Pose) -> Source {
    let w = constant_depth(frame.ideal_focal_px * uv + frame.ideal_principal_px);
    let position_px = frame.ideal_focal_px * displaced_uv(uv, w, pose.dt_s) + frame.ideal_principal_px;
    let far_px = ideal_px_from_point(point_at(uv, pose, 0.0));
    return Source(position_px, w, inside_ideal(position_px), far_px);
}

// The depth at the pixel's own position serves only to find the source. The reported depth is that of the
// ideal frame at the source, minus the change by the camera's twist until the line's instant.
fn temporal_inverse_with_depth(uv: vec2<f32>, pose: Pose) -> Source {
    var source = temporal_inverse(uv, pose);
    let key_inverse_depth = inverse_depth(source.position_px);
    let uv_in_key = (source.position_px - frame.ideal_principal_px) / frame.ideal_focal_px;
    let z_rate = -key_inverse_depth * frame.key_velocity_m_s.z
        - cross(frame.key_rate_rad_s.xyz, vec3<f32>(uv_in_key, 1.0)).z;
    source.inverse_depth = key_inverse_depth / max(1.0 + pose.dt_s * z_rate, 1e-3);
    return source;
}

const HAS_PARALLAX: bool = true;
// The source is an approximation.
const IS_EXACT: bool = false;

fn point_at(uv: vec2<f32>, pose: Pose, w: f32) -> vec3<f32> {
    return vec3<f32>(displaced_uv(uv, w, pose.dt_s), 1.0);
}

// Depth is taken as constant.
fn line_inverse_depth(uv: vec2<f32>, pose: Pose, key_inverse_depth: f32) -> f32 {
    return key_inverse_depth;
}
