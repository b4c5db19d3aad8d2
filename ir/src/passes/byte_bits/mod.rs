//! Keeps single bits of words as bytes while a function is executed.
//!
//! A PMAC keeps bits in words of 24 bits. To read one takes a load, a shift and a mask, where a truth value that
//! is a byte is an operand of the instruction that uses it; to write one takes five machine instructions where a byte
//! takes one.
//!
//! ```text
//! block0 (L0):                            block0 (L0):
//!     v0: i32 = load words:0                  v0: i32 = load words:0
//!     v2: i32 = extract_u v0, 5, 1            unpack v0, local_bits:0[0]
//!     …                                       v1: i1 = load local_bits:5
//!                                  ==>        v2: i32 = zext v1
//!     v7: i32 = load words:0                  …
//!     v9: i32 = insert v7, v6, 2, 1           store local_bits:2, v3
//!     store words:0, v9                       …
//!     return                                  v4: i32 = pack local_bits:0[0]
//!                                             v5: i32 = load words:0
//!                                             …  (the low eight bits of v5 are replaced by those of v4)
//!                                             return
//! ```
//!
//! The bits of a word are *unpacked* into [local bits](crate::FuncData::local_bits) where a function is entered, and
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
mod word;

use super::graph::Graph;
use crate::func::MAX_LOCAL_BITS;
use crate::{FuncData, RegionId};
use word::{MAX_WORDS, WORD_BITS, WordSet};

/// Runs the pass; returns whether it changed anything. Words of `regions` have a highest byte that is 0. With
/// `always`, bits become bytes also where that does not pay.
pub(super) fn run(func: &mut FuncData, regions: &[RegionId], always: bool) -> bool {
    let has_room = func.local_bits <= MAX_LOCAL_BITS - MAX_WORDS as u32 * WORD_BITS;
    if regions.is_empty() || !has_room || func.is_optimized_for_size() && !always {
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
    // Those that the function has already are left alone.
    let mut slot = func.local_bits;
    for (number, word) in found.words.iter_mut().enumerate() {
        word.slot = slot;
        if chosen >> number & 1 == 1 {
            slot += WORD_BITS;
        }
    }
    func.local_bits = slot;
    rewrite::rewrite(func, &graph, &found, &flow, chosen);
    true
}
