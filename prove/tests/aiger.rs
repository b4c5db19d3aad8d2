//! AIGER files: a reader of the format runs them, and they do what the systems do of which they were made.

#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod support;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::time::Duration;

use fastrand::Rng;
use plcc_abi::Dialect;
use plcc_prove::Answer;
use plcc_prove::aiger::{Coding, write};
use plcc_prove::control::Source;
use plcc_prove::logic::Lit;
use plcc_prove::scan::Builder;
use plcc_prove::system::{First, Latch, System, Time};
use rustc_hash::FxHashMap;
use support::Bench;

/// A file as it was read.
#[derive(Debug, Default, PartialEq)]
struct File {
    inputs: usize,
    /// Of each latch what it becomes, and what it is at power-up, `None` where it is anything.
    latches: Vec<(u32, Option<bool>)>,
    ands: Vec<(u32, u32)>,
    bad: Vec<u32>,
    /// By their letters and numbers, as in `i0`.
    names: BTreeMap<String, String>,
}

fn line<'b>(bytes: &mut &'b [u8]) -> &'b str {
    let end = bytes.iter().position(|byte| *byte == b'\n').unwrap();
    let (line, rest) = bytes.split_at(end);
    *bytes = &rest[1..];
    std::str::from_utf8(line).unwrap()
}

fn numbers(line: &str) -> Vec<u32> {
    line.split(' ').map(|number| number.parse().unwrap()).collect()
}

/// Reads a file of either form, written from the description of the format.
fn read(mut bytes: &[u8]) -> File {
    let header = line(&mut bytes);
    let (form, counts) = header.split_once(' ').unwrap();
    let counts = numbers(counts);
    let [last, inputs, latches, outputs, ands, bad] = counts[..] else { panic!("{header}") };
    assert_eq!((last, outputs), (inputs + latches + ands, 0), "{header}");
    let mut file = File { inputs: inputs as usize, ..File::default() };
    let is_text = form == "aag";
    for index in 0..inputs {
        assert!(!is_text || numbers(line(&mut bytes)) == [2 * (index + 1)]);
    }
    for index in 0..latches {
        let own = 2 * (inputs + index + 1);
        let mut all = numbers(line(&mut bytes));
        if is_text {
            assert_eq!(all.remove(0), own);
        }
        let first = match all.get(1).copied().unwrap_or(0) {
            number @ (0 | 1) => Some(number == 1),
            number => {
                assert_eq!(number, own);
                None
            }
        };
        file.latches.push((all[0], first));
    }
    for _ in 0..bad {
        file.bad.extend(numbers(line(&mut bytes)));
    }
    for index in 0..ands {
        let own = 2 * (inputs + latches + index + 1);
        let [high, low] = if is_text {
            let all = numbers(line(&mut bytes));
            assert_eq!(all[0], own);
            [all[1], all[2]]
        } else {
            let mut difference = || {
                let (mut value, mut shift) = (0, 0);
                loop {
                    let byte = bytes[0];
                    bytes = &bytes[1..];
                    value |= u32::from(byte & 0x7F) << shift;
                    shift += 7;
                    if byte & 0x80 == 0 {
                        return value;
                    }
                }
            };
            let high = own - difference();
            [high, high - difference()]
        };
        assert!(own > high && high >= low, "{own} {high} {low}");
        file.ands.push((high, low));
    }
    while !bytes.is_empty() && !bytes.starts_with(b"c\n") {
        let (symbol, name) = line(&mut bytes).split_once(' ').unwrap();
        assert!(file.names.insert(symbol.into(), name.into()).is_none());
    }
    let distinct: BTreeSet<&String> = file.names.values().collect();
    assert_eq!(distinct.len(), file.names.len(), "each name is there once");
    file
}

impl File {
    /// What latches are at power-up; `free` says of those that are anything, by their names.
    fn first(&self, free: &dyn Fn(&str) -> bool) -> Vec<bool> {
        let latches = self.latches.iter().enumerate();
        latches
            .map(|(index, (_, first))| {
                first.unwrap_or_else(|| free(&self.names[&format!("l{index}")]))
            })
            .collect()
    }

    /// Runs a tick; gives which questions are broken in it.
    fn tick(&self, state: &mut Vec<bool>, input: &dyn Fn(&str) -> bool) -> Vec<bool> {
        let mut values = vec![false];
        values.extend((0..self.inputs).map(|index| input(&self.names[&format!("i{index}")])));
        values.extend(state.iter());
        for &(a, b) in &self.ands {
            let value = value(&values, a) && value(&values, b);
            values.push(value);
        }
        *state = self.latches.iter().map(|(next, _)| value(&values, *next)).collect();
        self.bad.iter().map(|&bad| value(&values, bad)).collect()
    }
}

fn value(values: &[bool], number: u32) -> bool {
    values[number as usize / 2] != (number % 2 == 1)
}

/// Writes literals of a system in both forms, which have to be the same.
fn both(system: &System, bad: &[(String, Lit)]) -> File {
    let called = |offset, bit| Some(format!("{offset}.{bit}"));
    let file = read(&write(system, bad, &called, Coding::Binary).bytes);
    assert_eq!(file, read(&write(system, bad, &called, Coding::Text).bytes));
    file
}

/// Runs random literals of systems beside the files that have them as questions.
fn compare(dialect: Dialect, make: fn(&mut Rng) -> (String, String), seeds: std::ops::Range<u64>) {
    let mut free = 0;
    for seed in seeds {
        let mut rng = Rng::with_seed(seed);
        let (text, _) = make(&mut rng);
        let bench = Bench::new(dialect, &text);
        let mut source = bench.source();
        source.settings.as_declared = seed % 2 == 0;
        let system = Source { ..source }.system(Time::Exact, &BTreeSet::new()).unwrap();
        let count = system.builder.graph.len() as u32;
        let mut bad: Vec<(String, Lit)> = (0..20)
            .map(|number| {
                let lit = Lit::of_node(count - 1 - rng.u32(..count.min(2_000)));
                (format!("question {number}"), lit.complement_if(rng.bool()))
            })
            .collect();
        if !system.retained.is_empty() {
            let kept = &system.retained[rng.usize(..system.retained.len())];
            bad.push((kept.name.clone(), kept.bits[0]));
        }
        let file = both(&system, &bad);
        assert_eq!(file.names["b7"], "question 7");
        free += file.latches.iter().filter(|(_, first)| first.is_none()).count();
        let kept: HashMap<String, bool> = (system.retained.iter())
            .flat_map(|variable| names_of(&variable.name, &variable.bits))
            .map(|(name, _)| (name, rng.bool()))
            .collect();
        let mut state: HashMap<u32, bool> = HashMap::new();
        for latch in &system.latches {
            state.insert(latch.lit.node(), latch.first == First::Constant(true));
        }
        for variable in &system.retained {
            for (name, bit) in names_of(&variable.name, &variable.bits) {
                state.insert(bit.node(), kept[&name]);
            }
        }
        let mut theirs = file.first(&|name| kept[name]);
        for tick in 0..20 {
            let mut inputs = state.clone();
            let mut by_name = HashMap::new();
            for variable in &system.inputs {
                for (name, bit) in names_of(&variable.name, &variable.bits) {
                    let on = rng.u8(..3) == 0;
                    inputs.insert(bit.node(), on);
                    by_name.insert(name, on);
                }
            }
            let values = support::values(&system.builder.graph, &inputs);
            let get = |lit: Lit| values[lit.node() as usize] != lit.is_complement();
            let ours: Vec<bool> = bad.iter().map(|(_, lit)| get(*lit)).collect();
            let broken = file.tick(&mut theirs, &|name| {
                // What is not followed is false in `support::values`.
                by_name.get(name).copied().unwrap_or(false)
            });
            assert_eq!(broken, ours, "seed {seed}, tick {tick}\n{text}");
            for latch in &system.latches {
                state.insert(latch.lit.node(), get(latch.next));
            }
        }
    }
    assert!(dialect == Dialect::Pmi || free > 0, "no latch may be anything at power-up");
}

/// The names of the bits of a variable.
fn names_of(name: &str, bits: &[Lit]) -> Vec<(String, Lit)> {
    match bits {
        [bit] => vec![(name.to_owned(), *bit)],
        bits => bits.iter().zip(0..).map(|(&bit, at)| (format!("{name}.{at}"), bit)).collect(),
    }
}

#[test]
fn a_file_does_what_its_system_of_pmi_does() {
    compare(Dialect::Pmi, support::pmi, support::seeds(24));
}

#[test]
fn a_file_does_what_its_system_of_nct_does() {
    compare(Dialect::Nct, support::nct, support::seeds(12));
}

#[test]
fn a_latch_that_begins_as_another_one_has_its_value_in_the_first_tick() {
    let mut builder = Builder::default();
    let (a, b, input) = (builder.graph.input(), builder.graph.input(), builder.graph.input());
    let differ = builder.graph.xor(a, b);
    let latch = |lit, first, next| Latch { lit, first, next, place: None };
    let latches = vec![latch(a, First::Free, input), latch(b, First::As(!a), input)];
    let none = || plcc_prove::logic::Memory::of_bytes(&[]);
    let system = System {
        builder,
        latches,
        inputs: vec![],
        retained: vec![],
        memory: none(),
        running: plcc_prove::logic::TRUE,
        stops: plcc_prove::logic::FALSE,
        elapses: vec![],
        observed: vec![],
        same: FxHashMap::default(),
    };
    let mut file = both(&system, &[("differ".into(), differ)]);
    file.names.extend([("i0".into(), "in".into()), ("l0".into(), "a".into())]);
    for first in [false, true] {
        let mut state = file.first(&|_| first);
        assert_eq!(file.tick(&mut state, &|_| true), [true]);
        assert_eq!(file.tick(&mut state, &|_| false), [false]);
        assert_eq!(file.tick(&mut state, &|_| true), [false]);
    }
}

/// The rows of a stimulus acted on a file: the first tick in which its only question is broken.
fn replayed(file: &File, stimulus: &str, ticks: u64) -> Option<u64> {
    let mut rows: Vec<(u64, &str, i64)> = vec![];
    for row in stimulus.lines().skip(1) {
        let [tick, name, value] = row.split(',').collect::<Vec<_>>()[..] else { panic!("{row}") };
        rows.push((tick.parse().unwrap(), name, value.parse().unwrap()));
    }
    let mut state = file.first(&|_| false);
    let mut values: HashMap<&str, i64> = HashMap::new();
    (0..ticks).find(|&tick| {
        values.extend(rows.iter().filter(|row| row.0 == tick).map(|row| (row.1, row.2)));
        let broken = file.tick(&mut state, &|name| match values.get(name) {
            Some(value) => value & 1 == 1,
            None => {
                let (name, bit) = name.rsplit_once('.').unwrap_or((name, "0"));
                let bit: u32 = bit.parse().unwrap_or(0);
                values.get(name).is_some_and(|value| value >> bit & 1 == 1)
            }
        });
        broken == [true]
    })
}

#[test]
fn a_run_that_refutes_a_question_does_so_in_the_file() {
    let mut refuted = 0;
    for seed in support::seeds(30) {
        let mut rng = Rng::with_seed(seed);
        let (text, condition) = support::pmi(&mut rng);
        let bench = Bench::new(Dialect::Pmi, &text);
        let question = bench.question(&format!("never {condition}"));
        let names = plcc_prove::Station::executive(&bench).names();
        let subject = bench.subject(&*names);
        let answer = subject.answer(&question, Duration::from_secs(60)).unwrap();
        let questions = std::slice::from_ref(&question);
        let file = read(&subject.aiger(questions, Coding::Binary).unwrap().bytes);
        assert_eq!(file.names["b0"], format!("never {condition}"));
        match answer {
            Answer::Refuted { scans, stimulus } => {
                refuted += 1;
                let found = replayed(&file, &stimulus, scans);
                assert_eq!(found, Some(scans - 1), "seed {seed}\n{text}\n{condition}\n{stimulus}");
            }
            Answer::Proved { .. } => {
                let mut state = file.first(&|_| false);
                for tick in 0..300 {
                    let on: HashMap<&String, bool> =
                        file.names.values().map(|name| (name, rng.u8(..4) == 0)).collect();
                    let broken = file.tick(&mut state, &|name| on[&name.to_owned()]);
                    assert_eq!(broken, [false], "seed {seed}, tick {tick}\n{text}\n{condition}");
                }
            }
            Answer::Undecided { .. } => {}
        }
    }
    assert!(refuted > 0, "none is refuted");
}

/// Statements before, under conditions of their own, are not part of what a question depends on: all ways come together after them.
#[test]
fn what_other_conditions_divide_is_not_in_the_file() {
    let text = "$INPUT\nA=0/0\nB=0/1\nC=0/2\n$OUTPUT\nX=1/0\nY=1/1\n$LOGICAL\nS\n$END\nIF (A)\nIF (B)\nX = 1\nELSE\nIF (S)\nX = 0\nENDIF\n\
                S = B\nENDIF\nENDIF\nIF (C)\nY = 1\nENDIF\n";
    let bench = Bench::new(Dialect::Pmi, text);
    let names = plcc_prove::Station::executive(&bench).names();
    let subject = bench.subject(&*names);
    let file = subject.aiger(&[bench.question("never Y")], Coding::Text).unwrap();
    let names: Vec<String> = read(&file.bytes).names.into_values().collect();
    assert!(names.contains(&"C".to_owned()), "{names:?}");
    let others = ["A", "B", "S", "X"].map(|name| names.contains(&name.to_owned()));
    assert_eq!(others, [false; 4], "{names:?}");
}
