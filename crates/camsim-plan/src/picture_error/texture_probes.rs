//! A few positions of the image, and all that resampling there depends on: the surface in view, its texture's
//! spectrum, and the two maps from the texture over the ideal frame to the output pixel.

use camsim_core::{pose::CameraPose, sequence::Sequence, shutter::Shutter, transfer::sinc};
use glam::{DMat2, DVec2};
use rayon::prelude::*;

use super::{
    resampling_cache::ResamplingCache,
    texture_spectra::{SceneSpectra, TextureSpectrum},
};
use crate::view::{
    gain::gain,
    lens_reach::LensReach,
    light::FOG_AT_VISIBILITY,
    probes::Probe,
    source_path::path_px,
    surfaces::{SurfaceHit, Surfaces},
};

/// One probe in so many is used, not in step with the grid of 24 columns, and so many of these are kept at
/// most.
const PROBE_STEP: usize = 5;
const MOST_PROBES: usize = 32;

/// One probe: what it shows, in pixels of the camera (its focal length, before the lens) at
/// mid-exposure.
pub(crate) struct TextureProbe<'a> {
    /// Probes that it stands for.
    pub weight: f64,
    pub spectrum: &'a TextureSpectrum,
    /// Value of a pixel, of the linear range, for each unit of texture.
    pub gain: f64,
    /// d(camera px)/d(output px).
    pub camera_from_px: DMat2,
    /// d(key px)/d(camera px): from the row's camera to that of the ideal frame a pixel may grow or turn.
    pub key_from_camera: DMat2,
    /// d(texel)/d(key px).
    pub texel_from_key: DMat2,
    /// Source in the key frame from its principal point, camera px.
    pub key_px: DVec2,
    /// Path over the exposure in the key frame, between its points that are farthest apart, camera px.
    pub path: DVec2,
    /// Length of the path, camera px.
    pub path_px: f64,
    /// Parts of the resampling error that are known.
    pub cache: ResamplingCache,
}

/// The texture probes of a frame.
pub(crate) struct TextureProbes<'a> {
    pub probes: Vec<TextureProbe<'a>>,
    /// Probes that count, of those used: those that these stand for, and the sky.
    pub counted: usize,
    /// Principal point of the camera, and but for whole pixels of every ideal frame.
    pub principal_px: DVec2,
    /// Narrowest and widest output pixel, camera px.
    pub widths: [f64; 2],
    /// By how much the most slanted pixel's sides go together along x and y, as [`lean`] has it.
    pub lean: f64,
}

impl<'a> TextureProbes<'a> {
    pub fn new(
        reach: &LensReach,
        sequence: &Sequence,
        surfaces: &Surfaces,
        spectra: &'a SceneSpectra,
        shutter: &Shutter,
        stamp_s: f64,
        key_pose: &CameraPose,
        frame: u64,
    ) -> Self {
        let (probes, focal_px) = (&*reach.probes_of_colors(), reach.camera.central_focal_px());
        let gain = &gain(sequence, &reach.camera, frame);
        let search =
            TextureSearch { sequence, surfaces, spectra, shutter, stamp_s, key_pose, focal_px, gain };
        let views: Vec<ProbeView<'_>> =
            probes.par_iter().step_by(PROBE_STEP).map(|probe| search.view(probe)).collect();
        let counted = views.iter().filter(|view| !matches!(view, ProbeView::Several)).count();
        let shown = views
            .into_iter()
            .filter_map(|view| if let ProbeView::Surface(probe) = view { Some(probe) } else { None })
            .collect();
        let sides = |probe: &Probe| DMat2::from_diagonal(focal_px) * probe.uv_from_px;
        let width = |sides: DMat2| sides.x_axis.length().max(sides.y_axis.length());
        let lean = probes.iter().map(|probe| lean(sides(probe))).fold(0.0, f64::max);
        let widths = probes
            .iter()
            .map(|probe| width(sides(probe)))
            .fold([f64::INFINITY, 0.0], |[least, most], width| [width.min(least), width.max(most)]);
        Self {
            probes: representative(shown),
            counted,
            principal_px: reach.camera.principal_point_px,
            widths,
            lean,
        }
    }
}

/// A frame whose probes are searched for textures.
struct TextureSearch<'a, 's> {
    sequence: &'s Sequence,
    surfaces: &'s Surfaces,
    spectra: &'a SceneSpectra,
    shutter: &'s Shutter,
    stamp_s: f64,
    key_pose: &'s CameraPose,
    focal_px: DVec2,
    gain: &'s (dyn Fn([u32; 2]) -> f64 + Sync),
}

impl<'a> TextureSearch<'a, '_> {
    fn view(&self, probe: &Probe) -> ProbeView<'a> {
        let Self { sequence, surfaces, shutter, focal_px, .. } = *self;
        let [x, y] = probe.pixel;
        let mid_s = self.stamp_s + shutter.dt_pixel_s(x, y);
        let pose = sequence.path.pose(mid_s);
        let (rotation, shift) = pose.relative_to(self.key_pose);
        let key_px = |uv: DVec2, inverse_depth: f64| {
            let in_key = rotation * uv.extend(1.0) + inverse_depth * shift;
            focal_px * in_key.truncate() / in_key.z
        };
        let ray_ned = pose.ned_from_camera * probe.uv.extend(1.0);
        let Some(hit) = surfaces.first_hit(pose.position_ned_m, ray_ned) else { return ProbeView::Sky };
        let Some(shown) = TextureView::new(surfaces, &pose, &hit, probe.uv, focal_px, key_px) else {
            return ProbeView::Several;
        };
        let Some(spectra) = self.spectra.of_surface(shown.surface) else { return ProbeView::Several };
        let exposure_s = shutter.exposure_pixel_s(x, y);
        let path = path_px(&sequence.path, mid_s, exposure_s, probe.uv, shown.inverse_depth, focal_px);
        let clear = sequence
            .scene
            .fog_visibility_m
            .map_or(1.0, |visibility_m| (-FOG_AT_VISIBILITY * shown.range_m / visibility_m).exp());
        ProbeView::Surface(TextureProbe {
            weight: 1.0,
            spectrum: spectra.near(shown.texel),
            gain: (self.gain)(probe.pixel) * clear,
            key_px: shown.key_px,
            key_from_camera: shown.key_from_camera,
            camera_from_px: DMat2::from_diagonal(focal_px) * probe.uv_from_px,
            texel_from_key: shown.texel_from_camera * shown.key_from_camera.inverse(),
            path: shown.key_from_camera * path.0,
            path_px: path.1,
            cache: ResamplingCache::default(),
        })
    }
}

/// How far the parallelogram with these sides is from one that is as wide along x whatever its y: 0 of a
/// square however it is turned and of a rectangle along the axes, 1 of a line across both.
fn lean(sides: DMat2) -> f64 {
    let variance = sides * sides.transpose();
    variance.x_axis.y.abs() / (variance.x_axis.x * variance.y_axis.y).sqrt().max(f64::MIN_POSITIVE)
}

/// What a probe sees.
enum ProbeView<'a> {
    Sky,
    /// More than one surface, or one of which nothing is known.
    Several,
    Surface(TextureProbe<'a>),
}

/// Some of the probes, each standing for as many as it is taken for. Half of them are taken evenly, and half
/// by how much of what is hard to resample they show: the few houses on a lawn, or the few pixels that are
/// much wider than the rest, may be most of the error.
fn representative(probes: Vec<TextureProbe<'_>>) -> Vec<TextureProbe<'_>> {
    let hard: Vec<f64> = probes.iter().map(TextureProbe::hard_to_resample).collect();
    let mean = hard.iter().sum::<f64>() / hard.len().max(1) as f64;
    let part = |hard: f64| if mean > 0.0 { 0.5 + 0.5 * hard / mean } else { 1.0 };
    let mut by_part: Vec<(f64, TextureProbe<'_>)> = hard.iter().map(|&hard| part(hard)).zip(probes).collect();
    by_part.sort_by(|a, b| a.0.total_cmp(&b.0));
    let step =
        by_part.iter().map(|(part, _)| part).sum::<f64>() / MOST_PROBES.min(by_part.len()).max(1) as f64;
    let mut passed = 0.5 * step;
    by_part
        .into_iter()
        .filter_map(|(part, probe)| {
            let before = (passed / step).floor();
            passed += part;
            let times = (passed / step).floor() - before;
            (times > 0.0).then_some(TextureProbe { weight: times * step / part, ..probe })
        })
        .collect()
}

impl TextureProbe<'_> {
    /// Samples of the exposure that are at different positions: where a path goes to and fro they may meet.
    pub fn distinct_samples(&self, samples: u32) -> u32 {
        let sweeps = self.path_px / self.path.length().max(1e-9);
        ((f64::from(samples) / sweeps.max(1.0)).round() as u32).max(1)
    }

    /// Power of the waves of two and four pixels: a measure to compare probes by.
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
struct TextureView {
    surface: usize,
    inverse_depth: f64,
    range_m: f64,
    texel: DVec2,
    texel_from_camera: DMat2,
    /// In the key frame, from its principal point, camera px.
    key_px: DVec2,
    key_from_camera: DMat2,
}

impl TextureView {
    /// By what the ray itself meets and two beside it; `None` for a texture of one colour, and where the
    /// three meet different surfaces.
    fn new(
        surfaces: &Surfaces,
        pose: &CameraPose,
        hit: &SurfaceHit,
        uv: DVec2,
        focal_px: DVec2,
        key_px: impl Fn(DVec2, f64) -> DVec2,
    ) -> Option<Self> {
        const BESIDE_PX: f64 = 0.5;
        let cast = |offset_px: DVec2| {
            surfaces.first_hit(
                pose.position_ned_m,
                pose.ned_from_camera * (uv + offset_px / focal_px).extend(1.0),
            )
        };
        let beside = [DVec2::X, DVec2::Y]
            .map(|axis| cast(BESIDE_PX * axis).filter(|beside| beside.surface == hit.surface));
        let [x, y] = [beside[0].as_ref()?, beside[1].as_ref()?];
        let texel_from_camera = DMat2::from_cols(
            surfaces.texel(x) - surfaces.texel(hit),
            surfaces.texel(y) - surfaces.texel(hit),
        ) * BESIDE_PX.recip();
        let own_key_px = key_px(uv, hit.depth_m.recip());
        let moved = |axis: DVec2, beside: &SurfaceHit| {
            key_px(uv + BESIDE_PX * axis / focal_px, beside.depth_m.recip()) - own_key_px
        };
        let key_from_camera = DMat2::from_cols(moved(DVec2::X, x), moved(DVec2::Y, y)) * BESIDE_PX.recip();
        let regular = |map: &DMat2| map.determinant().abs() > 1e-12 && map.is_finite();
        (regular(&texel_from_camera) && regular(&key_from_camera)).then_some(Self {
            key_px: own_key_px,
            key_from_camera,
            surface: hit.surface,
            inverse_depth: hit.depth_m.recip(),
            range_m: hit.depth_m * uv.extend(1.0).length(),
            texel: surfaces.texel(hit),
            texel_from_camera,
        })
    }
}
