//! A picture of emitted light on top of a base colour, as one picture.

use std::sync::Arc;

use camsim_core::scene::{Encoding, Shape, Texture, Wrap, linear_from_srgb, srgb_from_linear};

use super::material::UvRule;

/// A picture and how it is read.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    pub texture: Arc<Texture>,
    pub wrap: [Wrap; 2],
    pub nearest: bool,
    /// Where it lies.
    pub rule: UvRule,
    /// Linear light of each byte.
    light: Arc<[f32; 256]>,
}

impl Layer {
    pub fn new(texture: Arc<Texture>, wrap: [Wrap; 2], nearest: bool, rule: UvRule) -> Self {
        let stored = |byte: usize| byte as f32 / 255.0;
        let is_srgb = texture.encoding == Encoding::Srgb;
        let light =
            std::array::from_fn(|byte| if is_srgb { linear_from_srgb(stored(byte)) } else { stored(byte) });
        Self { texture, wrap, nearest, rule, light: Arc::new(light) }
    }

    /// Linear light and alpha of a texel.
    fn texel(&self, index: usize) -> [f32; 4] {
        let byte = |k: usize| self.texture.rgba8.get(4 * index + k).copied().unwrap_or_default();
        let light = |k: usize| self.light[usize::from(byte(k))];
        [light(0), light(1), light(2), f32::from(byte(3)) / 255.0]
    }

    /// The same at texture coordinates, as they are shown at full size.
    fn at(&self, uv: [f64; 2]) -> [f32; 4] {
        let size = self.texture.size_px;
        let texel = |x: f64, y: f64| {
            self.texel(self.wrap[1].texel(y, size[1]) * size[0] as usize + self.wrap[0].texel(x, size[0]))
        };
        let [x, y] = [0, 1].map(|k| uv[k] * f64::from(size[k]));
        if self.nearest {
            return texel(x.floor(), y.floor());
        }
        let [x, y] = [x - 0.5, y - 0.5];
        let (share_x, share_y) = ((x - x.floor()) as f32, (y - y.floor()) as f32);
        let row = |y: f64| mix(texel(x.floor(), y), texel(x.floor() + 1.0, y), share_x);
        mix(row(y.floor()), row(y.floor() + 1.0), share_y)
    }
}

fn mix(a: [f32; 4], b: [f32; 4], share: f32) -> [f32; 4] {
    std::array::from_fn(|k| a[k] + share * (b[k] - a[k]))
}

/// sRGB of base light times its factor plus emitted light; more than white is white.
fn stored(base: [f32; 4], factor: [f32; 3], light: [f32; 4], emitted: [f32; 3]) -> [u8; 4] {
    let byte = |value: f32| (255.0 * value.clamp(0.0, 1.0)).round() as u8;
    let color =
        |k: usize| byte(srgb_from_linear((factor[k] * base[k] + emitted[k] * light[k]).clamp(0.0, 1.0)));
    [color(0), color(1), color(2), byte(base[3])]
}

/// `base` times its factor plus `light` times its own, of two pictures that lie and are read alike; alpha is
/// the base's. Of pictures of different size the finer counts, along each side.
pub(super) fn on_top(base: &Layer, base_factor: [f32; 3], light: &Layer, emitted: [f32; 3]) -> Texture {
    let size_px: [u32; 2] = std::array::from_fn(|k| base.texture.size_px[k].max(light.texture.size_px[k]));
    let mut rgba8 = Vec::with_capacity(4 * size_px[0] as usize * size_px[1] as usize);
    for y in 0..size_px[1] {
        for x in 0..size_px[0] {
            let uv =
                [(f64::from(x) + 0.5) / f64::from(size_px[0]), (f64::from(y) + 0.5) / f64::from(size_px[1])];
            let index = y as usize * size_px[0] as usize + x as usize;
            let of = |layer: &Layer| {
                if layer.texture.size_px == size_px { layer.texel(index) } else { layer.at(uv) }
            };
            rgba8.extend(stored(of(base), base_factor, of(light), emitted));
        }
    }
    Texture { size_px, rgba8, encoding: Encoding::Srgb }
}

/// A base colour with a picture of emitted light that lies otherwise.
#[derive(Clone, Debug)]
pub(super) struct Bake {
    pub base: Layer,
    pub light: Layer,
    /// Of the emitted light.
    pub emitted: [f32; 3],
}

/// Texels of a side, and of a picture, that a bake may have.
const MOST_SIDE: usize = 8192;
const MOST_TEXELS: usize = 1 << 24;
/// Parts of a layout's texel that a bake may have along a side.
const FINEST: f64 = 8.0;
/// Share of the texels that two triangles may disagree about: those along their edges.
const MOST_CONFLICTS: f64 = 2e-3;
/// Difference of colours that is none, of 255.
const SAME: u8 = 3;

/// A shape under one picture of both.
pub(super) struct Baked {
    pub shape: Shape,
    pub texture: Texture,
    /// The picture is coarser than the finer of the two, this many times.
    pub coarser: f64,
}

/// Brings both pictures into the layout of one of them, in which each place of the surface has a place of its
/// own: `None` where neither has, or where that takes more than `most_texels`.
pub(super) fn bake(shape: &Shape, light_uvs: &[[f32; 2]], of: &Bake, most_texels: usize) -> Option<Baked> {
    let base_uvs: Vec<[f32; 2]> = shape.vertices.iter().map(|vertex| vertex.uv).collect();
    let layout = |uvs: &[[f32; 2]], by: &Layer| {
        uvs.iter()
            .map(|uv| [0, 1].map(|k: usize| f64::from(uv[k]) * f64::from(by.texture.size_px[k])))
            .collect()
    };
    let (base, light): (Vec<_>, Vec<_>) = (layout(&base_uvs, &of.base), layout(light_uvs, &of.light));
    let most = most_texels.min(MOST_TEXELS);
    in_layout(shape, [&light, &base], [&base, &light], of, most)
        .or_else(|| in_layout(shape, [&base, &light], [&base, &light], of, most))
}

/// Texel coordinates of each corner.
type Texels = [[f64; 2]];

fn in_layout(
    shape: &Shape,
    [layout, other]: [&Texels; 2],
    [base, light]: [&Texels; 2],
    of: &Bake,
    most_texels: usize,
) -> Option<Baked> {
    let wanted = triangles(shape)
        .map(|corners| finer(corners.map(|i| layout[i]), corners.map(|i| other[i])))
        .try_fold(1.0_f64, |most, ratio| ratio.map(|ratio| most.max(ratio)))?;
    let [low, high] = bounds(layout)?;
    let mut parts = (wanted - 0.05).ceil().clamp(1.0, FINEST);
    // A texel more on each side, for what lies on the border.
    let size = |parts: f64| [0, 1].map(|k: usize| (((high[k] - low[k]) + 2.0) * parts) as usize);
    let fits = |[w, h]: [usize; 2]| w <= MOST_SIDE && h <= MOST_SIDE && w.saturating_mul(h) <= most_texels;
    while !fits(size(parts)) {
        parts -= 1.0;
        if parts < 1.0 {
            return None;
        }
    }
    let from = low.map(|low| low - 1.0);
    let mut canvas = Canvas::new(size(parts));
    for corners in triangles(shape) {
        let place = corners.map(|i| [0, 1].map(|k: usize| (layout[i][k] - from[k]) * parts));
        canvas.fill(place, |shares| {
            let along = |texels: &Texels, size: [u32; 2]| {
                [0, 1].map(|k: usize| {
                    (0..3).map(|corner| shares[corner] * texels[corners[corner]][k]).sum::<f64>()
                        / f64::from(size[k])
                })
            };
            let tint = std::array::from_fn(|k| {
                (0..3).map(|corner| shares[corner] as f32 * shape.vertices[corners[corner]].tint[k]).sum()
            });
            let (below, above) = (
                of.base.at(along(base, of.base.texture.size_px)),
                of.light.at(along(light, of.light.texture.size_px)),
            );
            stored(below, tint, above, of.emitted)
        });
    }
    if canvas.conflicts as f64 > MOST_CONFLICTS * canvas.covered as f64 {
        return None;
    }
    let side = canvas.size.map(|side| side as f64);
    let mut shape = shape.clone();
    for (vertex, at) in shape.vertices.iter_mut().zip(layout) {
        vertex.uv = [0, 1].map(|k| ((at[k] - from[k]) * parts / side[k]) as f32);
        vertex.tint = [1.0, 1.0, 1.0, vertex.tint[3]];
    }
    Some(Baked { shape, texture: canvas.finish(), coarser: wanted / parts })
}

fn triangles(shape: &Shape) -> impl Iterator<Item = [usize; 3]> + '_ {
    shape.indices.chunks_exact(3).map(|t| [t[0] as usize, t[1] as usize, t[2] as usize])
}

fn bounds(layout: &Texels) -> Option<[[f64; 2]; 2]> {
    let low = [0, 1].map(|k| layout.iter().fold(f64::INFINITY, |low, at| low.min(at[k])).floor());
    let high = [0, 1].map(|k| layout.iter().fold(f64::NEG_INFINITY, |high, at| high.max(at[k])).ceil());
    low.iter().chain(&high).all(|at| at.is_finite()).then_some([low, high])
}

fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// How many texels of the other picture lie along one of the layout's, at most; `None` where the layout has
/// no area for what the other has.
fn finer([a, b, c]: [[f64; 2]; 3], [p, q, r]: [[f64; 2]; 3]) -> Option<f64> {
    let area = cross(a, b, c);
    if area.abs() < 1e-6 {
        return (cross(p, q, r).abs() < 1e-6).then_some(1.0);
    }
    let along = |k: usize| {
        let (u, v) = (q[k] - p[k], r[k] - p[k]);
        let x = (u * (c[1] - a[1]) - v * (b[1] - a[1])) / area;
        let y = (v * (b[0] - a[0]) - u * (c[0] - a[0])) / area;
        [x, y]
    };
    let ([xx, xy], [yx, yy]) = (along(0), along(1));
    // The larger singular value.
    let (sum, det) = (xx * xx + xy * xy + yx * yx + yy * yy, xx * yy - xy * yx);
    Some((0.5 * (sum + (sum * sum - 4.0 * det * det).max(0.0).sqrt())).sqrt())
}

/// A picture that triangles are drawn into.
struct Canvas {
    size: [usize; 2],
    rgba8: Vec<[u8; 4]>,
    is_covered: Vec<bool>,
    covered: usize,
    /// Texels that two triangles gave different colours.
    conflicts: usize,
}

impl Canvas {
    fn new(size: [usize; 2]) -> Self {
        let texels = size[0] * size[1];
        Self { size, rgba8: vec![[0; 4]; texels], is_covered: vec![false; texels], covered: 0, conflicts: 0 }
    }

    /// Every texel whose middle is within a triangle; of an edge between two, within one of them. `color`
    /// takes the corners' shares.
    fn fill(&mut self, [a, b, c]: [[f64; 2]; 3], color: impl Fn([f64; 3]) -> [u8; 4]) {
        let area = cross(a, b, c);
        if area == 0.0 {
            return;
        }
        let turn = area.signum();
        let range = |k: usize| {
            let (low, high) = (a[k].min(b[k]).min(c[k]) - 0.5, a[k].max(b[k]).max(c[k]) + 0.5);
            low.max(0.0) as usize..(high.max(0.0) as usize + 1).min(self.size[k])
        };
        // An edge is of the triangle on one side of it: the same whichever way it is gone along.
        let inside = |from: [f64; 2], to: [f64; 2], at: [f64; 2]| {
            let (side, [dx, dy]) =
                (turn * cross(from, to, at), [turn * (to[0] - from[0]), turn * (to[1] - from[1])]);
            side > 0.0 || (side == 0.0 && (dy < 0.0 || (dy == 0.0 && dx > 0.0)))
        };
        let (columns, rows) = (range(0), range(1));
        for y in rows {
            for x in columns.clone() {
                let at = [x as f64 + 0.5, y as f64 + 0.5];
                if !(inside(a, b, at) && inside(b, c, at) && inside(c, a, at)) {
                    continue;
                }
                let (of_a, of_b) = (cross(b, c, at) / area, cross(c, a, at) / area);
                let found = color([of_a, of_b, 1.0 - of_a - of_b]);
                let texel = y * self.size[0] + x;
                if self.is_covered[texel] {
                    let known = self.rgba8[texel];
                    self.conflicts += usize::from((0..4).any(|k| known[k].abs_diff(found[k]) > SAME));
                } else {
                    self.is_covered[texel] = true;
                    self.covered += 1;
                    self.rgba8[texel] = found;
                }
            }
        }
    }

    /// What no triangle covers is as the nearest that one does: reads at borders and from smaller versions
    /// take it in.
    fn finish(mut self) -> Texture {
        let [width, height] = self.size;
        let beside = |at: usize| {
            let (x, y) = (at % width, at / width);
            let of = [
                (x > 0).then(|| at - 1),
                (x + 1 < width).then_some(at + 1),
                (y > 0).then(|| at - width),
                (y + 1 < height).then_some(at + width),
            ];
            of.into_iter().flatten()
        };
        let is_border = |at: usize| self.is_covered[at] && beside(at).any(|to| !self.is_covered[to]);
        let mut front: Vec<usize> = (0..self.rgba8.len()).filter(|&at| is_border(at)).collect();
        while !front.is_empty() {
            let mut next = Vec::new();
            for at in front {
                for to in beside(at) {
                    if !self.is_covered[to] {
                        self.is_covered[to] = true;
                        self.rgba8[to] = self.rgba8[at];
                        next.push(to);
                    }
                }
            }
            front = next;
        }
        Texture {
            size_px: [width as u32, height as u32],
            rgba8: self.rgba8.into_flattened(),
            encoding: Encoding::Srgb,
        }
    }
}

#[cfg(test)]
mod tests;
