//! Twins of a frame: the same frame by a better camera, written beside it (`[[output.twin]]`).
//!
//! A twin is the frame of a scenario of its own ([`Scenario::twin`]), which differs in a few keys of the
//! camera. Where a twin is exposed at another instant than the frame's centre, its `camera.phase` is shifted:
//! its delay stays, and its stamp is its own.

use serde::{Deserialize, Serialize};

use super::{
    Channel, FieldOr, FlowInstant, ImageSensorSpec, LensSpec, PlaneKind, Reset, Scenario, ShutterSpec,
    keys::{Table, Words},
};
use crate::shutter::{Shutter, ShutterError};

/// Largest number of pictures of a burst.
pub const MAX_INSTANTS: u32 = 1000;

/// A better camera, by what is left out of it. Keys that are not given are as in the frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Table)]
#[serde(default, deny_unknown_fields)]
pub struct TwinSpec {
    /// Name of the twin's folder, below that of the frames.
    #[key(required, example = "\"sharp\"")]
    pub name: String,
    /// Whether it has the exposure. `false`: an instant, hence no motion blur. Left out: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure: Option<bool>,
    /// Shutter. `global`: all pixels at one instant.
    #[key(example = "\"global\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shutter: Option<TwinShutter>,
    /// Instant of a global shutter. Left out: mid-exposure of the image's centre.
    #[key(example = "\"centre\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instant: Option<FlowInstant>,
    /// Whether it has the lens. `false`: a pinhole with the same focal length, principal point and size. Left
    /// out: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens: Option<bool>,
    /// Whether it has the noise. Left out: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<bool>,
    /// Whether it has the vignette. Left out: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vignette: Option<bool>,
    /// Neither exposure, rolling shutter, lens, noise, vignette nor point spread.
    #[serde(skip_serializing_if = "is_false")]
    pub ideal: bool,
    /// Pictures in a burst for each frame, each without exposure. Left out: one picture of each frame.
    #[key(
        step = 0.1,
        min = 1,
        max = MAX_INSTANTS,
        hint = "leave it out for one picture of each frame",
        example = "9"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instants: Option<u32>,
    /// What the instants of a burst are spread over. Left out: the exposure.
    #[key(example = "\"exposure\"")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<BurstOver>,
    /// Channels of the twin. Left out: those of the frame.
    #[key(example = "[\"color\"]")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channels: Option<Vec<Channel>>,
    /// Whether it has the point spread and the glare. Left out: as the frame.
    #[key(example = "false")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point_spread: Option<bool>,
}

/// Shutters of a twin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum TwinShutter {
    /// All pixels at one instant: no readout, no interlacing.
    Global,
}

/// What the instants of a burst are spread over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Words)]
#[serde(rename_all = "kebab-case")]
pub enum BurstOver {
    /// The exposure of each row: instant k of N is `((k + 0.5)/N - 0.5) t_e` after the mid-exposure. The mean
    /// of the pictures is the midpoint rule of the blurred frame.
    #[default]
    Exposure,
    /// From the mid-exposure of the first row to that of the last one, both included; each picture has a
    /// global shutter.
    Readout,
}

fn is_false(value: &bool) -> bool {
    !value
}

impl TwinSpec {
    /// Numbers of its pictures of each frame: `None` alone, or 0, 1, ... of a burst.
    pub fn instants(&self) -> impl Iterator<Item = Option<u32>> + use<> {
        let count = self.instants;
        (0..count.unwrap_or(1)).map(move |k| count.map(|_| k))
    }

    /// Whether its pictures are without exposure.
    #[must_use]
    pub fn is_sharp(&self) -> bool {
        self.ideal || self.instants.is_some() || self.exposure == Some(false)
    }

    /// Whether all pixels of a picture have one instant.
    #[must_use]
    pub fn is_global(&self) -> bool {
        self.ideal || self.shutter == Some(TwinShutter::Global) || self.over == Some(BurstOver::Readout)
    }

    /// Whether a flag, such as `lens`, leaves its part out.
    fn leaves_out(&self, flag: Option<bool>) -> bool {
        self.ideal || flag == Some(false)
    }

    /// Whether the twin could differ from the frame.
    pub(super) fn differs(&self) -> bool {
        let flags = [self.exposure, self.lens, self.noise, self.vignette, self.point_spread];
        self.is_sharp() || self.is_global() || flags.contains(&Some(false))
    }

    /// In a few words, for messages.
    #[must_use]
    pub fn describe(&self) -> String {
        let parts = [
            (self.is_global(), "global shutter"),
            (self.is_sharp(), "no exposure"),
            (self.leaves_out(self.lens), "no lens"),
            (self.leaves_out(self.noise), "no noise"),
            (self.leaves_out(self.vignette), "no vignette"),
            (self.leaves_out(self.point_spread), "no point spread"),
        ];
        let words: Vec<&str> = parts.iter().filter(|(has, _)| *has).map(|(_, word)| *word).collect();
        let over = match self.over.unwrap_or_default() {
            BurstOver::Exposure => "exposure",
            BurstOver::Readout => "readout",
        };
        let burst = self.instants.map(|count| format!("{count} instants over the {over}, "));
        burst.unwrap_or_default() + &words.join(", ")
    }

    /// Time from the frame's centre to the twin's, seconds.
    fn shift_s(&self, shutter: &Shutter, instant: Option<u32>) -> f64 {
        let at_s = |at: FlowInstant| shutter.dt_instant_s(at) + shutter.delay_s();
        let centre_s = if self.is_global() { at_s(self.instant.unwrap_or_default()) } else { 0.0 };
        let (Some(k), Some(count)) = (instant, self.instants) else { return centre_s };
        match self.over.unwrap_or_default() {
            BurstOver::Exposure => centre_s + exposure_share(k, count) * shutter.centre_exposure_s(),
            BurstOver::Readout if count == 1 => at_s(FlowInstant::Centre),
            BurstOver::Readout => {
                let [first_s, last_s] = [FlowInstant::FirstRow, FlowInstant::LastRow].map(at_s);
                first_s + (last_s - first_s) * f64::from(k) / f64::from(count - 1)
            }
        }
    }
}

/// Share of the exposure after its middle at which a picture of a burst is taken.
fn exposure_share(k: u32, count: u32) -> f64 {
    (f64::from(k) + 0.5) / f64::from(count) - 0.5
}

/// Makes instants of exposures that begin all at once: the row times are those of a rolling shutter then.
fn without_reset(shutter: &mut ShutterSpec, size_px: [u32; 2], share: f64) {
    if shutter.reset == Reset::Global {
        // From row to row half a line, as far as mid-exposures are apart, and what their exposures differ by.
        shutter.readout_ms = (0.5 + share) * shutter.readout_ms_of(size_px);
        shutter.line_time_us = None;
        shutter.reset = Reset::Rolling;
    }
}

impl Scenario {
    /// The scenario whose frames are a twin's pictures, of number `instant` where the twin is a burst
    /// ([`TwinSpec::instants`]). It has neither twins nor tracks itself.
    ///
    /// The pictures of a burst have a noise of their own each, by the camera's name.
    ///
    /// # Errors
    /// A shutter that cannot be used.
    pub fn twin(&self, twin: &TwinSpec, instant: Option<u32>) -> Result<Self, ShutterError> {
        let mut scenario = self.clone();
        let camera = &mut scenario.camera;
        let shutter = Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)?;
        let shift_s = twin.shift_s(&shutter, instant);
        // The phase of a twin without a shift is the frame's to the last bit.
        if shift_s != 0.0 {
            camera.phase += shift_s * camera.fps;
        }
        if twin.is_sharp() {
            // The sensor still collects light.
            if let Some(sensor) = &mut camera.sensor {
                sensor.exposure_ms.get_or_insert(camera.shutter.exposure_ms);
            }
            if let Some(auto) = &mut camera.auto_exposure {
                auto.nominal_ms.get_or_insert(camera.shutter.exposure_ms);
            }
            camera.shutter.exposure_ms = 0.0;
            let over_exposure =
                twin.instants.filter(|_| twin.over.unwrap_or_default() == BurstOver::Exposure);
            let share = instant.zip(over_exposure).map_or(0.0, |(k, count)| exposure_share(k, count));
            without_reset(&mut camera.shutter, camera.size_px, share);
        }
        if twin.is_global() {
            camera.shutter.readout_ms = 0.0;
            camera.shutter.line_time_us = None;
            camera.shutter.reset = Reset::Rolling;
            camera.shutter.interlace_ms = FieldOr::Ms(0.0);
        }
        if twin.leaves_out(twin.lens) {
            camera.lens = LensSpec::default();
            camera.lens_table = None;
            camera.chromatic = None;
            camera.image_circle = None;
            camera.zoom.iter_mut().for_each(|zoom| zoom.coefficients.clear());
        }
        if twin.leaves_out(twin.noise) {
            camera.photometric.noise_sigma = 0.0;
            camera.sensor = camera.sensor.as_ref().map(ImageSensorSpec::without_noise);
        }
        if twin.leaves_out(twin.vignette) {
            camera.photometric.vignette = None;
            camera.photometric.vignetting = None;
        }
        if twin.leaves_out(twin.point_spread) {
            camera.point_spread = None;
        }
        if let Some(k) = instant.filter(|_| camera.photometric.noise_sigma > 0.0 || camera.sensor.is_some()) {
            camera.name += &format!("/{}/{k}", twin.name);
        }
        scenario.output.twin.clear();
        scenario.output.datasets.clear();
        if let Some(channels) = &twin.channels {
            scenario.output.channels.clone_from(channels);
        }
        scenario.output.tracks = None;
        scenario.output.palette &=
            scenario.output.channels.iter().any(|channel| channel.plane() == Some(PlaneKind::Index));
        Ok(scenario)
    }
}
