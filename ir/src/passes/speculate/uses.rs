//! Where the values of a function are used.

use crate::{FuncData, PrimaryMap, SecondaryMap, StatementId, Value};

/// Where values are used.
pub(super) struct Uses {
    /// For each value the place of the last instruction that uses it among the instructions of its
    /// block. It means nothing for a value that is used elsewhere.
    pub(super) last: SecondaryMap<Value, usize>,
    /// For each value whether an instruction of another block or another statement uses it, or the
    /// terminator of another block.
    pub(super) elsewhere: SecondaryMap<Value, bool>,
    /// For each value whether its own block's terminator uses it.
    pub(super) by_terminator: SecondaryMap<Value, bool>,
}

impl Uses {
    pub(super) fn new(func: &FuncData) -> Self {
        let count = func.value_count();
        let mut uses = Self {
            last: vec![0; count].into(),
            elsewhere: vec![false; count].into(),
            by_terminator: vec![false; count].into(),
        };
        let mut home = PrimaryMap::from(vec![(u32::MAX, StatementId::NONE); count]);
        for (block, data) in func.blocks() {
            for &inst in &data.insts {
                if let Some(result) = func.result(inst) {
                    home[result] = (block.0, func.loc(inst));
                }
            }
        }
        for (block, data) in func.blocks() {
            for (at, &inst) in data.insts.iter().enumerate() {
                func.inst(inst).for_each_arg(|value| {
                    uses.last[value] = at;
                    uses.elsewhere[value] |= home[value] != (block.0, func.loc(inst));
                });
            }
            if let Some(terminator) = &data.terminator {
                terminator.for_each_arg(|value| {
                    let own = home[value].0 == block.0;
                    uses.by_terminator[value] |= own;
                    uses.elsewhere[value] |= !own;
                });
            }
        }
        uses
    }
}
