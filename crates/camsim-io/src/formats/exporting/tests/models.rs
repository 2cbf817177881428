//! COLMAP and nerfstudio.

use camsim_core::scenario::DatasetFormat;
use glam::{DQuat, DVec3};

use super::sample::FRAMES;
use super::{Sample, exported, names, text};
use crate::formats::reading::{ImportOptions, import_rig};

const POINTS: [[f64; 3]; 3] = [[40.0, 21.0, -29.0], [41.0, 19.5, -31.0], [50.0, 20.0, -30.0]];

fn tracked() -> Sample {
    let sample = Sample::new("");
    sample.write(&["color_png"]);
    sample.write_tracks(
        &POINTS,
        &[
            (4, 0, [2.5, 1.5], 1, 1),
            (4, 1, [0.25, 3.25], 0, 1),
            (4, 2, [5.0, 0.0], 1, 1),
            (5, 0, [2.0, 1.0], 1, 1),
            (5, 2, [1.0, 1.0], 1, 2),
            (5, 2, [3.0, 1.0], 1, 2),
            (9, 2, [4.0, 2.0], 1, 1),
        ],
    );
    sample
}

/// A reader of little-endian numbers.
struct Reader(Vec<u8>, usize);

impl Reader {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let bytes = self.0[self.1..self.1 + N].try_into().unwrap();
        self.1 += N;
        bytes
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    fn end(&self) -> bool {
        self.1 == self.0.len()
    }
}

#[test]
fn binary_and_text_models_are_the_same_with_pixels_from_the_corner() {
    let sample = tracked();
    exported(&sample, DatasetFormat::Colmap).unwrap();
    let open =
        |name: &str| Reader(std::fs::read(sample.out().join(format!("sparse/0/{name}.bin"))).unwrap(), 0);
    let mut cameras = open("cameras");
    assert_eq!((cameras.u64(), cameras.u32(), cameras.u32()), (1, 1, 1), "PINHOLE is 1");
    assert_eq!((cameras.u64(), cameras.u64()), (6, 4));
    // The middle of 6x4 pixels from the corner is (3, 2).
    assert_eq!([cameras.f64(), cameras.f64(), cameras.f64(), cameras.f64()], [5.0, 5.5, 3.0, 2.0]);
    assert!(cameras.end());
    let cameras = text(&sample.out().join("sparse_text/0/cameras.txt"));
    assert!(cameras.ends_with("\n1 PINHOLE 6 4 5 5.5 3 2\n"), "{cameras}");

    let mut images = open("images");
    assert_eq!(images.u64(), 4);
    let lines: Vec<String> =
        text(&sample.out().join("sparse_text/0/images.txt")).lines().map(str::to_owned).collect();
    let mut of_images = Vec::new();
    for image in 0..4 {
        assert_eq!(images.u32(), image + 1);
        let q: [f64; 4] = std::array::from_fn(|_| images.f64());
        let t: [f64; 3] = std::array::from_fn(|_| images.f64());
        assert_eq!(images.u32(), 1);
        let mut name = Vec::new();
        loop {
            match images.take::<1>()[0] {
                0 => break,
                letter => name.push(letter),
            }
        }
        let points: Vec<(f64, f64, u64)> =
            (0..images.u64()).map(|_| (images.f64(), images.f64(), images.u64())).collect();
        let name = String::from_utf8(name).unwrap();
        let numbers = q.iter().chain(&t).map(f64::to_string).collect::<Vec<_>>().join(" ");
        assert_eq!(lines[3 + 2 * image as usize], format!("{} {numbers} 1 {name}", image + 1));
        let seen: Vec<String> = points.iter().map(|(x, y, id)| format!("{x} {y} {id}")).collect();
        assert_eq!(lines[4 + 2 * image as usize], seen.join(" "));
        of_images.push((DQuat::from_xyzw(q[1], q[2], q[3], q[0]), DVec3::from_array(t), points));
    }
    assert!(images.end());
    // Neither what is hidden nor what is seen twice.
    let ids: Vec<Vec<u64>> =
        of_images.iter().map(|(_, _, points)| points.iter().map(|point| point.2).collect()).collect();
    assert_eq!(ids, [vec![1, 3], vec![1], vec![], vec![3]]);
    assert_eq!(of_images[0].2[0], (3.0, 2.0, 1));
    // World to camera: point 2 is 40 m before the first camera, on its axis.
    let (q, t, _) = of_images[0];
    let seen = q * DVec3::new(20.0, 50.0, 30.0) + t;
    assert!((seen - DVec3::new(0.0, 0.0, 40.0)).length() < 1e-9, "{seen}");

    let mut points = open("points3D");
    assert_eq!(points.u64(), 2, "point 1 is seen by none");
    assert_eq!(points.u64(), 1);
    assert_eq!([points.f64(), points.f64(), points.f64()], [21.0, 40.0, 29.0]);
    let picture = image::open(sample.run().join("color/frame_000004.png")).unwrap().into_rgb8();
    // 2.5 and 1.5 round up.
    assert_eq!(points.take::<3>(), picture.get_pixel(3, 2).0);
    assert_eq!((points.f64(), points.u64()), (0.0, 2));
    assert_eq!([points.u32(), points.u32(), points.u32(), points.u32()], [1, 0, 2, 0]);
    assert_eq!(points.u64(), 3);
    points.take::<35>();
    assert_eq!(points.u64(), 2);
    assert_eq!([points.u32(), points.u32(), points.u32(), points.u32()], [1, 1, 4, 0]);
    assert!(points.end());
}

#[test]
fn rigs_and_frames_name_each_image() {
    let sample = tracked();
    exported(&sample, DatasetFormat::Colmap).unwrap();
    let file = |name: &str| text(&sample.out().join(format!("sparse_text/0/{name}.txt")));
    assert!(file("rigs").ends_with("\n1 1 CAMERA 1\n"));
    let frames = file("frames");
    let last = frames.lines().last().unwrap();
    assert!(last.starts_with("4 1 ") && last.ends_with(" 1 CAMERA 1 4"), "{last}");
    assert!(names(&sample.out()).contains(&"images/frame_000009.png".to_owned()));
    let bytes = std::fs::read(sample.out().join("sparse/0/rigs.bin")).unwrap();
    let mut rigs = Reader(bytes, 0);
    let read = (rigs.u64(), rigs.u32(), rigs.u32(), rigs.u32(), rigs.u32());
    assert_eq!((read, rigs.end()), ((1, 1, 1, 0, 1), true));
    let mut frames = Reader(std::fs::read(sample.out().join("sparse/0/frames.bin")).unwrap(), 0);
    assert_eq!((frames.u64(), frames.u32(), frames.u32()), (4, 1, 1));
    frames.take::<56>();
    assert_eq!((frames.u32(), frames.u32(), frames.u32(), frames.u64()), (1, 0, 1, 1));
}

#[test]
fn cameras_that_share_instants_are_one_rig() {
    let sample = Sample::new("");
    sample.write_rig(&["color_png"]);
    exported(&sample, DatasetFormat::Colmap).unwrap();
    let file = |name: &str| text(&sample.out().join(format!("sparse_text/0/{name}.txt")));
    // The right camera is half a metre along the left one's x.
    assert!(file("rigs").ends_with("\n# Number of rigs: 1\n1 2 CAMERA 1 CAMERA 2 1 1 0 0 0 -0.5 0 0\n"));
    let (frames, images) = (file("frames"), file("images"));
    let rows: Vec<&str> = frames.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(rows.len(), 4);
    for (i, row) in rows.iter().enumerate() {
        let image = images.lines().find(|line| line.ends_with(&format!("cam0/frame_{:06}.png", FRAMES[i])));
        let pose: Vec<&str> = image.unwrap().split(' ').skip(1).take(7).collect();
        let pictures = format!("2 CAMERA 1 {} CAMERA 2 {}", i + 1, i + 5);
        assert_eq!(*row, format!("{} 1 {} {pictures}", i + 1, pose.join(" ")));
    }
    let read =
        |name: &str| Reader(std::fs::read(sample.out().join(format!("sparse/0/{name}.bin"))).unwrap(), 0);
    let mut rigs = read("rigs");
    assert_eq!((rigs.u64(), rigs.u32(), rigs.u32()), (1, 1, 2));
    assert_eq!([rigs.u32(), rigs.u32(), rigs.u32(), rigs.u32()], [0, 1, 0, 2]);
    assert_eq!((rigs.take::<1>(), rigs.f64()), ([1], 1.0));
    assert_eq!([(); 6].map(|()| rigs.f64()), [0.0, 0.0, 0.0, -0.5, 0.0, 0.0]);
    let mut frames = read("frames");
    assert_eq!((rigs.end(), frames.u64(), frames.u32(), frames.u32()), (true, 4, 1, 1));
    frames.take::<56>();
    assert_eq!((frames.u32(), frames.u64(), frames.u64()), (2, 1 << 32, 1));
    assert_eq!((frames.u64(), frames.u64()), (2 << 32, 5));
}

#[test]
fn the_smallest_model_that_holds_the_lens_is_chosen() {
    let cases = [
        ("focal_px = [5.0, 5.0]", "pinhole", "", "SIMPLE_PINHOLE 6 4 5 3 2"),
        ("focal_px = [5.0, 5.0]", "brown-conrady", "0.1", "SIMPLE_RADIAL 6 4 5 3 2 0.1"),
        ("focal_px = [5.0, 5.0]", "brown-conrady", "0.1, 0.2", "RADIAL 6 4 5 3 2 0.1 0.2"),
        ("focal_px = [5.0, 6.0]", "brown-conrady", "0.1, 0.2", "OPENCV 6 4 5 6 3 2 0.1 0.2 0 0"),
        (
            "focal_px = [5.0, 6.0]",
            "brown-conrady",
            "0.1, 0.2, 0.03, 0.04, 0.05",
            "FULL_OPENCV 6 4 5 6 3 2 0.1 0.2 0.03 0.04 0.05 0 0 0",
        ),
        ("focal_px = [5.0, 6.0]", "kannala-brandt", "0.1, 0.02", "OPENCV_FISHEYE 6 4 5 6 3 2 0.1 0.02 0 0"),
    ];
    for (focal, model, coefficients, wanted) in cases {
        let tables = format!(
            "[camera]\nsize_px = [6, 4]\n{focal}\n[camera.lens]\nmodel = \"{model}\"\ncoefficients = [{coefficients}]\n"
        );
        let sample = Sample::with(&tables, "");
        sample.write(&["color_png"]);
        let report = exported(&sample, DatasetFormat::Colmap).unwrap();
        let cameras = text(&sample.out().join("sparse_text/0/cameras.txt"));
        assert!(cameras.ends_with(&format!("\n1 {wanted}\n")), "{cameras}");
        assert!(report.notes.iter().any(|note| note.contains("[output.tracks]")), "{:?}", report.notes);
    }
}

#[test]
fn nerfstudio_has_opengl_axes() {
    let sample = Sample::new("");
    sample.write(&["color_png", "depth"]);
    exported(&sample, DatasetFormat::Nerfstudio).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text(&sample.out().join("transforms.json"))).unwrap();
    assert_eq!(json["camera_model"], "OPENCV");
    assert_eq!([&json["cx"], &json["cy"], &json["w"]].map(|v| v.as_f64().unwrap()), [3.0, 2.0, 6.0]);
    let frame = &json["frames"][0];
    assert_eq!(frame["file_path"], "images/frame_000004.png");
    assert_eq!(frame["depth_file_path"], "depths/frame_000004.png");
    let matrix: Vec<Vec<f64>> = serde_json::from_value(frame["transform_matrix"].clone()).unwrap();
    // The camera looks north (y) along its -z, up is up, right is east.
    let wanted = [[1.0, 0.0, 0.0, 20.0], [0.0, 0.0, -1.0, 10.0], [0.0, 1.0, 0.0, 30.0], [0.0, 0.0, 0.0, 1.0]];
    let same = |row: &Vec<f64>, wanted: &[f64; 4]| row.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(matrix.iter().zip(&wanted).all(|(row, wanted)| same(row, wanted)), "{matrix:?}");
}

/// Cameras of a rig have their intrinsics in the frames, and names by their folders.
#[test]
fn nerfstudio_reads_back_as_the_rig() {
    let sample = Sample::with(
        "[camera]\nsize_px = [6, 4]\nfocal_px = [5.0, 5.5]\nprincipal_point_px = [2.25, 1.75]\nfps = 10.0\n\
         [camera.lens]\nmodel = \"brown-conrady\"\ncoefficients = [-0.25, 0.06, 0.001, -0.002]\n",
        "",
    );
    sample.write_rig(&["color_png"]);
    exported(&sample, DatasetFormat::Nerfstudio).unwrap();
    let path = sample.out().join("transforms.json");
    // Both are alike.
    let rig = import_rig(&path, &ImportOptions::default()).unwrap();
    let [camera] = &rig.cameras[..] else { panic!("{} cameras", rig.cameras.len()) };
    assert_eq!((camera.focal_px, camera.principal_point_px), ([5.0, 5.5], Some([2.25, 1.75])));
    assert_eq!(camera.lens.coefficients, [-0.25, 0.06, 0.001, -0.002]);
    let other = text(&path).replacen("\"fl_x\": 5.0", "\"fl_x\": 5.25", 4);
    std::fs::write(&path, other).unwrap();
    let rig = import_rig(&path, &ImportOptions::default()).unwrap();
    let found: Vec<_> = rig.cameras.iter().map(|camera| (&camera.name[..], camera.focal_px[0])).collect();
    assert_eq!(found, [("cam0", 5.25), ("cam1", 5.0)]);
}
