//! Tests of the drawn terrain: it is complete, has no gaps, and is within its error of the full surface.
#![allow(clippy::unwrap_used)]

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::{
    query::intersect_triangle,
    select::VERTEX_BITS,
    tests::{Random, forward, hill_heights, hills, nadir},
    *,
};
use crate::pose::CameraPose;

const TANGENTS: [f64; 4] = [-0.7, 0.9, -0.6, 0.5];
const FOCAL_PX: f64 = 400.0;

/// Views from above, along the ground, from far away and from among the hills.
fn cameras() -> [CameraPose; 5] {
    [
        nadir(DVec3::new(100.0, 50.0, -900.0)),
        nadir(DVec3::new(0.0, 0.0, -9000.0)),
        forward(DVec3::new(-1300.0, 20.0, -200.0), 0.3),
        forward(DVec3::new(-3000.0, -400.0, -500.0), 0.15),
        forward(DVec3::new(0.0, 0.0, -20.0), 0.1),
    ]
}

fn detail(terrain: &Terrain, camera: &CameraPose, max_error_px: f64) -> TerrainMesh {
    TerrainDetail::new(terrain, camera, TANGENTS, FOCAL_PX, max_error_px).mesh()
}

/// Corners of the triangles as columns and rows of the full grid.
fn triangles(terrain: &Terrain, mesh: &TerrainMesh) -> Vec<[[u32; 2]; 3]> {
    let corner = |&index: &u32| {
        let chunk = mesh.chunks[(index >> VERTEX_BITS) as usize];
        let cells = terrain.chunks[chunk as usize].cells;
        let vertex = index & ((1 << VERTEX_BITS) - 1);
        assert!(vertex < (cells[0] + 1) * (cells[1] + 1));
        let [x, y] = [chunk % terrain.chunk_grid[0], chunk / terrain.chunk_grid[0]].map(|n| n * CHUNK_CELLS);
        [x + vertex % (cells[0] + 1), y + vertex / (cells[0] + 1)]
    };
    assert_eq!(mesh.indices.len() as u64, 3 * mesh.lod.triangles);
    mesh.indices.chunks_exact(3).map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])]).collect()
}

fn vertex_m(terrain: &Terrain, [i, j]: [u32; 2]) -> DVec3 {
    let (chunk, [a, b]) = terrain.chunk_of_cell([i.min(terrain.cells[0] - 1), j.min(terrain.cells[1] - 1)]);
    terrain.position_ned_m(chunk, a + i - i.min(terrain.cells[0] - 1), b + j - j.min(terrain.cells[1] - 1))
}

/// The full surface at grid coordinates.
fn full_m(terrain: &Terrain, at: [f64; 2]) -> DVec3 {
    let [i, j] = [0, 1].map(|k: usize| (at[k].max(0.0) as u32).min(terrain.cells[k] - 1));
    let (x, y) = (at[0] - f64::from(i), at[1] - f64::from(j));
    let [nw, ne, sw, se] =
        [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]].map(|node| vertex_m(terrain, node));
    if x > y { nw + x * (ne - nw) + y * (se - ne) } else { nw + y * (sw - nw) + x * (se - sw) }
}

/// Projection of a point: x/z, y/z.
fn seen(camera: &CameraPose, point: DVec3) -> Option<[f64; 2]> {
    let p = camera.ned_from_camera.inverse() * (point - camera.position_ned_m);
    let [u, v] = [p.x / p.z, p.y / p.z];
    let is_in_sight =
        p.z > 1e-6 && (TANGENTS[0]..=TANGENTS[1]).contains(&u) && (TANGENTS[2]..=TANGENTS[3]).contains(&v);
    is_in_sight.then_some([u, v])
}

/// Twice the area in cells; positive, as all triangles have the same orientation.
fn area2([a, b, c]: [[i64; 2]; 3]) -> i64 {
    (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
}

/// Number of triangles that contain each of two points per cell, in hundredths of a cell. Points on an edge,
/// which may occur where triangles are cut, count as zero.
fn covered(terrain: &Terrain, triangles: &[[[u32; 2]; 3]]) -> HashMap<[i64; 2], u32> {
    let mut covers: HashMap<[i64; 2], u32> = HashMap::new();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|p| p.map(|n| 100 * i64::from(n)));
        assert!(area2([a, b, c]) > 0, "{triangle:?}");
        let range = |k: usize| {
            let along = triangle.map(|p| i64::from(p[k]));
            along[0].min(along[1]).min(along[2])..along[0].max(along[1]).max(along[2])
        };
        for j in range(1) {
            for i in range(0) {
                for node in [[31, 62], [62, 31]] {
                    let p = [100 * i + node[0], 100 * j + node[1]];
                    let least = area2([a, b, p]).min(area2([b, c, p])).min(area2([c, a, p]));
                    if least >= 0 {
                        *covers.entry(p).or_default() += u32::from(least > 0);
                    }
                }
            }
        }
    }
    assert!(covers.len() as u64 <= 2 * u64::from(terrain.cells[0]) * u64::from(terrain.cells[1]));
    covers
}

/// Checks that triangles meet edge to edge, except at the border of the terrain and out of sight, and that
/// every point in sight is covered exactly once.
fn check_cover(terrain: &Terrain, camera: &CameraPose, mesh: &TerrainMesh) {
    let triangles = triangles(terrain, mesh);
    let edges: Vec<[[u32; 2]; 2]> =
        triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
    let known: HashSet<_> = edges.iter().collect();
    assert_eq!(known.len(), edges.len(), "two triangles on the same side of an edge");
    for &[a, b] in &edges {
        let along_border = |k: usize| a[k] == b[k] && (a[k] == 0 || a[k] == terrain.cells[k]);
        if known.contains(&[b, a]) || along_border(0) || along_border(1) {
            continue;
        }
        let [from, to] = [a, b].map(|node| vertex_m(terrain, node));
        let in_sight = (0..=16).any(|k| seen(camera, from.lerp(to, f64::from(k) / 16.0)).is_some());
        assert!(!in_sight, "a gap at {a:?} {b:?}");
    }
    let covered = covered(terrain, &triangles);
    assert!(covered.values().all(|&times| times <= 1));
    for j in 0..terrain.cells[1] {
        for i in 0..terrain.cells[0] {
            for node in [[31, 62], [62, 31]] {
                let p = [100 * i64::from(i) + node[0], 100 * i64::from(j) + node[1]];
                let is_seen = seen(camera, full_m(terrain, p.map(|n| n as f64 / 100.0))).is_some();
                assert!(!is_seen || covered.contains_key(&p), "{p:?} is in sight and not drawn");
            }
        }
    }
}

#[test]
fn drawn_triangles_cover_everything_in_sight() {
    // Whole chunks, and smaller ones: with odd sizes, and with a single row.
    for (cols, rows) in [(193, 129), (150, 131), (102, 66)] {
        let terrain = hills(cols, rows, 10.0, 40.0);
        for camera in cameras() {
            for max_error_px in [0.02, 0.25, 2.0, 30.0] {
                check_cover(&terrain, &camera, &detail(&terrain, &camera, max_error_px));
            }
        }
    }
}

/// Ray parameter of the first intersection with some triangles.
fn first_met(triangles: &[[DVec3; 3]], origin: DVec3, direction: DVec3) -> Option<f64> {
    let met = triangles
        .iter()
        .filter_map(|&triangle| Some(intersect_triangle(triangle, origin, direction, f64::INFINITY)?.0));
    met.min_by(f64::total_cmp)
}

#[test]
fn culled_back_faces_are_never_visible() {
    let mut random = Random(23);
    let (mut away, mut kept, mut met, mut behind) = (0, 0, 0, 0);
    // Slopes up to 1 and more, so that rays of flat views hit many slopes from behind.
    for (cols, rows) in [(129, 129), (102, 66)] {
        let terrain = hills(cols, rows, 10.0, 70.0);
        for _ in 0..6 {
            let over = [random.within(-300.0, 300.0), random.within(-300.0, 300.0)];
            let position = DVec3::new(
                over[0],
                over[1],
                terrain.down_at(over[0], over[1]).unwrap() - random.within(2.0, 90.0),
            );
            let camera = forward(position, random.within(0.0, 0.6));
            let detail = TerrainDetail::new(&terrain, &camera, TANGENTS, FOCAL_PX, random.within(0.1, 2.0));
            let (all, drawn) = (detail.mesh(), detail.visible_mesh());
            assert_eq!(all.lod.triangles, drawn.lod.triangles + drawn.lod.back_facing);
            assert_eq!(
                (all.lod.back_facing, all.lod.max_error_px, &all.chunks),
                (0, drawn.lod.max_error_px, &drawn.chunks)
            );
            (away, kept) = (away + drawn.lod.back_facing, kept + drawn.lod.triangles);
            let corners = |mesh: &TerrainMesh| -> Vec<[DVec3; 3]> {
                triangles(&terrain, mesh)
                    .into_iter()
                    .map(|t| t.map(|node| vertex_m(&terrain, node)))
                    .collect()
            };
            let (all, drawn) = (corners(&all), corners(&drawn));
            for _ in 0..60 {
                let uv = [random.within(TANGENTS[0], TANGENTS[1]), random.within(TANGENTS[2], TANGENTS[3])];
                let direction = camera.ned_from_camera * DVec3::new(uv[0], uv[1], 1.0);
                let hit_t = first_met(&all, position, direction);
                assert_eq!(hit_t, first_met(&drawn, position, direction));
                met += usize::from(hit_t.is_some());
                // A continued ray hits back faces, so an error would be visible.
                let on = hit_t.and_then(|t| first_met(&all, position + (t + 1e-3) * direction, direction));
                behind += usize::from(on.is_some());
            }
        }
    }
    eprintln!(
        "{away} of {} triangles face away; {met} rays meet the ground, {behind} go on to meet it again",
        away + kept
    );
    assert!(6 * away > kept && met > 300 && behind > 60, "{away} {kept} {met} {behind}");
}

#[test]
fn back_faces_are_drawn_where_they_may_be_visible() {
    let heights = hill_heights(129, 129, 70.0);
    let whole = Terrain::from_heights(129, 129, 10.0, &heights, None).unwrap();
    let drawn = |terrain: &Terrain, position: DVec3| {
        let detail = TerrainDetail::new(terrain, &forward(position, 0.2), TANGENTS, FOCAL_PX, 0.25);
        (detail.visible_mesh().lod, detail.mesh().lod)
    };
    let above = DVec3::new(-300.0, 0.0, whole.down_at(-300.0, 0.0).unwrap() - 20.0);
    let (to_draw, all) = drawn(&whole, above);
    assert!(to_draw.back_facing > 100 && to_draw.triangles < all.triangles);
    // Below the ground, and beside it, where its border is a cliff with nothing in front.
    for position in [above + DVec3::new(0.0, 0.0, 40.0), DVec3::new(-700.0, 0.0, -20.0)] {
        let (to_draw, all) = drawn(&whole, position);
        assert_eq!(to_draw, all);
        assert!(all.triangles > 100);
    }
    // A gap to look through.
    let mut holed = heights.clone();
    holed[64 * 129 + 64] = f64::NAN;
    let (to_draw, all) = drawn(&Terrain::from_heights(129, 129, 10.0, &holed, None).unwrap(), above);
    assert_eq!(to_draw, all);
    // A border that bends inwards far away, as a circle of latitude does: a ray along it leaves the terrain
    // and comes back.
    let bent = |bend_m: f64| {
        let coordinates = |k: usize| [(k % 129) as f64 - 64.0, 64.0 - (k / 129) as f64];
        let points: Vec<_> = heights
            .iter()
            .enumerate()
            .map(|(k, height)| {
                let [east, north] = coordinates(k);
                DVec3::new(10.0 * north + bend_m * (east / 64.0).powi(2), 10.0 * east, -height)
            })
            .collect();
        let texture = std::sync::Arc::new(Texture::uniform([255; 4], crate::scene::Encoding::Srgb));
        Terrain::new(129, 129, &points, &vec![[0.0; 2]; points.len()], texture).unwrap()
    };
    let near_border = DVec3::new(635.0, -500.0, -500.0);
    assert!(bent(0.0).is_seen_from_above(near_border));
    assert!(!bent(60.0).is_seen_from_above(near_border));
    // From the middle, no side of that border is seen from outside.
    assert!(bent(60.0).is_seen_from_above(DVec3::new(0.0, 0.0, -500.0)));
}

#[test]
fn drawn_triangles_cover_everything_from_any_camera() {
    let terrain = hills(140, 140, 10.0, 25.0);
    let mut random = Random(17);
    let mut halved = 0;
    for _ in 0..40 {
        let position = DVec3::new(
            random.within(-900.0, 900.0),
            random.within(-900.0, 900.0),
            random.within(-1500.0, 40.0),
        );
        let camera = forward(position, random.within(-0.2, 1.5));
        let mesh = detail(&terrain, &camera, 10f64.powf(random.within(-2.0, 1.5)));
        halved += usize::from(mesh.lod.triangles > 100 && mesh.lod.triangles < 20_000);
        check_cover(&terrain, &camera, &mesh);
    }
    assert!(halved > 10, "{halved} of 40 cases are in between");
}

#[test]
fn displacement_is_within_the_tolerance() {
    let terrain = hills(330, 290, 10.0, 40.0);
    let mut random = Random(5);
    for camera in cameras() {
        for max_error_px in [0.1, 0.25, 2.0] {
            let mesh = detail(&terrain, &camera, max_error_px);
            assert!(mesh.lod.max_error_px <= max_error_px, "{} > {max_error_px}", mesh.lod.max_error_px);
            let (mut worst, mut worst_from_aside) = (0.0_f64, 0.0_f64);
            for triangle in triangles(&terrain, &mesh) {
                let corners = triangle.map(|node| vertex_m(&terrain, node));
                for _ in 0..4 {
                    let (a, b) = (random.next(), random.next());
                    let [a, b] = if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] };
                    let weights = [1.0 - a - b, a, b];
                    let drawn: DVec3 = (0..3).map(|k| weights[k] * corners[k]).sum();
                    let position = [0, 1]
                        .map(|axis: usize| (0..3).map(|k| weights[k] * f64::from(triangle[k][axis])).sum());
                    let full = full_m(&terrain, position);
                    if let (Some(a), Some(b)) = (seen(&camera, full), seen(&camera, drawn)) {
                        worst = worst.max(FOCAL_PX * (a[0] - b[0]).hypot(a[1] - b[1]));
                        let depth_m = (camera.ned_from_camera.inverse() * (full - camera.position_ned_m)).z;
                        worst_from_aside =
                            worst_from_aside.max(FOCAL_PX * (full.z - drawn.z).abs() / depth_m);
                    }
                }
            }
            assert!(worst <= mesh.lod.max_error_px + 1e-6, "{worst} > {} px", mesh.lod.max_error_px);
            assert!(worst_from_aside <= max_error_px, "{worst_from_aside} > {max_error_px} px");
            // The error is not only bounded, but reached.
            let worst = worst.max(worst_from_aside);
            assert!(
                mesh.lod.triangles > 50_000 || worst > 0.3 * max_error_px,
                "{worst} of {max_error_px} px"
            );
        }
    }
    let fine = detail(&terrain, &cameras()[3], 0.25).lod.triangles;
    let coarse = detail(&terrain, &cameras()[3], 2.0).lod.triangles;
    assert!(coarse * 3 < fine, "{coarse} {fine}");
}

#[test]
fn zero_tolerance_gives_the_full_surface() {
    let terrain = hills(140, 100, 10.0, 40.0);
    let camera = nadir(DVec3::new(0.0, 0.0, -2500.0));
    let mesh = detail(&terrain, &camera, 0.0);
    assert_eq!((mesh.lod.triangles, mesh.lod.max_error_px), (2 * 139 * 99, 0.0));
    // Every diagonal runs from north-west to south-east.
    let diagonals = |t: &[[u32; 2]; 3]| {
        (0..3)
            .filter(|&k| t[k].map(|n| n + 1) == t[(k + 1) % 3] || t[(k + 1) % 3].map(|n| n + 1) == t[k])
            .count()
    };
    assert!(triangles(&terrain, &mesh).iter().all(|t| diagonals(t) == 1));
}

#[test]
fn level_ground_needs_two_triangles_per_chunk() {
    let terrain = Terrain::from_heights(200, 200, 10.0, &vec![0.0; 40_000], None).unwrap();
    let camera = nadir(DVec3::new(0.0, 0.0, -5000.0));
    let lod = detail(&terrain, &camera, 1e-9).lod;
    // Not 0: the barycentric weights of a plane's own points are rounded.
    assert_eq!((lod.chunks, lod.triangles), (16, 32));
    assert!(lod.max_error_px <= 1e-9);
}

#[test]
fn one_cliff_does_not_refine_its_chunk() {
    let mut heights = vec![0.0; 129 * 129];
    heights[20 * 129 + 20] = 30.0;
    let terrain = Terrain::from_heights(129, 129, 10.0, &heights, None).unwrap();
    let mesh = detail(&terrain, &nadir(DVec3::new(0.0, 0.0, -2000.0)), 0.25);
    assert!(mesh.lod.triangles < 120, "{}", mesh.lod.triangles);
}

#[test]
fn terrain_out_of_view_adds_no_triangles() {
    // The same hills in a wider terrain, with additional whole chunks on each side.
    let heights = |side: u32| -> Vec<f64> {
        let coordinate = |index: u32| f64::from(index) - f64::from(side / 2);
        (0..side * side)
            .map(|k| {
                20.0 * ((0.3 * coordinate(k % side)).sin()
                    + (0.23 * coordinate(k / side) + 0.1 * coordinate(k % side)).cos())
            })
            .collect()
    };
    let camera = nadir(DVec3::new(0.0, 0.0, -1300.0));
    let [small, large] = [257, 641].map(|side| {
        let terrain = Terrain::from_heights(side, side, 10.0, &heights(side), None).unwrap();
        detail(&terrain, &camera, 0.25).lod
    });
    assert!(small.triangles > 10_000 && small.chunks == large.chunks);
    // At its border the smaller terrain lacks halves that its continuation would require.
    assert!(
        large.triangles.abs_diff(small.triangles) < small.triangles / 100,
        "{} {}",
        small.triangles,
        large.triangles
    );
}

#[test]
fn errors_are_exact() {
    // Odd sizes have triangles that were cut, whose sides cross the grid between vertices.
    for (cols, rows) in [(65, 65), (65, 36), (23, 14)] {
        let terrain = hills(cols, rows, 10.0, 30.0);
        let cells = terrain.cells;
        let grid = errors::ChunkGrid { cells, vertices: &terrain.vertices };
        let keys = errors::chunk_errors(&grid).keys;
        let mut random = Random(3);
        let (mut tight, mut asked) = (0, 0);
        let mut level: Vec<[u32; 3]> = lattice::ROOTS.to_vec();
        for _ in 0..7 {
            for &triangle in &level {
                let corners =
                    triangle.map(lattice::position).map(|[i, j]| [i.min(cells[0]), j.min(cells[1])]);
                if area2(corners.map(|p| p.map(i64::from))) == 0 {
                    continue;
                }
                let points = corners.map(|node| vertex_m(&terrain, node));
                let limit = keys[lattice::halves(triangle).0 as usize];
                let mut worst = 0.0_f64;
                for _ in 0..100 {
                    // Multiples of a fraction hit many corners of the overlay exactly.
                    let weights = [random.next(), random.next(), random.next()].map(|w| (6.0 * w).round());
                    let sum = weights.iter().sum::<f64>().max(1e-9);
                    let cell_position = [0, 1].map(|axis: usize| {
                        (0..3).map(|k| weights[k] / sum * f64::from(corners[k][axis])).sum::<f64>()
                    });
                    let coarse: DVec3 = (0..3).map(|k| weights[k] / sum * points[k]).sum();
                    if sum >= 1.0 {
                        worst = worst.max((full_m(&terrain, cell_position) - coarse).z.abs());
                    }
                }
                assert!(errors::key_of_error(worst - 1e-9) <= limit, "{triangle:?} {worst} m");
                asked += 1;
                tight += usize::from(errors::key_of_error(1.4 * worst) >= limit);
            }
            level = level.into_iter().flat_map(|triangle| lattice::halves(triangle).1).collect();
        }
        // The limit is that of two triangles, and there are few samples.
        assert!(2 * tight > asked, "{tight} of {asked} are near their bound");
    }
}

#[test]
fn encoded_errors_preserve_order() {
    let mut last = 0;
    for exponent in -200..200 {
        let metres = 1.3f64.powi(exponent);
        let (error, tolerance) = (errors::key_of_error(metres), errors::key_of_tolerance(metres));
        // An error counts as within a tolerance only if it is, and does so if it is 2 % below it.
        assert!(error > tolerance && error > last);
        assert!(errors::key_of_error(0.98 * metres) <= tolerance, "{metres}");
        last = error;
    }
    assert_eq!(errors::key_of_error(0.0), errors::key_of_tolerance(0.0));
    assert_eq!([-1.0, f64::NAN].map(errors::key_of_tolerance), [0; 2]);
    assert!(errors::key_of_error(f64::INFINITY) < detail::OUT_OF_SIGHT);
    assert!(
        errors::key_of_tolerance(f64::INFINITY) < detail::OUT_OF_SIGHT && detail::OUT_OF_SIGHT < errors::VOID
    );
}

#[test]
fn rays_meet_the_drawn_surface_where_its_triangles_are() {
    let mut random = Random(5);
    for (cols, rows) in [(129, 129), (90, 75)] {
        let terrain = hills(cols, rows, 10.0, 30.0);
        for max_error_px in [0.0, 0.3, 3.0] {
            let detail = TerrainDetail::new(
                &terrain,
                &nadir(DVec3::new(0.0, 0.0, -3000.0)),
                TANGENTS,
                FOCAL_PX,
                max_error_px,
            );
            let drawn: Vec<[DVec3; 3]> = triangles(&terrain, &detail.mesh())
                .into_iter()
                .map(|t| t.map(|node| vertex_m(&terrain, node)))
                .collect();
            let (mut met, mut moved, mut known) = (0, 0.0_f64, [0; 2]);
            for _ in 0..200 {
                let above = DVec3::new(random.within(-640.0, 640.0), random.within(-640.0, 640.0), -500.0);
                // Straight down, both surfaces are hit in the same cell.
                let Some(hit) = terrain.intersect(above, DVec3::Z, f64::INFINITY) else { continue };
                let exact = drawn
                    .iter()
                    .filter_map(|&t| Some(intersect_triangle(t, above, DVec3::Z, f64::INFINITY)?.0));
                let exact = exact.min_by(f64::total_cmp).unwrap();
                let drawn_here = detail.drawn_cell(&hit);
                let drawn_t = drawn_here.t(&hit, above, DVec3::Z);
                met += 1;
                moved = moved.max((exact - hit.t).abs());
                assert!((drawn_t - exact).abs() < 1e-6, "{max_error_px} px: {drawn_t} {exact} {}", hit.t);
                // The drawn triangles are known for this cell, and not for the same cell of the next chunk.
                for (of, aside_m) in [1.0, 640.0].into_iter().enumerate() {
                    let beside = above + aside_m * DVec3::Y;
                    let Some(hit) = terrain
                        .intersect(beside, DVec3::Z, f64::INFINITY)
                        .filter(|hit| drawn_here.contains(hit))
                    else {
                        continue;
                    };
                    known[of] += 1;
                    assert_eq!(drawn_here.t(&hit, beside, DVec3::Z), detail.drawn_t(&hit, beside, DVec3::Z));
                }
            }
            assert!(met > 60, "{met}");
            assert!(known[0] > met / 2 && known[1] == 0, "{known:?}");
            assert!((max_error_px == 0.0) == (moved < 1e-9), "{max_error_px} px moves by {moved}");
        }
    }
}

#[test]
fn voids_remove_only_their_triangles() {
    let mut heights = hill_heights(130, 130, 5.0);
    heights[0] = f64::NAN; // north-west corner: the first cell loses both triangles
    heights[130] = f64::INFINITY;
    heights[64] = f64::NAN; // on the border of two chunks
    let terrain = Terrain::from_heights(130, 130, 10.0, &heights, None).unwrap();
    assert_eq!(terrain.chunks.iter().filter(|c| c.has_voids).count(), 2);
    // Corners: (0,0) touches 1 cell; (0,1) touches 2, one of which was counted; (64,0) touches one in each
    // chunk.
    assert_eq!(terrain.void_cells, 4);
    let all = 2 * 129 * 129;
    let camera = nadir(DVec3::new(0.0, 0.0, -2000.0));
    let full = detail(&terrain, &camera, 0.0);
    // (0,0) and (0,1) remove both triangles of cell (0,0). (0,1) is also the north-west of cell (0,1), with
    // both triangles. (64,0) is the north-east of cell (63,0), with one triangle, and the north-west of cell
    // (64,0), with both.
    assert_eq!(full.lod.triangles, all - 7);
    let lost = |mesh: &TerrainMesh| {
        let covered = covered(&terrain, &triangles(&terrain, mesh));
        assert!(covered.values().all(|&times| times <= 1));
        all as usize - covered.len()
    };
    assert_eq!(lost(&full), 7);
    let north_west = terrain.intersect(DVec3::new(644.9, -644.9, -100.0), DVec3::Z, 200.0);
    assert_eq!(north_west, None);
    assert!(terrain.down_at(0.0, 0.0).is_some());
    // With a wide tolerance the same triangles are missing, and only the surroundings are at full detail.
    let loose = detail(&terrain, &nadir(DVec3::new(0.0, 0.0, -8000.0)), 100.0);
    assert_eq!(lost(&loose), 7);
    assert!(loose.lod.triangles < 200, "{}", loose.lod.triangles);
    let is_finite = |t: &[[u32; 2]; 3]| t.iter().all(|&node| vertex_m(&terrain, node).is_finite());
    assert!(
        triangles(&terrain, &loose).iter().all(is_finite) && triangles(&terrain, &full).iter().all(is_finite)
    );
}

#[test]
fn chunks_of_voids_draw_nothing() {
    let heights: Vec<f64> = (0..193 * 65).map(|k| if k % 193 < 70 { f64::NAN } else { 0.0 }).collect();
    let terrain = Terrain::from_heights(193, 65, 10.0, &heights, None).unwrap();
    assert_eq!(terrain.chunks.iter().map(|chunk| chunk.has_surface).collect::<Vec<_>>(), [false, true, true]);
    let mesh = detail(&terrain, &nadir(DVec3::new(0.0, 0.0, -5000.0)), 1.0);
    let drawn = covered(&terrain, &triangles(&terrain, &mesh)).len();
    assert_eq!((mesh.chunks.clone(), drawn), (vec![1, 2], 2 * 122 * 64));
}

#[test]
fn chunk_search_matches_a_test_of_all_chunks() {
    let terrain = hills(64 * 11 + 9, 64 * 7 + 30, 10.0, 60.0);
    let mut random = Random(31);
    let (mut found, mut hidden) = (0, 0);
    for _ in 0..60 {
        let position = DVec3::new(
            random.within(-6000.0, 4000.0),
            random.within(-5000.0, 5000.0),
            random.within(-2500.0, -100.0),
        );
        let camera = forward(position, random.within(0.0, 1.5));
        let mesh = detail(&terrain, &camera, random.within(0.2, 20.0));
        let frustum = Frustum::new(&camera, TANGENTS);
        let in_view: Vec<u32> = (0..terrain.chunks.len() as u32)
            .filter(|&chunk| {
                let chunk_position =
                    [chunk % terrain.chunk_grid[0], chunk / terrain.chunk_grid[0]].map(i64::from);
                frustum.may_see(&terrain.tree.square(CHUNK_CELLS, chunk_position).unwrap())
            })
            .collect();
        assert_eq!(mesh.chunks, in_view);
        (found, hidden) = (found + in_view.len(), hidden + terrain.chunks.len() - in_view.len());
        // Chunks are drawn one after the other, the nearest first.
        let mut order: Vec<u32> = mesh.indices.iter().map(|index| index >> VERTEX_BITS).collect();
        order.dedup();
        let distance_m =
            |&index: &u32| terrain.chunks[mesh.chunks[index as usize] as usize].bounds.distance_m(position);
        assert!(order.is_sorted_by(|a, b| distance_m(a) <= distance_m(b)));
        order.sort_unstable();
        assert!(order.windows(2).all(|pair| pair[0] < pair[1]));
    }
    assert!(found > 300 && hidden > 300, "{found} {hidden}");
}
