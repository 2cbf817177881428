//! Calibration boards, generated from their parameters: chessboards, circle grids, AprilGrids, ChArUco
//! boards.
//!
//! A board has black shapes on white. Its texture holds the exact coverage of each texel by black, at a scale
//! at which the edges of the shapes fall between texels wherever their sizes have a common measure. There a
//! bilinear read is half black exactly on the edge. An edge within a texel is displaced by at most 1.5 -
//! sqrt(2) = 0.086 texels, and a square, a tag or a circle's spacing has at least `MIN_TEXELS`.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec2, DVec3, EulerRot};

use super::{Mesh, MeshVertex, Texture, Wrap};
use crate::scenario::{BoardKind, BoardSpec, Dictionary};

#[rustfmt::skip]
mod codes;
mod layout;
mod raster;

/// Least number of texels along a square, a tag or a spacing; 0.086 texels are less than a thousandth of it.
const MIN_TEXELS: f64 = 90.0;
/// Preferred number of texels along the longer side.
const AIM_TEXELS: f64 = 1536.0;
/// Largest number of texels along a side.
const MAX_TEXELS: f64 = 8192.0;
/// Largest number of squares, circles or tags along a side.
const MAX_ALONG: u32 = 80;

/// Invalid parameters of a board.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key} {message}")]
pub struct BoardError {
    /// The key below `scene.board`.
    pub key: &'static str,
    /// What is wrong, and how to correct it.
    pub message: String,
}

fn refuse<T>(key: &'static str, message: impl Into<String>) -> Result<T, BoardError> {
    Err(BoardError { key, message: message.into() })
}

/// A point that calibration programs detect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardPoint {
    /// Number of the point. Chessboard, circles and ChArUco: row by row from the top left, as in OpenCV.
    /// AprilGrid: four times the tag's number, with the corners of a tag anticlockwise from the bottom left,
    /// as in Kalibr.
    pub id: u32,
    /// Position from the centre of the board: right and down, metres.
    pub position_m: DVec2,
}

/// A board of known dimensions.
#[derive(Clone, Debug, PartialEq)]
pub struct Board {
    layout: layout::Layout,
    margin_m: f64,
}

impl Board {
    /// The board of a scenario. `spec.target` has already been read into the other keys.
    ///
    /// # Errors
    /// [`BoardError`] names the key.
    pub fn from_spec(spec: &BoardSpec) -> Result<Self, BoardError> {
        let Some(kind) = spec.kind else {
            return refuse(
                "kind",
                "is missing: give \"chessboard\", \"circles\", \"asymmetric-circles\", \"aprilgrid\" or \"charuco\", or target = \"kalibr.yaml\"",
            );
        };
        let count = |key, value: Option<u32>, least: u32| match value {
            Some(n) if (least..=MAX_ALONG).contains(&n) => Ok(n),
            Some(n) => refuse(key, format!("is {n}; it must be {least} to {MAX_ALONG}")),
            None => refuse(key, "is missing, and has no default; add it"),
        };
        let metres = |key, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(value)
            } else {
                refuse(key, format!("is {value}; give metres above 0"))
            }
        };
        let [columns, rows] = match kind {
            BoardKind::Chessboard | BoardKind::Charuco => {
                [count("columns", spec.columns, 2)?, count("rows", spec.rows, 2)?]
            }
            _ => [count("columns", spec.columns, 1)?, count("rows", spec.rows, 1)?],
        };
        let Some(size_m) = spec.size_m else {
            return refuse("size_m", "is missing, and has no default; add it");
        };
        let size_m = metres("size_m", size_m)?;
        check_foreign_keys(spec, kind)?;
        let layout = match kind {
            BoardKind::Chessboard => layout::chessboard(
                columns,
                rows,
                DVec2::new(size_m, metres("row_size_m", spec.row_size_m.unwrap_or(size_m))?),
            ),
            BoardKind::Circles | BoardKind::AsymmetricCircles => {
                let diameter_m = metres("diameter_m", spec.diameter_m.unwrap_or(0.5 * size_m))?;
                let nearest_m =
                    if kind == BoardKind::Circles { size_m } else { std::f64::consts::SQRT_2 * size_m };
                if diameter_m >= nearest_m {
                    return refuse(
                        "diameter_m",
                        format!("is {diameter_m}, but circles are {nearest_m:.4} m apart: make it smaller"),
                    );
                }
                layout::circles(columns, rows, size_m, diameter_m, kind == BoardKind::AsymmetricCircles)
            }
            BoardKind::Aprilgrid => {
                let spacing = spec.spacing.unwrap_or(0.3);
                if !(spacing > 0.0 && spacing <= 1.0) {
                    return refuse(
                        "spacing",
                        format!(
                            "is {spacing}; give the gap between tags as a fraction of size_m, above 0 and up to 1"
                        ),
                    );
                }
                let first = first_id(spec, columns * rows, codes::APRIL_36H11.len())?;
                layout::april_grid(columns, rows, size_m, spacing, first)
            }
            BoardKind::Charuco => {
                let marker_m = metres("marker_m", spec.marker_m.unwrap_or(0.75 * size_m))?;
                if marker_m >= size_m {
                    return refuse(
                        "marker_m",
                        format!("is {marker_m}, but a square has {size_m} m: make it smaller"),
                    );
                }
                let first = first_id(spec, columns * rows / 2, codes::ARUCO_4X4.len())?;
                layout::charuco(columns, rows, size_m, marker_m, spec.dictionary.unwrap_or_default(), first)
            }
        };
        let margin_m = spec.margin_m.unwrap_or(layout.usual_margin_m);
        if !(margin_m.is_finite() && margin_m >= 0.0) {
            return refuse("margin_m", format!("is {margin_m}; give metres, 0 or more"));
        }
        let board = Self { layout, margin_m };
        let side = board.scale().texels.max_element();
        if side > MAX_TEXELS {
            return refuse(
                "margin_m",
                format!(
                    "or the number of squares gives a texture of {side:.0} texels, more than {MAX_TEXELS}"
                ),
            );
        }
        Ok(board)
    }

    /// The points that calibration programs detect, in the order of their numbers.
    pub fn points(&self) -> &[BoardPoint] {
        &self.layout.points
    }

    /// Texture of the board, linear light.
    pub fn picture(&self) -> Texture {
        raster::draw(&self.layout, &self.scale())
    }

    /// The board as a flat mesh with its centre at `centre_ned_m`, rotated as by [`ned_from_board`].
    pub fn mesh(&self, centre_ned_m: DVec3, ned_from_board: DMat3) -> Mesh {
        let scale = self.scale();
        let corner = |u: f64, v: f64| {
            let position_m =
                self.layout.low_m + (DVec2::new(u, v) * scale.texels - scale.margin_texels) * scale.texel_m;
            MeshVertex::new(
                (ned_from_board * position_m.extend(0.0)).as_vec3().to_array(),
                [u as f32, v as f32],
            )
        };
        let vertices = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
        Mesh::new(vertices, vec![0, 3, 1, 0, 2, 3], Arc::new(self.picture()), centre_ned_m, Wrap::Clamp)
    }

    /// Texel size of the texture.
    fn scale(&self) -> raster::Scale {
        raster::Scale::new(&self.layout, self.margin_m)
    }
}

/// Rotation from the board's axes (right, down, into the board) to north-east-down. Roll, pitch and yaw in
/// degrees are those of a body whose nose is the top of the board and whose belly is its back: at 0 0 0 the
/// board lies face up with its top to the north; at pitch 90 it stands upright and faces a viewer who looks
/// north.
pub fn ned_from_board(angles_deg: [f64; 3]) -> DMat3 {
    let [roll, pitch, yaw] = angles_deg.map(f64::to_radians);
    let ned_from_body = DMat3::from_quat(DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll));
    // Right is the body's right, down is its tail, and into the board is its belly.
    ned_from_body * DMat3::from_cols(DVec3::Y, -DVec3::X, DVec3::Z)
}

fn first_id(spec: &BoardSpec, tags: u32, known: usize) -> Result<u32, BoardError> {
    let first = spec.first_id.unwrap_or(0);
    if u64::from(first) + u64::from(tags) > known as u64 {
        return refuse(
            "first_id",
            format!(
                "is {first} and the board has {tags} tags, but the family has only {known}: use fewer columns or rows"
            ),
        );
    }
    Ok(first)
}

/// Refuses keys of other kinds of board: such a mistake would not be visible in the image.
fn check_foreign_keys(spec: &BoardSpec, kind: BoardKind) -> Result<(), BoardError> {
    use BoardKind::{Aprilgrid, AsymmetricCircles, Charuco, Chessboard, Circles};
    let given: [(&'static str, bool, &[BoardKind]); 6] = [
        ("row_size_m", spec.row_size_m.is_some(), &[Chessboard]),
        ("diameter_m", spec.diameter_m.is_some(), &[Circles, AsymmetricCircles]),
        ("spacing", spec.spacing.is_some(), &[Aprilgrid]),
        ("marker_m", spec.marker_m.is_some(), &[Charuco]),
        ("dictionary", spec.dictionary.is_some(), &[Charuco]),
        ("first_id", spec.first_id.is_some(), &[Aprilgrid, Charuco]),
    ];
    match given.iter().find(|(_, given, of)| *given && !of.contains(&kind)) {
        Some((key, ..)) => refuse(key, "does not belong to a board of this kind: leave it out"),
        None => Ok(()),
    }
}

/// Squares along a side of a marker's interior, and its white squares as bits.
fn marker_code(dictionary: Dictionary, id: u32) -> (u32, u64) {
    let id = id as usize;
    match dictionary {
        Dictionary::FourByFour => (4, codes::ARUCO_4X4.get(id).map_or(0, |&code| u64::from(code))),
        Dictionary::FiveByFive => (5, codes::ARUCO_5X5.get(id).map_or(0, |&code| u64::from(code))),
        Dictionary::SixBySix => (6, codes::ARUCO_6X6.get(id).copied().unwrap_or(0)),
    }
}

#[cfg(test)]
mod tests;
