//! How long borders are, of whatever width is between them: what is narrower than the places that
//! `contours.rs` looks at, as trees and window frames are, has two where that finds one, or none.
//!
//! Lines across the picture tell without bias: of borders of length L in an area A, whichever way they run, a
//! line crosses `2 L / (pi A)` for each of its pixels (Crofton). Houses have borders along rows and columns,
//! which lines along those cross less often: 0.79 times. Every other probe has diagonals, and so the four
//! ways of line cross whatever runs one way 0.95 to 1.03 times as often as that. They are looked at thrice a
//! pixel. Two borders within a third of one are still missed; how many there are is told by those that a look
//! once a pixel would have missed.

use std::{
    cell::OnceCell,
    f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2},
};

use glam::DVec2;

use super::{
    around::Search,
    probes::Probe,
    surfaces::{Light, Met},
};
use camsim_core::{
    silhouette::{bends, may_step, steps},
    temporal::marks::FINE_EDGE_STEP,
};

/// Places along each of the two lines, and how far they are apart: far houses have borders nearer to each
/// other than a pixel.
const PLACES: usize = 13;
const APART_PX: f64 = 1.0 / 3.0;
/// Places from one whole pixel to the next.
const A_PIXEL: usize = 3;

/// What two lines through a probe cross.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Crossed {
    pub borders: u32,
    /// Squared contrast, of the linear range, times the length of borders, pixels, in each pixel of the area
    /// that the lines stand for.
    pub steps: f64,
    /// The same of borders between meshes that touch, as a window and its wall do, and of colours within one:
    /// depth tells nothing of them, so that rays leave them as they are; and of what is mixed with what is
    /// behind it, where it has no depth.
    pub flush: f64,
    /// The same where depth bends between them, as at a wall's foot: samples finer than a pixel find that,
    /// the middles of pixels do not.
    pub feet: f64,
    /// The same where models stand on the terrain.
    pub on_ground: f64,
    /// All three as a look once a pixel has them: what is narrower is not there.
    pub once_a_pixel: f64,
}

/// From place to place a mesh has another colour, whatever is painted on it, if that changes by more than
/// this, linear: its corners have no colours in common, or light falls on it from another side. Colours that
/// change gradually do so by less over a third of a pixel.
const OTHER_TINT: f64 = 0.02;

/// Whether two places that see no step of depth between them are of the terrain and of what stands on it.
fn is_on_ground(a: Option<&Met>, b: Option<&Met>) -> bool {
    a.zip(b).is_some_and(|(a, b)| (a.surface == 0) != (b.surface == 0))
}

/// Whether two places that see no step of depth between them are of different meshes, or of parts of one that
/// have different colours.
fn is_another(a: Option<&Met>, b: Option<&Met>) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return false };
    match (a.surface, b.surface) {
        (0, _) | (_, 0) => false,
        (one, other) if one != other => true,
        _ => (a.tint - b.tint).abs().max_element() > OTHER_TINT,
    }
}

/// The ways that lines run in: along the row and the column of a probe, and along its diagonals.
const UPRIGHT: [DVec2; 2] = [DVec2::X, DVec2::Y];
const DIAGONAL: [DVec2; 2] = [DVec2::splat(FRAC_1_SQRT_2), DVec2::new(FRAC_1_SQRT_2, -FRAC_1_SQRT_2)];

impl Search<'_> {
    /// Along two lines through a probe, of so many the one of that number, at its own instant.
    pub fn crossed(&self, number: usize, probe: &Probe) -> Crossed {
        let [x, y] = probe.pixel;
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
        let pose = self.path.pose(mid_s);
        let (mut borders, mut contrast2, mut flush2, mut feet2, mut on_ground2, mut once_a_pixel2) =
            (0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for axis in if number.is_multiple_of(2) { UPRIGHT } else { DIAGONAL } {
            let uv = |place: f64| {
                probe.uv + probe.uv_from_px * (APART_PX * (place - 0.5 * (PLACES - 1) as f64) * axis)
            };
            let meet = |place: f64| {
                self.surfaces.meet(pose.position_ned_m, pose.ned_from_camera * uv(place).extend(1.0))
            };
            let met: [_; PLACES] = std::array::from_fn(|k| meet(k as f64));
            let inverse_depths = met.map(|met| met.map_or(0.0, |met| met.depth_m.recip()));
            // Each place is asked by both of its neighbours.
            let lights: [OnceCell<Light>; PLACES] = std::array::from_fn(|_| OnceCell::new());
            let light = |k: usize| {
                let way = uv(k as f64).extend(1.0);
                lights[k].get_or_init(|| {
                    self.surfaces.light(
                        pose.position_ned_m,
                        pose.ned_from_camera * way,
                        met[k].as_ref(),
                        way.length(),
                    )
                })
            };
            let around = |k: usize| [inverse_depths[k], inverse_depths[k + 1], inverse_depths[k + 2]];
            let mut of_pixel = 0.0;
            for k in 0..PLACES - 1 {
                let before = contrast2 + flush2 + feet2;
                let either = |is: &dyn Fn([f64; 3]) -> bool| {
                    (k > 0 && is(around(k - 1))) || (k + 2 < PLACES && is(around(k)))
                };
                let may = either(&may_step);
                let between = |share: f64| meet(k as f64 + share).map_or(0.0, |met| met.depth_m.recip());
                let between_places =
                    |from: usize, to: usize| (light(from).color - light(to).color).length_squared() / 3.0;
                let square = || between_places(k, k + 1);
                if may && steps(inverse_depths[k], inverse_depths[k + 1], between) {
                    borders += 1;
                    contrast2 += square();
                } else if is_another(met[k].as_ref(), met[k + 1].as_ref()) {
                    let side = if either(&|depths| bends(depths, APART_PX * FINE_EDGE_STEP)) {
                        &mut feet2
                    } else {
                        &mut flush2
                    };
                    *side += square();
                } else if self.surfaces.blends() && light(k).panes != light(k + 1).panes {
                    // The border of what is mixed and has no depth of its own.
                    flush2 += square();
                } else if is_on_ground(met[k].as_ref(), met[k + 1].as_ref()) {
                    on_ground2 += square();
                }
                of_pixel += contrast2 + flush2 + feet2 - before;
                if (k + 1) % A_PIXEL == 0 {
                    once_a_pixel2 +=
                        if of_pixel > 0.0 { between_places(k + 1 - A_PIXEL, k + 1) } else { 0.0 };
                    of_pixel = 0.0;
                }
            }
        }
        if borders == 0 && flush2 + feet2 + on_ground2 == 0.0 {
            return Crossed::default();
        }
        let looked_at_px = 2.0 * APART_PX * (PLACES - 1) as f64;
        let of = |contrast2: f64| FRAC_PI_2 * contrast2 / looked_at_px * (self.gain)(probe.pixel).powi(2);
        Crossed {
            borders,
            steps: of(contrast2),
            flush: of(flush2),
            feet: of(feet2),
            on_ground: of(on_ground2),
            once_a_pixel: of(once_a_pixel2),
        }
    }
}
