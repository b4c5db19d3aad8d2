//! Runs single statements: conditions, jumps, calls, safepoints (NCT 4.2 to 4.11).

use plcc_abi::{
    TimeLimit, TrapCode,
    image::{read_u8, read_u16, read_u32, write_u16, write_u32},
    nct::{arithmetic::from_bcd, context},
};

use super::arithmetic::sum;
use crate::common::Observer;
use crate::nct::{
    ast::{Arith, ConditionPart, Op, Operand, Program, Relation, Space, Test, Variable, Word},
    control_flow::INDIRECT_LABELS,
    layout::Layout,
};

/// What follows a statement.
pub(super) enum Next {
    /// The statement with this index follows.
    At(usize),
    /// The task is suspended; it goes on at the statement with this index.
    Suspend(usize),
    /// The task has ended.
    End,
    /// The program is stopped.
    Trap(TrapCode),
}

/// A program while it runs.
pub(super) struct Run<'a, O> {
    pub(super) program: &'a Program,
    pub(super) layout: &'a Layout,
    /// The statements that call, in the source's order.
    pub(super) calls: &'a [usize],
    pub(super) image: &'a mut [u8],
    /// Register OP.
    pub(super) op: u16,
    /// A stack for results of a condition's tests, which A, O and X of the condition combine.
    pub(super) waiting: &'a mut Vec<bool>,
    /// Until when the scan may run.
    pub(super) limit: TimeLimit<'a>,
    /// The observer that is told of the variables that are read and written.
    pub(super) observer: O,
}

// `step`, `condition` and `test` are inlined into the loop of the interpreter, which makes it a third
// faster: `Run` then stays in registers. The compiler does not do so by itself, since expressions
// call them too.
impl<O: Observer> Run<'_, O> {
    /// How many calls are open.
    fn depth(&self) -> u16 {
        read_u16(self.image, self.layout.context + context::DEPTH)
    }

    pub(super) fn set_depth(&mut self, depth: u16) {
        write_u16(self.image, self.layout.context + context::DEPTH, depth);
    }

    /// Whether a condition holds, given the range of its parts.
    #[inline(always)]
    pub(super) fn condition(&mut self, first: u32, count: u32) -> bool {
        self.waiting.clear();
        for at in first..first + count {
            let result = match self.program.condition_parts.get(at as usize) {
                Some(ConditionPart::Test(test)) => self.test(*test),
                Some(ConditionPart::Gate(gate)) => {
                    let b = self.waiting.pop().unwrap_or(false);
                    let a = self.waiting.pop().unwrap_or(false);
                    match gate {
                        Arith::And => a & b,
                        Arith::Or => a | b,
                        Arith::Add | Arith::Sub | Arith::Mul | Arith::Div | Arith::Xor => a ^ b,
                    }
                }
                None => false,
            };
            self.waiting.push(result);
        }
        self.waiting.pop().unwrap_or(false)
    }

    /// Whether a test holds.
    #[inline(always)]
    fn test(&mut self, test: Test) -> bool {
        match test {
            Test::Bit { negate, bit } => self.bit(bit) != negate,
            Test::Word { negate, word } => (self.word(word) != 0) != negate,
            Test::Relation { relation, operand } => {
                let Some(value) = self.operand(operand) else { return false };
                match relation {
                    Relation::Lt => self.op < value,
                    Relation::Gt => self.op > value,
                    Relation::Eq => self.op == value,
                    Relation::Le => self.op <= value,
                    Relation::Ge => self.op >= value,
                }
            }
        }
    }

    /// Passes a safepoint and goes to a statement. The fuel is the number of safepoints that may
    /// still be passed.
    fn safepoint(&mut self, to: usize) -> Next {
        let offset = self.layout.context + context::FUEL;
        let fuel = read_u32(self.image, offset).wrapping_sub(1);
        write_u32(self.image, offset, fuel);
        if fuel != 0 && !self.limit.is_late() {
            Next::At(to)
        } else if read_u8(self.image, self.layout.context + context::ON_EMPTY) == 0 {
            Next::Suspend(to)
        } else {
            Next::Trap(TrapCode::Timeout)
        }
    }

    /// Jumps between two statements. A jump back passes a safepoint.
    fn jump(&mut self, from: usize, to: usize) -> Next {
        if to <= from { self.safepoint(to) } else { Next::At(to) }
    }

    fn call(&mut self, from: usize, to: usize) -> Next {
        let depth = self.depth();
        if depth >= context::MAX_DEPTH {
            return Next::Trap(TrapCode::CallDepth);
        }
        let slot = self.layout.context + context::SITES + u32::from(depth) * 4;
        let number = self.calls.binary_search(&from).unwrap_or(usize::MAX);
        write_u32(self.image, slot, number as u32);
        self.set_depth(depth + 1);
        self.safepoint(to)
    }

    /// The statement of the label whose number is in BCD in the word `at` of F. `None` if there
    /// is none. F0080 and F0082 are written.
    fn named_label(&mut self, at: u16) -> Option<usize> {
        let word = self.word(Word::Bytes { space: Space::F, byte: at });
        let Some(label) = from_bcd(word) else {
            self.set_address_flags(false, true);
            return None;
        };
        let target =
            if INDIRECT_LABELS.contains(&label) { self.program.target(label) } else { None };
        self.set_address_flags(target.is_none(), false);
        target
    }

    /// Runs the statement `op` with the index `at`. Those with a register area are run by the
    /// caller.
    #[inline(always)]
    pub(super) fn step(&mut self, at: usize, op: &Op) -> Next {
        match *op {
            Op::Set(bit) => self.set(bit, true),
            Op::Clear(bit) => self.set(bit, false),
            Op::Count { counter, up } => {
                let counter = Word::Q(counter);
                let step = if up { 1 } else { u16::MAX };
                let value = self.word(counter).wrapping_add(step);
                self.set_word(counter, value);
            }
            Op::Load(operand) => self.op = self.operand(operand).unwrap_or(self.op),
            Op::Store { negate, place: variable } => {
                self.update(variable, false, |_, op| (if negate { !op } else { op }, None));
            }
            Op::Arith { op, operand } => {
                let Some(value) = self.operand(operand) else { return Next::At(at + 1) };
                if let Operand::Load { place: Variable::Bit(_), .. } = operand {
                    // AND with a bit changes only bit 0 of OP.
                    let value = if op == Arith::And { 0xFFFE | value } else { value };
                    self.arith(op, self.op, value);
                } else {
                    self.arith(op, self.op, value);
                }
            }
            Op::Update { op, negate, place: variable } => {
                self.update(variable, true, |old, with| {
                    let old = if negate { !old } else { old };
                    match op {
                        Arith::And => (old & with, None),
                        Arith::Or => (old | with, None),
                        Arith::Xor => (old ^ with, None),
                        Arith::Add | Arith::Sub | Arith::Mul | Arith::Div => {
                            let (value, carry) = sum(op, old, with);
                            (value, Some(carry))
                        }
                    }
                })
            }
            Op::Shift { left: true, by } => self.op <<= by,
            Op::Shift { left: false, by } => self.op >>= by,
            Op::Bin => self.bin(),
            Op::Bcd => self.bcd(),
            Op::Push(slot) => {
                write_u16(self.image, self.layout.scratch + u32::from(slot) * 2, self.op);
            }
            Op::Apply { op, slot } => {
                let kept = read_u16(self.image, self.layout.scratch + u32::from(slot) * 2);
                self.arith(op, kept, self.op);
            }
            Op::If { first, count, otherwise } => {
                if !self.condition(first, count) {
                    return Next::At(otherwise as usize + 1);
                }
            }
            Op::Else { end } => return Next::At(end as usize + 1),
            Op::Goto(label) => {
                let Some(to) = self.program.target(label) else { return Next::End };
                return self.jump(at, to);
            }
            Op::GotoIndirect(word) => {
                if let Some(to) = self.named_label(word) {
                    return self.jump(at, to);
                }
            }
            Op::Call(label) => {
                let Some(to) = self.program.target(label) else { return Next::End };
                return self.call(at, to);
            }
            Op::CallIndirect(word) => {
                if let Some(to) = self.named_label(word) {
                    return self.call(at, to);
                }
            }
            Op::Return => {
                let Some(depth) = self.depth().checked_sub(1) else { return Next::End };
                self.set_depth(depth);
                let slot = self.layout.context + context::SITES + u32::from(depth) * 4;
                let number = read_u32(self.image, slot) as usize;
                let Some(call) = self.calls.get(number) else {
                    return Next::Trap(TrapCode::Internal);
                };
                return Next::At(call + 1);
            }
            Op::End(_) => return Next::End,
            Op::EndIf | Op::Label(_) | Op::Text | Op::Area { .. } | Op::Bad { .. } => {}
        }
        Next::At(at + 1)
    }
}
