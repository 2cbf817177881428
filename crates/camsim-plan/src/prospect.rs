//! A few places of the image, and all that resampling there depends on: the surface in view, its texture's
//! grain, and the two maps from the texture over the ideal frame to the output pixel.

use camsim_core::waves::sinc;
use glam::{DMat2, DVec2};
use rayon::prelude::*;

use super::{
    LensReach,
    costs::Drawn,
    grain::{SceneGrain, Spectrum},
    probes::Probe,
    resample::Parts,
    surfaces::{FOG_AT_VISIBILITY, Met, Surfaces},
};
use camsim_core::{
    camera::CameraModel, mount::CameraPath, photometric::vignette_weight, pose::CameraPose,
    sequence::Sequence, shutter::Shutter,
};

/// One probe in so many is looked at, not in step with the grid of 24 columns, and so many of these are taken
/// at most.
const PROBE_STEP: usize = 5;
const SIGHTS: usize = 32;

/// One place of the image: what it shows, in pixels of the camera (its focal length, before the lens) at
/// mid-exposure.
pub(super) struct Sight<'a> {
    /// Probes that it stands for.
    pub weight: f64,
    pub spectrum: &'a Spectrum,
    /// Of the linear range, for each unit of texture.
    pub gain: f64,
    /// d(camera px)/d(output px), d(key px)/d(camera px), d(texel)/d(key px): from the line's camera to that
    /// of the ideal frame the same pixel may grow or turn.
    pub camera_from_px: DMat2,
    pub key_from_camera: DMat2,
    pub texel_from_key: DMat2,
    /// Source in the key frame from its principal point, and path over the exposure there, camera px.
    pub key_px: DVec2,
    pub path: DVec2,
    pub path_px: f64,
    /// What has been found out about ways of resampling it.
    pub parts: Parts,
}

/// The places of a frame.
pub(super) struct Prospect<'a> {
    pub sights: Vec<Sight<'a>>,
    /// Probes that count, of those looked at: those that the places stand for, and the sky.
    pub counted: usize,
    /// Of the camera, and but for whole pixels of every ideal frame.
    pub principal_px: DVec2,
    /// Narrowest and widest output pixel, camera px.
    pub widths: [f64; 2],
    /// By how much the most slanted pixel's sides go together along x and y, as [`lean`] has it.
    pub lean: f64,
    /// Whether the lens bends rows, and what the scene takes to draw.
    pub is_bent: bool,
    pub drawn: Drawn,
}

impl<'a> Prospect<'a> {
    pub fn new(
        reach: &LensReach,
        sequence: &Sequence,
        surfaces: &Surfaces,
        grain: &'a SceneGrain,
        shutter: &Shutter,
        stamp_s: f64,
        key_pose: &CameraPose,
    ) -> Self {
        let (probes, focal_px) = (&reach.probes, reach.camera.focal_px);
        let gain = gain(sequence, &reach.camera);
        let sight = |probe: &Probe| {
            let [x, y] = probe.pixel;
            let mid_s = stamp_s + shutter.dt_pixel_s(x, y);
            let pose = sequence.path.pose(mid_s);
            let (rotation, shift) = pose.relative_to(key_pose);
            let key_px = |uv: DVec2, inverse_depth: f64| {
                let in_key = rotation * uv.extend(1.0) + inverse_depth * shift;
                focal_px * in_key.truncate() / in_key.z
            };
            let Some(here) = surfaces.meet(pose.position_ned_m, pose.ned_from_camera * probe.uv.extend(1.0))
            else {
                return Seen::Sky;
            };
            let Some(shown) = Shown::new(surfaces, &pose, &here, probe.uv, focal_px, key_px) else {
                return Seen::Several;
            };
            let Some(grain) = grain.of(shown.surface) else { return Seen::Several };
            let path =
                path_px(&sequence.path, mid_s, shutter.exposure_s(), probe.uv, shown.inverse_depth, focal_px);
            let clear = sequence
                .scene
                .fog_visibility_m
                .map_or(1.0, |visibility_m| (-FOG_AT_VISIBILITY * shown.range_m / visibility_m).exp());
            Seen::Surface(Sight {
                weight: 1.0,
                spectrum: grain.at(shown.texel),
                gain: gain(probe.pixel) * clear,
                key_px: shown.key_px,
                key_from_camera: shown.key_from_camera,
                camera_from_px: DMat2::from_diagonal(focal_px) * probe.uv_from_px,
                texel_from_key: shown.texel_from_camera * shown.key_from_camera.inverse(),
                path: shown.key_from_camera * path.0,
                path_px: path.1,
                parts: Parts::default(),
            })
        };
        let seen: Vec<Seen<'_>> = probes.par_iter().step_by(PROBE_STEP).map(sight).collect();
        let counted = seen.iter().filter(|seen| !matches!(seen, Seen::Several)).count();
        let sights = seen
            .into_iter()
            .filter_map(|seen| if let Seen::Surface(sight) = seen { Some(sight) } else { None })
            .collect();
        let sides = |probe: &Probe| DMat2::from_diagonal(focal_px) * probe.uv_from_px;
        let width = |sides: DMat2| sides.x_axis.length().max(sides.y_axis.length());
        let lean = probes.iter().map(|probe| lean(sides(probe))).fold(0.0, f64::max);
        let widths = probes
            .iter()
            .map(|probe| width(sides(probe)))
            .fold([f64::INFINITY, 0.0], |[least, most], width| [width.min(least), width.max(most)]);
        let (is_bent, drawn) = (!reach.camera.lens.is_identity(), Drawn::new(&sequence.scene));
        Self {
            sights: few_of(sights),
            is_bent,
            drawn,
            counted,
            principal_px: reach.camera.principal_point_px,
            widths,
            lean,
        }
    }
}

/// How far the parallelogram with these sides is from one that is as wide along x whatever its y: 0 of a
/// square however it is turned and of a rectangle along the axes, 1 of a line across both.
fn lean(sides: DMat2) -> f64 {
    let variance = sides * sides.transpose();
    variance.x_axis.y.abs() / (variance.x_axis.x * variance.y_axis.y).sqrt().max(f64::MIN_POSITIVE)
}

/// What a probe sees.
enum Seen<'a> {
    Sky,
    /// More than one surface, or one of which nothing is known.
    Several,
    Surface(Sight<'a>),
}

/// Some of the places, each standing for as many as it is taken for. Half of them are taken evenly, and half
/// by how much of what is hard to resample they show: the few houses on a lawn, or the few pixels that are
/// much wider than the rest, may be most of the error.
fn few_of(sights: Vec<Sight<'_>>) -> Vec<Sight<'_>> {
    let hard: Vec<f64> = sights.iter().map(Sight::hard_to_resample).collect();
    let mean = hard.iter().sum::<f64>() / hard.len().max(1) as f64;
    let part = |hard: f64| if mean > 0.0 { 0.5 + 0.5 * hard / mean } else { 1.0 };
    let mut by_part: Vec<(f64, Sight<'_>)> = hard.iter().map(|&hard| part(hard)).zip(sights).collect();
    by_part.sort_by(|a, b| a.0.total_cmp(&b.0));
    let step = by_part.iter().map(|(part, _)| part).sum::<f64>() / SIGHTS.min(by_part.len()).max(1) as f64;
    let mut passed = 0.5 * step;
    by_part
        .into_iter()
        .filter_map(|(part, sight)| {
            let before = (passed / step).floor();
            passed += part;
            let times = (passed / step).floor() - before;
            (times > 0.0).then_some(Sight { weight: times * step / part, ..sight })
        })
        .collect()
}

/// Of the linear range, for each unit of light that arrives at a pixel.
pub(super) fn gain(sequence: &Sequence, camera: &CameraModel) -> impl Fn([u32; 2]) -> f64 + Sync {
    let photometric = &sequence.scenario.camera.photometric;
    let size_px = camera.size_px;
    move |[x, y]: [u32; 2]| {
        let vignette = sequence.vignette.as_ref().map_or(1.0, |map| {
            let [column, row] = [(x, 0), (y, 1)].map(|(at, k)| (at * map.size_px[k] / size_px[k]) as usize);
            f64::from(vignette_weight(
                map.values[row * map.size_px[0] as usize + column],
                photometric.vignette_thresholds,
            ))
        });
        vignette * photometric.light
    }
}

impl Sight<'_> {
    /// Samples of the exposure that are at different places: where a path goes to and fro they may meet.
    pub fn apart(&self, samples: u32) -> u32 {
        let sweeps = self.path_px / self.path.length().max(1e-9);
        ((f64::from(samples) / sweeps.max(1.0)).round() as u32).max(1)
    }

    /// Power of the waves of two and four pixels: a measure to compare places by.
    fn hard_to_resample(&self) -> f64 {
        const DIRECTIONS: u32 = 3;
        let cycles_from_key = self.texel_from_key.inverse().transpose();
        let power = |length: f64, direction: u32| {
            let f = length
                * DVec2::from_angle(
                    std::f64::consts::PI * (f64::from(direction) + 0.5) / f64::from(DIRECTIONS),
                );
            let cycles = cycles_from_key * f;
            length * length * self.spectrum.density_at(cycles) * (sinc(cycles.x) * sinc(cycles.y)).powi(4)
        };
        let powers = [0.25, 0.5]
            .into_iter()
            .flat_map(|length| (0..DIRECTIONS).map(move |direction| power(length, direction)));
        self.gain * self.gain / self.texel_from_key.determinant().abs() * powers.sum::<f64>()
    }
}

/// What a ray shows of a texture.
struct Shown {
    surface: usize,
    inverse_depth: f64,
    range_m: f64,
    texel: DVec2,
    texel_from_camera: DMat2,
    /// In the key frame, from its principal point, camera px.
    key_px: DVec2,
    key_from_camera: DMat2,
}

impl Shown {
    /// By what the ray itself meets and two beside it; `None` for a texture of one colour, and where the
    /// three meet different surfaces.
    fn new(
        surfaces: &Surfaces,
        pose: &CameraPose,
        here: &Met,
        uv: DVec2,
        focal_px: DVec2,
        key_px: impl Fn(DVec2, f64) -> DVec2,
    ) -> Option<Self> {
        const BESIDE_PX: f64 = 0.5;
        let look = |offset_px: DVec2| {
            surfaces.meet(pose.position_ned_m, pose.ned_from_camera * (uv + offset_px / focal_px).extend(1.0))
        };
        let beside = [DVec2::X, DVec2::Y]
            .map(|axis| look(BESIDE_PX * axis).filter(|beside| beside.surface == here.surface));
        let [x, y] = [beside[0].as_ref()?, beside[1].as_ref()?];
        let texel_from_camera = DMat2::from_cols(
            surfaces.texel(x) - surfaces.texel(here),
            surfaces.texel(y) - surfaces.texel(here),
        ) * BESIDE_PX.recip();
        let own_key_px = key_px(uv, here.depth_m.recip());
        let moved = |axis: DVec2, beside: &Met| {
            key_px(uv + BESIDE_PX * axis / focal_px, beside.depth_m.recip()) - own_key_px
        };
        let key_from_camera = DMat2::from_cols(moved(DVec2::X, x), moved(DVec2::Y, y)) * BESIDE_PX.recip();
        let regular = |map: &DMat2| map.determinant().abs() > 1e-12 && map.is_finite();
        (regular(&texel_from_camera) && regular(&key_from_camera)).then_some(Self {
            key_px: own_key_px,
            key_from_camera,
            surface: here.surface,
            inverse_depth: here.depth_m.recip(),
            range_m: here.depth_m * uv.extend(1.0).length(),
            texel: surfaces.texel(here),
            texel_from_camera,
        })
    }
}

/// Path of the source over the exposure, camera px: between its places that are farthest apart, and its
/// length.
pub(super) fn path_px(
    path: &CameraPath,
    mid_s: f64,
    exposure_s: f64,
    uv: DVec2,
    inverse_depth: f64,
    focal_px: DVec2,
) -> (DVec2, f64) {
    const STRETCHES: u32 = 8;
    if exposure_s <= 0.0 {
        return (DVec2::ZERO, 0.0);
    }
    let mid = path.pose(mid_s);
    let place = |k: u32| {
        let t_s = mid_s + exposure_s * (f64::from(k) / f64::from(STRETCHES) - 0.5);
        let (rotation, shift) = path.pose(t_s).relative_to(&mid);
        let p = rotation * uv.extend(1.0) + inverse_depth * shift;
        focal_px * p.truncate() / p.z
    };
    let places: Vec<DVec2> = (0..=STRETCHES).map(place).filter(|at| at.is_finite()).collect();
    let length_px = places.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let apart =
        places.iter().enumerate().flat_map(|(k, from)| places[k + 1..].iter().map(move |to| *to - *from));
    let widest = apart.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    (widest.unwrap_or_default(), length_px)
}
