//! The terrain as a whole: fit of chunks, bounds, rays, selection.
#![allow(clippy::unwrap_used)]

use glam::{DQuat, DVec3, Vec3};

use super::{query::intersect_triangle, stitch::cell_triangles, *};
use crate::pose::CameraPose;

/// Repeatable numbers in 0..1 without a dependency.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// Hills with some roughness.
fn hills(cols: u32, rows: u32, cell_m: f64, relief_m: f64) -> Terrain {
    Terrain::from_heights(cols, rows, cell_m, &hill_heights(cols, rows, relief_m), None).unwrap()
}

fn hill_heights(cols: u32, rows: u32, relief_m: f64) -> Vec<f64> {
    let mut random = Random(7);
    (0..rows)
        .flat_map(|j| (0..cols).map(move |i| (f64::from(i), f64::from(j))))
        .map(|(i, j)| relief_m * ((0.11 * i).sin() + (0.07 * j + 0.05 * i).cos() + 0.1 * random.next()))
        .collect()
}

/// Looking straight down, image top to the north.
fn nadir(position_ned_m: DVec3) -> CameraPose {
    let x = DVec3::Y;
    let y = -DVec3::X;
    CameraPose { position_ned_m, ned_from_camera: DQuat::from_mat3(&glam::DMat3::from_cols(x, y, DVec3::Z)) }
}

/// Looking north, `pitch` below the horizon.
fn forward(position_ned_m: DVec3, pitch: f64) -> CameraPose {
    let z = DVec3::new(pitch.cos(), 0.0, pitch.sin());
    let x = DVec3::Y;
    CameraPose { position_ned_m, ned_from_camera: DQuat::from_mat3(&glam::DMat3::from_cols(x, z.cross(x), z)) }
}

/// Point of a piecewise linear surface at grid coordinates, over the triangles of one chunk.
fn surface_point(terrain: &Terrain, chunk: u32, level: u8, edges: [u8; 4], at: [f64; 2]) -> Option<DVec3> {
    let cells = terrain.chunks[chunk as usize].cells;
    let [nx, ny] = cells.map(|n| n.div_ceil(1 << level));
    for b in 0..ny {
        for a in 0..nx {
            for triangle in cell_triangles([a, b], cells, level, edges) {
                let flat = triangle.map(|[i, j]| DVec3::new(f64::from(i), f64::from(j), 0.0));
                let ray = DVec3::new(at[0], at[1], -1.0);
                if let Some((_, w)) = intersect_triangle(flat, ray, DVec3::Z, 2.0) {
                    let p = triangle.map(|[i, j]| terrain.position_ned_m(chunk, i, j));
                    return Some(p[0] * w[0] + p[1] * w[1] + p[2] * w[2]);
                }
            }
        }
    }
    None
}

#[test]
fn shared_vertices_have_the_same_bits_at_any_distance() {
    let terrain = hills(150, 131, 37.3, 400.0);
    let [cols, rows] = terrain.chunk_grid;
    assert_eq!([cols, rows], [3, 3]);
    let cameras = [DVec3::ZERO, DVec3::new(1.0, -7.0, 3.0), DVec3::new(91_234.0, -77_777.0, -3000.0), DVec3::new(3e6, 2e6, -1e5)];
    let relative = |chunk: u32, i: u32, j: u32, camera: DVec3| {
        let chunk = &terrain.chunks[chunk as usize];
        let offset = terrain.vertices[(chunk.first_vertex + j * (chunk.cells[0] + 1) + i) as usize].offset_m;
        assert_eq!(chunk.centre_ned_m, chunk.centre_ned_m.round());
        ((chunk.centre_ned_m - camera).as_vec3() + Vec3::from(offset)).to_array().map(f32::to_bits)
    };
    for camera in cameras {
        for chunk in 0..cols * rows {
            let cells = terrain.chunks[chunk as usize].cells;
            if chunk % cols + 1 < cols {
                for j in 0..=cells[1] {
                    assert_eq!(relative(chunk, cells[0], j, camera), relative(chunk + 1, 0, j, camera));
                }
            }
            if chunk / cols + 1 < rows {
                for i in 0..=cells[0] {
                    assert_eq!(relative(chunk, i, cells[1], camera), relative(chunk + cols, i, 0, camera));
                }
            }
        }
    }
}

#[test]
fn positions_are_kept_within_half_a_quantum() {
    let heights = hill_heights(70, 66, 400.0);
    let terrain = Terrain::from_heights(70, 66, 90.0, &heights, None).unwrap();
    assert!(terrain.quantum_m <= 5e-4, "{}", terrain.quantum_m);
    assert_eq!(terrain.vertices.len(), 65 * 65 + 6 * 65 + 65 * 2 + 6 * 2);
    for (row, column) in [(0u32, 0u32), (65, 69), (64, 64), (13, 40)] {
        let (chunk, [i, j]) = terrain.chunk_of_cell([column.min(68), row.min(64)]);
        let (i, j) = (i + column - column.min(68), j + row - row.min(64));
        let expected =
            DVec3::new((32.5 - f64::from(row)) * 90.0, (f64::from(column) - 34.5) * 90.0, -heights[(row * 70 + column) as usize]);
        assert!((terrain.position_ned_m(chunk, i, j) - expected).abs().max_element() <= 0.5 * terrain.quantum_m);
    }
}

#[test]
fn level_errors_are_exact_bounds_for_every_stitching() {
    // Odd sizes have cut cells, whose diagonals cross the grid between vertices.
    for (cols, rows) in [(65, 35), (23, 14), (8, 6)] {
        let terrain = hills(cols, rows, 10.0, 30.0);
        let chunk = &terrain.chunks[0];
        let mut random = Random(3);
        for level in 0..5u8 {
            let (mut seen, mut seen_stitched) = (0.0_f64, 0.0_f64);
            for mask in 0..16u8 {
                let edges = std::array::from_fn(|e| level + (mask >> e & 1));
                let limit = if mask == 0 { chunk.error } else { chunk.stitched_error }[level as usize];
                for _ in 0..200 {
                    // Multiples of 1/12 hit many corners of the overlay exactly.
                    let at = chunk.cells.map(|n| (random.next() * f64::from(12 * n)).round() / 12.0);
                    let full = surface_point(&terrain, 0, 0, [0; 4], at).unwrap();
                    let coarse = surface_point(&terrain, 0, level, edges, at).unwrap();
                    let deviation = full - coarse;
                    assert!(deviation.length() <= f64::from(limit.total_m) + 1e-9, "{level} {mask} {deviation} {limit:?}");
                    assert!(deviation.truncate().length() <= f64::from(limit.horizontal_m) + 1e-9);
                    if mask == 0 {
                        seen = seen.max(deviation.length());
                    }
                    seen_stitched = seen_stitched.max(deviation.length());
                }
            }
            // Not only a bound: 200 samples come near it (3200 for the stitched one).
            let level = level as usize;
            assert!(seen >= 0.5 * f64::from(chunk.error[level].total_m), "{cols} {level} {seen} {:?}", chunk.error[level]);
            // Stitching moves the border only, which few samples meet on a larger grid.
            assert!(cols > 10 || seen_stitched >= 0.7 * f64::from(chunk.stitched_error[level].total_m), "{cols} {level} {seen_stitched}");
        }
        assert_eq!(chunk.error[0], LevelError::default());
        for level in 1..LEVELS {
            assert!(chunk.error[level].total_m >= chunk.error[level - 1].total_m);
            assert!(chunk.stitched_error[level].total_m >= chunk.error[level].total_m);
        }
    }
}

#[test]
fn rays_meet_what_a_search_through_all_triangles_meets() {
    let terrain = hills(140, 75, 10.0, 40.0);
    let mut random = Random(11);
    let mut hits = 0;
    for _ in 0..300 {
        let origin = DVec3::new(random.within(-500.0, 500.0), random.within(-800.0, 800.0), random.within(-300.0, 100.0));
        let direction = DVec3::new(random.within(-1.0, 1.0), random.within(-1.0, 1.0), random.within(-0.3, 1.0));
        let mut expected: Option<f64> = None;
        for (index, chunk) in terrain.chunks.iter().enumerate() {
            for cell in (0..chunk.cells[0] * chunk.cells[1]).map(|n| [n % chunk.cells[0], n / chunk.cells[0]]) {
                for t in cell_triangles(cell, chunk.cells, 0, [0; 4]) {
                    let points = t.map(|[i, j]| terrain.position_ned_m(index as u32, i, j));
                    if let Some((t, _)) = intersect_triangle(points, origin, direction, 2000.0) {
                        expected = Some(expected.map_or(t, |e: f64| e.min(t)));
                    }
                }
            }
        }
        let got = terrain.intersect(origin, direction, 2000.0);
        assert_eq!(got.map(|hit| hit.t), expected);
        if let Some(hit) = got {
            hits += 1;
            let point = origin + hit.t * direction;
            // Texture coordinates are affine in the plane here.
            let expected_uv = [(point.y / 10.0 + 69.5 + 0.5) / 140.0, (37.0 - point.x / 10.0 + 0.5) / 75.0];
            assert!((0..2).all(|k| (hit.uv[k] - expected_uv[k]).abs() < 1e-5), "{:?} {expected_uv:?}", hit.uv);
            assert!(hit.normal_ned.z < 0.0);
            let distance = (point - origin).length();
            assert!(terrain.min_distance_m(origin) <= distance && terrain.max_distance_m(origin) >= distance);
        }
    }
    assert!(hits > 50, "{hits}");
}

#[test]
fn rays_meet_the_drawn_surface_where_its_triangles_are() {
    let terrain = hills(65, 65, 10.0, 30.0);
    let cells = terrain.chunks[0].cells;
    let mut random = Random(5);
    for level in 0..4_u8 {
        {
            let edge_levels = [level; 4];
            let draw = ChunkDraw { chunk: 0, level, edge_levels };
            let [nx, ny] = cells.map(|n| n.div_ceil(1 << level));
            let triangles: Vec<[DVec3; 3]> = (0..nx * ny)
                .flat_map(|i| cell_triangles([i % nx, i / nx], cells, level, edge_levels))
                .map(|corners| corners.map(|[i, j]| terrain.position_ned_m(0, i, j)))
                .collect();
            let (mut met, mut moved) = (0, 0.0_f64);
            for _ in 0..300 {
                let above = DVec3::new(random.within(-320.0, 320.0), random.within(-320.0, 320.0), -500.0);
                // Straight down the two surfaces are met in one and the same cell.
                let along = DVec3::Z;
                let Some(hit) = terrain.intersect(above, along, f64::INFINITY) else { continue };
                let exact = triangles.iter().filter_map(|&t| Some(intersect_triangle(t, above, along, f64::INFINITY)?.0));
                let Some(exact) = exact.min_by(f64::total_cmp) else { continue };
                let found = terrain.drawn_t(&hit, &draw, above, along);
                met += 1;
                moved = moved.max((exact - hit.t).abs());
                assert!((found - exact).abs() < 1e-6, "level {level}: {found} {exact} {}", hit.t);
            }
            assert!(met > 200, "level {level}: {met}");
            assert!((level == 0) == (moved < 1e-9), "level {level} moves by {moved}");
        }
    }
}

#[test]
fn no_ray_slips_through_between_triangles() {
    // Level ground seen from points on its own grid: every ray meets vertices and edges exactly.
    let terrain = Terrain::from_heights(131, 131, 1.0, &vec![0.0; 131 * 131], None).unwrap();
    for j in -65..=65 {
        for i in -65..=65 {
            let target = DVec3::new(f64::from(j), f64::from(i), 0.0);
            for origin in [target - DVec3::Z * 10.0, DVec3::new(0.0, 0.0, -16.0), DVec3::new(3.0, -1.0, -0.125)] {
                let hit = terrain.intersect(origin, target - origin, 2.0).unwrap();
                assert!((hit.t - 1.0).abs() < 1e-9, "{target} {origin} {}", hit.t);
            }
        }
    }
    // A rough one: rays at its vertices from afar.
    let rough = hills(70, 70, 7.7, 25.0);
    for (index, chunk) in rough.chunks.iter().enumerate() {
        for n in 0..chunk.cells[0] * chunk.cells[1] {
            let (i, j) = (n % chunk.cells[0], n / chunk.cells[0]);
            if i + j == 0 {
                continue;
            }
            let target = rough.position_ned_m(index as u32, i, j);
            if index == 0 && i > 0 && j > 0 {
                assert!(rough.intersect(DVec3::new(11.3, -17.7, -5000.0), target - DVec3::new(11.3, -17.7, -5000.0), 1.1).is_some());
                assert!((rough.down_at(target.x, target.y).unwrap() - target.z).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn level_ground_needs_two_triangles_a_chunk() {
    let terrain = Terrain::from_heights(200, 200, 10.0, &vec![0.0; 40_000], None).unwrap();
    let selection = select_lod(&terrain, &nadir(DVec3::new(0.0, 0.0, -5000.0)), [-1.0, 1.0, -1.0, 1.0], 500.0, 1e-9);
    // Not 0: barycentric weights of a plane's own points are rounded.
    assert_eq!((selection.draws.len(), selection.triangles), (16, 32));
    assert!(selection.max_error_px <= 1e-9);
    assert!(selection.draws.iter().all(|draw| draw.level == 6 && draw.edge_levels == [6; 4]));
}

#[test]
fn the_selection_keeps_its_promise() {
    let terrain = hills(330, 290, 10.0, 40.0);
    let tangents = [-0.7, 0.9, -0.6, 0.5];
    let cameras = [
        nadir(DVec3::new(100.0, 50.0, -900.0)),
        forward(DVec3::new(-1300.0, 20.0, -200.0), 0.3),
        forward(DVec3::new(-3000.0, -400.0, -500.0), 0.15),
        forward(DVec3::new(0.0, 0.0, -20.0), 0.1),
    ];
    let mut random = Random(5);
    for camera in cameras {
        let camera_from_ned = camera.ned_from_camera.inverse();
        let project = |point: DVec3| {
            let p = camera_from_ned * (point - camera.position_ned_m);
            (p.z > 1e-6).then(|| [p.x / p.z, p.y / p.z])
        };
        let is_in_sight = |[u, v]: [f64; 2]| (tangents[0]..=tangents[1]).contains(&u) && (tangents[2]..=tangents[3]).contains(&v);
        for max_error_px in [0.1, 0.25, 2.0] {
            let selection = select_lod(&terrain, &camera, tangents, 400.0, max_error_px);
            assert!(selection.max_error_px <= max_error_px, "{} > {max_error_px}", selection.max_error_px);
            let drawn = |chunk: usize| selection.draws.iter().find(|draw| draw.chunk as usize == chunk);
            // What is in sight is drawn.
            for (index, chunk) in terrain.chunks.iter().enumerate() {
                let is_seen = (0..=chunk.cells[1])
                    .flat_map(|j| (0..=chunk.cells[0]).map(move |i| (i, j)))
                    .any(|(i, j)| project(terrain.position_ned_m(index as u32, i, j)).is_some_and(is_in_sight));
                assert!(!is_seen || drawn(index).is_some());
            }
            for draw in &selection.draws {
                assert!(draw.edge_levels.iter().all(|&edge| edge == draw.level || edge == draw.level + 1));
                let cells = terrain.chunks[draw.chunk as usize].cells;
                for _ in 0..20 {
                    let at = cells.map(|n| random.next() * f64::from(n));
                    let full = surface_point(&terrain, draw.chunk, 0, [0; 4], at).unwrap();
                    let coarse = surface_point(&terrain, draw.chunk, draw.level, draw.edge_levels, at).unwrap();
                    if let (Some(a), Some(b)) = (project(full), project(coarse))
                        && is_in_sight(a)
                        && is_in_sight(b)
                    {
                        let moved = 400.0 * (a[0] - b[0]).hypot(a[1] - b[1]);
                        assert!(moved <= selection.max_error_px * (1.0 + 1e-3) + 1e-9, "{moved} px");
                    }
                }
            }
        }
    }
    let fine = select_lod(&terrain, &cameras[2], tangents, 400.0, 0.25);
    let coarse = select_lod(&terrain, &cameras[2], tangents, 400.0, 2.0);
    assert!(coarse.triangles * 2 < fine.triangles, "{} {}", coarse.triangles, fine.triangles);
    assert!(coarse.draws.iter().any(|draw| draw.edge_levels.iter().any(|&edge| edge > draw.level)));
}

#[test]
fn distance_in_view_is_that_of_what_the_camera_sees() {
    let terrain = hills(200, 200, 10.0, 1.0);
    // Low over the southern end, looking up: nothing; looking along: far less than behind.
    let position = DVec3::new(-900.0, 0.0, -30.0);
    let tangents = [-0.5, 0.5, -0.4, 0.4];
    assert_eq!(terrain.min_distance_in_view_m(&forward(position, -1.0), tangents), f64::INFINITY);
    let ahead = terrain.min_distance_in_view_m(&forward(position, 0.0), tangents);
    let anywhere = terrain.min_distance_m(position);
    let vertices = |i: usize| (0..65).flat_map(move |a| (0..65).map(move |b| (i as u32, a, b)));
    let inside = |&(i, a, b): &(u32, u32, u32)| a <= terrain.chunks[i as usize].cells[0] && b <= terrain.chunks[i as usize].cells[1];
    let distance = |(i, a, b)| terrain.position_ned_m(i, a, b).distance(position);
    let nearest = (0..terrain.chunks.len()).flat_map(vertices).filter(inside).map(distance).fold(f64::INFINITY, f64::min);
    assert!(anywhere <= nearest && anywhere > nearest - 2.0 && ahead > nearest && ahead < 90.0, "{anywhere} {nearest} {ahead}");
}

#[test]
fn voids_lose_their_triangles_only() {
    let mut heights = hill_heights(130, 130, 5.0);
    heights[0] = f64::NAN; // north-west corner: the first cell loses both triangles
    heights[130] = f64::INFINITY;
    heights[64] = f64::NAN; // on the border of two chunks
    let terrain = Terrain::from_heights(130, 130, 10.0, &heights, None).unwrap();
    assert_eq!(terrain.chunks.iter().filter(|c| c.void_indices.is_some()).count(), 2);
    // Corners: (0,0) touches 1 cell, (0,1) 2 of which one was counted, (64,0) one in each chunk.
    assert_eq!(terrain.void_cells, 4);
    let all = 2 * 129 * 129;
    let selection = select_lod(&terrain, &nadir(DVec3::new(0.0, 0.0, -800.0)), [-1.0, 1.0, -1.0, 1.0], 500.0, 0.0);
    // (0,0) and (0,1) take both triangles of cell (0,0); (0,1) is also the north-west of cell (0,1): both of its triangles.
    // (64,0) is the north-east of cell (63,0), one triangle, and the north-west of cell (64,0), both.
    assert_eq!(selection.triangles, all - 7);
    assert!(selection.draws.iter().all(|draw| draw.level == 0));
    let north_west = terrain.intersect(DVec3::new(644.9, -644.9, -100.0), DVec3::Z, 200.0);
    assert_eq!(north_west, None);
    assert!(terrain.down_at(0.0, 0.0).is_some());
    // With a wide tolerance the void chunks stay complete, and so do their neighbours.
    let loose = select_lod(&terrain, &nadir(DVec3::new(0.0, 0.0, -8000.0)), [-1.0, 1.0, -1.0, 1.0], 500.0, 100.0);
    let level = |chunk: u32| loose.draws.iter().find(|d| d.chunk == chunk).unwrap().level;
    assert_eq!((level(0), level(1), level(2), level(3), level(4)), (0, 0, 0, 0, 0));
    assert!(level(8) >= 1);
    for &index in &terrain.void_indices {
        assert!(index < 65 * 65);
    }
    for chunk in &terrain.chunks {
        for local in terrain.void_indices[chunk.void_indices.clone().unwrap_or_default().start as usize..]
            [..chunk.void_indices.as_ref().map_or(0, |r| r.len())]
            .iter()
        {
            assert!(terrain.vertices[(chunk.first_vertex + local) as usize].offset_m[0].is_finite());
        }
    }
}

#[test]
fn grids_that_are_no_terrain_are_refused() {
    assert!(matches!(Terrain::from_heights(0, 0, 1.0, &[], None), Err(TerrainError::TooSmall { .. })));
    assert!(matches!(Terrain::from_heights(1, 1, 1.0, &[0.0], None), Err(TerrainError::TooSmall { .. })));
    assert!(matches!(Terrain::from_heights(2, 2, 1.0, &[0.0; 3], None), Err(TerrainError::Length { got: 3, .. })));
    assert_eq!(Terrain::from_heights(2, 2, 1.0, &[f64::NAN; 4], None).unwrap_err(), TerrainError::AllVoid);
    assert!(matches!(Terrain::from_heights(2, 2, 1e9, &[0.0; 4], None), Err(TerrainError::TooFar { .. })));
    assert!(matches!(Terrain::from_heights(2, 2, f64::NAN, &[0.0; 4], None), Err(TerrainError::AllVoid)));
}

#[test]
fn hostile_queries_answer_without_panic() {
    let terrain = hills(100, 100, 10.0, 20.0);
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1e300, -1e300, f64::MIN_POSITIVE];
    for x in bad {
        for y in bad {
            let (p, d) = (DVec3::new(x, y, x), DVec3::new(y, x, y));
            let _ = terrain.intersect(p, d, 1e9);
            let _ = terrain.intersect(DVec3::new(0.0, 0.0, -100.0), d, x);
            let _ = (terrain.min_distance_m(p), terrain.max_distance_m(p), terrain.down_at(x, y));
            let camera = CameraPose { position_ned_m: p, ned_from_camera: DQuat::from_xyzw(x, y, x, y) };
            let _ = select_lod(&terrain, &camera, [x, y, y, x], y, x);
            let _ = select_lod(&terrain, &nadir(DVec3::new(0.0, 0.0, -100.0)), [-1.0, 1.0, -1.0, 1.0], x, y);
        }
    }
    assert_eq!(terrain.intersect(DVec3::new(0.0, 0.0, -100.0), DVec3::ZERO, 1e9), None);
}
