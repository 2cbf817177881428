//! Bakes a base colour and an emissive texture that use different texture coordinates into one texture.

use camsim_core::scene::{Encoding, Shape, Texture};

use super::emissive::{Layer, stored_color};

/// A base colour and an emissive texture with different texture coordinates.
#[derive(Clone, Debug)]
pub(super) struct BakeInput {
    pub base: Layer,
    pub emissive: Layer,
    /// Factor of the emissive texture, linear red, green, blue.
    pub emissive_factor: [f32; 3],
}

/// Longest side of a baked texture, pixels.
const MAX_SIDE_PX: usize = 8192;
/// Largest baked texture, pixels.
const MAX_TEXELS: usize = 1 << 24;
/// Largest number of baked texels along a texel of the UV layout.
const MAX_SUBDIVISION: f64 = 8.0;
/// Fraction of the covered texels that two triangles may colour differently: those along their edges.
const MAX_CONFLICT_SHARE: f64 = 2e-3;
/// Largest difference of a channel that counts as the same colour, of 255.
const MAX_SAME_COLOR_DIFFERENCE: u8 = 3;

/// A shape with one texture for base colour and emissive light.
pub(super) struct Baked {
    pub shape: Shape,
    pub texture: Texture,
    /// How many times coarser the texture is than the finer of the two.
    pub coarser: f64,
}

/// Resamples both textures into the UV layout of one of them. `None` where triangles overlap in both layouts,
/// or where the texture would have more than `max_texels`.
pub(super) fn bake(
    shape: &Shape,
    emissive_uvs: &[[f32; 2]],
    input: &BakeInput,
    max_texels: usize,
) -> Option<Baked> {
    let base_uvs: Vec<[f32; 2]> = shape.vertices.iter().map(|vertex| vertex.uv).collect();
    let layout = |uvs: &[[f32; 2]], layer: &Layer| {
        uvs.iter()
            .map(|uv| [0, 1].map(|k: usize| f64::from(uv[k]) * f64::from(layer.texture.size_px[k])))
            .collect()
    };
    let (base, emissive): (Vec<_>, Vec<_>) =
        (layout(&base_uvs, &input.base), layout(emissive_uvs, &input.emissive));
    let max_texels = max_texels.min(MAX_TEXELS);
    bake_in_layout(shape, [&emissive, &base], [&base, &emissive], input, max_texels)
        .or_else(|| bake_in_layout(shape, [&base, &emissive], [&base, &emissive], input, max_texels))
}

/// Texel coordinates of each vertex.
type TexelCoordinates = [[f64; 2]];

/// Bakes in the UV layout `layout`; `other` is the layout of the other texture.
fn bake_in_layout(
    shape: &Shape,
    [layout, other]: [&TexelCoordinates; 2],
    [base, emissive]: [&TexelCoordinates; 2],
    input: &BakeInput,
    max_texels: usize,
) -> Option<Baked> {
    let wanted_subdivision = triangles(shape)
        .map(|corners| max_texel_ratio(corners.map(|i| layout[i]), corners.map(|i| other[i])))
        .try_fold(1.0_f64, |max, ratio| ratio.map(|ratio| max.max(ratio)))?;
    let [low, high] = bounds(layout)?;
    let mut subdivision = (wanted_subdivision - 0.05).ceil().clamp(1.0, MAX_SUBDIVISION);
    // One texel of margin on each side, for bilinear reads at the border.
    let size = |subdivision: f64| [0, 1].map(|k: usize| (((high[k] - low[k]) + 2.0) * subdivision) as usize);
    let fits = |[w, h]: [usize; 2]| w <= MAX_SIDE_PX && h <= MAX_SIDE_PX && w.saturating_mul(h) <= max_texels;
    while !fits(size(subdivision)) {
        subdivision -= 1.0;
        if subdivision < 1.0 {
            return None;
        }
    }
    let origin = low.map(|low| low - 1.0);
    let mut canvas = Canvas::new(size(subdivision));
    for corners in triangles(shape) {
        let corners_px = corners.map(|i| [0, 1].map(|k: usize| (layout[i][k] - origin[k]) * subdivision));
        canvas.fill_triangle(corners_px, |weights| {
            let interpolated = |texels: &TexelCoordinates, size: [u32; 2]| {
                [0, 1].map(|k: usize| {
                    (0..3).map(|corner| weights[corner] * texels[corners[corner]][k]).sum::<f64>()
                        / f64::from(size[k])
                })
            };
            let tint = std::array::from_fn(|k| {
                (0..3).map(|corner| weights[corner] as f32 * shape.vertices[corners[corner]].tint[k]).sum()
            });
            let (base_color, emissive_color) = (
                input.base.sample(interpolated(base, input.base.texture.size_px)),
                input.emissive.sample(interpolated(emissive, input.emissive.texture.size_px)),
            );
            stored_color(base_color, tint, emissive_color, input.emissive_factor)
        });
    }
    if canvas.conflicts as f64 > MAX_CONFLICT_SHARE * canvas.covered as f64 {
        return None;
    }
    let side = canvas.size.map(|side| side as f64);
    let mut shape = shape.clone();
    for (vertex, texel) in shape.vertices.iter_mut().zip(layout) {
        vertex.uv = [0, 1].map(|k| ((texel[k] - origin[k]) * subdivision / side[k]) as f32);
        vertex.tint = [1.0, 1.0, 1.0, vertex.tint[3]];
    }
    Some(Baked { shape, texture: canvas.finish(), coarser: wanted_subdivision / subdivision })
}

fn triangles(shape: &Shape) -> impl Iterator<Item = [usize; 3]> + '_ {
    shape.indices.chunks_exact(3).map(|t| [t[0] as usize, t[1] as usize, t[2] as usize])
}

/// Lowest and highest whole texel coordinates; `None` if one is not finite.
fn bounds(layout: &TexelCoordinates) -> Option<[[f64; 2]; 2]> {
    let low = [0, 1].map(|k| layout.iter().fold(f64::INFINITY, |low, texel| low.min(texel[k])).floor());
    let high = [0, 1].map(|k| layout.iter().fold(f64::NEG_INFINITY, |high, texel| high.max(texel[k])).ceil());
    low.iter().chain(&high).all(|bound| bound.is_finite()).then_some([low, high])
}

/// Twice the signed area of the triangle a, b, c.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Largest number of texels of the other texture along one texel of the layout, in a triangle whose corners
/// have texel coordinates `[a, b, c]` in the layout and `[p, q, r]` in the other texture. `None` where the
/// triangle has area in the other texture only.
fn max_texel_ratio([a, b, c]: [[f64; 2]; 3], [p, q, r]: [[f64; 2]; 3]) -> Option<f64> {
    let area = cross(a, b, c);
    if area.abs() < 1e-6 {
        return (cross(p, q, r).abs() < 1e-6).then_some(1.0);
    }
    let gradient = |k: usize| {
        let (u, v) = (q[k] - p[k], r[k] - p[k]);
        let x = (u * (c[1] - a[1]) - v * (b[1] - a[1])) / area;
        let y = (v * (b[0] - a[0]) - u * (c[0] - a[0])) / area;
        [x, y]
    };
    let ([xx, xy], [yx, yy]) = (gradient(0), gradient(1));
    // The larger singular value of the 2x2 Jacobian.
    let (sum, det) = (xx * xx + xy * xy + yx * yx + yy * yy, xx * yy - xy * yx);
    Some((0.5 * (sum + (sum * sum - 4.0 * det * det).max(0.0).sqrt())).sqrt())
}

/// A picture that triangles are rasterised into.
struct Canvas {
    size: [usize; 2],
    rgba8: Vec<[u8; 4]>,
    is_covered: Vec<bool>,
    /// Number of covered texels.
    covered: usize,
    /// Number of texels to which two triangles gave different colours.
    conflicts: usize,
}

impl Canvas {
    fn new(size: [usize; 2]) -> Self {
        let texels = size[0] * size[1];
        Self { size, rgba8: vec![[0; 4]; texels], is_covered: vec![false; texels], covered: 0, conflicts: 0 }
    }

    /// Colours the texels whose centre is inside the triangle; a centre on a shared edge belongs to one of
    /// the two triangles. `color` takes barycentric coordinates.
    fn fill_triangle(&mut self, [a, b, c]: [[f64; 2]; 3], color: impl Fn([f64; 3]) -> [u8; 4]) {
        let area = cross(a, b, c);
        if area == 0.0 {
            return;
        }
        let orientation = area.signum();
        let range = |k: usize| {
            let (low, high) = (a[k].min(b[k]).min(c[k]) - 0.5, a[k].max(b[k]).max(c[k]) + 0.5);
            low.max(0.0) as usize..(high.max(0.0) as usize + 1).min(self.size[k])
        };
        // A centre on an edge belongs to the triangle on one side of it, whatever the direction of the edge.
        let inside = |from: [f64; 2], to: [f64; 2], centre: [f64; 2]| {
            let (side, [dx, dy]) = (
                orientation * cross(from, to, centre),
                [orientation * (to[0] - from[0]), orientation * (to[1] - from[1])],
            );
            side > 0.0 || (side == 0.0 && (dy < 0.0 || (dy == 0.0 && dx > 0.0)))
        };
        let (columns, rows) = (range(0), range(1));
        for y in rows {
            for x in columns.clone() {
                let centre = [x as f64 + 0.5, y as f64 + 0.5];
                if !(inside(a, b, centre) && inside(b, c, centre) && inside(c, a, centre)) {
                    continue;
                }
                let (weight_a, weight_b) = (cross(b, c, centre) / area, cross(c, a, centre) / area);
                let color = color([weight_a, weight_b, 1.0 - weight_a - weight_b]);
                let texel = y * self.size[0] + x;
                if self.is_covered[texel] {
                    let previous = self.rgba8[texel];
                    self.conflicts += usize::from(
                        (0..4).any(|k| previous[k].abs_diff(color[k]) > MAX_SAME_COLOR_DIFFERENCE),
                    );
                } else {
                    self.is_covered[texel] = true;
                    self.covered += 1;
                    self.rgba8[texel] = color;
                }
            }
        }
    }

    /// Gives each uncovered texel the colour of the nearest covered one (in steps along the sides): bilinear
    /// reads at borders and mip levels include them.
    fn finish(mut self) -> Texture {
        let [width, height] = self.size;
        let neighbours = |texel: usize| {
            let (x, y) = (texel % width, texel / width);
            let sides = [
                (x > 0).then(|| texel - 1),
                (x + 1 < width).then_some(texel + 1),
                (y > 0).then(|| texel - width),
                (y + 1 < height).then_some(texel + width),
            ];
            sides.into_iter().flatten()
        };
        let is_border =
            |texel: usize| self.is_covered[texel] && neighbours(texel).any(|next| !self.is_covered[next]);
        let mut front: Vec<usize> = (0..self.rgba8.len()).filter(|&texel| is_border(texel)).collect();
        while !front.is_empty() {
            let mut next_front = Vec::new();
            for texel in front {
                for next in neighbours(texel) {
                    if !self.is_covered[next] {
                        self.is_covered[next] = true;
                        self.rgba8[next] = self.rgba8[texel];
                        next_front.push(next);
                    }
                }
            }
            front = next_front;
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
