//! The threads that plan frames ahead.

use std::sync::OnceLock;

use rayon::{Scope, ThreadPool, ThreadPoolBuilder};

/// What a software adapter's planners are asked to leave to others: with 5, Linux gives them a third of what
/// a usual thread gets beside them.
#[cfg(target_os = "linux")]
const NICE: i32 = 5;

/// Runs `work` with a scope whose tasks plan. Where frames are rendered on the same processor
/// (`shares_processor`), they are threads of their own that stand back: every frame waits for the device's
/// passes, but plans are made ahead, and while a pass has one thread there is room for them. A single frame,
/// as the viewer asks for, waits for its plan: that goes first. Whoever calls from a pool of rayon's has the
/// work done there.
pub(super) fn scope<'scope, R>(
    shares_processor: bool,
    is_single: bool,
    work: impl FnOnce(&Scope<'scope>) -> R,
) -> R {
    let stands_back = shares_processor && !is_single && rayon::current_thread_index().is_none();
    match stands_back.then(of_low_priority).flatten() {
        Some(pool) => pool.in_place_scope(work),
        None => rayon::in_place_scope(work),
    }
}

/// One pool for all engines of the program; `None` where there are no threads to be had.
fn of_low_priority() -> Option<&'static ThreadPool> {
    static POOL: OnceLock<Option<ThreadPool>> = OnceLock::new();
    let build = || {
        ThreadPoolBuilder::new()
            .thread_name(|i| format!("camsim-plan-{i}"))
            .start_handler(|_| stand_back())
            .build()
            .ok()
    };
    POOL.get_or_init(build).as_ref()
}

/// On Linux each thread has a priority of its own. That it may not be changed costs a little time and nothing
/// else.
fn stand_back() {
    #[cfg(target_os = "linux")]
    let _ = rustix::process::nice(NICE);
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::mpsc::channel;

    use super::*;
    /// Priority of the thread that a task of the scope runs on, above that of this one.
    fn above(shares_processor: bool, is_single: bool) -> i32 {
        let (give, given) = channel();
        scope(shares_processor, is_single, |scope| {
            scope.spawn(move |_| give.send(rustix::process::nice(0).unwrap()).unwrap())
        });
        given.recv().unwrap() - rustix::process::nice(0).unwrap()
    }

    #[test]
    fn plans_of_several_frames_stand_back_where_frames_are_rendered_on_the_same_processor() {
        // Threads inherit the priority of the one that starts them, which may have little left to give up.
        let most = (19 - rustix::process::nice(0).unwrap()).min(NICE);
        assert_eq!([above(true, false), above(true, true), above(true, false)], [most, 0, most]);
        assert_eq!(above(false, false), 0);
        let own = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(own.install(|| above(true, false)), 0);
    }
}
