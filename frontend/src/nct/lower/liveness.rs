//! Liveness of OP and of the status flags before each statement. What is overwritten before
//! anything can read it need not be computed.
//!
//! The statements are walked once, backwards. It is assumed that everything can be read after the
//! end of a module, a return, a call, a jump back and an indirect jump, by an indirect access to F
//! (but for OP), and by a statement with a register area.

use crate::nct::{
    ast::{Arith, Bit, ConditionPart, Op, Operand, Program, Space, Test, Variable, Word},
    status_flags,
};

/// A set of OP and status flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct LiveSet(u16);

impl LiveSet {
    pub(crate) const NONE: Self = Self(0);
    pub(crate) const OP: Self = Self(1);
    pub(crate) const CARRY: Self = Self(2);
    pub(crate) const ZERO: Self = Self(4);
    pub(crate) const SIGN: Self = Self(8);
    pub(crate) const OVERFLOW: Self = Self(16);
    pub(crate) const SYNTAX: Self = Self(32);
    pub(crate) const NOT_BCD: Self = Self(64);
    pub(crate) const MUL_OVERFLOW: Self = Self(128);
    /// F000 and F001.
    pub(crate) const HIGH: Self = Self(256);
    pub(crate) const ALL: Self = Self(511);
    /// What a sum or difference writes.
    const SUM: Self = Self(2 | 4 | 8);
    /// What an indirect access writes.
    const INDIRECT: Self = Self(32 | 64);

    /// Whether the two sets have a member in common.
    pub(crate) fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// The members of both sets.
    fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The members that are not in the other set.
    fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

/// Each status flag and the set of it alone.
const FLAGS: [(Bit, LiveSet); 7] = [
    (status_flags::CARRY, LiveSet::CARRY),
    (status_flags::ZERO, LiveSet::ZERO),
    (status_flags::SIGN, LiveSet::SIGN),
    (status_flags::OVERFLOW, LiveSet::OVERFLOW),
    (status_flags::SYNTAX, LiveSet::SYNTAX),
    (status_flags::NOT_BCD, LiveSet::NOT_BCD),
    (status_flags::MUL_OVERFLOW, LiveSet::MUL_OVERFLOW),
];

/// The members that lie in a byte of F.
fn of_byte(byte: u16) -> LiveSet {
    let flags = FLAGS.iter().filter(|(bit, _)| bit.byte == byte);
    let high = if byte <= 1 { LiveSet::HIGH } else { LiveSet::NONE };
    flags.fold(high, |all, &(_, set)| all.union(set))
}

/// The member that a bit is or lies in.
fn of_bit(bit: Bit) -> LiveSet {
    if bit.space == Space::F && bit.byte <= 1 {
        return LiveSet::HIGH;
    }
    FLAGS.iter().find(|&&(flag, _)| flag == bit).map_or(LiveSet::NONE, |&(_, set)| set)
}

/// What is read of the members when a variable is read.
fn read(variable: Variable) -> LiveSet {
    match variable {
        Variable::Bit(bit) => of_bit(bit),
        Variable::Word(Word::Bytes { space: Space::F, byte }) => {
            of_byte(byte).union(of_byte(byte + 1))
        }
        Variable::Word(Word::Indirect(_)) => LiveSet::ALL.without(LiveSet::OP),
        Variable::Word(_) => LiveSet::NONE,
    }
}

/// What is overwritten of the members when a variable is written.
fn replaced(variable: Variable) -> LiveSet {
    match variable {
        // The other bits of F000 and F001 stay what they were.
        Variable::Bit(bit) => of_bit(bit).without(LiveSet::HIGH),
        Variable::Word(Word::Bytes { space: Space::F, byte }) => {
            let whole = of_byte(byte).union(of_byte(byte + 1));
            if byte == 0 { whole } else { whole.without(LiveSet::HIGH) }
        }
        Variable::Word(_) => LiveSet::NONE,
    }
}

fn is_indirect(variable: Variable) -> bool {
    matches!(variable, Variable::Word(Word::Indirect(_)))
}

/// What loading an operand reads and overwrites, and whether it is always done: an indirect load is
/// not done if its address is not valid.
fn operand(operand: Operand) -> (LiveSet, LiveSet, bool) {
    match operand {
        Operand::Const(_) => (LiveSet::NONE, LiveSet::NONE, true),
        Operand::Load { place: variable, .. } if is_indirect(variable) => {
            (read(variable), LiveSet::INDIRECT, false)
        }
        Operand::Load { place: variable, .. } => (read(variable), LiveSet::NONE, true),
    }
}

/// What an operation reads and overwrites, apart from OP.
fn arith(op: Arith) -> (LiveSet, LiveSet) {
    match op {
        Arith::Add | Arith::Sub => (LiveSet::NONE, LiveSet::SUM),
        Arith::Mul => (LiveSet::NONE, LiveSet::MUL_OVERFLOW.union(LiveSet::HIGH)),
        // A division by zero does not write the remainder.
        Arith::Div => (LiveSet::HIGH, LiveSet::SYNTAX),
        Arith::And | Arith::Or | Arith::Xor => (LiveSet::NONE, LiveSet::NONE),
    }
}

/// The live set before each statement; one more entry stands for the text's end.
pub(crate) fn liveness(program: &Program) -> Vec<LiveSet> {
    let count = program.stmts.len();
    let mut live = vec![LiveSet::ALL; count + 1];
    for (at, stmt) in program.stmts.iter().enumerate().rev() {
        let live_after = |at: u32| live.get(at as usize + 1).copied().unwrap_or(LiveSet::ALL);
        let next = live_after(at as u32);
        let before = match stmt.op {
            Op::If { first, count, otherwise } => {
                let mut set = next.union(live_after(otherwise));
                let range = first as usize..(first + count) as usize;
                for cond in program.condition_parts.get(range).unwrap_or_default() {
                    set = set.union(condition(cond));
                }
                set
            }
            Op::Else { end } => live_after(end),
            Op::Goto(label) => match program.labels.get(label as usize) {
                Some(Some(to)) if *to as usize > at => {
                    live.get(*to as usize).copied().unwrap_or(LiveSet::ALL)
                }
                _ => LiveSet::ALL,
            },
            ref op => step(op, next),
        };
        if let Some(slot) = live.get_mut(at) {
            *slot = before;
        }
    }
    live
}

/// What a part of a condition reads.
fn condition(cond: &ConditionPart) -> LiveSet {
    match *cond {
        ConditionPart::Test(Test::Bit { bit, .. }) => of_bit(bit),
        ConditionPart::Test(Test::Relation { operand: with, .. }) => {
            operand(with).0.union(LiveSet::OP)
        }
        ConditionPart::Test(Test::Word { .. }) | ConditionPart::Gate(_) => LiveSet::NONE,
    }
}

/// The live set before a statement, if `after` is the one before the next.
fn step(op: &Op, after: LiveSet) -> LiveSet {
    match *op {
        Op::Set(bit) | Op::Clear(bit) => after.without(replaced(Variable::Bit(bit))),
        Op::Load(from) => {
            let (reads, replaces, done) = operand(from);
            let replaces = if done { replaces.union(LiveSet::OP) } else { replaces };
            after.without(replaces).union(reads)
        }
        Op::Store { place: variable, .. } => {
            let reads = if is_indirect(variable) { read(variable) } else { LiveSet::NONE };
            after.without(replaced(variable)).union(reads).union(LiveSet::OP)
        }
        Op::Arith { op, operand: from } => {
            let (reads, replaces, done) = operand(from);
            let (looks, writes) = arith(op);
            let after = if done { after.without(writes) } else { after };
            after.without(replaces).union(reads).union(looks).union(LiveSet::OP)
        }
        Op::Update { op, place: variable, .. } => {
            let writes = if is_indirect(variable) { LiveSet::NONE } else { arith(op).1 };
            after.without(writes).union(read(variable)).union(LiveSet::OP)
        }
        Op::Apply { op, .. } => {
            let (looks, writes) = arith(op);
            after.without(writes).union(looks).union(LiveSet::OP)
        }
        Op::Shift { .. } | Op::Push(_) => after.union(LiveSet::OP),
        Op::Bin | Op::Bcd => after.union(LiveSet::OP),
        Op::Count { .. } | Op::EndIf | Op::Label(_) | Op::Text => after,
        Op::Area { .. }
        | Op::GotoIndirect(_)
        | Op::Call(_)
        | Op::CallIndirect(_)
        | Op::Return
        | Op::End(_)
        | Op::Bad { .. }
        | Op::If { .. }
        | Op::Else { .. }
        | Op::Goto(_) => LiveSet::ALL,
    }
}
