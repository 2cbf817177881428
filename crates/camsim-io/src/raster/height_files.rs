//! Files of heights: TIFF, ESRI ASCII grids and SRTM tiles.

use std::{io::Read, path::Path};

use super::{
    TerrainFileError,
    decoded::{Raster, is_tiff},
    geo_tags::{GeoKeys, GeoTags},
    georeference::Affine,
    tiff_file::{Image, SampleType},
};
use crate::raster::pictures::PictureError;

/// Formats of heights and their detection.
pub(crate) const FORMATS: &[(&str, &str)] = &[
    ("GeoTIFF, BigTIFF", "by content"),
    (
        "ESRI ASCII grid (`.asc`)",
        "by content: `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yllcorner` or `yllcenter`, `cellsize` \
         (or `dx`, `dy`), `NODATA_value` (else -9999); EPSG code from a `.prj` sidecar file or \
         scene.terrain.epsg",
    ),
    (
        "SRTM tile (`N47E008.hgt`)",
        "by name, which gives its position; 1201 x 1201 or 3601 x 3601 heights above EGM96, EPSG:4326, \
         -32768 missing",
    ),
];

/// No-data value of SRTM tiles.
const SRTM_VOID: f64 = -32768.0;

/// Reads heights in any format.
pub(super) fn read(path: &Path) -> Result<Raster, TerrainFileError> {
    if is_tiff(path).map_err(TerrainFileError::dem)? {
        return Raster::read(path).map_err(TerrainFileError::dem);
    }
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("hgt")) {
        return read_srtm(path);
    }
    let mut start = Vec::new();
    let file = std::fs::File::open(path)
        .map_err(|source| TerrainFileError::dem(PictureError::open(path, source)))?;
    file.take(64)
        .read_to_end(&mut start)
        .map_err(|source| TerrainFileError::dem(PictureError::open(path, source)))?;
    if String::from_utf8_lossy(&start)
        .trim_start_matches('\u{feff}')
        .trim_start()
        .to_lowercase()
        .starts_with("ncols")
    {
        return read_ascii(path);
    }
    let reason = match start[..] {
        [0x1f, 0x8b, ..] | [b'P', b'K', 3, 4, ..] => "is a compressed archive: unpack it",
        _ => {
            "is not a TIFF file, an ESRI ASCII grid (it begins with `ncols`) or an SRTM tile (N47E008.hgt): \
             convert it with `gdal_translate IN OUT.tif`"
        }
    };
    Err(TerrainFileError::dem(PictureError::decode(path, reason)))
}

/// Reads an SRTM tile: 16-bit big-endian heights, named by its south-western corner.
fn read_srtm(path: &Path) -> Result<Raster, TerrainFileError> {
    let error = |problem: String| TerrainFileError::Meaning { path: path.into(), problem };
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
    let [south, west] = corner_from_name(&name).ok_or_else(|| {
        error("an SRTM tile must be named by its south-western corner, for example N47E008.hgt".into())
    })?;
    let bytes =
        std::fs::read(path).map_err(|source| TerrainFileError::dem(PictureError::open(path, source)))?;
    let side = match bytes.len() {
        2_884_802 => 1201,
        25_934_402 => 3601,
        other => {
            return Err(error(format!(
                "an SRTM tile has 1201 x 1201 or 3601 x 3601 heights of two bytes, but this file has {other} \
                 bytes"
            )));
        }
    };
    let data =
        bytes.chunks_exact(2).flat_map(|pair| i16::from_be_bytes([pair[0], pair[1]]).to_ne_bytes()).collect();
    let step = 1.0 / f64::from(side - 1);
    // The outermost heights lie on whole degrees.
    let model_from_pixel = Affine {
        origin: [west - 0.5 * step, south + 1.0 + 0.5 * step],
        column: [step, 0.0],
        row: [0.0, -step],
    };
    let keys = GeoKeys { geographic: Some(4326), vertical: Some(5773), ..GeoKeys::default() };
    let geo = GeoTags {
        model_from_pixel: Some(model_from_pixel),
        keys,
        nodata: Some(SRTM_VOID),
        ..GeoTags::default()
    };
    Ok(Raster::from_image(Image::from_band([side, side], SampleType::I16, data), geo))
}

/// Latitude and longitude of the south-western corner in a name such as `N47E008.hgt`, degrees.
fn corner_from_name(name: &str) -> Option<[f64; 2]> {
    let sign = |index: usize, plus: &str, minus: &str| match name.get(index..=index)? {
        letter if letter == plus => Some(1.0),
        letter if letter == minus => Some(-1.0),
        _ => None,
    };
    let number = |start: usize, end: usize| {
        name.get(start..end).filter(|digits| digits.bytes().all(|b| b.is_ascii_digit()))?.parse::<f64>().ok()
    };
    let (lat, lon) = (sign(0, "N", "S")? * number(1, 3)?, sign(3, "E", "W")? * number(4, 7)?);
    (lat.abs() <= 90.0 && lon.abs() <= 180.0).then_some([lat, lon])
}

/// Header of an ESRI ASCII grid.
#[derive(Default)]
struct AsciiHeader {
    columns: Option<u32>,
    rows: Option<u32>,
    /// x and y of the lower-left pixel, each with whether it is the pixel's centre.
    corner: [Option<(f64, bool)>; 2],
    /// Cell size in x and y.
    cell: [Option<f64>; 2],
    nodata: Option<f64>,
}

/// Reads an ESRI ASCII grid.
fn read_ascii(path: &Path) -> Result<Raster, TerrainFileError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| TerrainFileError::dem(PictureError::open(path, source)))?;
    let error = |problem: String| TerrainFileError::Meaning { path: path.into(), problem };
    let mut header = AsciiHeader::default();
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate().peekable();
    while let Some((index, line)) = lines.next_if(|(_, line)| {
        line.trim_start().is_empty()
            || line.trim_start().starts_with(|c: char| c.is_ascii_alphabetic()) && !is_number(line)
    }) {
        if !line.trim().is_empty() {
            header.parse_line(line).map_err(|problem| error(format!("line {}: {problem}", index + 1)))?;
        }
    }
    let missing = |key: &str| error(format!("its header has no `{key}`"));
    let size =
        [header.columns.ok_or_else(|| missing("ncols"))?, header.rows.ok_or_else(|| missing("nrows"))?];
    let count = u64::from(size[0]) * u64::from(size[1]);
    // A number and its separator take at least two bytes.
    if count > text.len() as u64 {
        return Err(error(format!("{} x {} heights do not fit into {} bytes", size[0], size[1], text.len())));
    }
    let mut data = Vec::with_capacity(8 * count as usize);
    for (index, line) in lines {
        for word in line.split_ascii_whitespace() {
            let value: f64 = word.parse().map_err(|_| {
                let comma = if word.contains(',') { " (decimals need a point)" } else { "" };
                error(format!("line {}: `{word}` is not a number{comma}", index + 1))
            })?;
            data.extend(value.to_ne_bytes());
        }
    }
    if data.len() as u64 != 8 * count {
        return Err(error(format!(
            "has {} heights instead of {} x {} = {count}",
            data.len() / 8,
            size[0],
            size[1]
        )));
    }
    let [Some(dx), Some(dy)] = header.cell else { return Err(missing("cellsize")) };
    let [Some((x, x_is_centre)), Some((y, y_is_centre))] = header.corner else {
        return Err(missing("xllcorner` and `yllcorner"));
    };
    let west = if x_is_centre { x - 0.5 * dx } else { x };
    let south = if y_is_centre { y - 0.5 * dy } else { y };
    let model_from_pixel =
        Affine { origin: [west, south + dy * f64::from(size[1])], column: [dx, 0.0], row: [0.0, -dy] };
    let geo =
        GeoTags { model_from_pixel: Some(model_from_pixel), nodata: header.nodata, ..GeoTags::default() };
    Ok(Raster::from_image(Image::from_band(size, SampleType::F64, data), geo))
}

/// Whether a line begins with a number; `nan` and `inf` are numbers that begin with letters.
fn is_number(line: &str) -> bool {
    line.split_ascii_whitespace().next().is_some_and(|word| word.parse::<f64>().is_ok())
}

impl AsciiHeader {
    fn parse_line(&mut self, line: &str) -> Result<(), String> {
        let mut words = line.split_ascii_whitespace();
        let (Some(key), Some(value), None) = (words.next(), words.next(), words.next()) else {
            return Err(format!("`{}` is not a key with its value", line.trim()));
        };
        let number = || {
            value
                .parse::<f64>()
                .ok()
                .filter(|value| value.is_finite())
                .ok_or_else(|| format!("{key} is `{value}`, which is not a number"))
        };
        let count = || {
            value
                .parse::<u32>()
                .ok()
                .filter(|count| *count > 0)
                .ok_or_else(|| format!("{key} is `{value}`, which is not a positive integer"))
        };
        let step = || {
            number().and_then(|step| {
                if step > 0.0 { Ok(step) } else { Err(format!("{key} is {step}, which is not positive")) }
            })
        };
        match key.to_lowercase().as_str() {
            "ncols" => self.columns = Some(count()?),
            "nrows" => self.rows = Some(count()?),
            "xllcorner" => self.corner[0] = Some((number()?, false)),
            "yllcorner" => self.corner[1] = Some((number()?, false)),
            "xllcenter" | "xllcentre" => self.corner[0] = Some((number()?, true)),
            "yllcenter" | "yllcentre" => self.corner[1] = Some((number()?, true)),
            "cellsize" => self.cell = [Some(step()?); 2],
            "dx" => self.cell[0] = Some(step()?),
            "dy" => self.cell[1] = Some(step()?),
            "nodata_value" => {
                self.nodata =
                    Some(value.parse().map_err(|_| format!("{key} is `{value}`, which is not a number"))?)
            }
            _ => return Err(format!("`{key}` is not a key of an ESRI ASCII grid")),
        }
        Ok(())
    }
}
