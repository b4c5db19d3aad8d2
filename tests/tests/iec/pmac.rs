//! PMAC: PLCs whose values are whole numbers or doubles.

use std::fmt::Write as _;
use std::path::Path;

use plcc_abi::Dialect;
use plcc_diag::SourceMap;
use plcc_frontend::common::{Controller, Options};
use plcc_random::{Rng, seeds};
use plcc_tests::{gen_pmac, idioms};

use crate::matiec;
use crate::run::{Compared, Rules, compare, compare_files};

const RULES: Rules = Rules {
    dialect: Dialect::Pmac,
    is_given: |name| name.starts_with(['P', 'M', 'Q']),
    line: |address| address.to_owned(),
    from_control: |_| None,
    differs: |_| false,
    bits_alone: true,
    is_output: |_, _| false,
};

struct Generator {
    rng: Rng,
    out: String,
}

impl Generator {
    fn variable(&mut self) -> String {
        match self.rng.below(4) {
            0 => format!("M{}", 1 + self.rng.below(9)),
            1 => format!("Q{}", self.rng.below(3)),
            _ => format!("P{}", self.rng.below(6)),
        }
    }

    fn operand(&mut self, depth: usize) -> String {
        let number =
            *self.rng.pick(&["0", "1", "3", "7", "0.5", "2.25", "255", "$FF", "1000000", "-4"]);
        match self.rng.below(if depth == 0 { 3 } else { 6 }) {
            0 => number.to_owned(),
            1 | 2 => self.variable(),
            3 => {
                let function = *self.rng.pick(&["ABS", "INT", "SQRT"]);
                format!("{function}({})", self.operand(depth - 1))
            }
            _ => {
                let operator = *self.rng.pick(&["+", "-", "*", "/", "%", "&", "|", "^"]);
                format!("({}{operator}{})", self.operand(depth - 1), self.operand(depth - 1))
            }
        }
    }

    fn condition(&mut self) -> String {
        let comparator = *self.rng.pick(&["=", "!=", ">", "!>", "<", "!<", "~", "!~"]);
        let one = format!("{}{comparator}{}", self.operand(1), self.operand(1));
        match self.rng.below(4) {
            0 => format!("{one} AND {}>{}", self.variable(), self.operand(0)),
            1 => format!("{one} OR {}<{}", self.variable(), self.operand(0)),
            _ => one,
        }
    }

    fn statement(&mut self, depth: usize) {
        let target = self.variable();
        match self.rng.below(if depth == 0 { 6 } else { 9 }) {
            0..=3 => {
                let value = self.operand(3);
                let _ = writeln!(self.out, "{target}={value}");
            }
            4 => {
                let operation = *self.rng.pick(&["ENABLE", "DISABLE", "PAUSE", "RESUME"]);
                let number = 1 + self.rng.below(2);
                let _ = writeln!(self.out, "{operation} PLC {number}");
            }
            5 => {
                let value = self.operand(1);
                let _ = writeln!(self.out, "P2..4={value}");
            }
            6 => {
                let condition = self.condition();
                let _ = writeln!(self.out, "WHILE ({condition})");
                self.statement(depth - 1);
                self.out.push_str("ENDWHILE\n");
            }
            _ => {
                let condition = self.condition();
                let _ = writeln!(self.out, "IF ({condition})");
                self.statement(depth - 1);
                if self.rng.chance(40) {
                    self.out.push_str("ELSE\n");
                    self.statement(depth - 1);
                }
                self.out.push_str("ENDIF\n");
            }
        }
    }
}

/// A program of what can be exported.
fn generate(seed: u64) -> String {
    let rng = Rng::new(seed);
    let mut this = Generator { rng, out: String::new() };
    let runs = 1 + this.rng.below(3);
    let _ = writeln!(this.out, "I5={runs} I8={} P1=2.5 Q1=-3", this.rng.below(3));
    this.out.push_str("M1->Y:$FFC2,8\nM2->Y:$FFC2,9 ; the pump\nM3->Y:$FFC2,0,8\nM4->Y:$FFC3,0,8,S\nM5->Y:$FFC3,4,8\nM6->X:$0700,0,24,S\nM7->X:$0,0,24\nM8->X:$FFC4,0,24,S\nM9->X:$FFC5,3,12\n");
    for (name, number) in [("PLC", 0), ("PLC", 1), ("PLC", 2), ("PLC", 5), ("PLCC", 0), ("PLCC", 3)]
    {
        let _ = writeln!(this.out, "OPEN {name} {number} CLEAR");
        for _ in 0..1 + this.rng.below(5) {
            this.statement(2);
        }
        this.out.push_str("CLOSE\n");
    }
    if this.rng.chance(30) {
        this.out.push_str("DISABLE PLC 2\n");
    }
    this.out
}

/// How many programs are compared, and how many can't be exported.
fn compare_all(programs: impl Iterator<Item = (u64, String)>) -> (usize, usize) {
    let (mut same, mut refused) = (0, 0);
    for (seed, source) in programs {
        match compare(&RULES, &[("case.pmc", &source)], seed) {
            Some(Compared::Same { .. }) => same += 1,
            Some(Compared::NotExported(why)) => {
                assert!(why.iter().all(|text| text.contains("PMAC-X10")), "{why:?}");
                refused += 1;
            }
            None => panic!("{source}"),
        }
    }
    eprintln!("{same} programs; {refused} not exported");
    (same, refused)
}

#[test]
fn generated_programs_run_alike() {
    let Some(_) = matiec::folder() else { return };
    let (_, refused) = compare_all(seeds(20).map(|seed| (seed, generate(seed))));
    assert_eq!(refused, 0);
}

#[test]
fn programs_of_other_generators_run_alike_or_are_told() {
    let Some(_) = matiec::folder() else { return };
    compare_all(seeds(10).map(|seed| (seed, gen_pmac::generate(seed, 20).source)));
    compare_all(seeds(10).map(|seed| (seed, idioms::pmac::generate(seed, false).source)));
}

#[test]
fn examples_cases_and_the_corpus_run_alike_or_are_told() {
    let Some(_) = matiec::folder() else { return };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (mut count, mut refused, mut wrong) = (0, 0, 0);
    let mut open = vec![
        root.join("examples/pmac"),
        root.join("tests/conformance/pmac"),
        root.join("tests/corpus/pmac"),
    ];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(std::fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
            continue;
        }
        if path
            .extension()
            .is_none_or(|ending| !["pmc", "plc", "pmac"].iter().any(|it| ending == *it))
        {
            continue;
        }
        for controller in [Controller::Pmac, Controller::Turbo] {
            let mut sources = SourceMap::new();
            let file = plcc_tests::compile::add(&mut sources, &path).unwrap();
            let options = Options { controller, ..Options::default() };
            match compare_files(&RULES, &mut sources, &[file], 1, &options) {
                Some(Compared::Same { .. }) => count += 1,
                Some(Compared::NotExported(_)) => refused += 1,
                // It is for the other controller, or one of several files.
                None => wrong += 1,
            }
        }
    }
    eprintln!("{count} programs; {refused} not exported, {wrong} not valid alone");
    assert!(count > 10, "{count}");
}
