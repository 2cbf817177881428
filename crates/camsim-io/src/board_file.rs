//! Calibration boards: the parameters of a scenario, or Kalibr's target YAML in their place.

use std::path::{Path, PathBuf};

use camsim_core::{
    scenario::{BoardKind, BoardSpec},
    scene::Board,
};
use serde_json::Value;

use crate::camera_file::document::{Document, Problem, find, number, optional_number, word};

/// What is wrong with a board.
#[derive(Debug, thiserror::Error)]
pub enum BoardFileError {
    /// The file of the parameters cannot be read.
    #[error("{}: cannot be read: {source}; check the path", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It does not say what a board is.
    #[error("{}: {message}", path.display())]
    Target {
        /// The file.
        path: PathBuf,
        /// The key, what is wrong with it and what to do.
        message: String,
    },
    /// The parameters make no board.
    #[error(transparent)]
    Board(#[from] camsim_core::scene::BoardError),
}

/// The board that a scenario describes, its target file read.
///
/// # Errors
/// [`BoardFileError`] names the file and the key.
pub fn read_board(spec: &BoardSpec) -> Result<Board, BoardFileError> {
    let Some(path) = &spec.target else { return Ok(Board::from_spec(spec)?) };
    let target = read_target(path)?;
    let merged = BoardSpec { diameter_m: spec.diameter_m, first_id: spec.first_id, margin_m: spec.margin_m, ..target };
    Board::from_spec(&merged).map_err(|error| BoardFileError::Target { path: path.clone(), message: error.to_string() })
}

/// Kalibr's description of a target: `target_type` and what belongs to it.
///
/// # Errors
/// As [`read_board`].
pub fn read_target(path: &Path) -> Result<BoardSpec, BoardFileError> {
    let text = std::fs::read_to_string(path).map_err(|source| BoardFileError::Read { path: path.into(), source })?;
    let wrong = |message: String| BoardFileError::Target { path: path.into(), message };
    let document = Document::parse(&text).map_err(|problem| wrong(problem.message))?;
    parse(&document.value).map_err(|problem| wrong(format!("{} {}", problem.key, problem.message)))
}

fn parse(value: &Value) -> Result<BoardSpec, Problem> {
    let count = |key: &str| {
        let n = number(value, key)?;
        let whole = n.fract() == 0.0 && (1.0..=1e4).contains(&n);
        if whole { Ok(Some(n as u32)) } else { Err(Problem::new(key, format!("is {n}, not a number of squares, circles or tags"))) }
    };
    match word(value, "target_type") {
        Some("aprilgrid") => Ok(BoardSpec {
            kind: Some(BoardKind::Aprilgrid),
            columns: count("tagCols")?,
            rows: count("tagRows")?,
            size_m: Some(number(value, "tagSize")?),
            spacing: Some(number(value, "tagSpacing")?),
            ..BoardSpec::default()
        }),
        Some("checkerboard") => Ok(BoardSpec {
            kind: Some(BoardKind::Chessboard),
            columns: count("targetCols")?,
            rows: count("targetRows")?,
            size_m: Some(number(value, "colSpacingMeters")?),
            row_size_m: optional_number(value, "rowSpacingMeters")?,
            ..BoardSpec::default()
        }),
        Some("circlegrid") => {
            let asymmetric = find(value, "asymmetricGrid").is_some_and(|flag| flag.as_bool() == Some(true) || flag.as_i64() == Some(1));
            Ok(BoardSpec {
                kind: Some(if asymmetric { BoardKind::AsymmetricCircles } else { BoardKind::Circles }),
                columns: count("targetCols")?,
                rows: count("targetRows")?,
                size_m: Some(number(value, "spacingMeters")?),
                ..BoardSpec::default()
            })
        }
        Some(other) => Err(Problem::new("target_type", format!("is `{other}`: `aprilgrid`, `checkerboard` and `circlegrid` are known"))),
        None => Err(Problem::new("target_type", "is missing: this is no target of Kalibr's")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn read(text: &str) -> Result<Board, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("target.yaml");
        std::fs::write(&path, text).unwrap();
        read_board(&BoardSpec { target: Some(path), ..BoardSpec::default() }).map_err(|error| error.to_string())
    }

    #[test]
    fn targets_of_kalibr_are_the_boards_of_the_same_parameters() {
        let board = |kind, columns, rows, size_m: f64| BoardSpec {
            kind: Some(kind),
            columns: Some(columns),
            rows: Some(rows),
            size_m: Some(size_m),
            ..BoardSpec::default()
        };
        for (text, spec) in [
            (
                "target_type: 'aprilgrid' #gridtype\ntagCols: 6\ntagRows: 7\ntagSize: 0.088\ntagSpacing: 0.3\n",
                BoardSpec { spacing: Some(0.3), ..board(BoardKind::Aprilgrid, 6, 7, 0.088) },
            ),
            (
                "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.07\n",
                BoardSpec { row_size_m: Some(0.06), ..board(BoardKind::Chessboard, 6, 7, 0.07) },
            ),
            (
                "target_type: 'circlegrid'\ntargetCols: 4\ntargetRows: 11\nspacingMeters: 0.02\nasymmetricGrid: True\n",
                board(BoardKind::AsymmetricCircles, 4, 11, 0.02),
            ),
            (
                "target_type: 'circlegrid'\ntargetCols: 4\ntargetRows: 5\nspacingMeters: 0.02\nasymmetricGrid: False\n",
                board(BoardKind::Circles, 4, 5, 0.02),
            ),
        ] {
            assert_eq!(read(text).unwrap(), Board::from_spec(&spec).unwrap(), "{text}");
        }
    }

    #[test]
    fn what_is_no_target_is_named() {
        for (text, wanted) in [
            ("tagCols: 6\n", "target_type is missing"),
            ("target_type: 'dots'\n", "target_type is `dots`"),
            ("target_type: 'aprilgrid'\ntagRows: 6\n", "tagCols is missing"),
            ("target_type: 'aprilgrid'\ntagCols: 6.5\ntagRows: 6\n", "tagCols is 6.5"),
            ("target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 600\ntagSize: 1\ntagSpacing: 0.3\n", "rows is 600"),
            ("target_type: [", "target.yaml"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(wanted) && error.contains("target.yaml"), "{error}");
        }
    }
}
