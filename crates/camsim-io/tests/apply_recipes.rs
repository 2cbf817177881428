//! Reads every recipe of docs/guide/APPLY.md, with small pictures instead of those that it names.
#![allow(clippy::unwrap_used)]

use std::{fs, path::Path};

use camsim_io::frame_file::read_frame_set;
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, SmallVec, Vec2, WritableImage};

/// The `toml` blocks of docs/guide/APPLY.md.
fn recipes() -> Vec<String> {
    let page = include_str!("../../../docs/guide/APPLY.md");
    page.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
}

fn write_exr(path: &Path, channels: &[&str]) {
    let list: SmallVec<[AnyChannel<FlatSamples>; 4]> =
        channels.iter().map(|name| AnyChannel::new(*name, FlatSamples::F32(vec![2.0; 12]))).collect();
    let image =
        Image::from_encoded_channels(Vec2(4_usize, 3), Encoding::UNCOMPRESSED, AnyChannels::sort(list));
    image.write().to_file(path).unwrap();
}

/// Writes a small file for a name in a recipe, by key and extension. A * becomes two times.
fn stub(folder: &Path, key: &str, name: &str, has_unit: bool) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    if name.contains('*') {
        let times = if has_unit { ["12500000000", "12600000000"] } else { ["0001", "0002"] };
        times.iter().for_each(|time| stub(folder, key, &name.replace('*', time), has_unit));
        return;
    }
    match (key, path.extension().unwrap().to_str().unwrap()) {
        ("color", "exr") => write_exr(
            &path,
            &[
                "ViewLayer.Combined.R",
                "ViewLayer.Combined.G",
                "ViewLayer.Combined.B",
                "ViewLayer.Depth.Z",
                "ViewLayer.Mist.Z",
                "ViewLayer.Vector.X",
                "ViewLayer.Vector.Y",
                "ViewLayer.Vector.Z",
                "ViewLayer.Vector.W",
            ],
        ),
        // A colour file that exists has the depth too.
        ("depth", "exr") if path.is_file() => {}
        ("depth", "exr") => write_exr(&path, &["Depth.V"]),
        ("color", "png") => image::RgbImage::from_pixel(4, 3, image::Rgb([90, 80, 70])).save(&path).unwrap(),
        ("depth", "pfm") => {
            let values = [2.0_f32, 65_504.0].into_iter().cycle().take(12).flat_map(f32::to_le_bytes);
            fs::write(&path, b"Pf\n4 3\n-1.000000\n".iter().copied().chain(values).collect::<Vec<u8>>())
                .unwrap();
        }
        ("depth", "tiff") => {
            let file = fs::File::create(&path).unwrap();
            let values = [2.0, f32::INFINITY, f32::NAN].into_iter().cycle().take(12).collect::<Vec<f32>>();
            tiff::encoder::TiffEncoder::new(file)
                .unwrap()
                .write_image::<tiff::encoder::colortype::Gray32Float>(4, 3, &values)
                .unwrap();
        }
        ("depth", "png") => {
            image::ImageBuffer::from_pixel(4, 3, image::Luma([4000_u16])).save(&path).unwrap()
        }
        ("color" | "depth" | "frames", "txt") => {
            let time = if key == "depth" { 12.51 } else { 12.5 };
            let row = |folder_name: &str| format!("{folder_name}/{time}.png");
            stub(folder, if key == "depth" { "depth" } else { "color" }, &row(key), false);
            let pair = if key == "frames" {
                stub(folder, "depth", "frames/d.png", false);
                " 12.51 frames/d.png"
            } else {
                ""
            };
            fs::write(&path, format!("# comment\n{time} {}{pair}\n", row(key))).unwrap();
        }
        ("trajectory", "txt") => {
            fs::write(&path, "# t x y z qx qy qz qw\n12 0 0 0 0 0 0 1\n13 1 0 0 0 0 0 1\n").unwrap()
        }
        ("trajectory", "csv") => {
            fs::write(&path, "t_s,x,y,z,qw,qx,qy,qz\n12,0,0,0,1,0,0,0\n13,1,0,0,1,0,0,0\n").unwrap()
        }
        other => panic!("the page names {name} as {other:?}, which this test does not know"),
    }
}

#[test]
fn all_recipes_can_be_read() {
    let recipes = recipes();
    assert!(recipes.len() >= 6, "the page has {} recipes", recipes.len());
    for recipe in recipes {
        let folder = tempfile::tempdir().unwrap();
        let table: toml::Table = toml::from_str(&recipe).unwrap_or_else(|error| panic!("{recipe}\n{error}"));
        let has_unit = table.contains_key("name_unit");
        let motion = table.get("motion").and_then(|motion| motion.as_table()).cloned().unwrap_or_default();
        for key in ["color", "depth", "frames", "trajectory"] {
            if let Some(name) = table.get(key).or(motion.get(key)).and_then(|name| name.as_str()) {
                stub(folder.path(), key, name, has_unit);
            }
        }
        let path = folder.path().join("FRAME.toml");
        fs::write(&path, &recipe).unwrap();
        let set = read_frame_set(&path).unwrap_or_else(|error| panic!("{recipe}\n{error}"));
        for index in 0..set.entries().len() {
            let file = set.read(index).unwrap_or_else(|error| panic!("{recipe}\n{error}"));
            assert_eq!(file.frame.geometry.size_px, [4, 3]);
            assert!(
                file.without_depth < 1.0 && file.frame.inverse_depth.iter().any(|w| *w > 0.0),
                "{recipe}"
            );
            // Fraction of sky in the files written above.
            let sky = if recipe.contains("65504") {
                0.5
            } else if recipe.contains("tiff") {
                2.0 / 3.0
            } else {
                0.0
            };
            assert!((file.without_depth - sky).abs() < 1e-9, "{recipe}");
            assert!(file.motion.covers(0.0, 0.01).is_ok(), "{recipe}");
        }
    }
}
