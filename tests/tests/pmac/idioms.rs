//! Downloads of the second generator do the same in every engine.

use plcc_frontend::common::Controller;
use plcc_tests::idioms::{all_pass, pmac::generate, seeds};

use super::engines::run;

fn is_turbo(seed: u64) -> bool {
    seed % 4 == 1
}

#[test]
fn downloads_of_idioms_agree() {
    all_pass(
        seeds(),
        |seed| generate(seed, is_turbo(seed)),
        |seed, case| {
            let controller = if is_turbo(seed) { Controller::Turbo } else { Controller::Pmac };
            run(&case.source, &case.stimulus, case.ticks, controller).map(|_| ())
        },
    );
}
