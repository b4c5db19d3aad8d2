//! The idioms of programs, each of one or some statements.

use super::Writer;
use crate::idioms::LONG;

impl Writer {
    /// The number of idioms.
    pub(super) const IDIOMS: usize = 31;

    /// The number of a variable that nothing else uses.
    pub(super) fn fresh(&mut self) -> usize {
        self.fresh += 1;
        self.fresh
    }

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
        self.idiom(idiom);
    }

    /// Writes an idiom. Deep inside others only those that hold no others.
    pub(super) fn idiom(&mut self, idiom: usize) {
        match idiom {
            12..=17 if self.lines.len() > LONG => self.assignment(),
            12 if self.depth < 3 => self.if_statement(),
            13 if self.depth < 3 => self.if_statement(),
            14 if self.depth < 2 => self.counting_loop(),
            15 if self.depth < 2 => self.wait(),
            16 if self.depth < 2 => self.timer(),
            17 if self.depth < 2 => self.states(),
            0 => self.copy(),
            1 => self.assignment(),
            2 => self.indexed_assignment(),
            3 => self.pack(),
            4 => self.unpack(),
            5 => self.toggle(),
            6 => self.edge(),
            7 => self.counter(),
            8 => self.shift(),
            9 => self.latch(),
            10 => self.decoder(),
            11 => self.range(),
            18 => self.filter(),
            19 => self.extremes(),
            20 => self.move_by_word(),
            21 => self.move_by_command(),
            22 => self.programs(),
            23 => self.address(),
            24 => self.say(),
            25 => self.update(),
            26 => self.integers(),
            27 => self.select(),
            28 => self.same_again(),
            29 => self.command(),
            30 => self.growth(),
            _ => self.assignment(),
        }
    }

    /// A variable that is assigned to.
    pub(super) fn target(&mut self) -> String {
        let text = match self.rng.below(12) {
            0..=2 => self.memory.bit(&mut self.rng),
            3 | 4 => self.memory.word(&mut self.rng),
            5 if self.place.is_compiled() => self.memory.l_word(&mut self.rng),
            6 if self.place.is_compiled() => self.memory.l_bit(&mut self.rng),
            7 => self.memory.flag(&mut self.rng),
            _ => self.memory.number(&mut self.rng),
        };
        self.named(text)
    }

    /// Bits or words are copied.
    fn copy(&mut self) {
        for _ in 0..1 + self.rng.below(4) {
            let target = self.target();
            let value = match self.rng.below(3) {
                0 => self.bit(0),
                1 => self.word(0),
                _ => self.bit(2),
            };
            line!(self, "{target}={value}");
        }
    }

    pub(super) fn assignment(&mut self) {
        let target = self.target();
        let depth = 1 + self.rng.below(4);
        let value = match self.rng.below(4) {
            0 => self.bit(depth),
            1 => self.word(depth),
            _ => self.number(depth),
        };
        line!(self, "{target}={value}");
    }

    fn indexed_assignment(&mut self) {
        let (target, value) = (self.indexed(2), self.number(2));
        // I-variables are read by their number only, and I5 must stay.
        let target = match target.strip_prefix('I') {
            Some(index) => format!("P{index}"),
            None => target,
        };
        line!(self, "{target}={value}");
        if self.rng.chance(50) {
            let again = self.memory.number(&mut self.rng);
            line!(self, "{again}={target}");
        }
    }

    /// Bits are put together to a word.
    fn pack(&mut self) {
        let target = self.target();
        if self.rng.chance(50) {
            let value = (0..2 + self.rng.below(7))
                .map(|index| {
                    let bit = self.bit(1);
                    format!("({bit})*{}", 1u32 << index)
                })
                .collect::<Vec<_>>()
                .join(*self.rng.pick(&["+", "|"]));
            line!(self, "{target}={value}");
            return;
        }
        line!(self, "{target}=0");
        for index in 0..2 + self.rng.below(6) {
            let (bit, weight) = (self.bit(1), 1u32 << index);
            match self.rng.below(3) {
                0 => line!(self, "{target}={target}|({bit})*{weight}"),
                1 => {
                    line!(self, "IF ({bit}=1)");
                    line!(self, "{target}={target}{}{weight}", self.rng.pick(&["+", "|"]));
                    self.if_end();
                }
                _ => line!(self, "{target}={target}*2+{bit}"),
            }
        }
    }

    /// Bits are taken out of a word.
    fn unpack(&mut self) {
        let word = self.word(0);
        for index in 0..2 + self.rng.below(5) {
            let target = self.target();
            let weight = 1u32 << index;
            match self.rng.below(5) {
                0 => line!(self, "{target}=INT({word}/{weight})%2"),
                1 => line!(self, "{target}=({word}&{weight})/{weight}"),
                2 => line!(self, "{target}=INT({word}/{weight})&1"),
                3 => line!(self, "{target}={word}&{weight}"),
                _ => {
                    line!(self, "IF ({word}&{weight}!=0)");
                    line!(self, "{target}=1");
                    self.line("ELSE".to_owned());
                    line!(self, "{target}=0");
                    self.if_end();
                }
            }
        }
    }

    fn toggle(&mut self) {
        let target = self.target();
        match self.rng.below(5) {
            0 => line!(self, "{target}=1-{target}"),
            1 => line!(self, "{target}={target}^1"),
            2 => line!(self, "{target}=({target}+1)%2"),
            3 => line!(self, "{target}=({target}+1)&1"),
            _ => {
                line!(self, "IF ({target}=1) {target}=0 ELSE {target}=1 ENDIF");
            }
        }
    }

    /// Something is done when an input has changed.
    fn edge(&mut self) {
        let (input, former) = (self.bit(1), format!("P{}", self.fresh()));
        let (old, new) = *self.rng.pick(&[("0", "1"), ("1", "0")]);
        match self.rng.below(3) {
            0 => line!(self, "IF ({input}={new} AND {former}={old})"),
            1 => {
                line!(self, "IF ({input}={new})");
                line!(self, "AND ({former}={old})");
            }
            _ => line!(self, "IF ({input}!={former})"),
        }
        self.depth += 1;
        if self.depth < 3 {
            self.some_idiom();
        } else {
            self.counter();
        }
        self.depth -= 1;
        self.if_end();
        line!(self, "{former}={input}");
    }

    fn counter(&mut self) {
        let target = self.target();
        let step =
            if self.rng.chance(70) { "1".to_owned() } else { self.memory.value(&mut self.rng) };
        let operator = *self.rng.pick(&["+", "+", "-"]);
        match self.rng.below(4) {
            0 => {
                let end = self.memory.whole(&mut self.rng);
                line!(self, "{target}=({target}{operator}{step})%{end}");
            }
            1 => {
                let end = self.rng.below(10);
                line!(self, "{target}={target}{operator}{step}");
                let comparator = *self.rng.pick(&[">", "!<", "=", "~"]);
                line!(self, "IF ({target}{comparator}{end}) {target}=0 ENDIF");
            }
            2 => {
                let condition = self.condition();
                line!(self, "IF {condition}");
                line!(self, "{target}={target}{operator}{step}");
                self.if_end();
            }
            _ => {
                let bit = self.bit(1);
                line!(self, "{target}={target}{operator}{bit}");
            }
        }
    }

    /// A shift register of variables or of a word's bits.
    fn shift(&mut self) {
        match self.rng.below(4) {
            0 => {
                let first = *self.rng.pick(&[10, 40, 70]) + self.rng.below(4);
                let count = 2 + self.rng.below(6);
                for index in (0..count).rev() {
                    line!(self, "M{}=M{}", first + index + 1, first + index);
                }
                let bit = self.bit(1);
                line!(self, "M{first}={bit}");
            }
            1 => {
                let first = 4 + self.rng.below(6);
                for index in (0..2 + self.rng.below(5)).rev() {
                    line!(self, "P{}=P{}", first + index + 1, first + index);
                }
                let value = self.number(1);
                line!(self, "P{first}={value}");
            }
            2 => {
                let (word, bit) = (self.memory.word(&mut self.rng), self.bit(1));
                line!(self, "{word}={word}*2{}({bit})", self.rng.pick(&["+", "|"]));
            }
            _ => {
                let (word, bit) = (self.target(), self.bit(1));
                line!(self, "{word}=INT({word}/2)|({bit})*128");
            }
        }
    }

    /// An output that is set and reset.
    fn latch(&mut self) {
        let output = self.target();
        if self.rng.chance(40) {
            let (set, reset) = (self.bit(1), self.bit(1));
            line!(self, "{output}=({output}|{set})&(1-{reset})");
            return;
        }
        for value in ["1", "0"] {
            let condition = self.condition();
            if self.rng.chance(50) {
                line!(self, "IF {condition} {output}={value} ENDIF");
            } else {
                line!(self, "IF {condition}");
                line!(self, "{output}={value}");
                self.if_end();
            }
        }
    }

    /// One value against several constants.
    fn decoder(&mut self) {
        let value = match self.rng.below(3) {
            0 => self.memory.number(&mut self.rng),
            1 => self.memory.word(&mut self.rng),
            _ => self.word(1),
        };
        let output = self.target();
        let step = *self.rng.pick(&["", "", "", ".5"]);
        let other = self.rng.chance(30).then(|| self.bit(0));
        for index in 0..2 + self.rng.below(7) {
            let result =
                if self.rng.chance(60) { self.memory.whole(&mut self.rng) } else { self.number(1) };
            let comparator = if self.rng.chance(90) { "=" } else { "~" };
            let more = other.as_ref().map_or(String::new(), |bit| format!(" AND {bit}=1"));
            let else_part =
                if self.rng.chance(15) { format!(" ELSE {output}=0") } else { String::new() };
            line!(
                self,
                "IF ({value}{comparator}{index}{step}{more}) {output}={result}{else_part} ENDIF"
            );
        }
    }

    fn range(&mut self) {
        if self.turbo {
            return self.assignment();
        }
        let (letter, first) =
            *self.rng.pick(&[("P", 4), ("P", 100), ("M", 10), ("M", 70), ("Q", 1), ("M", 84)]);
        let value = self.number(2);
        line!(self, "{letter}{first}..{}={value}", first + 1 + self.rng.below(8));
    }

    /// Q-variables of other coordinate systems.
    fn address(&mut self) {
        if self.place.number() != 0 {
            let system = match self.rng.below(4) {
                0 => self.memory.number(&mut self.rng),
                _ => (1 + self.rng.below(4)).to_string(),
            };
            let word = *self.rng.pick(&["ADDRESS", "ADR"]);
            line!(self, "{word}&{system}");
        }
        let (index, value) = (self.index(1), self.number(2));
        let target = self.memory.number(&mut self.rng);
        match self.rng.below(4) {
            0 => line!(self, "Q{}={value}", self.rng.pick(&[0, 1, 2, 127])),
            1 => line!(self, "Q({index})={value}"),
            2 => {
                line!(self, "Q0={value}");
                let of = self.number(1);
                line!(self, "{target}=ATAN2({of})");
            }
            _ => line!(self, "{target}=Q{}+Q({index})", self.rng.pick(&[0, 1, 2])),
        }
    }

    fn say(&mut self) {
        let number = self.memory.number(&mut self.rng);
        let word = self.memory.word(&mut self.rng);
        let statement = match self.rng.below(8) {
            0 => "SEND\"DOOR OPEN\"".to_owned(),
            1 => "SENDS\"PART DONE\"".to_owned(),
            2 => "SENDP^G".to_owned(),
            3 => format!("DISPLAY {},{}.{},{number}", self.rng.below(80), 8, self.rng.below(4)),
            4 => format!("DISP 10,4.1,{word}"),
            5 => "DISPLAY 40\"LINE TWO\"".to_owned(),
            6 => "CMD\"#1J/\"".to_owned(),
            _ => "COMMAND^A".to_owned(),
        };
        self.guarded(statement);
    }

    /// One of two values, chosen by a condition, then used.
    fn select(&mut self) {
        let (target, condition) = (self.target(), self.condition());
        let (first, second) = (self.number(1), self.number(1));
        if self.rng.chance(50) {
            line!(self, "IF {condition} {target}={first} ELSE {target}={second} ENDIF");
        } else {
            line!(self, "{target}={second}");
            line!(self, "IF {condition}");
            line!(self, "{target}={first}");
            self.if_end();
        }
        let used = self.target();
        let value = match self.rng.below(3) {
            0 => format!("P({target})"),
            1 => format!("P({target}&1)+{target}"),
            _ => format!("{target}*2"),
        };
        line!(self, "{used}={value}");
    }

    /// The same expression more than once, with something between that may change it.
    fn same_again(&mut self) {
        let value = self.number(3);
        let (first, second) = (self.target(), self.target());
        line!(self, "{first}={value}");
        if self.rng.chance(60) {
            self.depth += 1;
            self.some_idiom();
            self.depth -= 1;
        }
        line!(self, "{second}={value}");
    }

    /// Commands for variables.
    fn command(&mut self) {
        let (a, b) = (self.memory.number(&mut self.rng), self.memory.number(&mut self.rng));
        let bit = self.memory.bit(&mut self.rng);
        let statement = match self.rng.below(5) {
            0 => format!("CMD\"{a}={b}+1\""),
            1 => format!("CMD\"{bit}=1 {a}={bit}*3\""),
            2 => format!("COMMAND\"P4..7={b}\""),
            3 => format!("CMD\"{a}=*\""),
            _ => "CMD\"M84..86->*\"".to_owned(),
        };
        self.guarded(statement);
    }
}
