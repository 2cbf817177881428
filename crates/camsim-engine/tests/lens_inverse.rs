//! GPU lens maps against the f64 inverse of the core, on the software adapter where there is one.
#![allow(clippy::unwrap_used)]

use camsim_core::camera::{CameraModel, INVALID_UV};
use camsim_core::lens::{Lens, LensModel};
use camsim_gpu::{
    recorder::Recorder,
    reverse::lens_inverse::{LensInversePass, LensMap},
    staging::Staging,
};
use glam::DVec2;
use rayon::prelude::*;

/// f32 floor of Newton's method at up to 8192 px: NUMERICS 1.
const MAX_ERROR_PX: f64 = 1e-3;
/// Within 1 px of a fold the inverse magnifies rounding like a square root.
const MAX_ERROR_NEAR_FOLD_PX: f64 = 6e-3;
/// Where even validity is open (see `BORDER_PX`), the square root of the f32 floor is all there is.
const MAX_ERROR_AT_BORDER_PX: f64 = 5e-2;
/// Ideal points beyond are of rays more than 63 degrees off axis.
const FAR_OUT: f64 = 2.0;
/// Pixels whose border is nearer than this may be judged either way.
const BORDER_PX: f64 = 1e-2;

struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pass: LensInversePass,
}

impl Gpu {
    /// Software adapter first: the same everywhere. None at all is a failure.
    fn new() -> Self {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = [true, false]
            .into_iter()
            .find_map(|force_fallback_adapter| {
                let options = wgpu::RequestAdapterOptions { force_fallback_adapter, ..Default::default() };
                pollster::block_on(instance.request_adapter(&options)).ok()
            })
            .expect("no GPU adapter: install Mesa's lavapipe (mesa-vulkan-drivers)");
        let (device, queue) =
            pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap();
        let pass = LensInversePass::new(&device);
        Self { device, queue, pass }
    }

    fn map(&self, camera: &CameraModel, warm: Option<&LensMap>) -> (Vec<[f32; 2]>, LensMap) {
        let [width, height] = camera.size_px;
        let mut map_on_device = LensMap::new(&self.device, camera.size_px);
        let mut staging = Staging::new(&self.device);
        let mut recorder = Recorder::new(&self.device, None, &mut staging);
        self.pass.encode(&self.device, &mut recorder, camera, &mut map_on_device, warm);
        let row_bytes = (width * 8).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row_bytes) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        recorder.encoder().copy_texture_to_buffer(
            map_on_device.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
            },
            map_on_device.texture.size(),
        );
        self.queue.submit([recorder.finish().unwrap()]);
        buffer.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let bytes = buffer.get_mapped_range(..).unwrap();
        let map = bytes
            .chunks_exact(row_bytes as usize)
            .flat_map(|row| bytemuck::cast_slice::<u8, [f32; 2]>(&row[..width as usize * 8]).iter().copied())
            .collect();
        (map, map_on_device)
    }
}

/// The committed calibration sets, shrunk to at most `max_edge` pixels (focal length with it: same rays,
/// fewer of them).
fn sets(max_edge: f64) -> Vec<(String, CameraModel)> {
    let text = include_str!("../../../tests/data/lens_sets.csv");
    let set = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| cells[i].parse::<f64>().unwrap();
        let shrink = (max_edge / number(2).max(number(3))).min(1.0);
        let size_px = [(number(2) * shrink) as u32, (number(3) * shrink) as u32];
        let model =
            if cells[1] == "brown-conrady" { LensModel::BrownConrady } else { LensModel::KannalaBrandt };
        let coefficients: Vec<f64> = cells[8].split_whitespace().map(|k| k.parse().unwrap()).collect();
        let centre = [number(6) * shrink, number(7) * shrink];
        let camera = CameraModel::new(
            size_px,
            [number(4) * shrink, number(5) * shrink],
            Some(centre),
            model,
            &coefficients,
        )
        .unwrap();
        (cells[0].to_owned(), camera)
    };
    text.lines().skip(1).map(set).collect()
}

/// Image of the border of the principal branch, pixels.
fn border_px(camera: &CameraModel) -> Vec<DVec2> {
    let Some(fold) = camera.lens.fold_curve() else { return Vec::new() };
    (0..7200)
        .map(|i| {
            let phi = f64::from(i) * std::f64::consts::TAU / 7200.0;
            camera.project(DVec2::from_angle(phi) * (fold.radius(phi) * (1.0 - 1e-12)))
        })
        .filter(|point| point.is_finite())
        .collect()
}

fn distance(border: &[DVec2], pixel: DVec2) -> f64 {
    let to_segment = |ends: &[DVec2]| {
        let along = ends[1] - ends[0];
        let fraction = ((pixel - ends[0]).dot(along) / along.length_squared().max(1e-300)).clamp(0.0, 1.0);
        (ends[0] + along * fraction - pixel).length()
    };
    border.windows(2).map(to_segment).fold(f64::INFINITY, f64::min)
}

/// How far a GPU answer is off, in pixels: along the ideal plane for a lens of moderate field, on the image
/// for a fisheye and for rays far out, where the ideal plane stretches without bound.
fn error_px(camera: &CameraModel, expected: DVec2, got: DVec2) -> f64 {
    match camera.lens {
        Lens::Radial(_) => (camera.project(got) - camera.project(expected)).length(),
        _ if expected.length() > FAR_OUT => (camera.project(got) - camera.project(expected)).length(),
        _ => ((got - expected) * camera.focal_px).length() / expected.length().max(1.0),
    }
}

/// Compares one map with the f64 inverse; returns (worst error, worst near the fold, invalid share).
fn compare(name: &str, camera: &CameraModel, map: &[[f32; 2]]) -> (f64, f64, f64) {
    let expected = camera.lens_inverse();
    assert_eq!(expected.len(), map.len());
    let border = border_px(camera);
    let judge = |(i, (cpu, gpu)): (usize, (&[f32; 2], &[f32; 2]))| {
        let pixel =
            DVec2::new((i % camera.size_px[0] as usize) as f64, (i / camera.size_px[0] as usize) as f64);
        let (cpu_valid, gpu_valid) = (cpu[0] < INVALID_UV, gpu[0] < INVALID_UV);
        assert_eq!(gpu[0] < INVALID_UV, gpu[1] < INVALID_UV, "{name} {pixel}: half a mark");
        if cpu_valid != gpu_valid {
            let distance = distance(&border, pixel);
            assert!(
                distance < BORDER_PX,
                "{name} {pixel}: CPU valid {cpu_valid}, GPU {gpu_valid}, {distance} px from the border"
            );
        }
        if !cpu_valid || !gpu_valid {
            return (0.0, 0.0, usize::from(!cpu_valid));
        }
        let ideal = camera.unproject(pixel).unwrap();
        let error = error_px(camera, ideal, DVec2::new(f64::from(gpu[0]), f64::from(gpu[1])));
        if error <= MAX_ERROR_PX {
            return (error, 0.0, 0);
        }
        // A lens that all but folds magnifies rounding as a fold does.
        let jacobian = camera.lens.jacobian(ideal);
        let smallest_stretch =
            jacobian.determinant() / jacobian.x_axis.length().max(jacobian.y_axis.length());
        let distance = distance(&border, pixel);
        assert!(
            distance < 1.0 || smallest_stretch < 0.05,
            "{name} {pixel}: off by {error} px, {distance} px from the border"
        );
        let limit = if distance < BORDER_PX { MAX_ERROR_AT_BORDER_PX } else { MAX_ERROR_NEAR_FOLD_PX };
        assert!(error < limit, "{name} {pixel}: off by {error} px, {distance} px from the border");
        (0.0, error, 0)
    };
    let (worst, worst_near, invalid) = expected
        .par_iter()
        .zip(map)
        .enumerate()
        .map(judge)
        .reduce(|| (0.0_f64, 0.0_f64, 0_usize), |a, b| (a.0.max(b.0), a.1.max(b.1), a.2 + b.2));
    (worst, worst_near, invalid as f64 / map.len() as f64)
}

#[test]
fn lens_maps_agree_with_the_f64_inverse() {
    let gpu = Gpu::new();
    for (name, camera) in sets(640.0) {
        let (map, _) = gpu.map(&camera, None);
        let (worst, near, invalid) = compare(&name, &camera, &map);
        eprintln!("{name}: {worst:.1e} px, near the fold {near:.1e} px, invalid {:.2} %", 100.0 * invalid);
        if name == "camsim_S3_fisheye_opencv" {
            assert!((invalid - 0.43).abs() < 0.005, "{invalid}");
        }
    }
}

#[test]
fn warm_start_gives_the_same_map() {
    let gpu = Gpu::new();
    for (name, camera) in sets(320.0) {
        let zoomed = CameraModel { focal_px: camera.focal_px * 1.1, ..camera.clone() };
        let (_, warm) = gpu.map(&zoomed, None);
        let (map, _) = gpu.map(&camera, Some(&warm));
        compare(&name, &camera, &map);
    }
}

#[test]
fn large_images_keep_the_tolerance() {
    let gpu = Gpu::new();
    let k = [
        -0.04734574598470396,
        0.00875629525446153,
        0.002032062604630639,
        -0.0007921675594001833,
        -0.06874708730325006,
    ];
    // A strip of a 45 Mpx camera: the precision of pixel coordinates is what is tested.
    let focal = [8141.664930616623; 2];
    let camera =
        CameraModel::new([8192, 24], focal, Some([4088.206985074835, -2700.37]), LensModel::BrownConrady, &k)
            .unwrap();
    let (worst, ..) = compare("strip", &camera, &gpu.map(&camera, None).0);
    eprintln!("8192 px: {worst:.1e} px");
}

#[test]
fn pinhole_and_odd_sizes_match() {
    let gpu = Gpu::new();
    for size in [[1, 1], [9, 7], [641, 3]] {
        let camera = CameraModel::new(size, [500.0, 510.0], None, LensModel::Pinhole, &[]).unwrap();
        let (worst, ..) = compare("pinhole", &camera, &gpu.map(&camera, None).0);
        assert!(worst < 1e-4);
    }
}

/// Lenses that nobody calibrated: every third one rational, a quarter of their pixels beyond the fold.
#[test]
fn random_lenses_agree() {
    let gpu = Gpu::new();
    // Park-Miller: the same lenses on every machine.
    let mut state = 20_u64;
    let mut random = |low: f64, high: f64| {
        state = state * 48_271 % 2_147_483_647;
        low + (high - low) * state as f64 / 2_147_483_647.0
    };
    let (mut judged, mut invalid) = (0, 0.0);
    for i in 0..120 {
        let mut k: Vec<f64> =
            [0.6, 0.4, 0.02, 0.02, 0.2].into_iter().map(|bound| random(-bound, bound)).collect();
        if i % 3 == 0 {
            k.extend([0.4, 0.2, 0.05].into_iter().map(|bound| random(-bound, bound)));
        }
        let focal = random(70.0, 200.0);
        let centre = [random(60.0, 100.0), random(40.0, 80.0)];
        let camera =
            CameraModel::new([160, 120], [focal; 2], Some(centre), LensModel::BrownConrady, &k).unwrap();
        // Where a pixel has two ideal rays on the principal branch, either is an answer.
        if camera.check().bijective {
            invalid += compare(&format!("{k:?} f {focal}"), &camera, &gpu.map(&camera, None).0).2;
            judged += 1;
        }
    }
    eprintln!("{judged} lenses, {:.1} % of their pixels invalid", 100.0 * invalid / f64::from(judged));
    assert!(judged > 80);
}
