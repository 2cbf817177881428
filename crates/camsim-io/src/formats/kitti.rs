//! KITTI: odometry (`sequences`, `poses`), depth, and flow (`training/flow_occ`, `flow_noc`).

use std::io::Write;

use camsim_core::scenario::Channel;

use super::axes::{Rigid, enu_from_camera};
use super::exporting::depth::DepthScale;
use super::exporting::page::{OPTICAL, PIXEL_CENTRE_0, Page, timing};
use super::exporting::pictures::Samples;
use super::exporting::run_folder::{RunCamera, RunFrame};
use super::exporting::twins::TwinNeed;
use super::exporting::{DatasetError, ExportJob, Layout, pictures, stereo};
use super::flow::FlowPlane;
use super::ros::write::projection_matrix;
use crate::write::Number;
use crate::write::seconds;

/// Steps per metre that readers have built in.
const STEPS: f64 = 256.0;

pub(crate) const LAYOUT: Layout = Layout {
    channels: &[Channel::Depth, Channel::Flow],
    is_pinhole: true,
    has_poses: true,
    ..Layout::new(write)
};

/// Writes the export; returns notes.
fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let scale = DepthScale::fixed(job.options.depth_per_metre.unwrap_or(STEPS));
    let views: Vec<RunCamera> =
        job.run.cameras.iter().map(|camera| straight(job, camera)).collect::<Result<_, _>>()?;
    for view in &views {
        view.require(job.name(), &["color_png"])?;
    }
    let sequences = sequences(&views)?;
    for (i, sequence) in sequences.iter().enumerate() {
        let cameras: Vec<&RunCamera> = sequence.iter().map(|camera| &views[*camera]).collect();
        write_odometry(job, i, &cameras)?;
        for ((camera, view), kind) in sequence.iter().zip(cameras).zip(COLOR) {
            if view.has("depth") {
                job.each_frame(view, |frame| {
                    let name = format!("depth/{i:02}/{kind}/{:06}.png", frame.number);
                    job.target.make(&name, || scale.png(&view.file(frame, "depth")))
                })?;
            }
            if view.has("flow") {
                write_flow(job, &job.prefix(*camera), view, &format!("sequences/{i:02}/{kind}"))?;
            }
        }
    }
    let notes: Vec<String> = scale.note().into_iter().chain(single(&sequences)).collect();
    job.target.text("README.md", &page(job, &views, &sequences, &notes))?;
    Ok(notes)
}

/// Folders of a sequence, of the left and the right camera.
const GREY: [&str; 2] = ["image_0", "image_1"];
const COLOR: [&str; 2] = ["image_2", "image_3"];

/// Numbers of the cameras of each sequence: pairs, the left one first, and those that are none.
fn sequences(views: &[RunCamera]) -> Result<Vec<Vec<usize>>, DatasetError> {
    let mut sequences: Vec<Vec<usize>> = Vec::new();
    'cameras: for (camera, view) in views.iter().enumerate() {
        for sequence in sequences.iter_mut().filter(|sequence| sequence.len() == 1) {
            let other = &views[sequence[0]];
            let is_right = stereo::is_right_of(other, view)?;
            if is_right || stereo::is_right_of(view, other)? {
                sequence.insert(usize::from(is_right), camera);
                continue 'cameras;
            }
        }
        sequences.push(vec![camera]);
    }
    Ok(sequences)
}

/// A note on cameras of a rig that are not half of a pair.
fn single(sequences: &[Vec<usize>]) -> Option<String> {
    let alone = sequences.iter().filter(|sequence| sequence.len() == 1);
    let alone: Vec<String> = alone.map(|sequence| format!("cam{}", sequence[0])).collect();
    (sequences.len() > 1 && !alone.is_empty()).then(|| {
        format!(
            "{}: sequences of their own, without a baseline in P1 and P3. A pair has the same size, focal length and \
             principal point, parallel axes, one camera to the right of the other, and pictures at the same times",
            alone.join(", ")
        )
    })
}

/// The camera without distortion: itself, or a twin.
fn straight(job: &ExportJob<'_>, camera: &RunCamera) -> Result<RunCamera, DatasetError> {
    if camera.intrinsics()?.is_pinhole() {
        Ok(camera.clone())
    } else {
        TwinNeed::Pinhole.open(job.name(), camera)
    }
}

fn write_odometry(job: &ExportJob<'_>, i: usize, sequence: &[&RunCamera]) -> Result<(), DatasetError> {
    let name = |file: &str| format!("sequences/{i:02}/{file}");
    for (k, view) in sequence.iter().enumerate() {
        job.each_frame(view, |frame| {
            let file = |folder: &str| name(&format!("{folder}/{:06}.png", frame.number));
            pictures::put(job, view, frame, Samples::Color, &file(COLOR[k]))?;
            pictures::put(job, view, frame, Samples::Grey, &file(GREY[k]))
        })?;
    }
    let view = sequence[0];
    let first_ns = view.frames.first().map_or(0, |frame| view.centre_ns(frame));
    job.target.stream(&name("times.txt"), &mut |out| {
        view.frames.iter().try_for_each(|frame| {
            let t_ns = view.centre_ns(frame) - first_ns;
            Ok(writeln!(out, "{}", seconds(t_ns))?)
        })
    })?;
    job.target.text(&name("calib.txt"), &calibration(sequence)?)?;
    let mut first_from_world: Option<Rigid> = None;
    job.target.stream(&format!("poses/{i:02}.txt"), &mut |out| {
        for frame in &view.frames {
            let pose = enu_from_camera(&view.centre_pose(job.name(), frame)?);
            let first = *first_from_world.get_or_insert_with(|| pose.inverse());
            let rows = first.of(&pose).matrix();
            let numbers: Vec<String> =
                rows[..3].as_flattened().iter().map(|v| Number(*v).to_string()).collect();
            writeln!(out, "{}", numbers.join(" "))?;
        }
        Ok(())
    })
}

/// P0 to P3: grey and colour of the left and the right camera, which is the same one without a pair; no laser scanner.
fn calibration(sequence: &[&RunCamera]) -> Result<String, DatasetError> {
    let mut lines = String::new();
    for k in 0..4 {
        let view = sequence[(k % 2).min(sequence.len() - 1)];
        let offset_m = stereo::offset_m(sequence, view)?;
        let matrix = projection_matrix(&view.intrinsics()?, offset_m).map(|value| Number(value).to_string());
        lines += &format!("P{k}: {}\n", matrix.join(" "));
    }
    Ok(lines + "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")
}

/// Flow of a camera whose pictures are in the folder `pictures`.
fn write_flow(
    job: &ExportJob<'_>,
    prefix: &str,
    view: &RunCamera,
    pictures: &str,
) -> Result<(), DatasetError> {
    let step = u64::from(job.run.manifest().scenario.output.flow_step);
    let target = |frame: &RunFrame| {
        let number = frame.number + step;
        view.frames.binary_search_by_key(&number, |other| other.number).ok().map(|index| &view.frames[index])
    };
    job.each_frame(view, |frame| {
        let Some(next) = target(frame) else { return Ok(()) };
        let name = |kind: &str, end: &str| format!("{prefix}training/{kind}/{:06}_{end}.png", frame.number);
        let picture = |of: &RunFrame| job.target.path(&format!("{pictures}/{:06}.png", of.number));
        job.target.link(&picture(frame), &name("image_2", "10"))?;
        job.target.link(&picture(next), &name("image_2", "11"))?;
        if job.target.path(&name("flow_noc", "10")).is_file() {
            return Ok(());
        }
        let source = view.file(frame, "flow");
        let flow = FlowPlane::read(&source)?;
        job.target.make(&name("flow_occ", "10"), || flow.kitti_png(&source, true))?;
        job.target.make(&name("flow_noc", "10"), || flow.kitti_png(&source, false))
    })
}

/// Which camera is in which folders.
fn cameras_of(views: &[RunCamera], sequence: &[usize]) -> String {
    let folders = GREY.iter().zip(COLOR);
    let placed = sequence.iter().zip(folders).map(|(&camera, (grey, color))| {
        let name = &views[camera].name;
        let named = if name.is_empty() { String::new() } else { format!(" ({name})") };
        format!("cam{camera}{named} in `{grey}` and `{color}`")
    });
    placed.collect::<Vec<_>>().join(", ")
}

fn page(job: &ExportJob<'_>, views: &[RunCamera], sequences: &[Vec<usize>], notes: &[String]) -> String {
    let mut page = Page::new("KITTI: odometry, depth, flow", job);
    page.line("camera", OPTICAL)
        .line(
            "poses",
            "3x4, row by row: from the camera to the first camera (the first line is the identity), at the \
             mid-exposure of the image's centre",
        )
        .line("pixels", PIXEL_CENTRE_0)
        .line(
            "lens",
            "none, as `calib.txt` cannot hold one: pictures are those of the camera if it is a pinhole, else of \
             the twin without lens. Tr is no scanner's",
        )
        .line(
            "sequences",
            "a rectified pair is one: the left camera in `image_0` (8 bit grey) and `image_2` (8 bit RGB), the right one \
             in `image_1` and `image_3`, and P1 and P3 have its baseline as -fx b. Any other camera is one of its own, \
             with P0 to P3 the same",
        )
        .line("`times.txt`", "seconds since the first picture; the camera's delay is taken away")
        .line("depth", "planar z times 256, 16 bit, 0 = none")
        .line(
            "flow",
            "64 d + 32768, right and down; third sample 1 = known. `flow_noc`: points that the other picture shows; \
             `flow_occ`: hidden ones and those outside, too. To the time of the row that sees the point",
        );
    for (i, sequence) in sequences.iter().enumerate() {
        page.line(&format!("cameras of sequence {i:02}"), &cameras_of(views, sequence));
        page.line(&format!("shutter of sequence {i:02}"), &timing(&views[sequence[0]]));
    }
    page.ending(notes)
}
