//! Sensors by name: what public sources state of them.

use crate::scenario::{ImageSensorSpec, PerChannel, SensorModel};

/// A number of a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fact {
    /// Key of `[camera.sensor]`.
    pub key: &'static str,
    /// The number.
    pub value: f64,
    /// Where it stands.
    pub source: &'static str,
}

const fn fact(key: &'static str, value: f64, source: &'static str) -> Fact {
    Fact { key, value, source }
}

/// Manual of a camera with that sensor, "measured according to EMVA 1288": dynamic range and largest SNR.
const MV_2051: &str = "mvBlueFOX3-2051 manual, matrix-vision.com";
const MV_2016: &str = "mvBlueFOX3-2016 manual, assets.balluff.com";
const MV_IMX255: &str = "mvBlueFOX3 manual, page 853, easymanua.ls";
const MV_2024A: &str = "mvBlueFOX3-2024a manual, page 357, easymanua.ls";
const NANO: &str = "Teledyne DALSA Genie Nano M2450 manual, page 42, easymanua.ls";
const HERB: &str = "fhotolab.fherb.de, 7 September 2016 (second hand)";
const MENGINEER: &str = "Point Grey GS3-PGE-50S5M, by mengineer.hatenablog.com, 2 May 2016 (second hand)";

/// The facts of each model. Each number stands in its source, or follows from two of its numbers by the
/// definitions of EMVA 1288: the full well is `10^(SNRmax/10)`, and the read noise
/// `full well / 10^(DR/20) - 1/2`.
const FACTS: [(SensorModel, &[Fact]); 6] = [
    (
        SensorModel::Icx625,
        &[
            fact("quantum_efficiency", 0.57, MENGINEER),
            fact("read_noise_e", 8.28, MENGINEER),
            fact("full_well_e", 5903.0, MENGINEER),
        ],
    ),
    (
        SensorModel::Imx174,
        &[
            fact("pixel_um", 5.86, HERB),
            fact("quantum_efficiency", 0.77, HERB),
            fact("read_noise_e", 6.83, HERB),
            fact("full_well_e", 32_691.0, HERB),
        ],
    ),
    // 45.1 dB, 73 dB.
    (
        SensorModel::Imx249,
        &[
            fact("pixel_um", 5.86, MV_2024A),
            fact("full_well_e", 32_359.0, MV_2024A),
            fact("read_noise_e", 6.74, MV_2024A),
            fact("bits", 12.0, MV_2024A),
        ],
    ),
    // 40.3 dB, 71.2 dB.
    (
        SensorModel::Imx250,
        &[
            fact("pixel_um", 3.45, MV_2051),
            fact("full_well_e", 10_700.0, NANO),
            fact("read_noise_e", 2.45, MV_2051),
            fact("bits", 12.0, MV_2051),
        ],
    ),
    // 40.3 dB, 71.3 dB.
    (
        SensorModel::Imx255,
        &[
            fact("pixel_um", 3.45, MV_IMX255),
            fact("full_well_e", 10_715.0, MV_IMX255),
            fact("read_noise_e", 2.42, MV_IMX255),
            fact("bits", 12.0, MV_IMX255),
        ],
    ),
    // 40.2 dB, 71.4 dB.
    (
        SensorModel::Imx273,
        &[
            fact("pixel_um", 3.45, MV_2016),
            fact("full_well_e", 10_471.0, MV_2016),
            fact("read_noise_e", 2.32, MV_2016),
            fact("bits", 12.0, MV_2016),
        ],
    ),
];

/// The facts of a model. What is not listed no source states: it is 0, or has to be given.
#[must_use]
pub fn facts(model: SensorModel) -> &'static [Fact] {
    FACTS.iter().find(|(of, _)| *of == model).map_or(&[], |(_, facts)| facts)
}

/// The keys of a sensor with the facts of its model where a key is not given.
#[must_use]
pub fn with_facts(spec: &ImageSensorSpec) -> ImageSensorSpec {
    let mut spec = spec.clone();
    for fact in spec.model.map_or(&[][..], facts) {
        match fact.key {
            "pixel_um" => _ = spec.pixel_um.get_or_insert(fact.value),
            "read_noise_e" => _ = spec.read_noise_e.get_or_insert(fact.value),
            "full_well_e" => _ = spec.full_well_e.get_or_insert(fact.value),
            "bits" => _ = spec.bits.get_or_insert(fact.value as u32),
            _ => _ = spec.quantum_efficiency.get_or_insert(PerChannel::One(fact.value)),
        }
    }
    spec
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_fill_what_is_not_given() {
        for &model in SensorModel::ALL {
            let spec = with_facts(&ImageSensorSpec { model: Some(model), ..ImageSensorSpec::default() });
            assert!(spec.full_well_e.is_some() && spec.read_noise_e.is_some(), "{model:?}");
            assert!(facts(model).iter().all(|fact| !fact.source.is_empty() && fact.value > 0.0));
            let given = ImageSensorSpec { full_well_e: Some(1.0), ..spec };
            assert_eq!(with_facts(&given).full_well_e, Some(1.0));
        }
    }

    #[test]
    fn stated_decibels_give_the_electrons() {
        for (model, snr_db, range_db) in [
            (SensorModel::Imx249, 45.1, 73.0),
            (SensorModel::Imx250, 40.3, 71.2),
            (SensorModel::Imx255, 40.3, 71.3),
            (SensorModel::Imx273, 40.2, 71.4),
        ] {
            let spec = with_facts(&ImageSensorSpec { model: Some(model), ..ImageSensorSpec::default() });
            let full_e = 10.0_f64.powf(snr_db / 10.0);
            let noise_e = full_e / 10.0_f64.powf(range_db / 20.0) - 0.5;
            assert!((spec.full_well_e.expect("valid") / full_e - 1.0).abs() < 2e-3, "{model:?}: {full_e}");
            assert!((spec.read_noise_e.expect("valid") - noise_e).abs() < 6e-3, "{model:?}: {noise_e}");
        }
    }
}
