//! `samples.parquet`: the index of samples with their poses.

use std::{fs::File, io::BufWriter, sync::Arc};

use parquet::{
    column::writer::ColumnWriter,
    data_type::ByteArray,
    errors::ParquetError,
    file::{
        properties::WriterProperties,
        writer::{SerializedFileWriter, SerializedRowGroupWriter},
    },
    schema::parser::parse_message_type,
};

use crate::columns::{Cell, Columns, Get, TableRow};
use crate::formats::exporting::DatasetError;

/// Samples of a group of rows: what is held in memory.
const GROUP: usize = 2000;

/// Writes the rows.
pub(super) fn write<R: TableRow>(
    out: &mut BufWriter<File>,
    rows: impl Iterator<Item = Result<R, DatasetError>>,
) -> Result<(), DatasetError> {
    let schema = parse_message_type(&schema::<R>()).map_err(piece)?;
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

/// Columns of these names and types.
fn schema<R: TableRow>() -> String {
    let mut text = "message samples {\n".to_owned();
    for column in R::COLUMNS {
        let (kind, note) = match column.get {
            Get::Text(_) => ("binary", " (STRING)"),
            Get::Index(_) | Get::Whole(_) | Get::Flag(_) => ("int64", ""),
            _ => ("double", ""),
        };
        column.names().for_each(|name| text += &format!("required {kind} {name}{note};\n"));
    }
    text + "}"
}

/// Columns in the order of the schema.
fn write_group<R: TableRow, W: std::io::Write + Send>(
    columns: &mut SerializedRowGroupWriter<'_, W>,
    rows: &[R],
) -> Result<(), ParquetError> {
    let all = Columns::<R>::all();
    for k in 0..all.names().count() {
        let (mut texts, mut wholes, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
        for row in rows {
            let mut number = 0;
            all.each_cell(row, &mut |cell| {
                match cell {
                    _ if number != k => {}
                    Cell::Text(value) => texts.push(ByteArray::from(value)),
                    Cell::Whole(value) => wholes.push(value),
                    Cell::Number(value) => numbers.push(value),
                    Cell::Empty => numbers.push(f64::NAN),
                }
                number += 1;
            });
        }
        let Some(mut column) = columns.next_column()? else { break };
        match column.untyped() {
            ColumnWriter::ByteArrayColumnWriter(column) => column.write_batch(&texts, None, None)?,
            ColumnWriter::Int64ColumnWriter(column) => column.write_batch(&wholes, None, None)?,
            ColumnWriter::DoubleColumnWriter(column) => column.write_batch(&numbers, None, None)?,
            _ => 0,
        };
        column.close()?;
    }
    Ok(())
}
