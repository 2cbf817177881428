//! Files beside a raster that change what it means: `.aux.xml`, `.msk`, `.prj`.

use std::path::{Path, PathBuf};

use super::{TerrainFileError, geo_tags::GeoTags, metadata::Metadata, raster::Raster};

/// Files beside a raster and what becomes of them.
pub(crate) const FILES: &[(&str, &str, &str)] = &[
    (
        "`.tfw`, `.tifw`, `.jgw`, `.pgw`, ..., `.wld`",
        "place of the pixels",
        "applied where the raster says nothing; named where it says another place",
    ),
    (
        "`.aux.xml` (`dem.tif.aux.xml`)",
        "scale, offset, unit, missing values, place, coordinate system",
        "applied where the raster says nothing; refused where they contradict it",
    ),
    ("`.msk` (`dem.tif.msk`)", "where there is nothing", "applied"),
    (
        "`.prj` (`dem.prj`)",
        "coordinate system",
        "applied where the raster says nothing: by its EPSG code, or by the names that ESRI gives to known systems; others are refused. A unit of coordinates that is not that \
         of the system is refused, another system than the raster's own is named",
    ),
    (
        "vertical system in `.prj` or `<SRS>`",
        "unit, datum and direction of heights",
        "unit applied, also where the raster or scene.terrain.epsg gives the horizontal system; refused where it contradicts another; a datum that contradicts \
         scene.terrain.height warns; depths and a shift are refused",
    ),
    (
        "`.prj` of ARC/INFO (`Projection UTM`)",
        "Zunits, Units, Zone, Xshift, Yshift",
        "Zunits applied; refused without scene.terrain.epsg, and where Units or Zone are not its own or where there is a shift",
    ),
    ("`.ovr`", "smaller versions", "changes no number"),
];

/// `name.ext` with more behind it.
fn with_more(path: &Path, more: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(more);
    name.into()
}

/// All files beside a raster that are read with it.
pub(crate) fn files(path: &Path) -> Vec<PathBuf> {
    let beside = [
        with_more(path, ".aux.xml"),
        path.with_extension("aux.xml"),
        with_more(path, ".msk"),
        path.with_extension("prj"),
        path.with_extension("PRJ"),
    ];
    super::georeference::world_files(path).chain(beside.into_iter().filter(|file| file.is_file())).collect()
}

/// What `.aux.xml` and `.prj` add to tags.
pub(crate) fn read_tags(path: &Path, geo: &mut GeoTags) -> Result<(), TerrainFileError> {
    let aux =
        [with_more(path, ".aux.xml"), path.with_extension("aux.xml")].into_iter().find(|aux| aux.is_file());
    if let Some(aux) = aux {
        let wrong = |problem: String| TerrainFileError::Meaning { path: aux.clone(), problem };
        let text =
            std::fs::read_to_string(&aux).map_err(|error| wrong(format!("cannot be read: {error}")))?;
        let metadata =
            Metadata::of_aux(&text).map_err(|reason| wrong(format!("is no GDAL metadata: {reason}")))?;
        merge(geo, &aux, metadata).map_err(|what| {
            wrong(format!("{what}, and the raster itself says another: remove one of them"))
        })?;
    }
    let prj =
        ["prj", "PRJ"].map(|extension| path.with_extension(extension)).into_iter().find(|prj| prj.is_file());
    if let Some(prj) = prj {
        let wrong = |error: std::io::Error| TerrainFileError::Meaning {
            path: prj.clone(),
            problem: format!("cannot be read: {error}"),
        };
        // What ARC/INFO wrote may be in any encoding.
        let bytes = std::fs::read(&prj).map_err(wrong)?;
        geo.texts.push((prj.clone(), String::from_utf8_lossy(&bytes).into_owned()));
    }
    Ok(())
}

/// What a mask beside a raster leaves out.
pub(crate) fn read_mask(path: &Path, raster: &mut Raster) -> Result<(), crate::pictures::PictureError> {
    let mask = with_more(path, ".msk");
    if mask.is_file() { raster.leave_out_by(&mask) } else { Ok(()) }
}

/// An error is what they disagree in.
fn merge(geo: &mut GeoTags, path: &Path, aux: Metadata) -> Result<(), String> {
    fn one<T: PartialEq + std::fmt::Debug + Clone>(
        own: &mut Option<T>,
        other: Option<T>,
        what: &str,
    ) -> Result<(), String> {
        match (&own, other) {
            (Some(own), Some(other)) if *own != other => Err(format!("states {what} = {other:?}")),
            (None, other) => {
                *own = other;
                Ok(())
            }
            _ => Ok(()),
        }
    }
    geo.bands.resize(geo.bands.len().max(aux.bands.len()), Default::default());
    for (band, (own, other)) in geo.bands.iter_mut().zip(aux.bands).enumerate() {
        one(&mut own.scale, other.scale, "Scale")?;
        one(&mut own.offset, other.offset, "Offset")?;
        one(&mut own.unit, other.unit, "UnitType")?;
        // A guess by GDAL, where tags say it.
        own.color = own.color.take().or(other.color);
        // Missing values of further bands are no business of heights, and pictures have one mark for all.
        let is_nan = band > 0 || geo.nodata.is_some_and(f64::is_nan) && other.nodata.is_some_and(f64::is_nan);
        if !is_nan {
            one(&mut geo.nodata, other.nodata, "NoDataValue")?;
        }
    }
    one(&mut geo.model_from_pixel, aux.model_from_pixel, "GeoTransform")?;
    geo.texts.extend(aux.wkt.map(|text| (path.into(), text)));
    geo.items.extend(aux.items);
    geo.descriptions.extend(aux.descriptions);
    Ok(())
}
