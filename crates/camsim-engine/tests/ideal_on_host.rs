//! The ideal frame that the host draws is the one that the device draws, pixel by pixel, whatever is drawn.

mod common;

use std::{collections::HashSet, convert::Infallible, path::Path, sync::Arc};

use camsim_core::{
    scenario::{Auto, Channel, MountSpec, Scenario, Silhouettes},
    scene::{Encoding, Light, Mesh, MeshVertex, Scene, Shape, Texture, Wrap},
    sequence::Sequence,
};
use camsim_engine::{Engine, Finished, IdealImages};
use camsim_io::{load::load_sequence, scenario_file::read_scenario};
use camsim_plan::Backend;
use camsim_plan::{FramePlan, PrefilterTaps};
use common::{city, engine, is_software, pattern, scenario, sequence, steady};
use glam::{DMat3, DQuat, DVec3};

/// Sides that no block divides.
const SIZE_PX: [u32; 2] = [181, 139];

/// One that draws on the host, one that draws on the device; the host makes output frames of both.
fn engines() -> [Engine; 2] {
    [Backend::Cpu, Backend::GpuThenCpu].map(|backend| {
        let mut engine = engine();
        engine.set_backend(backend);
        engine
    })
}

fn frame(
    engine: &Engine,
    sequence: &Arc<Sequence>,
    frame_number: u64,
    channels: &[Channel],
) -> (Finished, IdealImages) {
    let mut session = engine.session::<Infallible>(sequence.clone(), channels).expect("session");
    let mut found = None;
    let mut keep = |finished: Finished| {
        found = Some(finished);
        Ok(())
    };
    session.render::<Infallible>([frame_number], &mut keep).expect("render");
    (found.expect("a frame"), session.read_ideal().expect("readable").expect("drawn"))
}

/// Share of the pixels that one frame shows otherwise than the other, by more than 8/255 or another surface:
/// where rounding decides at borders of triangles. And what the others' colours are apart, RMS, 1/255, and
/// their inverse depths, RMS, relative.
#[derive(Debug)]
struct Apart {
    otherwise: f64,
    rms_dn: f64,
    inverse_depth: f64,
}

fn apart(host: &IdealImages, device: &IdealImages) -> Apart {
    assert_eq!(host.0, device.0, "the same frame");
    let pixels = host.2.len();
    let [width, height] = host.0.size_px.map(|side| side as usize);
    assert_eq!((pixels, host.1.len()), (width * height, 4 * width * height));
    let (mut otherwise, mut squares, mut of_depths) = (0, 0.0, 0.0);
    for ((host_rgba, device_rgba), (&a, &b)) in
        host.1.chunks_exact(4).zip(device.1.chunks_exact(4)).zip(host.2.iter().zip(&device.2))
    {
        assert_eq!(host_rgba[3], device_rgba[3], "no marks");
        let dn = [0, 1, 2].map(|k| 255.0 * f64::from(host_rgba[k] - device_rgba[k]));
        let depths = f64::from(a - b).abs() / f64::from(a.max(b)).max(1e-12);
        if depths > 1e-3 || dn.iter().any(|dn| dn.abs() > 8.0) {
            otherwise += 1;
            continue;
        }
        of_depths += depths * depths;
        squares += dn.iter().map(|dn| dn * dn).sum::<f64>();
    }
    Apart {
        otherwise: f64::from(otherwise) / pixels as f64,
        rms_dn: (squares / (3 * pixels) as f64).sqrt(),
        inverse_depth: (of_depths / pixels as f64).sqrt(),
    }
}

fn camera(pitch_deg: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [150.0, 140.0];
    scenario.camera.mount = MountSpec { angles_deg: [3.0, pitch_deg, 10.0], ..MountSpec::default() };
    scenario.quality.silhouettes = Silhouettes::Plain;
    scenario.quality.ideal_samples = Auto::Value(1);
    scenario
}

/// From so high, 30 m/s fast.
fn from_height(scenario: Scenario, height_m: f64, scene: Scene) -> Arc<Sequence> {
    sequence(scenario, steady(height_m, 10.0, DVec3::new(5.0, 30.0, 2.0), DVec3::new(0.1, 0.05, 0.3)), scene)
}

/// A ball of `n` by `2 n` facets, tinted from pole to pole.
fn ball(n: u32) -> Shape {
    let at = |row: u32, column: u32| {
        let (sin, cos) = (std::f64::consts::PI * f64::from(row) / f64::from(n)).sin_cos();
        let (east, north) = (std::f64::consts::PI * f64::from(column) / f64::from(n)).sin_cos();
        [(north * sin) as f32, (east * sin) as f32, -cos as f32]
    };
    let mut shape = Shape::default();
    for row in 0..=n {
        for column in 0..=2 * n {
            let (position_m, share) = (at(row, column), row as f32 / n as f32);
            let uv = [column as f32 / n as f32, 2.0 * share];
            shape.vertices.push(MeshVertex {
                position_m,
                uv,
                tint: [1.0 - 0.5 * share, 0.4 + 0.6 * share, 0.7, 1.0],
            });
            shape.normals.push(position_m);
        }
    }
    for row in 0..n {
        for column in 0..2 * n {
            let [a, b] = [row, row + 1].map(|row| row * (2 * n + 1) + column);
            shape.indices.extend([a, b, b + 1, a, b + 1, a + 1]);
        }
    }
    shape
}

fn stripes() -> Arc<Texture> {
    let rgba8 = (0..64 * 64_u32).flat_map(|i| {
        [(128.0 + 100.0 * f64::from(i % 64).mul_add(0.4, 0.1).sin()) as u8, (3 * (i / 64)) as u8, 90, 255]
    });
    Arc::new(Texture { size_px: [64, 64], rgba8: rgba8.collect(), encoding: Encoding::Srgb })
}

/// Balls on the ground, turned and stretched.
fn balls(count: u32, light: Option<Light>, change: impl Fn(&mut Mesh)) -> Scene {
    let (shape, texture) = (Arc::new(ball(12)), stripes());
    let mut scene = pattern(2000.0);
    scene.light = light;
    for k in 0..count {
        let vary = |m: f64| (12.9898 * m * f64::from(k + 1)).sin();
        let turn = DMat3::from_quat(
            DQuat::from_rotation_y(3.0 * vary(1.1)) * DQuat::from_rotation_z(3.0 * vary(1.3)),
        );
        let mut mesh = Mesh::new(
            Vec::new(),
            Vec::new(),
            texture.clone(),
            60.0 * DVec3::new(vary(1.7), vary(1.9), 0.0),
            Wrap::Repeat,
        );
        mesh.shape = shape.clone();
        mesh.ned_from_shape = turn * DMat3::from_diagonal(DVec3::new(3.0, 4.0 + vary(2.3), 6.0));
        change(&mut mesh);
        scene.meshes.push(mesh);
    }
    scene
}

/// Of [`pattern`] of a width: how far inverse depth is from the ray's, relative, RMS, and colour from the
/// mean over the pixel, RMS, 1/255.
fn from_exact(images: &IdealImages, plan: &FramePlan, width_m: f64) -> [f64; 2] {
    const WITHIN: i32 = 8;
    let (ideal, pose) = (&images.0, &plan.keys[0].pose);
    let ray = |x: f64, y: f64| {
        pose.ned_from_camera
            * DVec3::new(
                (x - ideal.principal_px.x) / ideal.focal_px.x,
                (y - ideal.principal_px.y) / ideal.focal_px.y,
                1.0,
            )
    };
    let color = |at: DVec3| {
        let [x, y] = [0.5 + at.y / width_m, 0.5 - at.x / width_m].map(|share| 512.0 * share - 0.5);
        let inside = x > 2.0 && y > 2.0 && x < 509.0 && y < 509.0;
        let level = |k: f64, phase: f64| {
            let wave = std::f64::consts::TAU * k / 512.0;
            127.5 + 110.0 * (wave * x + phase).sin() * (wave * y).cos()
        };
        inside.then(|| DVec3::new(level(8.0, 0.0), level(5.0, 1.0), level(11.0, 2.0)))
    };
    let (mut depths, mut colors) = ([0.0, 0.0], [0.0, 0.0]);
    let width = ideal.size_px[0] as usize;
    for (i, &inverse) in images.2.iter().enumerate().filter(|&(i, &inverse)| inverse > 0.0 && i % 3 == 0) {
        let [x, y] = [i % width, i / width].map(|px| px as f64);
        let exact = -ray(x, y).z / pose.position_ned_m.z;
        depths = [depths[0] + (f64::from(inverse) / exact - 1.0).powi(2), depths[1] + 1.0];
        let share = |k: i32| (f64::from(k) + 0.5) / f64::from(WITHIN) - 0.5;
        let rays = (0..WITHIN * WITHIN).map(|k| ray(x + share(k % WITHIN), y + share(k / WITHIN)));
        let seen = rays.map(|ray| {
            color(pose.position_ned_m - ray * (pose.position_ned_m.z / ray.z)).filter(|_| ray.z > 0.0)
        });
        let Some(mean) = seen.sum::<Option<DVec3>>().map(|sum| sum / f64::from(WITHIN * WITHIN)) else {
            continue;
        };
        let found = DVec3::from_array([0, 1, 2].map(|k| 255.0 * f64::from(images.1[4 * i + k])));
        colors = [colors[0] + (found - mean).length_squared(), colors[1] + 3.0];
    }
    [depths, colors].map(|[squares, count]| (squares / count).sqrt())
}

fn assert_same(
    name: &str,
    engines: &[Engine; 2],
    sequence: &Arc<Sequence>,
    frame_number: u64,
    width_m: Option<f64>,
) -> FramePlan {
    let [(by_host, host), (by_device, device)] =
        engines.each_ref().map(|engine| frame(engine, sequence, frame_number, &[Channel::Color]));
    assert!(
        by_host.times.ideal_ms.is_some() && by_device.times.ideal_ms.is_none(),
        "{name}: each where it should be: {:?}",
        by_host.plan
    );
    let seen = device.2.iter().filter(|&&inverse| inverse > 0.0).count() as f64 / device.2.len() as f64;
    let found = apart(&host, &device);
    eprintln!("{name}: {:?}, {found:?}, {:.0} % no sky", by_host.plan.surface_reads, 100.0 * seen);
    assert!(seen > 0.3, "{name}: something to be seen");
    match width_m {
        // Among boxes 5e-5 and 0.12/255 were found, half of them what half floats are cut off to there; depth
        // is floats' rounding, and the grid's for thin triangles, 1.8e-6 at most. Circuits have the depth of
        // the corners that they moved: by 1/512 px each way, of a surface at a slant that has another depth a
        // few hundred pixels on.
        None => {
            let most_depth = if is_software(&engines[1]) { 3e-6 } else { 1e-5 };
            assert!(
                found.otherwise < 2e-4 && found.rms_dn < 0.2 && found.inverse_depth < most_depth,
                "{name}: {found:?}"
            );
        }
        Some(width_m) => {
            let [of_host, of_device] =
                [&host, &device].map(|images| from_exact(images, &by_host.plan, width_m));
            eprintln!("  from exact: host {of_host:?}, device {of_device:?}");
            assert!(of_host[0] < 2e-6, "{name}: inverse depth {:.1e}", of_host[0]);
            // Nearer by 2 % at least with the driver that this was written beside; others may be as near.
            assert!(
                of_host[1] < 1.02 * of_device[1],
                "{name}: {:.3}/255, {:.3} by the device",
                of_host[1],
                of_device[1]
            );
        }
    }
    assert_eq!(by_host.lod, by_device.lod, "{name}");
    by_host.plan
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_host_draws_what_the_device_draws() {
    let engines = engines();
    let with = |pitch_deg: f64, change: &dyn Fn(&mut Scenario)| {
        let mut scenario = camera(pitch_deg);
        change(&mut scenario);
        scenario
    };
    let scale = |scale: f64| move |scenario: &mut Scenario| scenario.quality.ideal_scale = Auto::Value(scale);
    let finest = |scenario: &mut Scenario| scenario.quality.max_terrain_error_px = 1e-5;
    let light = Light::new(2.5, 0.6, 0.7, 0.3);
    let fog = |mut scene: Scene| {
        scene.fog_visibility_m = Some(900.0);
        scene
    };
    let mut plans = Vec::new();
    for (name, scenario, height_m, width_m) in [
        ("large triangles", camera(-60.0), 120.0, 6000.0),
        ("larger pixels than texels", camera(-60.0), 120.0, 150.0),
        ("much larger pixels", camera(-50.0), 600.0, 900.0),
        ("all but level", camera(-20.0), 30.0, 300.0),
        ("down to the horizon", camera(-8.0), 40.0, 20_000.0),
        ("camera 30 cm above the ground", camera(-15.0), 0.3, 200.0),
        ("coarse", with(-60.0, &scale(1.0)), 120.0, 400.0),
        ("fine", with(-60.0, &scale(3.1)), 120.0, 400.0),
    ] {
        plans.push(assert_same(
            name,
            &engines,
            &from_height(scenario, height_m, pattern(width_m)),
            2,
            Some(width_m),
        ));
    }
    for (name, sequence) in [
        ("boxes", from_height(camera(-50.0), 90.0, city(6))),
        ("among boxes", from_height(camera(-10.0), 9.0, city(6))),
        ("fog", from_height(camera(-10.0), 60.0, fog(city(8)))),
        ("tints", from_height(camera(-50.0), 70.0, balls(60, None, |_| ()))),
        ("light", from_height(camera(-50.0), 70.0, balls(60, Some(light), |_| ()))),
        (
            "inner sides in light",
            from_height(camera(-50.0), 70.0, balls(60, Some(light), |mesh| mesh.ned_from_shape *= -1.0)),
        ),
        // More than are drawn at once.
        ("a million triangles", from_height(with(-50.0, &finest), 70.0, balls(2000, Some(light), |_| ()))),
        (
            "one side",
            from_height(camera(-50.0), 70.0, balls(60, None, |mesh| mesh.material.one_sided = true)),
        ),
        (
            "one colour, light of its own",
            from_height(
                camera(-50.0),
                70.0,
                balls(60, Some(light), |mesh| {
                    mesh.material.texture = Arc::new(Texture::uniform([200, 90, 40, 255], Encoding::Srgb));
                    mesh.material.emissive = [0.05, 0.1, 0.02];
                }),
            ),
        ),
    ] {
        plans.push(assert_same(name, &engines, &sequence, 2, None));
    }
    let coarse = &[("quality.ideal_scale", "1.0"), ("quality.max_error_dn", "0.1")][..];
    let sharp = &[("quality.ideal_scale", "1.41"), ("camera.shutter.exposure_ms", "0")];
    let exact = &[("quality.max_error_dn", "0.5")];
    for (file, sets, frames) in [
        ("assets/demo.toml", &[][..], [3, 70]),
        ("assets/demo.toml", exact, [40, 52]),
        ("assets/demo.toml", coarse, [3, 70]),
        ("benches/all_effects.toml", &[], [52, 98]),
        ("benches/all_effects.toml", sharp, [52, 60]),
        ("benches/houses.toml", &[], [8, 40]),
        ("benches/houses.toml", coarse, [8, 40]),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(file);
        let sets = [&[("quality.silhouettes", "\"plain\""), ("quality.ideal_samples", "1")], sets]
            .concat()
            .iter()
            .map(|&(key, value)| (key.into(), value.into()))
            .collect::<Vec<_>>();
        let loaded = load_sequence(&read_scenario(&path, &sets, None).expect("scenario")).expect("sequence");
        plans.extend(frames.map(|frame| assert_same(file, &engines, &loaded.sequence, frame, None)));
    }
    let reads: HashSet<PrefilterTaps> = plans.iter().map(|plan| plan.surface_reads).collect();
    assert!(PrefilterTaps::ALL.iter().all(|kind| reads.contains(kind)), "all ways to read: {reads:?}");
}

/// What frames of four samples a pixel have in common on the host and on the device: share of the pixels that
/// are apart by more than 16/255, and RMS of all, 1/255.
fn samples_apart(name: &str, engines: &[Engine; 2], sequence: &Arc<Sequence>, frame_number: u64) -> [f64; 2] {
    let [(by_host, host), (by_device, device)] =
        engines.each_ref().map(|engine| frame(engine, sequence, frame_number, &[Channel::Color]));
    assert!(
        by_host.times.ideal_ms.is_some() && by_device.times.ideal_ms.is_none(),
        "{name}: each where it should be"
    );
    assert_eq!((by_host.plan.samples_a_pixel, host.0), (4, device.0), "{name}");
    let dn: Vec<f64> = host.1.iter().zip(&device.1).map(|(a, b)| 255.0 * f64::from(a - b)).collect();
    let rms_dn = (dn.iter().map(|dn| dn * dn).sum::<f64>() / (0.75 * dn.len() as f64)).sqrt();
    let otherwise = dn.chunks_exact(4).filter(|pixel| pixel.iter().any(|dn| dn.abs() > 16.0)).count();
    let depths = host.2.iter().zip(&device.2).filter(|&(&a, &b)| (a - b).abs() > 1e-3 * a.max(b)).count();
    let pixels = host.2.len() as f64;
    eprintln!(
        "{name}: {rms_dn:.3}/255, {:.1e} otherwise, {:.1e} at another depth",
        otherwise as f64 / pixels,
        depths as f64 / pixels
    );
    [otherwise.max(depths) as f64 / pixels, rms_dn]
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn samples_of_the_host_are_those_of_the_device() {
    let engines = engines();
    let camera = |pitch_deg: f64| {
        let mut scenario = camera(pitch_deg);
        scenario.quality.ideal_samples = Auto::Value(4);
        scenario
    };
    let light = Light::new(2.5, 0.6, 0.7, 0.3);
    let finest = |mut scenario: Scenario| {
        scenario.quality.max_terrain_error_px = 1e-5;
        scenario
    };
    for (name, sequence) in [
        ("boxes", from_height(camera(-50.0), 90.0, city(6))),
        ("among boxes", from_height(camera(-10.0), 9.0, city(6))),
        ("light", from_height(camera(-50.0), 70.0, balls(60, Some(light), |_| ()))),
        (
            "one side",
            from_height(camera(-50.0), 70.0, balls(60, None, |mesh| mesh.material.one_sided = true)),
        ),
        // More than are drawn at once.
        ("a million triangles", from_height(finest(camera(-50.0)), 70.0, balls(2000, Some(light), |_| ()))),
    ] {
        let [otherwise, rms_dn] = samples_apart(name, &engines, &sequence, 2);
        // Up to 2.2e-4 and 0.26/255 were found: the device shades each triangle of a surface, and other
        // drivers choose other sides at borders.
        assert!(otherwise < 2e-3 && rms_dn < 0.4, "{name}: {otherwise:.1e}, {rms_dn:.3}/255");
    }
    for (file, frames) in [("benches/all_effects.toml", [52, 98]), ("benches/houses.toml", [8, 40])] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(file);
        let sets = [("quality.silhouettes", "\"plain\""), ("quality.ideal_samples", "4")]
            .map(|(key, value)| (key.into(), value.into()));
        let loaded = load_sequence(&read_scenario(&path, &sets, None).expect("scenario")).expect("sequence");
        for number in frames {
            let [otherwise, rms_dn] = samples_apart(file, &engines, &loaded.sequence, number);
            assert!(otherwise < 2e-3 && rms_dn < 0.5, "{file} {number}: {otherwise:.1e}, {rms_dn:.3}/255");
        }
    }
}
