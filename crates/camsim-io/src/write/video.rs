//! Videos: all frames of a series in one file, by ffmpeg or as uncompressed y4m.
//!
//! A thread converts frames to sRGB code values, in the order in which they come, and passes them on. The file has
//! a temporary name until its last frame is in it; a video with fewer frames than its series is removed.

use std::{
    fs::{self, File},
    io::{BufWriter, Write},
    path::{Path, PathBuf},
    sync::{
        Arc,
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    thread::JoinHandle,
};

use camsim_core::{
    frame::RenderedFrame,
    scenario::{ImageFormat, VideoSpec},
};

use super::{WriteError, atomic};

mod ffmpeg;
mod pixels;
mod rate;
#[cfg(test)]
mod tests;
mod y4m;

use ffmpeg::Ffmpeg;
pub use ffmpeg::has_ffmpeg;
pub use y4m::Y4mStream;

/// What a video shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Series {
    /// Number of frames.
    frames: u64,
    /// Frames per second of the video.
    fps: f64,
}

impl Series {
    /// The series of these frames of a camera. A part of them, such as every second one, has a lower rate, so that
    /// the video runs as fast as the flight.
    pub(super) fn new(path: &Path, fps: f64, frames: &[u64]) -> Result<Self, WriteError> {
        let step = frames.get(1).map_or(1, |second| second - frames[0]);
        match frames.windows(2).find(|pair| pair[1] - pair[0] != step) {
            Some(pair) => Err(WriteError::Encode {
                path: path.into(),
                message: format!(
                    "a video needs frames at equal distances, but {} comes after {} where the first two are {step} \
                     apart: choose other --frames, or another format than a video",
                    pair[1], pair[0]
                ),
            }),
            None => Ok(Self { frames: frames.len() as u64, fps: fps / step as f64 }),
        }
    }
}

/// Checks that the program that makes a video is there.
pub(super) fn check_program(path: &Path, format: ImageFormat) -> Result<(), WriteError> {
    if format == ImageFormat::Y4m { Ok(()) } else { ffmpeg::find(path) }
}

/// A video that is being written.
#[derive(Debug)]
pub(super) struct VideoWriter {
    queue: Option<SyncSender<Arc<RenderedFrame>>>,
    thread: Option<JoinHandle<Result<u64, WriteError>>>,
}

impl VideoWriter {
    /// Starts a video.
    ///
    /// # Errors
    /// ffmpeg is needed and missing.
    pub(super) fn start(
        path: PathBuf,
        format: ImageFormat,
        spec: VideoSpec,
        series: Series,
    ) -> Result<Self, WriteError> {
        check_program(&path, format)?;
        let (queue, frames) = sync_channel(2);
        let thread = std::thread::spawn(move || write_all(&path, format, spec, series, &frames));
        Ok(Self { queue: Some(queue), thread: Some(thread) })
    }

    /// Queues the next frame.
    ///
    /// # Errors
    /// The failure of an earlier frame.
    pub(super) fn add(&mut self, frame: &Arc<RenderedFrame>) -> Result<(), WriteError> {
        match self.queue.as_ref().map(|queue| queue.send(frame.clone())) {
            Some(Ok(())) => Ok(()),
            _ => Err(self.finish().err().unwrap_or(WriteError::Ended)),
        }
    }

    /// Waits for the file; its size in bytes, 0 if frames are missing.
    ///
    /// # Errors
    /// The first failure.
    pub(super) fn finish(&mut self) -> Result<u64, WriteError> {
        self.queue = None;
        self.thread.take().map_or(Ok(0), |thread| thread.join().unwrap_or(Err(WriteError::Ended)))
    }
}

/// Writes the frames that come.
fn write_all(
    path: &Path,
    format: ImageFormat,
    spec: VideoSpec,
    series: Series,
    frames: &Receiver<Arc<RenderedFrame>>,
) -> Result<u64, WriteError> {
    let Ok(first) = frames.recv() else { return Ok(0) };
    let temporary = atomic::temporary_path(path)?;
    let written = match format {
        ImageFormat::Y4m => y4m_file(&temporary, path, spec, series, first, frames),
        _ => Ffmpeg::start(&temporary, path, format, spec, series, &first)
            .and_then(|ffmpeg| ffmpeg.encode(first, frames)),
    };
    let kept = written.and_then(|count| {
        if count < series.frames {
            return Ok(0);
        }
        let fail = |source| WriteError::Io { path: path.into(), source };
        fs::rename(&temporary, path).map_err(fail)?;
        Ok(fs::metadata(path).map_err(fail)?.len())
    });
    // After a renaming there is none; one that cannot be removed does no harm.
    let _ = fs::remove_file(&temporary);
    kept
}

/// Writes an uncompressed video; the number of frames.
fn y4m_file(
    temporary: &Path,
    path: &Path,
    spec: VideoSpec,
    series: Series,
    first: Arc<RenderedFrame>,
    frames: &Receiver<Arc<RenderedFrame>>,
) -> Result<u64, WriteError> {
    let fail = |source| WriteError::Io { path: path.into(), source };
    let out = BufWriter::new(File::create(temporary).map_err(fail)?);
    let mut stream = Y4mStream::new(out, series.fps, spec.bits);
    let mut count = 0;
    for frame in std::iter::once(first).chain(frames) {
        stream.write(&frame).map_err(fail)?;
        count += 1;
    }
    stream.into_inner().flush().map_err(fail)?;
    Ok(count)
}
