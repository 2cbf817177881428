//! Camera intrinsics: conversion between pixels and ideal rays, the zoom table, and the check of a
//! calibration.
//!
//! Pixel coordinates are those of OpenCV: integer coordinates are pixel centres, (0, 0) is the centre of the
//! top-left pixel, and a centred principal point is `((W - 1)/2, (H - 1)/2)`.

use std::path::PathBuf;

use glam::{DVec2, DVec3};

use crate::lens::{Lens, LensError, LensModel};
use crate::{scenario::CameraSpec, scenario::MAX_SIDE_PX};

mod bulk;
mod check;
mod field;
mod lens_inverse;
mod zoom;

pub use bulk::BulkInverse;
pub use check::{LensCheck, fringes_px};
pub use lens_inverse::INVALID_UV;
pub use zoom::ZoomTable;

/// Invalid camera parameters.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// Zero or too large size.
    #[error("camera.size_px is [{0}, {1}]: both must be 1 to {MAX_SIDE_PX}")]
    Size(u32, u32),
    /// Zero, negative or non-finite focal length.
    #[error(
        "{key} is [{x}, {y}]: both must be positive finite pixels (a mirrored axis is not a camera; flip the image instead)"
    )]
    Focal {
        /// Key in the file.
        key: String,
        /// fx.
        x: f64,
        /// fy.
        y: f64,
    },
    /// Non-finite principal point.
    #[error("{key} is [{x}, {y}]: both must be finite pixels; leave the key out for the image centre")]
    PrincipalPoint {
        /// Key in the file.
        key: String,
        /// cx.
        x: f64,
        /// cy.
        y: f64,
    },
    /// Invalid lens coefficients.
    #[error("{key}: {source}")]
    Lens {
        /// Section in the file.
        key: String,
        /// What is wrong.
        source: LensError,
    },
    /// Zoom values that are not ascending.
    #[error(
        "camera.zoom[{index}].at is {at}: the zoom table must be finite and strictly ascending in `at`; sort it and merge equal entries"
    )]
    ZoomOrder {
        /// Position from 0.
        index: usize,
        /// The value.
        at: f64,
    },
    /// A zoom value that is not a number.
    #[error("the zoom value is {0}: it must be a finite number; check camera.zoom_track")]
    ZoomValue(f64),
    /// A kernel that is only a name.
    #[error("camera.point_spread.kernel: {} has not been read", .0.display())]
    Kernel(PathBuf),
}

/// Checked intrinsics of a camera with its lens. Immutable.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraModel {
    /// Width, height.
    pub size_px: [u32; 2],
    /// fx, fy.
    pub focal_px: DVec2,
    /// cx, cy.
    pub principal_point_px: DVec2,
    /// Lens model with its distortion.
    pub lens: Lens,
}

impl CameraModel {
    /// A camera from plain numbers. A principal point of `None` is the image centre.
    pub fn new(
        size_px: [u32; 2],
        focal_px: [f64; 2],
        principal_point_px: Option<[f64; 2]>,
        model: LensModel,
        coefficients: &[f64],
    ) -> Result<Self, CameraError> {
        Self::with_key("camera", size_px, focal_px, principal_point_px, |reach, _, _| {
            Lens::with_reach(model, coefficients, reach)
        })
    }

    /// A camera from `[camera]`, without its zoom table (see [`CameraModel::at_zoom`]).
    pub fn from_spec(spec: &CameraSpec) -> Result<Self, CameraError> {
        let kernel = spec.point_spread.as_ref().and_then(|spread| spread.kernel.as_ref());
        if let Some(file) = kernel.filter(|file| !file.is_read()) {
            return Err(CameraError::Kernel(file.path.clone()));
        }
        let lens = |reach, focal_px, principal_px| {
            Lens::of_camera(spec, focal_px, principal_px, &spec.lens.coefficients, reach)
        };
        Self::with_key("camera", spec.size_px, spec.focal_px, spec.principal_point_px, lens)
    }

    /// A camera from `[camera]` at one zoom value, by the zoom table if there is one, else as
    /// [`CameraModel::from_spec`].
    pub fn at_zoom(spec: &CameraSpec, zoom: f64) -> Result<Self, CameraError> {
        match ZoomTable::from_spec(spec)? {
            Some(table) => table.at(zoom),
            None => Self::from_spec(spec),
        }
    }

    fn with_key(
        key: &str,
        size_px: [u32; 2],
        [fx, fy]: [f64; 2],
        principal_point_px: Option<[f64; 2]>,
        lens: impl FnOnce(f64, DVec2, DVec2) -> Result<Lens, LensError>,
    ) -> Result<Self, CameraError> {
        let [width, height] = size_px;
        if width == 0 || height == 0 || width > MAX_SIDE_PX || height > MAX_SIDE_PX {
            return Err(CameraError::Size(width, height));
        }
        if !(fx.is_normal() && fy.is_normal() && fx > 0.0 && fy > 0.0) {
            return Err(CameraError::Focal { key: format!("{key}.focal_px"), x: fx, y: fy });
        }
        let centre = [0.5 * (f64::from(width) - 1.0), 0.5 * (f64::from(height) - 1.0)];
        let [cx, cy] = principal_point_px.unwrap_or(centre);
        if !(cx.is_finite() && cy.is_finite()) {
            return Err(CameraError::PrincipalPoint {
                key: format!("{key}.principal_point_px"),
                x: cx,
                y: cy,
            });
        }
        let focal_px = DVec2::new(fx, fy);
        let principal_point_px = DVec2::new(cx, cy);
        // The start table of the inverse covers just the image.
        let reach = image_corners(size_px)
            .into_iter()
            .map(|corner| ((corner - principal_point_px) / focal_px).length())
            .fold(0.0, f64::max);
        let lens = lens(reach, focal_px, principal_point_px)
            .map_err(|source| CameraError::Lens { key: key.to_owned(), source })?;
        Ok(Self { size_px, focal_px, principal_point_px, lens })
    }

    /// Projection of the ideal ray `(u, v, 1)`, pixels. The formula is evaluated beyond the fold as well,
    /// where [`Lens::contains`] is false.
    #[inline]
    pub fn project(&self, ideal: DVec2) -> DVec2 {
        self.pixel_from_distorted(self.lens.distort(ideal))
    }

    /// Projection of a ray of any length, pixels; beyond the principal branch as [`Self::project`].
    pub fn project_ray(&self, ray: DVec3) -> DVec2 {
        self.pixel_from_distorted(self.lens.image(ray))
    }

    /// Unit ray at a pixel coordinate, also beyond what an ideal plane holds; `None` where the lens has no
    /// inverse.
    pub fn ray(&self, pixel: DVec2) -> Option<DVec3> {
        self.lens.ray(self.distorted_from_pixel(pixel))
    }

    /// Focal lengths in the centre of the picture: those of a pinhole with as many pixels a radian there.
    pub fn central_focal_px(&self) -> DVec2 {
        self.focal_px * self.lens.axial_magnification()
    }

    /// Ideal `(u, v)` at a pixel coordinate; `None` where the lens has no inverse.
    pub fn unproject(&self, pixel: DVec2) -> Option<DVec2> {
        self.lens.undistort(self.distorted_from_pixel(pixel))
    }

    /// As [`CameraModel::unproject`] at a pixel's centre; `None` also where another face makes the pixel.
    #[must_use]
    pub fn unproject_pixel(&self, [x, y]: [u32; 2]) -> Option<DVec2> {
        let distorted = self.distorted_from_pixel(DVec2::new(f64::from(x), f64::from(y)));
        if self.lens.holds(distorted) { self.lens.undistort(distorted) } else { None }
    }

    /// `f x + c`.
    #[inline]
    pub(crate) fn pixel_from_distorted(&self, distorted: DVec2) -> DVec2 {
        distorted * self.focal_px + self.principal_point_px
    }

    /// `(p - c) / f`.
    pub fn distorted_from_pixel(&self, pixel: DVec2) -> DVec2 {
        (pixel - self.principal_point_px) / self.focal_px
    }
}

/// Outer corners of the corner pixels.
fn image_corners([width, height]: [u32; 2]) -> [DVec2; 4] {
    let (right, bottom) = (f64::from(width) - 0.5, f64::from(height) - 0.5);
    [DVec2::new(-0.5, -0.5), DVec2::new(right, -0.5), DVec2::new(-0.5, bottom), DVec2::new(right, bottom)]
}

#[cfg(test)]
mod tests;
