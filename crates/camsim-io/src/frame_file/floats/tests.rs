#![allow(clippy::unwrap_used)]

use std::fs;

use tiff::encoder::{TiffEncoder, colortype};

use crate::frame_file::{FrameFile, read_frame};

/// 3x2 metres, row by row from the top.
const DEPTH_M: [f32; 6] = [1.0, 2.0, f32::NAN, 4.0, f32::INFINITY, 65_504.0];
/// What they are read as.
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
fn rows_of_a_pfm_come_in_the_order_that_is_said() {
    let top_down = pfm("Pf\n3 2\n-1.000000\n", &DEPTH_M, f32::to_le_bytes);
    assert_eq!(inverse("d.pfm", &top_down, "depth_rows = \"top-down\"\n"), INVERSE);
    let turned = [&DEPTH_M[3..], &DEPTH_M[..3]].concat();
    // The other byte order, other white space, and a byte that looks like white space where numbers begin.
    let bottom_up = pfm("Pf 3\t2\r\n 1\n", &turned, f32::to_be_bytes);
    assert_eq!(inverse("d.dat", &bottom_up, "depth_rows = \"bottom-up\"\n"), INVERSE);
    let mut tenth = top_down.clone();
    tenth[17..21].copy_from_slice(&[b'\n', 0, 0, 0x40]);
    assert_eq!(inverse("d.pfm", &tenth, "depth_rows = \"top-down\"\n")[0], 1.0 / f32::from_le_bytes([b'\n', 0, 0, 0x40]));
}

#[test]
fn what_stands_for_the_sky_is_said() {
    let file = |text: &str| {
        let text = format!("depth_rows = \"top-down\"\n{text}");
        read("d.pfm", &pfm("Pf\n3 2\n-1\n", &DEPTH_M, f32::to_le_bytes), &text).unwrap()
    };
    assert_eq!(file("depth_max_m = 65504\nholes = \"mark\"\n").frame.holes, [false, false, true, false, true, true]);
    assert!(!file("depth_max_m = 65504.5\nholes = \"mark\"\n").frame.holes[5]);
    assert_eq!(file("depth_max_m = 4\n").frame.inverse_depth, [1.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
    // Blender's background, whatever is said.
    let blender = pfm("Pf\n3 2\n-1\n", &[1e10, 1e9, 9e8, 1.0, 1.0, 1.0], f32::to_le_bytes);
    let found = inverse("d.pfm", &blender, "depth_rows = \"top-down\"\n");
    assert_eq!((found[0], found[1], found[2] > 0.0), (0.0, 0.0, true));
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
fn tiffs_are_metres_or_whole_numbers() {
    assert_eq!(inverse("d.tiff", &tiff::<colortype::Gray32Float>(&DEPTH_M), ""), INVERSE);
    let millimetres = [1000, 2000, 0, 4000, 0, 65_535];
    let found = inverse("d.tif", &tiff::<colortype::Gray16>(&millimetres), "depth_per_metre = 1000\ndepth_max_m = 65\n");
    assert_eq!(found, [1.0, 0.5, 0.0, 0.25, 0.0, 0.0]);
}

#[test]
fn what_is_wrong_with_a_depth_is_said() {
    let good = pfm("Pf\n3 2\n-1\n", &DEPTH_M, f32::to_le_bytes);
    let rows = "depth_rows = \"top-down\"\n";
    let floats = tiff::<colortype::Gray32Float>(&DEPTH_M);
    let of = |head: &str| pfm(head, &DEPTH_M, f32::to_le_bytes);
    for (name, bytes, text, wanted) in [
        ("d.pfm", good.clone(), "", "depth_rows: is missing: a PFM begins with the bottom row"),
        ("d.pfm", good[..30].to_vec(), rows, "d.pfm: says 3x2 pixels and holds 20 bytes"),
        ("d.pfm", good[..8].to_vec(), rows, "d.pfm: is a PFM that ends within its header"),
        ("d.pfm", of("PF\n1 2\n-1\n"), rows, "three channels"),
        ("d.pfm", of("Pf\n3 -2\n-1\n"), rows, "`3` by `-2` pixels"),
        ("d.pfm", of("Pf\n4294967295 4294967295\n-1\n"), rows, "4294967295x4294967295 pixels and holds 24 bytes"),
        ("d.pfm", of("Pf\n3 2\n0\n"), rows, "scale `0`"),
        ("d.pfm", of("Pf\n2 3\n-1\n"), rows, "is 2x3, but the colour is 3x2"),
        ("d.pfm", good.clone(), "depth_rows = \"down\"\n", "top-down"),
        ("d.pfm", good.clone(), "depth_rows = \"top-down\"\ndepth_per_metre = 1e7\n", "depth_per_metre: must be 0.001 to 1e6"),
        (
            "d.pfm",
            good.clone(),
            "depth_rows = \"top-down\"\ndepth_encoding = \"packed24\"\n",
            "depth_encoding: \"packed24\" is of 8-bit RGB",
        ),
        ("d.pfm", good.clone(), "depth_rows = \"top-down\"\ndepth_channel = \"Z\"\n", "depth_channel: is for EXR"),
        ("d.pfm", good.clone(), "depth_rows = \"top-down\"\ndepth_max_m = 0\n", "depth_max_m: must be above 0"),
        ("d.pfm", good.clone(), "depth_rows = \"top-down\"\ndepth_max_m = nan\n", "depth_max_m: must be above 0"),
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
