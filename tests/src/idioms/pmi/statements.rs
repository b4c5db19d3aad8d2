//! The idioms of programs, each of one or some statements.

use super::Writer;
use crate::idioms::LONG;

impl Writer {
    /// The number of idioms.
    pub(super) const IDIOMS: usize = 24;

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
            0..=5 if self.lines.len() > LONG => self.assignment(),
            0 | 1 if self.depth < 4 => self.if_statement(),
            2 if self.depth < 4 => self.cases(),
            3 | 4 if self.depth < 4 && self.may_have_labels => self.jump_over(),
            5 if self.depth < 4 => self.states(),
            6 => self.edge(),
            7 => self.latch(),
            8 => self.timer(),
            9 => self.flip_flop(),
            10 => self.group(),
            11 => self.counter(),
            12 => self.table(),
            13 => self.shift(),
            14 => self.select(),
            15 => self.pack(),
            16 => self.message(),
            17 => self.same_again(),
            18 => self.ladder(),
            19 => self.long_sum(),
            20 => self.executive(),
            _ => self.assignment(),
        }
    }

    fn assignment(&mut self) {
        let depth = 1 + self.rng.below(3);
        let target = self.target();
        let value = self.any(depth);
        line!(self, "{target}={value}");
    }

    /// A variable that is assigned to.
    fn target(&mut self) -> String {
        match self.rng.below(10) {
            0..=3 => self.pool.logical_out(&mut self.rng),
            4..=6 => self.pool.integer_out(&mut self.rng),
            7 => self.pool.long_out(&mut self.rng),
            _ => {
                let name = *self.rng.pick(&["XA", "AA", "AA", "LA"]);
                let index = self.index(8, 1);
                format!("{name}[{index}]")
            }
        }
    }

    fn body(&mut self) {
        self.depth += 1;
        for _ in 0..1 + self.rng.below(3) {
            self.some_idiom();
        }
        self.depth -= 1;
    }

    fn condition(&mut self) -> String {
        let depth = 1 + self.rng.below(2);
        if self.rng.chance(80) { self.logical(depth) } else { self.any(depth) }
    }

    fn if_statement(&mut self) {
        let condition = self.condition();
        line!(self, "IF({condition})");
        self.body();
        for _ in 0..*self.rng.pick(&[0, 0, 0, 1, 2]) {
            let condition = self.condition();
            line!(self, "ELSEIF({condition})");
            self.body();
        }
        if self.rng.chance(40) {
            line!(self, "ELSE");
            self.body();
        }
        line!(self, "ENDIF");
    }

    /// One value against several constants.
    fn cases(&mut self) {
        let value = if self.rng.chance(70) {
            self.pool.integer(&mut self.rng)
        } else {
            self.pool.long(&mut self.rng)
        };
        let target = self.target();
        let single = self.rng.chance(50);
        for index in 0..2 + self.rng.below(6) {
            let keyword = if single || index == 0 { "IF" } else { "ELSEIF" };
            line!(self, "{keyword}({value}={index})");
            let result = self.integer(1);
            line!(self, "{target}={result}");
            if single {
                line!(self, "ENDIF");
            }
        }
        if !single {
            line!(self, "ENDIF");
        }
    }

    /// A GOTO forwards; sometimes into or out of an IF's body.
    fn jump_over(&mut self) {
        self.labels += 1;
        let label = format!("LB{}", self.labels);
        let condition = self.condition();
        line!(self, "IF({condition})");
        self.depth += 1;
        if self.rng.chance(40) {
            self.some_idiom();
        }
        line!(self, "GOTO {label}");
        line!(self, "ENDIF");
        let inside = self.rng.chance(30);
        if inside {
            let condition = self.condition();
            line!(self, "IF({condition})");
        }
        self.some_idiom();
        line!(self, "{label}:");
        self.some_idiom();
        if inside {
            line!(self, "ELSE");
            self.some_idiom();
            line!(self, "ENDIF");
        }
        self.depth -= 1;
    }

    fn states(&mut self) {
        let state = self.pool.integer_out(&mut self.rng);
        let count = 2 + self.rng.below(4);
        for index in 0..count {
            let condition = self.logical(1);
            line!(self, "IF(({state}={index})&({condition}))");
            self.body();
            match self.rng.below(3) {
                0 => line!(self, "{state}={state}+1"),
                1 => line!(self, "{state}=({state}+1)%{count}"),
                _ => line!(self, "{state}={}", (index + 1) % count),
            }
            line!(self, "ENDIF");
        }
    }

    /// A rising edge, caught as the manual does.
    fn edge(&mut self) {
        let (input, pulse) =
            (self.pool.logical(&mut self.rng), self.pool.logical_out(&mut self.rng));
        let former = format!("X{}", 40 + self.rng.below(6));
        line!(self, "{pulse}={input}&/{former}");
        line!(self, "{former}={input}");
        if self.depth < 4 {
            line!(self, "IF({pulse})");
            self.depth += 1;
            self.some_idiom();
            self.depth -= 1;
            line!(self, "ENDIF");
        }
    }

    fn latch(&mut self) {
        let output = self.pool.logical_out(&mut self.rng);
        let (set, reset) = (self.logical(1), self.logical(1));
        match self.rng.below(3) {
            0 => line!(self, "{output}=({output}!({set}))&/({reset})"),
            1 => line!(self, "{output}=(({set})!{output})&({reset})"),
            _ => line!(self, "{output}={output}&/({reset})!({set})"),
        }
    }

    fn timer(&mut self) {
        let number = self.rng.below(3);
        let condition = self.logical(1);
        match self.rng.below(3) {
            0 => line!(self, "TC{number}=({condition})&/TD{number}"),
            1 => line!(self, "TC{number}={condition}"),
            _ => {
                line!(self, "TC{number}=F");
                line!(self, "TC{number}={condition}");
            }
        }
        let target = self.pool.logical_out(&mut self.rng);
        line!(self, "{target}=TD{number}");
    }

    fn flip_flop(&mut self) {
        let n = self.rng.below(2);
        if self.rng.chance(40) {
            let (preset, clear) = (self.logical(0), self.logical(1));
            line!(self, "FP{n}={preset}");
            line!(self, "FL{n}={clear}");
        }
        let data = if self.rng.chance(60) { format!("/FQ{n}") } else { self.logical(1) };
        line!(self, "FD{n}={data}");
        let clock = self.logical(1);
        line!(self, "FK{n}={clock}");
        if self.rng.chance(30) {
            line!(self, "FK{n}={}", self.rng.pick(&["T", "F"]));
        }
        let target = self.target();
        line!(self, "{target}=FQ{n}");
    }

    /// Groups of lines as numbers.
    fn group(&mut self) {
        let n = self.rng.below(6);
        match self.rng.below(4) {
            0 => {
                let value = self.any(2);
                line!(self, "GO{n}={value}");
            }
            1 => line!(self, "GO{n}=GI{}", self.rng.below(6)),
            2 => line!(self, "GO{n}=GO{n}+1"),
            _ => {
                let target = self.target();
                line!(self, "{target}=GI{n}+GI{}*100", self.rng.below(6));
            }
        }
        if self.rng.chance(40) {
            let target = self.target();
            line!(self, "{target}=GO{n}");
        }
    }

    fn counter(&mut self) {
        let target = if self.rng.chance(70) {
            self.pool.integer_out(&mut self.rng)
        } else {
            self.pool.long_out(&mut self.rng)
        };
        let bit = self.pool.logical(&mut self.rng);
        match self.rng.below(5) {
            0 => line!(self, "{target}={target}+{bit}"),
            1 => line!(self, "{target}=({target}+1)%{}", 1 + self.rng.below(9)),
            2 => {
                line!(self, "{target}={target}+1");
                if self.depth < 4 {
                    line!(self, "IF({target}>{})", self.rng.below(9));
                    line!(self, "{target}=0");
                    line!(self, "ENDIF");
                }
            }
            3 if !target.starts_with('L') => {
                line!(self, "{target}=({target}+{bit})*({target}<{})", self.rng.below(9))
            }
            _ => line!(self, "{target}={target}-{}", self.rng.pick(&["1", "7", "32767", "30000"])),
        }
    }

    fn table(&mut self) {
        let name = *self.rng.pick(&["AA", "AA", "XA", "LA"]);
        let (first, second) = (self.index(8, 1), self.index(8, 1));
        match self.rng.below(4) {
            0 => {
                let value = self.any(2);
                line!(self, "{name}[{first}]={value}");
            }
            1 => line!(self, "{name}[{first}]={name}[{second}]"),
            2 => line!(self, "{name}[{first}]={name}[{first}]+1"),
            _ => {
                let other = *self.rng.pick(&["AC", "LC", "XC"]);
                let third = self.index(4, 1);
                line!(self, "{name}[{first}]={other}[{third}]");
            }
        }
        let target = self.target();
        line!(self, "{target}={name}[{second}]");
    }

    /// A shift register of variables or elements.
    fn shift(&mut self) {
        let count = 2 + self.rng.below(5);
        let letter = *self.rng.pick(&["X", "A", "O", "L"]);
        let array = self.rng.chance(40);
        let name = |index: usize| match array {
            true => format!("AA[{index}]"),
            false => format!("{letter}{}", index + 2),
        };
        for index in (0..count).rev() {
            line!(self, "{}={}", name(index + 1), name(index));
        }
        let value = self.any(1);
        line!(self, "{}={value}", name(0));
    }

    /// One of two values, by IF or by products with a LOGICAL.
    fn select(&mut self) {
        let target = self.pool.integer_out(&mut self.rng);
        let (a, b) = (self.pool.integer(&mut self.rng), self.pool.integer(&mut self.rng));
        let bit = self.pool.logical(&mut self.rng);
        if self.depth < 4 && self.rng.chance(40) {
            let (a, b) = (self.any(1), self.any(1));
            line!(self, "IF({bit})");
            line!(self, "{target}={a}");
            line!(self, "ELSE");
            line!(self, "{target}={b}");
            line!(self, "ENDIF");
        } else {
            line!(self, "{target}=({a}*/{bit})+(({b}+1)*{bit})");
        }
    }

    /// Bits to a number, and a number to bits.
    fn pack(&mut self) {
        let target = self.pool.integer_out(&mut self.rng);
        if self.rng.chance(50) {
            let terms: Vec<String> = (0..2 + self.rng.below(6))
                .map(|index| format!("({}*{})", self.pool.logical(&mut self.rng), 1 << index))
                .collect();
            line!(self, "{target}={}", terms.join("+"));
            return;
        }
        for index in 0..2 + self.rng.below(5) {
            let bit = self.pool.logical_out(&mut self.rng);
            match self.rng.below(3) {
                0 => line!(self, "{bit}={target}/{}%2", 1 << index),
                1 => line!(self, "{bit}=({target}/{}%2)=1", 1 << index),
                _ => line!(self, "{bit}={target}%{}/{}", 2 << index, 1 << index),
            }
        }
    }

    fn message(&mut self) {
        let (name, condition) = (*self.rng.pick(&["MS", "FT"]), self.condition());
        line!(self, "{name}{}={condition}", self.rng.below(3));
    }

    /// The same expression twice, with something between that may change it.
    fn same_again(&mut self) {
        let value = self.any(2);
        let (first, second) = (self.target(), self.target());
        line!(self, "{first}={value}");
        if self.rng.chance(60) {
            self.some_idiom();
        }
        line!(self, "{second}={value}");
    }

    /// A long logical chain.
    fn ladder(&mut self) {
        let target = self.pool.logical_out(&mut self.rng);
        let mut text = self.pool.logical(&mut self.rng);
        for _ in 0..3 + self.rng.below(14) {
            text += *self.rng.pick(&["&", "&", "!", "!", "&/", "!/"]);
            text += &self.pool.logical(&mut self.rng);
        }
        line!(self, "{target}={text}");
    }

    fn long_sum(&mut self) {
        let (target, value) = (self.pool.long_out(&mut self.rng), self.long(3));
        line!(self, "{target}={value}");
        let bit = self.pool.logical_out(&mut self.rng);
        let limit = self.pool.long(&mut self.rng);
        let relation = *self.rng.pick(&[">", "<", "=", ">=", "/="]);
        line!(self, "{bit}={target}{relation}{limit}");
    }

    fn executive(&mut self) {
        match self.rng.below(5) {
            0 => {
                let value = self.logical(1);
                line!(self, "@M03=@M03&/({value})");
            }
            1 => {
                let value = self.integer(1);
                line!(self, "@NVINT[{}]={value}", self.rng.below(4));
            }
            2 => {
                let target = self.target();
                line!(self, "{target}=@NVINT[{}]+@NVLNG[1]", self.rng.below(4));
            }
            3 => {
                let value = self.long(1);
                line!(self, "@NVLNG[1]={value}");
            }
            _ => {
                let target = self.target();
                line!(self, "{target}=(@SCODE-100)%1000");
            }
        }
    }
}
