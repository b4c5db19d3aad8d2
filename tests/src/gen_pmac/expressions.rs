//! Expressions and conditions of generated downloads.

use super::Generator;
use super::tables::{INTEGERS, L, M, MOVERS, NUMBERS, SPECIAL};

impl Generator {
    pub(super) fn literal(&mut self) -> String {
        (*self.rng.pick(NUMBERS)).to_owned()
    }

    /// Any variable that can be read here.
    fn variable(&mut self) -> String {
        match self.rng.below(if self.compiled { 13 } else { 11 }) {
            0..4 => format!("P{}", self.rng.below(12)),
            4 => format!("Q{}", self.rng.below(4)),
            5 => format!("I{}", self.rng.pick(&[8, 10, 15, 20, 60, 105])),
            6..10 => format!("M{}", self.rng.pick(M).0),
            10 => format!("M{}", self.rng.pick(MOVERS).0),
            _ => self.long(),
        }
    }

    pub(super) fn long(&mut self) -> String {
        format!("L{}", self.rng.pick(L).0)
    }

    fn operand(&mut self, depth: usize) -> String {
        match self.rng.below(22) {
            0..6 => self.literal(),
            6..14 => self.variable(),
            14 | 15 if depth < 3 => format!("({})", self.expression(depth + 1)),
            16 | 17 if depth < 3 => {
                let function = self.rng.pick(&[
                    "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "ATAN2", "SQRT", "LN", "EXP",
                    "ABS", "INT",
                ]);
                format!("{function}({})", self.expression(depth + 1))
            }
            18 | 19 if depth < 3 => {
                let kind = self.rng.pick(&["P", "Q", "M", "I"]);
                format!("{kind}({})", self.expression(depth + 1))
            }
            20 if depth < 3 => format!("-({})", self.expression(depth + 1)),
            21 => (*self.rng.pick(SPECIAL)).to_owned(),
            _ => format!("-{}", self.variable()),
        }
    }

    /// An expression, with `depth` parentheses around it.
    pub(super) fn expression(&mut self, depth: usize) -> String {
        let mut text = self.operand(depth);
        while self.rng.chance(45) {
            let op = self.rng.pick(&["+", "-", "*", "/", "%", "&", "|", "^", "+", "-"]);
            text.push_str(op);
            text.push_str(&self.operand(depth));
        }
        text
    }

    /// An expression of L-variables and integers alone.
    pub(super) fn integers(&mut self, depth: usize) -> String {
        let mut text = String::new();
        loop {
            let operand = match self.rng.below(8) {
                0 => (*self.rng.pick(INTEGERS)).to_owned(),
                1 => format!("-{}", self.rng.pick(INTEGERS)),
                2 if depth < 3 => format!("({})", self.integers(depth + 1)),
                3 if depth < 3 => format!("-({})", self.integers(depth + 1)),
                4 if depth < 3 => {
                    format!("{}({})", self.rng.pick(&["ABS", "INT"]), self.integers(depth + 1))
                }
                5 => format!("-{}", self.long()),
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
        if self.rng.chance(30) {
            // What compiled code compares by the bits of the double.
            let number = self.literal();
            let sign = if self.rng.chance(40) { "-" } else { "" };
            let variable = format!("P{}", self.rng.below(12));
            return match self.rng.chance(50) {
                true => format!("{variable}{cmp}{sign}{number}"),
                false => format!("{sign}{number}{cmp}{variable}"),
            };
        }
        format!("{}{cmp}{}", self.expression(2), self.expression(2))
    }

    /// A condition in its parentheses, and what AND and OR add to it.
    pub(super) fn condition(&mut self) -> String {
        let integer = self.compiled && self.rng.chance(50);
        let mut text = String::from("(");
        text.push_str(&self.terms(integer, 0));
        text.push(')');
        while self.rng.chance(15) {
            let word = self.rng.pick(&[" AND ", " OR ", "\nAND", "\nOR", "AND", "\n\nOR "]);
            text.push_str(word);
            text.push_str(&format!("({})", self.terms(integer, 1)));
        }
        text
    }

    /// Comparisons joined inside parentheses, some in further ones.
    fn terms(&mut self, integer: bool, depth: usize) -> String {
        let mut text = String::new();
        loop {
            if depth < 3 && self.rng.chance(10) {
                text.push_str(&format!("({})", self.terms(integer, depth + 1)));
            } else {
                text.push_str(&self.comparison(integer));
            }
            if !self.rng.chance(25) {
                return text;
            }
            let word = self.rng.pick(&[" AND ", " OR "]);
            text.push_str(word);
        }
    }
}
