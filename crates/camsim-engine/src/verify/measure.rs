//! Errors of the frames of one camera, or of one of its faces.

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    reference::{
        CoordErrors, Disocclusion, ImageErrors, ReferenceRenderer, RenderOptions, coord_errors,
        coverage_errors, disocclusion, flow_errors, image_errors, plane_errors, silhouettes, truth_errors,
    },
    scenario::{Channel, Face},
    sequence::Sequence,
};
use camsim_plan::{FramePlan, LevelOfDetail};

use super::{FlowReport, FrameReport, Kept, Measured, PictureReport, PlaneReport, Progress, VerifyError};
use crate::{Engine, Finished, Session};

/// Number of instants of an exposure that are measured besides its middle.
const PHASES: usize = 5;
/// Most instants of a frame that are measured.
pub const MOST_INSTANTS: usize = 1 + PHASES;

/// Channels from which errors of sources, depths and points are measured.
const MEASURED: [Channel; 2] = [Channel::Color, Channel::Coords];

/// Pixels of a frame in which flows, and in which coverage, are compared, at most: the reference renderer needs
/// about 0.1 and 0.5 ms for each.
const FLOW_PIXELS: usize = 20_000;
const COVERAGE_PIXELS: usize = 4_000;

/// The renderer and the reference renderer of a camera.
#[derive(Debug)]
pub(super) struct Measuring<'e> {
    session: Session<'e>,
    reference: ReferenceRenderer,
    with_pictures: bool,
}

impl<'e> Measuring<'e> {
    pub fn new(
        engine: &'e Engine,
        sequence: &Arc<Sequence>,
        with_pictures: bool,
    ) -> Result<Self, VerifyError> {
        let reference = ReferenceRenderer::new(sequence.clone())?;
        let mut session = engine.session::<Infallible>(sequence.clone(), &MEASURED)?;
        session.set_looked_up_coords(true);
        Ok(Self { session, reference, with_pictures })
    }

    /// The face that it is.
    pub fn face(&self) -> Option<&'static str> {
        self.reference.sequence().scenario.camera.face.map(Face::name)
    }

    /// Measures a frame, and tells what is measured next.
    pub fn frame<E: From<VerifyError>>(
        &mut self,
        frame: u64,
        on: &mut dyn FnMut(Progress<'_>) -> Result<(), E>,
    ) -> Result<FrameReport, E> {
        on(Progress::Step(&format!("frame {frame}")))?;
        let first = self.render(frame, 0.0)?;
        let mut errors = coords(&self.reference, &first, 0.0)?;
        let phases = phases(&first.plan);
        for (i, &phase) in phases.iter().enumerate() {
            let (instant, all) = (i + 2, phases.len() + 1);
            on(Progress::Step(&format!("frame {frame}, instant {instant} of {all}")))?;
            let done = self.render(frame, phase)?;
            let candidate = coords(&self.reference, &done, f64::from(phase))?;
            if candidate.verdict().p99_px() > errors.verdict().p99_px() {
                errors = candidate;
            }
        }
        let mut picture = None;
        if self.with_pictures {
            on(Progress::Step(&format!("frame {frame}, picture")))?;
            picture = Some(self.picture(&first));
        }
        Ok(self.report(first, &errors, picture)?)
    }

    /// All but the picture's errors, of which `errors` are those of the worst instant.
    fn report(
        &mut self,
        first: Finished,
        errors: &CoordErrors,
        picture: Option<PictureReport>,
    ) -> Result<FrameReport, VerifyError> {
        let (reference, frame, near_px) = (&self.reference, first.plan.frame, self.tolerance_px());
        let verdict = errors.verdict();
        let measured = Measured {
            smooth: errors.smooth,
            silhouettes: errors.silhouettes,
            all: errors.all,
            judged_by: verdict.into(),
            falsely_valid: errors.falsely_valid,
            missing: errors.missing,
            disocclusion_fraction: disocclusion_of(reference, &first.plan).fraction(),
        };
        let truth = truth_errors(reference, frame, &first.frame, near_px)
            .filter(|_| first.plan.has_exact_truth())
            .map(|errors| Kept { kept: errors.is_consistent(), errors });
        let level_of_detail = LevelOfDetail::of(&first.plan, reference.sequence());
        let report = FrameReport {
            frame,
            face: self.face(),
            measured,
            truth,
            planes: Vec::new(),
            flows: Vec::new(),
            coverage: None,
            level_of_detail,
            kept: verdict.p99_px() <= near_px,
            as_predicted: verdict.p99_px() <= first.plan.predicted.total_px,
            not_in_the_picture: first.plan.not_in_the_picture(),
            predicted: first.plan.predicted,
            picture,
        };
        self.with_channels(report)
    }

    /// Adds errors of the channels that the scenario asks for. They are rendered by themselves: depths and
    /// coordinates beside them are those of rays, and would hide the errors of the sources.
    fn with_channels(&mut self, mut report: FrameReport) -> Result<FrameReport, VerifyError> {
        let sequence = self.session.scene_planner().sequence().clone();
        let channels = sequence.scenario.output.channels.iter().copied();
        let asked: Vec<Channel> = channels.filter(|channel| channel.needs_every_ray()).collect();
        if asked.is_empty() {
            return Ok(report);
        }
        self.session.renew::<Infallible>(sequence.clone(), &[&MEASURED[..], &asked].concat())?;
        let done = self.render(report.frame, 0.0)?;
        self.session.renew::<Infallible>(sequence, &MEASURED)?;
        let (reference, number, near_px) = (&self.reference, done.plan.frame, self.tolerance_px());
        let planes = plane_errors(reference, number, &done.frame, near_px);
        let flows = flow_errors(reference, number, &done.frame, near_px, FLOW_PIXELS);
        report.planes = planes.into_iter().map(PlaneReport::from).collect();
        report.flows = flows
            .into_iter()
            .map(|errors| FlowReport { channel: errors.channel, kept: errors.faults == 0, errors })
            .collect();
        report.coverage = coverage_errors(reference, number, &done.frame, COVERAGE_PIXELS)
            .map(|errors| Kept { kept: errors.faults == 0, errors });
        Ok(report)
    }

    fn tolerance_px(&self) -> f64 {
        self.reference.sequence().scenario.quality.max_error_px
    }

    /// Renders a frame with the source coordinates of an instant of its exposure.
    fn render(&mut self, frame: u64, phase: f32) -> Result<Finished, VerifyError> {
        self.session.set_coords_phase(phase);
        let mut finished = None;
        self.session.render::<Infallible>([frame], &mut |done| {
            finished = Some(done);
            Ok(())
        })?;
        finished.ok_or(VerifyError::NoCoords(frame))
    }

    fn picture(&self, done: &Finished) -> PictureReport {
        let (reference, frame) = (&self.reference, done.plan.frame);
        let options = RenderOptions { key: Some(done.plan.ideal_view()), ..RenderOptions::default() };
        let truth = reference.render(frame, &options);
        let near = silhouettes(reference, frame, &[-0.5, 0.0, 0.5]);
        let errors = image_errors(&truth, &done.frame, &near);
        let figure = |of: fn(&ImageErrors) -> f64| errors.as_ref().map_or(f64::NAN, of);
        let finite = |db: f64| db.is_finite().then_some(db);
        let rms_dn = rms_dn(figure(|errors| errors.all_db));
        PictureReport {
            rms_dn,
            predicted_dn: done.plan.predicted.picture_dn(),
            kept: rms_dn <= reference.sequence().scenario.quality.max_error_dn,
            psnr_db: finite(figure(|errors| errors.all_db)),
            smooth_psnr_db: finite(figure(|errors| errors.smooth_db)),
            silhouettes_psnr_db: finite(figure(|errors| errors.silhouettes_db)),
            max: figure(|errors| errors.max),
        }
    }
}

fn coords(reference: &ReferenceRenderer, done: &Finished, phase: f64) -> Result<CoordErrors, VerifyError> {
    coord_errors(reference, done.plan.frame, &done.plan.ideal_view(), &done.frame, phase, 1)
        .ok_or(VerifyError::NoCoords(done.plan.frame))
}

/// Exposure phases to measure besides mid-exposure: the begin, the middles between two pairs of nodes, where
/// the path deviates most, and two more.
fn phases(plan: &FramePlan) -> Vec<f32> {
    let Some(blur) = plan.blur else { return Vec::new() };
    let steps = f64::from(blur.solved() - 1);
    let middle_of = |fraction: f64| (((fraction * steps).floor() + 0.5) / steps - 0.5) as f32;
    // Exactly 0 would be mid-exposure. The last two are incommensurate with vibrations.
    let phases: [f32; PHASES] = [-0.5, middle_of(0.25), middle_of(0.75), -0.309, 0.191];
    phases.map(|phase| if phase == 0.0 { 1e-4 } else { phase }).to_vec()
}

/// Disocclusion of a frame, at mid-exposure and, with motion blur, at both ends, like the planner's probes.
fn disocclusion_of(reference: &ReferenceRenderer, plan: &FramePlan) -> Disocclusion {
    let phases: &[f64] = if plan.blur.is_some() { &[-0.5, 0.0, 0.5] } else { &[0.0] };
    disocclusion(reference, plan.frame, &plan.key_poses(), phases)
}

/// Converts a PSNR to an RMS error in DN.
fn rms_dn(psnr_db: f64) -> f64 {
    255.0 * 10_f64.powf(-psnr_db / 20.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_psnr_is_an_error() {
        assert!((rms_dn(40.0) - 2.55).abs() < 1e-12 && rms_dn(f64::INFINITY) == 0.0);
    }
}
