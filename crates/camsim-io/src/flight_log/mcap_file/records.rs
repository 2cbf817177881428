//! Records of MCAP files: the messages of the known kinds, by topic.

use std::{
    borrow::Cow,
    collections::{BTreeMap, HashMap},
    fmt,
    io::Read,
    sync::Arc,
};

use mcap::{
    MAGIC,
    read::parse_record,
    records::{ChunkHeader, Record},
};

use super::{
    super::scalars::array,
    cdr::Decoder,
    messages::{self, Names, RosKind, Sample},
};

/// Larger chunks are damage.
const MAX_CHUNK_BYTES: u64 = 1 << 32;

/// A topic, and the child frame where it holds the poses of several.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct TopicKey {
    pub(super) topic: String,
    pub(super) child: Option<Arc<str>>,
}

impl fmt::Display for TopicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.child {
            Some(child) => write!(f, "{}#{child}", self.topic),
            None => f.write_str(&self.topic),
        }
    }
}

/// The topics of a file.
#[derive(Debug, Default)]
pub(super) struct Topics {
    /// Kinds of the known topics that have messages.
    pub(super) kinds: BTreeMap<TopicKey, RosKind>,
    /// Their samples, in the order of the file.
    pub(super) samples: HashMap<TopicKey, Vec<Sample>>,
    /// Other topics with their types.
    pub(super) others: BTreeMap<String, String>,
    /// Damage that was passed over, in words.
    pub(super) damage: Vec<String>,
}

/// A channel of a known kind.
struct PoseChannel {
    topic: String,
    encoding: String,
    kind: RosKind,
}

#[derive(Default)]
struct RecordReader {
    schemas: HashMap<u16, String>,
    channels: HashMap<u16, PoseChannel>,
    topics: Topics,
    names: Names,
    messages: usize,
    undecoded: usize,
}

/// Reads all messages of the known kinds.
///
/// # Errors
/// The file is no MCAP file: what is wrong, in words.
pub(super) fn read(bytes: &[u8]) -> Result<Topics, String> {
    let Some(body) = bytes.strip_prefix(MAGIC) else {
        return Err("it is no MCAP file: its first bytes are not those of MCAP".to_owned());
    };
    let is_whole = body.ends_with(MAGIC);
    let body = body.strip_suffix(MAGIC).unwrap_or(body);
    let mut reader = RecordReader::default();
    let mut rest = body;
    while let Some(record) = next_record(&mut rest) {
        match record {
            Ok(Record::Footer(_)) => break,
            Ok(record) => reader.record(record)?,
            Err(problem) => {
                reader.topics.damage.push(problem);
                break;
            }
        }
    }
    if !is_whole && reader.topics.damage.is_empty() {
        reader
            .topics
            .damage
            .push("the MCAP file was not closed: its last messages may be missing".to_owned());
    }
    if reader.undecoded > 0 {
        let text =
            format!("{} messages are too short or in an unknown encoding, and are skipped", reader.undecoded);
        reader.topics.damage.push(text);
    }
    reader.topics.split_children();
    Ok(reader.topics)
}

impl Topics {
    /// Splits topics that hold the poses of several bodies.
    fn split_children(&mut self) {
        let has_several = |samples: &[Sample]| {
            let mut children = samples.iter().map(|sample| &sample.child);
            let first = children.next();
            children.any(|child| Some(child) != first)
        };
        let mixed: Vec<TopicKey> = self
            .samples
            .iter()
            .filter(|(key, samples)| key.child.is_none() && has_several(samples))
            .map(|(key, _)| key.clone())
            .collect();
        for key in mixed {
            let (Some(samples), Some(kind)) = (self.samples.remove(&key), self.kinds.remove(&key)) else {
                continue;
            };
            for sample in samples {
                let child = Some(sample.child.clone().unwrap_or_default());
                let key = TopicKey { topic: key.topic.clone(), child };
                self.kinds.insert(key.clone(), kind);
                self.samples.entry(key).or_default().push(sample);
            }
        }
    }
}

/// Takes the next record off the bytes; `None` at their end.
fn next_record<'a>(rest: &mut &'a [u8]) -> Option<Result<Record<'a>, String>> {
    let (&opcode, _) = rest.split_first()?;
    let length = array(rest, 1).map(u64::from_le_bytes).and_then(|length| usize::try_from(length).ok());
    let record = length.and_then(|length| rest.get(9..)?.split_at_checked(length));
    let Some((body, after)) = record else {
        return Some(Err("the MCAP file is cut off: its last messages are missing".to_owned()));
    };
    *rest = after;
    Some(
        parse_record(opcode, body)
            .map_err(|error| format!("the MCAP file is damaged ({error}): what follows is not read")),
    )
}

impl RecordReader {
    fn record(&mut self, record: Record<'_>) -> Result<(), String> {
        match record {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
            }
            Record::Channel(channel) => {
                let Some(schema) = self.schemas.get(&channel.schema_id) else { return Ok(()) };
                match RosKind::of_schema(schema)
                    .filter(|_| matches!(channel.message_encoding.as_str(), "cdr" | "ros1"))
                {
                    Some(kind) => {
                        let (topic, encoding) = (channel.topic, channel.message_encoding);
                        self.channels.insert(channel.id, PoseChannel { topic, encoding, kind });
                    }
                    None => {
                        let kind = if matches!(channel.message_encoding.as_str(), "cdr" | "ros1") {
                            schema.clone()
                        } else {
                            format!("{schema} as {}", channel.message_encoding)
                        };
                        self.topics.others.insert(channel.topic, kind);
                    }
                }
            }
            Record::Message { header, data } => {
                self.messages += 1;
                let Some(channel) = self.channels.get(&header.channel_id) else { return Ok(()) };
                let decoded = Decoder::new(&channel.encoding, &data).and_then(|decoder| {
                    let recorded_ns = i128::from(header.log_time);
                    messages::decode(channel.kind, decoder, self.messages, recorded_ns, &mut self.names)
                });
                let Some(samples) = decoded else {
                    self.undecoded += 1;
                    return Ok(());
                };
                for sample in samples {
                    let child = sample.child.clone().filter(|_| channel.kind == RosKind::Transforms);
                    let key = TopicKey { topic: channel.topic.clone(), child };
                    self.topics.kinds.insert(key.clone(), channel.kind);
                    self.topics.samples.entry(key).or_default().push(sample);
                }
            }
            Record::Chunk { header, data } => self.chunk(&header, &data)?,
            _ => {}
        }
        Ok(())
    }

    fn chunk(&mut self, header: &ChunkHeader, data: &[u8]) -> Result<(), String> {
        let content = match decompress(header, data) {
            Ok(content) => content,
            Err(problem) => {
                self.topics.damage.push(format!("a chunk is skipped: {problem}"));
                return Ok(());
            }
        };
        if header.uncompressed_crc != 0 && crc32fast::hash(&content) != header.uncompressed_crc {
            self.topics.damage.push("a chunk is skipped: its checksum is wrong".to_owned());
            return Ok(());
        }
        let mut rest = &content[..];
        while let Some(record) = next_record(&mut rest) {
            match record {
                Ok(Record::Chunk { .. }) => {
                    return Err("a chunk holds a chunk: the MCAP file is damaged".to_owned());
                }
                Ok(record) => self.record(record)?,
                Err(problem) => {
                    self.topics.damage.push(problem);
                    break;
                }
            }
        }
        Ok(())
    }
}

/// The content of a chunk.
fn decompress<'a>(header: &ChunkHeader, data: &'a [u8]) -> Result<Cow<'a, [u8]>, String> {
    if header.uncompressed_size > MAX_CHUNK_BYTES {
        return Err(format!("{} bytes are too many for one", header.uncompressed_size));
    }
    let mut content = Vec::new();
    match header.compression.as_str() {
        "" => return Ok(Cow::Borrowed(data)),
        "zstd" => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(data).map_err(|error| error.to_string())?;
            decoder
                .take(header.uncompressed_size)
                .read_to_end(&mut content)
                .map_err(|error| error.to_string())?;
        }
        "lz4" => {
            let decoder = lz4_flex::frame::FrameDecoder::new(data);
            decoder
                .take(header.uncompressed_size)
                .read_to_end(&mut content)
                .map_err(|error| error.to_string())?;
        }
        other => {
            return Err(format!("its compression `{other}` is not known (zstd, lz4): run `mcap recover`"));
        }
    }
    Ok(Cow::Owned(content))
}
