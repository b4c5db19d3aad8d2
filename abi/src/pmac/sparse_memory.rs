//! Sparse memory: the words of a PMAC's address space that have no place in the process image. It
//! also keeps the 24-bit halves of a P- or Q-variable as they were written, where the variable's
//! double alone does not give them back: a mantissa can be written before its exponent.

use alloc::{boxed::Box, collections::BTreeMap, vec, vec::Vec};

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::fixed;

/// Addresses of a page of [`SparseMemory`].
const PAGE: u32 = 256;

/// Words outside the image, in pages that come when something is written there and stay, so that
/// a scan that has been there before allocates nothing, and all of them together are no more than
/// the address space is (128 MiB).
#[derive(Clone, Debug, Default)]
pub struct SparseMemory {
    pages: BTreeMap<u32, Box<[(u32, u32)]>>,
    /// By the offset of a P or Q: the bits of its double, and the words that were written.
    halves: BTreeMap<u32, (u64, (u32, u32))>,
}

/// How it is serialised: for each word outside the image its address, X and Y; for each P or Q with
/// saved halves its offset, the bits of its double, X and Y.
type Saved = (Vec<(u32, u32, u32)>, Vec<(u32, u64, u32, u32)>);

impl SparseMemory {
    /// The X and Y words at an address.
    pub fn get(&self, address: u32) -> (u32, u32) {
        let page = self.pages.get(&(address / PAGE));
        page.and_then(|page| page.get((address % PAGE) as usize)).copied().unwrap_or_default()
    }

    /// Sets the X and Y words at an address.
    pub fn set(&mut self, address: u32, words: (u32, u32)) {
        let number = address / PAGE;
        let page = match self.pages.get_mut(&number) {
            Some(page) => page,
            None if words == (0, 0) => return,
            None => self.pages.entry(number).or_insert_with(|| vec![(0, 0); PAGE as usize].into()),
        };
        if let Some(slot) = page.get_mut((address % PAGE) as usize) {
            *slot = words;
        }
    }

    /// The words of the P or Q at an offset of the image as they were written, as long as its
    /// value is what they made it; none where they follow from the value.
    pub(super) fn halves(&self, offset: u32, value: f64) -> Option<(u32, u32)> {
        let (bits, words) = self.halves.get(&offset)?;
        (*bits == value.to_bits()).then_some(*words)
    }

    /// Notes the words that made a value. One half of a number can be written before the other:
    /// a mantissa without its exponent is not a double, and must still be there when that comes.
    pub(super) fn set_halves(&mut self, offset: u32, value: f64, words: (u32, u32)) {
        if fixed::to_float48(value) == words {
            self.halves.remove(&offset);
        } else {
            self.halves.insert(offset, (value.to_bits(), words));
        }
    }

    /// All that is not 0: address, X and Y, by rising address.
    pub(super) fn words(&self) -> impl Iterator<Item = (u32, u32, u32)> + '_ {
        self.pages.iter().flat_map(|(number, page)| {
            let words = (number * PAGE..).zip(page.iter());
            words.filter(|(_, words)| **words != (0, 0)).map(|(address, &(x, y))| (address, x, y))
        })
    }
}

impl PartialEq for SparseMemory {
    fn eq(&self, other: &Self) -> bool {
        self.words().eq(other.words()) && self.halves == other.halves
    }
}

impl Eq for SparseMemory {}

impl Serialize for SparseMemory {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let halves = self.halves.iter().map(|(offset, (bits, (x, y)))| (*offset, *bits, *x, *y));
        let saved: Saved = (self.words().collect(), halves.collect());
        saved.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for SparseMemory {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (words, halves) = Saved::deserialize(deserializer)?;
        let mut memory = Self::default();
        for (address, x, y) in words {
            memory.set(address & 0xFF_FFFF, (x & 0xFF_FFFF, y & 0xFF_FFFF));
        }
        let halves = halves.into_iter();
        memory.halves = halves
            .map(|(offset, bits, x, y)| (offset, (bits, (x & 0xFF_FFFF, y & 0xFF_FFFF))))
            .collect();
        Ok(memory)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_written_by_halves_are_kept_until_the_value_changes() {
        let mut memory = SparseMemory::default();
        memory.set_halves(8, 0.0, (0x40_0000, 0));
        assert_eq!(memory.halves(8, 0.0), Some((0x40_0000, 0)));
        assert_eq!(memory.halves(8, 1.0), None);
        assert_eq!(memory.halves(16, 0.0), None);
        let saved = postcard::to_allocvec(&memory).unwrap();
        assert_eq!(postcard::from_bytes::<SparseMemory>(&saved).unwrap(), memory);
        assert_ne!(memory, SparseMemory::default());
        memory.set_halves(8, 1.0, (0x40_0000, 0x801));
        assert_eq!(memory, SparseMemory::default());
    }

    #[test]
    fn a_page_exists_only_while_a_word_in_it_is_not_zero() {
        let mut memory = SparseMemory::default();
        memory.set(0x12_3456, (0, 0));
        assert!(memory.pages.is_empty());
        memory.set(0x12_3456, (1, 2));
        assert_eq!((memory.get(0x12_3456), memory.get(0x12_3457)), ((1, 2), (0, 0)));
        memory.set(0x12_3456, (0, 0));
        assert_eq!(memory, SparseMemory::default());
    }
}
