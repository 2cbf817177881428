//! From the level of a picture to the exposure of a frame.

use crate::exposure::FrameExposure;
use crate::scenario::{AutoExposureSpec, ExposureOrder};

/// Level below which a picture counts as that dark, as a fraction of the target.
const DARKEST: f64 = 1e-3;
/// Steps that find the exposure at which the first picture has the target's level.
const SETTLING_STEPS: u32 = 64;

/// Controller of exposure time and gain. Its state is the exposure x: the logarithm of time times gain, relative
/// to the nominal time.
///
/// A picture that was taken with x' and has the level L shows that `x' + ln(target / L)` would be right, unless
/// it is saturated. Each frame corrects the fraction `speed` of the difference: x moves towards what is right
/// without overshoot, whatever the delay, as the exposure of the metered picture is known.
#[derive(Clone, Debug)]
pub struct Controller {
    spec: AutoExposureSpec,
    nominal_s: f64,
}

impl Controller {
    /// A controller of a camera with this nominal exposure time, seconds, above 0.
    #[must_use]
    pub fn new(spec: &AutoExposureSpec, nominal_s: f64) -> Self {
        Self { spec: spec.clone(), nominal_s }
    }

    /// How many frames before its own the picture is that a frame's exposure follows from.
    #[must_use]
    pub fn delay(&self) -> u64 {
        u64::from(self.spec.delay)
    }

    /// The exposure of the next frame, from that of the frame before it and a picture of this level that was
    /// taken with `metered`.
    #[must_use]
    pub fn next(&self, before: f64, metered: f64, level: f64) -> f64 {
        let right = metered + (self.spec.target / level.max(DARKEST * self.spec.target)).ln();
        self.within_limits(before + self.spec.speed * (self.within_limits(right) - before))
    }

    /// The exposure at which a picture has the target's level, or the limit that comes nearest. `level` is that
    /// of the picture with an exposure.
    #[must_use]
    pub fn settled(&self, level: impl Fn(f64) -> f64) -> f64 {
        let at_once = Self { spec: AutoExposureSpec { speed: 1.0, ..self.spec.clone() }, ..*self };
        (0..SETTLING_STEPS).fold(self.nominal(), |x, _| at_once.next(x, x, level(x)))
    }

    /// The nominal exposure, within the limits.
    #[must_use]
    pub fn nominal(&self) -> f64 {
        self.within_limits(0.0)
    }

    /// Exposure time and gain.
    #[must_use]
    pub fn exposure(&self, x: f64) -> FrameExposure {
        let AutoExposureSpec { gain: [least_gain, most_gain], first, .. } = self.spec;
        let [least_s, most_s] = self.spec.exposure_ms.map(|ms| 1e-3 * ms);
        let product_s = self.nominal_s * x.exp();
        let (time_s, gain) = match first {
            ExposureOrder::Exposure => {
                let time_s = (product_s / least_gain).clamp(least_s, most_s);
                (time_s, (product_s / time_s).clamp(least_gain, most_gain))
            }
            ExposureOrder::Gain => {
                let gain = (product_s / least_s).clamp(least_gain, most_gain);
                ((product_s / gain).clamp(least_s, most_s), gain)
            }
        };
        FrameExposure { time_s, gain, light: time_s * gain / self.nominal_s }
    }

    fn within_limits(&self, x: f64) -> f64 {
        let limit = |k: usize| (1e-3 * self.spec.exposure_ms[k] * self.spec.gain[k] / self.nominal_s).ln();
        x.clamp(limit(0), limit(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOMINAL_S: f64 = 8e-3;

    fn spec() -> AutoExposureSpec {
        AutoExposureSpec {
            target: 0.2,
            exposure_ms: [0.08, 16.0],
            gain: [1.0, 8.0],
            speed: 0.3,
            ..AutoExposureSpec::default()
        }
    }

    /// Exposures of frames over a scene of these brightnesses, which does not saturate.
    fn run(spec: &AutoExposureSpec, scene: &[f64]) -> Vec<f64> {
        let controller = Controller::new(spec, NOMINAL_S);
        let mut all = vec![controller.settled(|x| scene[0] * x.exp())];
        for frame in 1..scene.len() {
            let before = all[frame - 1];
            let Some(metered) = frame.checked_sub(spec.delay as usize) else {
                all.push(before);
                continue;
            };
            all.push(controller.next(before, all[metered], scene[metered] * all[metered].exp()));
        }
        all
    }

    #[test]
    fn a_step_is_followed_as_the_closed_form_has_it() {
        for delay in [1, 2, 5] {
            for speed in [0.05, 0.3, 1.0] {
                let spec = AutoExposureSpec { delay, speed, ..spec() };
                let scene: Vec<f64> = (0..60).map(|frame| if frame < 10 { 0.8 } else { 0.1 }).collect();
                let found = run(&spec, &scene);
                let [before, after] = [0.8_f64, 0.1].map(|bright| (0.2 / bright).ln());
                for (frame, x) in found.iter().enumerate() {
                    // The first frame that follows from the dark is 10 + delay.
                    let corrected = (frame as i32 + 1 - 10 - delay as i32).max(0);
                    let expected = after + (before - after) * (1.0 - speed).powi(corrected);
                    assert!((x - expected).abs() < 1e-12, "{delay} {speed} {frame}: {x} {expected}");
                }
            }
        }
    }

    #[test]
    fn limits_hold_and_nothing_winds_up_beyond_them() {
        let spec = AutoExposureSpec { delay: 3, ..spec() };
        let scene: Vec<f64> =
            (0..120).map(|frame| if (20..70).contains(&frame) { 1e-6 } else { 0.4 }).collect();
        let found = run(&spec, &scene);
        let most = (16.0 * 8.0 / 8.0_f64).ln();
        assert!(found.iter().all(|&x| x <= most) && (found[69] - most).abs() < 1e-6, "{}", found[69]);
        // Back at the same rate as in the closed form from the limit.
        let right = (0.2 / 0.4_f64).ln();
        let expected = right + (found[72] - right) * 0.7_f64.powi(5);
        assert!((found[77] - expected).abs() < 1e-9, "{} {expected}", found[77]);
    }

    #[test]
    fn time_and_gain_share_the_exposure_in_the_given_order() {
        let split = |first: ExposureOrder, product_ms: f64| {
            let spec = AutoExposureSpec { first, ..spec() };
            let found = Controller::new(&spec, NOMINAL_S).exposure((product_ms / 8.0).ln());
            assert!((found.light * 8.0 / product_ms - 1.0).abs() < 1e-12);
            [found.time_s * 1e3, found.gain]
        };
        let cases = [
            (ExposureOrder::Exposure, 4.0, [4.0, 1.0]),
            (ExposureOrder::Exposure, 48.0, [16.0, 3.0]),
            (ExposureOrder::Exposure, 128.0, [16.0, 8.0]),
            (ExposureOrder::Gain, 0.08, [0.08, 1.0]),
            (ExposureOrder::Gain, 0.4, [0.08, 5.0]),
            (ExposureOrder::Gain, 4.0, [0.5, 8.0]),
        ];
        for (first, product_ms, expected) in cases {
            let found = split(first, product_ms);
            assert!(
                (found[0] - expected[0]).abs() < 1e-9 && (found[1] - expected[1]).abs() < 1e-9,
                "{found:?}"
            );
        }
    }

    #[test]
    fn a_saturated_picture_settles_too() {
        let controller = Controller::new(&spec(), NOMINAL_S);
        // A tenth of the picture is a lamp that is always white.
        let level = |x: f64| 0.1 + 0.9 * (0.5 * x.exp()).min(1.0);
        let x = controller.settled(level);
        assert!((level(x) - 0.2).abs() < 1e-9, "{}", level(x));
        // What is black ends at the limit.
        let most = controller.exposure(controller.settled(|_| 0.0));
        assert_eq!([most.time_s, most.gain].map(|v| (v * 1e6).round()), [16_000.0, 8e6]);
    }
}
