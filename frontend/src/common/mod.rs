//! What the languages share: the options of a compilation, files and includes, the machine file,
//! the loader of tables, expressions, observers of statements, cross-references, internal errors.

mod accessed;
mod broken_invariant;
mod contacts;
mod cross_reference;
mod exported;
pub mod expression;
mod include;
mod include_budget;
pub mod keywords;
pub mod lints;
mod loader;
mod lower_error;
mod lowered;
mod number_format;
mod observer;
mod options;
mod other_languages;
mod surroundings;
pub mod tokens;
mod trailing_comment;
pub mod tsv;
mod ways;
pub mod words;

pub use accessed::Accessed;
pub use broken_invariant::{BrokenInvariant, OrMissing};
pub(crate) use contacts::LogicBuilder;
pub use contacts::{Contact, Gate, Logic, Seen};
pub use cross_reference::{CrossReference, CrossReferenceBuilder, CrossReferenceRow, Use};
pub(crate) use exported::CommentsInOrder;
pub use exported::{Exported, Held};
pub use expression::{Evaluate, EvaluationError, Expression, ExpressionCode, Value};
pub use include::{Included, find_include};
pub use include_budget::{IncludeBudget, Inclusion, MAX_INCLUDED};
pub use lints::LintLevels;
pub use loader::{FileLoader, MemoryLoader};
pub use lower_error::LowerError;
pub use lowered::{Lowered, ReturnStack};
pub use number_format::NumberFormat;
pub use observer::{NoObserver, Observer, StatementInterpreter};
pub use options::{Controller, Limits, Options};
pub(crate) use other_languages::{
    EXPLAINED_ERRORS, Explanation, Habits, explanation, help, tell_small_letters_once,
};
pub use plcc_abi::machine::{Machine, MachineError, MachineVariable, VariableClass, VariableType};
pub use plcc_abi::{closest, natural_cmp};
pub(crate) use surroundings::Surroundings;
pub(crate) use trailing_comment::{split_comment, trailing_comment};
pub use ways::Ways;
pub use words::Words;
