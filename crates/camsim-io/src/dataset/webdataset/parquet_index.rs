//! `samples.parquet`: the index of samples with their poses.

use std::{fs::File, io::BufWriter, sync::Arc};

use parquet::{
    data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type},
    errors::ParquetError,
    file::{
        properties::WriterProperties,
        writer::{SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::parser::parse_message_type,
};

use super::super::DatasetError;

/// Samples of a group of rows: what is held in memory.
const GROUP: usize = 2000;

const SCHEMA: &str = "message samples {
    required binary key (STRING);
    required binary shard (STRING);
    required int64 frame;
    required binary camera (STRING);
    required int64 stamp_ns;
    required int64 centre_ns;
    required double x_m;
    required double y_m;
    required double z_m;
    required double qw;
    required double qx;
    required double qy;
    required double qz;
}";

/// A row of the index.
pub(super) struct SampleRow {
    pub(super) key: String,
    pub(super) shard: String,
    pub(super) camera: String,
    /// Frame, stamp, instant of the centre.
    pub(super) numbers: [i64; 3],
    /// Position and quaternion w x y z.
    pub(super) pose: [f64; 7],
}

/// Writes the rows.
pub(super) fn write(
    out: &mut BufWriter<File>,
    rows: impl Iterator<Item = Result<SampleRow, DatasetError>>,
) -> Result<(), DatasetError> {
    let schema = parse_message_type(SCHEMA).map_err(piece)?;
    let properties = Arc::new(WriterProperties::builder().build());
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), properties).map_err(piece)?;
    let mut group = Vec::with_capacity(GROUP);
    let mut rows = rows.peekable();
    while let Some(row) = rows.next() {
        group.push(row?);
        if group.len() == GROUP || rows.peek().is_none() {
            let mut columns = file.next_row_group().map_err(piece)?;
            write_group(&mut columns, &group).map_err(piece)?;
            columns.close().map_err(piece)?;
            group.clear();
        }
    }
    file.close().map_err(piece)?;
    Ok(())
}

fn piece(error: ParquetError) -> DatasetError {
    DatasetError::Piece(match error {
        // The system's own error says more.
        ParquetError::External(source) => match source.downcast::<std::io::Error>() {
            Ok(source) => *source,
            Err(source) => std::io::Error::other(source),
        },
        error => std::io::Error::other(error),
    })
}

/// Columns in the order of the schema.
fn write_group<W: std::io::Write + Send>(
    columns: &mut SerializedRowGroupWriter<'_, W>,
    rows: &[SampleRow],
) -> Result<(), ParquetError> {
    let texts = |text: fn(&SampleRow) -> &str| rows.iter().map(|row| ByteArray::from(text(row))).collect();
    let numbers = |k: usize| rows.iter().map(|row| row.numbers[k]).collect();
    column::<ByteArrayType, W>(columns, texts(|row| &row.key))?;
    column::<ByteArrayType, W>(columns, texts(|row| &row.shard))?;
    column::<Int64Type, W>(columns, numbers(0))?;
    column::<ByteArrayType, W>(columns, texts(|row| &row.camera))?;
    column::<Int64Type, W>(columns, numbers(1))?;
    column::<Int64Type, W>(columns, numbers(2))?;
    (0..7).try_for_each(|k| column::<DoubleType, W>(columns, rows.iter().map(|row| row.pose[k]).collect()))
}

fn column<T: DataType, W: std::io::Write + Send>(
    columns: &mut SerializedRowGroupWriter<'_, W>,
    values: Vec<T::T>,
) -> Result<(), ParquetError> {
    if let Some(mut column) = columns.next_column()? {
        column.typed::<T>().write_batch(&values, None, None)?;
        column.close()?;
    }
    Ok(())
}
