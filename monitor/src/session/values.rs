//! Values as the languages write them.

use plcc_frontend::Language;
use plcc_frontend::common::Value;

/// A value as it stands beside a statement.
pub(super) fn shown(value: Value, language: &dyn Language) -> String {
    match value {
        Value::Logical(value) => u8::from(value).to_string(),
        Value::Integer(value) => language.numbers().beside(value),
        Value::Real(value) => plcc_runtime::value::number(value),
    }
}
