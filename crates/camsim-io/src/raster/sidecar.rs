//! Sidecar files of a raster: `.aux.xml`, `.msk`, `.prj` and world files.

use std::path::{Path, PathBuf};

use super::{TerrainFileError, decoded::Raster, geo_tags::GeoTags, metadata::Metadata};

/// Sidecar files: name, content, treatment.
pub(crate) const SIDECARS: &[(&str, &str, &str)] = &[
    (
        "`.tfw`, `.tifw`, `.jgw`, `.pgw`, ..., `.wld`",
        "georeference",
        "applied where the raster has no georeference; reported where they differ from it",
    ),
    (
        "`.aux.xml` (`dem.tif.aux.xml`)",
        "scale, offset, unit, no-data value, georeference, coordinate system",
        "applied where the raster has none; refused where they contradict it",
    ),
    ("`.msk` (`dem.tif.msk`)", "validity mask", "applied"),
    (
        "`.prj` (`dem.prj`)",
        "coordinate system",
        "applied where the raster has none: by its EPSG code, or by ESRI's names of known systems; others \
         are refused. A unit of coordinates that is not the system's is refused; a system that differs from \
         the raster's own is reported",
    ),
    (
        "vertical system in `.prj` or `<SRS>`",
        "unit, datum and axis direction of heights",
        "unit applied, also where the raster or scene.terrain.epsg gives the horizontal system; refused \
         where it contradicts another; a datum that contradicts scene.terrain.height is reported; depths and \
         a vertical shift are refused",
    ),
    (
        "`.prj` of ARC/INFO (`Projection UTM`)",
        "Zunits, Units, Zone, Xshift, Yshift",
        "Zunits applied; refused without scene.terrain.epsg, where Units or Zone contradict it, and with a \
         shift",
    ),
    ("`.ovr`", "overviews", "not needed"),
];

/// A path with a suffix after its extension.
fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

/// Existing sidecar files that are read with a raster.
pub(crate) fn sidecar_files(path: &Path) -> Vec<PathBuf> {
    let candidates = [
        with_suffix(path, ".aux.xml"),
        path.with_extension("aux.xml"),
        with_suffix(path, ".msk"),
        path.with_extension("prj"),
        path.with_extension("PRJ"),
    ];
    super::georeference::world_files(path)
        .chain(candidates.into_iter().filter(|file| file.is_file()))
        .collect()
}

/// Adds the content of `.aux.xml` and `.prj` to a raster's tags.
pub(crate) fn read_sidecar_tags(path: &Path, geo: &mut GeoTags) -> Result<(), TerrainFileError> {
    let aux =
        [with_suffix(path, ".aux.xml"), path.with_extension("aux.xml")].into_iter().find(|aux| aux.is_file());
    if let Some(aux) = aux {
        let error = |problem: String| TerrainFileError::Meaning { path: aux.clone(), problem };
        let text =
            std::fs::read_to_string(&aux).map_err(|source| error(format!("cannot be read: {source}")))?;
        let metadata = Metadata::from_aux_xml(&text)
            .map_err(|reason| error(format!("is not GDAL metadata: {reason}")))?;
        merge(geo, &aux, metadata).map_err(|difference| {
            error(format!("{difference}, which differs from the raster itself: remove one of them"))
        })?;
    }
    let prj =
        ["prj", "PRJ"].map(|extension| path.with_extension(extension)).into_iter().find(|prj| prj.is_file());
    if let Some(prj) = prj {
        let read_error = |error: std::io::Error| TerrainFileError::Meaning {
            path: prj.clone(),
            problem: format!("cannot be read: {error}"),
        };
        // ARC/INFO files can have any encoding.
        let bytes = std::fs::read(&prj).map_err(read_error)?;
        geo.texts.push((prj.clone(), String::from_utf8_lossy(&bytes).into_owned()));
    }
    Ok(())
}

/// Applies the mask in a `.msk` file.
pub(crate) fn read_sidecar_mask(
    path: &Path,
    raster: &mut Raster,
) -> Result<(), crate::raster::pictures::PictureError> {
    let mask = with_suffix(path, ".msk");
    if mask.is_file() { raster.apply_mask_file(&mask) } else { Ok(()) }
}

/// Adds `.aux.xml` to a raster's tags. An error states the value in which they differ.
fn merge(geo: &mut GeoTags, path: &Path, aux: Metadata) -> Result<(), String> {
    fn merge_value<T: PartialEq + std::fmt::Debug + Clone>(
        own: &mut Option<T>,
        other: Option<T>,
        name: &str,
    ) -> Result<(), String> {
        match (&own, other) {
            (Some(own), Some(other)) if *own != other => Err(format!("states {name} = {other:?}")),
            (None, other) => {
                *own = other;
                Ok(())
            }
            _ => Ok(()),
        }
    }
    geo.bands.resize(geo.bands.len().max(aux.bands.len()), Default::default());
    for (band, (own, other)) in geo.bands.iter_mut().zip(aux.bands).enumerate() {
        merge_value(&mut own.scale, other.scale, "Scale")?;
        merge_value(&mut own.offset, other.offset, "Offset")?;
        merge_value(&mut own.unit, other.unit, "UnitType")?;
        // GDAL guesses it; tags take precedence.
        own.color = own.color.take().or(other.color);
        own.description = own.description.take().or(other.description);
        // Heights use the first band alone, and pictures have one no-data value for all bands.
        let is_nan = band > 0 || geo.nodata.is_some_and(f64::is_nan) && other.nodata.is_some_and(f64::is_nan);
        if !is_nan {
            merge_value(&mut geo.nodata, other.nodata, "NoDataValue")?;
        }
    }
    merge_value(&mut geo.model_from_pixel, aux.model_from_pixel, "GeoTransform")?;
    geo.texts.extend(aux.wkt.map(|text| (path.into(), text)));
    geo.items.extend(aux.items);
    geo.descriptions.extend(aux.descriptions);
    Ok(())
}
