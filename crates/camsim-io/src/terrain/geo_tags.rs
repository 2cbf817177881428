//! What a GeoTIFF's tags say about place and meaning.

use std::path::PathBuf;

use super::{
    georeference::Affine,
    metadata::{BandMeaning, Metadata},
    tiff_file::{Directory, TiffFile, tag},
};

/// What tags or the files beside a raster say.
#[derive(Clone, Debug, Default)]
pub(crate) struct GeoTags {
    pub model_from_pixel: Option<Affine>,
    pub keys: GeoKeys,
    pub nodata: Option<f64>,
    /// What the numbers of the first bands mean.
    pub bands: Vec<BandMeaning>,
    /// Scale and offset of heights in the georeference itself: tags 33550 and 33922, third number each.
    pub vertical_scale: Option<[f64; 2]>,
    /// Tag 274, unless it says that rows go down from the top left.
    pub orientation: Option<u64>,
    /// Coordinate systems as text, with the files that they are in; the first goes first.
    pub texts: Vec<(PathBuf, String)>,
    /// Items that GDAL itself does not use, but which may speak of the first band: name and value.
    pub items: Vec<(String, String)>,
    /// What people wrote of the first band or the file.
    pub descriptions: Vec<String>,
    /// What is left out.
    pub notes: Vec<String>,
}

/// The GeoKeys that are read, by their EPSG codes.
#[derive(Clone, Debug, Default)]
pub(crate) struct GeoKeys {
    /// 1024: 1 projected, 2 geographic, 3 geocentric.
    pub model_type: Option<u16>,
    /// 3072.
    pub projected: Option<u16>,
    /// 2048.
    pub geographic: Option<u16>,
    /// 3074: the projection of what has no code.
    pub projection: Option<u16>,
    /// 3075: its method. Only what defines its own has one.
    pub method: Option<u16>,
    /// 3073 or 1026: what it is called.
    pub citation: String,
    /// 3076.
    pub linear_unit: Option<u16>,
    /// 2054.
    pub angular_unit: Option<u16>,
    /// 4096.
    pub vertical: Option<u16>,
    /// 4097 (what it is called).
    pub vertical_citation: String,
    /// 4099.
    pub vertical_unit: Option<u16>,
}

/// GeoKeys and what becomes of them.
pub(crate) const GEO_KEYS: &[(&str, &str, &str)] = &[
    ("1024 GTModelType", "projected or geographic", "applied; geocentric is refused"),
    ("1025 GTRasterType", "whether whole pixel coordinates are corners (1) or centres (2)", "applied"),
    ("1026, 3073 citations", "what the coordinate system is called", "named where the system is refused"),
    ("2048 GeodeticCRS", "EPSG code of latitude and longitude", "applied, or refused by its code"),
    ("2054 GeogAngularUnits", "9102 (degrees)", "applied; others are refused"),
    ("3072 ProjectedCRS", "EPSG code of east and north", "applied, or refused by its code"),
    (
        "3074 Projection",
        "UTM zone of a system without a code",
        "applied with geodetic codes 4326, 4258, 4269; others are refused",
    ),
    (
        "3075, 3078 to 3096",
        "a projection of the file's own",
        "refused, with the command that gives it a code",
    ),
    ("3076 ProjLinearUnits", "must be the unit of the code in 3072", "refused where it is another"),
    (
        "4096 VerticalCRS",
        "EPSG code of the heights' datum and unit",
        "unit applied; a datum that contradicts scene.terrain.height warns",
    ),
    ("4097 VerticalCitation", "what it is called", "named where 4096 has no code"),
    ("4099 VerticalUnits", "9001 metre, 9002 foot, 9003 US survey foot", "applied; others are refused"),
];

/// "User-defined" and "undefined".
pub(crate) const USER_DEFINED: u16 = 32767;

impl GeoTags {
    pub fn read(tiff: &mut TiffFile, of: &Directory) -> Result<Self, String> {
        let mut tags = Self::default();
        let scale = tiff.reals(of, tag::MODEL_PIXEL_SCALE)?;
        let tie = tiff.reals(of, tag::MODEL_TIEPOINT)?;
        let matrix = tiff.reals(of, tag::MODEL_TRANSFORMATION)?;
        let raster_type = tags.read_keys(tiff, of)?;
        let affine = affine(scale.as_deref(), tie.as_deref(), matrix.as_deref());
        // 2: whole pixel coordinates are pixel centres ("pixel is point").
        tags.model_from_pixel =
            if raster_type == Some(2) { affine.map(Affine::with_centres_at_half) } else { affine };
        if affine.is_none()
            && let Some(points) = tie.as_ref().map(|tie| tie.len() / 6).filter(|points| *points > 1)
        {
            tags.notes.push(format!(
                "{points} ground control points (tag 33922) without a pixel size are not a georeference that is read: warp the file with `gdalwarp -t_srs EPSG:CODE IN OUT`"
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
        if let Some(text) = tiff.text(of, tag::GDAL_NODATA)? {
            let text = text.trim();
            tags.nodata = Some(number(text).ok_or_else(|| {
                format!("its mark of missing values (tag 42113) is `{text}`, which is no number")
            })?);
        }
        if let Some(text) = tiff.text(of, tag::GDAL_METADATA)? {
            match Metadata::of_tag(&text) {
                Ok(metadata) => {
                    tags.bands = metadata.bands;
                    tags.items = metadata.items;
                    tags.descriptions = metadata.descriptions;
                }
                Err(reason) => {
                    return Err(format!(
                        "its GDAL_METADATA (tag 42112) cannot be read, and a scale or a unit may be in it: {reason}"
                    ));
                }
            }
        }
        tags.descriptions.extend(tiff.text(of, tag::IMAGE_DESCRIPTION).ok().flatten());
        tags.orientation =
            tiff.integer(of, tag::ORIENTATION)?.filter(|orientation| !matches!(orientation, 0 | 1));
        if of.has(tag::RPC_COEFFICIENTS) {
            tags.notes.push("its rational camera model (RPC, tag 50844) is not used: a picture that is not orthorectified does not lie where its georeference says".into());
        }
        Ok(tags)
    }

    /// The directory of keys. Gives the raster type.
    fn read_keys(&mut self, tiff: &mut TiffFile, of: &Directory) -> Result<Option<u16>, String> {
        let keys: Vec<u16> = tiff
            .integers(of, tag::GEO_KEY_DIRECTORY)?
            .unwrap_or_default()
            .iter()
            .map(|&key| key as u16)
            .collect();
        let texts = tiff.text(of, tag::GEO_ASCII_PARAMS)?.unwrap_or_default();
        // Entries: key, place (0 = here), count, value.
        let entry = |wanted: u16| {
            keys.get(4..).and_then(|keys| keys.chunks_exact(4).find(|entry| entry[0] == wanted))
        };
        let key = |wanted: u16| {
            entry(wanted).filter(|entry| entry[1] == 0).map(|entry| entry[3]).filter(|&code| code != 0)
        };
        let text = |wanted: u16| {
            let found = entry(wanted).filter(|entry| entry[1] == tag::GEO_ASCII_PARAMS);
            let found = found.and_then(|entry| {
                texts.get(
                    usize::from(entry[3])..(usize::from(entry[3]) + usize::from(entry[2])).min(texts.len()),
                )
            });
            found
                .map(|text| text.trim_end_matches(['|', '\0', ' ']).to_owned())
                .filter(|text| !text.is_empty())
        };
        self.keys = GeoKeys {
            model_type: key(1024),
            projected: key(3072),
            geographic: key(2048),
            projection: key(3074),
            method: key(3075),
            citation: text(3073).or_else(|| text(1026)).or_else(|| text(2049)).unwrap_or_default(),
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

fn affine(scale: Option<&[f64]>, tie: Option<&[f64]>, matrix: Option<&[f64]>) -> Option<Affine> {
    if let Some([a, b, _, c, d, e, _, f, ..]) = matrix {
        return Some(Affine { origin: [*c, *f], column: [*a, *d], row: [*b, *e] });
    }
    let ([sx, sy, ..], [i, j, _, x, y, ..]) = (scale?, tie?) else { return None };
    // Rows go south: the scale is positive by convention.
    Some(Affine { origin: [x - i * sx, y + j * sy], column: [*sx, 0.0], row: [0.0, -sy] })
}
