//! The words whose bits become bytes.

use crate::{Address, BitGroups, RegionId};

/// The bits of at most this many words of a function become bytes, since a [set of words](WordSet) has 64 bits.
pub(super) const MAX_WORDS: usize = 64;

/// The bits of a word that are used; its highest byte is 0.
pub(super) const WORD_BITS: u32 = 24;

/// A set of words: bit N stands for the word with the number N.
pub(super) type WordSet = u64;

/// A word of which single bits are read and written.
#[derive(Clone, Debug)]
pub(super) struct Word {
    pub(super) at: Address,
    /// Which bits are read or written.
    pub(super) used: u32,
    /// Which bits are written.
    pub(super) written: u32,
    /// What is saved by bytes in one execution of the function, in instructions.
    pub(super) saved: f32,
    /// What is saved in the code, in instructions.
    pub(super) saved_code: u32,
    /// Where its bits begin among the local bits.
    pub(super) slot: u32,
}

impl Word {
    /// The groups of eight bits of which a set of bits has some.
    pub(super) fn groups(&self, bits: u32) -> BitGroups {
        BitGroups::of_mask(self.slot, bits)
    }

    /// The local bit for the bit with a number.
    pub(super) fn local_bit(&self, bit: u32) -> Address {
        Address::fixed(RegionId::LOCAL_BITS, self.slot + bit)
    }
}
