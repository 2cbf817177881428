#![allow(clippy::unwrap_used, reason = "tests")]

use std::{fs, path::Path};

use camsim_core::{
    frame::{Plane, PlaneValues, RenderedFrame, RowRecord},
    pose::{BodyState, CameraPose},
    scenario::{Channel, ExrCompression, ExrPixel, ImageFormat, OutputEncoding, OutputSpec},
    scene::{SceneObject, srgb_from_linear_f64},
};
use exr::prelude::read_first_flat_layer_from_file;
use glam::{DQuat, DVec3};

use super::*;
use crate::columns::CameraState;

const SIZE: [u32; 2] = [33, 21];

fn frame(index: u64) -> RenderedFrame {
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let light = |i| if i % 4 == 3 { f32::from(u8::from(i % 8 == 3)) } else { (i % 97) as f32 / 96.0 };
    RenderedFrame {
        index,
        stamp_ns: 1_400_000_000_000_000_123,
        size_px: SIZE,
        planes: vec![
            Plane::color((0..pixels * 4).map(light).collect()),
            Plane::depth((0..pixels).map(|i| i as f32 * 1.25).collect()),
            Plane::coords((0..pixels).map(|i| std::array::from_fn(|c| (i * 8 + c) as f32 * 0.1)).collect()),
        ],
        rows: vec![RowRecord {
            exposure_ns: 0,
            row: 0,
            t_mid_ns: -5,
            position_ned_m: DVec3::new(0.1, 2.0, -3.0),
            ned_from_camera: DQuat::IDENTITY,
            velocity_ned_m_s: DVec3::X,
        }],
    }
}

fn everything(pixel: ExrPixel, compression: ExrCompression) -> OutputSpec {
    OutputSpec {
        channels: vec![
            Channel::Color,
            Channel::Depth,
            Channel::Valid,
            Channel::Rows,
            Channel::Coords,
            Channel::Color,
        ],
        format: vec![ImageFormat::Exr, ImageFormat::Png],
        exr_pixel: pixel,
        exr_compression: compression,
        ..OutputSpec::default()
    }
}

fn read_exr(path: &Path) -> Vec<(String, Vec<f32>)> {
    let image = read_first_flat_layer_from_file(path).unwrap();
    assert_eq!([image.layer_data.size.0 as u32, image.layer_data.size.1 as u32], SIZE);
    image
        .layer_data
        .channel_data
        .list
        .iter()
        .map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect()))
        .collect()
}

fn files_below(folder: &Path) -> Vec<String> {
    let mut all: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .flat_map(|entry| {
            let path = entry.unwrap().path();
            if path.is_dir() {
                files_below(&path)
            } else {
                vec![path.file_name().unwrap().to_string_lossy().into_owned()]
            }
        })
        .collect();
    all.sort();
    all
}

#[test]
fn all_channels_read_back_in_all_compressions() {
    for (pixel, compression, tolerance) in [
        (ExrPixel::Float, ExrCompression::None, 0.0),
        (ExrPixel::Float, ExrCompression::Zip1, 0.0),
        (ExrPixel::Float, ExrCompression::Zip16, 0.0),
        (ExrPixel::Float, ExrCompression::Piz, 0.0),
        // Half has 11 bits of mantissa: half a unit of the last place below 1.
        (ExrPixel::Half, ExrCompression::Rle, 0.5_f32.powi(12)),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let files = FrameFiles::new(dir.path(), &everything(pixel, compression), OutputEncoding::Srgb8);
        assert!(!files.exist(7));
        let mut writer = FrameWriter::new(files.clone(), 2);
        for index in 0..9 {
            writer.write(frame(index)).unwrap();
        }
        assert_eq!(writer.finish().unwrap().frames, 9);
        assert!(files.exist(7) && !files.exist(9));
        assert_eq!(files_below(dir.path()).len(), 9 * 6);

        let frame = frame(7);
        let color = read_exr(&dir.path().join("color/frame_000007.exr"));
        assert_eq!(color.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["A", "B", "G", "R"]);
        for (name, values) in &color {
            let channel = ["R", "G", "B", "A"].iter().position(|n| n == name).unwrap();
            for (read, pixel) in values.iter().zip(frame.color_rgba().chunks_exact(4)) {
                assert!((read - pixel[channel]).abs() <= tolerance);
            }
        }
        let depth = read_exr(&dir.path().join("depth/frame_000007.exr"));
        assert_eq!((depth[0].0.as_str(), depth[0].1.as_slice()), ("Z", frame.depth_m().unwrap()));
        for (name, values) in read_exr(&dir.path().join("coords/frame_000007.exr")) {
            let channel = ["u", "v", "x", "y", "dt", "n", "e", "d"].iter().position(|n| *n == name).unwrap();
            assert!(values.iter().zip(frame.coords().unwrap()).all(|(read, pixel)| *read == pixel[channel]));
        }
        let rows = fs::read_to_string(dir.path().join("rows/frame_000007.csv")).unwrap();
        assert_eq!(rows, "row,t_mid_ns,n,e,d,qw,qx,qy,qz,vn,ve,vd\n0,-5,0.1,2,-3,1,0,0,0,1,0,0\n");
    }
}

#[test]
fn png_has_the_configured_encoding() {
    for (output, kind) in [
        (OutputEncoding::Srgb8, image::ColorType::Rgba8),
        (OutputEncoding::Linear8, image::ColorType::Rgba8),
        (OutputEncoding::LinearF16, image::ColorType::Rgba16),
        (OutputEncoding::Luma8, image::ColorType::L8),
        (OutputEncoding::Luma16, image::ColorType::L16),
    ] {
        let bytes = png_file::encode_color(Path::new("x.png"), &frame(0), output).unwrap();
        let read = image::load_from_memory(&bytes).unwrap();
        assert_eq!(read.color(), kind);
        let expected = frame(0).into_color();
        let red = |pixel: usize| f64::from(expected[pixel * 4]);
        match read {
            image::DynamicImage::ImageRgba8(read) if output == OutputEncoding::Srgb8 => {
                let pixel = read.as_raw()[40 * 4];
                assert!((f64::from(pixel) - 255.0 * srgb_from_linear_f64(red(40))).abs() <= 0.51);
            }
            image::DynamicImage::ImageRgba16(read) => {
                assert!((f64::from(read.as_raw()[40 * 4]) - 65535.0 * red(40)).abs() <= 0.51);
            }
            image::DynamicImage::ImageLuma16(read) => {
                let p = &expected[160..163];
                assert!(
                    (f32::from(read.as_raw()[40])
                        - 65535.0 * camsim_core::scene::luminance([p[0], p[1], p[2]]))
                    .abs()
                        <= 0.6
                );
            }
            _ => {}
        }
    }
    let valid = image::load_from_memory(&png_file::encode_valid(Path::new("x.png"), &frame(0)).unwrap())
        .unwrap()
        .into_luma8();
    assert_eq!(&valid.as_raw()[..4], [255, 0, 255, 0]);
}

#[test]
fn empty_format_writes_no_files() {
    let dir = tempfile::tempdir().unwrap();
    let spec = OutputSpec { format: vec![], ..everything(ExrPixel::Half, ExrCompression::Zip1) };
    let mut writer = FrameWriter::new(FrameFiles::new(dir.path(), &spec, OutputEncoding::Srgb8), 1);
    writer.write(frame(0)).unwrap();
    assert_eq!(writer.finish().unwrap(), WriteSummary { frames: 1, bytes: 0 });
    assert!(files_below(dir.path()).is_empty());
}

#[test]
fn failures_name_the_path_and_leave_no_files() {
    let dir = tempfile::tempdir().unwrap();
    // A file instead of a folder causes an error for all users, root included.
    fs::write(dir.path().join("color"), "in the way").unwrap();
    let files = FrameFiles::new(dir.path(), &OutputSpec::default(), OutputEncoding::Srgb8);
    let mut writer = FrameWriter::new(files, 2);
    let error = (0..50)
        .find_map(|index| writer.write(frame(index)).err())
        .or_else(|| writer.finish().err())
        .unwrap()
        .to_string();
    assert!(error.contains("color") && error.contains("choose another folder"), "{error}");
    assert_eq!(files_below(dir.path()), ["color"]);

    fs::create_dir(dir.path().join("taken")).unwrap();
    assert!(write_atomic(&dir.path().join("taken"), b"x").is_err());
    assert_eq!(files_below(dir.path()), ["color"], "the temporary file is gone");
    assert!(write_atomic(Path::new("/"), b"x").unwrap_err().to_string().contains("names no file"));

    let short = RenderedFrame { planes: vec![Plane::color(vec![0.0; 5])], ..frame(3) };
    let mut writer =
        FrameWriter::new(FrameFiles::new(dir.path(), &OutputSpec::default(), OutputEncoding::Srgb8), 1);
    let result = writer.write(short);
    let error = result.err().or_else(|| writer.finish().err()).unwrap().to_string();
    assert!(error.contains("frame 3") && error.contains("33x21"), "{error}");
}

#[test]
fn non_finite_values_are_written_without_panic() {
    let mut odd = frame(0);
    odd.color_rgba_mut()[..8].copy_from_slice(&[
        f32::NAN,
        f32::INFINITY,
        -1e30,
        1.0,
        1e30,
        0.0,
        f32::NEG_INFINITY,
        f32::NAN,
    ]);
    let dir = tempfile::tempdir().unwrap();
    let mut writer = FrameWriter::new(
        FrameFiles::new(dir.path(), &everything(ExrPixel::Half, ExrCompression::Zip1), OutputEncoding::Srgb8),
        1,
    );
    writer.write(odd).unwrap();
    writer.finish().unwrap();
}

#[test]
fn tables_have_the_documented_columns() {
    let state = BodyState {
        position_ned_m: DVec3::new(1.0, 2.0, 3.0),
        velocity_ned_m_s: DVec3::ZERO,
        acceleration_ned_m_s2: DVec3::ZERO,
        ned_from_body: DQuat::IDENTITY,
        rate_body_rad_s: DVec3::ZERO,
        angular_acceleration_body_rad_s2: DVec3::Z,
    };
    let text =
        trajectory_csv([1_403_636_579_763_555_584, -1_500_000_000].map(|t_ns| Stamped { t_ns, state }));
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[1].starts_with("1403636579.763555584,1,2,3,0,") && lines[2].starts_with("-1.500000000,"));
    assert!(lines.iter().all(|line| line.split(',').count() == 20));

    let pose = CameraPose { position_ned_m: DVec3::ONE, ned_from_camera: DQuat::IDENTITY };
    let state = CameraState { pose, velocity_ned_m_s: DVec3::X, rate_camera_rad_s: DVec3::Z };
    let text = trajectory_csv([Stamped { t_ns: 500_000_000, state }]);
    let columns = "t_s,n_m,e_m,d_m,vn,ve,vd,qw,qx,qy,qz,wx,wy,wz";
    assert_eq!(text, format!("{columns}\n0.500000000,1,1,1,1,0,0,1,0,0,0,0,0,1\n"));

    let mut rows = [frame(0).rows[0]; 2];
    let columns = "row,t_mid_ns,n,e,d,qw,qx,qy,qz,vn,ve,vd";
    let line = "0,-5,0.1,2,-3,1,0,0,0,1,0,0";
    assert_eq!(rows_csv(&rows), format!("{columns}\n{line}\n{line}\n"));
    rows[1].exposure_ns = 7;
    assert_eq!(rows_csv(&rows), format!("{columns},exposure_ns\n{line},0\n{line},7\n"));
}

#[test]
fn contact_sheet_has_all_frames() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sheet.png");
    contact_sheet(&path, &[frame(0), frame(1), frame(2)], 2, 3).unwrap();
    let read = image::open(&path).unwrap();
    assert_eq!([read.width(), read.height()], [22, 14]);
    assert!(contact_sheet(&path, &[], 2, 3).is_err());
}

#[test]
fn numbers_of_objects_are_written_as_numbers_and_in_colour() {
    let folder = tempfile::tempdir().unwrap();
    let pixels = SIZE[0] * SIZE[1];
    let numbers = |factor: u32| PlaneValues::Index((0..pixels).map(|i| factor * i).collect());
    let mut shown = frame(3);
    shown.planes = vec![
        Plane { channel: Channel::Object, values: numbers(90) },
        Plane { channel: Channel::Class, values: numbers(1) },
    ];
    let output = OutputSpec {
        channels: vec![Channel::Object, Channel::Class],
        palette: true,
        ..OutputSpec::default()
    };
    let files = FrameFiles::new(folder.path(), &output, OutputEncoding::Srgb8);
    let columns: Vec<String> = files.names(3).into_iter().map(|(column, _)| column).collect();
    assert_eq!(columns, ["object", "object_palette", "class", "class_palette"]);
    let mut writer = FrameWriter::new(files, 1);
    writer.write(shown.clone()).unwrap();
    writer.finish().unwrap();
    let open = |name: &str| image::open(folder.path().join(format!("{name}/frame_000003.png"))).unwrap();
    let object = open("object").into_luma16();
    let palette = open("object_palette").into_rgb8();
    for (i, (number, colour)) in object.pixels().zip(palette.pixels()).enumerate() {
        assert_eq!(u32::from(number.0[0]), 90 * i as u32);
        assert_eq!(colour.0, palette_rgb8(90 * i as u32));
    }
    assert_eq!(open("class_palette").into_rgb8().get_pixel(1, 0).0, palette_rgb8(1));
    // 16 bits hold no larger number.
    shown.planes[0].values = numbers(100);
    let mut writer = FrameWriter::new(FrameFiles::new(folder.path(), &output, OutputEncoding::Srgb8), 1);
    let _ = writer.write(shown);
    assert!(writer.finish().unwrap_err().to_string().contains("above 65535"));
}

#[test]
fn colours_of_objects_are_those_of_the_formula_and_differ() {
    // Hue 0.618: between cyan and blue, 1.708 sectors above green.
    assert_eq!(palette_rgb8(0), [0, 0, 0]);
    let [h, s, v] = [0.618_034, 0.55, 0.95];
    let sector = 6.0 * h - 3.0;
    let wanted = [v * (1.0 - s), v * (1.0 - s * sector), v].map(|part: f64| (255.0 * part).round() as u8);
    assert_eq!(palette_rgb8(1), wanted);
    let colours: Vec<[u8; 3]> = (0..=64).map(palette_rgb8).collect();
    let distance = |a: [u8; 3], b: [u8; 3]| (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap();
    for (i, &a) in colours.iter().enumerate() {
        for (k, &b) in colours[..i].iter().enumerate() {
            assert!(distance(a, b) >= 8, "{i} {a:?} and {k} {b:?}");
        }
    }
}

#[test]
fn names_of_objects_are_quoted_where_a_table_needs_it() {
    let object = |name: &str, class| SceneObject { name: name.into(), class };
    let objects = [object("house#1/roof", 3), object("a, \"b\"\nc", 0)];
    let text = objects_csv(&objects);
    assert!(text.starts_with("number,name,class\n1,house#1/roof,3\n2,\""), "{text}");
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows[1], csv::StringRecord::from(vec!["2", "a, \"b\"\nc", "0"]));
}
