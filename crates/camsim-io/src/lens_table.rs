//! Files of `camera.lens_table`: a lens by points on a grid.
//!
//! A CSV has a header of four names, first the two coordinates of the grid, then what each node holds:
//!
//! ```text
//! u,v,x_px,y_px            ideal (x/z, y/z) to pixels; x,y instead: units of the focal length
//! ax_rad,ay_rad,x_px,y_px  angle off axis times (cos, sin) of its direction, for lenses beyond 90 degrees
//! x_px,y_px,u,v            pixels to rays, in either form
//! ```
//!
//! Rows may have any order; every node of the grid must be there once. An EXR is an STmap: for every pixel of the
//! picture, in channels R and G (or the only two), where the undistorted picture of the same focal lengths and
//! principal point shows what it sees, in fractions of width and height from the lower left corner.

use std::path::{Path, PathBuf};

use camsim_core::{
    camera::CameraModel,
    lens::{GridOf, LensGrid, LensGridError, LensModel, RayChart},
    scenario::{CameraSpec, FilesOfSpec, LoadedFile},
};
use glam::DVec2;

use crate::{
    frame_file::{FrameFileError, exr_planes::read_exr},
    table::{finite, open_table},
};

/// Relative deviation of a node from a regular grid, in steps.
const OFF_GRID: f64 = 1e-3;

/// A lens table that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LensTableError {
    /// A location in the file.
    #[error("{}{location}: {problem}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// `, line N`, or nothing.
        location: String,
        /// The problem and the remedy.
        problem: String,
    },
    /// The table is no lens.
    #[error("{}: the table {source}", path.display())]
    Grid {
        /// The file.
        path: PathBuf,
        /// The problem and the remedy.
        source: LensGridError,
    },
    /// The picture of an STmap cannot be read.
    #[error(transparent)]
    Picture(#[from] FrameFileError),
}

/// Reads the table of a camera's lens, if it has one that has not been read.
///
/// # Errors
/// The file cannot be read or holds no lens.
pub fn load_lens_table(camera: &mut CameraSpec) -> Result<(), LensTableError> {
    let path = match &camera.lens_table {
        Some(table) if !table.is_read() && camera.lens.model == LensModel::Table => table.path.clone(),
        _ => return Ok(()),
    };
    let is_picture = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"));
    let pixels = Pixels::new(camera);
    let grid = if is_picture { st_map(&path, &pixels)? } else { csv_table(&path, &pixels)? };
    camera.lens_table = Some(LoadedFile::new(path, grid));
    Ok(())
}

/// Pixels and units of the focal length.
struct Pixels {
    size_px: DVec2,
    focal_px: DVec2,
    principal_px: DVec2,
}

impl Pixels {
    /// Those of the camera's picture, or of the other one that the table is of.
    fn new(camera: &CameraSpec) -> Self {
        if let Some(FilesOfSpec { size_px, focal_px, principal_point_px, .. }) = camera.files_of {
            let size_px = DVec2::from(size_px.map(f64::from));
            return Self { size_px, focal_px: focal_px.into(), principal_px: principal_point_px.into() };
        }
        let size_px = DVec2::from(camera.size_px.map(f64::from));
        let principal_px = camera.principal_point_px.map_or(0.5 * (size_px - 1.0), DVec2::from);
        Self { size_px, focal_px: camera.focal_px.into(), principal_px }
    }

    fn distorted(&self, px: DVec2) -> DVec2 {
        (px - self.principal_px) / self.focal_px
    }
}

/// What two columns hold.
#[derive(Clone, Copy, PartialEq)]
enum Pair {
    Rays(RayChart),
    Points { in_px: bool },
}

const PAIRS: [([&str; 2], Pair); 4] = [
    (["u", "v"], Pair::Rays(RayChart::Ideal)),
    (["ax_rad", "ay_rad"], Pair::Rays(RayChart::Angles)),
    (["x_px", "y_px"], Pair::Points { in_px: true }),
    (["x", "y"], Pair::Points { in_px: false }),
];

fn csv_table(path: &Path, pixels: &Pixels) -> Result<LensGrid, LensTableError> {
    let fail = |line: Option<u64>, problem: String| LensTableError::Content {
        path: path.into(),
        location: line.map_or(String::new(), |line| format!(", line {line}")),
        problem,
    };
    let mut reader = open_table(path).map_err(|error| fail(None, error.to_string()))?;
    let header = reader.headers().map_err(|error| fail(None, error.to_string()))?.clone();
    let pair = |first: usize| {
        let names = [header.get(first)?, header.get(first + 1)?];
        PAIRS.iter().find(|(known, _)| *known == names).map(|(_, pair)| *pair)
    };
    let (chart, of, in_px) = match (pair(0), pair(2), header.len()) {
        (Some(Pair::Rays(chart)), Some(Pair::Points { in_px }), 4) => (chart, GridOf::Rays, in_px),
        (Some(Pair::Points { in_px }), Some(Pair::Rays(chart)), 4) => (chart, GridOf::Points, in_px),
        _ => {
            let columns = header.iter().collect::<Vec<_>>().join(",");
            let problem = format!(
                "the header is `{columns}`: name the grid first and what it holds then, as in `u,v,x_px,y_px` \
                 or `x_px,y_px,ax_rad,ay_rad`"
            );
            return Err(fail(Some(1), problem));
        }
    };
    let point = |at: DVec2| if in_px { pixels.distorted(at) } else { at };
    let mut nodes = Vec::new();
    for record in reader.records() {
        let record =
            record.map_err(|error| fail(error.position().map(csv::Position::line), error.to_string()))?;
        let line = record.position().map(csv::Position::line);
        let number = |column: usize| finite(&record, column).map_err(|problem| fail(line, problem));
        let (a, b) = (DVec2::new(number(0)?, number(1)?), DVec2::new(number(2)?, number(3)?));
        nodes.push(match of {
            GridOf::Rays => (a, point(b)),
            GridOf::Points => (point(a), b),
        });
    }
    let (placement, count, values) = regular(&nodes).map_err(|problem| fail(None, problem))?;
    LensGrid::new(chart, of, placement, count, &values)
        .map_err(|source| LensTableError::Grid { path: path.into(), source })
}

type Grid = ([DVec2; 2], [usize; 2], Vec<DVec2>);

/// First node, step, counts, and the values in rows.
fn regular(nodes: &[(DVec2, DVec2)]) -> Result<Grid, String> {
    let [(first_x, step_x, columns), (first_y, step_y, rows)] = [0, 1].map(|axis| {
        let mut at: Vec<f64> = nodes.iter().map(|(node, _)| node[axis]).collect();
        at.sort_by(f64::total_cmp);
        let (first, last) = (at.first().copied().unwrap_or(0.0), at.last().copied().unwrap_or(0.0));
        let tolerance = 1e-9 * (last - first).max(1e-300);
        at.dedup_by(|b, a| *b - *a <= tolerance);
        // Coordinates that were printed with few digits are the same if they are nearer than half a mean step.
        let step = (last - first) / (at.len().max(2) - 1) as f64;
        at.dedup_by(|b, a| *b - *a < 0.5 * step);
        let count = at.len();
        (first, (last - first) / (count.max(2) - 1) as f64, count)
    });
    if columns * rows != nodes.len() {
        return Err(format!(
            "{} rows do not fill a grid of {columns} x {rows} nodes: give every node once",
            nodes.len()
        ));
    }
    let (first, step) = (DVec2::new(first_x, first_y), DVec2::new(step_x, step_y));
    let mut values = vec![DVec2::NAN; nodes.len()];
    for (node, value) in nodes {
        let at = (*node - first) / step;
        let whole = at.round();
        if (at - whole).abs().max_element() > OFF_GRID {
            return Err(format!("the node ({}, {}) is off the regular grid", node.x, node.y));
        }
        let slot = &mut values[whole.y as usize * columns + whole.x as usize];
        if slot.is_finite() {
            return Err(format!("the node ({}, {}) is there twice", node.x, node.y));
        }
        *slot = *value;
    }
    Ok(([first, step], [columns, rows], values))
}

fn st_map(path: &Path, pixels: &Pixels) -> Result<LensGrid, LensTableError> {
    let planes = read_exr(path)?.planes;
    let named = |name: &str| planes.iter().position(|plane| plane.name == name);
    let (s, t) = match (named("R"), named("G"), planes.len()) {
        (Some(s), Some(t), _) => (s, t),
        (.., 2) => (0, 1),
        _ => {
            let names: Vec<&str> = planes.iter().map(|plane| plane.name.as_str()).collect();
            let problem = format!("an STmap has channels R and G, not {}", names.join(", "));
            return Err(LensTableError::Content { path: path.into(), location: String::new(), problem });
        }
    };
    let [columns, rows] = planes[s].size_px.map(|side| side as usize);
    // The map covers the picture from edge to edge.
    let step_px = pixels.size_px / DVec2::new(columns as f64, rows as f64);
    let placement = [pixels.distorted(0.5 * step_px - 0.5), step_px / pixels.focal_px];
    let values: Vec<DVec2> = planes[s]
        .values
        .iter()
        .zip(&planes[t].values)
        .map(|(s, t)| {
            let fraction = DVec2::new(f64::from(*s), 1.0 - f64::from(*t));
            pixels.distorted(fraction * pixels.size_px - 0.5)
        })
        .collect();
    LensGrid::new(RayChart::Ideal, GridOf::Points, placement, [columns, rows], &values)
        .map_err(|source| LensTableError::Grid { path: path.into(), source })
}

/// The points of a camera's lens as a CSV that [`load_lens_table`] reads: the pixel of each ray of a grid over the
/// picture's field, `u,v` or, for lenses beyond 80 degrees, angles.
#[must_use]
pub fn lens_table_csv(camera: &CameraModel, nodes: u32) -> String {
    let corner = DVec2::from(camera.size_px.map(f64::from)) - 0.5;
    let edge = (0..=64).flat_map(|i| {
        let fraction = f64::from(i) / 64.0;
        let (x, y) = (-0.5 + (corner.x + 0.5) * fraction, -0.5 + (corner.y + 0.5) * fraction);
        [DVec2::new(x, -0.5), DVec2::new(x, corner.y), DVec2::new(-0.5, y), DVec2::new(corner.x, y)]
    });
    let rays: Vec<_> = edge.filter_map(|px| camera.ray(px)).collect();
    let widest = rays.iter().map(|ray| ray.truncate().length().atan2(ray.z)).fold(0.0, f64::max);
    let is_wide = widest > 80.0_f64.to_radians();
    let position = |ray: glam::DVec3| match is_wide {
        true => ray.truncate().normalize_or_zero() * ray.truncate().length().atan2(ray.z),
        false => ray.truncate() / ray.z,
    };
    let reach = 1.02 * rays.iter().map(|ray| position(*ray).abs()).fold(DVec2::splat(0.1), DVec2::max);
    let mut text = format!("{},x_px,y_px\n", if is_wide { "ax_rad,ay_rad" } else { "u,v" });
    for k in 0..nodes * nodes {
        let fraction = DVec2::new(f64::from(k % nodes), f64::from(k / nodes)) / f64::from(nodes - 1);
        let at = reach * (2.0 * fraction - 1.0);
        let px = match is_wide {
            true => {
                let theta = at.length();
                camera.project_ray((at.normalize_or_zero() * theta.sin()).extend(theta.cos()))
            }
            false => camera.project(at),
        };
        text.push_str(&format!("{:?},{:?},{:?},{:?}\n", at.x, at.y, px.x, px.y));
    }
    text
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camsim_core::{
        resized::{Resizing, delivered},
        scenario::{Binning, LensSpec, ResizedSpec},
        validate::validate_camera,
    };

    use super::*;

    fn camera(model: LensModel, coefficients: &[f64]) -> CameraSpec {
        CameraSpec {
            focal_px: [458.0, 457.0],
            size_px: [752, 480],
            principal_point_px: Some([367.0, 248.0]),
            lens: LensSpec { model, coefficients: coefficients.to_vec() },
            ..CameraSpec::default()
        }
    }

    fn with_table(of: &CameraSpec, path: &Path) -> Result<CameraModel, LensTableError> {
        let table = Some(PathBuf::from(path).into());
        let lens = LensSpec { model: LensModel::Table, coefficients: Vec::new() };
        let mut spec = CameraSpec { lens, lens_table: table, ..of.clone() };
        load_lens_table(&mut spec)?;
        assert!(validate_camera(&spec).is_empty());
        Ok(CameraModel::from_spec(&spec).unwrap())
    }

    /// Largest distance between the pixels of the same rays.
    fn difference_px(a: &CameraModel, b: &CameraModel) -> f64 {
        let px = |k: u32| DVec2::new(f64::from(k % 24) / 23.0 * 751.0, f64::from(k / 24) / 15.0 * 479.0);
        let of = |k: u32| a.ray(px(k)).map(|ray| (b.project_ray(ray) - px(k)).length());
        (0..24 * 16).filter_map(of).fold(0.0, f64::max)
    }

    #[test]
    fn tables_of_lenses_stand_for_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lens.csv");
        for (model, k) in [
            (LensModel::BrownConrady, &[-0.28, 0.07, 2e-4, 2e-5][..]),
            // 200 degrees from corner to corner.
            (LensModel::KannalaBrandt, &[0.0, 0.1]),
        ] {
            let mut spec = camera(model, k);
            if model == LensModel::KannalaBrandt {
                spec.focal_px = [150.0, 151.0];
            }
            let exact = CameraModel::from_spec(&spec).unwrap();
            let text = lens_table_csv(&exact, 97);
            std::fs::write(&path, &text).unwrap();
            let table = with_table(&spec, &path).unwrap();
            let error_px = difference_px(&exact, &table);
            assert!(error_px < 2e-3, "{model:?}: {error_px} px");
            // Any order of the rows.
            let mut lines: Vec<&str> = text.lines().collect();
            lines[1..].reverse();
            std::fs::write(&path, lines.join("\n")).unwrap();
            assert!(difference_px(&with_table(&spec, &path).unwrap(), &table) < 1e-9);
        }
    }

    #[test]
    fn an_st_map_is_the_undistorted_position_of_every_pixel() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.exr");
        let spec = camera(LensModel::BrownConrady, &[-0.28, 0.07, 2e-4, 2e-5]);
        let exact = CameraModel::from_spec(&spec).unwrap();
        let pinhole = CameraModel::from_spec(&camera(LensModel::Pinhole, &[])).unwrap();
        let texel = |x: usize, y: usize| {
            // Half the size of the picture.
            let px = (DVec2::new(x as f64, y as f64) + 0.5) * 2.0 - 0.5;
            let position = pinhole.project(exact.unproject(px).unwrap()) + 0.5;
            ((position.x / 752.0) as f32, (1.0 - position.y / 480.0) as f32, 0.0_f32)
        };
        exr::prelude::write_rgb_file(&path, 376, 240, texel).unwrap();
        let table = with_table(&spec, &path).unwrap();
        let error_px = difference_px(&table, &exact);
        assert!(error_px < 2e-3, "{error_px} px");
        let centre = DVec2::new(300.3, 100.7);
        assert!((table.unproject(centre).unwrap() - exact.unproject(centre).unwrap()).length() < 1e-6);
    }

    #[test]
    fn a_table_of_the_calibrated_picture_serves_a_resized_camera() {
        let folder = tempfile::tempdir().unwrap();
        let (csv, map) = (folder.path().join("lens.csv"), folder.path().join("map.exr"));
        let bare = camera(LensModel::BrownConrady, &[-0.28, 0.07, 2e-4, 2e-5]);
        let exact = CameraModel::from_spec(&bare).unwrap();
        std::fs::write(&csv, lens_table_csv(&exact, 97)).unwrap();
        let pinhole = CameraModel::from_spec(&camera(LensModel::Pinhole, &[])).unwrap();
        let texel = |x: usize, y: usize| {
            let position = pinhole.project(exact.unproject(DVec2::new(x as f64, y as f64)).unwrap()) + 0.5;
            ((position.x / 752.0) as f32, (1.0 - position.y / 480.0) as f32, 0.0_f32)
        };
        exr::prelude::write_rgb_file(&map, 752, 480, texel).unwrap();
        let crop_px = Some([101, 51, 602, 402]);
        let resized = ResizedSpec { crop_px, binning: Some(Binning::Both(2.0)), ..ResizedSpec::default() };
        let change = Resizing::new(&resized, bare.size_px).unwrap();
        for path in [&csv, &map] {
            let whole = with_table(&bare, path).unwrap();
            let part = CameraSpec { resized: Some(resized.clone()), ..bare.clone() };
            let lens_table = Some(path.clone().into());
            let lens = LensSpec { model: LensModel::Table, coefficients: Vec::new() };
            let mut part = delivered(&CameraSpec { lens, lens_table, ..part }).unwrap();
            load_lens_table(&mut part).unwrap();
            let part = CameraModel::from_spec(&part).unwrap();
            for k in 0..16 * 12 {
                let at = DVec2::new(f64::from(k % 16) * 20.0, f64::from(k / 16) * 18.0);
                let [own, of_whole] =
                    [part.ray(at), whole.ray(change.calibrated_point(at))].map(Option::unwrap);
                assert!((own - of_whole).length() < 1e-9, "{}: {at}", path.display());
            }
        }
    }

    #[test]
    fn errors_name_file_line_and_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lens.csv");
        let error = |text: &str| {
            std::fs::write(&path, text).unwrap();
            with_table(&camera(LensModel::Pinhole, &[]), &path).unwrap_err().to_string()
        };
        assert!(error("u,v,a,b\n").contains("line 1: the header is `u,v,a,b`"));
        assert!(error("u,v,x,y\n0,0,x,1\n").contains("line 2: `x` is no finite number"));
        assert!(error("u,v,x,y\n0,0,0,0\n1,0,1,0\n0,1,0,1\n").contains("3 rows do not fill a grid of 2 x 2"));
        let grid = |shift: f64| {
            let row = |k: u32| {
                let (u, v) = (f64::from(k % 5) / 4.0 - 0.5, f64::from(k / 5) / 4.0 - 0.5);
                let u = if k == 7 { u + shift } else { u };
                format!("{u},{v},{u},{v}\n")
            };
            (0..25).map(row).collect::<String>()
        };
        assert!(error(&format!("u,v,x,y\n{}", grid(0.05))).contains("is off the regular grid"));
        assert!(error(&format!("u,v,y,x\n{}", grid(0.0))).contains("the header is"));
        assert!(with_table(&camera(LensModel::Pinhole, &[]), Path::new("/no/lens.csv")).is_err());
    }
}
