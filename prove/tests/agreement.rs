//! The logic of a tick is what the executive does with the statement interpreter, byte for byte, on random programs with
//! random inputs; and answers about random programs agree with a search of all their states.

#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod support;

use std::collections::{BTreeSet, HashMap};
use std::time::Duration;

use fastrand::Rng;
use plcc_abi::Dialect;
use plcc_prove::system::{First, Time};
use plcc_prove::{Answer, Station};
use plcc_runtime::{Purpose, Setting};
use support::Bench;

/// Runs programs in both ways for some ticks and compares the whole image after each.
fn compare(dialect: Dialect, make: fn(&mut Rng) -> (String, String), seeds: std::ops::Range<u64>) {
    let count = seeds.clone().count();
    let mut left = vec![];
    for seed in seeds {
        let mut rng = Rng::with_seed(seed);
        let (text, _) = make(&mut rng);
        let bench = Bench::new(dialect, &text);
        let system = bench.source().system(Time::Exact, &BTreeSet::new()).unwrap();
        let mut executive = bench.executive();
        let mut engine = bench.engine();
        let names = executive.names();
        let mut state: HashMap<u32, bool> = HashMap::new();
        for latch in &system.latches {
            state.insert(latch.lit.node(), latch.first == First::Constant(true));
        }
        for tick in 0..30 {
            let mut inputs = state.clone();
            for variable in &system.inputs {
                let mut value = 0_i64;
                for (place, bit) in variable.bits.iter().enumerate() {
                    let on = rng.u8(..3) == 0;
                    inputs.insert(bit.node(), on);
                    value |= i64::from(on) << place;
                }
                let key = names.find(&variable.name, Purpose::Stimulus).unwrap();
                executive.write(key, Setting::Int(value));
            }
            let values = support::values(&system.builder.graph, &inputs);
            let get =
                |lit: plcc_prove::logic::Lit| values[lit.node() as usize] != lit.is_complement();
            // Subroutines that call each other without an end are not followed, and the logic says so.
            if system.builder.escapes.iter().any(|(lit, _)| get(*lit)) {
                left.push((seed, text, system.builder.reasons));
                break;
            }
            let stopped = executive.tick(engine.as_mut(), &mut vec![]).is_err();
            for (offset, &byte) in executive.image().iter().enumerate() {
                let ours = system.memory.byte(offset);
                let ours = (0..8).fold(0_u8, |sum, bit| sum | u8::from(get(ours[bit])) << bit);
                let region = bench.lowered.program.regions.iter().find(|region| {
                    (region.offset..region.offset + region.size).contains(&(offset as u32))
                });
                let region = region.map_or("", |region| region.name.as_str());
                // What the control keeps of the module that ran, and what engines use in their own way.
                let own = ["context", "scratch", "waiting"].contains(&region);
                assert!(
                    own || ours == byte,
                    "seed {seed}, tick {tick}: byte {offset} of {region} is {byte}, not {ours}\n{text}"
                );
            }
            if stopped {
                break;
            }
            for latch in &system.latches {
                state.insert(latch.lit.node(), get(latch.next));
            }
        }
    }
    assert!(left.len() * 100 <= count, "{} of {count} are not followed: {left:?}", left.len());
}

#[test]
fn a_tick_of_pmi_is_what_the_executive_does() {
    compare(Dialect::Pmi, support::pmi, support::seeds(50));
}

#[test]
fn a_tick_of_nct_is_what_the_executive_does() {
    compare(Dialect::Nct, support::nct, support::seeds(40));
}

/// Compares answers with a search of all states.
fn answers(
    dialect: Dialect,
    make: fn(&mut Rng) -> (String, String),
    inputs: &[&str],
    seeds: std::ops::Range<u64>,
) {
    let (mut proved, mut refuted, mut open) = (0, 0, 0);
    for seed in seeds {
        let mut rng = Rng::with_seed(seed);
        let (text, line) = make(&mut rng);
        let bench = Bench::new(dialect, &text);
        let question = bench.question(&line);
        let Some(truth) = bench.exhaustive(&question, inputs, 3_000) else { continue };
        let answer = bench.ask(&question, Duration::from_secs(60));
        match (&answer, truth) {
            (Answer::Proved { .. }, None) => proved += 1,
            (Answer::Refuted { scans, .. }, Some(tick)) if *scans > tick => refuted += 1,
            (Answer::Undecided { .. }, _) => {
                eprintln!("seed {seed}: {answer:?}\n{text}\n{line}");
                open += 1;
            }
            _ => panic!("seed {seed}: {answer:?}, and the search says {truth:?}\n{text}\n{line}"),
        }
    }
    eprintln!("{proved} proved, {refuted} refuted, {open} undecided");
    assert!(
        proved > 0 && refuted > 0 && open == 0,
        "{proved} proved, {refuted} refuted, {open} undecided"
    );
}

/// A program of PMI with a line of a script that a condition never holds.
fn never_pmi(rng: &mut Rng) -> (String, String) {
    let (text, condition) = support::pmi(rng);
    (text, format!("never {condition}"))
}

/// The same of NCT.
fn never_nct(rng: &mut Rng) -> (String, String) {
    let (text, condition) = support::nct(rng);
    (text, format!("never {condition}"))
}

/// A program of PMI with a line of a script that a condition follows another one.
fn response(rng: &mut Rng) -> (String, String) {
    let (text, condition) = support::pmi(rng);
    let after = ["A", "B", "/C", "X", "Y", "L1", "DC", "DD", "Q", "@IPL"][rng.usize(..10)];
    let within = [0, 1, 2, 3, 5, 30][rng.usize(..6)];
    (text, format!("after {after}, {condition} within {within} ticks"))
}

#[test]
fn answers_about_responses_agree_with_a_search_of_all_states() {
    answers(Dialect::Pmi, response, &["A", "B", "C"], support::seeds(60));
}

#[test]
fn answers_about_pmi_agree_with_a_search_of_all_states() {
    answers(Dialect::Pmi, never_pmi, &["A", "B", "C"], support::seeds(60));
}

#[test]
fn answers_about_nct_agree_with_a_search_of_all_states() {
    answers(Dialect::Nct, never_nct, &["I000", "I001", "I002"], support::seeds(24));
}
