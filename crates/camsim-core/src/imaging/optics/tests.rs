use std::f64::consts::{PI, TAU};

use super::*;
use crate::{
    imaging::optics::bessel::jinc,
    scenario::{OutputEncoding, PerChannel, PhotometricSpec},
};

const SIZE_PX: [u32; 2] = [96, 80];

fn camera(spec: PointSpreadSpec) -> CameraSpec {
    CameraSpec { size_px: SIZE_PX, point_spread: Some(spec), ..CameraSpec::default() }
}

fn gaussian(sigma_px: f64) -> PointSpreadSpec {
    PointSpreadSpec { sigma_px: Some(sigma_px), ..PointSpreadSpec::default() }
}

fn disc(defocus_px: f64) -> PointSpreadSpec {
    PointSpreadSpec { defocus_px: Some(defocus_px), ..PointSpreadSpec::default() }
}

/// Diffraction whose wavelength times f-number is this many pixels of 2 um.
fn airy(red_green_blue_px: [f64; 3]) -> PointSpreadSpec {
    let wavelength_nm = red_green_blue_px.map(|width_px| 2000.0 * width_px / 4.0);
    PointSpreadSpec {
        f_number: Some(4.0),
        pixel_um: Some(2.0),
        wavelength_nm: PerChannel::Each(wavelength_nm.into()),
        ..PointSpreadSpec::default()
    }
}

fn picture(color: impl Fn(f64, f64) -> [f64; 3]) -> Vec<f32> {
    let pixels = (0..SIZE_PX[1]).flat_map(|y| (0..SIZE_PX[0]).map(move |x| (f64::from(x), f64::from(y))));
    pixels.flat_map(|(x, y)| color(x, y).map(|value| value as f32).into_iter().chain([1.0])).collect()
}

fn spread(spec: PointSpreadSpec, mut rgba: Vec<f32>) -> Vec<f32> {
    Optics::new(&camera(spec), 0).expect("a point spread").spread(&mut rgba);
    rgba
}

fn at(rgba: &[f32], x: u32, y: u32) -> [f32; 3] {
    let i = RGBA * (y * SIZE_PX[0] + x) as usize;
    [rgba[i], rgba[i + 1], rgba[i + 2]]
}

/// The fraction of a wave's amplitude that is left in the middle of the picture.
fn left_of_wave(spec: PointSpreadSpec, cycles_px: [f64; 2]) -> f64 {
    let wave =
        |x: f64, y: f64| 0.5 + 0.4 * (TAU * (cycles_px[0] * (x - 48.0) + cycles_px[1] * (y - 40.0))).cos();
    let rgba = spread(spec, picture(|x, y| [wave(x, y); 3]));
    (f64::from(at(&rgba, 48, 40)[1]) - 0.5) / 0.4
}

#[test]
fn waves_lose_what_the_closed_forms_say() {
    for cycles_px in [[0.1, 0.05], [0.0, 0.31], [0.25, -0.2], [0.4, 0.0]] {
        let square: f64 = cycles_px.iter().map(|along: &f64| along * along).sum();
        for sigma_px in [0.5, 1.3, 3.0] {
            let expected = (-2.0 * PI * PI * sigma_px * sigma_px * square).exp();
            let found = left_of_wave(gaussian(sigma_px), cycles_px);
            // Taps end where they would change this by less.
            assert!((found - expected).abs() < 6e-3, "{sigma_px} {cycles_px:?}: {found} {expected}");
        }
        for diameter_px in [1.5, 6.0] {
            // The mean of the wave over a disc, in rings.
            let steps = 400;
            let position = |i: i32| diameter_px * ((f64::from(i) + 0.5) / f64::from(steps) - 0.5);
            let chord = |x: f64| (0.25 * diameter_px * diameter_px - x * x).sqrt();
            let sum: f64 =
                (0..steps).map(|i| chord(position(i)) * (TAU * square.sqrt() * position(i)).cos()).sum();
            let expected = sum / (0..steps).map(|i| chord(position(i))).sum::<f64>();
            let found = left_of_wave(disc(diameter_px), cycles_px);
            assert!((found - expected).abs() < 2e-3, "{diameter_px} {cycles_px:?}: {found} {expected}");
        }
    }
}

#[test]
fn a_point_becomes_airys_pattern() {
    let widths_px = [2.8, 2.5, 2.1];
    let point = picture(|x, y| if (x, y) == (48.0, 40.0) { [1.0; 3] } else { [0.0; 3] });
    let rgba = spread(airy(widths_px), point);
    for (x, y) in [(48, 40), (49, 40), (48, 43), (51, 44), (44, 36), (56, 40)] {
        let radius = (f64::from(x) - 48.0).hypot(f64::from(y) - 40.0);
        for (channel, width_px) in widths_px.into_iter().enumerate() {
            // Below half a cycle per pixel nothing of it is lost between the pixels.
            let expected = PI / (4.0 * width_px * width_px) * jinc(PI * radius / width_px).powi(2);
            let found = f64::from(at(&rgba, x, y)[channel]);
            assert!((found - expected).abs() < 2e-4, "{channel} {x} {y}: {found} {expected}");
        }
    }
}

#[test]
fn channels_do_not_mix() {
    let colors =
        |x: f64, y: f64| [(0.3 * x).sin().abs(), (0.2 * y).cos().abs(), ((x + y) * 0.17).sin().abs()];
    let together = spread(airy([3.0, 2.0, 1.0]), picture(colors));
    for (channel, width_px) in [3.0, 2.0, 1.0].into_iter().enumerate() {
        let alone = spread(airy([width_px; 3]), picture(colors));
        for (x, y) in [(0, 0), (17, 30), (48, 40), (95, 79)] {
            let (one, other) = (at(&together, x, y)[channel], at(&alone, x, y)[channel]);
            // Margins differ, as these reach as far as the widest pattern.
            assert!((one - other).abs() < 4e-3, "{channel} {x} {y}: {one} {other}");
        }
    }
}

#[test]
fn both_methods_for_a_gaussian_agree() {
    let colors = |x: f64, y: f64| [(0.3 * x).sin().abs(), if x > y { 1.0 } else { 0.0 }, 0.5];
    let by_taps = spread(gaussian(1.5), picture(colors));
    // A disc of a thousandth of a pixel changes nothing but the method.
    let by_transform = spread(PointSpreadSpec { defocus_px: Some(1e-3), ..gaussian(1.5) }, picture(colors));
    for (one, other) in by_taps.iter().zip(&by_transform) {
        assert!((one - other).abs() < 1e-3, "{one} {other}");
    }
}

#[test]
fn pixels_without_a_ray_neither_give_nor_get_light() {
    let is_outside = |x: f64, y: f64| (x - 48.0).hypot(y - 40.0) > 30.0;
    for spec in [gaussian(2.0), disc(7.0), airy([3.0, 2.0, 1.0])] {
        let mut rgba = picture(|_, _| [0.25, 0.5, 0.75]);
        for (i, pixel) in rgba.chunks_exact_mut(RGBA).enumerate() {
            if is_outside((i % 96) as f64, (i / 96) as f64) {
                pixel.fill(0.0);
            }
        }
        let optics = Optics::new(&camera(spec.clone()), 0).expect("a point spread");
        let expected = rgba.clone();
        // The second picture finds the neighbours that the first has looked for.
        for _ in 0..2 {
            optics.spread(&mut rgba);
            for (found, expected) in rgba.iter().zip(&expected) {
                assert!((found - expected).abs() < 1e-5, "{spec:?}: {found} {expected}");
            }
        }
    }
}

#[test]
fn glare_is_a_fraction_of_the_mean() {
    let half = picture(|x, _| if x < 48.0 { [0.8, 0.4, 0.0] } else { [0.0; 3] });
    let mut with_hole = half.clone();
    with_hole[..RGBA * 96].fill(0.0);
    for rgba in [half, with_hole] {
        let found = spread(PointSpreadSpec { glare: 0.1, ..PointSpreadSpec::default() }, rgba.clone());
        for (found, before) in found.chunks_exact(RGBA).zip(rgba.chunks_exact(RGBA)) {
            let veil = if before[3] > 0.0 { [0.04, 0.02, 0.0] } else { [0.0; 3] };
            for (channel, veil) in veil.into_iter().enumerate() {
                assert!((found[channel] - (0.9 * before[channel] + veil)).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn noise_comes_after_the_spread() {
    let photometric = PhotometricSpec {
        noise_sigma: 0.05,
        light: 1.5,
        output: OutputEncoding::Luma8,
        ..PhotometricSpec::default()
    };
    let camera = CameraSpec { photometric, ..camera(gaussian(3.0)) };
    let optics = Optics::new(&camera, 7).expect("a point spread");
    let color_rgba = picture(|_, _| [0.5, 0.25, 0.1]);
    let mut frame = RenderedFrame { index: 3, ..RenderedFrame::picture(SIZE_PX, color_rgba) };
    optics.expose(&mut frame, None);
    let table = tail_table();
    for (x, y) in [(0, 0), (13, 70), (95, 79)] {
        let expected = photometric_value(&camera, [x, y], &table);
        assert!((at(frame.color_rgba(), x, y)[0] - expected).abs() < 1e-5);
    }
}

fn photometric_value(camera: &CameraSpec, pixel: [u32; 2], table: &[f32]) -> f32 {
    photometric(&Photometry::whole(camera, None), [0.5, 0.25, 0.1], 1.0, pixel, 3, 7, table)[0]
}

#[test]
fn a_measured_kernel_is_the_picture_of_a_point() {
    let red: Vec<f64> = (0..15).map(f64::from).collect();
    let channels = [red, vec![1.0; 15], vec![2.0; 15]];
    let kernel = SpreadKernel::new([5, 3], channels.clone()).expect("a kernel");
    let file = LoadedFile::new("k.png", kernel);
    let spec = PointSpreadSpec { kernel: Some(file), ..PointSpreadSpec::default() };
    let point = picture(|x, y| if (x, y) == (48.0, 40.0) { [1.0; 3] } else { [0.0; 3] });
    let rgba = spread(spec, point);
    for y in 0..3 {
        for x in 0..5 {
            for (channel, values) in channels.iter().enumerate() {
                let expected = values[5 * y + x] / values.iter().sum::<f64>();
                let found = f64::from(at(&rgba, 46 + x as u32, 39 + y as u32)[channel]);
                assert!((found - expected).abs() < 1e-6, "{channel} {x} {y}: {found} {expected}");
            }
        }
    }
}

#[test]
fn optics_are_kept_while_they_are_the_same() {
    let kernel = |value: f64| {
        let channels = [vec![1.0, value], vec![1.0, value], vec![1.0, value]];
        let kernel = SpreadKernel::new([2, 1], channels).expect("a kernel");
        let file = LoadedFile::new("k.csv", kernel);
        camera(PointSpreadSpec { kernel: Some(file), ..PointSpreadSpec::default() })
    };
    let table = |optics: &Optics| optics.simple.as_ref().map(|simple| simple.noise_table.as_ptr());
    let first = Optics::new(&kernel(1.0), 1).expect("optics");
    let memory = table(&first);
    let same = Optics::renewed(Some(first), &kernel(1.0), 1).expect("optics");
    assert_eq!(table(&same), memory);
    let other = Optics::renewed(Some(same), &kernel(2.0), 1).expect("optics");
    assert_ne!(table(&other), memory, "the file has changed");
    assert!(Optics::renewed(Some(other), &CameraSpec::default(), 1).is_none());
}
