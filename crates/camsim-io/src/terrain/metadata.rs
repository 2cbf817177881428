//! What GDAL keeps in XML: the tag GDAL_METADATA, and `.aux.xml` files beside a raster.

use roxmltree::{Document, Node};

use super::{geo_tags::number, georeference::Affine};

/// What the numbers of a band mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BandMeaning {
    pub scale: Option<f64>,
    pub offset: Option<f64>,
    pub unit: Option<String>,
    /// "Red", "Green", "Blue", "Alpha", "Gray", "Palette" and others.
    pub color: Option<String>,
    /// Only in `.aux.xml`.
    pub nodata: Option<f64>,
}

/// What there is to read.
#[derive(Clone, Debug, Default)]
pub(crate) struct Metadata {
    pub bands: Vec<BandMeaning>,
    pub model_from_pixel: Option<Affine>,
    /// Coordinate system, as well-known text.
    pub wkt: Option<String>,
    /// Items without a role, of the file or its first band: name and value.
    pub items: Vec<(String, String)>,
    /// What the first band is called.
    pub descriptions: Vec<String>,
}

/// Items and elements and what becomes of them.
pub(crate) const ITEMS: &[(&str, &str)] = &[
    (
        "`SCALE`, `OFFSET` of a band (`<Scale>`, `<Offset>`)",
        "applied to heights: `scale x stored + offset`; named for pictures",
    ),
    (
        "`UNITTYPE` of a band (`<UnitType>`)",
        "applied to heights: metre, foot, US survey foot, and cm, mm, km; others are refused",
    ),
    ("`COLORINTERP` of a band (`<ColorInterp>`)", "applied: which bands are red, green, blue, grey, alpha"),
    ("`<NoDataValue>`", "applied, before the scale"),
    ("`<GeoTransform>`, `<SRS>`", "applied where the raster itself has none"),
    (
        "`units` (also `zunits`, `vertical_units` and the like, `Band1#units`) of the file or its first band",
        "applied to heights and named if it is no metre; named if it is not known; refused where it contradicts another",
    ),
    (
        "`scale_factor`, `add_offset` of the file or its first band (names of netCDF)",
        "named for heights, with the command that applies them, unless `SCALE` and `OFFSET` say the same: some programs leave them behind when they have applied them",
    ),
    (
        "`DESCRIPTION` of the first band, `ImageDescription` (tag 270), `long_name`, `positive`",
        "named for heights where they speak of feet that are not applied, or of depths",
    ),
    ("statistics, histograms and items of other names", "not used"),
];

impl Metadata {
    /// The text of tag 42112.
    pub fn of_tag(text: &str) -> Result<Self, String> {
        let mut found = Self::default();
        let document =
            Document::parse(text.trim_end_matches('\0').trim()).map_err(|error| error.to_string())?;
        for item in document.descendants().filter(|node| node.has_tag_name("Item")) {
            // An item of a band in a domain of its own is none of these.
            if item.attribute("domain").is_some_and(|domain| !domain.is_empty()) {
                continue;
            }
            let text = item.text().unwrap_or_default().trim();
            let role = item.attribute("role").unwrap_or_default();
            let Some(sample) = item.attribute("sample") else {
                found.items.push((item.attribute("name").unwrap_or_default().to_owned(), text.to_owned()));
                continue;
            };
            let sample: usize = sample.parse().map_err(|_| format!("an item is of sample `{sample}`"))?;
            match role {
                "scale" => found.band(sample)?.scale = Some(finite("scale", text)?),
                "offset" => found.band(sample)?.offset = Some(finite("offset", text)?),
                "unittype" => {
                    found.band(sample)?.unit = Some(text.to_owned()).filter(|text| !text.is_empty())
                }
                "colorinterp" => found.band(sample)?.color = Some(text.to_owned()),
                "description" if sample == 0 => found.descriptions.push(text.to_owned()),
                "" if sample == 0 => {
                    found.items.push((item.attribute("name").unwrap_or_default().to_owned(), text.to_owned()))
                }
                _ => {}
            }
        }
        Ok(found)
    }

    /// The text of an `.aux.xml` file.
    pub fn of_aux(text: &str) -> Result<Self, String> {
        let mut found = Self::default();
        let document =
            Document::parse(text.trim_start_matches('\u{feff}')).map_err(|error| error.to_string())?;
        let inside = |node: Node<'_, '_>, name: &str| {
            node.children()
                .find(|child| child.has_tag_name(name))
                .and_then(|child| child.text().map(|t| t.trim().to_owned()))
        };
        let root = document.root_element();
        found.wkt = inside(root, "SRS").filter(|text| !text.is_empty());
        found.items = items_of_aux(root);
        if let Some(text) = inside(root, "GeoTransform") {
            let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
            let Some([x, a, b, y, d, e]) = numbers.as_deref() else {
                return Err(format!("GeoTransform is `{text}`, and no list of six numbers"));
            };
            found.model_from_pixel = Some(Affine { origin: [*x, *y], column: [*a, *d], row: [*b, *e] });
        }
        for band in root.children().filter(|node| node.has_tag_name("PAMRasterBand")) {
            let index: usize = band
                .attribute("band")
                .and_then(|text| text.parse().ok())
                .filter(|index| *index > 0)
                .ok_or("a PAMRasterBand without a number")?;
            if index == 1 {
                found.items.extend(items_of_aux(band));
                found.descriptions.extend(inside(band, "Description"));
            }
            let real = |name: &str| {
                inside(band, name).filter(|text| !text.is_empty()).map(|text| finite(name, &text)).transpose()
            };
            let (scale, offset) = (real("Scale")?, real("Offset")?);
            let nodata = inside(band, "NoDataValue")
                .map(|text| number(&text).ok_or_else(|| format!("NoDataValue is `{text}`")))
                .transpose()?;
            *found.band(index - 1)? = BandMeaning {
                scale,
                offset,
                nodata,
                unit: inside(band, "UnitType").filter(|text| !text.is_empty()),
                color: inside(band, "ColorInterp"),
            };
        }
        Ok(found)
    }

    fn band(&mut self, index: usize) -> Result<&mut BandMeaning, String> {
        if index >= 1 << 16 {
            return Err(format!("an item is of sample `{index}`"));
        }
        if self.bands.len() <= index {
            self.bands.resize(index + 1, BandMeaning::default());
        }
        self.bands.get_mut(index).ok_or_else(String::new)
    }
}

/// Those of the domain without a name.
fn items_of_aux(parent: Node<'_, '_>) -> Vec<(String, String)> {
    let of_no_domain = |node: &Node<'_, '_>| {
        node.has_tag_name("Metadata") && node.attribute("domain").is_none_or(str::is_empty)
    };
    let items = parent
        .children()
        .filter(of_no_domain)
        .flat_map(|metadata| metadata.children().filter(|node| node.has_tag_name("MDI")));
    items
        .filter_map(|item| {
            Some((item.attribute("key")?.to_owned(), item.text().unwrap_or_default().trim().to_owned()))
        })
        .collect()
}

fn finite(what: &str, text: &str) -> Result<f64, String> {
    number(text)
        .filter(|value| value.is_finite())
        .ok_or_else(|| format!("{what} is `{text}`, which is no number"))
}
