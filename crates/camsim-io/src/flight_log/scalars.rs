//! Little-endian numbers of binary logs.

/// Type of a number in a binary log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

impl Scalar {
    /// Number of bytes.
    pub(super) const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number at `offset`; `None` beyond the end. Integers above 2^53 are rounded.
    pub(super) fn read(self, bytes: &[u8], offset: usize) -> Option<f64> {
        Some(match self {
            Self::I8 => f64::from(i8::from_le_bytes(array(bytes, offset)?)),
            Self::U8 => f64::from(u8::from_le_bytes(array(bytes, offset)?)),
            Self::I16 => f64::from(i16::from_le_bytes(array(bytes, offset)?)),
            Self::U16 => f64::from(u16::from_le_bytes(array(bytes, offset)?)),
            Self::I32 => f64::from(i32::from_le_bytes(array(bytes, offset)?)),
            Self::U32 => f64::from(u32::from_le_bytes(array(bytes, offset)?)),
            Self::I64 => i64::from_le_bytes(array(bytes, offset)?) as f64,
            Self::U64 => u64::from_le_bytes(array(bytes, offset)?) as f64,
            Self::F16 => half::f16::from_le_bytes(array(bytes, offset)?).to_f64(),
            Self::F32 => f64::from(f32::from_le_bytes(array(bytes, offset)?)),
            Self::F64 => f64::from_le_bytes(array(bytes, offset)?),
        })
    }
}

/// `N` bytes at `offset`; `None` beyond the end.
pub(super) fn array<const N: usize>(bytes: &[u8], offset: usize) -> Option<[u8; N]> {
    bytes.get(offset..offset.checked_add(N)?)?.try_into().ok()
}
