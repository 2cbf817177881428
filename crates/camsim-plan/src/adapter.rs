//! What executes plans on a graphics adapter, whatever its programming interface: the engine drives an [`Adapter`]
//! and its [`AdapterSession`]s, and `camsim-gpu` is one.

use std::{any::Any, error::Error, fmt, sync::Arc};

use camsim_core::{
    camera::ZoomTable,
    scene::{LodTolerance, PlacedMesh, Scene, SceneBatches, TerrainTiles},
    sequence::Sequence,
    temporal::IdealGeometry,
};

use crate::{
    ir::frame_plan::FramePlan,
    uniforms::{FrameUniforms, Truth},
};

/// Frames in flight: one runs on the adapter while the one before is read back.
pub const FRAMES_IN_FLIGHT: usize = 2;

/// An open adapter.
pub trait Adapter: Any + fmt::Debug + Send + Sync {
    /// Its description.
    fn summary(&self) -> &AdapterSummary;

    /// What it can hold.
    fn limits(&self) -> AdapterLimits;

    /// Splits textures with longer sides into tiles, as if this were the adapter's limit: for tests, and
    /// where device memory is short.
    fn limit_pictures(&mut self, max_side_px: u32);

    /// Sets the pixels of a row per thread of the reverse kernel, 1 to 4096. The default is 16 on a software
    /// adapter and 1 on a card. The output does not depend on it.
    fn set_pixels_per_thread(&mut self, pixels: u32);

    /// Uploads a scene and prepares for frames of its sequence. `truth`: frames have depth and coordinates.
    ///
    /// # Errors
    /// What the adapter cannot hold, faults of the shader files.
    fn session<'a>(
        &'a self,
        sequence: &Sequence,
        meshes: Arc<SceneBatches>,
        truth: bool,
    ) -> Result<Box<dyn AdapterSession + 'a>, GpuError>;
}

/// One sequence on an adapter.
pub trait AdapterSession: fmt::Debug + Send + Sync {
    /// Switches to another sequence over the same scene with the same preset: kernels and textures stay on
    /// the GPU. `before` is the current sequence and whether it has truth.
    ///
    /// # Errors
    /// Output frames that no storage buffer holds; the session then stays as it was.
    fn renew(&mut self, before: (&Sequence, bool), sequence: &Sequence, truth: bool) -> Result<(), GpuError>;

    /// Invalidates the ideal frames that were drawn last.
    fn forget(&mut self);

    /// Tile grid of the terrain's texture, if that is larger than a GPU texture.
    fn tiles(&self) -> Option<Arc<TerrainTiles>>;

    /// Enables time stamps of each pass. `false` if the adapter has none.
    fn time_passes(&mut self) -> bool;

    /// Records and submits a frame in one of [`FRAMES_IN_FLIGHT`] slots.
    ///
    /// # Errors
    /// What the adapter cannot hold, faults of the shader files and of the device.
    fn submit(&mut self, job: &GpuJob<'_>, slot: usize) -> Result<Submitted, GpuError>;

    /// Waits for a submitted frame.
    ///
    /// # Errors
    /// Faults of the device.
    fn wait(&self, submitted: &Submitted) -> Result<(), GpuError>;

    /// Output frame of a completed submission: linear R G B A, and the truth if the plan has it.
    ///
    /// # Errors
    /// Faults of the device.
    fn output(&self, submitted: &Submitted) -> Result<(Vec<f32>, Option<Vec<Truth>>), GpuError>;

    /// Calls `read` with the copy of an ideal frame, once its submission is complete.
    ///
    /// # Errors
    /// Faults of the device.
    fn with_copy(&self, copy: CopyHandle, read: &mut dyn FnMut(CopiedIdeal<'_>)) -> Result<(), GpuError>;

    /// Duration of each pass of a frame, if time stamps are enabled.
    ///
    /// # Errors
    /// Faults of the device.
    fn pass_times(&self, submitted: &Submitted) -> Result<Vec<PassTime>, GpuError>;

    /// The ideal frame from which the last rendered frame was gathered (the first of several): linear R G B A
    /// (with the paper preset sRGB-encoded values) and inverse depth (1/m), row-major. For tests and
    /// debugging.
    ///
    /// # Errors
    /// Device faults; `None` before the first frame.
    fn read_ideal(&self, ideal: &IdealGeometry) -> Result<Option<IdealPlanes>, GpuError>;

    /// Number of terrain triangles near edge pixels, which were drawn with several samples per pixel, in the
    /// frame for which the ideal frame was last drawn (the first of several). Meaningful only if
    /// [`EdgeStage`](crate::EdgeStage) is not `thin`: there all triangles are drawn.
    ///
    /// # Errors
    /// Device faults; `None` before the first frame.
    fn triangles_near_edges(&self) -> Result<Option<u64>, GpuError>;

    /// Number of resident tiles of the terrain's texture, and of all its tiles; `None` if the texture is not
    /// split.
    fn resident_tiles(&self) -> Option<[usize; 2]>;
}

/// What an adapter can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdapterLimits {
    /// Whether it is a driver that runs on this machine's processor.
    pub is_software: bool,
    /// Largest side of a texture that is not split into tiles, pixels.
    pub max_picture_px: u32,
    /// Largest side of a texture.
    pub max_side_px: u32,
    /// Largest storage buffer, bytes.
    pub max_storage_bytes: u64,
}

/// Inputs of a frame.
#[derive(Clone, Copy, Debug)]
pub struct GpuJob<'a> {
    /// The plan.
    pub plan: &'a FramePlan,
    /// The scene.
    pub scene: &'a Scene,
    /// Terrain triangles of each key frame; empty without a terrain.
    pub terrain: &'a [PlacedMesh],
    /// Poses or times of the rows, in the layout of the shaders.
    pub rows: &'a [u8],
    /// Uniforms of the frame.
    pub uniforms: &'a FrameUniforms,
    /// Level of detail of the models.
    pub models: &'a LodTolerance,
    /// Calibrations of a zoom lens.
    pub zoom: Option<&'a ZoomTable>,
    /// Whether the ideal frames differ from those of the previous frame.
    pub redraws: bool,
    /// What to read back.
    pub readback: Readback,
}

/// Result of a frame that is read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Readback {
    /// The output frame.
    Output,
    /// The ideal frame, for the CPU renderer.
    Ideal,
}

/// A submitted frame.
#[derive(Clone, Copy, Debug)]
pub struct Submitted {
    /// Its slot, which no other frame takes until it is finished.
    pub slot: usize,
    /// Whether it has depth and coordinates.
    pub truth: bool,
    /// The copy of the ideal frame, if it is read back.
    pub copy: Option<CopyHandle>,
    /// Blended triangles that are drawn before something behind them, over all ideal frames.
    pub out_of_order: u32,
    /// Duration of the recording, ms.
    pub record_ms: f64,
    /// Duration of the driver's submit call, ms.
    pub submit_ms: f64,
}

/// Handle of a copy of an ideal frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CopyHandle(pub usize);

/// An ideal frame in memory.
#[derive(Clone, Copy, Debug)]
pub struct CopiedIdeal<'a> {
    /// Linear R G B A, half floats.
    pub color: &'a [u16],
    /// Texels from one row of `color` to the next.
    pub color_stride: u32,
    /// `near / z`, 0 = sky.
    pub depth: &'a [f32],
    /// Texels from one row of `depth` to the next.
    pub depth_stride: u32,
}

/// Geometry, linear R G B A (A is 0 at edge pixels), and inverse depth in 1/m of an ideal frame, row-major.
pub type IdealPlanes = (IdealGeometry, Vec<f32>, Vec<f32>);

/// Duration of a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub name: &'static str,
    /// Milliseconds by the GPU's clock.
    pub ms: f64,
}

/// Errors of the GPU side. Texts name the fix.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter found; holds the setting of `CAMSIM_ADAPTER`, in words.
    #[error(
        "no usable graphics adapter found{0}: install a Vulkan driver (on Debian or Ubuntu without a GPU: \
         `apt-get install mesa-vulkan-drivers libvulkan1`), or set CAMSIM_ADAPTER to part of an adapter's \
         name from `camsim info`"
    )]
    NoAdapter(String),
    /// The program was built without the feature `gpu`.
    #[error(
        "this camsim was built without the feature `gpu`: use `--backend cpu`, or build it with the default \
         features"
    )]
    NotBuilt,
    /// There are adapters, but none with this name.
    #[error(
        "no adapter has `{wanted_name}` in its name (CAMSIM_ADAPTER): there is {available}; set \
         CAMSIM_ADAPTER to part of one of these names, or not at all"
    )]
    UnknownAdapter {
        /// Value of `CAMSIM_ADAPTER`.
        wanted_name: String,
        /// Available adapters, in words.
        available: String,
    },
    /// The adapter refused to open a device.
    #[error("adapter `{adapter}` gave no device: {reason}")]
    NoDevice {
        /// Adapter name.
        adapter: String,
        /// Error text of the programming interface.
        reason: String,
    },
    /// The device stopped working.
    #[error(
        "the graphics device was lost or failed: {0}; run again, with fewer or smaller frames if memory ran \
         out"
    )]
    Device(String),
    /// The shader files are inconsistent.
    #[error(transparent)]
    Shader(Box<dyn Error + Send + Sync>),
    /// An image or table exceeds a limit of the adapter.
    #[error("{what} needs {needed}, but the adapter's {limit_name} is {limit}: {fix}")]
    TooLarge {
        /// What does not fit, in words.
        what: String,
        /// Required size, in the unit of the limit.
        needed: u64,
        /// Name of the limit.
        limit_name: &'static str,
        /// Value of the limit.
        limit: u64,
        /// What the user can do.
        fix: &'static str,
    },
}

/// How an adapter is selected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// `CAMSIM_ADAPTER` (part of a name) if set, else discrete before integrated before software.
    #[default]
    Best,
    /// `CAMSIM_ADAPTER` if set, else a software adapter. Tests use it, so that results are comparable between
    /// machines unless a GPU is asked for.
    Software,
}

/// Description of an adapter, for display.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Device name.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    /// Graphics API.
    pub backend: String,
    /// Driver name and version.
    pub driver: String,
}

impl fmt::Display for AdapterSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, {}, {})", self.name, self.kind, self.backend, self.driver)
    }
}
