//! Motion programs with PLCs beside them, in all engines.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_frontend::common::Controller;
use plcc_random::seeds;
use plcc_tests::gen_motion::generate;

use crate::engines::simulated;

#[test]
fn generated_motion_programs_agree_and_move_within_their_limits() {
    let (mut events, mut moved) = (0, false);
    for seed in seeds(8) {
        let turbo = seed % 4 == 3;
        let all_modes = seed % 2 == 1;
        let case = generate(seed, turbo, all_modes);
        let controller = if turbo { Controller::Turbo } else { Controller::Pmac };
        let found = simulated(&case.source, &case.stimulus, case.ticks, controller, &mut |value| {
            for motor in 1..=3 {
                let highest = [16, 22, 23].map(|i| value(&format!("I{motor}{i:02}")).abs());
                let highest = highest.into_iter().fold(0.0, f64::max);
                let speed = value(&format!("#{motor}.VEL")).abs();
                moved |= speed != 0.0;
                let held = value("&1.BASE") / 100.0;
                let allowed = highest * held.max(1.0) * 1.0001;
                assert!(
                    speed <= allowed || all_modes,
                    "seed {seed}: motor {motor} moves {speed}, over {allowed}"
                );
            }
        });
        events += found.unwrap_or_else(|why| panic!("seed {seed}: {why}\n{}", case.source)).len();
    }
    // Eight programs of 500 ticks have about ninety.
    assert!(events > 60 && moved, "{events}");
}
