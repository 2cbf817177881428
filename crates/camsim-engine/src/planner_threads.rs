//! The threads that plan frames ahead.

use std::sync::OnceLock;

use rayon::{Scope, ThreadPool, ThreadPoolBuilder};

/// Niceness of planning threads beside a renderer on the same processor. With 5, Linux gives them a third of
/// the time of a normal thread.
#[cfg(target_os = "linux")]
const NICE: i32 = 5;

/// Runs `work` with a scope whose tasks plan. If frames are rendered on the same processor
/// (`shares_processor`), the tasks run on threads of low priority: every frame waits for its passes, while
/// plans are made ahead and can use the time in which a pass has one thread. A single frame, as in the
/// viewer, waits for its plan, which then has normal priority. Within a rayon pool the tasks run in that
/// pool.
pub(super) fn scope<'scope, R>(
    shares_processor: bool,
    is_single: bool,
    work: impl FnOnce(&Scope<'scope>) -> R,
) -> R {
    let is_low_priority = shares_processor && !is_single && rayon::current_thread_index().is_none();
    match is_low_priority.then(low_priority_pool).flatten() {
        Some(pool) => pool.in_place_scope(work),
        None => rayon::in_place_scope(work),
    }
}

/// The pool of all engines of the program; `None` if no threads can be created.
fn low_priority_pool() -> Option<&'static ThreadPool> {
    static POOL: OnceLock<Option<ThreadPool>> = OnceLock::new();
    let build = || {
        ThreadPoolBuilder::new()
            .thread_name(|i| format!("camsim-plan-{i}"))
            .start_handler(|_| lower_priority())
            .build()
            .ok()
    };
    POOL.get_or_init(build).as_ref()
}

/// Lowers the priority of this thread on Linux, where threads have their own. Errors are ignored: they only
/// cost time.
fn lower_priority() {
    #[cfg(target_os = "linux")]
    let _ = rustix::process::nice(NICE);
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::mpsc::channel;

    use super::*;

    /// Niceness of a thread of the scope relative to this thread.
    fn relative_niceness(shares_processor: bool, is_single: bool) -> i32 {
        let (sender, receiver) = channel();
        scope(shares_processor, is_single, |scope| {
            scope.spawn(move |_| sender.send(rustix::process::nice(0).unwrap()).unwrap())
        });
        receiver.recv().unwrap() - rustix::process::nice(0).unwrap()
    }

    #[test]
    fn planning_has_low_priority_beside_a_renderer_on_the_same_processor() {
        // Threads inherit the niceness of this one, and 19 is the largest.
        let expected = (19 - rustix::process::nice(0).unwrap()).min(NICE);
        assert_eq!(
            [relative_niceness(true, false), relative_niceness(true, true), relative_niceness(true, false)],
            [expected, 0, expected]
        );
        assert_eq!(relative_niceness(false, false), 0);
        let own = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(own.install(|| relative_niceness(true, false)), 0);
    }
}
