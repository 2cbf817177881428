//! KITTI: odometry (`sequences`, `poses`), depth, and flow (`training/flow_occ`, `flow_noc`).

use std::io::Write;

use super::{
    DatasetError, ExportJob,
    axes::{Rigid, enu_from_camera},
    depth::DepthScale,
    euroc::timing,
    flow::FlowPlane,
    page::{OPTICAL, PIXEL_CENTRE_0, Page},
    run_folder::{RunCamera, RunFrame},
    twins::TwinNeed,
};

/// Steps per metre that readers have built in.
const STEPS: f64 = 256.0;

/// Writes the export; returns notes.
pub(super) fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let scale = DepthScale::fixed(job.options.depth_per_metre.unwrap_or(STEPS));
    let views: Vec<RunCamera> =
        job.run.cameras.iter().map(|camera| straight(job, camera)).collect::<Result<_, _>>()?;
    for (i, view) in views.iter().enumerate() {
        view.require(job.name(), &["color_png"])?;
        write_odometry(job, i, view)?;
        if view.has("depth") {
            job.each_frame(view, |frame| {
                let name = format!("depth/{i:02}/image_2/{:06}.png", frame.number);
                job.target.make(&name, || scale.png(&view.file(frame, "depth")))
            })?;
        }
        if view.has("flow") {
            write_flow(job, &job.prefix(i), view)?;
        }
    }
    let notes: Vec<String> = scale.note().into_iter().collect();
    job.target.text("README.md", &page(job, &views, &notes))?;
    Ok(notes)
}

/// The camera without distortion: itself, or a twin.
fn straight(job: &ExportJob<'_>, camera: &RunCamera) -> Result<RunCamera, DatasetError> {
    if camera.intrinsics()?.is_pinhole() {
        Ok(camera.clone())
    } else {
        TwinNeed::Pinhole.open(job.name(), camera)
    }
}

fn write_odometry(job: &ExportJob<'_>, i: usize, view: &RunCamera) -> Result<(), DatasetError> {
    let name = |file: &str| format!("sequences/{i:02}/{file}");
    job.each_frame(view, |frame| {
        job.target.link(&view.file(frame, "color_png"), &name(&format!("image_2/{:06}.png", frame.number)))
    })?;
    let first_ns = view.frames.first().map_or(0, |frame| view.centre_ns(frame));
    job.target.stream(&name("times.txt"), &mut |out| {
        view.frames.iter().try_for_each(|frame| {
            let t_ns = view.centre_ns(frame) - first_ns;
            Ok(writeln!(out, "{}", super::text::seconds(t_ns))?)
        })
    })?;
    job.target.text(&name("calib.txt"), &calibration(view)?)?;
    let mut first_from_world: Option<Rigid> = None;
    job.target.stream(&format!("poses/{i:02}.txt"), &mut |out| {
        for frame in &view.frames {
            let pose = enu_from_camera(&view.centre_pose(job.name(), frame)?);
            let first = *first_from_world.get_or_insert_with(|| pose.inverse());
            let rows = first.of(&pose).matrix();
            let numbers: Vec<String> = rows[..3].as_flattened().iter().map(f64::to_string).collect();
            writeln!(out, "{}", numbers.join(" "))?;
        }
        Ok(())
    })
}

/// P0 to P3 of one camera; no laser scanner.
fn calibration(view: &RunCamera) -> Result<String, DatasetError> {
    let intrinsics = view.intrinsics()?;
    let ([fx, fy], [cx, cy]) = (intrinsics.focal_px, intrinsics.principal_px);
    let row = format!("{fx} 0 {cx} 0 0 {fy} {cy} 0 0 0 1 0");
    let lines: String = (0..4).map(|k| format!("P{k}: {row}\n")).collect();
    Ok(lines + "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")
}

fn write_flow(job: &ExportJob<'_>, prefix: &str, view: &RunCamera) -> Result<(), DatasetError> {
    let step = u64::from(job.run.manifest().scenario.output.flow_step);
    let target = |frame: &RunFrame| {
        let number = frame.number + step;
        view.frames.binary_search_by_key(&number, |other| other.number).ok().map(|place| &view.frames[place])
    };
    job.each_frame(view, |frame| {
        let Some(next) = target(frame) else { return Ok(()) };
        let name = |kind: &str, end: &str| format!("{prefix}training/{kind}/{:06}_{end}.png", frame.number);
        job.target.link(&view.file(frame, "color_png"), &name("image_2", "10"))?;
        job.target.link(&view.file(next, "color_png"), &name("image_2", "11"))?;
        if job.target.path(&name("flow_noc", "10")).is_file() {
            return Ok(());
        }
        let source = view.file(frame, "flow");
        let flow = FlowPlane::read(&source)?;
        job.target.make(&name("flow_occ", "10"), || flow.kitti_png(&source, true))?;
        job.target.make(&name("flow_noc", "10"), || flow.kitti_png(&source, false))
    })
}

fn page(job: &ExportJob<'_>, views: &[RunCamera], notes: &[String]) -> String {
    let mut page = Page::new("KITTI: odometry, depth, flow", job.run);
    page.line("camera", OPTICAL)
        .line(
            "poses",
            "3x4, row by row: from the camera to the first camera (the first line is the identity), at the \
             mid-exposure of the image's centre",
        )
        .line("pixels", PIXEL_CENTRE_0)
        .line(
            "lens",
            "none, as `calib.txt` has no place for one: pictures are those of the camera if it is a pinhole, else of \
             the twin without lens. P0 to P3 are the same camera, Tr is no scanner's",
        )
        .line("`times.txt`", "seconds since the first picture; the camera's delay is taken away")
        .line("depth", "planar z times 256, 16 bit, 0 = none")
        .line(
            "flow",
            "64 d + 32768, right and down; third sample 1 = known. `flow_noc`: points that the other picture shows; \
             `flow_occ`: hidden ones and those outside, too. To the time of the row that sees the point",
        );
    for (i, view) in views.iter().enumerate() {
        page.line(&format!("shutter of sequence {i:02}"), &timing(view));
    }
    notes.iter().for_each(|note| {
        page.note(note);
    });
    page.text().to_owned()
}
