//! Prints kernels as PLCs and PLCCs of a PMAC.

use super::{PMAC_FIRST_ELEMENT, PMAC_FIRST_REAL, Printer};
use crate::kernels::{BitStyle, Expr, Language, Op, Stmt};

impl Printer<'_> {
    pub(super) fn pmac_stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::Toggle(bit) => {
                let name = self.bit(*bit);
                self.line(&format!("{name}=1-{name}"));
            }
            Stmt::SetReal(real, value) => {
                let value = self.pmac_value(value, true);
                self.line(&format!("P{}={value}", PMAC_FIRST_REAL + real));
            }
            Stmt::SetBit(bit, value) => {
                let to = self.bit(*bit);
                let is_value = matches!(value, Expr::Bit(_) | Expr::Truth(_));
                if self.kernel.style == BitStyle::Operators || is_value {
                    let line = format!("{to}={}", self.pmac_value(value, true));
                    self.line(&line);
                    return;
                }
                let cond = self.pmac_condition(value, true);
                self.line(&format!("IF {cond}\n{to}=1\nELSE\n{to}=0\nENDIF"));
            }
            Stmt::SetWord(word, value) => {
                let line = format!("{}={}", self.word(*word), self.pmac_value(value, true));
                self.line(&line);
            }
            Stmt::SetElement(index, value) => {
                let (index, value) = (self.pmac_element(index), self.pmac_value(value, true));
                self.line(&format!("{index}={value}"));
            }
            Stmt::If(cond, then, otherwise) => {
                let line = format!("IF {}", self.pmac_condition(cond, true));
                self.line(&line);
                self.stmts(then);
                if !otherwise.is_empty() {
                    self.line("ELSE");
                    self.stmts(otherwise);
                }
                self.line("ENDIF");
            }
        }
    }

    /// A condition; with `outer` it has parentheses around it, as IF needs them.
    fn pmac_condition(&self, expr: &Expr, outer: bool) -> String {
        let text = match expr {
            Expr::Bit(bit) => format!("{}=1", self.bit(*bit)),
            Expr::NotBit(bit) => format!("{}=0", self.bit(*bit)),
            Expr::All(parts) | Expr::Any(parts) => {
                let with = if matches!(expr, Expr::All(_)) { " AND " } else { " OR " };
                let part = |p: &Expr| self.pmac_condition(p, false);
                return format!("({})", parts.iter().map(part).collect::<Vec<_>>().join(with));
            }
            Expr::Op(op, args) => {
                let op = match op {
                    Op::Gt => ">",
                    Op::Lt => "<",
                    _ => "=",
                };
                let [a, b] = [&args[0], &args[1]].map(|arg| self.pmac_value(arg, false));
                format!("{a}{op}{b}")
            }
            _ => String::new(),
        };
        if outer { format!("({text})") } else { text }
    }

    /// The array element with an index.
    fn pmac_element(&self, index: &Expr) -> String {
        format!("P({PMAC_FIRST_ELEMENT}+{})", self.pmac_value(index, false))
    }

    /// An expression; with `outer`, as the right side of an assignment, it has no parentheses around
    /// it.
    fn pmac_value(&self, expr: &Expr, outer: bool) -> String {
        match expr {
            Expr::Bit(bit) => self.bit(*bit),
            Expr::Truth(value) => u8::from(*value).to_string(),
            Expr::Real(real) => format!("P{}", PMAC_FIRST_REAL + real),
            Expr::Int(value) => format!("INT({})", self.pmac_value(value, true)),
            Expr::NotBit(bit) => format!("({}^1)", self.bit(*bit)),
            Expr::All(parts) | Expr::Any(parts) => {
                let with = if matches!(expr, Expr::All(_)) { "&" } else { "|" };
                let parts: Vec<String> = parts.iter().map(|p| self.pmac_value(p, false)).collect();
                format!("({})", parts.join(with))
            }
            Expr::Word(word) => self.word(*word),
            Expr::Element(index) => self.pmac_element(index),
            Expr::Number(number) => format!("{number}"),
            Expr::Op(Op::Quot, args) if self.kernel.language != Language::Plcc => {
                let [a, b] = [&args[0], &args[1]].map(|arg| self.pmac_value(arg, false));
                format!("INT({a}/{b})")
            }
            // There are no shifts.
            Expr::Op(op @ (Op::Left | Op::Right), args) => {
                let Expr::Number(distance) = args[1] else { return String::new() };
                let op = if *op == Op::Left { Op::Mul } else { Op::Quot };
                let factor = Expr::Number(distance.exp2());
                self.pmac_value(&Expr::op(op, args[0].clone(), factor), outer)
            }
            Expr::Op(op, args) => {
                let op = match op {
                    Op::Add => "+",
                    Op::Sub => "-",
                    Op::Mul => "*",
                    Op::Rem => "%",
                    Op::Quot | Op::Div => "/",
                    Op::Mask => "&",
                    Op::Join => "|",
                    Op::Left | Op::Right => "",
                    Op::Eq => "=",
                    Op::Gt => ">",
                    Op::Lt => "<",
                };
                let [a, b] = [&args[0], &args[1]].map(|arg| self.pmac_value(arg, false));
                if outer { format!("{a}{op}{b}") } else { format!("({a}{op}{b})") }
            }
        }
    }
}
