//! Random errors of sensors: white noise, and processes with a memory.

use std::sync::LazyLock;

use glam::DVec3;

use crate::noise::{camera_seed, normal_from_bits, sample_words, tail_table};

static TAIL_TABLE: LazyLock<Vec<f32>> = LazyLock::new(tail_table);

/// Random numbers of a sensor, by number of the sample and stream.
#[derive(Clone, Copy, Debug)]
pub(super) struct Normals {
    seed: u64,
}

impl Normals {
    pub(super) fn new(seed: u64, name: &str) -> Self {
        Self { seed: camera_seed(seed, name) }
    }

    /// Four independent standard normals.
    pub(super) fn at(self, sample: i64, stream: u32) -> [f64; 4] {
        sample_words(sample, self.seed, stream).map(|bits| f64::from(normal_from_bits(bits, &TAIL_TABLE)))
    }

    /// Three of them.
    pub(super) fn vector(self, sample: i64, stream: u32) -> DVec3 {
        let [x, y, z, _] = self.at(sample, stream);
        DVec3::new(x, y, z)
    }

    /// A number in (0, 1).
    pub(super) fn uniform(self, sample: i64, stream: u32) -> f64 {
        let [word, ..] = sample_words(sample, self.seed, stream);
        (f64::from(word >> 8) + 0.5) / f64::from(1 << 24)
    }
}

/// A Markov process over all samples, whose state at sample 0 is given.
pub(super) trait Process {
    type State: Copy;

    fn at_zero(&self) -> Self::State;
    /// The state at `sample` from that at `sample - 1`.
    fn after(&self, state: Self::State, sample: i64) -> Self::State;
    /// The state at `sample` from that at `sample + 1`.
    fn before(&self, state: Self::State, sample: i64) -> Self::State;
    /// Whether the state ever changes.
    fn changes(&self) -> bool;
}

/// The states of a process from one sample on.
pub(super) struct Series<'p, P: Process> {
    process: &'p P,
    /// States before sample 0 that are still to come, the next one at the end.
    earlier: Vec<P::State>,
    state: P::State,
    /// Sample of `state`.
    sample: i64,
}

impl<'p, P: Process> Series<'p, P> {
    pub(super) fn new(process: &'p P, first: i64) -> Self {
        let mut series = Self { process, earlier: Vec::new(), state: process.at_zero(), sample: 0 };
        if process.changes() {
            let mut state = series.state;
            for sample in (first..0).rev() {
                state = process.before(state, sample);
                series.earlier.push(state);
            }
            (0..first).for_each(|_| series.advance());
        }
        series
    }

    fn advance(&mut self) {
        self.sample += 1;
        self.state = self.process.after(self.state, self.sample);
    }

    /// The state at the next sample.
    pub(super) fn next(&mut self) -> P::State {
        if let Some(state) = self.earlier.pop() {
            return state;
        }
        let state = self.state;
        if self.process.changes() {
            self.advance();
        }
        state
    }
}

/// White noise and biases of three axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisErrors {
    normals: Normals,
    stream: u32,
    /// Standard deviation of the white noise of a sample.
    white: DVec3,
    constant: DVec3,
    /// Standard deviation of a step of the random walk.
    walk_step: DVec3,
    drift_sigma: DVec3,
    /// Correlation of the drift from one sample to the next.
    drift_kept: f64,
}

/// Streams that [`AxisErrors`] use from their first one on: white noise, walk, drift, constant bias.
const WALK: u32 = 1;
const DRIFT: u32 = 2;
const CONSTANT: u32 = 3;

/// Figures of [`AxisErrors`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ErrorFigures {
    /// Standard deviation of the white noise of a sample.
    pub(super) white: DVec3,
    /// Constant bias.
    pub(super) bias: DVec3,
    /// Standard deviation of a constant bias that is drawn once.
    pub(super) bias_sigma: DVec3,
    /// Standard deviation of a step of the random walk.
    pub(super) walk_step: DVec3,
    /// Standard deviation of the Gauss-Markov process.
    pub(super) drift_sigma: DVec3,
    /// Its correlation time in samples.
    pub(super) drift_samples: f64,
}

impl AxisErrors {
    pub(super) fn new(normals: Normals, stream: u32, figures: &ErrorFigures) -> Self {
        let drawn = normals.vector(0, stream + CONSTANT);
        Self {
            normals,
            stream,
            white: figures.white,
            constant: figures.bias + figures.bias_sigma * drawn,
            walk_step: figures.walk_step,
            drift_sigma: figures.drift_sigma,
            drift_kept: (-1.0 / figures.drift_samples).exp(),
        }
    }

    /// White noise of a sample.
    pub(super) fn white(&self, sample: i64) -> DVec3 {
        if self.white == DVec3::ZERO {
            return DVec3::ZERO;
        }
        self.white * self.normals.vector(sample, self.stream)
    }

    /// The bias in a state of its process.
    pub(super) fn bias(&self, state: &BiasState) -> DVec3 {
        self.constant + state.walk + state.drift
    }

    fn step(&self, sample: i64) -> DVec3 {
        match self.walk_step == DVec3::ZERO {
            true => DVec3::ZERO,
            false => self.walk_step * self.normals.vector(sample, self.stream + WALK),
        }
    }

    /// The drift at `sample` from that of a neighbour; the process looks the same backwards.
    fn drift(&self, neighbour: DVec3, sample: i64) -> DVec3 {
        if self.drift_sigma == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let kick = (1.0 - self.drift_kept * self.drift_kept).sqrt();
        self.drift_kept * neighbour
            + kick * self.drift_sigma * self.normals.vector(sample, self.stream + DRIFT)
    }
}

/// The part of a bias that changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct BiasState {
    walk: DVec3,
    drift: DVec3,
}

impl Process for AxisErrors {
    type State = BiasState;

    fn at_zero(&self) -> BiasState {
        let drift = self.drift_sigma * self.normals.vector(0, self.stream + DRIFT);
        BiasState { walk: DVec3::ZERO, drift }
    }

    fn after(&self, state: BiasState, sample: i64) -> BiasState {
        BiasState { walk: state.walk + self.step(sample), drift: self.drift(state.drift, sample) }
    }

    fn before(&self, state: BiasState, sample: i64) -> BiasState {
        BiasState { walk: state.walk - self.step(sample + 1), drift: self.drift(state.drift, sample) }
    }

    fn changes(&self) -> bool {
        self.walk_step != DVec3::ZERO || self.drift_sigma != DVec3::ZERO
    }
}

/// Rounds to multiples of `step` and cuts at `range`; 0 is none of them.
pub(super) fn read_out(value: f64, step: f64, range: f64) -> f64 {
    let stepped = if step > 0.0 { (value / step).round() * step } else { value };
    if range > 0.0 { stepped.clamp(-range, range) } else { stepped }
}
