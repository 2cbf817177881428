//! How exact the depth of what is drawn is.

use super::*;

#[test]
fn depth_from_above_is_as_exact_as_the_picture_from_the_side() {
    let mut random = Random(29);
    let terrain = hills(129, 129, 10.0, 70.0);
    // Slopes of these hills are up to 1: along a ray 17 degrees off the vertical an error of height counts up to 1.5 times, 37 degrees off 3 times.
    let straight = (nadir(DVec3::new(20.0, -30.0, -900.0)), 1.5);
    let tilted = (forward(DVec3::new(-320.0, 10.0, -900.0), 70_f64.to_radians()), 3.0);
    for (camera, slant) in [straight, tilted] {
        for max_error_px in [1.0, 0.25, 0.0625] {
            let mesh = detail(&terrain, &camera, max_error_px);
            let drawn: Vec<[DVec3; 3]> = triangles(&terrain, &mesh).into_iter().map(|t| t.map(|place| vertex_m(&terrain, place))).collect();
            let (mut most, mut met) = (0.0_f64, 0);
            for _ in 0..300 {
                let direction = camera.ned_from_camera * DVec3::new(random.within(-0.3, 0.3), random.within(-0.3, 0.3), 1.0);
                let full = terrain.intersect(camera.position_ned_m, direction, 1e6).map(|hit| hit.t);
                let Some((full, seen)) = full.zip(first_met(&drawn, camera.position_ned_m, direction)) else { continue };
                met += 1;
                most = most.max((seen / full - 1.0).abs());
            }
            let allowed = slant * max_error_px / FOCAL_PX;
            eprintln!("{slant} {max_error_px}: {most:.2e} of {allowed:.2e}, {} triangles", mesh.lod.triangles);
            assert!(met > 200 && most < allowed, "{slant} {max_error_px}: {met} {most:.2e}");
            // Not by being drawn in full.
            assert!(max_error_px < 1.0 || (mesh.lod.triangles < 30_000 && most > 0.05 * allowed));
        }
    }
}
