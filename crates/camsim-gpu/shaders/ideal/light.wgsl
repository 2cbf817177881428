// Illumination of meshes by sun and sky. Twin: camsim_core::scene::light.
#import ideal/mesh_surface.wgsl

// Unit normal of an instance in NED. Normals transform by the cofactor matrix: the inverse transpose up to a
// factor.
fn normal_ned_of(instance: u32, normal: vec3<f32>) -> vec3<f32> {
    let placement = placements[instance];
    let x = placement.x.xyz;
    let y = placement.y.xyz;
    let z = placement.z.xyz;
    let first = cross(y, z);
    let turned = vec3<f32>(dot(first, normal), dot(cross(z, x), normal), dot(cross(x, y), normal));
    // Where the shape is mirrored, its triangles change their winding, but its normals do not.
    let outward = select(turned, -turned, dot(x, first) < 0.0);
    // Normalised in two steps: the squares of a small model's cofactors would underflow.
    let largest = max(abs(outward.x), max(abs(outward.y), abs(outward.z)));
    let scaled = outward / max(largest, 1e-37);
    return scaled / max(length(scaled), 1e-20);
}

// Tint times illumination of the visible side. At pixels whose centre is outside of the triangle the
// extrapolated normal may be longer than 1.
fn illuminated(tint: vec4<f32>, normal_ned: vec3<f32>, is_front: bool) -> vec4<f32> {
    let normal = select(-normal_ned, normal_ned, is_front);
    let light = max(dot(normal, material.sun_sky.xyz), 0.0) + material.sun_sky.w * 0.5 * (1.0 - normal.z);
    return vec4<f32>(tint.rgb * clamp(light, 0.0, 1.0), tint.a);
}
