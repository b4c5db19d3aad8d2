//! Executes one statement alone, for those who ask what would be if a variable had another value.

use plcc_abi::image::{read_u16, write_u16};
use plcc_abi::nct::{NctName, context};
use plcc_abi::{Scan, TimeLimit};

use super::Interpreter;
use super::run::{Next, Run};
use crate::common::{Accessed, Observer, Value};
use crate::nct::access;
use crate::nct::ast::{ConditionPart, Op, Program, Test};

impl Interpreter {
    /// As [`execute`](crate::common::StatementInterpreter::execute). OP, and its values that brackets keep, are told as
    /// read and written. The host performs a statement with a register area.
    pub(super) fn execute_statement(
        &mut self,
        task: usize,
        statement: u32,
        scan: &mut Scan<'_>,
        observer: &mut dyn Observer,
    ) -> Option<u32> {
        let &(module, _) = self.modules.get(task)?;
        let at = statement as usize;
        let op = self.program.stmts.get(at)?.op;
        observer.statement(statement, scan.image);
        let register = access::accessed(NctName::Op(module as u8));
        let at_op = self.layout.context + context::OP;
        if uses_op(&self.program, &op) {
            handed_on(register, at_op, scan.image, observer);
        }
        if let Op::Apply { slot, .. } = op {
            handed_on(access::slot(slot), self.slot(slot), scan.image, observer);
        }
        let op_before = read_u16(scan.image, at_op);
        let (next, op_after) = {
            let mut run = Run {
                program: &self.program,
                layout: &self.layout,
                calls: &self.calls,
                image: &mut *scan.image,
                op: op_before,
                waiting: &mut self.waiting,
                limit: TimeLimit::NONE,
                observer: &mut *observer,
            };
            let next = if let Op::Area { op, area } = op {
                let result = run.observe_area_reads(op, area);
                scan.host.call(
                    run.image,
                    op.host_function(),
                    [area.into(), op_before.into(), 0, 0],
                );
                run.observe_area_writes(op, area, result);
                Next::At(at + 1)
            } else {
                run.step(at, &op)
            };
            (next, run.op)
        };
        write_u16(scan.image, at_op, op_after);
        if sets_op(&op) {
            observer.write(register, Value::Integer(op_after.into()));
        }
        if let Op::Push(slot) = op {
            observer.write(access::slot(slot), Value::Integer(op_before.into()));
        }
        match next {
            Next::At(next) if next < self.program.stmts.len() => Some(next as u32),
            Next::At(_) | Next::Suspend(_) | Next::End | Next::Trap(_) => None,
        }
    }

    /// The offset of a value of OP that brackets keep.
    fn slot(&self, slot: u16) -> u32 {
        self.layout.scratch + u32::from(slot) * 2
    }
}

/// Tells of a register that is read, and puts the value there with which the statement goes on.
fn handed_on(register: Accessed, offset: u32, image: &mut [u8], observer: &mut dyn Observer) {
    let value = Value::Integer(read_u16(image, offset).into());
    observer.read(register, value);
    write_u16(image, offset, observer.instead(register, value).number() as u16);
}

/// Whether a statement works with OP.
fn uses_op(program: &Program, op: &Op) -> bool {
    match *op {
        Op::Store { .. }
        | Op::Arith { .. }
        | Op::Update { .. }
        | Op::Shift { .. }
        | Op::Bin
        | Op::Bcd
        | Op::Push(_)
        | Op::Apply { .. }
        | Op::Area { .. } => true,
        Op::If { first, count, .. } => {
            let parts = program.condition_parts.get(first as usize..(first + count) as usize);
            let compares =
                |part: &ConditionPart| matches!(part, ConditionPart::Test(Test::Relation { .. }));
            parts.unwrap_or(&[]).iter().any(compares)
        }
        Op::Set(_)
        | Op::Clear(_)
        | Op::Count { .. }
        | Op::Load(_)
        | Op::Else { .. }
        | Op::EndIf
        | Op::Label(_)
        | Op::Goto(_)
        | Op::GotoIndirect(_)
        | Op::Call(_)
        | Op::CallIndirect(_)
        | Op::Return
        | Op::End(_)
        | Op::Text
        | Op::Bad { .. } => false,
    }
}

/// Whether a statement gives OP a value.
fn sets_op(op: &Op) -> bool {
    matches!(
        op,
        Op::Load(_) | Op::Arith { .. } | Op::Shift { .. } | Op::Bin | Op::Bcd | Op::Apply { .. }
    )
}
