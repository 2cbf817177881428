//! Calibrations by zoom value.

use super::{CameraError, CameraModel};
use crate::lens::Lens;
use crate::scenario::{CameraSpec, LensModel, ZoomSpec};

/// The `[[camera.zoom]]` table. Every number of a calibration is linear in the zoom value between two
/// entries, and constant beyond the ends.
///
/// Linear interpolation cannot overshoot, so quantities that are monotone over the table (the focal length,
/// for instance) stay monotone.
#[derive(Clone, Debug, PartialEq)]
pub struct ZoomTable {
    size_px: [u32; 2],
    model: LensModel,
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
            let facts = spec.lens.model.facts();
            entry.coefficients = (0..count).map(|i| facts.or_default(&entry.coefficients, i)).collect();
            camera(&format!("camera.zoom[{index}]"), spec.size_px, spec.lens.model, entry)?;
        }
        Ok(Some(Self { size_px: spec.size_px, model: spec.lens.model, entries }))
    }

    /// The calibration at a zoom value.
    pub fn at(&self, zoom: f64) -> Result<CameraModel, CameraError> {
        if zoom.is_nan() {
            return Err(CameraError::ZoomValue(zoom));
        }
        let above = self.entries.partition_point(|entry| entry.at <= zoom);
        let low = &self.entries[above.saturating_sub(1)];
        let high = &self.entries[above.min(self.entries.len() - 1)];
        let share =
            if high.at > low.at { ((zoom - low.at) / (high.at - low.at)).clamp(0.0, 1.0) } else { 0.0 };
        let mix = |a: f64, b: f64| a + (b - a) * share;
        let principal_point_px = match (low.principal_point_px, high.principal_point_px) {
            (None, None) => None,
            (a, b) => {
                let centre = self.size_px.map(|size| 0.5 * (f64::from(size) - 1.0));
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
        camera("camera.zoom", self.size_px, self.model, &entry)
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

fn camera(
    key: &str,
    size_px: [u32; 2],
    model: LensModel,
    entry: &ZoomSpec,
) -> Result<CameraModel, CameraError> {
    CameraModel::with_key(key, size_px, entry.focal_px, entry.principal_point_px, |reach| {
        Lens::with_reach(model, &entry.coefficients, reach)
    })
}
