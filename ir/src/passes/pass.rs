//! The passes by their names.

use super::dead_stores::DeadBytes;
use super::image_bytes::ImageBytes;
use super::{
    branches, byte_bits, compact, cse, dce, dead_stores, decoders, demanded_bits, fold, forward,
    gates, if_convert, integers, narrow, packed_bits, rows, speculate, speculate_variables,
    switches, thread_tests,
};
use crate::words::words;
use crate::{FuncData, Module};

words! {
    /// A pass over one function. The file of that name says at its head what it does and what it must not do.
    Pass {
        /// Bytes in the place of bits of words, within a function.
        ByteBits = "byte-bits",
        /// Makes integer arithmetic of doubles that are known to be integers.
        Integers = "integers",
        /// Makes a copy of a function for variables that hold integers, after a check of each variable.
        SpeculateVariables = "speculate-variables",
        /// Makes integer arithmetic after a check that doubles are integers (speculation).
        Speculate = "speculate",
        /// Simplifies control flow.
        Branches = "branches",
        /// Store-to-load forwarding.
        Forward = "forward",
        /// Constant folding and algebraic simplification.
        Fold = "fold",
        /// Jump threading: skips tests whose result is known.
        ThreadTests = "thread-tests",
        /// Switches made of rows of comparisons.
        Switches = "switches",
        /// If-conversion: selects made of short branches.
        IfConvert = "if-convert",
        /// One store for all bits that a block puts into a word.
        PackedBits = "packed-bits",
        /// Operations on words instead of many of their bits.
        Rows = "rows",
        /// Truth values instead of integers.
        Narrow = "narrow",
        /// Tests of masks, where a number is compared with several numbers.
        Decoders = "decoders",
        /// Goes around operations on bits that nobody uses.
        DemandedBits = "demanded-bits",
        /// Common subexpression elimination.
        Cse = "cse",
        /// Dead store elimination.
        DeadStores = "dead-stores",
        /// Dead code elimination.
        Dce = "dce",
        /// Rearranging of AND, OR and NOT.
        Gates = "gates",
        /// Renumbering without gaps.
        Compact = "compact",
    }
}

/// In which way passes run that have more than one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Variant {
    /// `forward`: whether truth values are loaded again rather than forwarded.
    pub(super) reload_bits: bool,
    /// `fold`: whether truth values that are bits of words are combined as words. Then it is no
    /// longer seen which bit each of them is; so `packed-bits` and `rows` come first.
    pub(super) combine_bits: bool,
    /// `thread-tests`: whether tests that stand alone are skipped.
    pub(super) skip_lone_tests: bool,
    /// Whether `packed-bits` pays.
    pub(super) collect_bits: bool,
    /// Whether passes are left out by the length of the program, and `byte-bits` where it does not pay.
    pub(super) by_length: bool,
}

impl Pass {
    /// Runs the pass over a function. Returns false only if nothing was changed; some passes do not keep count, and
    /// always return true.
    pub(super) fn run(
        self,
        module: &Module,
        func: &mut FuncData,
        bytes: &mut ImageBytes,
        dead: &DeadBytes,
        variant: Variant,
    ) -> bool {
        match self {
            Self::ByteBits => byte_bits::run(func, &module.word_regions, !variant.by_length),
            Self::Integers => integers::run(func, &module.finite_regions),
            Self::SpeculateVariables => speculate_variables::run(func, &module.finite_regions),
            Self::Speculate => speculate::run(func, &module.finite_regions),
            Self::Branches => {
                branches::run(func);
                true
            }
            Self::Forward => forward::run(func, bytes, variant.reload_bits),
            Self::Fold => {
                fold::run(func, &module.word_regions, variant.combine_bits);
                true
            }
            Self::ThreadTests => thread_tests::run(func, bytes, variant.skip_lone_tests),
            Self::Switches => switches::run(func),
            Self::IfConvert => if_convert::run(func),
            Self::PackedBits => packed_bits::run(func, bytes),
            Self::Rows => rows::run(func, bytes),
            Self::Narrow => narrow::run(func),
            Self::Decoders => decoders::run(func),
            Self::DemandedBits => {
                demanded_bits::run(func);
                true
            }
            Self::Cse => {
                cse::run(func);
                true
            }
            Self::DeadStores => {
                dead_stores::run(func, bytes, dead);
                true
            }
            Self::Dce => {
                dce::run(func);
                true
            }
            Self::Gates => {
                gates::run(func);
                true
            }
            Self::Compact => compact::run(func),
        }
    }
}
