//! The range of a sensor in electrons and numbers.

use serde::Serialize;

use super::{settings::Settings, with_facts};
use crate::scenario::CameraSpec;

/// The range of a sensor with the exposure of the scenario.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SensorLevels {
    /// Exposure time, milliseconds.
    pub exposure_ms: f64,
    /// Electrons of the scene's white in the green or only channel, or the white one.
    pub white_e: f64,
    /// Electrons at which a pixel is full, or its converter at its largest number if that comes first.
    pub saturation_e: f64,
    /// Electrons per number of the converter.
    pub gain_e_per_dn: f64,
    /// Number of the converter without light.
    pub black_dn: f64,
    /// Number of the converter at the scene's white, were there no end of its range.
    pub white_dn: f64,
    /// Bits of the converter.
    pub adc_bits: u32,
    /// Bits of the raw picture.
    pub bits: u32,
}

/// The range of a camera's sensor, if it has one. The camera is valid.
#[must_use]
pub fn sensor_levels(camera: &CameraSpec) -> Option<SensorLevels> {
    let spec = with_facts(camera.sensor.as_ref()?);
    let exposure_ms = spec.exposure_ms.unwrap_or(camera.nominal_exposure_ms());
    let settings = Settings::new(&spec, 1e-3 * exposure_ms);
    let [full_well_e, gain_e_per_dn] = settings.full_well_and_step_e();
    let white_e = settings.main_white_e();
    Some(SensorLevels {
        exposure_ms,
        white_e,
        saturation_e: full_well_e.min(gain_e_per_dn * settings.range_dn()),
        gain_e_per_dn,
        black_dn: spec.black_dn,
        white_dn: spec.black_dn + white_e / gain_e_per_dn,
        adc_bits: spec.adc_bits.unwrap_or(settings.bits),
        bits: settings.bits,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{ImageSensorSpec, SensorModel};

    #[test]
    fn the_default_gain_spreads_the_full_well_over_the_numbers_above_black() {
        let levels = |sensor| sensor_levels(&CameraSpec { sensor: Some(sensor), ..CameraSpec::default() });
        let sensor = ImageSensorSpec {
            model: Some(SensorModel::Imx250),
            white_e: Some(5350.0),
            black_dn: 95.0,
            exposure_ms: Some(2.0),
            ..ImageSensorSpec::default()
        };
        // Full well 10700 e, 12 bits: 10700 / (4095 - 95) e/DN; white is half of the range.
        let expected = SensorLevels {
            exposure_ms: 2.0,
            white_e: 5350.0,
            saturation_e: 10_700.0,
            gain_e_per_dn: 2.675,
            black_dn: 95.0,
            white_dn: 2095.0,
            adc_bits: 12,
            bits: 12,
        };
        assert_eq!(levels(sensor.clone()), Some(expected));
        // A converter of 1 e/DN ends at 4000 e.
        let fine = ImageSensorSpec { gain_e_per_dn: Some(1.0), ..sensor };
        assert_eq!(levels(fine).map(|levels| levels.saturation_e), Some(4000.0));
        assert_eq!(sensor_levels(&CameraSpec::default()), None);
    }
}
