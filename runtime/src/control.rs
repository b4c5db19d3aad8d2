//! What the core asks of each control, and the place where the control of a program is chosen.
//!
//! A [`Control`] belongs to the tables of a program: they say which control the program is for. A
//! further language implements the trait for its tables in its own folder.

use std::sync::Arc;

use plcc_abi::{Program, Tables};

use crate::aliased_names::with_given;
use crate::announced::Announced;
use crate::names::Names;
use crate::online_change::Comparison;

/// What the core asks of the control that a program is for.
pub(crate) trait Control {
    /// Checks that the tables fit the image and the tasks of `program`, whose tables they are,
    /// before anything runs.
    ///
    /// # Errors
    /// What does not fit.
    fn validate(&self, program: &Program) -> Result<(), String>;

    /// The control's own names of the variables of `program`, whose tables these are.
    fn names(&self, program: &Program) -> Arc<dyn Names>;

    /// Compares the program `old`, whose tables these are, with one that is to take its place. `None` if that one is
    /// for a control of another language.
    ///
    /// # Errors
    /// When it is for another control of the same language, so that nothing could be taken over.
    fn compare(&self, old: &Program, new: &Program) -> Option<Result<Comparison, String>>;

    /// Whether the program has faults or messages.
    fn announces(&self) -> bool {
        false
    }

    /// The faults and messages that are on in an image of `program`, whose tables these are: faults first.
    fn announced(&self, _program: &Program, _image: &[u8]) -> Vec<Announced> {
        vec![]
    }
}

/// The control that a program's tables are for.
fn control(tables: &Tables) -> &dyn Control {
    plcc_abi::for_tables!(tables, own => own)
}

/// Checks that the tables of a program fit its image and its tasks, before anything runs.
///
/// # Errors
/// What does not fit.
pub fn validate(program: &Program) -> Result<(), String> {
    control(&program.tables).validate(program)
}

/// The names of a program's variables, with the machine's settings that the program was compiled with.
///
/// An executive whose run has other settings has a table that fits them: [`Executive::names`](crate::Executive::names).
pub fn names_of(program: &Program) -> Arc<dyn Names> {
    with_given(control(&program.tables).names(program), &program.names)
}

/// Whether a program has faults or messages, so that [`announced`] may give some.
pub fn announces(program: &Program) -> bool {
    control(&program.tables).announces()
}

/// The faults and messages of a program that are on in an image of it: faults first, then in the order of their definition.
pub fn announced(program: &Program, image: &[u8]) -> Vec<Announced> {
    control(&program.tables).announced(program, image)
}

/// Compares two programs for an online change.
///
/// # Errors
/// When the new one is for another control, so that nothing could be taken over.
pub fn compare(old: &Program, new: &Program) -> Result<Comparison, String> {
    control(&old.tables).compare(old, new).unwrap_or_else(|| {
        let name = |program: &Program| program.dialect().name().to_uppercase();
        let (was, is) = (name(old), name(new));
        Err(format!("it is a program in {is}, and the program that runs is in {was}"))
    })
}
