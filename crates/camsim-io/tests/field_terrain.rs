//! Terrain files as users have them, compared with known values. In tests/data/field the height at the centre
//! of pixel (column, row) is 400 + 0.7 column + 0.3 row metres, and the colour (40 + 2 column, 30 + 2 row,
//! 100).

#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::{Path, PathBuf};

use camsim_core::{
    scenario::{Beyond, HeightReference, HeightUnit, TerrainSpec},
    scene::TexelForm,
};
use camsim_io::raster::{LoadedTerrain, TerrainFileError, read_terrain};
use glam::DVec3;

fn field(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field").join(name)
}

fn spec(dem: &str) -> TerrainSpec {
    TerrainSpec { dem: field(dem).into(), ..TerrainSpec::default() }
}

fn with_ortho(ortho: &str) -> TerrainSpec {
    TerrainSpec { ortho: Some(field(ortho).into()), ..spec("ortho/dem.tif") }
}

/// Reads with a local frame near 47 N, 9 E whose down is the negative height.
fn read(spec: &TerrainSpec) -> Result<LoadedTerrain, TerrainFileError> {
    let ned =
        |lat: f64, lon: f64, height: f64| DVec3::new((lat - 0.82) * 6.37e6, (lon - 0.157) * 6.37e6, -height);
    read_terrain(spec, &ned, None)
}

/// Height at the centre of a pixel, metres; `None` for a void.
fn height_m(loaded: &LoadedTerrain, [column, row]: [u32; 2]) -> Option<f64> {
    let terrain = &loaded.terrain;
    let chunk = |post: u32, cells: u32| post.min(cells - 1) / 64;
    let [x, y] = [chunk(column, terrain.cells[0]), chunk(row, terrain.cells[1])];
    let down = terrain.position_ned_m(y * terrain.chunk_grid[0] + x, column - 64 * x, row - 64 * y).z;
    (!down.is_nan()).then_some(-down)
}

/// Asserts that every height is the known one, or void.
fn assert_heights(loaded: &LoadedTerrain, is_void: impl Fn(u32, u32) -> bool) {
    assert_eq!(loaded.summary.size, [96, 96]);
    for (column, row) in (0..96).flat_map(|row| (0..96).map(move |column| (column, row))) {
        let expected =
            (!is_void(column, row)).then(|| 400.0 + 0.7 * f64::from(column) + 0.3 * f64::from(row));
        let height = height_m(loaded, [column, row]);
        let near = match (height, expected) {
            (Some(height), Some(expected)) => (height - expected).abs() < 1e-3,
            (height, expected) => height == expected,
        };
        assert!(near, "({column}, {row}): {height:?} {expected:?}");
    }
}

fn color(loaded: &LoadedTerrain, [column, row]: [u32; 2]) -> [u8; 3] {
    let texture = &loaded.terrain.texture;
    let start = 4 * (row * texture.size_px[0] + column) as usize;
    [0, 1, 2].map(|k| texture.rgba8[start + k])
}

/// Asserts that every colour is the known one within a tolerance.
fn assert_colors(loaded: &LoadedTerrain, columns: std::ops::Range<u32>, tolerance: u8) {
    assert_eq!(loaded.terrain.texture.size_px, [96, 96]);
    for (column, row) in (0..96).flat_map(|row| columns.clone().map(move |column| (column, row))) {
        let (color, expected) =
            (color(loaded, [column, row]), [40 + 2 * column as u8, 30 + 2 * row as u8, 100]);
        assert!(
            (0..3).all(|k| color[k].abs_diff(expected[k]) <= tolerance),
            "({column}, {row}): {color:?} {expected:?}"
        );
    }
}

fn never(_: u32, _: u32) -> bool {
    false
}

#[test]
fn scale_offset_and_unit_of_heights_are_applied() {
    for name in ["scaleoff", "unit_ft", "unit_usft"] {
        let loaded = read(&spec(&format!("dem-scale-unit/d_{name}.tif"))).unwrap();
        assert_heights(&loaded, never);
        assert!(loaded.notes.is_empty(), "{:?}", loaded.notes);
    }
}

#[test]
fn vertical_system_gives_the_unit_and_is_reported_if_contradicting() {
    for (name, expected) in
        [("comp_6360", "EPSG:6360, NAVD88 height (ftUS)"), ("egm96", "EPSG:5773, EGM96 height")]
    {
        let path = format!("dem-scale-unit/d_{name}.tif");
        let loaded = read(&spec(&path)).unwrap();
        assert_heights(&loaded, never);
        let [note] = &loaded.notes[..] else { panic!("{:?}", loaded.notes) };
        assert!(note.contains(expected) && note.contains("scene.terrain.height = \"msl\""), "{note}");
        // With the suggested key there is no note.
        let loaded = read(&TerrainSpec { height: HeightReference::Msl, ..spec(&path) }).unwrap();
        assert!(loaded.notes.is_empty(), "{:?}", loaded.notes);
        assert_heights(&loaded, never);
    }
}

#[test]
fn height_unit_key_must_not_contradict_the_file() {
    let unit = |name: &str, unit: HeightUnit| {
        read(&TerrainSpec { height_unit: Some(unit), ..spec(&format!("dem-scale-unit/d_{name}.tif")) })
    };
    assert_heights(&unit("unit_ft", HeightUnit::Ft).unwrap(), never);
    let error = unit("unit_ft", HeightUnit::M).unwrap_err().to_string();
    assert!(
        error.contains("unit `ft` of 0.3048 m") && error.contains("scene.terrain.height_unit"),
        "{error}"
    );
    // The key applies to files without a unit.
    let loaded = read(&TerrainSpec { height_unit: Some(HeightUnit::Ft), ..spec("ortho/dem.tif") }).unwrap();
    assert!((height_m(&loaded, [50, 50]).unwrap() - 450.0 * 0.3048).abs() < 1e-3);
}

#[test]
fn sparse_blocks_are_void() {
    for name in ["d_sp_lzw", "d_sp_none", "d_sparse"] {
        let loaded = read(&spec(&format!("dem-sparse/{name}.tif"))).unwrap();
        assert_heights(&loaded, |column, row| column < 32 && row < 32);
        assert_eq!(loaded.summary.void_heights, 32 * 32);
    }
}

#[test]
fn masked_heights_are_void() {
    let loaded = read(&spec("dem-mask/d_internalmask.tif")).unwrap();
    let masked = |n: u32| (40..56).contains(&n);
    assert_heights(&loaded, |column, row| masked(column) && masked(row));
    assert_eq!((loaded.summary.void_heights, loaded.summary.height_range_m), (256, [400.0, 495.0]));
}

#[test]
fn masked_ortho_pixels_are_grey() {
    let loaded = read(&with_ortho("ortho/o_mask.tif")).unwrap();
    assert_colors(&loaded, 48..96, 0);
    assert_eq!([[0, 0], [47, 95], [20, 50]].map(|pixel| color(&loaded, pixel)), [[118; 3]; 3]);
}

#[test]
fn dark_16_bit_pictures_are_reported_with_a_white_level() {
    let loaded = read(&with_ortho("ortho/o_u16_11bit.tif")).unwrap();
    let [note] = &loaded.notes[..] else { panic!("{:?}", loaded.notes) };
    assert!(
        note.contains("reach only 1840 of 65535") && note.contains("scene.terrain.ortho_white = 2047"),
        "{note}"
    );
    // The file stores colours times 8.
    let loaded =
        read(&TerrainSpec { ortho_white: Some(2040.0), ..with_ortho("ortho/o_u16_11bit.tif") }).unwrap();
    assert_colors(&loaded, 0..96, 0);
    assert!(loaded.notes.is_empty(), "{:?}", loaded.notes);
    let loaded =
        read(&TerrainSpec { ortho_white: Some(1000.0), ..with_ortho("ortho/o_u16_11bit.tif") }).unwrap();
    assert!(loaded.notes[0].contains("brighter than scene.terrain.ortho_white = 1000"), "{:?}", loaded.notes);
}

#[test]
fn lossy_compressions_are_read() {
    // With GDAL the errors are up to 6 and 10.
    for (name, tolerance, gdal_colors) in [
        (
            "jpeg_ycbcr",
            6,
            [
                ([28, 3], [98, 36, 103]),
                ([80, 70], [202, 169, 98]),
                ([31, 0], [99, 32, 103]),
                ([32, 0], [103, 31, 97]),
            ],
        ),
        (
            "webp",
            10,
            [
                ([28, 3], [94, 36, 97]),
                ([80, 70], [200, 168, 99]),
                ([31, 0], [97, 37, 98]),
                ([32, 0], [98, 36, 96]),
            ],
        ),
    ] {
        let loaded = read(&with_ortho(&format!("ortho/o_{name}.tif"))).unwrap();
        assert_colors(&loaded, 0..96, tolerance);
        // Decoders differ in rounding and in chroma upsampling.
        for (pixel, expected) in gdal_colors {
            let color = color(&loaded, pixel);
            assert!(
                (0..3).all(|k| color[k].abs_diff(expected[k]) <= 2),
                "{name} {pixel:?}: {color:?} {expected:?}"
            );
        }
        assert!(loaded.notes.is_empty(), "{:?}", loaded.notes);
    }
}

#[test]
fn longitudes_of_190_and_minus_170_degrees_are_equal() {
    let loaded = read_terrain(
        &TerrainSpec { ortho: Some(field("ortho/o_170.tif").into()), ..spec("ortho/d_190.tif") },
        &|lat, lon, height| {
            DVec3::new(6.37e6 * (lat - (-17f64).to_radians()), 6.37e6 * (lon - 190f64.to_radians()), -height)
        },
        None,
    )
    .unwrap();
    assert_eq!(loaded.summary.outside_ortho, 0);
    assert_eq!(height_m(&loaded, [50, 50]), Some(100.0));
    assert_colors(&loaded, 0..96, 0);
    // Each post is in the centre of its pixel.
    for (index, pixel) in [(0, [0, 0]), (64, [64, 0]), (65 * 64 + 10, [10, 64])] {
        let uv = loaded.terrain.vertices[index].uv;
        assert!((0..2).all(|k| (uv[k] * 96.0 - pixel[k] as f32 - 0.5).abs() < 1e-3), "{uv:?} {pixel:?}");
    }
    assert!(
        (loaded.summary.centre_rad[1].to_degrees() - -169.9952).abs() < 1e-9,
        "{}",
        loaded.summary.centre_rad[1].to_degrees()
    );
}

/// An ortho-image of 20 x 20 pixels on the DEM of 96 x 96 posts; its first pixel is at column 30, row 40.
fn small_picture(folder: &Path) -> PathBuf {
    let path = folder.join("small.png");
    image::RgbImage::from_fn(20, 20, |x, y| image::Rgb([200, 10 * x as u8, 10 * y as u8]))
        .save(&path)
        .unwrap();
    std::fs::write(folder.join("small.pgw"), "10 0 0 -10 500305 5199595").unwrap();
    path
}

#[test]
fn ground_outside_of_the_ortho_image_follows_the_key() {
    let folder = tempfile::tempdir().unwrap();
    let spec = TerrainSpec { ortho: Some(small_picture(folder.path()).into()), ..spec("ortho/dem.tif") };
    let fraction = 100.0 * (1.0 - 400.0 / (96.0 * 96.0));
    let inside = |column: u32, row: u32| (30..50).contains(&column) && (40..60).contains(&row);
    for (beyond, expected) in
        [(Beyond::Grey, "is grey"), (Beyond::Edge, "of the colours at its border"), (Beyond::Void, "is void")]
    {
        let loaded = read(&TerrainSpec { beyond, ..spec.clone() }).unwrap();
        let [note] = &loaded.notes[..] else { panic!("{:?}", loaded.notes) };
        assert!(
            note.contains(&format!("{fraction:.2} % of the terrain's area")) && note.contains(expected),
            "{note}"
        );
        assert_eq!(loaded.summary.outside_ortho, 96 * 96 - 400);
        assert_heights(&loaded, |column, row| beyond == Beyond::Void && !inside(column, row));
        // Colours in the centre of the image's pixel (3, 5), and outside of the image in every mip level.
        let texture = &loaded.terrain.texture;
        let uv_of_post = |column: u32, row: u32| {
            let [x, y] = [column, row].map(|n| n / 64);
            let vertex = loaded.terrain.chunks[(2 * y + x) as usize].first_vertex
                + (row - 64 * y) * (if x == 0 { 65 } else { 32 })
                + column
                - 64 * x;
            loaded.terrain.vertices[vertex as usize].uv
        };
        let pixel = |uv: [f32; 2], size: [u32; 2]| {
            [0, 1].map(|k| (uv[k] * size[k] as f32).clamp(0.0, size[k] as f32 - 1.0) as u32)
        };
        let [x, y] = pixel(uv_of_post(33, 45), texture.size_px);
        let stored =
            |bytes: &[u8], [x, y]: [u32; 2], width: u32| bytes[4 * (y * width + x) as usize..][..3].to_vec();
        assert_eq!(stored(&texture.rgba8, [x, y], texture.size_px[0]), [200, 30, 50]);
        if beyond == Beyond::Grey {
            assert_eq!(
                stored(&texture.rgba8, pixel(uv_of_post(0, 0), texture.size_px), texture.size_px[0]),
                [118; 3]
            );
            for level in texture.mips_with_border(TexelForm::Stored, loaded.terrain.beyond) {
                for post in [[0, 0], [95, 3], [5, 95], [95, 95]] {
                    assert_eq!(
                        stored(
                            &level.texels,
                            pixel(uv_of_post(post[0], post[1]), level.size_px),
                            level.size_px[0]
                        ),
                        [118; 3],
                        "{:?}",
                        level.size_px
                    );
                }
            }
        }
    }
}

#[test]
fn ortho_image_that_contains_the_dem_gets_no_margin() {
    let loaded = read(&with_ortho("ortho/o_mask.tif")).unwrap();
    assert_eq!(
        (loaded.terrain.texture.size_px, loaded.terrain.beyond, loaded.summary.ortho_uv),
        ([96, 96], None, [[0.0; 2], [1.0; 2]])
    );
    // Half of the image is masked.
    assert!(
        loaded.notes[0].contains("50.00 % of the terrain's area has no ortho-image and is grey"),
        "{:?}",
        loaded.notes
    );
    let loaded = read(&TerrainSpec { beyond: Beyond::Void, ..with_ortho("ortho/o_mask.tif") }).unwrap();
    assert_heights(&loaded, |column, _| column < 48);
}

#[test]
fn documentation_page_matches_the_tables() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/inputs/TERRAIN.md");
    let page = camsim_io::raster::documentation();
    if std::env::var_os("CAMSIM_BLESS").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &page).unwrap();
    }
    assert_eq!(
        std::fs::read_to_string(&path).unwrap_or_default(),
        page,
        "CAMSIM_BLESS=1 writes docs/reference/inputs/TERRAIN.md"
    );
}

/// Heights and colours of published terrains at three pixels each, compared with GDAL's.
#[test]
fn published_terrains_agree_with_gdal() {
    let Some(data) = std::env::var_os("CAMSIM_DATA").map(PathBuf::from) else {
        eprintln!("CAMSIM_DATA is not set: published terrains are not tested");
        return;
    };
    type Samples<T> = [([u32; 2], T); 3];
    type Case<'a> = (&'a str, Samples<f64>, Option<(&'a str, Samples<[u8; 3]>)>);
    let cases: [Case<'_>; 7] = [
        (
            "duebendorf/duebendorf.tif",
            [([145, 88], 468.063_659_7), ([218, 176], 486.052_612_3), ([429, 348], 464.626_892_1)],
            Some((
                "duebendorf/duebendorf_color.tif",
                [([145, 88], [125, 117, 88]), ([218, 176], [139, 130, 129]), ([429, 348], [144, 114, 116])],
            )),
        ),
        (
            "hinwil/hinwil.tif",
            [([120, 59], 535.931_030_3), ([180, 118], 536.607_055_7), ([353, 231], 540.106_567_4)],
            Some((
                "hinwil/hinwil_color.tif",
                [([120, 59], [163, 163, 129]), ([180, 118], [154, 155, 138]), ([353, 231], [58, 89, 74])],
            )),
        ),
        (
            "hinwil/hinwil_large_dem.tif",
            [([141, 83], 536.051_635_7), ([212, 166], 536.897_583), ([417, 328], 540.611_084)],
            None,
        ),
        (
            "bern/swissALTI3D_bern_2m.tif",
            [([333, 250], 558.060_119_6), ([500, 500], 620.913_024_9), ([993, 995], 604.958_313)],
            None,
        ),
        (
            "brighton_beach/brighton_beach_dsm_10cm.tif",
            [([355, 244], f64::NAN), ([532, 489], 162.520_004_3), ([1058, 973], f64::NAN)],
            Some(("brighton_beach/brighton_beach_rgb_10cm.tif", [([532, 489], [126, 146, 68]); 3])),
        ),
        (
            "jacksboro/jacksboro_fault_dem.tif",
            [([134, 86], 521.0), ([201, 172], 583.0), ([396, 339], 273.0)],
            None,
        ),
        (
            "sertig/sertig_valley.tif",
            [([213, 229], 1_754.481_567_4), ([320, 458], 1_918.926_147_5), ([634, 912], 2_560.678_222_7)],
            Some((
                "sertig/sertig_valley_color.tif",
                [([213, 229], [60, 99, 48]), ([320, 458], [83, 102, 68]), ([634, 912], [134, 128, 96])],
            )),
        ),
    ];
    for (dem, heights, colors) in cases {
        let ortho = colors.map(|(ortho, _)| data.join("terrain").join(ortho).into());
        let spec =
            TerrainSpec { dem: data.join("terrain").join(dem).into(), ortho, ..TerrainSpec::default() };
        let ned = |lat: f64, lon: f64, height: f64| DVec3::new((lat - 0.8) * 1e6, lon * 1e6, -height);
        let loaded = read_terrain(&spec, &ned, None).unwrap();
        for (pixel, expected) in heights {
            match height_m(&loaded, pixel) {
                None => assert!(expected.is_nan(), "{dem} {pixel:?}"),
                Some(height) => {
                    assert!((height - expected).abs() < 1e-3, "{dem} {pixel:?}: {height} {expected}")
                }
            }
        }
        for (pixel, expected) in colors.iter().flat_map(|(_, samples)| samples) {
            assert_eq!(color(&loaded, *pixel), *expected, "{dem} {pixel:?}");
        }
        eprintln!("{dem}: {:?}", loaded.notes);
    }
}
