//! Checks what holds between statements, and makes the cross-reference.

pub(crate) mod cross_reference;
pub(crate) mod lints;
pub(crate) mod structure;
