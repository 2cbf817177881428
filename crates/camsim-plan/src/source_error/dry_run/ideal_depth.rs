//! Depth of the ideal frame, texel by texel.

use camsim_core::{
    pose::CameraPose,
    scene::{DrawnCell, TerrainDetail},
    temporal::{IdealGeometry, interpolate_inverse_depth},
};
use glam::{DVec2, DVec3};

use crate::view::surfaces::{SurfaceHit, Surfaces};

/// Depth of the ideal frame, found where it is asked for.
pub(crate) struct DepthLookUps<'a> {
    surfaces: &'a Surfaces,
    key_pose: &'a CameraPose,
    ideal: &'a IdealGeometry,
    /// The terrain as it will be drawn.
    detail: Option<&'a TerrainDetail<'a>>,
    known: Vec<([i64; 2], f64)>,
    /// What is drawn where the last ray met the terrain: neighbours mostly meet the same cell.
    drawn: Option<DrawnCell>,
}

/// Direction from the key camera towards an ideal pixel, z = 1 in the camera, NED.
pub(crate) fn key_ray(key_pose: &CameraPose, ideal: &IdealGeometry, source_px: DVec2) -> DVec3 {
    key_pose.ned_from_camera * ((source_px - ideal.principal_px) / ideal.focal_px).extend(1.0)
}

impl<'a> DepthLookUps<'a> {
    pub fn new(
        surfaces: &'a Surfaces,
        key_pose: &'a CameraPose,
        ideal: &'a IdealGeometry,
        detail: Option<&'a TerrainDetail<'a>>,
    ) -> Self {
        Self { surfaces, key_pose, ideal, detail, known: Vec::with_capacity(16), drawn: None }
    }

    /// Inverse depth between the texels, 1/m.
    pub fn inverse_depth(&mut self, source_px: DVec2) -> f64 {
        if !source_px.is_finite() {
            return 0.0;
        }
        let [width, height] = self.ideal.size_px.map(i64::from);
        let last = DVec2::new((width - 1) as f64, (height - 1) as f64);
        let inside = source_px.clamp(DVec2::ZERO, last);
        let base = inside.floor().min((last - 1.0).max(DVec2::ZERO));
        let [x, y] = [base.x as i64, base.y as i64];
        let texels = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]
            .map(|[x, y]| self.texel([x.min(width - 1), y.min(height - 1)]));
        interpolate_inverse_depth(texels, inside - base)
    }

    /// Inverse depth of what is drawn along the very ray of a position, which may lie between texels.
    pub fn along(&mut self, source_px: DVec2) -> f64 {
        let (origin, ray) = (self.key_pose.position_ned_m, key_ray(self.key_pose, self.ideal, source_px));
        match (self.surfaces.first_hit(origin, ray), self.detail) {
            (None, _) => 0.0,
            (Some(SurfaceHit { terrain: Some(hit), .. }), Some(detail)) => {
                let drawn = self
                    .drawn
                    .take()
                    .filter(|drawn| drawn.contains(&hit))
                    .unwrap_or_else(|| detail.drawn_cell(&hit));
                1.0 / self.drawn.insert(drawn).t(&hit, origin, ray)
            }
            (Some(hit), _) => 1.0 / hit.depth_m,
        }
    }

    fn texel(&mut self, texel: [i64; 2]) -> f64 {
        if let Some((_, w)) = self.known.iter().find(|(known, _)| *known == texel) {
            return *w;
        }
        let w = self.along(DVec2::new(texel[0] as f64, texel[1] as f64));
        self.known.push((texel, w));
        w
    }
}
