#![allow(clippy::unwrap_used)]

use std::fs;

use tiff::encoder::{TiffEncoder, colortype};

use crate::frame_file::{FrameFile, read_frame};

/// 3x2 metres, row by row from the top.
const DEPTH_M: [f32; 6] = [1.0, 2.0, f32::NAN, 4.0, f32::INFINITY, 65_504.0];
/// The inverse depth that is read from them.
const INVERSE: [f32; 6] = [1.0, 0.5, 0.0, 0.25, 0.0, 1.0 / 65_504.0];

/// A PFM of these rows, from the first that is stored.
fn pfm(head: &str, rows: &[f32], bytes: fn(f32) -> [u8; 4]) -> Vec<u8> {
    head.bytes().chain(rows.iter().flat_map(|value| bytes(*value))).collect()
}

/// Reads a FRAME.toml of `text` beside a picture of 3x2 pixels and `d.EXT` of these bytes.
fn read(name: &str, depth: &[u8], text: &str) -> Result<FrameFile, String> {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::from_pixel(3, 2, image::Rgb([9; 3])).save(folder.path().join("c.png")).unwrap();
    fs::write(folder.path().join(name), depth).unwrap();
    let path = folder.path().join("FRAME.toml");
    fs::write(&path, format!("color = \"c.png\"\ndepth = \"{name}\"\nfocal_px = [2, 2]\n{text}")).unwrap();
    read_frame(&path).map_err(|error| error.to_string())
}

fn inverse(name: &str, depth: &[u8], text: &str) -> Vec<f32> {
    read(name, depth, text).unwrap().frame.inverse_depth
}

#[test]
fn pfm_rows_follow_depth_rows() {
    let top_down = pfm("Pf\n3 2\n-1.000000\n", &DEPTH_M, f32::to_le_bytes);
    assert_eq!(inverse("d.pfm", &top_down, "depth_rows = \"top-down\"\n"), INVERSE);
    let turned = [&DEPTH_M[3..], &DEPTH_M[..3]].concat();
    // The other byte order, other white space, and a byte that looks like white space where numbers begin.
    let bottom_up = pfm("Pf 3\t2\r\n 1\n", &turned, f32::to_be_bytes);
    assert_eq!(inverse("d.dat", &bottom_up, "depth_rows = \"bottom-up\"\n"), INVERSE);
    let mut tenth = top_down.clone();
    tenth[17..21].copy_from_slice(&[b'\n', 0, 0, 0x40]);
    assert_eq!(
        inverse("d.pfm", &tenth, "depth_rows = \"top-down\"\n")[0],
        1.0 / f32::from_le_bytes([b'\n', 0, 0, 0x40])
    );
}

#[test]
fn depth_max_m_marks_the_sky() {
    let file = |text: &str| {
        let text = format!("depth_rows = \"top-down\"\n{text}");
        read("d.pfm", &pfm("Pf\n3 2\n-1\n", &DEPTH_M, f32::to_le_bytes), &text).unwrap()
    };
    assert_eq!(
        file("depth_max_m = 65504\nholes = \"mark\"\n").frame.holes,
        [false, false, true, false, true, true]
    );
    assert!(!file("depth_max_m = 65504.5\nholes = \"mark\"\n").frame.holes[5]);
    assert_eq!(file("depth_max_m = 4\n").frame.inverse_depth, [1.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
    // Blender's background is no depth even without the key.
    let blender = pfm("Pf\n3 2\n-1\n", &[1e10, 1e9, 9e8, 1.0, 1.0, 1.0], f32::to_le_bytes);
    let inverse_depth = inverse("d.pfm", &blender, "depth_rows = \"top-down\"\n");
    assert_eq!((inverse_depth[0], inverse_depth[1], inverse_depth[2] > 0.0), (0.0, 0.0, true));
}

/// A TIFF of 3x2 samples.
fn tiff<C: colortype::ColorType>(values: &[C::Inner]) -> Vec<u8>
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut bytes = std::io::Cursor::new(Vec::new());
    TiffEncoder::new(&mut bytes).unwrap().write_image::<C>(3, 2, values).unwrap();
    bytes.into_inner()
}

#[test]
fn tiff_depth_is_float_metres_or_scaled_integers() {
    assert_eq!(inverse("d.tiff", &tiff::<colortype::Gray32Float>(&DEPTH_M), ""), INVERSE);
    let millimetres = [1000, 2000, 0, 4000, 0, 65_535];
    let inverse_depth = inverse(
        "d.tif",
        &tiff::<colortype::Gray16>(&millimetres),
        "depth_per_metre = 1000\ndepth_max_m = 65\n",
    );
    assert_eq!(inverse_depth, [1.0, 0.5, 0.0, 0.25, 0.0, 0.0]);
}

#[test]
fn unusable_depth_files_are_refused() {
    let good = pfm("Pf\n3 2\n-1\n", &DEPTH_M, f32::to_le_bytes);
    let rows = "depth_rows = \"top-down\"\n";
    let floats = tiff::<colortype::Gray32Float>(&DEPTH_M);
    let with_header = |head: &str| pfm(head, &DEPTH_M, f32::to_le_bytes);
    for (name, bytes, text, wanted) in [
        ("d.pfm", good.clone(), "", "depth_rows: is missing: a PFM begins with the bottom row"),
        ("d.pfm", good[..30].to_vec(), rows, "d.pfm: says 3x2 pixels and holds 20 bytes"),
        ("d.pfm", good[..8].to_vec(), rows, "d.pfm: is a PFM that ends within its header"),
        ("d.pfm", with_header("PF\n1 2\n-1\n"), rows, "three channels"),
        ("d.pfm", with_header("Pf\n3 -2\n-1\n"), rows, "`3` by `-2` pixels"),
        (
            "d.pfm",
            with_header("Pf\n4294967295 4294967295\n-1\n"),
            rows,
            "4294967295x4294967295 pixels and holds 24 bytes",
        ),
        ("d.pfm", with_header("Pf\n3 2\n0\n"), rows, "scale `0`"),
        ("d.pfm", with_header("Pf\n2 3\n-1\n"), rows, "is 2x3, but the colour is 3x2"),
        ("d.pfm", good.clone(), "depth_rows = \"down\"\n", "top-down"),
        (
            "d.pfm",
            good.clone(),
            "depth_rows = \"top-down\"\ndepth_per_metre = 1e7\n",
            "depth_per_metre: must be 0.001 to 1e6",
        ),
        (
            "d.pfm",
            good.clone(),
            "depth_rows = \"top-down\"\ndepth_encoding = \"packed24\"\n",
            "depth_encoding: \"packed24\" is of 8-bit RGB",
        ),
        (
            "d.pfm",
            good.clone(),
            "depth_rows = \"top-down\"\ndepth_channel = \"Z\"\n",
            "depth_channel: is for EXR",
        ),
        (
            "d.pfm",
            good.clone(),
            "depth_rows = \"top-down\"\ndepth_max_m = 0\n",
            "depth_max_m: must be above 0",
        ),
        (
            "d.pfm",
            good.clone(),
            "depth_rows = \"top-down\"\ndepth_max_m = nan\n",
            "depth_max_m: must be above 0",
        ),
        ("d.tif", floats.clone(), rows, "depth_rows: is for PFM, and depth is none"),
        ("d.tif", floats[..40].to_vec(), "", "d.tif: cannot be decoded"),
        ("d.tif", tiff::<colortype::Gray16>(&[1; 6]), "", "depth_per_metre: is missing"),
        ("d.tif", tiff::<colortype::Gray8>(&[1; 6]), "", "not of one channel of floats or 16-bit"),
        ("d.tif", tiff::<colortype::RGB32Float>(&[1.0; 18]), "", "not of one channel"),
    ] {
        let error = read(name, &bytes, text).unwrap_err();
        assert!(error.contains(wanted), "{text}\n  gives {error}\n  not   {wanted}");
    }
}

/// A TIFF of six floats of 3x2 with GDAL's metadata.
fn with_items(value: f32, items: &str) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    let mut image = encoder.new_image::<colortype::Gray32Float>(3, 2).unwrap();
    let text = format!("<GDALMetadata>{items}</GDALMetadata>");
    image.encoder().write_tag(tiff::tags::Tag::Unknown(42112), text.as_str()).unwrap();
    image.write_data(&[value; 6]).unwrap();
    bytes.into_inner()
}

#[test]
fn tiff_scale_offset_and_unit_are_applied_or_refused() {
    let scale = "<Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.001</Item>";
    let offset = "<Item name=\"OFFSET\" sample=\"0\" role=\"offset\">1</Item>";
    let feet = "<Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item>";
    let px = "<Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">px</Item>";
    for (value, items, text, depth_m) in [
        (2000.0, scale.to_owned(), "", 2.0),
        (2000.0, scale.to_owned(), "depth_per_metre = 1000\n", 2.0),
        (1000.0, format!("{scale}{offset}"), "", 2.0),
        (10.0, feet.to_owned(), "", 3.048),
        (2000.0, px.to_owned(), "depth_per_metre = 1000\n", 2.0),
    ] {
        let inverse_depth = inverse("d.tif", &with_items(value, &items), text)[0];
        assert!((f64::from(inverse_depth) * depth_m - 1.0).abs() < 1e-6, "{items} {text}: {inverse_depth}");
    }
    let notes = read("d.tif", &with_items(2000.0, scale), "").unwrap().notes;
    assert!(notes[0].contains("SCALE 0.001"), "{notes:?}");
    for (items, text, wanted) in [
        (scale, "depth_per_metre = 1\n", "depth_per_metre: is 1, but"),
        (offset, "depth_per_metre = 1000\n", "OFFSET 1"),
        (px, "", "UNITTYPE `px`"),
        (feet, "depth_kind = \"inverse\"\ndepth_per_metre = 1\n", "depth_kind: is \"inverse\", but"),
        // A constant depth is ambiguous too.
        (
            "",
            "",
            "depth_per_metre: is missing: depth is of floats, which are metres, but all of them are whole \
                numbers from 2000",
        ),
    ] {
        let error = read("d.tif", &with_items(2000.0, items), text).unwrap_err();
        assert!(error.contains(wanted), "{error}\n  not {wanted}");
    }
}

#[test]
fn masked_pixels_of_a_tiff_have_no_depth() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::from_pixel(3, 2, image::Rgb([9; 3])).save(folder.path().join("c.png")).unwrap();
    fs::write(folder.path().join("d.tif"), tiff::<colortype::Gray32Float>(&[2.0; 6])).unwrap();
    fs::write(folder.path().join("d.tif.msk"), tiff::<colortype::Gray8>(&[255, 0, 255, 255, 255, 0]))
        .unwrap();
    let path = folder.path().join("FRAME.toml");
    fs::write(&path, "color = \"c.png\"\ndepth = \"d.tif\"\nfocal_px = [2, 2]\n").unwrap();
    assert_eq!(read_frame(&path).unwrap().frame.inverse_depth, [0.5, 0.0, 0.5, 0.5, 0.5, 0.0]);
}

#[test]
fn png_chunks_are_noted_or_require_color_space() {
    let folder = tempfile::tempdir().unwrap();
    let in_folder = |name: &str| folder.path().join(name);
    image::RgbImage::from_pixel(3, 2, image::Rgb([9; 3])).save(in_folder("c.png")).unwrap();
    image::ImageBuffer::<image::Luma<u16>, _>::from_raw(3, 2, vec![2000_u16; 6])
        .unwrap()
        .save(in_folder("d.png"))
        .unwrap();
    let [color, depth] = ["c.png", "d.png"].map(|name| fs::read(in_folder(name)).unwrap());
    let with = |png: &[u8], kind: &[u8], data: &[u8]| {
        let chunk = [kind, data].concat();
        let crc = crc32fast::hash(&chunk).to_be_bytes();
        [&png[..33], &(data.len() as u32).to_be_bytes(), &chunk, &crc, &png[33..]].concat()
    };
    let path = in_folder("FRAME.toml");
    let read = |color: &[u8], depth: &[u8], text: &str| {
        fs::write(in_folder("c.png"), color).unwrap();
        fs::write(in_folder("d.png"), depth).unwrap();
        fs::write(
            &path,
            format!(
                "color = \"c.png\"\ndepth = \"d.png\"\ndepth_per_metre = 1000\nfocal_px = [2, 2]\n{text}"
            ),
        )
        .unwrap();
        read_frame(&path).map(|file| file.notes).map_err(|error| error.to_string())
    };
    let pq = with(&color, b"cICP", &[9, 16, 0, 1]);
    assert!(read(&pq, &depth, "").unwrap_err().contains("color_space: is missing"));
    assert!(read(&pq, &depth, "color_space = \"srgb\"\n").unwrap()[0].contains("cICP [9, 16, 0, 1]"));
    assert!(
        read(&with(&color, b"cICP", &[12, 13, 0, 1]), &depth, "").unwrap()[0].contains("cICP [12, 13, 0, 1]")
    );
    assert!(read(&with(&color, b"cICP", &[1, 13, 0, 1]), &depth, "").unwrap().is_empty());
    let wide: Vec<u8> = [31_270_u32, 32_900, 70_800, 29_200, 17_000, 79_700, 13_100, 4_600]
        .iter()
        .flat_map(|v| v.to_be_bytes())
        .collect();
    assert!(read(&with(&color, b"cHRM", &wide), &depth, "").unwrap()[0].contains("cHRM"));
    assert!(read(&color, &with(&depth, b"sBIT", &[12]), "").unwrap()[0].contains("its sBIT is not applied"));
    let twelve = image::ImageBuffer::<image::Rgb<u16>, _>::from_pixel(3, 2, image::Rgb([4095_u16, 9, 9]));
    twelve.save(in_folder("twelve.png")).unwrap();
    let notes = read(&fs::read(in_folder("twelve.png")).unwrap(), &depth, "").unwrap();
    assert!(notes[0].contains("end at 4095 of 65535") && notes[0].contains("If white is 4095"), "{notes:?}");
}
