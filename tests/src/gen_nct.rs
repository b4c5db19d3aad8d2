//! Generates random valid NCT programs that use everything the language has, each with a stimulus.
//!
//! The same seed gives the same case. There are few variables, so that many statements use the same
//! ones. Register areas and addresses are mostly right and sometimes wrong. A few programs nest their
//! subroutine calls too deep.

use std::fmt::Write as _;

use crate::gen_pmi::Case;
use plcc_random::Rng;

/// The subroutines' labels.
const SUBROUTINES: std::ops::Range<u16> = 10..16;
/// Bytes of F with a meaning of their own, at the edges, and some of no meaning.
const BYTES: &[u16] = &[0, 3, 4, 5, 7, 8, 20, 21, 22, 24, 30, 100, 499, 500, 998, 999];

struct Gen {
    rng: Rng,
    out: String,
    /// Whether statements stand without white space.
    glued: bool,
    /// Labels used so far, from 30 on.
    labels: u16,
    depth: usize,
    indirect: bool,
    risky: bool,
    /// The subroutine that is being written. Those of a module are called from any other.
    subroutine: Option<u16>,
}

/// A program of about `size` statements.
pub fn generate(seed: u64, size: usize) -> Case {
    let mut rng = Rng::new(seed);
    let glued = rng.chance(20);
    // Without indirect accesses bits are kept apart, so both kinds of programs are needed.
    let indirect = rng.chance(50);
    let risky = rng.chance(5);
    let out = String::new();
    let subroutine = None;
    let mut this = Gen { rng, out, glued, labels: 30, depth: 0, indirect, risky, subroutine };
    this.program(size);
    let mut watch: Vec<String> = (0..3).map(|n| format!("OP{n}")).collect();
    watch.extend(BYTES.iter().map(|byte| format!("F{byte:03}")));
    for byte in [0, 2, 40, 41, 70] {
        watch.push(format!("Y{byte:02}"));
    }
    let others = [
        "Q00", "Q01", "Q31", "T00", "T49", "H00", "H99", "M0", "M9", "RH060", "RH199", "O012",
        "O00", "O38",
    ];
    watch.extend(others.map(String::from));
    let ticks = 12;
    let mut stimulus = String::from("tick,name,value\n");
    for tick in 0..ticks {
        for _ in 0..this.rng.below(6) {
            let (name, value) = this.input();
            let _ = writeln!(stimulus, "{tick},{name},{value}");
        }
    }
    Case { source: this.out, stimulus, watch, ticks }
}

impl Gen {
    fn put(&mut self, text: &str) {
        self.out.push_str(text);
        if !self.glued || self.rng.chance(2) {
            let gap = *self.rng.pick(&[" ", "\n", "  ", "\r\n", " ; text\n", "/* U */"]);
            self.out.push_str(gap);
        }
    }

    fn program(&mut self, size: usize) {
        let parts = 3 + usize::from(self.rng.chance(50));
        let share = size / parts;
        for (module, part) in [(1, share), (0, share)] {
            self.put(&format!(":{module:03}"));
            if module == 1 {
                self.initialise();
            }
            self.block(part);
            self.put(&format!("J{module}"));
        }
        if parts == 4 {
            self.put(":002");
            self.block(share);
            self.put("J2");
        }
        for label in SUBROUTINES {
            self.put(&format!(":{label:03}"));
            self.subroutine = Some(label);
            self.block(share / 4);
            if self.risky && label + 1 == SUBROUTINES.end {
                self.put(&format!("C{:03}", SUBROUTINES.start));
            }
            self.put("R");
        }
        self.put(":199 ERROR 1,ERROR 2,$");
        self.put(":197 X,Y$");
        self.put(":198 TOOL,,RANGE$");
    }

    fn initialise(&mut self) {
        self.put("I510");
        for byte in [100, 102, 120, 122, 124, 126, 128, 130, 132, 134, 136] {
            let value = self.address();
            self.put(&format!(".{value} SF{byte:03}"));
        }
        self.put("U546");
        self.put("Z");
    }

    /// A BCD address, or a number that is not a valid one.
    fn address(&mut self) -> String {
        match self.rng.below(10) {
            0 => (*self.rng.pick(&["1000", "0A00", "FFFF", "00F0", "9999", "A000"])).to_owned(),
            1 => (*self.rng.pick(&["0999", "0998", "0997", "0000", "0004", "0008"])).to_owned(),
            2..5 => (*self.rng.pick(&["0001", "0002", "0004", "0102", "0304"])).to_owned(),
            5 => (*self.rng.pick(&["0010", "0011", "0015", "0029", "0196"])).to_owned(),
            _ => format!("{:04}", 200 + self.rng.below(60)),
        }
    }

    fn block(&mut self, size: usize) {
        let mut left = size;
        while left > 0 {
            let used = self.statement(left);
            left -= used.min(left);
        }
    }

    /// Writes a statement. Gives about how many simple statements it is worth.
    fn statement(&mut self, left: usize) -> usize {
        match self.rng.below(100) {
            0..14 => {
                let bit = self.stored_bit(true);
                let bit = bit.strip_prefix('Y').map_or(bit.clone(), str::to_owned);
                let letter = *self.rng.pick(&["U", "D"]);
                self.put(&format!("{letter}{bit}"));
            }
            14..17 => {
                let letter = *self.rng.pick(&["U", "D"]);
                let counter = *self.rng.pick(&[0, 1, 2, 3, 31]);
                self.put(&format!("{letter}Q{counter:02}"));
            }
            17..30 => {
                let load = self.load(false);
                self.put(&load);
            }
            30..40 => {
                let n = *self.rng.pick(&["", "", "N"]);
                let place = self.stored(false);
                self.put(&format!("{n}S{place}"));
            }
            40..56 => {
                let op = *self.rng.pick(&["+", "-", "*", "/", "A", "O", "X"]);
                let operand = self.operand(matches!(op, "A" | "O" | "X"));
                self.put(&format!("{op}{operand}"));
            }
            56..62 => {
                let op = *self.rng.pick(&["+", "-", "A", "O", "X"]);
                let n = *self.rng.pick(&["", "", "N"]);
                let place = self.stored(matches!(op, "+" | "-"));
                self.put(&format!("{op}{n}S{place}"));
            }
            62..67 => {
                let shift = self.rng.below(16);
                let text = match self.rng.below(4) {
                    0 => format!("<<{shift}"),
                    1 => format!(">>{shift}"),
                    2 => "BIN".to_owned(),
                    _ => "BCD".to_owned(),
                };
                self.put(&text);
            }
            67..70 => self.bracket(3),
            70..87 if self.depth < 4 => return self.condition(left),
            87..90 if left > 3 && self.depth < 3 => return self.counted_loop(left),
            90..93 => self.call(),
            93 if self.indirect => self.valid_area(),
            94..96 if self.indirect => self.area(),
            96..98 if left > 3 => return self.skip(left),
            98 if self.risky => {
                let label = SUBROUTINES.start + self.rng.below(6) as u16;
                self.put(&format!("C{label:03}"));
            }
            98 if self.rng.chance(25) => {
                // Ends the module where no call is under way.
                let test = self.test();
                self.put(&test);
                self.put("R");
                self.put("Z");
            }
            _ => {
                let constant = self.constant();
                self.put(&constant);
            }
        }
        1
    }

    fn constant(&mut self) -> String {
        let edge = [0, 1, 2, 9, 10, 9999, 10000, 0x7FFF, 0x8000, 0xFFFF];
        let value = if self.rng.chance(50) { *self.rng.pick(&edge) } else { self.rng.below(65536) };
        if self.rng.chance(50) { format!(".{value:04X}") } else { format!(",{value}") }
    }

    fn f_bit(&mut self) -> String {
        let byte = *self.rng.pick(BYTES);
        let bit = self.rng.below(8);
        if self.rng.chance(30) {
            return (*self
                .rng
                .pick(&["0040", "0046", "0047", "0053", "0080", "0082", "0083", "0087"]))
            .to_owned();
        }
        format!("{byte:03}{bit}")
    }

    /// A bit of I or Y: a byte that words use too, or one of bits alone.
    fn io_bit(&mut self) -> String {
        let byte = *self.rng.pick(&[0, 1, 2, 10, 11, 40, 42, 50, 70]);
        format!("{byte:02}{}", self.rng.below(8))
    }

    fn stored_bit(&mut self, switch: bool) -> String {
        match self.rng.below(10) {
            0..5 => format!("F{}", self.f_bit()),
            5..9 => format!("Y{}", self.io_bit()),
            _ if switch => format!("O{}", *self.rng.pick(&["012", "000", "397", "200", "387"])),
            _ => "O012".to_owned(),
        }
    }

    fn register(&mut self, stored: bool) -> String {
        match self.rng.below(if stored { 5 } else { 6 }) {
            0 => format!("Q{:02}", *self.rng.pick(&[0, 1, 2, 3, 31])),
            1 => format!("T{:02}", *self.rng.pick(&[0, 1, 49])),
            2 => (*self.rng.pick(&["H00", "H00", "H99"])).to_owned(),
            3 => (*self.rng.pick(&["M0", "M0", "M9"])).to_owned(),
            4 => (*self.rng.pick(&["RH050", "RH060", "RH099", "RH150", "RH199"])).to_owned(),
            _ => (*self.rng.pick(&["RP001", "RP040", "RH000", "RH049", "RH149"])).to_owned(),
        }
    }

    /// An operand of S, the store.
    fn stored(&mut self, word: bool) -> String {
        match self.rng.below(20) {
            0..5 if !word => self.stored_bit(false),
            0..9 => format!("F{:03}", *self.rng.pick(BYTES)),
            9..13 => format!("Y{}", *self.rng.pick(&["00", "02", "38", "40", "41", "70", "99"])),
            13 => format!("O{}", *self.rng.pick(&["00", "20", "38"])),
            14..17 if self.indirect => {
                format!("FI{:03}", *self.rng.pick(&[100, 102, 122, 999, 20]))
            }
            _ => self.register(true),
        }
    }

    /// An operand of L, the load.
    fn loaded(&mut self, word: bool) -> String {
        match self.rng.below(20) {
            0..2 if !word => format!("F{}", self.f_bit()),
            2..5 if !word => {
                let letter = *self.rng.pick(&["I", "Y", "V"]);
                format!("{letter}{}", self.io_bit())
            }
            5 if !word => format!("P{}", *self.rng.pick(&["002", "000", "397", "200"])),
            0..8 => format!("F{:03}", *self.rng.pick(BYTES)),
            8..13 => {
                let letter = *self.rng.pick(&["I", "Y", "V"]);
                format!("{letter}{}", *self.rng.pick(&["00", "01", "40", "70", "99"]))
            }
            13 => format!("P{}", *self.rng.pick(&["00", "01", "20", "39"])),
            14..17 if self.indirect => {
                format!("FI{:03}", *self.rng.pick(&[100, 102, 122, 999, 20]))
            }
            _ => self.register(false),
        }
    }

    fn load(&mut self, word: bool) -> String {
        let n = *self.rng.pick(&["", "", "N"]);
        format!("{n}L{}", self.loaded(word))
    }

    /// The operand of an operation or a relation.
    fn operand(&mut self, bits: bool) -> String {
        if self.rng.chance(40) {
            return self.constant().trim_start_matches(',').to_owned();
        }
        if self.rng.chance(5) {
            // An expression in brackets.
            let inner = self.load(true);
            let second = self.constant().trim_start_matches(',').to_owned();
            let op = *self.rng.pick(&["+", "-", "*", "/", "A", "X"]);
            return format!("[{inner}{op}{second}]");
        }
        self.load(!bits)
    }

    fn bracket(&mut self, depth: usize) {
        let text = self.bracket_text(depth);
        self.put(&text);
    }

    fn bracket_text(&mut self, depth: usize) -> String {
        let mut text = String::from("[");
        if depth > 0 && self.rng.chance(30) {
            text += &self.bracket_text(depth - 1);
        } else if self.rng.chance(30) {
            text += &self.constant();
        } else {
            text += &self.load(false);
        }
        for _ in 0..self.rng.below(3) {
            match self.rng.below(6) {
                0 => text += *self.rng.pick(&["BIN", "BCD", "<<3", ">>2"]),
                1 if depth > 0 => {
                    text += *self.rng.pick(&["+", "-", "*", "/", "A", "O", "X"]);
                    text += &self.bracket_text(depth - 1);
                }
                _ => {
                    let op = *self.rng.pick(&["+", "-", "*", "/", "A", "O", "X"]);
                    text += op;
                    let constant = self.rng.chance(40);
                    text += &if constant {
                        self.constant().trim_start_matches(',').to_owned()
                    } else {
                        self.load(!matches!(op, "A" | "O" | "X"))
                    };
                }
            }
        }
        text + "]"
    }

    fn test(&mut self) -> String {
        match self.rng.below(12) {
            0..3 => {
                let n = *self.rng.pick(&["", "N"]);
                format!("{n}F{}", self.f_bit())
            }
            3..7 => {
                let n = *self.rng.pick(&["", "N"]);
                let letter = *self.rng.pick(&["I", "Y", "V"]);
                format!("{n}{letter}{}", self.io_bit())
            }
            7 => (*self.rng.pick(&["P002", "NP002", "P397", "I510", "I543", "NI510", "V510"]))
                .to_owned(),
            8 => {
                (*self.rng.pick(&["Q00", "NQ31", "NT00", "T49", "H00", "NH99", "NM0", "M9", "T01"]))
                    .to_owned()
            }
            _ => {
                let relation = *self.rng.pick(&["=", "<", ">", "<=", ">="]);
                let constant = self.rng.chance(60);
                let operand = if constant {
                    self.constant().trim_start_matches(',').to_owned()
                } else {
                    self.load(true)
                };
                format!("{relation}{operand}")
            }
        }
    }

    fn tests(&mut self, depth: usize) -> String {
        let mut text = String::from("(");
        for part in 0..=self.rng.below(3) {
            if part > 0 {
                text += *self.rng.pick(&[" A ", " O ", " X "]);
            }
            if depth > 0 && self.rng.chance(25) {
                text += &self.tests(depth - 1);
            } else {
                text += &self.test();
            }
        }
        text + ")"
    }

    fn condition(&mut self, left: usize) -> usize {
        let test = if self.rng.chance(50) { self.test() } else { self.tests(3) };
        self.put(&test);
        self.depth += 1;
        let size = 1 + self.rng.below(left.clamp(1, 4));
        if self.rng.chance(10) && self.labels < 190 {
            // Jumped to from the other branch, past the condition.
            let label = self.label();
            self.put(&format!(":{label:03}"));
            self.block(size);
            self.put("E");
            let counter = 25 + self.depth.min(5);
            self.put(&format!("UQ{counter:02}"));
            self.put(&format!("LQ{counter:02}"));
            self.put("A3");
            self.put("=1");
            self.put(&format!("G{label:03}"));
            self.put("Z");
            self.depth -= 1;
            self.put("Z");
            return 2 + size;
        }
        self.block(size);
        let other = self.rng.chance(50);
        if other {
            self.put("E");
            self.block(size);
        }
        self.depth -= 1;
        self.put("Z");
        1 + size * (1 + usize::from(other))
    }

    fn label(&mut self) -> u16 {
        self.labels = (self.labels + 1).min(195);
        self.labels
    }

    /// Writes a loop that decrements a counter of its own until it is zero.
    fn counted_loop(&mut self, left: usize) -> usize {
        let label = self.label();
        if label >= 195 {
            return 1;
        }
        // Of its own also where subroutines that are called from it have loops.
        let routine = self.subroutine.map_or(0, |label| 1 + label - SUBROUTINES.start);
        let counter = 4 + 3 * usize::from(routine) + self.depth;
        let times = 1 + self.rng.below(4);
        self.put(&format!(",{times}"));
        self.put(&format!("SQ{counter:02}"));
        self.put(&format!(":{label:03}"));
        self.depth += 1;
        let size = 1 + self.rng.below(left.clamp(1, 5));
        self.block(size);
        self.depth -= 1;
        self.put(&format!("DQ{counter:02}"));
        self.put(&format!("Q{counter:02}"));
        if self.indirect && self.rng.chance(40) {
            self.put(&format!(".{label:04}"));
            self.put("SF040");
            self.put("GF040");
        } else {
            self.put(&format!("G{label:03}"));
        }
        self.put("Z");
        size + 4
    }

    /// Writes a jump over some statements.
    fn skip(&mut self, left: usize) -> usize {
        let label = self.label();
        if label >= 195 {
            return 1;
        }
        let test = self.test();
        self.put(&test);
        if self.indirect && self.rng.chance(50) {
            self.put(&format!(".{label:04}"));
            self.put("SF040");
            self.put("GF040");
        } else {
            self.put(&format!("G{label:03}"));
        }
        self.put("Z");
        let size = 1 + self.rng.below(left.clamp(1, 4));
        self.depth += 2;
        self.block(size);
        self.depth -= 2;
        self.put(&format!(":{label:03}"));
        size + 2
    }

    fn call(&mut self) {
        // A subroutine calls only later ones, so that calls end.
        let first = self.subroutine.map_or(SUBROUTINES.start, |label| label + 1);
        if first >= SUBROUTINES.end {
            return;
        }
        let label = first + self.rng.below(usize::from(SUBROUTINES.end - first)) as u16;
        if self.indirect && self.rng.chance(40) {
            let label = if self.rng.chance(20) {
                (*self.rng.pick(&["00F1", "0001", "0190", "9000"])).to_owned()
            } else {
                format!("{label:04}")
            };
            self.put(&format!(".{label}"));
            self.put("SF042");
            self.put("CF042");
        } else {
            self.put(&format!("C{label:03}"));
        }
    }

    fn area(&mut self) {
        let names = ["HF", "PF", "MR", "MW", "ADD", "SUB", "MUL", "DIV", "CMP"];
        let name = *self.rng.pick(&names);
        if self.rng.chance(50) {
            let byte = *self.rng.pick(&[120, 122, 124, 126]);
            let value = self.address();
            self.put(&format!(".{value}"));
            self.put(&format!("SF{byte:03}"));
        }
        let at = *self.rng.pick(&[120, 120, 120, 130, 990, 0]);
        self.put(&format!("{name}{at:03}"));
    }

    /// A statement with a register area that is right except, perhaps, for the addresses in it.
    fn valid_area(&mut self) {
        let store = |this: &mut Self, byte: u16, value: String| {
            this.put(&format!(".{value}"));
            this.put(&format!("SF{byte:03}"));
        };
        let place = |this: &mut Self| format!("{:04}", 200 + this.rng.below(40));
        match self.rng.below(8) {
            0 => {
                let format = (*self.rng.pick(&["0001", "0002"])).to_owned();
                store(self, 120, format);
                let start = place(self);
                store(self, 122, start);
                let length = format!("{:04X}", 2 * self.rng.below(12));
                store(self, 124, length);
                let mask = (*self.rng.pick(&["FFFF", "00FF", "0001", "F0F0"])).to_owned();
                store(self, 126, mask);
                let wanted = self.constant();
                self.put(&wanted);
                self.put("HF120");
            }
            _ => {
                let format = (*self.rng.pick(&["0001", "0002", "0004"])).to_owned();
                store(self, 120, format);
                for byte in [122, 124, 126] {
                    let place = place(self);
                    store(self, byte, place);
                }
                let name = *self.rng.pick(&["ADD", "SUB", "MUL", "DIV", "CMP"]);
                self.put(&format!("{name}120"));
            }
        }
    }

    fn input(&mut self) -> (String, i64) {
        match self.rng.below(6) {
            0..4 => (format!("I{}", self.io_bit()), self.rng.below(2) as i64),
            4 => ("RH000".to_owned(), self.rng.below(65536) as i64),
            _ => ("F020".to_owned(), self.rng.below(65536) as i64),
        }
    }
}
