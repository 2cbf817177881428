//! What the net plans and renders: every case of the bench, variations that reach other branches of the
//! planner, and scenarios of the repository.

use std::{path::Path, sync::Arc};

use camsim_core::{
    pose::BodyState,
    scenario::{Auto, Channel, FieldOr, Parity, Preset, Readout, Silhouettes, Solver},
    scenario::{CameraSpec, QualitySpec, ZoomSpec},
    sequence::Sequence,
    trajectory::Trajectory,
};
use camsim_io::{load::load_sequence, scenario_file::read_scenario};
use camsim_lab::{bench::methods::resize, cases};
use camsim_plan::{FramePlan, PlanError, Planner};
use glam::DVec3;

/// Changes a sequence after it has got its size.
type Edit = fn(&mut Sequence);

/// One sequence of the net and the frames of it that are looked at.
pub struct Subject {
    /// Golden file that has its plans.
    pub group: &'static str,
    /// Unique, without spaces.
    pub name: String,
    pub frames: [u64; 2],
    /// Colour alone, or all.
    pub channels: &'static [Channel],
    base: Arc<Sequence>,
    edit: Edit,
}

impl Subject {
    /// At its own size, or at another one with the same view.
    pub fn sequence(&self, size_px: Option<[u32; 2]>) -> Arc<Sequence> {
        let mut sequence = Sequence::clone(&self.base);
        if let Some(size_px) = size_px {
            resize(&mut sequence.scenario, size_px);
        }
        (self.edit)(&mut sequence);
        Arc::new(sequence)
    }

    /// Plans of its frames at its own size; no adapter has a part in them.
    pub fn plans(&self) -> Vec<(u64, Result<FramePlan, PlanError>)> {
        let planner = Planner::new(self.sequence(None), self.channels, 16_384).expect("a planner");
        self.frames.map(|frame| (frame, planner.plan(frame))).into()
    }
}

/// All of them. About a third tells depth and coordinates too; which ones hangs on their names alone, so that
/// others can be added without a change to these.
pub fn subjects() -> Vec<Subject> {
    let cases = cases::cases().expect("cases");
    let case = |name: &str| {
        let found = cases.iter().find(|case| case.name == name);
        found.map(|case| case.sequence.clone()).expect("a case of this name")
    };
    let of_cases = cases.iter().map(|case| ("cases", case.name, case.sequence.clone(), as_it_is as Edit));
    let of_quality = QUALITY.iter().map(|&(name, of, edit)| ("quality", name, case(of), edit));
    let of_camera = CAMERA.iter().map(|&(name, of, edit)| ("camera", name, case(of), edit));
    let of_hovering = HOVERING.iter().map(|&(name, over, pitch_deg, edit)| {
        let base = hover(&case(over), pitch_deg);
        ("camera", name, base, edit)
    });
    let of_files = FILES.iter().map(|&(name, file)| ("files", name, load(file), as_it_is as Edit));
    let all = of_cases.chain(of_quality).chain(of_camera).chain(of_hovering).chain(of_files);
    let numbered = all.map(|(group, name, base, edit)| Subject {
        group,
        name: name.to_owned(),
        frames: if group == "files" { [0, 45] } else { [0, 2] },
        channels: if name.len() % 3 == 0 { ALL_CHANNELS } else { &[Channel::Color] },
        base,
        edit,
    });
    numbered.collect()
}

const ALL_CHANNELS: &[Channel] = &[Channel::Color, Channel::Depth, Channel::Coords, Channel::Valid];

fn as_it_is(_: &mut Sequence) {}

/// Scenarios of the repository: name and path.
const FILES: &[(&str, &str)] = &[
    ("demo", "assets/demo.toml"),
    ("pattern", "assets/pattern.toml"),
    ("bench-all-effects", "benches/all_effects.toml"),
    ("bench-houses", "benches/houses.toml"),
];

/// Demands and tolerances: name, case, what is changed.
const QUALITY: &[(&str, &str, Edit)] = &[
    ("paper", "blender-plane", |s| s.scenario.quality.preset = Preset::Paper),
    ("paper-houses", "all-effects", |s| {
        s.scenario.quality.preset = Preset::Paper;
        s.scenario.quality.blur_samples = Auto::Value(20);
        Arc::make_mut(&mut s.scene).fog_visibility_m = Some(2000.0);
    }),
    ("linear", "combined-58", |s| s.scenario.quality.solver = Auto::Value(Solver::Linear)),
    ("linear-exposure", "exposure-100", |s| s.scenario.quality.solver = Auto::Value(Solver::Linear)),
    ("rk2", "combined-58", |s| s.scenario.quality.solver = Auto::Value(Solver::Rk2)),
    ("reproject", "plane-30", |s| s.scenario.quality.solver = Auto::Value(Solver::Reproject)),
    ("five-look-ups", "terrain-100", |s| s.scenario.quality.iterations = Auto::Value(5)),
    ("blur-samples", "exposure-10", |s| s.scenario.quality.blur_samples = Auto::Value(2)),
    ("taps", "lens-s3", |s| s.scenario.quality.footprint_taps = Auto::Value(3)),
    ("ideal-scale", "terrain-100", |s| s.scenario.quality.ideal_scale = Auto::Value(1.6)),
    ("ideal-samples", "buildings-15", |s| s.scenario.quality.ideal_samples = Auto::Value(4)),
    ("one-key", "buildings-40", |s| s.scenario.quality.key_frames = Auto::Value(1)),
    ("three-keyframes", "rolling-1s-buildings", |s| s.scenario.quality.key_frames = Auto::Value(3)),
    ("no-sharing", "plane-30", |s| s.scenario.quality.frames_per_ideal = 1),
    ("rays", "buildings-15", |s| s.scenario.quality.silhouettes = Silhouettes::Rays),
    ("plain", "buildings-60", |s| s.scenario.quality.silhouettes = Silhouettes::Plain),
    ("loose", "combined-58", |s| s.scenario.quality = tolerances(30.0, 100.0, 3.0)),
    ("loose-shake", "vibration-100", |s| s.scenario.quality = tolerances(1.0, 20.0, 1.0)),
    ("tight", "terrain-100", |s| s.scenario.quality = tolerances(0.005, 0.2, 0.02)),
    ("tight-houses", "vibration-200", |s| s.scenario.quality = tolerances(0.02, 0.3, 0.25)),
    // Refused: a side would be longer than any texture. At the size of renders it is not.
    ("too-large", "plane-30", |s| {
        let scale = f64::from(s.scenario.camera.size_px[0]) / 20.0;
        s.scenario.quality.ideal_scale = Auto::Value(scale);
    }),
];

/// Shutter, lens, light and what is seen: name, case, what is changed.
const CAMERA: &[(&str, &str, Edit)] = &[
    ("columns", "terrain-100", |s| s.scenario.camera.shutter.readout = Readout::LeftToRight),
    ("columns-interlaced", "interlace", |s| s.scenario.camera.shutter.readout = Readout::RightToLeft),
    ("upwards", "combined-58", |s| s.scenario.camera.shutter.readout = Readout::BottomToTop),
    ("odd-field-first", "exposure-10", |s| {
        s.scenario.camera.shutter.interlace_ms = FieldOr::Ms(12.0);
        s.scenario.camera.shutter.first_field = Parity::Odd;
    }),
    ("one-instant", "plane-30", |s| s.scenario.camera.shutter.readout_ms = 0.0),
    ("clean", "all-effects", |s| {
        s.scenario.camera.photometric.noise_sigma = 0.0;
        s.scenario.camera.photometric.light = 1.3;
        s.vignette = None;
    }),
    ("zooming-lens", "lens-euroc", zoom),
    ("fog", "buildings-60", |s| Arc::make_mut(&mut s.scene).fog_visibility_m = Some(800.0)),
    ("glass", "buildings-15", glass),
    ("moving-glass", "buildings-40", glass),
    // The path ends at 60 s.
    ("beyond-the-log", "delay-1s", |s| s.start_s = 59.98),
    (TILED, "terrain-100", as_it_is),
];

/// Is rendered as if textures ended at [`super::pictures::MOST_PICTURE_PX`].
pub const TILED: &str = "tiled-ground";

/// Cameras that stand still: name, the case whose scene they see, pitch, what is changed.
const HOVERING: &[(&str, &str, f64, Edit)] = &[
    ("still", "plane-30", -90.0, as_it_is),
    ("sky-alone", "plane-30", 60.0, as_it_is),
    ("ridges", "rolling-1s", -12.0, |s| s.scenario.quality.silhouettes = Silhouettes::Rays),
    ("ridges-without-rays", "rolling-1s", -12.0, as_it_is),
];

fn tolerances(max_error_px: f64, max_error_dn: f64, max_terrain_error_px: f64) -> QualitySpec {
    QualitySpec { max_error_px, max_error_dn, max_terrain_error_px, ..QualitySpec::default() }
}

/// A lens that gets a fifth longer within the four frames.
fn zoom(sequence: &mut Sequence) {
    let camera = &mut sequence.scenario.camera;
    let entry = |at: f64, part: f64| ZoomSpec {
        at,
        focal_px: camera.focal_px.map(|focal| at * focal),
        principal_point_px: camera.principal_point_px,
        coefficients: camera.lens.coefficients.iter().map(|k| part * k).collect(),
    };
    camera.zoom = vec![entry(1.0, 1.0), entry(1.2, 0.8)];
    sequence.zoom_track = vec![(0.0, 1.0), (0.12, 1.2)];
}

/// The houses become panes through which the ground is seen.
fn glass(sequence: &mut Sequence) {
    let houses = Arc::make_mut(&mut sequence.scene).meshes.last_mut().expect("houses");
    (houses.material.blends, houses.material.cutoff) = (true, Some(0.5));
    Arc::make_mut(&mut houses.shape).vertices.iter_mut().for_each(|vertex| vertex.tint[3] = 0.6);
}

/// A camera without times that stands still over the scene of another sequence.
fn hover(over: &Sequence, pitch_deg: f64) -> Arc<Sequence> {
    let state = BodyState { position_ned_m: DVec3::new(0.0, 0.0, -150.0), ..BodyState::default() };
    let trajectory = Trajectory::uniform(-1.0, 2.0, 1.0, vec![state]).expect("a trajectory");
    let mut camera = CameraSpec::default();
    camera.mount.angles_deg = [0.0, pitch_deg, 0.0];
    Arc::new(cases::sequence(camera, trajectory, (*over.scene).clone()).expect("a sequence"))
}

fn load(file: &str) -> Arc<Sequence> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let scenario = read_scenario(&root.join(file), &[], None).expect(file);
    load_sequence(&scenario).expect(file).sequence
}
