//! The native half of the Python package `camsim`: thin functions over the `camsim` crate. What users see, with
//! its documentation, is in `python/camsim`.
//!
//! | module | holds |
//! |---|---|
//! | [`error`] | failures as Python exceptions |
//! | [`engine`] | the renderers of this process, and sessions that wait for their next frames |
//! | [`source`] | where a scenario comes from |
//! | [`scenario`] | a scenario with what it has loaded |
//! | [`stream`] | frames one after the other, rendered ahead on a thread of their own |
//! | [`frame`] | a frame as numpy arrays that own what Rust has allocated |
//! | [`camera`], [`lens`], [`trajectory`], [`sensors`] | parts of a scenario, over arrays |
//! | [`apply`], [`pictures`] | the camera on pictures from elsewhere; comparison; boards |
//! | [`command`] | the command line |
//! | [`arrays`] | tables of numbers from numpy and to it |

use pyo3::prelude::*;

mod apply;
mod arrays;
mod camera;
mod command;
mod engine;
mod error;
mod frame;
mod lens;
mod pictures;
mod scenario;
mod sensors;
mod source;
mod stream;
mod trajectory;

/// Native half of camsim; import `camsim` instead.
#[pymodule]
mod _camsim {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::{
        apply::apply,
        camera::Camera,
        command::run_main,
        frame::{srgb8, write_picture},
        lens::Lens,
        pictures::{board_of_file, board_of_keys, compare, compare_files},
        scenario::{Scenario, default_scenario, unpack_demo},
        stream::{Stream, stop_streams},
        trajectory::Trajectory,
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("UNSET", camsim::io::scenario_file::UNSET)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
