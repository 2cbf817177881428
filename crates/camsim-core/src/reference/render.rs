//! Rendering of whole frames: each sample has its own position in the pixel's area and its own instant of the
//! exposure.

use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;

use super::{FrameView, RaySample, ReferenceRenderer, lamps::RowLamps};
use crate::{
    frame::{COORDS_CHANNELS, Plane, RenderedFrame, RowRecord, sky_direction_ned},
    noise::tail_table,
    photometric::{GrayImage, Photometry, photometric},
    pose::CameraPose,
    scenario::{Channel, Face, VignettingSpec},
    temporal::IdealGeometry,
};

/// Steps of the additive low-discrepancy sequences in 3 and 2 dimensions: powers of 1/g with `g^4 = g + 1`,
/// and of 1/g with `g^3 = g + 1` (Roberts, the R sequences).
pub(super) const EVEN_3D: [f64; 3] =
    [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3];
const EVEN_2D: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
/// Samples per batch; the error is estimated from the means of batches.
const BATCH: u32 = 8;
/// Batches between two checks of the estimate.
const BATCHES_A_CHECK: u32 = 4;

/// Channels of a frame of the reference, and the accuracy to which it is refined.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Channels of the frame. [`Channel::Depth`] and [`Channel::Coords`] cost one ray per pixel, the planes
    /// another one, [`Channel::Coverage`] 256, and each flow about as much; the others are always present.
    pub channels: Vec<Channel>,
    /// Least number of samples of each pixel; rounded up to 32.
    pub min_samples: u32,
    /// Largest number of samples of a pixel.
    pub max_samples: u32,
    /// A pixel is finished when the standard error of its mean is below this in each channel, in DN (1/255 of
    /// the linear range).
    pub tolerance_dn: f64,
    /// Whether vignette, light, noise and saturation are applied. Without them, the frame holds the incoming
    /// light.
    pub photometric: bool,
    /// Ideal frame to which the source coordinates of [`Channel::Coords`] refer. Without one they are 0.
    pub key: Option<IdealView>,
    /// Mask of the pixels to render, row-major; the others stay invalid. `None` renders all. The optics and the
    /// image sensor of the camera need whole frames: with a mask, they are left to [`ReferenceRenderer::expose`].
    pub only: Option<Vec<bool>>,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            channels: vec![Channel::Color],
            min_samples: 32,
            max_samples: 1024,
            tolerance_dn: 0.25,
            photometric: true,
            key: None,
            only: None,
        }
    }
}

/// Pose and geometry of an ideal frame, for source coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdealView {
    /// Pose of the key camera.
    pub pose: CameraPose,
    /// Geometry of the frame.
    pub ideal: IdealGeometry,
}

impl IdealView {
    /// Projection into the ideal frame, in pixels, of the point of a sample, or of the direction for the sky.
    /// Not finite in the plane of the key camera, and mirrored behind it.
    #[must_use]
    pub fn source_px(&self, sample: &RaySample) -> DVec2 {
        let in_key = self.in_key(sample);
        self.ideal.principal_px
            + DVec2::new(self.ideal.focal_px.x * in_key.x, self.ideal.focal_px.y * in_key.y) / in_key.z
    }

    /// Point of a sample, or direction for the sky, in coordinates of the key camera.
    pub(super) fn in_key(&self, sample: &RaySample) -> DVec3 {
        let ned = match &sample.hit {
            Some(hit) => hit.point_ned_m - self.pose.position_ned_m,
            None => sample.pose.ned_from_camera * sample.uv.extend(1.0),
        };
        self.pose.ned_from_camera.conjugate() * ned
    }
}

/// Convergence of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Convergence {
    /// Pixels with a ray.
    pub pixels: u64,
    /// Samples of all of them.
    pub samples: u64,
    /// Pixels that stopped at `max_samples`.
    pub unfinished: u64,
    /// Root mean square of the estimated standard errors in DN (before noise).
    pub rms_error_dn: f64,
}

/// One row of a rendered frame.
struct RenderedRow {
    color: Vec<[f32; 4]>,
    depth_m: Vec<f32>,
    coords: Vec<[f32; COORDS_CHANNELS]>,
    convergence: Convergence,
    sum_of_squares: f64,
}

/// Data that all rows of a frame share.
struct FrameJob<'a> {
    reference: &'a ReferenceRenderer,
    view: FrameView<'a>,
    /// Number of the frame whose noise it has.
    picture: u32,
    options: &'a RenderOptions,
    noise_table: Vec<f32>,
    photometry: Photometry,
    truth: bool,
}

impl ReferenceRenderer {
    /// Renders one frame on all threads. The result does not depend on their number.
    #[must_use]
    pub fn render(&self, frame: u64, options: &RenderOptions) -> RenderedFrame {
        self.render_reported(frame, options).0
    }

    /// As [`ReferenceRenderer::render`], with a report of the convergence.
    #[must_use]
    pub fn render_reported(&self, frame: u64, options: &RenderOptions) -> (RenderedFrame, Convergence) {
        let size_px = self.sequence.scenario.camera.size_px;
        let [depth, coords] =
            [Channel::Depth, Channel::Coords].map(|channel| options.channels.contains(&channel));
        let exposure = self.sequence.exposure(frame);
        let job = FrameJob {
            reference: self,
            photometry: Photometry::before_point_spread(&self.sequence.scenario.camera, exposure.as_ref()),
            view: self.view(frame),
            picture: self.sequence.picture(frame) as u32,
            options,
            noise_table: tail_table(),
            truth: depth || coords,
        };
        let rows: Vec<RenderedRow> =
            (0..size_px[1]).into_par_iter().map(|y| job.row(y, size_px[0])).collect();
        let mut convergence = Convergence::default();
        let mut sum_of_squares = 0.0;
        for row in &rows {
            convergence.pixels += row.convergence.pixels;
            convergence.samples += row.convergence.samples;
            convergence.unfinished += row.convergence.unfinished;
            sum_of_squares += row.sum_of_squares;
        }
        convergence.rms_error_dn = (sum_of_squares / convergence.pixels.max(1) as f64).sqrt();
        let color = rows.iter().flat_map(|row| row.color.as_flattened()).copied().collect();
        let mut planes = vec![Plane::color(color)];
        planes
            .extend(depth.then(|| Plane::depth(rows.iter().flat_map(|row| &row.depth_m).copied().collect())));
        planes.extend(
            coords.then(|| Plane::coords(rows.iter().flat_map(|row| &row.coords).copied().collect())),
        );
        planes.extend(self.planes(frame, options));
        let mut rendered = RenderedFrame {
            index: frame,
            stamp_ns: self.sequence.stamp_ns(frame),
            size_px,
            rows: self.row_records(frame),
            planes,
        };
        if options.photometric && options.only.is_none() {
            self.expose(&mut rendered);
        }
        (rendered, convergence)
    }

    /// Applies the optics and the image sensor of the camera to the light of a whole frame, as
    /// [`ReferenceRenderer::render`] does at its end unless [`RenderOptions::only`] masks pixels.
    pub fn expose(&self, frame: &mut RenderedFrame) {
        let exposure = self.sequence.exposure(frame.index);
        if let Some(optics) = &self.optics {
            optics.expose(frame, exposure.as_ref());
        }
        if let Some(sensor) = &self.sensor {
            sensor.expose(frame, self.stamp_s(frame.index), exposure.as_ref());
        }
    }

    /// Whether a pixel has light of others, so that only whole frames are complete.
    #[must_use]
    pub fn spreads_light(&self) -> bool {
        self.optics.is_some()
    }

    /// Time, pose and velocity of each row of the readout at its mid-exposure.
    #[must_use]
    pub fn row_records(&self, frame: u64) -> Vec<RowRecord> {
        let stamp_s = self.stamp_s(frame);
        let record = |row| {
            let t_s = stamp_s + self.timing.dt_row_s(row);
            let CameraPose { position_ned_m, ned_from_camera } = self.sequence.path.pose(t_s);
            let velocity_ned_m_s = self.sequence.path.velocity_ned(t_s);
            RowRecord {
                row,
                t_mid_ns: self.log_ns(t_s),
                position_ned_m,
                ned_from_camera,
                velocity_ned_m_s,
                exposure_ns: (self.exposure_s(frame, [row, row]) * 1e9).round() as i64,
            }
        };
        (0..self.timing.lines()).map(record).collect()
    }

    fn log_ns(&self, t_s: f64) -> i64 {
        self.sequence.epoch_ns.saturating_add((t_s * 1e9).round() as i64)
    }
}

impl FrameJob<'_> {
    fn row(&self, y: u32, width: u32) -> RenderedRow {
        let mut row = RenderedRow {
            color: Vec::with_capacity(width as usize),
            depth_m: Vec::new(),
            coords: Vec::new(),
            convergence: Convergence::default(),
            sum_of_squares: 0.0,
        };
        let mut instants = SamplePoses::new(self, y);
        let mut lamps = RowLamps::new(&self.view, y, width);
        for x in 0..width {
            // A pixel is valid where its centre has a ray.
            let wanted = self
                .options
                .only
                .as_ref()
                .is_none_or(|only| only.get((y * width + x) as usize).copied().unwrap_or(false));
            let valid = wanted && self.view.ray([x, y], DVec2::ZERO).is_some();
            if valid {
                let pixel = self.pixel([x, y], lamps.may_be_in(x), &mut instants);
                row.convergence.pixels += 1;
                row.convergence.samples += u64::from(pixel.samples);
                row.convergence.unfinished += u64::from(!pixel.finished);
                row.sum_of_squares += pixel.error_dn * pixel.error_dn;
                let [r, g, b] = self.exposed(pixel.color, [x, y]);
                row.color.push([r, g, b, 1.0]);
            } else {
                row.color.push([0.0; 4]);
            }
            if self.truth {
                let sample = if valid { self.view.sample([x, y], DVec2::ZERO, 0.0) } else { None };
                row.depth_m.push(sample.and_then(|sample| sample.hit).map_or(0.0, |hit| hit.depth_m as f32));
                row.coords.push(sample.map_or([0.0; COORDS_CHANNELS], |sample| self.coords([x, y], &sample)));
            }
        }
        row
    }

    /// Mean light over area and exposure; of a pixel that is refined, of all its samples.
    fn pixel(&self, [x, y]: [u32; 2], is_refined: bool, instants: &mut SamplePoses<'_>) -> PixelMean {
        let options = self.options;
        let [shift_x, shift_y, _] = shifts(u64::from(y) << 32 | u64::from(x));
        let steps = if instants.is_exposed { [EVEN_3D[0], EVEN_3D[1]] } else { EVEN_2D };
        let max_batches = options.max_samples.div_ceil(BATCH).max(BATCHES_A_CHECK);
        let least = if is_refined { options.max_samples } else { options.min_samples };
        let min_batches = least.div_ceil(BATCH).clamp(BATCHES_A_CHECK, max_batches);
        let visible = Visible::new(&self.view, [x, y]);
        // Of each colour.
        let (mut sum, mut samples) = (DVec3::ZERO, DVec3::ZERO);
        let (mut mean_of_means, mut spread, mut means) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        let mut error_dn = 0.0;
        for batch in 0..max_batches {
            let (mut part, mut count) = (DVec3::ZERO, DVec3::ZERO);
            for i in batch * BATCH..(batch + 1) * BATCH {
                let position = DVec2::new(
                    (shift_x + f64::from(i) * steps[0]).fract(),
                    (shift_y + f64::from(i) * steps[1]).fract(),
                );
                // At the border of the lens's field, the mean is over the part of the pixel that has rays.
                let at = |uv: DVec2, instants: &mut SamplePoses<'_>| {
                    let (t_s, pose) = instants.pose(x, i);
                    self.reference.radiance_at(t_s, &pose, uv)
                };
                if let Some(others) = visible.red_and_blue {
                    let rays = self.view.ray_of_red_and_blue([x, y], position - 0.5).unwrap_or_default();
                    for ((ray, is_visible), k) in rays.into_iter().zip(others).zip([0, 2]) {
                        let Some(uv) = ray.filter(|_| is_visible) else { continue };
                        part[k] += at(uv, instants)[k];
                        count[k] += 1.0;
                    }
                }
                let Some(uv) = self.view.ray([x, y], position - 0.5) else { continue };
                part += visible.own * at(uv, instants);
                count += visible.own;
            }
            if count == DVec3::ZERO {
                continue;
            }
            sum += part;
            samples += count;
            means += 1.0;
            let mean = part / count.max(DVec3::ONE);
            let before = mean - mean_of_means;
            mean_of_means += before / means;
            spread += before * (mean - mean_of_means);
            let done = batch + 1;
            if means > 1.0 && done >= min_batches && done % BATCHES_A_CHECK == 0 {
                error_dn = 255.0 * (spread.max_element() / (means * (means - 1.0))).sqrt();
                if error_dn < options.tolerance_dn {
                    return PixelMean::new(sum, samples, error_dn, true);
                }
            }
        }
        PixelMean::new(sum, samples, error_dn, false)
    }

    fn exposed(&self, color: DVec3, pixel: [u32; 2]) -> [f32; 3] {
        let color = color.as_vec3().to_array();
        if !self.options.photometric {
            return color;
        }
        let sequence = &self.reference.sequence;
        let camera = &sequence.scenario.camera;
        let is_part = camera.face.is_some() || camera.primary.is_some();
        // Parts of a camera give light where the stage takes all of them at once.
        if is_part && camera.defers_photometric() {
            return color;
        }
        let spec = &camera.photometric;
        // An image sensor collects the light of its rows itself.
        let gain = match self.reference.sensor_collects() {
            true => 1.0,
            false => self.view.light_gain(pixel),
        };
        let map = sequence.vignette.as_ref().map_or(1.0, |map| {
            let value = vignette(map, pixel, camera.size_px);
            let [black, full] = spec.vignette_thresholds;
            match value {
                value if value < black => 0.0,
                value if full > 0.0 => (value / full).min(1.0),
                _ => 1.0,
            }
        });
        let model = spec.vignetting.as_ref().map_or(DVec3::ONE, |model| self.vignetting(model, pixel));
        let light = DVec3::from_array(color.map(f64::from)) * model;
        photometric(
            &self.photometry,
            light.as_vec3().to_array(),
            (map * gain) as f32,
            pixel,
            self.picture,
            sequence.noise_seed(),
            &self.noise_table,
        )
    }

    /// Weights of red, green and blue by the model of the light's fall.
    fn vignetting(&self, spec: &VignettingSpec, pixel: [u32; 2]) -> DVec3 {
        let camera = &self.reference.sequence.scenario.camera;
        let [width, height] = camera.size_px.map(f64::from);
        let axis =
            DVec2::from(camera.principal_point_px.unwrap_or([0.5 * (width - 1.0), 0.5 * (height - 1.0)]));
        let r = DVec2::from_array(pixel.map(f64::from)).distance(axis) / (0.5 * width.hypot(height));
        let series = |terms: &[f64]| {
            let sum: f64 = terms.iter().zip([2, 4, 6]).map(|(k, power)| k * r.powi(power)).sum();
            (1.0 + sum).max(0.0)
        };
        let all = &spec.polynomial;
        let of = |own: &Option<Vec<f64>>| series(own.as_ref().unwrap_or(all));
        let cosine = self.view.ray(pixel, DVec2::ZERO).map_or(0.0, |uv| {
            let whole_from_own = camera.face.map_or(DQuat::IDENTITY, Face::camera_from_face);
            (whole_from_own * uv.extend(1.0).normalize()).z.max(0.0)
        });
        DVec3::new(of(&spec.polynomial_red), series(all), of(&spec.polynomial_blue))
            * cosine.powf(spec.cos_power)
    }

    fn coords(&self, pixel: [u32; 2], sample: &RaySample) -> [f32; COORDS_CHANNELS] {
        let source_px = self.options.key.map_or(DVec2::ZERO, |key| key.source_px(sample));
        let dt_s = self.reference.timing.dt_s(pixel);
        // A sample of the sky has no point; its direction is stored.
        let point =
            sample.hit.map_or_else(|| sky_direction_ned(&sample.pose, sample.uv), |hit| hit.point_ned_m);
        [sample.uv.x, sample.uv.y, source_px.x, source_px.y, dt_s, point.x, point.y, point.z]
            .map(|value| value as f32)
    }
}

/// Mean of a pixel and its convergence.
struct PixelMean {
    color: DVec3,
    samples: u32,
    error_dn: f64,
    finished: bool,
}

impl PixelMean {
    /// `sum` and `samples` are of each colour.
    fn new(sum: DVec3, samples: DVec3, error_dn: f64, finished: bool) -> Self {
        let color = sum / samples.max(DVec3::ONE);
        Self { color, samples: samples.max_element() as u32, error_dn, finished }
    }
}

/// What the lenses of a camera show of a pixel: a colour is seen where the pixel's centre has a ray.
struct Visible {
    /// 1 in the colours of the camera's own lens.
    own: DVec3,
    red_and_blue: Option<[bool; 2]>,
}

impl Visible {
    fn new(view: &FrameView<'_>, pixel: [u32; 2]) -> Self {
        match view.ray_of_red_and_blue(pixel, DVec2::ZERO) {
            Some(rays) => Self { own: DVec3::Y, red_and_blue: Some(rays.map(|ray| ray.is_some())) },
            None => Self { own: DVec3::ONE, red_and_blue: None },
        }
    }
}

/// Poses at the instants of a row's samples. With readout by rows, all pixels of a row share the instants,
/// and each pose is computed once.
struct SamplePoses<'a> {
    job: &'a FrameJob<'a>,
    y: u32,
    is_exposed: bool,
    shift: f64,
    shared: Option<Vec<(f64, CameraPose)>>,
}

impl<'a> SamplePoses<'a> {
    fn new(job: &'a FrameJob<'a>, y: u32) -> Self {
        let is_exposed = job.view.exposure_s([0, y]) > 0.0;
        let shared = job.reference.timing.reads_rows().then(Vec::new);
        Self { job, y, is_exposed, shift: shifts(u64::from(y))[2], shared }
    }

    /// Path time and pose at sample `i` of pixel `x`.
    fn pose(&mut self, x: u32, i: u32) -> (f64, CameraPose) {
        let pose = |i: u32, shift: f64| {
            let phase = if self.is_exposed { (shift + f64::from(i) * EVEN_3D[2]).fract() - 0.5 } else { 0.0 };
            let exposure_s = self.job.view.exposure_s([x, self.y]);
            let t_s = self.job.view.mid_s([x, self.y]) + phase * exposure_s;
            (t_s, self.job.reference.sequence.path.pose(t_s))
        };
        let Some(shared) = &mut self.shared else { return pose(i, self.shift) };
        let i = if self.is_exposed { i } else { 0 };
        while shared.len() <= i as usize {
            let next = pose(shared.len() as u32, self.shift);
            shared.push(next);
        }
        shared[i as usize]
    }
}

/// Three pseudo-random numbers in 0..1 (splitmix64).
pub(super) fn shifts(key: u64) -> [f64; 3] {
    let mut state = key;
    std::array::from_fn(|_| {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    })
}

/// Value of the vignette map at a pixel. The map covers the image from edge to edge; values are bilinear
/// between its pixel centres and constant beyond the outer ones.
fn vignette(map: &GrayImage, pixel: [u32; 2], size_px: [u32; 2]) -> f64 {
    let [columns, rows] = map.size_px;
    let axis = |k: usize, of: u32| {
        let map_px = (f64::from(pixel[k]) + 0.5) / f64::from(size_px[k]) * f64::from(of) - 0.5;
        let map_px = map_px.max(0.0).min(f64::from(of) - 1.0);
        let low = map_px as u32;
        (low, (low + 1).min(of - 1), map_px - f64::from(low))
    };
    let ((x0, x1, tx), (y0, y1, ty)) = (axis(0, columns), axis(1, rows));
    let value =
        |x: u32, y: u32| map.values.get((y * columns + x) as usize).map_or(0.0, |value| f64::from(*value));
    let top = value(x0, y0) * (1.0 - tx) + value(x1, y0) * tx;
    let bottom = value(x0, y1) * (1.0 - tx) + value(x1, y1) * tx;
    top * (1.0 - ty) + bottom * ty
}
