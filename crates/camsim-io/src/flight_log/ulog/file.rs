//! Parser of ULog files (PX4): subscribed topics with the fields of their messages.
//!
//! A file is a head, definitions and data, all messages of `u16 size, u8 type`. Where a message is damaged,
//! the parser goes on behind the next synchronisation message, or stops; either is reported.

use std::collections::HashMap;

use super::super::scalars::{Scalar, array};

const MAGIC: &[u8] = b"ULog\x01\x12\x35";
const HEAD_BYTES: usize = 16;
/// A whole synchronisation message.
const SYNC: &[u8] = b"\x08\x00\x53\x2f\x73\x13\x20\x25\x0c\xbb\x12";
/// Bit of the incompatible flags: data are appended behind the log.
const APPENDED: u8 = 1;
/// Deepest nesting of message formats.
const MAX_DEPTH: usize = 8;

/// A topic with its messages.
#[derive(Clone, Debug)]
pub(super) struct Topic<'a> {
    /// Name, as `vehicle_attitude`.
    pub(super) name: String,
    /// Instance, from 0.
    pub(super) instance: u8,
    /// Number in the file (from 1) and bytes of each message.
    pub(super) messages: Vec<(usize, &'a [u8])>,
    /// Whether the messages are of several instances, one after the other.
    pub(super) is_merged: bool,
    fields: HashMap<String, (usize, Scalar)>,
}

impl Topic<'_> {
    /// Where a field stands; elements of arrays are `q[0]`, those of nested messages `inner.field`.
    pub(super) fn field(&self, name: &str) -> Option<UlogField> {
        self.fields.get(name).map(|&(offset, scalar)| UlogField { offset, scalar })
    }

    /// Where the elements `name[0]` to `name[N - 1]` stand.
    pub(super) fn array_field<const N: usize>(&self, name: &str) -> Option<[UlogField; N]> {
        let mut fields = [UlogField { offset: 0, scalar: Scalar::U8 }; N];
        for (index, field) in fields.iter_mut().enumerate() {
            *field = self.field(&format!("{name}[{index}]"))?;
        }
        Some(fields)
    }
}

/// Offset and type of a field.
#[derive(Clone, Copy, Debug)]
pub(super) struct UlogField {
    offset: usize,
    scalar: Scalar,
}

impl UlogField {
    /// The value in a message; NaN where the message is too short.
    pub(super) fn read(self, message: &[u8]) -> f64 {
        self.scalar.read(message, self.offset).unwrap_or(f64::NAN)
    }
}

/// The parsed file.
#[derive(Debug)]
pub(super) struct UlogFile<'a> {
    /// Topics in the order of their subscription.
    pub(super) topics: Vec<Topic<'a>>,
    /// Damage that was passed over, in words.
    pub(super) damage: Vec<String>,
    formats: HashMap<String, String>,
    by_id: HashMap<u16, usize>,
    messages: usize,
}

impl<'a> UlogFile<'a> {
    /// Parses a file.
    ///
    /// # Errors
    /// It is no ULog file, of a newer kind, or has no data: what is wrong, in words.
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        if !bytes.starts_with(MAGIC) || bytes.len() < HEAD_BYTES {
            return Err("it is no PX4 log: its first bytes are not those of ULog".to_owned());
        }
        let mut file = Self {
            topics: Vec::new(),
            damage: Vec::new(),
            formats: HashMap::new(),
            by_id: HashMap::new(),
            messages: 0,
        };
        let mut begin = HEAD_BYTES;
        for end in appended_offsets(bytes)?.into_iter().chain([bytes.len()]) {
            file.parse_part(bytes, begin, end);
            begin = end;
        }
        if file.topics.iter().all(|topic| topic.messages.is_empty()) {
            return Err("the PX4 log has no data messages: the logger stopped before the flight".to_owned());
        }
        Ok(file)
    }

    /// Parses the messages from `at` to `end`.
    fn parse_part(&mut self, bytes: &'a [u8], mut at: usize, end: usize) {
        while at < end {
            let head = array::<3>(bytes, at).filter(|_| at + 3 <= end);
            let body = head.map(|[low, high, kind]| {
                let size = usize::from(u16::from_le_bytes([low, high]));
                (kind, at + 3, at + 3 + size)
            });
            match body {
                Some((kind, from, to)) if to <= end && is_kind(kind) && to > from => {
                    self.messages += 1;
                    if let Some(body) = bytes.get(from..to) {
                        self.message(kind, body);
                    }
                    at = to;
                }
                _ => {
                    let rest = bytes.get(at..end).unwrap_or_default();
                    let next = rest.windows(SYNC.len()).position(|window| window == SYNC);
                    let cut_off = body.is_none_or(|(kind, _, to)| is_kind(kind) && to > end);
                    match next {
                        Some(skipped) => {
                            self.damage.push(format!("{skipped} damaged bytes at byte {at} are passed over"));
                            at += skipped;
                        }
                        None if cut_off => {
                            self.damage.push(format!("the log is cut off at byte {at}, within a message"));
                            return;
                        }
                        None => {
                            self.damage.push(format!(
                                "the log is damaged at byte {at}: the {} bytes from there are not read",
                                end - at
                            ));
                            return;
                        }
                    }
                }
            }
        }
    }

    fn message(&mut self, kind: u8, body: &'a [u8]) {
        match kind {
            b'F' => {
                let text = String::from_utf8_lossy(body);
                if let Some((name, fields)) = text.split_once(':') {
                    self.formats.insert(name.to_owned(), fields.to_owned());
                }
            }
            b'A' => {
                let (Some([instance, low, high]), Some(name)) = (array(body, 0), body.get(3..)) else {
                    return;
                };
                let name = String::from_utf8_lossy(name).into_owned();
                let mut fields = HashMap::new();
                self.lay_out(&name, "", &mut 0, &mut fields, 0);
                self.by_id.insert(u16::from_le_bytes([low, high]), self.topics.len());
                self.topics.push(Topic { name, instance, messages: Vec::new(), is_merged: false, fields });
            }
            b'R' => {
                if let Some(id) = array(body, 0) {
                    self.by_id.remove(&u16::from_le_bytes(id));
                }
            }
            b'D' => {
                let Some(id) = array(body, 0) else { return };
                let topic = self.by_id.get(&u16::from_le_bytes(id)).and_then(|&at| self.topics.get_mut(at));
                if let (Some(topic), Some(payload)) = (topic, body.get(2..)) {
                    topic.messages.push((self.messages, payload));
                }
            }
            _ => {}
        }
    }

    /// Finds the offsets of all numbers of a format. What stands behind a field of unknown type has none.
    fn lay_out(
        &self,
        format: &str,
        prefix: &str,
        offset: &mut usize,
        fields: &mut HashMap<String, (usize, Scalar)>,
        depth: usize,
    ) -> bool {
        let Some(text) = self.formats.get(format).filter(|_| depth < MAX_DEPTH) else { return false };
        for field in text.split(';').filter(|field| !field.is_empty()) {
            let Some((kind, name)) = field.split_once(' ') else { return false };
            let (kind, count) = match kind.split_once('[') {
                Some((kind, count)) => (kind, count.trim_end_matches(']').parse().ok()),
                None => (kind, Some(1_usize)),
            };
            let Some(count) = count.filter(|&count| count <= usize::from(u16::MAX)) else { return false };
            for index in 0..count {
                let is_array = field.contains('[');
                let full =
                    if is_array { format!("{prefix}{name}[{index}]") } else { format!("{prefix}{name}") };
                match scalar(kind) {
                    Some(scalar) => {
                        fields.insert(full, (*offset, scalar));
                        *offset += scalar.size();
                    }
                    None if self.lay_out(kind, &format!("{full}."), offset, fields, depth + 1) => {}
                    None => return false,
                }
                if *offset > usize::from(u16::MAX) {
                    return false;
                }
            }
        }
        true
    }
}

/// Offsets of data that were appended behind the log, ascending.
fn appended_offsets(bytes: &[u8]) -> Result<Vec<usize>, String> {
    let Some([low, high, b'B']) = array(bytes, HEAD_BYTES) else { return Ok(Vec::new()) };
    let body = bytes.get(HEAD_BYTES + 3..).unwrap_or_default();
    let Some(flags) = body.get(..40).filter(|_| u16::from_le_bytes([low, high]) >= 40) else {
        return Ok(Vec::new());
    };
    let incompatible = flags.get(8..16).unwrap_or_default();
    let unknown = incompatible.iter().enumerate().any(|(at, &bits)| {
        let known = if at == 0 { APPENDED } else { 0 };
        bits & !known != 0
    });
    if unknown {
        return Err(
            "the PX4 log is of a kind newer than this reader: convert it (pip install pyulog; ulog2csv)"
                .to_owned(),
        );
    }
    let mut offsets: Vec<usize> = [16, 24, 32]
        .into_iter()
        .filter_map(|at| array(flags, at).map(u64::from_le_bytes))
        .filter_map(|offset| usize::try_from(offset).ok())
        .filter(|&offset| offset > HEAD_BYTES && offset < bytes.len())
        .collect();
    offsets.sort_unstable();
    Ok(offsets)
}

/// Whether a message of this type exists.
fn is_kind(kind: u8) -> bool {
    b"BFIMPQARDLCSO".contains(&kind)
}

fn scalar(kind: &str) -> Option<Scalar> {
    Some(match kind {
        "int8_t" => Scalar::I8,
        "uint8_t" | "bool" | "char" => Scalar::U8,
        "int16_t" => Scalar::I16,
        "uint16_t" => Scalar::U16,
        "int32_t" => Scalar::I32,
        "uint32_t" => Scalar::U32,
        "int64_t" => Scalar::I64,
        "uint64_t" => Scalar::U64,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        _ => return None,
    })
}
