//! Parser of ArduPilot's DataFlash files: messages with the columns that the file itself defines.

use std::collections::{HashMap, hash_map::Entry};

use super::super::scalars::Scalar;

const HEAD: [u8; 2] = [0xa3, 0x95];
const HEAD_BYTES: usize = 3;
/// The message that defines messages.
const FORMAT_ID: u8 = 128;
const FORMAT_BYTES: usize = 89;

/// Messages of one name.
#[derive(Debug)]
pub(super) struct Message<'a> {
    /// Name, as `ATT`.
    pub(super) name: String,
    /// Number in the file (from 1) and bytes behind the head.
    pub(super) records: Vec<(usize, &'a [u8])>,
    columns: HashMap<String, Column>,
    /// Offsets and lengths of columns of text.
    texts: HashMap<String, (usize, usize)>,
    length: usize,
}

/// Offset, type and unit of a column.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    offset: usize,
    scalar: Scalar,
    factor: f64,
}

impl Column {
    /// The value in a record, in the unit of the log: degrees, metres.
    pub(super) fn read(self, record: &[u8]) -> f64 {
        self.scalar.read(record, self.offset).map_or(f64::NAN, |value| value * self.factor)
    }
}

impl Message<'_> {
    /// The first column of these names that the message has.
    pub(super) fn column(&self, names: &[&str]) -> Option<Column> {
        names.iter().find_map(|name| self.columns.get(*name).copied())
    }

    /// The columns of all these names.
    pub(super) fn columns<const N: usize>(&self, names: [&str; N]) -> Option<[Column; N]> {
        let mut columns = [Column { offset: 0, scalar: Scalar::U8, factor: 1.0 }; N];
        for (column, name) in columns.iter_mut().zip(names) {
            *column = self.column(&[name])?;
        }
        Some(columns)
    }
}

/// The parsed file.
#[derive(Debug)]
pub(super) struct DataflashFile<'a> {
    messages: HashMap<u8, Message<'a>>,
    /// Damage that was passed over, in words.
    pub(super) damage: Vec<String>,
}

impl<'a> DataflashFile<'a> {
    /// Parses a file.
    ///
    /// # Errors
    /// It is no DataFlash file: what is wrong, in words.
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        if !bytes.starts_with(&HEAD) {
            return Err("it is no ArduPilot log: its first bytes are not a3 95".to_owned());
        }
        let mut file = Self { messages: HashMap::new(), damage: Vec::new() };
        let (mut at, mut number, mut skipped, mut first_skipped) = (0, 0, 0_usize, None);
        while at < bytes.len() {
            let length = file.length_at(bytes, at);
            match length.and_then(|length| bytes.get(at + HEAD_BYTES..at + length).map(|body| (length, body)))
            {
                Some((length, body)) => {
                    number += 1;
                    file.record(bytes[at + 2], number, body);
                    at += length;
                }
                None if length.is_some() => {
                    file.damage.push(format!("the log is cut off at byte {at}, within a message"));
                    break;
                }
                None => {
                    first_skipped.get_or_insert(at);
                    skipped += 1;
                    at += 1;
                }
            }
        }
        if let Some(first) = first_skipped {
            file.damage.push(format!("{skipped} bytes are no messages, first at byte {first}: passed over"));
        }
        if file.messages.is_empty() {
            return Err(
                "the ArduPilot log defines no messages (FMT): it is damaged, or another file".to_owned()
            );
        }
        Ok(file)
    }

    /// Length of the message at `at`; `None` if none begins there, or one of unknown kind.
    fn length_at(&self, bytes: &[u8], at: usize) -> Option<usize> {
        let head = bytes.get(at..at + HEAD_BYTES)?;
        if head[..2] != HEAD {
            return None;
        }
        if head[2] == FORMAT_ID {
            return Some(FORMAT_BYTES);
        }
        self.messages.get(&head[2]).map(|message| message.length)
    }

    fn record(&mut self, id: u8, number: usize, body: &'a [u8]) {
        if id == FORMAT_ID {
            self.define(body);
        } else if let Some(message) = self.messages.get_mut(&id) {
            message.records.push((number, body));
        }
    }

    /// Adds the definition of a message. A second one of the same kind changes nothing.
    fn define(&mut self, body: &[u8]) {
        let text = |range: std::ops::Range<usize>| {
            let bytes = body.get(range).unwrap_or_default();
            String::from_utf8_lossy(bytes.split(|&byte| byte == 0).next().unwrap_or_default()).into_owned()
        };
        let (Some(&id), Some(&length)) = (body.first(), body.get(1)) else { return };
        let (name, formats, names) = (text(2..6), text(6..22), text(22..86));
        if usize::from(length) < HEAD_BYTES {
            return;
        }
        let (mut columns, mut texts, mut offset) = (HashMap::new(), HashMap::new(), 0);
        for (format, name) in formats.bytes().zip(names.split(',')) {
            let Some((scalar, factor, size)) = column_type(format) else { break };
            let name = name.trim().to_owned();
            match scalar {
                Some(scalar) => drop(columns.insert(name, Column { offset, scalar, factor })),
                None => drop(texts.insert(name, (offset, size))),
            }
            offset += size;
        }
        if let Entry::Vacant(entry) = self.messages.entry(id) {
            entry.insert(Message { name, records: Vec::new(), columns, texts, length: length.into() });
        }
    }

    /// The messages of a name, if there are any.
    pub(super) fn find(&self, name: &str) -> Option<&Message<'a>> {
        self.messages.values().find(|message| message.name == name && !message.records.is_empty())
    }

    /// The last value of a parameter of the vehicle.
    pub(super) fn parameter(&self, name: &str) -> Option<f64> {
        let message = self.find("PARM")?;
        let (value, &(at, size)) = (message.column(&["Value"])?, message.texts.get("Name")?);
        let is_wanted = |record: &&(usize, &[u8])| {
            let text = record.1.get(at..at + size).unwrap_or_default();
            text.split(|&byte| byte == 0).next() == Some(name.as_bytes())
        };
        message.records.iter().rev().find(is_wanted).map(|(_, record)| value.read(record))
    }

    /// All messages with records, by name.
    pub(super) fn all(&self) -> Vec<&Message<'a>> {
        let mut all: Vec<&Message<'a>> =
            self.messages.values().filter(|message| !message.records.is_empty()).collect();
        all.sort_by(|a, b| a.name.cmp(&b.name));
        all
    }
}

/// Type, factor and size of a column by its letter; no type for text and arrays.
fn column_type(letter: u8) -> Option<(Option<Scalar>, f64, usize)> {
    let number = |scalar: Scalar, factor: f64| Some((Some(scalar), factor, scalar.size()));
    match letter {
        b'b' => number(Scalar::I8, 1.0),
        b'B' | b'M' => number(Scalar::U8, 1.0),
        b'h' => number(Scalar::I16, 1.0),
        b'H' => number(Scalar::U16, 1.0),
        b'i' => number(Scalar::I32, 1.0),
        b'I' => number(Scalar::U32, 1.0),
        b'q' => number(Scalar::I64, 1.0),
        b'Q' => number(Scalar::U64, 1.0),
        b'g' => number(Scalar::F16, 1.0),
        b'f' => number(Scalar::F32, 1.0),
        b'd' => number(Scalar::F64, 1.0),
        b'c' => number(Scalar::I16, 0.01),
        b'C' => number(Scalar::U16, 0.01),
        b'e' => number(Scalar::I32, 0.01),
        b'E' => number(Scalar::U32, 0.01),
        b'L' => number(Scalar::I32, 1e-7),
        b'n' => Some((None, 1.0, 4)),
        b'N' => Some((None, 1.0, 16)),
        b'Z' | b'a' => Some((None, 1.0, 64)),
        _ => None,
    }
}
