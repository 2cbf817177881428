//! Read-back of single stages of a frame, for tests and debugging.

use camsim_core::temporal::IdealGeometry;

use super::{
    GpuSession,
    readback::{read_buffer, read_texture},
};
use crate::{adapter::GpuError, ideal::SRGB_FORMAT};

/// Geometry, linear R G B A (A is 0 at edge pixels), and inverse depth in 1/m of an ideal frame, row-major.
pub type IdealImages = (IdealGeometry, Vec<f32>, Vec<f32>);

impl GpuSession<'_> {
    /// The ideal frame from which the last rendered frame was gathered (the first of several): linear R G B A
    /// (with the paper preset sRGB-encoded values) and inverse depth (1/m), row-major. For tests and
    /// debugging.
    ///
    /// # Errors
    /// Device faults; `None` before the first frame.
    pub fn read_ideal(&self, ideal: &IdealGeometry) -> Result<Option<IdealImages>, GpuError> {
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

    /// Number of terrain triangles near edge pixels, which were drawn with several samples per pixel, in the
    /// frame for which the ideal frame was last drawn (the first of several). Meaningful only if
    /// [`camsim_plan::EdgeStage`] is not `thin`: there all triangles are drawn.
    ///
    /// # Errors
    /// Device faults; `None` before the first frame.
    pub fn triangles_near_edges(&self) -> Result<Option<u64>, GpuError> {
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

    /// Number of resident tiles of the terrain's texture, and of all its tiles; `None` if the texture is not
    /// split.
    #[must_use]
    pub fn resident_tiles(&self) -> Option<[usize; 2]> {
        self.buffers.tiles().map(|tiles| [tiles.resident().0, tiles.ground.grid.count as usize])
    }
}
