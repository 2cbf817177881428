//! Works series out beside the window: of hours of flight they take a good fraction of a second, and while a
//! parameter is dragged each preview wants others.

use std::sync::{
    Arc,
    mpsc::{Receiver, TryRecvError, channel},
};

use camsim_io::load::Loaded;
use eframe::egui::Context;

use super::Series;

/// Who sees less than this share of a span is shown it closer.
const LEAST_SEEN: f64 = 0.5;
/// A part that is worked out closer reaches so far beyond what is seen, to either side, as a share of that:
/// for the hand that moves on.
const BEYOND: f64 = 0.5;
/// ... and is enough as long as this share of it is seen.
const LEAST_OF_CLOSER: f64 = 0.25;

/// The last series, and what is being worked out: never more than one.
#[derive(Debug, Default)]
pub struct Desk {
    whole: Option<Arc<Series>>,
    closer: Option<Arc<Series>>,
    coming: Option<Receiver<Series>>,
}

impl Desk {
    /// The series of what is loaded, closer where only a part of it is seen (path time). Until they are
    /// there: coarser ones, or those of the same log before the last change, `None` without any. Asks for a
    /// repaint when there are others.
    pub fn series(
        &mut self,
        loaded: &Arc<Loaded>,
        seen_s: Option<[f64; 2]>,
        context: &Context,
    ) -> Option<Arc<Series>> {
        match self.coming.as_ref().map(Receiver::try_recv) {
            Some(Ok(series)) => {
                let place = if series.closer_s.is_some() { &mut self.closer } else { &mut self.whole };
                *place = Some(Arc::new(series));
                self.coming = None;
            }
            Some(Err(TryRecvError::Disconnected)) => self.coming = None,
            Some(Err(TryRecvError::Empty)) | None => {}
        }
        let whole = self.whole.as_ref().filter(|series| series.is_of(loaded));
        let closer = self.closer.as_ref().filter(|series| series.is_of(loaded));
        let part_s = whole.zip(seen_s).and_then(|(whole, seen_s)| part_to_show(whole.span_s, seen_s));
        let is_close = |part_s: [f64; 2]| {
            closer.and_then(|series| series.closer_s).is_some_and(|known_s| is_enough(known_s, part_s))
        };
        if self.coming.is_none() {
            let work: Option<Box<dyn FnOnce() -> Series + Send>> = match (whole, part_s) {
                (None, _) => {
                    let loaded = loaded.clone();
                    Some(Box::new(move || Series::new(&loaded)))
                }
                (Some(whole), Some(part_s)) if !is_close(part_s) => {
                    let (whole, loaded) = (whole.clone(), loaded.clone());
                    Some(Box::new(move || whole.closer(&loaded, with_margin(whole.span_s, part_s))))
                }
                _ => None,
            };
            self.coming = work.map(|work| begin(work, context.clone()));
        }
        // Also one of another part shows where it is not of it what the whole one does.
        let best = closer.filter(|_| part_s.is_some()).or(whole);
        best.or(self.whole.as_ref().filter(|series| series.is_of_log(loaded))).cloned()
    }
}

/// What is seen of a span, if that is so little that there should be more of it.
fn part_to_show(span_s: [f64; 2], seen_s: [f64; 2]) -> Option<[f64; 2]> {
    let part_s = [seen_s[0].max(span_s[0]), seen_s[1].min(span_s[1])];
    let is_little = seen_s[1] - seen_s[0] < LEAST_SEEN * (span_s[1] - span_s[0]);
    (is_little && part_s[0] < part_s[1]).then_some(part_s)
}

fn with_margin(span_s: [f64; 2], part_s: [f64; 2]) -> [f64; 2] {
    let margin_s = BEYOND * (part_s[1] - part_s[0]);
    [(part_s[0] - margin_s).max(span_s[0]), (part_s[1] + margin_s).min(span_s[1])]
}

fn is_enough(known_s: [f64; 2], part_s: [f64; 2]) -> bool {
    known_s[0] <= part_s[0]
        && known_s[1] >= part_s[1]
        && part_s[1] - part_s[0] >= LEAST_OF_CLOSER * (known_s[1] - known_s[0])
}

fn begin(work: impl FnOnce() -> Series + Send + 'static, context: Context) -> Receiver<Series> {
    let (sender, coming) = channel();
    let work = move || {
        // The window may be gone by then.
        let _ = sender.send(work());
        context.request_repaint();
    };
    // Without a thread the sender is gone: the next pass tries again.
    let _ = std::thread::Builder::new().name("camsim series".into()).spawn(work);
    coming
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_enough_until_the_hand_leaves_it_or_goes_much_closer() {
        let span_s = [100.0, 36_100.0];
        assert_eq!(part_to_show(span_s, [50.0, 20_000.0]), None, "nearly all of it");
        assert_eq!(part_to_show(span_s, [0.0, 90.0]), None, "beside it");
        assert_eq!(part_to_show(span_s, [98.0, 102.0]), Some([100.0, 102.0]), "over its end");
        let part_s = part_to_show(span_s, [5_000.0, 5_002.0]).expect("little");
        let known_s = with_margin(span_s, part_s);
        assert_eq!(known_s, [4_999.0, 5_003.0]);
        for (seen_s, enough) in [
            ([5_000.5, 5_002.5], true),
            ([5_001.5, 5_003.5], false),
            ([5_000.0, 5_001.0], true),
            ([5_000.0, 5_000.5], false),
        ] {
            assert_eq!(is_enough(known_s, seen_s), enough, "{seen_s:?}");
        }
        assert_eq!(with_margin(span_s, [100.0, 102.0]), [100.0, 103.0]);
    }
}
