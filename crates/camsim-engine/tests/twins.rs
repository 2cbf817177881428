//! Twins of a frame: against scenarios with the same keys, against each other, and against truth channels.

mod common;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    frame::RenderedFrame,
    photometric::GrayImage,
    scenario::{
        BurstOver, Channel, FieldOr, FlowInstant, FlowState, LensModel, LensSpec, ShutterSpec, TwinShutter,
        TwinSpec,
    },
    sequence::Sequence,
};
use camsim_engine::Engine;
use common::{pattern, render_exact, scenario, sequence, steady};
use glam::DVec3;

const SIZE_PX: [u32; 2] = [96, 72];
const FRAME: u64 = 2;

/// A camera with every imperfection over a flat pattern.
fn flight(rates: [DVec3; 2]) -> Sequence {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [80.0, 80.0];
    scenario.camera.mount.angles_deg = [0.0, -80.0, 0.0];
    scenario.camera.lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.1, 0.02] };
    scenario.camera.shutter = ShutterSpec {
        delay_ms: 3.0,
        readout_ms: 20.0,
        exposure_ms: 8.0,
        interlace_ms: FieldOr::Ms(0.0),
        ..ShutterSpec::default()
    };
    let [velocity, rate] = rates;
    Sequence::clone(&sequence(scenario, steady(120.0, 0.0, velocity, rate), pattern(900.0)))
}

fn moving() -> Sequence {
    flight([DVec3::new(20.0, 9.0, -1.0), DVec3::new(0.3, -0.2, 0.4)])
}

fn noisy() -> Sequence {
    let mut sequence = moving();
    sequence.scenario.camera.photometric.noise_sigma = 0.02;
    sequence.scenario.camera.photometric.vignette = Some("vignette.png".into());
    sequence.vignette = Some(Arc::new(GrayImage { size_px: [2, 1], values: vec![0.3, 1.0] }));
    sequence
}

fn spec(name: &str) -> TwinSpec {
    TwinSpec { name: name.into(), ..TwinSpec::default() }
}

/// A frame of a twin, by a session that rendered the frame itself before.
fn twin(sequence: &Sequence, twin: &TwinSpec, instant: Option<u32>, channels: &[Channel]) -> RenderedFrame {
    let engine = Engine::cpu();
    let mut session = engine.session::<Infallible>(Arc::new(sequence.clone()), channels).expect("session");
    let mut last = RenderedFrame::default();
    for renews in [false, true] {
        if renews {
            let derived = Arc::new(sequence.twin(twin, instant).expect("a usable shutter"));
            session.renew::<Infallible>(derived, channels).expect("renewed");
        }
        let mut keep = |finished: camsim_engine::Finished| {
            last = finished.frame;
            Ok(())
        };
        session.render::<Infallible>([FRAME], &mut keep).expect("render");
    }
    last
}

fn frame(sequence: &Sequence, channels: &[Channel]) -> RenderedFrame {
    render_exact(&Engine::cpu(), &Arc::new(sequence.clone()), channels, FRAME).frame
}

#[test]
fn a_twin_is_the_frame_of_a_scenario_with_its_keys() {
    const CHANNELS: [Channel; 3] = [Channel::Color, Channel::Depth, Channel::Coords];
    type Edit = fn(&mut Sequence);
    let cases: [(TwinSpec, Edit); 6] = [
        (TwinSpec { exposure: Some(false), ..spec("sharp") }, |s| {
            s.scenario.camera.shutter.exposure_ms = 0.0
        }),
        (TwinSpec { shutter: Some(TwinShutter::Global), ..spec("global") }, |s| {
            s.scenario.camera.shutter.readout_ms = 0.0;
        }),
        (TwinSpec { lens: Some(false), ..spec("pinhole") }, |s| {
            s.scenario.camera.lens = LensSpec::default();
        }),
        (TwinSpec { noise: Some(false), ..spec("clean") }, |s| {
            s.scenario.camera.photometric.noise_sigma = 0.0;
        }),
        (TwinSpec { vignette: Some(false), ..spec("even") }, |s| s.vignette = None),
        (TwinSpec { ideal: true, ..spec("ideal") }, |s| {
            s.scenario.camera.lens = LensSpec::default();
            s.scenario.camera.photometric.noise_sigma = 0.0;
            (s.scenario.camera.shutter.readout_ms, s.scenario.camera.shutter.exposure_ms) = (0.0, 0.0);
            s.vignette = None;
        }),
    ];
    let base = noisy();
    let own = frame(&base, &CHANNELS);
    for (spec, edit) in cases {
        let mut alone = base.clone();
        edit(&mut alone);
        let (twin, alone) = (twin(&base, &spec, None, &CHANNELS), frame(&alone, &CHANNELS));
        assert_eq!(twin.color_rgba(), alone.color_rgba(), "{}", spec.name);
        assert_eq!((twin.depth_m(), twin.coords()), (alone.depth_m(), alone.coords()), "{}", spec.name);
        assert_eq!((&twin.rows, twin.stamp_ns), (&alone.rows, own.stamp_ns), "{}", spec.name);
        assert_ne!(twin.color_rgba(), own.color_rgba(), "{}", spec.name);
    }
}

#[test]
fn a_still_camera_has_global_twins_equal_to_its_frame() {
    let mut still = flight([DVec3::ZERO, DVec3::ZERO]);
    still.scenario.camera.photometric.noise_sigma = 0.02;
    let own = frame(&still, &[Channel::Color]);
    for instant in [FlowInstant::FirstRow, FlowInstant::Centre, FlowInstant::LastRow] {
        let spec = TwinSpec { shutter: Some(TwinShutter::Global), instant: Some(instant), ..spec("global") };
        let twin = twin(&still, &spec, None, &[Channel::Color]);
        // Plans of cameras with and without a readout may differ by rounding of the poses.
        let worst =
            own.color_rgba().iter().zip(twin.color_rgba()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-5, "{instant:?}: {worst}");
    }
}

/// Instants of the outer rows in closed form: `-delay + ((row + 0.5)/N - 0.5) t_r` after the stamp.
#[test]
fn pictures_are_exposed_at_their_instants() {
    let base = moving();
    let shutter = &base.scenario.camera.shutter;
    let rows = f64::from(SIZE_PX[1]);
    let [delay_s, readout_s, exposure_s] =
        [shutter.delay_ms, shutter.readout_ms, shutter.exposure_ms].map(|ms| 1e-3 * ms);
    let stamp_s = frame(&base, &[Channel::Rows]).stamp_ns as f64 * 1e-9;
    let outer_s = readout_s * (0.5 - 0.5 / rows);
    let global =
        |instant| TwinSpec { shutter: Some(TwinShutter::Global), instant: Some(instant), ..spec("global") };
    let burst = |over| TwinSpec { instants: Some(5), over: Some(over), ..spec("burst") };
    let cases = [
        (global(FlowInstant::FirstRow), None, -outer_s),
        (global(FlowInstant::Centre), None, 0.0),
        (global(FlowInstant::LastRow), None, outer_s),
        (burst(BurstOver::Readout), Some(0), -outer_s),
        (burst(BurstOver::Readout), Some(1), -0.5 * outer_s),
        (burst(BurstOver::Readout), Some(4), outer_s),
        (burst(BurstOver::Exposure), Some(0), -0.4 * exposure_s),
        (burst(BurstOver::Exposure), Some(2), 0.0),
        (burst(BurstOver::Exposure), Some(3), 0.2 * exposure_s),
    ];
    for (spec, instant, after_centre_s) in cases {
        let twin = twin(&base, &spec, instant, &[Channel::Color, Channel::Rows]);
        let middle = twin.rows.len() / 2;
        let centre_ns = 0.5 * (twin.rows[middle - 1].t_mid_ns + twin.rows[middle].t_mid_ns) as f64;
        let wanted_s = stamp_s - delay_s + after_centre_s;
        assert!((centre_ns * 1e-9 - wanted_s).abs() < 2e-9, "{} {instant:?}", spec.name);
        assert!((twin.stamp_ns as f64 * 1e-9 - wanted_s - delay_s).abs() < 2e-9, "{} {instant:?}", spec.name);
        let is_global = twin.rows.first().map(|row| row.t_mid_ns) == twin.rows.last().map(|row| row.t_mid_ns);
        assert_eq!(is_global, spec.is_global());
    }
}

/// PSNR of the mean of pictures against another, dB, over valid pixels.
fn psnr_db(pictures: &[RenderedFrame], blurred: &RenderedFrame) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (i, wanted) in blurred.color_rgba().iter().enumerate().filter(|(i, _)| i % 4 != 3) {
        let alpha = i - i % 4 + 3;
        if pictures.iter().chain([blurred]).all(|picture| picture.color_rgba()[alpha] > 0.0) {
            let mean = pictures.iter().map(|picture| f64::from(picture.color_rgba()[i])).sum::<f64>()
                / pictures.len() as f64;
            sum += (mean - f64::from(*wanted)).powi(2);
            count += 1.0;
        }
    }
    assert!(count > 0.8 * 3.0 * f64::from(SIZE_PX[0] * SIZE_PX[1]), "most pixels are valid");
    -10.0 * (sum / count).log10()
}

/// The mean of the pictures of a burst is the midpoint rule of the blur. What remains are the errors of both
/// renderings, each of which `quality.max_error_dn` bounds: 1/255 is 48 dB.
#[test]
fn the_mean_of_a_burst_is_the_blurred_frame() {
    // Paths of about five pixels over a pattern of 15 px.
    let mut base = flight([DVec3::new(60.0, 20.0, -1.0), DVec3::new(1.2, -0.8, 1.0)]);
    base.scene = Arc::new(pattern(250.0));
    base.scenario.camera.shutter.exposure_ms = 30.0;
    let blurred = frame(&base, &[Channel::Color]);
    let mean_of = |count: u32| {
        let burst = TwinSpec { instants: Some(count), ..spec("burst") };
        let pictures: Vec<RenderedFrame> =
            burst.instants().map(|k| twin(&base, &burst, k, &[Channel::Color])).collect();
        psnr_db(&pictures, &blurred)
    };
    let [one, three, nine] = [1, 3, 9].map(mean_of);
    eprintln!("mean of 1, 3, 9 pictures: {one:.1}, {three:.1}, {nine:.1} dB");
    // Measured: 39.5, 60.4 and 59.4 dB; three pictures are already as good as the renderings.
    assert!(one + 15.0 < three && three.min(nine) > 55.0, "{one} {three} {nine}");
}

#[test]
fn pictures_of_a_burst_have_noise_of_their_own() {
    let mut still = flight([DVec3::ZERO, DVec3::ZERO]);
    still.scenario.camera.photometric.noise_sigma = 0.02;
    let burst = TwinSpec { instants: Some(2), ..spec("burst") };
    let [a, b] = [0, 1].map(|k| twin(&still, &burst, Some(k), &[Channel::Color]).into_color());
    assert_ne!(a, b);
    let clean = TwinSpec { noise: Some(false), ..burst };
    let [a, b] = [0, 1].map(|k| twin(&still, &clean, Some(k), &[Channel::Color]).into_color());
    assert_eq!(a, b);
}

/// `flow_global` leads to the pixel of the global twin that sees the same point.
#[test]
fn global_flow_leads_to_the_same_point_in_the_global_twin() {
    let [width, height] = SIZE_PX.map(|side| side as usize);
    for instant in [FlowInstant::FirstRow, FlowInstant::Centre, FlowInstant::LastRow] {
        let mut base = moving();
        base.scenario.output.flow_instant = instant;
        let own = frame(&base, &[Channel::Color, Channel::Coords, Channel::FlowGlobal]);
        let spec = TwinSpec { shutter: Some(TwinShutter::Global), instant: Some(instant), ..spec("global") };
        let twin = twin(&base, &spec, None, &[Channel::Color, Channel::Coords]);
        let point = |frame: &RenderedFrame, i: usize| {
            let c = frame.coords().expect("asked for")[i];
            DVec3::new(f64::from(c[5]), f64::from(c[6]), f64::from(c[7]))
        };
        let flow = own.floats(Channel::FlowGlobal).expect("asked for");
        let (mut worst_m, mut compared) = (0.0_f64, 0);
        for (i, at) in flow.chunks_exact(3).enumerate() {
            let x = (i % width) as f64 + f64::from(at[0]);
            let y = (i / width) as f64 + f64::from(at[1]);
            let is_between = x >= 0.0 && y >= 0.0 && x < (width - 1) as f64 && y < (height - 1) as f64;
            if at[2] != f32::from(FlowState::Visible as u8) || !is_between {
                continue;
            }
            let (left, top) = (x as usize, y as usize);
            let near = |dx, dy| point(&twin, (top + dy) * width + left + dx);
            let (u, v) = (x.fract(), y.fract());
            let seen = near(0, 0).lerp(near(1, 0), u).lerp(near(0, 1).lerp(near(1, 1), u), v);
            worst_m = worst_m.max((seen - point(&own, i)).length());
            compared += 1;
        }
        assert!(compared > width * height / 2, "{compared}");
        // A pixel is 1.5 m wide on the ground; the lens bends the line between two of them.
        assert!(worst_m < 0.02, "{instant:?}: {worst_m} m");
    }
}
