//! Liveness of OP and of the status flags before each statement: what is overwritten before
//! anything can read it need not be computed.
//!
//! One walk backwards over the flat statements. Whatever leaves the straight way (a module's end,
//! a return, a call, a jump back, an indirect one) may read everything, and so may an indirect
//! access to F and every statement with a register area.

use crate::nct::{
    ast::{Arith, Bit, Cond, Op, Operand, Place, Program, Space, Test, Word},
    status_flags,
};

/// A set of OP and status flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Set(u16);

impl Set {
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
    const SUM: Self = Self(2 | 4 | 8);
    const INDIRECT: Self = Self(32 | 64);

    pub(crate) fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

/// Each status flag and its set.
const FLAGS: [(Bit, Set); 7] = [
    (status_flags::CARRY, Set::CARRY),
    (status_flags::ZERO, Set::ZERO),
    (status_flags::SIGN, Set::SIGN),
    (status_flags::OVERFLOW, Set::OVERFLOW),
    (status_flags::SYNTAX, Set::SYNTAX),
    (status_flags::NOT_BCD, Set::NOT_BCD),
    (status_flags::MUL_OVERFLOW, Set::MUL_OVERFLOW),
];

/// The status flags in a byte of F.
fn of_byte(byte: u16) -> Set {
    let flags = FLAGS.iter().filter(|(bit, _)| bit.byte == byte);
    let high = if byte <= 1 { Set::HIGH } else { Set::NONE };
    flags.fold(high, |all, &(_, set)| all.and(set))
}

/// The status flag that a bit is, or the register that it lies in.
fn of_bit(bit: Bit) -> Set {
    if bit.space == Space::F && bit.byte <= 1 {
        return Set::HIGH;
    }
    FLAGS.iter().find(|&&(flag, _)| flag == bit).map_or(Set::NONE, |&(_, set)| set)
}

/// What reading a variable looks at.
fn read(place: Place) -> Set {
    match place {
        Place::Bit(bit) => of_bit(bit),
        Place::Word(Word::Bytes { space: Space::F, byte }) => of_byte(byte).and(of_byte(byte + 1)),
        Place::Word(Word::Indirect(_)) => Set::ALL.without(Set::OP),
        Place::Word(_) => Set::NONE,
    }
}

/// What writing a variable surely replaces.
fn replaced(place: Place) -> Set {
    match place {
        // A bit of F000 or F001 leaves the others.
        Place::Bit(bit) => of_bit(bit).without(Set::HIGH),
        Place::Word(Word::Bytes { space: Space::F, byte }) => {
            let whole = of_byte(byte).and(of_byte(byte + 1));
            if byte == 0 { whole } else { whole.without(Set::HIGH) }
        }
        Place::Word(_) => Set::NONE,
    }
}

fn is_indirect(place: Place) -> bool {
    matches!(place, Place::Word(Word::Indirect(_)))
}

/// What a load looks at and replaces.
fn operand(operand: Operand) -> (Set, Set, bool) {
    match operand {
        Operand::Const(_) => (Set::NONE, Set::NONE, true),
        Operand::Load { place, .. } if is_indirect(place) => (read(place), Set::INDIRECT, false),
        Operand::Load { place, .. } => (read(place), Set::NONE, true),
    }
}

/// What an operation looks at and, where it is done at all, replaces; OP aside.
fn arith(op: Arith) -> (Set, Set) {
    match op {
        Arith::Add | Arith::Sub => (Set::NONE, Set::SUM),
        Arith::Mul => (Set::NONE, Set::MUL_OVERFLOW.and(Set::HIGH)),
        // By zero the remainder stays what it was.
        Arith::Div => (Set::HIGH, Set::SYNTAX),
        Arith::And | Arith::Or | Arith::Xor => (Set::NONE, Set::NONE),
    }
}

/// The live set before each statement; one more entry stands for the text's end.
pub(crate) fn liveness(program: &Program) -> Vec<Set> {
    let count = program.stmts.len();
    let mut live = vec![Set::ALL; count + 1];
    for (at, stmt) in program.stmts.iter().enumerate().rev() {
        let behind = |at: u32| live.get(at as usize + 1).copied().unwrap_or(Set::ALL);
        let next = behind(at as u32);
        let before = match stmt.op {
            Op::If { first, count, otherwise } => {
                let mut set = next.and(behind(otherwise));
                let range = first as usize..(first + count) as usize;
                for cond in program.conds.get(range).unwrap_or_default() {
                    set = set.and(condition(cond));
                }
                set
            }
            Op::Else { end } => behind(end),
            Op::Goto(label) => match program.labels.get(label as usize) {
                Some(Some(to)) if *to as usize > at => {
                    live.get(*to as usize).copied().unwrap_or(Set::ALL)
                }
                _ => Set::ALL,
            },
            ref op => step(op, next),
        };
        if let Some(slot) = live.get_mut(at) {
            *slot = before;
        }
    }
    live
}

fn condition(cond: &Cond) -> Set {
    match *cond {
        Cond::Test(Test::Bit { bit, .. }) => of_bit(bit),
        Cond::Test(Test::Relation { operand: with, .. }) => operand(with).0.and(Set::OP),
        Cond::Test(Test::Word { .. }) | Cond::Gate(_) => Set::NONE,
    }
}

/// What may be looked at before a statement that is followed by the next one.
fn step(op: &Op, after: Set) -> Set {
    match *op {
        Op::Set(bit) | Op::Clear(bit) => after.without(replaced(Place::Bit(bit))),
        Op::Load(from) => {
            let (reads, replaces, done) = operand(from);
            let replaces = if done { replaces.and(Set::OP) } else { replaces };
            after.without(replaces).and(reads)
        }
        Op::Store { place, .. } => {
            let reads = if is_indirect(place) { read(place) } else { Set::NONE };
            after.without(replaced(place)).and(reads).and(Set::OP)
        }
        Op::Arith { op, operand: from } => {
            let (reads, replaces, done) = operand(from);
            let (looks, writes) = arith(op);
            let after = if done { after.without(writes) } else { after };
            after.without(replaces).and(reads).and(looks).and(Set::OP)
        }
        Op::Update { op, place, .. } => {
            let writes = if is_indirect(place) { Set::NONE } else { arith(op).1 };
            after.without(writes).and(read(place)).and(Set::OP)
        }
        Op::Apply { op, .. } => {
            let (looks, writes) = arith(op);
            after.without(writes).and(looks).and(Set::OP)
        }
        Op::Shift { .. } | Op::Push(_) => after.and(Set::OP),
        Op::Bin | Op::Bcd => after.and(Set::OP),
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
        | Op::Goto(_) => Set::ALL,
    }
}
