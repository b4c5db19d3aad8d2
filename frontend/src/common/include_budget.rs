//! How much text a program may include.
//!
//! Files that include each other many times over, or one that is included a hundred thousand times,
//! would let a small source take any amount of time and memory.

/// How many bytes a program may include in all.
pub const MAX_INCLUDED: usize = 4 << 20;

/// The number of bytes that an include counts as at least, since finding and opening the file takes
/// time however short it is.
const LEAST: usize = 1 << 10;

/// What a program may still include.
#[derive(Clone, Copy, Debug)]
pub struct IncludeBudget {
    left: usize,
    /// Whether an include has exceeded the budget.
    is_exceeded: bool,
}

impl Default for IncludeBudget {
    /// [`MAX_INCLUDED`] bytes.
    fn default() -> Self {
        Self { left: MAX_INCLUDED, is_exceeded: false }
    }
}

/// Whether a file may be included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inclusion {
    /// It may.
    Allowed,
    /// With this one the program includes too much.
    Exceeds,
    /// An earlier one has exceeded the budget already, which was reported there.
    Refused,
}

impl IncludeBudget {
    /// Asks for the inclusion of a file of `length` bytes; 0 for a file that was not found. After
    /// one that exceeds the budget, all are refused.
    pub fn include(&mut self, length: usize) -> Inclusion {
        if self.is_exceeded {
            return Inclusion::Refused;
        }
        match self.left.checked_sub(length.max(LEAST)) {
            Some(left) => {
                self.left = left;
                Inclusion::Allowed
            }
            None => {
                self.is_exceeded = true;
                Inclusion::Exceeds
            }
        }
    }

    /// Whether nothing more is included, so that files need not be looked for.
    pub fn is_exceeded(&self) -> bool {
        self.is_exceeded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_include_exceeds_the_budget_and_all_after_it_are_refused() {
        let mut budget = IncludeBudget::default();
        assert_eq!(budget.include(MAX_INCLUDED - LEAST), Inclusion::Allowed);
        assert_eq!(budget.include(1), Inclusion::Allowed);
        assert_eq!(budget.include(1), Inclusion::Exceeds);
        assert_eq!(budget.include(0), Inclusion::Refused);
    }
}
