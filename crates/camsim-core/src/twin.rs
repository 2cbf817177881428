//! Twins of a frame: the same frame by a better camera, written beside it (`[[output.twin]]`).
//!
//! A twin is the frame of a scenario of its own ([`scenario_of`]), which differs in a few keys of the
//! camera. Where a twin is exposed at another instant than the frame's centre, its `camera.phase` is shifted:
//! its delay stays, and its stamp is its own.

use crate::{
    scenario::{
        BurstOver, FieldOr, FlowInstant, ImageSensorSpec, LensSpec, PlaneKind, Reset, Scenario, ShutterSpec,
        TwinSpec,
    },
    shutter::{Shutter, ShutterError},
};

/// The scenario whose frames are a twin's pictures, of number `instant` where the twin is a burst
/// ([`TwinSpec::instants`]). It has neither twins nor tracks itself.
///
/// Each picture of a burst has its own noise, seeded by the camera's name.
///
/// # Errors
/// A shutter that cannot be used.
pub fn scenario_of(
    frames: &Scenario,
    twin: &TwinSpec,
    instant: Option<u32>,
) -> Result<Scenario, ShutterError> {
    let mut scenario = frames.clone();
    let camera = &mut scenario.camera;
    let shutter = Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px)?;
    let shift_s = shift_s(twin, &shutter, instant);
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
        let over_exposure = twin.instants.filter(|_| twin.over.unwrap_or_default() == BurstOver::Exposure);
        let fraction = instant.zip(over_exposure).map_or(0.0, |(k, count)| exposure_fraction(k, count));
        without_reset(&mut camera.shutter, camera.size_px, fraction);
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
        scenario.output.channels.iter().any(|channel| channel.kind() == PlaneKind::Index);
    Ok(scenario)
}

/// Time from the frame's centre to the twin's, seconds.
fn shift_s(twin: &TwinSpec, shutter: &Shutter, instant: Option<u32>) -> f64 {
    let at_s = |at: FlowInstant| shutter.dt_instant_s(at) + shutter.delay_s();
    let centre_s = if twin.is_global() { at_s(twin.instant.unwrap_or_default()) } else { 0.0 };
    let (Some(k), Some(count)) = (instant, twin.instants) else { return centre_s };
    match twin.over.unwrap_or_default() {
        BurstOver::Exposure => centre_s + exposure_fraction(k, count) * shutter.centre_exposure_s(),
        BurstOver::Readout if count == 1 => at_s(FlowInstant::Centre),
        BurstOver::Readout => {
            let [first_s, last_s] = [FlowInstant::FirstRow, FlowInstant::LastRow].map(at_s);
            first_s + (last_s - first_s) * f64::from(k) / f64::from(count - 1)
        }
    }
}

/// Fraction of the exposure after its middle at which a picture of a burst is taken.
fn exposure_fraction(k: u32, count: u32) -> f64 {
    (f64::from(k) + 0.5) / f64::from(count) - 0.5
}

/// Turns a global reset, whose exposures begin together, into a rolling shutter with the same mid-exposures.
/// `fraction` is where in the exposure the picture is taken, -0.5 to 0.5.
fn without_reset(shutter: &mut ShutterSpec, size_px: [u32; 2], fraction: f64) {
    if shutter.reset == Reset::Global {
        // From row to row half a line, as far as mid-exposures are apart, and what their exposures differ by.
        shutter.readout_ms = (0.5 + fraction) * shutter.readout_ms_of(size_px);
        shutter.line_time_us = None;
        shutter.reset = Reset::Rolling;
    }
}
