//! COLMAP: `images/`, and the model with exact tracks, binary in `sparse/0` and as text in `sparse_text/0`.
//!
//! Cameras that share instants are one rig, and images of one instant one frame (`rigs`). A camera that shakes
//! against the body is a rig of its own, since its pose in the rig is not the same in all frames.

use super::write::camera_model;
use crate::formats::exporting::page::{OPTICAL, PIXEL_CENTRE_HALF, Page, WORLD, timing};
use crate::formats::exporting::run_folder::RunFrame;
use crate::formats::exporting::{DatasetError, ExportJob, Layout};

mod model;
mod model_binary;
mod model_text;
mod observations;
mod rigs;

use model::Model;

pub(crate) const LAYOUT: Layout = Layout {
    judge: Some(|camera| camera_model(camera).map(drop)),
    has_poses: true,
    has_tracks: true,
    ..Layout::new(write)
};

/// Writes the export; returns notes.
fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    for (i, camera) in job.run.cameras.iter().enumerate() {
        camera.require(job.name(), &["color_png"])?;
        let prefix = job.prefix(i);
        job.each_frame(camera, |frame| {
            let name = format!("images/{}", picture(&prefix, frame));
            job.target.link(&camera.file(frame, "color_png"), &name)
        })?;
    }
    let model = Model::new(job)?;
    model_binary::write(job, &model, "sparse/0")?;
    model_text::write(job, &model, "sparse_text/0")?;
    let notes = notes(job, &model);
    job.target.text("README.md", &page(job, &notes))?;
    Ok(notes)
}

/// Name of a picture below `images`.
fn picture(prefix: &str, frame: &RunFrame) -> String {
    format!("{prefix}frame_{:06}.png", frame.number)
}

fn notes(job: &ExportJob<'_>, model: &Model) -> Vec<String> {
    let mut notes = Vec::new();
    if model.points() == 0 {
        notes.push(
            "the model has no points: add [output.tracks] with points = \"terrain\", \"board\", \"vertices\" or a table, \
             and render again"
                .to_owned(),
        );
    }
    if job.run.cameras.iter().any(|camera| !camera.is_global()) {
        notes.push(
            "the camera has a rolling shutter, and COLMAP one pose for each picture, that of the image's centre: points \
             away from it are where their row saw them, and reproject with an error"
                .to_owned(),
        );
    }
    notes
}

fn page(job: &ExportJob<'_>, notes: &[String]) -> String {
    let mut page = Page::new("COLMAP model", job);
    page.line("world", WORLD)
        .line("camera", OPTICAL)
        .line("poses", "camera from world: x_cam = R x + t, at the mid-exposure of the image's centre")
        .line("quaternions", "w x y z, w not negative")
        .line("pixels", PIXEL_CENTRE_HALF)
        .line("lens", "the smallest of COLMAP's models that holds camsim's coefficients as they are")
        .line(
            "points",
            "those of `tracks.csv` that are visible and seen once in a picture; exact, not estimated. Colour is that of \
             the picture that sees them first",
        )
        .line("rigs, frames", "cameras that share instants are a rig, with the poses of their mounts, and pictures of one instant a frame; a \
             camera that vibrates, or shares no instant, is a rig of its own. COLMAP before 3.12 does without these files")
        .line("`sparse/0`, `sparse_text/0`", "the same model, binary and as text");
    for (i, camera) in job.run.cameras.iter().enumerate() {
        page.line(&format!("shutter of camera {}", i + 1), &timing(camera));
    }
    page.ending(notes)
}
