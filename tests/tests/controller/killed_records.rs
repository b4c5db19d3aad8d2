//! Generated programs are recorded by `plcrt`, which is killed by SIGKILL at a random moment. What is in the record by then can
//! be run again up to its last whole tick, in other engines than the one that recorded it.
//!
//! The runs are in simulated time, so that a moment is many ticks and the kill comes while blocks are written.

use std::fs;
use std::time::Duration;

use plcc::recorded::{Found, ReplayEngine};
use plcc_abi::Dialect;
use plcc_diag::SourceMap;
use plcc_frontend::common::Options;
use plcc_host::session::replay::recorded_executive;
use plcc_random::{Rng, seeds};
use plcc_record::{RecordedRun, Recording, Replayer};
use plcc_tests::gen_pmi::Case;
use plcc_tests::gen_program;

use crate::shop::{Shop, wait};

/// How many ticks the statement interpreter runs again; native code runs all.
const INTERPRETED: u64 = 200;

fn generated(dialect: Dialect, count: u64) {
    for seed in seeds(count) {
        let case = gen_program::generate_short(dialect, seed);
        let mut rng = Rng::new(seed ^ 0x6B_1117);
        let name = format!("kill-{}-{seed}", dialect.name());
        check(&Shop::new(&name, dialect, &case.source), dialect, &case, &mut rng, seed);
    }
}

/// The first and the last tick of the last run of a record, if it has any yet.
fn kept(shop: &Shop) -> Option<(Recording, u64, u64)> {
    let recording = Recording::open(&shop.path("r.plcrec")).ok()?;
    let run = recording.last_run()?;
    let (first, last) = (run.spans.first()?.first, run.spans.last()?);
    let end = recording.end_of(last).ok()?;
    (end > first).then_some((recording, first, end))
}

fn check(shop: &Shop, dialect: Dialect, case: &Case, rng: &mut Rng, seed: u64) {
    fs::write(shop.path("s.csv"), &case.stimulus).unwrap();
    let run = "--stimulus s.csv --repeat --ticks 1000000000 --record r.plcrec --keep 2MB";
    let mut child = shop.command(run).spawn().unwrap();
    // The first ticks are written within a second or so. A program that is stopped has ended by itself.
    let mut is_over = false;
    while !is_over && kept(shop).is_none() {
        std::thread::sleep(Duration::from_millis(5));
        is_over = child.try_wait().unwrap().is_some();
    }
    std::thread::sleep(Duration::from_micros(rng.below(1_200_000) as u64));
    let _ = child.kill();
    wait(&mut child);

    let what = format!("{} seed {seed}\n{}", dialect.name(), case.source);
    let (recording, first, end) = kept(shop).unwrap_or_else(|| panic!("nothing is kept: {what}"));
    let recorded = recording.last_run().unwrap();
    let found = found(recorded, dialect, &case.source);
    let replay = |from: u64, ticks: u64, engine: ReplayEngine| {
        let mut native = found.engine(ReplayEngine::Aot).unwrap();
        let mut engine = found.engine(engine).unwrap();
        let executive = recorded_executive(&recorded.header, &found.program).unwrap();
        let mut replayer = Replayer::new(&recording, recorded, 0, executive);
        replayer.go_to(from, native.as_mut()).unwrap();
        let mut next = from;
        while next < from.saturating_add(ticks)
            && let Some(replayed) = replayer.step(engine.as_mut(), &mut vec![]).unwrap()
        {
            assert!(replayed.matches, "{replayed:?}: {what}");
            next = replayed.tick + 1;
        }
        next
    };
    assert_eq!(replay(first, u64::MAX, ReplayEngine::Aot), end, "{what}");
    // Other engines go on from a checkpoint at the beginning, from anywhere, and at the end.
    let somewhere = first + rng.below((end - first) as usize) as u64;
    for from in [first, somewhere, end.saturating_sub(INTERPRETED).max(first)] {
        let last = end.min(from + INTERPRETED);
        for engine in [ReplayEngine::Interpreter, ReplayEngine::Jit] {
            assert_eq!(replay(from, INTERPRETED, engine), last, "{engine:?}: {what}");
        }
    }
}

/// The program of the record, with its sources, for all engines.
fn found(run: &RecordedRun, dialect: Dialect, source: &str) -> Found {
    let mut sources = SourceMap::new();
    let file = sources.add("p", source.as_bytes());
    let options = Options::default();
    let disk = plcc::disk::Disk;
    let (checked, _) = plcc::compile::check(&mut sources, &[file], dialect, &disk, &options);
    let found = Found::of_checked(checked.unwrap(), sources).unwrap();
    found.in_place_of(run.programs.first().unwrap()).unwrap()
}

#[test]
fn killed_pmi_programs_are_replayed() {
    generated(Dialect::Pmi, 2);
}

#[test]
fn killed_nct_programs_are_replayed() {
    generated(Dialect::Nct, 2);
}

#[test]
fn killed_pmac_programs_are_replayed() {
    generated(Dialect::Pmac, 2);
}
