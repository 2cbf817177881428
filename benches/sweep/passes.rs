//! Time of each pass, measured and as the planner's cost model predicts it.

use std::{convert::Infallible, ops::Range, sync::Arc};

use camsim::{
    core::{
        scenario::{Auto, Channel, Silhouettes},
        sequence::Sequence,
    },
    engine::{Engine, Session},
    lab::{
        cases::cases,
        timing::{quantile, quartiles},
    },
};

use crate::{
    flight::{
        Ablation, Outcome,
        comparison::{NO_ADAPTER, PRESET, Renderers},
    },
    scenario::{ALL_EFFECTS, HOUSES, all_effects_with, paper_preset, sequence_with},
};

const NO_TIME_STAMPS: &str = "no time stamps";

/// Milliseconds by stage, one entry per frame in which it ran.
pub type StageTimes = Vec<(String, Vec<f64>)>;

/// Where the time of a frame goes.
pub fn passes(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let all_effects = all_effects_with(&[])?;
    let cameras = [
        ("all effects", all_effects.clone()),
        ("a perfect camera", Ablation::All.apply(&all_effects)?),
        ("max_error_dn = 2", all_effects_with(&[("quality.max_error_dn", "2".into())])?),
    ];
    let frames = 32..if is_measuring { 64 } else { 33 };
    let mut columns: Vec<(String, Result<StageTimes, &str>)> = Vec::new();
    let [cpu, gpu] = renderers.columns();
    for (name, sequence) in &cameras {
        for (renderer, engine) in [("cpu", cpu), ("gpu", gpu)] {
            let times = match engine {
                Some(engine) => stage_times_of(engine, sequence, frames.clone())?,
                None => Err(NO_ADAPTER),
            };
            columns.push((format!("{name}, {renderer}"), times));
        }
    }
    let (renderer, engine) = renderers.preset();
    columns.push((format!("{PRESET}, {renderer}"), stage_times_of(engine, &paper_preset()?, frames)?));
    let mut stages: Vec<&str> = Vec::new();
    for (stage, _) in columns.iter().flat_map(|(_, times)| times.iter().flatten()) {
        if !stages.contains(&stage.as_str()) {
            stages.push(stage);
        }
    }
    println!("\nmedian ms over the frames that have the stage, and their number\n");
    let titles: Vec<&str> = columns.iter().map(|(title, _)| title.as_str()).collect();
    println!("| stage | {} |\n|---{}|", titles.join(" | "), "|---".repeat(titles.len()));
    for stage in stages {
        let cells = columns.iter().map(|(_, times)| match times {
            Ok(times) => match times.iter().find(|(name, _)| name == stage) {
                Some((_, ms)) => format!("{:.1}, {}", quartiles(ms)[1], ms.len()),
                None => String::new(),
            },
            Err(reason) => (*reason).to_owned(),
        });
        println!("| {stage} | {} |", cells.collect::<Vec<_>>().join(" | "));
    }
    Ok(())
}

/// [`stage_times`] of a new session.
fn stage_times_of(
    engine: &Engine,
    sequence: &Arc<Sequence>,
    frames: Range<u64>,
) -> Outcome<Result<StageTimes, &'static str>> {
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color])?;
    stage_times(engine, &mut session, frames)
}

/// Renders frames and collects the times of their stages.
pub fn stage_times(
    engine: &Engine,
    session: &mut Session<'_>,
    frames: Range<u64>,
) -> Outcome<Result<StageTimes, &'static str>> {
    if engine.gpu().is_some() && !session.time_passes() {
        return Ok(Err(NO_TIME_STAMPS));
    }
    let mut stages = StageTimes::new();
    session.render::<Infallible>(frames, &mut |finished| {
        let times = &finished.times;
        let always =
            [("cpu: plan", times.plan_ms), ("cpu: record", times.record_ms), ("cpu: read", times.read_ms)];
        let cpu_passes = [("cpu: ideal", times.ideal_ms), ("cpu: reverse", times.reverse_ms)];
        let cpu = always
            .into_iter()
            .chain(cpu_passes.into_iter().filter_map(|(name, ms)| Some((name, ms?))))
            .map(|(name, ms)| (name.to_owned(), ms));
        let gpu = times.passes.iter().map(|pass| (format!("gpu: {}", pass.name), pass.ms));
        for (name, ms) in cpu.chain(gpu) {
            match stages.iter_mut().find(|(known, _)| *known == name) {
                Some((_, all)) => all.push(ms),
                None => stages.push((name, vec![ms])),
            }
        }
        Ok(())
    })?;
    Ok(Ok(stages))
}

/// Cases of `camsim bench` for the cost model.
const COST_CASES: [&str; 7] =
    ["plane-30", "terrain-100", "lens-s3", "lens-tangential", "blender-plane", "exposure-100", "all-effects"];
/// Scenarios for the cost model, from frame 40.
const COST_SCENARIOS: [&str; 2] = [ALL_EFFECTS, HOUSES];
/// Scales of the ideal frame.
const COST_SCALES: [f64; 3] = [1.0, 1.6, 2.5];
/// Samples per pixel of the ideal frame.
const COST_IDEAL_SAMPLES: [u32; 2] = [1, 4];
/// Taps along one side of a footprint.
const COST_TAPS: [Auto<u32>; 4] = [Auto::Auto, Auto::Value(1), Auto::Value(2), Auto::Value(4)];
/// Exposure samples.
const COST_BLUR_SAMPLES: [u32; 2] = [3, 16];
/// Frames of each, rendered one by one so that nothing overlaps; the first compiles the pipelines.
const COST_FRAMES: u64 = 3;

/// Predicted time over measured time of the ideal and the reverse pass, over many sampling plans without
/// silhouette rays. The model is in milliseconds of the machine that it was fitted on: there the ratio should
/// be near 1; on others the ratios should be alike.
pub fn costs(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let mut sequences = Vec::new();
    for case in cases()?.into_iter().filter(|case| COST_CASES.contains(&case.name)).take(if is_measuring {
        COST_CASES.len()
    } else {
        1
    }) {
        sequences.push((case.name, case.sequence, 0));
    }
    for file in COST_SCENARIOS.into_iter().filter(|_| is_measuring) {
        sequences.push((file, sequence_with(file, &[])?, 40));
    }
    println!(
        "\nover all sampling plans: least and largest time of a pass, ms (each is the median of {} frames, \
         rendered one by\none); median and quartiles of predicted over measured time\n",
        COST_FRAMES - 1
    );
    let titles = ["cpu", "gpu"].map(|renderer| {
        ["ideal", "reverse"]
            .map(|pass| format!("{renderer}: {pass}, ms | predicted over measured"))
            .join(" | ")
    });
    println!("| case | sampling plans | {} |\n|{}", titles.join(" | "), "---|".repeat(10));
    for (name, sequence, first) in sequences {
        let plans = sampling_plans(&sequence);
        let mut cells = [const { String::new() }; 2];
        for (cell, engine) in cells.iter_mut().zip(renderers.columns()) {
            *cell = match engine {
                Some(engine) => cost_cells(engine, &plans, first)?,
                None => format!("{NO_ADAPTER} | | | "),
            };
        }
        println!("| {name} | {} | {} |", plans.len(), cells.join(" | "));
    }
    Ok(())
}

/// The sequence with every sampling plan.
fn sampling_plans(sequence: &Arc<Sequence>) -> Vec<Arc<Sequence>> {
    let has_blur = sequence.scenario.camera.shutter.exposure_ms > 0.0;
    let blur_samples = if has_blur { COST_BLUR_SAMPLES.map(Auto::Value).to_vec() } else { vec![Auto::Auto] };
    let mut plans = Vec::new();
    for blur_samples in blur_samples {
        for scale in COST_SCALES {
            for ideal_samples in COST_IDEAL_SAMPLES {
                for taps in COST_TAPS {
                    let mut sequence = Sequence::clone(sequence);
                    let quality = &mut sequence.scenario.quality;
                    quality.frames_per_ideal = 1;
                    quality.silhouettes = Silhouettes::Plain;
                    quality.ideal_scale = Auto::Value(scale);
                    quality.ideal_samples = Auto::Value(ideal_samples);
                    quality.footprint_taps = taps;
                    quality.blur_samples = blur_samples;
                    plans.push(Arc::new(sequence));
                }
            }
        }
    }
    plans
}

/// Four cells of the table of [`costs`].
fn cost_cells(engine: &Engine, plans: &[Arc<Sequence>], first: u64) -> Outcome<String> {
    let (mut measured_ms, mut ratios) = ([vec![], vec![]], [vec![], vec![]]);
    for sequence in plans {
        let Some(passes) = pass_times(engine, sequence.clone(), first)? else {
            return Ok(format!("{NO_TIME_STAMPS} | | | "));
        };
        for (k, [ms, predicted_ms]) in passes.into_iter().enumerate() {
            measured_ms[k].push(ms);
            ratios[k].push(predicted_ms / ms);
        }
    }
    let cells = [0, 1].map(|k: usize| {
        let [least, largest] = [0.0, 1.0].map(|part| quantile(&measured_ms[k], part));
        let [low, middle, high] = quartiles(&ratios[k]);
        format!("{least:.1} .. {largest:.1} | {middle:.2} ({low:.2} .. {high:.2})")
    });
    Ok(cells.join(" | "))
}

/// Measured and predicted milliseconds of the ideal and of the reverse pass; `None` without time stamps.
fn pass_times(engine: &Engine, sequence: Arc<Sequence>, first: u64) -> Outcome<Option<[[f64; 2]; 2]>> {
    let frames = sequence.frames;
    let mut session = engine.session::<Infallible>(sequence, &[Channel::Color])?;
    if engine.gpu().is_some() && !session.time_passes() {
        return Ok(None);
    }
    let (mut measured_ms, mut predicted_ms) = ([vec![], vec![]], [0.0; 2]);
    for k in 0..COST_FRAMES {
        session.forget();
        session.render::<Infallible>([(first + k) % frames], &mut |finished| {
            let plan = &finished.plan;
            predicted_ms = [plan.ideal_price_ms, plan.price_ms - plan.ideal_price_ms];
            let times = &finished.times;
            let cpu_ms = [times.ideal_ms, times.reverse_ms];
            for ((all_ms, name), cpu_ms) in
                measured_ms.iter_mut().zip(["ideal", "reverse"]).zip(cpu_ms).filter(|_| k > 0)
            {
                let gpu_ms = times.passes.iter().filter(|pass| pass.name == name).map(|pass| pass.ms);
                all_ms.extend(gpu_ms.chain(cpu_ms));
            }
            Ok(())
        })?;
    }
    Ok(Some([0, 1].map(|k: usize| [quartiles(&measured_ms[k])[1], predicted_ms[k]])))
}
