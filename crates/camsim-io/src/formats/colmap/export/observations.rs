//! Tracked points of a run, frame by frame and point by point, without holding all of them.

use std::path::Path;

use glam::DVec3;

use crate::formats::exporting::DatasetError;
use crate::formats::exporting::csv_rows::CsvRows;
use crate::formats::exporting::run_folder::RunCamera;
use crate::write::{PointRecord, TRACKS_CSV, TrackRecord};

/// Where a frame shows a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Observation {
    /// Number of the point in `points.csv`.
    pub(super) point: u64,
    /// Pixel coordinates; (0, 0) is the centre of the first pixel.
    pub(super) px: [f64; 2],
}

/// Rows of `tracks.csv` by ascending frames.
pub(super) struct FrameObservations {
    rows: Option<CsvRows>,
    next: Option<(u64, Option<Observation>)>,
}

impl FrameObservations {
    /// Opens the table of a camera; without rows if it has none.
    pub(super) fn open(camera: &RunCamera) -> Result<Self, DatasetError> {
        let path = camera.folder.join(TRACKS_CSV);
        if !path.is_file() {
            return Ok(Self { rows: None, next: None });
        }
        let columns = ["frame", "point", "x_px", "y_px", "visible", "solutions"];
        let rows = CsvRows::open::<TrackRecord>(&path, &columns)?;
        let mut observations = Self { rows: Some(rows), next: None };
        observations.advance()?;
        Ok(observations)
    }

    fn advance(&mut self) -> Result<(), DatasetError> {
        let Some(rows) = &mut self.rows else { return Ok(()) };
        self.next = match rows.advance()? {
            false => None,
            true => {
                // A point that is hidden, or shown several times, is no observation to others.
                let is_seen_once = rows.text(4) == "1" && rows.text(5) == "1";
                let seen = Observation { point: rows.whole(1)?, px: [rows.number(2)?, rows.number(3)?] };
                Some((rows.whole(0)?, is_seen_once.then_some(seen)))
            }
        };
        Ok(())
    }

    /// Observations of a frame; frames must ascend.
    pub(super) fn of(&mut self, frame: u64, seen: &mut Vec<Observation>) -> Result<(), DatasetError> {
        seen.clear();
        while let Some((number, observation)) = self.next.filter(|(number, _)| *number <= frame) {
            if number == frame {
                seen.extend(observation);
            }
            self.advance()?;
        }
        Ok(())
    }
}

/// Positions of points, north, east, down; none if there is no such file.
pub(super) fn read_points(path: &Path) -> Result<Vec<DVec3>, DatasetError> {
    let mut points = Vec::new();
    if path.is_file() {
        let mut rows = CsvRows::open::<PointRecord>(path, &["position_ned_m"])?;
        while rows.advance()? {
            points.push(rows.vector(0)?);
        }
    }
    Ok(points)
}
