//! The renderers of this process, and sessions that wait for their next frames.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use camsim::{
    cli::failure::Failure,
    core::{scenario::Channel, sequence::Sequence},
    engine::{Backend, Engine, Session},
    prelude::NoError,
};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Sessions that a scenario keeps for its next frames: that of a stream, and one for single frames.
const MOST_IDLE: usize = 2;

/// Renderers that Python knows.
const BACKENDS: [Backend; 3] = [Backend::Auto, Backend::Cpu, Backend::Gpu];

/// A renderer by its name in Python.
pub fn backend(name: &str) -> Option<Backend> {
    BACKENDS.into_iter().find(|backend| backend_name(*backend) == name)
}

/// The name of a renderer in Python.
pub fn backend_name(backend: Backend) -> &'static str {
    match backend {
        Backend::Auto => "auto",
        Backend::Cpu => "cpu",
        Backend::Gpu | Backend::GpuThenCpu => "gpu",
    }
}

/// Why this process cannot render.
#[derive(Debug)]
struct Forked;

impl std::fmt::Display for Forked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(
            "this process was forked from one that had rendered, and threads and graphics adapters do not live on in \
             a fork: start workers by multiprocessing.get_context(\"spawn\"), or render nothing before they start",
        )
    }
}

impl std::error::Error for Forked {}

/// The renderer of a name, opened at its first use and kept until the process ends.
///
/// # Errors
/// There is no such adapter, or this process is a fork of one that has rendered.
pub fn engine(backend: Backend) -> Result<&'static Engine, Failure> {
    static OWNER: OnceLock<u32> = OnceLock::new();
    static ENGINES: Mutex<Vec<(Backend, &'static Engine)>> = Mutex::new(Vec::new());
    if *OWNER.get_or_init(std::process::id) != std::process::id() {
        return Err(Failure::failed(Forked));
    }
    let mut engines = lock(&ENGINES);
    if let Some((_, engine)) = engines.iter().find(|(known, _)| *known == backend) {
        return Ok(engine);
    }
    let engine: &'static Engine = Box::leak(Box::new(Engine::open(backend)?));
    engines.push((backend, engine));
    Ok(engine)
}

/// Runs work on threads that a fork does not inherit: each process has its own. Loading uses them, so that a
/// scenario that is loaded may be taken along into a fork.
pub fn in_own_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static POOL: Mutex<Option<(u32, &'static ThreadPool)>> = Mutex::new(None);
    let mut held = lock(&POOL);
    let pool = match *held {
        Some((owner, pool)) if owner == std::process::id() => Some(pool),
        _ => ThreadPoolBuilder::new().build().ok().map(|pool| &*Box::leak(Box::new(pool))),
    };
    *held = pool.map(|pool| (std::process::id(), pool));
    drop(held);
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// A session with what it was opened for.
#[derive(Debug)]
struct Idle {
    session: Session<'static>,
    backend: Backend,
    sequence: Arc<Sequence>,
    channels: Vec<Channel>,
}

/// Sessions of a scenario that no stream uses. Their scene is uploaded, and their caches are filled.
#[derive(Clone, Debug, Default)]
pub struct SessionPool(Arc<Mutex<Vec<Idle>>>);

/// What to render by.
#[derive(Clone, Debug)]
pub struct SessionKey {
    pub backend: Backend,
    pub sequence: Arc<Sequence>,
    pub channels: Vec<Channel>,
}

impl SessionPool {
    /// Lends a session to `work`, and keeps it for the next.
    ///
    /// # Errors
    /// The adapter cannot be opened, or the scene does not fit it.
    pub fn with_session<T>(
        &self,
        key: &SessionKey,
        work: impl FnOnce(&mut Session<'static>) -> T,
    ) -> Result<T, Failure> {
        let engine = engine(key.backend)?;
        let waiting = {
            let mut idle = lock(&self.0);
            let position = idle.iter().position(|idle| idle.backend == key.backend);
            position.map(|position| idle.swap_remove(position))
        };
        let SessionKey { backend, sequence, channels } = key.clone();
        let mut session = match waiting {
            None => engine.session::<NoError>(sequence.clone(), &channels)?,
            Some(mut idle) => {
                if !Arc::ptr_eq(&idle.sequence, &sequence) || idle.channels != channels {
                    idle.session.renew::<NoError>(sequence.clone(), &channels)?;
                }
                idle.session
            }
        };
        let made = work(&mut session);
        let mut idle = lock(&self.0);
        idle.push(Idle { session, backend, sequence, channels });
        let surplus = idle.len().saturating_sub(MOST_IDLE);
        idle.drain(..surplus);
        Ok(made)
    }
}

/// Locks what stays whole if a thread panics.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
