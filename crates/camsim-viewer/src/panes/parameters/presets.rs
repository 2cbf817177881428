//! Camera presets.

use camsim_core::scenario::{CameraSpec, LensModel, LensSpec, ShutterSpec};
use eframe::egui::{self, Role, Ui};

use super::super::{tooltips::WithTooltip, widgets::named};
use crate::message::{Message, Outbox};

/// A published calibration.
struct Preset {
    name: &'static str,
    source: &'static str,
    size_px: [u32; 2],
    focal_px: [f64; 2],
    principal_point_px: [f64; 2],
    model: LensModel,
    coefficients: &'static [f64],
    readout_ms: f64,
    exposure_ms: f64,
}

const PRESETS: &[Preset] = &[
    Preset {
        name: "pinhole 640x480",
        source: "no distortion, instant global shutter",
        size_px: [640, 480],
        focal_px: [500.0, 500.0],
        principal_point_px: [319.5, 239.5],
        model: LensModel::Pinhole,
        coefficients: &[],
        readout_ms: 0.0,
        exposure_ms: 0.0,
    },
    Preset {
        name: "small action camera",
        source: "the camera of the built-in flight: invented, with realistic values",
        size_px: [640, 480],
        focal_px: [420.0, 421.0],
        principal_point_px: [318.3, 241.2],
        model: LensModel::BrownConrady,
        coefficients: &[-0.22, 0.06, 0.0006, -0.0004, -0.006],
        readout_ms: 33.0,
        exposure_ms: 8.0,
    },
    Preset {
        name: "Galaxy S3 with clip-on fisheye",
        source: "the paper's camera: 640x480 video, readout 33 ms, exposure 68.75 us",
        size_px: [640, 480],
        focal_px: [307.6075, 307.6075],
        principal_point_px: [305.099, 226.236],
        model: LensModel::BrownConrady,
        coefficients: &[-0.390024, 0.111124, -0.0012744, -0.0081517, -0.00842763],
        readout_ms: 33.0,
        exposure_ms: 0.06875,
    },
    Preset {
        name: "EuRoC MAV cam0",
        source: "MT9V034 with a global shutter, by the calibration of the data set",
        size_px: [752, 480],
        focal_px: [458.654, 457.296],
        principal_point_px: [367.215, 248.375],
        model: LensModel::BrownConrady,
        coefficients: &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05],
        readout_ms: 0.0,
        exposure_ms: 5.0,
    },
];

impl Preset {
    fn camera(&self) -> CameraSpec {
        CameraSpec {
            size_px: self.size_px,
            focal_px: self.focal_px,
            principal_point_px: Some(self.principal_point_px),
            lens: LensSpec { model: self.model, coefficients: self.coefficients.to_vec() },
            shutter: ShutterSpec {
                readout_ms: self.readout_ms,
                exposure_ms: self.exposure_ms,
                ..ShutterSpec::default()
            },
            ..CameraSpec::default()
        }
    }
}

/// Draws the choice of a preset, which keeps mount, frame rate and phase.
pub fn show(ui: &mut Ui, out: &mut Outbox) {
    let combo =
        egui::ComboBox::from_id_salt("camera preset").selected_text("camera preset").show_ui(ui, |ui| {
            for preset in PRESETS {
                if ui.selectable_label(false, preset.name).with_tooltip(preset.source).clicked() {
                    out.push(Message::Camera(Box::new(preset.camera())));
                }
            }
        });
    named(&combo.response, Role::ComboBox, "camera preset");
    combo.response.with_tooltip(
        "calibration files (OpenCV, Kalibr, EuRoC, ROS, Agisoft, Gyroflow, CAMERA.toml) can be \
         dropped on the window",
    );
}

#[cfg(test)]
mod tests {
    use camsim_core::{camera::CameraModel, validate::validate_camera};

    use super::*;

    #[test]
    fn every_preset_is_legal() {
        for preset in PRESETS {
            let camera = preset.camera();
            assert!(validate_camera(&camera).is_empty(), "{}", preset.name);
            CameraModel::from_spec(&camera).expect(preset.name);
        }
    }
}
