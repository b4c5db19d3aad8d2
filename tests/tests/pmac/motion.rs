//! Motion programs with PLCs beside them, in all engines.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_diag::SourceMap;
use plcc_frontend::common::{Controller, MemoryLoader, Options};
use plcc_frontend::pmac;
use plcc_random::seeds;
use plcc_runtime::pmac::{PmacExecutive, PmacOptions};
use plcc_runtime::{Executive, Purpose};
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

/// The control of a download, with its motors simulated or not.
fn executive(source: &str, simulated: bool) -> PmacExecutive {
    let mut sources = SourceMap::new();
    let file = sources.add("a.pmc", source.as_bytes());
    let options = Options { simulate: simulated, ..Options::default() };
    let checked = pmac::check(&mut sources, &[file], &MemoryLoader::new(), &options).0.unwrap();
    let program = checked.lower().unwrap().program;
    let mut executive = PmacExecutive::new(&program, PmacOptions::default()).unwrap();
    if simulated {
        executive.simulate(&[]).unwrap();
    }
    executive
}

#[test]
fn what_the_switches_of_motors_say_is_known_to_be_simulated() {
    let simulates = |simulated: bool, name: &str| {
        let executive = executive("M1->X:$C000,20\nM2->Y:$FFC2,0\nI5=2\n", simulated);
        let key = executive.names().find(name, Purpose::Watch).unwrap();
        executive.simulates_word(key)
    };
    for name in ["M1", "X:$C000,21", "X:$C001"] {
        assert!(simulates(true, name), "{name}");
        assert!(!simulates(false, name), "{name}");
    }
    // Other inputs, and what programs write to a flag word.
    for name in ["M2", "Y:$FFC2,3", "X:$C000,13"] {
        assert!(!simulates(true, name), "{name}");
    }
}
