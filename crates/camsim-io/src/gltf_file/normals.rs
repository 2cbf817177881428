//! Normals for light: those of a file, and those of flat triangles where it has none (glTF 2.0, section
//! 3.7.2.1).
//!
//! They point outwards as the file's triangles turn. Where a mesh mirrors its triangles are turned back
//! beforehand, so that those turn the other way.

use std::collections::HashMap;

use camsim_core::scene::{MeshVertex, Shape};
use glam::{DVec3, Vec3};

/// Normals of one plane's triangles are equal when rounded to this: their corners can then be shared.
const STEP: f64 = 1.0 / (1 << 20) as f64;

/// Each triangle with the normal of its plane; corners between planes become several.
pub(super) fn flat(vertices: &[MeshVertex], indices: &[u32], mirrored: bool) -> Shape {
    let mut shape = Shape::default();
    let mut known = HashMap::new();
    for triangle in indices.chunks_exact(3) {
        let normal = across(vertices, triangle, mirrored).normalize_or_zero();
        let normal = (normal / STEP).round() * STEP;
        for &corner in triangle {
            let next = shape.vertices.len() as u32;
            let index =
                *known.entry((corner, normal.to_array().map(|part| (part + 0.0).to_bits()))).or_insert(next);
            if index == next {
                shape.vertices.push(vertices[corner as usize]);
                shape.normals.push(normal.as_vec3().to_array());
            }
            shape.indices.push(index);
        }
    }
    shape
}

/// Given normals at unit length; one that has none, or is no number, is the mean of the triangles around it.
pub(super) fn mended(
    given: Vec<DVec3>,
    vertices: &[MeshVertex],
    indices: &[u32],
    mirrored: bool,
) -> Vec<[f32; 3]> {
    let mut normals: Vec<Option<DVec3>> = given.into_iter().map(DVec3::try_normalize).collect();
    if normals.iter().any(Option::is_none) {
        let mut sums = vec![DVec3::ZERO; vertices.len()];
        for triangle in indices.chunks_exact(3) {
            let normal = across(vertices, triangle, mirrored);
            triangle.iter().for_each(|&corner| sums[corner as usize] += normal);
        }
        normals
            .iter_mut()
            .zip(sums)
            .for_each(|(normal, sum)| *normal = normal.or(Some(sum.normalize_or_zero())));
    }
    normals.into_iter().map(|normal| normal.unwrap_or_default().as_vec3().to_array()).collect()
}

/// Normal of a triangle, twice its area long.
fn across(vertices: &[MeshVertex], triangle: &[u32], mirrored: bool) -> DVec3 {
    let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(vertices[triangle[k] as usize].position_m).as_dvec3());
    let normal = (b - a).cross(c - a);
    if mirrored { -normal } else { normal }
}
