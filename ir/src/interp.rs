//! An interpreter of IR: an [`Engine`] that executes a module one instruction after the other.
//!
//! It computes every result with [`eval`] and knows nothing of machine code, so tests compare
//! generated code with it. A value is an `i64` in a table that is indexed by the value's number.

use std::sync::Arc;

use plcc_abi::{Engine, Outcome, ResumeLabels, ResumePoint, Scan, Trap, TrapCode};

use crate::memory::{pack, read, unpack, write};
use crate::{
    Address, Block, Func, FuncData, InstData, Label, Module, PrimaryMap, RegionId, SecondaryMap,
    Terminator, Value, eval,
};

/// An engine that interprets a module.
pub struct Interpreter {
    module: Arc<Module>,
    /// For each label the function and the block at which it stands.
    labels: PrimaryMap<Label, Option<(Func, Block)>>,
    /// For each task the labels of its resume points, and the one at which its next scan goes on.
    tasks: Vec<ResumeLabels>,
    /// The values of the function that is executed.
    values: SecondaryMap<Value, i64>,
    /// The local bits of the function that is executed.
    local_bits: Vec<u8>,
    /// How many operations have been executed.
    operations: u64,
}

/// The outcome where a label, resume point or trap site does not exist.
const BAD_LABEL: Outcome = Outcome::trap(TrapCode::Internal);

/// How a function is left.
enum Exit {
    /// Control goes to the label with this number.
    Goto(u32),
    /// The scan is over.
    Done(Outcome),
}

impl Interpreter {
    /// An engine for a verified module.
    pub fn new(module: impl Into<Arc<Module>>) -> Self {
        let module = module.into();
        let labels = module.label_targets();
        let tasks = module.tasks.iter().map(ResumeLabels::new).collect();
        let values = SecondaryMap::new();
        Self { module, labels, tasks, values, local_bits: vec![], operations: 0 }
    }

    /// How many operations have been executed since the engine was made: instructions and ends of
    /// blocks, as `plcc check --bound` counts them.
    pub fn operations(&self) -> u64 {
        self.operations
    }

    fn set(&mut self, value: Value, bits: i64) {
        if let Some(slot) = self.values.get_mut(value) {
            *slot = bits;
        }
    }

    /// Executes a function from one of its blocks until control leaves it. `task` is the index of
    /// the task, which decides what number a resume point has.
    fn run_function(
        &mut self,
        func: &FuncData,
        mut block: Block,
        task: usize,
        scan: &mut Scan<'_>,
    ) -> Exit {
        self.values.clear();
        self.values.resize(func.value_count());
        // They mean nothing yet, so that anything may be in them.
        self.local_bits.clear();
        self.local_bits.resize(func.local_bits() as usize, 0x55);
        loop {
            let data = func.block(block);
            self.operations = self.operations.saturating_add(data.insts.len() as u64 + 1);
            for &inst in &data.insts {
                let data = func.inst(inst);
                let result = self.execute(func, data, scan);
                if matches!(data, InstData::HostCall { .. }) && scan.limit.is_over(scan.host) {
                    let statement = self.module.line(func.loc(inst));
                    return Exit::Done(Outcome::Trap(Trap::late(statement)));
                }
                if let Some(value) = func.result(inst) {
                    self.set(value, result);
                }
            }
            let call = match &data.terminator {
                Some(Terminator::Jump(call)) => call,
                Some(Terminator::Brif { cond, then, otherwise }) => {
                    if self.get(*cond) != 0 {
                        then
                    } else {
                        otherwise
                    }
                }
                Some(Terminator::Switch { arg, targets, default }) => {
                    let number = self.get(*arg) as u32 as usize;
                    block = targets.get(number).copied().unwrap_or(*default);
                    continue;
                }
                Some(Terminator::Goto(label)) => return Exit::Goto(label.0),
                Some(Terminator::GotoIndirect(label)) => return Exit::Goto(self.get(*label) as u32),
                Some(Terminator::Suspend(label)) => {
                    let point = self.tasks.get(task).and_then(|task| task.point(label.0));
                    return Exit::Done(match point {
                        Some(point) => Outcome::Suspended(point),
                        None => BAD_LABEL,
                    });
                }
                Some(Terminator::Return) | None => return Exit::Done(Outcome::End),
                Some(Terminator::Trap(code)) => return Exit::Done(Outcome::trap(*code)),
                Some(Terminator::TrapAt { site, index }) => {
                    let site = self.module.trap_sites.get(self.get(*site) as u32 as usize);
                    let trap = site.map(|site| site.trap(self.get(*index) as u32));
                    return Exit::Done(trap.map_or(BAD_LABEL, Outcome::Trap));
                }
            };
            let args: Vec<i64> = call.args.iter().map(|&arg| self.get(arg)).collect();
            for (&param, arg) in func.block(call.block).params.iter().zip(args) {
                self.set(param, arg);
            }
            block = call.block;
        }
    }

    #[allow(clippy::indexing_slicing, reason = "a SecondaryMap has a value for every key")]
    fn get(&self, value: Value) -> i64 {
        self.values[value]
    }

    fn image_offset(&self, at: &Address) -> u32 {
        self.module.image_offset(at, |value| self.get(value))
    }

    /// Executes an instruction and returns its result, or 0 if it has none.
    fn execute(&mut self, func: &FuncData, data: &InstData, scan: &mut Scan<'_>) -> i64 {
        match *data {
            InstData::Iconst { .. }
            | InstData::Fconst { .. }
            | InstData::Unary { .. }
            | InstData::Binary { .. }
            | InstData::Icmp { .. }
            | InstData::Fcmp { .. }
            | InstData::Select { .. }
            | InstData::Convert { .. }
            | InstData::Bit { .. }
            | InstData::Extract { .. }
            | InstData::Insert { .. } => {
                eval::instruction(func, data, |value| self.get(value)).unwrap_or_default()
            }
            InstData::Load { ty, at } => match at.region {
                RegionId::LOCAL_BITS => read(&self.local_bits, at.offset, ty),
                _ => read(scan.image, self.image_offset(&at), ty),
            },
            InstData::Store { at, value } => {
                let (ty, number) = (func.ty(value), self.get(value));
                match at.region {
                    RegionId::LOCAL_BITS => write(&mut self.local_bits, at.offset, ty, number),
                    _ => write(scan.image, self.image_offset(&at), ty, number),
                }
                0
            }
            InstData::Unpack { word, to } => {
                let word = self.get(word);
                unpack(&mut self.local_bits, word, &to);
                0
            }
            InstData::Pack { from } => pack(&self.local_bits, &from),
            InstData::IsLate => i64::from(scan.limit.is_late()),
            InstData::HostCall { function, args } => {
                let mut words = [0; 4];
                for (word, &arg) in words.iter_mut().zip(args.as_slice()) {
                    *word = eval::host_word(func.ty(arg), self.get(arg));
                }
                eval::host_result(function, scan.host.call(scan.image, function, words))
            }
        }
    }
}

impl Engine for Interpreter {
    fn call(&mut self, task: usize, from: Option<ResumePoint>, scan: &mut Scan<'_>) -> Outcome {
        let module = Arc::clone(&self.module);
        let Some(labels) = self.tasks.get(task) else { return Outcome::End };
        let Some(mut label) = labels.label(from) else { return BAD_LABEL };
        loop {
            let Some((func, block)) = self.labels.get(Label(label)).copied().flatten() else {
                return BAD_LABEL;
            };
            let Some(func) = module.funcs.get(func.index()) else {
                return BAD_LABEL;
            };
            match self.run_function(func, block, task, scan) {
                Exit::Goto(next) if scan.limit.is_over(scan.host) => {
                    let statement = module.label_lines().get(next as usize).copied().flatten();
                    return Outcome::Trap(Trap::late(statement));
                }
                Exit::Goto(next) => label = next,
                Exit::Done(outcome) => return outcome,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use plcc_abi::engine::NoHost;
    use plcc_abi::{Engine, Outcome, Region, ResumePoint, Scan, TrapCode};

    use super::Interpreter;
    use crate::InstBuilder;
    use crate::{Address, BinaryOp, ChunkBuilder, Type};

    #[test]
    fn a_suspended_task_goes_on_where_it_was() {
        let regions = vec![Region { name: "vars".into(), offset: 0, size: 8, bits: false }];
        let mut b = ChunkBuilder::new(8, regions);
        let at = Address::fixed(b.region("vars").unwrap(), 0);
        let (start, middle) = (b.place(), b.place());
        b.bind(start);
        b.task("scan", start);
        b.resume_points(0, &[middle]);
        let v = b.func().load(Type::I16, at);
        let v = b.func().binary_imm(BinaryOp::Add, v, 1);
        b.func().store(at, v);
        b.suspend(middle);
        b.bind(middle);
        let v = b.func().load(Type::I16, at);
        let v = b.func().binary_imm(BinaryOp::Mul, v, 10);
        b.func().store(at, v);
        b.ret();
        let mut engine = Interpreter::new(b.finish());
        let mut image = [0; 8];
        let mut call = |from: Option<u32>, image: &mut [u8]| {
            engine.call(0, from.map(ResumePoint), &mut Scan::new(image, &mut NoHost))
        };
        let suspended = Outcome::Suspended(ResumePoint(0));
        assert_eq!(call(None, &mut image), suspended);
        assert_eq!(image[0], 1);
        assert_eq!(call(Some(0), &mut image), Outcome::End);
        assert_eq!(image[0], 10);
        assert_eq!(call(None, &mut image), suspended);
        assert_eq!(call(None, &mut image), suspended);
        assert_eq!(image[0], 12);
        for beyond in [1, u32::MAX] {
            assert_eq!(call(Some(beyond), &mut image), Outcome::trap(TrapCode::Internal));
        }
        assert_eq!(image[0], 12);
    }
}
