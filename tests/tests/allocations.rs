//! Once a control runs, a tick without events takes no memory from the system, in any dialect, in
//! the statement interpreter and in native code; nor does one of PMAC's with events.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::alloc::System;
use std::path::Path;

use plcc_abi::Dialect;
use plcc_frontend::common::Options;
use plcc_runtime::args::ControlArgs;
use plcc_runtime::run::{Player, Stimulus};
use plcc_runtime::session::executive;
use plcc_tests::compile::{Way, compile};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// One test, since others beside it would be counted too.
#[test]
fn ticks_allocate_nothing() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("examples");
    for (dialect, program, stimulus) in [
        (Dialect::Pmi, "pmi/lathe.pmi", "pmi/lathe.csv"),
        (Dialect::Nct, "nct/sample.plc", "nct/sample.csv"),
        (Dialect::Pmac, "pmac/mill.pmc", "pmac/mill/tool/stimulus.csv"),
    ] {
        let compiled = compile(&examples.join(program), dialect, &Options::default()).unwrap();
        let table = std::fs::read(examples.join(stimulus)).unwrap();
        for way in [Way::Statements, Way::JitSpeed] {
            let (program, mut engine) = compiled.engine(way).unwrap();
            let control = ControlArgs::default();
            let mut executive = executive(&program, &control, false, None).unwrap();
            let stimulus = Stimulus::parse(&table, executive.as_mut()).unwrap();
            let ticks = stimulus.period() * 2;
            let mut player = Player::new(stimulus, true);
            let mut events = Vec::with_capacity(64);
            let mut quiet = 0;
            for tick in 0..ticks {
                let region = Region::new(ALLOCATOR);
                player.apply(tick, executive.as_mut());
                executive.tick(&mut engine, &mut events).unwrap();
                let change = region.change();
                if tick >= ticks / 2 && events.is_empty() {
                    let taken = change.allocations + change.reallocations;
                    assert_eq!(taken, 0, "{dialect:?} {way:?} tick {tick}: {change:?}");
                    quiet += 1;
                }
                events.clear();
            }
            assert!(quiet > ticks / 4, "{dialect:?} {way:?}: {quiet} of {ticks} ticks");
        }
    }
    what_a_pmac_says_allocates_nothing();
}

/// SEND, DISPLAY, COMMAND and SAVE, moved definitions among them.
const TALK: &str = "I5=3\nM1->X:$07F0,0,24\nM2->X:$07F1,0,24\nM101->Y:$BC01,0,16\n\
    OPEN PLC 1 CLEAR\nP1=P1+1.25\nSEND\"X\"\nDISPLAY 3,8.2,P1\nDISPLAY 0\"TEXT\"\nCMD\"SAVE\"\n\
    CMD\"P9=P9+1\"\nCMD\"M2->L:$1005\"\nM101=$07F4+INT(P1/4)%4\nM1=M1+M2\nCLOSE\n";

/// A PMAC's texts are events of a known size, and what SAVE keeps has its room from the start.
fn what_a_pmac_says_allocates_nothing() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("talk.pmc");
    std::fs::write(&path, TALK).unwrap();
    let compiled = compile(&path, Dialect::Pmac, &Options::default()).unwrap();
    for way in [Way::Statements, Way::JitSpeed] {
        let (program, mut engine) = compiled.engine(way).unwrap();
        let mut executive = executive(&program, &ControlArgs::default(), false, None).unwrap();
        let mut events = Vec::with_capacity(64);
        let mut said = 0;
        for tick in 0..100 {
            let region = Region::new(ALLOCATOR);
            executive.tick(&mut engine, &mut events).unwrap();
            let change = region.change();
            if tick > 0 {
                let taken = change.allocations + change.reallocations;
                assert_eq!(taken, 0, "{way:?} tick {tick}: {change:?}");
            }
            said += events.len();
            events.clear();
        }
        assert_eq!(said, 600, "{way:?}");
        assert!(executive.retained().is_some());
    }
}
