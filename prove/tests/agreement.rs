//! The logic of a tick is what the executive does with the statement interpreter, byte for byte, on random programs with
//! random inputs; and answers about random programs agree with a search of all their states.

#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod support;

use std::collections::{BTreeSet, HashMap};
use std::time::Duration;

use fastrand::Rng;
use plcc_abi::Dialect;
use plcc_abi::Tables;
use plcc_abi::pmac::Layout;
use plcc_prove::logic::TRUE;
use plcc_prove::system::{First, Form, Time};
use plcc_prove::{Answer, Station};
use plcc_runtime::Purpose;
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
        // What is always the same, and where other bytes lie.
        let mut ours: Vec<u8> = vec![];
        let mut others: Vec<usize> = vec![];
        for offset in 0..executive.image().len() {
            let byte = system.memory.byte(offset);
            if byte.iter().any(|bit| bit.value().is_none()) {
                others.push(offset);
            }
            ours.push((0..8).fold(0, |sum, bit| sum | u8::from(byte[bit] == TRUE) << bit));
        }
        // What the control keeps of the module that ran, and what engines use in their own way.
        let own = ["context", "scratch", "waiting"];
        let own: Vec<_> = bench
            .lowered
            .program
            .regions
            .iter()
            .filter(|it| own.contains(&it.name.as_str()))
            .collect();
        for tick in 0..30 {
            let mut inputs = state.clone();
            for variable in &system.inputs {
                let double = match rng.u8(..4) {
                    0 => f64::from_bits(rng.u64(..)),
                    1 => f64::from(rng.i8(..)) / 4.0,
                    _ => f64::from(rng.i8(-3..5)),
                };
                for (place, bit) in variable.bits.iter().enumerate() {
                    let on = match variable.form {
                        Form::Double => double.to_bits() >> place & 1 == 1,
                        _ => rng.u8(..3) == 0,
                    };
                    inputs.insert(bit.node(), on);
                }
                let value = variable.number(|bit| inputs[&bit.node()]);
                let key = names.find(&variable.name, Purpose::Stimulus).unwrap();
                let setting = names.parse(key, &variable.text(value)).unwrap();
                executive.write(key, setting);
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
            for &offset in &others {
                let byte = system.memory.byte(offset);
                ours[offset] = (0..8).fold(0, |sum, bit| sum | u8::from(get(byte[bit])) << bit);
            }
            let image = executive.image();
            for region in &own {
                let bytes = region.offset as usize..(region.offset + region.size) as usize;
                ours[bytes.clone()].copy_from_slice(&image[bytes]);
            }
            if let Tables::Pmac(tables) = &bench.lowered.program.tables {
                // The states of its PLCs lie behind the image.
                let states = (Layout::new(tables.controller).size as usize).next_multiple_of(64);
                for (at, plc) in tables.programs.iter().enumerate() {
                    let name = format!("PLC{}{}", if plc.compiled { "C" } else { "" }, plc.number);
                    let key = names.find(&name, Purpose::Watch).unwrap();
                    let bit = |bit| u8::from(get(system.memory.bit(states + 4 * at, bit)));
                    let (status, ours) = (executive.read(key).number(), bit(0) + 2 * bit(1));
                    assert_eq!(
                        status,
                        Some(ours.into()),
                        "seed {seed}, tick {tick}: {name}\n{text}"
                    );
                }
            }
            if ours != image {
                let offset = (0..image.len()).find(|&at| ours[at] != image[at]).unwrap();
                let region = bench.lowered.program.regions.iter().find(|region| {
                    (region.offset..region.offset + region.size).contains(&(offset as u32))
                });
                let region = region.map_or("", |region| region.name.as_str());
                let (byte, ours) = (image[offset], ours[offset]);
                panic!(
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

#[test]
fn a_tick_of_pmac_is_what_the_executive_does() {
    compare(
        Dialect::Pmac,
        |rng| support::pmac::program(rng, support::pmac::Kind::All),
        support::seeds(40),
    );
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

/// The same of PMAC.
fn never_pmac(rng: &mut Rng) -> (String, String) {
    let (text, condition) = support::pmac::program(rng, support::pmac::Kind::Few);
    (text, format!("never {condition}"))
}

#[test]
fn answers_about_pmac_agree_with_a_search_of_all_states() {
    answers(Dialect::Pmac, never_pmac, &["M1", "M2"], support::seeds(40));
}

#[test]
fn answers_about_nct_agree_with_a_search_of_all_states() {
    answers(Dialect::Nct, never_nct, &["I000", "I001", "I002"], support::seeds(24));
}
