//! `camsim apply` with the paper's methods compared with frames of the reference program
//! (docs/reproduction/goldens.md).
//!
//! Needs the frames in CAMSIM_DATA/golden. Every pixel that differs by more than two grey levels must be
//! explained by a known fault of the reference program: a model with that fault must give its value.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use camsim_core::{
    apply::{IdealFrame, Motion, Pipeline, Settings},
    camera::CameraModel,
    frame::RenderedFrame,
    photometric::{GrayImage, vignette_weights},
    scenario::{CameraSpec, FieldOr, LensModel, LensSpec, PhotometricSpec, Preset, ShutterSpec, Solver},
    scene::{linear_from_srgb, srgb_from_linear},
    temporal::displacement,
};
use camsim_io::{frame_file::read_frame, raster::pictures::read_gray_image};
use glam::{DVec2, DVec3};
use image::RgbaImage;

const SKY: [u8; 3] = [166, 217, 255];
const FOG: [f64; 3] = [0.5, 0.6, 0.7];
/// Largest difference that counts as equal, grey levels.
const TOLERANCE_DN: f64 = 2.0;

/// A frame of the reference program in camsim's conventions.
struct Golden {
    name: String,
    /// Parameters of the reference program by name.
    numbers: BTreeMap<String, f64>,
    spec: CameraSpec,
    ideal: IdealFrame,
    motion: Motion,
    paper: Settings,
    vignette: GrayImage,
    /// Ideal colour as the reference program sampled it; alpha 0 is sky.
    raw: RgbaImage,
    /// Frame of the reference program.
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

/// Converts the reference program's files to camera and frame.
// Long because: one list of parameters and conventions.
fn golden(folder: &Path) -> Golden {
    let find = |ending: &str| {
        let mut paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        paths.find(|path| path.to_str().unwrap().ends_with(ending)).unwrap()
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
        // The reference program has pixel centres at half-integers.
        principal_point_px: Some([n("ox") - 0.5, n("oy") - 0.5]),
        lens: if coefficients.iter().any(|k| *k != 0.0) {
            LensSpec { model: LensModel::BrownConrady, coefficients }
        } else {
            LensSpec::default()
        },
        shutter: ShutterSpec {
            // `td` has the sign of delay_ms.
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
    // The principal point of the ideal frame is its centre. The reference program includes td and half of ti
    // in its pose.
    let toml = format!(
        "color = \"color.png\"\ndepth = \"depth.png\"\ndepth_encoding = \"packed24\"\nfocal_px = [{}, \
         {}]\ninstant_ms = {}\n[motion]\nvelocity_m_s = [{}, {}, {}]\nangular_rate_rad_s = [{}, {}, {}]\n",
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

/// Faults of the reference program that are visible in these frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    /// A vignette value between the thresholds is not scaled, and jumps to 1 at the upper one. The paper has
    /// min(v / t2, 1).
    VignetteJump,
    /// The vignette texture is filtered with a black border.
    VignetteBorder,
    /// Sky is decided by the filtered alpha, so that pixels at the skyline mix with the hidden colour of sky
    /// texels, or become sky.
    SkyAfterFilter,
    /// Filter weights have eight bits: an alpha within a level of one half counts as sky.
    TieIsSky,
    /// Filter weights have eight bits: an alpha within a level of one half counts as ground.
    TieIsGround,
    /// Sky has the cleared depth of 65.281 km and moves with translation, by up to half a pixel.
    SkyIsNear,
    /// The ray for fog is relative to the principal point instead of the image centre.
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

/// A second implementation of the paper's gather, fog and photometric stages, with optional faults.
struct FaultModel<'a> {
    golden: &'a Golden,
    pipeline: &'a Pipeline<'a>,
    camera: &'a CameraModel,
}

impl FaultModel<'_> {
    /// Grey levels of a pixel; `None` where its path leaves the ideal frame.
    fn levels(&self, pixel: [u32; 2], faults: &[Fault]) -> Option<[f64; 3]> {
        let has = |fault| faults.contains(&fault);
        let n = |key: &str| self.golden.numbers[key];
        let uv = self.camera.unproject(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])))?;
        let inverse_depth = self.pipeline.source(pixel, 0.0).ok()?.inverse_depth;
        let is_sky = inverse_depth == 0.0;
        let source_px = |phase: f64| {
            if !(is_sky && has(Fault::SkyIsNear)) {
                return Some(self.pipeline.source(pixel, phase).ok()?.position_px);
            }
            // Row times of the reference program, from the ideal frame's instant.
            let row = f64::from(pixel[1]);
            let interlace_s = if pixel[1].is_multiple_of(2) { n("ti") } else { 0.0 };
            let dt_s =
                0.5 * n("ti") + n("tr") * ((row + 0.5) / n("height") - 0.5) - interlace_s + phase * n("te");
            let twist = self.golden.motion.twist_at(0.0);
            let moved = displacement::rk2(uv, 1.0 / 65_281.0, &twist, dt_s, 2.5_f64.to_radians());
            Some(self.golden.ideal.geometry.px_from_point(moved.extend(1.0)))
        };
        let (begin_px, end_px) = (source_px(-0.5)?, source_px(0.5)?);
        let samples = n("extra_sampling_points") + 2.0;
        // Alpha below which a filtered texel is sky; with `None` sky is decided per texel, before filtering.
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
            let offset = DVec2::new(0.5 * n("width") - n("ox"), 0.5 * n("height") - n("oy"))
                / DVec2::new(n("fx"), n("fy"));
            let ray = if has(Fault::FogCentre) { uv + offset } else { uv };
            let fog_fraction = (ray.extend(1.0).length() / inverse_depth / n("fog_end")).clamp(0.0, 1.0);
            color = color.lerp(255.0 * DVec3::from_array(FOG), fog_fraction);
        }
        let weight = self.vignette(pixel, has(Fault::VignetteJump), has(Fault::VignetteBorder));
        Some((color * weight * n("day_light")).to_array())
    }

    /// Bilinear stored colour, grey levels.
    fn color(&self, position_px: DVec2, sky_below: Option<f64>) -> DVec3 {
        let raw = &self.golden.raw;
        let last = DVec2::new(f64::from(raw.width() - 1), f64::from(raw.height() - 1));
        let position_px = position_px.clamp(DVec2::ZERO, last);
        let mut sum = glam::DVec4::ZERO;
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let corner = position_px.floor() + DVec2::new(dx, dy);
            let weight = (1.0 - (position_px.x - corner.x).abs()) * (1.0 - (position_px.y - corner.y).abs());
            let texel = corner.min(last);
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

    /// Weight of the vignette.
    fn vignette(&self, [x, y]: [u32; 2], has_jump: bool, has_border: bool) -> f64 {
        let map = &self.golden.vignette;
        let [t1, t2] = self.golden.spec.photometric.vignette_thresholds;
        let size = DVec2::new(f64::from(map.size_px[0]), f64::from(map.size_px[1]));
        let [width, height] = self.golden.spec.size_px.map(f64::from);
        let position_px =
            (DVec2::new(f64::from(x), f64::from(y)) + 0.5) * size / DVec2::new(width, height) - 0.5;
        let mut value = 0.0;
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let texel = position_px.floor() + DVec2::new(dx, dy);
            let weight = (1.0 - (position_px.x - texel.x).abs()) * (1.0 - (position_px.y - texel.y).abs());
            let clamped = texel.clamp(DVec2::ZERO, size - 1.0);
            if texel == clamped || !has_border {
                value += weight * f64::from(map.values[(clamped.y * size.x + clamped.x) as usize]);
            }
        }
        match value {
            v if v < t1 => 0.0,
            v if has_jump => {
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

/// Grey levels of a rendered pixel, rounded as in a PNG; `None` where alpha is 0.
fn rendered_levels(frame: &RenderedFrame, i: usize) -> Option<[f64; 3]> {
    let p = &frame.color_rgba()[4 * i..4 * i + 4];
    (p[3] > 0.0).then(|| [p[0], p[1], p[2]].map(|v| f64::from((255.0 * srgb_from_linear(v)).round())))
}

/// The reference program's test whether an iterate of the lens inverse left the ideal frame; it uses the
/// principal point instead of the centre.
fn fails_the_margin_test(golden: &Golden, uv: DVec2) -> bool {
    let n = |key: &str| golden.numbers[key];
    let position_px = uv / n("extra_margin") * DVec2::new(n("fx"), n("fy")) + DVec2::new(n("ox"), n("oy"));
    position_px.cmplt(DVec2::ZERO).any() || position_px.x > n("width") || position_px.y > n("height")
}

#[test]
fn papers_methods_agree_with_the_reference_program_up_to_known_faults() {
    let Some(goldens) = goldens() else { return };
    let mut unexplained = Vec::new();
    eprintln!(
        "| case | pixels | within 1 | within 2 | empty in both | explained | unexplained | by cause \
         |\n|---|---|---|---|---|---|---|---|"
    );
    for golden in &goldens {
        let pipeline = Pipeline::new(&golden.spec, &golden.ideal, &golden.motion, &golden.paper).unwrap();
        let rendered = pipeline.render(Some(&golden.vignette));
        let camera = CameraModel::from_spec(&golden.spec).unwrap();
        let model = FaultModel { golden, pipeline: &pipeline, camera: &camera };
        let (mut within, mut empty) = ([0_u32; 3], 0_u32);
        let mut causes: BTreeMap<String, u32> = BTreeMap::new();
        let mut unexplained_count = 0;
        let [width, height] = golden.spec.size_px;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let [r, g, b, _] = golden.output.get_pixel(x, y).0;
            let theirs = [r, g, b].map(f64::from);
            let (red, black) = (theirs == [255.0, 0.0, 0.0], theirs == [0.0; 3]);
            let Some(ours) = rendered_levels(&rendered, (y * width + x) as usize) else {
                // Without a source in the ideal frame camsim gives alpha 0; the reference program gives
                // black, fogged black, or red for "no convergence".
                let fogged = golden.paper.fog.is_some() && {
                    let fog_fraction = theirs[2] / FOG[2];
                    fog_fraction > 0.0 && difference(theirs, FOG.map(|v| fog_fraction * v)) <= TOLERANCE_DN
                };
                empty += u32::from(red || black || fogged);
                unexplained_count += u32::from(!red && !black && !fogged);
                continue;
            };
            let error_dn = difference(ours, theirs);
            if error_dn <= TOLERANCE_DN {
                within[error_dn as usize] += 1;
                continue;
            }
            if red {
                let uv = camera.unproject(DVec2::new(f64::from(x), f64::from(y))).unwrap();
                if fails_the_margin_test(golden, uv) {
                    *causes.entry("red: margin test with the principal point".into()).or_default() += 1;
                } else {
                    unexplained_count += 1;
                }
                continue;
            }
            // The smallest set of faults that gives the reference value; each must have an effect.
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
                "{}: the model of this test differs from camsim at {x} {y}: {plain:?} {ours:?}",
                golden.name
            );
            let explains = |faults: &Vec<Fault>| {
                let value = model.levels([x, y], faults).unwrap();
                let all_have_effect = faults.iter().all(|fault| {
                    let without: Vec<Fault> = faults.iter().copied().filter(|f| f != fault).collect();
                    difference(model.levels([x, y], &without).unwrap(), value) > 0.0
                });
                all_have_effect && difference(value.map(f64::round), theirs) <= TOLERANCE_DN
            };
            match subsets.iter().find(|faults| explains(faults)) {
                Some(faults) => {
                    *causes
                        .entry(faults.iter().map(|f| format!("{f:?}")).collect::<Vec<_>>().join(" + "))
                        .or_default() += 1
                }
                None => {
                    unexplained_count += 1;
                    eprintln!("{} {x} {y}: {theirs:?}, camsim {ours:?}", golden.name);
                }
            }
        }
        let all = width * height;
        let explained: u32 = causes.values().sum();
        eprintln!(
            "| {} | {all} | {} | {} | {empty} | {explained} | {unexplained_count} | {causes:?} |",
            golden.name,
            within[0] + within[1],
            within.iter().sum::<u32>()
        );
        assert_eq!(within.iter().sum::<u32>() + empty + explained + unexplained_count, all);
        // Faults must explain few pixels only.
        assert!(f64::from(explained) < 0.015 * f64::from(all), "{}: {explained}", golden.name);
        unexplained.push((golden.name.clone(), unexplained_count));
    }
    assert!(unexplained.iter().all(|(_, count)| *count == 0), "{unexplained:?}");
}

/// The ideal frame with fog applied.
fn with_fog(golden: &Golden) -> IdealFrame {
    let mut ideal = golden.ideal.clone();
    let Some(fog) = &golden.paper.fog else { return ideal };
    let geometry = ideal.geometry;
    for (i, (color, w)) in ideal.color_rgba.chunks_exact_mut(4).zip(&ideal.inverse_depth).enumerate() {
        let position_px =
            DVec2::new((i as u32 % geometry.size_px[0]).into(), (i as u32 / geometry.size_px[0]).into());
        let uv = (position_px - geometry.principal_px) / geometry.focal_px;
        let stored =
            DVec3::from_array([color[0], color[1], color[2]].map(|v| f64::from(srgb_from_linear(v))));
        let foggy = fog.over(stored, uv, f64::from(*w)).to_array().map(|v| linear_from_srgb(v as f32));
        color[..3].copy_from_slice(&foggy);
    }
    ideal
}

/// camsim's default methods on the same inputs: errors of the paper's source coordinates and differences
/// between the pictures.
#[test]
fn default_methods_are_close_to_the_papers() {
    let Some(goldens) = goldens() else { return };
    eprintln!(
        "| case | rk2 from exact, p50 px | p99 | max | levels RMS | share > 2 | with stored values RMS | \
         share > 2 |\n|---|---|---|---|---|---|---|---|"
    );
    for golden in &goldens {
        let ideal = with_fog(golden);
        let exact = Pipeline::new(&golden.spec, &ideal, &golden.motion, &Settings::default()).unwrap();
        let heun = Pipeline::new(&golden.spec, &golden.ideal, &golden.motion, &golden.paper).unwrap();
        let stored = Settings { solver: Some(Solver::Reproject), ..golden.paper.clone() };
        let stored = Pipeline::new(&golden.spec, &golden.ideal, &golden.motion, &stored).unwrap();
        let [width, height] = golden.spec.size_px;
        let mut error_px = Vec::new();
        for (x, y) in (0..height).step_by(3).flat_map(|y| (0..width).step_by(3).map(move |x| (x, y))) {
            for phase in [-0.5, 0.5] {
                if let (Ok(a), Ok(b)) = (exact.source([x, y], phase), heun.source([x, y], phase)) {
                    error_px.push(a.position_px.distance(b.position_px));
                }
            }
        }
        error_px.sort_by(f64::total_cmp);
        let quantile = |q: f64| error_px[((error_px.len() as f64 * q) as usize).min(error_px.len() - 1)];
        let weights = vignette_weights(
            &golden.vignette,
            golden.spec.size_px,
            golden.spec.photometric.vignette_thresholds,
        );
        let compare = |frame: &RenderedFrame| {
            let (mut square_sum, mut count, mut over) = (0.0, 0_u32, 0_u32);
            for (i, weight) in weights.iter().enumerate() {
                let (x, y) = (i as u32 % width, i as u32 / width);
                let (Some(ours), true) = (rendered_levels(frame, i), *weight > 0.0) else { continue };
                let [r, g, b, _] = golden.output.get_pixel(x, y).0;
                let error_dn = difference(ours, [r, g, b].map(f64::from));
                square_sum += error_dn * error_dn;
                count += 1;
                over += u32::from(error_dn > TOLERANCE_DN);
            }
            ((square_sum / f64::from(count)).sqrt(), 100.0 * f64::from(over) / f64::from(count))
        };
        let (rms, over) = compare(&exact.render(Some(&golden.vignette)));
        let (stored_rms, stored_over) = compare(&stored.render(Some(&golden.vignette)));
        let (p50, p99, worst) = (quantile(0.5), quantile(0.99), quantile(1.0));
        eprintln!(
            "| {} | {p50:.1e} | {p99:.1e} | {worst:.1e} | {rms:.2} | {over:.2} % | {stored_rms:.2} | \
             {stored_over:.2} % |",
            golden.name
        );
        // The step error e = r theta step^2 / 6 gives 0.06 px for 18 deg at 560 px; at silhouettes it is
        // larger.
        assert!(p50 < 0.1, "{}: {p50}", golden.name);
    }
}
