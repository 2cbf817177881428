//! Pixels in which something moves, by rays of their own.
//!
//! The renderers draw what stands still. Within the outline that a moving thing sweeps in the exposure of a
//! row, each pixel is then replaced by the mean of rays over its area and exposure, each cast at its own
//! instant with everything where it is then: parallax, rolling shutter, blur and what comes into view behind
//! need no approximation there. With shadows of the sun, so is each pixel where the thing's shadow may fall.
//! Elsewhere nothing changes.

mod lamps;
mod missed;
mod outline;
mod painter;
mod sweep;
mod thing;

/// Rays of a pixel in which something moves.
pub const MOVING_RAYS: u32 = RAYS;

use std::sync::Arc;

use camsim_core::{scene::Scene, sequence::Sequence, shutter::RowAxis};
use camsim_cpu::MovingCaster;
use camsim_plan::FramePlan;

use crate::{cancel::Cancel, truth::RAYS};
pub(crate) use lamps::Lamps;
pub use lamps::SMALL_LAMP_PX;
pub(crate) use missed::Missed;
use outline::Outline;
use painter::{Painted, Painter, index};
use thing::{Thing, things};

/// A sequence whose scene has things that move.
#[derive(Debug)]
pub(crate) struct MovingScene {
    painter: Painter,
    things: Arc<Vec<Thing>>,
    /// Without what moves.
    still: Arc<Sequence>,
}

impl MovingScene {
    /// `None` if nothing moves. `before` has the scenes of an earlier sequence, which are kept if they are the
    /// same.
    pub fn new(sequence: &Arc<Sequence>, before: Option<&Self>) -> Option<Self> {
        let scene = &sequence.scene;
        if scene.meshes.iter().all(|mesh| mesh.motion.is_none()) {
            return None;
        }
        let known = before.filter(|before| Arc::ptr_eq(&before.painter.sequence.scene, scene));
        let still_scene = known.map_or_else(
            || {
                let mut still = Scene::clone(scene);
                still.meshes.retain(|mesh| mesh.motion.is_none());
                Arc::new(still)
            },
            |before| before.still.scene.clone(),
        );
        let still = Sequence { scene: still_scene, ..Sequence::clone(sequence) };
        Some(Self {
            painter: Painter::new(sequence, known.map(|before| &before.painter)),
            things: known.map_or_else(|| Arc::new(things(scene)), |before| before.things.clone()),
            still: Arc::new(still),
        })
    }

    /// The sequence without what moves.
    pub fn still(&self) -> &Arc<Sequence> {
        &self.still
    }

    /// Replaces the colours of the pixels in which something may move: linear R G B A, row-major.
    pub fn paint(&self, color_rgba: &mut [f32], plan: &FramePlan, cancel: &Cancel) {
        let Sequence { scene, path, .. } = &*self.painter.sequence;
        let swept = sweep::all_that_moves(scene, &self.things, plan.window_s);
        let outline = Outline::new(path, plan, &swept);
        let lines: Vec<usize> = (0..outline.spans.len()).filter(|&i| !outline.spans[i].is_empty()).collect();
        if lines.is_empty() {
            return;
        }
        let caster = self.painter.caster();
        let line = |line: usize, before: &[f32]| self.line(caster, plan, line, &outline.spans[line], before);
        Painter::paint(color_rgba, lines, cancel, line);
    }

    /// Colours of the pixels of a row of the readout that are in an outline, by their index.
    fn line(
        &self,
        caster: &MovingCaster,
        plan: &FramePlan,
        line: usize,
        spans: &[[u32; 2]],
        color_rgba: &[f32],
    ) -> Vec<Painted> {
        let pixels = spans.iter().flat_map(|&[first, last]| first..=last);
        let pixels = pixels.map(|along| outline::pixel(plan, line, along));
        let pixels: Vec<[u32; 2]> =
            pixels.filter(|&pixel| color_rgba[4 * index(plan, pixel) + 3] > 0.0).collect();
        self.painter.means(caster, plan, &pixels)
    }
}

/// Number of rows of the readout, with those of either field for columns.
pub(super) fn line_count(plan: &FramePlan) -> usize {
    match plan.shutter.row_axis() {
        RowAxis::Rows => plan.camera.size_px[1] as usize,
        RowAxis::Columns => 2 * plan.camera.size_px[0] as usize,
    }
}
