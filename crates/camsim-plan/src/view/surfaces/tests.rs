#![allow(clippy::unwrap_used)]

use glam::{DQuat, EulerRot};

use super::*;
use camsim_core::scene::MeshVertex;

/// Waves of 30 m under three pictures at different heights, one of them tilted.
fn scene() -> Scene {
    let heights: Vec<f64> = (0..97 * 97)
        .map(|i| 30.0 * (f64::from(i % 97) * 0.3).sin() * (f64::from(i / 97) * 0.2).cos())
        .collect();
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let picture = |north_m: f64, height_m: f64| {
        Mesh::level_picture(texture.clone(), DVec3::new(north_m, 10.0, -height_m), 60.0)
    };
    let mut meshes = vec![picture(-100.0, 40.0), picture(0.0, 60.0), picture(100.0, 5.0)];
    Arc::make_mut(&mut meshes[1].shape).vertices[0].position_m[2] = 25.0;
    Scene {
        terrain: Some(Terrain::from_heights(97, 97, 10.0, &heights, None).unwrap()),
        meshes,
        ..Scene::default()
    }
}

/// The scene with a triangle more in each picture, which makes it a model.
fn models() -> Scene {
    let mut scene = scene();
    scene.meshes.iter_mut().for_each(|mesh| Arc::make_mut(&mut mesh.shape).indices.extend([0, 1, 2]));
    scene
}

#[test]
fn beams_show_models_only_within_view_and_range() {
    let surfaces = Surfaces::new(Arc::new(models()));
    let above =
        CameraPose { position_ned_m: DVec3::new(0.0, 10.0, -300.0), ned_from_camera: DQuat::IDENTITY };
    let shows = |north: f64, depth_m: f64| {
        surfaces.beam(&above, [north - 0.01, north + 0.01, -0.01, 0.01], depth_m).may_show_models()
    };
    // Straight down there is one 240 m below; between two of them, and to the side, is ground alone.
    assert!(shows(0.0, 241.0) && !shows(0.0, 200.0));
    assert!(!shows(0.19, f64::INFINITY) && !shows(3.0, f64::INFINITY));
}

#[test]
fn rays_of_a_beam_hit_what_they_hit_alone() {
    let mut scene = models();
    // Not level, so that no two triangles meet a ray at the same depth.
    scene.meshes[2].ned_from_shape = DMat3::from_rotation_x(0.4) * 1.3;
    // Pressed flat: there is no way back to the shape's axes.
    scene.meshes[0].ned_from_shape =
        DMat3::from_rotation_y(0.1) * DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0));
    let surfaces = Surfaces::new(Arc::new(scene));
    let (mut met, mut sky, mut of_mesh) = (0, 0, 0);
    for k in 0..600 {
        let part = |step: f64| (f64::from(k) * step).fract();
        let position_ned_m =
            DVec3::new(300.0 * part(0.618) - 150.0, 100.0 * part(0.755) - 50.0, -40.0 - 60.0 * part(0.325));
        let ned_from_camera =
            DQuat::from_euler(EulerRot::ZYX, 6.3 * part(0.57), 1.7 * part(0.31), part(0.83));
        let pose = CameraPose { position_ned_m, ned_from_camera };
        let (u, v, width) = (part(0.41) - 0.5, part(0.23) - 0.5, [0.002, 0.02, 0.2][k as usize % 3]);
        let depth_m = [20.0, 80.0, 500.0, f64::INFINITY][k as usize % 4];
        let beam = surfaces.beam(&pose, [u, u + width, v, v + width], depth_m);
        for n in 0..25 {
            let [du, dv] = [n % 5, n / 5].map(|step| f64::from(step) / 4.0 * width);
            let ray_ned = ned_from_camera * DVec3::new(u + du, v + dv, 1.0);
            let [alone, within] = [surfaces.first_hit(position_ned_m, ray_ned), beam.first_hit(ray_ned)];
            let of = |hit: Option<SurfaceHit>| hit.map(|hit| (hit.depth_m, hit.surface));
            assert_eq!(of(alone), of(within), "{k} {n}");
            let is_mesh = alone.is_some_and(|hit| hit.surface > 0);
            (met, sky, of_mesh) = (
                met + u32::from(alone.is_some()),
                sky + u32::from(alone.is_none()),
                of_mesh + u32::from(is_mesh),
            );
        }
    }
    assert!(met > 5000 && sky > 500 && of_mesh > 1000, "{met} {sky} {of_mesh}");
}

#[test]
fn rays_hit_what_a_search_of_all_triangles_hits() {
    // Long because: it makes a scene of every kind of mesh.
    let mut scene = scene();
    // A picture again, turned, as a mesh of the same shape.
    let ned_from_shape = DMat3::from_rotation_z(0.5) * DMat3::from_rotation_x(0.4) * 1.3;
    scene.meshes.push(Mesh {
        ned_from_shape,
        origin_ned_m: DVec3::new(-40.0, -50.0, -70.0),
        ..scene.meshes[1].clone()
    });
    // Mirrored, and pressed flat: of that there is no way back to the shape's axes.
    let sides = [DVec3::new(-1.0, 1.2, 1.0), DVec3::new(0.6, 0.6, 0.0), DVec3::new(1.0, 0.0, 1.0)];
    scene.meshes.extend(
        sides
            .into_iter()
            .enumerate()
            .map(|(k, sides)| Mesh {
                ned_from_shape: DMat3::from_rotation_x(0.1) * DMat3::from_diagonal(sides),
                origin_ned_m: DVec3::new(30.0 * k as f64 - 20.0, 25.0, -65.0 - k as f64),
                ..scene.meshes[1].clone()
            })
            .collect::<Vec<_>>(),
    );
    let terrain = scene.terrain.as_ref().unwrap();
    let of_terrain: Vec<[DVec3; 3]> = (0..terrain.chunks.len() as u32)
        .flat_map(|chunk| {
            let [columns, rows] = terrain.chunks[chunk as usize].cells;
            (0..rows).flat_map(move |j| (0..columns).map(move |i| (chunk, i, j)))
        })
        .flat_map(|(chunk, i, j)| {
            let at = |a: u32, b: u32| terrain.position_ned_m(chunk, i + a, j + b);
            [[at(0, 0), at(1, 1), at(1, 0)], [at(0, 0), at(0, 1), at(1, 1)]]
        })
        .collect();
    let surfaces = Surfaces::new(Arc::new(scene.clone()));
    let (mut seen, mut missed, mut flat) = ([0; 2], 0, 0);
    for k in 0..150 {
        let angle = 0.37 * f64::from(k);
        let origin = DVec3::new(3.0 * f64::from(k % 71) - 100.0, 40.0 * angle.sin(), -80.0);
        // From straight down to above the horizon.
        let direction = DVec3::new(angle.cos(), angle.sin(), 1.6 * (0.11 * f64::from(k)).cos().abs() - 0.05);
        let ground = of_terrain
            .iter()
            .filter_map(|&points| intersect_triangle(points, origin, direction, f64::INFINITY))
            .map(|hit| hit.0);
        let ground = ground.fold(f64::INFINITY, f64::min);
        let meshes = scene
            .meshes
            .iter()
            .filter_map(|mesh| mesh.intersect(origin, direction, f64::INFINITY))
            .map(|hit| hit.0);
        let meshes = meshes.fold(f64::INFINITY, f64::min);
        let found = surfaces.first_hit(origin, direction);
        assert_eq!(found.map_or(f64::INFINITY, |hit| hit.depth_m), ground.min(meshes), "ray {k}");
        match found {
            Some(hit) => {
                assert_eq!(hit.surface > 0, meshes < ground);
                seen[usize::from(hit.surface > 0)] += 1;
                flat += u32::from(hit.surface == 6);
            }
            None => missed += 1,
        }
    }
    assert!(seen[0] > 50 && seen[1] > 10 && missed > 2 && flat > 2, "{seen:?} {missed} {flat}");
}

#[test]
fn light_passes_a_thousand_panes_in_order() {
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let level = |height_m: f64, tint: [f32; 4]| {
        let mut mesh = Mesh::level_picture(texture.clone(), DVec3::new(0.0, 0.0, -height_m), 8.0);
        Arc::make_mut(&mut mesh.shape).vertices.iter_mut().for_each(|vertex| vertex.tint = tint);
        mesh
    };
    let pane = |height_m: f64, tint: [f32; 4]| {
        let mut mesh = level(height_m, tint);
        (mesh.material.blends, mesh.material.cutoff) = (true, Some(0.5));
        mesh
    };
    let alpha = |k: u32| 0.02 + 0.3 * (f64::from(k) * 0.618_034).fract();
    // Each by itself in no order of height, then all of them as one shape.
    let many: Vec<Mesh> = (0..1000)
        .map(|k| k * 389 % 1000)
        .map(|k| pane(0.1 * f64::from(k), [0.4, 0.001 * k as f32, 0.2, alpha(k) as f32]))
        .collect();
    let mut one = pane(0.0, [0.0; 4]);
    let shape = Arc::make_mut(&mut one.shape);
    (shape.vertices, shape.indices) = (Vec::new(), Vec::new());
    for mesh in &many {
        let first = shape.vertices.len() as u32;
        let z_m = mesh.origin_ned_m.z as f32;
        shape.vertices.extend(mesh.shape.vertices.iter().map(|vertex| {
            let [x, y, _] = vertex.position_m;
            MeshVertex { position_m: [x, y, z_m], ..*vertex }
        }));
        shape.indices.extend(mesh.shape.indices.iter().map(|index| first + index));
    }
    let (eye, down) = (DVec3::new(0.3, -0.7, -120.0), DVec3::new(0.001, 0.002, 1.0));
    let over = |behind: DVec3, k: u32| behind.lerp(DVec3::new(0.4, 0.001 * f64::from(k), 0.2), alpha(k));
    let expected = (0..1000).fold(DVec3::ONE, over);
    for panes in [many, vec![one]] {
        let surfaces = Surfaces::new(Arc::new(Scene {
            meshes: [panes, vec![level(-1.0, [1.0; 4])]].concat(),
            ..Scene::default()
        }));
        let hit = surfaces.first_hit(eye, down);
        assert!(
            hit.is_some_and(|hit| (hit.depth_m - 121.0).abs() < 1e-9),
            "what has no depth anywhere is not met"
        );
        let light = surfaces.light(eye, down, hit.as_ref(), 1.0);
        assert!((light.color - expected).abs().max_element() < 1e-6, "{} {expected}", light.color);
        assert!((40..200).contains(&light.panes.len()), "{}", light.panes.len());
    }
}

#[test]
fn meshes_behind_the_camera_are_not_near() {
    let mut scene = scene();
    scene.terrain = None;
    let surfaces = Surfaces::new(Arc::new(scene));
    let pose = |pitch_deg: f64| CameraPose {
        position_ned_m: DVec3::new(0.0, 10.0, -160.0),
        ned_from_camera: DQuat::from_euler(EulerRot::ZYX, 0.0, f64::to_radians(pitch_deg), 0.0)
            * DQuat::from_mat3(&glam::DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X)),
    };
    let view = [-0.5, 0.5, -0.5, 0.5];
    // The middle picture is 100 m below, the corner of another 25 m nearer than its centre would be, at a
    // slant of at most sqrt(1.5). Boxes are larger by 1e-9 of their reach of 30 m.
    let down = surfaces.nearest_m(&pose(-90.0), view, 1.0);
    assert!(down <= 99.0 && down >= 99.0 / 1.5_f64.sqrt() - 3.1e-8, "{down}");
    assert_eq!(surfaces.nearest_m(&pose(60.0), view, 1.0), f64::INFINITY);
}
