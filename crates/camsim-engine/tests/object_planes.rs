//! Ranges, normals, numbers of objects, and the fraction of each pixel that its object has, against rays of the
//! reference renderer and closed forms.

mod common;

use std::sync::Arc;

use camsim_core::{
    frame::{PlaneValues, RenderedFrame},
    reference::{PlaneErrors, ReferenceRenderer, RenderOptions, plane_errors},
    scenario::{Channel, MountSpec, Readout, Scenario},
    scene::{Encoding, Mesh, Scene, SceneObject, Terrain, Texture},
    sequence::Sequence,
};
use camsim_engine::Engine;
use common::{barrel_lens, render, rolling, roof, scenario, sequence, steady};
use glam::{DVec2, DVec3};

/// A name, and what is different in the scenario.
type Change = (&'static str, fn(&mut Scenario));

const CHANNELS: [Channel; 5] =
    [Channel::Range, Channel::Normal, Channel::NormalWorld, Channel::Object, Channel::Class];
const SIZE_PX: [u32; 2] = [120, 90];
const NEAR_PX: f64 = 0.05;

fn camera(pitch_deg: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [90.0, 90.0];
    scenario.camera.lens = barrel_lens();
    scenario.camera.mount = MountSpec { angles_deg: [0.0, pitch_deg, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = rolling(33.0, 12.0);
    scenario
}

fn object(name: &str, class: u16) -> SceneObject {
    SceneObject { name: name.into(), class }
}

/// Hills, and two roofs over them.
fn hills_and_roofs() -> Scene {
    let heights: Vec<f64> = (0..65 * 65)
        .map(|i| 12.0 * (f64::from(i % 65) * 0.4).sin() * (f64::from(i / 65) * 0.3).cos())
        .collect();
    let texture = Arc::new(Texture::uniform([120, 130, 90, 255], Encoding::Srgb));
    let terrain = Terrain::from_heights(65, 65, 8.0, &heights, Some(texture)).expect("heights");
    let raised = |object: u32, north_m: f64, east_m: f64, height_m: f64, half_m: f64| {
        let origin_ned_m = DVec3::new(north_m, east_m, -height_m);
        Mesh { object, origin_ned_m, ..roof(height_m, half_m) }
    };
    Scene {
        terrain: Some(terrain),
        meshes: vec![raised(2, 70.0, 0.0, 40.0, 18.0), raised(3, 40.0, 8.0, 75.0, 5.0)],
        objects: vec![object("terrain", 0), object("low", 7), object("high", 9)],
        terrain_object: 1,
        ..Scene::default()
    }
}

fn over_hills(change: impl Fn(&mut Scenario)) -> Arc<Sequence> {
    let mut scenario = camera(-50.0);
    change(&mut scenario);
    let flight = steady(120.0, 0.0, DVec3::new(-20.0, 30.0, 0.0), DVec3::new(0.2, -0.3, 0.5));
    sequence(scenario, flight, hills_and_roofs())
}

fn errors(sequence: &Arc<Sequence>, frame: &RenderedFrame) -> Vec<PlaneErrors> {
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
    plane_errors(&reference, 0, frame, NEAR_PX)
}

#[test]
fn every_value_belongs_to_a_visible_surface() {
    let cases: [Change; 2] =
        [("rows", |_| {}), ("columns", |s| s.camera.shutter.readout = Readout::RightToLeft)];
    for (name, change) in cases {
        let sequence = over_hills(change);
        let frame = render(&Engine::cpu(), &sequence, &CHANNELS, 0).frame;
        let numbers = frame.indices(Channel::Object).expect("numbers");
        for number in 0..4 {
            let count = numbers.iter().filter(|found| **found == number).count();
            assert!(count > 20, "{name}: object {number} has {count} pixels");
        }
        let errors = errors(&sequence, &frame);
        assert_eq!(errors.iter().map(|errors| errors.channel).collect::<Vec<_>>(), CHANNELS, "{name}");
        for errors in &errors {
            eprintln!("{name}: {errors:?}");
            assert!(errors.faults == 0 && errors.pixels > 10_000, "{name}: {errors:?}");
            assert!(errors.beyond * 1000 <= errors.pixels, "{name}: {errors:?}");
        }
        assert!(errors[3].beyond_away == 0 && errors[0].p99 < 1e-6 && errors[1].p99 < 1e-5, "{errors:?}");
    }
}

#[test]
fn wrong_values_are_found() {
    let sequence = over_hills(|_| {});
    let options = RenderOptions { channels: CHANNELS.to_vec(), max_samples: 32, ..RenderOptions::default() };
    let exact = ReferenceRenderer::new(sequence.clone()).expect("a usable camera").render(0, &options);
    for found in errors(&sequence, &exact) {
        let errors = (found.beyond, found.faults, found.max < 1e-6);
        assert_eq!(errors, (0, 0, true), "{found:?}");
    }
    // One pixel in the middle of the ground, where nothing else is near.
    let numbers = exact.indices(Channel::Object).expect("numbers");
    let i = (0..numbers.len() - 2 * 120 - 2)
        .map(|i| i + 120 + 1)
        .find(|&i| [0, 1, 119, 120, 121].iter().all(|&step| numbers[i - step] == 1 && numbers[i + step] == 1))
        .expect("ground");
    let mut wrong = exact;
    for plane in wrong.planes.iter_mut().filter(|plane| plane.channel.needs_every_ray()) {
        match &mut plane.values {
            PlaneValues::Index(numbers) => numbers[i] += 1,
            PlaneValues::Float(values) if plane.channel == Channel::Range => values[i] *= 1.002,
            PlaneValues::Float(values) => {
                let normal =
                    DVec3::new(values[3 * i].into(), values[3 * i + 1].into(), values[3 * i + 2].into());
                let turned = glam::DQuat::from_rotation_x(0.01) * normal;
                let turned = if turned.distance(normal) > 2e-3 { turned } else { -normal };
                values[3 * i..3 * i + 3].copy_from_slice(&turned.as_vec3().to_array());
            }
            PlaneValues::Raw(_) => {}
        }
    }
    for found in errors(&sequence, &wrong) {
        assert_eq!((found.beyond, found.beyond_away, found.faults), (1, 1, 1), "{found:?}");
    }
}

/// Fraction of a pixel's rays that meet the object of its centre, by many rays of the reference renderer.
fn fraction(reference: &ReferenceRenderer, pixel: [u32; 2], per_side: u32) -> f64 {
    let view = reference.view(0);
    let scene = &reference.sequence().scene;
    let object = |position: DVec2, phase: f64| {
        let hit = view.sample(pixel, position, phase).and_then(|sample| sample.hit);
        hit.map_or(0, |hit| scene.object_of_surface(hit.surface))
    };
    let middle = |k: u32| (f64::from(k) + 0.5) / f64::from(per_side) - 0.5;
    let centre = object(DVec2::ZERO, 0.0);
    let mut same = 0;
    for k in 0..per_side * per_side * per_side {
        let [x, y, t] = [k % per_side, k / per_side % per_side, k / per_side / per_side].map(middle);
        same += u32::from(object(DVec2::new(x, y), t) == centre);
    }
    f64::from(same) / f64::from(per_side.pow(3))
}

#[test]
fn coverage_is_the_fraction_of_rays_that_see_the_object() {
    // 30 ms at 36 m/s, 60 m from the upper roof: it moves by two pixels.
    let sequence = over_hills(|scenario| scenario.camera.shutter = rolling(33.0, 30.0));
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
    let frame = render(&Engine::cpu(), &sequence, &[Channel::Coverage], 0).frame;
    let coverage = frame.floats(Channel::Coverage).expect("coverage");
    let (mut most, mut squares, mut mixed) = (0.0_f64, 0.0, 0.0);
    for (i, &coverage) in coverage.iter().enumerate() {
        let pixel = [i as u32 % SIZE_PX[0], i as u32 / SIZE_PX[0]];
        if coverage < 1.0 {
            let off = (f64::from(coverage) - fraction(&reference, pixel, 12)).abs();
            (most, squares, mixed) = (most.max(off), squares + off * off, mixed + 1.0);
        } else if i % 3 == 0 {
            let fraction = fraction(&reference, pixel, 4);
            assert!(fraction > 0.93, "{pixel:?}: {fraction}");
        }
    }
    let rms = (squares / mixed).sqrt();
    eprintln!("{mixed} pixels with several objects: {most:.4} at most, {rms:.4} RMS");
    assert!(mixed > 300.0 && most < 0.1 + 0.02 && rms < 0.025, "{mixed} {most} {rms}");
}

/// Area of the part of a convex polygon within the pixel around `pixel`: clipped side by side.
fn area_in_pixel(polygon: &[DVec2], pixel: DVec2) -> f64 {
    let mut points = polygon.to_vec();
    for side in [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y] {
        let inside = |point: DVec2| side.dot(point - pixel) - 0.5;
        let mut kept = Vec::new();
        for (k, &to) in points.iter().enumerate() {
            let from = points[(k + points.len() - 1) % points.len()];
            let (a, b) = (inside(from), inside(to));
            if (a > 0.0) != (b > 0.0) {
                kept.push(from.lerp(to, a / (a - b)));
            }
            if b <= 0.0 {
                kept.push(to);
            }
        }
        points = kept;
    }
    let pairs = (0..points.len()).map(|k| points[k].perp_dot(points[(k + 1) % points.len()]));
    0.5 * pairs.sum::<f64>().abs()
}

#[test]
fn a_square_from_above_covers_pixels_by_its_area() {
    let (height_m, half_m, focal_px, yaw_deg) = (100.0, 21.3, 150.0, 31.0_f64);
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [focal_px; 2];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let square = Mesh { object: 1, ..Mesh::level_picture(texture, DVec3::new(1.3, -2.1, 0.0), 2.0 * half_m) };
    let scene = Scene { meshes: vec![square], objects: vec![object("square", 1)], ..Scene::default() };
    let sequence = sequence(scenario, steady(height_m, yaw_deg, DVec3::ZERO, DVec3::ZERO), scene);
    let frame = render(&Engine::cpu(), &sequence, &[Channel::Object, Channel::Coverage], 0).frame;
    // Forward is up in the picture.
    let (sin, cos) = yaw_deg.to_radians().sin_cos();
    let corners = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]].map(|[n, e]| {
        let [n, e] = [1.3 + half_m * n, -2.1 + half_m * e];
        let (forward, right) = (n * cos + e * sin, e * cos - n * sin);
        DVec2::new(59.5, 44.5) + focal_px / height_m * DVec2::new(right, -forward)
    });
    let (coverage, numbers) = (frame.floats(Channel::Coverage), frame.indices(Channel::Object));
    let (coverage, numbers) = (coverage.expect("coverage"), numbers.expect("numbers"));
    let mut mixed = 0;
    for (i, (&coverage, &number)) in coverage.iter().zip(numbers).enumerate() {
        let pixel = DVec2::new((i % 120) as f64, (i / 120) as f64);
        let area = area_in_pixel(&corners, pixel);
        let expected = if number == 1 { area } else { 1.0 - area };
        let off = (f64::from(coverage) - expected).abs();
        assert!(off < 0.06, "{pixel}: {coverage}, not {expected}");
        mixed += usize::from(expected < 0.99);
    }
    assert!(mixed > 150, "{mixed}");
}
