//! Statements of generated downloads.

use super::Generator;
use super::tables::{COMMANDS, L, M};

impl Generator {
    /// A statement, and those that it encloses; `depth` others enclose it.
    pub(super) fn statement(&mut self, budget: &mut usize, depth: usize) {
        *budget = budget.saturating_sub(1);
        match self.rng.below(24) {
            0..3 if depth < 4 => self.branch(budget, depth),
            3 if depth < 4 => self.while_loop(budget, depth),
            4 if depth < 3 => self.counted_loop(budget, depth),
            5 => {
                let text = self.command();
                self.line(&text);
            }
            6 => {
                let text = self.message();
                self.line(&text);
            }
            7 => {
                let text = self.plcs();
                self.line(&text);
            }
            8 if self.number != 0 => {
                let text = self.address();
                self.line(&text);
            }
            9 if self.rng.chance(30) => {
                let text = self.other();
                self.line(&text);
            }
            _ => {
                let text = self.assignment();
                self.line(&text);
            }
        }
    }

    fn branch(&mut self, budget: &mut usize, depth: usize) {
        let condition = self.condition();
        self.line(&format!("IF{condition}"));
        for _ in 0..self.rng.below(4) {
            self.statement(budget, depth + 1);
        }
        if self.rng.chance(40) {
            self.line("ELSE");
            for _ in 0..self.rng.below(3) {
                self.statement(budget, depth + 1);
            }
        }
        let end = *self.rng.pick(&["ENDIF", "ENDI", "END IF"]);
        self.line(end);
    }

    fn while_loop(&mut self, budget: &mut usize, depth: usize) {
        let condition = self.condition();
        let word = *self.rng.pick(&["WHILE", "WHIL", "WHI"]);
        self.line(&format!("{word}{condition}"));
        for _ in 0..self.rng.below(3) {
            self.statement(budget, depth + 1);
        }
        let end = *self.rng.pick(&["ENDWHILE", "ENDW", "END WHILE"]);
        self.line(end);
    }

    /// A loop that ends after a few scans, so that what stands after it and around it runs too.
    fn counted_loop(&mut self, budget: &mut usize, depth: usize) {
        let counter = 100 + 8 * self.number + depth + if self.compiled { 4 } else { 0 };
        let times = 1 + self.rng.below(3);
        self.line(&format!("P{counter}=0"));
        self.line(&format!("WHILE(P{counter}<{times})"));
        self.line(&format!("P{counter}=P{counter}+1"));
        for _ in 0..self.rng.below(3) {
            self.statement(budget, depth + 1);
        }
        self.line("ENDWHILE");
    }

    fn command(&mut self) -> String {
        let word = *self.rng.pick(&["CMD", "COMMAND", "COMM", "COMMANDS", "CMDP"]);
        if self.rng.chance(8) {
            return format!("{word}^{}", self.rng.pick(&["A", "D", "K", "@"]));
        }
        let text = *self.rng.pick(COMMANDS);
        format!("{word}\"{}\"", self.placed(text))
    }

    fn message(&mut self) -> String {
        match self.rng.below(6) {
            0 => {
                let word = self.rng.pick(&["SEND", "SENDS", "SENDP", "SENDR", "SENDA"]);
                format!("{word}\"text\"")
            }
            1 => "SEND^K".to_owned(),
            2 => format!("DISPLAY {}\"text\"", self.rng.pick(&["", "3", "39,"])),
            _ => {
                let word = self.rng.pick(&["DISPLAY", "DISP"]);
                let field = *self.rng.pick(&["8.2", "1.0", "5", "12.0", "80.40", "3.3"]);
                let position = self.rng.below(40);
                let variable = self.displayed();
                format!("{word} {position},{field},{variable}")
            }
        }
    }

    /// A variable by itself.
    fn displayed(&mut self) -> String {
        match self.rng.below(8) {
            0..3 => format!("P{}", self.rng.below(12)),
            3 => format!("Q{}", self.rng.below(4)),
            4 => format!("M{}", self.rng.pick(M).0),
            5 => format!("I{}", self.rng.pick(&[15, 20, 60])),
            6 if self.compiled => self.long(),
            _ => format!("P(P{}%12)", self.rng.below(12)),
        }
    }

    /// ENABLE and its kind. PLC0 and PLC1 stay enabled, so that something always runs.
    fn plcs(&mut self) -> String {
        let stops = ["7", "2", "2,7", "2..7", "3..5", "31", "2,3..6,7", "$2..7"];
        let starts = ["7", "2", "0..31", "1,2,7", "0", "2..7", "5", "1..2,7"];
        let compiled = ["3", "0..3", "2..31", "3,4"];
        let gap = *self.rng.pick(&[" ", ""]);
        let (word, name, which) = match self.rng.below(8) {
            0 | 1 => (["ENABLE", "ENA"], "PLC", *self.rng.pick(&starts)),
            2 | 3 => (["DISABLE", "DIS"], "PLC", *self.rng.pick(&stops)),
            4 => (["PAUSE", "PAU"], "PLC", *self.rng.pick(&stops)),
            5 => (["RESUME", "RES"], "PLC", *self.rng.pick(&starts)),
            6 if self.number != 0 => (["DISABLE", "DIS"], "PLCC", "3"),
            _ => (["ENABLE", "ENA"], "PLCC", *self.rng.pick(&compiled)),
        };
        format!("{}{gap}{name}{gap}{which}", self.rng.pick(&word))
    }

    fn address(&mut self) -> String {
        let word = *self.rng.pick(&["ADDRESS", "ADDR", "ADR"]);
        let system = match self.rng.below(6) {
            0 => "&2".to_owned(),
            1 => "&1".to_owned(),
            2 => "&8".to_owned(),
            3 => format!("&M{}", self.rng.pick(&[3, 4, 9, 26, 34])),
            4 => format!("&Q{}", self.rng.below(4)),
            _ => format!("&P{}", self.rng.below(12)),
        };
        match self.rng.below(4) {
            0 => format!("{word}#1{system}"),
            1 => format!("{word}{system}#P{}", self.rng.below(12)),
            2 => format!("{word} {system}"),
            _ => format!("{word}{system}"),
        }
    }

    /// Statements of the MACRO ring and the processors' locks.
    fn other(&mut self) -> String {
        let variable = format!("P{}", self.rng.below(12));
        if self.number == 0 {
            return format!("LOCK3,{variable} UNLOCK3");
        }
        match self.rng.below(5) {
            0 => format!("LOCK3,{variable}"),
            1 => "UNLOCK3".to_owned(),
            2 => format!("MACROSLVREAD4,MI910,{variable}"),
            3 => format!("MACROSLVWRITE4,MI910,{variable}"),
            _ => format!("MSR4,MI910,{variable}"),
        }
    }

    fn assignment(&mut self) -> String {
        if self.compiled && self.rng.chance(50) {
            return match self.rng.below(6) {
                0 if self.ranges => {
                    let first = 1 + self.rng.below(L.len() - 3);
                    format!("L{first}..{}={}", first + self.rng.below(3), self.integers(0))
                }
                1 => format!("{}={}", self.long(), self.expression(1)),
                _ => format!("{}={}", self.long(), self.integers(0)),
            };
        }
        match self.rng.below(22) {
            0 => format!("P({})={}", self.expression(2), self.expression(0)),
            1 => format!("M({})={}", self.rng.below(13) + 1, self.expression(0)),
            2 => format!("M(ABS({})%47)={}", self.expression(2), self.expression(1)),
            3 => format!("Q({})={}", self.expression(2), self.expression(1)),
            4 => format!("I(60+INT(ABS({}))%3)={}", self.expression(2), self.expression(1)),
            // Moves a definition among P-variables.
            5 => format!("M35={}+INT(ABS(P{})%8)", self.p_address(), self.rng.below(12)),
            6 if self.rng.chance(20) => format!("M36={}", 0x07F0 + self.rng.below(4)),
            // Moves M40 anywhere.
            7 if self.rng.chance(40) => {
                let mover = self.rng.pick(&[38, 39]);
                format!("M{mover}={}", self.expression(1))
            }
            7 => format!("M39={}", 0x07F0 + self.rng.below(8)),
            8 => {
                let op = self.rng.pick(&["&", "|", "^"]);
                let target = self.target();
                format!("{target}{op}={}", self.expression(1))
            }
            9 => {
                let op = self.rng.pick(&["&", "|", "^"]);
                let kind = self.rng.pick(&["P", "M", "Q"]);
                let number = format!("{}+{}", self.rng.below(6), self.rng.below(6));
                format!("{kind}({number}){op}={}", self.expression(1))
            }
            10..14 if self.ranges => self.range_assignment(),
            _ => {
                let target = self.target();
                format!("{target}={}", self.expression(0))
            }
        }
    }

    fn range_assignment(&mut self) -> String {
        match self.rng.below(7) {
            0 => format!("P{}..{}={}", 4, 4 + self.rng.below(14), self.expression(1)),
            1 => format!("P3,4,2={}", self.expression(1)),
            2 => format!("M1..{}={}", 2 + self.rng.below(30), self.expression(1)),
            3 => format!("Q0..{}={}", self.rng.below(14), self.expression(1)),
            4 => format!("I60..{}={}", 60 + self.rng.below(14), self.expression(1)),
            5 => format!("M4,3,5={}", self.expression(1)),
            // Moves M34 before and after it is written.
            _ => format!("M33..35={}+INT(ABS(P{})%8)", self.p_address(), self.rng.below(12)),
        }
    }

    /// A variable that can be assigned without harm to what runs when.
    fn target(&mut self) -> String {
        match self.rng.below(8) {
            0..4 => format!("P{}", self.rng.below(12)),
            4 => format!("Q{}", self.rng.below(4)),
            5 => format!("I{}", self.rng.pick(&[15, 20, 60, 100, 105, 136])),
            _ => format!("M{}", self.rng.pick(M).0),
        }
    }
}
