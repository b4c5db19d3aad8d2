//! The codes of PMI.

use crate::CodeInfo;

/// Every code of PMI, in order.
pub static CODES: &[CodeInfo] = &[];
