//! `camera.resized` against the full picture, cropped and averaged.

#![allow(clippy::unwrap_used)]

use std::{ffi::OsString, fs, path::Path};

/// Rows of linear R, G, B of a picture.
struct Picture {
    width: usize,
    values: Vec<[f64; 3]>,
}

impl Picture {
    fn read(path: &Path) -> Self {
        let picture = image::open(path).unwrap().into_rgb16();
        let values = picture.pixels().map(|pixel| pixel.0.map(|value| f64::from(value) / 65_535.0)).collect();
        Self { width: picture.width() as usize, values }
    }

    fn at(&self, x: usize, y: usize) -> [f64; 3] {
        self.values[y * self.width + x]
    }

    /// Root mean square difference from what `expected` makes of the position of each pixel.
    fn rms(&self, expected: impl Fn(usize, usize) -> [f64; 3]) -> f64 {
        let mut squares = 0.0;
        for (i, value) in self.values.iter().enumerate() {
            let wanted = expected(i % self.width, i / self.width);
            squares += value.iter().zip(wanted).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        }
        (squares / (3 * self.values.len()) as f64).sqrt()
    }
}

/// Renders frame 4 of the pattern with a vignette, at a rolling shutter and without noise.
fn render(folder: &Path, sets: &[&str]) -> Picture {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").canonicalize().unwrap();
    let (scenario, vignette) = (assets.join("pattern.toml"), assets.join("vignette.png"));
    let vignette = format!("camera.photometric.vignette={}", vignette.display());
    let mut args = ["camsim", "render", scenario.to_str().unwrap(), "-o", folder.to_str().unwrap()].to_vec();
    args.extend(["--backend", "cpu", "--frames", "4", "--outputs", "color,rows", "--format", "png"]);
    let sets = ["camera.photometric.output=linear-f32", &vignette].into_iter().chain(sets.iter().copied());
    sets.for_each(|set| args.extend(["--set", set]));
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let code = camsim_cli::run(args.into_iter().map(OsString::from), &mut out, &mut err);
    assert_eq!(code, 0, "{}", String::from_utf8_lossy(&err));
    Picture::read(&folder.join("color/frame_000004.png"))
}

/// Times of the rows, nanoseconds.
fn row_times(folder: &Path) -> Vec<i64> {
    let text = fs::read_to_string(folder.join("rows/frame_000004.csv")).unwrap();
    text.lines().skip(1).map(|line| line.split(',').nth(1).unwrap().parse().unwrap()).collect()
}

/// One step of 8 bits. Frames are within it of the exact picture, so that two of them differ by little more.
const STEP: f64 = 1.0 / 255.0;

#[test]
fn a_part_and_a_binned_picture_are_those_of_the_full_one() {
    let base = tempfile::tempdir().unwrap();
    let path = |name: &str| base.path().join(name);
    let full = render(&path("full"), &[]);
    let part = render(&path("part"), &["camera.resized.crop_px=[96, 60, 448, 360]"]);
    assert_eq!((part.width, part.values.len()), (448, 448 * 360));
    let rms = part.rms(|x, y| full.at(x + 96, y + 60));
    assert!(rms < STEP, "{rms}");
    assert_eq!(row_times(&path("part")), row_times(&path("full"))[60..420]);

    let binned = render(&path("binned"), &["camera.resized.binning=2"]);
    assert_eq!((binned.width, binned.values.len()), (320, 320 * 240));
    let mean = |x: usize, y: usize| {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| full.at(2 * x + i, 2 * y + j));
        [0, 1, 2].map(|channel| 0.25 * four.iter().map(|value| value[channel]).sum::<f64>())
    };
    let rms = binned.rms(mean);
    assert!(rms < STEP, "{rms}");
    let times = row_times(&path("full"));
    let means: Vec<i64> = times.chunks(2).map(|pair| (pair[0] + pair[1]) / 2).collect();
    assert!(row_times(&path("binned")).iter().zip(means).all(|(own, mean)| (own - mean).abs() <= 1));

    // The written run has the resized camera, and renders the same again.
    let again = path("again");
    let run = path("binned").join("run.json");
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = [
        "camsim",
        "render",
        run.to_str().unwrap(),
        "-o",
        again.to_str().unwrap(),
        "--backend",
        "cpu",
        "--frames",
        "4",
    ];
    let code = camsim_cli::run(args.map(OsString::from), &mut out, &mut err);
    assert_eq!(code, 0, "{}", String::from_utf8_lossy(&err));
    let bytes = |folder: &str| fs::read(path(folder).join("color/frame_000004.png")).unwrap();
    assert!(bytes("binned") == bytes("again"));
}
