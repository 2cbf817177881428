//! Videos by the user's ffmpeg, which gets the frames through a pipe.

use std::{
    ffi::OsString,
    io::{self, Read, Write},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{Arc, mpsc::Receiver},
    thread::JoinHandle,
};

use camsim_core::{
    frame::RenderedFrame,
    scenario::{ImageFormat, VideoCodec, VideoSpec},
};

use super::{Series, pixels, rate};
use crate::write::WriteError;

/// Whether there is an ffmpeg on the PATH, which `mp4` and `mkv` need.
#[must_use]
pub fn has_ffmpeg() -> bool {
    let found = Command::new("ffmpeg").arg("-version").stdin(Stdio::null()).output();
    found.is_ok_and(|output| output.status.success())
}

/// Checks that there is an ffmpeg. `path` is for messages only.
pub(super) fn find(path: &Path) -> Result<(), WriteError> {
    if has_ffmpeg() {
        return Ok(());
    }
    Err(WriteError::Encode {
        path: path.into(),
        message:
            "it needs the program ffmpeg, which is not on the PATH: install it (Debian, Ubuntu: apt install \
                  ffmpeg; macOS: brew install ffmpeg), or choose the format y4m or png"
                .into(),
    })
}

/// A running ffmpeg.
pub(super) struct Ffmpeg {
    child: Child,
    messages: Option<JoinHandle<String>>,
    path: PathBuf,
    bits: u32,
}

impl Ffmpeg {
    /// Starts ffmpeg, which writes to `temporary`. `path` is the final name, for messages.
    pub(super) fn start(
        temporary: &Path,
        path: &Path,
        format: ImageFormat,
        spec: VideoSpec,
        series: Series,
        first: &RenderedFrame,
    ) -> Result<Self, WriteError> {
        let mut command = Command::new("ffmpeg");
        command.args(arguments(format, spec, series, first)).arg(temporary);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        // Ctrl-C is for camsim, which ends ffmpeg by closing the pipe.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(|source| WriteError::Io { path: path.into(), source })?;
        let messages = child.stderr.take().map(|mut stderr| {
            std::thread::spawn(move || {
                let mut text = String::new();
                // A message that cannot be read is skipped.
                let _ = stderr.read_to_string(&mut text);
                text
            })
        });
        Ok(Self { child, messages, path: path.into(), bits: spec.bits })
    }

    /// Encodes the frames that come; their number.
    pub(super) fn encode(
        mut self,
        first: Arc<RenderedFrame>,
        frames: &Receiver<Arc<RenderedFrame>>,
    ) -> Result<u64, WriteError> {
        let mut count = 0;
        for frame in std::iter::once(first).chain(frames) {
            // A pipe that is closed has a reason, which ffmpeg says.
            if self.pass(&frame).is_err() {
                break;
            }
            count += 1;
        }
        drop(self.child.stdin.take());
        let status =
            self.child.wait().map_err(|source| WriteError::Io { path: self.path.clone(), source })?;
        let messages = self.messages.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        if status.success() {
            return Ok(count);
        }
        let last = messages.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("no message");
        let message = format!(
            "ffmpeg ended with {status}: {last}; if it lacks the encoder, choose another output.video.codec, or the \
             format y4m"
        );
        Err(WriteError::Encode { path: self.path.clone(), message })
    }

    fn pass(&mut self, frame: &RenderedFrame) -> io::Result<()> {
        let bytes = if self.bits > 8 { pixels::rgb16(frame) } else { pixels::rgb8(frame) };
        self.child.stdin.as_mut().map_or(Ok(()), |pipe| pipe.write_all(&bytes))
    }
}

/// Arguments up to the name of the file.
fn arguments(format: ImageFormat, spec: VideoSpec, series: Series, first: &RenderedFrame) -> Vec<OsString> {
    let [width, height] = first.size_px;
    let [numerator, denominator] = rate::ratio(series.fps);
    let is_lossless = spec.codec == VideoCodec::Ffv1;
    // Encoders halve the colour's resolution where the size allows it, as all players expect.
    let subsampling = if width % 2 == 0 && height % 2 == 0 { "420" } else { "444" };
    let pixel_format = match (is_lossless, spec.bits > 8) {
        (true, false) => "gbrp".to_owned(),
        (true, true) => "gbrp10le".to_owned(),
        (false, false) => format!("yuv{subsampling}p"),
        (false, true) => format!("yuv{subsampling}p10le"),
    };
    let input = if spec.bits > 8 { "rgb48le" } else { "rgb24" };
    let text = format!(
        "-hide_banner -loglevel error -nostdin -y -f rawvideo -pixel_format {input} -video_size {width}x{height} \
         -framerate {numerator}/{denominator} -i pipe:0"
    );
    let mut list: Vec<OsString> = text.split(' ').map(OsString::from).collect();
    let mut add = |words: &str| list.extend(words.split(' ').map(OsString::from));
    match spec.codec {
        VideoCodec::H264 => add(&format!("-c:v libx264 -crf {}", spec.crf)),
        VideoCodec::H265 => {
            add(&format!("-c:v libx265 -crf {} -tag:v hvc1 -x265-params log-level=error", spec.crf))
        }
        VideoCodec::Ffv1 => add("-c:v ffv1 -level 3"),
    }
    if is_lossless {
        add("-color_primaries bt709 -color_trc iec61966-2-1");
    } else {
        add("-vf scale=out_color_matrix=bt709:out_range=tv -colorspace bt709 -color_primaries bt709");
        add("-color_trc iec61966-2-1 -color_range tv");
    }
    add(&format!("-pix_fmt {pixel_format}"));
    match format {
        ImageFormat::Mp4 => add("-movflags +faststart -f mp4"),
        _ => add("-f matroska"),
    }
    list.push("-metadata".into());
    list.push(format!("comment={}", stamp_note(series, first)).into());
    list
}

/// Stamps of the frames, in words: players count from 0.
fn stamp_note(series: Series, first: &RenderedFrame) -> String {
    format!(
        "first frame: number {}, stamp {} ns; then every {:.3} ns; frames.csv has all stamps",
        first.index,
        first.stamp_ns,
        1e9 / series.fps
    )
}
