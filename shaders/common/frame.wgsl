// Uniforms of one frame. Mirrors `camsim_gpu::layout::FrameUniforms`; a test compares the offsets.
struct Frame {
    // Output size.
    size_px: vec2<u32>,
    // Ideal frame: size, focal length and principal point in its own pixels (integer = pixel centre).
    ideal_size_px: vec2<u32>,
    ideal_focal_px: vec2<f32>,
    ideal_principal_px: vec2<f32>,
    // Output camera: used when there is no lens map.
    focal_px: vec2<f32>,
    principal_px: vec2<f32>,
    // Depth buffer value = near_m / z.
    near_m: f32,
    // Poses of a line over the exposure; 1 = no blur. With more than one, the mid-exposure pose follows the
    // nodes.
    nodes: u32,
    // 0: lines are rows, 1: lines are columns.
    line_axis: u32,
    // Lines of one field in the pose table, and fields (2 only for sideways readout with interlacing).
    lines: u32,
    fields: u32,
    // Depth look-ups of the temporal inverse.
    iterations: u32,
    // Blur samples for each pixel of path length, beyond-16-px rule, and their cap.
    samples_per_px: f32,
    max_samples: u32,
    // Footprint taps per axis at most.
    max_taps: u32,
    // Exposure phase in [-0.5, 0.5] at which coords are reported (0 = mid-exposure).
    coords_phase: f32,
    // Photometric.
    light: f32,
    noise_sigma: f32,
    vignette_thresholds: vec2<f32>,
    seed: vec2<u32>,
    frame_number: u32,
    // 1: one luminance value for all three channels.
    mono: u32,
    // The path over the exposure goes through every so many poses.
    node_stride: u32,
    // Supersampled ideal frame: fine pixels along a side of an ideal pixel; rays of an output pixel that sees
    // a silhouette.
    edge_scale: u32,
    edge_samples: u32,
    // Largest rotation of a step of the rk2 solver.
    rk2_step_rad: f32,
    // p1 p2 of the lens, for the lens inverse of the paper preset.
    lens_tangential: vec2<f32>,
    // Mid-window camera in the world, for coords: NED position and the columns of ned_from_key.
    key_position_ned_m: vec4<f32>,
    ned_from_key_x: vec4<f32>,
    ned_from_key_y: vec4<f32>,
    ned_from_key_z: vec4<f32>,
    // The key camera's motion in its own axes, for the solvers that take it as constant: velocity of the
    // optical centre; angular rate, and its length in w.
    key_velocity_m_s: vec4<f32>,
    key_rate_rad_s: vec4<f32>,
    // k1 k2 k3 of the lens.
    lens_radial: vec3<f32>,
    pad0: u32,
    // Fog after the gather: its colour as stored, and 1 / the distance from which on there is nothing else (0
    // = clear).
    linear_fog: vec4<f32>,
    // Several ideal frames: their number, rows from one to the next in their textures, and the exposure as a
    // share of the window.
    keys: u32,
    key_rows: u32,
    exposure_share: f32,
    // Where a look-up of depth finds the sky, a surface so far away stands for it, pixels of the ideal frame
    // (docs/ACCURACY.md, "Skylines").
    sky_reach_px: f32,
    // Of each ideal frame: the plane that look-ups of depth begin with, whose inverse planar depth is the
    // product with (u, v, 1), 1/m.
    planes: array<vec4<f32>, 4>,
}

@group(0) @binding(0) var<uniform> given_frame: Frame;

// What the kernels read, copied where they begin: llvmpipe reads each number of a uniform buffer lane by lane
// where a loop or condition stands around it (docs/DECISIONS.md, "Gpu renderer").
var<private> frame: Frame;
