//! Assignment of a picture's bands to colours and alpha.

use super::{citations::excerpt, metadata::BandMeaning, tiff_file::Image};

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

/// How to say which bands are colours.
const CHOOSE: &str = "to choose, run `gdal_translate -b RED -b GREEN -b BLUE -co PHOTOMETRIC=RGB IN OUT`";

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
    let Some(band) = meaning else { return true };
    let is_of_color = band.color.as_ref().is_none_or(|color| color.eq_ignore_ascii_case("Alpha"));
    let words = |text: &String| described_words(text);
    is_of_color
        && band.description.as_ref().map(words).is_none_or(|words| !words.iter().any(|word| is_light(word)))
}

/// Words of bands that are light, visible or not.
fn is_light(word: &str) -> bool {
    matches!(
        word.trim_end_matches(|c: char| c.is_ascii_digit()),
        "red"
            | "green"
            | "blue"
            | "nir"
            | "ir"
            | "infrared"
            | "nearinfrared"
            | "near"
            | "rededge"
            | "edge"
            | "vnir"
            | "swir"
            | "mir"
            | "mwir"
            | "lwir"
            | "tir"
            | "yellow"
            | "orange"
            | "violet"
            | "uv"
            | "ultraviolet"
            | "coastal"
            | "thermal"
            | "pan"
            | "panchromatic"
    )
}

/// Lower-case words of a description.
fn described_words(text: &str) -> Vec<String> {
    text.to_lowercase()
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_owned)
        .collect()
}

/// The colour (0 red, 1 green, 2 blue) that a description names and nothing else: `Blue`, `B`, `Band 1: Blue`,
/// `sr_blue`, `Red (650 nm)`, but not `Red edge`, `Coastal blue` or `B2`.
fn described_color(text: &str) -> Option<usize> {
    let is_neutral = |word: &str| {
        let digits = word.trim_start_matches("band").trim_start_matches("channel").trim_start_matches("ch");
        let digits = digits.trim_start_matches('b').trim_end_matches("nm");
        matches!(
            word,
            "band"
                | "channel"
                | "ch"
                | "layer"
                | "colour"
                | "color"
                | "sr"
                | "toa"
                | "boa"
                | "surface"
                | "reflectance"
                | "nm"
                | "um"
                | "light"
        ) || digits.chars().all(|c| c.is_ascii_digit()) && word != "b"
    };
    let words = described_words(text);
    let mut named = words.iter().filter(|word| !is_neutral(word));
    let color = match named.next()?.as_str() {
        "red" | "r" => 0,
        "green" | "g" => 1,
        "blue" | "b" => 2,
        _ => return None,
    };
    named.next().is_none().then_some(color)
}

/// Bands of red, green and blue by their descriptions; `None` where one of them is missing or named twice.
fn described_rgb(image: &Image, meanings: &[BandMeaning]) -> Option<[usize; 3]> {
    let mut rgb = [None; 3];
    for (index, band) in meanings.iter().take(image.bands).enumerate() {
        let Some(color) = band.description.as_deref().and_then(described_color) else { continue };
        if rgb[color].replace(index).is_some() {
            return None;
        }
    }
    Some([rgb[0]?, rgb[1]?, rgb[2]?])
}

/// Whether a description says that a band is not this colour: it names another one, or other light.
fn is_described_otherwise(band: &BandMeaning, color: usize) -> bool {
    band.description.as_deref().is_some_and(|text| match described_color(text) {
        Some(described) => described != color,
        None => described_words(text).iter().any(|word| is_light(word)),
    })
}

/// The descriptions of a picture's bands for a message, if it has any.
fn quoted_descriptions(image: &Image, meanings: &[BandMeaning]) -> Option<String> {
    let bands = meanings.iter().take(image.bands).map(|band| band.description.as_deref().unwrap_or("-"));
    let texts: Vec<String> = bands.map(excerpt).collect();
    texts.iter().any(|text| text != "-").then(|| texts.join(", "))
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
        let described_alpha = || {
            meanings.iter().take(image.bands).position(|band| {
                band.description
                    .as_deref()
                    .is_some_and(|text| described_words(text).contains(&"alpha".to_owned()))
            })
        };
        let alpha = band_named("Alpha")
            .or_else(|| extra(UNASSOCIATED))
            .or_else(|| extra(ASSOCIATED))
            .or_else(described_alpha);
        let is_premultiplied = alpha.is_some() && alpha == extra(ASSOCIATED);
        let described = described_rgb(image, meanings);
        let listed = quoted_descriptions(image, meanings).unwrap_or_default();
        let contradicts = |rgb: [usize; 3]| {
            rgb.iter().enumerate().any(|(color, band)| {
                meanings.get(*band).is_some_and(|band| is_described_otherwise(band, color))
            })
        };
        let rgb = match [band_named("Red"), band_named("Green"), band_named("Blue")] {
            [Some(red), Some(green), Some(blue)] => {
                let interpreted = [red, green, blue];
                if contradicts(interpreted) {
                    notes.push(format!(
                        "its bands are described as {listed}, but their colour interpretation has red, green and blue \
                         in bands {}, which is used: correct one of them",
                        interpreted.map(|band| (band + 1).to_string()).join(", ")
                    ));
                }
                interpreted
            }
            _ if described.is_some() && image.photometric <= 2 => {
                let rgb = described.unwrap_or([0, 1, 2]);
                if rgb != [0, 1, 2] {
                    notes.push(format!(
                        "its bands are described as {listed}: red, green and blue are taken from bands {}",
                        rgb.map(|band| (band + 1).to_string()).join(", ")
                    ));
                }
                rgb
            }
            _ => match image.photometric {
                0 | 1 | 3 | 4 if image.bands < 3 || image.photometric == 3 => [0; 3],
                2 if image.bands >= 3 => {
                    if contradicts([0, 1, 2]) {
                        notes.push(format!(
                            "is RGB by its photometric interpretation, but its bands are described as {listed}: the first \
                             three are used as red, green and blue; {CHOOSE}"
                        ));
                    }
                    [0, 1, 2]
                }
                0 | 1 if image.bands - usize::from(alpha.is_some()) >= 3 => {
                    let described = if listed.is_empty() {
                        String::new()
                    } else {
                        format!(" (they are described as {listed})")
                    };
                    notes.push(format!(
                        "does not state which of its bands are red, green and blue{described}: the first three are \
                         used; {CHOOSE}"
                    ));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn descriptions_name_one_colour_or_none() {
        for (text, color) in [
            ("Blue", Some(2)),
            ("RED", Some(0)),
            ("g", Some(1)),
            ("B", Some(2)),
            ("Band 1: Blue", Some(2)),
            ("band1_blue", Some(2)),
            ("sr_red", Some(0)),
            ("Green (560 nm)", Some(1)),
            ("B4 Red", Some(0)),
            ("Red edge", None),
            ("RedEdge", None),
            ("Coastal blue", None),
            ("NIR", None),
            ("B04", None),
            ("red/green", None),
            ("", None),
        ] {
            assert_eq!(described_color(text), color, "{text}");
        }
        let band = |text: &str| BandMeaning { description: Some(text.to_owned()), ..BandMeaning::default() };
        assert!(!may_be_alpha(Some(&band("NIR"))) && may_be_alpha(Some(&band("Alpha"))));
    }
}
