//! `[camera.resized]`: a camera that delivers a part of the calibrated picture, or that picture at another size.
//!
//! [`delivered`] turns the calibration into that of the delivered picture when a file is read, so that
//! nothing after it knows of two pictures. A point of the scene keeps its ray: with the half-pixel rule of
//! pixel centres, `x' = (x - left + 0.5) s - 0.5`.
//!
//! A pixel of the delivered picture has the area of `n = 1/(s_x s_y)` of the sensor's, and is their sum: electrons
//! grow by n, and noise that is independent between pixels by `sqrt(n)`.

use glam::DVec2;

use crate::scenario::{
    Binning, CameraSpec, ChromaticSpec, FieldOr, FilesOfSpec, ImageCircleSpec, MAX_SIDE_PX, MadeOf, Parity,
    PointSpreadSpec, PrimaryLensSpec, Problem, Readout, ResizedSpec, ShutterSpec, VignettingSpec, ZoomSpec,
};

mod sensor;
#[cfg(test)]
mod tests;

/// How points of the calibrated picture become those of the delivered one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resizing {
    /// Size of the delivered picture.
    pub size_px: [u32; 2],
    /// Its part of the calibrated picture: left, top, width, height.
    pub part_px: [u32; 4],
    /// Size of a pixel of the calibrated picture, pixels of the delivered one.
    pub scale: DVec2,
}

impl Resizing {
    /// The change of a picture of this size.
    ///
    /// # Errors
    /// Keys that state no part or no size.
    pub fn new(spec: &ResizedSpec, [width, height]: [u32; 2]) -> Result<Self, Problem> {
        let [left, top, across, down] = spec.crop_px.unwrap_or([0, 0, width, height]);
        let ends = |first: u32, length: u32, whole: u32| {
            length >= 1 && u64::from(first) + u64::from(length) <= u64::from(whole)
        };
        if !(ends(left, across, width) && ends(top, down, height)) {
            return Err(problem(
                "crop_px",
                format!(
                    "is [left, top, width, height] = {:?}, which is not a part of the {width} x {height} pixels of \
                     camera.size_px; left + width is at most {width}, top + height at most {height}",
                    [left, top, across, down]
                ),
            ));
        }
        let counts = [spec.binning.is_some(), spec.scale.is_some(), spec.size_px.is_some()];
        if counts.iter().filter(|is_given| **is_given).count() > 1 {
            return Err(Problem {
                key: "camera.resized".into(),
                message:
                    "has more than one of binning, scale and size_px, and each states the size; keep one of \
                          them (crop_px may stand beside it)"
                        .into(),
            });
        }
        let (used, size_px) = match (spec.binning, spec.scale, spec.size_px) {
            (Some(binning), _, _) => binned(binning, [across, down])?,
            (None, Some(scale), _) => ([across, down], scaled(scale, [across, down])?),
            (None, None, size_px) => ([across, down], size_px.unwrap_or([across, down])),
        };
        if !size_px.iter().all(|side| (1..=MAX_SIDE_PX).contains(side)) {
            return Err(problem(
                "size_px",
                format!("must be [width, height], each 1..{MAX_SIDE_PX}, not {size_px:?}"),
            ));
        }
        let scale = DVec2::from(size_px.map(f64::from)) / DVec2::from(used.map(f64::from));
        Ok(Self { size_px, part_px: [left, top, used[0], used[1]], scale })
    }

    /// The point of the delivered picture that a point of the calibrated one becomes.
    #[must_use]
    pub fn point(&self, at: DVec2) -> DVec2 {
        (at - self.corner_px() + 0.5) * self.scale - 0.5
    }

    /// The point of the calibrated picture that becomes a point of the delivered one.
    #[must_use]
    pub fn calibrated_point(&self, at: DVec2) -> DVec2 {
        (at + 0.5) / self.scale - 0.5 + self.corner_px()
    }

    fn corner_px(&self) -> DVec2 {
        DVec2::new(f64::from(self.part_px[0]), f64::from(self.part_px[1]))
    }

    /// Pixels of the calibrated picture in the area of one of the delivered.
    fn pixels(&self) -> f64 {
        1.0 / (self.scale.x * self.scale.y)
    }

    fn is_uniform(&self) -> bool {
        (self.scale.x / self.scale.y - 1.0).abs() < 1e-12
    }

    fn pair(&self, at: [f64; 2]) -> [f64; 2] {
        self.point(at.into()).into()
    }

    fn focal(&self, focal_px: [f64; 2]) -> [f64; 2] {
        (DVec2::from(focal_px) * self.scale).into()
    }

    /// What of a camera cannot follow the change.
    fn problems(&self, camera: &CameraSpec) -> Vec<Problem> {
        let mut found = Vec::new();
        if !self.is_uniform() {
            found.extend(round_keys(camera).map(|key| self.squeezed(key)));
        }
        found.extend(self.kernel_problem(camera.point_spread.as_ref()));
        found.extend(self.shutter_problem(camera));
        found.extend(sensor::mosaic_problem(self, camera.sensor.as_ref()));
        found
    }

    fn squeezed(&self, key: &str) -> Problem {
        let [_, _, width, height] = self.part_px;
        let [across, down] = self.size_px;
        Problem {
            key: "camera.resized".into(),
            message: format!(
                "makes {across} x {down} pixels of {width} x {height}, {:.6} across and {:.6} down, and {key} is of one \
                 scale: choose a camera.resized.crop_px of the same shape as the size, or leave {key} out",
                self.scale.x, self.scale.y
            ),
        }
    }

    fn kernel_problem(&self, spread: Option<&PointSpreadSpec>) -> Option<Problem> {
        let spread = spread.filter(|spread| spread.kernel.is_some())?;
        let values = f64::from(spread.kernel_oversampling) / self.scale.x;
        let is_whole = (values - values.round()).abs() < 1e-9 && (1.0..=64.0).contains(&values.round());
        (!is_whole).then(|| Problem {
            key: "camera.resized".into(),
            message: format!(
                "makes {values:.3} values of camera.point_spread.kernel a pixel, and a kernel has a whole number from 1 \
                 to 64: choose a scale that divides camera.point_spread.kernel_oversampling = {} so, or resample the kernel",
                spread.kernel_oversampling
            ),
        })
    }

    fn shutter_problem(&self, camera: &CameraSpec) -> Option<Problem> {
        let shutter = &camera.shutter;
        let [_, top, _, height] = self.part_px;
        let below = camera.size_px[1] - top - height;
        let is_split = matches!(shutter.readout, Readout::MiddleOutward | Readout::EdgesInward);
        if is_split && top != below {
            return Some(problem(
                "crop_px",
                format!(
                    "leaves {top} rows above and {below} below, and camera.shutter.readout reads two equal halves: leave \
                     as many rows above as below"
                ),
            ));
        }
        let is_interlaced = shutter.interlace_ms != FieldOr::Ms(0.0);
        (is_interlaced && self.scale.y != 1.0).then(|| Problem {
            key: "camera.resized".into(),
            message: "would mix rows of both fields of camera.shutter.interlace_ms: leave the number of rows as it is \
                      (crop_px may take some away), or set interlace_ms to 0"
                .into(),
        })
    }

    /// The camera of the delivered picture.
    fn apply(&self, camera: &CameraSpec) -> CameraSpec {
        let mut new = camera.clone();
        let is_whole = self.part_px == [0, 0, camera.size_px[0], camera.size_px[1]];
        let [width, height] = camera.size_px.map(f64::from);
        let centre = [0.5 * (width - 1.0), 0.5 * (height - 1.0)];
        // A centred principal point of the whole picture stays the centre, to the last bit.
        let principal = |given: Option<[f64; 2]>| match given {
            None if is_whole => None,
            given => Some(self.pair(given.unwrap_or(centre))),
        };
        new.resized = None;
        new.made_of = MadeOf {
            is_part: camera.made_of.is_part || !is_whole,
            squeeze: camera.made_of.squeeze * self.scale.x / self.scale.y,
            rows_later_ms: camera.made_of.rows_later_ms + self.rows_later_ms(camera),
        };
        new.files_of = self.files_of(camera, centre);
        new.size_px = self.size_px;
        new.focal_px = self.focal(camera.focal_px);
        new.principal_point_px = principal(camera.principal_point_px);
        new.zoom =
            camera.zoom.iter().map(|zoom| self.zoom(zoom, principal(zoom.principal_point_px))).collect();
        new.shutter = self.shutter(camera);
        new.photometric.noise_sigma /= self.pixels().sqrt();
        if let Some(vignetting) = &mut new.photometric.vignetting {
            self.vignetting(vignetting, camera.size_px);
        }
        if let Some(chromatic) = &mut new.chromatic {
            self.chromatic(chromatic, camera.size_px);
        }
        if let Some(circle) = &mut new.image_circle {
            self.circle(circle);
        }
        if let Some(spread) = &mut new.point_spread {
            self.point_spread(spread);
        }
        new.sensor = camera.sensor.as_ref().map(|spec| sensor::resized(self, spec));
        new
    }

    /// What the files of lens and vignette are of; `None` without such files.
    fn files_of(&self, camera: &CameraSpec, centre: [f64; 2]) -> Option<FilesOfSpec> {
        if camera.lens_table.is_none() && camera.photometric.vignette.is_none() {
            return None;
        }
        let [width, height] = camera.size_px.map(f64::from);
        let own = camera.files_of.unwrap_or(FilesOfSpec {
            size_px: camera.size_px,
            focal_px: camera.focal_px,
            principal_point_px: camera.principal_point_px.unwrap_or(centre),
            part_px: [0.0, 0.0, width, height],
        });
        let [left, top, across, down] = own.part_px;
        let step = [across / width, down / height];
        let [x, y, w, h] = self.part_px.map(f64::from);
        Some(FilesOfSpec {
            part_px: [left + x * step[0], top + y * step[1], w * step[0], h * step[1]],
            ..own
        })
    }

    fn zoom(&self, zoom: &ZoomSpec, principal_point_px: Option<[f64; 2]>) -> ZoomSpec {
        ZoomSpec { focal_px: self.focal(zoom.focal_px), principal_point_px, ..zoom.clone() }
    }

    /// Rows keep the time from one to the next, so that a part of them is read in that part of the time.
    /// `delay_ms` is that of the delivered picture's centre; of halves the middle rows have it, which are later or
    /// earlier than the centre where they are the means of several rows.
    fn shutter(&self, camera: &CameraSpec) -> ShutterSpec {
        let mut shutter = camera.shutter.clone();
        let (axis, row_ms) = readout_axis(camera);
        let fraction = f64::from(self.part_px[2 + axis]) / f64::from(camera.size_px[axis]);
        let later_ms = (1.0 / self.scale[axis] - 1.0) * row_ms;
        match shutter.readout {
            Readout::MiddleOutward => shutter.delay_ms -= later_ms,
            Readout::EdgesInward => shutter.delay_ms += later_ms,
            _ => {}
        }
        shutter.readout_ms *= fraction;
        if let Some(line_us) = &mut shutter.line_time_us {
            *line_us /= self.scale[axis];
        }
        if self.part_px[1] % 2 == 1 {
            shutter.first_field = match shutter.first_field {
                Parity::Even => Parity::Odd,
                Parity::Odd => Parity::Even,
            };
        }
        shutter
    }

    /// [`MadeOf::rows_later_ms`] of this change. Halves are always about the centre.
    fn rows_later_ms(&self, camera: &CameraSpec) -> f64 {
        let (axis, row_ms) = readout_axis(camera);
        let whole = f64::from(camera.size_px[axis]);
        let behind_centre = f64::from(self.part_px[axis]) + 0.5 * (f64::from(self.part_px[2 + axis]) - whole);
        match camera.shutter.readout {
            Readout::TopToBottom | Readout::LeftToRight => -behind_centre * row_ms,
            Readout::BottomToTop | Readout::RightToLeft => behind_centre * row_ms,
            Readout::MiddleOutward | Readout::EdgesInward => 0.0,
        }
    }

    /// Radii of the calibrated picture over those of the delivered one, each over the `unit` of its picture.
    fn radius_ratio(&self, size_px: [u32; 2], unit: impl Fn([f64; 2]) -> f64) -> f64 {
        unit(self.size_px.map(f64::from)) / (self.scale.x * unit(size_px.map(f64::from)))
    }

    fn vignetting(&self, vignetting: &mut VignettingSpec, size_px: [u32; 2]) {
        let ratio = self.radius_ratio(size_px, |[width, height]| width.hypot(height));
        let red_and_blue = [&mut vignetting.polynomial_red, &mut vignetting.polynomial_blue];
        let polynomials = red_and_blue.into_iter().flatten().chain([&mut vignetting.polynomial]);
        for terms in polynomials {
            terms.iter_mut().zip([2, 4, 6]).for_each(|(term, power)| *term *= ratio.powi(power));
        }
    }

    fn chromatic(&self, chromatic: &mut ChromaticSpec, size_px: [u32; 2]) {
        let ratio = self.radius_ratio(size_px, |[width, height]| width.min(height));
        for terms in [&mut chromatic.red_scale, &mut chromatic.blue_scale] {
            terms.iter_mut().zip([0, 1, 2]).for_each(|(term, power)| *term *= ratio.powi(power));
        }
        for lens in [&mut chromatic.red, &mut chromatic.blue].into_iter().flatten() {
            let PrimaryLensSpec { focal_px, principal_point_px, .. } = lens;
            *focal_px = focal_px.map(|focal| self.focal(focal));
            *principal_point_px = principal_point_px.map(|at| self.pair(at));
        }
    }

    fn circle(&self, circle: &mut ImageCircleSpec) {
        circle.radius_px = circle.radius_px.map(|radius_px| radius_px * self.scale.x);
        circle.centre_px = circle.centre_px.map(|at| self.pair(at));
    }

    fn point_spread(&self, spread: &mut PointSpreadSpec) {
        let scale = self.scale.x;
        spread.sigma_px = spread.sigma_px.map(|sigma_px| sigma_px * scale);
        spread.defocus_px = spread.defocus_px.map(|defocus_px| defocus_px * scale);
        spread.pixel_um = spread.pixel_um.map(|pixel_um| pixel_um / scale);
        if spread.kernel.is_some() {
            spread.kernel_oversampling = (f64::from(spread.kernel_oversampling) / scale).round() as u32;
        }
    }
}

/// The camera of the delivered picture: [`CameraSpec::resized`] applied and removed. Without that key, the camera
/// as it is.
///
/// # Errors
/// What cannot be applied, each with its key.
pub fn delivered(camera: &CameraSpec) -> Result<CameraSpec, Vec<Problem>> {
    let Some(spec) = &camera.resized else { return Ok(camera.clone()) };
    let change = Resizing::new(spec, camera.size_px).map_err(|problem| vec![problem])?;
    let problems = change.problems(camera);
    if problems.is_empty() { Ok(change.apply(camera)) } else { Err(problems) }
}

/// Axis along which a camera is read, and the time from one row or column to the next.
fn readout_axis(camera: &CameraSpec) -> (usize, f64) {
    let axis = match camera.shutter.readout {
        Readout::LeftToRight | Readout::RightToLeft => 0,
        _ => 1,
    };
    (axis, camera.readout_ms() / f64::from(camera.size_px[axis]))
}

/// Keys of a camera whose numbers are lengths in any direction of the picture.
fn round_keys(camera: &CameraSpec) -> impl Iterator<Item = &'static str> {
    let chromatic = camera.chromatic.as_ref();
    let vignetting = camera.photometric.vignetting.as_ref();
    let spread = camera.point_spread.as_ref();
    let circle = camera.image_circle.as_ref();
    [
        ("camera.image_circle.radius_px", circle.is_some_and(|circle| circle.radius_px.is_some())),
        ("camera.chromatic.red_scale", chromatic.is_some_and(|chromatic| chromatic.red_scale.len() > 1)),
        ("camera.chromatic.blue_scale", chromatic.is_some_and(|chromatic| chromatic.blue_scale.len() > 1)),
        (
            "camera.photometric.vignetting.polynomial",
            vignetting.is_some_and(|model| !model.polynomial.is_empty() || model.is_colored()),
        ),
        (
            "camera.point_spread",
            spread.is_some_and(|spread| {
                let PointSpreadSpec { sigma_px, defocus_px, f_number, kernel, .. } = spread;
                sigma_px.is_some() || defocus_px.is_some() || f_number.is_some() || kernel.is_some()
            }),
        ),
    ]
    .into_iter()
    .filter_map(|(key, is_given)| is_given.then_some(key))
}

/// Pixels that are used, and the size, with this many pixels in one.
fn binned(binning: Binning, part: [u32; 2]) -> Result<([u32; 2], [u32; 2]), Problem> {
    let counts = match binning {
        Binning::Both(count) => [count; 2],
        Binning::Each(counts) => counts,
    };
    let is_count = |count: f64, side: u32| count.fract() == 0.0 && count >= 1.0 && count <= f64::from(side);
    if !counts.iter().zip(part).all(|(&count, side)| is_count(count, side)) {
        return Err(problem(
            "binning",
            format!(
                "is the number of pixels that make one, whole numbers from 1 to {} across and {} down, not {counts:?}; 2 \
                 makes one of 2 x 2, and another factor is camera.resized.scale",
                part[0], part[1]
            ),
        ));
    }
    let counts = counts.map(|count| count as u32);
    let size_px = [part[0] / counts[0], part[1] / counts[1]];
    Ok(([size_px[0] * counts[0], size_px[1] * counts[1]], size_px))
}

/// The rounded size by a factor.
fn scaled(scale: f64, part: [u32; 2]) -> Result<[u32; 2], Problem> {
    let sides = part.map(|side| (scale * f64::from(side)).round());
    if sides.iter().all(|&side| side >= 1.0 && side <= f64::from(MAX_SIDE_PX)) {
        return Ok(sides.map(|side| side as u32));
    }
    Err(problem(
        "scale",
        format!(
            "is the factor on {} x {} pixels, and must leave 1..{MAX_SIDE_PX} on each side, not {scale}; 0.5 halves both",
            part[0], part[1]
        ),
    ))
}

fn problem(leaf: &str, message: String) -> Problem {
    Problem { key: format!("camera.resized.{leaf}"), message }
}
