//! Why a checked program has no IR.

use std::fmt;

use plcc_ir::Statement;
use plcc_ir::chunk::{MAX_INSTRUCTIONS, MAX_STATEMENT_INSTRUCTIONS};

use super::BrokenInvariant;

/// Why no IR was made of a checked program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LowerError {
    /// The compiler has a defect.
    Internal(BrokenInvariant),
    /// The program has more than [`MAX_INSTRUCTIONS`] instructions of IR, or a statement more than
    /// [`MAX_STATEMENT_INSTRUCTIONS`]. Holds the statement with which there are too many.
    TooLong(Statement),
}

impl fmt::Display for LowerError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Internal(error) => error.fmt(f),
            Self::TooLong(statement) => write!(
                f,
                "the program has more than {MAX_INSTRUCTIONS} instructions of IR, or a statement more than \
                 {MAX_STATEMENT_INSTRUCTIONS} (line {})",
                statement.line
            ),
        }
    }
}

impl std::error::Error for LowerError {}

impl From<BrokenInvariant> for LowerError {
    fn from(error: BrokenInvariant) -> Self {
        Self::Internal(error)
    }
}
