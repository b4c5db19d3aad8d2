//! What a statement accesses, as observers are told: the variable whose value begins at an offset of the process image.

use crate::common::Accessed;

/// The area: the process image, counted in bytes.
const IMAGE: u32 = 0;

/// The variable at an offset of the process image.
pub(super) fn accessed(offset: u32) -> Accessed {
    Accessed::one(IMAGE, offset)
}

/// The variables from an offset on, up to another.
pub(super) fn range(first: u32, end: u32) -> Accessed {
    Accessed { area: IMAGE, first, count: end.saturating_sub(first) }
}
