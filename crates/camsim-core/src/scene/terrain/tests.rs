//! Tests of the terrain as a whole: fit of chunks, bounds, rays. For the drawn triangles see
//! `drawn_tests.rs`.
#![allow(clippy::unwrap_used)]

use glam::{DQuat, DVec3, Vec3};

use super::{query::intersect_triangle, *};
use crate::pose::CameraPose;

/// Repeatable pseudo-random numbers in 0..1.
pub(super) struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// Hills with some roughness.
pub(super) fn hills(cols: u32, rows: u32, cell_m: f64, relief_m: f64) -> Terrain {
    Terrain::from_heights(cols, rows, cell_m, &hill_heights(cols, rows, relief_m), None).unwrap()
}

pub(super) fn hill_heights(cols: u32, rows: u32, relief_m: f64) -> Vec<f64> {
    let mut random = Random(7);
    (0..rows)
        .flat_map(|j| (0..cols).map(move |i| (f64::from(i), f64::from(j))))
        .map(|(i, j)| relief_m * ((0.11 * i).sin() + (0.07 * j + 0.05 * i).cos() + 0.1 * random.next()))
        .collect()
}

/// A camera looking straight down, with the image top to the north.
pub(super) fn nadir(position_ned_m: DVec3) -> CameraPose {
    let x = DVec3::Y;
    let y = -DVec3::X;
    CameraPose { position_ned_m, ned_from_camera: DQuat::from_mat3(&glam::DMat3::from_cols(x, y, DVec3::Z)) }
}

/// A camera looking north, `pitch` below the horizon.
pub(super) fn forward(position_ned_m: DVec3, pitch: f64) -> CameraPose {
    let z = DVec3::new(pitch.cos(), 0.0, pitch.sin());
    let x = DVec3::Y;
    CameraPose {
        position_ned_m,
        ned_from_camera: DQuat::from_mat3(&glam::DMat3::from_cols(x, z.cross(x), z)),
    }
}

#[test]
fn shared_vertices_have_the_same_bits_at_any_distance() {
    let terrain = hills(150, 131, 37.3, 400.0);
    let [cols, rows] = terrain.chunk_grid;
    assert_eq!([cols, rows], [3, 3]);
    let cameras = [
        DVec3::ZERO,
        DVec3::new(1.0, -7.0, 3.0),
        DVec3::new(91_234.0, -77_777.0, -3000.0),
        DVec3::new(3e6, 2e6, -1e5),
    ];
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
fn positions_are_within_half_a_quantum() {
    let heights = hill_heights(70, 66, 400.0);
    let terrain = Terrain::from_heights(70, 66, 90.0, &heights, None).unwrap();
    assert!(terrain.quantum_m <= 5e-4, "{}", terrain.quantum_m);
    assert_eq!(terrain.vertices.len(), 65 * 65 + 6 * 65 + 65 * 2 + 6 * 2);
    for (row, column) in [(0u32, 0u32), (65, 69), (64, 64), (13, 40)] {
        let (chunk, [i, j]) = terrain.chunk_of_cell([column.min(68), row.min(64)]);
        let (i, j) = (i + column - column.min(68), j + row - row.min(64));
        let expected = DVec3::new(
            (32.5 - f64::from(row)) * 90.0,
            (f64::from(column) - 34.5) * 90.0,
            -heights[(row * 70 + column) as usize],
        );
        assert!(
            (terrain.position_ned_m(chunk, i, j) - expected).abs().max_element() <= 0.5 * terrain.quantum_m
        );
    }
}

#[test]
fn ray_hits_match_a_search_of_all_triangles() {
    let terrain = hills(140, 75, 10.0, 40.0);
    let mut random = Random(11);
    let mut hits = 0;
    for _ in 0..300 {
        let origin = DVec3::new(
            random.within(-500.0, 500.0),
            random.within(-800.0, 800.0),
            random.within(-300.0, 100.0),
        );
        let direction =
            DVec3::new(random.within(-1.0, 1.0), random.within(-1.0, 1.0), random.within(-0.3, 1.0));
        let mut expected: Option<f64> = None;
        for (index, chunk) in terrain.chunks.iter().enumerate() {
            for cell in (0..chunk.cells[0] * chunk.cells[1]).map(|n| [n % chunk.cells[0], n / chunk.cells[0]])
            {
                for t in cell_triangles(cell) {
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
            assert!(
                (0..2).all(|k| (hit.uv[k] - expected_uv[k]).abs() < 1e-5),
                "{:?} {expected_uv:?}",
                hit.uv
            );
            assert!(hit.normal_ned.z < 0.0);
            let distance = (point - origin).length();
            assert!(terrain.min_distance_m(origin) <= distance);
        }
    }
    assert!(hits > 50, "{hits}");
}

#[test]
fn no_ray_slips_through_between_triangles() {
    // Level ground seen from points on its own grid: every ray hits vertices and edges exactly.
    let terrain = Terrain::from_heights(131, 131, 1.0, &vec![0.0; 131 * 131], None).unwrap();
    for j in -65..=65 {
        for i in -65..=65 {
            let target = DVec3::new(f64::from(j), f64::from(i), 0.0);
            for origin in
                [target - DVec3::Z * 10.0, DVec3::new(0.0, 0.0, -16.0), DVec3::new(3.0, -1.0, -0.125)]
            {
                let hit = terrain.intersect(origin, target - origin, 2.0).unwrap();
                assert!((hit.t - 1.0).abs() < 1e-9, "{target} {origin} {}", hit.t);
            }
        }
    }
    // A rough terrain: rays at its vertices from afar.
    let rough = hills(70, 70, 7.7, 25.0);
    for (index, chunk) in rough.chunks.iter().enumerate() {
        for n in 0..chunk.cells[0] * chunk.cells[1] {
            let (i, j) = (n % chunk.cells[0], n / chunk.cells[0]);
            if i + j == 0 {
                continue;
            }
            let target = rough.position_ned_m(index as u32, i, j);
            if index == 0 && i > 0 && j > 0 {
                assert!(
                    rough
                        .intersect(
                            DVec3::new(11.3, -17.7, -5000.0),
                            target - DVec3::new(11.3, -17.7, -5000.0),
                            1.1
                        )
                        .is_some()
                );
                assert!((rough.down_at(target.x, target.y).unwrap() - target.z).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn distance_in_view_matches_the_visible_surface() {
    let terrain = hills(200, 200, 10.0, 1.0);
    // Low over the southern end, looking up: nothing in sight; looking along: much less than looking back.
    let position = DVec3::new(-900.0, 0.0, -30.0);
    let tangents = [-0.5, 0.5, -0.4, 0.4];
    assert_eq!(terrain.min_distance_in_view_m(&forward(position, -1.0), tangents), f64::INFINITY);
    let ahead = terrain.min_distance_in_view_m(&forward(position, 0.0), tangents);
    let anywhere = terrain.min_distance_m(position);
    let vertices = |i: usize| (0..65).flat_map(move |a| (0..65).map(move |b| (i as u32, a, b)));
    let inside = |&(i, a, b): &(u32, u32, u32)| {
        a <= terrain.chunks[i as usize].cells[0] && b <= terrain.chunks[i as usize].cells[1]
    };
    let distance = |(i, a, b)| terrain.position_ned_m(i, a, b).distance(position);
    let nearest = (0..terrain.chunks.len())
        .flat_map(vertices)
        .filter(inside)
        .map(distance)
        .fold(f64::INFINITY, f64::min);
    assert!(
        anywhere <= nearest && anywhere > nearest - 2.0 && ahead > nearest && ahead < 90.0,
        "{anywhere} {nearest} {ahead}"
    );
}

#[test]
fn invalid_grids_are_refused() {
    assert!(matches!(Terrain::from_heights(0, 0, 1.0, &[], None), Err(TerrainError::TooSmall { .. })));
    assert!(matches!(Terrain::from_heights(1, 1, 1.0, &[0.0], None), Err(TerrainError::TooSmall { .. })));
    assert!(matches!(
        Terrain::from_heights(2, 2, 1.0, &[0.0; 3], None),
        Err(TerrainError::Length { got: 3, .. })
    ));
    assert_eq!(Terrain::from_heights(2, 2, 1.0, &[f64::NAN; 4], None).unwrap_err(), TerrainError::AllVoid);
    assert!(matches!(Terrain::from_heights(2, 2, 1e9, &[0.0; 4], None), Err(TerrainError::TooFar { .. })));
    assert!(matches!(Terrain::from_heights(2, 2, f64::NAN, &[0.0; 4], None), Err(TerrainError::AllVoid)));
}

#[test]
fn non_finite_queries_do_not_panic() {
    let terrain = hills(100, 100, 10.0, 20.0);
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1e300, -1e300, f64::MIN_POSITIVE];
    for x in bad {
        for y in bad {
            let (p, d) = (DVec3::new(x, y, x), DVec3::new(y, x, y));
            let _ = terrain.intersect(p, d, 1e9);
            let _ = terrain.intersect(DVec3::new(0.0, 0.0, -100.0), d, x);
            let _ = (terrain.min_distance_m(p), terrain.down_at(x, y));
            let camera = CameraPose { position_ned_m: p, ned_from_camera: DQuat::from_xyzw(x, y, x, y) };
            let _ = TerrainDetail::new(&terrain, &camera, [x, y, y, x], y, x).mesh();
            let _ = TerrainDetail::new(
                &terrain,
                &nadir(DVec3::new(0.0, 0.0, -100.0)),
                [-1.0, 1.0, -1.0, 1.0],
                x,
                y,
            )
            .mesh();
        }
    }
    assert_eq!(terrain.intersect(DVec3::new(0.0, 0.0, -100.0), DVec3::ZERO, 1e9), None);
}

#[test]
fn largest_chunk_determines_the_quantum() {
    // 40 x 40 chunks, one of them with a peak higher than any other chunk is wide, and not among the sampled
    // chunks.
    let side = 64 * 40 + 1;
    let mut heights = vec![0.0; (side * side) as usize];
    let peak = [64 * 17 + 30, 64 * 23 + 11];
    heights[(peak[1] * side + peak[0]) as usize] = 9000.0;
    let terrain = Terrain::from_heights(side, side, 3.0, &heights, None).unwrap();
    // Half of 9000 m needs 13 of 24 bits.
    assert_eq!(terrain.quantum_m, 2f64.powi(13 - 23));
    let (chunk, [i, j]) = terrain.chunk_of_cell(peak);
    let peak_ned_m = DVec3::new(
        (32.0 * 40.0 - f64::from(peak[1])) * 3.0,
        (f64::from(peak[0]) - 32.0 * 40.0) * 3.0,
        -9000.0,
    );
    assert_eq!(terrain.position_ned_m(chunk, i, j), peak_ned_m);
    assert!(
        (25.0..27.0).contains(&(terrain.memory_bytes() as f64 / f64::from(side * side))),
        "{}",
        terrain.memory_bytes()
    );
}

#[test]
fn border_parts_match_a_test_of_all_sides() {
    let mut random = Random(37);
    let mut counts = [0, 0];
    for bend_m in [0.0, 40.0, -25.0] {
        // Sides bulge or cave in; 3 x 2 chunks and a remainder.
        let (cols, rows) = (64 * 3 + 20, 64 * 2 + 5);
        let uvs = vec![[0.0; 2]; (cols * rows) as usize];
        let points: Vec<DVec3> = (0..cols * rows)
            .map(|k| {
                let [i, j] =
                    [f64::from(k % cols) / f64::from(cols - 1), f64::from(k / cols) / f64::from(rows - 1)];
                let bulge = |t: f64| bend_m * (std::f64::consts::PI * t).sin();
                DVec3::new((0.5 - j) * (1300.0 + 2.0 * bulge(i)), (i - 0.5) * (2100.0 + 2.0 * bulge(j)), 0.0)
            })
            .collect();
        let texture = Arc::new(crate::scene::Texture::uniform([255; 4], crate::scene::Encoding::Srgb));
        let terrain = Terrain::new(cols, rows, &points, &uvs, texture).unwrap();
        for _ in 0..400 {
            let position = glam::DVec2::new(random.within(-700.0, 700.0), random.within(-1150.0, 1150.0));
            let turns: Vec<f64> =
                (0..terrain.border_sides()).map(|side| terrain.side_turn(side, position)).collect();
            let all = turns.iter().all(|&turn| turn > 0.0) || turns.iter().all(|&turn| turn < 0.0);
            assert_eq!(terrain.border_faces_away_from(position.extend(-500.0)), all, "{position} {bend_m}");
            counts[usize::from(all)] += 1;
        }
    }
    assert!(counts[0] > 150 && counts[1] > 300, "{counts:?}");
}

#[test]
fn a_walk_to_the_next_pixel_ends_where_its_ray_hits_the_same_patch() {
    let terrain = hills(140, 135, 10.0, 40.0);
    let camera = forward(DVec3::new(-500.0, 30.0, -90.0), 0.3);
    let ray =
        |x: i32, y: i32| camera.ned_from_camera * DVec3::new(f64::from(x) / 160.0, f64::from(y) / 160.0, 1.0);
    let first = |x, y| terrain.intersect(camera.position_ned_m, ray(x, y), f64::INFINITY);
    let (mut same, mut given_up, mut astray, mut hidden, mut lost) = (0, 0, 0, 0, 0);
    for (x, y) in (-80..80).flat_map(|y| (-100..100).map(move |x| (x, y))) {
        for (to_x, to_y) in [(x + 1, y), (x, y + 1)] {
            let (Some(here), Some(next)) = (first(x, y), first(to_x, to_y)) else { continue };
            let to = ray(to_x, to_y);
            match terrain.walk(here.triangle_of(&terrain), camera.position_ned_m, to) {
                Some(WalkHit { triangle, t, .. }) if (t - next.t).abs() <= 1e-9 * t => {
                    same += 1;
                    // Where a silhouette ends, a walk may pass round it to the other sheet or to a triangle
                    // that faces away.
                    match terrain.walk(triangle, camera.position_ned_m, ray(x, y)) {
                        Some(WalkHit { t, .. }) => astray += usize::from((t - here.t).abs() > 1e-9 * t),
                        None => given_up += 1,
                    }
                }
                // A root behind the first surface.
                Some(WalkHit { t, .. }) => {
                    hidden += 1;
                    assert!(t > next.t, "{t} {next:?}");
                    let start = camera.position_ned_m + (1.0 - 1e-6) * t * to;
                    let again = terrain.intersect(start, to, 2e-6 * t).unwrap();
                    assert!((again.t - 1e-6 * t).abs() <= 1e-9 * t);
                }
                None => lost += 1,
            }
        }
    }
    // Most neighbours are on one patch; at ridges one hides the other.
    assert!(same > 40_000 && given_up < same / 100, "{same} {given_up}");
    assert!(astray < same / 10_000, "{astray} of {same}");
    assert!(hidden > 20 && lost > 200, "{hidden} {lost}");
}
