//! YUV4MPEG2, the uncompressed video that ffmpeg, mpv, x264 and GStreamer read from files and pipes.

use std::io::{self, Write};

use camsim_core::frame::RenderedFrame;

use super::{pixels::srgb, rate};

/// Writes frames as YUV4MPEG2 without subsampling (`C444`, `C444p10`).
///
/// With sRGB values R, G, B in 0..=1 and the luma of ITU-R BT.601, which readers of this format assume:
///
/// ```text
/// Y' = 0.299 R + 0.587 G + 0.114 B     code 16 + 219 Y'
/// Cb = (B - Y') / 1.772                code 128 + 224 Cb
/// Cr = (R - Y') / 1.402                code 128 + 224 Cr      (all times 4 for 10 bits)
/// ```
#[derive(Debug)]
pub struct Y4mStream<W: Write> {
    out: W,
    fps: f64,
    bits: u32,
    has_header: bool,
}

impl<W: Write> Y4mStream<W> {
    /// A stream of frames with `bits` of 8 or 10.
    pub fn new(out: W, fps: f64, bits: u32) -> Self {
        Self { out, fps, bits, has_header: false }
    }

    /// Writes a frame, and the header before the first one.
    ///
    /// # Errors
    /// Errors of the stream.
    pub fn write(&mut self, frame: &RenderedFrame) -> io::Result<()> {
        if !self.has_header {
            let ([width, height], [numerator, denominator]) = (frame.size_px, rate::ratio(self.fps));
            let layout = if self.bits > 8 { "444p10 XYSCSS=444P10" } else { "444" };
            writeln!(
                self.out,
                "YUV4MPEG2 W{width} H{height} F{numerator}:{denominator} Ip A1:1 C{layout} XCOLORRANGE=LIMITED"
            )?;
            self.has_header = true;
        }
        self.out.write_all(b"FRAME\n")?;
        self.out.write_all(&planes(frame, self.bits))
    }

    /// The stream.
    pub fn into_inner(self) -> W {
        self.out
    }
}

/// Y', Cb and Cr of all pixels, one after the other.
fn planes(frame: &RenderedFrame, bits: u32) -> Vec<u8> {
    let codes: Vec<[u16; 3]> =
        frame.color_rgba().chunks_exact(4).map(|p| ycbcr([p[0], p[1], p[2]], bits)).collect();
    let plane = |channel: usize| codes.iter().map(move |code| code[channel]);
    let all = [0, 1, 2].into_iter().flat_map(plane);
    if bits > 8 { all.flat_map(u16::to_le_bytes).collect() } else { all.map(|code| code as u8).collect() }
}

/// Code values of a linear colour.
fn ycbcr(linear: [f32; 3], bits: u32) -> [u16; 3] {
    let [r, g, b] = linear.map(srgb);
    let luma = 0.299 * r + 0.587 * g + 0.114 * b;
    let scale = f32::from(1_u16 << (bits - 8));
    [16.0 + 219.0 * luma, 128.0 + 224.0 * (b - luma) / 1.772, 128.0 + 224.0 * (r - luma) / 1.402]
        .map(|code| (scale * code).round() as u16)
}
