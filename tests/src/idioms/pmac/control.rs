//! Statements that hold others: IF and WHILE, with conditions on several lines; states and waiting.

use super::{Place, Writer};

impl Writer {
    /// The lines of a condition, each beginning with its keyword.
    fn head(&mut self, keyword: &str) {
        let condition = self.condition();
        // Without a blank a name would be one word with the keyword.
        let glued = condition.starts_with('(') && self.rng.chance(30);
        let space = if glued { "" } else { " " };
        line!(self, "{keyword}{space}{condition}");
        while self.rng.chance(25) {
            let (join, condition) = (*self.rng.pick(&["AND", "OR"]), self.condition());
            if self.rng.chance(50) {
                line!(self, "{join} {condition}");
            } else if let Some(last) = self.lines.last_mut() {
                *last += &format!(" {join} {condition}");
            }
        }
    }

    pub(super) fn if_end(&mut self) {
        let word = *self.rng.pick(&["ENDIF", "ENDIF", "ENDIF", "ENDI", "END IF"]);
        self.line(word.to_owned());
    }

    pub(super) fn while_end(&mut self) {
        let word = *self.rng.pick(&["ENDWHILE", "ENDWHILE", "ENDW", "END WHILE"]);
        self.line(word.to_owned());
    }

    /// One to three statements, in a block.
    fn body(&mut self) {
        self.depth += 1;
        for _ in 0..1 + self.rng.below(3) {
            self.some_idiom();
        }
        self.depth -= 1;
    }

    pub(super) fn if_statement(&mut self) {
        self.head("IF");
        self.body();
        if self.rng.chance(45) {
            self.line("ELSE".to_owned());
            self.body();
        }
        self.if_end();
    }

    /// A loop that counts and stands there for some scans.
    pub(super) fn counting_loop(&mut self) {
        let counter = format!("P{}", self.fresh());
        let end = 1 + self.rng.below(6);
        line!(self, "{counter}={}", self.rng.pick(&["0", "0", "1", "-1", "0.5"]));
        let condition = match self.rng.below(3) {
            0 => format!("({counter}<{end})"),
            1 => format!("({counter}!>{end})"),
            _ => {
                let (join, other) = (*self.rng.pick(&["AND", "OR"]), self.comparison());
                format!("({counter}<{end} {join} {other})")
            }
        };
        line!(self, "WHILE {condition}");
        // The statements of the body find the counter as an index.
        if self.rng.chance(60) {
            let base = *self.rng.pick(&["", "100+", "10+", "70+", "2*"]);
            let value = self.number(2);
            let letter = *self.rng.pick(&["P", "P", "M", "Q"]);
            line!(self, "{letter}({base}{counter})={value}");
        }
        self.body();
        line!(self, "{counter}={counter}+{}", self.rng.pick(&["1", "1", "1", "0.5", "2"]));
        self.while_end();
    }

    /// Waits for a condition.
    pub(super) fn wait(&mut self) {
        self.head("WHILE");
        if self.rng.chance(40) {
            self.body();
        }
        self.while_end();
    }

    /// A timer is set and waited for.
    pub(super) fn timer(&mut self) {
        let (set, ask) = match (self.turbo, self.rng.below(3)) {
            (true, 0 | 1) => ("I5111".to_owned(), "I5111".to_owned()),
            _ => {
                let word = self.memory.word(&mut self.rng);
                (word.clone(), word)
            }
        };
        let time = *self.rng.pick(&["2", "3", "1.5", "10*8388608/I10", "5*8388608/I10"]);
        line!(self, "{set}={time}");
        let other =
            if self.rng.chance(40) { format!(" AND {}", self.comparison()) } else { String::new() };
        line!(self, "WHILE ({ask}>0{other})");
        if self.rng.chance(30) {
            self.body();
        }
        self.while_end();
    }

    /// A machine of states: each state does something and goes to another one.
    pub(super) fn states(&mut self) {
        let state = if self.rng.chance(70) {
            format!("P{}", self.fresh())
        } else {
            self.memory.number(&mut self.rng)
        };
        let count = 2 + self.rng.below(4);
        let step = *self.rng.pick(&[1, 1, 10]);
        for index in 0..count {
            let other = if self.rng.chance(50) {
                format!(" AND {}", self.comparison())
            } else {
                String::new()
            };
            line!(self, "IF ({state}={}{other})", index * step);
            self.body();
            let next = match self.rng.below(4) {
                0 => format!("{state}+{step}"),
                1 => format!("({state}+{step})%{}", count * step),
                _ => ((index + 1) % count * step).to_string(),
            };
            line!(self, "{state}={next}");
            self.if_end();
        }
    }

    /// Starts and stops programs.
    pub(super) fn programs(&mut self) {
        let at = self.rng.below(self.places.len());
        let target = self.places.get(at).copied().unwrap_or(Place::Plc(1));
        let word = match target {
            Place::Plc(_) => *self
                .rng
                .pick(&["ENABLE", "DISABLE", "PAUSE", "RESUME", "ENA", "DIS", "PAU", "RES"]),
            Place::Plcc(_) if self.place.number() == 0 => "ENABLE",
            Place::Plcc(_) => *self.rng.pick(&["ENABLE", "DISABLE", "ENA", "DIS"]),
        };
        let name = if target.is_compiled() { "PLCC" } else { "PLC" };
        self.guarded(format!("{word} {name} {}", target.number()));
    }

    /// A statement that is done at an edge or in a condition only.
    pub(super) fn guarded(&mut self, statement: String) {
        if self.rng.chance(30) {
            self.line(statement);
            return;
        }
        self.head("IF");
        self.line(statement);
        self.if_end();
    }
}
