//! The image sensor of a resized camera.

use super::{Resizing, problem};
use crate::{
    imaging::with_facts,
    scenario::{ImageSensorSpec, Mosaic, Problem},
};

/// Period of the pattern of `rgbw`, pixels.
const RGBW_PERIOD: u32 = 4;

/// A pattern that begins with other colours at the corner of the part.
pub(super) fn mosaic_problem(change: &Resizing, sensor: Option<&ImageSensorSpec>) -> Option<Problem> {
    let [left, top, ..] = change.part_px;
    let is_shifted = left % RGBW_PERIOD != 0 || top % RGBW_PERIOD != 0;
    (sensor?.mosaic == Mosaic::Rgbw && is_shifted).then(|| {
        problem(
            "crop_px",
            format!(
                "begins at [{left}, {top}], where the pattern of camera.sensor.mosaic = \"rgbw\" does not: choose left and \
                 top that are multiples of {RGBW_PERIOD}"
            ),
        )
    })
}

/// The sensor whose pixels are sums of those that lie in their area.
pub(super) fn resized(change: &Resizing, spec: &ImageSensorSpec) -> ImageSensorSpec {
    let [left, top, ..] = change.part_px;
    let mosaic = shifted(spec.mosaic, left % 2 == 1, top % 2 == 1);
    let pixels = change.pixels();
    if pixels == 1.0 {
        return ImageSensorSpec { mosaic, ..spec.clone() };
    }
    let mut sensor = ImageSensorSpec { mosaic, ..with_facts(spec) };
    let (sum, root) = (pixels, pixels.sqrt());
    // What the pixels of a row share is added up along the row, and independent from row to row.
    let (across, down) = (1.0 / change.scale.x, 1.0 / change.scale.y);
    let of_rows = across * down.sqrt();
    let of_columns = down * across.sqrt();
    let factors = [
        (&mut sensor.white_e, sum),
        (&mut sensor.full_well_e, sum),
        (&mut sensor.gain_e_per_dn, sum),
        (&mut sensor.dark_current_e_s, sum),
        (&mut sensor.read_noise_e, root),
        (&mut sensor.dsnu_e, root),
        (&mut sensor.prnu, 1.0 / root),
        (&mut sensor.pixel_um, root),
    ];
    for (value, factor) in factors {
        *value = value.map(|value| value * factor);
    }
    sensor.row_noise_e *= of_rows;
    sensor.row_offset_e *= of_rows;
    sensor.column_noise_e *= of_columns;
    sensor.column_offset_e *= of_columns;
    // A pixel is hot if one of its own is, and dead if all are.
    let own = pixels.max(1.0);
    sensor.hot_pixels = 1.0 - (1.0 - sensor.hot_pixels).powf(own);
    sensor.dead_pixels = sensor.dead_pixels.powf(own);
    sensor
}

/// The pattern that begins a column farther right, or a row farther down.
fn shifted(mosaic: Mosaic, right: bool, down: bool) -> Mosaic {
    let across = |mosaic| match mosaic {
        Mosaic::Rggb => Mosaic::Grbg,
        Mosaic::Grbg => Mosaic::Rggb,
        Mosaic::Bggr => Mosaic::Gbrg,
        Mosaic::Gbrg => Mosaic::Bggr,
        other => other,
    };
    let below = |mosaic| match mosaic {
        Mosaic::Rggb => Mosaic::Gbrg,
        Mosaic::Gbrg => Mosaic::Rggb,
        Mosaic::Bggr => Mosaic::Grbg,
        Mosaic::Grbg => Mosaic::Bggr,
        other => other,
    };
    let mosaic = if right { across(mosaic) } else { mosaic };
    if down { below(mosaic) } else { mosaic }
}
