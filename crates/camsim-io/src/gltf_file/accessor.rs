//! Numbers out of accessors: any component type, normalised or not, interleaved, sparse. Every reach is
//! checked.

use gltf::accessor::{Accessor, DataType, Dimensions};

use super::{GltfError, source::Source};

/// Elements of an accessor, at most.
const MOST: usize = 1 << 27;
/// And without data.
pub(super) const MOST_EMPTY: usize = 1 << 21;

/// Up to four numbers an element; those that it does not have are 0.
pub(super) fn rows(source: &Source, accessor: &Accessor<'_>) -> Result<Vec<[f64; 4]>, GltfError> {
    let all = numbers(source, accessor)?;
    let width = width(accessor);
    if width > 4 {
        return Err(
            source.broken(format!("accessors.{}: is of matrices where vectors should be", accessor.index()))
        );
    }
    Ok(all
        .chunks_exact(width)
        .map(|row| std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0)))
        .collect())
}

/// 4x4 matrices, column by column.
pub(super) fn matrices(source: &Source, accessor: &Accessor<'_>) -> Result<Vec<[f64; 16]>, GltfError> {
    if width(accessor) != 16 {
        return Err(source.broken(format!("accessors.{}: is not of 4x4 matrices", accessor.index())));
    }
    Ok(numbers(source, accessor)?.chunks_exact(16).map(|row| std::array::from_fn(|k| row[k])).collect())
}

/// One number after the other.
pub(super) fn numbers(source: &Source, accessor: &Accessor<'_>) -> Result<Vec<f64>, GltfError> {
    let (count, width) = (accessor.count(), width(accessor));
    let wrong = |message: &str| source.broken(format!("accessors.{}: {message}", accessor.index()));
    if count > MOST {
        return Err(wrong("has more elements than can be held"));
    }
    let element = width * size_of(accessor.data_type());
    let mut values = match accessor.view() {
        None => {
            // Nothing but what a sparse part may put there.
            if count > MOST_EMPTY {
                return Err(wrong("has very many elements and no data"));
            }
            vec![0.0; count * width]
        }
        Some(view) => {
            let bytes = source.view(&view, accessor.offset())?;
            let stride = view.stride().unwrap_or(element);
            let mut values = Vec::with_capacity((count * width).min(bytes.len()));
            for i in 0..count {
                let at = i.checked_mul(stride).and_then(|at| bytes.get(at..at.checked_add(element)?));
                decode(at.ok_or_else(|| wrong("reaches beyond its buffer view"))?, accessor, &mut values);
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
        let places = source.view(&indices.view(), indices.offset())?;
        let given = source.view(&sparse.values().view(), sparse.values().offset())?;
        let mut found = Vec::new();
        for i in 0..sparse.count() {
            let size = size_of(kind);
            let place = places
                .get(i * size..(i + 1) * size)
                .ok_or_else(|| wrong("its sparse indices reach beyond their buffer view"))?;
            let place = component(place, kind) as usize;
            let bytes = given
                .get(i * element..(i + 1) * element)
                .ok_or_else(|| wrong("its sparse values reach beyond their buffer view"))?;
            found.clear();
            decode(bytes, accessor, &mut found);
            let to = values
                .get_mut(place * width..(place + 1) * width)
                .ok_or_else(|| wrong("its sparse part names an element that is not there"))?;
            to.copy_from_slice(&found);
        }
    }
    Ok(values)
}

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

fn size_of(kind: DataType) -> usize {
    match kind {
        DataType::I8 | DataType::U8 => 1,
        DataType::I16 | DataType::U16 => 2,
        DataType::U32 | DataType::F32 => 4,
    }
}

fn width(accessor: &Accessor<'_>) -> usize {
    match accessor.dimensions() {
        Dimensions::Scalar => 1,
        Dimensions::Vec2 => 2,
        Dimensions::Vec3 => 3,
        Dimensions::Vec4 | Dimensions::Mat2 => 4,
        Dimensions::Mat3 => 9,
        Dimensions::Mat4 => 16,
    }
}
