//! A table of which value replaces which.
//!
//! A pass that finds that a value is the same as another enters that here, and replaces operands
//! when it comes to the instructions that use them. Since definitions are visited before uses, no
//! list of uses is needed, and one visit of each instruction suffices.

use crate::{FuncData, InstData, PrimaryMap, Terminator, Value};

/// For each value the one that replaces it, or itself.
pub(super) struct Substitution(PrimaryMap<Value, Value>);

impl Substitution {
    /// A table in which no value is replaced.
    pub(super) fn new(func: &FuncData) -> Self {
        Self(func.values.keys().collect())
    }

    /// Replaces `value` by `by`, or by what replaces that.
    pub(super) fn replace(&mut self, value: Value, by: Value) {
        let by = self.get(by);
        if let Some(slot) = self.0.get_mut(value) {
            *slot = by;
        }
    }

    /// The value that replaces a value, or that value itself. Values that were made after this
    /// table are not replaced.
    pub(super) fn get(&self, value: Value) -> Value {
        self.0.get(value).copied().unwrap_or(value)
    }

    /// Replaces the operands of an instruction.
    pub(super) fn inst(&self, data: &mut InstData) {
        data.for_each_arg_mut(|value| *value = self.get(*value));
    }

    /// Replaces the operands of a terminator.
    pub(super) fn terminator(&self, terminator: &mut Terminator) {
        terminator.for_each_arg_mut(|value| *value = self.get(*value));
    }
}
