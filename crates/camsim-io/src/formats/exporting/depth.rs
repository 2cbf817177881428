//! Depth pictures of other programs: 16 bit PNG with a fixed number of steps per metre; 0 = none.

use std::{
    io::Cursor,
    path::Path,
    sync::atomic::{AtomicU32, AtomicU64, Ordering},
};

use camsim_core::scenario::Channel;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use rayon::prelude::*;

use super::run_folder::RunCamera;
use super::{DatasetError, ExportJob};
use crate::frame_file::exr_planes::read_exr;

/// Scales that are tried, from fine to coarse.
const SCALES: [f64; 12] = [5000.0, 1000.0, 500.0, 256.0, 200.0, 100.0, 50.0, 20.0, 10.0, 5.0, 2.0, 1.0];
/// Largest step of a 16 bit PNG.
const LARGEST: f64 = 65535.0;

/// One plane of an EXR file.
pub(crate) struct FloatPlane {
    pub(crate) size_px: [u32; 2],
    pub(crate) values: Vec<f32>,
}

/// Reads planes of a channel by their names.
pub(crate) fn read_planes(path: &Path, names: &[&str]) -> Result<Vec<FloatPlane>, DatasetError> {
    let fail = |message: String| DatasetError::Input { path: path.into(), message };
    let file = read_exr(path).map_err(|error| fail(error.to_string()))?;
    let plane = |name: &&str| {
        let plane = file.plane(name).map_err(&fail)?;
        Ok(FloatPlane { size_px: plane.size_px, values: plane.values.clone() })
    };
    names.iter().map(plane).collect()
}

/// Depth of a frame, row by row.
pub(crate) fn read_depth(path: &Path) -> Result<FloatPlane, DatasetError> {
    let mut planes = read_planes(path, Channel::Depth.components())?;
    planes.pop().ok_or_else(|| DatasetError::Input { path: path.into(), message: "has no Z".to_owned() })
}

/// How depth is scaled to integers.
pub(crate) struct DepthScale {
    /// Steps per metre.
    pub(crate) per_metre: f64,
    /// Whether readers expect that number.
    pub(crate) is_usual: bool,
    beyond: AtomicU64,
}

impl DepthScale {
    /// The scale that the user gave, or the finest one, `usual` at most, by which every depth fits.
    pub(crate) fn choose(
        job: &ExportJob<'_>,
        cameras: &[&RunCamera],
        usual: f64,
    ) -> Result<Self, DatasetError> {
        let per_metre = match job.options.depth_per_metre {
            Some(given) => given,
            None => {
                let largest_m = largest_depth_m(job, cameras)?;
                let fits = |scale: &&f64| **scale <= usual && largest_m * **scale <= LARGEST;
                SCALES.iter().find(fits).copied().unwrap_or(1.0)
            }
        };
        Ok(Self { is_usual: per_metre == usual, ..Self::fixed(per_metre) })
    }

    /// A scale that readers have built in.
    pub(crate) fn fixed(per_metre: f64) -> Self {
        Self { per_metre, is_usual: true, beyond: AtomicU64::new(0) }
    }

    /// A 16 bit grey PNG. Depths that do not fit become 0.
    pub(crate) fn png(&self, source: &Path) -> Result<Vec<u8>, DatasetError> {
        let FloatPlane { size_px, values } = read_depth(source)?;
        let steps = values.iter().map(|z| (f64::from(*z) * self.per_metre).round());
        let mut beyond = 0;
        let steps: Vec<u16> = steps
            .map(|step| {
                if step <= LARGEST {
                    step as u16
                } else {
                    beyond += 1;
                    0
                }
            })
            .collect();
        self.beyond.fetch_add(beyond, Ordering::Relaxed);
        png16(source, size_px, &steps, ExtendedColorType::L16)
    }

    /// What to tell about depths that did not fit.
    pub(crate) fn note(&self) -> Option<String> {
        let beyond = self.beyond.load(Ordering::Relaxed);
        let most_m = LARGEST / self.per_metre;
        (beyond > 0).then(|| {
            format!(
                "{beyond} pixels are deeper than {most_m:.1} m, which 16 bits at {} steps per metre do not hold: \
                 their depth is 0, none",
                self.per_metre
            )
        })
    }
}

/// Encodes 16 bit samples.
pub(crate) fn png16(
    source: &Path,
    size_px: [u32; 2],
    samples: &[u16],
    kind: ExtendedColorType,
) -> Result<Vec<u8>, DatasetError> {
    let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_ne_bytes()).collect();
    png(source, size_px, &bytes, kind)
}

/// Encodes samples that `source` gives.
pub(crate) fn png(
    source: &Path,
    [width, height]: [u32; 2],
    bytes: &[u8],
    kind: ExtendedColorType,
) -> Result<Vec<u8>, DatasetError> {
    let mut out = Cursor::new(Vec::new());
    PngEncoder::new(&mut out)
        .write_image(bytes, width, height, kind)
        .map_err(|error| DatasetError::Input { path: source.into(), message: error.to_string() })?;
    Ok(out.into_inner())
}

/// The largest depth of all frames.
fn largest_depth_m(job: &ExportJob<'_>, cameras: &[&RunCamera]) -> Result<f64, DatasetError> {
    let largest = AtomicU32::new(0);
    for camera in cameras {
        camera.frames.par_iter().try_for_each(|frame| {
            if (job.target.watch.is_stopped)() {
                return Err(DatasetError::Stopped);
            }
            let plane = read_depth(&camera.file(frame, "depth"))?;
            let here = plane.values.iter().copied().filter(|z| z.is_finite()).fold(0.0, f32::max);
            // Bits of floats that are not negative ascend with them.
            largest.fetch_max(here.to_bits(), Ordering::Relaxed);
            Ok(())
        })?;
    }
    Ok(f64::from(f32::from_bits(largest.into_inner())))
}
