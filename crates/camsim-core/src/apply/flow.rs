//! Optical flow in place of the camera's motion: for scenes in which things move by themselves.
//!
//! Each pixel of the ideal frame says where what it shows will be after an interval T, in its own pixels; camera and things together. In
//! between it is taken to go straight on, evenly: what pixel s shows is at `s + tau f(s)` when the share `tau = dt / T` of the interval has gone by.
//! A ray that looks at p then sees the s with `s + tau f(s) = p`, and of several the nearest. What accelerates in the picture is off by at most
//! `|f''| dt (T - dt) / 2`; a flow over a short interval says more.

use std::ops::Range;

use glam::{DMat2, DVec2};

use super::Unseen;
use crate::temporal::{IdealGeometry, InverseDepthImage, Source};

/// Side of a tile, pixels.
const TILE: u32 = 8;
/// Flow of neighbours that differs by more, pixels, is of two things.
const JUMP_PX: f64 = 0.5;
/// Difference of displacements below which things need not be told apart, pixels.
const ONE_THING_PX: f64 = 0.02;
/// A place is a source if what it shows gets to within this of where the ray looks, pixels.
const MEETS_PX: f64 = 0.05;
/// Movement of the source at which the fixed point has been reached, pixels.
const SETTLED_PX: f64 = 1e-8;
const MAX_STEPS: u32 = 48;
/// Steps from each pixel that may be a source.
const FEW_STEPS: u32 = 8;
/// How often the places that may be sources are narrowed down by what their own tiles hold.
const NARROWINGS: u32 = 4;
/// Pixels along each side of those that are looked at, at most: thinner things are missed where flows differ by more.
const MOST_LOOKS: u32 = 64;

/// Where each pixel of an ideal frame goes.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowField {
    /// Width, height: the ideal frame's.
    pub size_px: [u32; 2],
    /// Right and down, pixels, row-major; not a number where it is not known.
    pub px: Vec<[f32; 2]>,
    /// After how long, seconds; negative for a flow to an earlier instant.
    pub interval_s: f64,
}

impl FlowField {
    fn texel(&self, x: u32, y: u32) -> DVec2 {
        let [u, v] = self.px[(y * self.size_px[0] + x) as usize];
        DVec2::new(f64::from(u), f64::from(v))
    }

    fn nearest(&self, at_px: DVec2) -> [u32; 2] {
        let at = (at_px + 0.5).floor().clamp(DVec2::ZERO, self.last());
        [at.x as u32, at.y as u32]
    }

    fn last(&self) -> DVec2 {
        DVec2::new(f64::from(self.size_px[0] - 1), f64::from(self.size_px[1] - 1))
    }

    /// Bilinear within one thing, else the nearest pixel's, edges held; and its change from pixel to pixel. `None` where it is not known.
    fn read(&self, at_px: DVec2) -> Option<(DVec2, DMat2)> {
        let at = at_px.clamp(DVec2::ZERO, self.last());
        let base = at.floor().min((self.last() - 1.0).max(DVec2::ZERO));
        let load = |dx: f64, dy: f64| {
            let place = (base + DVec2::new(dx, dy)).min(self.last());
            self.texel(place.x as u32, place.y as u32)
        };
        let [a, b, c, d] = [load(0.0, 0.0), load(1.0, 0.0), load(0.0, 1.0), load(1.0, 1.0)];
        let spread = a.max(b).max(c).max(d) - a.min(b).min(c).min(d);
        // Also where one is not known: then its sum with the others is none.
        if (a + b + c + d).is_finite() && spread.max_element() <= JUMP_PX {
            let t = at - base;
            let (top, bottom) = (a.lerp(b, t.x), c.lerp(d, t.x));
            return Some((top.lerp(bottom, t.y), DMat2::from_cols((b - a).lerp(d - c, t.y), bottom - top)));
        }
        let [x, y] = self.nearest(at);
        Some((self.texel(x, y), DMat2::ZERO)).filter(|(flow, _)| flow.is_finite())
    }
}

/// Inverse depth, and for things without how far they move: what is larger is taken to be nearer.
type Nearness = [f64; 2];

/// What a tile of the flow holds.
#[derive(Clone, Copy, Debug)]
struct Tile {
    low: DVec2,
    high: DVec2,
    /// Several things in it or at its border, or some that is not known.
    broken: bool,
}

impl Tile {
    const NONE: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY, broken: false };

    fn and(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high), broken: self.broken || other.broken }
    }

    /// Largest difference of displacements.
    fn apart_px(&self, share: f64) -> f64 {
        if self.high.x < self.low.x { 0.0 } else { (self.high - self.low).length() * share.abs() }
    }
}

/// Finds sources in a flow.
#[derive(Clone, Debug)]
pub(super) struct FlowSearch<'a> {
    flow: &'a FlowField,
    tiles: Vec<Tile>,
    columns: u32,
    rows: u32,
    all: Tile,
}

impl<'a> FlowSearch<'a> {
    pub(super) fn new(flow: &'a FlowField) -> Self {
        let [width, height] = flow.size_px;
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let mut tiles = vec![Tile::NONE; (columns * rows) as usize];
        for y in 0..height {
            for x in 0..width {
                let here = flow.texel(x, y);
                let beside = [flow.texel((x + 1).min(width - 1), y), flow.texel(x, (y + 1).min(height - 1))];
                // Written so that what is not known is another thing.
                let broken = !beside.iter().all(|other| (*other - here).abs().max_element() <= JUMP_PX);
                let tile = &mut tiles[(y / TILE * columns + x / TILE) as usize];
                tile.broken |= broken;
                if here.is_finite() {
                    *tile = tile.and(Tile { low: here, high: here, broken });
                }
            }
        }
        let all = tiles.iter().fold(Tile::NONE, |all, tile| all.and(*tile));
        Self { flow, tiles, columns, rows, all }
    }

    /// What looks at `at_px` when the share `share` of the interval has gone by.
    pub(super) fn source(&self, at_px: DVec2, share: f64, depth: &InverseDepthImage<'_>, ideal: &IdealGeometry) -> Result<Source, Unseen> {
        if !at_px.is_finite() || self.all.high.x < self.all.low.x {
            return Err(if at_px.is_finite() { Unseen::Hole } else { Unseen::Outside });
        }
        let (places, tile) = self.places(at_px, share);
        let alone = if tile.broken && tile.apart_px(share) > ONE_THING_PX { None } else { self.settle(at_px, share, at_px, MAX_STEPS) };
        let source_px = match alone {
            Some(found) => found,
            None => self.nearest_of_several(at_px, share, places, depth)?,
        };
        if !ideal.contains(source_px) {
            return Err(Unseen::Outside);
        }
        let [x, y] = self.flow.nearest(source_px);
        if !self.flow.texel(x, y).is_finite() {
            return Err(Unseen::Hole);
        }
        Ok(Source { at_px: source_px, inverse_depth: depth.inverse_depth(source_px) })
    }

    /// Change of the source for a change of where the ray looks: the inverse of `1 + tau df/ds`.
    pub(super) fn source_from_look(&self, source_px: DVec2, share: f64) -> DMat2 {
        let slope = self.flow.read(source_px).map_or(DMat2::ZERO, |(_, slope)| slope);
        let forward = DMat2::IDENTITY + slope * share;
        if forward.determinant().abs() > 1e-3 { forward.inverse() } else { DMat2::IDENTITY }
    }

    /// Whether things that part by more than `most_px` over a share of the interval are about these places.
    pub(super) fn parts(&self, places_px: impl Iterator<Item = DVec2>, share: f64, most_px: f64) -> bool {
        let (low, high) = places_px.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
        let reach = self.all.low.abs().max(self.all.high.abs()) * share.abs();
        let around = self.around(low - reach, high + reach);
        around.broken && around.apart_px(share) > most_px
    }

    /// Which places may be sources, and what the tiles there hold.
    fn places(&self, at_px: DVec2, share: f64) -> ([DVec2; 2], Tile) {
        let mut tile = self.all;
        let mut places = [at_px; 2];
        for _ in 0..NARROWINGS {
            let (a, b) = (at_px - share * tile.low, at_px - share * tile.high);
            places = [a.min(b), a.max(b)];
            let found = self.around(places[0], places[1]);
            if found.high.x < found.low.x || (found.low == tile.low && found.high == tile.high) {
                return (places, found);
            }
            tile = found;
        }
        (places, tile)
    }

    fn around(&self, low: DVec2, high: DVec2) -> Tile {
        let tiles = |low: f64, high: f64, count: u32| -> Range<u32> {
            // A pixel more on each side, which bilinear reading reaches; what is beyond the border is read at it.
            let at = |place: f64| (place / f64::from(TILE)).floor().clamp(0.0, f64::from(count - 1)) as u32;
            at(low - 1.0)..at(high + 1.0) + 1
        };
        let (columns, rows) = (tiles(low.x, high.x, self.columns), tiles(low.y, high.y, self.rows));
        rows.flat_map(|row| columns.clone().map(move |column| row * self.columns + column))
            .fold(Tile::NONE, |all, index| all.and(self.tiles[index as usize]))
    }

    /// `s <- p - tau f(s)` until it rests where it should be.
    fn settle(&self, at_px: DVec2, share: f64, start_px: DVec2, steps: u32) -> Option<DVec2> {
        let mut source_px = start_px;
        for _ in 0..steps {
            let next_px = at_px - share * self.flow.read(source_px)?.0;
            let moved_px = next_px.distance(source_px);
            source_px = next_px;
            if moved_px < SETTLED_PX {
                return Some(source_px);
            }
        }
        let gets_to = source_px + share * self.flow.read(source_px)?.0;
        (gets_to.distance(at_px) < MEETS_PX).then_some(source_px)
    }

    /// Tries every pixel that may be a source. Of those that are, the nearest thing's; without depth that which moves most. Where there is none,
    /// something that moved away bares what was hidden: the farthest thing beside it stands in (or that which moves least).
    fn nearest_of_several(&self, at_px: DVec2, share: f64, places: [DVec2; 2], depth: &InverseDepthImage<'_>) -> Result<DVec2, Unseen> {
        let mut best: Option<(Nearness, DVec2)> = None;
        let mut behind: Option<(Nearness, DVec2)> = None;
        let mut tried = DVec2::NAN;
        for (texel, flow) in self.looks(places) {
            // Neighbours of one thing lead to one place.
            if (flow - tried).abs().max_element() * share.abs() < ONE_THING_PX {
                continue;
            }
            tried = flow;
            let nearness = [depth.nearest(texel), flow.length()];
            if behind.is_none_or(|known| nearness < known.0) {
                behind = Some((nearness, flow));
            }
            if let Some(source_px) = self.settle(at_px, share, at_px - share * flow, FEW_STEPS) {
                let length = self.flow.read(source_px).map_or(0.0, |(flow, _)| flow.length());
                let nearness = [depth.nearest(source_px), length];
                if best.is_none_or(|known| nearness > known.0) {
                    best = Some((nearness, source_px));
                }
            }
        }
        if let Some((_, source_px)) = best {
            return Ok(source_px);
        }
        let (_, flow) = behind.ok_or(Unseen::Hole)?;
        let [x, y] = self.flow.nearest(at_px - share * flow);
        if !self.flow.texel(x, y).is_finite() {
            return Err(Unseen::Hole);
        }
        // Where it would be, the ideal frame shows what hid it: the next pixel of its own.
        let own = self.looks(places).filter(|(_, other)| (*other - flow).abs().max_element() <= JUMP_PX).map(|(texel, _)| texel);
        let far_px = |texel: &DVec2| texel.distance_squared(at_px - share * flow);
        own.min_by(|a, b| far_px(a).total_cmp(&far_px(b))).ok_or(Unseen::Hole)
    }

    /// Pixels between two places, and a pixel more, with the flow of those that have one.
    fn looks(&self, [low, high]: [DVec2; 2]) -> impl Iterator<Item = (DVec2, DVec2)> {
        let [x0, y0] = self.flow.nearest(low - 1.0);
        let [x1, y1] = self.flow.nearest(high + 1.0);
        let step = ((x1 - x0).max(y1 - y0) / MOST_LOOKS).max(1) as usize;
        let texels = (y0..=y1).step_by(step).flat_map(move |y| (x0..=x1).step_by(step).map(move |x| (x, y)));
        texels.map(|(x, y)| (DVec2::new(f64::from(x), f64::from(y)), self.flow.texel(x, y))).filter(|(_, flow)| flow.is_finite())
    }
}
