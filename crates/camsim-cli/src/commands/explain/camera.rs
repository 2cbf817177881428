//! The camera: its field of view and its image sensor.

use camsim_core::{
    camera::CameraModel,
    imaging::{SensorLevels, sensor_levels},
    scenario::CameraSpec,
};
use serde::Serialize;

use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// The camera in the report.
#[derive(Serialize)]
pub(super) struct CameraFacts<'a> {
    name: &'a str,
    size_px: [u32; 2],
    lens: &'static str,
    focal_px: [f64; 2],
    /// Across, down and diagonal.
    field_deg: [f64; 3],
    /// With the exposure of the scenario.
    #[serde(skip_serializing_if = "Option::is_none")]
    sensor: Option<SensorLevels>,
}

/// The facts of a camera, at one zoom value if it has several.
pub(super) fn facts(spec: &CameraSpec, zoom: Option<f64>) -> Result<CameraFacts<'_>, Failure> {
    let model = match zoom {
        Some(zoom) => CameraModel::at_zoom(spec, zoom),
        None => CameraModel::from_spec(spec),
    };
    let model = model.or_bad_input()?;
    Ok(CameraFacts {
        name: &spec.name,
        size_px: model.size_px,
        lens: spec.lens.model.name(),
        focal_px: model.focal_px.to_array(),
        field_deg: model.field_deg(),
        sensor: sensor_levels(spec),
    })
}

/// Prints them.
pub(super) fn print(camera: &CameraFacts<'_>, console: &mut Console<'_>) -> Result<(), Failure> {
    let CameraFacts { name, lens, size_px: [width, height], focal_px: [fx, fy], .. } = camera;
    let [across, down, diagonal] = camera.field_deg;
    console.line(format_args!("camera {name}"))?;
    console.line(format_args!(
        "  {width}x{height} px, {lens}, focal length {fx:.3}, {fy:.3} px; field of view {across:.2} degrees across, \
         {down:.2} down, {diagonal:.2} diagonal"
    ))?;
    let Some(sensor) = camera.sensor else { return Ok(()) };
    let SensorLevels { white_e, saturation_e, gain_e_per_dn, black_dn, white_dn, .. } = sensor;
    let SensorLevels { exposure_ms, adc_bits, bits, .. } = sensor;
    let companded = if adc_bits == bits { String::new() } else { format!(" of a converter of {adc_bits}") };
    console.line(format_args!(
        "  sensor: white {white_e:.1} electrons of at most {saturation_e:.1}, gain {gain_e_per_dn:.4} e-/DN, black \
         {black_dn} DN, white {white_dn:.1} DN, exposed for {exposure_ms} ms, {bits} bits{companded}"
    ))?;
    Ok(())
}
