//! Random PMAC downloads that are valid, with PLCs, PLCCs, loops, moved definitions, commands,
//! and a stimulus.
//!
//! The same seed gives the same case. Every statement form of a PLC comes up; numbers are taken
//! from the edges of the formats more often than not.

use std::fmt::Write as _;

pub use crate::gen_pmi::Case;
use plcc_random::Rng;

/// M-variables that are defined in every program, with their definitions.
const M: &[(u32, &str)] = &[
    (1, "Y:$FFC2,8,1"),
    (2, "Y:$FFC2,9,1"),
    (3, "Y:$FFC2,0,8"),
    (4, "X:$07F0,0,24,S"),
    (5, "X:$07F1,24"),
    (6, "Y:$07F0,4,12,S"),
    (7, "Y:$07F1,0,8,D"),
    (8, "X:$07F2,8,8,C"),
    (9, "D:$07F3"),
    (10, "DP:$D200"),
    (11, "F:$D201"),
    (12, "L:$07F5"),
    (13, "L:$1020"),
    (14, "X:$1021,0,24,S"),
    (15, "TWD:4,0.8.3,U"),
    (16, "X:$0,24"),
    (17, "X:$0700,0,24,S"),
    (34, "L:$1028"),
    (35, "Y:$BC22,0,16"),
    (36, "Y:$BC01,0,16"),
    (37, "L:$1402"),
    (33, "Y:$BC22,0,16"),
];

/// L-variables and their definitions.
const L: &[(u32, &str)] = &[
    (1, "X:$07F8,0,24,S"),
    (2, "X:$07F9,0,24"),
    (3, "Y:$07F8,0,8"),
    (4, "Y:$07F9,3,12,S"),
    (5, "Y:$FFC2,10,1"),
    (6, "X:$07FA,0,16,D"),
    (7, "X:$07F0,0,24,S"),
];

const NUMBERS: &[&str] = &[
    "0",
    "1",
    "2",
    "3",
    "7",
    "8",
    "10",
    "255",
    "256",
    "0.5",
    "1.5",
    "2.5",
    "0.25",
    "1000",
    "8388607",
    "8388608",
    "16777215",
    "16777216",
    "$FF",
    "$800000",
    "3.7",
    "549755813888",
    "9007199254740993",
    "1000000000000000000000",
    "123456.789",
];

struct Generator {
    rng: Rng,
    out: String,
    /// The PLC at hand is a PLCC, and which.
    compiled: bool,
    number: usize,
    lines: usize,
}

/// A case of about `size` statements.
pub fn generate(seed: u64, size: usize) -> Case {
    let mut g = Generator {
        rng: Rng::new(seed),
        out: String::from("I5=3\n"),
        compiled: false,
        number: 1,
        lines: size,
    };
    g.definitions();
    for number in [0, 1, 2, 7] {
        g.program(false, number);
    }
    for number in [0, 3] {
        g.program(true, number);
    }
    if g.rng.chance(30) {
        g.out.push_str("DISABLE PLC 7\n");
    }
    let mut watch: Vec<String> = (0..12).map(|n| format!("P{n}")).collect();
    watch.extend(M.iter().map(|(n, _)| format!("M{n}")));
    watch.extend(L.iter().map(|(n, _)| format!("L{n}")));
    let ticks = 24;
    let mut stimulus = String::from("tick,name,value\n");
    for tick in 0..ticks {
        if g.rng.chance(10) {
            // Nobody sees in the text that this moves a definition.
            let (number, address) = (3 + g.rng.below(4), 0x07F0 + g.rng.below(4));
            let _ = writeln!(stimulus, "{tick},Y:${:X},{address}", 0xBC00 + number);
        }
        while g.rng.chance(50) {
            let name = match g.rng.below(4) {
                0 => format!("P{}", g.rng.below(12)),
                1 => format!("L{}", L[g.rng.below(L.len())].0),
                2 => format!("Q{}", g.rng.below(4)),
                _ => format!("M{}", M[g.rng.below(13)].0),
            };
            let value = g.rng.pick(&["0", "1", "-1", "5", "2.5", "-3.75", "$FFFFFF", "1000000"]);
            let _ = writeln!(stimulus, "{tick},{name},{value}");
        }
    }
    Case { source: g.out, stimulus, watch, ticks }
}

impl Generator {
    fn line(&mut self, text: &str) {
        self.out.push_str(text);
        self.out.push('\n');
    }

    fn definitions(&mut self) {
        for (number, definition) in M {
            self.line(&format!("M{number}->{definition}"));
        }
        for (number, definition) in L {
            self.line(&format!("L{number}->{definition}"));
        }
        for n in 0..6 {
            let value = self.literal();
            let sign = if self.rng.chance(30) { "-" } else { "" };
            self.line(&format!("P{n}={sign}{value} Q{n}=P{n}/3 M{}={n}", n + 1));
        }
        let radians = self.rng.below(2);
        self.line(&format!("I15={radians}"));
    }

    fn program(&mut self, compiled: bool, number: usize) {
        (self.compiled, self.number) = (compiled, number);
        let name = if compiled { "PLCC" } else { "PLC" };
        self.line(&format!("OPEN {name} {number} CLEAR"));
        let mut budget = self.lines / 6 + 2;
        while budget > 0 {
            self.statement(&mut budget, 0);
        }
        self.line("CLOSE");
    }

    fn literal(&mut self) -> String {
        (*self.rng.pick(NUMBERS)).to_owned()
    }

    fn variable(&mut self) -> String {
        match self.rng.below(if self.compiled { 12 } else { 10 }) {
            0..4 => format!("P{}", self.rng.below(12)),
            4 => format!("Q{}", self.rng.below(4)),
            5 => format!("I{}", self.rng.pick(&[8, 10, 15, 20])),
            6..10 => format!("M{}", M[self.rng.below(M.len())].0),
            _ => self.long(),
        }
    }

    fn long(&mut self) -> String {
        format!("L{}", L[self.rng.below(L.len())].0)
    }

    fn operand(&mut self, depth: usize) -> String {
        match self.rng.below(10) {
            0..3 => self.literal(),
            3..7 => self.variable(),
            7 if depth < 3 => format!("({})", self.expression(depth + 1)),
            8 if depth < 3 => {
                let function = self.rng.pick(&[
                    "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "ATAN2", "SQRT", "LN", "EXP",
                    "ABS", "INT",
                ]);
                format!("{function}({})", self.expression(depth + 1))
            }
            9 if depth < 3 => {
                let kind = self.rng.pick(&["P", "Q", "M", "I"]);
                format!("{kind}({})", self.expression(depth + 1))
            }
            _ => format!("-P{}", self.rng.below(12)),
        }
    }

    fn expression(&mut self, depth: usize) -> String {
        let mut text = self.operand(depth);
        while self.rng.chance(45) {
            let op = self.rng.pick(&["+", "-", "*", "/", "%", "&", "|", "^", "+", "-"]);
            text.push_str(op);
            text.push_str(&self.operand(depth));
        }
        text
    }

    /// An expression of L-variables alone.
    fn integers(&mut self, depth: usize) -> String {
        let mut text = String::new();
        loop {
            let operand = match self.rng.below(6) {
                0 => (*self.rng.pick(&["0", "1", "3", "7", "8388607", "$FF"])).to_owned(),
                1 if depth < 3 => format!("({})", self.integers(depth + 1)),
                2 if depth < 3 => {
                    format!("{}({})", self.rng.pick(&["ABS", "INT"]), self.integers(depth + 1))
                }
                3 => format!("-{}", self.long()),
                _ => self.long(),
            };
            text.push_str(&operand);
            if self.rng.chance(50) {
                return text;
            }
            let operator: &&str = self.rng.pick(&["+", "-", "*", "/", "%", "&", "|", "^"]);
            text.push_str(operator);
        }
    }

    fn comparison(&mut self, integer: bool) -> String {
        let cmp = *self.rng.pick(&["=", "!=", ">", "!>", "<", "!<", "~", "!~"]);
        if integer {
            return format!("{}{cmp}{}", self.integers(1), self.integers(1));
        }
        format!("{}{cmp}{}", self.expression(2), self.expression(2))
    }

    fn condition(&mut self) -> String {
        let integer = self.compiled && self.rng.chance(50);
        let mut text = format!("({}", self.comparison(integer));
        while self.rng.chance(25) {
            let word = self.rng.pick(&[" AND ", " OR "]);
            text.push_str(word);
            text.push_str(&self.comparison(integer));
        }
        text.push(')');
        while self.rng.chance(15) {
            let word = self.rng.pick(&[" AND ", " OR ", "\nAND", "\nOR"]);
            text.push_str(word);
            text.push_str(&format!("({})", self.comparison(integer)));
        }
        text
    }

    fn assignment(&mut self) -> String {
        if self.compiled && self.rng.chance(50) {
            return format!("{}={}", self.long(), self.integers(0));
        }
        match self.rng.below(16) {
            0 => format!("P({})={}", self.expression(2), self.expression(0)),
            1 => format!("M({})={}", self.rng.below(13) + 1, self.expression(0)),
            // Moves a definition among P-variables.
            2 => format!("M35={}+INT(ABS(P{})%8)", 0x1020, self.rng.below(12)),
            3 if self.rng.chance(20) => format!("M36={}", 0x07F0 + self.rng.below(4)),
            4 => {
                let op = self.rng.pick(&["&", "|", "^"]);
                let target = self.target();
                format!("{target}{op}={}", self.expression(1))
            }
            5 => format!("P{}..{}={}", 4, 4 + self.rng.below(4), self.expression(1)),
            6 => format!("M1..{}={}", 2 + self.rng.below(12), self.expression(1)),
            // Moves M34 before and after it is written.
            7 => format!("M33..35={}+INT(ABS(P{})%8)", 0x1020, self.rng.below(12)),
            _ => {
                let target = self.target();
                format!("{target}={}", self.expression(0))
            }
        }
    }

    /// A variable that can be assigned without harm to what runs when.
    fn target(&mut self) -> String {
        match self.rng.below(8) {
            0..4 => format!("P{}", self.rng.below(12)),
            4 => format!("Q{}", self.rng.below(4)),
            5 => format!("I{}", self.rng.pick(&[15, 20, 60])),
            _ => format!("M{}", M[self.rng.below(18)].0),
        }
    }

    fn statement(&mut self, budget: &mut usize, depth: usize) {
        *budget = budget.saturating_sub(1);
        match self.rng.below(20) {
            0..3 if depth < 4 => {
                let condition = self.condition();
                self.line(&format!("IF{condition}"));
                for _ in 0..1 + self.rng.below(3) {
                    self.statement(budget, depth + 1);
                }
                if self.rng.chance(40) {
                    self.line("ELSE");
                    self.statement(budget, depth + 1);
                }
                let end = *self.rng.pick(&["ENDIF", "ENDI", "END IF"]);
                self.line(end);
            }
            3 if depth < 4 => {
                let condition = self.condition();
                self.line(&format!("WHILE{condition}"));
                if self.rng.chance(80) {
                    self.statement(budget, depth + 1);
                }
                let end = *self.rng.pick(&["ENDWHILE", "ENDW"]);
                self.line(end);
            }
            4 => {
                let text = match self.rng.below(9) {
                    0 => "CMD\"P9=P9+1\"".to_owned(),
                    1 => "COMMAND\"M34->L:$1023\"".to_owned(),
                    2 => "CMD\"M1->Y:$FFC2,11,1\"".to_owned(),
                    3 => "CMD\"ENABLE PLC7\"".to_owned(),
                    4 => "CMD\"#1J+\"".to_owned(),
                    5 => "SEND\"text\"".to_owned(),
                    6 => format!("DISPLAY 3,8.2,P{}", self.rng.below(12)),
                    7 => "CMD\"Q2=Q2+1\"".to_owned(),
                    _ => "COMMAND^A".to_owned(),
                };
                self.line(&text);
            }
            5 if self.number != 0 => {
                let text = match self.rng.below(5) {
                    0 => "ADDRESS&2".to_owned(),
                    1 => "ADR&1#2".to_owned(),
                    2 => "DISABLE PLC7".to_owned(),
                    3 => "ENAPLC 7".to_owned(),
                    _ => "PAUSE PLC 2 RESUME PLC2".to_owned(),
                };
                self.line(&text);
            }
            _ => {
                let text = self.assignment();
                self.line(&text);
            }
        }
    }
}
