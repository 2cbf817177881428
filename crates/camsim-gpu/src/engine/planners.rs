//! The threads that plan frames ahead.

use std::sync::OnceLock;

use rayon::{Scope, ThreadPool, ThreadPoolBuilder};

use crate::context::GpuContext;

/// What a software adapter's planners are asked to leave to others: with 5, Linux gives them a third of what a usual thread gets beside them.
#[cfg(target_os = "linux")]
const NICE: i32 = 5;

/// Runs `work` with a scope whose tasks plan. Where the device is the same processor, they are threads of their own that stand back: every frame waits for the device's
/// passes, but plans are made ahead, and while a pass has one thread there is room for them. Whoever calls from a pool of rayon's has the work done there.
pub(super) fn scope<'scope, R>(gpu: &GpuContext, work: impl FnOnce(&Scope<'scope>) -> R) -> R {
    let stands_back = gpu.is_software && rayon::current_thread_index().is_none();
    match stands_back.then(of_low_priority).flatten() {
        Some(pool) => pool.in_place_scope(work),
        None => rayon::in_place_scope(work),
    }
}

/// One pool for all engines of the program; `None` where there are no threads to be had.
fn of_low_priority() -> Option<&'static ThreadPool> {
    static POOL: OnceLock<Option<ThreadPool>> = OnceLock::new();
    let build = || ThreadPoolBuilder::new().thread_name(|i| format!("camsim-plan-{i}")).start_handler(|_| stand_back()).build().ok();
    POOL.get_or_init(build).as_ref()
}

/// On Linux each thread has a priority of its own. That it may not be changed costs a little time and nothing else.
fn stand_back() {
    #[cfg(target_os = "linux")]
    let _ = rustix::process::nice(NICE);
}
