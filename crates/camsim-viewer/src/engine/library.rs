//! What is loaded: shared by all who render, read once.

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
    Speaker,
    messages::{Reply, Wanted},
};

/// Time between two looks at whether a scenario that is being read is still wanted.
const LOOK: Duration = Duration::from_millis(30);
/// A change that is read within this time is not told of.
const SOON: Duration = Duration::from_millis(250);

/// The last scenario that was loaded.
#[derive(Debug, Default)]
pub struct Library {
    known: Mutex<Option<Known>>,
    /// The latest reading that somebody wants.
    latest: AtomicU64,
}

#[derive(Debug)]
struct Known {
    /// Of the request that its files were read for.
    reading: u64,
    loaded: Arc<Loaded>,
}

/// Why there is nothing to render.
#[derive(Debug, thiserror::Error)]
pub enum LibraryError {
    /// Files that cannot be used.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// Another scenario was opened meanwhile.
    #[error("another scenario was opened")]
    Superseded,
    /// A fault in the program.
    #[error("reading stopped at a fault of its own; open the scenario again, or another one")]
    Stopped,
}

impl Library {
    /// From now on only this reading of files, or a later one, is wanted.
    pub fn announce(&self, reading: u64) {
        self.latest.fetch_max(reading, Ordering::Relaxed);
    }

    /// The files of a scenario, as far as they are not known. Who comes meanwhile waits: it is likely to want
    /// the same.
    ///
    /// # Errors
    /// Files that cannot be used; another scenario that was opened meanwhile, as hours of flight take their
    /// time.
    pub fn load(&self, wanted: &Wanted, speaker: &Speaker) -> Result<Arc<Loaded>, LibraryError> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let same_files = known.as_ref().filter(|known| known.reading == wanted.reading);
        if let Some(known) = same_files
            && known.loaded.sequence.scenario == *wanted.scenario
        {
            return Ok(known.loaded.clone());
        }
        let before = same_files.map(|known| known.loaded.clone());
        let loaded = Arc::new(self.read(wanted, before, speaker)?);
        *known = Some(Known { reading: wanted.reading, loaded: loaded.clone() });
        speaker.say(Reply::Loaded(loaded.clone()));
        Ok(loaded)
    }

    /// Reads on a thread of its own, which is left alone if nobody wants what it reads any more: it ends by
    /// itself.
    fn read(
        &self,
        wanted: &Wanted,
        before: Option<Arc<Loaded>>,
        speaker: &Speaker,
    ) -> Result<Loaded, LibraryError> {
        if self.is_superseded(wanted) {
            return Err(LibraryError::Superseded);
        }
        let (begun, wait) = (Instant::now(), if before.is_some() { SOON } else { Duration::ZERO });
        let scenario = wanted.scenario.clone();
        let (sender, done) = channel();
        let work = move || {
            let loaded =
                before.map_or_else(|| load_sequence(&scenario), |before| reload_sequence(&scenario, &before));
            // Nobody may wait for it any more.
            let _ = sender.send(loaded);
        };
        std::thread::Builder::new()
            .name("camsim files".into())
            .spawn(work)
            .map_err(|_| LibraryError::Stopped)?;
        let mut told = false;
        let read = loop {
            if !told && begun.elapsed() >= wait {
                speaker.say(Reply::Busy(format!("reading {}", wanted.scenario.flight.log.display())));
                told = true;
            }
            match done.recv_timeout(LOOK) {
                Ok(loaded) => break loaded.map_err(LibraryError::Load),
                Err(RecvTimeoutError::Disconnected) => break Err(LibraryError::Stopped),
                Err(RecvTimeoutError::Timeout) if self.is_superseded(wanted) => {
                    break Err(LibraryError::Superseded);
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        };
        if told {
            speaker.say(Reply::Busy(String::new()));
        }
        read
    }

    fn is_superseded(&self, wanted: &Wanted) -> bool {
        self.latest.load(Ordering::Relaxed) > wanted.reading
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

    fn wanted(path: &std::path::Path, reading: u64) -> Wanted {
        let scenario = Arc::new(read_scenario(path, &[], None).expect("legal"));
        Wanted {
            scenario,
            reading,
            frame: 0,
            stages: vec![Stage::Ideal],
            size: Size::Preview,
            truth: false,
            errors: false,
            gain: None,
        }
    }

    #[test]
    fn hours_of_flight_are_left_alone_when_another_scenario_is_opened() {
        let folder = tempfile::tempdir().expect("a folder");
        let (sender, replies) = channel();
        let library = Arc::new(Library::default());
        // Another one is opened as soon as the window is told that this one is being read.
        let window = library.clone();
        let speaker = Speaker { replies: sender, repaint: Arc::new(move || window.announce(1)) };
        let long = wanted(&long_flight(folder.path()), 0);
        let begun = Instant::now();
        let left = library.load(&long, &speaker);
        assert!(matches!(left, Err(LibraryError::Superseded)), "{left:?}");
        let left_after = begun.elapsed();
        assert!(
            matches!(library.load(&long, &speaker), Err(LibraryError::Superseded)),
            "also who comes late"
        );
        let other = library.load(&wanted(&pattern(), 1), &speaker).expect("loaded");
        assert_eq!(other.sequence.scenario, *wanted(&pattern(), 1).scenario);
        let told: Vec<String> = replies
            .try_iter()
            .filter_map(|reply| if let Reply::Busy(what) = reply { Some(what) } else { None })
            .collect();
        assert!(
            told.len() == 4 && told[0].contains("long.csv") && told[1].is_empty() && told[3].is_empty(),
            "{told:?}"
        );
        // It was not waited for.
        let begun = Instant::now();
        assert!(load_sequence(&long.scenario).is_ok());
        assert!(left_after < begun.elapsed(), "{left_after:?}");
    }
}
