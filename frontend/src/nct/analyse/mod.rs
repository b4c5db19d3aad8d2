//! Statements to a checked program: labels and nesting; and the cross-reference.

pub(crate) mod cross_reference;
pub(crate) mod structure;
