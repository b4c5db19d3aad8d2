//! The bytes of a retained file and of its copy.
//!
//! | offset | bytes | holds |
//! | --- | --- | --- |
//! | 0 | 8 | `PLCCRET2` |
//! | 8 | 4 | a checksum (CRC-32) of all that follows it, little endian like all numbers |
//! | 12 | 8 | the generation: 1 for the first state that was written, then one more each time |
//! | 20 | 8 | the number of bytes that follow |
//! | 28 | | the dialect and the executive's payload, by postcard |
//!
//! Files that begin with `PLCCRET1` come from earlier versions of plcc: the checksum is followed by
//! dialect and payload at once. They are read as generation 0.

use plcc_abi::Dialect;
use serde::{Deserialize, Serialize};

/// The first bytes of every file that is written now.
const MAGIC: [u8; 8] = *b"PLCCRET2";
/// The first bytes of the files of earlier versions.
const OLD_MAGIC: [u8; 8] = *b"PLCCRET1";
/// What the magic bytes of all versions begin with.
const MAGIC_OF_ANY_VERSION: &[u8] = b"PLCCRET";

/// What stands after the header, to be read.
#[derive(Deserialize)]
struct Content {
    dialect: Dialect,
    payload: Vec<u8>,
}

/// What stands after the header, to be written.
#[derive(Serialize)]
struct ContentToWrite<'a> {
    dialect: Dialect,
    payload: &'a [u8],
}

/// A state of the retained data, as one of the two copies holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SavedState {
    /// Of two states the one with the larger number is the later one.
    pub generation: u64,
    /// The language whose control saved it.
    pub dialect: Dialect,
    /// What the executive gave.
    pub payload: Vec<u8>,
}

/// The bytes of a retained file.
pub fn encode(generation: u64, dialect: Dialect, payload: &[u8]) -> Vec<u8> {
    // Writing to memory does not fail; a file without content is refused when it is read.
    let content = postcard::to_allocvec(&ContentToWrite { dialect, payload }).unwrap_or_default();
    let mut summed = Vec::with_capacity(16 + content.len());
    summed.extend(generation.to_le_bytes());
    summed.extend((content.len() as u64).to_le_bytes());
    summed.extend(content);
    let mut bytes = Vec::with_capacity(MAGIC.len() + 4 + summed.len());
    bytes.extend(MAGIC);
    bytes.extend(crc32fast::hash(&summed).to_le_bytes());
    bytes.extend(summed);
    bytes
}

/// The state that a file's bytes hold.
///
/// # Errors
/// What is wrong with the bytes, as the end of a sentence about the file.
pub fn decode(bytes: &[u8]) -> Result<SavedState, String> {
    let short = "it is cut short";
    let (magic, rest) = bytes.split_at_checked(MAGIC.len()).ok_or(short)?;
    if !magic.starts_with(MAGIC_OF_ANY_VERSION) {
        return Err("it is not a retained file".into());
    }
    if magic != MAGIC && magic != OLD_MAGIC {
        return Err("another version of plcc has written it".into());
    }
    let (sum, summed) = rest.split_first_chunk().ok_or(short)?;
    if u32::from_le_bytes(*sum) != crc32fast::hash(summed) {
        return Err("its checksum is wrong".into());
    }
    let (generation, content) = if magic == OLD_MAGIC {
        (0, summed)
    } else {
        let (generation, rest) = summed.split_first_chunk().ok_or(short)?;
        let (length, content) = rest.split_first_chunk().ok_or(short)?;
        if u64::from_le_bytes(*length) != content.len() as u64 {
            return Err("its length is wrong".into());
        }
        (u64::from_le_bytes(*generation), content)
    };
    match postcard::take_from_bytes::<Content>(content) {
        Ok((Content { dialect, payload }, [])) => Ok(SavedState { generation, dialect, payload }),
        _ => Err("another version of plcc has written it".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_that_was_written_reads_back() {
        let bytes = encode(7, Dialect::Nct, &[1, 2, 3]);
        let state = SavedState { generation: 7, dialect: Dialect::Nct, payload: vec![1, 2, 3] };
        assert_eq!(decode(&bytes), Ok(state));
    }

    #[test]
    fn files_of_earlier_versions_are_read() {
        // `PLCCRET1`, the checksum, the dialect NCT, then four bytes of payload.
        let content = [1, 4, 9, 8, 7, 6];
        let mut bytes = OLD_MAGIC.to_vec();
        bytes.extend(crc32fast::hash(&content).to_le_bytes());
        bytes.extend(content);
        let state = SavedState { generation: 0, dialect: Dialect::Nct, payload: vec![9, 8, 7, 6] };
        assert_eq!(decode(&bytes), Ok(state));
    }

    #[test]
    fn damaged_bytes_are_refused() {
        let bytes = encode(7, Dialect::Pmac, &[9; 40]);
        for at in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[at] ^= 0x10;
            assert!(decode(&flipped).is_err(), "byte {at}");
            assert!(decode(&bytes[..at]).is_err(), "cut at {at}");
        }
        assert!(decode(&[bytes, vec![0]].concat()).is_err(), "a byte too many");
    }
}
