use camsim_core::scenario::TerrainSpec;
use camsim_io::{pictures::read_texture, terrain::LoadedTerrain};

use super::{
    by_gdal, color, fails, pixels,
    raster::{Tiff, Value},
    read, spec,
};

const GREY: [u8; 3] = [118; 3];

fn over(name: &str) -> TerrainSpec {
    TerrainSpec { ortho: Some(by_gdal(name)), ..spec(&by_gdal("bigtiff.tif")) }
}

fn assert_true(name: &str, most: u8, is_void: impl Fn([u32; 2]) -> bool) -> LoadedTerrain {
    let loaded = read(&over(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(loaded.terrain.texture.size_px, [40, 30], "{name}");
    for at in pixels([40, 30]) {
        let expected = if is_void(at) { GREY } else { [40 + 4 * at[0] as u8, 30 + 4 * at[1] as u8, 100] };
        let found = color(&loaded, at);
        assert!(
            (0..3).all(|k| found[k].abs_diff(expected[k]) <= most),
            "{name} {at:?}: {found:?} {expected:?}"
        );
    }
    loaded
}

#[test]
fn colours_are_the_same_however_they_are_stored() {
    for (name, most) in
        [("planar_tiles", 0), ("planar_strips", 0), ("color_u16", 0), ("jpeg_rgb", 2), ("blue_first", 0)]
    {
        let loaded = assert_true(&format!("{name}.tif"), most, |_| false);
        assert!(loaded.notes.is_empty(), "{name}: {:?}", loaded.notes);
    }
    // 12 bits: 16 times the byte of 4095.
    assert_true("color_u12.tif", 1, |_| false);
    // Byte by byte divided by alpha of a half, and on half of grey.
    let loaded = read(&over("premultiplied.tif")).unwrap();
    let light = |byte: f64| (byte / 255.0).powf(2.2);
    for (at, expected) in [([0, 0], [40.0, 30.0, 100.0]), ([39, 29], [196.0, 146.0, 100.0])] {
        let found = color(&loaded, at);
        for k in 0..3 {
            let mixed =
                255.0 * (128.0 / 255.0 * light(expected[k]) + 127.0 / 255.0 * light(118.0)).powf(1.0 / 2.2);
            assert!((f64::from(found[k]) - mixed).abs() < 4.0, "{at:?}: {found:?} {mixed}");
        }
    }
}

#[test]
fn alpha_and_marks_are_without_picture() {
    assert_true("webp_lossless_alpha.tif", 0, |[column, _]| column < 10);
    assert_true("marked.tif", 0, |[column, _]| column < 10);
    let loaded = read(&over("palette.tif")).unwrap();
    assert_eq!(
        [5, 15, 25, 35].map(|column| color(&loaded, [column, 3])),
        [GREY, [200, 10, 20], [30, 210, 40], [50, 60, 220]]
    );
}

#[test]
fn bands_that_are_no_colours_are_named() {
    let loaded = assert_true("infrared.tif", 0, |_| false);
    assert!(loaded.notes[0].contains("its bands 4 are neither colours nor alpha"), "{:?}", loaded.notes);
    let loaded = assert_true("unnamed_bands.tif", 0, |_| false);
    assert!(
        loaded.notes[0].contains("does not say which of its bands are red, green and blue"),
        "{:?}",
        loaded.notes
    );
    let error = fails(&over("cmyk.tif"));
    assert!(error.contains("CMYK") && error.contains("gdal_translate -expand rgb"), "{error}");
}

/// A picture of the same 4 x 3 pixels as the ground; what is seen at pixel (1, 1), and what is said.
fn made(tiff: Tiff, wish: impl FnOnce(&mut TerrainSpec)) -> Result<([u8; 3], Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let [dem, ortho] = ["dem.tif", "ortho.tif"].map(|name| folder.path().join(name));
    Tiff::heights([4, 3], |_, _| 100.0).write(&dem);
    tiff.write(&ortho);
    let mut spec = TerrainSpec { ortho: Some(ortho), ..spec(&dem) };
    wish(&mut spec);
    read(&spec).map(|loaded| (color(&loaded, [1, 1]), loaded.notes)).map_err(|error| error.to_string())
}

fn grey_words(value: u16, photometric: u16) -> Tiff {
    let mut tiff = Tiff::pixels([4, 3], 1, 16, 1, photometric, value.to_le_bytes().repeat(12));
    tiff.keys = vec![1024, 1, 1025, 1, 3072, 32632];
    tiff
}

#[test]
fn white_is_where_it_is_said_to_be() {
    let (found, notes) = made(grey_words(65535, 1), |_| {}).unwrap();
    assert!(found == [255; 3] && notes.is_empty(), "{found:?} {notes:?}");
    // 0 is white, also where fewer bits are used.
    assert_eq!(made(grey_words(65535, 0), |_| {}).unwrap().0, [0; 3]);
    assert_eq!(made(grey_words(0, 0), |_| {}).unwrap().0, [255; 3]);
    let (found, notes) = made(grey_words(4095, 1), |_| {}).unwrap();
    assert!(
        found == [16; 3]
            && notes[0].contains("end at 4095 of 65535")
            && notes[0].contains("ortho_white = 4095"),
        "{notes:?}"
    );
    assert_eq!(
        made(grey_words(4095, 1), |spec| spec.ortho_white = Some(4095.0)).unwrap(),
        ([255; 3], Vec::new())
    );
    // Asked to be as dark as this.
    assert_eq!(
        made(grey_words(4095, 1), |spec| spec.ortho_white = Some(65535.0)).unwrap(),
        ([16; 3], Vec::new())
    );
    let spec = TerrainSpec { ortho_white: Some(100.0), ..over("palette.tif") };
    assert!(read(&spec).unwrap().notes[0].contains("ortho_white is not used"));
    // PNG files have no such key.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dark.png");
    image::ImageBuffer::<image::Rgb<u16>, _>::from_pixel(4, 3, image::Rgb([300u16, 2000, 9]))
        .save(&path)
        .unwrap();
    let spec = TerrainSpec { ortho: Some(path), ..over("palette.tif") };
    let notes = read(&spec).unwrap().notes;
    assert!(
        notes[0].contains("end at 2000 of 65535")
            && notes[0].contains("gdal_translate -ot Byte -scale 0 2047 0 255"),
        "{notes:?}"
    );
    assert!(fails(&TerrainSpec { ortho_white: Some(100.0), ..spec }).contains("is for TIFF files"));
    let bytes = Tiff::colors([4, 3], 3, 2, |_, _, band| 50 + band as u8);
    assert_eq!(made(bytes, |spec| spec.ortho_white = Some(100.0)).unwrap().0, [128, 130, 133]);
}

#[test]
fn pictures_that_are_none_are_refused() {
    let floats = Tiff::heights([4, 3], |_, _| 0.5);
    let error = made(floats, |_| {}).unwrap_err();
    assert!(error.contains("ortho.tif") && error.contains("gdal_translate -ot Byte -scale"), "{error}");
    for (photometric, says) in [
        (5, "CMYK"),
        (8, "CIELab"),
        (6, "YCbCr colours without JPEG"),
        (32803, "photometric interpretation 32803"),
    ] {
        let error = made(Tiff::colors([4, 3], 4, photometric, |_, _, _| 9), |_| {}).unwrap_err();
        assert!(error.contains(says) && error.contains("gdal_translate"), "{error}");
    }
    let error = made(Tiff::colors([4, 3], 2, 2, |_, _, _| 9), |_| {}).unwrap_err();
    assert!(error.contains("RGB colours of 2 bands"), "{error}");
    let error =
        made(Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with_keys(&[1024, 1, 1025, 1, 3072, 32767]), |_| {})
            .unwrap_err();
    assert!(error.contains("ortho.tif: defines a coordinate system of its own"), "{error}");
    let error = made(Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with(258, Value::Short(vec![8, 8, 4])), |_| {})
        .unwrap_err();
    assert!(error.contains("its bands have different bits"), "{error}");
    let (found, notes) =
        made(Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with(50844, Value::Double(vec![1.0; 92])), |_| {})
            .unwrap();
    assert!(found == [9; 3] && notes[0].contains("RPC"), "{notes:?}");
    let (_, notes) =
        made(Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with(274, Value::Short(vec![3])), |_| {}).unwrap();
    assert!(notes[0].contains("its orientation"), "{notes:?}");
    let (_, notes) = made(
        Tiff::colors([4, 3], 3, 2, |_, _, _| 9).with_metadata(
            r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">0.0001</Item></GDALMetadata>"#,
        ),
        |_| {},
    )
    .unwrap();
    assert!(notes[0].contains("scale 0.0001") && notes[0].contains("not applied to colours"), "{notes:?}");
}

/// Two pixels, red and blue, of a JPEG that says that its right side is the top.
fn turned_jpeg(path: &std::path::Path, orientation: u8) {
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
fn pictures_are_turned_as_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("turned.jpg");
    let is_red = |rgba: &[u8]| rgba[0] > 150 && rgba[2] < 90;
    for (orientation, size, first_is_red) in
        [(1, [64, 32], true), (3, [64, 32], false), (6, [32, 64], true), (8, [32, 64], false)]
    {
        turned_jpeg(&path, orientation);
        let texture = read_texture(&path, camsim_core::scene::Encoding::Srgb).unwrap();
        assert_eq!((texture.size_px, is_red(&texture.rgba8[..4])), (size, first_is_red), "{orientation}");
    }
    // With a place its rows lie where that says, and it is said.
    let dem = folder.path().join("dem.tif");
    Tiff::heights([64, 32], |_, _| 100.0).write(&dem);
    let spec = TerrainSpec { ortho: Some(path), ..spec(&dem) };
    turned_jpeg(&folder.path().join("turned.jpg"), 3);
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
