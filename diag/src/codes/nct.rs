//! The codes of NCT.

use crate::CodeInfo;

/// Every code of NCT, in order.
pub static CODES: &[CodeInfo] = &[];
