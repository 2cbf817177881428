//! The reference's thread: prepares exact rays for single pixels, and renders whole frames strip by strip until
//! a newer request arrives.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use camsim_core::{frame::RenderedFrame, reference::RenderOptions, scenario::Channel};
use camsim_engine::CameraReference;

use super::{
    ReplySender,
    mailbox::Mailbox,
    messages::{ReferencePicture, ReferenceRequest, Reply},
    picture::{difference, srgb_image},
};

/// Rows rendered between two checks for a newer request.
const STRIP_ROWS: usize = 4;
/// Rows below a row that its colours depend on in a mosaic.
const MOSAIC_REACH: usize = 4;
/// Least time between two replies, each of which carries the whole picture.
const REPLY_INTERVAL: Duration = Duration::from_millis(250);
/// A pixel's standard error as a fraction of `quality.max_error_dn`, as for `camsim render --backend
/// reference`.
const SHARE_OF_TOLERANCE: f64 = 0.25;

/// A frame with the rows rendered so far.
struct PartialFrame {
    frame: u64,
    /// Linear R G B A before the stages that take whole frames.
    light_rgba: Vec<f32>,
    rows: usize,
}

/// Serves requests until the mailbox is closed.
pub fn run(mailbox: &Mailbox<ReferenceRequest>, replies: &ReplySender) {
    // Half of the processor cores, so that window and renderer stay responsive.
    let threads = std::thread::available_parallelism().map_or(1, usize::from).div_ceil(2);
    let pool = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool,
        Err(error) => {
            return replies.send(Reply::Failed(format!(
                "cannot start threads for exact rays: {error}; close other programs and try again"
            )));
        }
    };
    let mut cached: Option<Arc<CameraReference>> = None;
    let mut partial: Option<PartialFrame> = None;
    while let Some(request) = mailbox.take() {
        let before = cached.as_deref();
        let known = cached.as_ref().filter(|known| Arc::ptr_eq(known.sequence(), &request.sequence));
        let reference = match known {
            Some(known) => known.clone(),
            None => match CameraReference::renewed(before, request.sequence.clone(), &[Channel::Color]) {
                Ok(reference) => {
                    partial = None;
                    Arc::new(reference)
                }
                Err(error) => {
                    replies.send(Reply::Failed(error.to_string()));
                    continue;
                }
            },
        };
        cached = Some(reference.clone());
        replies.send(Reply::Reference(reference.clone()));
        let Some(frame) = request.frame else { continue };
        let [width, height] = request.sequence.scenario.camera.size_px.map(|side| side as usize);
        let empty = || PartialFrame { frame, light_rgba: vec![0.0; 4 * width * height], rows: 0 };
        let partial = partial.get_or_insert_with(empty);
        if partial.frame != frame {
            *partial = empty();
        }
        pool.install(|| render_rows(&reference, &request, partial, mailbox, replies));
    }
}

/// The picture of the rows so far. Where light spreads, rows show what comes in, until all are there.
fn shown(reference: &CameraReference, partial: &PartialFrame, size_px: [u32; 2]) -> Vec<f32> {
    let light_rgba = partial.light_rgba.clone();
    if reference.spreads_light() && partial.rows < size_px[1] as usize {
        return light_rgba;
    }
    let picture = RenderedFrame::picture(size_px, light_rgba);
    let mut whole = RenderedFrame { index: partial.frame, ..picture };
    reference.expose(&mut whole);
    whole.into_color()
}

/// Number of rows, from the top, that later ones do not change. Colours of a mosaic need rows below.
fn comparable_rows(reference: &CameraReference, rows: usize, height: usize) -> usize {
    let has_mosaic = reference.sequence().scenario.camera.sensor.is_some();
    match (rows == height, reference.spreads_light()) {
        (true, _) => rows,
        (false, true) => 0,
        (false, false) => rows.saturating_sub(if has_mosaic { MOSAIC_REACH } else { 0 }),
    }
}

/// Renders the missing rows from the top, until a newer request arrives.
fn render_rows(
    reference: &CameraReference,
    request: &ReferenceRequest,
    partial: &mut PartialFrame,
    mailbox: &Mailbox<ReferenceRequest>,
    replies: &ReplySender,
) {
    let scenario = &request.sequence.scenario;
    let size_px = scenario.camera.size_px;
    let [width, height] = size_px.map(|side| side as usize);
    let send = |partial: &PartialFrame| {
        let color_rgba = shown(reference, partial, size_px);
        let rows = comparable_rows(reference, partial.rows, height);
        let difference = request.against.as_ref().filter(|_| rows > 0).and_then(|(picture, gain)| {
            let against = &picture.frame;
            (against.size_px == size_px)
                .then(|| difference(size_px, against.color_rgba(), &color_rgba, *gain, rows as u32))
                .flatten()
        });
        replies.send(Reply::ReferencePicture(Box::new(ReferencePicture {
            sequence: request.sequence.clone(),
            frame: partial.frame,
            image: Arc::new(srgb_image(size_px, &color_rgba)),
            color_rgba: Arc::new(color_rgba),
            difference: difference.map(Arc::new),
            rows: partial.rows as u32,
        })));
    };
    send(partial);
    let mut last_reply = Instant::now();
    while partial.rows < height {
        if mailbox.has_newer() {
            return;
        }
        let bottom = (partial.rows + STRIP_ROWS).min(height);
        let rows = partial.rows..bottom;
        let options = RenderOptions {
            tolerance_dn: SHARE_OF_TOLERANCE * scenario.quality.max_error_dn,
            ..RenderOptions::default()
        };
        let only: Vec<bool> = (0..width * height).map(|pixel| rows.contains(&(pixel / width))).collect();
        let light = reference.light(partial.frame, &only, &options);
        let strip = 4 * width * rows.start..4 * width * rows.end;
        partial.light_rgba[strip.clone()].copy_from_slice(&light[strip]);
        partial.rows = bottom;
        if bottom == height || last_reply.elapsed() > REPLY_INTERVAL {
            send(partial);
            last_reply = Instant::now();
        }
    }
}
