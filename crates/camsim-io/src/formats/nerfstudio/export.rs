//! nerfstudio: `transforms.json` with poses in OpenGL axes, pictures, depth.

use std::io::Write;

use camsim_core::pose::{CameraPose, FLU_FROM_FRD};

use super::write::model;
use crate::formats::axes::{Rigid, enu_from_camera};
use crate::formats::exporting::depth::DepthScale;
use crate::formats::exporting::page::{PIXEL_CENTRE_HALF, Page, WORLD};
use crate::formats::exporting::run_folder::{RunCamera, RunFrame};
use crate::formats::exporting::{DatasetError, ExportJob, Layout};
use crate::write::Number;

/// Millimetres.
const USUAL_STEPS: f64 = 1000.0;

pub(crate) const LAYOUT: Layout =
    Layout { judge: Some(|camera| model(camera).map(drop)), has_poses: true, ..Layout::new(write) };

/// Writes the export; returns notes.
fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let cameras: Vec<&RunCamera> = job.run.cameras.iter().collect();
    let models = models(job)?;
    let has_depth = cameras.iter().all(|camera| camera.has("depth"));
    let scale = match has_depth {
        true => Some(DepthScale::choose(job, &cameras, USUAL_STEPS)?),
        false => None,
    };
    for (i, camera) in cameras.iter().enumerate() {
        camera.require(job.name(), &["color_png"])?;
        let prefix = job.prefix(i);
        job.each_frame(camera, |frame| {
            job.target.link(&camera.file(frame, "color_png"), &picture("images", &prefix, frame))?;
            scale.as_ref().map_or(Ok(()), |scale| {
                let name = picture("depths", &prefix, frame);
                job.target.make(&name, || scale.png(&camera.file(frame, "depth")))
            })
        })?;
    }
    write_transforms(job, &models, scale.is_some())?;
    let notes = notes(job, scale.as_ref());
    job.target.text("README.md", &page(job, scale.as_ref(), &notes))?;
    Ok(notes)
}

/// Camera model and intrinsic keys of each camera; the model is one for all.
fn models(job: &ExportJob<'_>) -> Result<Vec<(&'static str, String)>, DatasetError> {
    let keys = |camera: &RunCamera| Ok::<_, DatasetError>(model(&camera.calibration()?)?);
    let models: Vec<_> = job.run.cameras.iter().map(keys).collect::<Result<_, _>>()?;
    if models.iter().any(|(model, _)| *model != models[0].0) {
        return Err(DatasetError::Refused(
            "nerfstudio has one camera model for all pictures, and the cameras of this run have fisheye and other \
             lenses: export runs of one kind each"
                .to_owned(),
        ));
    }
    Ok(models)
}

fn picture(folder: &str, prefix: &str, frame: &RunFrame) -> String {
    format!("{folder}/{prefix}frame_{:06}.png", frame.number)
}

/// World from OpenGL camera axes: x right, y up, z backwards.
pub(crate) fn enu_from_gl(pose: &CameraPose) -> Rigid {
    // The same half turn about x as from right, down, forward.
    let optical_from_gl = Rigid::turn(FLU_FROM_FRD);
    enu_from_camera(pose).of(&optical_from_gl)
}

fn write_transforms(
    job: &ExportJob<'_>,
    models: &[(&'static str, String)],
    has_depth: bool,
) -> Result<(), DatasetError> {
    let is_single = models.len() == 1;
    job.target.stream("transforms.json", &mut |out| {
        writeln!(out, "{{\n  \"camera_model\": \"{}\",", models[0].0)?;
        if is_single {
            writeln!(out, "  {},", models[0].1)?;
        }
        write!(out, "  \"frames\": [")?;
        let mut separator = "";
        for (i, camera) in job.run.cameras.iter().enumerate() {
            let prefix = job.prefix(i);
            for frame in &camera.frames {
                let matrix = enu_from_gl(&camera.centre_pose(job.name(), frame)?).matrix();
                let rows =
                    matrix.map(|row| format!("[{}]", row.map(|value| Number(value).to_string()).join(", ")));
                write!(out, "{separator}\n    {{\"file_path\": \"{}\", ", picture("images", &prefix, frame))?;
                if has_depth {
                    write!(out, "\"depth_file_path\": \"{}\", ", picture("depths", &prefix, frame))?;
                }
                if !is_single {
                    write!(out, "{}, ", models[i].1)?;
                }
                write!(out, "\"transform_matrix\": [{}]}}", rows.join(", "))?;
                separator = ",";
            }
        }
        Ok(writeln!(out, "\n  ]\n}}")?)
    })
}

fn notes(job: &ExportJob<'_>, scale: Option<&DepthScale>) -> Vec<String> {
    let mut notes: Vec<String> = scale.and_then(DepthScale::note).into_iter().collect();
    if let Some(scale) = scale.filter(|scale| !scale.is_usual) {
        let factor = 1.0 / scale.per_metre;
        notes.push(format!(
            "depth has {} steps per metre, not millimetres: `ns-train ... nerfstudio-data \
             --depth-unit-scale-factor {factor}`",
            scale.per_metre
        ));
    }
    if job.run.cameras.iter().any(|camera| !camera.is_global()) {
        notes.push("the camera has a rolling shutter; poses are those of the image's centre".to_owned());
    }
    notes
}

fn page(job: &ExportJob<'_>, scale: Option<&DepthScale>, notes: &[String]) -> String {
    let mut page = Page::new("nerfstudio", job);
    page.line("world", WORLD)
        .line(
            "camera",
            "OpenGL: x right, y up, z backwards (camsim's own: right, down, forward); `transform_matrix` takes camera \
             to world",
        )
        .line("pixels", PIXEL_CENTRE_HALF)
        .line("lens", "kept; k1 k2 p1 p2 k3 as in OpenCV, or k1 to k4 of its fisheye model")
        .line("alpha", "0 where the lens shows nothing")
        .line("pose", "at the mid-exposure of the image's centre");
    if let Some(scale) = scale {
        page.line("depth", &format!("planar z, {} steps per metre, 16 bit, 0 = none", scale.per_metre));
    }
    page.shutters(job);
    page.ending(notes)
}
