//! The cost of 5000 houses on a terrain.

use std::{convert::Infallible, sync::Arc, time::Duration};

use camsim::{
    core::{
        scenario::Channel,
        scene::{ModelLod, SceneLods},
        sequence::Sequence,
    },
    lab::timing::quartiles,
    plan::FramePlan,
};

use crate::{
    flight::{
        Outcome,
        comparison::{Comparison, NO_ADAPTER, PRESET, Renderers},
        rounds::{RoundLimits, Variant, median_ratio},
        with_paper_preset,
    },
    scenario::{FRAMES, HOUSES, sequence_with},
};

const LIMITS: RoundLimits = RoundLimits { burst: 8, rounds: 5, budget: Duration::from_secs(60) };
const COLOR: &[Channel] = &[Channel::Color];
/// Pitch angles of the mount, degrees.
const PITCHES_DEG: [f64; 3] = [-35.0, -50.0, -65.0];
/// Scale of the ideal frame if terrain and houses are sampled alike.
const IDEAL_SCALE: f64 = 2.83;
/// Frame whose plan the table shows.
const PLAN_FRAME: u64 = 40;

/// Terrain with 5000 houses beside the terrain alone: both with their own plans, and both from ideal frames
/// of one scale without silhouette rays.
pub fn houses(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let limits = LIMITS.or_smoke_test(is_measuring);
    println!(
        "\n{HOUSES}: terrain alone, and with 5000 houses. Houses in view, ideal scales and predicted picture \
         errors\nare those of frame {PLAN_FRAME}. Each time: median ms a frame of the terrain, with houses, \
         median of the ratios;\n{} rounds of {} frames, all variants in turn\n",
        limits.rounds, limits.burst
    );
    let titles = [
        "mount, sampling",
        "houses in view",
        "ideal scales",
        "predicted error, DN",
        "cpu, ms a frame",
        "gpu, ms a frame",
        &format!("{PRESET} ({}), with houses, ms a frame", renderers.preset().0),
        "cpu, processor ms a frame",
        "gpu, processor ms a frame",
    ];
    println!("| {} |\n|{}", titles.join(" | "), "---|".repeat(titles.len()));
    let alike = [
        ("quality.ideal_scale", IDEAL_SCALE.to_string()),
        ("quality.ideal_samples", "1".to_owned()),
        ("quality.silhouettes", "\"plain\"".to_owned()),
        ("quality.frames_per_ideal", "1".to_owned()),
    ];
    for pitch_deg in PITCHES_DEG.into_iter().take(if is_measuring { PITCHES_DEG.len() } else { 1 }) {
        for (sampling, sets) in
            [("as planned", &[][..]), ("alike", &alike[..3]), ("alike, an ideal frame each", &alike)]
        {
            let pitch = ("camera.mount.angles_deg", format!("[0.0, {pitch_deg:?}, 0.0]"));
            let with_houses = sequence_with(HOUSES, &[&[pitch], sets].concat())?;
            let mut terrain = Sequence::clone(&with_houses);
            Arc::make_mut(&mut terrain.scene).meshes.clear();
            let plans = [plan(renderers, &Arc::new(terrain.clone()))?, plan(renderers, &with_houses)?];
            let mut pair = Comparison::new(renderers);
            pair.add("terrain", &Arc::new(terrain), COLOR, false)?;
            pair.add("houses", &with_houses, COLOR, false)?;
            if sets.is_empty() {
                pair.add_preset(None, &with_paper_preset(&with_houses), COLOR)?;
            }
            pair.measure(FRAMES, limits)?;
            let both = |value: &dyn Fn(&FramePlan) -> String| plans.each_ref().map(value).join(", ");
            let mut cells = vec![
                format!("{pitch_deg} degrees, {sampling}"),
                houses_in_view(&plans[1], &with_houses).to_string(),
                both(&|plan| format!("{:.2}", plan.ideal.focal_px.x / plan.camera.focal_px.x)),
                both(&|plan| format!("{:.2}", predicted_dn(plan))),
            ];
            cells.extend([0, 1].map(|renderer| times(&pair, renderer, |variant| &variant.ms)));
            let preset = pair.variant(1, 2);
            cells.push(preset.map_or(String::new(), |preset| format!("{:.0}", quartiles(&preset.ms)[1])));
            cells.extend([0, 1].map(|renderer| times(&pair, renderer, |variant| &variant.processor_ms)));
            println!("| {} |", cells.join(" | "));
        }
    }
    Ok(())
}

/// Times of the terrain and of the terrain with houses, and their ratio.
fn times(
    pair: &Comparison<'_>,
    renderer: usize,
    times_ms: for<'v> fn(&'v Variant<'_>) -> &'v Vec<f64>,
) -> String {
    let (Some(terrain), Some(houses)) = (pair.variant(0, renderer), pair.variant(1, renderer)) else {
        return NO_ADAPTER.to_owned();
    };
    let (terrain_ms, houses_ms) = (times_ms(terrain), times_ms(houses));
    format!(
        "{:.0}, {:.0}, {:.2}",
        quartiles(terrain_ms)[1],
        quartiles(houses_ms)[1],
        median_ratio(houses_ms, terrain_ms)
    )
}

/// The plan of [`PLAN_FRAME`] on the cpu.
fn plan(renderers: &Renderers, sequence: &Arc<Sequence>) -> Outcome<FramePlan> {
    let session = renderers.cpu.session::<Infallible>(sequence.clone(), COLOR)?;
    Ok(session.planner().plan(PLAN_FRAME)?)
}

/// Predicted picture error without disocclusion and misregistration, DN.
fn predicted_dn(plan: &FramePlan) -> f64 {
    let predicted = &plan.predicted;
    predicted
        .resampling_dn
        .hypot(predicted.blur_dn)
        .hypot(predicted.silhouettes.map_or(0.0, |silhouettes| silhouettes.error_dn))
}

fn houses_in_view(plan: &FramePlan, sequence: &Sequence) -> u64 {
    let tolerance = plan.model_tolerance(&sequence.scenario.quality);
    ModelLod::new(&sequence.scene, &SceneLods::new(&sequence.scene), &plan.ideal_pose(), &tolerance).meshes
}
