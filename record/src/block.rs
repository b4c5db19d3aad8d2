//! The blocks of a record's file. A block can be read without the ones before it, so that of a damaged or
//! cut file only those blocks are lost that are damaged or cut themselves.
//!
//! | offset | bytes | holds |
//! | --- | --- | --- |
//! | 0 | 3 | the marker `89 52 42` (hexadecimal), by which a block is found after damaged bytes |
//! | 3 | 1 | the [`Kind`] |
//! | 4 | 4 | how many bytes are stored after this header, little endian like all numbers |
//! | 8 | 4 | how many bytes they are when decompressed (LZ4); the same number where they are not compressed |
//! | 12 | 8 | the number of the tick with which the block begins |
//! | 20 | 4 | a checksum (CRC-32) of the bytes from 3 to 19 and of all that are stored |
//!
//! Why not MCAP: a record has 50 to 2000 ticks a second, most of which take two bytes. MCAP's message
//! headers alone take 31, and its readers could do nothing with our bytes.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// The bytes with which every block begins.
const MARKER: [u8; 3] = [0x89, 0x52, 0x42];
/// The length of a block's header.
pub(super) const HEADER: usize = 24;
/// The longest content of a block, in bytes: a checkpoint of the largest image.
const MAX_CONTENT: u32 = 768 << 20;
/// One byte that LZ4 has compressed becomes at most so many when it is decompressed.
const MAX_RATIO: u64 = 256;
/// The longest content of a block of ticks, in bytes. One is written as soon as it has 256 KiB, so that only
/// the last tick of it may be long.
const MAX_TICKS_CONTENT: u32 = 64 << 20;
/// How many bytes of blocks with wrong checksums may be read before the search for further blocks is given
/// up. For a file of more than a quarter of this, the limit is four times its length.
const MAX_WASTED: u64 = 256 << 20;
/// How much of a file is searched for a marker at a time.
const WINDOW: usize = 1 << 16;

/// What a block holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The beginning of a run, or of a part of a run: [`RunHeader`](super::RunHeader).
    Start,
    /// The program: its generation and a [`RecordedProgram`](super::RecordedProgram).
    Program,
    /// A checkpoint.
    Checkpoint,
    /// Ticks.
    Ticks,
    /// The number of ticks that were lost before the next checkpoint.
    Gap,
    /// The end of a run: the whole hash, and what acted on the control after the last tick.
    End,
}

impl Kind {
    const ALL: [Self; 6] =
        [Self::Start, Self::Program, Self::Checkpoint, Self::Ticks, Self::Gap, Self::End];

    /// The longest content of such a block, in bytes.
    fn max_content(self) -> u32 {
        if self == Self::Ticks { MAX_TICKS_CONTENT } else { MAX_CONTENT }
    }

    fn number(self) -> u8 {
        match self {
            Self::Start => 1,
            Self::Program => 2,
            Self::Checkpoint => 3,
            Self::Ticks => 4,
            Self::Gap => 5,
            Self::End => 6,
        }
    }
}

/// Appends a block to `out`.
pub(super) fn write(kind: Kind, tick: u64, content: &[u8], out: &mut Vec<u8>) {
    let compressed = lz4_flex::block::compress(content);
    let stored = if compressed.len() < content.len() { &compressed } else { content };
    let mut head = vec![kind.number()];
    // Contents are far shorter than 4 GiB.
    head.extend((stored.len() as u32).to_le_bytes());
    head.extend((content.len() as u32).to_le_bytes());
    head.extend(tick.to_le_bytes());
    let checksum = checksum(&head, stored);
    out.extend(MARKER);
    out.extend(head);
    out.extend(checksum.to_le_bytes());
    out.extend_from_slice(stored);
}

fn checksum(head: &[u8], stored: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(head);
    hasher.update(stored);
    hasher.finalize()
}

/// A block that was found in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Block {
    pub(super) kind: Kind,
    /// The tick with which it begins.
    pub(super) tick: u64,
    /// Where its stored bytes are in the file.
    at: u64,
    stored: u32,
    content: u32,
}

impl Block {
    /// Where the next block begins.
    pub(super) fn end(&self) -> u64 {
        self.at.saturating_add(self.stored.into())
    }

    /// Reads what it holds, decompressed.
    ///
    /// # Errors
    /// When the file can't be read or was changed meanwhile.
    pub(super) fn read(&self, file: &File) -> io::Result<Vec<u8>> {
        let mut stored = vec![0; self.stored as usize];
        read_at(file, &mut stored, self.at)?;
        if self.stored == self.content {
            return Ok(stored);
        }
        let content = lz4_flex::block::decompress(&stored, self.content as usize);
        content.map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
    }
}

/// Fills a buffer from an offset of a file on.
fn read_at(mut file: &File, buffer: &mut [u8], at: u64) -> io::Result<()> {
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(buffer)
}

/// The block at an offset of a file of `length` bytes; `None` where none is, or not all of it. To `wasted`
/// are added the bytes that were read of one whose checksum is wrong.
///
/// # Errors
/// When the file can't be read.
fn block_at(file: &File, at: u64, length: u64, wasted: &mut u64) -> io::Result<Option<Block>> {
    if length.saturating_sub(at) < HEADER as u64 {
        return Ok(None);
    }
    let mut header = [0; HEADER];
    read_at(file, &mut header, at)?;
    let Some((kind, rest)) = header.strip_prefix(&MARKER).and_then(<[u8]>::split_first) else {
        return Ok(None);
    };
    let Some(kind) = Kind::ALL.into_iter().find(|known| known.number() == *kind) else {
        return Ok(None);
    };
    let number = |from: usize| {
        let bytes = rest.get(from..).and_then(|rest| rest.first_chunk::<4>());
        u32::from_le_bytes(bytes.copied().unwrap_or_default())
    };
    let (stored, content) = (number(0), number(4));
    let tick = u64::from(number(8)) | u64::from(number(12)) << 32;
    let begins = at + HEADER as u64;
    let possible = content <= kind.max_content()
        && stored <= content
        && u64::from(content) <= u64::from(stored) * MAX_RATIO + 64
        && u64::from(stored) <= length.saturating_sub(begins);
    if !possible {
        return Ok(None);
    }
    let mut bytes = vec![0; stored as usize];
    read_at(file, &mut bytes, begins)?;
    let head = header.get(MARKER.len()..HEADER - 4).unwrap_or_default();
    let right = checksum(head, &bytes) == number(16);
    if !right {
        *wasted = wasted.saturating_add(stored.into());
    }
    Ok(right.then_some(Block { kind, tick, at: begins, stored, content }))
}

/// The next block from an offset on, and how many bytes lie before it that belong to no block; `None` if no
/// whole block follows. `wasted` counts the bytes that all searches in this file have read of blocks with wrong
/// checksums. The search ends when they are too many: in a file that is made of nothing but headers, each
/// byte would otherwise be read once for every header before it.
///
/// # Errors
/// When the file can't be read.
pub(super) fn find(
    file: &File,
    from: u64,
    length: u64,
    wasted: &mut u64,
) -> io::Result<Option<(Block, u64)>> {
    let mut at = from;
    loop {
        if let Some(block) = block_at(file, at, length, wasted)? {
            return Ok(Some((block, at - from)));
        }
        if *wasted > MAX_WASTED.max(length.saturating_mul(4)) {
            return Ok(None);
        }
        let Some(next) = marker_behind(file, at, length)? else { return Ok(None) };
        at = next;
    }
}

/// The offset of the next marker after an offset.
fn marker_behind(file: &File, at: u64, length: u64) -> io::Result<Option<u64>> {
    let mut window = vec![0; WINDOW];
    let mut from = at + 1;
    while from < length {
        let size = usize::try_from(length - from).unwrap_or(WINDOW).min(WINDOW);
        let bytes = window.get_mut(..size).unwrap_or_default();
        read_at(file, bytes, from)?;
        if let Some(found) = bytes.windows(MARKER.len()).position(|bytes| bytes == MARKER) {
            return Ok(Some(from + found as u64));
        }
        if size < WINDOW {
            return Ok(None);
        }
        // A marker may begin at the end of this window.
        from += (size - MARKER.len() + 1) as u64;
    }
    Ok(None)
}
