//! Expressions as the interpreter evaluates them. Each is a [`Row`]: a sequence of codes in postfix order,
//! with names resolved to offsets.
//!
//! The value that was computed last, the current value, is kept in a local variable; earlier values that
//! operators still need are on a stack. AND or OR and a right operand that is a LOGICAL variable are
//! joined to one code, which is faster. Programs that were made from ladder diagrams consist mostly of them.

use plcc_abi::{
    OutOfBoundsAccess,
    pmi::{Type, arithmetic},
};

use crate::common::{Observer, Value};
use crate::pmi::access;
use crate::pmi::ast::{Binary, Op};
use crate::pmi::layout::Location;

impl Location {
    /// Reads the value and tells the observer.
    #[inline(always)]
    fn load<O: Observer>(self, image: &[u8], observer: &mut O) -> i32 {
        let value = self.read(image);
        if observer.is_active() {
            let (variable, told) = (access::accessed(self.offset), self.ty.observed(value));
            observer.read(variable, told);
            return observer.instead(variable, told).number() as i32;
        }
        value
    }
}

/// Makes a value of PMI one for observers.
pub(super) trait Observed {
    fn observed(self, value: i32) -> Value;
}

impl Observed for Type {
    #[inline]
    fn observed(self, value: i32) -> Value {
        match self {
            Type::Logical => Value::Logical(value != 0),
            Type::Integer | Type::Long => Value::Integer(value.into()),
        }
    }
}

/// An array's place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Array {
    pub(super) first: Location,
    pub(super) elements: u32,
}

impl Array {
    /// The place of an element.
    ///
    /// # Errors
    /// When `index` is outside the array.
    pub(super) fn at(self, index: i32) -> Result<Location, OutOfBoundsAccess> {
        let Location { offset, ty } = self.first;
        match u32::try_from(index) {
            Ok(index) if index < self.elements => {
                Ok(Location { offset: offset + index * ty.size(), ty })
            }
            _ => Err(OutOfBoundsAccess { array: offset, index: index as i16 }),
        }
    }
}

/// One code of a row.
#[derive(Clone, Copy, Debug)]
enum Code {
    /// Pushes the current value; a constant becomes the new one.
    Const(i32),
    // The next four push the current value, too. The new one is that of the variable at an offset: a LOGICAL,
    // its NOT, an INTEGER, a LONG.
    Logical(u32),
    NotLogical(u32),
    Integer(u32),
    Long(u32),
    /// Combines the current value with the LOGICAL at an offset, or with its NOT.
    And(u32),
    AndNot(u32),
    Or(u32),
    OrNot(u32),
    /// Takes the current value as an index; the new one is that element of the array with this
    /// number.
    Element(u32),
    Neg16,
    Neg32,
    Not,
    /// Pops the left operand; the current value is the right one.
    Binary(Binary),
}

/// An expression: its range of codes in [`Rows`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    from: u32,
    to: u32,
}

/// All expressions of a program, and the stack on which they are evaluated.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    codes: Vec<Code>,
    arrays: Vec<Array>,
    stack: Vec<i32>,
    /// The element that does not exist and was accessed last.
    pub(super) missing: Option<OutOfBoundsAccess>,
}

impl Rows {
    /// Adds an expression. `location` and `array` give the place of the variable, and of the array,
    /// that an operation names.
    pub(super) fn add(
        &mut self,
        ops: &[Op],
        location: impl Fn(&Op) -> Location,
        array: impl Fn(&Op) -> Array,
    ) -> Row {
        let from = self.codes.len();
        let (mut depth, mut deepest) = (0usize, 0);
        for op in ops {
            let code = match *op {
                Op::Const(value) => Code::Const(value),
                Op::Load(_) | Op::LoadAt(..) => {
                    let Location { offset, ty } = location(op);
                    match ty {
                        Type::Logical => Code::Logical(offset),
                        Type::Integer => Code::Integer(offset),
                        Type::Long => Code::Long(offset),
                    }
                }
                Op::Element(_) => {
                    self.arrays.push(array(op));
                    Code::Element(self.arrays.len() as u32 - 1)
                }
                Op::Neg { long: false } => Code::Neg16,
                Op::Neg { long: true } => Code::Neg32,
                Op::Not => Code::Not,
                Op::Binary(op) => Code::Binary(op),
            };
            match op {
                Op::Binary(_) => depth = depth.saturating_sub(1),
                Op::Element(_) | Op::Neg { .. } | Op::Not => {}
                Op::Const(_) | Op::Load(_) | Op::LoadAt(..) => depth += 1,
            }
            deepest = deepest.max(depth);
            self.put(from, code);
        }
        if self.stack.len() < deepest {
            self.stack.resize(deepest, 0);
        }
        Row { from: from as u32, to: self.codes.len() as u32 }
    }

    /// Adds a code to the row that begins at `from`, or joins it with the row's last code if the two can be one.
    fn put(&mut self, from: usize, code: Code) {
        let last = self.codes.get_mut(from..).and_then(<[Code]>::last_mut);
        match last.and_then(|last| joined(*last, code).map(|one| *last = one)) {
            Some(()) => {}
            None => self.codes.push(code),
        }
    }

    /// The value of an expression; `None` if an index is outside its array. Then `missing` says which.
    pub(super) fn value<O: Observer>(
        &mut self,
        row: Row,
        image: &[u8],
        observer: &mut O,
    ) -> Option<i32> {
        let Self { codes, arrays, stack, missing } = self;
        let codes = codes.get(row.from as usize..row.to as usize).unwrap_or(&[]);
        let stack = stack.as_mut_slice();
        let (mut value, mut waiting) = (0, 0usize);
        for code in codes {
            let next = match *code {
                Code::Const(next) => next,
                Code::Logical(offset) => Location::logical(offset).load(image, observer),
                Code::NotLogical(offset) => Location::logical(offset).load(image, observer) ^ 1,
                Code::Integer(offset) => {
                    Location { offset, ty: Type::Integer }.load(image, observer)
                }
                Code::Long(offset) => Location { offset, ty: Type::Long }.load(image, observer),
                Code::And(offset) => {
                    value = i32::from(value != 0) & Location::logical(offset).load(image, observer);
                    continue;
                }
                Code::AndNot(offset) => {
                    value = i32::from(value != 0)
                        & (Location::logical(offset).load(image, observer) ^ 1);
                    continue;
                }
                Code::Or(offset) => {
                    value = i32::from(value != 0) | Location::logical(offset).load(image, observer);
                    continue;
                }
                Code::OrNot(offset) => {
                    value = i32::from(value != 0)
                        | (Location::logical(offset).load(image, observer) ^ 1);
                    continue;
                }
                Code::Element(array) => {
                    match arrays.get(array as usize)?.at(value) {
                        Ok(element) => value = element.load(image, observer),
                        Err(element) => {
                            *missing = Some(element);
                            return None;
                        }
                    }
                    continue;
                }
                Code::Neg16 => {
                    value = arithmetic::negate(value, false);
                    continue;
                }
                Code::Neg32 => {
                    value = arithmetic::negate(value, true);
                    continue;
                }
                Code::Not => {
                    value = i32::from(value == 0);
                    continue;
                }
                Code::Binary(op) => {
                    waiting = waiting.wrapping_sub(1);
                    let left = stack.get(waiting).copied().unwrap_or(0);
                    value = arithmetic::binary(op, left, value);
                    continue;
                }
            };
            // Before the first code there is no current value. The 0 that is pushed then is never popped.
            if let Some(slot) = stack.get_mut(waiting) {
                *slot = value;
            }
            waiting += 1;
            value = next;
        }
        Some(value)
    }
}

/// Two codes as one: NOT of a LOGICAL, or AND or OR with a LOGICAL as the right operand.
fn joined(last: Code, code: Code) -> Option<Code> {
    Some(match (last, code) {
        (Code::Logical(offset), Code::Not) => Code::NotLogical(offset),
        (Code::Logical(offset), Code::Binary(Binary::And)) => Code::And(offset),
        (Code::NotLogical(offset), Code::Binary(Binary::And)) => Code::AndNot(offset),
        (Code::Logical(offset), Code::Binary(Binary::Or)) => Code::Or(offset),
        (Code::NotLogical(offset), Code::Binary(Binary::Or)) => Code::OrNot(offset),
        _ => return None,
    })
}
