//! Tests `camsim apply` on published RGB-D frames. Runs only if CAMSIM_DATA names the data folder.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use camsim_core::{
    apply::{Motion, Pipeline, Settings},
    frame::RenderedFrame,
    scenario::{CameraSpec, ShutterSpec},
};
use camsim_io::frame_file::{FrameFile, read_frame};

/// Folder of the RGB-D frames, if CAMSIM_DATA is set.
fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("CAMSIM_DATA").map(|data| PathBuf::from(data).join("rgbd"));
    if folder.is_none() {
        eprintln!("CAMSIM_DATA is not set: real RGB-D frames are not put through a camera");
    }
    folder
}

/// A series of published frames, numbered from 1: file names, stored value of one metre, focal lengths and
/// principal point in pixels, and whether y points up in its poses.
struct FrameSeries {
    folder: &'static str,
    color: &'static str,
    depth: &'static str,
    per_metre: f64,
    focal_px: [f64; 2],
    centre_px: [f64; 2],
    y_up: bool,
}

const KINECT: FrameSeries = FrameSeries {
    folder: "slambook_ch5_kinect",
    color: "color_#.png",
    depth: "depth_#.pgm",
    per_metre: 1000.0,
    focal_px: [518.0, 519.0],
    centre_px: [325.5, 253.5],
    y_up: false,
};
const RENDERED: FrameSeries = FrameSeries {
    folder: "slambook_ch12_iclnuim",
    color: "color_#.png",
    depth: "depth_#.png",
    per_metre: 5000.0,
    focal_px: [481.2, 480.0],
    centre_px: [319.5, 239.5],
    y_up: true,
};
const DESK: FrameSeries = FrameSeries {
    folder: "slambook_ch7_tum_fr2desk",
    color: "#.png",
    depth: "#_depth.png",
    per_metre: 5000.0,
    focal_px: [520.9, 521.0],
    centre_px: [325.1, 249.7],
    y_up: false,
};

impl FrameSeries {
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

    /// A row `t_s,x,y,z,qw,qx,qy,qz`. Where y points up the world and the camera are mirrored, which negates
    /// y and two components of the rotation.
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

/// Frame `from`, rendered at the pose of frame `to`, and frame `to` itself.
fn warped(set: &FrameSeries, data: &Path, from: usize, to: usize) -> (RenderedFrame, FrameFile) {
    let folder = tempfile::tempdir().unwrap();
    let rows = set.pose_row(data, from, 0.0) + &set.pose_row(data, to, 1.0);
    std::fs::write(folder.path().join("poses.csv"), format!("t_s,x,y,z,qw,qx,qy,qz\n{rows}")).unwrap();
    // The frame was taken one second before the stamp, when the camera is at the pose of the other frame.
    let rest = "holes = \"mark\"\ninstant_ms = -1000\n[motion]\ntrajectory = \"poses.csv\"\nstamp_s = 1.0\n";
    let file = set.read(data, folder.path(), from, rest);
    let spec = set.camera(ShutterSpec::default());
    let rendered =
        Pipeline::new(&spec, &file.frame, &file.motion, &Settings::default()).unwrap().render(None);
    (rendered, set.read(data, folder.path(), to, ""))
}

/// Number of pixels with depth in both frames, the fraction whose depths agree within 5 %, and their median
/// difference of colour.
fn agreement(rendered: &RenderedFrame, own: &FrameFile) -> (usize, f64, f32) {
    let depth_m = rendered.depth_m().unwrap();
    let both: Vec<usize> =
        (0..depth_m.len()).filter(|&i| depth_m[i] > 0.0 && own.frame.inverse_depth[i] > 0.0).collect();
    let agree: Vec<usize> = both
        .iter()
        .copied()
        .filter(|&i| (depth_m[i] * own.frame.inverse_depth[i] - 1.0).abs() < 0.05)
        .collect();
    let color = |i: &usize| {
        (0..3)
            .map(|c| (rendered.color_rgba()[4 * i + c] - own.frame.color_rgba[4 * i + c]).abs())
            .fold(0.0, f32::max)
    };
    let mut differences: Vec<f32> = agree.iter().map(color).collect();
    differences.sort_by(f32::total_cmp);
    (both.len(), agree.len() as f64 / both.len() as f64, differences[differences.len() / 2])
}

/// A frame that is rendered at the pose of another one must match that one.
///
/// The published poses are not exact: frames 4 and 5 of the rendered room differ by 1.4 % in depth.
/// Projection of the points of one frame into the other with numpy finds 95.7, 96.2, 96.6 and 90.4 % within 5
/// %. The limits are slightly lower, as some surfaces are hidden in the first frame.
#[test]
fn frames_rendered_at_the_pose_of_another_match_it() {
    let Some(data) = data() else { return };
    for (set, from, to, min_agreement, max_difference) in [
        (&RENDERED, 4, 5, 0.95, 0.02),
        (&RENDERED, 5, 4, 0.95, 0.02),
        (&KINECT, 4, 5, 0.94, 0.02),
        (&KINECT, 3, 4, 0.86, 0.03),
    ] {
        let (rendered, own) = warped(set, &data, from, to);
        let (both, agree, color) = agreement(&rendered, &own);
        // Without motion fewer pixels agree: the baseline of the test.
        let still = set.camera(ShutterSpec::default());
        let folder = tempfile::tempdir().unwrap();
        let file = set.read(&data, folder.path(), from, "");
        let unmoved =
            Pipeline::new(&still, &file.frame, &file.motion, &Settings::default()).unwrap().render(None);
        let (_, baseline, _) = agreement(&unmoved, &own);
        eprintln!(
            "{} {from} -> {to}: {both} px with depth in both, {:.1} % agree ({:.1} % unmoved), colour \
                {color:.4}",
            set.folder,
            100.0 * agree,
            100.0 * baseline
        );
        assert!(
            both > 100_000 && agree > min_agreement && agree > baseline && color < max_difference,
            "{} {from} -> {to}: {both} {agree} {baseline} {color}",
            set.folder
        );
    }
}

/// Renders every frame with rolling shutter and blur. The depth of a source must be that of a texel next to
/// it, so that silhouettes stay sharp, and marked holes stay invalid.
#[test]
fn silhouettes_stay_sharp_in_all_frames() {
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
        // Disocclusions beside silhouettes are filled by other surfaces: 1.3 % of the second Kinect frame,
        // less in the others.
        assert!(own > 50_000 && foreign * 50 < own, "{} {number}: {own} {foreign}", set.folder);
        assert_eq!(holes > 0, file.without_depth > 0.0, "{} {number}", set.folder);
    }
}

/// Counts, among every third pixel, sources whose depth is within 5 % of that of a texel next to it, other
/// sources, and holes.
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
                    let texel_px = (source.position_px + glam::DVec2::new(dx, dy)).round();
                    let (x, y) = (
                        texel_px.x.clamp(0.0, f64::from(width - 1)) as usize,
                        texel_px.y.clamp(0.0, f64::from(height - 1)) as usize,
                    );
                    f64::from(file.frame.inverse_depth[y * width as usize + x])
                };
                let neighbours =
                    [-1.0, 0.0, 1.0].into_iter().flat_map(|dx| [-1.0, 0.0, 1.0].map(|dy| texel(dx, dy)));
                let matches = neighbours.into_iter().any(|w| (w * in_key.z - 1.0).abs() < 0.05);
                if matches { own += 1 } else { foreign += 1 }
            }
        }
    }
    (own, foreign, holes)
}
