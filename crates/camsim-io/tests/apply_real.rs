//! `camsim apply` on RGB-D frames that cameras and renderers of other people took. Runs where CAMSIM_DATA
//! names the data folder.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use camsim_core::{
    apply::{Motion, Pipeline, Settings},
    frame::RenderedFrame,
    scenario::{CameraSpec, ShutterSpec},
};
use camsim_io::frame_file::{FrameFile, read_frame};

fn data() -> Option<PathBuf> {
    let found = std::env::var_os("CAMSIM_DATA").map(|data| PathBuf::from(data).join("rgbd"));
    if found.is_none() {
        eprintln!("CAMSIM_DATA is not set: real RGB-D frames are not put through a camera");
    }
    found
}

/// A set of frames: names by number from 1, what one metre is stored as, focal lengths and principal point; y
/// up as it was published.
struct Set {
    folder: &'static str,
    color: &'static str,
    depth: &'static str,
    per_metre: f64,
    focal_px: [f64; 2],
    centre_px: [f64; 2],
    y_up: bool,
}

const KINECT: Set = Set {
    folder: "slambook_ch5_kinect",
    color: "color_#.png",
    depth: "depth_#.pgm",
    per_metre: 1000.0,
    focal_px: [518.0, 519.0],
    centre_px: [325.5, 253.5],
    y_up: false,
};
const RENDERED: Set = Set {
    folder: "slambook_ch12_iclnuim",
    color: "color_#.png",
    depth: "depth_#.png",
    per_metre: 5000.0,
    focal_px: [481.2, 480.0],
    centre_px: [319.5, 239.5],
    y_up: true,
};
const DESK: Set = Set {
    folder: "slambook_ch7_tum_fr2desk",
    color: "#.png",
    depth: "#_depth.png",
    per_metre: 5000.0,
    focal_px: [520.9, 521.0],
    centre_px: [325.1, 249.7],
    y_up: false,
};

impl Set {
    fn frame_toml(&self, data: &Path, number: usize, rest: &str) -> String {
        let file = |name: &str| {
            data.join(self.folder).join(name.replace('#', &number.to_string())).display().to_string()
        };
        format!(
            "color = {:?}\ndepth = {:?}\ndepth_per_metre = {:?}\nfocal_px = {:?}\nprincipal_point_px = \
                {:?}\n{rest}",
            file(self.color),
            file(self.depth),
            self.per_metre,
            self.focal_px,
            self.centre_px
        )
    }

    fn camera(&self, shutter: ShutterSpec) -> CameraSpec {
        CameraSpec {
            size_px: [640, 480],
            focal_px: self.focal_px,
            principal_point_px: Some(self.centre_px),
            shutter,
            ..CameraSpec::default()
        }
    }

    /// A row `t_s,x,y,z,qw,qx,qy,qz`. With y up the world is mirrored with the camera, which turns two of the
    /// axes of rotation around.
    fn pose_row(&self, data: &Path, number: usize, t_s: f64) -> String {
        let text = std::fs::read_to_string(data.join(self.folder).join("pose.txt")).unwrap();
        let numbers: Vec<f64> = text
            .lines()
            .nth(number - 1)
            .unwrap()
            .split_whitespace()
            .map(|word| word.parse().unwrap())
            .collect();
        let [x, y, z, qx, qy, qz, qw] = numbers[..] else { panic!("seven numbers") };
        let sign = if self.y_up { -1.0 } else { 1.0 };
        format!("{t_s},{x},{},{z},{qw},{},{qy},{}\n", sign * y, sign * qx, sign * qz)
    }

    fn read(&self, data: &Path, folder: &Path, number: usize, rest: &str) -> FrameFile {
        let path = folder.join("FRAME.toml");
        std::fs::write(&path, self.frame_toml(data, number, rest)).unwrap();
        read_frame(&path).unwrap()
    }
}

/// What frame `from` shows from the place of frame `to`, and frame `to` itself.
fn carried(set: &Set, data: &Path, from: usize, to: usize) -> (RenderedFrame, FrameFile) {
    let folder = tempfile::tempdir().unwrap();
    let rows = set.pose_row(data, from, 0.0) + &set.pose_row(data, to, 1.0);
    std::fs::write(folder.path().join("poses.csv"), format!("t_s,x,y,z,qw,qx,qy,qz\n{rows}")).unwrap();
    // Taken a second before the stamp, at which the camera is where the other frame was taken.
    let rest = "holes = \"mark\"\ninstant_ms = -1000\n[motion]\ntrajectory = \"poses.csv\"\nstamp_s = 1.0\n";
    let file = set.read(data, folder.path(), from, rest);
    let spec = set.camera(ShutterSpec::default());
    let rendered =
        Pipeline::new(&spec, &file.frame, &file.motion, &Settings::default()).unwrap().render(None);
    (rendered, set.read(data, folder.path(), to, ""))
}

/// Of the pixels with depth in both: how many, the share whose depths agree within 5 %, and the median
/// difference of colour there.
fn agreement(rendered: &RenderedFrame, own: &FrameFile) -> (usize, f64, f32) {
    let depth_m = rendered.depth_m.as_ref().unwrap();
    let both: Vec<usize> =
        (0..depth_m.len()).filter(|&i| depth_m[i] > 0.0 && own.frame.inverse_depth[i] > 0.0).collect();
    let agree: Vec<usize> = both
        .iter()
        .copied()
        .filter(|&i| (depth_m[i] * own.frame.inverse_depth[i] - 1.0).abs() < 0.05)
        .collect();
    let color = |i: &usize| {
        (0..3)
            .map(|c| (rendered.color_rgba[4 * i + c] - own.frame.color_rgba[4 * i + c]).abs())
            .fold(0.0, f32::max)
    };
    let mut differences: Vec<f32> = agree.iter().map(color).collect();
    differences.sort_by(f32::total_cmp);
    (both.len(), agree.len() as f64 / both.len() as f64, differences[differences.len() / 2])
}

/// The published poses are not exact (4 and 5 of the rendered room are 1.4 % apart in depth): projecting the
/// points of one frame into the other, in a few lines of numpy, finds 95.7, 96.2, 96.6 and 90.4 % within 5 %.
/// What is asked for is that, less what the first could not see.
///
/// The exact relative pose with depth, held against the world itself: one frame, carried to where the next
/// was taken, is the next.
#[test]
fn a_frame_carried_to_the_place_of_another_is_that_other() {
    let Some(data) = data() else { return };
    for (set, from, to, least, darkest) in [
        (&RENDERED, 4, 5, 0.95, 0.02),
        (&RENDERED, 5, 4, 0.95, 0.02),
        (&KINECT, 4, 5, 0.94, 0.02),
        (&KINECT, 3, 4, 0.86, 0.03),
    ] {
        let (rendered, own) = carried(set, &data, from, to);
        let (both, agree, color) = agreement(&rendered, &own);
        // The same without the motion: what the test could not tell from a right answer.
        let still = set.camera(ShutterSpec::default());
        let folder = tempfile::tempdir().unwrap();
        let file = set.read(&data, folder.path(), from, "");
        let unmoved =
            Pipeline::new(&still, &file.frame, &file.motion, &Settings::default()).unwrap().render(None);
        let (_, by_chance, _) = agreement(&unmoved, &own);
        eprintln!(
            "{} {from} -> {to}: {both} px with depth in both, {:.1} % agree ({:.1} % unmoved), colour \
                {color:.4}",
            set.folder,
            100.0 * agree,
            100.0 * by_chance
        );
        assert!(
            both > 100_000 && agree > least && agree > by_chance && color < darkest,
            "{} {from} -> {to}: {both} {agree} {by_chance} {color}",
            set.folder
        );
    }
}

/// Rolling shutter and blur on every frame: no depth comes out that no texel beside the source has, so
/// silhouettes hold, and holes that are marked stay empty.
#[test]
fn silhouettes_hold_in_every_frame() {
    let Some(data) = data() else { return };
    let frames = (1..=5)
        .map(|i| (&KINECT, i))
        .chain((1..=5).map(|i| (&RENDERED, i)))
        .chain((1..=2).map(|i| (&DESK, i)));
    for (set, number) in frames {
        let folder = tempfile::tempdir().unwrap();
        let rest = "holes = \"mark\"\n[motion]\nvelocity_m_s = [1.5, 0.0, 0.5]\nangular_rate_rad_s = [0.0, \
            0.3, 0.4]\n";
        let file = set.read(&data, folder.path(), number, rest);
        let spec = set.camera(ShutterSpec { readout_ms: 100.0, exposure_ms: 10.0, ..ShutterSpec::default() });
        let pipeline = Pipeline::new(&spec, &file.frame, &file.motion, &Settings::default()).unwrap();
        let (own, foreign, holes) = sources(&pipeline, &spec, &file);
        eprintln!(
            "{} {number}: {own} sources on a surface of their own, {foreign} between two, {holes} in holes",
            set.folder
        );
        // Others stand in for what was hidden, beside silhouettes: 1.3 % of the second Kinect frame, less
        // elsewhere.
        assert!(own > 50_000 && foreign * 50 < own, "{} {number}: {own} {foreign}", set.folder);
        assert_eq!(holes > 0, file.without_depth > 0.0, "{} {number}", set.folder);
    }
}

/// Sources whose surface is within 5 % of the depth of a texel beside it, others, and holes; of every third
/// pixel.
fn sources(pipeline: &Pipeline<'_>, spec: &CameraSpec, file: &FrameFile) -> (usize, usize, usize) {
    let Motion::Twist(_) = &file.motion else { panic!("a twist") };
    let [width, height] = file.frame.geometry.size_px;
    let (mut own, mut foreign, mut holes) = (0, 0, 0);
    for (x, y) in
        (0..480).flat_map(|y| (0..640).step_by(3).map(move |x| (x + y % 3, y))).filter(|(x, _)| *x < 640)
    {
        match pipeline.source([x, y], 0.0) {
            Err(camsim_core::apply::NoSource::Hole) => holes += 1,
            Err(_) => {}
            Ok(source) => {
                let focal = glam::DVec2::from_array(spec.focal_px);
                let uv = (glam::DVec2::new(x.into(), y.into())
                    - glam::DVec2::from_array(spec.principal_point_px.unwrap()))
                    / focal;
                let dt_s = ((f64::from(y) + 0.5) / 480.0 - 0.5) * 0.1;
                let (rotation, shift) = file.motion.key_from(dt_s, 0.0);
                let in_key = (rotation * uv.extend(1.0)) / source.inverse_depth + shift;
                let texel = |dx: f64, dy: f64| {
                    let at = (source.position_px + glam::DVec2::new(dx, dy)).round();
                    let (x, y) = (
                        at.x.clamp(0.0, f64::from(width - 1)) as usize,
                        at.y.clamp(0.0, f64::from(height - 1)) as usize,
                    );
                    f64::from(file.frame.inverse_depth[y * width as usize + x])
                };
                let beside =
                    [-1.0, 0.0, 1.0].into_iter().flat_map(|dx| [-1.0, 0.0, 1.0].map(|dy| texel(dx, dy)));
                let met = beside.into_iter().any(|w| (w * in_key.z - 1.0).abs() < 0.05);
                if met { own += 1 } else { foreign += 1 }
            }
        }
    }
    (own, foreign, holes)
}
