//! Keeps single bits of words as bytes while a function is executed.
//!
//! A PMAC keeps bits in words of 24 bits. To read one takes a load, a shift and a mask, where a truth value that
//! is a byte is an operand of the instruction that uses it; to write one takes five instructions where a byte
//! takes one.
//!
//! ```text
//! block0 (L0):                            block0 (L0):
//!     v0: i32 = load words:0                  v0: i32 = load words:0
//!     v1: i32 = lshr v0, 5                    v1: i64 = zext v0
//!     v2: i32 = and v1, 1                     v2: i64 = spread_bits v1
//!     …                                       store local_bits:0, v2
//!                                  ==>        v3: i1 = load local_bits:5
//!     v7: i32 = load words:0                  v4: i32 = zext v3
//!     v8: i32 = and v7, 0xFFFFFB              …
//!     v9: i32 = or v8, v6                     store local_bits:2, v5
//!     store words:0, v9                       …
//!     return                                  v6: i64 = load local_bits:0
//!                                             v7: i64 = gather_bits v6
//!                                             v8: i32 = trunc v7
//!                                             v9: i32 = load words:0
//!                                             …  (the low eight bits of v9 are replaced by those of v8)
//!                                             return
//! ```
//!
//! The bits of a word are *unpacked* into [local bits](crate::Module::local_bits) where a function is entered, and
//! *packed* again where it is left and its word may have been changed. They are also packed before whatever may see the image, and
//! unpacked after it, since that may have changed them: a call of the host, a volatile access, a test of the time
//! limit. So nobody sees a word that is not up to date.
//!
//! That is done for words of [`Module::word_regions`](crate::Module::word_regions) of which the function does
//! nothing but read and write single bits ([`analysis`]), if that happens so often that it pays for unpacking and packing
//! ([`cost`]). Functions with loops are left alone, since it is not known how often their blocks are executed.
//!
//! Functions that are optimised for size are left alone, too: they seldom run, and call the host often.
//!
//! The pass comes first, while each bit is read and written by the instructions that front ends make of it.

mod analysis;
mod cost;
mod rewrite;

use super::graph::Graph;
use crate::{Address, FuncData, RegionId};

/// The bits of at most this many words of a function become bytes, since a [set of words](WordSet) has 64 bits.
const MAX_WORDS: usize = 64;

/// The bits of a word that are used; its highest byte is 0.
const WORD_BITS: u32 = 24;

/// How many local bits there are, in functions that use all they may.
pub(super) const LOCAL_BITS: u32 = MAX_WORDS as u32 * WORD_BITS;

/// A set of words: bit N stands for the word with the number N.
type WordSet = u64;

/// A word of which single bits are read and written.
#[derive(Clone, Debug)]
struct Word {
    at: Address,
    /// Which bits are read or written.
    used: u32,
    /// Which bits are written.
    written: u32,
    /// What is saved by bytes in one execution of the function, in instructions.
    saved: f32,
    /// What is saved in the code, in instructions.
    saved_code: u32,
    /// Where its bits begin among the local bits.
    slot: u32,
}

impl Word {
    /// The groups of eight bits, as numbers from 0, of which a set of bits has some.
    fn groups(bits: u32) -> impl Iterator<Item = u32> {
        (0..WORD_BITS / 8).filter(move |group| bits >> (8 * group) & 0xFF != 0)
    }

    /// The local bit for the bit with a number.
    fn local_bit(&self, bit: u32) -> Address {
        Address::fixed(RegionId::LOCAL_BITS, self.slot + bit)
    }
}

/// Runs the pass; gives whether it changed anything. Words of `regions` have a highest byte that is 0. With
/// `always`, bits become bytes also where that does not pay.
pub(super) fn run(func: &mut FuncData, regions: &[RegionId], always: bool) -> bool {
    if regions.is_empty() || func.is_optimized_for_size() && !always {
        return false;
    }
    let graph = Graph::new(func);
    let Some(frequencies) = cost::frequencies(func, &graph) else { return false };
    let mut found = analysis::find(func, &graph, regions, &frequencies);
    if found.words.is_empty() {
        return false;
    }
    let flow = cost::Flow::new(func, &graph, &found);
    let chosen = match always {
        true => WordSet::MAX,
        false => flow.worthwhile(func, &graph, &found, &frequencies),
    };
    if chosen == 0 {
        return false;
    }
    let mut slot = 0;
    for (number, word) in found.words.iter_mut().enumerate() {
        word.slot = slot;
        if chosen >> number & 1 == 1 {
            slot += WORD_BITS;
        }
    }
    rewrite::rewrite(func, &graph, &found, &flow, chosen);
    true
}
