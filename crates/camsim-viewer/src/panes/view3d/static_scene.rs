//! The part of the 3D view that all frames share: ground, patterns and boards, bounding sphere.

use std::sync::Arc;

use camsim_core::{
    scene::{Mesh, Terrain, Texture, srgb_from_linear},
    sequence::Sequence,
};
use eframe::egui::{Color32, Id, Ui};
use glam::{DVec2, DVec3};

use super::canvas::Surface;
use crate::{
    orbit::BoundingSphere,
    panes::map::static_map::{self, StaticMap},
};

/// Cells of the ground along a side; 96 x 96 x 2 are some 18 000 triangles.
const GROUND_CELLS: usize = 96;
/// Cells of all patterns and boards together.
const FLAT_CELLS: f64 = 4096.0;
/// Texture samples along a side of a cell.
const SAMPLES: u32 = 3;
/// Number of boxes up to which they have outlines.
pub const MAX_OUTLINED: usize = 60;

/// Computed once per sequence.
#[derive(Clone)]
pub struct StaticScene {
    /// Track of the map that the scene was made for; its address identifies the sequence.
    track: Arc<Vec<(DVec3, f64)>>,
    /// The terrain within the map; empty without one.
    pub ground: Arc<Surface>,
    /// Patterns and boards.
    pub flats: Arc<Vec<Surface>>,
    /// Bounding sphere of everything drawn.
    pub sphere: BoundingSphere,
    /// Side of a cell of the ground, metres.
    pub step_m: f64,
    bounds: [DVec2; 2],
}

/// egui's data has the last scene under this id.
pub fn id() -> Id {
    Id::unique("3D scene")
}

/// The cached scene, or a new one for another sequence.
pub fn static_scene(ui: &Ui, sequence: &Sequence, map: &StaticMap) -> StaticScene {
    if let Some(scene) = ui
        .data(|data| data.get_temp::<StaticScene>(id()))
        .filter(|scene| Arc::ptr_eq(&scene.track, &map.track))
    {
        return scene;
    }
    let scene = &sequence.scene;
    let ground = scene.terrain.as_ref().map_or_else(Surface::default, |terrain| ground(terrain, map.bounds));
    let count = static_map::flats(scene).count().max(1);
    let cells = ((FLAT_CELLS / count as f64).sqrt() as usize).clamp(1, 64);
    let flats: Vec<Surface> = static_map::flats(scene).map(|mesh| flat(mesh, cells)).collect();
    let sphere = bounding_sphere(map, &ground);
    let step_m = (map.bounds[1] - map.bounds[0]).max_element() / GROUND_CELLS as f64;
    let static_scene = StaticScene {
        track: map.track.clone(),
        ground: Arc::new(ground),
        flats: Arc::new(flats),
        sphere,
        step_m,
        bounds: map.bounds,
    };
    ui.data_mut(|data| data.insert_temp(id(), static_scene.clone()));
    static_scene
}

impl StaticScene {
    /// The ground below a point, at the height of the nearest corner, NED.
    pub fn below(&self, ned_m: DVec3) -> Option<DVec3> {
        let fraction = (ned_m.truncate() - self.bounds[0]) / (self.bounds[1] - self.bounds[0]);
        let index = |fraction: f64| {
            ((0.0..=1.0).contains(&fraction)).then(|| (fraction * GROUND_CELLS as f64).round() as usize)
        };
        let (row, column) = (index(1.0 - fraction.x)?, index(fraction.y)?);
        let (corner, _) = (*self.ground.corners.get(row * self.ground.columns + column)?)?;
        Some(ned_m.truncate().extend(corner.z))
    }
}

/// The terrain within the map, row-major from the north-west corner.
fn ground(terrain: &Terrain, [low, high]: [DVec2; 2]) -> Surface {
    let columns = GROUND_CELLS + 1;
    let top = terrain.bounds.min.z - 1.0;
    let deep = terrain.bounds.max.z - top + 1.0;
    // Size of a cell in texture coordinates: the texture covers the whole terrain.
    let spread = (high - low)
        / (terrain.bounds.max - terrain.bounds.min).truncate().max(DVec2::splat(1e-9))
        / GROUND_CELLS as f64;
    let spread = [spread.y.clamp(0.0, 1.0), spread.x.clamp(0.0, 1.0)];
    let corner = |index: usize| {
        let fraction = DVec2::new(
            1.0 - (index / columns) as f64 / GROUND_CELLS as f64,
            (index % columns) as f64 / GROUND_CELLS as f64,
        );
        let ne = low + fraction * (high - low);
        let hit = terrain.intersect(DVec3::new(ne.x, ne.y, top), DVec3::Z, deep)?;
        let color = mean(&terrain.texture, hit.uv, spread);
        // Light from the north-west, 45 deg above the horizon.
        let light =
            0.55 + 0.6 * hit.normal_ned.dot(DVec3::new(0.5, -0.5, -std::f64::consts::FRAC_1_SQRT_2)).max(0.0);
        Some((DVec3::new(ne.x, ne.y, top + hit.t), shaded(color, light)))
    };
    Surface { columns, corners: (0..columns * columns).map(corner).collect() }
}

/// A pattern or board as a grid with the colours of its texture.
fn flat(mesh: &Mesh, cells: usize) -> Surface {
    let columns = cells + 1;
    let corners = [0, 1, 2, 3].map(|vertex: u32| {
        let uv = mesh.shape.vertices[vertex as usize].uv.map(f64::from);
        (mesh.position_ned_m(vertex), DVec2::from_array(uv))
    });
    let corner = |index: usize| {
        let (x, y) = ((index % columns) as f64 / cells as f64, (index / columns) as f64 / cells as f64);
        let ned = corners[0].0.lerp(corners[1].0, x).lerp(corners[2].0.lerp(corners[3].0, x), y);
        let uv = corners[0].1.lerp(corners[1].1, x).lerp(corners[2].1.lerp(corners[3].1, x), y);
        Some((ned, shaded(mean(&mesh.material.texture, uv.to_array(), [1.0 / cells as f64; 2]), 1.0)))
    };
    Surface { columns, corners: (0..columns * columns).map(corner).collect() }
}

/// Mean linear colour of a texture in a window of `spread` (texture coordinates) about `uv`.
fn mean(texture: &Texture, uv: [f64; 2], spread: [f64; 2]) -> [f32; 3] {
    let mut sum = [0.0; 3];
    for k in 0..SAMPLES * SAMPLES {
        let within = [k % SAMPLES, k / SAMPLES].map(|k| (f64::from(k) + 0.5) / f64::from(SAMPLES) - 0.5);
        let pixel = [0, 1].map(|axis: usize| {
            let texel = (uv[axis] + within[axis] * spread[axis]) * f64::from(texture.size_px[axis]);
            texel.clamp(0.0, f64::from(texture.size_px[axis].max(1) - 1)) as u32
        });
        let [r, g, b, _] = texture.linear_at(pixel);
        sum = [sum[0] + r, sum[1] + g, sum[2] + b];
    }
    sum.map(|sum| sum / (SAMPLES * SAMPLES) as f32)
}

fn shaded(linear: [f32; 3], light: f64) -> Color32 {
    let [r, g, b] =
        linear.map(|value| (255.0 * srgb_from_linear((value * light as f32).clamp(0.0, 1.0))).round() as u8);
    Color32::from_rgb(r, g, b)
}

/// Bounding sphere of the map's ground, the flight, and objects within the map.
fn bounding_sphere(map: &StaticMap, ground: &Surface) -> BoundingSphere {
    let within =
        |ned: &DVec3| ned.truncate().cmpge(map.bounds[0]).all() && ned.truncate().cmple(map.bounds[1]).all();
    let heights = ground.corners.iter().flatten().map(|(ned, _)| *ned);
    let objects = map.flats.iter().flatten().chain(map.boxes.iter().flatten()).copied().filter(within);
    let flight = map.track.iter().map(|(ned, _)| *ned).chain(map.flown.iter().copied());
    let (low, high) = heights
        .chain(flight)
        .chain(objects)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), ned| (low.min(ned.z), high.max(ned.z)));
    let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
    let (from, to) = (map.bounds[0].extend(low), map.bounds[1].extend(high));
    BoundingSphere { centre_ned_m: 0.5 * (from + to), radius_m: (0.5 * (to - from)).length().max(0.5) }
}

#[cfg(test)]
mod tests {
    use camsim_core::scene::Encoding;

    use super::*;

    /// 4 x 2 pixels, the left half black, the right half white.
    fn halves() -> Texture {
        let row: Vec<u8> =
            [0_u8, 0, 255, 255].iter().flat_map(|value| [*value, *value, *value, 255]).collect();
        Texture { size_px: [4, 2], rgba8: [row.clone(), row].concat(), encoding: Encoding::Srgb }
    }

    #[test]
    fn a_flat_surface_has_the_colours_of_its_texture() {
        let mesh = Mesh::level_picture(Arc::new(halves()), DVec3::new(100.0, 200.0, -3.0), 40.0);
        let surface = flat(&mesh, 4);
        assert_eq!((surface.columns, surface.corners.len()), (5, 25));
        let corner = |at: usize| surface.corners[at].expect("there");
        // 40 m from west to east, 20 m from north to south.
        assert_eq!(corner(0), (DVec3::new(110.0, 180.0, -3.0), Color32::BLACK));
        assert_eq!(corner(24), (DVec3::new(90.0, 220.0, -3.0), Color32::WHITE));
        assert_eq!(corner(12).0, DVec3::new(100.0, 200.0, -3.0));
        let middle = corner(12).1.r();
        assert!(middle > 100 && middle < 230, "of both: {middle}");
    }

    #[test]
    fn mean_is_over_the_window_and_clamped_at_borders() {
        let texture = halves();
        assert_eq!(mean(&texture, [0.25, 0.5], [0.1, 0.1]), [0.0; 3]);
        assert_eq!(mean(&texture, [1.0, 1.0], [0.2, 0.2]), [1.0; 3]);
        let whole = mean(&texture, [0.5, 0.5], [1.0, 1.0])[0];
        assert!(whole > 0.3 && whole < 0.7, "{whole}");
    }
}
