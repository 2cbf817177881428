//! Optical flow: Middlebury `.flo` in the folders of MPI Sintel, and what KITTI's flow needs.

use std::path::Path;

use camsim_core::scenario::{Channel, FlowState};
use image::ExtendedColorType;

use super::exporting::depth::{png, png16, read_planes};
use super::exporting::page::{PIXEL_CENTRE_0, Page};
use super::exporting::run_folder::{RunCamera, RunFrame};
use super::exporting::{DatasetError, ExportJob, Layout};

/// Signature of a `.flo` file, little-endian.
const FLO_TAG: f32 = 202_021.25;
/// Marks unknown flow; more than 1e9 by the definition.
const UNKNOWN: f32 = 1e10;

/// Flow of a frame, row by row.
pub(crate) struct FlowPlane {
    size_px: [u32; 2],
    dx: Vec<f32>,
    dy: Vec<f32>,
    state: Vec<f32>,
}

impl FlowPlane {
    /// Reads a channel of flow.
    pub(crate) fn read(path: &Path) -> Result<Self, DatasetError> {
        let mut planes = read_planes(path, Channel::Flow.components())?.into_iter();
        match (planes.next(), planes.next(), planes.next()) {
            (Some(dx), Some(dy), Some(state)) => {
                Ok(Self { size_px: dx.size_px, dx: dx.values, dy: dy.values, state: state.values })
            }
            _ => Err(DatasetError::Input { path: path.into(), message: "is no flow".to_owned() }),
        }
    }

    fn pixels(&self) -> impl Iterator<Item = (f32, f32, f32)> {
        self.dx.iter().zip(&self.dy).zip(&self.state).map(|((dx, dy), state)| (*dx, *dy, *state))
    }

    /// A `.flo` file.
    pub(crate) fn flo(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(12 + 8 * self.dx.len());
        bytes.extend(FLO_TAG.to_le_bytes());
        self.size_px.iter().for_each(|side| bytes.extend(side.to_le_bytes()));
        for (dx, dy, state) in self.pixels() {
            let known = state != f32::from(FlowState::None as u8);
            [dx, dy].iter().for_each(|d| bytes.extend((if known { *d } else { UNKNOWN }).to_le_bytes()));
        }
        bytes
    }

    /// A PNG with 255 where the state is one of these.
    fn mask(&self, path: &Path, states: &[FlowState]) -> Result<Vec<u8>, DatasetError> {
        let is_one = |state: f32| states.iter().any(|known| state == f32::from(*known as u8));
        let bytes: Vec<u8> = self.state.iter().map(|state| if is_one(*state) { 255 } else { 0 }).collect();
        png(path, self.size_px, &bytes, ExtendedColorType::L8)
    }

    /// KITTI's PNG: 64 d + 2^15, and 1 where the flow is known, within +-512 px and, unless `with_hidden`, seen
    /// in the target.
    pub(crate) fn kitti_png(&self, path: &Path, with_hidden: bool) -> Result<Vec<u8>, DatasetError> {
        let mut samples = Vec::with_capacity(3 * self.dx.len());
        for (dx, dy, state) in self.pixels() {
            let seen = [FlowState::Visible, FlowState::Several].iter().any(|s| state == f32::from(*s as u8));
            let known = state != f32::from(FlowState::None as u8);
            let code = |d: f32| (f64::from(d) * 64.0 + 32768.0).round();
            let fits = [dx, dy].iter().all(|d| (0.0..=65535.0).contains(&code(*d)));
            let valid = fits && (seen || (with_hidden && known));
            samples.extend(if valid { [code(dx) as u16, code(dy) as u16, 1] } else { [0; 3] });
        }
        png16(path, self.size_px, &samples, ExtendedColorType::Rgb16)
    }
}

/// Frames whose numbers follow each other by one.
pub(crate) fn runs_of(camera: &RunCamera) -> impl Iterator<Item = &[RunFrame]> {
    camera.frames.chunk_by(|a, b| b.number == a.number + 1)
}

pub(crate) const LAYOUT: Layout = Layout { channels: &[Channel::Flow], ..Layout::new(write) };

/// Writes `training/{final,flow,occlusions,invalid}/SCENE`.
fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let step = job.run.manifest().scenario.output.flow_step;
    if step != 1 {
        return Err(DatasetError::Refused(format!(
            "output.flow_step is {step}, and this layout has flow to the next picture: set it to 1 and render again"
        )));
    }
    for (i, camera) in job.run.cameras.iter().enumerate() {
        camera.require(job.name(), &["color_png", "flow"])?;
        for (k, scene) in runs_of(camera).enumerate() {
            let scene_name = format!("cam{i}_{k:03}");
            let name = |kind: &str, frame: &RunFrame, ending: &str| {
                format!("training/{kind}/{scene_name}/frame_{:06}.{ending}", frame.number)
            };
            let last = scene.last().map(|frame| frame.number);
            job.each_of(scene, |frame| {
                job.target.link(&camera.file(frame, "color_png"), &name("final", frame, "png"))?;
                // The last picture has no next one.
                if Some(frame.number) == last || job.target.path(&name("flow", frame, "flo")).is_file() {
                    return Ok(());
                }
                let source = camera.file(frame, "flow");
                let flow = FlowPlane::read(&source)?;
                let hidden = [FlowState::Occluded, FlowState::Outside];
                job.target.make(&name("occlusions", frame, "png"), || flow.mask(&source, &hidden))?;
                job.target.make(&name("invalid", frame, "png"), || flow.mask(&source, &[FlowState::None]))?;
                // Last, as its existence says that the others are there.
                job.target.make(&name("flow", frame, "flo"), || Ok(flow.flo()))
            })?;
        }
    }
    job.target.text("README.md", &page(job))?;
    Ok(Vec::new())
}

fn page(job: &ExportJob<'_>) -> String {
    let mut page = Page::new("Flow as Middlebury .flo, in the folders of MPI Sintel", job);
    page.line("flow", "pixels right, down, to where the next picture shows the same point; 1e10 = unknown")
        .line(
            "rolling shutter",
            "flow is between the distorted pictures as they are: from the time of the pixel's row to the time of the \
             row that sees the point in the next picture",
        )
        .line("pixels", PIXEL_CENTRE_0)
        .line("`occlusions`", "255 where the point is hidden in the next picture, or outside of it")
        .line("`invalid`", "255 where flow is unknown: no ray, or a point that the next camera cannot see");
    page.shutters(job);
    page.note(
        "A scene holds pictures whose numbers follow each other; it has one flow less than pictures, as RAFT's loader \
         wants.",
    );
    page.ending(&[])
}
