//! The mathematics of camsim, in f64, without GPU and without file formats.
//!
//! Modules stand in the order of the data flow: scenario -> log -> tracker -> trajectory -> camera -> shutter
//! -> frame plan -> ideal frame -> lens inverse -> temporal inverse -> gather -> photometric -> metrics.
//!
//! # Conventions
//!
//! | thing | convention |
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

pub mod scenario;

pub mod pose;

pub mod geodesy;

pub mod flight_log;

pub mod tracker;

pub mod trajectory;

pub mod mount;

pub mod lens;

pub mod camera;

pub mod shutter;

pub mod scene;

pub mod sequence;

pub mod temporal;

pub mod photometric;

pub mod noise;

pub mod apply;

pub mod frame;

pub mod metrics;

pub mod silhouette;

pub mod reference;

pub mod waves;
