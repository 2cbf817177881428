//! Ortho-images: encodings, bands, white level, orientation.

use camsim_core::scenario::TerrainSpec;
use camsim_io::raster::{LoadedTerrain, pictures::read_texture};

use super::{
    color, gdal_file, pixels,
    raster::{Tiff, Value},
    read, read_error, spec,
};

const GREY: [u8; 3] = [118; 3];

/// A terrain with an ortho-image made by GDAL.
fn with_ortho(name: &str) -> TerrainSpec {
    TerrainSpec { ortho: Some(gdal_file(name).into()), ..spec(&gdal_file("bigtiff.tif")) }
}

/// Asserts that every colour is (40 + 4 column, 30 + 4 row, 100) within a tolerance, or grey.
fn assert_colors(name: &str, tolerance: u8, is_void: impl Fn([u32; 2]) -> bool) -> LoadedTerrain {
    let loaded = read(&with_ortho(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(loaded.terrain.texture.size_px, [40, 30], "{name}");
    for pixel in pixels([40, 30]) {
        let expected =
            if is_void(pixel) { GREY } else { [40 + 4 * pixel[0] as u8, 30 + 4 * pixel[1] as u8, 100] };
        let color = color(&loaded, pixel);
        assert!(
            (0..3).all(|k| color[k].abs_diff(expected[k]) <= tolerance),
            "{name} {pixel:?}: {color:?} {expected:?}"
        );
    }
    loaded
}

#[test]
fn colours_are_equal_in_all_encodings() {
    for (name, tolerance) in
        [("planar_tiles", 0), ("planar_strips", 0), ("color_u16", 0), ("jpeg_rgb", 2), ("blue_first", 0)]
    {
        let loaded = assert_colors(&format!("{name}.tif"), tolerance, |_| false);
        assert!(loaded.notes.is_empty(), "{name}: {:?}", loaded.notes);
    }
    // 12 bits: the byte times 16, of 4095.
    assert_colors("color_u12.tif", 1, |_| false);
    // Premultiplied by an alpha of one half, and blended with grey.
    let loaded = read(&with_ortho("premultiplied.tif")).unwrap();
    let linear = |byte: f64| (byte / 255.0).powf(2.2);
    for (pixel, expected) in [([0, 0], [40.0, 30.0, 100.0]), ([39, 29], [196.0, 146.0, 100.0])] {
        let color = color(&loaded, pixel);
        for k in 0..3 {
            let mixed =
                255.0 * (128.0 / 255.0 * linear(expected[k]) + 127.0 / 255.0 * linear(118.0)).powf(1.0 / 2.2);
            assert!((f64::from(color[k]) - mixed).abs() < 4.0, "{pixel:?}: {color:?} {mixed}");
        }
    }
}

#[test]
fn transparent_and_nodata_pixels_are_grey() {
    assert_colors("webp_lossless_alpha.tif", 0, |[column, _]| column < 10);
    assert_colors("marked.tif", 0, |[column, _]| column < 10);
    let loaded = read(&with_ortho("palette.tif")).unwrap();
    assert_eq!(
        [5, 15, 25, 35].map(|column| color(&loaded, [column, 3])),
        [GREY, [200, 10, 20], [30, 210, 40], [50, 60, 220]]
    );
}

#[test]
fn bands_without_colour_are_reported() {
    let loaded = assert_colors("infrared.tif", 0, |_| false);
    assert!(loaded.notes[0].contains("its bands 4 are neither colours nor alpha"), "{:?}", loaded.notes);
    let loaded = assert_colors("unnamed_bands.tif", 0, |_| false);
    assert!(
        loaded.notes[0].contains("does not state which of its bands are red, green and blue"),
        "{:?}",
        loaded.notes
    );
    let error = read_error(&with_ortho("cmyk.tif"));
    assert!(error.contains("CMYK") && error.contains("gdal_translate -expand rgb"), "{error}");
}

/// Colour of pixel (1, 1) and notes of an ortho-image on the grid of a DEM of 4 x 3 posts.
fn read_ortho(tiff: Tiff, edit: impl FnOnce(&mut TerrainSpec)) -> Result<([u8; 3], Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let [dem, ortho] = ["dem.tif", "ortho.tif"].map(|name| folder.path().join(name));
    Tiff::heights([4, 3], |_, _| 100.0).write(&dem);
    tiff.write(&ortho);
    let mut spec = TerrainSpec { ortho: Some(ortho.into()), ..spec(&dem) };
    edit(&mut spec);
    read(&spec).map(|loaded| (color(&loaded, [1, 1]), loaded.notes)).map_err(|error| error.to_string())
}

#[test]
fn descriptions_against_the_colours_of_rgb_are_named() {
    for (names, note) in [
        (
            ["NIR", "Red", "Green"],
            Some("RGB by its photometric interpretation, but its bands are described as NIR"),
        ),
        (["Coastal", "Blue", "Green"], Some("described as Coastal, Blue, Green: the first three are used")),
        (["NIR1", "-", "-"], Some("described as NIR1")),
        (["Blue", "Green", "Red"], Some("red, green and blue are taken from bands 3, 2, 1")),
        (["Red", "Green", "Blue"], None),
        (["first", "second", "third"], None),
    ] {
        let items: String = (names.iter().enumerate())
            .map(|(band, name)| {
                format!(r#"<Item name="DESCRIPTION" sample="{band}" role="description">{name}</Item>"#)
            })
            .collect();
        let mut tiff = Tiff::pixels([4, 3], 3, 8, 1, 2, [200, 100, 50].repeat(12));
        tiff.keys = vec![1024, 1, 1025, 1, 3072, 32632];
        let (_, notes) =
            read_ortho(tiff.with_metadata(format!("<GDALMetadata>{items}</GDALMetadata>").leak()), |_| {})
                .unwrap();
        match note {
            Some(note) => assert!(notes.iter().any(|told| told.contains(note)), "{names:?}: {notes:?}"),
            None => assert!(notes.is_empty(), "{names:?}: {notes:?}"),
        }
    }
}

/// A grey image of one 16-bit value.
fn grey_16_bit(value: u16, photometric: u16) -> Tiff {
    let mut tiff = Tiff::pixels([4, 3], 1, 16, 1, photometric, value.to_le_bytes().repeat(12));
    tiff.keys = vec![1024, 1, 1025, 1, 3072, 32632];
    tiff
}

#[test]
fn white_level_is_the_full_range_or_ortho_white() {
    let (color, notes) = read_ortho(grey_16_bit(65535, 1), |_| {}).unwrap();
    assert!(color == [255; 3] && notes.is_empty(), "{color:?} {notes:?}");
    // Photometric interpretation 0: 0 is white.
    assert_eq!(read_ortho(grey_16_bit(65535, 0), |_| {}).unwrap().0, [0; 3]);
    assert_eq!(read_ortho(grey_16_bit(0, 0), |_| {}).unwrap().0, [255; 3]);
    let (color, notes) = read_ortho(grey_16_bit(4095, 1), |_| {}).unwrap();
    assert!(
        color == [16; 3]
            && notes[0].contains("reach only 4095 of 65535")
            && notes[0].contains("ortho_white = 4095"),
        "{notes:?}"
    );
    assert_eq!(
        read_ortho(grey_16_bit(4095, 1), |spec| spec.ortho_white = Some(4095.0)).unwrap(),
        ([255; 3], Vec::new())
    );
    // The key confirms the dark picture.
    assert_eq!(
        read_ortho(grey_16_bit(4095, 1), |spec| spec.ortho_white = Some(65535.0)).unwrap(),
        ([16; 3], Vec::new())
    );
    let spec = TerrainSpec { ortho_white: Some(100.0), ..with_ortho("palette.tif") };
    assert!(read(&spec).unwrap().notes[0].contains("ortho_white is ignored"));
    // The key does not apply to PNG files.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dark.png");
    image::ImageBuffer::<image::Rgb<u16>, _>::from_pixel(4, 3, image::Rgb([300u16, 2000, 9]))
        .save(&path)
        .unwrap();
    let spec = TerrainSpec { ortho: Some(path.into()), ..with_ortho("palette.tif") };
    let notes = read(&spec).unwrap().notes;
    assert!(
        notes[0].contains("reach only 2000 of 65535")
            && notes[0].contains("gdal_translate -ot Byte -scale 0 2047 0 255"),
        "{notes:?}"
    );
    assert!(read_error(&TerrainSpec { ortho_white: Some(100.0), ..spec }).contains("is for TIFF files"));
    let bytes = Tiff::colors([4, 3], 3, 2, |_, _, band| 50 + band as u8);
    assert_eq!(read_ortho(bytes, |spec| spec.ortho_white = Some(100.0)).unwrap().0, [128, 130, 133]);
}

#[test]
fn unsupported_pictures_are_refused() {
    let floats = Tiff::heights([4, 3], |_, _| 0.5);
    let error = read_ortho(floats, |_| {}).unwrap_err();
    assert!(error.contains("ortho.tif") && error.contains("gdal_translate -ot Byte -scale"), "{error}");
    for (photometric, expected) in [
        (5, "CMYK"),
        (8, "CIELab"),
        (6, "YCbCr colours without JPEG"),
        (32803, "photometric interpretation 32803"),
    ] {
        let error = read_ortho(Tiff::colors([4, 3], 4, photometric, |_, _, _| 9), |_| {}).unwrap_err();
        assert!(error.contains(expected) && error.contains("gdal_translate"), "{error}");
    }
    let error = read_ortho(Tiff::colors([4, 3], 2, 2, |_, _, _| 9), |_| {}).unwrap_err();
    assert!(error.contains("RGB colours need 3 bands, but there are 2"), "{error}");
    let error = read_ortho(
        Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with_keys(&[1024, 1, 1025, 1, 3072, 32767]),
        |_| {},
    )
    .unwrap_err();
    assert!(error.contains("ortho.tif: has a user-defined coordinate system"), "{error}");
    let error =
        read_ortho(Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with(258, Value::Short(vec![8, 8, 4])), |_| {})
            .unwrap_err();
    assert!(error.contains("its bands have different bits"), "{error}");
    let (color, notes) =
        read_ortho(Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with(50844, Value::Double(vec![1.0; 92])), |_| {})
            .unwrap();
    assert!(color == [9; 3] && notes[0].contains("RPC"), "{notes:?}");
    let (_, notes) =
        read_ortho(Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with(274, Value::Short(vec![3])), |_| {}).unwrap();
    assert!(notes[0].contains("its orientation"), "{notes:?}");
    let (_, notes) = read_ortho(
        Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with_metadata(
            r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">0.0001</Item></GDALMetadata>"#,
        ),
        |_| {},
    )
    .unwrap();
    assert!(notes[0].contains("scale 0.0001") && notes[0].contains("not applied to colours"), "{notes:?}");
}

/// Writes a JPEG, red on the left and blue on the right, with an EXIF orientation.
fn write_oriented_jpeg(path: &std::path::Path, orientation: u8) {
    let picture = image::RgbImage::from_fn(64, 32, |x, _| {
        if x < 32 { image::Rgb([220, 20, 20]) } else { image::Rgb([20, 20, 220]) }
    });
    let mut jpeg = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 95).encode_image(&picture).unwrap();
    let mut exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0]);
    let mut file = jpeg[..2].to_vec();
    file.extend([0xff, 0xe1]);
    file.extend((exif.len() as u16 + 2).to_be_bytes());
    file.extend(exif);
    file.extend(&jpeg[2..]);
    std::fs::write(path, file).unwrap();
}

#[test]
fn exif_orientation_is_applied_without_georeference() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("turned.jpg");
    let is_red = |rgba: &[u8]| rgba[0] > 150 && rgba[2] < 90;
    for (orientation, size, first_is_red) in
        [(1, [64, 32], true), (3, [64, 32], false), (6, [32, 64], true), (8, [32, 64], false)]
    {
        write_oriented_jpeg(&path, orientation);
        let texture = read_texture(&path, camsim_core::scene::Encoding::Srgb).unwrap();
        assert_eq!((texture.size_px, is_red(&texture.rgba8[..4])), (size, first_is_red), "{orientation}");
    }
    // With a georeference the orientation is ignored with a note.
    let dem = folder.path().join("dem.tif");
    Tiff::heights([64, 32], |_, _| 100.0).write(&dem);
    let spec = TerrainSpec { ortho: Some(path.into()), ..spec(&dem) };
    write_oriented_jpeg(&folder.path().join("turned.jpg"), 3);
    let loaded = read(&spec).unwrap();
    assert!(!is_red(&loaded.terrain.texture.rgba8[..4]) && loaded.notes.is_empty(), "{:?}", loaded.notes);
    std::fs::write(folder.path().join("turned.jgw"), "10 0 0 -10 500005 5199995").unwrap();
    let loaded = read(&spec).unwrap();
    assert!(
        is_red(&loaded.terrain.texture.rgba8[..4]) && loaded.notes[0].contains("its orientation (EXIF"),
        "{:?}",
        loaded.notes
    );
}
