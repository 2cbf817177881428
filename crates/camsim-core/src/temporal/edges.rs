//! Pixels that see a silhouette: rays of their own over the pixel's area and exposure, each with the depth of
//! the one surface of the ideal frame that it meets, and with the colour of that surface. f64 twin of
//! `shaders/reverse/edges/supersampled.wgsl`. Which pixels are marked is [`super::marks`]; borders within a
//! pixel are [`super::lines`].

use glam::{DMat3, DVec2, DVec3};

use super::{IdealGeometry, fine::FineImage};

/// Golden ratio: its multiples are even over an interval for any number of them.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Distance of two looks along the parallax of a ray, ideal pixels, while they are no more than
/// [`MAX_LOOKS`].
const LOOK_PX: f64 = 0.5;
const MAX_LOOKS: f64 = 128.0;
/// Halvings of the distance in which a ray stops being free.
const HALVINGS: u32 = 5;
/// A step of depth that moves a surface by less than this, in ideal pixels of parallax, hides nothing.
const GAP_PX: f64 = 0.1;

/// Ray `i` of `count` (a power of two): place in the pixel, from -0.5 to 0.5 (Hammersley's points), and share
/// of the exposure gone by.
#[must_use]
pub fn ray_place(i: u32, count: u32) -> (DVec2, f64) {
    let step = 1.0 / f64::from(count);
    let x = (f64::from(i) + 0.5) * step;
    let y = f64::from(i.reverse_bits() >> 8) / 16_777_216.0 + 0.5 * step;
    (DVec2::new(x, y) - 0.5, (GOLDEN * (f64::from(i) + 0.5)).fract())
}

/// An ideal frame, and the poses over a line's exposure relative to it, equally far apart in time.
#[derive(Clone, Copy, Debug)]
pub struct KeyView<'a> {
    /// `x_key = R x_line + t` at the nodes.
    pub nodes: &'a [(DMat3, DVec3)],
    /// What the key camera sees.
    pub image: FineImage<'a>,
}

/// The frame's keys, at the middles of equal parts of its window, as one line sees them.
#[derive(Clone, Copy, Debug)]
pub struct Keys<'a> {
    /// In order of time.
    pub views: &'a [KeyView<'a>],
    /// Mid-exposure of the line, share of the window.
    pub line_share: f64,
    /// Exposure, share of the window.
    pub exposure_share: f64,
    /// Largest inverse depth of all keys, 1/m.
    pub nearest_w: f64,
}

/// Where a ray meets a surface of an ideal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// Where its colour is, ideal pixels.
    pub at_px: DVec2,
    /// Inverse planar depth of the meeting point in the line's camera, 1/m.
    pub in_line: f64,
    /// False: the key camera did not see what the ray meets, and what it saw beside it stands in.
    pub seen: bool,
}

/// The key of a rank (0 = nearest in time) of `count` keys at the middles of equal parts of the window.
#[must_use]
pub fn key_of_rank(share: f64, count: usize, rank: usize) -> usize {
    let away = |key: usize| (share * count as f64 - key as f64 - 0.5).abs();
    let mut keys: Vec<usize> = (0..count).collect();
    // Stable: of two that are equally far the earlier comes first.
    keys.sort_by(|&a, &b| away(a).total_cmp(&away(b)));
    keys.get(rank).copied().unwrap_or_default()
}

/// Pose at a share of the exposure, linear between nodes.
fn pose_along(nodes: &[(DMat3, DVec3)], share: f64) -> Option<(DMat3, DVec3)> {
    let along = share * nodes.len().saturating_sub(1) as f64;
    let node = (along as usize).min(nodes.len().saturating_sub(2));
    let a = *nodes.get(node)?;
    Some(nodes.get(node + 1).map_or(a, |b| {
        let t = along - node as f64;
        (a.0 * (1.0 - t) + b.0 * t, a.1.lerp(b.1, t))
    }))
}

/// Where a ray first meets a surface, and the key that shows it: the nearest in time, or the next that sees
/// what the ray meets.
#[must_use]
pub fn first_surface_of_keys(
    uv: DVec2,
    share: f64,
    keys: &Keys<'_>,
    ideal: &IdealGeometry,
) -> Option<(usize, Met)> {
    let window_share = keys.line_share + (share - 0.5) * keys.exposure_share;
    let mut first = None;
    for rank in 0..keys.views.len() {
        let key = key_of_rank(window_share, keys.views.len(), rank);
        let view = keys.views.get(key)?;
        let met = first_surface(uv, pose_along(view.nodes, share)?, keys.nearest_w, &view.image, ideal);
        if met.seen {
            return Some((key, met));
        }
        first = first.or(Some((key, met)));
    }
    first
}

/// Where a ray first meets a surface of the ideal frame. Its points, from the nearest surface of all
/// (`nearest_w` in the key camera, 1/m) to infinity, lie on a line of the ideal frame: as long as they are
/// nearer than what the key shows at their places the ray is free. Where it is free no longer and the depths
/// to both sides are one, it meets a surface. Where they are not, it passes behind something; if it is still
/// hidden when it gets as deep as what was seen last, it has met what the key camera does not see, and what
/// was seen last stands in.
#[must_use]
pub fn first_surface(
    uv: DVec2,
    key_from_line: (DMat3, DVec3),
    nearest_w: f64,
    image: &FineImage<'_>,
    ideal: &IdealGeometry,
) -> Met {
    let (rotation, shift) = key_from_line;
    let direction = rotation * uv.extend(1.0);
    let in_line = |in_key: f64| in_key * direction.z / (1.0 - shift.z * in_key).max(1e-3);
    let place = |w: f64| ideal.px_from_point(direction + w * shift);
    // Place, and the inverse depth that the line's camera gives to what the key shows there.
    let look_at = |w: f64| {
        let at_px = place(w);
        (at_px, in_line(image.inverse_depth(at_px)))
    };
    // A camera that all but reaches the nearest surface would stretch the search without end.
    let w_near = in_line(1.02 * nearest_w).min(4.0 * 1.02 * nearest_w);
    let (far_px, at_infinity) = look_at(0.0);
    let length_px = place(w_near).distance(far_px);
    let px_per_w = length_px / w_near.max(1e-12);
    if length_px < GAP_PX {
        // Nothing hides: one step from the far end.
        let (at_px, found) = look_at(at_infinity);
        return Met { at_px, in_line: found, seen: true };
    }
    // A ray that is free at two looks, the second deeper than what the first saw, may have met that in
    // between: it has if the surface goes on to where the ray is as deep.
    let met_before = |free: (DVec2, f64)| {
        let (at_px, found) = look_at(free.1);
        let goes_on = (free.1 - found).abs() * px_per_w < GAP_PX && ideal.contains(at_px);
        goes_on.then_some(Met { at_px, in_line: found, seen: true })
    };
    let looks = (length_px / LOOK_PX).ceil().clamp(1.0, MAX_LOOKS) as u32;
    let (mut free, mut free_w) = (look_at(w_near), w_near);
    let mut hidden = false;
    for i in 1..=looks {
        let w = w_near * (1.0 - f64::from(i) / f64::from(looks));
        let here = look_at(w);
        if w > here.1 {
            if w <= free.1 {
                if hidden {
                    break;
                }
                if let Some(met) = met_before(free) {
                    return met;
                }
            }
            (free, free_w, hidden) = (here, w, false);
            continue;
        }
        if !hidden {
            let (mut behind, mut behind_w) = (here, w);
            for _ in 0..HALVINGS {
                let between_w = 0.5 * (free_w + behind_w);
                let between = look_at(between_w);
                if between_w > between.1 {
                    if between_w <= free.1
                        && let Some(met) = met_before(free)
                    {
                        return met;
                    }
                    (free, free_w) = (between, between_w);
                } else {
                    (behind, behind_w) = (between, between_w);
                }
            }
            if (behind.1 - free.1) * px_per_w < GAP_PX {
                return Met { at_px: free.0, in_line: free.1, seen: ideal.contains(free.0) };
            }
            hidden = true;
        }
        if w <= free.1 {
            break;
        }
    }
    Met { at_px: free.0, in_line: free.1, seen: false }
}

/// Mean colour of `count` rays over the area of a pixel (centre `uv`, `d_uv` = its change along x and y) and
/// over the exposure.
#[must_use]
pub fn gather_edges(
    uv: DVec2,
    d_uv: [DVec2; 2],
    keys: &Keys<'_>,
    count: u32,
    ideal: &IdealGeometry,
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    for i in 0..count {
        let (place, share) = ray_place(i, count);
        let ray = uv + place.x * d_uv[0] + place.y * d_uv[1];
        if let Some((key, met)) = first_surface_of_keys(ray, share, keys, ideal) {
            sum += keys.views[key].image.color(met.at_px);
        }
    }
    sum / f64::from(count.max(1))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::temporal::{fine::Centre, marks::marks};

    const IDEAL: IdealGeometry = IdealGeometry {
        size_px: [80, 20],
        focal_px: DVec2::splat(60.0),
        principal_px: DVec2::new(39.5, 9.5),
    };
    const ROOF: f64 = 1.0 / 20.0;
    const GROUND: f64 = 1.0 / 60.0;

    /// A white roof to the left of the plane x = 0, 20 m before the camera, over black ground 60 m before it.
    fn image(scale: u32) -> Drawn {
        draw(scale, |at_px| {
            let roof = at_px.x < IDEAL.principal_px.x;
            Centre {
                inverse_depth: if roof { ROOF } else { GROUND },
                color: if roof { DVec3::ONE } else { DVec3::ZERO },
            }
        })
    }

    struct Drawn {
        scale: u32,
        samples: Vec<f64>,
        centres: Vec<Centre>,
        marks: Vec<bool>,
    }

    impl Drawn {
        fn image(&self) -> FineImage<'_> {
            FineImage {
                size_px: IDEAL.size_px,
                scale: self.scale,
                samples: &self.samples,
                sample_colors: &[],
                centres: &self.centres,
                marks: &self.marks,
                lines: &[],
            }
        }
    }

    fn draw(scale: u32, look: impl Fn(DVec2) -> Centre) -> Drawn {
        let corners = |[width, height]: [u32; 2]| {
            (0..width * height).map(move |i| DVec2::new(f64::from(i % width), f64::from(i / width)))
        };
        let fine = corners(IDEAL.size_px.map(|side| side * scale)).flat_map(|corner| {
            FineImage::SAMPLE_PLACES.map(|place| (corner + place) / f64::from(scale) - 0.5)
        });
        let samples: Vec<f64> = fine.map(|at_px| look(at_px).inverse_depth).collect();
        let centres: Vec<Centre> = corners(IDEAL.size_px).map(&look).collect();
        let marks = marks(IDEAL.size_px, scale, &centres, &samples);
        Drawn { scale, samples, centres, marks }
    }

    #[test]
    fn rays_meet_the_nearest_surface_and_holes_show_the_farther_one() {
        let drawn = image(2);
        let image = drawn.image();
        for shift_m in [-1.5, -0.4, -0.02, 0.0, 0.02, 0.4, 1.5] {
            let pose = (DMat3::IDENTITY, DVec3::new(shift_m, 0.0, 0.0));
            for k in -400..=400 {
                let u = f64::from(k) * 1e-3;
                // From x = shift, the roof's border at x = 0 and 20 m is seen at u = -shift / 20.
                let border_px = (u + shift_m * ROOF) * IDEAL.focal_px.x;
                // Samples stand up to a quarter of a pixel from where the ray asks.
                if border_px.abs() < 0.3 {
                    continue;
                }
                let met = first_surface(DVec2::new(u, 0.01), pose, ROOF, &image, &IDEAL);
                let at_px = met.at_px;
                let seen = image.inverse_depth(at_px);
                let roof = border_px < 0.0;
                assert_eq!(seen, if roof { ROOF } else { GROUND }, "shift {shift_m}, u {u}: {at_px}");
                let exact_px = (u + shift_m * seen) * IDEAL.focal_px.x + IDEAL.principal_px.x;
                // Under the roof, and deep enough under it to tell: said to be so.
                let under_px = IDEAL.principal_px.x - exact_px;
                let hidden = !roof && under_px > -0.3;
                assert!(
                    hidden || (at_px.x - exact_px).abs() <= LOOK_PX / 32.0 + 1e-9,
                    "shift {shift_m}, u {u}: {at_px} {exact_px}"
                );
                assert!(
                    met.seen != (hidden && under_px > 0.3) || under_px.abs() <= 0.3,
                    "shift {shift_m}, u {u}: {met:?} {under_px}"
                );
                assert_eq!(met.in_line, seen);
            }
        }
    }

    #[test]
    fn a_pixel_across_a_border_gets_its_share() {
        let drawn = image(2);
        let image = drawn.image();
        let pixel = 1.0 / IDEAL.focal_px.x;
        let of = |nodes: &[(DMat3, DVec3)], uv: DVec2| {
            let views = [KeyView { nodes, image }];
            let keys = Keys { views: &views, line_share: 0.5, exposure_share: 1.0, nearest_w: ROOF };
            gather_edges(uv, [DVec2::new(pixel, 0.0), DVec2::new(0.0, pixel)], &keys, 64, &IDEAL)
        };
        let still = [(DMat3::IDENTITY, DVec3::ZERO)];
        for tenth in -5..=5 {
            let uv = DVec2::new(f64::from(tenth) * 0.1 * pixel, 0.0);
            let found = of(&still, uv);
            let share = 0.5 - f64::from(tenth) * 0.1;
            // Eight columns of samples a pixel.
            assert!((found.x - share).abs() < 0.13, "{tenth}: {found} {share}");
        }
        // The border runs over two pixels within the exposure.
        let moving = [-1.0, 1.0].map(|px| (DMat3::IDENTITY, DVec3::new(px * pixel / ROOF, 0.0, 0.0)));
        let found = of(&moving, DVec2::ZERO);
        assert!((found.x - 0.5).abs() < 0.05, "{found}");
    }

    #[test]
    fn a_second_key_shows_what_the_first_hides() {
        // As `image`, but the ground's colour is its place: the key at x = 1.5 m sees 3 px more of it beside
        // the roof.
        let ground_m =
            |at_px: DVec2, key_m: f64| (at_px.x - IDEAL.principal_px.x) / IDEAL.focal_px.x / GROUND + key_m;
        let seen_from = |key_m: f64| {
            draw(2, |at_px| {
                let roof = (at_px.x - IDEAL.principal_px.x) / IDEAL.focal_px.x < -key_m * ROOF;
                let w = if roof { ROOF } else { GROUND };
                Centre {
                    inverse_depth: w,
                    color: if roof { DVec3::splat(-100.0) } else { DVec3::splat(ground_m(at_px, key_m)) },
                }
            })
        };
        let keys_m = [-1.5, 1.5];
        let images = keys_m.map(seen_from);
        // The line's camera stands at x = 1.2 m, nearer in time to the first key.
        let nodes = keys_m.map(|key_m| [(DMat3::IDENTITY, DVec3::new(1.2 - key_m, 0.0, 0.0))]);
        let views = [0, 1].map(|k| KeyView { nodes: &nodes[k], image: images[k].image() });
        let mut filled = 0;
        for k in -60..200 {
            let u = f64::from(k) * 2e-3;
            let (border_u, ground_m) = (-1.2 * ROOF, 1.2 + u / GROUND);
            if (u - border_u).abs() * IDEAL.focal_px.x < 0.3 {
                continue;
            }
            let expected = if u < border_u { -100.0 } else { ground_m };
            let color = |views: &[KeyView<'_>]| {
                let keys = Keys { views, line_share: 0.1, exposure_share: 0.0, nearest_w: ROOF };
                let (key, met) = first_surface_of_keys(DVec2::new(u, 0.0), 0.5, &keys, &IDEAL).unwrap();
                (views[key].image.color(met.at_px).x - expected).abs()
            };
            let (one, two) = (color(&views[..1]), color(&views));
            // Beside the roof the colour of the last pixel of the ground stands for what is up to a pixel
            // away.
            assert!(two <= 1.0 / IDEAL.focal_px.x / GROUND, "{u}: {two}");
            filled += u32::from(one > 1.0);
        }
        assert!(filled > 20, "one key must not suffice: {filled}");
    }

    #[test]
    fn keys_come_in_the_order_of_their_distance() {
        let order = |share: f64, count: usize| {
            (0..count).map(|rank| key_of_rank(share, count, rank)).collect::<Vec<_>>()
        };
        assert_eq!(order(0.1, 2), [0, 1]);
        assert_eq!(order(0.9, 2), [1, 0]);
        assert_eq!(order(0.5, 2), [0, 1]);
        assert_eq!(order(0.3, 4), [1, 0, 2, 3]);
        assert_eq!(order(-3.0, 3), [0, 1, 2]);
    }

    #[test]
    fn rays_are_even_over_area_and_time() {
        for count in [16, 32, 64, 256] {
            let places: Vec<_> = (0..count).map(|i| ray_place(i, count)).collect();
            for of in [|p: &(DVec2, f64)| p.0.x + 0.5, |p: &(DVec2, f64)| p.0.y + 0.5, |p: &(DVec2, f64)| p.1]
            {
                let mut values: Vec<f64> = places.iter().map(of).collect();
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
    fn a_ray_that_is_not_a_number_has_some_place() {
        let drawn = image(1);
        let image = drawn.image();
        for uv in [DVec2::NAN, DVec2::splat(f64::INFINITY), DVec2::splat(1e300)] {
            let at_px = first_surface(uv, (DMat3::IDENTITY, DVec3::splat(0.5)), ROOF, &image, &IDEAL).at_px;
            let _ = image.color(at_px);
        }
    }
}
