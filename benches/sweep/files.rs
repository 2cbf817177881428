//! Frame rates of the program with and without files.

use std::{path::Path, process::Command};

use camsim::lab::timing::{peak_memory_mb, quartiles};

use crate::{
    flight::{
        Outcome,
        comparison::{NO_ADAPTER, PRESET, Renderers},
        rounds::median_ratio,
    },
    scenario::{ALL_EFFECTS, in_repository},
};

const ROUNDS: usize = 3;
/// Those that are measured, or rendered once.
const FRAMES: [&str; 2] = ["32..64", "32"];
/// File formats and their options.
const FORMATS: [(&str, &[&str]); 5] = [
    ("none", &["--format", "none"]),
    ("EXR, uncompressed", &["--format", "exr", "--set", "output.exr_compression=none"]),
    ("EXR, zip1 (default)", &["--format", "exr"]),
    ("EXR, piz", &["--format", "exr", "--set", "output.exr_compression=piz"]),
    ("PNG", &["--format", "png"]),
];

/// One command line of `camsim render`, with what it printed.
pub struct Program {
    scenario: &'static str,
    backend: &'static str,
    options: Vec<&'static str>,
    pub frames_per_s: Vec<f64>,
    peak_mb: Vec<f64>,
}

impl Program {
    pub fn new(scenario: &'static str, backend: &'static str, options: &[&[&'static str]]) -> Self {
        Self { scenario, backend, options: options.concat(), frames_per_s: Vec::new(), peak_mb: Vec::new() }
    }

    /// Renders to a new folder.
    pub fn run(&mut self, folder: &Path) -> Outcome<()> {
        let run = Command::new(env!("CARGO_BIN_EXE_camsim"))
            .args(["render".as_ref(), in_repository(self.scenario).as_os_str()])
            .args(["--backend", self.backend])
            .args(&self.options)
            .args(["--times", "-o"])
            .arg(folder)
            .output()?;
        let text = String::from_utf8_lossy(&run.stdout).into_owned();
        let number_before = |mark: &str| {
            text.split(mark).next().and_then(|before| before.split_whitespace().last()?.parse::<f64>().ok())
        };
        let rate = number_before(" frames/s")
            .ok_or_else(|| format!("no frame rate in: {text}{}", String::from_utf8_lossy(&run.stderr)))?;
        self.frames_per_s.push(rate);
        self.peak_mb.extend(number_before(" MB at most"));
        std::fs::remove_dir_all(folder)?;
        Ok(())
    }
}

/// Table by file format.
pub fn files(renderers: &Renderers, is_measuring: bool) -> Outcome<()> {
    let folder = tempfile::tempdir()?;
    let has_gpu = renderers.gpu.is_some();
    let formats = &FORMATS[..if is_measuring { FORMATS.len() } else { 2 }];
    let backends: &[&str] = if has_gpu { &["cpu", "gpu"] } else { &["cpu"] };
    let frames = ["--frames", FRAMES[usize::from(!is_measuring)]];
    let mut programs: Vec<Program> = formats
        .iter()
        .flat_map(|(_, options)| {
            backends.iter().map(|backend| Program::new(ALL_EFFECTS, backend, &[options, &frames]))
        })
        .collect();
    let (preset_backend, _) = renderers.preset();
    let paper: &[&str] = &["--set", "quality.preset=paper"];
    programs.push(Program::new(ALL_EFFECTS, preset_backend, &[FORMATS[0].1, &frames, paper]));
    for round in 0..if is_measuring { ROUNDS } else { 1 } {
        let count = programs.len();
        for place in 0..count {
            programs[(place + round) % count].run(&folder.path().join("frames"))?;
        }
    }
    println!(
        "\nrounds    {} of frames {}, all programs in turn; medians, quartiles in brackets\n",
        programs[0].frames_per_s.len(),
        frames[1]
    );
    let titles = [
        "files",
        "cpu, frames/s",
        "gpu, frames/s",
        &format!("{PRESET} ({preset_backend}), frames/s"),
        "cpu, times the rate without files",
        "gpu, times the rate without files",
        "cpu, peak memory, MB",
        "gpu, peak memory, MB",
    ];
    println!("| {} |\n|{}", titles.join(" | "), "---|".repeat(titles.len()));
    let preset = programs.last();
    for (row, (name, _)) in formats.iter().enumerate() {
        let program = |column: usize| programs.get(row * backends.len() + column);
        let pair = [program(0), program(1).filter(|_| has_gpu)];
        let rates = pair.map(|program| program.map_or(NO_ADAPTER.to_owned(), rate));
        let preset_rate = preset.filter(|_| row == 0).map_or(String::new(), rate);
        let ratios = [0, 1].map(|k: usize| {
            pair[k].map_or(String::new(), |program| {
                format!("{:.2}", median_ratio(&program.frames_per_s, &programs[k].frames_per_s))
            })
        });
        let peaks = pair.map(|program| {
            program.map_or(String::new(), |program| format!("{:.0}", quartiles(&program.peak_mb)[1]))
        });
        println!(
            "| {name} | {} | {preset_rate} | {} | {} |",
            rates.join(" | "),
            ratios.join(" | "),
            peaks.join(" | ")
        );
    }
    if let Some(mb) = peak_memory_mb() {
        println!("\npeak memory of this program, with the sessions of the tables above: {mb:.0} MB");
    }
    Ok(())
}

/// Frames per second: median and quartiles.
fn rate(program: &Program) -> String {
    let [low, median, high] = quartiles(&program.frames_per_s);
    format!("{median:.1} ({low:.1} .. {high:.1})")
}
