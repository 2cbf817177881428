//! `camsim apply` with the paper's methods against frames that the paper's own program computed
//! (docs/reproduction/goldens.md).
//!
//! Needs the frames: CAMSIM_DATA is the folder that holds `golden/`. Every pixel that differs by more than
//! two grey levels must be explained by a fault of that program, and the fault, put into the model, must give
//! that program's value.

#![allow(clippy::unwrap_used)]

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use camsim_core::{
    apply::{IdealFrame, Motion, Pipeline, Settings},
    camera::CameraModel,
    frame::RenderedFrame,
    photometric::vignette_weights,
    scenario::{CameraSpec, FieldOr, LensModel, LensSpec, PhotometricSpec, Preset, ShutterSpec, Solver},
    scene::{linear_from_srgb, srgb_from_linear},
    sequence::GrayImage,
    temporal::displacement,
};
use camsim_io::{frame_file::read_frame, pictures::read_gray_image};
use glam::{DVec2, DVec3};
use image::RgbaImage;

const SKY: [u8; 3] = [166, 217, 255];
const FOG: [f64; 3] = [0.5, 0.6, 0.7];
/// Grey levels.
const AGREES: f64 = 2.0;

/// One of that program's frames, in camsim's conventions.
struct Golden {
    name: String,
    numbers: BTreeMap<String, f64>,
    spec: CameraSpec,
    ideal: IdealFrame,
    motion: Motion,
    paper: Settings,
    vignette: GrayImage,
    /// As that program sampled it: alpha 0 is sky.
    raw: RgbaImage,
    output: RgbaImage,
}

fn goldens() -> Option<Vec<Golden>> {
    let Some(data) = std::env::var_os("CAMSIM_DATA").map(PathBuf::from) else {
        eprintln!("CAMSIM_DATA is not set: the reference program's frames are not compared");
        return None;
    };
    let mut folders: Vec<PathBuf> = fs::read_dir(data.join("golden"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|p| p.is_dir())
        .collect();
    folders.sort();
    assert_eq!(folders.len(), 8);
    Some(folders.iter().map(|folder| golden(folder)).collect())
}

/// That program's files to CAMERA and FRAME: what its conventions are goes explicitly here.
fn golden(folder: &Path) -> Golden {
    let find = |ending: &str| {
        let mut found = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        found.find(|path| path.to_str().unwrap().ends_with(ending)).unwrap()
    };
    let json: serde_json::Value = serde_json::from_slice(&fs::read(find(".json")).unwrap()).unwrap();
    let numbers: BTreeMap<String, f64> = json["inputVect"]
        .as_object()
        .unwrap()
        .iter()
        .map(|(key, value)| (key.clone(), value.as_f64().unwrap()))
        .collect();
    let n = |key: &str| numbers[key];
    let coefficients: Vec<f64> = ["k1", "k2", "t1", "t2", "k3"].map(n).into();
    let spec = CameraSpec {
        size_px: [n("width") as u32, n("height") as u32],
        focal_px: [n("fx"), n("fy")],
        // Pixel centres are at half numbers there.
        principal_point_px: Some([n("ox") - 0.5, n("oy") - 0.5]),
        lens: if coefficients.iter().any(|k| *k != 0.0) {
            LensSpec { model: LensModel::BrownConrady, coefficients }
        } else {
            LensSpec::default()
        },
        shutter: ShutterSpec {
            // `td` counts as here: positive is older.
            delay_ms: 1e3 * n("td"),
            readout_ms: 1e3 * n("tr"),
            exposure_ms: 1e3 * n("te"),
            interlace_ms: FieldOr::Ms(1e3 * n("ti")),
            ..ShutterSpec::default()
        },
        photometric: PhotometricSpec {
            vignette_thresholds: [n("vignet_thresh1"), n("vignet_thresh2")],
            light: n("day_light"),
            ..PhotometricSpec::default()
        },
        ..CameraSpec::default()
    };
    let raw = image::open(find("_ideal_colour.png")).unwrap().to_rgba8();
    let work = tempfile::tempdir().unwrap();
    let colored = image::RgbImage::from_fn(raw.width(), raw.height(), |x, y| {
        let [r, g, b, a] = raw.get_pixel(x, y).0;
        image::Rgb(if a < 128 { SKY } else { [r, g, b] })
    });
    colored.save(work.path().join("color.png")).unwrap();
    fs::copy(find("_ideal_depth.png"), work.path().join("depth.png")).unwrap();
    // The ideal frame is centred on the middle of its picture. Its instant: that program takes td and half of
    // ti into the pose.
    let toml = format!(
        "color = \"color.png\"\ndepth = \"depth.png\"\ndepth_encoding = \"packed24\"\nfocal_px = [{}, {}]\ninstant_ms = {}\n\
         [motion]\nvelocity_m_s = [{}, {}, {}]\nangular_rate_rad_s = [{}, {}, {}]\n",
        n("fx"),
        n("fy"),
        -1e3 * (n("td") + 0.5 * n("ti")),
        n("vx"),
        n("vy"),
        n("vz"),
        n("wx"),
        n("wy"),
        n("wz"),
    );
    let fog = if n("fog_end") > 0.0 {
        format!("[fog]\nend_m = {}\ncolor = {FOG:?}\n", n("fog_end"))
    } else {
        String::new()
    };
    let path = work.path().join("FRAME.toml");
    fs::write(&path, toml + &fog).unwrap();
    let file = read_frame(&path).unwrap();
    let paper = Settings {
        preset: Preset::Paper,
        solver: Some(Solver::Rk2),
        blur_samples: Some(n("extra_sampling_points") as u32 + 2),
        fog: file.fog,
        ..Settings::default()
    };
    Golden {
        name: folder.file_name().unwrap().to_str().unwrap().to_owned(),
        spec,
        ideal: file.frame,
        motion: file.motion,
        paper,
        vignette: read_gray_image(&folder.join("vignette.png")).unwrap(),
        raw,
        output: image::open(find("_output.png")).unwrap().to_rgba8(),
        numbers,
    }
}

/// Faults of that program that show in these frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    /// A vignette value between the thresholds stays as it is: from 0.5 it jumps to 1. The rule is min(v /
    /// t2, 1).
    VignetteJump,
    /// The vignette's texture is filtered with a black border.
    VignetteBorder,
    /// Sky is decided by the *filtered* alpha, so that horizon pixels mix with the colour that cleared texels
    /// hide, or become all sky.
    SkyAfterFilter,
    /// Filter weights there have eight bits, up to half a step off in either direction, so an alpha within a
    /// level of one half may be sky ...
    TieIsSky,
    /// ... or as ground.
    TieIsGround,
    /// Sky is 65.281 km away, what its depth buffer was cleared to, and moves with translation: here by up to
    /// half a pixel.
    SkyIsNear,
    /// The fog's ray is taken from the principal point, where the coordinate counts from the middle of the
    /// picture.
    FogCentre,
}

const FAULTS: [Fault; 7] = [
    Fault::VignetteJump,
    Fault::VignetteBorder,
    Fault::SkyAfterFilter,
    Fault::TieIsSky,
    Fault::TieIsGround,
    Fault::SkyIsNear,
    Fault::FogCentre,
];

/// Gather, fog and photometric of the paper, written once more, with faults on request.
struct Model<'a> {
    golden: &'a Golden,
    pipeline: &'a Pipeline<'a>,
    camera: &'a CameraModel,
}

impl Model<'_> {
    /// Grey levels of a pixel; `None` where its path leaves the ideal frame.
    fn levels(&self, pixel: [u32; 2], faults: &[Fault]) -> Option<[f64; 3]> {
        let has = |fault| faults.contains(&fault);
        let n = |key: &str| self.golden.numbers[key];
        let uv = self.camera.unproject(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])))?;
        let inverse_depth = self.pipeline.source(pixel, 0.0).ok()?.inverse_depth;
        let sky = inverse_depth == 0.0;
        let at_phase = |phase: f64| {
            if !(sky && has(Fault::SkyIsNear)) {
                return Some(self.pipeline.source(pixel, phase).ok()?.position_px);
            }
            // That program's row times, from the ideal frame's instant.
            let row = f64::from(pixel[1]);
            let lag_s = if pixel[1].is_multiple_of(2) { n("ti") } else { 0.0 };
            let dt_s = 0.5 * n("ti") + n("tr") * ((row + 0.5) / n("height") - 0.5) - lag_s + phase * n("te");
            let twist = self.golden.motion.twist_at(0.0);
            let moved = displacement::rk2(uv, 1.0 / 65_281.0, &twist, dt_s, 2.5_f64.to_radians());
            Some(self.golden.ideal.geometry.px_from_point(moved.extend(1.0)))
        };
        let (begin_px, end_px) = (at_phase(-0.5)?, at_phase(0.5)?);
        let samples = n("extra_sampling_points") + 2.0;
        // Alpha below which a filtered texel is sky; `None` decides texel by texel, before filtering.
        let sky_below =
            has(Fault::SkyAfterFilter).then(|| match (has(Fault::TieIsSky), has(Fault::TieIsGround)) {
                (true, false) => 128.5,
                (false, true) => 126.5,
                _ => 127.5,
            });
        let mut sum = DVec3::ZERO;
        for i in 0..samples as u32 {
            sum += self.color(begin_px.lerp(end_px, f64::from(i) / (samples - 1.0)), sky_below);
        }
        let mut color = sum / samples;
        if n("fog_end") > 0.0 {
            let wrong = DVec2::new(0.5 * n("width") - n("ox"), 0.5 * n("height") - n("oy"))
                / DVec2::new(n("fx"), n("fy"));
            let ray = if has(Fault::FogCentre) { uv + wrong } else { uv };
            let share = (ray.extend(1.0).length() / inverse_depth / n("fog_end")).clamp(0.0, 1.0);
            color = color.lerp(255.0 * DVec3::from_array(FOG), share);
        }
        let weight = self.vignette(pixel, has(Fault::VignetteJump), has(Fault::VignetteBorder));
        Some((color * weight * n("day_light")).to_array())
    }

    /// Bilinear stored colour in grey levels.
    fn color(&self, at_px: DVec2, sky_below: Option<f64>) -> DVec3 {
        let raw = &self.golden.raw;
        let last = DVec2::new(f64::from(raw.width() - 1), f64::from(raw.height() - 1));
        let at = at_px.clamp(DVec2::ZERO, last);
        let mut sum = glam::DVec4::ZERO;
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let place = at.floor() + DVec2::new(dx, dy);
            let weight = (1.0 - (at.x - place.x).abs()) * (1.0 - (at.y - place.y).abs());
            let texel = place.min(last);
            let [r, g, b, a] = raw.get_pixel(texel.x as u32, texel.y as u32).0;
            let [r, g, b] = if a < 128 && sky_below.is_none() { SKY } else { [r, g, b] };
            sum += weight * glam::DVec4::new(f64::from(r), f64::from(g), f64::from(b), f64::from(a));
        }
        if sky_below.is_some_and(|alpha| sum.w < alpha) {
            DVec3::new(0.65, 0.85, 1.0) * 255.0
        } else {
            sum.truncate()
        }
    }

    fn vignette(&self, [x, y]: [u32; 2], jump: bool, border: bool) -> f64 {
        let map = &self.golden.vignette;
        let [t1, t2] = self.golden.spec.photometric.vignette_thresholds;
        let size = DVec2::new(f64::from(map.size_px[0]), f64::from(map.size_px[1]));
        let [width, height] = self.golden.spec.size_px.map(f64::from);
        let at = (DVec2::new(f64::from(x), f64::from(y)) + 0.5) * size / DVec2::new(width, height) - 0.5;
        let mut value = 0.0;
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let texel = at.floor() + DVec2::new(dx, dy);
            let weight = (1.0 - (at.x - texel.x).abs()) * (1.0 - (at.y - texel.y).abs());
            let held = texel.clamp(DVec2::ZERO, size - 1.0);
            if texel == held || !border {
                value += weight * f64::from(map.values[(held.y * size.x + held.x) as usize]);
            }
        }
        match value {
            v if v < t1 => 0.0,
            v if jump => {
                if v > t2 {
                    1.0
                } else {
                    v
                }
            }
            v => (v / t2).min(1.0),
        }
    }
}

fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max)
}

/// Stored grey levels of a rendered pixel, as its PNG rounds them; `None` where alpha is 0.
fn levels_of(frame: &RenderedFrame, i: usize) -> Option<[f64; 3]> {
    let p = &frame.color_rgba[4 * i..4 * i + 4];
    (p[3] > 0.0).then(|| [p[0], p[1], p[2]].map(|v| f64::from((255.0 * srgb_from_linear(v)).round())))
}

/// That program's test whether an iterate of the lens inverse left the ideal frame: about the principal point
/// instead of the middle.
fn fails_the_margin_test(golden: &Golden, uv: DVec2) -> bool {
    let n = |key: &str| golden.numbers[key];
    let at = uv / n("extra_margin") * DVec2::new(n("fx"), n("fy")) + DVec2::new(n("ox"), n("oy"));
    at.cmplt(DVec2::ZERO).any() || at.x > n("width") || at.y > n("height")
}

#[test]
fn papers_methods_give_the_reference_programs_pixels_or_a_named_fault() {
    let Some(goldens) = goldens() else { return };
    let mut unexplained = Vec::new();
    eprintln!(
        "| case | pixels | within 1 | within 2 | empty in both | explained | unexplained | by cause |\n|---|---|---|---|---|---|---|---|"
    );
    for golden in &goldens {
        let pipeline = Pipeline::new(&golden.spec, &golden.ideal, &golden.motion, &golden.paper).unwrap();
        let rendered = pipeline.render(Some(&golden.vignette));
        let camera = CameraModel::from_spec(&golden.spec).unwrap();
        let model = Model { golden, pipeline: &pipeline, camera: &camera };
        let (mut within, mut empty) = ([0_u32; 3], 0_u32);
        let mut causes: BTreeMap<String, u32> = BTreeMap::new();
        let mut missed = 0;
        let [width, height] = golden.spec.size_px;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let [r, g, b, _] = golden.output.get_pixel(x, y).0;
            let theirs = [r, g, b].map(f64::from);
            let (red, black) = (theirs == [255.0, 0.0, 0.0], theirs == [0.0; 3]);
            let Some(ours) = levels_of(&rendered, (y * width + x) as usize) else {
                // No source in the ideal frame: alpha 0 here; there black, black under fog, or the red of "no
                // convergence".
                let fogged = golden.paper.fog.is_some() && {
                    let share = theirs[2] / FOG[2];
                    share > 0.0 && difference(theirs, FOG.map(|v| share * v)) <= AGREES
                };
                empty += u32::from(red || black || fogged);
                missed += u32::from(!red && !black && !fogged);
                continue;
            };
            let off = difference(ours, theirs);
            if off <= AGREES {
                within[off as usize] += 1;
                continue;
            }
            if red {
                let uv = camera.unproject(DVec2::new(f64::from(x), f64::from(y))).unwrap();
                if fails_the_margin_test(golden, uv) {
                    *causes.entry("red: margin test about the wrong point".into()).or_default() += 1;
                } else {
                    missed += 1;
                }
                continue;
            }
            // The fewest faults that give that program's value; each must change it.
            let subsets = (1..1_u32 << FAULTS.len()).map(|bits| {
                FAULTS
                    .into_iter()
                    .enumerate()
                    .filter(|(i, _)| bits >> i & 1 == 1)
                    .map(|(_, f)| f)
                    .collect::<Vec<_>>()
            });
            let mut subsets: Vec<Vec<Fault>> = subsets.collect();
            subsets.sort_by_key(Vec::len);
            let plain = model.levels([x, y], &[]).unwrap();
            assert!(
                difference(plain, ours) <= 1.0,
                "{}: the model of this test is not camsim's at {x} {y}: {plain:?} {ours:?}",
                golden.name
            );
            let explains = |faults: &Vec<Fault>| {
                let value = model.levels([x, y], faults).unwrap();
                let all_act = faults.iter().all(|fault| {
                    let without: Vec<Fault> = faults.iter().copied().filter(|f| f != fault).collect();
                    difference(model.levels([x, y], &without).unwrap(), value) > 0.0
                });
                all_act && difference(value.map(f64::round), theirs) <= AGREES
            };
            match subsets.iter().find(|faults| explains(faults)) {
                Some(faults) => {
                    *causes
                        .entry(faults.iter().map(|f| format!("{f:?}")).collect::<Vec<_>>().join(" + "))
                        .or_default() += 1
                }
                None => {
                    missed += 1;
                    eprintln!("{} {x} {y}: {theirs:?}, here {ours:?}", golden.name);
                }
            }
        }
        let all = width * height;
        let explained: u32 = causes.values().sum();
        eprintln!(
            "| {} | {all} | {} | {} | {empty} | {explained} | {missed} | {causes:?} |",
            golden.name,
            within[0] + within[1],
            within.iter().sum::<u32>()
        );
        assert_eq!(within.iter().sum::<u32>() + empty + explained + missed, all);
        // An explanation is for the few; these are frames of the same picture.
        assert!(f64::from(explained) < 0.015 * f64::from(all), "{}: {explained}", golden.name);
        unexplained.push((golden.name.clone(), missed));
    }
    assert!(unexplained.iter().all(|(_, count)| *count == 0), "{unexplained:?}");
}

/// The ideal frame as it should have come: with its fog.
fn in_fog(golden: &Golden) -> IdealFrame {
    let mut ideal = golden.ideal.clone();
    let Some(fog) = &golden.paper.fog else { return ideal };
    let geometry = ideal.geometry;
    for (i, (color, w)) in ideal.color_rgba.chunks_exact_mut(4).zip(&ideal.inverse_depth).enumerate() {
        let at_px =
            DVec2::new((i as u32 % geometry.size_px[0]).into(), (i as u32 / geometry.size_px[0]).into());
        let uv = (at_px - geometry.principal_px) / geometry.focal_px;
        let stored =
            DVec3::from_array([color[0], color[1], color[2]].map(|v| f64::from(srgb_from_linear(v))));
        let foggy = fog.over(stored, uv, f64::from(*w)).to_array().map(|v| linear_from_srgb(v as f32));
        color[..3].copy_from_slice(&foggy);
    }
    ideal
}

/// camsim's own methods on the same inputs: how far the paper's source coordinates are from the exact ones,
/// and the pictures from each other.
#[test]
fn own_methods_beside_the_reference_programs() {
    let Some(goldens) = goldens() else { return };
    eprintln!(
        "| case | rk2 from exact, p50 px | p99 | max | levels RMS | share > 2 | with stored values RMS | share > 2 |\n|---|---|---|---|---|---|---|---|"
    );
    for golden in &goldens {
        let ideal = in_fog(golden);
        let exact = Pipeline::new(&golden.spec, &ideal, &golden.motion, &Settings::default()).unwrap();
        let heun = Pipeline::new(&golden.spec, &golden.ideal, &golden.motion, &golden.paper).unwrap();
        let stored = Settings { solver: Some(Solver::Reproject), ..golden.paper.clone() };
        let stored = Pipeline::new(&golden.spec, &golden.ideal, &golden.motion, &stored).unwrap();
        let [width, height] = golden.spec.size_px;
        let mut off_px = Vec::new();
        for (x, y) in (0..height).step_by(3).flat_map(|y| (0..width).step_by(3).map(move |x| (x, y))) {
            for phase in [-0.5, 0.5] {
                if let (Ok(a), Ok(b)) = (exact.source([x, y], phase), heun.source([x, y], phase)) {
                    off_px.push(a.position_px.distance(b.position_px));
                }
            }
        }
        off_px.sort_by(f64::total_cmp);
        let at = |share: f64| off_px[((off_px.len() as f64 * share) as usize).min(off_px.len() - 1)];
        let weights = vignette_weights(
            &golden.vignette,
            golden.spec.size_px,
            golden.spec.photometric.vignette_thresholds,
        );
        let compare = |frame: &RenderedFrame| {
            let (mut square, mut seen, mut over) = (0.0, 0_u32, 0_u32);
            for (i, weight) in weights.iter().enumerate() {
                let (x, y) = (i as u32 % width, i as u32 / width);
                let (Some(ours), true) = (levels_of(frame, i), *weight > 0.0) else { continue };
                let [r, g, b, _] = golden.output.get_pixel(x, y).0;
                let off = difference(ours, [r, g, b].map(f64::from));
                square += off * off;
                seen += 1;
                over += u32::from(off > AGREES);
            }
            ((square / f64::from(seen)).sqrt(), 100.0 * f64::from(over) / f64::from(seen))
        };
        let (rms, over) = compare(&exact.render(Some(&golden.vignette)));
        let (stored_rms, stored_over) = compare(&stored.render(Some(&golden.vignette)));
        let (p50, p99, worst) = (at(0.5), at(0.99), at(1.0));
        eprintln!(
            "| {} | {p50:.1e} | {p99:.1e} | {worst:.1e} | {rms:.2} | {over:.2} % | {stored_rms:.2} | {stored_over:.2} % |",
            golden.name
        );
        // The law of its step, e = r theta step^2 / 6, gives 0.06 px for 18 deg at 560 px; at steps of depth
        // it is worse.
        assert!(p50 < 0.1, "{}: {p50}", golden.name);
    }
}
