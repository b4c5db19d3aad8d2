//! The variables of a program as an executive gives them out: by a number, by a key, and what may be set.

use plcc_abi::nct::NctName;
use plcc_abi::pmac::PmacName;
use plcc_abi::pmi::PmiVariable;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A variable that an executive has found by its name. The number is the variable's place among those that
/// this executive has looked up, from 0, and means nothing to another executive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Variable(pub u32);

/// A single variable, or an element of an array, by what it is rather than by a number in one
/// executive's list. It means the same to all executives of a program, so that one thread can look a
/// name up in an executive of its own and another thread can use the key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct VariableKey(pub(crate) DialectVariable);

/// What a [`VariableKey`] holds: the variable as its language names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(crate) enum DialectVariable {
    Pmi(PmiVariable),
    Nct(NctName),
    Pmac(PmacName),
}

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

/// A value for [`Executive::set`](crate::Executive::set), already checked to fit its variable.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Setting {
    /// An integer.
    Int(i64),
    /// A double.
    Float(f64),
}

impl Setting {
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
