//! Warnings of legal values of a camera that are probably mistakes.

use std::f64::consts::TAU;

use camsim_core::{
    imaging::sensor_levels,
    scenario::{CameraSpec, LensModel, Reset},
};

use crate::camera_file::principal_point_note;

/// Degrees across within which the field of view of a flat lens is usual.
const USUAL_FIELD_DEG: std::ops::RangeInclusive<f64> = 0.1..=150.0;
/// A turn and some pixels of rounding.
const MOST_TURNS: f64 = 1.05;

/// Warns of a unit that is probably wrong, and of keys that have no effect or clip the picture.
pub(super) fn unlikely_values(camera: &CameraSpec) -> Vec<String> {
    let warnings = [
        field_warning(camera),
        principal_point_warning(camera),
        full_well_warning(camera),
        reset_warning(camera),
    ];
    warnings.into_iter().flatten().collect()
}

/// A size that has been changed without the calibration. A part of a picture may have its axis anywhere.
fn principal_point_warning(camera: &CameraSpec) -> Option<String> {
    if camera.is_part || !camera.zoom.is_empty() {
        return None;
    }
    let at = camera.principal_point_px?;
    let note = principal_point_note(camera.size_px.map(f64::from), at)?;
    Some(format!(
        "camera.principal_point_px: {note}. To make the pictures of a camera smaller or larger with its calibration, \
         leave camera.size_px as it was calibrated, and set camera.resized.size_px, scale, binning or crop_px"
    ))
}

/// A focal length that was given in millimetres, or in pixels of another size.
fn field_warning(camera: &CameraSpec) -> Option<String> {
    if !camera.zoom.is_empty() {
        return None;
    }
    let (width, focal_px) = (f64::from(camera.size_px[0]), camera.focal_px[0]);
    let across_rad = match camera.lens.model {
        LensModel::Pinhole | LensModel::BrownConrady | LensModel::BrownConradyPrism => {
            2.0 * (0.5 * width / focal_px).atan()
        }
        _ => width / focal_px,
    };
    let across_deg = across_rad.to_degrees();
    let is_usual = match camera.lens.model {
        LensModel::Pinhole | LensModel::BrownConrady | LensModel::BrownConradyPrism => {
            USUAL_FIELD_DEG.contains(&across_deg)
        }
        LensModel::Equirectangular => {
            across_deg >= *USUAL_FIELD_DEG.start() && across_rad <= MOST_TURNS * TAU
        }
        _ => across_deg >= *USUAL_FIELD_DEG.start(),
    };
    let remedy = match camera.lens.model {
        LensModel::Equirectangular => "the width of a whole turn is 2 pi focal_px",
        _ => "focal_px is in pixels, f_mm / pixel_um * 1000",
    };
    (!is_usual).then(|| {
        format!(
            "camera.focal_px = [{}, {}] makes a field of view of {} degrees across {width} pixels: {remedy}",
            camera.focal_px[0],
            camera.focal_px[1],
            // Three digits.
            if across_deg < 1.0 { format!("{across_deg:.2e}") } else { format!("{across_deg:.0}") }
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

#[cfg(test)]
mod tests {
    use camsim_core::scenario::{AutoExposureSpec, ImageSensorSpec, LensSpec, SensorModel, ShutterSpec};

    use super::*;

    fn lens(model: LensModel, focal_px: f64) -> CameraSpec {
        let lens = LensSpec { model, coefficients: Vec::new() };
        CameraSpec { lens, focal_px: [focal_px; 2], ..CameraSpec::default() }
    }

    #[test]
    fn a_focal_length_of_another_unit_is_named_with_its_field() {
        let field = |model, focal_px| field_warning(&lens(model, focal_px)).unwrap_or_default();
        // 2 atan(320 / 3.6) and 2 atan(320 / 1e6).
        let wide = field(LensModel::Pinhole, 3.6);
        assert!(wide.contains("focal_px = [3.6, 3.6]") && wide.contains("179 degrees across 640"), "{wide}");
        assert!(wide.contains("focal_px is in pixels"), "{wide}");
        let narrow = field(LensModel::BrownConrady, 1e6);
        assert!(narrow.contains("3.67e-2 degrees"), "{narrow}");
        assert!(field(LensModel::Pinhole, 0.0028).contains("180 degrees"));
        // 640 / 5 radians.
        let turned = field(LensModel::Equirectangular, 5.0);
        assert!(turned.contains("7334 degrees") && turned.contains("2 pi"), "{turned}");
        for (model, focal_px) in [
            (LensModel::Pinhole, 500.0),
            (LensModel::Pinhole, 90.0),
            (LensModel::BrownConrady, 1e5),
            (LensModel::KannalaBrandt, 100.0),
            (LensModel::Equirectangular, 640.0 / TAU),
        ] {
            assert_eq!(field(model, focal_px), "", "{model:?} {focal_px}");
        }
    }

    #[test]
    fn a_size_that_the_principal_point_is_not_of_is_named_with_the_key_that_resizes() {
        let camera =
            |size_px, principal_point_px| CameraSpec { size_px, principal_point_px, ..CameraSpec::default() };
        let demo = Some([318.3, 241.2]);
        for (size_px, wanted) in [
            (
                [320, 240],
                "camera.principal_point_px: the principal point (318.3, 241.2) would be the centre of a picture of \
                          about 638 x 483, not of 320 x 240",
            ),
            ([1280, 960], "not of 1280 x 960"),
            ([160, 120], "not of 160 x 120"),
        ] {
            let text = principal_point_warning(&camera(size_px, demo)).unwrap_or_default();
            assert!(text.contains(wanted) && text.contains("set camera.resized.size_px"), "{text}");
        }
        assert_eq!(principal_point_warning(&camera([640, 480], demo)), None);
        assert_eq!(principal_point_warning(&camera([320, 240], None)), None);
        let part = CameraSpec { is_part: true, ..camera([320, 240], demo) };
        assert_eq!(principal_point_warning(&part), None);
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
