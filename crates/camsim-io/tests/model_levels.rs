//! Levels of detail of real models: how far their surfaces are from the full ones, by a search that knows
//! nothing of how they were made.

#![allow(clippy::unwrap_used)]

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

/// Of a level's triangles those that have an area.
fn triangles(shape: &Shape, indices: &[u32]) -> Vec<Triangle> {
    let at = |corner: u32| Vec3::from(shape.vertices[corner as usize].position_m).as_dvec3();
    let all = indices.as_chunks::<3>().0.iter().map(|corners| corners.map(at));
    all.filter(|[a, b, c]| (b - a).cross(c - a) != DVec3::ZERO).collect()
}

fn away_m(point: DVec3, [a, b, c]: Triangle) -> f64 {
    let normal = (b - a).cross(c - a).normalize();
    let sides = [(a, b), (b, c), (c, a)];
    if sides.iter().all(|&(from, to)| normal.cross(to - from).dot(point - from) >= 0.0) {
        return normal.dot(point - a).abs();
    }
    let beside = |(from, to): (DVec3, DVec3)| {
        let share = ((point - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
        point.distance(from.lerp(to, share))
    };
    sides.map(beside).into_iter().fold(f64::INFINITY, f64::min)
}

/// How far the farthest of some random points of one surface is from another.
fn farthest_m(from: &[Triangle], to: &[Triangle]) -> f64 {
    let mut farthest_m = 0.0_f64;
    for (k, [a, b, c]) in (0..).zip(from) {
        for n in 0..3 {
            let [s, t, ..] = pcg4d([k, n, 5, 0]).map(|bits| f64::from(bits) / 2_f64.powi(32));
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            let point = a + s * (b - a) + t * (c - a);
            farthest_m = farthest_m
                .max(to.iter().map(|triangle| away_m(point, *triangle)).fold(f64::INFINITY, f64::min));
        }
    }
    farthest_m
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
fn levels_of_real_models_are_within_their_errors() {
    let Some(data) = std::env::var_os("CAMSIM_DATA") else {
        return eprintln!("skipped: CAMSIM_DATA is not set");
    };
    let (mut levels_seen, mut of_houses) = (0, Vec::new());
    for path in models(&Path::new(&data).join("gltf")) {
        for normals in [false, true] {
            // Some are malformed on purpose.
            let Ok(model) = read_gltf(&path, GltfOptions { normals, ..GltfOptions::default() }) else {
                continue;
            };
            let mut known = HashSet::new();
            for mesh in
                model.place(DVec3::ZERO, 0.0, 1.0).filter(|mesh| known.insert(Arc::as_ptr(&mesh.shape)))
            {
                let levels = ShapeLods::new(&mesh.shape);
                let full = triangles(&mesh.shape, &levels.levels()[0].indices);
                for level in &levels.levels()[1..] {
                    let some = triangles(&mesh.shape, &level.indices);
                    let found_m = farthest_m(&full, &some).max(farthest_m(&some, &full));
                    assert!(
                        found_m <= level.error_m * (1.0 + 1e-9) + 1e-9,
                        "{path:?}: {found_m} of {}",
                        level.error_m
                    );
                    levels_seen += 1;
                }
                if path.ends_with("house-3-0.glb") && !normals {
                    let within_m =
                        0.02 * (full.iter().flatten().fold(0.0_f64, |most, at| most.max(at.length())));
                    of_houses.push([
                        full.len(),
                        levels.levels()[levels.coarsest_within(within_m)].indices.len() / 3,
                    ]);
                }
            }
        }
    }
    assert!(levels_seen > 100, "{levels_seen}");
    // The first of its parts are frames around windows and walls, which were once not made simpler before a
    // fifth of the house.
    assert!(of_houses.iter().any(|&[full, left]| full > 300 && 3 * left < 2 * full), "{of_houses:?}");
    eprintln!(
        "{levels_seen} levels; parts of a house, and what is left of them at 2 % of its size: {of_houses:?}"
    );
}
