#![allow(clippy::unwrap_used)]

use std::fs;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, SmallVec, Vec2, WritableImage,
};

use crate::frame_file::{FrameFile, read_frame};

/// A part of 2x1 pixels: its name, where it begins, and channels of one value each.
type ExrPart<'a> = (&'a str, i32, &'a [(&'a str, f32)]);

/// Reads a FRAME.toml of `text` beside `a.exr` of these parts.
fn read(parts: &[ExrPart<'_>], text: &str) -> Result<FrameFile, String> {
    let folder = tempfile::tempdir().unwrap();
    let layer = |(name, x_px, channels): &ExrPart<'_>| {
        let list: SmallVec<[AnyChannel<FlatSamples>; 4]> = channels
            .iter()
            .map(|(name, value)| AnyChannel::new(*name, FlatSamples::F32(vec![*value; 2])))
            .collect();
        let mut attributes =
            if name.is_empty() { LayerAttributes::default() } else { LayerAttributes::named(*name) };
        attributes.layer_position = Vec2(*x_px, 0);
        Layer::new(Vec2(2_usize, 1), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(list))
    };
    let layers: Vec<_> = parts.iter().map(layer).collect();
    let window = IntegerBounds::new(Vec2(0, 0), Vec2(2_usize, 1));
    let image =
        Image::from_layers(ImageAttributes::new(window), layers.into_iter().collect::<SmallVec<[_; 2]>>());
    image.write().to_file(folder.path().join("a.exr")).unwrap();
    let path = folder.path().join("FRAME.toml");
    fs::write(&path, format!("color = \"a.exr\"\nfocal_px = [2, 2]\n{text}")).unwrap();
    read_frame(&path).map_err(|error| error.to_string())
}

/// The first pixel's R G B and depth.
fn first(file: &FrameFile) -> [f32; 4] {
    let [r, g, b, ..] = file.frame.color_rgba[..] else { panic!("has pixels") };
    [r, g, b, 1.0 / file.frame.inverse_depth[0]]
}

const DEPTH: &str = "depth = \"a.exr\"\n";

/// What Blender 3.6 writes with the passes Combined, Z, Mist, Normal, Vector and Denoising, in one part.
const BLENDER: &[(&str, f32)] = &[
    ("ViewLayer.Combined.A", 1.0),
    ("ViewLayer.Combined.B", 0.75),
    ("ViewLayer.Combined.G", 0.5),
    ("ViewLayer.Combined.R", 0.25),
    ("ViewLayer.Denoising Depth.Z", 99.0),
    ("ViewLayer.Depth.Z", 8.0),
    ("ViewLayer.DiffCol.B", 0.1),
    ("ViewLayer.DiffCol.G", 0.1),
    ("ViewLayer.DiffCol.R", 0.1),
    ("ViewLayer.Mist.Z", 0.5),
    ("ViewLayer.Normal.X", 0.0),
    ("ViewLayer.Normal.Y", 0.0),
    ("ViewLayer.Normal.Z", -1.0),
    ("ViewLayer.Vector.W", 0.0),
    ("ViewLayer.Vector.X", 0.0),
    ("ViewLayer.Vector.Y", 0.0),
    ("ViewLayer.Vector.Z", 0.0),
];

#[test]
fn channels_of_blender_multilayer_files_are_found() {
    assert_eq!(first(&read(&[("", 0, BLENDER)], DEPTH).unwrap()), [0.25, 0.5, 0.75, 8.0]);
    let chosen = "color_layer = \"ViewLayer.DiffCol\"\ndepth_channel = \"Denoising Depth.Z\"\n";
    assert_eq!(
        first(&read(&[("", 0, BLENDER)], &format!("{DEPTH}{chosen}")).unwrap()),
        [0.1, 0.1, 0.1, 99.0]
    );
}

#[test]
fn blender_mist_is_not_taken_for_depth() {
    let without_depth: Vec<(&str, f32)> =
        BLENDER.iter().copied().filter(|(name, _)| !name.contains("Depth")).collect();
    let error = read(&[("", 0, &without_depth)], DEPTH).unwrap_err();
    assert!(error.contains("has no channel Z, but ViewLayer.Combined.A"), "{error}");
    let asked = read(&[("", 0, &without_depth)], &format!("{DEPTH}depth_channel = \"Mist.Z\"\n"));
    assert_eq!(first(&asked.unwrap())[3], 0.5);
}

#[test]
fn optical_axis_is_the_centre_of_the_display_window() {
    let axis_px = |x_px: i32, text: &str| {
        let file =
            read(&[("", x_px, &[("B", 0.0), ("G", 0.0), ("R", 0.0), ("Z", 1.0)])], &format!("{DEPTH}{text}"))
                .unwrap();
        file.frame.geometry.principal_px.to_array()
    };
    // The display window is pixels 0 and 1. Data windows begin at 0, 1 (a crop) and -1 (overscan).
    assert_eq!([axis_px(0, ""), axis_px(1, ""), axis_px(-1, "")], [[0.5, 0.0], [-0.5, 0.0], [1.5, 0.0]]);
    assert_eq!(axis_px(1, "principal_point_px = [3, 4]\n"), [3.0, 4.0]);
}

#[test]
fn channels_of_all_parts_can_be_selected() {
    let parts: [ExrPart<'_>; 3] = [
        ("rgba", 0, &[("B", 0.75), ("G", 0.5), ("R", 0.25)]),
        ("depth", 0, &[("Z", 4.0)]),
        ("eye", 0, &[("eye.B", 0.3), ("eye.G", 0.2), ("eye.R", 0.1), ("eye.Z", 5.0)]),
    ];
    let chosen = |text: &str| read(&parts, &format!("{DEPTH}{text}"));
    assert_eq!(
        first(&chosen("color_layer = \"rgba\"\ndepth_layer = \"depth\"\n").unwrap()),
        [0.25, 0.5, 0.75, 4.0]
    );
    assert_eq!(
        first(&chosen("color_layer = \"eye\"\ndepth_channel = \"eye.Z\"\n").unwrap()),
        [0.1, 0.2, 0.3, 5.0]
    );
    let mixed = "color_channels = [\"rgba.B\", \"eye.G\", \"rgba.R\"]\ndepth_channel = \"Z\"\ndepth_layer = \
        \"eye\"\n";
    assert_eq!(first(&chosen(mixed).unwrap()), [0.75, 0.2, 0.25, 5.0]);
    assert_eq!(
        first(&chosen("color_channels = [\"depth.Z\"]\ndepth_layer = \"depth\"\n").unwrap()),
        [4.0; 4]
    );
}

#[test]
fn ambiguous_channels_are_refused_with_a_list() {
    let two: [ExrPart<'_>; 2] = [
        ("left", 0, &[("left.B", 0.0), ("left.G", 0.0), ("left.R", 0.0), ("left.Z", 1.0)]),
        ("right", 0, &[("right.B", 0.0), ("right.G", 0.0), ("right.R", 0.0), ("right.Z", 1.0)]),
    ];
    let plain: [ExrPart<'_>; 1] =
        [("", 0, &[("B", 0.0), ("G", 0.0), ("Normal.X", 0.0), ("Normal.Z", 0.0), ("R", 0.0), ("dist", 2.0)])];
    let chroma: [ExrPart<'_>; 1] = [("", 0, &[("BY", 0.0), ("RY", 0.0), ("Y", 0.5)])];
    let shifted: [ExrPart<'_>; 2] =
        [("a", 0, &[("B", 0.0), ("G", 0.0), ("R", 0.0)]), ("b", 5, &[("Z", 1.0)])];
    for (parts, text, expected) in [
        (&two[..], "", "several layers with colour: left, right; choose one with color_layer"),
        (
            &two,
            "color_layer = \"left\"\n",
            "several channels that may be depth: left.Z right.Z; choose one with depth_channel",
        ),
        (&two, "color_layer = \"middle\"\n", "has no channel middle.R, but left.B"),
        (&two, "color_channels = [\"R\"]\n", "several channels R: left.R right.R; give the whole name"),
        (&two, "color_channels = [\"R\", \"G\"]\n", "color_channels: must be one name (grey) or three"),
        (&plain, "", "has no channel Z, but B G Normal.X Normal.Z R dist; name it with depth_channel"),
        (&plain, "depth_channel = \"Depth.Z\"\n", "has no channel Depth.Z, but B G"),
        (&chroma, "", "has no channels R G B or Y, but BY RY Y"),
        (&shifted, "", "begins at pixel [5, 0]"),
    ] {
        let error = read(parts, &format!("{DEPTH}{text}")).unwrap_err();
        assert!(error.contains(expected), "{text}\n  gives {error}\n  not   {expected}");
    }
    assert_eq!(first(&read(&plain, &format!("{DEPTH}depth_channel = \"dist\"\n")).unwrap())[3], 2.0);
}

#[test]
fn missing_and_damaged_files_have_different_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("FRAME.toml");
    fs::write(&path, "color = \"a.exr\"\nfocal_px = [2, 2]\n").unwrap();
    let error = || read_frame(&path).unwrap_err().to_string();
    assert!(
        error().contains("a.exr: cannot be read as EXR: ")
            && error().ends_with("paths are relative to FRAME.toml"),
        "{}",
        error()
    );
    fs::write(folder.path().join("a.exr"), "no picture").unwrap();
    assert!(error().ends_with("it is cut off, or no EXR"), "{}", error());
}
