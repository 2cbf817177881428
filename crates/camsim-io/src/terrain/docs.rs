//! What is read of terrain files, as a page of documentation, out of the tables that the readers have.

use std::{collections::BTreeMap, fmt::Write};

use super::{
    bands::PHOTOMETRICS,
    beside::FILES,
    crs::SYSTEMS,
    geo_tags::GEO_KEYS,
    height_files::FORMATS,
    metadata::ITEMS,
    tiff_file::{COMPRESSIONS, REFUSED},
};

/// Tags and what becomes of them, beside those of compression and of place.
const TAGS: &[(&str, &str, &str)] = &[
    (
        "254 NewSubfileType",
        "smaller version, mask",
        "smaller versions are passed over; masks are applied (0 = nothing there); of several pictures the first is used, and it is said",
    ),
    (
        "258, 339 bits and format",
        "1 to 16, 32, 64 bits unsigned; 8 to 64 bits signed; floats of 16, 32, 64 bits",
        "applied; complex numbers and others are refused. Bands that differ are refused",
    ),
    ("266 FillOrder", "bits from the lowest on", "refused below 8 bits"),
    (
        "273, 279, 324, 325 blocks",
        "offset or length 0: the block is left out",
        "void (heights), without picture (colours)",
    ),
    (
        "274 Orientation, EXIF",
        "which way is up",
        "applied to pictures without a georeference; named for those with one and for heights",
    ),
    ("284 PlanarConfiguration", "bands one after the other", "applied, strips and tiles"),
    ("317 Predictor", "1, 2, 3", "applied"),
    ("320 ColorMap", "palette", "applied"),
    (
        "338 ExtraSamples",
        "alpha, premultiplied alpha, others",
        "applied (0 = nothing there; colours are divided by premultiplied alpha); other bands are named",
    ),
    (
        "33550, 33922, 34264 place",
        "pixel size and tie point, or a matrix",
        "applied, rotated and from the south too; control points alone are refused with the command that warps",
    ),
    (
        "33550, 33922 third numbers",
        "scale and offset of heights",
        "applied with a vertical system (4096), else named",
    ),
    ("42112 GDAL_METADATA", "see below", "see below"),
    (
        "42113 GDAL_NODATA",
        "mark of what is missing, before the scale",
        "applied; a text that is no number is refused. Without it: -9999, and -32768 of 16 bits",
    ),
    ("50844 RPC", "camera model of a picture that is not orthorectified", "named"),
];

/// Keys and what they decide.
const KEYS: &[(&str, &str)] = &[
    (
        "height",
        "`\"ellipsoid\"` or `\"msl\"`: the datum of the heights. A vertical system of the file that contradicts it warns",
    ),
    (
        "height_unit",
        "`\"m\"`, `\"ft\"`, `\"us-ft\"`: needed where the file says two units, one that is not known, or maps in feet without a word on heights",
    ),
    ("epsg", "the coordinate system of the DEM, where it states none"),
    (
        "ortho_white",
        "the stored number that is white: for pictures of 16 bits that use fewer, which are named",
    ),
    (
        "beyond",
        "`\"grey\"` (sRGB 118), `\"edge\"` (the colours of the picture's border), `\"void\"` (no ground, to the last whole cell): what is seen where the ortho-image has nothing, \
      beyond it, by its masks, or by its mark. The share of the terrain and of the frames is said",
    ),
];

/// The page.
#[must_use]
pub fn documentation() -> String {
    let mut page = String::from(
        "# Terrain files\n\nMade from the tables of the reader (`CAMSIM_BLESS=1 cargo test -p camsim-io --test field_terrain`). What changes the numbers is *applied*, *refused* with what mends it, \
         or *named* in a warning.\n",
    );
    let mut table = |title: &str, head: &[&str], rows: Vec<Vec<String>>| {
        let _ = write!(page, "\n## {title}\n\n| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
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
    table("Heights", &["format", "told by"], two(FORMATS));
    table("Keys of `scene.terrain`", &["key", "what it decides"], two(KEYS));
    table("TIFF tags", &["tag", "what it is", "what becomes of it"], three(TAGS));
    let compressions =
        COMPRESSIONS.iter().map(|(code, name)| vec![code.to_string(), (*name).to_owned(), "read".to_owned()]);
    let refused = REFUSED.iter().map(|(code, name)| {
        vec![
            code.to_string(),
            (*name).to_owned(),
            "refused, with the `gdal_translate` line for the file".to_owned(),
        ]
    });
    table(
        "Compression (tag 259)",
        &["code", "name", "what becomes of it"],
        compressions.chain(refused).collect(),
    );
    let photometrics = PHOTOMETRICS
        .iter()
        .map(|(code, name, what)| vec![code.to_string(), (*name).to_owned(), (*what).to_owned()]);
    table("Colours (tag 262)", &["code", "name", "what becomes of it"], photometrics.collect());
    table("GeoKeys (tag 34735)", &["key", "what it is", "what becomes of it"], three(GEO_KEYS));
    table("GDAL_METADATA (tag 42112) and `.aux.xml`", &["item", "what becomes of it"], two(ITEMS));
    table("Files beside a raster", &["file", "what it says", "what becomes of it"], three(FILES));
    page.push_str(
        "\n## Coordinate systems\n\nBy EPSG code. WGS-84's datum and those within a metre or two of it (ETRS89, NAD83, GDA94 and the like) are taken for one; older ones are shifted, and a shift that may be \
         off by 2 m or more is named. Every system is tested against PROJ to 2 mm of the same definition.\n\n| datum | codes |\n|---|---|\n| WGS 84, by rule | 3857, 32601-32660, 32701-32760 |\n",
    );
    for (datum, codes) in systems() {
        let _ = writeln!(page, "| {datum} | {} |", ranges(&codes));
    }
    let count = |kind: &str| SYSTEMS.lines().filter(|line| line.starts_with(kind)).count();
    let _ = write!(
        page,
        "\n{} vertical systems of the EPSG registry are known by unit and direction (depths are refused), and {} codes that stand for a horizontal and a vertical system together.\n",
        count("vertical;"),
        count("compound;")
    );
    page
}

/// Codes by the datum in their names.
fn systems() -> BTreeMap<String, Vec<u16>> {
    let mut all: BTreeMap<String, Vec<u16>> = BTreeMap::new();
    for line in SYSTEMS.lines() {
        let words: Vec<&str> = line.split(';').collect();
        let [kind @ ("projected" | "geographic"), code, name, _, accuracy] = words[..] else { continue };
        let datum = name.split(" / ").next().unwrap_or(name);
        let shift = if accuracy.is_empty() { String::new() } else { format!(", shift good to {accuracy} m") };
        let kind = if kind == "geographic" { ", degrees" } else { "" };
        all.entry(format!("{datum}{kind}{shift}")).or_default().extend(code.parse::<u16>());
    }
    all
}

/// `1-3, 7`.
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
