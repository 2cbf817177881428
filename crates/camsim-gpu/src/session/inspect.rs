//! Looking at the stages of a frame one by one, for tests and for whoever asks why.

use camsim_core::temporal::IdealGeometry;

use super::{
    GpuSession,
    readback::{read_buffer, read_texture},
};
use crate::{context::GpuError, ideal::STORED_FORMAT};

/// Geometry, linear R G B A (A is 0 where a silhouette is marked), and inverse depth in 1/m of an ideal
/// frame, row-major.
pub type IdealImages = (IdealGeometry, Vec<f32>, Vec<f32>);

impl GpuSession<'_> {
    /// The ideal frame that the last rendered frame was gathered from (of several the first): linear R G B A
    /// (with the paper preset sRGB values as stored) and inverse depth (1/m), row-major. For tests and for
    /// looking at stages one by one.
    ///
    /// # Errors
    /// Device faults; `None` before the first frame.
    pub fn read_ideal(&self, ideal: &IdealGeometry) -> Result<Option<IdealImages>, GpuError> {
        let Some(drawn) = &self.drawn else { return Ok(None) };
        let near_m = camsim_plan::NEAR_M as f32;
        let target = &self.targets[drawn.target].ideal;
        let [width, height] = ideal.size_px;
        let color: Vec<f32> = if target.color.format() == STORED_FORMAT {
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

    /// Triangles of the terrain near marks, which were drawn with several samples a pixel, in the frame that
    /// the ideal frame was last drawn for (of several ideal frames the first). Only of use where
    /// [`camsim_plan::EdgeStage`] does not say `thin`: there all are drawn.
    ///
    /// # Errors
    /// Device faults; `None` before the first frame.
    pub fn triangles_near_marks(&self) -> Result<Option<u64>, GpuError> {
        let Some(slot) = self.drawn.as_ref().and_then(|drawn| self.slots[drawn.slot].ideal.first()) else {
            return Ok(None);
        };
        let Some(near_marks) = slot.near_marks() else { return Ok(Some(0)) };
        let arguments = read_buffer::<u32>(self.gpu, near_marks)?;
        self.gpu.check()?;
        Ok(arguments.first().map(|&indices| u64::from(indices) / 3))
    }

    /// Tiles of the ground's picture that are on the device, and all that there are; `None` for a picture
    /// that is held whole.
    #[must_use]
    pub fn tiles_held(&self) -> Option<[usize; 2]> {
        self.buffers.tiles().map(|tiles| [tiles.held().0, tiles.ground.grid.count as usize])
    }
}
