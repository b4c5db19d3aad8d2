//! Unwind information: how a debugger or profiler gets from a place in compiled code to its caller.
//!
//! It is an `.eh_frame` section as compilers of C write it: a common entry (CIE) and for each
//! function a description (FDE) with its address relative to the place of that address. The section
//! is laid out to be right after the code, at the next multiple of [`ALIGNMENT`], so that code
//! and section can be copied to any address together and need no change.

use alloc::vec::Vec;

use crate::image::{read_i32, read_u32};

/// The section's alignment in bytes, and that of every entry in it.
pub const ALIGNMENT: usize = 8;

/// Offsets within an entry, each of four bytes: the length of what follows it, the distance back to
/// the CIE (0 in a CIE itself), and in an FDE the function's address and length.
const CIE_DISTANCE: usize = 4;
const ADDRESS: usize = 8;
const LENGTH: usize = 12;
const FDE_BYTES: usize = 16;

/// The description of one function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnwindEntry {
    /// Offset in the section of the four bytes that hold the function's address.
    pub address_at: u32,
    /// Offset in the code of the function's first byte.
    pub start: u32,
    /// The function's length in bytes.
    pub len: u32,
}

/// The entries of a section that is after `code_len` bytes of code; `None` when it is no
/// section in the form that the compiler writes.
pub fn entries(section: &[u8], code_len: usize) -> Option<Vec<UnwindEntry>> {
    let base = code_len.checked_next_multiple_of(ALIGNMENT)?;
    u32::try_from(base.checked_add(section.len())?).ok()?;
    let word = |at: usize| read_u32(section, at as u32);
    let mut cies = Vec::new();
    let mut found = Vec::new();
    let mut at = 0;
    while at < section.len() {
        let rest = section.len() - at;
        let size = (word(at) as usize).checked_add(4)?;
        if size > rest || size < CIE_DISTANCE + 4 || !size.is_multiple_of(ALIGNMENT / 2) {
            return None;
        }
        match word(at + CIE_DISTANCE) as usize {
            0 => cies.push(at),
            distance => {
                let cie = (at + CIE_DISTANCE).checked_sub(distance)?;
                if size < FDE_BYTES || cies.binary_search(&cie).is_err() {
                    return None;
                }
                let address_at = (at + ADDRESS) as u32;
                let distance = i64::from(read_i32(section, address_at));
                let start = base as i64 + i64::from(address_at) + distance;
                let start = u32::try_from(start).ok()?;
                found.push(UnwindEntry { address_at, start, len: word(at + LENGTH) });
            }
        }
        at += size;
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;

    /// A CIE of 12 bytes and an FDE of 16 for a function at 32 of 40 bytes of code.
    fn section() -> Vec<u8> {
        let distance = 32 - (40 + 20);
        [8, 0, 0, 12, 16, distance as u32, 6].into_iter().flat_map(u32::to_le_bytes).collect()
    }

    #[test]
    fn each_entry_gives_the_place_of_its_function() {
        let entry = UnwindEntry { address_at: 20, start: 32, len: 6 };
        assert_eq!(entries(&section(), 40), Some(vec![entry]));
        assert_eq!(entries(&section(), 33), Some(vec![entry]), "the code is padded");
        assert_eq!(entries(&[], 40), Some(vec![]));
    }

    #[test]
    fn damaged_unwind_sections_are_refused() {
        assert_eq!(entries(&section()[..27], 40), None, "cut short");
        assert_eq!(entries(&section()[..3], 40), None, "cut short");
        assert_eq!(entries(&section(), usize::MAX), None);
        for (at, value) in [(0, 0), (0, 7), (0, 255), (12, 8), (12, 14), (16, 12), (16, 200)] {
            let mut changed = section();
            changed[at] = value;
            assert_eq!(entries(&changed, 40), None, "{value} at {at}");
        }
        let mut before = section();
        before[20..24].copy_from_slice(&(-61_i32).to_le_bytes());
        assert_eq!(entries(&before, 40), None, "before the code");
    }
}
