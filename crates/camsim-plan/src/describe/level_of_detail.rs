//! Level of detail of the terrain, as a plan has it.

use camsim_core::{
    pose::CameraPose,
    scene::{Terrain, TerrainDetail},
    sequence::Sequence,
};
use serde::Serialize;

use crate::ir::frame_plan::FramePlan;

/// Level of detail of the terrain in the ideal frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LevelOfDetail {
    /// Triangles that are drawn.
    pub triangles: u64,
    /// Back-facing triangles in sight, which are not drawn.
    pub away: u64,
    /// Bound on the displacement by the level of detail, output px.
    pub max_error_px: f64,
    /// What is allowed of it.
    pub tolerance_px: f64,
    /// Bound on the depth error seen from straight above, as a fraction of the depth.
    pub depth_fraction: f64,
    /// GPU memory of the triangles, bytes.
    pub triangle_bytes: u64,
}

impl LevelOfDetail {
    /// What the ideal pass of a plan chooses; `None` without a terrain.
    #[must_use]
    pub fn of(plan: &FramePlan, sequence: &Sequence) -> Option<Self> {
        let terrain = sequence.scene.terrain.as_ref()?;
        let scale = plan.ideal.scale(&plan.camera);
        let pose = plan.ideal_pose();
        let mesh = plan.terrain_detail(terrain, &pose).visible_mesh();
        let placed = mesh.placed(terrain, pose.position_ned_m.round());
        let lod = placed.lod;
        Some(Self {
            triangles: lod.triangles,
            away: lod.back_facing,
            max_error_px: lod.max_error_px / scale,
            tolerance_px: plan.terrain_error_px / scale,
            depth_fraction: plan.terrain_error_px / plan.ideal.focal_px.max_element(),
            triangle_bytes: placed.bytes(),
        })
    }
}

impl FramePlan {
    /// The terrain as the ideal frame of a pose shows it.
    #[must_use]
    pub fn terrain_detail<'a>(&self, terrain: &'a Terrain, pose: &CameraPose) -> TerrainDetail<'a> {
        let focal_px = self.ideal.focal_px.max_element();
        TerrainDetail::new(terrain, pose, self.tangents(), focal_px, self.terrain_error_px)
    }
}
