//! Looks at a level plane against its homography, written out here from the conventions and from nothing else
//! of the crate.

use camsim_core::{
    reference::{IdealView, ReferenceRenderer},
    scenario::{FieldOr, LensSpec, Readout, Scenario, ShutterSpec},
    temporal::IdealGeometry,
};
use glam::{DMat3, DQuat, DVec2, DVec3};

use crate::fixtures::{Steady, folding, plane, rolling, scenario, sequence, tangential};

/// What the reference may be off by, pixels.
const EXACT_PX: f64 = 1e-6;

/// Camera straight below the body: its x is the right wing, its y the tail, its z the belly.
const BODY_FROM_CAMERA: DMat3 = DMat3::from_cols(DVec3::Y, DVec3::new(-1.0, 0.0, 0.0), DVec3::Z);

/// Pose of the camera at an instant: position and `ned_from_camera`.
fn pose(motion: &Steady, t_s: f64) -> (DVec3, DMat3) {
    let turned = DMat3::from_quat(motion.ned_from_body)
        * DMat3::from_quat(DQuat::from_scaled_axis(t_s * motion.rate_body_rad_s));
    (motion.position_ned_m + t_s * motion.velocity_ned_m_s, turned * BODY_FROM_CAMERA)
}

/// Brown's formula with five coefficients or fewer.
fn distort(k: &[f64], DVec2 { x: u, y: v }: DVec2) -> DVec2 {
    let k = |i: usize| k.get(i).copied().unwrap_or(0.0);
    let r2 = u.powi(2) + v.powi(2);
    let radial = 1.0 + k(0) * r2 + k(1) * r2.powi(2) + k(4) * r2.powi(3);
    let (p1, p2) = (k(2), k(3));
    DVec2::new(
        u * radial + 2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u),
        v * radial + p1 * (r2 + 2.0 * v * v) + 2.0 * p2 * u * v,
    )
}

/// Mid-exposure of row y, from the conventions: the image's centre is older than its stamp by the delay.
fn row_mid_s(shutter: &ShutterSpec, y: f64, rows: f64) -> f64 {
    let earlier_ms = match shutter.interlace_ms {
        FieldOr::Ms(ms) if y % 2.0 == 0.0 => ms,
        _ => 0.0,
    };
    let fraction = match shutter.readout {
        Readout::BottomToTop => 0.5 - (y + 0.5) / rows,
        _ => (y + 0.5) / rows - 0.5,
    };
    1e-3 * (fraction * shutter.readout_ms - shutter.delay_ms - earlier_ms)
}

/// Frame 3 of a flight over the plane z = 0: the ideal rays of a grid, imaged by the formula, must be the
/// rays that the reference finds at those positions, meet the plane where the line of sight does, and lie in the
/// key frame where the plane's homography says.
fn check(name: &str, scenario: &Scenario, motion: Steady, reach: f64) {
    let camera = &scenario.camera;
    let [fx, fy] = camera.focal_px;
    let [cx, cy] = camera.principal_point_px.unwrap();
    let [width, height] = camera.size_px.map(f64::from);
    let stamp_s = 3.0 / camera.fps;
    let (key_at, ned_from_key) = pose(&motion, stamp_s - 0.004);
    let ideal = IdealGeometry {
        size_px: [800, 600],
        focal_px: DVec2::new(310.0, 305.0),
        principal_px: DVec2::new(401.5, 290.25),
    };
    let key_pose = camsim_core::pose::CameraPose {
        position_ned_m: key_at,
        ned_from_camera: DQuat::from_mat3(&ned_from_key),
    };
    let key = IdealView { pose: key_pose, ideal };
    let reference = ReferenceRenderer::new(sequence(scenario.clone(), motion, plane(20_000.0))).unwrap();
    let (mut looked, mut worst_px, mut worst_source_px) = (0, 0.0_f64, 0.0_f64);
    for i in -24_i32..=24 {
        for j in -18_i32..=18 {
            let uv = DVec2::new(f64::from(i) / 24.0, f64::from(j) / 18.0) * reach;
            let at_px = distort(&camera.lens.coefficients, uv) * DVec2::new(fx, fy) + DVec2::new(cx, cy);
            let pixel = at_px.round();
            if pixel.x < 0.0 || pixel.y < 0.0 || pixel.x >= width || pixel.y >= height {
                continue;
            }
            let phase = 0.1 * f64::from((i + 2 * j).rem_euclid(11)) - 0.5;
            let t_s = stamp_s
                + row_mid_s(&camera.shutter, pixel.y, height)
                + phase * 1e-3 * camera.shutter.exposure_ms;
            let look = reference.sample(3, [pixel.x as u32, pixel.y as u32], at_px - pixel, phase).unwrap();
            let hit = look.hit.unwrap();

            let (at, ned_from_camera) = pose(&motion, t_s);
            let ray = ned_from_camera * uv.extend(1.0);
            let expected = at - ray * (at.z / ray.z);
            // The hit seen from the true pose, against where it was looked for.
            let seen = ned_from_camera.transpose() * (hit.point_ned_m - at);
            let ideal_error_px = (DVec2::new(seen.x, seen.y) / seen.z - uv) * DVec2::new(fx, fy);
            worst_px = worst_px.max(ideal_error_px.length()).max((look.uv - uv).length() * fx);
            let metres_a_px = hit.depth_m / fx;
            worst_px = worst_px.max(hit.point_ned_m.distance(expected) / metres_a_px);
            assert!(
                (hit.depth_m + at.z / ray.z).abs() < 1e-9 * hit.depth_m,
                "{name}: depth {} {}",
                hit.depth_m,
                -at.z / ray.z
            );
            assert!((look.t_s - t_s).abs() < 1e-12, "{name}: {} {t_s}", look.t_s);

            // H = R + t n^T / d with (R, t) from the row's camera to the key's and n . x = d the plane in the
            // row's camera.
            let key_from_ned = ned_from_key.transpose();
            let (normal, distance_m) = (ned_from_camera.transpose() * DVec3::Z, -at.z);
            let moved = key_from_ned * (at - key_at);
            let in_key = key_from_ned * ned_from_camera * uv.extend(1.0)
                + moved * (normal.dot(uv.extend(1.0)) / distance_m);
            let source_px = DVec2::new(in_key.x, in_key.y) / in_key.z * ideal.focal_px + ideal.principal_px;
            worst_source_px = worst_source_px.max(key.source_px(&look).distance(source_px));
            looked += 1;
        }
    }
    eprintln!(
        "{name}: {looked} looks, worst {worst_px:.1e} px in the row's own image, {worst_source_px:.1e} px in the key frame"
    );
    assert!(looked > 500, "{name}: {looked}");
    assert!(worst_px < EXACT_PX && worst_source_px < EXACT_PX, "{name}: {worst_px:e} {worst_source_px:e}");
}

fn camera(lens: LensSpec, shutter: ShutterSpec) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.focal_px = [307.6, 309.1];
    scenario.camera.principal_point_px = Some([305.1, 226.2]);
    scenario.camera.lens = lens;
    scenario.camera.shutter = shutter;
    scenario
}

#[test]
fn the_plane_is_seen_by_its_homography() {
    let still = Steady::standing(DVec3::new(12.0, -7.0, -150.0));
    let moving = Steady::moving(150.0);
    check("still, pinhole", &camera(LensSpec::default(), ShutterSpec::default()), still, 0.7);
    check("moving, rolling shutter, pinhole", &camera(LensSpec::default(), rolling(8.0)), moving, 0.7);
    check("moving, rolling shutter, tangential lens", &camera(tangential(), rolling(8.0)), moving, 0.7);
    check("moving, rolling shutter, folding lens", &camera(folding(), rolling(8.0)), moving, 0.9);
    let upwards =
        ShutterSpec { readout: Readout::BottomToTop, interlace_ms: FieldOr::Ms(16.0), ..rolling(3.0) };
    check("moving, upward readout, interlaced", &camera(tangential(), upwards), moving, 0.7);
}

/// Sideways readout has a time for each column, and interlacing one for each row's parity.
#[test]
fn columns_have_their_own_times() {
    for (readout, sign) in [(Readout::LeftToRight, 1.0), (Readout::RightToLeft, -1.0)] {
        let shutter = ShutterSpec { readout, interlace_ms: FieldOr::Field, ..rolling(0.0) };
        let scenario = camera(LensSpec::default(), shutter);
        let reference =
            ReferenceRenderer::new(sequence(scenario, Steady::moving(150.0), plane(9000.0))).unwrap();
        for [x, y] in [[0, 0], [0, 1], [639, 0], [320, 241], [17, 98]] {
            let look = reference.sample(2, [x, y], DVec2::ZERO, 0.0).unwrap();
            let column_s = sign * 0.033 * ((f64::from(x) + 0.5) / 640.0 - 0.5) - 0.004;
            let field_s = if y % 2 == 0 { 0.5 / 30.0 } else { 0.0 };
            assert!((look.t_s - (2.0 / 30.0 + column_s - field_s)).abs() < 1e-14, "{readout:?} {x} {y}");
        }
    }
}

/// The inverse is the forward function's, everywhere on the branch, and nothing beyond the fold is seen.
#[test]
fn the_folding_lens_is_inverted_up_to_its_fold() {
    let scenario = camera(folding(), ShutterSpec::default());
    let k = scenario.camera.lens.coefficients.clone();
    let reference = ReferenceRenderer::new(sequence(
        scenario.clone(),
        Steady::standing(DVec3::new(0.0, 0.0, -100.0)),
        plane(90_000.0),
    ))
    .unwrap();
    let [fx, fy] = scenario.camera.focal_px;
    let [cx, cy] = scenario.camera.principal_point_px.unwrap();
    let to_px = |uv: DVec2| distort(&k, uv) * DVec2::new(fx, fy) + DVec2::new(cx, cy);
    let (mut seen, mut beyond) = (0, 0);
    for spoke in 0..64 {
        let direction = DVec2::from_angle(f64::from(spoke) * std::f64::consts::TAU / 64.0);
        // The fold along this direction: where the image's area element changes its sign.
        let area = |r: f64| {
            let h = 1e-6;
            let d = |e: DVec2| {
                (distort(&k, direction * r + e * h) - distort(&k, direction * r - e * h)) / (2.0 * h)
            };
            d(DVec2::X).perp_dot(d(DVec2::Y))
        };
        let fold = (1..).map(|i| 1e-3 * f64::from(i)).find(|&r| area(r) <= 0.0).unwrap();
        for fraction in [0.3, 0.8, 0.95, 0.99, 0.998] {
            let uv = direction * (fraction * fold);
            let at_px = to_px(uv);
            let pixel = at_px.round();
            if !(pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < 640.0 && pixel.y < 480.0) {
                continue;
            }
            let look = reference.sample(0, [pixel.x as u32, pixel.y as u32], at_px - pixel, 0.0);
            let found = look
                .unwrap_or_else(|| panic!("nothing seen at {fraction} of the fold in direction {spoke}"))
                .uv;
            assert!(found.distance(uv) < 1e-8, "{spoke} {fraction}: {found} {uv}");
            seen += 1;
        }
        // Beyond the farthest image along this direction nothing is seen.
        let far_px = DVec2::new(cx, cy) + (to_px(direction * fold) - DVec2::new(cx, cy)) * 1.03;
        let pixel = far_px.round();
        if pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < 640.0 && pixel.y < 480.0 {
            assert_eq!(
                reference.sample(0, [pixel.x as u32, pixel.y as u32], far_px - pixel, 0.0),
                None,
                "{spoke}"
            );
            beyond += 1;
        }
    }
    assert!(seen > 200 && beyond > 20, "{seen} {beyond}");
}
