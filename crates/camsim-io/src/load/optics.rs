//! Reads zoom tracks, and checks zoom tracks and vignettes.

use camsim_core::{
    flight_log::FlightLog,
    lens::ModelFacts,
    photometric::GrayImage,
    scenario::{CameraSpec, LensSpec, Scenario},
    sequence::Sequence,
};

use super::LoadError;
use crate::{
    frame_file::columns::{TableColumn, parse_column},
    table::open_table,
};

/// A vignette whose largest value is below this may have fewer bits than it is stored in.
const DIM_VIGNETTE: f32 = 0.5;
/// Relative tolerance within which vignette and picture have the same aspect ratio.
const ASPECT_TOLERANCE: f64 = 0.01;

/// Reads the zoom track, a table `t_s,zoom` on the log's clock. Returns path times in seconds and zoom
/// values.
pub(super) fn load_zoom_track(scenario: &Scenario, log: &FlightLog) -> Result<Vec<(f64, f64)>, LoadError> {
    let camera = &scenario.camera;
    let Some(path) = &camera.zoom_track else {
        return if camera.zoom.is_empty() { Ok(Vec::new()) } else { Err(LoadError::ZoomPair) };
    };
    if camera.zoom.is_empty() {
        return Err(LoadError::ZoomPair);
    }
    let fail = |line: Option<u64>, problem: String| LoadError::ZoomTrack {
        path: path.clone(),
        line: line.map_or(String::new(), |line| format!(", line {line}")),
        problem,
    };
    let mut reader = open_table(path).map_err(|error| fail(None, error.to_string()))?;
    let header = reader.headers().map_err(|error| fail(None, error.to_string()))?.clone();
    let (unit_s, has_columns) = match (header.get(0).map(parse_column), header.get(1), header.len()) {
        (Some(TableColumn::Time(Some(unit))), Some(zoom), 2) => {
            (unit.factor, zoom.eq_ignore_ascii_case("zoom"))
        }
        _ => (1.0, false),
    };
    if !has_columns {
        let columns = header.iter().collect::<Vec<_>>().join(",");
        return Err(fail(
            Some(1),
            format!("the header is `{columns}` and not `t_s,zoom` (or t_ms, t_us, t_ns)"),
        ));
    }
    let epoch_s = log.epoch_ns as f64 * 1e-9;
    let mut rows: Vec<(f64, f64)> = Vec::new();
    for record in reader.records() {
        let record =
            record.map_err(|error| fail(error.position().map(csv::Position::line), error.to_string()))?;
        let line = record.position().map(csv::Position::line);
        let number = |column: usize| {
            let text = record.get(column).unwrap_or_default();
            text.parse::<f64>().map_err(|_| fail(line, format!("`{text}` is no number")))
        };
        let (t_s, zoom) = (unit_s * number(0)?, number(1)?);
        let path_s = (t_s - epoch_s) / scenario.flight.speed;
        if !path_s.is_finite() || !zoom.is_finite() || rows.last().is_some_and(|last| last.0 >= path_s) {
            return Err(fail(
                line,
                format!("the row t_s = {t_s}, zoom = {zoom} is not finite or not later than the one before"),
            ));
        }
        rows.push((path_s, zoom));
    }
    if rows.is_empty() { Err(fail(None, "there are no rows".into())) } else { Ok(rows) }
}

/// Warnings about the zoom track and the vignette of a sequence.
pub(super) fn optics_warnings(sequence: &Sequence) -> Vec<String> {
    let camera = &sequence.scenario.camera;
    let vignette = sequence.vignette.as_deref().map(|map| vignette_warnings(camera, map)).unwrap_or_default();
    zoom_warnings(sequence).into_iter().chain(vignette).chain(coefficients_warning(camera)).collect()
}

/// Warns of a lens model that is named without coefficients.
fn coefficients_warning(camera: &CameraSpec) -> Option<String> {
    let LensSpec { model, coefficients } = &camera.lens;
    let facts = ModelFacts::of(*model);
    (coefficients.is_empty() && camera.zoom.is_empty() && !facts.coefficients.is_empty()).then(|| {
        format!(
            "camera.lens.coefficients is empty: {} has its default values of {}, which are no lens that was measured",
            model.name(),
            facts.coefficients.join(" ")
        )
    })
}

/// Warns if the zoom track covers less than the frames, or exceeds the calibrated zoom values. The nearest
/// row or calibration is used then.
fn zoom_warnings(sequence: &Sequence) -> Vec<String> {
    let camera = &sequence.scenario.camera;
    let (Some(path), Some(first), Some(last)) =
        (&camera.zoom_track, sequence.zoom_track.first(), sequence.zoom_track.last())
    else {
        return Vec::new();
    };
    let path = path.display();
    let mut warnings = Vec::new();
    let end_s = sequence.start_s + (sequence.frames.saturating_sub(1)) as f64 / camera.fps;
    let (before_s, after_s) = (first.0 - sequence.start_s, end_s - last.0);
    // A difference of one frame is allowed.
    let frame_s = 1.0 / camera.fps + 1e-9;
    if before_s > frame_s || after_s > frame_s {
        warnings.push(format!(
            "{path}: camera.zoom_track covers {:.3} s to {:.3} s after the log's first row, the frames {:.3} \
                s to {end_s:.3} s: beyond it the first or last zoom \
             is held; check that both have one clock",
            first.0, last.0, sequence.start_s
        ));
    }
    let min_max = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[min, max], zoom| [zoom.min(min), zoom.max(max)])
    };
    let [min, max] = min_max(&mut camera.zoom.iter().map(|entry| entry.at));
    let values = || sequence.zoom_track.iter().map(|row| row.1);
    let beyond = values().filter(|zoom| *zoom < min || *zoom > max).count();
    if beyond > 0 {
        let [low, high] = min_max(&mut values());
        warnings.push(format!(
            "{path}: {beyond} of {} rows of camera.zoom_track are beyond what camera.zoom is given for, \
                {low} to {high} where {min} to {max} are known: the \
             nearest is taken",
            sequence.zoom_track.len()
        ));
    }
    warnings
}

/// Warns of a vignette that seems to have the wrong bit depth or aspect ratio.
#[must_use]
pub fn vignette_warnings(camera: &CameraSpec, map: &GrayImage) -> Vec<String> {
    let Some(path) = &camera.photometric.vignette else { return Vec::new() };
    let path = path.display();
    let mut warnings = Vec::new();
    let brightest = map.values.iter().copied().fold(0.0, f32::max);
    if brightest < DIM_VIGNETTE {
        warnings.push(format!(
            "{path}: the brightest value of the vignette is {:.1} % of what it can be: if it is of fewer \
                bits than it is stored in, scale it up",
            100.0 * brightest
        ));
    }
    let aspect = |[width, height]: [u32; 2]| f64::from(width) / f64::from(height);
    if (aspect(map.size_px) / aspect(camera.size_px) - 1.0).abs() > ASPECT_TOLERANCE {
        let ([w, h], [width, height]) = (map.size_px, camera.size_px);
        warnings.push(format!(
            "{path}: the vignette is of {w}x{h} pixels and is stretched to the picture's {width}x{height}"
        ));
    }
    warnings
}
