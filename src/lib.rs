//! Pictures of a real, imperfect airborne camera, and the truth about them.
//!
//! A scenario (TOML) names a flight log, a camera and a scene; see the README for one. This loads it, renders
//! two frames on the processor and reads their pixels:
//!
//! ```
//! use camsim::prelude::*;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
//! let scenario = "assets/pattern.toml";
//! let engine = Engine::open(Backend::Cpu)?; // Backend::Auto: a graphics card where there is one
//! let mut session = engine.session::<NoError>(load(scenario)?.sequence, &[Channel::Color, Channel::Depth])?;
//! session.render::<NoError>(0..2, &mut |finished| {
//!     let frame = &finished.frame;
//!     let [width, height] = frame.size_px;
//!     let middle = (height / 2 * width + width / 2) as usize;
//!     let color = &frame.color_rgba()[4 * middle..][..4];
//!     let depth_m = frame.depth_m().map(|depth_m| depth_m[middle]);
//!     println!("{}: {color:?} (linear R G B A), {depth_m:?} m", frame.index);
//!     # assert!(color[3] == 1.0 && depth_m > Some(1.0));
//!     Ok(())
//! })?;
//! # Ok(())
//! # }
//! ```
//!
//! | module | what |
//! |---|---|
//! | [`prelude`] | what most programs need |
//! | [`core`] | scenario, trajectory, lens, scene: the mathematics in f64, and the reference renderer |
//! | [`io`] | files in, files out |
//! | [`plan`] | what each frame takes, and the error that it leaves |
//! | [`engine`] | renders sequences, by [`cpu`] and `gpu` |
//! | [`cli`] | the command line |
//! | `gpu`, `lab`, `viewer` | the renderer on wgpu, experiments and the viewer, with the features of these names |

pub use camsim_cli as cli;
pub use camsim_core as core;
pub use camsim_cpu as cpu;
pub use camsim_engine as engine;
#[cfg(feature = "gpu")]
pub use camsim_gpu as gpu;
pub use camsim_io as io;
#[cfg(feature = "lab")]
pub use camsim_lab as lab;
pub use camsim_plan as plan;
#[cfg(feature = "viewer")]
pub use camsim_viewer as viewer;

pub mod prelude;
