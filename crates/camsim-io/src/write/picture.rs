//! Writes one picture to a path of the user's choice.

use std::path::Path;

use camsim_core::{
    frame::RenderedFrame,
    scenario::{Channel, ExrCompression, ExrPixel, OutputEncoding},
};

use super::{WriteError, exr_file, png_file, write_atomic};

/// Writes the picture of one frame. The extension of `path` selects the format: `.exr` is linear R, G, B, A
/// in 32-bit floats, with depth `Z` if the frame has it; `.png` is encoded as `output` says.
///
/// # Errors
/// The extension is another, a plane does not match the size of the frame, or the file cannot be written.
pub fn write_picture(path: &Path, frame: &RenderedFrame, output: OutputEncoding) -> Result<(), WriteError> {
    let pixels = frame.size_px[0] as usize * frame.size_px[1] as usize;
    let (color_rgba, depth) = (frame.color_rgba(), frame.depth_m());
    if color_rgba.len() != 4 * pixels || depth.is_some_and(|depth| depth.len() != pixels) {
        return Err(WriteError::Frame {
            frame: frame.index,
            message: "its planes do not fill its size".into(),
        });
    }
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    let exr = |names: &[&str], samples: &[f32]| {
        exr_file::encode(path, frame.size_px, names, samples, ExrPixel::Float, ExrCompression::Zip16)
    };
    let bytes = match (ending.as_str(), depth) {
        ("png", _) => png_file::encode_color(path, frame, output)?,
        ("exr", None) => exr(Channel::Color.components(), color_rgba)?,
        ("exr", Some(depth)) => {
            let samples: Vec<f32> = color_rgba
                .chunks_exact(4)
                .zip(depth)
                .flat_map(|(p, z)| [p[0], p[1], p[2], p[3], *z])
                .collect();
            exr(&[Channel::Color, Channel::Depth].map(Channel::components).concat(), &samples)?
        }
        _ => {
            return Err(WriteError::Encode {
                path: path.into(),
                message: "its name must end in .exr or .png, which chooses the format".into(),
            });
        }
    };
    write_atomic(path, &bytes)
}
