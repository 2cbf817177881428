//! Calibration boards: are their edges where the picture shows them, and did OpenCV find the camera again
//! (scripts/goldens/board_opencv.py)?

use std::{convert::Infallible, path::PathBuf, sync::Arc};

use camsim_core::{
    camera::CameraModel,
    frame::RenderedFrame,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{BoardKind, BoardSpec, Channel},
    scene::{Board, BoardPoint, ned_from_board},
    sequence::Sequence,
};
use camsim_engine::{AdapterChoice, Engine};
use camsim_io::{board_file::read_board, load::load_sequence, scenario_file::read_scenario};
use glam::{DVec2, DVec3};

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/board").join(name)
}

/// The 40 poses before a board, and the board.
fn before(spec: impl FnOnce(BoardSpec) -> BoardSpec) -> (Arc<Sequence>, Board, BoardSpec) {
    let mut scenario = read_scenario(&data("euroc_cam0.toml"), &[], None).expect("a scenario");
    let spec = spec(scenario.scene.board.take().expect("a board"));
    scenario.scene.board = Some(spec.clone());
    (load_sequence(&scenario).expect("a sequence").sequence, read_board(&spec).expect("a board"), spec)
}

/// Where a frame shows positions of a board that stands at the origin.
struct Eye {
    camera: CameraModel,
    position_ned_m: DVec3,
    camera_from_board: glam::DMat3,
}

impl Eye {
    fn new(sequence: &Sequence, spec: &BoardSpec, frame: u64) -> Self {
        let camera = &sequence.scenario.camera;
        let pose = sequence.path.pose(sequence.start_s + (frame as f64 + camera.phase) / camera.fps);
        let camera_from_ned = glam::DMat3::from_quat(pose.ned_from_camera).transpose();
        Self {
            camera: CameraModel::from_spec(camera).expect("a camera"),
            position_ned_m: camera_from_ned * pose.position_ned_m,
            camera_from_board: camera_from_ned * ned_from_board(spec.angles_deg),
        }
    }

    fn px(&self, at_m: DVec2) -> DVec2 {
        let p = self.camera_from_board * at_m.extend(0.0) - self.position_ned_m;
        self.camera.project(p.truncate() / p.z)
    }
}

/// Pixels on either side of an edge that its position is found from.
const REACH: i64 = 5;
/// Lines of pixels that a mean is taken over, at least.
const LEAST_LINES: usize = 12;

/// Mean distance of an edge from where it should be, along the rows or columns of pixels that cross it more
/// steeply; `None` with few of them in the picture. Light changes from one side to the other once: the fraction
/// of it that is on the first side, added up, is the edge's position in a line of pixels. What a pixel's filter
/// leaves of its phase is lost in the mean, because neighbouring lines have other phases.
fn edge_error(frame: &RenderedFrame, eye: &Eye, from_m: DVec2, to_m: DVec2) -> Option<f64> {
    let [from_px, to_px] = [0.1, 0.9].map(|fraction| eye.px(from_m.lerp(to_m, fraction)));
    // Across the edge by columns (0) or rows (1).
    let axis = usize::from((to_px - from_px).x.abs() > (to_px - from_px).y.abs());
    let [first, last] = [
        from_px[1 - axis].min(to_px[1 - axis]).ceil() as i64,
        from_px[1 - axis].max(to_px[1 - axis]).floor() as i64,
    ];
    let errors: Vec<f64> =
        (first..=last).filter_map(|line| line_error(frame, eye, [from_m, to_m], axis, line)).collect();
    (errors.len() >= LEAST_LINES).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
}

fn line_error(
    frame: &RenderedFrame,
    eye: &Eye,
    [from_m, to_m]: [DVec2; 2],
    axis: usize,
    line: i64,
) -> Option<f64> {
    let light = |at: [i64; 2]| -> Option<f64> {
        let inside = (0..2).all(|k| (0..i64::from(frame.size_px[k])).contains(&at[k]));
        let index = 4 * (at[1] * i64::from(frame.size_px[0]) + at[0]);
        if inside { frame.color_rgba().get(index as usize).map(|&v| f64::from(v)) } else { None }
    };
    // Where the edge crosses the middle of the line of pixels.
    let (mut low, mut high) = (0.0, 1.0);
    let rising = eye.px(to_m)[1 - axis] > eye.px(from_m)[1 - axis];
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if (eye.px(from_m.lerp(to_m, middle))[1 - axis] < line as f64) == rising {
            low = middle
        } else {
            high = middle
        }
    }
    let truth = eye.px(from_m.lerp(to_m, low))[axis];
    let first = truth.round() as i64 - REACH;
    let lights = (first..=first + 2 * REACH).map(|x| light(if axis == 0 { [x, line] } else { [line, x] }));
    let values = lights.collect::<Option<Vec<f64>>>()?;
    let (one, other) = (values[0], values[values.len() - 1]);
    let even = (values[1] - one).abs().max((values[values.len() - 2] - other).abs()) < 0.02;
    ((one - other).abs() > 0.9 && even)
        .then(|| first as f64 - 0.5 + values.iter().map(|v| (v - other) / (one - other)).sum::<f64>() - truth)
}

/// RMS and largest error of the edges between neighbouring points, and their number.
fn measure(frame: &RenderedFrame, eye: &Eye, edges: &[(DVec2, DVec2)]) -> (f64, f64, usize) {
    let errors: Vec<f64> = edges.iter().filter_map(|&(from, to)| edge_error(frame, eye, from, to)).collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt();
    (rms, errors.iter().fold(0.0, |worst, e| e.abs().max(worst)), errors.len())
}

fn render(sequence: &Arc<Sequence>, frame: u64) -> RenderedFrame {
    let engine = Engine::new(AdapterChoice::Software)
        .expect("tests need a software Vulkan adapter; CAMSIM_SKIP_GPU=1 skips them");
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color]).expect("a session");
    let mut found = None;
    session
        .render::<Infallible>([frame], &mut |finished| {
            found = Some(finished.frame);
            Ok(())
        })
        .expect("rendered");
    found.expect("one frame")
}

/// A pose from near the board.
const FRAME: u64 = 3;
/// RMS and largest error of an edge. The reference's pixels are means over their area. The device reads a pixel
/// at its middle from an ideal frame with 1.6 pixels for each: of the reading's phase only edges along the
/// rows have anything left.
const OF_REFERENCE_PX: [f64; 2] = [0.002, 0.005];
const OF_DEVICE_PX: [f64; 2] = [0.02, 0.15];

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn edges_of_a_chessboard_are_where_the_lens_shows_them() {
    let (sequence, board, spec) = before(|spec| spec);
    let columns = spec.columns.expect("columns") as usize;
    let eye = Eye::new(&sequence, &spec, FRAME);
    let along = board
        .points()
        .windows(2)
        .filter(|two| !(two[1].id as usize).is_multiple_of(columns))
        .map(|two| (two[0].position_m, two[1].position_m));
    let edges: Vec<_> = along
        .chain(
            board.points().iter().zip(&board.points()[columns..]).map(|(a, b)| (a.position_m, b.position_m)),
        )
        .collect();
    let options =
        RenderOptions { channels: vec![Channel::Color], tolerance_dn: 0.5, ..RenderOptions::default() };
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a reference").render(FRAME, &options);
    let pictures =
        [("device", render(&sequence, FRAME), OF_DEVICE_PX), ("reference", reference, OF_REFERENCE_PX)];
    let found = pictures.map(|(name, frame, most)| (name, measure(&frame, &eye, &edges), most));
    for (name, (rms, worst, count), _) in found {
        eprintln!("chessboard, {name}: {rms:.4} px RMS, at most {worst:.4} px over {count} edges");
    }
    for (name, (rms, worst, count), most) in found {
        assert!(count > 60 && rms < most[0] && worst < most[1], "{name}: {rms} {worst} {count}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn edges_of_tags_are_where_the_lens_shows_them() {
    let (sequence, board, spec) = before(|spec| BoardSpec {
        kind: Some(BoardKind::Aprilgrid),
        columns: Some(4),
        rows: Some(3),
        size_m: Some(0.12),
        spacing: Some(0.25),
        ..spec
    });
    let eye = Eye::new(&sequence, &spec, FRAME);
    let around = |tag: &[BoardPoint]| {
        (0..4).map(|k| (tag[k].position_m, tag[(k + 1) % 4].position_m)).collect::<Vec<_>>()
    };
    let edges: Vec<_> = board.points().chunks_exact(4).flat_map(around).collect();
    let (rms, worst, count) = measure(&render(&sequence, FRAME), &eye, &edges);
    eprintln!("AprilGrid: {rms:.4} px RMS, at most {worst:.4} px over {count} edges");
    assert!(count > 30 && rms < OF_DEVICE_PX[0] && worst < OF_DEVICE_PX[1], "{rms} {worst} {count}");
}

#[test]
fn opencv_found_the_camera_again() {
    let (sequence, board, spec) = before(|spec| spec);
    let text = std::fs::read_to_string(data("corners.csv")).expect("corners");
    let (mut squares, mut count) = (0.0, 0);
    for line in text.lines().skip(1) {
        let values: Vec<f64> = line.split(',').map(|value| value.parse().expect("a number")).collect();
        let exact =
            Eye::new(&sequence, &spec, values[0] as u64).px(board.points()[values[1] as usize].position_m);
        squares += exact.distance_squared(DVec2::new(values[2], values[3]));
        count += 1;
    }
    let rms_px = (squares / f64::from(count)).sqrt();
    assert!(count == 40 * 54 && rms_px < 0.1, "{rms_px} px over {count} corners");
    let text = std::fs::read_to_string(data("opencv.json")).expect("figures");
    let found: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    assert!(
        (number(&found["corners_against_truth_rms_px"]) - rms_px).abs() < 1e-3,
        "the figures are not of these corners: {rms_px}"
    );
    let camera = &sequence.scenario.camera;
    let principal_px = camera.principal_point_px.expect("a principal point");
    for axis in 0..2 {
        let focal = number(&found["focal_px"][axis]) / camera.focal_px[axis] - 1.0;
        let principal = number(&found["principal_point_px"][axis]) - principal_px[axis];
        assert!(focal.abs() < 1e-3 && principal.abs() < 0.3, "axis {axis}: {focal} {principal}");
    }
    for (key, exact) in [("k1", camera.lens.coefficients[0]), ("k2", camera.lens.coefficients[1])] {
        assert!((number(&found[key]) - exact).abs() < 0.003, "{key}: {}", found[key]);
    }
    assert!(number(&found["reprojection_rms_px"]) < 0.1);
}
