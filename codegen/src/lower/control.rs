//! Control flow: how a function gets to the block of the label that it is entered with, and how
//! blocks end.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{
    Block as ClifBlock, BlockArg, InstBuilder, JumpTableData, MemFlagsData, SourceLoc,
    Value as ClifValue, types,
};
use plcc_abi::{RawOutcome, ScanContext, TrapCode};
use plcc_ir::passes::thresholds::entries::{MAX_ENTRIES_PER_LABEL, MAX_SEARCHED_LABELS};
use plcc_ir::{BinaryOp, BlockCall, ConvertOp, InstData, Label, Terminator, Value};

use super::{InvalidIr, LowerResult, Lowering};

impl Lowering<'_> {
    /// Goes to the entry block of the label.
    pub(super) fn enter(&mut self, label: ClifValue) -> LowerResult<()> {
        let entries = self.func.entries();
        if !entries.is_sorted_by(|(a, _), (b, _)| a < b) {
            return Err(InvalidIr("its labels are not sorted".into()));
        }
        match entries {
            [] => self.return_outcome(RawOutcome::trap(TrapCode::Internal)),
            [(_, only)] => {
                let block = self.clif_block(*only)?;
                self.builder.ins().jump(block, &[]);
            }
            [(first, _), .., (last, _)] => {
                let span = last.0 - first.0;
                let is_dense = span / MAX_ENTRIES_PER_LABEL <= entries.len() as u32;
                if is_dense && entries.len() > MAX_SEARCHED_LABELS {
                    self.enter_by_table(label, *first, span)?;
                } else {
                    self.enter_by_search(label)?;
                }
            }
        }
        Ok(())
    }

    /// Enters by a jump table, for labels that are close to one another; `first` is the lowest and
    /// `span` the distance to the highest.
    fn enter_by_table(&mut self, label: ClifValue, first: Label, span: u32) -> LowerResult<()> {
        let unknown = self.builder.create_block();
        let mut targets = vec![unknown; span as usize + 1];
        for &(label, block) in self.func.entries() {
            targets[(label.0 - first.0) as usize] = self.clif_block(block)?;
        }
        let first = self.builder.ins().iconst(types::I32, i64::from(first.0));
        let number = self.builder.ins().isub(label, first);
        self.table(number, &targets, unknown);
        self.builder.switch_to_block(unknown);
        self.builder.seal_block(unknown);
        self.return_outcome(RawOutcome::trap(TrapCode::Internal));
        Ok(())
    }

    /// Enters by a binary search, for few labels and for labels that are far apart.
    fn enter_by_search(&mut self, label: ClifValue) -> LowerResult<()> {
        let entries = self.func.entries();
        let mut pending = vec![(None, entries)];
        while let Some((block, range)) = pending.pop() {
            if let Some(block) = block {
                self.builder.switch_to_block(block);
            }
            if let [(_, only)] = range {
                let block = self.clif_block(*only)?;
                self.builder.ins().jump(block, &[]);
                continue;
            }
            let (low, high) = range.split_at(range.len() / 2);
            let Some((pivot, _)) = high.first() else {
                return Err(InvalidIr("it has no labels to choose from".into()));
            };
            let pivot = self.builder.ins().iconst(types::I32, i64::from(pivot.0));
            let below = self.builder.ins().icmp(IntCC::UnsignedLessThan, label, pivot);
            let (left, right) = (self.builder.create_block(), self.builder.create_block());
            self.builder.ins().brif(below, left, &[], right, &[]);
            [left, right].into_iter().for_each(|block| self.builder.seal_block(block));
            pending.extend([(Some(left), low), (Some(right), high)]);
        }
        Ok(())
    }

    /// Ends the block with a jump to the target with a number, or to `default` beyond the last.
    fn table(&mut self, number: ClifValue, targets: &[ClifBlock], default: ClifBlock) {
        let pool = &mut self.builder.func.dfg.value_lists;
        let default = cranelift_codegen::ir::BlockCall::new(default, [], pool);
        let calls: Vec<_> = targets
            .iter()
            .map(|&block| cranelift_codegen::ir::BlockCall::new(block, [], pool))
            .collect();
        let table = self.builder.create_jump_table(JumpTableData::new(default, &calls));
        self.builder.ins().br_table(number, table);
    }

    pub(super) fn terminator(&mut self, terminator: &Terminator) -> LowerResult<()> {
        match terminator {
            Terminator::Jump(call) => {
                let (block, args) = self.block_call(call)?;
                self.builder.ins().jump(block, &args);
            }
            Terminator::Brif { cond, then, otherwise } => {
                let conds = self.separate_conditions(*cond, then, otherwise);
                let if_any = self.is_cold(then);
                let (then, then_args) = self.block_call(then)?;
                let (otherwise, other_args) = self.block_call(otherwise)?;
                let (last, others) = conds.split_last().unwrap_or((cond, &[]));
                for &cond in others {
                    let next = self.builder.create_block();
                    if if_any {
                        let truth = self.truth(cond)?;
                        self.builder.ins().brif(truth, then, &then_args, next, &[]);
                    } else {
                        self.guard(cond, (next, &[]), (otherwise, &other_args))?;
                    }
                    self.builder.switch_to_block(next);
                    self.builder.seal_block(next);
                }
                self.guard(*last, (then, &then_args), (otherwise, &other_args))?;
            }
            Terminator::Switch { arg, targets, default } => {
                let number = self.value(*arg)?;
                let targets = targets.iter().map(|target| self.clif_block(*target));
                let targets = targets.collect::<LowerResult<Vec<_>>>()?;
                let default = self.clif_block(*default)?;
                self.table(number, &targets, default);
            }
            Terminator::Goto(label) => {
                self.return_outcome(RawOutcome::new(RawOutcome::GOTO, label.0))
            }
            Terminator::GotoIndirect(label) => {
                // The kind of a goto is 0, so the number alone is the outcome.
                let label = self.value(*label)?;
                let outcome = self.builder.ins().uextend(types::I64, label);
                self.builder.ins().return_(&[outcome]);
            }
            Terminator::Suspend(label) => {
                self.return_outcome(RawOutcome::new(RawOutcome::SUSPEND, label.0));
            }
            Terminator::Return => self.return_outcome(RawOutcome::new(RawOutcome::END, 0)),
            Terminator::Trap(code) => self.return_outcome(RawOutcome::trap(*code)),
            Terminator::TrapAt { site, index } => self.trap_at(*site, *index)?,
        }
        Ok(())
    }

    /// Branches by a condition. An integrality check is asked whether it fails: Cranelift allocates registers for the way
    /// that comes second, which is not the cold one then.
    fn guard(
        &mut self,
        cond: Value,
        (then, then_args): (ClifBlock, &[BlockArg]),
        (otherwise, other_args): (ClifBlock, &[BlockArg]),
    ) -> LowerResult<()> {
        if let Some(&InstData::Convert { op: ConvertOp::IsIntegerOrNan, to: _, arg }) =
            self.func.def_inst(cond)
            && self.is_checked_here(arg)
        {
            let fails = self.is_integer(arg, FloatCC::OrderedNotEqual)?;
            self.builder.ins().brif(fails, otherwise, other_args, then, then_args);
        } else {
            let truth = self.truth(cond)?;
            self.builder.ins().brif(truth, then, then_args, otherwise, other_args);
        }
        Ok(())
    }

    /// The conditions of a guard, each of which gets a branch of its own: to the cold block from any of
    /// them. A branch takes two instructions fewer than it takes to make a truth value of a comparison
    /// and join it with others. For other branches there is one condition. What was joined in 32 bits already stays
    /// as it is: a load that became part of it is not a value of its own any more.
    fn separate_conditions(
        &self,
        cond: Value,
        then: &BlockCall,
        otherwise: &BlockCall,
    ) -> Vec<Value> {
        let op = match (self.is_cold(then), self.is_cold(otherwise)) {
            (true, false) => BinaryOp::Or,
            (false, true) => BinaryOp::And,
            _ => return vec![cond],
        };
        let (mut separate, mut pending) = (vec![], vec![cond]);
        while let Some(value) = pending.pop() {
            match self.func.def_inst(value) {
                Some(&InstData::Binary { op: joined, args: [a, b] })
                    if joined == op
                        && !self.cold
                        && self.use_count(value) == 1
                        && !self.truth_values.is_wide(value) =>
                {
                    pending.extend([b, a]);
                }
                _ => separate.push(value),
            }
        }
        separate
    }

    /// Whether the target of a branch is a cold block.
    fn is_cold(&self, call: &BlockCall) -> bool {
        self.func.block(call.block).cold
    }

    /// Goes to the function's exit for traps, which all traps with a site share. So the code of one trap
    /// is no more than two numbers that are put into registers and a jump, in a block that seldom runs.
    /// Instead of a number above `RawOutcome::MAX_TRAP_SITES` the code returns that one, which no site
    /// has.
    fn trap_at(&mut self, site: Value, index: Value) -> LowerResult<()> {
        let kind = match self.func.constant(site) {
            Some(site) => {
                let site = (site as u32).min(RawOutcome::MAX_TRAP_SITES);
                let kind = RawOutcome::trap_kind(site);
                self.builder.ins().iconst(types::I32, i64::from(kind))
            }
            None => {
                // The same for a number that is known only when the code runs.
                let site = self.value(site)?;
                let most = i64::from(RawOutcome::MAX_TRAP_SITES);
                let most = self.builder.ins().iconst(types::I32, most);
                let site = self.builder.ins().umin(site, most);
                let number = self.builder.ins().iadd_imm_s(site, 1);
                let shifted = self.builder.ins().ishl_imm_u(number, 8);
                self.builder.ins().bor_imm_u(shifted, i64::from(RawOutcome::TRAP))
            }
        };
        let index = self.value(index)?;
        let exit = *self.trap_exit.get_or_insert_with(|| self.builder.create_block());
        self.builder.ins().jump(exit, &[BlockArg::Value(kind), BlockArg::Value(index)]);
        Ok(())
    }

    /// Makes the function's exit for traps, if it has any: it returns the high and the low half of
    /// the outcome that it is given.
    pub(super) fn write_trap_exit(&mut self) {
        let Some(exit) = self.trap_exit else { return };
        let [kind, index] = [(); 2].map(|()| self.builder.append_block_param(exit, types::I32));
        self.builder.switch_to_block(exit);
        self.builder.set_cold_block(exit);
        self.builder.set_srcloc(SourceLoc::default());
        let [kind, index] = [kind, index].map(|half| self.builder.ins().uextend(types::I64, half));
        let high = self.builder.ins().ishl_imm_u(kind, 32);
        let outcome = self.builder.ins().bor(high, index);
        self.builder.ins().return_(&[outcome]);
    }

    /// Whether the epoch has reached the scan's limit. Other threads and host functions may change the
    /// two while the code runs.
    pub(super) fn is_late(&mut self) -> ClifValue {
        let pointer = self.builder.func.dfg.value_type(self.context);
        let fixed = MemFlagsData::trusted().with_readonly();
        let epoch = std::mem::offset_of!(ScanContext, epoch) as i32;
        let epoch = self.builder.ins().load(pointer, fixed, self.context, epoch);
        let limit = std::mem::offset_of!(ScanContext, limit) as i64;
        let limit = self.builder.ins().iadd_imm_s(self.context, limit);
        let shared = MemFlagsData::trusted();
        let epoch = self.builder.ins().atomic_load(types::I64, shared, epoch);
        let limit = self.builder.ins().atomic_load(types::I64, shared, limit);
        self.builder.ins().icmp(IntCC::UnsignedGreaterThanOrEqual, epoch, limit)
    }

    /// Returns from the function with an outcome.
    fn return_outcome(&mut self, outcome: RawOutcome) {
        let value = self.builder.ins().iconst(types::I64, outcome.0 as i64);
        self.builder.ins().return_(&[value]);
    }

    /// The CLIF block and arguments of a branch's target.
    fn block_call(&mut self, call: &BlockCall) -> LowerResult<(ClifBlock, Vec<BlockArg>)> {
        let args = call.args.iter().map(|&arg| Ok(BlockArg::Value(self.value(arg)?)));
        let args = args.collect::<LowerResult<_>>()?;
        Ok((self.clif_block(call.block)?, args))
    }
}
