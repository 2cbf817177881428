//! What a PNG says of its values beside its pixels.

use std::path::Path;

/// What sRGB's curve comes nearest to, as PNG files say it.
const SRGB_GAMMA: f64 = 0.454_55;
/// White, red, green and blue of sRGB: x and y each, in hundred thousandths.
const SRGB_CHROMATICITIES: [u32; 8] = [31_270, 32_900, 64_000, 33_000, 30_000, 60_000, 15_000, 6_000];
/// How far they may be off, as writers round them.
const CHROMATICITY_SLACK: u32 = 500;
/// Primaries, transfer, matrix and range of sRGB, in `cICP`.
const SRGB_CICP: [u8; 4] = [1, 13, 0, 1];

/// The chunks ahead of the pixels.
#[derive(Default)]
pub(super) struct PngChunks {
    is_srgb: bool,
    gamma: Option<f64>,
    chromaticities: Option<[u32; 8]>,
    cicp: Option<[u8; 4]>,
    /// `sBIT`, `pCAL`, `sCAL`: what its numbers stand for.
    calibration: Vec<&'static str>,
}

impl PngChunks {
    /// Reads them; of what is damaged the decoder tells.
    pub(super) fn read(path: &Path) -> Self {
        let mut found = Self::default();
        if let Ok(bytes) = std::fs::read(path) {
            found.walk(&bytes);
        }
        found
    }

    fn walk(&mut self, bytes: &[u8]) -> Option<()> {
        let word = |at: usize| {
            bytes.get(at..at.checked_add(4)?).map(|b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]))
        };
        let mut at = 8_usize;
        loop {
            let length = word(at)? as usize;
            match bytes.get(at + 4..at + 8)? {
                b"sRGB" => self.is_srgb = true,
                b"gAMA" => self.gamma = word(at + 8).map(|value| f64::from(value) / 1e5),
                b"cICP" => self.cicp = bytes.get(at + 8..at + 12).and_then(|b| b.try_into().ok()),
                b"cHRM" if length == 32 => {
                    let mut all = [0; 8];
                    for (k, value) in all.iter_mut().enumerate() {
                        *value = word(at + 8 + 4 * k)?;
                    }
                    self.chromaticities = Some(all);
                }
                b"sBIT" => self.calibration.push("sBIT"),
                b"pCAL" => self.calibration.push("pCAL"),
                b"sCAL" => self.calibration.push("sCAL"),
                b"IDAT" | b"IEND" => return Some(()),
                _ => {}
            }
            at = at.checked_add(length.checked_add(12)?)?;
        }
    }

    /// What it says of its curve, where that is not sRGB's.
    pub(super) fn other_curve(&self) -> Option<String> {
        if let Some(cicp @ [_, transfer, ..]) = self.cicp {
            let differs = cicp[1..] != SRGB_CICP[1..];
            return differs.then(|| {
                format!("that its values have transfer {transfer} (cICP {cicp:?}), which is not sRGB's")
            });
        }
        let gamma = self.gamma.filter(|gamma| !self.is_srgb && (gamma - SRGB_GAMMA).abs() > 0.01)?;
        Some(format!("that its values are light to the power of {gamma} (gAMA), as sRGB is not"))
    }

    /// What of its colours is not applied.
    pub(super) fn color_note(&self) -> Option<String> {
        if let Some(cicp) = self.cicp {
            let of = || {
                format!(
                    "its cICP {cicp:?} is not applied: primaries are taken for those of sRGB, the curve as \
                        color_space says"
                )
            };
            return (cicp != SRGB_CICP).then(of);
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

    /// What of its numbers is not applied.
    pub(super) fn depth_note(&self) -> Option<String> {
        let names = self.calibration.join(", ");
        (!names.is_empty()).then(|| {
            format!("its {names} is not applied: depth is the whole number stored over depth_per_metre")
        })
    }
}
