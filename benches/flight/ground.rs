//! Procedural terrain of any extent. Its height at a point does not depend on the number of heights.

use std::sync::Arc;

use camsim::core::{
    mount::CameraPath,
    scene::{Scene, Terrain, TerrainGrid, Texture},
    sequence::Sequence,
};
use glam::{DVec2, DVec3};

use super::Outcome;

/// Distance of neighbouring heights.
const CELL_M: f64 = 10.0;
/// Height of the camera above the mean height of the ground.
const ABOVE_GROUND_M: f64 = 900.0;
/// Side of the ground texture, which is clamped at its border.
const TEXTURE_M: f64 = 5000.0;

/// A grid of heights centred below the middle of a flight.
struct Hills {
    side: u32,
    centre_ned_m: DVec3,
}

impl Hills {
    /// North and east offset of a grid point from the centre.
    fn offset_m(&self, [column, row]: [u32; 2]) -> DVec2 {
        let centred = |n: u32| f64::from(n) - f64::from(self.side / 2);
        CELL_M * DVec2::new(-centred(row), centred(column))
    }
}

impl TerrainGrid for Hills {
    fn point_ned_m(&self, cell: [u32; 2]) -> DVec3 {
        let offset_m = self.offset_m(cell);
        // Waves of 90 m to 23 km, slopes up to 1/2.
        let height_m: f64 = (0..9)
            .map(|octave| {
                let frequency = 0.07 * 0.5_f64.powi(octave);
                let waves = frequency * DVec2::from_angle(f64::from(octave)).rotate(offset_m);
                0.06 / frequency * waves.x.sin() * (waves.y + f64::from(octave)).cos()
            })
            .sum();
        self.centre_ned_m + DVec3::new(offset_m.x, offset_m.y, ABOVE_GROUND_M - height_m)
    }

    fn uv(&self, cell: [u32; 2]) -> [f32; 2] {
        let offset = self.offset_m(cell) / TEXTURE_M;
        [(0.5 + offset.y) as f32, (0.5 - offset.x) as f32]
    }
}

/// The built-in flight with a camera that looks straight down on a terrain of `side` x `side` heights.
pub fn looking_down(demo: &Sequence, side: u32) -> Outcome<Arc<Sequence>> {
    let mut sequence = demo.clone();
    let texture: Arc<Texture> = demo.scene.terrain.as_ref().ok_or("the demo has terrain")?.texture.clone();
    let middle_s = sequence.start_s + 0.5 * sequence.frames as f64 / sequence.scenario.camera.fps;
    let centre_ned_m = sequence.path.pose(middle_s).position_ned_m;
    let terrain = Terrain::from_grid(side, side, &Hills { side, centre_ned_m }, texture)?;
    let mount = &mut sequence.scenario.camera.mount;
    mount.angles_deg = [0.0, -90.0, 0.0];
    sequence.path = Arc::new(CameraPath::new(sequence.path.trajectory.clone(), mount)?);
    sequence.scene = Arc::new(Scene { terrain: Some(terrain), ..Scene::clone(&sequence.scene) });
    Ok(Arc::new(sequence))
}
