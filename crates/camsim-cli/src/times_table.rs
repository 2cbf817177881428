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
    /// Of the frames (`None`) and of each twin.
    groups: Vec<(Option<String>, Parts)>,
}

/// Milliseconds of each stage, by its name.
type Parts = Vec<(String, Vec<f64>)>;

impl TimesTable {
    /// Adds a stage before the first frame, or time to it.
    pub fn add_start(&mut self, name: &'static str, time: Duration) {
        match self.start.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += time,
            None => self.start.push((name, time)),
        }
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

    /// Adds a frame, or a picture of a twin with this name.
    pub fn add(&mut self, twin: Option<&str>, times: &FrameTimes) {
        let group = match self.groups.iter().position(|(name, _)| name.as_deref() == twin) {
            Some(group) => group,
            None => {
                self.groups.push((twin.map(str::to_owned), Parts::new()));
                self.groups.len() - 1
            }
        };
        let parts = &mut self.groups[group].1;
        let mut add = |name: String, ms: f64| match parts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, all)) => all.push(ms),
            None => parts.push((name, vec![ms])),
        };
        for (name, ms) in [
            ("cpu: plan", times.plan_ms),
            ("cpu: record", times.record_ms),
            ("cpu: submit", times.submit_ms),
            ("cpu: wait", times.wait_ms),
        ] {
            add(name.to_owned(), ms);
        }
        for (name, ms) in [("cpu: ideal", times.ideal_ms), ("cpu: reverse", times.reverse_ms)] {
            ms.into_iter().for_each(|ms| add(name.to_owned(), ms));
        }
        add("cpu: read".to_owned(), times.read_ms);
        for pass in &times.passes {
            add(format!("gpu: {}", pass.name), pass.ms);
        }
    }

    /// Median and largest time of each stage, and the number of frames in which it ran (cached results are
    /// reused).
    #[must_use]
    pub fn text(&mut self) -> String {
        let mut text = String::new();
        if self.groups.is_empty() {
            self.groups.push((None, Parts::new()));
        }
        for (twin, parts) in &mut self.groups {
            let title = match twin {
                None => "ms per frame".to_owned(),
                Some(name) => format!("ms per picture of {name}"),
            };
            text += &format!("{title:<24}{:>10}{:>10}{:>10}\n", "median", "largest", "frames");
            for (name, all) in parts {
                all.sort_by(f64::total_cmp);
                let (median, largest) = (all[all.len() / 2], all[all.len() - 1]);
                text += &format!("  {name:<22}{median:>10.2}{largest:>10.2}{:>10}\n", all.len());
            }
        }
        let mut names = self.groups.iter().flat_map(|(_, parts)| parts).map(|(name, _)| name);
        if names.all(|name| name.starts_with("cpu")) {
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
