//! Computes what statements give, operator by operator in floating point.

use plcc_abi::image::{read_f64, write_f64};
use plcc_abi::pmac::{
    Definition, Field, Format, Kind, Layout, Memory, Range, Space, SparseMemory, arithmetic, fixed,
};

use super::{Bin, Cmp, Condition, Expr, Statement, Statements};

/// A PMAC's memory with its layout.
#[derive(Debug)]
pub struct Machine<'a> {
    /// The image.
    pub image: &'a mut [u8],
    /// Its layout.
    pub layout: &'a Layout,
    /// The words outside the image.
    pub sparse: SparseMemory,
    /// The ranges of I-variables.
    pub ranges: &'a [(u32, Range)],
}

impl Machine<'_> {
    /// One scan of all statements.
    pub fn run(&mut self, statements: &Statements) {
        for statement in &statements.all {
            self.statement(statement, statements);
        }
    }

    fn statement(&mut self, statement: &Statement, all: &Statements) {
        match statement {
            Statement::Assign(kind, number, None, value)
                if all.compiled && is_integer_statement(statement) =>
            {
                let value = self.integer(value, all);
                self.write_long(*number, all, f64::from(value));
            }
            Statement::Assign(kind, number, bin, value) => {
                let value = match bin {
                    None => self.value(value, all),
                    Some(bin) => {
                        let old = self.read(*kind, *number, all);
                        binary(*bin, old, self.value(value, all))
                    }
                };
                self.write(*kind, *number, value, all);
            }
            Statement::Indirect(kind, index, value) => {
                let number = fixed::index(self.value(index, all), self.layout.count - 1);
                let value = self.value(value, all);
                self.write(*kind, number, value, all);
            }
            Statement::Range(kind, first, count, value) => {
                let value = self.value(value, all);
                for number in *first..first + count {
                    self.write(*kind, number, value, all);
                }
            }
            Statement::If(condition, number) => {
                let truth = match all.compiled && is_integer_statement(statement) {
                    true => self.integer_condition(condition, all),
                    false => self.condition(condition, all),
                };
                self.write(Kind::P, *number, if truth { 1.0 } else { 2.0 }, all);
            }
        }
    }

    fn memory(&mut self) -> Memory<'_> {
        Memory { image: self.image, layout: self.layout, sparse: &mut self.sparse }
    }

    fn read(&mut self, kind: Kind, number: u32, all: &Statements) -> f64 {
        match kind {
            Kind::P => read_f64(self.image, self.layout.p_offset(number)),
            Kind::Q => read_f64(self.image, self.layout.q_offset(number)),
            Kind::I => read_f64(self.image, self.layout.i_offset(number)),
            Kind::M => self.memory().read_m(number),
            Kind::L => f64::from(self.long(number, all)),
        }
    }

    fn long(&mut self, number: u32, all: &Statements) -> i32 {
        let Some((space, address, field)) = definition(number, all) else { return 0 };
        fixed::read_field(self.memory().read_word(space, address), field)
    }

    fn write_long(&mut self, number: u32, all: &Statements, value: f64) {
        let Some((space, address, field)) = definition(number, all) else { return };
        let bits = fixed::field_bits(value, field.format);
        self.memory().write_field(space, address, field, bits);
    }

    fn write(&mut self, kind: Kind, number: u32, value: f64, all: &Statements) {
        let value = arithmetic::finite(value);
        let number = number & (self.layout.count - 1);
        match kind {
            Kind::P => write_f64(self.image, self.layout.p_offset(number), value),
            Kind::Q => write_f64(self.image, self.layout.q_offset(number), value),
            Kind::I => {
                let range = self.ranges.iter().find(|(n, _)| *n == number);
                let value = range.map_or(value, |(_, range)| range.convert(value));
                write_f64(self.image, self.layout.i_offset(number), value);
            }
            Kind::M => self.memory().write_m(number, value),
            Kind::L => self.write_long(number, all, value),
        }
    }

    fn value(&mut self, expr: &Expr, all: &Statements) -> f64 {
        match expr {
            Expr::Number(text) => number(text),
            Expr::Var(kind, number) => self.read(*kind, *number, all),
            Expr::Indirect(kind, index) => {
                let number = fixed::index(self.value(index, all), self.layout.count - 1);
                self.read(*kind, number, all)
            }
            Expr::Neg(value) => -self.value(value, all),
            Expr::Bin(bin, left, right) => {
                let left = self.value(left, all);
                binary(*bin, left, self.value(right, all))
            }
            Expr::Call(name, value) => {
                let x = self.value(value, all);
                let radians = read_f64(self.image, self.layout.i_offset(15)) != 0.0;
                let cosine = read_f64(self.image, self.layout.q_offset(0));
                match *name {
                    "SIN" => arithmetic::sin(x, radians),
                    "COS" => arithmetic::cos(x, radians),
                    "TAN" => arithmetic::tan(x, radians),
                    "ASIN" => arithmetic::asin(x, radians),
                    "ACOS" => arithmetic::acos(x, radians),
                    "ATAN" => arithmetic::atan(x, radians),
                    "ATAN2" => arithmetic::atan2(x, cosine, radians),
                    "SQRT" => arithmetic::sqrt(x),
                    "LN" => arithmetic::ln(x),
                    "EXP" => arithmetic::exp(x),
                    "ABS" => arithmetic::abs(x),
                    _ => arithmetic::int(x),
                }
            }
        }
    }

    fn condition(&mut self, condition: &Condition, all: &Statements) -> bool {
        match condition {
            Condition::Cmp(cmp, left, right) => {
                let left = self.value(left, all);
                let right = self.value(right, all);
                let truth = match cmp.sign {
                    '=' => left == right,
                    '>' => left > right,
                    '<' => left < right,
                    _ => (left - right).abs() < 1.0,
                };
                truth != cmp.negated
            }
            Condition::And(a, b) => self.condition(a, all) & self.condition(b, all),
            Condition::Or(a, b) => self.condition(a, all) | self.condition(b, all),
        }
    }

    /// In 24 bits, wrapping after every operation.
    fn integer(&mut self, expr: &Expr, all: &Statements) -> i32 {
        match expr {
            Expr::Number(text) => number(text) as i32,
            Expr::Var(_, number) => arithmetic::wrap24(self.long(*number, all).into()),
            Expr::Indirect(..) => 0,
            Expr::Neg(value) => arithmetic::wrap24(-i64::from(self.integer(value, all))),
            Expr::Call("ABS", value) => {
                arithmetic::wrap24(i64::from(self.integer(value, all)).abs())
            }
            Expr::Call(_, value) => self.integer(value, all),
            Expr::Bin(bin, left, right) => {
                let a = i64::from(self.integer(left, all));
                let b = i64::from(self.integer(right, all));
                arithmetic::wrap24(match bin {
                    Bin::Add => a + b,
                    Bin::Sub => a - b,
                    Bin::Mul => a * b,
                    Bin::Div => a.checked_div(b).unwrap_or(0),
                    Bin::Mod => binary(Bin::Mod, a as f64, b as f64) as i64,
                    Bin::And => a & b,
                    Bin::Or => a | b,
                    Bin::Xor => a ^ b,
                })
            }
        }
    }

    fn integer_condition(&mut self, condition: &Condition, all: &Statements) -> bool {
        match condition {
            Condition::Cmp(Cmp { negated, sign }, left, right) => {
                let left = self.integer(left, all);
                let right = self.integer(right, all);
                let truth = match sign {
                    '>' => left > right,
                    '<' => left < right,
                    _ => left == right,
                };
                truth != *negated
            }
            Condition::And(a, b) => self.integer_condition(a, all) & self.integer_condition(b, all),
            Condition::Or(a, b) => self.integer_condition(a, all) | self.integer_condition(b, all),
        }
    }
}

fn number(text: &str) -> f64 {
    match text.strip_prefix('$') {
        Some(digits) => u32::from_str_radix(digits, 16).map_or(0.0, f64::from),
        None => text.parse().unwrap_or(0.0),
    }
}

fn binary(bin: Bin, a: f64, b: f64) -> f64 {
    match bin {
        Bin::Add => a + b,
        Bin::Sub => a - b,
        Bin::Mul => a * b,
        Bin::Div => arithmetic::div(a, b),
        Bin::Mod => arithmetic::modulo(a, b),
        Bin::And => arithmetic::and(a, b),
        Bin::Or => arithmetic::or(a, b),
        Bin::Xor => arithmetic::xor(a, b),
    }
}

fn definition(number: u32, all: &Statements) -> Option<(Space, u32, Field)> {
    // A single bit is 0 or 1 whatever its format says (guide, Memory Map).
    let bit =
        |field: Field| if field.width == 1 { Field { format: Format::U, ..field } } else { field };
    match all.l.iter().find(|(n, _)| *n == number)?.1 {
        Definition::X { address, field } => Some((Space::X, address, bit(field))),
        Definition::Y { address, field } => Some((Space::Y, address, bit(field))),
        _ => None,
    }
}

/// Whether a statement of a PLCC uses integers: L-variables, integer constants, operators, ABS and
/// INT, nothing else.
fn is_integer_statement(statement: &Statement) -> bool {
    match statement {
        Statement::Assign(Kind::L, _, None, value) => only_longs(value).is_some(),
        Statement::If(condition, _) => condition_of_longs(condition) == Some(true),
        _ => false,
    }
}

/// Nothing where something else stands, else whether there is an L-variable.
fn only_longs(expr: &Expr) -> Option<bool> {
    match expr {
        Expr::Number(text) => {
            let value = number(text);
            (value.fract() == 0.0 && value <= 8_388_607.0).then_some(false)
        }
        Expr::Var(kind, _) => (*kind == Kind::L).then_some(true),
        Expr::Neg(value) | Expr::Call("ABS" | "INT", value) => only_longs(value),
        Expr::Bin(_, left, right) => Some(only_longs(left)? | only_longs(right)?),
        Expr::Indirect(..) | Expr::Call(..) => None,
    }
}

fn condition_of_longs(condition: &Condition) -> Option<bool> {
    match condition {
        Condition::Cmp(_, left, right) => Some(only_longs(left)? | only_longs(right)?),
        Condition::And(a, b) | Condition::Or(a, b) => {
            Some(condition_of_longs(a)? | condition_of_longs(b)?)
        }
    }
}
