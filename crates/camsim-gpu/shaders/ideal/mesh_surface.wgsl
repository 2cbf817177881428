// Placements and material of meshes.
#import ideal/surface.wgsl

struct MeshMaterial {
    // Emitted linear light; in w the alpha cut-off.
    emissive_cutoff: vec4<f32>,
    // Direction towards the sun (NED) times its strength; in w the strength of the sky.
    sun_sky: vec4<f32>,
}

@group(1) @binding(2) var<uniform> material: MeshMaterial;

// Rows of base_from_shape: a linear map, and in w the shape's origin relative to the base.
struct MeshPlacement {
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
}

@group(2) @binding(0) var<storage, read> placements: array<MeshPlacement>;

fn base_from_shape(instance: u32, position_m: vec3<f32>) -> vec3<f32> {
    let placement = placements[instance];
    let homogeneous = vec4<f32>(position_m, 1.0);
    return vec3<f32>(
        dot(placement.x, homogeneous), dot(placement.y, homogeneous), dot(placement.z, homogeneous)
    );
}

// Colour of a fragment: the `mesh_color` slot.
#import <slot:mesh_color>
