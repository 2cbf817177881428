//! Large arrays in huge pages, if the system provides them: with small pages, the frequent reads of whole
//! frames miss the TLB.

use std::ops::{Deref, DerefMut};

use bytemuck::Pod;

/// An array. If it fills at least one huge page, it requests huge pages; otherwise, or if there are none, it
/// is a vector.
#[derive(Debug)]
pub(crate) enum LargeArray<T> {
    Heap(Vec<T>),
    #[cfg(target_os = "linux")]
    Pages(pages::Pages, usize),
}

impl<T> Default for LargeArray<T> {
    fn default() -> Self {
        Self::Heap(Vec::new())
    }
}

impl<T: Pod> LargeArray<T> {
    /// Creates an array of zeros.
    pub fn zeros(len: usize) -> Self {
        #[cfg(target_os = "linux")]
        if let Some(pages) = pages::Pages::new(len.saturating_mul(size_of::<T>())) {
            return Self::Pages(pages, len);
        }
        Self::Heap(vec![T::zeroed(); len])
    }

    /// Sets the length. Existing values stay; new ones are zeros or stale values. It grows, but does not
    /// shrink.
    pub fn fit(&mut self, len: usize) {
        match self {
            Self::Heap(values) if len <= values.capacity() => values.resize(len, T::zeroed()),
            #[cfg(target_os = "linux")]
            Self::Pages(pages, length) if len <= pages.bytes().len() / size_of::<T>() => *length = len,
            _ => *self = Self::zeros(len),
        }
    }
}

impl<T: Pod> Deref for LargeArray<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match self {
            Self::Heap(values) => values,
            #[cfg(target_os = "linux")]
            Self::Pages(pages, len) => bytemuck::cast_slice(&pages.bytes()[..len * size_of::<T>()]),
        }
    }
}

impl<T: Pod> DerefMut for LargeArray<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match self {
            Self::Heap(values) => values,
            #[cfg(target_os = "linux")]
            Self::Pages(pages, len) => {
                bytemuck::cast_slice_mut(&mut pages.bytes_mut()[..*len * size_of::<T>()])
            }
        }
    }
}

#[cfg(target_os = "linux")]
mod pages {
    use memmap2::{Advice, MmapMut};

    /// Size of a huge page on x86-64, and on aarch64 with pages of 4 KiB.
    const LARGE_PAGE_BYTES: usize = 2 << 20;

    /// An anonymous mapping, aligned to huge pages.
    #[derive(Debug)]
    pub struct Pages {
        memory: MmapMut,
        first: usize,
    }

    impl Pages {
        /// Maps zeros. `None` below the size of one huge page, or if the system provides none.
        pub fn new(bytes: usize) -> Option<Self> {
            let bytes = Some(bytes)
                .filter(|&bytes| bytes >= LARGE_PAGE_BYTES)?
                .checked_next_multiple_of(LARGE_PAGE_BYTES)?;
            // Most systems align mappings of this size; one extra page covers those that do not, and is never
            // touched.
            let memory = MmapMut::map_anon(bytes.checked_add(LARGE_PAGE_BYTES)?).ok()?;
            memory.advise(Advice::HugePage).ok()?;
            let first = memory.as_ptr().align_offset(LARGE_PAGE_BYTES);
            (first <= LARGE_PAGE_BYTES).then_some(Self { memory, first })
        }

        fn len(&self) -> usize {
            self.memory.len() - LARGE_PAGE_BYTES
        }

        pub fn bytes(&self) -> &[u8] {
            &self.memory[self.first..self.first + self.len()]
        }

        pub fn bytes_mut(&mut self) -> &mut [u8] {
            let end = self.first + self.len();
            &mut self.memory[self.first..end]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_survive_resizing() {
        // Below one huge page, one, and several; and back.
        let mut all: LargeArray<u32> = LargeArray::default();
        assert!(all.is_empty());
        for len in [3, 1 << 19, 1 << 19, 5_000_001, 7, 1 << 19, 5_000_001] {
            all.fit(len);
            assert_eq!(all.len(), len);
            for (value, i) in all.iter_mut().zip(0..) {
                *value = i;
            }
            assert!(all.iter().zip(0..).all(|(&value, i): (&u32, u32)| value == i), "{len}");
        }
        let zeros: LargeArray<[f32; 2]> = LargeArray::zeros(700_001);
        assert!(zeros.len() == 700_001 && zeros.iter().all(|&new| new == [0.0; 2]));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn mappings_are_aligned_to_huge_pages() {
        for (len, may_have_pages) in
            [(0, false), (1000, false), ((1 << 18) - 1, false), (1 << 18, true), (3_000_001, true)]
        {
            let numbers: LargeArray<f64> = LargeArray::zeros(len);
            // A system may have no huge pages.
            let has_pages = matches!(numbers, LargeArray::Pages(..));
            assert!(may_have_pages || !has_pages, "{len}");
            assert!(!has_pages || numbers.as_ptr().align_offset(2 << 20) == 0, "{len}");
        }
    }
}
