//! The bilinear sheet over four pixels: its position after a fraction of the interval, and its points at a given
//! position then.

use glam::{DMat2, DVec2};

/// Difference between neighbours, beyond the continuation of the flow on either side, above which they belong
/// to two objects: displacement in pixels.
const JUMP_PX: f64 = 0.5;
/// Overlap of adjacent cells, so that no crack opens between them, pixels.
const SEAM_PX: f64 = 1e-6;
/// Overlap along the intact edges of a torn cell, whose parts do not quite meet where it bends, pixels.
const RIM_PX: f64 = 0.02;

/// Four neighbouring pixels: (0, 0), (1, 0), (0, 1), (1, 1), right and down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Position of the first pixel.
    pub(super) origin_px: DVec2,
    pub(super) flows: [DVec2; 4],
    /// Tears of the upper and the lower edge, pixels of the flow.
    pub(super) across: [f64; 2],
    /// Tears of the left and the right edge, pixels of the flow.
    pub(super) down: [f64; 2],
}

impl Cell {
    /// Calls `found` with each point of this cell that is at `position_px`, and whether the sheet shows its
    /// front there.
    pub(super) fn sources(&self, position_px: DVec2, fraction: f64, mut found: impl FnMut(DVec2, bool)) {
        if !self.is_torn(fraction) {
            for within in self.roots(position_px, fraction) {
                // Computed from the flow at that point, not from `within`: without motion the source then
                // equals the position to the last bit.
                let source_px = position_px - fraction * self.flow(within);
                found(
                    source_px,
                    (DMat2::IDENTITY + self.bilinear_slope(within) * fraction).determinant() > 0.0,
                );
            }
            return;
        }
        for k in 0..4 {
            let corner = corner(k);
            let slope = self.slope(corner, fraction);
            let forward = DMat2::IDENTITY + slope * fraction;
            let from_corner =
                forward.inverse() * (position_px - self.origin_px - corner - fraction * self.flows[k]);
            // Each pixel covers its half of the distance to each neighbour. A torn edge has no overlap, because
            // the nearest pixel beyond belongs to another object.
            let [is_whole_across, is_whole_down] = self.intact_edges(corner, fraction);
            let own = |from_corner: f64, corner: f64, is_whole: bool| {
                let inwards = if corner > 0.5 { -from_corner } else { from_corner };
                inwards >= -RIM_PX
                    && if is_whole { inwards <= 0.5 + RIM_PX } else { (-0.5..0.5).contains(&from_corner) }
            };
            if own(from_corner.x, corner.x, is_whole_across) && own(from_corner.y, corner.y, is_whole_down) {
                found(
                    position_px - fraction * (self.flows[k] + slope * from_corner),
                    forward.determinant() > 0.0,
                );
            }
        }
    }

    /// Substitutes for disoccluded points of a torn cell: its pixel with the lowest rank (the farthest one),
    /// extended along the intact edges.
    pub(super) fn fallback_sources(
        &self,
        position_px: DVec2,
        fraction: f64,
        rank: impl Fn(DVec2) -> super::Rank,
        mut found: impl FnMut(super::Rank, DVec2),
    ) {
        if !self.is_torn(fraction) {
            return;
        }
        for within in self.roots(position_px, fraction) {
            let ranks = [0, 1, 2, 3].map(|k| (k, rank(self.origin_px + corner(k))));
            // A pixel with unknown flow is used only if no other exists.
            let best_known = ranks.iter().fold(0.0_f64, |most, (_, rank)| most.max(rank[0]));
            let farthest = ranks
                .into_iter()
                .filter(|(_, rank)| rank[0] == best_known)
                .reduce(|a, b| if b.1 < a.1 { b } else { a });
            let Some((k, rank)) = farthest else { continue };
            let corner = corner(k);
            let [is_whole_across, is_whole_down] = self.intact_edges(corner, fraction);
            let x = if is_whole_across { within.x } else { corner.x };
            let y = if is_whole_down { within.y } else { corner.y };
            found(rank, self.origin_px + DVec2::new(x, y));
        }
    }

    /// Jacobian of the flow at a point of the cell; zero across torn edges.
    pub(super) fn slope(&self, within: DVec2, fraction: f64) -> DMat2 {
        if !self.is_torn(fraction) {
            return self.bilinear_slope(within);
        }
        let nearest = within.round();
        let [is_whole_across, is_whole_down] = self.intact_edges(nearest, fraction);
        let slope = self.bilinear_slope(nearest);
        DMat2::from_cols(
            if is_whole_across { slope.x_axis } else { DVec2::ZERO },
            if is_whole_down { slope.y_axis } else { DVec2::ZERO },
        )
    }

    /// Whether the sheet folds over anywhere in the cell.
    pub(super) fn folds(&self, fraction: f64) -> bool {
        (0..4).any(|k| (DMat2::IDENTITY + self.bilinear_slope(corner(k)) * fraction).determinant() <= 0.0)
    }

    fn is_torn(&self, fraction: f64) -> bool {
        let tear = self.across[0].max(self.across[1]).max(self.down[0]).max(self.down[1]);
        tear * fraction.abs() > JUMP_PX
    }

    /// Whether the two edges that meet in a corner are intact: the horizontal and the vertical one.
    fn intact_edges(&self, corner: DVec2, fraction: f64) -> [bool; 2] {
        let [row, column] = [corner.y, corner.x].map(|side| usize::from(side > 0.5));
        [self.across[row], self.down[column]].map(|tear| tear * fraction.abs() <= JUMP_PX)
    }

    fn flow(&self, within: DVec2) -> DVec2 {
        let [a, b, c, d] = self.flows;
        a.lerp(b, within.x).lerp(c.lerp(d, within.x), within.y)
    }

    fn bilinear_slope(&self, within: DVec2) -> DMat2 {
        let [a, b, c, d] = self.flows;
        DMat2::from_cols((b - a).lerp(d - c, within.y), (c - a).lerp(d - b, within.x))
    }

    /// Inverse of the bilinear sheet over the displaced corners, `q = u e + v g + u v h`, with up to two
    /// solutions. Eliminating u gives `(q - v g) x (e + v h) = 0`, a quadratic in v.
    fn roots(&self, position_px: DVec2, fraction: f64) -> impl Iterator<Item = DVec2> {
        let [a, b, c, d] = self.flows;
        let q = position_px - self.origin_px - fraction * a;
        let e = DVec2::X + fraction * (b - a);
        let g = DVec2::Y + fraction * (c - a);
        let h = fraction * ((a - b) + (d - c));
        let (square, linear, constant) = (-g.perp_dot(h), q.perp_dot(h) + e.perp_dot(g), q.perp_dot(e));
        // NaN without a solution: every comparison below is then false.
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
