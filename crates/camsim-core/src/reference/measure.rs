//! The error of a rendered frame against the oracle: of its source coordinates, in pixels of its ideal frame,
//! and of its light.

use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;

use super::{IdealView, Look, Oracle};
use crate::{
    frame::RenderedFrame,
    silhouette::{FOLD, NEAR_PX, bends, may_step, steps},
};

/// Largest share of the pixels with a ray but no source in a frame that keeps its tolerance.
pub const MOST_VOID_SHARE: f64 = 0.01;

/// Share of the compared pixels that must lie away from silhouettes for their 99th percentile to stand for
/// the frame.
const LEAST_SMOOTH_SHARE: f64 = 0.05;

/// Errors of one kind of pixel, pixels of the ideal frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorStats {
    /// Pixels.
    pub count: u64,
    /// Root mean square.
    pub rms_px: f64,
    /// 99th percentile.
    pub p99_px: f64,
    /// Largest.
    pub max_px: f64,
}

impl ErrorStats {
    /// Of a set of error magnitudes. One that is not a number makes all but the count infinite: it must not
    /// hide.
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

/// How far a frame's source coordinates are from the oracle's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoordErrors {
    /// All pixels that have a source in both.
    pub all: ErrorStats,
    /// Those farther than 3 px from any silhouette whose point the key camera sees.
    pub smooth: ErrorStats,
    /// The others.
    pub silhouettes: ErrorStats,
    /// Valid in the frame but not by the oracle.
    pub falsely_valid: u64,
    /// Valid by the oracle but not in the frame.
    pub missing: u64,
}

/// By what a frame is held to `quality.max_error_px`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Judged {
    /// The 99th percentile away from silhouettes, pixels of the ideal frame.
    Smooth(f64),
    /// Hardly any pixel (less than one in twenty) is away from silhouettes: the 99th percentile of all.
    Everywhere(f64),
    /// There is no such percentile: more than a hundredth of the pixels are falsely valid or missing, or
    /// there is none at all.
    Void,
}

impl Judged {
    /// The percentile; infinite if there is none.
    #[must_use]
    pub fn p99_px(self) -> f64 {
        match self {
            Self::Smooth(px) | Self::Everywhere(px) => px,
            Self::Void => f64::INFINITY,
        }
    }
}

impl CoordErrors {
    /// By what the frame is to be judged: nothing that was not measured counts as kept.
    #[must_use]
    pub fn judged(&self) -> Judged {
        let void = self.falsely_valid + self.missing;
        let pixels = self.all.count + void;
        if self.all.count == 0 || void as f64 > MOST_VOID_SHARE * pixels as f64 {
            Judged::Void
        } else if (self.smooth.count as f64) < LEAST_SMOOTH_SHARE * self.all.count as f64 {
            Judged::Everywhere(self.all.p99_px)
        } else {
            Judged::Smooth(self.smooth.p99_px)
        }
    }
}

/// What is compared of one pixel.
enum Compared {
    Skipped,
    FalselyValid,
    Missing,
    Error { px: f64, at_silhouette: bool },
}

/// What the centre of every pixel of a frame sees, and which pixels are at silhouettes: looked at once,
/// compared with any number of renderings.
#[derive(Debug)]
pub struct CoordTruth {
    oracle: Arc<Oracle>,
    looks: Vec<Option<Look>>,
    near: Vec<bool>,
}

impl CoordTruth {
    /// Looks at a frame at exposure phase `phase` (-0.5 to 0.5).
    #[must_use]
    pub fn new(oracle: Arc<Oracle>, frame: u64, phase: f64) -> Self {
        let looks = looks(&oracle, frame, phase);
        let near = dilated(&oracle, &edges(&oracle, &looks));
        Self { oracle, looks, near }
    }

    /// Pixels within 3 px of a silhouette, row-major.
    #[must_use]
    pub fn near_silhouettes(&self) -> &[bool] {
        &self.near
    }

    /// Pixels whose centre has a ray, row-major.
    pub fn valid(&self) -> impl Iterator<Item = bool> + '_ {
        self.looks.iter().map(Option::is_some)
    }

    /// As [`coord_errors`], of a rendering of this frame.
    #[must_use]
    pub fn errors(&self, ideal: &IdealView, frame: &RenderedFrame, step: u32) -> Option<CoordErrors> {
        compared(&self.oracle, &self.looks, &self.near, ideal, frame, step)
    }
}

/// Compares `coords` of frame `number`, rendered from the ideal frame `ideal` at exposure phase `phase`, with
/// the oracle: where the point that the pixel's own ray meets lies in the ideal frame. Every `step`-th pixel
/// in both directions. A pixel counts as at a silhouette within 3 px of one, and where its true point is
/// hidden from the key camera or behind it. `None` without coords, or if the frame has another size than the
/// sequence's.
#[must_use]
pub fn coord_errors(
    oracle: &Oracle,
    number: u64,
    ideal: &IdealView,
    frame: &RenderedFrame,
    phase: f64,
    step: u32,
) -> Option<CoordErrors> {
    let looks = looks(oracle, number, phase);
    compared(oracle, &looks, &dilated(oracle, &edges(oracle, &looks)), ideal, frame, step)
}

fn compared(
    oracle: &Oracle,
    looks: &[Option<Look>],
    near: &[bool],
    ideal: &IdealView,
    frame: &RenderedFrame,
    step: u32,
) -> Option<CoordErrors> {
    let coords = frame.coords.as_ref()?;
    let [width, height] = frame.size_px;
    let pixels = width as usize * height as usize;
    if frame.size_px != oracle.sequence.scenario.camera.size_px
        || coords.len() != pixels
        || frame.color_rgba.len() != 4 * pixels
    {
        return None;
    }
    let compare = |i: usize| {
        let valid = frame.color_rgba[4 * i + 3] > 0.0;
        match (&looks[i], valid) {
            (None, false) => Compared::Skipped,
            (None, true) => Compared::FalselyValid,
            (Some(_), false) => Compared::Missing,
            (Some(look), true) => {
                let found = DVec2::new(f64::from(coords[i][2]), f64::from(coords[i][3]));
                let unseen = ideal.in_key(look).z <= 0.0
                    || look.hit.is_some_and(|hit| oracle.hides(ideal.pose.position_ned_m, hit.point_ned_m));
                Compared::Error {
                    px: found.distance(ideal.source_px(look)),
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
    let compared: Vec<Compared> = chosen.into_par_iter().map(compare).collect();
    let (mut smooth, mut at_edges) = (Vec::new(), Vec::new());
    let mut errors = CoordErrors::default();
    for pixel in compared {
        match pixel {
            Compared::Skipped => {}
            Compared::FalselyValid => errors.falsely_valid += 1,
            Compared::Missing => errors.missing += 1,
            Compared::Error { px, at_silhouette } => {
                if at_silhouette { &mut at_edges } else { &mut smooth }.push(px)
            }
        }
    }
    errors.all = ErrorStats::of(smooth.iter().chain(&at_edges).copied().collect());
    errors.smooth = ErrorStats::of(smooth);
    errors.silhouettes = ErrorStats::of(at_edges);
    Some(errors)
}

/// How far a frame's light is from the oracle's. Peak is 1; channels R, G, B of pixels that are valid in
/// both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageErrors {
    /// All pixels.
    pub all_db: f64,
    /// Those farther than 3 px from any silhouette.
    pub smooth_db: f64,
    /// The others; infinite where there are none.
    pub silhouettes_db: f64,
    /// Pixels compared, and how many of them are at silhouettes.
    pub pixels: [u64; 2],
    /// Largest difference of any channel.
    pub max: f64,
}

/// Compares a frame with the oracle's, both in linear light; `near` is [`silhouettes`] of the frame. `None`
/// if sizes differ.
#[must_use]
pub fn image_errors(truth: &RenderedFrame, frame: &RenderedFrame, near: &[bool]) -> Option<ImageErrors> {
    let same = truth.size_px == frame.size_px && truth.color_rgba.len() == frame.color_rgba.len();
    if !same || 4 * near.len() != truth.color_rgba.len() {
        return None;
    }
    let (mut squares, mut pixels, mut max) = ([0.0_f64; 2], [0_u64; 2], 0.0_f64);
    for ((a, b), near) in truth.color_rgba.chunks_exact(4).zip(frame.color_rgba.chunks_exact(4)).zip(near) {
        if a[3] <= 0.0 || b[3] <= 0.0 {
            continue;
        }
        let kind = usize::from(*near);
        pixels[kind] += 1;
        for (a, b) in a[..3].iter().zip(b) {
            let difference = (f64::from(*a) - f64::from(*b)).abs();
            // Not a number is the largest difference of all.
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

/// Pixels of a frame within 3 px of a silhouette at any of the exposure phases given (from -0.5 to 0.5),
/// row-major.
#[must_use]
pub fn silhouettes(oracle: &Oracle, frame: u64, phases: &[f64]) -> Vec<bool> {
    let size_px = oracle.sequence.scenario.camera.size_px;
    let mut marked = vec![false; size_px[0] as usize * size_px[1] as usize];
    for &phase in phases {
        for (marked, edge) in marked.iter_mut().zip(edges(oracle, &looks(oracle, frame, phase))) {
            *marked |= edge;
        }
    }
    dilated(oracle, &marked)
}

/// What the centre of every pixel sees.
fn looks(oracle: &Oracle, frame: u64, phase: f64) -> Vec<Option<Look>> {
    let [width, height] = oracle.sequence.scenario.camera.size_px;
    let view = oracle.view(frame);
    (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            let view = &view;
            (0..width).map(move |x| view.look([x, y], DVec2::ZERO, phase))
        })
        .collect()
}

/// Pixels beside a step or at a fold of depth at their own instant. Where neighbours' looks suggest one, the
/// pixel's camera looks for itself: a neighbour of another instant may see another place, and one of the
/// other field surely does.
fn edges(oracle: &Oracle, looks: &[Option<Look>]) -> Vec<bool> {
    let [width, height] = oracle.sequence.scenario.camera.size_px.map(|side| side as usize);
    let field = oracle.clock.field_rows() as usize;
    let inverse_depth = |look: &Look| look.hit.map_or(0.0, |hit| 1.0 / hit.depth_m);
    let beside = |before: usize, i: usize, after: usize| {
        let (Some(before), Some(here), Some(after)) = (&looks[before], &looks[i], &looks[after]) else {
            return false;
        };
        let seen = inverse_depth(here);
        if !may_step([inverse_depth(before), seen, inverse_depth(after)]) {
            return false;
        }
        let towards = |other: &Look, share: f64| {
            let direction = here.pose.ned_from_camera * here.uv.lerp(other.uv, share).extend(1.0);
            oracle.cast(here.pose.position_ned_m, direction).map_or(0.0, |hit| 1.0 / hit.depth_m)
        };
        let [a, c] = [before, after].map(|other| towards(other, 1.0));
        bends([a, seen, c], FOLD)
            || steps(seen, a, |share| towards(before, share))
            || steps(seen, c, |share| towards(after, share))
    };
    (0..looks.len())
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

/// All pixels within 3 of a marked one, along rows and columns, of the same field.
fn dilated(oracle: &Oracle, marked: &[bool]) -> Vec<bool> {
    let [width, height] = oracle.sequence.scenario.camera.size_px.map(|side| side as usize);
    let (near, field) = (NEAR_PX as usize, oracle.clock.field_rows() as usize);
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
        let of = |count, p99_px| ErrorStats { count, p99_px, ..ErrorStats::default() };
        let all = of(smooth + silhouettes, 7.0);
        CoordErrors {
            all,
            smooth: of(smooth, 0.01),
            silhouettes: of(silhouettes, 9.0),
            falsely_valid,
            missing,
        }
    }

    #[test]
    fn nothing_is_judged_by_what_was_not_measured() {
        assert_eq!(errors(900, 100, 0, 0).judged(), Judged::Smooth(0.01));
        assert_eq!(errors(900, 100, 5, 5).judged(), Judged::Smooth(0.01));
        assert_eq!(errors(900, 100, 6, 5).judged(), Judged::Void);
        assert_eq!(errors(0, 0, 0, 19200).judged(), Judged::Void);
        assert_eq!(errors(0, 0, 0, 0).judged(), Judged::Void);
        assert_eq!(errors(49, 951, 0, 0).judged(), Judged::Everywhere(7.0));
        assert_eq!(errors(50, 950, 0, 0).judged(), Judged::Smooth(0.01));
        assert!(Judged::Void.p99_px().is_infinite());
    }
}
