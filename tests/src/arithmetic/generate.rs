//! Generates random statements.

use std::ops::Range;

use plcc_abi::pmac::{Definition, Field, Format, Kind, Space};

use super::values::EDGES;
use super::{Bin, Cmp, Condition, Expr, Statement, Statements};
use plcc_random::Rng;

/// P, Q and I100 on below this are read.
pub(crate) const INPUTS: u32 = 24;

/// Addresses of the words that are read and written.
pub(crate) const WORDS: Range<u32> = 0x07D0..0x0800;

/// M-variables that are read are numbered from 1 to below this.
const READ_M: u32 = 40;

/// M-variables that are written, from here to below `WRITTEN_M + 24`.
const WRITTEN_M: u32 = 40;

/// What a program is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kinds {
    /// Statements of every kind.
    Any,
    /// M-variables that are fields of words, and integer constants, which compiled code mostly computes
    /// in integers.
    Fields,
    /// P-variables with bit operators and remainders, where compiled code speculates that they hold
    /// integers.
    Speculated,
    /// A PLCC with L-variables.
    Long,
}

struct Generator {
    rng: Rng,
    kinds: Kinds,
    l: u32,
    /// Whether the statement that is being written has only operands and operators that compiled code
    /// computes in integers.
    integers_only: bool,
    /// The next P-variable that takes a result.
    result: u32,
}

/// A program with this number of statements, the same for the same seed.
pub fn program(seed: u64, kinds: Kinds, statements: usize) -> Statements {
    let mut g = Generator { rng: Rng::new(seed), kinds, l: 12, integers_only: false, result: 100 };
    let mut out = Statements { compiled: kinds == Kinds::Long, ..Statements::default() };
    for number in 1..WRITTEN_M + 24 {
        out.m.push((number, g.definition(number >= READ_M)));
    }
    if out.compiled {
        for number in 1..=g.l {
            out.l.push((number, g.word()));
        }
    }
    for _ in 0..statements {
        let statement = g.statement();
        out.all.push(statement);
    }
    out
}

impl Generator {
    fn word(&mut self) -> Definition {
        let width = match self.rng.below(4) {
            0 => 1,
            1 => 8,
            2 => 24,
            _ => 1 + self.rng.below(24) as u8,
        };
        let width: u8 = width;
        let offset = self.rng.below(25 - usize::from(width)) as u8;
        let format = *self.rng.pick(&[
            Format::U,
            Format::U,
            Format::U,
            Format::S,
            Format::S,
            Format::D,
            Format::C,
        ]);
        let field = Field { offset, width, format };
        let address = WORDS.start + self.rng.below(WORDS.len()) as u32;
        let space = if self.rng.chance(50) { Space::X } else { Space::Y };
        Definition::word(space, address, field)
    }

    fn definition(&mut self, written: bool) -> Definition {
        // A pair of words at the last address would need one more.
        let address = WORDS.start + self.rng.below(WORDS.len()) as u32;
        let fields = self.kinds == Kinds::Fields;
        match self.rng.below(if fields { 30 } else { 20 }) {
            0 => Definition::Star,
            1 => Definition::L { address: 0x1000 + if written { 990 } else { 3 } },
            2 => Definition::L { address: 0x1400 + self.rng.below(8) as u32 },
            3 if !fields => Definition::D { address },
            4 if !fields => Definition::Dp { address },
            5 if !fields => Definition::F { address },
            6 if !fields => Definition::L { address },
            _ => self.word(),
        }
    }

    fn number(&mut self) -> String {
        let value = match self.rng.below(12) {
            10 => self.rng.below(4096) as f64,
            // Numbers at and beyond the bounds of fields.
            11 => *self.rng.pick(EDGES),
            0 => 0.0,
            1..4 => self.rng.below(20) as f64,
            4 => f64::from(1 << self.rng.below(24)),
            5 => f64::from(self.rng.bits() as u32 & 0xFF_FFFF),
            6 => return format!("${:X}", self.rng.bits() & 0xFFFF),
            7 => self.rng.below(1000) as f64 / 8.0,
            _ => *self.rng.pick(EDGES),
        };
        if self.integers_only {
            let most =
                if self.kinds == Kinds::Long { 8_388_607.0 } else { 9_007_199_254_740_992.0 };
            return value.clamp(0.0, most).floor().to_string();
        }
        value.to_string()
    }

    fn variable(&mut self) -> Expr {
        let any = |g: &mut Self| match g.rng.below(10) {
            0..5 => Expr::Var(Kind::P, g.rng.below(INPUTS as usize) as u32),
            5 => Expr::Var(Kind::Q, g.rng.below(INPUTS as usize) as u32),
            6 => Expr::Var(Kind::I, 100 + g.rng.below(INPUTS as usize) as u32),
            _ => Expr::Var(Kind::M, g.rng.below(READ_M as usize) as u32),
        };
        let m = |g: &mut Self| Expr::Var(Kind::M, 1 + g.rng.below(READ_M as usize - 1) as u32);
        match self.kinds {
            Kinds::Fields if self.integers_only || self.rng.chance(80) => m(self),
            Kinds::Speculated if self.integers_only || self.rng.chance(80) => {
                Expr::Var(Kind::P, self.rng.below(INPUTS as usize) as u32)
            }
            Kinds::Long if self.integers_only || self.rng.chance(80) => {
                Expr::Var(Kind::L, 1 + self.rng.below(self.l as usize) as u32)
            }
            _ => any(self),
        }
    }

    fn operator(&mut self) -> Bin {
        match self.rng.below(3) {
            0 => *self.rng.pick(&[Bin::And, Bin::Or, Bin::Xor, Bin::Mod, Bin::And]),
            1 => *self.rng.pick(&[Bin::Add, Bin::Sub, Bin::Mul]),
            _ if self.integers_only && self.kinds != Kinds::Long => {
                *self.rng.pick(&[Bin::And, Bin::Sub, Bin::Mul, Bin::Mod])
            }
            _ if self.kinds == Kinds::Any || self.rng.chance(30) => *self.rng.pick(&Bin::ALL),
            _ => *self.rng.pick(&[Bin::And, Bin::Or, Bin::Add, Bin::Sub]),
        }
    }

    fn expression(&mut self, depth: usize) -> Expr {
        let leaf = depth == 0 || self.rng.chance(25);
        if leaf {
            if self.rng.chance(65) {
                return self.variable();
            }
            let number = Expr::Number(self.number());
            return if self.rng.chance(15) { Expr::Neg(Box::new(number)) } else { number };
        }
        let any = if self.integers_only { 2 } else { 0 };
        match any + self.rng.below(if self.kinds == Kinds::Any { 16 } else { 22 }) {
            0 => {
                let function = self.rng.pick(&[
                    "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "ATAN2", "LN", "EXP", "SQRT",
                    "SQRT",
                ]);
                Expr::Call(function, Box::new(self.expression(depth - 1)))
            }
            1 => {
                let kind = *self.rng.pick(&[Kind::P, Kind::Q, Kind::I, Kind::M]);
                Expr::Indirect(kind, Box::new(self.index(depth - 1)))
            }
            2 | 3 => Expr::Neg(Box::new(self.expression(depth - 1))),
            4 => Expr::Call("ABS", Box::new(self.expression(depth - 1))),
            5 => Expr::Call("INT", Box::new(self.expression(depth - 1))),
            _ => {
                let bin = self.operator();
                let left = self.expression(depth - 1);
                let right = match bin {
                    // Most remainders in real programs are by constants.
                    Bin::Mod if self.integers_only || self.rng.chance(70) => {
                        let number = Expr::Number(self.number());
                        let minus = self.rng.chance(30);
                        if minus { Expr::Neg(Box::new(number)) } else { number }
                    }
                    _ => self.expression(depth - 1),
                };
                Expr::Bin(bin, Box::new(left), Box::new(right))
            }
        }
    }

    fn index(&mut self, depth: usize) -> Expr {
        if self.rng.chance(30) {
            return self.expression(depth);
        }
        let limit = Expr::Number(INPUTS.to_string());
        Expr::Bin(Bin::Mod, Box::new(self.expression(depth)), Box::new(limit))
    }

    fn comparison(&mut self, depth: usize) -> Condition {
        let cmp = Cmp { negated: self.rng.chance(50), sign: *self.rng.pick(&['=', '>', '<', '~']) };
        let left = self.expression(depth);
        // Often the two sides are nearly equal, so that both outcomes occur.
        let right = match self.rng.below(6) {
            0 => {
                let bin = *self.rng.pick(&[Bin::Add, Bin::Sub]);
                let one = self.rng.pick(&["0", "1", "0.5", "2"]);
                Expr::Bin(bin, Box::new(left.clone()), Box::new(Expr::Number((*one).to_owned())))
            }
            1 | 2 => Expr::Number(self.number()),
            _ => self.expression(depth),
        };
        Condition::Cmp(cmp, left, right)
    }

    fn condition(&mut self, depth: usize) -> Condition {
        if depth == 0 || self.rng.chance(60) {
            let depth = self.rng.below(4);
            return self.comparison(depth);
        }
        let (a, b) = (self.condition(depth - 1), self.condition(depth - 1));
        let (a, b) = (Box::new(a), Box::new(b));
        if self.rng.chance(50) { Condition::And(a, b) } else { Condition::Or(a, b) }
    }

    /// A P-variable that nothing reads.
    fn result(&mut self) -> u32 {
        self.result += 1;
        if self.result >= 980 {
            self.result = 100;
        }
        self.result
    }

    fn statement(&mut self) -> Statement {
        self.integers_only = self.kinds != Kinds::Any && self.rng.chance(70);
        let depth = 1 + self.rng.below(4);
        match self.rng.below(20) {
            0..6 => {
                let condition = self.condition(2);
                Statement::If(condition, self.result())
            }
            // Where compiled code speculates, both index and value often need integrality checks.
            6 | 16 | 17 if self.kinds == Kinds::Speculated || self.rng.chance(33) => {
                let value = self.expression(depth);
                let limit = Expr::Number("16".into());
                let index = Expr::Bin(Bin::Mod, Box::new(self.expression(2)), Box::new(limit));
                let first = Expr::Number(self.result().min(960).to_string());
                let index = Expr::Bin(Bin::Add, Box::new(index), Box::new(first));
                Statement::Indirect(Kind::P, index, value)
            }
            7 => {
                let number = *self.rng.pick(&[100, 110, 125, 131, 160, 168, 183, 20, 60]);
                Statement::Assign(Kind::I, number, None, self.expression(depth))
            }
            8..16 if self.kinds == Kinds::Long => {
                let number = 1 + self.rng.below(self.l as usize) as u32;
                Statement::Assign(Kind::L, number, None, self.expression(depth))
            }
            8..12 => {
                let number = WRITTEN_M + self.rng.below(24) as u32;
                let bin = *self.rng.pick(&[
                    None,
                    None,
                    None,
                    Some(Bin::And),
                    Some(Bin::Or),
                    Some(Bin::Xor),
                ]);
                Statement::Assign(Kind::M, number, bin, self.expression(depth))
            }
            12 => {
                let bin = *self.rng.pick(&[Bin::And, Bin::Or, Bin::Xor]);
                let number = self.rng.below(INPUTS as usize) as u32;
                Statement::Assign(Kind::P, number, Some(bin), self.expression(depth))
            }
            13 => {
                let count = 1 + self.rng.below(4) as u32;
                let first = self.result().min(970);
                Statement::Range(Kind::P, first, count, self.expression(depth))
            }
            14 => {
                let number = 100 + self.rng.below(50) as u32;
                Statement::Assign(Kind::Q, number, None, self.expression(depth))
            }
            _ => {
                let number = self.result();
                Statement::Assign(Kind::P, number, None, self.expression(depth))
            }
        }
    }
}
