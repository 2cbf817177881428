// Triangle meshes: positions relative to the mesh's own origin.
#import ideal/surface.wgsl

struct MeshPlacement {
    // Mesh origin minus the whole-metre base.
    origin_from_base_m: vec4<f32>,
}

@group(1) @binding(2) var<uniform> placement: MeshPlacement;

@vertex
fn vertex(@location(0) position_m: vec3<f32>, @location(1) uv: vec2<f32>) -> Surface {
    return project_surface(placement.origin_from_base_m.xyz + position_m, uv);
}
