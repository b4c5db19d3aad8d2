//! The header of an artifact: its first 192 bytes. Numbers are little endian.
//!
//! | offset | bytes | holds |
//! | --- | --- | --- |
//! | 0 | 8 | [`MAGIC`] |
//! | 8 | 4 | [`ABI_VERSION`] |
//! | 12 | 4 | length of the debug part, 0 if there is none |
//! | 16 | 8 | length of the whole file |
//! | 24 | 4 | length of the tables |
//! | 28 | 4 | number of labels |
//! | 32 | 4 | number of lines |
//! | 36 | 4 | length of the code |
//! | 40 | 20 | the architecture's name, padded with zeros |
//! | 60 | 4 | length of the sources, 0 if there are none |
//! | 64 | 84 | the features that the processor must have, separated by commas, padded with zeros |
//! | 148 | 32 | the digest: SHA-256 of the whole file, with zeros in place of these 32 bytes and of the CRC-32 |
//! | 180 | 4 | length of the unwind information |
//! | 184 | 4 | bytes of the process image that the code was made for |
//! | 188 | 4 | CRC-32 of the bytes before |
//!
//! The magic bytes, the version, the last checksum and the header's length stay as they are in all
//! later versions, so that every loader can tell a later artifact from a damaged one.

use plcc_abi::ABI_VERSION;
use sha2::{Digest, Sha256};

use super::error::{ArtifactError, inconsistent};

/// The bytes that every artifact begins with. As in PNG, a byte over 127 and the ends of lines are
/// among them: a transfer that treats the file as text changes those, which is then noticed.
pub const MAGIC: [u8; 8] = *b"\x8FPLCX\r\n\x1A";
/// Length of the header in bytes.
pub const LENGTH: usize = 192;

const VERSION: usize = 8;
const DEBUG: usize = 12;
const FILE_LENGTH: usize = 16;
const PARTS: usize = 24;
const ARCHITECTURE: std::ops::Range<usize> = 40..SOURCES;
const SOURCES: usize = 60;
const FEATURES: std::ops::Range<usize> = 64..DIGEST;
const DIGEST: usize = 148;
const EH_FRAME: usize = 180;
const IMAGE_SIZE: usize = 184;
const CRC: usize = 188;

/// The lengths of the parts after the header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// Bytes of the tables.
    pub tables: u32,
    /// Number of labels.
    pub labels: u32,
    /// Number of entries of the line table.
    pub lines: u32,
    /// Bytes of code.
    pub code: u32,
    /// Bytes of unwind information.
    pub eh_frame: u32,
    /// Bytes of the debug part.
    pub debug: u32,
    /// Bytes of the sources.
    pub sources: u32,
}

/// The fields of the header, without the magic bytes, the digest and the checksum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// The version of the format.
    pub version: u32,
    /// Length of the whole file.
    pub length: u64,
    /// The parts' lengths.
    pub parts: Parts,
    /// The architecture's name, as `std::env::consts::ARCH` has it.
    pub architecture: String,
    /// The features that the processor must have, by the names of Rust's feature detection.
    pub features: Vec<String>,
    /// Bytes of the process image that the code was made for.
    pub image_size: u32,
}

/// The digest of an artifact: it names the artifact, since no two have the same.
pub type ArtifactDigest = [u8; 32];

/// The digest of an artifact that consists of the header `head` and of `payload`. The header's own fields
/// for digest and checksum count as zeros.
fn digest(head: &[u8], payload: &[u8]) -> ArtifactDigest {
    let part = |range: std::ops::Range<usize>| head.get(range).unwrap_or_default();
    let mut hasher = Sha256::new();
    hasher.update(part(0..DIGEST));
    hasher.update([0; 32]);
    hasher.update(part(EH_FRAME..CRC));
    hasher.update([0; 4]);
    hasher.update(payload);
    hasher.finalize().into()
}

/// Makes digest, checksum and length of an artifact right again after bytes of it were changed, for
/// tests of the checks after them. Does nothing to fewer bytes than a header has.
pub fn reseal(bytes: &mut [u8]) {
    let length = bytes.len() as u64;
    if let Some((head, payload)) = bytes.split_at_mut_checked(LENGTH) {
        put(head, FILE_LENGTH, &length.to_le_bytes());
        seal(head, payload);
    }
}

/// Puts digest and checksum into a header.
fn seal(head: &mut [u8], payload: &[u8]) {
    let digest = digest(head, payload);
    put(head, DIGEST, &digest);
    let crc = crc32fast::hash(head.get(..CRC).unwrap_or_default());
    put(head, CRC, &crc.to_le_bytes());
}

impl Header {
    /// The header's bytes, with `payload` after it.
    ///
    /// # Errors
    /// When a name is too long.
    pub fn encode(&self, payload: &[u8]) -> Result<[u8; LENGTH], ArtifactError> {
        let mut bytes = [0; LENGTH];
        put(&mut bytes, 0, &MAGIC);
        let Parts { tables, labels, lines, code, eh_frame, debug, sources } = self.parts;
        let words = [
            (VERSION, self.version),
            (DEBUG, debug),
            (SOURCES, sources),
            (EH_FRAME, eh_frame),
            (IMAGE_SIZE, self.image_size),
        ];
        let parts = [tables, labels, lines, code];
        let parts = parts.into_iter().enumerate().map(|(i, part)| (PARTS + 4 * i, part));
        for (at, word) in words.into_iter().chain(parts) {
            put(&mut bytes, at, &word.to_le_bytes());
        }
        put(&mut bytes, FILE_LENGTH, &self.length.to_le_bytes());
        let features = self.features.join(",");
        for (range, text) in [(ARCHITECTURE, &self.architecture), (FEATURES, &features)] {
            if text.len() > range.len() {
                return Err(inconsistent("the target's name is too long"));
            }
            put(&mut bytes, range.start, text.as_bytes());
        }
        seal(&mut bytes, payload);
        Ok(bytes)
    }

    /// Divides a file's bytes into its header and the rest, after checking lengths, checksum and
    /// digest. Gives the digest too.
    ///
    /// # Errors
    /// When it is not an artifact, truncated, corrupt, or of another version.
    pub fn decode(bytes: &[u8]) -> Result<(Self, ArtifactDigest, &[u8]), ArtifactError> {
        if !bytes.starts_with(&MAGIC) {
            return Err(match MAGIC.starts_with(bytes) && !bytes.is_empty() {
                true => truncated(bytes, LENGTH as u64),
                false => ArtifactError::NotAnArtifact,
            });
        }
        let Some((head, payload)) = bytes.split_first_chunk::<LENGTH>() else {
            return Err(truncated(bytes, LENGTH as u64));
        };
        if word(head, CRC) != crc32fast::hash(&head[..CRC]) {
            return Err(ArtifactError::Corrupt { what: "the checksum of its header is wrong" });
        }
        let version = word(head, VERSION);
        if version < ABI_VERSION {
            return Err(ArtifactError::Older { version });
        }
        if version > ABI_VERSION {
            return Err(ArtifactError::Newer { version });
        }
        let long = u64::from(word(head, FILE_LENGTH + 4)) << 32;
        let features = text(&head[FEATURES])?;
        let header = Self {
            version,
            length: long | u64::from(word(head, FILE_LENGTH)),
            parts: Parts {
                tables: word(head, PARTS),
                labels: word(head, PARTS + 4),
                lines: word(head, PARTS + 8),
                code: word(head, PARTS + 12),
                eh_frame: word(head, EH_FRAME),
                debug: word(head, DEBUG),
                sources: word(head, SOURCES),
            },
            architecture: text(&head[ARCHITECTURE])?,
            features: features.split(',').filter(|s| !s.is_empty()).map(str::to_owned).collect(),
            image_size: word(head, IMAGE_SIZE),
        };
        match header.length.cmp(&(bytes.len() as u64)) {
            std::cmp::Ordering::Greater => return Err(truncated(bytes, header.length)),
            std::cmp::Ordering::Less => {
                return Err(ArtifactError::Corrupt { what: "something follows its end" });
            }
            std::cmp::Ordering::Equal => {}
        }
        let digest = digest(head, payload);
        if head[DIGEST..EH_FRAME] != digest {
            return Err(ArtifactError::Corrupt { what: "its digest is wrong" });
        }
        Ok((header, digest, payload))
    }

    /// Whether this machine can run the code.
    ///
    /// # Errors
    /// When it is for another architecture, or the processor lacks a feature.
    pub fn check_machine(&self) -> Result<(), ArtifactError> {
        let machine = std::env::consts::ARCH;
        if self.architecture != machine {
            let artifact = self.architecture.clone();
            return Err(ArtifactError::Architecture { artifact, machine });
        }
        let missing = plcc_runtime::cpu::missing(&self.features);
        if missing.is_empty() { Ok(()) } else { Err(ArtifactError::Features { missing }) }
    }
}

fn truncated(bytes: &[u8], expected: u64) -> ArtifactError {
    ArtifactError::Truncated { found: bytes.len() as u64, expected }
}

/// Writes bytes at an offset; what is beyond the end is left out.
fn put(bytes: &mut [u8], at: usize, new: &[u8]) {
    for (byte, new) in bytes.iter_mut().skip(at).zip(new) {
        *byte = *new;
    }
}

fn word(head: &[u8; LENGTH], at: usize) -> u32 {
    plcc_abi::image::read_u32(head, at as u32)
}

/// A text padded with zeros.
fn text(bytes: &[u8]) -> Result<String, ArtifactError> {
    let end = bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    let bytes = bytes.get(..end).unwrap_or_default();
    match bytes.is_ascii() {
        true => Ok(bytes.iter().map(|&byte| char::from(byte)).collect()),
        false => Err(inconsistent("the name of its target is not ASCII")),
    }
}
