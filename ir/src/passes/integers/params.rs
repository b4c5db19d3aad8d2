//! Parameters of blocks that become integers.
//!
//! ```text
//! block1: jump block3(v2)              v2 = itof v1        block1: jump block3(v1)
//! block2: jump block3(v3)              v3 = fconst 0  ==>  block2: v6: i32 = iconst 0
//! block3(v4: f64):                                                 jump block3(v6)
//!                                                          block3(v5: i32): v4: f64 = itof v5
//! ```

use super::{Integers, to_double, type_for};
use crate::InstBuilder;
use crate::func::ValueData;
use crate::passes::substitution::Substitution;
use crate::{Block, BlockCall, FuncData, Inst, StatementId, Type, Value, ValueDef};

impl Integers<'_> {
    /// Makes integers of those parameters of a block for which all branches to it pass integers. `before` are
    /// the blocks from which the branches come.
    pub(super) fn params(&mut self, block: Block, before: &[Block], values: &mut Substitution) {
        for number in 0..self.func.block(block).params.len() {
            let Some(&param) = self.func.block(block).params.get(number) else { return };
            let range = self.floats.get(param);
            let Some((low, high)) = range.integers().filter(|_| !range.may_be_minus_zero()) else {
                continue;
            };
            if !self.all_pass_integers(block, number, before) {
                continue;
            }
            let ty = type_for(low, high);
            // The conversions of parameters before this one.
            let out = std::mem::take(&mut self.out);
            for &from in before {
                self.pass_integer(from, block, number, ty);
            }
            self.out = out;
            let def = ValueDef::Param(block, number as u32);
            let new = self.func.values.push(ValueData { ty, def });
            self.func.blocks[block].params[number] = new;
            self.integers.set_bounds(new, ty, (low, high));
            let insts = &self.func.block(block).insts;
            self.loc = loc_of(self.func, insts.first());
            let double = self.build(to_double(new));
            values.replace(param, double);
        }
    }

    /// Whether all branches to a block pass integers as its parameter with a number, and not constants only.
    fn all_pass_integers(&self, block: Block, number: usize, before: &[Block]) -> bool {
        let (mut all, mut any) = (true, false);
        for from in before {
            let Some(terminator) = &self.func.block(*from).terminator else { return false };
            terminator.for_each_block(|to, args| {
                if to == block {
                    all &= args.get(number).is_some_and(|&arg| self.is_integer(arg));
                    any |= args.get(number).is_some_and(|&arg| self.func.constant(arg).is_none());
                }
            });
        }
        all && any
    }

    /// Lets the branches of a block to another pass an integer of a type instead of the double that is equal
    /// to it.
    fn pass_integer(&mut self, from: Block, to: Block, number: usize, ty: Type) {
        let data = &mut self.func.blocks[from];
        self.out = std::mem::take(&mut data.insts);
        let mut terminator = data.terminator.take();
        self.loc = loc_of(self.func, self.out.last());
        let pass = |call: &mut BlockCall| {
            if call.block == to
                && let Some(arg) = call.args.get_mut(number)
                && self.func.ty(*arg) == Type::F64
            {
                // That all are integers was seen before.
                *arg = self.operand(*arg, ty).unwrap_or(Value::NONE);
            }
        };
        if let Some(terminator) = &mut terminator {
            terminator.for_each_call_mut(pass);
        }
        let data = &mut self.func.blocks[from];
        (data.insts, data.terminator) = (std::mem::take(&mut self.out), terminator);
    }
}

/// The statement of an instruction, if there is one.
fn loc_of(func: &FuncData, inst: Option<&Inst>) -> StatementId {
    inst.map_or(StatementId::NONE, |&inst| func.loc(inst))
}
