//! WebDataset: tar shards of samples, an index of shards (`index.json`) and one of samples (`samples.csv`,
//! `samples.parquet`).

use std::{fs::File, io::BufWriter, path::PathBuf};

use super::axes::Rigid;
use super::axes::enu_from_camera;
use super::exporting::page::{OPTICAL, PIXEL_CENTRE_0, Page, WORLD};
use super::exporting::run_folder::{RunCamera, RunFrame};
use super::exporting::{DatasetError, ExportJob, Layout};
use crate::columns::{Column, Columns, Get, Part, TableRow, column, of, plain};
use crate::text::numbers::upright;
use crate::text::numbers::wxyz;
use crate::write::WriteError;

mod parquet_index;

/// Samples of a shard.
const SHARD: usize = 500;

/// Frames of a camera, with its twins.
struct Series<'a> {
    prefix: String,
    camera: &'a RunCamera,
    twins: Vec<(String, RunCamera)>,
}

pub(crate) const LAYOUT: Layout = Layout { has_poses: true, has_any_pictures: true, ..Layout::new(write) };

/// Writes the export; returns notes.
fn write(job: &ExportJob<'_>) -> Result<Vec<String>, DatasetError> {
    let mut series = Vec::new();
    for (i, camera) in job.run.cameras.iter().enumerate() {
        let single = camera.twins().iter().filter(|twin| twin.instants.is_none());
        let twins = single
            .map(|twin| Ok((twin.name.clone(), camera.twin(twin)?)))
            .collect::<Result<_, DatasetError>>()?;
        let prefix = if job.run.cameras.len() == 1 { String::new() } else { format!("cam{i}_") };
        series.push(Series { prefix, camera, twins });
    }
    let samples: Vec<(&Series<'_>, &RunFrame)> = series
        .iter()
        .flat_map(|series| series.camera.frames.iter().map(move |frame| (series, frame)))
        .collect();
    let shards: Vec<&[(&Series<'_>, &RunFrame)]> = samples.chunks(SHARD).collect();
    for (k, shard) in shards.iter().enumerate() {
        // Shards that were written for the same tables are whole.
        if !(job.keeps && job.target.path(&shard_name(k)).is_file()) {
            write_shard(job, k, shard)?;
        }
    }
    write_index(job, &shards)?;
    write_samples(job, &shards)?;
    job.target.text("README.md", &page(job))?;
    Ok(Vec::new())
}

fn shard_name(k: usize) -> String {
    format!("shard-{k:06}.tar")
}

fn key(series: &Series<'_>, frame: &RunFrame) -> String {
    format!("{}frame_{:06}", series.prefix, frame.number)
}

fn write_shard(
    job: &ExportJob<'_>,
    k: usize,
    shard: &[(&Series<'_>, &RunFrame)],
) -> Result<(), DatasetError> {
    job.target.stream(&shard_name(k), &mut |out| {
        let mut tar = tar::Builder::new(out);
        for (series, frame) in shard {
            let key = key(series, frame);
            for (column, path) in series.camera.files(frame) {
                append(&mut tar, &format!("{key}.{}", file_ending("", &column, &path)), &path)?;
            }
            for (name, twin) in &series.twins {
                let partner = twin.frames.binary_search_by_key(&frame.number, |partner| partner.number);
                let Ok(index) = partner else { continue };
                for (column, path) in twin.files(&twin.frames[index]) {
                    append(&mut tar, &format!("{key}.{}", file_ending(name, &column, &path)), &path)?;
                }
            }
            let text = describe(job, series, frame)?;
            put(&mut tar, &format!("{key}.json"), text.len() as u64, &mut text.as_bytes())?;
            job.target.advance()?;
        }
        tar.finish()?;
        Ok(())
    })
}

/// `sharp.color.png`: twin, channel and format.
fn file_ending(twin: &str, column: &str, path: &std::path::Path) -> String {
    let channel = column.strip_suffix("_png").or_else(|| column.strip_suffix("_exr")).unwrap_or(column);
    let ending = path.extension().map_or_else(String::new, |ending| ending.to_string_lossy().into_owned());
    let twin = if twin.is_empty() { String::new() } else { format!("{twin}.") };
    format!("{twin}{channel}.{ending}")
}

type Tar<'w> = tar::Builder<&'w mut BufWriter<File>>;

fn append(tar: &mut Tar<'_>, name: &str, path: &PathBuf) -> Result<(), DatasetError> {
    let missing = |source| DatasetError::Write(WriteError::Copy { path: path.clone(), source });
    let mut file = File::open(path).map_err(missing)?;
    let size = file.metadata().map_err(missing)?.len();
    put(tar, name, size, &mut file)
}

/// A file of the archive; the same bytes each time.
fn put(
    tar: &mut Tar<'_>,
    name: &str,
    size: u64,
    content: &mut dyn std::io::Read,
) -> Result<(), DatasetError> {
    let mut header = tar::Header::new_ustar();
    header.set_size(size);
    header.set_mode(0o644);
    header.set_mtime(0);
    header.set_entry_type(tar::EntryType::Regular);
    Ok(tar.append_data(&mut header, name, content)?)
}

/// Numbers of a sample.
fn describe(job: &ExportJob<'_>, series: &Series<'_>, frame: &RunFrame) -> Result<String, DatasetError> {
    let camera = series.camera;
    let pose = enu_from_camera(&camera.centre_pose(job.name(), frame)?);
    let spec = &camera.spec;
    let value = serde_json::json!({
        "frame": frame.number,
        "camera": camera.name,
        "stamp_ns": frame.stamp_ns,
        "centre_ns": camera.true_centre_ns(frame),
        "position_enu_m": pose.translation_m.to_array(),
        "enu_from_camera_wxyz": wxyz(pose.rotation),
        "size_px": spec.size_px,
        "focal_px": spec.focal_px,
        "principal_point_px": camera.intrinsics().map(|lens| lens.principal_px).ok(),
        "lens": spec.lens,
        "readout_ms": spec.readout_ms(),
        "exposure_ms": frame.exposure_ms,
    });
    Ok(value.to_string() + "\n")
}

/// The index of shards that `wids` reads.
fn write_index(job: &ExportJob<'_>, shards: &[&[(&Series<'_>, &RunFrame)]]) -> Result<(), DatasetError> {
    let mut list = Vec::new();
    for (k, shard) in shards.iter().enumerate() {
        let path = job.target.path(&shard_name(k));
        let size = path.metadata().map_err(|source| WriteError::Io { path: path.clone(), source })?.len();
        list.push(serde_json::json!({ "url": shard_name(k), "nsamples": shard.len(), "filesize": size }));
    }
    let index = serde_json::json!({
        "__kind__": "wids-shard-index-v1",
        "wids_version": 1,
        "name": "camsim",
        "shardlist": list,
    });
    job.target.text("index.json", &(format!("{index:#}") + "\n"))
}

/// A row of the index of samples.
struct SampleRow {
    key: String,
    shard: String,
    frame: u64,
    camera: String,
    stamp_ns: i64,
    centre_ns: i64,
    /// Of the camera in east, north, up.
    pose: Rigid,
}

impl TableRow for SampleRow {
    const COLUMNS: &'static [Column<Self>] = &[
        plain("key", "name of the sample's files without ending", Get::Text(|row| &row.key)),
        plain("shard", "its shard", Get::Text(|row| &row.shard)),
        plain("frame", "number of its frame", Get::Whole(|row| row.frame as i64)),
        plain("camera", "its camera", Get::Text(|row| &row.camera)),
        plain("stamp_ns", "its stamp", Get::Whole(|row| row.stamp_ns)),
        plain("centre_ns", "when the image's centre was exposed", Get::Whole(|row| row.centre_ns)),
        of(
            Part::Poses,
            column("position_enu_m", "*_m", "of the camera then", Get::Xyz(|row| row.pose.translation_m)),
        ),
        of(
            Part::Poses,
            column("enu_from_camera_wxyz", "q*", "its attitude", Get::Wxyz(|row| row.pose.rotation)),
        ),
    ];
}

/// Writes the index of samples, for readers of columns with the poses.
fn write_samples(job: &ExportJob<'_>, shards: &[&[(&Series<'_>, &RunFrame)]]) -> Result<(), DatasetError> {
    let row = |k: usize, series: &Series<'_>, frame: &RunFrame, pose: Rigid| SampleRow {
        key: key(series, frame),
        shard: shard_name(k),
        frame: frame.number,
        camera: series.camera.name.clone(),
        stamp_ns: frame.stamp_ns,
        centre_ns: series.camera.true_centre_ns(frame),
        pose,
    };
    let samples = || shards.iter().enumerate().flat_map(|(k, shard)| shard.iter().map(move |one| (k, one)));
    let without_poses = samples().map(|(k, (series, frame))| row(k, series, frame, Rigid::IDENTITY));
    let csv = Columns::with(|part| part != Part::Poses).csv(without_poses);
    job.target.text("samples.csv", &csv)?;
    job.target.stream("samples.parquet", &mut |out| {
        let with_pose = |(k, (series, frame)): (usize, &(&Series<'_>, &RunFrame))| {
            let pose = enu_from_camera(&series.camera.centre_pose(job.name(), frame)?);
            Ok(row(k, series, frame, Rigid { rotation: upright(pose.rotation), ..pose }))
        };
        parquet_index::write(out, samples().map(with_pose))
    })
}

fn page(job: &ExportJob<'_>) -> String {
    let mut page = Page::new("WebDataset: tar shards", job);
    page.line(
        "samples",
        "`frame_NNNNNN.CHANNEL.ENDING`, files of camsim as they are; of a twin `.TWIN.CHANNEL.ENDING`",
    )
    .line("`.json`", "stamp, pose, camera of the sample")
    .line("world", WORLD)
    .line("camera", OPTICAL)
    .line("pose", "world from camera at the mid-exposure of the image's centre; quaternions w x y z")
    .line("pixels", PIXEL_CENTRE_0)
    .line("`index.json`", "shards, as `wids` reads them")
    .line("`samples.csv`", "shard and time of each sample")
    .line("`samples.parquet`", "the same with the pose: x_m, y_m, z_m, qw, qx, qy, qz");
    page.shutters(job);
    page.ending(&[])
}
