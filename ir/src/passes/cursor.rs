//! Where passes write new instructions of a statement.

use crate::{FuncData, Inst, InstBuilder, InstData, StatementId, Value};

/// The end of a list of instructions, where they are inserted for a statement.
pub(super) struct Cursor<'a> {
    pub(super) func: &'a mut FuncData,
    pub(super) out: &'a mut Vec<Inst>,
    pub(super) loc: StatementId,
}

impl InstBuilder for Cursor<'_> {
    fn func(&self) -> &FuncData {
        self.func
    }

    fn build(&mut self, data: InstData) -> Value {
        let (inst, result) = self.func.append(data, self.loc);
        self.out.push(inst);
        result
    }
}
