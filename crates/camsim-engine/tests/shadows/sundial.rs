//! A sundial: a pole on level ground, whose shadow trigonometry knows.

use std::sync::Arc;

use camsim_core::{
    reference::{Hit, ReferenceRenderer},
    scenario::Channel,
    scene::Scene,
    sequence::Sequence,
};
use camsim_engine::{Backend, Engine};
use glam::{DVec2, DVec3};

use crate::{
    SKY, SUN, block, by_reference,
    common::{engine, render, sequence, steady},
    level_ground, light, looking_down,
};

const SIZE_PX: [u32; 2] = [160, 120];
/// The pole: half its width and its height, metres.
const HALF_M: f64 = 0.25;
const HEIGHT_M: f64 = 8.0;
/// On the ground, 60 m below the camera.
const METRES_A_PX: f64 = 60.0 / 300.0;

/// A pole in the middle of level ground. The camera is 60 m above it, where the shadow is in view.
fn sundial() -> Arc<Sequence> {
    let scene = Scene {
        terrain: Some(level_ground(&light())),
        meshes: vec![block(DVec3::ZERO, [HALF_M; 2], HEIGHT_M, 100)],
        sky_linear: [0.1; 3],
        light: Some(light()),
        ..Scene::default()
    };
    sequence(looking_down(SIZE_PX, 300.0), steady(60.0, 0.0, DVec3::ZERO, DVec3::ZERO), scene)
}

/// Outline of the pole's shadow on the ground, north and east, metres: what its floor and its shifted top span.
fn shadow_outline() -> Vec<DVec2> {
    let azimuth = 220_f64.to_radians() - std::f64::consts::PI;
    let shift = HEIGHT_M / 35_f64.to_radians().tan() * DVec2::from_angle(azimuth);
    let corner = |n: f64, e: f64| HALF_M * DVec2::new(n, e);
    // Towards the north-east: three corners of the floor, and three of the top. Turns from north to east.
    vec![
        corner(1.0, -1.0),
        corner(1.0, -1.0) + shift,
        corner(1.0, 1.0) + shift,
        corner(-1.0, 1.0) + shift,
        corner(-1.0, 1.0),
        corner(-1.0, -1.0),
    ]
}

/// Signed distance to the border of a convex outline, positive within.
fn within_m(outline: &[DVec2], point: DVec2) -> f64 {
    (0..outline.len()).fold(f64::INFINITY, |least, k| {
        let (a, b) = (outline[k], outline[(k + 1) % outline.len()]);
        least.min((b - a).normalize().perp_dot(point - a))
    })
}

/// Area of a convex outline within a rectangle.
fn area_within(outline: &[DVec2], low: DVec2, high: DVec2) -> f64 {
    let sides = [(DVec2::X, low.x), (-DVec2::X, -high.x), (DVec2::Y, low.y), (-DVec2::Y, -high.y)];
    let mut left = outline.to_vec();
    for (inward, at) in sides {
        let inside = |p: DVec2| inward.dot(p) - at;
        let mut cut = Vec::new();
        for k in 0..left.len() {
            let (a, b) = (left[k], left[(k + 1) % left.len()]);
            if inside(a) >= 0.0 {
                cut.push(a);
            }
            if (inside(a) >= 0.0) != (inside(b) >= 0.0) {
                cut.push(a.lerp(b, inside(a) / (inside(a) - inside(b))));
            }
        }
        left = cut;
    }
    0.5 * (0..left.len()).map(|k| left[k].perp_dot(left[(k + 1) % left.len()])).sum::<f64>()
}

#[test]
fn reference_has_the_sundials_shadow_where_trigonometry_says() {
    let reference = ReferenceRenderer::new(sundial()).expect("a reference");
    let outline = shadow_outline();
    let ground = |point: DVec2| -> Hit {
        let origin = point.extend(-1e-3);
        let hit = reference.cast(origin, DVec3::Z).expect("ground");
        assert_eq!(hit.surface, 0);
        hit
    };
    let (mut shaded, mut lit) = (0, 0);
    // The tip's middle and corners, and points 1 mm on both sides of all borders.
    for k in 0..outline.len() {
        let (a, b) = (outline[k], outline[(k + 1) % outline.len()]);
        let inward = (b - a).normalize().perp();
        for fraction in [0.01, 0.3, 0.5, 0.77, 0.99] {
            for off_m in [-1e-3, 1e-3] {
                let point = a.lerp(b, fraction) + off_m * inward;
                // The floor of the pole is not ground that is seen.
                if point.abs().max_element() < HALF_M + 2e-3 {
                    continue;
                }
                let expected = within_m(&outline, point) > 0.0;
                assert_eq!(reference.is_in_shadow(0.0, &ground(point)), expected, "{point}");
                (shaded, lit) = (shaded + u32::from(expected), lit + u32::from(!expected));
            }
        }
    }
    assert!(shaded > 15 && lit > 15, "{shaded} {lit}");
    // The tip is as far from the top's corner as trigonometry says.
    let tip_m = HEIGHT_M / 35_f64.to_radians().tan();
    let along = DVec2::from_angle(40_f64.to_radians());
    let corner = DVec2::splat(HALF_M);
    let found = [-1e-5, 1e-5].map(|off_m| {
        let inside = corner + (tip_m + off_m) * along - 1e-9;
        reference.is_in_shadow(0.0, &ground(inside))
    });
    assert_eq!(found, [true, false]);
}

/// Light of ground pixels, by area in closed form; `None` where the pole may be seen.
fn expected_pixel(outline: &[DVec2], x: u32, y: u32) -> Option<f64> {
    let north = |y: f64| (59.5 - y) * METRES_A_PX;
    let east = |x: f64| (x - 79.5) * METRES_A_PX;
    let (x, y) = (f64::from(x), f64::from(y));
    let (low, high) = (DVec2::new(north(y + 0.5), east(x - 0.5)), DVec2::new(north(y - 0.5), east(x + 0.5)));
    // Seen from above, the top covers a sixth more than the floor.
    if low.max(-high).max_element() < 0.5 {
        return None;
    }
    let fraction = area_within(outline, low, high) / (METRES_A_PX * METRES_A_PX);
    let of_sun = SUN * 35_f64.to_radians().sin();
    Some(0.8 * (of_sun * (1.0 - fraction) + SKY))
}

/// Compares a picture with areas in closed form: over all pixels within 3 px of the shadow's borders, and by
/// the shadow's area, which its tip and its sides make.
fn expect_sundial(who: &str, picture: &[f32], least_db: f64) {
    let outline = shadow_outline();
    let full = 0.8 * (SUN * 35_f64.to_radians().sin() + SKY);
    // The picture on the ground has 8 bits.
    let byte = f64::from(picture[0]) / full;
    assert!((byte - 1.0).abs() < 0.5 / 140.0, "{byte}");
    let (mut area, mut expected_area) = (0.0, 0.0);
    let (mut squares, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
    for i in 0..SIZE_PX[0] * SIZE_PX[1] {
        let (x, y) = (i % SIZE_PX[0], i / SIZE_PX[0]);
        let Some(expected) = expected_pixel(&outline, x, y) else { continue };
        let error = f64::from(picture[4 * i as usize]) - byte * expected;
        (area, expected_area) =
            (area + byte * (full - expected) - error, expected_area + byte * (full - expected));
        let point = METRES_A_PX * DVec2::new(59.5 - f64::from(y), f64::from(x) - 79.5);
        if within_m(&outline, point).abs() < 3.0 * METRES_A_PX {
            worst = worst.max(error.abs());
            (squares, count) = (squares + error * error, count + 1.0);
        }
    }
    let psnr_db = -10.0 * (squares / count).log10();
    let of_area = area / expected_area;
    eprintln!(
        "{who}: {psnr_db:.1} dB in {count} pixels, worst {worst:.4}, area {of_area:.4} of the expected"
    );
    assert!(count > 400.0 && psnr_db > least_db, "{who}: {psnr_db} {worst}");
    assert!((of_area - 1.0).abs() < 0.01, "{who}: {of_area}");
}

#[test]
fn reference_pictures_the_sundial() {
    expect_sundial("reference", &by_reference(&sundial()), 50.0);
}

#[test]
fn cpu_pictures_the_sundial() {
    let picture = render(&Engine::cpu(), &sundial(), &[Channel::Color], 0).frame.into_color();
    expect_sundial("cpu", &picture, 38.0);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn gpu_pictures_the_sundial() {
    let mut engine = engine();
    engine.set_backend(Backend::Gpu);
    let picture = render(&engine, &sundial(), &[Channel::Color], 0).frame.into_color();
    expect_sundial("gpu", &picture, 38.0);
}
