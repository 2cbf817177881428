//! The predicted error from place to place: the dry runs of the way that a plan has chosen, probe by probe. A
//! plan keeps no more than their largest; whoever wants the places asks for them, and they are run again.

use rayon::prelude::*;

use super::{SAFETY, Trial, Truths, Way};
use crate::{FramePlan, PlanError, Planner, TemporalStage, probes::grid};
use camsim_core::{scenario::Preset, temporal::IdealGeometry};

/// What is predicted of the source of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaceError {
    /// An error of so many pixels of the ideal frame.
    Within(f64),
    /// It is beside a silhouette, or what it sees is hidden from the ideal frame's camera: such pixels are
    /// counted apart.
    Silhouette,
    /// What it sees lies outside of the ideal frame: the pixel stays empty.
    NoSource,
}

/// The prediction at one output pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorPlace {
    /// Output pixel.
    pub pixel: [u32; 2],
    /// What is predicted there.
    pub error: PlaceError,
}

/// The predicted error of a frame from place to place.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    /// One a probe: some 430, or a quarter of them for a frame that shares its ideal frame, evenly over the
    /// pixels that have a ray.
    pub places: Vec<ErrorPlace>,
    /// What is known of the frame as a whole only, and comes on top everywhere while the exposure lasts:
    /// curves between its nodes, and depth between its ends. Nothing at mid-exposure.
    pub everywhere_px: f64,
    /// Columns and rows of the grid of places over the image: one in each of its cells, or in each black or
    /// white one of a chessboard, and the image's corners.
    pub grid: [u32; 2],
    /// Half of the side of the square around a pixel whose places stand for it: that of the part of the image
    /// that each stands for.
    pub reach_px: f64,
}

impl ErrorMap {
    /// The largest error of all places, with what comes on top:
    /// [`Predicted::total_px`](crate::Predicted::total_px) of the plan.
    #[must_use]
    pub fn largest_px(&self) -> f64 {
        self.known().map(|(_, px)| px).fold(0.0, f64::max) + self.everywhere_px
    }

    /// The largest error of the places around a pixel, without what comes on top; `None` where they are all
    /// at silhouettes or without a source.
    #[must_use]
    pub fn around_px(&self, pixel: [u32; 2]) -> Option<f64> {
        let is_near = |place: [u32; 2]| {
            (0..2).all(|axis| f64::from(place[axis].abs_diff(pixel[axis])) <= self.reach_px)
        };
        self.known().filter(|(place, _)| is_near(*place)).map(|(_, px)| px).reduce(f64::max)
    }

    /// Places that have an error, and their errors.
    pub fn known(&self) -> impl Iterator<Item = ([u32; 2], f64)> + '_ {
        self.places.iter().filter_map(|place| match place.error {
            PlaceError::Within(px) => Some((place.pixel, px)),
            _ => None,
        })
    }
}

impl Planner {
    /// The predicted error of a frame from place to place, by the dry runs that its plan was chosen by. It
    /// takes about as long as these: a fraction of a plan.
    ///
    /// Frames that share an ideal frame have places of their own, and may have a finer terrain than each
    /// alone would: these tell of what is drawn there, and may be below what the plan says, which answers for
    /// all that are solved in the same way.
    ///
    /// # Errors
    /// As [`Planner::plan`].
    pub fn error_map(&self, plan: &FramePlan) -> Result<ErrorMap, PlanError> {
        let own = self.look(plan.frame, None)?.reach;
        let reach = if plan.shared_by.is_some() {
            self.quarter_of_the_probes(plan.frame).unwrap_or(own)
        } else {
            own
        };
        let ideal = self.tried(plan)?;
        // Of several ideal frames the prediction has the one in the middle of the window.
        let (key_s, key_pose) = match plan.keys.as_slice() {
            [key] => (key.t_s, key.pose),
            _ => (plan.key_s, plan.key_pose),
        };
        let way = Way { temporal: plan.temporal, blur: plan.blur };
        let trial = Trial {
            surfaces: &self.surfaces,
            path: &self.sequence.path,
            shutter: &self.shutter,
            stamp_s: plan.stamp_s,
            key_s,
            key_pose: &key_pose,
            ideal: &ideal,
            twist: is_of_twist(way.temporal).then_some(plan.key_twist),
            nearest_depth: plan.preset == Preset::Paper,
            plane: plan.plane.seen_from(&key_pose),
        };
        let truths =
            Truths::new(&reach, plan.ray, trial, super::phases(&self.sequence.path, plan.blur.is_some()), 1);
        let detail = super::terrain_detail(&self.sequence, &key_pose, &ideal, plan.terrain_error_px);
        let forecast = truths.forecast(detail.as_ref(), None);
        let everywhere_px = SAFETY * forecast.between_px(way) + forecast.missed(way.blur).largest_px;
        // What all places ask for is worked out in parallel itself: a thread that waits for its parts would
        // take up a place that waits for it.
        forecast.prepare(way);
        let known = truths.looked.par_iter().zip(&forecast.outcomes).enumerate().with_min_len(16).map(
            |(i, (looked, run))| {
                let px = SAFETY * forecast.error_px(i, way)
                    + forecast.rounding(looked, run, way.temporal).total_px();
                let error =
                    if truths.is_apart(looked) { PlaceError::Silhouette } else { PlaceError::Within(px) };
                (looked.number, error)
            },
        );
        let known: Vec<(usize, PlaceError)> = known.collect();
        let mut places: Vec<ErrorPlace> = reach
            .probes
            .iter()
            .map(|probe| ErrorPlace { pixel: probe.pixel, error: PlaceError::NoSource })
            .collect();
        for (number, error) in known {
            if let Some(place) = places.get_mut(number) {
                place.error = error;
            }
        }
        Ok(ErrorMap { places, everywhere_px, grid: grid(&reach.camera), reach_px: reach.probe_px })
    }

    /// The ideal frame that a plan's prediction was made for: its own, but where what was chosen then asked
    /// for a larger one.
    fn tried(&self, plan: &FramePlan) -> Result<IdealGeometry, PlanError> {
        let look = self.look(plan.frame, None)?;
        let grew = plan.keys.len() > 1 || look.demanded.is_none() && is_of_twist(plan.temporal);
        if !grew {
            return Ok(plan.ideal);
        }
        let scale = plan.ideal.scale(&plan.camera);
        Ok(look.geometry(&[look.key()], scale, look.demanded))
    }
}

/// Whether a solver takes the camera's twist to be constant.
fn is_of_twist(temporal: TemporalStage) -> bool {
    matches!(temporal, TemporalStage::Linear | TemporalStage::Rk2)
}
