//! Unusual and malformed RGB-D frames, vignettes and zoom tracks: each is read with the right values, or
//! refused with a message that names the key.

#![allow(clippy::unwrap_used)]

use std::{
    fs,
    io::Cursor,
    path::{Path, PathBuf},
};

use camsim_core::scene::linear_from_srgb;
use camsim_io::{
    frame_file::{FrameFile, read_frame, read_frame_set},
    load::load_sequence,
    raster::pictures::read_gray_image,
    scenario_file::parse_scenario,
};
use image::{DynamicImage, ImageFormat};

struct Folder(tempfile::TempDir);

impl Folder {
    /// A folder with a grey colour picture of 3x2 pixels, `c.png`.
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        image::RgbImage::from_pixel(3, 2, image::Rgb([9; 3])).save(folder.path("c.png")).unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.path(name), bytes).unwrap();
    }

    fn read(&self, text: &str) -> Result<FrameFile, String> {
        self.write("FRAME.toml", text.as_bytes());
        read_frame(&self.path("FRAME.toml")).map_err(|error| error.to_string())
    }

    fn depth(&self, depth: &str, more: &str) -> Result<Vec<f32>, String> {
        self.read(&format!("color = \"c.png\"\nfocal_px = [2, 2]\ndepth = \"{depth}\"\n{more}"))
            .map(|file| file.frame.inverse_depth)
    }

    fn color(&self, color: &str, more: &str) -> Result<FrameFile, String> {
        self.read(&format!("color = \"{color}\"\nfocal_px = [2, 2]\n{more}"))
    }
}

fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn npy(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes(), data].concat()
}

fn f32s(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Checks that a message contains all parts.
fn assert_contains(error: &str, parts: &[&str]) {
    assert!(parts.iter().all(|part| error.contains(part)), "{error}\n  lacks one of {parts:?}");
}

#[test]
fn npy_depth_of_any_type_and_order_is_read() {
    let folder = Folder::new();
    let expected = [1.0, 0.5, 0.25, 0.0, 2.0, 0.125];
    folder.write("a.npy", &npy("<f4", "False", "(2, 3)", &f32s(&[1.0, 2.0, 4.0, f32::NAN, 0.5, 8.0])));
    assert_eq!(folder.depth("a.npy", "").unwrap(), expected);
    folder.write("a.npy", &npy("<f4", "True", "(2, 3, 1)", &f32s(&[1.0, f32::INFINITY, 2.0, 0.5, 4.0, 8.0])));
    assert_eq!(folder.depth("a.npy", "").unwrap(), expected);
    let millimetres: Vec<u8> =
        [1000_u16, 2000, 4000, 0, 500, 8000].iter().flat_map(|value| value.to_be_bytes()).collect();
    folder.write("a.npy", &npy(">u2", "False", "(2, 3)", &millimetres));
    assert_contains(
        &folder.depth("a.npy", "").unwrap_err(),
        &["depth_per_metre: is missing", "1000 for millimetres"],
    );
    assert_eq!(folder.depth("a.npy", "depth_per_metre = 1000\n").unwrap(), expected);
    // Integers stored as floats are ambiguous too.
    folder
        .write("a.npy", &npy("<f4", "False", "(2, 3)", &f32s(&[1000.0, 2000.0, 4000.0, 0.0, 500.0, 8000.0])));
    assert_contains(
        &folder.depth("a.npy", "").unwrap_err(),
        &["depth_per_metre: is missing", "whole numbers from 500 to 8000", "1 for metres"],
    );
    assert_eq!(folder.depth("a.npy", "depth_per_metre = 1000\n").unwrap(), expected);
    assert_eq!(folder.depth("a.npy", "depth_per_metre = 1\n").unwrap()[0], 1e-3);
    folder.write("a.npy", &npy("<f4", "False", "(3, 2)", &f32s(&[1.0; 6])));
    assert_contains(&folder.depth("a.npy", "").unwrap_err(), &["a.npy: is 2x3, but the colour is 3x2"]);
    folder.write("a.npz", b"PK\x03\x04 whatever");
    assert_contains(
        &folder.depth("a.npz", "").unwrap_err(),
        &["a.npz: is an archive of arrays", "numpy.save"],
    );
    assert_contains(
        &folder.depth("a.npy", "depth_encoding = \"carla\"\n").unwrap_err(),
        &["depth_encoding: \"carla\" is of 8-bit RGB"],
    );
}

#[test]
fn range_and_inverse_depth_are_converted() {
    let folder = Folder::new();
    folder.write("a.npy", &npy("<f4", "False", "(2, 3)", &f32s(&[2.5; 6])));
    // The middle of the lower row is half a pixel below the axis: 0.25 of the focal length.
    let range = folder.depth("a.npy", "depth_kind = \"range\"\n").unwrap();
    assert!((f64::from(range[4]) - (1.0 + 0.25_f64.powi(2)).sqrt() / 2.5).abs() < 1e-7);
    // A disparity of 10 pixels at 400 px and 0.12 m: 4.8 m.
    folder.write("d.npy", &npy("<f4", "False", "(2, 3)", &f32s(&[10.0, 0.0, -1.0, 20.0, 40.0, 48.0])));
    assert_contains(
        &folder.depth("d.npy", "depth_kind = \"inverse\"\n").unwrap_err(),
        &["depth_per_metre: is missing", "baseline"],
    );
    let inverse_depth = folder.depth("d.npy", "depth_kind = \"inverse\"\ndepth_per_metre = 48\n").unwrap();
    for (w, depth_m) in inverse_depth.iter().zip([4.8, f64::INFINITY, f64::INFINITY, 2.4, 1.2, 1.0]) {
        assert!((f64::from(*w) - 1.0 / depth_m).abs() < 1e-7, "{inverse_depth:?}");
    }
    assert_eq!(
        folder.depth("d.npy", "depth_kind = \"inverse\"\ndepth_per_metre = 48\ndepth_max_m = 3\n").unwrap()
            [0],
        0.0
    );
}

#[test]
fn ambiguous_depth_pictures_are_refused() {
    let folder = Folder::new();
    let gray = DynamicImage::ImageLuma8(image::GrayImage::from_pixel(3, 2, image::Luma([7])));
    folder.write("g.png", &encoded(&gray, ImageFormat::Png));
    assert_contains(
        &folder.depth("g.png", "").unwrap_err(),
        &["g.png: is no 16-bit grey picture but an 8-bit one"],
    );
    let wide = DynamicImage::ImageRgb16(image::ImageBuffer::from_pixel(3, 2, image::Rgb([700, 8, 9])));
    folder.write("w.png", &encoded(&wide, ImageFormat::Png));
    assert_contains(
        &folder.depth("w.png", "depth_per_metre = 1000\n").unwrap_err(),
        &["w.png: is no 16-bit grey picture of one channel"],
    );
    let clear = DynamicImage::ImageLumaA16(image::ImageBuffer::from_pixel(3, 2, image::LumaA([700, 8])));
    folder.write("a.png", &encoded(&clear, ImageFormat::Png));
    assert_contains(
        &folder.depth("a.png", "depth_per_metre = 1000\n").unwrap_err(),
        &["a.png: is no 16-bit grey picture of one channel"],
    );
    let packed = DynamicImage::ImageRgba8(image::RgbaImage::from_pixel(3, 2, image::Rgba([92, 143, 2, 255])));
    folder.write("p.webp", &encoded(&packed, ImageFormat::WebP));
    assert_contains(
        &folder.depth("p.webp", "depth_encoding = \"carla\"\n").unwrap_err(),
        &["p.webp: is not lossless", "PNG, BMP or PPM"],
    );
    folder.write("p.png", &encoded(&packed, ImageFormat::Png));
    let inverse_depth = folder.depth("p.png", "depth_encoding = \"carla\"\n").unwrap();
    assert!((1.0 / f64::from(inverse_depth[0]) - 10.0).abs() < 1e-3);
    assert_contains(
        &folder.depth("p.png", "depth_encoding = \"carla\"\ndepth_per_metre = 1000\n").unwrap_err(),
        &["depth_per_metre: is for numbers"],
    );
    folder.write("d.pfm", &[b"Pf\n3 2\n-0\n".as_slice(), &f32s(&[1.0; 6])].concat());
    assert_contains(&folder.depth("d.pfm", "depth_rows = \"top-down\"\n").unwrap_err(), &["scale `-0`"]);
    folder.write("d.pfm", &[b"Pf\n3 2\n-2.5\n".as_slice(), &f32s(&[4.0; 6])].concat());
    assert_eq!(folder.depth("d.pfm", "depth_rows = \"top-down\"\n").unwrap(), [0.1; 6]);
}

#[test]
fn gdal_nodata_of_a_tiff_is_applied() {
    let folder = Folder::new();
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes).unwrap();
    let mut image = encoder.new_image::<tiff::encoder::colortype::Gray16>(3, 2).unwrap();
    image.encoder().write_tag(tiff::tags::Tag::GdalNodata, "65535").unwrap();
    image.write_data(&[1000, 2000, 4000, 65_535, 500, 8000]).unwrap();
    folder.write("d.tif", &bytes.into_inner());
    assert_eq!(folder.depth("d.tif", "depth_per_metre = 1000\n").unwrap(), [1.0, 0.5, 0.25, 0.0, 2.0, 0.125]);
}

#[test]
fn colour_of_16_bits_webp_and_tiff_is_read() {
    let folder = Folder::new();
    let deep =
        DynamicImage::ImageRgb16(image::ImageBuffer::from_pixel(3, 2, image::Rgb([32_768, 257, 65_535])));
    let expected = [32_768.0_f32 / 65_535.0, 1.0 / 255.0, 1.0].map(linear_from_srgb);
    for (name, format) in [("deep.png", ImageFormat::Png), ("deep.tif", ImageFormat::Tiff)] {
        folder.write(name, &encoded(&deep, format));
        let file = folder.color(name, "").unwrap();
        assert!(
            file.frame.color_rgba[..3].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6)
                && file.notes.is_empty(),
            "{name}"
        );
    }
    let plain = DynamicImage::ImageRgb8(image::RgbImage::from_pixel(3, 2, image::Rgb([10, 100, 200])));
    folder.write("plain.webp", &encoded(&plain, ImageFormat::WebP));
    let file = folder.color("plain.webp", "").unwrap();
    assert!(
        file.frame.color_rgba[..3].iter().zip([10.0, 100.0, 200.0]).all(|(a, b)| (a - linear_from_srgb(
            b / 255.0
        ))
        .abs()
            < 1e-6)
    );
    let floats =
        DynamicImage::ImageRgb32F(image::ImageBuffer::from_pixel(3, 2, image::Rgb([0.5, 2.0, 0.25])));
    folder.write("light.tif", &encoded(&floats, ImageFormat::Tiff));
    assert_contains(
        &folder.color("light.tif", "").unwrap_err(),
        &["color_space: is missing", "light.tif holds floats"],
    );
    assert_eq!(
        folder.color("light.tif", "color_space = \"linear\"\n").unwrap().frame.color_rgba[..3],
        [0.5, 2.0, 0.25]
    );
}

#[test]
fn colour_metadata_is_applied_or_noted() {
    let folder = Folder::new();
    let clear = DynamicImage::ImageRgba8(image::RgbaImage::from_fn(3, 2, |x, _| {
        image::Rgba([9, 9, 9, if x == 0 { 0 } else { 255 }])
    }));
    folder.write("clear.png", &encoded(&clear, ImageFormat::Png));
    let notes = folder.color("clear.png", "").unwrap().notes;
    assert_contains(
        &notes.join("\n"),
        &["clear.png: its alpha is not read: 33.3 % of the pixels are not opaque"],
    );
    // A gAMA chunk after IHDR: linear values.
    let png = encoded(
        &DynamicImage::ImageRgb8(image::RgbImage::from_pixel(3, 2, image::Rgb([9; 3]))),
        ImageFormat::Png,
    );
    let gamma = |value: u32| {
        let chunk = [b"gAMA".as_slice(), &value.to_be_bytes()].concat();
        let crc = crc32fast::hash(&chunk).to_be_bytes();
        [&png[..33], &4_u32.to_be_bytes(), &chunk, &crc, &png[33..]].concat()
    };
    folder.write("linear.png", &gamma(100_000));
    assert_contains(
        &folder.color("linear.png", "").unwrap_err(),
        &["color_space: is missing", "to the power of 1 (gAMA)"],
    );
    assert_eq!(
        folder.color("linear.png", "color_space = \"linear\"\n").unwrap().frame.color_rgba[0],
        9.0 / 255.0
    );
    folder.write("usual.png", &gamma(45_455));
    assert!(folder.color("usual.png", "").is_ok());
    // A JPEG with an EXIF orientation of a quarter turn.
    let jpeg = encoded(
        &DynamicImage::ImageRgb8(image::RgbImage::from_pixel(3, 2, image::Rgb([9; 3]))),
        ImageFormat::Jpeg,
    );
    let exif =
        [b"Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0".as_slice()].concat();
    let turned =
        [&jpeg[..2], &[0xff, 0xe1], &(exif.len() as u16 + 2).to_be_bytes(), &exif, &jpeg[2..]].concat();
    folder.write("turned.jpg", &turned);
    assert_contains(
        &folder.color("turned.jpg", "").unwrap_err(),
        &["turned.jpg: is stored turned (EXIF orientation 6)", "exiftool"],
    );
}

#[test]
fn exr_attributes_are_applied_or_noted() {
    use exr::prelude::*;
    let folder = Folder::new();
    let planes = |names: &[&str]| {
        let list = names.iter().map(|name| AnyChannel::new(*name, FlatSamples::F32(vec![0.5; 6])));
        AnyChannels::sort(list.collect())
    };
    let write = |name: &str, channels: &[&str], change: &dyn Fn(&mut ImageAttributes)| {
        let mut image = Image::from_channels((3, 2), planes(channels));
        change(&mut image.attributes);
        image.write().to_file(folder.path(name)).unwrap();
    };
    write("wide.exr", &["R", "G", "B"], &|attributes| attributes.pixel_aspect = 2.0);
    let warnings_of =
        |focal: &str| folder.read(&format!("color = \"wide.exr\"\nfocal_px = {focal}\n")).unwrap().notes;
    assert_contains(
        &warnings_of("[2, 2]").join("\n"),
        &["wide.exr: its header says that a pixel is 2 times as wide as high", "focal_px counts"],
    );
    assert!(warnings_of("[1, 2]").is_empty());
    write("aces.exr", &["R", "G", "B"], &|attributes| {
        let xy = |x: f32, y: f32| exr::math::Vec2(x, y);
        attributes.chromaticities = Some(attribute::Chromaticities {
            red: xy(0.7347, 0.2653),
            green: xy(0.0, 1.0),
            blue: xy(0.0001, -0.077),
            white: xy(0.32168, 0.33767),
        });
    });
    assert_contains(
        &folder.color("aces.exr", "").unwrap().notes.join("\n"),
        &["aces.exr: its chromaticities are not those of sRGB"],
    );
    write("inverse.exr", &["inv_depth"], &|_| {});
    assert_contains(
        &folder.depth("inverse.exr", "").unwrap_err(),
        &["inv_depth: is a disparity or an inverse depth by its name"],
    );
    assert_eq!(
        folder.depth("inverse.exr", "depth_kind = \"inverse\"\ndepth_per_metre = 1\n").unwrap(),
        [0.5; 6]
    );
    // A flow with another data window.
    write("flow.exr", &["X", "Y"], &|_| {});
    let mut moved = Image::from_channels((3, 2), planes(&["R", "G", "B"]));
    moved.layer_data.attributes.layer_position = exr::math::Vec2(5, 0);
    moved.write().to_file(folder.path("part.exr")).unwrap();
    let text =
        "color = \"part.exr\"\nfocal_px = [2, 2]\n[motion]\nflow = \"flow.exr\"\nflow_interval_ms = 40\n";
    assert_contains(
        &folder.read(text).unwrap_err(),
        &["flow.exr: begins at pixel [0, 0] of its file, the colour at [5, 0]"],
    );
}

#[test]
fn npy_flow_is_right_and_down() {
    let folder = Folder::new();
    let flow = |shape: &str, values: &[f32]| -> Result<Vec<[f32; 2]>, String> {
        folder.write("f.npy", &npy("<f4", "False", shape, &f32s(values)));
        let file = folder.color("c.png", "[motion]\nflow = \"f.npy\"\nflow_interval_ms = 40\n")?;
        match file.motion {
            camsim_core::apply::Motion::Flow(flow) => Ok(flow.px),
            other => panic!("{other:?}"),
        }
    };
    let values: Vec<f32> = (0..12).map(|k| k as f32).collect();
    // Of two rows: which axis is that of right and down is ambiguous.
    assert_contains(&flow("(2, 3, 2)", &values).unwrap_err(), &["f.npy: is a .npy file of shape [2, 3, 2]"]);
    assert_eq!(flow("(2, 2, 3)", &values).unwrap()[1], [1.0, 7.0]);
    assert_contains(&flow("(12,)", &values).unwrap_err(), &["f.npy: is a .npy file of shape [12]"]);
}

#[test]
fn frame_tables_must_state_the_unit_of_time() {
    let folder = Folder::new();
    let stamps = |table: &str| {
        folder.write("t.csv", table.as_bytes());
        folder.write("FRAME.toml", b"frames = \"t.csv\"\nfocal_px = [2, 2]\n");
        let set = read_frame_set(&folder.path("FRAME.toml")).map_err(|error| error.to_string())?;
        Ok::<_, String>((set.entries()[0].stamp_ns, set.notes().to_vec()))
    };
    for table in [
        "t_s,color\n2.5,c.png\n",
        "t_ms,color\n2500,c.png\n",
        "color,timestamp [us]\nc.png,2500000\n",
        "T_NS,color\n2500000000,c.png\n",
    ] {
        assert_eq!(stamps(table).unwrap(), (Some(2_500_000_000), Vec::new()), "{table}");
    }
    for (table, wanted) in [
        ("t,color\n2.5,c.png\n", "the column `t` does not say its unit"),
        ("timestamp,color\n2.5,c.png\n", "the column `timestamp` does not say its unit"),
        ("t_s,t_ms,color\n2.5,2500,c.png\n", "two columns of time, `t_s` and `t_ms`"),
        ("t_s,color,color\n2.5,c.png,c.png\n", "two columns color"),
        ("t_min,color\n2.5,c.png\n", "in minutes"),
    ] {
        assert_contains(&stamps(table).unwrap_err(), &["t.csv:1:", wanted]);
    }
    let (_, notes) = stamps("t_s,color,exposure_ms\n2.5,c.png,9\n").unwrap();
    assert_contains(&notes.join("\n"), &["t.csv: the columns exposure_ms are not read"]);
}

const SCENARIO: &str = "[flight]\nlog = \"log.csv\"\n[scene.board]\nkind = \"circles\"\ncolumns = 4\nrows = \
    3\nsize_m = 0.1\n\
                        [camera]\nsize_px = [40, 30]\nfocal_px = [40, 40]\nfps = 10\n";

fn warnings(folder: &Path, camera: &str) -> Result<Vec<String>, String> {
    let log = "t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg\n100,0,0,-50,0,0,0\n102,2,0,-50,0,0,0\n";
    fs::write(folder.join("log.csv"), log).unwrap();
    let scenario = parse_scenario(&format!("{SCENARIO}{camera}"), &folder.join("s.toml"), &[])
        .map_err(|error| error.to_string())?;
    load_sequence(&scenario).map(|loaded| loaded.warnings).map_err(|error| error.to_string())
}

#[test]
fn zoom_tracks_are_checked_for_units_and_coverage() {
    let folder = Folder::new();
    let zoom =
        "zoom_track = \"z.csv\"\nzoom = [{ at = 1, focal_px = [40, 40] }, { at = 2, focal_px = [80, 80] }]\n";
    let warnings_of = |table: &str| {
        folder.write("z.csv", table.as_bytes());
        warnings(folder.0.path(), zoom).map(|warnings| {
            warnings.into_iter().filter(|warning| warning.contains("zoom")).collect::<Vec<_>>().join("\n")
        })
    };
    for table in ["t_s,zoom\n100,1\n102,2\n", "\u{feff}t_ms,zoom\n100000,1\n102000,2\n"] {
        assert_eq!(warnings_of(table).unwrap(), "", "{table}");
    }
    assert_contains(
        &warnings_of("t_s,zoom\n0,1\n2,2\n").unwrap(),
        &["camera.zoom_track covers -100.000 s to -98.000 s", "one clock"],
    );
    assert_contains(
        &warnings_of("t_s,zoom\n100,1\n102,4\n").unwrap(),
        &["1 of 2 rows of camera.zoom_track are beyond", "1 to 4 where 1 to 2 are known"],
    );
    for (table, wanted) in [
        ("t,zoom\n100,1\n", "z.csv, line 1: the header is `t,zoom` and not `t_s,zoom`"),
        ("t_s,focal_mm\n100,35\n", "the header is `t_s,focal_mm`"),
        ("t_s,zoom,zoom\n100,1,2\n", "the header is `t_s,zoom,zoom`"),
        ("t_s,zoom\n100,1\n100,2\n", "z.csv, line 3: the row t_s = 100"),
        ("t_s,zoom\n100,x\n", "z.csv, line 2: `x` is no number"),
    ] {
        assert_contains(&warnings_of(table).unwrap_err(), &[wanted]);
    }
}

#[test]
fn suspicious_vignettes_are_warned_of_or_refused() {
    let folder = Folder::new();
    let warnings_of = |picture: &DynamicImage| {
        folder.write("v.png", &encoded(picture, ImageFormat::Png));
        let all = warnings(folder.0.path(), "[camera.photometric]\nvignette = \"v.png\"\n");
        all.map(|warnings| {
            warnings.into_iter().filter(|warning| warning.contains("vignette")).collect::<Vec<_>>()
        })
    };
    let gray16 = |size: [u32; 2], value: u16| {
        DynamicImage::ImageLuma16(image::ImageBuffer::from_pixel(size[0], size[1], image::Luma([value])))
    };
    assert!(warnings_of(&gray16([80, 60], 65_535)).unwrap().is_empty());
    assert_contains(
        &warnings_of(&gray16([80, 60], 4095)).unwrap().join("\n"),
        &["v.png: the brightest value of the vignette is 6.2 %", "fewer bits"],
    );
    assert_contains(
        &warnings_of(&gray16([80, 45], 65_535)).unwrap().join("\n"),
        &["the vignette is of 80x45 pixels and is stretched to the picture's 40x30"],
    );
    let clear =
        DynamicImage::ImageRgba8(image::RgbaImage::from_pixel(40, 30, image::Rgba([255, 255, 255, 9])));
    assert_contains(
        &warnings_of(&clear).unwrap_err(),
        &["v.png: cannot be decoded: grey values are wanted, and parts of it are transparent", "vignette"],
    );
    let read_gray_floats = |max: f32| {
        let floats = DynamicImage::ImageRgb32F(image::ImageBuffer::from_pixel(2, 1, image::Rgb([max; 3])));
        let mut bytes = Cursor::new(Vec::new());
        let values: Vec<f32> = floats.to_rgb32f().pixels().map(|pixel| pixel.0[0]).collect();
        tiff::encoder::TiffEncoder::new(&mut bytes)
            .unwrap()
            .write_image::<tiff::encoder::colortype::Gray32Float>(2, 1, &values)
            .unwrap();
        folder.write("v.tif", &bytes.into_inner());
        read_gray_image(&folder.path("v.tif")).map(|gray| gray.values).map_err(|error| error.to_string())
    };
    assert_eq!(read_gray_floats(0.75).unwrap(), [0.75; 2]);
    assert_contains(
        &read_gray_floats(200.0).unwrap_err(),
        &["v.tif: cannot be decoded: grey values of floats are 0 to 1, and the largest is 200"],
    );
}
