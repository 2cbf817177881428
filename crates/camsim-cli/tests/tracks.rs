//! `[output.tracks]` through the command line: the tables beside the frames, and whether the picture shows the
//! points where they say.

#![allow(clippy::unwrap_used)]

use std::{collections::BTreeMap, ffi::OsString, fs, path::Path};

/// Runs camsim. Returns exit code and standard error.
fn camsim(args: &[&str]) -> (u8, String) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("camsim").chain(args.iter().copied()).map(OsString::from);
    let code = camsim_cli::run(args, &mut out, &mut err);
    (code, String::from_utf8(err).unwrap())
}

/// A flight past a board that stands 3 m to the north, with a rolling shutter and a lens.
fn write_scenario(folder: &Path, board: &str, tracks: &str) {
    let row = |i: i32| {
        let t = f64::from(i) * 0.1;
        format!(
            "{t},{},{},{},{},{},{}\n",
            -3.0 + 0.3 * t,
            0.4 * t - 0.2,
            0.1 * t,
            4.0 * t,
            2.0 - 3.0 * t,
            5.0 * t
        )
    };
    let rows: String = (0..20).map(row).collect();
    fs::write(folder.join("log.csv"), format!("t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg\n{rows}")).unwrap();
    // Before the board, behind it, and behind the camera.
    fs::write(folder.join("p.csv"), "name,n_m,e_m,d_m\nnear,-0.5,0.1,0.1\nfar,1,0.1,0.1\nback,-9,0,0\n")
        .unwrap();
    let scenario = format!(
        "[flight]\nlog = \"log.csv\"\n[tracker]\nkind = \"linear\"\n[camera]\nsize_px = [400, 300]\n\
         focal_px = [330.0, 331.0]\nfps = 10.0\n[camera.lens]\nmodel = \"brown-conrady\"\n\
         coefficients = [-0.25, 0.06, 0.001, -0.001]\n[camera.shutter]\nreadout_ms = 30.0\nexposure_ms = 2.0\n\
         [camera.photometric]\noutput = \"linear8\"\n[scene.board]\n{board}\n[output]\nformat = [\"png\"]\n\
         [output.tracks]\n{tracks}\n"
    );
    fs::write(folder.join("s.toml"), scenario).unwrap();
}

const CHESSBOARD: &str =
    "kind = \"chessboard\"\ncolumns = 8\nrows = 5\nsize_m = 0.26\nangles_deg = [0.0, 90.0, 0.0]";
const APRILGRID: &str = "kind = \"aprilgrid\"\ncolumns = 5\nrows = 3\nsize_m = 0.36\nspacing = 0.3\nangles_deg = [0.0, 90.0, 0.0]";

fn render(folder: &Path, out: &str, more: &[&str]) -> (u8, String) {
    let [scenario, out] = ["s.toml", out].map(|name| folder.join(name).to_str().unwrap().to_owned());
    let backend: &[&str] = if more.contains(&"--backend") { &[] } else { &["--backend", "cpu"] };
    camsim(&[&["render", &scenario, "-o", &out, "-q"][..], backend, more].concat())
}

fn rendered(folder: &Path, out: &str, more: &[&str]) {
    let (code, err) = render(folder, out, more);
    assert_eq!(code, 0, "{err}");
}

/// Rows of a table by the names of its columns.
fn table(path: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().collect::<Result<_, _>>().unwrap()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap()
}

/// Light at a position, bilinear.
fn light(picture: &image::GrayImage, [x, y]: [f64; 2]) -> f64 {
    let at = |x: f64, y: f64| f64::from(picture.get_pixel(x as u32, y as u32)[0]);
    let ([x0, y0], [tx, ty]) = ([x.floor(), y.floor()], [x.fract(), y.fract()]);
    let row = |y: f64| at(x0, y) * (1.0 - tx) + at(x0 + 1.0, y) * tx;
    row(y0) * (1.0 - ty) + row(y0 + 1.0) * ty
}

/// A picture without the steps at edges that a pixel's area leaves: binomial weights over five pixels.
fn smoothed(picture: &image::GrayImage) -> image::GrayImage {
    let kernel = [1_u32, 4, 6, 4, 1];
    let [last_x, last_y] = [picture.width() - 1, picture.height() - 1];
    image::GrayImage::from_fn(picture.width(), picture.height(), |x, y| {
        let mut sum = 0;
        for (j, across) in (0..).zip(kernel) {
            for (i, along) in (0..).zip(kernel) {
                let (px, py) = ((x + i).saturating_sub(2).min(last_x), (y + j).saturating_sub(2).min(last_y));
                sum += across * along * u32::from(picture.get_pixel(px, py)[0]);
            }
        }
        image::Luma([((sum + 128) / 256) as u8])
    })
}

/// Half the side of the window of [`refined`], pixels.
const WINDOW_PX: i32 = 6;

/// The corner near `from_px`, by the gradients of the picture: each is at right angles to the line from the corner
/// to where it is, so that the sum of g g^T (q - p) over a window is 0 for the corner q.
fn refined(picture: &image::GrayImage, from_px: [f64; 2]) -> Option<[f64; 2]> {
    let mut q = from_px;
    for _ in 0..40 {
        let (mut a, mut b, mut c, mut u, mut v) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (i, j) in (-WINDOW_PX..=WINDOW_PX).flat_map(|j| (-WINDOW_PX..=WINDOW_PX).map(move |i| (i, j))) {
            let (dx, dy) = (f64::from(i), f64::from(j));
            let [x, y] = [q[0] + dx, q[1] + dy];
            let inside = |value: f64, size: u32| value > 2.0 && value < f64::from(size) - 3.0;
            if !inside(x, picture.width()) || !inside(y, picture.height()) {
                return None;
            }
            let weight = (-(dx * dx + dy * dy) / (0.5 * f64::from(WINDOW_PX * WINDOW_PX))).exp();
            let gx = light(picture, [x + 1.0, y]) - light(picture, [x - 1.0, y]);
            let gy = light(picture, [x, y + 1.0]) - light(picture, [x, y - 1.0]);
            (a, b, c) = (a + weight * gx * gx, b + weight * gx * gy, c + weight * gy * gy);
            (u, v) = (u + weight * gx * (gx * dx + gy * dy), v + weight * gy * (gx * dx + gy * dy));
        }
        let determinant = a * c - b * b;
        let step = [(c * u - b * v) / determinant, (a * v - b * u) / determinant];
        q = [q[0] + step[0], q[1] + step[1]];
        if step[0].hypot(step[1]) < 1e-4 {
            break;
        }
    }
    Some(q)
}

/// Where the pictures of a folder show the points of its tracks, less what the tracks say.
fn offsets_px(out: &Path) -> Vec<[f64; 2]> {
    let (mut offsets, mut pictures) = (Vec::new(), BTreeMap::new());
    for row in table(&out.join("tracks.csv")) {
        assert_eq!((row["visible"].as_str(), row["solutions"].as_str()), ("1", "1"));
        let frame: u32 = row["frame"].parse().unwrap();
        let picture = pictures.entry(frame).or_insert_with(|| {
            smoothed(&image::open(out.join(format!("color/frame_{frame:06}.png"))).unwrap().to_luma8())
        });
        let track = [number(&row, "x_px"), number(&row, "y_px")];
        let found = refined(picture, [track[0].round() + 0.6, track[1].round() - 0.7]);
        offsets.extend(found.map(|found| [found[0] - track[0], found[1] - track[1]]));
    }
    offsets
}

#[test]
fn the_picture_shows_the_corners_of_boards_where_the_tracks_say() {
    for (board, corners) in [(CHESSBOARD, 40), (APRILGRID, 60)] {
        let folder = tempfile::tempdir().unwrap();
        let base = folder.path();
        write_scenario(base, board, "points = \"board\"");
        rendered(base, "exact", &["--frames", "0,7", "--backend", "reference"]);
        rendered(base, "fast", &["--frames", "0..12"]);
        let points = table(&base.join("exact/points.csv"));
        assert_eq!(points.len(), corners);
        let is_right = |(i, row): (usize, &BTreeMap<String, String>)| {
            row["point"] == i.to_string() && row["source"] == "board"
        };
        assert!(points.iter().enumerate().all(is_right));
        let exact = offsets_px(&base.join("exact"));
        let worst_px = exact.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max);
        let rms_px = (exact.iter().map(|[x, y]| x * x + y * y).sum::<f64>() / exact.len() as f64).sqrt();
        // The fast renderer may move single corners by a part of a pixel within its tolerance, but not all.
        let fast = offsets_px(&base.join("fast"));
        let mean_px = [0, 1].map(|k| fast.iter().map(|offset| offset[k]).sum::<f64>() / fast.len() as f64);
        eprintln!(
            "{} corners: {rms_px:.4} RMS, {worst_px:.4} px; {}: mean {mean_px:.4?}",
            exact.len(),
            fast.len()
        );
        assert!(exact.len() > corners && fast.len() > 6 * corners, "{} {}", exact.len(), fast.len());
        assert!(worst_px < 0.1 && rms_px < 0.06, "{rms_px:.4} RMS, {worst_px:.4} px");
        assert!(mean_px[0].hypot(mean_px[1]) < 0.04, "{mean_px:.4?}");
    }
}

#[test]
fn the_tables_hold_what_is_visible_and_what_is_hidden() {
    let folder = tempfile::tempdir().unwrap();
    let base = folder.path();
    write_scenario(base, CHESSBOARD, "points = [\"p.csv\", \"board\"]\ncount = 12");
    rendered(base, "out", &["--format", "none", "--frames", "3..6"]);
    let points = table(&base.join("out/points.csv"));
    let names: Vec<&str> = points[..3].iter().map(|row| row["name"].as_str()).collect();
    assert_eq!((names, points.len()), (vec!["near", "far", "back"], 15));
    assert!(points[..3].iter().all(|row| row["source"] == "p.csv"));
    let tracks = table(&base.join("out/tracks.csv"));
    let of = |point: &str| tracks.iter().filter(|row| row["point"] == point).collect::<Vec<_>>();
    assert!(of("0").len() == 3 && of("0").iter().all(|row| row["visible"] == "1"));
    assert!(of("1").len() == 3 && of("1").iter().all(|row| row["visible"] == "0"), "behind the board");
    assert!(of("2").is_empty(), "behind the camera");
    // Depth is along the optical axis at the row's instant, which is within the readout.
    for row in of("0") {
        let frame = number(row, "frame");
        assert!((number(row, "depth_m") - 2.4).abs() < 0.2, "{row:?}");
        assert!((number(row, "t_ns") - frame * 1e8).abs() <= 16e6, "{row:?}");
    }
    let run: serde_json::Value =
        serde_json::from_slice(&fs::read(base.join("out/run.json")).unwrap()).unwrap();
    assert_eq!(run["tracked_points"], 15);
    assert_eq!(run["scenario"]["output"]["tracks"]["points"][0], "../p.csv");
    assert!(run["inputs"].as_object().unwrap().contains_key("../p.csv"));
    assert!(!base.join("out/.tracks").exists() && !base.join("out/color").exists());
}

#[test]
fn parts_and_resumed_runs_give_the_table_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let base = folder.path();
    write_scenario(base, CHESSBOARD, "points = [\"board\", \"p.csv\"]");
    let small = ["--set", "camera.size_px=[80, 60]", "--set", "camera.focal_px=[66, 66]"];
    let run = |out: &str, more: &[&str]| rendered(base, out, &[&small[..], more].concat());
    let read = |out: &str, name: &str| fs::read_to_string(base.join(out).join(name)).unwrap();
    run("whole", &["--frames", "0..6"]);
    let whole = read("whole", "tracks.csv");
    assert!(whole.lines().count() > 200 && whole.ends_with('\n'), "{whole}");
    for shard in ["2/2", "1/2"] {
        run("parts", &["--frames", "0..6", "--shard", shard]);
    }
    assert_eq!(
        (read("parts", "tracks.csv"), read("parts", "points.csv")),
        (whole.clone(), read("whole", "points.csv"))
    );
    // A frame that is missing, a table that is, and the frames before them.
    fs::remove_file(base.join("parts/color/frame_000003.png")).unwrap();
    run("parts", &["--frames", "0..6", "--resume"]);
    assert_eq!(read("parts", "tracks.csv"), whole);
    fs::remove_file(base.join("parts/tracks.csv")).unwrap();
    run("parts", &["--frames", "0..6", "--resume"]);
    assert_eq!(read("parts", "tracks.csv"), whole);
    // Other points of the same frames.
    let from = format!("output.tracks.points={}", base.join("p.csv").display());
    run("parts", &["--frames", "0..6", "--set", &from]);
    assert_eq!(read("parts", "points.csv").lines().count(), 4);
    assert!(
        read("parts", "tracks.csv")
            .lines()
            .skip(1)
            .all(|row| ["0", "1"].contains(&row.split(',').nth(1).unwrap()))
    );
    // Without tracks nothing is written, and what belongs to another scenario goes.
    run("parts", &["--frames", "0..6", "--set", "camera.fps=11", "--set", "output={format=[\"png\"]}"]);
    assert!(!base.join("parts/points.csv").exists() && !base.join("parts/tracks.csv").exists());
    assert!(!fs::read_to_string(base.join("parts/run.json")).unwrap().contains("tracked_points"));
}

#[test]
fn mistakes_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let base = folder.path();
    for (tracks, wanted) in [
        ("points = \"bord\"", "did you mean \"board\"?"),
        ("points = []", "is empty"),
        ("points = [\"board\", \"board\"]", "names \"board\" twice"),
        ("points = \"terrain\"", "there is no scene.terrain"),
        ("points = \"vertices\"", "there is no scene.gltf"),
        ("count = 3", "output.tracks.points: is missing"),
        ("points = \"board\"\ncount = 0", "output.tracks.count: expected a whole number, 1 to 1000000"),
        ("points = \"none.csv\"", "none.csv: cannot be read"),
    ] {
        write_scenario(base, CHESSBOARD, tracks);
        let (code, err) = render(base, "out", &["--frames", "0"]);
        assert!(code != 0 && err.contains(wanted), "{tracks}: {err}");
        assert!(!base.join("out").exists());
    }
    // The table of points beside the frames never replaces that of a user.
    write_scenario(base, CHESSBOARD, "points = \"board\"");
    fs::create_dir(base.join("out")).unwrap();
    fs::copy(base.join("p.csv"), base.join("out/points.csv")).unwrap();
    let (code, err) = render(base, "out", &["--frames", "0"]);
    assert!(code != 0 && err.contains("points.csv is no table of tracks that camsim made"), "{err}");
    assert_eq!(fs::read(base.join("p.csv")).unwrap(), fs::read(base.join("out/points.csv")).unwrap());
    assert!(!base.join("out/run.json").exists());
}
