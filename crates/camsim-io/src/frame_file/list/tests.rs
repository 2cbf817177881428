#![allow(clippy::unwrap_used)]

use std::fs;

use crate::frame_file::{FrameSet, read_frame_set};

/// Folders `rgb` and `depth` of empty files, tables, and a FRAME.toml of `text`.
fn set(text: &str) -> Result<Vec<(String, String, Option<i64>)>, String> {
    whole_set(text).map(|(_folder, set)| {
        let name = |path: &std::path::Path| path.file_name().unwrap().to_string_lossy().into_owned();
        let entry = |entry: &super::FrameEntry| {
            (name(&entry.color), entry.depth.as_deref().map(name).unwrap_or_default(), entry.stamp_ns)
        };
        assert!(set.is_several());
        set.entries().iter().map(entry).collect()
    })
}

fn whole_set(text: &str) -> Result<(tempfile::TempDir, FrameSet), String> {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    for (name, files) in [
        ("rgb", &["10.00.png", "10.03.png", "9.97.png", "10.50.png", ".10.06.png", "note.txt"][..]),
        ("depth", &["10.01.png", "10.035.png", "9.96.png", "10.09.png"]),
        ("same", &["9.97.png", "10.00.png", "10.03.png", "10.50.png"]),
        ("some", &["9.97.png", "10.00.png"]),
    ] {
        fs::create_dir(folder.path().join(name)).unwrap();
        files.iter().for_each(|name_in| file(&format!("{name}/{name_in}"), ""));
    }
    file("rgb.txt", "# colour images\n9.97 rgb/9.97.png\n10.00 rgb/10.00.png\n10.50 rgb/10.50.png\n");
    file("depth.txt", "9.96 depth/9.96.png\r\n10.01 depth/10.01.png\r\n\r\n");
    file("pairs.txt", "9.97 rgb/9.97.png 9.96 depth/9.96.png\n10.0 rgb/10.00.png 10.01 depth/10.01.png\n");
    file("frames.csv", "frame,stamp_ns,n,color_exr,depth\n0,9970000000,1.5,rgb/9.97.png,depth/9.96.png\n");
    file("plain.csv", "color\nrgb/9.97.png\nrgb/10.00.png\n");
    file("back.txt", "10.00 rgb/10.00.png\n9.97 rgb/9.97.png\n");
    file("lost.txt", "10.00 rgb/10.00.png\n10.10 rgb/10.10.png\n");
    file("odd.txt", "9.97 rgb/9.97.png\n10.00 rgb/10.00.png extra\n");
    file("late.txt", "99 depth/9.96.png\n");
    file("poses.txt", "# t x y z qx qy qz qw\n9 0 0 0 0 0 0 1\n11 2 0 0 0 0 0 1\n");
    let path = folder.path().join("FRAME.toml");
    fs::write(&path, format!("focal_px = [2, 2]\n{text}")).unwrap();
    read_frame_set(&path).map(|set| (folder, set)).map_err(|error| error.to_string())
}

fn entry(color: &str, depth: &str, stamp_ns: impl Into<Option<i64>>) -> (String, String, Option<i64>) {
    (color.to_owned(), depth.to_owned(), stamp_ns.into())
}

#[test]
fn pictures_are_paired_by_name_or_by_time() {
    let names = ["9.97.png", "10.00.png", "10.03.png", "10.50.png"];
    let by_name = set("color = \"rgb/*.png\"\ndepth = \"same/*.png\"\n").unwrap();
    assert_eq!(by_name, names.map(|name| entry(name, name, None)), "by number, not by letter");
    let timed = set("color = \"rgb/*.png\"\ndepth = \"depth/*.png\"\nname_unit = \"s\"\n");
    let expected = [
        entry("9.97.png", "9.96.png", 9_970_000_000),
        entry("10.00.png", "10.01.png", 10_000_000_000),
        entry("10.03.png", "10.035.png", 10_030_000_000),
    ];
    assert_eq!(timed.unwrap(), expected, "10.50 has no depth within 20 ms");
    let (_folder, set_of_all) =
        whole_set("color = \"rgb/*.png\"\ndepth = \"depth/*.png\"\nname_unit = \"s\"\n").unwrap();
    assert_eq!(set_of_all.left_out(), 1);
    let wide = set("color = \"rgb/*.png\"\ndepth = \"depth/*.png\"\nname_unit = \"s\"\nmax_gap_ms = 1000\n")
        .unwrap();
    assert_eq!(wide[3], entry("10.50.png", "10.09.png", 10_500_000_000));
    let at_25 = set("color = \"rgb/*.png\"\nfps = 25\n[motion]\nstamp_s = 7\n").unwrap();
    assert_eq!(
        at_25.iter().map(|entry| entry.2.unwrap()).collect::<Vec<_>>(),
        [0, 40, 80, 120].map(|ms| (7000 + ms) * 1_000_000)
    );
}

#[test]
fn lists_and_tables_are_read() {
    let expected =
        [entry("9.97.png", "9.96.png", 9_970_000_000), entry("10.00.png", "10.01.png", 10_000_000_000)];
    assert_eq!(set("color = \"rgb.txt\"\ndepth = \"depth.txt\"\n").unwrap(), expected);
    assert_eq!(set("frames = \"pairs.txt\"\n").unwrap(), expected);
    assert_eq!(set("frames = \"frames.csv\"\n").unwrap(), expected[..1]);
    assert_eq!(set("color = \"rgb.txt\"\n").unwrap()[2], entry("10.50.png", "", 10_500_000_000));
    assert_eq!(set("frames = \"plain.csv\"\nfps = 10\n").unwrap()[1], entry("10.00.png", "", 100_000_000));
}

#[test]
fn motion_is_relative_to_the_stamp_of_each_frame() {
    let text = "frames = \"pairs.txt\"\n[motion]\ntrajectory = \"poses.txt\"\ntrajectory_format = \"tum\"\n";
    let (_folder, set) = whole_set(text).unwrap();
    for (index, stamp_s) in [(0, 9.97), (1, 10.0)] {
        let motion = set.motion(index).unwrap();
        // 1 m/s along x, from 9 to 11.
        assert!((motion.twist_at(0.0).velocity_m_s.x - 1.0).abs() < 1e-12);
        assert!(
            motion.covers(9.0 - stamp_s, 11.0 - stamp_s).is_ok()
                && motion.covers(8.99 - stamp_s, 0.0).is_err()
        );
        assert!((motion.key_from(0.5, -0.25).1.x - 0.75).abs() < 1e-12);
    }
    assert!(set.read(2).unwrap_err().to_string().contains("has 2 frames"));
}

#[test]
fn contradictory_keys_are_refused() {
    for (text, expected) in [
        ("", "color: is missing, and has no default; add it, or frames"),
        ("color = \"rgb/*.png\"\ndepth = \"some/*.png\"\n", "10.03.png has none: there is no"),
        ("color = \"rgb/*.jpg\"\n", "no file is called"),
        ("color = \"no/*.png\"\n", "cannot be read"),
        ("color = \"*/*.png\"\n", "must have one * in the file's name"),
        ("color = \"rgb/*.*\"\n", "must have one * in the file's name"),
        ("color = \"rgb/*.txt\"\nname_unit = \"s\"\n", "`note` is no time"),
        ("color = \"rgb/*.png\"\ndepth = \"d.png\"\n", "depth: names one picture, and color many"),
        ("color = \"c.png\"\ndepth = \"depth/*.png\"\n", "depth: names many pictures, and color names one"),
        ("color = \"c.png\"\nfps = 25\n", "fps: is for many frames"),
        ("color = \"rgb/*.png\"\nname_unit = \"s\"\nfps = 25\n", "fps: is for frames without times"),
        ("color = \"rgb/*.png\"\nfps = 0\n", "fps: must be above 0"),
        ("color = \"rgb/*.png\"\ndepth = \"same/*.png\"\nmax_gap_ms = 5\n", "max_gap_ms: is for times"),
        ("color = \"rgb.txt\"\ndepth = \"depth/*.png\"\n", "name_unit: is missing"),
        ("color = \"rgb.txt\"\ndepth = \"late.txt\"\n", "no picture is within 20 ms"),
        ("color = \"rgb.txt\"\nname_unit = \"s\"\n", "name_unit: is for names with a *"),
        ("color = \"c.png\"\nframes = \"pairs.txt\"\n", "frames: is a table"),
        ("frames = \"pairs.txt\"\ndepth = \"d.png\"\n", "leave depth out"),
        ("frames = \"none.csv\"\n", "none.csv: cannot be read"),
        ("frames = \"back.txt\"\n", "back.txt:2: is not later than the row before"),
        ("frames = \"lost.txt\"\n", "lost.txt:2: there is no picture"),
        ("frames = \"odd.txt\"\n", "odd.txt:2: is neither"),
        ("color = \"odd.txt\"\n", "odd.txt:2: is not `time file`"),
        ("frames = \"rgb.txt\"\n[motion]\nstamp_s = 3\n", "motion.stamp_s: is of one frame"),
        ("color = \"rgb/*.png\"\n[motion]\ntrajectory = \"poses.txt\"\n", "the frames have no times"),
        ("frames = \"pairs.txt\"\n[motion]\ntrajectory = \"poses.txt\"\n", "trajectory_format = \"tum\""),
        (
            "frames = \"pairs.txt\"\n[motion]\ntrajectory = \"pairs.txt\"\ntrajectory_format = \"tum\"\n",
            "pairs.txt:1: is not the 8 numbers",
        ),
    ] {
        let error = set(text).unwrap_err();
        assert!(error.contains(expected), "{text}\n  gives {error}\n  not   {expected}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
