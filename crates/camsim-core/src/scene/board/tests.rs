#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;

fn spec(kind: BoardKind, columns: u32, rows: u32, size_m: f64) -> BoardSpec {
    BoardSpec {
        kind: Some(kind),
        columns: Some(columns),
        rows: Some(rows),
        size_m: Some(size_m),
        ..BoardSpec::default()
    }
}

/// Light of the texture at a position on the board, interpolated bilinearly by hand.
fn light(board: &Board, picture: &Texture, position_m: DVec2) -> f64 {
    let scale = board.scale();
    let texel = (position_m - board.layout.low_m) / scale.texel_m + scale.margin_texels - 0.5;
    let read = |x: f64, y: f64| {
        let [x, y] =
            [x.clamp(0.0, scale.texels.x - 1.0) as usize, y.clamp(0.0, scale.texels.y - 1.0) as usize];
        f64::from(picture.rgba8[4 * (y * picture.size_px[0] as usize + x)]) / 255.0
    };
    let (low, part) = (texel.floor(), texel - texel.floor());
    let row = |y: f64| read(low.x, y) * (1.0 - part.x) + read(low.x + 1.0, y) * part.x;
    row(low.y) * (1.0 - part.y) + row(low.y + 1.0) * part.y
}

/// Position at which light is one half between two positions of different light, metres from the first.
fn edge_m(board: &Board, picture: &Texture, from_m: DVec2, to_m: DVec2) -> f64 {
    let dark_first = light(board, picture, from_m) < 0.5;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if (light(board, picture, from_m.lerp(to_m, middle)) < 0.5) == dark_first {
            low = middle
        } else {
            high = middle
        }
    }
    low * from_m.distance(to_m)
}

#[test]
fn edges_of_squares_fall_between_texels() {
    let board =
        Board::from_spec(&BoardSpec { row_size_m: Some(0.041), ..spec(BoardKind::Chessboard, 8, 5, 0.0333) })
            .unwrap();
    let picture = board.picture();
    for point in board.points() {
        let square = DVec2::new(0.0333, 0.041);
        for half in [-0.25, 0.25] {
            let across = edge_m(
                &board,
                &picture,
                point.position_m + square * DVec2::new(-0.4, half),
                point.position_m + square * DVec2::new(0.4, half),
            );
            let down = edge_m(
                &board,
                &picture,
                point.position_m + square * DVec2::new(half, -0.4),
                point.position_m + square * DVec2::new(half, 0.4),
            );
            let error = DVec2::new(across, down) / square - 0.4;
            assert!(error.abs().max_element() < 1e-9, "{point:?} {half}: {error}");
        }
    }
    // The first square is black, the margin is white.
    assert_eq!(light(&board, &picture, board.layout.low_m + 0.01), 0.0);
    assert_eq!(light(&board, &picture, board.layout.low_m - 0.01), 1.0);
}

#[test]
fn unaligned_edges_are_off_by_less_than_a_thousandth() {
    // An AprilGrid whose gaps have no common measure with the squares of its tags: outer edges of every tag.
    let board =
        Board::from_spec(&BoardSpec { spacing: Some(0.2718), ..spec(BoardKind::Aprilgrid, 4, 3, 0.088) })
            .unwrap();
    let picture = board.picture();
    let mut worst = 0.0_f64;
    for tag in board.points().chunks_exact(4) {
        let (corner, right) = (tag[3].position_m, tag[2].position_m);
        let gap = 0.2718 * 0.088;
        for fraction in [0.1, 0.5, 0.9] {
            let left = edge_m(
                &board,
                &picture,
                corner + DVec2::new(-0.5 * gap, fraction * 0.088),
                corner + DVec2::new(0.008, fraction * 0.088),
            );
            let on_right = edge_m(
                &board,
                &picture,
                right + DVec2::new(-0.008, fraction * 0.088),
                right + DVec2::new(0.5 * gap, fraction * 0.088),
            );
            worst = worst.max((left - 0.5 * gap).abs()).max((on_right - 0.008).abs());
        }
    }
    assert!(worst > 1e-9 && worst < 1e-3 * 0.088, "{worst}");
}

#[test]
fn circles_have_exact_centres_and_areas() {
    for kind in [BoardKind::Circles, BoardKind::AsymmetricCircles] {
        let board =
            Board::from_spec(&BoardSpec { diameter_m: Some(0.031), ..spec(kind, 4, 7, 0.05) }).unwrap();
        let (picture, scale) = (board.picture(), board.scale());
        for point in board.points() {
            let (mut sum, mut first) = (0.0, DVec2::ZERO);
            let middle = (point.position_m - board.layout.low_m) / scale.texel_m + scale.margin_texels;
            let reach = 0.5 * 0.04 / scale.texel_m.x;
            for y in (middle.y - reach) as usize..(middle.y + reach) as usize {
                for x in (middle.x - reach) as usize..(middle.x + reach) as usize {
                    let black =
                        1.0 - f64::from(picture.rgba8[4 * (y * picture.size_px[0] as usize + x)]) / 255.0;
                    sum += black;
                    first += black * (DVec2::new(x as f64, y as f64) + 0.5);
                }
            }
            let radius_texels = 0.0155 / scale.texel_m.x;
            let off = (first / sum - middle).length() * scale.texel_m.x / 0.05;
            assert!(off < 1e-5, "{kind:?} {point:?}: {off}");
            assert!((sum / (std::f64::consts::PI * radius_texels.powi(2)) - 1.0).abs() < 1e-4);
        }
    }
    // OpenCV's order of an asymmetric grid.
    let board = Board::from_spec(&spec(BoardKind::AsymmetricCircles, 4, 11, 0.02)).unwrap();
    let offset_m = |id: usize| board.points()[id].position_m - board.points()[0].position_m;
    assert!(
        (offset_m(1) - DVec2::new(0.04, 0.0)).length() < 1e-12
            && (offset_m(4) - DVec2::new(0.02, 0.02)).length() < 1e-12
    );
}

#[test]
fn tag_numbers_and_orientations_match_their_detectors() {
    let board = Board::from_spec(&spec(BoardKind::Aprilgrid, 6, 6, 0.1)).unwrap();
    let picture = board.picture();
    let of_tag = |tag: usize, i: f64, j: f64| {
        light(&board, &picture, board.points()[4 * tag + 3].position_m + 0.01 * DVec2::new(i + 0.5, j + 0.5))
    };
    // Code 0 is d5d628584: its first row 110101, the last 000100; two black squares around.
    let row = |j: f64| (2..8).map(|i| of_tag(0, f64::from(i), j) as u32).collect::<Vec<_>>();
    assert_eq!((row(2.0), row(7.0)), (vec![1, 1, 0, 1, 0, 1], vec![0, 0, 0, 1, 0, 0]));
    assert!((0..10).all(|i| of_tag(35, f64::from(i), 1.0) == 0.0 && of_tag(35, 8.0, f64::from(i)) == 0.0));
    let low = board.points()[0].position_m;
    assert!(low.x < 0.0 && low.y > 0.0, "tag 0 is at the bottom left");
    assert_eq!(board.points()[7].id, 7);
    let charuco = Board::from_spec(&spec(BoardKind::Charuco, 5, 7, 0.04)).unwrap();
    assert_eq!(charuco.points().len(), 24);
    // The first marker of 4x4 is 1011 0101 0011 0010, in the square right of the top-left one.
    let picture = charuco.picture();
    let corner = charuco.layout.low_m + DVec2::new(0.045, 0.005);
    let cell = |i: u32, j: u32| {
        light(&charuco, &picture, corner + 0.005 * DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5)) as u32
    };
    let code: Vec<u32> = (1..5).flat_map(|j| (1..5).map(move |i| (i, j))).map(|(i, j)| cell(i, j)).collect();
    assert_eq!(code, [1, 0, 1, 1, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]);
}

#[test]
fn board_angles_follow_the_conventions() {
    let (right, down, into) = (DVec3::X, DVec3::Y, DVec3::Z);
    for (angles_deg, expected) in [
        ([0.0, 0.0, 0.0], [DVec3::Y, -DVec3::X, DVec3::Z]),
        ([0.0, 90.0, 0.0], [DVec3::Y, DVec3::Z, DVec3::X]),
        ([0.0, 90.0, 90.0], [-DVec3::X, DVec3::Z, DVec3::Y]),
    ] {
        let turn = ned_from_board(angles_deg);
        for (axis, expected) in [right, down, into].into_iter().zip(expected) {
            assert!((turn * axis - expected).length() < 1e-12, "{angles_deg:?} {axis}");
        }
    }
    let board = Board::from_spec(&spec(BoardKind::Chessboard, 3, 2, 0.1)).unwrap();
    let mesh = board.mesh(DVec3::new(5.0, 6.0, -7.0), ned_from_board([0.0, 90.0, 0.0]));
    let top_left = mesh.shape.vertices.iter().position(|vertex| vertex.uv == [0.0, 0.0]).unwrap();
    // Four by three squares, and one around them.
    assert!(
        (mesh.position_ned_m(top_left as u32) - DVec3::new(5.0, 5.7, -7.25)).length() < 1e-6,
        "{}",
        mesh.position_ned_m(top_left as u32)
    );
}

#[test]
fn invalid_boards_are_refused() {
    let good = || spec(BoardKind::Chessboard, 9, 6, 0.03);
    for (key, spec) in [
        ("kind", BoardSpec { kind: None, ..good() }),
        ("columns", BoardSpec { columns: Some(1), ..good() }),
        ("rows", BoardSpec { rows: Some(5000), ..good() }),
        ("size_m", BoardSpec { size_m: Some(f64::NAN), ..good() }),
        ("row_size_m", BoardSpec { row_size_m: Some(0.0), ..good() }),
        ("margin_m", BoardSpec { margin_m: Some(-1.0), ..good() }),
        ("margin_m", BoardSpec { margin_m: Some(50.0), ..good() }),
        ("spacing", BoardSpec { spacing: Some(0.3), ..good() }),
        ("spacing", BoardSpec { spacing: Some(0.0), ..spec(BoardKind::Aprilgrid, 6, 6, 0.1) }),
        ("first_id", BoardSpec { first_id: Some(580), ..spec(BoardKind::Aprilgrid, 6, 6, 0.1) }),
        ("diameter_m", BoardSpec { diameter_m: Some(0.2), ..spec(BoardKind::Circles, 6, 6, 0.1) }),
        ("marker_m", BoardSpec { marker_m: Some(0.1), ..spec(BoardKind::Charuco, 6, 6, 0.1) }),
        ("first_id", BoardSpec { first_id: Some(u32::MAX), ..spec(BoardKind::Charuco, 6, 6, 0.1) }),
    ] {
        assert_eq!(Board::from_spec(&spec).unwrap_err().key, key, "{spec:?}");
    }
    assert!(Board::from_spec(&good()).is_ok());
}
