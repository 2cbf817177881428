//! Assignment of a picture's bands to colours and alpha.

use super::{metadata::BandMeaning, tiff_file::Image};

/// Values of tag 262 (PhotometricInterpretation) with their treatment.
pub(crate) const PHOTOMETRICS: &[(u64, &str, &str)] = &[
    (0, "grey, 0 is white", "applied to pictures, not to heights"),
    (1, "grey, 0 is black", "applied"),
    (2, "RGB", "applied"),
    (3, "palette", "applied"),
    (4, "mask", "applied, in a directory of its own"),
    (5, "CMYK", "refused, with the command that converts"),
    (6, "YCbCr", "applied in JPEG, else refused"),
    (8, "CIELab", "refused, with the command that converts"),
];

/// Tag 338 (ExtraSamples): premultiplied alpha.
const ASSOCIATED: u64 = 1;
/// Tag 338 (ExtraSamples): straight alpha.
const UNASSOCIATED: u64 = 2;

/// Bands of a colour picture.
#[derive(Debug, PartialEq)]
pub(super) struct ColorBands {
    /// Indices of red, green, blue; equal for grey.
    pub rgb: [usize; 3],
    /// Index of alpha.
    pub alpha: Option<usize>,
    pub is_premultiplied: bool,
    /// Whether alpha is scaled by the full range of its bits instead of the white level.
    pub alpha_is_full_scale: bool,
    pub is_palette: bool,
    pub is_inverted: bool,
    pub notes: Vec<String>,
}

/// Whether a band that the tags declare as alpha may be alpha: some writers declare any fourth band so and
/// state otherwise in GDAL_METADATA.
pub(super) fn may_be_alpha(meaning: Option<&BandMeaning>) -> bool {
    meaning.and_then(|band| band.color.as_ref()).is_none_or(|color| color.eq_ignore_ascii_case("Alpha"))
}

impl ColorBands {
    /// An error states why the colours cannot be read.
    pub fn new(image: &Image, meanings: &[BandMeaning], has_palette: bool) -> Result<Self, String> {
        let mut notes = Vec::new();
        let band_named = |name: &str| {
            meanings
                .iter()
                .position(|band| band.color.as_deref().is_some_and(|color| color.eq_ignore_ascii_case(name)))
                .filter(|band| *band < image.bands)
        };
        let extra = |kind: u64| {
            let band = |k: usize| (image.bands + k).checked_sub(image.extra.len());
            let kinds = image.extra.iter().enumerate().filter(|(_, extra)| **extra == kind);
            kinds.filter_map(|(k, _)| band(k)).find(|band| may_be_alpha(meanings.get(*band)))
        };
        let alpha = band_named("Alpha").or_else(|| extra(UNASSOCIATED)).or_else(|| extra(ASSOCIATED));
        let is_premultiplied = alpha.is_some() && alpha == extra(ASSOCIATED);
        let rgb = match [band_named("Red"), band_named("Green"), band_named("Blue")] {
            [Some(red), Some(green), Some(blue)] => [red, green, blue],
            _ => match image.photometric {
                0 | 1 | 3 | 4 if image.bands < 3 || image.photometric == 3 => [0; 3],
                2 if image.bands >= 3 => [0, 1, 2],
                0 | 1 if image.bands - usize::from(alpha.is_some()) >= 3 => {
                    notes.push(
                        "does not state which of its bands are red, green and blue: the first three are \
                         used; to choose, run `gdal_translate -b RED -b GREEN -b BLUE -co PHOTOMETRIC=RGB IN \
                         OUT`"
                            .to_owned(),
                    );
                    [0, 1, 2]
                }
                0 | 1 => [0; 3],
                5 => return Err("CMYK colours are not read".into()),
                8..=10 => return Err("CIELab colours are not read".into()),
                2 => return Err(format!("RGB colours need 3 bands, but there are {}", image.bands)),
                other => return Err(format!("colours of photometric interpretation {other} are not read")),
            },
        };
        let used = |band: usize| rgb.contains(&band) || alpha == Some(band);
        let unused: Vec<String> =
            (0..image.bands).filter(|&band| !used(band)).map(|band| (band + 1).to_string()).collect();
        if !unused.is_empty() {
            notes.push(format!(
                "its bands {} are neither colours nor alpha and are ignored",
                unused.join(", ")
            ));
        }
        if let Some(band) = meanings.iter().take(image.bands).find(|band| {
            band.scale.is_some_and(|scale| scale != 1.0) || band.offset.is_some_and(|offset| offset != 0.0)
        }) {
            notes.push(format!(
                "a band's scale {} and offset {} (GDAL_METADATA) are not applied to colours",
                band.scale.unwrap_or(1.0),
                band.offset.unwrap_or(0.0)
            ));
        }
        let is_palette = has_palette && image.photometric == 3;
        Ok(Self {
            rgb,
            alpha,
            is_premultiplied,
            alpha_is_full_scale: image.bits == 8,
            is_palette,
            is_inverted: image.photometric == 0,
            notes,
        })
    }
}
