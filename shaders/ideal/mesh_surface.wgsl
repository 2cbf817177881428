// Where meshes stand, and what is on them.
#import ideal/surface.wgsl

struct MeshMaterial {
    // Light of its own; alpha below which there is a hole.
    emissive_cutoff: vec4<f32>,
    // Towards the sun, NED, times its strength; the sky's.
    sun_sky: vec4<f32>,
}

@group(1) @binding(2) var<uniform> material: MeshMaterial;

// Rows of base_from_shape: turn, then the shape's origin minus the whole-metre base.
struct MeshPlacement {
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
}

@group(2) @binding(0) var<storage, read> placements: array<MeshPlacement>;

fn base_from_shape(instance: u32, position_m: vec3<f32>) -> vec3<f32> {
    let placement = placements[instance];
    let at = vec4<f32>(position_m, 1.0);
    return vec3<f32>(dot(placement.x, at), dot(placement.y, at), dot(placement.z, at));
}

// What arrives from it: the `mesh_color` slot.
#import <slot:mesh_color>
