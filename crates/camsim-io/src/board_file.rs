//! Calibration boards, from the scenario's parameters or Kalibr's target YAML.

use std::path::{Path, PathBuf};

use camsim_core::{
    scenario::{BoardKind, BoardSpec},
    scene::Board,
};
use serde_json::Value;

use crate::text::document::{Document, KeyProblem, find, number, optional_number, word};

/// Why a board cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum BoardFileError {
    /// The target file cannot be read.
    #[error("{}: cannot be read: {source}; check the path", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The target file does not describe a board.
    #[error("{}: {message}", path.display())]
    Target {
        /// The file.
        path: PathBuf,
        /// The key, the problem and the remedy.
        message: String,
    },
    /// The parameters do not make a board.
    #[error(transparent)]
    Board(#[from] camsim_core::scene::BoardError),
}

/// The board of a scenario, with its target file if there is one.
///
/// # Errors
/// [`BoardFileError`] names the file and the key.
pub fn read_board(spec: &BoardSpec) -> Result<Board, BoardFileError> {
    let Some(path) = &spec.target else { return Ok(Board::from_spec(spec)?) };
    let target = read_target(path)?;
    let merged =
        BoardSpec { diameter_m: spec.diameter_m, first_id: spec.first_id, margin_m: spec.margin_m, ..target };
    Board::from_spec(&merged)
        .map_err(|error| BoardFileError::Target { path: path.clone(), message: error.to_string() })
}

/// Reads Kalibr's target YAML: `target_type` and its parameters.
///
/// # Errors
/// Those of [`read_board`].
fn read_target(path: &Path) -> Result<BoardSpec, BoardFileError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| BoardFileError::Read { path: path.into(), source })?;
    let error = |message: String| BoardFileError::Target { path: path.into(), message };
    let document = Document::parse(&text).map_err(|problem| error(problem.message))?;
    parse(&document.value).map_err(|problem| error(format!("{} {}", problem.key, problem.message)))
}

/// Keys of each type of target; others are refused.
const KEYS: &[(&str, &[&str])] = &[
    ("aprilgrid", &["tagCols", "tagRows", "tagSize", "tagSpacing"]),
    ("checkerboard", &["targetCols", "targetRows", "rowSpacingMeters", "colSpacingMeters"]),
    ("circlegrid", &["targetCols", "targetRows", "spacingMeters", "asymmetricGrid"]),
];
/// Size from which a square or tag is refused, metres.
const MAX_SIZE_M: f64 = 10.0;

/// The board of a parsed target file.
fn parse(value: &Value) -> Result<BoardSpec, KeyProblem> {
    let count = |key: &str| {
        let n = number(value, key)?;
        let is_count = n.fract() == 0.0 && (1.0..=1e4).contains(&n);
        if is_count {
            Ok(Some(n as u32))
        } else {
            Err(KeyProblem::new(key, format!("is {n}, not a number of squares, circles or tags")))
        }
    };
    let in_metres = |key: &str, size: f64| {
        let fix = "Kalibr's targets are in metres: divide millimetres by 1000; for a board of this size use \
                   scene.board's own keys";
        if size < MAX_SIZE_M { Ok(size) } else { Err(KeyProblem::new(key, format!("is {size} m: {fix}"))) }
    };
    let metres = |key: &str| number(value, key).and_then(|size| in_metres(key, size));
    let kind = match word(value, "target_type") {
        Some(kind) => kind,
        // Basalt's files omit target_type.
        None if find(value, "tagCols").is_some() => "aprilgrid",
        None => return Err(KeyProblem::new("target_type", "is missing: this is not a Kalibr target")),
    };
    let Some((_, keys)) = KEYS.iter().find(|(known, _)| *known == kind) else {
        return Err(KeyProblem::new(
            "target_type",
            format!("is `{kind}`: `aprilgrid`, `checkerboard` and `circlegrid` are supported"),
        ));
    };
    let known = |key: &str| key == "target_type" || keys.contains(&key);
    if let Some(key) = value.as_object().and_then(|map| map.keys().find(|key| !known(key))) {
        let fix = format!(
            "is not a key of a target of type `{kind}`, which has {}: delete it, or describe the board with \
             scene.board's own keys",
            keys.join(", ")
        );
        return Err(KeyProblem::new(key.clone(), fix));
    }
    match kind {
        "aprilgrid" => Ok(BoardSpec {
            kind: Some(BoardKind::Aprilgrid),
            columns: count("tagCols")?,
            rows: count("tagRows")?,
            size_m: Some(metres("tagSize")?),
            spacing: Some(number(value, "tagSpacing")?),
            ..BoardSpec::default()
        }),
        "checkerboard" => Ok(BoardSpec {
            kind: Some(BoardKind::Chessboard),
            columns: count("targetCols")?,
            rows: count("targetRows")?,
            size_m: Some(metres("colSpacingMeters")?),
            row_size_m: optional_number(value, "rowSpacingMeters")?
                .map(|size| in_metres("rowSpacingMeters", size))
                .transpose()?,
            ..BoardSpec::default()
        }),
        _ => Ok(BoardSpec {
            kind: Some(if is_asymmetric(value)? { BoardKind::AsymmetricCircles } else { BoardKind::Circles }),
            columns: count("targetCols")?,
            rows: count("targetRows")?,
            size_m: Some(metres("spacingMeters")?),
            ..BoardSpec::default()
        }),
    }
}

/// `asymmetricGrid`; false if absent.
fn is_asymmetric(value: &Value) -> Result<bool, KeyProblem> {
    let Some(item) = find(value, "asymmetricGrid") else { return Ok(false) };
    match (item.as_bool(), item.as_i64()) {
        (Some(flag), _) => Ok(flag),
        (_, Some(flag @ (0 | 1))) => Ok(flag == 1),
        _ => Err(KeyProblem::new("asymmetricGrid", format!("is {item}: give True or False"))),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn read(text: &str) -> Result<Board, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("target.yaml");
        std::fs::write(&path, text).unwrap();
        read_board(&BoardSpec { target: Some(path), ..BoardSpec::default() })
            .map_err(|error| error.to_string())
    }

    #[test]
    fn kalibr_targets_equal_boards_of_the_same_parameters() {
        let board = |kind, columns, rows, size_m: f64| BoardSpec {
            kind: Some(kind),
            columns: Some(columns),
            rows: Some(rows),
            size_m: Some(size_m),
            ..BoardSpec::default()
        };
        for (text, spec) in [
            (
                "target_type: 'aprilgrid' #gridtype\ntagCols: 6\ntagRows: 7\ntagSize: 0.088\ntagSpacing: \
                 0.3\n",
                BoardSpec { spacing: Some(0.3), ..board(BoardKind::Aprilgrid, 6, 7, 0.088) },
            ),
            (
                "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: \
                 0.06\ncolSpacingMeters: 0.07\n",
                BoardSpec { row_size_m: Some(0.06), ..board(BoardKind::Chessboard, 6, 7, 0.07) },
            ),
            (
                "target_type: 'circlegrid'\ntargetCols: 4\ntargetRows: 11\nspacingMeters: \
                 0.02\nasymmetricGrid: True\n",
                board(BoardKind::AsymmetricCircles, 4, 11, 0.02),
            ),
            (
                "target_type: 'circlegrid'\ntargetCols: 4\ntargetRows: 5\nspacingMeters: \
                 0.02\nasymmetricGrid: False\n",
                board(BoardKind::Circles, 4, 5, 0.02),
            ),
        ] {
            assert_eq!(read(text).unwrap(), Board::from_spec(&spec).unwrap(), "{text}");
        }
        let basalt = "{ \"tagCols\": 6, \"tagRows\": 6, \"tagSize\": 0.088, \"tagSpacing\": 0.3 }";
        let expected = BoardSpec { spacing: Some(0.3), ..board(BoardKind::Aprilgrid, 6, 6, 0.088) };
        assert_eq!(read(basalt).unwrap(), Board::from_spec(&expected).unwrap());
    }

    #[test]
    fn invalid_targets_are_refused_by_key() {
        for (text, expected) in [
            ("tagCols: 6\n", "tagRows is missing"),
            ("target_type: 'dots'\n", "target_type is `dots`"),
            ("target_type: 'aprilgrid'\ntagRows: 6\n", "tagCols is missing"),
            ("target_type: 'aprilgrid'\ntagCols: 6.5\ntagRows: 6\n", "tagCols is 6.5"),
            (
                "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 600\ntagSize: 1\ntagSpacing: 0.3\n",
                "rows is 600",
            ),
            ("target_type: [", "target.yaml"),
            (
                "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 88\ntagSpacing: 0.3\n",
                "tagSize is 88 m: Kalibr's targets are in metres",
            ),
            (
                "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: \
                 60\ncolSpacingMeters: 0.07\n",
                "rowSpacingMeters is 60 m",
            ),
            (
                "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\nstartId: \
                 36\n",
                "startId is not a key of a target of type `aprilgrid`",
            ),
            (
                "target_type: 'circlegrid'\ntargetCols: 4\ntargetRows: 5\nspacingMeters: \
                 0.02\nasymmetricGrid: 'yes'\n",
                "asymmetricGrid is \"yes\": give True or False",
            ),
            ("targetCols: 4\ntargetRows: 5\n", "target_type is missing"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(expected) && error.contains("target.yaml"), "{error}");
        }
    }
}
