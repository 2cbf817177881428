//! Work on the processor, each part alone: lens maps, plans, row poses, terrain triangles, tracker and file
//! encoding. No graphics adapter is needed.
//!
//! `cargo bench --bench cpu`

#![allow(clippy::print_stdout, reason = "the numbers of triangles belong to their times")]

use std::{
    convert::Infallible,
    hint::black_box,
    time::{Duration, Instant},
};

use camsim::{
    core::{
        camera::CameraModel,
        flight_log::HeightConversion,
        frame::RenderedFrame,
        pose::CameraPose,
        scenario::{
            CameraSpec, Channel, ExrCompression, FlightSpec, ImageFormat, LensModel, LensSpec, OutputSpec,
            TrackerKind, TrackerSpec,
        },
        scene::{Terrain, TerrainDetail},
        tracker::track,
    },
    engine::Engine,
    io::{
        flight_log::read_flight_log,
        load::Loaded,
        write::{FrameFiles, FrameWriter},
    },
    plan::{Capabilities, Planner, row_poses},
};
use criterion::{BenchmarkId, Criterion, Throughput};
use glam::{DQuat, DVec3};

mod flight;

use flight::{Ablation, Outcome};

/// Texture side limit of common adapters.
const MAX_SIDE_PX: u32 = 16_384;

fn main() -> Outcome<()> {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(3))
        .sample_size(20)
        .configure_from_args();
    let loaded = flight::load()?;
    lens_maps(&mut criterion, &loaded)?;
    planning(&mut criterion, &loaded)?;
    terrain(&mut criterion, &loaded)?;
    reading(&mut criterion)?;
    tracking(&mut criterion, &loaded);
    files(&mut criterion, &loaded)?;
    criterion.final_summary();
    Ok(())
}

/// A flight log of 50 000 rows.
fn reading(criterion: &mut Criterion) -> Outcome<()> {
    let folder = tempfile::tempdir()?;
    let (path, mut text) =
        (folder.path().join("log.csv"), "t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg\n".to_owned());
    for row in 0..50_000 {
        let t = f64::from(row) * 0.02;
        text += &format!("{t:.2},{:.3},{:.3},-100.0,{:.3},2.0,60.0\n", 15.0 * t, 9.0 * t, 5.0 * t.sin());
    }
    std::fs::write(&path, text)?;
    let spec = FlightSpec { log: path.clone(), ..FlightSpec::default() };
    criterion.bench_function("read log of 50000 rows", |bencher| {
        bencher.iter(|| read_flight_log(&path, &spec, HeightConversion::None));
    });
    Ok(())
}

/// The table of rays that is made once for each lens or zoom value.
fn lens_maps(criterion: &mut Criterion, loaded: &Loaded) -> Outcome<()> {
    let mut group = criterion.benchmark_group("lens map");
    let spec = &loaded.sequence.scenario.camera;
    for (name, model, coefficients) in [
        ("brown-conrady", LensModel::BrownConrady, &[-0.28, 0.07, 6e-4, -4e-4, -0.006][..]),
        ("kannala-brandt", LensModel::KannalaBrandt, &[-0.02, 0.004, -0.003, 5e-4]),
        ("double-sphere", LensModel::DoubleSphere, &[-0.2, 0.6]),
    ] {
        let lens = LensSpec { model, coefficients: coefficients.to_vec() };
        let camera = CameraModel::from_spec(&CameraSpec { lens, ..spec.clone() })?;
        group.bench_function(name, |bencher| bencher.iter(|| black_box(&camera).lens_inverse()));
    }
    group.finish();
    Ok(())
}

/// Work before the first pass of a frame.
fn planning(criterion: &mut Criterion, loaded: &Loaded) -> Outcome<()> {
    let mut group = criterion.benchmark_group("plan");
    for (name, ablation) in [("full camera", Ablation::None), ("perfect camera", Ablation::All)] {
        let sequence = ablation.apply(&loaded.sequence)?;
        let planner = Planner::new(sequence.clone(), &sequence.scenario.output.channels, MAX_SIDE_PX)?;
        // All frames of a group that may share an ideal frame are planned together.
        let plan_anew = || {
            planner.forget();
            planner.plan(black_box(60)).map(drop)
        };
        group.bench_function(BenchmarkId::new("plan of a group of eight", name), |bencher| {
            bencher.iter(plan_anew)
        });
        let for_card = Planner::new(sequence.clone(), &sequence.scenario.output.channels, MAX_SIDE_PX)?
            .with_capabilities(Capabilities::default());
        group.bench_function(BenchmarkId::new("the same for a graphics card", name), |bencher| {
            bencher.iter(|| {
                for_card.forget();
                for_card.plan(black_box(60)).map(drop)
            })
        });
        let plan = planner.plan(60)?;
        group.bench_function(BenchmarkId::new("row_poses", name), |bencher| {
            bencher.iter(|| row_poses(black_box(&plan), &sequence.path))
        });
    }
    group.finish();
    Ok(())
}

/// Choice of the terrain's triangles: for the built-in terrain in frame 60, and for terrains of several sizes
/// under the same camera.
fn terrain(criterion: &mut Criterion, loaded: &Loaded) -> Outcome<()> {
    let mut group = criterion.benchmark_group("terrain");
    let sequence = &loaded.sequence;
    let plan = Planner::new(sequence.clone(), &sequence.scenario.output.channels, MAX_SIDE_PX)?.plan(60)?;
    let focal_px = plan.ideal.focal_px.max_element();
    let mut measure = |name: &str, terrain: &Terrain, pose: &CameraPose| {
        let detail =
            || TerrainDetail::new(black_box(terrain), pose, plan.tangents(), focal_px, plan.terrain_error_px);
        let lod = detail().visible_mesh().lod;
        println!(
            "{name}: {} triangles of {} chunks, within {:.3} px",
            lod.triangles, lod.chunks, lod.max_error_px
        );
        group.bench_function(BenchmarkId::new("triangles of a frame", name), |bencher| {
            bencher.iter(|| detail().visible_mesh())
        });
    };
    if let Some(terrain) = &sequence.scene.terrain {
        measure("demo", terrain, &plan.key_pose);
    }
    for side in std::env::var("CAMSIM_TERRAIN_SIDES").unwrap_or("1025 4097".into()).split_whitespace() {
        let begin = Instant::now();
        let (name, terrain) = (format!("{side} x {side} heights"), fractal_terrain(side.parse()?)?);
        println!("{name}: made in {:.1} s", begin.elapsed().as_secs_f64());
        // From above the centre: straight down, without the border in sight, and to the horizon as in the
        // built-in flight.
        let position_ned_m = DVec3::new(0.0, 0.0, terrain.down_at(0.0, 0.0).unwrap_or_default() - 2000.0);
        let down = CameraPose { position_ned_m, ned_from_camera: DQuat::IDENTITY };
        measure(&format!("{name}, down"), &terrain, &down);
        measure(&format!("{name}, ahead"), &terrain, &CameraPose { position_ned_m, ..plan.key_pose });
    }
    group.finish();
    Ok(())
}

/// Hills of all sizes on a grid of 10 m. The height at a point does not depend on the number of heights.
fn fractal_terrain(side: u32) -> Outcome<Terrain> {
    let centred = |index: u32| f64::from(index) - f64::from(side / 2);
    let height = |i: f64, j: f64| -> f64 {
        (0..12)
            .map(|octave| {
                let (frequency, angle) = (0.7 * 0.5_f64.powi(octave), f64::from(octave));
                let (x, y) = (i * angle.cos() - j * angle.sin(), i * angle.sin() + j * angle.cos());
                0.7 / frequency * (frequency * x).sin() * (frequency * y + angle).cos()
            })
            .sum()
    };
    let heights: Vec<f64> = (0..side * side).map(|k| height(centred(k % side), centred(k / side))).collect();
    Ok(Terrain::from_heights(side, side, 10.0, &heights, None)?)
}

/// Tracking of the whole log.
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

/// One frame to one file on one thread, in the folder for temporary files.
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
        let output = OutputSpec {
            channels: vec![Channel::Color],
            format: vec![format],
            exr_compression: compression,
            ..OutputSpec::default()
        };
        let files = FrameFiles::new(folder.path(), &output, encoding);
        group.bench_function(name, |bencher| {
            bencher.iter_batched(
                || frame.clone(),
                |frame| {
                    let mut writer = FrameWriter::new(files.clone(), 1);
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
    let engine = Engine::cpu();
    let mut session =
        engine.session::<Infallible>(loaded.sequence.clone(), &loaded.sequence.scenario.output.channels)?;
    let mut frame = RenderedFrame::default();
    session.render::<Infallible>([60], &mut |finished| {
        frame = finished.frame;
        Ok(())
    })?;
    Ok(frame)
}
