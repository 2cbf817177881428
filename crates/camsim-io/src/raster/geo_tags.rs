//! Tags of a GeoTIFF: georeference, coordinate system, no-data value, metadata.

use std::path::PathBuf;

use super::{
    georeference::Affine,
    metadata::{BandMeaning, Metadata},
    tiff_file::{Directory, TiffFile, tag},
};

/// Metadata of a raster, from its tags and sidecar files.
#[derive(Clone, Debug, Default)]
pub(crate) struct GeoTags {
    pub model_from_pixel: Option<Affine>,
    pub keys: GeoKeys,
    /// No-data value, as stored.
    pub nodata: Option<f64>,
    /// Meaning of the bands' values.
    pub bands: Vec<BandMeaning>,
    /// Scale and offset of heights from the third values of tags 33550 and 33922.
    pub vertical_scale: Option<[f64; 2]>,
    /// Tag 274; `None` for the default orientation.
    pub orientation: Option<u64>,
    /// Coordinate systems as well-known or ARC/INFO text, with their files; earlier ones take precedence.
    pub texts: Vec<(PathBuf, String)>,
    /// Items of the file or its first band that GDAL does not use: name and value.
    pub items: Vec<(String, String)>,
    /// Free-text descriptions of the file or its first band.
    pub descriptions: Vec<String>,
    /// Notes about tags that are ignored.
    pub notes: Vec<String>,
}

/// The GeoKeys that are read, by their EPSG codes.
#[derive(Clone, Debug, Default)]
pub(crate) struct GeoKeys {
    /// Key 1024: 1 projected, 2 geographic, 3 geocentric.
    pub model_type: Option<u16>,
    /// Key 3072: EPSG code of the projected system.
    pub projected: Option<u16>,
    /// Key 2048: EPSG code of the geographic system.
    pub geographic: Option<u16>,
    /// Key 3074: EPSG code of the projection of a system without code.
    pub projection: Option<u16>,
    /// Key 3075: method of a user-defined projection.
    pub method: Option<u16>,
    /// Keys 3073, 1026 or 2049: name of the system.
    pub citation: String,
    /// All of these keys that are given, by their names.
    pub citations: Vec<(&'static str, String)>,
    /// Key 3076: EPSG code of the linear unit.
    pub linear_unit: Option<u16>,
    /// Key 2054: EPSG code of the angular unit.
    pub angular_unit: Option<u16>,
    /// Key 4096: EPSG code of the vertical system.
    pub vertical: Option<u16>,
    /// Key 4097: name of the vertical system.
    pub vertical_citation: String,
    /// Key 4099: EPSG code of the unit of heights.
    pub vertical_unit: Option<u16>,
}

/// GeoKeys with their treatment.
pub(crate) const GEO_KEYS: &[(&str, &str, &str)] = &[
    ("1024 GTModelType", "projected or geographic", "applied; geocentric is refused"),
    ("1025 GTRasterType", "whether integer pixel coordinates are corners (1) or centres (2)", "applied"),
    (
        "1026, 2049, 3073 citations",
        "name of the coordinate system",
        "stated where the system is refused. Its vertical part (after a plus, or by words such as NAVD88 or height) \
         as 4097; another unit of coordinates than that of the code is reported",
    ),
    ("2048 GeodeticCRS", "EPSG code of latitude and longitude", "applied, or refused by its code"),
    ("2054 GeogAngularUnits", "9102 (degrees)", "applied; others are refused"),
    ("3072 ProjectedCRS", "EPSG code of east and north", "applied, or refused by its code"),
    (
        "3074 Projection",
        "UTM zone of a system without a code",
        "applied with geodetic codes 4326, 4258, 4269; others are refused",
    ),
    ("3075, 3078 to 3096", "user-defined projection", "refused, with the command that converts"),
    ("3076 ProjLinearUnits", "must be the unit of the code in 3072", "refused where they differ"),
    (
        "4096 VerticalCRS",
        "EPSG code of the heights' datum and unit",
        "unit applied; a datum that contradicts scene.terrain.height is reported",
    ),
    (
        "4097 VerticalCitation",
        "name of the vertical system",
        "stated where 4096 is unknown; its unit is applied and reported where nothing else states one, its datum is \
         reported where it contradicts scene.terrain.height",
    ),
    ("4099 VerticalUnits", "9001 metre, 9002 foot, 9003 US survey foot", "applied; others are refused"),
];

/// GeoKey value of a user-defined system.
pub(crate) const USER_DEFINED: u16 = 32767;

impl GeoTags {
    pub fn read(tiff: &mut TiffFile, directory: &Directory) -> Result<Self, String> {
        let mut tags = Self::default();
        let scale = tiff.reals(directory, tag::MODEL_PIXEL_SCALE)?;
        let tie = tiff.reals(directory, tag::MODEL_TIEPOINT)?;
        let matrix = tiff.reals(directory, tag::MODEL_TRANSFORMATION)?;
        let raster_type = tags.read_keys(tiff, directory)?;
        let affine = affine(scale.as_deref(), tie.as_deref(), matrix.as_deref());
        // 2: integer pixel coordinates are pixel centres ("pixel is point").
        tags.model_from_pixel =
            if raster_type == Some(2) { affine.map(Affine::with_centres_at_half) } else { affine };
        if affine.is_none()
            && let Some(points) = tie.as_ref().map(|tie| tie.len() / 6).filter(|points| *points > 1)
        {
            tags.notes.push(format!(
                "{points} ground control points (tag 33922) without a pixel size are not supported as \
                 georeference: warp the file with `gdalwarp -t_srs EPSG:CODE IN OUT`"
            ));
        }
        tags.vertical_scale = match (&scale, &tie, &matrix) {
            (_, _, Some(matrix)) if matrix.len() >= 12 => Some([matrix[10], matrix[11]]),
            // Heights of the tie point: model = z + scale (raster - k).
            (Some(scale), Some(tie), None) if scale.len() >= 3 && tie.len() >= 6 => {
                Some([scale[2], tie[5] - tie[2] * scale[2]])
            }
            _ => None,
        }
        .filter(|[scale, offset]| {
            scale.is_finite() && offset.is_finite() && (!matches!(*scale, 0.0 | 1.0) || *offset != 0.0)
        })
        .map(|[scale, offset]| [if scale == 0.0 { 1.0 } else { scale }, offset]);
        if let Some(text) = tiff.text(directory, tag::GDAL_NODATA)? {
            let text = text.trim();
            tags.nodata = Some(number(text).ok_or_else(|| {
                format!("its no-data value (tag 42113) is `{text}`, which is not a number")
            })?);
        }
        if let Some(text) = tiff.text(directory, tag::GDAL_METADATA)? {
            match Metadata::from_tag(&text) {
                Ok(metadata) => {
                    tags.bands = metadata.bands;
                    tags.items = metadata.items;
                    tags.descriptions = metadata.descriptions;
                }
                Err(reason) => {
                    return Err(format!(
                        "its GDAL_METADATA (tag 42112) cannot be read, and may have a scale or a unit: \
                         {reason}"
                    ));
                }
            }
        }
        tags.descriptions.extend(tiff.text(directory, tag::IMAGE_DESCRIPTION).ok().flatten());
        tags.orientation =
            tiff.integer(directory, tag::ORIENTATION)?.filter(|orientation| !matches!(orientation, 0 | 1));
        if directory.has(tag::RPC_COEFFICIENTS) {
            tags.notes.push(
                "its rational camera model (RPC, tag 50844) is ignored: orthorectify the picture, or its \
                 georeference is inaccurate"
                    .into(),
            );
        }
        Ok(tags)
    }

    /// Reads the GeoKey directory and returns the raster type.
    fn read_keys(&mut self, tiff: &mut TiffFile, directory: &Directory) -> Result<Option<u16>, String> {
        let keys: Vec<u16> = tiff
            .integers(directory, tag::GEO_KEY_DIRECTORY)?
            .unwrap_or_default()
            .iter()
            .map(|&key| key as u16)
            .collect();
        let texts = tiff.text(directory, tag::GEO_ASCII_PARAMS)?.unwrap_or_default();
        // Entries: key, tag of the value (0: the entry itself), count, value or index.
        let entry = |number: u16| {
            keys.get(4..).and_then(|keys| keys.chunks_exact(4).find(|entry| entry[0] == number))
        };
        let key = |number: u16| {
            entry(number).filter(|entry| entry[1] == 0).map(|entry| entry[3]).filter(|&code| code != 0)
        };
        let text = |number: u16| {
            let entry = entry(number).filter(|entry| entry[1] == tag::GEO_ASCII_PARAMS);
            let text = entry.and_then(|entry| {
                texts.get(
                    usize::from(entry[3])..(usize::from(entry[3]) + usize::from(entry[2])).min(texts.len()),
                )
            });
            text.map(|text| text.trim_end_matches(['|', '\0', ' ']).to_owned())
                .filter(|text| !text.is_empty())
        };
        self.keys = GeoKeys {
            model_type: key(1024),
            projected: key(3072),
            geographic: key(2048),
            projection: key(3074),
            method: key(3075),
            citation: text(3073).or_else(|| text(1026)).or_else(|| text(2049)).unwrap_or_default(),
            citations: [("GTCitation", 1026), ("GeogCitation", 2049), ("PCSCitation", 3073)]
                .into_iter()
                .filter_map(|(name, number)| Some((name, text(number)?)))
                .collect(),
            linear_unit: key(3076),
            angular_unit: key(2054),
            vertical: key(4096),
            vertical_citation: text(4097).unwrap_or_default(),
            vertical_unit: key(4099),
        };
        Ok(key(1025))
    }
}

/// A number as GDAL writes it: also `nan`, `inf`, and `-1.#IND` of old versions.
pub(super) fn number(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches('\0');
    if text.contains("#IND") || text.contains("#QNAN") { Some(f64::NAN) } else { text.parse().ok() }
}

/// The georeference of a transformation matrix, or of a pixel scale and a tie point.
fn affine(scale: Option<&[f64]>, tie: Option<&[f64]>, matrix: Option<&[f64]>) -> Option<Affine> {
    if let Some([a, b, _, c, d, e, _, f, ..]) = matrix {
        return Some(Affine { origin: [*c, *f], column: [*a, *d], row: [*b, *e] });
    }
    let ([sx, sy, ..], [i, j, _, x, y, ..]) = (scale?, tie?) else { return None };
    // Rows run south; the scale is positive by convention.
    Some(Affine { origin: [x - i * sx, y + j * sy], column: [*sx, 0.0], row: [0.0, -sy] })
}
