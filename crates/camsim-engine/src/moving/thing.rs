//! What moves as one, in parts that are small in the picture.

use std::sync::Arc;

use camsim_core::scene::{Aabb, Mesh, RigidMotion, Scene};
use glam::DVec3;

/// Most parts of all things together, and of one.
const MOST_PARTS: usize = 256;
const MOST_PARTS_OF_ONE: usize = 64;
/// Longest side of the triangles that parts are made of, as a fraction of the thing's diagonal: of longer ones, pieces.
const PIECE: f64 = 1.0 / 16.0;
/// Halvings of a triangle's longest side.
const MOST_HALVINGS: u32 = 10;

/// Meshes that move together. A box around all of them covers much of a picture where nothing of it is: the blades of
/// a propeller are a tenth of their disc.
#[derive(Debug)]
pub(super) struct Thing {
    pub motion: Arc<RigidMotion>,
    /// All of it, at path time 0.
    pub bounds: Aabb,
    /// Boxes that hold all of it together, at path time 0.
    pub parts: Vec<Aabb>,
}

/// Everything that moves in a scene.
pub(super) fn things(scene: &Scene) -> Vec<Thing> {
    let mut meshes: Vec<(Arc<RigidMotion>, Vec<&Mesh>)> = Vec::new();
    for mesh in &scene.meshes {
        let Some(motion) = &mesh.motion else { continue };
        match meshes.iter_mut().find(|(known, _)| Arc::ptr_eq(known, motion)) {
            Some((_, meshes)) => meshes.push(mesh),
            None => meshes.push((motion.clone(), vec![mesh])),
        }
    }
    let most = (MOST_PARTS / meshes.len().max(1)).clamp(1, MOST_PARTS_OF_ONE);
    let thing = |(motion, meshes): (Arc<RigidMotion>, Vec<&Mesh>)| {
        let bounds = meshes.iter().fold(Aabb::EMPTY, |all, mesh| all.union(&mesh.bounds()));
        let parts = if most == 1 { vec![bounds] } else { parts(&meshes, &bounds, most) };
        Thing { motion, bounds, parts }
    };
    meshes.into_iter().map(thing).collect()
}

fn parts(meshes: &[&Mesh], bounds: &Aabb, most: usize) -> Vec<Aabb> {
    let longest_m = PIECE * (bounds.max - bounds.min).length();
    let mut pieces = Vec::new();
    for mesh in meshes {
        for &corners in mesh.shape.indices.as_chunks::<3>().0 {
            add_pieces(
                corners.map(|corner| mesh.position_ned_m(corner)),
                longest_m,
                MOST_HALVINGS,
                &mut pieces,
            );
        }
    }
    let mut parts = Vec::new();
    divide(&mut pieces, most, &mut parts);
    parts
}

/// Boxes around the pieces of a triangle.
fn add_pieces([a, b, c]: [DVec3; 3], longest_m: f64, halvings: u32, pieces: &mut Vec<Aabb>) {
    let sides = [(a, b, c), (b, c, a), (c, a, b)];
    let length_m = |(from, to, _): &(DVec3, DVec3, DVec3)| from.distance(*to);
    let longest = sides.iter().max_by(|a, b| length_m(a).total_cmp(&length_m(b)));
    match longest.filter(|side| halvings > 0 && length_m(side) > longest_m) {
        Some(&(from, to, apex)) => {
            let middle = 0.5 * (from + to);
            add_pieces([from, middle, apex], longest_m, halvings - 1, pieces);
            add_pieces([middle, to, apex], longest_m, halvings - 1, pieces);
        }
        None => pieces.push(Aabb { min: a.min(b).min(c), max: a.max(b).max(c) }),
    }
}

/// Divides boxes into at most so many parts, halves of halves.
fn divide(pieces: &mut [Aabb], most: usize, parts: &mut Vec<Aabb>) {
    if most < 2 || pieces.len() < 2 {
        parts.extend(pieces.iter().copied().reduce(|all, each| all.union(&each)));
        return;
    }
    let centres = pieces.iter().map(Aabb::centre);
    let (low, high) = centres.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), centre| {
        (low.min(centre), high.max(centre))
    });
    let axis = (high - low).max_position();
    let middle = pieces.len() / 2;
    pieces.select_nth_unstable_by(middle, |a, b| a.centre()[axis].total_cmp(&b.centre()[axis]));
    let (left, right) = pieces.split_at_mut(middle);
    divide(left, most / 2, parts);
    divide(right, most - most / 2, parts);
}

#[cfg(test)]
mod tests {
    use camsim_core::scene::{Encoding, Texture};

    use super::*;

    #[test]
    fn parts_hold_the_thing_and_little_else() {
        // A square in a vertical plane, of two triangles, whose diagonal is long.
        let texture = Arc::new(Texture::uniform([255; 4], Encoding::Srgb));
        let square = Mesh::level_picture(texture, DVec3::ZERO, 10.0);
        let bounds = square.bounds();
        let parts = parts(&[&square], &bounds, 64);
        assert!(parts.len() > 32 && parts.len() <= 64, "{}", parts.len());
        let area = |bounds: &Aabb| (bounds.max.x - bounds.min.x) * (bounds.max.y - bounds.min.y);
        let sum: f64 = parts.iter().map(area).sum();
        assert!(sum < 1.6 * area(&bounds), "{sum}");
        for x in -10..=10 {
            for y in -10..=10 {
                let point = DVec3::new(0.5 * f64::from(x), 0.5 * f64::from(y), 0.0);
                let inside = |part: &Aabb| point.cmpge(part.min).all() && point.cmple(part.max).all();
                assert!(parts.iter().any(inside), "{point}");
            }
        }
    }
}
