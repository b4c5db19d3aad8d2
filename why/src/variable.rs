//! The variables that an inquiry meets.

use plcc_abi::place::{Direction, Place};
use plcc_frontend::CheckedProgram;
use plcc_frontend::common::{Accessed, Expression, Value};
use plcc_runtime::{Names, Purpose, VariableKey, names::Class};

/// A variable.
#[derive(Clone, Debug)]
pub(crate) struct Variable {
    /// Its name in canonical spelling.
    pub(crate) name: String,
    /// How statements access it; `None` for what none can access.
    pub(crate) accessed: Option<Accessed>,
    /// The key by which an executive reads it; `None` for what is only known while a statement runs.
    pub(crate) key: Option<VariableKey>,
    /// Whether the operator or the machine can set it.
    pub(crate) can_be_set: bool,
    /// Where its value lies, if that is known.
    pub(crate) place: Option<Place>,
    /// Whether it is an input or an output.
    pub(crate) direction: Direction,
    /// Whether its values are 0 and 1 alone.
    pub(crate) is_logical: bool,
    /// The unit of its value; empty where none is known.
    pub(crate) unit: &'static str,
    /// Its value as an expression of the program's language, where neither a key nor a place gives it.
    expression: Option<Expression>,
}

impl Variable {
    /// What names and the program know of a variable.
    pub(crate) fn new(
        names: &dyn Names,
        program: &dyn CheckedProgram,
        name: String,
        accessed: Option<Accessed>,
    ) -> Self {
        let can_be_set = names.find(&name, Purpose::Stimulus).is_ok();
        let key = names.find(&name, Purpose::Watch).ok();
        let properties = key.map(|key| names.properties(key));
        let place = properties.and_then(|it| it.value);
        let is_needed = place.is_none() && !program.is_only_a_name(&name);
        let expression = is_needed.then(|| program.expression(&name).ok()).flatten();
        Self {
            expression,
            accessed,
            key,
            can_be_set,
            place,
            direction: properties.map_or(Direction::Internal, |it| it.direction),
            is_logical: properties.is_some_and(|it| it.class == Class::Logical)
                || place.is_some_and(Place::is_bit),
            unit: properties.map_or("", |it| it.unit),
            name,
        }
    }

    /// The value in an image; `None` where it is not kept there.
    pub(crate) fn value_in(&self, image: &[u8]) -> Option<Value> {
        match self.place {
            Some(place) => {
                let number = place.read(image)?.float();
                Some(if self.is_logical {
                    Value::Logical(number != 0.0)
                } else {
                    Value::Real(number)
                })
            }
            None => self.expression.as_ref()?.evaluate(image).ok(),
        }
    }

    /// Whether two are the same, or have a part of the memory in common.
    pub(crate) fn meets(&self, other: &Self) -> bool {
        let accesses = self.accessed.zip(other.accessed);
        self.name == other.name
            || accesses.is_some_and(|(one, other)| one.meets(other))
            || self.place.zip(other.place).is_some_and(|(one, other)| overlap(one, other))
    }
}

/// Whether two places have a bit in common.
fn overlap(one: Place, other: Place) -> bool {
    let bits = |place: Place| {
        let first = u64::from(place.offset) * 8 + u64::from(place.bit);
        first..first + u64::from(place.width)
    };
    let (one, other) = (bits(one), bits(other));
    one.start < other.end && other.start < one.end
}
