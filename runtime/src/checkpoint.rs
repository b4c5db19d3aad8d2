//! Checkpoints: the whole state of a control between two ticks, as bytes.
//!
//! An executive consists of the program's tables, the options of the run, the process image, and a
//! `State`, which holds what is not in the image; everything else in it can be derived from those. A
//! checkpoint holds image and state. A new executive of the same program, with the same options,
//! continues from it as if it had run all the time, in whichever engine.
//!
//! | offset | bytes | holds |
//! | --- | --- | --- |
//! | 0 | 8 | `PLCCSTAT` |
//! | 8 | 4 | the version of this form, little endian like all numbers |
//! | 12 | 4 | a checksum (CRC-32) of all that follows it |
//! | 16 | 8 | the fingerprint of the program |
//! | 24 | | image and state, by postcard |
//!
//! The checksum protects against accidents, not against people: bytes with a right checksum may hold
//! any values, but no worse ones than the program itself could have stored.

use std::hash::Hasher;
use std::ops::Range;

use plcc_abi::pmac::Run;
use plcc_abi::{Program, Region, ResumePoint};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use thiserror::Error;

use plcc_abi::Fnv;

const MAGIC: [u8; 8] = *b"PLCCSTAT";
/// The version of the form and of every dialect's state.
pub const VERSION: u32 = 4;

/// Why bytes are not a checkpoint that an executive can take. The executive is unchanged.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum CheckpointError {
    /// The bytes do not begin as those of a checkpoint.
    #[error("this is not a checkpoint")]
    NoCheckpoint,
    /// Another version of plcc has written it.
    #[error(
        "the checkpoint was written by another plcc: it has version {0}, this plcc takes version {VERSION}"
    )]
    Version(u32),
    /// Bytes are missing or changed, or do not fit together.
    #[error("the checkpoint is damaged, or another build of plcc has written it")]
    Damaged,
    /// It was taken from another program.
    #[error("the checkpoint belongs to another program")]
    OtherProgram,
}

/// Serialises bytes as one piece, in the form that postcard gives a list of them, but without handling
/// each alone. For use with `#[serde(with = "…")]`.
pub mod bytes {
    use std::fmt;

    use serde::de::{Error, Visitor};
    use serde::{Deserializer, Serializer};

    /// Writes bytes as bytes.
    ///
    /// # Errors
    /// Those of the serializer.
    pub fn serialize<S: Serializer>(bytes: &[u8], to: S) -> Result<S::Ok, S::Error> {
        to.serialize_bytes(bytes)
    }

    /// Reads them again.
    ///
    /// # Errors
    /// Those of the deserializer.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<u8>, D::Error> {
        struct Bytes;

        impl Visitor<'_> for Bytes {
            type Value = Vec<u8>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("bytes")
            }

            fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Vec<u8>, E> {
                Ok(bytes.to_vec())
            }
        }

        from.deserialize_bytes(Bytes)
    }
}

/// Appends a state in the form of a checkpoint. It allocates nothing but more room for `out`.
pub(crate) fn write_state<S: Serialize>(state: &S, out: &mut Vec<u8>) {
    let length = out.len();
    match postcard::to_extend(state, std::mem::take(out)) {
        Ok(bytes) => *out = bytes,
        // Writing to memory does not fail; a checkpoint without a state is refused as damaged.
        Err(_) => out.truncate(length),
    }
}

/// A checkpoint of a program with this fingerprint, of its image and of what
/// [`state_into`](crate::Executive::state_into) gave.
pub fn seal(fingerprint: u64, image: &[u8], state: &[u8]) -> Vec<u8> {
    let mut sealed = fingerprint.to_le_bytes().to_vec();
    // Writing to memory does not fail; a checkpoint without a payload is refused as damaged.
    sealed.extend(postcard::to_allocvec(&Run::pack(image)).unwrap_or_default());
    sealed.extend(state);
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(crc32fast::hash(&sealed).to_le_bytes());
    bytes.extend(sealed);
    bytes
}

/// Takes a checkpoint apart whose state has another one behind it, and the length of that at its end: gives the checkpoint
/// without it, and it.
///
/// # Errors
/// When the bytes are not a checkpoint, or are damaged.
pub(crate) fn split(checkpoint: &[u8]) -> Result<(Vec<u8>, &[u8]), CheckpointError> {
    const HEADER: usize = MAGIC.len() + 8;
    let header = checkpoint.get(..HEADER).ok_or(CheckpointError::NoCheckpoint)?;
    if !header.starts_with(&MAGIC) {
        return Err(CheckpointError::NoCheckpoint);
    }
    let number = |at: usize| {
        let bytes = header.get(at..).and_then(|bytes| bytes.first_chunk());
        bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
    };
    let (version, sum) = (number(MAGIC.len()), number(MAGIC.len() + 4));
    if version != VERSION {
        return Err(CheckpointError::Version(version));
    }
    let sealed = checkpoint.get(HEADER..).unwrap_or_default();
    if crc32fast::hash(sealed) != sum {
        return Err(CheckpointError::Damaged);
    }
    let (rest, length) = sealed.split_last_chunk::<4>().ok_or(CheckpointError::Damaged)?;
    let length = u32::from_le_bytes(*length) as usize;
    let at = rest.len().checked_sub(length).ok_or(CheckpointError::Damaged)?;
    let (inner, own) = rest.split_at(at);
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(crc32fast::hash(inner).to_le_bytes());
    bytes.extend(inner);
    Ok((bytes, own))
}

/// The parts of a range that are outside some others, which are sorted and do not overlap.
pub(crate) fn without(whole: Range<u32>, holes: &[Range<u32>]) -> Vec<Range<u32>> {
    let mut rest = vec![];
    let mut from = whole.start;
    for hole in holes {
        rest.push(from..hole.start.clamp(from, whole.end));
        from = hole.end.clamp(from, whole.end);
    }
    rest.push(from..whole.end);
    rest.retain(|range| !range.is_empty());
    rest
}

/// What was written after the header.
#[derive(Deserialize)]
struct Payload<S> {
    /// The image, without its zeros.
    image: Vec<Run>,
    state: S,
}

/// What a checkpoint is compared with: the program that it must belong to.
#[derive(Clone, Debug, Default)]
pub(crate) struct ProgramIdentity {
    fingerprint: u64,
    /// The range of the image that each region with a name has.
    regions: Vec<(String, Range<u32>)>,
    /// The ranges of the image (start, end) in which every byte is 0 or 1.
    bits: Vec<(usize, usize)>,
    /// How many resume points each task has.
    resume_points: Vec<usize>,
}

impl ProgramIdentity {
    /// The identity of a program. Labels are not part of it, since they depend on how its code was cut
    /// into chunks.
    pub(crate) fn new(program: &Program) -> Self {
        let tasks: Vec<(&str, usize)> =
            program.tasks.iter().map(|task| (&*task.name, task.resume_points.len())).collect();
        let identity = (program.image_size, &program.regions, &tasks, &program.tables);
        let mut hasher = Fnv::default();
        // Writing to memory does not fail.
        hasher.write(&postcard::to_allocvec(&identity).unwrap_or_default());
        let bits = program.regions.iter().filter(|region| region.bits);
        let range = |region: &Region| region.offset..region.offset.saturating_add(region.size);
        let named = program.regions.iter().map(|region| (region.name.clone(), range(region)));
        Self {
            fingerprint: hasher.finish(),
            regions: named.collect(),
            bits: bits
                .map(|region| {
                    (region.offset as usize, region.offset as usize + region.size as usize)
                })
                .collect(),
            resume_points: tasks.iter().map(|(_, count)| *count).collect(),
        }
    }

    /// A number that tells the program from others.
    pub(crate) fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// An image of `size` bytes without the regions of these names and without `further`.
    pub(crate) fn image_without(
        &self,
        size: usize,
        names: &[&str],
        further: &[Range<u32>],
    ) -> Vec<Range<u32>> {
        let regions = self.regions.iter().filter(|(name, _)| names.contains(&name.as_str()));
        let mut holes: Vec<Range<u32>> = regions.map(|(_, range)| range.clone()).collect();
        holes.extend_from_slice(further);
        holes.sort_by_key(|range| range.start);
        without(0..u32::try_from(size).unwrap_or(u32::MAX), &holes)
    }

    /// Whether a task can go on at `from`: `None` is its beginning, else it must have that resume point.
    pub(crate) fn can_resume(&self, task: usize, from: Option<ResumePoint>) -> bool {
        let count = self.resume_points.get(task).copied().unwrap_or(0);
        from.is_none_or(|point| (point.0 as usize) < count)
    }

    /// A checkpoint of an image and a state.
    pub(crate) fn write<S: Serialize>(&self, image: &[u8], state: &S) -> Vec<u8> {
        let mut bytes = vec![];
        write_state(state, &mut bytes);
        seal(self.fingerprint, image, &bytes)
    }

    /// The image and the state of a checkpoint of this program; the image must have `size` bytes.
    ///
    /// # Errors
    /// When the bytes are not a checkpoint, are damaged, or belong to another program or version.
    pub(crate) fn read<S: DeserializeOwned>(
        &self,
        size: usize,
        bytes: &[u8],
    ) -> Result<(Vec<u8>, S), CheckpointError> {
        let rest = bytes.strip_prefix(&MAGIC).ok_or(CheckpointError::NoCheckpoint)?;
        let damaged = CheckpointError::Damaged;
        let (version, rest) = rest.split_first_chunk::<4>().ok_or(damaged.clone())?;
        let version = u32::from_le_bytes(*version);
        if version != VERSION {
            return Err(CheckpointError::Version(version));
        }
        let (checksum, summed) = rest.split_first_chunk::<4>().ok_or(damaged.clone())?;
        if crc32fast::hash(summed) != u32::from_le_bytes(*checksum) {
            return Err(damaged);
        }
        let (fingerprint, payload) = summed.split_first_chunk::<8>().ok_or(damaged.clone())?;
        if u64::from_le_bytes(*fingerprint) != self.fingerprint {
            return Err(CheckpointError::OtherProgram);
        }
        let (payload, rest): (Payload<S>, &[u8]) =
            postcard::take_from_bytes(payload).map_err(|_| damaged.clone())?;
        let inside = |run: &Run| run.offset as usize + run.bytes.len() <= size;
        if !rest.is_empty() || !payload.image.iter().all(inside) {
            return Err(damaged);
        }
        let mut image = vec![0; size];
        Run::unpack(&payload.image, &mut image);
        let holds_bits = |&(start, end): &(usize, usize)| {
            image.get(start..end).is_none_or(|bytes| bytes.iter().all(|&byte| byte <= 1))
        };
        if self.bits.iter().all(holds_bits) { Ok((image, payload.state)) } else { Err(damaged) }
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::pmi::PmiTables;
    use plcc_abi::{Region, Tables, Task};

    use super::*;

    fn program(name: &str) -> Program {
        Program {
            files: vec![],
            image_size: 16,
            regions: vec![Region { name: name.into(), offset: 8, size: 8, bits: true }],
            tasks: vec![Task { name: "scan".into(), entry: 3, resume_points: vec![1, 2] }],
            tables: Tables::Pmi(PmiTables::default()),
            names: vec![],
        }
    }

    #[test]
    fn a_checkpoint_that_was_written_reads_back() {
        let identity = ProgramIdentity::new(&program("bits"));
        let image: Vec<u8> = (0..16).map(|n| if n < 8 { n * 3 } else { n & 1 }).collect();
        let bytes = identity.write(&image, &(7_u32, "state".to_owned()));
        assert_eq!(identity.read(16, &bytes), Ok((image, (7_u32, "state".to_owned()))));
        // Labels depend on how code is cut, and do not matter.
        let mut other = program("bits");
        (other.tasks[0].entry, other.tasks[0].resume_points) = (9, vec![5, 4]);
        assert!(ProgramIdentity::new(&other).read::<(u32, String)>(16, &bytes).is_ok());
        assert!(identity.can_resume(0, Some(ResumePoint(1))) && identity.can_resume(0, None));
        assert!(!identity.can_resume(0, Some(ResumePoint(2))));
    }

    #[test]
    fn damaged_and_other_programs_checkpoints_are_refused() {
        let identity = ProgramIdentity::new(&program("bits"));
        let read = |bytes: &[u8]| identity.read::<u32>(16, bytes).map(|_| ());
        let bytes = identity.write(&[1; 16], &5_u32);
        assert_eq!(read(&bytes), Ok(()));
        for at in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[at] ^= 0x10;
            assert!(read(&flipped).is_err(), "byte {at}");
            assert!(read(&bytes[..at]).is_err(), "{at} bytes");
        }
        assert!(read(&[bytes.clone(), vec![0]].concat()).is_err());
        assert_eq!(read(b"tick,name,value"), Err(CheckpointError::NoCheckpoint));
        let other = ProgramIdentity::new(&program("other")).write(&[1; 16], &5_u32);
        assert_eq!(read(&other), Err(CheckpointError::OtherProgram));
        let long = identity.write(&[1; 17], &5_u32);
        assert_eq!(read(&long), Err(CheckpointError::Damaged), "an image that is too long");
        let no_bit = identity.write(&[2; 16], &5_u32);
        assert_eq!(read(&no_bit), Err(CheckpointError::Damaged), "2 is not a bit");
    }
}
