//! Renders of the net, by the gpu and by the cpu; checksums of their channels.

use std::{collections::BTreeMap, convert::Infallible, fmt::Write};

use camsim_core::frame::RenderedFrame;
use camsim_engine::{AdapterChoice, Engine, Finished};
use camsim_plan::{
    Backend,
    placement::{cpu_rasterises, cpu_takes_copies},
};

use super::subjects::Subject;

/// Of renders: so small that all of them take seconds.
const SIZE_PX: [u32; 2] = [160, 120];
/// Longest side of pictures that are held whole, where a subject is to have them in tiles.
pub const MOST_PICTURE_PX: u32 = 512;

/// What the golden file keeps of a channel of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    pub checksum: u64,
    /// Of all its numbers: what other adapters and processors can be held against.
    pub mean: f64,
}

/// By subject, frame, renderer and channel.
pub type Checksums = BTreeMap<String, Kept>;

/// One engine for each placement of passes.
pub struct Engines {
    pub gpu: Engine,
    cpu: Engine,
    gpu_then_cpu: Engine,
}

impl Engines {
    pub fn new(most_picture_px: u32) -> Self {
        let open = |backend| {
            let engine = Engine::new(AdapterChoice::Software);
            let mut engine =
                engine.expect("tests need a software Vulkan adapter; CAMSIM_SKIP_GPU=1 skips them");
            engine.limit_pictures(most_picture_px);
            engine.set_backend(backend);
            engine
        };
        Self { gpu: open(Backend::Gpu), cpu: open(Backend::Cpu), gpu_then_cpu: open(Backend::GpuThenCpu) }
    }
}

/// What bits of a picture depend on beside camsim: adapter with its driver, and the processor.
pub fn machine(engine: &Engine) -> String {
    let (os, arch) = (std::env::consts::OS, std::env::consts::ARCH);
    let adapter = &engine.gpu().expect("an adapter").adapter;
    format!("# adapter: {adapter}\n# processor: {os} {arch} {}{}\n", model(), features())
}

/// Name of the processor, where the system tells it: equal features do not promise equal bits.
fn model() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or_else(|| "unknown".to_owned(), |(_, name)| name.trim().to_owned())
}

#[cfg(target_arch = "x86_64")]
fn features() -> String {
    let has = [
        ("avx", is_x86_feature_detected!("avx")),
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("f16c", is_x86_feature_detected!("f16c")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
        ("avx512vl", is_x86_feature_detected!("avx512vl")),
    ];
    has.iter().filter(|(_, has)| *has).map(|(name, _)| format!(" {name}")).collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn features() -> String {
    String::new()
}

/// The frames of a subject by the gpu, and by the cpu those that it vectorises, from ideal frames of its own
/// where it can draw them.
pub fn render(engines: &Engines, subject: &Subject) -> [Vec<RenderedFrame>; 2] {
    let sequence = subject.sequence(Some(SIZE_PX));
    let frames_of = |engine: &Engine, frames: &[u64]| {
        let mut finished = Vec::new();
        let mut keep = |done: Finished| {
            finished.push(done);
            Ok(())
        };
        let session = engine.session::<Infallible>(sequence.clone(), subject.channels);
        let mut session = session.expect(&subject.name);
        session.render::<Infallible>(frames.iter().copied(), &mut keep).expect(&subject.name);
        finished
    };
    let from_gpu = frames_of(&engines.gpu, &subject.frames);
    let is_served = |done: &&Finished| cpu_takes_copies(&done.plan);
    let served: Vec<u64> = from_gpu.iter().filter(is_served).map(|done| done.frame.index).collect();
    let max_picture_px = engines.gpu.capabilities().max_picture_px;
    let by_cpu = match cpu_rasterises(&sequence.scene, max_picture_px) {
        true => &engines.cpu,
        false => &engines.gpu_then_cpu,
    };
    let from_cpu = if served.is_empty() { Vec::new() } else { frames_of(by_cpu, &served) };
    assert!(from_gpu.iter().all(|done| done.times.reverse_ms.is_none()), "{}: gpu", subject.name);
    assert!(from_cpu.iter().all(|done| done.times.reverse_ms.is_some()), "{}: cpu", subject.name);
    [from_gpu, from_cpu].map(|finished| finished.into_iter().map(|done| done.frame).collect())
}

/// Adds the channels of a frame, and says what no picture may have.
pub fn add(frame: &RenderedFrame, of: &str, checksums: &mut Checksums, faults: &mut Vec<String>) {
    let mut add = |channel: &str, values: &[f32]| {
        if !values.iter().all(|value| value.is_finite()) {
            faults.push(format!("{of} {channel}: not finite"));
        }
        let checksum = fnv1a(values.iter().flat_map(|value| value.to_le_bytes()));
        let mean = values.iter().map(|&value| f64::from(value)).sum::<f64>() / values.len() as f64;
        checksums.insert(format!("{of} {channel}"), Kept { checksum, mean });
    };
    let valid: Vec<f32> = frame.color_rgba().iter().skip(3).step_by(4).copied().collect();
    add("color", frame.color_rgba());
    add("valid", &valid);
    frame.depth_m().iter().for_each(|depth_m| add("depth", depth_m));
    frame.coords().iter().for_each(|coords| add("coords", coords.as_flattened()));
    if !valid.iter().all(|&valid| valid == 0.0 || valid == 1.0) {
        faults.push(format!("{of} valid: neither 0 nor 1"));
    }
    if frame.depth_m().into_iter().flatten().any(|&depth_m| depth_m < 0.0) {
        faults.push(format!("{of} depth: below 0"));
    }
}

/// Fowler, Noll and Vo's hash of 64 bits.
fn fnv1a(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

/// RMS difference of the colours of two frames over the pixels that are valid in both, 1/255; and the number
/// of pixels that are valid in one alone: the lens inverses round otherwise where the lens folds its image.
pub fn apart_dn(a: &RenderedFrame, b: &RenderedFrame) -> (f64, usize) {
    let pixels = a.color_rgba().chunks_exact(4).zip(b.color_rgba().chunks_exact(4));
    let (valid, other): (Vec<_>, Vec<_>) = pixels.partition(|(a, b)| a[3] == b[3]);
    let squares = valid.iter().flat_map(|(a, b)| a.iter().zip(*b)).map(|(a, b)| f64::from(a - b).powi(2));
    (255.0 * (squares.sum::<f64>() / (4 * valid.len()).max(1) as f64).sqrt(), other.len())
}

/// One line each, below the machine.
pub fn to_text(machine: &str, checksums: &Checksums) -> String {
    let mut text = machine.to_owned();
    for (key, Kept { checksum, mean }) in checksums {
        writeln!(text, "{key} {checksum:016x} {mean:.6}").expect("a string takes all");
    }
    text
}

/// The machine that wrote the text, and its checksums.
pub fn from_text(text: &str) -> (String, Checksums) {
    let (machine, lines): (Vec<_>, Vec<_>) = text.lines().partition(|line| line.starts_with('#'));
    let kept = |line: &str| {
        let mut words = line.rsplitn(3, ' ');
        let (mean, checksum, key) = (words.next()?, words.next()?, words.next()?);
        let checksum = u64::from_str_radix(checksum, 16).ok()?;
        Some((key.to_owned(), Kept { checksum, mean: mean.parse().ok()? }))
    };
    let checksums = lines.into_iter().map(|line| kept(line).unwrap_or_else(|| panic!("checksums: {line}")));
    (machine.iter().map(|line| format!("{line}\n")).collect(), checksums.collect())
}
