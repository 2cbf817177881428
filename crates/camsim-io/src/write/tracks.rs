//! `points.csv` and `tracks.csv`: tracked points, and where every written frame shows them.
//!
//! The rows of a frame are written to a part of their own as soon as it is rendered, and all parts are merged
//! into one table at the end of a run: no run holds more than one frame's rows in memory, and runs that are
//! resumed or share a folder add to one table.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::{self, BufRead, BufReader, Read, Write as _},
    path::{Path, PathBuf},
};

use camsim_core::tracks::{Sighting, TrackPoint};

use super::{WriteError, atomic::write_atomic_with, write_atomic};
use crate::columns::{Columns, Part};

/// Name of the table of points.
pub const POINTS_CSV: &str = "points.csv";
/// Name of the table of where frames show them.
pub const TRACKS_CSV: &str = "tracks.csv";

/// A line of `points.csv`.
#[derive(Clone, Debug)]
pub(crate) struct PointRecord {
    pub(crate) number: u32,
    pub(crate) point: TrackPoint,
    /// Latitude, longitude, and height as those of the flight log.
    pub(crate) geodetic: Option<[f64; 3]>,
}

/// A line of `tracks.csv`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrackRecord {
    pub(crate) frame: u64,
    pub(crate) t_ns: i64,
    pub(crate) sighting: Sighting,
}

/// Text of `points.csv`.
pub fn points_csv(points: &[TrackPoint], geodetic: &dyn Fn(&TrackPoint) -> Option<[f64; 3]>) -> String {
    let has_geodetic = points.first().is_some_and(|point| geodetic(point).is_some());
    let has_motion = points.iter().any(|point| point.moves_with.is_some());
    let columns = Columns::with(|part| match part {
        Part::Motion => has_motion,
        Part::Geodetic => has_geodetic,
        _ => false,
    });
    let record = |(number, point): (u32, &TrackPoint)| PointRecord {
        number,
        point: point.clone(),
        geodetic: geodetic(point),
    };
    columns.csv((0..).zip(points).map(record))
}

fn tracks_header() -> String {
    Columns::<TrackRecord>::all().header()
}

/// Rows of one frame in `tracks.csv`; `epoch_ns` is the stamp at path time 0.
pub fn tracks_rows(frame: u64, epoch_ns: i64, sightings: &[Sighting]) -> String {
    let columns = Columns::all();
    let mut text = String::with_capacity(96 * sightings.len());
    for &sighting in sightings {
        let t_ns = epoch_ns.saturating_add((sighting.seen.t_s * 1e9).round() as i64);
        columns.push_line(&mut text, &TrackRecord { frame, t_ns, sighting });
    }
    text
}

/// The files of tracks in an output folder.
#[derive(Clone, Debug)]
pub struct TrackFiles {
    folder: PathBuf,
}

impl TrackFiles {
    /// Files below `folder`.
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.into() }
    }

    fn points(&self) -> PathBuf {
        self.folder.join(POINTS_CSV)
    }

    fn tracks(&self) -> PathBuf {
        self.folder.join(TRACKS_CSV)
    }

    /// Hidden, and without the names of frame files: the rows of frames that are not merged yet.
    fn parts(&self) -> PathBuf {
        self.folder.join(".tracks")
    }

    fn part(&self, frame: u64) -> PathBuf {
        self.parts().join(format!("{frame:06}.csv"))
    }

    /// The first file of the name of one of these that something else has made.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn foreign(&self) -> Result<Option<PathBuf>, WriteError> {
        let points = Columns::<PointRecord>::with(|_| false).header();
        for (path, columns) in [(self.points(), points), (self.tracks(), tracks_header())] {
            let mut begin = vec![0; columns.len()];
            let read = match File::open(&path) {
                Ok(mut file) => file.read_exact(&mut begin),
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => Err(error),
            };
            match read {
                Ok(()) if begin == columns.as_bytes() => {}
                Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => {
                    return Err(WriteError::Io { path, source: error });
                }
                _ => return Ok(Some(path)),
            }
        }
        Ok(None)
    }

    /// Removes tables and parts.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove(&self) -> Result<(), WriteError> {
        for path in [self.points(), self.tracks()] {
            accept_missing(&path, fs::remove_file(&path))?;
        }
        let parts = self.parts();
        accept_missing(&parts, fs::remove_dir_all(&parts))
    }

    /// Writes `points.csv`. Rows of other points are removed.
    ///
    /// # Errors
    /// As [`write_atomic`].
    pub fn begin(&self, points: &str) -> Result<(), WriteError> {
        if fs::read_to_string(self.points()).is_ok_and(|known| known == points) {
            return Ok(());
        }
        self.remove()?;
        write_atomic(&self.points(), points.as_bytes())
    }

    /// Writes the rows of one frame.
    ///
    /// # Errors
    /// As [`write_atomic`].
    pub fn write_part(&self, frame: u64, rows: &str) -> Result<(), WriteError> {
        write_atomic(&self.part(frame), rows.as_bytes())
    }

    /// Writes `tracks.csv` with the rows of these frames: those of their parts, else those that it has, else
    /// those that `rows` gives.
    ///
    /// # Errors
    /// A file that cannot be read or written, and errors of `rows`.
    pub fn merge<E: From<WriteError>>(
        &self,
        frames: &BTreeSet<u64>,
        rows: &mut dyn FnMut(u64) -> Result<String, E>,
    ) -> Result<(), E> {
        let path = self.tracks();
        let mut old = OldRows::open(&path);
        let mut failed = None;
        let written = write_atomic_with(&path, &mut |out| {
            writeln!(out, "{}", tracks_header())?;
            for &frame in frames {
                if let Ok(mut part) = File::open(self.part(frame)) {
                    io::copy(&mut part, out)?;
                } else if !old.copy(frame, out)? {
                    match rows(frame) {
                        Ok(text) => out.write_all(text.as_bytes())?,
                        Err(error) => {
                            failed = Some(error);
                            return Err(io::ErrorKind::Other.into());
                        }
                    }
                }
            }
            Ok(())
        });
        if let Some(error) = failed {
            return Err(error);
        }
        written?;
        for &frame in frames {
            let part = self.part(frame);
            accept_missing(&part, fs::remove_file(&part))?;
        }
        // Parts of runs that are not finished stay.
        let _ = fs::remove_dir(self.parts());
        Ok(())
    }
}

fn accept_missing(path: &Path, removed: io::Result<()>) -> Result<(), WriteError> {
    match removed {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(WriteError::Io { path: path.into(), source })
        }
        _ => Ok(()),
    }
}

/// Rows of an existing table, read once from its begin to its end. Its frames ascend.
struct OldRows {
    reader: Option<BufReader<File>>,
    /// The next row, with its frame.
    next: Option<(u64, String)>,
}

impl OldRows {
    /// Without rows if there is no such table.
    fn open(path: &Path) -> Self {
        let mut old = Self { reader: File::open(path).ok().map(BufReader::new), next: None };
        let mut header = String::new();
        let is_read = old.reader.as_mut().is_some_and(|reader| reader.read_line(&mut header).is_ok());
        if !is_read || header.trim_end() != tracks_header() {
            old.reader = None;
        }
        old
    }

    /// Copies the rows of a frame; returns whether there are any.
    fn copy(&mut self, frame: u64, out: &mut dyn io::Write) -> io::Result<bool> {
        let mut has_rows = false;
        loop {
            if self.next.is_none() {
                self.next = self.read()?;
            }
            match &self.next {
                Some((of, row)) if *of == frame => {
                    out.write_all(row.as_bytes())?;
                    has_rows = true;
                }
                Some((of, _)) if *of < frame => {}
                _ => return Ok(has_rows),
            }
            self.next = None;
        }
    }

    fn read(&mut self) -> io::Result<Option<(u64, String)>> {
        let Some(reader) = &mut self.reader else { return Ok(None) };
        loop {
            let mut row = String::new();
            if reader.read_line(&mut row)? == 0 {
                return Ok(None);
            }
            // A row that is not whole is skipped, so that its frame counts as missing.
            let frame = row.split(',').next().and_then(|cell| cell.parse().ok());
            if let (Some(frame), true) = (frame, row.ends_with('\n')) {
                return Ok(Some((frame, row)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use camsim_core::{pose::CameraPose, row_time::ImagePoint};
    use glam::{DQuat, DVec2, DVec3};

    use super::*;

    fn sighting(point: usize, x: f64) -> Sighting {
        let pose = CameraPose { position_ned_m: DVec3::ZERO, ned_from_camera: DQuat::IDENTITY };
        let px = DVec2::new(x, 7.5);
        let seen = ImagePoint { px, t_s: -0.5, pose, depth_m: 100.25, solutions: 2 };
        Sighting { point, seen, is_visible: point == 0 }
    }

    #[test]
    fn rows_and_points_are_written_as_their_columns_say() {
        assert_eq!(
            tracks_rows(3, 1_000_000_000, &[sighting(0, 0.1), sighting(8, -0.25)]),
            "3,0,0.1,7.5,500000000,100.25,1,2\n3,8,-0.25,7.5,500000000,100.25,0,2\n"
        );
        let point = TrackPoint {
            source: "a.csv".into(),
            name: "the \"top\", left".into(),
            position_ned_m: DVec3::new(1.0, -2.5, 3.0),
            moves_with: None,
        };
        assert_eq!(
            points_csv(std::slice::from_ref(&point), &|_| Some([46.5, 7.25, 900.0])),
            "point,name,source,n_m,e_m,d_m,lat_deg,lon_deg,height_m\n\
             0,\"the \"\"top\"\", left\",a.csv,1,-2.5,3,46.5,7.25,900\n"
        );
        let on_a_car = TrackPoint { moves_with: Some(2), name: "car/0".into(), ..point.clone() };
        assert_eq!(
            points_csv(&[point, on_a_car], &|_| None),
            "point,name,source,n_m,e_m,d_m,moves\n0,\"the \"\"top\"\", left\",a.csv,1,-2.5,3,0\n\
             1,car/0,a.csv,1,-2.5,3,1\n"
        );
        assert_eq!(points_csv(&[], &|_| None), "point,name,source,n_m,e_m,d_m\n");
    }

    /// Merges; returns the table and the frames that were asked for.
    fn merged(files: &TrackFiles, frames: &[u64]) -> (String, Vec<u64>) {
        let mut asked = Vec::new();
        files
            .merge::<WriteError>(&frames.iter().copied().collect(), &mut |frame| {
                asked.push(frame);
                Ok(if frame == 6 { String::new() } else { format!("{frame},asked\n") })
            })
            .unwrap();
        (fs::read_to_string(files.tracks()).unwrap(), asked)
    }

    #[test]
    fn runs_add_to_one_table_in_the_order_of_frames() {
        let folder = tempfile::tempdir().unwrap();
        let files = TrackFiles::new(folder.path());
        let table = |rows: &str| tracks_header() + "\n" + rows;
        files.begin("point,name,source,n_m,e_m,d_m\n").unwrap();
        for frame in [4, 0, 2] {
            files.write_part(frame, &format!("{frame},0\n{frame},1\n")).unwrap();
        }
        let (text, asked) = merged(&files, &[0, 2, 4, 6]);
        assert_eq!(text, table("0,0\n0,1\n2,0\n2,1\n4,0\n4,1\n"));
        assert_eq!(asked, [6]);
        assert!(!files.parts().exists());
        // Another run: a frame of its own, one again, one that left no part, and one whose frame is gone.
        files.begin("point,name,source,n_m,e_m,d_m\n").unwrap();
        files.write_part(1, "1,0\n").unwrap();
        files.write_part(4, "4,new\n").unwrap();
        files.write_part(9, "9,0\n").unwrap();
        let (text, asked) = merged(&files, &[0, 1, 3, 4]);
        assert_eq!(text, table("0,0\n0,1\n1,0\n3,asked\n4,new\n"));
        assert_eq!(asked, [3]);
        assert!(files.part(9).exists() && !files.part(4).exists(), "another run's part stays");
        // A row that a full disk cut.
        fs::write(files.tracks(), table("0,0\n1,0\n3,as")).unwrap();
        assert_eq!(merged(&files, &[0, 1, 3]), (table("0,0\n1,0\n3,asked\n"), vec![3]));
        // Other points.
        files.begin("point,name,source,n_m,e_m,d_m\n0,a,b,1,2,3\n").unwrap();
        assert!(!files.tracks().exists() && !files.parts().exists());
    }

    #[test]
    fn a_failed_merge_leaves_everything_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let files = TrackFiles::new(folder.path());
        files.write_part(0, "0,0\n").unwrap();
        let failed = files.merge::<WriteError>(&[0, 1].into(), &mut |_| Err(WriteError::Stopped));
        assert!(matches!(failed, Err(WriteError::Stopped)));
        assert!(!files.tracks().exists() && files.part(0).exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file");
    }

    #[test]
    fn tables_of_others_are_recognised() {
        let folder = tempfile::tempdir().unwrap();
        let files = TrackFiles::new(folder.path());
        assert_eq!(files.foreign().unwrap(), None);
        files.begin(&points_csv(&[], &|_| None)).unwrap();
        assert_eq!(files.foreign().unwrap(), None);
        fs::write(files.tracks(), "x").unwrap();
        assert_eq!(files.foreign().unwrap(), Some(files.tracks()));
        fs::write(files.points(), "n_m,e_m,d_m\n1,2,3\n").unwrap();
        assert_eq!(files.foreign().unwrap(), Some(files.points()));
    }
}
