//! Makes programs faster: one pass a file, ordered here.
//!
//! What holds before a pass holds behind it: the [verifier](crate::verify) passes (debug builds
//! look after each), and every task leaves the same image and outcome, whatever it began with.
//! Volatile accesses are neither moved, merged nor dropped, and a store is there when a trap, a
//! suspension, a call of the host or a volatile access comes. Each pass takes time in
//! proportion to the function's length.

mod branches;
mod compact;
mod cse;
mod dce;
mod dead_stores;
mod demanded_bits;
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
mod substitution;
mod switches;
mod value_range;

use dead_stores::Again;
pub(crate) use graph::Graph;
use image_bytes::Places;

use crate::{FuncData, Module, verify};

/// How hard to try.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OptLevel {
    /// Not at all.
    None,
    /// For fast scans.
    #[default]
    Speed,
}

/// A pass over one function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Branches that are decided, empty blocks, blocks in a row.
    Branches,
    /// Stores to loads.
    Forward,
    /// Constants, identities, conversions, truth values.
    Fold,
    /// Rows of comparisons into branches by number.
    Switches,
    /// Short branches into choices.
    IfConvert,
    /// Bits that nobody looks at.
    Demand,
    /// The same thing once.
    Cse,
    /// Stores that are overwritten unseen.
    DeadStores,
    /// What nobody uses.
    Dce,
    /// New numbers.
    Compact,
}

impl Pass {
    /// Every pass.
    pub const ALL: [Self; 10] = [
        Self::Branches,
        Self::Forward,
        Self::Fold,
        Self::Switches,
        Self::IfConvert,
        Self::Demand,
        Self::Cse,
        Self::DeadStores,
        Self::Dce,
        Self::Compact,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Branches => "branches",
            Self::Forward => "forward",
            Self::Fold => "fold",
            Self::Switches => "switches",
            Self::IfConvert => "if-convert",
            Self::Demand => "demand",
            Self::Cse => "cse",
            Self::DeadStores => "dead-stores",
            Self::Dce => "dce",
            Self::Compact => "compact",
        }
    }

    /// Finds a pass by its name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|pass| pass.name() == name)
    }

    /// Runs over a function; says whether it may have changed something that others work on.
    fn run(self, func: &mut FuncData, places: &mut Places, again: &mut Again) -> bool {
        match self {
            Self::Branches => branches::run(func),
            Self::Forward => return forward::run(func, places),
            Self::Fold => fold::run(func),
            Self::Switches => return switches::run(func),
            Self::IfConvert => return if_convert::run(func),
            Self::Demand => demanded_bits::run(func),
            Self::Cse => cse::run(func),
            Self::DeadStores => dead_stores::run(func, places, again),
            Self::Dce => dce::run(func),
            Self::Compact => compact::run(func),
        }
        true
    }
}

/// Optimises a verified module.
pub fn optimize(module: &mut Module, level: OptLevel) {
    match level {
        OptLevel::None => {}
        OptLevel::Speed => each(module, |stage| {
            stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold, Pass::Branches]);
            let switched = stage.pass(Pass::Switches);
            if stage.pass(Pass::IfConvert) || switched {
                stage.all(&[Pass::Branches, Pass::Forward, Pass::Fold]);
            }
            stage.all(&[Pass::Demand, Pass::Cse, Pass::DeadStores, Pass::Dce, Pass::Compact]);
        }),
    }
}

/// Runs some passes in the order given over every function of a verified module.
pub fn run(module: &mut Module, passes: &[Pass]) {
    each(module, |stage| stage.all(passes));
}

/// A function on its way through the passes.
struct Stage<'a> {
    module: &'a Module,
    func: FuncData,
    places: &'a mut Places,
    again: &'a mut Again,
}

impl Stage<'_> {
    fn all(&mut self, passes: &[Pass]) {
        for &pass in passes {
            self.pass(pass);
        }
    }

    /// Whether the pass changed something that others work on.
    fn pass(&mut self, pass: Pass) -> bool {
        let changed = pass.run(&mut self.func, self.places, self.again);
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

/// Lets `order` run passes over each function, the last one first: those before it may learn
/// what it writes.
fn each(module: &mut Module, order: impl Fn(&mut Stage<'_>)) {
    let mut places = Places::new(module);
    let mut again = Again::new(module.label_count);
    for index in (0..module.funcs.len()).rev() {
        let func = std::mem::take(&mut module.funcs[index]);
        let mut stage = Stage { module, func, places: &mut places, again: &mut again };
        order(&mut stage);
        module.funcs[index] = stage.func;
    }
}
