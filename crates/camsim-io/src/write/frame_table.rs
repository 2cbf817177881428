//! `frames.csv`: one row for each frame that has files in the folder, also those of earlier runs.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use camsim_core::{exposure::FrameExposure, geodesy::Geodetic, pose::CameraPose, reference::IdealView};

use super::{WriteError, write_atomic};
use crate::columns::{Columns, Part};

/// Name of the table.
pub const FRAMES_CSV: &str = "frames.csv";

/// One row of `frames.csv`, without the columns of files, which are the last ones.
#[derive(Clone, Debug)]
pub struct FrameRecord {
    /// Frame number.
    pub frame: u64,
    /// Number within the frame's burst; `None` for a frame by itself. One table has one kind only.
    pub instant: Option<u32>,
    /// Stamp, nanoseconds.
    pub stamp_ns: i64,
    /// Pose of the camera at the stamp.
    pub pose: CameraPose,
    /// The same position on Earth, where the flight has an origin there. One table has one kind only.
    pub geodetic: Option<Geodetic>,
    /// Camera of the source coordinates.
    pub source: SourceFrame,
    /// Exposure, where it follows the pictures. One table has one kind only.
    pub exposure: Option<FrameExposure>,
    /// Column name and path, relative to the output folder, of each file.
    pub files: Vec<(String, String)>,
}

/// The pinhole camera whose pixels the source coordinates of a frame are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourceFrame {
    /// Width, height, pixels.
    pub size_px: [u32; 2],
    /// Focal lengths fx, fy, pixels.
    pub focal_px: [f64; 2],
    /// Principal point, pixels.
    pub principal_px: [f64; 2],
    /// Instant, nanoseconds on the clock of stamps.
    pub t_ns: i64,
    /// Pose at that instant.
    pub pose: CameraPose,
}

impl SourceFrame {
    /// The camera of an ideal frame of the instant `key_s`; `epoch_ns` is the stamp at path time 0.
    #[must_use]
    pub fn new(IdealView { pose, ideal }: IdealView, key_s: f64, epoch_ns: i64) -> Self {
        Self {
            size_px: ideal.size_px,
            focal_px: ideal.focal_px.to_array(),
            principal_px: ideal.principal_px.to_array(),
            t_ns: epoch_ns.saturating_add((key_s * 1e9).round() as i64),
            pose,
        }
    }
}

/// The table `frames.csv`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameTable {
    /// Names of the columns of paths.
    columns: Vec<String>,
    /// By frame and number within its burst: the text before the paths, and the path of each column, empty
    /// where there is none.
    rows: BTreeMap<(u64, Option<u32>), (String, Vec<String>)>,
    kind: TableKind,
}

/// Columns that not every table has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TableKind {
    /// Whether the flight is on Earth.
    pub has_geodetic: bool,
    /// Whether exposures follow the pictures.
    pub has_exposures: bool,
    /// Whether it is of a burst.
    pub has_instants: bool,
}

impl TableKind {
    /// The columns of values.
    fn columns(self) -> Columns<FrameRecord> {
        Columns::with(|part| match part {
            Part::Geodetic => self.has_geodetic,
            Part::Exposures => self.has_exposures,
            Part::Instants => self.has_instants,
            Part::Motion | Part::Poses => false,
        })
    }

    /// The kind of a header, and the columns of files with a comma before each.
    fn of_header(header: &str) -> Option<(Self, &str)> {
        let bits = (0..8).map(|bits: u8| [1, 2, 4].map(|bit| bits & bit > 0));
        let fits = bits.filter_map(|[has_geodetic, has_exposures, has_instants]| {
            let kind = Self { has_geodetic, has_exposures, has_instants };
            let files = header.strip_prefix(&kind.columns().header())?;
            (files.is_empty() || files.starts_with(',')).then_some((kind, files))
        });
        fits.min_by_key(|(_, files)| files.len())
    }
}

impl FrameTable {
    /// An empty table.
    #[must_use]
    pub fn new(kind: TableKind) -> Self {
        Self { kind, ..Self::default() }
    }

    /// Reads a table; empty if the file does not exist or has other columns.
    #[must_use]
    pub fn read(path: &Path, kind: TableKind) -> Self {
        std::fs::read_to_string(path)
            .ok()
            .and_then(|text| Self::parse(&text))
            .filter(|table| table.kind == kind)
            .unwrap_or_else(|| Self::new(kind))
    }

    fn parse(text: &str) -> Option<Self> {
        let mut lines = text.lines();
        let (kind, files) = TableKind::of_header(lines.next()?)?;
        let columns: Vec<String> = files.split(',').skip(1).map(str::to_owned).collect();
        let value_columns = kind.columns().header().split(',').count();
        let row = |line: &str| {
            let (end, _) = line.match_indices(',').chain([(line.len(), "")]).nth(value_columns - 1)?;
            let (values, files) = line.split_at(end);
            let mut files: Vec<String> = files.split(',').skip(1).map(str::to_owned).collect();
            files.resize(columns.len(), String::new());
            let instant = match kind.has_instants {
                true => Some(values.rsplit(',').next()?.parse().ok()?),
                false => None,
            };
            let frame = values.split(',').next()?.parse().ok()?;
            Some(((frame, instant), (values.to_owned(), files)))
        };
        // A malformed line is dropped, so that its frame counts as missing.
        let rows = lines.filter_map(row).collect();
        Some(Self { columns, rows, kind })
    }

    /// Inserts or replaces the row of a frame. Paths in columns that `record` does not have are kept.
    pub fn insert(&mut self, record: &FrameRecord) {
        for (column, _) in &record.files {
            if !self.columns.contains(column) {
                self.columns.push(column.clone());
            }
        }
        let mut values = String::new();
        self.kind.columns().push_cells(&mut values, record);
        let row = self.rows.entry((record.frame, record.instant)).or_default();
        row.0 = values;
        row.1.resize(self.columns.len(), String::new());
        for (column, file) in &record.files {
            if let Some(index) = self.columns.iter().position(|known| known == column) {
                row.1[index].clone_from(file);
            }
        }
    }

    /// Removes the paths of files that do not exist below `folder`, rows without any path unless `also`
    /// selects their frame, and empty columns.
    pub fn retain_existing(&mut self, folder: &Path, also: &dyn Fn(u64, Option<u32>) -> bool) {
        let columns = self.columns.len();
        self.rows.retain(|(frame, instant), (_, files)| {
            files.resize(columns, String::new());
            files.iter_mut().filter(|file| !folder.join(file.as_str()).is_file()).for_each(String::clear);
            files.iter().any(|file| !file.is_empty()) || also(*frame, *instant)
        });
        let is_used = |column: usize| self.rows.values().any(|(_, files)| !files[column].is_empty());
        let used: Vec<bool> = (0..columns).map(is_used).collect();
        let retained = |list: &[String]| {
            list.iter().zip(&used).filter(|(_, used)| **used).map(|(item, _)| item.clone()).collect()
        };
        self.columns = retained(&self.columns);
        self.rows.values_mut().for_each(|(_, files)| *files = retained(files));
    }

    /// Whether frame `index` has a row.
    #[must_use]
    pub fn contains(&self, index: u64) -> bool {
        self.rows.contains_key(&(index, None))
    }

    /// Numbers of the frames that have a row, ascending; of bursts, once for each picture.
    pub fn frames(&self) -> impl Iterator<Item = u64> {
        self.rows.keys().map(|(frame, _)| *frame)
    }

    /// Whether frame `index`, or a picture of its burst, has a row with all of these files.
    #[must_use]
    pub fn has_files(&self, index: u64, instant: Option<u32>, files: &[(String, String)]) -> bool {
        let Some((_, paths)) = self.rows.get(&(index, instant)) else { return false };
        let has = |column: &String, file: &String| {
            self.columns.iter().zip(paths).any(|(known, path)| known == column && path == file)
        };
        files.iter().all(|(column, file)| has(column, file))
    }

    /// The table as CSV.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let mut text = self.kind.columns().header();
        let line = |text: &mut String, files: &[String]| {
            for i in 0..self.columns.len() {
                text.push(',');
                text.push_str(files.get(i).map_or("", String::as_str));
            }
            text.push('\n');
        };
        line(&mut text, &self.columns);
        for (values, files) in self.rows.values() {
            text.push_str(values);
            line(&mut text, files);
        }
        text
    }

    /// Writes the table.
    ///
    /// # Errors
    /// As [`write_atomic`].
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomic(path, self.to_csv().as_bytes())
    }
}

/// Path of `frames.csv` in an output folder.
#[must_use]
pub fn frames_path(folder: &Path) -> PathBuf {
    folder.join(FRAMES_CSV)
}

/// The first and the last frame that the table of a folder lists; `None` without any.
#[must_use]
pub fn listed_frames(folder: &Path) -> Option<[u64; 2]> {
    let table = FrameTable::parse(&std::fs::read_to_string(frames_path(folder)).ok()?)?;
    Some([table.frames().next()?, table.frames().last()?])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use glam::{DQuat, DVec3};

    use super::*;

    fn record(frame: u64, columns: &[&str]) -> FrameRecord {
        let pose =
            CameraPose { position_ned_m: DVec3::new(1.0, -2.5, 3.0), ned_from_camera: DQuat::IDENTITY };
        let source = SourceFrame {
            size_px: [700, 500],
            focal_px: [420.0, 421.5],
            principal_px: [349.5, 249.25],
            t_ns: -7,
            pose,
        };
        let files =
            columns.iter().map(|column| ((*column).to_owned(), format!("{column}/{frame}"))).collect();
        FrameRecord { frame, instant: None, stamp_ns: 9, pose, geodetic: None, source, exposure: None, files }
    }

    #[test]
    fn rows_have_the_source_camera_and_read_back() {
        let mut table = FrameTable::default();
        table.insert(&record(4, &["color_exr"]));
        let text = table.to_csv();
        // Users' scripts go by these names.
        let header = "frame,stamp_ns,n,e,d,qw,qx,qy,qz,ideal_width_px,ideal_height_px,ideal_fx_px,ideal_fy_px,\
                      ideal_cx_px,ideal_cy_px,ideal_t_ns,ideal_n,ideal_e,ideal_d,ideal_qw,ideal_qx,ideal_qy,ideal_qz";
        assert_eq!(
            text,
            format!(
                "{header},color_exr\n4,9,1,-2.5,3,1,0,0,0,700,500,420,421.5,349.5,249.25,-7,1,-2.5,3,1,0,0,0,\
                 color_exr/4\n"
            )
        );
        assert_eq!(FrameTable::parse(&text).unwrap(), table);
        assert_eq!(FrameTable::default().to_csv(), format!("{header}\n"));
        // A table of another version.
        assert_eq!(
            FrameTable::parse("frame,stamp_ns,n,e,d,qw,qx,qy,qz,color_exr\n4,9,1,1,1,1,0,0,0,a\n"),
            None
        );
    }

    #[test]
    fn partial_runs_are_merged_into_one_table() {
        let folder = tempfile::tempdir().unwrap();
        let path = frames_path(folder.path());
        let table_of = |frames: &[u64]| {
            let mut table = FrameTable::default();
            frames.iter().for_each(|&frame| table.insert(&record(frame, &["color_exr", "rows"])));
            table
        };
        table_of(&[0, 2, 4]).write(&path).unwrap();
        let mut table = FrameTable::read(&path, TableKind::default());
        [1, 3, 4].iter().for_each(|&frame| table.insert(&record(frame, &["color_exr", "rows"])));
        assert_eq!(table.to_csv(), table_of(&[0, 1, 2, 3, 4]).to_csv());
        // Another channel of the same frames.
        table.insert(&record(3, &["depth"]));
        let text = table.to_csv();
        let last: Vec<&str> = text.lines().map(|line| line.rsplit(',').next().unwrap()).collect();
        assert_eq!(last, ["depth", "", "", "", "depth/3", ""]);
        // Files that do not exist are dropped.
        std::fs::create_dir(folder.path().join("depth")).unwrap();
        std::fs::write(folder.path().join("depth/3"), "").unwrap();
        table.retain_existing(folder.path(), &|frame, _| frame == 1);
        let lines: Vec<String> = table.to_csv().lines().map(str::to_owned).collect();
        assert!(lines.len() == 3 && lines[0].ends_with("ideal_qz,depth"), "{lines:?}");
        assert!(
            lines[1].starts_with("1,9,")
                && lines[1].ends_with("0,")
                && lines[2].starts_with("3,9,")
                && lines[2].ends_with(",depth/3")
        );
        assert!(table.contains(3) && !table.contains(0));
        table.write(&path).unwrap();
        assert_eq!((listed_frames(folder.path()), listed_frames(Path::new("/no"))), (Some([1, 3]), None));
    }

    #[test]
    fn pictures_of_a_burst_have_a_row_each() {
        let kind = TableKind { has_instants: true, ..TableKind::default() };
        let mut table = FrameTable::new(kind);
        for (frame, instant) in [(4, 1), (2, 0), (4, 0), (2, 10), (2, 9)] {
            table.insert(&FrameRecord { instant: Some(instant), ..record(frame, &["color_png"]) });
        }
        let text = table.to_csv();
        assert_eq!(FrameTable::parse(&text).unwrap(), table);
        assert!(
            text.lines().next().is_some_and(|line| line.ends_with("ideal_qz,instant,color_png")),
            "{text}"
        );
        // The last two columns.
        let ends = text.lines().map(|line| {
            let comma = line.match_indices(',').rev().nth(1).map_or(0, |(i, _)| i + 1);
            &line[comma..]
        });
        let ends: Vec<&str> = ends.collect();
        assert_eq!(
            ends[1..],
            ["0,color_png/2", "9,color_png/2", "10,color_png/2", "0,color_png/4", "1,color_png/4"]
        );
        let folder = tempfile::tempdir().unwrap();
        let path = frames_path(folder.path());
        table.write(&path).unwrap();
        assert_eq!(FrameTable::read(&path, kind), table);
        let other = FrameTable::read(&path, TableKind::default());
        assert_eq!(other, FrameTable::default(), "a table of another kind");
    }

    #[test]
    fn positions_on_earth_and_exposures_have_columns_before_the_files() {
        let kind = TableKind { has_geodetic: true, ..TableKind::default() };
        let mut table = FrameTable::new(kind);
        let geodetic = Some(Geodetic::from_deg(47.5, -8.25, 430.0));
        table.insert(&FrameRecord { geodetic, ..record(4, &["color_png"]) });
        let text = table.to_csv();
        let (header, row) = text.trim_end().split_once('\n').unwrap();
        assert!(header.ends_with(",ideal_qz,lat_deg,lon_deg,height_m,color_png"), "{header}");
        let at = header.split(',').position(|name| name == "lat_deg").unwrap();
        let geodetic: Vec<f64> =
            row.split(',').skip(at).take(3).map(|value| value.parse().unwrap()).collect();
        assert!(
            (geodetic[0] - 47.5).abs() < 1e-12 && (geodetic[1] + 8.25).abs() < 1e-12 && geodetic[2] == 430.0,
            "{row}"
        );
        assert_eq!(FrameTable::parse(&text).unwrap(), table);
        for has_instants in [false, true] {
            let kind = TableKind { has_exposures: true, has_instants, ..TableKind::default() };
            let mut table = FrameTable::new(kind);
            let exposure = Some(FrameExposure { time_s: 2.5e-3, gain: 1.5, light: 9.0 });
            let instant = has_instants.then_some(7);
            table.insert(&FrameRecord { exposure, instant, ..record(4, &["color_png"]) });
            let text = table.to_csv();
            let (header, row) = text.trim_end().split_once('\n').unwrap();
            assert!(header.contains(",ideal_qz,exposure_ms,gain,"), "{header}");
            let end = if has_instants { ",2.5,1.5,7,color_png/4" } else { ",2.5,1.5,color_png/4" };
            assert!(row.ends_with(end), "{row}");
            assert_eq!(FrameTable::parse(&text).unwrap(), table);
        }
    }
}
