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

/// Debug builds on busy processors are slow.
const PATIENCE: Duration = Duration::from_secs(120);

fn wanted(frame: u64) -> Wanted {
    let scenario = Arc::new(read_scenario(&pattern(), &[], None).expect("legal"));
    Wanted {
        scenario,
        reading: 0,
        frame,
        stages: vec![Stage::Photometric],
        size: Size::Preview,
        truth: false,
        errors: false,
        gain: None,
    }
}

/// The next picture, with the faults that were told before it.
fn next(replies: &Receiver<Reply>) -> (FrameReply, Vec<String>) {
    let mut faults = Vec::new();
    loop {
        match replies.recv_timeout(PATIENCE).expect("a reply") {
            Reply::Frame(reply) => return (*reply, faults),
            Reply::Failed(fault) => faults.push(fault),
            _ => {}
        }
    }
}

/// A worker's thread on `open`, and what a window has of it.
fn with_worker(
    open: impl Fn() -> Result<Engine, GpuError> + Sync,
    test: impl FnOnce(&Mailbox<Wanted>, &Receiver<Reply>),
) {
    let (sender, replies) = channel();
    let speaker = Speaker { replies: sender, repaint: Arc::new(|| {}) };
    let (mailbox, library) = (Mailbox::default(), Library::default());
    std::thread::scope(|scope| {
        // Closed also where the test ends by a panic, or the scope would wait for ever.
        struct Closing<'a>(&'a Mailbox<Wanted>);
        impl Drop for Closing<'_> {
            fn drop(&mut self) {
                self.0.close();
            }
        }
        let closing = Closing(&mailbox);
        let voice = speaker;
        scope.spawn({
            let (mailbox, library, open) = (&mailbox, &library, &open);
            move || run_on(open, mailbox, library, &voice)
        });
        test(closing.0, &replies);
    });
}

/// Devices of which the first so many are lost before anything is made on them; counts them.
fn losing(first: u32, opened: &AtomicU32) -> impl Fn() -> Result<Engine, GpuError> + Sync {
    move || {
        let engine = Engine::open(Backend::Gpu)?;
        if opened.fetch_add(1, Ordering::Relaxed) < first {
            engine.gpu().expect("an adapter").device.destroy();
        }
        Ok(engine)
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_lost_device_is_told_and_opened_anew_and_the_picture_comes() {
    let devices = Mutex::new(Vec::new());
    let open = || {
        let engine = Engine::open(Backend::Gpu)?;
        devices.lock().expect("one at a time").push(engine.gpu().expect("an adapter").device.clone());
        Ok(engine)
    };
    with_worker(open, |mailbox, replies| {
        mailbox.put(wanted(0));
        let (before, faults) = next(replies);
        assert!(faults.is_empty(), "{faults:?}");
        devices.lock().expect("one at a time")[0].destroy();
        mailbox.put(wanted(1));
        let (other, faults) = next(replies);
        assert_eq!((other.frame, faults.len()), (1, 1), "{faults:?}");
        assert!(faults[0].contains("lost"), "{faults:?}");
        assert_eq!(devices.lock().expect("one at a time").len(), 2, "opened anew");
        mailbox.put(wanted(0));
        let (after, _) = next(replies);
        assert_eq!(
            after.pictures[0].frame.color_rgba, before.pictures[0].frame.color_rgba,
            "the same picture as before the loss"
        );
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_device_that_is_lost_while_its_session_is_made_is_told_and_the_frame_comes_from_another() {
    let opened = AtomicU32::new(0);
    with_worker(losing(1, &opened), |mailbox, replies| {
        mailbox.put(wanted(1));
        let (reply, faults) = next(replies);
        assert_eq!((reply.frame, opened.load(Ordering::Relaxed), faults.len()), (1, 2, 1), "{faults:?}");
        match replies.recv_timeout(PATIENCE).expect("a word about it") {
            Reply::Told(text) => assert!(text.contains("lost"), "{text}"),
            other => panic!("{other:?}"),
        }
    });
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_frame_that_loses_every_device_is_tried_twice_and_the_thread_goes_on() {
    let opened = AtomicU32::new(0);
    with_worker(losing(2, &opened), |mailbox, replies| {
        mailbox.put(wanted(0));
        let mut faults = 0;
        while faults < 2 {
            match replies.recv_timeout(PATIENCE).expect("a reply") {
                Reply::Failed(_) => faults += 1,
                Reply::Frame(reply) => panic!("from no device: {reply:?}"),
                _ => {}
            }
        }
        mailbox.put(wanted(1));
        let (reply, more) = next(replies);
        assert_eq!((reply.frame, more.len(), opened.load(Ordering::Relaxed)), (1, 0, 3), "{more:?}");
    });
}

#[test]
fn without_an_adapter_every_request_is_told_what_is_missing() {
    let open = || Err(GpuError::NoAdapter(String::new()));
    with_worker(open, |mailbox, replies| {
        for frame in 0..2 {
            mailbox.put(wanted(frame));
            match replies.recv_timeout(PATIENCE).expect("a reply") {
                Reply::Failed(fault) => assert!(fault.contains("Vulkan"), "{fault}"),
                other => panic!("{other:?}"),
            }
        }
    });
}
