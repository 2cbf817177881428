//! ESRI ASCII grids, SRTM tiles, and sidecar files.

use std::{fs, path::Path};

use camsim_core::scenario::{HeightReference, TerrainSpec};

use super::{gdal_file, height_m, raster::Tiff, read, read_error, spec};

const HEADER: &str = "ncols 4\nnrows 3\nxllcorner 500000\nyllcorner 5200000\ncellsize 10\nNODATA_value -99\n";
const VALUES: &str = "1 2 3 4\n5 6.5 7 8\n9 10 11 -99\n";
const UTM_PRJ: &str = concat!(
    r#"PROJCS["WGS_1984_UTM_Zone_32N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984","#,
    r#"SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],"#,
    r#"UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],UNIT["Meter",1.0]]"#
);

fn grid(folder: &Path, text: &str) -> TerrainSpec {
    let path = folder.join("dem.asc");
    fs::write(&path, text).unwrap();
    TerrainSpec { epsg: Some(32632), ..spec(&path) }
}

#[test]
fn ascii_grid_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let corner = read(&grid(folder.path(), &format!("{HEADER}{VALUES}"))).unwrap();
    assert_eq!(
        [[0, 0], [1, 1], [0, 2], [3, 2]].map(|post| height_m(&corner, post)),
        [Some(1.0), Some(6.5), Some(9.0), None]
    );
    // Rows run south; the centre is (20, 15) m from the corner.
    let expected = [46.953_664_2, 9.000_262_8];
    let centre_deg =
        |loaded: &camsim_io::raster::LoadedTerrain| loaded.summary.centre_rad.map(f64::to_degrees);
    let corner_deg = centre_deg(&corner);
    assert!((0..2).all(|k| (corner_deg[k] - expected[k]).abs() < 2e-6), "{corner_deg:?}");
    // The same grid by pixel centre, in capitals, with a byte-order mark, CRLF, and values across lines.
    let centre = HEADER
        .to_uppercase()
        .replace("XLLCORNER 500000", "XLLCENTER 500005")
        .replace("YLLCORNER 5200000", "YLLCENTER 5200005");
    let text = format!("\u{feff}{centre}{}", VALUES.replace("4\n", "4 ")).replace('\n', "\r\n");
    let loaded = read(&grid(folder.path(), &text)).unwrap();
    assert!((0..2).all(|k| (centre_deg(&loaded)[k] - corner_deg[k]).abs() < 1e-9));
    assert_eq!(height_m(&loaded, [0, 1]), Some(5.0));
    // The system from the .prj file.
    fs::write(folder.path().join("dem.prj"), UTM_PRJ).unwrap();
    let loaded =
        read(&TerrainSpec { epsg: None, ..grid(folder.path(), &format!("{HEADER}{VALUES}")) }).unwrap();
    assert_eq!((loaded.summary.epsg, centre_deg(&loaded)), (32632, corner_deg));
    // Cells that are not square, and a height of NaN.
    let text = HEADER.replace("cellsize 10", "dx 10\ndy 20") + "1 2 3 4\n5 6.5 7 8\n9 10 11 nan\n";
    let loaded = read(&grid(folder.path(), &text)).unwrap();
    assert!(
        (loaded.terrain.bounds.max.x - loaded.terrain.bounds.min.x) / 1e5 > 5e-6
            && height_m(&loaded, [3, 2]).is_none()
    );
}

#[test]
fn height_units_of_prj_files_are_applied() {
    let folder = tempfile::tempdir().unwrap();
    let vertical = concat!(
        r#",VERTCS["NAVD88_height_(ftUS)",VDATUM["North_American_Vertical_Datum_1988"],"#,
        r#"PARAMETER["Vertical_Shift",0.0],PARAMETER["Direction",1.0],UNIT["Foot_US",0.304800609601219]]"#
    );
    let arc = "Projection    UTM\nZone          32\nDatum         WGS84\nZunits        FEET\nUnits         \
               METERS\nSpheroid      WGS84\nParameters\n";
    for (text, unit_m, warns) in [
        (format!("{UTM_PRJ}{vertical}"), 0.304_800_609_601_219, true),
        (arc.to_owned(), 0.3048, false),
        (arc.replace("FEET", "METERS"), 1.0, false),
        (UTM_PRJ.to_owned(), 1.0, false),
    ] {
        fs::write(folder.path().join("dem.prj"), &text).unwrap();
        let loaded = read(&grid(folder.path(), &format!("{HEADER}{VALUES}"))).unwrap();
        let height = height_m(&loaded, [1, 1]).unwrap();
        assert!((height - 6.5 * unit_m).abs() < 1e-5, "{text}: {height}");
        assert_eq!(
            loaded.notes.iter().any(|note| note.contains("scene.terrain.height = \"msl\"")),
            warns,
            "{text}: {:?}",
            loaded.notes
        );
    }
    fs::write(folder.path().join("dem.prj"), arc.replace("Units         METERS", "Units         FEET"))
        .unwrap();
    let error = read_error(&grid(folder.path(), &format!("{HEADER}{VALUES}")));
    assert!(error.contains("dem.prj"), "{error}");
    fs::remove_file(folder.path().join("dem.prj")).unwrap();
    // A no-data value is compared with a tolerance, but exactly if it may be a height.
    let height = |nodata: &str, value: &str| {
        let text = format!("{}{}", HEADER.replace("-99", nodata), VALUES.replace("-99", value));
        height_m(&read(&grid(folder.path(), &text)).unwrap(), [3, 2])
    };
    assert_eq!((height("-9999", "-9999.0039"), height("-99", "-99.0001").is_some()), (None, true));
}

#[test]
fn conflicting_horizontal_system_of_prj_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    Tiff::heights([4, 3], |column, row| (10 * row + column) as f32).write(&path);
    for (zone, warns) in [("32N", false), ("33N", true)] {
        fs::write(folder.path().join("dem.prj"), UTM_PRJ.replace("32N", zone)).unwrap();
        let loaded = read(&spec(&path)).unwrap();
        assert_eq!(loaded.summary.epsg, 32632);
        let is_conflict =
            |note: &String| note.contains("dem.prj states EPSG:32633 but the raster itself EPSG:32632");
        assert_eq!(loaded.notes.iter().any(is_conflict), warns, "{:?}", loaded.notes);
    }
}

#[test]
fn invalid_ascii_grids_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (text, expected) in [
        (HEADER.to_owned(), "has 0 heights instead of 4 x 3 = 12"),
        (format!("{HEADER}{VALUES}1"), "has 13 heights"),
        (
            format!("{HEADER}1 2 3 4\n5 6,5 7 8\n9 10 11 12"),
            "line 8: `6,5` is not a number (decimals need a point)",
        ),
        (format!("{}{VALUES}", HEADER.replace("cellsize 10\n", "")), "no `cellsize`"),
        (format!("{}{VALUES}", HEADER.replace("cellsize 10", "cellsize -10")), "line 5: cellsize is -10"),
        (
            format!("{}{VALUES}", HEADER.replace("cellsize 10", "cellsize 10 m")),
            "line 5: `cellsize 10 m` is not a key with its value",
        ),
        (format!("{}{VALUES}", HEADER.replace("xllcorner 500000\n", "")), "no `xllcorner` and `yllcorner`"),
        (format!("{}{VALUES}", HEADER.replace("nrows 3", "nrows 0")), "line 2: nrows is `0`"),
        (format!("{}{VALUES}", HEADER.replace("nrows 3", "nrows 4000000000")), "do not fit into"),
        (format!("{}{VALUES}", HEADER.replace("cellsize", "zunits feet\ncellsize")), "`zunits` is not a key"),
    ] {
        let error = read_error(&grid(folder.path(), &text));
        assert!(error.contains("dem.asc") && error.contains(expected), "{error}");
    }
    let error = read_error(&TerrainSpec { epsg: None, ..grid(folder.path(), &format!("{HEADER}{VALUES}")) });
    assert!(error.contains("scene.terrain.epsg"), "{error}");
    fs::write(folder.path().join("dem.prj"), UTM_PRJ.replace("WGS_1984_UTM_Zone_32N", "My_Site")).unwrap();
    let error = read_error(&TerrainSpec { epsg: None, ..grid(folder.path(), &format!("{HEADER}{VALUES}")) });
    assert!(error.contains("My_Site in dem.prj") && error.contains("scene.terrain.epsg"), "{error}");
}

#[test]
fn srtm_tile_is_placed_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let heights = |name: &str| {
        let path = folder.path().join(name);
        let height =
            |row: i16, column: i16| if (row, column) == (3, 4) { i16::MIN } else { (row - column) % 400 };
        let bytes: Vec<u8> = (0..1201)
            .flat_map(|row| (0..1201).flat_map(move |column| height(row, column).to_be_bytes()))
            .collect();
        fs::write(&path, bytes).unwrap();
        TerrainSpec { height: HeightReference::Msl, ..spec(&path) }
    };
    let loaded = read(&heights("N47E008.hgt")).unwrap();
    assert_eq!([[0, 2], [5, 0], [4, 3]].map(|post| height_m(&loaded, post)), [Some(2.0), Some(-5.0), None]);
    let degrees = |loaded: &camsim_io::raster::LoadedTerrain| {
        [loaded.summary.south_west_rad, loaded.summary.north_east_rad]
            .map(|corner| corner.map(f64::to_degrees))
    };
    let near = |actual: [[f64; 2]; 2], expected: [[f64; 2]; 2]| {
        (0..4).all(|k| (actual[k / 2][k % 2] - expected[k / 2][k % 2]).abs() < 1e-9)
    };
    assert!(
        near(degrees(&loaded), [[47.0, 8.0], [48.0, 9.0]]) && loaded.notes.is_empty(),
        "{:?} {:?}",
        degrees(&loaded),
        loaded.notes
    );
    let south = read(&TerrainSpec { height: HeightReference::Ellipsoid, ..heights("s01w072.HGT") }).unwrap();
    assert!(near(degrees(&south), [[-1.0, -72.0], [0.0, -71.0]]));
    assert!(
        south.notes[0].contains("EGM96") && south.notes[0].contains("scene.terrain.height = \"msl\""),
        "{:?}",
        south.notes
    );
    for name in ["tile.hgt", "N47X008.hgt", "N97E008.hgt", "N4é7E08.hgt"] {
        let error = read_error(&heights(name));
        assert!(error.contains("south-western corner"), "{error}");
    }
    fs::write(folder.path().join("N47E008.hgt"), [0; 100]).unwrap();
    let error = read_error(&spec(&folder.path().join("N47E008.hgt")));
    assert!(error.contains("this file has 100 bytes"), "{error}");
    fs::write(folder.path().join("dem.zip"), b"PK\x03\x04").unwrap();
    assert!(read_error(&spec(&folder.path().join("dem.zip"))).contains("unpack it"));
}

#[test]
fn sidecar_files_add_to_a_raster_or_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    let aux = folder.path().join("dem.tif.aux.xml");
    let band = |content: &str| {
        format!("<PAMDataset><PAMRasterBand band=\"1\">{content}</PAMRasterBand></PAMDataset>")
    };
    Tiff::heights([4, 3], |column, _| 100.0 + column as f32).write(&path);
    fs::write(
        &aux,
        band("<Scale>2</Scale><Offset>10</Offset><UnitType>ft</UnitType><NoDataValue>102</NoDataValue>"),
    )
    .unwrap();
    let loaded = read(&spec(&path)).unwrap();
    assert!(
        (height_m(&loaded, [1, 0]).unwrap() - 212.0 * 0.3048).abs() < 1e-3
            && height_m(&loaded, [2, 0]).is_none()
    );
    // Metadata of another band, and statistics.
    for text in [
        band("<Scale>2</Scale>").replace("band=\"1\"", "band=\"2\""),
        band("<Metadata><MDI key=\"STATISTICS_MEAN\">5</MDI></Metadata>"),
    ] {
        fs::write(&aux, text).unwrap();
        assert_eq!(height_m(&read(&spec(&path)).unwrap(), [1, 0]), Some(101.0));
    }
    for (text, expected) in [
        (band("<Scale>two</Scale>"), "Scale is `two`"),
        (band("<NoDataValue>none</NoDataValue>"), "NoDataValue is `none`"),
        ("<PAMDataset>".to_owned(), "is not GDAL metadata"),
        (
            "<PAMDataset><GeoTransform>1, 2, 3</GeoTransform></PAMDataset>".to_owned(),
            "not a list of six numbers",
        ),
        (
            "<PAMDataset><GeoTransform>0, 1, 0, 0, 0, -1</GeoTransform></PAMDataset>".to_owned(),
            "which differs from the raster itself",
        ),
    ] {
        fs::write(&aux, text).unwrap();
        let error = read_error(&spec(&path));
        assert!(error.contains("dem.tif.aux.xml") && error.contains(expected), "{error}");
    }
    fs::remove_file(&aux).unwrap();
    // A world file that differs from the tags is ignored with a note.
    fs::write(folder.path().join("dem.tfw"), "10 0 0 -10 500005 5199995").unwrap();
    assert!(read(&spec(&path)).unwrap().notes.is_empty());
    fs::write(folder.path().join("dem.tfw"), "10 0 0 -10 500105 5199995").unwrap();
    assert!(read(&spec(&path)).unwrap().notes[0].contains("a world file differs from its tags"));
    // A mask of another size.
    fs::copy(gdal_file("beside_mask.tif.msk"), folder.path().join("dem.tif.msk")).unwrap();
    let error = read_error(&spec(&path));
    assert!(error.contains("dem.tif.msk") && error.contains("its mask has [40, 30] pixels"), "{error}");
}
