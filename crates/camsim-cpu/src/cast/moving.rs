//! Pixels in which something moves: the colour of a ray, with everything where it is at the ray's own instant.

use std::sync::Arc;

use camsim_core::{
    pose::CameraPose,
    scene::{Mesh, PrefilterTaps, Scene},
};
use glam::{DMat3, DVec2, Vec3};

use super::{
    CastScene, FOG_AT_VISIBILITY, FrameCaster,
    shade::{KeyCamera, SurfaceShader},
    trace::Hits,
};

/// A scene with things that move, prepared for rays at any instant.
#[derive(Debug)]
pub struct MovingCaster {
    cast: CastScene,
    moving: Vec<u32>,
}

/// A mesh where it is at one instant.
#[derive(Debug)]
pub(super) struct PosedMesh {
    pub number: u32,
    pub mesh: Mesh,
    pub shape_from_ned: DMat3,
}

/// A camera and everything that moves, at one instant.
#[derive(Debug)]
pub struct Instant {
    pose: CameraPose,
    posed: Vec<PosedMesh>,
}

/// What rays meet; kept from ray to ray to spare allocations.
#[derive(Debug, Default)]
pub struct RayScratch(Hits);

impl MovingCaster {
    /// Builds trees over all triangles, and the mip levels of all textures.
    #[must_use]
    pub fn new(scene: &Arc<Scene>) -> Self {
        let cast = CastScene::new(scene);
        cast.textures();
        let moving = (0..).zip(&scene.meshes).filter(|(_, mesh)| mesh.motion.is_some());
        Self { moving: moving.map(|(number, _)| number).collect(), cast }
    }

    /// The scene at path time `t_s`, seen by a camera.
    #[must_use]
    pub fn at(&self, t_s: f64, pose: CameraPose) -> Instant {
        let posed = self.moving.iter().map(|&number| {
            let mesh = self.cast.scene.meshes[number as usize].at(t_s);
            let shape_from_ned = mesh.ned_from_shape.inverse();
            PosedMesh { number, mesh, shape_from_ned }
        });
        Instant { pose, posed: posed.collect() }
    }

    /// Linear R G B along the ray (u, v, 1) of the camera, with textures prefiltered over `step_uv` (width and
    /// height of what the ray stands for, tangents).
    #[must_use]
    pub fn color(
        &self,
        instant: &Instant,
        uv: DVec2,
        step_uv: DVec2,
        reads: PrefilterTaps,
        scratch: &mut RayScratch,
    ) -> Vec3 {
        let scene = &*self.cast.scene;
        let shader = SurfaceShader {
            scene,
            textures: self.cast.textures(),
            camera: KeyCamera::with_steps(&instant.pose, step_uv),
            reads,
            fog_per_m: scene.fog_visibility_m.map_or(0.0, |visibility_m| FOG_AT_VISIBILITY / visibility_m),
            posed: &instant.posed,
            shadows: scene.light.filter(|light| light.shadows),
        };
        let caster = FrameCaster { trees: &self.cast.trees, sun_map: self.cast.sun_map.as_ref(), shader };
        caster.middle(uv / step_uv, &mut scratch.0, None).0
    }
}
