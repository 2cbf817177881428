//! What was found out last: whoever looks at a frame from several ideal frames, or at a group frame by frame,
//! asks for it again.

use std::{
    collections::VecDeque,
    convert::Infallible,
    sync::{Arc, Mutex, PoisonError},
};

/// The last things that were found, each by its number: that of a frame, or of a group of them.
#[derive(Debug)]
pub(super) struct Kept<T> {
    found: Mutex<VecDeque<(u64, Arc<T>)>>,
    most: usize,
}

impl<T> Kept<T> {
    /// Keeps so many at most.
    pub fn new(most: usize) -> Self {
        Self { found: Mutex::default(), most }
    }

    /// What is known of a number, or what is found now. Nobody waits for it meanwhile: two that ask at once
    /// find the same.
    pub fn of(&self, number: u64, find: impl FnOnce() -> T) -> Arc<T> {
        let Ok(found) = self.try_of(number, || Ok::<_, Infallible>(find()));
        found
    }

    /// The same where it may not be found, which is not kept.
    pub fn try_of<E>(&self, number: u64, find: impl FnOnce() -> Result<T, E>) -> Result<Arc<T>, E> {
        // What is kept is replaced whole: a panic elsewhere leaves nothing half done.
        let kept = || self.found.lock().unwrap_or_else(PoisonError::into_inner);
        let known = kept().iter().find(|(of, _)| *of == number).map(|(_, known)| known.clone());
        known.map_or_else(
            || {
                let found = Arc::new(find()?);
                let mut kept = kept();
                kept.push_back((number, found.clone()));
                if kept.len() > self.most {
                    kept.pop_front();
                }
                Ok(found)
            },
            Ok,
        )
    }

    pub fn forget(&self) {
        self.found.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_is_not_looked_for_again_until_it_is_forgotten() {
        let kept = Kept::new(3);
        assert_eq!([*kept.of(3, || 30), *kept.of(4, || 40), *kept.of(3, || 31)], [30, 40, 30]);
        assert_eq!([*kept.of(5, || 50), *kept.of(6, || 60), *kept.of(4, || 41)], [50, 60, 40]);
        assert_eq!(*kept.of(3, || 31), 31, "the oldest makes room");
        assert_eq!(kept.try_of(7, || Err("none")), Err("none"));
        assert_eq!(
            kept.try_of(7, || Ok::<_, &str>(70)).as_deref(),
            Ok(&70),
            "what was not found is looked for again"
        );
        kept.forget();
        assert_eq!(*kept.of(3, || 32), 32);
    }
}
