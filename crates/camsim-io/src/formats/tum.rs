//! TUM RGB-D: `rgb/`, `depth/`, their lists, `groundtruth.txt`, `associations.txt`, `calibration.txt`.

use std::io::Write;

use camsim_core::pose::CameraPose;
use camsim_core::scenario::Channel;

use super::axes::enu_from_camera;
use super::exporting::depth::DepthScale;
use super::exporting::page::{MASK, OPTICAL, PIXEL_CENTRE_0, Page, WORLD, timing};
use super::exporting::pictures::Samples;
use super::exporting::run_folder::{RunCamera, RunFrame};
use super::exporting::stamps::name_s;
use super::exporting::{DatasetError, ExportJob, Layout, pictures};
use super::writing::lens_names::Family;
use super::writing::{Calibration, CalibrationError, lens_names};
use crate::text::numbers::xyzw;
use crate::write::Number;

/// Steps per metre of the published dataset.
const USUAL_STEPS: f64 = 5000.0;

pub(crate) const LAYOUT: Layout = Layout {
    judge: Some(|camera| lens_names::lens(Family::Ros, camera).map(drop)),
    channels: &[Channel::Depth],
    has_poses: true,
    begins_at_zero: true,
    ..Layout::new(write)
};

/// Writes the export; returns notes.
fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let cameras: Vec<&RunCamera> = job.run.cameras.iter().collect();
    for camera in &cameras {
        camera.require(job.name(), &["color_png", "depth"])?;
    }
    let scale = DepthScale::choose(job, &cameras, USUAL_STEPS)?;
    for (i, camera) in cameras.iter().enumerate() {
        write_camera(job, &job.prefix(i), camera, &scale)?;
    }
    let mut notes: Vec<String> = scale.note().into_iter().collect();
    if !scale.is_usual {
        notes.push(format!(
            "depth has {} steps per metre, not the usual {USUAL_STEPS}: tell the reader (ORB-SLAM3: \
             RGBD.DepthMapFactor)",
            scale.per_metre
        ));
    }
    job.target.text("README.md", &page(job, &scale, &notes))?;
    Ok(notes)
}

/// Name of a frame's pictures: the time at which the image's centre is exposed, by the camera's stamp.
fn stamp(camera: &RunCamera, frame: &RunFrame) -> String {
    name_s(camera.centre_ns(frame))
}

fn write_camera(
    job: &ExportJob<'_>,
    prefix: &str,
    camera: &RunCamera,
    scale: &DepthScale,
) -> Result<(), DatasetError> {
    let calibration_text = calibration(&camera.calibration()?)?;
    let file = |name: &str| format!("{prefix}{name}");
    job.each_frame(camera, |frame| {
        let stamp = stamp(camera, frame);
        pictures::put(job, camera, frame, Samples::Color, &file(&format!("rgb/{stamp}.png")))?;
        job.target.make(&file(&format!("depth/{stamp}.png")), || scale.png(&camera.file(frame, "depth")))
    })?;
    for (list, what) in [("rgb", "color images"), ("depth", "depth maps")] {
        job.target.stream(&file(&format!("{list}.txt")), &mut |out| {
            writeln!(out, "# {what}\n# camsim\n# timestamp filename")?;
            camera.frames.iter().try_for_each(|frame| {
                let stamp = stamp(camera, frame);
                Ok(writeln!(out, "{stamp} {list}/{stamp}.png")?)
            })
        })?;
    }
    job.target.stream(&file("associations.txt"), &mut |out| {
        camera.frames.iter().try_for_each(|frame| {
            let stamp = stamp(camera, frame);
            Ok(writeln!(out, "{stamp} rgb/{stamp}.png {stamp} depth/{stamp}.png")?)
        })
    })?;
    job.target.stream(&file("groundtruth.txt"), &mut |out| {
        writeln!(out, "# ground truth trajectory\n# camsim\n# timestamp tx ty tz qx qy qz qw")?;
        camera.frames.iter().try_for_each(|frame| {
            let pose = camera.centre_pose(job.name(), frame)?;
            Ok(writeln!(out, "{} {}", name_s(camera.true_centre_ns(frame)), pose_text(&pose))?)
        })
    })?;
    if let Some(mask) = pictures::mask(camera)? {
        mask.write(job, &file("mask.png"), 255)?;
    }
    job.target.text(&file("calibration.txt"), &calibration_text)
}

/// `tx ty tz qx qy qz qw` of the optical axes in ENU.
fn pose_text(pose: &CameraPose) -> String {
    let pose = enu_from_camera(pose);
    let values = pose.translation_m.to_array().into_iter().chain(xyzw(pose.rotation));
    values.map(|value| Number(value).to_string()).collect::<Vec<_>>().join(" ")
}

/// Camera matrix and lens in one line, by ROS's orders.
fn calibration(camera: &Calibration) -> Result<String, CalibrationError> {
    let (model, d) = lens_names::lens(Family::Ros, camera)?;
    let ([fx, fy], [cx, cy]) = (camera.intrinsics.focal_px, camera.intrinsics.principal_px);
    let names = match model {
        "equidistant" => "equidistant: fx fy cx cy k1 k2 k3 k4",
        "plumb_bob" => "fx fy cx cy d0 d1 d2 d3 d4 (k1 k2 p1 p2 k3)",
        _ => "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
    };
    let values = [fx, fy, cx, cy].into_iter().chain(d).map(|value| Number(value).to_string());
    let values = values.collect::<Vec<_>>().join(" ");
    Ok(format!("# (0, 0) is the centre of the first pixel\n# {names}\n{values}\n"))
}

fn page(job: &ExportJob<'_>, scale: &DepthScale, notes: &[String]) -> String {
    let mut page = Page::new("TUM RGB-D folder", job);
    page.line("world", WORLD)
        .line("pose", &format!("`tx ty tz qx qy qz qw`, world from the camera's optical axes ({OPTICAL})"))
        .line("quaternions", "x y z **w**, w not negative; camsim's own are w x y z")
        .line("pixels", PIXEL_CENTRE_0)
        .line(
            "depth",
            &format!(
                "planar z in {} steps per metre, 16 bit; 0 = none (sky); of the same pixels as colour, at the time of \
                 each row",
                scale.per_metre
            ),
        )
        .line(
            "stamps",
            "seconds on the run's clock at which the image's centre is exposed (middle of the exposure); the camera's \
             delay is taken away, as the layout cannot hold one. Names have ten digits before the point",
        )
        .line("`rgb`", Samples::Color.words())
        .line("`mask.png`", MASK);
    for (i, camera) in job.run.cameras.iter().enumerate() {
        let i = if camera.name.is_empty() { String::new() } else { format!(" of cam{i}") };
        page.line(&format!("shutter{i}"), &timing(camera));
    }
    page.note("There is one pose for each picture. Pictures keep the lens; `calibration.txt` has it.");
    page.ending(notes)
}
