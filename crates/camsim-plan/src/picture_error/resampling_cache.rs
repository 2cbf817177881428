//! Parts of the resampling error at one position of the image. Sampling plans have most of their parts in
//! common: what the texture has and what is wanted of it depends on the ideal frame's scale, what the
//! surfaces' filter leaves on that and the filter, what the reads leave on that and the reads. Each part is
//! worked out once a position.

use std::sync::{Arc, Mutex};

use camsim_core::temporal::TapStage;

use super::transfer::{TextureWaves, Transfer};
use crate::ir::stages::PrefilterTaps;

/// The parts that are known at a probe.
#[derive(Debug, Default)]
pub(crate) struct ResamplingCache(pub Box<Mutex<ResamplingParts>>);

#[derive(Debug, Default)]
pub(crate) struct ResamplingParts {
    /// Waves of the texture.
    pub waves: Memo<FrameKey, TextureWaves>,
    /// Transfer of the surfaces' filter for each wave.
    pub filtered: Memo<(FrameKey, PrefilterTaps), [f64]>,
    /// Transfer of the reads for each wave.
    pub read: Memo<(FrameKey, TapStage, Option<u32>), [Transfer]>,
}

/// Values by their keys.
pub(crate) type Memo<K, V> = Vec<(K, Arc<V>)>;

/// The bits of an ideal frame's scale, and whether there is an exposure.
pub(crate) type FrameKey = (u64, bool);

/// The known value of a key, or the one found now.
pub(crate) fn known<K: PartialEq, V: ?Sized>(
    all: &mut Memo<K, V>,
    key: K,
    find: impl FnOnce() -> Arc<V>,
) -> Arc<V> {
    if let Some((_, value)) = all.iter().find(|(known, _)| *known == key) {
        return value.clone();
    }
    let value = find();
    all.push((key, value.clone()));
    value
}
