//! Output frames of the cpu where the gpu's part of another frame fails: frames before and after it are those
//! of a run without a fault. The test removes shaders, so it has its own test binary and runs in a process of
//! its own.

mod common;

use std::{
    convert::Infallible,
    path::{Path, PathBuf},
    process::Command,
};

use camsim_core::scenario::{
    Auto, Channel, LensModel, LensSpec, MountSpec, Scenario, ShutterSpec, Silhouettes, Solver,
};
use camsim_engine::{Engine, Finished, Session};
use camsim_plan::Backend;
use camsim_plan::placement::cpu_takes_copies;
use common::{city, engine, pattern, scenario, sequence, steady};
use glam::DVec3;

const TEST: &str = "a_failed_gpu_pass_changes_no_other_frame";

/// The camera of a flight over ground alone, then over houses 200 m further north.
fn flight() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [96, 72];
    scenario.camera.focal_px = [100.0, 100.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario.camera.lens =
        LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05, 0.001, -0.002] };
    scenario.camera.shutter = ShutterSpec { readout_ms: 20.0, exposure_ms: 4.0, ..ShutterSpec::default() };
    scenario.quality.silhouettes = Silhouettes::Rays;
    scenario.quality.solver = Auto::Value(Solver::Reproject);
    scenario
}

const OVER_GROUND: [u64; 2] = [2, 3];
const OVER_HOUSES: u64 = 95;

fn session(engine: &Engine) -> Session<'_> {
    let mut scene = pattern(6000.0);
    for mut house in city(4).meshes.into_iter().skip(1) {
        house.origin_ned_m.x += 200.0;
        scene.meshes.push(house);
    }
    let sequence = sequence(flight(), steady(120.0, 0.0, DVec3::new(63.0, 0.0, 0.0), DVec3::ZERO), scene);
    engine.session::<Infallible>(sequence, &[Channel::Color]).expect("session")
}

/// The frames that were finished, and whether all were.
fn render(session: &mut Session<'_>, frames: &[u64]) -> (Vec<Finished>, bool) {
    let mut all_finished = Vec::new();
    let mut keep = |finished: Finished| {
        all_finished.push(finished);
        Ok(())
    };
    let all = session
        .render::<Infallible>(frames.iter().copied(), &mut keep)
        .inspect_err(|fault| eprintln!("{fault}"))
        .is_ok();
    (all_finished, all)
}

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("shaders").map(|entry| entry.expect("an entry")) {
        let to = to.join(entry.file_name());
        match entry.file_type().expect("a kind").is_dir() {
            true => copy_folder(&entry.path(), &to),
            false => drop(std::fs::copy(entry.path(), to).expect("a copy")),
        }
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_failed_gpu_pass_changes_no_other_frame() {
    let Some(folder) = std::env::var_os("CAMSIM_SHADER_DIR").map(PathBuf::from) else {
        let folder = std::env::temp_dir().join(format!("camsim-faults-{}", std::process::id()));
        copy_folder(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../camsim-gpu/shaders"), &folder);
        let again = Command::new(std::env::current_exe().expect("this program"))
            .args(["--exact", TEST])
            .env("CAMSIM_SHADER_DIR", &folder)
            .output()
            .expect("it runs");
        std::fs::remove_dir_all(&folder).expect("the copy goes");
        let printed = String::from_utf8_lossy(&again.stdout);
        assert!(
            again.status.success() && printed.contains("1 passed"),
            "{printed}{}",
            String::from_utf8_lossy(&again.stderr)
        );
        return;
    };
    let mut engine = engine();
    engine.set_backend(Backend::GpuThenCpu);
    let mut whole = session(&engine);
    let (expected, all) = render(&mut whole, &OVER_GROUND);
    assert!(
        all && expected.iter().all(|done| cpu_takes_copies(&done.plan) && done.times.reverse_ms.is_some())
    );
    assert!(
        !cpu_takes_copies(&whole.planner().plan(OVER_HOUSES).expect("a plan")),
        "silhouette rays are the gpu's"
    );
    let same = |finished: &[Finished]| {
        finished.iter().zip(&expected).all(|(a, b)| a.frame.color_rgba() == b.frame.color_rgba())
    };

    let rays = folder.join("reverse/edges/silhouette_rays.wgsl");
    let text = std::fs::read(&rays).expect("the shader");
    std::fs::remove_file(&rays).expect("it goes");
    let mut session = session(&engine);
    // A frame is in flight each time; the first time the lens map is still being made.
    for round in 0..4 {
        let (finished, all) = render(&mut session, &[OVER_GROUND[0], OVER_HOUSES, OVER_GROUND[1]]);
        assert!(
            !all && finished.len() == 1 && same(&finished),
            "{round}: the frame before the fault is unchanged"
        );
    }
    // Without a frame in flight.
    for _ in 0..3 {
        assert_eq!(render(&mut session, &[OVER_HOUSES]).0.len(), 0);
    }
    std::fs::write(&rays, text).expect("it comes back");
    for round in 0..3 {
        let (finished, all) = render(&mut session, &[OVER_GROUND[0], OVER_GROUND[1], OVER_HOUSES]);
        assert!(
            all && finished.len() == 3 && same(&finished),
            "{round}: the frames after the fault are unchanged"
        );
    }
}
