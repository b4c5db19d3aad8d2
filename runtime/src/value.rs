//! Values of variables, and how they are written in traces and dumps.

use std::fmt;

pub use plcc_abi::number;

/// A variable's value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// An integer; logicals are 0 or 1.
    Int(i64),
    /// A finite double.
    Float(f64),
    /// The elements of an array.
    Array(Vec<Value>),
}

impl Value {
    /// A single value as a number with a fraction; `None` for an array.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Int(value) => Some(*value as f64),
            Self::Float(value) => Some(*value),
            Self::Array(_) => None,
        }
    }
}

impl fmt::Display for Value {
    /// As JSON: doubles as ECMAScript's `Number::toString` writes them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Int(value) => write!(f, "{value}"),
            Self::Float(value) => f.write_str(&number(*value)),
            Self::Array(values) => {
                f.write_str("[")?;
                for (i, value) in values.iter().enumerate() {
                    if i > 0 {
                        f.write_str(",")?;
                    }
                    write!(f, "{value}")?;
                }
                f.write_str("]")
            }
        }
    }
}
