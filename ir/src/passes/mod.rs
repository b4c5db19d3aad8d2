//! Passes that make programs faster; [`optimize`] runs them in order.
//!
//! | pass | what it does |
//! | --- | --- |
//! | `byte-bits` | keeps bits of words as bytes while a long program's function is executed |
//! | `integers` | computes with integers where doubles are known to be integers |
//! | `speculate-variables` | checks once in a function that its variables hold integers |
//! | `speculate` | computes with integers behind a check that doubles are integers |
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
//! | `wide-bits` | no pass over IR: code generation computes with truth values in 32 bits |
//! | `vectors` | no pass over IR: code generation computes rows of neighbouring variables at once |
//! | `double-constants` | no pass over IR: code generation keeps doubles that are used often in registers |
//! | `reload-bits` | no pass: in long programs `forward` does not replace loads of truth values |
//! | `by-length` | no pass: `packed-bits` is left out in long programs, `byte-bits` in short ones |
//!
//! # What every pass must keep
//! - A module that the [verifier](crate::verify) accepts before a pass is accepted after it. Debug
//!   builds check that after each pass.
//! - Every scan leaves the same process image and the same outcome, whatever image it begins with.
//! - Volatile accesses are neither moved, merged nor dropped.
//! - Every store that stands before a trap, a suspension, a call of a host function or a volatile
//!   access is done when that comes: someone may read the process image there.
//! - A pass takes time in proportion to the length of the function.
//!
//! Most passes are a file each. `fold` has its rules in the files `fold_…`. `speculate` decides in
//! `speculation_plan` what it checks, and treats whole statements in `speculate_statement` and rows of them in
//! `speculate_row`. `thread-tests` begins with `split_tests`. The passes share `graph` (the order of the blocks and their
//! edges), `substitution` (which value replaces which), `value_range` (bits and bounds of integers), `float_range` (bounds
//! of doubles), `index_bounds` (bounds of a computed index) and `image_bytes` (accesses as byte addresses). `stage` runs
//! them over the functions, in several threads.

mod branches;
mod byte_bits;
mod compact;
mod cse;
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
mod insert;
mod integers;
mod narrow;
mod packed_bits;
mod pass_set;
mod rows;
mod speculate;
mod speculate_row;
mod speculate_statement;
mod speculate_variables;
mod speculation_plan;
mod split_tests;
mod stage;
mod substitution;
mod switches;
mod thread_tests;
pub mod thresholds;
mod value_range;

use std::time::Duration;

use dead_stores::DeadBytes;
pub(crate) use graph::Graph;
use image_bytes::ImageBytes;
pub use pass_set::PassSet;
use stage::{PassOptions, each};

use crate::{FuncData, Module};

/// How much time to spend on making code fast.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OptLevel {
    /// None: the module stays as the front end wrote it.
    None,
    /// As much as pays off in the speed of scans.
    #[default]
    Speed,
}

/// A pass over one function, whose file says at its head what it does and what it must not do; or, at
/// the end of the list, a technique that can be left out in the same way as a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Bytes in the place of bits of words, within a function.
    ByteBits,
    /// Makes integer arithmetic of doubles that are known to be integers.
    Integers,
    /// Makes a copy of a function for variables that hold integers, behind a check of each variable.
    SpeculateVariables,
    /// Makes integer arithmetic behind a check that doubles are integers (speculation).
    Speculate,
    /// Simplifies control flow.
    Branches,
    /// Store-to-load forwarding.
    Forward,
    /// Constant folding and algebraic simplification.
    Fold,
    /// Jump threading: skips tests whose result is known.
    ThreadTests,
    /// Switches made of rows of comparisons.
    Switches,
    /// If-conversion: selects made of short branches.
    IfConvert,
    /// One store for all bits that a block puts into a word.
    PackedBits,
    /// Operations on words instead of many of their bits.
    Rows,
    /// Truth values instead of integers.
    Narrow,
    /// Tests of masks, where a number is compared with several numbers.
    Decoders,
    /// Goes around operations on bits that nobody uses.
    DemandedBits,
    /// Common subexpression elimination.
    Cse,
    /// Dead store elimination.
    DeadStores,
    /// Dead code elimination.
    Dce,
    /// Rearranging of AND, OR and NOT.
    Gates,
    /// Renumbering without gaps.
    Compact,
    /// Truth values in 32 bits: a technique of code generation, for which there is nothing to do
    /// in IR.
    WideBits,
    /// Vectors for rows of statements: a technique of code generation, for which there is nothing to
    /// do in IR.
    Vectors,
    /// Constant doubles in registers: a technique of code generation.
    DoubleConstants,
    /// [`Forward`](Self::Forward) does not replace loads of truth values in long programs, so that they
    /// are loaded again.
    ReloadBits,
    /// [`PackedBits`](Self::PackedBits) is left out in long programs ([`thresholds::LONG_FROM`]), and
    /// [`ByteBits`](Self::ByteBits) in others and where it does not pay.
    ByLength,
}

impl Pass {
    /// Every pass, in the order of the table at the head of the module.
    pub const ALL: [Self; 25] = [
        Self::ByteBits,
        Self::Integers,
        Self::SpeculateVariables,
        Self::Speculate,
        Self::Branches,
        Self::Forward,
        Self::Fold,
        Self::ThreadTests,
        Self::Switches,
        Self::IfConvert,
        Self::PackedBits,
        Self::Rows,
        Self::Narrow,
        Self::Decoders,
        Self::DemandedBits,
        Self::Cse,
        Self::DeadStores,
        Self::Dce,
        Self::Gates,
        Self::Compact,
        Self::WideBits,
        Self::Vectors,
        Self::DoubleConstants,
        Self::ReloadBits,
        Self::ByLength,
    ];

    /// Its name, as in that table.
    pub fn name(self) -> &'static str {
        match self {
            Self::ByteBits => "byte-bits",
            Self::Integers => "integers",
            Self::SpeculateVariables => "speculate-variables",
            Self::Speculate => "speculate",
            Self::Branches => "branches",
            Self::Forward => "forward",
            Self::Fold => "fold",
            Self::ThreadTests => "thread-tests",
            Self::Switches => "switches",
            Self::IfConvert => "if-convert",
            Self::PackedBits => "packed-bits",
            Self::Rows => "rows",
            Self::Narrow => "narrow",
            Self::Decoders => "decoders",
            Self::DemandedBits => "demanded-bits",
            Self::Cse => "cse",
            Self::DeadStores => "dead-stores",
            Self::Dce => "dce",
            Self::Gates => "gates",
            Self::Compact => "compact",
            Self::WideBits => "wide-bits",
            Self::Vectors => "vectors",
            Self::DoubleConstants => "double-constants",
            Self::ReloadBits => "reload-bits",
            Self::ByLength => "by-length",
        }
    }

    /// The pass with a name; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|pass| pass.name() == name)
    }

    /// Runs the pass over a function. Gives whether it pays to run the passes that follow it in
    /// [`optimize`]: for `integers` whether the function has doubles, for others whether something was
    /// changed. A pass whose answer nobody uses gives true.
    fn run(
        self,
        module: &Module,
        func: &mut FuncData,
        bytes: &mut ImageBytes,
        dead: &DeadBytes,
        options: PassOptions,
    ) -> bool {
        match self {
            Self::ByteBits => {
                return byte_bits::run(func, &module.word_regions, !options.by_length);
            }
            Self::Integers => return integers::run(func, &module.finite_regions),
            Self::SpeculateVariables => {
                return speculate_variables::run(func, &module.finite_regions);
            }
            Self::Speculate => return speculate::run(func, &module.finite_regions),
            Self::Branches => branches::run(func),
            Self::Forward => return forward::run(func, bytes, options.reload_bits),
            Self::Fold => fold::run(func, &module.word_regions, options.combine_bits),
            Self::ThreadTests => {
                return thread_tests::run(func, bytes, options.skip_lone_tests);
            }
            Self::Switches => return switches::run(func),
            Self::IfConvert => return if_convert::run(func),
            Self::PackedBits => return packed_bits::run(func, bytes),
            Self::Rows => return rows::run(func, bytes),
            Self::Narrow => return narrow::run(func),
            Self::Decoders => return decoders::run(func),
            Self::DemandedBits => demanded_bits::run(func),
            Self::Cse => cse::run(func),
            Self::DeadStores => dead_stores::run(func, bytes, dead),
            Self::Dce => dce::run(func),
            Self::Gates => gates::run(func),
            Self::Compact => compact::run(func),
            Self::WideBits
            | Self::Vectors
            | Self::DoubleConstants
            | Self::ReloadBits
            | Self::ByLength => return false,
        }
        true
    }
}

/// How long each pass took, in the order in which the passes first ran, over all functions.
pub type PassTimes = Vec<(Pass, Duration)>;

/// Optimises a verified module: runs those passes of a set (or of the one that a level stands for)
/// in a fixed order. Afterwards [`Module::passes`] is the set, in which code generation finds the
/// techniques that it may use. If the set is [`PassSet::ALL`] and the program is short, techniques that
/// do not pay in short programs are taken out of it; any other set stays as it is.
pub fn optimize(module: &mut Module, passes: impl Into<PassSet>) -> PassTimes {
    let passes = passes.into();
    module.passes = passes;
    if passes == PassSet::NONE {
        return vec![];
    }
    let mut times = vec![];
    let length = instructions(module);
    let by_length = passes.contains(Pass::ByLength);
    let is_long_enough = length >= thresholds::UNPACK_BITS_FROM || !by_length;
    let may_unpack = is_long_enough && !module.word_regions.is_empty();
    if may_unpack {
        each(module, passes.without(Pass::DeadStores), length, &mut times, |stage| {
            stage.pass(Pass::Branches);
            if stage.pass(Pass::ByteBits) {
                stage.pass(Pass::Dce);
            }
        });
    }
    each(module, passes, length, &mut times, |stage| {
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
        stage.options.skip_lone_tests = true;
        if stage.pass(Pass::ThreadTests) {
            stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
        }
        if has_selects && stage.pass(Pass::Switches) {
            stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
        }
        if stage.options.collect_bits && stage.pass(Pass::PackedBits) {
            stage.all(&[Pass::DemandedBits, Pass::Dce, Pass::Forward, Pass::Cse, Pass::Fold]);
        }
        let joins_bits = stage.options.collect_bits && stage.passes.contains(Pass::Rows);
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
        stage.options.combine_bits = true;
        stage.all(&[Pass::Narrow, Pass::Fold, Pass::Decoders]);
        stage.all(&[Pass::DemandedBits, Pass::Cse, Pass::DeadStores, Pass::Dce]);
        if has_checks {
            // Where a store has gone, integrality checks of what it stored guard nothing any more.
            stage.all(&[Pass::Branches, Pass::Dce]);
        }
        stage.pass(Pass::Gates);
        stage.pass(Pass::Compact);
    });
    if passes == PassSet::ALL && instructions(module) < thresholds::WIDE_BITS_FROM {
        module.passes = passes.without(Pass::WideBits);
    }
    times
}

/// Runs passes in the order given over every function of a verified module. For tests and
/// experiments; any order keeps the rules.
pub fn run(module: &mut Module, passes: &[Pass]) {
    let length = instructions(module);
    each(module, PassSet::ALL.without(Pass::ByLength), length, &mut vec![], |stage| {
        stage.options.combine_bits = true;
        stage.options.skip_lone_tests = true;
        stage.all(passes);
    });
}

/// The number of instructions in the blocks of those functions that are executed as a rule: not those of general
/// code beside specialised code, which are optimised for size.
fn instructions(module: &Module) -> usize {
    let funcs = module.funcs.iter().filter(|func| !func.is_optimized_for_size());
    funcs.flat_map(|func| func.blocks()).map(|(_, block)| block.insts.len()).sum()
}
