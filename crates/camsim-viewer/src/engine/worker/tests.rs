use std::{
    sync::{
        Mutex,
        atomic::{AtomicU32, Ordering},
        mpsc::{Receiver, channel},
    },
    time::Duration,
};

use camsim_io::scenario_file::read_scenario;

use super::*;
use crate::tests::harness::pattern;

/// Longest wait for a reply; debug builds are slow.
const TIMEOUT: Duration = Duration::from_secs(120);

fn request(frame: u64) -> FrameRequest {
    let scenario = Arc::new(read_scenario(&pattern(), &[], None).expect("legal"));
    FrameRequest {
        scenario,
        reload_count: 0,
        frame,
        stages: vec![Stage::Photometric],
        size: Size::Preview,
        depth: false,
        raw: false,
        histogram: false,
        errors: false,
        gain: None,
    }
}

/// The next frame, with the faults reported before it.
fn next_frame(replies: &Receiver<Reply>) -> (FrameReply, Vec<String>) {
    let mut faults = Vec::new();
    loop {
        match replies.recv_timeout(TIMEOUT).expect("a reply") {
            Reply::Frame(reply) => return (*reply, faults),
            Reply::Failed(fault) => faults.push(fault),
            _ => {}
        }
    }
}

/// Runs a worker thread on the engines of `open`, and `test` with its mailbox and replies.
fn with_worker(
    open: impl Fn() -> Result<Engine, GpuError> + Sync,
    test: impl FnOnce(&Mailbox<FrameRequest>, &Receiver<Reply>),
) {
    let (sender, replies) = channel();
    let reply_sender = ReplySender { sender, repaint: Arc::new(|| {}) };
    let (mailbox, scenarios) = (Mailbox::default(), ScenarioCache::default());
    std::thread::scope(|scope| {
        // Closes the mailbox also if the test panics; otherwise the scope would wait for ever.
        struct CloseOnDrop<'a>(&'a Mailbox<FrameRequest>);
        impl Drop for CloseOnDrop<'_> {
            fn drop(&mut self) {
                self.0.close();
            }
        }
        let guard = CloseOnDrop(&mailbox);
        scope.spawn({
            let (mailbox, scenarios, open) = (&mailbox, &scenarios, &open);
            move || run_on(open, mailbox, scenarios, &reply_sender)
        });
        test(guard.0, &replies);
    });
}

/// Opens engines of which the first `lost` have a destroyed device; counts them in `opened`.
fn with_lost_devices(lost: u32, opened: &AtomicU32) -> impl Fn() -> Result<Engine, GpuError> + Sync {
    move || {
        let engine = Engine::open(Backend::Gpu)?;
        if opened.fetch_add(1, Ordering::Relaxed) < lost {
            engine.gpu().expect("an adapter").device.destroy();
        }
        Ok(engine)
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_lost_device_is_reported_and_opened_anew_and_the_frame_rendered() {
    let devices = Mutex::new(Vec::new());
    let open = || {
        let engine = Engine::open(Backend::Gpu)?;
        devices.lock().expect("one at a time").push(engine.gpu().expect("an adapter").device.clone());
        Ok(engine)
    };
    with_worker(open, |mailbox, replies| {
        mailbox.put(request(0));
        let (before, faults) = next_frame(replies);
        assert!(faults.is_empty(), "{faults:?}");
        devices.lock().expect("one at a time")[0].destroy();
        mailbox.put(request(1));
        let (other, faults) = next_frame(replies);
        assert_eq!((other.frame, faults.len()), (1, 1), "{faults:?}");
        assert!(faults[0].contains("lost"), "{faults:?}");
        assert_eq!(devices.lock().expect("one at a time").len(), 2, "opened anew");
        mailbox.put(request(0));
        let (after, _) = next_frame(replies);
        assert_eq!(
            after.pictures[0].frame.color_rgba(),
            before.pictures[0].frame.color_rgba(),
            "the same picture as before the loss"
        );
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_device_lost_during_session_setup_is_reported_and_the_frame_rendered_on_another() {
    let opened = AtomicU32::new(0);
    with_worker(with_lost_devices(1, &opened), |mailbox, replies| {
        mailbox.put(request(1));
        let (reply, faults) = next_frame(replies);
        assert_eq!((reply.frame, opened.load(Ordering::Relaxed), faults.len()), (1, 2, 1), "{faults:?}");
        match replies.recv_timeout(TIMEOUT).expect("a notice") {
            Reply::Notice(text) => assert!(text.contains("lost"), "{text}"),
            other => panic!("{other:?}"),
        }
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_frame_that_loses_every_device_is_tried_twice_and_the_thread_continues() {
    let opened = AtomicU32::new(0);
    with_worker(with_lost_devices(2, &opened), |mailbox, replies| {
        mailbox.put(request(0));
        let mut faults = 0;
        while faults < 2 {
            match replies.recv_timeout(TIMEOUT).expect("a reply") {
                Reply::Failed(_) => faults += 1,
                Reply::Frame(reply) => panic!("rendered on a lost device: {reply:?}"),
                _ => {}
            }
        }
        mailbox.put(request(1));
        let (reply, more) = next_frame(replies);
        assert_eq!((reply.frame, more.len(), opened.load(Ordering::Relaxed)), (1, 0, 3), "{more:?}");
    });
}

#[test]
fn without_an_adapter_every_request_reports_the_missing_driver() {
    let open = || Err(GpuError::NoAdapter(String::new()));
    with_worker(open, |mailbox, replies| {
        for frame in 0..2 {
            mailbox.put(request(frame));
            match replies.recv_timeout(TIMEOUT).expect("a reply") {
                Reply::Failed(fault) => assert!(fault.contains("Vulkan"), "{fault}"),
                other => panic!("{other:?}"),
            }
        }
    });
}
