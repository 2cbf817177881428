//! How quick the window is while the engine works: measured, not asserted, since it depends on the machine and on what else it does.
//!
//! `cargo test --release -p camsim-viewer latency -- --ignored --nocapture`

use std::time::{Duration, Instant};

use toml::Value;

use super::harness::{Window, demo, shown};
use crate::{engine::Size, message::Message, timeline::Timeline};

const TIMES: usize = 20;

/// Passes (drawn on the device and read back, which is more than a window does) until something is so: how long, and how long each pass took.
fn passes_until(window: &mut Window, mut is_so: impl FnMut(&Window) -> bool) -> (Duration, Vec<Duration>) {
    let begun = Instant::now();
    let mut passes = Vec::new();
    while !is_so(window) {
        let pass = Instant::now();
        window.step();
        window.picture();
        passes.push(pass.elapsed());
        assert!(begun.elapsed() < Duration::from_secs(60), "never");
    }
    (begun.elapsed(), passes)
}

fn tell(what: &str, mut times: Vec<Duration>) {
    times.sort();
    let ms = |at: usize| 1e3 * times.get(at).copied().unwrap_or_default().as_secs_f64();
    let last = times.len().saturating_sub(1);
    eprintln!(
        "{what}: median {:.1} ms, 90 % within {:.1} ms, longest {:.1} ms, of {}",
        ms(last / 2),
        ms(last * 9 / 10),
        ms(last),
        times.len()
    );
}

fn send(window: &mut Window, message: Message) {
    let context = window.harness.ctx.clone();
    window.state_mut().apply(message, &context);
}

#[test]
#[ignore = "measures"]
fn latency() {
    let mut window = Window::with(Some(demo()), None, [1280.0, 800.0]);
    window.settle();
    window.picture();
    passes_alone(&mut window);
    dragged_timeline(&mut window);
    changed_lens(&mut window);
    passes_beside_full_frames(&mut window);
}

fn passes_alone(window: &mut Window) {
    let mut left = 60;
    let (_, passes) = passes_until(window, |_| {
        left -= 1;
        left == 0
    });
    tell("a pass with nothing else to do", passes);
}

fn dragged_timeline(window: &mut Window) {
    let dragged = Timeline { dragged: true, ..window.state().timeline.clone() };
    send(window, Message::Timeline(dragged));
    let mut latencies = Vec::new();
    for k in 0..TIMES as u64 {
        let frame = (37 * k + 11) % 120;
        send(window, Message::Seek(frame));
        let (latency, _) =
            passes_until(window, |window| window.state().heard.shown.as_ref().is_some_and(|shown| shown.reply.frame == frame));
        latencies.push(latency);
    }
    tell("dragged timeline until its preview is drawn", latencies);
    let rests = Timeline { dragged: false, ..window.state().timeline.clone() };
    send(window, Message::Timeline(rests));
    window.settle();
}

fn changed_lens(window: &mut Window) {
    let mut latencies = Vec::new();
    for k in 0..TIMES {
        let value = Value::Float(-0.22 + 0.002 * (k + 1) as f64);
        send(window, Message::Set("camera.lens.coefficients.0".into(), Some(value), true));
        let scenario = window.state().document.as_ref().expect("open").scenario.clone();
        let (latency, _) = passes_until(window, |window| shown(window.state()).is_some_and(|wanted| wanted.scenario == scenario));
        latencies.push(latency);
    }
    tell("changed lens coefficient until its preview is drawn", latencies);
    send(window, Message::EndGesture);
    window.settle();
}

fn passes_beside_full_frames(window: &mut Window) {
    let (mut passes, mut frames) = (Vec::new(), Vec::new());
    for k in 0..6_u64 {
        let frame = (17 * k + 5) % 120;
        send(window, Message::Seek(frame));
        let (took, of_frame) = passes_until(window, |window| {
            window.state().heard.shown.as_ref().is_some_and(|shown| shown.reply.frame == frame && shown.reply.wanted.size == Size::Full)
        });
        frames.push(took);
        passes.extend(of_frame);
    }
    tell("full frames, planned anew", frames);
    let mean_ms = 1e3 * passes.iter().sum::<Duration>().as_secs_f64() / passes.len().max(1) as f64;
    eprintln!("passes beside them: {:.1} a second", 1e3 / mean_ms);
    tell("passes beside them", passes);
}
