//! The loaded scenario, shared by all threads that render.

use std::{
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    time::{Duration, Instant},
};

use camsim_io::load::{LoadError, Loaded, load_sequence, reload_sequence};

use super::{
    ReplySender,
    messages::{FrameRequest, Reply},
};

/// Time between two checks whether the scenario being read is still requested.
const POLL_INTERVAL: Duration = Duration::from_millis(30);
/// Time after which reading a change is reported as busy.
const BUSY_AFTER: Duration = Duration::from_millis(250);

/// The last scenario that was loaded.
#[derive(Debug, Default)]
pub struct ScenarioCache {
    cached: Mutex<Option<CachedScenario>>,
    /// The highest reload count requested.
    latest_reload: AtomicU64,
}

#[derive(Debug)]
struct CachedScenario {
    /// Reload count of the request that its files were read for.
    reload_count: u64,
    loaded: Arc<Loaded>,
}

/// Why a scenario could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioCacheError {
    /// Files that cannot be used.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// Another scenario was opened, or files were reloaded, while this one was read.
    #[error("another scenario was opened")]
    Superseded,
    /// The thread that reads could not be started, or panicked.
    #[error("internal error while reading; open the scenario again, or another one")]
    Stopped,
}

impl ScenarioCache {
    /// Makes loads with a lower reload count end with [`ScenarioCacheError::Superseded`].
    pub fn announce(&self, reload_count: u64) {
        self.latest_reload.fetch_max(reload_count, Ordering::Relaxed);
    }

    /// The loaded scenario of a request. Reads only the files that changed since the last one. Other threads
    /// wait meanwhile, since they are likely to need the same scenario.
    ///
    /// # Errors
    /// Files that cannot be used; a newer request, since a long log takes time.
    pub fn load(
        &self,
        request: &FrameRequest,
        reply_sender: &ReplySender,
    ) -> Result<Arc<Loaded>, ScenarioCacheError> {
        let mut cached = self.cached.lock().unwrap_or_else(PoisonError::into_inner);
        let same_files = cached.as_ref().filter(|cached| cached.reload_count == request.reload_count);
        if let Some(cached) = same_files
            && cached.loaded.sequence.scenario == *request.scenario
        {
            return Ok(cached.loaded.clone());
        }
        let before = same_files.map(|cached| cached.loaded.clone());
        let loaded = Arc::new(self.read(request, before, reply_sender)?);
        *cached = Some(CachedScenario { reload_count: request.reload_count, loaded: loaded.clone() });
        reply_sender.send(Reply::Loaded(loaded.clone()));
        Ok(loaded)
    }

    /// Reads on a thread of its own, which is abandoned, not awaited, when a newer request supersedes it.
    fn read(
        &self,
        request: &FrameRequest,
        before: Option<Arc<Loaded>>,
        reply_sender: &ReplySender,
    ) -> Result<Loaded, ScenarioCacheError> {
        if self.is_superseded(request) {
            return Err(ScenarioCacheError::Superseded);
        }
        let (began, busy_after) =
            (Instant::now(), if before.is_some() { BUSY_AFTER } else { Duration::ZERO });
        let scenario = request.scenario.clone();
        let (sender, done) = channel();
        let work = move || {
            let loaded =
                before.map_or_else(|| load_sequence(&scenario), |before| reload_sequence(&scenario, &before));
            // The receiver is gone if the request was superseded.
            let _ = sender.send(loaded);
        };
        std::thread::Builder::new()
            .name("camsim files".into())
            .spawn(work)
            .map_err(|_| ScenarioCacheError::Stopped)?;
        let mut is_reported = false;
        let read = loop {
            if !is_reported && began.elapsed() >= busy_after {
                reply_sender.send(Reply::Busy(format!("reading {}", request.scenario.flight.log.display())));
                is_reported = true;
            }
            match done.recv_timeout(POLL_INTERVAL) {
                Ok(loaded) => break loaded.map_err(ScenarioCacheError::Load),
                Err(RecvTimeoutError::Disconnected) => break Err(ScenarioCacheError::Stopped),
                Err(RecvTimeoutError::Timeout) if self.is_superseded(request) => {
                    break Err(ScenarioCacheError::Superseded);
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        };
        if is_reported {
            reply_sender.send(Reply::Busy(String::new()));
        }
        read
    }

    fn is_superseded(&self, request: &FrameRequest) -> bool {
        self.latest_reload.load(Ordering::Relaxed) > request.reload_count
    }
}

#[cfg(test)]
mod tests {
    use camsim_io::scenario_file::read_scenario;

    use super::*;
    use crate::{
        engine::{Size, Stage},
        tests::harness::{long_flight, pattern},
    };

    fn request(path: &std::path::Path, reload_count: u64) -> FrameRequest {
        let scenario = Arc::new(read_scenario(path, &[], None).expect("legal"));
        FrameRequest {
            scenario,
            reload_count,
            frame: 0,
            stages: vec![Stage::Ideal],
            size: Size::Preview,
            depth: false,
            raw: false,
            histogram: false,
            errors: false,
            gain: None,
        }
    }

    #[test]
    fn reading_a_long_log_is_abandoned_when_another_scenario_is_opened() {
        let folder = tempfile::tempdir().expect("a folder");
        let (sender, replies) = channel();
        let scenarios = Arc::new(ScenarioCache::default());
        // Another scenario is opened at the first busy reply.
        let window = scenarios.clone();
        let reply_sender = ReplySender { sender, repaint: Arc::new(move || window.announce(1)) };
        let long = request(&long_flight(folder.path()), 0);
        let began = Instant::now();
        let abandoned = scenarios.load(&long, &reply_sender);
        assert!(matches!(abandoned, Err(ScenarioCacheError::Superseded)), "{abandoned:?}");
        let abandoned_after = began.elapsed();
        assert!(
            matches!(scenarios.load(&long, &reply_sender), Err(ScenarioCacheError::Superseded)),
            "also a late request"
        );
        let other = scenarios.load(&request(&pattern(), 1), &reply_sender).expect("loaded");
        assert_eq!(other.sequence.scenario, *request(&pattern(), 1).scenario);
        let busy: Vec<String> = replies
            .try_iter()
            .filter_map(|reply| if let Reply::Busy(task) = reply { Some(task) } else { None })
            .collect();
        assert!(
            busy.len() == 4 && busy[0].contains("long.csv") && busy[1].is_empty() && busy[3].is_empty(),
            "{busy:?}"
        );
        // Loading ended before the log was read.
        let began = Instant::now();
        assert!(load_sequence(&long.scenario).is_ok());
        assert!(abandoned_after < began.elapsed(), "{abandoned_after:?}");
    }
}
