//! A channel that holds only the latest request.

use std::sync::{
    Arc, Condvar, Mutex, PoisonError,
    atomic::{AtomicBool, Ordering},
};

/// Holds the latest request until a thread takes it.
#[derive(Debug)]
pub struct Mailbox<T> {
    state: Mutex<MailboxState<T>>,
    arrived: Condvar,
    /// Whether work in progress is to be cancelled.
    cancel: Arc<AtomicBool>,
}

#[derive(Debug)]
struct MailboxState<T> {
    request: Option<T>,
    closed: bool,
}

impl<T> Default for Mailbox<T> {
    fn default() -> Self {
        let state = Mutex::new(MailboxState { request: None, closed: false });
        Self { state, arrived: Condvar::new(), cancel: Arc::default() }
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

    /// Cancels work in progress; the next request that is taken begins anew.
    pub fn cancel(&self) {
        let _state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        self.cancel.store(true, Ordering::Relaxed);
    }

    /// Whether work in progress is cancelled, to be looked at from elsewhere.
    pub fn cancelled(&self) -> Arc<AtomicBool> {
        self.cancel.clone()
    }

    /// Waits for a request; `None` once the mailbox is closed.
    pub fn take(&self) -> Option<T> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if state.closed {
                return None;
            }
            if let Some(request) = state.request.take() {
                self.cancel.store(false, Ordering::Relaxed);
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
        self.cancel.store(true, Ordering::Relaxed);
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
        mailbox.cancel();
        assert!(mailbox.cancelled().load(Ordering::Relaxed));
        mailbox.put(7);
        assert_eq!(mailbox.take(), Some(7));
        assert!(!mailbox.cancelled().load(Ordering::Relaxed), "a new request begins anew");
        mailbox.put(7);
        mailbox.clear();
        assert!(!mailbox.has_newer());
        mailbox.put(3);
        mailbox.close();
        assert!(mailbox.has_newer(), "work in progress should stop");
        assert_eq!(mailbox.take(), None);
    }
}
