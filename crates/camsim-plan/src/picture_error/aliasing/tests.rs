use super::*;
use crate::ir::stages::PathStage;
use camsim_core::temporal::{ColorImage, gather, silhouette_rays::subsample};

/// What is told of a reading itself.
fn told(&BorderReading { width_px, taps, samples_a_pixel, exposure }: &BorderReading) -> f64 {
    sum_of_waves(width_px, &square(width_px, taps), exposure)[usize::from(samples_a_pixel > 1)]
}

/// The same by drawing borders: in all positions and directions, each read by the very gather of the twin,
/// beside the area that it truly covers.
fn measured(reading: &BorderReading) -> f64 {
    const SIDE: u32 = 40;
    const BORDERS: u32 = 2400;
    const GRID: u32 = 24;
    let BorderReading { width_px, taps, samples_a_pixel, exposure } = *reading;
    let area = square(width_px, taps);
    let part = |k: u32, step: f64| (f64::from(k + 1) * step).fract();
    let path = exposure.map_or(0.0, |(path_px, _)| path_px);
    let reach_px = 0.5 * path + width_px + 3.0;
    let squares = (0..BORDERS).map(|k| {
        let normal = DVec2::from_angle(2.0 * PI * part(k, 0.754_877_666_246_693));
        let along = path * DVec2::from_angle(2.0 * PI * part(k, 0.324_717_957_244_746));
        let at =
            DVec2::splat(19.0) + DVec2::new(part(k, 0.618_033_988_749_895), part(k, 0.414_213_562_373_095));
        let border = at.dot(normal) + reach_px * (2.0 * part(k, 0.569_840_290_998_053) - 1.0);
        let lit = |px: DVec2| f64::from(px.dot(normal) < border);
        let positions = if samples_a_pixel == 1 { vec![DVec2::ZERO] } else { SAMPLE_POSITIONS.to_vec() };
        let shown = |px: DVec2| {
            positions.iter().map(|&position| lit(px + position)).sum::<f64>() / positions.len() as f64
        };
        let rgba: Vec<f32> = (0..SIDE * SIDE)
            .flat_map(|i| [shown(DVec2::new(f64::from(i % SIDE), f64::from(i / SIDE))) as f32; 4])
            .collect();
        let image = ColorImage { size_px: [SIDE; 2], rgba: &rgba };
        let nodes = [at - 0.5 * along, at + 0.5 * along];
        let found = match exposure {
            None => gather(&[at], PathStage::Straight, &area, &image, 1.0, 1),
            Some((_, samples)) => gather(&nodes, PathStage::Straight, &area, &image, 1e9, samples),
        };
        let instants = if exposure.is_some() { 16 } else { 1 };
        let inside = (0..GRID * GRID * instants).map(|i| {
            let [x, y] = [i % GRID, i / GRID % GRID].map(|n| (f64::from(n) + 0.5) / f64::from(GRID) - 0.5);
            let fraction = (f64::from(i / (GRID * GRID)) + 0.5) / f64::from(instants) - 0.5;
            lit(at + fraction * along + width_px * DVec2::new(x, y))
        });
        (found.x - inside.sum::<f64>() / f64::from(GRID * GRID * instants)).powi(2)
    });
    // A border within reach of a pixel on both sides, in output pixels, crosses 1 of as many.
    squares.sum::<f64>() / f64::from(BORDERS) * 2.0 * reach_px / width_px
}

#[test]
fn aliasing_is_that_of_drawn_borders() {
    let grid = TapStage::Grid { most: 4 };
    for width_px in [1.0, 1.41, 2.0, 2.5, 3.0, 3.6] {
        // A single read of so wide a pixel is never done: a path counts up to 1.7 times
        // there.
        let covers = |taps: &TapStage| width_px <= 3.0 || [grid, TapStage::Area].contains(taps);
        for taps in [TapStage::Bilinear, TapStage::Spline, TapStage::Area, grid].into_iter().filter(covers) {
            let exposures = [None, Some((1.0, 2)), Some((6.0, 6)), Some((6.0, 20))];
            for (exposure, samples_a_pixel) in
                exposures.into_iter().flat_map(|exposure| [(exposure, 1), (exposure, SAMPLES)])
            {
                let area = square(width_px, taps);
                let at_least =
                    |(path_px, samples): (f64, u32)| (path_px, samples.max(area.taps[0] * area.taps[1]));
                let reading =
                    BorderReading { width_px, taps, samples_a_pixel, exposure: exposure.map(at_least) };
                let (told, found) = (told(&reading), measured(&reading));
                let off = (told / found).sqrt();
                // Of long paths the waves across them count for too much. Sixteen reads ask for more
                // waves: 4608 find 0.96 of what is measured. Several samples leave little, of which each
                // wave that is not looked at is more: 0.89 to 1.83 times, in the median 1.0. Most is for
                // a path, as above.
                let (least, most) = match samples_a_pixel {
                    1 if width_px > 3.0 => (0.92, 1.5),
                    1 => (0.95, 1.5),
                    _ => (0.88, 1.85),
                };
                assert!((least..most).contains(&off), "{reading:?}: {told:.2e}, measured {found:.2e}");
            }
        }
    }
}

#[test]
fn error_of_rays_is_that_of_drawn_borders() {
    const BORDERS: u32 = 1500;
    const EXACT: u32 = 4096;
    let part = |k: u32, step: f64| (f64::from(k + 1) * step).fract();
    let all: Vec<(DVec2, f64)> = (0..EXACT)
        .map(|i| {
            let [x, y, fraction] = [1.0 / f64::from(EXACT), 0.754_877_666_246_693, 0.569_840_290_998_053]
                .map(|step| part(i, step));
            (DVec2::new(x, y) - 0.5, fraction)
        })
        .collect();
    let lit = |positions: &[(DVec2, f64)], normal: DVec2, along: f64, at: f64| {
        let lit = positions
            .iter()
            .filter(|(position, fraction)| position.dot(normal) + along * (fraction - 0.5) < at)
            .count();
        lit as f64 / positions.len() as f64
    };
    for rays in [16, 32, 64, 128, 256] {
        let positions: Vec<(DVec2, f64)> = (0..rays).map(|i| subsample(i, rays)).collect();
        for path_px in [0.0, 1.5, 3.0, 7.0, 15.0, 30.0] {
            let squares = (0..BORDERS).map(|k| {
                let normal = DVec2::from_angle(2.0 * PI * part(k, 0.754_877_666_246_693));
                let along = path_px * (2.0 * PI * part(k, 0.324_717_957_244_746)).cos();
                let reach_px = 0.5 * (normal.abs().element_sum() + along.abs());
                let at = reach_px * (2.0 * part(k, 0.569_840_290_998_053) - 1.0);
                2.0 * reach_px * (lit(&positions, normal, along, at) - lit(&all, normal, along, at)).powi(2)
            });
            let found = squares.sum::<f64>() / f64::from(BORDERS);
            let off = missed_by_rays(rays, path_px) / found;
            // Of the fewest too much is said of short paths.
            let most = if rays == 16 { 2.3 } else { 1.7 };
            assert!((0.6..most).contains(&off), "{rays} rays, {path_px} px: {off:.2} of {found:.2e}");
        }
    }
}

#[test]
fn cached_aliasing_is_the_sum_of_waves() {
    let reading = BorderReading {
        width_px: 2.0,
        taps: TapStage::Bilinear,
        samples_a_pixel: 1,
        exposure: Some((7.0, 8)),
    };
    assert_eq!([aliasing2(&reading), aliasing2(&reading)], [told(&reading); 2]);
    // What lies between the steps is as far off as these are apart, and not more sure of itself for
    // samples that are not counted.
    for (width_px, path_px, samples) in [(2.07, 6.2, 9), (1.03, 8.9, 31), (2.9, 2.3, 13)] {
        let between = BorderReading { width_px, exposure: Some((path_px, samples)), ..reading };
        let off = (aliasing2(&between) / told(&between)).sqrt();
        assert!((0.93..1.15).contains(&off), "{between:?}: {off:.3}");
    }
    assert!((1..400).all(|samples| rounded_count(samples) <= samples && 5 * rounded_count(samples) >= 4 * samples - 1));
}
