//! 8.3: circles through the paper's lens, from its 60 camera poses (figs. 11 and 12).

use std::sync::Arc;

use camsim_core::{
    camera::CameraModel,
    flight_log::{HeightConversion, LogRow},
    frame::RenderedFrame,
    lens::paper::gauss_newton,
    mount::CameraPath,
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
    Picture, Report, ReproduceError, Setup, Table,
    circles::{LEAST_PX, matches, spots},
    pattern::Seen,
    rig, short,
};
use crate::plot::{Plot, Series};

/// Width of the target in the unit of the poses.
const TARGET_M: f64 = 3000.0;
/// Frames of the contact sheets, of all poses.
const SHOWN: usize = 12;
/// Width of a ring of the plot, pixels at 640.
const RING_PX: f64 = 20.0;
/// Fewest circles of a ring that is plotted.
const RING_CIRCLES: usize = 20;

/// A calibration and the poses that go with it.
struct Calibration {
    name: &'static str,
    poses: &'static str,
    camera: CameraSpec,
}

/// The paper's table 2, as the reference program has it. There, image corners are at whole numbers.
fn calibrations(width_px: u32) -> [Calibration; 2] {
    let scale = f64::from(width_px) / 640.0;
    let opencv = CameraSpec {
        focal_px: [307.960_654 * scale; 2],
        principal_point_px: Some([298.985_405 * scale - 0.5, 227.025_456 * scale - 0.5]),
        lens: LensSpec {
            model: LensModel::BrownConrady,
            coefficients: vec![-0.428_129, 0.158_059, 0.000_245, -0.002_286, -0.029_194],
        },
        ..rig::pinhole(width_px)
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
            camera: rig::fisheye(width_px),
        },
    ]
}

/// One pose a second. Without the paper's files: poses around the target, tilted up to 25 deg towards it.
fn poses(setup: &Setup<'_>, file: &str) -> Result<Vec<LogRow>, ReproduceError> {
    if let Some(path) = setup.data_file(file) {
        let spec = FlightSpec {
            log: path.clone(),
            format: LogFormat::CsvNed,
            ..rig::scenario(rig::pinhole(96)).flight
        };
        return Ok(read_flight_log(&path, &spec, HeightConversion::None)?.rows);
    }
    let pose = |i: u32| {
        let i = f64::from(i);
        let (around, out) = (2.399_963 * i, (i / 60.0).sqrt());
        let tilt = 25f64.to_radians() * out;
        let sideways = DVec3::new(around.cos(), around.sin(), 0.0);
        let height_m = 3000.0 + 300.0 * (1.7 * i).sin();
        // Leaning about the horizontal axis across the way out turns the view from straight down back to the
        // target.
        let attitude =
            DQuat::from_axis_angle(sideways.cross(DVec3::Z), -tilt) * DQuat::from_rotation_z(0.7 * i);
        LogRow {
            t_s: i,
            position_ned_m: height_m * tilt.tan() * sideways - height_m * DVec3::Z,
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
    let tracked = track(rows, &spec).map_err(|error| ReproduceError::made("the list of poses", error))?;
    let path = CameraPath::new(tracked.trajectory, &camera.mount)
        .map_err(|error| ReproduceError::made("the mount", error))?;
    Ok(Arc::new(Sequence {
        scenario: rig::scenario(camera),
        path: Arc::new(path),
        epoch_ns: 0,
        start_s: 0.0,
        frames: rows.len() as u64,
        scene: scene.clone(),
        vignette: None,
        zoom_track: Vec::new(),
    }))
}

/// What was found in all pictures of one calibration.
pub(super) struct Found {
    /// Every circle with its spot.
    pub pairs: Vec<(Seen, super::circles::Spot)>,
    /// Circles wholly in view that were not found.
    pub missed: usize,
    /// True circles of each picture, in the order of the grid; `None` where not wholly in view.
    seen: Vec<Vec<Option<Seen>>>,
    frames: Vec<RenderedFrame>,
}

/// Renders the first `count` poses and looks for circles.
pub(super) fn find(setup: &Setup<'_>, which: usize, count: u64) -> Result<Found, ReproduceError> {
    let [opencv, agisoft] = calibrations(setup.width_px);
    let calibration = if which == 0 { opencv } else { agisoft };
    let rows = poses(setup, calibration.poses)?;
    let sequence = sequence(calibration.camera, &rows, &rig::target(setup, TARGET_M)?)?;
    let (camera, shutter) = rig::checked(&sequence)?;
    let mut found = Found { pairs: Vec::new(), missed: 0, seen: Vec::new(), frames: Vec::new() };
    for finished in rig::render(setup.engine, &sequence, &[], 0..count.min(sequence.frames))? {
        let stamp_s = finished.plan.stamp_s;
        let listed: Vec<Option<Seen>> = super::pattern::circles(TARGET_M)
            .iter()
            .map(|circle| {
                circle
                    .seen(|point| rig::project(&sequence, &camera, &shutter, stamp_s, point))
                    .filter(|seen| inside(seen, camera.size_px))
            })
            .collect();
        let here = matches(&listed.iter().flatten().copied().collect::<Vec<_>>(), &spots(&finished.frame));
        found.missed += here.missed;
        found.pairs.extend(here.pairs);
        found.seen.push(listed);
        found.frames.push(finished.frame);
    }
    Ok(found)
}

/// Wholly in the picture, and a little inside.
fn inside(seen: &Seen, size_px: [u32; 2]) -> bool {
    let last = DVec2::new(f64::from(size_px[0]) - 1.0, f64::from(size_px[1]) - 1.0);
    seen.bounds_px[0].cmpge(DVec2::splat(3.0)).all() && seen.bounds_px[1].cmple(last - 3.0).all()
}

impl Found {
    fn errors_px(&self) -> Vec<f64> {
        self.pairs.iter().map(|(seen, spot)| seen.centroid_px.distance(spot.centroid_px)).collect()
    }

    /// RMS error by distance from the principal point.
    fn rings(&self, principal_px: DVec2, width_px: u32) -> Vec<(f64, f64)> {
        let ring_px = RING_PX * f64::from(width_px) / 640.0;
        let mut rings: Vec<Vec<f64>> = Vec::new();
        for (seen, spot) in &self.pairs {
            let ring = (seen.centroid_px.distance(principal_px) / ring_px) as usize;
            rings.resize(rings.len().max(ring + 1), Vec::new());
            rings[ring].push(seen.centroid_px.distance(spot.centroid_px));
        }
        let filled = rings.into_iter().enumerate().filter(|(_, errors)| errors.len() >= RING_CIRCLES);
        filled.map(|(ring, errors)| ((ring as f64 + 0.5) * ring_px, ErrorStats::of(errors).rms_px)).collect()
    }
}

pub(super) fn run(setup: &Setup<'_>) -> Result<Report, ReproduceError> {
    let mut report = Report::default();
    let source = if setup.data.is_some() {
        "the 60 poses of the reference program's two path files, one by each calibration"
    } else {
        "60 poses made here (the paper's need --data): no pose of the paper is among them"
    };
    report.notes.push(format!(
        "Poses: {source}. A circle's true place is the centre of the area of its image, by projecting its rim through the lens's forward model alone. The paper \
         compares its pictures with photographs, which are not at hand; its 0.73 px holds their noise and the error of calibration, poses and print, these figures \
         only camsim's own error and that of finding circles."
    ));
    let found = [find(setup, 0, u64::MAX)?, find(setup, 1, u64::MAX)?];
    if let Some((calibration, _)) =
        calibrations(setup.width_px).iter().zip(&found).find(|(_, found)| found.pairs.is_empty())
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
    for (calibration, found) in calibrations(setup.width_px).iter().zip(&found) {
        let camera = camsim_core::camera::CameraModel::from_spec(&calibration.camera)
            .map_err(|error| ReproduceError::made("the camera", error))?;
        let stats = ErrorStats::of(found.errors_px());
        let naive = ErrorStats::of(
            found.pairs.iter().map(|(seen, spot)| seen.centre_px.distance(spot.centroid_px)).collect(),
        );
        table.row([
            calibration.name.into(),
            found.frames.len().to_string(),
            stats.count.to_string(),
            found.missed.to_string(),
            short(stats.rms_px),
            short(stats.p99_px),
            short(stats.max_px),
            short(naive.rms_px),
            format!("{:.2} %", 100.0 * (1.0 - camera.check().valid_fraction)),
        ]);
        series.push(Series {
            name: calibration.name.into(),
            points: found.rings(camera.principal_point_px, setup.width_px),
            joined: true,
        });
    }
    report.tables.push(("circles", table));
    if setup.data.is_some() {
        report.tables.push(("calibrations", between(&found)));
    }
    match by_radius(series) {
        Some(plot) => report.plots.push(("radius", plot)),
        None => report
            .notes
            .push(format!("No plot by radius: no ring of the picture has {RING_CIRCLES} circles found; wider pictures have more.")),
    }
    report.tables.push(("inverse", inverse(setup)?));
    let [opencv, agisoft] = found;
    let mut shown = Vec::new();
    for (calibration, found) in calibrations(setup.width_px).iter().zip([&opencv, &agisoft]) {
        let Some(own) = found.frames.first() else { continue };
        shown.push(own.clone());
        shown.push(with_paper_roots(own, &model(calibration)?));
    }
    report.pictures.push(Picture {
        name: "fig12",
        caption: "Fig. 12: the first pose by OpenCV's (above) and Agisoft Lens's calibration (below). (a, c) camsim; red: no ray of the lens arrives there. \
                  (b, d) the paper's Gauss-Newton on the same picture: red where it does not converge, blue where it converges to a ray that the lens does not \
                  image there."
            .into(),
        frames: shown,
        columns: 2,
        shrink: 1,
    });
    for (name, caption, found) in [
        ("poses-opencv", "Every fifth pose with OpenCV's calibration.", opencv),
        ("poses-agisoft", "Every fifth pose with Agisoft Lens's calibration.", agisoft),
    ] {
        let step = found.frames.len().div_ceil(SHOWN).max(1);
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

/// The plot of [`Found::rings`]; `None` where every calibration's are empty, which is nothing to draw.
fn by_radius(series: Vec<Series>) -> Option<Plot> {
    series.iter().any(|series| !series.points.is_empty()).then(|| Plot {
        title: "Error of circle centres by their place in the picture".into(),
        x_label: "distance from the principal point, px".into(),
        y_label: "error, px RMS".into(),
        log: [false, false],
        series,
    })
}

fn model(calibration: &Calibration) -> Result<CameraModel, ReproduceError> {
    CameraModel::from_spec(&calibration.camera).map_err(|error| ReproduceError::made("the camera", error))
}

/// What the paper's Gauss-Newton makes of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Root {
    /// As the truth, or both have no ray.
    Right,
    /// No answer although there is a ray.
    Missed,
    /// A ray that the lens does not image there, or an answer 1 px and more away.
    False,
}

/// The paper's Gauss-Newton at every pixel, row by row: whether it has an answer, and which.
pub(super) fn paper_roots(camera: &CameraModel) -> Vec<(bool, Root)> {
    let [width, height] = camera.size_px;
    let focal_px = camera.focal_px.x;
    let root = |i: u32| {
        let pixel = DVec2::new(f64::from(i % width), f64::from(i / width));
        let found = gauss_newton(&camera.lens, camera.distorted_from_pixel(pixel), camera.size_px);
        let kind = match (found, camera.unproject(pixel)) {
            (None, Some(_)) => Root::Missed,
            (Some(found), truth) if truth.is_none_or(|truth| focal_px * found.distance(truth) >= 1.0) => {
                Root::False
            }
            _ => Root::Right,
        };
        (found.is_some(), kind)
    };
    (0..width * height).into_par_iter().map(root).collect()
}

/// A picture as the paper's lens inverse would have it, false roots in blue.
fn with_paper_roots(frame: &RenderedFrame, camera: &CameraModel) -> RenderedFrame {
    let mut frame = frame.clone();
    for (pixel, (found, kind)) in frame.color_rgba.chunks_exact_mut(4).zip(paper_roots(camera)) {
        match (found, kind) {
            (_, Root::False) => pixel.copy_from_slice(&[0.0, 0.0, 1.0, 1.0]),
            (false, _) => pixel[3] = 0.0,
            _ => {}
        }
    }
    frame
}

/// Rays lost and invented by the paper's inverse; camsim's is the truth here, and the error of its way back
/// stands beside.
fn inverse(setup: &Setup<'_>) -> Result<Table, ReproduceError> {
    let mut table = Table::new(
        "Inverse of the lens at every pixel (50 steps, 0.1 px as in the paper)",
        &[
            "calibration",
            "pixels with a ray",
            "Gauss-Newton misses, of these",
            "its false roots, of all",
            "camsim: worst way there and back, px",
        ],
    );
    for calibration in &calibrations(setup.width_px) {
        let camera = model(calibration)?;
        let (check, roots) = (camera.check(), paper_roots(&camera));
        let count = |kind: Root| roots.iter().filter(|root| root.1 == kind).count() as f64;
        let pixels = roots.len() as f64;
        table.row([
            calibration.name.into(),
            format!("{:.2} %", 100.0 * check.valid_fraction),
            format!("{:.2} %", 100.0 * count(Root::Missed) / (check.valid_fraction * pixels)),
            format!("{:.2} %", 100.0 * count(Root::False) / pixels),
            short(check.worst_roundtrip_px),
        ]);
    }
    Ok(table)
}

/// How far the same circle of the same photograph is apart by the two calibrations: both were fitted to these
/// photographs.
fn between([opencv, agisoft]: &[Found; 2]) -> Table {
    let shifts: Vec<DVec2> = opencv
        .seen
        .iter()
        .zip(&agisoft.seen)
        .flat_map(|(a, b)| a.iter().zip(b))
        .filter_map(|(a, b)| Some((*a)?.centroid_px - (*b)?.centroid_px))
        .collect();
    let mean = shifts.iter().sum::<DVec2>() / shifts.len().max(1) as f64;
    let [stats, rest] = [DVec2::ZERO, mean]
        .map(|middle| ErrorStats::of(shifts.iter().map(|shift| shift.distance(middle)).collect()));
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
        short(rest.rms_px),
    ]);
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_are_plotted_where_one_is_full() {
        let series =
            |points: &[(f64, f64)]| Series { name: String::new(), points: points.to_vec(), joined: true };
        assert_eq!(by_radius(vec![series(&[]), series(&[])]), None);
        assert!(by_radius(vec![series(&[]), series(&[(10.0, 0.1)])]).is_some_and(|plot| plot.svg().is_ok()));
    }

    #[test]
    fn calibrations_are_those_of_the_files() {
        let Some(data) = std::env::var_os("CAMSIM_DATA").map(std::path::PathBuf::from) else {
            eprintln!("CAMSIM_DATA is not set: the calibration files are not read");
            return;
        };
        for (calibration, file) in calibrations(640)
            .iter()
            .zip(["S3FishEye5ParamCam-OpenCV.xml", "S3FishEye5ParamCam-AgisoftLens.xml"])
        {
            let there =
                camsim_io::camera_file::import_camera(&data.join("camsim").join(file)).expect("a camera");
            let here = &calibration.camera;
            let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
            assert!(near(&here.focal_px, &there.focal_px), "{file}");
            assert!(
                near(&here.principal_point_px.expect("given"), &there.principal_point_px.expect("given")),
                "{file}"
            );
            assert!(near(&here.lens.coefficients, &there.lens.coefficients), "{file}");
        }
    }
}
