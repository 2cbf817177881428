//! The planner: decides how each frame is made (which passes, how large, how many samples, and what is
//! skipped and why) and predicts the error that this leaves.
//!
//! A plan is plain data and a pure function of scenario and frame number: `camsim explain` prints it, the
//! renderers execute it, and nothing in it depends on the frame before.
//!
//! ```no_run
//! # use std::sync::Arc;
//! # use camsim_core::{scenario::Channel, sequence::Sequence};
//! # use camsim_plan::{PlanError, Planner};
//! # fn explain(sequence: Arc<Sequence>) -> Result<(), PlanError> {
//! let planner = Planner::new(sequence, &[Channel::Color], 16_384)?;
//! let plan = planner.plan(0)?;
//! println!("{plan}");
//! assert!(plan.predicted.source_error_kept, "{:?}", plan.predicted.source_error_obstacle);
//! # Ok(())
//! # }
//! ```
//!
//! The modules are layers; each uses only itself and those above it in this list (`tests/layers.rs` checks
//! it):
//!
//! | module | holds |
//! |---|---|
//! | `ir` | the plan and its parts: results, which compute nothing |
//! | `view` | what the camera sees: rays, probes, surfaces, motion, exposure, the neighbourhoods of probes |
//! | `source_error` | exact sources of the probes, dry runs of every temporal inverse, rounding, disocclusion |
//! | `picture_error` | texture spectra, transfer functions, and the picture error by each cause |
//! | `choose` | budget, prices, and the choices: sampling, silhouettes, temporal inverse, key frames, sharing |
//! | `planner` | the [`Planner`], which puts a plan together from the choices |
//! | `tracks` | where frames show given points of the scene |
//! | [`uniforms`] | the numbers of a frame as the renderers read them |
//! | [`adapter`] | what executes plans on a graphics adapter |
//! | `describe` | the plan as text and as JSON |
//!
//! The temporal inverse and the terrain's level of detail are chosen in `choose`, not in `source_error`: the
//! choice depends on what source errors cost in the picture too.

pub mod adapter;
mod choose;
mod describe;
mod ir;
mod picture_error;
mod planner;
mod source_error;
mod tracks;
pub mod uniforms;
mod view;

pub use choose::{paper, placement};
pub use describe::{LevelOfDetail, PlanSummary};
pub use ir::{
    error_map::{ErrorMap, PixelError, SourceError},
    frame_plan::FramePlan,
    key_frame::KeyFrame,
    limits::{MAX_IDEAL_PX, MAX_KEYS, NEAR_M, SIZE_QUANTUM_PX},
    linear_fog::LinearFog,
    motion::{Departure, Motion},
    placement::{AdapterClass, Backend, Capabilities, Placement, Renderer},
    plan_error::PlanError,
    predicted::{BlendedDepthError, Disocclusion, Predicted, SilhouetteError, TerrainError},
    row_tables::{RowPoses, RowTimes, row_poses, row_records, row_times, table_shape},
    seen_plane::SeenPlane,
    skip::Skip,
    stages::{
        BlurStage, EdgeStage, NodeDepths, PathStage, PrefilterTaps, RayStage, ShadowStage, TemporalStage,
    },
};
pub use planner::Planner;
pub use source_error::pixel_truth::{FrameRays, PHASES, PixelHit, PixelTruth};
pub use tracks::Tracks;
pub use view::faces::faces;
pub use view::lens_reach::LensReach;
pub use view::surfaces::Among;
