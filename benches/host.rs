//! The host's share of a frame, each part alone: plan, poses, files, and what precedes the first frame. No GPU, except for the one
//! frame that is encoded.
//!
//! `cargo bench --bench host`

use std::{convert::Infallible, hint::black_box, time::Duration};

use camsim::{
    core::{
        frame::RenderedFrame,
        plan::{Planner, line_poses},
        scenario::{Channel, ExrCompression, ImageFormat, OutputSpec, TrackerKind, TrackerSpec},
        tracker::track,
    },
    gpu::{AdapterChoice, Engine},
    io::{
        load::Loaded,
        write::{FrameFiles, FrameWriter},
    },
};
use criterion::{BenchmarkId, Criterion, Throughput};

mod flight;

use flight::{Outcome, Without};

/// Texture side limit of common adapters.
const MAX_SIDE_PX: u32 = 16_384;

fn main() -> Outcome<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(3))
        .sample_size(20)
        .configure_from_args();
    let loaded = flight::load()?;
    planning(&mut criterion, &loaded)?;
    tracking(&mut criterion, &loaded);
    files(&mut criterion, &loaded)?;
    criterion.final_summary();
    Ok(())
}

/// What happens for each frame before the device has work.
fn planning(criterion: &mut Criterion, loaded: &Loaded) -> Outcome<()> {
    let mut group = criterion.benchmark_group("plan");
    for (name, without) in [("full camera", Without::Nothing), ("perfect camera", Without::Anything)] {
        let sequence = without.of(&loaded.sequence)?;
        let planner = Planner::new(sequence.clone(), &sequence.scenario.output.channels, MAX_SIDE_PX)?;
        group.bench_function(BenchmarkId::new("plan", name), |bencher| bencher.iter(|| planner.plan(black_box(60)).map(drop)));
        let plan = planner.plan(60)?;
        group.bench_function(BenchmarkId::new("line_poses", name), |bencher| bencher.iter(|| line_poses(black_box(&plan), &sequence.path)));
    }
    group.finish();
    Ok(())
}

/// The whole log, once a run.
fn tracking(criterion: &mut Criterion, loaded: &Loaded) {
    let rows = &loaded.log.rows;
    let mut group = criterion.benchmark_group("track");
    group.throughput(Throughput::Elements(rows.len() as u64));
    for (name, kind) in [("sqrt", TrackerKind::Sqrt), ("spline", TrackerKind::Spline)] {
        let spec = TrackerSpec { kind, ..loaded.sequence.scenario.tracker.clone() };
        group.bench_function(name, |bencher| bencher.iter(|| track(black_box(rows), &spec).map(drop)));
    }
    group.finish();
}

/// One frame to one file on one thread, whatever the folder for temporary files is on.
fn files(criterion: &mut Criterion, loaded: &Loaded) -> Outcome<()> {
    let frame = rendered(loaded)?;
    let folder = tempfile::tempdir()?;
    let encoding = loaded.sequence.scenario.camera.photometric.output;
    let mut group = criterion.benchmark_group("write");
    for (name, format, compression) in [
        ("EXR half, uncompressed", ImageFormat::Exr, ExrCompression::None),
        ("EXR half, zip1", ImageFormat::Exr, ExrCompression::Zip1),
        ("EXR half, zip16", ImageFormat::Exr, ExrCompression::Zip16),
        ("EXR half, piz", ImageFormat::Exr, ExrCompression::Piz),
        ("PNG srgb8", ImageFormat::Png, ExrCompression::None),
    ] {
        let output =
            OutputSpec { channels: vec![Channel::Color], format: vec![format], exr_compression: compression, ..OutputSpec::default() };
        let files = FrameFiles::new(folder.path(), &output, encoding);
        group.bench_function(name, |bencher| {
            bencher.iter_batched(
                || frame.clone(),
                |frame| {
                    let writer = FrameWriter::new(files.clone(), 1);
                    writer.write(frame).and_then(|()| writer.finish())
                },
                criterion::BatchSize::LargeInput,
            )
        });
    }
    group.finish();
    Ok(())
}

/// Frame 60 of the demo.
fn rendered(loaded: &Loaded) -> Outcome<RenderedFrame> {
    let engine = Engine::new(AdapterChoice::Best)?;
    let mut session = engine.session::<Infallible>(loaded.sequence.clone(), &loaded.sequence.scenario.output.channels)?;
    let mut frame = RenderedFrame::default();
    session.render::<Infallible>([60], &mut |finished| {
        frame = finished.frame;
        Ok(())
    })?;
    Ok(frame)
}
