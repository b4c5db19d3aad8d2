//! Values that stand for others.

use crate::{FuncData, InstData, Terminator, Value};

/// Which value stands for which. Uses are put right where they are visited, so a value is
/// replaced before its uses are: definitions come first.
pub(super) struct Substitution(Vec<Value>);

impl Substitution {
    /// Every value stands for itself.
    pub(super) fn new(func: &FuncData) -> Self {
        Self((0..func.value_count() as u32).map(Value).collect())
    }

    /// From now on `by` is used for `value`.
    pub(super) fn replace(&mut self, value: Value, by: Value) {
        let by = self.get(by);
        if let Some(slot) = self.0.get_mut(value.index()) {
            *slot = by;
        }
    }

    /// What stands for a value. Values made after this table stand for themselves.
    pub(super) fn get(&self, value: Value) -> Value {
        self.0.get(value.index()).copied().unwrap_or(value)
    }

    /// Puts an instruction's operands right.
    pub(super) fn inst(&self, data: &mut InstData) {
        data.for_each_arg_mut(|value| *value = self.get(*value));
    }

    /// Puts a terminator's operands right.
    pub(super) fn terminator(&self, terminator: &mut Terminator) {
        terminator.for_each_arg_mut(|value| *value = self.get(*value));
    }
}
