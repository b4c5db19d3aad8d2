//! The idioms of programs, each of one or some statements.

use super::Writer;
use crate::idioms::LONG;

impl Writer {
    /// The number of idioms.
    pub(super) const IDIOMS: usize = 28;

    /// An idiom of the program's, or any.
    pub(super) fn some_idiom(&mut self) {
        let of_all = self.idioms.is_empty() || self.rng.chance(30);
        let idiom = match of_all {
            true => self.rng.below(Self::IDIOMS),
            false => {
                let at = self.rng.below(self.idioms.len());
                self.idioms.get(at).copied().unwrap_or(0)
            }
        };
        match idiom {
            0..=5 if self.lines.len() > LONG => self.chain(),
            0 | 1 if self.depth < 4 => self.condition_statement(),
            2 if self.depth < 4 => self.lamp(),
            3 if self.depth < 4 => self.phases(),
            4 if self.depth < 4 => self.ranges(),
            5 if self.depth < 4 => self.timed(),
            6 if self.depth < 3 && self.loops < 3 && self.may_have_labels => self.counted_loop(),
            7 if self.depth == 0 && self.may_have_labels => self.jump_over(),
            8 if self.depth == 0 && self.may_have_labels => self.indirect_jump(),
            9 if !self.subroutines.is_empty() => self.call(),
            10 => self.area(),
            11 => self.search(),
            12 => self.memory(),
            13 => self.pointer(),
            14 => self.variable_with_op(),
            15 => self.wide(),
            16 => self.bits(),
            17 => self.message(),
            18 => self.decimal(),
            19 => self.mask(),
            20 => self.tested_flags(),
            21 => self.switches(),
            22 => self.counters(),
            23 if self.in_subroutine && self.depth < 4 => self.early_return(),
            24 => self.stores(),
            25 => self.same_again(),
            _ => self.chain(),
        }
    }

    fn body(&mut self, most: usize) {
        self.depth += 1;
        for _ in 0..1 + self.rng.below(most) {
            self.some_idiom();
        }
        self.depth -= 1;
    }

    fn condition_statement(&mut self) {
        if self.rng.chance(30) {
            let load = self.load();
            self.line(load);
        }
        let condition = self.condition(2);
        self.line(condition);
        self.body(3);
        if self.rng.chance(45) {
            self.line("E".to_owned());
            if self.rng.chance(90) {
                self.body(3);
            }
        }
        self.line("Z".to_owned());
    }

    /// A lamp that a push-button switches on and off.
    fn lamp(&mut self) {
        let (input, output) = (self.pool.bit(&mut self.rng), self.pool.output_bit(&mut self.rng));
        let tested = output.replace('O', "Y");
        let switched = output.trim_start_matches('Y').to_owned();
        match self.rng.below(4) {
            0 => line!(self, "(V000 A {input}) N{tested} U{switched} E D{switched} Z Z"),
            1 => line!(self, "{input} N{tested} U{switched} E D{switched} Z Z"),
            2 => line!(self, "{input} U{switched} E D{switched} Z"),
            _ => {
                let operator = *self.rng.pick(&["A", "O", "X"]);
                let other = self.pool.bit(&mut self.rng);
                line!(self, "({input} {operator} N{other}) U{switched} E D{switched} Z");
            }
        }
    }

    /// A function in phases, each asked for by its number.
    fn phases(&mut self) {
        let word = match self.rng.chance(60) {
            true => self.pool.counter(&mut self.rng),
            false => self.pool.f_word(&mut self.rng),
        };
        line!(self, "L{word}");
        let count = 2 + self.rng.below(5);
        for index in 0..count {
            line!(self, "={index}");
            self.depth += 1;
            let condition = self.condition(1);
            self.line(condition);
            self.body(2);
            match (word.starts_with('Q'), self.rng.below(3)) {
                (true, 0) => line!(self, "U{word}"),
                (_, 1) => line!(self, ",{} S{word}", (index + 1) % count),
                _ => line!(self, "L{word} +1 S{word}"),
            }
            self.line("Z".to_owned());
            self.depth -= 1;
            // OP is the phase again for the next comparison, or is not.
            if self.rng.chance(70) {
                line!(self, ",{index}");
            }
            self.line("Z".to_owned());
        }
    }

    /// One word against several numbers and ranges.
    fn ranges(&mut self) {
        let load = self.load();
        self.line(load);
        for _ in 0..2 + self.rng.below(4) {
            let low = self.rng.below(20);
            if self.rng.chance(50) {
                line!(self, "={low}");
                self.body(1);
                self.line("Z".to_owned());
            } else {
                line!(self, ">={low}");
                line!(self, "<={}", low + self.rng.below(10));
                self.body(1);
                self.line("Z".to_owned());
                if self.rng.chance(30) {
                    self.line("E".to_owned());
                    self.body(1);
                }
                self.line("Z".to_owned());
            }
        }
    }

    /// A timer is started, and asked.
    fn timed(&mut self) {
        let timer = self.pool.timer(&mut self.rng);
        let condition = self.condition(1);
        self.line(condition);
        line!(self, ",{} S{timer} UF0205", self.rng.below(5));
        self.line("Z".to_owned());
        line!(self, "{}{timer}", self.not());
        self.body(2);
        self.line("E".to_owned());
        self.line("DF0205".to_owned());
        self.line("Z".to_owned());
    }

    /// A jump backwards, some times.
    fn counted_loop(&mut self) {
        // No other statement uses these counters.
        let counter = format!("Q{}", 29 + self.loops);
        let label = self.label();
        line!(self, ",{} S{counter}", 1 + self.rng.below(5));
        line!(self, ":{label:03}");
        self.loops += 1;
        self.body(3);
        self.loops -= 1;
        line!(self, "D{counter}");
        line!(self, "{counter} G{label:03} Z");
    }

    fn label(&mut self) -> usize {
        self.labels += 1;
        60 + self.labels.min(136)
    }

    /// A jump forwards over some statements.
    fn jump_over(&mut self) {
        if self.labels > 130 {
            return self.chain();
        }
        let label = self.label();
        let condition = self.condition(1);
        self.line(condition);
        if self.rng.chance(40) {
            self.body(2);
        }
        line!(self, "G{label:03}");
        if self.rng.chance(40) {
            self.line("E".to_owned());
            self.body(2);
        }
        self.line("Z".to_owned());
        self.body(3);
        line!(self, ":{label:03}");
    }

    /// A phase whose number is a label, or a subroutine's.
    fn indirect_jump(&mut self) {
        if self.labels > 120 {
            return self.chain();
        }
        if self.rng.chance(40) && !self.subroutines.is_empty() {
            if self.rng.chance(50) {
                let label = *self.rng.pick(&self.subroutines);
                let load = format!(".{label:04} SF494");
                self.line(load);
            }
            self.line("CF494".to_owned());
            return;
        }
        let labels = [self.label(), self.label(), self.label()];
        let condition = self.condition(1);
        line!(self, "{condition} .{:04} SF494 E .{:04} SF494 Z", labels[0], labels[1]);
        self.line("GF494".to_owned());
        self.line("F0080 UF0206 E DF0206 Z".to_owned());
        for label in labels {
            line!(self, ":{label:03}");
            self.body(2);
        }
    }

    fn call(&mut self) {
        let label = *self.rng.pick(&self.subroutines);
        if self.rng.chance(50) {
            let condition = self.condition(1);
            line!(self, "{condition} C{label:03} Z");
        } else {
            line!(self, "C{label:03}");
        }
    }

    fn early_return(&mut self) {
        let condition = self.condition(1);
        line!(self, "{condition} R Z");
    }

    /// `+S`, `AS`, `XNS` and their kind.
    fn variable_with_op(&mut self) {
        if self.rng.chance(70) {
            let load = self.load();
            self.line(load);
        }
        for _ in 0..1 + self.rng.below(2) {
            let not = self.not();
            if self.rng.chance(35) {
                let (operator, bit) =
                    (*self.rng.pick(&["A", "O", "X"]), self.pool.output_bit(&mut self.rng));
                line!(self, "{operator}{not}S{bit}");
            } else {
                let operator = *self.rng.pick(&["+", "-", "A", "O", "X"]);
                let word = self.pool.output_word(&mut self.rng);
                line!(self, "{operator}{not}S{word}");
            }
        }
        if self.rng.chance(30) {
            self.flags();
        }
    }

    /// Products and dividends of 32 bits, in F000 and F001.
    fn wide(&mut self) {
        let (load, a, b) = (self.load(), self.operand(), self.operand());
        match self.rng.below(4) {
            0 => line!(self, "{load} *{a} /{b}"),
            1 => line!(self, ",0 SF000 {load} /{a}"),
            2 => line!(self, "{load} *{a} SF120 LF000 SF122"),
            _ => line!(self, "{load} *{a}"),
        }
        self.stores();
        if self.rng.chance(50) {
            self.line("LF000".to_owned());
            self.stores();
        }
    }

    /// A chain of bits.
    fn bits(&mut self) {
        let bit = self.pool.bit(&mut self.rng);
        let mut text = format!("{}L{bit}", self.not());
        for _ in 0..1 + self.rng.below(5) {
            let (operator, bit) = (*self.rng.pick(&["A", "O", "X"]), self.pool.bit(&mut self.rng));
            let not = self.not();
            text += &format!(" {operator}{not}L{bit}");
        }
        self.line(text);
        for _ in 0..1 + self.rng.below(2) {
            let not = self.not();
            let bit = self.pool.output_bit(&mut self.rng);
            line!(self, "{not}S{bit}");
        }
    }

    fn message(&mut self) {
        let condition = self.condition(1);
        match self.rng.below(3) {
            0 => line!(self, "{condition} U71{0} E D71{0} Z", self.rng.below(4)),
            1 => {
                let word = self.pool.word(&mut self.rng);
                line!(self, "L{word} BCD SRH090");
                line!(self, "{condition} U700 E D700 Z");
            }
            _ => self.line("LI70 >0 ONLY70 NSY70 Z".to_owned()),
        }
    }

    /// `BIN` and `BCD`, with their flags.
    fn decimal(&mut self) {
        let load = self.load();
        let first = *self.rng.pick(&["BIN", "BCD"]);
        let sign = *self.rng.pick(&["", "", "UF0087", "DF0087", "F0047 UF0087 E DF0087 Z"]);
        line!(self, "{load} {sign} {first}");
        if self.rng.chance(50) {
            let operation = self.operation(1);
            let second = *self.rng.pick(&["BIN", "BCD"]);
            line!(self, "{operation} {second}");
        }
        self.stores();
        self.flags();
    }

    /// One group of bits of a word is cleared, one bit of it set.
    fn mask(&mut self) {
        let word = match self.rng.chance(50) {
            true => "Y40".to_owned(),
            false => self.pool.f_word(&mut self.rng),
        };
        let mask = *self.rng.pick(&["FF00", "00FF", "007F", "FFF0", "FFFE"]);
        line!(self, "L{word} A.{mask} S{word}");
        let bit = self.pool.output_bit(&mut self.rng);
        line!(self, "U{}", bit.trim_start_matches('Y'));
        if self.rng.chance(40) {
            let other = self.pool.bit(&mut self.rng);
            line!(self, "{other} L{word} O.{:04X} S{word} Z", 1 << self.rng.below(16));
        }
    }

    /// An operation, and at once its flags.
    fn tested_flags(&mut self) {
        let load = self.load();
        let operator = *self.rng.pick(&["+", "+", "-", "-", "*", "/"]);
        let operand = self.operand();
        line!(self, "{load} {operator}{operand}");
        if self.rng.chance(30) {
            self.stores();
        }
        self.flags();
        if self.rng.chance(40) {
            let operation = self.operation(1);
            self.line(operation);
            self.flags();
        }
    }

    fn switches(&mut self) {
        for _ in 0..1 + self.rng.below(4) {
            let bit = self.pool.output_bit(&mut self.rng);
            let bit = bit.trim_start_matches('Y').to_owned();
            line!(self, "{}{bit}", self.rng.pick(&["U", "D"]));
        }
    }

    fn counters(&mut self) {
        let counter = self.pool.counter(&mut self.rng);
        let condition = self.condition(1);
        match self.rng.below(4) {
            0 => line!(self, "{condition} U{counter} Z"),
            1 => line!(self, "{condition} D{counter} E U{counter} Z"),
            2 => {
                let end = self.rng.below(6);
                line!(self, "U{counter} L{counter} >{end} ,0 S{counter} Z");
            }
            _ => line!(self, "{}{counter} D{counter} Z", self.not()),
        }
    }

    /// The same chain twice, with something between that may change it.
    fn same_again(&mut self) {
        let load = self.load();
        let operation = self.operation(1);
        let text = format!("{load} {operation}");
        self.line(text.clone());
        self.stores();
        self.depth += 1;
        if self.depth < 4 {
            self.some_idiom();
        }
        self.depth -= 1;
        self.line(text);
        self.stores();
    }
}
