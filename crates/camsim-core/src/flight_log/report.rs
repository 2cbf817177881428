//! Report of the repairs of a log.

use std::{collections::HashSet, fmt};

use crate::scenario::AngleKind;

/// Number of line numbers that a [`Finding`] lists.
pub(super) const LISTED_LINES: usize = 8;

/// Averaged rows at least this far apart are none of one instant.
const MOVED_M: f64 = 1.0;

/// A note of a log's reader about the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// Whether it is a warning; otherwise it is information.
    pub is_warning: bool,
    /// Text of the note, without the file's name.
    pub text: String,
}

impl Note {
    /// A warning.
    #[must_use]
    pub fn warning(text: impl Into<String>) -> Self {
        Self { is_warning: true, text: text.into() }
    }

    /// Information.
    #[must_use]
    pub fn information(text: impl Into<String>) -> Self {
        Self { is_warning: false, text: text.into() }
    }
}

/// A kind of fault, with its count and first occurrences.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Finding {
    /// Number of rows.
    pub count: usize,
    /// File lines of the first few rows.
    pub lines: Vec<usize>,
    /// File lines of all rows, until their times are known.
    pub(super) all: Vec<usize>,
}

impl Finding {
    pub(super) fn add(&mut self, line: usize) {
        self.count += 1;
        self.all.push(line);
        if self.lines.len() < LISTED_LINES {
            self.lines.push(line);
        }
    }
}

/// Counts of all repairs, with the lines of the first few.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CleaningReport {
    /// Rows of the file.
    pub rows_read: usize,
    /// Dropped: time or position missing, not finite or out of range.
    pub unusable: Finding,
    /// Dropped: latitude or longitude exactly 0 and far from all others, as receivers write without a fix.
    pub null_fixes: Finding,
    /// Dropped: height exactly 0 and far from the heights around, as receivers write before their first
    /// height.
    pub null_heights: Finding,
    /// Height above the ground, where the terrain has none: that of the row before counts.
    pub without_ground: Finding,
    /// Earlier than a row before them: sorted.
    pub out_of_order: Finding,
    /// Attitude missing or not finite: interpolated.
    pub attitude_missing: Finding,
    /// Attitude far from both neighbours, which agree with each other: interpolated.
    pub attitude_glitches: Finding,
    /// Position far from both neighbours, which agree with each other: dropped.
    pub position_spikes: Finding,
    /// Averaged with a row less than 1 ms before, at another time.
    pub merged: Finding,
    /// Averaged with a row of the same time.
    pub duplicates: Finding,
    /// Largest distance between rows that were averaged, metres.
    pub averaged_apart_m: f64,
    /// Later than the row before by more than 1 s of the log's clock.
    pub gaps: Finding,
    /// The longest step between two rows, seconds of the log's clock.
    pub longest_step_s: f64,
    /// Rows inserted because angles turn by more than 90 degrees.
    pub inserted: usize,
    /// Times of the repaired rows that have one, without those of gaps: seconds since the first good row,
    /// divided by the `speed` factor; ascending.
    pub repaired_s: Vec<f64>,
    /// How angles were read: `Wrapped` or `Continuous`, never `Auto`.
    pub angles: AngleKind,
}

impl CleaningReport {
    /// Whether nothing was repaired. (Gaps are counted, not repaired.)
    pub fn is_clean(&self) -> bool {
        self.findings().iter().all(|(_, finding)| finding.count == 0)
    }

    /// Removes and returns the lines of all repaired rows.
    pub(super) fn take_lines(&mut self) -> HashSet<usize> {
        let Self {
            unusable,
            null_fixes,
            null_heights,
            without_ground,
            out_of_order,
            attitude_missing,
            attitude_glitches,
            position_spikes,
            merged,
            duplicates,
            gaps,
            ..
        } = self;
        gaps.all = Vec::new();
        let repaired = [
            unusable,
            null_fixes,
            null_heights,
            without_ground,
            out_of_order,
            attitude_missing,
            attitude_glitches,
            position_spikes,
            merged,
            duplicates,
        ];
        repaired.into_iter().flat_map(|finding| std::mem::take(&mut finding.all)).collect()
    }

    fn findings(&self) -> [(&'static str, &Finding); 10] {
        [
            ("rows without usable time or position dropped", &self.unusable),
            ("rows without a fix (latitude or longitude 0) skipped", &self.null_fixes),
            ("rows without a height (0, far from the others) skipped", &self.null_heights),
            (
                "rows beyond the heights of the terrain, above the ground of the row before",
                &self.without_ground,
            ),
            ("rows out of order sorted", &self.out_of_order),
            ("missing attitudes interpolated", &self.attitude_missing),
            ("attitude glitches interpolated", &self.attitude_glitches),
            ("position spikes dropped", &self.position_spikes),
            ("rows less than 1 ms apart averaged", &self.merged),
            ("rows of equal time averaged", &self.duplicates),
        ]
    }
}

impl fmt::Display for CleaningReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} rows read", self.rows_read)?;
        let gaps = ("gaps of more than 1 s", &self.gaps);
        for (what, finding) in
            self.findings().into_iter().chain([gaps]).filter(|(_, finding)| finding.count > 0)
        {
            let lines: Vec<String> = finding.lines.iter().map(usize::to_string).collect();
            let more = if finding.count > finding.lines.len() { ", ..." } else { "" };
            write!(f, "; {} {what} (line {}{more})", finding.count, lines.join(", "))?;
        }
        if self.averaged_apart_m >= MOVED_M {
            write!(
                f,
                "; averaged rows are up to {:.1} m apart, so their times are wrong",
                self.averaged_apart_m
            )?;
        }
        if self.inserted > 0 {
            write!(f, "; {} rows inserted where angles turn by more than 90 degrees", self.inserted)?;
        }
        Ok(())
    }
}
