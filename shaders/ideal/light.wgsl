// Sun and sky on a mesh. Twin: camsim_core::scene::light.
#import ideal/mesh_surface.wgsl

// Where a normal in a shape's axes points once the shape stands, unit length. By cofactors: the inverse's
// transpose but for the length.
fn turned_normal(instance: u32, normal: vec3<f32>) -> vec3<f32> {
    let placement = placements[instance];
    let x = placement.x.xyz;
    let y = placement.y.xyz;
    let z = placement.z.xyz;
    let first = cross(y, z);
    let turned = vec3<f32>(dot(first, normal), dot(cross(z, x), normal), dot(cross(x, y), normal));
    // Mirrored triangles are turned back; their normals are not.
    let outward = select(turned, -turned, dot(x, first) < 0.0);
    // In two steps: squares of a small model's cofactors would vanish.
    let largest = max(abs(outward.x), max(abs(outward.y), abs(outward.z)));
    let scaled = outward / max(largest, 1e-37);
    return scaled / max(length(scaled), 1e-20);
}

// A tint in the light on the side that is seen. A pixel whose centre is beside its triangle has a normal that
// may be longer than 1.
fn lit(tint: vec4<f32>, normal_ned: vec3<f32>, is_front: bool) -> vec4<f32> {
    let normal = select(-normal_ned, normal_ned, is_front);
    let light = max(dot(normal, material.sun_sky.xyz), 0.0) + material.sun_sky.w * 0.5 * (1.0 - normal.z);
    return vec4<f32>(tint.rgb * clamp(light, 0.0, 1.0), tint.a);
}
