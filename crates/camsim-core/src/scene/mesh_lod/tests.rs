#![allow(clippy::unwrap_used)]

use glam::{DQuat, EulerRot};

use super::*;
use crate::scene::{Encoding, MeshVertex, Texture};

/// A sphere of 2 n^2 triangles, wrapped in its texture, with a seam.
fn globe(n: u32) -> Shape {
    let vertex = |i: u32, j: u32| {
        let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
        let (around, down) = (std::f64::consts::TAU * u, std::f64::consts::PI * v);
        // Both sides of the seam have identical positions.
        let (sin, cos) = if i == n { (0.0, 1.0) } else { around.sin_cos() };
        let ring = if j == 0 || j == n { 0.0 } else { down.sin() };
        MeshVertex::new([(ring * cos) as f32, (ring * sin) as f32, down.cos() as f32], [u as f32, v as f32])
    };
    let vertices = (0..=n).flat_map(|j| (0..=n).map(move |i| vertex(i, j))).collect();
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

/// Distance of a point of one level from another level, over all triangles.
fn away_m<const AXES: usize>(
    points: &[attribute_space::Point<AXES>],
    corners: &[u32],
    point: &attribute_space::Point<AXES>,
) -> f64 {
    let distance_m = |t: &[u32]| {
        let [a, b, c] = [0, 1, 2].map(|k| &points[t[k] as usize]);
        attribute_space::distance2(point, [a, b, c])
    };
    corners.chunks_exact(3).map(distance_m).fold(f64::INFINITY, f64::min).sqrt()
}

/// Tests random points of every level.
fn check_levels<const AXES: usize>(shape: &Shape) {
    let lods = ShapeLods::new(shape.clone().into());
    let counts: Vec<usize> = lods.levels().iter().map(|level| level.indices.len() / 3).collect();
    assert!(counts.len() >= 4 && counts.windows(2).all(|pair| pair[1] < pair[0]), "{counts:?}");
    assert!(*counts.last().unwrap() < 100, "{counts:?}");
    let points = attribute_space::AttributeSpace::new(shape).points::<AXES>(shape);
    for level in &lods.levels()[1..] {
        let mut farthest = 0.0_f64;
        let (full, left) = (&shape.indices[..], &level.indices[..]);
        for (own, other) in [(full, left), (left, full)] {
            for (k, t) in own.chunks_exact(3).enumerate() {
                let part =
                    |n: u32| f64::from(crate::noise::pcg4d([k as u32, n, 5, 0])[0] >> 8) / f64::from(1 << 24);
                let (a, b) = (part(0), part(1));
                let weights = if a + b > 1.0 { [1.0 - a, 1.0 - b, a + b - 1.0] } else { [a, b, 1.0 - a - b] };
                let corners = [0, 1, 2].map(|c| points[t[c] as usize]);
                // Triangles without area, as at the poles, are no part of the surface.
                if (0..3).any(|c| corners[c][..3] == corners[(c + 1) % 3][..3]) {
                    continue;
                }
                let point = std::array::from_fn(|axis| (0..3).map(|c| weights[c] * corners[c][axis]).sum());
                farthest = farthest.max(away_m(&points, other, &point));
            }
        }
        assert!(farthest <= level.error_m, "{farthest} {}", level.error_m);
        // The bound is close to the largest distance found.
        assert!(level.error_m < 3.0 * farthest, "{farthest} {}", level.error_m);
    }
}

#[test]
fn every_point_of_a_level_is_within_its_error() {
    check_levels::<{ attribute_space::UNLIT }>(&globe(24));
}

#[test]
fn levels_are_chosen_as_if_all_were_made_at_once() {
    for shape in [globe(8), lit_globe(8)].map(Arc::new) {
        let all = ShapeLods::new(shape.clone());
        let least_m = all.simplified().least_m;
        let errors_m = all.levels().iter().map(|level| level.error_m).chain([least_m, 0.0, f64::NAN]);
        for error_m in errors_m.flat_map(|error_m| [0.5, 1.0 - 1e-9, 1.0].map(|by| by * error_m)) {
            let lods = ShapeLods::new(shape.clone());
            let coarsest = all.levels().iter().rposition(|level| level.error_m <= error_m).unwrap_or(0);
            assert_eq!(lods.coarsest_within(error_m), coarsest, "{error_m}");
            assert_eq!(
                lods.levels.get().is_none(),
                error_m.is_nan() || error_m < least_m,
                "{error_m} {least_m}"
            );
        }
    }
    // The lower bound is of use: most of the first level's error.
    let globe = ShapeLods::new(globe(24).into());
    assert!(globe.simplified().least_m > 0.5 * globe.levels()[1].error_m);
}

/// A sphere with its normals.
fn lit_globe(n: u32) -> Shape {
    let mut shape = globe(n);
    shape.normals = shape.vertices.iter().map(|vertex| vertex.position_m).collect();
    shape
}

#[test]
fn every_normal_of_a_level_is_within_its_error() {
    check_levels::<{ attribute_space::LIT }>(&lit_globe(24));
    // With normals, fewer triangles can be removed for the same error.
    let (lit, unlit) = (ShapeLods::new(lit_globe(24).into()), ShapeLods::new(globe(24).into()));
    let left = |levels: &ShapeLods| levels.levels()[levels.coarsest_within(0.6)].indices.len();
    assert!(left(&lit) > left(&unlit), "{} {}", left(&lit), left(&unlit));
}

#[test]
fn lit_shapes_with_anisotropic_scale_have_no_levels() {
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
        let ratio = lod_stretch(&mesh);
        assert!(ratio == expected || (ratio - expected).abs() < 1e-12, "{ratio} {expected}");
        if uneven && normals {
            assert_eq!(ShapeLods::new(mesh.shape.clone()).coarsest_within(5.0 / ratio), 0);
        }
    }
}

#[test]
fn flat_walls_simplify_without_error() {
    // A box of 6 x 2 x 8 x 8 triangles, each side with vertices of its own.
    let mut shape = Shape::default();
    for side in 0..6 {
        let (axis, end) = (side / 2, (side % 2) as f32);
        let first = shape.vertices.len() as u32;
        for (i, j) in (0..9).flat_map(|j| (0..9).map(move |i| (i, j))) {
            let mut position = [0.0; 3];
            (position[axis], position[(axis + 1) % 3], position[(axis + 2) % 3]) =
                (end, i as f32 / 8.0, j as f32 / 8.0);
            shape.vertices.push(MeshVertex::new(position, [0.0; 2]));
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
    let lods = ShapeLods::new(shape.clone().into());
    let level = &lods.levels()[1];
    assert_eq!(level.indices.len() / 3, 12);
    assert!(level.error_m < 1e-6, "{}", level.error_m);
    // Colours that differ from vertex to vertex are kept.
    for (k, vertex) in (0..).zip(&mut shape.vertices) {
        vertex.tint =
            [if crate::noise::pcg4d([k, 1, 2, 3])[0].is_multiple_of(2) { 0.0 } else { 1.0 }, 0.5, 0.5, 1.0];
    }
    let striped = ShapeLods::new(shape.clone().into());
    assert!(
        striped.coarsest_within(0.01) == 0,
        "{:?}",
        striped.levels().iter().map(|level| level.error_m).collect::<Vec<_>>()
    );
}

/// Area of a level's triangles.
fn area_m2(shape: &Shape, level: &ShapeLod) -> f64 {
    let position = |corner: u32| glam::Vec3::from(shape.vertices[corner as usize].position_m).as_dvec3();
    level
        .indices
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&[a, b, c]| 0.5 * (position(b) - position(a)).cross(position(c) - position(a)).length())
        .sum()
}

#[test]
fn openings_and_hollows_are_not_filled() {
    // A wall with a window, and the same with a reveal around the window and beside two gables: present cells
    // of a grid, two triangles each.
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
            let corner = |a: u32, b: u32, z: f32| [(i + a) as f32, (j + b) as f32, z];
            quad([corner(0, 0, 0.0), corner(1, 0, 0.0), corner(1, 1, 0.0), corner(0, 1, 0.0)]);
            let is_there = |a: i64, b: i64| {
                let [x, y] = [i64::from(i) + a, i64::from(j) + b];
                (0..8).contains(&x) && (0..10).contains(&y) && is_wall(x as u32, y as u32)
            };
            // Sides where the wall ends, facing outwards.
            let sides = [
                ([0, -1], [0, 0], [1, 0]),
                ([1, 0], [1, 0], [1, 1]),
                ([0, 1], [1, 1], [0, 1]),
                ([-1, 0], [0, 1], [0, 0]),
            ];
            for (_, from, to) in sides.into_iter().filter(|&([a, b], ..)| depth > 0.0 && !is_there(a, b)) {
                quad([
                    corner(from[0], from[1], -depth),
                    corner(to[0], to[1], -depth),
                    corner(to[0], to[1], 0.0),
                    corner(from[0], from[1], 0.0),
                ]);
            }
        }
        let lods = ShapeLods::new(shape.clone().into());
        let [full, level] = [0, 1].map(|k| &lods.levels()[k]);
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
fn small_shapes_and_invalid_indices_are_kept() {
    let small = globe(3);
    assert_eq!(ShapeLods::new(small.into()).levels().len(), 1);
    let mut bad = globe(8);
    bad.indices[7] = 1_000_000;
    assert_eq!(ShapeLods::new(bad.into()).levels().len(), 1);
    let mut flat = globe(8);
    flat.vertices.iter_mut().for_each(|vertex| vertex.position_m = [1.0; 3]);
    assert_eq!(ShapeLods::new(flat.into()).levels().len(), 1);
}

#[test]
fn error_tolerance_matches_projected_displacement() {
    let pose = CameraPose {
        position_ned_m: DVec3::new(10.0, -20.0, -100.0),
        ned_from_camera: DQuat::from_euler(EulerRot::ZYX, 0.4, 0.9, -0.3),
    };
    let tolerance = LodTolerance {
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
    // Behind the camera, around it, or empty: no displacement is allowed.
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
fn blended_shapes_are_not_simplified() {
    let texture = Arc::new(Texture::uniform([255, 255, 255, 128], Encoding::Linear));
    let [shape, other] = [globe(24), globe(20)].map(Arc::new);
    let mesh = |shape: &Arc<Shape>, blends: bool| {
        let mut mesh = Mesh::level_picture(texture.clone(), DVec3::ZERO, 1.0);
        (mesh.shape, mesh.material.blends) = (shape.clone(), blends);
        mesh
    };
    // Both panes of a window may be within the error of one.
    let scene = Scene {
        meshes: vec![mesh(&shape, false), mesh(&shape, true), mesh(&other, false)],
        ..Scene::default()
    };
    let levels = SceneLods::new(&scene);
    assert_eq!(levels.shape_lods(&shape).levels().len(), 1);
    assert!(levels.shape_lods(&other).levels().len() > 2);
}
