//! Generates random valid PMAC downloads with PLCs, PLCCs, loops, commands, and definitions that the
//! program changes while it runs, each with a stimulus.
//!
//! The same seed gives the same case. Every form of a PLC's statement occurs, and variables of all
//! formats, some of which share memory with P-, Q- and I-variables and with definitions. Most numbers
//! are at the limits of a format.

mod expressions;
mod statements;
mod tables;

use std::fmt::Write as _;

pub use crate::gen_pmi::Case;
use plcc_random::Rng;
use tables::{L, M, MOVERS};

struct Generator {
    rng: Rng,
    out: String,
    /// For Turbo PMAC, whose memory lies elsewhere.
    turbo: bool,
    /// Assignments to ranges of variables are allowed in buffers: on PMAC only.
    ranges: bool,
    /// Whether the program that is being written is a PLCC, and its number.
    compiled: bool,
    number: usize,
    lines: usize,
}

/// A case of about `size` statements for PMAC.
pub fn generate(seed: u64, size: usize) -> Case {
    generate_for(seed, size, false)
}

/// A case of about `size` statements, for Turbo PMAC if `turbo`.
pub fn generate_for(seed: u64, size: usize, turbo: bool) -> Case {
    let mut g = Generator {
        rng: Rng::new(seed),
        out: String::from("I5=3\n"),
        turbo,
        ranges: !turbo,
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
    if g.rng.chance(10) {
        g.out.push_str("PAUSE PLC 2,7\n");
    }
    let mut watch: Vec<String> = (0..12).map(|n| format!("P{n}")).collect();
    watch.extend(M.iter().chain(MOVERS).map(|(n, _)| format!("M{n}")));
    watch.extend(L.iter().map(|(n, _)| format!("L{n}")));
    let ticks = 24;
    let stimulus = g.stimulus(ticks);
    Case { source: g.out, stimulus, watch, ticks }
}

impl Generator {
    /// Writes a statement, now and then on the line of the one before it.
    fn line(&mut self, text: &str) {
        if self.rng.chance(10) && self.out.ends_with('\n') && !text.starts_with("OPEN") {
            self.out.pop();
            self.out.push(' ');
        }
        self.out.push_str(text);
        self.out.push('\n');
    }

    /// The address of P32, a decimal number.
    fn p_address(&self) -> u32 {
        if self.turbo { 0x6020 } else { 0x1020 }
    }

    /// A text with the addresses of this controller in place of `@P`, `@Q` and `@M`.
    fn placed(&self, text: &str) -> String {
        let mut parts = text.split('@');
        let mut out = parts.next().unwrap_or("").to_owned();
        for part in parts {
            let base = match (part.get(..1), self.turbo) {
                (Some("P"), false) => 0x1000,
                (Some("P"), true) => 0x6000,
                (Some("Q"), false) => 0x1400,
                (Some("Q"), true) => 0x8000,
                (_, false) => 0xBC00,
                (_, true) => 0x4000,
            };
            let digits = part.get(1..).unwrap_or("");
            let end = digits.find(|c: char| !c.is_ascii_hexdigit()).unwrap_or(digits.len());
            let (digits, rest) = digits.split_at(end);
            let above = u32::from_str_radix(digits, 16).unwrap_or(0);
            let _ = write!(out, "${:X}{rest}", base + above);
        }
        out
    }

    fn definitions(&mut self) {
        for (number, definition) in M.iter().chain(MOVERS) {
            let definition = self.placed(definition);
            self.out.push_str(&format!("M{number}->{definition}\n"));
        }
        for (number, definition) in L {
            let definition = self.placed(definition);
            self.out.push_str(&format!("L{number}->{definition}\n"));
        }
        for n in 0..6 {
            let value = self.literal();
            let sign = if self.rng.chance(30) { "-" } else { "" };
            let line = format!("P{n}={sign}{value} Q{n}=P{n}/3 M{}={n}\n", n + 1);
            self.out.push_str(&line);
        }
        let radians = self.rng.below(2);
        self.out.push_str(&format!("I15={radians}\n"));
    }

    fn program(&mut self, compiled: bool, number: usize) {
        (self.compiled, self.number) = (compiled, number);
        let name = if compiled { "PLCC" } else { "PLC" };
        self.out.push_str(&format!("OPEN {name} {number} CLEAR\n"));
        let mut budget = self.lines / 6 + 2;
        while budget > 0 {
            self.statement(&mut budget, 0);
        }
        self.out.push_str("CLOSE\n");
    }

    fn stimulus(&mut self, ticks: u32) -> String {
        let mut text = String::from("tick,name,value\n");
        for tick in 0..ticks {
            if self.rng.chance(10) {
                // Nobody sees in the text that this moves a definition.
                let (number, address) = (3 + self.rng.below(4), 0x07F0 + self.rng.below(4));
                let word = self.placed(&format!("Y:@M{number:X}"));
                let _ = writeln!(text, "{tick},{word},{address}");
            }
            while self.rng.chance(50) {
                let name = match self.rng.below(4) {
                    0 => format!("P{}", self.rng.below(12)),
                    1 => format!("L{}", self.rng.pick(L).0),
                    2 => format!("Q{}", self.rng.below(4)),
                    _ => format!("M{}", self.rng.pick(M).0),
                };
                let value = self.rng.pick(&[
                    "0",
                    "1",
                    "-1",
                    "2",
                    "5",
                    "2.5",
                    "-3.75",
                    "$FFFFFF",
                    "1000000",
                    "4294967298",
                    "-0.0001",
                ]);
                let _ = writeln!(text, "{tick},{name},{value}");
            }
        }
        text
    }
}
