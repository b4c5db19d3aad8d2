//! Writes the records of an MCAP file (<https://mcap.dev/spec>), version 0: channels with JSON messages and schemas, in
//! chunks that are compressed by LZ4, with all indexes, so that programs jump to any time of it.
//!
//! ```text
//! magic, Header, Schema and Channel…, (Chunk, MessageIndex…)…, DataEnd,
//! Schema and Channel…, Statistics, ChunkIndex…, SummaryOffset…, Footer, magic
//! ```
//!
//! A record is an opcode of a byte, the length of its content in eight, and the content. All numbers are little-endian.

use std::collections::BTreeMap;
use std::io::{self, Write};

use lz4_flex::frame::FrameEncoder;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// A chunk ends when its messages have so many bytes.
const CHUNK_BYTES: usize = 1 << 20;

/// The opcodes of records.
mod opcode {
    pub(super) const HEADER: u8 = 0x01;
    pub(super) const FOOTER: u8 = 0x02;
    pub(super) const SCHEMA: u8 = 0x03;
    pub(super) const CHANNEL: u8 = 0x04;
    pub(super) const MESSAGE: u8 = 0x05;
    pub(super) const CHUNK: u8 = 0x06;
    pub(super) const MESSAGE_INDEX: u8 = 0x07;
    pub(super) const CHUNK_INDEX: u8 = 0x08;
    pub(super) const STATISTICS: u8 = 0x0B;
    pub(super) const SUMMARY_OFFSET: u8 = 0x0E;
    pub(super) const DATA_END: u8 = 0x0F;
}

/// The first and the last time of some messages, in nanoseconds.
#[derive(Clone, Copy, Debug, Default)]
struct Times {
    first: u64,
    last: u64,
}

impl Times {
    fn with(range: Option<Self>, time: u64) -> Self {
        let Self { first, last } = range.unwrap_or(Self { first: time, last: time });
        Self { first: first.min(time), last: last.max(time) }
    }
}

/// The messages that were not written to the file yet.
#[derive(Debug, Default)]
struct Chunk {
    records: Vec<u8>,
    times: Option<Times>,
    /// By channel, the time of each message and where its record begins in the chunk.
    index: BTreeMap<u16, Vec<(u64, u64)>>,
}

/// A file that is being written.
#[derive(Debug)]
pub(super) struct McapFile<W: Write> {
    out: W,
    /// How many bytes were written.
    at: u64,
    chunk: Chunk,
    /// The records of schemas and channels, for the end of the file.
    schemas: Vec<u8>,
    channels: Vec<u8>,
    /// The records of the chunks' indexes, and how many chunks there are.
    chunk_indexes: Vec<u8>,
    chunks: u32,
    /// By channel, how many messages it has.
    messages: BTreeMap<u16, u64>,
    times: Option<Times>,
}

impl<W: Write> McapFile<W> {
    /// Writes the beginning of a file; `library` names the program that writes it.
    ///
    /// # Errors
    /// When it can't be written.
    pub(super) fn begin(out: W, library: &str) -> io::Result<Self> {
        let mut file = Self {
            out,
            at: 0,
            chunk: Chunk::default(),
            schemas: vec![],
            channels: vec![],
            chunk_indexes: vec![],
            chunks: 0,
            messages: BTreeMap::new(),
            times: None,
        };
        file.write(MAGIC)?;
        file.write(&record(opcode::HEADER, &[text(""), text(library)]))?;
        Ok(file)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.at += bytes.len() as u64;
        self.out.write_all(bytes)
    }

    /// Adds a channel for JSON messages before the first message; gives its number. `schema` is a JSON Schema, named
    /// `schema_name`.
    ///
    /// # Errors
    /// When it can't be written, or there are 65 535 channels already.
    pub(super) fn add_channel(
        &mut self,
        topic: &str,
        schema_name: &str,
        schema: &[u8],
    ) -> io::Result<u16> {
        let number = u16::try_from(self.messages.len() + 1);
        let number = number.map_err(|_| io::Error::other("there are too many channels"))?;
        let id = number.to_le_bytes().to_vec();
        let parts = [id.clone(), text(schema_name), text("jsonschema"), bytes(schema)];
        let schema = record(opcode::SCHEMA, &parts);
        let parts = [id.clone(), id, text(topic), text("json"), bytes(&[])];
        let channel = record(opcode::CHANNEL, &parts);
        self.write(&schema)?;
        self.write(&channel)?;
        self.schemas.extend(schema);
        self.channels.extend(channel);
        self.messages.insert(number, 0);
        Ok(number)
    }

    /// Adds a message of a channel. `sequence` is its number within the channel, `time` is in nanoseconds.
    ///
    /// # Errors
    /// When the file can't be written.
    pub(super) fn message(
        &mut self,
        channel: u16,
        sequence: u32,
        time: u64,
        data: &[u8],
    ) -> io::Result<()> {
        let offset = self.chunk.records.len() as u64;
        let numbers = [channel.to_le_bytes().to_vec(), sequence.to_le_bytes().to_vec()];
        let parts = [numbers.concat(), long(time), long(time), data.to_vec()];
        self.chunk.records.extend(record(opcode::MESSAGE, &parts));
        self.chunk.index.entry(channel).or_default().push((time, offset));
        self.chunk.times = Some(Times::with(self.chunk.times, time));
        self.times = Some(Times::with(self.times, time));
        *self.messages.entry(channel).or_default() += 1;
        if self.chunk.records.len() >= CHUNK_BYTES {
            self.end_chunk()?;
        }
        Ok(())
    }

    /// Writes the messages that were collected as a chunk, with an index for each channel.
    fn end_chunk(&mut self) -> io::Result<()> {
        let Chunk { records, times, index } = std::mem::take(&mut self.chunk);
        let Some(times) = times else { return Ok(()) };
        let mut encoder = FrameEncoder::new(vec![]);
        encoder.write_all(&records)?;
        let compressed = encoder.finish().map_err(io::Error::other)?;
        let begin = self.at;
        let parts = [
            long(times.first),
            long(times.last),
            long(records.len() as u64),
            crc32fast::hash(&records).to_le_bytes().to_vec(),
            text("lz4"),
            long(compressed.len() as u64),
            compressed.clone(),
        ];
        self.write(&record(opcode::CHUNK, &parts))?;
        let length = self.at - begin;
        let indexes_begin = self.at;
        let mut places = vec![];
        for (channel, entries) in index {
            places.extend(channel.to_le_bytes());
            places.extend(self.at.to_le_bytes());
            let entries: Vec<u8> = entries
                .into_iter()
                .flat_map(|(time, offset)| [long(time), long(offset)].concat())
                .collect();
            let parts = [channel.to_le_bytes().to_vec(), bytes(&entries)];
            self.write(&record(opcode::MESSAGE_INDEX, &parts))?;
        }
        let parts = [
            long(times.first),
            long(times.last),
            long(begin),
            long(length),
            bytes(&places),
            long(self.at - indexes_begin),
            text("lz4"),
            long(compressed.len() as u64),
            long(records.len() as u64),
        ];
        self.chunk_indexes.extend(record(opcode::CHUNK_INDEX, &parts));
        self.chunks += 1;
        Ok(())
    }

    /// Writes what is left, and the indexes at the end of the file.
    ///
    /// # Errors
    /// When the file can't be written.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.end_chunk()?;
        // No checksum of the data section: each chunk has one.
        self.write(&record(opcode::DATA_END, &[vec![0; 4]]))?;
        let counts: Vec<u8> = self
            .messages
            .iter()
            .flat_map(|(channel, count)| [channel.to_le_bytes().to_vec(), long(*count)].concat())
            .collect();
        let channels = self.messages.len();
        let times = self.times.unwrap_or_default();
        let parts = [
            long(self.messages.values().sum()),
            (channels as u16).to_le_bytes().to_vec(),
            (channels as u32).to_le_bytes().to_vec(),
            // Neither attachments nor metadata.
            vec![0; 8],
            self.chunks.to_le_bytes().to_vec(),
            long(times.first),
            long(times.last),
            bytes(&counts),
        ];
        let groups = [
            (opcode::SCHEMA, std::mem::take(&mut self.schemas)),
            (opcode::CHANNEL, std::mem::take(&mut self.channels)),
            (opcode::STATISTICS, record(opcode::STATISTICS, &parts)),
            (opcode::CHUNK_INDEX, std::mem::take(&mut self.chunk_indexes)),
        ];
        let begin = self.at;
        let mut summary = vec![];
        let mut offsets = vec![];
        for (group, records) in groups.into_iter().filter(|(_, records)| !records.is_empty()) {
            let parts =
                [vec![group], long(begin + summary.len() as u64), long(records.len() as u64)];
            offsets.extend(record(opcode::SUMMARY_OFFSET, &parts));
            summary.extend(records);
        }
        let offsets_begin = begin + summary.len() as u64;
        summary.extend(offsets);
        let footer = record(opcode::FOOTER, &[long(begin), long(offsets_begin), vec![0; 4]]);
        // The checksum is that of the summary and of the footer before it.
        summary.extend(footer.get(..footer.len() - 4).unwrap_or_default());
        let checksum = crc32fast::hash(&summary);
        summary.extend(checksum.to_le_bytes());
        self.write(&summary)?;
        self.write(MAGIC)?;
        self.out.flush()
    }
}

/// A record with the parts of its content.
fn record(opcode: u8, parts: &[Vec<u8>]) -> Vec<u8> {
    let content = parts.concat();
    [vec![opcode], long(content.len() as u64), content].concat()
}

fn long(value: u64) -> Vec<u8> {
    value.to_le_bytes().to_vec()
}

/// Bytes with their length in front, in four bytes; arrays and maps are written so too.
fn bytes(content: &[u8]) -> Vec<u8> {
    [&(content.len() as u32).to_le_bytes(), content].concat()
}

fn text(text: &str) -> Vec<u8> {
    bytes(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use lz4_flex::frame::FrameDecoder;

    use super::*;

    /// The records of some bytes: opcode, content and where each begins.
    fn records(mut all: &[u8], begin: u64) -> Vec<(u8, Vec<u8>, u64)> {
        let mut found = vec![];
        let mut at = begin;
        while let Some((opcode, rest)) = all.split_first() {
            let (length, rest) = rest.split_first_chunk::<8>().unwrap();
            let length = u64::from_le_bytes(*length) as usize;
            found.push((*opcode, rest[..length].to_vec(), at));
            all = &rest[length..];
            at += 9 + length as u64;
        }
        found
    }

    fn number(bytes: &[u8], at: usize) -> u64 {
        u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
    }

    /// The first record of some bytes.
    fn first(all: &[u8]) -> (u8, Vec<u8>) {
        let length = number(all, 1) as usize;
        (all[0], all[9..9 + length].to_vec())
    }

    #[test]
    fn indexes_lead_to_each_message_and_checksums_are_true() {
        let mut bytes = vec![];
        let mut file = McapFile::begin(&mut bytes, "test").unwrap();
        let a = file.add_channel("/a", "A", b"{}").unwrap();
        let b = file.add_channel("/b", "B", b"{}").unwrap();
        // More than a chunk.
        let count = 3 * CHUNK_BYTES as u64 / 1000;
        for time in 0..count {
            let channel = if time % 3 == 0 { b } else { a };
            let data = vec![time as u8; 1000];
            file.message(channel, time as u32, time, &data).unwrap();
        }
        file.finish().unwrap();

        assert!(bytes.starts_with(MAGIC) && bytes.ends_with(MAGIC));
        let inside = &bytes[MAGIC.len()..bytes.len() - MAGIC.len()];
        let all = records(inside, MAGIC.len() as u64);
        let of = |opcode: u8| all.iter().filter(move |(it, ..)| *it == opcode);
        let (_, footer, footer_at) = all.last().unwrap();
        let (summary, offsets) = (number(footer, 0), number(footer, 8));
        let checksum = u32::from_le_bytes(footer[16..].try_into().unwrap());
        let checked = &bytes[summary as usize..*footer_at as usize + 9 + 16];
        assert_eq!(checksum, crc32fast::hash(checked));
        assert_eq!(of(opcode::SUMMARY_OFFSET).next().unwrap().2, offsets);
        for (_, offset, _) in of(opcode::SUMMARY_OFFSET) {
            let (begin, length) = (number(offset, 1) as usize, number(offset, 9) as usize);
            let group = records(&bytes[begin..begin + length], begin as u64);
            assert!(group.iter().all(|(opcode, ..)| *opcode == offset[0]));
        }
        let (_, statistics, _) = of(opcode::STATISTICS).next().unwrap();
        assert_eq!(number(statistics, 0), count);

        let mut messages = vec![];
        assert!(of(opcode::CHUNK_INDEX).count() > 2);
        for (_, index, _) in of(opcode::CHUNK_INDEX) {
            let (begin, length) = (number(index, 16) as usize, number(index, 24) as usize);
            let chunk = &records(&bytes[begin..begin + length], 0)[0].1;
            let mut plain = vec![];
            FrameDecoder::new(&chunk[28 + 4 + 3 + 8..]).read_to_end(&mut plain).unwrap();
            assert_eq!(plain.len() as u64, number(chunk, 16));
            let checksum = u32::from_le_bytes(chunk[24..28].try_into().unwrap());
            assert_eq!(checksum, crc32fast::hash(&plain));
            // Where the indexes of the two channels are.
            let places = &index[36..36 + 20];
            for place in places.chunks(10) {
                let at = number(place, 2) as usize;
                let (opcode, content) = first(&bytes[at..]);
                assert_eq!((opcode, &content[..2]), (opcode::MESSAGE_INDEX, &place[..2]));
                for entry in content[6..].chunks(16) {
                    let (time, offset) = (number(entry, 0), number(entry, 8) as usize);
                    let (opcode, message) = first(&plain[offset..]);
                    assert_eq!((opcode, &message[..2]), (opcode::MESSAGE, &place[..2]));
                    assert_eq!((number(&message, 6), message[22]), (time, time as u8));
                    messages.push(time);
                }
            }
        }
        messages.sort_unstable();
        assert!(messages.into_iter().eq(0..count));
    }
}
