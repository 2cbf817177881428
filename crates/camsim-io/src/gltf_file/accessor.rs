//! Decodes accessors: any component type, normalised or not, interleaved or sparse, with checked bounds.

use gltf::accessor::{Accessor, DataType, Dimensions};

use super::{GltfError, asset::Asset};

/// Largest number of elements of an accessor.
const MAX_ELEMENTS: usize = 1 << 27;
/// Largest number of elements of an accessor without data (all zeros).
pub(super) const MAX_ELEMENTS_WITHOUT_DATA: usize = 1 << 21;

/// Vectors of up to four components; absent components are 0.
pub(super) fn vectors(asset: &Asset, accessor: &Accessor<'_>) -> Result<Vec<[f64; 4]>, GltfError> {
    let numbers = numbers(asset, accessor)?;
    let components = component_count(accessor);
    if components > 4 {
        return Err(asset.error(format!("accessors.{}: has matrices instead of vectors", accessor.index())));
    }
    Ok(numbers
        .chunks_exact(components)
        .map(|row| std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0)))
        .collect())
}

/// 4x4 matrices in column-major order.
pub(super) fn matrices(asset: &Asset, accessor: &Accessor<'_>) -> Result<Vec<[f64; 16]>, GltfError> {
    if component_count(accessor) != 16 {
        return Err(asset.error(format!("accessors.{}: does not have 4x4 matrices", accessor.index())));
    }
    Ok(numbers(asset, accessor)?.chunks_exact(16).map(|row| std::array::from_fn(|k| row[k])).collect())
}

/// All components of all elements.
pub(super) fn numbers(asset: &Asset, accessor: &Accessor<'_>) -> Result<Vec<f64>, GltfError> {
    let (count, components) = (accessor.count(), component_count(accessor));
    let error = |message: &str| asset.error(format!("accessors.{}: {message}", accessor.index()));
    if count > MAX_ELEMENTS {
        return Err(error("has too many elements"));
    }
    let element_size = components * size_of(accessor.data_type());
    let mut values = match accessor.view() {
        None => {
            // Zeros, which the sparse part may replace.
            if count > MAX_ELEMENTS_WITHOUT_DATA {
                return Err(error("has too many elements without data"));
            }
            vec![0.0; count * components]
        }
        Some(view) => {
            let bytes = asset.view(&view, accessor.offset())?;
            let stride = view.stride().unwrap_or(element_size);
            let mut values = Vec::with_capacity((count * components).min(bytes.len()));
            for i in 0..count {
                let element_bytes = i
                    .checked_mul(stride)
                    .and_then(|start| bytes.get(start..start.checked_add(element_size)?));
                decode(
                    element_bytes.ok_or_else(|| error("reaches beyond its buffer view"))?,
                    accessor,
                    &mut values,
                );
            }
            values
        }
    };
    if let Some(sparse) = accessor.sparse() {
        let indices = sparse.indices();
        let kind = match indices.index_type() {
            gltf::accessor::sparse::IndexType::U8 => DataType::U8,
            gltf::accessor::sparse::IndexType::U16 => DataType::U16,
            gltf::accessor::sparse::IndexType::U32 => DataType::U32,
        };
        let index_bytes = asset.view(&indices.view(), indices.offset())?;
        let value_bytes = asset.view(&sparse.values().view(), sparse.values().offset())?;
        let mut element = Vec::new();
        for i in 0..sparse.count() {
            let size = size_of(kind);
            let index = index_bytes
                .get(i * size..(i + 1) * size)
                .ok_or_else(|| error("its sparse indices reach beyond their buffer view"))?;
            let index = component(index, kind) as usize;
            let bytes = value_bytes
                .get(i * element_size..(i + 1) * element_size)
                .ok_or_else(|| error("its sparse values reach beyond their buffer view"))?;
            element.clear();
            decode(bytes, accessor, &mut element);
            let target = values
                .get_mut(index * components..(index + 1) * components)
                .ok_or_else(|| error("a sparse index is out of range"))?;
            target.copy_from_slice(&element);
        }
    }
    Ok(values)
}

/// Appends the components of one element.
fn decode(bytes: &[u8], accessor: &Accessor<'_>, out: &mut Vec<f64>) {
    let kind = accessor.data_type();
    for part in bytes.chunks_exact(size_of(kind)) {
        let value = component(part, kind);
        out.push(match (accessor.normalized(), kind) {
            (true, DataType::I8) => (value / 127.0).max(-1.0),
            (true, DataType::U8) => value / 255.0,
            (true, DataType::I16) => (value / 32_767.0).max(-1.0),
            (true, DataType::U16) => value / 65_535.0,
            _ => value,
        });
    }
}

/// One component, without normalisation.
fn component(bytes: &[u8], kind: DataType) -> f64 {
    let two = || [bytes[0], bytes[1]];
    let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
    match kind {
        DataType::I8 => f64::from(bytes[0] as i8),
        DataType::U8 => f64::from(bytes[0]),
        DataType::I16 => f64::from(i16::from_le_bytes(two())),
        DataType::U16 => f64::from(u16::from_le_bytes(two())),
        DataType::U32 => f64::from(u32::from_le_bytes(four())),
        DataType::F32 => f64::from(f32::from_le_bytes(four())),
    }
}

/// Size of a component, bytes.
fn size_of(kind: DataType) -> usize {
    match kind {
        DataType::I8 | DataType::U8 => 1,
        DataType::I16 | DataType::U16 => 2,
        DataType::U32 | DataType::F32 => 4,
    }
}

/// Number of components of an element.
fn component_count(accessor: &Accessor<'_>) -> usize {
    match accessor.dimensions() {
        Dimensions::Scalar => 1,
        Dimensions::Vec2 => 2,
        Dimensions::Vec3 => 3,
        Dimensions::Vec4 | Dimensions::Mat2 => 4,
        Dimensions::Mat3 => 9,
        Dimensions::Mat4 => 16,
    }
}
