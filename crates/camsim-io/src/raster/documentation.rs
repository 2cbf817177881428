//! `docs/reference/inputs/TERRAIN.md`, made from the readers' tables.

use std::{collections::BTreeMap, fmt::Write};

use super::{
    bands::PHOTOMETRICS,
    crs::SYSTEMS,
    geo_tags::GEO_KEYS,
    height_files::FORMATS,
    metadata::ITEMS,
    sidecar::SIDECARS,
    tiff_file::{COMPRESSIONS, REFUSED},
};

/// TIFF tags with their treatment, without those in the other tables.
const TAGS: &[(&str, &str, &str)] = &[
    (
        "254 NewSubfileType",
        "overview, mask",
        "overviews are skipped; masks are applied (0 = no data); of several pictures the first is used, and \
         that is reported",
    ),
    (
        "258, 339 bits and format",
        "1 to 16, 32, 64 bits unsigned; 8 to 64 bits signed; floats of 16, 32, 64 bits",
        "applied; complex numbers and others are refused. Bands that differ are refused",
    ),
    ("266 FillOrder", "lowest bit first", "refused below 8 bits"),
    (
        "273, 279, 324, 325 blocks",
        "offset or length 0: a sparse block",
        "void (heights), transparent (colours)",
    ),
    (
        "274 Orientation, EXIF",
        "orientation of the picture",
        "applied to pictures without a georeference; reported for others and for heights",
    ),
    ("284 PlanarConfiguration", "planar bands", "applied, strips and tiles"),
    ("317 Predictor", "1, 2, 3", "applied"),
    ("320 ColorMap", "palette", "applied"),
    (
        "338 ExtraSamples",
        "alpha, premultiplied alpha, others",
        "applied (0 = no data; premultiplied colours are divided by alpha); other bands are reported",
    ),
    (
        "33550, 33922, 34264 georeference",
        "pixel size and tie point, or a matrix",
        "applied, also rotated or with rows from the south; control points alone are refused, with the \
         command that warps",
    ),
    (
        "33550, 33922 third values",
        "scale and offset of heights",
        "applied with a vertical system (4096), else reported",
    ),
    ("42112 GDAL_METADATA", "see below", "see below"),
    (
        "42113 GDAL_NODATA",
        "no-data value, before the scale",
        "applied; a text that is not a number is refused. Default: -9999, and -32768 for 16 bits",
    ),
    ("50844 RPC", "camera model of a picture that is not orthorectified", "reported"),
];

/// Keys of scene.terrain with their effect.
const KEYS: &[(&str, &str)] = &[
    (
        "dem, ortho",
        "a file, or several that are tiles of one grid: a list of paths, a folder, or a path with `*` and `?` (of folders \
         and patterns those that end in tif, tiff, hgt, asc, and for ortho also png, jpg, jpeg, webp). Tiles need one \
         coordinate system, pixel size and grid (to 0.02 pixels), and heights of one unit and datum; else the command \
         that joins them is given. They may overlap: the more northern, then the more western tile counts, and \
         differences above 1 cm are reported. Holes between them have no heights (no colour), which is reported",
    ),
    (
        "height",
        "`\"ellipsoid\"` or `\"msl\"`: the datum of the heights. A vertical system of the file that \
         contradicts it is reported",
    ),
    (
        "height_unit",
        "`\"m\"`, `\"ft\"`, `\"us-ft\"`, `\"dm\"`, `\"cm\"`, `\"mm\"`: needed where the file states two units or an unknown one, or has \
         coordinates in feet and no unit of heights",
    ),
    ("epsg", "the coordinate system of a DEM that states none"),
    (
        "ortho_white",
        "the stored value of white: for pictures that use fewer than their 16 bits, which are reported",
    ),
    (
        "beyond",
        "`\"grey\"` (sRGB 118), `\"edge\"` (colours of the picture's border), `\"void\"` (no ground, in \
         whole cells): the ground outside of the ortho-image, where it is masked, or where it has its \
         no-data value. The fraction of the terrain and of the frames is reported",
    ),
];

/// Contents of `docs/reference/inputs/TERRAIN.md`.
#[must_use]
pub fn documentation() -> String {
    let mut page = String::from(
        "# Terrain files\n\nMade from the tables of the reader (`CAMSIM_BLESS=1 cargo test -p camsim-io \
         --test field_terrain`). What changes heights or colours is *applied*, *refused* with a remedy, or \
         *reported* in a warning.\n",
    );
    let mut table = |title: &str, columns: &[&str], rows: Vec<Vec<String>>| {
        let _ =
            write!(page, "\n## {title}\n\n| {} |\n|{}\n", columns.join(" | "), "---|".repeat(columns.len()));
        for row in rows {
            let _ = writeln!(page, "| {} |", row.join(" | "));
        }
    };
    let two = |rows: &[(&str, &str)]| {
        rows.iter().map(|(a, b)| vec![(*a).to_owned(), (*b).to_owned()]).collect::<Vec<_>>()
    };
    let three = |rows: &[(&str, &str, &str)]| {
        rows.iter()
            .map(|(a, b, c)| vec![(*a).to_owned(), (*b).to_owned(), (*c).to_owned()])
            .collect::<Vec<_>>()
    };
    table("Heights", &["format", "detected by"], two(FORMATS));
    table("Keys of `scene.terrain`", &["key", "effect"], two(KEYS));
    table("TIFF tags", &["tag", "content", "treatment"], three(TAGS));
    let compressions =
        COMPRESSIONS.iter().map(|(code, name)| vec![code.to_string(), (*name).to_owned(), "read".to_owned()]);
    let refused = REFUSED.iter().map(|(code, name)| {
        vec![
            code.to_string(),
            (*name).to_owned(),
            "refused, with the `gdal_translate` command for the file".to_owned(),
        ]
    });
    table("Compression (tag 259)", &["code", "name", "treatment"], compressions.chain(refused).collect());
    let photometrics = PHOTOMETRICS
        .iter()
        .map(|(code, name, what)| vec![code.to_string(), (*name).to_owned(), (*what).to_owned()]);
    table("Colours (tag 262)", &["code", "name", "treatment"], photometrics.collect());
    table("GeoKeys (tag 34735)", &["key", "content", "treatment"], three(GEO_KEYS));
    table("GDAL_METADATA (tag 42112) and `.aux.xml`", &["item", "treatment"], two(ITEMS));
    table("Sidecar files", &["file", "content", "treatment"], three(SIDECARS));
    page.push_str(
        "\n## Coordinate systems\n\nBy EPSG code. Datums within a metre or two of WGS-84 (ETRS89, NAD83, \
         GDA94 and similar) are taken as WGS-84; older ones are shifted, and a shift with an accuracy of 2 m \
         or worse is reported. Every system agrees with PROJ to 2 mm.\n\n| datum | codes |\n|---|---|\n| WGS \
         84, by rule | 3857, 32601-32660, 32701-32760 |\n",
    );
    for (datum, codes) in systems_by_datum() {
        let _ = writeln!(page, "| {datum} | {} |", ranges(&codes));
    }
    let count = |kind: &str| SYSTEMS.lines().filter(|line| line.starts_with(kind)).count();
    let _ = write!(
        page,
        "\n{} vertical systems of the EPSG registry are known by unit and axis direction (depths are \
         refused), and {} compound systems.\n",
        count("vertical;"),
        count("compound;")
    );
    page
}

/// Codes of the horizontal systems by the datum in their names.
fn systems_by_datum() -> BTreeMap<String, Vec<u16>> {
    let mut codes: BTreeMap<String, Vec<u16>> = BTreeMap::new();
    for line in SYSTEMS.lines() {
        let words: Vec<&str> = line.split(';').collect();
        let [kind @ ("projected" | "geographic"), code, name, _, accuracy] = words[..] else { continue };
        let datum = name.split(" / ").next().unwrap_or(name);
        let shift =
            if accuracy.is_empty() { String::new() } else { format!(", shift accurate to {accuracy} m") };
        let kind = if kind == "geographic" { ", degrees" } else { "" };
        codes.entry(format!("{datum}{kind}{shift}")).or_default().extend(code.parse::<u16>());
    }
    codes
}

/// Codes as ranges: `1-3, 7`.
fn ranges(codes: &[u16]) -> String {
    let mut sorted = codes.to_vec();
    sorted.sort_unstable();
    let runs = sorted.chunk_by(|a, b| a + 1 == *b);
    let text = |run: &[u16]| match run {
        [first, .., last] => format!("{first}-{last}"),
        [only] => only.to_string(),
        [] => String::new(),
    };
    runs.map(text).collect::<Vec<_>>().join(", ")
}
