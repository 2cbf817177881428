//! A sensor with the exposure of one frame.

use super::{SensorKey, develop::Development, facts::with_facts, flicker::Flicker, settings::Settings};
use crate::{exposure::FrameExposure, scenario::ImageSensorSpec, shutter::Shutter};

/// What of a sensor depends on exposure time and gain.
#[derive(Debug)]
pub(super) struct Exposed {
    pub settings: Settings,
    pub develop: Development,
    pub flicker: Option<Flicker>,
}

impl Exposed {
    /// With the scenario's exposure.
    pub fn new(key: &SensorKey) -> Self {
        Self::of_spec(key, &with_facts(&key.spec), key.exposure_ms * 1e-3)
    }

    /// With that of a frame: as much more light and dark current as it lasts longer, and its gain, which changes
    /// neither electrons nor the full well.
    pub fn of_frame(key: &SensorKey, exposure: &FrameExposure) -> Self {
        let nominal_s = key.exposure_ms * 1e-3;
        let spec = with_facts(&key.spec);
        let [full_well_e, e_per_dn] = Settings::new(&spec, nominal_s).full_well_and_step_e();
        let spec = ImageSensorSpec {
            white_e: spec.white_e.map(|electrons| electrons * exposure.time_s / nominal_s),
            full_well_e: full_well_e.is_finite().then_some(full_well_e),
            gain_e_per_dn: Some(e_per_dn / exposure.gain),
            ..spec
        };
        Self::of_spec(key, &spec, exposure.time_s)
    }

    fn of_spec(key: &SensorKey, spec: &ImageSensorSpec, exposure_s: f64) -> Self {
        let settings = Settings::new(spec, exposure_s);
        // An invalid shutter has no frames.
        let shutter = Shutter::from_spec(&key.shutter, key.fps, key.size_px).ok();
        let lamp = spec.flicker.as_ref().zip(shutter);
        Self {
            develop: Development::new(spec, &settings),
            flicker: lamp.map(|(lamp, shutter)| Flicker::new(lamp, shutter, exposure_s)),
            settings,
        }
    }
}

/// Level of the scene's white with the nominal exposure, and of the full well, which may be infinite: fractions of
/// the range of digital numbers above black.
pub(crate) fn sensor_range(spec: &ImageSensorSpec, nominal_s: f64) -> [f64; 2] {
    let settings = Settings::new(&with_facts(spec), nominal_s);
    let [full_well_e, e_per_dn] = settings.full_well_and_step_e();
    let range_e = e_per_dn * settings.range_dn();
    [settings.main_white_e() / range_e, full_well_e / range_e]
}
