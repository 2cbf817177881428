//! Heights of TIFF files: encodings, units, scales, no-data values, coordinate systems.

use camsim_core::scenario::{HeightReference, HeightUnit, TerrainSpec};

use super::{
    gdal_file, height_m, pixels,
    raster::{Tiff, Value},
    read, read_error, spec,
};

/// Asserts that every height is 400 + 0.7 column + 0.3 row metres, or void.
fn assert_heights(name: &str, is_void: impl Fn([u32; 2]) -> bool) {
    let loaded = read(&spec(&gdal_file(name))).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(loaded.summary.size, [40, 30], "{name}");
    for post in pixels([40, 30]) {
        let expected = 400.0 + 0.7 * f64::from(post[0]) + 0.3 * f64::from(post[1]);
        match height_m(&loaded, post) {
            None => assert!(is_void(post), "{name} {post:?}"),
            Some(height) => {
                assert!(
                    !is_void(post) && (height - expected).abs() < 1e-3,
                    "{name} {post:?}: {height} {expected}"
                )
            }
        }
    }
}

#[test]
fn heights_are_equal_in_all_encodings() {
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
        assert_heights(&format!("{name}.tif"), |_| false);
    }
    assert_heights("beside_mask.tif", |[column, row]| column < 7 && row < 5);
    // The no-data value is a stored one: 3000 is 400 m.
    assert_heights("beside_aux.tif", |post| post == [0, 0]);
}

#[test]
fn unsupported_compression_is_refused_with_a_command() {
    for (name, compression) in [("lerc", "LERC (34887)"), ("lzma", "LZMA (34925)")] {
        let path = gdal_file(&format!("{name}.tif"));
        let error = read_error(&spec(&path));
        let converted = path.with_file_name(format!("{name}_converted.tif"));
        let command =
            format!("gdal_translate -co COMPRESS=DEFLATE {} {}", path.display(), converted.display());
        assert!(error.contains(compression) && error.contains(&command), "{error}");
    }
}

/// Height of post (1, 1) and notes of a file with 4 x 3 heights of 100 and 140 at that post, after changes.
fn read_changed(
    name: &str,
    change: impl FnOnce(Tiff) -> Tiff,
    edit: impl FnOnce(&mut TerrainSpec),
) -> Result<(Option<f64>, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("{name}.tif"));
    change(Tiff::heights([4, 3], |column, row| if (column, row) == (1, 1) { 140.0 } else { 100.0 }))
        .write(&path);
    let mut spec = spec(&path);
    edit(&mut spec);
    read(&spec).map(|loaded| (height_m(&loaded, [1, 1]), loaded.notes)).map_err(|error| error.to_string())
}

/// [`read_changed`] with a default scenario.
fn read_tiff(change: impl FnOnce(Tiff) -> Tiff) -> Result<(Option<f64>, Vec<String>), String> {
    read_changed("dem", change, |_| {})
}

/// Asserts the height and returns the notes.
fn assert_height(result: Result<(Option<f64>, Vec<String>), String>, expected: f64) -> Vec<String> {
    let (height, notes) = result.unwrap();
    let height = height.unwrap();
    assert!((height - expected).abs() < 1e-3, "{height} {expected} {notes:?}");
    notes
}

/// International foot, metres.
const FOOT_M: f64 = 0.3048;
/// US survey foot, metres.
const SURVEY_FOOT_M: f64 = 1200.0 / 3937.0;

#[test]
fn height_units_are_applied_by_name_and_by_code() {
    assert_eq!(assert_height(read_tiff(|tiff| tiff), 140.0), [""; 0]);
    for (items, unit) in [
        (
            r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">metre</Item></GDALMetadata>"#,
            1.0,
        ),
        (
            r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">foot</Item></GDALMetadata>"#,
            FOOT_M,
        ),
        (
            r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">Foot_US</Item></GDALMetadata>"#,
            SURVEY_FOOT_M,
        ),
        (r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">cm</Item></GDALMetadata>"#, 0.01),
        (r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype"></Item></GDALMetadata>"#, 1.0),
        // The unit of another band.
        (r#"<GDALMetadata><Item name="UNITTYPE" sample="1" role="unittype">ft</Item></GDALMetadata>"#, 1.0),
    ] {
        assert_height(read_tiff(|tiff| tiff.with_metadata(items)), 140.0 * unit);
    }
    let with_keys =
        |keys: &[u16]| read_tiff(|tiff| tiff.with_keys(&[&[1024, 1, 1025, 1, 3072, 32632], keys].concat()));
    assert_height(with_keys(&[4099, 9002]), 140.0 * FOOT_M);
    assert_height(with_keys(&[4099, 9003]), 140.0 * SURVEY_FOOT_M);
    assert_height(with_keys(&[4096, 8228]), 140.0 * FOOT_M);
    let error = with_keys(&[4099, 9099]).unwrap_err();
    assert!(error.contains("vertical unit has EPSG code 9099"), "{error}");
    let error = with_keys(&[4096, 5703, 4099, 9002]).unwrap_err();
    assert!(
        error.contains(
            "EPSG:5703 (NAVD88 height) of 1 m and VerticalUnits 9002 of 0.3048 m: set \
             scene.terrain.height_unit"
        ),
        "{error}"
    );
    let error = with_keys(&[4096, 5336]).unwrap_err();
    assert!(error.contains("Black Sea depth") && error.contains("positive downwards"), "{error}");
    let notes = assert_height(with_keys(&[4096, 5999]), 140.0);
    assert!(notes[0].contains("unknown vertical system (EPSG:5999"), "{notes:?}");
    let error = read_tiff(|tiff| {
        tiff.with_metadata(
            r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">furlong</Item></GDALMetadata>"#,
        )
    })
    .unwrap_err();
    assert!(error.contains("`furlong`") && error.contains("scene.terrain.height_unit"), "{error}");
}

#[test]
fn scales_and_offsets_are_applied_or_refused() {
    assert_height(
        read_tiff(|tiff| {
            tiff.with_metadata(
                r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">2</Item></GDALMetadata>"#,
            )
        }),
        280.0,
    );
    assert_height(
        read_tiff(|tiff| {
            tiff.with_metadata(
                r#"<GDALMetadata><Item name="OFFSET" sample="0" role="offset">-50</Item></GDALMetadata>"#,
            )
        }),
        90.0,
    );
    // The scale applies before the unit, and needs a role.
    let all = r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">0.5</Item>
        <Item name="OFFSET" sample="0" role="offset">30</Item>
        <Item name="UNITTYPE" sample="0" role="unittype">ft</Item></GDALMetadata>"#;
    assert_height(read_tiff(|tiff| tiff.with_metadata(all)), 100.0 * FOOT_M);
    assert_height(
        read_tiff(|tiff| {
            tiff.with_metadata(r#"<GDALMetadata><Item name="SCALE" sample="0">2</Item></GDALMetadata>"#)
        }),
        140.0,
    );
    for (items, expected) in [
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
        let error = read_tiff(|tiff| tiff.with_metadata(items))
            .map(|(height, notes)| format!("{height:?} {notes:?}"));
        assert!(
            error.as_ref().is_err_and(|error| error.contains("dem.tif") && error.contains(expected)),
            "{error:?} {expected}"
        );
    }
    // As in GDAL, the scale of the georeference applies only with a vertical system.
    let with_vertical_scale = |tiff: Tiff| {
        tiff.with(33550, Value::Double(vec![10.0, 10.0, 0.5]))
            .with(33922, Value::Double(vec![0.0, 0.0, 0.0, 500_000.0, 5_200_000.0, 7.0]))
    };
    assert_height(
        read_tiff(|tiff| with_vertical_scale(tiff).with_keys(&[1024, 1, 1025, 1, 3072, 32632, 4096, 5703])),
        77.0,
    );
    let notes = assert_height(read_tiff(with_vertical_scale), 140.0);
    assert!(notes[0].contains("ModelPixelScale") && notes[0].contains("not applied"), "{notes:?}");
}

#[test]
fn nodata_values_are_compared_with_stored_values() {
    let with_nodata = |text: &'static str| read_tiff(|tiff| tiff.with(42113, Value::Text(text)));
    assert_eq!(with_nodata("140").unwrap().0, None);
    assert_eq!(with_nodata("140 ").unwrap().0, None);
    assert_height(with_nodata("nan"), 140.0);
    assert_height(with_nodata("-1.#IND"), 140.0);
    assert_height(with_nodata("-3.4028234663852886e+38"), 140.0);
    assert!(with_nodata("none").unwrap_err().contains("`none`, which is not a number"));
    // Implausible heights are counted.
    let (height, notes) = read_changed(
        "dem",
        |tiff| {
            tiff.with_metadata(
                r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">90</Item></GDALMetadata>"#,
            )
        },
        |_| {},
    )
    .unwrap();
    assert!(
        height.is_none() && notes[0].contains("1 of its values are no plausible heights in metres"),
        "{notes:?}"
    );
}

#[test]
fn horizontal_systems_are_supported_or_refused() {
    let with_keys = |keys: &[u16], epsg: Option<u16>| {
        read_changed("dem", |tiff| tiff.with_keys(keys), |spec| spec.epsg = epsg)
    };
    for (keys, expected) in [
        (&[1024, 1, 1025, 1, 3072, 32767][..], "has a user-defined coordinate system"),
        // A user-defined projection on a known geographic system.
        (&[1024, 1, 1025, 1, 2048, 4326, 3075, 8], "has a user-defined coordinate system"),
        (&[1024, 1, 1025, 1, 2048, 4326], "has a user-defined coordinate system"),
        (&[1024, 2, 1025, 1, 2048, 32767], "has a user-defined coordinate system"),
        (&[1024, 3, 1025, 1], "geocentric"),
        (&[1024, 1, 1025, 1, 3072, 29190], "EPSG:29190 is not supported (docs/reference/inputs/TERRAIN.md"),
        (&[1024, 1, 1025, 1, 3072, 32632, 3076, 9002], "the horizontal unit has EPSG code 9002"),
        (&[1024, 1, 1025, 1, 3072, 2230, 3076, 9001], "the horizontal unit has EPSG code 9001"),
        (
            &[1024, 1, 1025, 1, 3072, 2230, 3076, 9003],
            "has coordinates in feet, and the unit of the heights is not stated: set \
             scene.terrain.height_unit",
        ),
        (&[1024, 2, 1025, 1, 2048, 4326, 2054, 9101], "the angular unit has EPSG code 9101"),
    ] {
        let error = with_keys(keys, None).unwrap_err();
        assert!(error.contains("dem.tif") && error.contains(expected), "{error}");
    }
    // UTM by its zone; a compound code; the key for a file without code.
    assert_height(with_keys(&[1024, 1, 1025, 1, 3072, 32767, 2048, 4326, 3074, 16032], None), 140.0);
    let notes = assert_height(with_keys(&[1024, 1, 1025, 1, 3072, 5555], None), 140.0);
    assert!(notes[0].contains("DHHN92 height"), "{notes:?}");
    assert_height(with_keys(&[1024, 1, 1025, 1, 3072, 32767], Some(32632)), 140.0);
    let error = with_keys(&[1024, 1, 1025, 1, 3072, 32632], Some(32633)).unwrap_err();
    assert!(error.contains("states EPSG:32632 but scene.terrain.epsg = 32633"), "{error}");
    // Coordinates and heights in feet: 10 ft cells in California zone 6.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    let tie_point = Value::Double(vec![0.0, 0.0, 0.0, 6_300_000.0, 1_900_000.0, 0.0]);
    Tiff::heights([4, 3], |_, _| 100.0)
        .with(33922, tie_point)
        .with_keys(&[1024, 1, 1025, 1, 3072, 2230, 3076, 9003])
        .write(&path);
    let loaded = read(&TerrainSpec { height_unit: Some(HeightUnit::UsFt), ..spec(&path) }).unwrap();
    assert!((height_m(&loaded, [1, 1]).unwrap() - 100.0 * SURVEY_FOOT_M).abs() < 1e-3);
    // The centre of the grid by PROJ: cs2cs EPSG:2230 EPSG:4269.
    let centre_deg = loaded.summary.centre_rad.map(f64::to_degrees);
    assert!(
        (centre_deg[0] - 32.877_115_5).abs() < 2e-6 && (centre_deg[1] - -117.102_211_1).abs() < 2e-6,
        "{centre_deg:?}"
    );
}

#[test]
fn vertical_datums_that_contradict_the_key_are_reported() {
    let with_keys = |keys: &[u16], height: HeightReference| {
        read_changed("dem", |tiff| tiff.with_keys(keys), |spec| spec.height = height).unwrap().1
    };
    let sea_level = [1024, 1, 1025, 1, 3072, 32632, 4096, 3855];
    assert!(with_keys(&sea_level, HeightReference::Ellipsoid)[0].contains("EPSG:3855, EGM2008 height"));
    assert!(with_keys(&sea_level, HeightReference::Msl).is_empty());
    let old = [1024, 1, 1025, 1, 3072, 32632, 4096, 5103];
    assert!(with_keys(&old, HeightReference::Ellipsoid)[0].contains("NAVD88"));
    let ellipsoid = [1024, 1, 1025, 1, 3072, 32632, 4096, 5030];
    assert!(with_keys(&ellipsoid, HeightReference::Ellipsoid).is_empty());
    assert!(with_keys(&ellipsoid, HeightReference::Msl)[0].contains("above the ellipsoid"));
}

#[test]
fn invalid_tags_are_refused() {
    for (tag, value, expected) in [
        (257, Value::Long(vec![0]), "a side of 0 pixels"),
        (278, Value::Long(vec![0]), "blocks of"),
        (277, Value::Short(vec![0]), "0 samples a pixel"),
        (258, Value::Short(vec![24]), "samples of 24 bits"),
        (339, Value::Short(vec![6]), "format 6"),
        (317, Value::Short(vec![9]), "predictor 9"),
        (259, Value::Short(vec![12345]), "number 12345 is not read"),
        (278, Value::Long(vec![1]), "1 blocks are listed, but 3 are needed"),
        (279, Value::Long(vec![40]), "the file is truncated"),
        (256, Value::Long(vec![2_000_000_000]), "impossible for a file of this length"),
        (273, Value::Double(vec![8.0]), "tag 273 is not a list of integers"),
    ] {
        let error =
            read_tiff(|tiff| tiff.with(tag, value)).map(|(height, notes)| format!("{height:?} {notes:?}"));
        assert!(
            error.as_ref().is_err_and(|error| error.contains("dem.tif") && error.contains(expected)),
            "{tag}: {error:?} {expected}"
        );
    }
    // Ground control points without a pixel size.
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
    let error = read_tiff(|mut tiff| {
        tiff.tags.retain(|(tag, _)| *tag != 33550);
        tiff.with(33922, Value::Double(points))
    });
    assert!(error.unwrap_err().contains("4 ground control points"));
}
