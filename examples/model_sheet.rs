//! Every model below a folder, side by side: what it looks like, what of it is not shown, and which files are
//! refused and why.
//!
//! ```text
//! cargo run --release --example model_sheet -- FOLDER [SHEET.png] [SECONDS]
//! ```
//!
//! Models stand in the order of the list, six a row; those with animations as they are at SECONDS (0.6).

#![allow(clippy::print_stdout, reason = "the list is half of what this program is for")]

use std::{
    error::Error,
    path::{Path, PathBuf},
    sync::Arc,
};

use camsim_core::{
    frame::{Plane, RenderedFrame},
    mount::CameraPath,
    pose::BodyState,
    scenario::{Channel, FlightSpec, Scenario},
    scene::{Aabb, Mesh, Scene},
    sequence::Sequence,
    trajectory::Trajectory,
};
use camsim_engine::{AdapterChoice, Engine};
use camsim_io::{
    gltf_file::{GltfOptions, Model, read_gltf},
    write::{WriteError, contact_sheet},
};
use glam::{DQuat, DVec3, EulerRot};

const COLUMNS: u32 = 6;
const SIZE_PX: [u32; 2] = [320, 240];
const FOCAL_PX: f64 = 260.0;
/// Distance of the camera, radii of the model; from above on the left, but for what is flat.
const AWAY: f64 = 2.6;
const YAW_PITCH_DEG: [f64; 2] = [25.0, -20.0];
/// Flat is what has less depth than this part of its width or height.
const FLAT: f64 = 0.2;
const SKY: [f32; 3] = [0.1, 0.13, 0.21];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("usage: model_sheet FOLDER [SHEET.png] [SECONDS]")?);
    let sheet = PathBuf::from(arguments.next().unwrap_or_else(|| "models.png".into()));
    let seconds: f64 = arguments.next().map_or(Ok(0.6), |text| text.parse())?;
    let mut files = Vec::new();
    find(&folder, &mut files)?;
    files.sort();
    let engine = Engine::new(AdapterChoice::Best)?;
    let (mut frames, mut refused) = (Vec::new(), Vec::new());
    for file in &files {
        match read_gltf(file, GltfOptions { time_s: Some(seconds), ..GltfOptions::default() }) {
            Err(error) => refused.push(error.to_string()),
            Ok(model) => {
                let cell = [frames.len() as u32 / COLUMNS + 1, frames.len() as u32 % COLUMNS + 1];
                let name = file.strip_prefix(&folder).unwrap_or(file).display();
                println!("row {} column {}: {name}, {} triangles", cell[0], cell[1], model.triangles());
                model.notes.iter().for_each(|note| println!("    {note}"));
                frames.push(portrait(&engine, &model)?);
            }
        }
    }
    println!("{} of {} files are refused", refused.len(), files.len());
    refused.iter().for_each(|error| println!("    {error}"));
    // Whole rows.
    let blank = RenderedFrame {
        planes: vec![Plane::color(vec![0.0; 4 * (SIZE_PX[0] * SIZE_PX[1]) as usize])],
        ..frames.first().ok_or("no model can be shown")?.clone()
    };
    frames.resize(frames.len().next_multiple_of(COLUMNS as usize), blank);
    contact_sheet(&sheet, &frames, COLUMNS, 1)?;
    println!("{}", sheet.display());
    Ok(())
}

/// All models below a folder.
fn find(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    for entry in folder.read_dir().map_err(|error| format!("{}: {error}", folder.display()))? {
        let path = entry?.path();
        let is_model = path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("glb") || ending.eq_ignore_ascii_case("gltf"));
        if path.is_dir() {
            find(&path, files)?;
        } else if is_model {
            files.push(path);
        }
    }
    Ok(())
}

/// The model with its front to the south, as seen from there.
fn portrait(engine: &Engine, model: &Model) -> Result<RenderedFrame, Box<dyn Error>> {
    let place = |scale: f64| model.place(DVec3::ZERO, std::f64::consts::PI, scale).collect::<Vec<Mesh>>();
    let around = |meshes: &[Mesh]| meshes.iter().fold(Aabb::EMPTY, |all, mesh| all.union(&mesh.bounds()));
    let true_size = around(&place(1.0));
    let radius_m =
        if true_size.is_empty() { 1.0 } else { (0.5 * (true_size.max - true_size.min).length()).max(1e-9) };
    let meshes = place(1.0 / radius_m);
    let bounds = around(&meshes);
    let centre = if bounds.is_empty() { DVec3::ZERO } else { bounds.centre() };
    let size = bounds.max - bounds.min;
    let [yaw, pitch] =
        if size.x < FLAT * size.y.max(size.z) { [0.0; 2] } else { YAW_PITCH_DEG.map(f64::to_radians) };
    let ned_from_body = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, 0.0);
    let state = BodyState {
        position_ned_m: centre - AWAY * (ned_from_body * DVec3::X),
        ned_from_body,
        ..BodyState::default()
    };
    let sequence = sequence(state, Scene { meshes, sky_linear: SKY, ..Scene::default() })?;
    let mut rendered = RenderedFrame::default();
    engine.session::<WriteError>(sequence, &[Channel::Color])?.render::<WriteError>(
        [0],
        &mut |finished| {
            rendered = finished.frame;
            Ok(())
        },
    )?;
    Ok(rendered)
}

/// One frame of a camera that stands still.
fn sequence(state: BodyState, scene: Scene) -> Result<Arc<Sequence>, Box<dyn Error>> {
    let flight = FlightSpec {
        log: "none".into(),
        format: Default::default(),
        time_unit: Default::default(),
        angle_unit: Default::default(),
        angles: Default::default(),
        attitude: Default::default(),
        origin: Default::default(),
        height: Default::default(),
        height_from: Default::default(),
        ..FlightSpec::default()
    };
    let mut scenario = Scenario {
        seed: 0,
        flight,
        tracker: Default::default(),
        camera: Default::default(),
        scene: Default::default(),
        quality: Default::default(),
        output: Default::default(),
        imu: Vec::new(),
        gnss: Vec::new(),
        barometer: Vec::new(),
        magnetometer: Vec::new(),
    };
    (scenario.camera.size_px, scenario.camera.focal_px) = (SIZE_PX, [FOCAL_PX; 2]);
    let path = CameraPath::new(
        Trajectory::uniform(-1.0, 2.0, 1.0, vec![state]).ok_or("no trajectory")?,
        &scenario.camera.mount,
    )?;
    Ok(Arc::new(Sequence::in_memory(scenario, path, scene, 1)))
}
