//! `camsim viewer`.

use std::{io, ops::ControlFlow, path::PathBuf, sync::Arc};

use camsim_core::scenario::{Auto, Solver};
use camsim_engine::{Backend, Engine};
use camsim_io::load::load_rig;
use camsim_viewer::ExportJob;

use super::export::{export_datasets, judge_lenses, with_needs};
use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_source::{EngineSource, FrameSource, ReferenceSource},
    render_run::{Selected, resume_command},
};

/// Open the viewer
#[derive(Debug, clap::Args)]
pub struct ViewerArgs {
    /// Scenario to open; without one, the built-in flight
    scenario: Option<PathBuf>,
}

/// Opens the window and returns when it is closed.
pub fn run(args: &ViewerArgs) -> Result<(), Failure> {
    let exporter = Arc::new(|job: &ExportJob| {
        export(job).map_err(|failure| failure.to_string().trim_start_matches("error: ").to_owned())
    });
    camsim_viewer::run(args.scenario.clone(), Some(exporter)).or_failed()
}

/// Renders the scenario like `camsim render`; warnings go into `run.json`.
pub fn export(job: &ExportJob) -> Result<String, Failure> {
    let (mut out, mut err) = (io::sink(), io::sink());
    let mut console = Console::new(&mut out, &mut err);
    console.set_volume(true, false);
    let rig = job.rig.clone().try_map(|scenario| with_needs(scenario, None, &mut console))?;
    judge_lenses(rig.scenarios().iter(), None)?;
    let loaded = load_rig(&rig).or_bad_input()?;
    let [first, end] = job.frames;
    let frames: Vec<u64> = (first..end.min(loaded[job.camera].sequence.frames)).collect();
    let selected = Selected {
        variation: None,
        rig: &rig,
        loaded: &loaded,
        folder: &job.folder,
        cameras: vec![job.camera],
        frames: vec![frames],
        shard: None,
        resume: false,
        resume_command: resume_command(&job.folder),
    };
    let engine;
    let is_exact = job.rig.first().quality.solver == Auto::Value(Solver::Reference);
    let mut source: Box<dyn FrameSource + '_> = if is_exact {
        Box::new(ReferenceSource::new(selected.first())?)
    } else {
        engine = Engine::open(Backend::Auto)?;
        Box::new(EngineSource::new(&engine, selected.first())?)
    };
    let mut on_frame =
        |_: Option<&str>, _: &_| if job.tick() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
    let outcome = selected.run(&mut *source, &mut console, &mut on_frame)?;
    let seconds = outcome.time.as_secs_f64();
    let datasets = &rig.first().output.datasets;
    export_datasets(&job.folder, datasets, false, &mut console)?;
    let names: Vec<&str> = datasets.iter().map(|dataset| dataset.name()).collect();
    let and_datasets =
        if names.is_empty() { String::new() } else { format!(", with datasets/{}", names.join(", ")) };
    let (pictures, rate, folder) = (outcome.pictures(), outcome.rate(), job.folder.display());
    Ok(format!("{pictures} in {seconds:.1} s, {rate}, in {folder}{and_datasets}"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use camsim_core::scenario::DatasetFormat;
    use camsim_io::scenario_file::read_rig;

    use super::*;

    fn small() -> camsim_core::scenario::Rig {
        let sets = [
            ("camera.size_px", "[64, 48]"),
            ("camera.focal_px", "[50.0, 50.0]"),
            ("camera.principal_point_px", "[31.5, 23.5]"),
            ("output.format", "[\"png\"]"),
        ];
        let sets: Vec<_> = sets.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
        read_rig(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/pattern.toml"), &sets, None)
            .expect("legal")
    }

    #[test]
    #[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
    fn export_matches_render_and_can_be_stopped() {
        let folder = tempfile::tempdir().expect("a folder");
        let job = ExportJob::new(small(), 0, folder.path().join("all"), [3, 6]);
        export(&job).expect("written");
        assert_eq!(job.progress().done, 3);
        assert!(folder.path().join("all/run.json").is_file());
        let names: Vec<String> = (3..6).map(|frame| format!("all/color/frame_{frame:06}.png")).collect();
        assert!(names.iter().all(|name| folder.path().join(name).is_file()), "{names:?}");

        let mut with_dataset = small();
        with_dataset = with_dataset
            .try_map(|mut scenario| {
                scenario.output.format.clear();
                scenario.output.datasets = vec![DatasetFormat::Euroc];
                Ok::<_, ()>(scenario)
            })
            .expect("changed");
        let job = ExportJob::new(with_dataset, 0, folder.path().join("euroc"), [0, 2]);
        let summary = export(&job).expect("written");
        assert!(summary.ends_with(", with datasets/euroc"), "{summary}");
        let list = folder.path().join("euroc/datasets/euroc/mav0/cam0/data.csv");
        assert_eq!(std::fs::read_to_string(list).expect("a list").lines().count(), 3);

        let stopped = ExportJob::new(small(), 0, folder.path().join("stopped"), [0, 40]);
        stopped.cancel();
        let told = export(&stopped).expect_err("stopped").to_string();
        assert!(told.contains("stopped on request"), "{told}");
        assert_eq!(stopped.progress().done, 1, "asked after the first frame");
        let manifest = std::fs::read_to_string(folder.path().join("stopped/run.json")).expect("a manifest");
        assert!(manifest.contains("\"finished\": false"), "{manifest}");
    }
}
