//! Copies of ideal frames in memory that the cpu reads.

use camsim_core::temporal::IdealGeometry;

use super::readback::Rows;
use crate::{
    context::{GpuContext, GpuError},
    ideal::IdealTarget,
    recorder::Recorder,
};

/// One for the frame at work, one for the frame in flight after it.
const COPIES: usize = 2;
/// Of a texel: four half floats, a float.
const COLOR_BYTES: usize = 8;
const DEPTH_BYTES: usize = 4;

/// Names a copy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdealCopy(usize);

/// An ideal frame in memory.
#[derive(Clone, Copy, Debug)]
pub struct CopiedIdeal<'a> {
    /// Linear R G B A, half floats.
    pub color: &'a [u16],
    /// Texels from one row of it to the next.
    pub color_stride: u32,
    /// `near / z`, 0 = sky.
    pub depth: &'a [f32],
    /// Texels from one row of it to the next.
    pub depth_stride: u32,
}

#[derive(Debug)]
struct Copy {
    color: Rows,
    depth: Rows,
}

/// Mapped from their submission until they are used again.
#[derive(Debug)]
pub(super) struct IdealCopies {
    copies: [Copy; COPIES],
    last: usize,
    /// The one that the commands at work write.
    recorded: Option<usize>,
}

impl IdealCopies {
    pub fn new(gpu: &GpuContext) -> Self {
        let copies = [(); COPIES].map(|()| Copy {
            color: Rows::empty(gpu, "camsim.ideal_color"),
            depth: Rows::empty(gpu, "camsim.ideal_depth"),
        });
        Self { copies, last: 0, recorded: None }
    }

    /// Forgets what was recorded and never submitted.
    pub fn forget(&mut self) {
        self.recorded = None;
    }

    /// Records the copy of an ideal frame.
    pub fn record(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        target: &IdealTarget,
        ideal: &IdealGeometry,
    ) -> IdealCopy {
        // The frame in flight may still read the other one.
        self.last = (self.last + 1) % COPIES;
        let copy = &mut self.copies[self.last];
        // Depth can only be copied whole.
        let whole_px = [target.depth.width(), target.depth.height()];
        for (rows, size_px, texture, texel_bytes) in [
            (&mut copy.color, ideal.size_px, &target.color, COLOR_BYTES),
            (&mut copy.depth, whole_px, &target.depth, DEPTH_BYTES),
        ] {
            rows.fit(gpu, size_px, texel_bytes);
            rows.copy(recorder.encoder(), texture);
        }
        self.recorded = Some(self.last);
        IdealCopy(self.last)
    }

    /// Maps what the submitted commands copy.
    pub fn recall(&mut self) {
        if let Some(copy) = self.recorded.take().map(|copy| &mut self.copies[copy]) {
            copy.color.recall();
            copy.depth.recall();
        }
    }

    pub fn read<R>(
        &self,
        IdealCopy(copy): IdealCopy,
        read: impl FnOnce(CopiedIdeal<'_>) -> R,
    ) -> Result<R, GpuError> {
        let copy = &self.copies[copy];
        let (color, depth) = (copy.color.view()?, copy.depth.view()?);
        let fault = |error: bytemuck::PodCastError| GpuError::Device(error.to_string());
        Ok(read(CopiedIdeal {
            color: bytemuck::try_cast_slice(&color).map_err(fault)?,
            color_stride: copy.color.stride_bytes / COLOR_BYTES as u32,
            depth: bytemuck::try_cast_slice(&depth).map_err(fault)?,
            depth_stride: copy.depth.stride_bytes / DEPTH_BYTES as u32,
        }))
    }
}
