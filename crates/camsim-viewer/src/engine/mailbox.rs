//! A letter box with room for one letter: the latest.

use std::sync::{Condvar, Mutex, PoisonError};

/// Holds the latest request until somebody takes it.
#[derive(Debug)]
pub struct Mailbox<T> {
    slot: Mutex<Slot<T>>,
    arrived: Condvar,
}

#[derive(Debug)]
struct Slot<T> {
    letter: Option<T>,
    closed: bool,
}

impl<T> Default for Mailbox<T> {
    fn default() -> Self {
        Self { slot: Mutex::new(Slot { letter: None, closed: false }), arrived: Condvar::new() }
    }
}

impl<T> Mailbox<T> {
    /// Puts a letter in; one that nobody has taken is thrown away.
    pub fn put(&self, letter: T) {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner).letter = Some(letter);
        self.arrived.notify_one();
    }

    /// Takes a letter back that nobody has taken.
    pub fn clear(&self) {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner).letter = None;
    }

    /// Waits for a letter; `None` once the box is closed.
    pub fn take(&self) -> Option<T> {
        let mut slot = self.slot.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if slot.closed {
                return None;
            }
            if let Some(letter) = slot.letter.take() {
                return Some(letter);
            }
            slot = self.arrived.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Whether a letter waits, or none will come any more: what is at work is out of date.
    pub fn is_newer(&self) -> bool {
        let slot = self.slot.lock().unwrap_or_else(PoisonError::into_inner);
        slot.closed || slot.letter.is_some()
    }

    /// No more letters.
    pub fn close(&self) {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner).closed = true;
        self.arrived.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_letter_wins_and_a_closed_box_gives_none() {
        let mailbox = Mailbox::default();
        assert!(!mailbox.is_newer());
        mailbox.put(1);
        mailbox.put(2);
        assert!(mailbox.is_newer());
        assert_eq!(mailbox.take(), Some(2));
        assert!(!mailbox.is_newer());
        mailbox.put(7);
        mailbox.clear();
        assert!(!mailbox.is_newer());
        mailbox.put(3);
        mailbox.close();
        assert!(mailbox.is_newer(), "who is at work should stop");
        assert_eq!(mailbox.take(), None);
    }
}
