//! Levels of detail of published models: distance between their surfaces and the full ones, by brute force.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
    sync::Arc,
};

use camsim_core::{
    noise::pcg4d,
    scene::{Shape, ShapeLods},
};
use camsim_io::gltf_file::{GltfOptions, read_gltf};
use glam::{DVec3, Vec3};

type Triangle = [DVec3; 3];

/// The triangles of a level that have an area.
fn triangles(shape: &Shape, indices: &[u32]) -> Vec<Triangle> {
    let position_m = |corner: u32| Vec3::from(shape.vertices[corner as usize].position_m).as_dvec3();
    let all = indices.as_chunks::<3>().0.iter().map(|corners| corners.map(position_m));
    all.filter(|[a, b, c]| (b - a).cross(c - a) != DVec3::ZERO).collect()
}

/// Distance of a point from a triangle, metres.
fn distance_m(point: DVec3, [a, b, c]: Triangle) -> f64 {
    let normal = (b - a).cross(c - a).normalize();
    let sides = [(a, b), (b, c), (c, a)];
    if sides.iter().all(|&(from, to)| normal.cross(to - from).dot(point - from) >= 0.0) {
        return normal.dot(point - a).abs();
    }
    let edge_distance_m = |(from, to): (DVec3, DVec3)| {
        let t = ((point - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
        point.distance(from.lerp(to, t))
    };
    sides.map(edge_distance_m).into_iter().fold(f64::INFINITY, f64::min)
}

/// Largest distance of random points of one surface from another, metres.
fn max_distance_m(from: &[Triangle], to: &[Triangle]) -> f64 {
    let mut max_m = 0.0_f64;
    for (k, [a, b, c]) in (0..).zip(from) {
        for n in 0..3 {
            let [s, t, ..] = pcg4d([k, n, 5, 0]).map(|bits| f64::from(bits) / 2_f64.powi(32));
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            let point = a + s * (b - a) + t * (c - a);
            max_m = max_m
                .max(to.iter().map(|triangle| distance_m(point, *triangle)).fold(f64::INFINITY, f64::min));
        }
    }
    max_m
}

fn models(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let is_model = |path: &Path| path.extension().is_some_and(|ending| ending == "glb" || ending == "gltf");
    entries
        .flat_map(
            |path| {
                if path.is_dir() { models(&path) } else { Vec::from_iter(is_model(&path).then_some(path)) }
            },
        )
        .collect()
}

#[test]
fn levels_of_published_models_are_within_their_errors() {
    let Some(data) = std::env::var_os("CAMSIM_DATA") else {
        return eprintln!("skipped: CAMSIM_DATA is not set");
    };
    let (mut level_count, mut house_parts) = (0, Vec::new());
    for path in models(&Path::new(&data).join("gltf")) {
        for normals in [false, true] {
            // Some files are malformed on purpose.
            let Ok(model) = read_gltf(&path, GltfOptions { normals, ..GltfOptions::default() }) else {
                continue;
            };
            let mut visited = HashSet::new();
            for mesh in
                model.place(DVec3::ZERO, 0.0, 1.0).filter(|mesh| visited.insert(Arc::as_ptr(&mesh.shape)))
            {
                let levels = ShapeLods::new(mesh.shape.clone());
                let full = triangles(&mesh.shape, &levels.levels()[0].indices);
                for level in &levels.levels()[1..] {
                    let simplified = triangles(&mesh.shape, &level.indices);
                    let distance_m =
                        max_distance_m(&full, &simplified).max(max_distance_m(&simplified, &full));
                    assert!(
                        distance_m <= level.error_m * (1.0 + 1e-9) + 1e-9,
                        "{path:?}: {distance_m} of {}",
                        level.error_m
                    );
                    level_count += 1;
                }
                if path.ends_with("house-3-0.glb") && !normals {
                    let within_m =
                        0.02 * (full.iter().flatten().fold(0.0_f64, |max, corner| max.max(corner.length())));
                    house_parts.push([
                        full.len(),
                        levels.levels()[levels.coarsest_within(within_m)].indices.len() / 3,
                    ]);
                }
            }
        }
    }
    assert!(level_count > 100, "{level_count}");
    // The house's first parts are frames around windows and walls, which must be simplified too.
    assert!(
        house_parts.iter().any(|&[full, simplified]| full > 300 && 3 * simplified < 2 * full),
        "{house_parts:?}"
    );
    eprintln!(
        "{level_count} levels; triangles of a house's parts, full and within 2 % of its size: {house_parts:?}"
    );
}
