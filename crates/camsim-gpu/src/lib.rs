//! The ideal render and the reverse pipeline on wgpu.

#![warn(missing_docs)]

pub mod reverse {
    //! The reverse pipeline: output pixel back to ideal frame, one file per stage.

    pub mod lens_inverse;
}
