//! Frames one after the other, rendered ahead on a thread of their own.

use std::{
    ops::ControlFlow,
    sync::{
        Condvar, Mutex,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel},
    },
    thread,
    time::Duration,
};

use camsim::{cli::failure::Failure, core::scenario::Channel};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    engine::{SessionKey, SessionPool, lock},
    error::{panicked, raise},
    frame::Delivery,
};

/// Finished frames that wait for Python, beside those that the engine has in flight.
const WAITING: usize = 2;
/// How often Python looks for Ctrl-C while it waits.
const GLANCE: Duration = Duration::from_millis(50);

/// Whether the program ends, and the number of threads that render.
static ENDS: AtomicBool = AtomicBool::new(false);
static RENDERING: Mutex<usize> = Mutex::new(0);
static CHANGED: Condvar = Condvar::new();

/// Counts a thread that renders while it lives.
struct Rendering;

impl Rendering {
    fn begin() -> Self {
        *lock(&RENDERING) += 1;
        Self
    }
}

impl Drop for Rendering {
    fn drop(&mut self) {
        *lock(&RENDERING) -= 1;
        CHANGED.notify_all();
    }
}

/// Ends all streams and waits for their threads: drivers do not like to be unloaded while they render.
#[pyfunction]
pub fn stop_streams(py: Python<'_>) {
    ENDS.store(true, Ordering::SeqCst);
    py.detach(|| {
        let mut rendering = lock(&RENDERING);
        while *rendering > 0 {
            rendering = CHANGED.wait(rendering).unwrap_or_else(std::sync::PoisonError::into_inner);
        }
    });
}

/// Iterates over frames. Dropped early, it ends its thread after the frame under way.
#[pyclass(frozen, module = "camsim._camsim")]
#[derive(Debug)]
pub struct Stream {
    receiver: Mutex<Option<Receiver<Result<Delivery, Failure>>>>,
    channels: Vec<Channel>,
}

impl Stream {
    /// Begins to render `frames` in this order.
    pub fn begin(pool: SessionPool, key: SessionKey, frames: FrameNumbers) -> PyResult<Self> {
        let (sender, receiver) = sync_channel(WAITING);
        let channels = key.channels.clone();
        let counted = Rendering::begin();
        let work = move || {
            let _counted = counted;
            if let Err(failure) = render(&pool, &key, &frames, &sender) {
                // Without a receiver nobody wants to know.
                let _ = sender.send(Err(failure));
            }
        };
        thread::Builder::new().name("camsim-frames".into()).spawn(work)?;
        Ok(Self { receiver: Mutex::new(Some(receiver)), channels })
    }

    /// The next frame, looking out for Ctrl-C; `None` after the last.
    fn receive(&self, py: Python<'_>) -> PyResult<Option<Delivery>> {
        loop {
            let received = py.detach(|| {
                let receiver = lock(&self.receiver);
                receiver.as_ref().map(|receiver| receiver.recv_timeout(GLANCE))
            });
            match received {
                None | Some(Err(RecvTimeoutError::Disconnected)) => return Ok(None),
                Some(Ok(delivered)) => return delivered.map(Some).map_err(|failure| raise(&failure)),
                Some(Err(RecvTimeoutError::Timeout)) => py.check_signals()?,
            }
        }
    }
}

#[pymethods]
impl Stream {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let next = self.receive(py);
        if !matches!(next, Ok(Some(_))) {
            self.close(py);
        }
        next?.map(|delivery| delivery.into_dict(py, &self.channels)).transpose()
    }

    /// Ends the stream: no frame is rendered after those under way.
    fn close(&self, py: Python<'_>) {
        py.detach(|| *lock(&self.receiver) = None);
    }
}

/// Numbers of frames: `count` of them, from `first` on by `step`.
#[derive(Clone, Copy, Debug)]
pub struct FrameNumbers {
    pub first: u64,
    pub step: i64,
    pub count: u64,
}

impl FrameNumbers {
    fn iter(self) -> impl Iterator<Item = u64> {
        (0..self.count).map(move |k| self.first.wrapping_add_signed(self.step.wrapping_mul(k as i64)))
    }
}

fn render(
    pool: &SessionPool,
    key: &SessionKey,
    frames: &FrameNumbers,
    sender: &SyncSender<Result<Delivery, Failure>>,
) -> Result<(), Failure> {
    let sequence = &key.sequence;
    pool.with_opened(key, |opened| {
        opened.render(frames.iter(), &mut |finished| {
            let is_wanted =
                !ENDS.load(Ordering::SeqCst) && sender.send(Ok(Delivery::new(finished, sequence))).is_ok();
            if is_wanted { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        })
    })?
}

/// Renders one frame on this thread.
pub fn render_one(pool: &SessionPool, key: &SessionKey, frame: u64) -> PyResult<Delivery> {
    let _counted = Rendering::begin();
    let sequence = &key.sequence;
    let mut made = None;
    let rendered = pool.with_opened(key, |opened| {
        opened.render([frame].into_iter(), &mut |finished| {
            made = Some(Delivery::new(finished, sequence));
            ControlFlow::Continue(())
        })
    });
    rendered.and_then(|rendered| rendered).map_err(|failure| raise(&failure))?;
    made.ok_or_else(panicked)
}
