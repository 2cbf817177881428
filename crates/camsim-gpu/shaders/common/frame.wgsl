// Uniforms of one frame. Mirror of `camsim_plan::uniforms::FrameUniforms`; a test compares the offsets.
struct Frame {
    // Size of the output frame, pixels.
    size_px: vec2<u32>,
    // Size, focal length and principal point of the ideal frame, in its own pixels (integer = pixel centre).
    ideal_size_px: vec2<u32>,
    ideal_focal_px: vec2<f32>,
    ideal_principal_px: vec2<f32>,
    // Focal length and principal point of the output camera, pixels. Used if there is no lens map.
    focal_px: vec2<f32>,
    principal_px: vec2<f32>,
    // Depth buffer value = near_m / z.
    near_m: f32,
    // Number of exposure nodes per line; 1 = no blur. With more than one, the mid-exposure pose follows the
    // nodes in the pose table.
    nodes: u32,
    // Sensor lines: 0 = rows, 1 = columns.
    line_axis: u32,
    // Number of lines of one field in the pose table, and number of fields (2 only for sideways readout with
    // interlacing).
    lines: u32,
    fields: u32,
    // Number of depth look-ups of the temporal inverse.
    iterations: u32,
    // Exposure samples per pixel of path length (one per pixel beyond 16 px), and their maximum number.
    samples_per_px: f32,
    max_samples: u32,
    // Maximum number of taps along each axis of the footprint.
    max_taps: u32,
    // Exposure phase in [-0.5, 0.5] at which coords are reported (0 = mid-exposure).
    coords_phase: f32,
    // Photometric stage: brightness factor, standard deviation of the noise, thresholds of the vignette, seed
    // of the noise.
    light: f32,
    noise_sigma: f32,
    vignette_thresholds: vec2<f32>,
    seed: vec2<u32>,
    frame_number: u32,
    // 1: all three channels have the luminance.
    mono: u32,
    // The path joins every `node_stride`-th exposure node.
    node_stride: u32,
    // Supersampled ideal frame: number of fine pixels along a side of an ideal pixel, and number of
    // silhouette rays per output pixel (at least 1 where a kernel traces any).
    edge_scale: u32,
    edge_samples: u32,
    // Largest rotation per step of the rk2 solver, radians.
    rk2_step_rad: f32,
    // Tangential coefficients p1 p2 of the lens, for the lens inverse of the paper preset.
    lens_tangential: vec2<f32>,
    // Mid-window camera in the world, for coords: NED position, and the columns of ned_from_key.
    key_position_ned_m: vec4<f32>,
    ned_from_key_x: vec4<f32>,
    ned_from_key_y: vec4<f32>,
    ned_from_key_z: vec4<f32>,
    // Motion of the key camera in its own axes, for the solvers that assume constant twist: velocity of the
    // optical centre; angular rate, with its norm in w.
    key_velocity_m_s: vec4<f32>,
    key_rate_rad_s: vec4<f32>,
    // Radial coefficients k1 k2 k3 of the lens.
    lens_radial: vec3<f32>,
    // Largest value after the photometric stage: 1, or any before an image sensor.
    most: f32,
    // Linear fog of the paper preset, applied after the gather: sRGB-encoded colour, and 1 / (distance of
    // full fog) in w, 0 = no fog.
    linear_fog: vec4<f32>,
    // Several ideal frames: their number, and the distance in rows from one to the next in their textures.
    keys: u32,
    key_rows: u32,
    pad1: f32,
    // Radius within which a surface replaces the sky at the last depth look-up, pixels of the ideal frame
    // (docs/theory/ACCURACY.md, "Skylines").
    sky_reach_px: f32,
    // Plane per ideal frame, at which the depth iteration starts: its inverse planar depth is the dot product
    // with (u, v, 1), 1/m.
    planes: array<vec4<f32>, 4>,
}

@group(0) @binding(0) var<uniform> frame_uniforms: Frame;

// Copy of the uniforms, made at the start of each kernel: llvmpipe reads each member of a uniform buffer lane
// by lane inside a loop or condition (docs/theory/DECISIONS.md, "Gpu renderer").
var<private> frame: Frame;
