//! Writes frames to files on worker threads. The renderer waits only when the queue is full.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    thread::JoinHandle,
};

use camsim_core::{
    frame::{PlaneValues, RawPicture, RenderedFrame},
    scenario::{Channel, ExrPixel, ImageFormat, OutputEncoding, OutputSpec, PlaneKind, RawFormat},
};

use super::{
    WriteError, atomic, exr_file, png_file, raw_picture, tables,
    video::{self, VideoWriter},
    write_atomic,
};

/// Names and paths of the files of frames.
#[derive(Clone, Debug)]
pub struct FrameFiles {
    folder: PathBuf,
    output: OutputSpec,
    encoding: OutputEncoding,
    instant: Option<u32>,
}

/// One of the files of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct OutputFile {
    channel: Channel,
    format: FileFormat,
}

/// Format of a file, which the kind of its channel decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FileFormat {
    Color(ImageFormat),
    /// The components of a plane of floats.
    Float(&'static [&'static str]),
    Index,
    /// Numbers in colour.
    Palette,
    Mask,
    Raw(RawFormat),
    Table,
}

impl FileFormat {
    fn ending(self) -> &'static str {
        match self {
            Self::Color(format) => format.ending(),
            Self::Raw(format) => format.ending(),
            Self::Float(_) => "exr",
            Self::Index | Self::Palette | Self::Mask => "png",
            Self::Table => "csv",
        }
    }
}

impl OutputFile {
    /// The video of a picture, which holds all frames.
    fn video(self) -> Option<ImageFormat> {
        match self.format {
            FileFormat::Color(format) if format.is_video() => Some(format),
            _ => None,
        }
    }

    /// Column of `frames.csv`.
    fn column(self) -> String {
        let name = self.channel.name();
        match self.format {
            FileFormat::Color(format) => format!("{name}_{}", format.ending()),
            FileFormat::Palette => format!("{name}_palette"),
            _ => name.to_owned(),
        }
    }

    /// Path below the output folder.
    fn name(self, index: u64, instant: Option<u32>) -> String {
        let instant = instant.map_or_else(String::new, |instant| format!("_{instant}"));
        let (name, ending) = (self.channel.name(), self.format.ending());
        match self.format {
            _ if self.video().is_some() => format!("{name}{instant}.{ending}"),
            FileFormat::Palette => format!("{name}_palette/frame_{index:06}{instant}.{ending}"),
            _ => format!("{name}/frame_{index:06}{instant}.{ending}"),
        }
    }
}

impl FrameFiles {
    /// Files below `folder` for the channels and formats of `output`; `encoding` is
    /// `camera.photometric.output`.
    pub fn new(folder: &Path, output: &OutputSpec, encoding: OutputEncoding) -> Self {
        Self { folder: folder.into(), output: output.clone(), encoding, instant: None }
    }

    /// The files of a picture of each frame's burst: `frame_000123_7.png`.
    #[must_use]
    pub fn of_instant(self, instant: Option<u32>) -> Self {
        Self { instant, ..self }
    }

    /// Number within the burst.
    #[must_use]
    pub fn instant(&self) -> Option<u32> {
        self.instant
    }

    /// Column of `frames.csv` and path below the folder of each file of frame `index`.
    pub fn names(&self, index: u64) -> Vec<(String, String)> {
        let name = |file: OutputFile| (file.column(), file.name(index, self.instant));
        self.files().into_iter().map(name).collect()
    }

    /// Whether one of the files holds all frames, so that they can only be rendered together.
    pub fn has_video(&self) -> bool {
        self.files().iter().any(|file| file.video().is_some())
    }

    /// Whether all files of frame `index` exist. `--resume` skips such frames, as files are never incomplete.
    pub fn exist(&self, index: u64) -> bool {
        let names = self.names(index);
        !names.is_empty() && names.iter().all(|(_, name)| self.folder.join(name).is_file())
    }

    /// Removes the files of these frames, so that files of an earlier run are not mistaken for new ones.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove(&self, frames: &[u64]) -> Result<(), WriteError> {
        let videos = ImageFormat::VIDEOS.map(|video| {
            let format = FileFormat::Color(video);
            OutputFile { channel: Channel::Color, format }.name(0, self.instant)
        });
        let files = frames.iter().flat_map(|&index| self.names(index)).map(|(_, name)| name);
        for name in files.chain(videos) {
            let path = self.folder.join(name);
            match std::fs::remove_file(&path) {
                Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                    return Err(WriteError::Io { path, source });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Paths, below the folder, of the files of these frames.
    pub fn paths(&self, frames: &[u64]) -> Vec<String> {
        frames.iter().flat_map(|&index| self.names(index)).map(|(_, name)| name).collect()
    }

    /// Removes the temporary files that a killed run left for these frames.
    pub fn remove_temporaries(&self, frames: &[u64]) {
        let names = frames.iter().flat_map(|&index| self.names(index));
        atomic::remove_temporaries(names.map(|(_, name)| self.folder.join(name)));
    }

    /// Checks, before anything is written, that the videos of these frames can be made.
    ///
    /// # Errors
    /// The frames are not equally spaced, or ffmpeg is needed and missing.
    pub fn check_videos(&self, fps: f64, frames: &[u64]) -> Result<(), WriteError> {
        self.videos().try_for_each(|(path, format)| {
            video::Series::new(&path, fps, frames)?;
            video::check_program(&path, format)
        })
    }

    /// Paths and formats of the videos.
    fn videos(&self) -> impl Iterator<Item = (PathBuf, ImageFormat)> + '_ {
        self.files()
            .into_iter()
            .filter_map(|file| Some((self.folder.join(file.name(0, self.instant)), file.video()?)))
    }

    fn files(&self) -> Vec<OutputFile> {
        let mut files = Vec::new();
        if self.output.format.is_empty() {
            return files;
        }
        for &channel in &self.output.channels {
            for format in self.formats(channel) {
                let file = OutputFile { channel, format };
                // A channel or format that is listed twice gives one file.
                if !files.contains(&file) {
                    files.push(file);
                }
            }
        }
        files
    }

    fn formats(&self, channel: Channel) -> Vec<FileFormat> {
        match channel.kind() {
            PlaneKind::Color(_) => self.output.format.iter().copied().map(FileFormat::Color).collect(),
            PlaneKind::Float(names) => vec![FileFormat::Float(names)],
            PlaneKind::Index if self.output.palette => vec![FileFormat::Index, FileFormat::Palette],
            PlaneKind::Index => vec![FileFormat::Index],
            PlaneKind::Mask => vec![FileFormat::Mask],
            PlaneKind::Raw => vec![FileFormat::Raw(self.output.raw_format)],
            PlaneKind::Table => vec![FileFormat::Table],
        }
    }

    fn write(&self, frame: &RenderedFrame) -> Result<u64, WriteError> {
        let mut written = 0;
        let files = self.files();
        files.iter().try_for_each(|file| check_size(frame, file.channel))?;
        // Videos get their frames in order, from `FrameWriter::write`.
        for file in files.into_iter().filter(|file| file.video().is_none()) {
            let path = self.folder.join(file.name(frame.index, self.instant));
            let bytes = self.encoded(frame, file, &path)?;
            write_atomic(&path, &bytes)?;
            written += bytes.len() as u64;
        }
        Ok(written)
    }

    /// Bytes of a file; `path` is for messages.
    fn encoded(&self, frame: &RenderedFrame, file: OutputFile, path: &Path) -> Result<Vec<u8>, WriteError> {
        let (size_px, compression) = (frame.size_px, self.output.exr_compression);
        let floats = || frame.floats(file.channel).unwrap_or_default();
        let indices = || frame.indices(file.channel).unwrap_or_default();
        match file.format {
            FileFormat::Color(ImageFormat::Exr) => {
                let names = file.channel.components();
                exr_file::encode(path, size_px, names, floats(), self.output.exr_pixel, compression)
            }
            FileFormat::Color(_) => png_file::encode_color(path, frame, self.encoding),
            FileFormat::Float(names) => {
                exr_file::encode(path, size_px, names, floats(), ExrPixel::Float, compression)
            }
            FileFormat::Index => png_file::encode_indices(path, size_px, indices()),
            FileFormat::Palette => png_file::encode_palette(path, size_px, indices()),
            FileFormat::Mask => png_file::encode_valid(path, frame),
            FileFormat::Raw(format) => {
                let nothing = RawPicture::default();
                raw_picture::encode(path, size_px, frame.raw().unwrap_or(&nothing), format, compression)
            }
            FileFormat::Table => Ok(tables::rows_csv(&frame.rows).into_bytes()),
        }
    }
}

/// Sorted paths, below `folder`, of the files of frames and of bursts of any channel, without those of `listed`.
#[must_use]
pub fn unlisted_frame_files(folder: &Path, listed: &[String]) -> Vec<String> {
    let listed: std::collections::HashSet<&str> = listed.iter().map(String::as_str).collect();
    let mut unlisted = Vec::new();
    // Folders that cannot be read count as empty.
    for channel in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let channel_name = channel.file_name().to_string_lossy().into_owned();
        for file in std::fs::read_dir(channel.path()).into_iter().flatten().flatten() {
            let name = file.file_name().to_string_lossy().into_owned();
            let path = format!("{channel_name}/{name}");
            if is_frame_file(&name) && !listed.contains(path.as_str()) {
                unlisted.push(path);
            }
        }
    }
    unlisted.sort();
    unlisted
}

/// Whether a name is that of a file of a frame, or of a picture of its burst.
fn is_frame_file(name: &str) -> bool {
    let Some((number, _)) = name.strip_prefix("frame_").and_then(|rest| rest.split_once('.')) else {
        return false;
    };
    let mut parts = number.splitn(2, '_');
    parts.all(|part| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit()))
}

/// Checks that a plane has the size of the frame, which the encoders assume.
fn check_size(frame: &RenderedFrame, channel: Channel) -> Result<(), WriteError> {
    let pixels = frame.size_px[0] as usize * frame.size_px[1] as usize;
    let (channel, a_pixel) = match channel.kind() {
        PlaneKind::Color(names) | PlaneKind::Float(names) => (channel, names.len()),
        PlaneKind::Index => (channel, 1),
        PlaneKind::Mask => (Channel::Color, Channel::Color.components().len()),
        PlaneKind::Raw => (channel, frame.raw().map_or(1, |raw| raw.channels as usize)),
        PlaneKind::Table => (channel, 0),
    };
    let (size, needed) = match channel.kind() {
        PlaneKind::Table => (frame.rows.len().min(1), 1),
        _ => (frame.values(channel).map_or(0, PlaneValues::len), pixels * a_pixel),
    };
    if size == needed && pixels > 0 {
        return Ok(());
    }
    let message = format!(
        "{} has {size} values where {needed} are needed ({}x{})",
        channel.name(),
        frame.size_px[0],
        frame.size_px[1]
    );
    Err(WriteError::Frame { frame: frame.index, message })
}

/// Totals of a writer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WriteSummary {
    /// Number of frames written.
    pub frames: u64,
    /// Bytes of their files in total.
    pub bytes: u64,
}

/// Encodes and writes frames on worker threads behind a bounded queue, which limits the memory.
#[derive(Debug)]
pub struct FrameWriter {
    queue: Option<SyncSender<Arc<RenderedFrame>>>,
    workers: Vec<JoinHandle<()>>,
    videos: Vec<VideoWriter>,
    files: Arc<FrameFiles>,
    shared: Arc<WriterState>,
}

/// State shared by the worker threads.
#[derive(Debug, Default)]
struct WriterState {
    failure: Mutex<Option<WriteError>>,
    frames: AtomicU64,
    bytes: AtomicU64,
}

impl WriterState {
    fn take_failure(&self) -> Option<WriteError> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl FrameWriter {
    /// Starts `threads` workers, at least one. The queue holds as many frames.
    pub fn new(files: FrameFiles, threads: usize) -> Self {
        let threads = threads.max(1);
        let (queue, frames) = sync_channel(threads);
        let frames = Arc::new(Mutex::new(frames));
        let shared = Arc::new(WriterState::default());
        let files = Arc::new(files);
        let workers = (0..threads)
            .map(|_| {
                let (files, frames, shared) = (files.clone(), frames.clone(), shared.clone());
                std::thread::spawn(move || work(&files, &frames, &shared))
            })
            .collect();
        Self { queue: Some(queue), workers, videos: Vec::new(), files, shared }
    }

    /// Starts the videos of the output's formats. `frames` are those that will be written, in order, of a camera
    /// with `fps`.
    ///
    /// # Errors
    /// The frames are not equally spaced, or ffmpeg is needed and missing.
    pub fn with_videos(mut self, fps: f64, frames: &[u64]) -> Result<Self, WriteError> {
        for (path, format) in self.files.videos() {
            let series = video::Series::new(&path, fps, frames)?;
            self.videos.push(VideoWriter::start(path, format, self.files.output.video, series)?);
        }
        Ok(self)
    }

    /// Queues a frame; waits while the queue is full.
    ///
    /// # Errors
    /// The first failure of an earlier frame; rendering should stop then.
    pub fn write(&mut self, frame: RenderedFrame) -> Result<(), WriteError> {
        let frame = Arc::new(frame);
        for video in &mut self.videos {
            video.add(&frame)?;
        }
        let sent = self.queue.as_ref().is_some_and(|queue| queue.send(frame).is_ok());
        match self.shared.take_failure() {
            Some(failure) => Err(failure),
            None if sent => Ok(()),
            None => Err(WriteError::Ended),
        }
    }

    /// Waits until all frames are written.
    ///
    /// # Errors
    /// The first failure that `write` has not reported yet.
    pub fn finish(mut self) -> Result<WriteSummary, WriteError> {
        let is_complete = self.join();
        let mut bytes = self.shared.bytes.load(Ordering::Relaxed);
        for video in &mut self.videos {
            bytes += video.finish()?;
        }
        match self.shared.take_failure() {
            Some(failure) => Err(failure),
            None if is_complete => {
                Ok(WriteSummary { frames: self.shared.frames.load(Ordering::Relaxed), bytes })
            }
            None => Err(WriteError::Ended),
        }
    }

    /// Waits for the workers; false if one panicked.
    fn join(&mut self) -> bool {
        self.queue = None;
        // `all` would stop at the first failure, and leave the other threads running.
        self.workers.drain(..).filter_map(|worker| worker.join().err()).count() == 0
    }
}

impl Drop for FrameWriter {
    fn drop(&mut self) {
        self.join();
    }
}

/// Loop of a worker thread.
fn work(files: &FrameFiles, frames: &Mutex<Receiver<Arc<RenderedFrame>>>, shared: &WriterState) {
    loop {
        // The lock is held while waiting: one worker waits for a frame, the others for the lock.
        let next = frames.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok(frame) = next else { return };
        match files.write(&frame) {
            Ok(bytes) => {
                shared.frames.fetch_add(1, Ordering::Relaxed);
                shared.bytes.fetch_add(bytes, Ordering::Relaxed);
            }
            Err(error) => {
                // The first failure is kept; later ones usually have the same cause, such as a full disk.
                shared.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            }
        }
    }
}
