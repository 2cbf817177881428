//! How long borders are, of whatever width is between them: what is narrower than the places that `contours.rs` looks at, as trees and window frames
//! are, has two where that finds one, or none.
//!
//! Lines across the picture tell without bias: of borders of length L in an area A, whichever way they run, a line crosses `2 L / (pi A)` for each of
//! its pixels (Crofton). A row and a column through each probe are looked at pixel by pixel; two borders within one pixel are still missed.

use std::{cell::OnceCell, f64::consts::FRAC_PI_2};

use glam::DVec2;

use super::{contours::Search, probes::Probe, prospect::path_px, surfaces::Light};
use crate::{
    silhouette::{NEAR_PX, bends, may_step, steps},
    temporal::marks::FINE_EDGE_STEP,
};

/// Places along each of the two lines, a pixel apart.
const PLACES: usize = 2 * NEAR_PX as usize + 1;

/// What two lines through a probe cross.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Crossed {
    pub borders: u32,
    /// Squared error, of the linear range, mean over the area that the lines stand for, of borders that run along whole pixels of the camera's size.
    pub stairs: f64,
    /// The same of borders between meshes that touch, as a window and its wall do: depth tells nothing of them, so that rays leave
    /// them as they are; and of what is mixed with what is behind it, where it has no depth.
    pub flush: f64,
    /// The same where depth bends between them, as at a wall's foot: samples finer than a pixel find that, the middles of pixels do not.
    pub feet: f64,
}

impl Search<'_> {
    /// Along the row and the column of a probe, at its own instant.
    pub fn crossed(&self, probe: &Probe) -> Crossed {
        let [x, y] = probe.pixel;
        let mid_s = self.stamp_s + self.shutter.dt_pixel_s(x, y);
        let pose = self.path.pose(mid_s);
        let (mut borders, mut contrast2, mut flush2, mut feet2, mut depth) = (0, 0.0, 0.0, 0.0, 0.0);
        for axis in [DVec2::X, DVec2::Y] {
            let uv = |place: f64| probe.uv + probe.uv_from_px * ((place - f64::from(NEAR_PX)) * axis);
            let meet = |place: f64| self.surfaces.meet(pose.position_ned_m, pose.ned_from_camera * uv(place).extend(1.0));
            let met: [_; PLACES] = std::array::from_fn(|k| meet(k as f64));
            let inverse_depths = met.map(|met| met.map_or(0.0, |met| met.depth_m.recip()));
            depth = inverse_depths[PLACES / 2];
            // Each place is asked by both of its neighbours.
            let lights: [OnceCell<Light>; PLACES] = std::array::from_fn(|_| OnceCell::new());
            let light = |k: usize| {
                let way = uv(k as f64).extend(1.0);
                lights[k]
                    .get_or_init(|| self.surfaces.light(pose.position_ned_m, pose.ned_from_camera * way, met[k].as_ref(), way.length()))
            };
            let around = |k: usize| [inverse_depths[k], inverse_depths[k + 1], inverse_depths[k + 2]];
            for k in 0..PLACES - 1 {
                let either = |is: &dyn Fn([f64; 3]) -> bool| (k > 0 && is(around(k - 1))) || (k + 2 < PLACES && is(around(k)));
                let may = either(&may_step);
                let between = |share: f64| meet(k as f64 + share).map_or(0.0, |met| met.depth_m.recip());
                let square = || (light(k).color - light(k + 1).color).length_squared() / 3.0;
                let mesh = |k: usize| met[k].as_ref().map_or(0, |met| met.surface);
                if may && steps(inverse_depths[k], inverse_depths[k + 1], between) {
                    borders += 1;
                    contrast2 += square();
                } else if mesh(k) != mesh(k + 1) && mesh(k) * mesh(k + 1) > 0 {
                    let side = if either(&|depths| bends(depths, FINE_EDGE_STEP)) { &mut feet2 } else { &mut flush2 };
                    *side += square();
                } else if self.surfaces.blends() && light(k).panes != light(k + 1).panes {
                    // The border of what is mixed and has no depth of its own.
                    flush2 += square();
                }
            }
        }
        if borders == 0 && flush2 + feet2 == 0.0 {
            return Crossed::default();
        }
        let path_px = path_px(self.path, mid_s, self.shutter.exposure_s(), probe.uv, depth, self.reach.camera.focal_px).1;
        let looked_at_px = 2.0 * (PLACES - 1) as f64;
        let of = |contrast2: f64| stairs(FRAC_PI_2 * contrast2 / looked_at_px * (self.gain)(probe.pixel).powi(2), path_px);
        Crossed { borders, stairs: of(contrast2), flush: of(flush2), feet: of(feet2) }
    }
}

/// Squared error of borders along whole pixels, given their squared contrast times their length in each pixel.
///
/// Where the border truly is within such a pixel is any place alike, so that one pixel of each line across has 1/12 of the squared
/// contrast. The path over the exposure spreads that over its length, as many times less of the contrast in as many times more pixels;
/// half of that, since many paths run along the border.
pub(super) fn stairs(length_by_contrast2: f64, path_px: f64) -> f64 {
    length_by_contrast2 / (12.0 * (1.0 + path_px).sqrt())
}
