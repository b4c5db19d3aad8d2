//! Idioms that compute: filters, limits, values that grow, updates, and integers in L-variables.

use super::Writer;

impl Writer {
    /// A value follows another one.
    pub(super) fn filter(&mut self) {
        let (target, input) = (self.memory.number(&mut self.rng), self.word(1));
        let factor = *self.rng.pick(&["0.1", ".5", "0.002", "1/8"]);
        match self.rng.below(3) {
            0 => line!(self, "{target}={target}+({input}-{target})*{factor}"),
            1 => line!(self, "{target}=({target}*7+{input})/8"),
            _ => line!(self, "{target}={input}*8388608/(I10*32)+{factor}"),
        }
        if self.rng.chance(50) {
            let word = self.memory.word(&mut self.rng);
            line!(self, "{word}={target}");
        }
    }

    /// The largest, the smallest, limits.
    pub(super) fn extremes(&mut self) {
        let (target, value) = (self.target(), self.word(1));
        let comparator = *self.rng.pick(&[">", "<", "!>", "!<"]);
        line!(self, "IF ({value}{comparator}{target}) {target}={value} ENDIF");
        if self.rng.chance(50) {
            let limit = self.memory.value(&mut self.rng);
            line!(self, "IF ({target}{comparator}{limit}) {target}={limit} ENDIF");
        }
    }

    /// A value that grows beyond all that integers hold, or changes its sign.
    pub(super) fn growth(&mut self) {
        let target = self.memory.number(&mut self.rng);
        let other = self.number(1);
        match self.rng.below(5) {
            0 => line!(self, "{target}={target}*{target}+1"),
            1 => line!(self, "{target}=-{target}*({other})"),
            2 => line!(self, "{target}=EXP({target})*({other})"),
            3 => line!(self, "{target}={target}/({other})"),
            _ => line!(self, "{target}=({target}-{target})*-({other})"),
        }
        let used = self.target();
        line!(self, "{used}={target}{}", self.rng.pick(&["|1", "&$FF", "%7", "*2", "^-1"]));
    }

    /// `&=`, `|=` and `^=`.
    pub(super) fn update(&mut self) {
        let target = match self.rng.below(4) {
            0 => self.memory.bit(&mut self.rng),
            1 => self.memory.word(&mut self.rng),
            _ => self.memory.number(&mut self.rng),
        };
        let value = match self.rng.below(4) {
            0 => self.memory.weight(&mut self.rng).to_string(),
            1 => self.bit(2),
            2 => self.word(1),
            _ => self.number(2),
        };
        line!(self, "{target}{}={value}", self.rng.pick(&["&", "|", "^"]));
    }

    /// Statements of L-variables and integers alone.
    pub(super) fn integers(&mut self) {
        if !self.place.is_compiled() {
            return self.assignment();
        }
        let target = self.l_variable();
        let mut value = self.l_variable();
        for _ in 0..1 + self.rng.below(5) {
            let other = match self.rng.below(3) {
                0 => self
                    .rng
                    .pick(&["1", "2", "3", "7", "$FF", "8388607", "0", "$7F0000"])
                    .to_string(),
                _ => self.l_variable(),
            };
            let operator = *self.rng.pick(&["+", "-", "*", "/", "%", "&", "|", "^"]);
            value = match self.rng.below(5) {
                0 => format!("({value}){operator}{other}"),
                1 => format!("{other}{operator}({value})"),
                2 => format!("ABS({value}{operator}{other})"),
                3 => format!("INT({value}{operator}-{other})"),
                _ => format!("{value}{operator}{other}"),
            };
        }
        if self.rng.chance(60) {
            return line!(self, "{target}={value}");
        }
        let other = self.l_variable();
        let comparator = *self.rng.pick(&["=", "!=", ">", "<", "!>", "!<", "~", "!~"]);
        line!(self, "IF ({value}{comparator}{other})");
        if self.rng.chance(30) {
            let last = self.l_variable();
            line!(self, "{} ({last}{comparator}{other})", self.rng.pick(&["AND", "OR"]));
        }
        line!(self, "{target}={target}+1");
        self.if_end();
    }

    pub(super) fn l_variable(&mut self) -> String {
        if self.rng.chance(35) {
            self.memory.l_bit(&mut self.rng)
        } else {
            self.memory.l_word(&mut self.rng)
        }
    }
}
