//! What is computed of a download once it is read: the state after load, what compiled code may
//! assume of it, warnings of constants, and the cross-reference.

pub(crate) mod assumptions;
pub(crate) mod cross_reference;
pub(crate) mod lints;
pub(crate) mod load;
pub(crate) mod out_of_range;
pub(crate) mod power_pmac;
