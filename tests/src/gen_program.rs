//! Random programs of any of the languages.

use plcc_abi::Dialect;

use crate::gen_pmi::Case;
use crate::{gen_nct, gen_pmac, gen_pmi};

/// A program of about `size` statements in a language.
pub fn generate(dialect: Dialect, seed: u64, size: usize) -> Case {
    match dialect {
        Dialect::Pmi => gen_pmi::generate(seed, size),
        Dialect::Nct => gen_nct::generate(seed, size),
        Dialect::Pmac => gen_pmac::generate(seed, size),
    }
}

/// A program in a language, of 20 to 79 statements, as many as the seed says.
pub fn generate_short(dialect: Dialect, seed: u64) -> Case {
    generate(dialect, seed, 20 + (seed % 60) as usize)
}
