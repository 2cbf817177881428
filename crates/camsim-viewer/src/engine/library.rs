//! What is loaded: shared by all who render, read once.

use std::sync::{Arc, Mutex, PoisonError};

use camsim_io::load::{LoadError, Loaded, load_sequence, reload_sequence};

use super::{
    Speaker,
    messages::{Reply, Wanted},
};

/// The last scenario that was loaded.
#[derive(Debug, Default)]
pub struct Library {
    known: Mutex<Option<Known>>,
}

#[derive(Debug)]
struct Known {
    /// Of the request that its files were read for.
    reading: u64,
    loaded: Arc<Loaded>,
}

impl Library {
    /// The files of a scenario, as far as they are not known. Who comes meanwhile waits: it is likely to want the same.
    ///
    /// # Errors
    /// Files that cannot be used.
    pub fn load(&self, wanted: &Wanted, speaker: &Speaker) -> Result<Arc<Loaded>, LoadError> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let same_files = known.as_ref().filter(|known| known.reading == wanted.reading);
        if let Some(known) = same_files
            && known.loaded.sequence.scenario == *wanted.scenario
        {
            return Ok(known.loaded.clone());
        }
        let loaded = match same_files {
            Some(known) => reload_sequence(&wanted.scenario, &known.loaded)?,
            None => {
                speaker.say(Reply::Busy(format!("reading {}", wanted.scenario.flight.log.display())));
                let loaded = load_sequence(&wanted.scenario);
                speaker.say(Reply::Busy(String::new()));
                loaded?
            }
        };
        let loaded = Arc::new(loaded);
        *known = Some(Known { reading: wanted.reading, loaded: loaded.clone() });
        speaker.say(Reply::Loaded(loaded.clone()));
        Ok(loaded)
    }
}
