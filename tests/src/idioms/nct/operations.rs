//! Operations with OP, alone and in brackets, and conditions.

use super::Writer;

impl Writer {
    /// `N`, often not.
    pub(super) fn not(&mut self) -> &'static str {
        if self.rng.chance(25) { "N" } else { "" }
    }

    /// An operand of an operation: a constant, or a variable with L.
    pub(super) fn operand(&mut self) -> String {
        if self.rng.chance(45) {
            return self.pool.constant(&mut self.rng);
        }
        let word = self.pool.word(&mut self.rng);
        format!("{}L{word}", self.not())
    }

    /// A constant or a word is loaded.
    pub(super) fn load(&mut self) -> String {
        match self.rng.below(8) {
            0 => format!(",{}", self.pool.value(&mut self.rng)),
            1 => format!(".{:04X}", self.pool.value(&mut self.rng)),
            2 => {
                let bit = self.pool.bit(&mut self.rng);
                format!("{}L{bit}", self.not())
            }
            _ => {
                let word = self.pool.word(&mut self.rng);
                format!("{}L{word}", self.not())
            }
        }
    }

    /// An operation with OP.
    pub(super) fn operation(&mut self, depth: usize) -> String {
        match self.rng.below(14) {
            0 => format!("<<{}", 1 + self.rng.below(14)),
            1 => format!(">>{}", 1 + self.rng.below(14)),
            2 => "BIN".to_owned(),
            3 => "BCD".to_owned(),
            4 | 5 => {
                let (operator, bit) =
                    (*self.rng.pick(&["A", "O", "X"]), self.pool.bit(&mut self.rng));
                format!("{operator}{}L{bit}", self.not())
            }
            6 if depth > 0 => {
                let operator = *self.rng.pick(&["+", "-", "*", "A", "O", "X"]);
                format!("{operator}{}", self.bracket(depth - 1))
            }
            7..=9 => {
                let operator = *self.rng.pick(&["A", "O", "X"]);
                format!("{operator}{}", self.operand())
            }
            _ => {
                let operator = *self.rng.pick(&["+", "+", "+", "-", "-", "*", "/"]);
                format!("{operator}{}", self.operand())
            }
        }
    }

    pub(super) fn bracket(&mut self, depth: usize) -> String {
        let first =
            if depth > 0 && self.rng.chance(25) { self.bracket(depth - 1) } else { self.load() };
        let mut text = format!("[{first}");
        for _ in 0..1 + self.rng.below(3) {
            text.push(' ');
            text += &self.operation(depth);
        }
        text + "]"
    }

    /// A chain of operations, stored; now and then one that begins with OP as it is.
    pub(super) fn chain(&mut self) {
        let mut text = match self.rng.below(6) {
            0 => String::new(),
            1 => self.bracket(2),
            _ => self.load(),
        };
        for _ in 0..self.rng.below(5) {
            text += " ";
            text += &self.operation(2);
        }
        self.line(text.trim().to_owned());
        self.stores();
    }

    /// OP is stored to one or several variables.
    pub(super) fn stores(&mut self) {
        for _ in 0..1 + self.rng.below(3) {
            let not = if self.rng.chance(15) { "N" } else { "" };
            let target = match self.rng.chance(30) {
                true => self.pool.output_bit(&mut self.rng),
                false => self.pool.output_word(&mut self.rng),
            };
            line!(self, "{not}S{target}");
        }
    }

    /// A condition: a bit, bits in parentheses, a relation, or both.
    pub(super) fn condition(&mut self, depth: usize) -> String {
        match self.rng.below(10) {
            0..=3 => {
                let tested = self.pool.tested(&mut self.rng);
                format!("{}{tested}", self.not())
            }
            4 | 5 => self.relation(),
            _ => self.parentheses(depth),
        }
    }

    pub(super) fn relation(&mut self) -> String {
        let sign = *self.rng.pick(&["=", "=", "=", "<", ">", "<=", ">="]);
        format!("{sign}{}", self.operand())
    }

    pub(super) fn parentheses(&mut self, depth: usize) -> String {
        let mut text = "(".to_owned();
        let count = 2 + self.rng.below(3);
        for index in 0..count {
            if index > 0 {
                text += *self.rng.pick(&[" A ", " A ", " O ", " X ", "A", "O"]);
            }
            let part = match self.rng.below(8) {
                0 if depth > 0 => self.parentheses(depth - 1),
                1 if depth > 0 => self.parentheses(depth - 1),
                2 => self.relation(),
                _ => {
                    let tested = self.pool.tested(&mut self.rng);
                    format!("{}{tested}", self.not())
                }
            };
            text += &part;
        }
        text + ")"
    }
}
