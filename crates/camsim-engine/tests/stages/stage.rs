//! What is compared of two outputs.

use camsim_core::temporal::IdealGeometry;
use camsim_io::write::srgb8;
use glam::{DVec2, DVec3};

/// What a stage of a frame puts out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Mark of a silhouette in the alpha of the ideal frame.
    IdealMark,
    /// Whether a pixel of the ideal frame shows the same surface.
    IdealSurface,
    /// Colour of the ideal frame where it shows the same surface, DN.
    IdealColor,
    /// Inverse depth of the ideal frame where it shows the same surface, relative.
    IdealDepth,
    /// Colour of the ideal frame at all pixels, DN.
    SampleColor,
    /// Inverse depth of the ideal frame at all pixels, relative.
    SampleDepth,
    /// Lens map: where the forward lens model images the ray of a pixel, output pixels from that pixel.
    LensMap,
    /// Time of a pixel's row after the stamp, s.
    RowTime,
    /// Whether a pixel sees a surface, along the same ray and at the same time.
    Seen,
    /// Solver: source coordinates, ideal pixels.
    Source,
    /// Depth channel, relative.
    Depth,
    /// World point, relative to its depth.
    Point,
    /// Validity channel.
    Valid,
    /// Gather and photometric stage: linear colour of the output frame, fractions of full scale.
    Color,
    /// Linear colour if no other channel is asked for.
    ColorAlone,
    /// Photometric stage alone: linear colour, fractions of full scale.
    Photometric,
    /// Bytes that are written, DN of sRGB.
    Bytes,
}

/// Difference of two pixels.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// Of the component that differs most.
    pub most: f64,
    /// Mean square over the components.
    pub mean_square: f64,
}

impl Difference {
    fn new(components: &[f64]) -> Self {
        let square_sum: f64 = components.iter().map(|value| value * value).sum();
        let largest = components.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        // No number must not look like a small one.
        let most = if square_sum.is_finite() { largest } else { f64::INFINITY };
        Self { most, mean_square: square_sum / components.len() as f64 }
    }
}

/// What is put out for a valid pixel of the output frame; `None` where it is not known.
#[derive(Clone, Copy, Debug, Default)]
pub struct PixelOutput {
    pub color: DVec3,
    /// Ray (u, v) and where the forward lens model images it.
    pub uv: Option<DVec2>,
    pub imaged_px: Option<DVec2>,
    pub time_s: Option<f64>,
    pub source_px: Option<DVec2>,
    /// 0 is the sky.
    pub depth_m: Option<f64>,
    pub point_ned_m: Option<DVec3>,
    /// Whether another depth may be read if the source is rounded: at the skyline and at the border of the
    /// scene.
    pub is_near_sky: bool,
}

/// An output frame.
#[derive(Clone, Debug, Default)]
pub struct FrameOutput {
    /// `None` where the pixel is invalid.
    pub pixels: Vec<Option<PixelOutput>>,
    /// Linear R G B A.
    pub color_rgba: Vec<f32>,
    /// The same without other channels.
    pub color_alone: Option<Vec<f32>>,
    /// What the photometric twin makes of the same picture without photometric effects.
    pub photometric: Option<Vec<[f32; 4]>>,
}

/// An ideal frame; `None` where a value is not known.
#[derive(Clone, Debug)]
pub struct IdealOutput {
    pub geometry: IdealGeometry,
    pub alpha: Vec<f32>,
    pub color_dn: Vec<Option<DVec3>>,
    pub inverse_depth: Vec<Option<f64>>,
}

/// Differences of pixels of an ideal frame from which on they show another surface.
#[derive(Clone, Copy, Debug)]
pub struct OtherSurface {
    pub dn: f64,
    /// Relative.
    pub depth: f64,
}

/// Differences of an output frame's pixels in a stage. With `clear_of_sky` pixels are skipped that the
/// reference has not or has near the sky.
pub fn frame_differences(
    stage: Stage,
    found: &FrameOutput,
    reference: &FrameOutput,
    clear_of_sky: bool,
) -> Vec<Difference> {
    let rgba = |picture: &[f32], other: &[f32]| {
        let pixels = picture.chunks_exact(4).zip(other.chunks_exact(4));
        pixels
            .map(|(a, b)| Difference::new(&[0, 1, 2, 3].map(|k: usize| f64::from(a[k] - b[k]))))
            .collect::<Vec<_>>()
    };
    match stage {
        Stage::ColorAlone => {
            return found.color_alone.as_ref().map_or_else(Vec::new, |alone| rgba(&found.color_rgba, alone));
        }
        Stage::Photometric => {
            let expected = found.photometric.as_ref();
            return expected
                .map_or_else(Vec::new, |expected| rgba(&found.color_rgba, expected.as_flattened()));
        }
        _ => {}
    }
    assert_eq!(found.pixels.len(), reference.pixels.len(), "the same size");
    let pairs = found.pixels.iter().zip(&reference.pixels);
    let pairs =
        pairs.filter(|(_, reference)| !clear_of_sky || reference.is_some_and(|pixel| !pixel.is_near_sky));
    pairs
        .filter_map(|(found, reference)| pixel_difference(stage, found.as_ref(), reference.as_ref()))
        .collect()
}

fn pixel_difference(
    stage: Stage,
    found: Option<&PixelOutput>,
    reference: Option<&PixelOutput>,
) -> Option<Difference> {
    let flag = |differs: bool| Some(Difference::new(&[f64::from(u8::from(differs))]));
    let (a, b) = match (stage, found, reference) {
        (Stage::Valid, ..) => return flag(found.is_some() != reference.is_some()),
        (_, Some(found), Some(reference)) => (found, reference),
        // Both are black, or only one is.
        (Stage::Color | Stage::Bytes | Stage::Seen, ..) => {
            let only_one = found.is_some() != reference.is_some();
            let worst = if stage == Stage::Bytes { 255.0 } else { 1.0 };
            return Some(Difference::new(&[if only_one { worst } else { 0.0 }]));
        }
        _ => return None,
    };
    let depths = a.depth_m.zip(b.depth_m);
    let both_see = depths.is_none_or(|(a, b)| a > 0.0 && b > 0.0);
    match stage {
        Stage::LensMap => {
            let (imaged_px, exact_px) = a.imaged_px.zip(b.imaged_px)?;
            Some(Difference::new(&[imaged_px.distance(exact_px)]))
        }
        Stage::RowTime => a.time_s.zip(b.time_s).map(|(a, b)| Difference::new(&[a - b])),
        Stage::Seen => {
            let ((a_m, b_m), (a_uv, b_uv)) = (depths?, a.uv.zip(b.uv)?);
            let times = a.time_s.zip(b.time_s)?;
            let differs = [a_uv.x - b_uv.x, times.0 - times.1].iter().any(|value| value.abs() > SEEN_ALIKE);
            flag((a_m > 0.0) != (b_m > 0.0) || differs)
        }
        Stage::Source if both_see => {
            a.source_px.zip(b.source_px).map(|(a, b)| Difference::new(&[a.distance(b)]))
        }
        Stage::Depth if both_see => depths.map(|(a, b)| Difference::new(&[a / b - 1.0])),
        Stage::Point if both_see => {
            let ((a_ned_m, b_ned_m), (_, depth_m)) = (a.point_ned_m.zip(b.point_ned_m)?, depths?);
            Some(Difference::new(&[a_ned_m.distance(b_ned_m) / depth_m]))
        }
        Stage::Color => {
            let [r, g, b] = (a.color - b.color).to_array();
            Some(Difference::new(&[r, g, b, 0.0]))
        }
        Stage::Bytes => {
            let bytes = |color: DVec3| color.to_array().map(|value| f64::from(srgb8(value as f32)));
            let (a, b) = (bytes(a.color), bytes(b.color));
            Some(Difference::new(&[0, 1, 2].map(|k: usize| a[k] - b[k])))
        }
        _ => None,
    }
}

/// Differences of rays and times that count as alike: some units in the last place of floats about 1.
const SEEN_ALIKE: f64 = 5e-7;

/// Differences of an ideal frame's pixels in a stage.
pub fn ideal_differences(
    stage: Stage,
    found: &IdealOutput,
    reference: &IdealOutput,
    other: OtherSurface,
) -> Vec<Difference> {
    assert_eq!(found.geometry, reference.geometry, "the same frame");
    let [width, height] = found.geometry.size_px.map(|side| side as usize);
    assert_eq!((found.color_dn.len(), found.inverse_depth.len()), (width * height, width * height));
    let difference = |i: usize| {
        let colors = found.color_dn[i].zip(reference.color_dn[i]).map(|(a, b)| (a - b).to_array());
        let depths = found.inverse_depth[i]
            .zip(reference.inverse_depth[i])
            .map(|(a, b)| if a == b { 0.0 } else { (a - b).abs() / a.max(b).max(1e-12) });
        let is_other = depths.is_some_and(|depth| depth > other.depth)
            || colors.is_some_and(|color| color.iter().any(|dn| dn.abs() > other.dn));
        match stage {
            Stage::IdealMark => Some(Difference::new(&[f64::from(found.alpha[i] - reference.alpha[i])])),
            Stage::IdealSurface => Some(Difference::new(&[f64::from(u8::from(is_other))])),
            Stage::IdealColor if is_other => None,
            Stage::IdealDepth if is_other => None,
            Stage::IdealColor | Stage::SampleColor => colors.map(|color| Difference::new(&color)),
            Stage::IdealDepth | Stage::SampleDepth => depths.map(|depth| Difference::new(&[depth])),
            _ => None,
        }
    };
    (0..width * height).filter_map(difference).collect()
}
