//! What silhouettes cost in grey levels where nothing is done for them: a pixel of the ideal frame then shows
//! one of the two surfaces, and an output pixel reads from there as it does elsewhere.
//!
//! Two things go wrong. The border runs along whole pixels, so that pixels on it have too much of one
//! surface; and within the parallax between the two surfaces a pixel looks where the other one is. Both are a
//! share of the contrast across the border. How wide the strip within parallax is the rays around the probes
//! tell; a few silhouettes have most of it, at which hardly any probe stands, so that the share that holes
//! have of the picture (`holes.rs`) is asked too.
//!
//! With rays of their own pixels at silhouettes have neither; but the ideal frame's samples know to a part of
//! its pixels where the border is. Where meshes of other colours touch, rays change nothing: only a finer
//! ideal frame does.

mod rays;

use serde::Serialize;

use super::{
    BlurStage, Holes, SeenPlane,
    around::{Around, Contour, Surroundings},
    borders::Crossed,
    levels::Sampling,
    skyline::Skyline,
    stairs::Places,
};
use camsim_core::{camera::CameraModel, pose::CameraPose, scene::TerrainDetail};

/// Times what is expected: of a few hundred probes a few are at silhouettes.
const SAFETY: f64 = 1.3;
/// Standard errors of what the probes find at borders, squared, that are added to it.
pub(super) const UNSURE: f64 = 1.5;
/// Times what is found at borders, squared, at most, that is taken to lie between those.
const MOST_FINER: f64 = 2.0;
/// Strips for each that is hidden: where one border of a surface uncovers what is behind it the other covers
/// it up, and a pixel there may take either.
const STRIPS: f64 = 2.0;
/// How far the ground's borders are displaced, in times of all of it: they are ridges, which coarser
/// triangles cut off. Over an alpine valley the whole error by a level of detail of 0.25 px was 0.34 to
/// 0.51/255 in ten frames, with 3500 houses or none; what is foretold with this factor was 0.8 to 1.1 times
/// that, and more since the skyline is known by itself.
const RIDGES: f64 = 1.5;
/// Part of `quality.max_error_dn` that silhouettes may take, and how many times that tolerance the pixels at
/// them may be off, RMS.
const SHARE: f64 = 0.9;
const TIMES_AT: f64 = 6.0;
/// Part of what borders along whole pixels cost, squared, that is left of it at least, whatever reads the
/// ideal frame.
const LEAST_LEFT: f64 = 0.1;
const LEAST_LEFT_BY_SAMPLES: f64 = 0.02;
/// What silhouettes cost, as they are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Contours {
    /// Share of the pixels within 3 px of one, folds of depth included.
    pub share: f64,
    /// RMS contrast across them, 1/255 of the linear range.
    pub contrast_dn: f64,
    /// Share of the picture that the ideal frame's camera does not see behind them.
    pub hidden_share: f64,
    /// RMS error of those pixels, 1/255 of the linear range.
    pub at_dn: f64,
    /// RMS error over the picture by them, 1/255 of the linear range.
    pub error_dn: f64,
}

/// The same for ideal frames of any scale, and all that may read them.
#[derive(Clone, Debug)]
pub(super) struct Outlook {
    /// Of the pixels, at silhouettes.
    pub share: f64,
    contrast_dn: f64,
    hidden_share: f64,
    /// Mean squared error over the picture by strips, of the linear range.
    strips: f64,
    /// Squared contrast of borders, times their length in pixels, mean over the pixels of the picture: of
    /// steps of depth,
    steps: f64,
    /// the same as a look once a pixel finds them,
    steps_apart: f64,
    /// between meshes that touch,
    flush: f64,
    /// and where depth bends.
    feet: f64,
    /// Part of these two that a look once a pixel finds.
    once_a_pixel: f64,
    /// [`Around::of_ground`], mean over the pixels of the picture.
    of_ground: f64,
    skyline: Skyline,
    places: Places,
}

impl Outlook {
    /// From what is seen around all probes by a camera, the ideal frame's pose, the plane that is nearest to
    /// what is seen from there, what is not, and the least share that pixels at silhouettes have.
    pub fn new(
        Surroundings { around, skyline }: &Surroundings,
        camera: &CameraModel,
        key_pose: &CameraPose,
        plane: &SeenPlane,
        holes: Holes,
        least_share: f64,
    ) -> Self {
        let found = || around.iter().filter_map(|around| around.contour.as_ref());
        let near = found().count();
        let mean = |of: &dyn Fn(&Contour) -> f64| {
            found().fold(0.0, |sum, contour| sum + of(contour)) / near.max(1) as f64
        };
        let share = near as f64 / around.len().max(1) as f64;
        let contrast2 = mean(&|contour| contour.contrast2);
        let surfaces2: Vec<f64> = found().filter_map(|contour| contour.surfaces2).collect();
        let hidden2 = if surfaces2.is_empty() {
            contrast2
        } else {
            surfaces2.iter().sum::<f64>() / surfaces2.len() as f64
        };
        // Few lines cross a border: where borders stand apart, what the wider look finds is surer.
        let over_all = |of: &dyn Fn(&Crossed) -> f64| {
            SAFETY * SAFETY * around.iter().fold(0.0, |sum, around| sum + of(&around.crossed))
                / around.len().max(1) as f64
        };
        // Few probes are near the sky, whose border lines between them know.
        let of_skyline = skyline.steps();
        let at_probes = |contour: &Contour| {
            if of_skyline.is_some() { contour.steps_between_surfaces } else { contour.steps() }
        };
        let of_skyline = SAFETY * SAFETY * of_skyline.unwrap_or(0.0);
        let of_probes = SAFETY * SAFETY * share * mean(&at_probes) + of_skyline;
        let of_lines = over_all(&|crossed| crossed.steps);
        let finer = finer(around);
        let unsure = unsure(around);
        Self {
            share: share.max(least_share),
            contrast_dn: 255.0 * contrast2.sqrt(),
            hidden_share: holes.share,
            strips: STRIPS * hidden2 * holes.narrow_share
                + share * mean(&|contour| contour.strip(key_pose, camera.focal_px))
                + skyline.strips(key_pose, plane),
            steps: unsure * (of_probes.max(finer * of_lines) - of_skyline) + of_skyline,
            steps_apart: of_probes.max(of_lines / finer),
            flush: unsure * finer * over_all(&|crossed| crossed.flush),
            feet: unsure * finer * over_all(&|crossed| crossed.feet),
            once_a_pixel: (unsure * finer * finer).recip(),
            of_ground: SAFETY * SAFETY * around.iter().map(|around| around.of_ground).sum::<f64>()
                / around.len().max(1) as f64,
            skyline: skyline.clone(),
            places: Places::new(around.iter().filter_map(Around::place)),
        }
    }

    /// RMS error over the picture by borders of a ground that is displaced by so much, RMS, pixels of the
    /// camera's focal length; 1/255 of the linear range. A border passes over as much of a pixel as it is
    /// displaced, as often across it as along it; before the sky it is known by how much.
    pub fn ground_dn(&self, displaced_px: f64, detail: &TerrainDetail<'_>) -> f64 {
        let before_ground = (RIDGES * displaced_px).powi(2) * 0.5 * self.of_ground;
        255.0 * (before_ground + self.skyline.lowered(detail)).sqrt()
    }

    /// Left as they are.
    pub fn plain(&self, sampling: &Sampling, blur: Option<BlurStage>) -> Contours {
        self.of((self.steps + self.flush + self.feet) * self.places.left(sampling, blur) + self.strips)
    }

    /// About the least that they cost left as they are, whatever reads an ideal frame with so many pixels for
    /// each of the camera's; whether those may have several samples.
    pub fn plain_at_best(&self, scale: f64, may_have_samples: bool) -> Contours {
        let least_left = if may_have_samples { LEAST_LEFT_BY_SAMPLES } else { LEAST_LEFT };
        self.of(least_left * (self.steps + self.flush + self.feet) * self.places.along_whole_pixels(scale)
            + self.strips)
    }

    fn of(&self, square: f64) -> Contours {
        let Self { share, contrast_dn, hidden_share, .. } = *self;
        // Of no silhouettes at all the sum is -0.
        let error_dn = 255.0 * square.abs().sqrt();
        let at_dn = if share > 0.0 { error_dn / share.sqrt() } else { 0.0 };
        Contours { share, contrast_dn, hidden_share, at_dn, error_dn }
    }
}

/// Times what is found at borders that there may well be, squared: where a few probes found most of it they
/// tell less than as many alike.
fn unsure(around: &[Around]) -> f64 {
    let found = || around.iter().filter_map(Around::place).map(|(found, _)| found);
    let [sum, squares] =
        found().fold([0.0; 2], |[sum, squares], found| [sum + found, squares + found * found]);
    if sum > 0.0 { 1.0 + UNSURE * squares.sqrt() / sum } else { 1.0 }
}

/// Times the borders that are found there are more, nearer to each other than what is looked at: as many
/// times as what is found thrice a pixel is more than what is found once.
fn finer(around: &[Around]) -> f64 {
    let of =
        |Crossed { steps, flush, feet, once_a_pixel, .. }: &Crossed| [steps + flush + feet, *once_a_pixel];
    let [all, once] = around
        .iter()
        .map(|around| of(&around.crossed))
        .fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
    if once > 0.0 { (all / once).clamp(1.0, MOST_FINER) } else { 1.0 }
}

impl Contours {
    /// Whether they cost little enough of a tolerance.
    pub(super) fn are_affordable(&self, max_error_dn: f64) -> bool {
        self.error_dn <= SHARE * max_error_dn && self.at_dn <= TIMES_AT * max_error_dn
    }
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used)]

    use std::{
        f32::consts::{FRAC_PI_2, FRAC_PI_4},
        sync::Arc,
    };

    use glam::{DQuat, DVec3};

    use super::{
        rays::{RAYS_LEAVE, SAFETY_WITH_RAYS},
        *,
    };
    use crate::{
        LensReach, SurfaceReads, around::Search, exposure::ExposurePath, stairs, surfaces::Surfaces,
    };
    use camsim_core::{
        mount::CameraPath,
        pose::BodyState,
        scenario::{LensModel, MountSpec, ShutterSpec},
        scene::{Encoding, Mesh, MeshVertex, Scene, Texture, Wrap},
        shutter::Shutter,
        temporal::TapStage,
        trajectory::Trajectory,
    };

    const FOCAL_PX: f64 = 200.0;
    pub(crate) const SPEED_M_S: f64 = 40.0;
    /// Of 436 probes with borders.
    const UNSURE_OF_ALL: f64 = 1.0 + UNSURE / 20.9;

    /// Level, 150 m above the origin at 0 s, looking down.
    pub(crate) fn flying_east() -> CameraPath {
        flying_east_from(DVec3::new(0.0, 0.0, -150.0), -90.0)
    }

    /// The same from somewhere at 0 s, looking up by so many degrees to the north.
    pub(crate) fn flying_east_from(from_ned_m: DVec3, up_deg: f64) -> CameraPath {
        let state = |t_s: f64| BodyState {
            position_ned_m: from_ned_m + SPEED_M_S * t_s * DVec3::Y,
            velocity_ned_m_s: DVec3::new(0.0, SPEED_M_S, 0.0),
            acceleration_ned_m_s2: DVec3::ZERO,
            ned_from_body: DQuat::IDENTITY,
            rate_body_rad_s: DVec3::ZERO,
            angular_acceleration_body_rad_s2: DVec3::ZERO,
        };
        let mount = MountSpec { angles_deg: [0.0, up_deg, 0.0], ..MountSpec::default() };
        let knots = (0..=20).map(|k| state(0.1 * f64::from(k) - 1.0)).collect();
        CameraPath::new(Trajectory::uniform(-1.0, 0.1, 1.0, knots).unwrap(), &mount).unwrap()
    }

    /// A white roof of 50 m, 50 m above black ground, from 100 m above it, flying east with a readout of 100
    /// ms.
    fn outlook(exposure_ms: f64, gain: f64, holes: Holes) -> Outlook {
        outlook_on(
            vec![Mesh::level_picture(plain(255), DVec3::new(0.0, 0.0, -50.0), 50.0)],
            exposure_ms,
            gain,
            holes,
        )
    }

    fn plain(byte: u8) -> Arc<Texture> {
        Arc::new(Texture::uniform([byte, byte, byte, 255], Encoding::Linear))
    }

    /// An ideal frame of a scale, read bilinearly at the mid-exposure.
    fn read_at(scale: f64) -> Sampling {
        Sampling::new(scale, SurfaceReads::Two, TapStage::Bilinear)
    }

    /// The same with something else above black ground.
    fn outlook_on(others: Vec<Mesh>, exposure_ms: f64, gain: f64, holes: Holes) -> Outlook {
        let meshes = [vec![Mesh::level_picture(plain(0), DVec3::ZERO, 5000.0)], others].concat();
        let scene = Scene { meshes, ..Scene::default() };
        let path = flying_east();
        let shutter = Shutter::from_spec(
            &ShutterSpec { readout_ms: 100.0, exposure_ms, ..ShutterSpec::default() },
            5.0,
            [400, 300],
        )
        .unwrap();
        let camera = CameraModel::new([400, 300], [FOCAL_PX; 2], None, LensModel::Pinhole, &[]).unwrap();
        let reach = LensReach::new(Arc::new(camera)).unwrap();
        let (key_pose, gain) = (path.pose(0.0), |_: [u32; 2]| gain);
        let surfaces = Surfaces::new(Arc::new(scene));
        let search = Search {
            reach: &reach,
            surfaces: &surfaces,
            path: &path,
            shutter: &shutter,
            stamp_s: 0.0,
            gain: &gain,
        };
        Outlook::new(
            &search.look_around(),
            &reach.camera,
            &key_pose,
            &SeenPlane::fitted(key_pose, std::iter::empty()),
            holes,
            0.0,
        )
    }

    #[test]
    fn a_roof_has_its_border_and_contrast() {
        let found = outlook(0.0, 1.0, Holes::default()).plain(&read_at(1.0), None);
        // 100 px a side: a band of 6 px along 400 px, of 120 000.
        assert!((found.share / 0.02 - 1.0).abs() < 0.5, "{found:?}");
        assert!((found.contrast_dn - 255.0).abs() < 1e-3, "{found:?}");
        let half = outlook(0.0, 0.5, Holes::default()).plain(&read_at(1.0), None);
        assert_eq!((half.contrast_dn, half.error_dn), (0.5 * found.contrast_dn, 0.5 * found.error_dn));
    }

    #[test]
    fn borders_of_what_is_thin_are_all_counted_whichever_way_they_run() {
        // White bars 1 m wide, which is 2 px, and 4 m apart, all over the picture: along its rows, its
        // columns, its diagonals, or nearly, so that they are not all as far from the middle of a pixel, and
        // between.
        for angle in [0.05, FRAC_PI_2 + 0.05, FRAC_PI_4 + 0.05, 0.4, 0.5_f32] {
            let (sin, cos) = angle.sin_cos();
            let (mut vertices, mut indices) = (Vec::new(), Vec::new());
            for k in -40..40 {
                let first = vertices.len() as u32;
                for [along, across] in [[-200.0, 0.0], [200.0, 0.0], [200.0, 1.0], [-200.0, 1.0_f32]] {
                    let across = across + 4.0 * k as f32;
                    vertices.push(MeshVertex::new(
                        [along * cos - across * sin, along * sin + across * cos, 0.0],
                        [0.0; 2],
                    ));
                }
                indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
            }
            let comb = Mesh::new(vertices, indices, plain(255), DVec3::new(0.0, 0.0, -50.0), Wrap::Clamp);
            let found = outlook_on(vec![comb], 0.0, 1.0, Holes::default());
            // Two borders in 8 px.
            let expected = UNSURE_OF_ALL * SAFETY * SAFETY * 2.0 / 8.0;
            assert!((found.steps / expected - 1.0).abs() < 0.1, "{angle}: {} {expected}", found.steps);
            // Places 3 px apart along rows and columns see bars 2 px wide or miss them.
            assert!(found.share > 0.75, "{angle}: {}", found.share);
            assert_eq!(found.flush, 0.0);
        }
    }

    #[test]
    fn meshes_that_touch_have_borders_that_rays_leave() {
        // White and black stripes of 2 m in one plane, which are 4 px, along the rows and across them.
        let stripes = |tints: &dyn Fn(i32) -> Option<[f32; 2]>| {
            let (mut vertices, mut indices) = (Vec::new(), Vec::new());
            for (k, tints) in (-80..80).filter_map(|k| Some((k, tints(k)?))) {
                let from = vertices.len() as u32;
                let corner = |along: f32, across: i32, tint: f32| {
                    let place = [0.6 * along - 0.8 * across as f32, 0.8 * along + 0.6 * across as f32, 0.0];
                    MeshVertex { tint: [tint, tint, tint, 1.0], ..MeshVertex::new(place, [0.0; 2]) }
                };
                let [low, high] = [(2 * k, tints[0]), (2 * k + 2, tints[1])];
                vertices.extend(
                    [(-200.0, low), (200.0, low), (200.0, high), (-200.0, high)]
                        .map(|(along, (at, tint))| corner(along, at, tint)),
                );
                indices.extend([0, 1, 2, 0, 2, 3].map(|corner| from + corner));
            }
            Mesh::new(vertices, indices, plain(255), DVec3::new(0.0, 0.0, -50.0), Wrap::Clamp)
        };
        let of_number = |k: i32| [(k % 2 == 0) as u8 as f32; 2];
        let only = |odd: i32| move |k: i32| (k.rem_euclid(2) == odd).then(|| of_number(k));
        let found = outlook_on(vec![stripes(&only(0)), stripes(&only(1))], 0.0, 1.0, Holes::default());
        // The same in one mesh, by the colours of its corners; where those change gradually there is no
        // border.
        let in_one = outlook_on(vec![stripes(&|k| Some(of_number(k)))], 0.0, 1.0, Holes::default());
        assert_eq!((in_one.flush, in_one.steps), (found.flush, 0.0));
        let gradual = outlook_on(
            vec![stripes(&|k| Some([k, k + 1].map(|k| 0.5 + k as f32 / 320.0)))],
            0.0,
            1.0,
            Holes::default(),
        );
        assert_eq!((gradual.flush, gradual.steps), (0.0, 0.0));
        let expected = UNSURE_OF_ALL * SAFETY * SAFETY / 4.0;
        assert!((found.flush / expected - 1.0).abs() < 0.1, "{} {expected}", found.flush);
        assert_eq!(found.steps, 0.0);
        let [plain, rays] =
            [found.plain(&read_at(2.0), None), found.with_rays(&read_at(2.0), None, 2, u32::MAX)]
                .map(|of| of.error_dn);
        let left = stairs::left(&stairs::Reading {
            width_px: 2.0,
            taps: TapStage::Bilinear,
            samples_a_pixel: 1,
            exposure: None,
        });
        let rays_alike = rays * SAFETY / SAFETY_WITH_RAYS / found.once_a_pixel.sqrt();
        assert!(
            (plain - rays_alike).abs() < 1e-9 && (plain - 255.0 * (left * found.flush).sqrt()).abs() < 1e-9,
            "{plain} {rays}"
        );
    }

    #[test]
    fn finer_samples_find_the_feet_of_walls() {
        let places = Places::new([(1.0, [1.0, 0.0])].into_iter());
        let feet = Outlook {
            share: 0.5,
            contrast_dn: 100.0,
            hidden_share: 0.0,
            strips: 0.0,
            steps: 0.0,
            steps_apart: 0.0,
            flush: 0.0,
            feet: 1e-3,
            once_a_pixel: 1.0,
            of_ground: 0.0,
            skyline: Skyline::default(),
            places,
        };
        let with_rays = |fine: u32| feet.with_rays(&read_at(2.0), None, fine, u32::MAX).error_dn;
        let less = SAFETY_WITH_RAYS / SAFETY;
        assert!((with_rays(1) / feet.plain(&read_at(2.0), None).error_dn - less).abs() < 1e-12);
        // Of 1/12 in a pixel's width, in pixels half as wide.
        let along_whole_pixels = 255.0 * (1e-3_f64 / 12.0).sqrt() / 2.0;
        assert!(
            (with_rays(3) / along_whole_pixels - less * RAYS_LEAVE.sqrt() / 3.0).abs() < 1e-12,
            "{}",
            with_rays(3)
        );
    }

    #[test]
    fn strips_are_those_within_parallax_and_those_that_are_hidden() {
        let outlook_of = |holes| {
            let found = outlook(0.0, 1.0, holes);
            found.of(found.strips)
        };
        let found = outlook_of(Holes::default());
        // At the roof's two borders across the flight 50 px from the middle: a sixth of the readout from its
        // middle the camera has flown 2/3 m, and (1/100 - 1/150) of that is between roof and ground.
        let width_px = FOCAL_PX * SPEED_M_S * 0.1 / 6.0 * (1.0 / 100.0 - 1.0 / 150.0);
        // All along the other two borders the readout goes by, with parallax along and not across them.
        let at_most_dn = 255.0 * width_px / 7_f64.sqrt();
        assert!(found.at_dn < at_most_dn && found.at_dn > 0.03 * at_most_dn, "{found:?} {at_most_dn}");
        let hidden = outlook_of(Holes { share: 1e-3, narrow_share: 1e-3, ..Holes::default() });
        let added = (hidden.error_dn.powi(2) - found.error_dn.powi(2)) / 255_f64.powi(2);
        assert!((added / (STRIPS * 1e-3) - 1.0).abs() < 1e-9 && hidden.hidden_share == 1e-3, "{hidden:?}");
    }

    #[test]
    fn finer_ideal_frames_and_blur_leave_less() {
        let still = outlook(0.0, 1.0, Holes::default());
        let spline = |scale: f64| Sampling { taps: TapStage::Spline, ..read_at(scale) };
        let [coarse, fine] = [1.0, 2.0].map(|scale| still.plain(&spline(scale), None).at_dn);
        let strips = still.of(still.strips).at_dn;
        assert!(
            fine < 0.6 * coarse && fine > strips && strips > 0.0,
            "the strips stay: {fine} {coarse} {strips}"
        );
        let samples = ExposurePath::STRAIGHT.with_samples(2.0, 64);
        let blurred = outlook(20.0, 1.0, Holes::default()).plain(&spline(1.0), Some(samples));
        assert!(blurred.at_dn < 0.9 * coarse, "{} {coarse}", blurred.at_dn);
        // White on black costs more than a 255th; nothing is left of it.
        assert!(!blurred.are_affordable(1.0) && blurred.are_affordable(16.0), "{blurred:?}");
        let with_rays = |scale: f64, fine: u32| still.with_rays(&spline(scale), None, fine, u32::MAX);
        assert!(with_rays(1.0, 1).error_dn < still.plain(&spline(1.0), None).error_dn);
        assert_eq!(with_rays(2.0, 1), with_rays(1.0, 2));
        // What nothing can leave less of lets nobody think that more would be left.
        for (scale, samples_a_pixel) in
            [1.0, 1.41, 2.0, 2.83, 4.0, 5.0].into_iter().flat_map(|scale| [(scale, 1), (scale, 4)])
        {
            for taps in [TapStage::Bilinear, TapStage::Spline, TapStage::Area, TapStage::Grid { most: 5 }] {
                let plain = still.plain(&Sampling { taps, samples_a_pixel, ..read_at(scale) }, None);
                let at_best = still.plain_at_best(scale, samples_a_pixel > 1);
                assert!(at_best.error_dn < plain.error_dn, "{scale} {samples_a_pixel} {taps:?}");
            }
        }
    }
}
