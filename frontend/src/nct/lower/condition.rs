//! Lowers conditions (NCT 4.2 to 4.4, 4.10) to expressions without branches. If all that depends on
//! a condition is a few bits that are set or cleared, that has no branches either.

use plcc_ir::{Address, BinaryOp, InstBuilder, IntCond, Type, Value};

use super::{Lowerer, Result};
use crate::common::{BrokenInvariant, OrMissing};
use crate::nct::ast::{Arith, Bit, ConditionPart, Op, Relation, Space, Test};

/// If a condition switches no more bits than this, in both parts together, it is lowered without
/// branches.
const MAX_SWITCHED: usize = 6;
/// After this many parts of a condition its code may be cut, so that another function begins.
const PARTS_BETWEEN_CUTS: u32 = 256;

/// A result that waits for its gate.
#[derive(Clone, Copy)]
enum Waiting {
    /// In a value of the IR.
    Value(Value),
    /// In the image, in the region `waiting`.
    Kept,
}

/// A statement that switches a bit.
#[derive(Clone, Copy)]
struct Switch {
    bit: Bit,
    on: bool,
}

impl Lowerer<'_> {
    /// Lowers a condition, and what depends on it if that needs no branch. Returns the index of the
    /// statement to lower next.
    pub(super) fn conditional(
        &mut self,
        at: usize,
        first: u32,
        count: u32,
        otherwise: usize,
    ) -> Result<usize> {
        let holds = self.condition(at, first, count)?;
        if let Some((then, other, next)) = self.switches(at, otherwise) {
            self.switch_all(holds, &then, &other)?;
            return Ok(next);
        }
        let live = self.live_at(at);
        self.leave(live);
        let then = self.builder.place();
        let to = self.place(otherwise + 1);
        self.builder.brif(holds, then, to);
        self.bind(then);
        Ok(at + 1)
    }

    /// The bits that the two parts of a condition switch, and the index of the statement after its
    /// `Z`. `None` if they do anything else, if something jumps into them, or if there are too
    /// many.
    fn switches(&self, at: usize, otherwise: usize) -> Option<(Vec<Switch>, Vec<Switch>, usize)> {
        let then = self.switches_in(at + 1, otherwise)?;
        let end = match self.program.stmts.get(otherwise)?.op {
            Op::Else { end } => end as usize,
            _ => otherwise,
        };
        let other = if end == otherwise { vec![] } else { self.switches_in(otherwise + 1, end)? };
        let free = (at + 1..=end).all(|at| self.places.get(at).is_none_or(Option::is_none));
        (free && then.len() + other.len() <= MAX_SWITCHED).then_some((then, other, end + 1))
    }

    /// The bits that a range of statements switches, if they do nothing else.
    fn switches_in(&self, from: usize, to: usize) -> Option<Vec<Switch>> {
        if to - from > MAX_SWITCHED {
            return None;
        }
        let switch = |op: &Op| match *op {
            Op::Set(bit) if bit.space != Space::O => Some(Switch { bit, on: true }),
            Op::Clear(bit) if bit.space != Space::O => Some(Switch { bit, on: false }),
            _ => None,
        };
        self.program.stmts.get(from..to)?.iter().map(|stmt| switch(&stmt.op)).collect()
    }

    /// Switches bits without branches: those of `then` if `holds`, otherwise those of `other`.
    fn switch_all(&mut self, holds: Value, then: &[Switch], other: &[Switch]) -> Result {
        let fails = self.not(holds);
        if let ([a], [b]) = (then, other)
            && a.bit == b.bit
            && a.on != b.on
        {
            return self.store_bit(a.bit, if a.on { holds } else { fails });
        }
        let then = then.iter().map(|switch| (switch, holds, fails));
        let other = other.iter().map(|switch| (switch, fails, holds));
        for (switch, when, unless) in then.chain(other) {
            let old = self.bit(switch.bit)?;
            let (op, with) = if switch.on { (BinaryOp::Or, when) } else { (BinaryOp::And, unless) };
            let value = self.builder.func().binary(op, old, with);
            self.store_bit(switch.bit, value)?;
        }
        Ok(())
    }

    /// A condition's result, an i1.
    fn condition(&mut self, at: usize, first: u32, count: u32) -> Result<Value> {
        let mut waiting: Vec<Waiting> = vec![];
        for part in 0..count {
            if part % PARTS_BETWEEN_CUTS == PARTS_BETWEEN_CUTS - 1 {
                self.keep(&mut waiting);
                self.begin(at)?;
            }
            let cond = self.program.condition_parts.get((first + part) as usize);
            let value = match cond.or_missing(|| "a part of a condition")? {
                ConditionPart::Test(test) => self.test(*test)?,
                ConditionPart::Gate(gate) => {
                    let b = self.take(&mut waiting)?;
                    let a = self.take(&mut waiting)?;
                    let op = match gate {
                        Arith::And => BinaryOp::And,
                        Arith::Or => BinaryOp::Or,
                        _ => BinaryOp::Xor,
                    };
                    self.builder.func().binary(op, a, b)
                }
            };
            waiting.push(Waiting::Value(value));
        }
        self.take(&mut waiting)
    }

    /// Stores the results that wait in the image, so that the code can be cut.
    fn keep(&mut self, waiting: &mut [Waiting]) {
        for (slot, part) in waiting.iter_mut().enumerate() {
            if let Waiting::Value(value) = *part {
                let at = Address::fixed(self.regions.waiting, slot as u32);
                self.builder.func().store(at, value);
                *part = Waiting::Kept;
            }
        }
    }

    /// Takes the last result that waits, an i1.
    fn take(&mut self, waiting: &mut Vec<Waiting>) -> Result<Value> {
        match waiting.pop() {
            Some(Waiting::Value(value)) => Ok(value),
            Some(Waiting::Kept) => {
                let at = Address::fixed(self.regions.waiting, waiting.len() as u32);
                Ok(self.builder.func().load(Type::I1, at))
            }
            None => Err(BrokenInvariant::missing("an operand of a condition")),
        }
    }

    /// The result of a test, an i1.
    fn test(&mut self, test: Test) -> Result<Value> {
        match test {
            Test::Bit { negate, bit } => {
                let value = self.bit(bit)?;
                Ok(if negate { self.not(value) } else { value })
            }
            Test::Word { negate, word } => {
                let value = self.word(word)?;
                let how = if negate { IntCond::Eq } else { IntCond::Ne };
                Ok(self.builder.func().icmp_imm(how, value, 0))
            }
            Test::Relation { relation, operand } => {
                let (with, guard) = self.operand(operand)?;
                let op = self.op();
                let how = match relation {
                    Relation::Lt => IntCond::Ult,
                    Relation::Gt => IntCond::Ugt,
                    Relation::Eq => IntCond::Eq,
                    Relation::Le => IntCond::Ule,
                    Relation::Ge => IntCond::Uge,
                };
                let holds = self.builder.func().icmp(how, op, with);
                Ok(match guard {
                    Some(guard) => self.both(holds, guard),
                    None => holds,
                })
            }
        }
    }
}
