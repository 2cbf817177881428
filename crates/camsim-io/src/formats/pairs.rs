//! Pairs of a picture and a better one: GoPro and REDS (blurred, sharp), Carla-RS and Fastec-RS (rolling,
//! global).

use std::fmt::Write as _;

use camsim_core::frame::RowRecord;
use camsim_core::scenario::{Channel, FlowInstant, OutputEncoding, Readout, Reset};
use glam::{DQuat, DVec3};

use super::exporting::csv_rows::CsvRows;
use super::exporting::depth::read_depth;
use super::exporting::page::Page;
use super::exporting::run_folder::{RunCamera, RunFrame};
use super::exporting::twins::{TwinNeed, partners};
use super::exporting::{DatasetError, ExportJob, Layout};
use super::flow::FlowPlane;
use crate::write::Number;

/// Most pictures of a sequence of Carla-RS, whose loader looks for no more.
const SEQUENCE: usize = 10;

pub(crate) const CARLA_LAYOUT: Layout = Layout {
    channels: &[Channel::Rows],
    twins: &[TwinNeed::GlobalFirst, TwinNeed::GlobalMiddle],
    ..Layout::new(write_carla)
};

pub(crate) const GOPRO_LAYOUT: Layout = Layout { twins: &[TwinNeed::Sharp], ..Layout::new(write_gopro) };

/// Writes `train/SEQ/{blur_gamma,sharp}` and `train_blur/SEQ`, `train_sharp/SEQ`.
fn write_gopro(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let encoding = job.run.manifest().scenario.camera.photometric.output;
    let blurred = if encoding == OutputEncoding::Srgb8 { "blur_gamma" } else { "blur" };
    for (i, camera) in job.run.cameras.iter().enumerate() {
        camera.require(job.name(), &["color_png"])?;
        let sharp = TwinNeed::Sharp.open(job.name(), camera)?;
        sharp.require(job.name(), &["color_png"])?;
        for (frame, partner) in partners(camera, &sharp) {
            let [blur, twin] = [camera.file(frame, "color_png"), sharp.file(partner, "color_png")];
            let number = frame.number;
            job.target.link(&blur, &format!("train/cam{i}/{blurred}/{number:06}.png"))?;
            job.target.link(&twin, &format!("train/cam{i}/sharp/{number:06}.png"))?;
            job.target.link(&blur, &format!("train_blur/{i:03}/{number:08}.png"))?;
            job.target.link(&twin, &format!("train_sharp/{i:03}/{number:08}.png"))?;
            job.target.advance()?;
        }
    }
    let mut page =
        Page::new("Blurred and sharp pictures: GoPro (`train`) and REDS (`train_blur`, `train_sharp`)", job);
    page.line("blurred", "the run's pictures: the mean over the exposure of linear light, then encoded")
        .line(
            "sharp",
            "the same pictures without exposure, each row at its mid-exposure: the sharp picture is at the middle of \
             the blurred one, pixel by pixel, with rolling shutter, too",
        )
        .line(
            &format!("`{blurred}`"),
            "named as the encoding of the pictures has it: `blur_gamma` with sRGB, `blur` with linear values",
        );
    job.target.text("README.md", &page.ending(&[]))?;
    Ok(Vec::new())
}

/// Writes `carla/seq_NNN` and `fastec/seq_NNN`.
fn write_carla(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let mut sequence = 0;
    for camera in &job.run.cameras {
        check_rolling(camera)?;
        camera.require(job.name(), &["color_png", "rows"])?;
        let first = TwinNeed::GlobalFirst.open(job.name(), camera)?;
        let middle = TwinNeed::GlobalMiddle.open(job.name(), camera)?;
        first.require(job.name(), &["color_png"])?;
        middle.require(job.name(), &["color_png"])?;
        let of_middle = |number: u64| {
            let index = middle.frames.binary_search_by_key(&number, |frame| frame.number).ok()?;
            Some(&middle.frames[index])
        };
        let triples: Vec<[&RunFrame; 3]> = partners(camera, &first)
            .filter_map(|(frame, f)| Some([frame, f, of_middle(frame.number)?]))
            .collect();
        let runs = triples.chunk_by(|a, b| b[0].number == a[0].number + 1);
        for part in runs.flat_map(|run| run.chunks(SEQUENCE)) {
            write_sequence(job, sequence, [camera, &first, &middle], part)?;
            sequence += 1;
        }
    }
    job.target.text("README.md", &carla_page(job))?;
    Ok(Vec::new())
}

/// Refuses cameras whose rows these layouts cannot describe.
fn check_rolling(camera: &RunCamera) -> Result<(), DatasetError> {
    let shutter = &camera.spec.shutter;
    let problem = if camera.shutter.readout_s() == 0.0 {
        "has a global shutter: set camera.shutter.readout_ms"
    } else if shutter.readout != Readout::TopToBottom || camera.shutter.interlace_s() != 0.0 {
        "is not read from top to bottom at once: set camera.shutter.readout = \"top-to-bottom\" and interlace_ms = 0"
    } else if shutter.reset == Reset::Global {
        "resets all rows at once: set camera.shutter.reset = \"rolling\""
    } else {
        return Ok(());
    };
    Err(DatasetError::Refused(format!(
        "{}: the camera {problem}, as the first row is the origin of time in this layout",
        camera.folder.display()
    )))
}

fn write_sequence(
    job: &ExportJob<'_>,
    sequence: usize,
    [camera, first, middle]: [&RunCamera; 3],
    part: &[[&RunFrame; 3]],
) -> Result<(), DatasetError> {
    let carla = |file: &str| format!("carla/seq_{sequence:03}/{file}");
    let fastec = |file: &str| format!("fastec/seq_{sequence:03}/{file}");
    for (k, [frame, f, m]) in part.iter().enumerate() {
        let pictures = [
            (camera.file(frame, "color_png"), "rs", "rolling"),
            (first.file(f, "color_png"), "gs_f", "global_first"),
            (middle.file(m, "color_png"), "gs_m", "global_middle"),
        ];
        for (source, carla_name, fastec_name) in &pictures {
            job.target.link(source, &carla(&format!("{k:04}_{carla_name}.png")))?;
            job.target.link(source, &fastec(&format!("{k:03}_{fastec_name}.png")))?;
        }
        if camera.has("depth") {
            job.target
                .make(&carla(&format!("{k:04}_rs.pdepth")), || depth_text(&camera.file(frame, "depth")))?;
        }
        if camera.has("flow_global") {
            let target = match job.run.manifest().scenario.output.flow_instant {
                FlowInstant::FirstRow => "gs_f",
                FlowInstant::Centre => "gs_m",
                FlowInstant::LastRow => "gs_l",
            };
            let source = camera.file(frame, "flow_global");
            let name = carla(&format!("{k:04}_flow_{target}.flo"));
            job.target.make(&name, || Ok(FlowPlane::read(&source)?.flo()))?;
        }
        job.target.advance()?;
    }
    let [w, v] = velocity(camera, part[0][0])?;
    let numbers: Vec<String> =
        [w, v].iter().flat_map(DVec3::to_array).map(|v| Number(v).to_string()).collect();
    job.target.text(
        &carla("gt_vel.log"),
        &format!("# Ground truth velocity in camera frame\n# wx, wy, wz, x, y, z\n{}\n", numbers.join(" ")),
    )?;
    let [width, height] = camera.spec.size_px;
    let row_ms = camera.spec.readout_ms() / f64::from(height);
    let meta = format!(
        "#Rolling shutter camera intrinsic parameters\nFPS: {}\nROW_READOUT_TIME(ms): {row_ms:.8}\nRESOLUTION_H: \
         {height}\nRESOLUTION_W: {width}\n",
        camera.spec.fps
    );
    job.target.text(&carla("rs_calib.txt"), &meta)?;
    job.target.text(&fastec("meta.log"), &meta)
}

/// Planar depth as text, a line for each row.
fn depth_text(path: &std::path::Path) -> Result<Vec<u8>, DatasetError> {
    let plane = read_depth(path)?;
    let mut text = String::with_capacity(10 * plane.values.len());
    for row in plane.values.chunks(plane.size_px[0].max(1) as usize) {
        for (x, z) in row.iter().enumerate() {
            let _ = write!(text, "{}{z:.4}", if x > 0 { " " } else { "" });
        }
        text.push('\n');
    }
    Ok(text.into_bytes())
}

/// Angular rate and velocity from the first row to the last one, in the camera axes of the first row.
fn velocity(camera: &RunCamera, frame: &RunFrame) -> Result<[DVec3; 2], DatasetError> {
    let path = camera.file(frame, "rows");
    let mut rows =
        CsvRows::open::<RowRecord>(&path, &["t_mid_ns", "position_ned_m", "ned_from_camera_wxyz"])?;
    let mut ends: Option<[(i64, DVec3, DQuat); 2]> = None;
    while rows.advance()? {
        let row = (rows.whole(0)?, rows.vector(1)?, rows.wxyz(2)?);
        ends = Some(ends.map_or([row; 2], |[first, _]| [first, row]));
    }
    match ends {
        Some([a, b]) if b.0 > a.0 => {
            let dt_s = (b.0 - a.0) as f64 * 1e-9;
            let turn = (a.2.inverse() * b.2).normalize();
            let turn = if turn.w < 0.0 { -turn } else { turn };
            Ok([turn.to_scaled_axis() / dt_s, a.2.inverse() * (b.1 - a.1) / dt_s])
        }
        _ => Err(DatasetError::Input { path, message: "has no two rows at different times".to_owned() }),
    }
}

fn carla_page(job: &ExportJob<'_>) -> String {
    let mut page = Page::new("Rolling and global pictures: Carla-RS (`carla`) and Fastec-RS (`fastec`)", job);
    page.line(
        "time",
        "the origin is the mid-exposure of row 0, at which `gs_f` and `global_first` are taken; camsim's own is the \
         image's centre",
    )
    .line(
        "`gs_m`, `global_middle`",
        "at the image's centre, (H - 1)/2: half a row before row H/2, at which Carla-RS takes them",
    )
    .line(
        "`gt_vel.log`",
        "rad/s and m/s in the axes of row 0's camera (right, down, forward), the mean over the sequence's first \
         readout: x_row0 = exp(w t) x_row + v t",
    )
    .line("`_rs.pdepth`", "planar depth of the rolling picture, m, as text; 0 = none (with the channel depth)")
    .line(
        "`_flow_gs_m.flo`",
        "flow from the rolling picture to the global one, px, 1e10 = unknown (with the channel flow_global)",
    )
    .line("sequences", "at most 10 pictures each, as many as Carla-RS's loader looks for");
    page.shutters(job);
    page.ending(&[])
}
