//! Packets against rays that are traced alone.

use std::sync::Arc;

use super::*;
use crate::scene::{Encoding, Mesh, MeshVertex, Texture, ray_bvh::RayBvh, texture::Wrap};

fn part(k: usize, step: f64) -> f64 {
    (k as f64 * step).fract()
}

/// Triangles of many sizes about a point, from a camera at the origin.
fn mesh(away_m: f64, one_sided: bool) -> Mesh {
    let corner = |k: usize| {
        let centre = 10.0 * DVec3::new(part(k / 3, 0.618), part(k / 3, 0.755), part(k / 3, 0.57));
        let size = 10_f64.powf(-3.0 * part(k / 3, 0.31));
        let offset = DVec3::new(part(k, 0.83), part(k, 0.47), part(k, 0.29)) - 0.5;
        MeshVertex::new((centre + 6.0 * size * offset).as_vec3().to_array(), [0.0; 2])
    };
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let origin = DVec3::new(away_m, -5.0, -5.0);
    let mut mesh =
        Mesh::new((0..1200).map(corner).collect(), (0..1200).collect(), texture, origin, Wrap::Clamp);
    mesh.ned_from_shape = DMat3::from_rotation_z(0.3) * 1.5;
    mesh.material.one_sided = one_sided;
    mesh
}

#[test]
fn packet_meets_what_its_rays_meet() {
    let mut packet = RayPacket::default();
    let mut met = 0;
    for (away_m, one_sided) in [(20.0, false), (20.0, true), (-3000.0, false)] {
        let mesh = mesh(away_m, one_sided);
        let tree = RayBvh::new(&mesh.shape.triangle_boxes());
        for number in 0..200 {
            let centre = DVec3::new(away_m, 7.0 * part(number, 0.618) - 3.0, 7.0 * part(number, 0.755));
            let spread_m = [0.0, 0.01, 0.5][number % 3];
            let rays = std::array::from_fn(|i| {
                let across = DVec3::new(0.0, part(i, 0.125) - 0.5, (i / 8) as f64 / 8.0 - 0.5);
                let origin_ned_m = spread_m * DVec3::new(part(i, 0.3), part(i, 0.7), part(i, 0.9));
                let direction_ned = (centre + 2.0 * across) * [1.0, 1e-3][i % 2];
                let limit = [f64::INFINITY, 1.1, 1000.0, -1.0][i % 4];
                PacketRay { t_s: 0.0, origin_ned_m, direction_ned, limit }
            });
            assert!(packet.begin(&rays));
            mesh.meet_packet(&mut packet, &tree, 7);
            for (i, ray) in rays.iter().enumerate() {
                let corners = |n: usize| [0, 1, 2].map(|k| mesh.shape.indices[3 * n + k]);
                let meet = |n: usize| {
                    let points = corners(n).map(|corner| mesh.position_ned_m(corner));
                    let PacketRay { origin_ned_m, direction_ned, limit, .. } = *ray;
                    let (t, weights) = crate::scene::terrain::intersect_triangle(
                        points,
                        origin_ned_m,
                        direction_ned,
                        limit,
                    )?;
                    mesh.is_visible(corners(n), weights, direction_ned).then_some(t)
                };
                let first = (0..400).filter_map(meet).min_by(f64::total_cmp);
                let hit = packet.hit(i);
                assert_eq!(first.is_some(), hit.is_some(), "{away_m} {number} {i}: {first:?} {hit:?}");
                if let (Some(t), Some(hit)) = (first, hit) {
                    assert!((hit.t / t - 1.0).abs() < 1e-10 && hit.surface == 7, "{hit:?}, not {t}");
                    met += 1;
                }
            }
        }
    }
    assert!(met > 2000, "{met}");
}

#[test]
fn rays_that_go_apart_or_are_not_finite_are_no_packet() {
    let ray = |direction_ned| PacketRay { direction_ned, limit: 1.0, ..PacketRay::NONE };
    let mut packet = RayPacket::default();
    for odd in [-DVec3::X, DVec3::Y, DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
        for place in [0, 9, 36, 63] {
            let mut rays = [ray(DVec3::X); PACKET_RAYS];
            rays[place] = ray(odd);
            assert!(!packet.begin(&rays), "{odd} {place}");
            rays[place].origin_ned_m = odd;
            rays[place].direction_ned = DVec3::X;
            assert_eq!(packet.begin(&rays), odd.is_finite(), "{odd} {place}");
        }
    }
    let none = PacketRay { limit: -1.0, ..ray(DVec3::NAN) };
    assert!(packet.begin(&[none; PACKET_RAYS]));
    assert!((0..PACKET_RAYS).all(|i| packet.hit(i).is_none()));
}
