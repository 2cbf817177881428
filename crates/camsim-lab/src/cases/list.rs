//! The list of cases.

use camsim_core::scenario::{
    Axis, CameraSpec, FieldOr, LensModel, LensSpec, MountSpec, PhotometricSpec, ShutterSpec, VibrationSpec,
};

use super::{CaseSpec, ConstantTwist, Ground, Group};

/// Focal length at 640x480, pixels: the wide camera of the paper's experiments.
const FOCAL_PX: f64 = 307.6075;
/// Coefficients of the paper's camera by Agisoft.
const S3: [f64; 5] = [-0.390_024, 0.111_124, -0.001_274_4, -0.008_151_7, -0.008_427_63];

/// Level flight to the north-east.
fn flight(height_m: f64, speed_m_s: f64, rate_body_deg_s: [f64; 3]) -> ConstantTwist {
    let (sin, cos) = 20_f64.to_radians().sin_cos();
    ConstantTwist { height_m, velocity_ned_m_s: [speed_m_s * cos, speed_m_s * sin, 0.0], rate_body_deg_s }
}

/// A camera at `pitch_deg` (-90 looks straight down).
fn camera(pitch_deg: f64, readout_ms: f64, exposure_ms: f64) -> CameraSpec {
    CameraSpec {
        size_px: [640, 480],
        focal_px: [FOCAL_PX; 2],
        mount: MountSpec { angles_deg: [0.0, pitch_deg, 0.0], ..MountSpec::default() },
        shutter: ShutterSpec { readout_ms, exposure_ms, ..ShutterSpec::default() },
        ..CameraSpec::default()
    }
}

/// A camera with distortion, looking straight down.
fn lens(model: LensModel, focal_px: f64, principal_point_px: [f64; 2], coefficients: &[f64]) -> CameraSpec {
    CameraSpec {
        focal_px: [focal_px; 2],
        principal_point_px: Some(principal_point_px),
        lens: LensSpec { model, coefficients: coefficients.to_vec() },
        ..camera(-90.0, 33.0, 0.0)
    }
}

/// The camera with a vibration of its mount.
fn with_vibration(mut camera: CameraSpec, axis: Axis, amplitude_deg: f64, hz: f64) -> CameraSpec {
    camera.mount.vibration.push(VibrationSpec { axis, amplitude_deg, amplitude_m: 0.0, hz, phase_deg: 40.0 });
    camera
}

/// All cases, in the order of the tables.
// Long because: a list.
pub(super) fn case_specs() -> Vec<CaseSpec> {
    use Ground::{Hills, Plane, Town, TownOnHills};
    use Group::{AllEffects, Buildings, Exposure, LongWindow, Smooth, Vibration};
    let hills = Hills { width_m: 768.0, relief_m: 12.0 };
    let wide_hills = Hills { width_m: 5000.0, relief_m: 80.0 };
    let nadir = |readout_ms, exposure_ms| camera(-90.0, readout_ms, exposure_ms);
    let no_rotation = [0.0; 3];
    let centre = [319.5, 239.5];
    let mut delayed = nadir(33.0, 0.0);
    delayed.shutter.delay_ms = 1000.0;
    let mut interlaced = nadir(33.0, 0.0);
    interlaced.shutter.interlace_ms = FieldOr::Field;
    let mut all_effects = lens(LensModel::BrownConrady, FOCAL_PX, [305.599, 226.736], &S3);
    all_effects.mount.angles_deg = [0.0, -75.0, 0.0];
    all_effects.shutter.exposure_ms = 8.0;
    all_effects.photometric = PhotometricSpec {
        noise_sigma: 0.01,
        vignette: Some("in-memory".into()),
        ..PhotometricSpec::default()
    };
    let all_effects =
        with_vibration(with_vibration(all_effects, Axis::Pitch, 0.05, 60.0), Axis::Yaw, 0.05, 45.0);
    let brown = |focal_px, principal, coefficients: &[f64]| {
        lens(LensModel::BrownConrady, focal_px, principal, coefficients)
    };
    let lens_case = |name, about, camera| CaseSpec {
        name,
        group: Group::Lens,
        about,
        ground: Plane,
        motion: flight(150.0, 30.0, no_rotation),
        camera,
    };
    let case =
        |name, group, about, ground, motion, camera| CaseSpec { name, group, about, ground, motion, camera };
    vec![
        case(
            "roll-36",
            Smooth,
            "36 deg of roll about the optical axis within a frame",
            Plane,
            flight(150.0, 0.0, [0.0, 0.0, 36.0]),
            nadir(1000.0, 0.0),
        ),
        case(
            "pitch-36",
            Smooth,
            "36 deg of pitch within a frame",
            Plane,
            flight(150.0, 0.0, [0.0, 36.0, 0.0]),
            nadir(1000.0, 0.0),
        ),
        case(
            "plane-30",
            Smooth,
            "30 m/s over a plane, 33 ms readout",
            Plane,
            flight(150.0, 30.0, no_rotation),
            nadir(33.0, 0.0),
        ),
        case(
            "terrain-100",
            Smooth,
            "100 m/s over hills, 33 ms",
            hills,
            flight(150.0, 100.0, no_rotation),
            nadir(33.0, 0.0),
        ),
        case(
            "combined-58",
            Smooth,
            "40 m/s and 58 deg/s over hills, 100 ms",
            hills,
            flight(150.0, 40.0, [30.0, 25.0, 43.0]),
            nadir(100.0, 0.0),
        ),
        case(
            "interlace",
            Smooth,
            "40 m/s, 20 deg/s, fields 16.7 ms apart",
            hills,
            flight(150.0, 40.0, [0.0, 0.0, 20.0]),
            interlaced,
        ),
        case(
            "vibration-100",
            Vibration,
            "100 Hz, 0.2 deg over hills, 33 ms",
            hills,
            flight(150.0, 30.0, no_rotation),
            with_vibration(nadir(33.0, 0.0), Axis::Pitch, 0.2, 100.0),
        ),
        case(
            "vibration-200",
            Vibration,
            "200 Hz, 0.1 deg over houses, 33 ms, exposure 5 ms",
            Town,
            flight(60.0, 15.0, no_rotation),
            with_vibration(nadir(33.0, 5.0), Axis::Roll, 0.1, 200.0),
        ),
        case(
            "buildings-15",
            Buildings,
            "15 m/s, 60 m above houses, straight down, 33 ms",
            Town,
            flight(60.0, 15.0, no_rotation),
            nadir(33.0, 0.0),
        ),
        case(
            "buildings-40",
            Buildings,
            "40 m/s, 35 m above ground, 50 deg down, 33 ms",
            Town,
            flight(35.0, 40.0, no_rotation),
            camera(-50.0, 33.0, 0.0),
        ),
        case(
            "buildings-60",
            Buildings,
            "60 m/s, 35 m above ground, 35 deg down with the skyline, 33 ms",
            Town,
            flight(35.0, 60.0, no_rotation),
            camera(-35.0, 33.0, 0.0),
        ),
        case(
            "delay-1s",
            LongWindow,
            "1 s of delay, 50 m/s over hills",
            hills,
            flight(150.0, 50.0, no_rotation),
            delayed,
        ),
        case(
            "rolling-1s",
            LongWindow,
            "1 s of readout, 100 m/s, 1000 m above hills",
            wide_hills,
            flight(1000.0, 100.0, [3.0, 0.0, 5.0]),
            nadir(1000.0, 0.0),
        ),
        case(
            "rolling-1s-buildings",
            LongWindow,
            "1 s of readout, 15 m/s, 100 m above houses",
            Town,
            flight(100.0, 15.0, no_rotation),
            nadir(1000.0, 0.0),
        ),
        case(
            "exposure-1",
            Exposure,
            "1 ms at 40 m/s and 30 deg/s",
            hills,
            flight(150.0, 40.0, [0.0, 30.0, 0.0]),
            nadir(33.0, 1.0),
        ),
        case(
            "exposure-10",
            Exposure,
            "10 ms at 40 m/s and 30 deg/s",
            hills,
            flight(150.0, 40.0, [0.0, 30.0, 0.0]),
            nadir(33.0, 10.0),
        ),
        case(
            "exposure-100",
            Exposure,
            "100 ms at 40 m/s and 30 deg/s",
            hills,
            flight(150.0, 40.0, [0.0, 30.0, 0.0]),
            nadir(33.0, 100.0),
        ),
        lens_case("lens-none", "no distortion", nadir(33.0, 0.0)),
        lens_case(
            "lens-euroc",
            "EuRoC's cam0",
            brown(458.654, [310.0, 248.375], &[-0.283_408_11, 0.073_959_07, 0.000_193_59, 1.761_871_14e-5]),
        ),
        lens_case(
            "lens-s3",
            "the paper's fisheye (Agisoft's calibration)",
            brown(FOCAL_PX, [305.599, 226.736], &S3),
        ),
        lens_case(
            "lens-gopro-fold",
            "a barrel that folds inside the image",
            brown(300.0, [320.1, 235.1], &[-0.26, 0.03, 0.0006, -0.0004]),
        ),
        lens_case(
            "lens-kannala-brandt",
            "TUM-VI's fisheye coefficients at f = 450 px",
            lens(
                LensModel::KannalaBrandt,
                450.0,
                centre,
                &[0.003_482_389, 0.000_715_035, -0.002_053_236, 0.000_202_937],
            ),
        ),
        lens_case("lens-tangential", "p1 = 0.1, p2 = -0.1", brown(450.0, centre, &[-0.1, 0.01, 0.1, -0.1])),
        case(
            "blender-plane",
            AllEffects,
            "a plane, 33 ms readout, 8 ms exposure",
            Plane,
            flight(150.0, 30.0, [0.0, 0.0, 20.0]),
            nadir(33.0, 8.0),
        ),
        case(
            "all-effects",
            AllEffects,
            "fisheye, vibration, 33 ms, 8 ms, vignette, noise, houses on hills",
            TownOnHills,
            flight(120.0, 40.0, [0.0, 10.0, 15.0]),
            all_effects,
        ),
    ]
}
