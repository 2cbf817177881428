//! Frames to files, on threads of their own: the renderer waits only when the queue is full.

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
    frame::{COORDS_CHANNELS, RenderedFrame},
    scenario::{Channel, ExrPixel, ImageFormat, OutputEncoding, OutputSpec},
};

use super::{WriteError, atomic, exr_file, png_file, tables, write_atomic};

/// Which files a frame has, and where.
#[derive(Clone, Debug)]
pub struct FrameFiles {
    folder: PathBuf,
    output: OutputSpec,
    encoding: OutputEncoding,
}

/// One file of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Piece {
    Color(ImageFormat),
    Depth,
    Valid,
    Coords,
    Rows,
}

impl FrameFiles {
    /// Files below `folder` for what `output` asks; `encoding` is `camera.photometric.output`.
    pub fn new(folder: &Path, output: &OutputSpec, encoding: OutputEncoding) -> Self {
        Self { folder: folder.into(), output: output.clone(), encoding }
    }

    /// `(column, path below the folder)` of every file of frame `index`, for `frames.csv`.
    pub fn names(&self, index: u64) -> Vec<(String, String)> {
        self.pieces().into_iter().map(|piece| (column(piece).to_owned(), name(piece, index))).collect()
    }

    /// Whether every file of frame `index` is there, which `--resume` takes for done: files are never there
    /// in part.
    pub fn exist(&self, index: u64) -> bool {
        let names = self.names(index);
        !names.is_empty() && names.iter().all(|(_, name)| self.folder.join(name).is_file())
    }

    /// Removes the files of these frames, so that none of an earlier run is taken for one of the next.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove(&self, frames: &[u64]) -> Result<(), WriteError> {
        for (_, name) in frames.iter().flat_map(|&index| self.names(index)) {
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

    /// Files of frames in the folder, of any channel, that are not among those of `frames`: paths below the
    /// folder, in order.
    pub fn others(&self, frames: &[u64]) -> Vec<String> {
        let own: std::collections::HashSet<String> =
            frames.iter().flat_map(|&index| self.names(index)).map(|(_, name)| name).collect();
        let mut others = Vec::new();
        // A folder that cannot be read has nothing that could be mixed up.
        for channel in std::fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            let of_channel = channel.file_name().to_string_lossy().into_owned();
            for file in std::fs::read_dir(channel.path()).into_iter().flatten().flatten() {
                let name = file.file_name().to_string_lossy().into_owned();
                let number = name
                    .strip_prefix("frame_")
                    .and_then(|rest| rest.split_once('.'))
                    .map(|(number, _)| number);
                let is_frame = number.is_some_and(|number| {
                    !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
                });
                let path = format!("{of_channel}/{name}");
                if is_frame && !own.contains(&path) {
                    others.push(path);
                }
            }
        }
        others.sort();
        others
    }

    /// Removes what a killed run left half written of these frames' files.
    pub fn sweep(&self, frames: &[u64]) {
        let names = frames.iter().flat_map(|&index| self.names(index));
        atomic::sweep(names.map(|(_, name)| self.folder.join(name)));
    }

    fn pieces(&self) -> Vec<Piece> {
        let mut pieces = Vec::new();
        if self.output.format.is_empty() {
            return pieces;
        }
        for channel in &self.output.channels {
            let of_channel = match channel {
                Channel::Color => self.output.format.iter().map(|&format| Piece::Color(format)).collect(),
                Channel::Depth => vec![Piece::Depth],
                Channel::Valid => vec![Piece::Valid],
                Channel::Coords => vec![Piece::Coords],
                Channel::Rows => vec![Piece::Rows],
            };
            // A channel or format that is named twice is still one file.
            of_channel.into_iter().for_each(|piece| {
                if !pieces.contains(&piece) {
                    pieces.push(piece)
                }
            });
        }
        pieces
    }

    fn write(&self, frame: &RenderedFrame) -> Result<u64, WriteError> {
        let pieces = self.pieces();
        check(frame, &pieces)?;
        let mut written = 0;
        for piece in pieces {
            let path = self.folder.join(name(piece, frame.index));
            let exr = |names: &[&str], samples: &[f32], pixel| {
                exr_file::encode(&path, frame.size_px, names, samples, pixel, self.output.exr_compression)
            };
            let bytes = match piece {
                Piece::Color(ImageFormat::Exr) => {
                    exr(&["R", "G", "B", "A"], &frame.color_rgba, self.output.exr_pixel)?
                }
                Piece::Color(ImageFormat::Png) => png_file::encode_color(&path, frame, self.encoding)?,
                Piece::Depth => exr(&["Z"], frame.depth_m.as_deref().unwrap_or_default(), ExrPixel::Float)?,
                Piece::Valid => png_file::encode_valid(&path, frame)?,
                Piece::Coords => {
                    let samples = frame.coords.as_deref().unwrap_or_default().as_flattened();
                    exr(&["u", "v", "x", "y", "dt", "n", "e", "d"], samples, ExrPixel::Float)?
                }
                Piece::Rows => tables::rows_csv(&frame.rows).into_bytes(),
            };
            write_atomic(&path, &bytes)?;
            written += bytes.len() as u64;
        }
        Ok(written)
    }
}

fn column(piece: Piece) -> &'static str {
    match piece {
        Piece::Color(ImageFormat::Exr) => "color_exr",
        Piece::Color(ImageFormat::Png) => "color_png",
        Piece::Depth => "depth",
        Piece::Valid => "valid",
        Piece::Coords => "coords",
        Piece::Rows => "rows",
    }
}

fn name(piece: Piece, index: u64) -> String {
    let (folder, ending) = match piece {
        Piece::Color(ImageFormat::Exr) => ("color", "exr"),
        Piece::Color(ImageFormat::Png) => ("color", "png"),
        Piece::Depth => ("depth", "exr"),
        Piece::Valid => ("valid", "png"),
        Piece::Coords => ("coords", "exr"),
        Piece::Rows => ("rows", "csv"),
    };
    format!("{folder}/frame_{index:06}.{ending}")
}

/// Encoders take planes on trust, so what does not fill the frame stops here.
fn check(frame: &RenderedFrame, pieces: &[Piece]) -> Result<(), WriteError> {
    let pixels = frame.size_px[0] as usize * frame.size_px[1] as usize;
    let needs = |piece: Piece| match piece {
        Piece::Color(_) | Piece::Valid => ("color", frame.color_rgba.len(), pixels * 4),
        Piece::Depth => ("depth", frame.depth_m.as_ref().map_or(0, Vec::len), pixels),
        Piece::Coords => {
            ("coords", frame.coords.as_ref().map_or(0, Vec::len) * COORDS_CHANNELS, pixels * COORDS_CHANNELS)
        }
        Piece::Rows => ("rows", frame.rows.len().min(1), 1),
    };
    for (what, found, needed) in pieces.iter().map(|&piece| needs(piece)) {
        if found != needed || pixels == 0 {
            let message = format!(
                "{what} has {found} values where {needed} are needed ({}x{})",
                frame.size_px[0], frame.size_px[1]
            );
            return Err(WriteError::Frame { frame: frame.index, message });
        }
    }
    Ok(())
}

/// What a writer did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WriteSummary {
    /// Frames taken.
    pub frames: u64,
    /// Bytes of their files.
    pub bytes: u64,
}

/// Encodes and writes frames on worker threads behind a bounded queue, so memory does not grow with the
/// sequence.
#[derive(Debug)]
pub struct FrameWriter {
    queue: Option<SyncSender<RenderedFrame>>,
    workers: Vec<JoinHandle<()>>,
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    failure: Mutex<Option<WriteError>>,
    frames: AtomicU64,
    bytes: AtomicU64,
}

impl Shared {
    fn take_failure(&self) -> Option<WriteError> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl FrameWriter {
    /// Starts `threads` (at least one) workers; at most as many frames again wait in the queue.
    pub fn new(files: FrameFiles, threads: usize) -> Self {
        let threads = threads.max(1);
        let (queue, frames) = sync_channel(threads);
        let frames = Arc::new(Mutex::new(frames));
        let shared = Arc::new(Shared::default());
        let files = Arc::new(files);
        let workers = (0..threads)
            .map(|_| {
                let (files, frames, shared) = (files.clone(), frames.clone(), shared.clone());
                std::thread::spawn(move || work(&files, &frames, &shared))
            })
            .collect();
        Self { queue: Some(queue), workers, shared }
    }

    /// Hands over a frame; waits while the queue is full.
    ///
    /// # Errors
    /// The first failure of an earlier frame; rendering should stop then.
    pub fn write(&self, frame: RenderedFrame) -> Result<(), WriteError> {
        let sent = self.queue.as_ref().is_some_and(|queue| queue.send(frame).is_ok());
        match self.shared.take_failure() {
            Some(failure) => Err(failure),
            None if sent => Ok(()),
            None => Err(WriteError::Ended),
        }
    }

    /// Waits until everything is on disk.
    ///
    /// # Errors
    /// The first failure that no `write` has told yet.
    pub fn finish(mut self) -> Result<WriteSummary, WriteError> {
        let whole = self.join();
        match self.shared.take_failure() {
            Some(failure) => Err(failure),
            None if whole => Ok(WriteSummary {
                frames: self.shared.frames.load(Ordering::Relaxed),
                bytes: self.shared.bytes.load(Ordering::Relaxed),
            }),
            None => Err(WriteError::Ended),
        }
    }

    fn join(&mut self) -> bool {
        self.queue = None;
        // Counted rather than `all`, which would stop at the first failure and leave the other threads
        // running.
        self.workers.drain(..).filter_map(|worker| worker.join().err()).count() == 0
    }
}

impl Drop for FrameWriter {
    fn drop(&mut self) {
        self.join();
    }
}

fn work(files: &FrameFiles, frames: &Mutex<Receiver<RenderedFrame>>, shared: &Shared) {
    loop {
        // The lock is held while waiting: the next frame goes to whoever waits, the others wait for the lock.
        let next = frames.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok(frame) = next else { return };
        match files.write(&frame) {
            Ok(bytes) => {
                shared.frames.fetch_add(1, Ordering::Relaxed);
                shared.bytes.fetch_add(bytes, Ordering::Relaxed);
            }
            Err(error) => {
                // Later frames would most likely fail alike (a full disk): the first failure is the one to
                // tell.
                shared.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            }
        }
    }
}
