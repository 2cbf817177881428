//! Warnings of legal values of a camera that are probably mistakes.

use camsim_core::{
    imaging::sensor_levels,
    scenario::{CameraSpec, Reset},
};

use crate::{text::wording::rounded, unlikely_camera};

/// What to do where a size has been changed without the calibration.
const RESIZE_ADVICE: &str = " (to make the pictures of a camera smaller or larger with its calibration, leave \
    camera.size_px as it was calibrated, and set camera.resized.size_px, scale, binning or crop_px)";

/// Warns of values that are probably mistakes, and of keys that have no effect or clip the picture.
pub(super) fn unlikely_values(camera: &CameraSpec) -> Vec<String> {
    let doubts = unlikely_camera::doubts(camera).into_iter().map(|doubt| {
        let advice = if doubt.key() == "principal_point_px" { RESIZE_ADVICE } else { "" };
        format!("camera.{doubt}{advice}")
    });
    doubts
        .chain(noise_warning(camera))
        .chain(full_well_warning(camera))
        .chain(reset_warning(camera))
        .chain(part_warning(camera))
        .collect()
}

/// Noise of more than the range from black to white, as where 8-bit values were meant.
fn noise_warning(camera: &CameraSpec) -> Option<String> {
    let sigma = camera.photometric.noise_sigma;
    (sigma > 1.0).then(|| {
        format!(
            "camera.photometric.noise_sigma = {sigma} is {sigma} times white, of which little is left: white is 1; divide \
             8-bit values by 255, which makes {:.4}",
            sigma / 255.0
        )
    })
}

/// White of more electrons than a pixel holds. An automatic exposure chooses another.
fn full_well_warning(camera: &CameraSpec) -> Option<String> {
    if camera.auto_exposure.is_some() {
        return None;
    }
    let levels = sensor_levels(camera)?;
    (levels.white_e > 1.001 * levels.saturation_e).then(|| {
        format!(
            "camera.sensor: the scene's white is {:.0} electrons, and a pixel counts up to {:.0}: everything above \
             {:.3} of white is clipped; lower white_e, white_lux, white_w_m2 or the exposure if that is not meant",
            levels.white_e,
            levels.saturation_e,
            levels.saturation_e / levels.white_e
        )
    })
}

/// A reset of all rows at once differs from a rolling one by the readout.
fn reset_warning(camera: &CameraSpec) -> Option<String> {
    (camera.shutter.reset == Reset::Global && camera.readout_ms() == 0.0).then(|| {
        "camera.shutter.reset = \"global\" has no effect without a readout: give camera.shutter.readout_ms or \
         line_time_us, or leave it out"
            .to_owned()
    })
}

/// Rows of a part beside the centre have other times than in the whole picture.
fn part_warning(camera: &CameraSpec) -> Option<String> {
    let later_ms = camera.made_of.rows_later_ms;
    let delay_ms = camera.shutter.delay_ms;
    // Less than half a row comes from rows that are left over when others are added up.
    let [width, height] = camera.size_px.map(f64::from);
    (later_ms.abs() > 0.51 * camera.readout_ms() / width.min(height)).then(|| {
        let kept_ms = delay_ms + later_ms;
        let to_keep = if kept_ms >= 0.0 {
            format!("camera.shutter.delay_ms = {} keeps their times", rounded(kept_ms))
        } else {
            format!(
                "their times need a delay of {} ms, and it is never below 0: render the whole picture and cut it",
                rounded(kept_ms)
            )
        };
        format!(
            "camera.resized: the part is not about the centre, and camera.shutter.delay_ms = {delay_ms} is that of the \
             part's own centre, so that its rows are exposed {} ms {} than the same rows of the whole picture; if it is cut \
             from whole pictures, {to_keep}",
            rounded(later_ms.abs()),
            if later_ms > 0.0 { "later" } else { "earlier" }
        )
    })
}

#[cfg(test)]
mod tests {
    use camsim_core::scenario::{
        AutoExposureSpec, ImageSensorSpec, MadeOf, ResizedSpec, SensorModel, ShutterSpec,
    };

    use super::*;
    use camsim_core::resized::delivered;

    #[test]
    fn noise_of_8_bit_values_is_said() {
        let camera = |noise_sigma| {
            let mut camera = CameraSpec::default();
            camera.photometric.noise_sigma = noise_sigma;
            camera
        };
        let text = noise_warning(&camera(30.0)).unwrap_or_default();
        assert!(text.contains("noise_sigma = 30") && text.contains("makes 0.1176"), "{text}");
        assert_eq!(noise_warning(&camera(1.0)), None);
    }

    #[test]
    fn a_size_that_the_principal_point_is_not_of_is_named_with_the_key_that_resizes() {
        let camera =
            |size_px, principal_point_px| CameraSpec { size_px, principal_point_px, ..CameraSpec::default() };
        let text = |camera| unlikely_values(&camera).concat();
        let demo = Some([318.3, 241.2]);
        for (size_px, wanted) in [
            (
                [320, 240],
                "camera.principal_point_px = [318.3, 241.2] would be the centre of a picture of about 638 x 483, \
                 not of 320 x 240",
            ),
            ([1280, 960], "not of 1280 x 960"),
            ([160, 120], "not of 160 x 120"),
        ] {
            let text = text(camera(size_px, demo));
            assert!(text.contains(wanted) && text.contains("set camera.resized.size_px"), "{text}");
        }
        assert_eq!(text(camera([640, 480], demo)), "");
        assert_eq!(text(camera([320, 240], None)), "");
        assert_eq!(
            text(CameraSpec {
                made_of: MadeOf { is_part: true, ..MadeOf::default() },
                ..camera([320, 240], demo)
            }),
            ""
        );
    }

    #[test]
    fn rows_of_a_part_that_are_exposed_at_another_time_are_told() {
        let text = |crop_px, delay_ms| {
            let shutter = ShutterSpec { readout_ms: 20.0, delay_ms, ..ShutterSpec::default() };
            let resized = ResizedSpec { crop_px: Some(crop_px), ..ResizedSpec::default() };
            let camera =
                CameraSpec { shutter, resized: Some(resized), size_px: [160, 120], ..CameraSpec::default() };
            part_warning(&delivered(&camera).expect("the part is within the picture")).unwrap_or_default()
        };
        // 30 rows of 20 / 120 ms.
        let above = text([0, 0, 160, 60], 1.0);
        assert!(above.contains("exposed 5 ms later") && above.contains("delay_ms = 6 keeps"), "{above}");
        let below = text([0, 60, 160, 60], 1.0);
        assert!(below.contains("exposed 5 ms earlier") && below.contains("a delay of -4 ms"), "{below}");
        assert_eq!(text([0, 30, 80, 60], 1.0), "");
    }

    #[test]
    fn white_beyond_the_full_well_is_said() {
        let sensor = |white_e| {
            let model = Some(SensorModel::Imx250);
            let sensor = ImageSensorSpec { white_e: Some(white_e), model, ..ImageSensorSpec::default() };
            CameraSpec { sensor: Some(sensor), ..CameraSpec::default() }
        };
        let text = full_well_warning(&sensor(1e5)).unwrap_or_default();
        assert!(
            text.contains("100000 electrons") && text.contains("up to 10700: everything above 0.107"),
            "{text}"
        );
        assert_eq!(full_well_warning(&sensor(10_700.0)), None);
        let auto_exposure = Some(AutoExposureSpec::default());
        assert_eq!(full_well_warning(&CameraSpec { auto_exposure, ..sensor(1e5) }), None);
    }

    #[test]
    fn a_global_reset_needs_a_readout() {
        let shutter = ShutterSpec { reset: Reset::Global, exposure_ms: 2.0, ..ShutterSpec::default() };
        let camera = CameraSpec { shutter: shutter.clone(), ..CameraSpec::default() };
        assert!(reset_warning(&camera).is_some());
        let shutter = ShutterSpec { readout_ms: 10.0, ..shutter };
        assert_eq!(reset_warning(&CameraSpec { shutter, ..CameraSpec::default() }), None);
    }
}
