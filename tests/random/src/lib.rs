//! Random numbers for tests, fuzz replays and benchmarks. The same seed gives the same numbers on
//! every machine and in every version.
//!
//! The generator is [`rand_xoshiro`]'s SplitMix64. That crate promises not to change its values.
//! This crate adds the few ways in which tests draw numbers from it. A test that fails names the
//! seed in its message, so that the case can be generated again:
//!
//! ```
//! use plcc_random::Rng;
//!
//! let mut rng = Rng::new(7);
//! let word = *rng.pick(&["IF", "ELSE", "ENDIF"]);
//! let count = 1 + rng.below(10);
//! assert!((1..=10).contains(&count));
//! let mut again = Rng::new(7);
//! assert_eq!(*again.pick(&["IF", "ELSE", "ENDIF"]), word);
//! ```
#![allow(clippy::indexing_slicing)]

use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};

/// A generator of random numbers.
#[derive(Clone, Debug)]
pub struct Rng(SplitMix64);

impl Rng {
    /// A generator whose numbers depend on nothing but `seed`; any seed is as good as any other.
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::seed_from_u64(seed))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// A number from 0 to `limit - 1`; 0 where `limit` is 0.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.bits() % limit.max(1) as u64) as usize
    }

    /// True with a probability of `percent` in 100.
    pub fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    /// An element of a list, each with the same probability.
    ///
    /// # Panics
    /// If the list is empty.
    pub fn pick<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        let at = self.below(list.len());
        &list[at]
    }
}

/// The seeds for which a test generates programs: `default_count` of them, from 0. The environment
/// variables `PLCC_SEEDS` and `PLCC_FIRST` give another count and another first seed;
/// `scripts/full generated` sets them to divide a long run into parts.
pub fn seeds(default_count: u64) -> std::ops::Range<u64> {
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let first = number("PLCC_FIRST").unwrap_or(0);
    first..first + number("PLCC_SEEDS").unwrap_or(default_count)
}

#[cfg(test)]
mod tests {
    use super::Rng;

    /// Commit messages, issues and comments name generated programs by their seed, so a seed must
    /// always give the same program.
    #[test]
    fn a_seed_gives_the_same_numbers_for_ever() {
        let mut rng = Rng::new(0);
        assert_eq!(
            [rng.bits(), rng.bits(), rng.bits()],
            [0xE220_A839_7B1D_CDAF, 0x6E78_9E6A_A1B9_65F4, 0x06C4_5D18_8009_454F]
        );
    }
}
