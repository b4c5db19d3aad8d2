//! What a statement has to check, and what is known without a check.

use super::super::float_range::FloatRange;
use super::plan::Check;
use crate::{Address, Inst, Value};

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
