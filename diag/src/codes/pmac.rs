//! The codes of PMAC.

use crate::CodeInfo;

/// Every code of PMAC, in order.
pub static CODES: &[CodeInfo] = &[];
