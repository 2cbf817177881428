//! Lamps whose light rises and falls with the mains: bands under a rolling readout.

use crate::{
    scenario::{FlickerSpec, FlickerWave},
    shutter::{RowAxis, Shutter},
    transfer::sinc,
};

/// A lamp, seen through a shutter.
#[derive(Clone, Debug)]
pub(super) struct Flicker {
    spec: FlickerSpec,
    shutter: Shutter,
    exposure_s: f64,
}

impl Flicker {
    pub fn new(spec: &FlickerSpec, shutter: Shutter, exposure_s: f64) -> Self {
        Self { spec: spec.clone(), shutter, exposure_s }
    }

    /// Multiplies the light of the pixels of a row by the lamp's during their exposures.
    pub fn light(&self, y: u32, stamp_s: f64, electrons: &mut [f32]) {
        let at = |x: u32| {
            let longer_s = self.shutter.exposure_pixel_s(x, y) - self.shutter.exposure_s();
            self.mean(stamp_s + self.shutter.dt_pixel_s(x, y), self.exposure_s + longer_s) as f32
        };
        match self.shutter.row_axis() {
            RowAxis::Rows => {
                let light = at(0);
                electrons.iter_mut().for_each(|e| *e *= light);
            }
            RowAxis::Columns => (0..).zip(electrons).for_each(|(x, e)| *e *= at(x)),
        }
    }

    /// Mean of the lamp's light over an exposure with this middle; 1 in the long run.
    fn mean(&self, mid_s: f64, exposure_s: f64) -> f64 {
        let FlickerSpec { hz, depth, wave, duty, phase_deg } = self.spec;
        let turn = hz * mid_s + phase_deg / 360.0;
        let turns = hz * exposure_s;
        let wave = match wave {
            FlickerWave::Sine => {
                return 1.0 + depth * sinc(turns) * (std::f64::consts::TAU * turn.fract()).cos();
            }
            FlickerWave::Pulse if turns > 0.0 => {
                // Time alight from turn 0 on.
                let alight = |turn: f64| turn.floor() * duty + (turn - turn.floor()).min(duty);
                (alight(turn + 0.5 * turns) - alight(turn - 0.5 * turns)) / turns
            }
            FlickerWave::Pulse if turn - turn.floor() < duty => 1.0,
            FlickerWave::Pulse => 0.0,
        };
        1.0 - depth + depth * wave / duty
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::ShutterSpec;

    fn flicker(wave: FlickerWave, exposure_ms: f64) -> Flicker {
        let spec = FlickerSpec { hz: 100.0, depth: 0.7, wave, duty: 0.3, phase_deg: 40.0 };
        let shutter = ShutterSpec { readout_ms: 20.0, exposure_ms, ..ShutterSpec::default() };
        let shutter = Shutter::from_spec(&shutter, 25.0, [8, 400]).expect("valid");
        Flicker::new(&spec, shutter, exposure_ms * 1e-3)
    }

    /// The lamp itself.
    fn lamp(spec: &FlickerSpec, t_s: f64) -> f64 {
        let turn = spec.hz * t_s + spec.phase_deg / 360.0;
        match spec.wave {
            FlickerWave::Sine => 1.0 + spec.depth * (std::f64::consts::TAU * turn).cos(),
            FlickerWave::Pulse if turn.rem_euclid(1.0) < spec.duty => {
                1.0 - spec.depth + spec.depth / spec.duty
            }
            FlickerWave::Pulse => 1.0 - spec.depth,
        }
    }

    #[test]
    fn light_is_the_lamps_mean_over_the_exposure() {
        for wave in [FlickerWave::Sine, FlickerWave::Pulse] {
            for exposure_ms in [1.0, 4.0, 10.0, 13.0] {
                let flicker = flicker(wave, exposure_ms);
                for mid_s in [-0.013, 0.0, 0.0021, 0.0077, 31.4159] {
                    const STEPS: u32 = 200_000;
                    let fraction = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS) - 0.5;
                    let sum: f64 = (0..STEPS)
                        .map(|i| lamp(&flicker.spec, mid_s + fraction(i) * exposure_ms * 1e-3))
                        .sum();
                    let expected = sum / f64::from(STEPS);
                    let found = flicker.mean(mid_s, exposure_ms * 1e-3);
                    assert!(
                        (found - expected).abs() < 3e-5,
                        "{wave:?} {exposure_ms} {mid_s}: {found} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_hundred_hertz_under_a_readout_of_20_ms_gives_two_bands() {
        let flicker = flicker(FlickerWave::Sine, 2.0);
        let mut rows = vec![0.0_f64; 400];
        for (y, row) in (0..).zip(&mut rows) {
            let mut light = [1.0; 8];
            flicker.light(y, 0.5, &mut light);
            *row = f64::from(light[7]);
        }
        // Fourier coefficient of two periods a picture: the rows of 20 ms are 399 steps apart.
        let wave = |row: usize| std::f64::consts::TAU * 100.0 * 0.020 * row as f64 / 399.0;
        let [re, im] = [f64::cos, f64::sin].map(|part| {
            rows.iter().enumerate().map(|(y, light)| (light - 1.0) * part(wave(y))).sum::<f64>() / 200.0
        });
        let amplitude = 0.7 * (std::f64::consts::PI * 0.2).sin() / (std::f64::consts::PI * 0.2);
        assert!((re.hypot(im) / amplitude - 1.0).abs() < 0.01, "{} {amplitude}", re.hypot(im));
        // A whole period of the lamp has no bands.
        let even = self::flicker(FlickerWave::Sine, 10.0);
        assert!((even.mean(0.123, 0.010) - 1.0).abs() < 1e-12);
    }
}
