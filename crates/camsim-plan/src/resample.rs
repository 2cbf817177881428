//! What resampling costs at one place of the image, in any of many ways. Ways have most of their parts in
//! common: what the texture has and what is wanted of it depends on the ideal frame's scale, what the
//! surfaces' filter leaves on that and the filter, what the reads leave on that and the reads. Each part is
//! worked out once a place.

use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec2;

use super::{
    SurfaceReads,
    prospect::Sight,
    transfer::{Over, Path, Wave, Waves, error2},
};
use camsim_core::scene::SurfaceFilter;
use camsim_core::temporal::{Footprint, TapStage};

/// The parts that have been worked out for a place.
#[derive(Debug, Default)]
pub(super) struct Parts(Box<Mutex<Known>>);

#[derive(Debug, Default)]
struct Known {
    waves: Found<Frame, Waves>,
    filtered: Found<(Frame, SurfaceReads), [f64]>,
    read: Found<(Frame, TapStage, Option<u32>), [Wave]>,
}

/// What was found for each key.
type Found<K, V> = Vec<(K, Arc<V>)>;

/// The bits of an ideal frame's scale, and whether there is an exposure.
type Frame = (u64, bool);

/// What is known, or now found.
fn known<K: PartialEq, V: ?Sized>(all: &mut Found<K, V>, key: K, find: impl FnOnce() -> Arc<V>) -> Arc<V> {
    if let Some((_, value)) = all.iter().find(|(known, _)| *known == key) {
        return value.clone();
    }
    let value = find();
    all.push((key, value.clone()));
    value
}

impl Sight<'_> {
    /// Expected squared error of a pixel here, as [`error2`] has it, with so many samples of an exposure.
    pub fn sampled2(
        &self,
        scale: f64,
        reads: SurfaceReads,
        taps: TapStage,
        samples: u32,
        principal_px: DVec2,
    ) -> f64 {
        self.error2(
            scale,
            (reads, taps),
            Over::Samples(Path { along: scale * self.path, samples }),
            principal_px,
        )
    }

    /// The same of an exposure that is exact, or of none.
    pub fn exact2(
        &self,
        scale: f64,
        reads: SurfaceReads,
        taps: TapStage,
        exposed: bool,
        principal_px: DVec2,
    ) -> f64 {
        self.error2(
            scale,
            (reads, taps),
            if exposed { Over::All(scale * self.path) } else { Over::Instant },
            principal_px,
        )
    }

    /// `principal_px`: of the camera.
    fn error2(
        &self,
        scale: f64,
        (reads, taps): (SurfaceReads, TapStage),
        over: Over,
        principal_px: DVec2,
    ) -> f64 {
        let sides = scale * self.camera_from_px;
        let texel_from_ideal = self.texel_from_key * scale.recip();
        let (along, samples) = match over {
            Over::Instant => (None, None),
            Over::All(along) => (Some(along), None),
            Over::Samples(path) => (Some(path.along), Some(path.samples)),
        };
        let frame = (scale.to_bits(), along.is_some());
        // A place is asked by one thread at a time; what is kept is replaced whole.
        let mut parts = self.parts.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Known { waves, filtered, read } = &mut *parts;
        let waves = known(waves, frame, || {
            Arc::new(Waves::new(self.spectrum, texel_from_ideal, self.key_from_camera * sides, along))
        });
        let filtered = known(filtered, (frame, reads), || {
            waves.filtered(&SurfaceFilter::new(texel_from_ideal, reads)).into()
        });
        let read = known(read, (frame, taps, samples), || {
            let area = Footprint::new(sides.x_axis, sides.y_axis, taps);
            let beside_px = (scale * self.key_px + principal_px).fract_gl();
            waves.read(&area, over, beside_px).into()
        });
        error2(&waves, &filtered, &read)
    }
}
