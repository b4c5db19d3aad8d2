//! Which passes may run.

use super::{OptLevel, Pass};

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

    /// The set after the changes that a text asks for: names of passes with commas between, each
    /// behind a `-` (leave it out) or a `+` (put it in).
    ///
    /// # Errors
    /// When a part of the text is neither; the message has the first such part and the names of all
    /// passes.
    pub fn with_changes(self, text: &str) -> Result<Self, String> {
        let mut set = self;
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let change = part.split_at_checked(1).and_then(|(sign, name)| {
                let pass = Pass::from_name(name)?;
                match sign {
                    "-" => Some(set.without(pass)),
                    "+" => Some(set.with(pass)),
                    _ => None,
                }
            });
            set = change.ok_or_else(|| {
                let names: Vec<&str> = Pass::ALL.iter().map(|pass| pass.name()).collect();
                format!(
                    "`{part}` is not `-` or `+` and a pass; the passes are {}",
                    names.join(", ")
                )
            })?;
        }
        Ok(set)
    }
}

impl From<OptLevel> for PassSet {
    fn from(level: OptLevel) -> Self {
        match level {
            OptLevel::None => Self::NONE,
            OptLevel::Speed => Self::ALL,
        }
    }
}
