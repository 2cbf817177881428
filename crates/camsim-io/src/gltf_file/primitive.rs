//! Reads a primitive as a shape, with morph targets and skinning applied.

use std::{
    cell::Cell,
    ops::{Add, Mul},
};

use camsim_core::scene::{MeshVertex, Shape, light::transformed_normal};
use glam::{DAffine3, DMat3, DVec3};
use gltf::{
    Semantic,
    accessor::{DataType, Dimensions::*},
    mesh::Mode,
};

use super::{GltfError, accessor, asset::Asset, material::VertexRule, normals};

/// Topology of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TriangleMode {
    List,
    Strip,
    Fan,
}

/// The topology; `None` for points and lines.
pub(super) fn triangle_mode(mode: Mode) -> Option<TriangleMode> {
    match mode {
        Mode::Triangles => Some(TriangleMode::List),
        Mode::TriangleStrip => Some(TriangleMode::Strip),
        Mode::TriangleFan => Some(TriangleMode::Fan),
        _ => None,
    }
}

fn is_index(accessor: &gltf::Accessor<'_>) -> bool {
    accessor.dimensions() == Scalar
        && matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32)
}

/// Reads one primitive as a shape.
pub(super) struct ShapeReader<'a> {
    pub asset: &'a Asset,
    /// Mesh of the primitive.
    pub mesh: &'a gltf::Mesh<'a>,
    pub triangle_mode: TriangleMode,
    /// Whether the node's transform mirrors: then triangles are reversed.
    pub is_mirrored: bool,
    pub rule: &'a VertexRule,
    /// Weights of the morph targets.
    pub weights: &'a [f64],
    /// Joint matrices: from the bind pose to the model's axes.
    pub joints: Option<&'a [DAffine3]>,
    /// Whether the shape gets normals, because light falls on it.
    pub with_normals: bool,
    /// Set to true if a vertex colour is outside of 0 to 1.
    pub has_clamped_colors: &'a Cell<bool>,
}

impl ShapeReader<'_> {
    /// The shape in its own axes, or, if skinned, in the model's.
    pub fn shape(&self, primitive: &gltf::Primitive<'_>) -> Result<Shape, GltfError> {
        let positions = self.positions(primitive)?;
        let count = positions.len();
        let attribute = |semantic: &Semantic| -> Result<Option<Vec<[f64; 4]>>, GltfError> {
            let Some(accessor) = primitive.get(semantic) else { return Ok(None) };
            self.check_dimensions(primitive, semantic, &accessor)?;
            let rows = accessor::vectors(self.asset, &accessor)?;
            if rows.len() == count {
                Ok(Some(rows))
            } else {
                Err(self.error(primitive, "its attributes have different numbers of elements"))
            }
        };
        let uvs = attribute(&Semantic::TexCoords(self.rule.set))?;
        let colors = if self.rule.uses_vertex_colors { attribute(&Semantic::Colors(0))? } else { None };
        let has_alpha =
            primitive.get(&Semantic::Colors(0)).is_some_and(|accessor| accessor.dimensions() == Vec4);
        let vertex = |(i, position): (usize, &DVec3)| {
            let [u, v] = uvs.as_ref().map_or([0.0; 2], |rows| [rows[i][0], rows[i][1]]);
            let [r, g, b, a] = colors.as_ref().map_or([1.0; 4], |rows| rows[i]);
            let color = [r, g, b, if has_alpha { a } else { 1.0 }];
            if color.iter().any(|part| !(0.0..=1.0).contains(part)) {
                self.has_clamped_colors.set(true);
            }
            let tint = std::array::from_fn(|k| (color[k] as f32 * self.rule.factor[k]).clamp(0.0, 1.0));
            MeshVertex { position_m: position.as_vec3().to_array(), uv: self.rule.transform_uv([u, v]), tint }
        };
        let vertices: Vec<MeshVertex> = positions.iter().enumerate().map(vertex).collect();
        if vertices.iter().any(|vertex| {
            !vertex.position_m.iter().chain(&vertex.uv).chain(&vertex.tint).all(|part| part.is_finite())
        }) {
            return Err(
                self.error(primitive, "a position, texture coordinate or colour is not a finite number")
            );
        }
        let indices = self.indices(primitive, count)?;
        let file_normals = if self.with_normals { self.file_normals(primitive, count)? } else { None };
        Ok(match file_normals {
            Some(file_normals) => {
                let normals = normals::normalized(file_normals, &vertices, &indices, self.is_mirrored);
                Shape { vertices, indices, normals }
            }
            None if self.with_normals => normals::with_flat_normals(&vertices, &indices, self.is_mirrored),
            None => Shape { vertices, indices, normals: Vec::new() },
        })
    }

    /// Texture coordinates of each vertex by another rule than the shape's own.
    pub fn uvs(
        &self,
        primitive: &gltf::Primitive<'_>,
        rule: &VertexRule,
        count: usize,
    ) -> Result<Vec<[f32; 2]>, GltfError> {
        let semantic = Semantic::TexCoords(rule.set);
        let Some(accessor) = primitive.get(&semantic) else {
            return Ok(vec![rule.transform_uv([0.0; 2]); count]);
        };
        self.check_dimensions(primitive, &semantic, &accessor)?;
        let uvs: Vec<[f32; 2]> = accessor::vectors(self.asset, &accessor)?
            .iter()
            .map(|row| rule.transform_uv([row[0], row[1]]))
            .collect();
        if uvs.len() != count {
            return Err(self.error(primitive, "its attributes have different numbers of elements"));
        }
        if uvs.iter().flatten().any(|part| !part.is_finite()) {
            return Err(self.error(primitive, "a texture coordinate is not a finite number"));
        }
        Ok(uvs)
    }

    /// The file's normals, of any length; `None` if it has none.
    fn file_normals(
        &self,
        primitive: &gltf::Primitive<'_>,
        count: usize,
    ) -> Result<Option<Vec<DVec3>>, GltfError> {
        let Some(accessor) = primitive.get(&Semantic::Normals) else { return Ok(None) };
        self.check_dimensions(primitive, &Semantic::Normals, &accessor)?;
        let mut normals = self.morphed(primitive, &accessor, |target| target.normals())?;
        if normals.len() != count {
            return Err(self.error(primitive, "its attributes have different numbers of elements"));
        }
        if let Some(joints) = self.joints {
            let matrices =
                self.blended_by_joints(primitive, joints, count, DMat3::ZERO, |joint, _| joint.matrix3)?;
            normals.iter_mut().zip(matrices).filter(|(_, (_, weight))| *weight > 0.0).for_each(
                |(normal, (matrix, _))| {
                    *normal = transformed_normal(&matrix, *normal);
                },
            );
        }
        Ok(Some(normals))
    }

    /// An attribute's vectors plus the weighted morph targets.
    fn morphed<'a>(
        &self,
        primitive: &gltf::Primitive<'a>,
        accessor: &gltf::Accessor<'_>,
        attribute: impl Fn(&gltf::mesh::MorphTarget<'a>) -> Option<gltf::Accessor<'a>>,
    ) -> Result<Vec<DVec3>, GltfError> {
        let vector = |[x, y, z, _]: [f64; 4]| DVec3::new(x, y, z);
        let mut vectors: Vec<DVec3> =
            accessor::vectors(self.asset, accessor)?.into_iter().map(vector).collect();
        for (target, &weight) in
            primitive.morph_targets().zip(self.weights).filter(|(_, weight)| **weight != 0.0)
        {
            let Some(accessor) = attribute(&target) else { continue };
            let displacements = accessor::vectors(self.asset, &accessor)?;
            if displacements.len() != vectors.len() {
                return Err(self.error(primitive, "a morph target has another number of elements"));
            }
            vectors
                .iter_mut()
                .zip(displacements)
                .for_each(|(sum, displacement)| *sum += weight * vector(displacement));
        }
        Ok(vectors)
    }

    /// Refuses an accessor whose type the attribute cannot have.
    fn check_dimensions(
        &self,
        primitive: &gltf::Primitive<'_>,
        semantic: &Semantic,
        accessor: &gltf::Accessor<'_>,
    ) -> Result<(), GltfError> {
        let dimensions = accessor.dimensions();
        let is_valid = match semantic {
            Semantic::Positions | Semantic::Normals => dimensions == Vec3,
            Semantic::TexCoords(_) => dimensions == Vec2,
            Semantic::Colors(_) => matches!(dimensions, Vec3 | Vec4),
            _ => dimensions == Vec4,
        };
        let number = accessor.index();
        let message = || {
            format!("accessors.{number} has type {dimensions:?}, which {} cannot have", semantic.to_string())
        };
        if is_valid { Ok(()) } else { Err(self.error(primitive, &message())) }
    }

    fn error(&self, primitive: &gltf::Primitive<'_>, message: &str) -> GltfError {
        self.asset.error(format!("meshes.{}.primitives.{}: {message}", self.mesh.index(), primitive.index()))
    }

    fn positions(&self, primitive: &gltf::Primitive<'_>) -> Result<Vec<DVec3>, GltfError> {
        let Some(accessor) = primitive.get(&Semantic::Positions) else { return Ok(Vec::new()) };
        self.check_dimensions(primitive, &Semantic::Positions, &accessor)?;
        let mut positions = self.morphed(primitive, &accessor, |target| target.positions())?;
        if let Some(joints) = self.joints {
            self.skin_positions(primitive, joints, &mut positions)?;
        }
        Ok(positions)
    }

    fn skin_positions(
        &self,
        primitive: &gltf::Primitive<'_>,
        joints: &[DAffine3],
        positions: &mut [DVec3],
    ) -> Result<(), GltfError> {
        let skinned =
            self.blended_by_joints(primitive, joints, positions.len(), DVec3::ZERO, |joint, vertex| {
                joint.transform_point3(positions[vertex])
            })?;
        positions
            .iter_mut()
            .zip(skinned)
            .filter(|(_, (_, weight))| *weight > 0.0)
            .for_each(|(position, (sum, weight))| *position = sum / weight);
        Ok(())
    }

    /// For each vertex, the sum over its joints of weight times `by_joint(joint, vertex)`, and the sum of the
    /// weights. A vertex has up to four joints in each set of JOINTS_n and WEIGHTS_n.
    fn blended_by_joints<T>(
        &self,
        primitive: &gltf::Primitive<'_>,
        joints: &[DAffine3],
        count: usize,
        zero: T,
        by_joint: impl Fn(&DAffine3, usize) -> T,
    ) -> Result<Vec<(T, f64)>, GltfError>
    where
        T: Copy + Add<Output = T>,
        f64: Mul<T, Output = T>,
    {
        let mut sums = vec![(zero, 0.0); count];
        for set in 0.. {
            let (Some(joint_accessor), Some(weight_accessor)) =
                (primitive.get(&Semantic::Joints(set)), primitive.get(&Semantic::Weights(set)))
            else {
                break;
            };
            self.check_dimensions(primitive, &Semantic::Joints(set), &joint_accessor)?;
            self.check_dimensions(primitive, &Semantic::Weights(set), &weight_accessor)?;
            let joint_indices = accessor::vectors(self.asset, &joint_accessor)?;
            let weights = accessor::vectors(self.asset, &weight_accessor)?;
            if joint_indices.len() != count || weights.len() != count {
                return Err(self.error(primitive, "its joints or weights have another number of elements"));
            }
            for (i, sum) in sums.iter_mut().enumerate() {
                for k in (0..4).filter(|&k| weights[i][k] > 0.0) {
                    let joint = joints.get(joint_indices[i][k] as usize).ok_or_else(|| {
                        self.error(primitive, "refers to a joint that its skin does not have")
                    })?;
                    *sum = (sum.0 + weights[i][k] * by_joint(joint, i), sum.1 + weights[i][k]);
                }
            }
        }
        Ok(sums)
    }

    /// Vertex indices of a list of triangles, without degenerate ones.
    fn indices(&self, primitive: &gltf::Primitive<'_>, count: usize) -> Result<Vec<u32>, GltfError> {
        let all: Vec<u32> = match primitive.indices() {
            None => (0..count as u32).collect(),
            Some(accessor) if !is_index(&accessor) => {
                let (number, component, dimensions) =
                    (accessor.index(), accessor.data_type(), accessor.dimensions());
                return Err(self.error(
                    primitive,
                    &format!(
                        "accessors.{number} has type {dimensions:?} of {component:?}: indices must be scalar \
                         unsigned integers"
                    ),
                ));
            }
            Some(accessor) => {
                accessor::numbers(self.asset, &accessor)?.into_iter().map(|index| index as u32).collect()
            }
        };
        if let Some(index) = all.iter().find(|&&index| index as usize >= count) {
            return Err(
                self.error(primitive, &format!("an index is {index}, but there are {count} vertices"))
            );
        }
        let triangles: Vec<[u32; 3]> = match self.triangle_mode {
            TriangleMode::List => all.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            // Every other triangle of a strip has the opposite winding.
            TriangleMode::Strip => {
                let wound = |(k, t): (usize, &[u32])| {
                    if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] }
                };
                all.windows(3).enumerate().map(wound).collect()
            }
            TriangleMode::Fan => {
                all.get(1..).unwrap_or_default().windows(2).map(|t| [t[0], t[1], all[0]]).collect()
            }
        };
        let reversed = |[a, b, c]: [u32; 3]| if self.is_mirrored { [a, c, b] } else { [a, b, c] };
        Ok(triangles.into_iter().filter(|[a, b, c]| a != b && b != c && a != c).flat_map(reversed).collect())
    }
}
