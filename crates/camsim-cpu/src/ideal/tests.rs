//! Triangles that share edges cover each position once, whatever their size and wherever they are clipped.

#![allow(clippy::unwrap_used)]

use camsim_core::noise::pcg4d;

use super::{
    rasterise::{
        Band, PixelCentres, QuadCentres, ROW_PADDING, SKY, SMALL_PX, SamplePattern, SamplePositions,
    },
    triangles::{BAND_ROWS, Chunk, TriangleKind},
    vertices::{Camera, SUBPIXELS, Vertex},
};
use crate::simd::vectors::{Baseline, Vectors, widest};
use camsim_plan::uniforms::IdealCamera;

const SIZE_PX: [u32; 2] = [200, 150];
const KIND: TriangleKind = TriangleKind { material: 0, one_sided: false, sky: None };

fn camera() -> Camera {
    camera_at([99.5, 74.5])
}

fn camera_at(principal_px: [f32; 2]) -> Camera {
    let uniforms = IdealCamera {
        camera_from_ned_x: [1.0, 0.0, 0.0, 0.0],
        camera_from_ned_y: [0.0, 1.0, 0.0, 0.0],
        camera_from_ned_z: [0.0, 0.0, 1.0, 0.0],
        near_m: 0.05,
        ..IdealCamera::default()
    };
    Camera { uniforms, focal_px: [100.0, 100.0], principal_px, size_px: SIZE_PX, sample_offset: 0 }
}

fn draw<P: SamplePattern>(positions: P, chunk: &Chunk, band: &mut Band<'_>) {
    widest!(vectors => draw_by(vectors, positions, chunk, band))
}

#[inline(always)]
fn draw_by<P: SamplePattern>(vectors: impl Vectors, positions: P, chunk: &Chunk, band: &mut Band<'_>) {
    band.draw(vectors, positions, chunk, 0, |_| true);
}

fn random(k: u32) -> [f32; 4] {
    pcg4d([k, 3, 7, 31]).map(|bits| (bits >> 8) as f32 / (1 << 24) as f32)
}

/// How many triangles cover each pixel if none occludes another, and the numbers of small and large ones.
fn covered(triangles: &[[Vertex<2>; 3]], kind: TriangleKind) -> (Vec<u32>, [usize; 2]) {
    covered_by(PixelCentres, &camera(), triangles, kind)
}

/// How many triangles cover each position of a sample pattern, and the numbers of small and large ones.
fn covered_by<P: SamplePattern>(
    positions: P,
    camera: &Camera,
    triangles: &[[Vertex<2>; 3]],
    kind: TriangleKind,
) -> (Vec<u32>, [usize; 2]) {
    let [width, height] = SIZE_PX.map(|side| side as usize / P::STEP);
    let (stride, rows) = (width + ROW_PADDING, BAND_ROWS / P::STEP);
    let mut counts = vec![0; width * height];
    let (mut chunk, mut kinds) = (Chunk::default(), [0; 2]);
    for [a, b, c] in triangles {
        chunk.clear();
        chunk.add(Baseline, camera, [a, b, c], kind);
        chunk.bin(height.div_ceil(rows));
        kinds = [kinds[0] + chunk.raster.len() - chunk.large.len(), kinds[1] + chunk.large.len()];
        for number in (0..height.div_ceil(rows)).filter(|&number| !chunk.band(number).is_empty()) {
            let first_row = number * rows;
            let (mut depth, mut visible) = (vec![0.0; stride * rows], vec![SKY; stride * rows]);
            draw(positions, &chunk, &mut Band { number, stride, depth: &mut depth, visible: &mut visible });
            for (row, visible) in visible.chunks_exact(stride).enumerate() {
                assert!(visible[width..].iter().all(|&visible| visible == SKY), "nothing beyond the picture");
                let is_row = first_row + row < height;
                assert!(is_row || visible.iter().all(|&visible| visible == SKY), "nothing below it");
                let counts =
                    counts.iter_mut().skip(width * (first_row + row)).take(if is_row { width } else { 0 });
                counts.zip(visible).for_each(|(count, &visible)| *count += u32::from(visible != SKY));
            }
        }
    }
    (counts, kinds)
}

/// A plane of `cells` x `cells` cells of two triangles, whose inner vertices are jittered by a fifth of a
/// cell, mapped by `position` from positions in 0..=1.
fn sheet(cells: u32, position: impl Fn([f32; 2]) -> [f32; 3]) -> Vec<[Vertex<2>; 3]> {
    sheet_by(&camera(), cells, position)
}

fn sheet_by(camera: &Camera, cells: u32, position: impl Fn([f32; 2]) -> [f32; 3]) -> Vec<[Vertex<2>; 3]> {
    let corner = |x: u32, y: u32| {
        let [across, down, ..] = random(x * 1000 + y);
        let shake = |side: u32, by: f32| if side == 0 || side == cells { 0.0 } else { 0.4 * (by - 0.5) };
        let at = [(x as f32 + shake(x, across)) / cells as f32, (y as f32 + shake(y, down)) / cells as f32];
        camera.project(camera.in_camera_m(position(at)), at)
    };
    let pair = |x: u32, y: u32| {
        let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
        // Both windings.
        if (x + y).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, d, b], [d, b, c]] }
    };
    (0..cells * cells).flat_map(|k| pair(k % cells, k / cells)).collect()
}

/// Name, triangles, and whether there are small ones and large ones.
type Wall = (&'static str, Vec<[Vertex<2>; 3]>, [bool; 2]);

/// Cells of 0.3 to 400 px, and walls beyond all borders, with vertices that are clipped.
fn walls() -> [Wall; 6] {
    let wall = |side_m: f32| move |[x, y]: [f32; 2]| [side_m * (x - 0.5), side_m * (y - 0.5), 10.0];
    [
        ("small", sheet(60, wall(22.0)), [true, false]),
        ("tiny", sheet(400, wall(21.0)), [true, false]),
        ("middle", sheet(7, wall(40.0)), [true, true]),
        ("large", sheet(2, wall(60.0)), [false, true]),
        ("beyond all borders", sheet(3, wall(90_000.0)), [false, true]),
        ("many beyond all borders", sheet(40, wall(40_000.0)), [false, true]),
    ]
}

fn assert_covered_once(name: &str, counts: &[u32]) {
    let other = counts.iter().filter(|&&count| count != 1).count();
    assert_eq!(other, 0, "{name}: of {} positions", counts.len());
}

/// Mesh triangles that cover no position are dropped: the others cover the same positions.
#[test]
fn small_mesh_triangles_are_dropped_only_if_they_cover_no_position() {
    let model = TriangleKind { material: 1, ..KIND };
    let sample_grid = Camera {
        size_px: SIZE_PX,
        ..Camera { focal_px: [50.0; 2], principal_px: [79.5, 59.5], ..camera() }.sample_grid(1)
    };
    for (name, triangles, _) in walls() {
        let (on_ground, on_model, kinds) =
            (covered(&triangles, KIND), covered(&triangles, model), [KIND, model]);
        assert_eq!(on_ground.0, on_model.0, "{name}");
        let [all, left] = kinds.map(|kind| covered_by(SamplePositions, &sample_grid, &triangles, kind));
        assert_eq!(all.0, left.0, "{name}, by samples");
        if name == "tiny" {
            assert!(
                4 * on_model.1[0] < 3 * on_ground.1[0] && 4 * left.1[0] < 3 * all.1[0],
                "{:?} {:?}",
                on_model.1,
                on_ground.1
            );
        }
    }
}

#[test]
fn adjacent_triangles_cover_each_pixel_once() {
    for (name, triangles, has) in walls() {
        let (counts, [small, large]) = covered(&triangles, KIND);
        assert_covered_once(name, &counts);
        assert_eq!([small > 0, large > 0], has, "{name}: {small} small, {large} large");
    }
    // A floor that passes under the camera, so that some triangles are behind it.
    let floor = |[x, y]: [f32; 2]| [400.0 * (x - 0.5), 2.0, 400.0 * (y - 0.5)];
    let (counts, _) = covered(&sheet(9, floor), KIND);
    let (above, below) = counts.split_at(74 * SIZE_PX[0] as usize);
    assert!(above.iter().all(|&count| count == 0), "nothing above the horizon");
    // The floor ends 200 m away, one pixel below the horizon; its nearest row is 2.7 m away.
    assert!(below[2 * SIZE_PX[0] as usize..].iter().all(|&count| count == 1), "all of the floor, once");
}

#[test]
fn adjacent_triangles_cover_each_sample_and_quad_centre_once() {
    let camera = Camera { sample_offset: SUBPIXELS / 2, ..camera() };
    for (name, triangles, _) in walls() {
        assert_covered_once(name, &covered_by(SamplePositions, &camera, &triangles, KIND).0);
        assert_covered_once(name, &covered_by(QuadCentres, &camera, &triangles, KIND).0);
    }
}

#[test]
fn pixels_far_off_axis_are_covered_once() {
    for principal_px in [[17_000.0, 74.5], [-20_000.0, 74.5], [99.5, 31_000.0], [-40_000.0, -40_000.0]] {
        let camera = camera_at(principal_px);
        for (cells, side_m) in [(2, 30_000.0), (30, 20_000.0)] {
            let wall = |[x, y]: [f32; 2]| [side_m * (x - 0.5), side_m * (y - 0.5), 10.0];
            let (counts, _) = covered_by(PixelCentres, &camera, &sheet_by(&camera, cells, wall), KIND);
            let other = counts.iter().filter(|&&count| count != 1).count();
            assert_eq!(other, 0, "{principal_px:?}, {cells} cells: of {} pixels", counts.len());
        }
    }
}

#[test]
fn one_sided_triangles_show_their_anticlockwise_side() {
    let camera = camera();
    let corner = |x: f32, y: f32| camera.project([x, y, 10.0], [0.0; 2]);
    let [a, b, c] = [corner(-3.0, -3.0), corner(-3.0, 3.0), corner(3.0, 3.0)];
    let count =
        |triangle, one_sided| covered(&[triangle], TriangleKind { one_sided, ..KIND }).0.iter().sum::<u32>();
    let both = count([a, b, c], false);
    assert!(both > 1000);
    // Down, then to the right: anticlockwise in the image.
    assert_eq!([count([a, b, c], true), count([a, c, b], true), count([a, c, b], false)], [both, 0, both]);
}

/// Asserts that random triangles of this size cover the positions that 64-bit edge functions give; returns
/// their number.
fn covered_exactly<P: SamplePattern>(positions: P, sample_offset: i32, reach_m: f32) -> u32 {
    let camera = Camera { sample_offset, ..camera() };
    let mut all = 0;
    for k in 0..400 {
        let corner = |n: u32| {
            let [x, y, z, _] = random(7 * k + n);
            camera.project([reach_m * (x - 0.5), reach_m * (y - 0.5), 10.0 + 4.0 * z], [x, y])
        };
        let triangle = [corner(0), corner(1), corner(2)];
        let (counts, _) = covered_by(positions, &camera, &[triangle], KIND);
        // On the subpixel grid.
        let inside = |x: i64, y: i64| {
            let side = |a: usize, b: usize| {
                let ([ax, ay], [bx, by]) =
                    (triangle[a].snapped.map(i64::from), triangle[b].snapped.map(i64::from));
                (bx - ax) * (y - ay) - (by - ay) * (x - ax)
            };
            let sides = [side(0, 1), side(1, 2), side(2, 0)];
            (sides.iter().all(|&side| side > 0) || sides.iter().all(|&side| side < 0), sides.contains(&0))
        };
        let columns = SIZE_PX[0] as usize / P::STEP;
        for (i, &count) in counts.iter().enumerate() {
            let [column, row] = [i % columns, i / columns];
            let [right, down] = P::sample_offset(column, row);
            let at = |pixel: usize, quarters: i32| {
                (P::STEP * pixel) as i64 * i64::from(SUBPIXELS) + i64::from(quarters * SUBPIXELS / 4)
            };
            let (is_inside, is_on_border) = inside(at(column, right), at(row, down));
            assert!(is_on_border || (count == 1) == is_inside, "triangle {k}, position {i}");
            all += count;
        }
    }
    all
}

#[test]
fn coverage_equals_exact_edge_functions() {
    // The latter are mostly large ones.
    for reach_m in [4.0, 25.0] {
        let pixels = covered_exactly(PixelCentres, 0, reach_m);
        let samples = covered_exactly(SamplePositions, SUBPIXELS / 2, reach_m);
        let fours = covered_exactly(QuadCentres, SUBPIXELS / 2, reach_m);
        assert!(
            pixels > 10_000
                && pixels.abs_diff(samples) < pixels / 20
                && pixels.abs_diff(4 * fours) < pixels / 20,
            "{pixels} {samples} {fours}"
        );
    }
}

#[test]
fn attributes_of_thin_triangles_stay_near_their_vertex_values() {
    let camera = camera();
    let [width, height] = SIZE_PX.map(|side| side as usize);
    let stride = width + ROW_PADDING;
    let (mut pixels, mut large) = (0, 0);
    for k in 0..4000 {
        let [x, y, side, turn] = random(k);
        // Up to 150 px long, and up to a pixel wide.
        let (long, wide) = (0.1 + 15.0 * side, 0.1 * turn.powi(4));
        let (sin, cos) = (40.0 * turn).sin_cos();
        let corner = |along: f32, across: f32, z: f32| {
            let at = [
                20.0 * (x - 0.5) + along * cos - across * sin,
                15.0 * (y - 0.5) + along * sin + across * cos,
            ];
            camera.project([at[0] * z / 10.0, at[1] * z / 10.0, z], [0.0; 2])
        };
        let [a, b, c] = [corner(0.0, 0.0, 10.0), corner(long, 0.0, 14.0), corner(0.5 * long, wide, 11.0)];
        let mut chunk = Chunk::default();
        chunk.add(Baseline, &camera, [&a, &b, &c], KIND);
        chunk.bin(height.div_ceil(BAND_ROWS));
        large += chunk.large.len();
        let (nearest, farthest) = (0.05 / 10.0, 0.05 / 14.0);
        // A pixel is at most one step of the subpixel grid outside of the exact triangle, which is at least
        // eight steps wide.
        let allowed = 0.25 * (nearest - farthest);
        for number in 0..height.div_ceil(BAND_ROWS) {
            let (mut depth, mut visible) = (vec![0.0; stride * BAND_ROWS], vec![SKY; stride * BAND_ROWS]);
            draw(
                PixelCentres,
                &chunk,
                &mut Band { number, stride, depth: &mut depth, visible: &mut visible },
            );
            for inverse_depth in depth
                .into_iter()
                .zip(visible)
                .filter(|&(_, visible)| visible != SKY)
                .map(|(inverse_depth, _)| inverse_depth)
            {
                pixels += 1;
                assert!(
                    (farthest - allowed..=nearest + allowed).contains(&inverse_depth),
                    "{k}: {inverse_depth}"
                );
            }
        }
    }
    assert!(pixels > 1000 && large > 100, "{pixels} pixels, {large} large");
}

#[test]
fn vertices_with_nan_draw_nothing() {
    let camera = camera();
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38, 1e-42, 0.0];
    for (k, &number) in bad.iter().enumerate() {
        for axis in 0..3 {
            let mut at = [0.5, 0.25, 8.0];
            at[axis] = number;
            let corners = [
                camera.project(at, [0.0; 2]),
                camera.project([1.0, 2.0, 9.0], [1.0; 2]),
                camera.project([-2.0, 1.0, 9.0], [1.0; 2]),
            ];
            // Whatever is drawn: no panic, and no pixel twice.
            let (counts, _) = covered(&[corners], KIND);
            assert!(counts.iter().all(|&count| count <= 1), "{k} {axis}");
            assert!(
                number.is_finite() || axis == 2 || counts.iter().all(|&count| count == 0),
                "{number} {axis}"
            );
        }
    }
}

#[test]
fn products_of_small_triangles_fit_32_bits() {
    // Largest value in `draw_small`: three sums of products of differences of vertices, with positions up to
    // the last lane, which may be two pixels apart.
    let corner = i64::from(SMALL_PX * SUBPIXELS);
    let farthest = corner + i64::from((2 * (ROW_PADDING as i32 - 1) + 1) * SUBPIXELS);
    assert!(
        2 * (2 * corner) * (farthest + corner) <= i64::from(i32::MAX),
        "{}",
        2 * (2 * corner) * (farthest + corner)
    );
}
