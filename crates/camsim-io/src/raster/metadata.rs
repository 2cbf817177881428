//! GDAL's XML metadata: the tag GDAL_METADATA and `.aux.xml` files.

use roxmltree::{Document, Node};

use super::{geo_tags::number, georeference::Affine};

/// Meaning of a band's values.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BandMeaning {
    pub scale: Option<f64>,
    pub offset: Option<f64>,
    pub unit: Option<String>,
    /// Colour interpretation: "Red", "Green", "Blue", "Alpha", "Gray", "Palette" and others.
    pub color: Option<String>,
    /// What it is, in words.
    pub description: Option<String>,
    /// No-data value; only in `.aux.xml`.
    pub nodata: Option<f64>,
}

/// Metadata of a raster.
#[derive(Clone, Debug, Default)]
pub(crate) struct Metadata {
    pub bands: Vec<BandMeaning>,
    /// Georeference.
    pub model_from_pixel: Option<Affine>,
    /// Coordinate system, as well-known text.
    pub wkt: Option<String>,
    /// Items without a defined role of the file or its first band: name and value.
    pub items: Vec<(String, String)>,
    /// Descriptions of the first band.
    pub descriptions: Vec<String>,
}

/// Items and elements with their treatment.
pub(crate) const ITEMS: &[(&str, &str)] = &[
    (
        "`SCALE`, `OFFSET` of a band (`<Scale>`, `<Offset>`)",
        "applied to heights: `scale x stored + offset`; reported for pictures",
    ),
    (
        "`UNITTYPE` of a band (`<UnitType>`)",
        "applied to heights: metre, foot, US survey foot, and cm, mm, km; others are refused",
    ),
    ("`COLORINTERP` of a band (`<ColorInterp>`)", "applied: bands of red, green, blue, grey, alpha"),
    (
        "`DESCRIPTION` of a picture's bands (`<Description>`)",
        "applied where it names red, green and blue (`Blue`, `B`, `Band 1: Blue`, `sr_blue`), or alpha, and \
         `COLORINTERP` does not; reported where the order is another than red, green, blue, or the colours are not known by them",
    ),
    ("`<NoDataValue>`", "applied, before the scale"),
    ("`<GeoTransform>`, `<SRS>`", "applied where the raster itself has none"),
    (
        "`units` (also `zunits`, `vertical_units` and the like, `Band1#units`) of the file or its first band",
        "applied to heights, and reported unless metre; reported if unknown; refused where it contradicts \
         another",
    ),
    (
        "`scale_factor`, `add_offset` of the file or its first band (names of netCDF)",
        "reported for heights, with the command that applies them, unless `SCALE` and `OFFSET` are equal: \
         some programs keep them after applying them",
    ),
    (
        "`DESCRIPTION` of the first band, `ImageDescription` (tag 270), `long_name`, `positive`",
        "reported for heights where they mention feet that are not applied, or depths",
    ),
    ("statistics, histograms and items of other names", "not used"),
];

impl Metadata {
    /// Parses tag 42112.
    pub fn from_tag(text: &str) -> Result<Self, String> {
        let mut metadata = Self::default();
        let document =
            Document::parse(text.trim_end_matches('\0').trim()).map_err(|error| error.to_string())?;
        for item in document.descendants().filter(|node| node.has_tag_name("Item")) {
            // Items of other metadata domains are ignored.
            if item.attribute("domain").is_some_and(|domain| !domain.is_empty()) {
                continue;
            }
            let text = item.text().unwrap_or_default().trim();
            let role = item.attribute("role").unwrap_or_default();
            let Some(sample) = item.attribute("sample") else {
                metadata.items.push((item.attribute("name").unwrap_or_default().to_owned(), text.to_owned()));
                continue;
            };
            let sample: usize = sample.parse().map_err(|_| format!("an item is of sample `{sample}`"))?;
            match role {
                "scale" => metadata.band(sample)?.scale = Some(finite("scale", text)?),
                "offset" => metadata.band(sample)?.offset = Some(finite("offset", text)?),
                "unittype" => {
                    metadata.band(sample)?.unit = Some(text.to_owned()).filter(|text| !text.is_empty())
                }
                "colorinterp" => metadata.band(sample)?.color = Some(text.to_owned()),
                "description" => {
                    metadata.band(sample)?.description =
                        Some(text.to_owned()).filter(|text| !text.is_empty());
                    if sample == 0 {
                        metadata.descriptions.push(text.to_owned());
                    }
                }
                "" if sample == 0 => metadata
                    .items
                    .push((item.attribute("name").unwrap_or_default().to_owned(), text.to_owned())),
                _ => {}
            }
        }
        Ok(metadata)
    }

    /// Parses an `.aux.xml` file.
    pub fn from_aux_xml(text: &str) -> Result<Self, String> {
        let mut metadata = Self::default();
        let document =
            Document::parse(text.trim_start_matches('\u{feff}')).map_err(|error| error.to_string())?;
        let child_text = |node: Node<'_, '_>, name: &str| {
            node.children()
                .find(|child| child.has_tag_name(name))
                .and_then(|child| child.text().map(|t| t.trim().to_owned()))
        };
        let root = document.root_element();
        metadata.wkt = child_text(root, "SRS").filter(|text| !text.is_empty());
        metadata.items = default_domain_items(root);
        if let Some(text) = child_text(root, "GeoTransform") {
            let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
            let Some([x, a, b, y, d, e]) = numbers.as_deref() else {
                return Err(format!("GeoTransform is `{text}`, not a list of six numbers"));
            };
            metadata.model_from_pixel = Some(Affine { origin: [*x, *y], column: [*a, *d], row: [*b, *e] });
        }
        for band in root.children().filter(|node| node.has_tag_name("PAMRasterBand")) {
            let index: usize = band
                .attribute("band")
                .and_then(|text| text.parse().ok())
                .filter(|index| *index > 0)
                .ok_or("a PAMRasterBand without a number")?;
            if index == 1 {
                metadata.items.extend(default_domain_items(band));
                metadata.descriptions.extend(child_text(band, "Description"));
            }
            let real = |name: &str| {
                child_text(band, name)
                    .filter(|text| !text.is_empty())
                    .map(|text| finite(name, &text))
                    .transpose()
            };
            let (scale, offset) = (real("Scale")?, real("Offset")?);
            let nodata = child_text(band, "NoDataValue")
                .map(|text| number(&text).ok_or_else(|| format!("NoDataValue is `{text}`")))
                .transpose()?;
            *metadata.band(index - 1)? = BandMeaning {
                scale,
                offset,
                nodata,
                unit: child_text(band, "UnitType").filter(|text| !text.is_empty()),
                color: child_text(band, "ColorInterp"),
                description: child_text(band, "Description").filter(|text| !text.is_empty()),
            };
        }
        Ok(metadata)
    }

    /// The band of an index, added if absent.
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

/// Items of the default metadata domain.
fn default_domain_items(parent: Node<'_, '_>) -> Vec<(String, String)> {
    let is_default_domain = |node: &Node<'_, '_>| {
        node.has_tag_name("Metadata") && node.attribute("domain").is_none_or(str::is_empty)
    };
    let items = parent
        .children()
        .filter(is_default_domain)
        .flat_map(|metadata| metadata.children().filter(|node| node.has_tag_name("MDI")));
    items
        .filter_map(|item| {
            Some((item.attribute("key")?.to_owned(), item.text().unwrap_or_default().trim().to_owned()))
        })
        .collect()
}

fn finite(name: &str, text: &str) -> Result<f64, String> {
    number(text)
        .filter(|value| value.is_finite())
        .ok_or_else(|| format!("{name} is `{text}`, which is not a finite number"))
}
