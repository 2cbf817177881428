//! The mathematics of camsim: geometry, camera models, motion, scenes and image formation, in f64, without
//! GPU and without file formats. The functions that the renderers must reproduce (their *twins*) and the
//! reference renderer that they are tested against are here.
//!
//! ```
//! use camsim_core::{lens::Lens, scenario::LensModel};
//! use glam::DVec2;
//!
//! # fn main() -> Result<(), camsim_core::lens::LensError> {
//! // Barrel distortion, k1 = -0.3: from the ideal (u, v) to the distorted image point and back.
//! let lens = Lens::new(LensModel::BrownConrady, &[-0.3])?;
//! let distorted = lens.distort(DVec2::new(0.2, 0.1));
//! assert!(distorted.length() < DVec2::new(0.2, 0.1).length());
//! let ideal = lens.undistort(distorted).expect("inside the fold");
//! assert!((ideal - DVec2::new(0.2, 0.1)).length() < 1e-12);
//! # Ok(())
//! # }
//! ```
//!
//! # Modules, in the order of the data flow
//!
//! | module | content |
//! |---|---|
//! | [`scenario`], [`validate`] | the input of a run: all keys; the checks of their values |
//! | [`resized`], [`twin`] | scenarios made from others: cameras that deliver a part of their picture, better cameras |
//! | [`geodesy`], [`flight_log`] | WGS-84 and local frames; a log, cleaned |
//! | [`tracker`], [`trajectory`], [`mount`], [`pose`] | from a log to the pose of the camera at any instant |
//! | [`lens`], [`camera`], [`shutter`] | distortion and its inverse, intrinsics with zoom, exposure times of rows |
//! | [`sensors`] | inertial units, satellite receivers, barometers, magnetometers |
//! | [`scene`] | terrain, meshes, textures, light, levels of detail, calibration boards |
//! | [`timing_faults`] | late triggers, wrong stamps, dropped and doubled frames |
//! | [`sequence`] | a loaded scenario |
//! | [`temporal`] | temporal inverse and gather: from an output ray to its source in an ideal frame |
//! | [`photometric`], [`vignetting`], [`noise`], [`deferred_photometric`] | vignette, gain, noise, saturation |
//! | [`exposure`], [`auto_exposure`] | exposure time and gain of each frame; exposures that follow the pictures |
//! | [`imaging`] | the lens as a blur; the image sensor: electrons, digital numbers, mosaics |
//! | [`mtf`] | transfer function of a picture, from a slanted edge |
//! | [`distribution`] | drawn numbers of random scenarios |
//! | [`apply`] | the reverse pipeline on ideal frames of any origin |
//! | [`frame`], [`metrics`], [`silhouette`] | finished frames, and measures of their errors |
//! | [`reference`](mod@reference) | the reference renderer, by f64 rays |
//! | [`transfer`] | transfer functions of means and samples |
//! | [`simd`] | vector instructions beyond the baseline of the target |
//!
//! # Conventions
//!
//! | quantity | convention |
//! |---|---|
//! | World | local NED (north, east, down), metres, f64, about a WGS-84 origin |
//! | Body | FRD (forward, right, down); Euler angles are ZYX and only an input form |
//! | Camera | optical frame, as in OpenCV and ROS: x right, y down, z forward |
//! | Pixel | integer coordinates are pixel centres, (0, 0) is the centre of the top-left pixel |
//! | Lens | ideal (u, v) = (x/z, y/z) -> distorted; OpenCV coefficient order `k1 k2 p1 p2 k3 k4 k5 k6` |
//! | Time | seconds of the log (f64); frame i has stamp start + (i + phase)/fps |
//! | Rows | a row's time is its mid-exposure; the image centre has exactly -delay |
//! | Depth | planar z in the row's own camera, metres, 0 = nothing |
//! | Angles | radians inside, degrees only where a name ends in `_deg` |
//! | Quaternions | `a_from_b` takes coordinates in b to coordinates in a |

#![warn(missing_docs)]

pub use camsim_scenario as scenario;

pub mod apply;
pub mod auto_exposure;
pub mod camera;
pub mod deferred_photometric;
pub mod distribution;
pub mod exposure;
pub mod flight_log;
pub mod frame;
pub mod geodesy;
pub mod imaging;
pub mod lens;
pub mod metrics;
pub mod mount;
pub mod mtf;
pub mod noise;
pub mod photometric;
pub mod pose;
pub mod reference;
pub mod resized;
pub mod row_time;
pub mod scene;
pub mod sensors;
pub mod sequence;
pub mod shutter;
pub mod silhouette;
pub mod simd;
pub mod temporal;
pub mod timing_faults;
pub mod tracker;
pub mod tracks;
pub mod trajectory;
pub mod transfer;
pub mod twin;
pub mod validate;
pub mod vignetting;
