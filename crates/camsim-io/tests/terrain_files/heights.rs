use camsim_core::scenario::{HeightReference, HeightUnit, TerrainSpec};

use super::{
    by_gdal, fails, height_m, pixels,
    raster::{Tiff, Value},
    read, spec,
};

fn assert_true(name: &str, is_void: impl Fn([u32; 2]) -> bool) {
    let loaded = read(&spec(&by_gdal(name))).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(loaded.summary.size, [40, 30], "{name}");
    for at in pixels([40, 30]) {
        let expected = 400.0 + 0.7 * f64::from(at[0]) + 0.3 * f64::from(at[1]);
        match height_m(&loaded, at) {
            None => assert!(is_void(at), "{name} {at:?}"),
            Some(found) => {
                assert!(!is_void(at) && (found - expected).abs() < 1e-3, "{name} {at:?}: {found} {expected}")
            }
        }
    }
}

#[test]
fn heights_are_the_same_however_they_are_stored() {
    for name in [
        "zstd_predictor3",
        "deflate_predictor3_f64",
        "lzw_predictor2_i16",
        "deflate_predictor2_u32_big",
        "packbits_big",
        "bigtiff",
        "white_is_zero",
        "u12",
        "overviews",
        "point",
    ] {
        assert_true(&format!("{name}.tif"), |_| false);
    }
    assert_true("beside_mask.tif", |[column, row]| column < 7 && row < 5);
    // The mark is of stored numbers: 3000 is 400 m.
    assert_true("beside_aux.tif", |at| at == [0, 0]);
}

#[test]
fn what_is_not_read_says_how_to_convert_it() {
    for (name, what) in [("lerc", "LERC (34887)"), ("lzma", "LZMA (34925)")] {
        let path = by_gdal(&format!("{name}.tif"));
        let error = fails(&spec(&path));
        let to = path.with_file_name(format!("{name}_converted.tif"));
        let command = format!("gdal_translate -co COMPRESS=DEFLATE {} {}", path.display(), to.display());
        assert!(error.contains(what) && error.contains(&command), "{error}");
    }
}

/// 4 x 3 heights of 100 and one of 140, in a file of its own with changes.
fn made(
    name: &str,
    change: impl FnOnce(Tiff) -> Tiff,
    wish: impl FnOnce(&mut TerrainSpec),
) -> Result<(Option<f64>, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("{name}.tif"));
    change(Tiff::heights([4, 3], |column, row| if (column, row) == (1, 1) { 140.0 } else { 100.0 }))
        .write(&path);
    let mut spec = spec(&path);
    wish(&mut spec);
    read(&spec).map(|loaded| (height_m(&loaded, [1, 1]), loaded.notes)).map_err(|error| error.to_string())
}

fn plain(change: impl FnOnce(Tiff) -> Tiff) -> Result<(Option<f64>, Vec<String>), String> {
    made("dem", change, |_| {})
}

fn near(found: Result<(Option<f64>, Vec<String>), String>, expected: f64) -> Vec<String> {
    let (height, notes) = found.unwrap();
    let height = height.unwrap();
    assert!((height - expected).abs() < 1e-3, "{height} {expected} {notes:?}");
    notes
}

const FOOT: f64 = 0.3048;
const SURVEY: f64 = 1200.0 / 3937.0;

#[test]
fn units_by_any_name_or_key() {
    assert_eq!(near(plain(|tiff| tiff), 140.0), [""; 0]);
    for (items, unit) in [
        (
            r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">metre</Item></GDALMetadata>"#,
            1.0,
        ),
        (
            r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">foot</Item></GDALMetadata>"#,
            FOOT,
        ),
        (
            r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">Foot_US</Item></GDALMetadata>"#,
            SURVEY,
        ),
        (r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">cm</Item></GDALMetadata>"#, 0.01),
        (r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype"></Item></GDALMetadata>"#, 1.0),
        // Of another band.
        (r#"<GDALMetadata><Item name="UNITTYPE" sample="1" role="unittype">ft</Item></GDALMetadata>"#, 1.0),
    ] {
        near(plain(|tiff| tiff.with_metadata(items)), 140.0 * unit);
    }
    let keyed =
        |keys: &[u16]| plain(|tiff| tiff.with_keys(&[&[1024, 1, 1025, 1, 3072, 32632], keys].concat()));
    near(keyed(&[4099, 9002]), 140.0 * FOOT);
    near(keyed(&[4099, 9003]), 140.0 * SURVEY);
    near(keyed(&[4096, 8228]), 140.0 * FOOT);
    let error = keyed(&[4099, 9099]).unwrap_err();
    assert!(error.contains("vertical unit has EPSG code 9099"), "{error}");
    let error = keyed(&[4096, 5703, 4099, 9002]).unwrap_err();
    assert!(
        error.contains("EPSG:5703 (NAVD88 height) of 1 m and VerticalUnits 9002 of 0.3048 m: set scene.terrain.height_unit"),
        "{error}"
    );
    let error = keyed(&[4096, 5336]).unwrap_err();
    assert!(error.contains("Black Sea depth") && error.contains("downwards"), "{error}");
    let notes = near(keyed(&[4096, 5999]), 140.0);
    assert!(notes[0].contains("vertical system that is not known (EPSG:5999"), "{notes:?}");
    let error = plain(|tiff| {
        tiff.with_metadata(
            r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">furlong</Item></GDALMetadata>"#,
        )
    })
    .unwrap_err();
    assert!(error.contains("`furlong`") && error.contains("scene.terrain.height_unit"), "{error}");
}

#[test]
fn scales_are_applied_or_refused() {
    near(
        plain(|tiff| {
            tiff.with_metadata(
                r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">2</Item></GDALMetadata>"#,
            )
        }),
        280.0,
    );
    near(
        plain(|tiff| {
            tiff.with_metadata(
                r#"<GDALMetadata><Item name="OFFSET" sample="0" role="offset">-50</Item></GDALMetadata>"#,
            )
        }),
        90.0,
    );
    // Scale before unit, and no role is no scale.
    let all = r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">0.5</Item><Item name="OFFSET" sample="0" role="offset">30</Item><Item name="UNITTYPE" sample="0" role="unittype">ft</Item></GDALMetadata>"#;
    near(plain(|tiff| tiff.with_metadata(all)), 100.0 * FOOT);
    near(
        plain(|tiff| {
            tiff.with_metadata(r#"<GDALMetadata><Item name="SCALE" sample="0">2</Item></GDALMetadata>"#)
        }),
        140.0,
    );
    for (items, says) in [
        (
            r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">0,1</Item></GDALMetadata>"#,
            "scale is `0,1`",
        ),
        (
            r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">0</Item></GDALMetadata>"#,
            "a scale of 0",
        ),
        (r#"<GDALMetadata><Item name="SCALE" sample="x" role="scale">1</Item></GDALMetadata>"#, "sample `x`"),
        (
            r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">0.1"#,
            "GDAL_METADATA (tag 42112) cannot be read",
        ),
        (
            r#"<GDALMetadata><Item name="SCALE" sample="9999999999" role="scale">1</Item></GDALMetadata>"#,
            "sample `9999999999`",
        ),
    ] {
        let error =
            plain(|tiff| tiff.with_metadata(items)).map(|(height, notes)| format!("{height:?} {notes:?}"));
        assert!(
            error.as_ref().is_err_and(|error| error.contains("dem.tif") && error.contains(says)),
            "{error:?} {says}"
        );
    }
    // In the georeference, as GDAL takes it: with a vertical system only.
    let third = |tiff: Tiff| {
        tiff.with(33550, Value::Double(vec![10.0, 10.0, 0.5]))
            .with(33922, Value::Double(vec![0.0, 0.0, 0.0, 500_000.0, 5_200_000.0, 7.0]))
    };
    near(plain(|tiff| third(tiff).with_keys(&[1024, 1, 1025, 1, 3072, 32632, 4096, 5703])), 77.0);
    let notes = near(plain(third), 140.0);
    assert!(notes[0].contains("ModelPixelScale") && notes[0].contains("not applied"), "{notes:?}");
}

#[test]
fn marks_are_of_stored_numbers() {
    let mark = |text: &'static str| plain(|tiff| tiff.with(42113, Value::Text(text)));
    assert_eq!(mark("140").unwrap().0, None);
    assert_eq!(mark("140 ").unwrap().0, None);
    near(mark("nan"), 140.0);
    near(mark("-1.#IND"), 140.0);
    near(mark("-3.4028234663852886e+38"), 140.0);
    assert!(mark("none").unwrap_err().contains("`none`, which is no number"));
    // Numbers that are no heights in metres are counted.
    let (height, notes) = made(
        "dem",
        |tiff| {
            tiff.with_metadata(
                r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">90</Item></GDALMetadata>"#,
            )
        },
        |_| {},
    )
    .unwrap();
    assert!(height.is_none() && notes[0].contains("1 of its numbers are no heights in metres"), "{notes:?}");
}

#[test]
fn systems_of_place_are_known_or_refused() {
    let keyed =
        |keys: &[u16], wish: Option<u16>| made("dem", |tiff| tiff.with_keys(keys), |spec| spec.epsg = wish);
    for (keys, says) in [
        (&[1024, 1, 1025, 1, 3072, 32767][..], "defines a coordinate system of its own"),
        // A projection of its own over a known geographic system: metres are no degrees.
        (&[1024, 1, 1025, 1, 2048, 4326, 3075, 8], "defines a coordinate system of its own"),
        (&[1024, 1, 1025, 1, 2048, 4326], "defines a coordinate system of its own"),
        (&[1024, 2, 1025, 1, 2048, 32767], "defines a coordinate system of its own"),
        (&[1024, 3, 1025, 1], "geocentric"),
        (&[1024, 1, 1025, 1, 3072, 29190], "EPSG:29190 is not supported (docs/inputs/TERRAIN.md"),
        (&[1024, 1, 1025, 1, 3072, 32632, 3076, 9002], "the horizontal unit has EPSG code 9002"),
        (&[1024, 1, 1025, 1, 3072, 2230, 3076, 9001], "the horizontal unit has EPSG code 9001"),
        (
            &[1024, 1, 1025, 1, 3072, 2230, 3076, 9003],
            "counts in feet, and nothing says whether the heights do: set scene.terrain.height_unit",
        ),
        (&[1024, 2, 1025, 1, 2048, 4326, 2054, 9101], "the angular unit has EPSG code 9101"),
    ] {
        let error = keyed(keys, None).unwrap_err();
        assert!(error.contains("dem.tif") && error.contains(says), "{error}");
    }
    // UTM by its zone; a code for both place and height; the key, where the file has no code.
    near(keyed(&[1024, 1, 1025, 1, 3072, 32767, 2048, 4326, 3074, 16032], None), 140.0);
    let notes = near(keyed(&[1024, 1, 1025, 1, 3072, 5555], None), 140.0);
    assert!(notes[0].contains("DHHN92 height"), "{notes:?}");
    near(keyed(&[1024, 1, 1025, 1, 3072, 32767], Some(32632)), 140.0);
    let error = keyed(&[1024, 1, 1025, 1, 3072, 32632], Some(32633)).unwrap_err();
    assert!(error.contains("states EPSG:32632 but scene.terrain.epsg = 32633"), "{error}");
    // Feet on the ground, with the key for heights: 10 ft cells about the middle of California zone 6.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    let place = Value::Double(vec![0.0, 0.0, 0.0, 6_300_000.0, 1_900_000.0, 0.0]);
    Tiff::heights([4, 3], |_, _| 100.0)
        .with(33922, place)
        .with_keys(&[1024, 1, 1025, 1, 3072, 2230, 3076, 9003])
        .write(&path);
    let loaded = read(&TerrainSpec { height_unit: Some(HeightUnit::UsFt), ..spec(&path) }).unwrap();
    assert!((height_m(&loaded, [1, 1]).unwrap() - 100.0 * SURVEY).abs() < 1e-3);
    // By PROJ: cs2cs EPSG:2230 EPSG:4269 of the grid's middle.
    let middle = loaded.summary.centre_rad.map(f64::to_degrees);
    assert!(
        (middle[0] - 32.877_115_5).abs() < 2e-6 && (middle[1] - -117.102_211_1).abs() < 2e-6,
        "{middle:?}"
    );
}

#[test]
fn datums_that_contradict_the_key_are_named() {
    let keyed = |keys: &[u16], height: HeightReference| {
        made("dem", |tiff| tiff.with_keys(keys), |spec| spec.height = height).unwrap().1
    };
    let sea = [1024, 1, 1025, 1, 3072, 32632, 4096, 3855];
    assert!(keyed(&sea, HeightReference::Ellipsoid)[0].contains("EPSG:3855, EGM2008 height"));
    assert!(keyed(&sea, HeightReference::Msl).is_empty());
    let old = [1024, 1, 1025, 1, 3072, 32632, 4096, 5103];
    assert!(keyed(&old, HeightReference::Ellipsoid)[0].contains("NAVD88"));
    let ellipsoid = [1024, 1, 1025, 1, 3072, 32632, 4096, 5030];
    assert!(keyed(&ellipsoid, HeightReference::Ellipsoid).is_empty());
    assert!(keyed(&ellipsoid, HeightReference::Msl)[0].contains("above the ellipsoid"));
}

#[test]
fn broken_layouts_are_refused() {
    for (tag, value, says) in [
        (257, Value::Long(vec![0]), "a side of 0 pixels"),
        (278, Value::Long(vec![0]), "blocks of"),
        (277, Value::Short(vec![0]), "0 samples a pixel"),
        (258, Value::Short(vec![24]), "samples of 24 bits"),
        (339, Value::Short(vec![6]), "format 6"),
        (317, Value::Short(vec![9]), "predictor 9"),
        (259, Value::Short(vec![12345]), "number 12345 is not read"),
        (278, Value::Long(vec![1]), "1 blocks are listed, and 3 are needed"),
        (279, Value::Long(vec![40]), "the file is cut off"),
        (256, Value::Long(vec![2_000_000_000]), "impossible for a file of this length"),
        (273, Value::Double(vec![8.0]), "tag 273 is no list of whole numbers"),
    ] {
        let error =
            plain(|tiff| tiff.with(tag, value)).map(|(height, notes)| format!("{height:?} {notes:?}"));
        assert!(
            error.as_ref().is_err_and(|error| error.contains("dem.tif") && error.contains(says)),
            "{tag}: {error:?} {says}"
        );
    }
    // Control points alone.
    let points: Vec<f64> = (0..4)
        .flat_map(|k| {
            [
                f64::from(k % 2),
                f64::from(k / 2),
                0.0,
                500_000.0 + 10.0 * f64::from(k % 2),
                5_200_000.0 - 10.0 * f64::from(k / 2),
                0.0,
            ]
        })
        .collect();
    let error = plain(|mut tiff| {
        tiff.tags.retain(|(tag, _)| *tag != 33550);
        tiff.with(33922, Value::Double(points))
    });
    assert!(error.unwrap_err().contains("4 ground control points"));
}
