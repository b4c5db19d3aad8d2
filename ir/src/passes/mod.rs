//! Passes that make programs faster. Each is a file; [`optimize`] runs them in order.
//!
//! | pass | what it does |
//! | --- | --- |
//! | `integers` | computes with integers where doubles are known to be integers |
//! | `speculate` | computes with integers behind a check that doubles are integers |
//! | `branches` | decides branches whose condition is known, skips empty blocks, joins blocks |
//! | `forward` | replaces a load by the value stored or loaded before (store-to-load forwarding) |
//! | `fold` | folds constants, applies identities, divides by constants without a division |
//! | `switches` | makes a switch of a row of comparisons with constants |
//! | `if-convert` | makes selects of short branches |
//! | `demanded-bits` | goes around instructions that change only bits nobody uses |
//! | `cse` | computes the same thing once (common subexpressions) |
//! | `dead-stores` | drops stores that are overwritten before anything reads them |
//! | `dce` | drops instructions whose results are not used (dead code) |
//! | `compact` | numbers what is left again without gaps |
//!
//! # What every pass must keep
//! - A module that the [verifier](crate::verify) accepts before a pass is accepted behind it. Debug
//!   builds check that behind each pass.
//! - Every scan leaves the same process image and the same outcome, whatever image it begins with.
//! - Volatile accesses are neither moved, merged nor dropped.
//! - Every store that stands before a trap, a suspension, a call of a host function or a volatile
//!   access is done when that comes: someone may read the process image there.
//! - A pass takes time in proportion to the length of the function.
//!
//! The files `fold_…` hold the rules of `fold`, `speculation_plan` what `speculate` checks.
//! `graph` (the order of the blocks and their edges), `substitution` (which value replaces which),
//! `value_range` (bits and bounds of integers), `float_range` (bounds of doubles) and `image_bytes` (accesses as byte addresses) are
//! data structures that the passes share.

mod branches;
mod compact;
mod cse;
mod dce;
mod dead_stores;
mod demanded_bits;
mod float_range;
mod fold;
mod fold_binary;
mod fold_bits;
mod fold_compare;
mod fold_convert;
mod fold_divide;
mod forward;
mod graph;
mod if_convert;
mod image_bytes;
mod integers;
mod speculate;
mod speculation_plan;
mod substitution;
mod switches;
mod value_range;

use dead_stores::DeadBytes;
pub(crate) use graph::Graph;
use image_bytes::ImageBytes;

use crate::{FuncData, Module, verify};

/// How much time to spend on making code fast.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OptLevel {
    /// None: the module stays as the front end wrote it.
    None,
    /// As much as pays off in the speed of scans.
    #[default]
    Speed,
}

/// A pass over one function; the head of its file says what it does and what it must not do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Integer arithmetic for doubles that are integers.
    Integers,
    /// Speculation that doubles are integers.
    Speculate,
    /// Simplifies control flow.
    Branches,
    /// Store-to-load forwarding.
    Forward,
    /// Constant folding and algebraic simplification.
    Fold,
    /// Switches made of rows of comparisons.
    Switches,
    /// If-conversion: selects made of short branches.
    IfConvert,
    /// Operations on bits that nobody uses.
    DemandedBits,
    /// Common subexpression elimination.
    Cse,
    /// Dead store elimination.
    DeadStores,
    /// Dead code elimination.
    Dce,
    /// Renumbering without gaps.
    Compact,
}

impl Pass {
    /// Every pass, in the order of the table at the head of the module.
    pub const ALL: [Self; 12] = [
        Self::Integers,
        Self::Speculate,
        Self::Branches,
        Self::Forward,
        Self::Fold,
        Self::Switches,
        Self::IfConvert,
        Self::DemandedBits,
        Self::Cse,
        Self::DeadStores,
        Self::Dce,
        Self::Compact,
    ];

    /// Its name, as in that table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Integers => "integers",
            Self::Speculate => "speculate",
            Self::Branches => "branches",
            Self::Forward => "forward",
            Self::Fold => "fold",
            Self::Switches => "switches",
            Self::IfConvert => "if-convert",
            Self::DemandedBits => "demanded-bits",
            Self::Cse => "cse",
            Self::DeadStores => "dead-stores",
            Self::Dce => "dce",
            Self::Compact => "compact",
        }
    }

    /// The pass with a name; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|pass| pass.name() == name)
    }

    /// Runs the pass over a function. Gives whether it changed something, so that it pays to run
    /// other passes again. Passes of which that is never asked always give true.
    fn run(
        self,
        module: &Module,
        func: &mut FuncData,
        bytes: &mut ImageBytes,
        dead: &mut DeadBytes,
    ) -> bool {
        match self {
            Self::Integers => integers::run(func, &module.finite_regions),
            Self::Speculate => return speculate::run(func, &module.finite_regions),
            Self::Branches => branches::run(func),
            Self::Forward => return forward::run(func, bytes),
            Self::Fold => fold::run(func),
            Self::Switches => return switches::run(func),
            Self::IfConvert => return if_convert::run(func),
            Self::DemandedBits => demanded_bits::run(func),
            Self::Cse => cse::run(func),
            Self::DeadStores => dead_stores::run(func, bytes, dead),
            Self::Dce => dce::run(func),
            Self::Compact => compact::run(func),
        }
        true
    }
}

/// Optimises a verified module: runs the passes that a level asks for, in a fixed order.
pub fn optimize(module: &mut Module, level: OptLevel) {
    match level {
        OptLevel::None => {}
        OptLevel::Speed => each(module, |stage| {
            stage.all(&[Pass::Branches, Pass::Integers]);
            if stage.pass(Pass::Speculate) {
                stage.all(&[Pass::Integers, Pass::Branches]);
            }
            stage.all(&[Pass::Forward, Pass::Fold, Pass::Branches]);
            let switched = stage.pass(Pass::Switches);
            if stage.pass(Pass::IfConvert) || switched {
                stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
            }
            stage.all(&[Pass::DemandedBits, Pass::Cse, Pass::DeadStores, Pass::Dce, Pass::Compact]);
        }),
    }
}

/// Runs passes in the order given over every function of a verified module. For tests and
/// experiments; any order keeps the rules.
pub fn run(module: &mut Module, passes: &[Pass]) {
    each(module, |stage| stage.all(passes));
}

/// A function that is being optimised, with what its passes share with those of other functions.
struct Stage<'a> {
    module: &'a Module,
    func: FuncData,
    bytes: &'a mut ImageBytes,
    dead: &'a mut DeadBytes,
}

impl Stage<'_> {
    /// Runs passes one after the other.
    fn all(&mut self, passes: &[Pass]) {
        for &pass in passes {
            self.pass(pass);
        }
    }

    /// Runs one pass; gives what [`Pass::run`] gives.
    fn pass(&mut self, pass: Pass) -> bool {
        let changed = pass.run(self.module, &mut self.func, self.bytes, self.dead);
        debug_assert_eq!(
            verify::function(self.module, &self.func).first().map(ToString::to_string),
            None,
            "{} behind {}",
            self.func.name(),
            pass.name()
        );
        changed
    }
}

/// Lets `order` run passes over each function, from the last to the first. Control mostly goes from
/// a function to a later one, and `dead-stores` needs to know first which bytes are dead there.
fn each(module: &mut Module, order: impl Fn(&mut Stage<'_>)) {
    let mut bytes = ImageBytes::new(module);
    let mut dead = DeadBytes::new(module.label_count);
    for index in (0..module.funcs.len()).rev() {
        let func = std::mem::take(&mut module.funcs[index]);
        let mut stage = Stage { module, func, bytes: &mut bytes, dead: &mut dead };
        order(&mut stage);
        module.funcs[index] = stage.func;
    }
}
