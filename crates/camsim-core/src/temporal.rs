//! Temporal inverse and gather: from an output ray and an instant to the source in the ideal frame, and the
//! mean colour over the exposure (section 6 of the paper).
//!
//! These functions are the f64 twins of `camsim-gpu/shaders/reverse/temporal_inverse/reproject.wgsl` and
//! `camsim-gpu/shaders/reverse/gather/blur.wgsl`. The paper's own models are in [`displacement`] and
//! [`paper`].

use glam::{DMat3, DVec2, DVec3};

use crate::{camera::CameraModel, scenario::MAX_KEY_FRAMES};

pub mod displacement;
pub mod edge_lines;
pub mod edge_mask;
mod footprint;
mod multisample;
pub mod paper;
pub mod path;
pub mod silhouette_rays;
mod stages;
pub mod supersampled;

pub use footprint::{Footprint, Kernel, MAX_AREA_SIDE_PX, TENT_PX2, TapStage, tap_offsets};
pub use multisample::{SAMPLE_POSITIONS, SAMPLES, resolve_depth};
pub use stages::{NodeDepths, PathStage};

/// Largest number of ideal frames of one output frame.
pub const MAX_KEYS: u32 = MAX_KEY_FRAMES;

/// Geometry of an ideal frame: a pinhole camera at the key instant, off-axis, with no more pixels than the
/// output frame needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdealGeometry {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Focal lengths.
    pub focal_px: DVec2,
    /// Principal point, in pixels of this frame. It may lie outside of the frame.
    pub principal_px: DVec2,
}

impl IdealGeometry {
    /// Ideal pixels per camera pixel along a side, for a camera without distortion.
    #[must_use]
    pub fn scale(&self, camera: &CameraModel) -> f64 {
        self.focal_px.x / camera.focal_px.x
    }

    /// `[u_min, u_max, v_min, v_max]`: bounds of the pixel area as tangents u = x/z, v = y/z.
    #[must_use]
    pub fn tangents(&self) -> [f64; 4] {
        let size = DVec2::new(f64::from(self.size_px[0]), f64::from(self.size_px[1]));
        let low = (DVec2::splat(-0.5) - self.principal_px) / self.focal_px;
        let high = (size - 0.5 - self.principal_px) / self.focal_px;
        [low.x, high.x, low.y, high.y]
    }

    /// Pixel of a direction in key-camera coordinates. The length of the direction does not matter.
    #[must_use]
    pub fn px_from_point(&self, in_key: DVec3) -> DVec2 {
        self.focal_px * (in_key.truncate() / in_key.z) + self.principal_px
    }

    /// Whether a position lies within the pixel area of the frame.
    #[must_use]
    pub fn contains(&self, position_px: DVec2) -> bool {
        position_px.cmpge(DVec2::splat(-0.5)).all()
            && position_px.x <= f64::from(self.size_px[0]) - 0.5
            && position_px.y <= f64::from(self.size_px[1]) - 0.5
    }
}

/// A depth image of the ideal frame, inverse planar depth in 1/m, 0 = sky.
#[derive(Clone, Copy, Debug)]
pub struct InverseDepthImage<'a> {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Row-major values.
    pub values: &'a [f32],
}

impl InverseDepthImage<'_> {
    /// Inverse depth at a position: bilinear in 1/z, which is exact on planes, or that of the nearest texel
    /// where the four neighbours belong to different surfaces.
    #[must_use]
    pub fn inverse_depth(&self, position_px: DVec2) -> f64 {
        let last = DVec2::new(f64::from(self.size_px[0] - 1), f64::from(self.size_px[1] - 1));
        let clamped = position_px.clamp(DVec2::ZERO, last);
        let base = clamped.floor().min((last - 1.0).max(DVec2::ZERO));
        let t = clamped - base;
        let load = |dx: f64, dy: f64| {
            let (x, y) = ((base.x + dx).min(last.x) as usize, (base.y + dy).min(last.y) as usize);
            f64::from(self.values[y * self.size_px[0] as usize + x])
        };
        let (d00, d10, d01, d11) = (load(0.0, 0.0), load(1.0, 0.0), load(0.0, 1.0), load(1.0, 1.0));
        interpolate_inverse_depth([d00, d10, d01, d11], t)
    }

    /// Inverse depth of the nearest texel; positions outside take the border texel.
    #[must_use]
    pub fn nearest(&self, position_px: DVec2) -> f64 {
        f64::from(self.values[self.nearest_index(position_px)])
    }

    /// Index of the nearest texel in `values`; positions outside take the border texel.
    #[must_use]
    pub(crate) fn nearest_index(&self, position_px: DVec2) -> usize {
        let last = DVec2::new(f64::from(self.size_px[0] - 1), f64::from(self.size_px[1] - 1));
        let texel = (position_px + 0.5).floor().clamp(DVec2::ZERO, last);
        texel.y as usize * self.size_px[0] as usize + texel.x as usize
    }

    /// Difference between the largest and the smallest of the four texels around a position.
    #[must_use]
    pub fn spread(&self, position_px: DVec2) -> f64 {
        let corners = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]
            .map(|half| self.nearest(position_px + DVec2::from_array(half)));
        let [a, b, c, d] = corners;
        a.max(b).max(c).max(d) - a.min(b).min(c).min(d)
    }
}

/// Inverse depth between four texels (top left, top right, bottom left, bottom right). `t` is the position
/// within the cell, 0 to 1 to the right and down. The result is bilinear where the four belong to one
/// surface, and that of the nearest texel elsewhere.
#[must_use]
pub fn interpolate_inverse_depth([d00, d10, d01, d11]: [f64; 4], t: DVec2) -> f64 {
    let low = d00.min(d10).min(d01).min(d11);
    let high = d00.max(d10).max(d01).max(d11);
    if low > 0.9 * high {
        let top = d00 + t.x * (d10 - d00);
        let bottom = d01 + t.x * (d11 - d01);
        top + t.y * (bottom - top)
    } else {
        match (t.x > 0.5, t.y > 0.5) {
            (false, false) => d00,
            (true, false) => d10,
            (false, true) => d01,
            (true, true) => d11,
        }
    }
}

/// Distance from a surface within which sky pixels are reprojected with the depth of that surface, in camera
/// pixels. It covers the reach of the gather's taps and the displacement of the surface during the iteration.
pub const SKY_REACH_PX: f64 = 2.0;

/// Directions in which a surface is searched around a position that shows the sky.
const SKY_DIRECTIONS: [DVec2; 8] = {
    const SIDE: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        DVec2::new(1.0, 0.0),
        DVec2::new(SIDE, SIDE),
        DVec2::new(0.0, 1.0),
        DVec2::new(-SIDE, SIDE),
        DVec2::new(-1.0, 0.0),
        DVec2::new(-SIDE, -SIDE),
        DVec2::new(0.0, -1.0),
        DVec2::new(SIDE, -SIDE),
    ]
};

/// An ideal frame as the temporal inverse reads it.
#[derive(Clone, Copy, Debug)]
pub struct KeyDepth<'a> {
    /// Geometry of the frame.
    pub ideal: &'a IdealGeometry,
    /// Inverse depth of the frame.
    pub depth: &'a InverseDepthImage<'a>,
    /// Plane that supplies the first guess of the depth: its inverse planar depth is the dot product with (u,
    /// v, 1), in 1/m. A zero vector is infinitely far.
    pub plane: DVec3,
    /// [`SKY_REACH_PX`] in pixels of the ideal frame, or 0 to switch that rule off.
    pub sky_reach_px: f64,
}

impl KeyDepth<'_> {
    /// Inverse depth of the surface at the last look-up, 1/m. If that look-up finds the sky, the nearest
    /// surface within `sky_reach_px` replaces it. The sky has one colour, so it may be read anywhere; a pixel
    /// beside a surface then stays beside that surface in the ideal frame, and the taps mix the two in the
    /// right proportion.
    fn surface_at(&self, position_px: DVec2) -> f64 {
        let inverse_depth = self.depth.inverse_depth(position_px);
        if inverse_depth > 0.0 {
            return inverse_depth;
        }
        SKY_DIRECTIONS
            .iter()
            .map(|direction| self.depth.nearest(position_px + self.sky_reach_px * *direction))
            .fold(0.0, f64::max)
    }
}

/// Source of an output ray in the ideal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Position, ideal pixels.
    pub position_px: DVec2,
    /// Inverse planar depth in the camera of the output row, 1/m; 0 is sky.
    pub inverse_depth: f64,
}

/// Temporal inverse with the exact relative pose and depth by fixed-point iteration. `None` if the point is
/// behind the key camera or outside of the ideal frame.
///
/// A point at planar depth z on the ray d = (u, v, 1) is `z (R d + w t)` in the key camera, with w = 1/z. The
/// inverse depth w_key of the key frame at that point gives `w = w_key (R d)_z / (1 - t_z w_key)`. Each
/// look-up multiplies the error by `(parallax px) |grad w| / w`. The first guess comes from the plane in
/// `key`.
#[must_use]
pub fn reproject(
    uv: DVec2,
    key_from_row: (DMat3, DVec3),
    iterations: u32,
    key: &KeyDepth<'_>,
) -> Option<Source> {
    source_at(uv, key_from_row, iterate_depth(uv, key_from_row, None, iterations, key).on_row, key.ideal)
}

/// Sources at the nodes of an exposure. `nodes` are the poses of the row's camera relative to the key, in
/// order of time; `mid` is the pose at mid-exposure.
#[must_use]
pub fn reproject_nodes(
    uv: DVec2,
    nodes: &[(DMat3, DVec3)],
    mid: (DMat3, DVec3),
    depths: NodeDepths,
    iterations: u32,
    key: &KeyDepth<'_>,
) -> Vec<Option<Source>> {
    let look_up = |node: Option<usize>, guess: Option<f64>| {
        let iterations = if guess.is_some() { iterations.max(2) - 1 } else { iterations };
        iterate_depth(uv, node.map_or(mid, |node| nodes[node]), guess, iterations, key).in_key
    };
    let mut sources = Vec::with_capacity(nodes.len());
    depths.of_nodes(nodes.len(), look_up, |node, in_key| {
        sources.push(reproject_with(uv, nodes[node], in_key, key.ideal));
    });
    sources
}

/// The parabola through three values at 0, 1/2 and 1.
pub fn parabola_through([begin, middle, end]: [f64; 3]) -> impl Fn(f64) -> f64 {
    let slope = 4.0 * middle - 3.0 * begin - end;
    let bend = 2.0 * begin + 2.0 * end - 4.0 * middle;
    move |fraction| begin + fraction * (slope + fraction * bend)
}

/// Source of a ray whose surface has inverse depth `key_inverse_depth` (1/m) in the key frame: the last step
/// of [`reproject`].
#[must_use]
pub fn reproject_with(
    uv: DVec2,
    key_from_row: (DMat3, DVec3),
    key_inverse_depth: f64,
    ideal: &IdealGeometry,
) -> Option<Source> {
    let (rotation, shift) = key_from_row;
    let w = row_inverse_depth(rotation * uv.extend(1.0), shift, key_inverse_depth).unwrap_or(0.0);
    source_at(uv, key_from_row, w, ideal)
}

/// Inverse depths after the last look-up, 1/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IteratedDepth {
    /// In the key camera.
    pub in_key: f64,
    /// Of the same point on the ray of the output row.
    pub on_row: f64,
}

/// The fixed-point iteration of [`reproject`]. `guess` is a first inverse depth in the key frame, 1/m; without it the
/// iteration starts at the plane.
#[must_use]
pub fn iterate_depth(
    uv: DVec2,
    key_from_row: (DMat3, DVec3),
    guess: Option<f64>,
    iterations: u32,
    key: &KeyDepth<'_>,
) -> IteratedDepth {
    let (rotation, shift) = key_from_row;
    let direction = rotation * uv.extend(1.0);
    let on_row = match guess {
        Some(guess) => row_inverse_depth(direction, shift, guess).unwrap_or(0.0),
        None => plane_inverse_depth(direction, shift, key.plane),
    };
    let mut depth = IteratedDepth { in_key: guess.unwrap_or(0.0), on_row };
    for look in 1..=iterations {
        let position_px = key.ideal.px_from_point(direction + depth.on_row * shift);
        let in_key = if look < iterations {
            key.depth.inverse_depth(position_px)
        } else {
            key.surface_at(position_px)
        };
        depth = IteratedDepth {
            in_key,
            on_row: row_inverse_depth(direction, shift, in_key).unwrap_or(depth.on_row),
        };
    }
    depth
}

/// Source of the point at inverse depth `w` (1/m) on the ray of an output row.
fn source_at(uv: DVec2, key_from_row: (DMat3, DVec3), w: f64, ideal: &IdealGeometry) -> Option<Source> {
    let (rotation, shift) = key_from_row;
    let in_key = rotation * uv.extend(1.0) + w * shift;
    let position_px = ideal.px_from_point(in_key);
    (in_key.z > 0.0 && ideal.contains(position_px)).then_some(Source { position_px, inverse_depth: w })
}

/// Inverse depth at which the ray of an output row meets a plane, 1/m: `n . z (R d + w t) = 1` gives `w = n .
/// R d / (1 - n . t)`. It is 0 beyond the horizon of the plane, and where the row's camera is not in front of
/// the plane.
pub fn plane_inverse_depth(direction: DVec3, shift: DVec3, plane: DVec3) -> f64 {
    let before = 1.0 - plane.dot(shift);
    if before > 1e-3 { plane.dot(direction).max(0.0) / before } else { 0.0 }
}

/// Inverse depth on the ray of an output row of a surface with inverse depth `key_inverse_depth` in the key
/// frame. `None` at or behind the image plane of the row's camera.
#[must_use]
pub fn row_inverse_depth(direction: DVec3, shift: DVec3, key_inverse_depth: f64) -> Option<f64> {
    let scale = 1.0 - shift.z * key_inverse_depth;
    (scale > 1e-3).then(|| key_inverse_depth * direction.z / scale)
}

/// Number of exposure samples for a path of `length_px`: `min(a L, L + 16)`, at least `at_least` and at most
/// `cap`. With a = 2 the error stays below 1/255 on white texture (docs/accuracy/stress.md).
#[must_use]
pub fn samples_for(length_px: f64, samples_per_px: f64, at_least: u32, cap: u32) -> u32 {
    ((samples_per_px * length_px).min(length_px + 16.0).ceil() as u32).clamp(at_least, cap.max(at_least))
}

/// A linear colour image of the ideal frame.
#[derive(Clone, Copy, Debug)]
pub struct ColorImage<'a> {
    /// Width, height.
    pub size_px: [u32; 2],
    /// Row-major R G B A.
    pub rgba: &'a [f32],
}

impl ColorImage<'_> {
    /// Bilinear colour; positions outside take the border pixel.
    #[must_use]
    pub fn sample(&self, position_px: DVec2) -> DVec3 {
        let last = DVec2::new(f64::from(self.size_px[0] - 1), f64::from(self.size_px[1] - 1));
        let clamped = position_px.clamp(DVec2::ZERO, last);
        let base = clamped.floor();
        let t = clamped - base;
        let load = |dx: f64, dy: f64| {
            let (x, y) = ((base.x + dx).min(last.x) as usize, (base.y + dy).min(last.y) as usize);
            let i = 4 * (y * self.size_px[0] as usize + x);
            DVec3::new(f64::from(self.rgba[i]), f64::from(self.rgba[i + 1]), f64::from(self.rgba[i + 2]))
        };
        let top = load(0.0, 0.0).lerp(load(1.0, 0.0), t.x);
        let bottom = load(0.0, 1.0).lerp(load(1.0, 1.0), t.x);
        top.lerp(bottom, t.y)
    }

    /// Colour by a cubic spline, which blurs less than a bilinear read. Softness 0 is the Catmull-Rom spline;
    /// softness 1 is the cubic B-spline, whose variance is a third of a square pixel per axis; values between
    /// mix weights and variance. The four corners of the 4x4 pixels are skipped (at most 0.4 % each at
    /// softness 0, 0.8 % at 0.5). Overshoot is up to a tenth of the local contrast. Positions outside take
    /// the border pixel.
    #[must_use]
    pub fn spline(&self, position_px: DVec2, softness: DVec2) -> DVec3 {
        let base = position_px.floor();
        let f = position_px - base;
        let g = 1.0 - f;
        let mix = |sharp: DVec2, soft: DVec2| sharp + (soft - sharp) * softness;
        let w0 = mix(f * (-0.5 + f * (1.0 - 0.5 * f)), g * g * g / 6.0);
        let w1 = mix(1.0 + f * f * (-2.5 + 1.5 * f), (4.0 + f * f * (3.0 * f - 6.0)) / 6.0);
        let w2 = mix(f * (0.5 + f * (2.0 - 1.5 * f)), (4.0 + g * g * (3.0 * g - 6.0)) / 6.0);
        let w3 = mix(f * f * (-0.5 + 0.5 * f), f * f * f / 6.0);
        let w12 = w1 + w2;
        let (before, between, after) = (base - 1.0, base + w2 / w12, base + 2.0);
        let reads = [
            (w12.x * w12.y, between),
            (w12.x * w0.y, DVec2::new(between.x, before.y)),
            (w0.x * w12.y, DVec2::new(before.x, between.y)),
            (w3.x * w12.y, DVec2::new(after.x, between.y)),
            (w12.x * w3.y, DVec2::new(between.x, after.y)),
        ];
        let sum: DVec3 = reads.iter().map(|&(weight, at)| weight * self.sample(at)).sum();
        sum / reads.iter().map(|read| read.0).sum::<f64>()
    }

    /// Mean over a rectangle around a position, with pixels as squares of one colour. The sides along x and y
    /// are 1 pixel or more; with sides of 1 this is the bilinear read. Positions outside take the border
    /// pixel.
    #[must_use]
    pub fn over_area(&self, position_px: DVec2, sides_px: DVec2) -> DVec3 {
        let first = (position_px - 0.5 * (sides_px + 1.0)).floor() + 1.0;
        // Overlap of the pixel with the rectangle, as a fraction of the rectangle.
        let weight = |k: usize, px: f64| {
            (0.5 * (sides_px[k] + 1.0) - (px - position_px[k]).abs()).clamp(0.0, 1.0) / sides_px[k]
        };
        let count = [0, 1].map(|k: usize| (sides_px[k] + 1.0).ceil() as u32);
        let pixels = (0..count[1])
            .flat_map(|y| (0..count[0]).map(move |x| first + DVec2::new(f64::from(x), f64::from(y))));
        pixels.map(|px| weight(0, px.x) * weight(1, px.y) * self.sample(px)).sum()
    }
}

/// Mean colour over the exposure along the path through `nodes_px`, which are equally spaced in time. Each
/// polynomial of the path has its samples at the middles of equal parts of its time, and at most `cap` of
/// them.
#[must_use]
pub fn gather(
    nodes_px: &[DVec2],
    path: PathStage,
    area: &Footprint,
    color: &ColorImage<'_>,
    samples_per_px: f64,
    cap: u32,
) -> DVec3 {
    let taps = area.taps[0] * area.taps[1];
    if nodes_px.len() < 2 {
        let source_px = nodes_px.first().copied().unwrap_or_default();
        return (0..taps).map(|i| area.tap_color(color, source_px, i)).sum::<DVec3>() / f64::from(taps);
    }
    let curves = path::curves(nodes_px, path);
    let stretches = curves.len() as u32;
    let at_least = taps.div_ceil(stretches.max(1));
    let (mut sum, mut tap) = (DVec3::ZERO, 0);
    for curve in curves {
        let count = samples_for(curve.length_px, samples_per_px, at_least, cap);
        let mut part = DVec3::ZERO;
        for i in 0..count {
            let t = f64::from(path.steps()) * (f64::from(i) + 0.5) / f64::from(count);
            part += area.tap_color(color, curve.at(t), tap);
            tap += 1;
        }
        sum += part / f64::from(count);
    }
    sum / f64::from(stretches.max(1))
}

#[cfg(test)]
mod tests;
