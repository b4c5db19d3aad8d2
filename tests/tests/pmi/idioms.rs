//! Programs of the second generator do the same in every engine.

use plcc_frontend::common::Options;
use plcc_tests::idioms::{Failure, all_pass, pmi::generate, seeds};

use crate::harness::{checked, run};

#[test]
fn programs_of_idioms_agree() {
    all_pass(seeds(), generate, |_, case| {
        let options = Options::default();
        checked(&case.source, &options).map_err(Failure::Invalid)?;
        run(&case.source, &case.stimulus, case.ticks, &options).map_err(Failure::Differs)?;
        Ok(())
    });
}
