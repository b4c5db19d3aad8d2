//! Prints kernels in PMI.

use super::Printer;
use crate::kernels::{Expr, Op, Stmt};

impl Printer<'_> {
    pub(super) fn pmi_stmt(&mut self, stmt: &Stmt) {
        match stmt {
            Stmt::SetBit(bit, value) => {
                let line = format!("{} = {}", self.bit(*bit), self.pmi_expr(value));
                self.line(&line);
            }
            Stmt::Toggle(bit) => {
                let name = self.bit(*bit);
                self.line(&format!("{name} = /{name}"));
            }
            Stmt::SetWord(word, value) => {
                let line = format!("{} = {}", self.word(*word), self.pmi_expr(value));
                self.line(&line);
            }
            Stmt::SetElement(index, value) => {
                let line = format!("A[{}] = {}", self.pmi_expr(index), self.pmi_expr(value));
                self.line(&line);
            }
            Stmt::SetReal(..) => {}
            Stmt::If(cond, then, otherwise) => {
                let line = format!("IF ({})", self.pmi_expr(cond));
                self.line(&line);
                self.stmts(then);
                let mut rest = otherwise;
                while let [Stmt::If(cond, then, otherwise)] = rest.as_slice() {
                    let line = format!("ELSEIF ({})", self.pmi_expr(cond));
                    self.line(&line);
                    self.stmts(then);
                    rest = otherwise;
                }
                if !rest.is_empty() {
                    self.line("ELSE");
                    self.stmts(rest);
                }
                self.line("ENDIF");
            }
        }
    }

    fn pmi_expr(&self, expr: &Expr) -> String {
        let join = |parts: &[Expr], with: &str| {
            format!("({})", parts.iter().map(|p| self.pmi_expr(p)).collect::<Vec<_>>().join(with))
        };
        match expr {
            Expr::Bit(bit) => self.bit(*bit),
            Expr::Truth(true) => "T".into(),
            Expr::Truth(false) => "F".into(),
            Expr::NotBit(bit) => format!("/{}", self.bit(*bit)),
            Expr::All(parts) => join(parts, " & "),
            Expr::Any(parts) => join(parts, " ! "),
            Expr::Word(word) => self.word(*word),
            Expr::Element(index) => format!("A[{}]", self.pmi_expr(index)),
            Expr::Number(number) => format!("{number}"),
            Expr::Real(_) | Expr::Int(_) => String::new(),
            Expr::Op(op, args) => {
                let op = match op {
                    Op::Add => "+",
                    Op::Sub => "-",
                    Op::Mul => "*",
                    Op::Rem => "%",
                    Op::Quot | Op::Div => "/",
                    // There are no operators on the bits of a word.
                    Op::Mask | Op::Join | Op::Left | Op::Right => "&",
                    Op::Eq => "=",
                    Op::Gt => ">",
                    Op::Lt => "<",
                };
                format!("({} {op} {})", self.pmi_expr(&args[0]), self.pmi_expr(&args[1]))
            }
        }
    }
}
