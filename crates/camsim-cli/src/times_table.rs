//! `camsim render --times`: time per stage.

use std::time::{Duration, Instant};

use camsim_engine::FrameTimes;
use camsim_engine::peak_memory_mb;

use crate::progress::waiting;

/// Milliseconds of each stage, one entry per frame, in the order of execution.
#[derive(Debug, Default)]
pub struct TimesTable {
    /// Stages before the first frame.
    start: Vec<(&'static str, Duration)>,
    parts: Vec<(String, Vec<f64>)>,
    frames: usize,
}

impl TimesTable {
    /// Adds a stage before the first frame.
    pub fn add_start(&mut self, name: &'static str, time: Duration) {
        self.start.push((name, time));
    }

    /// Runs and times a stage before the first frame, with a progress message if it takes long.
    pub fn timed<T>(&mut self, name: &'static str, quiet: bool, work: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let waiting = waiting(name, quiet);
        let done = work();
        waiting.finish_and_clear();
        self.add_start(name, begin.elapsed());
        done
    }

    /// Adds a frame.
    pub fn add(&mut self, times: &FrameTimes) {
        self.frames += 1;
        for (name, ms) in [
            ("cpu: plan", times.plan_ms),
            ("cpu: record", times.record_ms),
            ("cpu: submit", times.submit_ms),
            ("cpu: wait", times.wait_ms),
        ] {
            self.part(name.to_owned(), ms);
        }
        for (name, ms) in [("cpu: ideal", times.ideal_ms), ("cpu: reverse", times.reverse_ms)] {
            ms.into_iter().for_each(|ms| self.part(name.to_owned(), ms));
        }
        self.part("cpu: read".to_owned(), times.read_ms);
        for pass in &times.passes {
            self.part(format!("gpu: {}", pass.name), pass.ms);
        }
    }

    fn part(&mut self, name: String, ms: f64) {
        match self.parts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, all)) => all.push(ms),
            None => self.parts.push((name, vec![ms])),
        }
    }

    /// Median and largest time of each stage, and the number of frames in which it ran (cached results are
    /// reused).
    #[must_use]
    pub fn text(&mut self) -> String {
        let mut text = format!("{:<24}{:>10}{:>10}{:>10}\n", "ms per frame", "median", "largest", "frames");
        for (name, all) in &mut self.parts {
            all.sort_by(f64::total_cmp);
            let (median, largest) = (all[all.len() / 2], all[all.len() - 1]);
            text += &format!("  {name:<22}{median:>10.2}{largest:>10.2}{:>10}\n", all.len());
        }
        if self.parts.iter().all(|(name, _)| name.starts_with("cpu")) {
            text += "  no gpu passes: the cpu rendered all frames, or the adapter has no time stamps\n";
        }
        text += "ms before the first frame\n";
        for (name, time) in &self.start {
            text += &format!("  {name:<22}{:>10.2}\n", time.as_secs_f64() * 1e3);
        }
        if let Some(mb) = peak_memory_mb() {
            text += &format!("memory: {mb:.0} MB at most\n");
        }
        text
    }
}
