//! Silhouette rays: a pixel that sees a silhouette gets rays of its own over its area and exposure. Each ray
//! takes depth and colour from the one surface of the ideal frame that it meets. f64 twin of
//! `camsim-gpu/shaders/reverse/edges/silhouette_rays.wgsl`. [`super::edge_mask`] decides which pixels get
//! such rays; [`super::edge_lines`] locates borders within a pixel.

use glam::{DMat3, DVec2, DVec3};

use super::{IdealGeometry, MAX_KEYS, supersampled::SupersampledImage};

/// Golden ratio: the fractional parts of its multiples are evenly spread for any number of them (Kronecker
/// sequence).
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Step of the march along the epipolar line of a ray, ideal pixels, up to [`MAX_STEPS`] steps.
pub const STEP_PX: f64 = 0.5;
/// Most steps of the march.
pub const MAX_STEPS: f64 = 128.0;
/// Bisections of the step in which a ray stops being in front of the surface.
pub const HALVINGS: u32 = 5;
/// Depth steps whose parallax is below this, in ideal pixels, occlude nothing.
pub const GAP_PX: f64 = 0.1;

/// Subsample `i` of `count` (a power of two): position in the pixel, -0.5 to 0.5 (Hammersley points), and
/// fraction of the exposure that has passed.
#[must_use]
pub fn subsample(i: u32, count: u32) -> (DVec2, f64) {
    let step = 1.0 / f64::from(count);
    let x = (f64::from(i) + 0.5) * step;
    let y = f64::from(i.reverse_bits() >> 8) / 16_777_216.0 + 0.5 * step;
    (DVec2::new(x, y) - 0.5, (GOLDEN * (f64::from(i) + 0.5)).fract())
}

/// An ideal frame, and the poses of an output row relative to it, equally spaced over the exposure.
#[derive(Clone, Copy, Debug)]
pub struct SupersampledKey<'a> {
    /// `x_key = R x_row + t` at the nodes.
    pub nodes: &'a [(DMat3, DVec3)],
    /// Colour and depth of the ideal frame.
    pub image: SupersampledImage<'a>,
}

/// All ideal frames of an output frame, whose key instants are the middles of equal parts of its window, for
/// one output row.
#[derive(Clone, Copy, Debug)]
pub struct SupersampledKeys<'a> {
    /// The ideal frames in order of time.
    pub views: &'a [SupersampledKey<'a>],
    /// Mid-exposure of the row, as a fraction of the window.
    pub row_fraction: f64,
    /// Exposure time, as a fraction of the window.
    pub exposure_fraction: f64,
    /// Largest inverse depth in all ideal frames, 1/m.
    pub nearest_w: f64,
}

/// Intersection of a ray with a surface of an ideal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// Position of its colour, ideal pixels.
    pub position_px: DVec2,
    /// Inverse planar depth in the camera of the output row, 1/m.
    pub row_inverse_depth: f64,
    /// False if the intersection is disoccluded: the key camera did not see it, and the surface seen beside
    /// it replaces it.
    pub is_visible: bool,
}

/// Ideal frames in order of their distance in time from a fraction of the window: their key instants are the middles of
/// `count` equal parts of it. Of two at equal distance the earlier one comes first.
pub fn nearest_first(fraction: f64, count: usize) -> impl Iterator<Item = usize> {
    let mut used = [false; MAX_KEYS as usize];
    let distance = move |key: usize| (fraction * count as f64 - key as f64 - 0.5).abs();
    (0..count).map(move |_| {
        let free = (0..count).filter(|&key| !used[key]);
        let nearest = free.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or_default();
        used[nearest] = true;
        nearest
    })
}

/// First intersection of a ray at a fraction of the window, and the number of the ideal frame that shows it: the
/// nearest one in time, or else the next one in which the intersection is visible. `hit` is that in one of `count`
/// frames.
pub fn first_visible(
    window_fraction: f64,
    count: usize,
    hit: impl Fn(usize) -> Option<SurfaceHit>,
) -> Option<(usize, SurfaceHit)> {
    let mut first = None;
    for key in nearest_first(window_fraction, count) {
        let found = (key, hit(key)?);
        if found.1.is_visible {
            return Some(found);
        }
        first = first.or(Some(found));
    }
    first
}

/// Pose at a fraction of the exposure, linear between nodes.
fn pose_along(nodes: &[(DMat3, DVec3)], fraction: f64) -> Option<(DMat3, DVec3)> {
    let along = fraction * nodes.len().saturating_sub(1) as f64;
    let node = (along as usize).min(nodes.len().saturating_sub(2));
    let a = *nodes.get(node)?;
    Some(nodes.get(node + 1).map_or(a, |b| {
        let t = along - node as f64;
        (a.0 * (1.0 - t) + b.0 * t, a.1.lerp(b.1, t))
    }))
}

/// First intersection of a ray at a fraction of the exposure, as [`first_visible`].
#[must_use]
pub fn first_surface_of_keys(
    uv: DVec2,
    fraction: f64,
    keys: &SupersampledKeys<'_>,
    ideal: &IdealGeometry,
) -> Option<(usize, SurfaceHit)> {
    let window_fraction = keys.row_fraction + (fraction - 0.5) * keys.exposure_fraction;
    first_visible(window_fraction, keys.views.len(), |key| {
        let view = keys.views.get(key)?;
        Some(first_surface(uv, pose_along(view.nodes, fraction)?, keys.nearest_w, &view.image, ideal))
    })
}

/// First intersection of a ray with the surfaces of one ideal frame. The points of the ray, from the nearest
/// surface (`nearest_w` in the key camera, 1/m) to infinity, project to its epipolar line in the ideal frame.
/// The march follows that line. As long as the point is nearer than the depth shown at its projection, the
/// ray is free. Where it stops being free and the depths on both sides agree, the ray hits that surface.
/// Where they differ, the ray passes behind an occluder. If it is still occluded at the depth of the last
/// visible surface, its intersection is disoccluded, and that last visible surface replaces it.
#[must_use]
fn first_surface(
    uv: DVec2,
    key_from_row: (DMat3, DVec3),
    nearest_w: f64,
    image: &SupersampledImage<'_>,
    ideal: &IdealGeometry,
) -> SurfaceHit {
    let (rotation, shift) = key_from_row;
    let direction = rotation * uv.extend(1.0);
    let row_inverse_depth_of = |in_key: f64| in_key * direction.z / (1.0 - shift.z * in_key).max(1e-3);
    let position = |w: f64| ideal.px_from_point(direction + w * shift);
    let inverse_depth = |position_px: DVec2| image.inverse_depth(position_px);
    march(position, row_inverse_depth_of, nearest_w, inverse_depth, ideal)
}

/// `first_surface` for any motion: `position(w)` is the projection of the ray's point at inverse depth w into
/// the ideal frame, `inverse_depth` the depth shown at a position there, and `row_inverse_depth_of` converts
/// that to the row's camera.
#[must_use]
pub fn march(
    position: impl Fn(f64) -> DVec2,
    row_inverse_depth_of: impl Fn(f64) -> f64,
    nearest_w: f64,
    inverse_depth: impl Fn(DVec2) -> f64,
    ideal: &IdealGeometry,
) -> SurfaceHit {
    // Projection of the ray's point at `w`, and the surface shown there as an inverse depth in the row's
    // camera.
    let surface_at = |w: f64| {
        let position_px = position(w);
        (position_px, row_inverse_depth_of(inverse_depth(position_px)))
    };
    // A bound for cameras that almost touch the nearest surface, where the march would not end.
    let w_near = row_inverse_depth_of(1.02 * nearest_w).min(4.0 * 1.02 * nearest_w);
    let (far_px, at_infinity) = surface_at(0.0);
    let length_px = position(w_near).distance(far_px);
    let px_per_w = length_px / w_near.max(1e-12);
    if length_px < GAP_PX {
        // No occlusion is possible: one iteration from infinity is enough.
        let (position_px, found) = surface_at(at_infinity);
        return SurfaceHit { position_px, row_inverse_depth: found, is_visible: true };
    }
    // A ray that is free at two steps, the second behind the first's surface, may have crossed that surface
    // in between. It has if the surface continues to where the ray reaches its depth.
    let earlier_hit = |free: (DVec2, f64)| {
        let (position_px, found) = surface_at(free.1);
        let goes_on = (free.1 - found).abs() * px_per_w < GAP_PX && ideal.contains(position_px);
        goes_on.then_some(SurfaceHit { position_px, row_inverse_depth: found, is_visible: true })
    };
    let steps = (length_px / STEP_PX).ceil().clamp(1.0, MAX_STEPS) as u32;
    let (mut free, mut free_w) = (surface_at(w_near), w_near);
    let mut hidden = false;
    for i in 1..=steps {
        let w = w_near * (1.0 - f64::from(i) / f64::from(steps));
        let here = surface_at(w);
        if w > here.1 {
            if w <= free.1 {
                if hidden {
                    break;
                }
                if let Some(hit) = earlier_hit(free) {
                    return hit;
                }
            }
            (free, free_w, hidden) = (here, w, false);
            continue;
        }
        if !hidden {
            let (mut behind, mut behind_w) = (here, w);
            for _ in 0..HALVINGS {
                let between_w = 0.5 * (free_w + behind_w);
                let between = surface_at(between_w);
                if between_w > between.1 {
                    if between_w <= free.1
                        && let Some(hit) = earlier_hit(free)
                    {
                        return hit;
                    }
                    (free, free_w) = (between, between_w);
                } else {
                    (behind, behind_w) = (between, between_w);
                }
            }
            if (behind.1 - free.1) * px_per_w < GAP_PX {
                return SurfaceHit {
                    position_px: free.0,
                    row_inverse_depth: free.1,
                    is_visible: ideal.contains(free.0),
                };
            }
            hidden = true;
        }
        if w <= free.1 {
            break;
        }
    }
    SurfaceHit { position_px: free.0, row_inverse_depth: free.1, is_visible: false }
}

/// Mean colour of `count` rays over the area of a pixel and over the exposure. `uv` is the pixel's centre,
/// `d_uv` the change of uv along x and y.
#[must_use]
pub fn gather_silhouette(
    uv: DVec2,
    d_uv: [DVec2; 2],
    keys: &SupersampledKeys<'_>,
    count: u32,
    ideal: &IdealGeometry,
) -> DVec3 {
    mean_of_rays(uv, d_uv, count, |ray, fraction| {
        let (key, hit) = first_surface_of_keys(ray, fraction, keys, ideal)?;
        Some(keys.views[key].image.color(hit.position_px))
    })
}

/// Mean of `count` rays over the area of a pixel and over the exposure. `color` is that of a ray at a fraction of the
/// exposure; black without one.
pub fn mean_of_rays(
    uv: DVec2,
    [d_dx, d_dy]: [DVec2; 2],
    count: u32,
    color: impl Fn(DVec2, f64) -> Option<DVec3>,
) -> DVec3 {
    let of_ray = |i: u32| {
        let (position, fraction) = subsample(i, count);
        color(uv + position.x * d_dx + position.y * d_dy, fraction).unwrap_or(DVec3::ZERO)
    };
    (0..count).map(of_ray).sum::<DVec3>() / f64::from(count.max(1))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::temporal::{edge_mask::edge_mask, supersampled::PixelCentre};

    const IDEAL: IdealGeometry = IdealGeometry {
        size_px: [80, 20],
        focal_px: DVec2::splat(60.0),
        principal_px: DVec2::new(39.5, 9.5),
    };
    const ROOF: f64 = 1.0 / 20.0;
    const GROUND: f64 = 1.0 / 60.0;

    /// A white roof on the left of the plane x = 0, 20 m in front of the camera, above black ground at 60 m.
    fn image(scale: u32) -> Drawn {
        draw(scale, |position_px| {
            let roof = position_px.x < IDEAL.principal_px.x;
            PixelCentre {
                inverse_depth: if roof { ROOF } else { GROUND },
                color: if roof { DVec3::ONE } else { DVec3::ZERO },
            }
        })
    }

    struct Drawn {
        scale: u32,
        samples: Vec<f64>,
        centres: Vec<PixelCentre>,
        edge_mask: Vec<bool>,
    }

    impl Drawn {
        fn image(&self) -> SupersampledImage<'_> {
            SupersampledImage {
                size_px: IDEAL.size_px,
                scale: self.scale,
                samples: &self.samples,
                sample_colors: &[],
                centres: &self.centres,
                edge_mask: &self.edge_mask,
                edge_lines: &[],
            }
        }
    }

    fn draw(scale: u32, look: impl Fn(DVec2) -> PixelCentre) -> Drawn {
        let corners = |[width, height]: [u32; 2]| {
            (0..width * height).map(move |i| DVec2::new(f64::from(i % width), f64::from(i / width)))
        };
        let fine = corners(IDEAL.size_px.map(|side| side * scale)).flat_map(|corner| {
            SupersampledImage::SAMPLE_POSITIONS.map(|position| (corner + position) / f64::from(scale) - 0.5)
        });
        let samples: Vec<f64> = fine.map(|position_px| look(position_px).inverse_depth).collect();
        let centres: Vec<PixelCentre> = corners(IDEAL.size_px).map(&look).collect();
        let edge_mask = edge_mask(IDEAL.size_px, scale, &centres, &samples);
        Drawn { scale, samples, centres, edge_mask }
    }

    #[test]
    fn rays_hit_the_nearest_surface_and_disocclusions_show_the_farther_one() {
        let drawn = image(2);
        let image = drawn.image();
        for shift_m in [-1.5, -0.4, -0.02, 0.0, 0.02, 0.4, 1.5] {
            let pose = (DMat3::IDENTITY, DVec3::new(shift_m, 0.0, 0.0));
            for k in -400..=400 {
                let u = f64::from(k) * 1e-3;
                // From x = shift, the border of the roof (x = 0, 20 m) is seen at u = -shift / 20.
                let border_px = (u + shift_m * ROOF) * IDEAL.focal_px.x;
                // The nearest sample is up to a quarter of a pixel away.
                if border_px.abs() < 0.3 {
                    continue;
                }
                let hit = first_surface(DVec2::new(u, 0.01), pose, ROOF, &image, &IDEAL);
                let position_px = hit.position_px;
                let inverse_depth = image.inverse_depth(position_px);
                let roof = border_px < 0.0;
                assert_eq!(
                    inverse_depth,
                    if roof { ROOF } else { GROUND },
                    "shift {shift_m}, u {u}: {position_px}"
                );
                let exact_px = (u + shift_m * inverse_depth) * IDEAL.focal_px.x + IDEAL.principal_px.x;
                // Under the roof, and deep enough to be recognised: reported as not visible.
                let under_px = IDEAL.principal_px.x - exact_px;
                let hidden = !roof && under_px > -0.3;
                assert!(
                    hidden || (position_px.x - exact_px).abs() <= STEP_PX / 32.0 + 1e-9,
                    "shift {shift_m}, u {u}: {position_px} {exact_px}"
                );
                assert!(
                    hit.is_visible != (hidden && under_px > 0.3) || under_px.abs() <= 0.3,
                    "shift {shift_m}, u {u}: {hit:?} {under_px}"
                );
                assert_eq!(hit.row_inverse_depth, inverse_depth);
            }
        }
    }

    #[test]
    fn pixel_across_a_border_gets_its_coverage() {
        let drawn = image(2);
        let image = drawn.image();
        let pixel = 1.0 / IDEAL.focal_px.x;
        let gather = |nodes: &[(DMat3, DVec3)], uv: DVec2| {
            let views = [SupersampledKey { nodes, image }];
            let keys = SupersampledKeys {
                views: &views,
                row_fraction: 0.5,
                exposure_fraction: 1.0,
                nearest_w: ROOF,
            };
            gather_silhouette(uv, [DVec2::new(pixel, 0.0), DVec2::new(0.0, pixel)], &keys, 64, &IDEAL)
        };
        let still = [(DMat3::IDENTITY, DVec3::ZERO)];
        for tenth in -5..=5 {
            let uv = DVec2::new(f64::from(tenth) * 0.1 * pixel, 0.0);
            let mean = gather(&still, uv);
            let fraction = 0.5 - f64::from(tenth) * 0.1;
            // Eight columns of samples per pixel.
            assert!((mean.x - fraction).abs() < 0.13, "{tenth}: {mean} {fraction}");
        }
        // The border moves over two pixels during the exposure.
        let moving = [-1.0, 1.0].map(|px| (DMat3::IDENTITY, DVec3::new(px * pixel / ROOF, 0.0, 0.0)));
        let mean = gather(&moving, DVec2::ZERO);
        assert!((mean.x - 0.5).abs() < 0.05, "{mean}");
    }

    #[test]
    fn second_key_shows_what_the_first_occludes() {
        // As `image`, but the colour of the ground is its position: the key at x = 1.5 m sees 3 px more of it
        // beside the roof.
        let ground_m = |position_px: DVec2, key_m: f64| {
            (position_px.x - IDEAL.principal_px.x) / IDEAL.focal_px.x / GROUND + key_m
        };
        let seen_from = |key_m: f64| {
            draw(2, |position_px| {
                let roof = (position_px.x - IDEAL.principal_px.x) / IDEAL.focal_px.x < -key_m * ROOF;
                let w = if roof { ROOF } else { GROUND };
                PixelCentre {
                    inverse_depth: w,
                    color: if roof {
                        DVec3::splat(-100.0)
                    } else {
                        DVec3::splat(ground_m(position_px, key_m))
                    },
                }
            })
        };
        let keys_m = [-1.5, 1.5];
        let images = keys_m.map(seen_from);
        // The camera of the row is at x = 1.2 m, nearer in time to the first key.
        let nodes = keys_m.map(|key_m| [(DMat3::IDENTITY, DVec3::new(1.2 - key_m, 0.0, 0.0))]);
        let views = [0, 1].map(|k| SupersampledKey { nodes: &nodes[k], image: images[k].image() });
        let mut filled = 0;
        for k in -60..200 {
            let u = f64::from(k) * 2e-3;
            let (border_u, ground_m) = (-1.2 * ROOF, 1.2 + u / GROUND);
            if (u - border_u).abs() * IDEAL.focal_px.x < 0.3 {
                continue;
            }
            let expected = if u < border_u { -100.0 } else { ground_m };
            let color = |views: &[SupersampledKey<'_>]| {
                let keys =
                    SupersampledKeys { views, row_fraction: 0.1, exposure_fraction: 0.0, nearest_w: ROOF };
                let (key, hit) = first_surface_of_keys(DVec2::new(u, 0.0), 0.5, &keys, &IDEAL).unwrap();
                (views[key].image.color(hit.position_px).x - expected).abs()
            };
            let (one, two) = (color(&views[..1]), color(&views));
            // Beside the roof the colour of the last ground pixel replaces points up to a pixel away.
            assert!(two <= 1.0 / IDEAL.focal_px.x / GROUND, "{u}: {two}");
            filled += u32::from(one > 1.0);
        }
        assert!(filled > 20, "one key must not suffice: {filled}");
    }

    #[test]
    fn nearest_keys_come_first() {
        let order = |fraction: f64, count: usize| nearest_first(fraction, count).collect::<Vec<_>>();
        assert_eq!(order(0.1, 2), [0, 1]);
        assert_eq!(order(0.9, 2), [1, 0]);
        assert_eq!(order(0.5, 2), [0, 1]);
        assert_eq!(order(0.3, 4), [1, 0, 2, 3]);
        assert_eq!(order(-3.0, 3), [0, 1, 2]);
    }

    #[test]
    fn subsamples_are_even_over_area_and_time() {
        for count in [16, 32, 64, 256] {
            let positions: Vec<_> = (0..count).map(|i| subsample(i, count)).collect();
            for of in [|p: &(DVec2, f64)| p.0.x + 0.5, |p: &(DVec2, f64)| p.0.y + 0.5, |p: &(DVec2, f64)| p.1]
            {
                let mut values: Vec<f64> = positions.iter().map(of).collect();
                values.sort_by(f64::total_cmp);
                for (k, value) in values.iter().enumerate() {
                    let even = (k as f64 + 0.5) / f64::from(count);
                    assert!(
                        (0.0..1.0).contains(value) && (value - even).abs() < 2.0 / f64::from(count),
                        "{count}: {value} {even}"
                    );
                }
            }
        }
    }

    #[test]
    fn non_finite_ray_gives_some_position() {
        let drawn = image(1);
        let image = drawn.image();
        for uv in [DVec2::NAN, DVec2::splat(f64::INFINITY), DVec2::splat(1e300)] {
            let position_px =
                first_surface(uv, (DMat3::IDENTITY, DVec3::splat(0.5)), ROOF, &image, &IDEAL).position_px;
            let _ = image.color(position_px);
        }
    }
}
