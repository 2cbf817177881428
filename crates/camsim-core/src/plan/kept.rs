//! What was found out about the last frames: whoever looks at a frame from several ideal frames asks for it again.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, PoisonError},
};

/// Frames that are remembered: as many as are looked at together, with some to spare for threads that are ahead.
const REMEMBERED: usize = 64;

/// Something of each of the last frames.
#[derive(Debug)]
pub(super) struct Kept<T>(Mutex<VecDeque<(u64, Arc<T>)>>);

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> Kept<T> {
    /// That of a frame: what is known, or what is found now. Nobody waits for it meanwhile: two that ask at once find the same.
    pub fn of(&self, frame: u64, find: impl FnOnce() -> T) -> Arc<T> {
        // What is kept is replaced whole: a panic elsewhere leaves nothing half done.
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = kept().iter().find(|(of, _)| *of == frame).map(|(_, known)| known.clone());
        known.unwrap_or_else(|| {
            let found = Arc::new(find());
            let mut kept = kept();
            kept.push_back((frame, found.clone()));
            if kept.len() > REMEMBERED {
                kept.pop_front();
            }
            found
        })
    }

    pub fn forget(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_is_not_looked_for_again_until_it_is_forgotten() {
        let kept = Kept::default();
        assert_eq!([*kept.of(3, || 30), *kept.of(4, || 40), *kept.of(3, || 31)], [30, 40, 30]);
        (0..REMEMBERED as u64).for_each(|frame| assert_eq!(*kept.of(100 + frame, || frame), frame));
        assert_eq!([*kept.of(100, || 99), *kept.of(3, || 31)], [0, 31], "the oldest make room");
        kept.forget();
        assert_eq!(*kept.of(3, || 32), 32);
    }
}
