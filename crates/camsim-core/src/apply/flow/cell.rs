//! The sheet over four pixels: where it is when a share of the interval has gone by, and what of it is at a
//! place then.

use glam::{DMat2, DVec2};

/// Neighbours that part by more than what is beside them goes on with are of two things: of the displacement
/// that happens, pixels.
const JUMP_PX: f64 = 0.5;
/// Slack at a cell's border, so that two that share it leave no crack, pixels.
const SEAM_PX: f64 = 1e-6;
/// The same along the whole edges of a torn cell, whose parts do not quite meet where it bends.
const RIM_PX: f64 = 0.02;

/// Four neighbouring pixels: (0, 0), (1, 0), (0, 1), (1, 1), right and down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Where the first is.
    pub(super) place_px: DVec2,
    pub(super) flows: [DVec2; 4],
    /// Tears of the upper and the lower edge, pixels of the flow.
    pub(super) across: [f64; 2],
    /// Of the left and the right one.
    pub(super) down: [f64; 2],
}

impl Cell {
    /// Places of this cell that are at `at_px`, and whether the sheet shows its front there.
    pub(super) fn sources(&self, at_px: DVec2, share: f64, mut found: impl FnMut(DVec2, bool)) {
        if !self.is_torn(share) {
            for within in self.roots(at_px, share) {
                // From the flow there, not from `within`: without motion it is the place itself, to the last
                // bit.
                let source_px = at_px - share * self.flow(within);
                found(source_px, (DMat2::IDENTITY + self.bilinear_slope(within) * share).determinant() > 0.0);
            }
            return;
        }
        for k in 0..4 {
            let corner = corner(k);
            let slope = self.slope(corner, share);
            let forward = DMat2::IDENTITY + slope * share;
            let from_corner = forward.inverse() * (at_px - self.place_px - corner - share * self.flows[k]);
            // Its own half of the way to each neighbour. What is torn there has no slack: beyond, the nearest
            // pixel is of another thing.
            let [is_whole_across, is_whole_down] = self.whole(corner, share);
            let own = |from_corner: f64, corner: f64, is_whole: bool| {
                let inwards = if corner > 0.5 { -from_corner } else { from_corner };
                inwards >= -RIM_PX
                    && if is_whole { inwards <= 0.5 + RIM_PX } else { (-0.5..0.5).contains(&from_corner) }
            };
            if own(from_corner.x, corner.x, is_whole_across) && own(from_corner.y, corner.y, is_whole_down) {
                found(at_px - share * (self.flows[k] + slope * from_corner), forward.determinant() > 0.0);
            }
        }
    }

    /// Where the cell is torn, what stands in for that which its things bared: that of its pixels which is
    /// farthest, by their rank, continued along the edges that are whole.
    pub(super) fn stand_ins(
        &self,
        at_px: DVec2,
        share: f64,
        rank: impl Fn(DVec2) -> super::Rank,
        mut found: impl FnMut(super::Rank, DVec2),
    ) {
        if !self.is_torn(share) {
            return;
        }
        for within in self.roots(at_px, share) {
            let ranks = [0, 1, 2, 3].map(|k| (k, rank(self.place_px + corner(k))));
            // A pixel whose flow is not known only where none is.
            let best_known = ranks.iter().fold(0.0_f64, |most, (_, rank)| most.max(rank[0]));
            let farthest = ranks
                .into_iter()
                .filter(|(_, rank)| rank[0] == best_known)
                .reduce(|a, b| if b.1 < a.1 { b } else { a });
            let Some((k, rank)) = farthest else { continue };
            let corner = corner(k);
            let [is_whole_across, is_whole_down] = self.whole(corner, share);
            let x = if is_whole_across { within.x } else { corner.x };
            let y = if is_whole_down { within.y } else { corner.y };
            found(rank, self.place_px + DVec2::new(x, y));
        }
    }

    /// Change of the flow from pixel to pixel, at a place within; none across what is torn.
    pub(super) fn slope(&self, within: DVec2, share: f64) -> DMat2 {
        if !self.is_torn(share) {
            return self.bilinear_slope(within);
        }
        let nearest = within.round();
        let [is_whole_across, is_whole_down] = self.whole(nearest, share);
        let slope = self.bilinear_slope(nearest);
        DMat2::from_cols(
            if is_whole_across { slope.x_axis } else { DVec2::ZERO },
            if is_whole_down { slope.y_axis } else { DVec2::ZERO },
        )
    }

    /// Whether the sheet turns over somewhere in the cell.
    pub(super) fn folds(&self, share: f64) -> bool {
        (0..4).any(|k| (DMat2::IDENTITY + self.bilinear_slope(corner(k)) * share).determinant() <= 0.0)
    }

    fn is_torn(&self, share: f64) -> bool {
        let tear = self.across[0].max(self.across[1]).max(self.down[0]).max(self.down[1]);
        tear * share.abs() > JUMP_PX
    }

    /// Whether the edges that meet in a corner are whole: that across, and that down.
    fn whole(&self, corner: DVec2, share: f64) -> [bool; 2] {
        let [row, column] = [corner.y, corner.x].map(|side| usize::from(side > 0.5));
        [self.across[row], self.down[column]].map(|tear| tear * share.abs() <= JUMP_PX)
    }

    fn flow(&self, within: DVec2) -> DVec2 {
        let [a, b, c, d] = self.flows;
        a.lerp(b, within.x).lerp(c.lerp(d, within.x), within.y)
    }

    fn bilinear_slope(&self, within: DVec2) -> DMat2 {
        let [a, b, c, d] = self.flows;
        DMat2::from_cols((b - a).lerp(d - c, within.y), (c - a).lerp(d - b, within.x))
    }

    /// Where a bilinear sheet over the displaced corners is at a place: `q = u e + v g + u v h`, up to two.
    /// Eliminating u leaves `(q - v g) x (e + v h) = 0`, a quadratic in v.
    fn roots(&self, at_px: DVec2, share: f64) -> impl Iterator<Item = DVec2> {
        let [a, b, c, d] = self.flows;
        let q = at_px - self.place_px - share * a;
        let e = DVec2::X + share * (b - a);
        let g = DVec2::Y + share * (c - a);
        let h = share * ((a - b) + (d - c));
        let (square, linear, constant) = (-g.perp_dot(h), q.perp_dot(h) + e.perp_dot(g), q.perp_dot(e));
        // Not a number where there is none: no comparison holds then.
        let half = -0.5 * (linear + (linear * linear - 4.0 * square * constant).sqrt().copysign(linear));
        let root = move |v: f64| {
            let along = e + v * h;
            DVec2::new((q - v * g).dot(along) / along.length_squared(), v)
        };
        let inside = |within: &DVec2| {
            within.cmpge(DVec2::splat(-SEAM_PX)).all() && within.cmple(DVec2::splat(1.0 + SEAM_PX)).all()
        };
        [root(constant / half), root(half / square)].into_iter().filter(inside)
    }
}

fn corner(k: usize) -> DVec2 {
    DVec2::new((k % 2) as f64, (k / 2) as f64)
}
