//! Variants of a scenario: stages of the pipeline, and previews.

use camsim_core::imaging::with_facts;
use camsim_core::scenario::{Auto, CameraSpec, LensSpec, Scenario, ShutterSpec, Silhouettes};

use super::messages::Stage;

/// Pixels of a preview, at most: 320 x 240.
const MAX_PREVIEW_PX: f64 = 76_800.0;

/// The scenario without the imperfections that come after `stage`.
pub fn stage_scenario(scenario: &Scenario, stage: Stage) -> Scenario {
    let mut stage_scenario = scenario.clone();
    let camera = &mut stage_scenario.camera;
    if stage < Stage::Photometric {
        camera.photometric.vignette = None;
        camera.photometric.vignetting = None;
        camera.photometric.light = 1.0;
        camera.photometric.noise_sigma = 0.0;
        camera.sensor = None;
        camera.point_spread = None;
    }
    if stage < Stage::Time {
        camera.shutter = ShutterSpec::default();
        camera.mount.vibration.clear();
    }
    if stage < Stage::Lens {
        camera.lens = LensSpec::default();
        camera.chromatic = None;
        camera.image_circle = None;
        camera.zoom.iter_mut().for_each(|entry| entry.coefficients.clear());
    }
    stage_scenario
}

/// Camera pixels per preview pixel, along each side.
pub fn preview_factor([width, height]: [u32; 2]) -> u32 {
    let pixels = f64::from(width) * f64::from(height);
    ((pixels / MAX_PREVIEW_PX).sqrt().ceil() as u32).max(1)
}

/// The scenario of a preview: smaller by [`preview_factor`], with wider tolerances.
pub fn preview_scenario(scenario: &Scenario) -> Scenario {
    let mut preview = scenario.clone();
    shrink(&mut preview.camera, preview_factor(scenario.camera.size_px));
    let quality = &mut preview.quality;
    quality.max_error_px = quality.max_error_px.max(0.25);
    quality.max_error_dn = quality.max_error_dn.max(6.0);
    quality.max_terrain_error_px = quality.max_terrain_error_px.max(1.0);
    quality.silhouettes = Silhouettes::Plain;
    quality.key_frames = Auto::Value(1);
    // Previews are requested one by one, in any order: a group would be planned for a single frame.
    quality.frames_per_ideal = 1;
    preview
}

/// Makes one pixel of each `factor` x `factor`. The field of view grows by less than one of these pixels.
fn shrink(camera: &mut CameraSpec, factor: u32) {
    if factor == 1 {
        return;
    }
    let [width, height] = camera.size_px.map(f64::from);
    let scale = f64::from(factor);
    let centre = [0.5 * (width - 1.0), 0.5 * (height - 1.0)];
    let focal = |focal_px: [f64; 2]| focal_px.map(|f| f / scale);
    // The outer border stays in place: the centre of a small pixel is the centre of the pixels it replaces.
    let scaled = |point_px: [f64; 2]| point_px.map(|c| (c + 0.5) / scale - 0.5);
    let principal = |point_px: Option<[f64; 2]>| Some(scaled(point_px.unwrap_or(centre)));
    camera.size_px = camera.size_px.map(|side| side.div_ceil(factor));
    camera.focal_px = focal(camera.focal_px);
    camera.principal_point_px = principal(camera.principal_point_px);
    for entry in &mut camera.zoom {
        entry.focal_px = focal(entry.focal_px);
        entry.principal_point_px = principal(entry.principal_point_px);
    }
    if let Some(spread) = &mut camera.point_spread {
        for width_px in [&mut spread.sigma_px, &mut spread.defocus_px].into_iter().flatten() {
            *width_px /= scale;
        }
        let sensor_um = camera.sensor.as_ref().and_then(|sensor| with_facts(sensor).pixel_um);
        spread.pixel_um = spread.pixel_um.or(sensor_um).map(|pixel_um| pixel_um * scale);
        spread.kernel_oversampling *= factor;
    }
    for lens in
        camera.chromatic.iter_mut().flat_map(|chromatic| [&mut chromatic.red, &mut chromatic.blue]).flatten()
    {
        lens.focal_px = lens.focal_px.map(focal);
        lens.principal_point_px = lens.principal_point_px.map(scaled);
    }
    if let Some(circle) = &mut camera.image_circle {
        circle.radius_px = circle.radius_px.map(|radius_px| radius_px / scale);
        circle.centre_px = circle.centre_px.map(scaled);
    }
}

#[cfg(test)]
mod tests {
    use camsim_core::{camera::CameraModel, scenario::LensModel};
    use glam::DVec2;

    use super::*;

    fn scenario() -> Scenario {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/demo.toml");
        camsim_io::scenario_file::read_scenario(&path, &[], None).expect("the built-in scenario")
    }

    #[test]
    fn each_stage_has_its_imperfections_only() {
        let scenario = scenario();
        assert_eq!(stage_scenario(&scenario, Stage::Photometric), scenario);
        assert_eq!(stage_scenario(&scenario, Stage::Reference), scenario);
        let time = stage_scenario(&scenario, Stage::Time).camera;
        assert_eq!((time.photometric.vignette, time.photometric.noise_sigma), (None, 0.0));
        assert_eq!((&time.shutter, &time.lens), (&scenario.camera.shutter, &scenario.camera.lens));
        let lens = stage_scenario(&scenario, Stage::Lens).camera;
        assert_eq!((lens.shutter, lens.mount.vibration.len()), (ShutterSpec::default(), 0));
        assert_eq!(lens.lens, scenario.camera.lens);
        let ideal = stage_scenario(&scenario, Stage::Ideal).camera;
        assert_eq!(ideal.lens.model, LensModel::Pinhole);
        assert_eq!(ideal.mount.angles_deg, scenario.camera.mount.angles_deg);
    }

    #[test]
    fn preview_rays_equal_camera_rays() {
        let scenario = scenario();
        let small = preview_scenario(&scenario);
        assert_eq!(small.camera.size_px, [320, 240]);
        let [large, small] =
            [&scenario, &small].map(|s| CameraModel::from_spec(&s.camera).expect("a camera"));
        // The centre of the 2 x 2 camera pixels of preview pixel (x, y) is at 2 x + 0.5.
        for (x, y) in [(0.0, 0.0), (160.0, 120.0), (319.0, 17.0)] {
            let large_uv = large.unproject(DVec2::new(2.0 * x + 0.5, 2.0 * y + 0.5)).expect("a ray");
            let small_uv = small.unproject(DVec2::new(x, y)).expect("a ray");
            assert!(large_uv.distance(small_uv) < 1e-12, "{large_uv} {small_uv}");
        }
    }

    #[test]
    fn small_cameras_are_not_shrunk_and_odd_sizes_round_up() {
        assert_eq!(preview_factor([320, 240]), 1);
        assert_eq!(preview_factor([321, 240]), 2);
        assert_eq!(preview_factor([4000, 3000]), 13);
        let mut camera = CameraSpec { size_px: [641, 480], ..CameraSpec::default() };
        shrink(&mut camera, 3);
        assert_eq!(camera.size_px, [214, 160]);
    }
}
