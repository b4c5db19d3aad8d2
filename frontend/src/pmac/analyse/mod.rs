//! Statements to the checked program: the state after load, and values that can't be right.

pub(crate) mod assumptions;
pub(crate) mod cross_reference;
pub(crate) mod eval;
pub(crate) mod load;
pub(crate) mod out_of_range;
