//! Scenarios that show a part of the pipeline, or show it smaller.

use camsim_core::scenario::{Auto, CameraSpec, LensSpec, Scenario, ShutterSpec, Silhouettes};

use super::messages::Stage;

/// Pixels that a preview has at most: 320x240.
const PREVIEW_PX: f64 = 76_800.0;

/// The scenario with no more of the camera's imperfections than `stage` has.
pub fn staged(scenario: &Scenario, stage: Stage) -> Scenario {
    let mut staged = scenario.clone();
    let camera = &mut staged.camera;
    if stage < Stage::Photometric {
        camera.photometric.vignette = None;
        camera.photometric.light = 1.0;
        camera.photometric.noise_sigma = 0.0;
    }
    if stage < Stage::Time {
        camera.shutter = ShutterSpec::default();
        camera.mount.vibration.clear();
    }
    if stage < Stage::Lens {
        camera.lens = LensSpec::default();
        camera.zoom.iter_mut().for_each(|entry| entry.coefficients.clear());
    }
    staged
}

/// How many pixels of the camera one of a preview stands for, along a side.
pub fn preview_factor([width, height]: [u32; 2]) -> u32 {
    let pixels = f64::from(width) * f64::from(height);
    ((pixels / PREVIEW_PX).sqrt().ceil() as u32).max(1)
}

/// The scenario as it is rendered while something moves: smaller by [`preview_factor`], to wider tolerances.
pub fn preview(scenario: &Scenario) -> Scenario {
    let mut preview = scenario.clone();
    shrink(&mut preview.camera, preview_factor(scenario.camera.size_px));
    let quality = &mut preview.quality;
    quality.max_error_px = quality.max_error_px.max(0.25);
    quality.max_error_dn = quality.max_error_dn.max(6.0);
    quality.max_terrain_error_px = quality.max_terrain_error_px.max(1.0);
    quality.silhouettes = Silhouettes::Plain;
    quality.key_frames = Auto::Value(1);
    // Frames are asked for one by one, and not in order: a group would be planned for the one frame of it
    // that is shown.
    quality.frames_per_ideal = 1;
    preview
}

/// Each `factor` x `factor` pixels become one; the field of view stays but for a border of less than one of
/// them.
fn shrink(camera: &mut CameraSpec, factor: u32) {
    if factor == 1 {
        return;
    }
    let [width, height] = camera.size_px.map(f64::from);
    let by = f64::from(factor);
    let centre = [0.5 * (width - 1.0), 0.5 * (height - 1.0)];
    let focal = |focal_px: [f64; 2]| focal_px.map(|f| f / by);
    // Outer borders stay in place: pixel centres of the small picture lie in the middle of those they stand
    // for.
    let principal =
        |point_px: Option<[f64; 2]>| Some(point_px.unwrap_or(centre).map(|c| (c + 0.5) / by - 0.5));
    camera.size_px = camera.size_px.map(|side| side.div_ceil(factor));
    camera.focal_px = focal(camera.focal_px);
    camera.principal_point_px = principal(camera.principal_point_px);
    for entry in &mut camera.zoom {
        entry.focal_px = focal(entry.focal_px);
        entry.principal_point_px = principal(entry.principal_point_px);
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
    fn stages_add_up_to_the_scenario() {
        let scenario = scenario();
        assert_eq!(staged(&scenario, Stage::Photometric), scenario);
        assert_eq!(staged(&scenario, Stage::Oracle), scenario);
        let time = staged(&scenario, Stage::Time).camera;
        assert_eq!((time.photometric.vignette, time.photometric.noise_sigma), (None, 0.0));
        assert_eq!((&time.shutter, &time.lens), (&scenario.camera.shutter, &scenario.camera.lens));
        let lens = staged(&scenario, Stage::Lens).camera;
        assert_eq!((lens.shutter, lens.mount.vibration.len()), (ShutterSpec::default(), 0));
        assert_eq!(lens.lens, scenario.camera.lens);
        let ideal = staged(&scenario, Stage::Ideal).camera;
        assert_eq!(ideal.lens.model, LensModel::Pinhole);
        assert_eq!(ideal.mount.angles_deg, scenario.camera.mount.angles_deg);
    }

    #[test]
    fn a_preview_sees_what_the_camera_sees() {
        let scenario = scenario();
        let small = preview(&scenario);
        assert_eq!(small.camera.size_px, [320, 240]);
        let [large, small] =
            [&scenario, &small].map(|s| CameraModel::from_spec(&s.camera).expect("a camera"));
        // The middle of the 2x2 pixels that the small one's pixel (x, y) stands for is at 2 x + 0.5.
        for (x, y) in [(0.0, 0.0), (160.0, 120.0), (319.0, 17.0)] {
            let of_large = large.unproject(DVec2::new(2.0 * x + 0.5, 2.0 * y + 0.5)).expect("a ray");
            let of_small = small.unproject(DVec2::new(x, y)).expect("a ray");
            assert!(of_large.distance(of_small) < 1e-12, "{of_large} {of_small}");
        }
    }

    #[test]
    fn small_cameras_stay_as_they_are_and_odd_ones_keep_every_pixel() {
        assert_eq!(preview_factor([320, 240]), 1);
        assert_eq!(preview_factor([321, 240]), 2);
        assert_eq!(preview_factor([4000, 3000]), 13);
        let mut camera = CameraSpec { size_px: [641, 480], ..CameraSpec::default() };
        shrink(&mut camera, 3);
        assert_eq!(camera.size_px, [214, 160]);
    }
}
