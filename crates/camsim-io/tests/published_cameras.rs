//! Published calibration files in the folder CAMSIM_DATA: the imported values, or the reason of the refusal.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use camsim_core::scenario::{CameraSpec, LensModel};
use camsim_io::formats::reading::{CameraFileError, camera_names, import_camera_named};

const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/inputs/CAMERAS-MEASURED.md");

fn data() -> Option<PathBuf> {
    let data = std::env::var_os("CAMSIM_DATA").map(PathBuf::from);
    if data.is_none() {
        eprintln!("CAMSIM_DATA is not set: published calibrations are not tested");
    }
    data
}

/// Possible calibration files below a folder, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path
            .extension()
            .is_some_and(|ending| ["yaml", "yml", "xml", "json"].iter().any(|known| ending == *known))
        {
            paths.push(path);
        }
    }
    paths.sort();
    paths
}

/// An error without its path, which depends on the machine.
fn reason(error: &CameraFileError, path: &Path) -> String {
    error.to_string().replace(&path.display().to_string(), "").trim_start_matches(": ").to_owned()
}

/// Writes a row of the table.
fn row(table: &mut String, file: &str, path: &Path, camera: Option<&str>) -> Option<CameraSpec> {
    let label = camera.map_or(String::new(), |name| format!(" `{name}`"));
    match import_camera_named(path, None, camera) {
        Ok(imported) => {
            let spec = &imported.spec;
            let [cx, cy] = spec.principal_point_px.unwrap();
            let model = spec.lens.model.name();
            let readout = if spec.shutter.readout_ms == 0.0 {
                "0".to_owned()
            } else {
                format!("{:.4} {:?}", spec.shutter.readout_ms, spec.shutter.readout)
            };
            let notes = imported.notes.join(". ").replace('|', "/");
            writeln!(
                table,
                "| {file}{label} | {} | {} x {} | {:.4}, {:.4} | {cx:.4}, {cy:.4} | {model} {} | {} | \
                 {readout} | {notes} |",
                imported.format.name(),
                spec.size_px[0],
                spec.size_px[1],
                spec.focal_px[0],
                spec.focal_px[1],
                spec.lens.coefficients.len(),
                spec.fps,
            )
            .unwrap();
            Some(imported.spec)
        }
        Err(error) => {
            writeln!(
                table,
                "| {file}{label} | refused | | | | | | | {} |",
                reason(&error, path).replace('|', "/")
            )
            .unwrap();
            None
        }
    }
}

#[test]
fn published_files_give_the_documented_results() {
    let Some(data) = data() else { return };
    let mut table = String::from(
        "# Published calibrations, file by file\n\nMade from the code by `CAMSIM_DATA=... CAMSIM_BLESS=1 \
         cargo test -p camsim-io --test published_cameras`. The treatment of each key is in \
         [CAMERAS.md](CAMERAS.md).\n\n| file and camera | read as | size, px | focal, px | principal point, \
         px | model, coefficients | fps | readout, ms | notes, or reason of refusal \
         |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    let (mut read, mut refused) = (0, 0);
    for folder in ["calib/cameras", "calib/opencv_chessboard", "calib/gyroflow", "camsim"] {
        for path in files(&data.join(folder)) {
            let file = path.strip_prefix(&data).unwrap().display().to_string();
            let names = camera_names(&path, None).unwrap_or_default();
            let cameras: Vec<Option<&str>> = if names.len() > 1 {
                names.iter().map(|name| Some(name.as_str())).collect()
            } else {
                vec![None]
            };
            for camera in cameras {
                match row(&mut table, &file, &path, camera) {
                    Some(_) => read += 1,
                    None => refused += 1,
                }
            }
        }
    }
    eprintln!("{read} cameras read, {refused} refused");
    if std::env::var_os("CAMSIM_BLESS").is_some() {
        std::fs::create_dir_all(Path::new(TABLE).parent().unwrap()).unwrap();
        std::fs::write(TABLE, &table).unwrap();
    }
    let written = std::fs::read_to_string(TABLE).unwrap_or_default();
    assert!(
        written == table,
        "docs/reference/inputs/CAMERAS-MEASURED.md differs from the result: run with CAMSIM_BLESS=1 and \
         review the difference"
    );
}

/// A row of the tables of published calibrations.
struct Row {
    name: String,
    size_px: [u32; 2],
    /// fx fy cx cy.
    intrinsics: [f64; 4],
    coefficients: Vec<f64>,
    source: String,
    model: LensModel,
}

fn rows(path: &Path, model: LensModel) -> Vec<Row> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut rows = Vec::new();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let source = header.iter().position(|name| *name == "source").unwrap();
    for line in text.lines().skip(1) {
        // Only the note, the last cell, may have commas.
        let cells: Vec<&str> = line.splitn(header.len(), ',').collect();
        let number = |column: usize| cells[column].parse::<f64>().unwrap();
        rows.push(Row {
            name: cells[0].to_owned(),
            size_px: [number(1) as u32, number(2) as u32],
            intrinsics: [number(3), number(4), number(5), number(6)],
            coefficients: (7..source).map(number).collect(),
            source: cells[source].to_owned(),
            model,
        });
    }
    rows
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b.abs().max(1e-6)
}

fn agrees(spec: &CameraSpec, row: &Row) -> bool {
    // The table has the number in the file, which counts from the corner instead of the pixel centre.
    let shift = if row.name == "camsim_S3_fisheye_agisoft" { 0.5 } else { 0.0 };
    let [cx, cy] = spec.principal_point_px.unwrap();
    let [fx, fy] = spec.focal_px;
    let intrinsics = [fx, fy, cx + shift, cy + shift].iter().zip(row.intrinsics).all(|(a, b)| near(*a, b));
    let coefficient = |index: usize| spec.lens.coefficients.get(index).copied().unwrap_or(0.0);
    let undistorted = spec.lens.model == LensModel::Pinhole && row.model == LensModel::BrownConrady;
    let count = spec.lens.coefficients.len().max(row.coefficients.len());
    let coefficients =
        (0..count).all(|index| near(coefficient(index), row.coefficients.get(index).copied().unwrap_or(0.0)));
    spec.size_px == row.size_px && intrinsics && coefficients && (undistorted || spec.lens.model == row.model)
}

/// Cameras of a file that can be imported.
fn cameras(path: &Path) -> Vec<CameraSpec> {
    let names = camera_names(path, None).unwrap_or_default();
    names
        .iter()
        .filter_map(|name| {
            import_camera_named(path, None, Some(name.as_str()).filter(|name| !name.is_empty())).ok()
        })
        .map(|imported| imported.spec)
        .collect()
}

/// For incomplete files, a copy with the values that the error asks for.
fn completed_file(data: &Path, row: &Row, folder: &Path) -> Option<PathBuf> {
    let (width, height) = (row.size_px[0], row.size_px[1]);
    let source = data.join("calib").join(&row.source);
    let (name, text) = if row.source.contains("ORB_SLAM2") {
        let text = std::fs::read_to_string(source).unwrap();
        ("orb.yaml", format!("{text}\nCamera.width: {width}\nCamera.height: {height}\n"))
    } else if row.source == "opencv_chessboard/intrinsics.yml" {
        let text = std::fs::read_to_string(source).unwrap();
        ("intrinsics.yml", format!("{text}\nimage_width: {width}\nimage_height: {height}\n"))
    } else if row.source.contains("OpenSfM") {
        let model = opensfm_camera(&row.name);
        (
            "camera_models.json",
            format!(
                "{{\"v2 {} {width} {height}\": {{\"width\": {width}, \"height\": {height}, {model}}}}}",
                row.name
            ),
        )
    } else {
        return None;
    };
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    Some(path)
}

/// Cameras copied from OpenSfM's camera database.
fn opensfm_camera(name: &str) -> &'static str {
    match name {
        "opensfm_gopro_hero8_black" => {
            r#""projection_type": "brown", "focal_x": 0.47720253548498875, "focal_y": 0.4776476227437118,
                "k1": -0.004417272934201867,
               "k2": 0.0026456102958567146, "c_x": -0.0017664444590190724, "c_y": 0.006393052002726844,
                   "p1": 0.0, "p2": 0.0, "k3": 0.0"#
        }
        "opensfm_gopro_hero3_7mp_medium" => r#""focal": 0.625, "k1": -0.37, "k2": 0.28"#,
        "opensfm_gopro_hero3_7mp_wide" => r#""focal": 0.466, "k1": -0.195, "k2": 0.030"#,
        "opensfm_gopro_hero2_5mp_medium" => r#""focal": 0.71875, "k1": -0.38, "k2": 0.24"#,
        "opensfm_gopro_hero2_5mp_wide" => r#""focal": 0.5, "k1": -0.39, "k2": 0.22"#,
        "opensfm_garmin_virb" => r#""focal": 0.57, "k1": -0.30, "k2": 0.06"#,
        "opensfm_drift_ghost_s" => r#""focal": 0.47, "k1": -0.22, "k2": 0.03"#,
        "opensfm_xiaoyi" => r#""focal": 0.5, "k1": -0.19, "k2": 0.028"#,
        "opensfm_dji_fc300s_phantom3" => {
            r#""focal": 0.5930666527479901, "k1": -0.012137318698010527, "k2": 0.016199087342953698"#
        }
        "opensfm_dji_zenmuse_p1" => {
            r#""projection_type": "brown", "focal_x": 0.993855582350662, "focal_y": 0.993855582350662,
                "c_x": -0.000890260610982073,
               "c_y": 0.0017658361729384116, "k1": -0.04734574598470396, "k2": 0.00875629525446153,
                   "p1": 0.002032062604630639,
               "p2": -0.0007921675594001833, "k3": -0.06874708730325006"#
        }
        "opensfm_skydio_2" => {
            r#""projection_type": "brown", "focal_x": 0.5890650637205782, "focal_y": 0.5893009528604379,
                "c_x": 0.006414544008217537,
               "c_y": 0.007804076177596079, "k1": 0.007400489742572139, "k2": -0.01564249925934293,
                   "p1": -0.007885887470989788,
               "p2": 0.007514503550147163, "k3": -0.0019150459181816895"#
        }
        other => panic!("{other} is missing here"),
    }
}

#[test]
fn imported_cameras_equal_the_published_tables() {
    let Some(data) = data() else { return };
    let calib = data.join("calib");
    let mut all = rows(&calib.join("brown_conrady_real.csv"), LensModel::BrownConrady);
    all.extend(rows(&calib.join("fisheye_kb4_real.csv"), LensModel::KannalaBrandt));
    let (mut compared, mut skipped, mut wrong) = (0, 0, Vec::new());
    for row in &all {
        let source = calib.join(&row.source);
        // Rows from pictures, or from files that are not in the folder.
        if !source.is_file() {
            skipped += 1;
            continue;
        }
        compared += 1;
        let folder = tempfile::tempdir().unwrap();
        let path = completed_file(&data, row, folder.path()).unwrap_or(source);
        if !cameras(&path).iter().any(|spec| agrees(spec, row)) {
            wrong.push(row.name.as_str());
        }
    }
    eprintln!("{compared} rows compared, {skipped} skipped");
    assert!(wrong.is_empty(), "different from the tables: {wrong:?}");
    assert!(compared >= 60, "{compared} rows compared");
}
