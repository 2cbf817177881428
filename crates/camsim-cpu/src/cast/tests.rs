#![allow(clippy::unwrap_used)]

//! Cast frames against the reference's rays, area means and closed forms. `camsim-engine/tests/stages`
//! compares them with the reference and with the rasteriser too.

use camsim_core::{
    pose::CameraPose,
    reference::ReferenceRenderer,
    scene::{Encoding, Material, Mesh, PrefilterTaps, Texture, Wrap},
    sequence::Sequence,
    temporal::{
        IdealGeometry,
        edge_mask::edge_mask,
        supersampled::{PixelCentre, SupersampledImage},
    },
};
use camsim_plan::LinearFog;
use glam::{DMat3, DQuat, DVec3};

use super::*;
use crate::fixtures::gallery::{SIZE_PX, gallery, key, noise, pane, planned, standing};

const DN: f64 = 255.0;

fn pixels() -> impl Iterator<Item = (usize, DVec2)> {
    let [width, height] = SIZE_PX;
    (0..width * height).map(move |i| (i as usize, DVec2::new((i % width).into(), (i / width).into())))
}

fn ray_uv(plan: &FramePlan, position_px: DVec2) -> DVec2 {
    (position_px - plan.ideal.principal_px) / plan.ideal.focal_px
}

fn color_at(image: &IdealImage, i: usize) -> DVec3 {
    DVec3::new(
        image.color_rgba[4 * i].into(),
        image.color_rgba[4 * i + 1].into(),
        image.color_rgba[4 * i + 2].into(),
    )
}

#[test]
fn the_paper_stores_bytes_of_srgb_without_fog() {
    let (sequence, mut plan) = planned(gallery());
    let cast = CastScene::new(&sequence.scene);
    let key = key(DVec3::new(0.0, 0.0, -12.0), 0.0, 0.05);
    plan.linear_fog = Some(LinearFog { sky_stored: [0.5; 3], end_m: 900.0 });
    let clear = cast.draw(&plan, &key);
    plan.preset = Preset::Paper;
    let paper = cast.draw(&plan, &key);
    let mut scene = gallery();
    scene.fog_visibility_m = None;
    let (without, _) = planned(scene);
    let reference = ReferenceRenderer::new(without).unwrap();
    let mut most = 0.0_f64;
    for (i, position_px) in pixels() {
        let light = reference.radiance(&key.pose, ray_uv(&plan, position_px));
        most = most.max((color_at(&clear, i) - light).abs().max_element());
        let bytes = 255.0 * color_at(&paper, i);
        assert!((bytes - bytes.round()).abs().max_element() < 1e-4, "{bytes}");
        for channel in 0..3 {
            let stored = srgb_from_linear(light[channel].clamp(0.0, 1.0) as f32);
            assert!(
                (bytes[channel] - 255.0 * f64::from(stored)).abs() < 0.51,
                "{position_px}: {bytes} {light}"
            );
        }
    }
    assert!(most < 1e-4, "{most}");
    assert_eq!(paper.inverse_depth, clear.inverse_depth);
}

#[test]
fn a_pane_counts_once_along_its_diagonal_and_not_within_the_near_plane() {
    let grey = Arc::new(Texture::uniform([255, 255, 255, 128], Encoding::Linear));
    let material = Material { blends: true, cutoff: Some(0.9), ..Material::picture(grey, Wrap::Clamp) };
    // The diagonal runs through the middles of pixels.
    let shape = pane(0.0, 1.0, [[1.0; 4]; 2]);
    let turn = DMat3::from_diagonal(DVec3::splat(8.0));
    let far = standing(&shape, &material, DVec3::new(10.0, 0.0, 0.0), turn);
    let near = standing(&shape, &material, DVec3::new(0.9 * NEAR_M, 0.0, 0.0), turn);
    let (sequence, mut plan) = planned(Scene { meshes: vec![far, near], ..Scene::default() });
    plan.ideal = IdealGeometry {
        size_px: SIZE_PX,
        focal_px: DVec2::splat(80.0),
        principal_px: DVec2::new(48.0, 36.0),
    };
    let level = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
    let pose = CameraPose { position_ned_m: DVec3::ZERO, ned_from_camera: DQuat::from_mat3(&level) };
    for samples_a_pixel in [1, 4] {
        plan.samples_a_pixel = samples_a_pixel;
        let image = CastScene::new(&sequence.scene).draw(&plan, &KeyFrame { t_s: 0.0, pose });
        let mut seen = 0;
        for (i, position_px) in pixels() {
            let beside = (position_px - plan.ideal.principal_px).abs().max_element();
            if beside == 32.0 {
                continue;
            }
            let expected = if beside < 32.0 { 128.0 / 255.0 } else { 0.0 };
            assert!((color_at(&image, i) - expected).abs().max_element() < 1e-6, "{position_px}");
            assert_eq!(image.inverse_depth[i], 0.0);
            seen += u32::from(beside < 32.0);
        }
        assert_eq!(seen, 63 * 63);
    }
}

/// Ground with one texel a 10 cm, seen from above at an angle.
fn fine_ground() -> (Scene, KeyFrame) {
    let texture = noise([600, 600], |_| 255, Encoding::Linear);
    let ground = Mesh::level_picture(texture, DVec3::ZERO, 60.0);
    (Scene { meshes: vec![ground], ..Scene::default() }, key(DVec3::new(-14.0, 1.0, -22.0), 0.1, 1.0))
}

#[test]
fn minified_textures_are_means_over_the_pixels_area() {
    const SIDE: u32 = 24;
    let (scene, key) = fine_ground();
    let (sequence, mut plan) = planned(scene);
    let reference = ReferenceRenderer::new(sequence.clone()).unwrap();
    let cast = CastScene::new(&sequence.scene);
    let reads = [PrefilterTaps::One, PrefilterTaps::Two, PrefilterTaps::Four, PrefilterTaps::Grid];
    let images = reads.map(|reads| {
        plan.surface_reads = reads;
        cast.draw(&plan, &key)
    });
    let ([mut errors, mut biases], mut unfiltered, mut count) = ([[0.0; 4]; 2], 0.0, 0.0);
    for (i, position_px) in pixels().filter(|(i, _)| i % 11 == 0) {
        let light = |offset_px: DVec2| reference.radiance(&key.pose, ray_uv(&plan, position_px + offset_px));
        let position = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE) - 0.5;
        let positions = (0..SIDE * SIDE).map(|k| DVec2::new(position(k % SIDE), position(k / SIDE)));
        let mean = positions.map(light).sum::<DVec3>() / f64::from(SIDE * SIDE);
        for (k, image) in images.iter().enumerate() {
            let error = color_at(image, i) - mean;
            errors[k] += error.length_squared() / 3.0;
            biases[k] += error.element_sum() / 3.0;
        }
        unfiltered += (light(DVec2::ZERO) - mean).length_squared() / 3.0;
        count += 1.0;
    }
    let rms = |sum: f64| DN * (sum / count).sqrt();
    let (errors, biases) = (errors.map(rms), biases.map(|sum| DN * sum / count));
    eprintln!("{errors:.2?} DN, biases {biases:.3?}, {:.2} DN unfiltered, {count} pixels", rms(unfiltered));
    // White noise has no smooth part: the filters' forms are seen at their worst.
    assert!(rms(unfiltered) > 40.0);
    assert!(errors[3] < 7.0 && errors[2] < 8.5 && errors[1] < 13.0 && errors[0] < 16.0, "{errors:?}");
    assert!(biases.iter().all(|bias| bias.abs() < 1.0), "{biases:?}");
}

#[test]
fn minified_panes_are_means_of_colors_weighted_by_alpha() {
    const SIDE: u32 = 20;
    let white = [[1.0; 4]; 2];
    let texture = noise([160, 160], |bits| if bits & 1 == 0 { 0 } else { bits as u8 }, Encoding::Linear);
    let glass =
        Material { blends: true, emissive: [0.0, 0.2, 0.0], ..Material::picture(texture, Wrap::Repeat) };
    let grey = Arc::new(Texture::uniform([90, 120, 40, 255], Encoding::Srgb));
    let turn = DMat3::from_rotation_z(0.3) * DMat3::from_diagonal(DVec3::splat(30.0));
    let meshes = vec![
        standing(&pane(0.0, 1.0, white), &glass, DVec3::new(20.0, 0.0, 0.0), turn),
        standing(
            &pane(0.0, 1.0, white),
            &Material::picture(grey, Wrap::Clamp),
            DVec3::new(60.0, 0.0, 0.0),
            4.0 * turn,
        ),
    ];
    let (sequence, mut plan) = planned(Scene { meshes, fog_visibility_m: Some(300.0), ..Scene::default() });
    plan.surface_reads = PrefilterTaps::Grid;
    let reference = ReferenceRenderer::new(sequence.clone()).unwrap();
    let key = key(DVec3::ZERO, 0.0, 0.0);
    let image = CastScene::new(&sequence.scene).draw(&plan, &key);
    let (mut error, mut bias, mut unfiltered, mut count) = (0.0, DVec3::ZERO, 0.0, 0.0);
    for (i, position_px) in pixels().filter(|(i, _)| i % 7 == 0) {
        let light = |offset_px: DVec2| reference.radiance(&key.pose, ray_uv(&plan, position_px + offset_px));
        let position = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE) - 0.5;
        let positions = (0..SIDE * SIDE).map(|k| DVec2::new(position(k % SIDE), position(k / SIDE)));
        let mean = positions.map(light).sum::<DVec3>() / f64::from(SIDE * SIDE);
        error += (color_at(&image, i) - mean).length_squared() / 3.0;
        bias += color_at(&image, i) - mean;
        unfiltered += (light(DVec2::ZERO) - mean).length_squared() / 3.0;
        count += 1.0;
    }
    let rms = |sum: f64| DN * (sum / count).sqrt();
    eprintln!("{:.2} DN, bias {:.3}, {:.2} DN unfiltered", rms(error), DN * bias / count, rms(unfiltered));
    assert!(rms(unfiltered) > 9.0 && rms(error) < 2.8, "{error} {unfiltered}");
    assert!((DN * bias / count).abs().max_element() < 0.1, "{bias}");
}

#[test]
fn samples_have_the_depths_and_colors_of_the_reference() {
    let (sequence, mut plan) = planned(gallery());
    let reference = ReferenceRenderer::new(sequence.clone()).unwrap();
    let cast = CastScene::new(&sequence.scene);
    let key = key(DVec3::new(0.0, 0.0, -12.0), 0.0, 0.05);
    for scale in [1, 2] {
        let frame = FrameCaster::new(&cast, &plan, &key, scale);
        let fine_px = SIZE_PX.map(|side| side * scale);
        let (depths, colors) = frame.samples(fine_px, 0);
        let (mut apart, mut sum) = (0, 0.0);
        for (i, (depths, colors)) in depths.iter().zip(&colors).enumerate() {
            let corner = DVec2::new((i as u32 % fine_px[0]).into(), (i as u32 / fine_px[0]).into());
            for k in 0..SAMPLES {
                let position_px = (corner + SupersampledImage::SAMPLE_POSITIONS[k]) / f64::from(scale) - 0.5;
                let uv = ray_uv(&plan, position_px);
                let hit = reference.cast(key.pose.position_ned_m, key.pose.ned_from_camera * uv.extend(1.0));
                let depth = hit.map_or(0.0, |hit| 1.0 / hit.depth_m);
                assert!((f64::from(depths[k]) - depth).abs() <= 1e-6 * depth, "{position_px}");
                let color = DVec3::from_array(colors[k].map(|half| half.to_f64()));
                let error = (color - reference.radiance(&key.pose, uv)).abs().max_element();
                // Triangles are shaded once a pixel.
                apart += u32::from(error > 0.06);
                sum += error * error;
            }
        }
        let count = 4 * depths.len();
        let rms_dn = DN * (sum / count as f64).sqrt();
        eprintln!("scale {scale}: {apart} of {count} samples apart, {rms_dn:.2} DN");
        assert!((apart as usize) < count / 2000 && rms_dn < 3.0, "{apart} {rms_dn}");
    }
    // A pixel's colour is the mean of its samples'.
    plan.samples_a_pixel = 4;
    let image = cast.draw(&plan, &key);
    let (_, colors) = FrameCaster::new(&cast, &plan, &key, 1).samples(SIZE_PX, 0);
    for (i, _) in pixels() {
        let mean = colors[i].map(|color| DVec3::from_array(color.map(|half| half.to_f64())));
        let mean = mean.iter().sum::<DVec3>() / 4.0;
        assert!((color_at(&image, i) - mean).abs().max_element() < 5e-4, "{mean}");
    }
}

/// A white pane that reaches far to the lower right, 10 m before a black wall 20 m away, its border at an
/// angle; and a function that says how far a position is on the pane's side of its border, pixels.
fn edge() -> (Scene, KeyFrame, impl Fn(DVec2) -> f64) {
    let uniform = |byte: u8| {
        let texture = Texture::uniform([byte, byte, byte, 255], Encoding::Linear);
        Material::picture(Arc::new(texture), Wrap::Clamp)
    };
    let shape = pane(0.0, 1.0, [[1.0; 4]; 2]);
    let across = DMat3::from_rotation_x(0.3);
    let wide = DMat3::from_diagonal(DVec3::splat(200.0));
    let middle = across * DVec3::new(0.0, 100.0, 0.0);
    let meshes = vec![
        standing(&shape, &uniform(0), DVec3::new(20.0, 0.0, 0.0), wide),
        standing(&shape, &uniform(255), DVec3::new(10.0, 0.3, 0.1) + middle, across * wide),
    ];
    let level = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
    let pose = CameraPose { position_ned_m: DVec3::ZERO, ned_from_camera: DQuat::from_mat3(&level) };
    let normal = DVec2::new(0.3_f64.cos(), 0.3_f64.sin());
    let point_px = DVec2::new(47.0, 35.0) + 80.0 * DVec2::new(0.03, 0.01);
    let scene = Scene { meshes, ..Scene::default() };
    (scene, KeyFrame { t_s: 0.0, pose }, move |position_px: DVec2| normal.dot(position_px - point_px))
}

fn edge_plan() -> (Arc<Sequence>, FramePlan, KeyFrame, impl Fn(DVec2) -> f64) {
    let (scene, key, side) = edge();
    let (sequence, mut plan) = planned(scene);
    plan.ideal = IdealGeometry {
        size_px: SIZE_PX,
        focal_px: DVec2::splat(80.0),
        principal_px: DVec2::new(47.0, 35.0),
    };
    (sequence, plan, key, side)
}

#[test]
fn samples_of_an_edge_are_on_its_sides() {
    let (sequence, mut plan, key, side) = edge_plan();
    let cast = CastScene::new(&sequence.scene);
    plan.samples_a_pixel = 4;
    let image = cast.draw(&plan, &key);
    let mut mixed = 0;
    for (i, position_px) in pixels() {
        let covered = SAMPLE_POSITIONS.iter().filter(|position| side(position_px + **position) > 0.0).count();
        let expected = covered as f64 / 4.0;
        assert!((color_at(&image, i) - expected).abs().max_element() < 1e-6, "{position_px}: {covered}");
        let depth_m = if covered > 1 { 10.0 } else { 20.0 };
        assert!((f64::from(image.inverse_depth[i]) * depth_m - 1.0).abs() < 1e-6, "{position_px}: {covered}");
        mixed += u32::from(covered % 4 != 0);
    }
    assert!(mixed > 40, "{mixed}");
    for scale in [1, 3] {
        let frame = FrameCaster::new(&cast, &plan, &key, scale);
        let fine_px = SIZE_PX.map(|side| side * scale);
        let (depths, colors) = frame.samples(fine_px, 0);
        if scale == 1 {
            assert_eq!(depths, frame.sample_depths(fine_px, |_| None));
        }
        for (i, (depths, colors)) in depths.iter().zip(&colors).enumerate() {
            let corner = DVec2::new((i as u32 % fine_px[0]).into(), (i as u32 / fine_px[0]).into());
            for k in 0..SAMPLES {
                let position_px = (corner + SupersampledImage::SAMPLE_POSITIONS[k]) / f64::from(scale) - 0.5;
                let near = side(position_px) > 0.0;
                let depth_m = if near { 10.0 } else { 20.0 };
                assert!((depths[k] * depth_m - 1.0).abs() < 1e-6, "{position_px}");
                assert_eq!(colors[k][0].to_f32(), f32::from(u8::from(near)), "{position_px}");
            }
        }
    }
}

#[test]
fn marks_are_those_of_the_edge_and_all_depths_near_them_are_cast() {
    let (sequence, plan, key, side) = edge_plan();
    let cast = CastScene::new(&sequence.scene);
    let image = cast.draw(&plan, &key);
    let frame = FrameCaster::new(&cast, &plan, &key, 1);
    let all = frame.sample_depths(SIZE_PX, |_| None);
    let read = near_edges(SIZE_PX, &image.inverse_depth);
    let known = |i: usize| (!read[i]).then_some([image.inverse_depth[i]; SAMPLES]);
    let some = frame.sample_depths(SIZE_PX, known);
    // A pixel is marked where the middle of one of the eight around it is on the other side of the edge than
    // its own, unless both of an opposite pair are.
    let [width, height] = SIZE_PX.map(i64::from);
    let near =
        |x: i64, y: i64| side(DVec2::new(x.clamp(0, width - 1) as f64, y.clamp(0, height - 1) as f64)) > 0.0;
    let expected: Vec<bool> = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            [(1, 0), (0, 1), (1, 1), (1, -1)]
                .into_iter()
                .any(|(dx, dy)| near(x - dx, y - dy) != near(x, y) || near(x + dx, y + dy) != near(x, y))
        })
        .collect();
    let centres: Vec<PixelCentre> = image
        .inverse_depth
        .iter()
        .map(|&w| PixelCentre { inverse_depth: w.into(), color: DVec3::ZERO })
        .collect();
    assert_eq!(edge_mask(SIZE_PX, 1, &centres, &[]), expected);
    let samples = |of: &[[f32; 4]]| of.as_flattened().iter().map(|&w| f64::from(w)).collect::<Vec<_>>();
    let lines = |of: &[[f32; 4]]| SupersampledImage::edge_lines_of(SIZE_PX, 1, &samples(of));
    let (of_all, of_some) = (lines(&all), lines(&some));
    let (mut marked, mut with_line) = (0, 0);
    for (i, _) in expected.iter().enumerate().filter(|(_, marked)| **marked) {
        assert_eq!((of_all[i], all[i]), (of_some[i], some[i]), "{i}");
        marked += 1;
        with_line += u32::from(of_all[i].is_some());
    }
    let cast_pixels = read.iter().filter(|&&read| read).count();
    eprintln!("{marked} marks, {with_line} with a line, {cast_pixels} pixels cast");
    assert!(marked > 120 && with_line > 60 && cast_pixels < 1200, "{marked} {with_line} {cast_pixels}");
    // Thin surfaces: a pixel whose samples alone pass the edge is marked too.
    let thin = edge_mask(SIZE_PX, 1, &centres, &samples(&all));
    let covered = |i: usize, position_px: DVec2| {
        let count = SAMPLE_POSITIONS.iter().filter(|position| side(position_px + **position) > 0.0).count();
        expected[i] || count % 4 != 0
    };
    for (i, position_px) in pixels() {
        assert_eq!(thin[i], covered(i, position_px), "{position_px}");
    }
}

#[test]
fn fine_samples_are_there_where_the_plan_wants_them() {
    let (sequence, mut plan, key, _) = edge_plan();
    let cast = CastScene::new(&sequence.scene);
    assert!(cast.draw(&plan, &key).fine.is_none());
    let plain = cast.draw(&plan, &key);
    for (scale, thin) in [(1, false), (1, true), (3, true)] {
        plan.edges = EdgeStage::Supersampled { scale, samples: 16, thin };
        let image = cast.draw(&plan, &key);
        assert!(image.fine.is_some(), "{scale} {thin}");
        assert_eq!((&image.color_rgba, &image.inverse_depth), (&plain.color_rgba, &plain.inverse_depth));
    }
}
