//! Read-back of single stages of a frame, for tests and debugging.

use camsim_core::temporal::IdealGeometry;

use super::{
    GpuSession,
    readback::{read_buffer, read_texture},
};
use crate::{
    adapter::{GpuError, IdealPlanes},
    ideal::SRGB_FORMAT,
};

impl GpuSession<'_> {
    pub(super) fn ideal_images(&self, ideal: &IdealGeometry) -> Result<Option<IdealPlanes>, GpuError> {
        let Some(last_ideal) = &self.last_ideal else { return Ok(None) };
        let near_m = camsim_plan::NEAR_M as f32;
        let target = &self.targets[last_ideal.target].ideal;
        let [width, height] = ideal.size_px;
        let color: Vec<f32> = if target.color.format() == SRGB_FORMAT {
            let bytes = read_texture::<[u8; 4]>(self.gpu, &target.color, width, height)?;
            bytes.iter().flatten().map(|v| f32::from(*v) / 255.0).collect()
        } else {
            let halves = read_texture::<[half::f16; 4]>(self.gpu, &target.color, width, height)?;
            halves.iter().flatten().map(|v| v.to_f32()).collect()
        };
        let depth = read_texture::<f32>(self.gpu, &target.depth, width, height)?;
        self.gpu.check()?;
        Ok(Some((*ideal, color, depth.iter().map(|d| d / near_m).collect())))
    }

    pub(super) fn edge_triangles(&self) -> Result<Option<u64>, GpuError> {
        let Some(slot) =
            self.last_ideal.as_ref().and_then(|last_ideal| self.frame_slots[last_ideal.slot].ideal.first())
        else {
            return Ok(None);
        };
        let Some(edge_triangles_arguments) = slot.edge_triangles_arguments() else { return Ok(Some(0)) };
        let arguments = read_buffer::<u32>(self.gpu, edge_triangles_arguments)?;
        self.gpu.check()?;
        Ok(arguments.first().map(|&indices| u64::from(indices) / 3))
    }
}
