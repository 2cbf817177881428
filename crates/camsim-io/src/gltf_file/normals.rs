//! Normals for light: those of a file, and those of flat triangles where it has none (glTF 2.0, section
//! 3.7.2.1).
//!
//! They point to the side from which the file's triangles are counter-clockwise. The triangles of a mirroring
//! node have been reversed before (`is_mirrored`), so that their normals are negated here.

use std::collections::HashMap;

use camsim_core::scene::{MeshVertex, Shape};
use glam::{DVec3, Vec3};

/// Normals are rounded to this step, so that triangles of one plane have equal normals and share vertices.
const STEP: f64 = 1.0 / (1 << 20) as f64;

/// A shape whose triangles have the normals of their planes; vertices between planes are duplicated.
pub(super) fn with_flat_normals(vertices: &[MeshVertex], indices: &[u32], is_mirrored: bool) -> Shape {
    let mut shape = Shape::default();
    let mut index_of = HashMap::new();
    for triangle in indices.chunks_exact(3) {
        let normal = area_normal(vertices, triangle, is_mirrored).normalize_or_zero();
        let normal = (normal / STEP).round() * STEP;
        for &corner in triangle {
            let next = shape.vertices.len() as u32;
            let index = *index_of
                .entry((corner, normal.to_array().map(|part| (part + 0.0).to_bits())))
                .or_insert(next);
            if index == next {
                shape.vertices.push(vertices[corner as usize]);
                shape.normals.push(normal.as_vec3().to_array());
            }
            shape.indices.push(index);
        }
    }
    shape
}

/// The file's normals at unit length. One of length 0 or not finite becomes the area-weighted mean of the
/// adjacent triangles' normals.
pub(super) fn normalized(
    file_normals: Vec<DVec3>,
    vertices: &[MeshVertex],
    indices: &[u32],
    is_mirrored: bool,
) -> Vec<[f32; 3]> {
    let mut normals: Vec<Option<DVec3>> = file_normals.into_iter().map(DVec3::try_normalize).collect();
    if normals.iter().any(Option::is_none) {
        let mut sums = vec![DVec3::ZERO; vertices.len()];
        for triangle in indices.chunks_exact(3) {
            let normal = area_normal(vertices, triangle, is_mirrored);
            triangle.iter().for_each(|&corner| sums[corner as usize] += normal);
        }
        normals
            .iter_mut()
            .zip(sums)
            .for_each(|(normal, sum)| *normal = normal.or(Some(sum.normalize_or_zero())));
    }
    normals.into_iter().map(|normal| normal.unwrap_or_default().as_vec3().to_array()).collect()
}

/// Normal of a triangle, as long as twice its area.
fn area_normal(vertices: &[MeshVertex], triangle: &[u32], is_mirrored: bool) -> DVec3 {
    let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(vertices[triangle[k] as usize].position_m).as_dvec3());
    let normal = (b - a).cross(c - a);
    if is_mirrored { -normal } else { normal }
}
