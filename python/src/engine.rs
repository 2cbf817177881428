//! The renderers of this process, and sessions that wait for their next frames.

use std::{
    fmt,
    ops::ControlFlow,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
};

use camsim::{
    cli::{
        failure::Failure,
        frame_source::{FrameSource, ReferenceSource, is_reference},
    },
    core::{scenario::Channel, sequence::Sequence},
    engine::{Backend, Engine, Finished, RenderError, Session},
    prelude::NoError,
};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Sessions that a scenario keeps for its next frames: that of a stream, and one for single frames.
const MOST_IDLE: usize = 2;

/// What renders frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Renderer {
    /// The engine.
    Engine(Backend),
    /// The reference renderer.
    Reference,
}

impl Renderer {
    const ALL: [Self; 4] = [
        Self::Engine(Backend::Auto),
        Self::Engine(Backend::Cpu),
        Self::Engine(Backend::Gpu),
        Self::Reference,
    ];

    /// A renderer by its name in Python.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|renderer| renderer.name() == name)
    }

    /// Its name in Python.
    pub fn name(self) -> &'static str {
        match self {
            Self::Engine(Backend::Auto) => "auto",
            Self::Engine(Backend::Cpu) => "cpu",
            Self::Engine(Backend::Gpu | Backend::GpuThenCpu) => "gpu",
            Self::Reference => "reference",
        }
    }

    /// The engine on its adapter, for what the reference renderer has no answer to: its own plans and errors.
    ///
    /// # Errors
    /// The adapter cannot be opened, or this process is a fork of one that has rendered.
    pub fn engine(self) -> Result<&'static Engine, Failure> {
        refuse_fork()?;
        match self {
            Self::Engine(backend) => engine(backend),
            Self::Reference => engine(Backend::Auto),
        }
    }

    /// The renderer of a sequence, if this one was asked for.
    pub fn of_sequence(self, sequence: &Sequence) -> Self {
        match self {
            Self::Engine(Backend::Auto) if is_reference(&sequence.scenario) => Self::Reference,
            _ => self,
        }
    }
}

/// Why this process cannot render.
#[derive(Debug)]
struct Forked;

impl fmt::Display for Forked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "this process was forked from one that had rendered, and threads and graphics adapters do not live on in \
             a fork: start workers by multiprocessing.get_context(\"spawn\"), or render nothing before they start",
        )
    }
}

impl std::error::Error for Forked {}

/// Refuses a fork of a process that has rendered.
fn refuse_fork() -> Result<(), Failure> {
    static OWNER: OnceLock<u32> = OnceLock::new();
    if *OWNER.get_or_init(std::process::id) == std::process::id() {
        Ok(())
    } else {
        Err(Failure::failed(Forked))
    }
}

/// The engine on an adapter, opened at its first use and kept until the process ends.
fn engine(backend: Backend) -> Result<&'static Engine, Failure> {
    static ENGINES: Mutex<Vec<(Backend, &'static Engine)>> = Mutex::new(Vec::new());
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

/// Nobody wants the next frame.
#[derive(Debug)]
struct Unwanted;

impl fmt::Display for Unwanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("no more frames are wanted")
    }
}

impl std::error::Error for Unwanted {}

/// Receives finished frames in order, and says whether more are wanted.
pub type OnFrame<'f> = dyn FnMut(Finished) -> ControlFlow<()> + 'f;

/// A renderer with the scene of a sequence.
#[derive(Debug)]
pub enum Opened {
    Engine(Box<Session<'static>>),
    Reference(Box<ReferenceSource>),
}

impl Opened {
    fn new(key: &SessionKey) -> Result<Self, Failure> {
        Ok(match key.renderer {
            Renderer::Engine(backend) => {
                let engine = engine(backend)?;
                let session = engine.session::<NoError>(key.sequence.clone(), &key.channels)?;
                Self::Engine(Box::new(session))
            }
            Renderer::Reference => Self::Reference(Box::new(ReferenceSource::new(&key.planned())?)),
        })
    }

    /// Turns to another sequence.
    fn renew(&mut self, key: &SessionKey) -> Result<(), Failure> {
        match self {
            Self::Engine(session) => Ok(session.renew::<NoError>(key.sequence.clone(), &key.channels)?),
            Self::Reference(source) => source.renew(&key.planned()),
        }
    }

    /// Renders frames in the given order.
    ///
    /// # Errors
    /// A frame cannot be planned or rendered.
    pub fn render(
        &mut self,
        frames: impl Iterator<Item = u64>,
        on_frame: &mut OnFrame<'_>,
    ) -> Result<(), Failure> {
        match self {
            Self::Engine(session) => {
                let rendered = session.render(frames, &mut |finished| match on_frame(finished) {
                    ControlFlow::Continue(()) => Ok(()),
                    ControlFlow::Break(()) => Err(Unwanted),
                });
                match rendered {
                    Ok(()) | Err(RenderError::Sink(Unwanted)) => Ok(()),
                    Err(fault) => Err(fault.into()),
                }
            }
            Self::Reference(source) => {
                let mut flow = ControlFlow::Continue(());
                for frame in frames {
                    source.render(&[frame], &mut |finished| {
                        flow = on_frame(finished);
                        Ok(())
                    })?;
                    if flow.is_break() {
                        break;
                    }
                }
                Ok(())
            }
        }
    }
}

/// What waits for its next frames, with what it was opened for.
#[derive(Debug)]
struct Idle {
    opened: Opened,
    key: SessionKey,
}

/// Renderers of a scenario that no stream uses. Their scene is uploaded, and their caches are filled.
#[derive(Clone, Debug, Default)]
pub struct SessionPool(Arc<Mutex<Vec<Idle>>>);

/// What to render by.
#[derive(Clone, Debug)]
pub struct SessionKey {
    pub renderer: Renderer,
    pub sequence: Arc<Sequence>,
    pub channels: Vec<Channel>,
}

impl SessionKey {
    /// The sequence with the channels among its keys, from which the reference renderer takes them.
    fn planned(&self) -> Arc<Sequence> {
        if self.sequence.scenario.output.channels == self.channels {
            return self.sequence.clone();
        }
        let mut sequence = Sequence::clone(&self.sequence);
        sequence.scenario.output.channels.clone_from(&self.channels);
        Arc::new(sequence)
    }
}

impl SessionPool {
    /// Lends a renderer to `work`, and keeps it for the next.
    ///
    /// # Errors
    /// The adapter cannot be opened, or the scene does not fit it, or this process is a fork of one that has
    /// rendered.
    pub fn with_opened<T>(
        &self,
        key: &SessionKey,
        work: impl FnOnce(&mut Opened) -> T,
    ) -> Result<T, Failure> {
        refuse_fork()?;
        let waiting = {
            let mut idle = lock(&self.0);
            let position = idle.iter().position(|idle| idle.key.renderer == key.renderer);
            position.map(|position| idle.swap_remove(position))
        };
        let mut opened = match waiting {
            None => Opened::new(key)?,
            Some(mut idle) => {
                if !Arc::ptr_eq(&idle.key.sequence, &key.sequence) || idle.key.channels != key.channels {
                    idle.opened.renew(key)?;
                }
                idle.opened
            }
        };
        let made = work(&mut opened);
        let mut idle = lock(&self.0);
        idle.push(Idle { opened, key: key.clone() });
        let surplus = idle.len().saturating_sub(MOST_IDLE);
        idle.drain(..surplus);
        Ok(made)
    }
}

/// Locks what stays whole if a thread panics.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
