//! What is checked and computed of a download once it is read: that what it uses is defined, which
//! statements are computed in integers, the state after load, what compiled code may assume of it,
//! warnings, and the cross-reference.

pub(crate) mod assumptions;
pub(crate) mod cross_reference;
pub(crate) mod define_with_equals;
pub(crate) mod enabled;
pub(crate) mod lints;
pub(crate) mod load;
pub(crate) mod load_motion;
pub(crate) mod local_variables;
pub(crate) mod out_of_range;
pub(crate) mod power_pmac;
