//! Errors of a rendered frame against the reference: of its source coordinates, in pixels of its ideal frame,
//! and of its colour.

use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;
use serde::Serialize;

use super::{IdealView, RaySample, ReferenceRenderer};
use crate::{
    frame::RenderedFrame,
    silhouette::{CREASE, NEAR_PX, bends, may_step, steps},
};

/// Largest fraction of pixels with a ray but without a source in a frame that keeps its tolerance.
pub const MAX_VOID_SHARE: f64 = 0.01;

/// Least fraction of the compared pixels away from silhouettes for which their 99th percentile represents the
/// frame.
const MIN_SMOOTH_SHARE: f64 = 0.05;

/// Statistics of source errors, in pixels of the ideal frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ErrorStats {
    /// Number of pixels.
    #[serde(rename = "pixels")]
    pub count: u64,
    /// Root mean square error.
    pub rms_px: f64,
    /// 99th percentile.
    pub p99_px: f64,
    /// Largest error.
    pub max_px: f64,
}

impl ErrorStats {
    /// Statistics of a set of error magnitudes. A value that is not a number makes all statistics but the
    /// count infinite, so that it cannot go unnoticed.
    #[must_use]
    pub fn of(mut errors_px: Vec<f64>) -> Self {
        for error in &mut errors_px {
            if error.is_nan() {
                *error = f64::INFINITY;
            }
        }
        errors_px.sort_unstable_by(f64::total_cmp);
        let count = errors_px.len();
        let Some(&max_px) = errors_px.last() else { return Self::default() };
        let mean_square = errors_px.iter().map(|e| e * e).sum::<f64>() / count as f64;
        let p99_px = errors_px[(((count as f64) * 0.99).ceil() as usize).clamp(1, count) - 1];
        Self { count: count as u64, rms_px: mean_square.sqrt(), p99_px, max_px }
    }
}

/// Errors of the source coordinates of a frame against those of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoordErrors {
    /// All pixels that have a source in both.
    pub all: ErrorStats,
    /// Pixels farther than 3 px from any silhouette, whose point the key camera sees.
    pub smooth: ErrorStats,
    /// All other pixels.
    pub silhouettes: ErrorStats,
    /// Number of pixels with a ray in the frame but not in the reference.
    pub falsely_valid: u64,
    /// Number of pixels with a ray in the reference but not in the frame.
    pub missing: u64,
}

/// The error by which a frame is compared with `quality.max_error_px`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ErrorVerdict {
    /// 99th percentile away from silhouettes, pixels of the ideal frame.
    Smooth(f64),
    /// 99th percentile of all pixels, because fewer than one in twenty are away from silhouettes.
    Everywhere(f64),
    /// No percentile: more than one pixel in a hundred is falsely valid or missing, or none can be compared.
    Void,
}

impl ErrorVerdict {
    /// The percentile; infinite without one.
    #[must_use]
    pub fn p99_px(self) -> f64 {
        match self {
            Self::Smooth(px) | Self::Everywhere(px) => px,
            Self::Void => f64::INFINITY,
        }
    }
}

impl CoordErrors {
    /// The error that decides whether the frame keeps its tolerance. A frame that could not be measured never
    /// does.
    #[must_use]
    pub fn verdict(&self) -> ErrorVerdict {
        let void = self.falsely_valid + self.missing;
        let pixels = self.all.count + void;
        if self.all.count == 0 || void as f64 > MAX_VOID_SHARE * pixels as f64 {
            ErrorVerdict::Void
        } else if (self.smooth.count as f64) < MIN_SMOOTH_SHARE * self.all.count as f64 {
            ErrorVerdict::Everywhere(self.all.p99_px)
        } else {
            ErrorVerdict::Smooth(self.smooth.p99_px)
        }
    }
}

/// Result of the comparison of one pixel.
enum ComparedPixel {
    Skipped,
    FalselyValid,
    Missing,
    Error { px: f64, at_silhouette: bool },
}

/// What the reference sees at the centre of every pixel of a frame, and which pixels are at silhouettes.
/// Computed once, it is compared with any number of renderings.
#[derive(Debug)]
pub struct CoordTruth {
    reference: Arc<ReferenceRenderer>,
    samples: Vec<Option<RaySample>>,
    near: Vec<bool>,
}

impl CoordTruth {
    /// Samples a frame at exposure phase `phase` (-0.5 to 0.5).
    #[must_use]
    pub fn new(reference: Arc<ReferenceRenderer>, frame: u64, phase: f64) -> Self {
        let samples = pixel_samples(&reference, frame, phase);
        let near = dilated(&reference, &edges(&reference, &samples));
        Self { reference, samples, near }
    }

    /// Mask of the pixels within 3 px of a silhouette, row-major.
    #[must_use]
    pub fn near_silhouettes(&self) -> &[bool] {
        &self.near
    }

    /// Mask of the pixels whose centre has a ray, row-major.
    pub fn valid(&self) -> impl Iterator<Item = bool> + '_ {
        self.samples.iter().map(Option::is_some)
    }

    /// As [`coord_errors`], for a rendering of this frame.
    #[must_use]
    pub fn errors(&self, ideal: &IdealView, frame: &RenderedFrame, step: u32) -> Option<CoordErrors> {
        compared(&self.reference, &self.samples, &self.near, ideal, frame, step)
    }
}

/// Compares `coords` of frame `number`, rendered from the ideal frame `ideal` at exposure phase `phase`, with
/// the reference. The true source is the projection into the ideal frame of the point that the pixel's ray hits.
/// Every `step`-th pixel in both directions is compared. A pixel counts as at a silhouette within 3 px of
/// one, and where its point is hidden from the key camera or behind it. `None` without coords, or if the size
/// differs from that of the sequence.
#[must_use]
pub fn coord_errors(
    reference: &ReferenceRenderer,
    number: u64,
    ideal: &IdealView,
    frame: &RenderedFrame,
    phase: f64,
    step: u32,
) -> Option<CoordErrors> {
    let samples = pixel_samples(reference, number, phase);
    compared(reference, &samples, &dilated(reference, &edges(reference, &samples)), ideal, frame, step)
}

fn compared(
    reference: &ReferenceRenderer,
    samples: &[Option<RaySample>],
    near: &[bool],
    ideal: &IdealView,
    frame: &RenderedFrame,
    step: u32,
) -> Option<CoordErrors> {
    let (coords, color_rgba) = (frame.coords()?, frame.color_rgba());
    let [width, height] = frame.size_px;
    let pixels = width as usize * height as usize;
    if frame.size_px != reference.sequence.scenario.camera.size_px
        || coords.len() != pixels
        || color_rgba.len() != 4 * pixels
    {
        return None;
    }
    let compare = |i: usize| {
        let valid = color_rgba[4 * i + 3] > 0.0;
        match (&samples[i], valid) {
            (None, false) => ComparedPixel::Skipped,
            (None, true) => ComparedPixel::FalselyValid,
            (Some(_), false) => ComparedPixel::Missing,
            (Some(sample), true) => {
                let source_px = DVec2::new(f64::from(coords[i][2]), f64::from(coords[i][3]));
                let unseen = ideal.in_key(sample).z <= 0.0
                    || sample.hit.is_some_and(|hit| {
                        reference.is_occluded_at(sample.t_s, ideal.pose.position_ned_m, hit.point_ned_m)
                    });
                ComparedPixel::Error {
                    px: source_px.distance(ideal.source_px(sample)),
                    at_silhouette: near[i] || unseen,
                }
            }
        }
    };
    let step = step.max(1);
    let chosen: Vec<usize> = (0..height)
        .step_by(step as usize)
        .flat_map(|y| (0..width).step_by(step as usize).map(move |x| (y * width + x) as usize))
        .collect();
    let compared: Vec<ComparedPixel> = chosen.into_par_iter().map(compare).collect();
    let (mut smooth, mut at_edges) = (Vec::new(), Vec::new());
    let mut errors = CoordErrors::default();
    for pixel in compared {
        match pixel {
            ComparedPixel::Skipped => {}
            ComparedPixel::FalselyValid => errors.falsely_valid += 1,
            ComparedPixel::Missing => errors.missing += 1,
            ComparedPixel::Error { px, at_silhouette } => {
                if at_silhouette { &mut at_edges } else { &mut smooth }.push(px)
            }
        }
    }
    errors.all = ErrorStats::of(smooth.iter().chain(&at_edges).copied().collect());
    errors.smooth = ErrorStats::of(smooth);
    errors.silhouettes = ErrorStats::of(at_edges);
    Some(errors)
}

/// Colour errors of a frame against the reference as PSNR, with a peak of 1, over the channels R, G, B of pixels
/// that are valid in both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageErrors {
    /// PSNR of all pixels, dB.
    pub all_db: f64,
    /// PSNR of pixels farther than 3 px from any silhouette, dB.
    pub smooth_db: f64,
    /// PSNR of all other pixels, dB; infinite without any.
    pub silhouettes_db: f64,
    /// Number of pixels compared, and of those at silhouettes.
    pub pixels: [u64; 2],
    /// Largest difference in any channel.
    pub max: f64,
}

/// Compares a frame with that of the reference, both in linear light. `near` is the mask [`silhouettes`] of the
/// frame. `None` if the sizes differ.
#[must_use]
pub fn image_errors(truth: &RenderedFrame, frame: &RenderedFrame, near: &[bool]) -> Option<ImageErrors> {
    let (exact, found) = (truth.color_rgba(), frame.color_rgba());
    let same = truth.size_px == frame.size_px && exact.len() == found.len();
    if !same || 4 * near.len() != exact.len() {
        return None;
    }
    let (mut squares, mut pixels, mut max) = ([0.0_f64; 2], [0_u64; 2], 0.0_f64);
    for ((a, b), near) in exact.chunks_exact(4).zip(found.chunks_exact(4)).zip(near) {
        if a[3] <= 0.0 || b[3] <= 0.0 {
            continue;
        }
        let kind = usize::from(*near);
        pixels[kind] += 1;
        for (a, b) in a[..3].iter().zip(b) {
            let difference = (f64::from(*a) - f64::from(*b)).abs();
            // A difference that is not a number counts as infinite.
            let difference = if difference.is_nan() { f64::INFINITY } else { difference };
            squares[kind] += difference * difference;
            max = max.max(difference);
        }
    }
    let psnr_db = |squares: f64, pixels: u64| {
        if squares > 0.0 { -10.0 * (squares / (3.0 * pixels as f64)).log10() } else { f64::INFINITY }
    };
    Some(ImageErrors {
        all_db: psnr_db(squares[0] + squares[1], pixels[0] + pixels[1]),
        smooth_db: psnr_db(squares[0], pixels[0]),
        silhouettes_db: psnr_db(squares[1], pixels[1]),
        pixels: [pixels[0] + pixels[1], pixels[1]],
        max,
    })
}

/// Mask of the pixels within 3 px of a silhouette at any of the given exposure phases (-0.5 to 0.5),
/// row-major.
#[must_use]
pub fn silhouettes(reference: &ReferenceRenderer, frame: u64, phases: &[f64]) -> Vec<bool> {
    let size_px = reference.sequence.scenario.camera.size_px;
    let mut marked = vec![false; size_px[0] as usize * size_px[1] as usize];
    for &phase in phases {
        for (marked, edge) in marked.iter_mut().zip(edges(reference, &pixel_samples(reference, frame, phase)))
        {
            *marked |= edge;
        }
    }
    dilated(reference, &marked)
}

/// Samples at the centres of all pixels.
fn pixel_samples(reference: &ReferenceRenderer, frame: u64, phase: f64) -> Vec<Option<RaySample>> {
    let [width, height] = reference.sequence.scenario.camera.size_px;
    let view = reference.view(frame);
    (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            let view = &view;
            (0..width).map(move |x| view.sample([x, y], DVec2::ZERO, phase))
        })
        .collect()
}

/// Mask of the pixels beside a step or at a crease of depth at their own instant. Where neighbouring samples
/// suggest one, rays of the pixel's own camera decide: a neighbour belongs to another instant, or even to the
/// other field, and may see another point.
fn edges(reference: &ReferenceRenderer, samples: &[Option<RaySample>]) -> Vec<bool> {
    let [width, height] = reference.sequence.scenario.camera.size_px.map(|side| side as usize);
    let field = reference.timing.field_rows() as usize;
    let inverse_depth = |sample: &RaySample| sample.hit.map_or(0.0, |hit| 1.0 / hit.depth_m);
    let beside = |before: usize, i: usize, after: usize| {
        let (Some(before), Some(here), Some(after)) = (&samples[before], &samples[i], &samples[after]) else {
            return false;
        };
        let here_w = inverse_depth(here);
        if !may_step([inverse_depth(before), here_w, inverse_depth(after)]) {
            return false;
        }
        let towards = |other: &RaySample, fraction: f64| {
            let direction = here.pose.ned_from_camera * here.uv.lerp(other.uv, fraction).extend(1.0);
            reference
                .cast_at(here.t_s, here.pose.position_ned_m, direction)
                .map_or(0.0, |hit| 1.0 / hit.depth_m)
        };
        let [a, c] = [before, after].map(|other| towards(other, 1.0));
        bends([a, here_w, c], CREASE)
            || steps(here_w, a, |fraction| towards(before, fraction))
            || steps(here_w, c, |fraction| towards(after, fraction))
    };
    (0..samples.len())
        .into_par_iter()
        .map(|i| {
            let (x, y, row) = (i % width, i / width, field * width);
            let across = x > 0 && x + 1 < width;
            let along = y >= field && y + field < height;
            (across && beside(i - 1, i, i + 1))
                || (along && beside(i - row, i, i + row))
                || (across
                    && along
                    && (beside(i - row - 1, i, i + row + 1) || beside(i - row + 1, i, i + row - 1)))
        })
        .collect()
}

/// All pixels within 3 of a marked one along rows and columns of the same field.
fn dilated(reference: &ReferenceRenderer, marked: &[bool]) -> Vec<bool> {
    let [width, height] = reference.sequence.scenario.camera.size_px.map(|side| side as usize);
    let (near, field) = (NEAR_PX as usize, reference.timing.field_rows() as usize);
    let mut rows = vec![false; marked.len()];
    let mut all = vec![false; marked.len()];
    for (i, _) in marked.iter().enumerate().filter(|(_, marked)| **marked) {
        let (x, start) = (i % width, i - i % width);
        rows[start + x.saturating_sub(near)..=start + (x + near).min(width - 1)].fill(true);
    }
    for (i, _) in rows.iter().enumerate().filter(|(_, marked)| **marked) {
        let (x, y) = (i % width, i / width);
        for row in (y.saturating_sub(near)..=(y + near).min(height - 1))
            .filter(|row| row.abs_diff(y).is_multiple_of(field))
        {
            all[row * width + x] = true;
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(smooth: u64, silhouettes: u64, falsely_valid: u64, missing: u64) -> CoordErrors {
        let stats = |count, p99_px| ErrorStats { count, p99_px, ..ErrorStats::default() };
        let all = stats(smooth + silhouettes, 7.0);
        CoordErrors {
            all,
            smooth: stats(smooth, 0.01),
            silhouettes: stats(silhouettes, 9.0),
            falsely_valid,
            missing,
        }
    }

    #[test]
    fn verdict_needs_enough_measured_pixels() {
        assert_eq!(errors(900, 100, 0, 0).verdict(), ErrorVerdict::Smooth(0.01));
        assert_eq!(errors(900, 100, 5, 5).verdict(), ErrorVerdict::Smooth(0.01));
        assert_eq!(errors(900, 100, 6, 5).verdict(), ErrorVerdict::Void);
        assert_eq!(errors(0, 0, 0, 19200).verdict(), ErrorVerdict::Void);
        assert_eq!(errors(0, 0, 0, 0).verdict(), ErrorVerdict::Void);
        assert_eq!(errors(49, 951, 0, 0).verdict(), ErrorVerdict::Everywhere(7.0));
        assert_eq!(errors(50, 950, 0, 0).verdict(), ErrorVerdict::Smooth(0.01));
        assert!(ErrorVerdict::Void.p99_px().is_infinite());
    }
}
