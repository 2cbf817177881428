//! Calibrations by zoom value.

use super::{CameraError, CameraModel};
use crate::scenario::{CameraSpec, ZoomSpec};
use crate::{lens::Lens, lens::ModelFacts};

/// The `[[camera.zoom]]` table. Every number of a calibration is linear in the zoom value between two
/// entries, and constant beyond the ends.
///
/// Linear interpolation cannot overshoot, so quantities that are monotone over the table (the focal length,
/// for instance) stay monotone.
#[derive(Clone, Debug, PartialEq)]
pub struct ZoomTable {
    /// What does not depend on the zoom value.
    spec: Box<CameraSpec>,
    entries: Vec<ZoomSpec>,
}

impl ZoomTable {
    /// The table of a camera; `None` without one. Every entry is checked as a camera of its own.
    pub fn from_spec(spec: &CameraSpec) -> Result<Option<Self>, CameraError> {
        if spec.zoom.is_empty() {
            return Ok(None);
        }
        let mut last = f64::NEG_INFINITY;
        for (index, entry) in spec.zoom.iter().enumerate() {
            if !(entry.at.is_finite() && entry.at > last) {
                return Err(CameraError::ZoomOrder { index, at: entry.at });
            }
            last = entry.at;
        }
        // The longest entry determines the number of coefficients; shorter ones end in defaults.
        let count = spec.zoom.iter().map(|entry| entry.coefficients.len()).max().unwrap_or(0);
        let mut entries = spec.zoom.clone();
        for (index, entry) in entries.iter_mut().enumerate() {
            let facts = ModelFacts::of(spec.lens.model);
            entry.coefficients = (0..count).map(|i| facts.or_default(&entry.coefficients, i)).collect();
            camera(&format!("camera.zoom[{index}]"), spec, entry)?;
        }
        Ok(Some(Self { spec: Box::new(CameraSpec { zoom: Vec::new(), ..spec.clone() }), entries }))
    }

    /// The calibration at a zoom value.
    pub fn at(&self, zoom: f64) -> Result<CameraModel, CameraError> {
        if zoom.is_nan() {
            return Err(CameraError::ZoomValue(zoom));
        }
        let above = self.entries.partition_point(|entry| entry.at <= zoom);
        let low = &self.entries[above.saturating_sub(1)];
        let high = &self.entries[above.min(self.entries.len() - 1)];
        let fraction =
            if high.at > low.at { ((zoom - low.at) / (high.at - low.at)).clamp(0.0, 1.0) } else { 0.0 };
        let mix = |a: f64, b: f64| a + (b - a) * fraction;
        let principal_point_px = match (low.principal_point_px, high.principal_point_px) {
            (None, None) => None,
            (a, b) => {
                let centre = self.spec.size_px.map(|size| 0.5 * (f64::from(size) - 1.0));
                let (a, b) = (a.unwrap_or(centre), b.unwrap_or(centre));
                Some([mix(a[0], b[0]), mix(a[1], b[1])])
            }
        };
        let entry = ZoomSpec {
            at: zoom,
            focal_px: [mix(low.focal_px[0], high.focal_px[0]), mix(low.focal_px[1], high.focal_px[1])],
            principal_point_px,
            coefficients: low.coefficients.iter().zip(&high.coefficients).map(|(a, b)| mix(*a, *b)).collect(),
        };
        camera("camera.zoom", &self.spec, &entry)
    }

    /// Index of the entry with the nearest zoom value (the lower of two equally near). The lens map of that
    /// entry provides the start of the inverse.
    pub fn nearest(&self, zoom: f64) -> usize {
        let above = self.entries.partition_point(|entry| entry.at <= zoom).min(self.entries.len() - 1);
        let below = above.saturating_sub(1);
        if (zoom - self.entries[below].at).abs() <= (self.entries[above].at - zoom).abs() {
            below
        } else {
            above
        }
    }

    /// The entries, by ascending zoom value.
    pub fn entries(&self) -> &[ZoomSpec] {
        &self.entries
    }
}

fn camera(key: &str, spec: &CameraSpec, entry: &ZoomSpec) -> Result<CameraModel, CameraError> {
    let lens = |reach, focal_px, principal_px| {
        Lens::of_camera(spec, focal_px, principal_px, &entry.coefficients, reach)
    };
    CameraModel::with_key(key, spec.size_px, entry.focal_px, entry.principal_point_px, lens)
}
