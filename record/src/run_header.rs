//! What a record says of a run before its first tick: the run itself, and its program.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use plcc_runtime::checkpoint;

/// The version of the format of records, in thousands, and that of the checkpoints in them.
pub(super) const VERSION: u32 = 1000 + checkpoint::VERSION;

/// A run, as a record describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunHeader {
    /// The version of the record's format.
    pub(super) version: u32,
    /// A number that tells this run from others in the same file.
    pub run: u64,
    /// When it began, in milliseconds since 1970.
    pub began_ms: u64,
    /// The version of plcc that recorded it.
    pub recorded_by: String,
    /// The time from one tick to the next in nanoseconds, as the run began.
    pub tick_ns: u64,
    /// Whether the clock takes part in what a tick does: the run was in real time, or watched by a
    /// watchdog. A replay then follows the recorded decisions.
    pub clocked: bool,
    /// The options of the run, serialised by the session, which alone reads them again
    /// (`session::replay::RunSettings`).
    #[serde(with = "plcc_runtime::checkpoint::bytes")]
    pub settings: Vec<u8>,
}

impl RunHeader {
    /// A run that begins now: `began` is the time since 1970, `tick_ns` the time from one tick to the next
    /// in nanoseconds. `clocked` says whether the clock takes part in what a tick does. `settings` are the
    /// options of the run as bytes; this module only keeps them.
    pub fn new(began: Duration, tick_ns: u64, clocked: bool, settings: Vec<u8>) -> Self {
        Self {
            version: VERSION,
            run: began.as_nanos() as u64,
            began_ms: began.as_millis() as u64,
            recorded_by: env!("CARGO_PKG_VERSION").into(),
            tick_ns,
            clocked,
            settings,
        }
    }
}

/// A program in a record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum RecordedProgram {
    /// An artifact, the bytes of its file.
    Artifact(#[serde(with = "plcc_runtime::checkpoint::bytes")] Vec<u8>),
    /// Sources.
    Sources(RecordedSources),
    /// The program is not in the record: the recorder was not given it, or the ticks that it ran are no longer kept.
    Unknown,
}

/// The sources of a program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedSources {
    /// The language's name.
    pub dialect: String,
    /// The files: first those that were named, then those that they include.
    pub files: Vec<RecordedFile>,
    /// How many of the files were named; the others are included.
    pub named: usize,
    /// The options of the compiler, serialised by `plcc`, which alone reads them again.
    #[serde(with = "plcc_runtime::checkpoint::bytes")]
    pub options: Vec<u8>,
}

/// How long the sources of an artifact may be when they are decompressed, in bytes.
const MAX_SOURCES: usize = 256 << 20;

impl RecordedSources {
    /// These sources as an artifact holds them: compressed.
    pub fn to_bytes(&self) -> Vec<u8> {
        // Text and numbers are always written.
        let plain = postcard::to_allocvec(self).unwrap_or_default();
        lz4_flex::block::compress_prepend_size(&plain)
    }

    /// The sources that an artifact holds; `None` if it has none, or none that this version can read.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (length, compressed) = bytes.split_first_chunk::<4>()?;
        let length = u32::from_le_bytes(*length) as usize;
        // A byte of LZ4 gives at most 255, so a length that is not true takes no more memory than the file warrants.
        if length > MAX_SOURCES || length / 255 > compressed.len() {
            return None;
        }
        postcard::from_bytes(&lz4_flex::block::decompress(compressed, length).ok()?).ok()
    }
}

/// A source file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedFile {
    /// Its path as it was given.
    pub path: String,
    /// Its text in UTF-8, whatever the file's encoding was.
    pub text: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_of_an_artifact_read_back_and_bad_ones_are_none() {
        let file = RecordedFile { path: "a.pmi".into(), text: "N=N+1\n".repeat(100) };
        let sources = RecordedSources {
            dialect: "pmi".into(),
            files: vec![file],
            named: 1,
            options: vec![1, 2, 3],
        };
        let bytes = sources.to_bytes();
        assert!(bytes.len() < 200, "{}", bytes.len());
        assert_eq!(RecordedSources::from_bytes(&bytes).as_ref(), Some(&sources));
        for end in 0..bytes.len() {
            assert_eq!(RecordedSources::from_bytes(&bytes[..end]), None, "{end}");
        }
        // A length that is not true.
        assert_eq!(RecordedSources::from_bytes(&[0xFF, 0xFF, 0xFF, 0x7F, 0]), None);
    }
}
