//! Rows of the tables of an output folder, by the names of their columns, one at a time.

use std::{
    fs::File,
    path::{Path, PathBuf},
};

use glam::{DQuat, DVec3};

use super::DatasetError;
use crate::columns::{TableRow, cells};

/// A table that is read from its begin to its end.
pub(crate) struct CsvRows {
    path: PathBuf,
    reader: csv::Reader<File>,
    header: csv::StringRecord,
    /// Indices of the cells of each asked column.
    columns: Vec<Vec<usize>>,
    record: csv::StringRecord,
}

impl CsvRows {
    /// Opens a table with these columns of its list, by their names in Python.
    pub(crate) fn open<R: TableRow>(path: &Path, columns: &[&str]) -> Result<Self, DatasetError> {
        let fail = |message: String| DatasetError::Input { path: path.into(), message };
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_path(path).map_err(|error| {
            fail(format!("cannot be read: {error}; render the folder again with --resume"))
        })?;
        let header = reader.headers().map_err(|error| fail(error.to_string()))?.clone();
        let index_of = |name: String| {
            header.iter().position(|column| column == name).ok_or_else(|| {
                fail(format!("has no column {name}: it is not a table of this version of camsim"))
            })
        };
        let cells_of = |column: &&str| cells::<R>(column).into_iter().map(index_of).collect();
        let columns = columns.iter().map(cells_of).collect::<Result<_, _>>()?;
        Ok(Self { path: path.into(), reader, header, columns, record: csv::StringRecord::new() })
    }

    /// All names of columns.
    pub(crate) fn header(&self) -> &csv::StringRecord {
        &self.header
    }

    /// Reads the next row; false at the end.
    pub(crate) fn advance(&mut self) -> Result<bool, DatasetError> {
        let Self { path, reader, record, .. } = self;
        reader
            .read_record(record)
            .map_err(|error| DatasetError::Input { path: path.clone(), message: error.to_string() })
    }

    /// A cell by its index in the row.
    pub(crate) fn cell(&self, index: usize) -> &str {
        self.record.get(index).unwrap_or_default()
    }

    /// The first cell of the i-th of the asked columns.
    pub(crate) fn text(&self, i: usize) -> &str {
        self.cell(self.columns[i][0])
    }

    fn bad(&self, index: usize, wanted: &str) -> DatasetError {
        let line = self.record.position().map_or(0, csv::Position::line);
        let (name, text) = (self.header.get(index).unwrap_or_default(), self.cell(index));
        DatasetError::Input {
            path: self.path.clone(),
            message: format!(
                "line {line}: {name} is \"{text}\", not {wanted}; render the folder again with --resume"
            ),
        }
    }

    /// Finite numbers, as many as the i-th column has cells.
    fn numbers<const N: usize>(&self, i: usize) -> Result<[f64; N], DatasetError> {
        let mut values = [0.0; N];
        for (value, &index) in values.iter_mut().zip(&self.columns[i]) {
            let finite = self.cell(index).parse().ok().filter(|value: &f64| value.is_finite());
            *value = finite.ok_or_else(|| self.bad(index, "a number"))?;
        }
        Ok(values)
    }

    /// A finite number.
    pub(crate) fn number(&self, i: usize) -> Result<f64, DatasetError> {
        let [value] = self.numbers(i)?;
        Ok(value)
    }

    /// A whole number.
    pub(crate) fn whole<T: std::str::FromStr>(&self, i: usize) -> Result<T, DatasetError> {
        self.text(i).parse().map_err(|_| self.bad(self.columns[i][0], "a whole number"))
    }

    /// Decimal seconds as nanoseconds, exactly.
    pub(crate) fn seconds_ns(&self, i: usize) -> Result<i64, DatasetError> {
        nanoseconds(self.text(i)).ok_or_else(|| self.bad(self.columns[i][0], "a time in seconds"))
    }

    /// A vector.
    pub(crate) fn vector(&self, i: usize) -> Result<DVec3, DatasetError> {
        Ok(DVec3::from_array(self.numbers(i)?))
    }

    /// A quaternion.
    pub(crate) fn wxyz(&self, i: usize) -> Result<DQuat, DatasetError> {
        let [w, x, y, z] = self.numbers(i)?;
        Ok(DQuat::from_xyzw(x, y, z, w))
    }
}

/// Nanoseconds of decimal seconds with at most nine decimals.
fn nanoseconds(text: &str) -> Option<i64> {
    let (is_negative, digits) = text.strip_prefix('-').map_or((false, text), |rest| (true, rest));
    let (whole, rest) = digits.split_once('.').unwrap_or((digits, ""));
    if whole.is_empty() || rest.len() > 9 || !digits.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.')
    {
        return None;
    }
    let rest: i64 = format!("{rest:0<9}").parse().ok()?;
    let ns = whole.parse::<i64>().ok()?.checked_mul(1_000_000_000)?.checked_add(rest)?;
    Some(if is_negative { -ns } else { ns })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use camsim_core::pose::BodyState;

    use super::*;

    #[test]
    fn seconds_are_read_to_the_last_nanosecond() {
        for (text, ns) in [
            ("1403636580.838555648", Some(1_403_636_580_838_555_648)),
            ("-0.000000001", Some(-1)),
            ("12", Some(12_000_000_000)),
            ("0.5", Some(500_000_000)),
            ("", None),
            ("1e9", None),
            ("1.0000000001", None),
            ("99999999999999", None),
        ] {
            assert_eq!(nanoseconds(text), ns, "{text}");
        }
    }

    #[test]
    fn errors_name_file_line_and_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, "x,y\n1,2\n3,nan\n").unwrap();
        let mut rows = CsvRows::open::<BodyState>(&path, &["y"]).unwrap();
        assert!(rows.advance().unwrap());
        assert_eq!(rows.number(0).unwrap(), 2.0);
        assert!(rows.advance().unwrap());
        let text = rows.number(0).unwrap_err().to_string();
        assert!(text.contains("a.csv") && text.contains("line 3") && text.contains("y is \"nan\""), "{text}");
        assert!(!rows.advance().unwrap());
        let text = CsvRows::open::<BodyState>(&path, &["z"]).err().unwrap().to_string();
        assert!(text.contains("no column z"), "{text}");
    }
}
