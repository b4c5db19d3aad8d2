//! Programs of the second generator do the same in every engine.

use plcc_tests::idioms::{all_pass, nct::generate, seeds};

use super::generated::compare;

#[test]
fn programs_of_idioms_agree() {
    all_pass(seeds(), generate, |seed, case| compare(case, seed).map(|_| ()));
}
