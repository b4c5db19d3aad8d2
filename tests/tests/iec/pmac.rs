//! PMAC: PLCs whose values are whole numbers or doubles.

use std::fmt::Write as _;
use std::path::Path;

use plcc_abi::Dialect;
use plcc_frontend::common::{Controller, Options};
use plcc_random::{Rng, seeds};
use plcc_tests::{gen_pmac, idioms};

use crate::batch::{Batch, files};
use crate::case::Rules;
use crate::source::exported;

static RULES: Rules = Rules {
    dialect: Dialect::Pmac,
    is_given: |name| name.starts_with(['P', 'M', 'Q']),
    line: |address| address.to_owned(),
    from_control: |_| None,
    differs: |_| false,
    bits_alone: true,
    is_output: |_, _| false,
    refusal: "PMAC-X10",
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

/// Compares generated programs. Gives how many can't be exported.
fn compare_all(what: &str, default_count: u64, generate: impl Fn(u64) -> String) -> usize {
    let Some(mut batch) = Batch::new(&RULES) else { return 0 };
    for seed in seeds(default_count) {
        batch.generated("case.pmc", &generate(seed), seed);
    }
    batch.finish(what).refused
}

#[test]
fn generated_programs_run_alike() {
    assert_eq!(compare_all("PMAC, generated", 20, generate), 0);
}

#[test]
fn programs_of_other_generators_run_alike_or_are_told() {
    compare_all("PMAC, other generator", 10, |seed| gen_pmac::generate(seed, 20).source);
    compare_all("PMAC, idioms", 10, |seed| idioms::pmac::generate(seed, false).source);
}

/// IronPLC takes a literal for a REAL of 32 bits, where the operand of a function has nothing beside it.
#[test]
fn numbers_that_32_bits_do_not_hold_have_their_type() {
    let source = "\
I5=3
OPEN PLC 0 CLEAR
P1=P2/549755813888.5
P3=ABS(-0.1)
P4=16777216+1-P1
P5=P5-16777216-1
IF (16777216+1>16777216)
P6=SQRT(10000000000000000000000000000000000000000)*2.5
ENDIF
IF (1~.000000000931322574615478515625)
P7=0.1
ENDIF
CLOSE
";
    let text = exported(&RULES, "case.pmc", source);
    for line in [
        "P1 := FLOAT_FINITE(FLOAT_DIV(P2, LREAL#549755813888.5));",
        "P3 := FLOAT_ABS(-LREAL#0.1);",
        "P4 := FLOAT_FINITE(LREAL#16777216.0 + 1.0 - P1);",
        "P5 := FLOAT_FINITE(P5 - 16777216.0 - 1.0);",
        "IF LREAL#16777216.0 + 1.0 > 16777216.0 THEN",
        "IF FLOAT_ABS(LREAL#1.0 - 9.313225746154785E-10) < 1.0 THEN",
        "P7 := LREAL#0.1;",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    let Some(mut batch) = Batch::new(&RULES) else { return };
    batch.generated("case.pmc", source, 1);
    batch.finish("PMAC, numbers");
}

/// What `defines.tsv` beside a file of the corpus defines for it.
fn defines(path: &Path) -> Vec<(String, String)> {
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    let table = std::fs::read_to_string(path.with_file_name("defines.tsv")).unwrap_or_default();
    let row = table.lines().filter_map(|row| row.split_once('\t')).find(|row| row.0 == name);
    let defines = row.map_or("", |row| row.1).split_whitespace();
    let pairs = defines.map(|define| define.split_once('=').unwrap());
    pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).collect()
}

#[test]
fn examples_cases_and_the_corpus_run_alike_or_are_told() {
    let Some(mut batch) = Batch::new(&RULES) else { return };
    let folders = ["examples/pmac", "examples/desk", "tests/conformance/pmac", "tests/corpus/pmac"];
    for path in files(&folders, &["pmc", "plc", "pmac"]) {
        for controller in [Controller::Pmac, Controller::Turbo] {
            let defines = defines(&path);
            batch.file(&path, &Options { controller, defines, ..Options::default() });
        }
    }
    let tally = batch.finish("PMAC, files");
    assert!(tally.compared > 10, "{tally:?}");
}
