//! Layout of a board: its black shapes, and the points that are detected.

use glam::DVec2;

use super::{BoardPoint, codes, marker_code};
use crate::scenario::Dictionary;

/// Black squares around a tag's interior: Kalibr prints AprilTags with two, ArUco markers have one.
const APRIL_BORDER: u32 = 2;
const ARUCO_BORDER: u32 = 1;

/// A black shape, in metres right and down from the centre of the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum BoardShape {
    /// A rectangle between two corners.
    Rect { low_m: DVec2, high_m: DVec2 },
    /// A filled circle.
    Disc { centre_m: DVec2, radius_m: f64 },
}

/// Shapes and points of a board.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    pub shapes: Vec<BoardShape>,
    pub points: Vec<BoardPoint>,
    /// Corners of the area within the margin.
    pub low_m: DVec2,
    pub high_m: DVec2,
    /// Length that gets a whole number of texels.
    pub unit_m: DVec2,
    /// Length that [`super::MIN_TEXELS`] refers to, in units.
    pub units: f64,
    pub usual_margin_m: f64,
}

fn count(n: u32) -> f64 {
    f64::from(n)
}

/// A chessboard with `columns` x `rows` inner corners; the square at the top left is black.
pub(super) fn chessboard(columns: u32, rows: u32, square_m: DVec2) -> Layout {
    let high_m = 0.5 * square_m * DVec2::new(count(columns + 1), count(rows + 1));
    let corner_m = |i: u32, j: u32| -high_m + square_m * DVec2::new(count(i), count(j));
    let squares =
        (0..=rows).flat_map(|j| (0..=columns).map(move |i| (i, j))).filter(|(i, j)| (i + j) % 2 == 0);
    let shapes = squares
        .map(|(i, j)| BoardShape::Rect { low_m: corner_m(i, j), high_m: corner_m(i + 1, j + 1) })
        .collect();
    let point = |id: u32| BoardPoint { id, position_m: corner_m(1 + id % columns, 1 + id / columns) };
    let points = (0..columns * rows).map(point).collect();
    Layout {
        shapes,
        points,
        low_m: -high_m,
        high_m,
        unit_m: square_m,
        units: 1.0,
        usual_margin_m: square_m.max_element(),
    }
}

/// Circles `spacing_m` apart. In an asymmetric grid, circles of one row are two spacings apart, and every
/// other row is shifted by one spacing.
pub(super) fn circles(columns: u32, rows: u32, spacing_m: f64, diameter_m: f64, asymmetric: bool) -> Layout {
    let position = |i: u32, j: u32| match asymmetric {
        true => DVec2::new(count(2 * i + j % 2), count(j)),
        false => DVec2::new(count(i), count(j)),
    };
    let last = DVec2::new(
        count(if asymmetric { 2 * (columns - 1) + u32::from(rows > 1) } else { columns - 1 }),
        count(rows - 1),
    );
    let radius_m = 0.5 * diameter_m;
    let point = |id: u32| BoardPoint {
        id,
        position_m: spacing_m * (position(id % columns, id / columns) - 0.5 * last),
    };
    let points: Vec<BoardPoint> = (0..columns * rows).map(point).collect();
    let high_m = 0.5 * spacing_m * last + radius_m;
    Layout {
        shapes: points
            .iter()
            .map(|point| BoardShape::Disc { centre_m: point.position_m, radius_m })
            .collect(),
        points,
        low_m: -high_m,
        high_m,
        unit_m: DVec2::splat(spacing_m),
        units: 1.0,
        usual_margin_m: 0.5 * spacing_m,
    }
}

/// Kalibr's grid of AprilTags 36h11, with tag 0 at the bottom left and small squares at the corners of all
/// tags.
pub(super) fn april_grid(columns: u32, rows: u32, tag_m: f64, spacing: f64, first_id: u32) -> Layout {
    let pitch_m = (1.0 + spacing) * tag_m;
    let high_m =
        0.5 * DVec2::new(count(columns) * pitch_m + spacing * tag_m, count(rows) * pitch_m + spacing * tag_m);
    let (mut shapes, mut points) = (Vec::new(), Vec::new());
    for number in 0..columns * rows {
        let (i, j) = (number % columns, rows - 1 - number / columns);
        let low_m = -high_m + spacing * tag_m + pitch_m * DVec2::new(count(i), count(j));
        let code = codes::APRIL_36H11.get((first_id + number) as usize).copied().unwrap_or(0);
        tag(&mut shapes, low_m, tag_m, 6, code, APRIL_BORDER);
        let corners = [DVec2::Y, DVec2::ONE, DVec2::X, DVec2::ZERO];
        points.extend((0..).zip(corners).map(|(k, corner)| BoardPoint {
            id: 4 * (first_id + number) + k,
            position_m: low_m + tag_m * corner,
        }));
    }
    for (i, j) in (0..=rows).flat_map(|j| (0..=columns).map(move |i| (i, j))) {
        let low_m = -high_m + pitch_m * DVec2::new(count(i), count(j));
        shapes.push(BoardShape::Rect { low_m, high_m: low_m + spacing * tag_m });
    }
    let cell_m = tag_m / count(6 + 2 * APRIL_BORDER);
    let units = count(6 + 2 * APRIL_BORDER);
    Layout {
        shapes,
        points,
        low_m: -high_m,
        high_m,
        unit_m: DVec2::splat(cell_m),
        units,
        usual_margin_m: 0.5 * tag_m,
    }
}

/// OpenCV's ChArUco board of `columns` x `rows` squares. The square at the top left is black; the white
/// squares have markers, row by row.
pub(super) fn charuco(
    columns: u32,
    rows: u32,
    square_m: f64,
    marker_m: f64,
    dictionary: Dictionary,
    first_id: u32,
) -> Layout {
    let mut layout = chessboard(columns - 1, rows - 1, DVec2::splat(square_m));
    let white = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).filter(|(i, j)| (i + j) % 2 == 1);
    for (id, (i, j)) in (first_id..).zip(white) {
        let low_m = layout.low_m + square_m * DVec2::new(count(i), count(j)) + 0.5 * (square_m - marker_m);
        let (side, code) = marker_code(dictionary, id);
        tag(&mut layout.shapes, low_m, marker_m, side, code, ARUCO_BORDER);
    }
    layout
}

/// Black squares of a tag whose top-left corner is at `low_m`.
fn tag(shapes: &mut Vec<BoardShape>, low_m: DVec2, tag_m: f64, side: u32, code: u64, border: u32) {
    let cells = side + 2 * border;
    let square_m_at = |i: u32, j: u32| low_m + tag_m * DVec2::new(count(i), count(j)) / count(cells);
    for (i, j) in (0..cells).flat_map(|j| (0..cells).map(move |i| (i, j))) {
        let inside = |k: u32| k.checked_sub(border).filter(|&k| k < side);
        let white = matches!((inside(i), inside(j)), (Some(i), Some(j)) if code >> (side * side - 1 - (j * side + i)) & 1 == 1);
        if !white {
            shapes.push(BoardShape::Rect { low_m: square_m_at(i, j), high_m: square_m_at(i + 1, j + 1) });
        }
    }
}
