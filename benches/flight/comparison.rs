//! Tables with a column for the cpu renderer, one for the gpu renderer and one for the paper's preset. All
//! cells of a table are measured in the same rounds.

use std::sync::Arc;

use camsim::{
    core::{scenario::Channel, sequence::Sequence},
    engine::{Backend, Engine, GpuError},
    lab::timing::quartiles,
};

use super::{
    Outcome,
    rounds::{RoundLimits, Variant, measure, median_ratio, rounds_text},
};

/// Name of the paper's preset in tables.
pub const PRESET: &str = "paper preset";
/// Cell of the gpu column on a machine without an adapter.
pub const NO_ADAPTER: &str = "no adapter";

/// The renderers of this machine.
pub struct Renderers {
    /// The cpu renderer.
    pub cpu: Engine,
    /// The gpu renderer; `None` without an adapter.
    pub gpu: Option<Engine>,
}

impl Renderers {
    /// Opens both. A missing adapter is an error only if `CAMSIM_ADAPTER` demands one.
    pub fn open() -> Outcome<Self> {
        let gpu = match Engine::open(Backend::Gpu) {
            Ok(engine) => Some(engine),
            Err(GpuError::NoAdapter(name)) if name.is_empty() => None,
            Err(error) => return Err(error.into()),
        };
        Ok(Self { cpu: Engine::cpu(), gpu })
    }

    /// The renderers by column: cpu, gpu.
    pub fn columns(&self) -> [Option<&Engine>; 2] {
        [Some(&self.cpu), self.gpu.as_ref()]
    }

    /// Name and renderer of the paper's preset: the gpu, or the cpu without an adapter.
    pub fn preset(&self) -> (&'static str, &Engine) {
        match &self.gpu {
            Some(gpu) => ("gpu", gpu),
            None => ("cpu", &self.cpu),
        }
    }

    /// What renders, for the head of the output.
    pub fn text(&self) -> String {
        let gpu = self.gpu.as_ref().map_or(NO_ADAPTER.to_owned(), ToString::to_string);
        format!("cpu       {}\ngpu       {gpu}\n{PRESET} on the {}", self.cpu, self.preset().0)
    }
}

/// Variants of a row.
struct Row {
    name: String,
    /// Indices into the variants: cpu, gpu, the paper's preset.
    variants: [Option<usize>; 3],
    /// Whether a gpu variant is missing for want of an adapter.
    needs_adapter: bool,
}

/// A table, row by row.
pub struct Comparison<'a> {
    renderers: &'a Renderers,
    rows: Vec<Row>,
    variants: Vec<Variant<'a>>,
}

/// A column of a table, for each renderer: heading, and the text for a variant, the variant of the same
/// renderer in the first row that has one, and the paper's preset.
pub type Column = (&'static str, fn(&Variant<'_>, &Variant<'_>, Option<&Variant<'_>>) -> String);

impl<'a> Comparison<'a> {
    pub fn new(renderers: &'a Renderers) -> Self {
        Self { renderers, rows: Vec::new(), variants: Vec::new() }
    }

    /// Adds a row for both renderers. A still variant renders one frame over and over.
    pub fn add(
        &mut self,
        name: impl Into<String>,
        sequence: &Arc<Sequence>,
        channels: &[Channel],
        is_still: bool,
    ) -> Outcome<()> {
        self.add_on(self.renderers.columns(), name, sequence, channels, is_still)
    }

    /// Adds a row for the given engines: cpu, gpu.
    pub fn add_on(
        &mut self,
        engines: [Option<&'a Engine>; 2],
        name: impl Into<String>,
        sequence: &Arc<Sequence>,
        channels: &[Channel],
        is_still: bool,
    ) -> Outcome<()> {
        let mut row =
            Row { name: name.into(), variants: [None; 3], needs_adapter: self.renderers.gpu.is_none() };
        for (index, engine) in row.variants.iter_mut().zip(engines) {
            let Some(engine) = engine else { continue };
            *index = Some(self.variants.len());
            self.variants.push(Variant { is_still, ..Variant::open(engine, sequence.clone(), channels)? });
        }
        self.rows.push(row);
        Ok(())
    }

    /// Adds the paper's preset to the last row, or in a row of its own with a name.
    pub fn add_preset(
        &mut self,
        name: Option<&str>,
        sequence: &Arc<Sequence>,
        channels: &[Channel],
    ) -> Outcome<()> {
        if let Some(name) = name {
            self.rows.push(Row { name: name.to_owned(), variants: [None; 3], needs_adapter: false });
        }
        let variant = Variant::open(self.renderers.preset().1, sequence.clone(), channels)?;
        let row = self.rows.last_mut().ok_or("the preset needs a row")?;
        row.variants[2] = Some(self.variants.len());
        self.variants.push(variant);
        Ok(())
    }

    /// Measures all variants in turn, in frames 0 to `frames`.
    pub fn measure(&mut self, frames: u64, limits: RoundLimits) -> Outcome<()> {
        measure(&mut self.variants, frames, limits)
    }

    /// The variant of a row and column: 0 is the cpu, 1 the gpu, 2 the paper's preset.
    pub fn variant(&self, row: usize, column: usize) -> Option<&Variant<'a>> {
        self.rows.get(row)?.variants[column].map(|index| &self.variants[index])
    }

    /// Prints the frame rates of both renderers and of the paper's preset, and `columns` for both renderers.
    /// `heading` is that of the rows' names.
    pub fn print(&self, heading: &str, limits: RoundLimits, columns: &[Column]) {
        println!("{}", rounds_text(&self.variants, limits));
        println!("frames/s: median, in brackets the quartiles\n");
        let (preset_renderer, _) = self.renderers.preset();
        let mut headings = vec![
            heading.to_owned(),
            "cpu, frames/s".to_owned(),
            "gpu, frames/s".to_owned(),
            format!("{PRESET} ({preset_renderer}), frames/s"),
        ];
        headings.extend(
            columns.iter().flat_map(|(title, _)| ["cpu", "gpu"].map(|name| format!("{name}, {title}"))),
        );
        println!("| {} |", headings.join(" | "));
        let count = headings.len() + heading.matches('|').count();
        println!("|{}", "---|".repeat(count));
        let preset = (0..self.rows.len()).find_map(|row| self.variant(row, 2));
        for (i, row) in self.rows.iter().enumerate() {
            let mut cells = vec![row.name.clone()];
            cells.extend((0..3).map(|column| match self.variant(i, column) {
                Some(variant) => frame_rate(variant),
                None if column == 1 && row.needs_adapter => NO_ADAPTER.to_owned(),
                None => String::new(),
            }));
            for (_, text) in columns {
                cells.extend((0..2).map(|column| {
                    let first = (0..self.rows.len()).find_map(|row| self.variant(row, column));
                    self.variant(i, column)
                        .zip(first)
                        .map_or(String::new(), |(variant, first)| text(variant, first, preset))
                }));
            }
            println!("| {} |", cells.join(" | "));
        }
    }
}

/// Frames per second: median and quartiles.
pub fn frame_rate(variant: &Variant<'_>) -> String {
    let [fast_ms, median_ms, slow_ms] = quartiles(&variant.ms);
    format!("{:.1} ({:.1} .. {:.1})", 1e3 / median_ms, 1e3 / slow_ms, 1e3 / fast_ms)
}

/// Column: median of the differences to the first row in the same rounds.
pub const MS_TO_FIRST: Column = ("ms a frame to the first", |variant, first, _| {
    let differences: Vec<f64> = variant.ms.iter().zip(&first.ms).map(|(own, first)| own - first).collect();
    format!("{:+.1}", quartiles(&differences)[1])
});

/// Column: time of a frame over that of the first row.
pub const TIMES_FIRST: Column =
    ("times the first's time", |variant, first, _| format!("{:.2}", median_ratio(&variant.ms, &first.ms)));

/// Column: frame rate over that of the first row.
pub const RATE_TO_FIRST: Column =
    ("of the first's rate", |variant, first, _| format!("{:.2}", median_ratio(&first.ms, &variant.ms)));

/// Column: how many times the paper preset's frame rate a variant has.
pub const TIMES_PRESET: Column = ("times the preset's rate", |variant, _, preset| {
    preset.map_or(String::new(), |preset| format!("{:.2}", median_ratio(&preset.ms, &variant.ms)))
});

/// Column: processor time of a frame over all threads, median and quartiles.
pub const PROCESSOR_MS: Column = ("processor ms a frame", |variant, _, _| {
    if variant.processor_ms.is_empty() {
        return "not known".to_owned();
    }
    let [low, median, high] = quartiles(&variant.processor_ms);
    format!("{median:.1} ({low:.1} .. {high:.1})")
});

/// Column: time to open the session and render two frames.
pub const START_S: Column = ("start, s", |variant, _, _| format!("{:.2}", variant.start.as_secs_f64()));
