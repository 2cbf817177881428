//! Pixels that may see several surfaces: twin of camsim-gpu/shaders/reverse/edges/list_candidates.wgsl.

use camsim_plan::TemporalStage;

use super::{
    Stages,
    source::{LinePose, rotate},
};
use crate::simd::lanes::{LANES, Lanes, Lanes2, clamp_to, to_index};

/// Side of a tile, ideal pixels.
pub(crate) const TILE_PX: u32 = 8;
/// Least difference from 1 of a gathered alpha, which is 0 in edge pixels, that says that these were touched: it
/// is above 1 if they have negative weights of the spline.
const TOUCHED: f32 = 1e-4;

/// Tiles of an ideal frame.
#[derive(Debug)]
pub(crate) struct EdgeTiles {
    pub across: u32,
    /// Whether the parallax of a ray whose point at infinity is in the tile may pass an edge pixel.
    pub has_edge: Vec<bool>,
}

/// Pixels of a block, a bit each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Listed {
    /// Those whose gather touched an edge pixel.
    pub touched: u32,
    /// Those whose parallax may pass one.
    pub near: u32,
}

impl Stages<'_> {
    /// The pixels of a block that may see several surfaces, of those with `is_wanted` above 0.
    #[inline(always)]
    pub(super) fn listed(
        &self,
        uv: &Lanes2,
        poses: &[LinePose],
        colors: &[[f32; 4]; LANES],
        is_wanted: &Lanes,
    ) -> Listed {
        let mut listed = Listed::default();
        let Some(tiles) = self.edges.get(self.key) else { return listed };
        const { assert!(LANES == u32::BITS as usize) };
        let mut wanted = 0;
        for i in 0..LANES {
            wanted |= u32::from(is_wanted[i] > 0.0) << i;
            listed.touched |= u32::from((colors[i][3] - 1.0).abs() > TOUCHED) << i;
        }
        let has_parallax = matches!(self.temporal, TemporalStage::Reproject { .. });
        let last = poses.len().saturating_sub(2);
        for (node, pose) in poses.iter().enumerate() {
            let is_end = has_parallax && (node == 0 || node == last);
            let is_mid = self.truth_frame.is_some() && node + 1 == poses.len();
            if is_end || is_mid {
                listed.near |= self.near(tiles, uv, pose);
            }
        }
        Listed { touched: listed.touched & wanted, near: listed.near & wanted }
    }

    /// Pixels whose points at infinity are in tiles with edges.
    #[inline(always)]
    fn near(&self, tiles: &EdgeTiles, uv: &Lanes2, pose: &LinePose) -> u32 {
        let far = rotate(pose, uv);
        let far_px = self.ideal_px(&far.x, &far.y, |i| 1.0 / far.z[i]);
        let last = self.frame.ideal_size_px.map(|side| (side - 1) as f32);
        let mut near = 0;
        for i in 0..LANES {
            let [x, y] = [(far_px.x[i], last[0]), (far_px.y[i], last[1])]
                .map(|(px, last)| to_index(clamp_to(px, last)) / TILE_PX);
            let has_edge = tiles.has_edge.get((y * tiles.across + x) as usize).copied().unwrap_or(true);
            near |= u32::from(has_edge) << i;
        }
        near
    }
}
