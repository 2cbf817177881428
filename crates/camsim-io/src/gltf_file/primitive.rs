//! A primitive's triangles, with morph targets and skin applied.

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

use super::{GltfError, accessor, material::UvRule, normals, source::Source};

/// How indices make triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Triangles {
    List,
    Strip,
    Fan,
}

/// `None` for points and lines.
pub(super) fn triangle_mode(mode: Mode) -> Option<Triangles> {
    match mode {
        Mode::Triangles => Some(Triangles::List),
        Mode::TriangleStrip => Some(Triangles::Strip),
        Mode::TriangleFan => Some(Triangles::Fan),
        _ => None,
    }
}

fn is_index(accessor: &gltf::Accessor<'_>) -> bool {
    accessor.dimensions() == Scalar
        && matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32)
}

/// What a primitive becomes a shape by.
pub(super) struct Making<'a> {
    pub source: &'a Source,
    /// Which it is of.
    pub mesh: &'a gltf::Mesh<'a>,
    pub triangles: Triangles,
    /// Whether what it is placed by turns it inside out: its triangles are turned back.
    pub mirrored: bool,
    pub uv: &'a UvRule,
    /// Of morph targets.
    pub weights: &'a [f64],
    /// From the bound shape to the model, by joint.
    pub joints: Option<&'a [DAffine3]>,
    /// Whether light will fall on it.
    pub normals: bool,
    /// Becomes true where a vertex colour is not within 0 to 1.
    pub beyond: &'a Cell<bool>,
}

impl Making<'_> {
    pub fn shape(&self, primitive: &gltf::Primitive<'_>) -> Result<Shape, GltfError> {
        let positions = self.positions(primitive)?;
        let count = positions.len();
        let of = |semantic: &Semantic| -> Result<Option<Vec<[f64; 4]>>, GltfError> {
            let Some(accessor) = primitive.get(semantic) else { return Ok(None) };
            self.check(primitive, semantic, &accessor)?;
            let rows = accessor::rows(self.source, &accessor)?;
            if rows.len() == count {
                Ok(Some(rows))
            } else {
                Err(self.wrong(primitive, "its attributes have different numbers of elements"))
            }
        };
        let uvs = of(&Semantic::TexCoords(self.uv.set))?;
        let colors = if self.uv.vertex_colors { of(&Semantic::Colors(0))? } else { None };
        let with_alpha =
            primitive.get(&Semantic::Colors(0)).is_some_and(|accessor| accessor.dimensions() == Vec4);
        let vertex = |(i, position): (usize, &DVec3)| {
            let [u, v] = uvs.as_ref().map_or([0.0; 2], |rows| [rows[i][0], rows[i][1]]);
            let [r, g, b, a] = colors.as_ref().map_or([1.0; 4], |rows| rows[i]);
            let color = [r, g, b, if with_alpha { a } else { 1.0 }];
            if color.iter().any(|part| !(0.0..=1.0).contains(part)) {
                self.beyond.set(true);
            }
            let tint = std::array::from_fn(|k| (color[k] as f32 * self.uv.factor[k]).clamp(0.0, 1.0));
            MeshVertex { position_m: position.as_vec3().to_array(), uv: self.uv.apply([u, v]), tint }
        };
        let vertices: Vec<MeshVertex> = positions.iter().enumerate().map(vertex).collect();
        if vertices.iter().any(|vertex| {
            !vertex.position_m.iter().chain(&vertex.uv).chain(&vertex.tint).all(|part| part.is_finite())
        }) {
            return Err(
                self.wrong(primitive, "a position, texture coordinate or colour is not a finite number")
            );
        }
        let indices = self.indices(primitive, count)?;
        let given = if self.normals { self.given_normals(primitive, count)? } else { None };
        Ok(match given {
            Some(given) => {
                let normals = normals::mended(given, &vertices, &indices, self.mirrored);
                Shape { vertices, indices, normals }
            }
            None if self.normals => normals::flat(&vertices, &indices, self.mirrored),
            None => Shape { vertices, indices, normals: Vec::new() },
        })
    }

    /// Texture coordinates of each corner by another rule than the shape's own.
    pub fn uvs(
        &self,
        primitive: &gltf::Primitive<'_>,
        rule: &UvRule,
        count: usize,
    ) -> Result<Vec<[f32; 2]>, GltfError> {
        let semantic = Semantic::TexCoords(rule.set);
        let Some(accessor) = primitive.get(&semantic) else { return Ok(vec![rule.apply([0.0; 2]); count]) };
        self.check(primitive, &semantic, &accessor)?;
        let uvs: Vec<[f32; 2]> =
            accessor::rows(self.source, &accessor)?.iter().map(|row| rule.apply([row[0], row[1]])).collect();
        if uvs.len() != count {
            return Err(self.wrong(primitive, "its attributes have different numbers of elements"));
        }
        if uvs.iter().flatten().any(|part| !part.is_finite()) {
            return Err(self.wrong(primitive, "a texture coordinate is not a finite number"));
        }
        Ok(uvs)
    }

    /// The file's own normals, of any length.
    fn given_normals(
        &self,
        primitive: &gltf::Primitive<'_>,
        count: usize,
    ) -> Result<Option<Vec<DVec3>>, GltfError> {
        let Some(accessor) = primitive.get(&Semantic::Normals) else { return Ok(None) };
        self.check(primitive, &Semantic::Normals, &accessor)?;
        let mut normals = self.morphed(primitive, &accessor, |target| target.normals())?;
        if normals.len() != count {
            return Err(self.wrong(primitive, "its attributes have different numbers of elements"));
        }
        if let Some(joints) = self.joints {
            let matrices = self.blended(primitive, joints, count, DMat3::ZERO, |joint, _| joint.matrix3)?;
            normals.iter_mut().zip(matrices).filter(|(_, (_, weight))| *weight > 0.0).for_each(
                |(normal, (matrix, _))| {
                    *normal = transformed_normal(&matrix, *normal);
                },
            );
        }
        Ok(Some(normals))
    }

    /// Vectors, each with what the morph targets add to it.
    fn morphed<'a>(
        &self,
        primitive: &gltf::Primitive<'a>,
        accessor: &gltf::Accessor<'_>,
        of: impl Fn(&gltf::mesh::MorphTarget<'a>) -> Option<gltf::Accessor<'a>>,
    ) -> Result<Vec<DVec3>, GltfError> {
        let vector = |[x, y, z, _]: [f64; 4]| DVec3::new(x, y, z);
        let mut vectors: Vec<DVec3> =
            accessor::rows(self.source, accessor)?.into_iter().map(vector).collect();
        for (target, &weight) in
            primitive.morph_targets().zip(self.weights).filter(|(_, weight)| **weight != 0.0)
        {
            let Some(accessor) = of(&target) else { continue };
            let shifts = accessor::rows(self.source, &accessor)?;
            if shifts.len() != vectors.len() {
                return Err(self.wrong(primitive, "a morph target has another number of elements"));
            }
            vectors.iter_mut().zip(shifts).for_each(|(sum, shift)| *sum += weight * vector(shift));
        }
        Ok(vectors)
    }

    /// Refuses what is not of as many numbers as its meaning has.
    fn check(
        &self,
        primitive: &gltf::Primitive<'_>,
        semantic: &Semantic,
        accessor: &gltf::Accessor<'_>,
    ) -> Result<(), GltfError> {
        let found = accessor.dimensions();
        let fits = match semantic {
            Semantic::Positions | Semantic::Normals => found == Vec3,
            Semantic::TexCoords(_) => found == Vec2,
            Semantic::Colors(_) => matches!(found, Vec3 | Vec4),
            _ => found == Vec4,
        };
        let number = accessor.index();
        let message =
            || format!("accessors.{number} is of {found:?}, which is nothing for {}", semantic.to_string());
        if fits { Ok(()) } else { Err(self.wrong(primitive, &message())) }
    }

    fn wrong(&self, primitive: &gltf::Primitive<'_>, message: &str) -> GltfError {
        self.source.broken(format!(
            "meshes.{}.primitives.{}: {message}",
            self.mesh.index(),
            primitive.index()
        ))
    }

    fn positions(&self, primitive: &gltf::Primitive<'_>) -> Result<Vec<DVec3>, GltfError> {
        let Some(accessor) = primitive.get(&Semantic::Positions) else { return Ok(Vec::new()) };
        self.check(primitive, &Semantic::Positions, &accessor)?;
        let mut positions = self.morphed(primitive, &accessor, |target| target.positions())?;
        if let Some(joints) = self.joints {
            self.bend(primitive, joints, &mut positions)?;
        }
        Ok(positions)
    }

    fn bend(
        &self,
        primitive: &gltf::Primitive<'_>,
        joints: &[DAffine3],
        positions: &mut [DVec3],
    ) -> Result<(), GltfError> {
        let bent = self.blended(primitive, joints, positions.len(), DVec3::ZERO, |joint, corner| {
            joint.transform_point3(positions[corner])
        })?;
        positions
            .iter_mut()
            .zip(bent)
            .filter(|(_, (_, weight))| *weight > 0.0)
            .for_each(|(position, (sum, weight))| *position = sum / weight);
        Ok(())
    }

    /// Each corner goes with up to four joints of each set: what they make of it, times their weights, and
    /// the sum of those.
    fn blended<T>(
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
        let mut bent = vec![(zero, 0.0); count];
        for set in 0.. {
            let (Some(of), Some(by)) =
                (primitive.get(&Semantic::Joints(set)), primitive.get(&Semantic::Weights(set)))
            else {
                break;
            };
            self.check(primitive, &Semantic::Joints(set), &of)?;
            self.check(primitive, &Semantic::Weights(set), &by)?;
            let (of, by) = (accessor::rows(self.source, &of)?, accessor::rows(self.source, &by)?);
            if of.len() != count || by.len() != count {
                return Err(self.wrong(primitive, "its joints or weights have another number of elements"));
            }
            for (i, sum) in bent.iter_mut().enumerate() {
                for k in (0..4).filter(|&k| by[i][k] > 0.0) {
                    let joint = joints
                        .get(of[i][k] as usize)
                        .ok_or_else(|| self.wrong(primitive, "names a joint that its skin does not have"))?;
                    *sum = (sum.0 + by[i][k] * by_joint(joint, i), sum.1 + by[i][k]);
                }
            }
        }
        Ok(bent)
    }

    fn indices(&self, primitive: &gltf::Primitive<'_>, count: usize) -> Result<Vec<u32>, GltfError> {
        let all: Vec<u32> = match primitive.indices() {
            None => (0..count as u32).collect(),
            Some(accessor) if !is_index(&accessor) => {
                let (number, kind, many) = (accessor.index(), accessor.data_type(), accessor.dimensions());
                return Err(self.wrong(
                    primitive,
                    &format!("accessors.{number} is of {many:?} of {kind:?}: indices are whole numbers from 0, one each"),
                ));
            }
            Some(accessor) => {
                accessor::numbers(self.source, &accessor)?.into_iter().map(|index| index as u32).collect()
            }
        };
        if let Some(index) = all.iter().find(|&&index| index as usize >= count) {
            return Err(self.wrong(primitive, &format!("an index is {index}, but there are {count} corners")));
        }
        let corners: Vec<[u32; 3]> = match self.triangles {
            Triangles::List => all.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            // Every other triangle of a strip turns the other way.
            Triangles::Strip => {
                let turned = |(k, t): (usize, &[u32])| {
                    if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] }
                };
                all.windows(3).enumerate().map(turned).collect()
            }
            Triangles::Fan => {
                all.get(1..).unwrap_or_default().windows(2).map(|t| [t[0], t[1], all[0]]).collect()
            }
        };
        let turned = |[a, b, c]: [u32; 3]| if self.mirrored { [a, c, b] } else { [a, b, c] };
        Ok(corners.into_iter().filter(|[a, b, c]| a != b && b != c && a != c).flat_map(turned).collect())
    }
}
