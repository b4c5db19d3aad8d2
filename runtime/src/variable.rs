//! Variables by their keys, what may be done with them, and why a name or a value is refused.

use std::fmt;

use plcc_abi::DialectVariable;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::value::number;

/// A variable, an array or an element of an array of a program. It is found by its name
/// ([`Names::find`](crate::Names::find)), and means the same to all executives of that program, in every thread and in
/// a record. In another program it may be another variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct VariableKey(pub(crate) DialectVariable);

/// How many forces can be in effect at once.
pub const MAX_FORCES: usize = 256;

/// What a variable is looked up for, which decides what variables are allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// To be read: any variable, also a whole array.
    Watch,
    /// To be set by the stimulus: any single variable, also one that the program can only read.
    Stimulus,
}

/// A value for [`Executive::write`](crate::Executive::write), already checked to fit its variable.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Setting {
    /// An integer.
    Int(i64),
    /// A double.
    Float(f64),
}

impl fmt::Display for Setting {
    /// As a number in JSON.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Int(value) => write!(f, "{value}"),
            Self::Float(value) => f.write_str(&number(*value)),
        }
    }
}

impl Setting {
    /// The value as a number.
    pub fn number(self) -> f64 {
        match self {
            Self::Int(number) => number as f64,
            Self::Float(number) => number,
        }
    }

    /// The value as an integer, cut off towards zero.
    pub(crate) fn integer(self) -> i64 {
        match self {
            Self::Int(number) => number,
            Self::Float(number) => number as i64,
        }
    }
}

/// Why a name can't be watched or set.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NameError {
    /// Nothing has this name.
    #[error("the program has no variable named `{name}`{}", did_you_mean(.suggestion))]
    Unknown {
        /// The name as written.
        name: String,
        /// A variable that exists and has a similar name.
        suggestion: Option<String>,
    },
    /// Something has this name, but can't be used for the purpose.
    #[error("`{name}` {reason}")]
    Unfit {
        /// The name as written.
        name: String,
        /// Why not.
        reason: String,
    },
}

fn did_you_mean(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

/// Why a value does not fit a variable.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{value}` {reason}")]
pub struct ValueError {
    /// The value as written.
    pub value: String,
    /// Why not.
    pub reason: String,
}
