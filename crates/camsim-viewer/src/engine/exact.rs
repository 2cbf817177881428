//! The oracle's thread: prepares looks into single pixels, and draws whole frames strip by strip while nobody
//! wants something newer.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use camsim_core::{
    reference::{Oracle, RenderOptions},
    scenario::Channel,
};

use super::{
    Speaker,
    mailbox::Mailbox,
    messages::{ExactPicture, ExactWanted, Reply},
    picture::{difference, screen},
};

/// Rows between two looks into the letter box.
const STRIP_ROWS: usize = 4;
/// Time between two replies: each carries the whole picture.
const BETWEEN_REPLIES: Duration = Duration::from_millis(250);
/// Share of `quality.max_error_dn` that a pixel's standard error may have, as for `camsim render --backend
/// reference`.
const SHARE_OF_TOLERANCE: f64 = 0.25;

/// A frame as far as it has come.
struct Drawn {
    frame: u64,
    color_rgba: Vec<f32>,
    rows: usize,
}

/// Serves requests until the box is closed.
pub fn run(mailbox: &Mailbox<ExactWanted>, speaker: &Speaker) {
    // Half of the processors, so that window and renderer stay quick; without a pool of its own it would take
    // all.
    let threads = std::thread::available_parallelism().map_or(1, usize::from).div_ceil(2);
    let pool = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool,
        Err(error) => {
            return speaker.say(Reply::Failed(format!(
                "no threads for exact rays: {error}; close other programs and try again"
            )));
        }
    };
    let mut known: Option<Arc<Oracle>> = None;
    let mut drawn: Option<Drawn> = None;
    while let Some(wanted) = mailbox.take() {
        let oracle = match known.take().filter(|oracle| Arc::ptr_eq(oracle.sequence(), &wanted.sequence)) {
            Some(oracle) => oracle,
            None => match Oracle::new(wanted.sequence.clone()) {
                Ok(oracle) => {
                    drawn = None;
                    Arc::new(oracle)
                }
                Err(error) => {
                    speaker.say(Reply::Failed(error.to_string()));
                    continue;
                }
            },
        };
        known = Some(oracle.clone());
        speaker.say(Reply::Looks(oracle.clone()));
        let Some(frame) = wanted.frame else { continue };
        let [width, height] = wanted.sequence.scenario.camera.size_px.map(|side| side as usize);
        let nothing = || Drawn { frame, color_rgba: vec![0.0; 4 * width * height], rows: 0 };
        let drawn = drawn.get_or_insert_with(nothing);
        if drawn.frame != frame {
            *drawn = nothing();
        }
        pool.install(|| draw(&oracle, &wanted, drawn, mailbox, speaker));
    }
}

/// The strips that are missing, from the top.
fn draw(
    oracle: &Oracle,
    wanted: &ExactWanted,
    drawn: &mut Drawn,
    mailbox: &Mailbox<ExactWanted>,
    speaker: &Speaker,
) {
    let scenario = &wanted.sequence.scenario;
    let size_px = scenario.camera.size_px;
    let [width, height] = size_px.map(|side| side as usize);
    let tell = |drawn: &Drawn| {
        let difference = wanted.against.as_ref().and_then(|(picture, gain)| {
            let against = &picture.frame;
            (against.size_px == size_px)
                .then(|| {
                    difference(size_px, &against.color_rgba, &drawn.color_rgba, *gain, drawn.rows as u32)
                })
                .flatten()
        });
        speaker.say(Reply::Exact(Box::new(ExactPicture {
            sequence: wanted.sequence.clone(),
            frame: drawn.frame,
            image: Arc::new(screen(size_px, &drawn.color_rgba)),
            color_rgba: Arc::new(drawn.color_rgba.clone()),
            difference: difference.map(Arc::new),
            rows: drawn.rows as u32,
        })));
    };
    tell(drawn);
    let mut told = Instant::now();
    while drawn.rows < height {
        if mailbox.is_newer() {
            return;
        }
        let bottom = (drawn.rows + STRIP_ROWS).min(height);
        let rows = drawn.rows..bottom;
        let options = RenderOptions {
            channels: vec![Channel::Color],
            tolerance_dn: SHARE_OF_TOLERANCE * scenario.quality.max_error_dn,
            only: Some((0..width * height).map(|pixel| rows.contains(&(pixel / width))).collect()),
            ..RenderOptions::default()
        };
        let strip = oracle.render(drawn.frame, &options);
        let range = 4 * width * rows.start..4 * width * rows.end;
        if let (Some(to), Some(from)) = (drawn.color_rgba.get_mut(range.clone()), strip.color_rgba.get(range))
        {
            to.copy_from_slice(from);
        }
        drawn.rows = bottom;
        if bottom == height || told.elapsed() > BETWEEN_REPLIES {
            tell(drawn);
            told = Instant::now();
        }
    }
}
