//! Values as the languages write them.

use plcc_abi::Dialect;
use plcc_frontend::common::Value;

/// A value as it stands beside a statement: bits 0 and 1, words of NCT decimal and `.hhhh`.
pub(super) fn shown(value: Value, dialect: Dialect) -> String {
    match (value, dialect) {
        (Value::Logical(value), _) => u8::from(value).to_string(),
        (Value::Integer(value @ 0..=1), _) => value.to_string(),
        (Value::Integer(value), Dialect::Nct) => format!("{value} .{:04X}", value as u16),
        (Value::Integer(value), _) => value.to_string(),
        (Value::Real(value), _) => plcc_runtime::value::number(value),
    }
}
