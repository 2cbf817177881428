//! The interface of this crate without the feature `wgpu`: there is no adapter, so values of these types are
//! never made.

/// Adapters.
pub mod context {
    use std::convert::Infallible;

    pub use crate::adapter::{AdapterChoice, AdapterSummary, GpuError};

    /// An open adapter.
    #[derive(Debug)]
    pub struct GpuContext {
        /// Description of the adapter.
        pub adapter: AdapterSummary,
        pub(super) never: Infallible,
    }

    /// All adapters: none.
    #[must_use]
    pub fn adapters(_: AdapterChoice) -> Vec<AdapterSummary> {
        Vec::new()
    }

    #[allow(missing_docs)] // as in the module that the feature compiles
    impl GpuContext {
        /// Fails.
        ///
        /// # Errors
        /// [`GpuError::NotBuilt`].
        pub fn new(_: AdapterChoice) -> Result<Self, GpuError> {
            Err(GpuError::NotBuilt)
        }

        pub fn is_software(&self) -> bool {
            match self.never {}
        }

        pub fn max_picture_px(&self) -> u32 {
            match self.never {}
        }

        pub fn limit_pictures(&mut self, _: u32) {
            match self.never {}
        }

        pub fn set_pixels_per_thread(&mut self, _: u32) {
            match self.never {}
        }

        pub fn max_pixels_with_truth(&self) -> u64 {
            match self.never {}
        }

        pub fn max_side_px(&self) -> u32 {
            match self.never {}
        }

        pub fn max_storage_bytes(&self) -> u64 {
            match self.never {}
        }
    }
}

/// Times of passes.
pub mod recorder {
    /// Duration of a pass.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PassTime {
        /// Name of the pass.
        pub name: &'static str,
        /// Milliseconds by the GPU's clock.
        pub ms: f64,
    }
}

/// Shader files.
pub mod shaders {
    /// Errors of composition: none.
    #[derive(Debug, thiserror::Error)]
    pub enum ComposeError {}
}

/// All passes of a frame.
#[allow(missing_docs)] // as in the module that the feature compiles
pub mod session {
    use std::{convert::Infallible, marker::PhantomData, sync::Arc};

    use camsim_core::{
        camera::ZoomTable,
        scene::{LodTolerance, PlacedMesh, Scene, SceneBatches, TerrainTiles},
        sequence::Sequence,
        temporal::IdealGeometry,
    };
    use camsim_plan::{
        FramePlan,
        uniforms::{FrameUniforms, Truth},
    };

    use super::{
        context::{GpuContext, GpuError},
        recorder::PassTime,
    };
    use crate::error::PassError;

    pub const FRAMES_IN_FLIGHT: usize = 2;

    pub type IdealImages = (IdealGeometry, Vec<f32>, Vec<f32>);

    #[derive(Clone, Copy, Debug)]
    pub struct GpuJob<'a> {
        pub plan: &'a FramePlan,
        pub scene: &'a Scene,
        pub terrain: &'a [PlacedMesh],
        pub rows: &'a [u8],
        pub uniforms: &'a FrameUniforms,
        pub models: &'a LodTolerance,
        pub zoom: Option<&'a ZoomTable>,
        pub redraws: bool,
        pub readback: Readback,
    }

    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Readback {
        Output,
        Ideal,
    }

    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct IdealCopy(Infallible);

    #[derive(Clone, Copy, Debug)]
    pub struct CopiedIdeal<'a> {
        pub color: &'a [u16],
        pub color_stride: u32,
        pub depth: &'a [f32],
        pub depth_stride: u32,
    }

    #[derive(Debug)]
    pub struct Submitted {
        pub copy: Option<IdealCopy>,
        pub out_of_order: u32,
        pub record_ms: f64,
        pub submit_ms: f64,
    }

    #[derive(Debug)]
    pub struct GpuSession<'a> {
        never: Infallible,
        gpu: PhantomData<&'a GpuContext>,
    }

    impl<'a> GpuSession<'a> {
        pub fn new(
            gpu: &'a GpuContext,
            _: &Sequence,
            _: Arc<SceneBatches>,
            _: bool,
        ) -> Result<Self, PassError> {
            match gpu.never {}
        }

        pub fn renew(&mut self, _: (&Sequence, bool), _: &Sequence, _: bool) -> Result<(), GpuError> {
            match self.never {}
        }

        pub fn forget(&mut self) {
            match self.never {}
        }

        pub fn tiles(&self) -> Option<Arc<TerrainTiles>> {
            match self.never {}
        }

        pub fn time_passes(&mut self) -> bool {
            match self.never {}
        }

        pub fn submit(&mut self, _: &GpuJob<'_>, _: usize) -> Result<Submitted, PassError> {
            match self.never {}
        }

        pub fn wait(&self, _: &Submitted) -> Result<(), GpuError> {
            match self.never {}
        }

        pub fn output(&self, _: &Submitted) -> Result<(Vec<f32>, Option<Vec<Truth>>), GpuError> {
            match self.never {}
        }

        pub fn with_copy<R>(
            &self,
            _: IdealCopy,
            _: impl FnOnce(CopiedIdeal<'_>) -> R,
        ) -> Result<R, GpuError> {
            match self.never {}
        }

        pub fn pass_times(&self, _: &Submitted) -> Result<Vec<PassTime>, GpuError> {
            match self.never {}
        }

        pub fn read_ideal(&self, _: &IdealGeometry) -> Result<Option<IdealImages>, GpuError> {
            match self.never {}
        }

        pub fn triangles_near_edges(&self) -> Result<Option<u64>, GpuError> {
            match self.never {}
        }

        pub fn resident_tiles(&self) -> Option<[usize; 2]> {
            match self.never {}
        }
    }
}
