//! What the parsers note of the variables that a download names: which L-variables it uses, since these
//! must be defined, and how many variables its ranges (`P0..1023`) may still name.

use crate::pmac::origin::TextRange;

/// A use of L-variables: `count` of them from number `first` on, `step` apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UsedL {
    pub(crate) first: u16,
    pub(crate) count: u16,
    pub(crate) step: u16,
    /// Where they are named.
    pub(crate) at: TextRange,
}

impl UsedL {
    /// The numbers of the variables.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = u16> {
        let Self { first, count, step, .. } = *self;
        (0..count).map(move |k| first.wrapping_add(k.wrapping_mul(step)))
    }
}

/// How many variables the ranges of a download may name in all: 256 times all of one kind of a Turbo
/// PMAC. Each is looked at when the download is read or loaded, so that without this limit a
/// mebibyte of `P0..8191=0` would take minutes.
const MAX_IN_RANGES: u32 = 2 << 20;

/// How many variables ranges may still name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RangeBudget {
    left: u32,
    is_exceeded: bool,
}

impl Default for RangeBudget {
    fn default() -> Self {
        Self { left: MAX_IN_RANGES, is_exceeded: false }
    }
}

impl RangeBudget {
    /// Takes `count` variables. Returns how many of them are to be read; `None` for the range that
    /// exceeds the budget. Of the ranges after it only one variable is read: the download is
    /// refused anyway.
    pub(crate) fn take(&mut self, count: u16) -> Option<u16> {
        if self.is_exceeded {
            return Some(count.min(1));
        }
        match self.left.checked_sub(u32::from(count)) {
            Some(left) => {
                self.left = left;
                Some(count)
            }
            None => {
                self.is_exceeded = true;
                None
            }
        }
    }
}
