//! Copies of ideal frames in memory that the CPU reads.

use camsim_core::temporal::IdealGeometry;

use super::readback::TextureReadback;
use crate::{
    adapter::{CopiedIdeal, CopyHandle, GpuError},
    context::GpuContext,
    ideal::RenderTarget,
    recorder::Recorder,
};

/// Number of copies: one for the frame at work, one for the frame in flight after it.
const COPY_COUNT: usize = 2;
/// Size of a colour texel, four half floats, and of a depth texel, a float, bytes.
const COLOR_BYTES: usize = 8;
const DEPTH_BYTES: usize = 4;

#[derive(Debug)]
struct CopyBuffers {
    color: TextureReadback,
    depth: TextureReadback,
}

/// Copies, mapped from their submission until they are reused.
#[derive(Debug)]
pub(super) struct FrameCopies {
    copies: [CopyBuffers; COPY_COUNT],
    last: usize,
    /// Index of the copy that the current commands write.
    recorded: Option<usize>,
}

impl FrameCopies {
    pub fn new(gpu: &GpuContext) -> Self {
        let copies = [(); COPY_COUNT].map(|()| CopyBuffers {
            color: TextureReadback::empty(gpu, "camsim.ideal_color"),
            depth: TextureReadback::empty(gpu, "camsim.ideal_depth"),
        });
        Self { copies, last: 0, recorded: None }
    }

    /// Drops the copy that was recorded but never submitted.
    pub fn forget(&mut self) {
        self.recorded = None;
    }

    /// Records the copy of an ideal frame.
    pub fn record(
        &mut self,
        gpu: &GpuContext,
        recorder: &mut Recorder<'_>,
        target: &RenderTarget,
        ideal: &IdealGeometry,
    ) -> CopyHandle {
        // The frame in flight may still read the other copy.
        self.last = (self.last + 1) % COPY_COUNT;
        let copy = &mut self.copies[self.last];
        // Depth textures can only be copied whole.
        let whole_px = [target.depth.width(), target.depth.height()];
        for (rows, size_px, texture, texel_bytes) in [
            (&mut copy.color, ideal.size_px, &target.color, COLOR_BYTES),
            (&mut copy.depth, whole_px, &target.depth, DEPTH_BYTES),
        ] {
            rows.fit(gpu, size_px, texel_bytes);
            rows.copy(recorder.encoder(), texture);
        }
        self.recorded = Some(self.last);
        CopyHandle(self.last)
    }

    /// Requests the mapping of the copy in the submitted commands.
    pub fn request_mapping(&mut self) {
        if let Some(copy) = self.recorded.take().map(|copy| &mut self.copies[copy]) {
            copy.color.request_mapping();
            copy.depth.request_mapping();
        }
    }

    pub fn read(
        &self,
        CopyHandle(copy): CopyHandle,
        read: &mut dyn FnMut(CopiedIdeal<'_>),
    ) -> Result<(), GpuError> {
        let copy = &self.copies[copy];
        let (color, depth) = (copy.color.view()?, copy.depth.view()?);
        let to_error = |error: bytemuck::PodCastError| GpuError::Device(error.to_string());
        read(CopiedIdeal {
            color: bytemuck::try_cast_slice(&color).map_err(to_error)?,
            color_stride: copy.color.stride_bytes / COLOR_BYTES as u32,
            depth: bytemuck::try_cast_slice(&depth).map_err(to_error)?,
            depth_stride: copy.depth.stride_bytes / DEPTH_BYTES as u32,
        });
        Ok(())
    }
}
