//! Tables by channels, frame size, blur and effects.

use std::{convert::Infallible, sync::Arc, time::Duration};

use camsim::{
    core::{frame::COORDS_CHANNELS, scenario::Channel, sequence::Sequence},
    engine::Engine,
    lab::timing::quartiles,
};

use crate::{
    flight::{
        Ablation, Outcome,
        comparison::{Comparison, MS_TO_FIRST, PRESET, PROCESSOR_MS, Renderers, TIMES_PRESET},
        rounds::{RoundLimits, Variant, median_ratio},
    },
    scenario::{FRAMES, all_effects_with, paper_preset},
};

const LIMITS: RoundLimits = RoundLimits { burst: 8, rounds: 15, budget: Duration::from_secs(50) };
/// Large frames take seconds.
const LIMITS_LARGE: RoundLimits = RoundLimits { burst: 4, rounds: 7, budget: Duration::from_secs(60) };
const COLOR: &[Channel] = &[Channel::Color];

const EFFECTS: [(&str, Ablation); 7] = [
    ("all effects", Ablation::None),
    ("- vignette and noise", Ablation::Photometric),
    ("- motion blur", Ablation::Blur),
    ("- rolling shutter", Ablation::RollingShutter),
    ("- blur and rolling shutter", Ablation::Time),
    ("- lens", Ablation::Lens),
    ("- all of these: a perfect camera", Ablation::All),
];

/// Frame rates with and without truth channels.
pub fn renderers(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let all_effects = all_effects_with(&[])?;
    let truth = [Channel::Color, Channel::Depth, Channel::Coords, Channel::Valid];
    let rows = [
        ("all effects", Ablation::None, COLOR),
        ("all effects, color, depth, coords, valid", Ablation::None, &truth),
        ("- motion blur", Ablation::Blur, COLOR),
        ("- lens", Ablation::Lens, COLOR),
        ("- all effects: a perfect camera", Ablation::All, COLOR),
    ];
    let mut table = Comparison::new(renderers);
    for (i, (name, ablation, channels)) in
        rows[..if is_measuring { rows.len() } else { 1 }].iter().enumerate()
    {
        table.add(*name, &ablation.apply(&all_effects)?, channels, false)?;
        if i == 0 {
            table.add_preset(None, &paper_preset()?, COLOR)?;
        }
    }
    let limits = LIMITS.or_smoke_test(is_measuring);
    table.measure(FRAMES, limits)?;
    table.print("variant", limits, &[]);
    Ok(())
}

/// Frames of several sizes. The exposure path has the same length in pixels in all of them.
pub fn size(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let sizes: &[[u32; 2]] = if is_measuring {
        &[[640, 480], [320, 240], [1280, 960], [2560, 1920], [3840, 2160]]
    } else {
        &[[320, 240]]
    };
    let mut table = Comparison::new(renderers);
    for (i, &[width, height]) in sizes.iter().enumerate() {
        let scale = f64::from(width) / 640.0;
        // 3840x2160 is a strip across the middle of 3840x2880.
        let principal_y = 226.2 * scale - 0.5 * (480.0 * scale - f64::from(height));
        let sequence = all_effects_with(&[
            ("camera.size_px", format!("[{width}, {height}]")),
            ("camera.focal_px", format!("[{0}, {0}]", 307.6 * scale)),
            ("camera.principal_point_px", format!("[{}, {principal_y}]", 305.1 * scale)),
            ("camera.shutter.exposure_ms", (24.0 / scale).to_string()),
        ])?;
        table.add(format!("{width} x {height}"), &sequence, COLOR, false)?;
        if i == 0 {
            table.add_preset(None, &paper_preset()?, COLOR)?;
        }
    }
    let limits = LIMITS_LARGE.or_smoke_test(is_measuring);
    table.measure(FRAMES, limits)?;
    let columns = [
        PROCESSOR_MS,
        ("processor ns a pixel", |variant, _, _| {
            format!("{:.0}", 1e6 * quartiles(&variant.processor_ms)[1] / pixels(variant))
        }),
        ("processor time a pixel over the first's", |variant, first, _| {
            let ratio = median_ratio(&variant.processor_ms, &first.processor_ms);
            format!("{:.2}", ratio * pixels(first) / pixels(variant))
        }),
    ];
    table.print("frame", limits, &columns);
    Ok(())
}

/// Pixels of a variant's frames.
fn pixels(variant: &Variant<'_>) -> f64 {
    let [width, height] = variant.session.planner().sequence().scenario.camera.size_px;
    f64::from(width) * f64::from(height)
}

/// Exposures from none to a path of about 100 px.
pub fn blur(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let exposures_ms: &[f64] = if is_measuring { &[24.0, 0.0, 2.4, 7.2, 72.0, 240.0] } else { &[24.0] };
    // The preset takes as many samples as it is told, whatever the length of the path.
    let preset = |samples: u32| {
        all_effects_with(&[
            ("quality.preset", "\"paper\"".into()),
            ("quality.blur_samples", samples.to_string()),
        ])
    };
    let mut table = Comparison::new(renderers);
    for exposure_ms in exposures_ms {
        let sequence = all_effects_with(&[("camera.shutter.exposure_ms", exposure_ms.to_string())])?;
        let path_px = median_path_px(&renderers.cpu, &sequence)?;
        table.add(format!("{exposure_ms} ms | {path_px:.1}"), &sequence, COLOR, false)?;
    }
    for samples in [100, 10] {
        let name = format!("24 ms, {PRESET}, {samples} samples | ");
        table.add_preset(Some(&name), &preset(samples)?, COLOR)?;
    }
    let limits = LIMITS.or_smoke_test(is_measuring);
    table.measure(FRAMES, limits)?;
    let heading = "exposure | exposure path of a pixel, median, px";
    table.print(heading, limits, &[MS_TO_FIRST, TIMES_PRESET, PROCESSOR_MS]);
    Ok(())
}

/// The full camera, and without each of its effects.
pub fn effects(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    each_effect_left_out(renderers, &all_effects_with(&[])?, "variant", is_measuring)
}

/// As [`effects`], but with one sampling plan for all variants, whatever the error: differences are the costs
/// of the stages.
pub fn alike(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let sampling = [
        ("quality.ideal_scale", "1.0"),
        ("quality.ideal_samples", "1"),
        ("quality.footprint_taps", "1"),
        ("quality.silhouettes", "\"plain\""),
        ("quality.frames_per_ideal", "4"),
        ("quality.max_error_dn", "8"),
    ];
    let all_effects = all_effects_with(&sampling.map(|(key, value)| (key, value.to_owned())))?;
    each_effect_left_out(renderers, &all_effects, "variant, all sampled alike", is_measuring)
}

fn each_effect_left_out(
    renderers: &Renderers,
    all_effects: &Arc<Sequence>,
    heading: &str,
    is_measuring: bool,
) -> Outcome<()> {
    let mut table = Comparison::new(renderers);
    for (name, ablation) in EFFECTS.into_iter().take(if is_measuring { EFFECTS.len() } else { 1 }) {
        table.add(name, &ablation.apply(all_effects)?, COLOR, false)?;
        if ablation == Ablation::None {
            table.add_preset(None, &paper_preset()?, COLOR)?;
        }
    }
    let limits = LIMITS.or_smoke_test(is_measuring);
    table.measure(FRAMES, limits)?;
    table.print(heading, limits, &[MS_TO_FIRST, TIMES_PRESET, PROCESSOR_MS]);
    Ok(())
}

/// Frames in which exposure paths are measured, and the number of parts of each path.
const PATH_FRAMES: [u64; 4] = [40, 56, 72, 88];
const PATH_PARTS: u8 = 12;

/// Median length of the exposure path of a pixel, in pixels of the camera: summed over the source coordinates
/// at instants of the exposure.
fn median_path_px(engine: &Engine, sequence: &Arc<Sequence>) -> Outcome<f64> {
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Coords])?;
    let mut medians_px = Vec::new();
    for frame in PATH_FRAMES {
        let mut previous: Option<Vec<[f32; COORDS_CHANNELS]>> = None;
        let mut paths_px = Vec::new();
        for part in 0..=PATH_PARTS {
            session.set_coords_phase(f32::from(part) / f32::from(PATH_PARTS) - 0.5);
            session.render::<Infallible>([frame], &mut |finished| {
                let coords = finished.frame.coords().unwrap_or_default().to_vec();
                let scale = finished.plan.ideal.focal_px.x / sequence.scenario.camera.focal_px[0];
                paths_px.resize(coords.len(), 0.0);
                for ((path_px, new), old) in paths_px.iter_mut().zip(&coords).zip(previous.iter().flatten()) {
                    *path_px += f64::from((new[2] - old[2]).hypot(new[3] - old[3])) / scale;
                }
                previous = Some(coords);
                Ok(())
            })?;
        }
        let finite: Vec<f64> = paths_px.into_iter().filter(|path_px| path_px.is_finite()).collect();
        medians_px.push(quartiles(&finite)[1]);
    }
    Ok(quartiles(&medians_px)[1])
}
