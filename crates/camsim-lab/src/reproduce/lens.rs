//! 8.3: circles seen through the paper's lens from its 60 camera poses (figs. 11 and 12).

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    flight_log::{HeightConversion, LogRow},
    frame::RenderedFrame,
    lens::paper::gauss_newton,
    reference::ErrorStats,
    scenario::{CameraSpec, FlightSpec, LensModel, LensSpec, LogFormat, TrackerKind, TrackerSpec},
    scene::Scene,
    sequence::Sequence,
    tracker::track,
};
use camsim_io::flight_log::read_flight_log;
use glam::{DQuat, DVec2, DVec3};
use rayon::prelude::*;

use super::{
    ExperimentReport, Picture, ReproduceError, Setup, Table,
    circle_grid::CircleImage,
    circles::{LEAST_PX, detect_blobs, match_circles},
    short, test_bench,
};
use crate::plot::{Plot, Series};

/// Width of the target, in the unit of the poses.
const TARGET_M: f64 = 3000.0;
/// Number of frames on a contact sheet.
const SHEET_FRAMES: usize = 12;
/// Width of a ring of the plot, in pixels of a frame of 640 pixels.
const RING_PX: f64 = 20.0;
/// Smallest number of circles in a ring that is plotted.
const RING_CIRCLES: usize = 20;

/// A calibration and the file of its poses.
struct Calibration {
    name: &'static str,
    poses: &'static str,
    camera: CameraSpec,
}

/// Table 2 of the paper, with the digits of the paper's program, in which integers are pixel corners.
fn calibrations(width_px: u32) -> [Calibration; 2] {
    let scale = f64::from(width_px) / 640.0;
    let opencv = CameraSpec {
        focal_px: [307.960_654 * scale; 2],
        principal_point_px: Some([298.985_405 * scale - 0.5, 227.025_456 * scale - 0.5]),
        lens: LensSpec {
            model: LensModel::BrownConrady,
            coefficients: vec![-0.428_129, 0.158_059, 0.000_245, -0.002_286, -0.029_194],
        },
        ..test_bench::pinhole(width_px)
    };
    [
        Calibration {
            name: "OpenCV",
            poses: "camsim/path-chessboard-S3fisheye-lowoffset-opencv+posetracker.csv",
            camera: opencv,
        },
        Calibration {
            name: "Agisoft Lens",
            poses: "camsim/path-chessboard-S3fisheye-lowoffset-agisoftlens+posetracker.csv",
            camera: test_bench::fisheye(width_px),
        },
    ]
}

/// The paper's poses, one per second; without its files poses around the target, tilted up to 25 deg towards
/// it.
fn poses(setup: &Setup<'_>, file: &str) -> Result<Vec<LogRow>, ReproduceError> {
    if let Some(path) = setup.data_file(file) {
        let spec = FlightSpec { format: LogFormat::CsvNed, ..FlightSpec::new(&path) };
        return Ok(read_flight_log(&path, &spec, HeightConversion::None)?.rows);
    }
    let pose = |i: u32| {
        let i = f64::from(i);
        let (azimuth, radius) = (2.399_963 * i, (i / 60.0).sqrt());
        let tilt = 25f64.to_radians() * radius;
        let outward = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let height_m = 3000.0 + 300.0 * (1.7 * i).sin();
        // A tilt about the horizontal axis across the outward direction turns the view from straight down
        // towards the target.
        let attitude =
            DQuat::from_axis_angle(outward.cross(DVec3::Z), -tilt) * DQuat::from_rotation_z(0.7 * i);
        LogRow {
            t_s: i,
            position_ned_m: height_m * tilt.tan() * outward - height_m * DVec3::Z,
            ned_from_body: attitude,
        }
    };
    Ok((0..60).map(pose).collect())
}

fn sequence(
    camera: CameraSpec,
    rows: &[LogRow],
    scene: &Arc<Scene>,
) -> Result<Arc<Sequence>, ReproduceError> {
    let spec = TrackerSpec { kind: TrackerKind::Linear, ..TrackerSpec::default() };
    let tracked = track(rows, &spec).map_err(|error| ReproduceError::setup("the list of poses", error))?;
    test_bench::in_memory(camera, tracked.trajectory, rows.len() as u64, scene)
}

/// Circles detected in all frames of one calibration.
pub(super) struct CircleDetections {
    /// Matched circles with their blobs.
    pub pairs: Vec<(CircleImage, super::circles::Blob)>,
    /// Number of circles wholly in view without a blob.
    pub missed: usize,
    /// True circles of each frame, in the order of the grid; `None` if not wholly in view.
    true_circles: Vec<Vec<Option<CircleImage>>>,
    /// Rendered frames.
    frames: Vec<RenderedFrame>,
}

/// Renders the first `count` poses of a calibration (0 OpenCV, 1 Agisoft) and detects circles.
pub(super) fn detect(
    setup: &Setup<'_>,
    calibration: usize,
    count: u64,
) -> Result<CircleDetections, ReproduceError> {
    let [opencv, agisoft] = calibrations(setup.width_px);
    let calibration = if calibration == 0 { opencv } else { agisoft };
    let rows = poses(setup, calibration.poses)?;
    let sequence = sequence(calibration.camera, &rows, &test_bench::target(setup, TARGET_M)?)?;
    let mut detections =
        CircleDetections { pairs: Vec::new(), missed: 0, true_circles: Vec::new(), frames: Vec::new() };
    for finished in test_bench::render(setup.engine, &sequence, &[], 0..count.min(sequence.frames))? {
        let true_circles = test_bench::grid_images(&sequence, finished.plan.stamp_s, TARGET_M)?;
        let in_view: Vec<CircleImage> = true_circles.iter().flatten().copied().collect();
        let matches = match_circles(&in_view, &detect_blobs(&finished.frame));
        detections.missed += matches.missed;
        detections.pairs.extend(matches.pairs);
        detections.true_circles.push(true_circles);
        detections.frames.push(finished.frame);
    }
    Ok(detections)
}

impl CircleDetections {
    fn errors_px(&self) -> Vec<f64> {
        self.pairs.iter().map(|(circle, blob)| circle.centroid_px.distance(blob.centroid_px)).collect()
    }

    /// Points (distance from the principal point, RMS error), px.
    fn rings(&self, principal_px: DVec2, width_px: u32) -> Vec<(f64, f64)> {
        let ring_px = RING_PX * f64::from(width_px) / 640.0;
        let mut rings: Vec<Vec<f64>> = Vec::new();
        for (circle, blob) in &self.pairs {
            let ring = (circle.centroid_px.distance(principal_px) / ring_px) as usize;
            rings.resize(rings.len().max(ring + 1), Vec::new());
            rings[ring].push(circle.centroid_px.distance(blob.centroid_px));
        }
        let filled = rings.into_iter().enumerate().filter(|(_, errors)| errors.len() >= RING_CIRCLES);
        filled.map(|(ring, errors)| ((ring as f64 + 0.5) * ring_px, ErrorStats::of(errors).rms_px)).collect()
    }
}

// Long because: a list of tables, plots and pictures.
pub(super) fn run(setup: &Setup<'_>) -> Result<ExperimentReport, ReproduceError> {
    let mut report = ExperimentReport::default();
    let source = if setup.data.is_some() {
        "the 60 poses of the paper's program, from one file per calibration"
    } else {
        "60 built-in poses, none of them the paper's, which need --data"
    };
    report.notes.push(format!(
        "Poses: {source}. The true position of a circle is the centroid of its image, from its rim projected \
         by the forward lens model. The paper compares its frames with photographs, which are not available; \
         its 0.73 px contain their noise and the errors of calibration, poses and print. These figures \
         contain only the errors of camsim and of the detection."
    ));
    let detections = [detect(setup, 0, u64::MAX)?, detect(setup, 1, u64::MAX)?];
    if let Some((calibration, _)) =
        calibrations(setup.width_px).iter().zip(&detections).find(|(_, found)| found.pairs.is_empty())
    {
        return Err(ReproduceError::NoCircle {
            calibration: calibration.name,
            width_px: setup.width_px,
            least_px: LEAST_PX,
        });
    }
    let mut table = Table::new(
        "Centres of the area of the circles, px",
        &[
            "calibration",
            "pictures",
            "circles",
            "missed",
            "RMS",
            "99 %",
            "largest",
            "centre of the circle instead, RMS",
            "picture without a ray",
        ],
    );
    let mut series = Vec::new();
    for (calibration, found) in calibrations(setup.width_px).iter().zip(&detections) {
        let camera = model(calibration)?;
        let stats = ErrorStats::of(found.errors_px());
        let of_centres = ErrorStats::of(
            found.pairs.iter().map(|(circle, blob)| circle.centre_px.distance(blob.centroid_px)).collect(),
        );
        table.row([
            calibration.name.into(),
            found.frames.len().to_string(),
            stats.count.to_string(),
            found.missed.to_string(),
            short(stats.rms_px),
            short(stats.p99_px),
            short(stats.max_px),
            short(of_centres.rms_px),
            format!("{:.2} %", 100.0 * (1.0 - camera.check().valid_fraction)),
        ]);
        let points = found.rings(camera.principal_point_px, setup.width_px);
        series.push(Series::line(calibration.name, points));
    }
    report.tables.push(("circles", table));
    if setup.data.is_some() {
        report.tables.push(("calibrations", calibration_difference(&detections)));
    }
    match radius_plot(series) {
        Some(plot) => report.plots.push(("radius", plot)),
        None => report.notes.push(format!(
            "No plot by radius: no ring has {RING_CIRCLES} detected circles; choose a larger --width."
        )),
    }
    report.tables.push(("inverse", inverse_table(setup)?));
    let [opencv, agisoft] = detections;
    let mut frames = Vec::new();
    for (calibration, found) in calibrations(setup.width_px).iter().zip([&opencv, &agisoft]) {
        let Some(frame) = found.frames.first() else { continue };
        frames.push(frame.clone());
        frames.push(with_paper_roots(frame, &model(calibration)?));
    }
    report.pictures.push(Picture {
        name: "fig12",
        caption: "Fig. 12: the first pose with the calibration of OpenCV (above) and of Agisoft Lens \
                  (below). (a, c) camsim; red pixels have no ray. (b, d) the paper's Gauss-Newton on the \
                  same frame: red where it does not converge, blue where it converges to a ray that the lens \
                  images elsewhere."
            .into(),
        frames,
        columns: 2,
        shrink: 1,
    });
    for (name, caption, found) in [
        ("poses-opencv", "Every fifth pose with OpenCV's calibration.", opencv),
        ("poses-agisoft", "Every fifth pose with Agisoft Lens's calibration.", agisoft),
    ] {
        let step = found.frames.len().div_ceil(SHEET_FRAMES).max(1);
        report.pictures.push(Picture {
            name,
            caption: caption.into(),
            frames: found.frames.into_iter().step_by(step).collect(),
            columns: 4,
            shrink: 2,
        });
    }
    Ok(report)
}

/// Plot of [`CircleDetections::rings`]; `None` without points.
fn radius_plot(series: Vec<Series>) -> Option<Plot> {
    series.iter().any(|series| !series.points.is_empty()).then(|| Plot {
        title: "Error of circle centres by their position in the picture".into(),
        x_label: "distance from the principal point, px".into(),
        y_label: "error, px RMS".into(),
        log: [false, false],
        series,
    })
}

fn model(calibration: &Calibration) -> Result<CameraModel, ReproduceError> {
    CameraModel::from_spec(&calibration.camera).map_err(|error| ReproduceError::setup("the camera", error))
}

/// Result of the paper's Gauss-Newton at a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RootKind {
    /// The true ray, or rightly none.
    Right,
    /// No ray, although there is one.
    Missed,
    /// A ray that the lens does not image there, or one that is off by 1 px or more.
    False,
}

/// The paper's Gauss-Newton at every pixel, row by row: whether it converges, and the kind of its result.
pub(super) fn paper_roots(camera: &CameraModel) -> Vec<(bool, RootKind)> {
    let [width, height] = camera.size_px;
    let focal_px = camera.focal_px.x;
    let root = |i: u32| {
        let pixel = DVec2::new(f64::from(i % width), f64::from(i / width));
        let ray = gauss_newton(&camera.lens, camera.distorted_from_pixel(pixel), camera.size_px);
        let kind = match (ray, camera.unproject(pixel)) {
            (None, Some(_)) => RootKind::Missed,
            (Some(ray), truth) if truth.is_none_or(|truth| focal_px * ray.distance(truth) >= 1.0) => {
                RootKind::False
            }
            _ => RootKind::Right,
        };
        (ray.is_some(), kind)
    };
    (0..width * height).into_par_iter().map(root).collect()
}

/// The frame with the invalid pixels of the paper's lens inverse, and false roots in blue.
fn with_paper_roots(frame: &RenderedFrame, camera: &CameraModel) -> RenderedFrame {
    let mut frame = frame.clone();
    for (pixel, (converges, kind)) in frame.color_rgba_mut().chunks_exact_mut(4).zip(paper_roots(camera)) {
        match (converges, kind) {
            (_, RootKind::False) => pixel.copy_from_slice(&[0.0, 0.0, 1.0, 1.0]),
            (false, _) => pixel[3] = 0.0,
            _ => {}
        }
    }
    frame
}

/// Missing and false rays of the paper's lens inverse. The truth is camsim's inverse, whose round-trip error
/// is in the last column.
fn inverse_table(setup: &Setup<'_>) -> Result<Table, ReproduceError> {
    let mut table = Table::new(
        "Inverse of the lens at every pixel (50 steps, 0.1 px as in the paper)",
        &[
            "calibration",
            "pixels with a ray",
            "Gauss-Newton misses, of these",
            "its false roots, of all",
            "camsim: worst round trip, px",
        ],
    );
    for calibration in &calibrations(setup.width_px) {
        let camera = model(calibration)?;
        let (check, roots) = (camera.check(), paper_roots(&camera));
        let count = |kind: RootKind| roots.iter().filter(|root| root.1 == kind).count() as f64;
        let pixels = roots.len() as f64;
        table.row([
            calibration.name.into(),
            format!("{:.2} %", 100.0 * check.valid_fraction),
            format!("{:.2} %", 100.0 * count(RootKind::Missed) / (check.valid_fraction * pixels)),
            format!("{:.2} %", 100.0 * count(RootKind::False) / pixels),
            short(check.worst_roundtrip_px),
        ]);
    }
    Ok(table)
}

/// Distance between the images of the same circle by the two calibrations, which were fitted to the same
/// photographs.
fn calibration_difference([opencv, agisoft]: &[CircleDetections; 2]) -> Table {
    let shifts: Vec<DVec2> = opencv
        .true_circles
        .iter()
        .zip(&agisoft.true_circles)
        .flat_map(|(a, b)| a.iter().zip(b))
        .filter_map(|(a, b)| Some((*a)?.centroid_px - (*b)?.centroid_px))
        .collect();
    let mean = shifts.iter().sum::<DVec2>() / shifts.len().max(1) as f64;
    let [stats, centred] = [DVec2::ZERO, mean]
        .map(|origin| ErrorStats::of(shifts.iter().map(|shift| shift.distance(origin)).collect()));
    let mut table = Table::new(
        "Between the two calibrations of the same photographs, px",
        &["", "circles", "RMS", "99 %", "largest", "mean shift x, y", "RMS without it"],
    );
    table.row([
        "OpenCV against Agisoft Lens".into(),
        stats.count.to_string(),
        short(stats.rms_px),
        short(stats.p99_px),
        short(stats.max_px),
        format!("{:.2}, {:.2}", mean.x, mean.y),
        short(centred.rms_px),
    ]);
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plot_needs_a_ring_with_points() {
        let series = |points: &[(f64, f64)]| Series::line("", points.to_vec());
        assert_eq!(radius_plot(vec![series(&[]), series(&[])]), None);
        assert!(
            radius_plot(vec![series(&[]), series(&[(10.0, 0.1)])]).is_some_and(|plot| plot.svg().is_ok())
        );
    }

    #[test]
    fn calibrations_equal_those_of_the_files() {
        let Some(data) = std::env::var_os("CAMSIM_DATA").map(std::path::PathBuf::from) else {
            eprintln!("CAMSIM_DATA is not set: the calibration files are not read");
            return;
        };
        for (calibration, file) in calibrations(640)
            .iter()
            .zip(["S3FishEye5ParamCam-OpenCV.xml", "S3FishEye5ParamCam-AgisoftLens.xml"])
        {
            let imported = camsim_io::formats::reading::import_camera(&data.join("camsim").join(file))
                .expect("a camera");
            let own = &calibration.camera;
            let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
            assert!(near(&own.focal_px, &imported.focal_px), "{file}");
            assert!(
                near(&own.principal_point_px.expect("given"), &imported.principal_point_px.expect("given")),
                "{file}"
            );
            assert!(near(&own.lens.coefficients, &imported.lens.coefficients), "{file}");
        }
    }
}
