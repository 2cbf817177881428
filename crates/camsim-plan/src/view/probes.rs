//! Probes: a few hundred output pixels at which the reverse pipeline is run dry, in f64 and against exact
//! rays, before a frame is rendered.

use camsim_core::camera::CameraModel;
use glam::{DMat2, DVec2};

/// Probes along the width and the height of the image.
const GRID: [u32; 2] = [24, 18];
/// Times as many in each axis where the camera makes a face of the picture, which has a fifth of its pixels or so.
const FACE_TIMES: u32 = 2;
/// Irrational steps of a sequence that is even over a square: the cells' probes do not line up with anything
/// in the scene.
const SPREAD: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// A pixel that stands for those around it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Probe {
    /// Output pixel.
    pub pixel: [u32; 2],
    /// Its ideal ray.
    pub uv: DVec2,
    /// Its ray before the lens.
    pub distorted: DVec2,
    /// d(uv)/d(output pixel), one column an axis.
    pub uv_from_px: DMat2,
    /// Whether its cell is a black one of the chessboard that the cells make.
    pub is_odd: bool,
    /// Whether its row of cells is the second of two.
    pub is_low: bool,
}

/// One probe a cell of a grid over the image, at a position of its own in each, and the image's corners; only
/// pixels that have a ray.
pub(crate) fn probes(camera: &CameraModel) -> Vec<Probe> {
    let [width, height] = camera.size_px;
    let [columns, rows] = grid(camera);
    let inside = (0..rows).flat_map(|j| {
        (0..columns).map(move |i| {
            let k = f64::from(j * columns + i) + 0.5;
            let [x, y] = [(i, columns, width, SPREAD[0]), (j, rows, height, SPREAD[1])].map(
                |(cell, cells, side, spread)| {
                    ((f64::from(cell) + (k * spread).fract()) * f64::from(side) / f64::from(cells)) as u32
                },
            );
            ([x.min(width - 1), y.min(height - 1)], [(i + j) % 2 == 1, j % 2 == 1])
        })
    });
    let corners = [
        ([0, 0], [false, false]),
        ([width - 1, 0], [true, false]),
        ([0, height - 1], [true, true]),
        ([width - 1, height - 1], [false, true]),
    ];
    inside.chain(corners).filter_map(|(pixel, kind)| probe(camera, pixel, kind)).collect()
}

/// Columns and rows of probes: no more than there are pixels.
pub(crate) fn grid(camera: &CameraModel) -> [u32; 2] {
    [0, 1].map(|axis: usize| wanted_grid(camera)[axis].min(camera.size_px[axis]))
}

fn wanted_grid(camera: &CameraModel) -> [u32; 2] {
    let times = if camera.lens.face().is_some() { FACE_TIMES } else { 1 };
    GRID.map(|count| times * count)
}

/// Side of the part of the image that a probe stands for, pixels.
pub(crate) fn spacing_px(camera: &CameraModel) -> f64 {
    let wanted = wanted_grid(camera);
    let [width, height] =
        [0, 1].map(|axis: usize| (f64::from(camera.size_px[axis]) / f64::from(wanted[axis])).max(1.0));
    (width * height).sqrt()
}

/// The probe of the same pixel in another camera.
pub(crate) fn same_probe(camera: &CameraModel, of: &Probe) -> Option<Probe> {
    probe(camera, of.pixel, [of.is_odd, of.is_low])
}

fn probe(camera: &CameraModel, pixel: [u32; 2], [is_odd, is_low]: [bool; 2]) -> Option<Probe> {
    let distorted = camera.distorted_from_pixel(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])));
    let uv = camera.unproject_pixel(pixel)?;
    let uv_from_px = camera.lens.jacobian(uv).inverse() * DMat2::from_diagonal(camera.focal_px.recip());
    uv_from_px.is_finite().then_some(Probe { pixel, uv, distorted, uv_from_px, is_odd, is_low })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::{collections::HashSet, sync::Arc};

    use super::*;
    use crate::LensReach;
    use camsim_core::scenario::LensModel;

    #[test]
    fn probes_cover_the_image_and_have_the_derivative_of_the_ray() {
        let coefficients = [-0.390_024, 0.111_124, -0.001_274_4, -0.008_151_7, -0.008_427_63];
        let camera =
            CameraModel::new([640, 480], [307.6, 300.0], None, LensModel::BrownConrady, &coefficients)
                .unwrap();
        let all = probes(&camera);
        assert!(all.len() > 400, "{}", all.len());
        for quarter in 0..4 {
            let of_quarter = all
                .iter()
                .filter(|p| u32::from(p.pixel[0] > 319) + 2 * u32::from(p.pixel[1] > 239) == quarter);
            assert!(of_quarter.count() > 90);
        }
        for probe in &all {
            let at = DVec2::new(f64::from(probe.pixel[0]), f64::from(probe.pixel[1]));
            for axis in [DVec2::X, DVec2::Y] {
                let Some(beside) = camera.unproject(at + 1e-4 * axis) else { continue };
                let numeric = (beside - probe.uv) / 1e-4;
                assert!(numeric.distance(probe.uv_from_px * axis) < 1e-3 * numeric.length(), "{probe:?}");
            }
        }
    }

    #[test]
    fn four_frames_have_all_probes_and_each_has_them_everywhere() {
        let camera = CameraModel::new([640, 480], [307.6, 300.0], None, LensModel::Pinhole, &[]).unwrap();
        let reach = LensReach::new(Arc::new(camera)).unwrap();
        let quarters = [[false, false], [true, false], [false, true], [true, true]]
            .map(|of| reach.with_a_quarter_of_the_probes(of));
        let all: Vec<[u32; 2]> =
            quarters.iter().flat_map(|quarter| quarter.probes.iter().map(|probe| probe.pixel)).collect();
        assert_eq!(all.len(), reach.probes.len());
        assert_eq!(all.into_iter().collect::<HashSet<_>>().len(), reach.probes.len());
        for quarter in &quarters {
            assert!((quarter.probe_px / reach.probe_px - 2.0).abs() < 1e-9);
            for corner in 0..4 {
                let there = quarter
                    .probes
                    .iter()
                    .filter(|p| u32::from(p.pixel[0] > 319) + 2 * u32::from(p.pixel[1] > 239) == corner);
                assert!((22..33).contains(&there.count()));
            }
        }
    }

    #[test]
    fn tiny_images_have_probes_too() {
        for size in [[1, 1], [3, 2], [30, 1]] {
            let camera = CameraModel::new(size, [10.0, 10.0], None, LensModel::Pinhole, &[]).unwrap();
            assert!(probes(&camera).iter().all(|p| p.pixel[0] < size[0] && p.pixel[1] < size[1]));
            assert!(!probes(&camera).is_empty());
        }
    }
}
