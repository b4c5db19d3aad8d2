//! The blocks that check the variables of a function before its copy for integers.

use crate::{Block, BlockCall, BlockData, FuncData, Inst, Terminator, Value};

/// The integrality check of a variable.
pub(super) struct GuardBlock {
    pub(super) insts: Vec<Inst>,
    /// The double that takes the variable's place.
    pub(super) double: Value,
    /// Whether the check succeeds.
    pub(super) holds: Value,
}

/// Adds the blocks that make the checks, those that are used; gives the first. They go to `slow` if
/// one fails, and else to `fast`. Each check is a block of its own, so that no double must be kept until all
/// are checked.
pub(super) fn add_guard(
    func: &mut FuncData,
    checks: Vec<GuardBlock>,
    slow: Block,
    fast: Block,
) -> Block {
    // The checks are in no block yet, so these are the uses in the copy.
    let counts = func.use_counts();
    let mut next = fast;
    for check in checks.into_iter().rev() {
        if counts[check.double] == 0 {
            continue;
        }
        let (then, otherwise) = (BlockCall::plain(next), BlockCall::plain(slow));
        let terminator = Some(Terminator::Brif { cond: check.holds, then, otherwise });
        let data = BlockData { insts: check.insts, terminator, ..BlockData::default() };
        next = func.blocks.push(data);
    }
    next
}
