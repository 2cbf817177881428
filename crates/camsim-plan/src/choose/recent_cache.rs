//! A cache of recent results: plans of a frame from several ideal frames, or of a group frame by frame, need
//! the same results again.

use std::{
    collections::VecDeque,
    convert::Infallible,
    sync::{Arc, Mutex, PoisonError},
};

/// The last results, each by its number: that of a frame, or of a group of them.
#[derive(Debug)]
pub(crate) struct RecentCache<T> {
    entries: Mutex<VecDeque<(u64, Arc<T>)>>,
    most: usize,
}

impl<T> RecentCache<T> {
    /// A cache of so many results at most.
    pub fn new(most: usize) -> Self {
        Self { entries: Mutex::default(), most }
    }

    /// What is cached for a number, or what is found now. No thread waits for another: two that need it at
    /// once find the same.
    pub fn get(&self, number: u64, find: impl FnOnce() -> T) -> Arc<T> {
        let Ok(entries) = self.try_get(number, || Ok::<_, Infallible>(find()));
        entries
    }

    /// As [`RecentCache::get`] where finding may fail; failures are not cached.
    pub fn try_get<E>(&self, number: u64, find: impl FnOnce() -> Result<T, E>) -> Result<Arc<T>, E> {
        // What is kept is replaced whole: a panic elsewhere leaves nothing half done.
        let kept = || self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        let known = kept().iter().find(|(of, _)| *of == number).map(|(_, known)| known.clone());
        known.map_or_else(
            || {
                let value = Arc::new(find()?);
                let mut kept = kept();
                kept.push_back((number, value.clone()));
                if kept.len() > self.most {
                    kept.pop_front();
                }
                Ok(value)
            },
            Ok,
        )
    }

    pub fn forget(&self) {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_found_once_until_they_are_forgotten_or_make_room() {
        let kept = RecentCache::new(3);
        assert_eq!([*kept.get(3, || 30), *kept.get(4, || 40), *kept.get(3, || 31)], [30, 40, 30]);
        assert_eq!([*kept.get(5, || 50), *kept.get(6, || 60), *kept.get(4, || 41)], [50, 60, 40]);
        assert_eq!(*kept.get(3, || 31), 31, "the oldest makes room");
        assert_eq!(kept.try_get(7, || Err("none")), Err("none"));
        assert_eq!(
            kept.try_get(7, || Ok::<_, &str>(70)).as_deref(),
            Ok(&70),
            "what was not found is looked for again"
        );
        kept.forget();
        assert_eq!(*kept.get(3, || 32), 32);
    }
}
