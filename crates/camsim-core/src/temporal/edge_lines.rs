//! Borders of two surfaces within a pixel of a supersampled ideal frame, as straight lines fitted to the
//! samples around. f64 twin of `camsim-gpu/shaders/ideal/edge_lines.wgsl`.
//!
//! Four samples give the coverage of a pixel with an RMS error of 0.09. All samples along eight pixels of a
//! straight border give it with 0.03.

use glam::{DMat3, DVec2, DVec3};

use super::supersampled::SupersampledImage;

/// Half lengths along which the samples must agree on a line, fine pixels, in the order in which they are
/// tried.
const REACH: [f64; 2] = [4.0, 2.0];
/// Samples within this distance of the line take part in the fit, fine pixels.
const BAND: f64 = 0.7;
/// Largest distance of a sample on the wrong side of the line.
const SLACK: f64 = 0.05;
/// Lines farther from the centre of the pixel than this do not cross it.
const MAX_OFFSET: f64 = 0.72;
/// Ridge term, which bounds the slope of the logistic curve: a separable set has no steepest one.
const RIDGE: f64 = 0.03;
const MAX_MEMBERS: usize = 64;
/// Samples that differ by less than this, relative to the nearest, belong to one surface.
const ONE_SURFACE: f64 = 0.02;

/// A border: the nearer surface is where `normal · x > offset_px`, with x in fine pixels from the centre of
/// the fine pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeLine {
    /// Unit vector towards the nearer surface.
    pub normal: DVec2,
    /// Distance from the centre, fine pixels, within ±0.72.
    pub offset_px: f64,
    /// Inverse depth that separates the two surfaces, 1/m.
    pub threshold: f64,
}

/// A sample of the fit: its position, and 1 for the nearer surface or 0 for the farther.
type Member = (DVec2, f64);

/// The border through a fine pixel. `None` if there is one surface, more than two, or a corner.
/// `inverse_depth` returns a sample of a fine pixel, in the order of [`SupersampledImage::SAMPLE_POSITIONS`];
/// it is called for fine pixels within `size_px` only.
///
/// The fit is a logistic regression by Newton's method, first over the 3x3 fine pixels around, then over the
/// band along the line found. A line is accepted if every sample lies on its own side.
#[must_use]
pub fn edge_line(
    fine_pixel: [i64; 2],
    size_px: [i64; 2],
    inverse_depth: &dyn Fn([i64; 2], usize) -> f64,
) -> Option<EdgeLine> {
    let fine_px = |step: [i64; 2]| {
        let [x, y] = [fine_pixel[0] + step[0], fine_pixel[1] + step[1]];
        (x >= 0 && y >= 0 && x < size_px[0] && y < size_px[1]).then_some([x, y])
    };
    let samples = |step: [i64; 2]| {
        fine_px(step).into_iter().flat_map(move |pixel| {
            (0..4).map(move |i| {
                (
                    DVec2::new(step[0] as f64, step[1] as f64) + SupersampledImage::SAMPLE_POSITIONS[i] - 0.5,
                    inverse_depth(pixel, i),
                )
            })
        })
    };
    let neighbours: Vec<(DVec2, f64)> = (0..9).flat_map(|k| samples([k % 3 - 1, k / 3 - 1])).collect();
    let (low, high) =
        neighbours.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), s| (low.min(s.1), high.max(s.1)));
    if low >= (1.0 - ONE_SURFACE) * high {
        return None;
    }
    let threshold = 0.5 * (low + high);
    let member = |(at_px, w): (DVec2, f64)| (at_px, f64::from(u8::from(w > threshold)));
    let (normal, offset_px) = fitted(&neighbours.into_iter().map(member).collect::<Vec<_>>(), 3)
        .filter(|line| line.1.abs() <= 1.0)?;
    REACH
        .into_iter()
        .find_map(|reach| {
            let members: Vec<Member> = along(normal, offset_px, reach)
                .into_iter()
                .flat_map(|step| samples(step).map(move |sample| (step, sample)))
                .filter(|(step, (at_px, _))| {
                    *step == [0, 0]
                        || ((normal.dot(*at_px) - offset_px).abs() < BAND
                            && normal.perp_dot(*at_px).abs() < reach)
                })
                .map(|(_, sample)| member(sample))
                .take(MAX_MEMBERS)
                .collect();
            let (normal, offset_px) = fitted(&members, 4)?;
            separates(normal, offset_px, &members).then_some(EdgeLine { normal, offset_px, threshold })
        })
        .filter(|line| line.offset_px.abs() < MAX_OFFSET)
}

/// Fine pixels along a line, and one on each side of it.
fn along(normal: DVec2, offset_px: f64, reach: f64) -> Vec<[i64; 2]> {
    let flat = normal.y.abs() >= normal.x.abs();
    let major = if flat { normal } else { DVec2::new(normal.y, normal.x) };
    let last = reach as i64;
    (-last..=last)
        .flat_map(|along| {
            let middle = ((offset_px - major.x * along as f64) / major.y).round() as i64;
            (middle - 1..=middle + 1).map(move |across| if flat { [along, across] } else { [across, along] })
        })
        .collect()
}

/// Normal and offset after `steps` steps of Newton's method; `None` without a direction.
fn fitted(members: &[Member], steps: u32) -> Option<(DVec2, f64)> {
    let line = (0..steps).fold(DVec3::ZERO, |line, _| step(line, members));
    let length = line.truncate().length();
    (length > 1e-9 && line.is_finite()).then(|| (line.truncate() / length, line.z / length))
}

/// One step of Newton's method for the logistic regression of a line n x = c, with unknowns (n, c).
fn step(line: DVec3, members: &[Member]) -> DVec3 {
    let mut gradient = DVec3::new(RIDGE * line.x, RIDGE * line.y, 0.0);
    let mut matrix = DMat3::from_diagonal(DVec3::new(RIDGE, RIDGE, 1e-4));
    for (at_px, nearer) in members {
        let position = at_px.extend(-1.0);
        let fraction = 1.0 / (1.0 + (-line.dot(position)).exp());
        gradient += (fraction - nearer) * position;
        let weight = fraction * (1.0 - fraction);
        matrix +=
            DMat3::from_cols(position * position.x, position * position.y, position * position.z) * weight;
    }
    line - matrix.inverse() * gradient
}

/// Whether every sample lies on its own side, with at least one on each.
fn separates(normal: DVec2, offset_px: f64, members: &[Member]) -> bool {
    let on_side = |&(at_px, nearer): &Member| (2.0 * nearer - 1.0) * (normal.dot(at_px) - offset_px) > -SLACK;
    let nearer = members.iter().filter(|member| member.1 > 0.5).count();
    members.iter().all(on_side) && nearer > 0 && nearer < members.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: i64 = 13;

    /// The line of the central pixel of an image of two surfaces, and the fraction of that pixel's samples on
    /// the nearer one.
    fn of(nearer: &dyn Fn(DVec2) -> bool) -> (Option<EdgeLine>, f64) {
        let middle = SIDE / 2;
        let depth = |[x, y]: [i64; 2], i: usize| {
            let at_px = DVec2::new((x - middle) as f64, (y - middle) as f64)
                + SupersampledImage::SAMPLE_POSITIONS[i]
                - 0.5;
            if nearer(at_px) { 1.0 / 40.0 } else { 1.0 / 60.0 }
        };
        let own = (0..4).filter(|&i| depth([middle; 2], i) > 0.02).count() as f64 / 4.0;
        (edge_line([middle; 2], [SIDE; 2], &depth), own)
    }

    fn fraction(nearer: &dyn Fn(DVec2) -> bool) -> f64 {
        const N: u32 = 48;
        let at_px = |i: u32| DVec2::new(f64::from(i % N) + 0.5, f64::from(i / N) + 0.5) / f64::from(N) - 0.5;
        (0..N * N).filter(|&i| nearer(at_px(i))).count() as f64 / f64::from(N * N)
    }

    #[test]
    fn a_straight_border_is_known_to_a_few_hundredths() {
        let (mut by_line, mut by_samples, mut count, mut without) = (0.0, 0.0, 0.0, 0);
        for k in 0..900 {
            let angle = f64::from(k) * 2.399_963;
            let offset = 1.3 * (f64::from(k) * 0.618_034).fract() - 0.65;
            let normal = DVec2::from_angle(angle);
            let truth = fraction(&|at_px| normal.dot(at_px) > offset);
            if truth <= 0.0 || truth >= 1.0 {
                continue;
            }
            let (line, own) = of(&|at_px| normal.dot(at_px) > offset);
            let covered = line.map_or(own, |line| fraction(&|at_px| line.normal.dot(at_px) > line.offset_px));
            without += u32::from(line.is_none());
            by_line += (covered - truth).powi(2);
            by_samples += (own - truth).powi(2);
            count += 1.0;
        }
        let [by_line, by_samples] = [by_line, by_samples].map(|sum: f64| (sum / count).sqrt());
        assert!(count > 500.0 && f64::from(without) < 0.03 * count, "{without} of {count}");
        assert!(by_line < 0.034 && by_samples > 0.08, "{by_line:.4} {by_samples:.4}");
    }

    #[test]
    fn strips_and_corners_have_no_edge_line() {
        assert_eq!(of(&|_| true).0, None);
        // A strip thinner than a pixel, and a corner at the centre of the pixel: no line separates all
        // samples.
        for k in 0..40 {
            let (x, y) =
                (DVec2::from_angle(f64::from(k) * 0.7), DVec2::from_angle(f64::from(k) * 0.7 + 1.57));
            assert_eq!(of(&|at_px| x.dot(at_px).abs() < 0.3).0, None, "strip {k}");
            let corner = of(&|at_px| x.dot(at_px) > 0.0 && y.dot(at_px) > 0.0).0;
            assert_eq!(corner, None, "corner {k}");
        }
        // Values that are not finite cause no panic.
        assert_eq!(edge_line([3, 3], [7, 7], &|_, _| f64::NAN), None);
    }

    #[test]
    fn edge_lines_at_the_image_border() {
        let depth = |[x, y]: [i64; 2], i: usize| {
            assert!((0..7).contains(&x) && (0..7).contains(&y), "{x} {y}");
            if x as f64 + SupersampledImage::SAMPLE_POSITIONS[i].x > 0.4 { 0.02 } else { 0.01 }
        };
        for y in 0..7 {
            let line = edge_line([0, y], [7, 7], &depth).expect("a border");
            assert!((line.normal.x - 1.0).abs() < 0.02 && (line.offset_px + 0.1).abs() < 0.2, "{line:?}");
        }
    }
}
