//! Which passes may run, and how.

use super::pass::Pass;

/// How much time to spend on making code fast.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OptLevel {
    /// None: the module stays as the front end wrote it.
    None,
    /// As much as pays off in the speed of scans.
    #[default]
    Speed,
}

/// A set of passes: those that may run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PassSet(u32);

impl PassSet {
    /// No pass.
    pub const NONE: Self = Self(0);
    /// Every pass.
    pub const ALL: Self = Self((1 << Pass::ALL.len()) - 1);

    /// Whether a pass is in the set.
    pub fn contains(self, pass: Pass) -> bool {
        self.0 >> pass as u32 & 1 == 1
    }

    /// The set without a pass.
    #[must_use]
    pub fn without(self, pass: Pass) -> Self {
        Self(self.0 & !(1 << pass as u32))
    }

    /// The set with a pass.
    #[must_use]
    pub fn with(self, pass: Pass) -> Self {
        Self(self.0 | 1 << pass as u32)
    }
}

/// What [`optimize`](super::optimize) does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PassOptions {
    /// The passes that may run.
    pub passes: PassSet,
    /// In long programs [`Forward`](Pass::Forward) does not replace loads of truth values, so that they are loaded
    /// again ([`thresholds::RELOAD_BITS_FROM`](super::thresholds::RELOAD_BITS_FROM)).
    pub reload_bits: bool,
    /// What pays is chosen by the length of the program: [`PackedBits`](Pass::PackedBits) is left out in long programs
    /// ([`thresholds::LONG_FROM`](super::thresholds::LONG_FROM)), and [`ByteBits`](Pass::ByteBits) in short ones and
    /// where it does not pay.
    pub by_length: bool,
}

impl From<PassSet> for PassOptions {
    fn from(passes: PassSet) -> Self {
        Self { passes, reload_bits: true, by_length: true }
    }
}

impl From<OptLevel> for PassOptions {
    fn from(level: OptLevel) -> Self {
        match level {
            OptLevel::None => PassSet::NONE.into(),
            OptLevel::Speed => PassSet::ALL.into(),
        }
    }
}
