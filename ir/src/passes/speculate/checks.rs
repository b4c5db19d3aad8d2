//! What a statement has to check, and what is known without a check.

use plcc_abi::IntegerForm;

use super::super::float_range::FloatRange;
use super::Speculate;
use crate::{Address, BinaryOp, Inst, InstData, UnaryOp, Value};

/// A stretch has at most this many instructions, so that the pass takes time in proportion to the length of a function.
pub(super) const MAX_STRETCH: usize = 200;

/// To see how a double is computed, its definition is followed back this far.
const MAX_STEPS: u32 = 4;

/// How it is checked whether a double is an integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Check {
    /// Whether it is an integer of 32 bits. This takes the shortest code.
    Narrow,
    /// Whether it is an integer from -2^50 to 2^50 - 1.
    Wide,
    /// Whether it is less than 0.5 away from such an integer, which then takes its place as the operand of
    /// operations that round it to the nearest integer ([`IntegerForm::Bits`]), and nowhere else.
    Rounded,
}

/// How a double is computed, as far as it shows what numbers to expect.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum ValueClass {
    /// By operations that make integers of 32 bits of integers as small as variables usually hold.
    Plain,
    /// By a product of two variables, among others, which may be a larger integer.
    Product,
    /// By a quotient, a function or a factor with a fraction, among others.
    Fraction,
}

/// A variable that holds an integer of 32 bits.
#[derive(Clone, Copy)]
pub(super) struct KnownInteger {
    pub(super) at: Address,
    /// The double that it holds.
    pub(super) double: Value,
    pub(super) range: FloatRange,
}

/// The checks that a statement needs.
pub(super) struct Checks<'a> {
    /// The statement's instructions before the first that has an effect.
    pub(super) insts: &'a [Inst],
    /// The loads that read the same as an earlier load, each with that one.
    pub(super) same: Vec<(Value, Value)>,
    /// The loads of variables of which it is known that they hold integers, each with what is known.
    pub(super) known: Vec<(Value, KnownInteger)>,
    /// The values that are checked, each with the kind of check.
    pub(super) values: Vec<(Value, Check)>,
    /// How many of the statement's instructions are copied, from the first on.
    pub(super) end: usize,
}

impl Checks<'_> {
    /// The earlier load that reads the same as this value; the value itself if there is none.
    pub(super) fn first_load(&self, value: Value) -> Value {
        self.same.iter().find(|(again, _)| *again == value).map_or(value, |&(_, first)| first)
    }

    /// What is known of the variable that a load reads.
    pub(super) fn known(&self, value: Value) -> Option<KnownInteger> {
        let value = self.first_load(value);
        self.known.iter().find(|(load, _)| *load == value).map(|&(_, known)| known)
    }

    /// The check of a value, if it has one.
    pub(super) fn check(&self, value: Value) -> Option<Check> {
        let value = self.first_load(value);
        self.values.iter().find(|(checked, _)| *checked == value).map(|&(_, check)| check)
    }
}

impl Speculate<'_> {
    /// Whether an operation is faster on integers, and single operands of it may be checked.
    pub(super) fn is_faster_on_integers(&self, data: &InstData) -> bool {
        let InstData::HostCall { function: _, args } = data else { return false };
        match data.integer_form() {
            Some(IntegerForm::And | IntegerForm::Or | IntegerForm::Xor | IntegerForm::Bits) => true,
            Some(IntegerForm::Modulo) => {
                let by = args.as_slice().get(1).and_then(|&by| self.floats.get(by).integers());
                by.is_some_and(|(low, high)| low == high && low != 0)
            }
            _ => false,
        }
    }

    /// The check that most values of an operation's operands pass; `None` for a remainder whose
    /// dividend probably has a fraction.
    pub(super) fn check_for(&self, form: Option<IntegerForm>, operands: &[Value]) -> Option<Check> {
        let nature = operands.iter().map(|&value| self.class_of(value, MAX_STEPS)).max();
        match (form, nature.unwrap_or(ValueClass::Plain)) {
            (_, ValueClass::Plain) => Some(Check::Narrow),
            (Some(IntegerForm::Bits), _) => Some(Check::Rounded),
            (Some(IntegerForm::Modulo), ValueClass::Fraction) => None,
            (Some(IntegerForm::Modulo), ValueClass::Product) => Some(Check::Wide),
            // Bit operators are seldom used on fractions and on more than 32 bits.
            _ => Some(Check::Narrow),
        }
    }

    /// How a double is computed. Its definition is followed back through at most `steps`
    /// instructions.
    fn class_of(&self, value: Value, steps: u32) -> ValueClass {
        let Some(data) = self.func.def_inst(value) else { return ValueClass::Plain };
        let of = |value| match steps {
            0 => ValueClass::Plain,
            _ => self.class_of(value, steps - 1),
        };
        match *data {
            InstData::Fconst { .. } if self.floats.get(value).integers().is_none() => {
                ValueClass::Fraction
            }
            InstData::Unary { op: UnaryOp::Fsqrt, arg: _ } => ValueClass::Fraction,
            InstData::Unary { op: UnaryOp::Ffloor | UnaryOp::Fceil | UnaryOp::Ftrunc, arg: _ } => {
                ValueClass::Plain
            }
            InstData::Unary { op: _, arg } => of(arg),
            InstData::Binary { op: BinaryOp::Fdiv, args: _ } => ValueClass::Fraction,
            InstData::Binary { op, args: [a, b] } => {
                let nature = of(a).max(of(b));
                let is_constant = |value| self.func.constant(value).is_some();
                if op == BinaryOp::Fmul && !is_constant(a) && !is_constant(b) {
                    nature.max(ValueClass::Product)
                } else {
                    nature
                }
            }
            InstData::HostCall { function, args: _ } if function.is_pure() => {
                let integer = function.integer_form().is_some();
                if integer { ValueClass::Plain } else { ValueClass::Fraction }
            }
            _ => ValueClass::Plain,
        }
    }
}
