//! Resolved statements: what the statement interpreter walks.
//!
//! Names are resolved to places once, before the first scan. An expression is a row of operations
//! that work on one current value; a stack keeps earlier values that operators still need. An operator whose
//! right operand is a variable or a number holds that operand:
//!
//! | source | operations |
//! | --- | --- |
//! | `P1+P2*3` | `Load(P1)`, `Push(P2)`, `Binary(Mul, 3)`, `BinaryWaiting(Add)` |
//! | `SIN(P1)>0` | `Load(P1)`, `Call(Sin)`, `Compare(Gt, 0)` |

use plcc_abi::pmac::{Field, Format, Kind, PlcOp, Space};

use crate::pmac::ast::{Bin, Cmp, Func};

/// A field of a word in the image that holds a binary number, with or without a sign.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bits {
    /// The word's offset.
    pub(super) offset: u32,
    /// By how many bits the word is shifted left, so that the field is at its top, and then right.
    left: u8,
    right: u8,
    signed: bool,
}

impl Bits {
    /// The field of the word at an offset of the image; `None` for the decimal formats.
    pub(super) fn new(offset: u32, field: Field) -> Option<Self> {
        let (signed, width) = match field.format {
            Format::U => (false, field.width),
            Format::S => (true, field.width),
            Format::D | Format::C => return None,
        };
        let left = 32u8.checked_sub(field.offset.checked_add(width)?)?;
        Some(Self { offset, left, right: 32u8.checked_sub(width)?, signed })
    }

    /// The field's value in a word.
    #[inline(always)]
    pub(super) fn of(self, word: u32) -> i32 {
        let high = word.wrapping_shl(self.left.into());
        match self.signed {
            true => (high as i32).wrapping_shr(self.right.into()),
            false => high.wrapping_shr(self.right.into()) as i32,
        }
    }
}

/// An L-variable.
#[derive(Clone, Copy, Debug)]
pub(super) struct LVariable {
    pub(super) number: u16,
    pub(super) space: Space,
    pub(super) address: u32,
    pub(super) field: Field,
    /// Its word's offset, where that is a plain word in the image.
    pub(super) offset: Option<u32>,
}

/// What an operation reads.
#[derive(Clone, Copy, Debug)]
pub(super) enum Operand {
    Constant(f64),
    /// A P- or I-variable: its double's offset in the image.
    Double(u32),
    /// A Q-variable of the addressed coordinate system.
    Q(u32),
    /// An M-variable that is a field of a word while its definition is the one after load: its
    /// number, and that field.
    Field(u16, Bits),
    /// Any other M-variable.
    M(u32),
    /// An L-variable: its index in the table.
    L(u32),
}

/// What an operation of an integer statement reads.
#[derive(Clone, Copy, Debug)]
pub(super) enum IntegerOperand {
    Constant(i32),
    /// An L-variable that is a field of a word in the image: its number, and that field.
    Bits(u16, Bits),
    /// An L-variable: its index in the table.
    L(u32),
}

/// An operation of an expression or condition that works on [`Operand`]s, or of a statement of L-variables on
/// [`IntegerOperand`]s.
#[derive(Clone, Copy, Debug)]
pub(super) enum Operation<T> {
    /// The operand becomes the current value: the first one of the expression.
    Load(T),
    /// Pushes the current value onto the stack; the operand becomes the current value.
    Push(T),
    /// An operator on the current value and an operand.
    Binary(Bin, T),
    /// An operator on the value on top of the stack, which is popped, and the current one.
    BinaryWaiting(Bin),
    /// A comparator on the current value and an operand.
    Compare(Cmp, T),
    /// A comparator on the value on top of the stack, which is popped, and the current one.
    CompareWaiting(Cmp),
    Negate,
    Call(Func),
    /// The variable of the kind whose number is the current value.
    Indirect(Kind),
    /// AND of the truth value on top of the stack, which is popped, and the current one.
    Both,
    /// OR of the truth value on top of the stack, which is popped, and the current one.
    Either,
}

/// A range of one of the tables: the operations of an expression, the comparisons of a condition,
/// or the L-variables of an assignment.
#[derive(Clone, Copy, Debug)]
pub(super) struct TableRange {
    start: u32,
    end: u32,
}

impl TableRange {
    /// What was appended to a table since it had `start` elements.
    pub(super) fn since<T>(start: usize, table: &[T]) -> Self {
        Self { start: start as u32, end: table.len() as u32 }
    }

    /// The elements of the table.
    #[inline(always)]
    pub(super) fn of<T>(self, table: &[T]) -> &[T] {
        table.get(self.start as usize..self.end as usize).unwrap_or(&[])
    }
}

/// A comparison of a variable with a number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Comparison {
    pub(super) cmp: Cmp,
    pub(super) left: Operand,
    pub(super) right: f64,
}

impl Comparison {
    /// The comparisons that a condition consists of, if it is nothing but such comparisons joined
    /// by AND.
    pub(super) fn all(operations: &[Operation<Operand>]) -> Option<Vec<Self>> {
        let [Operation::Load(left), Operation::Compare(cmp, Operand::Constant(right)), rest @ ..] =
            operations
        else {
            return None;
        };
        let mut all = vec![Self { cmp: *cmp, left: *left, right: *right }];
        let triples = rest.chunks_exact(3);
        if !triples.remainder().is_empty() {
            return None;
        }
        for triple in triples {
            let [
                Operation::Push(left),
                Operation::Compare(cmp, Operand::Constant(right)),
                Operation::Both,
            ] = triple
            else {
                return None;
            };
            all.push(Self { cmp: *cmp, left: *left, right: *right });
        }
        Some(all)
    }
}

/// What an assignment writes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Destination {
    /// A variable by its number; of an L-variable the index in the table.
    Variable(Kind, u32),
    /// The variable whose number an expression gives.
    Indirect(Kind, TableRange),
    /// `count` variables from `first` on, `step` apart.
    Range { kind: Kind, first: u32, count: u32, step: u32 },
    /// L-variables: their place in the table of ranges of L-variables.
    LVariables(TableRange),
}

/// A statement. Branch targets are indices of statements.
#[derive(Clone, Copy, Debug)]
pub(super) enum Statement {
    Assign(Destination, TableRange),
    /// An assignment to a P-variable: its double's offset.
    AssignDouble(u32, TableRange),
    /// An assignment to an M-variable that is a field while its definition is the one after load:
    /// its number, the offset of the field's word, the field.
    AssignField(u16, u32, Field, TableRange),
    /// An assignment to an L-variable, computed in integers.
    AssignInteger(u32, TableRange),
    /// An assignment to several L-variables, computed in integers.
    AssignIntegers(TableRange, TableRange),
    /// Goes on at the target when the condition is false.
    If(TableRange, u32),
    /// As `If`, for a condition that compares a variable with a number.
    IfComparison(Comparison, u32),
    /// As `If`, for several such comparisons joined by AND.
    IfAll(TableRange, u32),
    /// As `If`, for a condition that is computed in integers.
    IfInteger(TableRange, u32),
    /// As `IfInteger`, for a condition that compares an L-variable with a number.
    IfIntegerComparison(Cmp, IntegerOperand, i32, u32),
    Jump(u32),
    /// Suspends the scan; the next one goes on at the WHILE with this index.
    EndWhile(u32),
    /// ENABLE, DISABLE, PAUSE or RESUME; whether it is for PLCCs; and the programs, bit n for program n.
    Plc(PlcOp, bool, u32),
    /// ADDRESS of a coordinate system.
    Address(u64),
    /// ADDRESS of the coordinate system whose number an expression gives.
    AddressBy(TableRange),
    /// SEND, DISPLAY or COMMAND: the text's index, and the value that a DISPLAY shows.
    Text(u32, Option<TableRange>),
    /// Changes definitions of M-variables; the index is that in the table of such changes.
    Define(u32),
    /// A value into a word.
    Word(Space, u32, TableRange),
    Save,
    /// ADDRESS of a motor.
    AddressMotor(u32),
    /// ADDRESS of the motor whose number an expression gives, and perhaps of a coordinate system.
    AddressBoth(TableRange, Option<TableRange>),
    /// A statement of motion: its number and the place of its values in the table of values.
    Motion(u32, TableRange),
    /// The end of a WHILE in a motion program: the index of the WHILE and the number of the statement of motion.
    Loop(u32, u32),
    Nothing,
}
