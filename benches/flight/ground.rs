//! Ground of any extent, computed point by point: the same at each place, whatever the number of heights.

use std::sync::Arc;

use camsim::core::{
    mount::CameraPath,
    scene::{Terrain, TerrainGrid, Texture},
    sequence::Sequence,
};
use glam::{DVec2, DVec3};

use super::Outcome;

/// Between two heights.
const CELL_M: f64 = 10.0;
/// From the camera down to the ground's middle height.
const BELOW_M: f64 = 900.0;
/// Side of the picture on the ground; beyond it its border goes on.
const PICTURE_M: f64 = 5000.0;

/// Heights around the middle of a flight.
struct Hills {
    side: u32,
    centre_ned_m: DVec3,
}

impl Hills {
    /// North and east of the middle.
    fn place_m(&self, [column, row]: [u32; 2]) -> DVec2 {
        let at = |n: u32| f64::from(n) - f64::from(self.side / 2);
        CELL_M * DVec2::new(-at(row), at(column))
    }
}

impl TerrainGrid for Hills {
    fn point_ned_m(&self, at: [u32; 2]) -> DVec3 {
        let place = self.place_m(at);
        // Of all sizes from 90 m to 23 km, slopes up to one in two.
        let height_m: f64 = (0..9)
            .map(|octave| {
                let a_metre = 0.07 * 0.5_f64.powi(octave);
                let waves = a_metre * DVec2::from_angle(f64::from(octave)).rotate(place);
                0.06 / a_metre * waves.x.sin() * (waves.y + f64::from(octave)).cos()
            })
            .sum();
        self.centre_ned_m + DVec3::new(place.x, place.y, BELOW_M - height_m)
    }

    fn uv(&self, at: [u32; 2]) -> [f32; 2] {
        let place = self.place_m(at) / PICTURE_M;
        [(0.5 + place.y) as f32, (0.5 - place.x) as f32]
    }
}

/// The demo's flight, looking straight down on ground of `side` x `side` heights.
pub fn looking_down(demo: &Sequence, side: u32) -> Outcome<Arc<Sequence>> {
    let mut sequence = demo.clone();
    let picture: Arc<Texture> = demo.scene.terrain.as_ref().ok_or("the demo has terrain")?.texture.clone();
    let middle_s = sequence.start_s + 0.5 * sequence.frames as f64 / sequence.scenario.camera.fps;
    let centre_ned_m = sequence.path.pose(middle_s).position_ned_m;
    let terrain = Terrain::from_grid(side, side, &Hills { side, centre_ned_m }, picture)?;
    let mount = &mut sequence.scenario.camera.mount;
    mount.angles_deg = [0.0, -90.0, 0.0];
    sequence.path = Arc::new(CameraPath::new(sequence.path.trajectory.clone(), mount)?);
    sequence.scene = Arc::new(camsim::core::scene::Scene {
        terrain: Some(terrain),
        ..camsim::core::scene::Scene::clone(&sequence.scene)
    });
    Ok(Arc::new(sequence))
}
