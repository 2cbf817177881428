#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use glam::DVec3;

use super::*;
use crate::view::{lens_reach::LensReach, surfaces::Surfaces, test_flights::flying_east_from};
use camsim_core::{
    camera::CameraModel,
    scenario::{LensModel, ShutterSpec},
    scene::{Encoding, Mesh, MeshVertex, Scene, Terrain, Texture, Wrap},
    shutter::Shutter,
};

/// Thin masts, some on each of the hills below.
fn masts() -> Vec<Mesh> {
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let mast = |i: u32| {
        let part = |step: f64| (f64::from(i) * step).fract() - 0.5;
        let foot = DVec3::new(1200.0 * part(0.618), 1200.0 * part(0.755), 0.0);
        let corners = [
            [-0.4, 0.0, 30.0],
            [0.4, 0.0, 30.0],
            [0.4, 0.0, -40.0],
            [-0.4, 0.0, -40.0],
            [0.0, 0.6, -40.0],
            [0.0, 0.6, 30.0_f32],
        ];
        let vertices = corners.map(|corner| MeshVertex::new(corner, [0.0; 2])).to_vec();
        Mesh::new(vertices, vec![0, 1, 2, 0, 2, 3, 3, 2, 4, 0, 1, 5], texture.clone(), foot, Wrap::Clamp)
    };
    (0..200).map(mast).collect()
}

#[test]
fn lines_are_skipped_only_where_they_cross_nothing() {
    let heights: Vec<f64> = (0..161 * 161)
        .map(|i| 15.0 * (f64::from(i % 161) * 0.11).sin() * (f64::from(i / 161) * 0.07).cos())
        .collect();
    let terrain = Terrain::from_heights(161, 161, 10.0, &heights, None).unwrap();
    let surfaces =
        Surfaces::new(Arc::new(Scene { terrain: Some(terrain), meshes: masts(), ..Scene::default() }));
    let shutter =
        Shutter::from_spec(&ShutterSpec { readout_ms: 60.0, ..ShutterSpec::default() }, 5.0, [400, 300])
            .unwrap();
    let camera = CameraModel::new([400, 300], [300.0; 2], None, LensModel::Pinhole, &[]).unwrap();
    let (reach, gain) = (LensReach::new(Arc::new(camera)).unwrap(), |_: [u32; 2]| 1.0);
    let (mut left_out, mut found) = (0, 0);
    for up_deg in [-90.0, -50.0, -20.0] {
        let path = flying_east_from(DVec3::new(-200.0, 0.0, -250.0), up_deg);
        for frame in 0..6 {
            let stamp_s = 0.1 * f64::from(frame) - 0.3;
            let search = NeighbourhoodSearch {
                reach: &reach,
                surfaces: &surfaces,
                path: &path,
                shutter: &shutter,
                stamp_s,
                gain: &gain,
            };
            let neighbourhoods = search.neighbourhoods().of_probes;
            for (number, (probe, neighbourhood)) in reach.probes.iter().zip(&neighbourhoods).enumerate() {
                let crossings = search.line_crossings(number, &NinePoints::new(&search, probe));
                assert_eq!(neighbourhood.crossings, crossings, "{up_deg} {frame}: {:?}", probe.pixel);
                left_out += usize::from(crossings == LineCrossings::default());
                found += usize::from(crossings != LineCrossings::default());
            }
        }
    }
    assert!(left_out > 5000 && found > 100, "{left_out} {found}");
}
