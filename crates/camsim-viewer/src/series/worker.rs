//! Computes series on a thread of its own: for hours of flight that takes a good fraction of a second, and
//! every preview during the drag of a parameter needs new ones.

use std::sync::{
    Arc,
    mpsc::{Receiver, TryRecvError, channel},
};

use camsim_io::load::Loaded;
use eframe::egui::Context;

use super::Series;

/// Plots that show less than this fraction of the flight get a refined series.
const DETAIL_BELOW_SHARE: f64 = 0.5;
/// Margin of a refined span to either side, as a fraction of the visible span, so that panning finds it ready.
const MARGIN_SHARE: f64 = 0.5;
/// A refined span is computed anew when less than this fraction of it is visible.
const MIN_DETAIL_SHARE: f64 = 0.25;

/// The last series, and at most one computation in progress.
#[derive(Debug, Default)]
pub struct SeriesWorker {
    whole: Option<Arc<Series>>,
    refined: Option<Arc<Series>>,
    pending: Option<Receiver<Series>>,
}

impl SeriesWorker {
    /// The best series available for `loaded`, and starts the computation of a better one: refined where only
    /// a part of the flight is visible (path time). Until that is done it gives a coarser series or one of
    /// the same log with other parameters; `None` without any. A repaint is requested when the computation
    /// ends.
    pub fn series(
        &mut self,
        loaded: &Arc<Loaded>,
        visible_s: Option<[f64; 2]>,
        context: &Context,
    ) -> Option<Arc<Series>> {
        match self.pending.as_ref().map(Receiver::try_recv) {
            Some(Ok(series)) => {
                let slot = if series.refined_s.is_some() { &mut self.refined } else { &mut self.whole };
                *slot = Some(Arc::new(series));
                self.pending = None;
            }
            Some(Err(TryRecvError::Disconnected)) => self.pending = None,
            Some(Err(TryRecvError::Empty)) | None => {}
        }
        let whole = self.whole.as_ref().filter(|series| series.belongs_to(loaded));
        let refined = self.refined.as_ref().filter(|series| series.belongs_to(loaded));
        let detail_s =
            whole.zip(visible_s).and_then(|(whole, visible_s)| detail_span(whole.span_s, visible_s));
        let is_refined = |detail_s: [f64; 2]| {
            refined.and_then(|series| series.refined_s).is_some_and(|refined_s| covers(refined_s, detail_s))
        };
        if self.pending.is_none() {
            let work: Option<Box<dyn FnOnce() -> Series + Send>> = match (whole, detail_s) {
                (None, _) => {
                    let loaded = loaded.clone();
                    Some(Box::new(move || Series::new(&loaded)))
                }
                (Some(whole), Some(detail_s)) if !is_refined(detail_s) => {
                    let (whole, loaded) = (whole.clone(), loaded.clone());
                    Some(Box::new(move || whole.refined(&loaded, with_margin(whole.span_s, detail_s))))
                }
                _ => None,
            };
            self.pending = work.map(|work| spawn(work, context.clone()));
        }
        // A series refined elsewhere equals the whole one outside its refined span.
        let best = refined.filter(|_| detail_s.is_some()).or(whole);
        best.or(self.whole.as_ref().filter(|series| series.belongs_to_log(loaded))).cloned()
    }
}

/// The visible part of a span, if it is small enough for a refined series.
fn detail_span(span_s: [f64; 2], visible_s: [f64; 2]) -> Option<[f64; 2]> {
    let detail_s = [visible_s[0].max(span_s[0]), visible_s[1].min(span_s[1])];
    let is_small = visible_s[1] - visible_s[0] < DETAIL_BELOW_SHARE * (span_s[1] - span_s[0]);
    (is_small && detail_s[0] < detail_s[1]).then_some(detail_s)
}

fn with_margin(span_s: [f64; 2], detail_s: [f64; 2]) -> [f64; 2] {
    let margin_s = MARGIN_SHARE * (detail_s[1] - detail_s[0]);
    [(detail_s[0] - margin_s).max(span_s[0]), (detail_s[1] + margin_s).min(span_s[1])]
}

/// Whether a refined span contains the visible one at sufficient resolution.
fn covers(refined_s: [f64; 2], detail_s: [f64; 2]) -> bool {
    refined_s[0] <= detail_s[0]
        && refined_s[1] >= detail_s[1]
        && detail_s[1] - detail_s[0] >= MIN_DETAIL_SHARE * (refined_s[1] - refined_s[0])
}

fn spawn(work: impl FnOnce() -> Series + Send + 'static, context: Context) -> Receiver<Series> {
    let (sender, pending) = channel();
    let work = move || {
        // The window may have been closed.
        let _ = sender.send(work());
        context.request_repaint();
    };
    // If no thread can be started, the sender is dropped and the next pass tries again.
    let _ = std::thread::Builder::new().name("camsim series".into()).spawn(work);
    pending
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refined_span_covers_until_panned_out_of_or_zoomed_far_into() {
        let span_s = [100.0, 36_100.0];
        assert_eq!(detail_span(span_s, [50.0, 20_000.0]), None, "more than half");
        assert_eq!(detail_span(span_s, [0.0, 90.0]), None, "outside");
        assert_eq!(detail_span(span_s, [98.0, 102.0]), Some([100.0, 102.0]), "across the beginning");
        let detail_s = detail_span(span_s, [5_000.0, 5_002.0]).expect("a small part");
        let refined_s = with_margin(span_s, detail_s);
        assert_eq!(refined_s, [4_999.0, 5_003.0]);
        for (visible_s, is_covered) in [
            ([5_000.5, 5_002.5], true),
            ([5_001.5, 5_003.5], false),
            ([5_000.0, 5_001.0], true),
            ([5_000.0, 5_000.5], false),
        ] {
            assert_eq!(covers(refined_s, visible_s), is_covered, "{visible_s:?}");
        }
        assert_eq!(with_margin(span_s, [100.0, 102.0]), [100.0, 103.0]);
    }
}
