//! Expressions, by what they mean: a bit, a parity, a sum, an index, a word, any number; and
//! conditions.

use super::Writer;

const COMPARATORS: [&str; 12] = ["=", "=", "=", "!=", "!=", ">", "<", "!>", "!<", "~", "!~", ">"];

impl Writer {
    /// Parentheses that need not be there, often. Without them the text may mean something else,
    /// which is as good.
    fn wrapped(&mut self, text: String) -> String {
        if self.rng.chance(55) { format!("({text})") } else { text }
    }

    fn either(&mut self, first: String, second: String) -> String {
        if self.rng.chance(50) { first } else { second }
    }

    /// Something that is 0 or 1, or looks like it.
    pub(super) fn bit(&mut self, depth: usize) -> String {
        let text = match if depth == 0 { self.rng.below(4) } else { self.rng.below(15) } {
            0 | 1 if self.place.is_compiled() && self.rng.chance(40) => {
                self.memory.l_bit(&mut self.rng)
            }
            0..=2 => self.memory.bit(&mut self.rng),
            3 => self.memory.flag(&mut self.rng),
            4 => {
                let of = self.word(depth - 1);
                format!("({of})&1")
            }
            5 => {
                let of = self.word(depth - 1);
                format!("({of})%2")
            }
            6 => {
                let of = self.bit(depth - 1);
                format!("1-{of}")
            }
            7 => {
                let of = self.bit(depth - 1);
                let of = self.wrapped(of);
                format!("{of}^1")
            }
            8 => {
                let of = self.word(depth - 1);
                let weight = self.memory.weight(&mut self.rng);
                let end = *self.rng.pick(&["%2", "&1"]);
                format!("INT({of}/{weight}){end}")
            }
            9 => {
                let of = self.word(depth - 1);
                let weight = self.memory.weight(&mut self.rng);
                format!("({of}&{weight})/{weight}")
            }
            10 => self.parity(depth - 1),
            11 => {
                let (a, b) = (self.bit(depth - 1), self.bit(depth - 1));
                format!("ABS({a}-{b})")
            }
            _ => {
                let (a, b) = (self.bit(depth - 1), self.bit(depth - 1));
                let (a, b) = (self.wrapped(a), self.wrapped(b));
                let operator = *self.rng.pick(&["&", "|", "^", "*"]);
                format!("{a}{operator}{b}")
            }
        };
        self.named(text)
    }

    /// Whether an odd number of bits is 1.
    fn parity(&mut self, depth: usize) -> String {
        let count = 2 + self.rng.below(3);
        let bits: Vec<String> = (0..count).map(|_| self.bit(depth.min(1))).collect();
        match self.rng.below(3) {
            0 => format!("({})%2", bits.join("+")),
            1 => format!("({})&1", bits.join("+")),
            _ => format!("({})", bits.join("^")),
        }
    }

    /// Bits that are added, with or without weights.
    pub(super) fn sum(&mut self, depth: usize) -> String {
        let count = 2 + self.rng.below(3);
        let weighted = self.rng.chance(40);
        let terms: Vec<String> = (0..count)
            .map(|index| {
                let bit = self.bit(depth);
                if weighted { format!("({bit})*{}", 1 << index) } else { bit }
            })
            .collect();
        terms.join(*self.rng.pick(&["+", "+", "+", "|"]))
    }

    /// Something that is an integer.
    pub(super) fn word(&mut self, depth: usize) -> String {
        if self.rng.chance(8) {
            return self.element();
        }
        let text = match if depth == 0 { self.rng.below(6) } else { self.rng.below(16) } {
            0 | 1 if self.place.is_compiled() && self.rng.chance(40) => {
                self.memory.l_word(&mut self.rng)
            }
            0..=2 => self.memory.word(&mut self.rng),
            3 | 4 => self.memory.number(&mut self.rng),
            5 => self.memory.whole(&mut self.rng),
            6 => self.sum(depth - 1),
            7 => {
                let of = self.word(depth - 1);
                let of = self.wrapped(of);
                let mask = *self.rng.pick(&["$F", "$FF", "7", "3", "$FFFF00", "$800000", "1023"]);
                format!("{of}&{mask}")
            }
            8 => {
                let of = self.word(depth - 1);
                let of = self.wrapped(of);
                let divisor = self.memory.whole(&mut self.rng);
                format!("{of}%{divisor}")
            }
            9 => {
                let of = self.word(depth - 1);
                let weight = self.memory.weight(&mut self.rng);
                format!("INT({of}/{weight})")
            }
            10 => {
                let of = self.number(depth - 1);
                format!("INT({of})")
            }
            11 => self.indexed(depth - 1),
            12 => {
                let of = self.word(depth - 1);
                format!("ABS({of})")
            }
            _ => {
                let (a, b) = (self.word(depth - 1), self.word(depth - 1));
                let (a, b) = (self.wrapped(a), self.wrapped(b));
                let operator = *self.rng.pick(&["+", "+", "-", "*", "&", "|", "^", "%", "/"]);
                format!("{a}{operator}{b}")
            }
        };
        self.named(text)
    }

    /// Any number.
    pub(super) fn number(&mut self, depth: usize) -> String {
        if self.rng.chance(8) {
            return self.element();
        }
        let text = match if depth == 0 { self.rng.below(4) } else { self.rng.below(15) } {
            0 | 1 => self.memory.number(&mut self.rng),
            2 => self.memory.value(&mut self.rng),
            3 => self.memory.word(&mut self.rng),
            4 | 5 => self.word(depth - 1),
            6 => self.bit(depth - 1),
            7 => {
                let of = self.number(depth - 1);
                let name = *self.rng.pick(&[
                    "INT", "INT", "ABS", "ABS", "SQRT", "SIN", "COS", "TAN", "ASIN", "ACOS",
                    "ATAN", "ATAN2", "LN", "EXP",
                ]);
                format!("{name}({of})")
            }
            8 => {
                // `%` by fractions, negative numbers, and what changes.
                let (a, b) = (self.number(depth - 1), self.memory.value(&mut self.rng));
                let a = self.wrapped(a);
                format!("{a}%{b}")
            }
            9 => {
                let of = self.number(depth - 1);
                format!("-({of})")
            }
            10 => self.indexed(depth - 1),
            11 => {
                // Bit operators among fractions.
                let (a, b) = (self.number(depth - 1), self.memory.value(&mut self.rng));
                let (a, operator) = (self.wrapped(a), *self.rng.pick(&["&", "|", "^"]));
                format!("{a}{operator}{b}")
            }
            _ => {
                let (a, b) = (self.number(depth - 1), self.number(depth - 1));
                let (a, b) = (self.wrapped(a), self.wrapped(b));
                let operator =
                    *self.rng.pick(&["+", "+", "-", "-", "*", "*", "/", "/", "%", "&", "|", "^"]);
                format!("{a}{operator}{b}")
            }
        };
        self.named(text)
    }

    /// The number of a variable.
    pub(super) fn index(&mut self, depth: usize) -> String {
        let depth = depth.min(2);
        let base = *self.rng.pick(&[1, 4, 10, 40, 70, 84, 90, 100, 1020, 1024, 8190]);
        match self.rng.below(12) {
            0 => self.bit(depth),
            1 => self.parity(depth),
            2 => self.sum(depth),
            3 | 4 => {
                let sum = self.sum(depth);
                self.either(format!("{base}+{sum}"), format!("{sum}+{base}"))
            }
            5 => {
                let of = self.word(depth);
                let of = self.wrapped(of);
                let end = *self.rng.pick(&["&7", "&3", "%8", "&1", "%24"]);
                format!("{base}+({of}{end})")
            }
            6 => {
                let of = self.word(depth);
                let of = self.wrapped(of);
                format!("{of}&{}", self.rng.pick(&[1, 7, 15, 63, 1023]))
            }
            7 => {
                let (a, b) = (self.bit(depth), self.bit(depth));
                let (a, b) = (self.wrapped(a), self.wrapped(b));
                format!("{base}+{a}*{}+{b}", self.rng.pick(&[2, 10, 100]))
            }
            8 => {
                let (a, b) = (self.bit(depth), self.bit(depth));
                self.either(format!("{base}-{a}-{b}"), format!("({a}+{b})/2"))
            }
            9 => self.memory.number(&mut self.rng),
            10 => {
                let of = self.memory.number(&mut self.rng);
                format!("{of}+{base}")
            }
            _ => self.number(depth),
        }
    }

    /// A variable whose number is something simple, such as `P(M16)` or `P(100+M1+M2)`.
    fn element(&mut self) -> String {
        let letter = *self.rng.pick(&["P", "P", "P", "Q", "M"]);
        let bit = self.bit(0);
        let base = *self.rng.pick(&[1, 4, 10, 40, 70, 100]);
        let index = match self.rng.below(7) {
            0 | 1 => bit,
            2 => format!("{base}+{bit}"),
            3 => format!("{bit}+{}", self.bit(0)),
            4 => format!("{base}+{bit}+{}", self.bit(0)),
            5 => self.memory.word(&mut self.rng),
            _ => format!("{}&7", self.memory.word(&mut self.rng)),
        };
        format!("{letter}({index})")
    }

    /// A variable with a computed number.
    pub(super) fn indexed(&mut self, depth: usize) -> String {
        let letter = *self.rng.pick(&["P", "P", "P", "M", "M", "Q", "I"]);
        let index = self.index(depth);
        format!("{letter}({index})")
    }

    /// Two values that are compared.
    pub(super) fn comparison(&mut self) -> String {
        let mut comparator = *self.rng.pick(&COMPARATORS);
        let (a, b) = match self.rng.below(10) {
            0..=3 => {
                let bit = self.bit(2);
                (bit, self.rng.pick(&["0", "1", "1", "2", "0.5"]).to_string())
            }
            4 | 5 => {
                let depth = 1 + self.rng.below(2);
                (self.word(depth), self.memory.whole(&mut self.rng))
            }
            6 => {
                // A bit of a word, in parentheses or not.
                let (word, weight) = (self.word(0), self.memory.weight(&mut self.rng));
                comparator = *self.rng.pick(&["=", "!=", ">"]);
                let value = if self.rng.chance(30) { weight } else { 0 };
                let text = format!("{word}&{weight}");
                (self.wrapped(text), value.to_string())
            }
            7 => {
                let flag = self.memory.flag(&mut self.rng);
                (self.bit(1), flag)
            }
            8 => (self.number(2), self.memory.value(&mut self.rng)),
            _ => (self.number(1), self.number(1)),
        };
        format!("{a}{comparator}{b}")
    }

    /// A condition, `(…)`.
    pub(super) fn condition(&mut self) -> String {
        let mut text = self.comparison();
        while self.rng.chance(30) {
            let (join, other) = (*self.rng.pick(&[" AND ", " OR "]), self.comparison());
            let other = match self.rng.below(4) {
                0 => format!("({other})"),
                1 => {
                    let third = self.comparison();
                    format!("({other}{}{third})", self.rng.pick(&[" AND ", " OR "]))
                }
                _ => other,
            };
            text = format!("{text}{join}{other}");
        }
        let text = format!("({text})");
        self.named(text)
    }
}
