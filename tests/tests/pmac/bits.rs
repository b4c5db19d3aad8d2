//! Programs of single bits in few words, which the pass `byte-bits` keeps as bytes while a function is
//! executed: with other variables in the same words, definitions that change while the program runs,
//! scans that are suspended, and commands.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use plcc_diag::SourceMap;
use plcc_frontend::common::{Controller, MemoryLoader, Options};
use plcc_frontend::pmac;
use plcc_ir::passes;
use plcc_random::{Rng, seeds};

use super::engines::compare;

/// The words that hold bits.
const WORDS: [&str; 4] = ["Y:$7C0", "X:$7C0", "Y:$7C1", "X:$7C1"];
/// How many M-variables and how many L-variables are bits.
const BITS: usize = 40;

struct Writer {
    rng: Rng,
    out: String,
    /// The letter of the current program's bits.
    letter: char,
}

impl Writer {
    fn bit(&mut self) -> String {
        // A PLCC can use M-variables, too.
        let letter = if self.rng.chance(85) { self.letter } else { 'M' };
        format!("{letter}{}", self.rng.below(BITS))
    }

    fn condition(&mut self) -> String {
        let mut text = String::new();
        for number in 0..1 + self.rng.below(4) {
            let joined = ["", " AND ", " OR "][if number == 0 { 0 } else { 1 + self.rng.below(2) }];
            let (bit, value) = (self.bit(), self.rng.below(2));
            let _ = write!(text, "{joined}{bit}={value}");
        }
        text
    }

    /// Writes some statements.
    fn statements(&mut self, count: usize, depth: usize) {
        for _ in 0..count {
            let bit = self.bit();
            let line = match self.rng.below(24) {
                0..7 => {
                    let condition = self.condition();
                    format!("IF ({condition})\n{bit}=1\nELSE\n{bit}=0\nENDIF")
                }
                7..11 => {
                    let (condition, value) = (self.condition(), self.rng.below(2));
                    format!("IF ({condition})\n{bit}={value}\nENDIF")
                }
                11..15 => {
                    let (a, b, c) = (self.bit(), self.bit(), self.bit());
                    format!("{bit}={a}&{b}|{c}^1")
                }
                15 => format!("{bit}={}", self.rng.below(2)),
                16 => format!("{bit}={}+{}", self.bit(), self.bit()),
                17 if depth > 0 => {
                    let condition = self.condition();
                    let _ = writeln!(self.out, "IF ({condition})");
                    let count = 1 + self.rng.below(6);
                    self.statements(count, depth - 1);
                    if self.rng.chance(40) {
                        self.out.push_str("ELSE\n");
                        self.statements(2, depth - 1);
                    }
                    "ENDIF".to_owned()
                }
                18 if depth > 0 && self.letter == 'M' => {
                    let condition = self.condition();
                    let _ = writeln!(self.out, "WHILE ({condition})");
                    self.statements(2, depth - 1);
                    "ENDWHILE".to_owned()
                }
                19 => format!("P{}={bit}+{}", self.rng.below(4), self.bit()),
                20 => format!("{bit}=P{}", self.rng.below(4)),
                21 if self.rng.chance(40) => {
                    // Changes a definition, or does something else by the host.
                    let (number, word) = (self.rng.below(BITS), self.rng.below(WORDS.len()));
                    match self.rng.below(3) {
                        0 => format!("CMD\"M{number}->{},{},1\"", WORDS[word], self.rng.below(24)),
                        1 => "SEND\"text\"".to_owned(),
                        _ => format!("CMD\"M{number}={}\"", self.rng.below(2)),
                    }
                }
                22 if self.rng.chance(10) => match self.rng.below(3) {
                    0 => "M101=M101+3".to_owned(),
                    1 => format!("M{}={bit}", 102 + self.rng.below(2)),
                    _ => format!("P{}=M{}", self.rng.below(4), 101 + self.rng.below(3)),
                },
                _ => format!("{bit}={}", self.bit()),
            };
            self.out.push_str(&line);
            self.out.push('\n');
        }
    }
}

/// A download with bits as most of its variables, and a stimulus for so many ticks.
fn generate(seed: u64, ticks: usize) -> (String, String) {
    let mut writer = Writer { rng: Rng::new(seed), out: "I5=3\n".to_owned(), letter: 'M' };
    for letter in ['M', 'L'] {
        for number in 0..BITS {
            let word = WORDS[writer.rng.below(WORDS.len())];
            let bit = writer.rng.below(24);
            let _ = writeln!(writer.out, "{letter}{number}->{word},{bit},1");
        }
    }
    // Some variables of more bits, of a register, and of a place beside the words.
    writer.out.push_str("M101->X:$7C1,4,4\nM102->Y:$FFC2,8,1\nM103->Y:$7C2,0,24\n");
    for (compiled, number) in [(false, 1), (true, 2), (false, 3)] {
        writer.letter = if compiled { 'L' } else { 'M' };
        let name = if compiled { "PLCC" } else { "PLC" };
        let _ = writeln!(writer.out, "OPEN {name} {number} CLEAR");
        let count = 10 + writer.rng.below(40);
        writer.statements(count, 2);
        writer.out.push_str("CLOSE\n");
        let _ = writeln!(writer.out, "ENABLE {name} {number}");
    }
    let mut stimulus = "tick,variable,value\n".to_owned();
    for tick in 0..ticks {
        for _ in 0..6 {
            let (number, value) = (writer.rng.below(BITS), writer.rng.below(2));
            let _ = writeln!(stimulus, "{tick},M{number},{value}");
        }
    }
    (writer.out, stimulus)
}

/// Whether the pass `byte-bits` changes something.
fn is_changed(source: &str) -> bool {
    let mut sources = SourceMap::new();
    let file = sources.add("generated.pmc", source.as_bytes());
    let (loader, options) = (MemoryLoader::new(), Options::default());
    let program = pmac::check(&mut sources, &[file], &loader, &options).0.unwrap();
    let mut module = program.lower().unwrap().module;
    passes::optimize(&mut module, plcc_ir_tests::as_if_long().passes);
    module.funcs().any(|(_, func)| func.local_bits() > 0)
}

#[test]
fn bits_of_words_are_the_same_in_all_engines() {
    const TICKS: usize = 16;
    let mut changed = 0;
    for seed in seeds(8) {
        let (source, stimulus) = generate(seed, TICKS);
        changed += u32::from(is_changed(&source));
        compare(&source, &stimulus, TICKS as u32, Controller::Pmac);
    }
    assert!(changed > 4, "few programs keep bits as bytes: {changed}");
}
