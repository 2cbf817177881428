//! What the parts of a camera cost: written so that they change nothing, and at work.

use std::time::Duration;

use crate::{
    flight::{
        Outcome,
        comparison::{Comparison, MS_TO_FIRST, PROCESSOR_MS, Renderers, TIMES_FIRST},
        rounds::RoundLimits,
    },
    scenario::{FRAMES, all_effects_with},
};

const LIMITS: RoundLimits = RoundLimits { burst: 8, rounds: 15, budget: Duration::from_secs(120) };

/// A key with values that change nothing (of shadows, the same light without them), and with others. The empty key is the scenario as it is, once more: it
/// shows how far two rows differ by chance.
const FEATURES: [(&str, &str, Option<&str>, Option<&str>); 10] = [
    ("the same again", "", Some(""), None),
    (
        "chromatic aberration",
        "camera.chromatic",
        Some("{ red_scale = [1.0], blue_scale = [1.0] }"),
        Some("{ red_scale = [1.001], blue_scale = [0.999] }"),
    ),
    (
        "vignetting",
        "camera.photometric.vignetting",
        Some("{ cos_power = 0.0 }"),
        Some("{ cos_power = 4.0, polynomial = [-0.2, 0.05] }"),
    ),
    ("image circle", "camera.image_circle", Some("{ radius_px = 2000.0 }"), Some("{ radius_px = 300.0 }")),
    (
        "point spread and glare",
        "camera.point_spread",
        None,
        Some("{ sigma_px = 0.7, f_number = 8.0, pixel_um = 3.45, glare = 0.02 }"),
    ),
    (
        "sensor, Bayer, demosaiced",
        "camera.sensor",
        None,
        Some("{ model = \"imx250\", white_e = 8000.0, mosaic = \"rggb\" }"),
    ),
    ("automatic exposure", "camera.auto_exposure", None, Some("{ target = 0.18, nominal_ms = 24.0 }")),
    (
        "timing faults",
        "camera.timing",
        Some("{ jitter_ms = 0.0 }"),
        Some("{ jitter_ms = 1.0, drift_ppm = 20.0, late_ms = 2.0, double_probability = 0.05 }"),
    ),
    (
        "shadows of a sun at 35 degrees",
        "scene.light",
        Some("{ sun_azimuth_deg = 150.0, sun_elevation_deg = 35.0 }"),
        Some("{ sun_azimuth_deg = 150.0, sun_elevation_deg = 35.0, shadows = true }"),
    ),
    (
        "shadows of a sun at 14 degrees",
        "scene.light",
        Some("{ sun_azimuth_deg = 150.0, sun_elevation_deg = 14.0 }"),
        Some("{ sun_azimuth_deg = 150.0, sun_elevation_deg = 14.0, shadows = true }"),
    ),
];

/// Each part of a camera over the flight with all effects, which has none of them.
pub fn features(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let mut table = Comparison::new(renderers);
    let color = &[camsim::core::scenario::Channel::Color];
    table.add("none of these", &all_effects_with(&[])?, color, false)?;
    for (name, key, without_effect, at_work) in
        FEATURES.into_iter().take(if is_measuring { FEATURES.len() } else { 2 })
    {
        for (how, value) in [("without effect", without_effect), ("at work", at_work)] {
            let Some(value) = value else { continue };
            let mut sets = vec![(key, value.to_owned())];
            match key {
                "" => sets.clear(),
                // A sensor has noise of its own.
                "camera.sensor" => sets.push(("camera.photometric.noise_sigma", "0.0".to_owned())),
                _ => {}
            }
            let sequence = all_effects_with(&sets)?;
            let name = if key.is_empty() { name.to_owned() } else { format!("{name}, {how}") };
            table.add(name, &sequence, color, false)?;
        }
    }
    let limits = LIMITS.or_smoke_test(is_measuring);
    table.measure(FRAMES, limits)?;
    table.print("camera", limits, &[MS_TO_FIRST, TIMES_FIRST, PROCESSOR_MS]);
    Ok(())
}
