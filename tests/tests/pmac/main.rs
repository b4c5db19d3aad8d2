//! Tests of PMAC programs: arithmetic, files in the forms found on machines, the examples of the
//! documentation, changed definitions, and that all engines agree.
#![allow(clippy::indexing_slicing)]

mod arithmetic;
mod bits;
mod checked;
mod corpus;
mod docs;
mod engines;
mod explain;
mod function_lengths;
mod idioms;
mod later_code;
mod motion;
mod moved;
mod moved_count;
