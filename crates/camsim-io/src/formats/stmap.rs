//! STmaps: two float pictures with, at each pixel, the position in the other picture to fetch from.
//!
//! Red is s = (x + 0.5) / width, green t = 1 - (y + 0.5) / height, as compositors count from the corner at the
//! bottom left. `undistort` fetches from the distorted picture, `distort` from a pinhole picture of the same
//! size and camera matrix. Where there is nothing to fetch, both are -1.

use std::path::Path;

use camsim_core::{
    camera::CameraModel,
    scenario::{ExrCompression, ExrPixel},
};
use glam::DVec2;
use rayon::prelude::*;

use super::writing::exported::{Content, Writer};
use super::writing::{Calibration, CalibrationError, CalibrationFile};
use crate::write::encode_exr;

pub(crate) const WRITER: Writer = Writer::new("stmap", "undistort.exr", Content::Pictures(files), &[]);

/// Name and content of both pictures.
///
/// # Errors
/// The camera is impossible.
fn files(camera: &Calibration) -> Result<[CalibrationFile; 2], CalibrationError> {
    let refuse = |message: String| CalibrationError::Refused(format!("{}: {message}", camera.label()));
    let model = CameraModel::from_spec(&camera.spec).map_err(|error| refuse(error.to_string()))?;
    let lens = &camera.intrinsics;
    let (focal, centre) = (DVec2::from_array(lens.focal_px), DVec2::from_array(lens.principal_px));
    let undistort = |pixel: DVec2| {
        let ideal = (pixel - centre) / focal;
        model.lens.contains(ideal).then(|| model.project(ideal))
    };
    let distort = |pixel: DVec2| model.unproject(pixel).map(|ideal| ideal * focal + centre);
    let encode = |name: &'static str, samples: &[f32]| {
        let (pixel, compression) = (ExrPixel::Float, ExrCompression::Zip16);
        encode_exr(Path::new(name), lens.size_px, &["R", "G"], samples, pixel, compression)
            .map(|bytes| CalibrationFile { name, bytes })
            .map_err(|error| refuse(error.to_string()))
    };
    Ok([
        encode("undistort.exr", &map(lens.size_px, undistort))?,
        encode("distort.exr", &map(lens.size_px, distort))?,
    ])
}

/// Positions s, t of the pixels that `source` gives, by pixels in rows.
fn map([width, height]: [u32; 2], source: impl Fn(DVec2) -> Option<DVec2> + Sync) -> Vec<f32> {
    let size = DVec2::new(f64::from(width), f64::from(height));
    let position = |index: u32| {
        let pixel = DVec2::new(f64::from(index % width), f64::from(index / width));
        match source(pixel).filter(|found| found.is_finite()) {
            Some(found) => {
                let [s, t] = ((found + 0.5) / size).to_array();
                [s as f32, (1.0 - t) as f32]
            }
            None => [-1.0; 2],
        }
    };
    (0..width * height).into_par_iter().flat_map_iter(position).collect()
}
