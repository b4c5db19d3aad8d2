//! Where the values of a function are used.

use crate::{FuncData, StatementId};

/// Where values are used.
pub(super) struct Uses {
    /// For each value how often.
    pub(super) counts: Vec<u32>,
    /// For each value the place of the last instruction that uses it among the instructions of its
    /// block. It means nothing for a value that is used elsewhere.
    pub(super) last: Vec<usize>,
    /// For each value whether an instruction of another block or another statement uses it, or the
    /// terminator of another block.
    pub(super) elsewhere: Vec<bool>,
    /// For each value whether its own block's terminator uses it.
    pub(super) by_terminator: Vec<bool>,
}

impl Uses {
    pub(super) fn new(func: &FuncData) -> Self {
        let count = func.value_count();
        let mut uses = Self {
            counts: vec![0; count],
            last: vec![0; count],
            elsewhere: vec![false; count],
            by_terminator: vec![false; count],
        };
        let mut home = vec![(u32::MAX, StatementId::NONE); count];
        for (block, data) in func.blocks() {
            for &inst in &data.insts {
                if let Some(result) = func.result(inst) {
                    home[result.index()] = (block.0, func.loc(inst));
                }
            }
        }
        for (block, data) in func.blocks() {
            for (at, &inst) in data.insts.iter().enumerate() {
                func.inst(inst).for_each_arg(|value| {
                    uses.counts[value.index()] += 1;
                    uses.last[value.index()] = at;
                    uses.elsewhere[value.index()] |=
                        home[value.index()] != (block.0, func.loc(inst));
                });
            }
            if let Some(terminator) = &data.terminator {
                terminator.for_each_arg(|value| {
                    uses.counts[value.index()] += 1;
                    let own = home[value.index()].0 == block.0;
                    uses.by_terminator[value.index()] |= own;
                    uses.elsewhere[value.index()] |= !own;
                });
            }
        }
        uses
    }
}
