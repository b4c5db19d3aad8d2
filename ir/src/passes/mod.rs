//! Passes that make programs faster; [`optimize`] runs them in order.
//!
//! | pass | what it does |
//! | --- | --- |
//! | `byte-bits` | keeps bits of words as bytes while a long program's function is executed |
//! | `integers` | computes with integers where doubles are known to be integers |
//! | `speculate-variables` | checks once in a function that its variables hold integers |
//! | `speculate` | computes with integers after a check that doubles are integers |
//! | `branches` | decides branches whose condition is known, skips empty blocks, joins blocks |
//! | `forward` | replaces a load by the value stored or loaded before (store-to-load forwarding) |
//! | `fold` | folds constants, applies identities, divides by constants without a division |
//! | `thread-tests` | skips tests whose result is known from where control comes |
//! | `switches` | makes a switch of a row of comparisons with constants |
//! | `if-convert` | makes selects of short branches |
//! | `packed-bits` | collects bits that are put one by one into the same word, and stores it once |
//! | `rows` | computes many bits of a word at once, where statements do the same with each of them |
//! | `narrow` | computes with truth values instead of integers of which only one bit matters |
//! | `decoders` | tests a mask where a number is compared with several numbers |
//! | `demanded-bits` | goes around instructions that change only bits nobody uses |
//! | `cse` | computes the same thing once (common subexpressions) |
//! | `dead-stores` | drops stores that are overwritten before anything reads them |
//! | `dce` | drops instructions whose results are not used (dead code) |
//! | `gates` | rearranges AND, OR and NOT of truth values so that they take less code |
//! | `compact` | numbers what is left again without gaps |
//!
//! # What every pass must keep
//! - A module that the [verifier](crate::verify) accepts before a pass is accepted after it. Debug
//!   builds check that after each pass.
//! - Every scan leaves the same process image and the same outcome, whatever image it begins with.
//! - Volatile accesses are neither moved, merged nor dropped.
//! - Every store that is before a trap, a suspension, a call of a host function or a volatile
//!   access is done when that comes: someone may read the process image there.
//! - A pass takes time in proportion to the length of the function.
//!
//! # Bits and fields of words
//! Front ends say which bits they mean: `bit`, `extract_u`, `extract_s` and `insert`. `byte-bits`, and the passes
//! that find integers, which come first, see them as they were written. From the first `fold` on each has one form:
//! - A bit as a truth value is `bit`, of the word that it comes from. No other operation makes an `i1` of an integer but
//!   comparisons.
//! - A field as a number is `extract_s` or `extract_u`, which code generation lowers. One without sign that begins with the
//!   lowest bit is an AND; one of a single bit is the `zext` of a `bit`. Shifts to the left and back become one of these.
//!   The exceptions are a comparison with 0, which masks the word, and the fields that `switches` and `decoders` read.
//! - In the last run, which combines bits as words, the `zext` of a `bit` is an AND of the shifted word.
//! - `insert` is written as an AND that clears the field, and an OR with the new bits, since from there on bits are moved from
//!   word to word, several at a time, and no field is left.
//!
//! Most passes are a file each. `fold` has its rules in the files `fold_…`. `speculate` finds in
//! `stretch` what is written twice and what must be checked, in `checks` which kind of check that takes, and joins statements in
//! `row`; `uses` says which values are needed afterwards. `thread-tests` begins with `split_tests`. The passes share `graph` (the order of the blocks and their
//! edges), `substitution` (which value replaces which), `value_range` (bits and bounds of integers), `float_range` (bounds
//! of doubles), `index_bounds` (bounds of a computed index) and `image_bytes` (accesses as byte addresses). `stage` runs
//! them over the functions, in several threads.

mod branches;
mod byte_bits;
mod compact;
mod cse;
mod cursor;
mod dce;
mod dead_stores;
mod decoders;
mod demanded_bits;
mod float_range;
mod fold;
mod fold_binary;
mod fold_bits;
mod fold_compare;
mod fold_convert;
mod fold_divide;
mod fold_select;
mod fold_toggle;
mod forward;
mod gates;
mod graph;
mod if_convert;
mod image_bytes;
mod index_bounds;
mod integers;
mod narrow;
mod packed_bits;
mod pass;
mod pass_options;
mod rows;
mod speculate;
mod speculate_variables;
mod split_tests;
mod stage;
mod substitution;
mod switches;
mod thread_tests;
pub mod thresholds;
mod value_range;

pub(crate) use graph::Graph;
pub use pass::Pass;
pub use pass_options::{OptLevel, PassOptions, PassSet};
pub use stage::PassTimes;
use stage::each;

use crate::Module;

/// Optimises a verified module: runs the passes that the options (or those of a level) name, in a fixed order.
pub fn optimize(module: &mut Module, options: impl Into<PassOptions>) -> PassTimes {
    let options = options.into();
    let passes = options.passes;
    if passes == PassSet::NONE {
        return vec![];
    }
    let mut times = vec![];
    let length = module.usual_instructions();
    let is_long_enough = length >= thresholds::UNPACK_BITS_FROM || !options.by_length;
    let may_unpack = is_long_enough && !module.word_regions.is_empty();
    if may_unpack {
        let bits_only = PassOptions { passes: passes.without(Pass::DeadStores), ..options };
        each(module, bits_only, length, &mut times, |stage| {
            stage.pass(Pass::Branches);
            if stage.pass(Pass::ByteBits) {
                stage.pass(Pass::Dce);
            }
        });
    }
    each(module, options, length, &mut times, |stage| {
        if !may_unpack {
            stage.pass(Pass::Branches);
        }
        // Instructions on doubles that `integers` has replaced are dropped after each of its runs: otherwise
        // `fold` would take them for uses of their operands.
        let (mut has_checks, mut has_integers) = (false, false);
        if stage.pass(Pass::Integers) {
            stage.pass(Pass::Dce);
            if stage.pass(Pass::SpeculateVariables) {
                has_integers = true;
                stage.all(&[Pass::Integers, Pass::Dce]);
            }
            if stage.pass(Pass::Speculate) {
                has_checks = true;
                stage.all(&[Pass::Integers, Pass::Dce, Pass::Branches]);
            }
        }
        stage.all(&[Pass::Forward, Pass::Fold, Pass::Branches]);
        // A store that will be overwritten would keep a block from being a mere test.
        stage.pass(Pass::DeadStores);
        if stage.pass(Pass::ThreadTests) {
            stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
        }
        if stage.pass(Pass::Switches) {
            stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
        }
        let has_selects = stage.pass(Pass::IfConvert);
        if has_selects {
            stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
            // Two stores that made a bit its opposite are one XOR now, which is short enough.
            stage.pass(Pass::Dce);
            if stage.pass(Pass::IfConvert) {
                stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
            }
        }
        // Where branches have gone, more tests are reached on one way alone.
        stage.variant.skip_lone_tests = true;
        if stage.pass(Pass::ThreadTests) {
            stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
        }
        if has_selects && stage.pass(Pass::Switches) {
            stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
        }
        if stage.variant.collect_bits && stage.pass(Pass::PackedBits) {
            stage.all(&[Pass::DemandedBits, Pass::Dce, Pass::Forward, Pass::Cse, Pass::Fold]);
        }
        let joins_bits = stage.variant.collect_bits && stage.passes.contains(Pass::Rows);
        if joins_bits && rows::applies(&stage.func) {
            // A select whose result is stored only to be overwritten has no other use then.
            stage.pass(Pass::DeadStores);
            if stage.pass(Pass::Rows) {
                stage.pass(Pass::Dce);
            }
        }
        if has_integers {
            // Where a store has gone, the double that it stored may have no use but a select.
            stage.all(&[Pass::DeadStores, Pass::Dce]);
        }
        stage.variant.combine_bits = true;
        stage.all(&[Pass::Narrow, Pass::Fold, Pass::Decoders]);
        stage.all(&[Pass::DemandedBits, Pass::Cse, Pass::DeadStores, Pass::Dce]);
        if has_checks {
            // Where a store has gone, integrality checks of what it stored guard nothing any more.
            stage.all(&[Pass::Branches, Pass::Dce]);
        }
        stage.pass(Pass::Gates);
        stage.pass(Pass::Compact);
    });
    times
}

/// Runs passes in the order given over every function of a verified module. For tests and
/// experiments; any order keeps the rules.
pub fn run(module: &mut Module, passes: &[Pass]) {
    let length = module.usual_instructions();
    let options = PassOptions { by_length: false, ..PassOptions::from(OptLevel::Speed) };
    each(module, options, length, &mut vec![], |stage| {
        stage.variant.combine_bits = true;
        stage.variant.skip_lone_tests = true;
        stage.all(passes);
    });
}
