#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::*;
use camsim_core::scene::{Encoding, Mesh, Terrain, Texture};

#[test]
fn kernels_of_splines_and_grids_cost_more_than_those_of_one() {
    for width_px in [1.0, 2.0, 3.0, 4.0] {
        let ms = |stage: TapStage, samples: Option<u32>| {
            footprint_ms(stage, &Footprint::new(width_px * DVec2::X, width_px * DVec2::Y, stage), samples)
        };
        for samples in [None, Some(16), Some(40)] {
            let either = ms(TapStage::SplineOrGrid { most: 4 }, samples);
            for other in [TapStage::Bilinear, TapStage::Spline, TapStage::Grid { most: 4 }] {
                assert!(ms(other, samples) < either, "{width_px} {other:?} {samples:?}");
            }
            assert!(ms(TapStage::Bilinear, samples) < ms(TapStage::Spline, samples));
        }
    }
}

#[test]
fn reads_of_two_mip_levels_cost_more_and_grids_of_one_read_do_not() {
    let ms =
        |texels: f64, reads: PrefilterTaps| surface_ms(DMat2::from_diagonal(DVec2::splat(texels)), reads);
    for reads in PrefilterTaps::ALL {
        assert!(ms(0.3, reads) < ms(4.0, reads), "{reads:?}");
    }
    assert!(ms(0.3, PrefilterTaps::Grid) < ms(0.3, PrefilterTaps::Four), "one of up to 64");
    assert!(ms(4.0, PrefilterTaps::Grid) > ms(0.3, PrefilterTaps::Grid) + SURFACE_READ_MS);
}

#[test]
fn triangle_prices_are_capped_by_the_level_of_detail() {
    let picture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let heights = |side: u32| {
        Terrain::from_heights(side, side, 10.0, &vec![0.0; (side * side) as usize], None).unwrap()
    };
    let of = |terrain: Option<Terrain>, meshes: Vec<Mesh>| {
        TrianglePrices::new(&Scene { terrain, meshes, ..Scene::default() })
    };
    assert_eq!(TrianglePrices::new(&Scene::default()).ms(1.0), 0.0);
    let of_64_cells = 1e-3 * TRIANGLES_MS * 2.0 * 64.0 * 64.0;
    assert!((of(Some(heights(65)), vec![]).ms(2.0) - of_64_cells).abs() < 1e-9);
    assert_eq!(of(Some(heights(513)), vec![]).ms(2.0), TERRAIN_MS[0] + 2.0 * TERRAIN_MS[1]);
    let square = Mesh::level_picture(picture, DVec3::ZERO, 5.0);
    assert!((of(None, vec![square; 500]).ms(1.0) - TRIANGLES_MS).abs() < 1e-9, "a thousand triangles");
}
