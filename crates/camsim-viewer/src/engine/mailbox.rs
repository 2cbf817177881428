//! A channel that holds only the latest request.

use std::sync::{Condvar, Mutex, PoisonError};

/// Holds the latest request until a thread takes it.
#[derive(Debug)]
pub struct Mailbox<T> {
    state: Mutex<MailboxState<T>>,
    arrived: Condvar,
}

#[derive(Debug)]
struct MailboxState<T> {
    request: Option<T>,
    closed: bool,
}

impl<T> Default for Mailbox<T> {
    fn default() -> Self {
        Self { state: Mutex::new(MailboxState { request: None, closed: false }), arrived: Condvar::new() }
    }
}

impl<T> Mailbox<T> {
    /// Puts a request in, instead of one that has not been taken.
    pub fn put(&self, request: T) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).request = Some(request);
        self.arrived.notify_one();
    }

    /// Withdraws a request that has not been taken.
    pub fn clear(&self) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).request = None;
    }

    /// Waits for a request; `None` once the mailbox is closed.
    pub fn take(&self) -> Option<T> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if state.closed {
                return None;
            }
            if let Some(request) = state.request.take() {
                return Some(request);
            }
            state = self.arrived.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Whether work in progress is outdated: a newer request waits, or the mailbox is closed.
    pub fn has_newer(&self) -> bool {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.closed || state.request.is_some()
    }

    /// Ends [`Mailbox::take`] in all threads.
    pub fn close(&self) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).closed = true;
        self.arrived.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_latest_request_is_kept_and_a_closed_mailbox_gives_none() {
        let mailbox = Mailbox::default();
        assert!(!mailbox.has_newer());
        mailbox.put(1);
        mailbox.put(2);
        assert!(mailbox.has_newer());
        assert_eq!(mailbox.take(), Some(2));
        assert!(!mailbox.has_newer());
        mailbox.put(7);
        mailbox.clear();
        assert!(!mailbox.has_newer());
        mailbox.put(3);
        mailbox.close();
        assert!(mailbox.has_newer(), "work in progress should stop");
        assert_eq!(mailbox.take(), None);
    }
}
