//! Metadata chunks of PNG files about the meaning of their values.

use std::path::Path;

/// Value of `gAMA` for sRGB.
const SRGB_GAMMA: f64 = 0.454_55;
/// Value of `cHRM` for sRGB: x and y of white, red, green and blue, times 100000.
const SRGB_CHROMATICITIES: [u32; 8] = [31_270, 32_900, 64_000, 33_000, 30_000, 60_000, 15_000, 6_000];
/// Tolerance of [`SRGB_CHROMATICITIES`], for rounding by writers.
const CHROMATICITY_SLACK: u32 = 500;
/// Value of `cICP` for sRGB: primaries, transfer function, matrix, range.
const SRGB_CICP: [u8; 4] = [1, 13, 0, 1];

/// Metadata chunks before the pixels.
#[derive(Default)]
pub(super) struct PngChunks {
    is_srgb: bool,
    gamma: Option<f64>,
    chromaticities: Option<[u32; 8]>,
    cicp: Option<[u8; 4]>,
    /// Names of the chunks `sBIT`, `pCAL` and `sCAL` that are present.
    calibration: Vec<&'static str>,
}

impl PngChunks {
    /// Reads the chunks of a file. Errors are left to the decoder of the pixels.
    pub(super) fn read(path: &Path) -> Self {
        let mut chunks = Self::default();
        if let Ok(bytes) = std::fs::read(path) {
            chunks.parse(&bytes);
        }
        chunks
    }

    fn parse(&mut self, bytes: &[u8]) -> Option<()> {
        let unsigned = |offset: usize| {
            bytes.get(offset..offset.checked_add(4)?).map(|b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]))
        };
        let mut offset = 8_usize;
        loop {
            let length = unsigned(offset)? as usize;
            match bytes.get(offset + 4..offset + 8)? {
                b"sRGB" => self.is_srgb = true,
                b"gAMA" => self.gamma = unsigned(offset + 8).map(|value| f64::from(value) / 1e5),
                b"cICP" => self.cicp = bytes.get(offset + 8..offset + 12).and_then(|b| b.try_into().ok()),
                b"cHRM" if length == 32 => {
                    let mut all = [0; 8];
                    for (k, value) in all.iter_mut().enumerate() {
                        *value = unsigned(offset + 8 + 4 * k)?;
                    }
                    self.chromaticities = Some(all);
                }
                b"sBIT" => self.calibration.push("sBIT"),
                b"pCAL" => self.calibration.push("pCAL"),
                b"sCAL" => self.calibration.push("sCAL"),
                b"IDAT" | b"IEND" => return Some(()),
                _ => {}
            }
            offset = offset.checked_add(length.checked_add(12)?)?;
        }
    }

    /// Description of the transfer function, if it is not that of sRGB.
    pub(super) fn foreign_transfer(&self) -> Option<String> {
        if let Some(cicp @ [_, transfer, ..]) = self.cicp {
            let differs = cicp[1..] != SRGB_CICP[1..];
            return differs.then(|| {
                format!("that its values have transfer {transfer} (cICP {cicp:?}), which is not sRGB's")
            });
        }
        let gamma = self.gamma.filter(|gamma| !self.is_srgb && (gamma - SRGB_GAMMA).abs() > 0.01)?;
        Some(format!("that its values are light to the power of {gamma} (gAMA), as sRGB is not"))
    }

    /// Note about primaries that are not applied.
    pub(super) fn color_note(&self) -> Option<String> {
        if let Some(cicp) = self.cicp {
            let note = || {
                format!(
                    "its cICP {cicp:?} is not applied: primaries are taken for those of sRGB, the curve as \
                        color_space says"
                )
            };
            return (cicp != SRGB_CICP).then(note);
        }
        let other = |all: &[u32; 8]| {
            all.iter().zip(&SRGB_CHROMATICITIES).any(|(a, b)| a.abs_diff(*b) > CHROMATICITY_SLACK)
        };
        self.chromaticities.filter(|all| !self.is_srgb && other(all)).map(|all| {
            format!(
                "its primaries (cHRM {all:?}) are not those of sRGB, and are not applied: its colours \
                are taken for those of sRGB"
            )
        })
    }

    /// Note about calibration chunks that are not applied.
    pub(super) fn depth_note(&self) -> Option<String> {
        let names = self.calibration.join(", ");
        (!names.is_empty()).then(|| {
            format!("its {names} is not applied: depth is the whole number stored over depth_per_metre")
        })
    }
}
