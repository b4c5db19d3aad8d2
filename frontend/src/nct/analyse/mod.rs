//! Checks what holds between statements, and makes the cross-reference. Says in errors what
//! people who know other languages probably meant.

pub(crate) mod cross_reference;
mod indentation;
pub(crate) mod lints;
pub(crate) mod other_languages;
pub(crate) mod structure;
