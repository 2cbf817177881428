#![allow(clippy::unwrap_used)]

use glam::{DQuat, EulerRot};

use super::*;
use crate::scene::{Encoding, MeshVertex, Texture};

/// A sphere of 2 n^2 triangles, its picture around it, with a seam.
fn globe(n: u32) -> Shape {
    let at = |i: u32, j: u32| {
        let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
        let (around, down) = (std::f64::consts::TAU * u, std::f64::consts::PI * v);
        // The seam's two sides are at the same place, to the bit.
        let (sin, cos) = if i == n { (0.0, 1.0) } else { around.sin_cos() };
        let ring = if j == 0 || j == n { 0.0 } else { down.sin() };
        MeshVertex::new([(ring * cos) as f32, (ring * sin) as f32, down.cos() as f32], [u as f32, v as f32])
    };
    let vertices = (0..=n).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
    let index = |i: u32, j: u32| j * (n + 1) + i;
    let cell = |i: u32, j: u32| {
        [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j), index(i + 1, j + 1), index(i, j + 1)]
    };
    Shape {
        vertices,
        indices: (0..n).flat_map(|j| (0..n).flat_map(move |i| cell(i, j))).collect(),
        normals: Vec::new(),
    }
}

/// Distance of a point of one level from another level, by a look at every triangle.
fn away_m<const AXES: usize>(
    points: &[space::Point<AXES>],
    corners: &[u32],
    point: &space::Point<AXES>,
) -> f64 {
    let of = |t: &[u32]| {
        let [a, b, c] = [0, 1, 2].map(|k| &points[t[k] as usize]);
        space::distance2(point, [a, b, c])
    };
    corners.chunks_exact(3).map(of).fold(f64::INFINITY, f64::min).sqrt()
}

/// Looks at random points of every level.
fn check_levels<const AXES: usize>(shape: &Shape) {
    let found = ShapeLevels::new(shape);
    let counts: Vec<usize> = found.levels().iter().map(|level| level.indices.len() / 3).collect();
    assert!(counts.len() >= 4 && counts.windows(2).all(|pair| pair[1] < pair[0]), "{counts:?}");
    assert!(*counts.last().unwrap() < 100, "{counts:?}");
    let points = space::Space::of(shape).points::<AXES>(shape);
    for level in &found.levels()[1..] {
        let mut farthest = 0.0_f64;
        for (own, other) in [(&shape.indices, &level.indices), (&level.indices, &shape.indices)] {
            for (k, t) in own.chunks_exact(3).enumerate() {
                let part =
                    |n: u32| f64::from(crate::noise::pcg4d([k as u32, n, 5, 0])[0] >> 8) / f64::from(1 << 24);
                let (a, b) = (part(0), part(1));
                let weights = if a + b > 1.0 { [1.0 - a, 1.0 - b, a + b - 1.0] } else { [a, b, 1.0 - a - b] };
                let corners = [0, 1, 2].map(|c| points[t[c] as usize]);
                // What has no area, as at the poles, is no part of the surface.
                if (0..3).any(|c| corners[c][..3] == corners[(c + 1) % 3][..3]) {
                    continue;
                }
                let point = std::array::from_fn(|axis| (0..3).map(|c| weights[c] * corners[c][axis]).sum());
                farthest = farthest.max(away_m(&points, other, &point));
            }
        }
        assert!(farthest <= level.error_m, "{farthest} {}", level.error_m);
        // The bound is not far from what is found at random.
        assert!(level.error_m < 3.0 * farthest, "{farthest} {}", level.error_m);
    }
}

#[test]
fn every_point_of_a_level_is_within_its_error() {
    check_levels::<{ space::UNLIT }>(&globe(24));
}

/// A sphere with the normals of one.
fn lit_globe(n: u32) -> Shape {
    let mut shape = globe(n);
    shape.normals = shape.vertices.iter().map(|vertex| vertex.position_m).collect();
    shape
}

#[test]
fn every_normal_of_a_level_is_within_its_error() {
    check_levels::<{ space::LIT }>(&lit_globe(24));
    // Where normals matter, fewer triangles are left out for the same error.
    let (lit, unlit) = (ShapeLevels::new(&lit_globe(24)), ShapeLevels::new(&globe(24)));
    let left = |levels: &ShapeLevels| levels.levels()[levels.within(0.6)].indices.len();
    assert!(left(&lit) > left(&unlit), "{} {}", left(&lit), left(&unlit));
}

#[test]
fn light_on_what_is_stretched_unevenly_leaves_no_level() {
    let mut mesh = Mesh::new(
        vec![],
        vec![],
        Arc::new(Texture::uniform([255; 4], Encoding::Linear)),
        DVec3::ZERO,
        crate::scene::Wrap::Clamp,
    );
    for (normals, uneven, expected) in [(false, true, 4.0), (true, false, 2.0), (true, true, f64::INFINITY)] {
        mesh.shape = Arc::new(if normals { lit_globe(8) } else { globe(8) });
        let scale = DVec3::new(2.0, if uneven { 4.0 } else { 2.0 }, 2.0);
        mesh.ned_from_shape = DMat3::from_rotation_z(0.7) * DMat3::from_diagonal(scale);
        let found = level_stretch(&mesh);
        assert!(found == expected || (found - expected).abs() < 1e-12, "{found} {expected}");
        if uneven && normals {
            assert_eq!(ShapeLevels::new(&mesh.shape).within(5.0 / found), 0);
        }
    }
}

#[test]
fn flat_walls_become_few_triangles_without_error() {
    // A box of 6 x 2 x 8 x 8 triangles, each side with corners of its own.
    let mut shape = Shape::default();
    for side in 0..6 {
        let (axis, end) = (side / 2, (side % 2) as f32);
        let first = shape.vertices.len() as u32;
        for (i, j) in (0..9).flat_map(|j| (0..9).map(move |i| (i, j))) {
            let mut at = [0.0; 3];
            (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (end, i as f32 / 8.0, j as f32 / 8.0);
            shape.vertices.push(MeshVertex::new(at, [0.0; 2]));
        }
        for (i, j) in (0..8).flat_map(|j| (0..8).map(move |i| (i, j))) {
            let index = |a: u32, b: u32| first + (j + b) * 9 + i + a;
            shape.indices.extend([
                index(0, 0),
                index(1, 0),
                index(1, 1),
                index(0, 0),
                index(1, 1),
                index(0, 1),
            ]);
        }
    }
    let found = ShapeLevels::new(&shape);
    let level = &found.levels()[1];
    assert_eq!(level.indices.len() / 3, 12);
    assert!(level.error_m < 1e-6, "{}", level.error_m);
    // Colours that differ from corner to corner are kept.
    for (k, vertex) in (0..).zip(&mut shape.vertices) {
        vertex.tint =
            [if crate::noise::pcg4d([k, 1, 2, 3])[0].is_multiple_of(2) { 0.0 } else { 1.0 }, 0.5, 0.5, 1.0];
    }
    let striped = ShapeLevels::new(&shape);
    assert!(
        striped.within(0.01) == 0,
        "{:?}",
        striped.levels().iter().map(|level| level.error_m).collect::<Vec<_>>()
    );
}

/// Area of a level's triangles.
fn area_m2(shape: &Shape, level: &ShapeLevel) -> f64 {
    let place = |corner: u32| glam::Vec3::from(shape.vertices[corner as usize].position_m).as_dvec3();
    level
        .indices
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&[a, b, c]| 0.5 * (place(b) - place(a)).cross(place(c) - place(a)).length())
        .sum()
}

#[test]
fn what_is_open_and_what_is_hollow_is_not_filled() {
    // A wall with a window, and the same with an edge of some depth around the window and beside two gables:
    // cells of a grid that are there, two triangles each.
    let is_wall =
        |i: u32, j: u32| !((3..6).contains(&i) && (3..6).contains(&j)) && i + 12 > 2 * j && 2 * j < 19 - i;
    for depth in [0.0, 0.5_f32] {
        let mut shape = Shape::default();
        let mut quad = |corners: [[f32; 3]; 4]| {
            let first = shape.vertices.len() as u32;
            shape.vertices.extend(corners.map(|at| MeshVertex::new(at, [0.0; 2])));
            shape.indices.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
        };
        for (i, j) in (0..10).flat_map(|j| (0..8).map(move |i| (i, j))).filter(|&(i, j)| is_wall(i, j)) {
            let at = |a: u32, b: u32, z: f32| [(i + a) as f32, (j + b) as f32, z];
            quad([at(0, 0, 0.0), at(1, 0, 0.0), at(1, 1, 0.0), at(0, 1, 0.0)]);
            let is_there = |a: i64, b: i64| {
                let [x, y] = [i64::from(i) + a, i64::from(j) + b];
                (0..8).contains(&x) && (0..10).contains(&y) && is_wall(x as u32, y as u32)
            };
            // Sides, where the wall ends, turned outwards.
            let sides = [
                ([0, -1], [0, 0], [1, 0]),
                ([1, 0], [1, 0], [1, 1]),
                ([0, 1], [1, 1], [0, 1]),
                ([-1, 0], [0, 1], [0, 0]),
            ];
            for (_, from, to) in sides.into_iter().filter(|&([a, b], ..)| depth > 0.0 && !is_there(a, b)) {
                quad([
                    at(from[0], from[1], -depth),
                    at(to[0], to[1], -depth),
                    at(to[0], to[1], 0.0),
                    at(from[0], from[1], 0.0),
                ]);
            }
        }
        let found = ShapeLevels::new(&shape);
        let [full, level] = [0, 1].map(|k| &found.levels()[k]);
        assert!(
            level.error_m < 1e-6 && 2 * level.indices.len() < full.indices.len(),
            "{depth}: {} {}",
            level.error_m,
            level.indices.len()
        );
        let (of_full, of_level) = (area_m2(&shape, full), area_m2(&shape, level));
        assert!((of_full - of_level).abs() < 1e-4, "{depth}: {of_full} {of_level}");
    }
}

#[test]
fn few_triangles_and_bad_indices_are_left_as_they_are() {
    let small = globe(3);
    assert_eq!(ShapeLevels::new(&small), ShapeLevels::full(&small));
    let mut bad = globe(8);
    bad.indices[7] = 1_000_000;
    assert_eq!(ShapeLevels::new(&bad).levels().len(), 1);
    let mut flat = globe(8);
    flat.vertices.iter_mut().for_each(|vertex| vertex.position_m = [1.0; 3]);
    assert_eq!(ShapeLevels::new(&flat).levels().len(), 1);
}

#[test]
fn the_error_is_what_is_seen() {
    let pose = CameraPose {
        position_ned_m: DVec3::new(10.0, -20.0, -100.0),
        ned_from_camera: DQuat::from_euler(EulerRot::ZYX, 0.4, 0.9, -0.3),
    };
    let tolerance = LevelTolerance {
        focal_px: 400.0,
        tangents: [-0.8, 0.7, -0.6, 0.5],
        error_px: 0.1,
        travel_m: 0.0,
        parallax_px: f64::INFINITY,
    };
    let project = |point: DVec3| {
        let in_camera = pose.ned_from_camera.inverse() * (point - pose.position_ned_m);
        400.0 * in_camera.truncate() / in_camera.z
    };
    let mut largest = 0.0_f64;
    for k in 0..500_u32 {
        let [a, b, c, d] =
            crate::noise::pcg4d([k, 1, 2, 3]).map(|bits| f64::from(bits >> 8) / f64::from(1 << 24));
        let z_m = 50.0 + 400.0 * a;
        let point = pose.position_ned_m
            + pose.ned_from_camera * (z_m * DVec3::new(1.5 * b - 0.8, 1.1 * c - 0.6, 1.0));
        let bounds = Aabb { min: point, max: point };
        let shift = DQuat::from_euler(EulerRot::ZYX, 7.0 * d, 5.0 * a, 3.0 * c)
            * DVec3::X
            * tolerance.error_m(&bounds, &pose);
        largest = largest.max(project(point + shift).distance(project(point)));
    }
    assert!(largest <= 0.1001 && largest > 0.07, "{largest}");
    // Behind, around the camera, and nowhere: nothing may be displaced.
    for (low, high) in
        [(DVec3::splat(-1e4), DVec3::splat(1e4)), (DVec3::splat(f64::NAN), DVec3::splat(f64::NAN))]
    {
        assert_eq!(tolerance.error_m(&Aabb { min: low, max: high }, &pose), 0.0);
    }
    let turned = DMat3::from_quat(pose.ned_from_camera) * 3.0;
    assert!((stretch(&turned) - 3.0).abs() < 1e-12);
    let sheared = turned * DMat3::from_cols(DVec3::X, DVec3::new(0.7, 1.0, 0.0), DVec3::new(0.0, 0.0, 0.2));
    assert!(
        (0..99)
            .all(|k| (sheared * (DQuat::from_rotation_z(f64::from(k)) * DVec3::X)).length()
                <= stretch(&sheared))
    );
}

#[test]
fn what_is_mixed_stays_whole() {
    let texture = Arc::new(Texture::uniform([255, 255, 255, 128], Encoding::Linear));
    let [shape, other] = [globe(24), globe(20)].map(Arc::new);
    let mesh = |shape: &Arc<Shape>, blends: bool| {
        let mut mesh = Mesh::level_picture(texture.clone(), DVec3::ZERO, 1.0);
        (mesh.shape, mesh.material.blends) = (shape.clone(), blends);
        mesh
    };
    // Both panes of a window may be within a level's error of one.
    let scene = Scene {
        meshes: vec![mesh(&shape, false), mesh(&shape, true), mesh(&other, false)],
        ..Scene::default()
    };
    let levels = SceneLevels::new(&scene);
    assert_eq!(levels.of(&shape).levels().len(), 1);
    assert!(levels.of(&other).levels().len() > 2);
}
