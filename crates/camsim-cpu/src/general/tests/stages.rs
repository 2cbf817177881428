//! Stages with all of their variants against their twins, pixel by pixel.

use camsim_core::{
    scenario::{Auto, Solver},
    temporal::{
        ColorImage, Footprint, InverseDepthImage, KeyDepth, NodeDepths, PathStage, TapStage,
        displacement::{RK2_STEP_DEG, linear, rk2},
        gather, reproject, reproject_nodes,
    },
};
use camsim_plan::{BlurStage, EdgeStage, TemporalStage};
use glam::{DMat3, DVec2, DVec3};

use super::scenes::{Case, EAST, TURN, ground_and_roof, rolling, scenario, sequence, steady};
use crate::general::{IdealImage, RowTable};

const ITERATIONS: u32 = 3;

/// Over a roof, by pixels of the ideal frame alone, with an ideal frame so much finer than the picture.
fn over_roof(exposure_ms: f64, finer: f64) -> Case {
    let mut moving = scenario();
    moving.camera.shutter = rolling(40.0, exposure_ms);
    moving.quality.key_frames = Auto::Value(1);
    let scene = ground_and_roof(900.0, 60.0, 15.0);
    let mut case = Case::new(sequence(moving, steady(120.0, EAST, TURN), scene));
    case.plan.edges = EdgeStage::None;
    case.plan.temporal = TemporalStage::Reproject { iterations: ITERATIONS };
    case = case.widened(20);
    let ideal = &mut case.plan.ideal;
    ideal.focal_px *= finer;
    ideal.principal_px = (ideal.principal_px + 0.5) * finer - 0.5;
    ideal.size_px = ideal.size_px.map(|side| (f64::from(side) * finer) as u32);
    case
}

/// Relative poses of the row of pixels at `y`: at the nodes, then at mid-exposure.
fn poses(table: &RowTable, y: u32) -> Vec<(DMat3, DVec3)> {
    let RowTable::Poses(table) = table else { panic!("a table of poses") };
    let entries = table.entries.iter().skip((y * table.stride) as usize).take(table.stride as usize);
    let number = |entry: &[[f32; 4]; 3], row: usize, column: usize| f64::from(entry[row][column]);
    let pose = |entry: &[[f32; 4]; 3]| {
        let row = |i| DVec3::new(number(entry, i, 0), number(entry, i, 1), number(entry, i, 2));
        let shift = DVec3::new(number(entry, 0, 3), number(entry, 1, 3), number(entry, 2, 3));
        (DMat3::from_cols(row(0), row(1), row(2)).transpose(), shift)
    };
    entries.map(pose).collect()
}

struct Twin<'a> {
    case: &'a Case,
    ideal: &'a IdealImage,
    table: RowTable,
}

impl<'a> Twin<'a> {
    fn new(case: &'a Case, ideal: &'a IdealImage) -> Self {
        Self { case, ideal, table: RowTable::new(&case.plan, &case.sequence.path) }
    }

    fn uv(&self, [x, y]: [u32; 2]) -> DVec2 {
        let camera = &self.case.plan.camera;
        (DVec2::new(x.into(), y.into()) - camera.principal_point_px) / camera.focal_px
    }

    /// Colour and mid-exposure source of a pixel; `None` outside of the ideal frame.
    fn pixel(&self, pixel: [u32; 2]) -> Option<(DVec3, DVec2)> {
        let plan = &self.case.plan;
        let size_px = plan.ideal.size_px;
        let depth = InverseDepthImage { size_px, values: &self.ideal.inverse_depth };
        let plane = plan.plane.seen_from(&plan.keys[0].pose);
        let key = KeyDepth { ideal: &plan.ideal, depth: &depth, plane, sky_reach_px: plan.sky_reach_px };
        let (uv, all) = (self.uv(pixel), poses(&self.table, pixel[1]));
        let (mid, nodes) = all.split_last()?;
        let middle = reproject(uv, *mid, ITERATIONS, &key)?.position_px;
        let (nodes_px, path, samples_per_px, cap) = match plan.blur {
            None => (vec![middle], PathStage::Straight, 0.0, 1),
            Some(blur) => {
                let solved: Vec<_> = nodes.iter().step_by(blur.stride as usize).copied().collect();
                let sources = reproject_nodes(uv, &solved, *mid, blur.depths, ITERATIONS, &key);
                let nodes_px =
                    sources.into_iter().map(|source| Some(source?.position_px)).collect::<Option<_>>()?;
                (nodes_px, blur.path, blur.samples_per_px, blur.max_samples)
            }
        };
        let pixel_size = plan.ideal.focal_px / plan.camera.focal_px;
        let area = Footprint::new(DVec2::new(pixel_size.x, 0.0), DVec2::new(0.0, pixel_size.y), plan.taps);
        let color = ColorImage { size_px, rgba: &self.ideal.color_rgba };
        Some((gather(&nodes_px, path, &area, &color, samples_per_px, cap), middle))
    }

    /// Compares all pixels; so many are shown.
    fn compare(&self, name: &str) -> usize {
        let (picture, truth) = self.case.render_from(std::slice::from_ref(self.ideal), 0.0);
        let mut shown = 0;
        for (i, pixel) in self.case.pixels() {
            let found = &picture[4 * i..4 * i + 4];
            let Some((color, source_px)) = self.pixel(pixel) else {
                assert_eq!(found, [0.0; 4], "{name} {pixel:?}");
                continue;
            };
            let found = DVec3::new(found[0].into(), found[1].into(), found[2].into());
            let expected = color.clamp(DVec3::ZERO, DVec3::ONE);
            assert!(found.distance(expected) < 1e-6, "{name} {pixel:?}: {found} {expected}");
            // Single precision, of coordinates up to 400 px.
            let found_px = DVec2::from_array(truth[i].source_px.map(f64::from));
            assert!(found_px.distance(source_px) < 5e-5, "{name} {pixel:?}: {found_px} {source_px}");
            shown += 1;
        }
        shown
    }
}

#[test]
fn exposures_with_all_node_depths_and_paths_agree_with_their_twins() {
    for depths in NodeDepths::ALL {
        for (path, stride, stretches) in [
            (PathStage::Straight, 1, 1),
            (PathStage::Straight, 2, 3),
            (PathStage::Parabola, 1, 1),
            (PathStage::Parabola, 3, 2),
            (PathStage::Quartic, 1, 2),
            (PathStage::Quartic, 2, 3),
        ] {
            let nodes = stride * path.steps() * stretches + 1;
            let mut case = over_roof(200.0, 1.0);
            case.plan.taps = TapStage::Spline;
            case.plan.blur =
                Some(BlurStage { nodes, stride, path, depths, samples_per_px: 2.0, max_samples: 64 });
            let ideal = case.ideal();
            let name = format!("{depths:?} {path:?} {stretches}x, every {stride}");
            let shown = Twin::new(&case, &ideal[0]).compare(&name);
            assert!(shown > 1500, "{name}: {shown}");
        }
    }
}

#[test]
fn all_taps_agree_with_their_twins() {
    let taps = [
        TapStage::Bilinear,
        TapStage::Spline,
        TapStage::Area,
        TapStage::Grid { most: 2 },
        TapStage::Grid { most: 8 },
        TapStage::SplineOrGrid { most: 4 },
    ];
    for finer in [1.0, 1.5, 3.2] {
        for exposure_ms in [0.0, 100.0] {
            let mut case = over_roof(exposure_ms, finer);
            assert_eq!(case.plan.blur.is_some(), exposure_ms > 0.0);
            let ideal = case.ideal();
            let mut pictures = Vec::new();
            for taps in taps {
                case.plan.taps = taps;
                let name = format!("{taps:?} of {finer} ideal pixels, {exposure_ms} ms");
                let shown = Twin::new(&case, &ideal[0]).compare(&name);
                assert!(shown > 1500, "{name}: {shown}");
                pictures.push(case.render_from(&ideal, 0.0).0);
            }
            // Wide pixels are read differently by each.
            if finer > 3.0 {
                for (i, a) in pictures.iter().enumerate() {
                    assert!(pictures[..i].iter().all(|b| a != b), "{:?}", taps[i]);
                }
            }
        }
    }
}

#[test]
fn solvers_of_constant_twist_agree_with_their_formulas() {
    for (solver, step_rad) in [(Solver::Linear, 0.0), (Solver::Rk2, RK2_STEP_DEG.to_radians())] {
        let mut moving = scenario();
        moving.camera.shutter = rolling(200.0, 20.0);
        moving.quality.solver = Auto::Value(solver);
        let scene = ground_and_roof(900.0, 60.0, 15.0);
        let mut case = Case::new(sequence(moving, steady(120.0, EAST, 2.0 * TURN), scene)).widened(20);
        case.plan.edges = EdgeStage::None;
        let ideal = case.ideal();
        let RowTable::Times(times) = RowTable::new(&case.plan, &case.sequence.path) else {
            panic!("a table of times")
        };
        let nodes = case.plan.blur.unwrap().nodes;
        let twin = Twin::new(&case, &ideal[0]);
        let depth = InverseDepthImage { size_px: case.plan.ideal.size_px, values: &ideal[0].inverse_depth };
        for (phase, node) in [(-0.5, 0), (0.0, nodes), (0.5, nodes - 1)] {
            let (picture, truth) = case.render_from(&ideal, phase);
            let mut shown = 0;
            for (i, pixel) in case.pixels().filter(|(i, _)| picture[4 * i + 3] > 0.0) {
                let uv = twin.uv(pixel);
                let w = depth.inverse_depth(case.plan.ideal.px_from_point(uv.extend(1.0)));
                let dt_s = f64::from(times.dt_s[(pixel[1] * times.stride + node) as usize]);
                let moved = match solver {
                    Solver::Linear => linear(uv, w, &case.plan.key_twist, dt_s),
                    _ => rk2(uv, w, &case.plan.key_twist, dt_s, step_rad),
                };
                let expected = case.plan.ideal.px_from_point(moved.extend(1.0));
                let found = DVec2::from_array(truth[i].source_px.map(f64::from));
                assert!(found.distance(expected) < 2e-5, "{solver:?} {pixel:?}: {found} {expected}");
                shown += 1;
            }
            assert!(shown > 1500, "{solver:?}: {shown}");
        }
    }
}
